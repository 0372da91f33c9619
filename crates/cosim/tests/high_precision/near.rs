//! Crossings placed next to a clock edge on purpose, nearer than chance ever does: a motor with its winding, its
//! friction and its hand, whose angle at an edge lies beside a limit of its count by a chosen distance.

use hpu_cosim::scene::{Device, Hand, Scene};
use hpu_cosim::{AxisWorld, Plant, Schedule, World};
use hpu_datapath::{LoopIn, LoopOut};

use crate::beside::axis_scenes;
use crate::fixed::Fixed;
use crate::laws::Laws;
use crate::world::PreciseWorld;

/// The limit, in counts.
const COUNT: i64 = 1000;

/// Returns a braked motor under a constant torque.
fn braked(angle_rad: f64, speed_rad_per_s: f64, torque_nm: f64) -> Scene {
    let mut scene = axis_scenes().into_iter().find(|scene| scene.name == "hybrid-wall").expect("it is shipped");
    let Device::Motor(motor) = &mut scene.device else { panic!("a motor") };
    (motor.initial_angle_rad, motor.initial_speed_rad_per_s) = (angle_rad, speed_rad_per_s);
    scene.hand = Hand::ConstantTorque { torque_nm };
    scene
}

/// Connects both legs to ground from edge 1 on.
fn brake(world: &mut impl World<In = LoopIn<i64>, Out = LoopOut<i64>>) {
    world.advance(1, |_, _| {});
    world.drive(LoopOut { a_high: 0, a_low: 1, b_high: 0, b_low: 1 }, &[0]);
}

/// Returns the edge of the first crossing.
fn first_crossing(mut world: impl World<In = LoopIn<i64>, Out = LoopOut<i64>>) -> u64 {
    brake(&mut world);
    while world.summary().encoder_edges == 0 {
        world.advance(50_000_000, |_, _| {});
    }
    world.edge()
}

/// Returns the distance from the limit to the angle at an edge, at which the angle may have crossed.
fn beyond(scene: &Scene, edge: u64) -> Fixed<4> {
    let laws = Laws::<4>::new(scene);
    let mut world = PreciseWorld::new(&laws, 0, Schedule::default());
    brake(&mut world);
    while world.edge() < edge {
        world.advance(edge, |_, _| {});
    }
    world.angle() - Fixed::of(COUNT as f64 * scene.encoder.count_rad())
}

#[test]
fn crossings_a_billionth_of_a_billionth_of_a_billionth_from_an_edge_fall_on_the_right_side() {
    let count_rad = braked(0.0, 0.0, 0.0).encoder.count_rad();
    let limit_rad = COUNT as f64 * count_rad;
    for edge in [50, 777, 4096, 50_000, 1_000_000] {
        // Without a torque the angle comes as near to the limit as an angle in f64 can.
        let speed = 0.4 * count_rad / (edge as f64 * 2e-8);
        let short = beyond(&braked(limit_rad, speed, 0.0), edge).float();
        let angle = limit_rad - short;
        let rest = beyond(&braked(angle, speed, 0.0), edge);
        // The torque makes up the rest: the angle is affine in it.
        let torque = 2f64.powi(-40);
        let per_nm = (beyond(&braked(angle, speed, torque), edge) - rest).float() / torque;
        for asked in [1e-18, 1e-21, 1e-24, 1e-27] {
            for gap in [asked, -asked] {
                let scene = braked(angle, speed, (Fixed::of(gap) - rest).float() / per_nm);
                let real = beyond(&scene, edge).float();
                assert!((real - gap).abs() < 0.1 * asked, "{real:e}, not {gap:e}, at edge {edge}");
                let right = if gap > 0.0 { edge } else { edge + 1 };
                let laws = Laws::<4>::new(&scene);
                assert_eq!(first_crossing(PreciseWorld::new(&laws, 0, Schedule::default())), right, "{gap:e}");
                let plant = Plant::new(&scene).unwrap_or_else(|error| panic!("{error}"));
                let engine = first_crossing(AxisWorld::new(&plant, 0, Schedule::default()));
                assert_eq!(engine, right, "{gap:e} rad beyond the limit at edge {edge}");
            }
        }
    }
}
