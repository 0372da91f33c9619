//! The words of an axis's encoder that a logic outside this crate gets beside its lines.

use crate::world::EncoderState;

/// An axis's encoder, of which the logic gets the index, the count and the contact too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AxisEncoder {
    /// The counts of a revolution; `None` for a linear encoder, which has no index.
    revolution: Option<i64>,
    /// The wall's count, from angle 0.
    pub(crate) wall: i64,
}

impl AxisEncoder {
    /// Number of its words.
    pub(crate) const WORDS: usize = 3;

    /// Returns the encoder of a scene, and its wall at this angle (of a mass: position) from 0.
    pub fn new(encoder: hpu_scene::Encoder, wall_rad: f64) -> Self {
        let revolution = match encoder {
            hpu_scene::Encoder::Rotary { lines } => Some(4 * i64::from(lines)),
            hpu_scene::Encoder::Linear { .. } => None,
        };
        Self { revolution, wall: encoder.nearest(wall_rad) }
    }

    /// Returns the level of the index.
    pub(crate) fn index(&self, EncoderState { count, has_index, .. }: EncoderState) -> i64 {
        i64::from(self.revolution.is_some_and(|counts| has_index && count.rem_euclid(counts) == 0))
    }

    /// Returns the words of index, count and contact, where the count `start` is 0.
    pub(crate) fn words(&self, state: EncoderState, start: i64) -> [i64; Self::WORDS] {
        [self.index(state), state.shown - start, i64::from(state.count > self.wall)]
    }
}
