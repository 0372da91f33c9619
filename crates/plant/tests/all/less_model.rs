//! Reduced models: a winding without inductance, friction that creeps instead of sticking.

use hpu_plant::{Axis, Bridge, Device, Hand, Motor, Push};

const EDGE_S: f64 = 20e-9;
const HORIZON: u64 = 1 << 29;
/// A band of angles that no test leaves.
const ANYWHERE: (f64, f64) = (-1e6, 1e6);
const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };

fn motor() -> Motor {
    Motor {
        resistance_ohm: 2.3457,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    }
}

fn resistive(motor: Motor, hand: Hand) -> Axis {
    Axis::new(motor, BRIDGE, hand, EDGE_S, HORIZON).unwrap().without_inductance()
}

fn close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

/// Moves from event to event to an edge, and returns the state there.
fn go(device: &mut Device, from: u64, to: u64) -> [f64; 4] {
    let mut edge = from;
    while let Some(event) = device.next_event(edge, to, ANYWHERE) {
        edge = event.0;
        device.arrive(event);
    }
    device.state(to)
}

fn balances(device: &Device, edge: u64) {
    let energy = device.energy(edge);
    let residual_j = energy.supplied_j() - device.stored_j(edge) - energy.dissipated_j();
    assert!(residual_j.abs() <= 1e-12 * energy.exchanged_j(), "{residual_j} J of {}", energy.exchanged_j());
}

#[test]
fn a_motor_without_inductance_is_of_first_order_and_its_current_ohms() {
    let (m, r, volts) = (motor(), 2.3457 + 0.2, -0.25 * 24.0);
    let (k, j) = (m.torque_constant_nm_per_a, m.inertia_kg_m2);
    let rate = (k * k / r + m.viscous_nm_s_per_rad) / j;
    let last = k * volts / r / j / rate;
    let axis = resistive(m, Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 30.0, 0.2);
    device.drive_average(0, 0.25);
    for edges in [0u64, 1, 77, 5_000, 123_456, 7_654_321] {
        let t = edges as f64 * EDGE_S;
        let gone = -(-rate * t).exp_m1();
        let speed = 30.0 + (last - 30.0) * gone;
        let [current, w, angle, _] = device.state(edges);
        close(w, speed, 1e-11);
        close(angle, 0.2 + last * t + (30.0 - last) * gone / rate, 1e-11);
        close(current, (volts - k * speed) / r, 1e-11);
    }
    balances(&device, 7_654_321);
}

#[test]
fn a_dead_band_takes_its_share_of_a_mean_voltage_in_either_direction() {
    let (m, r) = (motor(), 2.3457 + 0.2);
    let (k, j) = (m.torque_constant_nm_per_a, m.inertia_kg_m2);
    let rate = (k * k / r + m.viscous_nm_s_per_rad) / j;
    let bridge = Bridge { dead_band_v: 0.6, ..BRIDGE };
    let axis = Axis::new(m, bridge, Hand::Torque(0.0), EDGE_S, HORIZON).unwrap();
    let resistive = Axis::new(m, bridge, Hand::Torque(0.0), EDGE_S, HORIZON).unwrap().without_inductance();
    for (duty, volts) in [(0.02, 0.0), (0.025, 0.0), (-0.02, 0.0), (0.25, -5.4), (-0.25, 5.4), (-1.0, 23.4)] {
        let mut device = Device::new(&resistive, 0.0, 30.0, 0.0);
        device.drive_average(0, duty);
        let t = 100_000.0 * EDGE_S;
        let (last, gone) = (k * volts / r / j / rate, -(-rate * t).exp_m1());
        let [current, speed, angle, _] = device.state(100_000);
        close(speed, 30.0 + (last - 30.0) * gone, 1e-11);
        close(current, (volts - k * speed) / r, 1e-11);
        close(angle, last * t + (30.0 - last) * gone / rate, 1e-11);
        balances(&device, 100_000);
        // With its inductance at rest in a held shaft's place: after many time constants V / R.
        let held = Axis::new(Motor { inertia_kg_m2: 1e6, ..m }, bridge, Hand::Torque(0.0), EDGE_S, HORIZON).unwrap();
        let mut device = Device::new(&held, 0.0, 0.0, 0.0);
        device.drive_average(0, duty);
        assert!((device.state(1_000_000)[0] - volts / r).abs() < 1e-9);
        let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
        device.drive_average(0, duty);
        go(&mut device, 0, 100_000);
        balances(&device, 100_000);
    }
}

#[test]
fn its_current_jumps_with_the_voltage_and_nothing_is_stored_in_it() {
    let axis = resistive(motor(), Hand::Torque(0.01));
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    let mut edge = 0;
    for duty in [0.5, -0.5, 0.0, 1.0] {
        let speed = device.state(edge)[1];
        device.drive_average(edge, duty);
        let x = device.state(edge);
        close(x[1], speed, 1e-14);
        close(x[0], (-24.0 * duty - 25.9e-3 * speed) / (2.3457 + 0.2), 1e-14);
        edge += 10_000;
        balances(&device, edge);
    }
    let x = device.state(edge);
    close(device.stored_j(edge), 0.5 * 1.37e-6 * x[1] * x[1], 1e-14);
}

#[test]
fn the_inductive_motor_comes_to_it_in_proportion_to_its_inductance() {
    let (hand, edges) = (Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 }), 100_000);
    let run = |axis: &Axis| {
        let mut device = Device::new(axis, 0.0, 0.0, 0.0);
        device.drive_average(0, -0.4);
        device.state(edges)[2]
    };
    let without = run(&resistive(motor(), hand));
    let error = |inductance_h| {
        run(&Axis::new(Motor { inductance_h, ..motor() }, BRIDGE, hand, EDGE_S, HORIZON).unwrap()) - without
    };
    let errors = [1e-6, 0.5e-6, 0.25e-6].map(error);
    for pair in errors.windows(2) {
        // Second-order terms are in the ratio of L / R to the mechanical time constant, about 1e-4.
        close(pair[0] / pair[1], 2.0, 1e-2);
    }
}

#[test]
fn a_stuck_shaft_without_inductance_lets_go_at_the_edge_of_the_voltage() {
    let axis = resistive(Motor { coulomb_nm: 5e-3, ..motor() }, Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    // 5 mN.m need 0.193 A, 0.491 V.
    device.drive_average(1_000, 0.02);
    assert!(device.is_stuck());
    assert_eq!(go(&mut device, 1_000, 5_000)[1], 0.0);
    device.drive_average(5_000, 0.0205);
    assert!(!device.is_stuck());
    let x = go(&mut device, 5_000, 10_000);
    assert!(x[1] < 0.0, "{x:?}");
    device.drive_average(10_000, 0.0);
    assert_eq!(go(&mut device, 10_000, 5_000_000)[1], 0.0);
    assert!(device.is_stuck());
    balances(&device, 5_000_000);
}

#[test]
#[should_panic(expected = "no switching")]
fn it_has_no_gates() {
    let axis = resistive(motor(), Hand::Torque(0.0));
    Device::new(&axis, 0.0, 0.0, 0.0).drive(0, hpu_plant::Gates::default());
}

/// Returns a mass of 0.1 kg with 0.2 N of friction, smoothed below 10 mm/s.
fn creeping(hand: Hand) -> Axis {
    Axis::amplified(Motor::on_rail(0.1, 0.0, 0.2), hand, EDGE_S, HORIZON).unwrap().with_smoothed_friction(0.01).unwrap()
}

#[test]
fn smoothed_friction_slows_in_a_line_and_then_exponentially() {
    let axis = creeping(Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 0.05, 0.0);
    // At 2 m/s² from 50 to 10 mm/s: 20 ms, 0.6 mm. After that with τ = m v₀ / F = 5 ms.
    let line = 1_000_000;
    let x = go(&mut device, 0, line / 2);
    close(x[1], 0.03, 1e-12);
    assert_eq!(device.mode_changes(), 0);
    let x = go(&mut device, line / 2, line + 1);
    assert_eq!(device.mode_changes(), 1);
    close(x[2], 0.6e-3, 1e-6);
    let later = line + 1_000_000;
    let x = go(&mut device, line + 1, later);
    close(x[1], 0.01 * (-4.0f64).exp(), 1e-10);
    close(x[2], 0.6e-3 - 0.01 * 5e-3 * (-4.0f64).exp_m1(), 1e-10);
    assert_eq!(device.mode_changes(), 1);
    balances(&device, later);
    close(device.energy(later).coulomb_j(), 0.05 * (0.05f64.powi(2) - x[1] * x[1]), 1e-10);
}

#[test]
fn a_force_below_smoothed_friction_creeps_and_one_above_runs_away() {
    let axis = creeping(Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive_current(0, 0.15);
    let x = go(&mut device, 0, 50_000_000);
    assert!(!device.is_stuck());
    close(x[1], 0.0075, 1e-12);
    device.drive_current(50_000_000, -0.4);
    let x = go(&mut device, 50_000_000, 51_000_000);
    assert_eq!(device.mode_changes(), 1);
    // To -10 mm/s with τ = 5 ms toward -20 mm/s, then at -2 m/s².
    let tau_s = 5e-3;
    let turn_s = tau_s * (0.0275f64 / 0.01).ln();
    close(x[1], -0.01 - 2.0 * (0.02 - turn_s), 1e-9);
    balances(&device, 51_000_000);
}

#[test]
fn a_prescribed_hand_bears_smoothed_friction_in_proportion() {
    let axis = creeping(Hand::Prescribed);
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.intend(0, 0.0, 0.0025);
    device.intend(1_000_000, 50e-6, 0.1);
    let energy = device.energy(2_000_000);
    // 50 N.s/m at 2.5 mm/s over 50 um, 0.2 N over 2 mm.
    close(energy.coulomb_j(), 0.05 * 50e-6 + 0.2 * 2e-3, 1e-12);
    balances(&device, 2_000_000);
}

#[test]
fn a_spring_hand_through_creep_and_slip_balances() {
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: 300.0, damping_nm_s_per_rad: 0.5 });
    let axis = creeping(hand);
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    let mut edge = 0;
    for (angle, speed) in [(0.0, 0.02), (0.002, -0.05), (-0.004, 0.001)] {
        device.intend(edge, angle, speed);
        go(&mut device, edge, edge + 5_000_000);
        edge += 5_000_000;
    }
    assert!(device.mode_changes() >= 4, "{}", device.mode_changes());
    balances(&device, edge);
}
