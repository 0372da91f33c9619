//! The four sources of sine and cosine compared with `f64` sines, each within the bound that its construction allows.

use std::f64::consts::{FRAC_PI_2, TAU};

use hpu_datapath::Block;
use hpu_datapath::phantom::{
    Config, Phase, Trig, TrigCordic, TrigIn, TrigInterpolated, TrigOut, TrigQuarter, TrigTable, Turn, Wave,
};
use hpu_signal::Format;

fn shipped() -> [Turn; 4] {
    let [first, second, _] = Config::default().turns;
    let [newer_first, newer_second, _] = Config::premium_1_5().turns;
    [first, second, newer_first, newer_second]
}

#[test]
fn a_count_beyond_the_table_is_not_valid() {
    let table = TrigTable::default();
    for count in [-32_768, -4097, 4096, 32_767] {
        assert_eq!(table.at(count), TrigOut { sine: 0, cosine: 0, valid: 0 });
    }
    assert_eq!(table.at(0), TrigOut { sine: 0, cosine: 1 << 22, valid: 1 });
}

/// Returns the greatest error of sine and cosine over all counts of the width, in units of 1.
fn worst<W: Wave>(source: &Trig<W>, turn: Turn) -> f64 {
    let (count, word) = (source.inputs().count.format, source.outputs().sine.format);
    let mut worst = 0f64;
    for count in count.min() as i64..=count.max() as i64 {
        let TrigOut { sine, cosine, valid } = source.at(count);
        if valid == 1 {
            let (num, den) = (i64::from(turn.num), i64::from(turn.den));
            let angle = TAU * ((count * num) % den) as f64 / den as f64;
            let off = (word.to_f64(sine) - angle.sin()).abs().max((word.to_f64(cosine) - angle.cos()).abs());
            worst = worst.max(off);
        }
    }
    worst
}

/// The error of the tests' own float sines: an angle up to 2 pi is rounded twice, and the sine is off by half an ulp.
const FLOAT: f64 = 2e-15;

/// Returns the greatest error of a phase over all counts, in radians; it comes from the rounding of the step.
fn phase_error(phase: Phase) -> f64 {
    TAU * 0.5 * f64::from(1u32 << (phase.count_width - 1)) / (phase.width as f64).exp2()
}

fn within(name: &str, worst: f64, bound: f64) {
    println!("{name}: worst {worst:.3e}, bound {bound:.3e}");
    assert!(worst <= bound, "{name}: {worst:e} beyond {bound:e}");
    assert!(worst > bound / 8.0, "{name}: {worst:e} far below {bound:e}");
}

#[test]
fn the_table_is_within_half_an_lsb() {
    let format = Format::new(true, 9, 22).unwrap();
    for turn in shipped() {
        let table = TrigTable::new(16, 13, turn, format).unwrap();
        within("trig_table", worst(&table, turn), 0.5 * format.lsb() + FLOAT);
    }
}

/// Returns the phases of the Premium 1.0 and a coarse phase.
fn phases() -> [(Phase, Turn); 3] {
    let [first, second, _] = shipped().map(|turn| (Phase::default().of(turn), turn))[..3].try_into().unwrap();
    let short = Format::new(true, 1, 14).unwrap();
    let turn = Turn { num: 1, den: 1000 };
    [first, second, (Phase { count_width: 12, width: 31, step: 0, trig: short }.of(turn), turn)]
}

#[test]
fn the_quarter_table_is_within_half_a_step_and_half_an_lsb() {
    // An angle rounded to a step of pi/2 2^-width is off by half a step, and no sine is steeper than 1.
    for (phase, turn) in phases() {
        for width in [11, 6] {
            let block = TrigQuarter::new(phase, width).unwrap();
            let bound = FRAC_PI_2 / f64::from(2 << width) + phase_error(phase) + 0.5 * phase.trig.lsb() + FLOAT;
            within("trig_quarter", worst(&block, turn), bound);
        }
    }
}

#[test]
fn interpolation_is_within_its_chord_and_one_lsb() {
    // A chord of a sine over a step h is off by at most h^2/8. Its ends are off by half an LSB each, which interpolate
    // to half an LSB, and the result is rounded by half an LSB more. The phase drops the bits below its rest.
    for (phase, turn) in phases() {
        for (width, rest) in [(9, 14), (5, 8)] {
            let block = TrigInterpolated::new(phase, width, rest).unwrap();
            let step = FRAC_PI_2 / f64::from(1 << width);
            let dropped = step / f64::from(1 << rest);
            let bound = step * step / 8.0 + dropped + phase_error(phase) + phase.trig.lsb() + FLOAT;
            within("trig_interpolated", worst(&block, turn), bound);
        }
    }
}

#[test]
fn cordic_is_within_its_last_rotation_and_the_floors_of_all() {
    // The angle left over is at most that of the last rotation (A(i) <= sum of the later ones + A(last)). It is off by
    // the rounding of every A (half of 2^-30 turns each) and by the phase bits dropped. Each rotation floors x and y by
    // less than one guarded LSB each, so by sqrt(2) together, which the later rotations stretch by less than 1.647. K
    // is off by half a guarded LSB, which is stretched likewise. The result is rounded.
    for (phase, turn) in phases() {
        for (iterations, guard) in [(24, 4), (14, 2)] {
            let block = TrigCordic::new(phase, iterations, guard).unwrap();
            let turns = 1.0 / f64::from(1 << 30);
            let left = (1.0 / f64::from(1 << (iterations - 1))).atan();
            let angle = left + TAU * turns * (0.5 * f64::from(iterations) + 1.0) + phase_error(phase);
            let guarded = phase.trig.lsb() / f64::from(1 << guard);
            let floors = 1.647 * guarded * (2f64.sqrt() * f64::from(iterations) + 0.5);
            let bound = angle + floors + 0.5 * phase.trig.lsb() + FLOAT;
            within("trig_cordic", worst(&block, turn), bound);
        }
    }
}

#[test]
fn outputs_come_one_edge_after_the_count_and_reset_clears_them() {
    let mut table = TrigTable::default();
    assert_eq!(table.reset(), TrigOut { sine: 0, cosine: 0, valid: 0 });
    // The count is an eighth of a turn.
    let out = table.tick(TrigIn { count: 3500 });
    let half = (0.5f64.sqrt() * 4_194_304.0).round() as i64;
    assert_eq!(out, TrigOut { sine: half, cosine: half, valid: 1 });
    assert_eq!((table.quiet(&TrigIn { count: 3500 }), table.quiet(&TrigIn { count: 3501 })), (u64::MAX, 0));
    assert_eq!(table.reset(), TrigOut { sine: 0, cosine: 0, valid: 0 });
}

#[test]
fn impossible_sources_are_refused() {
    let plain = Config::default().formats.trig;
    let turn = Turn { num: 1, den: 28_000 };
    let refused = [
        TrigTable::new(16, 17, turn, plain).unwrap_err().to_string(),
        TrigTable::new(16, 13, Turn { num: 1 << 19, den: 1 }, plain).unwrap_err().to_string(),
        TrigTable::new(16, 13, turn, Format::new(true, 0, 22).unwrap()).unwrap_err().to_string(),
        TrigQuarter::new(Phase { width: 13, ..Phase::default() }, 11).unwrap_err().to_string(),
        TrigInterpolated::new(Phase::default(), 13, 14).unwrap_err().to_string(),
        TrigCordic::new(Phase::default(), 24, 7).unwrap_err().to_string(),
    ];
    assert_eq!(
        refused,
        [
            "trig_table: DEPTH_WIDTH is 17; accepted: 2 to 16",
            "trig_table: TURN_NUM is 524288; accepted: 1 to 524287",
            "trig_table: TRIG_INT is 0; accepted: 1 to 35",
            "trig_quarter: PHASE_WIDTH is 13; accepted: 14 to 48",
            "trig_interpolated: QUARTER_WIDTH is 13; accepted: 2 to 12",
            "trig_cordic: TRIG_FRAC + GUARD is 29; accepted: 4 to 28",
        ]
    );
}
