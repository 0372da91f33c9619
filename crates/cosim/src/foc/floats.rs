//! The loop behind field-oriented control in `f64`: the equations of the words without their rounding. It closes the
//! loop in the place of the words, which it is the reference for. It has no VHDL.
//!
//! It reads the encoder's lines and the sensors' words as the words do, and counts at once. Law and controllers sample
//! at the same clock edges. Its modulator is the words' own, and takes duties of whole steps.

use std::f64::consts::TAU;

use hpu_datapath::foc::{FocKnobLoop, FocOut, KnobIn, ThreePhasePwm, three_phase_pwm};
use hpu_datapath::{Block, Generic, Instance, Wiring, flatten};
use hpu_signal::{Format, Meter, Ports, Signal, SignalUse};

use hpu_scene::FocFloats;

/// The logic in floats in a loop.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct FloatLogic {
    floats: FocFloats,
    /// The loop in words whose place it takes; its ports and nets are described there.
    ports: KnobIn<Signal>,
    outs: FocOut<Signal>,
    inside: Vec<Signal>,
    modulator: ThreePhasePwm,
    /// Edges before the next sample of the law.
    left: u64,
    phase: Option<i64>,
    /// Whether the controllers sample at the next edge.
    samples: bool,
    state: State,
    words: [i64; NETS],
    meter: Meter<NETS>,
}

/// The state of the logic.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct State {
    /// Distance to the wall at the latest sample of the law.
    delta: i64,
    /// Wanted current, sums of the controllers, and their voltages, along the flux and across it.
    target: f64,
    sums: [f64; 2],
    volts: [f64; 2],
}

const INPUTS: usize = 14;
const POSITION: usize = INPUTS + 7;
/// The nets inside, those of the words of the same names.
const INSIDE: [&str; 11] =
    ["counted", "position", "torque", "target", "d", "q", "v_d", "v_q", "duty_a", "duty_b", "duty_c"];
const NETS: usize = POSITION + INSIDE.len();
const COUNTED: usize = POSITION;
const AT: usize = POSITION + 1;
const TORQUE: usize = POSITION + 2;
const CURRENT: usize = POSITION + 4;
const VOLTS: usize = POSITION + 6;
const DUTY: usize = POSITION + 8;

impl FloatLogic {
    /// Creates the logic after reset.
    pub(crate) fn new(floats: FocFloats, wiring: &FocKnobLoop, modulator: ThreePhasePwm) -> Self {
        let nets = Wiring::nets(wiring);
        let mut logic = Self {
            ports: Block::inputs(wiring),
            outs: Block::outputs(wiring),
            inside: INSIDE.map(|name| nets.iter().find(|net| net.name == name).expect("a net").clone()).into(),
            floats,
            modulator,
            left: 0,
            phase: None,
            samples: false,
            state: State::default(),
            words: [0; NETS],
            meter: Meter::default(),
        };
        logic.voltage();
        logic
    }

    /// Returns a position as a distance with a sign.
    fn distance(&self, from: i64) -> i64 {
        Format::signed(self.ports.reference.format.width()).wrap((self.words[AT] - from).into())
    }

    /// Takes the position. Returns whether it is another one.
    fn locate(&mut self, input: &KnobIn<i64>) -> bool {
        let phase = if input.b_pin == 1 { 1 + input.a_pin } else { 3 * input.a_pin };
        let before = self.phase.replace(phase).unwrap_or(phase);
        let step = [0, 1, 0, -1][(phase - before).rem_euclid(4) as usize];
        let width = self.ports.reference.format;
        self.words[COUNTED] = width.wrap((self.words[COUNTED] + step).into());
        let position = if input.coded == 1 { input.code } else { self.words[COUNTED] };
        std::mem::replace(&mut self.words[AT], position) != position
    }

    /// Computes a sample of the law: table and wall, in units of the wanted current.
    fn law(&mut self, input: &KnobIn<i64>) {
        let delta = self.distance(input.reference);
        let moved = Format::signed(self.ports.reference.format.width()).wrap((delta - self.state.delta).into());
        self.state.delta = delta;
        let FocFloats { stiffness, damping, top, .. } = self.floats;
        let mut torque = self.floats.texture(self.words[AT]);
        if delta > 0 {
            torque += ((stiffness * delta as f64).min(top) + damping * moved as f64).clamp(-top - 1.0, top);
        }
        let torque = torque.clamp(-top - 1.0, top);
        self.state.target = -torque;
        self.words[TORQUE] = torque.floor() as i64;
        self.words[TORQUE + 1] = -self.words[TORQUE];
    }

    /// Returns sine and cosine of the field's angle.
    fn field(&self) -> (f64, f64) {
        libm::sincos(TAU * self.distance(self.floats.zero) as f64 * self.floats.turns_per_count)
    }

    /// Computes a sample of both controllers.
    fn control(&mut self, input: &KnobIn<i64>) {
        let FocFloats { unit, proportional, integral, limit, .. } = self.floats;
        let (sine, cosine) = self.field();
        let [a, b] = [input.i_a, input.i_b].map(|code| unit * code as f64);
        let (alpha, beta) = (a, (a + 2.0 * b) / 3f64.sqrt());
        let currents = [cosine * alpha + sine * beta, cosine * beta - sine * alpha];
        let State { target, sums, volts, .. } = &mut self.state;
        for (axis, wanted) in [0.0, *target].into_iter().enumerate() {
            let error = wanted - currents[axis];
            sums[axis] = (sums[axis] + integral * error).clamp(-limit, limit);
            volts[axis] = (proportional * error + sums[axis]).clamp(-limit, limit);
            self.words[CURRENT + axis] = currents[axis].round() as i64;
            self.words[VOLTS + axis] = volts[axis].round() as i64;
        }
    }

    /// Computes the duties of the voltages where the rotor is.
    fn voltage(&mut self) {
        let (sine, cosine) = self.field();
        let [direct, across] = self.state.volts;
        let (alpha, beta) = (cosine * direct - sine * across, sine * direct + cosine * across);
        let beside = 0.5 * 3f64.sqrt() * beta;
        let phases = [alpha, beside - 0.5 * alpha, -beside - 0.5 * alpha];
        let (most, least) = (phases.into_iter().fold(f64::MIN, f64::max), phases.into_iter().fold(f64::MAX, f64::min));
        let steps = self.floats.steps;
        for (word, phase) in self.words[DUTY..].iter_mut().zip(phases) {
            let duty = steps * (0.5 + (phase - 0.5 * (most + least)) / self.floats.supply);
            *word = (duty + 0.5).floor().clamp(0.0, steps) as i64;
        }
    }

    fn at_modulator(&self, enable: i64) -> three_phase_pwm::In<i64> {
        let [duty_a, duty_b, duty_c] = [DUTY, DUTY + 1, DUTY + 2].map(|net| self.words[net]);
        three_phase_pwm::In { duty_a, duty_b, duty_c, enable }
    }

    fn shown(&self) -> FocOut<i64> {
        let mut words = self.words[INPUTS..POSITION].iter();
        FocOut::build(|| *words.next().expect("seven outputs"))
    }
}

impl Block for FloatLogic {
    const NAME: &'static str = "foc_knob_floats";
    const CLOCKED: bool = true;
    type In<T> = KnobIn<T>;
    type Out<T> = FocOut<T>;

    fn inputs(&self) -> KnobIn<Signal> {
        self.ports.clone()
    }

    fn outputs(&self) -> FocOut<Signal> {
        self.outs.clone()
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        Vec::new()
    }

    fn reset(&mut self) -> FocOut<i64> {
        self.modulator.reset();
        (self.left, self.phase, self.samples) = (0, None, false);
        (self.state, self.words, self.meter) = (State::default(), [0; NETS], Meter::default());
        self.voltage();
        self.shown()
    }

    fn tick(&mut self, input: KnobIn<i64>) -> FocOut<i64> {
        let out = self.modulator.tick(self.at_modulator(input.enable));
        let three_phase_pwm::Out { a_high, a_low, b_high, b_low, c_high, c_low, trigger, sample } = out;
        let shown = [a_high, a_low, b_high, b_low, c_high, c_low, trigger];
        let mut changes = self.words[INPUTS..POSITION] != shown;
        self.words[INPUTS..POSITION].copy_from_slice(&shown);
        let moved = self.locate(&input);
        let samples = std::mem::replace(&mut self.samples, sample == 1);
        if samples {
            self.control(&input);
        }
        if self.left == 0 {
            self.left = input.period.max(1).unsigned_abs();
            self.law(&input);
            changes = true;
        }
        self.left -= 1;
        if moved || samples {
            self.voltage();
            changes = true;
        }
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        if changes {
            self.meter.range(&self.words);
        }
        self.shown()
    }

    fn quiet(&self, input: &KnobIn<i64>) -> u64 {
        // The order of the ports: lines, word, and the choice of both.
        let unseen = self.words[..4] != [input.a_pin, input.b_pin, input.code, input.coded];
        match unseen || self.samples {
            true => 0,
            false => self.modulator.quiet(&self.at_modulator(input.enable)).min(self.left),
        }
    }

    fn skip(&mut self, edges: u64, input: &KnobIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.left -= edges;
        self.modulator.skip(edges, &self.at_modulator(input.enable));
    }
}

impl Wiring for FloatLogic {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&Block::inputs(self));
        all.extend(flatten(&Block::outputs(self)));
        all.extend(self.inside.iter().cloned());
        all
    }

    fn instances(&self) -> Vec<Instance> {
        Vec::new()
    }

    fn settle(&mut self, input: &KnobIn<i64>) {
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
    }

    fn words(&self) -> &[i64] {
        &self.words
    }

    fn rest_modulator(&mut self) {
        self.modulator.rest();
    }

    fn uses(&self) -> Vec<SignalUse> {
        self.meter.uses().to_vec()
    }
}
