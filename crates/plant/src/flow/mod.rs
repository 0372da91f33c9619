//! Exact flows of linear systems, and searches for the next event along them.

pub(crate) mod course;
pub(crate) mod double;
pub(crate) mod gauge;
pub(crate) mod guard;
pub(crate) mod lanes;
pub(crate) mod leap;
pub(crate) mod linear;
pub(crate) mod matrix;
pub(crate) mod period;
pub(crate) mod polynomial;
pub(crate) mod reversal;
