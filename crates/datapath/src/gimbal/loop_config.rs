//! The words of the whole loop.

use hpu_signal::Format;

use super::{GimbalConfig, ImpedanceConfig, ServoConfig, SwitchConfig};
use crate::base::listed::Given;
use crate::base::words::natural;
use crate::{ConfigError, FractionalConfig, Generic};

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
            gimbal: GimbalConfig { count_width: 12, count: (2, 181), ..normal.gimbal },
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
        let GimbalConfig { angle_width, limit, guard, rotations, count_width, count: (num, den), .. } = self.gimbal;
        let ImpedanceConfig { force_width, force_limit, stiffness, feedback, gain, gain_frac, drive_width, .. } =
            self.impedance;
        let SwitchConfig { take_radius, bumpless, decay, .. } = self.switch;
        let FractionalConfig { gain: of_shear, coef_frac, order: [order_num, order_den], memory, .. } = self.shear;
        let (width, frac) = (|format: &Format| format.width(), |format: &Format| format.frac().unsigned_abs());
        let mut all = self.gimbal.generics();
        let servo = |names: [&'static str; 7], servo: &ServoConfig| {
            let ServoConfig { step, step_frac, proportional: p, derivative: d, window, .. } = servo;
            let values = [*step, *step_frac, width(p), frac(p), width(d), frac(d), *window];
            names.into_iter().zip(values)
        };
        let of_servo = ["STEP", "STEP_FRAC", "P_WIDTH", "P_FRAC", "D_WIDTH", "D_FRAC", "WINDOW"];
        let of_crank = [
            "CRANK_STEP",
            "CRANK_STEP_FRAC",
            "CRANK_P_WIDTH",
            "CRANK_P_FRAC",
            "CRANK_D_WIDTH",
            "CRANK_D_FRAC",
            "CRANK_WINDOW",
        ];
        let naturals = [
            ("ANGLE_WIDTH", angle_width),
            ("LIMIT", limit),
            ("GUARD", guard),
            ("ROTATIONS", rotations),
            ("COUNT_WIDTH", count_width),
            ("COUNT_NUM", num),
            ("COUNT_DEN", den),
        ];
        let naturals = naturals.into_iter().chain(servo(of_servo, &self.servo)).chain(servo(of_crank, &self.crank));
        let naturals = naturals.chain([
            ("FORCE_WIDTH", force_width),
            ("FORCE_LIMIT", force_limit),
            ("S_WIDTH", width(&stiffness)),
            ("S_FRAC", frac(&stiffness)),
            ("K_WIDTH", width(&feedback)),
            ("K_FRAC", frac(&feedback)),
            ("GAIN", gain),
            ("GAIN_FRAC", gain_frac),
            ("DRIVE_WIDTH", drive_width),
        ]);
        all.extend(naturals.map(|(name, value)| natural(name, value)));
        all.push(("TAKE_RADIUS", Generic::Boolean(take_radius)));
        all.push(("BUMPLESS", Generic::Boolean(bumpless)));
        let last = [
            ("DECAY", decay),
            ("PERIOD_WIDTH", self.period_width),
            ("SHEAR_WIDTH", width(&of_shear)),
            ("SHEAR_FRAC", frac(&of_shear)),
            ("COEF_FRAC", coef_frac),
            ("ORDER_NUM", order_num),
            ("ORDER_DEN", order_den),
            ("MEMORY", memory),
        ];
        let count = if shear { last.len() } else { 4 };
        all.extend(last.into_iter().take(count).map(|(name, value)| natural(name, value)));
        all
    }

    /// Reads the generics of the loops.
    pub(super) fn given(given: &Given, shear: bool) -> Result<Self, ConfigError> {
        let [angle_width, limit, guard, rotations] = given.naturals(["ANGLE_WIDTH", "LIMIT", "GUARD", "ROTATIONS"])?;
        let [count_width, num, den] = given.naturals(["COUNT_WIDTH", "COUNT_NUM", "COUNT_DEN"])?;
        let lengths = GimbalConfig::given(given)?;
        let count = (num, den);
        let derivative = FractionalConfig { gain: given.unsigned("SHEAR")?, ..FractionalConfig::default() };
        Ok(Self {
            gimbal: GimbalConfig { angle_width, limit, guard, rotations, count_width, count, ..lengths },
            servo: ServoConfig::given(given, "")?,
            crank: ServoConfig::given(given, "CRANK_")?,
            impedance: ImpedanceConfig::given(given)?,
            switch: SwitchConfig::given(given)?,
            shear: if shear {
                let [coef_frac, num, den, memory] =
                    given.naturals(["COEF_FRAC", "ORDER_NUM", "ORDER_DEN", "MEMORY"])?;
                FractionalConfig { coef_frac, order: [num, den], memory, ..derivative }
            } else {
                derivative
            },
            period_width: given.natural("PERIOD_WIDTH")?,
        })
    }
}
