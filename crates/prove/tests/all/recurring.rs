//! Words of a loop around a transfer function that are proved to repeat for ever: known cycles, claims held against
//! longer runs, and loops of which nothing is claimed.

use hpu_cosim::TransferSimulation;
use hpu_cosim::scene::{Experiment, SceneFile, SplitMix64, TransferScene};
use hpu_prove::recurring::words_recur;

fn scene(text: &str, set: &[(&str, String)]) -> TransferScene {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    match Experiment::parse("t.toml", text, &set, &mut |_| unreachable!("no file")) {
        Ok(Experiment::Transfer(scene)) => scene,
        Ok(_) => panic!("another device"),
        Err(error) => panic!("{error}"),
    }
}

fn integrator(set: &[(&str, String)]) -> TransferScene {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    match SceneFile::find("delayed-integrator").expect("a scene").parse(&set) {
        Ok(Experiment::Transfer(scene)) => scene,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_integrator_is_proved_to_go_round_in_whole_numbers() {
    // Gain 1/4, a third of a quantum: six samples, widest orbit 4/3 quanta (exhaustive, in rationals, known apart).
    for start in -40..=40 {
        let found = words_recur(&integrator(&[("device.initial", format!("[{start}]"))]), 1_000_000);
        let found = found.unwrap_or_else(|why| panic!("start {start}: {why}"));
        assert_eq!((found.samples, found.within), (6, 0.0), "start {start}");
        assert!(found.outputs[1] - found.outputs[0] <= 4.0 / 3.0 + 1e-12, "start {start}: {found:?}");
    }
    // Seven samples of a disturbance of 2/7 with half a quantum.
    let sevenths =
        [("device.disturbance", "4".to_string()), ("adc.range", "1792".into()), ("dac.full_scale", "896".into())];
    assert_eq!(words_recur(&integrator(&sevenths), 1_000_000).expect("a cycle").samples, 7);
}

const LAG: &str = "about = 'A.'\nclock.frequency = '1 MHz'\nrun.duration = 1\n\
                   device = { kind = 'transfer', poles = [-30, -200], gain = 6000 }\n\
                   adc = { bits = 12, range = 2, rate = '1 kHz' }\ndac = { bits = 12, full_scale = 2 }\n\
                   method = { numerator = [0.5, -0.45], denominator = [1, -1], fraction = 6 }\n\
                   reference = { value = 1, from = '2 ms' }\n";

/// Asserts that readings and commands repeat as claimed, over so many periods.
fn holds(scene: &TransferScene, samples: usize, from_edge: u64, periods: usize) {
    let simulation = TransferSimulation::new(scene).expect("a simulation");
    let mut now = simulation.samples();
    let mut words = Vec::new();
    while words.len() < periods * samples + 1 {
        assert!(now.go_on());
        if now.edge() >= from_edge {
            words.push(now.words());
        }
    }
    for (at, word) in words.iter().enumerate().skip(samples) {
        assert_eq!(*word, words[at - samples], "sample {at}");
    }
}

#[test]
fn claims_hold_in_runs_that_go_on() {
    let mut random = SplitMix64::new(7);
    let (mut claimed, mut of_cycles) = (0, 0);
    for _ in 0..30 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.below(1 << 20) as f64 / f64::from(1 << 20);
        let gain = between(0.05, 12.0);
        let set = [
            ("method.numerator", format!("[{gain}, {}]", -gain * between(0.8, 0.99))),
            ("reference.value", format!("{}", between(-1.5, 1.5))),
            ("adc.bits", format!("{}", between(6.0, 13.0) as u32)),
            ("method.fraction", format!("{}", between(0.0, 8.0) as u32)),
        ];
        let scene = scene(LAG, &set);
        if let Ok(found) = words_recur(&scene, 8_000_000) {
            assert!(found.margin > 0.0 && found.within <= 1e-3, "{found:?}");
            holds(&scene, found.samples, found.from_edge, 20.max(4000 / found.samples));
            claimed += 1;
            of_cycles += usize::from(found.samples > 1);
        }
    }
    assert!(claimed >= 15 && of_cycles >= 5, "{claimed} claims, {of_cycles} of cycles");
}

#[test]
fn nothing_is_claimed_of_growth_or_of_a_mode_that_stays() {
    let grows = scene(LAG, &[("device.poles", "[30, -200]".into()), ("dac.full_scale", "0.002".into())]);
    assert!(words_recur(&grows, 20_000_000).expect_err("grows").contains("grew beyond"), "a state grows");
    // A continuous integrator that rests only up to rounding: its words come again, and are not proved to.
    let set = [("poles", "[0, -200]"), ("gain", "200")].map(|(key, value)| (format!("device.{key}"), value));
    let mut set: Vec<_> = set.iter().map(|(key, value)| (key.as_str(), value.to_string())).collect();
    set.extend([("method.numerator", "[0.5]".to_string()), ("method.denominator", "[1]".to_string())]);
    let stays = scene(LAG, &set);
    let said = words_recur(&stays, 2_000_000).expect_err("stays");
    assert!(said.contains("does not decay"), "{said}");
    // A reference still to come.
    let later = scene(LAG, &[("reference.from", "'2 s'".into())]);
    assert_eq!(words_recur(&later, 1_000_000).expect_err("later"), "no words came again");
}
