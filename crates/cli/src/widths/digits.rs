//! Numbers of a page about widths.

/// Returns a whole number as it is, any other with four digits.
pub fn digits(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => value.to_string(),
        size if size >= 1e6 => format!("{value:.2e}"),
        size if size.fract() == 0.0 => format!("{value}"),
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 100.0 => format!("{value:.1}"),
        size if size >= 10.0 => format!("{value:.2}"),
        size if size >= 1e-2 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}
