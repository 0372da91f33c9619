//! Power scaling of a port-Hamiltonian interconnection.

use super::beside::Comparison;

/// The paper's statements.
#[must_use]
pub fn comparison() -> Comparison {
    Comparison {
        name: "power-scaling",
        title: "Power scaling of a port-Hamiltonian interconnection",
        lines: Vec::new(),
        notes: &[],
    }
}
