//! Reduced models of an axis: a winding without inductance, friction that creeps instead of sticking.
//!
//! Without inductance the current is `i = (V - K ω) / R`, a function of the speed. In the exact flow it stays a state:
//! its row of `A` is `-K / R` times the speed's, and it jumps when the voltage does.

use crate::flow::double::Double;
use crate::{Axis, AxisError};

impl Axis {
    /// Returns the axis with smoothed friction: `τ_c ω / ω₀` up to the speed `ω₀`, `τ_c` beyond. Nothing sticks.
    ///
    /// # Errors
    ///
    /// When the speed is not finite and positive.
    pub fn with_smoothed_friction(mut self, speed_rad_per_s: f64) -> Result<Self, AxisError> {
        if !speed_rad_per_s.is_finite() || speed_rad_per_s <= 0.0 {
            return Err(AxisError(format!("friction speed is {speed_rad_per_s}; it must be positive")));
        }
        self.creep_rad_per_s = speed_rad_per_s;
        self.modes = Default::default();
        Ok(self)
    }

    /// Returns the axis with a winding that has no inductance: `i = (V - K ω) / R` at every instant. Only
    /// [`drive_average`](crate::Device::drive_average) can drive a [`Device`](crate::Device) of it.
    #[must_use]
    pub fn without_inductance(mut self) -> Self {
        self.motor.inductance_h = 0.0;
        self.modes = Default::default();
        self
    }

    /// Returns whether the current follows the voltage at once.
    pub(crate) fn is_resistive(&self) -> bool {
        !self.amplified && self.motor.inductance_h == 0.0
    }

    /// Returns the current of a winding without inductance.
    pub(crate) fn ohmic_a(&self, voltage_v: f64, switches: u8, speed_rad_per_s: f64) -> f64 {
        (voltage_v - self.motor.torque_constant_nm_per_a * speed_rad_per_s) / self.path_ohm(switches)
    }

    /// Returns the current of a winding without inductance under a share of the supply, in double-double.
    pub(crate) fn exact_ohmic_a(&self, supply_share: f64, switches: u8, speed_rad_per_s: Double) -> Double {
        let emf_v = speed_rad_per_s * self.motor.torque_constant_nm_per_a.into();
        (Double::product(self.bridge.supply_v, supply_share) - emf_v).over(self.exact_path_ohm(switches))
    }

    /// Returns the current that a winding without inductance loses per speed.
    pub(crate) fn ohmic_a_s_per_rad(&self, switches: u8) -> Double {
        Double::from(self.motor.torque_constant_nm_per_a).over(self.exact_path_ohm(switches))
    }

    /// Returns the Coulomb friction against a speed, in N·m; 0 at a standstill.
    pub(crate) fn friction_nm(&self, speed_rad_per_s: f64) -> f64 {
        let friction_nm = self.motor.coulomb_nm;
        if self.creep_rad_per_s != 0.0 {
            friction_nm * (speed_rad_per_s / self.creep_rad_per_s).clamp(-1.0, 1.0)
        } else if speed_rad_per_s == 0.0 {
            0.0
        } else {
            friction_nm.copysign(speed_rad_per_s)
        }
    }

    /// Returns the viscous friction that replaces smoothed Coulomb friction at low speeds; 0 if friction is not
    /// smoothed.
    pub(crate) fn creep_nm_s_per_rad(&self) -> f64 {
        if self.creep_rad_per_s == 0.0 { 0.0 } else { self.motor.coulomb_nm / self.creep_rad_per_s }
    }
}
