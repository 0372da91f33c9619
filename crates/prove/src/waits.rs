//! How long the loop of a scene waits between a position and the effort that answers it.
//!
//! A position takes two clocks in the synchronizer, one in the decoder and one in the counter; the next register or the
//! modulator reads it at the fourth clock after that of the encoder's lines. A sampled spring and a sampled velocity
//! wait in a register, `method.settling` holds the command back, and a modulator waits for its period.

use hpu_cosim::scene::{BridgeModel, Datapath, EncoderModel, Hand, Scene};
use serde::Serialize;

/// Clocks from the encoder's lines to the next register behind the counter.
const LINES: u64 = 4;

/// Whether a scene's loop reads the encoder's lines clock by clock.
pub fn has_lines(scene: &Scene) -> bool {
    scene.model.datapath == Datapath::Words && scene.model.encoder == EncoderModel::Quantised
}

/// How the commands of a scene act on its device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Drive {
    /// The linear law has no logic: an effort acts `model.delay` after its sample.
    Linear,
    /// A command acts from its own clock on: through an amplifier, through a network's converter, or through an
    /// averaged bridge that takes every duty at once.
    Held,
    /// A command moves the end of a modulator's pulse.
    Pulses {
        /// Clocks of the modulator's period.
        period: u64,
        /// Whether the command is taken at the start of the period, or where the pulse ends.
        latched: bool,
        /// Whether the pulse is as long as half of the period at a duty of 0.
        antiphase: bool,
    },
}

impl Drive {
    /// Returns the drive of a scene.
    pub fn of(scene: &Scene) -> Self {
        let pwm = scene.method.pwm;
        match (scene.model.datapath, scene.has_bridge(), scene.model.bridge) {
            (Datapath::Linear, ..) => Self::Linear,
            (_, false, _) => Self::Held,
            (_, true, BridgeModel::Averaged) if !pwm.latched => Self::Held,
            (_, true, _) => Self::Pulses { period: 1 << pwm.bits, latched: pwm.latched, antiphase: pwm.antiphase },
        }
    }

    /// Returns the clocks from the encoder's lines to the command at work, beside `method.settling`, sampling and the
    /// modulator's period. A modulator reads a command one clock after the clock that made it.
    pub fn lines(self, scene: &Scene) -> u64 {
        match self {
            _ if !has_lines(scene) => 0,
            Self::Linear | Self::Held => LINES - 1,
            Self::Pulses { .. } => LINES,
        }
    }

    /// Returns the clocks from the start of a period to the end of the pulse that a command moves.
    pub fn pulse(self, duty: f64) -> f64 {
        match self {
            Self::Linear | Self::Held => 0.0,
            Self::Pulses { period, antiphase: true, .. } => 0.5 * (1.0 + duty) * period as f64,
            Self::Pulses { period, antiphase: false, .. } => duty * period as f64,
        }
    }
}

/// The duty that a wall asks for at rest: the share of a full command.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Rest {
    /// The same duty at every stiffness.
    Duty(f64),
    /// A hand of this stiffness, whose intended place lies behind the wall's surface: `duty` is that of the hand's
    /// effort on a wall that does not yield.
    Spring {
        /// The hand's stiffness, in N·m/rad or N/m.
        stiffness: f64,
        /// The share of a full command that holds the hand at the surface.
        duty: f64,
    },
}

impl Rest {
    /// Returns the rest of a scene at the end of its hand's path; none if the hand imposes the motion, if the scene has
    /// no full command, or if a network has a converter.
    pub fn of(scene: &Scene) -> Option<Self> {
        let realised = scene.words().ok()?.realised;
        let full = realised.torque_quantum_nm * 2f64.powi(scene.method.pwm.bits.cast_signed());
        if let Some(compound) = scene.network.as_deref() {
            // Joints and return springs yield beside the hand.
            let reduced = compound.network.reduced().ok().filter(|_| compound.dac.is_none())?;
            let hand = compound.path.last().map_or(0.0, |end| end.angle_rad);
            if let Some([place, compliance]) = reduced.rest(hand) {
                let depth = (place - realised.wall_position_rad).max(0.0);
                return Some(Self::Spring { stiffness: 1.0 / compliance, duty: depth / compliance / full });
            }
            if compound.springs().is_some() || compound.network.bodies.iter().any(|body| body.constant != 0.0) {
                return None;
            }
        }
        match &scene.hand {
            Hand::None => Some(Self::Duty(0.0)),
            Hand::ConstantTorque { torque_nm } => Some(Self::Duty(torque_nm.max(0.0) / full)),
            Hand::SpringDamper { stiffness_nm_per_rad, path, .. } => {
                let depth = path.last().map_or(0.0, |end| end.angle_rad - realised.wall_position_rad).max(0.0);
                let stiffness = *stiffness_nm_per_rad;
                Some(Self::Spring { stiffness, duty: stiffness * depth / full })
            }
            Hand::Prescribed { .. } | Hand::Capture { .. } => None,
        }
    }

    /// Returns the duty on a wall of this stiffness. It grows with the stiffness.
    pub fn duty(self, stiffness: f64) -> f64 {
        match self {
            Self::Duty(duty) => duty,
            Self::Spring { duty: 0.0, .. } => 0.0,
            Self::Spring { stiffness: hand, duty } => duty * stiffness / (stiffness + hand),
        }
    }

    /// Returns a bound of the distance of the duties along a stretch from the straight line between those at its ends.
    pub fn bend(self, [low, high]: [f64; 2]) -> f64 {
        match self {
            Self::Duty(_) | Self::Spring { duty: 0.0, .. } => 0.0,
            // An eighth of the greatest second derivative times the squared length.
            Self::Spring { stiffness: hand, duty } => 0.25 * duty * hand * (high - low).powi(2) / (low + hand).powi(3),
        }
    }

    /// Returns the stiffness from which on the command at rest is a full one, if there is one.
    pub fn full_from(self) -> Option<f64> {
        match self {
            Self::Duty(duty) => (duty >= 1.0).then_some(0.0),
            Self::Spring { stiffness, duty } => (duty > 1.0).then(|| stiffness / (duty - 1.0)),
        }
    }
}

/// Returns the duty at rest on the scene's own wall, a full command at most; none if no hand brings the device to rest.
fn own_duty(scene: &Scene) -> Option<f64> {
    let rest = Rest::of(scene).filter(|_| scene.hand != Hand::None)?;
    Some(rest.duty(scene.wall.stiffness_nm_per_rad).min(1.0))
}

/// A time that the loop of a scene waits.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Wait {
    /// The part of the loop that waits.
    pub what: &'static str,
    /// How long, in s.
    pub seconds: f64,
}

/// Returns the times that a scene's loop waits beside sampling, without those that are zero. A modulator's wait is that
/// at rest on the scene's own wall, or that of a full command if the hand leaves no place of rest.
pub fn waits(scene: &Scene) -> Vec<Wait> {
    let drive = Drive::of(scene);
    let seconds = |clocks: f64| clocks * scene.clock.period_s();
    let held = has_lines(scene) && !scene.method.kind.is_live();
    let duty = own_duty(scene);
    let modulator = match drive {
        Drive::Pulses { latched: true, .. } => drive.pulse(duty.unwrap_or(1.0)),
        _ => 0.0,
    };
    let dead_s = if let Drive::Pulses { .. } = drive { scene.method.pwm.dead_time_s } else { 0.0 };
    let word = scene.network.as_deref().and_then(|network| network.word());
    // A word is on average half a period old when the next one replaces it.
    let word_clocks = word.map_or(0.0, |(word, _)| word.latency as f64 + 0.5 * (word.period - 1) as f64);
    let lag_s = word.and_then(|(_, corner)| corner).map_or(0.0, |rad_per_s| 1.0 / rad_per_s);
    let all = [
        ("the sensor's lag", lag_s),
        ("the sensor's words, on average", seconds(word_clocks)),
        ("the linear law's delay", if drive == Drive::Linear { scene.model.delay_s } else { 0.0 }),
        ("synchronizer, decoder and counter", seconds(drive.lines(scene) as f64)),
        ("the held position", seconds(f64::from(u8::from(held)))),
        ("method.settling", seconds(f64::from(scene.method.settling))),
        ("the host", seconds(scene.host_clocks as f64)),
        (if duty.is_some() { "the modulator, at rest" } else { "the modulator, at most" }, seconds(modulator)),
        ("the bridge's dead time", dead_s),
    ];
    all.into_iter().map(|(what, seconds)| Wait { what, seconds }).filter(|wait| wait.seconds > 0.0).collect()
}

/// Returns the delay of a scene's loop beside sampling and holding, in s: all of its [`waits`].
pub fn delay_s(scene: &Scene) -> f64 {
    waits(scene).iter().fold(0.0, |sum, wait| sum + wait.seconds)
}
