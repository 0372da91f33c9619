//! A scene whose loop is a wall and a table of torques behind field-oriented control (`method.kind = "foc"`), around a
//! motor with three phases.

pub(crate) mod read;
pub(crate) mod rows;
#[cfg(not(target_family = "wasm"))]
pub(crate) mod shipped;
mod words;

use std::sync::Arc;

use hpu_plant::Bridge;
use hpu_signal::Format;

use crate::axis::parts::{Device, Encoder, Hand, Wall};
use crate::axis::sensors::{FRACTION, Sampled, SensorKind};
use crate::faults::Faults;
use crate::head::accuracy::Output;
use crate::head::miss::Miss;
use crate::head::model::{BridgeModel, Friction, Solver};
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};
use crate::method::table::TableMethod;
use crate::pmsm::Pmsm;

pub use words::{FocFloats, FocWords};

/// The law and the current loops, in SI units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FocMethod {
    /// Rate at which wall and table sample.
    pub sample_rate_hz: f64,
    /// Index of the absolute sensor that is the position; `None`: the encoder.
    pub position: Option<usize>,
    /// Width of the position.
    pub position_bits: u32,
    /// Indices of the sensors of the currents in the phases a and b.
    pub currents: [usize; 2],
    /// The table of torques; `None`: none.
    pub table: Option<TableMethod>,
    /// Format of the stiffness, in 2^-3 codes per count.
    pub stiffness_format: Format,
    /// Format of the damping, in 2^-3 codes per (count per sample).
    pub damping_format: Format,
    /// Bandwidth of the current controllers.
    pub bandwidth_hz: f64,
    /// Frequency of the modulator.
    pub pwm_hz: f64,
    /// Time for which both switches of a leg are open when it changes.
    pub dead_time_s: f64,
    /// The least pulse of a leg.
    pub min_pulse_s: f64,
    /// Time for which all switches stay open at the start.
    pub enable_after_s: f64,
    /// The angle that is taken for the zero of the field's angle.
    pub zero_rad: f64,
}

/// The physics that is modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FocModel {
    /// The solver of the motion.
    pub solver: Solver,
    /// Coulomb friction.
    pub friction: Friction,
    /// The bridge.
    pub bridge: BridgeModel,
    /// Whether the torque is the wanted one, without currents.
    pub ideal: bool,
    /// Time by which it is late then.
    pub delay_s: f64,
    /// Whether the logic computes in `f64`, in the place of the words.
    pub in_floats: bool,
}

/// A scene behind field-oriented control, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct FocScene {
    /// The part that every scene has.
    pub head: Head,
    /// The motor with one winding, whose current is the one across the magnets' axis.
    pub device: Device,
    /// The motor.
    pub pmsm: Arc<Pmsm>,
    /// The encoder.
    pub encoder: Encoder,
    /// The bridge.
    pub bridge: Bridge,
    /// The hand.
    pub hand: Hand,
    /// The law and the current loops.
    pub method: FocMethod,
    /// The wall, if there is one.
    pub wall: Option<Wall>,
    /// The faults of the encoder's lines.
    pub faults: Option<Faults>,
    /// The parts of the physics that are modelled.
    pub model: FocModel,
}

has_head!(FocScene);

impl FocScene {
    /// Returns the sampling of a sensor of this index.
    fn sampled(&self, index: usize) -> Option<&Sampled> {
        match &self.pmsm.sensors.get(index)?.kind {
            SensorKind::Sampled(sampled) => Some(sampled),
            _ => None,
        }
    }

    /// Returns the angle of one count of the position that is read.
    pub fn count_rad(&self) -> f64 {
        let absolute = self.method.position.and_then(|index| self.sampled(index));
        absolute.map_or_else(|| self.encoder.count_rad(), |it| libm::exp2(f64::from(FRACTION)) / it.scale)
    }

    /// Returns the current of a code of the converters.
    pub fn code_a(&self) -> f64 {
        let [a, _] = self.method.currents;
        self.sampled(a).map_or(f64::NAN, |it| libm::exp2(f64::from(FRACTION)) / it.scale)
    }

    /// Returns the clock cycles of a period of the law, at least 1.
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz).max(1)
    }

    /// Returns the wall's count, from angle 0; the greatest one where there is no wall.
    pub fn wall_count(&self) -> i64 {
        self.wall.as_ref().map_or(i64::MAX, |wall| (wall.position_rad / self.count_rad()).round() as i64)
    }

    /// Returns the count at which the position is 0: where the encoder stands at the start.
    pub(crate) fn origin(&self) -> i64 {
        if self.method.position.is_some() { 0 } else { self.encoder.count(self.pmsm.start[0]) }
    }
}

impl Setup for FocScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        self.pmsm.around.wall_units
    }

    fn scale(&self) -> f64 {
        self.pmsm.around.wall_ratio
    }

    fn outputs(&self) -> &'static [Output] {
        &Output::OF_AN_AXIS
    }

    fn wall_position(&self) -> f64 {
        self.wall.as_ref().map_or(0.0, |wall| wall.position_rad)
    }

    fn hand_path(&self) -> Vec<(f64, f64)> {
        self.hand.path()
    }

    fn stiffness_miss(&self) -> Option<Miss> {
        self.words().ok()?.stiffness_miss
    }

    fn stiffness_format(&self) -> Option<&'static str> {
        Some("method.stiffness_format")
    }
}
