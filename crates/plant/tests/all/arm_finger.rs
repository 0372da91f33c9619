//! A finger on a surface: a mass that falls on a pad, in closed form, and the crank of a gimbal under a moving finger.

use hpu_plant::Method;
use hpu_plant::arm::{Arm, ArmMotion, Dynamics, Finger, Gimbal, Joints, Recorded, Scalar, SteppedArm};

const EDGE_S: f64 = 1e-7;
const MASS_KG: f64 = 0.1;
/// Height of the surface per angle of joint 1.
const LEVER_M: f64 = 0.02;

/// A mass on a rail that joint 1 moves, below a finger.
struct Rail;

impl Dynamics for Rail {
    fn mass_kg_m2<T: Scalar>(&self, _: &[T; 3]) -> [[T; 3]; 3] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| T::from(if i == j { MASS_KG * LEVER_M * LEVER_M } else { 0.0 }))
        })
    }

    fn potential_j<T: Scalar>(&self, _: &[T; 3]) -> T {
        T::from(0.0)
    }

    fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3] {
        [T::from(LEVER_M) * angles_rad[0].clone(), T::from(0.0), T::from(0.0)]
    }

    fn surface_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> Option<T> {
        Some(T::from(LEVER_M) * angles_rad[0].clone())
    }
}

fn rail(damping_n_s_per_m: f64) -> Arm<Recorded> {
    let joints = Joints { free: [true, false, false], ..Joints::default() };
    Arm::of(&Rail, joints, EDGE_S).unwrap().with_finger(Finger { stiffness_n_per_m: 400.0, damping_n_s_per_m })
}

/// Depth, speed and force of a mass in the pad, a time after it touched at a speed: a damped oscillator.
fn in_the_pad(damping_n_s_per_m: f64, speed_m_per_s: f64, t: f64) -> [f64; 3] {
    let decay = damping_n_s_per_m / (2.0 * MASS_KG);
    let turn = (400.0 / MASS_KG - decay * decay).sqrt();
    let shrunk = speed_m_per_s * (-decay * t).exp();
    let depth = shrunk * (turn * t).sin() / turn;
    let speed = shrunk * (turn * t).cos() - decay * depth;
    [depth, speed, 400.0 * depth + damping_n_s_per_m * speed]
}

#[test]
fn a_mass_bounces_off_a_pad_as_a_damped_oscillator_does() {
    for damping in [0.0, 2.0, 8.0] {
        let arm = rail(damping);
        let mut motion = ArmMotion::new(&arm, [0.0; 3], [10.0, 0.0, 0.0]);
        // At 0.2 m/s the surface comes to the target at 1 cm after 50 ms.
        motion.press(0, 0.01, 0.0);
        let touched_s = 0.05;
        // The force ends where tan(turn t) = -c turn / (k - c decay), in the half period.
        let decay = damping / (2.0 * MASS_KG);
        let turn = (400.0 / MASS_KG - decay * decay).sqrt();
        let left_s = (damping * turn).atan2(damping * decay - 400.0) / turn;
        let [left_m, leaving, force_n] = in_the_pad(damping, 0.2, left_s);
        assert!(force_n.abs() < 1e-12, "the oracle's force is {force_n} N where it should end");
        let mut pressed = 0;
        for k in 1..=1500u64 {
            // Not at the instants of touch themselves.
            let edge = k * 1_000 + 7;
            let t = edge as f64 * EDGE_S;
            motion.step(edge);
            let state = motion.state(edge);
            let (height, speed) = (LEVER_M * state.angles_rad[0], LEVER_M * state.speeds_rad_per_s[0]);
            let [depth, expected, force_n] = if t < touched_s {
                [0.2 * t - 0.01, 0.2, 0.0]
            } else if t - touched_s < left_s {
                pressed += 1;
                in_the_pad(damping, 0.2, t - touched_s)
            } else {
                [left_m + leaving * (t - touched_s - left_s), leaving, 0.0]
            };
            assert!((height - 0.01 - depth).abs() < 1e-13, "{damping}: {height} m at {t} s, not {}", 0.01 + depth);
            assert!((speed - expected).abs() < 1e-12, "{damping}: {speed} m/s at {t} s, not {expected}");
            assert!((state.finger_n - force_n).abs() < 1e-9, "{damping}: {} N at {t} s, not {force_n}", state.finger_n);
            let energy = motion.energy(edge);
            let kinetic_j = 0.5 * MASS_KG * (speed * speed - 0.04);
            assert!((energy.finger_j - kinetic_j).abs() < 1e-14, "{} J, not {kinetic_j}", energy.finger_j);
        }
        assert!(pressed > 200, "pressed at {pressed} instants");
        // Touched, left, and back in form; without damping it leaves where it touched.
        assert_eq!(motion.mode_changes(), if damping == 0.0 { 2 } else { 3 }, "damping {damping}");
    }
}

#[test]
fn a_finger_that_comes_down_touches_where_its_target_meets_the_surface() {
    // The surface rests at 5 mm; the target starts at 6 mm and comes down with 10 mm/s: it touches after 100 ms.
    let arm = rail(2.0);
    let mut motion = ArmMotion::new(&arm, [0.25, 0.0, 0.0], [0.0; 3]);
    motion.press(0, 6e-3, -10e-3);
    let force_n = |motion: &mut ArmMotion<'_, Recorded>, edge: u64| {
        motion.step(edge);
        motion.state(edge).finger_n
    };
    assert_eq!(force_n(&mut motion, 999_999), 0.0);
    // The pad's damper pushes from the first instant: 2 N·s/m × 10 mm/s.
    assert!((force_n(&mut motion, 1_000_001) - 0.02).abs() < 1e-6);
    // Told to stop, it keeps its spring's force and loses its damper's.
    motion.step(1_050_000);
    let at_m = 6e-3 - 10e-3 * 0.105;
    motion.press(1_050_000, at_m, 0.0);
    let state = motion.state(1_050_000);
    let (height_m, speed) = (LEVER_M * state.angles_rad[0], LEVER_M * state.speeds_rad_per_s[0]);
    assert!((state.finger_n - (400.0 * (height_m - at_m) + 2.0 * speed)).abs() < 1e-12);
    // Lifted far away at once, it presses no longer.
    motion.press(1_050_001, 1.0, 0.0);
    assert_eq!(motion.state(1_050_001).finger_n, 0.0);
}

#[test]
fn steps_of_a_textbook_converge_to_the_exact_touch() {
    let joints = Joints {
        free: [true; 3],
        rotor_kg_m2: [1e-4, 1e-4, 5e-6],
        viscous_nm_s_per_rad: [0.05, 0.05, 0.005],
        ..Joints::default()
    };
    let finger = Finger { stiffness_n_per_m: 300.0, damping_n_s_per_m: 3.0 };
    let gimbal = Gimbal::default();
    let arm = Arm::of(&gimbal, joints, 1e-6).unwrap().with_finger(finger);
    let start = [0.1, -0.1, 1.5];
    let target_m = gimbal.radius_m(&1.5) + 1e-3;
    let torques_nm = [-0.02, 0.02, -0.03];
    let mut exact = ArmMotion::new(&arm, start, [0.0; 3]);
    exact.press(0, target_m, -5e-3);
    exact.drive(0, torques_nm);
    exact.step(150_000);
    let expected = exact.state(150_000);
    assert!(expected.finger_n > 0.1, "{} N", expected.finger_n);
    let error_rad = |edges: u64| {
        let mut stepped = SteppedArm::new(&arm, Method::Rk4, edges, start, [0.0; 3]);
        for step in 0..150_000 / edges {
            stepped.step(step * edges);
            stepped.press(0, target_m, -5e-3);
            stepped.drive(torques_nm);
        }
        let found = stepped.step(150_000);
        (0..3).map(|i| (found[i] - expected.motor_angles_rad[i]).abs()).fold(0.0, f64::max)
    };
    // The target's height is that of the step's start: of first order.
    let (coarse, fine) = (error_rad(1000), error_rad(100));
    assert!(coarse < 1e-3 && fine < 0.2 * coarse, "{coarse} and {fine} rad");
    let residual_j = {
        let energy = exact.energy(150_000);
        energy.source_j + energy.finger_j - exact.stored_j(150_000) - energy.dissipated_j()
    };
    assert!(residual_j.abs() < 1e-14, "{residual_j} J");
    assert!(exact.energy(150_000).finger_j < -1e-6, "{:?}", exact.energy(150_000));
}
