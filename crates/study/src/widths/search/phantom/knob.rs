//! The widths of a PHANToM's datapath that a search may vary.

use std::fmt;
use std::str::FromStr;

use hpu_cosim::scene::{Experiment, PhantomScene};

use super::super::knob::values;
use crate::widths::Field;

/// The fields that a search may vary, in the order in which designs name them. Integer bits are not among them: a
/// design whose words wrap is useless, and `hpu widths` tells which integer bits are idle.
pub const FIELDS: [Field; 7] =
    [Field::Depth, Field::TrigFrac, Field::Length, Field::Tip, Field::StiffnessFrac, Field::Force, Field::TorqueFrac];

/// Returns a field's key in a search.
#[must_use]
pub const fn key(field: Field) -> &'static str {
    match field {
        Field::Depth => "depth_bits",
        Field::TrigFrac => "trig.frac",
        Field::Length => "length.frac",
        Field::Tip => "position.frac",
        Field::StiffnessFrac => "stiffness.frac",
        Field::Force => "force.frac",
        Field::TorqueFrac => "torque.frac",
        other => other.name(),
    }
}

/// A width, and the range of values that it takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Knob {
    /// The width, one of [`FIELDS`].
    pub field: Field,
    /// The least value.
    pub from: i32,
    /// The greatest value.
    pub to: i32,
}

impl Knob {
    /// Returns the number of values that it takes.
    #[must_use]
    pub fn values(&self) -> usize {
        (self.to - self.from + 1).unsigned_abs() as usize
    }

    /// Returns the knobs of a scene when none is named: the tables' depth from three bits below the scene's own, and
    /// the width of their words; for a parallel loop, also the width of the tip's words.
    #[must_use]
    pub fn usual(scene: &PhantomScene) -> Vec<Self> {
        let own = Design::of(scene);
        let below = |field: Field, bits: i32, least: i32| {
            let to = own.get(field);
            Self { field, from: (to - bits).max(least).min(to - 1), to }
        };
        let mut all = vec![below(Field::Depth, 3, 4), below(Field::TrigFrac, 10, 4)];
        if !scene.method.shared {
            all.push(below(Field::Tip, 10, 4));
        }
        all
    }
}

impl FromStr for Knob {
    type Err = String;

    /// Reads `KEY=FROM..TO`; both ends are values: `trig.frac=14..22`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, range) = text.split_once('=').ok_or("write KEY=FROM..TO, as in trig.frac=14..22")?;
        let name = name.trim();
        let bare = name.strip_prefix("method.").unwrap_or(name);
        let field = FIELDS.into_iter().find(|field| key(*field) == bare).ok_or_else(|| {
            let keys = FIELDS.map(key).join(", ");
            format!("{name} is no width of a PHANToM that a search varies; write one of {keys}")
        })?;
        let accepted = match field {
            Field::Depth => (4, 15),
            Field::TrigFrac => (4, 30),
            _ => (0, 30),
        };
        let (from, to) = values(name, range, accepted)?;
        Ok(Self { field, from, to })
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}..{}", key(self.field), self.from, self.to)
    }
}

/// The widths of a datapath, in the order of [`FIELDS`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Design {
    bits: [i32; FIELDS.len()],
}

impl Design {
    /// Returns the widths of a scene.
    #[must_use]
    pub fn of(scene: &PhantomScene) -> Self {
        let experiment = Experiment::Phantom(scene.clone());
        Self { bits: FIELDS.map(|field| field.bits(&experiment)) }
    }

    /// Returns one width; 0 for a field that is not in [`FIELDS`].
    #[must_use]
    pub fn get(&self, field: Field) -> i32 {
        FIELDS.iter().position(|other| *other == field).map_or(0, |place| self.bits[place])
    }

    /// Returns this design with another value of one width.
    #[must_use]
    pub fn with(mut self, field: Field, bits: i32) -> Self {
        if let Some(place) = FIELDS.iter().position(|other| *other == field) {
            self.bits[place] = bits;
        }
        self
    }

    /// Returns the sum of all widths.
    #[must_use]
    pub fn bits(&self) -> i32 {
        self.bits.iter().sum()
    }

    /// Returns the scene with this datapath.
    ///
    /// # Errors
    ///
    /// Why no scene can have it.
    pub fn scene(&self, base: &PhantomScene) -> Result<PhantomScene, String> {
        let own = Self::of(base);
        let changed = FIELDS.into_iter().zip(self.bits).filter(|(field, bits)| own.get(*field) != *bits);
        let made = changed.into_iter().try_fold(Experiment::Phantom(base.clone()), |made, (field, bits)| {
            field.with(&made, bits).map_err(|why| format!("{}: {why}", key(field)))
        })?;
        let Experiment::Phantom(scene) = made else { unreachable!("a field changes the words alone") };
        scene.words().map_err(|error| error.to_string())?;
        Ok(scene)
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (place, (field, bits)) in FIELDS.into_iter().zip(self.bits).enumerate() {
            write!(f, "{}{} {bits}", if place > 0 { ", " } else { "" }, key(field))?;
        }
        Ok(())
    }
}
