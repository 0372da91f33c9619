//! Wirings: blocks with nets, a hierarchy of instances, and a record of how their words were used.

use hpu_signal::{Ports, Signal, SignalUse};

use crate::base::block::{AnyBlock, Block, Instance, Parts, bundle, flatten};

hpu_signal::ports! {
    /// Inputs of a haptic loop: the encoder's pins and the words that the scene sets.
    pub struct LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
}

hpu_signal::ports! {
    /// Outputs of a haptic loop: the gates of the H-bridge.
    pub struct LoopOut { a_high, a_low, b_high, b_low }
}

impl Parts {
    pub(crate) fn of(wiring: &impl Wiring) -> Self {
        Self { nets: wiring.nets(), instances: wiring.instances() }
    }
}

/// A repetition of outputs, those of a modulator, while all other nets stand still.
///
/// The edge just ticked begins a period. Its outputs stay for `first` edges; then the outputs are `others` to the end
/// of the period. Every further period is the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Repeat<O> {
    /// Length of a period, in edges.
    pub period: u64,
    /// Number of edges for which a period's first outputs stay, from 1 to one less than `period`.
    pub first: u64,
    /// The outputs in the rest of a period.
    pub others: O,
    /// Number of further edges for which all other nets certainly stay as they are. The outputs repeat for one edge
    /// more, because they react to another net one edge later.
    pub edges: u64,
}

/// A loop of one axis. The haptic loops, the method loops and the loop of a reference law in `cosim` implement it.
pub trait AxisWiring: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> {
    /// The net that an averaged bridge or an amplifier follows in the gates' place.
    const COMMAND: usize;
}

/// A haptic loop whose position counter can be loaded. The encoder's lines and the clock are then left out
/// (`model.encoder = "loaded"`). Every haptic loop and method loop implements it.
pub trait Loaded: AxisWiring {
    /// Loads the counter with a position, modulo its width, and lets the nets settle with these inputs.
    fn load(&mut self, position: i64, input: &LoopIn<i64>);
}

/// Blocks connected as in the VHDL: a tick reads `now`, writes `next`, then swaps them, so the order of lines cannot
/// matter.
///
/// A wiring is a block whose ports are the FPGA's pins and the words that the scene sets. Its *nets* are its inputs,
/// its outputs and the architecture signals of its VHDL twin, in that order. Waveforms, traces and the closed-loop
/// check are made of the nets. The haptic loops, the method loops, the arm's wirings and the loop of a reference
/// law in `cosim` implement it, and `cosim::ClosedLoop` joins any of them to a world.
///
/// ```
/// use hpu_datapath::{Block, HybridLoop, LoopIn, Wiring};
/// use hpu_signal::Ports;
///
/// let mut wiring = HybridLoop::default();
/// wiring.reset();
/// let input = LoopIn { a_pin: 1, ..LoopIn::build(|| 0) };
/// for _ in 0..3 {
///     wiring.tick(input);
/// }
/// // Waveforms and traces read the nets by name.
/// let net = Wiring::nets(&wiring).iter().position(|net| net.name == "a_pin").expect("a pin");
/// assert_eq!(Wiring::words(&wiring)[net], 1);
/// ```
pub trait Wiring: Block {
    /// Returns all nets: inputs, outputs, then architecture signals.
    fn nets(&self) -> Vec<Signal>;
    /// Returns the number of nets that are ports.
    fn ports(&self) -> usize {
        let mut count = 0;
        self.inputs().each(|_: &Signal| count += 1);
        self.outputs().each(|_: &Signal| count += 1);
        count
    }
    /// Returns the instances, in the order of the VHDL.
    fn instances(&self) -> Vec<Instance>;
    /// Lets the combinational nets settle with these inputs and the registers as they stand. It makes the words that
    /// the nets show between reset and the first edge.
    fn settle(&mut self, input: &Self::In<i64>);
    /// Returns the words of all nets as they stand after the latest edge, in the order of [`nets`](Wiring::nets).
    fn words(&self) -> &[i64];
    /// Stops the modulator, if there is one, for good: the gates stay 0 and keep nothing from being quiet. It is called
    /// if the gates do not drive the world (an averaged bridge, an amplifier).
    fn rest_modulator(&mut self) {}
    /// Computes [`quiet`](Block::quiet) for the input of the latest tick, if there has been one.
    /// A wiring that keeps its inputs need not compare them.
    fn quiet_again(&self, input: &Self::In<i64>) -> u64 {
        self.quiet(input)
    }
    /// Tells inputs that differ from those of the latest tick. The next tick is then a
    /// [`tick_again`](Wiring::tick_again) with them.
    fn take(&mut self, _input: &Self::In<i64>) {}
    /// Computes [`tick`](Block::tick) with the input of the latest tick, if there has been one, or with the input just
    /// [taken](Wiring::take). Returns the outputs; `None` if they certainly are those of the tick before. A wiring that
    /// keeps its inputs need not compare them.
    fn tick_again(&mut self, input: &Self::In<i64>) -> Option<Self::Out<i64>>
    where
        Self::In<i64>: Copy,
    {
        Some(self.tick(*input))
    }
    /// Computes [`tick_again`](Wiring::tick_again) once or more, at up to `edges` edges. It stops at an edge at which
    /// an output or a `watched` net (bit `n` is net `n`) changes, and where the next edge may change nothing. Returns
    /// the number of edges, and the outputs; `None` if they certainly are those of the tick before.
    fn tick_on(&mut self, _edges: u64, _watched: u64, input: &Self::In<i64>) -> (u64, Option<Self::Out<i64>>)
    where
        Self::In<i64>: Copy,
    {
        (1, self.tick_again(input))
    }
    /// Returns for how many edges only nets change that follow a converter's code, and these nets: bit `n` is net `n`.
    /// A wiring that [gathers](Wiring::gather) no codes returns 0.
    #[inline(always)]
    fn gathers(&self) -> (u64, u64) {
        (0, 0)
    }
    /// Ticks while a converter gives these codes, up to the last one: the first comes after so many edges, the others
    /// so many edges apart. All come within the edges that [`gathers`](Wiring::gathers) has just announced. Returns the
    /// edges at which a block is due or a code changes.
    fn gather(&mut self, _: (u64, u64), _codes: &[i64]) -> u64 {
        unreachable!("no codes are gathered")
    }
    /// Returns how the outputs repeat from the edge just ticked on while this input stays, or `None` if they do not.
    fn repeats(&self, _: &Self::In<i64>) -> Option<Repeat<Self::Out<i64>>> {
        None
    }
    /// Ticks that many edges at once, in constant time. The number must lie between `first` and `edges` of the
    /// repetition that [`repeats`](Wiring::repeats) has just announced.
    fn skip_repeats(&mut self, _edges: u64, _input: &Self::In<i64>) {
        unreachable!("nothing repeats")
    }
    /// Returns the range and the lost bits of every net since reset.
    fn uses(&self) -> Vec<SignalUse>;
    /// Returns whether registers and nets are as they were in an earlier state of this wiring, so that under equal
    /// inputs it goes on as it did from there. A wiring that is not certain returns `false`.
    fn recurs(&self, _earlier: &Self) -> bool
    where
        Self: Sized,
    {
        false
    }
    /// Returns whether these nets, bit `n` net `n`, and the registers that drive any of them are as they were in an
    /// earlier state, as [`recurs`](Wiring::recurs) does for all.
    #[cfg(not(target_family = "wasm"))]
    fn recurs_in(&self, _live: u64, earlier: &Self) -> bool
    where
        Self: Sized,
    {
        self.recurs(earlier)
    }
    /// Counts the use of the nets as if the edges between two states had come so many times more, at least once. The
    /// second state [recurs](Wiring::recurs), and this one lies between them.
    fn repeat(&mut self, _: [&Self; 2], _times: u64)
    where
        Self: Sized,
    {
        unreachable!("a wiring that does not recur")
    }
    /// Returns the nets that have lost upper bits as they stand after the latest edge: bit `n` is net `n`.
    fn overflowing(&self) -> u64 {
        0
    }
}

/// A wiring whose port bundles are slices, in port order. Every [`Wiring`] implements it. Code other than the inner
/// loop of a run uses it, so that it is compiled once and not for each wiring.
pub trait AnyWiring: AnyBlock {
    /// See [`Wiring::nets`].
    fn nets(&self) -> Vec<Signal>;
    /// See [`Wiring::instances`].
    fn instances(&self) -> Vec<Instance>;
    /// See [`Wiring::words`].
    fn words(&self) -> &[i64];
    /// Computes one edge with `rst = '0'`; [`words`](Self::words) contain the outputs.
    fn step(&mut self, input: &[i64]);
    /// See [`Wiring::rest_modulator`].
    fn rest_modulator(&mut self);
    /// See [`Wiring::repeats`].
    fn repeats(&self, input: &[i64]) -> Option<Repeat<Vec<i64>>>;
    /// See [`Wiring::uses`].
    fn uses(&self) -> Vec<SignalUse>;
}

impl<W: Wiring> AnyWiring for W {
    fn nets(&self) -> Vec<Signal> {
        Wiring::nets(self)
    }
    fn instances(&self) -> Vec<Instance> {
        Wiring::instances(self)
    }
    fn words(&self) -> &[i64] {
        Wiring::words(self)
    }
    fn step(&mut self, input: &[i64]) {
        Block::tick(self, bundle(input));
    }
    fn rest_modulator(&mut self) {
        Wiring::rest_modulator(self);
    }
    fn repeats(&self, input: &[i64]) -> Option<Repeat<Vec<i64>>> {
        let Repeat { period, first, others, edges } = Wiring::repeats(self, &bundle(input))?;
        Some(Repeat { period, first, others: flatten(&others), edges })
    }
    fn uses(&self) -> Vec<SignalUse> {
        Wiring::uses(self)
    }
}
