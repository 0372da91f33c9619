//! A box of parameters that a designer does not know of the world around the fixed-point words, and the scene at points
//! of the box.
//!
//! The words are those of the scene as written, whatever the box: a motor whose resistance is a fifth higher than
//! assumed gets the same duty words and makes less torque of them. A key that changes the words is refused.

use std::fmt;
use std::str::FromStr;

use hpu_cosim::scene::{Experiment, Scene};
use hpu_cosim::{SplitMix64, number};
use hpu_prove::certify::{Over, Range};
use hpu_prove::linear::{Worlds, corners};

use super::Overrides;
use crate::Error;
use crate::map::{Axis, SceneText};

/// A key of a scene that may have any value between two ends.
#[derive(Clone, PartialEq, Debug)]
pub struct Unknown(Axis);

impl FromStr for Unknown {
    type Err = Error;

    /// Reads `KEY=A..B`, with units as in a scene.
    fn from_str(text: &str) -> Result<Self, Error> {
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
    /// Returns the key.
    pub fn key(&self) -> &str {
        self.0.key()
    }

    /// Returns both ends, in the unit that they were given in.
    pub fn ends(&self) -> [f64; 2] {
        [self.0.values()[0], self.0.values()[1]]
    }

    /// Returns the key and both ends as a scene writes them, and which number of the scene's world they are.
    ///
    /// # Errors
    ///
    /// Returns why the key is no number of the world that a proof may have a range of.
    pub fn over(&self, text: &SceneText, set: &[(String, String)], nominal: &Scene) -> Result<(Over, Range), Error> {
        let over = Over { key: self.key().to_string(), ends: self.ends().map(|end| self.0.with_unit(end)) };
        let at = |key: &str, value: &str| {
            let set = [set, &[(key.to_string(), value.to_string())]].concat();
            match text.parse(&set).map_err(hpu_prove::Error::new)? {
                Experiment::Axis(scene) => Ok(scene),
                _ => Err("a proof over ranges is of an axis with a [method]".into()),
            }
        };
        let range = over.range(nominal, at)?;
        Ok((over, range))
    }

    /// Returns the override that gives the key this value.
    fn set(&self, value: f64) -> (String, String) {
        (self.key().to_string(), self.0.with_unit(value))
    }
}

/// A scene, and the box of parameters that are not known of its world.
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// Text of the scene.
    pub text: &'a SceneText,
    /// Overrides of the scene.
    pub set: &'a [(String, String)],
    /// The scene with these overrides; its words hold everywhere in the box.
    pub nominal: &'a Scene,
    /// The sides of the box.
    pub unknown: &'a [Unknown],
    /// Overrides of each further world in the box that is examined by name, such as a published hand.
    pub named: &'a [Overrides],
}

/// Greatest number of sides of a box: each further side doubles the number of corners.
pub const MOST_UNKNOWN: usize = 6;
/// Number of points within a box that are examined beside its corners.
const WITHIN: usize = 8;

impl Worlds for World<'_> {
    fn nominal(&self) -> &Scene {
        self.nominal
    }

    fn keys(&self) -> Vec<&str> {
        self.unknown.iter().map(Unknown::key).collect()
    }

    fn sides(&self) -> Vec<[f64; 2]> {
        self.unknown.iter().map(Unknown::ends).collect()
    }

    fn at(&self, values: &[f64]) -> Result<Scene, hpu_prove::Error> {
        let point: Vec<_> = self.unknown.iter().zip(values).map(|(unknown, value)| unknown.set(*value)).collect();
        self.with(&point).map_err(hpu_prove::Error::new)
    }
}

impl World<'_> {
    /// Returns the scene with further overrides and the words of the nominal scene.
    fn with(&self, point: &[(String, String)]) -> Result<Scene, Error> {
        let set = [self.set, point].concat();
        let place = || {
            let all: Vec<String> = point.iter().map(|(key, value)| format!("{key} = {value}")).collect();
            all.join(", ")
        };
        match self.text.parse(&set)? {
            Experiment::Axis(scene) => scene.with_words_of(self.nominal).map_err(|why| Error::new(why).at(place())),
            _ => Err("limits over a box are those of an axis with a [method]".into()),
        }
    }

    /// Returns the scenes to examine: the nominal one, those at the box's corners, those at `WITHIN` points inside the
    /// box (the same points every time), and the named worlds.
    ///
    /// # Errors
    ///
    /// Returns the reason why there is no scene at one of the points.
    pub fn points(&self) -> Result<Vec<Scene>, Error> {
        let sides = self.sides();
        let mut random = SplitMix64::new(1);
        let within = |[low, high]: [f64; 2], random: &mut SplitMix64| {
            low + (high - low) * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
        };
        let within = (0..WITHIN).map(|_| sides.iter().map(|side| within(*side, &mut random)).collect::<Vec<f64>>());
        let points = corners(&sides).into_iter().chain(within).map(|point| self.at(&point).map_err(Error::from));
        let named = self.named.iter().map(|set| self.with(set));
        std::iter::once(Ok(self.nominal.clone())).chain(points).chain(named).collect()
    }
}
