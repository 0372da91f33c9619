//! The limits of actuators and words: full scale, a product that wraps, a motor whose winding is open.

use hpu_cosim::scene::{Device, OutcomeKind};

use super::axis::{near, outcome, range, rows, run, scene};

#[test]
fn beyond_full_scale_a_wall_gives_way_by_the_energy_that_is_left() {
    let (m, v, k, f) = (0.1, 0.5f64, 2000.0, 2.0);
    let scene = scene("weak-wall", &[]);
    let (_, trace) = run(&scene, &["command"]);
    let peak_m = range(trace.angles_rad()).1 - 10e-3;
    near(peak_m, m * v * v / (2.0 * f) + 0.5 * f / k, 2.5e-3);
    // In and out again under a constant force.
    let entry = (v * v - f * f / (k * m)).sqrt();
    let flat = trace.words(0).iter().filter(|command| **command == 65_535).count();
    near(flat as f64 * trace.interval_s(), 2.0 * m * entry / f, 1e-2);
}

#[test]
fn with_force_to_spare_the_same_wall_stops_it_where_it_should() {
    let (_, trace) = run(&scene("weak-wall", &[("amplifier.full_scale", "10 N")]), &["command"]);
    let peak_m = range(trace.angles_rad()).1 - 10e-3;
    near(peak_m, 0.5 * (0.1f64 / 2000.0).sqrt(), 5e-3);
    assert!(range(trace.words(0)).1 < 65_535);
}

#[test]
fn a_product_without_its_upper_bits_is_a_sawtooth_and_a_saturated_one_stays() {
    for (name, spring) in [("wrap-product", (|p| p % 4096) as fn(i64) -> i64), ("wrap-saturated", |p| p.min(4095))] {
        let scene = scene(name, &[]);
        let stiffness = scene.words().expect("valid").stiffness;
        let (_, trace) = run(&scene, &["penetration", "spring"]);
        assert!(range(trace.words(0)).1 * stiffness > 4095, "{name}");
        for (depth, found) in trace.words(0).iter().zip(trace.words(1)) {
            assert_eq!(*found, spring(depth * stiffness), "{name} at {depth}");
        }
    }
}

#[test]
fn an_open_winding_brakes_nothing_and_a_shorted_one_by_the_square_of_k_by_r() {
    let floating = scene("floating-motor", &[]);
    let Device::Motor(motor) = floating.device else { panic!("a motor") };
    let (j, b, w) = (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad, motor.initial_speed_rad_per_s);
    let turned = |damping: f64| w * j / damping * -(-damping * 0.2 / j).exp_m1();
    let (_, trace) = run(&floating, &[]);
    near(*trace.angles_rad().last().expect("rows"), turned(b), 1e-6);
    assert_eq!(range(trace.real(0)), (0.0, 0.0));
    // Braked to rest: the inductance does not change the distance, but the first clock does (20 ns, 6 urad).
    let (summary, trace) = run(&scene("floating-motor", &[("method.pwm.off", "brake")]), &[]);
    let shorted = b + motor.torque_constant_nm_per_a.powi(2) / motor.resistance_ohm;
    near(*trace.angles_rad().last().expect("rows"), turned(shorted), 5e-6);
    assert_eq!(summary.outcome(), Some(OutcomeKind::Settled));
}

#[test]
fn a_negative_damper_beyond_the_devices_grows_by_the_difference() {
    let growth = |negative: &str| {
        let (_, trace) = run(&scene("negative-damping", &[("method.negative_damping", negative)]), &[]);
        let at = |t_s| trace.real(1)[rows(&trace, t_s, t_s).start];
        f64::ln(at(0.99) / at(0.09)) / 0.9
    };
    // The growth is (0.6 - 0.5) / 0.1 a second; at 0.5 it is that of no damper, and below the motion slows. A count of
    // force, 15 uN, and half a sample of 100 us are a hundredth of it.
    for (negative, per_s) in [("0.6", 1.0), ("0.5", 0.0), ("0.4", -1.0)] {
        let found = growth(negative);
        assert!((found - per_s).abs() < 0.02, "{negative}: {found} / s, not {per_s}");
    }
}

#[test]
fn a_dead_spring_lets_the_push_through_and_a_reviving_one_holds() {
    let (_, trace) = run(&scene("dead-spring", &[]), &["memory", "penetration", "command"]);
    let end = rows(&trace, 0.3, 1.0);
    assert_eq!(range(&trace.words(0)[end.clone()]), (0, 0));
    assert_eq!(range(&trace.words(2)[end.clone()]), (0, 0));
    assert!(range(&trace.words(1)[end]).0 > 0, "inside the wall");
    near(*trace.real(1).last().expect("rows"), 1.0 / 3.0, 1e-6);
    assert_eq!(outcome("dead-spring", &[("method.revive", "true")]), Some(OutcomeKind::Settled));
}
