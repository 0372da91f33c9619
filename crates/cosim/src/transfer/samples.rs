//! The loop of a plant from sample to sample.

use hpu_datapath::Block;
use hpu_plant::transfer::Pairs;
use hpu_signal::Ports;

use super::direct_form::{DirectForm, TransferIn};
use super::world::TransferWorld;
use crate::world::World;

/// The loop of a plant from sample to sample: the same words and states as a run has at these edges.
#[derive(Clone)]
pub struct Samples<'p> {
    world: TransferWorld<'p>,
    wiring: DirectForm,
}

impl<'p> Samples<'p> {
    pub(super) fn new(world: TransferWorld<'p>, wiring: DirectForm) -> Self {
        Self { world, wiring }
    }

    /// Moves on to the next sample. Returns whether the plant is still within the sizes that are modelled.
    pub fn go_on(&mut self) -> bool {
        self.world.advance(self.world.due(), |_, _| {});
        let mut input = TransferIn::build(|| 0);
        self.world.place(&mut input);
        self.wiring.skip(self.wiring.quiet(&input), &input);
        let out = self.wiring.tick(input);
        self.world.drive(out, &[]);
        self.world.over().is_none()
    }

    /// Returns the edge of the latest sample.
    pub fn edge(&self) -> u64 {
        self.world.edge()
    }

    /// Returns the words of the latest sample: the reading, the controller's, and that which drives the plant from here
    /// on.
    pub fn words(&self) -> [i64; 3] {
        self.world.words()
    }

    /// Returns the words that the controller remembers from the latest sample on: its errors, and its own outputs, the
    /// newest first.
    pub fn memory(&self) -> (&[i64], &[i64]) {
        self.wiring.memory()
    }

    /// Returns the plant's states at the latest sample.
    pub fn states(&self) -> Pairs {
        self.world.motion().pairs()
    }

    /// Returns whether the reference has its last word.
    pub fn is_left_alone(&self) -> bool {
        self.world.is_left_alone()
    }

    /// Returns whether all words are those of another sample, so that the same readings give the same words from here
    /// on. The plant may stand elsewhere.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.words() == other.words() && self.wiring.memory() == other.wiring.memory()
    }
}
