//! Arms that are known by their dynamics alone: a planar arm of two links against textbook formulas, and a PHANToM
//! against the recursion that is written out by hand for it.

use hpu_plant::Method;
use hpu_plant::arm::kinematics::{jacobian_m, tip_m};
use hpu_plant::arm::{Arm, ArmError, ArmModel, ArmMotion, Dual, Dynamics, Joints, Scalar, SteppedArm, Transmission};

use crate::arms::rubbing_1_5;

const EDGE_S: f64 = 1e-6;
const GRAVITY_M_PER_S2: f64 = 9.81;

/// Two links in a vertical plane, each a point mass at the end of a massless rod. Joint 1 is the shoulder, from the
/// vertical; joint 2 the elbow, relative to the upper link; joint 3 turns a wheel of its own.
#[derive(Clone, Copy)]
struct Planar {
    lengths_m: [f64; 2],
    masses_kg: [f64; 2],
    gravity_m_per_s2: f64,
}

const PLANAR: Planar = Planar { lengths_m: [0.3, 0.2], masses_kg: [0.4, 0.5], gravity_m_per_s2: GRAVITY_M_PER_S2 };
const WHEEL_KG_M2: f64 = 1e-3;

impl Dynamics for Planar {
    fn mass_kg_m2<T: Scalar>(&self, angles_rad: &[T; 3]) -> [[T; 3]; 3] {
        let ([l1, l2], [m1, m2]) = (self.lengths_m, self.masses_kg);
        let bent = T::from(m2 * l1 * l2) * angles_rad[1].sin_cos().1;
        let m12 = T::from(m2 * l2 * l2) + bent.clone();
        let m11 = T::from((m1 + m2) * l1 * l1 + m2 * l2 * l2) + T::from(2.0) * bent;
        let number = T::from;
        [
            [m11, m12.clone(), number(0.0)],
            [m12, number(m2 * l2 * l2), number(0.0)],
            [number(0.0), number(0.0), number(WHEEL_KG_M2)],
        ]
    }

    fn potential_j<T: Scalar>(&self, angles_rad: &[T; 3]) -> T {
        let ([l1, l2], [m1, m2], g) = (self.lengths_m, self.masses_kg, self.gravity_m_per_s2);
        let hand = (angles_rad[0].clone() + angles_rad[1].clone()).sin_cos().1;
        -(T::from((m1 + m2) * g * l1) * angles_rad[0].sin_cos().1 + T::from(m2 * g * l2) * hand)
    }

    fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3] {
        let [l1, l2] = self.lengths_m;
        let ((s1, c1), (s2, c2)) = (angles_rad[0].sin_cos(), (angles_rad[0].clone() + angles_rad[1].clone()).sin_cos());
        let number = T::from;
        [number(l1) * s1 + number(l2) * s2, -(number(l1) * c1 + number(l2) * c2), number(0.0)]
    }
}

fn planar(joints: Joints) -> Arm<hpu_plant::arm::Recorded> {
    Arm::of(&PLANAR, joints, EDGE_S).unwrap()
}

/// Energy of the planar arm, from places and velocities of its point masses.
fn energy_j([q1, q2, _]: [f64; 3], [v1, v2, v3]: [f64; 3]) -> f64 {
    let ([l1, l2], [m1, m2]) = (PLANAR.lengths_m, PLANAR.masses_kg);
    let (turn, spin) = (q1 + q2, v1 + v2);
    let elbow = [l1 * v1 * q1.cos(), l1 * v1 * q1.sin()];
    let hand = [elbow[0] + l2 * spin * turn.cos(), elbow[1] + l2 * spin * turn.sin()];
    let square = |[x, y]: [f64; 2]| x * x + y * y;
    let height_m = [-l1 * q1.cos(), -l1 * q1.cos() - l2 * turn.cos()];
    0.5 * (m1 * square(elbow) + m2 * square(hand) + WHEEL_KG_M2 * v3 * v3)
        + GRAVITY_M_PER_S2 * (m1 * height_m[0] + m2 * height_m[1])
}

/// Slopes of the double pendulum in absolute angles, from a textbook.
fn pendulum([t1, t2, w1, w2]: [f64; 4]) -> [f64; 4] {
    let ([l1, l2], [m1, m2], g) = (PLANAR.lengths_m, PLANAR.masses_kg, GRAVITY_M_PER_S2);
    let apart = t1 - t2;
    let share = 2.0 * m1 + m2 - m2 * (2.0 * apart).cos();
    let first = -g * (2.0 * m1 + m2) * t1.sin()
        - m2 * g * (t1 - 2.0 * t2).sin()
        - 2.0 * apart.sin() * m2 * (w2 * w2 * l2 + w1 * w1 * l1 * apart.cos());
    let second = w1 * w1 * l1 * (m1 + m2) + g * (m1 + m2) * t1.cos() + w2 * w2 * l2 * m2 * apart.cos();
    [w1, w2, first / (l1 * share), 2.0 * apart.sin() * second / (l2 * share)]
}

#[test]
fn a_double_pendulum_keeps_its_energy_through_ten_seconds_of_chaos() {
    let arm = planar(Joints { free: [true; 3], ..Joints::default() });
    let (angles, speeds) = ([2.0, 0.7, 0.0], [1.0, -2.0, 3.0]);
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    let start_j = energy_j(angles, speeds);
    let mut turned_rad: f64 = 0.0;
    for second in 1..=1000 {
        let edge = second * 10_000;
        motion.step(edge);
        let state = motion.state(edge);
        turned_rad = turned_rad.max((state.angles_rad[1] - angles[1]).abs());
        let now_j = energy_j(state.angles_rad, state.speeds_rad_per_s);
        assert!((now_j - start_j).abs() < 1e-12, "after {edge} edges {now_j} J, {start_j} J before");
        assert!(motion.stored_j(edge).abs() < 1e-12);
        assert!((state.angles_rad[2] - 3.0 * edge as f64 * EDGE_S).abs() < 1e-12, "the wheel turns by itself");
    }
    assert!(turned_rad > 6.0, "{turned_rad} rad is no chaos");
}

#[test]
fn a_double_pendulum_moves_by_the_textbooks_equations() {
    let arm = planar(Joints { free: [true, true, false], ..Joints::default() });
    let (angles, speeds) = ([1.2, -0.5, 0.4], [0.5, 1.0, 0.0]);
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    let mut stepped = SteppedArm::new(&arm, Method::Rk4, 100, angles, speeds);
    let mut x = [angles[0], angles[0] + angles[1], speeds[0], speeds[0] + speeds[1]];
    let h = 20e-6;
    for step in 1..=15_000u64 {
        let along = |slope: [f64; 4], by: f64| -> [f64; 4] { std::array::from_fn(|i| x[i] + by * slope[i]) };
        let one = pendulum(x);
        let two = pendulum(along(one, 0.5 * h));
        let three = pendulum(along(two, 0.5 * h));
        let four = pendulum(along(three, h));
        x = std::array::from_fn(|i| x[i] + h / 6.0 * (one[i] + 2.0 * (two[i] + three[i]) + four[i]));
        if step % 500 == 0 {
            let found = motion.step(step * 20);
            let by_steps = stepped.step(step * 20);
            let expected = [x[0], x[1] - x[0], angles[2]];
            for joint in 0..3 {
                assert!((found[joint] - expected[joint]).abs() < 1e-12, "{found:?}, not {expected:?}");
                assert!((by_steps[joint] - expected[joint]).abs() < 1e-9, "{by_steps:?}, not {expected:?}");
            }
        }
    }
}

#[test]
fn friction_of_coupled_joints_is_decided_for_all_of_them_together() {
    // Without gravity and straight: M11 = 0.4 0.3² + 0.5 0.5², M12 = 0.5 (0.2² + 0.3 0.2), M22 = 0.5 0.2².
    let (m11, m12, m22) = (0.161, 0.05, 0.02);
    let coulomb_nm = [0.1, 0.05, 0.01];
    let joints = Joints { free: [true; 3], coulomb_nm, ..Joints::default() };
    let arm = Arm::of(&Planar { gravity_m_per_s2: 0.0, ..PLANAR }, joints, EDGE_S).unwrap();
    let run = |torque_nm: f64| {
        let mut motion = ArmMotion::new(&arm, [0.3, 0.0, 0.0], [0.0; 3]);
        motion.drive(0, [torque_nm, 0.0, 0.0]);
        motion.step(10);
        let state = motion.state(10);
        (state.stuck, state.speeds_rad_per_s.map(|speed| speed / (10.0 * EDGE_S)))
    };
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6 * expected.abs().max(1e-3));
    assert_eq!(run(0.0999), ([true; 3], [0.0; 3]));
    // The elbow is dragged along with less than its friction: 0.05 (0.2 - 0.1) / 0.161 N.m.
    let (stuck, acceleration) = run(0.2);
    assert_eq!(stuck, [false, true, true]);
    near(acceleration[0], 0.1 / m11);
    // And now with more: it slips backward.
    let (stuck, acceleration) = run(0.4);
    assert_eq!(stuck, [false, false, true]);
    let determinant = m11 * m22 - m12 * m12;
    near(acceleration[0], (m22 * 0.3 - m12 * 0.05) / determinant);
    near(acceleration[1], (m11 * 0.05 - m12 * 0.3) / determinant);
    // At the limit: M12 (u - 0.1) / M11 = 0.05.
    let limit_nm = 0.1 + 0.05 * m11 / m12;
    assert_eq!(run(limit_nm - 1e-9).0, [false, true, true]);
    assert_eq!(run(limit_nm + 1e-9).0, [false, false, true]);
    // Steps decide alike.
    for (torque_nm, held) in [(0.0999, [true; 3]), (0.2, [false, true, true]), (0.4, [false, false, true])] {
        let mut stepped = SteppedArm::new(&arm, Method::Rk4, 10, [0.3, 0.0, 0.0], [0.0; 3]);
        stepped.drive([torque_nm, 0.0, 0.0]);
        stepped.step(10);
        assert_eq!(stepped.state(10).stuck, held);
    }
}

#[test]
fn the_arm_of_a_phantom_moves_alike_by_hand_and_by_its_dynamics() {
    let flexible = Transmission { stiffness_nm_per_rad: 40.0, damping_nm_s_per_rad: 0.01 };
    let tilted = ArmModel { gravity_m_per_s2: [1.0, -9.0, 2.0], ..rubbing_1_5() };
    let mut changes = 0;
    for (model, said) in [
        (rubbing_1_5().balanced(), "balanced"),
        (tilted, "rigid"),
        (ArmModel { amplifier_s: 1e-3, free: [true, false, true], ..tilted }, "lagging, one joint locked"),
        (ArmModel { transmission: [Some(flexible), None, Some(flexible)], ..tilted }, "flexible"),
        (ArmModel { coulomb_nm: [0.0; 3], ..tilted }, "without Coulomb friction"),
    ] {
        let by_hand = Arm::new(model, EDGE_S).unwrap();
        let general = Arm::of(&model, model.joints(), EDGE_S).unwrap();
        let (angles, speeds) = ([0.1, 0.2, -0.1], [1.0, -0.5, 0.3]);
        let (mut one, mut other) = (ArmMotion::new(&by_hand, angles, speeds), ArmMotion::new(&general, angles, speeds));
        let mut stepped = SteppedArm::new(&by_hand, Method::Rk4, 50, angles, speeds);
        let mut stepped_too = SteppedArm::new(&general, Method::Rk4, 50, angles, speeds);
        for turn in 0..100u64 {
            let edge = turn * 4000;
            let torque = |joint: u64| 0.05 * (turn as f64 * (0.3 + 0.2 * joint as f64)).sin();
            let torques_nm = [torque(0), torque(1), torque(2)];
            one.drive(edge, torques_nm);
            other.drive(edge, torques_nm);
            stepped.drive(torques_nm);
            stepped_too.drive(torques_nm);
            let next = edge + 4000;
            one.step(next);
            other.step(next);
            stepped.step(next);
            stepped_too.step(next);
            let by_series = [other.state(next), one.state(next)];
            for [found, expected] in [by_series, [stepped_too.state(next), stepped.state(next)]] {
                assert_eq!(found.stuck, expected.stuck, "{said}, edge {next}");
                for joint in 0..3 {
                    let near = |found: f64, expected: f64| (found - expected).abs() < 1e-12 * expected.abs().max(1.0);
                    assert!(near(found.angles_rad[joint], expected.angles_rad[joint]), "{said}, edge {next}");
                    assert!(near(found.motor_angles_rad[joint], expected.motor_angles_rad[joint]), "{said}, {next}");
                    assert!(near(found.speeds_rad_per_s[joint], expected.speeds_rad_per_s[joint]), "{said}, {next}");
                }
            }
        }
        assert_eq!(one.mode_changes(), other.mode_changes(), "{said}");
        changes += one.mode_changes();
        assert!((one.stored_j(400_000) - other.stored_j(400_000)).abs() < 1e-13, "{said}");
    }
    assert!(changes > 50, "{changes}");
}

#[test]
fn duals_differentiate() {
    let model = ArmModel { gravity_m_per_s2: [1.0, -9.0, 2.0], ..ArmModel::premium_1_5() };
    for pose in [[0.0; 3], [0.3, -0.4, 0.8], [-1.2, 0.9, 0.1]] {
        let along = Dual::of(pose);
        let (tip, rows) = (Dynamics::tip_m(&model, &along), jacobian_m(model.lengths_m, pose));
        let place = tip_m(model.lengths_m, pose);
        let (mass, potential) = (Dynamics::mass_kg_m2(&model, &along), model.potential_j(&along));
        for axis in 0..3 {
            assert!((tip[axis].value - place[axis]).abs() < 1e-16);
            for (slope, expected) in tip[axis].slopes.iter().zip(rows[axis]) {
                assert!((slope - expected).abs() < 1e-16, "{pose:?}");
            }
        }
        for joint in 0..3 {
            let beside = |by: f64| std::array::from_fn(|i| if i == joint { pose[i] + by } else { pose[i] });
            let slope = |of: &dyn Fn([f64; 3]) -> f64| (of(beside(1e-4)) - of(beside(-1e-4))) / 2e-4;
            assert!((potential.slopes[joint] - slope(&|pose| model.gravity_j(pose))).abs() < 1e-8, "{pose:?}");
            for (i, j) in [(0, 0), (1, 2), (2, 1), (1, 1)] {
                let expected = slope(&|pose| model.mass_kg_m2(pose)[i][j]);
                assert!((mass[i][j].slopes[joint] - expected).abs() < 1e-9, "{pose:?}");
            }
        }
    }
}

#[test]
fn impossible_joints_are_refused() {
    let refused = |joints: Joints| Arm::of(&PLANAR, joints, EDGE_S).unwrap_err();
    let least = Joints { free: [true; 3], ..Joints::default() };
    assert_eq!(refused(Joints { coulomb_nm: [0.0, -1.0, 0.0], ..least }), ArmError::Impossible("Coulomb friction"));
    assert_eq!(refused(Joints { amplifier_s: f64::NAN, ..least }), ArmError::Impossible("amplifier's time constant"));
    assert_eq!(Arm::of(&PLANAR, least, 0.0).unwrap_err(), ArmError::Impossible("clock period"));
}
