//! Scenes: one TOML file is one experiment, on an axis or on an arm ([`phantom`]).
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
//! `position`, `wraps` and `varies`, the key of the generic or constant that makes the wall stiffer; its `[model]` has
//! only the keys of friction; its `[hand]` is no recording.
//!
//! A loop takes the distance to its wall modulo `2^position_bits`, as two's complement. A wall whose distance from the
//! start does not fit is refused, with the range that is accepted and the bits that do: the logic would read it
//! elsewhere. `wall.wraps = true` accepts it.
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
//! | an angular acceleration | 1e-6 | 1e9 | rad/s2 |
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
//! | an area | 1e-12 | 1e6 | m2 |
//! | a speed | 1e-9 | 1e4 | m/s |
//! | an acceleration | 1e-6 | 1e9 | m/s2 |
//! | a force | 1e-9 | 1e6 | N |
//! | a stiffness | 1e-6 | 1e9 | N/m |
//! | a damping | 1e-9 | 1e6 | N.s/m |
//! | a mass | 1e-6 | 1e6 | kg |
//! | a viscosity | 1e-9 | 1e12 | Pa.s |
//! | an energy | 1e-15 | 1e9 | J |
//! | a plain number | 1e-9 | 1e12 | 1 |
//!
//! No speed may pass more than 1000 encoder counts in one clock edge: neither the speed at the start nor one that a
//! hand imposes. A run ends when a motion has left the 2^52 counts to either side that an encoder can tell apart.

mod accuracy;
mod audit;
#[macro_use]
mod devices;
mod dut;
mod expect;
mod faults;
pub mod gimbal;
mod head;
mod identifier;
pub mod keys;
mod model;
pub(crate) mod parameter;
mod parts;
mod path;
pub mod phantom;
pub(crate) mod quantity;
mod read;
mod read_device;
mod read_dut;
mod read_faults;
mod read_hand;
mod read_method;
mod read_model;
pub mod replay;
mod resolved;
pub(crate) mod section;
mod setup;
mod shipped;
mod smooth;
pub(crate) mod source;
mod words;

pub use accuracy::{Accuracy, Output};
pub use devices::{BEGINNINGS, KINDS, shipped};
pub use dut::{Connection, Driving, Dut, DutClock, DutReset, DutScene, Engine, Generic, Line, SourceFile, Standard};
pub use expect::{Expect, Expectation, Metric, OutcomeKind};
pub use faults::{EncoderLine, Faults, Stuck, Switch, Times};
pub use gimbal::{
    Displacement, ForceSensor, GimbalMethod, GimbalModel, GimbalScene, GimbalWords, PositionGains, Posture, Probe,
    Servo, Shear, Target, TargetKind, Thresholds,
};
pub use head::Head;
pub use identifier::{Identifier, Language};
pub use model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
pub use parameter::{Origin, Parameter, ParameterValue};
pub(crate) use parts::Push;
pub use parts::{
    Amplifier, AnalogShaper, Device, Encoder, Hand, Mass, Method, Motor, PathPoint, Pwm, Ramp, Record, Run, Units, Wall,
};
pub(crate) use path::positions_along;
pub use path::{along, moves_until_s};
pub use phantom::{
    Direction, Drop, Irregularity, PhantomLaw, PhantomMethod, PhantomModel, PhantomScene, PhantomWords, Platform,
    Premium, Room,
};
pub use resolved::{ChangedDefault, Resolved, ValueSource, WRITTEN_BY_NEW, as_scene, changed_defaults, resolved};
pub use setup::Setup;
pub use shipped::{Begin, Shipped, shipped_file};
pub use source::SceneError;
pub use words::{COMMAND_BITS, LoopWords, Miss, Realised};

pub use crate::method::{LawMethod, Loop, SampledWallMethod};
pub use hpu_plant::Bridge;

use devices::{DeviceKind, device};
use head::has_head;
use read_hand::Load;
use section::Section;
use source::Source;

/// The most clock edges that a run may last; a [`hpu_signal::Cycle`] holds them with room to spare.
pub const MOST_EDGES: u64 = 1 << 62;

/// The text of a scene, the name of its file in messages, and the keys and values that replace the file's.
#[derive(Clone, Copy)]
pub(crate) struct Text<'a> {
    pub(crate) name: &'a str,
    pub(crate) text: &'a str,
    pub(crate) overrides: &'a [(String, String)],
}

/// Refuses an axis whose words make no datapath. The parser knows no datapath, so its caller gives this check.
type Buildable<'a> = &'a dyn Fn(&Scene, &LoopWords) -> Result<(), SceneError>;

macro_rules! experiment {
    (($d:tt) $(#[doc = $meaning:literal] $Device:ident: $module:ident, $Scene:ident, $Simulation:ident;)*) => {
        /// Any experiment.
        #[derive(Clone, PartialEq, Debug)]
        #[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
        pub enum Experiment {
            /// One axis: a motor with a wheel, and a wall.
            Axis(Scene),
            $(#[doc = $meaning] $Device($Scene),)*
            /// One axis whose loop is closed by a design of the user's own.
            Dut(DutScene),
        }

        impl Experiment {
            fn of(name: &str, source: &Source, load: Load, buildable: Buildable) -> Result<Self, SceneError> {
                match Section::root(source).section("device")?.read(&device::kind)? {
                    $(DeviceKind::$Device => return $module::scene(name, source).map(Self::$Device),)*
                    DeviceKind::Motor | DeviceKind::Mass => {}
                }
                if Section::root(source).has("dut") {
                    return read_dut::dut_scene(name, source, load).map(Self::Dut);
                }
                read::scene(name, source, load, buildable).map(Self::Axis)
            }

            /// Returns the scene as one of any kind.
            pub fn setup(&self) -> &dyn Setup {
                match self {
                    Self::Axis(scene) => scene,
                    $(Self::$Device(scene) => scene,)*
                    Self::Dut(scene) => scene,
                }
            }
        }

        impl std::ops::Deref for Experiment {
            type Target = Head;
            fn deref(&self) -> &Head {
                match self {
                    Self::Axis(scene) => &scene.head,
                    $(Self::$Device(scene) => &scene.head,)*
                    Self::Dut(scene) => &scene.head,
                }
            }
        }
    };
}
devices!(experiment);

impl Experiment {
    /// Reads a scene of any kind. `buildable` refuses an axis whose words make no datapath.
    pub(crate) fn read(
        Text { name, text, overrides }: Text,
        load: Load,
        buildable: Buildable,
    ) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides)?;
        Self::of(name, &source, load, buildable).map_err(|first| audit::with_others(&source, first))
    }

    /// Reads a scene for its plant: as [`read`](Self::read), but a motor's scene may be [that of the plant
    /// alone](Dut::pins).
    pub(crate) fn read_plant(text: Text, load: Load, buildable: Buildable) -> Result<Self, SceneError> {
        let source = Source::parse(text.name, text.text, text.overrides)?;
        if read_dut::is_plant_alone(&Section::root(&source)) {
            let read = read_dut::dut_scene(text.name, &source, load).map(Self::Dut);
            return read.map_err(|first| audit::with_others_of_plant(&source, first));
        }
        Self::read(text, load, buildable)
    }

    /// Returns the scene if it is one of an axis.
    pub fn axis(self) -> Option<Scene> {
        if let Self::Axis(scene) = self { Some(scene) } else { None }
    }

    /// Returns the scene if it is one of a PHANToM.
    pub fn phantom(self) -> Option<PhantomScene> {
        if let Self::Phantom(scene) = self { Some(scene) } else { None }
    }
}

/// Returns the angle at the start: the device's, or the first angle of a hand that imposes the angle.
fn initial_angle_rad(hand: &Hand, device: &Device) -> f64 {
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
    /// The device that the hand holds.
    pub device: Device,
    /// The encoder on the shaft, or along the rail.
    pub encoder: Encoder,
    /// The H-bridge of a motor.
    pub bridge: Bridge,
    /// The force amplifier of a mass; the linear law needs none.
    pub amplifier: Option<Amplifier>,
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
}

has_head!(Scene);

impl Scene {
    /// Reads a scene of an axis.
    pub(crate) fn read(
        Text { name, text, overrides }: Text,
        load: Load,
        buildable: Buildable,
    ) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides)?;
        read::scene(name, &source, load, buildable).map_err(|first| audit::with_others(&source, first))
    }

    /// Returns the shaft angle at the start: the device's, or the first angle of a hand that imposes the angle.
    pub fn initial_angle_rad(&self) -> f64 {
        initial_angle_rad(&self.hand, &self.device)
    }

    /// Returns the sample period in whole clocks.
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// Returns the clocks of a period of the modulator, if its gates drive the device. Periods begin at the edges after
    /// multiples of that number.
    pub fn modulator_clocks(&self) -> Option<u64> {
        let switches = matches!(self.device, Device::Motor(_)) && self.model.bridge == BridgeModel::Switching;
        switches.then(|| 1 << self.method.pwm.bits)
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
