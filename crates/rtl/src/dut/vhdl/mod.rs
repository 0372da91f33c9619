//! What is read from the text of VHDL: units and their order, libraries, interfaces and types. GHDL alone judges VHDL;
//! these readers find what it has to be told.

mod delays;
mod flat;
mod generics;
mod interface;
mod operands;
mod shape;
mod text;
mod types;
mod units;

use hpu_cosim::scene::Dut;

pub(super) use delays::delays;
pub(crate) use flat::Names;
pub(super) use flat::{Around, PROBE};
pub(crate) use generics::value;
pub(crate) use interface::{Interface, Item, entities, interface, names_foreign};
pub(super) use operands::with_operands;
pub(crate) use types::Types;

use crate::engines::error::Error;

/// Returns a design as GHDL takes it: each file behind those that it uses and in its library, and the values of
/// generics as defaults of the topmost entity.
pub(super) fn prepared(dut: &Dut) -> Result<Dut, Error> {
    let mut made = dut.clone();
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| text::plain(content)).collect();
    units::arrange(&mut made, &texts)?;
    if !made.generics.is_empty() {
        generics::set(&mut made)?;
    }
    Ok(made)
}
