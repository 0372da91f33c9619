//! The unit in which a file counts its times.

use hpu_signal::{Clock, Cycle};

/// The longest power of ten in which every edge of a clock, and the middle between two, is a whole number: 10 ns at
/// 50 MHz. It is a picosecond where there is none, and edges are then rounded down to it. Short numbers are quick to write and pack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timescale {
    clock: Clock,
    /// Of ten, in picoseconds.
    power: u32,
}

impl Timescale {
    /// The timescale of a clock.
    pub fn of(clock: Clock) -> Self {
        let period_ps = SECOND_PS / clock.frequency_hz();
        let whole = SECOND_PS.is_multiple_of(clock.frequency_hz());
        let power = (1..12).rev().find(|&power| whole && period_ps.is_multiple_of(2 * 10u64.pow(power)));
        Self { clock, power: power.unwrap_or(0) }
    }

    /// Its unit is so many picoseconds, as a power of ten: 4 for 10 ns.
    pub fn power(self) -> u32 {
        self.power
    }

    /// When an edge is, in units.
    pub fn at(self, cycle: Cycle) -> u64 {
        self.clock.picoseconds(cycle) / 10u64.pow(self.power)
    }
}

const SECOND_PS: u64 = 1_000_000_000_000;
