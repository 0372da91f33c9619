//! A knob behind field-oriented control: a table of torques and a wall in front of the current loops of a three-phase
//! motor, from the position to the gates of three legs.
//!
//! - **Equation**: of its blocks. `torque_table` makes a torque of the position and of its distance to the wall, in
//!   units of the torque for `2^-FRAC` codes of current; the wanted current is that torque, against the penetration.
//!   The rest is [`foc_loop`](super::foc_loop).
//! - **Position**: that of the encoder's counter or, while `coded` is 1, the word `code` of an absolute sensor.
//! - **Samples**: the law samples every `period` clocks from the reset on, whatever the modulator does; the currents
//!   as in `foc_loop`.
//! - **Ports**: `a_pin`, `b_pin` (0,1,0), `code` (0,POSITION_WIDTH,0), `coded` (0,1,0), `reference`
//!   (0,POSITION_WIDTH,0), `stiffness`, `damping`, `period` of `torque_table`, `zero` (0,POSITION_WIDTH,0), `i_a`,
//!   `i_b`, `proportional`, `integral`, `enable` and the outputs as in `foc_loop`, whose `offset` is `zero`.
//! - **Latency**: a pin comes to the position in 4 edges; a sample of the law to the wanted current in 1; the rest as
//!   in `foc_loop`.
//! - **Reset**: all registers 0. **Overflow**: of its blocks.
//! - **VHDL twin**: `hdl/foc_knob_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: that of its blocks.
//! - **Differs from the hardware**: as in its blocks; combinational paths settle within the clock they change in.

use hpu_signal::{Format, Overflow, Signal};

use super::{
    Clarke, FocCircuit, FocConfig, FocLoop, FocOut, InversePark, Park, PositionSelect, SpaceVector, ThreePhasePwm,
    clarke, inverse_park, park, position_select, space_vector, three_phase_pwm,
};
use crate::arithmetic::{truncating_multiplier, unilateral};
use crate::base::listed::{Configured, Field, Given, Listed};
use crate::circuit::circuit;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit};
use crate::methods::torque_table::MOST_TORQUES;
use crate::paddle::{FilteredPid, filtered_pid};
use crate::pins::{displacement, position_counter, quadrature_decoder, synchronizer};
use crate::trig::TrigCordic;
use crate::{
    Block, ConfigError, Displacement, Generic, LawWidths, PositionCounter, QuadratureDecoder, Synchronizer,
    TableConfig, TorqueTable, TruncatingMultiplier, Unilateral,
};

hpu_signal::ports! {
    /// Inputs of the loop: the encoder's pins, the sensors' words, and the words that the scene sets.
    pub struct KnobIn of |block: &KnobCircuit| {
        a_pin = block.sync.inputs().a_pin;
        b_pin = block.sync.inputs().b_pin;
        code = block.chosen.inputs().code;
        coded = block.chosen.inputs().coded;
        reference = block.offset.inputs().reference;
        stiffness: block.config.stiffness, "2^-FRAC code/count", "Stiffness of the wall";
        damping: block.config.damping, "2^-FRAC code/(count/sample)", "Damping inside the wall";
        period = block.law.inputs().period;
        zero = block.from_zero.inputs().reference, "Position at which the electrical angle is 0";
        i_a = block.stator.inputs().a;
        i_b = block.stator.inputs().b;
        proportional = block.control_q.inputs().proportional, "Voltage for 2^-FRAC codes";
        integral = block.control_q.inputs().integral, "Change of the voltage in a sample for 2^-FRAC codes";
        enable = block.modulator.inputs().enable;
    }
}

/// The loop. See the [module](self).
pub type FocKnobLoop = CircuitLoop<KnobCircuit, 51>;

/// The ports of the law.
mod law {
    pub(super) use crate::{LawIn as In, LawOut as Out};
}

/// The ports of a source of sine and cosine.
mod trig {
    pub(super) use crate::trig::{TrigIn as In, TrigOut as Out};
}

circuit! {
    /// The blocks of the loop.
    pub struct KnobCircuit[][][51] { config: KnobConfig }
    nets {
        a_pin, b_pin, code, coded, reference, stiffness, damping, period, zero, i_a, i_b, proportional, integral,
        enable, a_high, a_low, b_high, b_low, c_high, c_low, trigger,
        a, b, step, error, counted, position, delta, contact, penetration, torque, texture, target,
        field, sine, cosine, valid, alpha, beta, d, q,
        filtered_d, v_d, filtered_q, v_q, v_alpha, v_beta, duty_a, duty_b, duty_c, sample,
    }
    sync: Synchronizer = synchronizer { a_pin, b_pin } -> { a, b };
    decoder: QuadratureDecoder = quadrature_decoder { a, b } -> { step, error };
    counter: PositionCounter = position_counter { step } -> { position: counted };
    chosen: PositionSelect = position_select { count: counted, code, coded } -> { position };
    offset: Displacement = displacement { position, reference } -> { delta };
    wall: Unilateral = unilateral { delta } -> { contact, penetration };
    law: TorqueTable = law { position, delta, contact, penetration, stiffness, damping, period, scale = 0 }
        -> { torque, memory: texture };
    against: TruncatingMultiplier = truncating_multiplier { a: torque, b = -1 } -> { product: target };
    from_zero: Displacement = displacement { position, reference: zero } -> { delta: field };
    angle: TrigCordic = trig { count: field } -> { sine, cosine, valid };
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

/// The words of the current loops, as generics of an entity around them.
impl Field for FocConfig {
    fn told(self, _: &[&'static str]) -> Vec<(&'static str, Generic)> {
        self.generics()
    }

    fn given(given: &Given, _: &[&'static str], _: &Self) -> Result<Self, ConfigError> {
        Self::given(given)
    }
}

crate::base::listed::configuration! {
    /// The words of the loop.
    pub struct KnobConfig {
        /// The words of the current loops.
        foc: FocConfig = FocConfig::default(), [];
        /// Format of the stiffness, in 2^-FRAC codes per count.
        stiffness: Format = Format::new(false, 12, 8).expect("20 bits"), ["STIFFNESS_WIDTH", "STIFFNESS_FRAC"];
        /// Format of the damping, in 2^-FRAC codes per (count per sample).
        damping: Format = Format::new(false, 16, 4).expect("20 bits"), ["DAMPING_WIDTH", "DAMPING_FRAC"];
        /// Width of the sample period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Exponent of the number of torques.
        table_bits: u32 = 4, ["TABLE_BITS"];
        /// Exponent of the counts from one torque to the next.
        shift: u32 = 3, ["SHIFT"];
        /// The torques towards smaller counts, in 2^-FRAC codes; those beyond `2^table_bits` are ignored.
        torques: [i32; MOST_TORQUES] = TableConfig::default().torques, [
            "T0", "T1", "T2", "T3", "T4", "T5", "T6", "T7", "T8", "T9", "T10", "T11", "T12", "T13", "T14",
            "T15", "T16", "T17", "T18", "T19", "T20", "T21", "T22", "T23", "T24", "T25", "T26", "T27", "T28",
            "T29", "T30", "T31"
        ];
    }
}

impl KnobConfig {
    /// Returns the bits of the magnitude of a torque: all that a converter's word reads.
    pub fn torque_width(&self) -> u32 {
        (self.foc.code_width + self.foc.frac).saturating_sub(1)
    }
}

impl FocKnobLoop {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words, or the current loops theirs.
    pub fn new(config: KnobConfig) -> Result<Self, ConfigError> {
        let KnobConfig { foc, stiffness, damping, period_width, table_bits, shift, torques } = config;
        let width = foc.position_width;
        let inner = FocLoop::new(foc)?.circuit;
        let torque_width = config.torque_width();
        let scale = LawWidths::default().scale;
        let widths = LawWidths { width, stiffness, damping, period_width, scale, torque_width };
        let (torque, current) = (Format::signed(torque_width + 2), Format::signed(foc.code_width + foc.frac + 1));
        Ok(Self::of(KnobCircuit {
            paces: Paces::default(),
            config,
            sync: inner.sync,
            decoder: inner.decoder,
            counter: inner.counter,
            chosen: PositionSelect::new(width)?,
            offset: Displacement::new(width)?,
            wall: Unilateral::new(width)?,
            law: TorqueTable::new(TableConfig { widths, table_bits, shift, torques })?,
            against: TruncatingMultiplier::new(torque, Format::signed(2), current, Overflow::Saturate)?,
            from_zero: inner.from_zero,
            angle: inner.angle,
            stator: inner.stator,
            rotor: inner.rotor,
            control_d: inner.control_d,
            control_q: inner.control_q,
            voltage: inner.voltage,
            duties: inner.duties,
            modulator: inner.modulator,
        }))
    }
}

crate::base::block::data_sheet!(FocKnobLoop = Self::new(KnobConfig::default()));

impl LoopCircuit<51> for KnobCircuit {
    const NAME: &'static str = "foc_knob_loop";
    const INPUTS: usize = 14;
    type In<T> = KnobIn<T>;
    type Out<T> = FocOut<T>;

    fn inputs(&self) -> KnobIn<Signal> {
        KnobIn::of(self)
    }

    fn outputs(&self) -> FocOut<Signal> {
        let three_phase_pwm::Out { a_high, a_low, b_high, b_low, c_high, c_low, trigger, .. } =
            self.modulator.outputs();
        FocOut { a_high, a_low, b_high, b_low, c_high, c_low, trigger }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn rest(&mut self, edge: u64) {
        self.paces.modulator.catch_up(&mut self.modulator, edge);
        self.modulator.rest();
        self.paces.modulator.wake(edge + 1);
    }

    fn described(&self, net: Signal) -> Signal {
        let unit = "2^-FRAC code";
        match net.name {
            "torque" | "texture" => Signal { unit, ..net },
            "target" => Signal { unit, doc: "Wanted current across the rotor's flux", ..net },
            "counted" => Signal { doc: "Position of the encoder, modulo its width", ..net },
            "field" => Signal { doc: "Position from the one with an electrical angle of 0", ..net },
            _ => FocCircuit::told(self.config.foc, net),
        }
    }
}

impl Configured for FocKnobLoop {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(KnobConfig::given(given)?)
    }
}

impl Listed for FocKnobLoop {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let short = KnobConfig {
            foc: FocConfig::short(),
            stiffness: Format::new(false, 3, 2).expect("5 bits"),
            damping: Format::new(false, 4, 1).expect("5 bits"),
            period_width: 5,
            table_bits: 2,
            shift: 1,
            torques: TableConfig::default().torques.map(|torque| torque / 20),
        };
        Ok(vec![("short", Self::new(short)?)])
    }
}
