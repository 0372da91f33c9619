//! Why a file of vectors was refused.

use std::fmt;

/// Why a file of vectors or stimuli was refused, and in which line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VectorError {
    line: usize,
    why: String,
}

impl VectorError {
    /// Returns the error of a line, counted from 1.
    pub(crate) fn at(line: usize, why: impl Into<String>) -> Self {
        Self { line, why: why.into() }
    }

    /// Returns the line, counted from 1; line 1 where the error belongs to none.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Returns the reason, without the line.
    pub fn why(&self) -> &str {
        &self.why
    }
}

impl fmt::Display for VectorError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.line, self.why)
    }
}

impl std::error::Error for VectorError {}
