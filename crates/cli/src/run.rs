//! `hpu run`: a scene, run; its summary, its files.

use std::path::PathBuf;

use clap::ValueEnum;
use hpu_cosim::scene::{Datapath, Expectation, Experiment, OutcomeKind};
use hpu_cosim::{Comparison, Driver, Ready, Rig, Summary, Trace, metric};
use hpu_rtl::{CheckRow, Hdl, closed_loop};
use hpu_signal::{Cycle, Notation, Observe, Signal};
use hpu_study::chart::{self, PHANTOM_NETS};
use hpu_study::fit::Fit;
use serde_json::json;

use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::notation::Written;
use crate::rows::{Estimate, Rows};
use crate::scene::{self, Loaded};
use crate::terminal::{print, print_json, verdict, with_progress};
use crate::waves::Waves;
use crate::{fit, hdl, interrupt, pictures, run_json, run_text};

/// Run a scene and sum it up; without a scene, list the shipped ones
#[derive(clap::Args)]
pub struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: Option<String>,
    #[command(flatten)]
    set: scene::Set,
    /// What advances the run, whatever the scene's model.solver says of events and clock
    #[arg(long, value_enum)]
    driver: Option<DriverArg>,
    /// Run (or compare) so many clock edges instead of the scene's duration; its expectations are not judged then
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    edges: Option<u64>,
    /// Run `events` against `clock` and compare every net and plant state at every edge
    #[arg(long, conflicts_with_all = ["out", "driver"])]
    compare: bool,
    /// Write wave.fst with its GTKWave save file, trace.csv (row by row, as the run goes), pictures and summary.json into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write wave.vcd with its GTKWave save file too
    #[arg(long, requires = "out")]
    vcd: bool,
    /// Write the trace as trace.parquet too
    #[arg(long, requires = "out")]
    parquet: bool,
    /// Draw no pictures
    #[arg(long, requires = "out")]
    no_plot: bool,
    /// Draw this scene's run beside, in one figure
    #[arg(long, value_name = "SCENE", requires = "out", conflicts_with = "no_plot")]
    beside: Option<String>,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    #[command(flatten)]
    notation: Written,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// What advances a run.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum DriverArg {
    /// From event to event
    Events,
    /// Edge by edge
    Clock,
    /// The VHDL in GHDL, beside the emulator, every net compared at every edge
    Rtl,
}

/// A run and all that is said of it.
pub struct Ran<'s> {
    /// Name of the driver.
    pub driver: &'static str,
    /// What moved the device, as the scene has it.
    pub solver: &'static str,
    /// The scene, ready.
    pub session: &'s Ready<'s>,
    /// What it was.
    pub summary: Summary,
    /// What was recorded.
    pub trace: Trace,
    /// The VHDL beside it, and where that was from.
    pub rtl: Option<(CheckRow, Hdl)>,
    /// Whether the outcome was the expected one, when one was.
    pub outcome_met: Option<(OutcomeKind, bool)>,
    /// The expected numbers, what they were, and whether that is within tolerance.
    pub numbers: Vec<(Expectation, Option<f64>, bool)>,
    /// The model that was chosen, where the scene leaves it open.
    pub fitted: Option<Fit>,
    /// How its formats are written.
    pub notation: Notation,
    /// Files written.
    pub files: Vec<PathBuf>,
}

impl Ran<'_> {
    fn exit(&self) -> Exit {
        let met = self.outcome_met.is_none_or(|(_, met)| met) && self.numbers.iter().all(|(.., met)| *met);
        Exit::when(met && self.rtl.as_ref().is_none_or(|(row, _)| row.ok()))
    }
}

/// `hpu run`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(name) = &args.scene else {
        return scene::list(args.json);
    };
    let mut loaded = Loaded::new(name, &args.set.set, args.edges)?;
    let mut fitted = None;
    if loaded.scene.auto() {
        let Some(found) = fit::least(&scene::source(name)?, &args.set.set, None, interrupt::heed())? else {
            return Ok(Exit::Interrupted);
        };
        let set: Vec<_> = args.set.set.iter().chain(&found.set).cloned().collect();
        loaded = Loaded::new(name, &set, args.edges)?;
        fitted = Some(found);
    }
    if let Experiment::Axis(scene) = &loaded.scene
        && scene.model.datapath == Datapath::Linear
    {
        let error = scene.error("model.datapath", "\"linear\" is a law without a datapath to run; see hpu limits");
        return Err(if error.is_override() { Failure::usage(error) } else { Failure::file(error) });
    }
    let session = Ready::new(&loaded.scene).map_err(Failure::file)?;
    let other = args.beside.as_ref().map(|other| Loaded::new(other, &[], args.edges)).transpose()?;
    if session.direct().is_some() && (args.compare || args.driver.is_some()) {
        let solver = "a law in floats with this model.solver runs without a clock, so no driver advances it";
        return Err(Failure::usage(format!("{}: {solver}; leave out --driver and --compare", session.name())));
    }
    if args.compare {
        return compare(&session, args.json);
    }
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    if let Some(out) = &args.out {
        Estimate::of(&session, nets(&session).len(), args.parquet).tell(out)?;
    }
    let mut rtl = None;
    if args.driver == Some(DriverArg::Rtl) {
        interrupt::heed();
        let setup = args.hdl.setup();
        let row = closed_loop(&loaded.in_vhdl(loaded.scene.edges()), &setup);
        if interrupt::pressed() {
            return Ok(Exit::Interrupted);
        }
        rtl = Some((row?, setup.hdl));
    }
    let command = loaded.command();
    let mut ran = simulate(&loaded.scene, &session, args, folder.as_mut().map(|folder| (folder, &*command)))?;
    ran.rtl = rtl;
    ran.fitted = fitted;
    if interrupt::pressed() {
        return interrupted(&ran, args.json);
    }
    if let Some(mut folder) = folder {
        write(args, &loaded, other.as_ref(), &mut ran, &mut folder)?;
        if interrupt::pressed() {
            return interrupted(&Ran { files: Vec::new(), ..ran }, args.json);
        }
        folder.commit()?;
    }
    if args.json {
        print_json(&run_json::summary(&ran))?;
    } else {
        print(&run_text::summary(&ran))?;
    }
    Ok(ran.exit())
}

/// Writes all but the waveforms and the trace; `other` is the scene to draw beside.
fn write(
    args: &Args,
    loaded: &Loaded,
    other: Option<&Loaded>,
    ran: &mut Ran,
    folder: &mut Folder,
) -> Result<(), Failure> {
    if !args.no_plot {
        let out = args.out.as_ref().map_or(String::new(), |out| out.display().to_string());
        let command = format!("{} -o {out}", loaded.command());
        pictures::write(ran, &command, folder)?;
        if let Some(other) = other {
            let session = Ready::new(&other.scene).map_err(Failure::file)?;
            let command = format!("{command} --beside {}", other.scene.name());
            pictures::write_beside([ran, &simulate(&other.scene, &session, args, None)?], &command, folder)?;
        }
    }
    ran.files = folder.places().map(PathBuf::from).chain([folder.place("summary.json")]).collect();
    folder.write("summary.json", format!("{:#}\n", run_json::summary(ran)))
}

/// The nets that are drawn and tabled.
fn nets(session: &Ready) -> Vec<Signal> {
    let names = match session {
        Ready::Axis(session) => chart::nets(session.scene()),
        Ready::Phantom(_) => &PHANTOM_NETS,
    };
    let all = session.wiring().nets();
    names.iter().filter_map(|name| all.iter().find(|net| net.name == *name).cloned()).collect()
}

/// Waveforms and rows of a run, on their way to disk.
struct Recorded(Waves, Rows);

impl Observe for Recorded {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.0.nets(cycle, words);
        self.1.nets(cycle, words);
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.0.reals(cycle, values);
        self.1.reals(cycle, values);
    }
}

/// Runs the scene. Waveforms and rows are recorded when there is a folder for them; the command is for their heads.
fn simulate<'s>(
    scene: &Experiment,
    session: &'s Ready<'s>,
    args: &Args,
    folder: Option<(&mut Folder, &str)>,
) -> Result<Ran<'s>, Failure> {
    let (driver, name) = match args.driver {
        Some(DriverArg::Events) => (Driver::Events, "events"),
        Some(DriverArg::Clock) => (Driver::Clock, "clock"),
        // The VHDL's nets and plant are the emulator's, edge by edge, or the comparison has told; so this is its run.
        Some(DriverArg::Rtl) => (Driver::Events, "rtl"),
        None if session.direct().is_some() => (session.driver(), solver(scene)),
        None => match session.driver() {
            Driver::Events => (Driver::Events, "events"),
            Driver::Clock => (Driver::Clock, "clock"),
        },
    };
    let control = interrupt::heed();
    // Without pictures nobody looks at more than the verdict does. The length of a run is no matter for memory.
    let drawn: Vec<&str> = nets(session).iter().map(|net| net.name).collect();
    let trace = if args.out.is_some() && !args.no_plot { session.trace(&drawn) } else { session.brief_trace() };
    let mut trace = trace.bounded(Trace::USUAL, &session.judged());
    let summary = match folder {
        None => with_progress(session.edges(), "edges", control, || session.run(driver, &mut trace, &mut (), control)),
        Some((folder, command)) => {
            let waves = Waves::begin(session, folder, args.vcd)?;
            let rows = Rows::begin(session, &nets(session), command, args.parquet, folder, control)?;
            let mut recorded = Recorded(waves, rows);
            let run = || session.run(driver, &mut trace, &mut recorded, control);
            let summary = with_progress(session.edges(), "edges", control, run);
            let Recorded(waves, rows) = recorded;
            rows.finish(folder)?;
            waves.finish(folder, Cycle(summary.edges))?;
            summary
        }
    };
    let judged = summary.complete && args.edges.is_none();
    let expect = judged.then_some(scene.expect());
    let outcome = expect.and_then(|expect| expect.outcome);
    let numbers = expect.map_or(&[][..], |expect| &expect.numbers).iter().map(|expected| {
        let got = metric(expected.metric, scene, &summary, &trace);
        let met = got.is_some_and(|got| (got - expected.value).abs() <= expected.tolerance);
        (*expected, got, met)
    });
    Ok(Ran {
        driver: name,
        solver: solver(scene),
        session,
        outcome_met: outcome.map(|outcome| (outcome, summary.outcome() == Some(outcome))),
        numbers: numbers.collect(),
        summary,
        trace,
        rtl: None,
        fitted: None,
        notation: args.notation.get(),
        files: Vec::new(),
    })
}

/// `model.solver`.
fn solver(scene: &Experiment) -> &'static str {
    match scene {
        Experiment::Axis(scene) => scene.model.solver.name(),
        Experiment::Phantom(scene) => scene.model.solver.name(),
    }
}

fn interrupted(ran: &Ran, as_json: bool) -> Result<Exit, Failure> {
    if as_json {
        print_json(&run_json::summary(ran))?;
    } else {
        print(&format!("{}interrupted; no files written\n", run_text::summary(ran)))?;
    }
    Ok(Exit::Interrupted)
}

/// `hpu run --compare`.
fn compare(session: &Ready, as_json: bool) -> Result<Exit, Failure> {
    let Comparison { edges, mismatches, first } = session.compare(session.edges());
    if as_json {
        let first = first.map(
            |first| json!({ "edge": first.edge, "name": first.name, "events": first.events, "clock": first.clock }),
        );
        print_json(&json!({ "scene": session.name(), "edges": edges, "mismatches": mismatches, "first": first }))?;
    } else {
        let said = verdict(&format!("{mismatches} mismatches"), mismatches == 0);
        let mut text = format!("{}: events against clock, {edges} edges, {said}\n", session.name());
        if let Some(first) = first {
            let (events, clock) = (first.events, first.clock);
            text +=
                &format!("first at edge {}: {} is {events:e} by events, {clock:e} by clock\n", first.edge, first.name);
        }
        print(&text)?;
    }
    Ok(Exit::when(mismatches == 0))
}
