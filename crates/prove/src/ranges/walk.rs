//! Walks over a wiring's blocks and reads each with what is known of its inputs.

use hpu_datapath::{AnyBlock, ClockEdge, Connection, Instance, Register};
use hpu_signal::{Equations, Format, Signal, Word as _};

use super::affine::Affine;
use super::word::Word;
use hpu_signal::Span;

/// The words of a wiring's nets, as far as they are known.
pub struct Walk<'t> {
    /// The word of each net, if it is known.
    pub nets: Vec<Option<Affine>>,
    /// Returns the counts that a counter may pass in a number of clock cycles; `None` where it may miss some.
    pub moved: &'t dyn Fn(f64) -> Option<Span>,
}

/// More rounds than any block has registers in a row. After these, the registers have come to rest or never will.
const ROUNDS: usize = 100;

impl Walk<'_> {
    /// Reads a block, and the blocks inside it. A net that is already known keeps its word.
    pub fn read(&mut self, instance: &Instance) {
        self.read_stated(instance, &[]);
    }

    /// Reads a block as [`read`](Self::read) does, and states the contents of some of its registers.
    pub fn read_stated(&mut self, instance: &Instance, stated: &[(&str, Affine)]) {
        let Instance { model, connections, .. } = instance;
        for inner in model.inside() {
            let net = |port: &Connection| Connection { port: port.port.clone(), net: connections[port.net].net };
            let connections = inner.connections.iter().map(net).collect();
            self.read(&Instance { connections, ..inner });
        }
        if !is_on_the_way(&**model) {
            return;
        }
        let Some(equations) = model.equations() else { return };
        let shown = self.shown(&equations, &self.inputs(instance), stated);
        self.drive(instance, &shown);
    }

    /// Reads a block whose outputs are registers, as an edge loads them.
    pub fn load(&mut self, instance: &Instance) {
        let Some(equations) = instance.model.equations() else { return };
        let reset = equations.registers.iter().map(|register| Affine::int(register.reset.unwrap_or(0).into()));
        let given: Vec<_> = reset.chain(self.inputs(instance)).collect();
        let loaded = equations.recorded().read(&given);
        self.drive(instance, &loaded);
    }

    /// Reads a block whose registers of these names stay within these ranges; their errors are unknown. One step proves
    /// this, from any words in all other registers and for each of `cases`, which are all words of the register
    /// `other`. Where a step leaves a range, the block's outputs stay unknown.
    pub fn keep(&mut self, instance: &Instance, kept: &[(&str, Span)], (other, cases): (&Register, &[Span])) {
        let Some(equations) = instance.model.equations() else { return };
        let (registers, inputs) = (&equations.registers, self.inputs(instance));
        let recorded = equations.recorded();
        let range = |register: &Register| {
            let own = |name: &str| register.instance.is_none() && register.name == name;
            kept.iter().find(|(name, _)| own(name)).map(|(_, range)| *range)
        };
        let mut shown: Option<Vec<Affine>> = None;
        for case in cases {
            let word = |register: &Register| match range(register) {
                _ if register == other => Affine::given(*case),
                Some(range) => Affine::put(|symbols| symbols.replaced(range, None, true)),
                None => Affine::put(|symbols| symbols.given(Span::of(register.format))),
            };
            let held: Vec<_> = registers.iter().map(word).collect();
            let mut next = recorded.read(&[&held[..], &inputs].concat());
            let outputs = next.split_off(registers.len());
            let stays = |(register, word): (&Register, &Affine)| {
                let reset = Span::exact(register.reset.unwrap_or(0).into());
                range(register).is_none_or(|range| word.known().span.hull(reset).is_within(range))
            };
            if !registers.iter().zip(&next).all(stays) {
                return;
            }
            shown = Some(match shown {
                None => outputs,
                Some(before) => before.into_iter().zip(outputs).map(|(one, other)| one.or(other)).collect(),
            });
        }
        self.drive(instance, &shown.unwrap_or_default());
    }

    /// Returns a block's inputs; any word where a net is not known.
    fn inputs(&self, instance: &Instance) -> Vec<Affine> {
        let Instance { model, tied, .. } = instance;
        let input = |Signal { name, format, .. }: Signal| {
            let constant = tied.iter().find(|(port, _)| *port == name).map(|(_, word)| Affine::int((*word).into()));
            let known = net(instance, name).and_then(|net| self.nets[net]);
            known.or(constant).unwrap_or_else(|| Affine::put(|symbols| symbols.any(format)))
        };
        model.inputs().into_iter().map(input).collect()
    }

    fn drive(&mut self, instance: &Instance, shown: &[Affine]) {
        for (port, word) in instance.model.outputs().iter().zip(shown) {
            if let Some(net) = net(instance, port.name).filter(|&net| self.nets[net].is_none()) {
                self.nets[net] = Some(*word);
            }
        }
    }

    /// Returns the outputs of a block that is a part of a law, with inputs by name; any word where it has no equations.
    pub fn stated(
        &self,
        block: &dyn AnyBlock,
        input: &dyn Fn(&str) -> Option<Affine>,
        stated: &[(&str, Affine)],
    ) -> Vec<Affine> {
        let any = |format: Format| Affine::put(|symbols| symbols.wrapped(format));
        let Some(equations) = block.equations() else {
            return block.outputs().iter().map(|port| any(port.format)).collect();
        };
        let inputs: Vec<_> =
            block.inputs().iter().map(|port| input(port.name).unwrap_or_else(|| any(port.format))).collect();
        self.shown(&equations, &inputs, stated)
    }

    /// Returns the outputs of a block with these inputs at every edge. Losses that occurred before the inputs are
    /// reported only there. `stated` claims the contents of some registers at all times; one step proves that they stay
    /// so.
    fn shown(&self, equations: &ClockEdge, inputs: &[Affine], stated: &[(&str, Affine)]) -> Vec<Affine> {
        let (registers, equations) = (&equations.registers, equations.recorded());
        let entered: Vec<_> = if registers.is_empty() {
            inputs.iter().map(|input| input.shed()).collect()
        } else {
            inputs.iter().map(|input| input.another().shed()).collect()
        };
        let held = self.held(&equations, registers, &entered, stated);
        let mut words = equations.read(&[&held[..], &entered].concat());
        let kept = |word: Affine| {
            // A word that is only handed on fits only if it fitted as an input.
            let is_it = |entered: &Affine| word.known().form == entered.known().form && !word.is_constant();
            let came = entered.iter().position(is_it).map(|index| inputs[index].known().fits);
            word.with(|known, _| Word { fits: known.fits && came.unwrap_or(true), ..known })
        };
        words.split_off(registers.len()).into_iter().map(kept).collect()
    }

    /// Returns the words that registers hold: those after a reset, and those that any sample edge makes of such words.
    fn held(
        &self,
        equations: &Equations,
        registers: &[Register],
        entered: &[Affine],
        stated: &[(&str, Affine)],
    ) -> Vec<Affine> {
        let reset = |register: &Register| Affine::int(register.reset.unwrap_or(0).into());
        let mut held: Vec<_> = registers.iter().map(reset).collect();
        let next = |held: &[Affine]| {
            let mut words = equations.read(&[held, entered].concat());
            words.truncate(held.len());
            words
        };
        // Between sample edges only the countdown changes; it is 0 at a sample edge.
        let countdown = registers.iter().position(|register| register.name == Register::COUNTDOWN);
        let first = next(&held);
        let clocks = countdown.map_or(1.0, |countdown| first[countdown].known().span.max as f64 + 1.0);
        let aged = aged(entered, &held, &first);
        let before = held.clone();
        for (word, age) in held.iter_mut().zip(&aged) {
            if let Some((count, samples)) = *age {
                *word = self.earlier(count, f64::from(samples) * clocks).unwrap_or(*word);
            }
        }
        for (word, register) in held.iter_mut().zip(registers) {
            let said = stated.iter().find(|(name, _)| *name == register.name);
            // A step may show that a stated range is not kept; then the word is joined with what the step gives.
            *word = said.map_or(*word, |(_, said)| word.or(*said));
        }
        for _ in 0..ROUNDS {
            let loaded = next(&held);
            let mut rests = true;
            for (index, word) in loaded.into_iter().enumerate() {
                if aged[index].is_some() || Some(index) == countdown {
                    continue;
                }
                let joined = held[index].or(word);
                rests &= joined == held[index];
                held[index] = joined;
            }
            if rests {
                // Seen alone, a loaded count may be any count that the counter shows.
                for ((word, age), reset) in held.iter_mut().zip(&aged).zip(&before) {
                    *word = age.map_or(*word, |(count, _)| reset.or(count));
                }
                return held;
            }
        }
        registers.iter().map(|register| Affine::put(|symbols| symbols.wrapped(register.format))).collect()
    }

    /// Returns the count that a counter showed `clocks` clock cycles ago: the count now less the counts passed since.
    fn earlier(&self, count: Affine, clocks: f64) -> Option<Affine> {
        let moved = (self.moved)(clocks)?;
        Some(count.with(|Word { turns, .. }, symbols| {
            let moved = symbols.fresh(moved, 0);
            let (width, now) = turns.expect("a counter");
            let any = symbols.any(Format::unsigned(width));
            Word { turns: Some((width, now.minus(&moved))), fits: true, ..any }
        }))
    }
}

/// Returns the net of a port.
fn net(instance: &Instance, name: &str) -> Option<usize> {
    instance.connections.iter().find(|connection| connection.port.name == name).map(|connection| connection.net)
}

/// Finds the registers that hold an earlier count, and how many samples ago it was shown. One register loads the count,
/// the next one loads that register's count.
fn aged(entered: &[Affine], held: &[Affine], first: &[Affine]) -> Vec<Option<(Affine, u32)>> {
    let counts = |word: &Affine| entered.contains(word) && word.known().turns.is_some();
    let mut aged: Vec<_> = first.iter().map(|word| counts(word).then_some((*word, 1))).collect();
    for _ in 0..held.len() {
        for index in 0..held.len() {
            let from = held.iter().position(|word| *word == first[index]).filter(|&from| from != index);
            if let (None, Some((count, samples))) = (aged[index], from.and_then(|from| aged[from])) {
                aged[index] = Some((count, samples + 1));
            }
        }
    }
    aged
}

/// Returns whether a block lies between the counters and the modulator. Counters and modulators are told by their
/// ports: all inputs or all outputs are single lines, or the block counts.
pub fn is_on_the_way(block: &dyn AnyBlock) -> bool {
    let is_line = |port: &Signal| port.format == Format::BIT;
    let lines = block.inputs().iter().all(is_line) || block.outputs().iter().all(is_line);
    !lines && block.counts().is_none()
}
