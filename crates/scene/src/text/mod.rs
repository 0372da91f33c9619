//! Text in messages, and names of files.

pub(crate) mod kept;
pub(crate) mod message;
pub(crate) mod plain_name;
