//! The two loops of EPFL's haptic paddle: a position controller that asks for a current, and a current controller that
//! sets the duty of the bridge.
//!
//! - **Ports**: `a_pin`, `b_pin` (0,1,0), `reference` (0,POSITION_WIDTH,0) of the encoder, `hall` (0,HALL_WIDTH,0) of
//!   the analog angle sensor, `analog` (0,1,0) to read that, `code` (1,CODE_WIDTH-1,0) of the current's converter,
//!   `zero` (1,SUM_WIDTH-1,0), `target` (1,TARGET_WIDTH-1-TARGET_FRAC,TARGET_FRAC) in counts or codes of the angle;
//!   `share` (0,0,16), `proportional`, `integral`, `derivative` (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC) of the position
//!   controller; `current_share` (0,0,16), `current_proportional`, `current_integral`, `forward`
//!   (0,CURRENT_GAIN_WIDTH-CURRENT_GAIN_FRAC,CURRENT_GAIN_FRAC) of the current controller; `adc_period`,
//!   `current_period`, `haptic_period` (0,PERIOD_WIDTH,0) in clocks, in; gates `a_high`, `a_low`, `b_high`, `b_low`
//!   (0,1,0) out. Formats are those of the blocks.
//! - **Latency**: converter to sum 1 edge; sum to command, and angle to wanted current, 1 edge after the second edge of
//!   their period; command to gates up to a period of the modulator. A pin comes to the angle in 4 edges.
//! - **Reset**: all registers 0; the first edge samples the converter, the second both controllers.
//! - **Overflow**: of its blocks.
//! - **VHDL twin**: `hdl/epfl_paddle_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: the firmware of EPFL's haptic paddle of 12 April 2018 (HannesRovina/HapticHumanRobotInterfaces-Lab):
//!   168 MHz, periods of 320, 8568 and 58 968 clocks.
//! - **Differs from the hardware**: the firmware computes in float32 on a microcontroller, whose interrupts start some
//!   microseconds late; here a sample takes one edge.

use hpu_signal::Signal;

use super::{
    AngleSelect, FilteredPid, FilteredPidConfig, TimerPwm, TimerPwmConfig, WindowSum, angle_select, filtered_pid,
    timer_pwm, window_sum,
};
use crate::base::block::renamed;
use crate::base::countdown::edges;
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::natural;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit, Passed, Way};
use crate::circuit::{NEVER, Set, circuit, put};
use crate::{
    Block, ConfigError, Displacement, Generic, LoopOut, PositionCounter, QuadratureDecoder, SampleTimer, Synchronizer,
    gimbal::sample_timer, pins::displacement, pins::position_counter, pins::quadrature_decoder, pins::synchronizer,
};

hpu_signal::ports! {
    /// Inputs of the paddle's loop: the encoder's pins, the converters' words, and the words that the scene sets.
    pub struct PaddleIn of |block: &EpflPaddleCircuit| {
        a_pin = block.sync.inputs().a_pin;
        b_pin = block.sync.inputs().b_pin;
        reference = block.offset.inputs().reference, "Position that is the angle 0";
        hall = block.select_angle.inputs().code;
        analog = block.select_angle.inputs().analog;
        code = block.window_of_codes.inputs().code;
        zero = block.window_of_codes.inputs().zero;
        target = block.haptic.inputs().target, "Wanted angle";
        share = block.haptic.inputs().share;
        proportional = block.haptic.inputs().proportional;
        integral = block.haptic.inputs().integral;
        derivative = block.haptic.inputs().derivative;
        current_share = block.current_control.inputs().share;
        current_proportional = block.current_control.inputs().proportional;
        current_integral = block.current_control.inputs().integral;
        forward = block.current_control.inputs().forward;
        adc_period = block.window_of_codes.inputs().period, "Period of the current's converter; 0 acts as 1";
        current_period = block.current_timer.inputs().period, "Period of the current controller; 0 acts as 1";
        haptic_period = block.haptic_timer.inputs().period, "Period of the position controller; 0 acts as 1";
    }
}

/// The loop of the paddle. See the [module](self).
pub type EpflPaddleLoop = CircuitLoop<EpflPaddleCircuit, 37>;

circuit! {
    /// The blocks of the paddle's loop.
    pub struct EpflPaddleCircuit[][][37] { config: PaddleConfig }
    nets {
        a_pin, b_pin, reference, hall, analog, code, zero, target, share, proportional, integral, derivative,
        current_share, current_proportional, current_integral, forward, adc_period, current_period, haptic_period,
        a_high, a_low, b_high, b_low,
        a, b, step, error, position, delta, angle, haptic_sample, filtered, aim, sum, current_sample, current, command,
    }
    sync: Synchronizer = synchronizer { a_pin, b_pin } -> { a, b };
    decoder: QuadratureDecoder = quadrature_decoder { a, b } -> { step, error };
    counter: PositionCounter = position_counter { step } -> { position };
    offset: Displacement = displacement { position, reference } -> { delta };
    select_angle: AngleSelect = angle_select { delta, code: hall, analog } -> { angle };
    haptic_timer: SampleTimer = sample_timer { period: haptic_period } -> { sample: haptic_sample };
    haptic: FilteredPid = filtered_pid {
        target, measured: angle, share, proportional, integral, derivative, forward = 0, sample: haptic_sample,
    } -> { filtered, command: aim };
    window_of_codes: WindowSum = window_sum { code, zero, period: adc_period } -> { sum };
    current_timer: SampleTimer = sample_timer { period: current_period } -> { sample: current_sample };
    current_control: FilteredPid = filtered_pid {
        target: aim, measured: sum, share: current_share, proportional: current_proportional,
        integral: current_integral, derivative = 0, forward, sample: current_sample,
    } -> { filtered: current, command };
    modulator: TimerPwm = timer_pwm { command } -> { a_high, a_low, b_high, b_low };
}

/// The generics of the position controller that have another name in the loop.
const HAPTIC: [(&str, &str); 6] = [
    ("WIDTH", "POSITION_WIDTH"),
    ("COMMAND_WIDTH", "AIM_WIDTH"),
    ("LEAST", "AIM_LEAST"),
    ("MOST", "AIM_MOST"),
    ("SUM_LIMIT", "HAPTIC_SUM_LIMIT"),
    ("SUM_FRAC", "HAPTIC_SUM_FRAC"),
];
/// Those of the current controller that are its own.
const CURRENT: [(&str, &str); 8] = [
    ("FRAC", "CURRENT_FRAC"),
    ("GAIN_WIDTH", "CURRENT_GAIN_WIDTH"),
    ("GAIN_FRAC", "CURRENT_GAIN_FRAC"),
    ("COMMAND_WIDTH", "DUTY_WIDTH"),
    ("LEAST", "DUTY_LEAST"),
    ("MOST", "DUTY_MOST"),
    ("SUM_LIMIT", "CURRENT_SUM_LIMIT"),
    ("SUM_FRAC", "CURRENT_SUM_FRAC"),
];
/// That of the modulator.
const DUTY: [(&str, &str); 1] = [("COMMAND_WIDTH", "DUTY_WIDTH")];

/// The formats and limits of the paddle's loop.
///
/// A width that blocks share is stated once: [`haptic`](Self::haptic) has that of the angle and of the wanted current,
/// `current` that of the duty.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PaddleConfig {
    /// Width of the analog sensor's code.
    pub hall_width: u32,
    /// The position controller.
    pub haptic: FilteredPidConfig,
    /// Width of the converter's code.
    pub code_width: u32,
    /// Number of codes that are summed.
    pub window: u32,
    /// Width of their sum.
    pub sum_width: u32,
    /// The current controller.
    pub current: FilteredPidConfig,
    /// The modulator.
    pub pwm: TimerPwmConfig,
    /// Width of the periods.
    pub period_width: u32,
}

impl Default for PaddleConfig {
    fn default() -> Self {
        Self {
            hall_width: 12,
            haptic: FilteredPidConfig::default(),
            code_width: 12,
            window: 33,
            sum_width: 18,
            current: FilteredPidConfig::current(),
            pwm: TimerPwmConfig::default(),
            period_width: 24,
        }
    }
}

impl PaddleConfig {
    /// Returns the current controller with the shared widths.
    fn current(&self) -> FilteredPidConfig {
        let target = hpu_signal::Format::signed(self.haptic.command_width);
        FilteredPidConfig { width: self.sum_width + 1, target, ..self.current }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let in_loop = |names: &'static [_]| move |(name, value)| (renamed(name, names), value);
        let mut all: Vec<_> = self.haptic.generics().into_iter().map(in_loop(&HAPTIC)).collect();
        all.insert(1, natural("HALL_WIDTH", self.hall_width));
        all.push(natural("CODE_WIDTH", self.code_width));
        all.push(natural("WINDOW", self.window));
        all.push(natural("SUM_WIDTH", self.sum_width));
        let own = self.current.generics().into_iter().filter(|(name, _)| CURRENT.iter().any(|(own, _)| own == name));
        all.extend(own.map(in_loop(&CURRENT)));
        all.extend(self.pwm.generics().split_off(1));
        all.push(natural("PERIOD_WIDTH", self.period_width));
        all
    }

    fn given(given: &Given) -> Result<Self, ConfigError> {
        let haptic = FilteredPidConfig::given(&given.renamed(&HAPTIC))?;
        let [hall_width, code_width, window, sum_width, period_width] =
            given.naturals(["HALL_WIDTH", "CODE_WIDTH", "WINDOW", "SUM_WIDTH", "PERIOD_WIDTH"])?;
        let current = FilteredPidConfig::given(&given.renamed(&CURRENT))?;
        let pwm = TimerPwmConfig::given(&given.renamed(&DUTY))?;
        Ok(Self { hall_width, haptic, code_width, window, sum_width, current, pwm, period_width })
    }
}

impl EpflPaddleLoop {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words.
    pub fn new(config: PaddleConfig) -> Result<Self, ConfigError> {
        let (haptic, position) = (FilteredPid::new(config.haptic)?, config.haptic.width);
        let window = WindowSum::new(config.code_width, config.window, config.sum_width, config.period_width)?;
        let current = config.current();
        let timer = SampleTimer::new(config.period_width)?;
        let pwm = TimerPwmConfig { command_width: current.command_width, ..config.pwm };
        Ok(Self::of(EpflPaddleCircuit {
            paces: Paces::default(),
            config,
            sync: Synchronizer::new(),
            decoder: QuadratureDecoder::default(),
            counter: PositionCounter::new(position)?,
            offset: Displacement::new(position)?,
            select_angle: AngleSelect::new(position, config.hall_width)?,
            haptic_timer: timer.clone(),
            haptic,
            window_of_codes: window,
            current_timer: timer,
            current_control: FilteredPid::new(current)?,
            modulator: TimerPwm::new(pwm)?,
        }))
    }
}

impl Default for EpflPaddleLoop {
    fn default() -> Self {
        Self::new(PaddleConfig::default()).expect("the data sheet's default")
    }
}

impl Paces {
    /// Returns the next edge at which a block is due that neither codes nor lines of the encoder come to first.
    #[inline]
    fn apart(&self) -> u64 {
        let Self { counter, haptic_timer, haptic, current_timer, current_control, modulator, .. } = self;
        let loops = haptic_timer.due().min(haptic.due()).min(current_timer.due()).min(current_control.due());
        loops.min(counter.due()).min(modulator.due())
    }
}

impl LoopCircuit<37> for EpflPaddleCircuit {
    const NAME: &'static str = "epfl_paddle_loop";
    const INPUTS: usize = 19;
    type In<T> = PaddleIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> PaddleIn<Signal> {
        PaddleIn::of(self)
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let timer_pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn rest(&mut self, edge: u64) {
        self.modulator.rest();
        self.paces.modulator.wake(edge + 1);
    }

    #[inline]
    fn gathers(&self, edge: u64) -> (u64, Set) {
        let Paces { sync, decoder, window_of_codes, .. } = &self.paces;
        let due = self.paces.apart().min(sync.due()).min(decoder.due());
        // A sum that stands still does not tell when it samples.
        let is_known = window_of_codes.due() != NEVER;
        (if is_known { due - edge - 1 } else { 0 }, 1 << Self::NET.code | 1 << Self::NET.sum)
    }

    fn gather(
        &mut self,
        (first, period): (u64, u64),
        codes: &[i64],
        words: &mut [i64; 37],
        mut tell: impl FnMut(usize, i64),
    ) -> u64 {
        let Nets { code, sum, zero, adc_period, .. } = Self::NET;
        let (block, pace) = (&mut self.window_of_codes, &mut self.paces.window_of_codes);
        let mut input = window_sum::In { code: words[code], zero: words[zero], period: words[adc_period] };
        let (mut due, last) = (pace.due(), first + period * (codes.len() as u64 - 1));
        let (mut total, mut ends) = (words[sum], [words[sum]; 2]);
        let given = (first..).step_by(period as usize).zip(codes);
        let mut ticks = 0;
        for (at, next) in given.chain([(last + 1, &codes[codes.len() - 1])]) {
            while due < at {
                let before = total;
                total = block.sampled(input).sum;
                // A window that was full of this code is not due.
                ticks += u64::from(total != before || !block.is_full(input.code));
                ends = [ends[0].min(total), ends[1].max(total)];
                due += edges(input.period);
            }
            ticks += u64::from(input.code != *next && due != at);
            input.code = *next;
        }
        block.wait(due - last - 1);
        pace.rest(last, input);
        pace.come(block, last);
        (words[code], words[sum]) = (input.code, total);
        ends.iter().for_each(|word| tell(sum, *word));
        codes.iter().for_each(|word| tell(code, *word));
        ticks
    }

    const PASSED: Set = 1 << Self::NET.a | 1 << Self::NET.b | 1 << Self::NET.step | 1 << Self::NET.error;

    #[inline(always)]
    fn pass_step(&mut self, edge: u64, words: &mut [i64; 37]) -> Option<Passed> {
        let others = self.paces.apart().min(self.paces.window_of_codes.due());
        let Paces { sync, decoder, .. } = &mut self.paces;
        let (sync, decoder) = ((sync, &mut self.sync), (decoder, &mut self.decoder));
        let way = Way { sync, decoder, counter: &mut self.counter };
        let (synchronizer::Out { a, b }, [step, position]) = way.pass(edge, |last| others <= last)?;
        let nets = [(Self::NET.a, a), (Self::NET.b, b), (Self::NET.position, position)];
        let changed = nets.into_iter().fold(0, |changed, (net, word)| changed | put(words, net, word));
        Some(Passed { changed, step: (Self::NET.step, step) })
    }

    fn described(&self, net: Signal) -> Signal {
        let doc = match net.name {
            "filtered" => "Filtered angle",
            "aim" => "Wanted current, in units of the sum",
            "current" => "Filtered current, in units of the sum",
            "haptic_sample" => "The next edge samples the position controller",
            "current_sample" => "The next edge samples the current controller",
            _ => net.doc,
        };
        Signal { doc, ..net }
    }
}

impl Configured for EpflPaddleLoop {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(PaddleConfig::given(given)?)
    }
}

impl Listed for EpflPaddleLoop {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |signed, int, frac| hpu_signal::Format::new(signed, int, frac).expect("at most 40 bits");
        let haptic = FilteredPidConfig {
            width: 6,
            frac: 3,
            target: format(true, 6, 2),
            gain: format(false, 4, 1),
            command_width: 8,
            least: -101,
            most: 99,
            sum_limit: 77,
            sum_frac: 0,
        };
        let short = PaddleConfig {
            hall_width: 5,
            haptic,
            code_width: 4,
            window: 3,
            sum_width: 7,
            current: FilteredPidConfig {
                gain: format(false, 2, 6),
                command_width: 5,
                least: -13,
                most: 12,
                sum_limit: 41,
                sum_frac: 2,
                frac: 4,
                ..haptic
            },
            pwm: TimerPwmConfig { command_width: 5, prescale: 2, steps: 27, centre: 14 },
            period_width: 9,
        };
        Ok(vec![("short", Self::new(short)?)])
    }
}
