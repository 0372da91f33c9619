//! Scenes of a PHANToM: every key is read, every default is the documented one.

use hpu_cosim::scene::{
    Direction, Expectation, Experiment, Metric, OutcomeKind, PhantomLaw, PhantomModel, PhantomScene, Platform, Premium,
    Solver, shipped,
};
use hpu_datapath::phantom::{Config, Turn};

/// The shortest scene that is accepted.
const LEAST: &str = r#"about = "A drop."
[device]
kind = "phantom"
[drop]
axis = "y"
[platform]
kind = "FPGA-400"
[clock]
frequency = "50 MHz"
[room]
stiffness = "1 kN/m"
[run]
duration = "10 s"
"#;

fn scene(overrides: &[(&str, &str)]) -> PhantomScene {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let mut no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let scene = Experiment::parse("testbench/scenes/x.toml", LEAST, &overrides, &mut no_files);
    scene.unwrap_or_else(|error| panic!("{error}")).phantom().expect("a PHANToM")
}

#[test]
fn what_a_scene_does_not_say_is_as_documented() {
    let scene = scene(&[]);
    assert_eq!((scene.name.as_str(), scene.about.as_str()), ("x", "A drop."));
    let drop = scene.drop;
    assert_eq!((drop.premium, drop.lengths_m, drop.axis), (Premium::OneZero, [0.140, 0.140], Direction::Y));
    assert_eq!((drop.coulomb_n, drop.damping_n_s_per_m), (0.038, 0.005));
    assert_eq!((drop.weight_n, drop.speed_m_per_s, drop.trial), (0.15, 0.0, 1));
    assert_eq!((scene.platform, scene.clock.frequency_hz()), (Platform::Fpga(400), 50_000_000));
    assert_eq!((scene.irregularity.jitter_s, scene.irregularity.missed), (100e-6, 0.002));
    assert_eq!((scene.method.shared, scene.method.config), (false, Config::default()));
    assert_eq!((scene.room.distance_m, scene.room.stiffness_n_per_m), (0.02, 1000.0));
    assert_eq!(scene.room.walls, [false, true, false]);
    let model = PhantomModel {
        solver: Solver::Events,
        step_s: None,
        law: PhantomLaw::Words,
        tested_joint_only: false,
        friction: true,
        delay_samples: 1.0,
        latency_s: 0.0,
        amplifier_lag_s: 0.0,
        transmission_n_per_m: 0.0,
        transmission_n_s_per_m: 0.1,
        motor_share: 0.5,
    };
    assert_eq!(scene.model, model);
    assert_eq!((scene.run.duration_s, scene.run.seed), (10.0, 0));
    assert_eq!((scene.record.plant_rate_hz, scene.record.clock), (1000.0, false));
    assert_eq!((scene.expect.outcome, scene.expect.numbers.len()), (None, 0));
    assert_eq!(scene.edges(), 500_000_000);
}

#[test]
fn every_key_is_read_in_the_unit_it_is_written_in() {
    let scene = scene(&[
        ("device.upper_arm", "15 cm"),
        ("device.forearm", "130 mm"),
        ("device.coulomb_force", "40 mN"),
        ("device.viscous_damping", "6 mN.s/m"),
        ("drop.axis", "z"),
        ("drop.weight", "0.2"),
        ("drop.speed", "20 mm/s"),
        ("drop.trial", "3"),
        ("platform", "{ kind = \"PMOS-1\", jitter = \"50 us\", missed = \"1 %\" }"),
        ("clock.frequency", "40 MHz"),
        ("method", "{ architecture = \"shared\", words = \"narrow\", depth_bits = 12 }"),
        ("room", "{ distance = \"1 cm\", stiffness = \"2 N/mm\", walls = \"zx\" }"),
        ("model.law", "ideal"),
        ("model.joints", "tested"),
        ("model.friction", "false"),
        ("model.delay", "0.5"),
        ("model.latency", "1.1 ms"),
        ("model.amplifier_lag", "0.4 ms"),
        ("model.transmission_stiffness", "3.5 kN/m"),
        ("model.transmission_damping", "0.2 N.s/m"),
        ("model.motor_share", "30 %"),
        ("run", "{ duration = \"1 min\", seed = 7 }"),
        ("record", "{ plant_rate = \"2 kHz\", clock = true }"),
        ("expect", "{ outcome = \"non_passive\", rms = { value = \"50 um\", tolerance = \"5 um\" } }"),
    ]);
    let drop = scene.drop;
    assert_eq!((drop.lengths_m, drop.axis, drop.trial), ([0.15, 0.13], Direction::Z, 3));
    assert_eq!((drop.coulomb_n, drop.damping_n_s_per_m, drop.weight_n, drop.speed_m_per_s), (0.04, 0.006, 0.2, 0.02));
    assert_eq!((scene.platform, scene.clock.frequency_hz()), (Platform::Pmos1, 40_000_000));
    assert_eq!((scene.irregularity.jitter_s, scene.irregularity.missed), (50e-6, 0.01));
    assert!(scene.method.shared);
    let config = scene.method.config;
    // 0.15 and 0.13 times 2^24, to the nearest.
    assert_eq!((config.depth_width, config.lengths, config.delay), (12, [2_516_582, 2_181_038], 2));
    assert_eq!(config.formats.trig.to_string(), "(1,1,22)");
    assert_eq!((scene.room.distance_m, scene.room.stiffness_n_per_m), (0.01, 2000.0));
    assert_eq!(scene.room.walls, [true, false, true]);
    let model = PhantomModel {
        solver: Solver::Events,
        step_s: None,
        law: PhantomLaw::Ideal,
        tested_joint_only: true,
        friction: false,
        delay_samples: 0.5,
        latency_s: 1.1e-3,
        amplifier_lag_s: 0.4e-3,
        transmission_n_per_m: 3500.0,
        transmission_n_s_per_m: 0.2,
        motor_share: 0.3,
    };
    assert_eq!(scene.model, model);
    assert_eq!((scene.run.duration_s, scene.run.seed), (60.0, 7));
    assert_eq!((scene.record.plant_rate_hz, scene.record.clock), (2000.0, true));
    let rms = Expectation { metric: Metric::Rms, value: 50e-6, tolerance: 5e-6 };
    assert_eq!((scene.expect.outcome, scene.head.expect.numbers), (Some(OutcomeKind::NonPassive), vec![rms]));
}

#[test]
fn the_eight_platforms_have_the_papers_names_and_rates() {
    let platforms = [
        ("PMOS-1", 1_000, true),
        ("RTOS-1", 1_000, true),
        ("RTOS-5", 5_000, true),
        ("RTOS-10", 10_000, true),
        ("RTOS-20", 20_000, true),
        ("FPGA-20", 20_000, false),
        ("FPGA-100", 100_000, false),
        ("FPGA-400", 400_000, false),
    ];
    assert_eq!(platforms.map(|(name, ..)| name), Platform::ALL.map(Platform::name));
    for (name, rate_hz, by_host) in platforms {
        let scene = scene(&[("platform.kind", name)]);
        assert_eq!((scene.platform.name(), scene.platform.rate_hz()), (name, rate_hz));
        assert_eq!(scene.platform.is_host(), by_host, "{name}");
        assert_eq!(scene.period_clocks() * u64::from(rate_hz), 50_000_000, "{name}");
    }
}

#[test]
fn a_premium_1_5_has_its_own_lengths_counts_and_gains() {
    let scene = scene(&[("device.model", "premium_1.5"), ("room.distance", "1 mm")]);
    let config = scene.method.config;
    assert_eq!(scene.drop.lengths_m, [0.215, 0.170]);
    // 0.215 and 0.170 times 2^24; 4096 counts a turn behind ratios of 13.3, 11.2 and 11.2.
    assert_eq!(config.lengths, [3_607_101, 2_852_127]);
    let counts = |turn: Turn| f64::from(turn.den) / f64::from(turn.num);
    for (turn, ratio) in config.turns.into_iter().zip([13.3, 11.2, 11.2]) {
        assert!((counts(turn) - 4096.0 * ratio).abs() < 1e-9, "{turn:?}");
    }
    assert_eq!(scene.method.config, Config::premium_1_5());
}

#[test]
fn the_words_chosen_are_those_of_the_datapath() {
    let formats = |words: &str| {
        let formats = scene(&[("method.words", words), ("room.stiffness", "100")]).method.config.formats;
        [formats.trig, formats.position, formats.stiffness, formats.force, formats.torque].map(|word| word.to_string())
    };
    assert_eq!(formats("fitted"), ["(1,9,22)", "(1,0,24)", "(0,16,2)", "(1,4,16)", "(1,3,20)"]);
    assert_eq!(formats("narrow"), ["(1,1,22)", "(1,0,24)", "(0,16,2)", "(1,4,16)", "(1,3,20)"]);
    assert_eq!(formats("plain_q22"), ["(1,9,22)", "(1,9,22)", "(0,9,22)", "(1,9,22)", "(1,9,22)"]);
}

#[test]
fn walls_and_stiffness_are_the_nearest_words_to_what_was_asked() {
    // All of these are integers in units of 1e-6: the nearest word is (v * 2^frac * 2 + 1e6) / 2e6, in integers.
    let nearest = |micro: i64, frac: u32| ((i128::from(micro) << (frac + 1)) + 1_000_000) / 2_000_000;
    for distance_um in [1_000, 1_234, 5_678, 20_000, 27_001, 60_000] {
        for stiffness_mn_per_m in [0, 250, 375_000, 1_000_130, 39_999_900, 40_000_000] {
            let scene = scene(&[
                ("room.distance", &format!("{distance_um} um")),
                ("room.stiffness", &format!("{stiffness_mn_per_m} mN/m")),
            ]);
            let words = scene.words().expect("they fit");
            let wall = nearest(distance_um, 24);
            assert_eq!((i128::from(words.low), i128::from(words.high)), (-wall, wall), "{distance_um} um");
            assert_eq!(i128::from(words.stiffness), nearest(1000 * stiffness_mn_per_m, 2), "{stiffness_mn_per_m}");
        }
    }
}

#[test]
fn every_pair_of_walls_has_its_bit() {
    for (walls, room) in [("x", 1), ("y", 2), ("z", 4), ("xy", 3), ("zx", 5), ("yz", 6), ("xyz", 7), ("zyx", 7)] {
        assert_eq!(scene(&[("room.walls", walls)]).words().expect("words").room, room, "{walls}");
    }
    // The walls of the axis, unless the scene says otherwise.
    for (axis, room) in [("x", 1), ("y", 2), ("z", 4)] {
        assert_eq!(scene(&[("drop.axis", axis)]).words().expect("words").room, room, "{axis}");
    }
}

#[test]
fn the_period_is_the_whole_number_of_clocks_nearest_to_the_rates() {
    for (clock, clock_hz) in [("50 MHz", 50_000_000u64), ("25.175 MHz", 25_175_000), ("33333333 Hz", 33_333_333)] {
        for platform in Platform::ALL {
            let scene = scene(&[("clock.frequency", clock), ("platform.kind", platform.name())]);
            let rate_hz = u64::from(platform.rate_hz());
            let nearest = (2 * clock_hz + rate_hz) / (2 * rate_hz);
            assert_eq!(scene.period_clocks(), nearest, "{} at {clock}", platform.name());
            assert_eq!(scene.words().expect("words").period as u64, nearest);
        }
    }
}

#[test]
fn the_shipped_scenes_hold_each_of_the_three_wirings() {
    let phantoms = shipped().iter().filter(|scene| scene.name.starts_with("phantom"));
    let scenes: Vec<_> = phantoms.map(|scene| scene.parse(&[]).expect("valid").phantom().expect("a PHANToM")).collect();
    let has = |host: bool, shared: bool| {
        scenes.iter().any(|scene| scene.platform.is_host() == host && scene.method.shared == shared)
    };
    assert!(has(false, false) && has(false, true) && has(true, false));
}
