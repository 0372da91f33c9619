//! Word formats in the notations of other tools.

/// Returns sign bit, integer bits and fraction bits of a format, read from `(S,I,F)` or a notation of another tool in
/// upper or lower case. Returns `None` if the text is no format.
pub(crate) fn read(text: &str) -> Option<(bool, i32, i32)> {
    let text = &text.trim().to_ascii_lowercase();
    triple(text)
        .or_else(|| vhdl(text))
        .or_else(|| cpp(text))
        .or_else(|| q(text))
        .or_else(|| short(text))
        .or_else(|| by_width(text))
}

/// Reads two numbers between these texts.
fn pair(text: &str, before: &str, between: &str, after: &str) -> Option<(i32, i32)> {
    let (first, second) = text.strip_prefix(before)?.strip_suffix(after)?.split_once(between)?;
    Some((number(first)?, number(second)?))
}

/// Reads a number so small that sums of a few such numbers fit.
fn number(text: &str) -> Option<i32> {
    text.trim().parse::<i16>().ok().map(i32::from)
}

fn triple(text: &str) -> Option<(bool, i32, i32)> {
    let (sign, rest) = text.strip_prefix('(')?.strip_suffix(')')?.split_once(',')?;
    let (int, frac) = rest.split_once(',')?;
    let signed = match sign.trim().parse::<i32>() {
        Ok(sign @ (0 | 1)) => sign == 1,
        _ => return None,
    };
    Some((signed, int.trim().parse().ok()?, frac.trim().parse().ok()?))
}

/// Reads the types of VHDL-2008's `fixed_pkg`, whose indices are powers of two.
fn vhdl(text: &str) -> Option<(bool, i32, i32)> {
    let signed = pair(text, "sfixed(", " downto ", ")").map(|(high, low)| (true, high, -low));
    signed.or_else(|| pair(text, "ufixed(", " downto ", ")").map(|(high, low)| (false, high + 1, -low)))
}

/// Reads the types of C++ high-level synthesis: the width, then the integer bits with the sign bit.
fn cpp(text: &str) -> Option<(bool, i32, i32)> {
    let signed = pair(text, "ap_fixed<", ",", ">").map(|(width, int)| (true, int - 1, width - int));
    signed.or_else(|| pair(text, "ap_ufixed<", ",", ">").map(|(width, int)| (false, int, width - int)))
}

/// Reads Q notation. `Q4.8` alone has a sign bit beside the 4 integer bits, as TI writes it; a width in brackets, as in
/// `Q4.8 (12 bits, ARM)`, may say otherwise. Several texts, as `Notation::Q` writes them, must be the same format.
fn q(text: &str) -> Option<(bool, i32, i32)> {
    let mut readings = text.split(" = ").map(one_q);
    let first = readings.next()??;
    readings.all(|other| other == Some(first)).then_some(first)
}

fn one_q(text: &str) -> Option<(bool, i32, i32)> {
    let (numbers, width, whose) = match text.split_once(" (") {
        None => (text, None, ""),
        Some((numbers, rest)) => {
            let (bits, whose) = rest.strip_suffix(')').map(|rest| rest.split_once(", ").unwrap_or((rest, "")))?;
            (numbers, Some(number(bits.strip_suffix(" bits").or_else(|| bits.strip_suffix(" bit"))?)?), whose)
        }
    };
    if let Some((int, frac)) = pair(numbers, "uq", ".", "") {
        let fits = whose.is_empty() && width.is_none_or(|width| width == int + frac);
        return fits.then_some((false, int, frac));
    }
    let (int, frac) = pair(numbers, "q", ".", "")?;
    match (width.map(|width| width - int - frac), whose) {
        (None, "") | (Some(1), "" | "ti") => Some((true, int, frac)),
        (Some(0), "" | "arm") => Some((true, int - 1, frac)),
        _ => None,
    }
}

/// Reads `s7.8` and `u4.8`, as comments of designs have them: the sign bit is not among the integer bits.
fn short(text: &str) -> Option<(bool, i32, i32)> {
    let signed = pair(text, "s", ".", "").map(|(int, frac)| (true, int, frac));
    signed.or_else(|| pair(text, "u", ".", "").map(|(int, frac)| (false, int, frac)))
}

/// Reads the whole width, then the fraction bits: MathWorks' `sfix16_En12`, `ufix12` and `sfix8_E2` (whose least
/// significant bit is worth 2^2), System Generator's `Fix_16_12` and `UFix_12_8`, and also `sfix16_12` and
/// `ufix<12,8>`.
fn by_width(text: &str) -> Option<(bool, i32, i32)> {
    let kinds = [("sfix", true), ("ufix", false), ("fix", true)];
    let (rest, signed) = kinds.into_iter().find_map(|(kind, signed)| Some((text.strip_prefix(kind)?, signed)))?;
    let (width, frac) = match rest.strip_prefix('<') {
        Some(inner) => {
            inner.strip_suffix('>')?.split_once(',').map(|(width, frac)| Some((number(width)?, number(frac)?)))?
        }
        None => {
            let rest = rest.strip_prefix('_').unwrap_or(rest);
            let whole = |digits: &str| digits.parse::<u8>().ok().map(i32::from);
            match rest.split_once('_') {
                None => whole(rest).map(|width| (width, 0)),
                Some((width, scale)) => match (scale.strip_prefix("en"), scale.strip_prefix('e')) {
                    (Some(frac), _) => Some((whole(width)?, whole(frac)?)),
                    (None, Some(exponent)) => Some((whole(width)?, -whole(exponent)?)),
                    (None, None) => Some((whole(width)?, whole(scale)?)),
                },
            }
        }
    }?;
    Some((signed, width - frac - i32::from(signed), frac))
}
