//! The multiplier compared with exact integers: products of 12 x 12 bits, in every mode and signedness. Those of
//! unsigned words are all compared here; of signed ones every seventh factor, and all in `testbench/long.sh`.

use hpu_datapath::TruncatingMultiplier;
use hpu_datapath::truncating_multiplier::In;
use hpu_signal::{Format, Overflow, Rounding};

use crate::oracle::rounded;

/// A multiplier, the bits of the exact product that it keeps, and its treatment of values out of range.
struct Mode {
    block: TruncatingMultiplier,
    drop: u32,
    width: u32,
    saturate: bool,
}

/// Asserts that products agree with exact integers, which use no format: of every `nth` first factor with all second
/// ones.
fn holds(mode: &Mode, a_signed: bool, b_signed: bool, nth: usize) {
    let range = |signed| if signed { -2048..2048 } else { 0..4096 };
    let (low, high) = if a_signed || b_signed {
        (-(1i64 << (mode.width - 1)), (1i64 << (mode.width - 1)) - 1)
    } else {
        (0, (1i64 << mode.width) - 1)
    };
    let (unit, span) = (1i64 << mode.drop, 1i64 << mode.width);
    for a in range(a_signed).step_by(nth) {
        for b in range(b_signed) {
            let exact: i64 = a * b;
            let floor = exact.div_euclid(unit);
            let overflowed = floor < low || floor > high;
            let word = match (overflowed, mode.saturate) {
                (false, _) => floor,
                (true, true) => floor.clamp(low, high),
                (true, false) => (floor - low).rem_euclid(span) + low,
            };
            let got = mode.block.eval(In { a, b });
            let lost = (exact.rem_euclid(unit) != 0, overflowed);
            assert_eq!(
                (got.word, got.rounded, got.overflowed),
                (word, lost.0, lost.1),
                "{a} * {b}, {} bits from bit {}",
                mode.width,
                mode.drop
            );
        }
    }
}

#[test]
fn every_small_product_is_rounded_in_every_way() {
    for (a_signed, b_signed) in [(false, false), (true, false), (true, true)] {
        let word = |signed: bool| Format::new(signed, 2, 3 - i32::from(signed)).unwrap();
        let (a, b) = (word(a_signed), word(b_signed));
        let signed = a_signed || b_signed;
        for (rounding, frac) in Rounding::ALL.into_iter().flat_map(|one| [1, 0, -2].map(|frac| (one, frac))) {
            for overflow in Overflow::ALL {
                let to = Format::new(signed, 4 - i32::from(signed) - frac, frac).unwrap();
                let block = TruncatingMultiplier::new(a, b, to, overflow).unwrap().rounding(rounding);
                let (unit, span) = (1i128 << (a.frac() + b.frac() - frac), 16i128);
                let low = if signed { -8 } else { 0 };
                let words = |format: Format| (format.min() as i64)..=(format.max() as i64);
                for (a, b) in words(a).flat_map(|x| words(b).map(move |y| (x, y))) {
                    let whole = rounded((a * b).into(), unit, rounding);
                    let word = match overflow {
                        Overflow::Saturate => whole.clamp(low, low + span - 1),
                        Overflow::Wrap => (whole - low).rem_euclid(span) + low,
                    };
                    let got = block.eval(In { a, b });
                    assert_eq!(i128::from(got.word), word, "{a} * {b} into {to}, {rounding:?}, {overflow:?}");
                }
            }
        }
    }
}

fn every_mode(a_signed: bool, b_signed: bool, nth: usize) {
    let integer = |signed| {
        if signed { Format::signed(12) } else { Format::unsigned(12) }
    };
    let (a, b) = (integer(a_signed), integer(b_signed));
    let signed = a_signed || b_signed;
    let fraction = |signed: bool| Format::new(signed, 8 - i32::from(signed), 4).unwrap();
    let modes = [
        Mode { block: TruncatingMultiplier::full(a, b).unwrap(), drop: 0, width: 24, saturate: false },
        Mode { block: TruncatingMultiplier::drop_upper(a, b, 12).unwrap(), drop: 0, width: 12, saturate: false },
        Mode { block: TruncatingMultiplier::drop_lower(a, b, 12).unwrap(), drop: 12, width: 12, saturate: false },
        Mode {
            block: TruncatingMultiplier::saturate(a, b, integer(signed)).unwrap(),
            drop: 0,
            width: 12,
            saturate: true,
        },
        Mode {
            block: TruncatingMultiplier::saturate(fraction(a_signed), fraction(b_signed), integer(signed)).unwrap(),
            drop: 8,
            width: 12,
            saturate: true,
        },
        Mode {
            block: TruncatingMultiplier::new(
                fraction(a_signed),
                fraction(b_signed),
                if signed { Format::signed(10) } else { Format::unsigned(10) },
                Overflow::Wrap,
            )
            .unwrap(),
            drop: 8,
            width: 10,
            saturate: false,
        },
    ];
    for mode in &modes {
        holds(mode, a_signed, b_signed, nth);
    }
}

#[test]
fn all_unsigned_products_are_exact_integers_narrowed() {
    every_mode(false, false, 1);
}

/// 4095 is a multiple of 7: the least and the greatest first factor are among them.
#[test]
fn signed_and_mixed_products_are_exact_integers_narrowed() {
    every_mode(true, false, 7);
    every_mode(true, true, 7);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn all_signed_and_mixed_products_are_exact_integers_narrowed() {
    every_mode(true, false, 1);
    every_mode(true, true, 1);
}

#[test]
fn the_widest_words_have_exact_products() {
    let half = |int| Format::new(true, int, 31).unwrap();
    let (a, b) = (half(32), half(30));
    let top = TruncatingMultiplier::drop_lower(a, b, 64).unwrap();
    // -2^63 * -2^61 = 2^124; bits 62 and up are kept.
    assert_eq!(top.eval(In { a: i64::MIN, b: -(1 << 61) }).word, 1 << 62);
    // An unsigned 64-bit word is passed as its bit pattern: (2^64 - 1) * 3, wrapped to 64 bits.
    let low = TruncatingMultiplier::drop_upper(Format::unsigned(64), Format::unsigned(62), 64).unwrap();
    let product = low.eval(In { a: -1, b: 3 });
    assert_eq!((product.word, product.overflowed), (-3, true));
}

#[test]
fn impossible_multipliers_are_refused_with_what_is_accepted() {
    let (u, s) = (Format::unsigned(12), Format::signed(12));
    let refused = |made: Result<_, hpu_datapath::ConfigError>| made.unwrap_err().to_string();
    assert_eq!(
        refused(TruncatingMultiplier::drop_upper(Format::unsigned(64), Format::unsigned(64), 64)),
        "truncating_multiplier: A_WIDTH + B_WIDTH is 128; accepted: 4 to 126"
    );
    assert_eq!(
        refused(TruncatingMultiplier::saturate(u, s, u)),
        "truncating_multiplier: the product of (0,12,0) and (1,11,0) is (0,12,0); \
         accepted: signed if either factor is, else unsigned"
    );
    assert_eq!(
        refused(TruncatingMultiplier::saturate(u, u, Format::new(false, 8, 4).unwrap())),
        "truncating_multiplier: the product of (0,12,0) and (0,12,0) is (0,8,4); \
         accepted: at most 0 fraction bits"
    );
    assert_eq!(
        refused(TruncatingMultiplier::full(Format::unsigned(40), Format::unsigned(40))),
        "truncating_multiplier: OUT_WIDTH is 80; accepted: 2 to 64"
    );
    assert_eq!(
        refused(TruncatingMultiplier::drop_lower(u, u, 25)),
        "truncating_multiplier: OUT_WIDTH is 25; accepted: 2 to 24"
    );
    assert_eq!(
        refused(TruncatingMultiplier::full(Format::BIT, u)),
        "truncating_multiplier: A_WIDTH is 1; accepted: 2 to 64"
    );
}
