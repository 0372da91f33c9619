//! Reading `[method]`: the loop and its words.

use super::parts::{Loop, Method, Pwm};
use super::quantity as q;
use super::section::Section;
use super::section::Sign::{NotNegative, Positive};
use super::source::SceneError;

pub(super) fn method(s: &Section) -> Result<Method, SceneError> {
    s.accept(&[
        "kind",
        "sample_rate",
        "position_bits",
        "stiffness_format",
        "damping_format",
        "velocity_bits",
        "period_bits",
        "product",
        "rescaled",
        "reference_rate",
        "scale_format",
        "pwm",
    ])?;
    let rescaled = s.flag("rescaled", false)?;
    for key in ["reference_rate", "scale_format"] {
        if s.has(key) && !rescaled {
            return Err(s.error(key, "only a rescaled velocity has one; write rescaled = true beside it"));
        }
    }
    let reference_rate = || s.quantity("reference_rate", &q::FREQUENCY, Positive, None);
    Ok(Method {
        kind: s.choice("kind", &[("hybrid", Loop::Hybrid), ("conventional", Loop::Conventional)], None)?,
        sample_rate_hz: s.quantity("sample_rate", &q::FREQUENCY, Positive, None)?,
        position_bits: s.bits("position_bits", 32, 12)?,
        stiffness_format: s.gain_format("stiffness_format", (12, 0))?,
        damping_format: s.gain_format("damping_format", (12, 0))?,
        velocity_bits: s.bits("velocity_bits", 32, 12)?,
        period_bits: s.bits("period_bits", 30, 24)?,
        saturate: s.choice("product", &[("saturate", true), ("drop_upper", false)], Some(true))?,
        reference_rate_hz: if rescaled { Some(reference_rate()?) } else { None },
        scale_format: s.gain_format("scale_format", (8, 8))?,
        pwm: pwm(&s.section("pwm")?)?,
    })
}

fn pwm(s: &Section) -> Result<Pwm, SceneError> {
    s.accept(&["bits", "mode", "duty", "off", "dead_time"])?;
    Ok(Pwm {
        bits: s.bits("bits", 24, 12)?,
        antiphase: s.choice("mode", &[("sign_magnitude", false), ("locked_antiphase", true)], Some(false))?,
        latched: s.choice("duty", &[("latched", true), ("immediate", false)], Some(true))?,
        floating: s.choice("off", &[("brake", false), ("float", true)], Some(false))?,
        dead_time_s: s.quantity("dead_time", &q::TIME, NotNegative, Some(0.0))?,
    })
}
