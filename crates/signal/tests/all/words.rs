//! Machine words of 64 bits compute the same as those of 128 bits, and stay within the computed reach.

use std::collections::HashMap;

use hpu_signal::{Defined, Format, Machine, Narrowing, Overflow, Reach, Rounding, Span, Term, Word};

/// Returns all formats of up to `most` bits, with fraction bits from -2 to two more than the width.
fn formats(most: i32) -> impl Iterator<Item = Format> {
    let all = (0..=1).flat_map(move |sign| {
        (1..=most).flat_map(move |width| (-2..=width + 2).map(move |frac| (sign == 1, width - sign - frac, frac)))
    });
    all.filter_map(|(signed, int, frac)| Format::new(signed, int, frac).ok())
}

#[test]
fn narrowing_in_64_bits_is_narrowing_in_128() {
    for to in formats(5) {
        for rounding in Rounding::ALL {
            for overflow in Overflow::ALL {
                for from_frac in to.frac() - 3..=to.frac() + 4 {
                    let rule = Narrowing { from_frac, to, rounding, overflow };
                    let mut least = i128::MAX;
                    let mut most = i128::MIN;
                    for value in -200i64..=200 {
                        let wide = Machine::exact(i128::from(value)).narrow(&rule).narrowed();
                        assert_eq!(Machine::exact(value).narrow(&rule).narrowed(), wide, "{value} by {rule:?}");
                        (least, most) = (least.min(to.value(wide.word)), most.max(to.value(wide.word)));
                    }
                    let reach = Reach::new(Span::new(-200, 200)).narrow(&rule);
                    assert!(Span::new(least, most).is_within(reach.range), "{rule:?}: {reach:?}");
                }
            }
        }
    }
}

/// Computes all operations that blocks use from three words.
fn made<W: Word>([a, b, c]: [W; 3], to: Format) -> [W; 4] {
    let sum = (a * b).shl(2) - c + W::int(5);
    let [chosen] = W::branch(a.above(b) & !b.equals(c), || [sum], || [-c]);
    [
        chosen.wrap(to),
        sum.lesser(c).greater(a),
        sum.limit(-7, 9).shr(1),
        W::of_bit(a.at_least(c) | b.is_set()) + a.wrap(Format::unsigned(2)).look_up(&[3, -8, 4, 0]),
    ]
}

#[test]
fn arithmetic_in_64_bits_is_arithmetic_in_128_within_its_reach() {
    let words = -8i64..8;
    let to = Format::signed(4);
    let reach = made([Reach::of(to); 3], to);
    for a in words.clone() {
        for b in words.clone() {
            for c in words.clone() {
                let narrow = made([a, b, c].map(Machine::<i64>::of), to).map(Machine::narrowed);
                assert_eq!(narrow, made([a, b, c].map(Machine::<i128>::of), to).map(Machine::narrowed));
                for (word, reach) in narrow.iter().zip(reach) {
                    assert!(Span::exact(word.word.into()).is_within(reach.range), "{a} {b} {c}");
                }
            }
        }
    }
    // Computed by hand: the lesser of the sum and c is at most 7, and the greater of that and a is at least -8.
    assert_eq!(reach[1].range, Span::new(-8, 7));
    assert!(Reach::fit_64(&reach));
    assert!(!Reach::fit_64(&[Reach::of(Format::signed(40)) * Reach::of(Format::signed(40))]));
}

#[test]
fn losses_add_up_and_can_be_shed() {
    let half =
        Narrowing { from_frac: 1, to: Format::signed(4), rounding: Rounding::Truncate, overflow: Overflow::Wrap };
    let [lost, whole] = [3, 4].map(|value| Machine::<i64>::exact(value).narrow(&half));
    let told = |word: Machine<i64>| (word.narrowed().word, word.narrowed().rounded, word.narrowed().overflowed);
    assert_eq!(told(lost), (1, true, false));
    assert_eq!(told(whole), (2, false, false));
    assert_eq!(told(lost + whole), (3, true, false));
    assert_eq!(told(lost.shed() * whole), (2, false, false));
    assert_eq!(told(Machine::exact(40).narrow(&half)), (4, false, true));
    assert_eq!(told(whole.overflowing(true).limit(-1, 1)), (1, false, true));
}

#[test]
fn a_proof_is_not_cut_at_a_net_that_is_narrower_than_its_number() {
    let number = || Term::of_bits(Format::unsigned(4), "x") + Term::int(1);
    // The number is from 1 to 16, which takes six bits with a sign.
    for (width, names) in [(6, vec!["net"]), (5, vec![])] {
        let cuts = HashMap::from([("net".to_string(), "n".to_string())]);
        let Defined { built, cuts, .. } = Term::defined(cuts, || number().cut("net", width));
        assert_eq!(cuts.iter().map(|(name, ..)| name.as_str()).collect::<Vec<_>>(), names);
        // If the number is not cut, its low bits are taken from the number itself.
        assert_eq!(built.bits(width).contains("extract"), width == 5, "{}", built.bits(width));
    }
}
