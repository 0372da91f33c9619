//! The C++ program around a model of Verilator: `main.cpp` with the ports, the state and the clocks of a design.

use std::fmt::Write as _;

use hpu_cosim::scene::Dut;

use super::build::{Model, PROGRAM, common_cycle};
use super::process::UNSET;
use super::said::fatal;
use super::text::cpp::{Field, State, is_for_x, path};

/// Returns the C++ program around the model; [`wire`](super::wire) describes what it reads and writes.
pub(super) fn main_cpp(model: &Model, fields: &[Field], state: &State, is_timed: bool, synthesised: &str) -> String {
    let dut = model.dut;
    let timing = |field: &&Field| {
        let named =
            |name: &str| *name == *field.name || super::is_vhdl(&dut.files) && name.eq_ignore_ascii_case(&field.name);
        dut.clocks.iter().any(|clock| named(&clock.port)) || dut.reset.iter().any(|reset| named(&reset.port))
    };
    let wires: Vec<_> = fields.iter().filter(|field| !timing(field)).collect();
    let (mut puts, mut gets, mut inside) = (String::new(), String::new(), String::new());
    let (mut levels, mut resets, mut variables) = (String::new(), String::new(), String::new());
    for (index, field) in wires.iter().enumerate() {
        let name = &field.field;
        let _ = if field.is_inside {
            writeln!(inside, "    {{&top.{name}, sizeof top.{name}}},")
        } else if field.is_input {
            writeln!(puts, "  top.{name} = bits[{index}];")
        } else {
            writeln!(gets, "  bits[{index}] = top.{name};")
        };
    }
    let find = |port: &str| {
        let is =
            |field: &&Field| field.name == port || super::is_vhdl(&dut.files) && field.name.eq_ignore_ascii_case(port);
        fields.iter().find(is).map(|field| &field.field)
    };
    for clock in &dut.clocks {
        if let Some(name) = find(&clock.port) {
            let _ = writeln!(levels, "  top.{name} = half % {} < {};", 2 * clock.divide, clock.divide);
        }
    }
    if let Some((reset, name)) = dut.reset.as_ref().and_then(|reset| Some((reset, find(&reset.port)?))) {
        let _ = writeln!(resets, "  top.{name} = active != {};", reset.active_low);
    }
    for name in &state.variables {
        let (path, is_for_x, of) = (path(name, synthesised), is_for_x(name), format!("Vdut___024root, {name}"));
        let size = format!("sizeof(Vdut___024root::{name})");
        let _ = writeln!(variables, "  {{\"{path}\", {is_for_x}, offsetof({of}), {size}}},");
    }
    let ports = || wires.iter().filter(|field| !field.is_inside);
    let ways = match super::is_vhdl(&dut.files) {
        true => "dut.registers = \"zero\" for an FPGA that clears its registers, or dut.engine = \"ghdl\" for VHDL's U",
        false => "dut.registers = \"zero\" for an FPGA that clears its registers",
    };
    // The quotes and escapes of Rust are those of C++, for these characters.
    let names: Vec<_> = ports().map(|field| format!("{:?}", field.name)).collect();
    let outputs: Vec<_> = ports().map(|field| (!field.is_input).to_string()).collect();
    PROGRAM
        .replace("@PUTS@", &puts)
        .replace("@GETS@", &gets)
        .replace("@LEVELS@", &levels)
        .replace("@RESETS@", &resets)
        .replace("@VARIABLES@", &variables)
        .replace("@WAY@", &format!("{ways:?}"))
        .replace("@UNSET@", &UNSET.to_string())
        .replace("@MAKES_UP@", &state.makes_up.to_string())
        .replace("@INSIDE@", &inside)
        .replace("@PORTS@", &names.len().to_string())
        .replace("@NAMES@", &names.join(", "))
        .replace("@OUTPUTS@", &outputs.join(", "))
        .replace("@COMMON@", &common_cycle(dut).to_string())
        .replace("@TIMED@", &is_timed.to_string())
        .replace("@TELLS_TIME@", &tells_time(dut).to_string())
        .replace("@FREQUENCY@", &model.clock.frequency_hz().to_string())
        .replace("@SETTLE@", &model.settle.to_string())
        .replace("@FATAL@", &fatal(dut))
}

/// Returns whether a design in Verilog asks for the time.
fn tells_time(dut: &Dut) -> bool {
    let asks = |content: &[u8]| {
        let text = String::from_utf8_lossy(content);
        ["$time", "$realtime", "$stime"].iter().any(|call| text.contains(call))
    };
    dut.files.iter().any(|(_, content)| asks(content)) || dut.beside.iter().any(|file| asks(&file.content))
}
