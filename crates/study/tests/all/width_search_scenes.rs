//! Tests the search over widths on several scenes at once, and with proved ranges.

use hpu_cosim::Control;
use hpu_cosim::Driver;
use hpu_cosim::scene::Experiment;
use hpu_prove::ranges::axis_bounds;
use hpu_study::Error;
use hpu_study::accuracy::{Outputs, worst};
use hpu_study::widths::Field;
use hpu_study::widths::search::{Design, Found, Plan};

use crate::width_search::{ANY_ERROR, PLAN, Set, found, holds_to_the_grid, knobs, scene, set, text};

#[test]
fn the_front_on_several_scenes_is_that_of_the_grid_run_scene_by_scene() {
    // A stiffer wall has the stable stiffness of the first scene; another throw and another damping have their own.
    let on = [
        ("60 ms", "1.5", "40 rad/s", "0.2", true),
        ("60 ms", "2.5", "40 rad/s", "0.2", false),
        ("50 ms", "1.5", "25 rad/s", "0.4", true),
    ]
    .map(|(duration, stiffness, speed, damping, climbs)| {
        let set = set(&[
            ("run.duration", duration),
            ("wall.stiffness", stiffness),
            ("device.initial_speed", speed),
            ("wall.damping", &format!("{damping} mN.m.s/rad")),
        ]);
        ("thrown-hybrid", set, climbs)
    });
    let knobs = ["position_bits=5..7", "stiffness_format.frac=0..1", "damping_format.frac=1..3", "velocity_bits=2..5"];
    let (all, runs) = holds_to_the_grid(&on, &knobs, ANY_ERROR, |_| true);
    let one = found(&[scene(on[0].0, &on[0].1)], &crate::width_search::knobs(&knobs), ANY_ERROR).expect("a search");
    assert!(3 * all.runs < runs, "{} runs instead of {runs}", all.runs);
    let front = |found: &Found| found.best().map(|point| (point.design.to_string(), point.merit)).collect::<Vec<_>>();
    assert_ne!(front(&all), front(&one), "the other scenes tell nothing");
}

/// Makes a hand that strikes at once, so that a run is short.
fn struck(stiffness: &str) -> Set {
    set(&[
        ("device.initial_angle", "1.4 rad"),
        ("hand.path", "[[\"0 s\", 1.4], [\"20 ms\", 1.8]]"),
        ("run.duration", "120 ms"),
        ("wall.stiffness", stiffness),
    ])
}

/// Returns whether position and velocity hold the proved ranges for the stiffest wall that the format holds.
fn holds(experiment: &Experiment) -> bool {
    let mut scene = experiment.clone().axis().expect("an axis");
    let words = scene.words().expect("words");
    let format = scene.method.stiffness_format;
    let unit = words.realised.torque_quantum_nm / words.realised.count_rad;
    scene.wall.stiffness_nm_per_rad = unit * format.to_f64(format.max() as i64);
    let proof = axis_bounds(&scene).expect("a proof");
    ["delta", "velocity"].into_iter().all(|net| proof.of(net).expect("a bound").never_overflows)
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn so_it_is_where_words_have_to_hold_the_proved_range() {
    let on = [("hybrid-wall", struck("1.5 N.m/rad"), true), ("hybrid-wall", struck("2.5 N.m/rad"), false)];
    let plan = Plan { proved: true, ..ANY_ERROR };
    let knobs =
        ["position_bits=10..12", "stiffness_format.frac=0..1", "damping_format.frac=1..2", "velocity_bits=7..11"];
    let (found, _) = holds_to_the_grid(&on, &knobs, plan, holds);
    let proved = found.proved.as_ref().expect("the widest design holds it");
    for held in proved {
        // The narrowest words that hold the ranges are on the front, and no narrower ones.
        let bits =
            |(least, most): (i64, i64)| (1..).find(|bits| -(1i64 << (bits - 1)) <= least && most < 1 << (bits - 1));
        let [position, velocity] = [held.delta, held.velocity].map(|ends| bits(ends).expect("some"));
        for point in &found.points {
            assert!(point.design.get(Field::POSITION) >= position && point.design.get(Field::VELOCITY) >= velocity);
        }
    }
    let least = |width| found.points.iter().map(|point| point.design.get(width)).min();
    assert!(
        least(Field::POSITION) > Some(10) && least(Field::VELOCITY) > Some(7),
        "the range asks for more than the grid's least"
    );
}

/// Returns the widths that a search on `hybrid-wall` alone finds: they saturate the velocity at 2 bits.
fn of_one_motion() -> Design {
    let base = scene("hybrid-wall", &Set::new()).1;
    let widths =
        [(Field::POSITION, 11), (Field::STIFFNESS_INT, 7), (Field::STIFFNESS_FRAC, 1), (Field::DAMPING_INT, 2)];
    let own =
        widths.into_iter().fold(Design::of(&base).expect("an axis"), |design, (width, bits)| design.with(width, bits));
    own.with(Field::DAMPING_FRAC, 0).with(Field::VELOCITY, 2)
}

/// Returns the worst error of a design on `hybrid-wall` at a stiffness, against the design of 24 bits.
fn error_at(design: Design, stiffness: &str) -> f64 {
    let run = |design: Design| {
        let all: Set = set(&[("wall.stiffness", stiffness)]).into_iter().chain(design.set()).collect();
        let scene = text("hybrid-wall").parse(&all).expect("the scene");
        Outputs::of(&scene, Driver::Events, &Control::default()).expect("it runs").0.expect("nobody stops it")
    };
    let reference = run(design_of_24_bits());
    worst(&run(design).errors(&reference), &hpu_study::accuracy::usual(reference.outcome))
}

fn design_of_24_bits() -> Design {
    Design::of(&scene("hybrid-wall", &Set::new()).1).expect("an axis").wide(24).expect("wide enough")
}

#[test]
fn a_design_that_one_motion_flatters_is_not_found_where_another_is_asked_too() {
    let design = of_one_motion();
    assert!(error_at(design, "1.5 N.m/rad") <= 0.01, "on the motion that it was searched on it is within 1 %");
    assert!(error_at(design, "2.5 N.m/rad") > 0.015, "on a stiffer wall it is not");
    let plan = Plan { against: Some(24), within: 0.01, ..PLAN };
    // The widths of that design, and some of position and gains around it.
    let fixed =
        [("method.position_bits", "11"), ("method.damping_format", "(0,2,0)"), ("method.stiffness_format", "(0,7,0)")];
    let knobs = knobs(&["stiffness_format.frac=0..1", "damping_format.frac=0..2", "velocity_bits=2..4"]);
    let [one, other] = ["1.5 N.m/rad", "2.5 N.m/rad"]
        .map(|stiffness| scene("hybrid-wall", &set(&[&fixed[..], &[("wall.stiffness", stiffness)]].concat())));
    let alone = found(std::slice::from_ref(&one), &knobs, plan).expect("a search");
    assert_eq!(alone.smallest(0.01).expect("one").design, design);
    let both = found(&[one, other], &knobs, plan).expect("a search");
    assert!(both.points.iter().all(|point| point.design != design));
    let cheapest = both.best().next().expect("some design is good for both").design;
    for stiffness in ["1.5 N.m/rad", "2.5 N.m/rad"] {
        assert!(error_at(cheapest, stiffness) <= 0.01, "{cheapest} at {stiffness}");
    }
}

#[test]
fn scenes_that_no_search_takes_together_are_refused_with_the_reason() {
    let one = knobs(&["velocity_bits=3..5"]);
    let refused = |names: &[(&str, &[(&str, &str)])], proved: bool| -> Error {
        let scenes: Vec<_> = names.iter().map(|(name, pairs)| scene(name, &set(pairs))).collect();
        found(&scenes, &one, Plan { proved, ..PLAN }).expect_err("it is refused")
    };
    for (names, proved, said) in [
        (
            &[("hybrid-wall", &[][..]), ("conventional-wall-1khz", &[])][..],
            false,
            "method.kind = \"hybrid\" and \"conventional\"",
        ),
        (&[("hybrid-wall", &[]), ("wrap-product", &[])], false, "have another method.product"),
        (&[("hybrid-wall", &[]), ("weak-wall", &[])], false, "stiffness in N.m/rad and in N/m"),
        (&[("hybrid-wall", &[]), ("prescribed-sweep", &[])], false, "prescribed-sweep: the hand imposes the motion"),
        (&[("thrown-hybrid", &[])], true, "thrown-hybrid: no limit of the travel is proved"),
        (
            &[("wrap-product", &[("method.velocity_bits", "12")])],
            true,
            "method.velocity_bits: too few bits for the range proved",
        ),
    ] {
        let refused = refused(names, proved).to_string();
        assert!(refused.contains(said), "{names:?}: {refused}");
    }
}

#[test]
fn a_search_knows_of_each_scene_whether_its_hand_reaches_the_wall() {
    // The wall is at 1.5 rad.
    for (path, touches) in [("[[0, 0], [0.1, 1.0]]", false), ("[[0, 0], [0.1, 1.8]]", true)] {
        let hand = set(&[("hand.path", path), ("run.duration", "300 ms")]);
        let found = found(&[scene("hybrid-wall", &hand)], &knobs(&["position_bits=11..12"]), ANY_ERROR);
        assert_eq!(found.expect("a search").on[0].touches, touches, "{path}");
    }
}
