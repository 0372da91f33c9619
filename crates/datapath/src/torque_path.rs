//! The combinational path of a haptic loop, from position and velocity to the torque.

use hpu_signal::{Format, Narrowed, Overflow};

use crate::{
    ConfigError, Displacement, LoopConfig, LoopIn, TorqueSum, TruncatingMultiplier, Unilateral, displacement,
    torque_sum, truncating_multiplier, unilateral,
};

/// The combinational blocks of the path, named as their instances.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct TorquePath {
    pub(crate) offset: Displacement,
    pub(crate) wall: Unilateral,
    pub(crate) spring_mult: TruncatingMultiplier,
    pub(crate) damping_mult: TruncatingMultiplier,
    pub(crate) sum: TorqueSum,
}

/// The words of the nets that the path drives.
pub(crate) struct Torque {
    pub(crate) delta: i64,
    pub(crate) contact: i64,
    pub(crate) penetration: i64,
    pub(crate) spring: Narrowed,
    pub(crate) drag: Narrowed,
    pub(crate) torque: i64,
}

impl TorquePath {
    pub(crate) fn new(config: &LoopConfig) -> Result<Self, ConfigError> {
        let (depth, width) = (config.position_width, config.pwm.width);
        let overflow = if config.saturate { Overflow::Saturate } else { Overflow::Wrap };
        let multiplier = |a, b, out| TruncatingMultiplier::new(a, b, out, overflow);
        let velocity = Format::signed(config.velocity_width);
        Ok(Self {
            offset: Displacement::new(depth)?,
            wall: Unilateral::new(depth)?,
            spring_mult: multiplier(Format::unsigned(depth), config.stiffness, Format::unsigned(width))?,
            damping_mult: multiplier(velocity, config.damping, Format::signed(width + 1))?,
            sum: TorqueSum::new(width, width + 1, width + 2)?,
        })
    }

    pub(crate) fn eval(&self, position: i64, velocity: i64, input: &LoopIn<i64>) -> Torque {
        let LoopIn { reference, stiffness, damping, .. } = *input;
        let displacement::Out { delta } = self.offset.eval(displacement::In { position, reference });
        let unilateral::Out { contact, penetration } = self.wall.eval(unilateral::In { delta });
        let spring = self.spring_mult.eval(truncating_multiplier::In { a: penetration, b: stiffness });
        let drag = self.damping_mult.eval(truncating_multiplier::In { a: velocity, b: damping });
        let sum = torque_sum::In { spring: spring.word, damping: drag.word, contact };
        let torque_sum::Out { torque } = self.sum.eval(sum);
        Torque { delta, contact, penetration, spring, drag, torque }
    }
}
