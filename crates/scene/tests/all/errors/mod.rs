//! A bad scene is refused with file, line, column, key, and what is accepted instead.

mod all;
mod model;
mod rail;
mod sense;

use std::io;

use hpu_scene::{Device, Origin, Parameter, ParameterValue, Scene};
use proptest::prelude::*;

/// A scene that is accepted once its motor is named, as in [`parse`]; every test spoils one part of it.
const GOOD: &str = r#"about = "A wall."
[device]
kind = "motor"
[clock]
frequency = "50 MHz"
[method]
kind = "hybrid"
sample_rate = "1 kHz"
[wall]
position = "1.5 rad"
stiffness = "1.5 N.m/rad"
[hand]
kind = "none"
[run]
duration = "1 s"
"#;

fn files(name: &str) -> io::Result<Vec<u8>> {
    let text = match name {
        "good.csv" => "time_s,angle_rad\n0,0\n1,2\n",
        "far.csv" => "time_s,angle_rad\n0,0\n1,1e30\n",
        "late.csv" => "time_s,angle_rad\n-1,0\n1,1\n",
        "cut.csv" => "time_s,angle_rad\n0,0\n1,1.2",
        "backwards.csv" => "time_s,angle_rad\n0,0\n1,2\n0.5,2\n",
        "good.vcd" => {
            "$timescale 1 us $end\n$var wire 1 ! D0 $end\n$var wire 1 \" D1 $end\n$enddefinitions $end\n#0 0! 0\"\n\
             #5 1!\n"
        }
        "backwards.vcd" => {
            "$timescale 1 us $end\n$var wire 1 ! D0 $end\n$var wire 1 \" D1 $end\n$enddefinitions $end\n#9 0! 0\"\n\
             #5 1!\n"
        }
        _ => return Err(io::ErrorKind::NotFound.into()),
    };
    Ok(text.as_bytes().to_vec())
}

fn parse(text: &str, overrides: &[(&str, &str)]) -> Result<Scene, String> {
    let motor = text.contains("kind = \"motor\"").then_some(&("device.motor", "vasudevan_2007"));
    let overrides: Vec<_> = motor.into_iter().chain(overrides).map(|(k, v)| (k.to_string(), v.to_string())).collect();
    Scene::parse("testbench/scenes/x.toml", text, &overrides, &mut files).map_err(|error| error.to_string())
}

/// Returns the message for the good scene with `from` replaced.
fn refused(from: &str, to: &str) -> String {
    assert_eq!(GOOD.matches(from).count(), 1, "{from}");
    parse(&GOOD.replace(from, to), &[]).expect_err(to)
}

fn refused_hand(hand: &str) -> String {
    refused("kind = \"none\"", hand)
}

/// Checks that the message is exactly this, after `testbench/scenes/x.toml:`.
#[track_caller]
fn says(message: String, expected: &str) {
    assert_eq!(message, format!("testbench/scenes/x.toml:{expected}"));
}

#[test]
fn the_scene_that_the_tests_spoil_is_good() {
    let scene = parse(GOOD, &[]).unwrap();
    assert_eq!((scene.name.as_str(), scene.about.as_str()), ("x", "A wall."));
    assert_eq!(scene.edges(), 50_000_000);
    assert_eq!(scene.period_clocks(), 50_000);
}

#[test]
fn malformed_toml_is_refused_where_it_breaks() {
    let message = refused("sample_rate = \"1 kHz\"", "sample_rate = ");
    assert!(message.starts_with("testbench/scenes/x.toml:8:"), "{message}");
    assert!(message.contains("not TOML"), "{message}");
    let message = refused("[wall]", "[method]");
    assert!(message.starts_with("testbench/scenes/x.toml:9:"), "{message}");
}

#[test]
fn an_unknown_key_is_refused_with_the_keys_there_are() {
    says(
        refused("stiffness =", "stifness ="),
        "11:1: wall.stifness: unknown key; accepted here: position, wraps, stiffness, damping, ramp; did you mean \
         stiffness?",
    );
    says(
        refused("[wall]", "[wal]"),
        "9:2: wal: unknown key; accepted here: about, device, encoder, bridge, amplifier, host, clock, method, wall, \
         hand, faults, model, run, record, expect, accuracy; did you mean wall?",
    );
    says(
        refused("[wall]", "pwm = { bits = 12, duti = 3 }\n[wall]"),
        "9:20: method.pwm.duti: unknown key; accepted here: bits, mode, duty, off, dead_time; did you mean duty?",
    );
}

#[test]
fn a_key_of_another_kind_of_hand_is_unknown() {
    says(
        refused_hand("kind = \"constant_torque\"\ntorque = 0.1\nstiffness = 2"),
        "15:1: hand.stiffness: unknown key for kind \"constant_torque\"; accepted here: kind, torque",
    );
}

#[test]
fn an_unknown_metric_is_refused_with_the_metrics_there_are() {
    says(
        parse(&format!("{GOOD}[expect]\npeek_angle = {{ value = 1, tolerance = 1 }}\n"), &[]).unwrap_err(),
        "17:1: expect.peek_angle: unknown key; accepted here: outcome, final_angle, peak_angle, peak_penetration, \
         amplitude, frequency, peak_torque, spring_overflow_share, encoder_edges, contact_share, \
         rms, recording; did you mean peak_angle?",
    );
}

#[test]
fn an_expected_number_needs_a_tolerance_in_its_own_unit() {
    says(
        parse(&format!("{GOOD}[expect]\npeak_angle = {{ value = 1 }}\n"), &[]).unwrap_err(),
        "17:14: expect.peak_angle.tolerance: missing; write an angle as rad, mrad, deg, rev or a number in rad",
    );
    let message = parse(&format!("{GOOD}[expect]\npeak_angle = {{ value = 1, tolerance = \"1 N.m\" }}\n"), &[]);
    says(
        message.unwrap_err(),
        "17:39: expect.peak_angle.tolerance: `1 N.m` is not an angle: write rad, mrad, deg, rev or a number in rad",
    );
}

#[test]
fn a_missing_key_is_told_at_its_section() {
    says(
        refused("stiffness = \"1.5 N.m/rad\"\n", ""),
        "9:1: wall.stiffness: missing; write a torsional stiffness as N.m/rad, mN.m/rad, \
         N.m/deg or a number in N.m/rad",
    );
    says(
        refused("[run]\nduration = \"1 s\"\n", ""),
        "1:1: run.duration: missing; write a time as s, ms, min or a number in s",
    );
    says(refused("about = \"A wall.\"\n", ""), "1:1: about: missing; write a few sentences that say what to look for");
}

#[test]
fn a_wrong_unit_is_refused_with_the_units_there_are() {
    says(
        refused("1.5 N.m/rad", "25 mm"),
        "11:13: wall.stiffness: `25 mm` is not a torsional stiffness: write N.m/rad, mN.m/rad, \
         N.m/deg or a number in N.m/rad",
    );
    says(
        refused("\"1.5 rad\"", "true"),
        "10:12: wall.position: `true` is not an angle: write rad, mrad, deg, rev or a number in rad",
    );
}

#[test]
fn a_wrong_sign_is_refused() {
    says(refused("\"1.5 N.m/rad\"", "-2"), "11:13: wall.stiffness: `-2` must not be negative");
    says(
        refused("kind = \"motor\"", "kind = \"motor\"\nresistance = \"0 Ohm\""),
        "4:14: device.resistance: `0 Ohm` must be above zero",
    );
    says(
        refused("kind = \"motor\"", "kind = \"motor\"\nrotor_inertia = \"-1 g.cm2\""),
        "4:17: device.rotor_inertia: `-1 g.cm2` must be above zero",
    );
    says(
        refused("kind = \"motor\"", "kind = \"motor\"\ncoulomb_friction = -1e-3"),
        "4:20: device.coulomb_friction: `-1e-3` must not be negative",
    );
}

#[test]
fn nan_and_infinity_are_refused() {
    for number in ["nan", "inf", "-inf", "\"nan rad\"", "\"inf\"", "1e999"] {
        let message = refused("\"1.5 rad\"", number);
        assert!(message.starts_with("testbench/scenes/x.toml:10:12: "), "{number}: {message}");
    }
}

#[test]
fn a_clock_of_zero_and_a_fraction_of_a_hertz_are_refused() {
    says(refused("50 MHz", "0 Hz"), "5:13: clock.frequency: `0 Hz` must be above zero");
    let accepted = "a clock runs at a whole number of hertz from 1 Hz to 10 GHz, as in \"50 MHz\" or \"25.175 MHz\"";
    says(refused("50 MHz", "2.5 Hz"), &format!("5:13: clock.frequency: 2.5 Hz: {accepted}"));
    says(refused("50 MHz", "11 GHz"), "5:13: clock.frequency: 1.1e10 Hz; accepted: 1 to 1e10 Hz");
}

#[test]
fn whoever_asks_for_the_frequency_of_the_pwm_is_told_what_sets_it() {
    let told = "a PWM's frequency is clock.frequency / 2^method.pwm.bits, as in 50 MHz / 2^12 = 12.207 kHz; \
                set these two keys";
    let rate = "sample_rate = \"1 kHz\"";
    let says_told = |said: String, place: &str| says(said, &format!("{place}: unknown key; {told}"));
    says_told(refused(rate, &format!("{rate}\npwm.frequency = \"20 kHz\"")), "9:5: method.pwm.frequency");
    says_told(refused(rate, &format!("{rate}\npwm_frequency = \"20 kHz\"")), "9:1: method.pwm_frequency");
    says_told(refused("[wall]", "[pwm]\nfrequency = \"20 kHz\"\n[wall]"), "9:2: pwm");
    for key in ["pwm.frequency", "method.pwm.frequency", "method.pwm_frequency"] {
        let said = parse(GOOD, &[(key, "20 kHz")]).expect_err(key);
        assert!(said.starts_with(&format!("--set {key}=20 kHz: ")) && said.ends_with(told), "{said}");
    }
    let said = parse(GOOD, &[("pwm.bits", "10")]).expect_err("pwm.bits");
    assert!(said.ends_with("pwm: unknown key; the PWM's keys stand in [method.pwm]"), "{said}");
}

#[test]
fn an_impossible_format_is_refused() {
    let format =
        |text: &str| refused("sample_rate = \"1 kHz\"", &format!("sample_rate = 1000\nstiffness_format = {text}"));
    says(format("\"(0,60,10)\""), "9:20: method.stiffness_format: format (0,60,10) has 70 bits; a word has 1 to 64");
    says(
        format("\"12.0\""),
        "9:20: method.stiffness_format: `12.0` is not a format; write (S,I,F): sign bit 0 or 1, integer bits, \
         fraction bits, as in (1,9,22); or UQ4.8, Q4.8 (as TI writes it: the sign bit is not among the 4), ufix12_En8, \
         sfix16_En12, ufixed(3 downto -8), ap_ufixed<12,4>",
    );
    says(format("12"), "9:20: method.stiffness_format: `12` is not a format; write \"(S,I,F)\", as in \"(0,12,0)\"");
    let gain = "a gain is unsigned, has no negative fraction bits and 2 to 32 bits, as in \"(0,12,0)\"";
    for wrong in ["(1,11,0)", "(0,12,-1)", "(0,30,10)", "(0,1,0)"] {
        says(format(&format!("\"{wrong}\"")), &format!("9:20: method.stiffness_format: {wrong}: {gain}"));
    }
    let ti = "`Q4.8` is (1,4,8), 13 bits, as TI writes it; ARM counts the sign bit too";
    says(format("\"Q4.8\""), &format!("9:20: method.stiffness_format: {ti}: {gain}"));
    let mathworks = "`sfix16_En12` is (1,3,12)";
    says(format("\"sfix16_En12\""), &format!("9:20: method.stiffness_format: {mathworks}: {gain}"));
}

#[test]
fn a_width_that_no_block_has_is_refused() {
    for (width, range) in
        [("position_bits = 1", "2 to 32"), ("period_bits = 31", "2 to 30"), ("pwm.bits = 40", "2 to 24")]
    {
        let message = refused("sample_rate = \"1 kHz\"", &format!("sample_rate = 1000\n{width}"));
        assert!(message.starts_with("testbench/scenes/x.toml:9:"), "{message}");
        assert!(message.ends_with(&format!("is not a whole number from {range}")), "{message}");
    }
}

#[test]
fn a_gain_that_does_not_fit_is_refused_with_the_greatest_that_does() {
    // 4095 PWM counts per count at 0.0421760599 N.m/rad each.
    says(
        refused("1.5 N.m/rad", "200 N.m/rad"),
        "11:13: wall.stiffness: 200 N.m/rad does not fit (0,12,0); write at most 172.7109 N.m/rad, \
         or more integer bits",
    );
}

#[test]
fn a_gain_that_rounds_to_nothing_is_refused() {
    let message = refused("1.5 N.m/rad", "0.02 N.m/rad");
    let start = "testbench/scenes/x.toml:11:13: wall.stiffness: 0.02 N.m/rad rounds to zero in (0,12,0); \
                 write 0, at least 0.04217606";
    assert!(message.starts_with(start), "{message}");
    assert!(message.ends_with("or more fraction bits"), "{message}");
}

#[test]
fn a_sample_period_that_is_no_clock_or_too_many_is_refused() {
    says(
        refused("1 kHz", "200 MHz"),
        "8:15: method.sample_rate: 200000000 Hz takes 0 clocks a sample; period_bits = 24 at this clock accepts \
         2.980233 Hz to 50000000 Hz",
    );
    let message = refused("1 kHz", "1 Hz");
    assert!(message.contains("1 Hz takes 50000000 clocks a sample"), "{message}");
}

#[test]
fn a_run_of_no_time_or_of_too_many_edges_is_refused() {
    says(refused("\"1 s\"", "0"), "15:12: run.duration: `0` must be above zero");
    says(refused("\"1 s\"", "\"1 ns\""), "15:12: run.duration: 0.05 clock edges; a run has 1 to 2^62");
    let long = [("clock.frequency", "10 GHz"), ("run.duration", "1e9")];
    let message = parse(GOOD, &long).unwrap_err();
    assert!(message.ends_with(": 1e19 clock edges; a run has 1 to 2^62"), "{message}");
}

#[test]
fn a_dead_time_longer_than_half_a_pwm_period_is_refused() {
    says(
        refused("sample_rate = \"1 kHz\"", "sample_rate = 1000\npwm.dead_time = \"1 ms\""),
        "9:17: method.pwm.dead_time: longer than half a PWM period; write at most 4.096e-5 s",
    );
}

/// A scene whose motor follows a target.
const FOLLOWING: &str = r#"about = "A target."
[device]
kind = "motor"
[clock]
frequency = "50 MHz"
[method]
kind = "pid"
sample_rate = "1 kHz"
kp = 0.1
[target]
path = [[0, 0], [0.1, 1]]
[hand]
kind = "none"
[run]
duration = "1 s"
"#;

#[test]
fn a_controller_or_a_target_that_cannot_be_is_refused() {
    let with = |from: &str, to: &str| {
        assert_eq!(FOLLOWING.matches(from).count(), 1, "{from}");
        parse(&FOLLOWING.replace(from, to), &[]).expect_err(to)
    };
    parse(FOLLOWING, &[]).unwrap();
    let form = "[[time, angle], ...] with at least one point, as in [[0, 0], [\"50 ms\", \"30 deg\"]]";
    let path = "path = [[0, 0], [0.1, 1]]";
    let gains = "kp = 0.1";
    for (from, to, told) in [
        (path, "", &format!("10:1: target.path: missing; write {form}")[..]),
        (path, "path = 1", &format!("11:8: target.path: not a path; write {form}")),
        (path, "path = [[0, 0], [0, 1]]", "11:18: target.path[1][0]: times must increase: 0 s follows 0 s"),
        (
            path,
            "path = [[0, \"1 m\"]]",
            "11:13: target.path[0][1]: `1 m` is not an angle: write rad, mrad, deg, rev or a \
         number in rad",
        ),
        (
            path,
            "path = [[0, 0], [1e-6, 4]]",
            "11:17: target.path[1]: the target steps by 2608 counts in a sample, and 12 \
         bits hold less than 2048 to either side; write method.position_bits = 13, or points farther apart in time",
        ),
        (
            path,
            "path = [[0, 4]]",
            "11:9: target.path[0]: the target steps by 2608 counts in a sample, and 12 bits hold \
         less than 2048 to either side; write method.position_bits = 13, or points farther apart in time",
        ),
        (
            path,
            &format!("{path}\namplitude = 1"),
            "12:13: target.amplitude: without frequency it says nothing; write \
         frequency too, or leave this out",
        ),
        (
            path,
            &format!("{path}\namplitude = 1\nfrequency = 501"),
            "13:13: target.frequency: 501 Hz; accepted: half of \
         the sample rate at most, 500 Hz",
        ),
        (
            path,
            &format!("{path}\namplitude = 3\nfrequency = 400"),
            "12:13: target.amplitude: the target steps by 3911 \
         counts in a sample, and 12 bits hold less than 2048 to either side; write method.position_bits = 13, or \
         points farther apart in time",
        ),
        (gains, "", "6:1: method.kp: missing; write a torsional stiffness as "),
        (gains, "kp = \"1 N/m\"", "9:6: method.kp: `1 N/m` is not a torsional stiffness: "),
        (gains, "kp = 1e3", "9:6: method.kp: 1000 N.m/rad does not fit (0,12,0); "),
        (gains, "kp = 0.1\nki = -1", "10:6: method.ki: `-1` must not be negative"),
        (gains, "kp = 0.1\nki = 1e-9", "10:6: method.ki: 1e-9 N.m/rad/s rounds to zero in (0,12,12); "),
        (gains, "kp = 0.1\nclamp = 1e-5", "10:9: method.clamp: 1e-5 N.m is no PWM count; accepted: "),
        (
            gains,
            "kp = 0.1\nintegral_format = \"(0,4,20)\"",
            "10:19: method.integral_format: position_pid: the gains need \
         12 integer and 20 fraction bits; accepted: 24 bits for all three gains together",
        ),
        (
            gains,
            "kp = 0.1\nback_shift = 3",
            "10:14: method.back_shift: nothing is given back; write anti_windup = \
         \"back_calculation\", or leave this out",
        ),
        (
            gains,
            "kp = 0.1\nanti_windup = \"back_calculation\"\nback_shift = 13",
            "11:14: method.back_shift: accepted: 0 \
         to 12, the fraction bits of the gains",
        ),
        (
            "duration = \"1 s\"",
            "duration = \"1 s\"\n[expect]\ncontact_share = { value = 1, tolerance = 0 }",
            "17:17: \
         expect.contact_share: a method that follows a target has no wall; accepted: rms, final_angle, peak_angle, \
         amplitude, frequency, peak_torque, encoder_edges",
        ),
        ("[hand]", "[wall]\nposition = 1\nstiffness = 1\n[hand]", "12:2: wall: unknown key; accepted here: "),
        ("kind = \"pid\"", "kind = \"hybrid\"", "10:2: target: unknown key; accepted here: "),
    ] {
        let found = with(from, to);
        assert!(found.contains(&format!("testbench/scenes/x.toml:{told}")), "{to}:\n{found}\n{told}");
    }
}

#[test]
fn a_table_that_its_words_do_not_hold_is_refused_at_its_line() {
    let with = |keys: &str| refused("kind = \"hybrid\"", &format!("kind = \"table\"\n{keys}"));
    let form = "[torque, ...] with 2, 4, 8, 16 or 32 torques, as in [0, \"-2 mN.m\", 0, \"2 mN.m\"]";
    says(with("spacing = 4"), &format!("6:1: method.torques: missing; write {form}"));
    says(with("torques = 3"), &format!("8:11: method.torques: not a list; write {form}"));
    for length in [0, 1, 3, 33, 64, 100_000] {
        let told = format!("8:11: method.torques: {length} torques; accepted: 2, 4, 8, 16 or 32");
        says(with(&format!("torques = [{}]", "0, ".repeat(length))), &told);
    }
    let found = with("torques = [0, \"1 N\"]");
    assert!(found.contains("8:15: method.torques[1]: ") && found.contains("N.m"), "{found}");
    // Full scale is 0.0259 N.m/A times 24 V over 2.3456603773584903 Ohm, 4095 of 4096 of it.
    let told = "8:15: method.torques[1]: 0.3 is more than the bridge can show; write -0.2649353 to 0.2649353";
    says(with("torques = [0, 0.3]"), told);
    says(
        with("torques = [0, 0]\nspacing = 3"),
        "9:11: method.spacing: `3` is no power of two; accepted: 1, 2, 4 and on",
    );
    let told = "9:11: method.spacing: 2 torques 4096 counts apart do not fit a counter of 12 bits; accepted: 2048 \
                counts at most, or more position_bits";
    says(with("torques = [0, 0]\nspacing = 4096"), told);
    parse(&GOOD.replace("kind = \"hybrid\"", "kind = \"table\"\ntorques = [0, 0]\nspacing = 2048"), &[]).unwrap();
}

#[test]
fn a_choice_that_is_none_is_refused_with_the_choices() {
    let choices = "\"hybrid\", \"conventional\", \"sampled_wall\", \"virtual_coupling\", \"passivity_controller\", \
                   \"energy_bounding\", \"passive_spring\", \"braking_pulse\", \"table\", \"pid\"";
    says(
        refused("\"hybrid\"", "\"hybird\""),
        &format!("7:8: method.kind: `hybird` is none of {choices}; did you mean hybrid?"),
    );
    says(refused("\"hybrid\"", "3"), &format!("7:8: method.kind: `3` is none of {choices}"));
}

#[test]
fn a_value_where_a_section_is_expected_is_refused() {
    let text = GOOD.replace("[run]\nduration = \"1 s\"\n", "");
    says(parse(&format!("run = 3\n{text}"), &[]).unwrap_err(), "1:7: run: a section is expected; write [run]");
}

#[test]
fn a_reference_rate_without_rescaling_is_refused_and_with_it_required() {
    says(
        refused("sample_rate = \"1 kHz\"", "sample_rate = 1000\nreference_rate = \"1 kHz\""),
        "9:18: method.reference_rate: only a rescaled velocity has one; write rescaled = true beside it",
    );
    says(
        refused("sample_rate = \"1 kHz\"", "sample_rate = 1000\nrescaled = true"),
        "6:1: method.reference_rate: missing; write a frequency as Hz, MHz or a number in Hz",
    );
}

/// Returns the message for a sampled wall with this estimator on line 8, and this key on line 9.
fn refused_estimator(estimator: &str, key: &str) -> String {
    refused("kind = \"hybrid\"", &format!("kind = \"sampled_wall\"\nestimator = \"{estimator}\"\n{key}"))
}

#[test]
fn a_filter_without_a_corner_that_its_words_hold_is_refused() {
    let corner = |corner: &str| refused_estimator("filtered", &format!("velocity_filter = {{ corner = {corner} }}"));
    says(corner("0"), "9:30: method.velocity_filter.corner: `0` must be above zero");
    // A weight of 1 / 2^17 at 1 kHz is a corner of -ln(1 - 2^-17) / (2 pi 1 ms), one of 1 - 2^-17 a corner of
    // 17 ln(2) / (2 pi 1 ms).
    let ends = "accepted at this sample rate: 0.001214261 to 1875.402 Hz";
    for (value, weight) in [("0.0012", 0), ("\"2 kHz\"", 1)] {
        let told = format!("rounds to a weight of {weight} in 16 bits; {ends}");
        says(corner(value), &format!("9:30: method.velocity_filter.corner: {told}"));
    }
    for end in ["0.001214261", "1875.402"] {
        let law = format!("kind = \"sampled_wall\"\nestimator = \"filtered\"\nvelocity_filter.corner = {end}");
        parse(&GOOD.replace("kind = \"hybrid\"", &law), &[]).unwrap();
    }
    let two = "velocity_filter = { corner = 30 }\nfilter_shift = 3";
    let told = "10:16: method.filter_shift: the filter has a corner; leave one of the two out";
    says(refused_estimator("filtered", two), told);
    says(
        refused_estimator("window", "velocity_filter = { corner = 30 }"),
        "9:19: method.velocity_filter: not a number of this estimator; leave it out",
    );
    for order in ["0", "3", "2.5"] {
        let told = refused_estimator("filtered", &format!("velocity_filter = {{ corner = 9, order = {order} }}"));
        assert!(told.contains("9:41: method.velocity_filter.order: ") && told.contains("1 to 2"), "{told}");
    }
    // Of 40 bits 20 are those of position and velocity. K^2 / D of 2^-21 is K = 6.908698e-4, atan(K) / (pi 1 ms) the
    // least corner; 49 % of the rate is the greatest.
    let ends = "accepted at this sample rate: 0.2199112 to 489.9999 Hz";
    for value in ["0.219", "490.1", "1e4"] {
        let second = format!("velocity_filter = {{ corner = {value}, order = 2 }}");
        let told = format!("a filter of the second order has 20 bits beside those of position and velocity; {ends}");
        says(refused_estimator("filtered", &second), &format!("9:30: method.velocity_filter.corner: {told}"));
    }
    for end in ["0.2199112", "489.9999"] {
        let law =
            "kind = \"sampled_wall\"\nestimator = \"filtered\"\nvelocity_filter.order = 2\nvelocity_filter.corner";
        parse(&GOOD.replace("kind = \"hybrid\"", &format!("{law} = {end}")), &[]).unwrap();
    }
    let told = "9:19: method.velocity_filter.corner: missing; write a frequency as Hz, MHz or a number in Hz";
    says(refused_estimator("filtered", "velocity_filter = {}"), told);
}

#[test]
fn a_path_is_points_in_the_order_of_time() {
    let path = |path: &str| refused_hand(&format!("kind = \"prescribed\"\npath = {path}"));
    let accepted = "write [[time, angle], ...] with at least one point, as in [[0, 0], [\"50 ms\", \"30 deg\"]]";
    says(path("[]"), &format!("14:8: hand.path: not a path; {accepted}"));
    says(path("3"), &format!("14:8: hand.path: not a path; {accepted}"));
    says(path("[[0, 1], [2]]"), &format!("14:17: hand.path[1]: not a pair; {accepted}"));
    says(path("[[0, 1], [\"1 s\", 1], [1, 2]]"), "14:30: hand.path[2][0]: times must increase: 1 s follows 1 s");
    says(
        path("[[0, \"1 V\"]]"),
        "14:13: hand.path[0][1]: `1 V` is not an angle: write rad, mrad, deg, rev or a number in rad",
    );
    says(
        refused_hand("kind = \"prescribed\""),
        "12:1: hand.path: missing; write path = [[time, angle], ...], or file = \"motion.csv\"",
    );
    says(
        refused_hand("kind = \"prescribed\"\npath = [[0, 0]]\nfile = \"good.csv\""),
        "15:8: hand.file: a path is given too; write one of path, file",
    );
}

#[test]
fn a_missing_file_is_told_with_the_key_that_names_it() {
    let message = refused_hand("kind = \"prescribed\"\nfile = \"gone.csv\"");
    assert!(message.starts_with("testbench/scenes/x.toml:14:8: hand.file: cannot read `gone.csv` ("), "{message}");
    assert!(message.ends_with("write the name of a file beside the scene"), "{message}");
}

#[test]
fn a_bad_line_of_a_recording_is_told_with_its_number() {
    says(
        refused_hand("kind = \"prescribed\"\nfile = \"backwards.csv\""),
        "14:8: hand.file: backwards.csv:4: time must increase from line to line: 0.5 s follows 1 s",
    );
    let capture = |file: &str, b: &str| {
        refused_hand(&format!("kind = \"capture\"\nfile = \"{file}\"\nchannel_a = \"D0\"\nchannel_b = \"{b}\""))
    };
    says(capture("backwards.vcd", "D1"), "14:8: hand.file: backwards.vcd:6: time runs backwards, from #9 to #5");
    says(
        capture("good.vcd", "D7"),
        "14:8: hand.file: good.vcd:4: no channel `D7`; one-bit channels of this file: D0, D1",
    );
}

#[test]
fn parts_that_do_not_agree_are_refused() {
    let mass = "kind = \"mass\"\nmass = \"75 g\"\ndamping = 0.005\n[model]\ndatapath = \"linear\"";
    let text = GOOD.replace("kind = \"motor\"", mass).replace("1.5 rad", "2 in").replace("1.5 N.m/rad", "1 N/mm");
    assert!(parse(&text, &[]).unwrap_err().contains("`2 in` is not a length: write m, mm, cm or a number in m"));
    let text = text.replace("2 in", "2 cm");
    let linear = parse(&text, &[("model.delay", "1.1 ms")]).unwrap();
    assert_eq!((linear.wall.position_rad, linear.wall.stiffness_nm_per_rad), (0.02, 1000.0));
    assert_eq!(linear.model.delay_s, 1.1e-3);
    says(
        refused("[hand]", "[model]\ndelay = \"1 ms\"\n[hand]"),
        "13:9: model.delay: only the linear law takes a delay; write datapath = \"linear\"",
    );
}

#[test]
fn a_start_that_the_hand_overrules_is_refused() {
    let text = GOOD.replace("kind = \"none\"", "kind = \"prescribed\"\npath = [[0, 1]]");
    let text = text.replace("kind = \"motor\"", "kind = \"motor\"\ninitial_angle = 1");
    says(
        parse(&text, &[]).unwrap_err(),
        "4:17: device.initial_angle: a prescribed hand imposes the motion from its first point on; leave this out",
    );
}

#[test]
fn an_override_replaces_a_key_and_creates_its_section() {
    let scene = parse(GOOD, &[("wall.stiffness", "2"), ("method.pwm.bits", "10"), ("hand.kind", "none")]).unwrap();
    assert_eq!((scene.wall.stiffness_nm_per_rad, scene.method.pwm.bits), (2.0, 10));
    let scene = parse(GOOD, &[("wall.stiffness", "2"), ("wall.stiffness", "800 mN.m/rad")]).unwrap();
    assert_eq!(scene.wall.stiffness_nm_per_rad, 0.8);
    let scene = parse(GOOD, &[("hand", "{ kind = \"constant_torque\", torque = \"5 mN.m\" }")]).unwrap();
    assert_eq!(scene.hand, hpu_scene::Hand::ConstantTorque { torque_nm: 0.005 });
}

#[test]
fn a_bad_override_is_told_as_the_override_it_is() {
    let set = |key, value| parse(GOOD, &[(key, value)]).unwrap_err();
    assert_eq!(
        set("wall.stifness", "2"),
        "--set wall.stifness=2: wall.stifness: unknown key; accepted here: position, wraps, stiffness, damping, ramp; \
         did you mean stiffness?"
    );
    assert!(set("wal.stiffness", "2").starts_with("--set wal.stiffness=2: wal: unknown key; accepted here: about,"));
    assert_eq!(
        set("wall.stiffness", "25 mm"),
        "--set wall.stiffness=25 mm: wall.stiffness: `25 mm` is not a torsional stiffness: write N.m/rad, mN.m/rad, \
         N.m/deg or a number in N.m/rad"
    );
    assert_eq!(
        set("hand", "{ kind = \"constant_torque\" }"),
        "--set hand={ kind = \"constant_torque\" }: hand.torque: missing; write a torque as N.m, \
         mN.m or a number in N.m"
    );
    assert_eq!(set("about.x", "1"), "--set about.x=1: about.x: about is a value, not a section");
    assert_eq!(set("", "1"), "--set =1: not a key; write section.key, as in wall.stiffness");
}

proptest! {
    #[test]
    fn no_scene_panics_and_every_refusal_has_a_place(
        at in 0usize..GOOD.len(),
        cut in 0usize..30,
        with in "[ -~\\nµ]{0,24}",
        key in "[ -~]{0,12}",
        value in "[ -~]{0,20}",
    ) {
        let spoiled = format!("{}{with}{}", &GOOD[..at], &GOOD[(at + cut).min(GOOD.len())..]);
        if let Err(message) = parse(&spoiled, &[]) {
            let place = message.strip_prefix("testbench/scenes/x.toml:").unwrap_or_default();
            // The motor is named by an override, which makes a section that the spoiled text does not have.
            let is_of_motor = message.starts_with("--set device.motor=vasudevan_2007: device.");
            prop_assert!(is_of_motor || place.starts_with(|c: char| c.is_ascii_digit()), "{message}");
        }
        if let Err(message) = parse(GOOD, &[(&key, &value)]) {
            let of_set = message.starts_with(&format!("--set {key}={value}: "));
            prop_assert!(of_set || message.contains("x.toml:"), "{message}");
        }
    }
}

/// Returns a scene around a motor with these data.
fn motor(data: &str) -> Result<Scene, String> {
    let text = GOOD.replace("kind = \"motor\"", &format!("kind = 'motor'\n{data}"));
    Scene::parse("testbench/scenes/x.toml", &text, &[], &mut files).map_err(|error| error.to_string())
}

#[test]
fn a_motor_has_no_data_that_nobody_gave() {
    let four = "resistance = \"2.18 Ohm\"\ninductance = \"0.238 mH\"\ntorque_constant = \"23.4 mN.m/A\"\n\
                rotor_inertia = \"10.3 g.cm2\"";
    let Device::Motor(own) = motor(four).unwrap().device else { panic!("a motor") };
    assert_eq!((own.resistance_ohm, own.inductance_h), (2.18, 0.238e-3));
    assert_eq!((own.torque_constant_nm_per_a, own.rotor_inertia_kg_m2), (23.4e-3, 10.3e-7));
    assert_eq!((own.viscous_friction_nm_s_per_rad, own.coulomb_friction_nm, own.wheel_ratio), (0.0, 0.0, 1.0));
    for left_out in four.lines() {
        let key = left_out.split_once(' ').unwrap().0;
        let said = motor(&four.replace(left_out, "")).unwrap_err();
        let missing = format!("x.toml:2:1: device.{key}: missing; write ");
        assert!(said.contains(&missing) && said.ends_with("or name the motor: motor = \"vasudevan_2007\""), "{said}");
    }
    // A named motor brings its own data, which keys replace one by one; the wheel is not part of them.
    let Device::Motor(named) = motor("motor = \"vasudevan_2007\"\ninductance = \"1 mH\"").unwrap().device else {
        panic!("a motor")
    };
    assert_eq!((named.torque_constant_nm_per_a, named.viscous_friction_nm_s_per_rad), (25.9e-3, 1.3e-6));
    assert_eq!((named.inductance_h, named.wheel_ratio), (1e-3, 1.0));
    let said = motor("motor = \"maxon\"").unwrap_err();
    assert!(said.contains("x.toml:4:9: device.motor: `maxon` is none of \"vasudevan_2007\", "), "{said}");
}

#[test]
fn every_parameter_tells_its_unit_and_who_said_it() {
    let scene = parse(GOOD, &[("wall.stiffness", "2 N.m/rad")]).unwrap();
    let said = |key: &str| {
        let parameter = scene.parameters.iter().find(|parameter| parameter.key == key);
        parameter.map(|Parameter { value, unit, origin, .. }| (value.clone(), *unit, *origin))
    };
    let number = |value| ParameterValue::Number(value);
    assert_eq!(said("wall.stiffness"), Some((number(2.0), "N.m/rad", Origin::Set)));
    assert_eq!(said("wall.position"), Some((number(1.5), "rad", Origin::Scene)));
    assert_eq!(said("wall.damping"), Some((number(0.0), "N.m.s/rad", Origin::Default)));
    assert_eq!(
        said("device.inductance"),
        Some((number(0.226e-3), "H", Origin::Part { kind: "motor", name: "vasudevan_2007" }))
    );
    assert_eq!(said("device.wheel_ratio"), Some((number(1.0), "", Origin::Default)));
    assert_eq!(said("method.pwm.bits"), Some((ParameterValue::Integer(12), "bit", Origin::Default)));
    assert_eq!(said("method.kind"), Some((ParameterValue::Text("hybrid".into()), "", Origin::Scene)));
    assert_eq!(said("method.stiffness_format"), Some((ParameterValue::Text("(0,12,0)".into()), "", Origin::Default)));
    // Each parameter is listed once, and only if the run uses it.
    let mut keys: Vec<&str> = scene.parameters.iter().map(|parameter| parameter.key.as_str()).collect();
    let all = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), all);
    for unused in ["about", "expect", "method.scale_format", "model.delay"] {
        assert!(!keys.iter().any(|key| key.starts_with(unused)), "{unused}");
    }
}

#[test]
fn a_stiffness_that_its_word_misses_by_far_has_a_format_that_holds_it() {
    // A word is 0.265 N.m / 4096 / (2 pi / 4096) = 42.176 mN.m/rad: 0.1 N.m/rad is 2.371 words, read as 2.
    let word = 24.0 * 25.9e-3 / (25.9e-3 * 24.0 / 0.265) / std::f64::consts::TAU;
    let miss = |format: &str, stiffness: &str| {
        let set = [("method.stiffness_format", format), ("wall.stiffness", stiffness)];
        parse(GOOD, &set).unwrap().words().unwrap().realised.stiffness_miss
    };
    let found = miss("(0,12,0)", "0.1").expect("15.7 % off");
    assert!((found.error - (2.0 * word / 0.1 - 1.0)).abs() < 1e-12, "{}", found.error);
    // The nearest word is 2.5 in halves (+5.4 %), 2.25 in quarters (-5.1 %), 2.375 in eighths (+0.17 %).
    assert_eq!(found.format.map(|format| format.to_string()), Some("(0,12,3)".to_string()));
    assert_eq!(miss("(0,12,3)", "0.1"), None);
    // 1.5 N.m/rad is 35.57 words; the word 36 is 1.2 % more.
    assert_eq!(miss("(0,12,0)", "1.5"), None);
    // 32 bits are too few for the format that such a soft wall needs.
    let none = miss("(0,31,1)", "0.015").expect("40.6 % off");
    assert_eq!(none.format, None);
}

#[test]
fn links_of_a_named_arm_are_said_by_its_model() {
    let shipped = hpu_scene::shipped().iter().find(|scene| scene.name == "phantom-drop").expect("it is shipped");
    let said = |set: &[(String, String)], key: &str| {
        let experiment = shipped.parse(set).expect("a scene");
        let found = experiment.parameters.iter().find(|parameter| parameter.key == key).cloned().expect(key);
        (found.unit, found.origin)
    };
    let set = |key: &str, value: &str| vec![(key.to_string(), value.to_string())];
    assert_eq!(said(&[], "device.upper_arm"), ("m", Origin::Arm("premium_1.0")));
    assert_eq!(said(&set("device.model", "premium_1.5"), "device.forearm"), ("m", Origin::Arm("premium_1.5")));
    assert_eq!(said(&set("device.forearm", "0.13"), "device.forearm"), ("m", Origin::Set));
    assert_eq!(said(&[], "method.depth_bits"), ("bit", Origin::Default));
}
