//! The sequential divider, the square root and the second-order section, compared with exact integers.

use hpu_datapath::{Biquad, BiquadConfig, Block, DividerConfig, SequentialDivider, SquareRoot};
use hpu_datapath::{biquad, sequential_divider, square_root};
use hpu_signal::{Format, Rounding};
use proptest::prelude::*;

use crate::cases::cases;
use crate::oracle::rounded;

fn divider(num_width: u32, den_width: u32, frac: u32, out_width: u32) -> SequentialDivider {
    SequentialDivider::new(DividerConfig { num_width, den_width, frac, out_width }).unwrap()
}

/// Runs a division to its end and returns the quotient. Asserts that busy and ready follow the data sheet meanwhile.
fn divide(block: &mut SequentialDivider, num: i64, den: i64, steps: u32) -> i64 {
    let before = block.tick(sequential_divider::In { start: 1, num, den });
    assert_eq!((before.busy, before.ready), (1, 0));
    // The operands have been captured, so later operands must have no effect.
    let idle = sequential_divider::In { start: 0, num: 1, den: 1 };
    for _ in 1..steps {
        assert_eq!(block.tick(idle), before);
    }
    let out = block.tick(idle);
    assert_eq!((out.busy, out.ready), (0, 1));
    assert_eq!(block.tick(idle), sequential_divider::Out { ready: 0, ..out });
    out.quotient
}

/// Whether `quotient` satisfies the definition of the clamped floor; this is tested without a division.
fn is_quotient(quotient: i64, num: i64, den: i64, frac: u32, out_width: u32) -> bool {
    let (quotient, den) = (i128::from(quotient), i128::from(den));
    let (dividend, most) = (i128::from(num) << frac, (1i128 << out_width) - 1);
    let below = quotient * den <= dividend;
    let next_above = (quotient + 1) * den > dividend;
    if quotient == most { below || den == 0 } else { below && next_above && den > 0 }
}

#[test]
fn every_small_division_is_floored_and_clamped() {
    for (num_width, den_width) in [(2, 2), (4, 3), (3, 5), (6, 4)] {
        for frac in 0..4 {
            for out_width in 2..=num_width + frac {
                let mut block = divider(num_width, den_width, frac, out_width);
                for num in 0..1 << num_width {
                    for den in 0..1 << den_width {
                        let quotient = divide(&mut block, num, den, num_width + frac);
                        assert!(is_quotient(quotient, num, den, frac, out_width), "{num} / {den} = {quotient}");
                        let (rounded, dividend) = (block.latest().rounded, num << frac);
                        assert_eq!(rounded, den > 0 && dividend % den != 0, "{num} / {den}");
                        let overflows = den == 0 || dividend >= den << out_width;
                        assert_eq!(block.latest().overflowed, overflows, "{num} / {den}");
                    }
                }
            }
        }
    }
}

/// Returns a word of up to `width` bits; small words are as likely as large ones.
fn word(width: u32) -> impl Strategy<Value = i64> {
    (0..=width, any::<u64>()).prop_map(|(width, bits)| (u128::from(bits) & ((1 << width) - 1)) as i64)
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn wide_divisions_are_floored_and_clamped(
        num in word(48), den in word(32), frac in 0u32..15, narrower in 0u32..40
    ) {
        let out_width = 48 + frac - narrower;
        let quotient = divide(&mut divider(48, 32, frac, out_width), num, den, 48 + frac);
        prop_assert!(is_quotient(quotient, num, den, frac, out_width), "{}", quotient);
    }

    #[test]
    fn wide_roots_are_floored(x in word(62), near in -1i64..2, square in any::<bool>()) {
        // Floors of roots go wrong at squares and at their neighbours.
        let root = x & 0x7fff_ffff;
        let x = if square { (root * root + near).max(0) } else { x };
        prop_assert!(is_root(extract(&mut SquareRoot::new(62).unwrap(), x, 31), x));
    }
}

#[test]
fn a_start_gives_up_the_division_under_way_even_on_its_last_edge() {
    let mut block = divider(4, 3, 2, 6);
    assert_eq!(divide(&mut block, 12, 4, 6), 12);
    for passed in 1..=6 {
        block.tick(sequential_divider::In { start: 1, num: 15, den: 1 });
        for _ in 1..passed {
            let out = block.tick(sequential_divider::In { start: 0, num: 0, den: 0 });
            assert_eq!((out.quotient, out.busy, out.ready), (12, 1, 0));
        }
        assert_eq!(divide(&mut block, 12, 4, 6), 12, "given up on edge {passed}");
    }
}

/// Runs an extraction to its end and returns the root.
fn extract(block: &mut SquareRoot, x: i64, steps: u32) -> i64 {
    let before = block.tick(square_root::In { start: 1, x });
    assert_eq!((before.busy, before.ready), (1, 0));
    let idle = square_root::In { start: 0, x: 1 };
    for _ in 1..steps {
        assert_eq!(block.tick(idle), before);
    }
    let out = block.tick(idle);
    assert_eq!((out.busy, out.ready), (0, 1));
    assert_eq!(block.tick(idle), square_root::Out { ready: 0, ..out });
    out.root
}

fn is_root(root: i64, x: i64) -> bool {
    let (root, x) = (i128::from(root), i128::from(x));
    root * root <= x && x < (root + 1) * (root + 1)
}

#[test]
fn every_root_of_up_to_16_bits_is_floored() {
    for width in (4..=16).step_by(2) {
        let mut block = SquareRoot::new(width).unwrap();
        for x in 0..1 << width {
            let root = extract(&mut block, x, width / 2);
            assert!(is_root(root, x), "root of {x} = {root}");
            assert_eq!(block.latest().rounded, root * root != x);
        }
    }
}

#[test]
fn widths_beyond_the_data_sheet_are_refused() {
    for (num_width, den_width, frac, out_width) in
        [(1, 2, 0, 2), (49, 2, 0, 2), (4, 1, 0, 2), (4, 33, 0, 2), (40, 2, 17, 2), (47, 2, 16, 2), (4, 2, 2, 7)]
    {
        let config = DividerConfig { num_width, den_width, frac, out_width };
        assert!(SequentialDivider::new(config).is_err(), "{config:?}");
    }
    assert!([2, 5, 63, 64].into_iter().all(|width| SquareRoot::new(width).is_err()));
    let narrow = BiquadConfig { coefficient: Format::new(true, 0, 16).unwrap(), ..BiquadConfig::default() };
    assert!(Biquad::new(narrow).unwrap_err().to_string().contains("65536"));
}

/// The section in rational numbers over one denominator, `2^60`: it rounds to a unit of `y`, then clamps.
struct Rational {
    config: BiquadConfig,
    x: [i128; 2],
    y: [i128; 2],
}

impl Rational {
    fn new(config: BiquadConfig) -> Self {
        Self { config, x: [0; 2], y: [0; 2] }
    }

    fn sample(&mut self, x: i64) -> i64 {
        let BiquadConfig { input, output, coefficient, b, a, rounding, .. } = self.config;
        // Numerators over 2^60 of a product whose words have these fraction bits.
        let over = |product: i128, frac: i32| product * 2i128.pow((60 - coefficient.frac() - frac).unsigned_abs());
        let x = i128::from(x);
        let sum: i128 = [(b[0], x), (b[1], self.x[0]), (b[2], self.x[1])]
            .iter()
            .map(|&(word, x)| over(i128::from(word) * x, input.frac()))
            .chain([(a[0], self.y[0]), (a[1], self.y[1])].map(|(word, y)| -over(i128::from(word) * y, output.frac())))
            .sum();
        let unit = 2i128.pow((60 - output.frac()).unsigned_abs());
        let y = rounded(sum, unit, rounding).clamp(output.min(), output.max());
        self.x = [x, self.x[0]];
        self.y = [y, self.y[0]];
        y.try_into().unwrap()
    }
}

fn format(int: i32, frac: i32) -> Format {
    Format::new(true, int, frac).unwrap()
}

#[test]
fn every_short_history_of_a_small_section_is_that_of_the_rationals() {
    for (b, a) in [([5, -7, 3], [-13, 6]), ([1, 1, 1], [-8, 8]), ([-16, 15, -1], [15, -16])] {
        let config = BiquadConfig {
            input: format(1, 1),
            output: format(2, 2),
            coefficient: format(1, 3),
            b,
            a,
            ..BiquadConfig::default()
        };
        let mut block = Biquad::new(config).unwrap();
        for history in 0..1i64 << 15 {
            block.reset();
            let mut rational = Rational::new(config);
            for sample in 0..5 {
                let x = (history >> (3 * sample) & 7) - 4;
                assert_eq!(block.tick(biquad::In { x, period: 1 }).y, rational.sample(x), "history {history:o}");
            }
        }
    }
}

#[test]
fn every_short_history_of_a_small_section_is_rounded_in_every_way() {
    for rounding in Rounding::ALL {
        let [input, output, coefficient] = [(1, 1), (2, 1), (1, 3)].map(|(int, frac)| format(int, frac));
        let (b, a) = ([5, -7, 3], [-13, 6]);
        let config = BiquadConfig { input, output, coefficient, b, a, rounding, ..BiquadConfig::default() };
        let mut block = Biquad::new(config).unwrap();
        for history in 0..1i64 << 12 {
            block.reset();
            let mut rational = Rational::new(config);
            for sample in 0..4 {
                let x = (history >> (3 * sample) & 7) - 4;
                let y = block.tick(biquad::In { x, period: 1 }).y;
                assert_eq!(y, rational.sample(x), "{rounding:?}, history {history:o}");
            }
        }
    }
}

prop_compose! {
    fn section()(
        (in_frac, out_frac, coef_frac) in (0i32..20, 0i32..20, 0i32..21),
        (in_int, out_int, coef_int) in (1i32..20, 1i32..20, 1i32..11),
        words in prop::array::uniform5(any::<i64>()),
    ) -> BiquadConfig {
        let coefficient = format(coef_int, coef_frac);
        let [b0, b1, b2, a1, a2] = words.map(|word| coefficient.wrap(word.into()) as i32);
        BiquadConfig {
            input: format(in_int, in_frac),
            output: format(out_int, out_frac),
            coefficient,
            b: [b0, b1, b2],
            a: [a1, a2],
            ..BiquadConfig::default()
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn any_section_is_that_of_the_rationals(
        config in section(), xs in prop::collection::vec(any::<i64>(), 1..60), period in 0i64..4
    ) {
        let mut block = Biquad::new(config).unwrap();
        let mut rational = Rational::new(config);
        for x in xs {
            let x = config.input.wrap(x.into());
            let expected = rational.sample(x);
            prop_assert_eq!(block.tick(biquad::In { x, period }).y, expected);
            for other in 1..period {
                prop_assert_eq!(block.tick(biquad::In { x: other, period }).y, expected);
            }
        }
    }
}
