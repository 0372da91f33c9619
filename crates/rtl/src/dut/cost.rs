//! The cost in an FPGA of a design of the user's own: counted and placed as it is, its ports as pins.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

use hpu_cosim::scene::{Dut, DutScene, Identifier};
use hpu_cosim::script;
use hpu_cosim::script::{Script, Yosys};

use super::build::{Model, write, write_files};
use super::verilator::sources;
use super::vhdl::names_foreign;
use super::{Simulators, is_vhdl, of_tool, refuses};
use crate::cost::{
    Counts, DEVICE, HX8K_BRAM, HX8K_CELLS, NO_DPI, SEEDS, cell_counts, ecp5_counts, ice40_counts, is_full, used_cells,
};
use crate::engines::error::Error;
use crate::engines::tool::{Fault, Tool, ToolError, numbers, run};

/// The file in which a cost is kept.
const COST: &str = "cost";

/// The cost of a design.
#[derive(Clone, PartialEq, Debug)]
pub struct DutCost {
    /// Primitives of the iCE40.
    pub ice40: Counts,
    /// Logic cells of the HX8K.
    pub cells: u64,
    /// Primitives of the ECP5 when the HX8K is too small.
    pub ecp5: Option<Counts>,
    /// The design's clocks. Each has its highest frequency in megahertz for each placement; `None` where no path leads
    /// from register to register, or where there was no room.
    pub clocks: Vec<(String, Vec<Option<f64>>)>,
    /// The tools with their versions.
    pub tools: String,
}

impl DutCost {
    /// Returns the highest frequency of a clock in megahertz: the median of the placements. A placement without room
    /// counts as slower than any other.
    pub fn fmax_mhz(&self, clock: usize) -> Option<f64> {
        let mut placed = self.clocks[clock].1.clone();
        placed.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
        *placed.get(placed.len() / 2)?
    }
}

impl Simulators {
    /// Prices the design of a scene. Yosys counts it for the iCE40, or for the ECP5 where the HX8K is too small, and
    /// nextpnr places it three times, each port on a pin. GHDL first synthesises VHDL. Constants of the scene are pins
    /// too, because they can be changed.
    ///
    /// # Errors
    ///
    /// An error when a tool is missing, or refuses the design.
    pub fn cost(&self, scene: &DutScene) -> Result<DutCost, Error> {
        let prepared = &self.prepared(&scene.dut)?;
        let dut = &prepared.dut;
        let mut tools = vec![Tool::Yosys, Tool::Nextpnr];
        if is_vhdl(&dut.files) {
            tools.insert(0, Tool::Ghdl);
        }
        self.calls_nothing(dut)?;
        let version = |tool: Tool| Ok(format!("{} {}", tool.name(), tool.version(self.setup.timeout)?));
        let tools = tools.into_iter().map(version).collect::<Result<Vec<_>, Error>>()?.join(", ");
        let built = self.built(&Model::of(scene, prepared), &format!("cost by {tools}"), &[COST], |folder| {
            write_files(dut, folder)?;
            let cost = self.priced(dut, folder)?;
            write(folder, COST, line(&cost).as_bytes())
        })?;
        let path = built.path.join(COST);
        let text = fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
        let cost = of_line(&text, &tools);
        cost.ok_or_else(|| Error::ended(format!("{}: no cost; remove this file's folder", path.display())))
    }

    /// Refuses VHDL that names functions of a library where GHDL's synthesis may call them. That of GHDL 2 calls none.
    fn calls_nothing(&self, dut: &Dut) -> Result<(), Error> {
        let texts: Vec<_> = dut.files.iter().map(|(_, content)| String::from_utf8_lossy(content)).collect();
        let texts: Vec<_> = texts.iter().map(|text| &**text).collect();
        if !is_vhdl(&dut.files) || !names_foreign(&texts) {
            return Ok(());
        }
        let version = Tool::Ghdl.version(self.setup.timeout)?;
        if numbers(&version).is_some_and(|numbers| numbers < (3, 0)) {
            return Ok(());
        }
        let said =
            format!("it names functions of a library (attribute foreign), which GHDL {version} may call meanwhile");
        Err(refuses(Tool::Ghdl, dut, said))
    }

    fn priced(&self, dut: &Dut, folder: &Path) -> Result<DutCost, Error> {
        let (read, top) = self.read_by_yosys(dut, folder)?;
        let nextpnr = |step: &str, arguments: &[&str]| self.told(dut, folder, Tool::Nextpnr, step, arguments);
        let ice40 = script!(
            Yosys: "{}synth_ice40 -abc9 -device hx -top {} -json block.json; tee -q -o ice40.txt stat",
            read,
            top
        );
        self.yosys(dut, folder, "synthesise a design", &ice40)?;
        let stat = |name: &str| {
            let path = folder.join(name);
            fs::read_to_string(&path).map(|text| cell_counts(&text)).map_err(|error| Error::io(path, error))
        };
        let counts = ice40_counts(&stat("ice40.txt")?);
        let pack = [&DEVICE[..], &["--pack-only", "--json", "block.json"]].concat();
        let said = nextpnr("pack a design", &pack)?;
        let silent = || ToolError::new(Tool::Nextpnr, "pack a design", Fault::Silent("number of cells"), &said);
        let cells = used_cells(&said).ok_or_else(silent)?;
        let mut clocks: Vec<_> = dut.clocks.iter().map(|clock| (clock.port.to_string(), Vec::new())).collect();
        let mut ecp5 = None;
        if cells > HX8K_CELLS || counts.bram > HX8K_BRAM {
            let script = script!(Yosys: "{}synth_ecp5 -abc9 -top {}; tee -q -o ecp5.txt stat", read, top);
            self.yosys(dut, folder, "synthesise a design", &script)?;
            ecp5 = Some(ecp5_counts(&stat("ecp5.txt")?));
        } else {
            for seed in SEEDS {
                let seed = seed.to_string();
                let place = [&DEVICE[..], &["--timing-allow-fail", "--seed", &seed, "--json", "block.json"]].concat();
                let said = match nextpnr("place a design", &place) {
                    Err(error) if is_full(error.said()) => String::new(),
                    said => said?,
                };
                for (port, placed) in &mut clocks {
                    placed.push(fmax(&said, port));
                }
            }
        }
        Ok(DutCost { ice40: counts, cells, ecp5, clocks, tools: String::new() })
    }

    /// Returns the commands by which Yosys reads a design in a folder, and the name of its topmost module there.
    pub(super) fn read_by_yosys(&self, dut: &Dut, folder: &Path) -> Result<(Script<Yosys>, Identifier), Error> {
        let is_vhdl = is_vhdl(&dut.files);
        let (files, top) = if is_vhdl {
            (self.synthesised(dut, folder, None)?.0, dut.top.to_lowercase())
        } else {
            (sources(dut), dut.top.clone())
        };
        let files: Script<Yosys> = files.iter().map(|file| script!(Yosys: " {}", file)).collect();
        let mut read = vec![script!(Yosys: "read_verilog{} -sv{}; ", NO_DPI, files)];
        if !is_vhdl {
            for (name, value) in &dut.generics {
                let value = Script::<Yosys>::value(value);
                let value = value.map_err(|why| Error::generic(name, why))?;
                read.push(script!(Yosys: "chparam -set {} {} {}; ", name, value, top));
            }
        }
        Ok((read.into_iter().collect(), top))
    }

    /// Runs a script of Yosys in a folder.
    pub(super) fn yosys(&self, dut: &Dut, folder: &Path, step: &str, script: &Script<Yosys>) -> Result<(), Error> {
        self.told(dut, folder, Tool::Yosys, step, &["-q", "-p", script.as_str()]).map(drop)
    }

    fn told(
        &self,
        dut: &Dut,
        folder: &Path,
        tool: Tool,
        step: &str,
        arguments: &[impl AsRef<OsStr>],
    ) -> Result<String, Error> {
        let mut command = Command::new(tool.name());
        command.args(arguments).current_dir(folder).env("TMPDIR", folder);
        let said = run(tool, step, command, self.limit()).map_err(|error| of_tool(dut, error))?;
        Ok(said.out + &said.err)
    }
}

/// Reads the frequency of a clock's port from the last (routed) `Max frequency for clock 'clk$SB_IO_IN_$glb_clk':
/// 290.87 MHz`.
fn fmax(said: &str, port: &str) -> Option<f64> {
    let is_its = |name: &str| {
        let rest = name.get(..port.len()).filter(|start| start.eq_ignore_ascii_case(port)).map(|_| &name[port.len()..]);
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_'))
    };
    let mhz = |line: &str| {
        let (name, mhz) = line.split_once("Max frequency for clock '")?.1.split_once("': ")?;
        is_its(name).then(|| mhz.split_whitespace().next()?.parse().ok()).flatten()
    };
    said.lines().rev().find_map(mhz)
}

/// Returns a cost as lines of text.
fn line(cost: &DutCost) -> String {
    let counts = |counts: &Counts| {
        let Counts { lut4, ff, carry, bram, dsp } = counts;
        format!("{lut4} {ff} {carry} {bram} {dsp}")
    };
    let mut text = format!("{}\n{}\n", counts(&cost.ice40), cost.cells);
    text += &format!("{}\n", cost.ecp5.as_ref().map_or("-".to_string(), counts));
    for (clock, placed) in &cost.clocks {
        let placed = placed.iter().map(|mhz| mhz.map_or("-".to_string(), |mhz| mhz.to_string()));
        text += &format!("{clock} {}\n", placed.collect::<Vec<_>>().join(" "));
    }
    text
}

fn of_line(text: &str, tools: &str) -> Option<DutCost> {
    let counts = |line: &str| {
        let numbers: Vec<u64> = line.split(' ').map(|word| word.parse().ok()).collect::<Option<_>>()?;
        let [lut4, ff, carry, bram, dsp] = numbers.try_into().ok()?;
        Some(Counts { lut4, ff, carry, bram, dsp })
    };
    let mut lines = text.lines();
    let (ice40, cells) = (counts(lines.next()?)?, lines.next()?.parse().ok()?);
    let ecp5 = match lines.next()? {
        "-" => None,
        line => Some(counts(line)?),
    };
    let clock = |line: &str| {
        let (name, placed) = line.split_once(' ')?;
        let mhz = |word: &str| if word == "-" { Some(None) } else { word.parse().ok().map(Some) };
        let placed = placed.split(' ').filter(|word| !word.is_empty()).map(mhz).collect::<Option<_>>()?;
        Some((name.to_string(), placed))
    };
    let clocks = lines.map(clock).collect::<Option<_>>()?;
    Some(DutCost { ice40, cells, ecp5, clocks, tools: tools.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_is_read_as_it_was_written() {
        let counts = Counts { lut4: 5, ff: 4, carry: 3, bram: 2, dsp: 0 };
        let clocks = vec![("clk".to_string(), vec![Some(61.25), None, Some(63.5)])];
        let cost = DutCost { ice40: counts, cells: 12, ecp5: None, clocks, tools: "yosys 1".to_string() };
        for ecp5 in [None, Some(Counts { dsp: 7, ..counts })] {
            let cost = DutCost { ecp5, ..cost.clone() };
            assert_eq!(of_line(&line(&cost), "yosys 1"), Some(cost));
        }
        assert_eq!(cost.fmax_mhz(0), Some(61.25));
        assert_eq!(of_line("5 4 3\n12\n-\n", ""), None);
    }

    #[test]
    fn a_clock_s_frequency_is_the_last_that_is_told_of_it() {
        let said = "Info: Max frequency for clock 'clk$SB_IO_IN_$glb_clk': 90.1 MHz (PASS at 12.00 MHz)\n\
                    Info: Max frequency for clock 'clk_2$SB_IO_IN_$glb_clk': 200.5 MHz (PASS at 12.00 MHz)\n\
                    Info: Max frequency for clock    'clk': 1 MHz\n\
                    Info: Max frequency for clock 'clk$SB_IO_IN_$glb_clk': 88.25 MHz (PASS at 12.00 MHz)\n";
        assert_eq!((fmax(said, "clk"), fmax(said, "CLK_2"), fmax(said, "clk_")), (Some(88.25), Some(200.5), None));
    }
}
