//! Everything outside the FPGA, at one clock edge.
//!
//! Datapath and plant meet here through two small things: the words that an edge samples (an encoder's pins, a host's
//! commands), and the outputs that hold from that edge to the next.

use hpu_datapath::Repeat;
use hpu_signal::{Ports, Real};

use crate::faults::Mark;
use crate::summary::EnergyAudit;

/// The state of all that is outside the FPGA.
///
/// Asking edge by edge ([`sense`](World::sense)) or leaping from change to change ([`advance`](World::advance)) gives
/// the same states to the bit at every edge.
pub trait World: Clone {
    /// Inputs of the wirings that this world meets.
    type In: Ports<i64> + Copy + PartialEq;
    /// Their outputs.
    type Out: Ports<i64> + Copy + PartialEq;
    /// A row of the continuous outputs.
    type Row: AsRef<[f64]>;
    /// The continuous outputs, in the order of [`reals`](World::reals).
    const REALS: &'static [Real];

    /// The edge the world stands at.
    fn edge(&self) -> u64;
    /// Puts what the world drives of a wiring's inputs in its place, as it stands.
    fn place(&self, input: &mut Self::In);
    /// Flows by one clock edge.
    fn sense(&mut self);
    /// Goes to the first edge after the present one, up to `limit`, at which anything here changes by itself, or to
    /// `limit`; shows each edge of the way to `before` while it still lies ahead.
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64));
    /// Passes ends of steps before `limit` at which nothing changes that anybody but `before` could see, as
    /// [`advance`](World::advance) would one by one; not so many that nobody could stop the run meanwhile.
    fn glide(&mut self, _limit: u64, _before: impl FnMut(&Self, u64)) {}
    /// The outputs of the wiring, and the words of all its nets, from the present edge on.
    fn drive(&mut self, out: Self::Out, words: &[i64]);
    /// The outputs just driven repeat so while the world gives the wiring no other inputs. A world that goes on with
    /// them by itself, for some periods, and changes no input before an edge, says that edge; it does so for whoever
    /// drives it.
    fn foresee(&mut self, _: &Repeat<Self::Out>) -> Option<u64> {
        None
    }
    /// The continuous outputs at an edge which the world has not left yet; zeros for a recording.
    fn reals(&self, edge: u64) -> Self::Row;
    /// The same at `first`, `stride` after it, and so on.
    fn rows(&self, first: u64, stride: u64, count: u64, mut show: impl FnMut(u64, &Self::Row)) {
        for edge in (0..count).map(|index| first + index * stride) {
            show(edge, &self.reals(edge));
        }
    }
    /// From edge 0 on, keeps what [`measured`](World::measured) tells of the rows at every `stride` edges. A run in
    /// which nobody asks for that does not pay for it.
    fn measure(&mut self, _stride: u64) {}
    /// Adds to a row, at such an edge, what it tells beyond [`reals`](World::reals): means and extremes since the row
    /// before, and what the hand feels.
    fn measured(&self, _edge: u64, _row: &mut Vec<f64>) {}
    /// The integrals, since the start, of the actuator's torque or force and of the position, at an edge which the
    /// world has not left yet; of a world with one axis.
    fn torque_and_angle(&self, _edge: u64) -> [f64; 2] {
        [0.0; 2]
    }
    /// Where the energy has gone until the present edge.
    fn audit(&self) -> EnergyAudit;
    /// Changes of encoders' counts so far (edges of their lines).
    fn encoder_edges(&self) -> u64;
    /// Changes of the plant's mode so far: stick and slip, diodes.
    fn mode_changes(&self) -> u64;
    /// Steps of the device so far, where it moves in steps.
    fn steps(&self) -> u64 {
        0
    }
    /// Decisions so far that `f64` could not vouch for, made again in higher precision.
    fn redecided(&self) -> u64 {
        0
    }
    /// The faults so far that the scene asks for.
    fn marks(&self) -> &[Mark] {
        &[]
    }
    /// How many of them wait for an edge of the encoder that has not come.
    fn waiting(&self) -> u64 {
        0
    }
    /// Why the run cannot go on, if it cannot: the device has left what is modelled, or what its test allows.
    fn over(&self) -> Option<&'static str> {
        None
    }
}

/// The levels of the two encoder lines.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pins {
    /// Line A, 0 or 1.
    pub a: i64,
    /// Line B, 0 or 1.
    pub b: i64,
}

impl Pins {
    /// The lines at a count: forward runs 00, 01, 11, 10.
    #[must_use]
    pub fn at(count: i64) -> Self {
        let phase = count & 3;
        Self { a: phase >> 1, b: (phase >> 1) ^ (phase & 1) }
    }
}
