//! A scene of one axis: a motor or a mass, its wall, its method, its hand.

mod file;
pub(crate) mod library;
pub(crate) mod network;
pub(crate) mod network_rows;
pub(crate) mod parts;
pub(crate) mod read;
pub(crate) mod read_device;
pub(crate) mod read_hand;
mod read_method;
pub(crate) mod read_model;
pub(crate) mod rows;
pub(crate) mod sensors;
pub(crate) mod shipped;
pub(crate) mod words;

use std::sync::Arc;

use hpu_plant::Bridge;

use crate::faults::Faults;
use crate::head::accuracy::Output;
use crate::head::miss::Miss;
use crate::head::model::{BridgeModel, Model, Solver};
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};
use crate::path::{AxisTarget, moves_until_s};
use network::Compound;
use parts::{Amplifier, Device, Encoder, Hand, Method, Wall};

/// Returns the angle at the start: the device's, or the first angle of a hand that imposes the angle.
pub(crate) fn initial_angle_rad(hand: &Hand, device: &Device) -> f64 {
    match (hand, device) {
        (Hand::Prescribed { path }, _) => path.first().map_or(0.0, |point| point.angle_rad),
        (_, Device::Motor(motor)) => motor.initial_angle_rad,
        (_, Device::Mass(mass)) => mass.initial_position_m,
    }
}

/// One experiment on an axis, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// The part that every scene has.
    pub head: Head,
    /// The device that the hand holds; of a network what its body with the encoder shows if all joints are rigid.
    pub device: Device,
    /// The bodies and joints of a network.
    pub network: Option<Arc<Compound>>,
    /// The encoder on the shaft, or along the rail.
    pub encoder: Encoder,
    /// The H-bridge of a motor.
    pub bridge: Bridge,
    /// The force amplifier of a mass; the linear law needs none.
    pub amplifier: Option<Amplifier>,
    /// The method that closes the loop.
    pub method: Method,
    /// The virtual wall; of a method that follows a target, a wall on both of its sides: where the target begins, with
    /// the proportional and the derivative gain.
    pub wall: Wall,
    /// The target, if the method follows one.
    pub target: Option<Arc<AxisTarget>>,
    /// Clocks from a command to the converter that takes it: those of a host between both.
    pub host_clocks: u64,
    /// The hand, which moves the device.
    pub hand: Hand,
    /// The faults between device and logic.
    pub faults: Option<Faults>,
    /// The parts of the physics that are modelled.
    pub model: Model,
}

has_head!(Scene);

impl Scene {
    /// Returns the shaft angle at the start: the device's, or the first angle of a hand that imposes the angle.
    pub fn initial_angle_rad(&self) -> f64 {
        match self.network.as_deref() {
            Some(network) => network.start(),
            None => initial_angle_rad(&self.hand, &self.device),
        }
    }

    /// Returns the wall in the units in which the scene writes it.
    pub fn written_wall(&self) -> Wall {
        self.wall.in_units_of(1.0 / self.scale())
    }

    /// Returns the sample period in whole clocks.
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// Returns the clocks of a period of the modulator, if its gates drive the device. Periods begin at the edges after
    /// multiples of that number.
    pub fn modulator_clocks(&self) -> Option<u64> {
        let switches = self.has_bridge() && self.model.bridge == BridgeModel::Switching;
        switches.then(|| 1 << self.method.pwm.bits)
    }

    /// Returns whether a bridge drives the device: a motor, or a network without a converter.
    pub fn has_bridge(&self) -> bool {
        let is_motor = matches!(self.device, Device::Motor(_));
        self.network.as_deref().map_or(is_motor, |network| network.dac.is_none())
    }

    /// Returns the solver's step in whole clocks, at least one: a sample period if the scene sets no step.
    pub fn step_clocks(&self) -> u64 {
        self.model.step_s.map_or(self.period_clocks(), |step_s| self.clock.edges(step_s).max(1))
    }

    /// Returns the time span over which a sampled velocity counts, in s: a velocity word of 1 is one count in this
    /// time.
    pub fn velocity_span_s(&self) -> f64 {
        self.method.kind.features().velocity_samples * self.sample_period_s()
    }

    /// Returns the sample period in seconds, as the clock realises it.
    pub fn sample_period_s(&self) -> f64 {
        self.period_clocks() as f64 / self.clock.frequency_hz() as f64
    }
}

impl Setup for Scene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        self.network.as_deref().map_or(self.device.units(), |network| network.wall_units)
    }

    fn scale(&self) -> f64 {
        self.network.as_deref().map_or(1.0, |network| network.wall_ratio)
    }

    fn outputs(&self) -> &'static [Output] {
        &Output::OF_AN_AXIS
    }

    fn wall_position(&self) -> f64 {
        self.wall.position_rad
    }

    fn hand_path(&self) -> Vec<(f64, f64)> {
        self.hand.path()
    }

    fn still_from_s(&self) -> f64 {
        let target_s = self.target.as_ref().map_or(0.0, |target| target.moves_until_s());
        target_s.max(moves_until_s(&self.hand.path()))
    }

    fn stiffness_error(&self) -> Option<f64> {
        let words = if self.wall.stiffness_nm_per_rad > 0.0 { self.words().ok()? } else { return None };
        Some(words.realised.stiffness_error)
    }

    fn stiffness_miss(&self) -> Option<Miss> {
        self.words().ok()?.realised.stiffness_miss
    }

    fn stiffness_format(&self) -> Option<&'static str> {
        Some("method.stiffness_format")
    }
}
