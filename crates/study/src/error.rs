//! The error of studies.

use std::fmt;
use std::sync::Arc;

use hpu_cosim::SimulationError;
use hpu_cosim::dut::Fault;
use hpu_cosim::scene::SceneError;
use hpu_datapath::ConfigError;
use hpu_farm::Failed;

/// What a study failed for; it decides the exit code of a verb that has no other result.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// The scene cannot be studied so.
    Scene,
    /// The command asks for what this scene does not have: a contestant, a width of another device.
    Usage,
    /// The scene was run, and its run gives no verdict on the wall.
    Unjudged,
    /// The run had too many events.
    Events,
    /// The scene's own design was not built or ended its simulation, or a tool for it is missing or failed.
    Design,
    /// The study was stopped.
    Stopped,
}

/// Why a study has no result. It is opaque: a reason, which says what to write instead where that is known, behind the
/// place that it is about.
#[derive(Clone, Debug)]
pub struct Error {
    kind: Kind,
    why: Box<str>,
    fault: Option<Arc<Fault>>,
}

impl Error {
    /// Returns why a scene cannot be studied.
    pub fn new(why: impl fmt::Display) -> Self {
        Self::of(Kind::Scene, why)
    }

    /// Returns an error of a kind.
    pub fn of(kind: Kind, why: impl fmt::Display) -> Self {
        Self { kind, why: why.to_string().into(), fault: None }
    }

    /// Returns the failure of a design.
    pub fn design(fault: Fault) -> Self {
        let error = Self::of(Kind::Design, &fault);
        Self { fault: Some(Arc::new(fault)), ..error }
    }

    /// Puts a place before the reason.
    #[must_use]
    pub fn at(self, place: impl fmt::Display) -> Self {
        let why = format!("{place}: {self}").into();
        Self { why, ..self }
    }

    /// Returns the kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns the failure of the scene's own design, if that is the reason.
    pub fn into_fault(self) -> Option<Fault> {
        self.fault.and_then(Arc::into_inner)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.why)
    }
}

impl std::error::Error for Error {}

impl PartialEq for Error {
    fn eq(&self, other: &Self) -> bool {
        (self.kind, &self.why) == (other.kind, &other.why)
    }
}

macro_rules! from {
    ($($Other:ty),*) => {
        $(impl From<$Other> for Error {
            fn from(why: $Other) -> Self {
                Self::new(why)
            }
        })*
    };
}

from!(String, &str, SceneError, SimulationError, ConfigError, hpu_signal::FormatError, hpu_prove::Error, Failed);
