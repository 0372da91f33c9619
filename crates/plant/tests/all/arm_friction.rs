//! Stick and slip, against closed forms, exact stepping and the energy balance.

use crate::arms::rubbing_1_5;
use hpu_plant::arm::{Arm, ArmModel, ArmMotion, Transmission};

const EDGE_S: f64 = 20e-9;

fn edge(time_s: f64) -> u64 {
    (time_s / EDGE_S).round() as u64
}

fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "got {got}, expected {expected}, off by {:e}", got - expected);
}

/// A single joint with inertia, viscous and Coulomb friction under a held torque, stepped exactly.
#[derive(Clone, Copy)]
struct Exact {
    inertia: f64,
    viscous: f64,
    coulomb: f64,
    angle: f64,
    speed: f64,
}

impl Exact {
    fn step(&mut self, torque: f64, mut time: f64) {
        loop {
            if self.speed == 0.0 && torque.abs() <= self.coulomb {
                return;
            }
            let sign = if self.speed == 0.0 { torque.signum() } else { self.speed.signum() };
            let last = (torque - sign * self.coulomb) / self.viscous;
            let tau = self.inertia / self.viscous;
            let stop = if self.speed * last < 0.0 { tau * (-self.speed / last).ln_1p() } else { f64::INFINITY };
            let t = time.min(stop);
            let fade = -(-t / tau).exp_m1();
            self.angle += last * t + tau * (self.speed - last) * fade;
            self.speed += (last - self.speed) * fade;
            if stop > time {
                return;
            }
            self.speed = 0.0;
            time -= stop;
        }
    }
}

/// Returns a Premium 1.5 with one free joint, and that joint by itself.
fn alone(joint: usize) -> (Arm, Exact) {
    let model = ArmModel { free: std::array::from_fn(|i| i == joint), ..rubbing_1_5().balanced() };
    let inertia = model.mass_kg_m2([0.0; 3])[joint][joint] + model.rotor_kg_m2[joint];
    let (viscous, coulomb) = (model.viscous_nm_s_per_rad[joint], model.coulomb_nm[joint]);
    (Arm::new(model, EDGE_S).unwrap(), Exact { inertia, viscous, coulomb, angle: 0.0, speed: 0.0 })
}

#[test]
fn one_free_joint_under_held_torques_follows_the_closed_form() {
    for joint in 0..3 {
        let (arm, mut exact) = alone(joint);
        exact.speed = 0.5;
        let mut speeds = [0.0; 3];
        speeds[joint] = 0.5;
        let mut motion = ArmMotion::new(&arm, [0.0; 3], speeds);
        let mut at = 0;
        for (k, torque) in [-0.02, -0.0099, 0.0, 0.0101, 0.05, -0.1, 0.005, -0.2, 0.3].into_iter().enumerate() {
            let mut torques = [0.0; 3];
            torques[joint] = torque;
            motion.drive(at, torques);
            let length = edge(0.03 + 0.01 * k as f64);
            at += length;
            exact.step(torque, length as f64 * EDGE_S);
            close(motion.step(at)[joint], exact.angle, 1e-13);
            close(motion.state(at).speeds_rad_per_s[joint], exact.speed, 1e-12);
        }
        assert!(motion.mode_changes() >= 3);
    }
}

#[test]
fn a_drop_onto_a_sampled_wall_follows_exact_stepping() {
    let (arm, mut exact) = alone(1);
    let mut motion = ArmMotion::new(&arm, [0.0; 3], [0.0; 3]);
    let (period, wall, stiffness, weight) = (edge(1e-3), 0.1, 20.0, 0.03);
    for sample in 0..10_000 {
        let at = sample * period;
        let angle = motion.step(at)[1];
        close(angle, exact.angle, 1e-11);
        let torque = |angle: f64| weight - stiffness * (angle - wall).max(0.0);
        motion.drive(at, [0.0, torque(angle), 0.0]);
        exact.step(torque(exact.angle), 1e-3);
    }
    assert!(exact.angle > wall && motion.mode_changes() > 3, "it bounced and came to rest");
}

#[test]
fn a_stuck_joint_does_not_creep() {
    let arm = Arm::new(ArmModel { amplifier_s: 2e-4, ..rubbing_1_5().balanced() }, EDGE_S).unwrap();
    let start = [0.123, 0.456, 0.321];
    let mut motion = ArmMotion::new(&arm, start, [0.0; 3]);
    for step in 0..1000_u32 {
        let at = edge(f64::from(step) * 1e-4);
        assert_eq!(motion.step(at).map(f64::to_bits), start.map(f64::to_bits));
        let wave = 0.0099 * (f64::from(step) * 0.7).sin();
        motion.drive(at, [wave, -wave, wave]);
    }
    assert_eq!(motion.mode_changes(), 0);
}

#[test]
fn a_joint_is_held_or_dragged_along_by_what_couples_it() {
    // Joint 2 accelerates and pulls joint 3 through M23; the friction of joint 3 decides whether it moves.
    let mut model = rubbing_1_5().balanced();
    let angles = [0.0, 0.8, 0.0];
    let m23 = model.mass_kg_m2(angles)[1][2];
    let m22 = model.swinging_kg_m2[0] + model.rotor_kg_m2[1];
    let torque_nm = 0.5;
    let acceleration = (torque_nm - model.coulomb_nm[1]) / m22;
    let drag_nm = (m23 * acceleration).abs();
    for (friction_nm, held) in [(1.001 * drag_nm, true), (0.999 * drag_nm, false)] {
        model.coulomb_nm[2] = friction_nm;
        let arm = Arm::new(model, EDGE_S).unwrap();
        let mut motion = ArmMotion::new(&arm, angles, [0.0; 3]);
        motion.drive(0, [0.0, torque_nm, 0.0]);
        assert_eq!(motion.state(0).stuck, [true, false, held]);
        let after = motion.step(edge(1e-4));
        assert_eq!(after[2] == 0.0, held);
        if !held {
            assert_eq!(after[2] > 0.0, m23 < 0.0, "dragged the way the coupling pulls");
        }
    }
}

#[test]
fn a_torque_that_rises_through_an_amplifier_breaks_the_joint_loose_when_it_passes_friction() {
    let (arm, exact) = alone(0);
    let lag_s = 1e-3;
    let arm = Arm::new(ArmModel { amplifier_s: lag_s, ..*arm.model() }, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.0; 3], [0.0; 3]);
    motion.drive(0, [0.03, 0.0, 0.0]);
    // 0.03 (1 - e^{-t/T}) = f
    let loose_s = -lag_s * (-exact.coulomb / 0.03).ln_1p();
    let just = (loose_s / EDGE_S) as u64;
    assert_eq!(motion.step(just)[0], 0.0);
    assert_eq!((motion.state(just).stuck[0], motion.mode_changes()), (true, 0));
    motion.step(just + 1);
    assert_eq!((motion.state(just + 1).stuck[0], motion.mode_changes()), (false, 1));
    // J ω' + b ω = u (1 - e^{-t/T}) - f from rest: two exponentials and a constant.
    let t = 5e-3 - loose_s;
    let (j, b, left) = (exact.inertia, exact.viscous, 0.03 * (-loose_s / lag_s).exp());
    let steady = (0.03 - exact.coulomb) / b;
    let forced = -left / (b - j / lag_s);
    let speed = steady + forced * (-t / lag_s).exp() - (steady + forced) * (-b * t / j).exp();
    let at = edge(5e-3);
    motion.step(at);
    close(motion.state(at).speeds_rad_per_s[0], speed, 1e-12);
}

/// Returns commands in N·m without any particular pattern.
fn commands(step: u32) -> [f64; 3] {
    let phase = f64::from(step);
    [0.05 * (phase * 1.7).sin(), 0.06 * (phase * 2.3).sin(), 0.04 * (phase * 0.9).cos()]
}

#[test]
fn energy_balances_with_friction_gravity_amplifiers_and_flexible_transmissions() {
    let soft = Some(Transmission { stiffness_nm_per_rad: 60.0, damping_nm_s_per_rad: 2e-3 });
    let rigid = ArmModel { gravity_m_per_s2: [3.0, -9.0, 1.0], ..rubbing_1_5() };
    for model in [
        rigid,
        ArmModel { amplifier_s: 2e-4, ..rigid },
        ArmModel { transmission: [soft; 3], ..rigid },
        ArmModel { transmission: [None, soft, None], amplifier_s: 1e-4, ..rigid },
        ArmModel { transmission: [soft, None, soft], free: [true, true, false], ..rigid },
    ] {
        let arm = Arm::new(model, EDGE_S).unwrap();
        let mut motion = ArmMotion::new(&arm, [0.0, 0.1, 0.2], [0.0; 3]);
        for step in 0..400 {
            let at = edge(f64::from(step) * 1e-3);
            let angles = motion.step(at);
            let [a, b, c] = commands(step / 7);
            // Springs keep the arm in its workspace.
            motion.drive(at, [a - angles[0], b - angles[1], c - angles[2]]);
        }
        let at = edge(0.4);
        motion.step(at);
        let (energy, stored_j) = (motion.energy(at), motion.stored_j(at));
        let residual = energy.source_j - energy.dissipated_j() - stored_j;
        assert!(residual.abs() <= 1e-12 * energy.exchanged_j, "{residual:e} of {:e}", energy.exchanged_j);
        assert!(motion.mode_changes() > 20 && energy.coulomb_j > 0.0 && energy.viscous_j > 0.0);
        assert_eq!(energy.transmission_j > 0.0, model.transmission != [None; 3]);
    }
}
