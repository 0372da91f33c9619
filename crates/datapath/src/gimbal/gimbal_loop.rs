//! The loop of the segment on a gimbal: inverse kinematics, three servos, and the crank's switch to impedance control.
//!
//! - **Ports**: `count1` `count2` `count3` (1,COUNT_WIDTH-1,0) of the servos of pitch, roll and crank, `finger_force`
//!   (0,FORCE_WIDTH,0), the target `x` `y` `z` (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) in metres, the gains
//!   `proportional` `derivative` of pitch and roll, `crank_proportional` `crank_derivative`, `stiffness`, `feedback`,
//!   `threshold_on` `threshold_off`, `period` (0,PERIOD_WIDTH,0) in clocks, `shear_gain` in; `drive1` `drive2` `drive3`
//!   (1,DRIVE_WIDTH-1,0), `mode` (0,1,0) out. Formats are those of the blocks. This loop does not read `shear_gain`.
//! - **Latency**: `3 ROTATIONS + LENGTH_WIDTH + 13` edges from a sample of the target to the joints; 1 more to the
//!   drives of pitch and roll and to the mode, 2 more to the drive of the crank. The counts and the force are read with
//!   the joints, the target at the sample.
//! - **Reset**: all registers 0. The first edge after it raises the sample strobe, the second samples.
//! - **Overflow**: of its blocks. A period shorter than the latency starts the kinematics again before it ends:
//!   [`GimbalLoopConfig::least_period`].
//! - **VHDL twin**: `hdl/gimbal_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: Pediredla, Chandrasekaran, Annamraju, Thondiyath.
//! - **Differs from the hardware**: the paper computes on a host. Combinational paths settle within the clock they
//!   change in, whatever their length.

use hpu_signal::Signal;

use super::{
    ControlSwitch, CrankTable, GimbalInverse, GimbalLoopConfig, ImpedanceControl, ServoControl, control_switch,
    crank_table, gimbal_inverse, impedance_control, servo_control,
};
use crate::base::listed::{Configured, Given, Listed};
use crate::circuit::circuit;
use crate::circuit::circuit_loop::{CircuitLoop, LoopCircuit};
use crate::{
    Block, ConfigError, FractionalDifference, Generic, SampleTimer, gimbal::fractional_difference, gimbal::sample_timer,
};

hpu_signal::ports! {
    /// Inputs of a gimbal's loop: the servos' counts, the finger's force, and the words that the scene sets.
    pub struct GimbalIn of[const SHEAR: bool] |block: &GimbalCircuit<SHEAR>| {
        count1 = block.servo1.inputs().count, "Position word of the servo of pitch";
        count2 = block.servo2.inputs().count, "Position word of the servo of roll";
        count3 = block.servo3.inputs().count, "Position word of the servo of the crank";
        finger_force = block.impedance.inputs().finger_force;
        x = block.inverse.inputs().x;
        y = block.inverse.inputs().y;
        z = block.inverse.inputs().z;
        proportional = block.servo1.inputs().proportional;
        derivative = block.servo1.inputs().derivative;
        crank_proportional = block.servo3.inputs().proportional, "Gain of the crank's error";
        crank_derivative = block.servo3.inputs().derivative, "Gain of its change in a window";
        stiffness = block.impedance.inputs().stiffness;
        feedback = block.impedance.inputs().feedback;
        threshold_on = block.switch.inputs().threshold_on;
        threshold_off = block.switch.inputs().threshold_off;
        period = block.timer.inputs().period;
        shear_gain = block.shear.inputs().gain, "Gain of the fractional derivative of x";
    }
    /// Outputs of a gimbal's loop: the drives of the servos, and whether the crank is under impedance control.
    pub struct GimbalOut of[const SHEAR: bool] |block: &GimbalCircuit<SHEAR>| {
        drive1 = block.servo1.outputs().drive, "Command of the servo of pitch";
        drive2 = block.servo2.outputs().drive, "Command of the servo of roll";
        drive3 = block.servo3.outputs().drive, "Command of the servo of the crank";
        mode = block.switch.outputs().mode;
    }
}

/// The loop without shear. See the [module](self).
pub type GimbalLoop = GimbalWiring<false>;

/// A gimbal's loop. With `SHEAR` ([`GimbalShearLoop`](super::GimbalShearLoop)) the kinematics follow a fractional
/// derivative of the target `x`, otherwise `x` itself.
pub type GimbalWiring<const SHEAR: bool> = CircuitLoop<GimbalCircuit<SHEAR>, 35>;

circuit! {
    /// The blocks of a gimbal's loop.
    pub struct GimbalCircuit[const SHEAR: bool][SHEAR][35] { config: GimbalLoopConfig }
    nets {
        count1, count2, count3, finger_force, x, y, z, proportional, derivative, crank_proportional, crank_derivative,
        stiffness, feedback, threshold_on, threshold_off, period, shear_gain,
        drive1, drive2, drive3, mode,
        sample, shear_x if SHEAR else x, pitch, roll, crank, rest, out_of_reach, busy, ready,
        position_drive, radius, slope, impedance_drive, equilibrium,
    }
    timer: SampleTimer = sample_timer { period } -> { sample };
    shear: FractionalDifference = fractional_difference { u: x, gain: shear_gain, sample } -> { y: shear_x } if SHEAR;
    inverse: GimbalInverse = gimbal_inverse { start: sample, x: shear_x, y, z }
        -> { pitch, roll, crank, radius: rest, out_of_reach, busy, ready };
    servo1: ServoControl = servo_control { desired: pitch, count: count1, proportional, derivative, sample: ready }
        -> { drive: drive1 };
    servo2: ServoControl = servo_control { desired: roll, count: count2, proportional, derivative, sample: ready }
        -> { drive: drive2 };
    servo3: ServoControl = servo_control {
        desired: crank, count: count3, proportional: crank_proportional, derivative: crank_derivative, sample: ready,
    } -> { drive: position_drive };
    lever: CrankTable = crank_table { count: count3 } -> { radius, slope };
    impedance: ImpedanceControl = impedance_control {
        rest: equilibrium, radius, slope, finger_force, stiffness, feedback,
    } -> { drive: impedance_drive };
    switch: ControlSwitch = control_switch {
        position_drive, impedance_drive, finger_force, threshold_on, threshold_off, radius, rest, sample: ready,
    } -> { drive: drive3, mode, equilibrium };
}

impl<const SHEAR: bool> GimbalWiring<SHEAR> {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words.
    pub fn new(config: GimbalLoopConfig) -> Result<Self, ConfigError> {
        let servo = ServoControl::new(config.servo())?;
        Ok(Self::of(GimbalCircuit {
            paces: Paces::default(),
            config,
            timer: SampleTimer::new(config.period_width)?,
            shear: FractionalDifference::new(config.shear())?,
            inverse: GimbalInverse::new(config.gimbal)?,
            servo1: servo.clone(),
            servo2: servo,
            servo3: ServoControl::new(config.crank())?,
            lever: CrankTable::new(config.gimbal)?,
            impedance: ImpedanceControl::new(config.impedance())?,
            switch: ControlSwitch::new(config.switch())?,
        }))
    }
}

impl<const SHEAR: bool> Default for GimbalWiring<SHEAR> {
    fn default() -> Self {
        Self::new(GimbalLoopConfig::default()).expect("the data sheet's default")
    }
}

impl<const SHEAR: bool> LoopCircuit<35> for GimbalCircuit<SHEAR> {
    const NAME: &'static str = if SHEAR { "gimbal_shear_loop" } else { "gimbal_loop" };
    const INPUTS: usize = 17;
    crate::base::block::described!(GimbalIn, GimbalOut);

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics(SHEAR)
    }

    fn described(&self, net: Signal) -> Signal {
        let doc = match net.name {
            "shear_x" => {
                return Signal { name: "shear_x", doc: "Target of the sheared tip", ..self.inverse.inputs().x };
            }
            "rest" => "Desired radius",
            "position_drive" => "Drive of the position control",
            "impedance_drive" => "Drive of the impedance control",
            _ => net.doc,
        };
        Signal { doc, ..net }
    }
}

impl<const SHEAR: bool> Configured for GimbalWiring<SHEAR> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(GimbalLoopConfig::given(given)?)
    }
}

impl<const SHEAR: bool> Listed for GimbalWiring<SHEAR> {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![
            ("plain", Self::new(GimbalLoopConfig::plain())?),
            ("short", Self::new(GimbalLoopConfig::short())?),
            ("distinct", Self::new(GimbalLoopConfig::distinct())?),
        ])
    }
}
