//! Keys of emulated devices from their logs: whole counts, off by noise that lasts for several rows.

use std::fmt::Write as _;

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Control, SceneFile};
use hpu_study::identify::logs::{LogRun, identify};
use hpu_study::identify::{Bound, Free, Identified};

use super::Noise;

/// A shorted motor that runs down until friction holds it. No logic moves it.
const MOTOR: &str = r#"
about = "A shorted motor runs down."
clock = { frequency = "1 MHz" }
device.kind = "motor"
device.resistance = "2 Ohm"
device.inductance = "0.5 mH"
device.torque_constant = "30 mN.m/A"
device.rotor_inertia = "200 g.cm2"
device.coulomb_friction = "2 mN.m"
device.initial_speed = "60 rad/s"
encoder = { lines = 500 }
method = { kind = "hybrid", sample_rate = "1 kHz", damping_format = "(0,8,4)" }
wall = { position = "6 rad", stiffness = 0 }
hand = { kind = "none" }
run = { duration = "100 ms" }
record = { plant_rate = "4 kHz" }
"#;

const KEYS: [&str; 3] = ["device.rotor_inertia", "device.coulomb_friction", "device.initial_speed"];

fn scene(text: &str) -> SceneFile {
    SceneFile { name: "motor.toml".into(), text: text.into(), data: ".".into(), is_shipped: false }
}

fn set(keys: &[&str], values: &[f64]) -> Vec<(String, String)> {
    keys.iter().zip(values).map(|(key, value)| ((*key).to_string(), format!("{value:?}"))).collect()
}

/// Returns the positions of a scene's device in counts, at each quarter of a millisecond.
fn motion(text: &str, changed: &[(String, String)]) -> Vec<f64> {
    let mut empty = "time_ms,count\n".to_string();
    (1..399).for_each(|row| _ = writeln!(empty, "{},0", f64::from(row) * 0.25));
    let run = LogRun::open(scene(text), Vec::new(), Some(("none.csv".into(), empty.into_bytes()))).expect("a log");
    let held = run.held(changed, None, &Control::default()).expect("a run").expect("not stopped");
    held.rows.iter().map(|[_, _, angle]| angle / run.count).collect()
}

/// Returns a log of a motion in whole counts, off by noise of a size, whose rows are correlated.
fn log(motion: &[f64], noise: &mut Noise, (size, correlation): (f64, f64)) -> Vec<u8> {
    let mut log = "time_ms,count\n".to_string();
    let mut off = size * noise.next();
    for (at, row) in motion.iter().zip(1..) {
        off = correlation * off + (1.0 - correlation * correlation).sqrt() * size * noise.next();
        _ = writeln!(log, "{},{:.0}", f64::from(row) * 0.25, (at + off).floor());
    }
    log.into_bytes()
}

/// Identifies keys of the motor from a log, from the scene's values on.
fn of(keys: &[&str], log: Vec<u8>) -> Identified {
    let experiment: Experiment = scene(MOTOR).parse(&[]).expect("a scene");
    let free: Vec<Free> = keys.iter().map(|key| Free::of(&experiment, key).expect("a key")).collect();
    let run = LogRun::open(scene(MOTOR), Vec::new(), Some(("log.csv".into(), log))).expect("a log");
    identify(&free, &[run], &Control::default()).expect("found").expect("not stopped")
}

/// How many intervals of each key have the true value: by the interval that is told, by the standard deviation and
/// Student's quantile, and as if rows were independent.
#[derive(Default)]
struct Covered {
    hits: [[u32; 3]; 3],
    logs: u32,
    rejected: u32,
}

/// Identifies logs of devices, so many of each.
fn covered(devices: std::ops::Range<u64>, seeds: u64) -> Covered {
    let mut covered = Covered::default();
    for device in devices {
        let mut dice = Noise(device + 1);
        let mut between = |low: f64, high: f64| low + (high - low) * dice.uniform();
        let truth = [2e-5 * between(0.7, 1.4), 2e-3 * between(0.5, 2.0), between(50.0, 70.0)];
        let kind = (between(0.5, 1.5), between(0.3, 0.9));
        let motion = motion(MOTOR, &set(&KEYS, &truth));
        for seed in 0..seeds {
            let found = of(&KEYS, log(&motion, &mut Noise(1000 * device + seed), kind));
            covered.logs += 1;
            covered.rejected += u32::from(found.met[0].1.is_rejected());
            for ((found, truth), hits) in found.found.iter().zip(truth).zip(&mut covered.hits) {
                let off = (found.value - truth).abs();
                let is_told = matches!(found.bound, Bound::Both(low, high) if (low..=high).contains(&truth));
                let all = [is_told, off <= found.quantile * found.sd, off <= 1.96 * found.naive_sd];
                hits.iter_mut().zip(all).for_each(|(hits, is_in)| *hits += u32::from(is_in));
            }
        }
    }
    covered
}

#[test]
fn intervals_of_emulated_motors_have_the_true_values() {
    let Covered { hits, logs, rejected } = covered(0..1, 4);
    assert_eq!((logs, rejected), (4, 0));
    assert!(hits.iter().all(|hits| hits[0] >= 3 && hits[1] >= 3), "{hits:?}");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn intervals_of_1000_emulated_logs_cover() {
    let all: Vec<Covered> = std::thread::scope(|scope| {
        let devices: Vec<_> = (0..20).map(|device| scope.spawn(move || covered(device..device + 1, 50))).collect();
        devices.into_iter().map(|device| device.join().expect("no panic")).collect()
    });
    let sum = |of: &dyn Fn(&Covered) -> u32| all.iter().map(of).sum::<u32>();
    println!("intervals of 95 % that have the true value, of {} logs of 20 devices, in %", sum(&|it| it.logs));
    println!("{:28}{:>8}{:>26}{:>28}", "key", "told", "by the deviation alone", "if rows were independent");
    for (at, key) in KEYS.iter().enumerate() {
        let shares = [0, 1, 2].map(|kind| f64::from(sum(&|it| it.hits[at][kind])) / 10.0);
        println!("{key:28}{:8.1}{:26.1}{:28.1}", shares[0], shares[1], shares[2]);
        assert!((93.0..=97.0).contains(&shares[0]), "{key}: {shares:?}");
    }
    println!("logs that are rejected: {}", sum(&|it| it.rejected));
}

/// Returns the positions of the motor in counts, at each quarter of a millisecond, by Heun's method in steps of 5 us.
/// A second inertia may be on it; `torque` gives what acts on either for the time, both speeds and both angles.
fn integrated(second: f64, torque: impl Fn(f64, [f64; 2], [f64; 2]) -> [f64; 2]) -> Vec<f64> {
    let [resistance, inductance, constant, inertia, step] = [2.0, 0.5e-3, 0.03, 2e-5, 5e-6];
    let slope = |time: f64, [current, speed, angle, second_speed, second_angle]: [f64; 5]| {
        let [own, others] = torque(time, [speed, second_speed], [angle, second_angle]);
        let volts = -resistance * current - constant * speed;
        [volts / inductance, (constant * current + own) / inertia, speed, others / second, second_speed]
    };
    let (mut at, mut counts) = ([0.0, 60.0, 0.0, 60.0, 0.0], Vec::new());
    for row in 0..19_950 {
        if row > 0 && row % 50 == 0 {
            counts.push(at[2] / std::f64::consts::TAU * 2000.0);
        }
        let time = f64::from(row) * step;
        let first = slope(time, at);
        let then = slope(time + step, std::array::from_fn(|part| at[part] + step * first[part]));
        at = std::array::from_fn(|part| at[part] + 0.5 * step * (first[part] + then[part]));
    }
    counts
}

#[test]
fn devices_with_a_part_that_the_scene_lacks_are_rejected() {
    // Friction that is proportional to the speed below 0.1 rad/s: where the motor stands it does not turn it back.
    let friction = |speed: f64| -2e-3 * (speed / 0.1).clamp(-1.0, 1.0);
    let alone = |torque: &dyn Fn(f64, f64, f64) -> f64| {
        integrated(1.0, |time, [speed, _], [angle, _]| [friction(speed) + torque(time, speed, angle), 0.0])
    };
    let coupled = |second: f64, spring: &dyn Fn(f64) -> f64| {
        integrated(second, |_, [one, other], [here, there]| {
            let torque = spring(there - here) + 2e-5 * (other - one);
            [friction(one) + torque, -torque]
        })
    };
    let log = |motion: &[f64]| log(motion, &mut Noise(3), (0.5, 0.5));
    let met = of(&KEYS, log(&alone(&|_, _, _| 0.0))).met[0].1;
    assert!(!met.is_rejected(), "{met:?}");
    for (name, motion) in [
        ("a touch for 10 ms", alone(&|time, _, _| if (0.02..0.03).contains(&time) { -0.03 } else { 0.0 })),
        (
            "Stribeck's friction",
            alone(&|_, speed, _| -12e-3 * (-(speed / 5.0).powi(2)).exp() * (speed / 0.1).clamp(-1.0, 1.0)),
        ),
        ("a return spring", alone(&|_, _, angle| -4e-3 * angle)),
        ("a second mass on a spring", coupled(1e-5, &|apart| 0.05 * apart)),
        ("a second mass with backlash", coupled(1e-5, &|apart| 1.0 * (apart.abs() - 0.05).max(0.0).copysign(apart))),
    ] {
        let met = of(&KEYS, log(&motion)).met[0].1;
        assert!(met.is_rejected(), "{name}: {met:?}");
    }
}
