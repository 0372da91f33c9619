//! A design simulated in this process, by leaps over the clock edges at which only counters move.
//!
//! Yosys makes a netlist of Verilog, or of GHDL's synthesis of VHDL with the same repairs as for Verilator; the crate
//! [`hpu_leap`] simulates it. The ports are described as for Verilator, which reads the design but compiles no program
//! of it. A design that no netlist of words represents, or that says something while it runs, does not fit: the reason
//! is told, and another simulator takes the design.

mod automatic;
mod compared;
mod misread;
mod plain;
mod running;
mod tree;

use std::path::Path;
use std::sync::Arc;

use hpu_cosim::dut::{Change, Design, Fault, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, DutScene, Registers};
use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Script, Verilog, Yosys};
use hpu_leap::{Netlist, yosys};

pub use self::compared::{Difference, Found, LeapsBeside};
use self::running::Running;
use super::build::{Model, write, write_files};
use super::fallback::wires;
use super::files::PlainName;
use super::synthesised::in_vhdl;
use super::translated::{XML, read};
use super::verilator::{Described, port, sources};
use super::{Simulators, allowed};
use crate::cost::NO_DPI;
use crate::engines::error::Error;
use crate::engines::note::note;
use crate::engines::tool::Tool;

/// The files of a built netlist: Yosys' JSON of it, its ports, notes and assertions as of a model of Verilator, and the
/// reason why there is none, if there is one.
const RESULTS: [&str; 5] = [NETLIST, PORTS, NOTES, UNCHECKED, UNFIT];
/// Version of the rules by which designs are refused. Raise it with each new one.
const RULES: &str = "7";
const NETLIST: &str = "netlist.json";
/// The JSON of Yosys before it simplifies anything.
const UNSIMPLIFIED: &str = "unsimplified.json";
const PORTS: &str = "ports";
const NOTES: &str = "notes";
const UNCHECKED: &str = "unchecked";
const UNFIT: &str = "unfit";
/// The module that sets the parameters of a design, its file, and the design in it.
const WRAPPED: &str = "hpu_parameters";
const WRAPPER: &str = "hpu_parameters.v";
const INSTANCE: &str = "hpu_design";
/// The file of a design as Verilator has read it.
const PLAIN: &str = "hpu_plain.v";

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
    /// The number of the first port that is a signal inside.
    inside: usize,
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
    /// Returns the netlist of a scene's design.
    ///
    /// # Errors
    ///
    /// When it has none, a tool is missing, or a tool refuses the design.
    pub fn netlist_of(&self, scene: &DutScene) -> Result<Arc<Netlist>, Fault> {
        allowed(&scene.dut)?;
        let prepared = self.prepared(&scene.dut)?;
        let leaping = self.leaping(&Model::of(scene, &prepared), Inside::Nothing)?;
        leaping.map(|leaping| leaping.netlist).map_err(Into::into)
    }

    /// Builds the netlist of a design, or tells why it has none.
    ///
    /// # Errors
    ///
    /// When a tool is missing, or GHDL or Verilator refuses the design.
    pub(super) fn leaping(&self, model: &Model, inside: Inside) -> Result<Result<Leaping, String>, Error> {
        let dut = model.dut;
        let is_vhdl = super::is_vhdl(&dut.files);
        if let Some(why) = unfit(dut) {
            return Ok(Err(why));
        }
        let version = |tool: Tool| Ok(format!("{} {}", tool.name(), tool.version(self.setup.timeout)?));
        let tools = [Tool::Verilator, Tool::Yosys].into_iter().chain(is_vhdl.then_some(Tool::Ghdl));
        let tools = tools.map(version).collect::<Result<Vec<_>, Error>>()?.join(", ");
        let tools = format!("netlist {RULES} by {tools}: {}; {}; {}", yosys::FLAT, yosys::ZEROS, yosys::LOWERED);
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
        let clocks: Vec<_> = dut.clocks.iter().map(|clock| (&*clock.port, clock.divide)).collect();
        let described = self.described(model, &text(PORTS)?, inside)?;
        let shows = |name: &str, width: usize| {
            let name = inner(model, name);
            let is_it = |port: &Port| name.as_ref() == Some(&port.name) && port.format.width() as usize == width;
            described.ports.iter().any(|port| port.is_inside && is_it(port))
        };
        let netlist = match yosys::read(&text(NETLIST)?, &top(dut), (&clocks, is_vhdl), shows) {
            Ok(netlist) => netlist,
            Err(why) => return Ok(Err(why.to_string().replace(&format!("{INSTANCE}."), ""))),
        };
        text(NOTES)?.lines().for_each(|told| note(told.to_string()));
        let unchecked = text(UNCHECKED)?.lines().map(str::to_string).collect();
        Ok(joined(model, netlist, described, inside).map(|design| Leaping { unchecked, ..design }))
    }

    /// Lets Yosys write the netlist of files, or tells why it does not take them. `lines` are those of the design's
    /// ports; files as they were written still have parameters.
    fn synthesise(
        &self,
        dut: &Dut,
        folder: &Path,
        (files, lines, has_parameters): (&[PlainName], &str, bool),
    ) -> Result<Result<(), String>, Error> {
        let is_vhdl = super::is_vhdl(&dut.files);
        let mut files = files.to_vec();
        if is_wrapped(dut) {
            match wrapped(dut, lines, has_parameters) {
                Ok(text) => write(folder, WRAPPER, text.as_bytes())?,
                Err(why) => return Ok(Err(why)),
            }
            files.push(PlainName::fixed(WRAPPER));
        }
        // A name that nothing declares is no net of one bit, but may be one inside of an instance.
        let files: Script<Yosys> = files.iter().map(|file| script!(Yosys: " {}", file)).collect();
        let source = script!(Yosys: "read_verilog{} -sv -noautowire -nosynthesis{}; ", NO_DPI, files);
        let own = if is_vhdl { dut.top.to_lowercase() } else { dut.top.clone() };
        let top = if is_wrapped(dut) { script!(Yosys: "{}", Fixed(WRAPPED)) } else { script!(Yosys: "{}", own) };
        let zeros = if is_vhdl { script!(Yosys: "{}; ", Fixed(yosys::ZEROS)) } else { Script::empty() };
        let (flat, lowered) = (Fixed(yosys::FLAT), Fixed(yosys::LOWERED));
        let script = script!(
            Yosys: "{}hierarchy -top {}; {}; write_json {}; {}{}; write_json {}",
            source, top, flat, Fixed(UNSIMPLIFIED), zeros, lowered, Fixed(NETLIST)
        );
        match self.yosys(dut, folder, "write a netlist", &script) {
            Ok(_) => Ok(Ok(())),
            // What Yosys does not read, another simulator may.
            Err(error) if error.tool().is_none_or(|tool| tool.refused()) => {
                Ok(Err(format!("Yosys does not take it: {}", said(&error))))
            }
            Err(error) => Err(error),
        }
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
        let texts = match is_vhdl {
            true => files.iter().map(|file| read(&folder.join(&**file))).collect::<Result<_, _>>()?,
            // Headers, and files that a design reads, count too.
            false => {
                let all = dut.files.iter().map(|(_, content)| content);
                let all = all.chain(dut.beside.iter().map(|file| &file.content));
                all.map(|content| String::from_utf8_lossy(content).into_owned()).collect::<Vec<_>>()
            }
        };
        if let Some(why) = misread::heard(&texts) {
            return Ok(Err(why));
        }
        let translated = self.translated(model, (folder, &files, &top), (!is_vhdl, true))?;
        if translated.is_timed {
            return Ok(Err("it has delays".to_string()));
        }
        // What Yosys does not read, or reads otherwise, is written out as Verilator has read it.
        let xml = if is_vhdl { String::new() } else { read(&folder.join(XML))? };
        if let Some(why) = misread::in_order(&xml) {
            return Ok(Err(why));
        }
        let otherwise =
            if is_vhdl { None } else { misread::in_text(&texts).or_else(|| misread::in_design(&xml, &texts)) };
        let read_as_written = match otherwise {
            Some(why) => Err(why),
            None => self.synthesise(dut, folder, (&files, &translated.lines, true))?,
        };
        match read_as_written {
            Ok(()) => {}
            Err(why) if is_vhdl => return Ok(Err(why)),
            Err(why) => {
                let told = |other: String| Ok(Err(format!("{why}; written out as Verilator has read it: {other}")));
                match plain::plain(&xml, &dut.top) {
                    Ok(plain) => write(folder, PLAIN, plain.as_bytes())?,
                    Err(what) => return told(format!("it has {what}, which is not known here")),
                }
                let lines = &translated.lines;
                if let Err(other) = self.synthesise(dut, folder, (&[PlainName::fixed(PLAIN)], lines, false))? {
                    return told(other);
                }
            }
        }
        match yosys::turned_shift(&read(&folder.join(UNSIMPLIFIED))?, &self::top(dut)) {
            Ok(None) => {}
            Ok(Some(place)) => {
                let place = place.rsplit('/').next().unwrap_or_default();
                let what = format!("a shift by a word of 32 bits or more, or by a negative number, at {place}");
                return Ok(Err(format!("Yosys may read it otherwise than Verilator: {what}")));
            }
            Err(why) => return Ok(Err(why.to_string())),
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
fn unfit(dut: &Dut) -> Option<String> {
    let is_random = dut.registers == Registers::Random;
    is_random.then(|| "dut.registers = \"random\" takes the random values of Verilator".to_string())
}

/// Returns the path in the design of a word inside, as users know it, from its name in the netlist.
fn inner(model: &Model, name: &str) -> Option<String> {
    match super::is_vhdl(&model.dut.files) {
        true => model.names.inside(&in_vhdl(name)),
        false if is_wrapped(model.dut) => Some(name.strip_prefix(INSTANCE)?.strip_prefix('.')?.to_string()),
        false => Some(name.to_string()),
    }
}

/// Returns whether a module around the design sets its parameters: Yosys itself would lose their signs.
fn is_wrapped(dut: &Dut) -> bool {
    !super::is_vhdl(&dut.files) && !dut.generics.is_empty()
}

/// Returns the name of the topmost module that Yosys has.
fn top(dut: &Dut) -> String {
    match super::is_vhdl(&dut.files) {
        true => dut.top.to_lowercase().to_string(),
        false if is_wrapped(dut) => WRAPPED.to_string(),
        false => dut.top.to_string(),
    }
}

/// Returns a module with the ports of a design in these lines and an instance of it, which sets its parameters; else
/// why there is none.
fn wrapped(dut: &Dut, lines: &str, has_parameters: bool) -> Result<String, String> {
    let (mut ports, mut connected) = (Vec::new(), Vec::new());
    for port in lines.lines().filter_map(port).filter(|(port, is_hidden)| !is_hidden && !port.is_inside) {
        let (name, width) = (&port.0.name, port.0.format.width());
        if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(format!("it has parameters and the port `{name}`, which is no plain word"));
        }
        let way = if port.0.is_input { "input" } else { "output" };
        ports.push(format!("{way} [{}:0] {name}", width - 1));
        connected.push(format!(".{name}({name})"));
    }
    let values = dut.generics.iter().map(|(name, value)| format!(".{name}({})", Script::<Verilog>::literal(value)));
    let values: Vec<_> = values.collect();
    let (ports, connected) = (ports.join(", "), connected.join(", "));
    let values = if has_parameters { format!("#({})", values.join(", ")) } else { String::new() };
    Ok(format!("module {WRAPPED}({ports});\n  {} {values} {INSTANCE}({connected});\nendmodule\n", dut.top))
}

/// Joins a netlist and the ports of its design, by name and width. Signals inside that the netlist has no word for are
/// hidden, and told.
fn joined(model: &Model, netlist: Netlist, described: Described, inside: Inside) -> Result<Leaping, String> {
    let (dut, is_vhdl) = (model.dut, super::is_vhdl(&model.dut.files));
    let Described { mut ports, raw, mut hidden, .. } = described;
    let same = |one: &str, other: &str| if is_vhdl { one.eq_ignore_ascii_case(other) } else { one == other };
    let own = |name: &str| if is_vhdl { in_vhdl(name) } else { name.to_string() };
    let kept: Vec<_> = netlist.outputs().iter().filter_map(|output| inner(model, &output.name)).collect();
    let lost = hidden.len();
    hidden.extend(ports.extract_if(.., |port| port.is_inside && !kept.contains(&port.name)));
    match (&hidden[lost..], inside) {
        ([], _) => {}
        ([first, ..], Inside::Chosen(_)) => {
            return Err(format!("`{}` is to be shown, and its netlist has no such signal", first.name));
        }
        (lost, _) => note(format!(
            "{} of {} signals inside `{}` are not shown, because its netlist leaves out what reaches no output; \
             dut.engine = \"verilator\" shows them",
            lost.len(),
            ports.iter().filter(|port| port.is_inside).count() + lost.len(),
            dut.top
        )),
    }
    let numbered: Vec<_> = wires(dut, &ports).into_iter().map(|port| port.name.clone()).collect();
    // The name of a port as tools have it, and its number in a request.
    let number = |name: &str, width: u8, is_input: bool| {
        let at = raw.iter().position(|raw| same(raw, &own(name)));
        let at = at.filter(|at| ports.get(*at).is_some_and(|port| !port.is_inside));
        let named = inner(model, name);
        let at = at.or_else(|| ports.iter().position(|port| port.is_inside && named.as_ref() == Some(&port.name)))?;
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
        inside: all.iter().filter(|port| !port.is_inside).count(),
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
