//! Velocity by Levant's differentiator, a sliding mode (super-twisting), in fixed point.
//!
//! - **Equation**: at a sample edge `e = (z - position * 2^V) mod 2^(WIDTH+V)` as two's complement, `s` its sign, and
//!   `r = floor(sqrt(|e| 2^V))`; at the load `z' = (z + W - s floor(ROOT_GAIN r / 2^8)) mod 2^(WIDTH+V)` and `W' =
//!   clamp(W - s SLEW)`, with `V = OUT_FRAC` and `W` the velocity.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `velocity`
//!   (1,WIDTH-1,OUT_FRAC) out, in counts per capture, which is a sample where the period exceeds the latency.
//! - **Latency**: `ceil((WIDTH + 2 OUT_FRAC) / 2) + 2` edges from a sample edge to the velocity.
//! - **Edge**: a sample edge (countdown 0, then `max(period,1) - 1`) captures; the next starts the root; at the load,
//!   `z` and the velocity change. Sample edges up to and including that of the load are passed over.
//! - **Reset**: all 0, idle; the first edge samples.
//! - **Overflow**: the error wraps with the counter, the velocity saturates.
//! - **VHDL twin**: `hdl/levant_differentiator.vhd`, around a `square_root`.
//! - **Source**: Levant 1998 with the gains `1.5 sqrt(L)` and `1.1 L`, `L` a bound of the acceleration; as a velocity
//!   estimator of haptic devices Chawda, Celik and O'Malley 2011. The velocity is the part of `z`'s slope that does not
//!   jump.
//! - **Known failures**: above an acceleration of `L` the estimate loses the motion, and finds it again late. Well
//!   below it the velocity chatters by about `SLEW`, also at rest, and so the block is never quiet for longer than a
//!   sample.
//! - **Differs from the hardware**: the papers step in floats. The emulator computes the root at the sample edge and
//!   shows the velocity at the load: the ports are exact at every edge, the registers of the root are not modelled.

use hpu_signal::{Format, Int, Machine, Narrowed, Narrowing, Overflow, Reach, Rounding, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::base::sequence::{Sequence, captures, loads_before_it_reads};
use crate::{Block, ConfigError, Lemma, Register, SquareRoot, Step, arithmetic::square_root};

hpu_signal::ports! {
    /// Inputs of the estimator.
    pub struct In of |block: &LevantDifferentiator| {
        position: Format::unsigned(block.config.width), "count", "Position, modulo its width";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the estimator.
    pub struct Out of |block: &LevantDifferentiator| {
        velocity: block.slope.to, "count/sample", "Estimated motion in a sample";
    }
}

crate::base::listed::configuration! {
    /// The widths and gains of a Levant differentiator.
    pub struct LevantConfig {
        /// Width of the position, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Number of fraction bits of the velocity.
        out_frac: u32 = 8, ["OUT_FRAC"];
        /// Slope for an error of one count, in counts per sample, with 8 fraction bits.
        root_gain: u32 = 94, ["ROOT_GAIN"];
        /// Velocity added in a sample, in LSBs of the velocity.
        slew: u32 = 17, ["SLEW"];
    }
}

/// Fraction bits of [`LevantConfig::root_gain`].
const GAIN_FRAC: u32 = 8;

/// A Levant differentiator; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LevantDifferentiator {
    config: LevantConfig,
    /// The estimate of the position, modulo the counter.
    estimate: Format,
    error: Format,
    slope: Narrowing,
    root: SquareRoot,
    root_width: u32,
    fits_64: bool,
    sequence: Sequence<Registers<Narrowed>>,
}

hpu_signal::ports! {
    /// The registers from which a capture begins, and those after it.
    pub struct Registers { estimate, slope }
}

const RESET: Registers<Narrowed> = Registers { estimate: ZERO, slope: ZERO };

impl LevantDifferentiator {
    /// Returns an estimator with these widths and gains.
    ///
    /// # Errors
    ///
    /// Returns an error unless position and velocity have 2 to 62 bits, `width + 2 out_frac` is 3 to 62, the period has
    /// 2 to 30 bits, and the gains are less than 2^20.
    pub fn new(config: LevantConfig) -> Result<Self, ConfigError> {
        let LevantConfig { width, period_width, out_frac, root_gain, slew } = config;
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "OUT_FRAC", out_frac, 0..=30)?;
        within(Self::NAME, "WIDTH + 2 OUT_FRAC", width + 2 * out_frac, 3..=62)?;
        within(Self::NAME, "ROOT_GAIN", root_gain, 0..=(1 << 20) - 1)?;
        within(Self::NAME, "SLEW", slew, 0..=(1 << 20) - 1)?;
        let (int, frac) = (width.cast_signed(), out_frac.cast_signed());
        let root_width = 2 * (width + 2 * out_frac).div_ceil(2);
        let velocity = Format::new(true, int - 1, frac).expect("2 to 62 bits");
        let mut block = Self {
            config,
            estimate: Format::unsigned(width + out_frac),
            error: Format::signed(width + out_frac),
            slope: Narrowing {
                from_frac: frac,
                to: velocity,
                rounding: Rounding::Truncate,
                overflow: Overflow::Saturate,
            },
            root: SquareRoot::new(root_width)?,
            root_width,
            fits_64: false,
            // One edge starts the root, one takes it.
            sequence: Sequence::new(root_width / 2 + 2, RESET),
        };
        block.fits_64 = block.reaches_64();
        Ok(block)
    }

    /// Returns the velocity, and which bits the latest sample lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.sequence.loaded().slope
    }

    fn reaches_64(&self) -> bool {
        let last = Registers { estimate: Reach::of(self.estimate), slope: Reach::of(self.slope.to) };
        let error = self.error_of(last.estimate, Reach::of(Format::unsigned(self.config.width)));
        let Registers { estimate, slope } =
            self.moved(&last, Reach::of(Format::BIT), Reach::of(Format::BIT), Reach::of(self.root_format()));
        Reach::fit_64(&[self.radicand(error), estimate, slope])
    }

    fn root_format(&self) -> Format {
        Format::unsigned(self.root_width / 2)
    }

    /// Returns how far the estimate is ahead of the position.
    #[inline]
    fn error_of<W: Word>(&self, estimate: W, position: W) -> W {
        (estimate - position.shl(self.config.out_frac)).wrap(self.error)
    }

    /// Returns the number under the root.
    #[inline]
    fn radicand<W: Word>(&self, error: W) -> W {
        error.greater(-error).shl(self.config.out_frac)
    }

    /// Returns the registers after a load, from those before it, the sign of the error and its root.
    #[inline]
    fn moved<W: Word>(&self, last: &Registers<W>, negative: W, zero: W, root: W) -> Registers<W> {
        let (slope, step) = (last.slope.shed(), (W::int(self.config.root_gain.into()) * root).shr(GAIN_FRAC));
        let by = |step: W| {
            let moves = || W::branch(negative.is_set(), || [slope + step], || [slope - step]);
            let [sum] = W::branch(zero.is_set(), || [slope], moves);
            sum
        };
        Registers {
            estimate: (last.estimate + by(step)).wrap(self.estimate),
            slope: by(W::int(self.config.slew.into())).narrow(&self.slope),
        }
    }

    /// Returns the registers after a capture at that position.
    #[inline]
    fn capture(&self, last: &Registers<Narrowed>, position: i64) -> Registers<Narrowed> {
        if self.fits_64 { self.captured::<i64>(last, position) } else { self.captured::<i128>(last, position) }
    }

    #[inline]
    fn captured<T: Int>(&self, last: &Registers<Narrowed>, position: i64) -> Registers<Narrowed> {
        let last = last.map(Machine::<T>::of_narrowed);
        let error = self.error_of(last.estimate, Machine::of(position));
        let root = SquareRoot::root(self.radicand(error).narrowed().word);
        let is = |bit: bool| Machine::of(bit.into());
        let zero = Machine::of(0);
        self.moved(&last, is(zero.above(error)), is(error.equals(zero)), Machine::of(root.word)).map(Machine::narrowed)
    }
}

/// The registers are those of the VHDL, including those of its root.
impl Step for LevantDifferentiator {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![
            Register::new("countdown", Format::unsigned(self.config.period_width)),
            Register::new("estimate", self.estimate),
            Register::new("negative", Format::BIT),
            Register::new("zero", Format::BIT),
            Register::new("start", Format::BIT),
            Register::new("radicand", Format::unsigned(self.root_width)),
            Register::new("slope", self.slope.to),
        ];
        all.extend(Register::inside("root_of_error", &self.root));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { position, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, estimate, negative, zero, start, x, velocity, ref root @ ..] = *registers else {
            unreachable!("registers")
        };
        let (rooting, made) = self.root.step(root, square_root::In { start, x });
        let (left, captures) = captures(left, period, [start, made.busy, made.ready]);
        let captured = || {
            let (error, zero) = (self.error_of(estimate, position), W::int(0));
            [W::of_bit(zero.above(error)), W::of_bit(error.equals(zero)), self.radicand(error)]
        };
        let [sign, none, radicand] = W::branch(captures, captured, || [negative, zero, x]);
        let loaded = || {
            let last = Registers { estimate, slope: velocity };
            let Registers { estimate, slope } = self.moved(&last, negative, zero, made.root);
            [estimate, slope]
        };
        let [estimate, slope] = W::branch(made.ready.is_set(), loaded, || [estimate, velocity]);
        let own = [left, estimate, sign, none, W::of_bit(captures), radicand, slope];
        ([&own[..], &rooting].concat(), Out { velocity })
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        vec![loads_before_it_reads(self, 7, 4)]
    }
}

crate::base::listed::configured!(LevantDifferentiator: LevantConfig);

impl Block for LevantDifferentiator {
    const NAME: &'static str = "levant_differentiator";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.sequence.reset(RESET);
        Out { velocity: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.sequence.tick(input.period) {
            self.sequence.captures(self.capture(self.sequence.loaded(), input.position));
        }
        Out { velocity: self.latest().word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        self.sequence.quiet(input.period, |last| self.capture(last, input.position) == *last)
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.sequence.skip(edges, input.period);
    }
}

impl Listed for LevantDifferentiator {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let levant = |[width, period_width, out_frac, root_gain, slew]: [u32; 5]| {
            Self::new(LevantConfig { width, period_width, out_frac, root_gain, slew })
        };
        Ok(vec![
            ("4_bit", levant([4, 5, 1, 300, 1])?),
            // The velocity saturates within some samples, and the estimate jumps across the counter's end.
            ("abrupt", levant([6, 6, 2, 2000, 70])?),
            ("integer", levant([7, 6, 0, 400, 1])?),
            ("wide", levant([30, 6, 16, 70_000, 900_001])?),
        ])
    }
}
