//! The head of a scene: the part that scenes of every kind have.

pub(crate) mod accuracy;
pub(crate) mod expect;
pub(crate) mod miss;
pub(crate) mod model;
pub(crate) mod outcome;
pub(crate) mod rows;
pub(crate) mod setup;
pub(crate) mod shipped;

use std::sync::Arc;

use hpu_signal::Clock;

use crate::head::accuracy::{Accuracy, OfOutputs};
use crate::head::expect::Expect;
use crate::head::rows as keys;
use crate::replay::Recording;
use crate::schema::parameter::Parameter;
use crate::schema::section::Section;
use crate::schema::source::{Places, SceneError, Source};
use crate::schema::{Key, Quantity};
use crate::text::message::number;

/// The most clock edges that a run may last; a [`hpu_signal::Cycle`] holds them with room to spare.
pub const MOST_EDGES: u64 = 1 << 62;

/// The part that scenes of every kind have. A scene derefs to its head: `scene.clock`, `scene.edges()`.
#[derive(Clone, PartialEq, Debug)]
pub struct Head {
    /// Name: that of the file, without folder and extension.
    pub name: String,
    /// The text about what the scene shows and what to look for.
    pub about: String,
    /// The FPGA's clock: the fastest of a design of the user's own.
    pub clock: Clock,
    /// Duration and seed of the run.
    pub run: Run,
    /// Settings of the recording.
    pub record: Record,
    /// The expected results of the run.
    pub expect: Expect,
    /// The outputs by which models of the scene are compared.
    pub accuracy: Accuracy,
    /// Whether the model is left to `hpu fit` (`model = "auto"`); the scene's model then holds the defaults.
    pub auto: bool,
    /// Every parameter of the run, as the scene was read, with its origin.
    pub parameters: Arc<[Parameter]>,
    /// The recording that moves the device or its encoder lines, if the scene names one.
    pub recording: Option<Recording>,
    pub(crate) places: Places,
}

impl Head {
    /// Returns the duration in clock edges.
    pub fn edges(&self) -> u64 {
        self.clock.edges(self.run.duration_s)
    }

    /// Returns whether the scene's text, or an override, gives a key.
    pub fn gives(&self, key: &str) -> bool {
        self.places.has(key)
    }

    /// Returns an error at one of the scene's keys.
    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(key, reason)
    }
}

/// The units of a device's numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Units {
    /// Unit of positions and amplitudes.
    pub position: &'static str,
    /// Unit of torques or forces.
    pub effort: &'static str,
    /// Unit of stiffnesses.
    pub stiffness: &'static str,
    /// Unit of dampings.
    pub damping: &'static str,
}

/// Duration and seed of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Run {
    /// Duration.
    pub duration_s: f64,
    /// Seed of everything random.
    pub seed: u64,
}

/// The part of a waveform beside the nets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Record {
    /// Rate at which the plant's states are recorded.
    pub plant_rate_hz: f64,
    /// Whether the clock itself is recorded.
    pub clock: bool,
    /// Whether the overflows of nets are recorded.
    pub overflows: bool,
}

/// The parts of a head that a kind of scene reads in its own way: its name among kinds, and the keys of its rate of
/// recording, its expectations and its outputs.
pub(crate) struct Own {
    pub(crate) kind: &'static str,
    pub(crate) plant_rate: &'static Key<Quantity>,
    pub(crate) expect: fn(&Section) -> Result<Expect, SceneError>,
    pub(crate) outputs: &'static Key<OfOutputs>,
}

impl Own {
    /// Reads the rest of a head whose text and clock are known. The parameters are still empty.
    pub(crate) fn head(
        &self,
        file: &str,
        source: &Source,
        root: &Section,
        (about, clock): (String, Clock),
    ) -> Result<Head, SceneError> {
        Ok(Head {
            name: scene_name(file),
            about,
            clock,
            run: run(&root.section("run")?, clock)?,
            record: record(&root.section("record")?, self.plant_rate, self.kind)?,
            expect: (self.expect)(&root.section("expect")?)?,
            accuracy: accuracy(&root.section("accuracy")?, self.outputs, self.kind)?,
            auto: source.auto,
            parameters: [].into(),
            recording: None,
            places: source.places.clone(),
        })
    }
}

/// Reads `[clock]`.
pub(crate) fn clock(s: &Section) -> Result<Clock, SceneError> {
    s.accept(&[])?;
    let frequency_hz = s.read(&keys::clock::frequency)?;
    // Beyond u64 the cast saturates, and the clock refuses that too.
    let whole = if frequency_hz.fract() == 0.0 { frequency_hz as u64 } else { 0 };
    Clock::new(whole).map_err(|error| s.error("frequency", format!("{} Hz: {error}", number(frequency_hz))))
}

/// Reads the text about a scene.
pub(crate) fn about(root: &Section) -> Result<String, SceneError> {
    Ok(root.read(&keys::top::about)?.trim().to_string())
}

fn scene_name(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.strip_suffix(".toml").unwrap_or(name).to_string()
}

fn run(s: &Section, clock: Clock) -> Result<Run, SceneError> {
    s.accept(&[])?;
    let duration_s = s.read(&keys::run::duration)?;
    let edges = duration_s * clock.frequency_hz() as f64;
    if !(0.5..=MOST_EDGES as f64).contains(&edges) {
        let reason = format!("{} clock edges; a run has 1 to 2^62", number(edges));
        return Err(s.error("duration", reason));
    }
    Ok(Run { duration_s, seed: s.read(&keys::run::seed)? })
}

/// Reads `[record]` of a kind of scene, whose rate has a default of its own.
fn record(s: &Section, plant_rate: &Key<Quantity>, scene: &str) -> Result<Record, SceneError> {
    s.accept(&[scene])?;
    Ok(Record {
        plant_rate_hz: s.read(plant_rate)?,
        clock: s.read(&keys::record_all::clock)?,
        overflows: s.read(&keys::record_all::overflows)?,
    })
}

/// Reads `[accuracy]` of a kind of scene, which has outputs of its own.
fn accuracy(s: &Section, outputs: &Key<OfOutputs>, scene: &str) -> Result<Accuracy, SceneError> {
    s.accept(&[scene])?;
    Ok(Accuracy { within: s.read(&keys::accuracy_all::within)?, outputs: s.given(outputs)? })
}

/// Lets a scene be used as its head.
macro_rules! has_head {
    ($scene:ty) => {
        impl std::ops::Deref for $scene {
            type Target = $crate::Head;
            fn deref(&self) -> &Self::Target {
                &self.head
            }
        }
        impl std::ops::DerefMut for $scene {
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.head
            }
        }
    };
}
pub(crate) use has_head;
