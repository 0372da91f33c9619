//! Reads netlists from the JSON that Yosys writes.
//!
//! Yosys lists the bits of each port of each cell. Here bits become words again: runs of bits of one word are slices of
//! it, and words are joined by concatenations. [`script`] returns the commands after which only words, registers with
//! one clock and combinational cells are left. What a [`Netlist`] cannot represent is refused by its name.

mod cells;
mod module;
mod words;

use std::fmt;

use crate::netlist::Netlist;

/// Memories of more words than this are refused: each of their words would become a register.
pub const MOST_MEMORY_WORDS: u32 = 64;
/// The most cells of a netlist.
const MOST_CELLS: usize = 1 << 16;

/// Returns the commands of Yosys behind those that read a design: they make it a netlist of words with the topmost
/// module `top`, and write it to the file `json`. Values `x` stay as they are, so that they are seen, unless `zeros`
/// sets them to 0.
pub fn script(top: &str, json: &str, zeros: bool) -> String {
    let unknown = if zeros { "setundef -zero; " } else { "" };
    format!(
        "hierarchy -top {top}; proc; flatten; {unknown}opt_expr -keepdc; opt_clean; memory_dff; memory_collect; \
         memory_map r:SIZE<={MOST_MEMORY_WORDS}; opt_expr -keepdc; opt_merge; opt_dff -keepdc -nodffe -nosdff; \
         opt_expr -keepdc -mux_bool; opt_merge; opt_clean; dffunmap; opt_expr -keepdc; opt_merge; \
         opt_clean -purge; write_json {json}"
    )
}

/// The reason why a design is no [`Netlist`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Unfit(pub(crate) String);

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unfit {}

/// Reads the module `top` from JSON that [`script`] has made. All registers must have the clock `clock`, an input.
/// Names are compared without regard to case if `ignores_case` is set.
///
/// # Errors
///
/// [`Unfit`] if the text is no such JSON, or with the name of what a netlist cannot represent: a latch, a combinational
/// loop, another clock or its falling edge, a word of more than 64 bits that takes part in arithmetic, an unknown value,
/// a port `inout`, a large memory.
pub fn read(json: &str, top: &str, (clock, ignores_case): (&str, bool)) -> Result<Netlist, Unfit> {
    let module = module::Module::read(json, top, (clock, ignores_case))?;
    words::Reader::new(&module).netlist()
}
