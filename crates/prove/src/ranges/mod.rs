//! Proofs of ranges and errors that no motion can exceed, beside the measured ones.
//!
//! A proof has two steps. The first is about the *device*: whatever the datapath commands, a bridge gives no more than
//! its supply. So current, speed and angle of the shaft stay within limits that no controller can change ([`Limit`]).
//! The second is about the *words*: for every motion within these limits, each block hands on a range and an error, in
//! exact integers.
//!
//! So a bound holds for stable and unstable loops alike, and for every gain that the scene's words could be set to
//! within the commands they lead to. Both steps are tight. The worst command drives a shaft to within a hundredth of
//! its limits. Motion within the limits brings every signal of the haptic loops and of an arm's to within two bits
//! of its bound. A scene's own run may stay far below: `hybrid-wall` itself goes 44 counts deep and 8 counts a sample
//! fast. A command that pumps the shaft against the hand's spring could reach 819 and 367.
//!
//! A device that no hand holds has no limit of its travel; its words are bounded by their formats. Among the memories
//! of the methods, energies are sums without a limit.

pub mod affine;
mod device;
mod exhaust;
mod gappa;
pub mod haptic;
mod holds;
mod laws;
mod response;
pub mod span;
mod system;
pub mod text;
mod travel;
pub mod walk;
pub mod word;
mod wrap;

use hpu_cosim::scene::{Datapath, LoopWords, Scene};
use hpu_cosim::{AxisSimulation, Simulation};
use hpu_signal::Format;

use crate::Error;
use device::{Motion, Shaft};
pub use exhaust::{MOST_INPUTS, exhausted};
pub use gappa::gappa;
use haptic::NetRanges;
pub use holds::Limits;
pub use holds::ProvedRanges;
use hpu_signal::Span;
pub use system::System;
use travel::{Settings, Travel};

/// The way in which a figure was found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum How {
    /// Seen in runs; other runs may exceed it.
    Measured,
    /// All inputs were tried.
    Exhausted,
    /// It follows from the assumptions.
    Proved,
}

/// The bounds of one signal, for every motion under the assumptions.
#[derive(Clone, PartialEq, Debug)]
pub struct Bound {
    /// Name of the net.
    pub name: &'static str,
    /// Its format.
    pub format: Format,
    /// The unit of its values.
    pub unit: &'static str,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Greatest distance to the same law in real numbers on the same counts; `None` where none is proved.
    pub error: Option<f64>,
    /// How the range came about.
    pub how: How,
    /// Whether the word holds every value that belongs in it: it never wraps, is never clamped, and no run counts an
    /// edge at which it has overflowed. A position may wrap, as long as the displacement is still read correctly.
    pub never_overflows: bool,
    /// The assumptions of the proof.
    pub assumptions: Vec<String>,
}

/// A limit that the device cannot exceed, whatever it is commanded.
#[derive(Clone, PartialEq, Debug)]
pub struct Limit {
    /// Its quantity: `current`, `speed`, `angle`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// The reason for the limit.
    pub why: String,
}

/// The stiffness and penetration at which the spring's product first overflows its word.
#[derive(Clone, PartialEq, Debug)]
pub struct WrapsAt {
    /// The deepest penetration that is proved, in counts.
    pub penetration: i64,
    /// The least word of the stiffness at which that penetration overflows; `None` if no word of its format does.
    pub word: Option<i64>,
    /// The stiffness of one word, in N.m/rad (N/m).
    pub of_a_word: f64,
    /// The least penetration that overflows at the scene's own stiffness, in counts; `None` if there is none.
    pub at_scene: Option<i64>,
    /// The least word at which a hand that pushes to the end of its path cannot come to rest without an overflow;
    /// `None` for other hands. At every penetration that does not overflow, its grip then pushes harder than spring and
    /// friction hold.
    pub at_rest: Option<i64>,
    /// Whether the penetration is certainly reached. Then this word is the first at which the product overflows; else
    /// it is only the first at which no proof excludes an overflow.
    pub reached: bool,
}

/// All proved bounds of a scene.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Proof {
    /// One row a net, in the order of the wiring.
    pub bounds: Vec<Bound>,
    /// The limits that the device cannot exceed.
    pub limits: Vec<Limit>,
    /// Where the spring's product first overflows its word; `None` where there is no such product.
    pub wraps_at: Option<WrapsAt>,
}

impl Proof {
    /// Returns the bound of a net.
    pub fn of(&self, net: &str) -> Option<&Bound> {
        self.bounds.iter().find(|bound| bound.name == net)
    }
}

/// Proves the bounds of an axis's scene.
///
/// # Errors
///
/// The reason why nothing can be proved: no words, or words that make no datapath.
pub fn axis_bounds(scene: &Scene) -> Result<Proof, Error> {
    if scene.model.datapath == Datapath::Linear {
        return Err("the scene's law is linear: it has no words".into());
    }
    if scene.network.is_some() {
        return Err("the device is a network, of whose motion no bound is proved; write a motor or a mass".into());
    }
    let simulation = AxisSimulation::new(scene)?;
    let wiring = simulation.axis_loop().ok_or("the scene's law is computed in floats: it has no words")?;
    let (words, nets) = (simulation.words(), simulation.nets());
    let settings = Settings::new(words, scene.device.units().position);
    let mut assumptions = vec![format!("a clock of {} Hz, words as the scene sets them", scene.clock.frequency_hz())];
    if scene.model.solver.is_fixed_step() {
        assumptions.push("the device itself, not what a solver in steps makes of it".into());
    }
    let shaft = match Shaft::new(scene) {
        Ok(shaft) => shaft,
        Err(reason) => {
            assumptions.push(format!("no limit of the motion: {reason}"));
            let rows = NetRanges::of(&settings, &Travel::unlimited(), wiring);
            return Ok(Proof { bounds: rows.bounds(&nets, &assumptions), limits: Vec::new(), wraps_at: None });
        }
    };
    let Narrowed { motion, travel, rows } =
        narrowed(&shaft, words, scene, &settings, |travel| NetRanges::of(&settings, travel, wiring));
    let assumptions: Vec<_> = assumptions.iter().chain(&motion.why).cloned().collect();
    let wraps_at = wrap::wraps_at(scene, words, &settings, &travel, &rows);
    Ok(Proof { bounds: rows.bounds(&nets, &assumptions), limits: motion.limits(scene), wraps_at })
}

/// A motion, with the words that it leads to.
struct Narrowed {
    motion: Motion,
    travel: Travel,
    rows: NetRanges,
}

/// Starts with any command. The words that follow allow a narrower range of commands, and that range is valid as well.
/// `rows` returns the words for a travel.
fn narrowed(
    shaft: &Shaft,
    words: &LoopWords,
    scene: &Scene,
    settings: &Settings,
    rows: impl Fn(&Travel) -> NetRanges,
) -> Narrowed {
    let full = (1i128 << settings.config.pwm.width) - 1;
    let made = |commands| {
        let motion = shaft.motion(commands, &settings.config);
        let travel = Travel::new(scene, words, &motion);
        let rows = rows(&travel);
        Narrowed { motion, travel, rows }
    };
    let mut commands = (-full, full);
    let mut found = made(commands);
    for _ in 1..4 {
        let Span { min, max } = found.rows.get("command").span;
        if (min, max) == commands {
            break;
        }
        commands = (min, max);
        found = made(commands);
    }
    found
}
