//! Flexible transmissions against a matrix exponential.

use crate::arms::rubbing_1_5;
use hpu_plant::arm::{Arm, ArmModel, ArmMotion, Transmission};

const EDGE_S: f64 = 20e-9;

type Matrix = [[f64; 5]; 5];

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..5).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Returns `e^A` by scaling and squaring of the plain series.
fn exponential(a: &Matrix) -> Matrix {
    let scaled: Matrix = a.map(|row| row.map(|x| x / 1024.0));
    let one: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let mut sum = one;
    for k in (1..20).rev() {
        let next = times(&scaled, &sum);
        sum = std::array::from_fn(|i| std::array::from_fn(|j| one[i][j] + next[i][j] / f64::from(k)));
    }
    (0..10).fold(sum, |power, _| times(&power, &power))
}

#[test]
fn one_flexible_joint_moves_as_its_linear_system_says() {
    let flexible = Transmission { stiffness_nm_per_rad: 68.0, damping_nm_s_per_rad: 1e-3 };
    let lag_s = 2e-4;
    let rigid = rubbing_1_5().balanced();
    for joint in 0..3 {
        let model = ArmModel {
            coulomb_nm: [0.0; 3],
            transmission: [Some(flexible); 3],
            amplifier_s: lag_s,
            free: std::array::from_fn(|i| i == joint),
            ..rigid
        };
        let arm = Arm::new(model, EDGE_S).unwrap();
        let link = model.mass_kg_m2([0.0; 3])[joint][joint];
        let (rotor, viscous) = (model.rotor_kg_m2[joint], model.viscous_nm_s_per_rad[joint]);
        let (k, d) = (flexible.stiffness_nm_per_rad, flexible.damping_nm_s_per_rad);
        // States: angle and speed of the link, angle and speed of the motor, torque minus its command.
        let step_s = 1e-3;
        let a: Matrix = [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k / link, -d / link, k / link, d / link, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [k / rotor, d / rotor, -k / rotor, -(d + viscous) / rotor, 1.0 / rotor],
            [0.0, 0.0, 0.0, 0.0, -1.0 / lag_s],
        ];
        let flow = exponential(&a.map(|row| row.map(|x| x * step_s)));
        let command = 0.02;
        let mut motion = ArmMotion::new(&arm, [0.0; 3], [0.0; 3]);
        let mut torques = [0.0; 3];
        torques[joint] = -command;
        motion.drive(0, torques);
        // The torque is its command from the start on, plus a rest of the opposite sign that decays. The rest moves the
        // free system; the command is a constant torque on the rotor, computed by the integral of the flow.
        let mut x = [0.0, 0.0, 0.0, 0.0, command];
        let mut forced = [0.0; 5];
        let integral = integral_of(&a, step_s);
        for step in 1..=200_u64 {
            x = std::array::from_fn(|i| (0..5).map(|j| flow[i][j] * x[j]).sum());
            forced = std::array::from_fn(|i| {
                (0..5).map(|j| flow[i][j] * forced[j]).sum::<f64>() + integral[i][3] * -command / rotor
            });
            let at = step * 50_000;
            let got = motion.step(at)[joint];
            let state = motion.state(at);
            let expected: [f64; 4] = std::array::from_fn(|i| x[i] + forced[i]);
            let found = [
                state.angles_rad[joint],
                state.speeds_rad_per_s[joint],
                state.motor_angles_rad[joint],
                state.motor_speeds_rad_per_s[joint],
            ];
            assert_eq!(got, found[2], "the encoder sees the motor");
            for (found, expected) in found.into_iter().zip(expected) {
                let off = (found - expected).abs();
                assert!(off <= 1e-10 * (0.01 + expected.abs()), "{found} off by {off:e} at step {step}");
            }
        }
    }
}

/// Returns `∫ e^{A t} dt` over `[0, t]`, by the plain series of 64 parts.
fn integral_of(a: &Matrix, time_s: f64) -> Matrix {
    let part_s = time_s / 64.0;
    let scaled: Matrix = a.map(|row| row.map(|x| x * part_s));
    let one: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let mut part = one;
    for k in (2..24).rev() {
        let next = times(&scaled, &part);
        part = std::array::from_fn(|i| std::array::from_fn(|j| one[i][j] + next[i][j] / f64::from(k)));
    }
    let flow = exponential(&scaled);
    let mut sum = [[0.0; 5]; 5];
    for _ in 0..64 {
        let moved = times(&flow, &sum);
        sum = std::array::from_fn(|i| std::array::from_fn(|j| moved[i][j] + part_s * part[i][j]));
    }
    sum
}

#[test]
fn an_amplifier_comes_to_its_command() {
    let model = ArmModel { amplifier_s: 2e-4, coulomb_nm: [1.0; 3], ..rubbing_1_5() };
    let arm = Arm::new(model, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.0; 3], [0.0; 3]);
    motion.drive(0, [0.1, -0.2, 0.3]);
    let late = edge_of(0.1);
    motion.step(late);
    assert_eq!(motion.state(late).torques_nm, [0.1, -0.2, 0.3]);
    let segments = motion.segments();
    motion.step(1 << 50);
    assert_eq!(motion.segments(), segments, "and then rests");
}

#[test]
fn a_stiff_transmission_comes_close_to_a_rigid_one() {
    let rigid = ArmModel { coulomb_nm: [0.0; 3], ..rubbing_1_5() };
    let run = |model: ArmModel| {
        let arm = Arm::new(model, EDGE_S).unwrap();
        let mut motion = ArmMotion::new(&arm, [0.1, 0.2, 0.3], [0.5, 0.2, -0.4]);
        motion.drive(0, [0.01, 0.02, -0.01]);
        motion.step(edge_of(0.05))
    };
    let reference = run(rigid);
    let off = |stiffness_nm_per_rad: f64| {
        let flexible = Transmission { stiffness_nm_per_rad, damping_nm_s_per_rad: 0.05 };
        let angles = run(ArmModel { transmission: [Some(flexible); 3], ..rigid });
        (0..3).map(|i| (angles[i] - reference[i]).abs()).fold(0.0, f64::max)
    };
    let (soft, stiff) = (off(1e3), off(1e4));
    assert!(soft < 1e-3 && stiff < 0.15 * soft, "off by {soft:e} and {stiff:e}");
}

fn edge_of(time_s: f64) -> u64 {
    (time_s / EDGE_S).round() as u64
}
