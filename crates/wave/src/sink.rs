//! The interface to a file format.

use std::io;

/// A file format that takes value changes. The writers of VCD and FST implement it, so that
/// [`Recording`](crate::Recording) is written once. Variables are numbered by source: nets, reals, clock, reset,
/// constants.
///
/// ```
/// use hpu_wave::Sink;
///
/// /// Counts the changes of words.
/// #[derive(Default)]
/// struct Changes(u64);
///
/// impl Sink for Changes {
///     type Out = u64;
///     fn time(&mut self, _: u64) -> std::io::Result<()> {
///         Ok(())
///     }
///     fn word(&mut self, _: usize, _: i64) -> std::io::Result<()> {
///         self.0 += 1;
///         Ok(())
///     }
///     fn real(&mut self, _: usize, _: f64) -> std::io::Result<()> {
///         Ok(())
///     }
///     fn finish(self) -> std::io::Result<u64> {
///         Ok(self.0)
///     }
/// }
///
/// let mut changes = Changes::default();
/// changes.time(0)?;
/// changes.word(3, -1)?;
/// assert_eq!(changes.finish()?, 1);
/// # Ok::<(), std::io::Error>(())
/// ```
pub trait Sink {
    /// The writer, which is returned at the end.
    type Out;

    /// Begins an instant. It must be later than all instants before. `time` is in units of the file.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn time(&mut self, time: u64) -> io::Result<()>;
    /// Writes a new word.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn word(&mut self, slot: usize, word: i64) -> io::Result<()>;
    /// Writes a new real.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn real(&mut self, slot: usize, value: f64) -> io::Result<()>;
    /// Completes the file.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn finish(self) -> io::Result<Self::Out>;
}
