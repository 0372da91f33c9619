//! A bad scene of a PHANToM is refused with file, line, column, key, and what is accepted instead.

use hpu_scene::Experiment;

/// A scene that is accepted; every test spoils one part of it.
const GOOD: &str = r#"about = "A drop."
[device]
kind = "phantom"
[drop]
axis = "y"
[platform]
kind = "FPGA-400"
[clock]
frequency = "50 MHz"
[room]
stiffness = "1 kN/m"
[run]
duration = "10 s"
"#;

fn parse(text: &str) -> Result<Experiment, String> {
    let mut no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    Experiment::parse("testbench/scenes/x.toml", text, &[], &mut no_files).map_err(|error| error.to_string())
}

/// Checks that the message for the good scene with `from` replaced is exactly this, after `testbench/scenes/x.toml:`.
#[track_caller]
fn says(from: &str, to: &str, expected: &str) {
    assert_eq!(GOOD.matches(from).count(), 1, "{from}");
    let message = parse(&GOOD.replace(from, to)).expect_err(to);
    assert_eq!(message, format!("testbench/scenes/x.toml:{expected}"));
}

/// Checks the message as [`says`] does, for the good scene with one more line in a section.
#[track_caller]
fn says_with(section: &str, line: &str, expected: &str) {
    let header = format!("[{section}]\n");
    if GOOD.contains(&header) {
        says(&header, &format!("{header}{line}\n"), expected);
    } else {
        // A new section goes to the end: its header is line 14.
        says("duration = \"10 s\"\n", &format!("duration = \"10 s\"\n{header}{line}\n"), expected);
    }
}

#[test]
fn the_scene_that_the_tests_spoil_is_good() {
    parse(GOOD).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn an_unknown_key_is_refused_with_the_keys_there_are() {
    says(
        "[run]",
        "[wall]\n[run]",
        "12:2: wall: unknown key; accepted here: about, device, drop, platform, clock, method, room, model, run, \
         record, expect, accuracy",
    );
    says_with(
        "device",
        "mass = 1",
        "3:1: device.mass: unknown key for kind \"phantom\"; accepted here: kind, model, upper_arm, forearm, \
         coulomb_force, viscous_damping, gravity",
    );
    says_with(
        "drop",
        "wieght = 1",
        "5:1: drop.wieght: unknown key; accepted here: axis, weight, speed, trial; did you mean weight?",
    );
    says_with(
        "platform",
        "rate = 1",
        "7:1: platform.rate: unknown key for kind \"FPGA-400\"; accepted here: kind, jitter, missed",
    );
    says_with("method", "bits = 1", "15:1: method.bits: unknown key; accepted here: architecture, words, depth_bits");
    says_with(
        "room",
        "wall = \"y\"",
        "11:1: room.wall: unknown key; accepted here: distance, stiffness, walls; did you mean walls?",
    );
    says_with(
        "model",
        "lag = 1",
        "15:1: model.lag: unknown key; accepted here: solver, step, law, joints, friction, delay, latency, \
         amplifier_lag, transmission_stiffness, transmission_damping, motor_share; did you mean law?",
    );
    says_with("expect", "final_angle = 1", "15:1: expect.final_angle: unknown key; accepted here: outcome, rms");
}

#[test]
fn a_missing_key_is_told_at_its_section_with_what_to_write() {
    says("axis = \"y\"\n", "", "4:1: drop.axis: missing; write one of \"x\", \"y\", \"z\"");
    says(
        "stiffness = \"1 kN/m\"\n",
        "",
        "10:1: room.stiffness: missing; write a stiffness as N/m, mN/m, N/mm or a number in N/m",
    );
    says(
        "kind = \"FPGA-400\"\n",
        "",
        "6:1: platform.kind: missing; write one of \"PMOS-1\", \"RTOS-1\", \"RTOS-5\", \"RTOS-10\", \"RTOS-20\", \
         \"FPGA-20\", \"FPGA-100\", \"FPGA-400\"",
    );
}

#[test]
fn a_choice_that_is_none_is_refused_with_the_choices() {
    says(
        "FPGA-400",
        "FPGA-800",
        "7:8: platform.kind: `FPGA-800` is none of \"PMOS-1\", \"RTOS-1\", \"RTOS-5\", \"RTOS-10\", \"RTOS-20\", \
         \"FPGA-20\", \"FPGA-100\", \"FPGA-400\"",
    );
    says_with(
        "device",
        "model = \"premium_3.0\"",
        "3:9: device.model: `premium_3.0` is none of \"premium_1.0\", \"premium_1.5\"",
    );
    says_with(
        "method",
        "architecture = \"serial\"",
        "15:16: method.architecture: `serial` is none of \"parallel\", \"shared\"",
    );
    says_with(
        "method",
        "words = \"wide\"",
        "15:9: method.words: `wide` is none of \"fitted\", \"narrow\", \"plain_q22\"",
    );
    says_with("model", "law = 1", "15:7: model.law: `1` is none of \"words\", \"floats\", \"ideal\"");
    says_with("model", "joints = \"y\"", "15:10: model.joints: `y` is none of \"all\", \"tested\"");
    says_with("model", "friction = 1", "15:12: model.friction: `1` is not true or false");
    says_with(
        "expect",
        "outcome = \"settled\"",
        "15:11: expect.outcome: `settled` is none of \"passive\", \"non_passive\", \"highly_unstable\"",
    );
}

#[test]
fn a_wrong_unit_or_sign_is_refused_with_the_units_there_are() {
    says(
        "1 kN/m",
        "1 kN",
        "11:13: room.stiffness: `1 kN` is not a stiffness: write N/m, mN/m, N/mm or a number in N/m",
    );
    says("\"1 kN/m\"", "-1", "11:13: room.stiffness: `-1` must not be negative");
    says_with("drop", "weight = \"15 g\"", "5:10: drop.weight: `15 g` is not a force: write N, mN or a number in N");
    says_with("drop", "speed = -0.1", "5:9: drop.speed: `-0.1` must not be negative");
    says_with("device", "forearm = 0", "3:11: device.forearm: `0` must be above zero");
    says_with(
        "expect",
        "rms = { value = \"30 um\", tolerance = \"1 ms\" }",
        "15:38: expect.rms.tolerance: `1 ms` is not a length: write m, mm, cm or a number in m",
    );
}

#[test]
fn lengths_are_those_of_an_arm_and_a_premium_1_5_has_its_own() {
    says_with(
        "device",
        "upper_arm = \"1 cm\"",
        "3:13: device.upper_arm: 0.01 m: links of 20 mm to 500 mm are accepted",
    );
    says_with("device", "forearm = \"1 m\"", "3:11: device.forearm: 1 m: links of 20 mm to 500 mm are accepted");
    for key in ["upper_arm", "forearm"] {
        says_with(
            "device",
            &format!("model = \"premium_1.5\"\n{key} = \"14 cm\""),
            &format!(
                "4:{}: device.{key}: the Premium 1.5 has its own; leave this out, or write model = \"premium_1.0\"",
                key.len() + 4
            ),
        );
    }
}

#[test]
fn plain_words_are_those_of_the_premium_1_0_alone() {
    let text = GOOD.replace("kind = \"phantom\"", "kind = \"phantom\"\nmodel = \"premium_1.5\"");
    let message = parse(&format!("{text}[method]\nwords = \"plain_q22\"\n")).expect_err("refused");
    let expected = "testbench/scenes/x.toml:16:9: method.words: \"plain_q22\" is there for the Premium 1.0 alone; \
                    write \"fitted\" or \"narrow\"";
    assert_eq!(message, expected);
}

#[test]
fn jitter_and_missed_deadlines_are_those_of_a_multitasking_system() {
    for key in ["jitter", "missed"] {
        let place = format!("7:{}: platform.{key}", key.len() + 4);
        says_with("platform", &format!("{key} = 0"), &format!("{place}: only PMOS-1 has it; leave it out"));
    }
    let pmos = |line: &str| format!("PMOS-1\"\n{line}");
    says(
        "FPGA-400\"",
        &pmos("jitter = \"1 ms\""),
        "8:10: platform.jitter: a sample may be late by at most 0.9 ms of its 1 ms",
    );
    says("FPGA-400\"", &pmos("missed = \"51 %\""), "8:10: platform.missed: at most half of the samples may be missed");
}

#[test]
fn walls_are_made_of_x_y_and_z_at_a_distance_above_zero() {
    says_with("room", "walls = \"yw\"", "11:9: room.walls: `yw` is not made of x, y, z");
    let message = "11:9: room.walls: `` is not the directions that have walls, as in \"y\" or \"xyz\"";
    says_with("room", "walls = \"\"", message);
    for (distance, said) in [("\"-2 cm\"", "-0.02"), ("0", "0")] {
        says_with(
            "room",
            &format!("distance = {distance}"),
            &format!(
                "11:12: room.distance: the walls of a pair stand at -distance and distance; {said} m turns the room \
                 inside out"
            ),
        );
    }
}

#[test]
fn a_wall_or_a_stiffness_that_does_not_fit_its_word_is_refused_with_the_greatest_that_does() {
    // (2^24 - 1) / 2^24 m and (2^18 - 1) / 4 N/m, exactly.
    let most = 1.0 - (-24f64).exp2();
    says_with(
        "room",
        "distance = \"2 m\"",
        &format!("11:12: room.distance: 2 m does not fit (1,0,24); write at most {most} m"),
    );
    says(
        "1 kN/m",
        "70 kN/m",
        "11:13: room.stiffness: 70000 N/m does not fit (0,16,2); write at most 65535.75 N/m, or other words",
    );
    let q22 = GOOD.replace("[run]", "[method]\nwords = \"plain_q22\"\n[run]");
    let message = parse(&q22).expect_err("refused");
    let start =
        "testbench/scenes/x.toml:11:13: room.stiffness: 1000 N/m does not fit (0,9,22); write at most 511.99999976";
    assert!(message.starts_with(start), "{message}");
}

#[test]
fn a_stiffness_that_rounds_to_zero_is_refused_and_zero_is_not() {
    says(
        "1 kN/m",
        "0.12 N/m",
        "11:13: room.stiffness: 0.12 N/m rounds to zero in (0,16,2); write 0 or at least 0.25 N/m",
    );
    assert!(parse(&GOOD.replace("1 kN/m", "0 N/m")).is_ok());
    assert!(parse(&GOOD.replace("1 kN/m", "0.13 N/m")).is_ok());
}

#[test]
fn walls_that_the_tip_cannot_come_to_are_refused_with_the_reason() {
    // The tip starts 0.14 m in front of and 0.14 m above the base. Lowered by d it is hypot(0.14, 0.14 + d) away from
    // the base, of 0.28 at most.
    says_with(
        "room",
        "distance = \"103 mm\"",
        "11:12: room.distance: the tip cannot come to the wall at y = -0.103 m: the links do not reach it; write less",
    );
    // Half of 13 bits is 4096 counts of 1/28000 turn, 52.66 degrees. The upper arm leans by 57.7 degrees there, see
    // below.
    says_with(
        "room",
        "distance = \"102 mm\"",
        "11:12: room.distance: the tip cannot come to the wall at y = -0.102 m: a joint is outside of the tables of \
         sines; write less, or more method.depth_bits",
    );
    assert!(parse(&GOOD.replace("[room]", "[room]\ndistance = \"8 cm\"")).is_ok());
}

#[test]
fn fewer_bits_of_the_tables_leave_a_smaller_room() {
    // Lowered by d: reach r = hypot(l, l + d), and the isosceles arm of two links l opens by 2 asin(r / 2 l) at the
    // elbow.
    let counts = |d: f64| {
        let l: f64 = 0.14;
        let r = l.hypot(l + d);
        let upper = (-(l + d)).atan2(l) + (r / (2.0 * l)).acos();
        let fore = upper + 2.0 * (r / (2.0 * l)).asin() - std::f64::consts::FRAC_PI_2;
        upper.abs().max(fore.abs()) / (2.0 * std::f64::consts::PI) * 28_000.0
    };
    for bits in 9..=13 {
        let half = f64::from(1 << (bits - 1));
        for mm in (1..100).step_by(3) {
            let d = f64::from(mm) * 1e-3;
            let (down, up) = (counts(d), counts(-d));
            let fits = down.max(up) < half;
            let text = GOOD.replace("[room]", &format!("[room]\ndistance = \"{mm} mm\""));
            let parsed = parse(&format!("{text}[method]\ndepth_bits = {bits}\n"));
            assert_eq!(parsed.is_ok(), fits, "{bits} bits, {mm} mm: {down} and {up} counts");
        }
    }
    says_with("method", "depth_bits = 16", "15:14: method.depth_bits: `16` is not a whole number from 4 to 15");
    says_with("method", "depth_bits = 3", "15:14: method.depth_bits: `3` is not a whole number from 4 to 15");
}

#[test]
fn a_wall_where_the_arm_is_singular_or_beyond_its_limits_is_refused() {
    let text = GOOD.replace("axis = \"y\"", "axis = \"z\"").replace("[run]", "[method]\ndepth_bits = 15\n[run]");
    let refused = |distance: &str| {
        let text = text.replace("[room]", &format!("[room]\ndistance = \"{distance}\""));
        parse(&text).expect_err(distance)
    };
    // The origin is 0.14 m in front of the arm's own axis, and 0.14 m above its base.
    let on_the_axis = refused("14 cm");
    assert!(on_the_axis.contains("z = -0.14 m: the arm is singular there; write less"), "{on_the_axis}");
    // So the stretched arm reaches forwards by sqrt(0.28^2 - 0.14^2) - 0.14 = 0.1024871 m.
    let beyond = refused("103 mm");
    assert!(beyond.contains("z = 0.103 m: the links do not reach it; write less"), "{beyond}");
    let stretched = refused("102.487 mm");
    assert!(stretched.contains("z = 0.102487 m: the arm is singular there; write less"), "{stretched}");
    // A Premium 1.5 may close its elbow by 55 degrees.
    let text = text.replace("kind = \"phantom\"", "kind = \"phantom\"\nmodel = \"premium_1.5\"");
    let text = text.replace("[room]", "[room]\ndistance = \"16 cm\"");
    let limited = parse(&text).expect_err("beyond its limits");
    assert!(limited.contains("a joint is beyond its limits; write less"), "{limited}");
}

#[test]
fn a_clock_too_slow_for_the_design_is_refused_with_the_rate_it_allows() {
    // 9 edges from a sample to its command and the next sample; 40 with the shared multiplier.
    says(
        "50 MHz",
        "3 MHz",
        "9:13: clock.frequency: FPGA-400 samples every 8 clocks, but this design takes 9; the clock allows 333333 Hz",
    );
    assert!(parse(&GOOD.replace("50 MHz", "3.6 MHz")).is_ok());
    let shared = GOOD.replace("[run]", "[method]\narchitecture = \"shared\"\n[run]");
    let message = parse(&shared.replace("50 MHz", "15.6 MHz")).expect_err("39 clocks");
    assert!(
        message.contains("samples every 39 clocks, but this design takes 40; the clock allows 390000 Hz"),
        "{message}"
    );
    assert!(parse(&shared.replace("50 MHz", "16 MHz")).is_ok());
    says(
        "kind = \"FPGA-400\"\n[clock]\nfrequency = \"50 MHz\"",
        "kind = \"RTOS-20\"\n[clock]\nfrequency = \"20 kHz\"",
        "9:13: clock.frequency: RTOS-20 needs a clock of 40000 Hz or more",
    );
}

#[test]
fn a_transmission_is_flexible_before_it_has_damping_and_shares() {
    for key in ["transmission_damping", "motor_share"] {
        says_with(
            "model",
            &format!("{key} = 0.1"),
            &format!(
                "15:{}: model.{key}: a rigid transmission has none; write transmission_stiffness too",
                key.len() + 4
            ),
        );
    }
    let flexible = |share: &str| format!("transmission_stiffness = 3500\nmotor_share = {share}");
    says_with("model", &flexible("1"), "16:15: model.motor_share: below 1: the arm has some of the mass");
    says_with("model", &flexible("0"), "16:15: model.motor_share: `0` must be above zero");
}

#[test]
fn delays_are_bounded() {
    says_with("model", "delay = 4.1", "15:9: model.delay: at most 4 samples");
    says_with("model", "latency = \"101 ms\"", "15:11: model.latency: at most 100 ms");
}
