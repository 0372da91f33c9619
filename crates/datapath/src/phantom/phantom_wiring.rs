//! The common wiring of the two PHANToM loops. They share the nets up to the sines and have the same words after them.
//! With `SHARED`, an engine computes these words one product after another; otherwise they settle as combinational
//! logic.

use hpu_signal::{Meter, Narrowed, Ports, Signal, SignalUse};

use super::encoders::Pins;
use super::force_path::{self, Out};
use super::phantom_nets::{
    Blocks, COMMANDS, COUNTS, LINES, MOST, PERIOD, POSITIONS, PhantomIn, PhantomOut, SCALED, SINES, X, X_LOW,
};
use super::variants::loops;
use super::words::exact;
use super::{PhantomConfig, TrigIn, TrigOut, command_register, phantom_engine, sample_register};
use crate::listed::{Given, Listed};
use crate::{Block, ConfigError, Generic, Instance, Parts, Wiring, flatten, synchronizer};

/// A PHANToM loop: [`PhantomLoop`](super::PhantomLoop) or [`PhantomSharedLoop`](super::PhantomSharedLoop).
///
/// [`uses`](Wiring::uses) counts the edges during which a position, force, torque or command (in the parallel loop: the
/// scaled torque before its register) had lost bits; a limited force or command counts as overflowed. Before the first
/// edge, every least word is above the greatest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PhantomWiring<const SHARED: bool> {
    config: PhantomConfig,
    blocks: Blocks,
    /// The inputs with which the nets have settled; `None` since reset.
    settled: Option<PhantomIn<i64>>,
    /// The latest inputs of the combinational path; `None` since reset, and always with an engine.
    seen: Option<force_path::In<i64>>,
    /// The words on the nets after the sines, and the number of edges with these words that the meter has not counted
    /// yet.
    made: Out<Narrowed>,
    standing: u64,
    words: [i64; MOST],
    meter: Meter<MOST>,
}

/// The inputs of the clocked blocks after the encoders, by instance label.
struct Seen {
    pins: Pins,
    sample: sample_register::In<i64>,
    trig: [TrigIn<i64>; 3],
    hold: command_register::In<i64>,
    engine: phantom_engine::In<i64>,
}

impl<const SHARED: bool> PhantomWiring<SHARED> {
    const NETS: usize = if SHARED { SCALED } else { MOST };

    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words.
    pub fn new(config: PhantomConfig) -> Result<Self, ConfigError> {
        let mut wiring = Self {
            config,
            blocks: Blocks::new(&config)?,
            settled: None,
            seen: None,
            made: Out::build(|| exact(0)),
            standing: 0,
            words: [0; MOST],
            meter: Meter::default(),
        };
        wiring.reset();
        Ok(wiring)
    }

    /// Returns the inputs of the clocked blocks at the next edge, from the current nets.
    #[inline]
    fn seen(&self, input: &PhantomIn<i64>) -> Seen {
        let (now, period) = (&self.words, input.period);
        let PhantomIn { a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3, .. } = *input;
        let pins = |a_pin, b_pin| synchronizer::In { a_pin, b_pin };
        Seen {
            pins: [pins(a_pin1, b_pin1), pins(a_pin2, b_pin2), pins(a_pin3, b_pin3)],
            sample: sample_register::In {
                position1: now[POSITIONS],
                position2: now[POSITIONS + 1],
                position3: now[POSITIONS + 2],
                period,
            },
            trig: [0, 1, 2].map(|joint| TrigIn { count: now[COUNTS + joint] }),
            hold: command_register::In { d1: now[SCALED], d2: now[SCALED + 1], d3: now[SCALED + 2], period },
            engine: phantom_engine::In::of(&self.path_inputs(), period),
        }
    }

    /// Returns the inputs of the path from sines to commands, from the nets.
    #[inline]
    fn path_inputs(&self) -> force_path::In<i64> {
        let (sines, scene) = (&self.words[SINES..X], &self.words[X_LOW..PERIOD]);
        // On the nets, sine, cosine and validity come joint by joint; on the path's ports, all validities come last.
        let order = [0, 1, 3, 4, 6, 7, 2, 5, 8].map(|net| sines[net]);
        let mut words = order.iter().chain(scene);
        force_path::In::build(|| *words.next().expect("as many nets as ports"))
    }

    /// Lets the nets after the sines settle with these inputs and the current registers.
    #[inline]
    fn let_settle(&mut self, input: &PhantomIn<i64>) {
        self.settled = Some(*input);
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        let made = if SHARED {
            *self.blocks.engine.latest()
        } else {
            let seen = Some(self.path_inputs());
            if seen == self.seen {
                return;
            }
            self.seen = seen;
            self.blocks.path.eval(&self.path_inputs())
        };
        if made != self.made {
            self.count_lost();
            self.made = made;
        }
        let mut net = self.words[X..].iter_mut();
        made.each(|narrowed| *net.next().expect("as many nets as outputs") = narrowed.word);
    }

    /// Brings the meter of lost bits up to date.
    fn count_lost(&mut self) {
        let mut index = X;
        self.made.each(|&Narrowed { rounded, overflowed, .. }| {
            let net = if SHARED && index >= SCALED { index - SCALED + COMMANDS } else { index };
            self.meter.lost(net, rounded, overflowed, self.standing);
            index += 1;
        });
        self.standing = 0;
    }
}

impl<const SHARED: bool> PhantomWiring<SHARED> {
    /// Returns a wiring whose delay is that of the shared or of the parallel path.
    fn of(config: PhantomConfig) -> Result<Self, ConfigError> {
        Self::new(if SHARED { config.shared() } else { config })
    }
}

impl<const SHARED: bool> Default for PhantomWiring<SHARED> {
    fn default() -> Self {
        Self::of(PhantomConfig::default()).expect("the data sheet's default")
    }
}

impl<const SHARED: bool> Block for PhantomWiring<SHARED> {
    const NAME: &'static str = if SHARED { "phantom_shared_loop" } else { "phantom_loop" };
    const CLOCKED: bool = true;
    type In<T> = PhantomIn<T>;
    type Out<T> = PhantomOut<T>;

    fn inputs(&self) -> PhantomIn<Signal> {
        self.blocks.inputs()
    }

    fn outputs(&self) -> PhantomOut<Signal> {
        self.blocks.outputs()
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> PhantomOut<i64> {
        self.blocks.reset();
        self.words = [0; MOST];
        self.seen = None;
        self.let_settle(&PhantomIn::build(|| 0));
        self.settled = None;
        self.meter = Meter::default();
        self.standing = 0;
        PhantomOut::build(|| 0)
    }

    #[inline]
    fn tick(&mut self, input: PhantomIn<i64>) -> PhantomOut<i64> {
        let fresh = self.settled != Some(input);
        if fresh {
            // As in VHDL, the registers see the combinational nets that result from the new inputs.
            self.let_settle(&input);
        }
        let seen = self.seen(&input);
        let blocks = &mut self.blocks;
        blocks.encoders.tick(&seen.pins);
        let sample_register::Out { count1, count2, count3 } = blocks.sample.tick(seen.sample);
        let mut moved = false;
        let commands = if SHARED {
            let phantom_engine::Out { command1, command2, command3, .. } = blocks.engine.tick(seen.engine);
            moved = *blocks.engine.latest() != self.made;
            [command1, command2, command3]
        } else {
            let command_register::Out { q1, q2, q3 } = blocks.hold.tick(seen.hold);
            [q1, q2, q3]
        };

        let mut registers = [0; X - COMMANDS];
        registers[..LINES - COMMANDS].copy_from_slice(&commands);
        registers[LINES - COMMANDS..POSITIONS - COMMANDS].copy_from_slice(&blocks.encoders.lines());
        registers[POSITIONS - COMMANDS..COUNTS - COMMANDS].copy_from_slice(&blocks.encoders.positions());
        registers[COUNTS - COMMANDS..SINES - COMMANDS].copy_from_slice(&[count1, count2, count3]);
        for (joint, table) in blocks.trig.iter_mut().enumerate() {
            let TrigOut { sine, cosine, valid } = table.tick(seen.trig[joint]);
            let at = SINES - COMMANDS + 3 * joint;
            registers[at..at + 3].copy_from_slice(&[sine, cosine, valid]);
        }
        moved |= registers != self.words[COMMANDS..X];
        if fresh || moved {
            self.words[COMMANDS..X].copy_from_slice(&registers);
            self.let_settle(&input);
            self.meter.range(&self.words);
        }
        self.standing += 1;
        let [command1, command2, command3] = commands;
        PhantomOut { command1, command2, command3 }
    }

    #[inline]
    fn quiet(&self, input: &PhantomIn<i64>) -> u64 {
        if self.settled != Some(*input) {
            return 0;
        }
        let (blocks, seen) = (&self.blocks, self.seen(input));
        let last = if SHARED { blocks.engine.quiet(&seen.engine) } else { blocks.hold.quiet(&seen.hold) };
        let tables = blocks.trig.iter().zip(&seen.trig);
        tables
            .fold(last, |least, (table, input)| least.min(table.quiet(input)))
            .min(blocks.encoders.quiet(&seen.pins))
            .min(blocks.sample.quiet(&seen.sample))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &PhantomIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let seen = self.seen(input);
        let blocks = &mut self.blocks;
        blocks.encoders.skip(edges, &seen.pins);
        blocks.sample.skip(edges, &seen.sample);
        blocks.trig.iter_mut().zip(&seen.trig).for_each(|(table, input)| table.skip(edges, input));
        if SHARED {
            blocks.engine.skip(edges, &seen.engine);
        } else {
            blocks.hold.skip(edges, &seen.hold);
        }
        self.standing = self.standing.saturating_add(edges);
    }
}

impl<const SHARED: bool> Wiring for PhantomWiring<SHARED> {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        all.extend(self.blocks.nets(SHARED));
        all
    }

    fn instances(&self) -> Vec<Instance> {
        self.blocks.instances(SHARED)
    }

    fn settle(&mut self, input: &PhantomIn<i64>) {
        self.let_settle(input);
        // The first edge treats its inputs as new ones.
        self.settled = None;
    }

    fn words(&self) -> &[i64] {
        &self.words[..Self::NETS]
    }

    fn uses(&self) -> Vec<SignalUse> {
        let mut now = self.clone();
        now.count_lost();
        now.meter.uses()[..Self::NETS].to_vec()
    }
}

impl<const SHARED: bool> Listed for PhantomWiring<SHARED> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(PhantomConfig::of_encoders(given)?.given(given)?)
    }

    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        loops().into_iter().map(|(label, config)| Ok((label, Self::of(config)?))).collect()
    }
}
