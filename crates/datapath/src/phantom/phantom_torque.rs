//! Transposed Jacobian: the joint torques that produce a force on the tip.
//!
//! - **Equation**: `radial = sin(q1) Fx + cos(q1) Fz`, `upper = cos(q2) Fy - sin(q2) radial`,
//!   `fore = sin(q3) Fy + cos(q3) radial`, all narrowed to the force with one integer bit more; then
//!   `torque1 = (z + L1) Fx - x Fz`, `torque2 = L1 upper`, `torque3 = L2 fore`. `L1 = LENGTH_1 / 2^LENGTH_FRAC` metres,
//!   likewise `L2`. Every sum of products is exact and narrowed once, to the nearest, ties up.
//! - **Ports**: `sine1` `cosine1` `sine2` `cosine2` `sine3` `cosine3` (1,TRIG_INT,TRIG_FRAC), `x` `z`
//!   (1,POSITION_INT,POSITION_FRAC) in metres, `force_x` `force_y` `force_z` (1,FORCE_INT,FORCE_FRAC) in newtons, in;
//!   `torque1` `torque2` `torque3` (1,TORQUE_INT,TORQUE_FRAC) in N.m out.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: wraps. [`eval`](PhantomTorque::eval) tells what was lost on the way to each torque.
//! - **VHDL twin**: `hdl/phantom_torque.vhd`.
//! - **Source**: the Jacobian of those kinematics (Çavuşoğlu et al. 2002), as used by Sevcik et al. 2009.
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
    /// Inputs of the Jacobian.
    pub struct In of |block: &PhantomTorque| {
        sine1: block.formats.trig, "1", "Sine of joint 1";
        cosine1: block.formats.trig, "1", "Cosine of joint 1";
        sine2: block.formats.trig, "1", "Sine of joint 2";
        cosine2: block.formats.trig, "1", "Cosine of joint 2";
        sine3: block.formats.trig, "1", "Sine of joint 3";
        cosine3: block.formats.trig, "1", "Cosine of joint 3";
        x: block.formats.position, "m", "Tip to the right of the origin";
        z: block.formats.position, "m", "Tip before the origin";
        force_x: block.formats.force, "N", "Force on the tip to the right";
        force_y: block.formats.force, "N", "Force on the tip upwards";
        force_z: block.formats.force, "N", "Force on the tip towards the user";
    }
    /// Outputs of the Jacobian.
    pub struct Out of |block: &PhantomTorque| {
        torque1: block.formats.torque, "N.m", "Torque about joint 1";
        torque2: block.formats.torque, "N.m", "Torque about joint 2";
        torque3: block.formats.torque, "N.m", "Torque about joint 3";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PhantomTorque {
    formats: Formats,
    lengths: [u32; 2],
    beam: Format,
    fits_64: bool,
}

impl PhantomTorque {
    /// Returns the Jacobian with these words.
    ///
    /// # Errors
    ///
    /// Returns an error unless the words are signed with 2 to 40 bits, 0 to 30 of them fraction bits (sines: an integer
    /// bit and 4 fraction bits at least; forces: 39 bits at most), and the lengths are positive VHDL `natural`s with at
    /// most 30 fraction bits.
    pub fn new(formats: &Formats, lengths: [u32; 2]) -> Result<Self, ConfigError> {
        let Formats { trig, length_frac, position, force, torque, .. } = *formats;
        accept_trig(Self::NAME, trig)?;
        within(Self::NAME, "LENGTH_FRAC", length_frac, 0..=30)?;
        within(Self::NAME, "LENGTH_1", lengths[0], 1..=NATURAL)?;
        within(Self::NAME, "LENGTH_2", lengths[1], 1..=NATURAL)?;
        accept(Self::NAME, "POSITION", position, true)?;
        accept(Self::NAME, "FORCE", force, true)?;
        within(Self::NAME, "FORCE's width", force.width(), 2..=39)?;
        accept(Self::NAME, "TORQUE", torque, true)?;
        let beam = Format::new(true, force.int() + 1, force.frac()).expect("at most 40 bits");
        let mut block = Self { formats: *formats, lengths, beam, fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the torques, and which bits were lost to make them.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }
}

impl Combinational for PhantomTorque {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let In { sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, force_x, force_y, force_z } = input;
        let Formats { trig, position, force, torque, .. } = self.formats;
        let [upper_m, fore_m] = self.lengths.map(|length| W::int(length.into()));
        let length_frac = self.formats.length_frac.cast_signed();

        let beam = nearest(trig.frac() + force.frac(), self.beam);
        let radial = (sine1 * force_x + cosine1 * force_z).narrow(&beam).cut("radial", self.beam.width());
        let upper = (cosine2 * force_y - sine2 * radial).narrow(&beam).cut("upper", self.beam.width());
        let fore = (sine3 * force_y + cosine3 * radial).narrow(&beam).cut("fore", self.beam.width());

        let (reach, reach_frac) = aligned_sum((z, position.frac()), (upper_m, length_frac));
        let (aside, _) = aligned_sum((x, position.frac()), (W::int(0), reach_frac));
        // A length is a VHDL `natural`.
        let bits = |width: u32, frac: i32| width + (reach_frac - frac).cast_unsigned();
        let room = bits(position.width(), position.frac()).max(bits(32, length_frac)) + 1;
        let (reach, aside) = (reach.cut("arm_z", room), aside.cut("arm_x", room));
        let torque1 = (reach * force_x - aside * force_z).narrow(&nearest(reach_frac + force.frac(), torque));
        let lever = nearest(length_frac + force.frac(), torque);
        Out { torque1, torque2: (upper_m * upper).narrow(&lever), torque3: (fore_m * fore).narrow(&lever) }
    }
}

impl Default for PhantomTorque {
    fn default() -> Self {
        Self::new(&Formats::default(), [2_348_810; 2]).expect("the data sheet's default")
    }
}

impl Block for PhantomTorque {
    const NAME: &'static str = "phantom_torque";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(PhantomTorque);

impl PhantomTorque {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        let Formats { trig, length_frac, position, force, torque, .. } = self.formats;
        let mut all = parts("TRIG_INT", "TRIG_FRAC", trig).to_vec();
        all.push(natural("LENGTH_FRAC", length_frac));
        all.push(natural("LENGTH_1", self.lengths[0]));
        all.push(natural("LENGTH_2", self.lengths[1]));
        all.extend(parts("POSITION_INT", "POSITION_FRAC", position));
        all.extend(parts("FORCE_INT", "FORCE_FRAC", force));
        all.extend(parts("TORQUE_INT", "TORQUE_FRAC", torque));
        all
    }
}

impl Configured for PhantomTorque {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(&Formats::given(given)?, given.naturals(["LENGTH_1", "LENGTH_2"])?)
    }
}

impl Listed for PhantomTorque {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        paths().into_iter().map(|(label, config)| Ok((label, Self::new(&config.formats, config.lengths)?))).collect()
    }
}
