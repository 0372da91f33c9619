//! A motor of three phases against an integration with 40 digits, `testbench/record/pmsm.txt`.

use hpu_plant::network::{Body, Joint, Network, Sensed, Stop};
use hpu_plant::pmsm::{Harmonic, Inverter, Pmsm, PmsmDevice, PmsmMotor};
use hpu_plant::{Drive, Hand, Leg, Push};

use crate::pmsm::{ANYWHERE, BARE, motor};

/// The cases of the oracle, with the hand's intended angle.
fn case(name: &str) -> (u64, Pmsm, [f64; 3]) {
    let plain = motor();
    let harmonics = |of: &[(u32, f64, f64)]| {
        of.iter().map(|&(order, amplitude_nm, phase_rad)| Harmonic { order, amplitude_nm, phase_rad }).collect()
    };
    let (free, edge_s) = (Hand::Torque(0.0), 2f64.powi(-43));
    let laws = |motor, inverter, hand| Pmsm::new(motor, inverter, hand, edge_s).unwrap();
    match name {
        "surface" => {
            let inverter = Inverter { diode_drop_v: 0.7, on_resistance_ohm: 0.02, supply_ohm: 0.05, ..BARE };
            (1, laws(plain, inverter, free), [20.0, 0.3, 0.0])
        }
        "salient" => {
            let cogging = harmonics(&[(42, 1e-3, 0.5), (84, -0.5e-3, 1.0), (14, 0.2e-3, 0.0)]);
            let motor = PmsmMotor {
                direct_h: 0.3e-3,
                quadrature_h: 0.5e-3,
                coulomb_nm: 2e-3,
                stiction_nm: 3e-3,
                cogging,
                ..plain
            };
            let inverter = Inverter { diode_drop_v: 0.7, on_resistance_ohm: 0.03, supply_ohm: 0.1, ..BARE };
            (2, laws(motor, inverter, free), [-15.0, 1.2, 0.0])
        }
        "spun" => {
            let motor = PmsmMotor { direct_h: 0.5e-3, quadrature_h: 0.4e-3, inertia_kg_m2: 1e-4, ..plain };
            let inverter = Inverter { diode_drop_v: 0.6, supply_ohm: 0.02, ..BARE };
            (3, laws(motor, inverter, free), [520.0, 0.0, 0.0])
        }
        "held" => {
            let cogging = harmonics(&[(12, 3e-3, 0.2)]);
            let motor = PmsmMotor { coulomb_nm: 4e-3, stiction_nm: 6e-3, inertia_kg_m2: 4e-6, cogging, ..plain };
            let inverter = Inverter { diode_drop_v: 0.5, on_resistance_ohm: 0.01, ..BARE };
            let hand = Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 2e-4 });
            (4, laws(motor, inverter, hand), [0.5, -0.2, -0.1])
        }
        "knob" => {
            let cogging = harmonics(&[(42, 1e-3, 0.5)]);
            let motor = PmsmMotor {
                direct_h: 0.3e-3,
                coulomb_nm: 1e-3,
                stiction_nm: 2e-3,
                inertia_kg_m2: 4e-6,
                cogging,
                ..plain
            };
            let inverter = Inverter { diode_drop_v: 0.7, on_resistance_ohm: 0.02, supply_ohm: 0.05, ..BARE };
            let mut network = Network::of_rotor(Hand::Torque(2e-2));
            network.bodies.push(Body { inertia: 8e-6, viscous: 1e-5, speed: 3.0, ..Body::default() });
            network.joints.push(Joint { from: 0, to: 1, ratio: 0.5, compliance: Some((2.0, 1e-4)) });
            network.stops.push(Stop { body: 1, low: -0.02, high: 0.02, stiffness: 15.0, damping: 5e-4 });
            network.sensed.push(Sensed { body: 1, lag_rad_per_s: None });
            network.grip = 1;
            (5, Pmsm::around(motor, inverter, &network, edge_s).unwrap(), [6.0, 0.0, 0.0])
        }
        name => panic!("no case {name}"),
    }
}

/// Random numbers, as the oracle draws them.
struct SplitMix(u64);

impl SplitMix {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((u128::from(z ^ (z >> 31)) * u128::from(bound)) >> 64) as u64
    }
}

const PERIOD: u64 = (1 << 43) / 20_000;
const DEAD: u64 = (1 << 43) / 1_000_000;

/// The oracle's switchings.
fn switchings(seed: u64, periods: u64) -> Vec<(u64, [Leg; 3])> {
    let (mut random, mut legs) = (SplitMix(seed), [Leg::Low; 3]);
    let mut given = vec![(0, legs)];
    for period in 0..periods {
        let (begin, kind, mut changes) = (period * PERIOD, random.below(8), Vec::new());
        for x in 0..3u64 {
            let on = PERIOD / 10 + random.below(PERIOD / 10 * 8);
            let rise = begin + (PERIOD - on) / 2;
            let fall = rise + on;
            if kind == 0 || kind == 1 + x {
                changes.push((begin + 1 + x, x, Leg::Open));
                continue;
            }
            if legs[x as usize] == Leg::Open {
                changes.push((begin + 1 + x, x, Leg::Low));
            }
            let pairs = [(rise, Leg::Open), (rise + DEAD, Leg::High), (fall, Leg::Open), (fall + DEAD, Leg::Low)];
            changes.extend(pairs.map(|(edge, leg)| (edge, x, leg)));
        }
        changes.sort_by_key(|&(edge, x, _)| (edge, x));
        for (edge, x, leg) in changes {
            legs[x as usize] = leg;
            given.push((edge, legs));
        }
    }
    given
}

/// Every state of the record within 10^-13 of its size, and every change of the circuit within an edge of 2^-43 s.
#[test]
fn motions_are_those_of_forty_digits() {
    let record = include_str!("../../../../testbench/record/pmsm.txt");
    for text in record.split("\ncase ").skip(1) {
        let name = text.lines().next().unwrap();
        let mut states = Vec::new();
        let mut changes = Vec::new();
        for line in text.lines().skip(1) {
            let words: Vec<&str> = line.split(' ').collect();
            match words[0] {
                "state" => states.push((
                    words[1].parse::<u64>().unwrap(),
                    words[2..].iter().map(|x| x.parse().unwrap()).collect::<Vec<f64>>(),
                )),
                "change" => changes.push(words[1].parse::<u64>().unwrap()),
                word => panic!("{word}"),
            }
        }
        let periods = states.last().unwrap().0;
        let (seed, laws, [speed, angle, intent]) = case(name);
        let mut device = PmsmDevice::new(&laws, [0.0; 2], speed, angle);
        device.intend(0, intent, 0.0);
        let (mut edge, mut worst) = (0, 0.0f64);
        let mut due = changes.iter();
        let mut shown = states.iter();
        let mut ends: Vec<(u64, Option<[Leg; 3]>)> =
            switchings(seed, periods).into_iter().map(|(edge, legs)| (edge, Some(legs))).collect();
        ends.extend(states.iter().map(|(period, _)| (period * PERIOD, None)));
        ends.sort_by_key(|(edge, legs)| (*edge, legs.is_some()));
        for (to, legs) in ends {
            while let Some(event) = device.next_event(edge, to, ANYWHERE) {
                let before = device.circuit_changes();
                device.step(event);
                for _ in before..device.circuit_changes() {
                    let expected = *due.next().unwrap();
                    assert!(event.abs_diff(expected) <= 1, "{name}: a change at {event} instead of {expected}");
                }
                edge = event;
            }
            edge = to;
            if let Some(legs) = legs {
                device.driven(to, Drive::Legs(legs));
                continue;
            }
            let (period, expected) = shown.next().unwrap();
            let [direct, across] = device.dq(to);
            let [_, speed, angle, _] = device.state(to);
            let sizes = [1.0f64, 1.0, 10.0, 1.0, 1.0];
            let mut states = vec![direct, across, speed, angle];
            if expected.len() > 4 {
                states.push(device.reading_of(0, to));
            }
            for (k, got) in states.into_iter().enumerate() {
                let off = (got - expected[k]).abs() / sizes[k].max(expected[k].abs());
                worst = worst.max(off);
                assert!(off <= 1e-13, "{name}, period {period}, state {k}: {got} instead of {}", expected[k]);
            }
        }
        assert_eq!(due.next(), None, "{name}");
        println!("{name}: {} changes, {periods} periods, worst {worst:e}", changes.len());
        assert_eq!(device.crowded_edges(), 0);
    }
}
