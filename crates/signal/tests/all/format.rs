//! Formats: the values that they hold, their text, and the formats that are refused.

use hpu_signal::{Format, FormatError};

/// Returns every possible format.
fn all() -> impl Iterator<Item = Format> {
    let triples =
        [false, true].into_iter().flat_map(|s| (-63..=64).flat_map(move |i| (-63..=64).map(move |f| (s, i, f))));
    triples.filter_map(|(s, i, f)| Format::new(s, i, f).ok())
}

#[test]
fn every_format_is_read_back_as_it_is_written() {
    for format in all() {
        assert_eq!(format.to_string().parse(), Ok(format));
        let spaced = format.to_string().replace(',', " , ");
        assert_eq!(spaced.parse(), Ok(format));
    }
}

#[test]
fn a_format_is_refused_exactly_when_its_width_is_not_1_to_64() {
    for signed in [false, true] {
        for int in -63..=64 {
            for frac in -63..=64 {
                let width = i32::from(signed) + int + frac;
                let format = Format::new(signed, int, frac);
                assert_eq!(format.is_ok(), (1..=64).contains(&width), "({signed},{int},{frac})");
                if let Ok(format) = format {
                    let parts = (format.is_signed(), format.int(), format.frac(), format.width());
                    assert_eq!(parts, (signed, int, frac, width.unsigned_abs()));
                }
            }
        }
    }
}

#[test]
fn a_refusal_says_what_would_be_accepted() {
    let refused = |text: &str| text.parse::<Format>().unwrap_err().to_string();
    assert_eq!(refused("(1,40,24)"), "format (1,40,24) has 65 bits; a word has 1 to 64");
    assert_eq!(refused("(0,0,0)"), "format (0,0,0) has 0 bits; a word has 1 to 64");
    for text in ["(2,3,4)", "1,9,22", "(1,9)", "(1,9,22,0)", "(1,nine,22)", "", "()"] {
        let message = format!(
            "`{text}` is not a format; write (S,I,F): sign bit 0 or 1, integer bits, fraction bits, as in (1,9,22); \
             or UQ4.8, Q4.8 (as TI writes it: the sign bit is not among the 4), ufix12_En8, sfix16_En12, \
             ufixed(3 downto -8), ap_ufixed<12,4>"
        );
        assert_eq!(refused(text), message);
    }
    let far = Format::new(false, i32::MAX, i32::MAX).unwrap_err();
    assert_eq!(far, FormatError::Width { asked: (false, i32::MAX, i32::MAX) });
    assert!(far.to_string().contains("has 4294967294 bits"));
}

#[test]
fn the_ends_of_every_word_survive_the_way_to_bits_and_back() {
    for format in all() {
        let (least, most) = (format.min(), format.max());
        assert_eq!(most - least, (1i128 << format.width()) - 1);
        for value in [least, most, 0, least / 2, most / 2] {
            let word = format.wrap(value);
            assert_eq!(format.value(word), value, "{format}");
            assert_eq!(format.from_bits(format.bits(word)), word);
            assert!(format.holds(value));
        }
        assert!(!format.holds(most + 1) && !format.holds(least - 1));
        assert_eq!(format.wrap(most + 1), format.wrap(least));
    }
}

#[test]
fn the_least_significant_bit_is_worth_a_power_of_two() {
    for format in all() {
        let lsb = 2f64.powi(-format.frac());
        assert_eq!(format.lsb(), lsb);
        let least = format.wrap(format.min());
        let expected = if format.is_signed() { -(2f64.powi(format.int())) } else { 0.0 };
        assert_eq!(format.to_f64(least), expected, "{format}");
    }
}

#[test]
fn a_product_s_format_holds_every_product() {
    for a in (1..=12).flat_map(|width| [Format::unsigned(width), Format::signed(width)]) {
        for b in (1..=12).flat_map(|width| [Format::unsigned(width), Format::signed(width)]) {
            let product = a.product(b).unwrap();
            assert_eq!(product.width(), a.width() + b.width());
            for x in [a.min(), a.max()] {
                for y in [b.min(), b.max()] {
                    assert!(product.holds(x * y), "{a} * {b} in {product}");
                }
            }
        }
    }
    let (q22, fine): (Format, Format) = ("(1,9,22)".parse().unwrap(), "(0,1,31)".parse().unwrap());
    assert_eq!(q22.product(fine).unwrap().to_string(), "(1,10,53)");
    assert!(q22.product(Format::unsigned(33)).is_err());
}
