//! A mass on a rail under a force that jumps, and a motor whose current is imposed: closed forms, friction, energy.

use std::panic::{AssertUnwindSafe, catch_unwind};

use hpu_plant::{Axis, Bridge, Device, Gates, Hand, Motor, Push};

const EDGE_S: f64 = 20e-9;
const ANYWHERE: (f64, f64) = (-1e6, 1e6);
/// Mass, viscous and Coulomb friction of a drop test.
const MASS_KG: f64 = 0.09;
const VISCOUS: f64 = 0.005;
const COULOMB_N: f64 = 0.038;

fn close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

fn rail(hand: Hand) -> Axis {
    Axis::amplified(Motor::on_rail(MASS_KG, VISCOUS, COULOMB_N), hand, EDGE_S, 1 << 29).unwrap()
}

/// Moves through the device's own events to an edge.
fn go(device: &mut Device, mut from: u64, to: u64) {
    while from < to {
        match device.next_event(from, to, ANYWHERE) {
            Some(event) => {
                device.arrive(event);
                from = event.0;
            }
            None => from = to,
        }
    }
}

/// Returns position and speed after `dt` under a held net force, with viscous and Coulomb friction, in closed form.
fn held(mut x: f64, mut v: f64, force_n: f64, mut dt: f64) -> (f64, f64) {
    let tau_s = MASS_KG / VISCOUS;
    while dt > 0.0 {
        if v == 0.0 && force_n.abs() <= COULOMB_N {
            return (x, 0.0);
        }
        let sign = if v == 0.0 { force_n.signum() } else { v.signum() };
        let last = (force_n - sign * COULOMB_N) / VISCOUS;
        let stop_s = if v * last < 0.0 { tau_s * ((last - v) / last).ln() } else { f64::INFINITY };
        let t = dt.min(stop_s);
        let gone = -(-t / tau_s).exp_m1();
        x += last * t + tau_s * (v - last) * gone;
        v = if stop_s <= dt { 0.0 } else { v + (last - v) * gone };
        dt -= t;
    }
    (x, v)
}

/// Returns forces of a few tenths of a newton, drawn by an integer recurrence.
fn forces(count: usize) -> impl Iterator<Item = f64> {
    (0..count).scan(12_345u64, |word, _| {
        *word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        Some((*word >> 33) as f64 / (1u64 << 31) as f64 * 0.6 - 0.3)
    })
}

#[test]
fn a_held_force_moves_a_mass_with_friction_as_the_closed_form_says() {
    let weight_n = 0.02;
    let axis = rail(Hand::Torque(weight_n));
    let mut device = Device::new(&axis, 0.0, 0.223, -0.02);
    let (mut x, mut v) = (-0.02, 0.223);
    let (mut edge, mut stops, mut starts) = (0, 0, 0);
    for (index, force_n) in forces(3000).enumerate() {
        // Friction holds the mass against every third force.
        let force_n = if index % 3 == 0 { force_n * 0.05 } else { force_n };
        let was_stuck = device.is_stuck();
        device.drive_current(edge, force_n);
        starts += u32::from(was_stuck && !device.is_stuck());
        let next = edge + 700_000 + (index as u64 % 7) * 650_001;
        go(&mut device, edge, next);
        (x, v) = held(x, v, force_n + weight_n, (next - edge) as f64 * EDGE_S);
        edge = next;
        let state = device.state(edge);
        assert_eq!(state[0], force_n);
        assert!((state[1] - v).abs() < 1e-11, "speed {} at {edge}, not {v}", state[1]);
        assert!((state[2] - x).abs() < 1e-11 * (1.0 + x.abs()), "position {} at {edge}, not {x}", state[2]);
        assert_eq!(device.is_stuck(), v == 0.0, "{edge}");
        stops += u32::from(!was_stuck && device.is_stuck());
    }
    assert!(stops > 100 && starts > 100, "{stops} stops, {starts} starts");
}

#[test]
fn a_body_is_still_where_all_its_later_outputs_are_alike() {
    let axis = rail(Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 0.1, -0.0);
    assert_eq!(device.still(5), None);
    device.drive_current(10, 0.5 * COULOMB_N);
    go(&mut device, 10, 50_000_000);
    assert!(device.is_stuck());
    let anchor = device.next_event(50_000_000, 60_000_000, ANYWHERE);
    assert_eq!(anchor, None);
    let still = device.still(50_000_001).expect("friction holds it");
    for edge in [50_000_001, 50_000_002, 50_000_127, 50_000_128, 60_000_000, 1 << 29] {
        assert_eq!(device.reals(edge).map(f64::to_bits), still.map(f64::to_bits), "{edge}");
    }
    // A force beyond friction, from its first edge on.
    device.drive_current(60_000_000, 2.0 * COULOMB_N);
    assert_eq!((device.still(60_000_000), device.still(60_000_001)), (None, None));
}

#[test]
fn a_force_that_friction_holds_moves_nothing_and_one_beyond_it_moves_at_once() {
    let axis = rail(Hand::Torque(0.0));
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive_current(10, COULOMB_N);
    assert!(device.is_stuck());
    assert_eq!(device.next_event(10, 1 << 28, ANYWHERE), None);
    device.drive_current(1000, 2.0 * COULOMB_N);
    assert!(!device.is_stuck());
    // The first count of 1 nm: x = f t² / 2m with f = 2 f_c - f_c; viscous friction is 1e-8 of it.
    let expected_s = (2.0 * MASS_KG * 1e-9 / COULOMB_N).sqrt();
    let edges = (expected_s / EDGE_S).ceil() as u64;
    let found = device.next_event(1000, 1 << 28, (-1.0, 1e-9)).unwrap();
    assert!((1000 + edges..=1001 + edges).contains(&found.0), "{} after {edges}", found.0);
}

#[test]
fn a_hand_that_begins_elsewhere_pulls_from_the_first_edge_on() {
    let push = Push { stiffness_nm_per_rad: 100.0, damping_nm_s_per_rad: 0.0 };
    for (intended_m, moves) in [(COULOMB_N / 100.0 * 0.999, false), (COULOMB_N / 100.0 * 1.5, true)] {
        let axis = rail(Hand::Spring(push));
        let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
        device.intend(0, intended_m, 0.0);
        assert_eq!(device.is_stuck(), !moves);
        go(&mut device, 0, 1);
        // Viscous friction takes a billionth of the force.
        let net_n = if moves { 100.0 * intended_m - COULOMB_N } else { 0.0 };
        close(device.state(1)[1], net_n / MASS_KG * EDGE_S, 1e-8);
        close(device.state(1)[2], net_n / MASS_KG * EDGE_S * EDGE_S / 2.0, 1e-8);
    }
}

#[test]
fn the_encoder_s_edges_under_jumping_forces_are_those_that_scanning_every_clock_finds() {
    let push = Hand::Spring(Push { stiffness_nm_per_rad: 30.0, damping_nm_s_per_rad: 0.5 });
    for hand in [Hand::Torque(0.05), push, Hand::Prescribed] {
        let axis = rail(hand);
        let mut searched = Device::new(&axis, 0.0, 0.1, 0.0);
        let mut scanned = Device::new(&axis, 0.0, 0.1, 0.0);
        for device in [&mut searched, &mut scanned] {
            device.intend(0, 0.0, 0.05);
        }
        let band = |count: i64| (count as f64 * 1e-6, (count + 1) as f64 * 1e-6);
        let (mut now, mut crossings, mut count) = (0, 0, 0i64);
        for force_n in forces(40) {
            searched.drive_current(now, force_n);
            scanned.drive_current(now, force_n);
            let end = now + 40_000;
            while now < end {
                let limits = band(count);
                let found = searched.next_event(now, end, limits);
                let modes = scanned.mode_changes();
                // A prescribed hand comes to a count within a trillionth of an edge; side_of_band decides the side.
                let leaves = |edge: &u64| {
                    let x = scanned.step(*edge);
                    scanned.mode_changes() != modes || scanned.side_of_band(*edge, x[2], limits) != 0
                };
                assert_eq!(found.map(|event| event.0), (now + 1..=end).find(leaves));
                now = found.map_or(end, |event| event.0);
                if let Some(event) = found {
                    searched.arrive(event);
                }
                assert_eq!(searched.state(now), scanned.state(now));
                let x = searched.state(now);
                count += i64::from(searched.side_of_band(now, x[2], limits));
                crossings += u32::from(found.is_some());
            }
        }
        assert!(crossings > 50, "{crossings} crossings");
    }
}

#[test]
fn the_energy_balances_of_a_mass_and_of_a_motor_under_jumping_currents() {
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 1e-3,
    };
    let push = |k, b| Hand::Spring(Push { stiffness_nm_per_rad: k, damping_nm_s_per_rad: b });
    for (motor, hand, ampere) in [
        (Motor::on_rail(MASS_KG, VISCOUS, COULOMB_N), Hand::Torque(0.15), 1.0),
        (Motor::on_rail(MASS_KG, VISCOUS, COULOMB_N), push(300.0, 2.0), 10.0),
        (Motor::on_rail(MASS_KG, VISCOUS, COULOMB_N), Hand::Prescribed, 1.0),
        (Motor::on_rail(MASS_KG, 0.0, 0.0), push(300.0, 0.0), 1.0),
        (motor, Hand::Torque(1e-3), 1.0),
        (motor, push(0.05, 2e-4), 1.0),
        (motor, Hand::Prescribed, 1.0),
    ] {
        let axis = Axis::amplified(motor, hand, EDGE_S, 1 << 29).unwrap();
        let mut device = Device::new(&axis, 0.2, 0.1, 0.0);
        let mut edge = 0;
        for (index, force) in forces(2000).enumerate() {
            if index % 50 == 0 {
                let angle = device.state(edge)[2];
                device.intend(edge, angle, if index % 100 == 0 { 0.2 } else { -0.1 });
            }
            device.drive_current(edge, ampere * force);
            let next = edge + 1 + (index as u64 * 7919) % 60_000;
            go(&mut device, edge, next);
            edge = next;
        }
        let energy = device.energy(edge);
        let residual = energy.supplied_j() - device.stored_j(edge) - energy.dissipated_j();
        assert!(energy.exchanged_j() > 0.0);
        assert!(residual.abs() <= 1e-11 * energy.exchanged_j(), "{hand:?}: {residual:e} of {:e}", energy.exchanged_j());
    }
}

#[test]
fn a_current_source_pays_for_heat_and_work() {
    // Without friction and hand: K i = J ω', ω = K i t / J; the source gives R i² t and K i θ = J ω² / 2.
    let motor = Motor {
        resistance_ohm: 2.0,
        inductance_h: 1e-3,
        torque_constant_nm_per_a: 0.02,
        inertia_kg_m2: 1e-6,
        viscous_nm_s_per_rad: 0.0,
        coulomb_nm: 0.0,
    };
    let axis = Axis::amplified(motor, Hand::Torque(0.0), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive_current(0, 0.5);
    let (edge, t_s) = (500_000, 0.01);
    let speed = 0.02 * 0.5 * t_s / 1e-6;
    close(device.state(edge)[1], speed, 1e-12);
    let (heat_j, work_j, coil_j) = (2.0 * 0.25 * t_s, 0.5e-6 * speed * speed, 0.5 * 1e-3 * 0.25);
    close(device.energy(edge).source_j(), heat_j + work_j + coil_j, 1e-12);
    close(device.energy(edge).copper_j(), heat_j, 1e-12);
    close(device.stored_j(edge), work_j + coil_j, 1e-12);
    // When it is switched off, the coil gives back its stored energy.
    device.drive_current(edge, 0.0);
    close(device.energy(edge).source_j(), heat_j + work_j, 1e-12);
}

#[test]
fn an_amplifier_takes_over_from_a_bridge_and_hands_back() {
    let motor = Motor { resistance_ohm: 2.0, inductance_h: 1e-3, ..Motor::on_rail(1e-3, 0.1, 0.0) };
    let bridge = Bridge { supply_v: 10.0, on_resistance_ohm: 0.0, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let axis = Axis::new(motor, bridge, Hand::Prescribed, EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive_average(0, -0.5);
    device.drive_current(50_000, 3.0);
    assert_eq!(device.state(60_000)[0], 3.0);
    // With the shaft held, the current decays from there: i = 3 e^{-t R / L}.
    device.drive(60_000, Gates { a_high: false, a_low: true, b_high: false, b_low: true });
    close(device.state(85_000)[0], 3.0 * (-25_000.0 * EDGE_S * 2000.0f64).exp(), 1e-12);
    let energy = device.energy(85_000);
    let residual = energy.supplied_j() - device.stored_j(85_000) - energy.dissipated_j();
    assert!(residual.abs() <= 1e-12 * energy.exchanged_j(), "{residual:e}");
}

#[test]
fn an_axis_without_a_bridge_takes_no_winding_but_a_real_mass_and_no_gates() {
    let rail = Motor::on_rail(MASS_KG, VISCOUS, COULOMB_N);
    let refused = |motor| Axis::amplified(motor, Hand::Torque(0.0), EDGE_S, 1 << 20).err().unwrap().to_string();
    assert_eq!(refused(Motor { inertia_kg_m2: 0.0, ..rail }), "inertia is 0; it must be positive");
    assert_eq!(refused(Motor { resistance_ohm: -1.0, ..rail }), "resistance is -1; it must be zero or positive");
    let axis = Axis::amplified(rail, Hand::Torque(0.0), EDGE_S, 1 << 20).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    assert!(catch_unwind(AssertUnwindSafe(|| device.drive(0, Gates::default()))).is_err());
    assert!(catch_unwind(AssertUnwindSafe(|| device.drive_average(0, 0.5))).is_err());
}
