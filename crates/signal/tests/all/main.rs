//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod clock;
mod fixed;
mod format;
mod narrowing;
mod notation;
mod words;
