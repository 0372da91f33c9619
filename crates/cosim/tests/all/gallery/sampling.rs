//! Effects of sampling and counting: the leak of a held spring, a limit cycle of one count, ticking, and the velocity
//! in counts.

use std::f64::consts::{PI, TAU};

use hpu_cosim::scene::OutcomeKind;

use super::axis::{near, outcome, range, rows, run, scene, speeds};

/// Returns the energy after over the energy before a bounce at 0.1 m/s, entered this share of a sample later, and the
/// least memory.
pub fn bounce(name: &str, share: f64, more: &[(&str, &str)]) -> (f64, i64) {
    let start = format!("{} mm", 9.9 - 0.1 * share);
    let overrides = [&[("device.initial_position", start.as_str()), ("run.duration", "45 ms")], more].concat();
    let scene = scene(name, &overrides);
    let (_, trace) = run(&scene, &["memory"]);
    let least = if name.starts_with("popc") { range(trace.words(0)).0 } else { 0 };
    let last = speeds(&trace).last().expect("rows");
    assert!(*last < 0.0 && *trace.angles_rad().last().expect("rows") < scene.wall.position_rad, "it has left");
    ((last / 0.1).powi(2), least)
}

#[test]
fn a_held_spring_gives_exp_of_half_pi_omega_t_a_bounce_and_a_live_one_nothing() {
    // sqrt(1 kN/m / 100 g) = 100 / s; the range over the entry's phase and the mean are known answers.
    let gains: Vec<f64> = (0..8).map(|phase| bounce("leak-bounce", f64::from(phase) / 8.0, &[]).0).collect();
    near(gains.iter().sum::<f64>() / 8.0, (0.5 * PI * 100.0 * 1e-3).exp(), 1e-3);
    let (least, most) = range(&gains);
    assert!(least > 1.16695 - 5e-4 && most < 1.17274 + 5e-4, "{least} to {most}");
    // The spring is about six clocks late, 120 ns: exp(pi omega 2 t) is 4e-5 more than 1; a count is 1e-4 of the depth.
    near(bounce("leak-bounce", 0.3, &[("method.kind", "hybrid")]).0, 1.0, 1e-4);
}

/// Returns the critical stiffness of a sampled spring on a damped mass, and the frequency of its oscillation, without
/// counts.
fn critical(mass_kg: f64, damping: f64, t_s: f64) -> (f64, f64) {
    let e = (-damping * t_s / mass_kg).exp();
    let phi = mass_kg * (1.0 - e) / damping;
    let (g1, g2) = (t_s / damping - mass_kg * (1.0 - e) / damping.powi(2), (1.0 - e) / damping);
    let stiffness = (1.0 - e) / (g2 * phi - g1 * e);
    (stiffness, (0.5 * (1.0 + e - stiffness * g1)).acos() / (TAU * t_s))
}

#[test]
fn a_stable_wall_swings_by_one_count_as_the_describing_function_says() {
    let wall = scene("count-cycle", &[]).wall;
    let (stiffness, frequency_hz) = critical(0.1, 5.0, 1e-3);
    near(stiffness, 10_084.030_1, 1e-8);
    near(wall.stiffness_nm_per_rad, 0.9 * stiffness, 1e-5);
    // N(A) = 8/pi sqrt(u (1 - u)) = 1 / 0.9 with u = (D / 2 A)^2; of the two roots the greater A is the stable one.
    let u = 0.5 * (1.0 - (1.0 - 4.0 * (PI / 7.2).powi(2)).sqrt());
    let counts = 0.5 / u.sqrt();
    // The amplitude varies by a quarter from second to second, so five seconds are averaged.
    let (_, trace) = run(&scene("count-cycle", &[("run.duration", "5 s")]), &["penetration"]);
    let swing = trace.angles_rad();
    let mean = swing.iter().sum::<f64>() / swing.len() as f64;
    let rms = (swing.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / swing.len() as f64).sqrt();
    // The amplitude of a sine of this rms, because a describing function assumes a sine.
    near(rms * std::f64::consts::SQRT_2, counts * 10e-6, 0.15);
    // The first row is recorded before the datapath has read the position.
    let steps = trace.words(0)[1..].windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<i64>();
    near(steps as f64 / 4.0 / 5.0, frequency_hz, 0.15);
}

#[test]
fn friction_of_more_than_half_a_counts_force_stops_the_swing() {
    let scene = scene("count-cycle", &[("device.coulomb", "50 mN")]);
    assert!(0.5 * scene.wall.stiffness_nm_per_rad * 10e-6 < 50e-3);
    let (_, trace) = run(&scene, &[]);
    assert_eq!(range(&speeds(&trace)[rows(&trace, 1.0, 2.0)]), (0.0, 0.0));
}

#[test]
fn a_wall_ticks_between_two_counts_beyond_twice_the_friction_a_count() {
    let edge_n_per_m = 2.0 * 50e-3 / 20e-6;
    for (stiffness_n_per_m, ticks) in [(4.0e3, false), (4.9e3, false), (5.1e3, true), (5.3e3, true)] {
        assert_eq!(stiffness_n_per_m > edge_n_per_m, ticks);
        let (k, push) = (stiffness_n_per_m.to_string(), (4.5 * 20e-6 * stiffness_n_per_m).to_string());
        let scene = scene("one-tick", &[("wall.stiffness", &k), ("hand.torque", &push)]);
        let (_, trace) = run(&scene, &["penetration"]);
        let end = rows(&trace, 0.7, 1.0);
        let depths = range(&trace.words(0)[end.clone()]);
        let (low, high) = range(&trace.angles_rad()[end]);
        if ticks {
            assert_eq!(depths, (4, 5), "{k}");
            assert!(high > low && high - low < 0.01 * 20e-6, "{k}: {} m", high - low);
        } else {
            assert_eq!((depths.1 - depths.0, high - low), (0, 0.0), "{k}");
        }
    }
}

#[test]
fn of_a_damper_that_asks_for_more_than_full_scale_a_count_full_scale_remains() {
    let scene = scene("fast-velocity", &[]);
    let (force_n, count_m, t_s) = (2.0, 100e-6, 50e-6);
    assert!(scene.wall.damping_nm_s_per_rad * count_m / t_s > force_n);
    let (summary, trace) = run(&scene, &["command"]);
    // The damping that remains brings the mass to rest, later.
    assert_eq!(summary.outcome(), Some(OutcomeKind::NotTold));
    // The command runs from full scale less a count of the spring, 3276.8 of 65 536, to full scale.
    assert_eq!(range(trace.words(0)), (3_276 - 65_536, 65_535));
    // A count outward takes full scale off the force. A count inward adds full scale less the spring's force, 1 N on
    // average: F - 1 N / 2 for a sample.
    let remains = (force_n - 0.5) * t_s / count_m;
    // The oscillations decay by exp(-B t / 2 m), with 1 kg, over a second.
    let swing = |from_s| {
        let (low, high) = range(&trace.angles_rad()[rows(&trace, from_s, from_s + 0.4)]);
        high - low
    };
    near(-2.0 * (swing(1.5) / swing(0.5)).ln(), remains, 0.1);
}

#[test]
fn a_tenth_of_the_velocitys_rate_gives_the_damper_back() {
    let uniform = scene("fast-velocity", &[]);
    let mut dual = scene("dual-rate-velocity", &[]);
    // No more than full scale per count.
    assert!(dual.wall.damping_nm_s_per_rad * 100e-6 / 500e-6 <= 2.0);
    assert_eq!(run(&dual, &[]).0.outcome(), Some(OutcomeKind::Settled));
    dual.method.kind = uniform.method.kind;
    assert_eq!((dual.method, dual.wall, dual.device), (uniform.method, uniform.wall, uniform.device));
}

#[test]
fn what_buzzes_at_1_khz_is_quiet_behind_a_bound_and_behind_a_coupling() {
    assert_eq!(outcome("conventional-wall-1khz", &[]), Some(OutcomeKind::LimitCycle));
    let plain = scene("conventional-wall-1khz", &[]);
    for name in ["bounded-wall-1khz", "coupled-wall-1khz"] {
        let method = scene(name, &[]);
        assert_eq!((method.device, method.wall, &method.hand), (plain.device, plain.wall, &plain.hand), "{name}");
        assert_eq!(method.method.sample_rate_hz, plain.method.sample_rate_hz, "{name}");
        assert_eq!(run(&method, &[]).0.outcome(), Some(OutcomeKind::Settled), "{name}");
    }
}
