//! First-order adaptive windowing (FOAW), end-fit: uses the longest window of samples that a straight line explains.
//!
//! - **Equation**: with `x_j` the position `j` samples ago and `e_j = x_0 - x_j`, modulo `2^WIDTH` as two's complement,
//!   `velocity = floor(e_n * 2^OUT_FRAC / n)`, where `n` is the last one accepted of `1, 2, .. WINDOW` in order:
//!   `n = 1` always is, and a further one if `|n e_j - j e_n| <= n NOISE` for all `j = 1 .. n-1`. The first that fails
//!   ends the search. Positions before the first sample count as 0.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `velocity`
//!   (1,WIDTH-1,OUT_FRAC) out, in counts per sample.
//! - **Latency**: 1 edge after a sample edge, up to `period`; the velocity is that of `n/2` samples ago.
//! - **Edge**: with the countdown at 0, `velocity` is loaded, the positions move on, and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdown, positions and velocity 0; the first edge samples.
//! - **Overflow**: motion of half the counter's range in a window aliases.
//! - **VHDL twin**: `hdl/foaw.vhd`.
//! - **Source**: Janabi-Sharifi, Hayward and Chen 2000. `NOISE` = 1 count explains a counter at constant speed.
//! - **Differs from the hardware**: all windows are tried in one edge, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Term, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::history::History;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ClockEdge, ConfigError, Generic, Lemma, Register, Step};

hpu_signal::ports! {
    /// Inputs of the estimator.
    pub struct In of |block: &Foaw| {
        position: Format::unsigned(block.config.width), "count", "Position, modulo its width";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the estimator.
    pub struct Out of |block: &Foaw| {
        velocity: block.velocity, "count/sample", "Slope of the latest straight window";
    }
}

crate::base::listed::configuration! {
    /// The widths and bounds of an adaptive window.
    pub struct FoawConfig {
        /// Width of the position.
        width: u32 = 12, ["WIDTH"];
        /// Width of the period.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// The longest window, in samples.
        window: u32 = 8, ["WINDOW"];
        /// Bound of the position's noise, in counts.
        noise: u32 = 1, ["NOISE"];
        /// Fraction bits of the velocity.
        out_frac: u32 = 8, ["OUT_FRAC"];
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Foaw {
    config: FoawConfig,
    difference: Format,
    velocity: Format,
    countdown: Countdown,
    history: History,
    latest: Narrowed,
}

/// The velocity at standstill, and after reset.
const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl Foaw {
    /// Returns an estimator with these widths and bounds.
    ///
    /// # Errors
    ///
    /// Returns an error unless the position has 2 to 48 bits, the velocity at most 62, 0 to 30 of them fraction bits,
    /// the period 2 to 30, the window is 2 to 16 and the noise 0 to 15.
    pub fn new(config: FoawConfig) -> Result<Self, ConfigError> {
        let FoawConfig { width, period_width, window, noise, out_frac } = config;
        within(Self::NAME, "WIDTH", width, 2..=48)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "WINDOW", window, 2..=16)?;
        within(Self::NAME, "NOISE", noise, 0..=15)?;
        within(Self::NAME, "OUT_FRAC", out_frac, 0..=30)?;
        within(Self::NAME, "WIDTH + OUT_FRAC", width + out_frac, WORD)?;
        Ok(Self {
            config,
            difference: Format::signed(width),
            velocity: Format::new(true, width.cast_signed() - 1, out_frac.cast_signed()).expect("2 to 62 bits"),
            countdown: Countdown::default(),
            history: History::new(window),
            latest: ZERO,
        })
    }

    /// Returns the velocity, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the velocity that a sample edge loads after `waiting` other sample edges with this same position.
    #[inline]
    fn sample(&self, position: i64, waiting: usize) -> Narrowed {
        let window = self.history.window();
        let mut ends = [0; 17];
        for (back, end) in ends.iter_mut().enumerate().take(window + 1).skip(1) {
            let start = self.history.ago(position, waiting, back);
            *end = self.difference.wrap(i128::from(position - start));
        }
        let noise = i64::from(self.config.noise);
        // Compares j/n of the motion over a window of n with the motion over its last j samples.
        let straight = |n: usize| {
            let within = |j: usize| (n as i64 * ends[j] - j as i64 * ends[n]).abs() <= n as i64 * noise;
            (1..n).all(within)
        };
        let longest = (2..=window).take_while(|&n| straight(n)).last().unwrap_or(1);
        let (motion, samples) = (ends[longest] * (1 << self.config.out_frac), longest as i64);
        Narrowed { word: motion.div_euclid(samples), rounded: motion % samples != 0, overflowed: false }
    }
}

/// The equations of the VHDL, which multiplies by a reciprocal instead of dividing.
impl Foaw {
    /// Returns the number of fraction bits of a reciprocal.
    fn ratio_frac(&self) -> u32 {
        self.velocity.width() + 4
    }

    /// Returns `floor(2^frac / n)`.
    fn reciprocal<W: Word>(&self, n: usize) -> W {
        W::int((1 << self.ratio_frac()) / n as i128)
    }

    /// Returns the distance over the longest straight window, times the reciprocal of its number of samples.
    fn slope<W: Word>(&self, position: W, earlier: &[W]) -> W {
        let (noise, width) = (i128::from(self.config.noise), self.difference.width());
        let ends: Vec<_> = earlier.iter().map(|&earlier| (position - earlier).wrap(self.difference)).collect();
        let mut fits = W::int(0).equals(W::int(0));
        let mut longest = [ends[0], self.reciprocal(1)];
        for n in 2..=ends.len() {
            let (samples, limit) = (n as i128, W::int(n as i128 * noise));
            for j in 1..n {
                let miss = ends[j - 1] * W::int(samples) - ends[n - 1] * W::int(j as i128);
                fits = fits & limit.at_least(miss) & miss.at_least(-limit);
            }
            longest = W::branch(fits, || [ends[n - 1], self.reciprocal(n)], || longest);
        }
        let [distance, ratio] = longest;
        self.divided(distance.cut("distance", width), ratio.cut("ratio", self.ratio_frac() + 2))
    }

    /// Divides a distance by the number of samples of this reciprocal, rounded down. The distance gets half a fraction
    /// bit more, so that the rounding of the reciprocal does not matter.
    fn divided<W: Word>(&self, distance: W, ratio: W) -> W {
        let frac = self.ratio_frac();
        let product = (distance.shl(self.config.out_frac + 1) + W::int(1)) * ratio;
        product.cut("product", self.velocity.width() + frac + 3).shr(frac + 1)
    }
}

impl Step for Foaw {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![
            Register::new("countdown", Format::unsigned(self.config.period_width)),
            Register::new("velocity", self.velocity),
        ];
        all.extend(self.history.registers("earlier", self.difference.width()));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { position, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, velocity, ref earlier @ ..] = *registers else { unreachable!("registers") };
        let (left, samples) = counted_down(left, period);
        let [latest] = W::branch(samples, || [self.slope(position, earlier)], || [velocity]);
        let mut next = vec![left, latest];
        next.extend(History::pushed(samples, position, earlier));
        (next, Out { velocity })
    }

    /// Claims that the product with a reciprocal, rounded down, is the quotient.
    fn lemmas(&self) -> Vec<Lemma<'_>> {
        let divides = |n: usize| Lemma {
            any: vec![self.difference],
            follows: Box::new(move |any| {
                let (zero, samples) = (Term::int(0), Term::int(n as i128));
                let quotient = self.divided(any[0], self.reciprocal(n));
                let rest = any[0].shl(self.config.out_frac) - quotient * samples;
                (zero.equals(zero), rest.at_least(zero) & samples.above(rest))
            }),
        };
        (2..=self.history.window()).map(divides).collect()
    }
}

crate::base::listed::configured!(Foaw: FoawConfig);

impl Block for Foaw {
    const NAME: &'static str = "foaw";
    const CLOCKED: bool = true;
    crate::base::block::described!();

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.told()
    }

    fn equations(&self) -> Option<ClockEdge<'_>> {
        // With wider words, the product does not fit a machine's integer.
        (self.velocity.width() < 60).then(|| ClockEdge::of(self))
    }

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.history.reset();
        self.latest = ZERO;
        Out { velocity: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(input.position, 0);
            self.history.push(input.position, 1);
        }
        Out { velocity: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // After a whole window of the same position, nothing changes any more.
        let change = (0..=self.history.window()).find(|&waiting| self.sample(input.position, waiting) != self.latest);
        change.map_or(u64::MAX, |samples| self.countdown.left() + samples as u64 * edges(input.period))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.history.push(input.position, self.countdown.samples(edges, input.period));
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for Foaw {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let adaptive = |[width, period_width, window, noise, out_frac]: [u32; 5]| {
            Self::new(FoawConfig { width, period_width, window, noise, out_frac })
        };
        Ok(vec![
            ("4_bit", adaptive([4, 4, 5, 2, 3])?),
            ("noiseless", adaptive([6, 6, 3, 0, 0])?),
            ("loose", adaptive([8, 6, 16, 15, 6])?),
            ("wide", adaptive([42, 4, 7, 1, 20])?),
            // With one fraction bit less of 1/11 the words would differ.
            ("eleven", adaptive([6, 4, 11, 15, 6])?),
        ])
    }
}
