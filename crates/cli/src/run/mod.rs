//! `hpu run`: runs a scene, and writes its summary and its files.

mod axis;
mod contact;
mod device;
mod dut;
mod gimbal;
mod junit;
mod nets;
pub mod overflow;
pub mod page;
mod phantom;
mod pictures;
mod rows;
mod suspect;

use std::fs;
use std::path::PathBuf;

use clap::ValueEnum;
use hpu_chart::Picture;
use hpu_cosim::scene::{Datapath, Expectation, Experiment, OutcomeKind};
use hpu_cosim::{
    AnySimulation, Comparison, Driver, SceneFile, Simulation, Summary, Trace, Wired, WiredSimulation, judged_window_s,
    metric,
};
use hpu_page::Page;
use hpu_rtl::{CheckRow, Hdl, LoopScene, Setup, run_vhdl};
use hpu_signal::{Cycle, Notation, Observe, Signal};
use hpu_study::fit::Fit;
use hpu_wave::differs;
use serde_json::{Value, json};

use crate::notation::Written;
use crate::page::show;
use crate::parameters::{self, Said};
use crate::scene::{self, Loaded, quoted};
use crate::shell::exit::{Exit, Failure};
use crate::shell::files::{Folder, Single};
use crate::shell::progress::Watch;
use crate::shell::terminal::verdict;
use crate::waves::Waves;
use crate::{fit, shell::hdl, shell::interrupt};

use device::shown;
use nets::{NetComparison, Pairs};
use overflow::Overflows;
use rows::{Estimate, Rows};
use suspect::Suspect;

/// Run a scene and sum it up; without a scene, list the shipped ones
#[derive(Default, clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: Option<String>,
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
    /// Run `events` against `clock` and compare every net and plant state at every edge; with PORT=NET, hold ports of
    /// the scene's own design against nets of the scene that --beside names
    #[arg(long, num_args = 0.., value_name = "PORT=NET", value_parser = scene::port_and_net)]
    compare: Option<Vec<(String, String)>>,
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
    /// Draw no pictures
    #[arg(long, requires = "out")]
    no_plot: bool,
    /// Files of a design of your own in the place of the scene's dut.files, in the order of their compilation
    #[arg(long, value_name = "FILE", num_args = 1..)]
    dut: Vec<PathBuf>,
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

/// A complete run with everything that is reported about it.
pub struct Ran<'s> {
    /// Name of the driver.
    pub driver: &'static str,
    /// The solver that moved the device, by its name in the scene.
    pub solver: &'static str,
    /// The scene, ready to run.
    pub simulation: &'s AnySimulation<'s>,
    /// The summary.
    pub summary: Summary,
    /// The recorded trace.
    pub trace: Trace,
    /// The judged window of the complete run, in seconds.
    pub window_s: [f64; 2],
    /// Every parameter, with the source of its value.
    pub parameters: Vec<Said>,
    /// The comparison of a design's ports with the nets of a scene of ours.
    pub held: Option<NetComparison>,
    /// The comparison with the VHDL, and the source of the VHDL.
    pub rtl: Option<(CheckRow, Hdl)>,
    /// The expected outcome, if there is one, and whether it was met.
    pub outcome_met: Option<(OutcomeKind, bool)>,
    /// The expected numbers, the actual ones, and whether each is within its tolerance.
    pub numbers: Vec<(Expectation, Option<f64>, bool)>,
    /// The mistake in the connections of a design whose wall gives no torque, if one was found.
    pub suspect: Option<Suspect>,
    /// The reason why the scene's expectations were not judged, if the scene has any.
    pub unjudged: Option<&'static str>,
    /// The model that was chosen, if the scene leaves the model open.
    pub fitted: Option<Fit>,
    /// The notation of word formats.
    pub notation: Notation,
    /// The files that were written.
    pub files: Vec<PathBuf>,
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

    /// Returns the changes of the scene that `--set` and `--dut` ask for.
    fn changes(&self) -> Result<Vec<(String, String)>, Failure> {
        let mut set = self.set.set.clone();
        if !self.dut.is_empty() {
            // The files that a scene names are beside the scene, but these are relative to the working directory.
            let place = |file: &PathBuf| {
                let place = fs::canonicalize(file).map_err(|error| Failure::at(file, error))?;
                Ok(format!("{:?}", place.display().to_string()))
            };
            let places = self.dut.iter().map(place).collect::<Result<Vec<_>, Failure>>()?;
            set.push(("dut.files".to_string(), format!("[{}]", places.join(", "))));
        }
        Ok(set)
    }

    /// Returns the reason why a run's expectations are not judged: they are for the whole run of the scene as written.
    fn unjudged(&self, complete: bool) -> Option<&'static str> {
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

impl Ran<'_> {
    fn exit(&self) -> Exit {
        let met = self.outcome_met.is_none_or(|(_, met)| met) && self.numbers.iter().all(|(.., met)| *met);
        Exit::when(
            met && self.held.as_ref().is_none_or(NetComparison::ok)
                && self.rtl.as_ref().is_none_or(|(row, _)| row.ok()),
        )
    }
}

/// Reads a scene, and chooses its model if it leaves the model open; `None` when interrupted.
fn load(
    source: &SceneFile,
    set: &[(String, String)],
    edges: Option<u64>,
    watch: Watch,
) -> Result<Option<(Loaded, Option<Fit>)>, Failure> {
    let mut loaded = Loaded::of(source.clone(), set, edges)?;
    let mut fitted = None;
    if loaded.scene.auto {
        let Some(found) = fit::least(source, set, None, watch.control())? else { return Ok(None) };
        let set: Vec<_> = set.iter().chain(&found.set).cloned().collect();
        loaded = Loaded::of(source.clone(), &set, edges)?;
        fitted = Some(found);
    }
    if let Experiment::Axis(scene) = &loaded.scene
        && scene.model.datapath == Datapath::Linear
    {
        let error = scene.error("model.datapath", "\"linear\" is a law without a datapath to run; see hpu limits");
        return Err(if error.is_override() { Failure::usage(error) } else { Failure::file(error) });
    }
    Ok(Some((loaded, fitted)))
}

/// Runs a scene as it is written, and returns its summary as `hpu run --json` prints it; `None` when interrupted.
pub fn summary(name: &str) -> Result<Option<Value>, Failure> {
    Ok(finished(&scene::source(name)?, &[], interrupt::watch(), unseen)?.map(|(finished, _)| finished.page.json()))
}

/// A run of a scene, which other programs hold.
pub struct Finished {
    /// The page of the run.
    pub page: Page,
    loaded: Loaded,
    args: Args,
}

/// A run that was recorded: its trace for pictures, its summary, and its observer.
pub struct Recorded<O> {
    /// The observer, which has seen the whole run.
    pub observer: O,
    /// The summary of the run.
    pub summary: Summary,
    driver: &'static str,
    trace: Trace,
}

impl<O> Recorded<O> {
    /// Returns the recording without its observer, and the observer.
    pub fn split(self) -> (Recorded<()>, O) {
        let Self { observer, summary, driver, trace } = self;
        (Recorded { observer: (), summary, driver, trace }, observer)
    }
}

/// Makes no observer of a run.
///
/// # Errors
///
/// None.
pub fn unseen(_: &AnySimulation) -> Result<(), Failure> {
    Ok(())
}

/// Runs a scene with these overrides, as `hpu run` does. `observed` makes an observer of the run from the simulation.
/// Returns the run and its recording, which has a trace for pictures if the observer watches; `None` when interrupted.
///
/// # Errors
///
/// As the command.
pub fn finished<O: Observe>(
    source: &SceneFile,
    set: &[(String, String)],
    watch: Watch,
    observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
) -> Result<Option<(Finished, Recorded<O>)>, Failure> {
    let args = Args { set: scene::Set { set: set.to_vec() }, ..Args::default() };
    let Some((loaded, fitted)) = load(source, set, None, watch)? else { return Ok(None) };
    let page = |mut ran: Ran| {
        ran.parameters = parameters::of(&loaded.scene, fitted.as_ref(), false);
        ran.fitted = fitted;
        let page = page::page(&ran);
        (page, ran.driver, ran.summary, ran.trace)
    };
    let Some(((page, driver, summary, trace), observer)) = observe(&loaded, &args, watch, observed, page)? else {
        return Ok(None);
    };
    Ok(Some((Finished { page, loaded, args }, Recorded { observer, summary, driver, trace })))
}

/// Runs a scene and shows it to an observer; `None` when interrupted.
fn observe<O: Observe, T>(
    loaded: &Loaded,
    args: &Args,
    watch: Watch,
    observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
    told: impl FnOnce(Ran) -> T,
) -> Result<Option<(T, O)>, Failure> {
    let simulation = AnySimulation::new(&loaded.scene, &args.hdl.simulators(), false)?;
    let mut observer = observed(&simulation)?;
    let ran = simulate(&loaded.scene, &simulation, args, None, None, Recorder::Other(&mut observer), watch)?;
    if watch.is_stopped() {
        return Ok(None);
    }
    Ok(Some((told(ran), observer)))
}

impl Finished {
    /// Returns the scene that was run, with its model if that was chosen.
    pub fn scene(&self) -> &Experiment {
        &self.loaded.scene
    }

    /// Returns the command that runs the scene.
    pub fn command(&self) -> String {
        self.loaded.command()
    }

    /// Runs the scene again, to the same bits, for another observer; `None` when interrupted.
    ///
    /// # Errors
    ///
    /// As the run.
    pub fn again<O: Observe>(
        &self,
        watch: Watch,
        observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
    ) -> Result<Option<Recorded<O>>, Failure> {
        let parts = |ran: Ran| (ran.driver, ran.summary, ran.trace);
        let seen = observe(&self.loaded, &self.args, watch, observed, parts)?;
        Ok(seen.map(|((driver, summary, trace), observer)| Recorded { observer, summary, driver, trace }))
    }

    /// Draws the pictures of a recording of this run.
    ///
    /// # Errors
    ///
    /// As [`AnySimulation::new`].
    pub fn pictures<O>(&self, recorded: &Recorded<O>) -> Result<Vec<Picture>, Failure> {
        let simulation = AnySimulation::new(&self.loaded.scene, &self.args.hdl.simulators(), false)?;
        let ran = Ran {
            driver: recorded.driver,
            solver: self.loaded.scene.setup().solver().name(),
            simulation: &simulation,
            summary: recorded.summary.clone(),
            trace: recorded.trace.clone(),
            window_s: judged_window_s(&self.loaded.scene),
            parameters: Vec::new(),
            held: None,
            rtl: None,
            outcome_met: None,
            numbers: Vec::new(),
            suspect: None,
            unjudged: None,
            fitted: None,
            notation: Notation::Triple,
            files: Vec::new(),
        };
        Ok(shown(&simulation).pictures(&ran, &self.loaded.command()))
    }
}

/// Runs `hpu run`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(name) = &args.scene else {
        return scene::list(args.json);
    };
    args.agree()?;
    if !args.dut.is_empty() && !scene::source(name)?.text.contains("dut") {
        let reason =
            "--dut is for a scene with a [dut], which says what its ports are connected to: hpu scenes --template";
        return Err(Failure::usage(format!("{name}: {reason}")));
    }
    let set = args.changes()?;
    let junit_file = args.junit.as_deref().map(Single::open).transpose()?;
    let watch = interrupt::watch();
    let source = scene::source(name)?;
    let Some((loaded, fitted)) = load(&source, &set, args.edges, watch)? else { return Ok(Exit::Interrupted) };
    if args.driver != Some(DriverArg::Rtl) {
        args.hdl.agree(&loaded.scene)?;
    }
    let expect = &loaded.scene.expect;
    if args.expect && expect.outcome.is_none() && expect.numbers.is_empty() {
        let said = "expects nothing; write [expect], or --set expect.outcome=settled";
        return Err(Failure::usage(format!("--expect: {} {said}", loaded.scene.name)));
    }
    crate::show::tell_changed_defaults(&loaded.scene, &source, &set)?;
    let simulation = AnySimulation::new(&loaded.scene, &args.hdl.simulators(), args.out.is_some())?;
    let other = args.beside.as_ref().map(|other| Loaded::new(other, &[], args.edges)).transpose()?;
    let drivers = args.compare.as_ref().is_some_and(Vec::is_empty);
    if let AnySimulation::Dut(_) = simulation
        && (drivers || args.driver.is_some())
    {
        let reason = "a design of your own is clocked by its simulator: write dut.engine for --driver, and \
                      --compare PORT=NET --beside SCENE";
        return Err(Failure::usage(format!("{}: {reason}", simulation.name())));
    }
    if let AnySimulation::Ours(ours) = &simulation
        && ours.direct().is_some()
        && (args.compare.is_some() || args.driver.is_some())
    {
        let solver = "a law in floats with this model.solver runs without a clock, so no driver advances it";
        return Err(Failure::usage(format!("{}: {solver}; leave out --driver and --compare", simulation.name())));
    }
    if let (Some(pairs), AnySimulation::Ours(ours)) = (&args.compare, &simulation) {
        if !pairs.is_empty() {
            let reason = "PORT=NET is for a scene with a [dut]; VHDL of ours is compared by --driver rtl";
            return Err(Failure::usage(format!("{}: {reason}", simulation.name())));
        }
        if junit_file.is_some() {
            return Err(Failure::usage(
                "--junit tells of a run; leave out --compare, or name PORT=NET of a design of yours",
            ));
        }
        return compare(ours, args.json);
    }
    let vhdl = (args.driver == Some(DriverArg::Rtl)).then(|| args.hdl.setup());
    let vhdl = vhdl.map(|setup| (loaded.in_vhdl(loaded.scene.edges()), setup));
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    if let Some(out) = &args.out {
        Estimate::of(&simulation, table(&simulation, vhdl.is_some()).len(), args.parquet).tell(out)?;
    }
    let command = command(&loaded, vhdl.as_ref());
    let recorded = match &mut folder {
        Some(folder) => Recorder::Folder(folder, &command),
        None => Recorder::Nothing,
    };
    let beside = match (&args.compare, &other) {
        (Some(_), Some(other)) => Some(WiredSimulation::new(&other.scene).map_err(Failure::file)?),
        _ => None,
    };
    let against = beside.as_ref().zip(args.compare.as_deref());
    let mut ran = match simulate(&loaded.scene, &simulation, args, vhdl.as_ref(), against, recorded, watch) {
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
        file.write(&junit::report(&ran))?;
    }
    show(&page::page(&ran), args.json)?;
    Ok(ran.exit())
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
        if let (Some(other), None) = (other, &ran.held) {
            let simulation = AnySimulation::new(&other.scene, &args.hdl.simulators(), false)?;
            let command = format!("{command} --beside {}", other.scene.name);
            let vhdl = ran.rtl.as_ref().map(|_| (other.in_vhdl(other.scene.edges()), args.hdl.setup()));
            let beside =
                simulate(&other.scene, &simulation, args, vhdl.as_ref(), None, Recorder::Nothing, interrupt::watch())?;
            pictures::write_beside([ran, &beside], &command, folder)?;
        }
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

/// Returns the command that runs a scene, in the emulator or in this VHDL.
fn command(loaded: &Loaded, vhdl: Option<&(LoopScene, Setup)>) -> String {
    let hdl = match vhdl {
        None => String::new(),
        Some((_, Setup { hdl: Hdl::Carried, .. })) => " --driver rtl".to_string(),
        Some((_, setup)) => format!(" --driver rtl --hdl {}", quoted(&setup.hdl.to_string())),
    };
    loaded.command() + &hdl
}

/// The waveforms and rows of a run, as they are written to disk.
struct WavesAndRows(Waves, Rows);

impl Observe for WavesAndRows {
    fn measures(&self) -> bool {
        self.1.measures()
    }

    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.0.nets(cycle, words);
        self.1.nets(cycle, words);
    }

    fn watches_overflows(&self) -> bool {
        self.0.watches_overflows()
    }

    fn overflows(&mut self, cycle: Cycle, nets: u64) {
        self.0.overflows(cycle, nets);
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.0.reals(cycle, values);
        self.1.reals(cycle, values);
    }
}

/// Keeps a run as it goes, beside its summary.
enum Recorder<'a> {
    /// Nothing.
    Nothing,
    /// Waveforms and rows in a folder; the command goes into the heads of the files.
    Folder(&'a mut Folder, &'a str),
    /// An observer of another program.
    Other(&'a mut dyn Observe),
}

/// Runs the scene, in VHDL if `vhdl` is given.
fn simulate<'s>(
    scene: &Experiment,
    simulation: &'s AnySimulation<'s>,
    args: &Args,
    vhdl: Option<&(LoopScene, Setup)>,
    against: Option<(&WiredSimulation, &[(String, String)])>,
    recorder: Recorder,
    watch: Watch,
) -> Result<Ran<'s>, Failure> {
    let pairs = against.map(|(ours, names)| Pairs::new(simulation, ours, names)).transpose()?;
    let mut held = None;
    let (driver, name) = match args.driver {
        Some(DriverArg::Events) => (Driver::Events, "events"),
        Some(DriverArg::Clock) => (Driver::Clock, "clock"),
        // The world that the VHDL drives is the one that advances.
        Some(DriverArg::Rtl) => (Driver::Clock, "rtl"),
        None => match simulation {
            AnySimulation::Ours(ours) if ours.direct().is_some() => (ours.driver(), scene.setup().solver().name()),
            AnySimulation::Ours(ours) if ours.driver() == Driver::Clock => (Driver::Clock, "clock"),
            AnySimulation::Ours(_) => (Driver::Events, "events"),
            AnySimulation::Dut(_) => (Driver::Clock, "dut"),
        },
    };
    let control = watch.control();
    // Without pictures the trace needs only what the verdict and the metrics are made of. The length of the run does
    // not change the memory.
    let drawn: Vec<&str> = shown(simulation).nets().iter().map(|net| net.name).collect();
    let is_drawn = match &recorder {
        Recorder::Other(observer) => observer.watches(),
        _ => args.out.is_some() && !args.no_plot,
    };
    let trace = if is_drawn { simulation.drawn_trace(&drawn) } else { simulation.verdict_trace() };
    let mut trace = trace.bounded(Trace::USUAL, &simulation.judged());
    let mut advance = |trace: &mut Trace, observer: &mut dyn Observe| -> Result<_, Failure> {
        watch.counted(simulation.edges(), "edges", || match (simulation, vhdl) {
            (AnySimulation::Dut(dut), _) => {
                let mut run = |observer: &mut dyn Observe| dut.run(true, trace, observer, control);
                let (Some(pairs), Some((ours, _))) = (pairs.clone(), against) else {
                    return Ok((run(observer)?, None));
                };
                let (summary, found) = nets::hold(pairs, ours, observer, |observer| {
                    let summary = run(observer)?;
                    let edges = summary.edges;
                    Ok((summary, edges))
                })?;
                held = Some(found);
                Ok((summary, None))
            }
            (AnySimulation::Ours(ours), None) => Ok((ours.run(driver, trace, observer, control), None)),
            (AnySimulation::Ours(ours), Some((scene, setup))) => {
                let (summary, row) = run_vhdl(scene, setup, ours, trace, observer, control)?;
                Ok((summary, Some((row, setup.hdl.clone()))))
            }
        })
    };
    let (summary, rtl) = match recorder {
        Recorder::Nothing => advance(&mut trace, &mut ())?,
        Recorder::Other(observer) => advance(&mut trace, observer)?,
        Recorder::Folder(folder, command) => {
            let compared = vhdl.is_some() || pairs.is_some();
            let waves = Waves::begin(simulation, folder, args.vcd, compared)?;
            let rows = Rows::begin(
                simulation,
                &table(simulation, compared),
                command,
                args.parquet,
                folder,
                interrupt::heed(),
            )?;
            let mut recorded = WavesAndRows(waves, rows);
            let advanced = advance(&mut trace, &mut recorded);
            let WavesAndRows(waves, rows) = recorded;
            // If a row could not be written, that error has ended the run.
            rows.finish(folder)?;
            let (summary, rtl) = advanced?;
            let first = rtl.as_ref().and_then(|(row, _): &(CheckRow, _)| row.first.as_ref());
            let first = first.map(|first| first.row);
            let first = first.or(held.as_ref().and_then(|held| Some(held.first.as_ref()?.edge)));
            let named = marked(scene, simulation, &summary, vhdl.is_none());
            waves.finish(folder, Cycle(summary.edges), first.map(Cycle), named, &summary.faults)?;
            (summary, rtl)
        }
    };
    let expected = scene.expect.outcome.is_some() || !scene.expect.numbers.is_empty();
    let unjudged = args.unjudged(summary.complete).filter(|_| expected);
    let expect = unjudged.is_none().then_some(&scene.expect);
    let outcome = expect.and_then(|expect| expect.outcome);
    let numbers = expect.map_or(&[][..], |expect| &expect.numbers).iter().map(|expected| {
        let got = metric(expected.metric, scene, &summary, &trace);
        let met = got.is_some_and(|got| (got - expected.value).abs() <= expected.tolerance);
        (*expected, got, met)
    });
    let suspect = suspect::found(scene, &summary, &args.hdl.simulators(), control);
    Ok(Ran {
        suspect,
        driver: name,
        solver: scene.setup().solver().name(),
        simulation,
        unjudged,
        outcome_met: outcome.map(|outcome| (outcome, summary.outcome() == Some(outcome))),
        numbers: numbers.collect(),
        summary,
        trace,
        window_s: judged_window_s(scene),
        parameters: Vec::new(),
        held,
        rtl,
        fitted: None,
        notation: args.notation.get(),
        files: Vec::new(),
    })
}

/// Returns the edges of a run that viewers mark: the first overflow, and the begin of the judged window.
fn marked(scene: &Experiment, simulation: &AnySimulation, summary: &Summary, ours_alone: bool) -> Vec<(Cycle, String)> {
    let mut named = Vec::new();
    if let AnySimulation::Ours(ours) = simulation
        && ours_alone
        && ours.direct().is_none()
        && summary.nets.iter().any(|net| net.usage.overflowed > 0)
        && let Some((net, edge)) = Overflows::find(ours)
    {
        named.push((Cycle(edge), format!("first overflow of {}", ours.nets()[net].name)));
    }
    if summary.verdict.is_some() {
        let [from_s, _] = judged_window_s(scene);
        named.push((Cycle(simulation.clock().edges(from_s)), "judged from here".to_string()));
    }
    named
}

fn interrupted(ran: &Ran, as_json: bool) -> Result<Exit, Failure> {
    show(page::page(ran).note("interrupted; no files written"), as_json)?;
    Ok(Exit::Interrupted)
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
