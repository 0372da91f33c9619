//! Scenes: one TOML file is one experiment, on an axis or on a PHANToM ([`phantom`]).
//!
//! A scene says first, in prose, what to look for (`about`), then names the device, the transducers, the clock, the
//! method, the wall, the hand, the physics that is modelled, the duration, the recording and the expected results.
//! Everything is validated before anything runs. Quantities are numbers in SI units or strings with a unit (`"25.175
//! MHz"`). Angles are those of the motor's shaft, positive into the wall; the wheel turns by the shaft's angle over
//! `wheel_ratio`.
//!
//! The dots of a unit may be left out (`"1.2 mNm"`). A word format is `"(S,I,F)"`, or a notation of other tools:
//! `"UQ4.8"`, `"ufix12_En8"` and all others that [`Format`](hpu_signal::Format) reads. `"Q4.8"` is TI's notation: its 4
//! integer bits do not include the sign bit.
//!
//! A scene of an axis may have a design of the user's own, a [`Dut`], in the place of `[method]`. Its `[wall]` then has
//! `position` and `varies`, the key of the generic or constant that makes the wall stiffer; its `[model]` has only the
//! keys of friction; its `[hand]` is no recording.
//!
//! A scene whose device is a mass is the textbooks' translational one: its positions are in metres and its efforts in
//! newtons, in the same fields (`rad` then reads `m`, `nm` reads `n`). An ideal amplifier follows its command at once.
//! With an amplifier or an averaged bridge no modulator runs: its gates would drive nothing, and stay 0. The linear law
//! needs neither encoder nor amplifier.
//!
//! # Keys
//!
#![doc = include_str!("keys.md")]
//!
//! # Sizes
//!
//! A quantity that is finite but absurd is refused, with the accepted range in the message. Between the bounds
//! everything that a run computes stays finite and resolved: `f64` tells the counts of the finest encoder apart at the
//! farthest place, double-double follows the fastest mode through the longest run, and a word fits in 64 bits.
//! Published devices are orders of magnitude away from either end. A quantity of either sign is accepted down to 0. A
//! quantity without a sign is accepted from its least size on, or also at 0 where that has a meaning. Some keys have
//! narrower bounds of their own; the messages state them.
//!
//! | Quantity | least | greatest | unit |
//! |---|---|---|---|
//! | a time | 1e-12 | 1e9 | s |
//! | a frequency | 1e-6 | 1e10 | Hz |
//! | an angle | 1e-12 | 1e6 | rad |
//! | an angular speed | 1e-9 | 1e5 | rad/s |
//! | a torque | 1e-12 | 1e4 | N.m |
//! | a torsional stiffness | 1e-12 | 1e6 | N.m/rad |
//! | a torsional damping | 1e-15 | 1e3 | N.m.s/rad |
//! | a moment of inertia | 1e-12 | 1e3 | kg.m2 |
//! | a voltage | 1e-6 | 1e5 | V |
//! | a current | 1e-9 | 1e5 | A |
//! | a resistance | 1e-6 | 1e6 | Ohm |
//! | an inductance | 1e-9 | 1e3 | H |
//! | a torque constant | 1e-6 | 1e3 | N.m/A |
//! | a length | 1e-12 | 1e4 | m |
//! | a speed | 1e-9 | 1e4 | m/s |
//! | a force | 1e-9 | 1e6 | N |
//! | a stiffness | 1e-6 | 1e9 | N/m |
//! | a damping | 1e-9 | 1e6 | N.s/m |
//! | a mass | 1e-6 | 1e6 | kg |
//! | an energy | 1e-15 | 1e9 | J |
//! | a plain number | 1e-9 | 1e12 | 1 |
//!
//! No speed may pass more than 1000 encoder counts in one clock edge: neither the speed at the start nor one that a
//! hand imposes. A run ends when a motion has left the 2^52 counts to either side that an encoder can tell apart.

mod accuracy;
mod audit;
mod dut;
mod expect;
mod faults;
pub mod keys;
mod law;
mod model;
mod parameter;
mod parts;
pub mod phantom;
mod quantity;
mod read;
mod read_device;
mod read_dut;
mod read_faults;
mod read_hand;
mod read_method;
mod read_model;
mod read_phantom;
mod resolved;
mod section;
mod shipped;
mod source;
mod words;

pub use accuracy::{Accuracy, Output};
pub use dut::{Connection, Driving, Dut, DutClock, DutReset, DutScene, Engine, Generic, Line, SourceFile, Standard};
pub use expect::{Expect, Expectation, Metric, OutcomeKind};
pub use faults::{EncoderLine, Faults, Stuck, Switch, Times};
pub use law::{LawMethod, SampledWallMethod};
pub use model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
pub use parameter::{Origin, Parameter, ParameterValue};
pub use parts::{
    Amplifier, AnalogShaper, Bridge, Device, Encoder, Hand, Loop, Mass, Method, Motor, PathPoint, Pwm, Ramp, Record,
    Run, Units, Wall,
};
pub use phantom::{
    Direction, Drop, Irregularity, PhantomLaw, PhantomMethod, PhantomModel, PhantomScene, PhantomWords, Platform,
    Premium, Room,
};
pub use resolved::{Resolved, ValueSource, as_scene, resolved};
pub use shipped::{Shipped, shipped, shipped_file};
pub use source::SceneError;
pub use words::{LoopWords, Miss, Realised};

use std::sync::Arc;

use hpu_datapath::Estimator;
use hpu_signal::Clock;

use read_device::DeviceKind;
use source::{Places, Source};

/// The most clock edges that a run may last; a [`hpu_signal::Cycle`] holds them with room to spare.
pub const MOST_EDGES: u64 = 1 << 62;

/// Any experiment.
#[derive(Clone, PartialEq, Debug)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum Experiment {
    /// One axis: a motor with a wheel, and a wall.
    Axis(Scene),
    /// The three axes of a PHANToM.
    Phantom(PhantomScene),
    /// One axis whose loop is closed by a design of the user's own.
    Dut(DutScene),
}

impl Experiment {
    /// Parses and validates a scene of any kind, as [`Scene::parse`] does.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides)?;
        Self::read(name, &source, load).map_err(|first| audit::with_others(&source, first))
    }

    fn read(
        name: &str,
        source: &Source,
        load: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        if source.root().section("device")?.read(&keys::device::kind)? == DeviceKind::Phantom {
            return read_phantom::phantom_scene(name, source).map(Self::Phantom);
        }
        if source.root().has("dut") {
            return read_dut::dut_scene(name, source, load).map(Self::Dut);
        }
        read::scene(name, source, load).map(Self::Axis)
    }

    /// Returns the scene if it is one of an axis.
    #[must_use]
    pub fn axis(self) -> Option<Scene> {
        match self {
            Self::Axis(scene) => Some(scene),
            Self::Phantom(_) | Self::Dut(_) => None,
        }
    }

    /// Returns the scene if it is one of a PHANToM.
    #[must_use]
    pub fn phantom(self) -> Option<PhantomScene> {
        match self {
            Self::Phantom(scene) => Some(scene),
            Self::Axis(_) | Self::Dut(_) => None,
        }
    }

    /// Returns its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Axis(scene) => &scene.name,
            Self::Phantom(scene) => &scene.name,
            Self::Dut(scene) => &scene.name,
        }
    }

    /// Returns the text about what the scene shows and what to look for.
    #[must_use]
    pub fn about(&self) -> &str {
        match self {
            Self::Axis(scene) => &scene.about,
            Self::Phantom(scene) => &scene.about,
            Self::Dut(scene) => &scene.about,
        }
    }

    /// Returns the FPGA's clock.
    #[must_use]
    pub fn clock(&self) -> Clock {
        match self {
            Self::Axis(scene) => scene.clock,
            Self::Phantom(scene) => scene.clock,
            Self::Dut(scene) => scene.clock,
        }
    }

    /// Returns the duration in clock edges.
    #[must_use]
    pub fn edges(&self) -> u64 {
        match self {
            Self::Axis(scene) => scene.edges(),
            Self::Phantom(scene) => scene.edges(),
            Self::Dut(scene) => scene.edges(),
        }
    }

    /// Returns whether the model is left to `hpu fit`: `model = "auto"`.
    #[must_use]
    pub fn auto(&self) -> bool {
        match self {
            Self::Axis(scene) => scene.auto,
            Self::Phantom(scene) => scene.auto,
            Self::Dut(_) => false,
        }
    }

    /// Returns the expected results of the run.
    #[must_use]
    pub fn expect(&self) -> &Expect {
        match self {
            Self::Axis(scene) => &scene.expect,
            Self::Phantom(scene) => &scene.expect,
            Self::Dut(scene) => &scene.expect,
        }
    }

    /// Returns every parameter of the run, as the scene was read, with its origin.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        match self {
            Self::Axis(scene) => &scene.parameters,
            Self::Phantom(scene) => &scene.parameters,
            Self::Dut(scene) => &scene.parameters,
        }
    }

    /// Returns the outputs by which models of the scene are compared.
    #[must_use]
    pub fn accuracy(&self) -> &Accuracy {
        match self {
            Self::Axis(scene) => &scene.accuracy,
            Self::Phantom(scene) => &scene.accuracy,
            Self::Dut(scene) => &scene.accuracy,
        }
    }
}

/// One experiment on an axis, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// Name: that of the file, without folder and extension.
    pub name: String,
    /// The text about what the scene shows and what to look for.
    pub about: String,
    /// The device that the hand holds.
    pub device: Device,
    /// The encoder on the shaft, or along the rail.
    pub encoder: Encoder,
    /// The H-bridge of a motor.
    pub bridge: Bridge,
    /// The force amplifier of a mass; the linear law needs none.
    pub amplifier: Option<Amplifier>,
    /// The FPGA clock.
    pub clock: Clock,
    /// The method that closes the loop.
    pub method: Method,
    /// The virtual wall.
    pub wall: Wall,
    /// The hand, which moves the device.
    pub hand: Hand,
    /// The faults between device and logic.
    pub faults: Option<Faults>,
    /// The parts of the physics that are modelled.
    pub model: Model,
    /// Duration and seed of the run.
    pub run: Run,
    /// Settings of the recording.
    pub record: Record,
    /// The expected results of the run.
    pub expect: Expect,
    /// The outputs by which models of the scene are compared.
    pub accuracy: Accuracy,
    /// Whether the model is left to `hpu fit` (`model = "auto"`); the fields of `model` then hold the defaults.
    pub auto: bool,
    /// Every parameter of the run, as the scene was read, with its origin.
    pub parameters: Arc<[Parameter]>,
    places: Places,
}

impl Scene {
    /// Parses and validates a scene.
    ///
    /// `name` is the file's name in error messages. `overrides` are keys and values that replace the file's, in order,
    /// as in `("wall.stiffness", "2 N.m/rad")`. A value that is not TOML is a string; missing sections are created; an
    /// inline table replaces a whole section (`("hand", "{ kind = \"none\" }")`). `load` reads a file that the scene
    /// names.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides)?;
        read::scene(name, &source, load).map_err(|first| audit::with_others(&source, first))
    }

    /// Returns the duration in clock edges.
    #[must_use]
    pub fn edges(&self) -> u64 {
        self.clock.edges(self.run.duration_s)
    }

    /// Returns the shaft angle at the start: the device's, or the first angle of a hand that imposes the angle.
    #[must_use]
    pub fn initial_angle_rad(&self) -> f64 {
        match (&self.hand, &self.device) {
            (Hand::Prescribed { path }, _) => path.first().map_or(0.0, |point| point.angle_rad),
            (_, Device::Motor(motor)) => motor.initial_angle_rad,
            (_, Device::Mass(mass)) => mass.initial_position_m,
        }
    }

    /// Returns the sample period in whole clocks.
    #[must_use]
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// Returns the clocks of a period of the modulator, if its gates drive the device. Periods begin at the edges after
    /// multiples of that number.
    #[must_use]
    pub fn modulator_clocks(&self) -> Option<u64> {
        let switches = matches!(self.device, Device::Motor(_)) && self.model.bridge == BridgeModel::Switching;
        switches.then(|| 1 << self.method.pwm.bits)
    }

    /// Returns the solver's step in whole clocks, at least one: a sample period if the scene sets no step.
    #[must_use]
    pub fn step_clocks(&self) -> u64 {
        self.model.step_s.map_or(self.period_clocks(), |step_s| self.clock.edges(step_s).max(1))
    }

    /// Returns the time span over which a sampled velocity counts, in s.
    pub(crate) fn velocity_span_s(&self) -> f64 {
        let samples = match self.method.kind {
            Loop::Law(LawMethod::SampledWall(wall)) => {
                let window = if wall.estimator == Estimator::Window { wall.window } else { 1 };
                f64::from(wall.ratio) * f64::from(window)
            }
            _ => 1.0,
        };
        samples * self.sample_period_s()
    }

    /// Returns an error at one of the scene's keys.
    #[must_use]
    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(key, reason)
    }

    /// Returns the sample period in seconds, as the clock realises it.
    #[must_use]
    pub fn sample_period_s(&self) -> f64 {
        self.period_clocks() as f64 / self.clock.frequency_hz() as f64
    }
}
