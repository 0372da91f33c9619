//! Scenes: one TOML file is one experiment.
//!
//! A scene says first, in prose, what to look for (`about`), then names the device, the transducers, the clock, the method,
//! the wall, the hand, how much physics is modelled, how long it runs, what is recorded and what is expected. Everything is
//! validated before anything runs. Quantities are numbers in SI units or strings with a unit (`"25.175 MHz"`). Angles are
//! those of the motor's shaft, positive into the wall; the wheel turns by the shaft's angle over `wheel_ratio`.
//!
//! A scene whose device is a mass is the textbooks' translational one: its positions are in metres and its efforts in
//! newtons, in the same fields (`rad` then reads `m`, `nm` reads `n`).

mod parts;
mod quantity;
mod read;
mod read_device;
mod read_hand;
mod read_method;
mod section;
mod shipped;
mod source;
mod words;

pub use parts::{
    Bridge, BridgeModel, Datapath, Device, Encoder, Expect, Expectation, Hand, Loop, Mass, Method,
    Metric, Model, Motor, OutcomeKind, PathPoint, Pwm, Record, Run, Wall,
};
pub use shipped::{Shipped, shipped, shipped_file};
pub use source::SceneError;
pub use words::{LoopWords, Realised};

use hpu_signal::Clock;

use source::{Places, Source};

/// Edges a run may last: seconds of clock edges that a [`hpu_signal::Cycle`] holds with room to spare.
pub const MOST_EDGES: u64 = 1 << 62;

/// One experiment, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// Name: that of the file, without folder and extension.
    pub name: String,
    /// What the scene shows and what to look for.
    pub about: String,
    /// What the hand holds.
    pub device: Device,
    /// The encoder on the shaft.
    pub encoder: Encoder,
    /// The H-bridge.
    pub bridge: Bridge,
    /// The FPGA clock.
    pub clock: Clock,
    /// What closes the loop.
    pub method: Method,
    /// The virtual wall.
    pub wall: Wall,
    /// What moves the device.
    pub hand: Hand,
    /// How much is modelled.
    pub model: Model,
    /// How long it runs.
    pub run: Run,
    /// What is recorded.
    pub record: Record,
    /// What is expected of the run.
    pub expect: Expect,
    places: Places,
}

impl Scene {
    /// Parses and validates a scene.
    ///
    /// `name` is the file as errors shall call it. `overrides` are keys and values that replace the file's, in order, as
    /// in `("wall.stiffness", "2 N.m/rad")`: a value that is not TOML is a string, sections are created when absent, and a
    /// whole section is replaced by an inline table (`("hand", "{ kind = \"none\" }")`). `load` reads a file that the
    /// scene names.
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
        read::scene(name, Source::parse(name, text, overrides)?, load)
    }

    /// Duration in clock edges.
    #[must_use]
    pub fn edges(&self) -> u64 {
        self.clock.edges(self.run.duration_s)
    }

    /// Shaft angle at the start: the device's, or where a hand that imposes the angle begins.
    #[must_use]
    pub fn initial_angle_rad(&self) -> f64 {
        match (&self.hand, &self.device) {
            (Hand::Prescribed { path }, _) => path.first().map_or(0.0, |point| point.angle_rad),
            (_, Device::Motor(motor)) => motor.initial_angle_rad,
            (_, Device::Mass(mass)) => mass.initial_position_m,
        }
    }

    /// The sample period in whole clocks.
    #[must_use]
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// The sample period in seconds, as the clock realises it.
    #[must_use]
    pub fn sample_period_s(&self) -> f64 {
        self.period_clocks() as f64 / self.clock.frequency_hz() as f64
    }
}
