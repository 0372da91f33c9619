//! What a block costs in an FPGA: its VHDL through GHDL, Yosys and nextpnr.
//!
//! The FPGA is a Lattice iCE40 HX8K. The flow is fixed, so that the same command gives the same numbers:
//! `ghdl --synth --out=verilog`, `synth_ice40 -abc9 -device hx` (flattened; abc9 knows the HX's delays, which plain abc
//! does not), `nextpnr-ice40 --hx8k --package ct256` with seeds 1, 2 and 3 and no target frequency (placement does not
//! depend on it), of which the median counts. A block that is too large is counted for the ECP5 (`synth_ecp5 -abc9`)
//! as well, and not timed.
//!
//! Counts are of the block alone. For its timing the same netlist stands between registers in a [bench](bench::bench),
//! whose own cells are never counted and whose own paths are in another clock domain.

mod bench;
mod tool;
mod verilog;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use hpu_datapath::AnyBlock;

use crate::ghdl::{GhdlError, Library};
use tool::{Tool, run};

pub use tool::CostError;

/// Logic cells of the HX8K.
pub const HX8K_CELLS: u64 = 7680;
/// Block RAMs of the HX8K, 4096 bits each.
pub const HX8K_BRAM: u64 = 32;

/// Seeds of the placements, of which the median is taken.
const SEEDS: [u32; 3] = [1, 2, 3];

/// Primitives of a netlist.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
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

/// What a block costs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cost {
    /// Primitives of the iCE40.
    pub ice40: Counts,
    /// Logic cells of the HX8K, each a lookup table, a carry and a flip-flop, as nextpnr packs them; its one or two
    /// sources of constants are among them.
    pub cells: u64,
    /// Primitives of the ECP5 when the HX8K is too small.
    pub ecp5: Option<Counts>,
    /// Fastest clock in the HX8K with registers before the inputs and behind the outputs. Absent when the block does not
    /// fit, when no path leads through it, or when it leaves no place for those registers.
    pub fmax_mhz: Option<f64>,
}

impl Cost {
    /// Whether the HX8K is large enough.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.ecp5.is_none()
    }

    /// The longest way from register to register: clock to output, logic and wires, setup.
    #[must_use]
    pub fn path_ns(&self) -> Option<f64> {
        self.fmax_mhz.map(|fmax_mhz| 1000.0 / fmax_mhz)
    }
}

/// Synthesises a block from its VHDL in a directory, with the generics of its configuration; places and times it.
///
/// # Errors
///
/// [`CostError`]: a tool is missing, refuses, or does not come to an end.
pub fn cost(block: &dyn AnyBlock, hdl: &Path) -> Result<Cost, CostError> {
    let name = block.name();
    let library = library(name, hdl)?;
    library.write("block.v", &verilog::verilog(block, &library)?)?;
    library.write("bench.v", &bench::bench(block))?;

    let script = format!(
        "read_verilog block.v; synth_ice40 -abc9 -device hx -top {name} -json block.json; tee -q -o ice40.txt stat; \
         read_verilog bench.v; hierarchy -check -top hpu_bench; flatten; clean; write_json bench.json"
    );
    run(library.dir(), Tool::Yosys, name, ["-q", "-p", &script])?;
    let cells = cell_counts(&read(&library, "ice40.txt")?);
    let ice40 = Counts {
        lut4: sum(&cells, "SB_LUT4"),
        ff: sum(&cells, "SB_DFF"),
        carry: sum(&cells, "SB_CARRY"),
        bram: sum(&cells, "SB_RAM40_4K"),
        dsp: 0,
    };
    let said = run(
        library.dir(),
        Tool::Nextpnr,
        name,
        ["--hx8k", "--package", "ct256", "--pack-only", "--json", "block.json"],
    )?;
    let cells = used_cells(&said).ok_or_else(|| CostError::Failed {
        tool: Tool::Nextpnr.name(),
        block: name.to_string(),
        said,
    })?;

    if cells > HX8K_CELLS || ice40.bram > HX8K_BRAM {
        let ecp5 = Some(ecp5(&library, name)?);
        return Ok(Cost { ice40, cells, ecp5, fmax_mhz: None });
    }
    let mut fmax_mhz = SEEDS.iter().map(|&seed| timing(&library, name, seed)).collect::<Result<Vec<_>, _>>()?;
    // `None` sorts first: a placement that finds no room is slower than any other.
    fmax_mhz.sort_by(|a, b| a.partial_cmp(b).expect("a frequency is a number"));
    Ok(Cost { ice40, cells, ecp5: None, fmax_mhz: fmax_mhz[SEEDS.len() / 2] })
}

/// The tools of the flow with their versions, in the order of their use, from what each says of itself.
///
/// # Errors
///
/// [`CostError::Missing`], or what keeps a tool from answering.
pub fn tool_versions() -> Result<[String; 3], CostError> {
    let ask = |tool: Tool, option: &str| -> Result<String, CostError> {
        let said = run(&std::env::temp_dir(), tool, "its version", [option])?;
        // A date or the compiler, in brackets after a number, is none of the version.
        let line = said.lines().next().unwrap_or_default();
        let words = line.split_whitespace().map(|word| word.trim_matches(['(', ')', '"']));
        let number = words.into_iter().find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
        Ok(format!("{} {}", tool.name(), number.or(line.rsplit(' ').next()).unwrap_or_default().trim_end_matches(')')))
    };
    Ok([ask(Tool::Ghdl, "--version")?, ask(Tool::Yosys, "-V")?, ask(Tool::Nextpnr, "--version")?])
}

/// The VHDL of a block and of all that it instantiates, in the order of analysis, as one text.
///
/// # Errors
///
/// When a file cannot be read.
pub fn vhdl(name: &str, hdl: &Path) -> Result<String, CostError> {
    let read = |file: PathBuf| fs::read_to_string(&file).map_err(|error| GhdlError::Io(file, error).into());
    sources(name, hdl)?.into_iter().map(read).collect()
}

/// The Verilog that a block is synthesised from: GHDL's, with its errors put right.
///
/// # Errors
///
/// [`CostError`] when GHDL is missing or refuses the VHDL.
pub fn verilog(block: &dyn AnyBlock, hdl: &Path) -> Result<String, CostError> {
    verilog::verilog(block, &library(block.name(), hdl)?)
}

fn library(name: &str, hdl: &Path) -> Result<Library, CostError> {
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
    let text = fs::read_to_string(file).map_err(|error| GhdlError::Io(file.to_path_buf(), error))?;
    for after in text.split("entity work.").skip(1) {
        let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        visit(&hdl.join(format!("{name}.vhd")), hdl, files)?;
    }
    files.push(file.to_path_buf());
    Ok(())
}

/// A block too large for the HX8K, in the primitives of the ECP5.
fn ecp5(library: &Library, name: &str) -> Result<Counts, CostError> {
    let script = format!("read_verilog block.v; synth_ecp5 -abc9 -top {name}; tee -q -o ecp5.txt stat");
    run(library.dir(), Tool::Yosys, name, ["-q", "-p", &script])?;
    let cells = cell_counts(&read(library, "ecp5.txt")?);
    Ok(Counts {
        lut4: sum(&cells, "LUT4"),
        ff: sum(&cells, "TRELLIS_FF"),
        carry: sum(&cells, "CCU2C"),
        bram: sum(&cells, "DP16KD"),
        dsp: sum(&cells, "MULT18X18D"),
    })
}

/// The fastest clock of the block on its bench, if it finds its place and has a path.
fn timing(library: &Library, name: &str, seed: u32) -> Result<Option<f64>, CostError> {
    let seed = seed.to_string();
    let arguments = ["--hx8k", "--package", "ct256", "--timing-allow-fail", "--seed", &seed, "--json", "bench.json"];
    match run(library.dir(), Tool::Nextpnr, name, arguments) {
        Ok(said) => Ok(fmax(&said)),
        Err(CostError::Failed { said, .. }) if is_full(&said) => Ok(None),
        Err(error) => Err(error),
    }
}

fn read(library: &Library, file: &str) -> Result<String, CostError> {
    let path = library.dir().join(file);
    Ok(fs::read_to_string(&path).map_err(|error| GhdlError::Io(path, error))?)
}

/// Cells by type, from the lines of `stat` that are a name and a number.
fn cell_counts(stat: &str) -> BTreeMap<String, u64> {
    stat.lines()
        .filter_map(|line| {
            let (name, count) = line.trim().split_once(char::is_whitespace)?;
            Some((name.to_string(), count.trim().parse().ok()?))
        })
        .collect()
}

/// Cells whose type begins like this: flip-flops and block RAMs come in several kinds.
fn sum(cells: &BTreeMap<String, u64>, prefix: &str) -> u64 {
    cells.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, count)| count).sum()
}

/// Logic cells from nextpnr's `ICESTORM_LC:    10/ 7680     0%`.
fn used_cells(said: &str) -> Option<u64> {
    let (_, after) = said.split_once("ICESTORM_LC:")?;
    after.split('/').next()?.trim().parse().ok()
}

/// The last (routed) `Max frequency for clock 'clk…': 290.87 MHz`; the other clock is the bench's own.
fn fmax(said: &str) -> Option<f64> {
    let line = said.lines().rfind(|line| line.contains("Max frequency for clock") && line.contains("'clk"))?;
    line.rsplit_once("': ")?.1.split_whitespace().next()?.parse().ok()
}

/// Whether nextpnr ran out of places.
fn is_full(said: &str) -> bool {
    said.contains("no BELs remaining") || said.contains("Unable to find legal placement")
}
