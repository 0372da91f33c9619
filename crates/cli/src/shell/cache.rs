//! The folders in the user's cache: costs, designs that were built, proofs.

use std::path::{Path, PathBuf};
use std::time::Duration;

use hpu_rtl::{Cache, CacheFolder, Error, system, temporary};

use crate::shell::exit::Failure;

/// Where costs are remembered.
#[derive(clap::Args)]
pub(crate) struct Remember {
    /// Folder where costs are remembered, by the VHDL, the widths and the tools they are of [default: hpu/cost in the
    /// user's cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

impl Remember {
    /// Opens the cache. The command ends with an error when a tool is missing, or when the folder cannot be made.
    /// `limit` is the user's time limit of a tool, if there is one.
    pub fn open(&self, limit: Option<Duration>) -> Result<Cache, Failure> {
        let users = cache_folder("cost", "costs");
        let dir = self.cache.as_deref().map_or_else(|| path(&users), Ok)?;
        Cache::open(dir, limit).map_err(|error| match error.is_io() {
            true => Failure::usage(format!("{error}; write --cache DIR")),
            false => error.into(),
        })
    }
}

/// Returns a folder of this program in the user's cache, for what is `kept` there.
pub fn cache_folder(name: &str, kept: &'static str) -> CacheFolder {
    CacheFolder::new(system::caches().map(|users| users.join("hpu").join(name)), kept)
}

/// Returns the path of a folder of the cache.
pub fn path(folder: &CacheFolder) -> Result<&Path, Failure> {
    folder.path().map_err(|error| Failure::at(&temporary::parent(), error))
}

/// Turns a tool's refusal into its reason, which is shown in place of the cost. A tool at fault or a missing file ends
/// the command.
pub(crate) fn or_reason<T>(found: Result<T, Error>) -> Result<Result<T, String>, Failure> {
    match found {
        Ok(found) => Ok(Ok(found)),
        Err(error) if error.is_refusal() => Ok(Err(error.to_string())),
        Err(error) => Err(error.into()),
    }
}
