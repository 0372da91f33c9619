//! The words of a scene against exact arithmetic and the published figures of the 12-bit design.

use std::f64::consts::PI;

use hpu_datapath::{ConventionalLoop, HybridLoop};
use hpu_scene::{LawMethod, Loop, LoopWords, Scene, shipped};

fn scene(overrides: &[(&str, &str)]) -> Result<Scene, String> {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let hybrid = shipped().iter().find(|scene| scene.name == "hybrid-wall").unwrap();
    hybrid.parse(&overrides).map(|scene| scene.axis().unwrap()).map_err(|error| error.to_string())
}

fn words(overrides: &[(&str, &str)]) -> LoopWords {
    scene(overrides).unwrap().words().unwrap()
}

fn near(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * b.abs()
}

#[test]
fn the_paper_s_motor_stalls_at_265_mnm_and_a_count_is_a_4096th_of_a_turn() {
    let words = words(&[]);
    // Published: 265 mN.m at full duty (12 bits), 1024 lines decoded x4. At most three roundings of f64.
    assert!(near(words.realised.torque_quantum_nm, 0.265 / 4096.0, 1e-15));
    assert_eq!(words.realised.count_rad, 2.0 * PI / 4096.0);
}

#[test]
fn one_unit_of_stiffness_is_42_mnm_per_radian() {
    // k = k_i * 0.0421760599 N.m/rad: 0.265 N.m / 2 pi rad, because 4096 cancels.
    let unit = 0.265 / (2.0 * PI);
    for integer in [1, 2, 36, 71, 4095] {
        let words = words(&[("wall.stiffness", &format!("{}", f64::from(integer) * unit))]);
        assert_eq!(words.stiffness, i64::from(integer));
        assert!(words.realised.stiffness_error.abs() < 1e-14);
    }
}

#[test]
fn a_stiffness_is_the_nearest_word_and_its_error_is_told() {
    // 1.5 / 0.0421760599 = 35.565...
    let coarse = words(&[]);
    assert_eq!(coarse.stiffness, 36);
    assert!(near(coarse.realised.stiffness_nm_per_rad, 36.0 * 0.265 / (2.0 * PI), 1e-14));
    assert!(near(1.0 + coarse.realised.stiffness_error, 36.0 * 0.265 / (2.0 * PI) / 1.5, 1e-14));
    // In sixteenths: 569.04...
    let fine = words(&[("method.stiffness_format", "(0,8,4)")]);
    assert_eq!(fine.stiffness, 569);
    for step in 0..200 {
        let stiffness = 1.0 + f64::from(step) / 100.0;
        let realised = words_of_stiffness(stiffness).realised.stiffness_nm_per_rad;
        assert!((realised - stiffness).abs() <= 0.265 / (2.0 * PI) / 2.0 * (1.0 + 1e-12), "{stiffness}");
    }
}

fn words_of_stiffness(stiffness_nm_per_rad: f64) -> LoopWords {
    let mut scene = scene(&[]).unwrap();
    scene.wall.stiffness_nm_per_rad = stiffness_nm_per_rad;
    scene.words().unwrap()
}

#[test]
fn switches_in_series_with_the_winding_take_their_share() {
    let resistance_ohm = 25.9e-3 * 24.0 / 0.265;
    let words = words(&[("bridge.on_resistance", "330 mOhm"), ("method.pwm.bits", "10")]);
    let quantum_nm = 25.9e-3 * 24.0 / (resistance_ohm + 0.66) / 1024.0;
    assert!(near(words.realised.torque_quantum_nm, quantum_nm, 1e-14));
}

#[test]
fn damping_words_shrink_with_the_sample_period() {
    // b / (0.0421760599 T): 2.371 PWM counts per count and ms, which is 37.94 sixteenths.
    assert_eq!(words(&[]).damping, 38);
    assert_eq!(words(&[("method.sample_rate", "10 kHz")]).damping, 379);
    assert_eq!(words(&[("method.sample_rate", "100 Hz")]).damping, 4);
    let none = words(&[("wall.damping", "0")]);
    assert_eq!((none.damping, none.realised.damping_error, none.scale), (0, 0.0, 0));
}

#[test]
fn a_rescaled_damping_word_is_that_of_the_reference_rate() {
    let rescaled = [("method.rescaled", "true"), ("method.reference_rate", "1 kHz"), ("method.sample_rate", "5 kHz")];
    let words = words(&rescaled);
    assert_eq!((words.damping, words.scale, words.period), (38, 5 << 8, 10_000));
    assert!(words.config.rescaled);
    let unit = 0.265 / (2.0 * PI) * 1e-3;
    assert!(near(words.realised.damping_nm_s_per_rad, 38.0 / 16.0 * unit, 1e-13));
}

#[test]
fn a_scale_that_does_not_fit_is_refused() {
    let message =
        scene(&[("method.rescaled", "true"), ("method.reference_rate", "1 kHz"), ("method.sample_rate", "400 kHz")])
            .unwrap_err();
    let start = "--set method.reference_rate=1 kHz: method.reference_rate: 400";
    assert!(message.starts_with(start), "{message}");
    assert!(message.contains("does not fit (0,8,8); write at most 255.996"), "{message}");
}

#[test]
fn the_sample_rate_is_rounded_to_whole_clocks() {
    let words = words(&[("clock.frequency", "25.175 MHz"), ("method.sample_rate", "10 kHz")]);
    // 2517.5 clocks: a half rounds up.
    assert_eq!(words.period, 2518);
    assert!(near(words.realised.sample_rate_hz, 25.175e6 / 2518.0, 1e-15));
}

/// Returns the word of the filter's weight at 4 kHz, the number of its fraction bits, and the corner that it has.
fn filter(key: &str, value: &str) -> (u32, u32, Option<f64>) {
    let scene = scene(&[
        ("method.kind", "sampled_wall"),
        ("method.sample_rate", "4 kHz"),
        ("method.estimator", "filtered"),
        (key, value),
    ])
    .unwrap();
    // The shift is a parameter of the run only where it is in force.
    assert_eq!(scene.parameters.iter().any(|parameter| parameter.key == "method.filter_shift"), key.ends_with("shift"));
    let Loop::Law(LawMethod::SampledWall(wall)) = scene.method.kind else { panic!("a sampled wall") };
    let (word, frac) = wall.weight(scene.sample_period_s());
    (word, frac, wall.realised_corner_hz(scene.sample_period_s()))
}

#[test]
fn a_second_order_of_30_hz_at_4_khz_has_the_known_coefficients_and_keeps_a_constant() {
    let scene = scene(&[
        ("method.kind", "sampled_wall"),
        ("method.sample_rate", "4 kHz"),
        ("method.estimator", "filtered"),
        ("method.velocity_filter", "{ corner = \"30 Hz\", order = 2 }"),
    ])
    .unwrap();
    let Loop::Law(LawMethod::SampledWall(wall)) = scene.method.kind else { panic!("a sampled wall") };
    let ([b0, a1, a2], guard) = wall.section(scene.sample_period_s()).unwrap();
    // Known answers, computed apart with 40 digits; A2 is off by one more unit, so that the gain is 1.
    let one = f64::from(1 << 30);
    let known = [0.00053716977481206, -1.9333802258799, 0.93552890497918];
    for (word, known) in [b0, a1, a2].into_iter().zip(known) {
        assert!((word as f64 / one - known).abs() <= 1.5 / one, "{word} {known}");
    }
    assert_eq!(4 * b0, (1 << 30) + a1 + a2);
    // 2^28 / B0 is 465.4, so 9 bits and one more.
    assert_eq!(guard, 10);
    // Computed apart: the words' own corner.
    assert!(near(wall.realised_corner_hz(scene.sample_period_s()).unwrap(), 30.00000899656345, 1e-12));
}

#[test]
fn a_corner_of_30_hz_at_4_khz_is_the_known_word_and_every_shift_has_its_known_corner() {
    // Known answers, computed apart: 1 - exp(-2 pi 30 / 4000) = 0.04603079678847874, times 2^16 about 3017.
    let (word, frac, corner_hz) = filter("method.velocity_filter.corner", "30 Hz");
    assert_eq!((word, frac), (3017, 16));
    assert!(near(corner_hz.unwrap(), 30.00331655, 1e-9), "{corner_hz:?}");
    for (shift, expected_hz) in [("4", 41.0865), ("5", 20.2118)] {
        let (word, frac, corner_hz) = filter("method.filter_shift", shift);
        assert_eq!((word, frac.to_string()), (1, shift.to_string()));
        assert!((corner_hz.unwrap() - expected_hz).abs() <= 0.5e-4, "shift {shift}: {corner_hz:?}");
    }
    assert_eq!(filter("method.filter_shift", "0").2, None);
}

#[test]
fn the_reference_is_counted_from_where_the_encoder_starts() {
    // 1.5 rad = 977.8 counts, nearest 978; the encoder starts in count floor(-0.1 rad / count) = floor(-65.19) = -66.
    assert_eq!(words(&[]).reference, 978);
    assert_eq!(words(&[("device.initial_angle", "-0.1 rad")]).reference, 978 + 66);
    assert_eq!(words(&[("device.initial_angle", "0.1 rad")]).reference, 978 - 65);
    // A hand that imposes the angle starts the device at its own first point: 1.4 rad are 912.6 counts.
    let prescribed = words(&[("hand", "{ kind = \"prescribed\", path = [[0, 1.4], [1, 2]] }")]);
    assert_eq!(prescribed.reference, 978 - 912);
    // A wall behind the start, modulo the counter's range.
    assert_eq!(words(&[("wall.position", "-1.5 rad")]).reference, 4096 - 978);
    let wraps = [("wall.position", "1 rev"), ("method.position_bits", "12"), ("wall.wraps", "true")];
    assert_eq!(words(&wraps).reference, 0);
    assert_eq!(words(&[("wall.position", "1 rev"), ("method.position_bits", "16")]).reference, 4096);
    assert!(near(words(&[]).realised.wall_position_rad, 978.0 * 2.0 * PI / 4096.0, 1e-15));
}

#[test]
fn the_modulator_s_options_reach_the_wiring() {
    let pwm = words(&[
        ("method.pwm.mode", "locked_antiphase"),
        ("method.pwm.duty", "immediate"),
        ("method.pwm.off", "float"),
        ("method.pwm.dead_time", "1 us"),
        ("method.pwm.bits", "10"),
    ]);
    let pwm = pwm.config.pwm;
    assert_eq!((pwm.width, pwm.antiphase, pwm.latched, pwm.floating, pwm.dead_time), (10, true, false, true, 50));
    let default = words(&[]).config;
    assert_eq!(default.pwm, hpu_datapath::PwmConfig::default());
    assert!(default.saturate);
    assert!(!words(&[("method.product", "drop_upper")]).config.saturate);
}

#[test]
fn the_clocks_that_a_command_is_held_back_reach_the_wiring() {
    assert_eq!(words(&[]).config.settling, 0);
    assert_eq!(words(&[("method.settling", "2")]).config.settling, 2);
    let refused = |key: &str, value: &str| scene(&[("method.settling", value), (key, value)]).unwrap_err();
    assert!(refused("method.settling", "65").contains("`65` is not a whole number from 0 to 64"));
    let other = [("method.settling", "2"), ("model.bridge", "averaged"), ("model.datapath", "law")];
    let error = scene(&other).unwrap_err();
    assert!(error.contains("method.settling: only words settle; write model.datapath = \"words\""), "{error}");
    let law = scene(&[("method.settling", "2"), ("method.kind", "sampled_wall")]).unwrap_err();
    assert!(law.contains("method.settling: unknown key for kind \"sampled_wall\""), "{law}");
}

#[test]
fn every_width_that_a_scene_accepts_is_one_that_the_wirings_accept() {
    let narrow = [
        ("method.position_bits", "2"),
        ("wall.wraps", "true"),
        ("method.velocity_bits", "2"),
        ("method.period_bits", "2"),
        ("method.sample_rate", "25 MHz"),
        ("method.stiffness_format", "(0,0,2)"),
        ("method.damping_format", "(0,32,0)"),
        ("method.pwm.bits", "2"),
        ("wall.stiffness", "1e-4"),
        ("wall.damping", "0"),
    ];
    let wide = [
        ("method.position_bits", "32"),
        ("method.velocity_bits", "32"),
        ("method.period_bits", "30"),
        ("method.stiffness_format", "(0,32,0)"),
        ("method.damping_format", "(0,32,0)"),
        ("method.rescaled", "true"),
        ("method.reference_rate", "1 kHz"),
        ("method.scale_format", "(0,16,16)"),
        ("method.pwm.bits", "24"),
    ];
    for (overrides, stiffness) in [(&narrow[..], None), (&wide[..], Some("1.5"))] {
        let mut overrides = overrides.to_vec();
        overrides.extend(stiffness.map(|value| ("wall.stiffness", value)));
        let unit = 0.265 / 4.0 / (2.0 * PI / 4096.0);
        let own = format!("{}", unit * 0.5);
        if stiffness.is_none() {
            overrides.push(("wall.stiffness", &own));
        }
        let config = words(&overrides).config;
        HybridLoop::new(config).unwrap();
        ConventionalLoop::new(config).unwrap();
    }
}
