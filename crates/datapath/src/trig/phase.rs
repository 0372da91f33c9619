//! Phases: angles as binary fractions of a turn, and the sines from which tables are computed.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use hpu_signal::{Format, Word};

use crate::base::config::{NATURAL, within};
use crate::base::listed::Given;
use crate::base::words::{accept_trig, natural, parts};
use crate::{ConfigError, Generic};

/// The angle of one count as an exact fraction of a turn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Turn {
    /// Numerator.
    pub num: u32,
    /// Denominator.
    pub den: u32,
}

impl Turn {
    /// The three joints of the PHANToM Premium 1.0.
    pub const PREMIUM_1_0: [Self; 3] =
        [Self { num: 3, den: 92_000 }, Self { num: 1, den: 28_000 }, Self { num: 1, den: 28_000 }];
    /// The three joints of the PHANToM Premium 1.5: encoders of 4096 counts behind ratios of 13.3, 11.2 and 11.2.
    pub const PREMIUM_1_5: [Self; 3] =
        [Self { num: 5, den: 272_384 }, Self { num: 5, den: 229_376 }, Self { num: 5, den: 229_376 }];
}

/// The phase of a count, in turns of `2^PHASE_WIDTH`, and the formats of the count and of the sines.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Phase {
    /// Width of the count.
    pub count_width: u32,
    /// Width of the phase.
    pub width: u32,
    /// Phase of one count: `2^width` times the fraction of a turn, to the nearest.
    pub step: u32,
    /// Format of sine and cosine.
    pub trig: Format,
}

impl Default for Phase {
    /// Returns the phase of joints 2 and 3 of the Premium 1.0.
    fn default() -> Self {
        let trig = Format::new(true, 9, 22).expect("32 bits");
        Self { count_width: 16, width: 40, step: 39_268_273, trig }
    }
}

impl Phase {
    /// Returns the same with the step of that turn.
    ///
    /// # Panics
    ///
    /// When the step is no VHDL `natural`.
    #[must_use]
    pub fn of(self, turn: Turn) -> Self {
        let (num, den) = (u128::from(turn.num) * (1 << self.width), u128::from(turn.den));
        let step = u32::try_from((2 * num + den) / (2 * den)).ok().filter(|step| *step <= NATURAL);
        Self { step: step.expect("a fraction of a turn that is small enough"), ..self }
    }

    /// Refuses words that no source of sines can have, and a phase of fewer than `least` bits.
    pub(crate) fn accept(&self, block: &'static str, least: u32) -> Result<(), ConfigError> {
        within(block, "COUNT_WIDTH", self.count_width, 4..=24)?;
        within(block, "PHASE_WIDTH", self.width, least..=48)?;
        within(block, "STEP", self.step, 0..=NATURAL)?;
        accept_trig(block, self.trig)
    }

    /// Returns the upper `width` bits of a count's phase.
    #[inline]
    pub(crate) fn upper<W: Word>(&self, count: W, width: u32) -> W {
        (count * W::int(self.step.into())).wrap(Format::unsigned(self.width)).shr(self.width - width)
    }

    /// Returns the format of a sine in the first quarter, from 0 to 1.
    pub(crate) fn magnitude(&self) -> Format {
        Format::new(false, 1, self.trig.frac()).expect("narrower than the sine")
    }

    /// Returns the VHDL generics from `PHASE_WIDTH` on.
    pub(crate) fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![natural("PHASE_WIDTH", self.width), natural("STEP", self.step)];
        all.extend(parts("TRIG_INT", "TRIG_FRAC", self.trig));
        all
    }
}

/// Returns `sin(2 pi num / den)` in units of `2^-frac`, to the nearest, for numbers below `2^50`.
///
/// The angle is reduced to an eighth of a turn in integers, so that the float is within 4 ulp of the sine, that is
/// `2^-51`. So all words are certain but those within `2^(frac-51)` of a tie, and the tests show that the shipped
/// tables have none of these.
pub(crate) fn sine(num: i64, den: i64, frac: i32) -> i32 {
    let quadrant = (8 * num + den).div_euclid(2 * den);
    let rest = FRAC_PI_2 * ((4 * num - quadrant * den) as f64 / den as f64);
    let value = match quadrant.rem_euclid(4) {
        0 => libm::sin(rest),
        1 => libm::cos(rest),
        2 => -libm::sin(rest),
        _ => -libm::cos(rest),
    };
    libm::round(libm::scalbn(value, frac)) as i32
}

/// A quarter of a sine, from 0 to 1 inclusive in `2^width` steps.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Quarter {
    words: Arc<[i32]>,
    /// The rise from each step to the next; the last step has none.
    rises: Arc<[i32]>,
}

impl Quarter {
    pub(crate) fn new(width: u32, frac: i32) -> Self {
        let words: Arc<[_]> = (0..=1i64 << width).map(|step| sine(step, 4 << width, frac)).collect();
        let rises = words.windows(2).map(|pair| pair[1] - pair[0]).chain([0]).collect();
        Self { words, rises }
    }

    /// Returns the sine at a step.
    #[inline]
    pub(crate) fn at<W: Word>(&self, step: W) -> W {
        step.look_up(&self.words)
    }

    /// Returns the rise from a step to the next.
    #[inline]
    pub(crate) fn rise<W: Word>(&self, step: W) -> W {
        step.look_up(&self.rises)
    }

    /// Returns the sines at the steps below 1, and the rise from each to the next: words of `(0,1,F)`.
    pub(crate) fn words(&self) -> (Vec<i64>, Vec<i64>) {
        let steps = self.words.len() - 1;
        let words = |all: &[i32]| all[..steps].iter().map(|&word| word.into()).collect();
        (words(&self.words), words(&self.rises))
    }
}

impl Phase {
    /// Reads the generics of a phase.
    pub(crate) fn given(given: &Given) -> Result<Self, ConfigError> {
        let [count_width, width, step] = given.naturals(["COUNT_WIDTH", "PHASE_WIDTH", "STEP"])?;
        Ok(Self { count_width, width, step, trig: given.parts(true, "TRIG")? })
    }

    /// Returns, for variants of a source of sines: the phases of joint 1 of the Premium 1.0 and 1.5, a short phase with
    /// narrow sines, and a long phase with fine sines.
    pub(crate) fn variants() -> [Self; 4] {
        let trig = |frac| Format::new(true, 1, frac).expect("at most 32 bits");
        let [joint_1, joint_2, _] = Turn::PREMIUM_1_0;
        let [_, premium_1_5, _] = Turn::PREMIUM_1_5;
        let short = Self { count_width: 10, width: 12, step: 5, trig: trig(14) };
        let long = Self { width: 44, trig: trig(30), ..Self::default() }.of(joint_2);
        [Self::default().of(joint_1), Self::default().of(premium_1_5), short, long]
    }
}
