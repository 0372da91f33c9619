//! The types of keys that are not numbers: formats, choices, flags, texts.

use hpu_signal::{Format, FormatError};
use toml_edit::Item;

use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::section::{Section, shown};
use crate::schema::source::SceneError;
use crate::schema::value::{Otherwise, Read, Takes, default, said};
use crate::text::message::did_you_mean;

/// The format of a gain. It is unsigned, and no bit is worth less than the fraction bits allow. The fields are integer
/// and fraction bits of its default.
pub(crate) struct GainFormat(pub i32, pub i32);

impl GainFormat {
    fn default(&self) -> Result<Format, FormatError> {
        Format::new(false, self.0, self.1)
    }
}

impl Read for GainFormat {
    type Value = Format;

    fn takes(&self) -> Takes {
        Takes::Format
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Is(ParameterValue::Text(self.default().map_or_else(|error| error.to_string(), |f| f.to_string())))
    }

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

/// Returns a format as text, with the notation it was read from if that is another one.
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
pub(crate) type Named<T> = Vec<(&'static str, T)>;

/// Returns values with their names.
pub(crate) fn named<T: Copy>(all: &[T], name: impl Fn(T) -> &'static str) -> Named<T> {
    all.iter().map(|value| (name(*value), *value)).collect()
}

/// One of some names, each with the value that it stands for.
pub(crate) struct Choice<T: 'static> {
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
    /// Returns the name of a value that is one of the options.
    pub fn name_of(&self, value: T) -> Option<&'static str> {
        (self.options)().into_iter().find(|(_, option)| *option == value).map(|(name, _)| name)
    }
}

impl<T: Copy + PartialEq + Sync + 'static> Read for Choice<T> {
    type Value = T;

    fn takes(&self) -> Takes {
        Takes::Choice((self.options)().into_iter().map(|(name, _)| name).collect())
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, |value| ParameterValue::Text(self.name_of(value).unwrap_or_default().to_string()))
    }

    fn read(&self, s: &Section, name: &str) -> Result<T, SceneError> {
        let options = (self.options)();
        let names: Vec<_> = options.iter().map(|(name, _)| *name).collect();
        let accepted = || quoted(&names);
        let chosen = match s.get(name) {
            None => default(self.otherwise, || s.error(name, format!("missing; write one of {}", accepted())))?,
            Some(item) => {
                // A name that consists of digits, such as a standard's year, may stand without quotes.
                let is = |name: &str| {
                    item.as_str() == Some(name) || item.as_integer().is_some_and(|year| year.to_string() == name)
                };
                let chosen = options.iter().find(|(name, _)| is(name)).map(|(_, option)| *option);
                chosen.ok_or_else(|| s.error(name, none_of(item, &names)))?
            }
        };
        if let Some(is) = self.name_of(chosen) {
            s.note(name, ParameterValue::Text(is.to_string()), "", Origin::Default);
        }
        Ok(chosen)
    }
}

/// Returns names between quotes, as messages list them.
pub(crate) fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// Returns the message that a value is none of the names, with the nearest of them.
pub(crate) fn none_of(item: &Item, names: &[&str]) -> String {
    let near = item.as_str().map(|text| did_you_mean(text, names));
    format!("{} is none of {}{}", shown(item), quoted(names), near.unwrap_or_default())
}

/// `true` or `false`; the field is the default.
pub(crate) struct Flag(pub bool);

impl Read for Flag {
    type Value = bool;

    fn takes(&self) -> Takes {
        Takes::Flag
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Is(ParameterValue::Flag(self.0))
    }

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

/// A text that is not empty. The fields are a description of the text, and the default.
pub(crate) struct Text(pub &'static str, pub Otherwise<&'static str>);

impl Read for Text {
    type Value = String;

    fn takes(&self) -> Takes {
        Takes::Text(self.0)
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.1, |text| ParameterValue::Text(text.to_string()))
    }

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

/// A key whose value only its own reader understands: a section, a list, a path.
pub(crate) struct Own {
    takes: fn() -> Takes,
    otherwise: Otherwise<&'static str>,
}

impl Own {
    pub const fn new(takes: fn() -> Takes, otherwise: Otherwise<&'static str>) -> Self {
        Self { takes, otherwise }
    }

    /// Returns the type of a section with keys of its own.
    pub const fn section(otherwise: Otherwise<&'static str>) -> Self {
        Self { takes: || Takes::Section, otherwise }
    }
}

impl Read for Own {
    /// The key's own reader reads the value.
    type Value = ();

    fn takes(&self) -> Takes {
        (self.takes)()
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.otherwise, |text| ParameterValue::Text(text.to_string()))
    }

    fn read(&self, _: &Section, _: &str) -> Result<(), SceneError> {
        Ok(())
    }
}
