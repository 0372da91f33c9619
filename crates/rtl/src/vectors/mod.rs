//! Golden vectors: stimuli, files, packages, testbenches, reports.

pub(crate) mod around;
pub(crate) mod around_law;
pub(crate) mod coverage;
pub(crate) mod generated;
pub(crate) mod junit;
pub(crate) mod late;
pub(crate) mod package;
pub(crate) mod reader;
pub(crate) mod report;
pub(crate) mod scene;
pub(crate) mod side;
pub mod stimuli;
pub(crate) mod testbench;
pub(crate) mod vector;
