//! The parts of every block: its trait, configurations, wirings, and logic that blocks share.

pub(crate) mod block;
pub(crate) mod computation;
pub(crate) mod config;
pub(crate) mod countdown;
pub(crate) mod history;
pub(crate) mod law;
pub(crate) mod listed;
pub(crate) mod sequence;
pub(crate) mod wiring;
pub(crate) mod words;
