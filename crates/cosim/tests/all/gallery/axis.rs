//! Helpers of the gallery's tests of one axis.

use hpu_cosim::scene::{Experiment, OutcomeKind, Scene, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Trace, Wired};

/// Returns a shipped scene with overrides.
pub fn scene(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap_or_else(|| panic!("{name} is not shipped"));
    scene.parse(&overrides).map(Experiment::axis).unwrap_or_else(|error| panic!("{error}")).expect("an axis")
}

/// Runs a scene and returns its summary and its trace with these nets.
pub fn run(scene: &Scene, nets: &[&str]) -> (Summary, Trace) {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(nets);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    (summary, trace)
}

/// Runs a scene and returns the kind of its verdict.
pub fn outcome(name: &str, overrides: &[(&str, &str)]) -> Option<OutcomeKind> {
    run(&scene(name, overrides), &[]).0.outcome()
}

/// Returns the speeds of a trace.
pub fn speeds(trace: &Trace) -> &[f64] {
    trace.real(1)
}

/// Returns the rows from `from_s` to `to_s`.
pub fn rows(trace: &Trace, from_s: f64, to_s: f64) -> std::ops::Range<usize> {
    let row = |t_s: f64| ((t_s / trace.interval_s()).round() as usize).min(trace.rows());
    row(from_s)..row(to_s)
}

/// Returns the least and the greatest value.
pub fn range<T: Copy + PartialOrd>(values: &[T]) -> (T, T) {
    values[1..].iter().fold((values[0], values[0]), |(low, high), &x| {
        (if x < low { x } else { low }, if x > high { x } else { high })
    })
}

/// Checks that a value is within a relative error of the wanted one.
#[track_caller]
pub fn near(found: f64, wanted: f64, share: f64) {
    assert!((found - wanted).abs() <= share * wanted.abs(), "{found} instead of {wanted} within {share}");
}
