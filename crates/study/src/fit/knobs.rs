//! The simplifications of a scene, and which of them can be combined.

use std::ops::RangeInclusive;

use hpu_cosim::scene::{
    BridgeModel, Datapath, Device, EncoderModel, Experiment, Hand, PhantomLaw, PhantomScene, Scene,
};

/// One thing that a cheaper model leaves out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Simplification {
    /// Name of the thing, as a noun: "the bridge's switching".
    pub what: String,
    /// The keys that leave it out.
    pub set: Vec<(String, String)>,
    /// Simplifications that this one requires, as indices into the list.
    needs: Vec<usize>,
    /// Alternatives to this simplification, with which it cannot be combined.
    instead_of: Vec<usize>,
    /// The next two shorter steps of the same ladder, if this is a fixed step.
    pub(super) shorter: Vec<usize>,
    /// Whether this step only serves to check longer steps, and is never taken itself.
    pub(super) probe: bool,
    /// Worth of the simplification, for the order in which models are tried: roughly the logarithm of its gain in
    /// speed.
    worth: u32,
}

/// Returns the simplifications of an experiment.
#[must_use]
pub fn simplifications(experiment: &Experiment) -> Vec<Simplification> {
    let mut list = List(Vec::new());
    match experiment {
        Experiment::Axis(scene) => axis(scene, &mut list),
        Experiment::Phantom(scene) => phantom(scene, &mut list),
        Experiment::Dut(_) => {}
    }
    list.0
}

/// Returns the sets of simplifications that can be combined, those worth most first. The last set is empty: the scene
/// as written.
#[must_use]
pub fn models(all: &[Simplification]) -> Vec<Vec<usize>> {
    let mut models = vec![Vec::new()];
    for index in (0..all.len()).filter(|&index| !all[index].probe) {
        let with = |set: &Vec<usize>| [&set[..], &[index]].concat();
        let more: Vec<_> = models.iter().map(with).filter(|set| go_together(all, set)).collect();
        models.extend(more);
    }
    models.sort_by_key(|set| std::cmp::Reverse((worth(all, set), set.len())));
    models
}

/// Returns the worth of a model: roughly the logarithm of its gain in speed.
pub(super) fn worth(all: &[Simplification], model: &[usize]) -> u32 {
    model.iter().map(|&index| all[index].worth).sum()
}

/// Whether a model has all simplifications that its own require, and no two alternatives.
pub(super) fn go_together(all: &[Simplification], model: &[usize]) -> bool {
    model.iter().map(|&index| &all[index]).all(|one| {
        one.needs.iter().all(|need| model.contains(need)) && !one.instead_of.iter().any(|it| model.contains(it))
    })
}

/// Returns a model without the simplifications that require `thing`, and the same model without `thing` itself as well.
pub(super) fn on_its_own(all: &[Simplification], model: &[usize], thing: usize) -> [Vec<usize>; 2] {
    let mut gone = vec![thing];
    // A simplification comes after those that it requires.
    for &index in model {
        if all[index].needs.iter().any(|need| gone.contains(need)) {
            gone.push(index);
        }
    }
    let without = |gone: &[usize]| model.iter().copied().filter(|index| !gone.contains(index)).collect();
    [without(&gone[1..]), without(&gone)]
}

/// Returns the keys that make a scene this model.
#[must_use]
pub fn overrides(all: &[Simplification], model: &[usize]) -> Vec<(String, String)> {
    model.iter().flat_map(|&index| all[index].set.iter().cloned()).collect()
}

struct List(Vec<Simplification>);

impl List {
    fn add(&mut self, what: &str, worth: u32, set: &[(&str, &str)], needs: &[Option<usize>]) -> usize {
        let set = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        let needs = needs.iter().flatten().copied().collect();
        let (what, instead_of, shorter) = (what.to_string(), Vec::new(), Vec::new());
        self.0.push(Simplification { what, set, needs, instead_of, shorter, probe: false, worth });
        self.0.len() - 1
    }
}

fn axis(scene: &Scene, list: &mut List) {
    let (is_motor, coulomb) = match &scene.device {
        Device::Motor(motor) => (true, motor.coulomb_friction_nm),
        Device::Mass(mass) => (false, mass.coulomb_n),
    };
    let switching = is_motor && scene.model.bridge == BridgeModel::Switching;
    let averaged = switching.then(|| list.add("the bridge's switching", 6, &[("model.bridge", "averaged")], &[]));
    if is_motor {
        list.add("the winding's inductance", 1, &[("model.winding", "resistive")], &[averaged]);
    }
    if coulomb > 0.0 {
        let none = list.add("Coulomb friction", 4, &[("model.friction", "none")], &[]);
        let speed = format!("{} {}", friction_speed(scene), if is_motor { "rad/s" } else { "m/s" });
        let set = [("model.friction", "smoothed"), ("model.friction_speed", speed.as_str())];
        let smoothed = list.add("sticking (friction is smoothed)", 2, &set, &[]);
        list.0[smoothed].instead_of.push(none);
    }
    let words = scene.model.datapath == Datapath::Words;
    let mut law = None;
    let mut between = Vec::new();
    if words && has_law(scene) {
        law = Some(list.add(
            "the words of the datapath (rounding, wrapping, latency)",
            2,
            &[("model.datapath", "law")],
            &[averaged],
        ));
        let sample = [("model.solver", "sample")];
        let sample = list.add("all that happens between two samples", 5, &sample, &[averaged]);
        list.add("the encoder's counts", 1, &[("model.encoder", "ideal")], &[law, Some(sample)]);
        between.push(sample);
    }
    let steps_s = 4.0 * scene.clock.period_s()..=scene.sample_period_s();
    let solvers = [("midpoint", "implicit midpoint"), ("semi_implicit", "semi-implicit Euler")];
    if scene.model.solver.is_exact() && (law.is_some() || scene.model.datapath == Datapath::Law) {
        for (solver, called) in solvers {
            let what = |step: &str| format!("what happens within steps of {step} ({called})");
            ladder(&steps_s, what, &[("model.solver", solver)], &[averaged, law], &mut between, list);
        }
    }
    // Fixed-point words can be fed with counts where a law in floats would leave out too much of them.
    let on_counts = scene.model.encoder == EncoderModel::Quantised && !matches!(scene.hand, Hand::Capture { .. });
    let timed = scene.method.kind.features().times_lines;
    if scene.model.solver.is_exact() && words && on_counts && !timed {
        between.extend(law);
        let loaded = ("model.encoder", "loaded");
        let what = "the encoder's lines, and all that happens between two samples";
        let sample = list.add(what, 6, &[loaded, ("model.solver", "sample")], &[averaged]);
        list.0[sample].instead_of.clone_from(&between);
        between.push(sample);
        for (solver, called) in solvers {
            let what = |step: &str| format!("the encoder's lines, and what happens within steps of {step} ({called})");
            ladder(&steps_s, what, &[loaded, ("model.solver", solver)], &[averaged], &mut between, list);
        }
    }
}

/// Fixed steps in us, with their worth. The last two only serve to check the others.
const STEPS: [(f64, u32); 7] = [(1000.0, 6), (300.0, 5), (100.0, 4), (30.0, 3), (10.0, 2), (3.0, 1), (1.0, 1)];

/// Adds the fixed steps of a solver within these bounds to the list; the longest is cut to the upper bound. Each step
/// is an alternative to everything in `between`, and joins it.
fn ladder(
    steps_s: &RangeInclusive<f64>,
    what: impl Fn(&str) -> String,
    solver: &[(&str, &str)],
    needs: &[Option<usize>],
    between: &mut Vec<usize>,
    list: &mut List,
) {
    let most_us = 1e6 * steps_s.end();
    let within = STEPS.map(|(step_us, worth)| (step_us.min(most_us), worth));
    // Of steps that are cut to the same or nearly the same length, the shortest is kept.
    let apart = |at: usize| within.get(at + 1).is_none_or(|next| next.0 < 0.7 * within[at].0);
    let mut rungs = Vec::new();
    for (at, (step_us, worth)) in within.into_iter().enumerate() {
        if !apart(at) || 1e-6 * step_us < *steps_s.start() {
            continue;
        }
        let step = format!("{step_us} us");
        let set = [solver, &[("model.step", step.as_str())]].concat();
        let rung = list.add(&what(&step), worth, &set, needs);
        list.0[rung].instead_of.clone_from(between);
        between.push(rung);
        rungs.push(rung);
    }
    for (at, &rung) in rungs.iter().enumerate() {
        list.0[rung].shorter = rungs[at + 1..].iter().copied().take(2).collect();
        list.0[rung].probe = at + 2 >= rungs.len();
    }
}

/// Returns the speed at which smoothed friction reaches its full size: a count in ten sample periods, slower than
/// anything that the law sees.
fn friction_speed(scene: &Scene) -> f64 {
    scene.encoder.count_rad() / (10.0 * scene.sample_period_s())
}

/// Whether the method has a law in floats that runs in a loop.
fn has_law(scene: &Scene) -> bool {
    scene.method.kind.features().has_float && !matches!(scene.hand, Hand::Capture { .. })
}

fn phantom(scene: &PhantomScene, list: &mut List) {
    let model = &scene.model;
    if model.transmission_n_per_m > 0.0 {
        list.add("the transmission's flexibility", 4, &[("model.transmission_stiffness", "0")], &[]);
    }
    if model.amplifier_lag_s > 0.0 {
        list.add("the amplifier's lag", 2, &[("model.amplifier_lag", "0")], &[]);
    }
    if model.friction {
        list.add("friction", 3, &[("model.friction", "false")], &[]);
    }
    if !model.tested_joint_only {
        list.add("the joints that are not under test", 3, &[("model.joints", "tested")], &[]);
    }
    if model.solver.is_exact() {
        // A host's samples end steps; an FPGA's law follows the arm within a step.
        let most_s = if scene.platform.is_host() { scene.sample_period_s() } else { f64::INFINITY };
        let (mut set, mut words) = (vec![("model.solver", "rk4")], "");
        if model.law == PhantomLaw::Words {
            set.push(("model.law", "floats"));
            words = if scene.platform.is_host() { "the FPGA's clock, and " } else { "the words of the datapath, and " };
        }
        let what = |step: &str| format!("{words}what happens within steps of {step} (Runge-Kutta)");
        ladder(&(4.0 * scene.clock.period_s()..=most_s), what, &set, &[], &mut Vec::new(), list);
    }
}
