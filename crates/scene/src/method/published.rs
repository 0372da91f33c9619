//! A published law as scenes choose it.

use std::fmt;

use hpu_datapath::Law;

use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Group, Whole};

/// The width of the energy that a law keeps.
pub(crate) const ENERGY: Whole<u32> = Whole::bits(8, 48, 32);

/// A `Published` is the parameters of a law in a scene, beyond the wall's. The file of each law implements it, so that
/// the rest of the program finds everything about a law in one place.
pub(crate) trait Published: Copy + PartialEq + fmt::Debug {
    /// The law as a block, in words.
    type Block: Law;
    /// The law in floats. It must not share code with the block: the words are measured against it.
    type Float: SampledLaw;

    /// Its keys in `[method]`.
    const KEYS: &'static Group;
    /// The key of the scale of its force, if it has one. Its format is then `scale_format`.
    const SCALE_KEY: Option<&'static str> = None;
    /// Its layers in the map of all methods.
    const LAYERS: &'static [Layer];

    /// Reads its keys.
    fn read(s: &Section) -> Result<Self, SceneError>;
    /// Returns the block with the words of a scene.
    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade>;
    /// Returns the law in floats, with the device at its start.
    fn float(&self, setting: &Setting) -> Result<Self::Float, SceneError>;
    /// Returns its quantities in newton metres, or newtons. They change with the full command where the words stay.
    fn efforts(&mut self) -> Vec<&mut f64>;
    /// Returns the features that distinguish it from a plain sampled wall.
    fn features(&self) -> Features;
    /// Returns those of its keys, as `method.key`, that other values of its own make meaningless.
    fn unused(&self) -> Vec<&'static str> {
        Vec::new()
    }
}

/// The features that distinguish a method from a plain sampled wall, which is the default.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Features {
    /// Whether the spring reads the position at once.
    pub live: bool,
    /// Samples over which a velocity counts.
    pub velocity_samples: f64,
    /// Whether it times the encoder's lines, so that a loaded counter does not do.
    pub times_lines: bool,
    /// Whether it has a reference law in floats.
    pub has_float: bool,
    /// Keys and values of the stiffness and the damping that the gains' words hold, where these are not the wall's.
    pub gains: Option<[(&'static str, f64); 2]>,
    /// The scale of its force.
    pub scale: f64,
    /// The greatest stiffness that it lets a wall have at rest, in N/m, of a motor in N·m/rad.
    pub stiffest: f64,
    /// The reason why the wall cannot change during a run, if it cannot.
    pub fixed_wall: Option<&'static str>,
}

impl Default for Features {
    fn default() -> Self {
        Self {
            live: false,
            velocity_samples: 1.0,
            times_lines: false,
            has_float: true,
            gains: None,
            scale: 1.0,
            stiffest: f64::INFINITY,
            fixed_wall: None,
        }
    }
}

/// A layer of the map of all methods.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layer {
    /// The label.
    pub label: &'static str,
    /// Keys and values beside `method.kind`; [`PASSIVE`] stands for a value that the map computes.
    pub set: &'static [(&'static str, &'static str)],
}

/// In a [`Layer`]: the greatest stiffness `b/T` that the device's own damping `b` keeps passive at the scene's sample
/// rate. A device without damping has no such layer.
pub const PASSIVE: &str = "b/T";
