//! Gives a design in VHDL ports that are words, by an entity around it. GHDL's synthesis tells the bounds of arrays.

use std::path::Path;

use hpu_cosim::scene::Dut;

use super::build::{write, write_files};
use super::vhdl::{Around, Names, PROBE};
use super::{Simulators, of_tool, refuses};
use crate::engines::error::Error;
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Tool, run};

impl Simulators {
    /// Puts a generated entity around a design if a port has a type that no word is.
    ///
    /// # Errors
    ///
    /// When a port cannot be connected, or GHDL refuses the design.
    pub(super) fn flattened(&self, dut: &mut Dut) -> Result<Names, Error> {
        let Some(around) = Around::of(dut)? else { return Ok(Names::default()) };
        let told = around.probe().map_or(Ok(String::new()), |text| self.told_by_synthesis(dut, &text))?;
        let names = around.put(dut, &told)?;
        names.ok_or_else(|| refuses(Tool::Ghdl, dut, "it does not tell the bounds of its ports"))
    }

    /// Returns the Verilog of the probe. No function of the design runs for that.
    fn told_by_synthesis(&self, dut: &Dut, text: &str) -> Result<String, Error> {
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        let folder = folder.path();
        write_files(dut, folder)?;
        self.analyse(dut, folder)?;
        let own = Path::new("hpu").join(format!("{PROBE}.vhd"));
        write(folder, &own.to_string_lossy(), text.as_bytes())?;
        let said = |verb: &str, last: &[&str]| {
            let mut command = self.ghdl_command(verb, dut, folder);
            command.arg(format!("--work={}", dut.library)).args(last);
            let ran = run(Tool::Ghdl, "tell the bounds of its ports", command, self.limit());
            ran.map_err(|error| of_tool(dut, error))
        };
        said("-a", &[&own.to_string_lossy()])?;
        Ok(said("--synth", &["--out=verilog", PROBE])?.out)
    }
}
