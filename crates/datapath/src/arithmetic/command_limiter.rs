//! The limiter of the command, with registers that model a path of several clocks.
//!
//! - **Equation**: `limited(t) = clamp(value(t - SETTLING), -LIMIT, +LIMIT)`, in edges.
//! - **Ports**: `value` (1,IN_WIDTH-1,0) in; `limited` (1,OUT_WIDTH-1,0) out; `LIMIT < 2^(OUT_WIDTH-1)`.
//! - **Latency**: `SETTLING` edges; with 0 there is no register.
//! - **Edge**: the limited value enters a row of `SETTLING` registers, the oldest goes out.
//! - **Reset**: all registers 0. **Overflow**: none, `limited` holds every limited value.
//! - **VHDL twin**: `hdl/command_limiter.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eq. (8); the row is common practice for a path longer than a clock.
//! - **Differs from the hardware**: SETTLING = 0 has no propagation delay. Otherwise synthesis may move the registers
//!   into the logic before them, which shows only at the first edges after a reset. A design that declares a path of
//!   several clocks instead of registering it shows intermediate words meanwhile, this one never.

use hpu_signal::Word;

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::{Block, Combinational, ConfigError, Register, Saturator, Step, arithmetic::saturator};

pub use crate::arithmetic::saturator::{In, Out};

/// The greatest number of clocks by which a command is held back.
pub const MOST_SETTLING: u32 = 64;

/// The command's limiter; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CommandLimiter {
    limiter: Saturator,
    /// Limited values that are not shown yet or are shown now, the oldest first; the oldest is the output.
    late: Vec<i64>,
    /// The output when there are no registers.
    through: i64,
}

impl CommandLimiter {
    /// Returns a limiter to `-limit..=limit` whose output is held back by `settling` clocks.
    ///
    /// # Errors
    ///
    /// Returns an error unless both widths are 2 to 62, `limit` is a VHDL `natural` below `2^(out_width-1)`, and
    /// `settling` is at most 64.
    pub fn new(in_width: u32, out_width: u32, limit: u32, settling: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "SETTLING", settling, 0..=MOST_SETTLING)?;
        let limiter = Saturator::new(in_width, out_width, limit)?;
        Ok(Self { limiter, late: vec![0; settling as usize], through: 0 })
    }

    /// Whether the limiter has registers.
    #[inline]
    pub fn settles(&self) -> bool {
        !self.late.is_empty()
    }

    /// Returns the limited value, before any register.
    #[inline]
    pub fn limit(&self, value: i64) -> i64 {
        self.limiter.eval(saturator::In { value }).limited
    }

    /// Lets the output settle with this limited value and the registers as they stand; returns the output.
    #[inline]
    pub(crate) fn settle(&mut self, limited: i64) -> i64 {
        self.through = limited;
        self.shown()
    }

    #[inline]
    fn shown(&self) -> i64 {
        self.late.first().copied().unwrap_or(self.through)
    }

    /// Shifts the registers by that many edges, at all of which `limited` enters.
    #[inline]
    fn shift(&mut self, edges: u64, limited: i64) {
        if self.late.is_empty() {
            return;
        }
        let edges = usize::try_from(edges).map_or(self.late.len(), |edges| edges.min(self.late.len()));
        self.late.rotate_left(edges);
        let kept = self.late.len() - edges;
        self.late[kept..].fill(limited);
    }
}

/// Registers as in the VHDL: the row `late` of words that are not shown yet, the newest first, and the output.
impl Step for CommandLimiter {
    fn registers(&self) -> Vec<Register> {
        let Some(last) = u32::try_from(self.late.len()).ok().filter(|&last| last > 0) else { return Vec::new() };
        let format = self.limiter.outputs().limited.format;
        // Place 0 of the row is not a register but the limited value itself; the last place is the output.
        let late = |place| {
            let low = (last - place) * format.width();
            Register { low, is_alone: false, ..Register::new("late", format) }
        };
        (1..last).map(late).chain([Register::new("limited", format)]).collect()
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let limited = self.limiter.made(input).limited;
        let Some((&shown, late)) = registers.split_last() else { return (Vec::new(), Out { limited }) };
        ([&[limited], late].concat(), Out { limited: shown })
    }
}

crate::base::listed::configured! {
    CommandLimiter of |block| {
        "IN_WIDTH": u32 = 14, block.limiter.value.width();
        "OUT_WIDTH": u32 = 13, block.limiter.limited.width();
        "LIMIT": u32 = 4095, block.limiter.limit;
        "SETTLING": u32 = 0, block.late.len() as u32;
    }
}

impl Block for CommandLimiter {
    const NAME: &'static str = "command_limiter";
    crate::base::block::clocked!(self => &self.limiter);

    fn reset(&mut self) -> Out<i64> {
        self.late.fill(0);
        Out { limited: self.settle(0) }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let limited = self.limit(input.value);
        self.shift(1, limited);
        Out { limited: self.settle(limited) }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let shown = self.shown();
        let other = self.late.iter().position(|&late| late != shown);
        match other {
            // The second oldest value is shown at the next edge.
            Some(place) => place as u64 - 1,
            None if self.limit(input.value) == shown => u64::MAX,
            None => (self.late.len() as u64).saturating_sub(1),
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let limited = self.limit(input.value);
        self.shift(edges, limited);
        if edges > 0 {
            self.through = limited;
        }
    }
}

impl Listed for CommandLimiter {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("settling_1", Self::new(10, 9, 255, 1)?), ("settling_5", Self::new(10, 9, 200, 5)?)])
    }
}
