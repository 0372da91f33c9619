//! The VHDL that a block is made of.

use std::fs;
use std::path::{Path, PathBuf};

use super::tool::CostError;
use crate::ghdl::{GhdlError, Library};

/// The VHDL of a block and of all that it instantiates, in the order of analysis, as one text.
///
/// # Errors
///
/// When a file cannot be read.
pub fn vhdl(name: &str, hdl: &Path) -> Result<String, CostError> {
    sources(name, hdl)?.iter().map(|file| read(file)).collect()
}

/// It, analysed.
pub fn library(name: &str, hdl: &Path) -> Result<Library, CostError> {
    Ok(Library::analyse(&[], &sources(name, hdl)?, &[])?)
}

/// The files of an entity and of all that it instantiates, in the order of analysis.
fn sources(name: &str, hdl: &Path) -> Result<Vec<PathBuf>, CostError> {
    let mut files = Vec::new();
    visit(&hdl.join(format!("{name}.vhd")), hdl, &mut files)?;
    Ok(files)
}

fn visit(file: &Path, hdl: &Path, files: &mut Vec<PathBuf>) -> Result<(), CostError> {
    if files.iter().any(|known| known == file) {
        return Ok(());
    }
    for after in read(file)?.split("entity work.").skip(1) {
        let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        visit(&hdl.join(format!("{name}.vhd")), hdl, files)?;
    }
    files.push(file.to_path_buf());
    Ok(())
}

fn read(file: &Path) -> Result<String, CostError> {
    Ok(fs::read_to_string(file).map_err(|error| GhdlError::Io(file.to_path_buf(), error))?)
}
