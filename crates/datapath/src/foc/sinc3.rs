//! A third-order sinc filter that makes words of the bits of a sigma-delta modulator, one word in `2^RATIO_WIDTH` bits.
//!
//! - **Equation**: with `M = 2^RATIO_WIDTH` and `x(n) = 1` for a bit of 1, `-1` for one of 0, the word after bit `n` is
//!   `value = h(0) x(n) + h(1) x(n-1) + ... + h(3M-3) x(n-3M+3)`, the response of three means over `M` bits, each times
//!   `M`: `h` is the third power of `1 + z + ... + z^(M-1)`. Bits before the reset count as `x = 0`. Three sums run at
//!   each bit, three differences at each word, all modulo `2^(3 RATIO_WIDTH + 2)`.
//! - **Ports**: `data` (0,1,0), `strobe` (0,1,0) in; `value` (1,3 RATIO_WIDTH + 1,0), from `-M^3` to `M^3` and even,
//!   `ready` (0,1,0) out.
//! - **Latency**: 1 edge from the last bit of a word to the word. A step of the density is seen in full from the third
//!   word on.
//! - **Edge**: with `strobe`, a bit is taken. With the `M`th bit since the last word, `value` is loaded and `ready` is
//!   1 for one clock.
//! - **Reset**: all 0.
//! - **Overflow**: none; the sums wrap, and the differences undo it (Hogenauer).
//! - **VHDL twin**: `hdl/sinc3.vhd`.
//! - **Source**: Hogenauer 1981; the filter that makers of isolated sigma-delta modulators recommend.
//! - **Differs from the hardware**: three sums, or six in the clock of a word, take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the filter.
    pub struct In of |_: &Sinc3| {
        data, "Bit of the modulator";
        strobe, "A bit is there";
    }
    /// Outputs of the filter.
    pub struct Out of |block: &Sinc3| {
        value: block.word(), "1", "Latest word";
        ready, "The word is new, for one edge";
    }
}

/// The sums, the words of the differences before, and the latest word.
type Words<W> = [W; 7];

/// A third-order sinc filter; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sinc3 {
    ratio_width: u32,
    /// Bits since the latest word.
    count: i64,
    words: Words<i64>,
    ready: bool,
}

impl Sinc3 {
    /// Returns a filter that makes a word of `2^ratio_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `ratio_width` is 2 to 10.
    pub fn new(ratio_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "RATIO_WIDTH", ratio_width, 2..=10)?;
        Ok(Self { ratio_width, count: 0, words: [0; 7], ready: false })
    }

    fn word(&self) -> Format {
        Format::signed(3 * self.ratio_width + 2)
    }

    /// Computes the words after a bit; `ends` tells whether it is the last one of a word.
    #[inline]
    fn made<W: Word>(&self, [sum1, sum2, sum3, last1, last2, last3, value]: Words<W>, x: W, ends: W::Bit) -> Words<W> {
        let format = self.word();
        let sum1 = (sum1 + x).wrap(format);
        let sum2 = (sum2 + sum1).wrap(format);
        let sum3 = (sum3 + sum2).wrap(format);
        let differences = || {
            let first = (sum3 - last1).wrap(format);
            let second = (first - last2).wrap(format);
            [sum3, first, second, (second - last3).wrap(format)]
        };
        let [last1, last2, last3, value] = W::branch(ends, differences, || [last1, last2, last3, value]);
        [sum1, sum2, sum3, last1, last2, last3, value]
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        Out { value: self.words[6], ready: self.ready.into() }
    }
}

impl Step for Sinc3 {
    fn registers(&self) -> Vec<Register> {
        let word = |name| Register::new(name, self.word());
        let count = Register::new("count", Format::unsigned(self.ratio_width));
        let words = ["sum1", "sum2", "sum3", "last1", "last2", "last3", "value"].map(word);
        [vec![count], words.to_vec(), vec![Register::new("ready", Format::BIT)]].concat()
    }

    fn step<W: Word>(&self, registers: &[W], In { data, strobe }: In<W>) -> (Vec<W>, Out<W>) {
        let [count, sum1, sum2, sum3, last1, last2, last3, value, ready] = *registers else {
            unreachable!("nine registers")
        };
        let (zero, one, taken) = (W::int(0), W::int(1), strobe.is_set());
        let last = count.equals(W::int((1 << self.ratio_width) - 1));
        let x = W::select(data.is_set(), one, -one);
        let words = [sum1, sum2, sum3, last1, last2, last3, value];
        let next = W::branch(taken, || self.made(words, x, last), || words);
        let [count] = W::branch(taken, || [(count + one).wrap(Format::unsigned(self.ratio_width))], || [count]);
        let is_ready = W::select(taken, W::of_bit(last), zero);
        ([vec![count], next.to_vec(), vec![is_ready]].concat(), Out { value, ready })
    }
}

crate::base::listed::configured! {
    Sinc3 of |block| {
        "RATIO_WIDTH": u32 = 7, block.ratio_width;
    }
}

impl Block for Sinc3 {
    const NAME: &'static str = "sinc3";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        (self.count, self.words, self.ready) = (0, [0; 7], false);
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.ready = false;
        if input.strobe != 0 {
            self.count = (self.count + 1) & ((1 << self.ratio_width) - 1);
            self.ready = self.count == 0;
            let x = if input.data == 0 { -1 } else { 1 };
            let before = self.words.map(Machine::<i64>::of);
            self.words = self.made(before, Machine::int(x), self.ready).map(|word| word.narrowed().word);
        }
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.strobe == 0 && !self.ready { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
    }
}

impl Listed for Sinc3 {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("4_bits", Self::new(2)?), ("32_bits", Self::new(5)?)])
    }
}
