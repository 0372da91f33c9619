//! Drop tests against closed forms: the fall, the rest on the wall, and the greatest stiffness of a wall.

use crate::common::{phantom, run};
use hpu_cosim::scene::{Experiment, Origin, PhantomScene, shipped};
use hpu_cosim::{Control, Driver, PhantomSimulation, Simulation, Verdict, Wired};

/// The numbers of the scene: the mass at the tip with the hanging weight, that weight, the friction at the tip.
const WEIGHT_N: f64 = 0.15;
const MASS_KG: f64 = 0.075 + WEIGHT_N / 9.81;
const COULOMB_N: f64 = 0.038;
const DAMPING_N_S_PER_M: f64 = 0.005;
/// Length of a link, and distance of the wall below the start.
const LINK_M: f64 = 0.14;
const DROP_M: f64 = 0.02;

/// Returns the drop scene with one joint, a rigid transmission and an ideal amplifier.
fn drop(more: &[(&str, &str)]) -> PhantomScene {
    let plain = [
        ("model.joints", "tested"),
        ("model.amplifier_lag", "0"),
        ("model.transmission_stiffness", "0"),
        ("clock.frequency", "5 MHz"),
        ("method.depth_bits", "13"),
    ];
    phantom("phantom-drop", &[&plain, more].concat())
}

/// Returns the exact distance, in m, that a mass falls in `t` seconds from a downward speed, under a constant pull
/// minus friction.
fn fallen_m(pull_n: f64, speed: f64, t: f64) -> f64 {
    let tau_s = MASS_KG / DAMPING_N_S_PER_M;
    let last = (pull_n - COULOMB_N) / DAMPING_N_S_PER_M;
    last * t + tau_s * (speed - last) * (1.0 - (-t / tau_s).exp())
}

/// Returns the time, in s, that a fall over this distance takes.
fn fall_s(pull_n: f64, speed: f64, distance_m: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if fallen_m(pull_n, speed, middle) < distance_m {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[test]
fn the_closed_form_of_the_fall_is_the_published_one() {
    // m = 0.09 kg without viscous friction: 1.2444 m/s^2, 0.17928 s. The scene's mass and the viscous friction add 0.6
    // %.
    let published_s = (2.0 * DROP_M / ((WEIGHT_N - COULOMB_N) / 0.09)).sqrt();
    assert!((published_s - 0.17928).abs() < 1e-5);
    let mass_s = published_s * (MASS_KG / 0.09).sqrt();
    let ours_s = fall_s(WEIGHT_N, 0.0, DROP_M);
    // x = a t^2/2 (1 - t/(3 tau) + ...), so t grows by t/(6 tau) to first order.
    let tau_s = MASS_KG / DAMPING_N_S_PER_M;
    assert!((ours_s - mass_s * (1.0 + mass_s / (6.0 * tau_s))).abs() < 1e-6, "{ours_s}");
}

#[test]
fn the_tip_falls_to_the_wall_in_the_time_of_the_closed_form() {
    for axis in ["x", "y", "z"] {
        let scene = drop(&[("drop.axis", axis), ("run.duration", "250 ms"), ("record.plant_rate", "100 kHz")]);
        let (_, dense) = run(&scene);
        let index = scene.drop.axis.index();
        let height = |row: usize| dense.rows[row][index];
        let touch = (0..dense.rows.len()).find(|&row| height(row) < -DROP_M).expect("it falls on the wall");
        let touch_s = touch as f64 * 1e-5;
        // The lever falls along its arc s, from an angle within a count to asin(d / l); for the joints whose radius
        // swings too, it is atan of no more. Its pull w cos is between that of the end and that of the start. The
        // release adds or takes 1 mm/s: a tip that is thrown up first comes back after 2 v / a or less.
        let end_rad = (DROP_M / LINK_M).asin();
        let start_m = height(0);
        let longest_m = LINK_M * end_rad + start_m + 1e-9;
        let speed = 1e-3;
        let up_s = 2.0 * speed / ((WEIGHT_N * end_rad.cos() - COULOMB_N) / MASS_KG);
        let earliest_s = fall_s(WEIGHT_N, speed, DROP_M + start_m);
        let latest_s = fall_s(WEIGHT_N * end_rad.cos(), 0.0, longest_m) + up_s + 1e-5;
        assert!((earliest_s..=latest_s).contains(&touch_s), "{axis}: {earliest_s} <= {touch_s} <= {latest_s}");
        // The bounds are tight enough to be useful.
        assert!(latest_s - earliest_s < 0.03 * earliest_s, "{axis}: {earliest_s} to {latest_s}");
    }
}

#[test]
fn it_accelerates_as_weight_and_friction_say_at_every_row() {
    let scene = drop(&[("run.duration", "150 ms"), ("record.plant_rate", "1 kHz"), ("drop.speed", "10 mm/s")]);
    let (_, dense) = run(&scene);
    let arc: Vec<f64> = dense.rows.iter().map(|row| LINK_M * (row[1] / LINK_M).asin()).collect();
    let h = 1e-3;
    for window in arc.windows(3) {
        let acceleration = (window[0] - 2.0 * window[1] + window[2]) / (h * h);
        let speed = (window[2] - window[0]) / (2.0 * h);
        let expected = (-WEIGHT_N * (window[1] / LINK_M).cos() + COULOMB_N - DAMPING_N_S_PER_M * speed) / MASS_KG;
        // h^2/12 of the fourth derivative, which is that of (w / m) cos(s / l) twice: below (w / m) (v^2 + s a) / l^2 =
        // 5 m/s^4; and h^2/6 of the speed's third derivative, times b / m: below 1e-9.
        assert!((acceleration - expected).abs() < 5.0 * h * h / 12.0, "{acceleration}, {expected}");
    }
    assert!(arc.last().is_some_and(|end| *end < -0.01));
}

#[test]
fn the_scene_s_gravity_decides_the_mass_of_its_weight_and_is_told_with_its_parameters() {
    for gravity in [1.62, 9.80665, 20.0] {
        let gravity_set = gravity.to_string();
        let scene = drop(&[
            ("device.gravity", &gravity_set),
            ("run.duration", "150 ms"),
            ("record.plant_rate", "1 kHz"),
            ("drop.speed", "10 mm/s"),
        ]);
        let told = scene.parameters.iter().find(|parameter| parameter.key == "device.gravity").expect("it is told");
        assert_eq!((told.value.to_string(), told.unit), (gravity.to_string(), "m/s2"));
        let (_, dense) = run(&scene);
        let arc: Vec<f64> = dense.rows.iter().map(|row| LINK_M * (row[1] / LINK_M).asin()).collect();
        let (h, mass_kg) = (1e-3, 0.075 + WEIGHT_N / gravity);
        for window in arc.windows(3) {
            let acceleration = (window[0] - 2.0 * window[1] + window[2]) / (h * h);
            let speed = (window[2] - window[0]) / (2.0 * h);
            let expected = (-WEIGHT_N * (window[1] / LINK_M).cos() + COULOMB_N - DAMPING_N_S_PER_M * speed) / mass_kg;
            // As in the test above, (w / m) (v^2 + s a) / l^2 bounds the fourth derivative: at 20 m/s2 the mass is
            // 82.5 g, and after 150 ms v = 0.21 m/s, s = 17.5 mm and a = 1.35 m/s2 make 6.4 m/s^4.
            assert!((acceleration - expected).abs() < 6.4 * h * h / 12.0, "{acceleration}, {expected}");
        }
        assert!(arc.last().is_some_and(|end| *end < -0.005), "{gravity}");
    }
}

#[test]
fn a_scene_that_says_no_gravity_has_the_standard_one() {
    for (name, line) in [("phantom-drop", "gravity = \"9.81 m/s2\"\n"), ("gimbal-spring", "gravity = \"9.81 m/s2\"\n")]
    {
        let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
        assert_eq!(shipped.text.matches(line).count(), 1, "{name}");
        let text = shipped.text.replace(line, "");
        let mut load = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        let scene = Experiment::parse(name, &text, &[], &mut load).unwrap_or_else(|error| panic!("{error}"));
        let told = scene.parameters.iter().find(|parameter| parameter.key == "device.gravity").expect("it is told");
        assert_eq!((told.value.to_string(), told.origin), ("9.80665".into(), Origin::Default));
        assert!(
            matches!(&scene, Experiment::Phantom(scene) if scene.drop.gravity_m_per_s2 == 9.80665)
                || matches!(&scene, Experiment::Gimbal(scene) if scene.gimbal.gravity_m_per_s2 == 9.80665)
        );
        let refused = [("device.gravity".to_string(), "-9.81".to_string())];
        assert!(Experiment::parse(name, &text, &refused, &mut load).is_err(), "{name}");
    }
}

#[test]
fn it_rests_as_deep_as_weight_by_stiffness_within_frictions_band() {
    for (law, platform) in [("ideal", "RTOS-20"), ("words", "RTOS-20"), ("words", "FPGA-400"), ("words", "FPGA-20")] {
        for stiffness in [250.0, 500.0, 1000.0] {
            let scene = drop(&[
                ("model.law", law),
                ("platform.kind", platform),
                ("model.delay", "0"),
                ("room.stiffness", &stiffness.to_string()),
                ("run.duration", "4 s"),
            ]);
            let (summary, dense) = run(&scene);
            let Some(Verdict::Passive { rms_m }) = summary.verdict else { panic!("{:?}", summary.verdict) };
            let last = dense.rows.last().expect("rows");
            let depth_m = -DROP_M - last[1];
            // Forces along y have the lever l cos, friction l. The bounds allow for half a DAC count at the tip and,
            // with counts, for the encoder count by which the logged depth exceeds the true one.
            let cosine = (1.0 - (last[1] / LINK_M).powi(2)).sqrt();
            let band_n = COULOMB_N / cosine + 0.17 * 7.0 / 32_768.0 / LINK_M;
            let count_m = if law == "ideal" { 0.0 } else { LINK_M * std::f64::consts::TAU / 28_000.0 + 1e-6 };
            let (least, most) = ((WEIGHT_N - band_n) / stiffness - count_m, (WEIGHT_N + band_n) / stiffness);
            assert!((least..=most).contains(&depth_m), "{law} {platform} {stiffness}: {least} <= {depth_m} <= {most}");
            assert!(rms_m < 32e-6);
        }
    }
}

/// Returns whether all three trials at this stiffness are passive.
fn passes(stiffness: f64, more: &[(&str, &str)]) -> bool {
    ["1", "2", "3"].iter().all(|trial| {
        let own = [("room.stiffness", stiffness.to_string()), ("drop.trial", (*trial).to_string())];
        let own: Vec<_> = own.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let fixed = [("run.duration", "10 s"), ("clock.frequency", "1 MHz")];
        let scene = drop(&[&own[..], &fixed, more].concat());
        let simulation = PhantomSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        matches!(summary.verdict, Some(Verdict::Passive { .. }))
    })
}

/// Returns the stiffness at which a bounce loses as much to friction as it gains by sampling. A mass that enters and
/// leaves the wall in half a period of omega = sqrt(K / m) gains energy by exp(pi omega (T/2 + t_d)), and friction
/// takes (w - f) / (w + f) of its height on the way up and down.
fn threshold_n_per_m(period_s: f64, delay_s: f64, mass_kg: f64) -> f64 {
    let loss = ((WEIGHT_N + COULOMB_N) / (WEIGHT_N - COULOMB_N)).ln();
    mass_kg * (loss / (std::f64::consts::PI * (0.5 * period_s + delay_s))).powi(2)
}

#[test]
fn the_threshold_is_the_published_one_at_the_published_mass() {
    for (period_s, delay_s, known) in
        [(1e-3, 0.0, 9785.13552), (1e-3, 1e-3, 1087.23728), (1e-3, 1.1e-3, 956.0), (200e-6, 1.1e-3, 1699.0)]
    {
        let found = threshold_n_per_m(period_s, delay_s, 0.09);
        assert!((found - known).abs() < 6e-4 * known, "{found}, {known}");
    }
}

/// Returns the exact position and speed, after a time `h`, of a mass on a line under a constant force, with viscous and
/// Coulomb friction.
fn glide(mut x: f64, mut v: f64, force_n: f64, friction_n: f64, h: f64) -> (f64, f64) {
    let tau_s = MASS_KG / DAMPING_N_S_PER_M;
    let mut left_s = h;
    loop {
        if v == 0.0 && force_n.abs() <= friction_n {
            return (x, 0.0);
        }
        let direction = if v == 0.0 { force_n.signum() } else { v.signum() };
        let last = (force_n - direction * friction_n) / DAMPING_N_S_PER_M;
        let stop_s = if v * last < 0.0 { -tau_s * (last / (last - v)).ln() } else { f64::INFINITY };
        let t = left_s.min(stop_s);
        let decay = (-t / tau_s).exp();
        x += last * t + tau_s * (v - last) * (1.0 - decay);
        v = if stop_s < left_s { 0.0 } else { last + (v - last) * decay };
        left_s -= t;
        if left_s <= 0.0 {
            return (x, v);
        }
    }
}

/// Returns whether that mass comes to rest after a drop, as the tip feels it beside the wall. There the joint's lever
/// has shrunk by a cosine: pushes of wall and weight are scaled by its square, the joint's friction by the cosine
/// itself. There is a sample every `every` steps of `h`, late by `late` steps.
fn mass_rests(stiffness: f64, h: f64, every: usize, late: usize) -> bool {
    let cosine = (1.0 - (DROP_M / LINK_M).powi(2)).sqrt();
    let (weight_n, friction_n) = (WEIGHT_N * cosine * cosine, COULOMB_N * cosine);
    let steps = (10.0 / h).round() as usize;
    let (mut x, mut v, mut asked) = (10e-6, 0.0, 0.0);
    let mut under_way = std::collections::VecDeque::from(vec![0.0; late]);
    let mut seen = Vec::new();
    for step in 0..steps {
        if step % every == 0 {
            asked = (stiffness * (x - DROP_M)).max(0.0) * cosine * cosine;
        }
        under_way.push_back(asked);
        let push_n = under_way.pop_front().expect("one was just put in");
        (x, v) = glide(x, v, weight_n - push_n, friction_n, h);
        if x < -DROP_M {
            return false;
        }
        if 10 * step >= 7 * steps {
            seen.push(x);
        }
    }
    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
    (seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt() < 30e-6
}

#[test]
fn walls_hold_up_to_the_rung_at_which_a_mass_on_a_line_still_rests() {
    // Stiffnesses of the reference's ladder, for this mass, on either side of the threshold.
    for (platform, delay, latency, h, every, late, rungs) in [
        ("RTOS-1", "0", "0", 1e-3, 1, 0, [8000.0, 9000.0]),
        ("RTOS-1", "1", "0", 1e-3, 1, 1, [1000.0, 1250.0]),
        ("RTOS-1", "0", "1.1 ms", 100e-6, 10, 11, [875.0, 1000.0]),
        ("RTOS-5", "0", "1.1 ms", 100e-6, 2, 11, [1500.0, 1750.0]),
        ("RTOS-20", "0", "1.1 ms", 50e-6, 1, 22, [1500.0, 2000.0]),
    ] {
        let model =
            [("model.law", "ideal"), ("platform.kind", platform), ("model.delay", delay), ("model.latency", latency)];
        let [below, above] = rungs.map(|rung| rung * MASS_KG / 0.09);
        assert!(mass_rests(below, h, every, late) && !mass_rests(above, h, every, late), "{platform} {rungs:?}");
        assert!(passes(below, &model), "{platform} {delay} {latency}: {below} fails");
        assert!(!passes(above, &model), "{platform} {delay} {latency}: {above} passes");
    }
}
