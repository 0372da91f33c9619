//! A row in words, as `hpu keys` and the documentation show it.

use crate::schema::parameter::ParameterValue;
use crate::schema::{KeyRow, Otherwise, Shape, Sizes, Takes};
use crate::text::message::number;

impl KeyRow {
    /// Returns the unit of a quantity or width, else the type of the value.
    pub fn unit(&self) -> String {
        match &self.takes {
            Takes::Quantity(sizes) => units(sizes),
            Takes::Expected(sizes) => format!("{{ value, tolerance }} in {}", units(sizes)),
            Takes::Whole { unit: "", .. } => "whole number".into(),
            Takes::Whole { unit, .. } => (*unit).into(),
            Takes::Format => "format".into(),
            Takes::Choice(_) => "choice".into(),
            Takes::Flag => "flag".into(),
            Takes::Text(_) => "text".into(),
            Takes::Names(_) | Takes::Own(Shape::List, _) => "list".into(),
            Takes::Section => "section".into(),
            Takes::Own(Shape::NumberOrList, _) => "number or list".into(),
            Takes::Own(Shape::Scalar, _) => "value".into(),
            Takes::Own(Shape::Connection, _) => "connection".into(),
            Takes::Own(Shape::File, _) => "file".into(),
        }
    }

    /// Returns the accepted range, options or form; empty for a section.
    pub fn accepted(&self) -> String {
        match &self.takes {
            Takes::Quantity(sizes) | Takes::Expected(sizes) => ranges(sizes),
            Takes::Whole { least, most, .. } => format!("{least} to {most}"),
            Takes::Format => "unsigned, 2 to 32 bits, as \"(0,12,0)\"".into(),
            Takes::Choice(names) => names.join(", "),
            Takes::Names(names) => format!("some of {}", names.join(", ")),
            Takes::Flag => "true, false".into(),
            Takes::Text(words) | Takes::Own(_, words) => (*words).into(),
            Takes::Section => String::new(),
        }
    }

    /// Returns the default with its unit, `required`, or the origin of the value.
    pub fn default(&self) -> String {
        match &self.otherwise {
            Otherwise::Required => "required".into(),
            Otherwise::Said(words) => (*words).into(),
            Otherwise::Is(ParameterValue::Number(value)) => {
                let unit = match &self.takes {
                    Takes::Quantity(sizes) if *value != 0.0 => units(sizes),
                    _ => String::new(),
                };
                format!("{} {}", number(*value), if unit == NUMBER { "" } else { &unit }).trim_end().into()
            }
            Otherwise::Is(value) => value.to_string(),
        }
    }
}

/// The unit of a plain number, in words.
const NUMBER: &str = "number";

/// Returns the unit, or the units of a motor and of a mass.
fn units(sizes: &[Sizes]) -> String {
    match sizes {
        [] => "the metric's".into(),
        _ => sizes
            .iter()
            .map(|size| if size.unit.is_empty() { NUMBER } else { size.unit })
            .collect::<Vec<_>>()
            .join(" or "),
    }
}

/// Returns the range, or the ranges of a motor and of a mass with their units.
fn ranges(sizes: &[Sizes]) -> String {
    let range = |size: &Sizes| {
        let zero = if size.zero && size.least > 0.0 { "0, or " } else { "" };
        format!("{zero}{} to {}", number(size.least), number(size.most))
    };
    match sizes {
        [size] => range(size),
        _ => sizes.iter().map(|size| format!("{} {}", range(size), size.unit)).collect::<Vec<_>>().join("; "),
    }
}
