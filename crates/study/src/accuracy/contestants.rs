//! Every way to run a scene other than the scene as written.

use hpu_cosim::scene::{
    BridgeModel, Datapath, Device, Experiment, Hand, PhantomLaw, PhantomModel, PhantomScene, Scene,
};

use crate::criteria;

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
const CLOCK: &str = "clock";

/// Keys and values of a scene, and their part in a contestant's name.
struct Variant {
    suffix: &'static str,
    set: Vec<(&'static str, String)>,
}

impl Variant {
    fn new(suffix: &'static str, set: &[(&'static str, &str)]) -> Self {
        Self { suffix, set: set.iter().map(|(key, value)| (*key, (*value).to_string())).collect() }
    }
}

impl Contestant {
    fn new(name: &str, set: &[(&str, &str)]) -> Self {
        let overrides = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        Self { name: name.into(), family: name.into(), step_s: None, overrides, criterion: None }
    }

    /// Returns a solver combined with what a variant leaves out.
    fn solver(solver: &str, step_s: Option<f64>, variant: &Variant) -> Self {
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
    #[must_use]
    pub fn paces(&self, experiment: &Experiment) -> u64 {
        match self.step_s {
            Some(step_s) => (experiment.edges() as f64 * experiment.clock.period_s() / step_s) as u64,
            None if self.name == CLOCK => experiment.edges(),
            None => 0,
        }
    }

    fn criterion(name: &'static str) -> Self {
        Self { family: "criterion".into(), criterion: Some(name), ..Self::new(&format!("criterion:{name}"), &[]) }
    }
}

/// Returns every way to run a scene that differs from the scene as written, with `events` first.
///
/// A combination that the scene refuses is reported only when it is tried.
#[must_use]
pub fn contestants(experiment: &Experiment) -> Vec<Contestant> {
    let as_written = Variant::new("", &[]);
    let mut all = vec![Contestant::new(EVENTS, &[]), Contestant::solver(CLOCK, None, &as_written)];
    match experiment {
        Experiment::Axis(scene) => {
            all.extend(of_an_axis(scene));
            let speaking = criteria::all(scene).into_iter().flatten().filter(|criterion| criterion.speaks);
            all.extend(speaking.map(|criterion| Contestant::criterion(criterion.name)));
        }
        Experiment::Phantom(scene) => all.extend(of_a_phantom(scene)),
        Experiment::Dut(_) => {}
    }
    all
}

fn of_an_axis(scene: &Scene) -> Vec<Contestant> {
    let motor = matches!(scene.device, Device::Motor(_));
    let in_words = scene.model.datapath == Datapath::Words;
    let switching = motor && scene.model.bridge == BridgeModel::Switching;
    let averaged: &[(&'static str, &str)] = if motor { &[("model.bridge", "averaged")] } else { &[] };
    let with = |more: &[(&'static str, &'static str)]| [averaged, more].concat();
    let (law, ideal) = (("model.datapath", "law"), ("model.encoder", "ideal"));
    let resistive = ("model.winding", "resistive");

    let mut all = Vec::new();
    let mut plain = |name: &str, set: &[(&str, &str)]| all.push(Contestant::new(name, set));
    if switching {
        plain("averaged", averaged);
    } else if motor && in_words {
        plain("switching", &[("model.bridge", "switching")]);
    }
    if motor {
        plain("resistive", &with(&[resistive]));
    }
    if in_words {
        plain("law", &with(&[law]));
        if motor {
            plain("law+resistive", &with(&[law, resistive]));
        }
    }
    let slow = smooth_speed(scene);
    if coulomb(scene) > 0.0 {
        plain("smoothed", &[("model.friction", "smoothed"), ("model.friction_speed", &slow)]);
        plain("frictionless", &[("model.friction", "none")]);
    }

    // The variants go from what the scene has to what is usual in textbooks.
    let mut variants = vec![Variant::new("", &[])];
    if switching {
        variants.push(Variant::new("+averaged", averaged));
    }
    if in_words {
        variants.push(Variant::new("+loaded", &with(&[("model.encoder", "loaded")])));
        variants.push(Variant::new("+law", &with(&[law])));
    }
    variants.push(Variant::new("+law+ideal", &with(&[law, ideal])));
    if motor {
        variants.push(Variant::new("+law+ideal+resistive", &with(&[law, ideal, resistive])));
    }
    all.extend(variants.iter().map(|variant| Contestant::solver("sample", None, variant)));
    // Textbooks leave out the counts and the switching with large steps only; a few variants cover all of this.
    let stepped = variants.iter().filter(|variant| !variant.suffix.contains("ideal"));
    for (variant, solver) in stepped.flat_map(|variant| SOLVERS.map(|solver| (variant, solver))) {
        all.extend(ladder(scene).into_iter().map(|step_s| Contestant::solver(solver, Some(step_s), variant)));
    }
    all
}

fn coulomb(scene: &Scene) -> f64 {
    match (&scene.device, &scene.hand) {
        (_, Hand::Prescribed { .. }) => 0.0,
        (Device::Motor(motor), _) => motor.coulomb_friction_nm,
        (Device::Mass(mass), _) => mass.coulomb_n,
    }
}

/// Returns the speed below which smoothed friction is proportional to speed: a count in 10 ms.
fn smooth_speed(scene: &Scene) -> String {
    let unit = if matches!(scene.device, Device::Motor(_)) { "rad/s" } else { "m/s" };
    format!("{:.3e} {unit}", scene.encoder.count_rad() / 0.01)
}

/// Returns step lengths from a clock period to the sample period, about two a decade.
fn ladder(scene: &Scene) -> Vec<f64> {
    let (least_s, most_s) = (scene.clock.period_s(), scene.sample_period_s());
    // A step only a little longer than a clock period would nearly repeat it.
    let between = rungs(4.0 * least_s, most_s);
    std::iter::once(least_s).chain(between).collect()
}

/// Returns step lengths from `least_s` to `most_s`, about two a decade. The last is `most_s` itself and replaces a
/// neighbour that is nearly as long.
fn rungs(least_s: f64, most_s: f64) -> Vec<f64> {
    let rungs = (-9..=0).flat_map(|decade| [1.0, 3.0].map(|digit| format!("{digit}e{decade}")));
    let rungs = rungs.filter_map(|rung| rung.parse::<f64>().ok());
    let between = rungs.filter(|step_s| (least_s..0.9 * most_s).contains(step_s));
    between.chain(std::iter::once(most_s)).collect()
}

/// Returns a time as a scene writes it, in the largest unit in which it is at least one.
#[must_use]
pub fn time(seconds: f64) -> String {
    let units = [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)];
    let (unit, scale) = units.into_iter().find(|(_, scale)| seconds * scale >= 0.999_999).unwrap_or(("ns", 1e9));
    // Six digits; parsing drops trailing zeros.
    let value: f64 = format!("{:.5e}", seconds * scale).parse().unwrap_or(seconds * scale);
    format!("{value} {unit}")
}

fn of_a_phantom(scene: &PhantomScene) -> Vec<Contestant> {
    let model = &scene.model;
    let host = scene.platform.is_host();
    let plainest = PhantomModel {
        law: PhantomLaw::Ideal,
        tested_joint_only: true,
        friction: false,
        delay_samples: 0.0,
        latency_s: 0.0,
        amplifier_lag_s: 0.0,
        transmission_n_per_m: 0.0,
        ..*model
    };
    let parts = [
        // A host's law is already in floats.
        ("law", PhantomModel { law: if host { model.law } else { PhantomLaw::Floats }, ..*model }),
        ("ideal", PhantomModel { law: PhantomLaw::Ideal, ..*model }),
        ("one-joint", PhantomModel { tested_joint_only: true, ..*model }),
        ("frictionless", PhantomModel { friction: false, ..*model }),
        ("undelayed", PhantomModel { delay_samples: if host { 0.0 } else { model.delay_samples }, ..*model }),
        ("no-latency", PhantomModel { latency_s: 0.0, ..*model }),
        ("no-lag", PhantomModel { amplifier_lag_s: 0.0, ..*model }),
        ("rigid", PhantomModel { transmission_n_per_m: 0.0, ..*model }),
        ("one-joint+rigid", PhantomModel { tested_joint_only: true, transmission_n_per_m: 0.0, ..*model }),
        (
            "ideal+one-joint+rigid",
            PhantomModel { amplifier_lag_s: model.amplifier_lag_s, friction: model.friction, ..plainest },
        ),
        ("plainest", plainest),
    ];
    let mut known = vec![*model];
    let mut all = Vec::new();
    for (name, simpler) in parts {
        if !known.contains(&simpler) {
            known.push(simpler);
            let all_of_it = in_toml(&simpler);
            all.push(Contestant::new(name, &[("model", &all_of_it)]));
        }
    }
    // A host's samples end the steps of a law without a clock; an FPGA's law follows the arm within a step.
    let most_s = if host { scene.sample_period_s() } else { 1e-3 };
    let ladder = rungs(1e-6, most_s);
    let mut variants = vec![Variant::new("", &[])];
    if model.law == PhantomLaw::Words {
        variants.push(Variant::new("+law", &[("model.law", PhantomLaw::Floats.name())]));
    }
    for (variant, solver) in variants.iter().flat_map(|variant| SOLVERS.map(|solver| (variant, solver))) {
        all.extend(ladder.iter().map(|step_s| Contestant::solver(solver, Some(*step_s), variant)));
    }
    all
}

/// Returns the whole section, because some of its keys are refused beside others.
fn in_toml(model: &PhantomModel) -> String {
    let law = model.law.name();
    let joints = if model.tested_joint_only { "tested" } else { "all" };
    let mut text = format!(
        "{{ law = \"{law}\", joints = \"{joints}\", friction = {}, delay = {:?}, latency = {:?}, amplifier_lag = {:?}",
        model.friction, model.delay_samples, model.latency_s, model.amplifier_lag_s
    );
    if model.transmission_n_per_m > 0.0 {
        text += &format!(
            ", transmission_stiffness = {:?}, transmission_damping = {:?}, motor_share = {:?}",
            model.transmission_n_per_m, model.transmission_n_s_per_m, model.motor_share
        );
    }
    text + " }"
}

/// Returns the contestants that a list of names and families asks for, in the order of `all`.
///
/// # Errors
///
/// Returns an error that names the unknown contestant and lists the known ones.
pub fn named(all: &[Contestant], names: &[String]) -> Result<Vec<Contestant>, String> {
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
        return Err(format!("no contestant `{unknown}` of this scene; there are {}{rung}", families.join(", ")));
    }
    Ok(all.iter().filter(|contestant| names.iter().any(|name| is(contestant, name))).cloned().collect())
}
