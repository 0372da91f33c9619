//! Reading `[method]`: the loop and its words.

use hpu_datapath::command_limiter::MOST_SETTLING;

use super::law;
use super::parts::{Loop, Method, Pwm};
use super::quantity as q;
use super::read_device::Axis;
use super::section::Section;
use super::section::Sense::{NotNegative, Positive};
use super::source::SceneError;

pub(super) fn method(s: &Section, axis: &Axis) -> Result<Method, SceneError> {
    const COMMON: [&str; 9] = [
        "kind",
        "sample_rate",
        "position_bits",
        "stiffness_format",
        "damping_format",
        "period_bits",
        "pwm",
        "shaper",
        "velocity_bits",
    ];
    const PLAIN: [&str; 5] = ["product", "settling", "rescaled", "reference_rate", "scale_format"];
    let kinds = [
        ("hybrid", "hybrid"),
        ("conventional", "conventional"),
        ("sampled_wall", "sampled_wall"),
        ("virtual_coupling", "virtual_coupling"),
        ("passivity_controller", "passivity_controller"),
        ("energy_bounding", "energy_bounding"),
        ("passive_spring", "passive_spring"),
    ];
    if s.get("kind").and_then(|kind| kind.as_str()) == Some("midpoint_spring") {
        let reason = "not causal: it needs the position to which its own force leads; write \"passive_spring\"";
        return Err(s.error("kind", reason));
    }
    if s.has("pwm_frequency") {
        return Err(s.unknown("pwm_frequency", PWM_FREQUENCY));
    }
    let kind = s.choice("kind", &kinds, None)?;
    match law::keys(kind) {
        // A law's velocity is as wide as its position, and a shaper can only stand behind a law.
        Some(own) => s.accept(&[&COMMON[..8], own].concat())?,
        None => {
            if s.has("shaper") {
                let reason = format!("\"{kind}\" has no place for a shaper; write kind = \"sampled_wall\"");
                return Err(s.error("shaper", reason));
            }
            s.accept(&[&COMMON[..7], &COMMON[8..], &PLAIN].concat())?;
        }
    }
    let law = law::law(s, kind, axis)?;
    let rescaled = law.is_none() && s.flag("rescaled", false)?;
    for key in ["reference_rate", "scale_format"] {
        if s.has(key) && !rescaled && law.is_none() {
            return Err(s.error(key, "only a rescaled velocity has one; write rescaled = true beside it"));
        }
    }
    let reference_rate = || s.quantity("reference_rate", &q::FREQUENCY, Positive, None);
    let position_bits = s.bits("position_bits", 32, 12)?;
    let shaper = s.section("shaper")?;
    shaper.accept(&["cutoff"])?;
    let cutoff = || shaper.quantity("cutoff", &q::FREQUENCY, Positive, None);
    Ok(Method {
        kind: match (law, kind) {
            (Some(law), _) => Loop::Law(law),
            (None, "hybrid") => Loop::Hybrid,
            (None, _) => Loop::Conventional,
        },
        sample_rate_hz: s.quantity("sample_rate", &q::FREQUENCY, Positive, None)?,
        position_bits,
        stiffness_format: s.gain_format("stiffness_format", (12, 0))?,
        damping_format: s.gain_format("damping_format", (12, 0))?,
        velocity_bits: if law.is_some() { position_bits } else { s.bits("velocity_bits", 32, 12)? },
        period_bits: s.bits("period_bits", 30, 24)?,
        saturate: law.is_some() || s.choice("product", &[("saturate", true), ("drop_upper", false)], Some(true))?,
        reference_rate_hz: if rescaled { Some(reference_rate()?) } else { None },
        scale_format: s.gain_format("scale_format", (8, 8))?,
        settling: if law.is_none() { s.integer("settling", 0, MOST_SETTLING.into(), Some(0))? as u32 } else { 0 },
        shaper_hz: if s.has("shaper") { Some(cutoff()?) } else { None },
        pwm: pwm(&s.section("pwm")?)?,
    })
}

/// The message for a PWM frequency, for which scenes have no key.
pub(super) const PWM_FREQUENCY: &str =
    "a PWM's frequency is clock.frequency / 2^method.pwm.bits, as in 50 MHz / 2^12 = 12.207 kHz; set these two keys";

fn pwm(s: &Section) -> Result<Pwm, SceneError> {
    if s.has("frequency") {
        return Err(s.unknown("frequency", PWM_FREQUENCY));
    }
    s.accept(&["bits", "mode", "duty", "off", "dead_time"])?;
    Ok(Pwm {
        bits: s.bits("bits", 24, 12)?,
        antiphase: s.choice("mode", &[("sign_magnitude", false), ("locked_antiphase", true)], Some(false))?,
        latched: s.choice("duty", &[("latched", true), ("immediate", false)], Some(true))?,
        floating: s.choice("off", &[("brake", false), ("float", true)], Some(false))?,
        dead_time_s: s.quantity("dead_time", &q::TIME, NotNegative, Some(0.0))?,
    })
}
