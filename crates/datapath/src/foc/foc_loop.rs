//! The current loops of a three-phase motor under field-oriented control: from a wanted current, an encoder and two
//! phase currents to the gates of three legs.
//!
//! - **Equation**: of its blocks. `clarke` and `park` make `d` and `q` of the currents and of the electrical angle, two
//!   controllers ask for the voltages `v_d` and `v_q`, `inverse_park` and `space_vector` make duties of these. The
//!   wanted current along the flux is 0, that across it is `target`. Both controllers have the same gains.
//! - **Samples**: the modulator's `trigger` starts the converters of the currents. `SAMPLE_DELAY` clocks later both
//!   controllers take a sample, with the rotor's angle of that clock, and the modulator takes the duties at its next
//!   valley, with the angle of that clock. While `enable` is 0, no sample is taken and all gates are off.
//! - **Angle**: `POLE_PAIRS` turns of the field per `COUNTS` counts from `offset` on. The counter wraps at
//!   `2^POSITION_WIDTH` counts: where these are no whole number of turns, the angle is wrong from there on. The step of
//!   a count is the nearest of `2^PHASE_WIDTH` in a turn of the field.
//! - **Controllers**: [`filtered_pid`] and not [`pid`](crate::pid), because an input tells it when to sample; `pid`
//!   counts a period of its own, which knows nothing of the modulator. Its filter passes 65535 parts in 65536 of a
//!   change at once. The sum is limited to `LIMIT` by itself, as the voltage is.
//! - **Ports**: `a_pin`, `b_pin` (0,1,0), `offset` (0,POSITION_WIDTH,0), `i_a`, `i_b` (1,CODE_WIDTH-1,0), `target`
//!   (1,CODE_WIDTH,FRAC) in codes, `proportional`, `integral` (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC) in parts of the
//!   voltage for `2^-FRAC` codes, of a sample, `enable` (0,1,0) in; `a_high`, `a_low`, `b_high`, `b_low`, `c_high`,
//!   `c_low`, `trigger` (0,1,0) out. A voltage of `2^(VOLTAGE_WIDTH-1)` is that of the supply.
//! - **Latency**: a pin comes to the angle in 4 edges, and to sine and cosine in 5; a sample to the voltages in 1; then
//!   the duties wait for the valley.
//! - **Reset**: all registers 0. **Overflow**: of its blocks. The vector of both voltages has no limit of its own:
//!   beyond the modulator's range the duties clamp.
//! - **VHDL twin**: `hdl/foc_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: the textbooks' control in the coordinates of the field, as in Blaschke 1972.
//! - **Differs from the hardware**: combinational paths settle within the clock they change in; `SAMPLE_DELAY` and the
//!   wait for the valley are the time a real one would be given.

use hpu_signal::{Format, Signal};

use super::{
    Clarke, ClarkeConfig, InversePark, Park, RotationConfig, SpaceVector, SpaceVectorConfig, ThreePhasePwm,
    ThreePhasePwmConfig, clarke, inverse_park, park, space_vector, three_phase_pwm,
};
use crate::base::config::{NATURAL, within};
use crate::base::listed::{Configured, Given, Listed};
use crate::circuit::circuit;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit};
use crate::paddle::{FilteredPid, FilteredPidConfig, filtered_pid};
use crate::pins::{displacement, position_counter, quadrature_decoder, synchronizer};
use crate::trig::{Phase, TrigCordic};
use crate::{Block, ConfigError, Displacement, Generic, PositionCounter, QuadratureDecoder, Synchronizer};

hpu_signal::ports! {
    /// Inputs of the loop: the encoder's pins, the converters' words, and the words that the scene sets.
    pub struct FocIn of |block: &FocCircuit| {
        a_pin = block.sync.inputs().a_pin;
        b_pin = block.sync.inputs().b_pin;
        offset = block.from_zero.inputs().reference, "Position at which the electrical angle is 0";
        i_a = block.stator.inputs().a;
        i_b = block.stator.inputs().b;
        target: block.config.current(), "code", "Wanted current across the flux";
        proportional = block.control_q.inputs().proportional, "Voltage for 2^-FRAC codes";
        integral = block.control_q.inputs().integral, "Change of the voltage in a sample for 2^-FRAC codes";
        enable = block.modulator.inputs().enable;
    }
    /// Outputs of the loop: the gates of three legs, and the start of the converters.
    pub struct FocOut of |block: &FocCircuit| {
        a_high = block.modulator.outputs().a_high;
        a_low = block.modulator.outputs().a_low;
        b_high = block.modulator.outputs().b_high;
        b_low = block.modulator.outputs().b_low;
        c_high = block.modulator.outputs().c_high;
        c_low = block.modulator.outputs().c_low;
        trigger = block.modulator.outputs().trigger;
    }
}

/// The loop. See the [module](self).
pub type FocLoop = CircuitLoop<FocCircuit, 39>;

/// The ports of a source of sine and cosine.
mod trig {
    pub(super) use crate::trig::{TrigIn as In, TrigOut as Out};
}

circuit! {
    /// The blocks of the loop.
    pub struct FocCircuit[][][39] { config: FocConfig }
    nets {
        a_pin, b_pin, offset, i_a, i_b, target, proportional, integral, enable,
        a_high, a_low, b_high, b_low, c_high, c_low, trigger,
        a, b, step, error, position, delta, sine, cosine, valid, alpha, beta, d, q,
        filtered_d, v_d, filtered_q, v_q, v_alpha, v_beta, duty_a, duty_b, duty_c, sample,
    }
    sync: Synchronizer = synchronizer { a_pin, b_pin } -> { a, b };
    decoder: QuadratureDecoder = quadrature_decoder { a, b } -> { step, error };
    counter: PositionCounter = position_counter { step } -> { position };
    from_zero: Displacement = displacement { position, reference: offset } -> { delta };
    angle: TrigCordic = trig { count: delta } -> { sine, cosine, valid };
    stator: Clarke = clarke { a: i_a, b: i_b, c = 0 } -> { alpha, beta };
    rotor: Park = park { alpha, beta, sine, cosine } -> { d, q };
    control_d: FilteredPid = filtered_pid {
        target = 0, measured: d, share = 65535, proportional, integral, derivative = 0, forward = 0, sample,
    } -> { filtered: filtered_d, command: v_d };
    control_q: FilteredPid = filtered_pid {
        target, measured: q, share = 65535, proportional, integral, derivative = 0, forward = 0, sample,
    } -> { filtered: filtered_q, command: v_q };
    voltage: InversePark = inverse_park { d: v_d, q: v_q, sine, cosine } -> { alpha: v_alpha, beta: v_beta };
    duties: SpaceVector = space_vector { alpha: v_alpha, beta: v_beta } -> { duty_a, duty_b, duty_c };
    modulator: ThreePhasePwm = three_phase_pwm { duty_a, duty_b, duty_c, enable }
        -> { a_high, a_low, b_high, b_low, c_high, c_low, trigger, sample };
}

crate::base::listed::configuration! {
    /// The words of the loop.
    pub struct FocConfig {
        /// Width of the position, in bits.
        position_width: u32 = 16, ["POSITION_WIDTH"];
        /// Turns of the field in a turn of the rotor.
        pole_pairs: u32 = 7, ["POLE_PAIRS"];
        /// Counts of the encoder in a turn of the rotor, at most `2^20`.
        counts: u32 = 4096, ["COUNTS"];
        /// Width of the field's angle, in bits.
        phase_width: u32 = 36, ["PHASE_WIDTH"];
        /// Rotations of the source of sine and cosine.
        iterations: u32 = 17, ["ITERATIONS"];
        /// Bits of its rotations below those of the sines.
        guard: u32 = 4, ["GUARD"];
        /// Fraction bits of the sines.
        trig_frac: u32 = 14, ["TRIG_FRAC"];
        /// Width of a current's code, in bits.
        code_width: u32 = 12, ["CODE_WIDTH"];
        /// Fraction bits of the currents, in codes.
        frac: u32 = 3, ["FRAC"];
        /// Further fraction bits in the controllers' filters.
        filter_frac: u32 = 5, ["FILTER_FRAC"];
        /// Format of the gains.
        gain: Format = Format::new(false, 8, 16).expect("24 bits"), ["GAIN_WIDTH", "GAIN_FRAC"];
        /// Width of the voltages, in bits.
        voltage_width: u32 = 15, ["VOLTAGE_WIDTH"];
        /// The greatest voltage of each controller.
        limit: u32 = 9459, ["LIMIT"];
        /// Width of the duties, in bits.
        duty_width: u32 = 11, ["DUTY_WIDTH"];
        /// Steps from valley to peak of the carrier; a step is a clock.
        steps: u32 = 1250, ["STEPS"];
        /// Clocks for which both gates of a leg are off when the leg changes.
        dead_time: u32 = 25, ["DEAD_TIME"];
        /// The least pulse, in steps.
        min_pulse: u32 = 20, ["MIN_PULSE"];
        /// Clocks from `trigger` to the sample.
        sample_delay: u32 = 100, ["SAMPLE_DELAY"];
        /// Whether samples and duties are taken at the peak too.
        peak: bool = false, ["PEAK"];
        /// Whether the phases are sines.
        sinusoidal: bool = false, ["SINUSOIDAL"];
    }
}

impl FocConfig {
    /// Returns the format of a current of stator or rotor, in codes.
    fn current(self) -> Format {
        Format::new(true, self.code_width.cast_signed(), self.frac.cast_signed()).expect("words that clarke accepts")
    }

    /// Returns the phase of a count.
    fn phase(self, trig: Format) -> Result<Phase, ConfigError> {
        const NAME: &str = FocCircuit::NAME;
        within(NAME, "PHASE_WIDTH", self.phase_width, 31..=48)?;
        // The step of a count is to be a VHDL `natural`, and to be the same as a quotient of 64-bit floats.
        let least = (1 << self.phase_width) / u64::from(NATURAL) + 1;
        within(NAME, "COUNTS", self.counts, u32::try_from(least).unwrap_or(NATURAL)..=1 << 20)?;
        let most = (u64::from(NATURAL) * u64::from(self.counts)) >> self.phase_width;
        within(NAME, "POLE_PAIRS", self.pole_pairs, 1..=u32::try_from(most).unwrap_or(NATURAL))?;
        let (num, den) = (u128::from(self.pole_pairs) << self.phase_width, u128::from(self.counts));
        let step = u32::try_from((2 * num + den) / (2 * den)).unwrap_or(u32::MAX);
        Ok(Phase { count_width: self.position_width, width: self.phase_width, step, trig })
    }

    /// Returns a current controller.
    fn control(self, width: u32) -> FilteredPidConfig {
        FilteredPidConfig {
            width,
            frac: self.filter_frac,
            target: Format::signed(width),
            gain: self.gain,
            command_width: self.voltage_width,
            least: -self.limit.cast_signed(),
            most: self.limit.cast_signed(),
            sum_limit: self.limit,
            sum_frac: 0,
        }
    }
}

impl FocLoop {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words, or unless a turn has at most `2^20` counts, and 1 or more pole
    /// pairs turn the field by a VHDL `natural` in a count, in `2^PHASE_WIDTH` of its turn.
    pub fn new(config: FocConfig) -> Result<Self, ConfigError> {
        let FocConfig { code_width, frac, voltage_width, duty_width, steps, sinusoidal, .. } = config;
        let stator = Clarke::new(ClarkeConfig { width: code_width, frac, three: false })?;
        let width = code_width + frac + 1;
        within(FocCircuit::NAME, "TRIG_FRAC", config.trig_frac, 4..=28)?;
        let trig = Format::new(true, 1, config.trig_frac.cast_signed()).expect("6 to 30 bits");
        within(FocCircuit::NAME, "LIMIT", config.limit, 1..=NATURAL)?;
        let control = FilteredPid::new(config.control(width))?;
        let modulator = ThreePhasePwmConfig {
            duty_width,
            steps,
            dead_time: config.dead_time,
            min_pulse: config.min_pulse,
            sample_delay: config.sample_delay,
            peak: config.peak,
        };
        Ok(Self::of(FocCircuit {
            paces: Paces::default(),
            config,
            sync: Synchronizer::new(),
            decoder: QuadratureDecoder::default(),
            counter: PositionCounter::new(config.position_width)?,
            from_zero: Displacement::new(config.position_width)?,
            angle: TrigCordic::new(config.phase(trig)?, config.iterations, config.guard)?,
            stator,
            rotor: Park::new(RotationConfig { width, trig })?,
            control_d: control.clone(),
            control_q: control,
            voltage: InversePark::new(RotationConfig { width: voltage_width, trig })?,
            duties: SpaceVector::new(SpaceVectorConfig { width: voltage_width, duty_width, steps, sinusoidal })?,
            modulator: ThreePhasePwm::new(modulator)?,
        }))
    }
}

crate::base::block::data_sheet!(FocLoop = Self::new(FocConfig::default()));

impl LoopCircuit<39> for FocCircuit {
    const NAME: &'static str = "foc_loop";
    const INPUTS: usize = 9;
    crate::base::block::described!(FocIn, FocOut);

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn rest(&mut self, edge: u64) {
        self.paces.modulator.catch_up(&mut self.modulator, edge);
        self.modulator.rest();
        self.paces.modulator.wake(edge + 1);
    }

    fn described(&self, net: Signal) -> Signal {
        Self::told(self.config, net)
    }
}

impl FocCircuit {
    /// Returns a net inside as a loop of these words describes it.
    pub(super) fn told(config: FocConfig, net: Signal) -> Signal {
        let current = |doc| Signal { format: config.current(), unit: "code", doc, ..net.clone() };
        let doc = match net.name {
            "d" => return current("Current along the rotor's flux"),
            "q" => return current("Current across the rotor's flux"),
            "delta" => "Position from the one with an electrical angle of 0",
            "filtered_d" => "Filtered current along the flux, in 2^-FRAC codes",
            "filtered_q" => "Filtered current across the flux, in 2^-FRAC codes",
            "v_d" => "Voltage along the flux",
            "v_q" => "Voltage across the flux",
            "v_alpha" => "Voltage along phase a",
            "v_beta" => "Voltage across phase a",
            _ => net.doc,
        };
        Signal { doc, ..net }
    }
}

impl Configured for FocLoop {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(FocConfig::given(given)?)
    }
}

impl FocConfig {
    /// Returns small words, with which every period is short.
    pub(super) fn short() -> Self {
        Self {
            position_width: 6,
            pole_pairs: 3,
            counts: 64,
            phase_width: 31,
            iterations: 8,
            guard: 2,
            trig_frac: 6,
            code_width: 4,
            frac: 1,
            filter_frac: 2,
            gain: Format::new(false, 2, 3).expect("5 bits"),
            voltage_width: 6,
            limit: 20,
            duty_width: 4,
            steps: 13,
            dead_time: 2,
            min_pulse: 1,
            sample_delay: 3,
            peak: true,
            sinusoidal: true,
        }
    }
}

impl Listed for FocLoop {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("short", Self::new(FocConfig::short())?)])
    }
}
