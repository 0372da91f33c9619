//! `hpu._hpu`: the Python package `hpu` around the libraries.
//!
//! `python/hpu` has the sources in Python, and the stubs `_hpu.pyi`, which are the documentation. No panic passes the
//! boundary: work runs on threads of its own, and calls with a handle catch it.

mod arrow;
mod block;
mod command;
mod emulated;
mod errors;
mod handle;
mod json;
mod plant;
mod result;
mod scene;
mod signal;
mod study;
mod trace;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _hpu {
    #[pymodule_export]
    use crate::block::{Block, blocks};
    #[pymodule_export]
    use crate::command::_command;
    #[pymodule_export]
    use crate::emulated::Loop;
    #[pymodule_export]
    use crate::plant::Plant;
    #[pymodule_export]
    use crate::result::{Result, run};
    #[pymodule_export]
    use crate::scene::{Scene, keys, scenes};
    #[pymodule_export]
    use crate::signal::Signal;
    #[pymodule_export]
    use crate::study::{Study, fit, identify, limits, map, widths};
    #[pymodule_export]
    use crate::trace::{Column, Trace};
}
