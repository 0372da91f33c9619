//! Reading `[device]`, `[encoder]`, `[bridge]` and `[amplifier]`.

use super::parameter::{Origin, ParameterValue};
use super::parts::{Amplifier, AnalogShaper, Bridge, Device, Encoder, Mass, Motor};
use super::quantity::{self as q, Dimension};
use super::section::Section;
use super::section::Sense::{self, Any, NotNegative, Positive, Within};
use super::source::SceneError;

/// The dimensions of a device's motion.
pub(super) struct Axis {
    pub position: &'static Dimension,
    pub effort: &'static Dimension,
    pub stiffness: &'static Dimension,
    pub damping: &'static Dimension,
}

static SHAFT: Axis = Axis {
    position: &q::ANGLE,
    effort: &q::TORQUE,
    stiffness: &q::TORSIONAL_STIFFNESS,
    damping: &q::TORSIONAL_DAMPING,
};
static RAIL: Axis = Axis { position: &q::LENGTH, effort: &q::FORCE, stiffness: &q::STIFFNESS, damping: &q::DAMPING };

pub(super) fn device(s: &Section) -> Result<(Device, &'static Axis), SceneError> {
    let kinds = [("motor", Some(true)), ("mass", Some(false)), ("phantom", None)];
    let Some(is_motor) = s.choice("kind", &kinds, None)? else {
        return Err(s.error("kind", "\"phantom\" is a scene of its own; an axis is a \"motor\" or a \"mass\""));
    };
    if is_motor {
        return Ok((Device::Motor(motor(s)?), &SHAFT));
    }
    s.accept(&["kind", "mass", "damping", "coulomb", "initial_position", "initial_speed"])?;
    let mass = Mass {
        mass_kg: s.quantity("mass", &q::MASS, Positive, None)?,
        damping_n_s_per_m: s.quantity("damping", &q::DAMPING, NotNegative, None)?,
        coulomb_n: s.quantity("coulomb", &q::FORCE, NotNegative, Some(0.0))?,
        initial_position_m: s.quantity("initial_position", &q::LENGTH, Any, Some(0.0))?,
        initial_speed_m_per_s: s.quantity("initial_speed", &q::SPEED, Any, Some(0.0))?,
    };
    Ok((Device::Mass(mass), &RAIL))
}

/// A motor that a scene can name, with the data of its winding and its rotor.
#[derive(Clone, Copy, PartialEq)]
struct Named {
    name: &'static str,
    resistance_ohm: f64,
    inductance_h: f64,
    torque_constant_nm_per_a: f64,
    rotor_inertia_kg_m2: f64,
    viscous_friction_nm_s_per_rad: f64,
}

/// Assumed values of the 22 W motor of Vasudevan et al. 2007. Its published stall torque at 24 V is 265 mN·m; no data
/// sheet of that winding was available.
static VASUDEVAN_2007: Named = Named {
    name: "vasudevan_2007",
    resistance_ohm: 25.9e-3 * 24.0 / 0.265,
    inductance_h: 0.226e-3,
    torque_constant_nm_per_a: 25.9e-3,
    rotor_inertia_kg_m2: 1.37e-6,
    viscous_friction_nm_s_per_rad: 1.3e-6,
};

/// Returns one of a motor's own data: the scene's value, or else that of the motor that the scene names.
fn datum(
    s: &Section,
    key: &str,
    dimension: &'static Dimension,
    sense: Sense,
    named: Option<(&'static str, f64)>,
) -> Result<f64, SceneError> {
    if let (None, false) = (named, s.has(key)) {
        let reason = format!(
            "missing; write {} as {}, or name the motor: motor = \"{}\"",
            dimension.name,
            dimension.accepted(),
            VASUDEVAN_2007.name
        );
        return Err(s.error(key, reason));
    }
    let value = s.quantity(key, dimension, sense, named.map(|(_, value)| value))?;
    if let Some((name, _)) = named {
        s.note(key, ParameterValue::Number(value), dimension.si_unit(), Origin::Motor(name));
    }
    Ok(value)
}

fn motor(s: &Section) -> Result<Motor, SceneError> {
    s.accept(&[
        "kind",
        "motor",
        "resistance",
        "inductance",
        "torque_constant",
        "rotor_inertia",
        "viscous_friction",
        "coulomb_friction",
        "wheel_ratio",
        "wheel_inertia",
        "initial_angle",
        "initial_speed",
        "initial_current",
    ])?;
    let named =
        if s.has("motor") { Some(s.choice("motor", &[(VASUDEVAN_2007.name, VASUDEVAN_2007)], None)?) } else { None };
    let of = |value: fn(&Named) -> f64| named.as_ref().map(|named| (named.name, value(named)));
    let viscous = of(|named| named.viscous_friction_nm_s_per_rad);
    Ok(Motor {
        resistance_ohm: datum(s, "resistance", &q::RESISTANCE, Positive, of(|named| named.resistance_ohm))?,
        inductance_h: datum(s, "inductance", &q::INDUCTANCE, Positive, of(|named| named.inductance_h))?,
        torque_constant_nm_per_a: datum(
            s,
            "torque_constant",
            &q::TORQUE_CONSTANT,
            Positive,
            of(|named| named.torque_constant_nm_per_a),
        )?,
        rotor_inertia_kg_m2: datum(s, "rotor_inertia", &q::INERTIA, Positive, of(|named| named.rotor_inertia_kg_m2))?,
        viscous_friction_nm_s_per_rad: match viscous {
            Some(_) => datum(s, "viscous_friction", &q::TORSIONAL_DAMPING, NotNegative, viscous)?,
            None => s.quantity("viscous_friction", &q::TORSIONAL_DAMPING, NotNegative, Some(0.0))?,
        },
        coulomb_friction_nm: s.quantity("coulomb_friction", &q::TORQUE, NotNegative, Some(0.0))?,
        wheel_ratio: s.quantity("wheel_ratio", &q::RATIO, Within(1e-3, 1e4), Some(1.0))?,
        wheel_inertia_kg_m2: s.quantity("wheel_inertia", &q::INERTIA, NotNegative, Some(0.0))?,
        initial_angle_rad: s.quantity("initial_angle", &q::ANGLE, Any, Some(0.0))?,
        initial_speed_rad_per_s: s.quantity("initial_speed", &q::ANGULAR_SPEED, Any, Some(0.0))?,
        initial_current_a: s.quantity("initial_current", &q::CURRENT, Any, Some(0.0))?,
    })
}

/// Reads the encoder of a device; a mass needs none if no words are computed.
pub(super) fn encoder(s: &Section, device: &Device, words: bool) -> Result<Encoder, SceneError> {
    if let Device::Motor(_) = device {
        s.accept(&["lines"])?;
        let lines = s.integer("lines", 1, 1 << 24, Some(1024))?;
        return Ok(Encoder::Rotary { lines: lines as u32 });
    }
    s.accept(&["resolution"])?;
    let ideal = (!words).then_some(0.0);
    Ok(Encoder::Linear { resolution_m: s.quantity("resolution", &q::LENGTH, Within(1e-11, 1.0), ideal)? })
}

/// Reads the amplifier of a mass; the mass needs none if no words are computed.
pub(super) fn amplifier(root: &Section, device: &Device, words: bool) -> Result<Option<Amplifier>, SceneError> {
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
    s.accept(&["full_scale", "shaper"])?;
    let full_scale_n = s.quantity("full_scale", &q::FORCE, Positive, None)?;
    let shaper = if s.has("shaper") { Some(shaper(&s.section("shaper")?)?) } else { None };
    Ok(Some(Amplifier { full_scale_n, shaper }))
}

fn shaper(s: &Section) -> Result<AnalogShaper, SceneError> {
    s.accept(&["cutoff", "hold"])?;
    Ok(AnalogShaper {
        cutoff_hz: s.quantity("cutoff", &q::FREQUENCY, Positive, None)?,
        hold_s: s.quantity("hold", &q::TIME, Positive, Some(1e-6))?,
    })
}

pub(super) fn bridge(s: &Section) -> Result<Bridge, SceneError> {
    s.accept(&["supply", "on_resistance", "diode_drop"])?;
    Ok(Bridge {
        supply_v: s.quantity("supply", &q::VOLTAGE, Positive, Some(24.0))?,
        on_resistance_ohm: s.quantity("on_resistance", &q::RESISTANCE, NotNegative, Some(0.0))?,
        diode_drop_v: s.quantity("diode_drop", &q::VOLTAGE, NotNegative, Some(0.7))?,
    })
}
