//! The run-time formats compared with the `fixed` crate, whose formats are known when the program is compiled.

use fixed::types::{I4F4, I4F12, I12F20, I20F12, I32F32, U4F4, U4F12, U12F20, U20F12};
use hpu_signal::{Format, Narrowing, Overflow, Rounding};
use proptest::prelude::*;

/// Returns the rule that narrows a value of format `(1,31,32)`.
fn rule(to: Format, rounding: Rounding, overflow: Overflow) -> Narrowing {
    Narrowing { from_frac: 32, to, rounding, overflow }
}

/// Narrows `value` to one type of `fixed` by its own conversions, which truncate; asserts equal words and overflow.
macro_rules! agrees_with {
    ($fixed:ty, $signed:expr, $int:expr, $frac:expr, $value:expr) => {{
        let value: I32F32 = $value;
        let to = Format::new($signed, $int - i32::from($signed), $frac).unwrap();
        let exact = i128::from(value.to_bits());
        let wrapped = rule(to, Rounding::Truncate, Overflow::Wrap).apply(exact);
        let (expected, overflowed) = <$fixed>::overflowing_from_num(value);
        prop_assert_eq!(wrapped.word, i64::from(expected.to_bits()));
        prop_assert_eq!(wrapped.overflowed, overflowed);
        let saturated = rule(to, Rounding::Truncate, Overflow::Saturate).apply(exact);
        prop_assert_eq!(saturated.word, i64::from(<$fixed>::saturating_from_num(value).to_bits()));
        if !overflowed {
            prop_assert_eq!(wrapped.rounded, value != expected.to_num::<I32F32>());
            prop_assert_eq!(to.to_f64(wrapped.word), expected.to_num::<f64>());
        }
    }};
}

/// Returns values of every size, and values close to a step of the narrow words.
fn values() -> impl Strategy<Value = I32F32> {
    let near = (-40i64..40, 0u32..62, -2i64..3).prop_map(|(step, shift, off)| (step << shift).wrapping_add(off));
    prop_oneof![any::<i64>(), (any::<i64>(), 0u32..63).prop_map(|(bits, shift)| bits >> shift), near]
        .prop_map(I32F32::from_bits)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5000))]

    #[test]
    fn wrapping_and_saturating_conversions_are_those_of_fixed(value in values()) {
        agrees_with!(I20F12, true, 20, 12, value);
        agrees_with!(I12F20, true, 12, 20, value);
        agrees_with!(I4F12, true, 4, 12, value);
        agrees_with!(I4F4, true, 4, 4, value);
        agrees_with!(U20F12, false, 20, 12, value);
        agrees_with!(U12F20, false, 12, 20, value);
        agrees_with!(U4F12, false, 4, 12, value);
        agrees_with!(U4F4, false, 4, 4, value);
    }

    #[test]
    fn roundings_to_an_integer_are_those_of_fixed(value in values()) {
        let integer = Format::new(true, 31, 0).unwrap();
        let by = |rounding| {
            i128::from(rule(integer, rounding, Overflow::Wrap).apply(i128::from(value.to_bits())).word)
        };
        // The values are away from the ends, where the rounded value would not fit an I32F32.
        prop_assume!(value < I32F32::MAX - I32F32::ONE);
        prop_assert_eq!(by(Rounding::Truncate), value.floor().to_num::<i128>());
        prop_assert_eq!(by(Rounding::TowardZero), value.round_to_zero().to_num::<i128>());
        prop_assert_eq!(by(Rounding::NearestAway), value.round().to_num::<i128>());
        prop_assert_eq!(by(Rounding::NearestEven), value.round_ties_even().to_num::<i128>());
        let half_up = (value + I32F32::from_num(0.5)).floor();
        prop_assert_eq!(by(Rounding::NearestUp), half_up.to_num::<i128>());
    }

    #[test]
    fn a_widening_keeps_the_value_as_fixed_does(bits in any::<i16>()) {
        let narrow = I4F12::from_bits(bits);
        let to = Format::new(true, 31, 32).unwrap();
        let wide = Narrowing { from_frac: 12, to, rounding: Rounding::Truncate, overflow: Overflow::Wrap }
            .apply(i128::from(bits));
        prop_assert_eq!(wide.word, narrow.to_num::<I32F32>().to_bits());
        prop_assert!(!wide.rounded && !wide.overflowed);
    }
}
