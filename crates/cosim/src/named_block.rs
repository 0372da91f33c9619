//! A block by its name and its generics, both as text: for commands and for programs that call the library.

use std::fmt;

use hpu_datapath::{AnyBlock, Generic, ROUNDING, block_by_name, block_names, configured};
use hpu_scene::{did_you_mean, excerpt};
use hpu_signal::Rounding;

/// Tells why there is no such block, or no such configuration of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NamedBlockError(String);

impl fmt::Display for NamedBlockError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NamedBlockError {}

/// Returns the block of this name with these generics, each a name and a value; its other generics have their defaults.
/// Names of generics are found whatever their case, as in VHDL.
///
/// # Errors
///
/// Says what is accepted, when there is no such block or generic, a generic is given twice, or the block
/// has no configuration with these values.
pub fn named_block(name: &str, generics: &[(String, String)]) -> Result<Box<dyn AnyBlock>, NamedBlockError> {
    found(name, generics).map_err(NamedBlockError)
}

fn found(name: &str, generics: &[(String, String)]) -> Result<Box<dyn AnyBlock>, String> {
    let default = block_by_name(name).ok_or_else(|| {
        let all = block_names();
        format!("no block `{}`; there are {}{}", excerpt(name), all.join(", "), did_you_mean(name, all))
    })?;
    let known = default.generics();
    let mut set: Vec<(&str, Generic)> = Vec::new();
    for (given, text) in generics {
        let Some(&(generic, own)) = known.iter().find(|(generic, _)| generic.eq_ignore_ascii_case(given)) else {
            let names: Vec<_> = known.iter().map(|(generic, _)| *generic).collect();
            let there_are = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            let near = did_you_mean(&given.to_ascii_uppercase(), &names);
            return Err(format!("{name}: generic {}; accepted: {there_are}{near}", excerpt(given)));
        };
        if set.iter().any(|(other, _)| *other == generic) {
            return Err(format!("{name}: {generic} is given twice; accepted: one value"));
        }
        let value = read(generic, own, text).ok_or_else(|| {
            let accepted = accepted(generic, own);
            format!("{name}: {generic} is {}; accepted: {accepted}", excerpt(text))
        })?;
        set.push((generic, value));
    }
    configured(name, &set).expect("it is known").map_err(|error| error.to_string())
}

/// Reads a value of the kind that the generic has. A rounding may have its name.
fn read(generic: &str, own: Generic, text: &str) -> Option<Generic> {
    let rounding = |text: &str| Rounding::ALL.into_iter().find(|one| one.name().eq_ignore_ascii_case(text));
    match own {
        Generic::Integer(_) if generic == ROUNDING && rounding(text).is_some() => {
            rounding(text).map(|one| Generic::Integer(one.number().into()))
        }
        Generic::Integer(_) => text.parse().ok().map(Generic::Integer),
        Generic::Boolean(_) => text.to_ascii_lowercase().parse().ok().map(Generic::Boolean),
    }
}

/// Returns what a generic takes.
fn accepted(generic: &str, own: Generic) -> String {
    match own {
        Generic::Integer(_) if generic == ROUNDING => {
            Rounding::ALL.map(|one| format!("{} {}", one.number(), one.name())).join(", ")
        }
        Generic::Integer(_) => "a whole number".to_string(),
        Generic::Boolean(_) => "true or false".to_string(),
    }
}
