//! All tests of the crate in one binary, which is linked once and spreads over the cores.

mod clock;
mod fixed;
mod format;
mod narrowing;
mod notation;
mod observers;
mod words;
