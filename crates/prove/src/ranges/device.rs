//! Limits of the device that no command can exceed: current, speed and angle of its shaft.
//!
//! The voltage between the bridge's terminals is at most the supply and two diodes, whatever the gates do. Friction is
//! a torque of at most its Coulomb value. A hand that holds the shaft by spring and damper becomes a part of the
//! device's linear system, and drives it by the speed of its path, `e = angle - path`:
//!
//! | | |
//! |---|---|
//! | `L di/dt = V - R i - K w` | `V` within what the bridge gives |
//! | `J dw/dt = K i - (B + b_h) w - k_h e + b_h v_h - f` | friction `f` within its Coulomb value |
//! | `de/dt = w - v_h` | `v_h` within the speeds of the path |
//!
//! The reach of each input is an integral of its impulse response ([`Flow`]). Where the commands are known to be
//! one-sided, so is the voltage. A switching bridge gives its commanded voltage only as the mean over a period; that
//! costs at most a period's change of the response.

use hpu_cosim::scene::{BridgeModel, Device, Hand, PathPoint, Scene};
use hpu_datapath::LoopConfig;

use super::Limit;
use super::response::{Flow, Parts};
use super::system::{Channel, System};
use crate::Error;
use crate::interval::Interval;

/// Limits of the shaft's motion, for any command within a range.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Speeds, in rad/s.
    pub speed: Interval,
    /// Angles, in rad; `None` where nothing holds the shaft back.
    pub angle: Option<Interval>,
    /// The winding's current, in A; `None` for a mass.
    pub current: Option<Interval>,
    /// The assumptions of the limits.
    pub why: Vec<String>,
}

impl Motion {
    /// Returns the limits as rows for a report.
    pub fn limits(&self, scene: &Scene) -> Vec<Limit> {
        let units = scene.device.units();
        let speed = if units.position == "m" { "m/s" } else { "rad/s" };
        let why = self.why.join("; ");
        let limit = |name, unit, range: Interval| Limit { name, unit, min: range.lo, max: range.hi, why: why.clone() };
        let mut all = vec![limit("speed", speed, self.speed)];
        all.extend(self.angle.map(|angle| limit("angle", units.position, angle)));
        all.extend(self.current.map(|current| limit("current", "A", current)));
        all
    }
}

/// A scene's device and hand as a linear system under bounded inputs.
pub struct Shaft<'s> {
    scene: &'s Scene,
    drive: Channel,
    torque: Channel,
    path: Channel,
    /// The remaining effect of the start: on speed, and on the distance from the hand.
    start: [Interval; 2],
    /// The largest remaining effect of a pulse of the drive, per volt second (per newton second).
    pulse: [f64; 2],
    /// The path's angles and speeds; without a hand, the start's angle and no speed.
    intended: [Interval; 2],
    held: bool,
    why: Vec<String>,
}

/// The assumption about a mass that nothing holds back.
const WITHIN: &str = "the mass stays within half the counter's range of the wall";

/// An upper bound of the clock cycles until the modulator has its first command.
const EARLY_EDGES: f64 = 4.0;

/// Returns the hull of 0 and these values.
pub fn around_zero(values: impl IntoIterator<Item = f64>) -> Interval {
    values.into_iter().fold(Interval::ZERO, |all, value| Interval { lo: all.lo.min(value), hi: all.hi.max(value) })
}

fn hull(values: impl IntoIterator<Item = f64>) -> Interval {
    let none = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    values.into_iter().fold(none, |all, value| Interval { lo: all.lo.min(value), hi: all.hi.max(value) })
}

/// Returns whether the current may ever flow through diodes.
fn has_diodes(scene: &Scene) -> bool {
    // Before the first edge all gates are off, so a shaft that turns or a current that flows at the start freewheels.
    let coasts = matches!(scene.device, Device::Motor(motor)
        if motor.initial_current_a != 0.0 || motor.initial_speed_rad_per_s != 0.0);
    let switches = scene.has_bridge() && scene.model.bridge == BridgeModel::Switching;
    switches && (scene.method.pwm.floating || scene.method.pwm.dead_time_s > 0.0 || coasts)
}

/// Returns the range of angles and the range of speeds of a path.
fn path_range(path: &[PathPoint], scene: &Scene) -> Option<[Interval; 2]> {
    let edges: Vec<u64> = path.iter().map(|point| scene.clock.edges(point.time_s)).collect();
    if edges.windows(2).any(|pair| pair[0] == pair[1]) {
        return None;
    }
    let steps = path.windows(2).zip(edges.windows(2));
    let speeds = steps.map(|(points, edges)| {
        (points[1].angle_rad - points[0].angle_rad) / ((edges[1] - edges[0]) as f64 * scene.clock.period_s())
    });
    // One part in 2^40 covers the roundings.
    let slack = Interval::exact(1.0 + 2f64.powi(-40));
    Some([hull(path.iter().map(|point| point.angle_rad)), around_zero(speeds).times(slack)])
}

impl<'s> Shaft<'s> {
    /// Makes the shaft of a scene.
    ///
    /// # Errors
    ///
    /// Why it has no such system: a recording, a path that jumps, a circuit that is not one linear system.
    pub fn new(scene: &'s Scene) -> Result<Self, Error> {
        if scene.bridge.on_resistance_ohm > 0.0 && has_diodes(scene) {
            return Err("the circuit's resistance is another one while diodes conduct".into());
        }
        let start_rad = scene.initial_angle_rad();
        let (path, grip) = match &scene.hand {
            Hand::Capture { .. } => return Err("a recording stands in the place of the device".into()),
            Hand::SpringDamper { path, .. } | Hand::Prescribed { path } => (&path[..], scene.hand.grip()),
            Hand::None | Hand::ConstantTorque { .. } => (&[][..], (0.0, 0.0)),
        };
        let held = grip.0 > 0.0;
        let intended = if path.is_empty() {
            [Interval::exact(start_rad), Interval::ZERO]
        } else {
            path_range(path, scene).ok_or("the hand's path jumps")?
        };
        let mut why = vec!["the hand's path keeps to the angles and speeds of the scene's".to_string()];
        if path.is_empty() {
            why.clear();
        }
        let system = System::new(scene, grip, held);
        let flow = Flow::forever(&system.a).unwrap_or_else(|| {
            why.push(format!("for the {} s of the run", scene.run.duration_s));
            Flow::until(&system.a, scene.run.duration_s * (1.0 + 2f64.powi(-40)))
        });
        let outputs = system.outputs(&flow);
        let channel = |b: &[Interval]| system.channel(&outputs, b);
        let gap_rad = path
            .first()
            .map_or(Interval::ZERO, |point| Interval::exact(start_rad).minus(Interval::exact(point.angle_rad)));
        let first = system.start(scene, gap_rad);
        let [speed, _, gap] = &outputs;
        let start = [speed.swing(&first), gap.swing(&first)];
        let pulse = [speed.swing(&system.drive).size(), gap.swing(&system.drive).size()];
        let (drive, torque, path) = (channel(&system.drive), channel(&system.torque), channel(&system.path));
        Ok(Self { scene, drive, torque, path, start, pulse, intended, held, why })
    }

    /// Returns the limits that no command can exceed whose PWM counts stay in this range; `2^width` of them are all of
    /// the supply. Of the loop's widths, only those of its modulator and its position matter.
    pub fn motion(&self, command: (i128, i128), config: &LoopConfig) -> Motion {
        let Self { scene, intended: [angles, speeds], .. } = self;
        let mut why = self.why.clone();
        if let Hand::Prescribed { .. } = scene.hand {
            let current = self.current(*speeds);
            return Motion { speed: *speeds, angle: Some(*angles), current, why };
        }
        let share = |count: i128| (count as f64 / 2f64.powi(config.pwm.width.cast_signed())).clamp(-1.0, 1.0);
        // A positive command pushes in the negative direction.
        let shares = Interval { lo: -share(command.1).max(0.0), hi: -share(command.0).min(0.0) };
        let (most, pulsed, text) = self.most_drive();
        why.push(text);
        let one_sided =
            !scene.method.pwm.antiphase && !scene.method.pwm.floating && scene.method.pwm.dead_time_s == 0.0;
        let driven = |parts: Parts, bend: f64| {
            if !one_sided {
                return parts.driven(Interval { lo: -most, hi: most });
            }
            let period_s = 2f64.powi(config.pwm.width.cast_signed()) * scene.clock.period_s();
            let spill = if pulsed { (period_s * bend).next_up() } else { 0.0 };
            // Pulses that fill a share of the period reach no more than the whole period, and no more than the best
            // part of the period of that share.
            let reach = |part: f64, share: f64| {
                let mean = (share.abs() * (part + spill).next_up()).next_up();
                (most * if share == 0.0 { 0.0 } else { part.min(mean) }).next_up()
            };
            Interval {
                lo: -(reach(parts.positive, shares.lo) + reach(parts.negative, shares.hi)).next_up(),
                hi: (reach(parts.positive, shares.hi) + reach(parts.negative, shares.lo)).next_up(),
            }
        };
        let (coulomb, mass) = match scene.device {
            Device::Motor(motor) => (motor.coulomb_friction_nm, None),
            Device::Mass(mass) => (mass.coulomb_n, Some(mass)),
        };
        let push = match scene.hand {
            Hand::ConstantTorque { torque_nm } => around_zero([torque_nm]),
            _ => Interval::ZERO,
        };
        let torque = push.plus(Interval { lo: -coulomb, hi: coulomb });
        // Commands have no effect before the first edge.
        let early_s = if has_diodes(scene) { EARLY_EDGES * scene.clock.period_s() } else { 0.0 };
        let all = |drive: Parts, torques: Parts, path: Parts, of: usize| {
            let early = (most * early_s * self.pulse[of]).next_up();
            let start = self.start[of].plus(Interval { lo: -early, hi: early });
            driven(drive, self.drive.bends[of]).plus(torques.driven(torque)).plus(path.driven(*speeds)).plus(start)
        };
        let mut speed = all(self.drive.speed, self.torque.speed, self.path.speed, 0);
        if let (Some(mass), Hand::None | Hand::ConstantTorque { .. }) = (mass, &scene.hand) {
            // Between two turns, the work is at most that of the greatest force over the whole travel.
            let travel_m = 2f64.powi(config.position_width.cast_signed()) * scene.encoder.count_rad();
            let energy = mass.initial_speed_m_per_s.powi(2) + 2.0 * (most + push.size()) * travel_m / mass.mass_kg;
            let most_m_per_s = energy.sqrt() * (1.0 + 2f64.powi(-40));
            speed = Interval { lo: speed.lo.max(-most_m_per_s), hi: speed.hi.min(most_m_per_s) };
            why.push(WITHIN.into());
        }
        let angle = match (self.drive.angle, self.torque.angle, self.path.angle) {
            (Some(drive), Some(torque), Some(path)) if self.held => Some(all(drive, torque, path, 1).plus(*angles)),
            _ => None,
        };
        if one_sided && (shares.lo > -1.0 || shares.hi < 1.0) {
            why.push(format!("commands between {} and {} PWM counts", command.0, command.1));
        }
        Motion { speed, angle, current: self.current(speed), why }
    }

    /// Returns the largest voltage, or force; whether it comes in pulses; and a text that describes it.
    fn most_drive(&self) -> (f64, bool, String) {
        let scene = self.scene;
        if let Some(amplifier) = scene.amplifier.filter(|_| matches!(scene.device, Device::Mass(_))) {
            let most_n = amplifier.full_scale_n;
            return (most_n, false, format!("the amplifier gives at most {most_n} N"));
        }
        let supply_v = scene.bridge.supply_v;
        if scene.model.bridge == BridgeModel::Averaged {
            return (supply_v, false, format!("the bridge gives at most {supply_v} V"));
        }
        if has_diodes(scene) {
            let most_v = supply_v + 2.0 * scene.bridge.diode_drop_v;
            return (most_v.next_up(), true, format!("bridge and diodes give at most {most_v} V"));
        }
        (supply_v, true, format!("the bridge gives at most {supply_v} V"))
    }

    /// `abs(i) <= max(abs(i_0), (V + K w) / R)`: a greater current falls.
    fn current(&self, speed: Interval) -> Option<Interval> {
        let Device::Motor(motor) = self.scene.device else { return None };
        let emf_v = (motor.torque_constant_nm_per_a * speed.size()).next_up();
        let most_v = self.scene.bridge.supply_v + 2.0 * self.scene.bridge.diode_drop_v;
        let most_a = ((most_v + emf_v).next_up() / motor.resistance_ohm).next_up().max(motor.initial_current_a.abs());
        Some(Interval { lo: -most_a, hi: most_a })
    }
}
