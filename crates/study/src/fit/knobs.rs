//! What may be left out of a scene, and which of it goes together.

use hpu_cosim::scene::{BridgeModel, Datapath, Device, Experiment, Hand, Loop, PhantomScene, Scene};

/// One thing that a cheaper model leaves out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Simplification {
    /// What is left out, as a noun: "the bridge's switching".
    pub what: &'static str,
    /// The keys that leave it out.
    pub set: Vec<(String, String)>,
    /// Those that must be left out before, as indices into the list.
    needs: Vec<usize>,
    /// That of which it is another degree, and with which it does not go together.
    instead_of: Option<usize>,
    /// How much it is worth, to say which models to try first: about the logarithm of the gain in speed.
    worth: u32,
}

/// What may be left out of an experiment.
#[must_use]
pub fn simplifications(experiment: &Experiment) -> Vec<Simplification> {
    let mut list = List(Vec::new());
    match experiment {
        Experiment::Axis(scene) => axis(scene, &mut list),
        Experiment::Phantom(scene) => phantom(scene, &mut list),
    }
    list.0
}

/// The sets of simplifications that go together, cheapest first by their worth; the last one is empty: the scene as written.
#[must_use]
pub fn models(all: &[Simplification]) -> Vec<Vec<usize>> {
    let mut models: Vec<Vec<usize>> = (0..1usize << all.len())
        .map(|bits| (0..all.len()).filter(|index| bits >> index & 1 == 1).collect::<Vec<_>>())
        .filter(|set| {
            set.iter().all(|&index| {
                let one = &all[index];
                one.needs.iter().all(|need| set.contains(need)) && one.instead_of.is_none_or(|it| !set.contains(&it))
            })
        })
        .collect();
    let worth = |set: &Vec<usize>| set.iter().map(|&index| all[index].worth).sum::<u32>();
    models.sort_by_key(|set| std::cmp::Reverse((worth(set), set.len())));
    models
}

/// The keys of a model.
#[must_use]
pub fn overrides(all: &[Simplification], model: &[usize]) -> Vec<(String, String)> {
    model.iter().flat_map(|&index| all[index].set.iter().cloned()).collect()
}

struct List(Vec<Simplification>);

impl List {
    fn add(&mut self, what: &'static str, worth: u32, set: &[(&str, &str)], needs: &[Option<usize>]) -> usize {
        let set = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        let needs = needs.iter().flatten().copied().collect();
        self.0.push(Simplification { what, set, needs, instead_of: None, worth });
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
        list.0[smoothed].instead_of = Some(none);
    }
    let words = scene.model.datapath == Datapath::Words;
    if words && has_law(scene) {
        let law = list.add(
            "the words of the datapath (rounding, wrapping, latency)",
            2,
            &[("model.datapath", "law")],
            &[averaged],
        );
        let sample = [("model.solver", "sample")];
        let sample = list.add("all that happens between two samples", 5, &sample, &[averaged]);
        list.add("the encoder's counts", 1, &[("model.encoder", "ideal")], &[Some(law), Some(sample)]);
    }
}

/// Where smoothed friction reaches its full size: a count in ten sample periods, slower than anything that the law sees.
fn friction_speed(scene: &Scene) -> f64 {
    scene.encoder.count_rad() / (10.0 * scene.sample_period_s())
}

/// Whether the method has a law in floats that runs in a loop.
fn has_law(scene: &Scene) -> bool {
    use hpu_cosim::scene::LawMethod;
    let estimator = match scene.method.kind {
        Loop::Law(LawMethod::SampledWall(wall)) => wall.estimator == hpu_datapath::Estimator::Difference,
        _ => true,
    };
    let shaped = scene.amplifier.is_some_and(|amplifier| amplifier.shaper.is_some());
    estimator && !shaped && !matches!(scene.hand, Hand::Capture { .. })
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
    if !model.ideal {
        list.add("the words of the datapath", 1, &[("model.law", "ideal")], &[]);
    }
}
