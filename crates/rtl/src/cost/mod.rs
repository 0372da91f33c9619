//! The cost of a block in an FPGA: its VHDL goes through GHDL, Yosys and nextpnr.
//!
//! The FPGA is a Lattice iCE40 HX8K. The flow is fixed, so that the same command gives the same numbers: `ghdl --synth
//! --out=verilog`, then `synth_ice40 -abc9 -device hx` (flattened; abc9 knows the HX's delays, plain abc does not),
//! then `nextpnr-ice40 --hx8k --package ct256` with seeds 1, 2 and 3, whose median counts. nextpnr is given no target
//! frequency, because placement does not depend on it. A block that is too large is counted for the ECP5 (`synth_ecp5
//! -abc9`) as well, and not timed.
//!
//! Counts are of the block alone. For its timing the same netlist stands between registers in a [bench](bench::bench).
//! The cells of the bench are never counted, and its own paths are in another clock domain.
//!
//! A [`Cache`] keeps each result under the SHA-256 of everything that it depends on.

mod bench;
mod cache;
mod content;
mod keywords;
mod said;
pub(crate) mod verilog;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::process::Command;
use std::time::Duration;

use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Script, Yosys};
use hpu_datapath::AnyBlock;
use serde::Serialize;

use crate::engines::error::Error;
use crate::engines::ghdl::Library;
use crate::engines::hdl::Setup;
use crate::engines::sources::library;
use crate::engines::tool::{self, Fault, Tool, ToolError};
pub(crate) use said::{cell_counts, is_full, used_cells};
use said::{fmax, sum};

pub use cache::Cache;

/// Logic cells of the HX8K.
pub const HX8K_CELLS: u64 = 7680;
/// Block RAMs of the HX8K, 4096 bits each.
pub const HX8K_BRAM: u64 = 32;

/// Seeds of the placements. The median of the three results counts.
pub const SEEDS: [u32; 3] = [1, 2, 3];

/// Primitives of a netlist.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Counts {
    /// Lookup tables of four inputs.
    pub lut4: u64,
    /// Flip-flops.
    pub ff: u64,
    /// Carry cells: one bit each in the iCE40, two bits in the ECP5.
    pub carry: u64,
    /// Block RAMs: 4096 bits each in the iCE40, 18432 in the ECP5.
    pub bram: u64,
    /// Multipliers of 18 x 18 bits; the HX8K has none.
    pub dsp: u64,
}

/// The result of one placement.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub enum Placed {
    /// nextpnr found no room for the block and the registers around it.
    NoRoom,
    /// No path leads through the block.
    NoPath,
    /// The highest clock frequency, in megahertz.
    Mhz(f64),
}

/// The cost of a block.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cost {
    /// Primitives of the iCE40.
    pub ice40: Counts,
    /// Logic cells of the HX8K as nextpnr packs them: each is a lookup table, a carry and a flip-flop. The block's one
    /// or two sources of constants are included.
    pub cells: u64,
    /// Primitives of the ECP5 when the HX8K is too small.
    pub ecp5: Option<Counts>,
    /// The results of the placements with [`SEEDS`]; `None` for a block that is too large.
    pub placed: Option<[Placed; SEEDS.len()]>,
}

impl Cost {
    /// Returns whether the block fits into the HX8K.
    pub fn fits(&self) -> bool {
        self.ecp5.is_none()
    }

    /// Returns the highest clock frequency in the HX8K in megahertz, with registers before the inputs and behind the
    /// outputs: the median of the placements. Returns `None` when the block does not fit, when no path leads through
    /// it, or when it leaves no place for those registers.
    pub fn fmax_mhz(&self) -> Option<f64> {
        let mut placed = self.placed?;
        // A placement that finds no room counts as slower than any other.
        placed.sort_by(|a, b| a.partial_cmp(b).expect("a frequency is a number"));
        match placed[SEEDS.len() / 2] {
            Placed::Mhz(mhz) => Some(mhz),
            Placed::NoPath | Placed::NoRoom => None,
        }
    }

    /// Returns the longest path from register to register in nanoseconds: clock to output, logic and wires, setup.
    pub fn path_ns(&self) -> Option<f64> {
        self.fmax_mhz().map(|fmax_mhz| 1000.0 / fmax_mhz)
    }
}

/// The option by which Yosys calls no function of a library (DPI-C) while it reads Verilog.
pub(crate) const NO_DPI: Fixed = Fixed(" -nodpi");

/// Returns Yosys's script for the iCE40: it counts the block, then puts its netlist on the bench.
fn ice40_script(name: &'static str, reading: Fixed) -> Script<Yosys> {
    script!(
        Yosys: "read_verilog{} block.v; synth_ice40 -abc9 -device hx -top {} -json block.json; tee -q -o ice40.txt \
                stat; read_verilog bench.v; hierarchy -check -top hpu_bench; flatten; clean; write_json bench.json",
        reading,
        Fixed(name)
    )
}

/// Returns Yosys's script for the ECP5: it counts the block.
fn ecp5_script(name: &'static str, reading: Fixed) -> Script<Yosys> {
    let name = Fixed(name);
    script!(Yosys: "read_verilog{} block.v; synth_ecp5 -abc9 -top {}; tee -q -o ecp5.txt stat", reading, name)
}

/// nextpnr's arguments for the device.
pub(crate) const DEVICE: [&str; 3] = ["--hx8k", "--package", "ct256"];

/// Synthesises a block from its VHDL in a directory, with the generics of its configuration, then places and times it.
///
/// # Errors
///
/// [`Error`] when a tool is missing, refuses its input, or does not end.
pub fn cost(block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Cost, Error> {
    let (name, (library, ice40)) = (block.name(), synthesised(block, &setup.into())?);
    let pack = [&DEVICE[..], &["--pack-only", "--json", "block.json"]].concat();
    let said = run(&library, Tool::Nextpnr, name, pack)?;
    let step = format!("pack {name}");
    let silent = || ToolError::new(Tool::Nextpnr, &step, Fault::Silent("number of cells"), &said);
    let cells = used_cells(&said).ok_or_else(silent)?;
    if cells > HX8K_CELLS || ice40.bram > HX8K_BRAM {
        return Ok(Cost { ice40, cells, ecp5: Some(ecp5(&library, name)?), placed: None });
    }
    let mut placed = [Placed::NoRoom; SEEDS.len()];
    for (found, seed) in placed.iter_mut().zip(SEEDS) {
        *found = timing(&library, name, seed)?;
    }
    Ok(Cost { ice40, cells, ecp5: None, placed: Some(placed) })
}

/// Counts the primitives of a block in the iCE40 by Yosys alone, which is much faster than the whole [`cost`].
///
/// # Errors
///
/// The errors of [`cost`].
pub fn counts(block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Counts, Error> {
    synthesised(block, &setup.into()).map(|(_, ice40)| ice40)
}

/// Makes the block's netlist, alone and on its bench. Returns the folder with both, and the block's primitives.
fn synthesised(block: &dyn AnyBlock, setup: &Setup) -> Result<(Library, Counts), Error> {
    let name = block.name();
    let library = library(name, setup).map_err(Error::of_input)?;
    library.write("block.v", verilog::verilog(block, &library)?)?;
    library.write("bench.v", bench::bench(block))?;
    let cells = yosys(&library, name, &ice40_script(name, NO_DPI), "ice40.txt")?;
    Ok((library, ice40_counts(&cells)))
}

/// Counts the primitives of the iCE40.
pub(crate) fn ice40_counts(cells: &BTreeMap<String, u64>) -> Counts {
    Counts {
        lut4: sum(cells, "SB_LUT4"),
        ff: sum(cells, "SB_DFF"),
        carry: sum(cells, "SB_CARRY"),
        bram: sum(cells, "SB_RAM40_4K"),
        dsp: 0,
    }
}

/// Counts the primitives of the ECP5.
pub(crate) fn ecp5_counts(cells: &BTreeMap<String, u64>) -> Counts {
    Counts {
        lut4: sum(cells, "LUT4"),
        ff: sum(cells, "TRELLIS_FF"),
        carry: sum(cells, "CCU2C"),
        bram: sum(cells, "DP16KD"),
        dsp: sum(cells, "MULT18X18D"),
    }
}

/// Synthesises a block that is too large for the HX8K for the ECP5, and counts its primitives there.
fn ecp5(library: &Library, name: &'static str) -> Result<Counts, Error> {
    Ok(ecp5_counts(&yosys(library, name, &ecp5_script(name, NO_DPI), "ecp5.txt")?))
}

/// Places the block on its bench, and times it.
fn timing(library: &Library, name: &str, seed: u32) -> Result<Placed, Error> {
    let seed = seed.to_string();
    let place = [&DEVICE[..], &["--timing-allow-fail", "--seed", &seed, "--json", "bench.json"]].concat();
    match run(library, Tool::Nextpnr, name, place) {
        Ok(said) => Ok(fmax(&said).map_or(Placed::NoPath, Placed::Mhz)),
        Err(error) if is_full(error.said()) => Ok(Placed::NoRoom),
        Err(error) => Err(error),
    }
}

/// Runs Yosys on a block. Returns the cells from the statistics that its script writes.
fn yosys(library: &Library, name: &str, script: &Script<Yosys>, stat: &str) -> Result<BTreeMap<String, u64>, Error> {
    let said = run_yosys(library, name, script)?;
    let path = library.dir().join(stat);
    match fs::read_to_string(&path) {
        Ok(text) => Ok(cell_counts(&text)),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let step = format!("synthesise {name}");
            Err(ToolError::new(Tool::Yosys, &step, Fault::Silent("table of cells"), &said).into())
        }
        Err(error) => Err(Error::io(path, error)),
    }
}

/// Runs a script of Yosys on a block in a library's directory. Returns its standard output followed by its standard
/// error.
pub(crate) fn run_yosys(library: &Library, block: &str, script: &Script<Yosys>) -> Result<String, Error> {
    run(library, Tool::Yosys, block, ["-q", "-p", script.as_str()])
}

/// Runs a tool in a library's directory. Returns its standard output followed by its standard error; of GHDL only the
/// former.
fn run(
    library: &Library,
    tool: Tool,
    block: &str,
    arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
) -> Result<String, Error> {
    let mut command = Command::new(tool.name());
    // The tool's temporary files are removed with the library.
    command.args(arguments).current_dir(library.dir()).env("TMPDIR", library.dir());
    let step = match tool {
        Tool::Ghdl => "write Verilog of",
        Tool::Yosys => "synthesise",
        Tool::Nextpnr => "place",
        Tool::Verilator | Tool::Icarus | Tool::Z3 | Tool::Yices | Tool::Bitwuzla => "read",
    };
    let said = tool::run(tool, &format!("{step} {block}"), command, library.limit(Duration::ZERO));
    let said = said.map_err(|error| match error.refused() {
        true => failed_on(tool, block, error.said),
        false => error.into(),
    })?;
    // GHDL's complaints are not Verilog.
    Ok(if tool == Tool::Ghdl { said.out } else { said.out + &said.err })
}

/// Returns the error of a tool that refused a block.
fn failed_on(tool: Tool, block: &str, said: impl Into<String>) -> Error {
    Error::refused(format!("{} failed on {block}", tool.name()), said).of_input()
}

/// Asks the tools of the flow for their versions. Returns their names with versions, in the order of their use. `limit`
/// is the user's time limit of a tool, if there is one.
///
/// # Errors
///
/// An error when a tool is missing, too old, or does not answer.
pub fn tool_versions(limit: Option<Duration>) -> Result<[String; 3], Error> {
    let ask = |tool: Tool| -> Result<String, Error> { Ok(format!("{} {}", tool.name(), tool.version(limit)?)) };
    Ok([ask(Tool::Ghdl)?, ask(Tool::Yosys)?, ask(Tool::Nextpnr)?])
}

/// Returns the Verilog that a block is synthesised from: GHDL's Verilog, with its errors repaired.
///
/// # Errors
///
/// [`Error`] when GHDL is missing or refuses the VHDL.
pub fn verilog(block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<String, Error> {
    verilog::verilog(block, &library(block.name(), &setup.into()).map_err(Error::of_input)?)
}
