//! The scenes that come with the program.

use std::collections::BTreeSet;
use std::path::Path;

use hpu_cosim::scene::{Hand, Loop, Scene, shipped, shipped_file};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation, metric};

fn parsed(name: &str) -> Scene {
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&[]).unwrap_or_else(|error| panic!("{error}")).axis().unwrap()
}

#[test]
fn every_shipped_scene_parses_under_its_name_and_expects_something() {
    for scene in shipped() {
        let parsed = scene.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(parsed.name, scene.name);
        let expect = &parsed.expect;
        assert!(expect.outcome.is_some() || !expect.numbers.is_empty(), "{}", scene.name);
        WiredSimulation::new(&parsed).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn every_file_of_the_scenes_folder_is_shipped_and_unaltered() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testbench/scenes");
    let mut found = BTreeSet::new();
    for file in std::fs::read_dir(&folder).unwrap() {
        let path = file.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let text = std::fs::read(&path).unwrap();
        match name.strip_suffix(".toml") {
            Some(stem) => {
                let scene = shipped().iter().find(|scene| scene.name == stem);
                assert_eq!(scene.unwrap_or_else(|| panic!("{name} is not shipped")).text.as_bytes(), text);
                found.insert(stem.to_string());
            }
            None => assert_eq!(shipped_file(&name).unwrap_or_else(|_| panic!("{name} is not shipped")), text),
        }
    }
    let names: BTreeSet<_> = shipped().iter().map(|scene| scene.name.to_string()).collect();
    assert_eq!(found, names);
}

#[test]
fn the_walls_that_are_compared_differ_in_nothing_but_the_loop() {
    let hybrid = parsed("hybrid-wall");
    for (name, rate_hz) in
        [("conventional-wall-100hz", 100.0), ("conventional-wall-1khz", 1e3), ("conventional-wall-10khz", 1e4)]
    {
        let mut method = parsed(name).method;
        assert_eq!((method.kind, method.sample_rate_hz), (Loop::Conventional, rate_hz));
        (method.kind, method.sample_rate_hz) = (hybrid.method.kind, hybrid.method.sample_rate_hz);
        assert_eq!(method, hybrid.method);
        let scene = parsed(name);
        assert_eq!((scene.device, scene.wall, scene.hand.clone()), (hybrid.device, hybrid.wall, hybrid.hand.clone()));
        assert_eq!((scene.bridge, scene.clock, scene.run), (hybrid.bridge, hybrid.clock, hybrid.run));
    }
}

#[test]
fn every_shipped_scene_does_what_it_expects() {
    for shipped in shipped() {
        let scene = shipped.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{}: {error}", shipped.name));
        let mut trace = simulation.trace(&[]);
        let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        if scene.expect.outcome.is_some() {
            assert_eq!(summary.outcome(), scene.expect.outcome, "{}", shipped.name);
        }
        for number in &scene.expect.numbers {
            let name = number.metric.name();
            let value = metric(number.metric, &scene, &summary, &trace)
                .unwrap_or_else(|| panic!("{}: {name} has no meaning", shipped.name));
            assert!(
                (value - number.value).abs() <= number.tolerance,
                "{}: {name} is {value}, not {} within {}",
                shipped.name,
                number.value,
                number.tolerance
            );
        }
    }
}

#[test]
fn the_shipped_capture_moves_one_count_at_a_time_and_returns() {
    let Hand::Capture { edges } = parsed("replay-capture").hand else { panic!("a capture") };
    // Position of (a, b) in the forward order 00, 01, 11, 10.
    let phase = |a: bool, b: bool| i64::from(a) * 2 + i64::from(a != b);
    let (mut count, mut peak) = (0, 0);
    for pair in edges.windows(2) {
        let step = (phase(pair[1].a, pair[1].b) - phase(pair[0].a, pair[0].b)).rem_euclid(4);
        assert_ne!(step, 2, "both lines change at {} ps", pair[1].picoseconds);
        count += if step == 3 { -1 } else { step };
        peak = peak.max(count);
    }
    // 1.9 rad at 256 counts a turn.
    assert_eq!((count, peak), (0, (1.9 * 256.0 / (2.0 * std::f64::consts::PI)) as i64));
}

#[test]
fn the_shipped_motion_is_the_formula_it_says() {
    let Hand::Prescribed { path } = parsed("replay-motion").hand else { panic!("a motion") };
    for point in path {
        let push = |start_s: f64| {
            let turn = (point.time_s - start_s) / 0.4;
            if (0.0..=1.0).contains(&turn) { (1.0 - (2.0 * std::f64::consts::PI * turn).cos()) / 2.0 } else { 0.0 }
        };
        assert!((point.angle_rad - 1.65 * (push(0.05) + push(0.5))).abs() <= 0.5e-6 + 1e-12, "{point:?}");
    }
}
