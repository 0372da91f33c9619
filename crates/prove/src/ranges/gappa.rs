//! Writes the straight-line parts of a loop as a script for [Gappa](https://gappa.gitlabpages.inria.fr), for users who
//! want an independent proof. It covers products, truncations and sums, from the ranges of penetration and motion to
//! those of spring, drag and torque.
//!
//! A number of `f` fraction bits satisfies `@FIX(x, -f)`; `fixed<-f, dn>` truncates to `f` of them. The language has no
//! clamp, so the output of a clamp is a new variable within the clamp's limits.

use std::fmt::Write;

use hpu_cosim::scene::{Loop, Scene};
use hpu_cosim::{AxisSimulation, Wired};
use hpu_signal::{Format, Word as _};

use super::text::Text;
use super::{Bound, Proof};
use crate::Error;

/// Returns the script for a scene of a hybrid or conventional loop; its goals are the bounds of `proof`.
///
/// # Errors
///
/// For another loop, or when the scene makes no datapath.
pub fn gappa(scene: &Scene, proof: &Proof) -> Result<String, Error> {
    if !matches!(scene.method.kind, Loop::Hybrid | Loop::Conventional) {
        return Err(format!(
            "a script is written of a hybrid or a conventional loop, not of `{}`",
            scene.method.kind.name()
        )
        .into());
    }
    let simulation = AxisSimulation::new(scene)?;
    let of = |name: &str| {
        proof.bounds.iter().find(|bound| bound.name == name).ok_or_else(|| Error::new(format_args!("no net `{name}`")))
    };
    let (depth, velocity) = (of("penetration")?, of("velocity")?);
    let (stiffness, damping) = (of("stiffness")?, of("damping")?);
    let (spring, drag) = (of("spring")?, of("drag")?);

    let mut text = format!("# {}: the straight-line parts, in counts and PWM counts.\n", scene.name);
    for instance in simulation.wiring().instances() {
        let Some(equations) = instance.model.equations() else { continue };
        let (inputs, outputs) = instance.connections.split_at(instance.model.inputs().len());
        let bound = &proof.bounds[outputs[0].net];
        let lines = Text::written(|| {
            let inputs = inputs.iter().map(|input| {
                let Bound { name, format, .. } = proof.bounds[input.net];
                // The case inside the wall.
                if format == Format::BIT { Text::int(1) } else { Text::variable(name, name, format) }
            });
            let read = || equations.recorded().read(&inputs.collect::<Vec<_>>())[0];
            match bound.name {
                "spring" => _ = read().named("product_spring", "exact_spring"),
                "drag" => _ = read().named("product_drag", "exact_drag"),
                "torque" => _ = read().named("torque", "exact_torque"),
                _ => {}
            }
        });
        text += &lines;
        if !lines.is_empty() && bound.never_overflows && bound.name != "torque" {
            let _ = writeln!(text, "{name} = product_{name};", name = bound.name);
        }
    }
    let mut given = vec![variable(depth), variable(velocity)];
    let mut goals = Vec::new();
    for (factor, gain, bound) in [(depth, stiffness, spring), (velocity, damping, drag)] {
        let name = bound.name;
        given.push(variable(gain));
        // This covers truncation alone. Where the product is clamped, its range is that of the clamp's input.
        let least = (factor.min * gain.min).min(factor.min * gain.max).floor();
        let most = (factor.max * gain.max).max(factor.max * gain.min).floor();
        goals.push(format!("product_{name} in [{least}, {most}]"));
        goals.push(format!("product_{name} - exact_{name} in [-{}, 0]", bound.error.unwrap_or(1.0).min(1.0)));
        if !bound.never_overflows {
            given.push(variable(bound));
        }
    }
    goals.push(format!("torque in [{}, {}]", spring.min + drag.min, spring.max + drag.max));
    let _ = write!(text, "\n{{ {}\n  ->\n  {} }}\n", given.join("\n  /\\ "), goals.join("\n  /\\ "));
    Ok(text)
}

/// Returns a word within a bound.
fn variable(Bound { name, min, max, format, .. }: &Bound) -> String {
    format!("{name} in [{min}, {max}] /\\ @FIX({name}, {})", -format.frac())
}
