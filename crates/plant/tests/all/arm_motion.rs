//! The arm without friction: closed forms, conserved quantities, an integrator written from the published equations.

use crate::arms::rubbing_1_5;
use hpu_plant::Band;
use hpu_plant::arm::kinematics::{jacobian_m, tip_m};
use hpu_plant::arm::{Arm, ArmError, ArmModel, ArmMotion, Transmission};

const EDGE_S: f64 = 20e-9;

fn edge(time_s: f64) -> u64 {
    (time_s / EDGE_S).round() as u64
}

fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "got {got}, expected {expected}");
}

#[test]
fn a_point_mass_flies_straight() {
    let model = ArmModel::premium_1_0();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let (angles, speeds) = ([0.3, 0.4, 0.2], [-1.0, 0.5, 0.8]);
    let tip = tip_m(model.lengths_m, angles);
    let velocity: [f64; 3] = jacobian_m(model.lengths_m, angles).map(|row| (0..3).map(|i| row[i] * speeds[i]).sum());
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    for step in 1..=300 {
        let time_s = f64::from(step) * 1e-3;
        let found = tip_m(model.lengths_m, motion.step(edge(time_s)));
        for axis in 0..3 {
            close(found[axis], tip[axis] + velocity[axis] * time_s, 1e-14);
        }
    }
}

#[test]
fn a_weight_alone_falls_along_gravity_whatever_the_pose() {
    // Without links: a point mass with its weight, thrown.
    let mut model = ArmModel::premium_1_0();
    model.moments_kg_m = [0.075 * 0.14; 2];
    model.gravity_m_per_s2 = [2.0, -9.0, 3.0];
    let arm = Arm::new(model, EDGE_S).unwrap();
    let (angles, speeds) = ([-0.2, 0.1, 0.3], [0.5, 3.0, -2.0]);
    let tip = tip_m(model.lengths_m, angles);
    let velocity: [f64; 3] = jacobian_m(model.lengths_m, angles).map(|row| (0..3).map(|i| row[i] * speeds[i]).sum());
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    for step in 1..=100 {
        let time_s = f64::from(step) * 1e-3;
        let found = tip_m(model.lengths_m, motion.step(edge(time_s)));
        for axis in 0..3 {
            let fallen = velocity[axis] * time_s + 0.5 * model.gravity_m_per_s2[axis] * time_s * time_s;
            close(found[axis], tip[axis] + fallen, 1e-14);
        }
    }
}

#[test]
fn free_motion_keeps_its_energy_and_its_momentum_about_the_vertical() {
    let model = ArmModel::premium_1_5().balanced();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let (angles, speeds) = ([0.0, 0.2, 0.1], [1.5, 2.0, -1.0]);
    let momentum =
        |angles: [f64; 3], speeds: [f64; 3]| (model.mass_kg_m2(angles)[0][0] + model.rotor_kg_m2[0]) * speeds[0];
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    let mass = model.mass_kg_m2(angles);
    let kinetic_j: f64 = (0..3)
        .map(|i| {
            0.5 * speeds[i] * ((0..3).map(|j| mass[i][j] * speeds[j]).sum::<f64>() + model.rotor_kg_m2[i] * speeds[i])
        })
        .sum();
    for step in 1..=100 {
        let at = edge(f64::from(step) * 0.1);
        motion.step(at);
        assert!(motion.stored_j(at).abs() <= 1e-12 * kinetic_j, "energy {:e} of {kinetic_j:e}", motion.stored_j(at));
        let state = motion.state(at);
        close(momentum(state.angles_rad, state.speeds_rad_per_s), momentum(angles, speeds), 1e-14);
    }
}

#[test]
fn motion_under_tilted_gravity_keeps_its_total_energy() {
    let gravity_m_per_s2 = [4.0, -7.0, 5.0];
    let arm = Arm::new(ArmModel { gravity_m_per_s2, ..ArmModel::premium_1_5() }, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.4, 0.2, 0.1], [0.5, 0.2, 0.3]);
    for step in 1..=20 {
        let at = edge(f64::from(step) * 0.1);
        motion.step(at);
        assert!(motion.stored_j(at).abs() <= 1e-13, "energy {:e}", motion.stored_j(at));
    }
}

/// The published equations, with the corrected sign of `C` of Çavuşoğlu et al.
struct Published(ArmModel);

impl Published {
    fn slopes(&self, [_, t2, t3]: [f64; 3]) -> [f64; 3] {
        let ([_, a2, a3], p) = (self.0.turning_kg_m2, self.0.coupling_kg_m2);
        [
            -2.0 * a2 * (2.0 * t2).sin() - p * t2.sin() * t3.sin(),
            -2.0 * a3 * (2.0 * t3).sin() + p * t2.cos() * t3.cos(),
            p * (t2 - t3).cos(),
        ]
    }

    fn coriolis(&self, q: [f64; 3], v: [f64; 3]) -> [[f64; 3]; 3] {
        let [d2, d3, p] = self.slopes(q);
        [
            [0.5 * (d2 * v[1] + d3 * v[2]), 0.5 * d2 * v[0], 0.5 * d3 * v[0]],
            [-0.5 * d2 * v[0], 0.0, 0.5 * p * v[2]],
            [-0.5 * d3 * v[0], -0.5 * p * v[1], 0.0],
        ]
    }

    fn acceleration(&self, q: [f64; 3], v: [f64; 3], torques_nm: [f64; 3]) -> [f64; 3] {
        let (mass, coriolis, [a, b]) = (self.0.mass_kg_m2(q), self.coriolis(q, v), self.0.moments_kg_m);
        let gravity = [0.0, 9.81 * a * q[1].cos(), 9.81 * b * q[2].sin()];
        let r: [f64; 3] = std::array::from_fn(|i| {
            torques_nm[i]
                - gravity[i]
                - self.0.viscous_nm_s_per_rad[i] * v[i]
                - (0..3).map(|j| coriolis[i][j] * v[j]).sum::<f64>()
        });
        let [m1, m2, m3] = std::array::from_fn(|i| mass[i][i] + self.0.rotor_kg_m2[i]);
        let m23 = mass[1][2];
        let determinant = m2 * m3 - m23 * m23;
        [r[0] / m1, (m3 * r[1] - m23 * r[2]) / determinant, (m2 * r[2] - m23 * r[1]) / determinant]
    }
}

#[test]
fn the_coriolis_matrix_of_the_reference_is_skew_against_the_mass_matrix() {
    let published = Published(rubbing_1_5());
    let (q, v, h) = ([0.3, 0.7, 0.4], [1.0, -2.0, 3.0], 1e-6);
    let moved = |by: f64| published.0.mass_kg_m2(std::array::from_fn(|i| q[i] + by * v[i]));
    let (ahead, behind, c) = (moved(h), moved(-h), published.coriolis(q, v));
    let rest = |i: usize, j: usize| (ahead[i][j] - behind[i][j]) / (2.0 * h) - 2.0 * c[i][j];
    for i in 0..3 {
        for j in 0..3 {
            close(rest(i, j), -rest(j, i), 1e-11);
        }
    }
}

#[test]
fn a_driven_arm_follows_the_published_equations() {
    let model = ArmModel { coulomb_nm: [0.0; 3], ..rubbing_1_5() };
    let arm = Arm::new(model, EDGE_S).unwrap();
    let published = Published(model);
    let (mut q, mut v) = ([0.1, 0.2, 0.4], [2.0, -1.0, 3.0]);
    let mut motion = ArmMotion::new(&arm, q, v);
    // Classical Runge-Kutta; its error at this step is about 1e-13.
    let h = 2e-5;
    for step in 0..5000_u32 {
        let phase = f64::from(step / 100);
        let torques_nm = [0.02 * phase.sin(), 0.03 * phase.cos(), -0.01 * phase.sin()];
        let at = edge(f64::from(step) * h);
        motion.step(at);
        motion.drive(at, torques_nm);
        let slope = |q: [f64; 3], v: [f64; 3]| (v, published.acceleration(q, v, torques_nm));
        let along = |x: [f64; 3], k: [f64; 3], by: f64| std::array::from_fn(|i| x[i] + by * k[i]);
        let (q1, v1) = slope(q, v);
        let (q2, v2) = slope(along(q, q1, 0.5 * h), along(v, v1, 0.5 * h));
        let (q3, v3) = slope(along(q, q2, 0.5 * h), along(v, v2, 0.5 * h));
        let (q4, v4) = slope(along(q, q3, h), along(v, v3, h));
        for i in 0..3 {
            q[i] += h / 6.0 * (q1[i] + 2.0 * q2[i] + 2.0 * q3[i] + q4[i]);
            v[i] += h / 6.0 * (v1[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
        }
    }
    let found = motion.step(edge(0.1));
    for i in 0..3 {
        close(found[i], q[i], 1e-11);
    }
}

#[test]
fn a_locked_joint_does_not_move_and_bears_what_comes() {
    let model = ArmModel { free: [true, false, true], ..rubbing_1_5() };
    let arm = Arm::new(model, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.1, 0.2, 0.3], [1.0, 1.0, 1.0]);
    motion.drive(0, [0.1, 0.5, 0.1]);
    for step in 1..100 {
        assert_eq!(motion.step(edge(f64::from(step) * 1e-3))[1], 0.2);
    }
}

#[test]
fn an_event_is_the_first_edge_outside_a_band() {
    let arm = Arm::new(ArmModel::premium_1_5(), EDGE_S).unwrap();
    let motion = ArmMotion::new(&arm, [0.1, 0.2, 0.3], [1.0, -2.0, 0.1]);
    let band = |low, high| Band { low, high, open: true };
    let bands = [band(0.0999, 0.1001), band(0.1999, 0.2001), band(0.2999, 0.3001)];
    let left = |angles: [f64; 3]| (0..3).any(|i| bands[i].left_by(angles[i]));
    let mut stepped = motion.clone();
    let first = (1..).find(|&edge| left(stepped.step(edge))).unwrap();
    // Ends of segments are events too.
    let (mut leaping, mut before, mut found) = (motion.clone(), 0, 0);
    while !left(leaping.step(found)) {
        before = found;
        found = leaping.next_event(found, 1 << 40, &bands).unwrap();
    }
    assert_eq!(found, first);
    let mut motion = motion;
    motion.step(before);
    assert_eq!(motion.next_event(before, found - 1, &bands), None);
    assert_eq!(motion.next_event(before, found, &bands), Some(found));
}

#[test]
fn an_arm_that_friction_holds_takes_one_segment_forever() {
    let arm = Arm::new(ArmModel { coulomb_nm: [5e-3; 3], ..ArmModel::premium_1_0() }, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.1, 0.2, 0.3], [0.0; 3]);
    let anywhere = [Band { low: -1e9, high: 1e9, open: true }; 3];
    assert_eq!(motion.next_event(0, 1 << 60, &anywhere), None);
    assert_eq!(motion.step(1 << 60), [0.1, 0.2, 0.3]);
    assert_eq!(motion.segments(), 1);
}

#[test]
fn an_arm_flung_into_singular_poses_comes_to_an_end() {
    let arm = Arm::new(ArmModel::premium_1_0(), EDGE_S).unwrap();
    for speeds in [[0.0, 1.0, -1.0], [0.0, -1.0, 1.0], [1.0, 3.0, -1.0], [0.0, 1.0, -1.0 - 1e-9]] {
        let mut motion = ArmMotion::new(&arm, [0.0, 0.1, 0.2], speeds);
        motion.step(edge(3.0));
        assert!(motion.segments() < 4_000_000);
    }
}

#[test]
fn impossible_arms_are_refused() {
    let good = ArmModel::premium_1_0();
    let flexible = Transmission { stiffness_nm_per_rad: 100.0, damping_nm_s_per_rad: 0.0 };
    for (bad, why) in [
        (ArmModel { lengths_m: [0.14, 0.0], ..good }, ArmError::Impossible("length")),
        (ArmModel { viscous_nm_s_per_rad: [0.0, -1.0, 0.0], ..good }, ArmError::Impossible("viscous friction")),
        (ArmModel { coulomb_nm: [f64::NAN, 0.0, 0.0], ..good }, ArmError::Impossible("Coulomb friction")),
        (ArmModel { rotor_kg_m2: [0.0, 0.0, -1e-9], ..good }, ArmError::Impossible("rotor")),
        (ArmModel { amplifier_s: -1e-3, ..good }, ArmError::Impossible("amplifier's time constant")),
        (ArmModel { gravity_m_per_s2: [0.0, f64::INFINITY, 0.0], ..good }, ArmError::Impossible("gravity")),
        (
            ArmModel { transmission: [Some(flexible), None, None], ..good },
            ArmError::Impossible("rotor behind a flexible transmission"),
        ),
        (ArmModel { turning_kg_m2: [0.0; 3], ..good }, ArmError::Massless),
        (ArmModel { swinging_kg_m2: [0.0, 1e-3], ..good }, ArmError::Massless),
        (ArmModel { coupling_kg_m2: 0.1, ..good }, ArmError::Massless),
    ] {
        assert_eq!(Arm::new(bad, EDGE_S).unwrap_err(), why);
    }
    assert_eq!(Arm::new(good, 0.0).unwrap_err(), ArmError::Impossible("clock period"));
    assert!(Arm::new(good, EDGE_S).is_ok() && Arm::new(rubbing_1_5(), EDGE_S).is_ok());
}
