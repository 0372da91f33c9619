//! Why a comparison or a proof could not be made.

use hpu_cosim::dut::Fault;
use hpu_datapath::ConfigError;

use crate::dut::DutError;

/// Why the comparison could not be made.
#[derive(Debug)]
pub enum EntityError {
    /// The request is not possible; the text says why.
    Refused(String),
    /// The design does not compile, a tool is missing, or the simulation failed.
    Simulator(Fault),
}

impl From<DutError> for EntityError {
    fn from(error: DutError) -> Self {
        Self::Simulator(error.into())
    }
}

impl From<Fault> for EntityError {
    fn from(fault: Fault) -> Self {
        Self::Simulator(fault)
    }
}

impl From<ConfigError> for EntityError {
    fn from(error: ConfigError) -> Self {
        Self::Refused(error.to_string())
    }
}

impl std::fmt::Display for EntityError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Refused(why) => f.write_str(why),
            Self::Simulator(fault) => fault.fmt(f),
        }
    }
}

impl std::error::Error for EntityError {}
