//! The part of the FPGA that remains when a host computes the forces: it counts, and drives the motors.
//!
//! - **Equation**: `position_i` counts the quadrature steps of `a_pin_i`, `b_pin_i`; `command_i` is `host_i` an edge
//!   later.
//! - **Ports**: `a_pin1` `b_pin1` `a_pin2` `b_pin2` `a_pin3` `b_pin3`, `host1` `host2` `host3` (1,COMMAND_WIDTH-1,0) in
//!   DAC counts, in; `position1` `position2` `position3` (0,POSITION_WIDTH,0), `command1` `command2` `command3`
//!   (1,COMMAND_WIDTH-1,0) out.
//! - **Latency**: 4 edges from a pin to its position, 1 from the host to a command.
//! - **Reset**: all registers 0. **Overflow**: positions wrap.
//! - **VHDL twin**: `hdl/phantom_io.vhd`, whose instances and nets have these names. The `period` of `hold` is tied to
//!   1 and connected to no net.
//! - **Source**: the host platforms that Sevcik et al. 2009 compare with.
//! - **Differs from the hardware**: the bus between host and FPGA is not in it; the time it takes is a part of the
//!   host's delay.

use super::{CommandRegister, command_register};
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::natural;
use crate::circuit::circuit;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit};
use crate::{
    Block, ConfigError, Generic, PositionCounter, QuadratureDecoder, Synchronizer, pins::position_counter,
    pins::quadrature_decoder, pins::synchronizer,
};

hpu_signal::ports! {
    /// Inputs of the wiring: the encoders' pins and the host's commands.
    pub struct PhantomIoIn of |block: &PhantomIoCircuit| {
        a_pin1 = block.sync1.inputs().a_pin;
        b_pin1 = block.sync1.inputs().b_pin;
        a_pin2 = block.sync2.inputs().a_pin;
        b_pin2 = block.sync2.inputs().b_pin;
        a_pin3 = block.sync3.inputs().a_pin;
        b_pin3 = block.sync3.inputs().b_pin;
        host1 = block.hold.inputs().d1, "The host's command of motor 1";
        host2 = block.hold.inputs().d2, "The host's command of motor 2";
        host3 = block.hold.inputs().d3, "The host's command of motor 3";
    }
    /// Outputs of the wiring: positions for the host, commands for the motors.
    pub struct PhantomIoOut of |block: &PhantomIoCircuit| {
        position1 = block.counter1.outputs().position, "Position of joint 1, modulo its width";
        position2 = block.counter2.outputs().position, "Position of joint 2, modulo its width";
        position3 = block.counter3.outputs().position, "Position of joint 3, modulo its width";
        command1 = block.hold.outputs().q1, "Command of motor 1";
        command2 = block.hold.outputs().q2, "Command of motor 2";
        command3 = block.hold.outputs().q3, "Command of motor 3";
    }
}

/// See the [module](self).
pub type PhantomIo = CircuitLoop<PhantomIoCircuit, 27>;

circuit! {
    /// The blocks of the wiring.
    pub struct PhantomIoCircuit[][][27] { position_width: u32, command_width: u32 }
    nets {
        a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3, host1, host2, host3,
        position1, position2, position3, command1, command2, command3,
        a1, b1, a2, b2, a3, b3, step1, error1, step2, error2, step3, error3,
    }
    sync1: Synchronizer = synchronizer { a_pin: a_pin1, b_pin: b_pin1 } -> { a: a1, b: b1 };
    sync2: Synchronizer = synchronizer { a_pin: a_pin2, b_pin: b_pin2 } -> { a: a2, b: b2 };
    sync3: Synchronizer = synchronizer { a_pin: a_pin3, b_pin: b_pin3 } -> { a: a3, b: b3 };
    decoder1: QuadratureDecoder = quadrature_decoder { a: a1, b: b1 } -> { step: step1, error: error1 };
    decoder2: QuadratureDecoder = quadrature_decoder { a: a2, b: b2 } -> { step: step2, error: error2 };
    decoder3: QuadratureDecoder = quadrature_decoder { a: a3, b: b3 } -> { step: step3, error: error3 };
    counter1: PositionCounter = position_counter { step: step1 } -> { position: position1 };
    counter2: PositionCounter = position_counter { step: step2 } -> { position: position2 };
    counter3: PositionCounter = position_counter { step: step3 } -> { position: position3 };
    hold: CommandRegister = command_register { d1: host1, d2: host2, d3: host3, period = 1 }
        -> { q1: command1, q2: command2, q3: command3 };
}

impl PhantomIo {
    /// Returns a wiring with counters of `position_width` and commands of `command_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless both are 2 to 62.
    pub fn new(position_width: u32, command_width: u32) -> Result<Self, ConfigError> {
        let counter = PositionCounter::new(position_width)?;
        Ok(Self::of(PhantomIoCircuit {
            paces: Paces::default(),
            position_width,
            command_width,
            sync1: Synchronizer::new(),
            sync2: Synchronizer::new(),
            sync3: Synchronizer::new(),
            decoder1: QuadratureDecoder::default(),
            decoder2: QuadratureDecoder::default(),
            decoder3: QuadratureDecoder::default(),
            counter1: counter.clone(),
            counter2: counter.clone(),
            counter3: counter,
            hold: CommandRegister::new(command_width, 2, 0)?,
        }))
    }
}

crate::base::block::data_sheet!(PhantomIo = Self::new(16, 16));

impl LoopCircuit<27> for PhantomIoCircuit {
    const NAME: &'static str = "phantom_io";
    const INPUTS: usize = 9;
    crate::base::block::described!(PhantomIoIn, PhantomIoOut);

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        vec![natural("POSITION_WIDTH", self.position_width), natural("COMMAND_WIDTH", self.command_width)]
    }
}

impl Configured for PhantomIo {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(given.natural("POSITION_WIDTH")?, given.natural("COMMAND_WIDTH")?)
    }
}

impl Listed for PhantomIo {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8, 8)?)])
    }
}
