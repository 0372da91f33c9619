//! Ends of modes within an edge, against a clock that is a thousand times as fast: there each end has its own edge.

use hpu_plant::{Axis, Bridge, Device, Gates, Hand, Motor, Push};

use crate::random::Random;

const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.3, diode_drop_v: 0.7, dead_band_v: 0.0 };
/// An edge of the slow clock in seconds, and edges of the fast one in it.
const EDGE_S: f64 = 1e-6;
const FINE: u64 = 1000;

/// Returns a motor whose current rises by an ampere in about an edge, on either clock.
fn axes(coulomb_nm: f64, hand: Hand) -> [Axis; 2] {
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 2e-5,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-7,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm,
    };
    [1, FINE].map(|share| Axis::new(motor, BRIDGE, hand, EDGE_S / share as f64, 1 << 24).unwrap())
}

#[test]
fn each_of_several_ends_of_modes_within_an_edge_takes_effect_at_its_instant() {
    let gates = [
        Gates { a_high: false, a_low: true, b_high: true, b_low: false },
        Gates { a_high: true, a_low: false, b_high: false, b_low: true },
        Gates { a_high: false, a_low: true, b_high: false, b_low: true },
        Gates::default(),
    ];
    let axes = [axes(5e-3, Hand::Torque(2e-3)), axes(20e-3, Hand::Torque(-3e-3))];
    let mut random = Random(21);
    // Edges with no end, one end, and more.
    let (mut edges, mut rests, mut grazes) = ([0; 3], 0, 0);
    for trial in 0..4000 {
        let [slow, fast] = &axes[trial % 2];
        let start = [random.between(-0.5, 0.5), random.between(-0.1, 0.1)];
        let [mut slow, mut fast] = [slow, fast].map(|axis| Device::new(axis, start[0], start[1], 0.0));
        // Diodes take over the current; some trials switch before.
        let first = gates[random.below(4) as usize];
        for device in [&mut slow, &mut fast] {
            device.drive(0, first);
            if trial % 3 == 0 {
                device.drive(0, gates[(trial + 1) % 4]);
            }
        }
        for edge in 1..20 {
            let (before, begun) = (fast.mode_changes(), slow.state(edge - 1)[1]);
            let (x, y) = (slow.step(edge), fast.flow((edge - 1) * FINE, edge * FINE));
            let ends = fast.mode_changes() - before;
            edges[ends.min(2) as usize] += 1;
            let what = format!("trial {trial}, edge {edge}");
            if slow.mode_changes() < fast.mode_changes() && begun * x[1] > 0.0 {
                // The speed passes zero and comes back within the edge, which ends no mode.
                grazes += 1;
                break;
            }
            rests += u32::from(ends > 1 && fast.is_stuck() && y[0] == 0.0);
            assert_eq!(slow.mode_changes(), fast.mode_changes(), "{what}");
            assert_eq!(slow.is_stuck(), fast.is_stuck(), "{what}");
            // Current, speed and angle that come about in a few edges.
            for ((x, y), scale) in x.iter().zip(&y).zip([1.0, 0.1, 1e-8]) {
                assert!((x - y).abs() <= 1e-12 * (scale + y.abs()), "{what}: {x} is not {y}");
            }
            let [one, other] = [slow.energy(edge), fast.energy(edge * FINE)];
            let off_j = (one.copper_j() - other.copper_j()).abs().max((one.diodes_j() - other.diodes_j()).abs());
            assert!(off_j <= 1e-11 * other.exchanged_j(), "{what}: off by {off_j} J");
            if edge == 3 {
                slow.drive(edge, Gates::default());
                fast.drive(edge * FINE, Gates::default());
            }
        }
    }
    assert!(edges[1] > 4000 && edges[2] > 1000 && rests > 200, "{edges:?}, {rests}");
    assert!(10 * grazes < edges[2], "{grazes} of {edges:?}");
}

#[test]
fn friction_that_holds_a_torque_exactly_equal_to_it_lets_go_as_soon_as_the_torque_grows() {
    // Torque constant times current is the friction, to the bit; the hand's spring then pulls by `k v t`.
    let motor = Motor {
        resistance_ohm: 1.0,
        inductance_h: 1e-3,
        torque_constant_nm_per_a: 2f64.powi(-5),
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 0.0,
        coulomb_nm: 2f64.powi(-6),
    };
    let push = Push { stiffness_nm_per_rad: 3.0, damping_nm_s_per_rad: 0.0 };
    let axis = Axis::amplified(motor, Hand::Spring(push), 20e-9, 1 << 24).unwrap();
    // In an edge the torque grows by less than its last place, by about that much, or by far more.
    for speed in [1e-12, 1e-11, 1e-10, 1e-3, 1.0] {
        for sign in [1.0, -1.0] {
            let mut device = Device::new(&axis, sign * 0.5, 0.0, 0.0);
            device.intend(0, 0.0, sign * speed);
            assert!(device.is_stuck(), "{speed} rad/s");
            for edge in 1..=5 {
                let x = device.step(edge);
                // The shaft has moved by far less than the hand: its speed is `k v t² / 2 J`.
                let time_s = edge as f64 * 20e-9;
                let expected = sign * 3.0 * speed * time_s * time_s / (2.0 * motor.inertia_kg_m2);
                assert!((x[1] - expected).abs() <= 1e-6 * expected.abs(), "{speed} rad/s: {} is not {expected}", x[1]);
                assert!(!device.is_stuck() && device.mode_changes() == 1, "{speed} rad/s, edge {edge}");
            }
        }
    }
}
