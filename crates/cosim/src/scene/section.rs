//! Reads one section of a scene. Each reader knows its key's default, range and unit, and names them when it refuses.

use std::ops::RangeInclusive;

use hpu_signal::{Format, FormatError};
use toml_edit::{Item, TableLike, Value};

use super::parameter::{Origin, Parameter, ParameterValue, Parameters};
use super::quantity::Dimension;
use super::source::{Places, SceneError, join};
use crate::message::{excerpt, number};

/// The accepted values of a quantity. Sizes are those of the [`Dimension`], or the key's own.
#[derive(Clone, Copy)]
pub(super) enum Sense {
    /// Either sign, and 0.
    Any,
    /// 0 and above.
    NotNegative,
    /// 0 and above, up to the key's own greatest size.
    UpTo(f64),
    /// Above 0.
    Positive,
    /// Above 0, between the key's own sizes.
    Within(f64, f64),
}

impl Sense {
    /// Returns the least size above 0, if there is one, and the greatest size.
    fn sizes(self, dimension: &Dimension) -> (Option<f64>, f64) {
        match self {
            Self::Any => (None, dimension.most),
            Self::NotNegative | Self::Positive => (Some(dimension.least), dimension.most),
            Self::UpTo(most) => (Some(dimension.least), most),
            Self::Within(least, most) => (Some(least), most),
        }
    }

    /// Returns the reason for refusing a value, which was written as `shown`; `None` if it is accepted.
    fn refuses(self, dimension: &Dimension, value: f64, shown: &str) -> Option<String> {
        let rule = match self {
            Self::NotNegative | Self::UpTo(_) if value < 0.0 => "must not be negative",
            Self::Positive | Self::Within(..) if value <= 0.0 => "must be above zero",
            _ => "",
        };
        if !rule.is_empty() {
            return Some(format!("{shown} {rule}"));
        }
        let (least, most) = self.sizes(dimension);
        if value.abs() <= most && least.is_none_or(|least| value == 0.0 || value >= least) {
            return None;
        }
        let unit = dimension.si_unit();
        let [low, high] = [least.unwrap_or(-most), most].map(number);
        let zero = if matches!(self, Self::NotNegative | Self::UpTo(_)) { "0, or " } else { "" };
        let accepted = format!("{zero}{low} to {high} {unit}");
        Some(format!("{} {unit}; accepted: {}", number(value), accepted.trim_end()).replace(" ;", ";"))
    }
}

/// One table of the scene. A missing table reads as an empty one.
pub(super) struct Section<'a> {
    places: &'a Places,
    parameters: &'a Parameters,
    path: String,
    table: Option<&'a dyn TableLike>,
}

impl<'a> Section<'a> {
    pub fn root(places: &'a Places, parameters: &'a Parameters, table: &'a dyn TableLike) -> Self {
        Self { places, parameters, path: String::new(), table: Some(table) }
    }

    pub fn key(&self, key: &str) -> String {
        join(&self.path, key)
    }

    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(&self.key(key), reason)
    }

    pub fn section(&self, key: &str) -> Result<Section<'a>, SceneError> {
        let table = match self.get(key) {
            None => None,
            Some(item) => match item.as_table_like() {
                Some(table) => Some(table),
                None => {
                    let auto =
                        if self.key(key) == "model" { ", or model = \"auto\" for what hpu fit chooses" } else { "" };
                    return Err(self.error(key, format!("a section is expected; write [{}]{auto}", self.key(key))));
                }
            },
        };
        Ok(Section { places: self.places, parameters: self.parameters, path: self.key(key), table })
    }

    pub fn get(&self, key: &str) -> Option<&'a Item> {
        self.table.and_then(|table| table.get(key))
    }

    /// Returns the keys that are present.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.table.into_iter().flat_map(|table| table.iter()).map(|(key, _)| key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Returns the error for an unknown key, with the text to write instead.
    pub fn unknown(&self, key: &str, instead: &str) -> SceneError {
        self.places.key_error(&self.key(key), format!("unknown key; {instead}"))
    }

    /// Refuses every key that is not among these.
    pub fn accept(&self, keys: &[&str]) -> Result<(), SceneError> {
        let mut present = self.table.into_iter().flat_map(|table| table.iter());
        let Some((unknown, _)) = present.find(|(key, _)| !keys.contains(key)) else {
            return Ok(());
        };
        let kind = self.get("kind").and_then(|item| item.as_str());
        let kind = kind.map_or(String::new(), |kind| format!(" for kind \"{kind}\""));
        let reason = format!("unknown key{kind}; accepted here: {}", keys.join(", "));
        Err(self.places.key_error(&self.key(unknown), reason))
    }

    /// Notes a parameter's value: with the origin of its key if the key is present, else with `otherwise`.
    pub fn note(&self, key: &str, value: ParameterValue, unit: &'static str, otherwise: Origin) {
        let path = self.key(key);
        let origin = if self.has(key) { self.places.origin(&path) } else { otherwise };
        self.parameters.note(Parameter { key: path, value, unit, origin });
    }

    fn noted<T>(&self, key: &str, value: T, unit: &'static str, shown: impl FnOnce(&T) -> ParameterValue) -> T {
        self.note(key, shown(&value), unit, Origin::Default);
        value
    }

    pub fn choice<T>(&self, key: &str, options: &[(&str, T)], default: Option<T>) -> Result<T, SceneError>
    where
        T: Copy + PartialEq,
    {
        let chosen = self.chosen(key, options, default)?;
        if let Some((name, _)) = options.iter().find(|(_, option)| *option == chosen) {
            self.note(key, ParameterValue::Text((*name).to_string()), "", Origin::Default);
        }
        Ok(chosen)
    }

    fn chosen<T: Copy>(&self, key: &str, options: &[(&str, T)], default: Option<T>) -> Result<T, SceneError> {
        let accepted = || options.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        match (self.get(key), default) {
            (None, Some(default)) => Ok(default),
            (None, None) => Err(self.error(key, format!("missing; write one of {}", accepted()))),
            (Some(item), _) => {
                // A name that consists of digits, such as a standard's year, may stand without quotes.
                let is = |name: &str| {
                    item.as_str() == Some(name) || item.as_integer().is_some_and(|year| year.to_string() == name)
                };
                let chosen = options.iter().find(|(name, _)| is(name)).map(|(_, option)| *option);
                chosen.ok_or_else(|| self.error(key, format!("{} is none of {}", shown(item), accepted())))
            }
        }
    }

    pub fn quantity(
        &self,
        key: &str,
        dimension: &Dimension,
        sense: Sense,
        default: Option<f64>,
    ) -> Result<f64, SceneError> {
        let value = match (self.get(key), default) {
            (None, Some(default)) => default,
            (None, None) => {
                return Err(self.error(key, format!("missing; write {} as {}", dimension.name, dimension.accepted())));
            }
            (Some(item), _) => self.quantity_of(key, item, dimension, sense)?,
        };
        Ok(self.noted(key, value, dimension.si_unit(), |value| ParameterValue::Number(*value)))
    }

    pub fn quantity_of(&self, key: &str, item: &Item, dimension: &Dimension, sense: Sense) -> Result<f64, SceneError> {
        let value = match item {
            Item::Value(Value::Integer(number)) => Some(*number.value() as f64),
            Item::Value(Value::Float(number)) => Some(*number.value()).filter(|number| number.is_finite()),
            Item::Value(Value::String(text)) => dimension.parse(text.value()),
            _ => None,
        };
        let value = value.ok_or_else(|| {
            self.error(key, format!("{} is not {}: write {}", shown(item), dimension.name, dimension.accepted()))
        })?;
        match sense.refuses(dimension, value, &shown(item)) {
            None => Ok(value),
            Some(reason) => Err(self.error(key, reason)),
        }
    }

    pub fn integer(&self, key: &str, least: u64, most: u64, default: Option<u64>) -> Result<u64, SceneError> {
        self.whole(key, least, most, default, "")
    }

    fn whole(
        &self,
        key: &str,
        least: u64,
        most: u64,
        default: Option<u64>,
        unit: &'static str,
    ) -> Result<u64, SceneError> {
        let accepted = format!("a whole number from {least} to {most}");
        let number = match (self.get(key), default) {
            (None, Some(default)) => Ok(default),
            (None, None) => Err(self.error(key, format!("missing; write {accepted}"))),
            (Some(item), _) => item
                .as_integer()
                .and_then(|number| u64::try_from(number).ok())
                .filter(|number| (least..=most).contains(number))
                .ok_or_else(|| self.error(key, format!("{} is not {accepted}", shown(item)))),
        }?;
        Ok(self.noted(key, number, unit, |number| ParameterValue::Integer(*number)))
    }

    /// Reads a width of 2 bits or more: a one-bit port is no vector.
    pub fn bits(&self, key: &str, most: u32, default: u32) -> Result<u32, SceneError> {
        self.bits_within(key, 2..=most, default)
    }

    pub fn bits_within(&self, key: &str, range: RangeInclusive<u32>, default: u32) -> Result<u32, SceneError> {
        let bits = self.whole(key, (*range.start()).into(), (*range.end()).into(), Some(default.into()), "bit")?;
        Ok(bits as u32)
    }

    pub fn flag(&self, key: &str, default: bool) -> Result<bool, SceneError> {
        let flag = match self.get(key) {
            None => default,
            Some(item) => {
                item.as_bool().ok_or_else(|| self.error(key, format!("{} is not true or false", shown(item))))?
            }
        };
        Ok(self.noted(key, flag, "", |flag| ParameterValue::Flag(*flag)))
    }

    pub fn text(&self, key: &str, what: &str) -> Result<&'a str, SceneError> {
        let text = match self.get(key) {
            None => Err(self.error(key, format!("missing; write {what}"))),
            Some(item) => item
                .as_str()
                .filter(|text| !text.trim().is_empty())
                .ok_or_else(|| self.error(key, format!("{} is not {what}", shown(item)))),
        }?;
        Ok(self.noted(key, text, "", |text| ParameterValue::Text((*text).to_string())))
    }

    /// Reads the format of a gain: unsigned, with no bit worth less than the fraction bits allow.
    pub fn gain_format(&self, key: &str, default: (i32, i32)) -> Result<Format, SceneError> {
        let format = self.gain_format_of(key, default)?;
        Ok(self.noted(key, format, "", |format| ParameterValue::Text(format.to_string())))
    }

    fn gain_format_of(&self, key: &str, default: (i32, i32)) -> Result<Format, SceneError> {
        let Some(item) = self.get(key) else {
            return Format::new(false, default.0, default.1).map_err(|error| self.error(key, error.to_string()));
        };
        let text = item.as_str().ok_or_else(|| {
            self.error(key, format!("{} is not a format; write \"(S,I,F)\", as in \"(0,12,0)\"", shown(item)))
        })?;
        let format: Format = text.parse().map_err(|error: FormatError| self.error(key, error.to_string()))?;
        if format.is_signed() || format.frac() < 0 || !(2..=32).contains(&format.width()) {
            let rule = "a gain is unsigned, has no negative fraction bits and 2 to 32 bits, as in \"(0,12,0)\"";
            return Err(self.error(key, format!("{}: {rule}", format_read(text, format))));
        }
        Ok(format)
    }
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

/// Returns a value as it was written, between backticks.
pub(super) fn shown(item: &Item) -> String {
    match item {
        Item::Value(Value::String(text)) => format!("`{}`", excerpt(text.value())),
        Item::Value(value) => format!("`{}`", excerpt(value.to_string().trim())),
        _ => "a section".to_string(),
    }
}
