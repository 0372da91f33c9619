//! A run by any engine, with what is kept of it.

use std::path::PathBuf;

use hpu_cosim::replay::Recording;
use hpu_cosim::scene::{Expectation, Experiment, OutcomeKind};
use hpu_cosim::{AnySimulation, Beyond, Simulation, Summary, Trace, Wired, judged_window_s, metric};
use hpu_page::heard;
use hpu_prove::lasting;
use hpu_rtl::{CheckRow, Hdl};
use hpu_signal::{Cycle, Notation, Observe};
use hpu_study::fit::Fit;

use super::against::{Against, Held};
use super::nets::{NetComparison, Overflows};
use super::plan::{Advanced, Engine};
use super::rows::Rows;
use super::suspect::{self, Suspect};
use super::{Args, drawn_nets, table};
use crate::parameters::Said;
use crate::scene::Loaded;
use crate::shell::{Exit, Failure, Folder, Watch, interrupt};
use crate::waves::Waves;

/// The file of everything that a design of the user's own has said.
const MESSAGES: &str = "messages.txt";

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
    /// The recording that the scene names.
    pub recording: Option<Recording>,
    /// The run beside a log.
    pub log: Option<Held>,
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

impl Ran<'_> {
    /// Returns the exit code: whether expectations are met, assertions hold, and comparisons are without a difference.
    pub fn exit(&self) -> Exit {
        let holds = self.summary.heard.failed() == 0;
        let met = self.outcome_met.is_none_or(|(_, met)| met) && self.numbers.iter().all(|(.., met)| *met);
        Exit::when(
            met && holds
                && self.log.as_ref().is_none_or(Held::ok)
                && self.held.as_ref().is_none_or(NetComparison::ok)
                && self.rtl.as_ref().is_none_or(|(row, _)| row.ok()),
        )
    }
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
pub enum Recorder<'a> {
    /// Nothing.
    Nothing,
    /// Waveforms and rows in a folder; the command goes into the heads of the files.
    Folder(&'a mut Folder, &'a str),
    /// An observer of another program.
    Other(&'a mut dyn Observe),
}

/// Runs a scene, made ready as a simulation, by an engine.
pub fn simulate<'s>(
    args: &Args,
    loaded: &Loaded,
    simulation: &'s AnySimulation<'s>,
    engine: &Engine,
    recorder: Recorder,
    watch: Watch,
) -> Result<Ran<'s>, Failure> {
    let scene = &loaded.scene;
    let mut against = Against::open(args.against.as_deref(), args.edges.is_some(), loaded, simulation)?;
    // Without pictures the trace needs only what the verdict and the metrics are made of. The length of the run does
    // not change the memory.
    let is_drawn = match &recorder {
        Recorder::Other(observer) => observer.watches(),
        _ => args.out.is_some() && !args.no_plot,
    };
    let drawn = drawn_nets(simulation);
    let trace = if is_drawn { simulation.drawn_trace(&drawn) } else { simulation.verdict_trace() };
    let mut trace = trace.bounded(Trace::USUAL, &simulation.judged());
    let control = watch.control();
    let mut advance = |observer: &mut dyn Observe| {
        let mut watching = against.as_mut().map(|against| (&mut against.log, &mut *observer));
        let observer: &mut dyn Observe = if let Some(both) = &mut watching { both } else { observer };
        let mut run = |beyond: Option<&Beyond>| {
            watch.counted(simulation.edges(), "edges", || engine.advance(&mut trace, observer, control, beyond))
        };
        match args.for_ever {
            None => run(None),
            Some(longest) => lasting::beyond(scene, longest.as_secs_f64(), |beyond| run(Some(beyond))),
        }
    };
    let Advanced { summary, rtl, held } = match recorder {
        Recorder::Nothing => advance(&mut ())?,
        Recorder::Other(observer) => advance(observer)?,
        Recorder::Folder(folder, command) => {
            recorded(args, (scene, simulation), engine, (folder, command), &mut advance)?
        }
    };
    let judges_log = against.as_ref().is_some_and(|against| against.rms.is_some());
    let expected = scene.expect.outcome.is_some() || !scene.expect.numbers.is_empty() || judges_log;
    let unjudged = args.unjudged(summary.complete).filter(|_| expected);
    let expect = unjudged.is_none().then_some(&scene.expect);
    let outcome = expect.and_then(|expect| expect.outcome);
    let numbers = expect.map_or(&[][..], |expect| &expect.numbers).iter().map(|expected| {
        let got = metric(expected.metric, scene, &summary, &trace);
        let met = got.is_some_and(|got| (got - expected.value).abs() <= expected.tolerance);
        (*expected, got, met)
    });
    let log = against.filter(|_| summary.complete).map(|against| against.finish(&summary, unjudged.is_none()));
    Ok(Ran {
        log: log.transpose()?,
        suspect: suspect::found(scene, &summary, &args.hdl.simulators(), control),
        driver: engine.name(),
        solver: scene.setup().solver().name(),
        simulation,
        unjudged,
        outcome_met: outcome.map(|outcome| (outcome, summary.outcome() == Some(outcome))),
        numbers: numbers.collect(),
        summary,
        trace,
        window_s: judged_window_s(scene),
        parameters: Vec::new(),
        recording: scene.recording.clone(),
        held,
        rtl,
        fitted: None,
        notation: args.notation.get(),
        files: Vec::new(),
    })
}

/// Runs by `advance`, and writes waveforms and rows into a folder as they come.
fn recorded(
    args: &Args,
    (scene, simulation): (&Experiment, &AnySimulation),
    engine: &Engine,
    (folder, command): (&mut Folder, &str),
    advance: &mut dyn FnMut(&mut dyn Observe) -> Result<Advanced, Failure>,
) -> Result<Advanced, Failure> {
    let nets = table(simulation, engine.compares());
    let waves = Waves::begin(simulation, folder, (args.vcd, engine.compares()), &args.chosen)?;
    let rows = Rows::begin(simulation, &nets, command, args.parquet, folder, interrupt::heed())?;
    let mut recorded = WavesAndRows(waves, rows);
    let advanced = advance(&mut recorded);
    let WavesAndRows(waves, rows) = recorded;
    // If a row could not be written, that error has ended the run.
    rows.finish(folder)?;
    let advanced = advanced?;
    let of_vhdl = advanced.rtl.as_ref().and_then(|(row, _)| Some(row.first.as_ref()?.row));
    let first = of_vhdl.or_else(|| Some(advanced.held.as_ref()?.first.as_ref()?.edge));
    let named = marked(scene, simulation, &advanced.summary, engine);
    let summary = &advanced.summary;
    waves.finish(folder, Cycle(summary.edges), first.map(Cycle), named, &summary.faults)?;
    if !summary.heard.messages.is_empty() {
        folder.write(MESSAGES, heard::messages(&summary.heard, simulation.clock()))?;
    }
    Ok(advanced)
}

/// Returns the edges of a run that viewers mark: failed assertions, the first overflow, and the begin of the judged
/// window.
fn marked(scene: &Experiment, simulation: &AnySimulation, summary: &Summary, engine: &Engine) -> Vec<(Cycle, String)> {
    let mut named = heard::marks(&summary.heard);
    if let Engine::Emulator(ours, ..) = engine
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
