//! Motions in whole numbers: their crossings fall exactly on a clock edge, so rounding must not decide them at any
//! number of places.

use hpu_cosim::scene::{Device, Encoder, Hand, Scene};
use hpu_cosim::{AxisWorld, Pins, Plant, Schedule, World};
use hpu_datapath::LoopIn;
use hpu_signal::Clock;

use crate::beside::axis_scenes;
use crate::laws::Laws;
use crate::world::PreciseWorld;

/// Edges of every motion.
const EDGES: i64 = 1 << 23;
/// The clock, in edges a second.
const CLOCK_HZ: u64 = 1 << 25;
/// A count, in units of 2^-49 m.
const COUNT: i64 = 1 << 32;

/// A throw, in units of 2^-49 m: the position after `n` edges is `start + speed n + bend n^2`.
struct Throw {
    start: i64,
    speed: i64,
    bend: i64,
}

impl Throw {
    fn count(&self, edge: i64) -> i64 {
        (self.start + self.speed * edge + self.bend * edge * edge).div_euclid(COUNT)
    }

    /// Returns a mass without friction that moves like this; every number of the scene is a power of two, or a small
    /// multiple.
    fn scene(&self) -> Scene {
        let unit_m = 2f64.powi(-49);
        let clock_hz = CLOCK_HZ as f64;
        let mut scene = axis_scenes().into_iter().find(|scene| scene.name == "leak-bounce").expect("it is shipped");
        let Device::Mass(mass) = &mut scene.device else { panic!("a mass") };
        (mass.mass_kg, mass.damping_n_s_per_m) = (0.125, 0.0);
        mass.initial_position_m = self.start as f64 * unit_m;
        mass.initial_speed_m_per_s = self.speed as f64 * unit_m * clock_hz;
        let acceleration = 2.0 * self.bend as f64 * unit_m * clock_hz * clock_hz;
        scene.hand = Hand::ConstantTorque { torque_nm: 0.125 * acceleration };
        scene.encoder = Encoder::Linear { resolution_m: COUNT as f64 * unit_m };
        scene.clock = Clock::new(CLOCK_HZ).expect("a clock");
        scene.run.duration_s = EDGES as f64 / clock_hz;
        scene
    }
}

/// Checks that the world shows the pins of the count that whole numbers give, from edge to edge.
#[track_caller]
fn follow(throw: &Throw, mut world: impl World<In = LoopIn<i64>>) {
    let mut input = LoopIn { a_pin: 0, b_pin: 0, reference: 0, stiffness: 0, damping: 0, period: 0, scale: 0 };
    let mut shown = move |world: &dyn Fn(&mut LoopIn<i64>)| {
        world(&mut input);
        Pins { a: input.a_pin, b: input.b_pin }
    };
    let mut count = throw.count(0);
    assert_eq!(shown(&|input| world.place(input)), Pins::at(count), "at the start");
    let mut crossings = 0;
    for edge in 1..=EDGES {
        let now = throw.count(edge);
        if now != count || edge == EDGES {
            while world.edge() < edge as u64 {
                assert_eq!(shown(&|input| world.place(input)), Pins::at(count), "before edge {edge}");
                world.advance(edge as u64, |_, _| {});
            }
            crossings += now.abs_diff(count);
            count = now;
            assert_eq!(shown(&|input| world.place(input)), Pins::at(count), "at edge {edge}");
            assert_eq!(world.summary().encoder_edges, crossings, "at edge {edge}");
        }
    }
    assert!(crossings > 2000, "{crossings}");
}

#[test]
fn crossings_exactly_on_a_clock_edge_belong_to_it() {
    let mut throws = Vec::new();
    for start in [0, -1, COUNT / 2] {
        for speed in [1 << 23, -(1 << 23), 3 << 20] {
            // Thrown from 0 with 2^23 against a bend, the mass touches the limit 4096 counts away for a single edge.
            for bend in [0, 1, -1] {
                throws.push(Throw { start, speed, bend });
            }
        }
    }
    for throw in &throws {
        let scene = throw.scene();
        let plant = Plant::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        follow(throw, PreciseWorld::new(&Laws::<4>::new(&scene), 0, Schedule::default()));
        follow(throw, AxisWorld::new(&plant, 0, Schedule::default()));
    }
}
