//! What a designer does not know of the world around the words: a box of parameters, and the scene at points of it.
//!
//! The words are those of the scene as it stands, whatever the box: a motor whose resistance is a fifth higher than
//! assumed gets the same duty words and makes less torque of them. A key with which the words change is refused.

use std::fmt;
use std::str::FromStr;

use hpu_cosim::scene::{Experiment, Scene};
use hpu_cosim::{SplitMix64, number};

use super::hands::Overrides;
use crate::map::{Axis, SceneText};

/// A key of a scene that may have any value between two.
#[derive(Clone, PartialEq, Debug)]
pub struct Unknown(Axis);

impl FromStr for Unknown {
    type Err = String;

    /// Reads `KEY=A..B`, with units as in a scene.
    fn from_str(text: &str) -> Result<Self, String> {
        const SYNTAX: &str = "write KEY=A..B with A below B, as in 'device.inductance=0.5..0.7 mH'";
        let (key, range) = text.split_once('=').ok_or(SYNTAX)?;
        if range.contains(':') {
            return Err(SYNTAX.into());
        }
        format!("{key}={range}:2:lin").parse().map(Self)
    }
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [low, high] = self.ends();
        let unit = self.0.unit();
        write!(f, "{}={}..{}{}{unit}", self.key(), number(low), number(high), if unit.is_empty() { "" } else { " " })
    }
}

impl Unknown {
    /// The key.
    #[must_use]
    pub fn key(&self) -> &str {
        self.0.key()
    }

    /// Both ends, in the unit that they were given in.
    #[must_use]
    pub fn ends(&self) -> [f64; 2] {
        [self.0.values()[0], self.0.values()[1]]
    }

    /// What makes the key this value.
    fn set(&self, value: f64) -> (String, String) {
        (self.key().to_string(), self.0.with_unit(value))
    }
}

/// A scene, and the box of what is not known of its world.
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// Its text.
    pub text: &'a SceneText,
    /// What is changed of it.
    pub set: &'a [(String, String)],
    /// The scene under these changes, whose words are in all places of the box.
    pub nominal: &'a Scene,
    /// The sides of the box.
    pub unknown: &'a [Unknown],
    /// What makes it a world in the box that is looked at too.
    pub named: &'a [Overrides],
}

/// Sides that a box may have: of each more there are twice as many corners.
pub const MOST_UNKNOWN: usize = 6;
/// Points within a box that are looked at beside its corners.
const WITHIN: usize = 8;

impl World<'_> {
    /// The scene at a point of the box, with the words of the nominal one.
    ///
    /// # Errors
    ///
    /// Why there is none there.
    pub fn at(&self, values: &[f64]) -> Result<Scene, String> {
        let point: Vec<_> = self.unknown.iter().zip(values).map(|(unknown, value)| unknown.set(*value)).collect();
        self.with(&point)
    }

    /// The scene under some more changes, with the words of the nominal one.
    fn with(&self, point: &[(String, String)]) -> Result<Scene, String> {
        let set = [self.set, point].concat();
        let place = || {
            let all: Vec<String> = point.iter().map(|(key, value)| format!("{key} = {value}")).collect();
            all.join(", ")
        };
        match self.text.parse(&set).map_err(|error| error.to_string())? {
            Experiment::Axis(scene) => scene.with_words_of(self.nominal).map_err(|why| format!("{}: {why}", place())),
            Experiment::Phantom(_) | Experiment::Dut(_) => {
                Err("limits over a box are those of an axis with a [method]".into())
            }
        }
    }

    /// The corners of a box, of which the first side changes fastest.
    pub(super) fn corners(sides: &[[f64; 2]]) -> Vec<Vec<f64>> {
        let corner = |which: usize| sides.iter().enumerate().map(|(side, ends)| ends[which >> side & 1]).collect();
        (0..1usize << sides.len()).map(corner).collect()
    }

    /// The box itself.
    pub(super) fn sides(&self) -> Vec<[f64; 2]> {
        self.unknown.iter().map(Unknown::ends).collect()
    }

    /// The nominal scene, the box's corners, as many points within it as are looked at, always the same, and those that
    /// have a name.
    ///
    /// # Errors
    ///
    /// Why there is no scene at one of them.
    pub fn points(&self) -> Result<Vec<Scene>, String> {
        let sides = self.sides();
        let mut random = SplitMix64::new(1);
        let within = |[low, high]: [f64; 2], random: &mut SplitMix64| {
            low + (high - low) * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
        };
        let within = (0..WITHIN).map(|_| sides.iter().map(|side| within(*side, &mut random)).collect::<Vec<f64>>());
        let points = Self::corners(&sides).into_iter().chain(within).map(|point| self.at(&point));
        let named = self.named.iter().map(|set| self.with(set));
        std::iter::once(Ok(self.nominal.clone())).chain(points).chain(named).collect()
    }
}
