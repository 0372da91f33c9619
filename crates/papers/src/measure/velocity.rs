//! The velocity that a sampled wall estimates, beside the speed of the device.

use std::sync::atomic::Ordering;

use hpu_cosim::scene::{Device, Experiment, LawMethod, Loop};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

use super::{Asked, numbers};
use crate::Error;
use crate::template::Values;

/// Columns of the speed and the position in a row of an axis.
const SPEED: usize = 1;
const POSITION: usize = 2;

/// The longest lag that is looked for, in s.
const MOST_LAG_S: f64 = 0.05;

/// The values that the measure gives.
pub(super) const GIVES: &[&str] = &["rms", "most", "rest", "lag", "unlagged", "fastest"];

/// The speed of a device and the estimate of it, at the rows of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Velocities {
    /// From one row to the next, in s.
    pub interval_s: f64,
    /// The speed in rad/s, or in m/s of a mass.
    pub true_speeds: Vec<f64>,
    /// The estimate in the same unit, held from one sample to the next as the damper reads it.
    pub estimates: Vec<f64>,
    /// The unit of both.
    pub unit: &'static str,
}

impl Velocities {
    /// Runs a scene with a sampled wall. Returns `None` when stopped.
    ///
    /// # Errors
    ///
    /// When the scene is of no axis, has another method or no datapath in words, or cannot be run.
    pub(crate) fn of(asked: &Asked, control: &Control) -> Result<Option<Self>, Error> {
        let scene = asked.axis()?;
        let Loop::Law(LawMethod::SampledWall(method)) = scene.method.kind else {
            return Err("only a sampled_wall has a choice of estimators; write method.kind = \"sampled_wall\"".into());
        };
        let unit = match scene.device {
            Device::Motor(_) => "rad/s",
            Device::Mass(_) => "m/s",
        };
        let lsb = scene.encoder.count_rad() / scene.velocity_span_s() / f64::from(1u32 << method.velocity_frac);
        let experiment = Experiment::Axis(scene);
        let simulation = WiredSimulation::new(&experiment)?;
        if !simulation.nets().iter().any(|net| net.name == "memory") {
            return Err("a law in floats has no words; write model.datapath = \"words\"".into());
        }
        let mut trace = simulation.trace(&["memory"]);
        simulation.run(Driver::Events, &mut trace, &mut (), control);
        let interval_s = trace.interval_s();
        let aside = (0.5 * asked.number("over").unwrap_or(0.0) / interval_s).round() as usize;
        let true_speeds = match aside {
            0 => trace.real(SPEED).to_vec(),
            _ => mean_speeds(trace.real(POSITION), aside, interval_s),
        };
        Ok((!control.stop.load(Ordering::Relaxed)).then(|| Self {
            interval_s,
            true_speeds,
            estimates: trace.words(0).iter().map(|word| *word as f64 * lsb).collect(),
            unit,
        }))
    }

    /// Returns the mean square of the error when the estimate at each row is held against the speed `lag` rows before.
    fn mean_square(&self, lag: usize) -> f64 {
        let errors = self.estimates.iter().skip(lag).zip(&self.true_speeds).map(|(estimate, speed)| estimate - speed);
        errors.map(|error| error * error).sum::<f64>() / (self.estimates.len() - lag) as f64
    }

    /// Returns the lag in s at which the error has the least mean square, and that mean square.
    fn lag(&self) -> (f64, f64) {
        let most = ((MOST_LAG_S / self.interval_s) as usize).min(self.estimates.len() - 1);
        let (lag, square) = lag(most, |lag| self.mean_square(lag));
        (lag * self.interval_s, square)
    }

    /// Returns the root of the mean square of the error, its greatest size, and the root of the mean square at the rows
    /// where the speed is at most `rest`; NaN without such rows.
    fn errors(&self, rest: f64) -> [f64; 3] {
        let errors =
            || self.estimates.iter().zip(&self.true_speeds).map(|(estimate, speed)| (estimate - speed, *speed));
        let most = errors().fold(0.0, |most: f64, (error, _)| most.max(error.abs()));
        let (count, sum) = errors()
            .filter(|(_, speed)| speed.abs() <= rest)
            .fold((0.0, 0.0), |(count, sum), (error, _)| (count + 1.0, sum + error * error));
        [self.mean_square(0).sqrt(), most, (sum / count).sqrt()]
    }
}

/// Returns the lag in rows, up to `most`, at which a mean square is least, and that mean square. It is looked for row
/// by row, and then between rows, at the lowest point of the parabola through the least value and its neighbours. The
/// lag is infinite if the mean square falls up to the longest lag that is looked for.
pub(super) fn lag(most: usize, mean_square: impl Fn(usize) -> f64) -> (f64, f64) {
    let squares: Vec<f64> = (0..=most).map(mean_square).collect();
    let least = (0..=most).min_by(|one, other| squares[*one].total_cmp(&squares[*other])).unwrap_or(0);
    let (mut lag, mut square) = (if least == most { f64::INFINITY } else { least as f64 }, squares[least]);
    if let [before, here, after] = squares[least.saturating_sub(1)..(least + 2).min(squares.len())] {
        let bend = before - 2.0 * here + after;
        if bend > 0.0 {
            let aside = 0.5 * (before - after) / bend;
            lag += aside;
            square -= 0.5 * bend * aside * aside;
        }
    }
    (lag, square.max(0.0))
}

/// Returns the mean speed from so many rows before each row to as many after it, or to the ends of the run.
fn mean_speeds(positions: &[f64], aside: usize, interval_s: f64) -> Vec<f64> {
    let last = positions.len() - 1;
    let speed = |row: usize| {
        let (from, to) = (row.saturating_sub(aside), (row + aside).min(last));
        (positions[to] - positions[from]) / ((to - from) as f64 * interval_s)
    };
    (0..=last).map(speed).collect()
}

/// Measures the estimate of a scene.
pub(super) fn velocity(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let velocities = Velocities::of(asked, control)?.ok_or("stopped before its end")?;
    let [rms, most, rest] = velocities.errors(asked.number("rest").unwrap_or(0.0));
    let (lag, square) = velocities.lag();
    let fastest = velocities.true_speeds.iter().fold(0.0, |most: f64, speed| most.max(speed.abs()));
    let mut values = numbers([
        ("rms", rms),
        ("most", most),
        ("rest", rest),
        ("lag", lag),
        ("unlagged", square.sqrt()),
        ("fastest", fastest),
    ]);
    if lag.is_infinite() {
        values.insert("lag".into(), Err("beyond 50 ms".into()));
    }
    if rest.is_nan() {
        values.insert("rest".into(), Err("never at rest".into()));
    }
    Ok(values)
}
