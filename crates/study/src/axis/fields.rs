//! The widths of an axis's words.

use hpu_cosim::scene::{Loop, Scene};

use super::{axis, axis_mut};
use crate::Error;
use crate::widths::Field;
use crate::widths::field::{fields, frac, int, width};

/// All widths of an axis, in the order in which they are shown.
pub const ALL: [Field; 10] = [
    Field::POSITION,
    Field::STIFFNESS_INT,
    Field::STIFFNESS_FRAC,
    Field::DAMPING_INT,
    Field::DAMPING_FRAC,
    Field::VELOCITY,
    Field::PERIOD,
    Field::SCALE_INT,
    Field::SCALE_FRAC,
    Field::PWM,
];

/// A law's velocity is as wide as its position.
fn also_velocity(scene: &mut Scene, _: i32, bits: i32) -> Result<(), Error> {
    if let Loop::Law(_) = scene.method.kind { width::set(&mut scene.method.velocity_bits, bits) } else { Ok(()) }
}

fields! { axis, axis_mut:
    /// `method.position_bits`.
    POSITION = "position_bits", ["position", "delta", "penetration"], "position",
        width method.position_bits then also_velocity;
    /// Integer bits of `method.stiffness_format`.
    STIFFNESS_INT = "stiffness, integer", ["stiffness"], "stiffness", int method.stiffness_format;
    /// Fraction bits of the same format.
    STIFFNESS_FRAC = "stiffness, fraction", [], "stiffness", frac method.stiffness_format;
    /// Integer bits of `method.damping_format`.
    DAMPING_INT = "damping, integer", ["damping"], "damping", int method.damping_format;
    /// Fraction bits of `method.damping_format`.
    DAMPING_FRAC = "damping, fraction", [], "damping", frac method.damping_format;
    /// `method.velocity_bits`.
    VELOCITY = "velocity_bits", ["velocity"], "velocity", width method.velocity_bits;
    /// `method.period_bits`.
    PERIOD = "period_bits", ["period"], "period", width method.period_bits;
    /// Integer bits of `method.scale_format`.
    SCALE_INT = "scale, integer", ["scale"], "scale", int method.scale_format;
    /// Fraction bits of `method.scale_format`.
    SCALE_FRAC = "scale, fraction", [], "scale", frac method.scale_format;
    /// `method.pwm.bits`.
    PWM = "pwm.bits", [], "command", width method.pwm.bits;
}
