//! The widths of an arm's words: of its tables of sines, and of the path from a count to a torque.

use hpu_signal::Rounding;

use super::{Scene, arm, arm_mut};
use crate::Error;
use crate::widths::Field;
use crate::widths::field::{fields, frac, int, width};

/// All widths of an arm, in the order in which they are shown.
pub const ALL: [Field; 11] = [
    Field::DEPTH,
    Field::TRIG_INT,
    Field::TRIG_FRAC,
    Field::LENGTH,
    Field::TIP,
    Field::ROOM_INT,
    Field::ROOM_FRAC,
    Field::FORCE,
    Field::TORQUE_INT,
    Field::TORQUE_FRAC,
    Field::SAMPLE_PERIOD,
];

/// The fraction bits of a word, from none on.
mod bits {
    use super::Error;

    pub fn get(bits: &u32) -> i32 {
        bits.cast_signed()
    }

    pub fn set(word: &mut u32, bits: i32) -> Result<(), Error> {
        *word = u32::try_from(bits).map_err(|_| format!("{bits} bits are none"))?;
        Ok(())
    }
}

fields! { arm, arm_mut:
    /// `method.depth_bits` of the tables.
    DEPTH = "depth_bits", [], "count1", width method.config.depth_width;
    /// Integer bits of the sines.
    TRIG_INT = "sines, integer", ["sine1", "cosine1", "sine2", "cosine2", "sine3", "cosine3"], "sine1",
        int method.config.formats.trig;
    /// Fraction bits of the sines.
    TRIG_FRAC = "sines, fraction", [], "sine1", frac method.config.formats.trig;
    /// Fraction bits of the lengths.
    LENGTH = "lengths, fraction", [], "radius", bits method.config.formats.length_frac then also_lengths;
    /// Fraction bits of the tip's position.
    TIP = "tip, fraction", [], "x", frac method.config.formats.position;
    /// Integer bits of the stiffness of the room's walls.
    ROOM_INT = "stiffness, integer", ["stiffness"], "stiffness", int method.config.formats.stiffness;
    /// Fraction bits of the same format.
    ROOM_FRAC = "stiffness, fraction", [], "stiffness", frac method.config.formats.stiffness;
    /// Fraction bits of the forces.
    FORCE = "forces, fraction", [], "force_x", frac method.config.formats.force then also_limit;
    /// Integer bits of the torques.
    TORQUE_INT = "torques, integer", ["torque1", "torque2", "torque3"], "torque1", int method.config.formats.torque;
    /// Fraction bits of the torques.
    TORQUE_FRAC = "torques, fraction", [], "torque1", frac method.config.formats.torque;
    /// `method.period_bits`.
    SAMPLE_PERIOD = "period_bits", ["period"], "period", width method.config.period_width then holds_period;
}

fn also_lengths(scene: &mut Scene, old: i32, new: i32) -> Result<(), Error> {
    let lengths = &mut scene.method.config.lengths;
    *lengths = lengths.map(|word| rescaled(word, old - new));
    Ok(())
}

fn also_limit(scene: &mut Scene, old: i32, new: i32) -> Result<(), Error> {
    let limit = &mut scene.method.config.force_limit;
    *limit = rescaled(*limit, old - new);
    Ok(())
}

fn holds_period(scene: &mut Scene, _: i32, bits: i32) -> Result<(), Error> {
    let period = scene.period_clocks();
    if period >> bits.min(63) > 0 {
        return Err(format!("a period of {period} clocks does not fit {bits} bits").into());
    }
    Ok(())
}

/// Returns a constant with `less` fewer fraction bits, rounded to the nearest.
fn rescaled(word: u32, less: i32) -> u32 {
    let drop = u32::try_from(less).unwrap_or(0);
    let more = u32::try_from(-less).unwrap_or(0);
    u32::try_from(Rounding::NearestUp.shift(i128::from(word) << more, drop)).unwrap_or(u32::MAX)
}
