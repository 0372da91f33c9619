//! Clocks so slow that several modes end within one edge: a motor with friction, diodes and a hand, under gates at
//! random, whose every state, count and number of modes is that of the precise world at every edge.

use hpu_cosim::scene::{Device, Hand, Scene};
use hpu_cosim::{AxisWorld, Plant, Schedule, World};
use hpu_datapath::LoopOut;
use hpu_signal::Clock;

use crate::beside::axis_scenes;
use crate::laws::Laws;
use crate::world::PreciseWorld;

/// Returns a motor with friction on a clock of this frequency, pushed by a constant torque or a spring.
fn motor(frequency_hz: u64, coulomb_nm: f64, torque_nm: Option<f64>) -> Scene {
    let mut scene = axis_scenes().into_iter().find(|scene| scene.name == "friction-wall").expect("it is shipped");
    scene.head.clock = Clock::new(frequency_hz).expect("a clock");
    scene.bridge.diode_drop_v = 0.7;
    scene.bridge.on_resistance_ohm = 0.2;
    let Device::Motor(motor) = &mut scene.device else { panic!("a motor") };
    motor.coulomb_friction_nm = coulomb_nm;
    if let Some(torque_nm) = torque_nm {
        scene.hand = Hand::ConstantTorque { torque_nm };
    }
    scene
}

#[test]
fn several_modes_that_end_within_an_edge_end_each_at_its_own_instant() {
    let mut state = 1u64;
    let mut next = |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 33) % below
    };
    let (mut modes, mut several) = (0, 0);
    for case in 0..60u64 {
        let frequency_hz = [300_000, 350_000, 500_000, 1_000_000][case as usize % 4];
        let torque_nm = [None, Some(0.0), Some(2e-3)][case as usize % 3];
        let scene = motor(frequency_hz, [1e-3, 4e-3, 8e-3, 15e-3][next(4) as usize], torque_nm);
        let laws = Laws::<4>::new(&scene);
        let plant = Plant::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let mut precise = PreciseWorld::new(&laws, 0, Schedule::default());
        let mut engine = AxisWorld::new(&plant, 0, Schedule::default());
        // Whether a shaft that the hand moves from the start was stuck before is a matter of words.
        let begun = engine.summary().mode_changes - precise.summary().mode_changes;
        let mut hold = 0;
        for edge in 1..=2000 {
            let before = precise.summary().mode_changes;
            precise.advance(edge, |_, _| {});
            while engine.edge() < edge {
                engine.advance(edge, |_, _| {});
            }
            let found = precise.summary().mode_changes;
            several += u64::from(found > before + 1);
            let place = format!("case {case}, {frequency_hz} Hz, edge {edge}");
            assert_eq!(engine.summary().mode_changes - begun, found, "{place}: modes");
            assert_eq!(engine.summary().encoder_edges, precise.summary().encoder_edges, "{place}: encoder edges");
            for (index, (got, exact)) in engine.reals(edge).iter().zip(precise.reals(edge)).enumerate() {
                let size = [10.0, 1000.0, 10.0][index];
                assert!((got - exact).abs() < 1e-14 * size, "{place}: {got} is not {exact}");
            }
            if hold == 0 {
                hold = [1, 1, 2, 3, 8][next(5) as usize];
                let leg = |of: u64| [(1, 0), (0, 1), (0, 0)][of as usize];
                let ((a_high, a_low), (b_high, b_low)) = (leg(next(3)), leg(next(3)));
                let out = LoopOut { a_high, a_low, b_high, b_low };
                precise.drive(out, &[0]);
                engine.drive(out, &[0]);
            }
            hold -= 1;
        }
        modes += precise.summary().mode_changes;
    }
    assert!(modes > 1000 && several > 100, "{modes} {several}");
}
