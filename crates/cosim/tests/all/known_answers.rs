//! The sampled wall in front of a mass, against the known answers of its exact analysis.

use hpu_cosim::LinearLoop;
use hpu_cosim::scene::Scene;
use hpu_plant::{Linear, Mass, Trajectory};

const WALL: &str = r#"
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

#[track_caller]
fn near(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

fn wall(overrides: &[(&str, &str)]) -> LinearLoop {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = Scene::parse("wall.toml", WALL, &overrides, &mut |_| unreachable!("no file is named"));
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    LinearLoop::new(&scene, scene.wall.stiffness_nm_per_rad, scene.wall.damping_nm_s_per_rad)
}

/// Returns the greatest error of a growth rate measured over two windows. Each window's mean square weighs, from the
/// end where the motion is largest, u² e^(-2 g u): of it the share (1 + (ω/g)²)^(-3/2) varies with the phase, up or
/// down.
fn end_effects(growth_per_s: f64, swing_rad_per_s: f64, window_s: f64) -> f64 {
    (1.0 + (swing_rad_per_s / growth_per_s).powi(2)).powf(-1.5) / window_s
}

/// Returns the size of the leading pair of eigenvalues, from positions alone: two oscillating modes obey a recurrence
/// of three terms, whose last coefficient is the pair's product. Every other mode has decayed long before the last
/// samples.
fn radius(law: &LinearLoop) -> f64 {
    let mut x = Vec::new();
    law.samples(64, |position, scale| {
        assert_eq!(scale, 0.0);
        x.push(position);
    });
    let [a, b, c, d] = x[60..] else { unreachable!("four of them") };
    ((b * d - c * c) / (a * c - b * b)).sqrt()
}

#[test]
fn a_held_force_moves_a_mass_by_the_known_transition() {
    let body = Mass { mass_kg: 0.075, damping_n_s_per_m: 0.005 };
    let system = Linear::new(body.matrix(), 1e-6, 1000);
    let after = |speed, push| Trajectory::new(&system, [0.0, speed, 0.0, 0.0], [0.0, push, 0.0, 0.0]).at(1000);
    let coasting = after(1.0, 0.0);
    near(coasting[2], 9.99966667e-4, 1e-9);
    near(coasting[1], 0.999933335556, 1e-12);
    let pushed = after(0.0, 1.0 / body.mass_kg);
    near(pushed[2], 6.66651852e-6, 1e-9);
    near(pushed[1], 0.0133328889, 1e-8);
}

#[test]
fn an_undamped_held_spring_grows_by_the_known_rate() {
    let law = wall(&[("device.mass", "0.075")]);
    // |λ| = sqrt(1 + K T² / 2m).
    near(radius(&law), (1.0 + 1000.0 * 1e-6 / 0.15f64).sqrt(), 1e-12);
    near(radius(&law), 1.00332779622, 1e-11);
    let growth = 0.5e3 * (1000.0 * 1e-6 / 0.15f64).ln_1p();
    near(growth, 3.32227, 1e-6);
    let bound = end_effects(growth, (1000.0f64 / 0.075).sqrt(), 16.384);
    near(law.growth_per_s(1 << 15), growth, bound / growth);
}

#[test]
fn a_sampled_wall_with_damping_decays_by_the_known_radius() {
    let law = wall(&[("device.damping", "0.1"), ("wall.damping", "1")]);
    near(radius(&law), 0.997006828124, 1e-12);
    let growth = 1e3 * 0.997006828124f64.ln();
    near(law.growth_per_s(1 << 15), growth, end_effects(growth, 100.0, 16.384) / growth.abs());
}

#[test]
fn growth_and_decay_beyond_the_range_of_floats_are_measured_too() {
    // Over 1049 s, e^2615 up and e^-3143 down; the exponent of a float holds about 700.
    let up = 1e3 * 1.005f64.sqrt().ln();
    near(wall(&[]).growth_per_s(1 << 20), up, end_effects(up, 100.0, 524.288) / up);
    let down = 1e3 * 0.997006828124f64.ln();
    let law = wall(&[("device.damping", "0.1"), ("wall.damping", "1")]);
    near(law.growth_per_s(1 << 20), down, end_effects(down, 100.0, 524.288) / down.abs());
}

#[test]
fn a_bounce_off_a_held_unilateral_spring_gains_the_known_energy() {
    let (mass_kg, stiffness_n_per_m, speed_m_per_s) = (0.1, 1000.0, 1.0);
    let system = Linear::new(Mass { mass_kg, damping_n_s_per_m: 0.0 }.matrix(), 1e-6, 1000);
    // The mass enters the wall at this share of the sample period after the latest sample.
    let gain = |share: f64| {
        let mut x = [0.0, speed_m_per_s, -share * 1e-3 * speed_m_per_s, 0.0];
        loop {
            let force_n = stiffness_n_per_m * x[2].max(0.0);
            if force_n == 0.0 && x[1] < 0.0 {
                return (x[1] / speed_m_per_s).powi(2);
            }
            x = Trajectory::new(&system, x, [0.0, -force_n / mass_kg, 0.0, 0.0]).at(1000);
        }
    };
    let phases = 2000;
    let gains: Vec<f64> = (0..phases).map(|phase| gain((f64::from(phase) + 0.5) / f64::from(phases))).collect();
    let mean = gains.iter().sum::<f64>() / f64::from(phases);
    near(mean, 1.16984313, 5e-4);
    // exp(π ω T / 2), by the averaged motion.
    let omega = (stiffness_n_per_m / mass_kg).sqrt();
    near(mean, (0.5 * std::f64::consts::PI * omega * 1e-3).exp(), 5e-4);
    let (least, most) = gains.iter().fold((f64::MAX, 0.0f64), |(l, h), &g| (l.min(g), h.max(g)));
    near(least, 1.16695, 5e-4);
    near(most, 1.17274, 5e-4);
}
