//! The world of an arm: the same whatever computes the force, and joined by its [`Side`] to the ports of a loop.

use hpu_plant::arm::{ArmModel, Links};
use hpu_signal::{Observe, Ports, Real};

use crate::result::summary::Summary;
use crate::world::World;
use crate::world::arm::{ArmPlant, ArmState};

/// A `Side` joins an arm to the ports of its loop, and acts between the two where something stands there, such as a
/// host. Implemented once for each set of ports that an arm's loop can have.
pub(crate) trait Side: Clone {
    /// Inputs of the wirings that the arm is joined to.
    type In: Ports<i64> + Copy + PartialEq;
    /// Their outputs.
    type Out: Ports<i64> + Copy + PartialEq;
    /// A row of the continuous outputs.
    type Row: AsRef<[f64]>;
    /// The continuous outputs.
    const REALS: &'static [Real];

    /// Returns the next edge at which the side acts by itself.
    #[inline]
    fn due(&self) -> u64 {
        u64::MAX
    }
    /// Does all that is due at the arm's present edge.
    #[inline]
    fn act<L: Links>(&mut self, _: &mut ArmState<L>) {}
    /// Writes the words that the wiring reads of the arm, and the side's own, into the wiring's inputs.
    fn place<L: Links>(&self, arm: &ArmState<L>, input: &mut Self::In);
    /// Takes the outputs of the wiring. Returns the words of the three motors.
    fn drive(&mut self, out: Self::Out) -> [i64; 3];
    /// Returns the continuous outputs at an edge that the arm has not left yet.
    fn row<L: Links>(&self, arm: &ArmState<L>, edge: u64) -> Self::Row;
}

/// An arm, and the side that joins it to the ports of its loop.
#[derive(Clone)]
pub(crate) struct ArmWorld<'p, S, L: Links = ArmModel> {
    state: ArmState<'p, L>,
    side: S,
}

impl<'p, S: Side, L: Links> ArmWorld<'p, S, L> {
    /// Creates the world at edge 0.
    pub(crate) fn new(plant: &'p ArmPlant<L>, side: S) -> Self {
        Self { state: ArmState::new(plant), side }
    }

    #[inline]
    fn go(&mut self, edge: u64) {
        self.state.go(edge);
        self.side.act(&mut self.state);
    }
}

impl<S: Side, L: Links> World for ArmWorld<'_, S, L> {
    type In = S::In;
    type Out = S::Out;
    type Row = S::Row;
    const REALS: &'static [Real] = S::REALS;

    fn edge(&self) -> u64 {
        self.state.edge
    }

    #[inline]
    fn place(&self, input: &mut S::In) {
        self.side.place(&self.state, input);
    }

    fn sense(&mut self) {
        self.go(self.state.edge + 1);
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let edge = self.state.next(limit.min(self.side.due()));
        before(self, edge);
        self.go(edge);
    }

    fn next_change(&mut self, limit: u64) -> u64 {
        self.state.next(limit.min(self.side.due()))
    }

    fn drive(&mut self, out: S::Out, _: &[i64]) {
        self.state.drive(self.side.drive(out));
    }

    fn reals(&self, edge: u64) -> Self::Row {
        self.side.row(&self.state, edge)
    }

    fn measure(&mut self, stride: u64, _: &dyn Observe) {
        self.state.measure(stride);
    }

    fn shown(&self, edge: u64, row: &mut Vec<f64>) {
        row.extend_from_slice(self.reals(edge).as_ref());
        self.state.measured(edge, row);
    }

    fn summary(&self) -> Summary {
        self.state.summary()
    }

    fn over(&self) -> Option<&'static str> {
        self.state.over
    }
}
