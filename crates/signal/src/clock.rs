//! Time as an integer count of FPGA clock edges.

use std::fmt;

/// A number of rising clock edges since the release of reset. Seconds are computed from it and never accumulated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct Cycle(pub u64);

/// The FPGA clock: an exact integer frequency in hertz.
///
/// ```
/// use hpu_signal::{Clock, Cycle};
/// let clock = Clock::new(50_000_000)?;
/// assert_eq!(clock.picoseconds(Cycle(3)), 60_000);
/// assert_eq!(clock.first_edge_at(60_001), Cycle(4));
/// # Ok::<(), hpu_signal::ClockError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clock {
    frequency_hz: u64,
}

/// The error of a frequency that no clock can have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ClockError;

impl fmt::Display for ClockError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a clock runs at a whole number of hertz from 1 Hz to 10 GHz, as in \"50 MHz\" or \"25.175 MHz\"")
    }
}

impl std::error::Error for ClockError {}

impl Clock {
    /// Returns a clock of `frequency_hz`.
    ///
    /// # Errors
    ///
    /// Returns [`ClockError`] if the frequency is zero or above 10 GHz.
    pub fn new(frequency_hz: u64) -> Result<Self, ClockError> {
        if (1..=10_000_000_000).contains(&frequency_hz) { Ok(Self { frequency_hz }) } else { Err(ClockError) }
    }

    /// Returns the frequency in hertz.
    pub const fn frequency_hz(self) -> u64 {
        self.frequency_hz
    }

    /// Returns the period in seconds.
    pub fn period_s(self) -> f64 {
        1.0 / self.frequency_hz as f64
    }

    /// Returns the time of an edge in seconds.
    pub fn seconds(self, cycle: Cycle) -> f64 {
        cycle.0 as f64 / self.frequency_hz as f64
    }

    /// Returns the time of an edge in whole picoseconds, rounded down.
    pub fn picoseconds(self, cycle: Cycle) -> u64 {
        (u128::from(cycle.0) * 1_000_000_000_000 / u128::from(self.frequency_hz)) as u64
    }

    /// Returns the first edge at or after a time in whole picoseconds. This edge samples a pin that changes at that
    /// time.
    pub fn first_edge_at(self, picoseconds: u64) -> Cycle {
        Cycle((u128::from(picoseconds) * u128::from(self.frequency_hz)).div_ceil(1_000_000_000_000) as u64)
    }

    /// Returns the number of whole edges nearest to a duration in seconds.
    pub fn edges(self, seconds: f64) -> u64 {
        (seconds * self.frequency_hz as f64).round() as u64
    }
}
