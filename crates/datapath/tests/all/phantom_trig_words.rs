//! The words of the four sources of sine and cosine, compared with series and rotations in integers.

use hpu_datapath::phantom::{Config, Phase, TrigCordic, TrigInterpolated, TrigOut, TrigQuarter, TrigTable, Turn};
use hpu_signal::Format;

/// Number of fraction bits of the series below; the product of two such numbers fits an `i128`.
const FINE: u32 = 60;

/// pi in units of `2^-60`, rounded to the nearest (0x3.243F6A8885A308D313...).
const PI: i128 = 0x3243_F6A8_885A_308D;

/// Returns `sin(2 pi num/den)` in units of `2^-60`, computed for an eighth of a turn by Taylor's series in integers.
/// The series truncates each of some twenty terms, and pi is rounded, so the result is off by less than `2^-54`.
fn sine(num: i64, den: i64) -> i128 {
    let (turn, eighths) = (i128::from(den), 8 * i128::from(num).rem_euclid(i128::from(den)));
    // Quadrants 0 to 3 lie about 0, 1/4, 1/2 and 3/4 of a turn; the rest is at most an eighth on either side.
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

/// Returns the nearest word of `frac` bits, and how far from a tie it is, in LSB.
fn nearest(fine: i128, frac: u32) -> (i64, f64) {
    let drop = FINE - frac;
    let word = (fine + (1 << (drop - 1))) >> drop;
    let rest = fine - (word << drop);
    let tie = 0.5 - rest.abs() as f64 / (1i128 << drop) as f64;
    (word as i64, tie)
}

fn shipped() -> [Turn; 4] {
    let [first, second, _] = Config::default().turns;
    let [newer_first, newer_second, _] = Config::premium_1_5().turns;
    [first, second, newer_first, newer_second]
}

#[test]
fn every_word_of_every_shipped_table_is_the_nearest_and_no_float_could_have_missed_it() {
    // The integers of the series are within 2^-54, and the floats from which the tables are made within 2^-51. The
    // floats of the VHDL are good enough if they are off by less than 2^-40, which is 2^-18 = 4e-6 LSB of 22 fraction
    // bits. No sine comes that near to a tie.
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
        // One count makes one step, so that every step is seen, four times.
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

/// Returns the phases of the Premium 1.0 and a coarse phase.
fn phases() -> [(Phase, Turn); 3] {
    let [first, second, _] = shipped().map(|turn| (Phase::default().of(turn), turn))[..3].try_into().unwrap();
    let short = Format::new(true, 1, 14).unwrap();
    let turn = Turn { num: 1, den: 1000 };
    [first, second, (Phase { count_width: 12, width: 31, step: 0, trig: short }.of(turn), turn)]
}

/// The CORDIC of the data sheet, whose angles and start are computed from integers alone.
struct Rotations {
    phase: Phase,
    guard: u32,
    start: i128,
    angles: Vec<i128>,
}

impl Rotations {
    fn new(phase: Phase, iterations: u32, guard: u32) -> Self {
        let one = 1i128 << FINE;
        // K is the rounded root: the least K with (2K + 1)^2 prod(1 + 2^-2i) > 4 2^2n.
        let bits = phase.trig.frac() as u32 + guard;
        let product = (0..iterations).fold(one, |product, index| product + (product >> (2 * index)));
        let beyond = |k: i128| (2 * k + 1) * (2 * k + 1) * product > 1 << (2 * bits + 2 + FINE);
        let (mut low, mut high) = (0, 1 << bits);
        while low < high {
            let middle = (low + high) / 2;
            if beyond(middle) { high = middle } else { low = middle + 1 }
        }
        // Euler's series is atan(t) = t/(1+t^2) (1 + 2/3 u (1 + 4/5 u (1 + ...))) with u = t^2/(1+t^2), here within
        // 2^-50.
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

/// Compares quarter and interpolated words with those of the data sheet, made from exact sines.
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
            // The phase is scaled to steps of the quarter, with four quarters per turn.
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
                // The size is interpolated between the two words with their weights, and rounded half up.
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
