//! The driver of every circuit: one clock edge with its nets and their use, from edge to edge and in leaps.
//!
//! An edge costs what it changes: a clocked block is ticked only at edges at which its outputs may change. In a haptic
//! loop a step of the encoder comes from the synchronizer to the position at once, unless an observer watches the nets
//! between.

use hpu_signal::{Meter, Ports, Signal, SignalUse};

use crate::circuit::{Circuit, Lost, NEVER, Pace, Set, driven, instance, put};
use crate::{
    AxisWiring, Block, Generic, Instance, Loaded, LoopIn, LoopOut, Parts, PositionCounter, Pwm, QuadratureDecoder,
    Repeat, Synchronizer, Wiring, flatten, pins::position_counter, pins::pwm, pins::quadrature_decoder,
    pins::synchronizer,
};

/// The circuit of a loop. Its inputs are those of the loop, then come the loop's outputs.
pub trait LoopCircuit<const N: usize>: Circuit<N> + PartialEq {
    /// Name of the loop, which is that of its VHDL entity.
    const NAME: &'static str;
    /// The number of inputs.
    const INPUTS: usize;
    /// Input ports.
    type In<T>: Ports<T>;
    /// Output ports.
    type Out<T>: Ports<T>;
    /// Describes the inputs.
    fn inputs(&self) -> Self::In<Signal>;
    /// Describes the outputs.
    fn outputs(&self) -> Self::Out<Signal>;
    /// Returns the VHDL generics, in the order of the entity.
    fn generics(&self) -> Vec<(&'static str, Generic)>;
    /// Returns a net inside as the loop describes it, given its driver's description.
    fn described(&self, net: Signal) -> Signal {
        net
    }
    /// Returns the modulator, if there is one. It reads the last net and drives the outputs, four gates.
    fn modulator(&self) -> Option<&Pwm> {
        None
    }
    /// Returns the modulator to be ticked.
    fn modulator_mut(&mut self) -> Option<&mut Pwm> {
        None
    }
    /// Stops a modulator that is one of the circuit's blocks, from the edge after this one on.
    fn rest(&mut self, _edge: u64) {}
    /// See [`Wiring::gathers`]; this is the present edge.
    #[inline(always)]
    fn gathers(&self, _edge: u64) -> (u64, Set) {
        (0, 0)
    }
    /// See [`Wiring::gather`]; the first code comes at the edge `first`. Tells all words that the nets show.
    fn gather(&mut self, _: (u64, u64), _codes: &[i64], _words: &mut [i64; N], _tell: impl FnMut(usize, i64)) -> u64 {
        0
    }
    /// The nets that a step of the encoder changes before it comes to the position; none if
    /// [`pass_step`](Self::pass_step) computes nothing.
    const PASSED: Set = 0;
    /// Computes the three edges after this one (`WAY`) at once, if the synchronizer shows a step of the encoder at the
    /// first of them, which then comes to the position, and no other block is due at them. `None` means that it has
    /// computed nothing.
    #[inline]
    fn pass_step(&mut self, _edge: u64, _words: &mut [i64; N]) -> Option<Passed> {
        None
    }
}

/// The number of edges in which a step of the encoder comes from the synchronizer's first register to the position.
pub const WAY: u64 = 3;

/// The blocks that a step of the encoder passes, with their paces.
pub(crate) struct Way<'c> {
    pub(crate) sync: (&'c mut Pace<synchronizer::In<i64>>, &'c mut Synchronizer),
    pub(crate) decoder: (&'c mut Pace<quadrature_decoder::In<i64>>, &'c mut QuadratureDecoder),
    pub(crate) counter: &'c mut PositionCounter,
}

impl Way<'_> {
    /// Passes a step as [`LoopCircuit::pass_step`] asks, if the synchronizer shows one and `is_due` says of no edge up
    /// to its last one that another block is due there. Returns the lines, the step and the position.
    #[inline(always)]
    pub(crate) fn pass(
        self,
        edge: u64,
        is_due: impl FnOnce(u64) -> bool,
    ) -> Option<(synchronizer::Out<i64>, [i64; 2])> {
        let Self { sync: (pace, sync), decoder: (decoding, decoder), counter } = self;
        if pace.due() != edge + 1 || decoding.due() <= edge + WAY || is_due(edge + WAY) {
            return None;
        }
        pace.catch_up(sync, edge);
        let synchronizer::Out { a, b } = sync.coming();
        let lines = quadrature_decoder::In { a, b };
        // Up to the edge at which the synchronizer shows the step, the decoder sees the lines before it.
        decoding.catch_up(decoder, edge + 1);
        let step = decoder.pass(lines)?;
        decoding.rest(edge + WAY, lines);
        pace.tick(sync, edge + 1);
        // The counter has no step to count before and after this one.
        let position_counter::Out { position } = counter.tick(position_counter::In { step });
        Some((synchronizer::Out { a, b }, [step, position]))
    }
}

/// The nets after a step of the encoder has come to the position.
pub struct Passed {
    /// The nets that have changed.
    pub changed: Set,
    /// The net of the step, and its word before it became 0 again.
    pub step: (usize, i64),
}

/// The circuit of an axis, up to the command of its modulator.
pub trait AxisCircuit<const N: usize>: LoopCircuit<N, In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> {
    /// Sets the counter to a position after an edge, and its net to the counter's word unless the front that contains
    /// both does that. Returns the net, if it may change.
    fn load(&mut self, edge: u64, position: i64, words: &mut [i64; N]) -> Set;
}

/// A circuit with its words.
///
/// [`uses`](Wiring::uses) counts the edges during which a net had lost bits; a limited command counts as overflowed
/// from the edge at which it is limited, even if it is shown later. Before the first edge, every least word is above
/// the greatest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CircuitLoop<C, const N: usize> {
    pub(crate) circuit: C,
    /// Whether the nets have settled with the inputs that they show.
    settled: bool,
    words: [i64; N],
    meter: Meter<N>,
    /// The nets whose ranges do not contain their words yet.
    changed: Set,
    /// The losses of the nets, and the edge up to which the meter has counted them.
    lost: Lost,
    counted: u64,
    /// The edge after which the words are these; the first is edge 1.
    edge: u64,
    /// The next edge at which a block of the circuit is due.
    due: u64,
    /// The pace of the modulator, if there is one.
    modulation: Pace<pwm::In<i64>>,
    /// The next edge at which a block or the modulator is due; 0 unless the nets have settled.
    next: u64,
}

impl<C: LoopCircuit<N>, const N: usize> CircuitLoop<C, N> {
    /// Returns a loop in its state after reset.
    pub(crate) fn of(circuit: C) -> Self {
        let mut wiring = Self {
            circuit,
            settled: false,
            words: [0; N],
            meter: Meter::default(),
            changed: 0,
            lost: Lost::default(),
            counted: 0,
            edge: 0,
            due: NEVER,
            modulation: Pace::default(),
            next: 0,
        };
        wiring.reset();
        wiring
    }

    /// Returns whether the nets have settled with these inputs.
    #[inline]
    fn has_settled(&self, input: &C::In<i64>) -> bool {
        let (mut differs, mut net) = (0, 0);
        input.each(|word| {
            differs |= self.words[net] ^ word;
            net += 1;
        });
        self.settled && differs == 0
    }

    #[inline]
    fn at_modulator(&self) -> pwm::In<i64> {
        pwm::In { command: self.words[C::COUNT - 1] }
    }

    /// The nets of the outputs.
    #[inline(always)]
    fn outputs_set() -> Set {
        let (mut set, mut net) = (0, C::INPUTS);
        C::Out::<()>::build(|| {
            set |= 1 << net;
            net += 1;
        });
        set
    }

    /// Finds the next edge at which anything is due.
    #[inline]
    fn plan(&mut self) {
        self.next = if self.settled { self.due.min(self.modulation.due()) } else { 0 };
    }

    /// Ticks the blocks that are due at an edge, then lets the nets follow and the clocked blocks see them. Returns the
    /// nets that have changed.
    #[inline(never)]
    fn work(&mut self, edge: u64) -> Set {
        let mut lost = self.lost;
        let mut changed = 0;
        // The modulator first: it must not see a new command before the edge after it.
        if self.modulation.due() <= edge
            && let Some(modulator) = self.circuit.modulator_mut()
        {
            let gates = self.modulation.tick(modulator, edge);
            changed |= self.switch(&gates);
        }
        changed |= self.circuit.tick(edge, &mut self.words, &mut lost);
        let changed = self.spread(edge, changed, lost);
        self.range();
        changed
    }

    /// Lets the nets follow these changed ones after an edge, and the clocked blocks see them. `lost` are the losses of
    /// the blocks that were ticked. Returns all nets that have changed.
    #[inline(always)]
    fn spread(&mut self, edge: u64, mut changed: Set, mut lost: Lost) -> Set {
        if changed & C::FOLLOWED != 0 {
            changed = self.circuit.follow(edge, changed, &mut self.words, &mut lost);
        }
        if lost != self.lost {
            self.count_lost();
            self.lost = lost;
        }
        self.changed |= changed;
        self.due = self.circuit.look(edge, changed, &self.words);
        let command = self.at_modulator();
        if changed >> (C::COUNT - 1) & 1 == 1
            && let Some(modulator) = self.circuit.modulator_mut()
        {
            self.modulation.look(modulator, edge, command);
        }
        self.plan();
        changed
    }

    /// Lets the nets follow these inputs, and whatever else has changed.
    #[inline(never)]
    fn take_in(&mut self, input: &C::In<i64>, mut changed: Set) {
        self.settled = true;
        let mut net = 0;
        input.each(|&word| {
            changed |= put(&mut self.words, net, word);
            net += 1;
        });
        self.spread(self.edge, changed, self.lost);
    }

    /// Brings the meter of lost bits up to date.
    fn count_lost(&mut self) {
        let Lost { rounded, overflowed } = self.lost;
        for net in members(rounded | overflowed) {
            let (rounded, overflowed) = self.lost.of(net);
            self.meter.lost(net, rounded, overflowed, self.edge - self.counted);
        }
        self.counted = self.edge;
    }

    /// Returns the number of edges that come before a due one; `u64::MAX` before [`NEVER`].
    #[inline]
    fn before(&self, due: u64) -> u64 {
        if due == NEVER { u64::MAX } else { due.saturating_sub(self.edge + 1) }
    }

    /// Puts words of the modulator on the outputs' nets. Returns the nets that have changed.
    #[inline]
    fn switch(&mut self, gates: &pwm::Out<i64>) -> Set {
        let pwm::Out { a_high, a_low, b_high, b_low } = *gates;
        let gates = [a_high, a_low, b_high, b_low];
        let differs = (C::INPUTS..).zip(gates).fold(0, |differs, (net, gate)| differs | self.words[net] ^ gate);
        let mut changed = 0;
        if differs != 0 {
            for (net, gate) in (C::INPUTS..).zip(gates) {
                changed |= put(&mut self.words, net, gate);
            }
        }
        self.changed |= changed;
        changed
    }

    /// Computes the next [`WAY`] edges at once, if a step of the encoder comes to the position at the last of them and
    /// nothing else is due. Returns the nets that have changed; `None` if nothing was computed.
    #[inline(always)]
    fn pass_step(&mut self) -> Option<Set> {
        let last = self.edge + WAY;
        if self.modulation.due() <= last {
            return None;
        }
        let Passed { changed, step: (net, word) } = self.circuit.pass_step(self.edge, &mut self.words)?;
        self.meter.range_of(net, word);
        self.changed |= changed;
        // Lost bits change at the last edge: those before are counted up to the edge before it. Only the position is
        // seen by other blocks.
        self.edge = last - 1;
        let changed = self.pass_on(last, changed & !C::PASSED);
        self.edge = last;
        Some(changed)
    }

    /// Lets the other nets follow those that a step of the encoder has changed. Returns all nets that have changed.
    #[inline(never)]
    fn pass_on(&mut self, edge: u64, changed: Set) -> Set {
        let changed = self.spread(edge, changed, self.lost);
        self.range();
        changed
    }

    /// Computes an edge with the inputs that the nets show. At most edges there is nothing to do. Returns the nets that
    /// have changed.
    #[inline(always)]
    fn go_on(&mut self) -> Set {
        let edge = self.edge + 1;
        let mut changed = 0;
        if self.next <= edge {
            changed = self.work(edge);
        } else if self.changed != 0 {
            self.range();
        }
        self.edge = edge;
        changed
    }

    /// Returns the loop with all of its blocks brought up to date, and edges counted from the present one.
    fn rebased(&self) -> Self {
        let mut now = self.clone();
        now.circuit.rebase(self.edge);
        if let Some(modulator) = now.circuit.modulator_mut() {
            now.modulation.rebase(modulator, self.edge);
        }
        now
    }

    #[inline]
    fn shown(&self) -> C::Out<i64> {
        bundle(&self.words[C::INPUTS..])
    }

    /// Extends the ranges of the changed nets by their words.
    #[inline]
    fn range(&mut self) {
        for net in members(self.changed) {
            self.meter.range_of(net, self.words[net]);
        }
        self.changed = 0;
    }
}

/// Returns the members of a set.
#[inline]
fn members(mut set: Set) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if set == 0 {
            return None;
        }
        let next = set.trailing_zeros() as usize;
        set &= set - 1;
        Some(next)
    })
}

/// The number of gates that a modulator drives.
const GATES: usize = 4;

/// Returns a bundle of the words from the first on.
#[inline]
fn bundle<P: Ports<i64>>(words: &[i64]) -> P {
    let mut next = words.iter();
    P::build(|| *next.next().expect("one word a port"))
}

impl<C: LoopCircuit<N>, const N: usize> Block for CircuitLoop<C, N> {
    const NAME: &'static str = C::NAME;
    const CLOCKED: bool = true;
    type In<T> = C::In<T>;
    type Out<T> = C::Out<T>;

    fn inputs(&self) -> C::In<Signal> {
        self.circuit.inputs()
    }

    fn outputs(&self) -> C::Out<Signal> {
        self.circuit.outputs()
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.circuit.generics()
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> C::Out<i64> {
        self.circuit.reset();
        if let Some(modulator) = self.circuit.modulator_mut() {
            modulator.reset();
        }
        self.modulation = Pace::default();
        (self.edge, self.counted) = (0, 0);
        self.words = [0; N];
        self.lost = Lost::default();
        self.settled = false;
        self.spread(0, Set::MAX, self.lost);
        self.changed = Set::MAX >> (64 - C::COUNT);
        self.meter = Meter::default();
        C::Out::build(|| 0)
    }

    #[inline]
    fn tick(&mut self, input: C::In<i64>) -> C::Out<i64> {
        if !self.has_settled(&input) {
            // As in VHDL, the registers see the combinational nets that result from the new inputs.
            self.take_in(&input, 0);
        }
        self.go_on();
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &C::In<i64>) -> u64 {
        if self.has_settled(input) { self.quiet_again(input) } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &C::In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.edge = self.edge.saturating_add(edges);
    }
}

impl<C: AxisCircuit<N>, const N: usize> AxisWiring for CircuitLoop<C, N> {
    const COMMAND: usize = C::COUNT - 1;
}

impl<C: AxisCircuit<N>, const N: usize> Loaded for CircuitLoop<C, N> {
    #[inline]
    fn load(&mut self, position: i64, input: &LoopIn<i64>) {
        let changed = self.circuit.load(self.edge, position, &mut self.words);
        self.take_in(input, changed);
    }
}

impl<C: LoopCircuit<N>, const N: usize> Wiring for CircuitLoop<C, N> {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        let inside = driven(&C::names(), all.len(), &self.circuit.instances());
        all.extend(inside.into_iter().map(|net| self.circuit.described(net)));
        all
    }

    fn instances(&self) -> Vec<Instance> {
        let mut all = self.circuit.instances();
        if let Some(modulator) = self.circuit.modulator() {
            let nets: Vec<_> = [C::COUNT - 1].into_iter().chain(C::INPUTS..C::INPUTS + GATES).collect();
            all.push(instance("modulator", modulator, &nets).mapped(&[("WIDTH", "PWM_WIDTH")]));
        }
        all
    }

    fn settle(&mut self, input: &C::In<i64>) {
        self.take_in(input, 0);
        // The first edge treats its inputs as new ones.
        self.settled = false;
        self.plan();
    }

    fn words(&self) -> &[i64] {
        &self.words[..C::COUNT]
    }

    fn overflowing(&self) -> u64 {
        self.lost.overflowed
    }

    fn rest_modulator(&mut self) {
        if let Some(modulator) = self.circuit.modulator_mut() {
            modulator.rest();
            self.modulation.wake(self.edge + 1);
        }
        self.circuit.rest(self.edge);
        // The next edge looks at all blocks.
        self.settled = false;
        self.plan();
    }

    #[inline(always)]
    fn gathers(&self) -> (u64, Set) {
        if self.settled { self.circuit.gathers(self.edge) } else { (0, 0) }
    }

    #[inline(never)]
    fn gather(&mut self, (first, period): (u64, u64), codes: &[i64]) -> u64 {
        let (mut changed, meter, times) = (0, &mut self.meter, (self.edge + first, period));
        let ticks = self.circuit.gather(times, codes, &mut self.words, |net, word| {
            changed |= 1 << net;
            meter.range_of(net, word);
        });
        self.edge += first + period * (codes.len() as u64 - 1);
        self.spread(self.edge, changed, self.lost);
        self.range();
        ticks
    }

    #[inline]
    fn quiet_again(&self, input: &C::In<i64>) -> u64 {
        debug_assert!(!self.settled || self.has_settled(input));
        self.before(self.next)
    }

    #[inline]
    fn take(&mut self, input: &C::In<i64>) {
        self.take_in(input, 0);
    }

    #[inline(always)]
    fn tick_again(&mut self, input: &C::In<i64>) -> Option<C::Out<i64>>
    where
        C::In<i64>: Copy,
    {
        if !self.settled {
            self.take_in(input, 0);
        }
        debug_assert!(self.has_settled(input));
        let changed = self.go_on();
        (changed & Self::outputs_set() != 0).then(|| self.shown())
    }

    #[inline(always)]
    fn tick_on(&mut self, edges: u64, watched: Set, input: &C::In<i64>) -> (u64, Option<C::Out<i64>>)
    where
        C::In<i64>: Copy,
    {
        if !self.settled {
            return (1, self.tick_again(input));
        }
        debug_assert!(self.has_settled(input));
        let watched = watched | Self::outputs_set();
        let is_passable = edges >= WAY && watched & C::PASSED == 0;
        let passed = if is_passable { self.pass_step() } else { None };
        let mut done = if passed.is_some() { WAY } else { 1 };
        let mut changed = passed.unwrap_or_else(|| self.go_on());
        while done < edges && changed & watched == 0 && self.next <= self.edge + 1 {
            changed = self.go_on();
            done += 1;
        }
        (done, (changed & Self::outputs_set() != 0).then(|| self.shown()))
    }

    #[inline]
    fn repeats(&self, input: &C::In<i64>) -> Option<Repeat<C::Out<i64>>> {
        let modulator = self.circuit.modulator().filter(|_| self.modulation.is_at(self.edge))?;
        let Repeat { period, first, others, .. } = modulator.repeats(&self.at_modulator())?;
        let pwm::Out { a_high, a_low, b_high, b_low } = others;
        let edges = if self.has_settled(input) { self.before(self.due) } else { 0 };
        Some(Repeat { period, first, others: bundle(&[a_high, a_low, b_high, b_low]), edges })
    }

    #[inline]
    fn skip_repeats(&mut self, edges: u64, _: &C::In<i64>) {
        self.edge = self.edge.saturating_add(edges);
        let modulator = self.circuit.modulator_mut().expect("only a modulator repeats");
        let (between, last) = (modulator.pause(), modulator.skip_repeats(edges));
        self.modulation.come(modulator, self.edge);
        self.switch(&between);
        self.range();
        self.switch(&last);
        // The range contains these words: a period has begun with them.
        self.changed = 0;
        self.plan();
    }

    fn uses(&self) -> Vec<SignalUse> {
        let mut now = self.clone();
        now.count_lost();
        now.meter.uses()[..C::COUNT].to_vec()
    }

    fn recurs(&self, earlier: &Self) -> bool {
        if (self.settled, self.words, self.lost) != (earlier.settled, earlier.words, earlier.lost) {
            return false;
        }
        let (now, then) = (self.rebased(), earlier.rebased());
        now.circuit == then.circuit && now.modulation == then.modulation
    }

    #[cfg(not(target_family = "wasm"))]
    fn recurs_in(&self, live: u64, earlier: &Self) -> bool {
        if self.settled != earlier.settled || members(live).any(|net| self.words[net] != earlier.words[net]) {
            return false;
        }
        let [now, then] = [self, earlier].map(|state| {
            let mut state = state.rebased();
            state.circuit.forget(live);
            state
        });
        now.circuit == then.circuit && now.modulation == then.modulation
    }

    fn repeat(&mut self, states: [&Self; 2], times: u64) {
        let [then, now] = states.map(|state| {
            let mut state = state.clone();
            state.count_lost();
            state.meter
        });
        self.count_lost();
        self.meter.repeat([&then, &now], times);
    }
}
