//! Quantities as text, for the pages of every verb.

use hpu_cosim::{figure, number};

/// Returns a quantity with an SI prefix and five significant digits, as in `1.5183 N.m/rad`. A number without a unit
/// gets no prefix.
pub fn si(value: f64, unit: &str) -> String {
    if unit.is_empty() {
        return figure(value);
    }
    const PREFIXES: [(f64, &str); 8] =
        [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"), (1e-12, "p")];
    let size = value.abs();
    let fits = |&&(scale, _): &&(f64, &str)| size >= scale * 0.999_995;
    match PREFIXES.iter().find(fits) {
        Some((scale, prefix)) if size.is_finite() && size < 1e12 => {
            format!("{} {prefix}{unit}", significant(value / scale))
        }
        _ if value == 0.0 => format!("0 {unit}"),
        _ => format!("{value:.4e} {unit}"),
    }
}

/// Returns five significant digits of a number from 1 to 1000, without trailing zeros.
fn significant(value: f64) -> String {
    let decimals = match value.abs() {
        size if size < 9.999_95 => 4,
        size if size < 99.999_5 => 3,
        _ => 2,
    };
    let text = format!("{value:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Returns two digits of a number above zero, rounded up, for a condition that holds above that number.
pub(crate) fn rounded_up(value: f64) -> String {
    let tenth = 10f64.powi(libm::log10(value).floor() as i32 - 1);
    let text = format!("{:.1e}", (value / tenth).ceil() * tenth);
    text.parse().map_or(text, number)
}

/// Returns a share in percent; never 0 for something, never 100 for less than all.
pub fn percent(part: u64, whole: u64) -> String {
    let share = 100.0 * part as f64 / whole.max(1) as f64;
    match part {
        0 => "0 %".to_string(),
        _ if part == whole => "100 %".to_string(),
        _ if share < 0.01 => format!("{share:.1e} %"),
        _ if share > 99.99 => ">99.99 %".to_string(),
        _ => format!("{share:.2} %"),
    }
}

/// Returns a relative error in percent, with its sign.
pub fn error_percent(error: f64) -> String {
    if error == 0.0 { "exact".to_string() } else { format!("{:+.3} %", 100.0 * error) }
}

#[cfg(test)]
mod tests {
    use super::{percent, si};

    #[test]
    fn quantities_have_five_digits_and_a_prefix() {
        assert_eq!(si(1.518_342, "N.m/rad"), "1.5183 N.m/rad");
        assert_eq!(si(-0.000_1, "s"), "-100 us");
        assert_eq!(si(50e6, "Hz"), "50 MHz");
        assert_eq!(si(999.999_9, "Hz"), "1 kHz");
        assert_eq!(si(0.0, "J"), "0 J");
        assert_eq!(si(1.25e-15, "J"), "1.2500e-15 J");
        assert_eq!(si(f64::INFINITY, "rad"), "inf rad");
    }

    #[test]
    fn a_share_is_nothing_or_all_only_when_it_is() {
        assert_eq!(percent(0, 10), "0 %");
        assert_eq!(percent(10, 10), "100 %");
        assert_eq!(percent(1, 1_000_000), "1.0e-4 %");
        assert_eq!(percent(999_999, 1_000_000), ">99.99 %");
        assert_eq!(percent(1, 3), "33.33 %");
    }
}
