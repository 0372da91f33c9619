//! The unit in which a file counts time.

use std::fmt;

use hpu_signal::{Clock, Cycle};

/// The longest power of ten in which every edge of a clock, and the middle between two edges, is a whole number: 10 ns
/// at 50 MHz. Where there is none, the unit is a picosecond and edges are rounded down to it. Short numbers are written
/// and packed quickly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timescale {
    clock: Clock,
    power: u32,
    /// Units from one edge to the next, where that is a whole number.
    edge: Option<u64>,
}

impl Timescale {
    /// Returns the timescale of a clock.
    pub fn of(clock: Clock) -> Self {
        let period_ps = SECOND_PS.is_multiple_of(clock.frequency_hz()).then(|| SECOND_PS / clock.frequency_hz());
        let exact = |power: &u32| period_ps.is_some_and(|period_ps| period_ps.is_multiple_of(2 * 10u64.pow(*power)));
        let power = (1..12).rev().find(exact).unwrap_or(0);
        Self { clock, power, edge: period_ps.map(|period_ps| period_ps / 10u64.pow(power)) }
    }

    /// Returns the unit in picoseconds, as a power of ten: 4 for 10 ns.
    pub fn power(self) -> u32 {
        self.power
    }

    /// Returns the time of an edge, in units.
    #[inline]
    pub fn at(self, cycle: Cycle) -> u64 {
        match self.edge {
            Some(edge) => edge * cycle.0,
            None => self.clock.picoseconds(cycle),
        }
    }

    /// Returns the time of an edge, in the largest of ps, ns, us and ms that is not larger than the unit.
    pub fn in_thousands(self, cycle: Cycle) -> u64 {
        self.at(cycle) * 10u64.pow(self.power % 3)
    }
}

impl fmt::Display for Timescale {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let unit = ["ps", "ns", "us", "ms"][self.power as usize / 3];
        write!(f, "{} {unit}", 10u32.pow(self.power % 3))
    }
}

const SECOND_PS: u64 = 1_000_000_000_000;
