//! A three-phase motor, as scenes have it: `device.kind = "pmsm"`.

pub(crate) mod rows;

use std::sync::Arc;

use hpu_plant::Bridge;
use hpu_plant::network::{Body, Feed, FeedKind, Network};
use hpu_signal::Clock;
use toml_edit::Item;

use crate::axis::network::{Compound, around};
use crate::axis::parts::{Device, Encoder, Hand};
use crate::axis::read_device::{Kind, bridge, encoder};
use crate::axis::read_hand::{Load, Recorded, hand};
use crate::axis::sensors::Sensor;
use crate::pmsm::rows::{COGGING, pmsm as key};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{ANGLE, Axis, Sense, TORQUE};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::text::message::number;

/// The most harmonics of a cogging torque.
const MOST_HARMONICS: usize = hpu_plant::pmsm::MOST_HARMONICS;

/// A synchronous motor with permanent magnets and three phases in a star; its inverter is the scene's bridge, with
/// three legs.
#[derive(Clone, PartialEq, Debug)]
pub struct Pmsm {
    /// Pairs of poles.
    pub pole_pairs: u32,
    /// Resistance of a phase.
    pub resistance_ohm: f64,
    /// Inductances along the magnets' axis, d, and across it, q.
    pub inductance_h: [f64; 2],
    /// Flux of the magnets through a phase, at its peak.
    pub flux_wb: f64,
    /// Inertia of rotor and what turns with it.
    pub inertia_kg_m2: f64,
    /// Viscous friction.
    pub viscous_nm_s_per_rad: f64,
    /// Coulomb friction.
    pub coulomb_nm: f64,
    /// Friction up to which the rotor sticks, at least Coulomb friction.
    pub stiction_nm: f64,
    /// The cogging torque: of each harmonic its order in a turn, its amplitude in N·m and its phase in rad.
    pub cogging: Vec<[f64; 3]>,
    /// Resistance of the supply.
    pub supply_ohm: f64,
    /// Angle and speed at the start.
    pub start: [f64; 2],
    /// The rotor with the bodies, joints and stops around it, and with the hand.
    pub around: Arc<Compound>,
    /// The sensors beside the encoder.
    pub sensors: Vec<Sensor>,
}

impl Pmsm {
    /// Returns whether nothing is around the rotor but the hand, no other body, stop, spring or sensor of a position,
    /// and friction at rest is that in motion.
    pub fn is_alone(&self) -> bool {
        let Network { bodies, stops, sensed, .. } = &self.around.network;
        let is_free = bodies[0].spring == 0.0 && bodies[0].constant == 0.0;
        bodies.len() == 1 && stops.is_empty() && sensed.is_empty() && is_free && self.stiction_nm == self.coulomb_nm
    }

    /// Returns the rotor with what is around it, driven by a torque in the place of currents, with the sensors that
    /// read no current.
    pub fn without_currents(&self) -> Compound {
        let mut compound = Compound::clone(&self.around);
        let kind = FeedKind::Current { bandwidth_rad_per_s: f64::INFINITY, supply_v: f64::INFINITY };
        compound.network.feed = Feed { torque_constant: 1.0, resistance_ohm: 0.0, inductance_h: 0.0, kind };
        compound.sensors = self.sensors.iter().filter(|sensor| !sensor.reads_a_current()).cloned().collect();
        compound
    }

    /// Returns the torque for one ampere across the magnets' axis, without what unequal inductances add.
    pub fn torque_constant_nm_per_a(&self) -> f64 {
        1.5 * f64::from(self.pole_pairs) * self.flux_wb
    }
}

/// A motor with all that a scene has around it, whatever closes its loop.
pub(crate) struct Built {
    /// The motor with one winding, whose current is the one across the magnets' axis, all joints taken as rigid.
    pub device: Device,
    pub motor: Pmsm,
    pub encoder: Encoder,
    pub bridge: Bridge,
    pub hand: Hand,
    pub recorded: Option<Recorded>,
    /// The dimensions of the motion of the body in whose units the wall is.
    pub at_wall: &'static Axis,
}

/// Reads a motor with its sensors, what is around it, its encoder, bridge and hand; of a scene with a method also
/// whether its joints are modelled as rigid.
pub(crate) fn built(root: &Section, clock: Clock, load: Load) -> Result<Built, SceneError> {
    let s = &root.section("device")?;
    s.accept(&["pmsm"])?;
    if root.has("amplifier") {
        return Err(root.error("amplifier", "a pmsm hangs on a bridge with three legs; write [bridge]"));
    }
    let pole_pairs = s.read(&key::pole_pairs)?;
    let coulomb = s.read(&key::coulomb_friction)?;
    let stiction = s.given(&key::stiction)?.unwrap_or(coulomb);
    if stiction < coulomb {
        let reason = format!("less than coulomb_friction, {} N.m; write as much or more", number(coulomb));
        return Err(s.error(key::stiction.name, reason));
    }
    let (inertia, viscous) = (s.read(&key::rotor_inertia)?, s.read(&key::viscous_friction)?);
    let (position, speed) = (s.read(&key::initial_angle)?, s.read(&key::initial_speed)?);
    let rotor = Body { inertia, viscous, coulomb, stiction, position, speed, ..Body::default() };
    let (resistance_ohm, inductance_h) = (s.read(&key::resistance)?, inductances(s)?);
    let flux_wb = flux(s, pole_pairs)?;
    let torque_constant = 1.5 * f64::from(pole_pairs) * flux_wb;
    let nothing = Bridge { supply_v: 0.0, on_resistance_ohm: 0.0, diode_drop_v: 0.0, dead_band_v: 0.0 };
    let feed = FeedKind::Bridge(nothing);
    let feed = Feed { torque_constant, resistance_ohm, inductance_h: inductance_h[1], kind: feed };
    let encoder = encoder(&root.section("encoder")?, Kind::Pmsm, true)?;
    let (mut draft, sensors) = around(root, (rotor, feed), (encoder, pole_pairs), clock)?;
    if root.has("method") {
        draft.stiffen(&root.section("model")?)?;
    }
    let [_, grip, at_wall] = draft.axes();
    let count = || Ok(encoder.count_rad());
    let (mut hand, recorded) = hand(&root.section("hand")?.along(grip), &["pmsm"], load, &count)?;
    let bridge = bridge(&root.section("bridge")?)?;
    let (device, around) = draft.finish(root, &mut hand, bridge, clock.frequency_hz() as f64)?;
    let rotor = around.network.bodies[0];
    let motor = Pmsm {
        pole_pairs,
        resistance_ohm,
        inductance_h,
        flux_wb,
        inertia_kg_m2: rotor.inertia,
        viscous_nm_s_per_rad: rotor.viscous,
        coulomb_nm: rotor.coulomb,
        stiction_nm: rotor.stiction,
        cogging: cogging(s)?,
        supply_ohm: s.read(&key::supply_resistance)?,
        start: [rotor.position, rotor.speed],
        around,
        sensors,
    };
    Ok(Built { device, motor, encoder, bridge, hand, recorded, at_wall })
}

/// Reads one inductance for both axes, or one for each.
fn inductances(s: &Section) -> Result<[f64; 2], SceneError> {
    match (s.given(&key::inductance)?, s.given(&key::inductance_d)?, s.given(&key::inductance_q)?) {
        (Some(both), None, None) => Ok([both; 2]),
        (None, Some(d), Some(q)) => Ok([d, q]),
        (Some(_), ..) => {
            let extra = if s.has("inductance_d") { "inductance_d" } else { "inductance_q" };
            Err(s.error(extra, "inductance is given for both axes; write one of both ways"))
        }
        (None, ..) => {
            let reason = "missing; write inductance for both axes, or inductance_d and inductance_q";
            Err(s.error(key::inductance.name, reason))
        }
    }
}

/// Reads the flux of the magnets, or the torque that it gives for one ampere.
fn flux(s: &Section, pole_pairs: u32) -> Result<f64, SceneError> {
    match (s.given(&key::flux_linkage)?, s.given(&key::torque_constant)?) {
        (Some(flux), None) => Ok(flux),
        (None, Some(constant)) => Ok(constant / (1.5 * f64::from(pole_pairs))),
        (Some(_), Some(_)) => Err(s.error(key::torque_constant.name, "flux_linkage is given too; write one of both")),
        (None, None) => {
            let reason = "missing; write a flux linkage, as in \"5 mWb\", or torque_constant";
            Err(s.error(key::flux_linkage.name, reason))
        }
    }
}

/// Reads the harmonics of the cogging torque.
fn cogging(s: &Section) -> Result<Vec<[f64; 3]>, SceneError> {
    let name = key::cogging.name;
    let Some(item) = s.get(name) else { return Ok(Vec::new()) };
    let list = item.as_array().filter(|list| (1..=MOST_HARMONICS).contains(&list.len()));
    let refused = |at: &str| s.error(at, format!("write {COGGING}, {MOST_HARMONICS} at most"));
    let mut all = Vec::new();
    for (index, value) in list.ok_or_else(|| refused(name))?.iter().enumerate() {
        let at = format!("{name}[{index}]");
        let parts = value.as_array().filter(|parts| parts.len() == 3).ok_or_else(|| refused(&at))?;
        let order = parts.get(0).and_then(toml_edit::Value::as_integer).filter(|order| (1..=10_000).contains(order));
        let order = order.ok_or_else(|| s.error(&at, "the order is a whole number of 1 to 10000 in a turn"))?;
        let read = |part: usize, dimension, sense| {
            let item = Item::Value(parts.get(part).cloned().unwrap_or_else(|| 0.into()));
            s.quantity_of(&format!("{at}[{part}]"), &item, dimension, sense, |_| None)
        };
        all.push([order as f64, read(1, &TORQUE, Sense::NotNegative)?, read(2, &ANGLE, Sense::Any)?]);
    }
    let told: Vec<_> = all.iter().map(|it| format!("[{}]", it.map(number).join(", "))).collect();
    s.note(name, ParameterValue::Text(format!("[{}]", told.join(", "))), "", Origin::Scene);
    Ok(all)
}
