//! The slowest decay of an axis with its hand, in front of its wall and in it.

use hpu_scene::{Device, Scene};

/// The greatest time constants of an axis, of which the law's delays are left out: those of `m x'' + b x' + k x = 0`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct TimeConstants {
    wall: f64,
    /// In front of the wall and in it; `None` where nothing damps.
    before_s: Option<f64>,
    inside_s: Option<f64>,
}

impl TimeConstants {
    /// Returns those of a scene. A motor brakes itself through a bridge whose off phase is a brake; a network counts as
    /// rigid.
    pub(crate) fn of(scene: &Scene) -> Self {
        let floats = scene.method.pwm.floating || scene.network.as_ref().is_some_and(|it| it.dac.is_some());
        let (inertia, viscous) = match &scene.device {
            Device::Motor(motor) => {
                let constant = motor.torque_constant_nm_per_a;
                let brakes = constant * constant / (motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm);
                let braked = if floats { 0.0 } else { brakes };
                (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad + braked)
            }
            Device::Mass(mass) => (mass.mass_kg, mass.damping_n_s_per_m),
        };
        let (grip, grip_damping) = scene.hand.grip();
        let wall = scene.wall;
        let slowest =
            |stiffness: f64, damping: f64| slowest_s(inertia, viscous + grip_damping + damping, grip + stiffness);
        Self {
            wall: wall.position_rad,
            before_s: slowest(0.0, 0.0),
            inside_s: slowest(wall.stiffness_nm_per_rad, wall.damping_nm_s_per_rad),
        }
    }

    /// Returns the greatest time constant at a position, in s.
    pub(crate) fn at(&self, position: f64) -> Option<f64> {
        if position < self.wall { self.before_s } else { self.inside_s }
    }
}

/// Returns the greatest time constant of `m x'' + b x' + k x = 0`; without a stiffness, that of the speed.
fn slowest_s(mass: f64, damping: f64, stiffness: f64) -> Option<f64> {
    let under_root = damping * damping - 4.0 * mass * stiffness;
    let slowest = if stiffness <= 0.0 {
        mass / damping
    } else if under_root <= 0.0 {
        2.0 * mass / damping
    } else {
        (damping + under_root.sqrt()) / (2.0 * stiffness)
    };
    (damping > 0.0).then_some(slowest)
}
