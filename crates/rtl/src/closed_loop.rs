//! A loop closed around the VHDL itself. It uses the machinery for designs of the user's own: GHDL simulates the wiring
//! in a bench that answers requests, while the plant and the emulator run in this process.
//!
//! GHDL 2.0 cannot read signals inside a design by external names. The wiring is therefore simulated from a copy in the
//! work directory. The copy has the text of the original and, before the end of its architecture, statements that
//! report every net inside. The bench talks through the shared library of `hpu-vhpi`.

use std::time::{Duration, Instant};

use hpu_cosim::scene::{Dut, DutClock, DutReset, Engine, Experiment, Generic, Identifier, Registers, Standard};
use hpu_cosim::{Control, NetUse, SceneFile, Simulation, Summary, Trace, Wired, WiredSimulation, follow};
use hpu_signal::{Clock, Observe, SignalUse};
use hpu_wave::Around;

use crate::dut::{ANSWER, Model, Names, Process, bench, bridge, interface, simulate};
use crate::engines::error::{Error, Reason};
use crate::engines::ghdl::Library;
use crate::engines::hdl::Setup;
use crate::engines::library::place_library;
use crate::engines::sources::sources;
use crate::engines::tool::{Fault, Tool, ToolError};
use crate::lockstep::{Lockstep, Played};
use crate::vectors::around;
use crate::vectors::report::{CheckRow, Tally};
use crate::vectors::vector::literal;

/// A scene to run in VHDL.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LoopScene {
    /// The scene's text, and the place of its data files.
    pub source: SceneFile,
    /// Keys and values that replace the scene's.
    pub overrides: Vec<(String, String)>,
    /// Number of clock edges to run.
    pub edges: u64,
}

/// Runs a scene in VHDL beside the emulator and compares every net after every edge. In the returned row, the block is
/// the wiring and the variant is the scene.
///
/// # Errors
///
/// [`Error`] when GHDL or the shared library is missing, the VHDL does not analyse, or the scene has no datapath. A
/// mismatch is a result.
pub fn closed_loop(scene: &LoopScene, setup: &Setup) -> Result<CheckRow, Error> {
    let start = Instant::now();
    let job = LoopJob::new(scene)?;
    Tool::Ghdl.version(setup.timeout)?;
    let loops = Loops::new(std::slice::from_ref(&job), setup)?;
    let mut row = job.row();
    row.add(Ok(job.run(&loops)?), true, start.elapsed().as_secs_f64());
    Ok(row)
}

/// Runs a scene in VHDL and shows the nets of the VHDL, and the world that it drives, to the observer, as
/// [`Wired::run`](hpu_cosim::Wired::run) shows those of the emulator. Fills the trace and judges the motion. Every net
/// is compared with the emulator's after every edge. The observer sees one net more than the wiring has, the last: it
/// is 1 from the first edge at which a net differed.
///
/// A word with an unknown bit is shown as [`UNKNOWN`](hpu_signal::UNKNOWN). Where the VHDL differs, the summary cannot
/// tell which bits its words have lost.
///
/// # Errors
///
/// The errors of [`closed_loop`], and an error when the control has stopped the run.
pub fn run_vhdl(
    scene: &LoopScene,
    setup: &Setup,
    simulation: &impl Wired,
    trace: &mut Trace,
    observer: &mut dyn Observe,
    control: &Control,
) -> Result<(Summary, CheckRow), Error> {
    let start = Instant::now();
    let job = LoopJob::new(scene)?;
    Tool::Ghdl.version(setup.timeout)?;
    let loops = Loops::new(std::slice::from_ref(&job), setup)?;
    let mut row = job.row();
    let summary = follow(simulation, trace, observer, |observer, from| {
        let mut lockstep = Lockstep::new(simulation, job.edges, false);
        lockstep.show(observer, simulation.stride(), from);
        let tally = job.close(&loops, &mut lockstep, control)?;
        row.add(Ok(tally), true, start.elapsed().as_secs_f64());
        Ok::<_, Error>(sum_up(simulation, lockstep.played(simulation.clock().period_s()), &row))
    })?;
    Ok((summary, row))
}

/// Returns the summary of the motion that was run, and the reason if it ended early.
fn sum_up(simulation: &impl Wired, played: Played, row: &CheckRow) -> (Summary, Option<&'static str>) {
    let Played { summary, over, uses, ranges } = played;
    let losses_seen = row.mismatches == 0;
    let nets = simulation.nets().into_iter().zip(uses).zip(ranges);
    let nets = nets.map(|((signal, usage), (min, max))| match losses_seen {
        true => summary.used(signal, usage),
        false => NetUse { signal, usage: SignalUse { min, max, rounded: 0, overflowed: 0 }, losses_seen },
    });
    let nets = nets.collect();
    (Summary { complete: true, wall_s: row.seconds, nets, ..summary }, over)
}

/// A scene whose wiring is known, ready to be run.
pub(crate) struct LoopJob {
    pub(crate) wiring: &'static str,
    scene: Experiment,
    pub(crate) edges: u64,
    /// Whether the comparison begins shortly before the wall is reached.
    is_late: bool,
    /// The statements by which the copy of the wiring reports its inner nets, and the names of all nets.
    tells: String,
    nets: Vec<&'static str>,
    /// The number of ports. They are the first of the nets.
    ports: usize,
    /// The wiring as a design.
    dut: Dut,
    clock: Clock,
    /// The columns of the rows that are shown around a mismatch.
    around: Around,
}

impl LoopJob {
    pub(crate) fn new(LoopScene { source, overrides, edges }: &LoopScene) -> Result<Self, Error> {
        let name = &source.name;
        let scene = source.parse(overrides).map_err(Error::file)?;
        let simulation = WiredSimulation::new(&scene).map_err(|error| Error::file(format!("{name}: {error}")))?;
        if !simulation.wiring().is_hardware() {
            let why = match simulation {
                WiredSimulation::Transfer(_) => {
                    "the difference equation around a transfer function has no VHDL; of up to two delays the block \
                     biquad has its words"
                }
                _ => "a law in floats has no VHDL; write model.datapath = \"words\"",
            };
            return Err(Error::file(format!("{name}: {why}")));
        }
        if simulation.direct().is_some() {
            let why = "with this model.solver it runs without a clock, and VHDL has one";
            return Err(Error::file(format!("{name}: {why}")));
        }
        let block = simulation.wiring().block();
        let nets: Vec<_> = simulation.nets().iter().map(|net| net.name).collect();
        let ports = block.inputs().len() + block.outputs().len();
        let inside = nets.iter().enumerate().skip(ports);
        let tells =
            inside.map(|(index, net)| format!("  work.hpu_dut_bridge.hpu_dut_tell({index}, {net});\n")).collect();
        let generics = block.generics().into_iter();
        let dut = Dut {
            files: Vec::new(),
            beside: Vec::new(),
            library: Identifier::fixed("work"),
            libraries: Vec::new(),
            top: Identifier::fixed(block.name()),
            standard: Standard::Vhdl2008,
            engine: Engine::Ghdl,
            registers: Registers::Unknown,
            clocks: vec![DutClock { port: Identifier::fixed("clk"), divide: 1 }],
            reset: Some(DutReset { port: Identifier::fixed("rst"), active_low: false, clocks: 1 }),
            generics: generics.map(|(name, value)| (Identifier::fixed(name), Generic::Text(literal(value)))).collect(),
            ports: Vec::new(),
            floats: false,
            formats: Vec::new(),
        };
        let (wiring, clock) = (block.name(), simulation.clock());
        let around = around::of_loop(wiring, &simulation.nets(), clock);
        Ok(Self { wiring, edges: *edges, is_late: false, tells, nets, ports, dut, clock, around, scene })
    }

    /// Returns the same job, compared from shortly before the wall is reached.
    pub(crate) fn late(mut self) -> Self {
        self.is_late = true;
        self
    }

    pub(crate) fn row(&self) -> CheckRow {
        CheckRow::new(self.wiring, &self.scene.name)
    }

    pub(crate) fn run(&self, loops: &Loops) -> Result<Tally, Error> {
        let simulation = WiredSimulation::new(&self.scene).map_err(Error::file)?;
        let mut lockstep = Lockstep::new(&simulation, self.edges, self.is_late);
        self.close(loops, &mut lockstep, &Control::default())
    }

    /// Runs the bench in GHDL and closes the loop through `lockstep`.
    fn close(&self, loops: &Loops, lockstep: &mut Lockstep, control: &Control) -> Result<Tally, Error> {
        let Bench { unit, ports, .. } = loops.benches.iter().find(|bench| bench.of(self)).expect("every job has one");
        loops.library.elaborate(unit)?;
        let mut command = simulate(self.dut.standard, loops.library.dir(), unit);
        // Words are unknown before the first edge. The comparison sees that; a warning for each row would not help.
        command.arg("--ieee-asserts=disable");
        let start = |words: &[u64], drives: &[bool], changes: &mut Vec<_>| {
            Process::start(Tool::Ghdl, command, (loops.limit, None), (words, drives), changes)
        };
        match lockstep.run(ports, start, control).map_err(Error::into_reason) {
            Ok(()) => Ok(lockstep.tally(&self.around)),
            Err(Reason::Lost(error, _) | Reason::Tool(error)) => {
                // This bench never ends by itself.
                let fault = if let Fault::Failed(0) = error.fault { Fault::Silent("result") } else { error.fault };
                Err(Error::of_ghdl(ToolError { step: format!("run {unit}"), fault, ..error }))
            }
            Err(error) => Err(Error::failed(&format!("run {unit}"), Error::from(error).to_string())),
        }
    }
}

/// The wirings of some scenes, analysed with their blocks: each in a copy that reports its nets, with a bench for each
/// scene.
pub(crate) struct Loops {
    benches: Vec<Bench>,
    library: Library,
    /// The longest time for an answer.
    limit: Duration,
}

/// The bench of a scene.
struct Bench {
    wiring: &'static str,
    generics: Vec<(Identifier, Generic)>,
    clock: Clock,
    /// The bench's entity.
    unit: String,
    /// The net of each port of the bench.
    ports: Vec<Option<usize>>,
}

impl Bench {
    fn of(&self, LoopJob { wiring, dut, clock, .. }: &LoopJob) -> bool {
        (self.wiring, &self.generics, self.clock) == (*wiring, &dut.generics, *clock)
    }
}

impl Loops {
    pub(crate) fn new(jobs: &[LoopJob], setup: &Setup) -> Result<Self, Error> {
        let mut wirings: Vec<&LoopJob> = Vec::new();
        for job in jobs {
            if wirings.iter().all(|other| other.wiring != job.wiring) {
                wirings.push(job);
            }
        }
        let (mut texts, mut benches) = (Vec::new(), Vec::<Bench>::new());
        for of_wiring in wirings {
            let wiring = of_wiring.wiring;
            let failed = |said: String| Error::failed(&format!("close the loop of {wiring}"), said);
            let text = setup.hdl.text(wiring)?;
            let file = setup.hdl.file(wiring);
            // The last `end architecture` ends the architecture.
            let Some(end) = text.to_lowercase().rfind("end architecture") else {
                return Err(failed(format!("{} has no `end architecture`", file.display())));
            };
            texts.push((format!("{wiring}.vhd"), format!("{}{}\n{}", &text[..end], of_wiring.tells, &text[end..])));
            let interface = interface(&[&text], wiring);
            let interface = interface.ok_or_else(|| failed(format!("{} has no such entity", file.display())))?;
            let ports: Vec<_> = interface.ports.iter().map(|port| port.name.to_lowercase()).collect();
            let needed = ["clk", "rst"].iter().chain(&of_wiring.nets[..of_wiring.ports]);
            if let Some(missing) = needed.copied().find(|name| !ports.iter().any(|port| port == name)) {
                return Err(failed(format!("{} has no port `{missing}`", file.display())));
            }
            let nets = ports.iter().filter(|port| *port != "clk" && *port != "rst");
            let net = |port: &String| of_wiring.nets.iter().position(|net| net == port);
            let nets: Vec<_> = nets.map(net).chain((of_wiring.ports..of_wiring.nets.len()).map(Some)).collect();
            for job in jobs.iter().filter(|job| job.wiring == wiring) {
                if benches.iter().any(|bench| bench.of(job)) {
                    continue;
                }
                let unit = format!("bench_{wiring}_{}", benches.len());
                let (generics, clock) = (job.dut.generics.clone(), job.clock);
                let model = Model { dut: &job.dut, clock, settle: 1, seed: 0, names: Names::NONE };
                let text = bench(&unit, &model, &interface);
                let text = text.map_err(|error| failed(error.to_string()))?;
                texts.push((format!("{unit}.vhd"), text));
                benches.push(Bench { wiring, generics, clock, unit, ports: nets.clone() });
            }
        }
        let mut blocks = sources(jobs.iter().map(|job| job.wiring), &setup.hdl)?;
        blocks.retain(|name| jobs.iter().all(|job| job.wiring != name));
        let bridge = [("hpu_dut_bridge.vhd".to_string(), bridge(Standard::Vhdl2008))];
        let library = Library::analyse(&bridge, setup, blocks.iter().map(String::as_str), &texts)?;
        place_library(library.dir())?;
        Ok(Self { benches, library, limit: setup.timeout.unwrap_or(ANSWER) })
    }
}
