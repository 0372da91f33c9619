//! The straight-line parts of a loop as a script for [Gappa](https://gappa.gitlabpages.inria.fr), for who wants a proof
//! from outside: products, truncations and sums, from the ranges of penetration and motion to those of spring, drag and
//! torque.
//!
//! A number of `f` fraction bits is one with `@FIX(x, -f)`; `fixed<-f, dn>` truncates to `f` of them. Clamps have no
//! word in that language: what comes out of one is a variable of its own, within what it was clamped to.

use std::fmt::Write;

use hpu_cosim::Session;
use hpu_cosim::scene::{Loop, Scene};

use super::{Bound, Proof};

/// The script for a scene of a hybrid or conventional loop, which is to prove what `proof` says.
///
/// # Errors
///
/// For another loop, or when the scene makes no datapath.
pub fn gappa(scene: &Scene, proof: &Proof) -> Result<String, String> {
    if !matches!(scene.method.kind, Loop::Hybrid | Loop::Conventional) {
        return Err(format!(
            "a script is written of a hybrid or a conventional loop, not of `{}`",
            scene.method.kind.name()
        ));
    }
    let session = Session::new(scene).map_err(|error| error.to_string())?;
    let config = session.words().config;
    let of =
        |name: &str| proof.bounds.iter().find(|bound| bound.name == name).ok_or_else(|| format!("no net `{name}`"));
    let (depth, velocity) = (of("penetration")?, of("velocity")?);
    let (stiffness, damping) = (of("stiffness")?, of("damping")?);
    let (spring, drag) = (of("spring")?, of("drag")?);

    let mut text = format!("# {}: the straight-line parts, in counts and PWM counts.\n", scene.name);
    let mut given = vec![integer(depth), integer(velocity)];
    let mut goals = Vec::new();
    for (name, factor, gain, bound) in [("spring", depth, stiffness, spring), ("drag", velocity, damping, drag)] {
        let frac = if name == "spring" { config.stiffness.frac() } else { config.damping.frac() };
        let exact = format!("exact_{name} = {} * {};\n", factor.name, gain.name);
        let _ = writeln!(text, "{exact}product_{name} = fixed<0, dn>(exact_{name});");
        given.push(setting(gain, frac));
        // Truncation alone; where the product is clamped, its range is what goes into the clamp.
        let least = (factor.min * gain.min).min(factor.min * gain.max).floor();
        let most = (factor.max * gain.max).max(factor.max * gain.min).floor();
        goals.push(format!("product_{name} in [{}, {}]", decimal(least), decimal(most)));
        goals.push(format!("product_{name} - exact_{name} in [-{}, 0]", decimal(bound.error.unwrap_or(1.0).min(1.0))));
        if bound.never_overflows {
            let _ = writeln!(text, "{name} = product_{name};");
        } else {
            given.push(integer(bound));
        }
    }
    let _ = writeln!(text, "torque = spring + drag;");
    goals.push(format!("torque in [{}, {}]", decimal(spring.min + drag.min), decimal(spring.max + drag.max)));
    let _ = write!(text, "\n{{ {}\n  ->\n  {} }}\n", given.join("\n  /\\ "), goals.join("\n  /\\ "));
    Ok(text)
}

/// A whole number within a bound.
fn integer(bound: &Bound) -> String {
    format!("{} in [{}, {}] /\\ @FIX({}, 0)", bound.name, decimal(bound.min), decimal(bound.max), bound.name)
}

/// A word with fraction bits within a bound.
fn setting(bound: &Bound, frac: i32) -> String {
    format!("{} in [{}, {}] /\\ @FIX({}, {})", bound.name, decimal(bound.min), decimal(bound.max), bound.name, -frac)
}

/// A number as the language reads it, exactly: words have few digits.
fn decimal(value: f64) -> String {
    format!("{value}")
}
