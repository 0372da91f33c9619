//! Tests the proof of the words' ranges and errors: its results, and a million postures that must stay inside them.

use std::f64::consts::TAU;

use hpu_datapath::Block;
use hpu_datapath::phantom::{Config, PhantomForward, PhantomTorque, TrigTable, phantom_forward, phantom_torque};
use hpu_prove::arms::{SignalBound, bounds};

/// The upper bits of a linear congruential generator (Knuth's MMIX).
struct Draw(u64);

impl Draw {
    fn below(&mut self, bound: u64) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * u128::from(bound)) >> 64) as i64
    }
}

fn of(rows: &[SignalBound], name: &str) -> SignalBound {
    *rows.iter().find(|row| row.name == name).unwrap()
}

fn failing(config: &Config, stiffness_n_per_m: f64) -> Vec<&'static str> {
    let rows = bounds(config, stiffness_n_per_m).unwrap();
    rows.iter().filter(|row| !row.fits).map(|row| row.name).collect()
}

#[test]
fn no_word_of_the_premium_1_0_or_1_5_ever_wraps_up_to_40_000_newtons_a_metre() {
    for config in [Config::default(), Config::premium_1_5()] {
        let rows = bounds(&config, 40_000.0).unwrap();
        for row in &rows {
            assert!(row.fits && row.error.is_finite(), "{row:?}");
        }
        assert_eq!(rows.len(), 23);
    }
}

#[test]
fn plain_q22_fails_in_the_stiffness_alone_and_just_below_512_newtons_a_metre() {
    assert_eq!(failing(&Config::plain_q22(), 40_000.0), ["stiffness"]);
    assert_eq!(failing(&Config::plain_q22(), 512.0), ["stiffness"]);
    assert_eq!(failing(&Config::plain_q22(), 511.999), [""; 0]);
    // If the stiffness has wrapped, nothing is known of the force but its limit.
    let rows = bounds(&Config::plain_q22(), 512.0).unwrap();
    assert_eq!((of(&rows, "force_x").error, of(&rows, "force_x").max), (f64::INFINITY, 8.5));
}

#[test]
fn a_range_that_does_not_fit_is_named_and_nothing_is_promised_of_what_follows() {
    // Links of 0.9 m reach 1.6 m far and 1.07 m high, but the words end at 1 m; they turn 8.5 N into more than 8 N.m.
    // The wrapped radius may be any word; x is at most 0.74 of it, which still fits a word.
    let config = Config { lengths: [15_099_494; 2], ..Config::default() };
    assert_eq!(failing(&config, 1000.0), ["radius", "y", "z", "torque1", "torque2", "torque3"]);
    let rows = bounds(&config, 1000.0).unwrap();
    for name in ["x", "z", "force_z", "torque1"] {
        assert_eq!(of(&rows, name).error, f64::INFINITY, "{name}");
    }
    assert!(of(&rows, "sine1").error.is_finite());
}

#[test]
fn ranges_of_the_premium_1_0_agree_with_trigonometry() {
    // The counts are from -4096 to 4095, of 3/92000 turns in joint 1 and 1/28000 in joints 2 and 3. The tolerance of
    // 1e-6 is above every rounding of the words.
    let rows = bounds(&Config::default(), 40_000.0).unwrap();
    let (first, second) = (TAU * 3.0 / 92_000.0, TAU / 28_000.0);
    let (low, high) = ((-4096.0 * second).sin(), (4095.0 * second).sin());
    let (least, length_m, near) = ((4096.0 * second).cos(), 0.14, 1e-6);
    let far = length_m * (1.0 + high);
    let expected = [
        ("sine1", (-4096.0 * first).sin(), (4095.0 * first).sin()),
        ("cosine1", (4096.0 * first).cos(), 1.0),
        ("radius", length_m * (least + low), far),
        ("x", (-4096.0 * first).sin() * far, (4095.0 * first).sin() * far),
        ("y", length_m * low, length_m * (1.0 - least + high)),
        ("force_x", -8.5, 8.5),
        ("command1", -32_768.0, 32_767.0),
    ];
    for (name, min, max) in expected {
        let row = of(&rows, name);
        assert!((row.min - min).abs() < near && (row.max - max).abs() < near, "{row:?}");
    }
}

/// Returns postures on every edge of the tables first, then random ones.
fn postures(draw: &mut Draw, count: usize) -> impl Iterator<Item = [i64; 3]> {
    let edges = [-4096, -1, 0, 1, 4095];
    let corners: Vec<[i64; 3]> =
        edges.iter().flat_map(|&a| edges.iter().flat_map(move |&b| edges.map(|c| [a, b, c]))).collect();
    corners.into_iter().chain((0..count).map(|_| [(); 3].map(|()| draw.below(8192) - 4096)))
}

fn errors_stay_inside(config: Config, count: usize) {
    let formats = config.formats;
    let rows = bounds(&config, 40_000.0).unwrap();
    let tables = config.turns.map(|turn| TrigTable::new(16, 13, turn, formats.trig).unwrap());
    let forward = PhantomForward::new(&formats, config.lengths).unwrap();
    let jacobian = PhantomTorque::new(&formats, config.lengths).unwrap();
    let [upper_m, fore_m] = config.lengths.map(|word| f64::from(word) / f64::from(1 << formats.length_frac));
    let limit = i64::from(config.force_limit);
    let mut worst = [0f64; 7];
    let mut forces = Draw(2);
    for counts in postures(&mut Draw(1), count) {
        let words: Vec<_> = counts.iter().zip(&tables).map(|(count, table)| table.at(*count)).collect();
        let [sine1, sine2, sine3] = [0, 1, 2].map(|joint| words[joint].sine);
        let [cosine1, cosine2, cosine3] = [0, 1, 2].map(|joint| words[joint].cosine);
        let posture = phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 };
        let tip = forward.eval(posture);
        let [force_x, force_y, force_z] = match forces.below(4) {
            0 => [(); 3].map(|()| limit * (2 * forces.below(2) - 1)),
            _ => [(); 3].map(|()| forces.below(2 * limit as u64 + 1) - limit),
        };
        let pushed = phantom_torque::In {
            sine1,
            cosine1,
            sine2,
            cosine2,
            sine3,
            cosine3,
            x: tip.x.word,
            z: tip.z.word,
            force_x,
            force_y,
            force_z,
        };
        let torque = jacobian.eval(pushed);

        // These are the kinematics and the power balance torque = (d tip / d angle) . force in floats, whose own error
        // of some 1e-15 is far below the least bound of 1e-8.
        let [q1, q2, q3] = [0, 1, 2].map(|joint| {
            let turn = config.turns[joint];
            TAU * counts[joint] as f64 * f64::from(turn.num) / f64::from(turn.den)
        });
        let radius_m = upper_m * q2.cos() + fore_m * q3.sin();
        let [fx, fy, fz] = [force_x, force_y, force_z].map(|word| formats.force.to_f64(word));
        let truth = [
            radius_m,
            q1.sin() * radius_m,
            fore_m * (1.0 - q3.cos()) + upper_m * q2.sin(),
            q1.cos() * radius_m - upper_m,
            radius_m * (q1.cos() * fx - q1.sin() * fz),
            upper_m * (-q2.sin() * (q1.sin() * fx + q1.cos() * fz) + q2.cos() * fy),
            fore_m * (q3.cos() * (q1.sin() * fx + q1.cos() * fz) + q3.sin() * fy),
        ];
        let position = [tip.radius, tip.x, tip.y, tip.z].map(|word| formats.position.to_f64(word.word));
        let torque = [torque.torque1, torque.torque2, torque.torque3].map(|word| formats.torque.to_f64(word.word));
        for (index, value) in position.into_iter().chain(torque).enumerate() {
            worst[index] = worst[index].max((value - truth[index]).abs());
        }
    }
    for (name, worst) in ["radius", "x", "y", "z", "torque1", "torque2", "torque3"].into_iter().zip(worst) {
        let row = of(&rows, name);
        println!("{name}: worst of {count} postures {worst:.3e} {}, proved {:.3e}", row.unit, row.error);
        assert!(worst <= row.error, "{name}: {worst:e} beyond {:e}", row.error);
        // The proved errors are upper bounds, but not loose ones. Their terms cannot all be worst at once, which costs
        // less than an order of magnitude.
        assert!(row.error < 10.0 * worst, "{name}: {worst:e} far below {:e}", row.error);
    }
}

#[test]
fn a_million_postures_of_the_premium_1_0_stay_inside_the_proved_errors() {
    errors_stay_inside(Config::default(), 1_000_000);
}

#[test]
fn postures_of_the_premium_1_5_and_of_plain_q22_stay_inside_the_proved_errors() {
    errors_stay_inside(Config::premium_1_5(), 1_000_000);
    errors_stay_inside(Config::plain_q22(), 1_000_000);
}

#[test]
fn position_is_within_a_fifth_of_a_micrometre_and_torque_within_a_thousandth_of_a_percent() {
    let rows = bounds(&Config::default(), 40_000.0).unwrap();
    for name in ["radius", "x", "y", "z"] {
        assert!(of(&rows, name).error < 0.2e-6, "{:?}", of(&rows, name));
    }
    for name in ["torque1", "torque2", "torque3"] {
        assert!(of(&rows, name).error < 1.19 * 1e-5, "{:?}", of(&rows, name));
    }
    // The force depends on the tip as the wall sees it, so the force is off by the stiffness times the error of the
    // tip.
    let (tip, force) = (of(&rows, "x"), of(&rows, "force_x"));
    let rounding_n = force.format.lsb() / 2.0;
    assert!((force.error - (40_000.0 * tip.error + rounding_n)).abs() < 1e-9);
}

#[test]
fn bounds_need_tables_that_exist() {
    let config = Config { depth_width: 17, ..Config::default() };
    assert_eq!(
        bounds(&config, 1.0).unwrap_err().to_string(),
        format!("{}: DEPTH_WIDTH is 17; accepted: 2 to 16", TrigTable::NAME)
    );
}
