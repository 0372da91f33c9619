//! The common wiring of the two haptic loops. They differ by one register: with `HELD`, the wall reads the position
//! through a zero-order hold.

use hpu_signal::{Format, Meter, Ports, Signal, SignalUse};

use crate::listed::{Given, Listed};
use crate::loop_config::Blocks;
use crate::loop_nets::{Nets, instances, nets};
use crate::{
    Block, ConfigError, Generic, Instance, Loaded, LoopConfig, LoopIn, LoopOut, Parts, PwmConfig, Repeat, Wiring,
    command_limiter, displacement, flatten, position_counter, pwm, quadrature_decoder, synchronizer, velocity_register,
    zero_order_hold,
};

/// A haptic loop, position counter to H-bridge: [`HybridLoop`](crate::HybridLoop) or
/// [`ConventionalLoop`](crate::ConventionalLoop).
///
/// [`uses`](Wiring::uses) counts the edges during which spring, velocity, drag or command had lost bits; the torque's
/// format holds every sum. A limited command counts as overflowed from the edge at which it is limited, even if it is
/// shown later. Before the first edge, every least word is above the greatest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct HapticLoop<const HELD: bool> {
    config: LoopConfig,
    blocks: Blocks,
    /// The inputs with which the nets have settled; `None` since reset.
    settled: Option<LoopIn<i64>>,
    words: [i64; Nets::MOST],
    meter: Meter<{ Nets::MOST }>,
    /// The losses of the nets in [`Nets::lossy`], and the number of edges with these losses that the meter has not
    /// counted yet.
    lost: [Lost; 4],
    standing: u64,
}

/// The number of gates of the bridge, which come first among the registers.
const GATES: usize = 4;

/// Whether a net's value was rounded, and whether it overflowed.
type Lost = (bool, bool);

/// The inputs of the clocked blocks, by instance label.
struct Seen {
    sync: synchronizer::In<i64>,
    decoder: quadrature_decoder::In<i64>,
    counter: position_counter::In<i64>,
    hold: zero_order_hold::In<i64>,
    velocity_reg: velocity_register::In<i64>,
    limiter: command_limiter::In<i64>,
    modulator: pwm::In<i64>,
}

impl<const HELD: bool> HapticLoop<HELD> {
    const NETS: Nets = Nets::new(HELD);

    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its widths, and unless stiffness and damping are unsigned with 0 or more
    /// fraction bits.
    pub fn new(config: LoopConfig) -> Result<Self, ConfigError> {
        let mut wiring = Self {
            config,
            blocks: config.blocks(Self::NAME)?,
            settled: None,
            words: [0; Nets::MOST],
            meter: Meter::default(),
            lost: [(false, false); 4],
            standing: 0,
        };
        wiring.reset();
        Ok(wiring)
    }

    /// Returns the inputs of the clocked blocks at the next edge, from the current nets.
    #[inline]
    fn seen(&self, input: &LoopIn<i64>) -> Seen {
        let (net, now) = (Self::NETS, &self.words);
        let (position, period) = (now[net.position], input.period);
        Seen {
            sync: synchronizer::In { a_pin: input.a_pin, b_pin: input.b_pin },
            decoder: quadrature_decoder::In { a: now[net.a], b: now[net.b] },
            counter: position_counter::In { step: now[net.step] },
            hold: zero_order_hold::In { d: position, period },
            velocity_reg: velocity_register::In { position, period, scale: input.scale },
            limiter: command_limiter::In { value: now[net.torque] },
            modulator: pwm::In { command: now[net.command] },
        }
    }

    /// Returns for how many edges all blocks but the modulator are quiet.
    #[inline]
    fn still(&self, seen: &Seen) -> u64 {
        let blocks = &self.blocks;
        let hold = if HELD { blocks.hold.quiet(&seen.hold) } else { u64::MAX };
        hold.min(blocks.sync.quiet(&seen.sync))
            .min(blocks.decoder.quiet(&seen.decoder))
            .min(blocks.counter.quiet(&seen.counter))
            .min(blocks.velocity_reg.quiet(&seen.velocity_reg))
            .min(blocks.limiter.quiet(&seen.limiter))
    }

    /// Skips that many edges of all blocks but the modulator.
    #[inline]
    fn skip_still(&mut self, edges: u64, seen: &Seen) {
        let blocks = &mut self.blocks;
        blocks.sync.skip(edges, &seen.sync);
        blocks.decoder.skip(edges, &seen.decoder);
        blocks.counter.skip(edges, &seen.counter);
        if HELD {
            blocks.hold.skip(edges, &seen.hold);
        }
        blocks.velocity_reg.skip(edges, &seen.velocity_reg);
        blocks.limiter.skip(edges, &seen.limiter);
    }

    /// Lets the combinational nets settle with these inputs and the current registers.
    fn let_settle(&mut self, input: &LoopIn<i64>) {
        let net = Self::NETS;
        let (blocks, words) = (&mut self.blocks, &mut self.words);
        self.settled = Some(*input);
        let mut port = words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);

        let torque = blocks.path.eval(words[net.held], words[net.velocity], input);
        words[net.delta] = torque.delta;
        words[net.contact] = torque.contact;
        words[net.penetration] = torque.penetration;
        words[net.spring] = torque.spring.word;
        words[net.drag] = torque.drag.word;
        words[net.torque] = torque.torque;
        let limited = blocks.limiter.limit(torque.torque);
        words[net.command] = blocks.limiter.settle(limited);
        let velocity = blocks.velocity_reg.latest();
        let lost = [
            (torque.spring.rounded, torque.spring.overflowed),
            (velocity.rounded, velocity.overflowed),
            (torque.drag.rounded, torque.drag.overflowed),
            (false, limited != torque.torque),
        ];
        if lost != self.lost {
            self.count_lost();
            self.lost = lost;
        }
    }

    /// Does the same, but quickly if the inputs differ from the last ones only in the pins, which reach no
    /// combinational net.
    #[inline]
    fn take_in(&mut self, input: &LoopIn<i64>) {
        let LoopIn { a_pin, b_pin, .. } = *input;
        if self.settled.is_some_and(|settled| LoopIn { a_pin, b_pin, ..settled } == *input) {
            self.settled = Some(*input);
            self.words[..2].copy_from_slice(&[a_pin, b_pin]);
        } else {
            self.let_settle(input);
        }
    }

    /// Brings the meter of lost bits up to date.
    fn count_lost(&mut self) {
        for (index, (rounded, overflowed)) in Self::NETS.lossy().into_iter().zip(self.lost) {
            self.meter.lost(index, rounded, overflowed, self.standing);
        }
        self.standing = 0;
    }
}

impl<const HELD: bool> Default for HapticLoop<HELD> {
    fn default() -> Self {
        Self::new(LoopConfig::default()).expect("the data sheet's default")
    }
}

impl<const HELD: bool> Block for HapticLoop<HELD> {
    const NAME: &'static str = if HELD { "conventional_loop" } else { "hybrid_loop" };
    const CLOCKED: bool = true;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        let synchronizer::In { a_pin, b_pin } = self.blocks.sync.inputs();
        let displacement::In { reference, .. } = self.blocks.path.offset.inputs();
        let velocity_register::In { period, scale, .. } = self.blocks.velocity_reg.inputs();
        let stiffness = Signal::new("stiffness", self.config.stiffness, "PWM count/count", "Stiffness of the wall");
        let damping =
            Signal::new("damping", self.config.damping, "PWM count/(count/sample)", "Damping inside the wall");
        LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let pwm::Out { a_high, a_low, b_high, b_low } = self.blocks.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> LoopOut<i64> {
        self.blocks.reset();
        self.words = [0; Nets::MOST];
        self.let_settle(&LoopIn::build(|| 0));
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
            self.take_in(&input);
        }
        let (net, seen) = (Self::NETS, self.seen(&input));
        let blocks = &mut self.blocks;
        let before = blocks.velocity_reg.latest();
        let synchronizer::Out { a, b } = blocks.sync.tick(seen.sync);
        let quadrature_decoder::Out { step, error } = blocks.decoder.tick(seen.decoder);
        let position_counter::Out { position } = blocks.counter.tick(seen.counter);
        let held = if HELD { blocks.hold.tick(seen.hold).q } else { position };
        blocks.velocity_reg.tick(seen.velocity_reg);
        let velocity = blocks.velocity_reg.latest();
        let late = blocks.limiter.settles() && blocks.limiter.tick(seen.limiter).limited != seen.modulator.command;
        let gates = blocks.modulator.tick(seen.modulator);

        let pwm::Out { a_high, a_low, b_high, b_low } = gates;
        let registers = [a_high, a_low, b_high, b_low, a, b, step, error, position];
        let moved = late || held != self.words[net.held] || velocity != before;
        let changed = |from: usize, to: usize| {
            (from..to).fold(0, |bits, k| bits | (registers[k] ^ self.words[net.gates + k])) != 0
        };
        if fresh || moved {
            self.words[net.gates..=net.position].copy_from_slice(&registers);
            if moved {
                self.words[net.held] = held;
                self.words[net.velocity] = velocity.word;
                self.let_settle(&input);
            }
            self.meter.range(&self.words);
        } else if changed(GATES, registers.len()) {
            self.words[net.gates..=net.position].copy_from_slice(&registers);
            self.meter.range_from(net.gates, &registers);
        } else if changed(0, GATES) {
            self.words[net.gates..net.gates + GATES].copy_from_slice(&registers[..GATES]);
            self.meter.range_from(net.gates, &registers[..GATES]);
        }
        self.standing += 1;
        LoopOut { a_high, a_low, b_high, b_low }
    }

    #[inline]
    fn quiet(&self, input: &LoopIn<i64>) -> u64 {
        if self.settled != Some(*input) {
            return 0;
        }
        let seen = self.seen(input);
        self.still(&seen).min(self.blocks.modulator.quiet(&seen.modulator))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LoopIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let seen = self.seen(input);
        self.skip_still(edges, &seen);
        self.blocks.modulator.skip(edges, &seen.modulator);
        self.standing = self.standing.saturating_add(edges);
    }
}

impl<const HELD: bool> Loaded for HapticLoop<HELD> {
    #[inline]
    fn load(&mut self, position: i64, input: &LoopIn<i64>) {
        let position = self.blocks.counter.load(position);
        if std::mem::replace(&mut self.words[Self::NETS.position], position) != position {
            self.let_settle(input);
        } else {
            self.take_in(input);
        }
    }
}

impl<const HELD: bool> Wiring for HapticLoop<HELD> {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        all.extend(nets(&self.blocks, HELD));
        all
    }

    fn instances(&self) -> Vec<Instance> {
        instances(&self.blocks, &Self::NETS, HELD)
    }

    fn settle(&mut self, input: &LoopIn<i64>) {
        self.let_settle(input);
    }

    fn words(&self) -> &[i64] {
        &self.words[..=Self::NETS.command]
    }

    fn rest_modulator(&mut self) {
        self.blocks.modulator.rest();
    }

    #[inline]
    fn repeats(&self, input: &LoopIn<i64>) -> Option<Repeat<LoopOut<i64>>> {
        let seen = self.seen(input);
        let Repeat { period, first, others, .. } = self.blocks.modulator.repeats(&seen.modulator)?;
        let pwm::Out { a_high, a_low, b_high, b_low } = others;
        let edges = if self.settled == Some(*input) { self.still(&seen) } else { 0 };
        Some(Repeat { period, first, others: LoopOut { a_high, a_low, b_high, b_low }, edges })
    }

    #[inline]
    fn skip_repeats(&mut self, edges: u64, input: &LoopIn<i64>) {
        let seen = self.seen(input);
        self.skip_still(edges, &seen);
        let gates = |pwm::Out { a_high, a_low, b_high, b_low }| [a_high, a_low, b_high, b_low];
        let first = Self::NETS.gates;
        self.meter.range_from(first, &gates(self.blocks.modulator.pause()));
        self.words[first..first + GATES].copy_from_slice(&gates(self.blocks.modulator.skip_repeats(edges)));
        self.standing = self.standing.saturating_add(edges);
    }

    fn uses(&self) -> Vec<SignalUse> {
        let mut now = self.clone();
        now.count_lost();
        now.meter.uses()[..=Self::NETS.command].to_vec()
    }
}

impl<const HELD: bool> Listed for HapticLoop<HELD> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(LoopConfig {
            position_width: given.natural("POSITION_WIDTH")?,
            stiffness: given.unsigned("STIFFNESS")?,
            damping: given.unsigned("DAMPING")?,
            period_width: given.natural("PERIOD_WIDTH")?,
            velocity_width: given.natural("VELOCITY_WIDTH")?,
            rescaled: given.is("RESCALED"),
            scale: given.unsigned("SCALE")?,
            saturate: given.is("SATURATE"),
            pwm: PwmConfig::given(given, "PWM_WIDTH")?,
            settling: given.natural("SETTLING")?,
        })
    }

    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |int, frac| Format::new(false, int, frac).expect("8 bits");
        let small = LoopConfig {
            position_width: 8,
            stiffness: format(6, 2),
            damping: format(4, 4),
            period_width: 6,
            velocity_width: 6,
            pwm: PwmConfig { width: 6, ..PwmConfig::default() },
            ..LoopConfig::default()
        };
        let all = [
            ("wrap", LoopConfig { saturate: false, ..LoopConfig::default() }),
            ("8_bit", small),
            ("rescaled", LoopConfig { rescaled: true, scale: format(4, 4), ..small }),
            ("antiphase", LoopConfig { pwm: PwmConfig { antiphase: true, dead_time: 2, ..small.pwm }, ..small }),
            ("immediate", LoopConfig { pwm: PwmConfig { latched: false, floating: true, ..small.pwm }, ..small }),
            ("settling", LoopConfig { settling: 3, pwm: PwmConfig { latched: false, ..small.pwm }, ..small }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
