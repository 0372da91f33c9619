//! Vasudevan et al. 2007: the hybrid loop against the conventional one.

use super::beside::Comparison;

/// The paper's statements.
#[must_use]
pub fn comparison() -> Comparison {
    Comparison {
        name: "hybrid-loop",
        title: "Vasudevan et al. 2007: the hybrid loop against the conventional one",
        lines: Vec::new(),
        notes: &[],
    }
}
