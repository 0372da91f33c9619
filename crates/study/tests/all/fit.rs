//! The least model that answers a scene's question: it is right for the scene where it is chosen and for other scenes,
//! and scenes that are designed to mislead the choice do not mislead it.

use hpu_cosim::scene::{Experiment, FocScene, Hand, Output, Solver, shipped, shipped_file};
use hpu_cosim::{Control, Wired, WiredSimulation};
use hpu_study::accuracy::{Outputs, usual, worst};
use hpu_study::fit::{Fit, fit, models, overrides, simplifications};
use hpu_study::map::SceneText;

type Set = Vec<(String, String)>;

fn read_text(name: &str, set: &Set) -> Result<(SceneText, Experiment), String> {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    SceneText::read((name, shipped.text), set, &mut shipped_file).map_err(|error| error.to_string())
}

fn read(name: &str, set: &Set) -> (SceneText, Experiment) {
    read_text(name, set).unwrap_or_else(|error| panic!("{error}"))
}

fn fitted(name: &str, set: &Set) -> Fit {
    let (text, experiment) = read(name, set);
    let found = fit(&text, set, experiment.accuracy.within, &Control::default());
    found.unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn sets(found: &Fit, key: &str) -> bool {
    found.set.iter().any(|(set, _)| set == key)
}

/// Whether the fit leaves only the ends of a scene's sample periods.
fn leaps_samples(name: &str) -> bool {
    match read(name, &fitted(name, &Set::new()).set).1 {
        Experiment::Axis(scene) => {
            scene.model.solver == Solver::Sample
                || scene.model.solver.is_fixed_step() && scene.step_clocks() >= scene.period_clocks()
        }
        Experiment::Phantom(_)
        | Experiment::Gimbal(_)
        | Experiment::Transfer(_)
        | Experiment::Paddle(_)
        | Experiment::Foc(_)
        | Experiment::Dut(_) => false,
    }
}

/// Runs a scene under overrides; returns its outputs, and which of them count.
fn run(name: &str, set: &Set) -> (Outputs, Vec<Output>) {
    let (_, experiment) = read(name, set);
    let driver = WiredSimulation::new(&experiment).unwrap_or_else(|error| panic!("{name}: {error}")).driver();
    let (outputs, _) = Outputs::of(&experiment, driver, &Control::default()).unwrap_or_else(|error| panic!("{error}"));
    let outputs = outputs.expect("nobody stops it");
    let counted = experiment.accuracy.outputs.clone().unwrap_or_else(|| usual(outputs.outcome));
    (outputs, counted)
}

/// Returns two of the walls that `hpu fit --help` says were tried: for them the tolerance itself holds.
fn tried(experiment: &Experiment) -> [Set; 2] {
    let one = |key: &str, value: f64| vec![(key.to_string(), format!("{value:?}"))];
    match experiment {
        Experiment::Axis(scene) => [
            one("wall.stiffness", 1.05 * scene.wall.stiffness_nm_per_rad),
            one("wall.position", scene.wall.position_rad + 0.94 * scene.encoder.count_rad()),
        ],
        Experiment::Phantom(scene) => [
            one("room.stiffness", 1.05 * scene.room.stiffness_n_per_m),
            one("room.distance", scene.room.distance_m + 0.7 * 29e-6),
        ],
        Experiment::Gimbal(scene) => {
            [one("device.mass", 1.05 * scene.gimbal.mass_kg), one("device.mass", 0.95 * scene.gimbal.mass_kg)]
        }
        Experiment::Transfer(scene) => [0.95, 1.05].map(|share| one("reference.value", share * scene.reference[0])),
        Experiment::Paddle(scene) => [0.95, 1.05].map(|share| one("method.kp", share * scene.method.gains[0])),
        Experiment::Foc(scene) => [0.95, 1.05].map(|share| one(foc(scene).0, share * foc(scene).1)),
        Experiment::Dut(_) => panic!("no shipped scene has a design of the user's own"),
    }
}

/// Returns the stiffness of a wall behind field-oriented control, or else the bandwidth of the currents.
fn foc(scene: &FocScene) -> (&'static str, f64) {
    let bandwidth = ("method.current_bandwidth", scene.method.bandwidth_hz);
    scene.wall.as_ref().map_or(bandwidth, |wall| ("wall.stiffness", wall.stiffness_nm_per_rad))
}

/// Returns scenes near a scene that the choice has not tried: for them the help promises twice the tolerance.
fn elsewhere(experiment: &Experiment) -> Vec<Set> {
    let (stiffness, k, place, at, step) = match experiment {
        Experiment::Axis(scene) => (
            "wall.stiffness",
            scene.wall.stiffness_nm_per_rad,
            "wall.position",
            scene.wall.position_rad,
            scene.encoder.count_rad(),
        ),
        Experiment::Phantom(scene) => {
            ("room.stiffness", scene.room.stiffness_n_per_m, "room.distance", scene.room.distance_m, 29.1e-6)
        }
        Experiment::Gimbal(scene) => {
            let of_mass = |share: f64| vec![("device.mass".to_string(), format!("{:?}", share * scene.gimbal.mass_kg))];
            return [0.98, 1.03].map(of_mass).to_vec();
        }
        Experiment::Transfer(scene) => {
            let [value, _] = scene.reference;
            return [0.98, 1.03]
                .map(|share| vec![("reference.value".to_string(), format!("{:?}", share * value))])
                .to_vec();
        }
        Experiment::Paddle(scene) => {
            let of_gain = |share: f64| vec![("method.kp".to_string(), format!("{:?}", share * scene.method.gains[0]))];
            return [0.98, 1.03].map(of_gain).to_vec();
        }
        Experiment::Foc(scene) => {
            let (key, value) = foc(scene);
            return [0.98, 1.03].map(|share| vec![(key.to_string(), format!("{:?}", share * value))]).to_vec();
        }
        Experiment::Dut(_) => panic!("no shipped scene has a design of the user's own"),
    };
    let one = |key: &str, value: f64| vec![(key.to_string(), format!("{value:?}"))];
    let places = [-8.4, -2.6, 1.9, 7.7].map(|counts| one(place, at + counts * step));
    [0.98, 1.03].map(|share| one(stiffness, share * k)).into_iter().chain(places).collect()
}

/// Scenes that take a third of the time of all scenes; `testbench/long.sh` runs them.
const LONG: [&str; 8] = [
    "power-scaling",
    "impulse-engine-shaped",
    "phantom-drop-rtos",
    "phantom-flexible",
    "stiff-conventional-1khz",
    "conventional-wall-1khz",
    "epfl-paddle-step",
    "epfl-paddle-cycle",
];

fn right_on(name: &str) {
    let (_, experiment) = read(name, &Set::new());
    if matches!(&experiment, Experiment::Axis(scene) if matches!(scene.hand, Hand::Capture { .. })) {
        return;
    }
    let found = fitted(name, &Set::new());
    let within = experiment.accuracy.within;
    let (reference, counted) = run(name, &Set::new());
    let error = worst(&run(name, &found.set).0.errors(&reference), &counted);
    assert!(error <= within / 2.0, "{name}: {:?} is off by {error}", found.set);
    if found.set.is_empty() {
        return;
    }
    assert!(found.around <= within, "{name}: {} around", found.around);
    for change in tried(&experiment) {
        // A wall that no longer fits its word was not tried.
        let Ok(_) = read_text(name, &change) else { continue };
        let set = change.iter().chain(&found.set).cloned().collect();
        let error = worst(&run(name, &set).0.errors(&run(name, &change).0), &counted);
        assert!(error <= within, "{name} at {change:?}: {:?} is off by {error}", found.set);
    }
    for change in elsewhere(&experiment) {
        let (there, _) = run(name, &change);
        // A scene near a boundary of stability may itself have another outcome: then the pick must have the same.
        let counted = if there.outcome == reference.outcome { counted.clone() } else { usual(there.outcome) };
        let set = change.iter().chain(&found.set).cloned().collect();
        let error = worst(&run(name, &set).0.errors(&there), &counted);
        assert!(error <= 2.0 * within, "{name} at {change:?}: {:?} is off by {error}", found.set);
    }
}

/// Checks the scenes whose number in the list leaves this remainder by twelve: the tests of a file run side by side.
fn right_on_scenes(rest: usize) {
    let names = shipped().iter().map(|shipped| shipped.name);
    names.skip(rest).step_by(12).filter(|name| !LONG.contains(name)).for_each(right_on);
}

#[test]
fn what_is_chosen_is_right_on_a_few_scenes_and_around_them() {
    let names = shipped().iter().map(|shipped| shipped.name);
    names.step_by(36).filter(|name| !LONG.contains(name)).for_each(right_on);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_is_chosen_is_right_on_every_twelfth_scene_and_around_it() {
    right_on_scenes(0);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_is_chosen_is_right_on_some_of_the_others_and_around_them() {
    (1..5).for_each(right_on_scenes);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_is_chosen_is_right_on_more_of_the_others_and_around_them() {
    (5..9).for_each(right_on_scenes);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_is_chosen_is_right_on_the_last_of_the_others_and_around_them() {
    (9..12).for_each(right_on_scenes);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_is_chosen_is_right_on_the_scenes_that_take_long_and_around_them() {
    LONG.into_iter().for_each(right_on);
}

#[test]
fn a_resonance_above_the_sample_rate_keeps_what_happens_between_samples() {
    let name = "ringing-wall";
    assert!(!leaps_samples(name));
    // Words are far finer than the ringing: a pick may keep them where that costs no time, and leaves them out within
    // the tolerance.
    let mut set = fitted(name, &Set::new()).set;
    // "loaded" is the words' counter, which a law has not.
    set.retain(|(key, value)| key != "model.datapath" && (key != "model.encoder" || value != "loaded"));
    set.push(("model.datapath".to_string(), "law".to_string()));
    let (reference, counted) = run(name, &Set::new());
    let error = worst(&run(name, &set).0.errors(&reference), &counted);
    assert!(error <= read(name, &Set::new()).1.accuracy.within, "{set:?} is off by {error}");
}

#[test]
fn a_contact_shorter_than_a_sample_keeps_what_happens_between_samples() {
    assert!(!leaps_samples("short-contact"));
}

#[test]
fn a_limit_cycle_of_one_tick_keeps_the_counts() {
    for name in ["one-tick", "count-cycle"] {
        let found = fitted(name, &Set::new());
        let ideal = found.set.iter().any(|(key, value)| key == "model.encoder" && value == "ideal");
        assert!(!ideal && !sets(&found, "model.datapath"), "{name}: {:?}", found.set);
    }
}

#[test]
fn slow_stick_slip_keeps_its_friction() {
    assert!(!sets(&fitted("slow-friction", &Set::new()), "model.friction"));
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_modulator_slower_than_its_winding_keeps_its_switching_and_a_slow_winding_its_inductance() {
    assert!(!sets(&fitted("slow-pwm", &Set::new()), "model.bridge"));
    assert!(!sets(&fitted("slow-winding", &Set::new()), "model.winding"));
}

#[test]
fn a_looser_tolerance_leaves_out_more() {
    let name = "hybrid-wall";
    let (text, _) = read(name, &Set::new());
    let of = |within| fit(&text, &Set::new(), within, &Control::default()).expect("it runs");
    let (tight, loose) = (of(0.001), of(0.2));
    assert!(tight.set.is_empty(), "{:?}", tight.set);
    assert!(sets(&loose, "model.bridge"), "{:?}", loose.set);
    // Each thing left out is named with the output that it changes, each thing kept with the reason.
    assert!(!loose.left_out.is_empty() && loose.left_out.iter().all(|left| left.effect <= 0.1));
    assert_eq!(tight.left_out, []);
    assert!(tight.kept.iter().any(|kept| kept.what == "the bridge's switching"), "{:?}", tight.kept);
}

#[test]
fn models_hold_no_contradictions_and_end_with_the_scene_as_written() {
    for shipped in shipped() {
        let (text, experiment) = read(shipped.name, &Set::new());
        let all = simplifications(&experiment);
        let models = models(&all);
        assert_eq!(models.last(), Some(&Vec::new()), "{}", shipped.name);
        let mut seen = std::collections::BTreeSet::new();
        for model in &models {
            assert!(seen.insert(model.clone()), "{}: {model:?} twice", shipped.name);
            let set = overrides(&all, model);
            if let Err(error) = text.parse(&set) {
                panic!("{}: {error}", shipped.name);
            }
        }
    }
}

#[test]
fn an_open_model_is_that_of_the_scene_until_a_key_of_it_is_set() {
    let set = |pairs: &[(&str, &str)]| pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let (_, plain) = read("free-motion", &Set::new());
    let (_, open) = read("free-motion", &set(&[("model", "auto")]));
    let (_, chosen) = read("free-motion", &set(&[("model", "auto"), ("model.bridge", "averaged")]));
    assert!(open.auto && !plain.auto && !chosen.auto);
    let model = |experiment: Experiment| experiment.axis().expect("an axis").model;
    assert_eq!(model(open), model(plain.clone()));
    assert_ne!(model(chosen), model(plain));
}
