//! The types of keys: what a key takes, how it is read, and how it is described.

use std::marker::PhantomData;

use hpu_signal::{Format, FormatError};
use toml_edit::Item;

use super::super::parameter::{Origin, ParameterValue};
use super::super::quantity::{Axis, Dimension, RAIL, SHAFT, Sense};
use super::super::section::{Section, shown};
use super::super::source::SceneError;

/// What holds where a scene does not have the key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Otherwise<T> {
    /// Nothing: the key is required.
    Required,
    /// This value.
    Is(T),
    /// What these words say: another part of the scene decides.
    Said(&'static str),
}

/// The sizes of a quantity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sizes {
    /// What the quantity is called, with its article.
    pub name: &'static str,
    /// Its SI unit; empty for a plain number.
    pub unit: &'static str,
    /// Whether 0 is accepted.
    pub zero: bool,
    /// The least value that is not 0: negative where either sign is accepted.
    pub least: f64,
    /// The greatest value.
    pub most: f64,
}

/// The form of a value that only its own reader knows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A list, an element of the form that the words say.
    List,
    /// A whole number, or a list.
    NumberOrList,
    /// A whole number, a flag or a text.
    Scalar,
    /// A whole number, a flag, a text or a section.
    Connection,
}

/// The values that a key accepts.
#[derive(Clone, PartialEq, Debug)]
pub enum Takes {
    /// A quantity; where its dimension is that of the device's motion, a motor's sizes and a mass's.
    Quantity(Vec<Sizes>),
    /// A whole number of this unit (or of none) between these.
    Whole {
        /// The least.
        least: u64,
        /// The greatest.
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
    /// A text, as these words say.
    Text(&'static str),
    /// A list of some of these names.
    Names(Vec<&'static str>),
    /// A section of its own.
    Section,
    /// An expected number: `{ value, tolerance }`, each such a quantity.
    Expected(Vec<Sizes>),
    /// A value that these words describe.
    Own(Shape, &'static str),
}

/// A type of keys.
pub(in crate::scene) trait Described: Sync + 'static {
    fn takes(&self) -> Takes;
    fn otherwise(&self) -> Otherwise<ParameterValue>;
}

/// A type of keys that [`Section::read`] reads.
pub(in crate::scene) trait Read: Described {
    type Value;
    /// The value of the section's key of this name, or what holds where there is none.
    fn read(&self, s: &Section, name: &str) -> Result<Self::Value, SceneError>;
}

fn said<T: Copy>(otherwise: Otherwise<T>, value: impl Fn(T) -> ParameterValue) -> Otherwise<ParameterValue> {
    match otherwise {
        Otherwise::Required => Otherwise::Required,
        Otherwise::Is(is) => Otherwise::Is(value(is)),
        Otherwise::Said(words) => Otherwise::Said(words),
    }
}

/// The value that holds without the key, or `missing`.
fn default<T>(otherwise: Otherwise<T>, missing: impl FnOnce() -> SceneError) -> Result<T, SceneError> {
    match otherwise {
        Otherwise::Is(value) => Ok(value),
        Otherwise::Required | Otherwise::Said(_) => Err(missing()),
    }
}

/// The dimension of a quantity.
enum Of {
    One(&'static Dimension),
    /// That of the device's motion.
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
pub(in crate::scene) struct Quantity {
    of: Of,
    pub sense: Sense,
    otherwise: Otherwise<f64>,
    beyond: fn(f64) -> Option<String>,
}

impl Quantity {
    pub const fn new(dimension: &'static Dimension, sense: Sense, otherwise: Otherwise<f64>) -> Self {
        Self { of: Of::One(dimension), sense, otherwise, beyond: |_| None }
    }

    /// A quantity of the device's motion.
    pub const fn along(of: fn(&Axis) -> &'static Dimension, sense: Sense, otherwise: Otherwise<f64>) -> Self {
        Self { of: Of::Motion(of), sense, otherwise, beyond: |_| None }
    }

    /// With words of its own for refused values; `None` leaves a value to the ordinary words.
    pub const fn refusing(self, beyond: fn(f64) -> Option<String>) -> Self {
        Self { beyond, ..self }
    }

    pub fn dimension(&self, s: &Section) -> &'static Dimension {
        self.of.along(s.axis())
    }

    /// Reads the quantity; without its key it is `otherwise`.
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

impl Described for Quantity {
    fn takes(&self) -> Takes {
        Takes::Quantity(self.of.sizes(self.sense))
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, ParameterValue::Number)
    }
}

impl Read for Quantity {
    type Value = f64;

    fn read(&self, s: &Section, name: &str) -> Result<f64, SceneError> {
        self.read_or(s, name, self.otherwise, Origin::Default)
    }
}

/// A whole number that is read as an `N`, which holds all of its range.
pub(in crate::scene) struct Whole<N> {
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

    /// A width in bits.
    pub const fn bits(least: u64, most: u64, otherwise: u64) -> Self {
        Self { least, most, unit: "bit", otherwise: Otherwise::Is(otherwise), read_as: PhantomData }
    }
}

impl<N: 'static> Described for Whole<N> {
    fn takes(&self) -> Takes {
        Takes::Whole { least: self.least, most: self.most, unit: self.unit }
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, ParameterValue::Integer)
    }
}

impl<N: TryFrom<u64, Error: std::fmt::Debug> + 'static> Read for Whole<N> {
    type Value = N;

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

/// The format of a gain: unsigned, no bit worth less than the fraction bits say. Given by integer and fraction bits of its
/// default.
pub(in crate::scene) struct GainFormat(pub i32, pub i32);

impl GainFormat {
    fn default(&self) -> Result<Format, FormatError> {
        Format::new(false, self.0, self.1)
    }
}

impl Described for GainFormat {
    fn takes(&self) -> Takes {
        Takes::Format
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Is(ParameterValue::Text(self.default().map_or_else(|error| error.to_string(), |f| f.to_string())))
    }
}

impl Read for GainFormat {
    type Value = Format;

    fn read(&self, s: &Section, name: &str) -> Result<Format, SceneError> {
        let format = match s.get(name) {
            None => self.default().map_err(|error| s.error(name, error.to_string()))?,
            Some(item) => gain_format(s, name, item)?,
        };
        s.note(name, ParameterValue::Text(format.to_string()), "", Origin::Default);
        Ok(format)
    }
}

fn gain_format(s: &Section, name: &str, item: &Item) -> Result<Format, SceneError> {
    let text = item.as_str().ok_or_else(|| {
        s.error(name, format!("{} is not a format; write \"(S,I,F)\", as in \"(0,12,0)\"", shown(item)))
    })?;
    let format: Format = text.parse().map_err(|error: FormatError| s.error(name, error.to_string()))?;
    if format.is_signed() || format.frac() < 0 || !(2..=32).contains(&format.width()) {
        let rule = "a gain is unsigned, has no negative fraction bits and 2 to 32 bits, as in \"(0,12,0)\"";
        return Err(s.error(name, format!("{}: {rule}", format_read(text, format))));
    }
    Ok(format)
}

/// A format, and what it was read from where that is another notation.
fn format_read(text: &str, format: Format) -> String {
    match text.trim() {
        text if text.starts_with('(') => format.to_string(),
        text if text.starts_with(['Q', 'q']) && !text.contains('(') => {
            format!("`{text}` is {format}, {} bits, as TI writes it; ARM counts the sign bit too", format.width())
        }
        text => format!("`{text}` is {format}"),
    }
}

/// Names with the values that they stand for.
pub(in crate::scene) type Named<T> = Vec<(&'static str, T)>;

/// These values by their names.
pub(in crate::scene) fn named<T: Copy>(all: &[T], name: impl Fn(T) -> &'static str) -> Named<T> {
    all.iter().map(|value| (name(*value), *value)).collect()
}

/// One of some names, each with the value that it stands for.
pub(in crate::scene) struct Choice<T: 'static> {
    options: fn() -> Named<T>,
    otherwise: Otherwise<T>,
}

impl<T> Choice<T> {
    pub const fn new(options: fn() -> Named<T>, otherwise: Otherwise<T>) -> Self
    where
        T: Copy,
    {
        Self { options, otherwise }
    }
}

impl<T: Copy + PartialEq + Sync> Choice<T> {
    /// The name of a value that is one of the options.
    pub fn name_of(&self, value: T) -> Option<&'static str> {
        (self.options)().into_iter().find(|(_, option)| *option == value).map(|(name, _)| name)
    }
}

impl<T: Copy + PartialEq + Sync + 'static> Described for Choice<T> {
    fn takes(&self) -> Takes {
        Takes::Choice((self.options)().into_iter().map(|(name, _)| name).collect())
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, |value| ParameterValue::Text(self.name_of(value).unwrap_or_default().to_string()))
    }
}

impl<T: Copy + PartialEq + Sync + 'static> Read for Choice<T> {
    type Value = T;

    fn read(&self, s: &Section, name: &str) -> Result<T, SceneError> {
        let options = (self.options)();
        let accepted = || options.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        let chosen = match s.get(name) {
            None => default(self.otherwise, || s.error(name, format!("missing; write one of {}", accepted())))?,
            Some(item) => {
                // A name of digits, as a standard's year, may stand without quotes.
                let is = |name: &str| {
                    item.as_str() == Some(name) || item.as_integer().is_some_and(|year| year.to_string() == name)
                };
                let chosen = options.iter().find(|(name, _)| is(name)).map(|(_, option)| *option);
                chosen.ok_or_else(|| s.error(name, format!("{} is none of {}", shown(item), accepted())))?
            }
        };
        if let Some(is) = self.name_of(chosen) {
            s.note(name, ParameterValue::Text(is.to_string()), "", Origin::Default);
        }
        Ok(chosen)
    }
}

/// `true` or `false`; the default.
pub(in crate::scene) struct Flag(pub bool);

impl Described for Flag {
    fn takes(&self) -> Takes {
        Takes::Flag
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Is(ParameterValue::Flag(self.0))
    }
}

impl Read for Flag {
    type Value = bool;

    fn read(&self, s: &Section, name: &str) -> Result<bool, SceneError> {
        let flag = match s.get(name) {
            None => self.0,
            Some(item) => {
                item.as_bool().ok_or_else(|| s.error(name, format!("{} is not true or false", shown(item))))?
            }
        };
        s.note(name, ParameterValue::Flag(flag), "", Origin::Default);
        Ok(flag)
    }
}

/// A text that is not empty: what it says, and what holds without it.
pub(in crate::scene) struct Text(pub &'static str, pub Otherwise<&'static str>);

impl Described for Text {
    fn takes(&self) -> Takes {
        Takes::Text(self.0)
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.1, |text| ParameterValue::Text(text.to_string()))
    }
}

impl Read for Text {
    type Value = String;

    fn read(&self, s: &Section, name: &str) -> Result<String, SceneError> {
        let text = match s.get(name) {
            None => default(self.1, || s.error(name, format!("missing; write {}", self.0)))?.to_string(),
            Some(item) => {
                let text = item.as_str().filter(|text| !text.trim().is_empty());
                text.ok_or_else(|| s.error(name, format!("{} is not {}", shown(item), self.0)))?.to_string()
            }
        };
        s.note(name, ParameterValue::Text(text.clone()), "", Origin::Default);
        Ok(text)
    }
}

/// A key that a reader of its own reads: a section, a list, a path.
pub(in crate::scene) struct Own {
    takes: fn() -> Takes,
    otherwise: Otherwise<&'static str>,
}

impl Own {
    pub const fn new(takes: fn() -> Takes, otherwise: Otherwise<&'static str>) -> Self {
        Self { takes, otherwise }
    }

    /// A section, with keys of its own.
    pub const fn section(otherwise: Otherwise<&'static str>) -> Self {
        Self { takes: || Takes::Section, otherwise }
    }
}

impl Described for Own {
    fn takes(&self) -> Takes {
        (self.takes)()
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, |text| ParameterValue::Text(text.to_string()))
    }
}

/// An expected number of a run: `{ value, tolerance }`.
pub(in crate::scene) struct Expected {
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

    /// A number of the device's motion.
    pub const fn along(of: fn(&Axis) -> &'static Dimension) -> Self {
        Self {
            value: Quantity::along(of, Sense::Any, Otherwise::Required),
            tolerance: Quantity::along(of, Sense::NotNegative, Otherwise::Required),
        }
    }

    /// The number and its tolerance, in the section of this name.
    pub fn read(&self, s: &Section, name: &str) -> Result<(f64, f64), SceneError> {
        let number = s.section(name)?;
        number.accept_as("expect.METRIC", &[])?;
        Ok((self.value.read(&number, "value")?, self.tolerance.read(&number, "tolerance")?))
    }
}

impl Described for Expected {
    fn takes(&self) -> Takes {
        match self.value.takes() {
            Takes::Quantity(sizes) => Takes::Expected(sizes),
            other => other,
        }
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Said("not judged")
    }
}
