//! Forward kinematics: the position of the tip.
//!
//! - **Equation**: `radius = L1 cos(q2) + L2 sin(q3)`, `x = sin(q1) radius`, `y = L2 - L2 cos(q3) + L1 sin(q2)`,
//!   `z = cos(q1) radius - L1`; `x` and `z` are made of the narrowed `radius`. `L1 = LENGTH_1 / 2^LENGTH_FRAC` metres,
//!   likewise `L2`. Every sum of products is exact and narrowed once, to the nearest, ties up.
//! - **Ports**: `sine1` `cosine1` `sine2` `cosine2` `sine3` `cosine3` (1,TRIG_INT,TRIG_FRAC) in; `x` `y` `z` `radius`
//!   (1,POSITION_INT,POSITION_FRAC), in metres, out.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: wraps. [`eval`](PhantomForward::eval) tells what was lost; the loss of `radius` is told of `radius`
//!   alone.
//! - **VHDL twin**: `hdl/phantom_forward.vhd`.
//! - **Source**: the kinematics of Çavuşoğlu et al. 2002, as used by Sevcik et al. 2009.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Word};

use super::Formats;
use super::variants::paths;
use crate::base::config::{NATURAL, within};
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::{accept, accept_trig, aligned_sum, natural, nearest, parts};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Generic, Step};

hpu_signal::ports! {
    /// Inputs of the kinematics.
    pub struct In of |block: &PhantomForward| {
        sine1: block.trig, "1", "Sine of joint 1";
        cosine1: block.trig, "1", "Cosine of joint 1";
        sine2: block.trig, "1", "Sine of joint 2";
        cosine2: block.trig, "1", "Cosine of joint 2";
        sine3: block.trig, "1", "Sine of joint 3";
        cosine3: block.trig, "1", "Cosine of joint 3";
    }
    /// Outputs of the kinematics.
    pub struct Out of |block: &PhantomForward| {
        x: block.position, "m", "Tip to the right of the origin";
        y: block.position, "m", "Tip above the origin";
        z: block.position, "m", "Tip before the origin";
        radius: block.position, "m", "Distance of the tip from the vertical axis of joint 1";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PhantomForward {
    trig: Format,
    length_frac: i32,
    lengths: [i128; 2],
    position: Format,
    fits_64: bool,
}

impl PhantomForward {
    /// Returns the kinematics with these words. It uses only those `formats` that its ports have.
    ///
    /// # Errors
    ///
    /// Returns an error unless the words are signed with 2 to 40 bits, 0 to 30 of them fraction bits (sines: an integer
    /// bit and 4 fraction bits at least), and the lengths are positive VHDL `natural`s with at most 30 fraction bits.
    pub fn new(formats: &Formats, lengths: [u32; 2]) -> Result<Self, ConfigError> {
        let Formats { trig, length_frac, position, .. } = *formats;
        accept_trig(Self::NAME, trig)?;
        accept(Self::NAME, "POSITION", position, true)?;
        within(Self::NAME, "LENGTH_FRAC", length_frac, 0..=30)?;
        within(Self::NAME, "LENGTH_1", lengths[0], 1..=NATURAL)?;
        within(Self::NAME, "LENGTH_2", lengths[1], 1..=NATURAL)?;
        let (length_frac, lengths) = (length_frac.cast_signed(), lengths.map(i128::from));
        let mut block = Self { trig, length_frac, lengths, position, fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the position, and which bits were lost to make it.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }
}

impl Combinational for PhantomForward {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let In { sine1, cosine1, sine2, cosine2, sine3, cosine3 } = input;
        let ([upper, fore], length_frac) = (self.lengths.map(W::int), self.length_frac);
        let (trig_frac, position) = (self.trig.frac(), self.position);

        let frac = length_frac + trig_frac;
        let radius = (upper * cosine2 + fore * sine3).narrow(&nearest(frac, position)).cut("r", position.width());
        let rise = fore.shl(trig_frac.cast_unsigned()) - fore * cosine3 + upper * sine2;
        let y = rise.narrow(&nearest(frac, position));

        // The loss of the radius is reported for the radius alone.
        let (reach, frac) = (radius.shed(), position.frac() + trig_frac);
        let x = (sine1 * reach).narrow(&nearest(frac, position));
        let (depth, depth_frac) = aligned_sum((cosine1 * reach, frac), (-upper, length_frac));
        let z = depth.narrow(&nearest(depth_frac, position));
        Out { x, y, z, radius }
    }
}

impl Default for PhantomForward {
    fn default() -> Self {
        Self::new(&Formats::default(), [2_348_810; 2]).expect("the data sheet's default")
    }
}

impl Block for PhantomForward {
    const NAME: &'static str = "phantom_forward";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(PhantomForward);

impl PhantomForward {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        let length = |index: usize| u32::try_from(self.lengths[index]).expect("a natural");
        let mut all = parts("TRIG_INT", "TRIG_FRAC", self.trig).to_vec();
        all.push(natural("LENGTH_FRAC", self.length_frac.cast_unsigned()));
        all.push(natural("LENGTH_1", length(0)));
        all.push(natural("LENGTH_2", length(1)));
        all.extend(parts("POSITION_INT", "POSITION_FRAC", self.position));
        all
    }
}

impl Configured for PhantomForward {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(&Formats::given(given)?, given.naturals(["LENGTH_1", "LENGTH_2"])?)
    }
}

impl Listed for PhantomForward {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        // A position drops one bit of its products here.
        let format = |int, frac| Format::new(true, int, frac).expect("26 bits");
        let one_bit = Formats { trig: format(1, 14), length_frac: 12, position: format(0, 25), ..Formats::default() };
        let own = ("one_bit", Self::new(&one_bit, [573; 2])?);
        let others =
            paths().into_iter().map(|(label, config)| Ok((label, Self::new(&config.formats, config.lengths)?)));
        [Ok(own)].into_iter().chain(others).collect()
    }
}
