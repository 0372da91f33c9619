//! The lines of `hpu reproduce hybrid-loop` against closed forms, exact arithmetic, and the exact map from sample to
//! sample.

use std::f64::consts::PI;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::{Scene, shipped};
use hpu_papers::studies::comparison::Comparison;
use hpu_prove::SampledLoop;

fn comparison() -> Comparison {
    hpu_papers::studies::shipped("hybrid-loop")
}

/// Returns the text of the line that is measured under this name.
fn measured(what: &str) -> String {
    let comparison = comparison();
    let mut lines = comparison.lines.iter().filter(|line| line.what == what);
    let line = lines.next().unwrap_or_else(|| panic!("no line {what}"));
    assert!(lines.next().is_none(), "two lines {what}");
    (line.measure)(&Control::default()).expect("not stopped").unwrap_or_else(|reason| panic!("{what}: {reason}")).text
}

/// Returns the numbers in a text, without those joined to a letter or another word.
fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter_map(|word| word.parse().ok()).collect()
}

#[track_caller]
fn near(got: f64, expected: f64, bound: f64) {
    assert!((got - expected).abs() <= bound, "got {got}, expected {expected}");
}

fn scene(name: &str, set: &[(&str, &str)]) -> Scene {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("shipped");
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    shipped.parse(&set).unwrap_or_else(|error| panic!("{error}")).axis().expect("an axis")
}

// The motor: R = K U / 265 mN.m.
const K: f64 = 25.9e-3;
const R: f64 = K * 24.0 / 0.265;
const L: f64 = 0.226e-3;
const J: f64 = 1.37e-6;
const B: f64 = 1.3e-6;

#[test]
fn linear_limits_are_routh_s_and_those_of_the_data_sheet_and_so_are_their_ratios() {
    let routh = (R * J + L * B) * (R * B + K * K) / (L * J * R);
    near(numbers(&measured("Routh's limit of the same"))[0], routh, 0.5e-5);
    near(numbers(&measured("linear, conventional at 1 kHz"))[0], 0.497373834, 0.5e-6);
    let hybrid = numbers(&measured("linear, hybrid, the spring never sampled"));
    near(hybrid[0], routh, 0.5e-5);
    near(hybrid[1], 5.99539, 0.5e-3);
    let latched = numbers(&measured("linear, hybrid, sampled by its 12-bit PWM at 25.175 MHz"));
    near(latched[0], 1.62314, 0.6e-5);
    near(latched[1], 1.62314 / 0.497373834, 0.6e-3);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn in_words_the_hybrid_wall_is_some_five_times_stiffer_and_a_slower_clock_takes_some_of_it() {
    let found = measured("in words, pushed by 50 mN.m");
    // Each pair goes from the stiffness up to which all settle to the one beyond which none was seen to settle.
    let [slow_all, slow, all, some, least, most, _, early_all, early, early_least, early_most] = numbers(&found)[..]
    else {
        panic!("eleven numbers: {found}")
    };
    // Fixed-point words add counts and the PWM's period, which can only cost; a word of (0,8,4) is 2.6 mN.m/rad.
    assert!(
        slow_all <= slow && slow < 0.497374 + 2.7e-3 && early_all < all && all <= some && some < 2.98195,
        "{found}"
    );
    for (ratio, of, over) in
        [(least, all, slow), (most, some, slow_all), (early_least, early_all, slow), (early_most, early, slow_all)]
    {
        near(ratio, of / over, 0.02);
    }
    assert!(least > 3.5 && most < 7.0, "{found}");
}

#[test]
fn the_higher_the_rate_the_less_damping_holds_a_wall() {
    let needed = |rate: &str| {
        let found = measured(&format!("1.8 N.m/rad, conventional, {rate}"));
        let (linear, words) = found.split_once(", in words ").expect("both");
        // The damping seen to fail, and the damping seen to hold.
        let ends = |text: &str| [numbers(text)[0], numbers(text)[1]];
        [linear, words].map(|text| match text {
            none if none.ends_with("none does") => [f64::INFINITY; 2],
            none if none.trim_end() == "linear 0" || none == "0" => [0.0; 2],
            text => ends(text),
        })
    };
    let rates = ["1 kHz", "2 kHz", "5 kHz", "10 kHz"].map(needed);
    for pair in rates.windows(2) {
        assert!(pair[0][0][1] > pair[1][0][1] && pair[0][1][1] > pair[1][1][1], "{rates:?}");
    }
    // The exact map fails and holds at these dampings, which are within 2 %.
    for (rate, [[fails, holds], _]) in [("2 kHz", rates[1]), ("5 kHz", rates[2])] {
        let scene = scene("conventional-wall-1khz", &[("method.sample_rate", rate), ("hand", "{ kind = \"none\" }")]);
        let radius = |damping: f64| SampledLoop::new(&scene, 1.8, damping).spectral_radius();
        // Half a unit of the third digit.
        let spare = 1.3e-3;
        assert!(radius(holds * 1e-3 * (1.0 + spare)) < 1.0, "{rate}");
        assert!(radius(fails * 1e-3 * (1.0 - spare)) > 1.0 && fails > 0.975 * holds, "{rate}");
    }
    assert_eq!(measured("1.8 N.m/rad, hybrid, 1 kHz"), "linear 0, in words 0");
}

#[test]
fn two_equal_rates_are_one_and_a_slow_damper_alone_is_a_slow_loop() {
    let motor =
        |rate| scene("conventional-wall-1khz", &[("method.sample_rate", rate), ("hand", "{ kind = \"none\" }")]);
    let (fast, slow) = (motor("20 kHz"), motor("2 kHz"));
    let same = |a: f64, b: f64| near(a / b, 1.0, 1e-9);
    for (stiffness, damping) in [(0.5, 0.0), (3.0, 1e-4), (30.0, 1e-3)] {
        let radius = SampledLoop::new(&fast, stiffness, damping).spectral_radius();
        same(SampledLoop::dual_rate(&fast, stiffness, damping, 1).spectral_radius(), radius);
    }
    // Without damping there is nothing slow.
    let radius = SampledLoop::new(&fast, 3.0, 0.0).spectral_radius();
    same(SampledLoop::dual_rate(&fast, 3.0, 0.0, 10).spectral_radius(), radius.powi(10));
    // Without a spring there is nothing fast; this much damping diverges.
    let radius = SampledLoop::new(&slow, 0.0, 8e-3).spectral_radius();
    assert!(radius > 1.1, "{radius}");
    same(SampledLoop::dual_rate(&fast, 0.0, 8e-3, 10).spectral_radius(), radius);
}

#[test]
fn the_text_s_numbers_are_those_of_265_mnm_in_4096_counts() {
    near(numbers(&measured("torque of one PWM count"))[0], 0.265 / 4096.0 * 1e6, 1e-6);
    // 0.265 / 4096 over 2 pi / 4096.
    let gain = 0.265 / (2.0 * PI);
    near(numbers(&measured("stiffness of a gain of one"))[0], gain, 1e-10);
    near(numbers(&measured("stiffness of a gain of one"))[1], gain * 49.0, 1e-4);
    for (what, read) in
        [("B_c at 1 kHz, read as a gain of 31/32", 31.0 / 32.0), ("B at 1 kHz, read as a gain of 2/55", 2.0 / 55.0)]
    {
        let found = numbers(measured(what).as_str());
        near(found[0], read * gain * 1e3, 1e-3);
        near(*found.last().expect("a share"), read * gain * 1e-3 / (B + K * K / R), 1e-4);
    }
    // 0.5 rad are 325 counts of 2 pi / 4096 (2 rad: the 1303rd; the wall: the 978th); 1.5 N.m/rad are a gain of 36.
    let count = 265.0 / 4096.0;
    near(numbers(&measured("torque 0.5 rad deep in 1.5 N.m/rad"))[0], 4095.0 * count, 0.5 * count);
    let dropped = f64::from(325 * 36 % 4096) * count;
    near(numbers(&measured("the same, the product's upper 12 bits dropped"))[0], dropped, count);
}

#[test]
fn one_count_a_sample_asks_for_all_torque_from_a_tenth_of_the_damping_at_ten_times_the_rate() {
    let comparison = comparison();
    let lines: Vec<_> = comparison.lines.iter().filter(|line| line.what.starts_with("a count a sample")).collect();
    assert_eq!(lines.len(), 2);
    // Full torque times period over count; for the motor 265 mN.m and 2 pi / 4096.
    let motor = 0.265 * 50e-6 / (2.0 * PI / 4096.0);
    let found = numbers(&(lines[0].measure)(&Control::default()).expect("not stopped").expect("measured").text);
    near(found[0], motor, 0.5e-4);
    near(found[1], 10.0 * motor, 0.5e-4);
}

#[test]
fn names_are_unique_and_a_stopped_line_has_no_result() {
    let comparison = comparison();
    for (index, line) in comparison.lines.iter().enumerate() {
        let twin =
            comparison.lines[..index].iter().find(|other| (other.group, &other.what) == (line.group, &line.what));
        assert!(twin.is_none(), "{}", line.what);
    }
    let control = Control::default();
    control.stop.store(true, Ordering::Relaxed);
    for what in ["in words, leaning", "1.8 N.m/rad, conventional, 10 kHz", "hybrid, leaning"] {
        let line = comparison.lines.iter().find(|line| line.what == what).unwrap_or_else(|| panic!("{what}"));
        assert!((line.measure)(&control).is_none(), "{what}");
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn at_1_khz_a_bridge_that_brakes_holds_a_stiffer_wall_than_one_that_floats() {
    let found = measured("conventional, 1 kHz, pushed by 20 mN.m");
    let (brake, float) = found.split_once(", floating ").expect("both");
    let (brake, float) = (numbers(brake), numbers(float));
    // The stiffness as asked for, then as felt. With a braking bridge the word is felt as asked for, within the counts.
    // With a floating bridge the same duty makes less torque.
    assert!(brake[0] > float[0] && brake[1] > float[1], "{found}");
    assert!((0.9..=1.0).contains(&(brake[1] / brake[0])) && float[1] < 0.5 * float[0], "{found}");
}
