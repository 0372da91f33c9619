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
    let parts = dut.ports.iter().map(|connected| (&*connected.port, connected.part));
    if let Some((place, reason)) = without_place(dut, parts) {
        return Err(Error::key(dut.ports[place].path(), reason));
    }
    if !made.generics.is_empty() {
        generics::set(&mut made)?;
    }
    Ok(made)
}

/// Returns the place among some parts of ports of the first one whose indices are not the places of its bits from the
/// right, as far as the text tells, and why it is refused.
pub(crate) fn without_place<'p>(dut: &Dut, parts: impl Iterator<Item = (&'p str, Part)>) -> Option<(usize, String)> {
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| text::plain(content)).collect();
    let types = Types::of(texts.iter().map(String::as_str));
    let interface = texts.iter().find_map(|text| interface::of_text(text, &dut.top))?;
    let refused = |(place, (name, part)): (usize, (&str, Part))| {
        let port = interface.ports.iter().find(|port| port.name.eq_ignore_ascii_case(name))?;
        let range = types.range(&port.kind)?;
        // An index into an array is that of the design. Of a range that is a name, nothing is known.
        let is_place = matches!(range.split_whitespace().collect::<Vec<_>>()[..], [.., "downto", "0"])
            || matches!(types.find(&port.kind).1, Some(types::Type::Array(..)));
        let reason = format!(
            "port `{}` is {}, and hpu takes indices of vectors that end with 0 at the right; connect the whole port, \
             or a list of its bits from the left",
            port.name, port.kind
        );
        (matches!(part, Part::Bits(..)) && !is_place).then_some((place, reason))
    };
    parts.enumerate().find_map(refused)
}
