//! VHDL to Verilog: GHDL's synthesis of a design with its assertions, and the errors of that synthesis repaired.

use std::collections::BTreeMap;
use std::path::Path;

use hpu_cosim::scene::Dut;

use super::build::write;
use super::files::{PlainName, plain_names};
use super::said::{told, with_reports_asserted};
use super::vhdl::with_operands;
use super::{Simulators, of_tool, refuses};
use crate::cost::verilog::{UNTOLD, repaired};
use crate::engines::error::Error;
use crate::engines::tool::{Said, Tool, run};

/// The step from VHDL to Verilog.
pub(super) const SYNTHESIS: &str = "synthesise a design";
/// The Verilog of a design in VHDL.
pub(super) const SYNTHESISED: &str = "synthesised.v";

impl Simulators {
    /// Returns the files of a VHDL design as Verilog that checks its assertions, and those that it does not check.
    pub(super) fn synthesised_with_assertions(
        &self,
        dut: &Dut,
        folder: &Path,
    ) -> Result<(Vec<PlainName>, Vec<String>), Error> {
        let texts = plain_names(dut).into_iter().zip(&dut.files);
        let texts: Vec<_> = texts
            .map(|((plain, _), (_, content))| (plain.to_string(), String::from_utf8_lossy(content).into_owned()))
            .collect();
        let mut files: BTreeMap<_, _> = texts.iter().cloned().collect();
        let mut asserted = false;
        for (name, text) in &texts {
            if let Some(made) = with_reports_asserted(text) {
                write(folder, name, made.as_bytes())?;
                files.insert(name.clone(), made);
                asserted = true;
            }
        }
        let made = self.synthesised(dut, folder, Some(&files));
        if !asserted || made.is_ok() {
            return made;
        }
        for (name, text) in &texts {
            write(folder, name, text.as_bytes())?;
        }
        let (sources, mut unchecked) = self.synthesised(dut, folder, Some(&texts.into_iter().collect()))?;
        unchecked.push("statements `report` outside of assertions: GHDL's synthesis leaves them out".to_string());
        Ok((sources, unchecked))
    }

    /// Returns the files of a VHDL design as Verilog, with the errors of GHDL's synthesis repaired. The Verilog checks
    /// assertions if `asserted` has the texts of the design's files; with it are those that it does not check.
    pub(super) fn synthesised(
        &self,
        dut: &Dut,
        folder: &Path,
        asserted: Option<&BTreeMap<String, String>>,
    ) -> Result<(Vec<PlainName>, Vec<String>), Error> {
        self.analyse(dut, folder)?;
        let synth = |language: &str, checks: bool| -> Result<Said, Error> {
            let mut command = self.ghdl_command("--synth", dut, folder);
            command.args((!checks).then_some("--no-formal"));
            command.arg(format!("--work={}", dut.library));
            command.arg(format!("--out={language}"));
            command.arg(&*dut.top);
            run(Tool::Ghdl, SYNTHESIS, command, self.limit()).map_err(|error| of_tool(dut, error))
        };
        let said = synth("verilog", asserted.is_some())?;
        let told = asserted.and_then(|files| told(&said.out, &said.err, files));
        let (text, unchecked) = match (&told, asserted) {
            (Some(told), _) => (told.verilog.clone(), Vec::new()),
            (None, None) => (said.out, Vec::new()),
            (None, Some(_)) => {
                let why = "assertions of VHDL: GHDL's synthesis writes them in a form that hpu does not know";
                (synth("verilog", false)?.out, vec![why.to_string()])
            }
        };
        let untold = || refuses(Tool::Ghdl, dut, UNTOLD);
        let vhdl = || synth("vhdl", asserted.is_some()).map(|said| said.out);
        // Later releases have what is repaired here right.
        let text = if Tool::Ghdl.version(self.setup.timeout)?.starts_with("2.") {
            let own = || {
                plain_names(dut).into_iter().zip(&dut.files).map(|((plain, _), (_, content))| {
                    (plain.to_string(), String::from_utf8_lossy(content).into_owned())
                })
            };
            let files = asserted.map_or_else(|| own().collect(), BTreeMap::clone);
            with_operands(&text, &files).map_err(|untold| refuses(Tool::Ghdl, dut, untold))?
        } else {
            text
        };
        let verilog = repaired(&text, vhdl)?.ok_or_else(untold)?;
        let verilog = told.map_or_else(|| verilog.clone(), |told| told.spoken(&verilog));
        let verilog = with_small_top(&verilog, &dut.top);
        write(folder, SYNTHESISED, verilog.as_bytes())?;
        Ok((vec![PlainName::fixed(SYNTHESISED)], unchecked))
    }
}

/// Returns synthesised Verilog with the name of its topmost module in small letters. GHDL writes this name alone as the
/// entity is declared.
fn with_small_top(verilog: &str, top: &str) -> String {
    let mut named = verilog.lines().filter_map(|line| line.strip_prefix("module "));
    match named.find(|name| name.eq_ignore_ascii_case(top)) {
        Some(name) => verilog.replace(&format!("module {name}\n"), &format!("module {}\n", top.to_lowercase())),
        None => verilog.to_string(),
    }
}

/// Returns a name of synthesised Verilog as VHDL has it: see [`with_escaped_names`](crate::cost::verilog).
pub(super) fn in_vhdl(name: &str) -> String {
    let own = |part: &str| match part.strip_suffix('$') {
        Some(own) => own.to_string(),
        None if part.contains(|c: char| !c.is_ascii_alphanumeric() && c != '_') => format!("\\{part}\\"),
        None => part.to_string(),
    };
    name.split('.').map(own).collect::<Vec<_>>().join(".")
}
