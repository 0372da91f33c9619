//! The operating system decides about processes and their groups, signals, owners of files, and the user's folders.
//!
//! A system has a file here, and all files have the same items; no other part of `hpu` asks which system it runs on.
//! `unix` is Linux and macOS. On Windows no simulator is started (`NO_TOOLS`), so a process there has neither a group
//! nor a stream to a simulator.

#[cfg(unix)]
mod lifeline;
#[cfg(unix)]
mod unix;
#[cfg(windows)]
mod windows;

#[cfg(unix)]
pub use unix::*;
#[cfg(windows)]
pub use windows::*;
