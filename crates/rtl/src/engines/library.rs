//! The shared library of `hpu-vhpi`, which GHDL calls in a closed loop.

use std::path::{Path, PathBuf};
use std::{env, fs};

use crate::engines::ghdl::GhdlError;
use crate::engines::hdl::Setup;

/// Name of the shared library.
pub(crate) const LIBRARY: &str = "libhpu_vhpi.so";

/// Puts the shared library that GHDL calls into a folder.
pub(crate) fn place_library(setup: &Setup, folder: &Path) -> Result<(), GhdlError> {
    let place = folder.join(LIBRARY);
    if setup.library.is_empty() {
        let shared = shared_library()?;
        return fs::copy(&shared, place).map(|_| ()).map_err(|error| GhdlError::Io(shared, error));
    }
    fs::write(&place, setup.library).map_err(|error| GhdlError::Io(place, error))
}

/// Finds the shared library of this build, for a program that does not carry it.
fn shared_library() -> Result<PathBuf, GhdlError> {
    let exe = env::current_exe().map_err(|error| GhdlError::Io(PathBuf::from("the executable"), error))?;
    let beside = exe.parent().unwrap_or(Path::new("."));
    let places = [beside.join("deps").join(LIBRARY), beside.join(LIBRARY)];
    places.iter().find(|place| place.exists()).cloned().ok_or_else(|| GhdlError::NoLibrary(places.to_vec()))
}
