//! The reasons for refusing a search.

use std::fmt;

/// Why a search was refused.
#[derive(Clone, PartialEq, Debug)]
pub enum SearchError {
    /// No knob was given.
    NothingToVary,
    /// This width is varied twice.
    Twice(&'static str),
    /// The scene's device does not have a width that is varied.
    OfAnother(String),
    /// There are too many designs: so many, and at most so many are searched.
    TooMany(u128, u128),
    /// The scene has nothing to search.
    Scene(String),
    /// No scene can have any of the designs: their number, and the reasons with their numbers.
    AllRefused(usize, Vec<(String, usize)>),
    /// The reference cannot be run, or has no stable stiffness.
    Reference(String),
}

impl fmt::Display for SearchError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NothingToVary => write!(f, "nothing to vary"),
            Self::Twice(key) => write!(f, "{key} is varied twice"),
            Self::TooMany(designs, most) => write!(f, "{designs} designs; at most {most} are searched: narrow a range"),
            Self::OfAnother(why) | Self::Scene(why) | Self::Reference(why) => write!(f, "{why}"),
            Self::AllRefused(designs, reasons) => {
                write!(f, "no scene has any of the {designs} designs")?;
                let mut shown = reasons.iter().take(3);
                shown.try_for_each(|(why, count)| write!(f, "\n{count} of them: {why}"))
            }
        }
    }
}

impl std::error::Error for SearchError {}
