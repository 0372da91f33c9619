//! How much of the world a scene models.

/// How the law is computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Datapath {
    /// By the blocks, in words.
    Words,
    /// In floats: unquantised, unsaturated, pulling as well as pushing. The law that limits are computed of.
    Linear,
    /// In floats, but on counts, unilateral and within what the actuator gives: what the words approximate.
    Law,
}

/// How the bridge is modelled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BridgeModel {
    /// Every switching.
    Switching,
    /// Its mean voltage.
    Averaged,
}

/// What brings the device from one instant to the next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Solver {
    /// Exact flows, from event to event.
    Events,
    /// Exact flows, edge by edge.
    Clock,
    /// Exact flows over a sample period, at whose ends alone datapath and device meet.
    Sample,
    /// Fixed steps, explicit Euler.
    Euler,
    /// Fixed steps, Euler with the speed from the new current and the angle from the new speed.
    SemiImplicit,
    /// Fixed steps, implicit midpoint.
    Midpoint,
    /// Fixed steps, the classic Runge-Kutta method of order 4.
    Rk4,
}

impl Solver {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Events, Self::Clock, Self::Sample, Self::Euler, Self::SemiImplicit, Self::Midpoint, Self::Rk4];

    /// `model.solver`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Events => "events",
            Self::Clock => "clock",
            Self::Sample => "sample",
            Self::Euler => "euler",
            Self::SemiImplicit => "semi_implicit",
            Self::Midpoint => "midpoint",
            Self::Rk4 => "rk4",
        }
    }

    /// The method of its steps, where it has steps of a length of its own.
    #[must_use]
    pub fn method(self) -> Option<hpu_plant::Method> {
        match self {
            Self::Events | Self::Clock | Self::Sample => None,
            Self::Euler => Some(hpu_plant::Method::Euler),
            Self::SemiImplicit => Some(hpu_plant::Method::SemiImplicit),
            Self::Midpoint => Some(hpu_plant::Method::Midpoint),
            Self::Rk4 => Some(hpu_plant::Method::Rk4),
        }
    }

    /// Whether it takes steps of a length of its own.
    #[must_use]
    pub fn is_fixed_step(self) -> bool {
        self.method().is_some()
    }

    /// Whether datapath and device meet at every clock edge.
    #[must_use]
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Events | Self::Clock)
    }
}

/// How the winding is modelled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Winding {
    /// With its inductance.
    Inductive,
    /// Without: the current follows the voltage at once.
    Resistive,
}

/// How Coulomb friction is modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Friction {
    /// It sticks and slips.
    StickSlip,
    /// Proportional to the speed up to this one, constant beyond.
    Smoothed {
        /// In rad/s (m/s).
        speed_rad_per_s: f64,
    },
    /// There is none.
    None,
}

/// What the law reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EncoderModel {
    /// Counts, by the lines of the encoder.
    Quantised,
    /// Counts that are loaded into the counter, once a step and at samples: no lines, and no clock between them.
    Loaded,
    /// The position itself.
    Ideal,
}

/// How much is modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Model {
    /// What moves the device on.
    pub solver: Solver,
    /// Step of the solvers that have one, as asked for; [`Scene::step_clocks`](super::Scene::step_clocks) is what the
    /// clock makes of it.
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
    /// Delay of the linear law beside sampling.
    pub delay_s: f64,
}
