//! A loop closed around the VHDL itself: GHDL simulates the wiring, and calls this crate's shared library, which holds
//! the plant and the emulator, at every edge.
//!
//! GHDL 2.0 cannot read signals inside a design by external names. So the wiring is simulated from a copy in the work
//! directory, its text as it is but for one instance added before the end of its architecture: a probe that tells every
//! net. The library, `libhpu_rtl.so`, is what the program carries, or it is looked for beside the running executable
//! and in `deps` there, which is where cargo leaves it.

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use hpu_cosim::scene::{Experiment, shipped_file};
use hpu_cosim::{Control, NetUse, Ready, Rig, Summary, TheLoop, Trace, Wired, follow};
use hpu_datapath::block_by_name;
use hpu_signal::{Observe, SignalUse};

use crate::around::Around;
use crate::ghdl::{GhdlError, Library};
use crate::hdl::Setup;
use crate::loop_bench::{LOOP_BRIDGE, loop_bench, probe, probe_instance};
use crate::motion::{Pipe, Played};
use crate::package::package;
use crate::report::{CheckRow, Tally, tally};
use crate::side::Totals;
use crate::sources::sources;
use crate::testbench::VECTOR_READER;
use crate::tool::{Fault, Tool, ToolError};
use crate::vector::{Header, literal};

/// Name of the shared library.
pub(crate) const LIBRARY: &str = "libhpu_rtl.so";
/// No simulation is so slow: what takes longer for an edge hangs.
const LONGEST_EDGE: Duration = Duration::from_millis(10);

/// A scene to run in VHDL.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LoopScene {
    /// The scene's file, as messages shall call it.
    pub name: String,
    /// The scene's text.
    pub text: String,
    /// Keys and values that replace the scene's.
    pub overrides: Vec<(String, String)>,
    /// Directory of the data files that the scene names; those of shipped scenes are at hand anyway.
    pub data: PathBuf,
    /// Clock edges.
    pub edges: u64,
}

/// Runs a scene in VHDL beside the emulator and compares every net after every edge. The row's block is the wiring, its
/// variant the scene.
///
/// # Errors
///
/// [`GhdlError`] when GHDL or the shared library is missing, the VHDL does not analyse, or the scene has no datapath. A
/// mismatch is a result.
pub fn closed_loop(scene: &LoopScene, setup: &Setup) -> Result<CheckRow, GhdlError> {
    let start = Instant::now();
    let job = LoopJob::new(scene)?;
    Tool::Ghdl.version().map_err(GhdlError::Tool)?;
    let libraries = LoopLibraries::new(std::slice::from_ref(&job), setup)?;
    let mut row = job.row();
    row.add(Ok(job.run(&libraries)?), true, start.elapsed().as_secs_f64());
    Ok(row)
}

/// Runs a scene in VHDL and shows the nets of the VHDL, and the world that it drives, to the observer as
/// [`Wired::run`](hpu_cosim::Wired::run) shows the emulator's; fills the trace, and judges the motion. Every net is compared with the emulator's
/// after every edge: one net more than the wiring has, the last, is 1 from the first edge on at which one differed.
///
/// A word with an unknown bit is shown as [`UNKNOWN`](hpu_signal::UNKNOWN). Where the VHDL differs, the summary does
/// not know what its words have lost.
///
/// # Errors
///
/// As of [`closed_loop`], and when the control has stopped it.
pub fn run_vhdl(
    scene: &LoopScene,
    setup: &Setup,
    rig: &impl Wired,
    trace: &mut Trace,
    observer: &mut dyn Observe,
    control: &Control,
) -> Result<(Summary, CheckRow), GhdlError> {
    let start = Instant::now();
    let mut job = LoopJob::new(scene)?;
    Tool::Ghdl.version().map_err(GhdlError::Tool)?;
    let libraries = LoopLibraries::new(std::slice::from_ref(&job), setup)?;
    let pipe = Pipe::new(libraries.of(&job).dir())?;
    job.environment.push(("HPU_LOOP_RECORD", Pipe::NAME.to_string()));
    let mut row = job.row();
    let summary = follow(rig, trace, observer, |observer| {
        let ended = AtomicBool::new(false);
        let (motion, tally) = thread::scope(|scope| {
            let ghdl = scope.spawn(|| {
                let tally = job.run(&libraries);
                ended.store(true, Ordering::Release);
                tally
            });
            // One net is more than the wiring has: whether any has differed.
            let columns = (rig.nets().len() + 1, rig.row().len());
            let motion = pipe.play(&ended, columns, observer, control);
            (motion, ghdl.join().unwrap_or_else(|panic| resume_unwind(panic)))
        });
        row.add(Ok(tally?), true, start.elapsed().as_secs_f64());
        let broken_off = || ToolError::new(Tool::Ghdl, "tell its motion", Fault::Silent("motion"), "");
        let Played { totals, ranges } = motion.ok_or_else(broken_off)?;
        Ok::<_, GhdlError>(sum_up(rig, totals, &ranges, &row))
    })?;
    Ok((summary, row))
}

/// The summary of a motion that was played, and why it ended early, if it did.
fn sum_up(rig: &impl Wired, totals: Totals, ranges: &[(i64, i64)], row: &CheckRow) -> (Summary, Option<&'static str>) {
    let losses_seen = row.mismatches == 0;
    let nets = rig.nets().into_iter().zip(&totals.uses).zip(ranges);
    let nets = nets.map(|((signal, &usage), &(min, max))| {
        let usage = if losses_seen { usage } else { SignalUse { min, max, rounded: 0, overflowed: 0 } };
        NetUse { signal, usage, losses_seen }
    });
    let summary = Summary {
        verdict: None,
        contact_share: None,
        aborted: None,
        complete: true,
        edges: totals.edges,
        motion_s: 0.0,
        wall_s: row.seconds,
        ticks: totals.edges,
        encoder_edges: totals.encoder_edges,
        output_changes: totals.output_changes,
        mode_changes: totals.mode_changes,
        steps: totals.steps,
        redecided: totals.redecided,
        faults: totals.faults,
        faults_waiting: totals.faults_waiting,
        energy: totals.energy,
        averages: None,
        nets: nets.collect(),
    };
    // One run of a program: nothing is lost by keeping why it ended.
    (summary, totals.over.map(|why| &*why.leak()))
}

/// A scene whose wiring is known.
pub(crate) struct LoopJob {
    pub(crate) wiring: &'static str,
    scene: String,
    pub(crate) edges: u64,
    generics: Vec<(&'static str, String)>,
    environment: Vec<(&'static str, String)>,
    /// The probe, and the instance of it.
    probe: [String; 2],
    /// The columns of what is told of a mismatch.
    around: Around,
}

impl LoopJob {
    pub(crate) fn new(LoopScene { name, text, overrides, data, edges }: &LoopScene) -> Result<Self, GhdlError> {
        let scene = parse(name, text, overrides, data).map_err(GhdlError::Scene)?;
        let session = Ready::new(&scene).map_err(|error| GhdlError::Scene(format!("{name}: {error}")))?;
        if !session.wiring().is_hardware() {
            let why = "a law in floats has no VHDL; write model.datapath = \"words\"";
            return Err(GhdlError::Scene(format!("{name}: {why}")));
        }
        if session.direct().is_some() {
            let why = "with this model.solver it runs without a clock, and VHDL has one";
            return Err(GhdlError::Scene(format!("{name}: {why}")));
        }
        let wiring = session.wiring().block();
        let mut generics: Vec<_> = wiring.generics().into_iter().map(|(name, value)| (name, literal(value))).collect();
        generics.push(("FORMAT", Header::of(wiring).to_string()));
        let set: Vec<_> = overrides.iter().map(|(key, value)| format!("{key}={value}")).collect();
        Ok(Self {
            wiring: wiring.name(),
            scene: session.name().to_string(),
            edges: *edges,
            generics,
            environment: vec![
                ("HPU_SCENE_NAME", name.clone()),
                ("HPU_SCENE_TEXT", text.clone()),
                ("HPU_SCENE_SET", set.join("\n")),
                ("HPU_SCENE_DATA", data.display().to_string()),
                ("HPU_LOOP_EDGES", edges.to_string()),
            ],
            probe: [probe(session.wiring()), probe_instance(session.wiring())],
            around: Around::of_loop(wiring.name(), &session.nets(), session.clock()),
        })
    }

    /// The same, compared from shortly before the wall is reached.
    pub(crate) fn late(mut self) -> Self {
        self.environment.push(("HPU_LOOP_LATE", String::new()));
        self
    }

    pub(crate) fn row(&self) -> CheckRow {
        CheckRow::new(self.wiring, &self.scene)
    }

    pub(crate) fn run(&self, libraries: &LoopLibraries) -> Result<Tally, GhdlError> {
        let unit = format!("tb_loop_{}", self.wiring);
        let longest = u32::try_from(self.edges).map_or(Duration::MAX, |edges| LONGEST_EDGE.saturating_mul(edges));
        let said = libraries.of(self).run(&unit, &self.generics, &self.environment, longest)?;
        let unfinished = || ToolError::new(Tool::Ghdl, &format!("finish {unit}"), Fault::Silent("result"), &said);
        // A late one has its encoders turned before it.
        let is_whole = |tally: &Tally| tally.rows >= self.edges || tally.is_over;
        Ok(tally(&said, &self.around).filter(is_whole).ok_or_else(unfinished)?)
    }
}

/// The wirings of some scenes, each probed, analysed with their blocks and their testbenches. The probe of a wiring may
/// differ by scene (a net of one bit is no vector), and then so does the library.
pub(crate) struct LoopLibraries(Vec<(Vec<Probed>, Library)>);

/// A wiring with its probe.
#[derive(Clone, PartialEq)]
struct Probed {
    wiring: &'static str,
    probe: [String; 2],
}

impl Probed {
    fn of(job: &LoopJob) -> Self {
        Self { wiring: job.wiring, probe: job.probe.clone() }
    }
}

impl LoopLibraries {
    pub(crate) fn new(jobs: &[LoopJob], setup: &Setup) -> Result<Self, GhdlError> {
        let mut groups: Vec<Vec<Probed>> = Vec::new();
        for wired in jobs.iter().map(Probed::of) {
            let fits =
                |group: &&mut Vec<Probed>| group.iter().all(|in_it| in_it.wiring != wired.wiring || *in_it == wired);
            match groups.iter_mut().find(fits) {
                Some(group) if group.contains(&wired) => {}
                Some(group) => group.push(wired),
                None => groups.push(vec![wired]),
            }
        }
        let analysed = |group: Vec<Probed>| library(&group, setup).map(|library| (group, library));
        Ok(Self(groups.into_iter().map(analysed).collect::<Result<_, _>>()?))
    }

    fn of(&self, job: &LoopJob) -> &Library {
        let wired = Probed::of(job);
        let found = self.0.iter().find(|(group, _)| group.contains(&wired));
        &found.expect("the wiring of every job is analysed").1
    }
}

/// What the runner asks its child process for.
pub(crate) struct Asked {
    pub(crate) scene: Experiment,
    pub(crate) edges: u64,
    /// Whether to begin shortly before the wall is reached.
    pub(crate) late: bool,
    /// Where to record the motion of the VHDL's world.
    pub(crate) record: Option<PathBuf>,
}

impl Asked {
    pub(crate) fn from_environment() -> Result<Self, String> {
        let get = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
        let set = get("HPU_SCENE_SET")?;
        let overrides: Vec<_> = set
            .lines()
            .filter_map(|line| line.split_once('='))
            .map(|(key, value)| (key.to_string(), value.to_string()))
            .collect();
        let (name, text, data) = (get("HPU_SCENE_NAME")?, get("HPU_SCENE_TEXT")?, get("HPU_SCENE_DATA")?);
        Ok(Self {
            scene: parse(&name, &text, &overrides, data.as_ref())?,
            edges: get("HPU_LOOP_EDGES")?.parse().map_err(|error| format!("HPU_LOOP_EDGES: {error}"))?,
            late: env::var_os("HPU_LOOP_LATE").is_some(),
            record: env::var_os("HPU_LOOP_RECORD").map(PathBuf::from),
        })
    }
}

fn parse(name: &str, text: &str, overrides: &[(String, String)], data: &Path) -> Result<Experiment, String> {
    let mut load = |file: &str| fs::read(data.join(file)).or_else(|error| shipped_file(file).map_err(|_| error));
    Experiment::parse(name, text, overrides, &mut load).map_err(|error| error.to_string())
}

/// Analyses the blocks, probed copies of wirings, and their testbenches, and puts the shared library beside them.
fn library(group: &[Probed], setup: &Setup) -> Result<Library, GhdlError> {
    let mut packages = vec![
        ("vector_reader.vhd".to_string(), VECTOR_READER.to_string()),
        ("loop_bridge.vhd".to_string(), LOOP_BRIDGE.to_string()),
    ];
    let mut benches = Vec::new();
    for Probed { wiring: name, probe: [probe, instance] } in group {
        let by_default = block_by_name(name).expect("a wiring is a block");
        let text = setup.hdl.text(name)?;
        // The last one ends the architecture.
        let Some(end) = text.to_lowercase().rfind("end architecture") else {
            let said = format!("{} has no `end architecture`", setup.hdl.file(name).display());
            return Err(GhdlError::Failed { step: format!("close the loop of {name}"), said });
        };
        packages.push((format!("{name}_pkg.vhd"), package(&*by_default)));
        packages.push((format!("probe_{name}.vhd"), probe.clone()));
        benches.push((format!("{name}.vhd"), format!("{}{instance}{}", &text[..end], &text[end..])));
        benches.push((format!("tb_loop_{name}.vhd"), loop_bench(&*by_default)));
    }
    let mut blocks = sources(group.iter().map(|wired| wired.wiring), &setup.hdl)?;
    blocks.retain(|name| TheLoop::all().iter().all(|wiring| wiring.name() != name));
    let library = Library::analyse(&packages, setup, blocks.iter().map(String::as_str), &benches)?;
    if setup.library.is_empty() {
        let shared = shared_library()?;
        fs::copy(&shared, library.dir().join(LIBRARY)).map_err(|error| GhdlError::Io(shared, error))?;
    } else {
        library.write(LIBRARY, setup.library)?;
    }
    Ok(library)
}

/// The shared library of this build, which no program carries.
pub(crate) fn shared_library() -> Result<PathBuf, GhdlError> {
    let exe = env::current_exe().map_err(|error| GhdlError::Io(PathBuf::from("the executable"), error))?;
    let beside = exe.parent().unwrap_or(Path::new("."));
    let places = [beside.join("deps").join(LIBRARY), beside.join(LIBRARY)];
    places.iter().find(|place| place.exists()).cloned().ok_or_else(|| GhdlError::NoLibrary(places.to_vec()))
}
