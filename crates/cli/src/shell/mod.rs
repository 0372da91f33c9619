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
