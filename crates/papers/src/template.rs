//! Texts with values in them, as in `{hybrid.limit:.5 N.m/rad}[, {times:.3} times]`.
//!
//! Braces hold a formula and, after a colon, how it is written: `+` for a sign, `.3` for three decimals, then a unit;
//! or `length`. With a question mark before the colon, a value that is missing is replaced by the reason; else the
//! whole text is missing. A part in square brackets is left out if a value in it is missing or not finite.

use std::collections::BTreeMap;

use hpu_cosim::number;

use crate::Error;
use crate::formula::Formula;

/// A measured value.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// A number, in SI units.
    Number(f64),
    /// A text, as in the outcome of a motion.
    Text(String),
}

/// Measured values by name, each with the reason where there is none.
pub type Values = BTreeMap<String, Result<Value, Error>>;

/// Returns the value of a formula: a text only of a single name.
fn value(formula: &Formula, values: &Values) -> Result<Value, Error> {
    let named = |name: &str| match values.get(name) {
        Some(value) => value.clone(),
        None => Err(Error::new(format_args!("no value {name}"))),
    };
    if let Formula::Name(name) = formula {
        return named(name);
    }
    let list = formula.value(&|name| match named(name)? {
        Value::Number(number) => Ok(vec![number]),
        Value::Text(_) => Err(Error::new(format_args!("{name} is a text"))),
    });
    match list?[..] {
        [number] => Ok(Value::Number(number)),
        _ => Err("a list is no number".into()),
    }
}

/// Returns the number that a formula makes of values.
///
/// # Errors
///
/// Returns why there is none.
pub fn figure(formula: &Formula, values: &Values) -> Result<f64, Error> {
    match value(formula, values)? {
        Value::Number(number) => Ok(number),
        Value::Text(text) => Err(Error::new(format_args!("`{text}` is no number"))),
    }
}

/// Returns a length as text, in the unit that suits its size.
pub fn length(length_m: f64) -> String {
    match length_m.abs() {
        size if size < 1e-3 => format!("{:.0} um", length_m * 1e6),
        size if size < 1.0 => format!("{:.1} mm", length_m * 1e3),
        _ => format!("{length_m:.2} m"),
    }
}

/// A text with values in it, read.
#[derive(Default)]
pub struct Template(Vec<Piece>);

enum Piece {
    Text(String),
    Value { formula: Formula, form: Form, soft: bool },
    Optional(Template),
}

/// How a number is written.
#[derive(Default)]
struct Form {
    sign: bool,
    decimals: Option<usize>,
    unit: String,
}

impl Form {
    fn read(text: &str) -> Self {
        let (sign, rest) = text.strip_prefix('+').map_or((false, text), |rest| (true, rest));
        let Some(rest) = rest.strip_prefix('.') else { return Self { sign, decimals: None, unit: rest.into() } };
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        Self { sign, decimals: rest[..end].parse().ok(), unit: rest[end..].into() }
    }

    fn text(&self, value: &Value) -> String {
        let value = match value {
            Value::Number(number) => *number,
            Value::Text(text) => return text.clone(),
        };
        match (self.sign, self.decimals) {
            (_, None) if self.unit == "length" => length(value),
            (_, None) => number(value) + &self.unit,
            (true, Some(decimals)) => format!("{value:+.decimals$}{}", self.unit),
            (false, Some(decimals)) => format!("{value:.decimals$}{}", self.unit),
        }
    }
}

impl Piece {
    /// Reads what stands between braces.
    fn value(text: &str) -> Result<Self, Error> {
        let (formula, form) = text.split_once(':').unwrap_or((text, ""));
        let (formula, soft) = formula.strip_suffix('?').map_or((formula, false), |formula| (formula, true));
        let formula = Formula::read(formula).map_err(|error| error.at(format_args!("in `{{{text}}}`")))?;
        Ok(Self::Value { formula, form: Form::read(form), soft })
    }
}

impl Template {
    /// Reads a text.
    ///
    /// # Errors
    ///
    /// Returns which bracket is not closed, or what is wrong with a formula.
    pub fn read(text: &str) -> Result<Self, Error> {
        let (mut pieces, mut rest) = (Vec::new(), text);
        while let Some(at) = rest.find(['{', '[']) {
            let (end, open) = if rest[at..].starts_with('{') { ('}', "{") } else { (']', "[") };
            let close =
                rest[at..].find(end).ok_or_else(|| Error::new(format_args!("`{open}` is not closed in `{rest}`")))?
                    + at;
            pieces.push(Piece::Text(rest[..at].into()));
            let inner = &rest[at + 1..close];
            pieces.push(if open == "[" { Piece::Optional(Self::read(inner)?) } else { Piece::value(inner)? });
            rest = &rest[close + 1..];
        }
        pieces.push(Piece::Text(rest.into()));
        Ok(Self(pieces))
    }

    /// Returns the text with its values.
    ///
    /// # Errors
    ///
    /// Returns why a value is missing.
    pub fn text(&self, values: &Values) -> Result<String, Error> {
        let texts = self.0.iter().map(|piece| match piece {
            Piece::Text(text) => Ok(text.clone()),
            Piece::Optional(inner) if inner.is_finite(values) => inner.text(values),
            Piece::Optional(_) => Ok(String::new()),
            Piece::Value { formula, form, soft } => match (value(formula, values), soft) {
                (Ok(value), _) => Ok(form.text(&value)),
                (Err(reason), true) => Ok(reason.to_string()),
                (Err(reason), false) => Err(reason),
            },
        });
        texts.collect()
    }

    fn is_finite(&self, values: &Values) -> bool {
        self.0.iter().all(|piece| match piece {
            Piece::Value { formula, .. } => match value(formula, values) {
                Ok(Value::Number(number)) => number.is_finite(),
                text => text.is_ok(),
            },
            _ => true,
        })
    }

    /// Calls `take` with every name in the text.
    pub fn names(&self, take: &mut dyn FnMut(&str)) {
        for piece in &self.0 {
            match piece {
                Piece::Text(_) => {}
                Piece::Value { formula, .. } => formula.names(take),
                Piece::Optional(inner) => inner.names(take),
            }
        }
    }
}
