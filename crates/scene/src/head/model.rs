//! The parts of the world's physics that a scene models.

use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Key, Quantity};

hpu_signal::named! {
    /// The arithmetic of the law.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Datapath {
        /// The blocks, in words.
        Words = "words",
        /// Floats on counts, unilateral and limited to what the actuator gives: the law that the words approximate.
        Law = "law",
        /// Floats: unquantised, unsaturated, pulling as well as pushing. Limits are computed for this law.
        Linear = "linear",
    }
}

hpu_signal::named! {
    /// The model of the bridge.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum BridgeModel {
        /// Every switching of the gates.
        Switching = "switching",
        /// Its mean voltage.
        Averaged = "averaged",
    }
}

hpu_signal::named! {
    /// The solver that moves the device from one instant to the next.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Solver {
        /// Exact flows, from event to event.
        Events = "events",
        /// Exact flows, edge by edge.
        Clock = "clock",
        /// Exact flows over a sample period; datapath and device meet only at its ends.
        Sample = "sample",
        /// Fixed steps, explicit Euler.
        Euler = "euler",
        /// Fixed steps, Euler with the speed from the new current and the angle from the new speed.
        SemiImplicit = "semi_implicit",
        /// Fixed steps, implicit midpoint.
        Midpoint = "midpoint",
        /// Fixed steps, the classic Runge-Kutta method of order 4.
        Rk4 = "rk4",
    }
}

impl Solver {
    /// Returns the method of its steps, if it takes steps of a length of its own.
    pub fn method(self) -> Option<hpu_plant::Method> {
        match self {
            Self::Events | Self::Clock | Self::Sample => None,
            Self::Euler => Some(hpu_plant::Method::Euler),
            Self::SemiImplicit => Some(hpu_plant::Method::SemiImplicit),
            Self::Midpoint => Some(hpu_plant::Method::Midpoint),
            Self::Rk4 => Some(hpu_plant::Method::Rk4),
        }
    }

    /// Returns whether it takes steps of a length of its own.
    pub fn is_fixed_step(self) -> bool {
        self.method().is_some()
    }

    /// Returns whether datapath and device meet at every clock edge.
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Events | Self::Clock)
    }
}

hpu_signal::named! {
    /// The model of the winding.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Winding {
        /// With its inductance.
        Inductive = "inductive",
        /// Without inductance: the current follows the voltage at once.
        Resistive = "resistive",
    }
}

/// The model of Coulomb friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Friction {
    /// It sticks and slips.
    StickSlip,
    /// Friction proportional to the speed up to this speed, constant beyond.
    Smoothed {
        /// The speed, in rad/s (m/s).
        speed_rad_per_s: f64,
    },
    /// No Coulomb friction.
    None,
}

hpu_signal::named! {
    /// The position that the law reads.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum EncoderModel {
        /// Counts, counted from the encoder's lines.
        Quantised = "quantised",
        /// Counts that are loaded into the counter, once a step and at samples: no lines, and no clock between them.
        Loaded = "loaded",
        /// The true position.
        Ideal = "ideal",
    }
}

/// The parts of the physics that are modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Model {
    /// The solver.
    pub solver: Solver,
    /// Step requested for solvers that have one, in s; [`Scene::step_clocks`](crate::Scene::step_clocks) returns the
    /// step that the clock realises.
    pub step_s: Option<f64>,
    /// The law.
    pub datapath: Datapath,
    /// The bridge.
    pub bridge: BridgeModel,
    /// The winding.
    pub winding: Winding,
    /// Coulomb friction.
    pub friction: Friction,
    /// The encoder.
    pub encoder: EncoderModel,
    /// Delay of the linear law in addition to sampling.
    pub delay_s: f64,
}

/// The solvers of fixed steps, in words.
pub(crate) const FIXED: &str = "\"euler\", \"semi_implicit\", \"midpoint\" or \"rk4\"";

/// Reads the step of a solver of fixed steps; refuses one where the solver has none.
pub(crate) fn step(s: &Section, key: &Key<Quantity>, solver: Solver) -> Result<Option<f64>, SceneError> {
    match (solver.is_fixed_step(), s.has(key.name)) {
        (true, _) => s.read(key).map(Some),
        (false, false) => Ok(None),
        (false, true) => {
            let reason =
                format!("\"{}\" has no step of its own; leave it out, or write solver = {FIXED}", solver.name());
            Err(s.error(key.name, reason))
        }
    }
}
