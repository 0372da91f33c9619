//! One axis: a brushed DC motor on an H-bridge, with a hand on its shaft.
//!
//! | equation | |
//! |---|---|
//! | `L di/dt = V - R i - K ω` | circuit closed; open: `i = 0`; amplified: `i` is imposed |
//! | `J dω/dt = K i - B ω - τ_c sgn ω + τ_h` | slip; stuck: `ω = 0` while `abs(K i + τ_h) <= τ_c` |
//! | `dθ/dt = ω` | |
//! | `τ_h = τ` or `k_h (θ_h - θ) + b_h (dθ_h/dt - ω)` | hand: a torque, or a spring and damper to its intention |
//!
//! A hand that prescribes the motion fixes `ω` and gives whatever torque that takes. All angles and torques are at the
//! motor's shaft; a wheel's inertia is divided by the square of its ratio. Valid while the winding is linear (no
//! saturation, no heating) and the shaft rigid. Equations: Vasudevan et al. 2007, with friction added.
//!
//! An ideal force amplifier on a rail is the same axis with metres for radians and newtons for newton metres: a current
//! in A is a force in N ([`Motor::on_rail`], [`Axis::amplified`]).

use std::fmt;
use std::sync::OnceLock;

use crate::Bridge;
use crate::flow::double::Double;
use crate::flow::guard::Guard;
use crate::flow::leap::Square;
use crate::flow::linear::Linear;
use crate::flow::matrix::{CURRENT, Matrix, SPEED};
use crate::flow::period::Period;
use crate::flow::reversal::Reversal;

/// A brushed DC motor with everything that turns with it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motor {
    /// Winding resistance in Ω.
    pub resistance_ohm: f64,
    /// Winding inductance in H.
    pub inductance_h: f64,
    /// Torque constant in N·m/A, which is also the back-EMF constant in V·s/rad.
    pub torque_constant_nm_per_a: f64,
    /// Inertia at the shaft, of rotor and reflected load, in kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction in N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Coulomb friction in N·m.
    pub coulomb_nm: f64,
}

impl Motor {
    /// Returns a mass on a rail under an ideal force amplifier, for [`Axis::amplified`]: 1 N/A, and a winding without
    /// effect.
    pub fn on_rail(mass_kg: f64, viscous_n_s_per_m: f64, coulomb_n: f64) -> Self {
        Self {
            resistance_ohm: 0.0,
            inductance_h: 0.0,
            torque_constant_nm_per_a: 1.0,
            inertia_kg_m2: mass_kg,
            viscous_nm_s_per_rad: viscous_n_s_per_m,
            coulomb_nm: coulomb_n,
        }
    }

    /// Returns `A` of the moving motor in a closed circuit of total resistance `resistance_ohm`; states current, speed,
    /// angle.
    pub fn matrix(&self, resistance_ohm: f64) -> Matrix {
        self.exact_matrix(resistance_ohm.into()).map(|row| row.map(|x| x.hi))
    }

    pub(crate) fn exact_matrix(&self, resistance_ohm: Double) -> [[Double; 4]; 4] {
        let (l, k, j) = (self.inductance_h.into(), self.torque_constant_nm_per_a, self.inertia_kg_m2.into());
        let (zero, one) = (Double::ZERO, Double::from(1.0));
        [
            [(-resistance_ohm).over(l), Double::from(-k).over(l), zero, zero],
            [Double::from(k).over(j), Double::from(-self.viscous_nm_s_per_rad).over(j), zero, zero],
            [zero, one, zero, zero],
            [zero; 4],
        ]
    }
}

/// A point mass pushed by an ideal force source: the textbook device of the sampled wall.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mass {
    /// Mass in kg.
    pub mass_kg: f64,
    /// Viscous damping in N·s/m.
    pub damping_n_s_per_m: f64,
}

impl Mass {
    /// Returns `A` for the states (unused), speed, position.
    pub fn matrix(&self) -> Matrix {
        let mut a = [[0.0; 4]; 4];
        a[SPEED][SPEED] = -self.damping_n_s_per_m / self.mass_kg;
        a[2][SPEED] = 1.0;
        a
    }
}

/// The hand on the shaft.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Hand {
    /// A constant torque, zero for no hand, in N·m.
    Torque(f64),
    /// A spring and damper to an intended angle.
    Spring(Push),
    /// A hand that imposes the motion.
    Prescribed,
}

/// The spring and damper of a hand.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Push {
    /// Stiffness in N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Damping in N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
}

/// The reason why an axis was refused.
#[derive(Clone, PartialEq, Debug)]
pub struct AxisError(pub(crate) String);

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for AxisError {}

/// The mode of the shaft.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Shaft {
    /// Turning, with friction against this sign of the speed; 0 without friction.
    Slip(i8),
    /// Turning slowly, with smoothed friction in proportion to the speed.
    Creep,
    /// Held by friction.
    Stuck,
    /// Moved by a prescribing hand.
    Prescribed,
}

/// A linear system, with the functions of its state that are watched.
pub(crate) struct Mode {
    pub system: Linear,
    pub current: Guard,
    pub speed: Guard,
    pub angle: Guard,
    /// Torque on a stuck shaft without the constant part: `K i + k_h (θ_h - θ)`.
    pub net: Guard,
    /// The period of the modulator that drives it; set at the first cruise.
    pub period: OnceLock<Option<Period>>,
    /// Constants of the reversals of a sliding shaft; set at the first.
    reversal: OnceLock<Option<Box<Reversal>>>,
}

impl Mode {
    /// Returns the constants of reversals in this mode against this Coulomb friction over the inertia; `None` if an
    /// edge is too long for them.
    #[inline(always)]
    pub(crate) fn reversal(&self, coulomb: Double) -> Option<&Reversal> {
        self.reversal.get_or_init(|| Reversal::new(&self.system, coulomb)).as_deref()
    }
}

/// The immutable laws of an axis on a clock; each mode is tabulated when it is first entered.
pub struct Axis {
    pub(crate) motor: Motor,
    pub(crate) bridge: Bridge,
    pub(crate) hand: Hand,
    /// Whether the axis has an amplifier instead of a bridge.
    pub(crate) amplified: bool,
    edge_s: f64,
    horizon: u64,
    /// The speed in rad/s up to which friction is proportional to it; 0 if friction sticks.
    pub(crate) creep_rad_per_s: f64,
    pub(crate) constants: Constants,
    /// Boxed, because laws are moved while they are made, and few modes are entered.
    pub(crate) modes: [OnceLock<Box<Mode>>; 16],
}

/// Inputs of a mode, per unit of their causes.
pub(crate) struct Constants {
    /// The supply's voltage, and the drop of a diode, over the inductance.
    pub supply: Double,
    pub diode: Double,
    /// One over the inertia, and Coulomb friction over the inertia.
    pub torque: Double,
    pub coulomb: Double,
}

impl Axis {
    /// Creates the laws on a clock of period `edge_s`, tabulated for leaps of up to `horizon` edges.
    ///
    /// # Errors
    ///
    /// When a parameter is not finite, or one that must be positive is not.
    pub fn new(motor: Motor, bridge: Bridge, hand: Hand, edge_s: f64, horizon: u64) -> Result<Self, AxisError> {
        Self::checked(motor, Some(bridge), hand, edge_s, horizon)
    }

    /// Creates the laws without a bridge, as [`new`](Self::new) otherwise. A [`Device`](crate::Device) of them is
    /// driven only by [`drive_current`](crate::Device::drive_current), and its winding needs neither resistance nor
    /// inductance.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn amplified(motor: Motor, hand: Hand, edge_s: f64, horizon: u64) -> Result<Self, AxisError> {
        Self::checked(motor, None, hand, edge_s, horizon)
    }

    fn checked(motor: Motor, bridge: Option<Bridge>, hand: Hand, edge_s: f64, horizon: u64) -> Result<Self, AxisError> {
        let amplified = bridge.is_none();
        let bridge =
            bridge.unwrap_or(Bridge { supply_v: 0.0, on_resistance_ohm: 0.0, diode_drop_v: 0.0, dead_band_v: 0.0 });
        let (hand_k, hand_b) = match hand {
            Hand::Spring(push) => (push.stiffness_nm_per_rad, push.damping_nm_s_per_rad),
            Hand::Torque(torque_nm) if !torque_nm.is_finite() => {
                return Err(AxisError("the hand's torque must be finite".into()));
            }
            _ => (0.0, 0.0),
        };
        for (name, value, positive) in [
            ("resistance", motor.resistance_ohm, !amplified),
            ("inductance", motor.inductance_h, !amplified),
            ("torque constant", motor.torque_constant_nm_per_a, true),
            ("inertia", motor.inertia_kg_m2, true),
            ("viscous friction", motor.viscous_nm_s_per_rad, false),
            ("Coulomb friction", motor.coulomb_nm, false),
            ("supply", bridge.supply_v, !amplified),
            ("on-resistance", bridge.on_resistance_ohm, false),
            ("diode drop", bridge.diode_drop_v, false),
            ("dead band", bridge.dead_band_v, false),
            ("hand stiffness", hand_k, false),
            ("hand damping", hand_b, false),
            ("clock period", edge_s, true),
        ] {
            if !value.is_finite() || value < 0.0 || (positive && value == 0.0) {
                let rule = if positive { "positive" } else { "zero or positive" };
                return Err(AxisError(format!("{name} is {value}; it must be {rule}")));
            }
        }
        let over = |value: f64, divisor: f64| Double::from(value).over(divisor.into());
        let constants = Constants {
            supply: over(bridge.supply_v, motor.inductance_h),
            diode: over(bridge.diode_drop_v, motor.inductance_h),
            torque: over(1.0, motor.inertia_kg_m2),
            coulomb: over(motor.coulomb_nm, motor.inertia_kg_m2),
        };
        let (creep_rad_per_s, modes) = (0.0, Default::default());
        Ok(Self { motor, bridge, hand, amplified, edge_s, horizon, creep_rad_per_s, constants, modes })
    }

    /// Returns the resistance of a path with this number of closed switches.
    pub(crate) fn path_ohm(&self, switches: u8) -> f64 {
        self.motor.resistance_ohm + f64::from(switches) * self.bridge.on_resistance_ohm
    }

    pub(crate) fn exact_path_ohm(&self, switches: u8) -> Double {
        Double::product(f64::from(switches), self.bridge.on_resistance_ohm) + self.motor.resistance_ohm.into()
    }

    /// Returns the mode of a shaft and a circuit; `switches` is `None` if no voltage drives the current (open, or
    /// imposed).
    pub(crate) fn mode(&self, shaft: Shaft, switches: Option<u8>) -> &Mode {
        // Without on-resistance every closed path has the same system.
        let switches = switches.map(|n| if self.bridge.on_resistance_ohm == 0.0 { 0 } else { n });
        let row = match shaft {
            Shaft::Slip(_) => 0,
            Shaft::Stuck => 1,
            Shaft::Prescribed => 2,
            Shaft::Creep => 3,
        };
        let column = switches.map_or(3, usize::from);
        self.modes[row * 4 + column].get_or_init(|| Box::new(self.make(shaft, switches)))
    }

    fn make(&self, shaft: Shaft, switches: Option<u8>) -> Mode {
        let motor = &self.motor;
        let mut a = motor.exact_matrix(self.exact_path_ohm(switches.unwrap_or(0)));
        let mut net = [motor.torque_constant_nm_per_a, 0.0, 0.0, 0.0];
        if let Hand::Spring(push) = self.hand {
            let j = motor.inertia_kg_m2.into();
            let stiffness = Double::from(push.stiffness_nm_per_rad).over(j);
            a[SPEED][SPEED] = (Double::from(-motor.viscous_nm_s_per_rad) - push.damping_nm_s_per_rad.into()).over(j);
            a[SPEED][2] = -stiffness;
            a[SPEED][3] = stiffness;
            net[2] = -push.stiffness_nm_per_rad;
            net[3] = push.stiffness_nm_per_rad;
        }
        if switches.is_none() {
            a[CURRENT] = [Double::ZERO; 4];
        }
        match shaft {
            Shaft::Slip(_) => {}
            Shaft::Creep => {
                a[SPEED][SPEED] = a[SPEED][SPEED] - self.constants.coulomb.over(self.creep_rad_per_s.into())
            }
            Shaft::Stuck | Shaft::Prescribed => a[SPEED] = [Double::ZERO; 4],
        }
        if let (true, Some(switches)) = (self.is_resistive(), switches) {
            // The current is a function of the speed, and changes with it.
            a[CURRENT] = a[SPEED].map(|rate| -(rate * self.ohmic_a_s_per_rad(switches)));
        }
        if shaft == Shaft::Stuck {
            a[2] = [Double::ZERO; 4];
            a[CURRENT][SPEED] = Double::ZERO;
        }
        let system = Linear::exact(&a, Square::of_axis(), self.edge_s, self.horizon);
        let pick = |index: usize| {
            let mut row = [0.0; 4];
            row[index] = 1.0;
            Guard::new(row, &system)
        };
        let (current, speed, angle) = (pick(CURRENT), pick(SPEED), pick(2));
        let net = Guard::new(net, &system);
        Mode { system, current, speed, angle, net, period: OnceLock::new(), reversal: OnceLock::new() }
    }
}
