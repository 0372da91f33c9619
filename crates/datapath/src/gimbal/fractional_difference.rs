//! Fractional derivative of Grünwald and Letnikov with a finite memory, one product an edge.
//!
//! - **Equation**: `y(n) = saturate(round(gain (w_0 u(n) + w_1 u(n-1) + .. + w_(MEMORY-1) u(n-MEMORY+1))))`, the sum
//!   exact. With `a = ORDER_NUM / ORDER_DEN`, the weights are those of `(1 - z)^a`: `w_0 = 1`, `w_k = w_(k-1)
//!   (k-1-a)/k`, as words of `COEF_FRAC` fraction bits: `m_0 = 2^(COEF_FRAC+10)`, `m_k = floor(m_(k-1) |p_k| / q_k +
//!   1/2)` with `p_k = (k-1) ORDER_DEN - ORDER_NUM`, `q_k = k ORDER_DEN`; `w_k` is `floor(m_k / 2^10 + 1/2)`, with the
//!   sign of the product of `p_1 .. p_k`.
//! - **Ports**: `u` (1,IN_INT,IN_FRAC), `gain` (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC), the sample period to the power of
//!   `-a`, `sample` (0,1,0) in; `y` (1,OUT_INT,OUT_FRAC) out.
//! - **Latency**: `MEMORY + 1` edges from a sample to `y`. Samples up to and including that edge are passed over, so
//!   that a sample period has at least `MEMORY + 2` edges. `gain` is read at the edge that loads `y`.
//! - **Reset**: y 0, all earlier samples 0. **Overflow**: rounds to the nearest, ties up, then saturates.
//! - **VHDL twin**: `hdl/fractional_difference.vhd`.
//! - **Source**: Grünwald and Letnikov; Podlubny 1999 for the finite memory. Pediredla et al. have shear stress as a
//!   fractional derivative of an order between 0 and 2.
//! - **Differs from the hardware**: a design of this project; the paper makes its reference offline. The emulator
//!   computes the sum at the sample: the ports are exact at every edge, the registers within are not modelled.
//!
//! A weight is at most 5/8 of its LSB away from the exact one: half by its own rounding, and 1/8 by the roundings of up
//! to 256 steps of the recursion, none of which enlarges the errors before it. [`memory_bound`] tells how much the
//! finite memory leaves out.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::within;
use crate::base::history::History;
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::base::words::accept;
use crate::{Block, ConfigError, Register, Rom, Step};

hpu_signal::ports! {
    /// Inputs of the derivative.
    pub struct In of |block: &FractionalDifference| {
        u: block.config.input, "1", "The function";
        gain: block.config.gain, "1", "Sample period to the power of minus the order";
        sample, "The edge samples";
    }
    /// Outputs of the derivative.
    pub struct Out of |block: &FractionalDifference| {
        y: block.narrowing.to, "1", "Fractional derivative";
    }
}

crate::base::listed::configuration! {
    /// The formats, order and memory of a fractional derivative.
    pub struct FractionalConfig {
        /// Format of `u`.
        input: Format = Format::new(true, 7, 8).expect("16 bits"), ["IN_INT", "IN_FRAC"];
        /// Format of `y`.
        output: Format = Format::new(true, 15, 8).expect("24 bits"), ["OUT_INT", "OUT_FRAC"];
        /// Format of the gain.
        gain: Format = Format::new(false, 16, 8).expect("24 bits"), ["GAIN_WIDTH", "GAIN_FRAC"];
        /// Number of fraction bits of the weights.
        coef_frac: u32 = 16, ["COEF_FRAC"];
        /// The order as a fraction: its numerator and its denominator.
        order: [u32; 2] = [1, 2], ["ORDER_NUM", "ORDER_DEN"];
        /// Number of samples that count, with the present one.
        memory: u32 = 16, ["MEMORY"];
    }
}

/// Fraction bits of the recursion beyond those of the weights.
const GUARD: u32 = 10;

/// Returns the sum of the absolute values of all weights from `w_memory` on: the share of a bound of `|u|` that a
/// memory of so many samples can leave out, before the gain. The order is between 0 and 2, the memory at least 2.
///
/// The weights from `w_2` on have one sign and all weights add up to 0, so this is the absolute value of the sum of the
/// first `memory` weights, which is the product of `1 - order / k` for `k = 1 .. memory - 1`.
pub fn memory_bound(order: f64, memory: u32) -> f64 {
    (1..memory).map(|k| 1.0 - order / f64::from(k)).product::<f64>().abs()
}

/// A fractional derivative; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FractionalDifference {
    config: FractionalConfig,
    /// Format of the sum, which holds any sum of the memory.
    sum: Format,
    narrowing: Narrowing,
    weights: Vec<i64>,
    /// The weights at the addresses `remaining`: that of the present sample at 2.
    table: Vec<i64>,
    /// Width of `remaining`.
    count_width: u32,
    fits_64: bool,
    history: History,
    /// Edges until `y` is loaded, with that edge; 0 when idle.
    left: u64,
    next: i64,
    latest: Narrowed,
}

/// Returns the words of the weights.
fn weights(coef_frac: u32, [num, den]: [u32; 2], memory: u32) -> Vec<i64> {
    let (num, den) = (i128::from(num), i128::from(den));
    let (mut magnitude, mut is_negative) = (1i128 << (coef_frac + GUARD), false);
    let mut all = Vec::new();
    for k in 0..i128::from(memory) {
        if k > 0 {
            let (p, q) = ((k - 1) * den - num, k * den);
            magnitude = (2 * magnitude * p.abs() + q) / (2 * q);
            is_negative ^= p < 0;
        }
        let word = (magnitude + (1 << (GUARD - 1))) >> GUARD;
        all.push(i64::try_from(if is_negative { -word } else { word }).expect("at most 32 bits"));
    }
    all
}

impl FractionalDifference {
    /// Returns a fractional derivative.
    ///
    /// # Errors
    ///
    /// Returns an error unless the order is above 0 and below 2 with a denominator of at most 1000, the memory is 2 to
    /// 254, the input is signed with 2 to 40 bits, 0 to 30 of them fraction bits, the gain is unsigned with the same
    /// limits, the output is signed with at most 40 bits and no more fraction bits than the exact product, and input
    /// and weights have at most 57 bits together.
    pub fn new(config: FractionalConfig) -> Result<Self, ConfigError> {
        let FractionalConfig { input, output, gain, coef_frac, order: [num, den], memory } = config;
        within(Self::NAME, "ORDER_DEN", den, 1..=1000)?;
        if num == 0 || num >= 2 * den {
            let found = format!("the order is ORDER_NUM / ORDER_DEN = {num}/{den}");
            return Err(ConfigError::new(Self::NAME, found, "orders above 0 and below 2"));
        }
        within(Self::NAME, "MEMORY", memory, 2..=254)?;
        within(Self::NAME, "COEF_FRAC", coef_frac, 1..=30)?;
        for (word, format) in [("IN", input), ("OUT", output)] {
            // A word may have more fraction bits than bits: it is then a value below 1/2.
            if !(format.is_signed() && (2..=40).contains(&format.width()) && (0..=30).contains(&format.frac())) {
                let accepted = "signed, 2 to 40 bits, 0 to 30 of them fraction bits";
                return Err(ConfigError::new(Self::NAME, format!("{word} is {format}"), accepted));
            }
        }
        accept(Self::NAME, "GAIN", gain, false)?;
        within(Self::NAME, "IN_INT + IN_FRAC + 1 + COEF_FRAC", input.width() + coef_frac, 3..=57)?;
        let sum_frac = input.frac() + coef_frac.cast_signed();
        let narrowing = Narrowing {
            from_frac: sum_frac + gain.frac(),
            to: output,
            rounding: Rounding::NearestUp,
            overflow: Overflow::Saturate,
        };
        let most = narrowing.from_frac.unsigned_abs();
        within(Self::NAME, "OUT_FRAC", output.frac().unsigned_abs(), 0..=most)?;
        let weights = weights(coef_frac, [num, den], memory);
        // The weights of an exact recursion add up to less than 4 in magnitude. Coarse ones may add up to more.
        if weights.iter().map(|weight| weight.abs()).sum::<i64>() >= 8 << coef_frac {
            let found = format!("COEF_FRAC is {coef_frac} for a memory of {memory}");
            return Err(ConfigError::new(Self::NAME, found, "weights that add up to less than 8 in magnitude"));
        }
        let count_width = u32::BITS - (memory + 1).leading_zeros();
        let mut table = vec![0; 1 << count_width];
        table[2..2 + memory as usize].copy_from_slice(&weights);
        let mut block = Self {
            config,
            sum: Format::new(true, input.int() + 3, sum_frac).expect("at most 60 bits"),
            narrowing,
            weights,
            table,
            count_width,
            fits_64: false,
            history: History::new(memory),
            left: 0,
            next: 0,
            latest: ZERO,
        };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the derivative, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the weights, from that of the present sample on, in units of `2^-COEF_FRAC`.
    pub fn weights(&self) -> &[i64] {
        &self.weights
    }

    /// Returns the derivative of this sum.
    #[inline]
    fn gained<W: Word>(&self, gain: W, sum: W) -> W {
        (gain * sum).cut("product", self.sum.width() + self.config.gain.width() + 1).narrow(&self.narrowing)
    }

    /// Captures a sample.
    #[inline]
    fn capture(&mut self, u: i64) {
        self.history.push(u, 1);
        let past = (1..=self.weights.len()).map(|back| self.history.ago(u, 0, back));
        self.next = self.weights.iter().zip(past).map(|(weight, u)| weight * u).sum();
        self.left = u64::from(self.config.memory) + 1;
    }
}

/// The registers of the VHDL. The memory turns by one place at every product, and so is as before after all of them.
impl Step for FractionalDifference {
    fn registers(&self) -> Vec<Register> {
        let FractionalConfig { input, memory, .. } = self.config;
        let own = [
            Register::new("remaining", Format::unsigned(self.count_width)),
            Register::new("sum", self.sum),
            Register::new("y", self.narrowing.to),
        ];
        let width = input.width();
        let earlier = |ago| Register { low: (memory - 1 - ago) * width, ..Register::new("earlier", input) };
        own.into_iter().chain((0..memory).map(earlier)).collect()
    }

    fn step<W: Word>(&self, registers: &[W], In { u, gain, sample }: In<W>) -> (Vec<W>, Out<W>) {
        let [remaining, sum, y, ref earlier @ ..] = *registers else { unreachable!("registers") };
        let (zero, one) = (W::int(0), W::int(1));
        let begins = remaining.equals(zero) & sample.is_set();
        let adds = remaining.above(one);
        let oldest = earlier[earlier.len() - 1];
        let weighs = || {
            let weight = remaining.look_up(&self.table).cut("weight", self.config.coef_frac + 2);
            [remaining - one, (sum + weight * oldest).wrap(self.sum), y]
        };
        let ends = || {
            let ended = || [zero, sum, self.gained(gain, sum)];
            W::branch(remaining.is_set(), ended, || [remaining, sum, y])
        };
        let rests = || W::branch(adds, weighs, ends);
        let begun = || [W::int(i128::from(self.config.memory) + 1), zero, y];
        let mut next = W::branch(begins, begun, rests).to_vec();
        let enters = W::select(begins, u, oldest);
        next.extend(History::pushed(begins | adds, enters, earlier));
        (next, Out { y })
    }
}

crate::base::listed::configured!(FractionalDifference: FractionalConfig);

impl Block for FractionalDifference {
    const NAME: &'static str = "fractional_difference";
    crate::base::block::clocked!();

    fn roms(&self) -> Vec<Rom> {
        let format = Format::new(true, 1, self.config.coef_frac.cast_signed()).expect("at most 32 bits");
        vec![Rom { name: "weights", format, words: self.table.clone() }]
    }

    fn reset(&mut self) -> Out<i64> {
        self.history.reset();
        (self.left, self.next, self.latest) = (0, 0, ZERO);
        Out { y: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.left > 0 {
            self.left -= 1;
            if self.left == 0 {
                self.latest = if self.fits_64 {
                    self.gained(Machine::<i64>::of(input.gain), Machine::of(self.next)).narrowed()
                } else {
                    self.gained(Machine::<i128>::of(input.gain), Machine::of(self.next)).narrowed()
                };
            }
        } else if input.sample != 0 {
            self.capture(input.u);
        }
        Out { y: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        match (self.left, input.sample) {
            (0, 0) => u64::MAX,
            (0, _) => u64::from(self.config.memory) + 1,
            (left, _) => left - 1,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.left > 0 {
            self.left -= edges;
        } else if edges > 0 && input.sample != 0 {
            self.capture(input.u);
            self.left -= edges - 1;
        }
    }
}

impl Listed for FractionalDifference {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |signed, int, frac| Format::new(signed, int, frac).expect("a constant");
        let normal = FractionalConfig::default();
        let small = format(true, -2, 7);
        let narrow = FractionalConfig {
            input: format(true, 2, 1),
            output: format(true, 2, 3),
            gain: format(false, 2, 1),
            coef_frac: 4,
            order: [3, 2],
            memory: 3,
        };
        Ok(vec![
            ("narrow", Self::new(narrow)?),
            ("first_order", Self::new(FractionalConfig { order: [1, 1], memory: 4, ..narrow })?),
            ("small", Self::new(FractionalConfig { input: small, output: small, ..narrow })?),
            ("long", Self::new(FractionalConfig { order: [7, 5], memory: 64, ..normal })?),
        ])
    }
}

crate::circuit::part::registers!(FractionalDifference, self => Out { y: self.latest });
