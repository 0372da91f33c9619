//! The motor against the known answers of its set of data, closed forms and its own energy balance.

use hpu_plant::{Axis, Band, Bridge, Device, Gates, Guard, Hand, Linear, MotionPoint, Motor, Push, Trajectory};

const EDGE_S: f64 = 20e-9;
/// A band of angles that no test leaves.
const ANYWHERE: (f64, f64) = (-1e6, 1e6);

fn motor() -> Motor {
    Motor {
        resistance_ohm: 25.9e-3 * 24.0 / 0.265,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    }
}

const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.0, diode_drop_v: 0.7, dead_band_v: 0.0 };
/// Positive voltage at the motor.
const FORWARD: Gates = Gates { a_high: false, a_low: true, b_high: true, b_low: false };
const BRAKE: Gates = Gates { a_high: false, a_low: true, b_high: false, b_low: true };

fn close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

#[test]
fn a_step_of_24_volts_gives_the_known_currents_and_speeds() {
    let axis = Axis::new(motor(), BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive(0, FORWARD);
    for (time_s, current_a, speed) in [
        (1e-4, 6.58422351, 7.29497356),
        (1e-3, 8.62207691, 161.758485),
        (1e-2, 1.2951038, 811.681415),
        (2.0, 0.0463004626, 922.447677),
    ] {
        let x = device.state((time_s / EDGE_S).round() as u64);
        close(x[0], current_a, 1e-8);
        close(x[1], speed, 1e-8);
    }
}

#[test]
fn the_angle_follows_the_closed_form_of_the_two_poles() {
    let axis = Axis::new(motor(), BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.drive(0, FORWARD);
    let m = motor();
    // ω(t) = ω∞ (1 + (p2 e^{p1 t} - p1 e^{p2 t}) / (p1 - p2)), the response of a two-pole system from rest.
    let (l, j) = (m.inductance_h, m.inertia_kg_m2);
    let half = 0.5 * (m.resistance_ohm / l + m.viscous_nm_s_per_rad / j);
    let gain = (m.resistance_ohm * m.viscous_nm_s_per_rad + m.torque_constant_nm_per_a.powi(2)) / (l * j);
    let root = (half * half - gain).sqrt();
    let (p1, p2) = (-half + root, -half - root);
    close(p2, -10165.8878, 1e-8);
    close(p1, -214.089291, 1e-8);
    let last = 24.0 * m.torque_constant_nm_per_a / (l * j) / gain;
    for edges in [1u64, 63, 64, 4097, 123_456, 7_654_321] {
        let t = edges as f64 * EDGE_S;
        let angle = last * (t + (p2 / p1 * (p1 * t).exp_m1() - p1 / p2 * (p2 * t).exp_m1()) / (p1 - p2));
        // For short times the closed form itself loses digits by cancellation, to the third order.
        let digits = 1e-12 + 1e-15 / (10_000.0 * t).powi(3).min(1.0);
        close(device.state(edges)[2], angle, digits.min(1.0));
    }
}

#[test]
fn leaps_of_any_length_agree_with_single_steps() {
    let axis = Axis::new(
        motor(),
        BRIDGE,
        Hand::Spring(Push { stiffness_nm_per_rad: 0.02, damping_nm_s_per_rad: 1e-4 }),
        EDGE_S,
        1 << 29,
    )
    .unwrap();
    let mut device = Device::new(&axis, 0.3, -4.0, 0.1);
    device.drive(0, FORWARD);
    let mut stepped = Device::new(&axis, 0.3, -4.0, 0.1);
    stepped.drive(0, FORWARD);
    for edge in 1..=20_000u64 {
        // Setting the intention anew moves the anchor to every edge.
        let x = stepped.state(edge);
        stepped.intend(edge, x[3], 0.0);
        let leapt = device.state(edge);
        assert_eq!(device.state_next(edge), leapt);
        for k in 0..3 {
            assert!((x[k] - leapt[k]).abs() <= 1e-11 * (1.0 + x[k].abs()), "state {k} at {edge}: {x:?} {leapt:?}");
        }
    }
    let (leapt, stepwise) = (device.energy(20_000), stepped.energy(20_000));
    close(leapt.copper_j(), stepwise.copper_j(), 1e-11);
    close(leapt.hand_j(), stepwise.hand_j(), 1e-10);
    close(leapt.source_j(), stepwise.source_j(), 1e-11);
    close(leapt.viscous_j(), stepwise.viscous_j(), 1e-11);
}

/// Moves a device through its own events, with gates switched at a fixed rhythm.
fn switch(device: &mut Device, edges: u64, on: u64, off: u64, on_gates: Gates, off_gates: Gates) {
    let (mut now, mut next, mut high) = (0, 0, false);
    while now < edges {
        if now == next {
            high = !high;
            device.drive(now, if high { on_gates } else { off_gates });
            next = now + if high { on } else { off };
        }
        let to = next.min(edges);
        match device.next_event(now, to, ANYWHERE) {
            Some(event) => {
                device.arrive(event);
                now = event.0;
            }
            None => now = to,
        }
    }
}

fn residual(device: &Device, edge: u64) -> f64 {
    let energy = device.energy(edge);
    (energy.supplied_j() - device.stored_j(edge) - energy.dissipated_j()).abs() / energy.exchanged_j()
}

#[test]
fn energy_balances_through_stick_slip_diodes_and_brakes() {
    let friction = Motor { coulomb_nm: 2e-3, ..motor() };
    let push = Hand::Spring(Push { stiffness_nm_per_rad: 0.05, damping_nm_s_per_rad: 2e-4 });
    let bridge = Bridge { on_resistance_ohm: 0.33, ..BRIDGE };
    let mut mode_changes = 0;
    for (hand, off) in [
        (Hand::Torque(3e-3), BRAKE),
        (Hand::Torque(0.0), Gates::default()),
        (push, Gates::default()),
        (push, Gates { a_high: true, a_low: false, b_high: false, b_low: false }),
        (Hand::Torque(-1e-2), Gates { a_high: true, a_low: false, b_high: false, b_low: true }),
    ] {
        let axis = Axis::new(friction, bridge, hand, EDGE_S, 1 << 29).unwrap();
        let mut device = Device::new(&axis, 0.0, -3.0, 0.2);
        device.intend(0, 0.1, 1.5);
        switch(&mut device, 10_000_000, 300, 3796, FORWARD, off);
        mode_changes += device.mode_changes();
        let got = residual(&device, 10_000_000);
        assert!(got < 1e-11, "{hand:?} {off:?}: residual {got:e} of the energy exchanged");
    }
    assert!(mode_changes > 1000, "{mode_changes} mode changes");
}

#[test]
fn friction_stops_a_coasting_shaft_where_the_closed_form_says_and_holds_it() {
    // In an open circuit, J ω' = -Bω - τ_c: from ω₀ the shaft stops after t = J/B ln(1 + Bω₀/τ_c).
    let m = Motor { coulomb_nm: 1e-3, ..motor() };
    let axis = Axis::new(m, BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 50.0, 0.0);
    let (b, j) = (m.viscous_nm_s_per_rad, m.inertia_kg_m2);
    let stop_s = j / b * (b * 50.0 / m.coulomb_nm).ln_1p();
    let event = device.next_event(0, 100_000_000, ANYWHERE).unwrap();
    let edge = event.0;
    assert_eq!(edge, (stop_s / EDGE_S).ceil() as u64);
    device.arrive(event);
    assert!(device.is_stuck());
    // Angle turned: ∫ω = J/B (ω₀ - τ_c/B ln(1 + Bω₀/τ_c)).
    let angle = j / b * (50.0 - m.coulomb_nm / b * (b * 50.0 / m.coulomb_nm).ln_1p());
    close(device.state(edge)[2], angle, 1e-9);
    assert_eq!(device.next_event(edge, 1 << 28, ANYWHERE), None);
    assert_eq!(device.state(1 << 28)[2], device.state(edge)[2]);
}

#[test]
fn a_stuck_shaft_breaks_loose_when_the_hand_overcomes_friction() {
    // The hand's spring has 0.05 N·m/rad and its intention moves at 2 rad/s: 1 mN·m is reached after 10 ms, exactly at
    // an edge.
    let m = Motor { coulomb_nm: 1e-3, ..motor() };
    let push = Push { stiffness_nm_per_rad: 0.05, damping_nm_s_per_rad: 0.0 };
    let axis = Axis::new(m, BRIDGE, Hand::Spring(push), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    device.intend(0, 0.0, 2.0);
    assert!(device.is_stuck());
    let event = device.next_event(0, 100_000_000, ANYWHERE).unwrap();
    let edge = event.0;
    // 10 ms is edge 500 000, where the torque equals friction up to rounding; it exceeds friction at the next edge at
    // the latest.
    assert!((500_000..=500_001).contains(&edge), "{edge}");
    device.arrive(event);
    assert!(!device.is_stuck());
}

#[test]
fn a_floating_bridge_lets_the_current_die_through_its_diodes() {
    // -L di/dt = R i + Kω + U + 2 V_d: with a shaft held still, a current i₀ is gone after τ ln(1 + R i₀/(U + 2 V_d)).
    let axis = Axis::new(motor(), BRIDGE, Hand::Prescribed, EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 5.0, 0.0, 0.0);
    let m = motor();
    let gone_s = m.inductance_h / m.resistance_ohm * (m.resistance_ohm * 5.0 / (24.0 + 1.4)).ln_1p();
    let event = device.next_event(0, 1 << 20, ANYWHERE).unwrap();
    let edge = event.0;
    assert_eq!(edge, (gone_s / EDGE_S).ceil() as u64);
    device.arrive(event);
    assert_eq!(device.state(edge)[0], 0.0);
    assert_eq!(device.state(edge + 1000)[0], 0.0);
    assert!(device.energy(edge).source_j() < 0.0, "the coil gives its energy back to the supply");
    assert!(residual(&device, edge) < 1e-12);
}

#[test]
fn the_next_encoder_edge_is_the_one_that_scanning_every_clock_finds() {
    let m = Motor { coulomb_nm: 0.5e-3, ..motor() };
    let push = Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-6 });
    let axis = Axis::new(m, BRIDGE, push, EDGE_S, 1 << 29).unwrap();
    let mut searched = Device::new(&axis, 0.0, 12.0, 0.0);
    let mut scanned = Device::new(&axis, 0.0, 12.0, 0.0);
    let count = std::f64::consts::TAU / 4096.0;
    let band = |angle: f64| {
        let c = (angle / count).floor();
        (c * count, (c + 1.0) * count)
    };
    let mut now = 0;
    let mut limits = band(0.0);
    let mut events = 0;
    while now < 4_000_000 {
        let to = (now + 50_000).min(4_000_000);
        let found = searched.next_event(now, to, limits);
        let modes = scanned.mode_changes();
        let mut first = None;
        for edge in now + 1..=to {
            let x = scanned.step(edge);
            if scanned.mode_changes() != modes || x[2] >= limits.1 || x[2] < limits.0 {
                first = Some(edge);
                break;
            }
        }
        assert_eq!(found.map(|event| event.0), first);
        let x = match found {
            Some(event) => searched.arrive(event),
            None => searched.state(to),
        };
        now = found.map_or(to, |event| event.0);
        assert_eq!(x, scanned.state(now));
        limits = band(x[2]);
        events += u64::from(found.is_some());
    }
    assert!(events > 50, "{events} events");
}

#[test]
fn guards_find_the_first_of_many_close_crossings() {
    // An undamped oscillator, x = sin(1000 t): thresholds near its crest are passed twice a period, for a short time.
    let a = [[0.0; 4], [0.0, 0.0, -1e6, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
    let system = Linear::new(a, 1e-7, 1 << 29);
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let motion = Trajectory::new(&system, [0.0, 1000.0, 0.0, 0.0], [0.0; 4]);
    for threshold in [0.1, 0.9, 0.999_999, 1.0 - 1e-9, -0.5] {
        for band in [
            Band { low: f64::NEG_INFINITY, high: threshold, open: true },
            Band { low: threshold, high: f64::INFINITY, open: false },
            Band { low: threshold - 0.1, high: threshold, open: true },
        ] {
            let left = |n: u64| band.left_by(guard.value(&motion.at(n)));
            let mut from = 0;
            for _ in 0..12 {
                while left(from) {
                    from += 1;
                }
                let to = from + 150_000;
                let scan = (from + 1..=to).find(|&n| left(n));
                let found = guard.first(&motion, &band, &MotionPoint::of(&motion, from), &MotionPoint::of(&motion, to));
                assert_eq!(found, scan, "{band:?} from {from}");
                from = found.unwrap_or(to);
            }
        }
    }
}
