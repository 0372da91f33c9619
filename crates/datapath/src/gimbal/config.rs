//! The device's geometry in words, and the widths of its kinematics.

use hpu_signal::Format;

use crate::base::config::{NATURAL, within};
use crate::{ConfigError, CordicConfig};

crate::base::listed::configuration! {
    /// Lengths and words of the device. A length is a whole number of least significant bits of a length word.
    ///
    /// The default is the paper's device: a crank of 12.5 mm, a rod of 58 mm and joint angles of 55 degrees at most.
    /// The paper does not give the offset of the crank's axis. Lengths have 2^-22 m, about 0.24 um, angles 2^-19 half
    /// turns; a servo counts 1024 positions in 300 degrees.
    pub struct GimbalConfig {
        /// Format of lengths, in metres; signed.
        length: Format = Format::new(true, -3, 22).expect("20 bits"), ["LENGTH_WIDTH", "LENGTH_FRAC"];
        /// Length of the crank.
        crank: u32 = 52_429, ["CRANK_LENGTH"];
        /// Length of the rod between crank and slider.
        rod: u32 = 243_270, ["ROD_LENGTH"];
        /// Distance from the centre of the gimbal to the crank's axis.
        offset: u32 = 0, ["OFFSET"];
        /// Width of the angles.
        angle_width: u32 = 20, ["ANGLE_WIDTH"];
        /// Largest angle of pitch and roll to either side, in least significant bits of the angle.
        limit: u32 = 160_199, ["LIMIT"];
        /// Bits below those of lengths and angles in the rotations.
        guard: u32 = 4, ["GUARD"];
        /// The number of rotations from a vector to its angle.
        rotations: u32 = 20, ["ROTATIONS"];
        /// Width of the positions of the servos.
        count_width: u32 = 11, ["COUNT_WIDTH"];
        /// The share of half a turn from one position of a servo to the next: numerator and denominator.
        count: [u32; 2] = [5, 3072], ["COUNT_NUM", "COUNT_DEN"];
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
            count: [1, 90],
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
}
