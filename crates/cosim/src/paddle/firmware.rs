//! The firmware of EPFL's haptic paddle in the arithmetic of its microcontroller: float32, in its order. It closes the
//! loop in the place of the words, which it is the reference for. It has no VHDL.
//!
//! It reads the converter's codes and the encoder's lines as the words do, counts at once, and samples at the same
//! clock edges. Its modulator is the words' own.

use hpu_datapath::paddle::{EpflPaddleLoop, PaddleIn, TimerPwm, timer_pwm};
use hpu_datapath::{Block, Generic, Instance, LoopOut, Wiring, flatten};
use hpu_signal::{Format, Meter, Ports, Signal, SignalUse};

use hpu_scene::PaddleFloats;

/// The firmware in a loop.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Firmware {
    floats: PaddleFloats,
    /// The loop in words whose place it takes; its ports and nets are described there.
    ports: PaddleIn<Signal>,
    inside: Vec<Signal>,
    modulator: TimerPwm,
    /// Edges before the next sample of the converter, of the current controller and of the position controller.
    left: [u64; 3],
    phase: Option<i64>,
    /// Whether a code has filled the buffer.
    primed: bool,
    /// The newest codes, in the order of a ring, and the place of the oldest.
    codes: Vec<i64>,
    oldest: usize,
    state: State,
    words: [i64; NETS],
    meter: Meter<NETS>,
}

/// The firmware's variables.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct State {
    /// Filtered current, the controller's integral in V, and the wanted current.
    current_a: f32,
    sum_v: f32,
    target_a: f32,
    /// Filtered angle in degrees, and the error's integral.
    angle: f32,
    acc: f32,
}

const INPUTS: usize = 19;
const POSITION: usize = 23;
const NETS: usize = 30;
/// The nets inside, those of the words of the same names.
const INSIDE: [&str; NETS - POSITION] = ["position", "angle", "filtered", "aim", "sum", "current", "command"];

impl Firmware {
    /// Creates the firmware after reset.
    pub(crate) fn new(floats: PaddleFloats, wiring: &EpflPaddleLoop, modulator: TimerPwm) -> Self {
        let nets = Wiring::nets(wiring);
        Self {
            codes: vec![0; floats.window],
            ports: Block::inputs(wiring),
            inside: INSIDE.map(|name| nets.iter().find(|net| net.name == name).expect("a net").clone()).into(),
            floats,
            modulator,
            left: [0, 1, 1],
            phase: None,
            primed: false,
            oldest: 0,
            state: State::default(),
            words: [0; NETS],
            meter: Meter::default(),
        }
    }

    /// Counts the changes of the lines' phase, from the first phase seen on. Returns whether there was one.
    fn count(&mut self, input: &PaddleIn<i64>) -> bool {
        let phase = if input.b_pin == 1 { 1 + input.a_pin } else { 3 * input.a_pin };
        let before = self.phase.replace(phase).unwrap_or(phase);
        let step = [0, 1, 0, -1][(phase - before).rem_euclid(4) as usize];
        self.words[POSITION] += step;
        step != 0
    }

    /// Takes a code of the converter; the first one fills the buffer.
    fn convert(&mut self, code: i64) {
        if !std::mem::replace(&mut self.primed, true) {
            self.codes.fill(code);
        }
        self.codes[self.oldest] = code;
        self.oldest = (self.oldest + 1) % self.codes.len();
    }

    /// Computes a sample of the current controller: `torque_regulator.c`.
    fn regulate(&mut self) -> i64 {
        let PaddleFloats { code_a, zero_a, current_share, proportional, integral, limit_v, .. } = self.floats;
        let (floats, state) = (&self.floats, &mut self.state);
        let sum: i64 = self.codes.iter().sum();
        let mean_a = sum as f32 / floats.window as f32 * code_a - zero_a;
        state.current_a = (1.0 - current_share) * state.current_a + current_share * mean_a;
        let error = state.target_a - state.current_a;
        state.sum_v = (state.sum_v + integral * error * 50e-6).clamp(-limit_v, limit_v);
        let volts = floats.feed_forward_ohm * state.target_a + proportional * error + state.sum_v;
        let duty = (volts / floats.supply_v).clamp(-floats.duty_limit, floats.duty_limit);
        ((duty + 1.0) * floats.centre as f32).floor() as i64 - floats.centre
    }

    /// Computes a sample of the position controller for a reading in degrees: `haptic_controller.c`. One that is not on
    /// filters the angle and asks for no current.
    fn follow(&mut self, reading: f32, target: f32, is_on: bool) {
        let (floats, state) = (&self.floats, &mut self.state);
        let before = state.angle;
        state.angle = floats.share * reading + (1.0 - floats.share) * state.angle;
        if !is_on {
            state.target_a = 0.0;
            return;
        }
        let error = target - state.angle;
        state.acc += error * 350e-6;
        let rate = (before - state.angle) / 350e-6;
        let torque =
            (floats.gains[0] * error + floats.gains[1] * state.acc + floats.gains[2] * rate) / floats.reduction;
        state.target_a = torque.clamp(-floats.torque_limit_nm, floats.torque_limit_nm) / floats.torque_constant;
    }

    /// Returns the counts or codes of the angle that is read.
    fn reading(&self, input: &PaddleIn<i64>) -> i64 {
        let [position, hall] =
            [&self.ports.reference, &self.ports.hall].map(|port| Format::signed(port.format.width()));
        match input.analog {
            0 => position.wrap((self.words[POSITION] - input.reference).into()),
            _ => hall.wrap(input.hall.into()),
        }
    }

    fn gates(&self) -> LoopOut<i64> {
        let [a_high, a_low, b_high, b_low] = [INPUTS, INPUTS + 1, INPUTS + 2, INPUTS + 3].map(|net| self.words[net]);
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn at_modulator(&self) -> timer_pwm::In<i64> {
        timer_pwm::In { command: self.words[NETS - 1] }
    }
}

/// Counts an edge of a period down; returns whether it samples.
fn samples(left: &mut u64, period: i64) -> bool {
    let samples = *left == 0;
    *left = if samples { period.max(1).unsigned_abs() } else { *left } - 1;
    samples
}

impl Block for Firmware {
    const NAME: &'static str = "epfl_paddle_firmware";
    const CLOCKED: bool = true;
    type In<T> = PaddleIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> PaddleIn<Signal> {
        self.ports.clone()
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let timer_pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        Vec::new()
    }

    fn reset(&mut self) -> LoopOut<i64> {
        self.modulator.reset();
        (self.left, self.phase, self.oldest, self.primed) = ([0, 1, 1], None, 0, false);
        (self.state, self.words, self.meter) = (State::default(), [0; NETS], Meter::default());
        self.codes.fill(0);
        self.gates()
    }

    fn tick(&mut self, input: PaddleIn<i64>) -> LoopOut<i64> {
        let timer_pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.tick(self.at_modulator());
        self.words[INPUTS..POSITION].copy_from_slice(&[a_high, a_low, b_high, b_low]);
        let [adc, current, haptic] = &mut self.left;
        let regulates = samples(current, input.current_period);
        let follows = samples(haptic, input.haptic_period);
        let converts = samples(adc, input.adc_period);
        let mut changes = self.count(&input) | regulates | follows;
        if regulates {
            self.words[NETS - 1] = self.regulate();
        }
        if follows {
            let (unit, lsb) = (self.floats.count_deg, self.ports.target.format.lsb());
            let reading = self.reading(&input);
            let is_on = [input.proportional, input.integral, input.derivative] != [0; 3];
            self.follow(reading as f32 * unit, (input.target as f64 * lsb) as f32 * unit, is_on);
            let to_unit = |value: f32, unit: f32| (f64::from(value) / f64::from(unit)).round() as i64;
            self.words[POSITION + 1] = reading;
            self.words[POSITION + 2] = to_unit(self.state.angle * 4096.0, unit);
            self.words[POSITION + 3] = to_unit(self.state.target_a, self.floats.unit_a);
        }
        if regulates {
            self.words[POSITION + 5] =
                (f64::from(self.state.current_a) * 4096.0 / f64::from(self.floats.unit_a)).round() as i64;
        }
        if converts {
            self.convert(input.code);
            self.words[POSITION + 4] = self.codes.iter().sum::<i64>() - input.zero;
            changes = true;
        }
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
        if changes {
            self.meter.range(&self.words);
        }
        self.gates()
    }

    fn quiet(&self, input: &PaddleIn<i64>) -> u64 {
        let unseen = self.words[..2] != [input.a_pin, input.b_pin];
        let pulses = self.modulator.quiet(&self.at_modulator());
        if unseen { 0 } else { self.left.into_iter().fold(pulses, u64::min) }
    }

    fn skip(&mut self, edges: u64, input: &PaddleIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.left = self.left.map(|left| left - edges);
        self.modulator.skip(edges, &self.at_modulator());
    }
}

impl Wiring for Firmware {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&Block::inputs(self));
        all.extend(flatten(&Block::outputs(self)));
        all.extend(self.inside.iter().cloned());
        all
    }

    fn instances(&self) -> Vec<Instance> {
        Vec::new()
    }

    fn settle(&mut self, input: &PaddleIn<i64>) {
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
