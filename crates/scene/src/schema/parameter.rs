//! A scene's parameters: values, units and origins.

use std::cell::RefCell;
use std::fmt;

use crate::text::message::number;

/// A parameter of a scene, with the value that the run uses.
#[derive(Clone, PartialEq, Debug)]
pub struct Parameter {
    /// Its key, as in `wall.stiffness`.
    pub key: String,
    /// Its value.
    pub value: ParameterValue,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// The origin of the value.
    pub origin: Origin,
}

/// The value of a parameter.
#[derive(Clone, PartialEq, Debug)]
pub enum ParameterValue {
    /// A quantity, in the parameter's unit.
    Number(f64),
    /// A whole number.
    Integer(u64),
    /// True or false.
    Flag(bool),
    /// A choice, a format, the name of a file, a path.
    Text(String),
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Number(value) => f.write_str(&number(*value)),
            Self::Integer(value) => value.fmt(f),
            Self::Flag(flag) => flag.fmt(f),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// Where a parameter's value comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Origin {
    /// The scene's file.
    Scene,
    /// An override.
    Set,
    /// The default: neither file nor override gives a value.
    Default,
    /// The part that the scene names.
    Part {
        /// The kind of the part: a motor, an encoder, an amplifier or a bridge.
        kind: &'static str,
        /// Its name.
        name: &'static str,
    },
    /// The model of the arm that the scene names.
    Arm(&'static str),
}

/// Parameters in the order in which they are read.
#[derive(Default)]
pub(crate) struct Parameters(RefCell<Vec<Parameter>>);

impl Parameters {
    /// Notes a parameter; if it was read before, replaces its value.
    pub(crate) fn note(&self, parameter: Parameter) {
        let mut all = self.0.borrow_mut();
        match all.iter_mut().find(|known| known.key == parameter.key) {
            Some(known) => *known = parameter,
            None => all.push(parameter),
        }
    }

    /// Returns all parameters but those under these keys, which the run does not use.
    pub(crate) fn take(&self, unused: &[&str]) -> Vec<Parameter> {
        let mut all = self.0.take();
        let under = |key: &str, section: &str| {
            key.strip_prefix(section).is_some_and(|rest| matches!(rest.as_bytes(), [] | [b'.', ..]))
        };
        all.retain(|parameter| !unused.iter().any(|section| under(&parameter.key, section)));
        all
    }
}
