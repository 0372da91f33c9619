//! A design simulated in this process, by leaps over the clock edges at which only counters move.
//!
//! Yosys makes a netlist of Verilog, or of GHDL's synthesis of VHDL with the same repairs as for Verilator; the crate
//! [`hpu_leap`] simulates it. The ports are described as for Verilator, which reads the design but compiles no program
//! of it. A design that no netlist of words represents, or that says something while it runs, does not fit: the reason
//! is told, and another simulator takes the design.

mod running;
mod tasks;

use std::path::Path;
use std::sync::Arc;

use hpu_cosim::dut::{Change, Design, Fault, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, Identifier, Registers};
use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Script, Yosys};
use hpu_leap::{Netlist, yosys};

use self::running::Running;
use super::Simulators;
use super::build::{Model, common_cycle, write, write_files};
use super::fallback::wires;
use super::files::PlainName;
use super::verilator::{Described, in_vhdl, read, sources};
use crate::cost::NO_DPI;
use crate::engines::error::Error;
use crate::engines::note::note;
use crate::engines::tool::Tool;

/// The files of a built netlist: Yosys' JSON of it, its ports, notes and assertions as of a model of Verilator, and the
/// reason why there is none, if there is one.
const RESULTS: [&str; 5] = [NETLIST, PORTS, NOTES, UNCHECKED, UNFIT];
const NETLIST: &str = "netlist.json";
const PORTS: &str = "ports";
const NOTES: &str = "notes";
const UNCHECKED: &str = "unchecked";
const UNFIT: &str = "unfit";

/// A design as a netlist.
pub(super) struct Leaping {
    netlist: Arc<Netlist>,
    ports: Vec<Port>,
    hidden: Vec<Port>,
    is_vhdl: bool,
    engine: String,
    registers: Registers,
    /// Cycles of the reset, and whether it is active low.
    settle: u64,
    active_low: bool,
    unchecked: Vec<String>,
    /// The source of each input and the port of each output of the netlist.
    inputs: Vec<Source>,
    outputs: Vec<usize>,
}

/// The source of an input of a netlist.
#[derive(Clone, Copy)]
enum Source {
    /// The port with this number among those that a request has words for.
    Port(usize),
    /// The reset.
    Reset,
}

impl Simulators {
    /// Builds the netlist of a design, or tells why it has none.
    ///
    /// # Errors
    ///
    /// When a tool is missing, or GHDL or Verilator refuses the design.
    pub(super) fn leaping(&self, model: &Model, inside: Inside) -> Result<Result<Leaping, String>, Error> {
        let dut = model.dut;
        let is_vhdl = super::is_vhdl(&dut.files);
        if let Some(why) = unfit(dut, inside) {
            return Ok(Err(why));
        }
        let version = |tool: Tool| Ok(format!("{} {}", tool.name(), tool.version(self.setup.timeout)?));
        let tools = [Tool::Yosys, Tool::Verilator].into_iter().chain(is_vhdl.then_some(Tool::Ghdl));
        let tools = tools.map(version).collect::<Result<Vec<_>, Error>>()?.join(", ");
        let tools = format!("netlist by {tools}: {}; {}; {}", yosys::FLAT, yosys::ZEROS, yosys::LOWERED);
        let built = self.built(model, &tools, &RESULTS, |folder| {
            write_files(dut, folder)?;
            let netlist = self.netlist(model, folder)?;
            let (texts, why) = match netlist {
                Ok(texts) => (texts, String::new()),
                Err(why) => (Texts::default(), why),
            };
            let Texts { json, lines, notes, unchecked } = texts;
            let texts = [json, lines, notes, unchecked, why];
            RESULTS.iter().zip(texts).try_for_each(|(name, text)| write(folder, name, text.as_bytes()))
        })?;
        let text = |name: &str| read(&built.path.join(name));
        let why = text(UNFIT)?;
        if !why.is_empty() {
            return Ok(Err(why));
        }
        let clock = &dut.clocks[0].port;
        let top = if is_vhdl { dut.top.to_lowercase() } else { dut.top.clone() };
        let netlist = match yosys::read(&text(NETLIST)?, &top, (clock, is_vhdl)) {
            Ok(netlist) => netlist,
            Err(why) => return Ok(Err(why.to_string())),
        };
        text(NOTES)?.lines().for_each(|told| note(told.to_string()));
        let unchecked = text(UNCHECKED)?.lines().map(str::to_string).collect();
        let described = self.described(model, &text(PORTS)?, inside)?;
        Ok(joined(model, netlist, described).map(|design| Leaping { unchecked, ..design }))
    }

    /// Makes a netlist of a design in a folder, or tells why it has none.
    fn netlist(&self, model: &Model, folder: &Path) -> Result<Result<Texts, String>, Error> {
        let dut = model.dut;
        let is_vhdl = super::is_vhdl(&dut.files);
        let (files, top, unchecked) = if is_vhdl {
            let (files, unchecked) = self.synthesised_with_assertions(dut, folder)?;
            (files, dut.top.to_lowercase(), unchecked)
        } else {
            (sources(dut), dut.top.clone(), Vec::new())
        };
        for file in &files {
            if let Some(task) = tasks::first(&read(&folder.join(&**file))?) {
                return Ok(Err(format!("it may say something or end the run while it is simulated: `{task}`")));
            }
        }
        let translated = self.translated(model, (folder, &files, &top), (!is_vhdl, false))?;
        if translated.is_timed {
            return Ok(Err("it has delays".to_string()));
        }
        let source = match read_by_yosys(dut, &files, &top) {
            Ok(source) => source,
            Err(why) => return Ok(Err(why)),
        };
        let zeros = if is_vhdl { script!(Yosys: "{}; ", Fixed(yosys::ZEROS)) } else { Script::empty() };
        let (flat, lowered) = (Fixed(yosys::FLAT), Fixed(yosys::LOWERED));
        let script = script!(
            Yosys: "{}hierarchy -top {}; {}; {}{}; write_json {}", source, top, flat, zeros, lowered, Fixed(NETLIST)
        );
        if let Err(error) = self.yosys(dut, folder, "write a netlist", &script) {
            // What Yosys does not read, another simulator may.
            let is_its = error.tool().is_none_or(|tool| tool.refused());
            return if is_its { Ok(Err(format!("Yosys does not take it: {}", said(&error)))) } else { Err(error) };
        }
        let json = read(&folder.join(NETLIST))?;
        let (lines, notes, unchecked) = (translated.lines, translated.notes, unchecked.join("\n"));
        Ok(Ok(Texts { json, lines, notes, unchecked }))
    }
}

/// The files of a netlist.
#[derive(Default)]
struct Texts {
    json: String,
    lines: String,
    notes: String,
    unchecked: String,
}

/// Returns the last line of a tool's message that says something.
fn said(error: &Error) -> String {
    let text = error.to_string();
    let is_one = |line: &&str| !line.trim().is_empty();
    let line = text.lines().find(|line| line.contains("ERROR")).or(text.lines().rev().find(is_one));
    line.unwrap_or_default().trim().to_string()
}

/// Returns the reason why a design has no netlist whatever its files are.
fn unfit(dut: &Dut, inside: Inside) -> Option<String> {
    if dut.clocks.len() != 1 || common_cycle(dut) != 1 {
        return Some("it has several clocks, or a slower one than the scene".to_string());
    }
    if dut.registers == Registers::Random {
        return Some("dut.registers = \"random\" takes the random values of Verilator".to_string());
    }
    inside.is_any().then(|| "signals inside are to be shown, and a netlist keeps few of them".to_string())
}

/// Returns the commands by which Yosys reads files, with the values of parameters in Verilog, or the reason why it
/// cannot take a value.
fn read_by_yosys(dut: &Dut, files: &[PlainName], top: &Identifier) -> Result<Script<Yosys>, String> {
    let files: Script<Yosys> = files.iter().map(|file| script!(Yosys: " {}", file)).collect();
    let mut read = vec![script!(Yosys: "read_verilog{} -sv{}; ", NO_DPI, files)];
    if !super::is_vhdl(&dut.files) {
        for (name, value) in &dut.generics {
            let value = Script::<Yosys>::value(value).map_err(|why| format!("dut.parameters.{name}: {why}"))?;
            read.push(script!(Yosys: "chparam -set {} {} {}; ", name, value, top));
        }
    }
    Ok(read.into_iter().collect())
}

/// Joins a netlist and the ports of its design, by name and width.
fn joined(model: &Model, netlist: Netlist, described: Described) -> Result<Leaping, String> {
    let (dut, is_vhdl) = (model.dut, super::is_vhdl(&model.dut.files));
    let Described { ports, raw, hidden, .. } = described;
    let same = |one: &str, other: &str| if is_vhdl { one.eq_ignore_ascii_case(other) } else { one == other };
    let own = |name: &str| if is_vhdl { in_vhdl(name) } else { name.to_string() };
    let numbered: Vec<_> = wires(dut, &ports).into_iter().map(|port| port.name.clone()).collect();
    // The name of a port as tools have it, and its number in a request.
    let number = |name: &str, width: u8, is_input: bool| {
        let at = raw.iter().position(|raw| same(raw, &own(name)))?;
        let fits = ports[at].is_input == is_input && ports[at].format.width() == u32::from(width);
        numbered.iter().position(|numbered| fits && *numbered == ports[at].name)
    };
    let unknown = |name: &str| format!("Verilator and Yosys have different ports `{name}`");
    let is_reset = |name: &str| dut.reset.iter().any(|reset| same(&reset.port, &own(name)));
    let mut inputs = Vec::new();
    for (name, net) in netlist.inputs() {
        inputs.push(match number(name, netlist.width(*net), true) {
            _ if is_reset(name) => Source::Reset,
            Some(number) => Source::Port(number),
            None => return Err(unknown(name)),
        });
    }
    let mut outputs = Vec::new();
    for output in netlist.outputs() {
        match number(&output.name, netlist.width(output.net), false) {
            Some(number) => outputs.push(number),
            None => return Err(unknown(&output.name)),
        }
    }
    let all = wires(dut, &ports);
    if let Some(port) = all.iter().enumerate().find(|(at, port)| !port.is_input && !outputs.contains(at)) {
        return Err(unknown(&port.1.name));
    }
    let zero = if dut.registers == Registers::Zero { "; registers that nothing sets begin at 0" } else { "" };
    let of = if is_vhdl { "of the Verilog of GHDL's synthesis" } else { "of the Verilog" };
    Ok(Leaping {
        netlist: Arc::new(netlist),
        hidden,
        is_vhdl,
        engine: format!("hpu's leaps over Yosys' netlist {of}{zero}"),
        registers: dut.registers,
        settle: model.settle,
        active_low: dut.reset.as_ref().is_some_and(|reset| reset.active_low),
        unchecked: Vec::new(),
        inputs,
        outputs,
        ports,
    })
}

impl Design for Leaping {
    fn ports(&self) -> &[Port] {
        &self.ports
    }

    fn hidden(&self) -> &[Port] {
        &self.hidden
    }

    fn ignores_case(&self) -> bool {
        self.is_vhdl
    }

    fn engine(&self) -> &str {
        &self.engine
    }

    fn start(
        &self,
        words: &[u64],
        drives: &[bool],
        changes: &mut Vec<Change>,
    ) -> Result<Box<dyn RunningDesign>, Fault> {
        Ok(Box::new(Running::start(self, words, drives, changes)))
    }
}
