//! The surroundings of a command: its arguments, files, terminal, signals and exit code.

pub(crate) mod cache;
pub(crate) mod exit;
pub(crate) mod files;
pub(crate) mod hdl;
pub(crate) mod input;
pub(crate) mod interrupt;
pub(crate) mod jobs;
pub(crate) mod manual;
pub(crate) mod modes;
pub(crate) mod program;
pub(crate) mod progress;
pub(crate) mod sha256;
pub(crate) mod terminal;
pub(crate) mod values;

pub(crate) use cache::{Remember, cache_folder, or_reason};
pub(crate) use exit::{Exit, Failure};
pub(crate) use files::{Folder, Single};
pub(crate) use input::{read_stdin, read_text};
pub(crate) use jobs::Jobs;
pub(crate) use progress::{Watch, with_progress};
pub(crate) use terminal::{print, print_file, print_json, tell, verdict};
