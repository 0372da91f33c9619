//! Reads netlists from the JSON that Yosys writes.
//!
//! Yosys lists the bits of each port of each cell. Here bits become words again: runs of bits of one word are slices of
//! it, and words are joined by concatenations. After the commands [`FLAT`] and [`LOWERED`] only words, registers and
//! combinational cells are left. What a [`Netlist`] cannot represent is refused by its name.

mod cells;
mod module;
mod words;

use std::fmt;

use crate::netlist::Netlist;

/// Memories of more words than this are refused: each of their words would become a register. Tables become a tree of
/// choices.
pub(crate) const MOST_MEMORY_WORDS: u32 = 64;
/// The most cells of a netlist.
const MOST_CELLS: usize = 1 << 16;

/// The commands of Yosys that make a design one module, between `hierarchy -top` and [`LOWERED`]. They simplify
/// nothing.
pub const FLAT: &str = "proc -noopt; flatten";
/// Commands between them that set values `x` to 0. Without them these stay as they are, so that they are seen. The
/// enable of a read without a clock is such a value until memories are collected.
pub const ZEROS: &str = "opt_expr -keepdc; opt_clean; memory_collect; setundef -zero";
/// The commands that leave words, combinational cells and registers without enables, before `write_json`. They use no
/// value `x` to make the logic simpler. Memories of more than 64 words stay, and tables of more than 4096, which
/// nothing writes.
pub const LOWERED: &str = "opt_expr -keepdc; opt_clean; memory_collect; memory_map -rom-only r:SIZE<=4096; \
                           memory_map r:SIZE<=64; opt_expr -keepdc; opt_merge; opt_dff -keepdc -nodffe -nosdff; \
                           wreduce -keepdc; opt_expr -keepdc -mux_bool; opt_merge; opt_clean; dffunmap; \
                           opt_expr -keepdc; opt_merge; opt_clean";

/// The reason why a design is no [`Netlist`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Unfit(pub(crate) String);

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unfit {}

/// Returns the place of a shift that Yosys 0.23 may turn to the other side when it simplifies, from the JSON that it
/// writes of the module `top` after [`FLAT`]; `None` if there is none. Yosys takes a constant amount for a signed
/// number of 32 bits, so an amount of fewer bits, or a constant that is no great one, is safe.
///
/// # Errors
///
/// [`Unfit`] if the text is no such JSON.
pub fn turned_shift(json: &str, top: &str) -> Result<Option<String>, Unfit> {
    module::turned_shift(json, top)
}

/// Reads the module `top` from the JSON that Yosys writes after [`LOWERED`]. Each register must have one of the
/// `clocks`, which are inputs: each is given with the edges of the netlist's clock for one of its own, and all rise at
/// the first edge. Names are compared without regard to case if `ignores_case` is set. Words inside that `shows` takes
/// by their names and their widths are outputs too, behind the ports; those of which a part was left out as unused are
/// none.
///
/// # Errors
///
/// [`Unfit`] if the text is no such JSON, or with the name of what a netlist cannot represent: a latch, a combinational
/// loop, another clock or its falling edge, a word of more than 64 bits in arithmetic, an unknown value, a port
/// `inout`, a large memory.
pub fn read(
    json: &str,
    top: &str,
    (clocks, ignores_case): (&[(&str, u32)], bool),
    shows: impl Fn(&str, usize) -> bool,
) -> Result<Netlist, Unfit> {
    let mut module = module::Module::read(json, top, (clocks, ignores_case))?;
    module.inside.retain(|(name, bits)| bits.len() <= words::MOST && shows(name, bits.len()));
    words::Reader::new(&module).netlist()
}
