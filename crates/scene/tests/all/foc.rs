//! Scenes behind field-oriented control: their words by hand, and what is refused at which key.

use std::f64::consts::TAU;

use hpu_scene::{Experiment, FocScene, SceneFile, Setup};

fn read(name: &str, sets: &[(&str, &str)]) -> Result<FocScene, String> {
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    let found = SceneFile::find(name).unwrap().parse(&sets).map_err(|error| error.to_string())?;
    let Experiment::Foc(scene) = found else { panic!("a scene of a pmsm with a method") };
    Ok(scene)
}

#[test]
fn words_are_the_nearest_to_their_equations() {
    // A code is 3.3 V / 2^12 / 0.1 V/A; the words count eighths of it. The supply is 12 V over 2^14.
    let (unit_a, unit_v) = (3.3 / 4096.0 / 0.1 / 8.0, 12.0 / 16384.0);
    let wall = read("foc-wall", &[]).unwrap();
    let words = wall.words().unwrap();
    let (count_rad, unit_nm) = (TAU / 16384.0, 0.05 * unit_a);
    assert!((words.count_rad / count_rad - 1.0).abs() < 1e-12 && (words.unit[0] / unit_a - 1.0).abs() < 1e-12);
    let stiffness = 0.67 * count_rad / unit_nm * 256.0;
    let damping = 2e-3 * count_rad / unit_nm / 50e-6 * 16.0;
    assert_eq!(words.gains, [stiffness.round() as i64, damping.round() as i64]);
    let of_current = |ohm: f64| (TAU * 1000.0 * ohm * unit_a / unit_v * 65536.0).round() as i64;
    assert_eq!(words.current_gains, [of_current(0.3e-3), of_current(0.5 * 50e-6)]);
    assert_eq!((words.reference, words.period, words.zero), ((0.3 / count_rad).round() as i64, 2500, 0));
    let foc = words.config.foc;
    assert_eq!((foc.counts, foc.position_width, foc.steps, foc.dead_time, foc.min_pulse), (16384, 14, 1250, 25, 20));
    assert_eq!((foc.pole_pairs, foc.code_width, foc.sample_delay, foc.duty_width), (7, 12, 50, 11));
    assert_eq!(words.reach, [782 - 8192, 782 + 8191]);
    assert_eq!(wall.stiffness_miss(), None);

    // The table pulls towards smaller angles where its torque is negative; its words push there.
    let words = read("foc-detents", &[]).unwrap().words().unwrap();
    assert_eq!((words.config.table_bits, words.config.shift), (4, 3));
    let torques = [0.0, 7.7, 14.2, 18.6, 20.0, 18.6, 14.2, 7.7].map(|torque| (torque * 1e-3 / unit_nm).round() as i32);
    assert_eq!(words.config.torques[..8], torques);
    assert_eq!(words.config.torques[8..16], torques.map(|torque| -torque));
    // 2^16 counts are 16 turns, so that the field's angle never loses them, and there is no wall.
    assert_eq!(words.reach, [i64::MIN, i64::MAX]);
    // 2^12 counts are no whole turns of 2000.
    let sets = [("encoder.lines", "500"), ("method.position_bits", "12"), ("device.initial_angle", "0.1 rad")];
    let words = read("foc-detents", &sets).unwrap().words().unwrap();
    // The field's zero is 31 counts before the start.
    assert_eq!((words.reach, words.zero), ([-31 - 2048, -31 + 2047], 4096 - 31));
}

#[test]
fn what_the_loop_cannot_have_is_refused_at_its_key() {
    let no_b = "{ ia = { kind = \"current\", winding = \"a\", trigger = true, bits = 12, gain = 0.1, range = 3.3 } }";
    for (name, sets, parts) in [
        ("foc-detents", vec![("device.sensors", no_b)], ["method.kind", "one with \"b\""]),
        ("foc-detents", vec![("device.sensors.ib.gain", "0.2")], ["method.kind", "words alike"]),
        ("foc-detents", vec![("device.sensors.ia.offset_binary", "true")], ["method.kind", "two's complement"]),
        ("foc-detents", vec![("method.position", "ia")], ["method.position", "no words of an angle"]),
        ("foc-detents", vec![("method.position", "ic")], ["method.position", "no sensor \"ic\""]),
        ("foc-wall", vec![("method.position_bits", "14")], ["method.position_bits", "leave this out"]),
        ("foc-wall", vec![("method.spacing", "2")], ["method.spacing", "no table"]),
        ("foc-detents", vec![("method.spacing", "3")], ["method.spacing", "power of two"]),
        ("foc-detents", vec![("method.torques", "[0, 1]")], ["method.torques[1]", "more than the bridge can show"]),
        ("foc-detents", vec![("method.pwm_frequency", "100 Hz")], ["method.pwm_frequency", "write 381.4814 to"]),
        (
            "foc-detents",
            vec![("device.sensors.ia.latency", "30 us"), ("device.sensors.ib.latency", "30 us")],
            ["method.pwm_frequency", "1500 clocks after their start"],
        ),
        ("foc-detents", vec![("method.dead_time", "1 ms")], ["method.dead_time", "write at most"]),
        ("foc-detents", vec![("method.min_pulse", "20 us")], ["method.min_pulse", "at most"]),
        ("foc-detents", vec![("method.current_bandwidth", "0.001 Hz")], ["method.current_bandwidth", "0"]),
        ("foc-detents", vec![("method.sample_rate", "1 Hz")], ["method.sample_rate", "or more"]),
        ("foc-detents", vec![("method.pwm", "{ bits = 10 }")], ["method.pwm", "unknown"]),
        (
            "foc-detents",
            vec![("hand", "{ kind = \"prescribed\", path = [[0, 0]] }"), ("device.initial_speed", "1")],
            ["device.initial_speed", "imposes the motion"],
        ),
        ("foc-detents", vec![("model.joints", "loose")], ["model.joints", "\"rigid\""]),
        ("foc-detents", vec![("amplifier", "{ full_scale = 1 }")], ["amplifier", "three legs"]),
        ("foc-detents", vec![("bridge.dead_band", "1 V")], ["bridge.dead_band", "averaged"]),
        ("foc-wall", vec![("wall.position", "4 rad")], ["wall.position", "does not fit 14 bits"]),
        ("foc-wall", vec![("wall.stiffness", "1e6")], ["wall.stiffness", "does not fit"]),
        ("foc-wall", vec![("wall.ramp", "{ from = 0, to = 1 }")], ["wall.ramp", "unknown"]),
        ("foc-detents", vec![("model.currents", "ideal")], ["model.currents", "bridge = \"averaged\""]),
        (
            "foc-detents",
            vec![("model.bridge", "averaged"), ("model.currents", "ideal"), ("method.enable_after", "1 ms")],
            ["model.currents", "from the start"],
        ),
        (
            "foc-detents",
            vec![("model.currents", "loops"), ("model.current_delay", "1 us")],
            ["model.current_delay", "only ideal currents"],
        ),
        (
            "foc-detents",
            vec![("model.friction", "smoothed"), ("model.friction_speed", "1")],
            ["model.friction", "not of a pmsm"],
        ),
        ("foc-detents", vec![("faults", "{ stuck_switch = \"a_high\" }")], ["faults", ""]),
    ] {
        let error = read(name, &sets).map(|_| String::new()).unwrap_or_else(|error| error);
        assert!(parts.iter().all(|part| error.contains(part)), "{sets:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{sets:?}: {error}");
    }
}
