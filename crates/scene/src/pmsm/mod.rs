//! A three-phase motor, as scenes have it: `device.kind = "pmsm"`.

pub(crate) mod rows;

use hpu_signal::Clock;
use toml_edit::Item;

use crate::axis::parts::Motor;
use crate::axis::sensors::{Sensor, sensors};
use crate::pmsm::rows::{COGGING, pmsm as key};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{ANGLE, Sense, TORQUE};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::text::message::number;

/// The name of the one body of a three-phase motor, which sensors read.
pub(crate) const ROTOR: &str = "rotor";

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
    /// The sensors beside the encoder.
    pub sensors: Vec<Sensor>,
}

impl Pmsm {
    /// Returns the torque for one ampere across the magnets' axis, without what unequal inductances add.
    pub fn torque_constant_nm_per_a(&self) -> f64 {
        1.5 * f64::from(self.pole_pairs) * self.flux_wb
    }

    /// Returns the motor with one winding whose current is the one across the magnets' axis.
    pub(crate) fn with_one_winding(&self) -> Motor {
        let [initial_angle_rad, initial_speed_rad_per_s] = self.start;
        Motor {
            resistance_ohm: self.resistance_ohm,
            inductance_h: self.inductance_h[1],
            torque_constant_nm_per_a: self.torque_constant_nm_per_a(),
            rotor_inertia_kg_m2: self.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: self.viscous_nm_s_per_rad,
            coulomb_friction_nm: self.coulomb_nm,
            wheel_ratio: 1.0,
            wheel_inertia_kg_m2: 0.0,
            initial_angle_rad,
            initial_speed_rad_per_s,
            initial_current_a: 0.0,
        }
    }
}

/// Reads a motor with its sensors.
pub(crate) fn pmsm(s: &Section, clock: Clock) -> Result<Pmsm, SceneError> {
    s.accept(&["pmsm"])?;
    let pole_pairs = s.read(&key::pole_pairs)?;
    let coulomb_nm = s.read(&key::coulomb_friction)?;
    let stiction_nm = s.given(&key::stiction)?.unwrap_or(coulomb_nm);
    if stiction_nm < coulomb_nm {
        let reason = format!("less than coulomb_friction, {} N.m; write as much or more", number(coulomb_nm));
        return Err(s.error(key::stiction.name, reason));
    }
    let (sensors, _) = sensors(s, (&[ROTOR.into()], &[false]), Some(pole_pairs), clock)?;
    Ok(Pmsm {
        pole_pairs,
        resistance_ohm: s.read(&key::resistance)?,
        inductance_h: inductances(s)?,
        flux_wb: flux(s, pole_pairs)?,
        inertia_kg_m2: s.read(&key::rotor_inertia)?,
        viscous_nm_s_per_rad: s.read(&key::viscous_friction)?,
        coulomb_nm,
        stiction_nm,
        cogging: cogging(s)?,
        supply_ohm: s.read(&key::supply_resistance)?,
        start: [s.read(&key::initial_angle)?, s.read(&key::initial_speed)?],
        sensors,
    })
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
