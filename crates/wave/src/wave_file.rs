//! A file of a run in either format, written on a thread of its own.

use std::fs::File;
use std::io;

use hpu_signal::{Clock, Cycle, Observe};

use crate::{Fst, Layout, Recording, Sink, Vcd};

/// A file of a run in any format. A crate that runs scenes observes a run through this trait, so that it need not
/// compile the run again for each format. Every [`Recording`] implements it.
pub trait WaveFile: Observe {
    /// Completes the file; see [`Recording::finish`].
    ///
    /// # Errors
    ///
    /// The errors of [`Recording::finish`].
    fn complete(self: Box<Self>, end: Cycle) -> io::Result<()>;
}

impl<S: Sink> WaveFile for Recording<S> {
    fn complete(self: Box<Self>, end: Cycle) -> io::Result<()> {
        self.finish(end).map(drop)
    }
}

/// Returns an FST that is written on a thread of its own.
///
/// # Errors
///
/// An error when the beginning of the file cannot be written.
pub fn fst_aside(file: File, layout: &Layout, clock: Clock) -> io::Result<Box<dyn WaveFile>> {
    Ok(Box::new(Fst::new(file, layout, clock)?.aside()))
}

/// Returns a VCD that is written on a thread of its own.
///
/// # Errors
///
/// An error when the beginning of the file cannot be written.
pub fn vcd_aside(file: File, layout: &Layout, clock: Clock) -> io::Result<Box<dyn WaveFile>> {
    Ok(Box::new(Vcd::new(file, layout, clock)?.aside()))
}
