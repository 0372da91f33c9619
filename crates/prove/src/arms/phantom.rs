//! The words of an arm: turns the [bounds](super::bounds) of its postures into rows of a scene.

use hpu_cosim::scene::PhantomScene;
use hpu_cosim::{PhantomSimulation, Simulation};
use hpu_signal::{Format, Signal};

use super::posture::{SignalBound, bounds};
use crate::Error;
use crate::ranges::{Bound, How, Proof};

/// Proves the bounds of a scene for every posture that its tables hold; each joint may be anywhere.
///
/// # Errors
///
/// The reason why nothing can be proved: words that do not fit, or make no datapath.
pub fn proof(scene: &PhantomScene) -> Result<Proof, Error> {
    let simulation = PhantomSimulation::new(scene)?;
    let (words, config) = (simulation.words(), scene.method.config);
    let nets = simulation.nets();
    if scene.platform.is_host() {
        let remark = "a host computes the forces, in floats: all words of the net".to_string();
        let rows = nets.iter().map(|net| by_format(net, &remark)).collect();
        return Ok(Proof { bounds: rows, ..Proof::default() });
    }
    let stiffness = config.formats.stiffness.to_f64(words.stiffness);
    let proved = bounds(&config, stiffness)?;
    let depth = Format::signed(config.depth_width);
    let inside = format!("every joint stays within its table, {} to {} counts", depth.min(), depth.max());
    let pushed = format!("walls of {stiffness} N/m, anywhere; forces up to the limit in any direction");
    let row = |net: &Signal| {
        let assumptions = vec![inside.clone(), pushed.clone()];
        let exactly = |word: i64| given(net, word, word);
        // The scaled torque is the command, before its register.
        let name = net.name.strip_prefix("scaled").map(|joint| format!("command{joint}"));
        let found = proved.iter().find(|row| row.name == name.as_deref().unwrap_or(net.name));
        match net.name {
            "x_low" | "y_low" | "z_low" => exactly(words.low),
            "x_high" | "y_high" | "z_high" => exactly(words.high),
            "room" => exactly(words.room),
            "period" => exactly(words.period),
            "stiffness" => exactly(words.stiffness),
            "contact" => given(net, 0, words.room),
            "step1" | "step2" | "step3" => Bound { assumptions, ..given(net, -1, 1) },
            "count1" | "count2" | "count3" => {
                Bound { assumptions, ..given(net, depth.min() as i64, depth.max() as i64) }
            }
            _ => match found {
                Some(found) => adapted(net, found, scene, assumptions),
                None if net.format == Format::BIT => given(net, 0, 1),
                None => {
                    let through = "turns over; the joint's count reads through that".to_string();
                    let assumptions = vec![through, inside.clone()];
                    Bound { assumptions, ..given(net, 0, net.format.max() as i64) }
                }
            },
        }
    };
    Ok(Proof { bounds: nets.iter().map(row).collect(), ..Proof::default() })
}

/// Makes a row of the proof. Until the tables are first read, and beyond them, sines and cosines are 0.
fn adapted(net: &Signal, found: &SignalBound, scene: &PhantomScene, assumptions: Vec<String>) -> Bound {
    let config = scene.method.config;
    let length = |word: u32| f64::from(word) / f64::from(1u32 << config.formats.length_frac);
    let at_reset = match net.name {
        "y" => length(config.lengths[1]),
        "z" => -length(config.lengths[0]),
        _ => 0.0,
    };
    // Saturation does not count as fitting: forces and commands are limited by design, and these limits are counted as
    // overflows.
    let limited = net.name.starts_with("force") || net.name.starts_with("scaled") || net.name.starts_with("command");
    Bound {
        name: net.name,
        format: net.format,
        unit: net.unit,
        min: found.min.min(at_reset),
        max: found.max.max(at_reset),
        error: found.error.is_finite().then_some(found.error),
        // Every entry of the tables was checked.
        how: if net.name.contains("sine") { How::Exhausted } else { How::Proved },
        never_overflows: found.fits && !limited,
        assumptions,
    }
}

/// Makes the row of a net whose words lie between two values and have no error.
fn given(net: &Signal, least: i64, most: i64) -> Bound {
    Bound {
        name: net.name,
        format: net.format,
        unit: net.unit,
        min: net.format.to_f64(least),
        max: net.format.to_f64(most),
        error: Some(0.0),
        how: How::Proved,
        never_overflows: true,
        assumptions: Vec::new(),
    }
}

/// Makes the row of a net that may have any word of its format.
fn by_format(net: &Signal, remark: &str) -> Bound {
    let (min, max) = (net.format.min() as f64 * net.format.lsb(), net.format.max() as f64 * net.format.lsb());
    let assumptions = vec![remark.to_string()];
    Bound { min, max, error: None, never_overflows: false, assumptions, ..given(net, 0, 0) }
}
