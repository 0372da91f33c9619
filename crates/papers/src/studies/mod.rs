//! Studies as TOML files: scenes under overrides, what is measured of them, and a paper's claims beside the figures.
//!
//! A study's file has groups of lines. A line names its measures ([`crate::measure`]), writes their values into a text
//! ([`crate::template`]) and takes figures from them. A claim is a condition on the figures of the lines that name it.
//! `vary` repeats a group or a line for each member of a list; `$name` stands for the member. See
//! `testbench/studies/power-scaling.toml` for an example.

pub mod comparison;
mod file;
mod read;
mod shipped;
pub mod summing;
mod vary;

pub use file::FileErrors;
pub use read::{Section, Study, read};
pub use shipped::{shipped, shipped_texts};
pub use vary::Variables;
