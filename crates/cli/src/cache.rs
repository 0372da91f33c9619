//! The folders in the user's cache: costs, designs that were built, proofs.

use std::path::PathBuf;
use std::time::Duration;

use hpu_rtl::{Cache, CostError, GhdlError};

use crate::exit::Failure;

/// Where costs are remembered.
#[derive(clap::Args)]
pub struct Remember {
    /// Folder where costs are remembered, by the VHDL, the widths and the tools they are of [default: hpu/cost in the
    /// user's cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

impl Remember {
    /// Opens the cache. The command ends with an error when a tool is missing, or when the folder cannot be made.
    /// `limit` is the user's time limit of a tool, if there is one.
    pub fn open(&self, limit: Option<Duration>) -> Result<Cache, Failure> {
        let dir = self.cache.clone().or_else(|| cache_folder("cost"));
        let dir = dir.ok_or_else(|| Failure::usage("no HOME to remember costs in; write --cache DIR"))?;
        Cache::open(&dir, limit).map_err(|error| match error {
            CostError::Ghdl(GhdlError::Io(..)) => Failure::usage(format!("{error}; write --cache DIR")),
            _ => error.into(),
        })
    }
}

/// Returns a folder of this program in the user's cache, if the user has one.
pub fn cache_folder(name: &str) -> Option<PathBuf> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let users = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")));
    Some(users?.join("hpu").join(name))
}

/// Turns a tool's refusal into its reason, which is shown in place of the cost. A tool at fault or a missing file ends
/// the command.
pub fn or_reason<T>(found: Result<T, CostError>) -> Result<Result<T, String>, Failure> {
    match found {
        Ok(found) => Ok(Ok(found)),
        Err(error @ (CostError::Failed { .. } | CostError::Ghdl(GhdlError::Failed { .. }))) => {
            Ok(Err(error.to_string()))
        }
        Err(error) => Err(error.into()),
    }
}
