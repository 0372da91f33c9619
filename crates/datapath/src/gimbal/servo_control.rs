//! Position control of one servo: proportional to the error, and to its change from sample to sample.
//!
//! - **Equation**: at a sample `measured = round(count STEP / 2^STEP_FRAC)`, `e = desired - measured`, exact and
//!   without wrapping, `d = e - e_before`, or 0 at the first sample after a reset, and `drive =
//!   saturate(round(proportional e + derivative d))`; then `e` becomes `e_before`.
//! - **Ports**: `desired` (1,0,ANGLE_WIDTH-1) in half turns, `count` (1,COUNT_WIDTH-1,0) of the servo's own sensor,
//!   `proportional` (0,P_WIDTH-P_FRAC,P_FRAC) in drive counts per half turn, `derivative` (0,D_WIDTH-D_FRAC,D_FRAC) in
//!   drive counts per half turn a sample, `sample` in; `drive` (1,DRIVE_WIDTH-1,0) out. The sample period is in the
//!   word of `derivative`: a gain in seconds, divided by the period.
//! - **Latency**: 1 edge, at edges with `sample`.
//! - **Reset**: drive and error 0. The next sample knows no error before its own, so that its derivative is 0 and the
//!   drive makes no leap.
//! - **Overflow**: both roundings are to the nearest, ties up; the drive saturates, nothing else can overflow.
//! - **VHDL twin**: `hdl/servo_control.vhd`.
//! - **Source**: Pediredla et al., the PD control of the three motors; the paper has `K_1 = 1.5`, `K_2 = 2.8` without
//!   units.
//! - **Differs from the hardware**: the paper's controller runs in software and takes the speed from the servo; this
//!   one differences the error. Both products take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::config::{NATURAL, within};
use crate::law::ZERO;
use crate::listed::{Given, Listed};
use crate::phantom::words::{accept, natural};
use crate::{AnyStep, Block, ConfigError, Generic, Register, Step};

hpu_signal::ports! {
    /// Inputs of the controller.
    pub struct In { desired, count, proportional, derivative, sample }
}

hpu_signal::ports! {
    /// Outputs of the controller.
    pub struct Out { drive }
}

/// The formats of a position controller.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ServoConfig {
    /// Width of the desired angle, in bits.
    pub angle_width: u32,
    /// Width of the sensor's count, in bits.
    pub count_width: u32,
    /// LSBs of the angle per count, with `step_frac` fraction bits.
    pub step: u32,
    /// Fraction bits of `step`.
    pub step_frac: u32,
    /// Format of the proportional gain.
    pub proportional: Format,
    /// Format of the derivative gain.
    pub derivative: Format,
    /// Width of the drive, in bits.
    pub drive_width: u32,
}

impl Default for ServoConfig {
    /// Returns the formats for a servo that turns by 5/3072 half turns a count.
    fn default() -> Self {
        let gain = |int, frac| Format::new(false, int, frac).expect("at most 24 bits");
        Self {
            angle_width: 20,
            count_width: 11,
            step: 873_813,
            step_frac: 10,
            proportional: gain(12, 4),
            derivative: gain(24, 0),
            drive_width: 11,
        }
    }
}

/// A position controller; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ServoControl {
    config: ServoConfig,
    angle: Format,
    error: Format,
    narrowing: Narrowing,
    fits_64: bool,
    before: i64,
    primed: bool,
    latest: Narrowed,
}

impl ServoControl {
    /// Returns a controller with these formats.
    ///
    /// # Errors
    ///
    /// Returns an error unless the angle has 2 to 32 bits, the count 2 to 24, the drive 2 to 31, both gains are
    /// unsigned with 2 to 40 bits, 0 to 30 of them fraction bits, the step is a positive VHDL `natural` with at most 30
    /// fraction bits, and every count is an angle of less than two half turns.
    pub fn new(config: ServoConfig) -> Result<Self, ConfigError> {
        let ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width } = config;
        within(Self::NAME, "ANGLE_WIDTH", angle_width, 2..=32)?;
        within(Self::NAME, "COUNT_WIDTH", count_width, 2..=24)?;
        within(Self::NAME, "STEP", step, 1..=NATURAL)?;
        within(Self::NAME, "STEP_FRAC", step_frac, 0..=30)?;
        within(Self::NAME, "DRIVE_WIDTH", drive_width, 2..=31)?;
        accept(Self::NAME, "P", proportional, false)?;
        accept(Self::NAME, "D", derivative, false)?;
        if i128::from(step) << (count_width - 1) >= 1 << (angle_width + step_frac) {
            let found = format!("STEP is {step}: a count of -2^{} is two half turns or more", count_width - 1);
            return Err(ConfigError::new(Self::NAME, found, "STEP < 2^(ANGLE_WIDTH + STEP_FRAC - COUNT_WIDTH + 1)"));
        }
        let frac = angle_width.cast_signed() - 1;
        let format = |int| Format::new(true, int, frac).expect("at most 34 bits");
        let narrowing = Narrowing {
            from_frac: frac + proportional.frac().max(derivative.frac()),
            to: Format::signed(drive_width),
            rounding: Rounding::NearestUp,
            overflow: Overflow::Saturate,
        };
        let (angle, error) = (format(0), format(2));
        let mut block =
            Self { config, angle, error, narrowing, fits_64: false, before: 0, primed: false, latest: ZERO };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the drive, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the error and the drive of a sample with these inputs, from the error before it, if there was one.
    #[inline]
    fn moved<W: Word>(&self, before: W, primed: W::Bit, input: &In<W>) -> [W; 2] {
        let ServoConfig { step, step_frac, proportional, derivative, .. } = self.config;
        let half = (1 << step_frac) >> 1;
        let measured = (input.count * W::int(step.into()) + W::int(half)).shr(step_frac);
        let error = (input.desired - measured).cut("e", self.error.width());
        let difference = W::select(primed, error - before, W::int(0)).cut("d", self.error.width() + 1);
        let frac = proportional.frac().max(derivative.frac());
        // At the finer fraction of the two gains.
        let gained = |gain: W, format: Format, value: W, name: &str| {
            (gain * value).shl((frac - format.frac()).unsigned_abs()).cut(name, self.total_width())
        };
        let pull = gained(input.proportional, proportional, error, "pull");
        let drag = gained(input.derivative, derivative, difference, "drag");
        [error, (pull + drag).narrow(&self.narrowing)]
    }

    /// Returns the width of the products in the VHDL.
    fn total_width(&self) -> u32 {
        let ServoConfig { proportional, derivative, drive_width, .. } = self.config;
        let [p, d] = [proportional, derivative].map(|gain| gain.int().unsigned_abs());
        let frac = proportional.frac().max(derivative.frac()).unsigned_abs();
        p.max(d).max(drive_width) + frac + self.error.width() + 4
    }

    /// Returns the error and the drive that a sample makes.
    #[inline]
    fn sampled(&self, before: i64, primed: bool, input: &In<i64>) -> (i64, Narrowed) {
        let [error, drive] = if self.fits_64 {
            self.moved(Machine::<i64>::of(before), primed, &input.map(Machine::of)).map(Machine::narrowed)
        } else {
            self.moved(Machine::<i128>::of(before), primed, &input.map(Machine::of)).map(Machine::narrowed)
        };
        (error.word, drive)
    }
}

impl Step for ServoControl {
    fn registers(&self) -> Vec<Register> {
        vec![
            Register::new("before", self.error),
            Register::new("primed", Format::BIT),
            Register::new("drive", self.narrowing.to),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [before, primed, drive] = *registers else { unreachable!("three registers") };
        let sampled = || {
            let [error, drive] = self.moved(before, primed.is_set(), &input);
            [error, W::int(1), drive]
        };
        let next = W::branch(input.sample.is_set(), sampled, || [before, primed, drive]);
        (next.to_vec(), Out { drive })
    }
}

impl Default for ServoControl {
    fn default() -> Self {
        Self::new(ServoConfig::default()).expect("the data sheet's default")
    }
}

impl Block for ServoControl {
    const NAME: &'static str = "servo_control";
    const CLOCKED: bool = true;
    type In<T> = In<T>;
    type Out<T> = Out<T>;

    fn inputs(&self) -> In<Signal> {
        let ServoConfig { count_width, proportional, derivative, .. } = self.config;
        In {
            desired: Signal::new("desired", self.angle, "half turn", "Desired angle"),
            count: Signal::new("count", Format::signed(count_width), "count", "Position word of the servo"),
            proportional: Signal::new("proportional", proportional, "count/half turn", "Gain of the error"),
            derivative: Signal::new("derivative", derivative, "count/half turn", "Gain of its change in a sample"),
            sample: Signal::bit("sample", "The edge samples"),
        }
    }

    fn outputs(&self) -> Out<Signal> {
        Out { drive: Signal::new("drive", self.narrowing.to, "count", "Command of the servo") }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width } =
            self.config;
        [
            ("ANGLE_WIDTH", angle_width),
            ("COUNT_WIDTH", count_width),
            ("STEP", step),
            ("STEP_FRAC", step_frac),
            ("P_WIDTH", proportional.width()),
            ("P_FRAC", proportional.frac().unsigned_abs()),
            ("D_WIDTH", derivative.width()),
            ("D_FRAC", derivative.frac().unsigned_abs()),
            ("DRIVE_WIDTH", drive_width),
        ]
        .map(|(name, value)| natural(name, value))
        .to_vec()
    }

    fn equations(&self) -> Option<&dyn AnyStep> {
        Some(self)
    }

    fn reset(&mut self) -> Out<i64> {
        (self.before, self.primed, self.latest) = (0, false, ZERO);
        Out { drive: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if input.sample != 0 {
            (self.before, self.latest) = self.sampled(self.before, self.primed, &input);
            self.primed = true;
        }
        Out { drive: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.sample == 0 {
            return u64::MAX;
        }
        // The second of two samples with the same inputs has no derivative, and so have those after it.
        let (error, first) = self.sampled(self.before, self.primed, input);
        let (_, second) = self.sampled(error, true, input);
        match self.latest.word {
            drive if drive != first.word => 0,
            drive if drive != second.word => 1,
            _ => u64::MAX,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        for _ in 0..edges.min(2) {
            self.tick(*input);
        }
    }
}

impl Listed for ServoControl {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        let [angle_width, count_width, step, step_frac, drive_width] =
            given.naturals(["ANGLE_WIDTH", "COUNT_WIDTH", "STEP", "STEP_FRAC", "DRIVE_WIDTH"])?;
        let [proportional, derivative] = [given.unsigned("P")?, given.unsigned("D")?];
        Self::new(ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width })
    }

    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let gain = |int, frac| Format::new(false, int, frac).expect("a constant");
        let servo = |[angle_width, count_width, step, step_frac, drive_width]: [u32; 5], proportional, derivative| {
            Self::new(ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width })
        };
        Ok(vec![
            ("narrow", servo([6, 4, 37, 3, 5], gain(3, 1), gain(2, 2))?),
            // Whole angles a count, and gains of different fractions.
            ("whole_step", servo([8, 5, 9, 0, 6], gain(2, 4), gain(4, 0))?),
            ("wide", servo([32, 16, 1_999_999_999, 18, 31], gain(10, 30), gain(30, 10))?),
        ])
    }
}
