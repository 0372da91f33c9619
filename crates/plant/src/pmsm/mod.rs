//! A motor of three phases with permanent magnets (PMSM), on an inverter of three legs.
//!
//! | equation | |
//! |---|---|
//! | `dλ/dt = v - R i`, `λ = L_q i + (ψ + (L_d - L_q) i_d) e` | winding in the stator's frame; `e = (cos pθ, sin pθ)` |
//! | `τ = 3/2 p (ψ + (L_d - L_q) i_d) i_q` | the motor's torque; `i_d = e · i`, `i_q = e × i` |
//! | `J dω/dt = τ - B ω - τ_c sgn ω - Σ A sin(n θ + φ) + τ_h` | slip; stuck: `ω = 0` up to the stiction |
//! | `dθ/dt = ω` | mechanical angle |
//! | `τ_h = τ` or `k_h (θ_h - θ) + b_h (dθ_h/dt - ω)` | hand: a torque, or a spring and damper to its intention |
//!
//! Around the rotor there may be the bodies, joints, stops and return springs of a [network](crate::network), with the
//! hand on one of them; a hand may also impose the motion of its body. Rigid joints are removed as there.
//!
//! The frame of two axes has the size of the phases' amplitudes: `i = 2/3 Σ i_x u_x`, with `u_x` the directions of the
//! phases at 0°, 120° and 240°. There is no neutral wire, so the phase currents sum to 0.
//!
//! A terminal is at the supply or at ground through the on-resistance of a switch that is on. With both switches of a
//! leg off, a current out of the leg flows through the lower diode (terminal at `-V_d`), a current into it through the
//! upper diode (terminal at the rail plus `V_d`). A phase whose current reaches 0 floats until its open terminal leaves
//! the range of its diodes. The rail is the supply behind its resistance.
//!
//! **Differs from the hardware**: switches have one on-resistance and no switching time; diodes have a constant drop;
//! the current may flow back into the supply without limit; inductances do not saturate.
//!
//! Equations: Krause, Analysis of Electric Machinery, in the stator's frame.

mod around;
mod circuit;
mod energy;
mod lag;
mod motion;
mod room;
mod series;
mod start;

use std::fmt;
use std::sync::OnceLock;

use crate::network::{Body, Feed, FeedKind, MOST_STATES, Network, NetworkError, Reduced};
use crate::{Bridge, Hand};
use around::Tie;
use circuit::Circuit;

pub use motion::PmsmDevice;

/// The most harmonics of a motor's cogging.
pub const MOST_HARMONICS: usize = 16;
/// The greatest order of a harmonic of the cogging, and the most pole pairs.
pub const HIGHEST_ORDER: u32 = 10_000;

/// One harmonic of the cogging torque: `amplitude sin(order θ + phase)`, which acts against the positive angle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Harmonic {
    /// Periods a revolution of the shaft.
    pub order: u32,
    /// Amplitude in N·m.
    pub amplitude_nm: f64,
    /// Phase at angle 0, in rad.
    pub phase_rad: f64,
}

/// A motor of three phases with everything that turns with it.
#[derive(Clone, PartialEq, Debug)]
pub struct PmsmMotor {
    /// Pairs of poles: electrical turns a turn of the shaft.
    pub pole_pairs: u32,
    /// Resistance of a phase in Ω.
    pub resistance_ohm: f64,
    /// Inductance along the magnets' axis, `L_d`, in H.
    pub direct_h: f64,
    /// Inductance across the magnets' axis, `L_q`, in H.
    pub quadrature_h: f64,
    /// Amplitude of the magnets' flux linkage of a phase in V·s; 0 of a reluctance motor.
    pub flux_vs: f64,
    /// Inertia at the shaft in kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction in N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Coulomb friction in N·m.
    pub coulomb_nm: f64,
    /// Torque up to which a shaft at rest sticks, in N·m: at least the Coulomb friction.
    pub stiction_nm: f64,
    /// Harmonics of the cogging torque, at most [`MOST_HARMONICS`].
    pub cogging: Vec<Harmonic>,
}

/// An inverter of three legs and its supply.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Inverter {
    /// Supply voltage in V.
    pub supply_v: f64,
    /// Resistance of the supply in Ω.
    pub supply_ohm: f64,
    /// Resistance of one closed switch in Ω.
    pub on_resistance_ohm: f64,
    /// Drop of a conducting diode in V.
    pub diode_drop_v: f64,
}

/// The reason why a motor or its inverter is refused, and what is accepted.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PmsmError(String);

impl fmt::Display for PmsmError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for PmsmError {}

/// The immutable laws of a motor on its inverter, with a hand on the shaft, on a clock.
#[derive(Clone, Debug)]
pub struct Pmsm {
    motor: PmsmMotor,
    inverter: Inverter,
    /// The rotor, with all that is rigidly joined to it, and the other bodies after it.
    net: Reduced,
    /// The return springs and the joints, and of each pair of stops the low and the high one.
    ties: Vec<Tie>,
    stops: Vec<[Tie; 2]>,
    /// Whether anything acts beside the rotor's own torques and a hand on it that does not impose its motion.
    is_around: bool,
    /// Whether the hand pulls to its intention.
    is_sprung: bool,
    grip: Grip,
    /// The part of the grip that acts on the rotor, in the rotor's units but for the intention.
    pull: Grip,
    edge_s: f64,
    /// The harmonics of the cogging, two in each.
    waves: Vec<Waves>,
    /// Circuits by the paths of their terminals; each is made when it is first entered.
    circuits: [OnceLock<Circuit>; CIRCUITS],
}

/// The hand's torque: `torque + stiffness (intention - angle) + damping (speed of the intention - speed)`, where angle
/// and speed are `units` times those of a body.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Grip {
    body: usize,
    units: f64,
    torque_nm: f64,
    stiffness_nm_per_rad: f64,
    damping_nm_s_per_rad: f64,
}

impl Grip {
    /// Returns what acts on the body itself, in its own units but for stretch and speed of the intention.
    fn on_body(self) -> Self {
        Self {
            torque_nm: self.units * self.torque_nm,
            stiffness_nm_per_rad: self.units * self.stiffness_nm_per_rad,
            damping_nm_s_per_rad: self.units * self.damping_nm_s_per_rad,
            ..self
        }
    }
}

impl Network {
    /// Returns the network of a rotor alone, whose inertia and friction are the motor's.
    pub fn of_rotor(hand: Hand) -> Self {
        let bridge = Bridge { supply_v: 0.0, on_resistance_ohm: 0.0, diode_drop_v: 0.0, dead_band_v: 0.0 };
        let feed =
            Feed { torque_constant: 0.0, resistance_ohm: 0.0, inductance_h: 0.0, kind: FeedKind::Bridge(bridge) };
        let (bodies, joints, stops) = (vec![Body::default()], Vec::new(), Vec::new());
        Self { bodies, joints, stops, feed, driven: 0, seen: 0, grip: 0, hand, sensed: Vec::new() }
    }
}

/// The most bodies, the rotor among them, without those on rigid joints.
const MOST_BODIES: usize = (MOST_STATES - 2) / 2;

/// Two harmonics of the cogging; the second may have no amplitude.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Waves {
    /// Amplitudes in the lanes of the sines.
    amplitudes_nm: [f64; 4],
    orders: [f64; 2],
}

/// The number of circuits: three terminals with five paths each.
const CIRCUITS: usize = 125;

impl Pmsm {
    /// Creates the laws of a rotor alone, with a hand on it, on a clock of period `edge_s`, in s.
    ///
    /// # Errors
    ///
    /// When a number is not finite or not positive where it must be, when stiction is below Coulomb friction, when pole
    /// pairs or orders are 0 or too high, or when there are too many harmonics.
    pub fn new(motor: PmsmMotor, inverter: Inverter, hand: Hand, edge_s: f64) -> Result<Self, PmsmError> {
        Self::around(motor, inverter, &Network::of_rotor(hand), edge_s)
    }

    /// Creates the laws of a rotor with what a network has around it: the rotor is the body that is `driven` and
    /// `seen`. Its inertia and friction in the network are what is added to the motor's, and the network's drive is
    /// not used.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new); when the network is refused, or the rotor is not the body that is driven and seen.
    pub fn around(motor: PmsmMotor, inverter: Inverter, network: &Network, edge_s: f64) -> Result<Self, PmsmError> {
        let refuse = |reason: String| Err(PmsmError(reason));
        if network.driven != network.seen {
            return refuse("the motor drives the body with the encoder, its rotor, and no other one".into());
        }
        let mut network = network.clone();
        let rotor = &mut network.bodies[network.seen];
        rotor.inertia += motor.inertia_kg_m2;
        rotor.viscous += motor.viscous_nm_s_per_rad;
        rotor.coulomb += motor.coulomb_nm;
        rotor.stiction += motor.stiction_nm;
        let net = network.reduced().map_err(|NetworkError { reason, .. }| PmsmError(reason))?;
        let (body, units) = net.grip;
        let grip = Grip { body, units, ..Grip::default() };
        let grip = match net.hand {
            Hand::Spring(push) => Grip {
                stiffness_nm_per_rad: push.stiffness_nm_per_rad,
                damping_nm_s_per_rad: push.damping_nm_s_per_rad,
                ..grip
            },
            Hand::Torque(torque_nm) if !torque_nm.is_finite() => {
                return refuse("the hand's torque must be finite".into());
            }
            Hand::Torque(torque_nm) => Grip { torque_nm, ..grip },
            Hand::Prescribed => grip,
        };
        checked(&motor, &inverter, &net, &grip, edge_s)?;
        let waves = motor.cogging.chunks(2).map(|pair| {
            let (one, other) = (pair[0], pair.get(1).copied().unwrap_or(Harmonic { amplitude_nm: 0.0, ..pair[0] }));
            Waves {
                amplitudes_nm: [one.amplitude_nm, 0.0, other.amplitude_nm, 0.0],
                orders: [one.order, other.order].map(f64::from),
            }
        });
        let waves = waves.collect();
        let is_sprung = matches!(net.hand, Hand::Spring(_));
        let (ties, stops) = (Tie::of(&net), Tie::of_stops(&net));
        let pull = if body == 0 { grip.on_body() } else { Grip { units, ..Grip::default() } };
        let is_held = net.hand == Hand::Prescribed || net.bodies[0].constant != 0.0;
        let is_around = net.bodies.len() > 1 || !ties.is_empty() || !stops.is_empty() || is_held;
        let circuits = [const { OnceLock::new() }; CIRCUITS];
        let laws =
            Self { motor, inverter, net, ties, stops, is_around, is_sprung, grip, pull, edge_s, waves, circuits };
        Ok(laws)
    }

    /// Returns the motor.
    pub fn motor(&self) -> &PmsmMotor {
        &self.motor
    }

    /// Returns the inverter.
    pub fn inverter(&self) -> &Inverter {
        &self.inverter
    }

    /// Returns whether a hand imposes the motion of a body.
    fn imposes(&self, body: usize) -> bool {
        self.net.hand == Hand::Prescribed && self.grip.body == body
    }
}

/// Refuses numbers that no motor, inverter or body has.
fn checked(motor: &PmsmMotor, inverter: &Inverter, net: &Reduced, grip: &Grip, edge_s: f64) -> Result<(), PmsmError> {
    let refuse = |reason: String| Err(PmsmError(reason));
    for (name, value, positive) in [
        ("resistance", motor.resistance_ohm, false),
        ("L_d", motor.direct_h, true),
        ("L_q", motor.quadrature_h, true),
        ("flux linkage", motor.flux_vs, false),
        ("inertia", motor.inertia_kg_m2, true),
        ("viscous friction", motor.viscous_nm_s_per_rad, false),
        ("Coulomb friction", motor.coulomb_nm, false),
        ("supply", inverter.supply_v, true),
        ("resistance of the supply", inverter.supply_ohm, false),
        ("on-resistance", inverter.on_resistance_ohm, false),
        ("diode drop", inverter.diode_drop_v, false),
        ("hand stiffness", grip.stiffness_nm_per_rad, false),
        ("hand damping", grip.damping_nm_s_per_rad, false),
        ("clock period", edge_s, true),
    ] {
        if !value.is_finite() || value < 0.0 || (positive && value == 0.0) {
            let rule = if positive { "positive" } else { "zero or positive" };
            return refuse(format!("{name} is {value}; it must be {rule}"));
        }
    }
    if !(motor.stiction_nm.is_finite() && motor.stiction_nm >= motor.coulomb_nm) {
        let (stiction, coulomb) = (motor.stiction_nm, motor.coulomb_nm);
        return refuse(format!("stiction is {stiction}; it must be the Coulomb friction, {coulomb}, or more"));
    }
    for body in &net.bodies {
        let of = [body.inertia, body.viscous, body.coulomb, body.spring, body.constant, body.position, body.speed];
        if of.iter().any(|of| !of.is_finite()) || body.inertia <= 0.0 || body.viscous < 0.0 || body.coulomb < 0.0 {
            return refuse("a body has no positive inertia, or a number that is not finite or below 0".into());
        }
    }
    let is_count = |count: u32| (1..=HIGHEST_ORDER).contains(&count);
    if !is_count(motor.pole_pairs) {
        return refuse(format!("pole pairs are {}; accepted are 1 to {HIGHEST_ORDER}", motor.pole_pairs));
    }
    if motor.cogging.len() > MOST_HARMONICS {
        let count = motor.cogging.len();
        return refuse(format!("cogging has {count} harmonics; accepted are up to {MOST_HARMONICS}"));
    }
    for harmonic in &motor.cogging {
        if !is_count(harmonic.order) {
            return refuse(format!(
                "a harmonic of the cogging has order {}; accepted are 1 to {HIGHEST_ORDER}",
                harmonic.order
            ));
        }
        if !(harmonic.amplitude_nm.is_finite() && harmonic.phase_rad.is_finite()) {
            return refuse("amplitude and phase of a harmonic of the cogging must be finite".into());
        }
    }
    Ok(())
}
