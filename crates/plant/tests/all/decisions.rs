//! Events at an edge are decided exactly, however near to a limit.

use hpu_plant::{Axis, Band, Bridge, Device, Guard, Hand, Linear, MotionPoint, Motor, Trajectory};

const EDGE_S: f64 = 20e-9;

fn axis(hand: Hand) -> Axis {
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    };
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };
    Axis::new(motor, bridge, hand, EDGE_S, 1 << 30).unwrap()
}

#[test]
fn a_prescribed_hand_at_rest_on_a_count_boundary_stays_there_without_being_looked_at_edge_by_edge() {
    let axis = axis(Hand::Prescribed);
    let mut device = Device::new(&axis, 0.0, 0.0, 0.25);
    device.intend(0, 0.25, 0.0);
    device.drive_average(0, 0.3);
    // The low limit is inside, the high limit is not.
    assert_eq!(device.side_of_band(0, 0.25, (0.25, 0.5)), 0);
    assert_eq!(device.side_of_band(0, 0.25, (0.0, 0.25)), 1);
    let before = device.redecided();
    // A billion edges: one by one they would take minutes.
    assert_eq!(device.next_event(0, 1_000_000_000, (0.25, 0.5)), None);
    assert_eq!(device.redecided(), before);
}

/// Returns whether `numerator / 2^bits * edges` is at or beyond `limit`, computed in integers.
fn beyond(speed: f64, edge_s: f64, edges: u64, limit: f64) -> bool {
    let parts = |x: f64| ((x.to_bits() & ((1 << 52) - 1) | 1 << 52) as u128, (x.to_bits() >> 52) as i32 - 1075);
    let ((s, es), (t, et), (l, el)) = (parts(speed), parts(edge_s), parts(limit));
    // s t n 2^(es+et) against l 2^el; 53 + 53 + 20 bits fit into 128.
    let shift = el - es - et;
    assert!((0..=73).contains(&shift) && edges < 1 << 20, "{shift}");
    s * t * u128::from(edges) >= l << shift
}

#[test]
fn a_steady_motion_passes_counts_at_the_edges_that_exact_integers_say() {
    // Speed and count are chosen to meet at edges, up to the rounding of their own f64.
    let mut again = 0;
    for (speed, edges_a_count) in [(0.05, 1000u64), (0.7, 333), (1.3, 4096), (12.7, 10_007), (0.001, 511)] {
        let axis = axis(Hand::Prescribed);
        let mut device = Device::new(&axis, 0.0, speed, 0.0);
        device.intend(0, 0.0, speed);
        let count = speed * EDGE_S * edges_a_count as f64;
        let mut now = 0;
        for k in 1..40u64 {
            let (low, high) = ((k - 1) as f64 * count, k as f64 * count);
            let guess = k * edges_a_count;
            let expected = (guess - 1..=guess + 1).find(|&n| beyond(speed, EDGE_S, n, high)).unwrap();
            let found = device.next_event(now, guess + 50, (low, high)).unwrap().0;
            assert_eq!(found, expected, "count {k} at {speed} rad/s");
            // A caller that comes edge by edge gets the same decisions.
            let x = device.state(expected);
            assert!(!device.is_surely_within(expected, x[2], (low, high)), "count {k} at {speed} rad/s");
            assert_eq!(device.side_of_band(expected, x[2], (low, high)), 1);
            let x = device.state(expected - 1);
            assert_eq!(device.side_of_band(expected - 1, x[2], (low, high)), 0);
            now = found;
            // So does a search that is the first of its motion.
            let mut fresh = Device::new(&axis, 0.0, speed, 0.0);
            fresh.intend(0, 0.0, speed);
            assert_eq!(fresh.next_event(0, guess + 50, (-1.0, high)).map(|event| event.0), Some(expected));
            // So does a search after one of a motion whose values were exact.
            let mut rested = Device::new(&axis, 0.0, 0.0, 0.0);
            rested.intend(0, 0.0, 0.0);
            assert_eq!(rested.next_event(0, 1 << 20, (-1.0, high)), None);
            rested.intend(1, 0.0, speed);
            assert_eq!(rested.next_event(1, guess + 51, (-1.0, high)).map(|event| event.0), Some(expected + 1));
            // So does a search for one edge, which looks for the next count too.
            let mut rested = Device::new(&axis, 0.0, 0.0, 0.0);
            rested.intend(0, 0.0, 0.0);
            rested.drive_average(0, 0.0);
            assert_eq!(rested.next_event(0, 1 << 20, (0.0, high)), None);
            rested.intend(1, 0.0, speed);
            assert_eq!(rested.next_event(1, 2, (0.0, high)), None);
            assert_eq!(rested.next_event(1, guess + 51, (0.0, high)).map(|event| event.0), Some(expected + 1));
        }
        again += device.redecided();
    }
    assert!(again > 100, "{again}: these are ties for f64");
}

#[test]
fn the_first_exit_is_exact_at_limits_that_f64_values_touch() {
    // x' = 1 from x = 1: x(n) = 1 + n 2^-30; limits between the f64 around these values are decided to the last bit.
    let a = [[0.0; 4], [0.0; 4], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
    let system = Linear::new(a, 2f64.powi(-30), 1 << 20);
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let motion = Trajectory::new(&system, [0.0, 1.0, 1.0, 0.0], [0.0; 4]);
    for n in [1u64, 2, 127, 128, 129, 16_383, 16_384, 99_999] {
        let at = 1.0 + n as f64 * 2f64.powi(-30);
        for (limit, open, expected) in
            [(at, true, n), (at, false, n + 1), (at.next_down(), false, n), (at.next_up(), true, n + 1)]
        {
            let band = Band { low: f64::NEG_INFINITY, high: limit, open };
            let found = guard.first(&motion, &band, &MotionPoint::of(&motion, 0), &MotionPoint::of(&motion, 200_000));
            assert_eq!(found, Some(expected), "{n}, {limit:e}, {open}");
        }
    }
}

#[test]
fn a_value_that_leaves_a_limit_and_falls_back_is_found_at_the_edge_that_exact_integers_say() {
    // x = s t - t²/2 on a clock of 2^-30 s: with s = n 2^-31 it begins at 0 and is back there at edge n exactly.
    let a = [[0.0; 4], [0.0; 4], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
    let system = Linear::new(a, 2f64.powi(-30), 1 << 20);
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    for n in [1u64, 2, 3, 7, 63, 64, 65, 127, 128, 129, 1000, 16_384, 99_999] {
        let speed = n as f64 * 2f64.powi(-31);
        for rising in [1.0, -1.0] {
            let motion = Trajectory::new(&system, [0.0, rising * speed, 0.0, 0.0], [0.0, -rising, 0.0, 0.0]);
            let above = Band { low: 0.0, high: f64::INFINITY, open: false };
            let below = Band { low: f64::NEG_INFINITY, high: 0.0, open: false };
            let band = if rising > 0.0 { above } else { below };
            for to in [n, n + 1, n + 2, 2 * n + 40, 200_000] {
                let [from, to] = [0, to].map(|edge| MotionPoint::of(&motion, edge));
                let expected = (to.edge > n).then_some(n + 1);
                assert_eq!(guard.first(&motion, &band, &from, &to), expected, "{n} {rising} to {}", to.edge);
            }
        }
    }
}

#[test]
fn a_count_that_a_search_has_found_ahead_is_forgotten_when_the_drive_changes() {
    let motor = Motor {
        resistance_ohm: 2.35,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    };
    let axis = Axis::amplified(motor, Hand::Torque(0.0), EDGE_S, 1 << 30).unwrap();
    let band_rad = (0.0, 1.534e-3);
    let next = |asked: bool, current_a: f64| {
        // The count is 40 edges away: a search for one edge looks further than that.
        let mut device = Device::new(&axis, 0.0, 150.0, 1.414e-3);
        if asked {
            assert_eq!(device.next_event(0, 1, band_rad), None);
        }
        device.drive_current(1, current_a);
        device.next_event(1, 4000, band_rad).unwrap().0
    };
    let (coasting, braked) = (next(true, 0.0), next(true, -3e3));
    assert!(braked > coasting + 3, "{coasting} {braked}");
    assert_eq!((coasting, braked), (next(false, 0.0), next(false, -3e3)));
}
