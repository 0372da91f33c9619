//! A design simulated by GHDL: its files as they are, in a bench that talks to hpu through VHPIDIRECT.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use hpu_cosim::dut::{self, Change, Design, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, Identifier, Standard};
use hpu_signal::Format;
use hpu_vhpi::{ASK, INSIDE, LIST};

use super::build::{Model, carries_clock, common_cycle, write, write_files};
use super::declared::{self, Declared, Kind};
use super::files::{PlainName, plain_names};
use super::process::{ANSWER, Process};
use super::said::{Ears, Form};
use super::vhdl::{Interface, Item, Types, entities, interface, value};
use super::{Simulators, allowed, of_tool, refuses};
use crate::engines::error::Error;
use crate::engines::ghdl::writes_programs;
use crate::engines::library::{LIBRARY, place_library};
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Fault, Tool, run};

/// The bench's entity, and the package through which it talks to hpu.
const BENCH: &str = "hpu_dut_bench";
const BRIDGE: &str = hpu_assets::text("testbench/vhdl/hpu_dut_bridge.vhd");

/// The files of bridge and bench. They lie in a folder of their own, so that a design's file may have any name.
const OWN: [&str; 2] = ["hpu/hpu_dut_bridge.vhd", "hpu/hpu_dut_bench.vhd"];

/// A design that GHDL has analysed.
pub(super) struct Analysed {
    folder: Temporary,
    dut: Dut,
    ports: Vec<Port>,
    hidden: Vec<Port>,
    engine: String,
    limit: Duration,
    inside: bool,
    form: Form,
}

impl Simulators {
    /// Analyses a design for simulation in GHDL, with these inner signals. `why` is added to the name of the engine.
    pub(super) fn ghdl(&self, model: &Model, why: &str, inside: Inside) -> Result<Analysed, Error> {
        let version = Tool::Ghdl.version(self.setup.timeout)?;
        let (folder, ports, declared) = self.elaborated(model, inside)?;
        let engine = format!("GHDL {version}{why}");
        let limit = self.setup.timeout.unwrap_or(ANSWER);
        let form = Form::Ghdl { half_fs: half_fs(model), settle: model.settle };
        let (hidden, inside) = (declared.hidden(&ports), inside.is_any());
        Ok(Analysed { folder, dut: model.dut.clone(), ports, hidden, engine, limit, inside, form })
    }

    /// Returns the signals of a design in VHDL with their types, as GHDL elaborates it.
    pub(super) fn declared_in_vhdl(&self, model: &Model) -> Result<(Vec<Port>, Declared), Error> {
        self.elaborated(model, Inside::Nothing).map(|(_, ports, declared)| (ports, declared))
    }

    /// Analyses a design with its bench. Asks the bench for the design's ports, and GHDL for the types of all signals.
    fn elaborated(&self, model: &Model, inside: Inside) -> Result<(Temporary, Vec<Port>, Declared), Error> {
        let dut = model.dut;
        // The elaboration of VHDL runs its functions.
        allowed(dut)?;
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        write_files(dut, folder.path())?;
        self.analyse(dut, folder.path())?;
        let texts: Vec<_> = dut.files.iter().map(|(_, content)| String::from_utf8_lossy(content)).collect();
        let texts: Vec<_> = texts.iter().map(|text| &**text).collect();
        let refused = |said: String| refuses(Tool::Ghdl, dut, said);
        let interface = interface(&texts, &dut.top).ok_or_else(|| {
            let all = entities(&texts);
            refused(format!("no file declares the entity `{}`; there are {}", dut.top, all.join(", ")))
        })?;
        let bench = bench(BENCH, model, &interface)?;
        write(folder.path(), OWN[0], bridge(dut.standard).as_bytes())?;
        write(folder.path(), OWN[1], bench.as_bytes())?;
        let mut command = self.ghdl_command("-a", dut, folder.path());
        command.args(OWN);
        let say = |error| of_tool(dut, error);
        run(Tool::Ghdl, "connect a design", command, self.limit()).map_err(say)?;
        place_library(folder.path()).map_err(Error::ended)?;
        if writes_programs(self.limit()) {
            let mut command = self.ghdl_command("-e", dut, folder.path());
            command.arg(BENCH);
            run(Tool::Ghdl, "elaborate a design", command, self.limit()).map_err(say)?;
        }
        let ask = |with_types: bool| {
            let mut command = simulate(dut.standard, folder.path(), BENCH);
            command.args(with_types.then_some("--dump-rti")).env(ASK, "");
            if inside.is_any() {
                show_inside(&mut command);
            }
            run(Tool::Ghdl, "tell its ports", command, self.limit())
        };
        // GHDL describes all initial values too, which are many where a design has a large memory.
        let said = match ask(true) {
            Err(error) if matches!(error.fault, Fault::Flooded) => ask(false),
            said => said,
        };
        let said = said.map_err(say)?;
        let declared = declared::of_rti(&said.out).around(model.names);
        let told = || said.out.lines().filter_map(|line| line.strip_prefix("PORT "));
        for (told, Item { name, kind, .. }) in told().zip(&interface.ports) {
            let why = match told.split(' ').next().and_then(|width| width.parse::<u64>().ok()) {
                Some(0) => format!("port `{name}` is of the type {kind}, which has no bits here"),
                Some(width) if width > 64 => format!("port `{name}` has {width} bits; hpu takes ports of at most 64"),
                _ => continue,
            };
            return Err(Error::port(name, why));
        }
        let told: Vec<(Format, bool)> = told().filter_map(format).collect();
        let ports = interface.ports.iter().zip(&told);
        let mut ports: Vec<_> = ports
            .map(|(item, &(format, is_number))| {
                let word = model.names.word(&item.name);
                let name = word.map_or(&item.name, |word| &word.shown).clone();
                let kind = Kind { format: word.and_then(|word| word.format).unwrap_or(format), is_quantity: is_number };
                let port = declared::inside(name, kind);
                let layout = word.and_then(|word| word.layout.clone()).unwrap_or_else(|| port.layout.clone());
                let default = item.default.as_ref().and_then(|text| literal(text, format));
                Port { is_input: item.mode == "in", is_inside: false, is_number, layout, default, ..port }
            })
            .collect();
        if told.len() != interface.ports.len() {
            return Err(refused(format!("it did not tell its ports:\n{}{}", said.out, said.err)));
        }
        if inside.is_any() {
            let (list, inner) = inner(model, &interface, inside, &said.out);
            ports.extend(inner);
            write(folder.path(), LIST, list.as_bytes())?;
        }
        ports.iter_mut().for_each(|port| declared.describe(port));
        Ok((folder, ports, declared))
    }

    /// Analyses the design's own files.
    pub(super) fn analyse(&self, dut: &Dut, folder: &Path) -> Result<(), Error> {
        let names = plain_names(dut);
        let library = |file: &str| {
            let other = dut.libraries.iter().find(|(name, _)| name == file);
            other.map_or(&dut.library, |(_, library)| library)
        };
        let files: Vec<(&Identifier, &PlainName)> =
            dut.files.iter().zip(&names).map(|((file, _), (name, _))| (library(file), name)).collect();
        for part in files.chunk_by(|(one, _), (two, _)| one == two) {
            let mut command = self.ghdl_command("-a", dut, folder);
            command.arg(format!("--work={}", part[0].0)).args(part.iter().map(|(_, name)| name));
            run(Tool::Ghdl, "analyse a design", command, self.limit()).map_err(|error| of_tool(dut, error))?;
        }
        Ok(())
    }

    pub(super) fn ghdl_command(&self, verb: &str, dut: &Dut, folder: &Path) -> Command {
        let mut command = Command::new(Tool::Ghdl.name());
        // Much code in use takes its arithmetic from Synopsys's packages.
        command.args([verb, standard(dut.standard), "-fsynopsys", "-Wno-hide", "-Wno-library"]).current_dir(folder);
        command
    }
}

fn standard(standard: Standard) -> &'static str {
    match standard {
        Standard::Vhdl93 => "--std=93",
        Standard::Vhdl2008 => "--std=08",
    }
}

/// Returns the command that runs a bench, which is elaborated where GHDL then [writes a program](writes_programs).
pub(crate) fn simulate(of: Standard, folder: &Path, bench: &str) -> Command {
    let mut command = Command::new(Tool::Ghdl.name());
    command.args(["-r", standard(of), "-fsynopsys", "-Wno-hide", bench]).current_dir(folder);
    command
}

/// Makes a run report the signals inside the design.
fn show_inside(run: &mut Command) {
    // GHDL keeps the names of types only when a VPI library is loaded.
    run.arg(format!("--vpi=./{LIBRARY}")).env(INSIDE, "");
}

/// Reads a port from the line that its bench prints of it: its format, and whether it is a number.
fn format(told: &str) -> Option<(Format, bool)> {
    let (width, kind) = told.split_once(' ')?;
    let width = width.parse().ok().filter(|width| (1..=64).contains(width))?;
    let format = if kind != "unsigned" && width > 1 { Format::signed(width) } else { Format::unsigned(width) };
    Some((format, kind == "number"))
}

/// Returns the word of a literal of VHDL that is the default of a port.
fn literal(text: &str, format: Format) -> Option<i64> {
    let text = text.to_lowercase().replace([' ', '_'], "");
    let bits = |digits: &str, radix: u32| u64::from_str_radix(digits, radix).ok().map(|bits| format.from_bits(bits));
    let inside = |open: &str| text.strip_prefix(open)?.strip_suffix('"');
    match &*text {
        "'0'" | "false" | "(others=>'0')" => Some(0),
        "'1'" | "true" => Some(1),
        "(others=>'1')" => Some(format.from_bits(u64::MAX >> (64 - format.width()))),
        _ => inside("\"").or_else(|| inside("b\"")).and_then(|digits| bits(digits, 2)).or_else(|| {
            inside("x\"").and_then(|digits| bits(digits, 16)).or_else(|| {
                let word = text.parse().ok()?;
                format.holds(i128::from(word)).then_some(word)
            })
        }),
    }
}

/// Returns half of a cycle of the fastest clock, in femtoseconds.
fn half_fs(model: &Model) -> u64 {
    (0.5e15 / model.clock.frequency_hz() as f64).round().max(1.0) as u64
}

fn has(items: &[Item], name: &str) -> bool {
    items.iter().any(|item| item.name.eq_ignore_ascii_case(name))
}

/// Returns the bridge's package for a standard. Since VHDL-2008, vectors of resolved and of unresolved bits are one
/// type, so the lines marked `-- only 93` are left out there.
pub(crate) fn bridge(standard: Standard) -> String {
    let (mut text, mut skips) = (String::new(), false);
    for line in BRIDGE.lines() {
        match line.trim() {
            "-- only 93" => skips = standard == Standard::Vhdl2008,
            "-- end" => skips = false,
            _ if skips => {}
            _ => text += &format!("{line}\n"),
        }
    }
    text
}

/// Returns the list of the signals inside a design that are shown, a line each, and the signals.
fn inner(model: &Model, interface: &Interface, inside: Inside, said: &str) -> (String, Vec<Port>) {
    let (mut list, mut ports) = (String::new(), Vec::new());
    for (name, kind) in said.lines().filter_map(|line| line.strip_prefix("INSIDE ")?.split_once(' ')) {
        let is_shown = !has(&interface.ports, name) && !carries_clock(model.dut, name);
        let inner = model.names.inside(name).filter(|inner| is_shown && inside.shows(inner));
        if let Some((inner, (format, is_number))) = inner.zip(format(kind)) {
            list += &format!("{name}\n");
            let kind = Kind { format, is_quantity: is_number };
            ports.push(Port { is_number, ..declared::inside(inner, kind) });
        }
    }
    (list, ports)
}

/// Returns the bench, an entity called `name`. It has a signal for each port, of the port's own type. The ports other
/// than clocks and reset are written and read by their position in the list.
pub(crate) fn bench(name: &str, model: &Model, interface: &Interface) -> Result<String, Error> {
    let dut = model.dut;
    let constants = constants(dut, interface)?;
    let Wires { signals, map, kinds, gives, tells } = Wires::new(dut, interface);
    let signal = |port: &str| {
        let index = interface.ports.iter().position(|item| same(&item.name, port));
        // A port that does not exist is refused once all ports are known.
        index.map(|index| format!("hpu_{index}"))
    };
    let common = common_cycle(dut);
    let clocks: Vec<_> = dut.clocks.iter().filter_map(|clock| Some((signal(&clock.port)?, clock.divide))).collect();
    let levels = |indent: &str, rises: bool| levels(&clocks, common, indent, rises);
    // Half a cycle is written out, because GHDL takes longer for a procedure that waits.
    let half_cycle = |indent: &str, rises: bool| levels(indent, rises) + &format!("{indent}wait for HALF_PERIOD;\n");
    let (mut active, mut passive) = (String::new(), String::new());
    if let Some((reset, signal)) = dut.reset.as_ref().and_then(|reset| Some((reset, signal(&reset.port)?))) {
        let level = |high: bool| if high { "'1'" } else { "'0'" };
        active = format!("    {signal} <= {};\n", level(!reset.active_low));
        passive = format!("    {signal} <= {};\n", level(reset.active_low));
    }
    let generic_map = generic_map(dut, interface);
    let settle = model.settle;
    let half_fs = half_fs(model);
    let library = if same(&dut.library, "work") { String::new() } else { format!("library {};\n", dut.library) };
    Ok(format!(
        "{library}{context}use work.hpu_dut_bridge.all;

entity {name} is
end entity;

library ieee;
use ieee.std_logic_1164.all;

architecture test of {name} is
{constants}{signals}begin

  dut : entity {of}.{top}{generic_map} port map ({map});

{tells}
  process
    constant HALF_PERIOD : time := {half_fs} fs;
{half}    variable edges       : integer;
  begin
    if hpu_dut_asks /= 0 then
{kinds}      wait;
    end if;
    if hpu_dut_open /= 0 then
{gives}    end if;
{passive}{low}{active}    wait for HALF_PERIOD;
    for cycle in 1 to {settle} loop
{settling}    end loop;
{passive}    wait for HALF_PERIOD;
{again}    hpu_dut_reset;
    loop
      edges := hpu_dut_next;
      exit when edges < 0;
      for cycle in 1 to edges loop
{falls}        if cycle = 1 then
          wait for HALF_PERIOD / 2;
{gives}          wait for HALF_PERIOD - HALF_PERIOD / 2;
        else
          wait for HALF_PERIOD;
        end if;
{rises}        wait for HALF_PERIOD;
        exit when hpu_dut_edge /= 0;
      end loop;
    end loop;
    wait;
  end process;

end architecture;
",
        context = interface.context,
        of = dut.library,
        top = dut.top,
        map = map.join(", "),
        // With a single clock, nothing is counted.
        half = match common {
            1 => String::new(),
            _ => format!("    variable half        : natural := {};\n", 2 * common - 2),
        },
        // The clocks are low already when they fall for the first time in the loop.
        again = match common {
            1 => String::new(),
            _ => format!("    half := {};\n", 2 * common - 2),
        },
        low = half_cycle("    ", false),
        settling = half_cycle("      ", true) + &half_cycle("      ", false),
        falls = levels("        ", false),
        rises = levels("        ", true),
    ))
}

fn same(one: &str, two: &str) -> bool {
    one.eq_ignore_ascii_case(two)
}

/// Returns the constants of a test bench: the generics that have a value.
fn constants(dut: &Dut, interface: &Interface) -> Result<String, Error> {
    let mut constants = String::new();
    for generic in &interface.generics {
        let set = dut.generics.iter().find(|(name, _)| same(name, &generic.name));
        let value = match set {
            Some((name, given)) => {
                let value = value(&generic.kind, &Types::default(), given);
                value.map_err(|why| Error::generic(name, why))?.to_string()
            }
            None => generic.default.clone().unwrap_or_default(),
        };
        if !value.is_empty() {
            let _ = writeln!(constants, "  constant {} : {} := {value};", generic.name, generic.kind);
        }
    }
    Ok(constants)
}

/// Returns the generic map of these constants.
fn generic_map(dut: &Dut, interface: &Interface) -> String {
    let has_value =
        |generic: &&Item| generic.default.is_some() || dut.generics.iter().any(|(name, _)| same(name, &generic.name));
    let all = interface.generics.iter().filter(has_value);
    let all: Vec<_> = all.map(|generic| format!("{0} => {0}", generic.name)).collect();
    if all.is_empty() { String::new() } else { format!(" generic map ({})", all.join(", ")) }
}

/// The lines of a test bench about its ports.
#[derive(Default)]
struct Wires {
    signals: String,
    map: Vec<String>,
    kinds: String,
    gives: String,
    tells: String,
}

impl Wires {
    fn new(dut: &Dut, interface: &Interface) -> Self {
        let is_timing = |name: &str| {
            let is_reset = dut.reset.iter().any(|reset| same(&reset.port, name));
            is_reset || dut.clocks.iter().any(|clock| same(&clock.port, name))
        };
        let (mut wires, mut wire) = (Self::default(), 0);
        for (index, port) in interface.ports.iter().enumerate() {
            let signal = format!("hpu_{index}");
            // An initial value, as an unconnected input has it, would hide that nothing drives the signal.
            let _ = writeln!(wires.signals, "  signal {signal} : {};", port.kind);
            wires.map.push(format!("{} => {signal}", port.name));
            let _ = writeln!(wires.kinds, "      hpu_dut_kind({signal});");
            if is_timing(&port.name) {
                continue;
            }
            let _ = match port.mode.as_str() {
                "in" => writeln!(wires.gives, "      hpu_dut_give({signal}, {wire});"),
                _ => writeln!(wires.tells, "  hpu_dut_tell({wire}, {signal});"),
            };
            wire += 1;
        }
        wires
    }
}

/// Returns the levels of the clocks, each a signal and its divisor, in the next half of a cycle of the fastest one.
fn levels(clocks: &[(String, u32)], common: u64, indent: &str, rises: bool) -> String {
    let mut text = String::new();
    if common > 1 {
        let _ = writeln!(text, "{indent}half := (half + 1) mod {};", 2 * common);
    }
    for (signal, divide) in clocks {
        let _ = match common {
            1 => writeln!(text, "{indent}{signal} <= '{}';", u8::from(rises)),
            _ => writeln!(
                text,
                "{indent}if half mod {} < {divide} then {signal} <= '1'; else {signal} <= '0'; end if;",
                2 * divide
            ),
        };
    }
    text
}

impl Design for Analysed {
    fn ports(&self) -> &[Port] {
        &self.ports
    }

    fn hidden(&self) -> &[Port] {
        &self.hidden
    }

    fn ignores_case(&self) -> bool {
        true
    }

    fn engine(&self) -> &str {
        &self.engine
    }

    fn start(
        &self,
        words: &[u64],
        drives: &[bool],
        changes: &mut Vec<Change>,
    ) -> Result<Box<dyn RunningDesign>, dut::Fault> {
        let mut command = simulate(self.dut.standard, self.folder.path(), BENCH);
        // Words are unknown before the reset. The words that reach the device are checked anyway.
        command.arg("--ieee-asserts=disable-at-0");
        if self.inside {
            show_inside(&mut command);
        }
        let ears = Ears::new(self.form, &self.dut, Vec::new());
        let process = Process::start(Tool::Ghdl, command, (self.limit, Some(ears)), (words, drives), changes)?;
        Ok(Box::new(process))
    }
}
