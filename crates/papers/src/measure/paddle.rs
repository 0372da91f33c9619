//! The angle that the loop of EPFL's haptic paddle reads, and its encoder beside a log.

use hpu_cosim::replay::Unit;
use hpu_cosim::scene::{Experiment, shipped_file};
use hpu_cosim::{Control, Driver, LogBeside, Simulation, Wired, WiredSimulation};

use super::{Asked, numbers};
use crate::Error;
use crate::template::Values;

/// The values that the measure gives: greatest angle, time from 1 to 10 degrees (infinite where it does not come
/// there), angle at the end, half of the range in the last half of the run, frequency there; then root mean square of
/// the difference from the log and its shift in steps, both infinite without a log. Angles are in degrees.
pub(super) const GIVES: &[&str] = &["peak", "rise", "rest", "swing", "frequency", "rms", "shift"];

/// Runs a scene of the paddle's loop.
pub(super) fn paddle(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let experiment = asked.experiment(&[])?;
    let simulation = WiredSimulation::new(&experiment)?;
    let (Experiment::Paddle(scene), WiredSimulation::Paddle(paddle)) = (&experiment, &simulation) else {
        return Err(Error::new(format_args!("{} is no scene of the paddle's loop", asked.scene)));
    };
    let count = scene.encoder.count_rad();
    let mut beside = match &scene.expect.recording {
        None => None,
        Some(log) => {
            let told = |reason: String| Error::new(format_args!("{}: {reason}", log.file));
            let bytes = shipped_file(&log.file).map_err(|error| told(error.to_string()))?;
            let (motion, _) = log.read(&bytes, Unit::Angle).map_err(|error| told(error.to_string()))?;
            let beside = LogBeside::new(&simulation, count, log, &motion);
            Some(beside.map_err(|error| told(error.to_string()))?)
        }
    };
    let mut trace = simulation.trace(&["filtered"]);
    let summary = match &mut beside {
        None => simulation.run(Driver::Events, &mut trace, &mut (), control),
        Some(beside) => simulation.run(Driver::Events, &mut trace, beside, control),
    };
    let words = paddle.words();
    let degrees = words.count_rad.to_degrees() / f64::from(1u32 << words.config.haptic.frac);
    let angles: Vec<f64> = trace.words(0).iter().map(|&word| word as f64 * degrees).collect();
    // An angle holds for a tick: between the rows at which it is new, it is on a straight line.
    let is_new = |row: &usize| *row == 0 || angles[*row] != angles[row - 1];
    let new: Vec<usize> = (0..angles.len()).filter(is_new).collect();
    let first = |angle: f64| {
        let pair = new.windows(2).find(|pair| angles[pair[0]] < angle && angles[pair[1]] >= angle);
        pair.map_or(f64::INFINITY, |pair| {
            let share = (angle - angles[pair[0]]) / (angles[pair[1]] - angles[pair[0]]);
            libm::fma(share, trace.time_s(pair[1]) - trace.time_s(pair[0]), trace.time_s(pair[0]))
        })
    };
    let half = &angles[angles.len() / 2..];
    let [low, high] = ends(half);
    let [rms, shift] = match beside {
        None => [f64::INFINITY; 2],
        Some(beside) => {
            let held = beside.finish(hpu_signal::Cycle(summary.edges), None).map_err(Error::new)?;
            [held.rms.to_degrees(), held.shift as f64]
        }
    };
    Ok(numbers([
        ("peak", ends(&angles)[1]),
        ("rise", first(10.0) - first(1.0)),
        ("rest", angles.last().copied().unwrap_or(f64::NAN)),
        ("swing", 0.5 * (high - low)),
        ("frequency", frequency_hz(half, 0.5 * (low + high), trace.interval_s())),
        ("rms", rms),
        ("shift", shift),
    ]))
}

fn ends(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)])
}

/// Returns the frequency at which values rise through a middle, each crossing on the straight line between two rows; 0
/// where fewer than three do.
fn frequency_hz(values: &[f64], middle: f64, interval_s: f64) -> f64 {
    let pairs = values.windows(2).enumerate().filter(|(_, pair)| pair[0] < middle && pair[1] >= middle);
    let times: Vec<f64> =
        pairs.map(|(row, pair)| (row as f64 + (middle - pair[0]) / (pair[1] - pair[0])) * interval_s).collect();
    match times.as_slice() {
        [first, .., last] if times.len() > 2 => (times.len() - 1) as f64 / (last - first),
        _ => 0.0,
    }
}
