//! Writes the bounds of an arm as a script of Gappa: its kinematics and torques are straight-line code, from the
//! tables' sines to the torques.

use std::fmt::Write;

use hpu_cosim::scene::PhantomScene;
use hpu_datapath::phantom::wiring;

use super::posture::bounds;
use crate::Error;
use crate::ranges::text::{Text, capital};

/// The blocks that the script covers: from sines to the tip, and from forces to torques.
const FOLLOWED: [&str; 2] = ["forward", "jacobian"];

/// The share of a bound by which a goal is wider, because Gappa rounds its own bounds outwards too.
const SLACK: f64 = 1.0 / (1 << 16) as f64;

/// Returns the script of a scene; its goals are the ranges and errors of the tip and of the torques. Words
/// have small letters, and their values in real numbers have capitals. Forces are words of their own, clamped to their
/// limit.
///
/// # Errors
///
/// When a host computes the forces, or the words make no datapath.
pub fn script(scene: &PhantomScene) -> Result<String, Error> {
    if scene.platform.is_host() {
        return Err("a host computes the forces, in floats".into());
    }
    let config = scene.method.config;
    let words = scene.words()?;
    let stiffness = config.formats.stiffness.to_f64(words.stiffness);
    let rows = bounds(&config, stiffness)?;
    let wiring = wiring(config, false)?;
    let nets = wiring.nets();
    let mut text = format!("# {}: from sines to torques, in metres, newtons and newton metres.\n", scene.name);
    text += &Text::written(|| {
        let mut made: Vec<Option<Text>> = vec![None; nets.len()];
        for instance in wiring.instances().into_iter().filter(|instance| FOLLOWED.contains(&instance.label)) {
            let (inputs, outputs) = instance.connections.split_at(instance.model.inputs().len());
            let input = |net: usize| {
                let (name, format, truth) = (nets[net].name, nets[net].format, capital(nets[net].name));
                let real = if nets[net].unit == "N" { name } else { &truth };
                made[net].unwrap_or_else(|| Text::variable(name, real, format))
            };
            let inputs: Vec<_> = inputs.iter().map(|input_port| input(input_port.net)).collect();
            let equations = instance.model.equations().expect("equations of a block without registers");
            for (output, word) in outputs.iter().zip(equations.recorded().read(&inputs)) {
                let name = nets[output.net].name;
                made[output.net] = Some(word.named(name, &capital(name)));
            }
        }
    });
    let (mut given, mut goals) = (Vec::new(), Vec::new());
    for row in &rows {
        let (name, frac) = (row.name, -row.format.frac());
        let range = |wide: f64| format!("{name} in [{}, {}]", row.min - wide, row.max + wide);
        let off = |error: f64| format!("{name} - {} in [-{error}, {error}]", capital(name));
        match row.unit {
            "1" => given.push(format!("{} /\\ @FIX({name}, {frac})\n  /\\ {}", range(0.0), off(row.error))),
            "N" if name.starts_with("force") => given.push(format!("{} /\\ @FIX({name}, {frac})", range(0.0))),
            "m" | "N" | "N.m" => {
                goals.push(range(row.max.max(-row.min) * SLACK));
                goals.push(off(row.error * (1.0 + SLACK)));
            }
            _ => {}
        }
    }
    let _ = write!(text, "\n{{ {}\n  ->\n  {} }}\n", given.join("\n  /\\ "), goals.join("\n  /\\ "));
    Ok(text)
}
