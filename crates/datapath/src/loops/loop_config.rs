//! The configuration that both haptic loops share.

use hpu_signal::Format;

use crate::base::listed::Field;
use crate::{Generic, PwmConfig, VelocityConfig};

/// The widths and modes of a haptic loop; the default is the 12-bit design of Vasudevan et al. 2007.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LoopConfig {
    /// Width of the position counter, in bits.
    pub position_width: u32,
    /// Format of the stiffness, in PWM counts per count.
    pub stiffness: Format,
    /// Format of the damping, in PWM counts per velocity count.
    pub damping: Format,
    /// Width of the sample period, in bits.
    pub period_width: u32,
    /// Width of the velocity, in bits.
    pub velocity_width: u32,
    /// Whether the velocity is multiplied by `scale`.
    pub rescaled: bool,
    /// Format of the velocity's scale.
    pub scale: Format,
    /// Whether products saturate; otherwise they wrap, like those of the paper.
    pub saturate: bool,
    /// The configuration of the modulator.
    pub pwm: PwmConfig,
    /// Number of clocks by which the command is held back.
    pub settling: u32,
}

impl Default for LoopConfig {
    fn default() -> Self {
        let VelocityConfig { period_width, rescaled, scale, .. } = VelocityConfig::default();
        Self {
            position_width: 12,
            stiffness: Format::unsigned(12),
            damping: Format::unsigned(12),
            period_width,
            velocity_width: 12,
            rescaled,
            scale,
            saturate: true,
            pwm: PwmConfig::default(),
            settling: 0,
        }
    }
}

impl LoopConfig {
    /// Returns the VHDL generics, in the order of the entity.
    pub(crate) fn generics(&self) -> Vec<(&'static str, Generic)> {
        let integer = |name, value: u32| (name, Generic::Integer(value.into()));
        let boolean = |name, value| (name, Generic::Boolean(value));
        let format = |format: Format, names: [&'static str; 2]| format.told(&names);
        let all = [
            vec![integer("POSITION_WIDTH", self.position_width)],
            format(self.stiffness, ["STIFFNESS_WIDTH", "STIFFNESS_FRAC"]),
            format(self.damping, ["DAMPING_WIDTH", "DAMPING_FRAC"]),
            vec![integer("PERIOD_WIDTH", self.period_width), integer("VELOCITY_WIDTH", self.velocity_width)],
            vec![boolean("RESCALED", self.rescaled)],
            format(self.scale, ["SCALE_WIDTH", "SCALE_FRAC"]),
            vec![integer("PWM_WIDTH", self.pwm.width), boolean("SATURATE", self.saturate)],
            self.pwm.generics().split_off(1),
            vec![integer("SETTLING", self.settling)],
        ];
        all.concat()
    }
}
