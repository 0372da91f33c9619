//! The motion of plants under known logic: the project's own blocks, constant words.

use hpu::{Block, Plant, Status};
use hpu_cosim::scene::shipped as all_shipped;
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};
use hpu_datapath::Generic;
use hpu_signal::{Cycle, Observe};

use crate::common::{LOGIC, PLANT, set, shipped, written};

/// Runs a scene pin by pin with the loop as a golden model, and by the engine; both give the same energies to the bit.
/// Only loops that promise no repetition are compared: on a promise, the engine's motor cruises.
fn same_as_the_engine(name: &str, pairs: &[&str]) {
    let (file, pairs) = (shipped(name), set(pairs));
    let scene = file.parse(&pairs).expect("a scene");
    let simulation = WiredSimulation::new(&scene).expect("a simulation");
    let control = Control::default();
    let ran = simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut (), &control);

    let wiring = simulation.wiring().block();
    let generics = wiring.generics().into_iter().map(|(generic, value)| {
        let value = match value {
            Generic::Integer(value) => value.to_string(),
            Generic::Boolean(value) => value.to_string(),
        };
        (generic.to_string(), value)
    });
    let mut block = Block::new(wiring.name(), &generics.collect::<Vec<_>>()).expect("the loop");
    let mut plant = Plant::open(&file, &pairs).expect("a plant");
    let given = block.inputs().len();
    let mut driven = Vec::new();
    assert_eq!(plant.inputs()[..given], *block.inputs(), "{name}");
    let (mut promised, mut kept) = (0, 0);
    loop {
        let before = plant.words().to_vec();
        if plant.advance(1).is_err() {
            break;
        }
        if promised > 0 {
            assert_eq!(plant.words(), before, "{name}: promised at edge {}", plant.edge());
            (promised, kept) = (promised - 1, kept + 1);
        }
        let out = block.tick(&plant.words()[..given]).expect("words that fit");
        if driven != out {
            plant.drive(&out).expect("outputs that fit");
            driven = out;
            promised = 0;
        }
        promised = promised.max(plant.quiet());
    }
    // An axis and an arm are asked seldom.
    assert!(kept > plant.edges() / 2, "{name}: promises held for {kept} edges");
    assert_eq!(plant.edge(), ran.edges, "{name}");
    let summary = plant.summary();
    assert_eq!(format!("{:?}", summary.energy), format!("{:?}", ran.energy), "{name}");
    assert_eq!((summary.encoder_edges, summary.mode_changes), (ran.encoder_edges, ran.mode_changes), "{name}");
    assert!(ran.energy.exchanged_j > 0.0, "{name}");
}

/// Keeps the rows that a run shows with means and extremes, as `trace.csv` has them: edge and bits of the outputs.
struct Rows(usize, Vec<(u64, Vec<u64>)>);

impl Observe for Rows {
    fn measures(&self) -> bool {
        true
    }
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, Cycle(edge): Cycle, values: &[f64]) {
        self.1.push((edge, values[..self.0].iter().map(|value| value.to_bits()).collect()));
    }
}

/// Runs a scene by the engine, from event to event and edge by edge, and pin by pin by the library. Every row of either
/// run has the states that the library tells at its edge, to the bit.
fn rows_are_states(name: &str, pairs: &[&str]) {
    let (file, pairs) = (shipped(name), set(pairs));
    let scene = file.parse(&pairs).expect("a scene");
    let simulation = WiredSimulation::new(&scene).expect("a simulation");
    let run = |driver| {
        let mut rows = Rows(simulation.reals().len(), Vec::new());
        simulation.run(driver, &mut simulation.brief_trace(), &mut rows, &Control::default());
        rows.1
    };
    let (events, clock) = (run(Driver::Events), run(Driver::Clock));
    assert!(events == clock, "{name}: the rows of both drivers");

    let (mut wiring, mut plant) =
        (simulation.closed_loop().wiring_copy(), Plant::open(&file, &pairs).expect("a plant"));
    let (nets, given) = (simulation.nets(), wiring.inputs().len());
    let net = |name: &str| nets.iter().position(|net| net.name == name).expect("a net drives the device");
    let drives: Vec<usize> = plant.outputs().iter().map(|output| net(output.name)).collect();
    let mut columns = simulation.columns();
    columns.retain(|column| *column < simulation.reals().len());
    assert_eq!(columns.len(), plant.states().len(), "{name}");
    let (mut compared, mut rows) = (0, events.iter().peekable());
    loop {
        if let Some((edge, row)) = rows.next_if(|(edge, _)| *edge == plant.edge()) {
            for (state, &column) in columns.iter().enumerate() {
                let (told, shown) = (plant.state(state).expect("a state"), f64::from_bits(row[column]));
                assert_eq!(told.to_bits(), row[column], "{name}: state {state} at edge {edge}: {told:e}, {shown:e}");
            }
            compared += 1;
        }
        if plant.advance(1).is_err() {
            break;
        }
        wiring.step(&plant.words()[..given]);
        let out: Vec<i64> = drives.iter().map(|&net| wiring.words()[net]).collect();
        plant.drive(&out).expect("outputs that fit");
    }
    assert_eq!((compared, rows.next()), (events.len(), None), "{name}");
}

#[test]
fn a_motor_of_three_phases_behind_field_oriented_control_moves_as_in_the_engine() {
    let pushed = "hand={ kind = \"constant_torque\", torque = \"60 mN.m\" }";
    same_as_the_engine("foc-detents", &["run.duration=20 ms", pushed]);
    same_as_the_engine("foc-wall", &["run.duration=20 ms", pushed, "wall.position=5 mrad"]);
}

/// Two legs drive 12 V through two phases, each of 0.5 Ohm, 20 mOhm of a switch and 0.3 mH; the rotor hardly moves.
#[test]
fn the_current_of_three_phases_rises_as_their_resistance_and_inductance_say() {
    let mut plant = Plant::open(&shipped("foc-detents"), &set(&["hand={ kind = \"none\" }"])).expect("a plant");
    let at = |name: &str| plant.outputs().iter().position(|output| output.name == name).expect("an output");
    let (high, low, outputs) = (at("b_high"), at("c_low"), plant.outputs().len());
    let mut gates = vec![0; outputs];
    (gates[high], gates[low]) = (1, 1);
    plant.drive(&gates).expect("a leg up and a leg down");
    plant.advance(500).expect("10 us");
    // Across the field the voltage is 12 V / sqrt(3).
    let exact = 12.0 / 3f64.sqrt() / 0.52 * -(-10e-6 * 0.52 / 0.3e-3f64).exp_m1();
    let current = plant.state(0).expect("the current");
    assert!((current / exact - 1.0).abs() < 1e-4, "{current} for {exact}");
}

#[test]
fn rows_of_a_run_are_the_states_that_the_library_tells_to_the_bit() {
    let fine = "record.plant_rate=47 kHz";
    let near = "wall.position=0.02 rad";
    // Motors that cruise over their pulses, at a wall and before it.
    rows_are_states("hybrid-wall", &["run.duration=30 ms", near, fine]);
    rows_are_states("conventional-wall-1khz", &["run.duration=30 ms", near, fine]);
    rows_are_states(
        "hybrid-wall",
        &["run.duration=20 ms", near, fine, "method.pwm.bits=9", "method.pwm.dead_time=1 us"],
    );
    // Stick and slip, a bridge of mean voltages, a current amplifier, arms.
    rows_are_states("friction-wall", &["run.duration=30 ms", near, fine]);
    rows_are_states("hybrid-wall", &["run.duration=30 ms", near, fine, "model.bridge=averaged"]);
    rows_are_states("rail-drop", &["run.duration=50 ms", fine]);
    rows_are_states("phantom-thrown", &["run.duration=6 ms", fine]);
    rows_are_states("gimbal-spring", &["run.duration=20 ms", fine]);
}

#[test]
fn a_motor_driven_at_once_moves_as_in_the_engine() {
    let wall = ["method.pwm.duty=immediate", "run.duration=30 ms", "wall.position=0.05 rad"];
    same_as_the_engine("hybrid-wall", &wall);
    same_as_the_engine("conventional-wall-10khz", &["method.pwm.duty=immediate", "run.duration=10 ms", wall[2]]);
}

/// The hybrid loop as a golden model closes the loop around a scene with a method and around the same device without
/// one. Pins, states and energies are equal to the bit.
#[test]
fn a_plant_alone_moves_as_that_of_a_scene_with_a_method() {
    let mut theirs = Plant::open(&written(&[PLANT, LOGIC]), &[]).expect("a scene with a method");
    let mut alone = Plant::open(&written(&[PLANT]), &[]).expect("a plant alone");
    let names = |signals: &[hpu_signal::Signal]| signals.iter().map(|signal| signal.name).collect::<Vec<_>>();
    assert_eq!(names(alone.inputs()), ["a_pin", "b_pin", "index", "count", "contact"]);
    assert_eq!(names(alone.outputs()), names(theirs.outputs()));
    let mut block = Block::new("hybrid_loop", &[]).expect("the loop");
    let given = block.inputs().len();
    let (mut changes, mut touched) = (0, [false; 2]);
    let mut before = alone.words()[..2].to_vec();
    while theirs.advance(1).is_ok() {
        alone.advance(1).expect("as long");
        assert_eq!(alone.words()[..2], theirs.words()[..2], "at edge {}", alone.edge());
        for (touched, plant) in touched.iter_mut().zip([&alone, &theirs]) {
            *touched |= plant.words().last() == Some(&1);
        }
        let mut words = theirs.words()[..given].to_vec();
        words[..2].copy_from_slice(&alone.words()[..2]);
        changes += usize::from(words[..2] != before);
        before.copy_from_slice(&words[..2]);
        let out = block.tick(&words).expect("words that fit");
        theirs.drive(&out).expect("outputs that fit");
        alone.drive(&out).expect("outputs that fit");
    }
    assert_eq!((alone.edge(), changes > 100), (theirs.edge(), true));
    assert_eq!(format!("{:?}", alone.summary()), format!("{:?}", theirs.summary()));
    for index in 0..alone.states().len() {
        assert_eq!(alone.state(index).map(f64::to_bits), theirs.state(index).map(f64::to_bits));
    }
    // A scene with a wall tells its contact; without one none is touched.
    assert_eq!(touched, [false, true]);
    let wall = set(&["wall.position=0.01 rad"]);
    let mut walled = Plant::open(&written(&[PLANT]), &wall).expect("a plant and a wall");
    walled.advance(500_000).expect("a run");
    assert_eq!(walled.words()[4], 1);
}

#[test]
fn an_arm_moves_as_in_the_engine() {
    same_as_the_engine("phantom-thrown", &["run.duration=6 ms"]);
    same_as_the_engine("phantom-thrown-rtos", &["run.duration=6 ms"]);
}

#[test]
fn a_gimbal_moves_as_in_the_engine() {
    same_as_the_engine("gimbal-spring", &["run.duration=30 ms"]);
}

#[test]
fn every_shipped_scene_gives_pins_and_states_or_says_why_not() {
    for scene in all_shipped() {
        match Plant::open(&shipped(scene.name), &[]) {
            Ok(mut plant) => {
                let outputs = vec![0; plant.outputs().len()];
                plant.drive(&outputs).expect("all off");
                plant.advance(1000.min(plant.edges())).expect("a run");
                assert_eq!(plant.inputs().len(), plant.words().len(), "{}", scene.name);
                for (index, state) in plant.states().enumerate() {
                    assert!(plant.state(index).expect("a state").is_finite(), "{}: {}", scene.name, state.name);
                }
                for (signal, word) in plant.inputs().iter().zip(plant.words()) {
                    assert!(signal.format.holds((*word).into()), "{}: {} is {word}", scene.name, signal.name);
                }
            }
            Err(error) => panic!("{}: {error}", scene.name),
        }
    }
}

/// `V = R b w / K + K w` at a constant speed without Coulomb friction; the supply pushes against the positive angle.
#[test]
fn an_averaged_bridge_turns_the_motor_at_the_speed_of_its_mean_voltage() {
    let pairs = ["model.bridge=averaged", "device.coulomb_friction=0", "method.pwm.duty=immediate", "run.duration=2 s"];
    let mut plant = Plant::open(&shipped("free-motion"), &set(&pairs)).expect("a plant");
    assert_eq!(plant.outputs().len(), 1);
    plant.drive(&[1024]).expect("a quarter of full scale");
    plant.advance(plant.edges()).expect("a run");
    let (constant, resistance, viscous) = (0.0259, 2.345_660_377_358_490_3, 1.3e-6);
    let speed = -24.0 / 4.0 / (constant + resistance * viscous / constant);
    let index = plant.states().position(|state| state.name == "speed_rad_per_s").expect("a speed");
    let found = plant.state(index).expect("a state");
    assert!((found / speed - 1.0).abs() < 1e-9, "{found} rad/s, {speed} by the equation");
}

/// Without friction a constant force accelerates a mass: `v = F t / m`, against the positive direction.
#[test]
fn an_amplifier_accelerates_a_mass_by_its_force() {
    let pairs = ["device.damping=0", "device.coulomb=0", "hand={ kind = \"none\" }", "run.duration=10 ms"];
    let mut plant = Plant::open(&shipped("rail-drop"), &set(&pairs)).expect("a plant");
    plant.drive(&[6554]).expect("a tenth of full scale");
    plant.advance(plant.edges()).expect("a run");
    let names: Vec<_> = plant.states().map(|state| state.name).collect();
    assert_eq!(names, ["speed_m_per_s", "position_m", "force_n"]);
    let force = 6554.0 / 65536.0 * 10.0;
    let speed = -force * 10e-3 / 0.09;
    let found = plant.state(0).expect("a speed");
    assert!((found / speed - 1.0).abs() < 1e-12, "{found} m/s, {speed} by the equation");
    assert_eq!(plant.state(2), Ok(-force));
    let outside = plant.drive(&[1 << 17]).expect_err("no such word");
    assert_eq!(
        (outside.status, outside.text.as_str()),
        (Status::Argument, "output command is 131072; accepted: -65536 to 65535")
    );
}
