//! Reading `[device]`, `[encoder]`, `[bridge]` and `[amplifier]`.

use hpu_plant::Bridge;

use crate::axis::library::{MOTORS, NamedPart};
use crate::axis::parts::{Amplifier, Device, Encoder, Motor};
use crate::axis::rows as keys;
use crate::axis::rows::{AnalogShaper, Mass};
use crate::head::Head;
use crate::head::model::BridgeModel;
use crate::schema::parameter::Origin;
use crate::schema::quantity::{Axis, RAIL, SHAFT};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Key, Quantity};
use crate::text::message::number;

/// The kind of an axis.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Motor,
    Mass,
    Network,
    Pmsm,
}

impl Kind {
    /// Returns its name, as rows of keys call it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Mass => "mass",
            Self::Network => "network",
            Self::Pmsm => "pmsm",
        }
    }
}

/// Reads a motor or a mass, and returns it with the dimensions of its motion.
pub(crate) fn device(s: &Section, kind: Kind) -> Result<(Device, &'static Axis), SceneError> {
    match kind {
        Kind::Mass => Ok((Device::Mass(Mass::read(s)?), &RAIL)),
        Kind::Motor | Kind::Network | Kind::Pmsm => Ok((Device::Motor(motor(s)?), &SHAFT)),
    }
}

/// The kind of a device, as rows of keys call it.
pub(crate) fn kind(device: &Device) -> &'static str {
    match device {
        Device::Motor(_) => "motor",
        Device::Mass(_) => "mass",
    }
}

fn motor(s: &Section) -> Result<Motor, SceneError> {
    use keys::motor as key;
    s.accept(&["motor"])?;
    let named = s.given(&key::motor)?;
    let s = &s.alike(s.axis()).with(named.map(NamedPart::gives));
    // One of a motor's own data: the scene's, or else that of the motor that the scene names.
    let datum = |key: &Key<Quantity>| match s.has(key.name) {
        true => s.read(key),
        false => {
            let dimension = key.value.dimension(s);
            let reason = format!(
                "missing; write {} as {}, or name the motor: motor = \"{}\"",
                dimension.name,
                dimension.accepted(),
                MOTORS[0].name
            );
            Err(s.error(key.name, reason))
        }
    };
    Ok(Motor {
        resistance_ohm: datum(&key::resistance)?,
        inductance_h: datum(&key::inductance)?,
        torque_constant_nm_per_a: datum(&key::torque_constant)?,
        rotor_inertia_kg_m2: datum(&key::rotor_inertia)?,
        viscous_friction_nm_s_per_rad: s.read(&key::viscous_friction)?,
        coulomb_friction_nm: s.read(&key::coulomb_friction)?,
        wheel_ratio: s.read(&key::wheel_ratio)?,
        wheel_inertia_kg_m2: s.read(&key::wheel_inertia)?,
        initial_angle_rad: s.read(&key::initial_angle)?,
        initial_speed_rad_per_s: s.read(&key::initial_speed)?,
        initial_current_a: s.read(&key::initial_current)?,
    })
}

/// Reads the encoder of a device; a mass needs none if no words are computed.
pub(crate) fn encoder(s: &Section, kind: Kind, words: bool) -> Result<Encoder, SceneError> {
    s.accept(&[kind.name()])?;
    if !matches!(kind, Kind::Mass) {
        let part = s.given(&keys::encoder_part::part)?;
        let s = s.alike(s.axis()).with(part.map(NamedPart::gives));
        return Ok(Encoder::Rotary { lines: s.read(&keys::encoder_motor::lines)? });
    }
    let key = &keys::encoder_mass::resolution;
    let resolution_m = if words { s.read(key)? } else { s.read_or(key, 0.0, Origin::Default)? };
    Ok(Encoder::Linear { resolution_m })
}

/// Reads the amplifier of a mass; the mass needs none if no words are computed.
pub(crate) fn amplifier(root: &Section, device: &Device, words: bool) -> Result<Option<Amplifier>, SceneError> {
    let s = root.section("amplifier")?;
    if let Device::Motor(_) = device {
        let refused = root.error("amplifier", "a motor hangs on a bridge; write [bridge], or device.kind = \"mass\"");
        return if root.has("amplifier") { Err(refused) } else { Ok(None) };
    }
    if root.has("bridge") {
        return Err(root.error("bridge", "a mass has a force amplifier and no bridge; write [amplifier]"));
    }
    if !words && !root.has("amplifier") {
        return Ok(None);
    }
    s.accept(&[])?;
    let full_scale_n = s.read(&keys::amplifier::full_scale)?;
    let shaper = if s.has("shaper") { Some(AnalogShaper::read(&s.section("shaper")?)?) } else { None };
    Ok(Some(Amplifier { full_scale_n, shaper }))
}

pub(crate) fn bridge(s: &Section) -> Result<Bridge, SceneError> {
    s.accept(&[])?;
    let s = s.alike(s.axis()).with(s.given(&keys::bridge::part)?.map(NamedPart::gives));
    let bridge = Bridge {
        supply_v: s.read(&keys::bridge::supply)?,
        on_resistance_ohm: s.read(&keys::bridge::on_resistance)?,
        diode_drop_v: s.read(&keys::bridge::diode_drop)?,
        dead_band_v: s.read(&keys::bridge::dead_band)?,
    };
    if bridge.dead_band_v >= bridge.supply_v {
        let reason =
            format!("not below the supply, {} V, so that no voltage reaches the motor", number(bridge.supply_v));
        return Err(s.error(keys::bridge::dead_band.name, reason));
    }
    Ok(bridge)
}

/// Refuses a dead band of a bridge that switches: it is that of a mean voltage, and a pulse has the whole supply.
pub(crate) fn agree_on_dead_band(head: &Head, bridge: &Bridge, model: BridgeModel) -> Result<(), SceneError> {
    if bridge.dead_band_v > 0.0 && model == BridgeModel::Switching {
        let reason = "of a mean voltage, and this bridge switches the whole supply; write model.bridge = \"averaged\", \
                      or leave this out";
        return Err(head.error("bridge.dead_band", reason));
    }
    Ok(())
}
