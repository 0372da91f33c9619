//! Rows of units: results of any type, as JSON.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

/// The result of a unit: its row, or why there is none. Rows of every study are [`Row`]s.
pub type UnitResult<T = Row> = Result<T, Failed>;

/// Returns a row without its type.
pub fn untyped<T: Serialize>(row: &UnitResult<T>) -> UnitResult {
    row.as_ref().map(Row::of).map_err(Failed::clone)
}

/// Returns rows with the type of a study; a row of another study becomes a failure.
pub fn typed<T: DeserializeOwned>(rows: BTreeMap<usize, UnitResult>) -> BTreeMap<usize, UnitResult<T>> {
    rows.into_iter().map(|(index, row)| (index, row.and_then(|row| row.read()))).collect()
}

/// A row whose type only the unit's study knows: JSON on one line, as journals have it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Row(Box<RawValue>);

impl Row {
    /// Writes a result.
    ///
    /// # Panics
    ///
    /// Panics if the type has maps whose keys are no texts.
    pub fn of<T: Serialize>(result: &T) -> Self {
        Self(serde_json::value::to_raw_value(result).expect("a row is JSON"))
    }

    /// Reads the result.
    ///
    /// # Errors
    ///
    /// Fails for the row of another study.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, Failed> {
        serde_json::from_str(self.0.get()).map_err(|error| Failed::new(format!("`{self}` is no such row: {error}")))
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.0.get())
    }
}

/// Rows are equal if their values are, in whatever order their keys are written.
impl PartialEq for Row {
    fn eq(&self, other: &Self) -> bool {
        self.read::<serde_json::Value>() == other.read()
    }
}

/// Why a unit has no row: one line.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Failed(String);

impl Failed {
    /// Returns a failure for this reason; its lines become one.
    pub fn new(why: impl fmt::Display) -> Self {
        Self(one_line(why.to_string()))
    }

    /// Returns the reason.
    pub fn why(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failed {}

/// Returns a text whose lines are one.
pub fn one_line(text: String) -> String {
    if text.contains(['\n', '\r']) { text.split_whitespace().collect::<Vec<_>>().join(" ") } else { text }
}

/// How fields of rows are written: numbers that JSON does not know, and flags as the files of sweeps have them.
pub mod form {
    /// Writes numbers that are not finite as texts.
    pub mod number {
        use serde::{Deserialize, Deserializer, Serializer};

        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Number(f64),
            Text(String),
        }

        /// Writes a number.
        pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
            if value.is_finite() { to.serialize_f64(*value) } else { to.collect_str(value) }
        }

        /// Reads a number.
        pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
            match Written::deserialize(from)? {
                Written::Number(value) => Ok(value),
                Written::Text(text) => text.parse().map_err(serde::de::Error::custom),
            }
        }
    }

    /// Writes numbers that may be missing as [`number`] does.
    pub mod figure {
        use serde::{Deserialize, Deserializer, Serialize, Serializer};

        #[derive(Serialize, Deserialize)]
        struct Number(#[serde(with = "super::number")] f64);

        /// Writes a number, or nothing.
        pub fn serialize<S: Serializer>(value: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
            value.map(Number).serialize(to)
        }

        /// Reads a number, or nothing.
        pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
            Ok(Option::<Number>::deserialize(from)?.map(|number| number.0))
        }
    }

    /// Writes a value as text.
    pub mod text {
        use std::fmt::Display;
        use std::str::FromStr;

        use serde::{Deserialize, Deserializer, Serializer};

        /// Writes a value.
        pub fn serialize<S: Serializer>(value: &impl Display, to: S) -> Result<S::Ok, S::Error> {
            to.collect_str(value)
        }

        /// Reads a value.
        pub fn deserialize<'de, D: Deserializer<'de>, T: FromStr<Err: Display>>(from: D) -> Result<T, D::Error> {
            String::deserialize(from)?.parse().map_err(serde::de::Error::custom)
        }
    }

    /// Writes a flag as 1 or 0.
    pub mod digit {
        use serde::{Deserialize, Deserializer, Serializer};

        /// Writes a flag.
        pub fn serialize<S: Serializer>(flag: &bool, to: S) -> Result<S::Ok, S::Error> {
            to.serialize_u8((*flag).into())
        }

        /// Reads a flag.
        pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<bool, D::Error> {
            Ok(u8::deserialize(from)? == 1)
        }
    }
}
