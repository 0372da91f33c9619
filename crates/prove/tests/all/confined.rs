//! Outputs of loops around transfer functions that are proved to be bounded for ever, and plants that are proved to
//! leave: known answers, closed forms, and claims held against runs and against every input that is tried.

use hpu_cosim::scene::{Experiment, SceneFile, SplitMix64, TransferScene};
use hpu_cosim::{Control, Driver, Simulation, TransferSimulation, Wired};
use hpu_prove::confined::stays_within;
use hpu_prove::escaping::leaves;

const OUTPUT: usize = 2;

fn list(set: &[(&str, &str)]) -> Vec<(String, String)> {
    set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

fn brake(set: &[(&str, &str)]) -> TransferScene {
    match SceneFile::find("brake").expect("a scene").parse(&list(set)) {
        Ok(Experiment::Transfer(scene)) => scene,
        other => panic!("{other:?}"),
    }
}

fn scene(text: &str, set: &[(&str, &str)]) -> TransferScene {
    match Experiment::parse("t.toml", text, &list(set), &mut |_| unreachable!("no file")) {
        Ok(Experiment::Transfer(scene)) => scene,
        Ok(_) => panic!("another device"),
        Err(error) => panic!("{error}"),
    }
}

/// Words of the brake are so fine that all of their rounding moves it by less than this.
const FINE: f64 = 1e-10;

#[test]
fn the_brake_is_held_to_its_bound_for_ever() {
    // Answers of real numbers to 40 digits, computed apart; the samples come a clock cycle late, without effect.
    let (peak, rest) = (0.050_138_900_574_27, 0.05);
    let at = |duration: &str| {
        stays_within(&brake(&[("run.duration", duration)]), 100_000_000).unwrap_or_else(|why| panic!("{why}"))
    };
    // In the window of the competition: sample 1000, and the one after.
    let window = at("0.1000001 s");
    assert!(window.in_run[1] < 0.05, "{window:?}");
    let (sample, next) = (0.048_904_787_821_8, 0.048_909_468_403_997);
    assert!((sample - FINE..=sample + 1e-13).contains(&window.reached[1]), "{window:?}");
    assert!((next..next + 5e-10).contains(&window.in_run[1]), "{window:?}");
    // It crosses 0.05 at 0.157212612 s: not up to the sample before, and at the one after.
    assert!(at("0.1572 s").in_run[1] < 0.05);
    // For ever, and in the end.
    let found = at("0.1573001 s");
    assert!(found.reached[1] > 0.05 && found.from_edge == 1, "{found:?}");
    assert!((peak..peak + FINE).contains(&found.ends[1]), "{found:?}");
    // Chords of the first sample, at 500 V, are below 0.
    assert!((-1e-7..=0.0).contains(&found.ends[0]), "{found:?}");
    assert!((found.rest - rest).abs() < 2e-11 && found.off < 1e-9, "{found:?}");
}

const SUMMED: &str = "about = 'A.'\nclock.frequency = '1 MHz'\nrun.duration = 1\n\
                      device = { kind = 'transfer', numerator = [1], denominator = [1, -1], sample_time = 1e-3 }\n\
                      adc = { bits = 12, range = 2048, rate = '1 kHz' }\ndac = { bits = 12, full_scale = 2048 }\n\
                      method = { numerator = [0.5], denominator = [1] }\n";

#[test]
fn the_bound_of_an_integrator_is_its_closed_form() {
    // x+ = x - g (x + a) + b with |a| <= 1/2 by the reading and |b| <= 1/2 by the product's rounding: half a step and
    // 1/(2 g). Products with fraction bits are rounded twice, by 1/2 and 2^-(f + 1). Rounding down is off its middle.
    for (gain, late) in [(0.5f64, 0), (0.25, 0), (0.125, 0), (0.25, 1)] {
        for (fraction, floors) in [(0, false), (0, true), (3, false), (3, true)] {
            let (gain, fraction, late) = (gain, f64::from(fraction), late.to_string());
            let numerator = format!("[{gain}]");
            let bits = fraction.to_string();
            let rounding = if floors { "floor" } else { "nearest" };
            let set = [
                ("method.numerator", numerator.as_str()),
                ("method.fraction", bits.as_str()),
                ("method.rounding", rounding),
                ("adc.rounding", rounding),
                ("dac.late", late.as_str()),
            ];
            let found = stays_within(&scene(SUMMED, &set), 1_000_000).unwrap_or_else(|why| panic!("{why}"));
            let product = if fraction > 0.0 { 0.5 + 0.5f64.powf(fraction + 1.0) } else { 0.5 };
            let mut sums = [0.5, product / gain];
            if late == "1" {
                // Impulse responses of x+ = x - g x-, added up; a double pole at 1/2 of a gain of 1/4.
                let (mut x, mut before, mut sum) = (1.0f64, 0.0, 0.0);
                for _ in 0..200 {
                    (x, before, sum) = (x - gain * before, x, sum + x.abs());
                }
                sums = [0.5 * gain * sum, product * sum];
            }
            let exact = sums[0] + sums[1];
            assert!((exact * 0.999_999..exact * 1.011).contains(&found.off), "{set:?}: {} for {exact}", found.off);
            let middle = if floors { 0.5 - product / gain } else { 0.0 };
            assert!((found.rest - middle).abs() < 1e-9, "{set:?}: {found:?}");
        }
    }
}

const LAG: &str = "about = 'A.'\nclock.frequency = '1 MHz'\nrun.duration = 0.6\n\
                   device = { kind = 'transfer', poles = [-30, -200], gain = 6000 }\n\
                   adc = { bits = 12, range = 2, rate = '1 kHz' }\ndac = { bits = 12, full_scale = 2 }\n\
                   method = { numerator = [0.5, -0.45], denominator = [1, -1], fraction = 6 }\n\
                   reference = { value = 1, from = '2 ms' }\n";

/// Returns the output of a run, in rows ten times as dense as samples, and the time of a row in clock edges.
fn outputs(scene: &TransferScene) -> (Vec<f64>, u64) {
    let simulation = TransferSimulation::new(scene).expect("a simulation");
    let mut trace = simulation.trace(&[]);
    simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    (trace.real(OUTPUT).to_vec(), 100)
}

#[test]
fn no_random_loop_leaves_its_bounds() {
    let mut random = SplitMix64::new(3);
    let (mut bounded, mut later, mut nearest) = (0, 0, f64::INFINITY);
    for _ in 0..24 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.below(1 << 20) as f64 / f64::from(1 << 20);
        let gain = between(0.1, 8.0);
        let texts = [
            ("device.poles", format!("[{}, {}]", -between(1.0, 60.0), -between(100.0, 900.0))),
            ("device.initial", format!("[{}]", between(-1e-4, 1e-4))),
            ("device.disturbance", between(-0.2, 0.2).to_string()),
            ("method.numerator", format!("[{gain}, {}]", -gain * between(0.8, 0.99))),
            ("reference.value", between(-1.5, 1.5).to_string()),
            ("adc.bits", (between(5.0, 13.0) as u32).to_string()),
            ("adc.offset", between(-0.1, 0.1).to_string()),
            ("method.fraction", (between(0.0, 8.0) as u32).to_string()),
            ("dac.late", (between(0.0, 2.0) as u32).to_string()),
            ("adc.rounding", if between(0.0, 1.0) < 0.3 { "floor" } else { "nearest" }.to_string()),
            ("method.rounding", if between(0.0, 1.0) < 0.3 { "floor" } else { "nearest" }.to_string()),
        ];
        let set: Vec<_> = texts.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let scene = scene(LAG, &set);
        let Ok(found) = stays_within(&scene, 2_000_000) else { continue };
        let (rows, edges) = outputs(&scene);
        let first = found.from_edge.div_ceil(edges) as usize;
        let [least, greatest] = found.ends;
        for (row, output) in rows.iter().enumerate().skip(first) {
            assert!((least..=greatest).contains(output), "{set:?}, row {row}: {output} in {found:?}");
        }
        // What a run reaches is told to be reached, and samples in the end are near the rest.
        let at_samples = || rows.iter().skip(first).step_by(10);
        let most = at_samples().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(found.reached[1] <= most + 1e-3, "{set:?}: {most} in {found:?}");
        let off = rows[rows.len() - 600..].iter().step_by(10).map(|y| (y - found.rest).abs()).fold(0.0, f64::max);
        if rows[rows.len() - 1200..].iter().all(|y| (y - found.rest).abs() < found.off) {
            nearest = f64::min(nearest, found.off / off.max(1e-9));
        }
        bounded += 1;
        later += u32::from(found.from_edge > 1);
    }
    // From the first sample, and after words that saturate. Some motion uses a good part of its bound.
    assert!(bounded >= 12 && later >= 2 && nearest < 10.0, "{bounded} bounded, {later} later, {nearest}");
}

#[test]
fn what_may_saturate_or_grows_has_no_bound() {
    let said = |set: &[(&str, &str)]| stays_within(&scene(LAG, set), 1_000_000).expect_err("no bound");
    // A rest that the DAC does not reach: 1 needs an input of 1.
    assert!(said(&[("dac.full_scale", "0.9")]).contains("saturate at the loop's rest"));
    // The reading's greatest word is 2 less a step.
    assert!(said(&[("reference.value", "1.999")]).contains("saturate"));
    let grows = said(&[("method.numerator", "[60, -10]")]);
    assert!(grows.contains("the loop without rounding grows by 1."), "{grows}");
    // An integrator that nobody holds, and one that is held by a word.
    let still = said(&[("device.poles", "[0, -200]"), ("method.numerator", "[0]")]);
    assert!(still.contains("hardly decays"), "{still}");
}

/// A plant of one state that grows by a half a sample, behind words of -1 to 1.
const GROWS: &str = "about = 'A.'\nclock.frequency = '1 MHz'\nrun.duration = 0.1\n\
                     device = { kind = 'transfer', numerator = [1], denominator = [1, -1.5], sample_time = 1e-3 }\n\
                     adc = { bits = 16, range = 256, rate = '1 kHz' }\ndac = { bits = 12, full_scale = 1 }\n\
                     method = { numerator = [100], denominator = [1] }\n";

#[test]
fn a_plant_leaves_if_and_only_if_the_greatest_word_cannot_hold_it() {
    // x+ = 1.5 x + u with -1 <= u: what is below 2 comes back under u = -1, and what is above never does.
    for (initial, is_lost) in [("2.000001", true), ("1.999999", false), ("-2.000001", true), ("0.3", false)] {
        let found = leaves(&scene(GROWS, &[("device.initial", &format!("[{initial}]"))]), 100_000);
        let found = found.expect("a plant");
        assert_eq!(found.map(|(edge, _)| edge), is_lost.then_some(1), "{initial}: {found:?}");
        if let Some((_, growth)) = found {
            assert!((1.499_999..=1.5).contains(&growth), "{growth}");
        }
    }
    // A disturbance takes its part of the words: 1.75 is beyond (1 - 0.125) / 0.5 on its side, and not on the other;
    // the bound is of both, so that it is told of neither before 2.25.
    let with = |initial: &str| {
        let set = [("device.disturbance", "0.125"), ("device.initial", initial)];
        leaves(&scene(GROWS, &set), 1000).expect("a plant").is_some()
    };
    assert!(with("[2.251]") && !with("[2.249]"));
    // An integrator, and a plant that decays, never leave by themselves.
    for pole in ["-1", "-0.5"] {
        let set = [("device.denominator", &*format!("[1, {pole}]")), ("device.initial", "[1e6]")];
        assert_eq!(leaves(&scene(GROWS, &set), 100_000), Ok(None), "{pole}");
    }
}

#[test]
fn plants_that_leave_do_so_under_every_input_that_is_tried() {
    let mut random = SplitMix64::new(11);
    let (mut claimed, mut of_pairs) = (0, 0);
    for _ in 0..40 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.below(1 << 20) as f64 / f64::from(1 << 20);
        let (size, turn, other) = (between(1.01, 1.4), between(0.0, 3.0), between(-1.2, 1.2));
        // A pair, or two real ones, with a third one.
        let is_pair = between(0.0, 1.0) < 0.5;
        let [sum, product] =
            if is_pair { [2.0 * size * turn.cos(), size * size] } else { [size + other, size * other] };
        let third = between(-0.9, 0.9);
        let denominator = [1.0, -sum - third, product + third * sum, -product * third];
        let texts = [
            ("device.numerator", format!("[{}, {}]", between(0.2, 1.0), between(-1.0, 1.0))),
            ("device.denominator", format!("{denominator:?}")),
            ("device.initial", format!("[{}, {}]", between(-9.0, 9.0), between(-9.0, 9.0))),
            ("method.numerator", "[0.001]".to_string()),
        ];
        let set: Vec<_> = texts.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let scene = scene(GROWS, &set);
        let Some((edge, growth)) = leaves(&scene, 30_000).expect("a plant") else { continue };
        assert!(growth <= size.max(other.abs()) + 1e-9 && growth > 1.0, "{growth} of {size} and {other}");
        // The states at that edge, in floats.
        let simulation = TransferSimulation::new(&scene).expect("a simulation");
        let mut now = simulation.samples();
        while now.edge() < edge {
            assert!(now.go_on());
        }
        let start: Vec<f64> = now.states().iter().map(|pair| pair[0]).collect();
        for trial in 0..60u32 {
            let mut x = start.clone();
            for sample in 0..2000 {
                // Inputs at random, steady ones, and the one of both ends that leaves the smaller state.
                let next = |u: f64| {
                    let last = -denominator[3] * x[0] - denominator[2] * x[1] - denominator[1] * x[2] + u;
                    vec![x[1], x[2], last]
                };
                let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
                x = match trial {
                    0 => [next(-1.0), next(1.0)].into_iter().min_by(|a, b| size(a).total_cmp(&size(b))).expect("two"),
                    1 | 2 => next(2.0 * f64::from(trial) - 3.0),
                    _ if trial % 2 == 0 => next(2.0 * random.below(2) as f64 - 1.0),
                    _ => next(if (sample / u64::from(trial)) % 2 == 0 { 1.0 } else { -1.0 }),
                };
                if size(&x) > 1e12 {
                    break;
                }
            }
            assert!(x.iter().any(|x| x.abs() > 1e5), "{set:?}: trial {trial} brings it back to {x:?}");
        }
        claimed += 1;
        of_pairs += u32::from(is_pair);
    }
    assert!(claimed >= 25 && of_pairs >= 8, "{claimed} claims, {of_pairs} of pairs");
}
