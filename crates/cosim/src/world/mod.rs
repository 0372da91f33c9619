//! Everything outside the FPGA, at one clock edge.
//!
//! Datapath and plant meet here through two small interfaces: the words that an edge samples (an encoder's pins, a
//! host's commands), and the outputs that hold from that edge to the next.

pub(crate) mod actuator;
pub(crate) mod any_device;
pub(crate) mod arm;
pub(crate) mod arm_body;
pub(crate) mod arm_world;
pub(crate) mod axis_encoder;
pub(crate) mod axis_world;
pub(crate) mod encoder;
pub(crate) mod faults;
mod i2c_chip;
pub(crate) mod integrator;
pub(crate) mod plant;
pub(crate) mod sensors;
mod spi_chip;
pub(crate) mod stepped;

use hpu_datapath::Repeat;
use hpu_signal::{Cycle, Observe, Ports, Real};

#[cfg(not(target_family = "wasm"))]
use crate::result::forever::Rest;
use crate::result::stays::Sums;
use crate::result::summary::Summary;
use crate::world::encoder::Pins;

/// A `World` is the state of everything outside the FPGA: plant, encoders, hand, on some platforms a host. The engine
/// and the VHDL's lockstep drive it through this trait. Implemented by [`AxisWorld`](crate::AxisWorld) and by the world
/// of an arm.
///
/// Asking edge by edge ([`sense`](World::sense)) or leaping from change to change ([`advance`](World::advance)) must
/// give the same states to the bit at every edge.
pub trait World: Clone {
    /// Inputs of the wirings that this world is joined to.
    type In: Ports<i64> + Copy + PartialEq;
    /// Their outputs.
    type Out: Ports<i64> + Copy + PartialEq;
    /// A row of the continuous outputs.
    type Row: AsRef<[f64]>;
    /// The continuous outputs, in the order of [`reals`](World::reals).
    const REALS: &'static [Real];

    /// Returns the edge at which the world stands.
    fn edge(&self) -> u64;
    /// Writes the inputs that the world drives, with their present values, into a wiring's inputs.
    fn place(&self, input: &mut Self::In);
    /// Returns whether [`place`](World::place) would leave these inputs as they are.
    #[inline]
    fn shows(&self, input: &Self::In) -> bool {
        let mut placed = *input;
        self.place(&mut placed);
        placed == *input
    }
    /// Flows by one clock edge.
    fn sense(&mut self);
    /// Flows to the first edge after the present one, up to `limit`, at which the world changes by itself, or to
    /// `limit`. Calls `before` with that edge before it leaves the present one.
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64));
    /// Returns whether the world still knows its outputs at all earlier edges when it has moved to this one, until it
    /// is [driven](World::drive) anew. The engine may then show rows later, many at once. A world that is not certain
    /// returns `false`.
    fn keeps(&self, _edge: u64) -> bool {
        false
    }
    /// Returns an edge after the present one, up to `limit`, before which nothing changes by itself if the outputs stay
    /// as they are. The world does not move. A caller that drives edge by edge need not ask the world until then.
    fn next_change(&mut self, limit: u64) -> u64 {
        limit.min(self.edge() + 1)
    }
    /// Returns for how many edges, up to `edges`, nothing changes by itself; 0 promises nothing. The world stays where
    /// it is. This spares the engine most of [`advance`](World::advance) where the datapath changes edge by edge.
    fn idles(&mut self, _edges: u64) -> u64 {
        0
    }
    /// Moves on by a number of edges for which the world [idles](World::idles). The world still knows its outputs at
    /// these edges until it moves on by itself or is driven anew.
    fn coast(&mut self, _edges: u64) {
        unreachable!("no world coasts that does not idle")
    }
    /// Moves on over samples of the converter whose code is an input, before `limit` while nothing else changes, and
    /// appends their codes. Calls `before` with the last sample's edge before it leaves the present one. Returns the
    /// edge of the first sample, and the edges from one to the next.
    fn convert(&mut self, _limit: u64, _before: impl FnOnce(&Self, u64), _codes: &mut Vec<i64>) -> (u64, u64) {
        (0, 0)
    }
    /// Passes ends of steps before `limit` at which nothing changes that anything but `before` could see, as
    /// [`advance`](World::advance) would one by one. Passes only so many that the run can still be stopped.
    fn glide(&mut self, _limit: u64, _before: impl FnMut(&Self, u64)) {}
    /// Sets the outputs of the wiring, and the words of all its nets, from the present edge on. While outputs repeat as
    /// [`foresee`](World::foresee) was told, the words of their nets may still be those that began the repetition.
    fn drive(&mut self, out: Self::Out, words: &[i64]);
    /// Returns whether [`drive`](World::drive) would leave the world as it is.
    fn is_driven_by(&self, _out: &Self::Out, _words: &[i64]) -> bool {
        false
    }
    /// Returns the nets beside the outputs whose words drive the world: bit `n` is net `n`. The engine drives the world
    /// at each edge at which one of them changes.
    fn driven_by(&self) -> u64 {
        u64::MAX
    }
    /// Returns whether outputs that stay as they were last [driven](World::drive) need not be driven again.
    fn holds_outputs(&self) -> bool {
        false
    }
    /// Announces that the outputs just driven repeat periodically while the inputs do not change. Returns the first
    /// edge at which an input changes, if the world can cruise until then: go on by itself for some periods under the
    /// repeated outputs. The result must not depend on the driver.
    fn foresee(&mut self, _: &Repeat<Self::Out>) -> Option<u64> {
        None
    }
    /// Returns the continuous outputs at an edge that the world has not left yet; zeros for a recording.
    fn reals(&self, edge: u64) -> Self::Row;
    /// Shows the outputs at the edges `first`, `first + stride` and so on.
    fn rows<O: Observe + ?Sized>(&self, first: u64, stride: u64, count: u64, observer: &mut O) {
        for edge in (0..count).map(|index| first + index * stride) {
            observer.reals(Cycle(edge), self.reals(edge).as_ref());
        }
    }
    /// Gathers, from edge 0 on, the figures that [`shown`](World::shown) appends to the rows at every
    /// `stride` edges, as far as the observer reads them. A run whose observer does not ask for them must not pay for
    /// them.
    fn measure(&mut self, _stride: u64, _observer: &dyn Observe) {}
    /// Returns the continuous outputs at an edge that the world has not left yet, as observers and other programs are
    /// shown them: each the exact state, rounded once. [`reals`](World::reals) costs less, may be off by some units in
    /// the last place, and is what verdicts are made of.
    fn exact(&self, edge: u64) -> Self::Row {
        self.reals(edge)
    }
    /// Appends to a row the outputs at an edge, as [`exact`](World::exact) returns them, and what the world has
    /// gathered: means and extremes since the row before, and what the hand feels.
    fn shown(&self, edge: u64, row: &mut Vec<f64>) {
        row.extend_from_slice(self.exact(edge).as_ref());
    }
    /// Returns the sums from the start up to an edge that the world has not left yet. Only a world with one axis has
    /// them.
    fn sums(&self, _edge: u64) -> Sums {
        Sums::default()
    }
    /// Returns the nets whose words do not tell what they stand for at the present edge, as the set of their indices: a
    /// position counter whose device is out of its reach.
    fn overflowing(&self) -> u64 {
        0
    }
    /// Returns the state of the encoder; `None` for a world without one encoder of its own.
    fn encoder(&self) -> Option<EncoderState> {
        None
    }
    /// Returns the words of the two pins of each sensor beside the encoder, as [`hpu_scene::Sensor::pins`] names them.
    fn sensors(&self) -> &[[i64; 3]] {
        &[]
    }
    /// Returns a number that is the same in states that [recur](World::recurs) and in few others; `None` if the present
    /// one certainly does not.
    fn mark(&self) -> Option<u64> {
        None
    }
    /// Returns whether the world is, in every bit that decides how it goes on, as an earlier one was at its edge, so
    /// that both go on alike if they are driven alike. A world that is not certain returns `false`.
    fn recurs(&self, _earlier: &Self) -> bool {
        false
    }
    /// Moves on as if all that happened between two states had happened so many times more. The second state
    /// [recurs](World::recurs), and this one lies between them.
    fn repeat(&mut self, _: [&Self; 2], _times: u64) {
        unreachable!("a world that does not recur")
    }
    /// Returns the width of a count of the encoder, in rad or m, if nothing is planned from here on and
    /// [`recurs`](World::recurs) compares all that decides how the world goes on.
    ///
    /// # Errors
    ///
    /// Returns what is planned, or not compared.
    #[cfg(not(target_family = "wasm"))]
    fn left_alone(&self) -> Result<f64, &'static str> {
        Err("only an axis's states are compared")
    }
    /// Returns the last edge to which the world can go on without an event.
    #[cfg(not(target_family = "wasm"))]
    fn reach(&self) -> u64 {
        u64::MAX
    }
    /// Returns the device under outputs that last for these numbers of edges from the present edge on, those of a lead
    /// and then those that repeat; `None` if no proof is known for such a device or its drive.
    #[cfg(not(target_family = "wasm"))]
    fn rest(&self, _lead: &[(Self::Out, u64)], _cycle: &[(Self::Out, u64)]) -> Option<Rest> {
        None
    }
    /// Returns the world's part of a run's summary, at the present edge: encoder edges, changes of mode, steps,
    /// decisions made again, energies and faults.
    fn summary(&self) -> Summary;
    /// Returns why the run cannot go on, or `None` if it can: the device has left the modelled range, or the range that
    /// its test allows.
    fn over(&self) -> Option<&'static str> {
        None
    }
}

/// The state of an axis's encoder.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EncoderState {
    /// The count at which the device stands, from angle 0.
    pub count: i64,
    /// The count that the encoder's lines show, with faults.
    pub shown: i64,
    /// The levels of the encoder's lines.
    pub pins: Pins,
    /// Whether the encoder's index pulse works.
    pub has_index: bool,
}
