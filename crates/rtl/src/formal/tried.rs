//! Proves blocks that remember only their outputs: GHDL tries all their inputs.
//!
//! Solvers do not get through long tables and rotations; if the inputs are few, all can be tried. The netlist shows
//! that the next outputs are a function of the inputs alone: no path in it leads from a register to a register. The
//! reset is left to a solver, as for any block. Both questions hold for any words of the tables.

use std::collections::HashMap;
use std::time::Duration;

use hpu_datapath::ClockEdge;
use hpu_signal::{Format, Signal, Term};

use super::netlist::Netlist;
use super::query::{Edge, Question};
use super::{Proof, Verdict};
use crate::check::{benches, held};
use crate::engines::error::Error;
use crate::engines::hdl::Setup;
use crate::vectors::vector::{Header, Vectors};

/// The most bits of inputs that are tried.
const MOST_BITS: u32 = 18;

/// Returns whether all inputs of a block can be tried, and whether that suffices: the next words of its registers must
/// depend on the inputs alone.
pub(super) fn can_be(equations: &ClockEdge) -> bool {
    let registers = &equations.registers;
    let bits: u32 = equations.block.inputs().iter().map(|input| input.format.width()).sum();
    if registers.is_empty() || bits > MOST_BITS {
        return false;
    }
    let inputs = equations.block.inputs();
    let named = |role: &str, index: usize, format: Format| Term::of_bits(format, &format!("|{role} {index}|"));
    let next = |role: &str| {
        let before = registers.iter().enumerate().map(|(index, register)| named(role, index, register.format));
        let inputs = inputs.iter().enumerate().map(|(index, input)| named("input", index, input.format));
        let (next, _) = equations.in_terms(&before.collect::<Vec<_>>(), &inputs.collect::<Vec<_>>());
        next.into_iter().zip(registers).map(|(next, register)| next.bits(register.format.width())).collect::<Vec<_>>()
    };
    // Equal terms share one definition. So if the terms are equal for other registers, the words after the edge do not
    // depend on the registers.
    Term::defined(HashMap::new(), || next("one") == next("other")).built
}

/// Proves a block whose inputs [can be](can_be) tried.
pub(super) fn tried(equations: &ClockEdge, setup: &Setup, limit: Duration) -> Result<Verdict, Error> {
    let (netlist, remembers) = match Netlist::without_tables(equations.block, setup)? {
        Ok(found) => found,
        Err(why) => return Ok(Verdict::Refused(why)),
    };
    if !remembers.is_empty() {
        return Ok(Verdict::Open(format!("its registers are made of registers: {}", remembers.join(", "))));
    }
    if !netlist.is_clocked {
        return Ok(Verdict::Open("nothing in its VHDL is clocked".to_string()));
    }
    let mut by = Vec::new();
    let edge = Edge::new(equations, &netlist);
    if let Some(other) = super::decided(&edge, Question::Reset, limit, &mut by)? {
        return Ok(other);
    }
    let library = benches([equations.block.name()], setup).map_err(Error::of_input)?;
    let tally = held(&library, &all(equations), "all").map_err(Error::of_input)?;
    Ok(match tally.first {
        Some(mut first) => {
            first.around.rows.retain(|row| row.number == first.row);
            first.around.rows.iter_mut().for_each(|row| row.number = 1);
            Verdict::Refuted("an edge".to_string(), first.around)
        }
        None => {
            by.push("ghdl");
            Verdict::Proved(Proof::new(by))
        }
    })
}

/// Computes the block's equations for all its inputs.
fn all(equations: &ClockEdge) -> Vectors {
    let inputs = equations.block.inputs();
    let widths: Vec<_> = inputs.iter().map(|input| input.format.width()).collect();
    let bits: u32 = widths.iter().sum();
    let before: Vec<_> = equations.registers.iter().map(|register| register.reset.unwrap_or(0)).collect();
    let mut step = equations.in_words();
    let row = |number: u64| {
        let mut rest = number;
        let mut word = |&Signal { format, .. }: &Signal| {
            let bits = rest & ((1 << format.width()) - 1);
            rest >>= format.width();
            format.from_bits(bits)
        };
        let words: Vec<_> = inputs.iter().map(&mut word).collect();
        let (next, _) = step(&before, &words);
        let (_, shown) = step(&next, &words);
        [0].into_iter().chain(words).chain(shown).collect()
    };
    Vectors { header: Header::of(equations.block), rows: (0..1 << bits).map(row).collect() }
}
