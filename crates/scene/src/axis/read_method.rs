//! Reading `[method]`: the loop and its words.

use crate::axis::parts::Method;
use crate::axis::rows as keys;
use crate::method::rows::Pwm;
use crate::method::{LOOPS, LawMethod, Loop};
use crate::schema::section::Section;
use crate::schema::source::SceneError;

/// Reads the method. `device` is the kind of a device that adds keys.
pub(crate) fn method(s: &Section, device: &[&'static str]) -> Result<Method, SceneError> {
    use keys::{method as key, method_loop as of_a_loop};
    if s.get("kind").and_then(|kind| kind.as_str()) == Some("midpoint_spring") {
        let reason = "not causal: it needs the position to which its own force leads; write \"passive_spring\"";
        return Err(s.error("kind", reason));
    }
    if s.has("pwm_frequency") {
        return Err(s.unknown("pwm_frequency", PWM_FREQUENCY));
    }
    let kind = s.read(&key::kind)?;
    let (is_loop, has_shaper) = (LOOPS.contains(&kind), s.has("shaper"));
    if is_loop && has_shaper {
        let reason = format!("\"{kind}\" has no place for a shaper; write kind = \"sampled_wall\"");
        return Err(s.error("shaper", reason));
    }
    s.accept(&[&[kind], device].concat())?;
    let law = LawMethod::read(s, kind)?;
    let rescaled = is_loop && s.read(&of_a_loop::rescaled)?;
    for key in [of_a_loop::reference_rate.name, keys::method_scale::scale_format.name] {
        if s.has(key) && !rescaled && is_loop {
            return Err(s.error(key, "only a rescaled velocity has one; write rescaled = true beside it"));
        }
    }
    let position_bits = s.read(&key::position_bits)?;
    let shaper = s.section("shaper")?;
    shaper.accept(&[])?;
    Ok(Method {
        kind: match (law, kind) {
            (Some(law), _) => Loop::Law(law),
            (None, "hybrid") => Loop::Hybrid,
            (None, _) => Loop::Conventional,
        },
        sample_rate_hz: s.read(&key::sample_rate)?,
        position_bits,
        stiffness_format: s.read(&key::stiffness_format)?,
        damping_format: s.read(&key::damping_format)?,
        velocity_bits: if is_loop { s.read(&of_a_loop::velocity_bits)? } else { position_bits },
        period_bits: s.read(&key::period_bits)?,
        saturate: !is_loop || s.read(&of_a_loop::product)?,
        reference_rate_hz: if rescaled { Some(s.read(&of_a_loop::reference_rate)?) } else { None },
        scale_format: s.read(&keys::method_scale::scale_format)?,
        settling: if is_loop { s.read(&of_a_loop::settling)? } else { 0 },
        shaper_hz: if has_shaper { Some(shaper.read(&keys::method_shaper::cutoff)?) } else { None },
        pwm: pwm(&s.section("pwm")?)?,
    })
}

/// The message for a PWM frequency, for which scenes have no key.
pub(crate) const PWM_FREQUENCY: &str =
    "a PWM's frequency is clock.frequency / 2^method.pwm.bits, as in 50 MHz / 2^12 = 12.207 kHz; set these two keys";

fn pwm(s: &Section) -> Result<Pwm, SceneError> {
    if s.has("frequency") {
        return Err(s.unknown("frequency", PWM_FREQUENCY));
    }
    Pwm::read(s)
}
