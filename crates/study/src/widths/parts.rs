//! Reads the equations of a wiring's blocks, in the order in which the blocks settle.

use std::fmt;

use hpu_cosim::LawConfig;
use hpu_datapath::{AnyBlock, Connection, Instance, Register};
use hpu_signal::{Equations, Format, Reading, Signal, Word};

use super::method::Method;
use hpu_prove::exact::Exact;
use hpu_prove::ranges::walk::is_on_the_way;
use hpu_prove::real::Real;

/// Where a block's input comes from.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Source {
    /// A net.
    Net(usize),
    /// A constant.
    Tied(i64),
}

/// A net, or a constant, with its format.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Port {
    source: Source,
    format: Format,
}

impl Port {
    /// Returns its value in the law, in units of its least significant bit.
    fn law(self, nets: &[f64]) -> Real {
        match self.source {
            Source::Net(net) => Real(nets[net] / self.format.lsb()),
            Source::Tied(word) => Real(word as f64),
        }
    }

    fn word(self, words: &[i64]) -> i128 {
        match self.source {
            Source::Net(net) => self.format.value(words[net]),
            Source::Tied(word) => word.into(),
        }
    }
}

/// The equations of one block, with the contents of its registers in the law and in words.
#[derive(Clone, Debug)]
struct Stage {
    equations: Equations,
    registers: Vec<Register>,
    /// Index of the register that counts down to the next sample edge.
    countdown: Option<usize>,
    law: Vec<Real>,
    words: Vec<i128>,
    inputs: Vec<Port>,
    /// Nets of the outputs, and their formats.
    outputs: Vec<(usize, Format)>,
    /// The inputs that the law and the words read last. Equal inputs need no new computation.
    read: (Vec<Real>, Vec<i128>),
    /// Whether the latest load changed no register but the countdown.
    rests: bool,
    /// Whether a load changed the words since their losses were told.
    stepped: bool,
    reads_law: Reader<Real>,
    reads_words: Reader<Exact>,
}

/// The memory of the readings of one kind.
#[derive(Clone)]
struct Reader<W: Word> {
    given: Vec<W>,
    reading: Reading<W>,
}

impl<W: Word> fmt::Debug for Reader<W> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Reader").finish_non_exhaustive()
    }
}

impl<W: Word> Default for Reader<W> {
    fn default() -> Self {
        Self { given: Vec::new(), reading: Reading::default() }
    }
}

impl<W: Word> Reader<W> {
    /// Returns the registers after an edge at which the countdown is 0, and the outputs before that edge.
    fn step(
        &mut self,
        equations: &Equations,
        countdown: Option<usize>,
        registers: impl ExactSizeIterator<Item = W>,
        inputs: impl Iterator<Item = W>,
    ) -> (&[W], &[W]) {
        let count = registers.len();
        self.given.clear();
        self.given.extend(registers);
        if let Some(countdown) = countdown {
            self.given[countdown] = W::int(0);
        }
        self.given.extend(inputs);
        equations.read_in(&mut self.reading, &self.given).split_at(count)
    }
}

impl Stage {
    /// Reads a block; `None` if it has no equations.
    fn of(model: &dyn AnyBlock, connections: &[Connection], tied: &[(&'static str, i64)]) -> Option<Self> {
        let equations = model.equations()?;
        let registers = &equations.registers;
        let reset = || registers.iter().map(|register| register.reset.unwrap_or(0));
        let net = |name: &str| connections.iter().find(|connection| connection.port.name == name).map(|c| c.net);
        let input = |Signal { name, format, .. }: Signal| {
            let constant = || Source::Tied(tied.iter().find(|(port, _)| *port == name).map_or(0, |(_, word)| *word));
            Port { source: net(name).map_or_else(constant, Source::Net), format }
        };
        Some(Self {
            equations: equations.recorded(),
            law: reset().map(|word| Real(word as f64)).collect(),
            words: reset().map(i128::from).collect(),
            inputs: model.inputs().into_iter().map(input).collect(),
            outputs: model.outputs().iter().filter_map(|port| Some((net(port.name)?, port.format))).collect(),
            countdown: registers.iter().position(|register| register.name == Register::COUNTDOWN),
            registers: registers.clone(),
            read: (Vec::new(), Vec::new()),
            rests: false,
            stepped: true,
            reads_law: Reader::default(),
            reads_words: Reader::default(),
        })
    }

    /// Reads the law's inputs. Returns whether one differs from the last time.
    fn take_law(&mut self, nets: &[f64]) -> bool {
        let is_same = self.read.0.iter().copied().eq(self.inputs.iter().map(|port| port.law(nets)));
        if !is_same {
            self.read.0.clear();
            self.read.0.extend(self.inputs.iter().map(|port| port.law(nets)));
        }
        !is_same
    }

    /// Reads the inputs in words. Returns whether one differs from the last time.
    fn take_words(&mut self, words: &[i64]) -> bool {
        let is_same = self.read.1.iter().copied().eq(self.inputs.iter().map(|port| port.word(words)));
        if !is_same {
            self.read.1.clear();
            self.read.1.extend(self.inputs.iter().map(|port| port.word(words)));
        }
        !is_same
    }

    /// Returns the law's registers after an edge at which the countdown is 0, and its outputs before that edge, from
    /// the inputs that were read.
    fn read_law(&mut self) -> (&[Real], &[Real]) {
        let (registers, inputs) = (self.law.iter().copied(), self.read.0.iter().copied());
        self.reads_law.step(&self.equations, self.countdown, registers, inputs)
    }

    /// Returns the same in words.
    fn read_words(&mut self) -> (&[Exact], &[Exact]) {
        let exact = |&word: &i128| Exact::of(word);
        let (registers, inputs) = (self.words.iter().map(exact), self.read.1.iter().map(exact));
        self.reads_words.step(&self.equations, self.countdown, registers, inputs)
    }

    /// Reports the losses of the words that are about to be loaded.
    fn tell(outputs: &[(usize, Format)], next: &[Exact], lost: &mut [[f64; 2]]) {
        let worst = next.iter().map(|word| word.lost()).fold([0.0; 2], |[a, b], [c, d]| [f64::max(a, c), b.max(d)]);
        outputs.iter().for_each(|&(net, _)| lost[net] = worst);
    }

    /// Finds outputs that only hand on an input, held or at once. Returns each with the net of that input. Compares two
    /// samples of numbers, none of which can be computed from others.
    fn handed_on(&self) -> Vec<(usize, usize)> {
        let input = |index: usize| Real(1e3 + libm::sqrt(2.0 + index as f64));
        let inputs = || (0..self.inputs.len()).map(input);
        let mut reader = Reader::default();
        let mut step = |registers: Vec<Real>| {
            let (next, shown) = reader.step(&self.equations, self.countdown, registers.into_iter(), inputs());
            (next.to_vec(), shown.to_vec())
        };
        let (first, _) = step(self.law.clone());
        let (second, _) = step(first);
        let (_, shown) = step(second);
        let from = |&value: &Real| (0..self.inputs.len()).find(|&index| input(index) == value);
        let pairs = self.outputs.iter().zip(&shown).filter_map(|(&(net, _), value)| {
            let Source::Net(source) = self.inputs[from(value)?].source else { return None };
            Some((net, source))
        });
        pairs.collect()
    }
}

/// The edges at which registers load.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Clock {
    /// The next edge at which they load.
    pub next: u64,
    /// Clock cycles between two loads.
    every: u64,
    /// Whether the latest load changed nothing. Then the next loads will change nothing either while the inputs stay.
    pub idle: bool,
}

impl Clock {
    /// Makes registers that have rested load again, from an edge on.
    pub fn wake(&mut self, edge: u64) {
        if self.idle {
            self.next += edge.saturating_sub(self.next).div_ceil(self.every) * self.every;
            self.idle = false;
        }
    }
}

/// A block with its equations, or with the equations of the blocks inside it.
#[derive(Clone, Debug)]
pub(super) struct Part {
    stages: Vec<Stage>,
    /// `None` for a combinational block.
    pub clock: Option<Clock>,
    /// The input that tells when a block shows the result of the blocks [inside](AnyBlock::inside) it.
    period: Option<Port>,
}

impl Part {
    /// Makes a part of a block with equations; it is clocked if it has registers.
    fn of(stage: Stage) -> Self {
        let first = stage.countdown.map_or(0, |countdown| stage.words[countdown] as u64);
        let is_clocked = !stage.registers.is_empty();
        let clock = is_clocked.then_some(Clock { next: 1 + first, every: 1, idle: false });
        Self { stages: vec![stage], clock, period: None }
    }

    /// Returns the nets that its outputs drive.
    pub fn outputs(&self) -> impl Iterator<Item = usize> {
        self.stages.iter().flat_map(|stage| &stage.outputs).map(|output| output.0)
    }

    /// Returns the nets that it reads.
    pub fn reads(&self) -> impl Iterator<Item = usize> {
        let inputs = self.stages.iter().flat_map(|stage| &stage.inputs).chain(&self.period);
        inputs.filter_map(|port| if let Source::Net(net) = port.source { Some(net) } else { None })
    }

    /// Returns pairs of nets: an output, and the input that it hands on.
    pub fn handed_on(&self) -> Vec<(usize, usize)> {
        self.stages.iter().flat_map(Stage::handed_on).collect()
    }

    /// Returns whether its outputs come from a computation of several clock cycles.
    pub fn computes(&self) -> bool {
        self.period.is_some()
    }

    /// Returns whether its losses are reported at once: it has no registers, or they load at every edge.
    pub(crate) fn tells_at_once(&self) -> bool {
        self.clock.is_none() || self.stages.iter().all(|stage| stage.countdown.is_none()) && !self.computes()
    }

    /// Lets the outputs of combinational blocks settle.
    pub fn settle(&mut self, nets: &mut [f64]) {
        for stage in &mut self.stages {
            if !stage.take_law(nets) {
                continue;
            }
            let (registers, inputs) = (stage.law.iter().copied(), stage.read.0.iter().copied());
            let (_, shown) = stage.reads_law.step(&stage.equations, stage.countdown, registers, inputs);
            stage.outputs.iter().zip(shown).for_each(|(&(net, format), Real(value))| nets[net] = value * format.lsb());
        }
    }

    /// Loads the registers of the law and of the words at the edge that is due. Adds changed outputs to `loaded` and
    /// losses to `lost`. Returns whether anything has changed.
    pub fn load(&mut self, law: &[f64], words: &[i64], loaded: &mut Vec<(usize, f64)>, lost: &mut [[f64; 2]]) -> bool {
        let Some(mut clock) = self.clock else { return false };
        let shown_before = loaded.len();
        if let Some(period) = self.period {
            // The inputs stand still while the blocks inside compute.
            let mut nets = law.to_vec();
            self.settle(&mut nets);
            loaded.extend(self.outputs().map(|net| (net, nets[net])));
            clock.every = period.law(law).0.max(1.0) as u64;
            clock.idle = true;
        } else {
            let stage = &mut self.stages[0];
            let (other, others) = (stage.take_law(law), stage.take_words(words));
            if other || others || !stage.rests {
                let countdown = stage.countdown;
                let next = stage.read_law().0.to_vec();
                let still = |(index, (old, new)): (usize, (&Real, &Real))| Some(index) == countdown || old == new;
                stage.rests = stage.law.iter().zip(&next).enumerate().all(still);
                clock.every = 1 + countdown.map_or(0, |countdown| next[countdown].0.max(0.0) as u64);
                stage.law = next;
                let next = stage.read_words().0.to_vec();
                stage.words.clear();
                stage.words.extend(next.iter().map(|word| word.word()));
                stage.stepped = true;
                let (registers, inputs) = (stage.law.iter().copied(), stage.read.0.iter().copied());
                let (_, shown) = stage.reads_law.step(&stage.equations, countdown, registers, inputs);
                for (&(net, format), value) in stage.outputs.iter().zip(shown) {
                    loaded.push((net, value.0 * format.lsb()));
                }
                if countdown.is_some() {
                    Stage::tell(&stage.outputs, &next, lost);
                }
            }
            clock.idle = stage.rests;
        }
        clock.idle &= loaded[shown_before..].iter().all(|&(net, value)| law[net] == value);
        clock.next += clock.every;
        self.clock = Some(clock);
        !clock.idle
    }

    /// Reports the losses of the words on the nets.
    pub fn tell(&mut self, words: &[i64], lost: &mut [[f64; 2]]) {
        let is_clocked = self.clock.is_some() && !self.computes();
        for stage in &mut self.stages {
            let is_other = stage.take_words(words);
            stage.rests &= !is_other;
            if !is_other && !std::mem::take(&mut stage.stepped) {
                continue;
            }
            let exact = |&word: &i128| Exact::of(word);
            let (registers, inputs) = (stage.words.iter().map(exact), stage.read.1.iter().map(exact));
            let (next, shown) = stage.reads_words.step(&stage.equations, stage.countdown, registers, inputs);
            if is_clocked {
                Stage::tell(&stage.outputs, next, lost);
            } else {
                stage.outputs.iter().zip(shown).for_each(|(&(net, _), word)| lost[net] = word.lost());
            }
        }
    }
}

/// The blocks of a wiring.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    pub parts: Vec<Part>,
    /// Nets that count and wrap.
    pub counters: Vec<usize>,
    pub method: Option<Method>,
}

impl Parts {
    /// Reads the blocks between the counters and the modulator. `law` is a method's law with the clock cycles that it
    /// takes; it replaces the blocks with its labels, whose equations are not read.
    pub fn new(instances: &[Instance], law: Option<(LawConfig, u64)>) -> Self {
        let mut all = Self {
            method: law.and_then(|(config, latency)| Method::of(instances, config, latency)),
            ..Self::default()
        };
        instances.iter().filter(|instance| !Method::LABELS.contains(&instance.label)).for_each(|one| all.add(one));
        all
    }

    fn add(&mut self, Instance { model, connections, tied, .. }: &Instance) {
        let counter = connections.iter().find(|connection| Some(connection.port.name) == model.counts());
        self.counters.extend(counter.map(|counter| counter.net));
        let inside: Vec<_> = model.inside().iter().filter_map(|part| within(part, connections)).collect();
        if let Some(first) = model.first_shown() {
            let period = model.inputs().into_iter().find(|port| port.name == "period").and_then(
                |Signal { name, format, .. }| {
                    let net = connections.iter().find(|connection| connection.port.name == name)?.net;
                    Some(Port { source: Source::Net(net), format })
                },
            );
            self.parts.push(Part { stages: inside, clock: Some(Clock { next: first, every: 1, idle: false }), period });
        } else {
            self.parts.extend(inside.into_iter().map(Part::of));
        }
        if is_on_the_way(&**model) {
            self.parts.extend(Stage::of(&**model, connections, tied).map(Part::of));
        }
    }
}

/// Reads a block inside another block whose ports are connected to these nets.
fn within(part: &Instance, outer: &[Connection]) -> Option<Stage> {
    let connection = |inner: &Connection| Connection { port: inner.port.clone(), net: outer[inner.net].net };
    Stage::of(&*part.model, &part.connections.iter().map(connection).collect::<Vec<_>>(), &part.tied)
}
