//! Leaps over whole periods of a modulator, against the same gates switched one by one and against steps of an edge.

use hpu_plant::{Axis, Bridge, Device, Energy, Gates, Hand, Motor, Pulses, Push};

use crate::random::Random;

const EDGE_S: f64 = 20e-9;
const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.3, diode_drop_v: 0.7, dead_band_v: 0.0 };
const FORWARD: Gates = Gates { a_high: false, a_low: true, b_high: true, b_low: false };
const BACKWARD: Gates = Gates { a_high: true, a_low: false, b_high: false, b_low: true };
const BRAKE: Gates = Gates { a_high: false, a_low: true, b_high: false, b_low: true };
const ANYWHERE: (f64, f64) = (-1e6, 1e6);
const PERIOD: u64 = 4096;

fn motor(coulomb_nm: f64) -> Motor {
    Motor {
        resistance_ohm: 2.35,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm,
    }
}

const SPRING: Hand = Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 });

/// A device in motion, with the pulses of its gates.
#[derive(Clone)]
struct Case<'a> {
    device: Device<'a>,
    pulse: Gates,
    pulses: Pulses,
}

impl<'a> Case<'a> {
    /// Creates a case from a state, at edge 0 in a pulse.
    fn new(axis: &'a Axis, [current_a, speed, angle_rad]: [f64; 3], duty: u64, pulse: Gates, pause: Gates) -> Self {
        let mut device = Device::new(axis, current_a, speed, angle_rad);
        device.intend(0, angle_rad + 0.02, 0.3);
        device.drive(0, pulse);
        Self { device, pulse, pulses: Pulses { period: PERIOD, duty, pause } }
    }

    /// Returns the gates from an edge on.
    fn gates(&self, edge: u64) -> Gates {
        if edge % PERIOD < self.pulses.duty { self.pulse } else { self.pulses.pause }
    }

    /// Returns the edges up to `end` at which the gates change.
    fn changes(&self, end: u64) -> impl Iterator<Item = u64> + use<> {
        let duty = self.pulses.duty;
        (0..).flat_map(move |k| [k * PERIOD, k * PERIOD + duty]).skip(1).take_while(move |&edge| edge <= end)
    }
}

#[track_caller]
fn near(got: &[f64; 4], expected: &[f64; 4], what: &str) {
    for (got, expected) in got.iter().zip(expected) {
        assert!((got - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{what}: {got} is not {expected}");
    }
}

#[track_caller]
fn same_energy(got: &Energy, expected: &Energy, what: &str) {
    let flows = |e: &Energy| [e.source_j(), e.hand_j(), e.copper_j(), e.viscous_j(), e.coulomb_j(), e.diodes_j()];
    for (got, other) in flows(got).into_iter().zip(flows(expected)) {
        let allowed = 1e-11 * expected.exchanged_j();
        assert!((got - other).abs() <= allowed, "{what}: {got} J is not {other} J within {allowed:e} J");
    }
}

/// Returns every kind of axis whose circuit stays closed, with an initial state; the cruise must find how long the
/// modes last.
fn axes() -> Vec<(&'static str, Axis, [f64; 3])> {
    let axis = |coulomb_nm, hand| Axis::new(motor(coulomb_nm), BRIDGE, hand, EDGE_S, 1 << 29).unwrap();
    vec![
        ("free", axis(0.0, Hand::Torque(0.01)), [0.4, 3.0, 0.1]),
        ("held", axis(0.0, SPRING), [-1.0, 2.0, 0.7]),
        ("sliding", axis(1e-3, SPRING), [0.5, 300.0, 0.1]),
        ("stuck", axis(1.0, SPRING), [0.0, 0.0, 0.1]),
        ("prescribed", axis(1e-3, Hand::Prescribed), [0.3, 5.0, 0.1]),
        ("creeping", axis(1e-3, SPRING).with_smoothed_friction(50.0).unwrap(), [0.1, 0.5, 0.1]),
    ]
}

#[test]
fn states_and_energies_are_those_of_gates_switched_one_by_one() {
    for (name, axis, start) in axes() {
        for (pulse, pause) in [(FORWARD, BRAKE), (BACKWARD, BRAKE), (FORWARD, BACKWARD)] {
            for duty in [1, 2, 127, 128, 900, 2048, 4095] {
                let what = format!("{name}, {duty} edges of {pulse:?} then {pause:?}");
                let mut case = Case::new(&axis, start, duty, pulse, pause);
                let mut plain = case.clone();
                let last = 40 * PERIOD + 17;
                let Some(end) = case.device.cruise(0, last, ANYWHERE, &case.pulses) else {
                    panic!("{what}: no cruise");
                };
                assert!((2 * PERIOD..=last).contains(&end), "{what}: to {end}");
                let mut at = 0;
                for edge in plain.changes(end) {
                    let mut looks = [at, at + 1, at + (edge - at) / 3, edge - 1, edge];
                    looks.sort_unstable();
                    for look in looks {
                        near(&case.device.state(look), &plain.device.flow(at, look), &format!("{what}, edge {look}"));
                        at = look;
                        same_energy(&case.device.energy(look), &plain.device.energy(look), &what);
                    }
                    let (mut leaving, gates) = (case.device.clone(), plain.gates(edge));
                    plain.device.drive(edge, gates);
                    case.device.drive(edge, gates);
                    near(&case.device.state(edge), &plain.device.state(edge), &what);
                    // A device that is driven otherwise than foreseen continues as if there had been no cruise.
                    leaving.drive_average(edge, 0.25);
                    let mut other = plain.device.clone();
                    other.drive_average(edge, 0.25);
                    near(&leaving.state(edge + 999), &other.state(edge + 999), &what);
                    same_energy(&leaving.energy(edge + 999), &other.energy(edge + 999), &what);
                }
                assert_eq!(plain.device.mode_changes(), case.device.mode_changes(), "{what}");
                near(&case.device.flow(at, end), &plain.device.flow(at, end), &format!("{what}, its end"));
                same_energy(&case.device.energy(end), &plain.device.energy(end), &format!("{what}, its end"));
                near(&case.device.state(end + 99), &plain.device.state(end + 99), &format!("{what}, after it"));
                assert_eq!(case.device.drive_now(), plain.device.drive_now(), "{what}: driven at {end}");
            }
        }
    }
}

#[test]
fn gates_that_change_where_it_ends_are_set() {
    for (name, axis, start) in axes() {
        for (duty, last) in [(900, 6 * PERIOD), (900, 6 * PERIOD + 900), (2048, 4 * PERIOD + 2048)] {
            let mut case = Case::new(&axis, start, duty, FORWARD, BRAKE);
            let mut plain = case.clone();
            assert_eq!(case.device.cruise(0, last, ANYWHERE, &case.pulses), Some(last), "{name}");
            let mut at = 0;
            for edge in plain.changes(last) {
                let gates = plain.gates(edge);
                for device in [&mut case.device, &mut plain.device] {
                    device.flow(at, edge);
                    device.drive(edge, gates);
                }
                at = edge;
            }
            assert_eq!(at, last, "{name}: a change");
            near(&case.device.flow(last, last + 500), &plain.device.flow(last, last + 500), name);
            same_energy(&case.device.energy(last + 500), &plain.device.energy(last + 500), name);
        }
    }
}

#[test]
fn gates_as_foreseen_that_are_set_where_it_ends_end_it() {
    for (name, axis, start) in axes() {
        for last in [3 * PERIOD + 300, 4 * PERIOD, 5 * PERIOD + 2000] {
            let mut case = Case::new(&axis, start, 900, FORWARD, BRAKE);
            let mut plain = case.clone();
            assert_eq!(case.device.cruise(0, last, ANYWHERE, &case.pulses), Some(last), "{name}");
            let mut at = 0;
            for edge in plain.changes(last) {
                plain.device.flow(at, edge);
                plain.device.drive(edge, plain.gates(edge));
                at = edge;
            }
            plain.device.flow(at, last);
            case.device.drive(last, plain.gates(last));
            // From here on the device is driven otherwise than the cruise repeats: the gates stay.
            let angle_rad = plain.device.state(last)[2];
            let band_rad = (angle_rad - 1e-6, angle_rad + 1e-6);
            let mut stepped = plain.device.clone();
            let modes = stepped.mode_changes();
            let expected = (last + 1..=last + 9000).find(|&edge| {
                let is_inside = (band_rad.0..band_rad.1).contains(&stepped.step(edge)[2]);
                !is_inside || stepped.mode_changes() != modes
            });
            let found = case.device.next_event(last, last + 9000, band_rad).map(|event| event.0);
            assert_eq!(found, expected, "{name}, {last}");
            near(&case.device.state(last + 9000), &plain.device.state(last + 9000), name);
        }
    }
}

#[test]
fn a_cruise_that_was_refused_leaves_no_trace_in_a_search_from_any_edge() {
    let axis = Axis::new(motor(0.0), BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 24).unwrap();
    let mut refused = 0;
    for (pulse, speed) in [(FORWARD, -0.03), (BACKWARD, 0.03)] {
        let mut plain = Device::new(&axis, 0.0, speed, 0.0);
        plain.drive(0, pulse);
        let angles: Vec<f64> = (0..800).map(|edge| plain.state(edge)[2]).collect();
        // In some of these bands the angle begins inside, but the smooth motion soon leaves the narrowed one.
        for step in 0..70 {
            let reach = 5e-6 * 1.02f64.powi(step);
            let mut device = plain.clone();
            let pulses = Pulses { period: PERIOD, duty: 900, pause: BRAKE };
            if device.cruise(0, 40 * PERIOD, (-reach, reach), &pulses).is_some() {
                continue;
            }
            refused += 1;
            // The pulse goes on. From each edge on, the angle leaves bands around it where the states do.
            for begin in 1..600 {
                for (below, above) in [(1e-7, 1e-7), (5e-6, 1e-8), (1e-8, 5e-6)] {
                    let now_rad = angles[begin as usize];
                    let band_rad = (now_rad - below, now_rad + above);
                    let is_outside = |edge: &u64| !(band_rad.0..band_rad.1).contains(&angles[*edge as usize]);
                    let expected = (begin + 1..=begin + 150).find(is_outside);
                    let found = device.clone().next_event(begin, begin + 150, band_rad);
                    let what = format!("{pulse:?}, {reach} rad, from {begin} in {band_rad:?}");
                    assert_eq!(found.map(|event| event.0), expected, "{what}");
                }
            }
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn each_of_many_cruises_has_the_ripple_of_its_own_pulses() {
    let patterns = [(FORWARD, BRAKE), (BACKWARD, BRAKE), (FORWARD, BACKWARD), (FORWARD, BRAKE)];
    for (name, axis, [current_a, speed, angle_rad]) in axes() {
        let begun = Device::new(&axis, current_a, speed, angle_rad);
        let (mut device, mut plain) = (begun.clone(), begun);
        let (mut begin, mut cruises) = (0, 0);
        for (index, (pulse, pause)) in patterns.into_iter().cycle().take(24).enumerate() {
            // Duties, voltages and periods change one at a time and together.
            let duty = [900, 2000, 2000, 900, 100][index % 5];
            let period = if index % 7 == 6 { PERIOD / 2 } else { PERIOD };
            let pulses = Pulses { period, duty, pause };
            let end = begin + 5 * period;
            device.drive(begin, pulse);
            plain.drive(begin, pulse);
            cruises += u64::from(device.cruise(begin, end, ANYWHERE, &pulses).is_some());
            for edge in (begin..end).step_by(period as usize) {
                for (from, to, gates) in [(edge, edge + duty, pause), (edge + duty, edge + period, pulse)] {
                    for device in [&mut device, &mut plain] {
                        device.flow(from, to);
                        if to < end {
                            device.drive(to, gates);
                        }
                    }
                }
            }
            near(&device.state(end), &plain.state(end), &format!("{name}, {index}"));
            same_energy(&device.energy(end), &plain.energy(end), &format!("{name}, {index}"));
            begin = end;
        }
        assert!(cruises >= 8, "{name}: {cruises}");
    }
}

#[test]
fn it_repeats_pulses_of_the_period_asked_for_whatever_was_asked_before() {
    for (name, axis, start) in axes() {
        let mut before = Case::new(&axis, start, 900, FORWARD, BRAKE);
        assert!(before.device.cruise(0, 10 * PERIOD, ANYWHERE, &before.pulses).is_some(), "{name}");
        for period in [PERIOD / 2, PERIOD - 1, PERIOD + 1, 2 * PERIOD] {
            let mut device = before.device.clone();
            let begin = 10 * PERIOD;
            device.flow(0, begin);
            device.drive(begin, FORWARD);
            let mut plain = device.clone();
            // Between gates that are not told, the device goes on by itself, if it has said so.
            let pulses = Pulses { period, duty: 900, pause: BRAKE };
            let Some(end) = device.cruise(begin, begin + 10 * period, ANYWHERE, &pulses) else { continue };
            let mut at = begin;
            while at + period <= end {
                plain.flow(at, at + 900);
                plain.drive(at + 900, BRAKE);
                near(&device.state(at + 900), &plain.state(at + 900), &format!("{name}, {period}"));
                plain.flow(at + 900, at + period);
                plain.drive(at + period, FORWARD);
                near(&device.state(at + period), &plain.state(at + period), &format!("{name}, {period}"));
                at += period;
            }
        }
    }
}

#[test]
fn a_cruise_of_a_shaft_that_slips_does_not_have_the_ripple_of_the_shaft_that_was_stuck() {
    let axis = Axis::new(motor(20e-3), BRIDGE, SPRING, EDGE_S, 1 << 24).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.1);
    device.intend(0, 0.1, 0.0);
    let mut plain = device.clone();
    let pulses = Pulses { period: PERIOD, duty: 100, pause: BRAKE };
    // The same pulses twice; in between the hand moves on and pulls the shaft away.
    for (begin, is_stuck) in [(0, true), (6 * PERIOD, false)] {
        for device in [&mut device, &mut plain] {
            device.drive(begin, FORWARD);
            assert_eq!(device.is_stuck(), is_stuck);
        }
        let end = begin + 5 * PERIOD;
        assert_eq!(device.cruise(begin, end, ANYWHERE, &pulses), Some(end));
        for edge in (begin..end).step_by(PERIOD as usize) {
            for (from, to, gates) in [(edge, edge + 100, BRAKE), (edge + 100, edge + PERIOD, FORWARD)] {
                near(&device.flow(from, to), &plain.flow(from, to), &format!("stuck {is_stuck}, edge {to}"));
                if to < end {
                    plain.drive(to, gates);
                }
            }
        }
        for device in [&mut device, &mut plain] {
            device.intend(end, 1.1, 0.0);
            device.flow(end, end + PERIOD);
        }
    }
}

#[test]
fn a_hand_that_moves_on_in_mid_period_ends_it_where_it_is() {
    let (_, axis, start) = axes().swap_remove(1);
    for edge in [1, 899, 900, 901, 4095, 4096, 4097, 3 * 4096 + 900, 3 * 4096 + 2000] {
        let mut case = Case::new(&axis, start, 900, FORWARD, BRAKE);
        let mut plain = case.clone();
        case.device.cruise(0, 10 * PERIOD, ANYWHERE, &case.pulses).unwrap();
        let mut at = 0;
        for change in plain.changes(edge - 1) {
            plain.device.flow(at, change);
            plain.device.drive(change, plain.gates(change));
            at = change;
        }
        for device in [&mut case.device, &mut plain.device] {
            device.intend(edge, 0.9, -2.0);
            near(&device.state(edge), &device.state(edge), "itself");
        }
        assert_eq!(case.device.drive_now(), plain.device.drive_now(), "edge {edge}");
        near(&case.device.state(edge + 500), &plain.device.state(edge + 500), &format!("edge {edge}"));
        same_energy(&case.device.energy(edge + 500), &plain.device.energy(edge + 500), &format!("edge {edge}"));
    }
}

/// Makes a step of one edge by the classical Runge-Kutta method, under a voltage at the motor and with the hand's
/// spring.
fn runge_kutta([i, w, a]: [f64; 3], volts: f64, time_s: f64, intent_rad: f64) -> [f64; 3] {
    let (m, ohm) = (motor(0.0), 2.35 + 2.0 * 0.3);
    let slope = |[i, w, a]: [f64; 3], t: f64| {
        let hand_nm = 0.3 * (intent_rad + 0.3 * t - a) + 1e-4 * (0.3 - w);
        let motor_nm = m.torque_constant_nm_per_a * i - m.viscous_nm_s_per_rad * w;
        let di = (volts - ohm * i - m.torque_constant_nm_per_a * w) / m.inductance_h;
        [di, (motor_nm + hand_nm) / m.inertia_kg_m2, w]
    };
    let ahead = |k: [f64; 3], h: f64| [i + h * k[0], w + h * k[1], a + h * k[2]];
    let h = EDGE_S;
    let k1 = slope([i, w, a], time_s);
    let k2 = slope(ahead(k1, 0.5 * h), time_s + 0.5 * h);
    let k3 = slope(ahead(k2, 0.5 * h), time_s + 0.5 * h);
    let k4 = slope(ahead(k3, h), time_s + h);
    [0, 1, 2].map(|k| [i, w, a][k] + h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]))
}

#[test]
fn it_goes_where_steps_of_an_edge_go() {
    let (_, axis, start) = axes().swap_remove(1);
    let mut case = Case::new(&axis, start, 1234, BACKWARD, BRAKE);
    let end = case.device.cruise(0, 25 * PERIOD, ANYWHERE, &case.pulses).unwrap();
    assert_eq!(end, 25 * PERIOD);
    let mut x = start;
    for edge in 0..=end {
        if edge % 97 == 0 || edge % PERIOD == 0 {
            let got = case.device.state(edge);
            for (got, expected) in got.iter().zip(&x) {
                assert!(
                    (got - expected).abs() <= 3e-11 * (1.0 + expected.abs()),
                    "edge {edge}: {got} is not {expected}"
                );
            }
        }
        let volts = if edge % PERIOD < 1234 { -24.0 } else { 0.0 };
        x = runge_kutta(x, volts, edge as f64 * EDGE_S, start[2] + 0.02);
    }
}

/// Runs the periods with gates switched one by one. Returns the first edge at which a mode ends or the angle leaves the
/// band.
fn first_event(mut case: Case, end: u64, band_rad: (f64, f64)) -> Option<u64> {
    let mut at = 0;
    for edge in case.changes(end) {
        if let Some(event) = case.device.next_event(at, edge, band_rad) {
            return Some(event.0);
        }
        case.device.drive(edge, case.gates(edge));
        at = edge;
    }
    None
}

#[test]
fn nothing_that_gates_switched_one_by_one_would_meet_lies_in_a_cruise() {
    let mut random = Random(1);
    let (mut cruises, mut cut_short, mut none) = (0, 0, 0);
    let axes: Vec<_> = [0.0, 1e-3, 30e-3]
        .into_iter()
        .flat_map(|friction_nm| [SPRING, Hand::Torque(0.0)].map(|hand| (friction_nm, hand)))
        .map(|(friction_nm, hand)| Axis::new(motor(friction_nm), BRIDGE, hand, EDGE_S, 1 << 24).unwrap())
        .collect();
    for trial in 0..4000 {
        let axis = &axes[trial % 6];
        let speed = if trial % 5 == 0 { 0.0 } else { random.between(-3.0, 3.0) };
        let start = [random.between(-1.0, 1.0), speed, 0.0];
        let duty = 1 + (random.next() * 4095.0) as u64;
        let (pulse, pause) = [(FORWARD, BRAKE), (BACKWARD, BRAKE), (FORWARD, BACKWARD)][trial / 6 % 3];
        // The band ends nearby, by ever smaller shares of a count.
        let reach = 1.5e-3 * 10f64.powf(random.between(-4.0, 1.0));
        let band_rad = if trial % 2 == 0 { (-reach, 1.0) } else { (-1.0, reach) };
        let mut case = Case::new(axis, start, duty.min(4095), pulse, pause);
        let event = first_event(case.clone(), 30 * PERIOD, band_rad);
        match case.device.cruise(0, 30 * PERIOD, band_rad, &case.pulses) {
            Some(end) => {
                cruises += 1;
                cut_short += u64::from(end < 30 * PERIOD);
                assert!(event.is_none_or(|event| event > end), "trial {trial}: {event:?} in a cruise to {end}");
            }
            None => {
                none += u64::from(event.is_some_and(|event| event <= 2 * PERIOD));
                assert_eq!(first_event(case, 30 * PERIOD, band_rad), event, "trial {trial}: a try has changed it");
            }
        }
    }
    assert!(cruises > 500 && cut_short > 100 && none > 300, "{cruises} cruises, {cut_short} cut short, {none} none");
}

/// Returns the periodic motion under a hand's spring at rest, at the beginning of a pulse.
fn settled(axis: &Axis, duty: u64) -> [f64; 3] {
    let mut device = Device::new(axis, 0.0, 0.0, 0.0);
    let mut edge = 0;
    for _ in 0..40_000 {
        device.drive(edge, FORWARD);
        device.drive(edge + duty, BRAKE);
        edge += PERIOD;
    }
    let x = device.state(edge);
    [x[0], x[1], x[2]]
}

#[test]
fn a_count_that_only_the_ripple_passes_is_passed() {
    let axis = Axis::new(motor(0.0), BRIDGE, SPRING, EDGE_S, 1 << 29).unwrap();
    // With the longer pulse the shaft nearly rests where it begins: its speed does not show what is to come.
    for duty in [1000, 2150] {
        let start = settled(&axis, duty);
        let mut device = Device::new(&axis, start[0], start[1], start[2]);
        // The hand stays where the settled motion has it.
        device.intend(0, 0.0, 0.0);
        device.drive(0, FORWARD);
        let case = Case { device, pulse: FORWARD, pulses: Pulses { period: PERIOD, duty, pause: BRAKE } };
        let mut plain = case.device.clone();
        let mut angles: Vec<f64> = (0..duty).map(|edge| plain.state(edge)[2]).collect();
        plain.drive(duty, BRAKE);
        angles.extend((duty..PERIOD).map(|edge| plain.state(edge)[2]));
        let (least, most) = angles.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        let ripple = (most - angles[0]).max(angles[0] - least);
        assert!((angles[0] - plain.state(PERIOD)[2]).abs() < 1e-3 * ripple, "it is periodic");
        assert!((1e-8..1e-4).contains(&ripple), "{ripple:e}");
        let tries = |margin: f64| {
            let mut case = case.clone();
            let band_rad =
                if most - angles[0] == ripple { (-1.0, angles[0] + margin) } else { (angles[0] - margin, 1.0) };
            let event = first_event(case.clone(), 10 * PERIOD, band_rad);
            (event, case.device.cruise(0, 10 * PERIOD, band_rad, &case.pulses))
        };
        for share in [0.01, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9, 0.99] {
            let (event, cruise) = tries(share * ripple);
            assert!(
                event.is_some_and(|event| event < PERIOD) && cruise.is_none(),
                "{duty}, {share}: {event:?}, {cruise:?}"
            );
        }
        // The bound is only a small share of a count of 1.5 mrad.
        assert_eq!(tries(5e-5), (None, Some(10 * PERIOD)));
    }
}

#[test]
fn a_standstill_that_only_the_ripple_comes_to_is_come_to() {
    // On average the motor's torque equals the friction that holds; within a period it does not.
    let axis = Axis::new(motor(30e-3), BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 24).unwrap();
    let duty = 600;
    let mut begun = Device::new(&axis, 0.0, 40.0, 0.0);
    let mut edge = 0;
    for _ in 0..20 {
        begun.drive(edge, FORWARD);
        begun.flow(edge, edge + duty);
        begun.drive(edge + duty, BRAKE);
        begun.flow(edge + duty, edge + PERIOD);
        edge += PERIOD;
    }
    let current_a = begun.state(edge)[0];
    for (speed, stops) in [(0.001, true), (0.01, true), (100.0, false)] {
        let mut case = Case::new(&axis, [current_a, speed, 0.0], duty, FORWARD, BRAKE);
        let event = first_event(case.clone(), 6 * PERIOD, ANYWHERE);
        assert_eq!(event.is_some_and(|event| event < PERIOD), stops, "{speed} rad/s: {event:?}");
        let cruise = case.device.cruise(0, 6 * PERIOD, ANYWHERE, &case.pulses);
        assert_eq!(cruise.is_none(), stops, "{speed} rad/s: {cruise:?}");
    }
}

#[test]
fn diodes_in_the_pause_are_left_to_themselves() {
    let axis = Axis::new(motor(0.0), BRIDGE, Hand::Torque(0.0), EDGE_S, 1 << 24).unwrap();
    let mut case = Case::new(&axis, [0.5, 0.0, 0.0], 1000, FORWARD, Gates::default());
    assert_eq!(case.device.cruise(0, 30 * PERIOD, ANYWHERE, &case.pulses), None);
}
