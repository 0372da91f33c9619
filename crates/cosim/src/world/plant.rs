//! The immutable laws of a scene's world: its axis and hand, or a recording in their place.

use std::fmt;

use hpu_plant::network::{MOST_STATES, NetworkLaws};
use hpu_plant::pmsm::{Harmonic, Inverter, Pmsm, PmsmMotor};
use hpu_plant::{Axis, Bridge, Hand, Motor, Push};
use hpu_signal::Clock;

use crate::result::stays::Places;
use crate::world::actuator::{Actuator, Latch, Shaping};
use crate::world::encoder::Pins;
use crate::world::faults::FaultPlan;
use crate::world::stepped::Stepping;
use hpu_scene::{self, BridgeModel, COMMAND_BITS, Compound, Datapath, Friction, PathPoint, Scene, Sensor, Winding};

/// The reason why a scene has no plant of this kind.
#[derive(Clone, PartialEq, Debug)]
pub struct PlantError(String);

impl fmt::Display for PlantError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for PlantError {}

/// From an edge on, the hand intends to be at an angle and to move on with a speed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Knot {
    pub(crate) edge: u64,
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
}

#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(crate) enum Kind {
    Axis {
        axis: Axis,
        current_a: f64,
        speed_rad_per_s: f64,
        angle_rad: f64,
        knots: Vec<Knot>,
    },
    /// `grip_ratio` are the units of the body at the grip for one of the body with the encoder.
    Network {
        laws: AnyLaws,
        angle_rad: f64,
        grip_ratio: f64,
        knots: Vec<Knot>,
        sensors: Vec<Sensor>,
        /// The index of the sensor whose words the encoder's lines follow, and the bits of these words.
        followed: Option<(usize, u32)>,
        seed: u64,
    },
    /// `effort_per_a` is the torque for one ampere across the magnets' axis. The laws have tables, which other worlds
    /// must not move about.
    Pmsm {
        laws: Box<Pmsm>,
        effort_per_a: f64,
        grip_ratio: f64,
        start: [f64; 2],
        knots: Vec<Knot>,
        sensors: Vec<Sensor>,
        seed: u64,
    },
    Capture {
        pins: Vec<(u64, Pins)>,
    },
}

/// The laws of a network, by the registers that its states fill.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(crate) enum AnyLaws {
    Small(NetworkLaws<SMALL>),
    Large(NetworkLaws<MOST_STATES>),
}

/// The most states of a small network. In a page both sizes are one: it loads half of the code, and runs have the same
/// bits.
pub(crate) const SMALL: usize = if cfg!(target_family = "wasm") { MOST_STATES } else { 8 };

/// The immutable laws of a scene's world.
pub struct Plant {
    pub(crate) kind: Kind,
    pub(crate) count_rad: f64,
    pub(crate) actuator: Actuator,
    pub(crate) edge_s: f64,
    /// Edges from a command to the actuator: those of a host between both.
    pub(crate) late: u64,
    /// Edges of a period of the modulator, if its gates drive the device.
    pub(crate) modulator: Option<u64>,
    /// The stepping of the device, if it is stepped.
    pub(crate) stepping: Option<Stepping>,
    /// The faults between device and logic.
    pub(crate) faults: Option<FaultPlan>,
    /// The places of the device that are told apart.
    pub(crate) places: Places,
}

/// The parts of a scene that make up its world.
pub(crate) struct Around<'a> {
    pub(crate) device: &'a hpu_scene::Device,
    pub(crate) network: Option<&'a Compound>,
    pub(crate) pmsm: Option<&'a hpu_scene::Pmsm>,
    pub(crate) bridge: Bridge,
    pub(crate) hand: &'a hpu_scene::Hand,
    pub(crate) friction: Friction,
    pub(crate) winding: Winding,
    pub(crate) clock: Clock,
    pub(crate) count_rad: f64,
    pub(crate) actuator: Actuator,
    /// Edges of a period of the modulator, if its gates drive the device.
    pub(crate) modulator: Option<u64>,
    pub(crate) stepping: Option<Stepping>,
    pub(crate) faults: Option<FaultPlan>,
    /// The places of the device that are told apart.
    pub(crate) places: Places,
    /// The farthest that the world looks, in edges.
    pub(crate) horizon: u64,
    /// The seed of the noise of a network's sensors.
    pub(crate) seed: u64,
    /// Edges from a command to the actuator: the host's.
    pub(crate) late: u64,
}

impl Plant {
    /// Creates the world of a scene.
    ///
    /// # Errors
    ///
    /// When a parameter is impossible, or a mass has no amplifier.
    pub fn new(scene: &Scene) -> Result<Self, PlantError> {
        Self::around(Around {
            device: &scene.device,
            network: scene.network.as_deref(),
            pmsm: None,
            bridge: scene.bridge,
            hand: &scene.hand,
            friction: scene.model.friction,
            winding: scene.model.winding,
            clock: scene.clock,
            count_rad: scene.encoder.count_rad(),
            actuator: actuator(scene)?,
            modulator: scene.modulator_clocks(),
            stepping: stepping(scene),
            faults: scene.faults.as_ref().map(|all| FaultPlan::new(all, scene.clock, scene.run, scene.edges())),
            places: Places { wall: scene.wall_count(), reach: scene.reach() },
            // A step may be longer than the part of it that is run.
            horizon: scene.edges().max(scene.step_clocks()),
            late: scene.host_clocks,
            seed: scene.run.seed,
        })
    }

    /// Creates the world from these parts.
    pub(crate) fn around(around: Around) -> Result<Self, PlantError> {
        let Around { device, bridge, hand, friction, winding, clock, horizon, .. } = around;
        let Around { count_rad, actuator, late, modulator, stepping, faults, places, .. } = around;
        let edge_s = clock.period_s();
        if let hpu_scene::Hand::Capture { edges } = hand {
            let pins = edges
                .iter()
                .map(|edge| {
                    let pins = Pins { a: i64::from(edge.a), b: i64::from(edge.b) };
                    (clock.first_edge_at(edge.picoseconds.unsigned_abs()).0, pins)
                })
                .collect();
            return Ok(Self {
                kind: Kind::Capture { pins },
                count_rad,
                actuator,
                edge_s,
                late,
                modulator,
                stepping: None,
                faults,
                places,
            });
        }
        if let Some(compound) = around.network {
            let kind = network(compound, around.friction, (clock, horizon), around.seed)?;
            return Ok(Self { kind, count_rad, actuator, edge_s, late, modulator, stepping: None, faults, places });
        }
        let (hand, path) = match hand {
            hpu_scene::Hand::ConstantTorque { torque_nm } => (Hand::Torque(*torque_nm), &[][..]),
            hpu_scene::Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path } => (
                Hand::Spring(Push {
                    stiffness_nm_per_rad: *stiffness_nm_per_rad,
                    damping_nm_s_per_rad: *damping_nm_s_per_rad,
                }),
                &path[..],
            ),
            hpu_scene::Hand::Prescribed { path } => (Hand::Prescribed, &path[..]),
            hpu_scene::Hand::None | hpu_scene::Hand::Capture { .. } => (Hand::Torque(0.0), &[][..]),
        };
        let rubs = friction != Friction::None;
        if let Some(motor) = around.pmsm.filter(|_| !cfg!(target_family = "wasm")) {
            let laws = Box::new(pmsm(motor, bridge, rubs, edge_s)?);
            let (sensors, seed) = (motor.sensors.clone(), around.seed);
            let kind = Kind::Pmsm {
                laws,
                effort_per_a: motor.torque_constant_nm_per_a(),
                start: motor.start,
                grip_ratio: motor.around.grip_ratio,
                knots: knots(&motor.around.path, clock),
                sensors,
                seed,
            };
            return Ok(Self { kind, count_rad, actuator, edge_s, late, modulator, stepping: None, faults, places });
        }
        let axis = axis(device, (bridge, winding), hand, friction, (edge_s, horizon))?;
        let (current_a, mut speed_rad_per_s, mut angle_rad) = match device {
            hpu_scene::Device::Motor(motor) => {
                (motor.initial_current_a, motor.initial_speed_rad_per_s, motor.initial_angle_rad)
            }
            hpu_scene::Device::Mass(mass) => (0.0, mass.initial_speed_m_per_s, mass.initial_position_m),
        };
        let knots = knots(path, clock);
        if let (Hand::Prescribed, Some(first)) = (hand, knots.first()) {
            (angle_rad, speed_rad_per_s) = (first.angle_rad, first.speed_rad_per_s);
        }
        let kind = Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, knots };
        Ok(Self { kind, count_rad, actuator, edge_s, late, modulator, stepping, faults, places })
    }

    /// Returns whether there is a device, not a recording in its place.
    pub fn has_device(&self) -> bool {
        !matches!(self.kind, Kind::Capture { .. })
    }

    /// Returns the drive's torque or force for one ampere, and the hand's units for one of the encoder; `None` of a
    /// recording.
    pub(crate) fn effort(&self) -> Option<(f64, f64)> {
        match &self.kind {
            Kind::Axis { axis, .. } => Some((axis.torque_constant_nm_per_a(), 1.0)),
            Kind::Network { laws: AnyLaws::Small(laws), grip_ratio, .. } => Some((laws.effort_per_a(), *grip_ratio)),
            Kind::Network { laws: AnyLaws::Large(laws), grip_ratio, .. } => Some((laws.effort_per_a(), *grip_ratio)),
            Kind::Pmsm { effort_per_a, grip_ratio, .. } => Some((*effort_per_a, *grip_ratio)),
            Kind::Capture { .. } => None,
        }
    }
}

/// Returns the laws of a motor or a mass.
fn axis(
    device: &hpu_scene::Device,
    (bridge, winding): (Bridge, Winding),
    hand: Hand,
    friction: Friction,
    (edge_s, horizon): (f64, u64),
) -> Result<Axis, PlantError> {
    let rubs = friction != Friction::None;
    match device {
        hpu_scene::Device::Motor(motor) => {
            let shaft = Motor {
                resistance_ohm: motor.resistance_ohm,
                inductance_h: motor.inductance_h,
                torque_constant_nm_per_a: motor.torque_constant_nm_per_a,
                inertia_kg_m2: motor.inertia_kg_m2(),
                viscous_nm_s_per_rad: motor.viscous_friction_nm_s_per_rad,
                coulomb_nm: if rubs { motor.coulomb_friction_nm } else { 0.0 },
            };
            Axis::new(shaft, bridge, hand, edge_s, horizon).map(|axis| match winding {
                Winding::Inductive => axis,
                Winding::Resistive => axis.without_inductance(),
            })
        }
        hpu_scene::Device::Mass(mass) => {
            let body = Motor::on_rail(mass.mass_kg, mass.damping_n_s_per_m, if rubs { mass.coulomb_n } else { 0.0 });
            Axis::amplified(body, hand, edge_s, horizon)
        }
    }
    .and_then(|axis| match friction {
        Friction::Smoothed { speed_rad_per_s } => axis.with_smoothed_friction(speed_rad_per_s),
        Friction::StickSlip | Friction::None => Ok(axis),
    })
    .map_err(|error| PlantError(error.to_string()))
}

/// Returns the laws of a motor with three phases on its bridge, with or without friction.
fn pmsm(motor: &hpu_scene::Pmsm, bridge: Bridge, rubs: bool, edge_s: f64) -> Result<Pmsm, PlantError> {
    let [direct_h, quadrature_h] = motor.inductance_h;
    let harmonic =
        |&[order, amplitude_nm, phase_rad]: &[f64; 3]| Harmonic { order: order as u32, amplitude_nm, phase_rad };
    let laws = PmsmMotor {
        pole_pairs: motor.pole_pairs,
        resistance_ohm: motor.resistance_ohm,
        direct_h,
        quadrature_h,
        flux_vs: motor.flux_wb,
        inertia_kg_m2: motor.inertia_kg_m2,
        viscous_nm_s_per_rad: motor.viscous_nm_s_per_rad,
        coulomb_nm: if rubs { motor.coulomb_nm } else { 0.0 },
        stiction_nm: if rubs { motor.stiction_nm } else { 0.0 },
        cogging: motor.cogging.iter().map(harmonic).collect(),
    };
    let inverter = Inverter {
        supply_v: bridge.supply_v,
        supply_ohm: motor.supply_ohm,
        on_resistance_ohm: bridge.on_resistance_ohm,
        diode_drop_v: bridge.diode_drop_v,
    };
    let mut network = motor.around.network.clone();
    for body in network.bodies.iter_mut().filter(|_| !rubs) {
        (body.coulomb, body.stiction) = (0.0, 0.0);
    }
    // The rotor's own inertia and friction are the motor's.
    let rotor = &mut network.bodies[0];
    (rotor.inertia, rotor.viscous, rotor.coulomb, rotor.stiction) = (0.0, 0.0, 0.0, 0.0);
    Pmsm::around(laws, inverter, &network, edge_s).map_err(|error| PlantError(error.to_string()))
}

/// Returns the steps of the scene's solver.
fn stepping(scene: &Scene) -> Option<Stepping> {
    if scene.model.solver.is_exact() {
        return None;
    }
    let edges = scene.step_clocks();
    Some(Stepping { method: scene.model.solver.method(), first: edges, edges })
}

/// Returns the actuator of the scene's device.
fn actuator(scene: &Scene) -> Result<Actuator, PlantError> {
    let bits = if scene.model.datapath == Datapath::Law { COMMAND_BITS } else { scene.method.pwm.bits };
    let full_scale = 2f64.powi(bits.cast_signed());
    if let Some(dac) = scene.network.as_deref().and_then(|compound| compound.dac) {
        return Ok(Actuator::Converted { dac, width: bits, sign: -1.0 });
    }
    match (scene.has_bridge(), &scene.amplifier, scene.model.bridge) {
        (true, _, BridgeModel::Switching) if scene.host_clocks > 0 => {
            let words = scene.words().map_err(|error| PlantError(error.to_string()))?;
            Ok(Actuator::Modulated(words.config.pwm))
        }
        (true, _, BridgeModel::Switching) => Ok(Actuator::Switching),
        (true, _, BridgeModel::Averaged) => {
            let pwm = scene.method.pwm;
            let latch = pwm.latched.then(|| Latch::new(1 << pwm.bits, pwm.antiphase));
            Ok(Actuator::Averaged { full_scale, latch })
        }
        (false, Some(amplifier), _) => {
            let shaping = amplifier
                .shaper
                .map(|shaper| Shaping::new(shaper.cutoff_hz, scene.clock.period_s(), scene.clock.edges(shaper.hold_s)));
            Ok(Actuator::Amplified { quantum_n: amplifier.full_scale_n / full_scale, shaping })
        }
        (false, None, _) => Err(PlantError("a mass in words needs an amplifier".into())),
    }
}

/// Returns the laws of a network and the knots of its hand.
fn network(
    compound: &Compound,
    friction: Friction,
    (clock, horizon): (Clock, u64),
    seed: u64,
) -> Result<Kind, PlantError> {
    let mut network = compound.network.clone();
    if friction == Friction::None {
        for body in &mut network.bodies {
            (body.coulomb, body.stiction) = (0.0, 0.0);
        }
    }
    let angle_rad = network.bodies[network.seen].position;
    let reduced = network.reduced().map_err(|error| PlantError(error.to_string()))?;
    let edge_s = clock.period_s();
    let laws = if reduced.size() <= SMALL {
        AnyLaws::Small(NetworkLaws::new(reduced, edge_s, horizon))
    } else {
        AnyLaws::Large(NetworkLaws::new(reduced, edge_s, horizon))
    };
    let (knots, sensors) = (knots(&compound.path, clock), compound.sensors.clone());
    let followed = compound.followed.zip(compound.word().map(|(word, _)| word.bits));
    Ok(Kind::Network { laws, angle_rad, grip_ratio: compound.grip_ratio, knots, sensors, followed, seed })
}

/// Returns the path as knots on clock edges: one at its start, and one wherever its speed changes.
fn knots(path: &[PathPoint], clock: Clock) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::with_capacity(path.len() + 1);
    let points: Vec<(u64, f64)> = path.iter().map(|p| (clock.edges(p.time_s), p.angle_rad)).collect();
    if let Some(&(edge, angle_rad)) = points.first()
        && edge > 0
    {
        knots.push(Knot { edge: 0, angle_rad, speed_rad_per_s: 0.0 });
    }
    for (index, &(edge, angle_rad)) in points.iter().enumerate() {
        let speed_rad_per_s = match points.get(index + 1) {
            Some(&(next, there)) if next > edge => (there - angle_rad) / ((next - edge) as f64 * clock.period_s()),
            _ => 0.0,
        };
        knots.push(Knot { edge, angle_rad, speed_rad_per_s });
    }
    knots
}
