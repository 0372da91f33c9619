//! The error of a configuration that a block refuses.

use std::fmt::{self, Display};
use std::ops::RangeInclusive;

/// A configuration that the hardware of this block cannot have: the value found, and the values accepted.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ConfigError {
    block: &'static str,
    found: String,
    accepted: String,
}

impl ConfigError {
    pub(crate) fn new(block: &'static str, found: impl Display, accepted: impl Display) -> Self {
        Self { block, found: found.to_string(), accepted: accepted.to_string() }
    }
}

impl Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}; accepted: {}", self.block, self.found, self.accepted)
    }
}

impl std::error::Error for ConfigError {}

/// Widths of position words, in bits: at least 2, because a one-bit port is no vector, and few enough for a sum in an
/// `i64`.
pub(crate) const WORD: RangeInclusive<u32> = 2..=62;
/// Widths, in bits, of words that hold only VHDL `natural`s, with room for a power of two.
pub(crate) const COUNTER: RangeInclusive<u32> = 2..=30;
/// The greatest VHDL `natural`.
pub(crate) const NATURAL: u32 = i32::MAX.unsigned_abs();

/// Returns an error if a generic is outside its range.
pub(crate) fn within(
    block: &'static str,
    generic: &str,
    value: u32,
    accepted: RangeInclusive<u32>,
) -> Result<(), ConfigError> {
    if accepted.contains(&value) {
        Ok(())
    } else {
        let found = format!("{generic} is {value}");
        Err(ConfigError::new(block, found, format!("{} to {}", accepted.start(), accepted.end())))
    }
}
