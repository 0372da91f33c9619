//! The number of jobs that a command runs at the same time.

use std::num::NonZeroUsize;
use std::thread;

use crate::shell::values;

/// The option of every command that runs many simulations, or many tools.
#[derive(clap::Args)]
pub struct Jobs {
    /// Jobs at a time [default: one for each core]
    #[arg(short, long, value_name = "N", value_parser = values::jobs)]
    jobs: Option<NonZeroUsize>,
}

impl Jobs {
    /// Returns the number if it was asked for.
    pub fn given(&self) -> Option<NonZeroUsize> {
        self.jobs
    }

    /// Returns the number that was asked for, or the number of the machine's cores.
    pub fn get(&self) -> NonZeroUsize {
        self.jobs.or(thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN)
    }
}
