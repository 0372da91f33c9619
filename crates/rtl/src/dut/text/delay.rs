//! A delay that a source asks for.

use std::fmt;

use hpu_signal::Clock;

/// A delay in a source.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Delay {
    /// The file, by the design's own name of it, and the line.
    pub(crate) place: String,
    /// The delay as the source has it, with the word or the sign before it.
    pub(crate) text: String,
    /// Its length in seconds; `None` where the source does not say it in numbers.
    pub(crate) length_s: Option<f64>,
}

impl Delay {
    /// Returns whether the delay ends before the next edge of the clock, rising or falling. Whatever is clocked then
    /// sees the same without it.
    pub(crate) fn is_short(&self, clock: Clock) -> bool {
        self.length_s.is_some_and(|length_s| length_s < 0.5 * clock.period_s())
    }
}

impl fmt::Display for Delay {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: `{}`", self.place, self.text)
    }
}

/// Returns the first of some delays, and how many there are more; `None` if there is none.
pub(crate) fn first<'d>(delays: impl IntoIterator<Item = &'d Delay>) -> Option<String> {
    let mut delays = delays.into_iter();
    let first = delays.next()?;
    Some(match delays.count() {
        0 => first.to_string(),
        more => format!("{first} and {more} more"),
    })
}

/// Returns the note that these delays are left out.
pub(crate) fn left_out(delays: &str) -> String {
    format!("{delays}: left out, because it ends within half a clock cycle: registers see the same without it")
}

/// Returns the seconds of a number with a unit of time, such as `5 us`, `1.5ns` or `1e3 ps`.
pub(crate) fn time_s(text: &str) -> Option<f64> {
    let text = text.trim().replace('_', "");
    let split = text.len() - text.chars().rev().take_while(char::is_ascii_alphabetic).count();
    let (number, unit) = text.split_at(split);
    let unit_s = match unit.to_ascii_lowercase().as_str() {
        "fs" => 1e-15,
        "ps" => 1e-12,
        "ns" => 1e-9,
        "us" => 1e-6,
        "ms" => 1e-3,
        "s" | "sec" => 1.0,
        "min" => 60.0,
        "hr" => 3600.0,
        _ => return None,
    };
    let number: f64 = number.trim().parse().ok()?;
    (number.is_finite() && number >= 0.0).then_some(number * unit_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_a_number_and_a_unit() {
        for (text, length_s) in
            [("5 us", Some(5e-6)), ("1.5ns", Some(1.5e-9)), (" 2_0 PS ", Some(2e-11)), ("1 s", Some(1.0))]
        {
            let told = time_s(text);
            assert!(
                told.is_some() == length_s.is_some()
                    && (told.unwrap_or(0.0) / length_s.unwrap_or(1.0) - 1.0).abs() < 1e-12,
                "{text}"
            );
        }
        for text in ["5", "us", "T", "-1 ns", "5 us + 1 ns", "1 / 2 ns", "inf s", ""] {
            assert_eq!(time_s(text), None, "{text}");
        }
    }
}
