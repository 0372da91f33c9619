//! The analog input shaper and energy bounding.

use super::beside::Comparison;

/// The paper's statements.
#[must_use]
pub fn comparison() -> Comparison {
    Comparison {
        name: "input-shaper",
        title: "The analog input shaper and energy bounding",
        lines: Vec::new(),
        notes: &[],
    }
}
