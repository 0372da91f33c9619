//! A scene's numbers, as the precise world uses them.

use hpu_cosim::COMMAND_BITS;
use hpu_cosim::scene::{self, BridgeModel, Datapath, Device, Hand, Scene, Winding};

use crate::fixed::Fixed;
use crate::flow::{Flow, Vector};
use crate::shaft::Friction;
use crate::winding::Bridge;

/// Returns why the precise world cannot run a scene, or `None` if it can. It can if the motion is linear between
/// changes of the drive, of friction's mode and of the diodes' mode.
pub fn obstacle(scene: &Scene) -> Option<&'static str> {
    let prescribed = matches!(scene.hand, Hand::Prescribed { .. });
    match (&scene.hand, &scene.device, scene.amplifier) {
        (Hand::Capture { .. }, ..) => Some("a recording, without a device"),
        _ if scene.model.datapath == Datapath::Linear => Some("no datapath"),
        _ if !scene.model.solver.is_exact() => Some("steps"),
        _ if scene.model.winding != Winding::Inductive => Some("a winding without inductance"),
        // The electrical side has no effect on an imposed motion.
        _ if prescribed => None,
        _ if matches!(scene.model.friction, scene::Friction::Smoothed { .. }) => Some("smoothed friction"),
        (_, Device::Mass(_), Some(scene::Amplifier { shaper: Some(_), .. })) => Some("an analog shaper"),
        _ => None,
    }
}

#[derive(Clone, Copy)]
pub enum Drive {
    /// A voltage by the switching gates.
    Switching,
    /// A voltage by a duty, in the mean of the pulses (see [`Mean`]); without a period it acts at once.
    Averaged { supply_v: f64, full_scale: f64, period: Option<u64> },
    /// A force by a command.
    Force { quantum_n: f64 },
    /// No drive that moves the device.
    None,
}

/// From an edge on, the hand intends to be at an angle and to move on with a speed.
pub struct Knot {
    pub edge: u64,
    pub angle_rad: f64,
    pub speed_rad_per_s: f64,
}

/// The immutable laws of a scene.
pub struct Laws<const N: usize> {
    /// Flows with the voltage driving the current through no, one or two switches; each for a moving and for a stuck
    /// shaft.
    pub closed: [[Flow<N>; 2]; 3],
    /// Flows with a constant current (an open winding, an amplifier), for a moving and for a stuck shaft.
    pub still: [Flow<N>; 2],
    pub bridge: Bridge<N>,
    pub friction: Friction<N>,
    pub drive: Drive,
    pub per_inductance: Fixed<N>,
    pub torque_per_inertia: Fixed<N>,
    pub hand_damping_per_inertia: Fixed<N>,
    pub edge_s: Fixed<N>,
    pub prescribed: bool,
    pub knots: Vec<Knot>,
    pub start: Vector<N>,
    pub count_rad: f64,
}

impl<const N: usize> Laws<N> {
    /// Creates the laws of a scene without an [`obstacle`].
    pub fn new(scene: &Scene) -> Self {
        assert_eq!(obstacle(scene), None);
        let prescribed = matches!(scene.hand, Hand::Prescribed { .. });
        let zero = Fixed::ZERO;
        let [resistance, inductance, constant, inertia, viscous] = match &scene.device {
            Device::Motor(motor) => [
                Fixed::of(motor.resistance_ohm),
                Fixed::of(motor.inductance_h),
                Fixed::of(motor.torque_constant_nm_per_a),
                Fixed::of(motor.inertia_kg_m2()),
                Fixed::of(motor.viscous_friction_nm_s_per_rad),
            ],
            Device::Mass(mass) => {
                [zero, Fixed::whole(1), Fixed::whole(1), Fixed::of(mass.mass_kg), Fixed::of(mass.damping_n_s_per_m)]
            }
        };
        let (torque, grip, grip_damping, path) = match &scene.hand {
            Hand::ConstantTorque { torque_nm } => (Fixed::of(*torque_nm), zero, zero, &[][..]),
            Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path } => {
                (zero, Fixed::of(*stiffness_nm_per_rad), Fixed::of(*damping_nm_s_per_rad), &path[..])
            }
            Hand::Prescribed { path } => (zero, zero, zero, &path[..]),
            Hand::None | Hand::Capture { .. } => (zero, zero, zero, &[][..]),
        };
        let (per_inductance, per_inertia) = (inductance.reciprocal(), inertia.reciprocal());
        let winding = |switches| {
            let resistance = resistance + Fixed::whole(switches) * Fixed::of(scene.bridge.on_resistance_ohm);
            [-(resistance * per_inductance), -(constant * per_inductance), zero]
        };
        let shaft = [constant * per_inertia, -((viscous + grip_damping) * per_inertia), -(grip * per_inertia)];
        let shaft = if prescribed { [zero; 3] } else { shaft };
        let angle = [zero, Fixed::whole(1), zero];
        let edge_s = scene.clock.period_s();
        let coulomb = match &scene.device {
            _ if prescribed || scene.model.friction == scene::Friction::None => 0.0,
            Device::Motor(motor) => motor.coulomb_friction_nm,
            Device::Mass(mass) => mass.coulomb_n,
        };
        let start = match &scene.device {
            Device::Motor(motor) => [motor.initial_current_a, motor.initial_speed_rad_per_s, motor.initial_angle_rad],
            Device::Mass(mass) => [0.0, mass.initial_speed_m_per_s, mass.initial_position_m],
        };
        let bits = if scene.model.datapath == Datapath::Law { COMMAND_BITS } else { scene.method.pwm.bits };
        let full_scale = 2f64.powi(bits as i32);
        let supply_v = scene.bridge.supply_v;
        let drive = match (&scene.device, scene.model.bridge) {
            _ if prescribed => Drive::None,
            (Device::Mass(_), _) => {
                let amplifier = scene.amplifier.expect("a mass in words has an amplifier");
                Drive::Force { quantum_n: amplifier.full_scale_n / full_scale }
            }
            (_, BridgeModel::Switching) => Drive::Switching,
            (_, BridgeModel::Averaged) => {
                let period = scene.method.pwm.latched.then(|| 1 << scene.method.pwm.bits);
                Drive::Averaged { supply_v, full_scale, period }
            }
        };
        Self {
            closed: [0, 1, 2]
                .map(|switches| [shaft, [zero; 3]].map(|shaft| Flow::new([winding(switches), shaft, angle], edge_s))),
            still: [shaft, [zero; 3]].map(|shaft| Flow::new([[zero; 3], shaft, angle], edge_s)),
            bridge: Bridge {
                supply_v: Fixed::of(supply_v),
                drop_v: Fixed::of(scene.bridge.diode_drop_v),
                constant,
                plus: None,
                minus: None,
            },
            friction: Friction { row: shaft, least: Fixed::of(coulomb) * per_inertia },
            drive,
            per_inductance,
            torque_per_inertia: torque * per_inertia,
            hand_damping_per_inertia: grip_damping * per_inertia,
            edge_s: Fixed::of(edge_s),
            prescribed,
            knots: knots(path, scene),
            start: start.map(Fixed::of),
            count_rad: scene.encoder.count_rad(),
        }
    }
}

/// Returns the path's knots on the clock: its start, and wherever its speed changes.
fn knots(path: &[scene::PathPoint], scene: &Scene) -> Vec<Knot> {
    let edge = |point: &scene::PathPoint| scene.clock.edges(point.time_s);
    let mut knots = Vec::new();
    if let Some(first) = path.first().filter(|first| edge(first) > 0) {
        knots.push(Knot { edge: 0, angle_rad: first.angle_rad, speed_rad_per_s: 0.0 });
    }
    for (index, point) in path.iter().enumerate() {
        let speed_rad_per_s = path.get(index + 1).filter(|next| edge(next) > edge(point)).map_or(0.0, |next| {
            (next.angle_rad - point.angle_rad) / ((edge(next) - edge(point)) as f64 * scene.clock.period_s())
        });
        knots.push(Knot { edge: edge(point), angle_rad: point.angle_rad, speed_rad_per_s });
    }
    knots
}
