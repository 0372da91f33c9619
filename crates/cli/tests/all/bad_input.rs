//! Bad input: the messages, the exit codes, and the files left on disk.

use std::fs;
use std::os::unix::fs::PermissionsExt;

use crate::common::{ROOT, assert_refused, code, hpu, names, run, scratch, stderr, stdout, text};

/// Runs a scene with an output folder and asserts that it is refused and leaves nothing behind.
fn assert_scene_refused(test: &str, scene: &str, arguments: &[&str], words: &[&str]) {
    let dir = scratch(test);
    let file = dir.join("bad.toml");
    fs::write(&file, scene).expect("a scene");
    let out = dir.join("out");
    let arguments = [&["run", text(&file), "-o", text(&out)][..], arguments].concat();
    assert_refused(&run(&arguments), 4, words);
    assert_eq!(names(&dir), ["bad.toml"], "nothing is written");
}

/// Returns the shipped hybrid wall with one line replaced.
fn wall_with(line: &str, other: &str) -> String {
    let scene = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a shipped scene");
    assert!(scene.contains(line), "{scene}");
    scene.replacen(line, other, 1)
}

#[test]
fn malformed_toml_is_refused_with_line_and_column() {
    let scene = "about = \"A wall.\"\n[device\nkind = \"motor\"\n";
    assert_scene_refused("malformed", scene, &[], &["bad.toml:2:", "not TOML"]);
}

#[test]
fn an_unknown_key_is_refused_with_those_there_are() {
    let scene = wall_with("stiffness = \"1.5 N.m/rad\"", "stifness = \"1.5 N.m/rad\"");
    assert_scene_refused("unknown-key", &scene, &[], &["bad.toml:", "wall.stifness", "stiffness, damping"]);
}

#[test]
fn a_wrong_unit_is_refused_with_those_accepted() {
    let scene = wall_with("stiffness = \"1.5 N.m/rad\"", "stiffness = \"1.5 mm\"");
    assert_scene_refused("wrong-unit", &scene, &[], &["bad.toml:", "wall.stiffness", "N.m/rad"]);
}

#[test]
fn a_wrong_sign_is_refused() {
    let scene = wall_with("stiffness = \"1.5 N.m/rad\"", "stiffness = \"-1.5 N.m/rad\"");
    assert_scene_refused("wrong-sign", &scene, &[], &["bad.toml:", "wall.stiffness", "-1.5"]);
}

#[test]
fn a_format_wider_than_64_bits_is_refused() {
    let scene = wall_with("damping_format = \"(0,8,4)\"", "damping_format = \"(0,40,25)\"");
    assert_scene_refused("wide-format", &scene, &[], &["bad.toml:", "method.damping_format", "65", "64"]);
}

#[test]
fn a_clock_of_zero_is_refused() {
    let scene = wall_with("frequency = \"50 MHz\"", "frequency = 0");
    assert_scene_refused("zero-clock", &scene, &[], &["bad.toml:", "clock.frequency"]);
}

#[test]
fn nan_is_refused_in_a_scene_and_in_an_override() {
    let scene = wall_with("position = \"1.5 rad\"", "position = nan");
    assert_scene_refused("nan", &scene, &[], &["bad.toml:", "wall.position", "`nan`"]);
    let scene = wall_with("", "");
    let words = ["--set wall.position=nan", "wall.position"];
    assert_scene_refused("nan-set", &scene, &["--set", "wall.position=nan"], &words);
}

#[test]
fn a_missing_scene_and_a_missing_data_file_are_told_by_name() {
    assert_refused(&run(&["run", "no/such.toml"]), 4, &["no/such.toml", "No such file"]);
    assert_refused(&run(&["run", "no-such-scene"]), 4, &["no-such-scene", "hybrid-wall"]);
    let set = ["run", "replay-motion", "--set", "hand.file=nowhere.csv"];
    assert_refused(&run(&set), 4, &["hand.file", "nowhere.csv"]);
}

#[test]
fn an_override_without_a_value_is_wrong_usage() {
    assert_refused(&run(&["run", "hybrid-wall", "--set", "wall.stiffness"]), 2, &["KEY=VALUE"]);
}

#[test]
fn a_capture_without_the_named_channels_is_refused_with_those_it_has() {
    let output = run(&["run", "replay-capture", "--set", "hand.channel_a=D7"]);
    assert_refused(&output, 4, &["replay-capture.vcd", "D7", "libsigrok.A", "libsigrok.B"]);
}

#[test]
fn time_running_backwards_in_a_capture_is_refused_with_its_line() {
    let dir = scratch("backwards");
    let file = dir.join("back.vcd");
    let head = "$timescale 1 us $end\n$scope module libsigrok $end\n$var wire 1 ! A $end\n$var wire 1 \" B $end\n";
    fs::write(&file, format!("{head}$upscope $end\n$enddefinitions $end\n#0 0! 0\"\n#20 1!\n#10 1\"\n"))
        .expect("a capture");
    let set = format!("hand.file={}", text(&file));
    assert_refused(&run(&["run", "replay-capture", "--set", &set]), 4, &["back.vcd:9", "backwards", "#20", "#10"]);
}

#[test]
fn a_vector_file_with_a_stale_first_line_is_refused_with_the_line_expected() {
    let dir = scratch("stale");
    let file = dir.join("stale.txt");
    fs::write(
        &file,
        "# position_counter in rst(0,1,0) step(1,1,0) out position(0,11,0) generics WIDTH=12\n# end 0 rows\n",
    )
    .expect("vectors");
    let output = run(&["vectors", "--verify", text(&file)]);
    assert_refused(&output, 4, &["stale.txt:1: ", "position(0,12,0)", "position(0,11,0)"]);
}

#[test]
fn a_truncated_vector_file_is_refused_wherever_it_is_cut() {
    let whole = "# position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12\n\
                 1 0 000\n0 3 fff\n0 1 000\n# end 3 rows\n";
    let dir = scratch("truncated");
    let file = dir.join("cut.txt");
    fs::write(&file, whole).expect("vectors");
    assert_eq!(code(&run(&["vectors", "--verify", text(&file)])), 0);
    // Without the last line feed the file is still whole.
    for end in 0..whole.len() - 1 {
        fs::write(&file, &whole[..end]).expect("vectors");
        assert_refused(&run(&["vectors", "--verify", text(&file)]), 4, &["cut.txt:"]);
    }
}

#[test]
fn absurd_quantities_are_refused_at_once_with_what_is_accepted() {
    for (scene, key, value, accepted) in [
        ("free-motion", "device.initial_speed", "1e20 rad/s", "accepted: -100000 to 100000 rad/s"),
        ("phantom-flexible", "model.transmission_stiffness", "1e14 N/m", "accepted: 0, or "),
        ("rail-drop", "hand.torque", "1e31 N", "accepted: "),
        ("rail-drop", "device.damping", "1.5e200", "accepted: 0, or "),
        ("rail-drop", "device.mass", "2.2e-308 g", "accepted: "),
    ] {
        let set = format!("{key}={value}");
        assert_refused(&run(&["run", scene, "--set", &set]), 4, &[&format!("--set {set}: {key}: "), accepted]);
    }
    let dir = scratch("far");
    let file = dir.join("far.csv");
    fs::write(&file, "time_s,angle_rad\n0,0\n1,1e30\n").expect("a motion");
    let set = format!("hand.file={}", text(&file));
    assert_refused(
        &run(&["run", "replay-motion", "--set", &set]),
        4,
        &["far.csv:3: 1e30; accepted: -1000000 to 1000000"],
    );
}

#[test]
fn a_motion_beyond_all_counts_ends_the_run_and_is_told() {
    let mut arguments = vec!["run", "rail-drop"];
    for change in [
        "hand.torque=1 MN",
        "device.mass=1 mg",
        "device.damping=0",
        "encoder.resolution=1e-11",
        "wall.stiffness=0",
        "wall.damping=0",
        "wall.wraps=true",
    ] {
        arguments.extend(["--set", change]);
    }
    let output = run(&arguments);
    assert_eq!(code(&output), 0, "the scene's expectations are not judged: {}", stderr(&output));
    assert!(stdout(&output).contains("2^52 counts") && !stdout(&output).contains("NaN"), "{}", stdout(&output));
}

#[test]
fn what_is_no_ordinary_file_or_has_no_end_is_refused() {
    let dir = scratch("endless");
    for file in ["/dev/zero", "/dev/null", text(&dir)] {
        let set = format!("hand.file={file}");
        assert_refused(&run(&["run", "replay-motion", "--set", &set]), 4, &["hand.file", "not an ordinary file"]);
    }
    for arguments in
        [&["run", "/dev/zero"][..], &["vectors", "--verify", "/dev/zero"], &["block", "pwm", "--inputs", "/dev/zero"]]
    {
        assert_refused(&run(arguments), 4, &["/dev/zero: larger than 256 MiB"]);
    }
}

#[test]
fn text_that_is_not_utf_8_is_refused_with_its_line() {
    let dir = scratch("bytes");
    let write = |name: &str, text: &[u8]| {
        let file = dir.join(name);
        fs::write(&file, text).expect("a file");
        file
    };
    let scene = write("scene.toml", b"about = \"x\"\n[device]\nkind = \"\xff\"\n");
    assert_refused(&run(&["run", text(&scene)]), 4, &["scene.toml:3: not text in UTF-8"]);
    let motion = format!("hand.file={}", text(&write("motion.csv", b"time_s,angle_rad\n0,0\n1,\xe9\n")));
    // A table may be Latin-1, as Windows writes it.
    let told = "motion.csv:3: `\u{e9}` is not a finite number";
    assert_refused(&run(&["run", "replay-motion", "--set", &motion]), 4, &[told]);
    // A simulator writes its user's name and path as they are; bytes that are no text count where a level is expected.
    let shipped = fs::read(format!("{ROOT}/testbench/scenes/replay-capture.vcd")).expect("a capture");
    let capture = |bytes: &[u8]| {
        let file = write("capture.vcd", bytes);
        run(&["run", "replay-capture", "--set", &format!("hand.file={}", text(&file))])
    };
    let named = capture(&[b"$comment caf\xe9 $end\n", &shipped[..]].concat());
    assert_eq!(code(&named), 0, "{}", stderr(&named));
    let lines = 1 + shipped.iter().filter(|&&byte| byte == b'\n').count();
    let said = format!("capture.vcd:{lines}: not VCD: `\u{ff}!` is no change of a value");
    assert_refused(&capture(&[&shipped[..], b"\xff!\n"].concat()), 4, &[&said]);
    let vectors = write("vectors.txt", b"# pwm\n\xff\n");
    assert_refused(&run(&["vectors", "--verify", text(&vectors)]), 4, &["vectors.txt:2: not text in UTF-8"]);
    let inputs = write("inputs.csv", b"step\n1\n\n\xc3\n");
    let block = ["block", "position_counter", "--inputs", text(&inputs)];
    assert_refused(&run(&block), 4, &["inputs.csv:4: not text in UTF-8"]);
}

#[test]
fn a_scene_of_the_linear_law_is_a_bad_file_and_a_wrong_override_is_wrong_usage() {
    let scene = wall_with("[run]", "[model]\ndatapath = \"linear\"\n\n[run]");
    assert_scene_refused("linear", &scene, &[], &["bad.toml:33:12: model.datapath: ", "hpu limits"]);
    let linear = ["run", "hybrid-wall", "--set", "model.datapath=linear"];
    assert_refused(&run(&linear), 2, &["--set model.datapath=linear: model.datapath: ", "hpu limits"]);
}

#[test]
fn help_that_does_not_fit_on_a_full_disk_is_a_failed_write() {
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"], &["help", "map"], &["scenes"]] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a device that is full");
        let output = hpu().args(arguments).stdout(full).output().expect("starts");
        assert_refused(&output, 4, &["standard output: "]);
    }
    assert!(stdout(&run(&["--help"])).contains("Usage: hpu"));
}

#[test]
fn messages_write_short_numbers_that_are_not_zero() {
    let refused = |arguments: &[&str], expected: i32, words: &[&str]| {
        let output = run(arguments);
        assert_refused(&output, expected, words);
        assert!(!stderr(&output).contains("0.000000"), "{}", stderr(&output));
        assert!(!stderr(&output).contains(&"0".repeat(70)), "{}", stderr(&output));
    };
    let map = ["map", "hybrid-wall", "--y", "wall.position=1..2", "--x"];
    refused(&[&map[..], &["wall.stiffness=1e300..1"]].concat(), 2, &["1e300 to 1 is reversed"]);
    let long = format!("wall.stiffness={}..1", "9".repeat(400));
    refused(&[&map[..], &[&long]].concat(), 2, &["wall.stiffness"]);
    let gain = [
        "run",
        "rail-drop",
        "--set",
        "amplifier.full_scale=1e-6",
        "--set",
        "encoder.resolution=1",
        "--set",
        "wall.stiffness=1",
    ];
    refused(&gain, 4, &["does not fit", "write at most "]);
    let rate = ["run", "hybrid-wall", "--set", "method.period_bits=30", "--set", "method.sample_rate=1e-5"];
    refused(&rate, 4, &["1e-5 Hz takes 5000000000000 clocks"]);
    refused(&["vectors", "pwm", "--count", "10000001"], 2, &["10000000"]);
    let word = format!("wall.stiffness={}", "0".repeat(300) + "x");
    refused(&["run", "hybrid-wall", "--set", &word], 4, &["..."]);
}

#[test]
fn without_ghdl_the_package_is_named() {
    let dir = scratch("no-ghdl");
    let junit = dir.join("report.xml");
    let output = hpu().args(["check", "displacement", "-x", text(&junit)]).env("PATH", &dir).output().expect("starts");
    assert_eq!(code(&output), 3);
    assert!(stderr(&output).starts_with("error: ") && stderr(&output).contains("ghdl-mcode"), "{}", stderr(&output));
    assert_eq!(names(&dir), [""; 0], "no report of a check that was none");
    let output = hpu().args(["run", "hybrid-wall", "--driver", "rtl", "--edges", "10"]).env("PATH", &dir).output();
    assert_refused(&output.expect("starts"), 3, &["ghdl-mcode"]);
}

#[test]
fn a_ghdl_that_fails_at_everything_is_told_with_what_it_said() {
    let dir = scratch("bad-ghdl");
    let ghdl = dir.join("ghdl");
    fs::write(&ghdl, "#!/bin/sh\necho 'ghdl: out of licences' >&2\nexit 1\n").expect("a script");
    fs::set_permissions(&ghdl, fs::Permissions::from_mode(0o755)).expect("it may run");
    let junit = dir.join("report.xml");
    let output = hpu().args(["check", "displacement", "-x", text(&junit)]).env("PATH", &dir).output().expect("starts");
    assert_refused(&output, 4, &["ghdl ended with code 1 when asked to tell its version", "out of licences"]);
    assert!(!junit.exists(), "no report of a check that was none");
}

#[test]
fn an_output_folder_that_cannot_be_written_is_wrong_usage() {
    let dir = scratch("unwritable");
    let file = dir.join("file");
    fs::write(&file, "old").expect("a file");
    let below = file.join("out");
    for arguments in [&["run", "free-motion"][..], &["vectors", "pwm"], &["check", "pwm"]] {
        let arguments = [arguments, &["-o", text(&below)]].concat();
        assert_refused(&run(&arguments), 2, &["cannot write to", text(&below)]);
    }
    assert_refused(&run(&["check", "pwm", "-x", text(&below.join("x.xml"))]), 2, &["cannot write to", text(&below)]);
    assert_refused(&run(&["run", "free-motion", "-o", "/proc/hpu"]), 2, &["cannot write to /proc/hpu"]);
    assert_eq!(fs::read_to_string(&file).expect("still there"), "old");
}

#[test]
fn wrong_usage_is_told_on_stderr() {
    assert_refused(&run(&["fly"]), 2, &["fly"]);
    assert_refused(&run(&["block", "flux_capacitor"]), 2, &["flux_capacitor", "position_counter"]);
    assert_refused(&run(&["block", "pwm", "--variant", "9_bit"]), 2, &["9_bit", "8_bit"]);
    let linear = ["run", "hybrid-wall", "--set", "model.datapath=linear"];
    assert_refused(&run(&linear), 2, &["linear", "hpu limits"]);
    assert_refused(&run(&["vectors"]), 2, &["sets", "-o"]);
}

#[test]
fn a_range_of_stiffnesses_that_holds_nothing_is_refused_with_what_is_accepted() {
    for (range, code, words) in [
        ("2..1", 2, &["2 to 1 holds nothing", "A below B"][..]),
        ("1..1", 2, &["1 to 1 holds nothing"]),
        ("1", 2, &["write A..B"]),
        ("0..1", 2, &["a stiffness of 0 has no wall"]),
        ("1..1e3 N.m/rad", 4, &["wall.stiffness", "does not fit (0,12,0)", "172.7109 N.m/rad"]),
        ("1 kg..2", 4, &["wall.stiffness"]),
    ] {
        assert_refused(&run(&["limits", "hybrid-wall", "--range", range]), code, words);
    }
}

#[test]
fn a_box_that_is_none_is_refused_with_what_is_accepted() {
    for (over, words) in [
        ("device.inductance=2..1", &["2 to 1 is reversed"][..]),
        ("device.inductance=1..1", &["1 to 1 is empty"]),
        ("device.inductance", &["write KEY=A..B", "mH"]),
        ("device.inductance=1..2:5", &["write KEY=A..B"]),
        ("device.inductance=0..1", &["device.inductance", "must be above zero"]),
        ("device.resistance=1..1e9", &["device.resistance", "accepted: 1e-6 to 1000000 Ohm"]),
        ("encoder.lines=500..1000", &["the words change with it"]),
        ("wall.stiffness=1..2", &["is the wall's", "device, hand and supply"]),
        ("foo=1..2", &["unknown key", "device"]),
    ] {
        assert_refused(&run(&["limits", "hybrid-wall", "--over", over]), 2, words);
    }
    let twice = ["limits", "hybrid-wall", "--over", "hand.stiffness=1..2", "--hands", "50mm"];
    assert_refused(&run(&twice), 2, &["hand.stiffness is given twice"]);
    let set = ["limits", "hybrid-wall", "--over", "hand.stiffness=1..2", "--set", "hand.stiffness=1"];
    assert_refused(&run(&set), 2, &["hand.stiffness is set too"]);
    assert_refused(&run(&["limits", "hybrid-wall", "--hands"]), 2, &["--hands 50mm"]);
    assert_refused(&run(&["limits", "hybrid-wall", "--hands", "5furlong"]), 2, &["write a radius", "50mm"]);
    assert_refused(&run(&["limits", "rail-drop", "--hands"]), 2, &["spring_damper"]);
}
