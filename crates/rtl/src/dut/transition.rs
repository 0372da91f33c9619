//! A design as a transition relation in SMT-LIB, for proofs.

use std::collections::BTreeSet;
use std::fs;

use hpu_cosim::scene::Dut;
use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Yosys};

use super::build::{write, write_files};
use super::{DutError, Simulators};
use crate::cost::NO_DPI;
use crate::formal::{FLAT, TRANSITION};
use crate::temporary::Temporary;

/// A design in SMT-LIB, as Yosys writes it.
pub(crate) struct Transition {
    /// The definitions in SMT-LIB.
    pub(crate) text: String,
    /// The name of the module.
    pub(crate) top: String,
    /// The nets at whose edges a register is clocked. A net is listed twice when both of its edges clock registers.
    pub(crate) clocks: Vec<String>,
}

/// The net that is 1 where all invariants hold.
pub(crate) const INVARIANT: &str = "hpu_invariant";

impl Simulators {
    /// Returns the transition relation of a design. If there are `invariants`, Verilog expressions that are claimed to
    /// hold in every state, the net [`INVARIANT`] is added for them.
    pub(crate) fn transition(&self, dut: &Dut, invariants: &[String]) -> Result<Transition, DutError> {
        let folder = Temporary::folder().map_err(|error| DutError::Io(std::env::temp_dir(), error))?;
        let folder = folder.path();
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read_to_string(&path).map_err(|error| DutError::Io(path, error))
        };
        write_files(dut, folder)?;
        let (mut source, top) = self.read_by_yosys(dut, folder)?;
        if !invariants.is_empty() {
            let script = script!(Yosys: "{}prep -top {}; {}; write_verilog flat.v", source, top, Fixed(FLAT));
            self.yosys(dut, folder, "flatten a design", &script)?;
            let verilog = read("flat.v")?;
            let all: Vec<_> = invariants.iter().map(|holds| format!("({holds})")).collect();
            let net = format!("(* keep *) wire {INVARIANT} = {};\nendmodule", all.join(" && "));
            // The file has one module, whose `endmodule` is the last.
            let (head, _) = verilog.rsplit_once("endmodule").unwrap_or((&verilog, ""));
            write(folder, "flat.v", format!("{head}{net}\n").as_bytes())?;
            source = script!(Yosys: "read_verilog{} -noautowire flat.v; ", NO_DPI);
        }
        let script = script!(
            Yosys: "{}prep -top {}; {}; select -write clocks.txt t:$*ff* %ci1:+[CLK] w:* %i; \
                    {} -wires -stbv block.smt2",
            source,
            top,
            Fixed(FLAT),
            Fixed(TRANSITION)
        );
        self.yosys(dut, folder, "write a design as a transition", &script)?;
        let text = read("block.smt2")?;
        let written = read("clocks.txt")?;
        let nets: BTreeSet<_> = written.lines().filter_map(|line| Some(line.split_once('/')?.1.to_string())).collect();
        let mut clocks: Vec<_> = nets.into_iter().collect();
        for line in text.lines().filter_map(|line| line.strip_prefix("; yosys-smt2-clock ")) {
            if let [net, _, _] = line.split(' ').collect::<Vec<_>>()[..] {
                clocks.push(net.to_string());
            }
        }
        Ok(Transition { text, top: top.to_string(), clocks })
    }
}
