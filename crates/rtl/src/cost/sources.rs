//! The VHDL that a block is made of.

use super::CostError;
use crate::ghdl::Library;
use crate::hdl::{Hdl, Setup};

/// The VHDL of a block and of all that it instantiates, in the order of analysis, as one text.
///
/// # Errors
///
/// When a file cannot be read.
pub fn vhdl(name: &str, hdl: &Hdl) -> Result<String, CostError> {
    sources(name, hdl)?.iter().map(|entity| Ok(hdl.text(entity)?)).collect()
}

/// It, analysed.
pub fn library(name: &str, setup: &Setup) -> Result<Library, CostError> {
    let sources = sources(name, &setup.hdl)?;
    Ok(Library::analyse(&[], setup, sources.iter().map(String::as_str), &[])?)
}

/// An entity and all that it instantiates, in the order of analysis.
fn sources(name: &str, hdl: &Hdl) -> Result<Vec<String>, CostError> {
    let mut entities = Vec::new();
    visit(name, hdl, &mut entities)?;
    Ok(entities)
}

fn visit(entity: &str, hdl: &Hdl, entities: &mut Vec<String>) -> Result<(), CostError> {
    if entities.iter().any(|known| known == entity) {
        return Ok(());
    }
    for after in hdl.text(entity)?.split("entity work.").skip(1) {
        let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        visit(&name, hdl, entities)?;
    }
    entities.push(entity.to_string());
    Ok(())
}
