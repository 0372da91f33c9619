//! The types of keys: how a key is described and read. This module has those of numbers.

use std::marker::PhantomData;

use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{Axis, Dimension, RAIL, SHAFT, Sense, Sizes};
use crate::schema::section::{Section, shown};
use crate::schema::source::SceneError;

/// The value of a scene without the key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Otherwise<T> {
    /// There is no default: the key is required.
    Required,
    /// This value.
    Is(T),
    /// A value that another part of the scene decides; the text describes it.
    Said(&'static str),
}

/// The form of a value that only the key's own reader understands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A list; the text gives the form of an element.
    List,
    /// A whole number, or a list.
    NumberOrList,
    /// A number, a flag or a text.
    Scalar,
    /// A whole number, a flag, a text or a section.
    Connection,
    /// A text or a section: a file, and how to read it.
    File,
}

/// The values that a key accepts.
#[derive(Clone, PartialEq, Debug)]
pub enum Takes {
    /// A quantity. If its dimension depends on the device's motion, there are two sizes: a motor's and a mass's.
    Quantity(Vec<Sizes>),
    /// A whole number of this unit (or of none) in this range.
    Whole {
        /// The least value.
        least: u64,
        /// The greatest value.
        most: u64,
        /// `bit`, or empty.
        unit: &'static str,
    },
    /// The format of a gain.
    Format,
    /// One of these names.
    Choice(Vec<&'static str>),
    /// `true` or `false`.
    Flag,
    /// A text; the words describe it.
    Text(&'static str),
    /// A list of some of these names.
    Names(Vec<&'static str>),
    /// A section of its own.
    Section,
    /// An expected number: `{ value, tolerance }`, each a quantity of these sizes.
    Expected(Vec<Sizes>),
    /// A value that these words describe.
    Own(Shape, &'static str),
}

/// A type of keys. It tells which values such a key takes, its default, and how it is read. Each kind of value
/// implements it, so that readers, schema and documentation use one description.
pub(crate) trait Read: Sync + 'static {
    type Value;

    fn takes(&self) -> Takes;

    fn otherwise(&self) -> Otherwise<ParameterValue>;

    /// Returns the value of the section's key of this name, or its default.
    fn read(&self, s: &Section, name: &str) -> Result<Self::Value, SceneError>;
}

pub(crate) fn said<T: Copy>(otherwise: Otherwise<T>, value: impl Fn(T) -> ParameterValue) -> Otherwise<ParameterValue> {
    match otherwise {
        Otherwise::Required => Otherwise::Required,
        Otherwise::Is(is) => Otherwise::Is(value(is)),
        Otherwise::Said(words) => Otherwise::Said(words),
    }
}

/// Returns the value of a scene without the key, or the error `missing`.
pub(super) fn default<T>(otherwise: Otherwise<T>, missing: impl FnOnce() -> SceneError) -> Result<T, SceneError> {
    match otherwise {
        Otherwise::Is(value) => Ok(value),
        Otherwise::Required | Otherwise::Said(_) => Err(missing()),
    }
}

/// The dimension of a quantity.
enum Of {
    One(&'static Dimension),
    /// The dimension of the device's motion.
    Motion(fn(&Axis) -> &'static Dimension),
}

impl Of {
    fn along(&self, axis: &Axis) -> &'static Dimension {
        match self {
            Self::One(dimension) => dimension,
            Self::Motion(of) => of(axis),
        }
    }

    fn sizes(&self, sense: Sense) -> Vec<Sizes> {
        match self {
            Self::One(dimension) => vec![sense.told(dimension)],
            Self::Motion(of) => [&SHAFT, &RAIL].map(|axis| sense.told(of(axis))).to_vec(),
        }
    }
}

/// A quantity with its dimension.
pub(crate) struct Quantity {
    of: Of,
    pub sense: Sense,
    otherwise: Otherwise<f64>,
    beyond: fn(f64) -> Option<String>,
}

impl Quantity {
    pub const fn new(dimension: &'static Dimension, sense: Sense, otherwise: Otherwise<f64>) -> Self {
        Self { of: Of::One(dimension), sense, otherwise, beyond: |_| None }
    }

    /// Returns a quantity of the device's motion.
    pub const fn along(of: fn(&Axis) -> &'static Dimension, sense: Sense, otherwise: Otherwise<f64>) -> Self {
        Self { of: Of::Motion(of), sense, otherwise, beyond: |_| None }
    }

    /// Returns the quantity with its own message for refused values; where `beyond` gives `None`, the usual message is
    /// used.
    pub const fn refusing(self, beyond: fn(f64) -> Option<String>) -> Self {
        Self { beyond, ..self }
    }

    pub fn dimension(&self, s: &Section) -> &'static Dimension {
        self.of.along(s.axis())
    }

    /// Reads the quantity; without its key, its value is `otherwise`.
    pub fn read_or(&self, s: &Section, name: &str, otherwise: Otherwise<f64>, by: Origin) -> Result<f64, SceneError> {
        let dimension = self.dimension(s);
        let value = match s.get(name) {
            None => default(otherwise, || {
                s.error(name, format!("missing; write {} as {}", dimension.name, dimension.accepted()))
            })?,
            Some(item) => s.quantity_of(name, item, dimension, self.sense, self.beyond)?,
        };
        s.note(name, ParameterValue::Number(value), dimension.si_unit(), by);
        Ok(value)
    }
}

impl Read for Quantity {
    type Value = f64;

    fn takes(&self) -> Takes {
        Takes::Quantity(self.of.sizes(self.sense))
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, ParameterValue::Number)
    }

    fn read(&self, s: &Section, name: &str) -> Result<f64, SceneError> {
        self.read_or(s, name, self.otherwise, Origin::Default)
    }
}

/// A whole number that is read as an `N`; `N` must hold its whole range.
pub(crate) struct Whole<N> {
    least: u64,
    most: u64,
    unit: &'static str,
    otherwise: Otherwise<u64>,
    read_as: PhantomData<fn() -> N>,
}

impl<N> Whole<N> {
    pub const fn new(least: u64, most: u64, otherwise: Otherwise<u64>) -> Self {
        Self { least, most, unit: "", otherwise, read_as: PhantomData }
    }

    /// Returns the type of a width in bits.
    pub const fn bits(least: u64, most: u64, otherwise: u64) -> Self {
        Self { least, most, unit: "bit", otherwise: Otherwise::Is(otherwise), read_as: PhantomData }
    }
}

impl<N: TryFrom<u64, Error: std::fmt::Debug> + 'static> Read for Whole<N> {
    type Value = N;

    fn takes(&self) -> Takes {
        Takes::Whole { least: self.least, most: self.most, unit: self.unit }
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, ParameterValue::Integer)
    }

    fn read(&self, s: &Section, name: &str) -> Result<N, SceneError> {
        let accepted = format!("a whole number from {} to {}", self.least, self.most);
        let number = match s.get(name) {
            None => default(self.otherwise, || s.error(name, format!("missing; write {accepted}")))?,
            Some(item) => item
                .as_integer()
                .and_then(|number| u64::try_from(number).ok())
                .filter(|number| (self.least..=self.most).contains(number))
                .ok_or_else(|| s.error(name, format!("{} is not {accepted}", shown(item))))?,
        };
        s.note(name, ParameterValue::Integer(number), self.unit, Origin::Default);
        Ok(N::try_from(number).expect("the range is one of its type"))
    }
}

/// An expected number of a run: `{ value, tolerance }`.
pub(crate) struct Expected {
    value: Quantity,
    tolerance: Quantity,
}

impl Expected {
    pub const fn new(dimension: &'static Dimension, sense: Sense) -> Self {
        Self {
            value: Quantity::new(dimension, sense, Otherwise::Required),
            tolerance: Quantity::new(dimension, Sense::NotNegative, Otherwise::Required),
        }
    }

    /// Returns the type of an expected number of the device's motion.
    pub const fn along(of: fn(&Axis) -> &'static Dimension) -> Self {
        Self {
            value: Quantity::along(of, Sense::Any, Otherwise::Required),
            tolerance: Quantity::along(of, Sense::NotNegative, Otherwise::Required),
        }
    }
}

impl Read for Expected {
    /// The number and its tolerance.
    type Value = (f64, f64);

    fn takes(&self) -> Takes {
        match self.value.takes() {
            Takes::Quantity(sizes) => Takes::Expected(sizes),
            other => other,
        }
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Said("not judged")
    }

    fn read(&self, s: &Section, name: &str) -> Result<(f64, f64), SceneError> {
        let number = s.section(name)?;
        number.accept_as("expect.METRIC", &[])?;
        Ok((self.value.read(&number, "value")?, self.tolerance.read(&number, "tolerance")?))
    }
}
