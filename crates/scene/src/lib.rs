#![doc = include_str!("../README.md")]
//!
//! # What a scene says
//!
//! Scenes: one TOML file is one experiment, on an axis or on an arm ([`PhantomScene`]).
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
//! | a torsional stiffness per time | 1e-12 | 1e9 | N.m/rad/s |
//! | a moment of inertia | 1e-12 | 1e3 | kg.m2 |
//! | a voltage | 1e-6 | 1e5 | V |
//! | a current | 1e-9 | 1e5 | A |
//! | a resistance | 1e-6 | 1e6 | Ohm |
//! | a flux linkage | 1e-9 | 1e3 | Wb |
//! | a gain of a current | 1e-6 | 1e6 | V/A |
//! | an inductance | 1e-9 | 1e3 | H |
//! | a torque constant | 1e-6 | 1e3 | N.m/A |
//! | a force constant | 1e-6 | 1e6 | N/A |
//! | a length | 1e-12 | 1e4 | m |
//! | an area | 1e-12 | 1e6 | m2 |
//! | a speed | 1e-9 | 1e4 | m/s |
//! | an acceleration | 1e-6 | 1e9 | m/s2 |
//! | a force | 1e-9 | 1e6 | N |
//! | a stiffness | 1e-6 | 1e9 | N/m |
//! | a damping | 1e-9 | 1e6 | N.s/m |
//! | a stiffness per time | 1e-6 | 1e12 | N/m/s |
//! | a mass | 1e-6 | 1e6 | kg |
//! | a viscosity | 1e-9 | 1e12 | Pa.s |
//! | an energy | 1e-15 | 1e9 | J |
//! | a plain number | 1e-9 | 1e12 | 1 |
//!
//! No speed may pass more than 1000 encoder counts in one clock edge: neither the speed at the start nor one that a
//! hand imposes. A run ends when a motion has left the 2^52 counts to either side that an encoder can tell apart.

mod axis;
mod dut;
#[macro_use]
mod experiment;
mod faults;
mod files;
mod foc;
mod gimbal;
mod head;
pub mod joined;
pub mod judged;
pub mod law;
pub mod method;
mod paddle;
mod path;
mod phantom;
mod pmsm;
mod random;
pub mod replay;
mod scene_file;
mod schedule;
mod schema;
pub mod script;
mod text;
#[cfg(not(target_family = "wasm"))]
mod transfer;

pub use axis::Scene;
pub use axis::library::{NamedPart, parts};
pub use axis::network::{Compound, Dac};
pub use axis::network_rows::Bus;
pub use axis::parts::{Amplifier, Device, Encoder, Hand, Method, Motor, PathPoint, Push, Ramp, Wall};
pub use axis::rows::{AnalogShaper, Mass};
pub use axis::sensors::{Hall, MOST_SENSORS, Modulator, Phase, Reading, Sampled, Sensor, SensorKind};
pub use axis::words::{COMMAND_BITS, LoopWords, Realised};
pub use dut::{
    BesideFile, Connected, Connection, Driving, Dut, DutClock, DutReset, DutScene, Engine, Generic, Layout, Line, Part,
    Registers, SensorPin, SourceFile, Standard, beside,
};
pub use experiment::Experiment;
pub use experiment::devices::{BEGINNINGS, KINDS, shipped};
pub use experiment::resolved::{
    ChangedDefault, Resolved, ValueSource, WRITTEN_BY_NEW, as_scene, changed_defaults, resolved,
};
pub use experiment::shipped::shipped_file;
pub use faults::{EncoderLine, Faults, Stuck, Switch, Times};
pub use files::{read_plain, read_stdin, read_text, utf8};
pub use foc::{FocFloats, FocMethod, FocModel, FocScene, FocWords};
pub use gimbal::{
    Displacement, ForceSensor, GimbalMethod, GimbalModel, GimbalScene, GimbalWords, PositionGains, Posture, Probe,
    Servo, Shear, Target, TargetKind, Thresholds,
};
pub use head::accuracy::{Accuracy, Output};
pub use head::expect::{Expect, Expectation, Log, Metric};
pub use head::miss::Miss;
pub use head::model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
pub use head::outcome::OutcomeKind;
pub use head::setup::Setup;
pub use head::shipped::{Begin, Shipped};
pub use head::{Head, MOST_EDGES, Record, Run, Units};
pub use method::rows::Pwm;
pub use method::{AxisLoop, LawMethod, Loop, PidMethod, SampledWallMethod};
pub use paddle::{PaddleFloats, PaddleMethod, PaddleModel, PaddleScene, PaddleWords};
pub use path::{AxisTarget, Sine, along, moves_until_s, positions_along};
pub use phantom::{
    Direction, Drop, Irregularity, PhantomLaw, PhantomMethod, PhantomModel, PhantomScene, PhantomWords, Platform,
    Premium, Room,
};
pub use pmsm::Pmsm;
pub use random::SplitMix64;
pub use scene_file::SceneFile;
pub use schedule::{Schedule, TargetWords, WordRamp};
pub use schema::identifier::{Identifier, Language};
pub use schema::parameter::{Origin, Parameter, ParameterValue};
pub use schema::source::SceneError;
pub use text::kept::kept;
pub use text::message::{Lines, did_you_mean, excerpt, figure, number, printable, printable_json};
pub use text::plain_name::{NotPlain, PlainName};
#[cfg(not(target_family = "wasm"))]
pub use transfer::{Adc, DirectForm, TransferModel, TransferScene, TransferWords, WordRange};

pub use hpu_plant::Bridge;

/// Every key of a scene, as data.
pub mod keys {
    pub use crate::experiment::groups::{has_own_kind, kinds_of, markdown, rows};
    pub use crate::method::{FOC, FOLLOWS, PADDLE};
    pub use crate::schema::{KeyRow, Otherwise, Shape, Sizes, Takes, grouped, is_any_name};
}
