//! The models of an axis that leave something out: for races of accuracy against speed, and for fits.

use hpu_cosim::scene::{BridgeModel, Compound, Datapath, Device, EncoderModel, Hand, Scene, Setup};

use hpu_plant::network::FeedKind;

use crate::accuracy::{Contestant, SOLVERS, Variant, rungs};
use crate::fit::Simplifications;

/// Multiples of [`PHASE`] by which the wall is moved, nearer and farther. Fixed-point words hold the wall at a whole
/// count: these moves reach each of the counts nearby. A law in floats holds the wall between counts: there each move
/// gives another phase. The last multiple, farther away, is tried once, because a motion may be much longer or shorter
/// there.
const PHASES: [f64; 7] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0];
/// Unit of the moves, in encoder counts.
const PHASE: f64 = 0.94;

/// Returns the places and stiffnesses of the walls of the neighbouring scenes, in the units of their keys.
pub(super) fn around(scene: &Scene) -> Vec<(&'static str, f64)> {
    let wall = scene.written_wall();
    let (k, position, count) =
        (wall.stiffness_nm_per_rad, wall.position_rad, scene.encoder.count_rad() * scene.scale());
    let stiffness = [0.95, 1.05].map(|share| ("wall.stiffness", share * k));
    let places = PHASES.into_iter().flat_map(|phase| [-phase, phase]);
    let places = places.map(|phase| ("wall.position", position + PHASE * phase * count));
    stiffness.into_iter().filter(|_| k > 0.0).chain(places).collect()
}

/// Returns what can be left out of a network, which is flowed exactly and in words: its name as a contestant, what it
/// is, and the key of `[model]` that leaves it out.
fn of_network(scene: &Scene, compound: &Compound) -> Vec<(&'static str, &'static str, (&'static str, &'static str))> {
    let feed = compound.network.feed.kind;
    let lags = matches!(feed, FeedKind::Pi { .. })
        || matches!(feed, FeedKind::Current { bandwidth_rad_per_s, .. } if bandwidth_rad_per_s.is_finite());
    let all = [
        (coulomb(scene) > 0.0, "frictionless", "Coulomb friction", ("model.friction", "none")),
        (
            compound.network.joints.iter().any(|joint| joint.compliance.is_some()),
            "rigid",
            "the joints' compliance",
            ("model.joints", "rigid"),
        ),
        (lags, "ideal drive", "the drive's lag and limit", ("model.drive", "ideal")),
        (
            compound.dac.is_some_and(|dac| dac.bits.is_some()),
            "exact converter",
            "the converter's bits",
            ("model.converter", "exact"),
        ),
        (scene.host_clocks > 0, "on time", "the host's lateness", ("model.host", "on_time")),
    ];
    all.into_iter().filter(|(has, ..)| *has).map(|(_, name, what, set)| (name, what, set)).collect()
}

pub(super) fn contestants(scene: &Scene) -> Vec<Contestant> {
    if let Some(compound) = scene.network.as_deref() {
        let all = of_network(scene, compound).into_iter();
        return all.map(|(name, _, set)| Contestant::new(name, &[set])).collect();
    }
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
    } else if motor && in_words && scene.bridge.dead_band_v == 0.0 {
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
        all.push(Contestant::new("frictionless", &[("model.friction", "none")]));
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

pub(super) fn simplifications(scene: &Scene) -> Simplifications {
    let mut list = Simplifications::default();
    let (is_motor, coulomb) = match &scene.device {
        Device::Motor(motor) => (true, motor.coulomb_friction_nm),
        Device::Mass(mass) => (false, mass.coulomb_n),
    };
    if let Some(compound) = scene.network.as_deref() {
        for (_, what, set) in of_network(scene, compound) {
            list.add(what, 2, &[set], &[]);
        }
        return list;
    }
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
        list.exclude(smoothed, [none]);
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
            list.ladder(&steps_s, what, &[("model.solver", solver)], &[averaged, law], &mut between);
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
        list.exclude(sample, between.iter().copied());
        between.push(sample);
        for (solver, called) in solvers {
            let what = |step: &str| format!("the encoder's lines, and what happens within steps of {step} ({called})");
            list.ladder(&steps_s, what, &[loaded, ("model.solver", solver)], &[averaged], &mut between);
        }
    }
    list
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
