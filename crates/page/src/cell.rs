//! The values of pages.

use hpu_cosim::number;
use hpu_cosim::scene::ParameterValue;
use serde::Serialize;
use serde_json::Value as Json;

/// A value as it goes to JSON, CSV and Parquet.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// No key in the JSON, an empty cell elsewhere: the value has no place here.
    Absent,
    /// `null` in the JSON, an empty cell elsewhere: the value is not known.
    Null,
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Integer(i128),
    /// A number. CSV and Parquet keep infinities, which JSON does not know.
    Number(f64),
    /// A text.
    Text(String),
    /// A list or an object, for the JSON.
    Json(Json),
}

impl Value {
    /// Returns a list, an object or any other value as serde writes it, for the JSON.
    ///
    /// # Panics
    ///
    /// Panics if a map of the value has keys that are no text.
    pub fn of(value: impl Serialize) -> Self {
        Self::Json(serde_json::to_value(value).expect("keys are text"))
    }

    /// Returns the value as JSON; `None` for a value without a place.
    pub fn json(&self) -> Option<Json> {
        Some(match self {
            Self::Absent => return None,
            Self::Null => Json::Null,
            Self::Flag(flag) => Json::from(*flag),
            Self::Integer(value) => serde_json::to_value(value).expect("a number"),
            Self::Number(value) => Json::from(*value),
            Self::Text(text) => Json::from(text.as_str()),
            Self::Json(value) => value.clone(),
        })
    }

    /// Returns the value as a cell of CSV, quoted where it must be.
    pub fn csv(&self) -> String {
        match self {
            Self::Absent | Self::Null => String::new(),
            Self::Flag(flag) => flag.to_string(),
            Self::Integer(value) => value.to_string(),
            Self::Number(value) => format!("{value:e}"),
            Self::Text(text) => quoted(text),
            Self::Json(value) => quoted(&value.to_string()),
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Absent => String::new(),
            Self::Null => "-".to_string(),
            Self::Flag(flag) => if *flag { "yes" } else { "no" }.to_string(),
            Self::Integer(value) => value.to_string(),
            Self::Number(value) => number(*value),
            Self::Text(text) => text.clone(),
            Self::Json(value) => value.to_string(),
        }
    }
}

/// Returns the value of a key of a scene as JSON.
pub fn as_json(value: &ParameterValue) -> Json {
    match value {
        ParameterValue::Number(value) => Json::from(*value),
        ParameterValue::Integer(value) => Json::from(*value),
        ParameterValue::Flag(flag) => Json::from(*flag),
        ParameterValue::Text(text) => Json::from(text.as_str()),
    }
}

/// Returns a field of a CSV file, quoted if needed.
pub fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_string())
    }
}

impl From<&String> for Value {
    fn from(text: &String) -> Self {
        Self::Text(text.clone())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<Json> for Value {
    fn from(value: Json) -> Self {
        Self::Json(value)
    }
}

impl<T: Serialize, const N: usize> From<[T; N]> for Value {
    fn from(list: [T; N]) -> Self {
        Self::of(&list[..])
    }
}

impl<T: Serialize> From<&[T]> for Value {
    fn from(list: &[T]) -> Self {
        Self::of(list)
    }
}

impl<T: Serialize> From<Vec<T>> for Value {
    fn from(list: Vec<T>) -> Self {
        Self::of(list)
    }
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Null, Into::into)
    }
}

macro_rules! integers {
    ($($integer:ty)*) => {$(
        impl From<$integer> for Value {
            fn from(value: $integer) -> Self {
                Self::Integer(value as i128)
            }
        }
    )*};
}

integers!(i32 i64 i128 u8 u32 u64 usize);

/// A value of a table, with its text where the text differs from the value.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The value.
    pub value: Value,
    text: Option<String>,
    pub(crate) good: Option<bool>,
}

impl Cell {
    /// Returns a cell whose text is the value's.
    pub fn new(value: impl Into<Value>) -> Self {
        Self { value: value.into(), text: None, good: None }
    }

    /// Returns a cell without a place in JSON; its text is empty.
    pub fn absent() -> Self {
        Self::new(Value::Absent)
    }

    /// Gives the cell another text, as of a number with a unit or with fewer digits.
    #[must_use]
    pub fn shown(self, text: impl Into<String>) -> Self {
        Self { text: Some(text.into()), ..self }
    }

    /// Marks the cell as good or bad; a terminal shows it in green or red.
    #[must_use]
    pub fn good(self, good: bool) -> Self {
        Self { good: Some(good), ..self }
    }

    /// Returns the text.
    pub fn text(&self) -> String {
        self.text.clone().unwrap_or_else(|| self.value.text())
    }
}

impl<T: Into<Value>> From<T> for Cell {
    fn from(value: T) -> Self {
        Self::new(value)
    }
}
