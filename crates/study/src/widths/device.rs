//! The questions of a study of widths to a device.

use hpu_cosim::{LawConfig, TheLoop};

use super::{Asked, Field};
use crate::Error;

/// The counts between which an encoder moves in random motion, and its greatest speed.
pub struct Reach {
    /// The least and the greatest count.
    pub counts: [f64; 2],
    /// The greatest speed, in counts a second.
    pub most_per_s: f64,
}

/// A `Device` says which widths its scene has and what its words should be. Implemented by the scene of each kind of
/// device.
pub trait Device {
    /// Returns the widths that a review and a recommendation go through; none where nothing is computed in words.
    fn fields(&self) -> Vec<Field> {
        Vec::new()
    }

    /// Returns why there are no [`fields`](Self::fields), where there are none.
    fn no_fields(&self) -> &'static str {
        "a host computes its force: there are no widths to choose"
    }

    /// Checks that the scene's law is computed in words; else returns why it is not.
    fn in_words(&self) -> Result<(), Error> {
        Ok(())
    }

    /// Returns the values that the scene asks for, by the nets whose words hold them.
    fn asked(&self) -> Vec<(&'static str, Asked)> {
        Vec::new()
    }

    /// Returns the reference law in floats that runs beside the words, with the latency of the words in clock edges;
    /// `None` if the method has none.
    fn law(&self, _wiring: &TheLoop) -> Option<(LawConfig, u64)> {
        None
    }

    /// Returns how far and how fast each encoder can move, in the order of their pins. Fails where no device moves.
    fn reaches(&self) -> Result<Vec<Reach>, Error> {
        Err("a design of yours has words of its own".into())
    }
}
