//! The words of the whole loop.

use hpu_signal::Format;

use super::{GimbalConfig, ImpedanceConfig, ServoConfig, SwitchConfig};
use crate::base::block::renamed;
use crate::base::listed::Given;
use crate::base::words::natural;
use crate::{ConfigError, FractionalConfig, Generic};

/// The generics of the crank's servo beside the shared widths, by their names in the loop.
const CRANK: [(&str, &str); 7] = [
    ("STEP", "CRANK_STEP"),
    ("STEP_FRAC", "CRANK_STEP_FRAC"),
    ("P_WIDTH", "CRANK_P_WIDTH"),
    ("P_FRAC", "CRANK_P_FRAC"),
    ("D_WIDTH", "CRANK_D_WIDTH"),
    ("D_FRAC", "CRANK_D_FRAC"),
    ("WINDOW", "CRANK_WINDOW"),
];
/// Those of the gain of the fractional derivative.
const SHEAR: [(&str, &str); 2] = [("GAIN_WIDTH", "SHEAR_WIDTH"), ("GAIN_FRAC", "SHEAR_FRAC")];

/// The device and the blocks of its loop.
///
/// A width that blocks share is stated once: lengths, angles and counts by `gimbal`, force and drives by `impedance`.
/// The same fields of the other parts are not read; [`servo`](Self::servo), [`crank`](Self::crank) and the methods
/// after them return each part with the shared widths.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GimbalLoopConfig {
    /// The kinematics, with the widths of lengths, angles and counts.
    pub gimbal: GimbalConfig,
    /// The position control of pitch and roll.
    pub servo: ServoConfig,
    /// The position control of the crank.
    pub crank: ServoConfig,
    /// The impedance control of the crank, with the widths of force and drives.
    pub impedance: ImpedanceConfig,
    /// The switch between both.
    pub switch: SwitchConfig,
    /// The fractional derivative of the shear loop. The plain loop reads the format of its gain alone.
    pub shear: FractionalConfig,
    /// Width of the sample period.
    pub period_width: u32,
}

impl Default for GimbalLoopConfig {
    /// Returns the paper's device. The derivatives are taken over 64 samples, and the gain of the shear has 24 bits.
    fn default() -> Self {
        let servo = ServoConfig { window: 64, ..ServoConfig::default() };
        let gain = Format::new(false, 8, 16).expect("24 bits");
        Self {
            gimbal: GimbalConfig::default(),
            servo,
            crank: servo,
            impedance: ImpedanceConfig::default(),
            switch: SwitchConfig::default(),
            shear: FractionalConfig { gain, ..FractionalConfig::default() },
            period_width: 24,
        }
    }
}

impl GimbalLoopConfig {
    /// Returns the paper's device with the paper's switch: no offset, and an equilibrium that is the desired radius.
    /// Equal thresholds then make a switch without hysteresis.
    #[must_use]
    pub fn plain() -> Self {
        let switch = SwitchConfig { take_radius: false, bumpless: false, ..SwitchConfig::default() };
        Self { switch, ..Self::default() }
    }

    /// Returns another device in short words, with a window of 4 samples, for tests and proofs.
    #[must_use]
    pub fn short() -> Self {
        let format = |int, frac| Format::new(false, int, frac).expect("a constant");
        let normal = Self::default();
        let servo = ServoConfig {
            step: 91,
            step_frac: 5,
            proportional: format(5, 1),
            derivative: format(4, 2),
            window: 4,
            ..normal.servo
        };
        Self {
            gimbal: GimbalConfig::short(),
            servo,
            crank: servo,
            impedance: ImpedanceConfig {
                force_width: 5,
                force_limit: 27,
                stiffness: format(1, 3),
                feedback: format(2, 1),
                gain: 25,
                gain_frac: 12,
                drive_width: 6,
                ..normal.impedance
            },
            switch: SwitchConfig { decay: 2, ..normal.switch },
            shear: FractionalConfig { gain: format(3, 3), coef_frac: 6, memory: 5, ..normal.shear },
            period_width: 7,
        }
    }

    /// Returns a configuration in which no two generics are equal, so that none can stand in another's place.
    pub(super) fn distinct() -> Self {
        let format = |int, frac| Format::new(false, int, frac).expect("a constant");
        let normal = Self::short();
        Self {
            gimbal: GimbalConfig { count_width: 12, count: [2, 181], ..normal.gimbal },
            servo: ServoConfig {
                step: 1999,
                step_frac: 13,
                proportional: format(7, 15),
                derivative: format(7, 16),
                window: 20,
                ..normal.servo
            },
            crank: ServoConfig {
                step: 3999,
                step_frac: 14,
                proportional: format(8, 17),
                derivative: format(8, 18),
                window: 28,
                ..normal.servo
            },
            impedance: ImpedanceConfig {
                force_width: 7,
                force_limit: 101,
                stiffness: format(15, 4),
                feedback: format(4, 1),
                gain: 102_400,
                gain_frac: 24,
                ..normal.impedance
            },
            switch: SwitchConfig { decay: 3, ..normal.switch },
            shear: FractionalConfig { gain: format(1, 30), coef_frac: 29, order: [33, 34], memory: 35, ..normal.shear },
            period_width: 27,
        }
    }

    /// Returns the position control of pitch and roll with the shared widths.
    #[must_use]
    pub fn servo(&self) -> ServoConfig {
        self.shared(self.servo)
    }

    /// Returns the position control of the crank with the shared widths.
    #[must_use]
    pub fn crank(&self) -> ServoConfig {
        self.shared(self.crank)
    }

    fn shared(&self, servo: ServoConfig) -> ServoConfig {
        let GimbalConfig { angle_width, count_width, .. } = self.gimbal;
        ServoConfig { angle_width, count_width, drive_width: self.impedance.drive_width, ..servo }
    }

    /// Returns the impedance control with the shared widths.
    #[must_use]
    pub fn impedance(&self) -> ImpedanceConfig {
        ImpedanceConfig { length: self.gimbal.length, ..self.impedance }
    }

    /// Returns the switch with the shared widths.
    #[must_use]
    pub fn switch(&self) -> SwitchConfig {
        let ImpedanceConfig { drive_width, force_width, .. } = self.impedance;
        SwitchConfig { drive_width, force_width, length: self.gimbal.length, ..self.switch }
    }

    /// Returns the fractional derivative, whose input and output are lengths.
    #[must_use]
    pub fn shear(&self) -> FractionalConfig {
        FractionalConfig { input: self.gimbal.length, output: self.gimbal.length, ..self.shear }
    }

    /// Returns the least sample period, in clocks, in which a sample's drives are all shown before the next sample:
    /// the latency of the inverse kinematics, and 3 edges from the joints to the drive of the crank. A fractional
    /// derivative passes over samples that come before it has ended, so that the shear loop's period also has at least
    /// `MEMORY + 2` edges.
    #[must_use]
    pub fn least_period(&self, shear: bool) -> u32 {
        let GimbalConfig { rotations, length, .. } = self.gimbal;
        let inverse = 3 * rotations + length.width() + 13;
        (inverse + 3).max(if shear { self.shear.memory + 2 } else { 0 })
    }

    /// Returns the VHDL generics of the loops, in the order of the entity. The plain loop has no fractional derivative,
    /// but the port of its gain.
    pub(super) fn generics(&self, shear: bool) -> Vec<(&'static str, Generic)> {
        let servo = |servo: ServoConfig| {
            let is_own = |name| CRANK.iter().any(|(own, _)| *own == name);
            servo.generics().into_iter().filter(move |&(name, _)| is_own(name))
        };
        let in_loop = |names: &'static [_]| move |(name, value)| (renamed(name, names), value);
        let mut all = self.gimbal.generics();
        all.extend(servo(self.servo));
        all.extend(servo(self.crank).map(in_loop(&CRANK)));
        // A width that blocks share is told once.
        all.extend(self.impedance.generics().split_off(2));
        all.extend(self.switch.generics().split_off(4));
        all.push(natural("PERIOD_WIDTH", self.period_width));
        let own = self.shear.generics().split_off(4).into_iter().map(in_loop(&SHEAR));
        all.extend(own.take(if shear { 6 } else { 2 }));
        all
    }

    /// Reads the generics of the loops.
    pub(super) fn given(given: &Given) -> Result<Self, ConfigError> {
        Ok(Self {
            gimbal: GimbalConfig::given(given)?,
            servo: ServoConfig::given(given)?,
            crank: ServoConfig::given(&given.renamed(&CRANK))?,
            impedance: ImpedanceConfig::given(given)?,
            switch: SwitchConfig::given(given)?,
            shear: FractionalConfig::given(&given.renamed(&SHEAR))?,
            period_width: given.natural("PERIOD_WIDTH")?,
        })
    }
}
