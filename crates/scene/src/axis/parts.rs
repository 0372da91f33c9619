//! The parts of a scene.

use hpu_plant::Bridge;
use hpu_signal::Format;

use crate::axis::rows::{AnalogShaper, Mass};
use crate::head::Units;
use crate::method::Loop;
use crate::method::rows::Pwm;
use crate::replay::PinEdge;

/// The device that the hand holds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Device {
    /// A DC motor with a wheel, driven by the bridge.
    Motor(Motor),
    /// A mass on a rail, driven by an ideal force amplifier: the textbooks' device.
    Mass(Mass),
}

impl Device {
    /// Returns the units of its motion.
    pub fn units(&self) -> Units {
        match self {
            Self::Motor(_) => Units { position: "rad", effort: "N.m", stiffness: "N.m/rad", damping: "N.m.s/rad" },
            Self::Mass(_) => Units { position: "m", effort: "N", stiffness: "N/m", damping: "N.s/m" },
        }
    }
}

/// A DC motor with a wheel; all values but those of the wheel are referred to the shaft.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motor {
    /// Winding resistance.
    pub resistance_ohm: f64,
    /// Winding inductance.
    pub inductance_h: f64,
    /// Torque constant, equal to the back-EMF constant in V·s/rad.
    pub torque_constant_nm_per_a: f64,
    /// Inertia of the rotor.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction.
    pub viscous_friction_nm_s_per_rad: f64,
    /// Coulomb friction.
    pub coulomb_friction_nm: f64,
    /// Turns of the shaft for one turn of the wheel.
    pub wheel_ratio: f64,
    /// Inertia of the wheel about its own axis.
    pub wheel_inertia_kg_m2: f64,
    /// Shaft angle at the start.
    pub initial_angle_rad: f64,
    /// Shaft speed at the start.
    pub initial_speed_rad_per_s: f64,
    /// Winding current at the start.
    pub initial_current_a: f64,
}

impl Motor {
    /// Returns the inertia of rotor and wheel, referred to the shaft.
    pub fn inertia_kg_m2(&self) -> f64 {
        self.rotor_inertia_kg_m2 + self.wheel_inertia_kg_m2 / (self.wheel_ratio * self.wheel_ratio)
    }

    /// Returns the torque at standstill under the full supply of a bridge.
    pub(crate) fn stall_nm(&self, bridge: Bridge) -> f64 {
        let resistance_ohm = self.resistance_ohm + 2.0 * bridge.on_resistance_ohm;
        self.torque_constant_nm_per_a * bridge.supply_v / resistance_ohm
    }
}

/// An incremental encoder, decoded x4.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Encoder {
    /// On a shaft.
    Rotary {
        /// Lines per revolution; there are four times as many counts.
        lines: u32,
    },
    /// Along a rail.
    Linear {
        /// The length of one count; 0 for no encoder, which only the linear law accepts.
        resolution_m: f64,
    },
}

impl Encoder {
    /// Returns the angle, or length, of one count.
    pub fn count_rad(&self) -> f64 {
        match self {
            Self::Rotary { lines } => 2.0 * std::f64::consts::PI / (4.0 * f64::from(*lines)),
            Self::Linear { resolution_m } => *resolution_m,
        }
    }

    /// Returns the count whose angle, or position, is the nearest to this one.
    pub fn nearest(&self, angle_rad: f64) -> i64 {
        (angle_rad / self.count_rad()).round() as i64
    }

    /// Returns the count at an angle, or a position.
    pub fn count(&self, angle_rad: f64) -> i64 {
        (angle_rad / self.count_rad()).floor() as i64
    }
}

/// An ideal force amplifier, which follows the command at once.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Amplifier {
    /// Force of a full command, `2^pwm_bits` counts.
    pub full_scale_n: f64,
    /// The analog input shaper before it.
    pub shaper: Option<AnalogShaper>,
}

/// The method that closes the loop, and its words.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Method {
    /// The wiring.
    pub kind: Loop,
    /// Sample rate requested; [`Scene::sample_period_s`](super::Scene::sample_period_s) returns the period that the
    /// clock realises.
    pub sample_rate_hz: f64,
    /// Width of the position counter.
    pub position_bits: u32,
    /// Format of the stiffness, in PWM counts per position count.
    pub stiffness_format: Format,
    /// Format of the damping, in PWM counts per velocity count.
    pub damping_format: Format,
    /// Width of the velocity.
    pub velocity_bits: u32,
    /// Width of the sample period in clocks.
    pub period_bits: u32,
    /// Whether a product that does not fit clamps (else its upper bits are dropped).
    pub saturate: bool,
    /// The rate whose period velocities are rescaled to, if they are rescaled.
    pub reference_rate_hz: Option<f64>,
    /// Format of the velocity's scale, or of a law's.
    pub scale_format: Format,
    /// Clocks by which the command is held back because the torque's logic takes longer than one clock.
    pub settling: u32,
    /// Cutoff of the digital input shaper behind the law, if there is one.
    pub shaper_hz: Option<f64>,
    /// The modulator.
    pub pwm: Pwm,
}

/// A virtual wall: a spring and a damper at the shaft, at angles beyond its position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Wall {
    /// Its position.
    pub position_rad: f64,
    /// Its stiffness.
    pub stiffness_nm_per_rad: f64,
    /// Its damping.
    pub damping_nm_s_per_rad: f64,
    /// Whether it may stand out of the position counter's range, which then reads it where it wraps to.
    pub wraps: bool,
    /// The change of its words while the scene runs, if they change.
    pub ramp: Option<Ramp>,
}

impl Wall {
    /// Returns the wall in other units, each of which is so many of its own.
    #[must_use]
    pub fn in_units_of(mut self, unit: f64) -> Self {
        let square = unit * unit;
        self.position_rad /= unit;
        self.stiffness_nm_per_rad *= square;
        self.damping_nm_s_per_rad *= square;
        if let Some(stiffness) = self.ramp.as_mut().and_then(|ramp| ramp.stiffness_nm_per_rad.as_mut()) {
            *stiffness *= square;
        }
        self
    }
}

/// The least that a wall gives at rest: a torque or force that grows with the penetration, up to the actuator's
/// greatest.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Push {
    /// The stiffness.
    pub stiffness: f64,
    /// The greatest torque or force.
    pub most: f64,
}

/// A change of the wall's words along a straight line to other values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ramp {
    /// The stiffness at the end.
    pub stiffness_nm_per_rad: Option<f64>,
    /// The scale of the method's force at the end.
    pub scale: Option<f64>,
    /// When it begins.
    pub from_s: f64,
    /// When it ends.
    pub to_s: f64,
}

/// A time and an angle; between two points the path is straight, after the last point the angle stays.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PathPoint {
    /// Time from the start of the run.
    pub time_s: f64,
    /// Shaft angle.
    pub angle_rad: f64,
}

/// The hand, which moves the device.
#[derive(Clone, PartialEq, Debug)]
pub enum Hand {
    /// No hand.
    None,
    /// A constant torque, positive into the wall.
    ConstantTorque {
        /// The torque.
        torque_nm: f64,
    },
    /// A hand that intends to follow a path and holds the device by a spring and a damper.
    SpringDamper {
        /// Stiffness of the grip.
        stiffness_nm_per_rad: f64,
        /// Damping of the grip.
        damping_nm_s_per_rad: f64,
        /// The path that the hand intends to follow.
        path: Vec<PathPoint>,
    },
    /// A hand that imposes the angle.
    Prescribed {
        /// The angle.
        path: Vec<PathPoint>,
    },
    /// Recorded encoder lines in place of the device.
    Capture {
        /// The lines' levels.
        edges: Vec<PinEdge>,
    },
}

impl Hand {
    /// Returns the stiffness and damping that the hand adds to the device's own: those of a spring and damper, else
    /// zeros.
    pub fn grip(&self) -> (f64, f64) {
        match *self {
            Self::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, .. } => {
                (stiffness_nm_per_rad, damping_nm_s_per_rad)
            }
            _ => (0.0, 0.0),
        }
    }

    /// Returns times and positions of the path that the hand intends to follow, or imposes; none for a hand without a
    /// path.
    pub fn path(&self) -> Vec<(f64, f64)> {
        match self {
            Self::SpringDamper { path, .. } | Self::Prescribed { path } => {
                path.iter().map(|point| (point.time_s, point.angle_rad)).collect()
            }
            Self::None | Self::ConstantTorque { .. } | Self::Capture { .. } => Vec::new(),
        }
    }
}
