//! A design as a transition relation in SMT-LIB, for proofs.

use std::fs;

use hpu_cosim::scene::Dut;
use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Yosys};

use super::Simulators;
use super::build::{write, write_files};
use crate::cost::NO_DPI;
use crate::engines::error::Error;
use crate::engines::temporary::Temporary;
use crate::netlists::clocking::{self, Clocked, Timing, Unfit};
use crate::netlists::unknown::{RULES, UNKNOWN, told};
use crate::netlists::{FLAT, TRANSITION};

/// A design in SMT-LIB, as Yosys writes it.
pub(crate) struct Transition {
    /// The definitions in SMT-LIB.
    pub(crate) text: String,
    /// The name of the module.
    pub(crate) top: String,
    /// Whether the reset acts between clock edges too.
    pub(crate) resets_at_once: bool,
}

/// The net that is 1 where all invariants hold.
pub(crate) const INVARIANT: &str = "hpu_invariant";

impl Simulators {
    /// Returns the transition relation of a design, or the reason why its step is not one rising edge of its clock; a
    /// reset may act between clock edges too. If there are `invariants`, Verilog expressions that are claimed to hold
    /// in every state, the net [`INVARIANT`] is added for them.
    pub(crate) fn transition(
        &self,
        dut: &Dut,
        reset: Option<&str>,
        invariants: &[String],
    ) -> Result<Result<Transition, String>, Error> {
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        let folder = folder.path();
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read_to_string(&path).map_err(|error| Error::io(path, error))
        };
        write_files(dut, folder)?;
        let (source, top) = self.read_by_yosys(dut, folder)?;
        self.yosys(dut, folder, "read a design", &script!(Yosys: "{}{}", source, clocking::early(&top)))?;
        let [json, netlist] = clocking::EARLY;
        let timing =
            Timing { clock: &dut.clocks[0].port, reset, at_once: true, ignores_case: super::is_vhdl(&dut.files) };
        let Clocked { resets_at_once } = match clocking::clocked(&read(json)?, &top, &timing) {
            Ok(clocked) => clocked,
            Err(Unfit::Clocked(why)) => return Ok(Err(why)),
            Err(Unfit::Unknown(why)) => return Err(Error::ended(why)),
        };
        write(folder, netlist, told(&read(netlist)?).as_bytes())?;
        write(folder, RULES.0, RULES.1.as_bytes())?;
        let mut source = script!(Yosys: "read_rtlil {}; {}; ", Fixed(netlist), UNKNOWN);
        if !invariants.is_empty() {
            let script = script!(Yosys: "{}prep -top {}; {}; write_verilog flat.v", source, top, Fixed(FLAT));
            self.yosys(dut, folder, "flatten a design", &script)?;
            let verilog = read("flat.v")?;
            let all: Vec<_> = invariants.iter().map(|holds| format!("({holds})")).collect();
            let net = format!("(* keep *) wire {INVARIANT} = {};\nendmodule", all.join(" && "));
            // The file has one module, whose `endmodule` is the last.
            let (head, _) = verilog.rsplit_once("endmodule").unwrap_or((&verilog, ""));
            write(folder, "flat.v", format!("{head}{net}\n").as_bytes())?;
            source = script!(Yosys: "read_verilog{} -icells -noautowire flat.v; ", NO_DPI);
        }
        let script = script!(
            Yosys: "{}prep -top {}; {}; {} -wires -stbv block.smt2",
            source,
            top,
            Fixed(FLAT),
            Fixed(TRANSITION)
        );
        self.yosys(dut, folder, "write a design as a transition", &script)?;
        Ok(Ok(Transition { text: read("block.smt2")?, top: top.to_string(), resets_at_once }))
    }
}
