//! The answers of the project's own block, with which those of somebody else's are compared.

use crate::vectors::vector::Vectors;

/// The answers of our block.
pub(super) struct Ours {
    pub(super) vectors: Vectors,
    /// Whether each row resets.
    pub(super) resets: Vec<bool>,
    /// Rows by which the answers of theirs come later.
    pub(super) shift: i64,
}

impl Ours {
    /// Returns the word at an input of ours.
    pub(super) fn input(&self, row: usize, index: usize) -> i64 {
        self.vectors.rows[row][usize::from(self.vectors.header.clocked) + index]
    }

    /// Returns the row of ours that a row of theirs answers. Returns `None` where there is no such row, or where a
    /// reset between the two has cleared the answer.
    pub(super) fn answered(&self, row: usize) -> Option<usize> {
        let own = usize::try_from(row as i64 - self.shift).ok().filter(|own| *own < self.resets.len())?;
        (!self.resets[own.min(row) + 1..=own.max(row)].contains(&true)).then_some(own)
    }
}
