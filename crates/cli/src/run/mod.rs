//! `hpu run`: runs a scene, and writes its summary and its files.

mod against;
mod axis;
mod device;
mod devices;
mod dut;
mod finished;
mod gimbal;
mod junit;
mod nets;
mod page;
mod phantom;
mod pictures;
mod plan;
mod rows;
mod simulate;
mod suspect;

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum;
use device::shown;
use hpu_cosim::dut::{DutSimulation, Inside};
use hpu_cosim::scene::{DutScene, Experiment};
use hpu_cosim::{AnySimulation, Comparison, Simulation, Wired, WiredSimulation};
use hpu_page::Page;
use hpu_rtl::{Difference, Found, LeapsBeside};
use hpu_signal::Signal;
use hpu_wave::differs;
use plan::{Engine, Plan};
use rows::Estimate;
use serde_json::{Value, json};
use simulate::{Ran, Recorder, simulate};

use crate::certificate;
use crate::notation::Written;
use crate::page::show;
use crate::parameters;
use crate::scene::{self, Loaded, quoted};
use crate::shell::{Exit, Failure, Folder, Single, hdl, interrupt, values, verdict};
use crate::waves::Chosen;

pub use finished::{Finished, Recorded, finished, summary, unseen};
pub(crate) use nets::Overflows;

/// Run a scene and sum it up
#[derive(Default, clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: String,
    #[command(flatten)]
    set: scene::Set,
    /// What advances the run, whatever the scene's model.solver says of events and clock
    #[arg(long, value_enum)]
    driver: Option<DriverArg>,
    /// Judge the scene's expectations although --set changes the scene that they are of
    #[arg(long, conflicts_with_all = ["edges", "compare"])]
    expect: bool,
    /// Run (or compare) so many clock edges instead of the scene's duration; its expectations are not judged then
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    edges: Option<u64>,
    /// Look on after the end of the run, its hand where it is then: is it proved that no count of the encoder ever
    /// arrives again, or does the run repeat to the last bit? Up to so long [default: 10s]; verdict and figures stay
    /// those of the run to its end
    #[arg(long, value_name = "TIME", num_args = 0..=1, require_equals = true, default_missing_value = "10s",
        value_parser = values::time, conflicts_with_all = ["compare", "beside"])]
    for_ever: Option<Duration>,
    /// Write what --for-ever tells into this folder, as a certificate that `hpu certify` checks by running it again
    #[arg(long, value_name = "DIR", requires = "for_ever", conflicts_with_all = ["compare", "beside"])]
    certificates: Option<PathBuf>,
    /// Run `events` against `clock` and compare every net and plant state at every edge; of a scene with a design of
    /// your own, compare its leaps with Verilator; with PORT=NET, hold ports of the design, or signals inside it
    /// (u_vel.vel_r=velocity), against nets of the scene that --beside names
    #[arg(long, num_args = 0.., value_name = "PORT=NET", value_parser = values::port_and_net)]
    compare: Option<Vec<(String, String)>>,
    /// Clock edges by which the ports of --compare come later than the nets; -1: one edge earlier
    #[arg(long, value_name = "EDGES", default_value_t = 0, allow_hyphen_values = true, requires = "compare")]
    latency: i64,
    /// Write wave.fst with its files for GTKWave and Surfer, trace.csv (row by row, as the run goes), pictures and
    /// summary.json into this folder; --set record.clock=true shows clk too
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write wave.vcd with its files for GTKWave and Surfer too
    #[arg(long, requires = "out")]
    vcd: bool,
    /// Write the trace as trace.parquet too
    #[arg(long, requires = "out")]
    parquet: bool,
    #[command(flatten)]
    chosen: Chosen,
    /// Draw no pictures
    #[arg(long, requires = "out")]
    no_plot: bool,
    /// Files of a design of your own in the place of the scene's dut.files, in the order of their compilation
    #[arg(long, value_name = "FILE", num_args = 1..)]
    dut: Vec<PathBuf>,
    /// Hold the run beside this log of a real device, or of another simulator: a table with times and positions; the
    /// scene's expect.recording says the rest
    #[arg(long, value_name = "LOG", conflicts_with_all = ["compare", "beside"])]
    against: Option<PathBuf>,
    /// Draw this scene's run beside, in one figure
    #[arg(long, value_name = "SCENE")]
    beside: Option<String>,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    #[command(flatten)]
    notation: Written,
    /// Write a JUnit report: what the scene expects, and what is compared
    #[arg(short = 'x', long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// The driver of a run.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum DriverArg {
    /// From event to event
    Events,
    /// Edge by edge
    Clock,
    /// The VHDL in GHDL, closed around a world of its own, whose motion is written and judged; the emulator runs beside
    /// it, every net compared at every edge
    Rtl,
}

impl Args {
    /// Checks that the options agree with each other.
    fn agree(&self) -> Result<(), Failure> {
        let said = match (&self.compare, &self.beside) {
            (Some(pairs), _) if pairs.is_empty() && (self.out.is_some() || self.driver.is_some()) => {
                "--compare runs both drivers and writes nothing; leave out --out and --driver"
            }
            (Some(pairs), None) if !pairs.is_empty() => {
                "--compare PORT=NET needs the scene of the nets: --beside SCENE"
            }
            (None, Some(_)) if self.out.is_none() || self.no_plot => {
                "--beside draws a picture (write -o DIR, and leave out --no-plot) or is compared (--compare PORT=NET)"
            }
            _ => return Ok(()),
        };
        Err(Failure::usage(said))
    }

    /// Returns the reason why a run's expectations are not judged: they are for the whole run of the scene as written.
    pub fn unjudged(&self, complete: bool) -> Option<&'static str> {
        // Changes in these sections change no run.
        let of_no_run = |key: &str| ["expect", "accuracy", "about"].contains(&key.split('.').next().unwrap_or(key));
        let asked = self.expect || self.set.set.iter().any(|(key, _)| key.split('.').next() == Some("expect"));
        if !complete {
            Some("the run was not finished")
        } else if self.edges.is_some() {
            Some("they are of the scene's whole duration, and --edges sets another")
        } else if !asked && self.set.set.iter().any(|(key, _)| !of_no_run(key)) {
            Some("they are of the scene as written, and --set changes it; --expect judges them")
        } else if !asked && !self.dut.is_empty() {
            Some("they are of the scene's own files, and --dut gives others; --expect judges them")
        } else {
            None
        }
    }
}

/// Runs `hpu run`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    args.agree()?;
    let junit_file = args.junit.as_deref().map(Single::open).transpose()?;
    let Some((loaded, fitted)) = plan::read(args, interrupt::watch())? else { return Ok(Exit::Interrupted) };
    if let (Experiment::Dut(scene), Some([]), None) = (&loaded.scene, args.compare.as_deref(), args.driver) {
        if args.junit.is_some() {
            return Err(Failure::usage("--junit tells of a run; leave out --compare, or name PORT=NET of a design"));
        }
        return compare_design(args, scene);
    }
    let simulation = ready(args, &loaded.scene)?;
    let other = args.beside.as_ref().map(|other| Loaded::new(other, &[], args.edges)).transpose()?;
    let is_compared = args.compare.is_some() && matches!(simulation, AnySimulation::Dut(_));
    let compared = other.as_ref().filter(|_| is_compared);
    let beside = compared.map(|other| WiredSimulation::new(&other.scene)).transpose().map_err(Failure::file)?;
    let engine = match Plan::new(args, &loaded, &simulation, beside.as_ref())? {
        Plan::Compare(ours) => return compare(ours, args.json),
        Plan::Run(engine) => engine,
    };
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    if let Some(out) = &args.out {
        Estimate::of(&simulation, table(&simulation, engine.compares()).len(), args.parquet).tell(out)?;
    }
    let mut certificates = match &args.certificates {
        Some(dir) => {
            certificate::agree(loaded.source(), loaded.overrides())?;
            Some(Folder::open(dir)?)
        }
        None => None,
    };
    let command = loaded.command() + &engine.options();
    let recorder = folder.as_mut().map_or(Recorder::Nothing, |folder| Recorder::Folder(folder, &command));
    let mut ran = match simulate(args, &loaded, &simulation, &engine, recorder, interrupt::watch()) {
        Err(failure) if failure.exit() == Exit::Interrupted => return Ok(Exit::Interrupted),
        ran => ran?,
    };
    ran.parameters = parameters::of(&loaded.scene, fitted.as_ref(), args.edges.is_some());
    ran.fitted = fitted;
    if interrupt::pressed() {
        return interrupted(&ran, args.json);
    }
    if let Some(mut folder) = folder {
        write(args, &command, other.as_ref(), &mut ran, &mut folder)?;
        if interrupt::pressed() {
            return interrupted(&Ran { files: Vec::new(), ..ran }, args.json);
        }
        folder.commit()?;
    }
    if let Some(file) = junit_file {
        file.write(junit::report(&ran))?;
    }
    let page = page::page(&ran);
    if let (Some(folder), Some(longest)) = (certificates.take(), args.for_ever) {
        certify(&loaded, folder, longest, &page.json()["for_ever"])?;
    }
    show(&page, args.json)?;
    Ok(ran.exit())
}

/// Writes how a run goes on for ever as a certificate, unless nothing is told.
fn certify(loaded: &Loaded, mut folder: Folder, longest: Duration, found: &Value) -> Result<(), Failure> {
    if found["kind"] == "not_told" {
        return Ok(());
    }
    let text = certificate::certificate(loaded.source(), loaded.overrides(), longest, found);
    folder.write("run.certificate", text)?;
    folder.commit()?;
    Ok(())
}

/// Makes the scene of a command ready, with the signals inside its design that a waveform or a comparison shows.
fn ready<'s>(args: &Args, scene: &'s Experiment) -> Result<AnySimulation<'s>, Failure> {
    let design = if let Experiment::Dut(scene) = scene { Some(&scene.dut) } else { None };
    let is_connected = |name: &str| {
        design.is_some_and(|dut| dut.ports.iter().any(|connected| connected.port.eq_ignore_ascii_case(name)))
    };
    // A name that is no connected port may be a port or a signal inside.
    let compared: Vec<_> =
        args.compare.iter().flatten().map(|(port, _)| port).filter(|port| !is_connected(port)).collect();
    let is_compared = |path: &str| compared.iter().any(|name| name.eq_ignore_ascii_case(path));
    let top = design.map_or("", |dut| &dut.top);
    let takes = |path: &str| is_compared(path) || args.out.is_some() && args.chosen.shows(top, path, false);
    let inside = match (&args.out, compared.is_empty()) {
        (None, true) => Inside::Nothing,
        (Some(_), true) => args.chosen.inside(&takes),
        (_, false) => Inside::Chosen(&takes),
    };
    let simulation = AnySimulation::new(scene, &args.hdl.simulators(), inside)?;
    args.chosen.agree(&simulation)?;
    let shown = args.chosen.edges(&simulation)?;
    Ok(match simulation {
        // A comparison looks inside from the first edge to the last.
        AnySimulation::Dut(design) if compared.is_empty() => AnySimulation::Dut(design.looking_inside(shown)),
        simulation => simulation,
    })
}

/// Writes everything except the waveforms and the trace. `other` is a scene to draw beside.
fn write(
    args: &Args,
    command: &str,
    other: Option<&Loaded>,
    ran: &mut Ran,
    folder: &mut Folder,
) -> Result<(), Failure> {
    if !args.no_plot {
        let out = args.out.as_ref().map_or(String::new(), |out| out.display().to_string());
        let command = format!("{command} -o {out}");
        pictures::write(ran, &command, folder)?;
        if let Some(held) = &ran.log {
            let log = args.against.as_ref().map(|log| format!(" --against {}", quoted(&log.display().to_string())));
            folder.draw(&held.picture(&format!("{command}{}", log.unwrap_or_default())))?;
        }
        if let (Some(other), None) = (other, &ran.held) {
            let simulation = AnySimulation::new(&other.scene, &args.hdl.simulators(), Inside::Nothing)?;
            let command = format!("{command} --beside {}", other.scene.name);
            let engine = Engine::new(args, other, &simulation);
            let nothing = Recorder::Nothing;
            let beside = simulate(args, other, &simulation, &engine, nothing, interrupt::watch())?;
            pictures::write_beside([ran, &beside], &command, folder)?;
        }
    }
    if let Some(held) = &ran.log {
        folder.write("against.csv", held.csv())?;
    }
    ran.files = folder.places().map(PathBuf::from).chain([folder.place("summary.json")]).collect();
    folder.write("summary.json", format!("{:#}\n", page::page(ran).json()))
}

/// Returns the names of the nets that pictures of a run draw.
pub(crate) fn drawn_nets(simulation: &AnySimulation) -> Vec<&'static str> {
    shown(simulation).nets().into_iter().map(|net| net.name).collect()
}

/// Returns the nets of the table: those that are drawn and, for VHDL, whether any net has differed.
pub fn table(simulation: &AnySimulation, of_vhdl: bool) -> Vec<Signal> {
    let mut nets = shown(simulation).nets();
    nets.extend(of_vhdl.then(differs));
    nets
}

fn interrupted(ran: &Ran, as_json: bool) -> Result<Exit, Failure> {
    show(page::page(ran).note("interrupted; no files written"), as_json)?;
    Ok(Exit::Interrupted)
}

/// Runs `hpu run --compare` on a scene with a design: leaps against Verilator.
fn compare_design(args: &Args, scene: &DutScene) -> Result<Exit, Failure> {
    let designs = LeapsBeside::new(args.hdl.simulators());
    let simulation = DutSimulation::new(scene, &designs, Inside::Nothing)?;
    let watch = interrupt::watch();
    let mut trace = simulation.brief_trace();
    let ran = watch.counted(simulation.edges(), "edges", || {
        simulation.run(true, &mut trace, &mut (), watch.control()).map_err(Failure::from)
    });
    let summary = ran?;
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }
    let Found { changes, mismatches, first } = designs.found();
    let said = verdict(&format!("{mismatches} mismatches"), mismatches == 0);
    let mut page = Page::default();
    let (name, edges) = (simulation.name(), summary.edges);
    page.data("scene", name).data("edges", edges).data("changes", changes).data("mismatches", mismatches);
    page.note(format!("{name}: leaps against Verilator, {edges} edges, {changes} changes of outputs, {said}"));
    page.data("first", Value::Null);
    if let Some(Difference { edge, port, bits: [leaps, verilator] }) = first {
        page.data("first", json!({ "edge": edge, "name": port, "leap": leaps, "verilator": verilator }));
        let word = |bits: Option<u64>| bits.map_or("unknown".to_string(), |bits| format!("{bits:#x}"));
        page.note(format!(
            "first at edge {edge}: {port} is {} by leaps, {} by Verilator",
            word(leaps),
            word(verilator)
        ));
    }
    show(&page, args.json)?;
    Ok(Exit::when(mismatches == 0))
}

/// Runs `hpu run --compare`.
fn compare(simulation: &WiredSimulation, as_json: bool) -> Result<Exit, Failure> {
    let Comparison { edges, mismatches, first } = simulation.compare(simulation.edges());
    let said = verdict(&format!("{mismatches} mismatches"), mismatches == 0);
    let mut page = Page::default();
    page.data("scene", simulation.name()).data("edges", edges).data("mismatches", mismatches);
    page.note(format!("{}: events against clock, {edges} edges, {said}", simulation.name()));
    page.data("first", Value::Null);
    if let Some(first) = first {
        let (edge, name, events, clock) = (first.edge, &first.name, first.events, first.clock);
        page.data("first", json!({ "edge": edge, "name": name, "events": events, "clock": clock }));
        page.note(format!("first at edge {edge}: {name} is {events:e} by events, {clock:e} by clock"));
    }
    show(&page, as_json)?;
    Ok(Exit::when(mismatches == 0))
}
