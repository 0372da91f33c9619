//! A loop whose law is computed in floats: the reference for the datapaths in words.
//!
//! It reads the encoder's lines as every loop does, but counts at once, and converts the law's force to a command of 40
//! bits, which is finer than any other word of a loop. What remains of the hardware is the encoder's count, the
//! sampling, and the gains, which are those that words realise. The loop drives an averaged bridge or an amplifier; it
//! has no PWM, and no VHDL.

use hpu_datapath::{AxisWiring, Block, Generic, Instance, LoopIn, LoopOut, Wiring, flatten};
use hpu_signal::{Format, Meter, Ports, Signal, SignalUse};

use hpu_scene::COMMAND_BITS;
use hpu_scene::method::{AnyLaw, SampledLaw};

/// The configuration of a [`LawLoop`].
#[derive(Clone, PartialEq, Debug)]
pub struct LawConfig {
    /// The law, with its device at the start.
    pub law: AnyLaw,
    /// Stiffness and scale of the law at the start. A ramp changes them in proportion to their words.
    pub start_gains: [f64; 2],
    /// Whether the law's spring follows every count instead of the sample before.
    pub live: bool,
    /// The wall's surface, in counts from the start.
    pub surface: i64,
    /// Position of one count, in m.
    pub count_m: f64,
    /// Force of a command of `2^40`.
    pub full_scale_n: f64,
    /// The actuator's greatest force.
    pub limit_n: f64,
    /// Formats of stiffness, damping and scale; a ramp's progress is reckoned in them.
    pub formats: [Format; 3],
    /// The words of stiffness and scale at the start.
    pub start: [i64; 2],
    /// Width of the sample period.
    pub period_width: u32,
}

impl LawConfig {
    /// Returns the command for a force.
    pub(crate) fn command(&self, force_n: f64) -> i64 {
        let full = Format::unsigned(COMMAND_BITS).max() as f64 + 1.0;
        (force_n.clamp(-self.limit_n, self.limit_n) / self.full_scale_n * full).round() as i64
    }

    /// Returns whether an input shaper is behind the law.
    pub fn is_shaped(&self) -> bool {
        matches!(self.law, AnyLaw::Shaped(_))
    }

    /// Sets the stiffness and the scale of a copy of the law to these shares of those at the start.
    #[inline]
    pub fn vary(&self, law: &mut AnyLaw, [stiffness, scale]: [f64; 2]) {
        law.vary(self.start_gains[0] * stiffness, self.start_gains[1] * scale);
    }
}

/// A loop whose law is computed in floats, on counts: the reference for the datapaths in words. It has no PWM, and no
/// VHDL.
#[derive(Clone, PartialEq, Debug)]
pub struct LawLoop {
    config: LawConfig,
    law: AnyLaw,
    /// Edges before the next sample.
    left: u64,
    phase: Option<i64>,
    force_n: f64,
    /// The present words of stiffness and scale.
    wanted: [i64; 2],
    words: [i64; NETS],
    meter: Meter<NETS>,
}

pub(crate) const POSITION: usize = 11;
pub(crate) const PENETRATION: usize = 12;
pub(crate) const COMMAND: usize = 13;
pub(crate) const NETS: usize = 14;

impl LawLoop {
    /// Creates a loop after reset.
    pub fn new(config: LawConfig) -> Self {
        let law = config.law.clone();
        Self {
            config,
            law,
            left: 0,
            phase: None,
            force_n: 0.0,
            wanted: [0; 2],
            words: [0; NETS],
            meter: Meter::default(),
        }
    }

    /// Returns the configuration.
    pub fn config(&self) -> &LawConfig {
        &self.config
    }

    /// Counts the changes of the lines' phase, from the first phase seen on.
    fn count(&mut self, input: &LoopIn<i64>) -> bool {
        let phase = if input.b_pin == 1 { 1 + input.a_pin } else { 3 * input.a_pin };
        let before = self.phase.replace(phase).unwrap_or(phase);
        let step = match (phase - before).rem_euclid(4) {
            1 => 1,
            3 => -1,
            _ => 0,
        };
        self.words[POSITION] += step;
        step != 0
    }

    fn position_m(&self) -> f64 {
        (self.words[POSITION] - self.config.surface) as f64 * self.config.count_m
    }

    fn period(input: &LoopIn<i64>) -> u64 {
        input.period.max(1).unsigned_abs()
    }
}

impl Block for LawLoop {
    const NAME: &'static str = "law_loop";
    const CLOCKED: bool = true;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        let [stiffness, damping, scale] = self.config.formats;
        let period = Format::unsigned(self.config.period_width);
        LoopIn {
            a_pin: Signal::bit("a_pin", "Encoder line A"),
            b_pin: Signal::bit("b_pin", "Encoder line B"),
            reference: Signal::new("reference", Format::signed(32), "count", "The target; a wall's surface is fixed"),
            stiffness: Signal::new("stiffness", stiffness, "PWM count/count", "Stiffness, as a share of the law's own"),
            damping: Signal::new("damping", damping, "PWM count/(count/sample)", "Ignored: the law has its own"),
            period: Signal::new("period", period, "clock", "Sample period; 0 acts as 1"),
            scale: Signal::new("scale", scale, "1", "Scale of the force, as a share of the law's own"),
        }
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let gate = |name| Signal::bit(name, "Never on");
        LoopOut { a_high: gate("a_high"), a_low: gate("a_low"), b_high: gate("b_high"), b_low: gate("b_low") }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        Vec::new()
    }

    fn reset(&mut self) -> LoopOut<i64> {
        *self = Self::new(self.config.clone());
        LoopOut::build(|| 0)
    }

    fn tick(&mut self, input: LoopIn<i64>) -> LoopOut<i64> {
        let moved = self.count(&input);
        let sampled = self.left == 0;
        self.left = if sampled { Self::period(&input) } else { self.left } - 1;
        let wanted = [input.stiffness, input.scale];
        let varied = std::mem::replace(&mut self.wanted, wanted) != wanted;
        // A live spring takes a new stiffness at once, a sampled law at its samples.
        if sampled || self.config.live && varied {
            let shares = [0, 1].map(|index| {
                let start = self.config.start[index];
                if start == 0 { 1.0 } else { wanted[index] as f64 / start as f64 }
            });
            self.config.vary(&mut self.law, shares);
        }
        if sampled {
            self.law.aim((input.reference - self.config.surface) as f64 * self.config.count_m);
            self.force_n = self.law.sample(self.position_m());
        }
        if self.config.live && (moved || sampled || varied) {
            self.force_n = self.law.live_n(self.position_m()).unwrap_or(self.force_n);
        }
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        self.words[PENETRATION] = (self.words[POSITION] - self.config.surface).max(0);
        self.words[COMMAND] = self.config.command(self.force_n);
        if moved || sampled {
            self.meter.range(&self.words);
        }
        LoopOut::build(|| 0)
    }

    fn quiet(&self, input: &LoopIn<i64>) -> u64 {
        let unseen = self.words[..2] != [input.a_pin, input.b_pin];
        if unseen { 0 } else { self.left }
    }

    fn skip(&mut self, edges: u64, input: &LoopIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.left -= edges;
    }
}

impl AxisWiring for LawLoop {
    const COMMAND: usize = COMMAND;
}

impl Wiring for LawLoop {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        all.push(Signal::new("position", Format::signed(32), "count", "Counts from the start"));
        all.push(Signal::new("penetration", Format::unsigned(32), "count", "Depth inside the wall"));
        let command = Format::signed(COMMAND_BITS + 1);
        all.push(Signal::new("command", command, "full scale/2^40", "Force against the penetration"));
        all
    }

    fn instances(&self) -> Vec<Instance> {
        Vec::new()
    }

    fn settle(&mut self, input: &LoopIn<i64>) {
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
    }

    fn words(&self) -> &[i64] {
        &self.words
    }

    fn uses(&self) -> Vec<SignalUse> {
        self.meter.uses().to_vec()
    }
}
