//! `hpu certify`: certificates of walls and of runs; changed ones are rejected, other files are none.

use std::fs;
use std::path::Path;

use crate::common::{assert_refused, code, json as as_json, run, scratch, stdout};

/// Writes the certificate of a run, and returns its text.
fn of_run(arguments: &[&str], dir: &Path) -> String {
    let folder = dir.display().to_string();
    let out = run(&[&["run"], arguments, &["--certificates", &folder]].concat());
    assert_eq!(code(&out), 0, "{}", stdout(&out));
    fs::read_to_string(dir.join("run.certificate")).expect("a certificate")
}

#[test]
fn a_run_is_certified_by_running_it_again() {
    let dir = scratch("certify-run");
    let file = dir.join("changed").display().to_string();
    for (arguments, kind) in [
        (&["bounded-wall", "--for-ever=2s"][..], "quiet"),
        (&["hybrid-wall", "--for-ever=2s", "--set", "wall.stiffness=2"], "repeats"),
        (&["hybrid-wall", "--for-ever=1s", "--set", "wall.stiffness=1", "--set", "wall.damping=0"], "in_contact"),
    ] {
        let certificate = of_run(arguments, &dir.join(kind));
        let good = dir.join(kind).join("run.certificate").display().to_string();
        let found = as_json(&run(&["certify", &good, "--json"]));
        let told = as_json(&run(&[&["run"], arguments, &["--json"]].concat()));
        assert_eq!(told["for_ever"]["kind"], kind);
        assert_eq!((&found["accepted"], &found["found"]), (&true.into(), &told["for_ever"]));
        // Another claim of the run, and another run.
        let from = told["for_ever"]["from_s"].to_string();
        let other = format!("{}1", &from[..from.len() - 1]);
        for (old, new) in
            [(from.as_str(), other.as_str()), (kind, "stuck"), ("[hand]", "[hand]\ndamping = \"0.11 mN.m.s/rad\"")]
        {
            let changed = certificate.replacen(old, new, 1);
            assert!(changed != certificate, "{old} is not in it");
            // A key that stands twice is an error of the scene.
            let changed = if old == "[hand]" { without_damping(&changed) } else { changed };
            fs::write(&file, changed).expect("a file");
            let out = run(&["certify", &file]);
            assert_eq!(code(&out), 1, "{old}: {}", stdout(&out));
            assert!(stdout(&out).contains("rejected"), "{}", stdout(&out));
        }
        for (old, new) in [("looked_on_s = ", "looked_on_s = -"), ("found = ", "lost = "), ("kind = ", "kin = ")] {
            fs::write(&file, certificate.replacen(old, new, 1)).expect("a file");
            assert_refused(&run(&["certify", &file]), 4, &[&file]);
        }
    }
}

#[test]
fn a_wall_in_contact_is_told_a_window_and_nothing_of_later_ones() {
    let arguments = ["run", "hybrid-wall", "--for-ever=1s", "--set", "wall.damping=0", "--set"];
    for (stiffness, is_settled) in [("wall.stiffness=1", true), ("wall.stiffness=1.8", false)] {
        let told = as_json(&run(&[&arguments[..], &[stiffness, "--json"]].concat()));
        let told = &told["for_ever"];
        let number = |key: &str| told[key].as_f64().unwrap_or_else(|| panic!("{key} in {told}"));
        assert_eq!((&told["kind"], number("window_s")), (&"in_contact".into(), 0.6));
        assert_eq!(number("rms_counts") < 1.0, is_settled, "{told}");
        assert!(number("rms_counts") > number("long_run_counts") && number("from_s") >= 3.0, "{told}");
        let page = stdout(&run(&[&arguments[..], &[stiffness]].concat()));
        let line = page.lines().find(|line| line.starts_with("for ever")).expect("a line");
        assert!(line.contains("counts over the next 600 ms") && line.contains("keeps contact for ever"), "{line}");
        assert_eq!(line.contains("for that time alone"), is_settled, "{line}");
        assert!(!line.contains("settled for ever"), "{line}");
    }
}

/// A plant that leaves: the eighth loop of DSVerifier's set that no word can hold.
const LEAVES: &str = "about = 'A plant that leaves.'
clock.frequency = '1 MHz'
run.duration = 100
[device]
kind = 'transfer'
numerator = [0, 15.1315, 17.86, 17.4549]
denominator = [1, -2.6207, 2.3586, -0.657]
sample_time = 2
disturbance = 1
[adc]
bits = 8
range = 8
rate = 0.5
[dac]
bits = 8
full_scale = 8
[method]
numerator = [0, -0.00097656, 0, 0]
denominator = [0.76172, 0, 0, 0]
coefficient_bits = 8
coefficient_fraction = 4
";

#[test]
fn growth_is_checked_apart_as_well() {
    let dir = scratch("certify-growth");
    let scene = dir.join("leaves.toml").display().to_string();
    fs::write(&scene, LEAVES).expect("a file");
    let certificate = of_run(&[&scene, "--for-ever=100s"], &dir);
    assert!(certificate.contains("grows"), "{certificate}");
    let file = dir.join("run.certificate").display().to_string();
    let out = run(&["certify", &file]);
    assert_eq!(code(&out), 0, "{}", stdout(&out));
    assert!(stdout(&out).contains("a checker of its own"), "{}", stdout(&out));
    assert_eq!(as_json(&run(&["certify", &file, "--json"]))["apart"], "accepted");
    fs::write(&file, certificate.replace("-2.6207", "-2.6")).expect("a file");
    assert_eq!(code(&run(&["certify", &file])), 1);
}

/// Removes the second damping of a hand, that of the scene as it is shipped.
fn without_damping(certificate: &str) -> String {
    let (before, hand) = certificate.split_once("[hand]").expect("a hand");
    let mut seen = 0;
    let lines = hand.lines().filter(|line| {
        seen += usize::from(line.starts_with("damping"));
        !(line.starts_with("damping") && seen == 2)
    });
    format!("{before}[hand]{}\n", lines.collect::<Vec<_>>().join("\n"))
}

#[test]
fn what_no_certificate_carries_is_refused_before_the_run() {
    let dir = scratch("certify-refused").display().to_string();
    for scene in ["testbench/dut/knee.toml", "replay-motion"] {
        assert_refused(&run(&["run", scene, "--for-ever", "--certificates", &dir]), 2, &["carries no file"]);
    }
    assert_refused(&run(&["run", "free-motion", "--certificates", &dir]), 2, &["--for-ever"]);
    assert!(!Path::new(&dir).join("run.certificate").exists());
}

#[test]
fn a_wall_is_certified_and_another_file_is_no_certificate() {
    let dir = scratch("certify-wall");
    let good = fs::read_to_string("../../testbench/hybrid-wall.certificate").expect("a certificate");
    let file = dir.join("file").display().to_string();
    let with = |text: &str| {
        fs::write(&file, text).expect("a file");
        run(&["certify", &file])
    };
    assert_eq!(code(&with(&good)), 0);
    let rejected = with(&good.replacen("level = ", "level = 0.9e-9 # ", 1));
    assert_eq!(code(&rejected), 1, "{}", stdout(&rejected));
    for other in ["", "[", "claim = 3", "\0", &good.replacen("storage", "store", 1), &good.replacen("claim", "say", 1)]
    {
        fs::write(&file, other).expect("a file");
        assert_refused(&run(&["certify", &file]), 4, &[&file]);
    }
}

#[test]
fn a_wall_over_a_range_is_certified_with_its_range_and_other_ranges_are_refused() {
    let dir = scratch("certify-range");
    let folder = dir.join("out").display().to_string();
    let asked = ["limits", "hybrid-wall", "--for-ever", "--range", "0.6..0.61", "--words", "2", "--phases", "1"];
    let over = ["--over", "hand.stiffness=0.297..0.303 N.m/rad"];
    let told = as_json(&run(&[&asked[..], &over, &["--certificates", &folder, "--json"]].concat()));
    let words = told["for_ever"]["words"].as_array().expect("words");
    assert!(!words.is_empty() && words.iter().all(|word| word["parts"].as_u64() >= Some(1)), "{told}");
    assert_eq!(told["for_ever"]["over"][0]["key"], "hand.stiffness");
    let file = format!("{folder}/limits.certificate");
    let accepted = run(&["certify", &file]);
    assert_eq!(code(&accepted), 0);
    assert!(stdout(&accepted).contains("for every hand.stiffness from 0.297 N.m/rad to 0.303 N.m/rad"));
    let good = fs::read_to_string(&file).expect("a certificate");
    for (old, new) in [("0.303 N.m/rad", "0.32 N.m/rad"), ("\"hand.stiffness\"", "\"bridge.supply\"")] {
        fs::write(&file, good.replacen(old, new, 1)).expect("a file");
        assert_ne!(code(&run(&["certify", &file])), 0, "{old} became {new}");
    }
    let box_of = |keys: &[&str]| {
        let over = keys.iter().flat_map(|key| ["--over", *key]);
        run(&asked.into_iter().chain(over).collect::<Vec<_>>())
    };
    let [hand, ohm, henry] = ["hand.stiffness=0.29..0.3", "device.resistance=2.3..2.4", "device.inductance=2e-4..3e-4"];
    assert_refused(&box_of(&[hand, ohm, henry]), 2, &["two ranges"]);
    assert_refused(&box_of(&["device.wheel_ratio=6..8"]), 2, &["device.wheel_ratio", "hand.damping"]);
    assert_refused(&run(&[&asked[..], &["--hands", "50mm"]].concat()), 2, &["--hands"]);
}
