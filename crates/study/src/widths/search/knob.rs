//! The widths of a loop that a search may vary, by the scene's own keys.

use std::cmp::Ordering;
use std::fmt;

use hpu_cosim::scene::{Experiment, OutcomeKind};

use crate::Error;
use crate::widths::Field;

/// A width that a search may vary.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Key {
    /// The width.
    pub field: Field,
    /// Its key in `[method]`; `.int` and `.frac` after a format's key mean its integer and fraction bits.
    pub name: &'static str,
    /// The least and greatest value that a scene accepts; for integer and fraction bits, that some format has.
    pub accepted: (i32, i32),
    /// Whether a run stays the same when the word is narrower and still holds all its values.
    pub holds: bool,
}

impl Key {
    pub(crate) const fn new(field: Field, name: &'static str, accepted: (i32, i32)) -> Self {
        Self { field, name, accepted, holds: false }
    }

    pub(crate) const fn that_holds(self) -> Self {
        Self { holds: true, ..self }
    }
}

/// The widths of a device's loop, and what a search has to know of the device.
#[derive(Debug)]
pub struct Keys {
    /// The device with its article.
    pub(crate) device: &'static str,
    /// The widths, in the order in which designs name them.
    pub all: &'static [Key],
    /// Returns the text of a design.
    pub(crate) text: fn(&Design) -> String,
    /// The most designs that a search may have.
    pub(crate) most_designs: u128,
    /// The largest relative error of the estimate of logic.
    pub(crate) estimate_error: f64,
    /// Whether a run ends at the first value that the words of [`Key::holds`] do not hold.
    pub(crate) aborts: bool,
    /// The verdict of a run at a stable wall.
    pub(crate) stable: OutcomeKind,
}

impl Keys {
    /// Returns the names of the widths in a row.
    pub fn names(&self) -> String {
        self.all.iter().map(|key| key.name).collect::<Vec<_>>().join(", ")
    }
}

/// A width, and the range of values that it takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Knob {
    /// The width.
    pub key: Key,
    /// The least value.
    pub from: i32,
    /// The greatest value.
    pub to: i32,
}

impl Knob {
    /// Returns the number of values that it takes.
    pub fn values(&self) -> usize {
        (self.to - self.from + 1).unsigned_abs() as usize
    }

    /// Reads the values of a key, `FROM..TO`; the key must accept each of them. `name` is the key as it is written.
    pub(crate) fn read(key: Key, name: &str, range: &str) -> Result<Self, Error> {
        let bits = |text: &str| text.trim().parse::<i32>().ok();
        let Some((from, to)) = range.split_once("..") else {
            return Err(match bits(range) {
                Some(bits) => Error::new(format_args!(
                    "{name} takes one value only, {bits}; write KEY=FROM..TO, or set it by --set"
                )),
                None => SYNTAX.into(),
            });
        };
        let (Some(from), Some(to)) = (bits(from), bits(to)) else {
            return Err(format!("`{}` is no range of bits; {SYNTAX}", range.trim()).into());
        };
        let (least, most) = key.accepted;
        if let Some(bits) = [from, to].into_iter().find(|bits| !(least..=most).contains(bits)) {
            return Err(format!("{name} cannot be {bits}: a scene takes {least} to {most}").into());
        }
        match from.cmp(&to) {
            Ordering::Less => Ok(Self { key, from, to }),
            Ordering::Equal => {
                Err(Error::new(format_args!("{name}={from}..{to} takes one value only; widen it, or set it by --set")))
            }
            Ordering::Greater => {
                Err(Error::new(format_args!("{name}={from}..{to} is reversed; write the smaller value first")))
            }
        }
    }
}

/// The form of a knob on the command line.
pub(crate) const SYNTAX: &str = "write KEY=FROM..TO, as in position_bits=8..16";

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}..{}", self.key.name, self.from, self.to)
    }
}

/// The most widths that a device has.
const MOST: usize = 7;

/// The widths of a loop, in the order of its device's keys.
#[derive(Clone, Copy, Debug)]
pub struct Design {
    bits: [i32; MOST],
    keys: &'static Keys,
}

impl Design {
    /// Returns the widths of a scene whose device has these keys.
    pub(crate) fn new(keys: &'static Keys, scene: &Experiment) -> Self {
        let mut bits = [0; MOST];
        bits.iter_mut().zip(keys.all).for_each(|(bits, key)| *bits = key.field.bits(scene));
        Self { bits, keys }
    }

    /// Returns every width with its key.
    pub fn widths(&self) -> impl Iterator<Item = (Key, i32)> + use<> {
        self.keys.all.iter().copied().zip(self.bits)
    }

    /// Returns the knob of one width; `None` where the device does not have it.
    pub(crate) fn knob(&self, field: Field, from: i32, to: i32) -> Option<Knob> {
        self.place(field).map(|place| Knob { key: self.keys.all[place], from, to })
    }

    fn place(&self, field: Field) -> Option<usize> {
        self.keys.all.iter().position(|key| key.field == field)
    }

    /// Returns one width; 0 for one that the device does not have.
    pub fn get(&self, field: Field) -> i32 {
        self.place(field).map_or(0, |place| self.bits[place])
    }

    /// Returns this design with another value of one width; itself where the device does not have it.
    #[must_use]
    pub fn with(mut self, field: Field, bits: i32) -> Self {
        if let Some(place) = self.place(field) {
            self.bits[place] = bits;
        }
        self
    }

    /// Returns the sum of all widths.
    pub fn bits(&self) -> i32 {
        self.bits.iter().sum()
    }

    /// Returns this design without the widths whose words only have to hold a run's values, and these widths.
    pub(crate) fn parted(mut self) -> (Self, Depth) {
        let mut depth = Depth::default();
        let holding = self.bits.iter_mut().zip(self.keys.all).filter(|(_, key)| key.holds);
        depth.iter_mut().zip(holding).for_each(|(depth, (bits, _))| *depth = std::mem::take(bits));
        (self, depth)
    }

    /// Returns the design of which [`parted`](Self::parted) made this one.
    pub(crate) fn joined(mut self, depth: Depth) -> Self {
        let holding = self.bits.iter_mut().zip(self.keys.all).filter(|(_, key)| key.holds);
        holding.zip(depth).for_each(|((bits, _), depth)| *bits = depth);
        self
    }
}

/// The bits of the widths whose words only have to hold a run's values, at most two; 0 where there is none.
pub type Depth = [i32; 2];

impl PartialEq for Design {
    fn eq(&self, other: &Self) -> bool {
        self.bits == other.bits
    }
}

impl Eq for Design {}

impl PartialOrd for Design {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// By their bits: one search compares designs of one device alone.
impl Ord for Design {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bits.cmp(&other.bits)
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&(self.keys.text)(self))
    }
}
