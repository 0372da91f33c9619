//! Every register edge against an independent integration of the plant with 58 decimal places.
//!
//! [`world::PreciseWorld`] closes the same wirings as the engine's own plant does, with other code and another method:
//! the state is stepped from event to event by tabulated matrix exponentials in fixed point. It looks for a crossing of
//! the encoder wherever a bound on the acceleration does not exclude one. Slip and stick of friction, diodes and open
//! windings are modes; the world changes between them at instants found to all places. Both loops run from tick to
//! tick. Edge, every net and the number of modes must agree.
//!
//! [`phases`] does the same for a motor of three phases, by Taylor series.
//!
//! `cargo test -p hpu-cosim --test high_precision falls -- --nocapture --test-threads 1` shows the table.

mod beside;
mod exact;
mod fixed;
mod flow;
mod laws;
mod mean;
mod near;
mod phases;
mod shaft;
mod slow;
mod winding;
mod world;

use beside::{
    Outcome, Ulps, axis_scenes, begun_at, engine_beside_precise, outputs_beside_precise,
    precise_beside_twice_as_precise,
};
use hpu_cosim::scene::{BridgeModel, Datapath, Device, Hand, Scene};
use laws::obstacle;

/// The extent over which each scene is compared, from one start after another: until a number of edges or of ticks is
/// reached. A scene that has come to a tenth of `modes` ends of modes by then goes on to that number.
#[derive(Clone, Copy)]
struct Enough {
    edges: u64,
    ticks: u64,
    modes: u64,
}

impl Enough {
    /// Returns whether a scene has been compared over this extent.
    fn is_reached(&self, sum: &Outcome) -> bool {
        let is_long = sum.edges >= self.edges || sum.ticks >= self.ticks;
        is_long && !(self.modes / 10..self.modes).contains(&sum.mode_changes)
    }
}

/// In the test command.
const SHORT: Enough = Enough { edges: 80_000_000, ticks: 25_000, modes: 0 };
/// In `testbench/long.sh`.
const LONG: Enough = Enough { edges: 600_000_000, ticks: 200_000, modes: 300_000 };

/// Returns the shipped scenes whose motion is linear from one event to the next, and others without the part that makes
/// their motion nonlinear, an analog shaper.
fn scenes() -> Vec<Scene> {
    let scenes = axis_scenes().into_iter().map(|mut scene| {
        if let (Some(why), Some(amplifier)) = (obstacle(&scene), &mut scene.amplifier) {
            amplifier.shaper = None;
            scene.name = format!("{} without {why}", scene.name);
        }
        scene
    });
    let mut all: Vec<Scene> = Vec::new();
    for scene in scenes.filter(|scene| obstacle(scene).is_none()) {
        // Without its shaper, a scene may equal another.
        let differs = |other: &Scene| {
            (&scene.device, &scene.hand, &scene.wall, scene.clock)
                != (&other.device, &other.hand, &other.wall, other.clock)
                || (scene.method, scene.bridge, scene.model) != (other.method, other.bridge, other.model)
                || (scene.encoder, scene.amplifier) != (other.encoder, other.amplifier)
        };
        if all.iter().all(differs) {
            all.push(scene);
        }
    }
    all
}

/// Compares the engine's plant on these scenes; every start after the first is a share of a count further on.
fn run(scenes: &[Scene], enough: Enough) -> Outcome {
    println!("\n{:48}  starts        edges      ticks  crossings      modes  nearest", "scene");
    let mut all = Outcome::none();
    let mut differing = Vec::new();
    for scene in scenes {
        let mut sum = Outcome::none();
        let mut starts = 0;
        let mut differences = Vec::new();
        while !enough.is_reached(&sum) {
            let share = (f64::from(starts) * 0.618_034).fract();
            let ticks = enough.ticks.checked_sub(sum.ticks).filter(|left| *left > 0).unwrap_or(enough.ticks);
            let outcome = engine_beside_precise(&begun_at(scene.clone(), share), ticks);
            starts += 1;
            sum.add(&outcome);
            if let Some(difference) = outcome.difference {
                differences.push(format!("{} begun at {share:.6} counts: {difference}", scene.name));
            }
            // A hand that imposes the angle ignores the device's start.
            if matches!(scene.hand, Hand::Prescribed { .. }) || differences.len() == 10 {
                break;
            }
        }
        println!(
            "{:48} {starts:>7} {sum}{}",
            scene.name,
            differences.iter().map(|d| format!("\n    {d}")).collect::<String>()
        );
        all.add(&sum);
        differing.append(&mut differences);
    }
    println!("{:56} {all}", "all");
    assert!(differing.is_empty(), "{} runs differ:\n{}", differing.len(), differing.join("\n"));
    all
}

/// Returns the scenes with a motor, and one of them under each kind of bridge.
fn motors() -> Vec<Scene> {
    let mut motors: Vec<_> = scenes().into_iter().filter(|s| matches!(s.device, Device::Motor(_))).collect();
    let base = motors.iter().find(|scene| scene.name == "conventional-wall-10khz").expect("it is shipped").clone();
    let changed = |name: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = base.clone();
        scene.name = format!("{}, {name}", base.name);
        change(&mut scene);
        scene
    };
    motors.push(changed("antiphase", &|scene| scene.method.pwm.antiphase = true));
    motors.push(changed("on-resistance", &|scene| scene.bridge.on_resistance_ohm = 0.3));
    motors.push(changed("9 bits at once", &|scene| {
        (scene.method.pwm.bits, scene.method.pwm.latched) = (9, false);
    }));
    motors.push(changed("floating", &|scene| scene.method.pwm.floating = true));
    motors.push(changed("dead time", &|scene| {
        (scene.method.pwm.dead_time_s, scene.bridge.on_resistance_ohm) = (1e-6, 0.2);
    }));
    motors.push(changed("averaged", &|scene| scene.model.bridge = BridgeModel::Averaged));
    motors.push(changed("law in floats", &|scene| {
        (scene.model.bridge, scene.model.datapath) = (BridgeModel::Averaged, Datapath::Law);
    }));
    motors
}

fn masses() -> Vec<Scene> {
    scenes().into_iter().filter(|scene| matches!(scene.device, Device::Mass(_))).collect()
}

#[test]
fn every_register_edge_of_every_motor_falls_on_the_right_clock() {
    assert!(run(&motors(), SHORT).edges >= 800_000_000);
}

#[test]
fn every_register_edge_of_every_mass_falls_on_the_right_clock() {
    assert!(run(&masses(), SHORT).edges >= 500_000_000);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_register_edge_of_every_motor_falls_on_the_right_clock_from_many_starts() {
    let all = run(&motors(), LONG);
    assert!(all.edges >= 10_000_000_000 && all.mode_changes >= 1_000_000);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_register_edge_of_every_mass_falls_on_the_right_clock_from_many_starts() {
    assert!(run(&masses(), LONG).edges >= 4_000_000_000);
}

#[test]
fn outputs_that_are_shown_are_those_of_58_decimal_places_rounded_once() {
    println!("\n{:24} {:>7} {:>22} {:>22}", "scene", "values", "as verdicts read them", "as they are shown");
    for name in ["hybrid-wall", "friction-wall", "conventional-wall-1khz", "rail-drop"] {
        let scene = scenes().into_iter().find(|scene| scene.name.starts_with(name)).expect("a shipped scene");
        let (values, [read, shown]) = outputs_beside_precise(&scene, 3000);
        let told = |ulps: Ulps| format!("{} off, {:.2} ulp", ulps.differing, ulps.most);
        println!("{:24} {values:>7} {:>22} {:>22}", scene.name, told(read), told(shown));
        assert!(values > 1000, "{name}: {values} values");
        assert_eq!(shown, Ulps::default(), "{name}");
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn twice_the_places_move_no_register_and_no_angle() {
    for scene in scenes() {
        let outcome = precise_beside_twice_as_precise(&scene, 10_000);
        assert!(outcome.difference.is_none(), "{}: {outcome}", scene.name);
        assert!(outcome.off_rad < 1e-40, "{}: {outcome}", scene.name);
    }
}

#[test]
fn every_gate_sample_and_count_behind_field_oriented_control_falls_on_the_right_clock() {
    let agreed = phases::foc_wall(20);
    assert!(
        agreed.gates >= 3000 && agreed.currents >= 700 && agreed.circuit >= 100 && agreed.states == 20,
        "{agreed:?}"
    );
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_gate_sample_and_count_of_two_seconds_falls_on_the_right_clock() {
    let agreed = phases::foc_wall(2000);
    println!("foc-wall, 2 s\n{agreed}");
    assert!(
        agreed.gates >= 450_000 && agreed.currents >= 79_000 && agreed.counts >= 200 && agreed.states == 2000,
        "{agreed:?}"
    );
}
