//! Plants as transfer functions in a loop of words: the integrator between two quantisers for all starts, ARCH-COMP's
//! brake, and both drivers.

use hpu_cosim::scene::{Experiment, TransferScene, shipped};
use hpu_cosim::{Control, Driver, Simulation, Summary, Trace, TransferSimulation, Wired};

const OUTPUT: usize = 2;

fn parsed(name: &str, text: &str, set: &[(&str, &str)]) -> TransferScene {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    match Experiment::parse(name, text, &set, &mut |_| unreachable!("no file")) {
        Ok(Experiment::Transfer(scene)) => scene,
        Ok(_) => panic!("{name} is another device"),
        Err(error) => panic!("{error}"),
    }
}

pub(super) fn scene(name: &str, set: &[(&str, &str)]) -> TransferScene {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    parsed(name, shipped.text, set)
}

fn run(scene: &TransferScene, driver: Driver) -> (Summary, Trace) {
    let simulation = TransferSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&["reading", "command"]);
    let summary = simulation.run(driver, &mut trace, &mut (), &Control::default());
    (summary, trace)
}

/// An integrator, `y+ = y + u + d` with `u = Q(-g Q(y))`, in whole units: `unit` of them are a quantum of `y`.
struct Key {
    gain: (i64, i64),
    disturbance: i64,
    unit: i64,
    quantum: i64,
    late: i64,
    /// The period in samples, and the widest orbit in units, of all starts.
    period: usize,
    widest: i64,
}

/// Returns the nearest whole number to a quotient, ties up.
fn nearest(above: i64, below: i64) -> i64 {
    (2 * above + below).div_euclid(2 * below)
}

/// Returns the outputs of so many samples, in integers.
fn orbit(key: &Key, start: i64, samples: usize) -> Vec<i64> {
    let (mut y, mut before) = (start, 0);
    let mut all = Vec::new();
    for _ in 0..samples {
        all.push(y);
        let word = nearest(y, key.unit);
        // The gain and the ratio of the quanta.
        let now = nearest(-word * key.gain.0 * key.unit, key.gain.1 * key.quantum);
        let word = if key.late == 1 { std::mem::replace(&mut before, now) } else { now };
        y += word * key.quantum + key.disturbance;
    }
    all
}

/// Returns the least period of the end of a sequence.
fn period(all: &[i64]) -> usize {
    let last = &all[all.len() - 200..];
    (1..100).find(|&period| (period..200).all(|at| last[at] == last[at - period])).expect("a period below 100")
}

#[test]
fn an_integrator_between_quantisers_goes_round_from_every_start_as_its_key_says() {
    let keys = [
        Key { gain: (1, 2), disturbance: 0, unit: 2, quantum: 2, late: 0, period: 1, widest: 0 },
        Key { gain: (1, 2), disturbance: 1, unit: 3, quantum: 3, late: 0, period: 3, widest: 2 },
        Key { gain: (1, 2), disturbance: 1, unit: 3, quantum: 3, late: 1, period: 6, widest: 4 },
        Key { gain: (1, 4), disturbance: 1, unit: 3, quantum: 3, late: 1, period: 6, widest: 4 },
        Key { gain: (1, 4), disturbance: 4, unit: 14, quantum: 7, late: 1, period: 7, widest: 12 },
        Key { gain: (1, 2), disturbance: 1, unit: 2, quantum: 1, late: 1, period: 1, widest: 0 },
    ];
    for key in keys {
        let (mut periods, mut widest) = (Vec::new(), 0);
        for start in -40..=40 {
            let expected = orbit(&key, start, 1000);
            let text = |value: i64| value.to_string();
            let scene = scene(
                "delayed-integrator",
                &[
                    ("device.initial", &format!("[{start}]")),
                    ("device.disturbance", &text(key.disturbance)),
                    ("adc.range", &text(128 * key.unit)),
                    ("dac.full_scale", &text(128 * key.quantum)),
                    ("dac.late", &text(key.late)),
                    ("method.numerator", &format!("[{}]", key.gain.0 as f64 / key.gain.1 as f64)),
                    ("record.plant_rate", "1 kHz"),
                ],
            );
            let (_, trace) = run(&scene, Driver::Events);
            // A row stands one edge before the sample of its place.
            let rows: Vec<i64> = trace.real(OUTPUT)[1..].iter().map(|&y| y as i64).collect();
            assert_eq!(rows, expected, "start {start}");
            periods.push(period(&rows));
            let last = &rows[800..];
            widest = widest.max(last.iter().max().unwrap() - last.iter().min().unwrap());
        }
        let most = *periods.iter().max().expect("81 starts");
        assert_eq!((most, widest), (key.period, key.widest), "gain {:?}, {periods:?}", key.gain);
    }
}

#[test]
fn the_brake_passes_its_bound_when_real_numbers_do() {
    let scene = scene("brake", &[]);
    let (summary, trace) = run(&scene, Driver::Events);
    assert!(summary.complete);
    let x = trace.real(OUTPUT);
    // Words of 2.9e-11 m and 3.6e-12 V change nothing in these places; the samples come a clock cycle late.
    let known = [(1000, 0.048_904_787_821_8), (1001, 0.048_909_468_403_997), (5000, 0.050_136_697_647_767)];
    for (row, answer) in known {
        let off = (x[row] - answer).abs();
        assert!(off < 5e-9, "row {row}: {} is {off:e} off", x[row]);
    }
    assert_eq!(x.iter().position(|&x| x >= 0.05), Some(1573));
    let greatest = x.iter().copied().fold(0.0, f64::max);
    assert!((greatest - 0.050_138_900_57).abs() < 1e-10, "{greatest}");
}

#[test]
fn both_drivers_agree_to_the_bit() {
    let ringing = parsed(
        "ringing",
        "about = 'A test.'\nclock.frequency = '1 MHz'\nrun.duration = '20 ms'\n\
         device = { kind = 'transfer', poles = [[-50, 700], -300], zeros = [-900], gain = 2e5, disturbance = 0.3 }\n\
         adc = { bits = 10, range = 4, rate = '20 kHz', offset = 0.01, rounding = 'floor' }\n\
         dac = { bits = 10, full_scale = 5, late = 1 }\n\
         method = { numerator = [0.5, -0.4], denominator = [1, -0.9], fraction = 4 }\n\
         reference = { value = 1, from = '3 ms' }\n",
        &[],
    );
    let step = [("reference.value", "30"), ("reference.from", "5 ms"), ("run.duration", "20 ms")];
    for scene in [ringing, scene("brake", &[("run.duration", "2 ms")]), scene("delayed-integrator", &step)] {
        let simulation = TransferSimulation::new(&scene).expect("a simulation");
        let found = simulation.compare(scene.edges());
        assert_eq!((found.edges, found.mismatches, found.first), (scene.edges(), 0, None), "{}", scene.name);
        let of = |driver| {
            let (summary, trace) = run(&scene, driver);
            let nets: Vec<_> = summary.nets.iter().map(|net| net.usage).collect();
            (summary.verdict, nets, trace.real(OUTPUT).to_vec(), trace.words(1).to_vec())
        };
        assert_eq!(of(Driver::Events), of(Driver::Clock), "{}", scene.name);
    }
}
