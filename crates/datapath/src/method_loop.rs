//! The method loops: a law between encoder and bridge.
//!
//! - **Equation**: `command = clamp(shaped torque)`; the torque is the law's.
//! - **Ports**: those of `hybrid_loop`.
//! - **Nets**: inputs, outputs, then `position`, `error`, `delta`, `contact`, `penetration`, `torque`, `memory`,
//!   `shaped`, `command`.
//! - **Latency**: pin to wall 4 edges; then the law's, the shaper's and the modulator's.
//! - **Reset**: every register as its block says. **Overflow**: the command is limited to full scale.
//! - **VHDL twin**: `hdl/generated/<law>_loop.vhd`, made of this wiring and the law's VHDL; instances `front`, `law`, `shaper`, `limiter`, `modulator`.
//! - **Source**: that of the law.
//! - **Differs from the hardware**: as in the law and the blocks around it; combinational paths settle within the clock
//!   they change in, whatever their length.

use hpu_signal::{Meter, Ports, Signal, SignalUse};

use crate::loop_nets::instance;
use crate::wiring::renamed;
use crate::{
    AxisFront, Block, ConfigError, Generic, InputShaper, InputShaperConfig, Instance, Law, LawIn, LawOut, Loaded,
    LoopIn, LoopOut, Parts, Pwm, PwmConfig, Repeat, Saturator, Shaping, Wiring, axis_front, flatten, input_shaper, pwm,
    saturator,
};

/// The parts of a method loop beside its law.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MethodLoopConfig {
    /// The modulator.
    pub pwm: PwmConfig,
    /// The input shaper's phase and filter; `None` passes the torque on.
    pub shaping: Option<Shaping>,
}

/// The law's generics that have another name in the loop.
const LAW: [(&str, &str); 2] = [("WIDTH", "POSITION_WIDTH"), TORQUE_WIDTH];
/// Those of the shaper.
const SHAPER: [(&str, &str); 8] = [
    ("PHASE", "SHAPER_PHASE"),
    ("B0", "SHAPER_B0"),
    ("B1", "SHAPER_B1"),
    ("B2", "SHAPER_B2"),
    ("A1", "SHAPER_A1"),
    ("A2", "SHAPER_A2"),
    ("ENABLED", "SHAPER_ENABLED"),
    TORQUE_WIDTH,
];
const TORQUE_WIDTH: (&str, &str) = ("TORQUE_WIDTH", "PWM_WIDTH");

const REFERENCE: usize = 2;
const GATES: usize = 7;
const POSITION: usize = 11;
const TORQUE: usize = POSITION + 5;
const MEMORY: usize = TORQUE + 1;
const SHAPED: usize = MEMORY + 1;
const COMMAND: usize = SHAPED + 1;
const NETS: usize = COMMAND + 1;

/// A haptic loop, position counter to H-bridge, around any law. See the [module](self).
///
/// [`uses`](Wiring::uses) counts the edges during which torque, memory, shaped torque or command had lost bits; a
/// limited command counts as overflowed. Before the first edge, every least word is above the greatest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MethodLoop<L> {
    config: MethodLoopConfig,
    front: AxisFront,
    law: L,
    shaper: InputShaper,
    limiter: Saturator,
    modulator: Pwm,
    /// The inputs with which the nets have settled; `None` since reset.
    settled: Option<LoopIn<i64>>,
    words: [i64; NETS],
    meter: Meter<NETS>,
    /// The losses of the nets from the torque on, and the number of edges with these losses that the meter has not
    /// counted yet.
    lost: [(bool, bool); NETS - TORQUE],
    standing: u64,
}

impl<L: Law> MethodLoop<L> {
    /// Returns a loop around that law, in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words, and unless the modulator is as wide as the law's torque.
    pub fn new(law: L, config: MethodLoopConfig) -> Result<Self, ConfigError> {
        let widths = law.widths();
        let MethodLoopConfig { pwm, shaping } = config;
        let torque_width = widths.torque_width;
        if pwm.width != torque_width {
            let accepted = format!("the {torque_width} bits of the law's torque");
            return Err(ConfigError::new(L::LOOP, format!("PWM_WIDTH is {}", pwm.width), accepted));
        }
        let shaper = InputShaperConfig { torque_width, period_width: widths.period_width, shaping };
        let mut wiring = Self {
            config,
            front: AxisFront::new(widths.width)?,
            shaper: InputShaper::new(shaper)?,
            limiter: Saturator::new(torque_width + 2, torque_width + 1, (1 << torque_width) - 1)?,
            modulator: Pwm::new(pwm)?,
            law,
            settled: None,
            words: [0; NETS],
            meter: Meter::default(),
            lost: [(false, false); NETS - TORQUE],
            standing: 0,
        };
        wiring.reset();
        Ok(wiring)
    }

    /// Returns the law in the middle.
    pub fn law(&self) -> &L {
        &self.law
    }

    /// Returns whether an input shaper changes the law's torque.
    #[must_use]
    pub fn is_shaped(&self) -> bool {
        self.config.shaping.is_some()
    }

    /// Returns the inputs of the front.
    #[inline]
    fn at_front(input: &LoopIn<i64>) -> axis_front::In<i64> {
        axis_front::In { a_pin: input.a_pin, b_pin: input.b_pin, reference: input.reference }
    }

    /// Returns the inputs of the law, from the current nets.
    #[inline]
    fn at_law(&self, input: &LoopIn<i64>) -> LawIn<i64> {
        let LoopIn { stiffness, damping, period, scale, .. } = *input;
        let [position, _, delta, contact, penetration] = [0, 1, 2, 3, 4].map(|net: usize| self.words[POSITION + net]);
        LawIn { position, delta, contact, penetration, stiffness, damping, period, scale }
    }

    /// Returns the inputs of the shaper.
    #[inline]
    fn at_shaper(&self, input: &LoopIn<i64>) -> input_shaper::In<i64> {
        input_shaper::In { torque: self.words[TORQUE], period: input.period }
    }

    /// Returns the inputs of the modulator.
    #[inline]
    fn at_modulator(&self) -> pwm::In<i64> {
        pwm::In { command: self.words[COMMAND] }
    }

    /// Returns for how many edges all blocks but the modulator are quiet.
    #[inline]
    fn still(&self, input: &LoopIn<i64>) -> u64 {
        let (front, law, shaper) = (Self::at_front(input), self.at_law(input), self.at_shaper(input));
        self.front.quiet(&front).min(self.law.quiet(&law)).min(self.shaper.quiet(&shaper))
    }

    /// Skips that many edges of all blocks but the modulator.
    #[inline]
    fn skip_still(&mut self, edges: u64, input: &LoopIn<i64>) {
        let (law, shaper) = (self.at_law(input), self.at_shaper(input));
        self.front.skip(edges, &Self::at_front(input));
        self.law.skip(edges, &law);
        self.shaper.skip(edges, &shaper);
    }

    /// Lets the combinational nets settle with these inputs and the current registers.
    fn let_settle(&mut self, input: &LoopIn<i64>, shown: LawOut<i64>) {
        self.settled = Some(*input);
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        let axis_front::Out { position, error, delta, contact, penetration } = self.front.settle(input.reference);
        self.words[POSITION..TORQUE].copy_from_slice(&[position, error, delta, contact, penetration]);
        let LawOut { torque, memory } = self.law.settle(&self.at_law(input), shown);
        let input_shaper::Out { shaped } = self.shaper.settle(torque);
        let saturator::Out { limited: command } = self.limiter.eval(saturator::In { value: shaped });
        self.words[TORQUE..].copy_from_slice(&[torque, memory, shaped, command]);

        let ([torque, memory], shaped) = (self.law.lost(), self.shaper.latest());
        let lost = [torque, memory, (shaped.rounded, shaped.overflowed), (false, command != shaped.word)];
        if lost != self.lost {
            self.count_lost();
            self.lost = lost;
        }
    }

    /// Brings the meter of lost bits up to date.
    fn count_lost(&mut self) {
        for (index, (rounded, overflowed)) in (TORQUE..).zip(self.lost) {
            self.meter.lost(index, rounded, overflowed, self.standing);
        }
        self.standing = 0;
    }
}

impl<L: Law + Default> Default for MethodLoop<L> {
    fn default() -> Self {
        Self::new(L::default(), MethodLoopConfig::default()).expect("the data sheet's default")
    }
}

impl<L: Law> Block for MethodLoop<L> {
    const NAME: &'static str = L::LOOP;
    const CLOCKED: bool = true;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        let axis_front::In { a_pin, b_pin, reference } = self.front.inputs();
        let LawIn { stiffness, damping, period, scale, .. } = self.law.inputs();
        LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let MethodLoopConfig { pwm, shaping } = self.config;
        let widths = self.law.widths().generics().into_iter();
        let mut all: Vec<_> = widths.map(|(name, value)| (renamed(name, &LAW), value)).collect();
        all.extend([
            ("ANTIPHASE", Generic::Boolean(pwm.antiphase)),
            ("LATCHED", Generic::Boolean(pwm.latched)),
            ("FLOATING", Generic::Boolean(pwm.floating)),
            ("DEAD_TIME", Generic::Integer(pwm.dead_time.into())),
            ("SHAPER_ENABLED", Generic::Boolean(shaping.is_some())),
        ]);
        all.extend(Shaping::generics(shaping, std::array::from_fn(|at| SHAPER[at].1)));
        all.extend(self.law.own_generics());
        all
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> LoopOut<i64> {
        self.front.reset();
        let shown = self.law.reset();
        self.shaper.reset();
        self.modulator.reset();
        self.words = [0; NETS];
        self.let_settle(&LoopIn::build(|| 0), shown);
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
            self.settle(&input);
        }
        let before = self.words;
        let (law, shaper, modulator) = (self.at_law(&input), self.at_shaper(&input), self.at_modulator());
        self.front.tick(Self::at_front(&input));
        let shown = self.law.tick(law);
        self.shaper.tick(shaper);
        let gates = self.modulator.tick(modulator);

        let pwm::Out { a_high, a_low, b_high, b_low } = gates;
        self.words[GATES..POSITION].copy_from_slice(&[a_high, a_low, b_high, b_low]);
        self.let_settle(&input, shown);
        if fresh || self.words != before {
            self.meter.range(&self.words);
        }
        self.standing += 1;
        LoopOut { a_high, a_low, b_high, b_low }
    }

    #[inline]
    fn quiet(&self, input: &LoopIn<i64>) -> u64 {
        if self.settled != Some(*input) {
            return 0;
        }
        self.modulator.quiet(&self.at_modulator()).min(self.still(input))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LoopIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.skip_still(edges, input);
        let modulator = self.at_modulator();
        self.modulator.skip(edges, &modulator);
        self.standing = self.standing.saturating_add(edges);
    }
}

impl<L: Law> Loaded for MethodLoop<L> {
    #[inline]
    fn load(&mut self, position: i64, input: &LoopIn<i64>) {
        self.front.load(position);
        let shown = LawOut { torque: self.words[TORQUE], memory: self.words[MEMORY] };
        self.let_settle(input, shown);
    }
}

impl<L: Law> Wiring for MethodLoop<L> {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        all.extend(flatten(&self.front.outputs()));
        all.extend(flatten(&self.law.outputs()));
        all.push(self.shaper.outputs().shaped);
        all.push(Signal { name: "command", ..self.limiter.outputs().limited });
        all
    }

    fn instances(&self) -> Vec<Instance> {
        let front: Vec<_> = (0..=REFERENCE).chain(POSITION..TORQUE).collect();
        let (stiffness, period) = (REFERENCE + 1, REFERENCE + 3);
        let wall = [POSITION].into_iter().chain(POSITION + 2..TORQUE);
        let law: Vec<_> = wall.chain(stiffness..GATES).chain([TORQUE, MEMORY]).collect();
        let modulator: Vec<_> = [COMMAND].into_iter().chain(GATES..POSITION).collect();
        vec![
            instance("front", &self.front, &front).mapped(&[]),
            instance("law", &self.law, &law).mapped(&LAW),
            instance("shaper", &self.shaper, &[TORQUE, period, SHAPED]).mapped(&SHAPER),
            instance("limiter", &self.limiter, &[SHAPED, COMMAND]).mapped(&[
                ("IN_WIDTH", "PWM_WIDTH + 2"),
                ("OUT_WIDTH", "PWM_WIDTH + 1"),
                ("LIMIT", "2**PWM_WIDTH - 1"),
            ]),
            instance("modulator", &self.modulator, &modulator).mapped(&[("WIDTH", "PWM_WIDTH")]),
        ]
    }

    fn settle(&mut self, input: &LoopIn<i64>) {
        let shown = LawOut { torque: self.words[TORQUE], memory: self.words[MEMORY] };
        self.let_settle(input, shown);
        // The first edge treats its inputs as new ones.
        self.settled = None;
    }

    fn words(&self) -> &[i64] {
        &self.words
    }

    fn rest_modulator(&mut self) {
        self.modulator.rest();
    }

    #[inline]
    fn repeats(&self, input: &LoopIn<i64>) -> Option<Repeat<LoopOut<i64>>> {
        let Repeat { period, first, others, .. } = self.modulator.repeats(&self.at_modulator())?;
        let pwm::Out { a_high, a_low, b_high, b_low } = others;
        let edges = if self.settled == Some(*input) { self.still(input) } else { 0 };
        Some(Repeat { period, first, others: LoopOut { a_high, a_low, b_high, b_low }, edges })
    }

    #[inline]
    fn skip_repeats(&mut self, edges: u64, input: &LoopIn<i64>) {
        self.skip_still(edges, input);
        let gates = |pwm::Out { a_high, a_low, b_high, b_low }| [a_high, a_low, b_high, b_low];
        self.meter.range_from(GATES, &gates(self.modulator.pause()));
        self.words[GATES..POSITION].copy_from_slice(&gates(self.modulator.skip_repeats(edges)));
        self.standing = self.standing.saturating_add(edges);
    }

    fn uses(&self) -> Vec<SignalUse> {
        let mut now = self.clone();
        now.count_lost();
        now.meter.uses().to_vec()
    }
}
