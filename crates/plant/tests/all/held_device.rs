//! Steps of one length against the exact flow, which other tests cover.

use hpu_plant::{Axis, Bridge, Device, Drive, Hand, HeldDevice, Motor, Push};

const EDGE_S: f64 = 1e-6;
const STEP: u64 = 1_000;
const HORIZON: u64 = 1 << 26;
const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };
const START: [f64; 3] = [0.2, 3.0, 0.1];

fn motor(coulomb_nm: f64) -> Motor {
    Motor {
        resistance_ohm: 2.3457,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-5,
        viscous_nm_s_per_rad: 1.3e-5,
        coulomb_nm,
    }
}

const PUSH: Hand = Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-3 });

fn rail(coulomb_n: f64) -> Axis {
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: 200.0, damping_nm_s_per_rad: 2.0 });
    Axis::amplified(Motor::on_rail(0.09, 0.1, coulomb_n), hand, EDGE_S, HORIZON).unwrap()
}

/// Compares both over this number of steps, with a new drive at each, a new intention of the hand at some, and some
/// steps cut short. Every state agrees within 1e-9 of its greatest size, the energies within 1e-9 of the energy
/// exchanged, and the changes of mode exactly. Returns the number of these.
fn agree(what: &str, axis: &Axis, drive: impl Fn(f64) -> Drive, steps: u64) -> u64 {
    let mut exact = Device::new(axis, START[0], START[1], START[2]);
    let mut held = HeldDevice::new(Device::new(axis, START[0], START[1], START[2]), STEP);
    let mut greatest = [f64::MIN_POSITIVE; 4];
    let mut edge = 0;
    let mut seed = 1u64;
    for step in 0..steps {
        // Friction holds the axis against half of the drives.
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let share = ((seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * if step % 100 < 50 { 0.6 } else { 0.02 };
        if step % 97 == 13 {
            let speed = if step % 2 == 0 { 0.0 } else { 20.0 * share };
            exact.intend(edge, share, speed);
            held.intend(edge, share, speed);
        }
        exact.driven(edge, drive(share));
        let driven = held.driven(edge, drive(share));
        assert!((driven[0] - exact.state(edge)[0]).abs() <= 1e-9 * greatest[0].max(driven[0].abs()), "{what} {step}");
        let next = edge + if step % 41 == 7 { 337 } else { STEP };
        let (truth, x) = (exact.flow(edge, next), held.flow(edge, next));
        for k in 0..4 {
            greatest[k] = greatest[k].max(truth[k].abs());
            assert!((x[k] - truth[k]).abs() <= 1e-9 * greatest[k], "{what}, step {step}, state {k}: {x:?}, {truth:?}");
        }
        edge = next;
    }
    let (truth, energy) = (exact.energy(edge), held.energy(edge));
    let bound = 1e-9 * truth.exchanged_j();
    for (name, a, b) in [
        ("source", truth.source_j(), energy.source_j()),
        ("hand", truth.hand_j(), energy.hand_j()),
        ("copper", truth.copper_j(), energy.copper_j()),
        ("viscous", truth.viscous_j(), energy.viscous_j()),
        ("coulomb", truth.coulomb_j(), energy.coulomb_j()),
    ] {
        assert!((a - b).abs() <= bound, "{what}, {name}: {a} {b}");
    }
    let stored_j = axis.stored_j(&exact.state(edge)) - axis.stored_j(&[START[0], START[1], START[2], START[2]]);
    let residual_j = energy.supplied_j() - stored_j - energy.dissipated_j();
    assert!(residual_j.abs() <= bound, "{what}: {residual_j}");
    assert_eq!(held.mode_changes(), exact.mode_changes(), "{what}");
    held.mode_changes()
}

#[test]
fn held_steps_are_the_exact_flow_of_axes_without_friction() {
    for (name, hand) in [("push", PUSH), ("torque", Hand::Torque(0.01)), ("prescribed", Hand::Prescribed)] {
        let axis = Axis::new(motor(0.0), BRIDGE, hand, EDGE_S, HORIZON).unwrap();
        agree(name, &axis, Drive::Average, 20_000);
        agree(name, &axis.without_inductance(), Drive::Average, 20_000);
    }
    agree("rail", &rail(0.0), |share| Drive::Current(10.0 * share), 20_000);
}

#[test]
fn held_steps_meet_every_stick_and_slip_of_the_exact_flow() {
    let axis = Axis::new(motor(8e-3), BRIDGE, PUSH, EDGE_S, HORIZON).unwrap();
    let changes = agree("motor", &axis, Drive::Average, 20_000);
    assert!(changes > 100, "{changes}");
    let changes = agree("rail", &rail(0.3), |share| Drive::Current(10.0 * share), 20_000);
    assert!(changes > 100, "{changes}");
}

#[test]
fn held_steps_are_the_exact_flow_where_friction_is_smoothed_or_borne_by_the_hand() {
    let smoothed = rail(0.3).with_smoothed_friction(0.01).unwrap();
    let changes = agree("smoothed", &smoothed, |share| Drive::Current(10.0 * share), 20_000);
    assert!(changes > 100, "{changes}");
    let prescribed = Axis::new(motor(8e-3), BRIDGE, Hand::Prescribed, EDGE_S, HORIZON).unwrap();
    agree("prescribed", &prescribed, Drive::Average, 20_000);
}
