//! What every wiring offers beside being a block: its nets, its hierarchy, and the use it made of its words.

use hpu_signal::{Ports, Signal, SignalUse};

use crate::{AnyBlock, Block};

hpu_signal::ports! {
    /// Inputs of a haptic loop: the encoder's pins and the words that the scene sets.
    pub struct LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
}

hpu_signal::ports! {
    /// Outputs of a haptic loop: the gates of the H-bridge.
    pub struct LoopOut { a_high, a_low, b_high, b_low }
}

/// One port of an instance and the net of the wiring it is connected to.
pub struct Connection {
    /// Port of the instance.
    pub port: Signal,
    /// Index of the net in [`Wiring::nets`].
    pub net: usize,
}

/// An instance inside a wiring, as VHDL has it: `label : entity work.block`.
pub struct Instance {
    /// Instance label; the scope's name in a waveform.
    pub label: &'static str,
    /// The block, configured as it stands here, after reset: its name is the entity's.
    pub model: Box<dyn AnyBlock>,
    /// Its ports that nets are connected to, in order.
    pub connections: Vec<Connection>,
    /// Its inputs that are tied to a constant instead.
    pub tied: Vec<(&'static str, i64)>,
}

/// Everything that is inside a block made of other blocks and of nothing else.
pub struct Parts {
    /// Its inputs, its outputs, then the nets inside.
    pub nets: Vec<Signal>,
    /// Its instances, connected to these nets, in the order of the VHDL.
    pub instances: Vec<Instance>,
}

impl Parts {
    pub(crate) fn of(wiring: &impl Wiring) -> Self {
        Self { nets: wiring.nets(), instances: wiring.instances() }
    }
}

/// Outputs that repeat while all else stands still: a modulator's.
///
/// Those of the edge just ticked, which begin a period, stay for `first` edges; then come `others` to the end of it;
/// and so on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Repeat<O> {
    /// Edges of a period.
    pub period: u64,
    /// Edges of its first outputs, from 1 to one less than the period's.
    pub first: u64,
    /// Its other outputs.
    pub others: O,
    /// For how many further edges all other nets certainly stay as they are. The outputs repeat for one more: what they
    /// make of another net comes an edge later.
    pub edges: u64,
}

/// A haptic loop whose position counter can be put to a count: what is left of an encoder whose lines are left out.
pub trait Loaded: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> {
    /// Puts the counter to a position, modulo its width, and lets the nets settle with these inputs.
    fn load(&mut self, position: i64, input: &LoopIn<i64>);
}

/// Blocks put together as VHDL would: read `now`, write `next`, then swap, so that the order of lines cannot matter.
///
/// A wiring is a block whose ports are the FPGA's pins and the words that the scene sets. Its *nets* are its inputs,
/// its outputs and the architecture signals of its VHDL twin, in that order; they are what waveforms, traces and the
/// closed-loop check are made of.
pub trait Wiring: Block {
    /// All nets: inputs, outputs, then architecture signals.
    fn nets(&self) -> Vec<Signal>;
    /// How many of the nets are ports.
    fn ports(&self) -> usize {
        let mut count = 0;
        self.inputs().each(|_: &Signal| count += 1);
        self.outputs().each(|_: &Signal| count += 1);
        count
    }
    /// The instances, in the order of the VHDL.
    fn instances(&self) -> Vec<Instance>;
    /// Lets the combinational nets settle with these inputs and the registers as they stand: what the nets show between
    /// reset and the first edge.
    fn settle(&mut self, input: &Self::In<i64>);
    /// The words of all nets as they stand after the latest edge, in the order of [`nets`](Wiring::nets).
    fn words(&self) -> &[i64];
    /// Stops the modulator, if there is one, for good: the gates stay 0 and keep nothing from being quiet. For a world
    /// that the gates do not drive (an averaged bridge, an amplifier).
    fn rest_modulator(&mut self) {}
    /// How the outputs repeat from the edge just ticked on, while this input stays, if they do.
    fn repeats(&self, _: &Self::In<i64>) -> Option<Repeat<Self::Out<i64>>> {
        None
    }
    /// That many ticks at once, in constant time, from where [`repeats`](Wiring::repeats) has told of as many: from the
    /// other outputs' first edge on.
    fn skip_repeats(&mut self, _edges: u64, _input: &Self::In<i64>) {
        unreachable!("nothing repeats")
    }
    /// Range and lost bits of every net since reset.
    fn uses(&self) -> Vec<SignalUse>;
}
