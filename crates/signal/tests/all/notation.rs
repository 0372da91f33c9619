//! Each notation, read back as its own standard defines it, is the same format again.

use hpu_signal::{Format, Notation};

/// The sign, the place of the most significant bit, and the place of the least significant bit; these determine a
/// fixed-point type. The place of a bit is the power of two that the bit is worth.
type Places = (bool, i32, i32);

fn places(format: Format) -> Places {
    let low = -format.frac();
    (format.is_signed(), low + format.width() as i32 - 1, low)
}

/// Returns every possible format.
fn formats() -> impl Iterator<Item = Format> {
    let sides = [false, true].into_iter().flat_map(|signed| (-63..=64).map(move |int| (signed, int)));
    sides.flat_map(|(signed, int)| (-63..=64).filter_map(move |frac| Format::new(signed, int, frac).ok()))
}

/// Reads two numbers that stand between `before` and `after` and are divided by `between`.
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
            // TI's range is -2^m to 2^m, because the sign bit is above the m integer bits.
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

#[test]
fn every_notation_that_is_written_is_read_back() {
    for format in formats() {
        for notation in Notation::ALL {
            let text = notation.of(format);
            assert_eq!(text.parse(), Ok(format), "{text}");
            text.split(" = ").for_each(|part| assert_eq!(part.parse(), Ok(format), "{part}"));
        }
    }
}

#[test]
fn formats_of_other_tools_are_read_as_these_define_them() {
    let read = |text: &str| text.parse::<Format>().map(|format| format.to_string()).ok();
    // For TI the sign bit of Q4.8 is beside the integer bits, for ARM among them; for ARM the width must say so.
    for (text, format) in [
        ("Q4.8", "(1,4,8)"),
        ("q4.8", "(1,4,8)"),
        ("Q0.15", "(1,0,15)"),
        ("UQ4.8", "(0,4,8)"),
        ("Q4.8 (13 bits)", "(1,4,8)"),
        ("Q4.8 (12 bits)", "(1,3,8)"),
        ("Q4.8 (12 bits, ARM)", "(1,3,8)"),
        // MathWorks writes the width, then the exponent of the least significant bit, with n for a negative exponent.
        ("sfix16_En12", "(1,3,12)"),
        ("ufix12_En8", "(0,4,8)"),
        ("ufix12", "(0,12,0)"),
        ("sfix8_E2", "(1,9,-2)"),
        ("sfix8_En10", "(1,-3,10)"),
        // System Generator writes the width, then the place of the binary point.
        ("Fix_16_12", "(1,3,12)"),
        ("UFix_12_8", "(0,4,8)"),
        ("ufix12_8", "(0,4,8)"),
        ("ufix<12,8>", "(0,4,8)"),
        ("sfix<16, 12>", "(1,3,12)"),
    ] {
        assert_eq!(read(text).as_deref(), Some(format), "{text}");
    }
    // These are no formats: a width of neither reading, a width with the wrong convention, and slopes and biases.
    let wrong =
        ["Q4.8 (14 bits)", "Q4.8 (12 bits, TI)", "Q4.8 (13 bits, ARM)", "UQ4.8 (13 bits)", "UQ4.8 (12 bits, ARM)"];
    for text in wrong.into_iter().chain(["Q4", "Q4.8 = Q5.8", "sfix16_S2_B3", "fix16_", "ufix<12>", "sfixed(3,-8)"]) {
        assert_eq!(read(text), None, "{text}");
    }
}
