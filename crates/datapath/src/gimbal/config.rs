//! The device's geometry in words, and the widths of its kinematics.

use hpu_signal::Format;

use crate::base::config::{NATURAL, within};
use crate::base::listed::Given;
use crate::{ConfigError, CordicConfig, Generic};

/// Lengths and words of the device. A length is a whole number of least significant bits of a length word.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GimbalConfig {
    /// Format of lengths, in metres; signed.
    pub length: Format,
    /// Length of the crank.
    pub crank: u32,
    /// Length of the rod between crank and slider.
    pub rod: u32,
    /// Distance from the centre of the gimbal to the crank's axis.
    pub offset: u32,
    /// Width of the angles.
    pub angle_width: u32,
    /// Largest angle of pitch and roll to either side, in least significant bits of the angle.
    pub limit: u32,
    /// Bits below those of lengths and angles in the rotations.
    pub guard: u32,
    /// The number of rotations from a vector to its angle.
    pub rotations: u32,
    /// Width of the positions of the servos.
    pub count_width: u32,
    /// The share of half a turn from one position of a servo to the next: numerator and denominator.
    pub count: (u32, u32),
}

impl Default for GimbalConfig {
    /// Returns the paper's device: a crank of 12.5 mm, a rod of 58 mm and joint angles of 55 degrees at most. The paper
    /// does not give the offset of the crank's axis. Lengths have 2^-22 m, about 0.24 um, angles 2^-19 half turns;
    /// a servo counts 1024 positions in 300 degrees.
    fn default() -> Self {
        Self {
            length: Format::new(true, -3, 22).expect("20 bits"),
            crank: 52_429,
            rod: 243_270,
            offset: 0,
            angle_width: 20,
            limit: 160_199,
            guard: 4,
            rotations: 20,
            count_width: 11,
            count: (5, 3072),
        }
    }
}

impl GimbalConfig {
    /// Returns the paper's device in words of 14 bits: lengths of 2^-16 m, about 15 um, and angles of 2^-13 half turns.
    pub(super) fn narrow() -> Self {
        Self {
            length: Format::new(true, -3, 16).expect("14 bits"),
            crank: 819,
            rod: 3801,
            angle_width: 14,
            limit: 2503,
            guard: 3,
            rotations: 14,
            ..Self::default()
        }
    }

    /// Returns another device in words of 10 bits: a longer crank, an offset, and few rotations without guard bits.
    pub(super) fn short() -> Self {
        Self {
            length: Format::new(true, -2, 11).expect("10 bits"),
            crank: 60,
            rod: 121,
            offset: 37,
            angle_width: 9,
            limit: 70,
            guard: 0,
            rotations: 8,
            count_width: 8,
            count: (1, 90),
        }
    }

    /// Returns the widths of the CORDIC, whose coordinates have room for the length of any vector of lengths.
    pub fn cordic(&self) -> CordicConfig {
        let Self { length, angle_width, guard, rotations, .. } = *self;
        CordicConfig { width: length.width() + 1, angle_width, guard, rotations }
    }

    /// Returns the least and the greatest radius that the crank reaches.
    pub fn reach(&self) -> (u32, u32) {
        (self.offset + self.rod - self.crank, self.offset + self.rod + self.crank)
    }

    /// Refuses lengths of other than 4 to 24 bits or 0 to 30 fraction bits, a crank or rod that is no positive length,
    /// a rod that is not longer than the crank, and a greatest radius that is no length word.
    pub(super) fn accept(&self, block: &'static str) -> Result<(), ConfigError> {
        let Self { length, crank, rod, offset, .. } = *self;
        within(block, "LENGTH_WIDTH", length.width(), 4..=24)?;
        within(block, "LENGTH_FRAC", length.frac().cast_unsigned(), 0..=30)?;
        let most = (1 << (length.width() - 1)) - 1;
        within(block, "CRANK_LENGTH", crank, 1..=most)?;
        within(block, "ROD_LENGTH", rod, crank + 1..=NATURAL)?;
        within(block, "OFFSET + ROD_LENGTH + CRANK_LENGTH", offset.saturating_add(rod).saturating_add(crank), 1..=most)
    }

    /// Returns the generics of lengths.
    pub(super) fn generics(&self) -> Vec<(&'static str, Generic)> {
        let natural = |name, value: u32| (name, Generic::Integer(value.into()));
        vec![
            natural("LENGTH_WIDTH", self.length.width()),
            natural("LENGTH_FRAC", self.length.frac().cast_unsigned()),
            natural("CRANK_LENGTH", self.crank),
            natural("ROD_LENGTH", self.rod),
            natural("OFFSET", self.offset),
        ]
    }

    /// Returns the default with the lengths that the generics give.
    pub(super) fn given(given: &Given) -> Result<Self, ConfigError> {
        let [width, frac, crank, rod, offset] =
            given.naturals(["LENGTH_WIDTH", "LENGTH_FRAC", "CRANK_LENGTH", "ROD_LENGTH", "OFFSET"])?;
        let (width, frac) = (width.min(64).cast_signed(), frac.min(64).cast_signed());
        let length = given.format(true, width - 1 - frac, frac)?;
        Ok(Self { length, crank, rod, offset, ..Self::default() })
    }
}
