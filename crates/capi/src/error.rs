//! Errors as values.

use std::fmt;

/// The kind of an error; `hpu.h` has the same numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(i32)]
pub enum Status {
    /// An argument is null, out of range, or has the wrong length.
    Argument = 1,
    /// The handle was closed, or was never opened.
    Closed = 2,
    /// Another thread is inside a call with the same handle.
    Busy = 3,
    /// The scene, the block, or one of its overrides is refused.
    Refused = 4,
    /// The scene ends at the present clock edge.
    End = 5,
    /// The run cannot go on: the device has left the modelled range.
    Over = 6,
    /// Too many handles are open.
    Full = 7,
    /// A fault of the library itself; the handle can only be closed.
    Broken = 8,
}

/// An error: its kind, and a message that says what is accepted.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Error {
    /// The kind.
    pub status: Status,
    /// The message.
    pub text: String,
}

impl Error {
    /// Returns an error.
    pub(crate) fn new(status: Status, text: impl fmt::Display) -> Self {
        Self { status, text: text.to_string() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Error {}
