//! A scene of a PHANToM: the drop test of Sevcik et al. 2009, its platforms and its models.

mod read;
pub(crate) mod rows;
pub(crate) mod shipped;

pub(crate) use read::scene;

use hpu_datapath::phantom::Config;

use crate::head::accuracy::Output;
use crate::head::miss::Miss;
use crate::head::model::Solver;
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};
use crate::schema::source::SceneError;

/// The outputs by which models of a PHANToM are compared.
pub(crate) const OUTPUTS: [Output; 3] = [Output::Trace, Output::Rms, Output::Verdict];

/// The platform: the computer or FPGA that computes the wall's force, and its rate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Platform {
    /// A multitasking operating system at 1 kHz, with jitter and missed deadlines.
    Pmos1,
    /// A real-time operating system, at this rate in kHz.
    Rtos(u32),
    /// The datapath on the FPGA, at this rate in kHz.
    Fpga(u32),
}

impl Platform {
    /// The eight platforms of the paper, in its order.
    pub const ALL: [Self; 8] = [
        Self::Pmos1,
        Self::Rtos(1),
        Self::Rtos(5),
        Self::Rtos(10),
        Self::Rtos(20),
        Self::Fpga(20),
        Self::Fpga(100),
        Self::Fpga(400),
    ];

    /// Returns its name in the paper.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pmos1 => "PMOS-1",
            Self::Rtos(1) => "RTOS-1",
            Self::Rtos(5) => "RTOS-5",
            Self::Rtos(10) => "RTOS-10",
            Self::Rtos(_) => "RTOS-20",
            Self::Fpga(20) => "FPGA-20",
            Self::Fpga(100) => "FPGA-100",
            Self::Fpga(_) => "FPGA-400",
        }
    }

    /// Returns its sample rate in Hz.
    pub const fn rate_hz(self) -> u32 {
        match self {
            Self::Pmos1 => 1000,
            Self::Rtos(khz) | Self::Fpga(khz) => 1000 * khz,
        }
    }

    /// Returns whether a host computes the force, in floating point.
    pub const fn is_host(self) -> bool {
        !matches!(self, Self::Fpga(_))
    }
}

hpu_signal::named! {
    /// The model of the arm.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Premium {
        /// The Premium 1.0 of the paper.
        OneZero = "premium_1.0",
        /// The Premium 1.5, whose inertias are published.
        OneFive = "premium_1.5",
    }
}

hpu_signal::named! {
    /// A direction of the room.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Direction {
        /// Sideways.
        X = "x",
        /// Up.
        Y = "y",
        /// Towards the hand.
        Z = "z",
    }
}

impl Direction {
    /// Returns its index. It is also the index of the joint that moves the tip along this direction at the origin.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// The device and its drop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Drop {
    /// The model of the arm.
    pub premium: Premium,
    /// Lengths of upper arm and forearm.
    pub lengths_m: [f64; 2],
    /// Coulomb friction, as felt at the tip.
    pub coulomb_n: f64,
    /// Viscous friction, as felt at the tip.
    pub damping_n_s_per_m: f64,
    /// Acceleration by gravity.
    pub gravity_m_per_s2: f64,
    /// The axis along which gravity pulls, toward negative values.
    pub axis: Direction,
    /// The weight of the tip on a scale.
    pub weight_n: f64,
    /// Speed toward the wall at the start.
    pub speed_m_per_s: f64,
    /// Number of the trial: the small variations of a release are drawn from it and the seed.
    pub trial: u64,
}

/// Irregularity of a multitasking host.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Irregularity {
    /// The longest delay from the time at which a sample is due to the time at which it is taken.
    pub jitter_s: f64,
    /// Share of the samples that are not taken at all.
    pub missed: f64,
}

/// The FPGA's design.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PhantomMethod {
    /// One multiplier and a state machine instead of logic for everything.
    pub shared: bool,
    /// Its words.
    pub config: Config,
}

/// The room: pairs of opposing walls, each of which may be absent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Room {
    /// Distance from the origin to each wall.
    pub distance_m: f64,
    /// Stiffness of all walls.
    pub stiffness_n_per_m: f64,
    /// Which pairs are present, by axis.
    pub walls: [bool; 3],
}

hpu_signal::named! {
    /// The arithmetic that computes the force.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum PhantomLaw {
        /// The platform's own: words in the FPGA, or floating point on the host.
        Words = "words",
        /// Floats, from the counts.
        Floats = "floats",
        /// Floats, from the true angles.
        Ideal = "ideal",
    }
}

/// The parts of the physics that are modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PhantomModel {
    /// The solver; never [`Solver::Sample`].
    pub solver: Solver,
    /// Step requested for solvers that have one, in s; [`PhantomScene::step_clocks`] returns the step that the clock
    /// realises.
    pub step_s: Option<f64>,
    /// The arithmetic that computes the force.
    pub law: PhantomLaw,
    /// Whether only the joint under test moves.
    pub tested_joint_only: bool,
    /// Whether there is Coulomb friction.
    pub friction: bool,
    /// Delay of a host from sample to command, in samples.
    pub delay_samples: f64,
    /// Delay of a host in addition to those samples, whatever its rate.
    pub latency_s: f64,
    /// Time constant of the amplifier.
    pub amplifier_lag_s: f64,
    /// Stiffness of the transmission as felt at the tip; 0 for a rigid one.
    pub transmission_n_per_m: f64,
    /// Damping of the transmission.
    pub transmission_n_s_per_m: f64,
    /// Share of the apparent mass that lies on the motor's side of the transmission.
    pub motor_share: f64,
}

/// A scene of a PHANToM, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct PhantomScene {
    /// The part that every scene has.
    pub head: Head,
    /// The device and its release.
    pub drop: Drop,
    /// The platform that computes the force.
    pub platform: Platform,
    /// Irregularity of `PMOS-1`.
    pub irregularity: Irregularity,
    /// The FPGA's design.
    pub method: PhantomMethod,
    /// The room.
    pub room: Room,
    /// The parts of the physics that are modelled.
    pub model: PhantomModel,
}

/// The constant words of a PHANToM's datapath, computed from its scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PhantomWords {
    /// Position of the lower wall of each pair, a word in metres.
    pub low: i64,
    /// Position of the upper wall of each pair, a word in metres.
    pub high: i64,
    /// One bit for each pair of walls: 1 if the pair is present.
    pub room: i64,
    /// The stiffness.
    pub stiffness: i64,
    /// The miss of the stiffness, if it is greater than [`Miss::FLAGGED`].
    pub stiffness_miss: Option<Miss>,
    /// Sample period in clocks.
    pub period: i64,
}

has_head!(PhantomScene);

impl PhantomScene {
    /// Returns the sample period in whole clocks.
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / f64::from(self.platform.rate_hz()))
    }

    /// Returns the sample period.
    pub fn sample_period_s(&self) -> f64 {
        1.0 / f64::from(self.platform.rate_hz())
    }

    /// Returns the solver's step in whole clocks, at least one: a sample period if the scene sets no step.
    pub fn step_clocks(&self) -> u64 {
        self.model.step_s.map_or(self.period_clocks(), |step_s| self.clock.edges(step_s).max(1))
    }

    /// Returns the words of the scene's datapath, each rounded to the nearest.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a wall or the stiffness does not fit its format, or a stiffness above zero rounds to zero.
    pub fn words(&self) -> Result<PhantomWords, SceneError> {
        let formats = &self.method.config.formats;
        let wall = (self.room.distance_m / formats.position.lsb()).round();
        if wall > formats.position.max() as f64 {
            let most = formats.position.to_f64(formats.position.max() as i64);
            let reason =
                format!("{} m does not fit {}; write at most {most} m", self.room.distance_m, formats.position);
            return Err(self.places.error("room.distance", reason));
        }
        if wall == 0.0 {
            let least_m = formats.position.lsb();
            let reason = format!(
                "{} m rounds to zero in {}; write at least {least_m} m",
                self.room.distance_m, formats.position
            );
            return Err(self.places.error("room.distance", reason));
        }
        let asked = self.room.stiffness_n_per_m;
        let stiffness = (asked / formats.stiffness.lsb()).round();
        if stiffness > formats.stiffness.max() as f64 {
            let most = formats.stiffness.max() as f64 * formats.stiffness.lsb();
            let reason =
                format!("{asked} N/m does not fit {}; write at most {most} N/m, or other words", formats.stiffness);
            return Err(self.places.error("room.stiffness", reason));
        }
        if stiffness == 0.0 && asked > 0.0 {
            let reason = format!(
                "{asked} N/m rounds to zero in {}; write 0 or at least {} N/m",
                formats.stiffness,
                formats.stiffness.lsb()
            );
            return Err(self.places.error("room.stiffness", reason));
        }
        let bits = self.room.walls.iter().enumerate().map(|(bit, &there)| i64::from(there) << bit);
        let by_words = !self.platform.is_host() && self.model.law == PhantomLaw::Words;
        Ok(PhantomWords {
            low: -(wall as i64),
            high: wall as i64,
            room: bits.sum(),
            stiffness: stiffness as i64,
            stiffness_miss: if by_words { Miss::of(asked, formats.stiffness) } else { None },
            period: self.period_clocks() as i64,
        })
    }
}

impl Setup for PhantomScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        Units { position: "m", effort: "N", stiffness: "N/m", damping: "N.s/m" }
    }

    fn outputs(&self) -> &'static [Output] {
        &OUTPUTS
    }

    fn stiffness_miss(&self) -> Option<Miss> {
        self.words().ok()?.stiffness_miss
    }
}
