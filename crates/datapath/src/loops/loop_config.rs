//! The configuration that both haptic loops share.

use hpu_signal::Format;

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
        let integer = |value: u32| Generic::Integer(value.into());
        let frac = |format: Format| Generic::Integer(format.frac().into());
        vec![
            ("POSITION_WIDTH", integer(self.position_width)),
            ("STIFFNESS_WIDTH", integer(self.stiffness.width())),
            ("STIFFNESS_FRAC", frac(self.stiffness)),
            ("DAMPING_WIDTH", integer(self.damping.width())),
            ("DAMPING_FRAC", frac(self.damping)),
            ("PERIOD_WIDTH", integer(self.period_width)),
            ("VELOCITY_WIDTH", integer(self.velocity_width)),
            ("RESCALED", Generic::Boolean(self.rescaled)),
            ("SCALE_WIDTH", integer(self.scale.width())),
            ("SCALE_FRAC", frac(self.scale)),
            ("PWM_WIDTH", integer(self.pwm.width)),
            ("SATURATE", Generic::Boolean(self.saturate)),
            ("ANTIPHASE", Generic::Boolean(self.pwm.antiphase)),
            ("LATCHED", Generic::Boolean(self.pwm.latched)),
            ("FLOATING", Generic::Boolean(self.pwm.floating)),
            ("DEAD_TIME", integer(self.pwm.dead_time)),
            ("SETTLING", integer(self.settling)),
        ]
    }
}
