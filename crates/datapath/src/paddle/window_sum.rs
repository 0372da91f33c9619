//! Sum of the newest codes of a converter, less a zero.
//!
//! - **Equation**: `sum(k) = code(k) + code(k-1) + ... + code(k-WINDOW+1) - zero`; codes before the first sample count
//!   as the first one.
//! - **Ports**: `code` (1,CODE_WIDTH-1,0), `zero` (1,SUM_WIDTH-1,0) in the units of the sum, `period`
//!   (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `sum` (1,SUM_WIDTH,0) out.
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, `sum` is loaded, the codes move on, and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down.
//! - **Reset**: all 0; the first edge samples, and fills the window with its code.
//! - **Overflow**: none, because `SUM_WIDTH` holds `WINDOW` codes.
//! - **VHDL twin**: `hdl/window_sum.vhd`.
//! - **Source**: the mean of 33 codes in the current loop of EPFL's haptic paddle (`adc.c`), times 33.
//! - **Differs from the hardware**: the firmware sums a buffer that a DMA channel fills.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, within};
use crate::base::countdown::Countdown;
use crate::base::history::History;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the sum.
    pub struct In of |block: &WindowSum| {
        code: block.code, "code", "Newest code of the converter";
        zero: block.total, "code", "Sum of the codes that stand for 0";
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the sum.
    pub struct Out of |block: &WindowSum| {
        sum: block.sum(), "code", "Sum of the newest codes, less the zero";
    }
}

/// A sum over a window of codes; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WindowSum {
    code: Format,
    total: Format,
    period: Format,
    countdown: Countdown,
    history: History,
    primed: bool,
    /// The sum of the codes in the window, and the output.
    sums: [i64; 2],
}

impl WindowSum {
    /// Returns a sum of `window` codes of `code_width` bits, in `sum_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless a code has 2 to 24 bits, the window 2 to 64 codes, `sum_width` is 2 to 30 and holds
    /// their sum, and the period has 2 to 30 bits.
    pub fn new(code_width: u32, window: u32, sum_width: u32, period_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "CODE_WIDTH", code_width, 2..=24)?;
        within(Self::NAME, "WINDOW", window, 2..=64)?;
        let least = code_width + window.next_power_of_two().ilog2();
        within(Self::NAME, "SUM_WIDTH", sum_width, least..=30)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        Ok(Self {
            code: Format::signed(code_width),
            total: Format::signed(sum_width),
            period: Format::unsigned(period_width),
            countdown: Countdown::default(),
            history: History::new(window),
            primed: false,
            sums: [0; 2],
        })
    }

    fn sum(&self) -> Format {
        Format::signed(self.total.width() + 1)
    }

    fn window(&self) -> i128 {
        self.history.window() as i128
    }

    /// Computes the sum of the codes in the window, and the output, after a sample edge. `oldest` is the code that
    /// leaves the window.
    #[inline]
    fn made<W: Word>(&self, [total, oldest]: [W; 2], primed: W::Bit, [code, zero]: [W; 2]) -> [W; 2] {
        let moved = || [(total + code - oldest).wrap(self.total)];
        let [next] = W::branch(primed, moved, || [code * W::int(self.window())]);
        [next, next - zero]
    }

    /// Ticks a sample edge, whenever it comes.
    #[inline]
    pub(crate) fn sampled(&mut self, input: In<i64>) -> Out<i64> {
        self.sums = self.sample(&input);
        self.history.push(input.code, if self.primed { 1 } else { u64::MAX });
        self.primed = true;
        Out { sum: self.sums[1] }
    }

    /// Whether all codes of the window are this one.
    pub(crate) fn is_full(&self, code: i64) -> bool {
        (1..=self.history.window()).all(|ago| self.history.ago(0, 0, ago) == code)
    }

    /// Lets the next sample edge come after this number of other edges.
    pub(crate) fn wait(&mut self, edges: u64) {
        self.countdown = Countdown::after(edges as u32);
    }

    #[inline]
    fn sample(&self, input: &In<i64>) -> [i64; 2] {
        let of = hpu_signal::Machine::<i64>::of;
        let before = [self.sums[0], self.history.ago(0, 0, self.history.window())].map(of);
        self.made(before, self.primed, [input.code, input.zero].map(of)).map(|word| word.narrowed().word)
    }
}

impl Step for WindowSum {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![
            Register::new("countdown", self.period),
            Register::new("primed", Format::BIT),
            Register::new("total", self.total),
            Register::new("sum", self.sum()),
        ];
        let width = self.code.width();
        let window = self.history.window() as u32;
        let earlier = |ago| Register { low: (window - ago) * width, ..Register::new("earlier", self.code) };
        all.extend((1..=window).map(earlier));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { code, zero, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, primed, total, sum, ref earlier @ ..] = *registers else { unreachable!("registers") };
        let (left, samples) = counted_down(left, period);
        let oldest = earlier[earlier.len() - 1];
        let sampled = || self.made([total, oldest], primed.is_set(), [code, zero]);
        let [next, shown] = W::branch(samples, sampled, || [total, sum]);
        let mut all = vec![left, W::of_bit(samples | primed.is_set()), next, shown];
        let newer = [code].into_iter().chain(earlier.iter().copied());
        all.extend(newer.zip(earlier).map(|(newer, &kept)| {
            let filled = || [W::select(primed.is_set(), newer, code)];
            let [shifted] = W::branch(samples, filled, || [kept]);
            shifted
        }));
        (all, Out { sum })
    }
}

crate::base::listed::configured! {
    WindowSum of |block| {
        "CODE_WIDTH": u32 = 12, block.code.width();
        "WINDOW": u32 = 33, block.history.window() as u32;
        "SUM_WIDTH": u32 = 18, block.total.width();
        "PERIOD_WIDTH": u32 = 24, block.period.width();
    }
}

impl Block for WindowSum {
    const NAME: &'static str = "window_sum";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.history.reset();
        (self.primed, self.sums) = (false, [0; 2]);
        Out { sum: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.sampled(input);
        }
        Out { sum: self.sums[1] }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.primed && self.sample(input) == self.sums && self.is_full(input.code) {
            u64::MAX
        } else {
            self.countdown.left()
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

crate::circuit::part::registers!(WindowSum);

impl Listed for WindowSum {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("narrow", Self::new(4, 3, 6, 5)?), ("wide", Self::new(24, 64, 30, 4)?)])
    }
}
