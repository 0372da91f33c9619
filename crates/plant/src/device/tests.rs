//! How far ahead a device knows its mode, and the reversals of its shaft.

use super::search::HEARD;
use super::{Device, Drive, Known, Pulses};
use crate::axis::Shaft;
use crate::flow::double::{Double, Native};
use crate::flow::guard::Side;
use crate::flow::matrix::{ANGLE, CURRENT, SPEED};
use crate::{Axis, Bridge, Gates, Hand, Motor, Push};

fn motor(coulomb_nm: f64) -> Motor {
    Motor {
        resistance_ohm: 1.0,
        inductance_h: 1e-3,
        torque_constant_nm_per_a: 0.02,
        inertia_kg_m2: 1e-6,
        viscous_nm_s_per_rad: 0.0,
        coulomb_nm,
    }
}

/// The length for which a mode is known to last is never longer than that for which the errors of its functions are
/// bounded.
#[test]
fn a_mode_is_known_to_last_only_as_far_as_errors_are_bounded() {
    let axis = Axis::amplified(motor(1e-3), Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
    let mut far = 0;
    for speed_rad_per_s in [5.0, 20.0, 50.0] {
        // A count every few hundred edges, while friction brakes the shaft.
        let (count_rad, mut at, mut count) = (speed_rad_per_s * 1e-5, 0, 0);
        let mut device = Device::new(&axis, 0.0, speed_rad_per_s, 0.0);
        while at < 20_000 {
            let band = [count, count + 1].map(|count| f64::from(count) * count_rad);
            // Edges come through a datapath one by one.
            let event = device.next_event(at, at + 4, (band[0], band[1]));
            at = event.map_or(at + 4, |event| event.0);
            if let Some(event) = event {
                device.arrive(event);
                count += 1;
            }
            let Known { kept, heard, .. } = device.known;
            assert!(kept == 0 || kept < heard, "{kept} of {heard}");
            far += u32::from(kept > HEARD);
        }
        assert!(count > 10 && device.mode_changes() == 0, "{count} counts");
        // Of a motion that is new, no direction is known.
        assert!(device.known.steady.until > 0);
        device.drive_current(at, 0.01);
        assert_eq!(device.known.steady.until, 0);
    }
    assert!(far > 100, "{far} looks farther than errors are bounded without being asked");
}

/// A cruise is tried on the smooth motion of the pulses. The direction of that motion says nothing of the switched one.
#[test]
fn a_cruise_leaves_no_direction_behind() {
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let axis = Axis::new(motor(0.0), bridge, Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
    let pulse = Gates { a_high: true, a_low: false, b_high: false, b_low: true };
    let pause = Gates { a_high: false, a_low: true, b_high: false, b_low: true };
    let speed_rad_per_s = 20.0;
    for counts_in in [40.0, 50.0, 55.0, 1000.0] {
        let mut device = Device::new(&axis, 0.0, speed_rad_per_s, 0.0);
        device.drive(1, pulse);
        // Fewer edges than a short search has, so that the direction is looked for.
        let high_rad = speed_rad_per_s * 2e-8 * (1.0 + counts_in);
        let end = device.cruise(1, 61, (-1e-3, high_rad), &Pulses { period: 16, duty: 8, pause });
        assert!(end.is_some(), "{counts_in}");
        assert_eq!(device.known.steady.until, 0, "{counts_in}");
    }
}

/// Under a constant torque the speed is straight on both sides of the reversal. With accelerations that are powers of
/// two, double-double holds the closed form to its last places.
#[test]
fn a_reversal_under_a_constant_torque_has_its_closed_form_to_thirty_digits() {
    let (inertia_kg_m2, coulomb_nm, torque_nm) = (2f64.powi(-20), 3.0 * 2f64.powi(-10), 5.0 * 2f64.powi(-10));
    let motor = Motor { inertia_kg_m2, ..motor(coulomb_nm) };
    for (sign, speed_rad_per_s) in [(1.0, 1.0 / 3.0), (-1.0, 0.7), (1.0, 1e-3), (-1.0, 1.234_567)] {
        let axis = Axis::amplified(motor, Hand::Torque(-sign * torque_nm), 20e-9, 1 << 24).expect("a motor");
        let mut device = Device::new(&axis, 0.0, sign * speed_rad_per_s, 0.0);
        let end = (speed_rad_per_s / 8192.0 / 20e-9) as u64 + 1;
        for edge in 1..end {
            device.step(edge);
        }
        assert_eq!((device.mode_changes(), device.anchor), (0, 0));
        assert!(device.clone().reverse(end, [if sign > 0.0 { Side::Below } else { Side::Above }, Side::Inside]));
        device.step(end);
        assert_eq!((device.mode_changes(), device.anchor), (1, end));
        // It slows by 8192 rad/s², then turns back by 2048 rad/s².
        let speed = Double::from(speed_rad_per_s);
        let left_s = Double::product(end as f64, 20e-9) - speed * (1.0 / 8192.0).into();
        let expected =
            [-(left_s * 2048.0.into()), speed * speed * (1.0 / 16384.0).into() - left_s * left_s * 1024.0.into()];
        for (lane, expected) in [SPEED, ANGLE].into_iter().zip(expected) {
            let off = (device.motion.x.lane(lane) - expected * sign.into()).hi.abs();
            // A clock period of the speed that the shaft had.
            assert!(off <= 4e-30 * (expected.hi.abs() + speed_rad_per_s), "lane {lane}: off by {off:e}");
        }
        // Friction on the way to and fro.
        let energy = device.energy(end);
        let back_rad = (left_s * left_s * 1024.0.into()).hi;
        let heat_j = coulomb_nm * (speed_rad_per_s * speed_rad_per_s / 16384.0 + back_rad);
        assert!((energy.coulomb_j() - heat_j).abs() <= 1e-14 * heat_j, "{} is not {heat_j}", energy.coulomb_j());
    }
}

/// `crates/prove/src/lasting.rs` takes the rounding of a flow for at most this: 2⁻⁹⁵ of the state, and as much for each
/// `1/‖A‖` of its time, in states whose sum of squares is twice the energy over the spring's stiffness.
#[test]
fn a_flow_has_thirty_digits() {
    // `testbench/oracle/flow.py` printed them, in arithmetic of 80 digits; each is the sum of two numbers.
    let expected: [(u64, [(f64, f64); 3]); 5] = [
        (
            1,
            [
                (0.012084635495420298, 4.531661916569172e-19),
                (0.020109609217421505, 4.544509890649111e-19),
                (0.10000000040109594, -6.27953809838077e-18),
            ],
        ),
        (
            1000,
            [
                (1.8938987494276036, -1.0488905854614878e-16),
                (0.1756049195179764, 3.1642946507146518e-18),
                (0.10000180777507789, 4.006786154651968e-19),
            ],
        ),
        (
            4096,
            [
                (5.773731415837401, -1.6582075241259324e-16),
                (1.1041586603120381, 9.704653766822096e-18),
                (0.10003852196791149, 3.0009645298127785e-18),
            ],
        ),
        (
            1000000,
            [
                (10.289440263039431, -7.798905708477832e-16),
                (-16.822063391559386, 4.923264812724072e-16),
                (1.9403706855616911, -4.330693755068728e-17),
            ],
        ),
        (
            12800000,
            [
                (10.14698064667067, 4.750335629090141e-16),
                (-1.86706534458924, -8.221044502037826e-17),
                (1.182744671412716, -1.1047711602253377e-16),
            ],
        ),
    ];
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.01, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 2.3e-4,
        torque_constant_nm_per_a: 0.026,
        inertia_kg_m2: 1.1e-5,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    };
    let push = Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 };
    let axis = Axis::new(motor, bridge, Hand::Spring(push), 20e-9, 1 << 24).expect("a motor");
    let mut device = Device::new(&axis, 0.01, 0.02, 0.1);
    device.intend(0, 0.3, 0.0);
    device.drive(0, Gates { a_high: false, a_low: true, b_high: true, b_low: false });
    // Winding and coupling: the greatest sum of a row, in 1/s.
    let scales = [(motor.inductance_h / 0.3).sqrt(), (motor.inertia_kg_m2 / 0.3).sqrt(), 1.0];
    let norm = 2.37 / motor.inductance_h + 0.026 / (motor.inductance_h * motor.inertia_kg_m2).sqrt();
    for (edges, lanes) in expected {
        let state = device.motion.flow::<Native>(edges);
        let size = 0.3 + scales.iter().zip(lanes).map(|(scale, (hi, _))| (scale * hi).powi(2)).sum::<f64>().sqrt();
        for ((lane, (hi, lo)), scale) in [CURRENT, SPEED, ANGLE].into_iter().zip(lanes).zip(scales) {
            let off = scale * (state.lane(lane) - Double { hi, lo }).hi.abs();
            let most = 2f64.powi(-95) * (1.0 + norm * edges as f64 * 20e-9) * size;
            assert!(off <= most, "{edges} edges, lane {lane}: off by {off:e} of {most:e}");
        }
    }
}

/// The general search for ends of modes flows to the instant and on from there.
#[test]
fn a_reversal_is_what_the_general_search_finds() {
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.01, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 2.3e-4,
        torque_constant_nm_per_a: 0.026,
        inertia_kg_m2: 1.1e-5,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 1.2e-3,
    };
    let push = Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 };
    let gates = [true, false].map(|up| Gates { a_high: up, a_low: !up, b_high: !up, b_low: up });
    let mut reversals = 0;
    for hand in [Hand::Spring(push), Hand::Torque(2e-4), Hand::Torque(0.0)] {
        let axis = Axis::new(motor, bridge, hand, 20e-9, 1 << 24).expect("a motor");
        let mut device = Device::new(&axis, 0.01, 0.02, 0.1);
        device.intend(0, 0.1, 0.3);
        let mut at = 0;
        for turn in 0..60 {
            device.drive(at, gates[turn % 2]);
            let until = at + 1500 + 37 * turn as u64;
            while let Some(event) = device.next_event(at, until, (-1e3, 1e3)) {
                let (mut general, before) = (device.clone(), device.mode_changes());
                at = event.0;
                let side = if device.shaft == Shaft::Slip(1) { Side::Below } else { Side::Above };
                let reverses = device.clone().reverse(at, [side, Side::Inside]);
                device.arrive(event);
                if !reverses {
                    continue;
                }
                assert_eq!(device.mode_changes(), before + 1);
                reversals += 1;
                let scale = device.motion.x.hi.map(f64::abs);
                let past = general.clone();
                general.change_at_instants(at, [side, Side::Inside], &event.1);
                assert_eq!((general.shaft, general.anchor), (device.shaft, device.anchor));
                for (lane, scale) in scale.iter().enumerate() {
                    let off = (general.motion.x.lane(lane) - device.motion.x.lane(lane)).hi.abs();
                    let most = 4e-30 * (scale + past.motion.w.hi[lane].abs() * 20e-9 + past.motion.x.hi[lane].abs());
                    assert!(off <= most, "lane {lane}: off by {off:e} of {most:e}");
                }
                let [one, other] = [&device, &general].map(|device| device.energy(at));
                for (one, other) in [
                    (one.source_j(), other.source_j()),
                    (one.hand_j(), other.hand_j()),
                    (one.copper_j(), other.copper_j()),
                    (one.viscous_j(), other.viscous_j()),
                    (one.coulomb_j(), other.coulomb_j()),
                ] {
                    assert!((one - other).abs() <= 1e-14 * (other.abs() + 1e-3 * device.energy(at).exchanged_j()));
                }
            }
            at = until;
        }
        assert!(device.energy(at).diodes_j() == 0.0);
    }
    assert!(reversals > 60, "{reversals} reversals");
}

/// The hand's spring is let back so fast that friction holds the shaft for a quarter of an edge only, from its stop to
/// the middle of the edge. It then slides the other way, and the spring's torque beyond friction grows with time.
#[test]
fn a_shaft_that_friction_holds_for_a_part_of_an_edge_is_not_turned_about_at_once() {
    let (inertia_kg_m2, coulomb_nm, stiffness_nm_per_rad, edge_s, intent_rad_per_s) = (1e-5, 1e-3, 0.1, 20e-9, 1000.0);
    let motor = Motor { inertia_kg_m2, viscous_nm_s_per_rad: 0.0, ..motor(coulomb_nm) };
    let hand = Hand::Spring(Push { stiffness_nm_per_rad, damping_nm_s_per_rad: 0.0 });
    let axis = Axis::amplified(motor, hand, edge_s, 1 << 24).expect("a motor");
    for sign in [1.0, -1.0] {
        let mut device = Device::new(&axis, 0.0, sign * 2.0 * coulomb_nm / inertia_kg_m2 * 0.25 * edge_s, 0.0);
        let intent_rad = -coulomb_nm / stiffness_nm_per_rad + intent_rad_per_s * 0.5 * edge_s;
        device.intend(0, sign * intent_rad, -sign * intent_rad_per_s);
        device.step(1);
        assert_eq!((device.mode_changes(), device.anchor), (2, 1));
        let jerk = stiffness_nm_per_rad * intent_rad_per_s / inertia_kg_m2;
        let expected = -sign * 0.5 * jerk * (0.5 * edge_s) * (0.5 * edge_s);
        let speed = device.motion.x.hi[SPEED];
        assert!((speed - expected).abs() <= 1e-3 * expected.abs(), "{speed:e} is not {expected:e}");
    }
}

/// A device recurs if it is as it was in every bit: in states, drive, hand, and in the time since its anchor.
#[test]
fn the_last_bit_of_any_state_is_a_difference() {
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let push = Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 };
    let axis = Axis::new(motor(1e-3), bridge, Hand::Spring(push), 2e-8, 1 << 24).expect("a motor");
    let pulse = Gates { a_high: true, a_low: false, b_high: false, b_low: true };
    let start = [0.3, 5.0, 0.7];
    let made = |[current_a, speed_rad_per_s, angle_rad]: [f64; 3], at: u64, gates: Gates| {
        let mut device = Device::new(&axis, current_a, speed_rad_per_s, angle_rad);
        device.drive(at, gates);
        device
    };
    let device = made(start, 0, pulse);
    for edges in [0, 1, 77] {
        // The same, a thousand edges later.
        let mut later = device.clone();
        later.repeat(1000, [&device, &device], 1);
        assert!(later.recurs(1000 + edges, &device, edges));
        assert_eq!(later.mark(1000 + edges), device.mark(edges));
        assert_eq!(later.state(1000 + edges).map(f64::to_bits), device.state(edges).map(f64::to_bits));
        assert!(!later.recurs(1001 + edges, &device, edges), "another time since the anchor");
    }
    for k in 0..3 {
        for bits in [1u64, 1 << 20] {
            let mut other = start;
            other[k] = f64::from_bits(start[k].to_bits() ^ bits);
            assert!(!made(other, 0, pulse).recurs(0, &device, 0), "state {k}");
        }
        let mut other = device.clone();
        other.motion.x.lo[k] = f64::from_bits(other.motion.x.lo[k].to_bits() ^ 1);
        assert!(!other.recurs(0, &device, 0), "rest of state {k}");
    }
    assert!(!made(start, 0, Gates { a_high: false, a_low: true, ..pulse }).recurs(0, &device, 0), "other gates");
    let mut other = device.clone();
    other.intend(0, 0.7, 0.1);
    assert!(!other.recurs(0, &device, 0), "another hand");
    let modes: [fn(&mut Device); 3] = [
        |device| device.shaft = Shaft::Stuck,
        |device| device.drive = Drive::Average(0.5),
        |device| device.circuit = device.axis.bridge.averaged(0.5),
    ];
    for change in modes {
        let mut other = device.clone();
        change(&mut other);
        assert!(!other.recurs(0, &device, 0), "{:?} {:?} {:?}", other.shaft, other.drive, other.circuit);
    }
    let mut other = device.clone();
    other.leaves = 5;
    assert!(!other.recurs(0, &device, 0) && other.recurs(5, &device, 5), "cruises that are not tried before edge 5");
    let axis = Axis::new(motor(0.0), bridge, Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
    let mut cruising = Device::new(&axis, 0.0, 20.0, 0.0);
    cruising.drive(0, pulse);
    assert!(cruising.recurs(0, &cruising.clone(), 0));
    let pause = Gates { a_high: false, a_low: true, ..pulse };
    cruising.cruise(0, 60, (-1e-3, 1e-3), &Pulses { period: 16, duty: 8, pause }).expect("a cruise");
    assert!(!cruising.recurs(0, &cruising.clone(), 0), "a cruise");
}
