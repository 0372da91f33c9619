//! Position control of one servo: proportional to the error, and to its change over a window of samples.
//!
//! - **Equation**: at sample `n`, the first after a reset being 0, `measured = round(count STEP / 2^STEP_FRAC)`, `e(n)
//!   = desired - measured`, exact and without wrapping, `d = e(n) - e(max(n - WINDOW, 0))`, and `drive =
//!   saturate(round(proportional e(n) + derivative d))`.
//! - **Ports**: `desired` (1,0,ANGLE_WIDTH-1) in half turns, `count` (1,COUNT_WIDTH-1,0) of the servo's own sensor,
//!   `proportional` (0,P_WIDTH-P_FRAC,P_FRAC) in drive counts per half turn, `derivative` (0,D_WIDTH-D_FRAC,D_FRAC) in
//!   drive counts per half turn a window, `sample` in; `drive` (1,DRIVE_WIDTH-1,0) out. The sample period is in the
//!   word of `derivative`: a gain in seconds, divided by the period and by `WINDOW`.
//! - **Latency**: 1 edge, at edges with `sample`.
//! - **Reset**: drive and errors 0. The next sample knows no error before its own: it sets all errors of the window to
//!   its own, so that its derivative is 0 and the drive makes no leap.
//! - **Overflow**: both roundings are to the nearest, ties up; the drive saturates, nothing else can overflow.
//! - **VHDL twin**: `hdl/servo_control.vhd`.
//! - **Source**: Pediredla et al., the PD control of the three motors; the paper has `K_1 = 1.5`, `K_2 = 2.8` without
//!   units.
//! - **Differs from the hardware**: the paper's controller runs in software and takes the speed from the servo; this
//!   one differences the error. Both products take one edge, so no limit on the clock.
//!
//! One count of a coarse sensor is a large part of a drive, if the derivative divides it by one short sample period. A
//! window of `W` samples makes the drive of one count `W` times smaller, and the derivative half a window late.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{NATURAL, within};
use crate::base::history::History;
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::base::words::accept;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the controller.
    pub struct In of |block: &ServoControl| {
        desired: block.angle, "half turn", "Desired angle";
        count: Format::signed(block.config.count_width), "count", "Position word of the servo";
        proportional: block.config.proportional, "count/half turn", "Gain of the error";
        derivative: block.config.derivative, "count/half turn", "Gain of its change in a window";
        sample, "The edge samples";
    }
    /// Outputs of the controller.
    pub struct Out of |block: &ServoControl| {
        drive: block.narrowing.to, "count", "Command of the servo";
    }
}

crate::base::listed::configuration! {
    /// The formats of a position controller.
    ///
    /// The default is for a servo that turns by 5/3072 half turns a count.
    pub struct ServoConfig {
        /// Width of the desired angle, in bits.
        angle_width: u32 = 20, ["ANGLE_WIDTH"];
        /// Width of the sensor's count, in bits.
        count_width: u32 = 11, ["COUNT_WIDTH"];
        /// LSBs of the angle per count, with `step_frac` fraction bits.
        step: u32 = 873_813, ["STEP"];
        /// Fraction bits of `step`.
        step_frac: u32 = 10, ["STEP_FRAC"];
        /// Format of the proportional gain.
        proportional: Format = Format::new(false, 12, 4).expect("16 bits"), ["P_WIDTH", "P_FRAC"];
        /// Format of the derivative gain.
        derivative: Format = Format::unsigned(24), ["D_WIDTH", "D_FRAC"];
        /// Width of the drive, in bits.
        drive_width: u32 = 11, ["DRIVE_WIDTH"];
        /// Number of samples over which the derivative is taken.
        window: u32 = 1, ["WINDOW"];
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
    /// The errors of the latest samples.
    before: History,
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
    /// fraction bits, every count is an angle of less than two half turns, and the window has 1 to 64 samples.
    pub fn new(config: ServoConfig) -> Result<Self, ConfigError> {
        let ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width, window } =
            config;
        within(Self::NAME, "ANGLE_WIDTH", angle_width, 2..=32)?;
        within(Self::NAME, "COUNT_WIDTH", count_width, 2..=24)?;
        within(Self::NAME, "STEP", step, 1..=NATURAL)?;
        within(Self::NAME, "STEP_FRAC", step_frac, 0..=30)?;
        within(Self::NAME, "DRIVE_WIDTH", drive_width, 2..=31)?;
        within(Self::NAME, "WINDOW", window, 1..=64)?;
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
        let before = History::new(window);
        let mut block = Self { config, angle, error, narrowing, fits_64: false, before, primed: false, latest: ZERO };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the drive, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the error and the drive of a sample with these inputs, from the error a window before it, if there was a
    /// sample.
    #[inline]
    fn moved<W: Word>(&self, oldest: W, primed: W::Bit, input: &In<W>) -> [W; 2] {
        let ServoConfig { step, step_frac, proportional, derivative, .. } = self.config;
        let half = (1 << step_frac) >> 1;
        let measured = (input.count * W::int(step.into()) + W::int(half)).shr(step_frac);
        let error = (input.desired - measured).cut("e", self.error.width());
        let difference = W::select(primed, error - oldest, W::int(0)).cut("d", self.error.width() + 1);
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
    fn sampled(&self, oldest: i64, primed: bool, input: &In<i64>) -> (i64, Narrowed) {
        let [error, drive] = if self.fits_64 {
            self.moved(Machine::<i64>::of(oldest), primed, &input.map(Machine::of)).map(Machine::narrowed)
        } else {
            self.moved(Machine::<i128>::of(oldest), primed, &input.map(Machine::of)).map(Machine::narrowed)
        };
        (error.word, drive)
    }

    /// Returns the error and the drive of a sample with these inputs, before which come `waiting` other samples with
    /// the same inputs.
    #[inline]
    fn after(&self, waiting: usize, input: &In<i64>) -> (i64, Narrowed) {
        let (error, first) = self.sampled(self.before.ago(0, 0, self.before.window()), self.primed, input);
        if waiting == 0 || !self.primed {
            return (error, first);
        }
        self.sampled(self.before.ago(error, waiting, self.before.window()), true, input)
    }

    /// Takes `samples` samples of the same error.
    #[inline]
    fn push(&mut self, error: i64, samples: u64) {
        self.before.push(error, if self.primed { samples } else { u64::MAX });
        self.primed = true;
    }
}

/// The registers of the VHDL, whose array has the latest error in its uppermost bits.
impl Step for ServoControl {
    fn registers(&self) -> Vec<Register> {
        let (window, width) = (self.config.window, self.error.width());
        let before = |ago| Register { low: (window - ago) * width, ..Register::new("before", self.error) };
        let own = [Register::new("primed", Format::BIT), Register::new("drive", self.narrowing.to)];
        own.into_iter().chain((1..=window).map(before)).collect()
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [primed, drive, ref before @ ..] = *registers else { unreachable!("registers") };
        let samples = input.sample.is_set();
        let sampled = || self.moved(before[before.len() - 1], primed.is_set(), &input);
        let [error, next] = W::branch(samples, sampled, || [before[0], drive]);
        let mut all = vec![W::of_bit(samples | primed.is_set()), next];
        let newer = [error].into_iter().chain(before.iter().copied());
        let shifted = newer.zip(before).map(|(newer, &kept)| {
            let [shifted] = W::branch(samples, || [W::select(primed.is_set(), newer, error)], || [kept]);
            shifted
        });
        all.extend(shifted);
        (all, Out { drive })
    }
}

crate::base::listed::configured!(ServoControl: ServoConfig);

impl Block for ServoControl {
    const NAME: &'static str = "servo_control";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.before.reset();
        (self.primed, self.latest) = (false, ZERO);
        Out { drive: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if input.sample != 0 {
            let (error, drive) = self.after(0, &input);
            self.latest = drive;
            self.push(error, 1);
        }
        Out { drive: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.sample == 0 {
            return u64::MAX;
        }
        // An edge at which the drive loses other bits is not skipped, because a loop counts them.
        let window = self.before.window();
        let mut oldest = self.before.ago(0, 0, window);
        let (error, first) = self.sampled(oldest, self.primed, input);
        if first != self.latest {
            return 0;
        }
        // Without a derivative, or a sample before, the drive does not depend on earlier errors.
        if !self.primed || input.derivative == 0 {
            return u64::MAX;
        }
        // After a window of samples with the same inputs there is no derivative, and nothing changes any more.
        let changes = |waiting: &usize| {
            let last = std::mem::replace(&mut oldest, self.before.ago(error, *waiting, window));
            last != oldest && self.sampled(oldest, true, input).1 != self.latest
        };
        (1..=window).find(changes).map_or(u64::MAX, |samples| samples as u64)
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if edges > 0 && input.sample != 0 {
            let waiting = (edges - 1).min(self.before.window() as u64);
            let (error, drive) = self.after(waiting as usize, input);
            self.latest = drive;
            self.push(error, edges);
        }
    }
}

impl Listed for ServoControl {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let gain = |int, frac| Format::new(false, int, frac).expect("a constant");
        let servo =
            |[angle_width, count_width, step, step_frac, drive_width, window]: [u32; 6], proportional, derivative| {
                Self::new(ServoConfig {
                    angle_width,
                    count_width,
                    step,
                    step_frac,
                    proportional,
                    derivative,
                    drive_width,
                    window,
                })
            };
        Ok(vec![
            ("narrow", servo([6, 4, 37, 3, 5, 1], gain(3, 1), gain(2, 2))?),
            // Whole angles a count, and gains of different fractions.
            ("whole_step", servo([8, 5, 9, 0, 6, 1], gain(2, 4), gain(4, 0))?),
            ("wide", servo([32, 16, 1_999_999_999, 18, 31, 1], gain(10, 30), gain(30, 10))?),
            ("window_4", servo([6, 4, 37, 3, 5, 4], gain(3, 1), gain(2, 2))?),
            ("window_64", Self::new(ServoConfig { window: 64, ..ServoConfig::default() })?),
        ])
    }
}

crate::circuit::part::registers!(ServoControl, self => Out { drive: self.latest });
