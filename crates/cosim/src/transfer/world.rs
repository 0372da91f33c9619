//! The world of a plant as a transfer function: the plant, the converters on either side, and the wanted output.
//!
//! All of them act at the samples. At a sample's edge, in this order, a discrete plant steps, a late word reaches the
//! plant, the ADC reads the output, and the controller computes; a word that is not late reaches the plant at the same
//! edge, after the reading.

use hpu_plant::transfer::{Transfer, TransferMotion};
use hpu_signal::Real;

use super::direct_form::{TransferIn, TransferOut};
use crate::result::columns::real;
use crate::result::summary::Summary;
use crate::world::World;
use hpu_scene::{TransferScene, TransferWords};

/// The continuous outputs of a plant. Output and input stand where an axis has its position and its torque.
pub const TRANSFER_REALS: [Real; 4] = [
    real("reference", "Wanted output, as its word has it"),
    real("reading", "Output as the word of the ADC has it"),
    real("output", "Output of the plant"),
    real("input", "Input of the plant, with its disturbance"),
];

/// The immutable part of a world.
pub(crate) struct Plan<'s> {
    pub(crate) scene: &'s TransferScene,
    pub(crate) plant: Transfer,
    /// The wanted word, and the edge from which on it is wanted.
    pub(crate) reference: (i64, u64),
}

impl<'s> Plan<'s> {
    pub(crate) fn new(scene: &'s TransferScene, plant: Transfer, words: &TransferWords) -> Self {
        let from = scene.clock.edges(scene.reference[1]);
        Self { scene, plant, reference: (words.reference, from) }
    }
}

/// See the [module](self).
#[derive(Clone)]
pub(crate) struct TransferWorld<'p> {
    plan: &'p Plan<'p>,
    motion: TransferMotion<'p>,
    edge: u64,
    /// The edge at which the motion stands.
    anchor: u64,
    /// The edge of the next sample.
    due: u64,
    reading: i64,
    wanted: i64,
    /// The word that drives the plant, and the one that the controller shows.
    driving: i64,
    command: i64,
}

impl<'p> TransferWorld<'p> {
    /// Creates the world at edge 0.
    pub(crate) fn new(plan: &'p Plan<'p>) -> Self {
        let mut motion = TransferMotion::new(&plan.plant, &plan.scene.initial);
        motion.drive(0, plan.scene.dac.lsb(), plan.scene.disturbance);
        Self { plan, motion, edge: 0, anchor: 0, due: 1, reading: 0, wanted: 0, driving: 0, command: 0 }
    }

    /// Returns the words at the present edge: the reading, that of the controller, and that which drives the plant.
    pub(super) fn words(&self) -> [i64; 3] {
        [self.reading, self.command, self.driving]
    }

    /// Returns the edge of the next sample.
    pub(super) fn due(&self) -> u64 {
        self.due
    }

    /// Returns the plant in motion.
    pub(super) fn motion(&self) -> &TransferMotion<'p> {
        &self.motion
    }

    /// Returns whether nothing is planned any more: the reference has its last word.
    pub(super) fn is_left_alone(&self) -> bool {
        self.edge >= self.plan.reference.1
    }

    /// Lets the plant take a word from the present edge on.
    fn take(&mut self, word: i64) {
        if word != self.driving {
            self.move_on();
            self.driving = word;
            self.motion.drive(word, self.plan.scene.dac.lsb(), self.plan.scene.disturbance);
        }
    }

    fn move_on(&mut self) {
        self.motion.leap(self.edge - self.anchor);
        self.anchor = self.edge;
    }

    fn go(&mut self, edge: u64) {
        self.edge = edge;
        if edge < self.due {
            return;
        }
        let Plan { scene, reference: (wanted, from), .. } = self.plan;
        self.move_on();
        // The first sample reads the states at the start.
        if edge > 1 {
            self.motion.step();
        }
        if scene.late > 0 {
            self.take(self.command);
        }
        let adc = &scene.adc;
        self.reading = adc.range.clamped(self.motion.converted(adc.range.lsb(), adc.offset, adc.floors));
        self.wanted = if edge >= *from { *wanted } else { 0 };
        self.due = edge + adc.period;
    }
}

impl World for TransferWorld<'_> {
    type In = TransferIn<i64>;
    type Out = TransferOut<i64>;
    type Row = [f64; TRANSFER_REALS.len()];
    const REALS: &'static [Real] = &TRANSFER_REALS;

    fn edge(&self) -> u64 {
        self.edge
    }

    fn place(&self, input: &mut TransferIn<i64>) {
        *input = TransferIn { reading: self.reading, reference: self.wanted };
    }

    fn sense(&mut self) {
        self.go(self.edge + 1);
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let edge = limit.min(self.due);
        before(self, edge);
        self.go(edge);
    }

    fn next_change(&mut self, limit: u64) -> u64 {
        limit.min(self.due)
    }

    fn drive(&mut self, out: TransferOut<i64>, _: &[i64]) {
        self.command = out.command;
        if self.plan.scene.late == 0 {
            self.take(out.command);
        }
    }

    fn reals(&self, edge: u64) -> Self::Row {
        let lsb = self.plan.scene.adc.range.lsb();
        let [output, input] = self.motion.at(edge - self.anchor);
        [self.wanted as f64 * lsb, self.reading as f64 * lsb, output, input]
    }

    fn mark(&self) -> Option<u64> {
        (self.edge >= self.plan.reference.1).then(|| self.motion.mark())
    }

    fn recurs(&self, earlier: &Self) -> bool {
        let words = |it: &Self| [it.reading, it.wanted, it.driving, it.command];
        let phases = |it: &Self| [it.due - it.edge, it.edge - it.anchor];
        self.mark().is_some()
            && earlier.mark().is_some()
            && words(self) == words(earlier)
            && phases(self) == phases(earlier)
            && self.motion.is_alike(&earlier.motion)
    }

    fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        let edges = (now.edge - then.edge) * times;
        (self.edge, self.anchor, self.due) = (self.edge + edges, self.anchor + edges, self.due + edges);
    }

    fn summary(&self) -> Summary {
        Summary::default()
    }

    fn over(&self) -> Option<&'static str> {
        self.motion.is_beyond().then_some("a state of the plant, or its output, is beyond 1e100")
    }
}
