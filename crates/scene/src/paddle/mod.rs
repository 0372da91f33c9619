//! A scene whose loop is that of EPFL's haptic paddle (`method.kind = "epfl_paddle"`): two controllers of a
//! microcontroller, as fixed-point logic, around a device of bodies and joints.

pub(crate) mod read;
pub(crate) mod rows;
mod words;

use std::sync::Arc;

use hpu_plant::Bridge;

use crate::axis::network::Compound;
use crate::axis::parts::{Device, Encoder, Hand};
use crate::faults::Faults;
use crate::head::accuracy::Output;
use crate::head::model::{BridgeModel, Friction, Solver};
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};

pub use words::{PaddleFloats, PaddleWords};

/// The two controllers, in SI units. What the firmware takes for granted (its periods, the motor's constants) is here,
/// whatever the device is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PaddleMethod {
    /// Index of the current among the network's sensors.
    pub current: usize,
    /// Index of the angle among them; `None`: the encoder.
    pub position: Option<usize>,
    /// The wanted angle.
    pub target_rad: f64,
    /// Time from which on it is wanted.
    pub target_from_s: f64,
    /// Gains of the error in N·m/rad, of its integral in N·m/(rad·s), and of the speed in N·m·s/rad, at the paddle.
    pub gains: [f64; 3],
    /// Cut-off of the angle's filter.
    pub cutoff_hz: f64,
    /// Angle that a code of an absolute sensor is taken for.
    pub code_rad: f64,
    /// Turns of the motor for one of the paddle.
    pub reduction: f64,
    /// Torque of an ampere at the motor.
    pub torque_constant_nm_per_a: f64,
    /// Greatest torque at the motor.
    pub torque_limit_nm: f64,
    /// Codes whose mean is taken.
    pub window: u32,
    /// Whether the current without a duty is the controller's 0.
    pub calibrated: bool,
    /// Share of a new mean in the current's filter.
    pub current_share: f64,
    /// Volts for an ampere of error, and volts a second for it.
    pub current_gains: [f64; 2],
    /// Limit of the integral.
    pub integral_limit_v: f64,
    /// Volts for an ampere of the wanted current.
    pub feed_forward_ohm: f64,
    /// Greatest duty.
    pub duty_limit: f64,
    /// Period of the current controller.
    pub current_period_s: f64,
    /// Period of the position controller.
    pub haptic_period_s: f64,
}

/// The physics that is modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PaddleModel {
    /// The solver of the motion.
    pub solver: Solver,
    /// Coulomb friction.
    pub friction: Friction,
    /// The bridge.
    pub bridge: BridgeModel,
    /// Whether the firmware computes in float32, in the place of the words.
    pub in_floats: bool,
}

/// A scene of the paddle's loop, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct PaddleScene {
    /// The part that every scene has.
    pub head: Head,
    /// The device that the encoder sees if all joints are rigid.
    pub device: Device,
    /// The bodies and joints.
    pub network: Arc<Compound>,
    /// The encoder.
    pub encoder: Encoder,
    /// The bridge.
    pub bridge: Bridge,
    /// The hand.
    pub hand: Hand,
    /// The two controllers.
    pub method: PaddleMethod,
    /// The faults between device and logic.
    pub faults: Option<Faults>,
    /// The parts of the physics that are modelled.
    pub model: PaddleModel,
}

has_head!(PaddleScene);

impl Setup for PaddleScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        self.device.units()
    }

    fn outputs(&self) -> &'static [Output] {
        &Output::OF_AN_AXIS
    }

    fn hand_path(&self) -> Vec<(f64, f64)> {
        // The motion is judged after the target's step.
        let asked = [(0.0, self.network.start()), (self.method.target_from_s, self.method.target_rad)];
        if self.method.target_from_s > 0.0 { asked.into() } else { self.hand.path() }
    }
}
