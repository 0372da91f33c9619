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

/// Returns `value / 2^drop`, rounded as the documents of en_cl_fix say: a constant is added that depends on the mode,
/// on the sign and on the least significant bit that is kept, then the lower bits are dropped.
fn by_en_cl_fix(mode: &str, value: i128, drop: u32) -> i128 {
    let (half, lsb) = (1i128 << drop >> 1, 1);
    let (is_negative, is_even) = (value < 0, (value >> drop) & 1 == 0);
    let less_when = |less: bool| if less { half - lsb } else { half };
    let added = match mode {
        "Trunc_s" => 0,
        "NonSymPos_s" => half,
        "NonSymNeg_s" => half - lsb,
        "SymInf_s" => less_when(is_negative),
        "SymZero_s" => less_when(!is_negative),
        "ConvEven_s" => less_when(is_even),
        "ConvOdd_s" => less_when(!is_even),
        _ => panic!("{mode}"),
    };
    (value + added) >> drop
}

#[test]
fn roundings_are_those_of_en_cl_fix() {
    let names = [
        (Rounding::Truncate, "Trunc_s"),
        (Rounding::NearestUp, "NonSymPos_s"),
        (Rounding::NearestDown, "NonSymNeg_s"),
        (Rounding::NearestAway, "SymInf_s"),
        (Rounding::NearestInward, "SymZero_s"),
        (Rounding::NearestEven, "ConvEven_s"),
        (Rounding::NearestOdd, "ConvOdd_s"),
    ];
    for (rounding, name) in names {
        for drop in 1..7 {
            for value in -600..600 {
                let expected = by_en_cl_fix(name, value, drop);
                assert_eq!(rounding.shift(value, drop), expected, "{value} / 2^{drop}, {name}");
            }
        }
    }
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
