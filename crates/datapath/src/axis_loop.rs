//! The loop of one axis: a circuit from the encoder's pins to the command, and the modulator behind it.

use hpu_signal::{Meter, Ports, Signal, SignalUse};

use crate::circuit::{Circuit, Lost, driven, instance};
use crate::{AxisWiring, Block, Generic, Instance, Loaded, LoopIn, LoopOut, Parts, Pwm, Repeat, Wiring, flatten, pwm};

/// The circuit of an axis up to the command, its last net. Its inputs are those of the loop, its first outputs the
/// gates, which the modulator drives.
pub trait AxisCircuit<const N: usize>: Circuit<N> {
    /// Name of the loop, which is that of its VHDL entity.
    const NAME: &'static str;
    /// Describes the inputs.
    fn inputs(&self) -> LoopIn<Signal>;
    /// Returns the VHDL generics, in the order of the entity.
    fn generics(&self) -> Vec<(&'static str, Generic)>;
    /// Returns a net as the loop describes it, given its driver's description.
    fn described(&self, net: Signal) -> Signal {
        net
    }
    /// Sets the counter to a position, and its net to the counter's word unless the front that contains both does.
    fn load(&mut self, position: i64, words: &mut [i64; N]);
}

/// A haptic loop, position counter to H-bridge, with any circuit between.
///
/// [`uses`](Wiring::uses) counts the edges during which a net had lost bits; a limited command counts as overflowed
/// from the edge at which it is limited, even if it is shown later. Before the first edge, every least word is above
/// the greatest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AxisLoop<C, const N: usize> {
    pub(crate) circuit: C,
    modulator: Pwm,
    /// The inputs with which the nets have settled; `None` since reset.
    settled: Option<LoopIn<i64>>,
    words: [i64; N],
    meter: Meter<N>,
    /// The losses of the nets, and the number of edges with these losses that the meter has not counted yet.
    lost: [Lost; N],
    standing: u64,
}

/// The gates of the bridge among the nets.
const GATES: usize = 7;
const BEHIND: usize = GATES + 4;

impl<C: AxisCircuit<N>, const N: usize> AxisLoop<C, N> {
    /// Returns a loop in its state after reset.
    pub(crate) fn of(circuit: C, modulator: Pwm) -> Self {
        let meter = Meter::default();
        let lost = [(false, false); N];
        let mut wiring = Self { circuit, modulator, settled: None, words: [0; N], meter, lost, standing: 0 };
        wiring.reset();
        wiring
    }

    #[inline]
    fn at_modulator(&self) -> pwm::In<i64> {
        pwm::In { command: self.words[C::COUNT - 1] }
    }

    /// Lets the nets follow the circuit's inputs and registers, whose words have changed since `before`.
    #[inline]
    fn follow(&mut self, before: Option<&[i64; N]>) {
        let mut lost = self.lost;
        self.circuit.follow(before, &mut self.words, &mut lost);
        if lost != self.lost {
            self.count_lost();
            self.lost = lost;
        }
    }

    /// Lets the nets follow these inputs, and whatever else has changed since `before`.
    #[inline]
    fn take_in(&mut self, input: &LoopIn<i64>, before: &[i64; N]) {
        self.settled = Some(*input);
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        self.follow(Some(before));
    }

    /// Brings the meter of lost bits up to date.
    fn count_lost(&mut self) {
        for (net, (rounded, overflowed)) in self.lost.into_iter().enumerate() {
            self.meter.lost(net, rounded, overflowed, self.standing);
        }
        self.standing = 0;
    }
}

/// Returns the gates in the order of the nets.
#[inline]
fn gates(pwm::Out { a_high, a_low, b_high, b_low }: pwm::Out<i64>) -> [i64; 4] {
    [a_high, a_low, b_high, b_low]
}

impl<C: AxisCircuit<N>, const N: usize> Block for AxisLoop<C, N> {
    const NAME: &'static str = C::NAME;
    const CLOCKED: bool = true;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        self.circuit.inputs()
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.circuit.generics()
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> LoopOut<i64> {
        self.circuit.reset();
        self.modulator.reset();
        self.words = [0; N];
        self.follow(None);
        self.settled = None;
        self.meter = Meter::default();
        self.standing = 0;
        LoopOut::build(|| 0)
    }

    #[inline]
    fn tick(&mut self, input: LoopIn<i64>) -> LoopOut<i64> {
        let fresh = self.settled != Some(input);
        if fresh {
            // As in VHDL, the registers see the combinational nets that result from the new inputs.
            self.take_in(&input, &{ self.words });
        }
        let before = self.words;
        self.circuit.tick(&before, &mut self.words);
        self.follow(Some(&before));
        let moved = self.words != before;
        let switched = self.modulator.tick(pwm::In { command: before[C::COUNT - 1] });
        let gates = gates(switched);
        self.words[GATES..BEHIND].copy_from_slice(&gates);
        if fresh || moved {
            self.meter.range(&self.words);
        } else if gates != before[GATES..BEHIND] {
            self.meter.range_from(GATES, &gates);
        }
        self.standing += 1;
        let pwm::Out { a_high, a_low, b_high, b_low } = switched;
        LoopOut { a_high, a_low, b_high, b_low }
    }

    #[inline]
    fn quiet(&self, input: &LoopIn<i64>) -> u64 {
        if self.settled != Some(*input) {
            return 0;
        }
        self.modulator.quiet(&self.at_modulator()).min(self.circuit.quiet(&self.words))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LoopIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.circuit.skip(edges, &self.words);
        let modulator = self.at_modulator();
        self.modulator.skip(edges, &modulator);
        self.standing = self.standing.saturating_add(edges);
    }
}

impl<C: AxisCircuit<N>, const N: usize> AxisWiring for AxisLoop<C, N> {
    const COMMAND: usize = C::COUNT - 1;
}

impl<C: AxisCircuit<N>, const N: usize> Loaded for AxisLoop<C, N> {
    #[inline]
    fn load(&mut self, position: i64, input: &LoopIn<i64>) {
        let before = self.words;
        self.circuit.load(position, &mut self.words);
        self.take_in(input, &before);
    }
}

impl<C: AxisCircuit<N>, const N: usize> Wiring for AxisLoop<C, N> {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        let inside = driven(&C::names(), BEHIND, &self.circuit.instances());
        all.extend(inside.into_iter().map(|net| self.circuit.described(net)));
        all
    }

    fn instances(&self) -> Vec<Instance> {
        let mut all = self.circuit.instances();
        let nets: Vec<_> = [Self::COMMAND].into_iter().chain(GATES..BEHIND).collect();
        all.push(instance("modulator", &self.modulator, &nets).mapped(&[("WIDTH", "PWM_WIDTH")]));
        all
    }

    fn settle(&mut self, input: &LoopIn<i64>) {
        self.take_in(input, &{ self.words });
        // The first edge treats its inputs as new ones.
        self.settled = None;
    }

    fn words(&self) -> &[i64] {
        &self.words[..C::COUNT]
    }

    fn rest_modulator(&mut self) {
        self.modulator.rest();
    }

    #[inline]
    fn repeats(&self, input: &LoopIn<i64>) -> Option<Repeat<LoopOut<i64>>> {
        let Repeat { period, first, others, .. } = self.modulator.repeats(&self.at_modulator())?;
        let pwm::Out { a_high, a_low, b_high, b_low } = others;
        let edges = if self.settled == Some(*input) { self.circuit.quiet(&self.words) } else { 0 };
        Some(Repeat { period, first, others: LoopOut { a_high, a_low, b_high, b_low }, edges })
    }

    #[inline]
    fn skip_repeats(&mut self, edges: u64, _: &LoopIn<i64>) {
        self.circuit.skip(edges, &self.words);
        self.meter.range_from(GATES, &gates(self.modulator.pause()));
        self.words[GATES..BEHIND].copy_from_slice(&gates(self.modulator.skip_repeats(edges)));
        self.standing = self.standing.saturating_add(edges);
    }

    fn uses(&self) -> Vec<SignalUse> {
        let mut now = self.clone();
        now.count_lost();
        now.meter.uses()[..C::COUNT].to_vec()
    }
}
