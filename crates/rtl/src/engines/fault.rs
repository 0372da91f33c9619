//! Why a run of a program failed.

use std::io;
use std::time::Duration;

/// Why a run of a tool failed.
#[derive(Debug)]
pub enum Fault {
    /// There is no such command in the absolute folders of the PATH.
    Missing,
    /// Its version, and the oldest version that is supported.
    TooOld(String, String),
    /// It could not be started.
    NotStarted(io::Error),
    /// It ended with this exit code.
    Failed(i32),
    /// It was killed by this signal.
    Killed(i32),
    /// It ended well, but gave no output of this kind.
    Silent(&'static str),
    /// It was killed because it ran longer than this time.
    TooLong(Duration),
    /// It was killed because it wrote too much.
    Flooded,
    /// The program is ending, and the tool with it; see [`stop_tools`](crate::stop_tools).
    Stopped,
}
