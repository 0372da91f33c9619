//! A motor of three phases against closed forms.

use std::f64::consts::TAU;

use hpu_plant::pmsm::{Harmonic, Inverter, Pmsm, PmsmDevice, PmsmMotor};
use hpu_plant::{Drive, Hand, Leg, Push};

use Leg::{High, Low, Open};

pub const EDGE_S: f64 = 20e-9;
pub const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

pub fn motor() -> PmsmMotor {
    PmsmMotor {
        pole_pairs: 7,
        resistance_ohm: 0.8,
        direct_h: 0.4e-3,
        quadrature_h: 0.4e-3,
        flux_vs: 6e-3,
        inertia_kg_m2: 2e-5,
        viscous_nm_s_per_rad: 1e-5,
        coulomb_nm: 0.0,
        stiction_nm: 0.0,
        cogging: Vec::new(),
    }
}

/// An inverter without losses.
pub const BARE: Inverter = Inverter { supply_v: 24.0, supply_ohm: 0.0, on_resistance_ohm: 0.0, diode_drop_v: 0.0 };

fn laws(motor: PmsmMotor, inverter: Inverter, edge_s: f64) -> Pmsm {
    Pmsm::new(motor, inverter, Hand::Torque(0.0), edge_s).unwrap()
}

/// Moves to an edge by leaps, and returns the edges at which something happened.
pub fn leap(device: &mut PmsmDevice, from: u64, to: u64) -> Vec<u64> {
    let (mut edge, mut events) = (from, Vec::new());
    while let Some(event) = device.next_event(edge, to, ANYWHERE) {
        edge = event;
        device.step(edge);
        events.push(edge);
    }
    device.step(to);
    events
}

/// Holds what came from source and hand to heat and what is stored, up to this share of all that was exchanged.
#[track_caller]
pub fn balanced(device: &PmsmDevice, edge: u64, most: f64) {
    let energy = device.energy(edge);
    let rest = energy.supplied_j() - energy.dissipated_j() - device.stored_j(edge);
    assert!(rest.abs() <= most * energy.exchanged_j(), "{rest:e} of {:e}", energy.exchanged_j());
}

/// Returns the currents of a winding's short circuit at a constant speed of the field, a time after these: in the
/// rotor's frame two linear equations, whose complex eigenvalues are written by sine and cosine.
pub fn short_circuit(motor: &PmsmMotor, w: f64, start: [f64; 2], t: f64) -> [f64; 2] {
    let &PmsmMotor { direct_h: d, quadrature_h: q, resistance_ohm: r, flux_vs: psi, .. } = motor;
    // x' = A x + f, x = (i_d, i_q).
    let a = [[-r / d, w * q / d], [-w * d / q, -r / q]];
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let f = -w * psi / q;
    // A x0 = -f: x0 = (a01 f, -a00 f) / det.
    let rest = [a[0][1] * f / determinant, -a[0][0] * f / determinant];
    let half = 0.5 * (a[0][0] + a[1][1]);
    let frequency = (determinant - half * half).sqrt();
    let (decay, sine, cosine) = ((half * t).exp(), (frequency * t).sin(), (frequency * t).cos());
    let start = [start[0] - rest[0], start[1] - rest[1]];
    [0, 1].map(|row| {
        let turned: f64 = (0..2).map(|c| (a[row][c] - if row == c { half } else { 0.0 }) * start[c]).sum();
        rest[row] + decay * (cosine * start[row] + sine / frequency * turned)
    })
}

#[track_caller]
fn close(got: f64, expected: f64, most: f64) {
    assert!((got - expected).abs() <= most, "got {got:?}, expected {expected:?}, off by {:e}", (got - expected).abs());
}

/// With the shaft held, each phase is a resistance and an inductance: at all eight vectors the currents rise by an
/// exponential. The rail of one switch to the supply, or of two, has 2/3 of the supply's resistance along its phase.
#[test]
fn a_step_of_one_vector_on_a_held_rotor_is_an_exponential() {
    let held = PmsmMotor { stiction_nm: 1e3, ..motor() };
    let inverter = Inverter { supply_ohm: 0.3, on_resistance_ohm: 0.05, ..BARE };
    let laws = laws(held, inverter, EDGE_S);
    for vector in 0..8u32 {
        let legs = [0, 1, 2].map(|x| if vector >> x & 1 == 1 { High } else { Low });
        let high = vector.count_ones();
        let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.3);
        device.driven(0, Drive::Legs(legs));
        for edge in [1, 50, 7000, 25_000, 120_000] {
            device.step(edge);
            let got = device.phases(edge);
            for x in 0..3 {
                let share = f64::from(u8::from(legs[x] == High)) - f64::from(high) / 3.0;
                let ohm = 0.85 + 2.0 / 3.0 * 0.3;
                let expected = 24.0 * share / ohm * -(-ohm * edge as f64 * EDGE_S / 0.4e-3).exp_m1();
                close(got[x], expected, 1e-13 * (1.0 + expected.abs()));
            }
            // The energy that came from the supply is heat and the energy of the inductances.
            let energy = device.energy(edge);
            let rest = energy.source_j() - energy.copper_j() - device.stored_j(edge);
            assert!(rest.abs() <= 1e-13 * energy.exchanged_j(), "{rest:e} of {:e}", energy.exchanged_j());
        }
        assert!(device.is_stuck());
        assert_eq!(device.state(120_000)[1..3], [0.0, 0.3]);
    }
}

/// A short circuit at a speed that an immense inertia imposes.
#[test]
fn a_short_circuit_at_constant_speed_is_that_of_the_rotors_frame() {
    for (d, q, legs) in [(0.4e-3, 0.4e-3, Low), (0.3e-3, 0.5e-3, Low), (0.5e-3, 0.3e-3, High)] {
        let heavy =
            PmsmMotor { direct_h: d, quadrature_h: q, inertia_kg_m2: 1e30, viscous_nm_s_per_rad: 0.0, ..motor() };
        let (laws, speed) = (laws(heavy.clone(), BARE, EDGE_S), 150.0);
        let mut device = PmsmDevice::new(&laws, [1.0, -2.0], speed, 0.3);
        device.driven(0, Drive::Legs([legs; 3]));
        for edge in [1u64, 1000, 20_000, 50_000, 200_000] {
            leap(&mut device, 0, edge);
            let t = edge as f64 * EDGE_S;
            let expected = short_circuit(&heavy, 7.0 * speed, [1.0, -2.0], t);
            let got = device.dq(edge);
            close(got[0], expected[0], 3e-13);
            close(got[1], expected[1], 3e-13);
            let [a, b, c] = device.phases(edge);
            close(a + b + c, 0.0, 1e-14);
            close(a, got[0] * (7.0 * (0.3 + speed * t)).cos() - got[1] * (7.0 * (0.3 + speed * t)).sin(), 1e-11);
        }
    }
}

/// On a held rotor, a current that flows into phase a and out of phase b, and then through two diodes into the supply,
/// is 0 after `L/R ln(1 + 2 R i / (V + 2 V_d))`; from there on all phases float. At edges of 10^-13 s.
#[test]
fn a_current_through_diodes_ends_at_its_instant() {
    let edge_s = 1e-13;
    let held = PmsmMotor { stiction_nm: 1e3, ..motor() };
    let inverter = Inverter { diode_drop_v: 0.7, ..BARE };
    let laws = laws(held, inverter, edge_s);
    let on = 300_000_000;
    for legs in [[High, Low, Open], [Low, Open, High], [Open, High, Low], [Low, High, Open]] {
        let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 1.1);
        device.driven(0, Drive::Legs(legs));
        leap(&mut device, 0, on);
        let rate = 0.8 / 0.4e-3;
        let current = 24.0 / 1.6 * -(-rate * on as f64 * edge_s).exp_m1();
        for (x, leg) in legs.into_iter().enumerate() {
            let expected = if leg == High {
                current
            } else if leg == Low {
                -current
            } else {
                0.0
            };
            close(device.phases(on)[x], expected, 1e-13);
        }
        device.driven(on, Drive::Legs([Open; 3]));
        let ends_s = (1.6 * current / 25.4).ln_1p() / rate;
        let changes = device.mode_changes();
        let events = leap(&mut device, on, 2 * on);
        assert_eq!(device.mode_changes(), changes + 1);
        assert_eq!(device.phases(2 * on), [0.0; 3]);
        assert!(device.still(2 * on).is_some());
        let last = *events.last().unwrap();
        let expected = on + (ends_s / edge_s).ceil() as u64;
        assert!(last.abs_diff(expected) <= 1, "{last} instead of {expected}");
        let energy = device.energy(2 * on);
        let out = energy.source_j() - energy.copper_j() - energy.diodes_j() - device.stored_j(2 * on);
        assert!(out.abs() <= 1e-13 * energy.exchanged_j(), "{out:e}");
        assert!(energy.diodes_j() > 0.0);
    }
}

/// A rotor without magnets and friction swings in its cogging like a pendulum: after each period, which the
/// arithmetic-geometric mean gives, it is where it was.
#[test]
fn a_rotor_in_its_cogging_is_a_pendulum() {
    let (order, amplitude, inertia) = (12, 4e-3, 2e-5);
    let cogging = vec![Harmonic { order, amplitude_nm: amplitude, phase_rad: 0.0 }];
    let swinging = PmsmMotor { flux_vs: 0.0, viscous_nm_s_per_rad: 0.0, inertia_kg_m2: inertia, cogging, ..motor() };
    let start = 0.2;
    // n θ is the angle of a pendulum of frequency sqrt(A n / J).
    let n = f64::from(order);
    let (mut one, mut other) = (1.0, (0.5 * n * start).cos());
    for _ in 0..8 {
        (one, other) = (0.5 * (one + other), f64::sqrt(one * other));
    }
    let period_s = TAU / ((amplitude * n / inertia).sqrt() * one);
    // A clock of which a period has 2^20 edges.
    let edges = 1 << 20;
    let laws = laws(swinging, BARE, period_s / edges as f64);
    let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, start);
    let mut edge = 0;
    for swing in 1..=20u64 {
        leap(&mut device, edge, swing * edges);
        edge = swing * edges;
        let [_, speed, angle, _] = device.state(edge);
        close(angle, start, 1e-13);
        // The greatest speed is below 10 rad/s; the period is known to rounding.
        close(speed, 0.0, 1e-11);
        close(device.stored_j(edge), 0.0, 1e-15 * amplitude);
        let mut then = device.clone();
        leap(&mut then, edge, edge + edges / 2);
        close(then.state(edge + edges / 2)[2], -start, 1e-13);
    }
}

/// A spring-damper hand on a rotor without magnets is a linear oscillator around a target that moves.
#[test]
fn a_hand_pulls_the_rotor_to_its_moving_intention() {
    let (k, b, inertia) = (0.05, 1e-4, 2e-5);
    let plain = PmsmMotor { flux_vs: 0.0, viscous_nm_s_per_rad: 0.0, ..motor() };
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: k, damping_nm_s_per_rad: b });
    let laws = Pmsm::new(plain, BARE, hand, EDGE_S).unwrap();
    let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.0);
    let (target, speed) = (0.4, 2.0);
    device.intend(1000, target, speed);
    let (decay, natural) = (0.5 * b / inertia, (k / inertia).sqrt());
    let frequency = (natural * natural - decay * decay).sqrt();
    let mut edge = 1000;
    for to in [1001, 20_000, 333_333, 5_000_000] {
        leap(&mut device, edge, to);
        edge = to;
        // y = θ_h - θ falls freely: y'' + 2 decay y' + natural² y = 0 from y = 0.4, y' = 2.
        let t = (to - 1000) as f64 * EDGE_S;
        let turned = (speed + decay * target) / frequency;
        let y = (-decay * t).exp() * (target * (frequency * t).cos() + turned * (frequency * t).sin());
        let [_, _, angle, intent] = device.state(to);
        close(intent, target + speed * t, 1e-15);
        close(intent - angle, y, 2e-13);
        let energy = device.energy(to);
        let rest = energy.hand_j() - device.stored_j(to);
        assert!(rest.abs() <= 1e-13 * energy.exchanged_j().max(1e-9), "{rest:e} of {:e}", energy.exchanged_j());
    }
}
