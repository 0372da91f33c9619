//! Text in and out: files, messages, names.

pub(crate) mod files;
pub(crate) mod message;
pub(crate) mod plain_name;
