//! What is read from the text of VHDL: units and their order, libraries, interfaces and types. GHDL alone judges VHDL;
//! these readers find what it has to be told.

mod delays;
mod flat;
mod generics;
mod interface;
mod shape;
mod text;
mod types;
mod units;

use hpu_cosim::scene::{Dut, Part};

pub(super) use delays::delays;
pub(crate) use flat::Names;
pub(super) use flat::{Around, PROBE};
pub(crate) use generics::value;
pub(crate) use interface::{Interface, Item, entities, interface, names_foreign};
pub(crate) use types::Types;

use crate::engines::error::Error;

/// Returns a design as GHDL takes it: each file behind those that it uses and in its library, and the values of
/// generics as defaults of the topmost entity.
pub(super) fn prepared(dut: &Dut) -> Result<Dut, Error> {
    let mut made = dut.clone();
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| text::plain(content)).collect();
    units::arrange(&mut made, &texts)?;
    indices_are_places(dut, &texts)?;
    if !made.generics.is_empty() {
        generics::set(&mut made)?;
    }
    Ok(made)
}

/// Refuses an index or a range of a port whose bits have other indices than their places from the right.
fn indices_are_places(dut: &Dut, texts: &[String]) -> Result<(), Error> {
    let types = Types::of(texts.iter().map(String::as_str));
    let Some(interface) = texts.iter().find_map(|text| interface::of_text(text, &dut.top)) else { return Ok(()) };
    for connected in dut.ports.iter().filter(|connected| matches!(connected.part, Part::Bits(..))) {
        let port = interface.ports.iter().find(|port| port.name.eq_ignore_ascii_case(&connected.port));
        let Some((port, range)) = port.and_then(|port| Some((port, types.range(&port.kind)?))) else { continue };
        // An index into an array is that of the design.
        if matches!(types.find(&port.kind).1, Some(types::Type::Array(..))) {
            continue;
        }
        // Of a range that is a name, nothing is known.
        if !matches!(range.split_whitespace().collect::<Vec<_>>()[..], [.., "downto", "0"]) {
            let reason = format!(
                "port `{}` is {}, and hpu takes indices of vectors that end with 0 at the right; connect the whole \
                 port, or a list of its bits from the left",
                port.name, port.kind
            );
            return Err(Error::key(connected.path(), reason));
        }
    }
    Ok(())
}
