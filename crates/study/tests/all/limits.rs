//! The limits that the emulator yields, against the data sheet's digits, the formulas, and an exact criterion with its
//! own arithmetic.

use std::num::NonZeroUsize;

use hpu_cosim::scene::{Experiment, OutcomeKind, Scene, shipped};
use hpu_cosim::{Control, LinearLoop};
use hpu_prove::SampledLoop;
use hpu_prove::criteria::Criterion;
use hpu_prove::linear::{Damping, End, StableSet, Stretch, usual_range};
use hpu_study::limits::{Group, Limits, Looks, WordsSet, limits};
use hpu_study::map::{Cell, CellLimits};

const MOTOR: &str = r#"
about = "The published motor against a wall, by the linear law."
[device]
kind = "motor"
motor = "vasudevan_2007"
wheel_ratio = 7
[clock]
frequency = "50 MHz"
[method]
kind = "hybrid"
sample_rate = "1 kHz"
[wall]
position = 0
stiffness = 1
[hand]
kind = "none"
[model]
datapath = "linear"
[run]
duration = "1 s"
"#;

const MASS: &str = r#"
about = "A mass against a sampled wall."
[device]
kind = "mass"
mass = 0.1
damping = 0
[clock]
frequency = "1 MHz"
[method]
kind = "conventional"
sample_rate = "1 kHz"
[wall]
position = 0
stiffness = 1000
[hand]
kind = "none"
[model]
datapath = "linear"
[run]
duration = "1 s"
"#;

fn scene(text: &str, overrides: &[(&str, String)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    Scene::parse("limit.toml", text, &overrides, &mut |_| unreachable!("no file is named"))
        .unwrap_or_else(|e| panic!("{e}"))
}

fn found(text: &str, overrides: &[(&str, String)]) -> Limits {
    of(&scene(text, overrides))
}

/// Returns the limits of a scene over its usual range.
fn of(scene: &Scene) -> Limits {
    briefly(scene, usual_range(scene))
}

fn briefly(scene: &Scene, range: [f64; 2]) -> Limits {
    let in_words =
        || WordsSet::new(std::slice::from_ref(scene), range, Looks::BRIEF, NonZeroUsize::MIN, &Control::default());
    limits(scene, range, in_words)
}

/// Returns the end of the stretch that begins with the softest wall.
fn limit(limits: &Limits) -> f64 {
    end(limits).middle()
}

fn end(limits: &Limits) -> hpu_prove::linear::End {
    let first = limits.linear.as_ref().expect("a linear loop").stable[0];
    assert_eq!(first.from.beyond, None);
    first.to
}

fn criterion<'a>(limits: &'a Limits, name: &str) -> &'a Criterion {
    limits.criteria.iter().find(|criterion| criterion.name == name).unwrap()
}

#[track_caller]
fn near(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

/// Asserts that the set's limit has these digits (`digits` is half a unit of the last one, relative), is known to a
/// billionth, and equals that of the exact map. The loop run in time must settle below the limit and grow above it.
#[track_caller]
fn has_digits(limits: &Limits, expected: f64, digits: f64) {
    near(limit(limits), expected, digits);
    assert!(end(limits).uncertainty() <= 1e-9 * expected, "{:?}", limits.linear);
    near(limit(limits), criterion(limits, "spectral_radius").limit, 2e-9);
}

fn hybrid(damping: &str, rate: &str) -> Limits {
    found(MOTOR, &[("wall.damping", damping.into()), ("method.sample_rate", rate.into())])
}

#[test]
fn the_continuous_spring_holds_up_to_routh_s_limit() {
    let limits = hybrid("0", "1 kHz");
    has_digits(&limits, 2.98195118, 2e-9);
    let routh = criterion(&limits, "routh");
    assert!(routh.assumptions_met());
    near(limit(&limits), routh.limit, 1e-9);
    assert_eq!((routh.unit, limits.linear.as_ref().unwrap().unit), ("N.m/rad", "N.m/rad"));
}

#[test]
fn a_heavier_rotor_hardly_changes_routh_s_limit() {
    let limits = found(MOTOR, &[("device.rotor_inertia", "2.137e-5".into())]);
    has_digits(&limits, 2.98169605, 2e-9);
    near(limit(&limits), criterion(&limits, "routh").limit, 1e-9);
}

#[test]
fn the_conventional_loop_at_1_khz_holds_a_sixth_of_that() {
    let limits = found(MOTOR, &[("method.kind", "conventional".into())]);
    has_digits(&limits, 0.497373834, 1e-9);
    near(limit(&hybrid("0", "1 kHz")) / limit(&limits), 5.99539, 1e-6);
    // The rule of thumb leaves out terms of second order, and reports that.
    let rule = criterion(&limits, "low_frequency");
    assert!(!rule.assumptions_met());
    near(rule.limit, (1.3e-6 + 2.85979167e-4) / (0.5e-3 + 96.35e-6), 1e-5);
    near(rule.limit, limit(&limits), 0.04);
}

#[test]
fn a_modulator_s_period_samples_the_loop_that_is_said_to_be_continuous() {
    // 25.175 MHz / 4096.
    let overrides = [
        ("clock.frequency", "25.175 MHz".to_string()),
        ("method.kind", "conventional".into()),
        ("method.sample_rate", "6146.240234375".into()),
    ];
    assert_eq!(scene(MOTOR, &overrides).period_clocks(), 4096);
    has_digits(&found(MOTOR, &overrides), 1.62314, 4e-6);
}

#[test]
fn sampled_damping_lowers_the_hybrid_limit_at_1_khz_and_raises_it_at_10_khz() {
    for (damping, rate, expected, digits) in
        [("1e-4", "1 kHz", 2.92602, 2e-6), ("1e-3", "1 kHz", 1.98116, 3e-6), ("1e-3", "10 kHz", 11.8910, 5e-6)]
    {
        let limits = hybrid(damping, rate);
        has_digits(&limits, expected, digits);
        assert!(!criterion(&limits, "routh").assumptions_met());
    }
    // Routh with a continuous damping of 1e-3.
    near(criterion(&hybrid("1e-3", "10 kHz"), "routh").limit, 13.3619283, 5e-9);
}

#[test]
fn a_sampled_wall_before_a_damped_mass_holds_the_known_stiffness() {
    for (damping, expected) in [("0.5", 1000.83403), ("5", 10084.0301)] {
        let limits = found(MASS, &[("device.damping", damping.into())]);
        has_digits(&limits, expected, 6e-9);
        // K* = (1 - e) / (g2 phi - g1 e) of the exact linear analysis; b T / m is large enough for all of its digits.
        let (m, b, t): (f64, f64, f64) = (0.1, damping.parse().unwrap(), 1e-3);
        let e = (-b * t / m).exp();
        let lost = -(-b * t / m).exp_m1();
        let (g2, phi, g1) = (lost / b, m * lost / b, t / b - m * lost / (b * b));
        near(limit(&limits), lost / (g2 * phi - g1 * e), 1e-8);
        // Passivity asks for less stiffness; the first-order rule gives the same here.
        near(criterion(&limits, "colgate_schenkel").limit, 2.0 * b / t, 1e-15);
        near(criterion(&limits, "gil_hulin").limit, 2.0 * b / t, 1e-15);
        assert_eq!(limits.linear.as_ref().unwrap().unit, "N/m");
    }
}

#[test]
fn passivity_allows_the_known_stiffness_and_its_frequency_condition_agrees() {
    for (device, wall, expected) in [(0.8, 0.4, 800.0), (0.8, 0.0, 1600.0), (0.005, 0.0, 10.0)] {
        let limits = found(MASS, &[("device.damping", format!("{device}")), ("wall.damping", format!("{wall}"))]);
        let passive = criterion(&limits, "colgate_schenkel").limit;
        near(passive, expected, 1e-12);
        // The frequency condition in real arithmetic: b = max over w of (T/2) / (1 - cos wT) Re{(1 - e^-jwT) H}, with H
        // = K + B (z - 1) / (T z). With p = 1 - cos and q = sin, (1 - e^-j) = p + jq and H = K + (B/T)(p + jq).
        let t = 1e-3;
        let needed = |angle: f64| {
            let (p, q) = (1.0 - angle.cos(), angle.sin());
            0.5 * t / p * (p * (passive + wall / t * p) - q * wall / t * q)
        };
        let most = (1..=1000).map(|n| needed(f64::from(n) * std::f64::consts::PI / 1000.0)).fold(f64::MIN, f64::max);
        near(most, device, 1e-9);
        assert!(passive < limit(&limits));
    }
}

#[test]
fn a_delay_of_one_sample_divides_the_limit_by_three() {
    let limits = found(
        MASS,
        &[("device.mass", "0.075".into()), ("device.damping", "0.005".into()), ("model.delay", "1 ms".into())],
    );
    has_digits(&limits, 3.3333951, 2e-8);
    let first_order = criterion(&limits, "gil_hulin");
    assert!(first_order.assumptions_met());
    near(first_order.limit, 0.005 / 1.5e-3, 1e-15);
    // b > K (T/2 + t_d): the kernel sin((2d + 1) a/2) / sin(a/2) is at most 2d + 1.
    let passive = criterion(&limits, "colgate_schenkel");
    assert!(passive.assumptions_met());
    near(passive.limit, 0.005 / 1.5e-3, 1e-15);
}

#[test]
fn virtual_damping_alone_holds_the_known_parabola_of_stiffness() {
    // alpha = K T^2 / m < 2 beta (2 - beta) / (2 + beta), beta = B T / m.
    for (beta, alpha) in [(0.1, 0.180952381), (0.828427125, 0.686291501)] {
        let limits = found(MASS, &[("wall.damping", format!("{}", beta * 100.0))]);
        has_digits(&limits, alpha * 1e5, 3e-9);
        near(limit(&limits), 1e5 * 2.0 * beta * (2.0 - beta) / (2.0 + beta), 1e-9);
    }
}

#[test]
fn the_exact_map_has_the_known_spectral_radii() {
    let sampled = |overrides: &[(&str, String)]| {
        let scene = scene(MASS, overrides);
        SampledLoop::new(&scene, 1000.0, scene.wall.damping_nm_s_per_rad).spectral_radius()
    };
    near(sampled(&[("device.damping", "0.1".into()), ("wall.damping", "1".into())]), 0.997006828124, 1e-12);
    near(sampled(&[("device.mass", "0.075".into())]), 1.00332779622, 1e-11);
}

#[test]
fn a_delay_within_a_sample_and_one_of_several_agree_with_the_exact_map() {
    for delay in ["0.3 ms", "2.7 ms"] {
        let limits = found(
            MASS,
            &[("device.damping", "0.5".into()), ("wall.damping", "0.2".into()), ("model.delay", delay.into())],
        );
        near(limit(&limits), criterion(&limits, "spectral_radius").limit, 2e-9);
    }
}

#[test]
fn a_loop_without_a_limit_says_which_way() {
    let said = |overrides: &[(&str, String)]| found(MASS, overrides).linear.expect("a linear loop").said();
    // A sampled velocity cannot carry this much damping: beta = 2.
    assert_eq!(said(&[("wall.damping", "250".into())]), "no stiffness from 1 to 1000000 N/m settles");
    // A continuous spring on a damped mass is passive at any stiffness.
    let passive = [("method.kind", "hybrid".to_string()), ("device.damping", "1".into())];
    assert_eq!(said(&passive), "every stiffness from 1 to 1000000 N/m settles");
}

#[test]
fn a_loop_that_neither_grows_nor_decays_by_more_than_rounding_is_left_open() {
    // Nothing dissipates energy in a mass on a spring that is not sampled.
    let lossless = [("method.kind", "hybrid".to_string()), ("device.damping", "0".into())];
    let set = found(MASS, &lossless).linear.expect("a linear loop");
    assert!(set.stable.is_empty() && set.said().contains("neither grows nor decays by more than is known"), "{set:?}");
}

#[test]
fn a_delay_of_thousands_of_samples_is_told_and_not_waited_for() {
    let begin = std::time::Instant::now();
    let late = [("device.damping", "1".to_string()), ("model.delay", "1.66".into())];
    let limits = found(MASS, &late);
    let why: Vec<_> = limits.silent.iter().map(|silent| &silent.why).collect();
    assert!(why.iter().any(|why| why.contains("1660 samples, of 64 at most")), "{why:?}");
    assert!(begin.elapsed().as_secs() < 60, "{:?}", begin.elapsed());
}

/// Returns a shipped scene under overrides.
fn known(name: &str, overrides: &[(&str, String)]) -> Scene {
    let shipped = shipped().iter().find(|scene| scene.name == name).unwrap_or_else(|| panic!("{name}"));
    scene(shipped.text, overrides)
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn in_words_neighbours_that_differ_are_words_apart_and_each_verdict_is_that_of_its_run() {
    // One scene has a limit at which the hand leans on the wall, the other has friction: the whole scene, not its
    // linear loop.
    for (name, least, most) in [("conventional-wall-1khz", 10, 40), ("friction-wall", 120, 180)] {
        let scene = known(name, &[]);
        let range = [least, most].map(|words| words as f64 * WORD);
        let looks = Looks { phases: 2, coarse: 8, most: 64, climbs: false, nearest: 0.0 };
        let set = WordsSet::new(std::slice::from_ref(&scene), range, looks, NonZeroUsize::MIN, &Control::default())
            .expect("a set");
        near(set.step, WORD, 2e-5);
        assert_eq!((set.seen[0].word, set.seen[set.seen.len() - 1].word, set.words), (least, most, most - least + 1));
        assert!(set.seen.iter().any(|seen| seen.settled < 2) && set.seen.iter().any(|seen| seen.settled == 2));
        for pair in set.seen.windows(2) {
            let [before, after] = [0, 1].map(|k| (pair[k].settled, pair[k].word));
            let alike = |(settled, _): (u32, i128)| (settled == 0, settled == 2);
            assert!(alike(before) == alike(after) || after.1 == before.1 + 1, "{name}: {pair:?}");
        }
        // The first of two phases is the scene itself.
        for seen in &set.seen {
            let scene = known(name, &[("wall.stiffness", (seen.word as f64 * set.step).to_string())]);
            let cell = Cell::run(&Experiment::Axis(scene), CellLimits::default(), &Control::default());
            let settled = cell.expect("a run").expect("a whole one").outcome == OutcomeKind::Settled;
            let told = if settled { 1..=2 } else { 0..=1 };
            assert!(told.contains(&seen.settled), "{name}: {seen:?}, by itself {settled}");
        }
        let groups = set.groups();
        assert_eq!((groups[0].0, groups[groups.len() - 1].0), (Group::All, Group::None), "{name}: {groups:?}");
    }
}

/// The stiffness of one word, in N.m/rad: a PWM count for an encoder count,
/// 24 V * 25.9 mN.m/A / 2.34566 Ohm / 4096 over 2 pi / 4096.
const WORD: f64 = 0.042176;

#[test]
fn neither_set_depends_on_the_scene_s_own_stiffness() {
    let found = |stiffness: &str| {
        let scene = known("conventional-wall-1khz", &[("wall.stiffness", stiffness.into())]);
        let found = briefly(&scene, [0.2, 2.0]);
        (found.linear, found.in_words)
    };
    assert_eq!(found("0.3"), found("4"));
}

#[test]
fn holes_of_the_hybrid_loop_are_found_from_every_start() {
    // The stiffnesses at which numpy's eigenvalues cross the unit circle, found by bisection
    // (testbench/oracle/stable_set.py has random loops).
    let none = ("hand", "{ kind = \"none\" }".to_string());
    for (rate, damping, bare, expected) in [
        ("300 Hz", "5e-4", false, &[0.758_851_678_6, 1.092_266_105_2, 4.068_514_314_5][..]),
        ("100 Hz", "5e-4", true, &[0.075_340_162_5, 0.195_223_111_8, 2.937_823_236_9]),
        ("200 Hz", "3e-4", true, &[0.514_580_351_3, 0.567_215_206_9, 3.000_861_383_3]),
        ("300 Hz", "3e-4", true, &[1.112_412_262_3, 1.321_631_533_8, 3.051_289_302_6]),
        ("500 Hz", "2e-4", false, &[2.978_200_242_1, 3.230_640_027_8, 3.312_718_739_2]),
    ] {
        let mut overrides = vec![("method.sample_rate", rate.to_string()), ("wall.damping", damping.into())];
        overrides.extend(bare.then(|| none.clone()));
        for start in ["0.3", "1", "3"] {
            let scene = known("hybrid-wall", &[&overrides[..], &[("wall.stiffness", start.into())]].concat());
            let set = of_linear(&scene);
            let ends: Vec<f64> =
                set.stable.iter().flat_map(|stretch| [stretch.from, stretch.to]).map(|end| end.middle()).collect();
            assert_eq!(ends.len(), expected.len() + 1, "{rate} {damping}: {set:?}");
            for (end, expected) in ends[1..].iter().zip(expected) {
                near(*end, *expected, 2e-9);
            }
        }
        // The loop in time, an independent oracle, on both sides of each end.
        let scene = known("hybrid-wall", &overrides);
        for (index, end) in expected.iter().enumerate() {
            for (side, stable) in [(0.99, index % 2 == 0), (1.01, index % 2 == 1)] {
                let law = LinearLoop::new(&scene, side * end, scene.wall.damping_nm_s_per_rad);
                assert_eq!(law.growth_per_s(1 << 17) < 0.0, stable, "{rate} {damping} at {}", side * end);
            }
        }
    }
}

#[test]
fn an_undamped_held_spring_settles_at_no_stiffness() {
    let set = of_linear(&known("leak-bounce", &[]));
    assert!(set.stable.is_empty() && set.open.is_empty(), "{set:?}");
    assert!(set.said().starts_with("no stiffness from "), "{}", set.said());
}

#[test]
fn a_coupling_and_estimators_have_linear_loops_of_their_own_and_nonlinear_laws_have_none() {
    let none = |name: &str, overrides: &[(&str, String)]| {
        let scene = known(name, overrides);
        StableSet::new(&scene, Damping::Fixed(0.0), [1.0, 2.0]).expect_err("no linear loop")
    };
    for name in ["popc-velocity", "bounded-wall-1khz", "energy-level-wall"] {
        assert!(none(name, &[]).to_string().contains("is nonlinear"), "{name}");
    }
    // A coupling that is stiffer than any wall does not change the limit.
    let alone = of_linear(&known("conventional-wall-1khz", &[("wall.damping", "0".into())]));
    let coupled = [
        ("method.coupling_stiffness", "1e5".to_string()),
        ("method.coupling_damping", "0".into()),
        ("method.stiffness_format", "(0,24,0)".into()),
        ("wall.damping", "0".into()),
    ];
    let coupled = of_linear(&known("coupled-wall-1khz", &coupled));
    near(coupled.stable[0].to.middle(), alone.stable[0].to.middle(), 2e-5);
}

#[test]
fn a_filter_by_its_corner_and_one_by_its_shift_are_the_same_loop_where_their_weights_are() {
    let filtered = |key: &str, value: f64| {
        let estimator = ("method.estimator", "filtered".to_string());
        let law = [("method.kind", "sampled_wall".to_string()), estimator, (key, value.to_string())];
        let damped = [("wall.damping", "0.2 mN.m.s/rad".to_string()), ("method.damping_format", "(0,16,4)".into())];
        of_linear(&known("conventional-wall-1khz", &[&law[..], &damped].concat()))
    };
    // 1 - exp(-2 pi f T) is 1/8, or 2^13 of 2^16.
    let corner_hz = (8f64 / 7.0).ln() / std::f64::consts::TAU * 1000.0;
    let by_shift = filtered("method.filter_shift", 3.0);
    assert!(!by_shift.stable.is_empty());
    assert_eq!(filtered("method.velocity_filter.corner", corner_hz), by_shift);
    assert_ne!(filtered("method.velocity_filter.corner", 2.0 * corner_hz), by_shift);
}

#[test]
fn a_mass_behind_a_filter_of_the_second_order_holds_the_known_stiffness() {
    // Roots of the characteristic polynomial, computed apart with 30 digits, with the words of a corner of 100 Hz.
    for (damping, expected) in [("0.4", 1729.96914724), ("2", 4103.88191576)] {
        let filter = ("method.velocity_filter", "{ corner = \"100 Hz\", order = 2 }".to_string());
        let law = [("method.kind", "sampled_wall".to_string()), ("method.estimator", "filtered".into()), filter];
        let device = [
            ("model.datapath", "words".to_string()),
            ("device.damping", "0.5".into()),
            ("wall.damping", damping.into()),
            ("encoder.resolution", "1e-6".into()),
            ("amplifier.full_scale", "100".into()),
            ("method.stiffness_format", "(0,8,16)".into()),
            ("method.damping_format", "(0,8,16)".into()),
        ];
        let set = of_linear(&scene(MASS, &[&law[..], &device].concat()));
        near(set.stable[0].to.middle(), expected, 1e-9);
    }
}

/// Returns the stable set over the usual range.
fn of_linear(scene: &Scene) -> StableSet {
    let damping = Damping::Fixed(scene.wall.damping_nm_s_per_rad);
    StableSet::new(scene, damping, usual_range(scene)).unwrap_or_else(|why| panic!("{why}"))
}

/// The search for the first end takes ranges in another order and leaves others out.
#[test]
fn the_softest_stretch_is_the_first_of_the_whole_set() {
    let (mut settle, mut none) = (0, 0);
    for name in ["hybrid-wall", "conventional-wall-1khz", "shaped-wall", "coupled-wall-1khz", "rail-drop", "slow-pwm"] {
        let scene = known(name, &[]);
        let own = scene.wall.damping_nm_s_per_rad;
        let range = usual_range(&scene);
        // One range begins beyond the first end.
        let ranges = [range, [0.3 * range[1], range[1]]];
        for damping in
            [Damping::Fixed(0.0), Damping::Fixed(own), Damping::Fixed(8.0 * own), Damping::PerStiffness(2e-4)]
        {
            for range in ranges {
                match (Stretch::softest(&scene, damping, range), StableSet::new(&scene, damping, range)) {
                    (Ok(found), Ok(set)) => {
                        let first = set.stable.first().filter(|stretch| stretch.from.beyond.is_none());
                        // Each encloses the same pole's crossing, from ranges of its own.
                        let alike = match (found.map(|found| found.to), first.map(|first| first.to)) {
                            (Some(End { at, beyond: Some(beyond) }), Some(End { at: to, beyond: Some(than) })) => {
                                at < than && to < beyond
                            }
                            (found, first) => found == first,
                        };
                        assert!(alike, "{name} {damping:?} {range:?}: {found:?}, not {first:?}");
                        *(if found.is_some() { &mut settle } else { &mut none }) += 1;
                    }
                    (Err(why), Err(other)) => assert_eq!(why, other),
                    differ => panic!("{name} {damping:?}: {differ:?}"),
                }
            }
        }
    }
    assert!(settle > 12 && none > 8, "{settle} {none}");
}

#[test]
fn a_scene_without_a_limit_in_words_says_why() {
    let reason = |scene: &Scene| of(scene).in_words.expect_err("no limit");
    assert!(reason(&known("prescribed-sweep", &[])).to_string().contains("imposes"));
    let untouched = reason(&known("free-motion", &[]));
    assert!(
        untouched.to_string().contains("wall not reached")
            && untouched.to_string().contains("move wall.position (2 rad)"),
        "{untouched}"
    );
    // A damper of 100 N.s/m holds walls up to 2 b/T, 200 kN/m; words of 5.24 N/m end at 21.5 kN/m.
    let damped = [
        ("hand.torque", "5 N"),
        ("device.damping", "100 N.s/m"),
        ("device.initial_position", "2 cm"),
        ("method.stiffness_format", "(0,12,0)"),
        ("run.duration", "1 s"),
    ];
    let damped = damped.map(|(key, value)| (key, value.to_string()));
    let damped = known("rail-drop", &damped);
    let set = WordsSet::new(
        std::slice::from_ref(&damped),
        [1e4, 1e9],
        Looks { phases: 2, coarse: 4, most: 8, climbs: false, nearest: 0.0 },
        NonZeroUsize::MIN,
        &Control::default(),
    );
    let set = set.expect("a set");
    assert_eq!((set.lowest_failed(), set.seen.last().map(|seen| seen.word)), (None, Some(4095)));
    assert!(set.turn().starts_with("all settle, up to 214"), "{}", set.turn());
    assert!(reason(&scene(MOTOR, &[])).to_string().contains("linear"));
    assert!(reason(&scene(MASS, &[])).to_string().contains("linear"));
}

/// A device that creeps toward the rest of a soft wall: `(b + b_h + B) / (k_h + K)` is 67 / 215 s at the softest word.
const CREEP: &str = include_str!("../creep.toml");

fn soft(overrides: &[(&str, String)], range: [f64; 2]) -> Result<WordsSet, hpu_study::Error> {
    let looks = Looks { phases: 2, coarse: 6, most: 12, climbs: false, nearest: 0.0 };
    let scene = scene(CREEP, overrides);
    WordsSet::new(std::slice::from_ref(&scene), range, looks, NonZeroUsize::MIN, &Control::default())
}

#[test]
fn creep_on_a_soft_wall_is_not_told_and_the_duration_that_is_said_tells() {
    let set = soft(&[], [15.0, 400.0]).expect("a set");
    // Up to 300 N/m the slowest time constant is 67 / 500 s: some tenths of a millimetre are left in the window.
    assert!(set.seen.iter().filter(|seen| seen.stiffness < 300.0).all(|seen| seen.not_told == 2), "{:?}", set.seen);
    assert!(set.seen.iter().all(|seen| seen.settled + seen.not_told == 2), "none fails: {:?}", set.seen);
    assert_eq!((set.groups()[0].0, set.lowest_failed()), (Group::NotTold, None));
    let telling_s = set.telling_s().expect("a duration");
    let told = soft(&[("run.duration", telling_s.to_string())], [15.0, 400.0]).expect("a set");
    assert!(told.seen.iter().all(|seen| seen.settled == 2), "{telling_s} s: {:?}", told.seen);
    assert_eq!((told.groups().len(), told.not_told(), told.telling_s()), (1, 0, None));
}

#[test]
fn a_hand_that_moves_to_the_end_gives_no_set() {
    let path = r#"[["0 s", 0], ["150 ms", "20 mm"], ["600 ms", "21 mm"]]"#;
    let reason = soft(&[("hand.path", path.to_string())], [15.0, 400.0]).expect_err("no verdict");
    let said = ["the hand moves until 0.6", "let hand.path end earlier", "run.duration = \""];
    assert!(said.iter().all(|part| reason.to_string().contains(part)), "{reason}");
}
