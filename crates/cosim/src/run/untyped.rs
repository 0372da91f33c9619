//! Worlds and closed loops without their types.
//!
//! The engine's inner loop is compiled for each pair of a wiring and a world. All other code that joins the two, such
//! as a comparison with a simulator of VHDL, uses these traits: it is compiled once, and pays a virtual call an edge.

use hpu_datapath::{AnyWiring, Repeat, Wiring, bundle, flatten};
use hpu_signal::{Observe, Ports};

use crate::result::stays::Sums;
use crate::result::summary::Summary;
use crate::run::engine::ClosedLoop;
use crate::world::{EncoderState, World};

/// A [`World`] whose port bundles are slices, in port order. Every world implements it.
pub trait AnyWorld<'s> {
    /// Returns a copy.
    fn copy(&self) -> Box<dyn AnyWorld<'s> + 's>;
    /// See [`World::edge`].
    fn edge(&self) -> u64;
    /// See [`World::place`].
    fn place(&self, input: &mut [i64]);
    /// See [`World::sense`].
    fn sense(&mut self);
    /// See [`World::advance`].
    fn advance(&mut self, limit: u64);
    /// See [`World::next_change`].
    fn next_change(&mut self, limit: u64) -> u64;
    /// See [`World::drive`].
    fn drive(&mut self, out: &[i64], words: &[i64]);
    /// See [`World::foresee`].
    fn foresee(&mut self, repeat: &Repeat<Vec<i64>>);
    /// Returns one of the continuous outputs at an edge that the world has not left yet. See [`World::exact`].
    fn real(&self, edge: u64, index: usize) -> f64;
    /// Appends all continuous outputs at an edge to a row. See [`World::exact`].
    fn exact(&self, edge: u64, row: &mut Vec<f64>);
    /// Appends them as verdicts are made of them. See [`World::reals`].
    fn reals(&self, edge: u64, row: &mut Vec<f64>);
    /// See [`World::measure`].
    fn measure(&mut self, stride: u64, observer: &dyn Observe);
    /// See [`World::shown`].
    fn shown(&self, edge: u64, row: &mut Vec<f64>);
    /// See [`World::sums`].
    fn sums(&self, edge: u64) -> Sums;
    /// See [`World::encoder`].
    fn encoder(&self) -> Option<EncoderState>;
    /// See [`World::sensors`].
    fn sensors(&self) -> &[[i64; 3]];
    /// See [`World::summary`].
    fn summary(&self) -> Summary;
    /// See [`World::over`].
    fn over(&self) -> Option<&'static str>;
}

impl<'s, E: World + 's> AnyWorld<'s> for E {
    fn copy(&self) -> Box<dyn AnyWorld<'s> + 's> {
        Box::new(self.clone())
    }
    fn edge(&self) -> u64 {
        World::edge(self)
    }
    fn place(&self, input: &mut [i64]) {
        let mut words: E::In = bundle(input);
        World::place(self, &mut words);
        let mut places = input.iter_mut();
        words.each(|&word| *places.next().expect("one word a port") = word);
    }
    fn sense(&mut self) {
        World::sense(self);
    }
    fn advance(&mut self, limit: u64) {
        World::advance(self, limit, |_, _| {});
    }
    fn next_change(&mut self, limit: u64) -> u64 {
        World::next_change(self, limit)
    }
    fn drive(&mut self, out: &[i64], words: &[i64]) {
        World::drive(self, bundle(out), words);
    }
    fn foresee(&mut self, repeat: &Repeat<Vec<i64>>) {
        let &Repeat { period, first, ref others, edges } = repeat;
        World::foresee(self, &Repeat { period, first, others: bundle(others), edges });
    }
    fn real(&self, edge: u64, index: usize) -> f64 {
        World::exact(self, edge).as_ref()[index]
    }
    fn exact(&self, edge: u64, row: &mut Vec<f64>) {
        row.extend_from_slice(World::exact(self, edge).as_ref());
    }
    fn reals(&self, edge: u64, row: &mut Vec<f64>) {
        row.extend_from_slice(World::reals(self, edge).as_ref());
    }
    fn measure(&mut self, stride: u64, observer: &dyn Observe) {
        World::measure(self, stride, observer);
    }
    fn shown(&self, edge: u64, row: &mut Vec<f64>) {
        World::shown(self, edge, row);
    }
    fn sums(&self, edge: u64) -> Sums {
        World::sums(self, edge)
    }
    fn encoder(&self) -> Option<EncoderState> {
        World::encoder(self)
    }
    fn sensors(&self) -> &[[i64; 3]] {
        World::sensors(self)
    }
    fn summary(&self) -> Summary {
        World::summary(self)
    }
    fn over(&self) -> Option<&'static str> {
        World::over(self)
    }
}

/// A [`ClosedLoop`] without its types. [`Wired::closed_loop`](crate::Wired::closed_loop) makes it.
pub trait AnyClosedLoop<'s> {
    /// Returns the edges done.
    fn edge(&self) -> u64;
    /// Runs one edge.
    fn step(&mut self);
    /// Makes [`leap`](Self::leap) show rows of the plant's outputs, with the means and extremes that the observer
    /// reads: one every `stride` edges, the first at `first`, a multiple of `stride`. To be called before the first
    /// leap.
    fn show(&mut self, first: u64, stride: u64, observer: &dyn Observe);
    /// See [`ClosedLoop::leap`].
    fn leap(&mut self, end: u64, observer: &mut dyn Observe);
    /// Returns the constant words of the wiring's inputs; words that the world drives are 0.
    fn constants(&self) -> Vec<i64>;
    /// Gives the wiring other constant words, from the edge after the present one on.
    fn tune(&mut self, constants: &[i64]);
    /// Returns the wiring.
    fn wiring(&self) -> &dyn AnyWiring;
    /// Returns the wiring, to be changed.
    fn wiring_mut(&mut self) -> &mut dyn AnyWiring;
    /// Returns a copy of the wiring.
    fn wiring_copy(&self) -> Box<dyn AnyWiring>;
    /// Returns the world.
    fn world(&self) -> &(dyn AnyWorld<'s> + 's);
}

/// A closed loop, and the constant words of the wiring's inputs.
pub(crate) struct Closed<W, E: World>(pub(crate) ClosedLoop<W, E>, pub(crate) E::In);

impl<'s, E, W> AnyClosedLoop<'s> for Closed<W, E>
where
    E: World + 's,
    W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
{
    fn edge(&self) -> u64 {
        self.0.edge()
    }
    fn step(&mut self) {
        self.0.step(&mut ());
    }
    fn show(&mut self, first: u64, stride: u64, observer: &dyn Observe) {
        self.0.show(first, stride, observer);
    }
    fn leap(&mut self, end: u64, mut observer: &mut dyn Observe) {
        self.0.leap(end, &mut observer);
    }
    fn constants(&self) -> Vec<i64> {
        flatten(&self.1)
    }
    fn tune(&mut self, constants: &[i64]) {
        let constants = bundle(constants);
        self.0.tune(&self.1, &constants);
        self.1 = constants;
    }
    fn wiring(&self) -> &dyn AnyWiring {
        &self.0.wiring
    }
    fn wiring_mut(&mut self) -> &mut dyn AnyWiring {
        &mut self.0.wiring
    }
    fn wiring_copy(&self) -> Box<dyn AnyWiring> {
        Box::new(self.0.wiring.clone())
    }
    fn world(&self) -> &(dyn AnyWorld<'s> + 's) {
        &self.0.world
    }
}
