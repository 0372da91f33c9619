//! All errors of a scene at once.

use hpu_scene::{Experiment, SceneError};

use super::GOOD;

fn refused(text: &str, set: &[(&str, &str)]) -> SceneError {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    Experiment::parse("x.toml", text, &set, &mut super::files).expect_err(text)
}

/// The good scene with its motor named and more of it replaced.
fn with(replaced: &[(&str, &str)]) -> String {
    let mut text = GOOD.replace("kind = \"motor\"", "kind = \"motor\"\nmotor = \"vasudevan_2007\"");
    for (from, to) in replaced {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    text
}

#[test]
fn every_error_is_told_with_its_place_and_their_number_comes_last() {
    let error = refused(
        &with(&[
            ("50 MHz", "50 MHzz"),
            ("sample_rate = \"1 kHz\"", "sample_rate = 0\npositoin_bits = 12\npwm = { bits = 40, mode = \"none\" }"),
            ("position = \"1.5 rad\"", "position = true"),
            ("duration = \"1 s\"", ""),
        ]),
        &[],
    );
    let kinds = "kind, sample_rate, position_bits, stiffness_format, damping_format, period_bits, pwm, velocity_bits, \
                 product, settling, rescaled, reference_rate, scale_format";
    let lines = [
        "x.toml:6:13: clock.frequency: `50 MHzz` is not a frequency: write Hz, MHz or a number in Hz".to_string(),
        "x.toml:9:15: method.sample_rate: `0` must be above zero".to_string(),
        format!(
            "x.toml:10:1: method.positoin_bits: unknown key for kind \"hybrid\"; accepted here: {kinds}; did you mean \
             position_bits?"
        ),
        "x.toml:11:16: method.pwm.bits: `40` is not a whole number from 2 to 24".to_string(),
        "x.toml:11:27: method.pwm.mode: `none` is none of \"sign_magnitude\", \"locked_antiphase\"".to_string(),
        "x.toml:13:12: wall.position: `true` is not an angle: write rad, mrad, deg, rev or a number in rad".to_string(),
        "x.toml:17:1: run.duration: missing; write a time as s, ms, min or a number in s".to_string(),
        "7 errors".to_string(),
    ];
    assert_eq!(format!("{error:#}"), lines.join("\n"));
    assert_eq!(error.to_string(), lines[0], "the first alone stays a line");
}

#[test]
fn one_error_is_told_as_ever_and_what_follows_from_it_is_not() {
    for (replaced, told) in [
        // The misspelt key is the one that is missing.
        (("stiffness =", "stifness ="), "wall.stifness: unknown key"),
        (("[wall]", "[wal]"), "wal: unknown key"),
        // A kind that is none has no keys.
        (("\"hybrid\"", "\"hybird\""), "method.kind: `hybird`"),
        (("kind = \"none\"", "kind = \"nobody\"\ntorque = 1"), "hand.kind: `nobody`"),
        (("kind = \"motor\"", "kind = \"moter\""), "device.kind: `moter`"),
        // Sections that do not agree are a matter of their values, after all sections.
        (("\"1.5 N.m/rad\"", "\"200 N.m/rad\""), "wall.stiffness: 200 N.m/rad does not fit"),
    ] {
        let error = refused(&with(&[replaced]), &[]);
        assert!(error.to_string().contains(told), "{error}");
        assert_eq!(format!("{error:#}"), error.to_string());
    }
}

#[test]
fn overrides_of_which_none_is_good_are_all_told() {
    let error = refused(&with(&[]), &[("wall.stiffness", "-1"), ("method.pwm.bits", "1"), ("hand.kind", "nobody")]);
    let all = format!("{error:#}");
    for told in ["--set hand.kind=nobody: ", "--set wall.stiffness=-1: ", "--set method.pwm.bits=1: ", "\n3 errors"] {
        assert!(all.contains(told), "{all}");
    }
    let phantom = "about = 'A.'\n[device]\nkind = 'phantom'\nforearm = 3\n[drop]\nspeed = 'fast'\n[platform]\n\
                   kind = 'FPGA-4'\n[clock]\nfrequency = 0\n[room]\nstiffness = 1000\n[run]\nduration = 1\n";
    let all = format!("{:#}", refused(phantom, &[]));
    let keys = ["clock.frequency", "device.forearm", "drop.axis", "drop.speed", "platform.kind"];
    assert!(keys.iter().all(|key| all.contains(&format!(": {key}: "))) && all.ends_with("\n5 errors"), "{all}");
}
