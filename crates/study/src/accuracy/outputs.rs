//! The outputs of a run, and their errors.
//!
//! Every error is a relative number, 0 for equal outputs. Each has its own denominator:
//!
//! | Output | Error |
//! |---|---|
//! | `trace` | rms of the difference, over the reference's range of motion |
//! | `final_angle` | difference, over the reference's range of motion |
//! | `peak_penetration` | difference, over the reference's own; if that is 0, over its range of motion |
//! | `amplitude`, `frequency` | difference, over the reference's own; both are 0 for a motion without a limit cycle |
//! | `energy` | difference of what source and hand gave, over all energy that the reference exchanged |
//! | `rms` of a drop test | difference, over the reference's own, or over the verdict's limit, 0.003 cm, if more |
//! | `verdict` | 0 when right, infinite when wrong |

use hpu_cosim::scene::{Datapath, Experiment, Metric, OutcomeKind, Output};
use hpu_cosim::{
    AnySimulation, Control, Driver, PASSIVE_RMS_M, Simulation, Summary, Trace, Wired, WiredSimulation, metric,
};
use hpu_signal::{Cycle, Observe};

use super::Device;
use crate::Error;
use crate::map::any_simulation;

/// Greatest number of rows of a recording that a run may hold.
const MOST_ROWS: u64 = 20_000_000;

/// The outputs of a run. Positions are in rad, of a mass or an arm in m.
#[derive(Clone, PartialEq, Debug)]
pub struct Outputs {
    /// The motion at the plant's rate: the angle of an axis, or the tip of an arm along the direction under test.
    pub trace: Vec<f64>,
    /// The deepest point in the wall.
    pub peak_penetration: f64,
    /// The amplitude of the verdict; 0 for a verdict without one.
    pub amplitude: f64,
    /// The frequency of the verdict, in Hz; 0 for a verdict without one.
    pub frequency_hz: f64,
    /// Energy that source and hand have given, in J.
    pub given_j: f64,
    /// Sum of the absolute values of all energy flows, in J.
    pub exchanged_j: f64,
    /// The rms about the steady value at the end of a drop test, in m.
    pub rms_m: Option<f64>,
    /// The outcome of the motion.
    pub outcome: OutcomeKind,
    /// A hash over every edge of every net, of a run that was watched for it.
    pub print: Option<u64>,
}

/// Returns the outputs that a verdict makes worth comparing: the trace of a motion without end depends on its phase.
pub fn usual(outcome: OutcomeKind) -> Vec<Output> {
    match outcome {
        OutcomeKind::Settled | OutcomeKind::NotTold | OutcomeKind::HandMoves => {
            vec![Output::Trace, Output::PeakPenetration, Output::Verdict]
        }
        OutcomeKind::LimitCycle => {
            vec![Output::Amplitude, Output::Frequency, Output::PeakPenetration, Output::Verdict]
        }
        OutcomeKind::NoWallTorque | OutcomeKind::PositionLost => vec![Output::PeakPenetration, Output::Verdict],
        OutcomeKind::Passive | OutcomeKind::Tracking => vec![Output::Trace, Output::Rms, Output::Verdict],
        OutcomeKind::NonPassive => vec![Output::Rms, Output::Verdict],
        OutcomeKind::Diverged | OutcomeKind::HighlyUnstable => vec![Output::Verdict],
    }
}

/// Returns the driver that an experiment asks for.
pub fn driver(overrides: &[(String, String)]) -> Driver {
    let solver = overrides.iter().rev().find(|(key, _)| key == "model.solver");
    if solver.is_some_and(|(_, solver)| solver == "clock") { Driver::Clock } else { Driver::Events }
}

/// A hash over every edge of every net, in the order of their names: the simulators of a design number its ports in
/// different ways.
struct Print {
    order: Vec<usize>,
    last: Vec<i64>,
    hash: u64,
}

impl Print {
    fn add(&mut self, word: u64) {
        self.hash = (self.hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    }
}

impl Observe for Print {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.last != words {
            self.last.resize(words.len(), 0);
            self.last.copy_from_slice(words);
            self.add(cycle.0);
            for at in 0..words.len() {
                self.add(words[self.order.get(at).copied().unwrap_or(at)].cast_unsigned());
            }
        }
    }

    fn reals(&mut self, _: Cycle, values: &[f64]) {
        values.iter().for_each(|value| self.add(value.to_bits()));
    }
}

/// Returns a scene made ready to run, if it has a motion that can be compared.
pub(crate) fn simulation(experiment: &Experiment) -> Result<WiredSimulation<'_>, Error> {
    if matches!(experiment, Experiment::Axis(scene) if scene.model.datapath == Datapath::Linear) {
        return Err("model.datapath = \"linear\" is for hpu limits; write \"words\" or \"law\"".into());
    }
    let simulation = WiredSimulation::new(experiment)?;
    if !simulation.has_device() {
        return Err("a recording has no device whose motion could be compared".into());
    }
    has_rows(&simulation)?;
    Ok(simulation)
}

/// Returns a scene made ready to run, also one with a design of the user's own.
pub(super) fn any(experiment: &Experiment) -> Result<AnySimulation<'_>, Error> {
    let Experiment::Dut(_) = experiment else { return simulation(experiment).map(AnySimulation::Ours) };
    let simulation = any_simulation(experiment)?;
    has_rows(&simulation)?;
    Ok(simulation)
}

/// Runs a scene that was made ready.
pub(super) fn run(
    simulation: &AnySimulation,
    driver: Driver,
    (trace, observer): (&mut Trace, &mut dyn Observe),
    control: &Control,
) -> Result<Summary, Error> {
    match simulation {
        AnySimulation::Ours(ours) => Ok(ours.run(driver, trace, observer, control)),
        AnySimulation::Dut(design) => design.run(false, trace, observer, control).map_err(Error::design),
    }
}

fn has_rows(simulation: &impl Simulation) -> Result<(), Error> {
    let rows = simulation.edges() / simulation.stride();
    if rows > MOST_ROWS {
        let most = format!("{rows} rows would be recorded, of {MOST_ROWS} at most");
        return Err(format!("{most}: lower record.plant_rate or run.duration").into());
    }
    Ok(())
}

impl Outputs {
    /// Runs an experiment. Returns no outputs if `control` stopped it.
    ///
    /// # Errors
    ///
    /// Returns why the experiment cannot be run.
    pub fn of(experiment: &Experiment, driver: Driver, control: &Control) -> Result<(Option<Self>, Summary), Error> {
        Self::watched(experiment, driver, None, control)
    }

    /// Like [`of`](Self::of), with the [`print`](Self::print), which takes most of the time of a run that leaps.
    ///
    /// # Errors
    ///
    /// As [`of`](Self::of).
    pub fn printed(
        experiment: &Experiment,
        driver: Driver,
        control: &Control,
    ) -> Result<(Option<Self>, Summary), Error> {
        let mut print = Print { order: Vec::new(), last: Vec::new(), hash: 0 };
        let (outputs, summary) = Self::watched(experiment, driver, Some(&mut print), control)?;
        Ok((outputs.map(|outputs| Self { print: Some(print.hash), ..outputs }), summary))
    }

    fn watched(
        experiment: &Experiment,
        driver: Driver,
        mut print: Option<&mut Print>,
        control: &Control,
    ) -> Result<(Option<Self>, Summary), Error> {
        let simulation = any(experiment)?;
        let mut trace = simulation.brief_trace();
        if let (AnySimulation::Dut(design), Some(print)) = (&simulation, &mut print) {
            let names = design.nets().into_iter().map(|net| net.name.to_ascii_lowercase()).enumerate();
            let mut names: Vec<_> = names.collect();
            names.sort_by(|one, other| one.1.cmp(&other.1));
            print.order = names.into_iter().map(|(at, _)| at).collect();
        }
        let mut nothing = ();
        let observer: &mut dyn Observe = match print {
            Some(print) => print,
            None => &mut nothing,
        };
        let summary = run(&simulation, driver, (&mut trace, observer), control)?;
        let outputs = if summary.complete { Some(Self::new(experiment, &summary, &trace)?) } else { None };
        Ok((outputs, summary))
    }

    /// Returns the outputs of a complete run.
    pub(crate) fn new(experiment: &Experiment, summary: &Summary, trace: &Trace) -> Result<Self, Error> {
        let outcome = summary.outcome().ok_or("a recording has no verdict")?;
        let number = |which| metric(which, experiment, summary, trace);
        let of_axis = experiment.setup().outputs().contains(&Output::PeakPenetration);
        let of_axis = |which| if of_axis { number(which).unwrap_or(0.0) } else { 0.0 };
        Ok(Self {
            trace: experiment.motion(trace).to_vec(),
            peak_penetration: of_axis(Metric::PeakPenetration),
            amplitude: of_axis(Metric::Amplitude),
            frequency_hz: of_axis(Metric::Frequency),
            given_j: summary.energy.source_j + summary.energy.hand_j,
            exchanged_j: summary.energy.exchanged_j,
            rms_m: number(Metric::Rms),
            outcome,
            print: None,
        })
    }

    /// Whether every edge of every net, and every row of the plant, equals the reference to the bit.
    pub fn same_edges(&self, reference: &Self) -> bool {
        self.print.is_some() && self.print == reference.print
    }

    /// Returns the error of every output that the reference has; infinite for an output that is not a number.
    pub fn errors(&self, reference: &Self) -> Vec<(Output, f64)> {
        let (low, high) =
            reference.trace.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        let range = high - low;
        let ends = (self.trace.last().copied().unwrap_or(0.0), reference.trace.last().copied().unwrap_or(0.0));
        let depth = if reference.peak_penetration > 0.0 { reference.peak_penetration } else { range };
        let mut errors = vec![(Output::Trace, over(rms_difference(&self.trace, &reference.trace), range))];
        let mut add = |output, ours: f64, theirs: f64, size: f64| errors.push((output, over(ours - theirs, size)));
        if let Some(rms_m) = reference.rms_m {
            add(Output::Rms, self.rms_m.unwrap_or(f64::INFINITY), rms_m, rms_m.max(PASSIVE_RMS_M));
        } else if is_of_axis(reference.outcome) {
            add(Output::FinalAngle, ends.0, ends.1, range);
            add(Output::PeakPenetration, self.peak_penetration, reference.peak_penetration, depth);
            for (output, ours, theirs) in [
                (Output::Amplitude, self.amplitude, reference.amplitude),
                (Output::Frequency, self.frequency_hz, reference.frequency_hz),
            ] {
                if theirs > 0.0 {
                    add(output, ours, theirs, theirs);
                }
            }
            add(Output::Energy, self.given_j, reference.given_j, reference.exchanged_j);
        }
        errors.push((Output::Verdict, if self.outcome == reference.outcome { 0.0 } else { f64::INFINITY }));
        errors
    }
}

fn is_of_axis(outcome: OutcomeKind) -> bool {
    use OutcomeKind::{Diverged, HandMoves, LimitCycle, NoWallTorque, NotTold, PositionLost, Settled};
    matches!(outcome, Settled | LimitCycle | Diverged | NoWallTorque | PositionLost | NotTold | HandMoves)
}

/// Returns the worst error of these outputs; 0 if none of them was compared.
pub fn worst(errors: &[(Output, f64)], outputs: &[Output]) -> f64 {
    let counted = errors.iter().filter(|(output, _)| outputs.contains(output));
    counted.map(|(_, error)| *error).fold(0.0, f64::max)
}

/// Returns a difference over a size; 0 over 0 is 0, and a ratio that is not a finite number is infinite.
fn over(difference: f64, size: f64) -> f64 {
    match (difference.abs(), (difference / size).abs()) {
        (0.0, _) => 0.0,
        (_, ratio) if ratio.is_finite() => ratio,
        _ => f64::INFINITY,
    }
}

/// Returns the rms of the difference over the rows that both have; an aborted run has fewer rows.
fn rms_difference(ours: &[f64], theirs: &[f64]) -> f64 {
    let rows = ours.len().min(theirs.len()).max(1);
    let sum: f64 = ours.iter().zip(theirs).map(|(x, y)| (x - y).powi(2)).sum();
    (sum / rows as f64).sqrt()
}
