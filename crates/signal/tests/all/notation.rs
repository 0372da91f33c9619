//! What each notation says, read back as its own standard defines it, is the format again.

use hpu_signal::{Format, Notation};

/// Sign, place of the most significant bit, place of the least significant one: all that a fixed-point type says. The place
/// of a bit is the power of two that it is worth.
type Places = (bool, i32, i32);

fn places(format: Format) -> Places {
    let low = -format.frac();
    (format.is_signed(), low + format.width() as i32 - 1, low)
}

/// Every format there is.
fn formats() -> impl Iterator<Item = Format> {
    let sides = [false, true].into_iter().flat_map(|signed| (-63..=64).map(move |int| (signed, int)));
    sides.flat_map(|(signed, int)| (-63..=64).filter_map(move |frac| Format::new(signed, int, frac).ok()))
}

/// The text between two others, as numbers divided by a third.
fn numbers(text: &str, before: &str, between: &str, after: &str) -> Option<(i32, i32)> {
    let inner = text.strip_prefix(before)?.strip_suffix(after)?;
    let (first, second) = inner.split_once(between)?;
    Some((first.parse().ok()?, second.parse().ok()?))
}

#[test]
fn vhdl_indexes_bits_by_what_they_are_worth() {
    for format in formats() {
        let text = Notation::Vhdl.of(format);
        let signed = numbers(&text, "sfixed(", " downto ", ")").map(|(high, low)| (true, high, low));
        let unsigned = numbers(&text, "ufixed(", " downto ", ")").map(|(high, low)| (false, high, low));
        assert_eq!(signed.or(unsigned), Some(places(format)), "{text}");
    }
}

#[test]
fn ap_fixed_counts_the_sign_bit_among_the_integer_bits() {
    for format in formats() {
        let text = Notation::Cpp.of(format);
        // The binary point of W bits is I bits below the top.
        let read = |(width, int): (i32, i32)| (int - 1, int - width);
        let signed = numbers(&text, "ap_fixed<", ",", ">").map(read).map(|(high, low)| (true, high, low));
        let unsigned = numbers(&text, "ap_ufixed<", ",", ">").map(read).map(|(high, low)| (false, high, low));
        assert_eq!(signed.or(unsigned), Some(places(format)), "{text}");
    }
}

#[test]
fn q_notation_names_the_width_and_both_readings_of_the_sign_bit() {
    for format in formats() {
        let text = Notation::Q.of(format);
        let width = format.width() as i32;
        let bits = if width == 1 { "bit" } else { "bits" };
        let read = |part: &str, prefix: &str, suffix: &str| {
            numbers(part, prefix, ".", &format!(" ({width} {bits}{suffix})")).expect("the form of Q notation")
        };
        if let Some((ti, arm)) = text.split_once(" = ") {
            let ((ti_int, ti_frac), (arm_int, arm_frac)) = (read(ti, "Q", ", TI"), read(arm, "Q", ", ARM"));
            assert_eq!((1 + ti_int + ti_frac, arm_int + arm_frac), (width, width), "{text}");
            // The range is -2^m to 2^m for TI, whose sign bit is above the m integer bits.
            assert_eq!((true, ti_int, -ti_frac), places(format), "{text}");
            assert_eq!((true, arm_int - 1, -arm_frac), places(format), "{text}");
        } else {
            let (int, frac) = read(&text, "UQ", "");
            assert_eq!(int + frac, width, "{text}");
            assert_eq!((false, int - 1, -frac), places(format), "{text}");
        }
    }
}

#[test]
fn words_whose_point_lies_outside_of_them_are_written_with_negative_numbers() {
    let told = |text: &str| {
        let format = text.parse().expect("a format");
        Notation::ALL.map(|notation| notation.of(format)).join("; ")
    };
    let below = "(1,-3,10); sfixed(-3 downto -10); ap_fixed<8,-2>; Q-3.10 (8 bits, TI) = Q-2.10 (8 bits, ARM)";
    assert_eq!(told("(1,-3,10)"), below);
    assert_eq!(told("(0,12,-4)"), "(0,12,-4); ufixed(11 downto 4); ap_ufixed<8,12>; UQ12.-4 (8 bits)");
    assert_eq!(told("(0,1,0)"), "(0,1,0); ufixed(0 downto 0); ap_ufixed<1,1>; UQ1.0 (1 bit)");
}
