//! Fixed steps of the arm against its series: orders of convergence, straight lines, and friction as in ordinary
//! programs.

use crate::arms::rubbing_1_5;
use hpu_plant::arm::{Arm, ArmModel, ArmMotion, SteppedArm, Transmission};
use hpu_plant::{Band, Method};

const EDGE_S: f64 = 20e-9;
const START: [[f64; 3]; 2] = [[0.1, 0.2, 0.4], [2.0, -1.0, 3.0]];
const END: u64 = 1_600_000;

fn methods() -> [(Method, u32); 4] {
    [(Method::Euler, 1), (Method::SemiImplicit, 1), (Method::Midpoint, 2), (Method::Rk4, 4)]
}

fn models() -> [ArmModel; 3] {
    let rigid = ArmModel { coulomb_nm: [0.0; 3], ..rubbing_1_5() };
    let soft = Some(Transmission { stiffness_nm_per_rad: 60.0, damping_nm_s_per_rad: 2e-3 });
    [rigid, ArmModel { amplifier_s: 2e-3, ..rigid }, ArmModel { transmission: [soft; 3], amplifier_s: 2e-3, ..rigid }]
}

/// Returns the greatest error of an encoder's angle after 32 ms under held torques.
fn error(arm: &Arm, method: Method, edges: u64) -> f64 {
    let drive = [0.05, -0.03, 0.02];
    let mut exact = ArmMotion::new(arm, START[0], START[1]);
    let mut stepped = SteppedArm::new(arm, method, edges, START[0], START[1]);
    exact.drive(0, drive);
    stepped.drive(drive);
    let (exact, stepped) = (exact.step(END), stepped.step(END));
    (0..3).map(|i| (exact[i] - stepped[i]).abs()).fold(0.0, f64::max)
}

#[test]
fn each_method_converges_by_its_order_without_coulomb_friction() {
    // 0.8 ms, 0.4 ms, 20 us: below each model's time constants, and long enough that rounding has no effect.
    for (model, edges) in models().into_iter().zip([40_000, 20_000, 1000]) {
        let arm = Arm::new(model, EDGE_S).unwrap();
        for (method, order) in methods() {
            let ratio = error(&arm, method, edges) / error(&arm, method, edges / 2);
            let expected = 2f64.powi(order as i32);
            assert!((ratio / expected - 1.0).abs() < 0.25, "{method:?} at {edges} edges: {ratio}, not {expected}");
        }
    }
}

#[test]
fn between_the_ends_of_a_step_encoders_go_straight() {
    let [model, ..] = models();
    let arm = Arm::new(model, EDGE_S).unwrap();
    for (method, _) in methods() {
        let mut stepped = SteppedArm::new(&arm, method, 1000, START[0], START[1]);
        let from = stepped.step(0);
        let ends = stepped.clone().step(1000);
        for edge in 1..1000 {
            let angles = stepped.step(edge);
            for i in 0..3 {
                let line = from[i] + (ends[i] - from[i]) * edge as f64 / 1000.0;
                assert!((angles[i] - line).abs() <= 1e-16, "{method:?}");
            }
        }
    }
}

#[test]
fn an_event_is_the_first_edge_outside_a_band_or_a_steps_end() {
    let [_, _, model] = models();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let band = |low: f64| Band { low, high: low + 2e-6, open: true };
    for (method, _) in methods() {
        let mut leaping = SteppedArm::new(&arm, method, 700, START[0], START[1]);
        let mut edge = 0;
        let mut seen = 0;
        while edge < 20_000 {
            let bands = leaping.step(edge).map(|angle| band(angle - 1e-6));
            let mut stepping = leaping.clone();
            let found = leaping.next_event(edge, 20_000, &bands).unwrap();
            let first = (edge + 1..).find(|&at| {
                let angles = stepping.step(at);
                at % 700 == 0 || at == 20_000 || (0..3).any(|i| bands[i].left_by(angles[i]))
            });
            assert_eq!(Some(found), first);
            assert_eq!(leaping.step(found), stepping.step(found));
            (edge, seen) = (found, seen + 1);
            if edge == 19_600 {
                break;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}

#[test]
fn friction_holds_what_pulls_less_and_stops_what_turns() {
    let model = rubbing_1_5().balanced();
    let arm = Arm::new(model, EDGE_S).unwrap();
    for (method, _) in methods() {
        let mut stepped = SteppedArm::new(&arm, method, 1000, START[0], [0.0; 3]);
        stepped.drive([0.0099, -0.0099, 0.0099]);
        assert_eq!(stepped.step(1_000_000), START[0]);
        stepped.drive([0.02; 3]);
        assert!(stepped.step(2_000_000).iter().zip(START[0]).all(|(now, then)| *now > then));
        stepped.drive([0.0; 3]);
        stepped.step(50_000_000);
        let state = stepped.state(50_000_000);
        assert_eq!((state.speeds_rad_per_s, state.stuck), ([0.0; 3], [true; 3]), "{method:?}");
    }
}

#[test]
fn a_fine_step_comes_to_where_the_series_comes_with_friction_too() {
    let model = rubbing_1_5().balanced();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let rest = |method| {
        let mut stepped = SteppedArm::new(&arm, method, 50, START[0], [0.5, 0.5, 0.5]);
        stepped.step(50_000_000)
    };
    let exact = ArmMotion::new(&arm, START[0], [0.5; 3]).step(50_000_000);
    for (method, _) in methods() {
        let found = rest(method);
        for i in 0..3 {
            // A stop is noticed up to one step of 1 us late; at about 10 rad/s^2 that is far below this bound.
            assert!((found[i] - exact[i]).abs() < 1e-5, "{method:?}: {found:?}, not {exact:?}");
        }
    }
}

#[test]
fn steps_that_are_too_long_lose_the_arm_and_leave_it_where_it_was() {
    let [_, _, model] = models();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let mut stepped = SteppedArm::new(&arm, Method::Euler, 2_000_000, START[0], START[1]);
    stepped.drive([1.0; 3]);
    let angles = stepped.step(4_000_000_000);
    assert!(stepped.is_lost() && angles.iter().all(|angle| angle.is_finite()));
}

/// Returns one joint that moves without any coupling: its inertia, and the arm. Coulomb friction is 0.01 N.m.
fn lone(viscous: f64) -> (f64, ArmModel) {
    let model = ArmModel {
        free: [false, true, false],
        viscous_nm_s_per_rad: [viscous; 3],
        coulomb_nm: [0.01; 3],
        ..rubbing_1_5().balanced()
    };
    (model.swinging_kg_m2[0] + model.rotor_kg_m2[1], model)
}

/// Returns motor 2's angle after this number of planned steps.
fn planned(arm: &Arm, method: Method, edges: u64, steps: u64, speed: f64, torque: impl Fn(f64) -> f64) -> (f64, u64) {
    let mut stepped = SteppedArm::new(arm, method, edges, [0.0; 3], [0.0, speed, 0.0]);
    let command = |p: &[f64; 3], _: &[f64; 3]| [0.0, torque(p[1]), 0.0];
    for step in 1..=steps {
        let now = command(stepped.motor_angles_rad(), stepped.motor_speeds_rad_per_s());
        stepped.plan(edges, now, command);
        stepped.step(step * edges);
    }
    (stepped.motor_angles_rad()[1], stepped.mode_changes())
}

#[test]
fn a_joint_of_a_planned_step_turns_or_stops_where_its_speed_is_0() {
    // Thrown at 0.1 rad/s against a torque, the joint slows down by (torque + friction) / inertia and turns after
    // v²/2a. It comes back by (torque - friction) / inertia, or stays if friction is greater. All methods but the two
    // of Euler are exact for these parabolas.
    let (inertia, model) = lone(0.0);
    let arm = Arm::new(model, EDGE_S).unwrap();
    for method in [Method::Midpoint, Method::Rk4] {
        for (torque, edges) in [(0.025, 50_000), (0.025, 7001), (0.004, 50_000)] {
            let (brake, back) = ((torque + 0.01) / inertia, (torque - 0.01f64).max(0.0) / inertia);
            let steps = 2_500_000 / edges;
            let left_s = (steps * edges) as f64 * EDGE_S - 0.1 / brake;
            assert!(left_s > 0.0);
            let expected = 0.5 * 0.1 * 0.1 / brake - 0.5 * back * left_s * left_s;
            let (angle, changes) = planned(&arm, method, edges, steps, 0.1, |_| -torque);
            assert!((angle - expected).abs() < 1e-12, "{method:?} {torque} {edges}: {angle} {expected}");
            assert_eq!(changes, 1);
        }
    }
}

#[test]
fn a_command_that_follows_the_arm_is_a_part_of_the_method() {
    // A spring at the motor and viscous friction only: a damped oscillator's closed form, and the method's order.
    let (inertia, model) = lone(2e-4);
    let arm = Arm::new(ArmModel { coulomb_nm: [0.0; 3], ..model }, EDGE_S).unwrap();
    let stiffness = 5.0;
    let decay = 2e-4 / (2.0 * inertia);
    let swing = (stiffness / inertia - decay * decay).sqrt();
    let end_s = 3_200_000.0 * EDGE_S;
    let exact = (-decay * end_s).exp() * (swing * end_s).sin() / swing;
    for (method, order) in [(Method::Midpoint, 2), (Method::Rk4, 4)] {
        let error =
            |edges: u64| (planned(&arm, method, edges, 3_200_000 / edges, 1.0, |p| -stiffness * p).0 - exact).abs();
        let ratio = error(20_000) / error(10_000);
        let expected = 2f64.powi(order);
        assert!((ratio / expected - 1.0).abs() < 0.25, "{method:?}: {ratio}, not {expected}");
    }
}

#[test]
fn joints_at_rest_are_held_together_and_not_one_by_one() {
    // In this pose motor 2 pulls joint 3 by m23 times the acceleration of joint 2; joint 3 has no torque of its own to
    // move it.
    let model = ArmModel { coulomb_nm: [0.01; 3], ..rubbing_1_5().balanced() };
    let arm = Arm::new(model, EDGE_S).unwrap();
    let pose = [0.0, 1.2, 0.2];
    let run = |edges: Option<u64>| {
        let torques = [0.0, 0.2, 0.0];
        if let Some(edges) = edges {
            let mut stepped = SteppedArm::new(&arm, Method::Rk4, edges, pose, [0.0; 3]);
            stepped.drive(torques);
            return stepped.step(1_000_000);
        }
        let mut exact = ArmMotion::new(&arm, pose, [0.0; 3]);
        exact.drive(0, torques);
        exact.step(1_000_000)
    };
    let (exact, stepped) = (run(None), run(Some(1000)));
    assert!((exact[2] - pose[2]).abs() > 1e-3, "{exact:?}: joint 3 has to move for this to say anything");
    for joint in 0..3 {
        assert!((exact[joint] - stepped[joint]).abs() < 1e-6, "{exact:?} {stepped:?}");
    }
}

#[test]
fn sines_of_angles_nearby_are_those_of_the_angles() {
    use hpu_plant::arm::kinematics::Sines;
    for at in [-3.0, -0.4, 0.0, 0.7, 1.5] {
        let near = Sines::of([at; 3]);
        for step in -400..=400 {
            let angle = at + f64::from(step) * 1e-4;
            let [(sine, cosine), ..] = near.near([angle, at, at]);
            assert!((sine - angle.sin()).abs() < 3e-16 && (cosine - angle.cos()).abs() < 3e-16, "{at} {angle}");
        }
    }
    let none = Sines::of([0.0; 3]).near([f64::NAN, 0.0, 0.0]);
    assert!(none[0].0.is_nan() && none[1] == (0.0, 1.0));
}
