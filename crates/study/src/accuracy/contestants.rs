//! Every way to run a scene other than the scene as written.

use crate::{Error, Kind};
use hpu_cosim::scene::Experiment;

/// A way to run a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Contestant {
    /// Name: the family, the step if there is one, and what is left out, as in `rk4@1us+averaged`.
    pub name: String,
    /// Name of the ladder of steps that it belongs to; its own name if there is no ladder.
    pub family: String,
    /// Length of the fixed step, in s, of a rung of a ladder.
    pub step_s: Option<f64>,
    /// Overrides of the scene.
    pub overrides: Vec<(String, String)>,
    /// Name of the published criterion, if the contestant is one: it gives a verdict and runs nothing.
    pub criterion: Option<&'static str>,
}

/// The solvers of fixed steps.
pub const SOLVERS: [&str; 4] = ["euler", "semi_implicit", "midpoint", "rk4"];
/// The exact solver that leaps from event to event: the reference, run like any other.
pub const EVENTS: &str = "events";

/// The driver that ticks every clock edge.
pub(super) const CLOCK: &str = "clock";

/// Keys and values of a scene, and their part in a contestant's name.
pub(crate) struct Variant {
    pub(crate) suffix: &'static str,
    set: Vec<(&'static str, String)>,
}

impl Variant {
    pub(crate) fn new(suffix: &'static str, set: &[(&'static str, &str)]) -> Self {
        Self { suffix, set: set.iter().map(|(key, value)| (*key, (*value).to_string())).collect() }
    }
}

impl Contestant {
    pub(crate) fn new(name: &str, set: &[(&str, &str)]) -> Self {
        let overrides = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        Self { name: name.into(), family: name.into(), step_s: None, overrides, criterion: None }
    }

    /// Returns a solver combined with what a variant leaves out.
    pub(crate) fn solver(solver: &str, step_s: Option<f64>, variant: &Variant) -> Self {
        let step = step_s.map_or(String::new(), |step_s| format!("@{}", time(step_s).replace(' ', "")));
        let mut overrides = vec![("model.solver".to_string(), solver.to_string())];
        overrides.extend(step_s.map(|step_s| ("model.step".to_string(), time(step_s))));
        overrides.extend(variant.set.iter().map(|(key, value)| ((*key).to_string(), value.clone())));
        Self {
            name: format!("{solver}{step}{}", variant.suffix),
            family: format!("{solver}{}", variant.suffix),
            step_s,
            overrides,
            criterion: None,
        }
    }

    /// Returns the number of clock edges or steps that a run takes one after the other; 0 if it leaps.
    pub fn paces(&self, experiment: &Experiment) -> u64 {
        match self.step_s {
            Some(step_s) => (experiment.edges() as f64 * experiment.clock.period_s() / step_s) as u64,
            None if self.name == CLOCK => experiment.edges(),
            None => 0,
        }
    }

    pub(super) fn criterion(name: &'static str) -> Self {
        Self { family: "criterion".into(), criterion: Some(name), ..Self::new(&format!("criterion:{name}"), &[]) }
    }
}

/// Returns step lengths from `least_s` to `most_s`, about two a decade. The last is `most_s` itself and replaces a
/// neighbour that is nearly as long.
pub(crate) fn rungs(least_s: f64, most_s: f64) -> Vec<f64> {
    let rungs = (-9..=0).flat_map(|decade| [1.0, 3.0].map(|digit| format!("{digit}e{decade}")));
    let rungs = rungs.filter_map(|rung| rung.parse::<f64>().ok());
    let between = rungs.filter(|step_s| (least_s..0.9 * most_s).contains(step_s));
    between.chain(std::iter::once(most_s)).collect()
}

/// Returns a time as a scene writes it, in the largest unit in which it is at least one.
pub fn time(seconds: f64) -> String {
    let units = [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)];
    let (unit, scale) = units.into_iter().find(|(_, scale)| seconds * scale >= 0.999_999).unwrap_or(("ns", 1e9));
    // Six digits; parsing drops trailing zeros.
    let value: f64 = format!("{:.5e}", seconds * scale).parse().unwrap_or(seconds * scale);
    format!("{value} {unit}")
}

/// Returns the contestants that a list of names and families asks for, in the order of `all`.
///
/// # Errors
///
/// Returns an error that names the unknown contestant and lists the known ones.
pub fn named(all: &[Contestant], names: &[String]) -> Result<Vec<Contestant>, Error> {
    let is = |contestant: &Contestant, name: &String| contestant.name == *name || contestant.family == *name;
    if let Some(unknown) = names.iter().find(|name| !all.iter().any(|contestant| is(contestant, name))) {
        let mut families: Vec<&str> = Vec::new();
        for contestant in all {
            let told = if contestant.criterion.is_some() { &contestant.name } else { &contestant.family };
            if !families.contains(&told.as_str()) {
                families.push(told);
            }
        }
        let rung = all.iter().find(|contestant| contestant.step_s.is_some());
        let rung = rung.map_or(String::new(), |rung| format!("; a rung of a ladder is written as {}", rung.name));
        return Err(Error::of(
            Kind::Usage,
            format_args!("no contestant `{unknown}` of this scene; there are {}{rung}", families.join(", ")),
        ));
    }
    Ok(all.iter().filter(|contestant| names.iter().any(|name| is(contestant, name))).cloned().collect())
}
