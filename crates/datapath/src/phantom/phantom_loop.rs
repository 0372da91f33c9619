//! A three-joint haptic loop in parallel hardware: encoders, sample, sines, kinematics, a room of walls, torques,
//! commands.
//!
//! - **Ports**: `a_pin1` `b_pin1` `a_pin2` `b_pin2` `a_pin3` `b_pin3`, the walls `x_low` `x_high` `y_low` `y_high`
//!   `z_low` `z_high`, `room`, `stiffness`, `period` in; `command1` `command2` `command3` out.
//! - **Latency**: 4 edges from a pin to its position, up to `period` to its sample, and `DELAY` from there to the
//!   commands, which must be at least 2: sample, sines, and all the rest combinational.
//! - **Reset**: all registers 0. **Overflow**: of its blocks.
//! - **VHDL twin**: `hdl/phantom_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: Sevcik et al. 2009.
//! - **Differs from the hardware**: combinational paths settle within the clock they change in, whatever their length;
//!   DELAY is the time a real one would be given.

use hpu_signal::Signal;

use super::force_path::ForcePath;
use super::variants::loops;
use super::{
    CommandRegister, CommandScaler, Config, CubeRoom, PhantomEngine, PhantomForward, PhantomTorque, SampleRegister,
    TrigTable, command_register, command_scaler, cube_room, phantom_engine, phantom_forward, phantom_torque,
    sample_register,
};
use crate::base::listed::{Configured, Given, Listed};
use crate::circuit::circuit;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit};
use crate::{
    Block, ConfigError, Generic, PositionCounter, QuadratureDecoder, Synchronizer, flatten, pins::position_counter,
    pins::quadrature_decoder, pins::synchronizer,
};

hpu_signal::ports! {
    /// Inputs of a PHANToM loop: the encoders' pins and the words that the scene sets.
    pub struct PhantomIn of[const SHARED: bool] |block: &PhantomCircuit<SHARED>| {
        a_pin1 = block.sync1.inputs().a_pin;
        b_pin1 = block.sync1.inputs().b_pin;
        a_pin2 = block.sync2.inputs().a_pin;
        b_pin2 = block.sync2.inputs().b_pin;
        a_pin3 = block.sync3.inputs().a_pin;
        b_pin3 = block.sync3.inputs().b_pin;
        x_low = block.room_walls.inputs().x_low;
        x_high = block.room_walls.inputs().x_high;
        y_low = block.room_walls.inputs().y_low;
        y_high = block.room_walls.inputs().y_high;
        z_low = block.room_walls.inputs().z_low;
        z_high = block.room_walls.inputs().z_high;
        room = block.room_walls.inputs().room;
        stiffness = block.room_walls.inputs().stiffness;
        period = block.sample.inputs().period;
    }
    /// Outputs of a PHANToM loop: the motors' commands.
    pub struct PhantomOut of[const SHARED: bool] |block: &PhantomCircuit<SHARED>| {
        command1 = block.engine.outputs().command1;
        command2 = block.engine.outputs().command2;
        command3 = block.engine.outputs().command3;
    }
}

/// The loop in parallel hardware. See the [module](self).
pub type PhantomLoop = PhantomWiring<false>;

/// A PHANToM loop. The two loops share the nets up to the sines and have the same words after them. With `SHARED`
/// ([`PhantomSharedLoop`](super::PhantomSharedLoop)), an engine computes these words one product after another;
/// otherwise they settle as combinational logic.
pub type PhantomWiring<const SHARED: bool> = CircuitLoop<PhantomCircuit<SHARED>, 59>;

/// The ports of a source of sine and cosine.
mod trig {
    pub(super) use super::super::{TrigIn as In, TrigOut as Out};
}

circuit! {
    /// The blocks of a PHANToM loop.
    pub struct PhantomCircuit[const SHARED: bool][SHARED][59] { config: Config }
    nets {
        a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3,
        x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, period,
        command1, command2, command3,
        a1, b1, a2, b2, a3, b3, step1, error1, step2, error2, step3, error3,
        position1, position2, position3, count1, count2, count3,
        sine1, cosine1, valid1, sine2, cosine2, valid2, sine3, cosine3, valid3,
        x, y, z, radius, force_x, force_y, force_z, contact, torque1, torque2, torque3,
        scaled1 unless SHARED else command1, scaled2 unless SHARED else command2, scaled3 unless SHARED else command3,
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
    sample: SampleRegister = sample_register { position1, position2, position3, period } -> { count1, count2, count3 };
    trig1: TrigTable = trig { count: count1 } -> { sine: sine1, cosine: cosine1, valid: valid1 };
    trig2: TrigTable = trig { count: count2 } -> { sine: sine2, cosine: cosine2, valid: valid2 };
    trig3: TrigTable = trig { count: count3 } -> { sine: sine3, cosine: cosine3, valid: valid3 };
    engine: PhantomEngine = phantom_engine {
        sine1, cosine1, sine2, cosine2, sine3, cosine3, valid1, valid2, valid3,
        x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, period,
    } -> {
        x, y, z, radius, force_x, force_y, force_z, contact, torque1, torque2, torque3, command1, command2, command3,
    } if SHARED;
    forward: PhantomForward = phantom_forward { sine1, cosine1, sine2, cosine2, sine3, cosine3 } -> { x, y, z, radius }
        unless SHARED;
    room_walls: CubeRoom = cube_room { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness }
        -> { force_x, force_y, force_z, contact } unless SHARED;
    jacobian: PhantomTorque = phantom_torque {
        sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, force_x, force_y, force_z,
    } -> { torque1, torque2, torque3 } unless SHARED;
    scale1: CommandScaler = command_scaler { torque: torque1, valid1, valid2, valid3 } -> { command: scaled1 }
        unless SHARED;
    scale2: CommandScaler = command_scaler { torque: torque2, valid1, valid2, valid3 } -> { command: scaled2 }
        unless SHARED;
    scale3: CommandScaler = command_scaler { torque: torque3, valid1, valid2, valid3 } -> { command: scaled3 }
        unless SHARED;
    hold: CommandRegister = command_register { d1: scaled1, d2: scaled2, d3: scaled3, period }
        -> { q1: command1, q2: command2, q3: command3 } unless SHARED;
}

impl<const SHARED: bool> PhantomWiring<SHARED> {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words.
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        let Config { position_width, period_width, depth_width, turns, formats, .. } = config;
        let table = |joint: usize| TrigTable::new(position_width, depth_width, turns[joint], formats.trig);
        let trig2 = table(1)?;
        let trig3 = if turns[2] == turns[1] { trig2.clone() } else { table(2)? };
        let counter = PositionCounter::new(position_width)?;
        let sample = SampleRegister::new(position_width, period_width)?;
        let trig1 = table(0)?;
        let ForcePath { forward, room_walls, jacobian, scale: [scale1, scale2, scale3] } = ForcePath::new(&config)?;
        Ok(Self::of(PhantomCircuit {
            paces: Paces::default(),
            config,
            sync1: Synchronizer::new(),
            sync2: Synchronizer::new(),
            sync3: Synchronizer::new(),
            decoder1: QuadratureDecoder::default(),
            decoder2: QuadratureDecoder::default(),
            decoder3: QuadratureDecoder::default(),
            counter1: counter.clone(),
            counter2: counter.clone(),
            counter3: counter,
            sample,
            trig1,
            trig2,
            trig3,
            engine: PhantomEngine::new(config)?,
            forward,
            room_walls,
            jacobian,
            scale1,
            scale2,
            scale3,
            hold: CommandRegister::new(config.command_width, period_width, config.delay)?,
        }))
    }

    /// Returns a loop whose delay is that of the shared or of the parallel path.
    fn delayed(config: Config) -> Result<Self, ConfigError> {
        Self::new(if SHARED { config.shared() } else { config })
    }
}

impl<const SHARED: bool> Default for PhantomWiring<SHARED> {
    fn default() -> Self {
        Self::delayed(Config::default()).expect("the data sheet's default")
    }
}

impl<const SHARED: bool> LoopCircuit<59> for PhantomCircuit<SHARED> {
    const NAME: &'static str = if SHARED { "phantom_shared_loop" } else { "phantom_loop" };
    const INPUTS: usize = 15;
    crate::base::block::described!(PhantomIn, PhantomOut);

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn described(&self, net: Signal) -> Signal {
        let name = net.name;
        let port = match name {
            "scaled1" => "command1",
            "scaled2" => "command2",
            "scaled3" => "command3",
            name => name,
        };
        let (sample, engine) = (&self.sample, &self.engine);
        let ports = [flatten(&sample.inputs()), flatten(&engine.inputs()), flatten(&engine.outputs())].concat();
        let found = ports.into_iter().find(|known| known.name == port);
        Signal { name, ..found.unwrap_or(net) }
    }
}

impl<const SHARED: bool> Configured for PhantomWiring<SHARED> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(Config::given(given)?)
    }
}

impl<const SHARED: bool> Listed for PhantomWiring<SHARED> {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        loops().into_iter().map(|(label, config)| Ok((label, Self::delayed(config)?))).collect()
    }
}
