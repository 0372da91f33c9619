//! Narrowing compared with exact rational arithmetic: every small value, every rounding, both kinds of overflow.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding};
use proptest::prelude::*;

/// Returns the integer that a rounding chooses for `value / unit`, by the rounding's definition in words.
fn rounded(value: i128, unit: i128, rounding: Rounding) -> i128 {
    let below = value.div_euclid(unit);
    if below * unit == value {
        return below;
    }
    let above = below + 1;
    // Twice the distance to the neighbour below, compared with one unit, tells which neighbour is nearer.
    let nearer = (2 * (value - below * unit)).cmp(&unit);
    let nearest = |tie: i128| match nearer {
        std::cmp::Ordering::Less => below,
        std::cmp::Ordering::Equal => tie,
        std::cmp::Ordering::Greater => above,
    };
    match rounding {
        Rounding::Truncate => below,
        Rounding::TowardZero => {
            if value < 0 {
                above
            } else {
                below
            }
        }
        Rounding::NearestUp => nearest(above),
        Rounding::NearestDown => nearest(below),
        Rounding::NearestAway => nearest(if value < 0 { below } else { above }),
        Rounding::NearestInward => nearest(if value < 0 { above } else { below }),
        Rounding::NearestEven => nearest(if below % 2 == 0 { below } else { above }),
        Rounding::NearestOdd => nearest(if below % 2 == 0 { above } else { below }),
    }
}

/// Returns the word and its lost bits, by search among the values of the word.
fn narrowed(value: i128, from_frac: i32, to: Format, rounding: Rounding, overflow: Overflow) -> Narrowed {
    let (width, drop) = (to.width(), from_frac - to.frac());
    let (least, most) =
        if to.is_signed() { (-(1i128 << (width - 1)), (1i128 << (width - 1)) - 1) } else { (0, (1i128 << width) - 1) };
    let (scaled, inexact) = if drop >= 0 {
        let unit = 1i128 << drop;
        (rounded(value, unit, rounding), value % unit != 0)
    } else {
        (value * (1i128 << -drop), false)
    };
    let word = match overflow {
        Overflow::Saturate => scaled.clamp(least, most),
        Overflow::Wrap => least + (scaled - least).rem_euclid(1i128 << width),
    };
    Narrowed { word: i64::try_from(word).unwrap(), rounded: inexact, overflowed: !(least..=most).contains(&scaled) }
}

#[test]
fn every_small_value_is_narrowed_as_rational_arithmetic_says() {
    for signed in [false, true] {
        for width in 1..=5 {
            for frac in -3..=4 {
                let to = Format::new(signed, width - i32::from(signed) - frac, frac).unwrap();
                for rounding in Rounding::ALL {
                    for overflow in Overflow::ALL {
                        let rule = Narrowing { from_frac: 2, to, rounding, overflow };
                        for value in -600..600 {
                            assert_eq!(
                                rule.apply(value),
                                narrowed(value, 2, to, rounding, overflow),
                                "{value}/4 into {to}, {rounding:?}, {overflow:?}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// The table of the rounding modes in the README of en_cl_fix (github.com/enclustra/en_cl_fix): what -1.5, -0.5, 0.5
/// and 1.5 become. Of other values it says that truncation is `floor(x)` and that all other modes are `floor(x + 0.5)`.
const BY_EN_CL_FIX: [(&str, Rounding, [i128; 4]); 7] = [
    ("Trunc_s", Rounding::Truncate, [-2, -1, 0, 1]),
    ("NonSymPos_s", Rounding::NearestUp, [-1, 0, 1, 2]),
    ("NonSymNeg_s", Rounding::NearestDown, [-2, -1, 0, 1]),
    ("SymInf_s", Rounding::NearestAway, [-2, -1, 1, 2]),
    ("SymZero_s", Rounding::NearestInward, [-1, 0, 0, 1]),
    ("ConvEven_s", Rounding::NearestEven, [-2, 0, 0, 2]),
    ("ConvOdd_s", Rounding::NearestOdd, [-1, -1, 1, 1]),
];

/// Returns `value / 2^drop` as that table and its text say. A tie is treated as the one of the table that has its sign,
/// and that lies above an even number as it does, or above an odd one.
fn by_en_cl_fix((mode, _, ties): (&str, Rounding, [i128; 4]), value: i128, drop: u32) -> i128 {
    let (unit, floor) = (1i128 << drop, value >> drop);
    let rest = value - floor * unit;
    if mode == "Trunc_s" || rest == 0 {
        return floor;
    } else if 2 * rest != unit {
        return (2 * value + unit).div_euclid(2 * unit);
    }
    let place = match (value < 0, floor % 2 == 0) {
        (true, true) => 0,
        (true, false) => 1,
        (false, true) => 2,
        (false, false) => 3,
    };
    let floors = [-2, -1, 0, 1];
    floor + ties[place] - floors[place]
}

/// Returns the word of a number in this format: clamped by `Sat_s`, else with its upper bits discarded (`None_s`).
fn fitted(number: i128, to: Format, overflow: Overflow) -> i128 {
    let bits = to.width();
    let (least, most) =
        if to.is_signed() { (-(1i128 << (bits - 1)), (1i128 << (bits - 1)) - 1) } else { (0, (1i128 << bits) - 1) };
    match overflow {
        Overflow::Saturate => number.max(least).min(most),
        Overflow::Wrap if number & (1 << (bits - 1)) != 0 && to.is_signed() => (number & most) + least,
        Overflow::Wrap => number & most,
    }
}

#[test]
fn every_word_of_up_to_6_bits_is_narrowed_into_every_narrower_format_as_by_en_cl_fix() {
    let formats = |frac: i32, most_int: i32| {
        let of = move |signed: bool| {
            (1..=6).filter_map(move |width| Format::new(signed, width - i32::from(signed) - frac, frac).ok())
        };
        of(false).chain(of(true)).filter(move |format| format.int() <= most_int)
    };
    let mut narrowed = 0;
    for from_frac in [-2, 0, 3, 6] {
        for from in formats(from_frac, 64) {
            for to in (from_frac - 7..=from_frac).flat_map(|frac| formats(frac, from.int())) {
                for (mode, overflow) in BY_EN_CL_FIX.iter().flat_map(|mode| Overflow::ALL.map(|one| (mode, one))) {
                    let rule = Narrowing { from_frac, to, rounding: mode.1, overflow };
                    for value in from.min()..=from.max() {
                        let whole = by_en_cl_fix(*mode, value, (from_frac - to.frac()).unsigned_abs());
                        let word = to.value(rule.apply(value).word);
                        assert_eq!(word, fitted(whole, to, overflow), "{value} of {from} into {to}, {}", mode.0);
                        narrowed += 1;
                    }
                }
            }
        }
    }
    assert!(narrowed > 400_000, "{narrowed}");
}

proptest! {
    #[test]
    fn wide_values_are_narrowed_as_rational_arithmetic_says(
        value in -(1i128 << 100)..1i128 << 100,
        shift in 0u32..100,
        from_frac in 0i32..60,
        frac in 0i32..60,
        width in 1i32..64,
        rounding in prop::sample::select(&Rounding::ALL[..]),
        overflow in prop::sample::select(&Overflow::ALL[..]),
    ) {
        let value = value / (1i128 << shift);
        prop_assume!(from_frac >= frac || value.abs() < 1 << 60);
        let to = Format::new(true, width - 1 - frac, frac).unwrap();
        let got = Narrowing { from_frac, to, rounding, overflow }.apply(value);
        prop_assert_eq!(got, narrowed(value, from_frac, to, rounding, overflow));
    }
}

#[test]
fn dropping_more_bits_than_any_value_has_leaves_its_sign_at_most() {
    for drop in [126, 127, 150, 191] {
        for value in [1, -1, (1i128 << 125) - 1, -(1i128 << 125) + 1] {
            for rounding in Rounding::ALL {
                let floor = if rounding == Rounding::Truncate && value < 0 { -1 } else { 0 };
                assert_eq!(rounding.shift(value, drop), floor, "{value} / 2^{drop}, {rounding:?}");
            }
        }
    }
}

#[test]
fn products_of_the_widest_words_are_rounded_though_127_bits_are_dropped() {
    let halves = i128::from(i64::MIN) * i128::from(i64::MIN); // one half of 2^127
    let nearly_one = i128::from(u64::MAX) * i128::from(i64::MIN); // 2^127 (2^-64 - 1)
    // The expected values are for Truncate, TowardZero, and Nearest Up, Down, Away, Inward, Even and Odd.
    for (value, expected) in [
        (halves, [0, 0, 1, 0, 1, 0, 0, 1]),
        (-halves, [-1, 0, 0, -1, -1, 0, 0, -1]),
        (nearly_one, [-1, 0, -1, -1, -1, -1, -1, -1]),
    ] {
        assert_eq!(Rounding::ALL.map(|rounding| rounding.shift(value, 127)), expected, "{value}");
    }
}

#[test]
fn the_widest_words_saturate_at_their_ends_and_wrap_round_them() {
    let apply =
        |to, overflow, value| Narrowing { from_frac: 0, to, rounding: Rounding::Truncate, overflow }.apply(value).word;
    let (signed, unsigned) = (Format::signed(64), Format::unsigned(64));
    assert_eq!(apply(signed, Overflow::Saturate, 1 << 63), i64::MAX);
    assert_eq!(apply(signed, Overflow::Wrap, 1 << 63), i64::MIN);
    // The expected words are the bit pattern of 2^64 - 1, and 2^64 + 5 modulo 2^64.
    assert_eq!(apply(unsigned, Overflow::Saturate, 1 << 64), -1);
    assert_eq!(apply(unsigned, Overflow::Wrap, (1 << 64) + 5), 5);
    assert_eq!(apply(unsigned, Overflow::Saturate, -1), 0);
}
