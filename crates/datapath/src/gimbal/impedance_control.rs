//! Radial impedance with force feedback: the drive of the crank that makes the segment a spring.
//!
//! - **Equation**: `desired = clamp(round(stiffness (rest - radius)), 0, FORCE_LIMIT)` in force LSBs, `push = desired +
//!   feedback (desired - finger_force)`, exact, and `drive = saturate(round(slope push GAIN / 2^GAIN_FRAC))`.
//! - **Ports**: `rest`, `radius` (1,L,F) in metres and `slope` (1,L,F) in m/rad with `L = LENGTH_WIDTH - LENGTH_FRAC -
//!   1`, `F = LENGTH_FRAC`; `finger_force` (0,FORCE_WIDTH,0) in force LSBs; `stiffness` (0,S_WIDTH-S_FRAC,S_FRAC) in
//!   force LSBs per length LSB; `feedback` (0,K_WIDTH-K_FRAC,K_FRAC) in; `drive` (1,DRIVE_WIDTH-1,0) out.
//! - **Signs**: the segment pressed inwards has `radius < rest`, and `desired` pushes outwards, towards greater radii.
//!   `slope` is `dr/dpsi`, which is never positive between the dead centres of the crank: there, a `push` that is
//!   positive makes a negative drive, and this turns the crank towards `psi = 0`, outwards. `finger_force` is that of
//!   the finger on the segment, positive inwards.
//! - **Scale**: `GAIN / 2^GAIN_FRAC` is in drive counts per force LSB times length LSB per radian.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: the spring never pulls, and pushes with `FORCE_LIMIT` at most; the drive saturates. Both roundings
//!   are to the nearest, ties up.
//! - **VHDL twin**: `hdl/impedance_control.vhd`.
//! - **Source**: Pediredla et al., `tau = J^T (F_d + K_f (F_d - F))` with `F_d = k_d (dr_d - dr)`; the paper has `K_f`
//!   of 2 to 10 and `k_d` of 0.75 to 2 N/mm.
//! - **Differs from the hardware**: the paper's controller runs in software and sets no limit to the desired force. No
//!   propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{NATURAL, within};
use crate::base::listed::Listed;
use crate::base::words::{accept, limited};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Step};

hpu_signal::ports! {
    /// Inputs of the controller.
    pub struct In of |block: &ImpedanceControl| {
        rest: block.config.length, "m", "Radius at which the spring pushes with nothing";
        radius: block.config.length, "m", "Radius of the segment";
        slope: block.config.length, "m/rad", "Change of the radius with the angle of the crank";
        finger_force: Format::unsigned(block.config.force_width), "LSB", "Force of the finger, inwards";
        stiffness: block.config.stiffness, "1", "Force LSBs per length LSB";
        feedback: block.config.feedback, "1", "Gain of the force's error";
    }
    /// Outputs of the controller.
    pub struct Out of |block: &ImpedanceControl| {
        drive: block.narrowing.to, "count", "Command of the crank's servo";
    }
}

crate::base::listed::configuration! {
    /// The formats and constants of an impedance controller.
    ///
    /// The default is for lengths of 2^-22 m, a force of 10 N / 4096, a spring of at most 8 N, and a servo whose
    /// full scale of 2^10 counts is 0.118 N.m.
    pub struct ImpedanceConfig {
        /// Format of lengths, and of the change of the radius per radian of the crank.
        length: Format = Format::new(true, -3, 22).expect("20 bits"), ["LENGTH_WIDTH", "LENGTH_FRAC"];
        /// Width of the force, in bits.
        force_width: u32 = 12, ["FORCE_WIDTH"];
        /// The greatest force of the spring, in LSBs of the force.
        force_limit: u32 = 3277, ["FORCE_LIMIT"];
        /// Format of the stiffness, in force LSBs per length LSB.
        stiffness: Format = Format::new(false, 0, 16).expect("16 bits"), ["S_WIDTH", "S_FRAC"];
        /// Format of the gain of the force's error.
        feedback: Format = Format::new(false, 4, 4).expect("8 bits"), ["K_WIDTH", "K_FRAC"];
        /// Drive counts per force LSB times length LSB per radian, with `gain_frac` fraction bits.
        gain: u32 = 21_695, ["GAIN"];
        /// Fraction bits of `gain`.
        gain_frac: u32 = 32, ["GAIN_FRAC"];
        /// Width of the drive, in bits.
        drive_width: u32 = 11, ["DRIVE_WIDTH"];
    }
}

/// An impedance controller; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ImpedanceControl {
    config: ImpedanceConfig,
    narrowing: Narrowing,
    fits_64: bool,
}

impl ImpedanceControl {
    /// Returns a controller with these formats.
    ///
    /// # Errors
    ///
    /// Returns an error unless lengths are signed with 2 to 40 bits, 0 to 30 of them fraction bits, the force has 2 to
    /// 30 bits that hold its limit, stiffness and feedback are unsigned with 2 to 40 bits, 0 to 30 of them fraction
    /// bits, the gain is a positive VHDL `natural` with at most 40 fraction bits, and the drive has 2 to 31 bits.
    pub fn new(config: ImpedanceConfig) -> Result<Self, ConfigError> {
        let ImpedanceConfig { length, force_width, force_limit, stiffness, feedback, gain, gain_frac, drive_width } =
            config;
        if !(length.is_signed() && (2..=40).contains(&length.width()) && (0..=30).contains(&length.frac())) {
            let accepted = "signed, 2 to 40 bits, 0 to 30 of them fraction bits";
            return Err(ConfigError::new(Self::NAME, format!("LENGTH is {length}"), accepted));
        }
        within(Self::NAME, "FORCE_WIDTH", force_width, 2..=30)?;
        within(Self::NAME, "FORCE_LIMIT", force_limit, 0..=(1 << force_width) - 1)?;
        accept(Self::NAME, "S", stiffness, false)?;
        accept(Self::NAME, "K", feedback, false)?;
        within(Self::NAME, "GAIN", gain, 1..=NATURAL)?;
        within(Self::NAME, "GAIN_FRAC", gain_frac, 0..=40)?;
        within(Self::NAME, "DRIVE_WIDTH", drive_width, 2..=31)?;
        let narrowing = Narrowing {
            from_frac: feedback.frac() + gain_frac.cast_signed(),
            to: Format::signed(drive_width),
            rounding: Rounding::NearestUp,
            overflow: Overflow::Saturate,
        };
        let mut block = Self { config, narrowing, fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the drive, and which bits were lost to make it.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }
}

impl Combinational for ImpedanceControl {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let ImpedanceConfig { length, force_width, force_limit, stiffness, feedback, gain, .. } = self.config;
        let (of_length, of_force) = (length.width(), force_width + 1);
        let of_push = force_width + feedback.width() + 3;
        let stretch = (input.rest - input.radius).cut("stretch", of_length + 1);
        let spring = (input.stiffness * stretch).cut("spring", stiffness.width() + of_length + force_width + 4);
        let desired = limited(spring, stiffness.frac(), [0, force_limit.into()]).cut("desired", of_force);
        let lack = (desired - input.finger_force).cut("lack", of_force + 1);
        let push = desired.shl(feedback.frac().unsigned_abs()) + input.feedback * lack;
        let torque = (input.slope * push.cut("push", of_push)).cut("torque", of_length + of_push);
        let scaled = (torque * W::int(gain.into())).cut("scaled", of_length + of_push + 32);
        Out { drive: scaled.narrow(&self.narrowing) }
    }
}

crate::base::listed::configured!(ImpedanceControl: ImpedanceConfig);

impl Block for ImpedanceControl {
    const NAME: &'static str = "impedance_control";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

impl Listed for ImpedanceControl {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |signed, int, frac| Format::new(signed, int, frac).expect("a constant");
        let narrow = ImpedanceConfig {
            length: format(true, 0, 4),
            force_width: 4,
            force_limit: 11,
            stiffness: format(false, 1, 2),
            feedback: format(false, 2, 1),
            gain: 5,
            gain_frac: 6,
            drive_width: 5,
        };
        // Products that round nothing away, and a spring as strong as a word.
        let whole = ImpedanceConfig {
            length: format(true, 5, 0),
            force_limit: 15,
            stiffness: format(false, 4, 0),
            feedback: format(false, 3, 0),
            gain: 3,
            gain_frac: 0,
            drive_width: 12,
            ..narrow
        };
        let wide = ImpedanceConfig {
            length: format(true, -1, 30),
            force_width: 20,
            force_limit: 1_000_000,
            stiffness: format(false, 4, 20),
            feedback: format(false, 6, 10),
            gain: 1_999_999_999,
            gain_frac: 40,
            drive_width: 24,
        };
        Ok(vec![("narrow", Self::new(narrow)?), ("whole", Self::new(whole)?), ("wide", Self::new(wide)?)])
    }
}

crate::circuit::part::telling!(ImpedanceControl);
