//! The four sources of sine and cosine: their words against integer series, their errors against `f64` sines.

use std::f64::consts::{FRAC_PI_2, TAU};

use hpu_datapath::Block;
use hpu_datapath::phantom::{
    PhantomConfig, Phase, Trig, TrigCordic, TrigIn, TrigInterpolated, TrigOut, TrigQuarter, TrigTable, Turn, Wave,
};
use hpu_signal::Format;

/// Fraction bits of the series below: products of two have room in an `i128`.
const FINE: u32 = 60;

/// pi in units of `2^-60`, to the nearest (0x3.243F6A8885A308D313...).
const PI: i128 = 0x3243_F6A8_885A_308D;

/// `sin(2 pi num/den)` in units of `2^-60`: an eighth of a turn by Taylor's series in integers. Each of some twenty terms
/// is truncated, and pi is rounded: off by less than `2^-54`.
fn sine(num: i64, den: i64) -> i128 {
    let (turn, eighths) = (i128::from(den), 8 * i128::from(num).rem_euclid(i128::from(den)));
    // Quadrant 0 to 3 about 0, 1/4, 1/2, 3/4 of a turn; the rest is at most an eighth on either side.
    let quadrant = (eighths + turn) / (2 * turn);
    let rest = eighths - 2 * turn * quadrant;
    let angle = PI * rest / (4 * turn);
    let square = (angle * angle) >> FINE;
    let series = |mut term: i128, mut index: i128| {
        let mut sum = 0;
        while term != 0 && index < 60 {
            sum += term;
            term = -(((term * square) >> FINE) / ((index + 1) * (index + 2)));
            index += 2;
        }
        sum
    };
    let (sine, cosine) = (series(angle, 1), series(1 << FINE, 0));
    [sine, cosine, -sine, -cosine][(quadrant % 4) as usize]
}

/// The nearest word of `frac` bits, and how far from a tie it is, in LSB.
fn nearest(fine: i128, frac: u32) -> (i64, f64) {
    let drop = FINE - frac;
    let word = (fine + (1 << (drop - 1))) >> drop;
    let rest = fine - (word << drop);
    let tie = 0.5 - rest.abs() as f64 / (1i128 << drop) as f64;
    (word as i64, tie)
}

fn shipped() -> [Turn; 4] {
    let [first, second, _] = PhantomConfig::default().turns;
    let [newer_first, newer_second, _] = PhantomConfig::premium_1_5().turns;
    [first, second, newer_first, newer_second]
}

#[test]
fn every_word_of_every_shipped_table_is_the_nearest_and_no_float_could_have_missed_it() {
    // Taylor's integers are within 2^-54, the floats that tables are made of within 2^-51, and so are the VHDL's if they
    // are off by less than 2^-40: that is 2^-18 = 4e-6 LSB of 22 fraction bits. Nothing comes that near a tie.
    let mut nearest_tie = f64::INFINITY;
    for turn in shipped() {
        let (num, den) = (i64::from(turn.num), i64::from(turn.den));
        let format = Format::new(true, 9, 22).unwrap();
        let table = TrigTable::new(16, 13, turn, format).unwrap();
        for count in -4096..4096i64 {
            let (sine, sine_tie) = nearest(sine(count * num, den), 22);
            let (cosine, cosine_tie) = nearest(self::sine(4 * count * num + den, 4 * den), 22);
            assert_eq!(table.at(count), TrigOut { sine, cosine, valid: 1 }, "{count} of {turn:?}");
            nearest_tie = nearest_tie.min(sine_tie).min(cosine_tie);
        }
    }
    println!("nearest tie: {nearest_tie:.2e} LSB");
    assert!(nearest_tie > 2f64.powi(-18), "{nearest_tie:e}");
}

#[test]
fn every_word_of_every_shipped_quarter_is_the_nearest_and_no_float_could_have_missed_it() {
    let format = Format::new(true, 9, 22).unwrap();
    for (width, block) in [(11, 0), (9, 1)] {
        // One count a step, so that every step is seen, four times.
        let phase = Phase { count_width: 16, width: 40, step: 0, trig: format }.of(Turn { num: 1, den: 4 << width });
        let at = |count: i64| -> TrigOut<i64> {
            match block {
                0 => TrigQuarter::new(phase, width).unwrap().at(count),
                _ => TrigInterpolated::new(phase, width, 14).unwrap().at(count),
            }
        };
        for count in (-(1i64 << width)..=1 << width).step_by(if width == 11 { 16 } else { 4 }) {
            let (sine, tie) = nearest(sine(count, 4 << width), 22);
            assert!(tie > 2f64.powi(-18));
            assert_eq!(at(count).sine, sine, "{count} of {width}");
        }
    }
}

#[test]
fn a_count_beyond_the_table_is_not_valid() {
    let table = TrigTable::default();
    for count in [-32_768, -4097, 4096, 32_767] {
        assert_eq!(table.at(count), TrigOut { sine: 0, cosine: 0, valid: 0 });
    }
    assert_eq!(table.at(0), TrigOut { sine: 0, cosine: 1 << 22, valid: 1 });
}

/// The greatest errors of sine and cosine over all counts of the width, in units of 1.
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

/// The float sines of the tests themselves: an angle up to 2 pi rounded twice, and their own half ulp.
const FLOAT: f64 = 2e-15;

/// What a phase is off at most, in radians: the step's rounding, over all counts.
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

/// Premium 1.0 and a coarse one.
fn phases() -> [(Phase, Turn); 3] {
    let [first, second, _] = shipped().map(|turn| (Phase::default().of(turn), turn))[..3].try_into().unwrap();
    let short = Format::new(true, 1, 14).unwrap();
    let turn = Turn { num: 1, den: 1000 };
    [first, second, (Phase { count_width: 12, width: 31, step: 0, trig: short }.of(turn), turn)]
}

#[test]
fn the_quarter_table_is_within_half_a_step_and_half_an_lsb() {
    // An angle rounded to a step of pi/2 2^-width is off by half of it; no sine is steeper than 1.
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
    // A chord of a sine of step h is off by at most h^2/8; its ends by half an LSB each, which interpolate to half an
    // LSB, and the result is rounded by half an LSB more; the phase drops what is below its rest.
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
    // The angle left over is at most the last rotation's (A(i) <= sum of the later ones + A(last)), off by the rounding
    // of every A (half of 2^-30 turns each) and by the phase bits dropped. Each rotation floors x and y, by less than one
    // guarded LSB each, so sqrt(2) together, which the later rotations stretch by less than 1.647; K is off by half a
    // guarded LSB, stretched likewise; the result is rounded.
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

/// The CORDIC of the data sheet, its angles and its start from integers alone.
struct Rotations {
    phase: Phase,
    guard: u32,
    start: i128,
    angles: Vec<i128>,
}

impl Rotations {
    fn new(phase: Phase, iterations: u32, guard: u32) -> Self {
        let one = 1i128 << FINE;
        // K is the root rounded: the least with (2K + 1)^2 prod(1 + 2^-2i) > 4 2^2n.
        let bits = phase.trig.frac() as u32 + guard;
        let product = (0..iterations).fold(one, |product, index| product + (product >> (2 * index)));
        let beyond = |k: i128| (2 * k + 1) * (2 * k + 1) * product > 1 << (2 * bits + 2 + FINE);
        let (mut low, mut high) = (0, 1 << bits);
        while low < high {
            let middle = (low + high) / 2;
            if beyond(middle) { high = middle } else { low = middle + 1 }
        }
        // Euler: atan(t) = t/(1+t^2) (1 + 2/3 u (1 + 4/5 u (1 + ...))), u = t^2/(1+t^2), within 2^-50.
        let angle = |index: u32| {
            let square = one >> (2 * index);
            let ratio = (square << FINE) / (one + square);
            let factor =
                (1..60).rev().fold(one, |factor, term| one + ((factor * ratio) >> FINE) * 2 * term / (2 * term + 1));
            let atan = ((((one >> index) << FINE) / (one + square)) * factor) >> FINE;
            (((atan << 30) / PI) + 1) >> 1
        };
        Self { phase, guard, start: low, angles: (0..iterations).map(angle).collect() }
    }

    fn at(&self, count: i64) -> TrigOut<i64> {
        let turns = (i128::from(count) * i128::from(self.phase.step)).rem_euclid(1 << self.phase.width);
        let z = turns >> (self.phase.width - 30);
        let mut z = if z >= 1 << 29 { z - (1 << 30) } else { z };
        let turned = if z >= 1 << 28 { -1 } else { i128::from(z < -(1 << 28)) };
        z += turned << 29;
        let (mut x, mut y) = (self.start, 0i128);
        for (index, angle) in self.angles.iter().enumerate() {
            let d = if z >= 0 { 1 } else { -1 };
            (x, y, z) = (x - d * (y >> index), y + d * (x >> index), z - d * angle);
        }
        let narrow = |value: i128| {
            let value = if turned == 0 { value } else { -value };
            (2 * value + (1 << self.guard)).div_euclid(2 << self.guard) as i64
        };
        TrigOut { sine: narrow(y), cosine: narrow(x), valid: 1 }
    }
}

#[test]
fn every_cordic_word_is_that_of_the_data_sheet_in_integers() {
    for (phase, _) in phases() {
        for (iterations, guard) in [(24, 4), (28, 0), (14, 2), (4, 6)] {
            let block = TrigCordic::new(phase, iterations, guard).unwrap();
            let model = Rotations::new(phase, iterations, guard);
            let half = 1i64 << (phase.count_width - 1);
            for count in -half..half {
                assert_eq!(block.at(count), model.at(count), "{count} of {phase:?}, {iterations} rotations");
            }
        }
    }
}

/// Quarter and interpolated words by the data sheet, from exact sines.
#[test]
fn every_quarter_and_interpolated_word_is_that_of_the_data_sheet_in_integers() {
    for (phase, _) in phases() {
        let frac = phase.trig.frac() as u32;
        let (width, rest) = (6u32, 5u32);
        let quarter: Vec<i64> = (0..=1 << width).map(|step| nearest(sine(step, 4 << width), frac).0).collect();
        let (coarse, fine) =
            (TrigQuarter::new(phase, width).unwrap(), TrigInterpolated::new(phase, width, rest).unwrap());
        let half = 1i64 << (phase.count_width - 1);
        for count in -half..half {
            let turns = (i128::from(count) * i128::from(phase.step)).rem_euclid(1 << phase.width);
            // In steps of the quarter, four quarters a turn.
            let scaled = |bits: u32| (turns >> (phase.width - 2 - bits)) as i64;
            let nearest = ((turns + (1 << (phase.width - 3 - width))) >> (phase.width - 2 - width)) as i64;
            let wave = |address: i64| {
                let (quadrant, step) = (address >> width & 3, (address & ((1 << width) - 1)) as usize);
                let size = quarter[if quadrant % 2 == 0 { step } else { (1 << width) - step }];
                if quadrant < 2 { size } else { -size }
            };
            let expected = TrigOut { sine: wave(nearest), cosine: wave(nearest + (1 << width)), valid: 1 };
            assert_eq!(coarse.at(count), expected, "quarter {count}");

            let chord = |address: i64| {
                let bits = width + rest;
                let (quadrant, fraction) = (address >> bits & 3, address & ((1 << bits) - 1));
                let folded = if quadrant % 2 == 0 { fraction } else { (1 << bits) - fraction };
                let (from, part) = ((folded >> rest) as usize, folded & ((1 << rest) - 1));
                let to = (from + 1).min(1 << width);
                // Between the two words, weighted, rounded half up.
                let sum = quarter[from] * ((1 << rest) - part) + quarter[to] * part;
                let size = (2 * sum + (1 << rest)).div_euclid(2 << rest);
                if quadrant < 2 { size } else { -size }
            };
            let address = scaled(width + rest);
            let expected = TrigOut { sine: chord(address), cosine: chord(address + (1 << (width + rest))), valid: 1 };
            assert_eq!(fine.at(count), expected, "interpolated {count}");
        }
    }
}

#[test]
fn outputs_come_one_edge_after_the_count_and_reset_clears_them() {
    let mut table = TrigTable::default();
    assert_eq!(table.reset(), TrigOut { sine: 0, cosine: 0, valid: 0 });
    // An eighth of a turn.
    let out = table.tick(TrigIn { count: 3500 });
    let half = (0.5f64.sqrt() * 4_194_304.0).round() as i64;
    assert_eq!(out, TrigOut { sine: half, cosine: half, valid: 1 });
    assert_eq!((table.quiet(&TrigIn { count: 3500 }), table.quiet(&TrigIn { count: 3501 })), (u64::MAX, 0));
    assert_eq!(table.reset(), TrigOut { sine: 0, cosine: 0, valid: 0 });
}

#[test]
fn impossible_sources_are_refused() {
    let plain = PhantomConfig::default().formats.trig;
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
