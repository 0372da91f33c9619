//! The segment on a gimbal: kinematics against known answers and quotients of differences, motion against the equations
//! of a point mass written out by hand.

use hpu_plant::Method;
use hpu_plant::arm::{Arm, ArmError, ArmMotion, Dynamics, Form, Gimbal, Joints, Recorded, Scalar, SteppedArm};
use std::f64::consts::PI;

const EDGE_S: f64 = 1e-6;
const ROTORS_KG_M2: [f64; 3] = [1e-4, 2e-4, 5e-6];

/// A gimbal with springs in place of its servos.
#[derive(Clone, Copy)]
struct Sprung {
    gimbal: Gimbal,
    stiffness_nm_per_rad: [f64; 3],
    rest_rad: [f64; 3],
}

impl Dynamics for Sprung {
    fn mass_kg_m2<T: Scalar>(&self, angles_rad: &[T; 3]) -> [[T; 3]; 3] {
        self.gimbal.mass_kg_m2(angles_rad)
    }

    fn potential_j<T: Scalar>(&self, angles_rad: &[T; 3]) -> T {
        (0..3).fold(self.gimbal.potential_j(angles_rad), |sum, i| {
            let bent = angles_rad[i].clone() - T::from(self.rest_rad[i]);
            sum + T::from(0.5 * self.stiffness_nm_per_rad[i]) * bent.clone() * bent
        })
    }

    fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3] {
        self.gimbal.tip_m(angles_rad)
    }

    fn surface_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> Option<T> {
        self.gimbal.surface_m(angles_rad)
    }
}

fn sprung() -> Sprung {
    Sprung { gimbal: Gimbal::default(), stiffness_nm_per_rad: [0.6, 0.5, 0.2], rest_rad: [0.1, -0.2, 1.4] }
}

fn free() -> Joints {
    Joints { free: [true; 3], rotor_kg_m2: ROTORS_KG_M2, ..Joints::default() }
}

fn near(found: f64, expected: f64, within: f64) {
    assert!((found - expected).abs() <= within, "{found}, not {expected}");
}

/// Postures over the workspace: pitch and roll within 55°, the crank from one dead centre to the other.
fn postures() -> Vec<[f64; 3]> {
    let tilt = |k: i32| Gimbal::TILT_RAD * f64::from(k) / 10.0;
    let turns = (0..=40).map(|k| PI * f64::from(k) / 40.0);
    let all = turns.flat_map(|crank| (-10..=10).flat_map(move |a| (-10..=10).map(move |b| [tilt(a), tilt(b), crank])));
    all.collect()
}

#[test]
fn the_crank_has_its_known_answers() {
    // Computed with 40 digits from the published lengths.
    let gimbal = Gimbal::default();
    let [least, most] = gimbal.radii_m();
    near(most - least, 25e-3, 1e-17);
    near(gimbal.radius_m(&0.0), 70.5e-3, 1e-16);
    near(gimbal.radius_m(&PI), 45.5e-3, 1e-16);
    near(gimbal.radius_m(&(PI / 3.0)), 63.2308082e-3, 5e-11);
    near(gimbal.lever_m(&(PI / 3.0)), -12.0127039e-3, 5e-11);
    let (steepest, at) = (0..=1_800_000)
        .map(|k| f64::from(k) * PI / 1_800_000.0)
        .map(|angle| (-gimbal.lever_m(&angle), angle))
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .unwrap();
    near(steepest, 12.7875665e-3, 5e-11);
    near(at.to_degrees(), 78.3425, 1e-3);
    // 8 N on the segment.
    near(8.0 * steepest, 0.102300532, 5e-10);
}

#[test]
fn every_posture_of_the_workspace_comes_back_from_its_tip() {
    for offset_m in [0.0, 7e-3] {
        let gimbal = Gimbal { offset_m, ..Gimbal::default() };
        for angles_rad in postures() {
            let tip_m = gimbal.tip_m(&angles_rad);
            let Some(found) = gimbal.angles_rad(tip_m).or_else(|| gimbal.angles_rad(tip_m.map(|x| x * (1.0 - 1e-15))))
            else {
                // Rounding may put the greatest tilt or a dead centre just outside.
                let edge = angles_rad[0].abs().max(angles_rad[1].abs()) >= Gimbal::TILT_RAD;
                assert!(edge || angles_rad[2] == 0.0 || angles_rad[2] == PI, "{angles_rad:?} is refused");
                continue;
            };
            let back_m = gimbal.tip_m(&found);
            for axis in 0..3 {
                near(back_m[axis], tip_m[axis], 1e-12);
            }
            // The crank's angle itself, where its lever is not near 0.
            near(found[0], angles_rad[0], 1e-12);
            near(found[1], angles_rad[1], 1e-12);
            if (0.1..PI - 0.1).contains(&angles_rad[2]) {
                near(found[2], angles_rad[2], 1e-12);
            }
        }
    }
}

#[test]
fn the_jacobian_is_that_of_differences() {
    let gimbal = Gimbal { offset_m: 3e-3, ..Gimbal::default() };
    for angles_rad in postures() {
        let jacobian_m = gimbal.jacobian_m(angles_rad);
        for joint in 0..3 {
            let moved = |by: f64| {
                let mut angles = angles_rad;
                angles[joint] += by;
                gimbal.tip_m(&angles)
            };
            let h = 1e-4;
            let [a, b, c, d] = [2.0 * h, h, -h, -2.0 * h].map(moved);
            for axis in 0..3 {
                // Of fourth order: the error is about h⁴ of 0.07 m.
                let quotient = (-a[axis] + 8.0 * b[axis] - 8.0 * c[axis] + d[axis]) / (12.0 * h);
                near(jacobian_m[axis][joint], quotient, 1e-12);
            }
        }
        // The determinant by pitch, radius and roll is r² cos θ; with pitch, roll and crank its sign and lever change.
        let [x, y, z] = jacobian_m;
        let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
            + x[2] * (y[0] * z[1] - y[1] * z[0]);
        let radius_m = gimbal.radius_m(&angles_rad[2]);
        near(determinant, -radius_m * radius_m * angles_rad[0].cos() * gimbal.lever_m(&angles_rad[2]), 1e-18);
    }
}

#[test]
fn impossible_parts_are_refused() {
    let default = Gimbal::default();
    assert_eq!(default.check(), Ok(()));
    let refused = [
        (Gimbal { crank_m: 0.0, ..default }, "crank"),
        (Gimbal { rod_m: 12.5e-3, ..default }, "rod, which must be longer than its crank,"),
        (Gimbal { rod_m: f64::NAN, ..default }, "rod, which must be longer than its crank,"),
        (Gimbal { offset_m: -1e-3, ..default }, "offset"),
        (Gimbal { mass_kg: -0.1, ..default }, "mass"),
        (Gimbal { length_m: 0.0, ..default }, "length"),
    ];
    for (gimbal, name) in refused {
        assert_eq!(gimbal.check(), Err(ArmError::Impossible(name)));
    }
    assert_eq!(default.crank_rad(45.4e-3), None);
    assert_eq!(default.crank_rad(70.6e-3), None);
    assert_eq!(default.crank_rad(f64::NAN), None);
    let tilted = default.tip_m(&[56f64.to_radians(), 0.0, 1.0]);
    assert_eq!(default.angles_rad(tilted), None);
}

/// Slopes of pitch, roll, crank and their speeds, from the equations of a point mass in polar coordinates:
/// `m r̈ - m r θ'² - m r cos²θ φ'² + m g cos θ cos φ = F`, and the two others.
fn slopes(device: &Sprung, x: [f64; 6]) -> [f64; 6] {
    let ([pitch, roll, crank, turn, lean, wind], m, g) = (x, device.gimbal.mass_kg, device.gimbal.gravity_m_per_s2);
    let (l1, l2) = (device.gimbal.crank_m, device.gimbal.rod_m);
    // Radius, its slope and its second derivative by the crank's angle, from the triangle of crank and rod.
    let rod_rad = (l1 * crank.sin() / l2).asin();
    let rod_slope = l1 * crank.cos() / (l2 * rod_rad.cos());
    let rod_bend = (-l1 * crank.sin() / l2 + rod_rad.sin() * rod_slope * rod_slope) / rod_rad.cos();
    let r = l1 * crank.cos() + l2 * rod_rad.cos();
    let lever = -l1 * crank.sin() - l2 * rod_rad.sin() * rod_slope;
    let bend = -l1 * crank.cos() - l2 * (rod_rad.cos() * rod_slope * rod_slope + rod_rad.sin() * rod_bend);
    let rising = lever * wind;
    let pull = |i: usize| -device.stiffness_nm_per_rad[i] * (x[i] - device.rest_rad[i]);
    let (st, ct, sf, cf) = (pitch.sin(), pitch.cos(), roll.sin(), roll.cos());
    let about_pitch = pull(0) - 2.0 * m * r * rising * turn - 0.5 * m * r * r * (2.0 * pitch).sin() * lean * lean
        + m * g * r * st * cf;
    let about_roll = pull(1) - 2.0 * m * r * ct * ct * rising * lean
        + m * r * r * (2.0 * pitch).sin() * turn * lean
        + m * g * r * ct * sf;
    let along = m * r * turn * turn + m * r * ct * ct * lean * lean - m * g * ct * cf;
    // F acts through the crank: torque = lever F, and r̈ = lever ψ'' + bend ψ'².
    let about_crank = pull(2) + lever * (along - m * bend * wind * wind);
    let [j1, j2, j3] = ROTORS_KG_M2;
    [
        turn,
        lean,
        wind,
        about_pitch / (m * r * r + j1),
        about_roll / (m * r * r * ct * ct + j2),
        about_crank / (m * lever * lever + j3),
    ]
}

fn rk4(device: &Sprung, x: [f64; 6], h: f64) -> [f64; 6] {
    let along = |slope: [f64; 6], by: f64| -> [f64; 6] { std::array::from_fn(|i| x[i] + by * slope[i]) };
    let one = slopes(device, x);
    let two = slopes(device, along(one, 0.5 * h));
    let three = slopes(device, along(two, 0.5 * h));
    let four = slopes(device, along(three, h));
    std::array::from_fn(|i| x[i] + h / 6.0 * (one[i] + 2.0 * (two[i] + three[i]) + four[i]))
}

#[test]
fn the_segment_moves_by_the_equations_of_a_point_mass() {
    let device = sprung();
    let arm = Arm::of(&device, free(), EDGE_S).unwrap();
    let (angles, speeds) = ([0.3, 0.4, 1.1], [2.0, -3.0, 4.0]);
    let mut motion = ArmMotion::new(&arm, angles, speeds);
    let mut stepped = SteppedArm::new(&arm, Method::Rk4, 20, angles, speeds);
    let [a, b, c] = angles;
    let [d, e, f] = speeds;
    let mut x = [a, b, c, d, e, f];
    let mut moved: f64 = 0.0;
    for step in 1..=50_000u64 {
        x = rk4(&device, x, 10e-6);
        if step % 1000 == 0 {
            let (found, by_steps) = (motion.step(step * 10), stepped.step(step * 10));
            for joint in 0..3 {
                moved = moved.max((x[joint] - angles[joint]).abs());
                near(found[joint], x[joint], 1e-11);
                near(by_steps[joint], x[joint], 1e-9);
            }
        }
    }
    assert!(moved > 1.0, "it hardly moved: {moved} rad");
}

#[test]
fn the_energy_stays_through_ten_seconds_of_free_motion() {
    let device = sprung();
    let arm: Arm<Recorded> = Arm::of(&device, free(), EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, [0.3, 0.4, 1.1], [2.0, -3.0, 4.0]);
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for centisecond in 1..=1000 {
        let edge = centisecond * 10_000;
        motion.step(edge);
        assert!(motion.stored_j(edge).abs() < 1e-12, "{} J after {edge} edges", motion.stored_j(edge));
        let radius_m = device.gimbal.radius_m(&motion.state(edge).angles_rad[2]);
        (least, most) = (least.min(radius_m), most.max(radius_m));
    }
    assert!(most - least > 10e-3, "it moved by {} m", most - least);
}

#[test]
fn the_literal_energies_are_those_of_the_paper() {
    let literal = Gimbal { form: Form::Literal, ..Gimbal::default() };
    let (m, l, g) = (literal.mass_kg, literal.length_m, literal.gravity_m_per_s2);
    for angles_rad @ [pitch, roll, crank] in postures().into_iter().step_by(7) {
        let mass = literal.mass_kg_m2(&angles_rad);
        let lever = literal.lever_m(&crank);
        near(mass[0][0], m * l * l, 1e-18);
        near(mass[1][1], m * l * l * pitch.cos() * pitch.cos(), 1e-18);
        near(mass[2][2], m * l * l * lever * lever, 1e-18);
        near(literal.potential_j(&angles_rad), m * g * l * pitch.cos() * roll.cos(), 1e-15);
    }
}
