//! The shared library of `hpu-vhpi`, which GHDL calls in a closed loop.

use std::fs;
use std::path::Path;

use crate::engines::error::Error;

/// Name of the file.
pub(crate) const LIBRARY: &str = "libhpu_vhpi.so";

/// Writes the shared library into a folder.
pub(crate) fn place_library(folder: &Path) -> Result<(), Error> {
    let place = folder.join(LIBRARY);
    fs::write(&place, hpu_vhpi::LIBRARY).map_err(|error| Error::io(place, error))
}
