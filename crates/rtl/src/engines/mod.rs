//! Tools and their files: processes, temporary files, caches, GHDL.

pub(crate) mod cache_folder;
pub(crate) mod entry;
pub(crate) mod error;
pub(crate) mod fault;
pub(crate) mod ghdl;
pub(crate) mod group;
pub(crate) mod hdl;
pub(crate) mod library;
pub(crate) mod note;
pub(crate) mod owned;
pub(crate) mod sealed;
pub(crate) mod sources;
pub mod temporary;
pub(crate) mod tool;
