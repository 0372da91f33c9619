//! Limits over a box of unknown parameters, against spectral radii at single points of it, which have their own
//! arithmetic.

use std::num::NonZeroUsize;

use hpu_cosim::scene::{Experiment, Hand, Scene, shipped};
use hpu_cosim::{Control, SplitMix64};
use hpu_prove::SampledLoop;
use hpu_prove::linear::{BoxSet, Worlds, usual_range};
use hpu_study::limits::{Looks, Unknown, WordsSet, World, hands_of, published_hands};
use hpu_study::map::SceneText;

/// Returns a shipped scene under overrides, and its text.
fn known(name: &str, set: &[(String, String)]) -> (SceneText, Scene) {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
    let text = SceneText { name: name.into(), text: scene.text.to_string(), files: std::collections::BTreeMap::new() };
    let Experiment::Axis(parsed) = text.parse(set).expect("a scene") else { panic!("an axis") };
    (text, parsed)
}

fn sides(unknown: &[&str]) -> Vec<Unknown> {
    unknown.iter().map(|text| text.parse().unwrap_or_else(|why| panic!("{text}: {why}"))).collect()
}

fn set(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

/// Returns the growth of the loop from sample to sample in one world, at the stiffness that the nominal words make.
fn radius(world: &World, values: &[f64], stiffness: f64) -> f64 {
    let scene = world.at(values).expect("a world");
    let by = scene.full_command_over(world.nominal);
    // The damping is scaled already.
    SampledLoop::new(&scene, stiffness * by, scene.wall.damping_nm_s_per_rad).spectral_radius()
}

/// A case: a scene and its overrides, its unknown parameters, the number of stretches that are proved, and up to which
/// share of the last stiffness at which all points settle.
type Case<'a> = (&'a str, &'a [(&'a str, &'a str)], &'a [&'a str], usize, f64);

#[test]
fn every_world_of_a_box_settles_where_it_is_proved_and_some_world_does_not_beyond() {
    const HOLES: [(&str, &str); 2] = [("method.sample_rate", "300 Hz"), ("wall.damping", "5e-4")];
    holds(&[
        ("hybrid-wall", &HOLES, &["device.inductance=0.2..0.25 mH"], 2, 0.98),
        ("conventional-wall-1khz", &[], &["device.rotor_inertia=1.2e-6..1.5e-6 kg.m2"], 1, 0.99),
    ]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_world_of_a_box_of_two_sides_settles_where_it_is_proved() {
    holds(&[
        ("hybrid-wall", &[], &["device.inductance=0.18..0.27 mH", "device.resistance=2.1..2.6 Ohm"], 1, 0.99),
        ("conventional-wall-1khz", &[], &["device.inductance=0.18..0.27 mH", "bridge.supply=22..26 V"], 1, 0.98),
        ("stiff-hybrid", &[], &["hand.stiffness=0..1 N.m/rad", "hand.damping=0.0001..0.001 N.m.s/rad"], 1, 0.95),
    ]);
}

fn holds(cases: &[Case]) {
    for &(name, changes, unknown, stretches, told) in cases {
        let changes = &set(changes)[..];
        let (text, nominal) = known(name, changes);
        let unknown = sides(unknown);
        let world = World { text: &text, set: changes, nominal: &nominal, unknown: &unknown, named: &[] };
        let points = world.points().expect("points");
        let found = BoxSet::new(&world, &points, usual_range(&nominal)).expect("a linear loop");
        assert_eq!(found.proved.len(), stretches, "{name}: {found:?}");
        let mut random = SplitMix64::new(7);
        let mut share = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        for [low, high] in &found.proved {
            for _ in 0..60 {
                let values: Vec<f64> =
                    unknown.iter().map(|side| side.ends()[0] + share() * (side.ends()[1] - side.ends()[0])).collect();
                let stiffness = low * (high / low).powf(share());
                let radius = radius(&world, &values, stiffness);
                assert!(radius < 1.0, "{name}: {radius} at {stiffness}, {values:?}");
            }
        }
        // Just beyond the last stiffness at which all points of the box settle, one of its corners does not.
        let last = found.at_points.last().expect("some settle")[1];
        let corners = (0..1 << unknown.len()).map(|which: usize| {
            unknown.iter().enumerate().map(|(side, of)| of.ends()[which >> side & 1]).collect::<Vec<f64>>()
        });
        let worst = corners.map(|corner| radius(&world, &corner, 1.001 * last)).fold(0.0, f64::max);
        assert!(worst > 1.0, "{name}: {worst} beyond {last}");
        let proved = found.proved.last().expect("some are proved")[1];
        assert!(proved > told * last, "{name}: proved to {proved} of {last}");
    }
}

#[test]
fn a_world_has_the_words_of_the_scene_and_makes_its_own_torque_of_them() {
    // A full command is K U / (R + 2 R_on): a tenth more voltage makes a tenth more torque, half the resistance twice
    // as much.
    for (key, value, by) in
        [("bridge.supply", 1.1, 1.1), ("device.resistance", 0.5, 2.0), ("device.torque_constant", 3.0, 3.0)]
    {
        let (text, nominal) = known("hybrid-wall", &[]);
        let parameters = Experiment::Axis(nominal.clone());
        let own = match key {
            "bridge.supply" => nominal.bridge.supply_v,
            "device.resistance" => 2.345_660_377_358_490_3,
            _ => 0.0259,
        };
        assert!(parameters.parameters.iter().any(|parameter| parameter.key == key));
        let unknown = sides(&[&format!("{key}={:e}..{:e}", own, own * 4.0)]);
        let world = World { text: &text, set: &[], nominal: &nominal, unknown: &unknown, named: &[] };
        let scene = world.at(&[own * value]).expect("a world");
        let (words, nominal_words) = (scene.words().expect("words"), nominal.words().expect("words"));
        assert_eq!(
            (words.stiffness, words.damping, words.reference),
            (nominal_words.stiffness, nominal_words.damping, nominal_words.reference)
        );
        let ratio = words.realised.torque_quantum_nm / nominal_words.realised.torque_quantum_nm;
        assert!((ratio - by).abs() < 1e-12, "{key}: {ratio}");
        assert!((scene.wall.stiffness_nm_per_rad / nominal.wall.stiffness_nm_per_rad - by).abs() < 1e-12);
    }
    let (text, nominal) = known("hybrid-wall", &[]);
    let unknown = sides(&["encoder.lines=100..200"]);
    let world = World { text: &text, set: &[], nominal: &nominal, unknown: &unknown, named: &[] };
    assert!(world.points().unwrap_err().to_string().contains("the words change with it"));
}

#[test]
fn runs_of_worlds_together_are_those_of_each_alone() {
    let (text, nominal) = known("conventional-wall-1khz", &set(&[("wall.stiffness", "0.5")]));
    let unknown = sides(&["device.inductance=0.15..0.3 mH"]);
    let changes = set(&[("wall.stiffness", "0.5")]);
    let world = World { text: &text, set: &changes, nominal: &nominal, unknown: &unknown, named: &[] };
    let other = world.at(&[0.3]).expect("a world");
    let looks = Looks { phases: 2, coarse: 6, most: 6, climbs: false, nearest: 0.0 };
    let run = |worlds: &[Scene]| {
        WordsSet::new(worlds, [0.3, 0.8], looks, NonZeroUsize::MIN, &Control::default()).expect("a set")
    };
    let (both, one, two) = (run(&[nominal.clone(), other.clone()]), run(&[nominal]), run(&[other]));
    assert_eq!((both.worlds, both.phases, one.phases), (2, 4, 2));
    let mut shared = 0;
    for seen in &both.seen {
        let of = |set: &WordsSet| set.seen.iter().find(|other| other.word == seen.word).map(|seen| seen.settled);
        if let (Some(one), Some(two)) = (of(&one), of(&two)) {
            assert_eq!(seen.settled, one + two, "word {}", seen.word);
            shared += 1;
        }
    }
    assert!(shared >= 4, "{shared}");
}

#[test]
fn published_hands_turn_by_the_square_of_the_lever() {
    let hands = published_hands();
    assert!(hands.len() >= 5 && hands.iter().all(|hand| !hand.source.is_empty()), "{hands:?}");
    assert_eq!((hands[0].stiffness_n_per_m, hands[0].damping_n_s_per_m), (0.0, 0.0));
    let (_, scene) = known("hybrid-wall", &[]);
    let (sides, sets) = hands_of(&scene, Some(0.05)).expect("a motor's wheel has a radius");
    // 769.9 N/m at 50 mm of a wheel that turns a seventh of the shaft's angle: 769.9 x 0.0025 / 49.
    let firmest = 769.9 * 0.0025 / 49.0;
    assert!((sides[0].ends()[1] - firmest).abs() < 1e-6 * firmest, "{}", sides[0]);
    assert_eq!((sides[0].ends()[0], sides[1].ends()[0], sets.len()), (0.0, 0.0, hands.len()));
    assert!(hands_of(&scene, None).unwrap_err().to_string().contains("--hands 50mm"));
    let (_, mass) = known("rail-drop", &[]);
    assert!(!matches!(mass.hand, Hand::SpringDamper { .. }));
    assert!(hands_of(&mass, None).unwrap_err().to_string().contains("spring_damper"));
}
