//! A design simulated by Verilator: Verilog as it is, VHDL through GHDL's synthesis.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{self, Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use hpu_cosim::dut::{Change, Design, Fault, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, Registers};

use super::build::{Built, Model, write, write_files};
use super::declared::{self, Kind};
use super::files::{PlainName, plain_names};
use super::process::{ANSWER, Process};
use super::program::main_cpp;
use super::said::{Ears, Form, errors, without};
use super::synthesised::SYNTHESISED;
use super::text::cpp::state;
use super::translated::{FLAGS, ROOT, TAKEN, Translated, parameters, read};
use super::{Simulators, of_tool, with_reason};
use crate::engines::entry::key;
use crate::engines::error::Error;
use crate::engines::note::note;
use crate::engines::sealed;
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Tool, run};

/// The file that lists the ports of a built model.
const PORTS: &str = "ports";
/// The file with the notes about how a model was built, one a line.
const NOTES: &str = "notes";
/// The program into which a model is compiled.
const MODEL: &str = "obj/model";
/// The parts of Verilator that every model has, compiled.
const RUNTIME: [&str; 2] = ["verilated.o", "verilated_threads.o"];
/// How the compiler treats what is computed at clock edges, what is computed once, and the parts that every model has.
const LEVELS: [&str; 3] = ["OPT_FAST=-O3", "OPT_SLOW=-O1", "OPT_GLOBAL=-O1"];
/// The functions of `main.cpp` that take what the design says, and its end.
const PRINT: (&str, &str) = (
    "hpu_print.h",
    "int hpu_print(const char* format, ...);\nvoid vl_stop_maybe(const char* file, int line, const char*, bool);\n",
);
/// The file with the assertions that a built model does not check.
const UNCHECKED: &str = "unchecked";

/// A design that was built.
pub(super) struct Verilated {
    built: Built,
    ports: Vec<Port>,
    /// Whether it reads files, which are in the folder of the built model.
    reads_files: bool,
    hidden: Vec<Port>,
    /// The places of the signals inside that are shown, among all that the model has.
    chosen: Vec<usize>,
    is_vhdl: bool,
    engine: String,
    registers: Registers,
    seed: u64,
    limit: Duration,
    dut: Dut,
    unchecked: Vec<String>,
}

impl Verilated {
    /// Tells in the simulator's name why the design does not leap, if there is a reason.
    pub(super) fn without_leaps(self, why: Option<&str>) -> Self {
        let engine = why.map(|why| with_reason(&self.engine, &format!("no leaps: {why}")));
        Self { engine: engine.unwrap_or(self.engine), ..self }
    }
}

/// The ports and signals of a design, as its sources describe them.
pub(super) struct Described {
    /// The ports, then the signals inside that are shown.
    pub(super) ports: Vec<Port>,
    /// The names of the ports, then of all signals inside, as tools have them.
    pub(super) raw: Vec<String>,
    /// Signals inside that are not shown.
    pub(super) hidden: Vec<Port>,
    /// The places of the signals inside that are shown, among all that there are.
    chosen: Vec<usize>,
}

impl Simulators {
    pub(super) fn verilator(&self, model: &Model, inside: Inside) -> Result<Verilated, Error> {
        let dut = model.dut;
        let is_vhdl = super::is_vhdl(&dut.files);
        let version = format!("Verilator {}", Tool::Verilator.version(self.setup.timeout)?);
        let tools = if is_vhdl {
            format!("{version}, of the Verilog of GHDL {}'s synthesis", Tool::Ghdl.version(self.setup.timeout)?)
        } else {
            version
        };
        let kind = if inside.is_any() { format!("{tools}, with its inside") } else { tools.clone() };
        let built = self.built(model, &kind, &[MODEL, PORTS, NOTES, UNCHECKED], |folder| {
            write_files(dut, folder)?;
            let (sources, top, unchecked) = if is_vhdl {
                let (sources, unchecked) = self.synthesised_with_assertions(dut, folder)?;
                (sources, dut.top.to_lowercase(), unchecked)
            } else {
                (sources(dut), dut.top.clone(), self.without_unread(dut, folder)?)
            };
            write(folder, UNCHECKED, unchecked.join("\n").as_bytes())?;
            self.verilate(model, (folder, &sources, &top), (!is_vhdl, inside.is_any()))
        })?;
        read(&built.path.join(NOTES))?.lines().for_each(|told| note(told.to_string()));
        let unchecked = read(&built.path.join(UNCHECKED))?.lines().map(str::to_string).collect();
        let Described { ports, hidden, chosen, .. } = self.described(model, &read(&built.path.join(PORTS))?, inside)?;
        let (registers, seed) = (dut.registers, model.seed);
        let engine = match registers {
            Registers::Unknown => tools,
            Registers::Zero => format!("{tools}; registers that nothing sets begin at 0"),
            Registers::Random => format!("{tools}; registers that nothing sets begin at random, by run.seed = {seed}"),
        };
        let limit = self.setup.timeout.unwrap_or(ANSWER);
        let (dut, reads_files) = (dut.clone(), reads_files(dut));
        Ok(Verilated {
            built,
            ports,
            hidden,
            chosen,
            reads_files,
            is_vhdl,
            engine,
            registers,
            seed,
            limit,
            dut,
            unchecked,
        })
    }

    /// Describes the ports and signals that the `lines` of a file [`PORTS`] have.
    pub(super) fn described(&self, model: &Model, lines: &str, inside: Inside) -> Result<Described, Error> {
        let (hidden, mut ports): (Vec<_>, Vec<_>) = lines.lines().filter_map(port).partition(|(_, hidden)| *hidden);
        let raw: Vec<_> = ports.iter().map(|(port, _)| port.name.clone()).collect();
        let mut hidden: Vec<_> = hidden.into_iter().map(|(port, _)| port).collect();
        for (port, _) in &mut ports {
            if let Some(word) = model.names.word(&port.name) {
                port.name.clone_from(&word.shown);
                if let Some(layout) = &word.layout {
                    port.layout = layout.clone();
                }
            }
        }
        if super::is_vhdl(&model.dut.files) {
            // Synthesis knows only bits; the sources know what they stand for.
            let (elaborated, declared) = self.declared_in_vhdl(model)?;
            for (port, _) in &mut ports {
                match elaborated.iter().find(|same| same.name.eq_ignore_ascii_case(&port.name)) {
                    Some(same) if same.format.width() == port.format.width() => {
                        (port.format, port.is_quantity) = (same.format, same.is_quantity);
                        port.default = same.default;
                    }
                    _ => declared.describe(port),
                }
            }
            let known = ports.iter().map(|(port, _)| port.clone()).chain(elaborated);
            hidden = declared.hidden(&known.collect::<Vec<_>>());
        }
        let (mut shown, mut chosen, mut place) = (Vec::new(), Vec::new(), 0);
        for (port, _) in ports {
            let is_inside = port.is_inside;
            if is_inside && !inside.shows(&port.name) {
                hidden.push(port);
            } else {
                chosen.extend(is_inside.then_some(place));
                shown.push(port);
            }
            place += usize::from(is_inside);
        }
        Ok(Described { ports: shown, raw, hidden, chosen })
    }

    /// Takes concurrent assertions that Verilator does not read out of the files in a folder. Returns them, with their
    /// places.
    fn without_unread(&self, dut: &Dut, folder: &Path) -> Result<Vec<String>, Error> {
        let mut unread = Vec::new();
        if !dut.files.iter().any(|(_, content)| String::from_utf8_lossy(content).contains("property")) {
            return Ok(unread);
        }
        // A property that is taken out makes the assertions of it wrong, too.
        for _ in 0..8 {
            let mut command = Command::new(Tool::Verilator.name());
            command.current_dir(folder).args(["--lint-only", "--assert", "-Wno-lint", "-Wno-style", "-Wno-fatal"]);
            command.args(TAKEN).args(["--no-timing", "-I.", "--top-module", &dut.top]);
            command.args(parameters(dut)).args(sources(dut));
            let Err(error) = run(Tool::Verilator, "read a design", command, self.limit()) else { break };
            let mut lines: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
            errors(&error.said).for_each(|(file, line)| lines.entry(file).or_default().push(line));
            let names = plain_names(dut);
            let before = unread.len();
            for (plain, own) in &names {
                let Some(lines) = lines.get(&**plain) else { continue };
                let Some((text, taken)) = without(&read(&folder.join(&**plain))?, lines) else { continue };
                write(folder, plain, text.as_bytes())?;
                let why = "Verilator does not read this concurrent assertion";
                unread.extend(taken.into_iter().map(|(line, what)| format!("{own}:{line}: {why}: {what}")));
            }
            if unread.len() == before {
                break;
            }
        }
        Ok(unread)
    }

    /// Returns the ports of a design in Verilog, of which no program is made.
    pub(super) fn ports_of_verilog(&self, model: &Model) -> Result<Vec<Port>, Error> {
        Tool::Verilator.version(self.setup.timeout)?;
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        write_files(model.dut, folder.path())?;
        let design = (folder.path(), &sources(model.dut)[..], &*model.dut.top);
        let lines = self.translated(model, design, (true, false))?.lines;
        Ok(lines.lines().filter_map(port).filter(|(_, is_hidden)| !is_hidden).map(|(port, _)| port).collect())
    }

    /// Compiles Verilog to a program.
    fn verilate(
        &self,
        model: &Model,
        (folder, sources, top): (&Path, &[PlainName], &str),
        made: (bool, bool),
    ) -> Result<(), Error> {
        let dut = model.dut;
        let say = |error| of_tool(dut, error);
        let Translated { fields, lines, is_timed, notes } = self.translated(model, (folder, sources, top), made)?;
        let mut state = state(&read(&folder.join(ROOT))?);
        // Models whose state is not in one structure cannot be compared, so they are clocked side by side to the end.
        // The same holds for models that wait for a time of their own.
        state.makes_up |= is_timed || !is_flat(&folder.join("obj"));
        write(folder, PRINT.0, PRINT.1.as_bytes())?;
        let synthesised = if super::is_vhdl(&dut.files) { read(&folder.join(SYNTHESISED))? } else { String::new() };
        write(folder, "main.cpp", main_cpp(model, &fields, &state, is_timed, &synthesised).as_bytes())?;
        write(folder, NOTES, notes.as_bytes())?;
        let make = || {
            let mut make = Command::new("make");
            make.current_dir(folder).args(["-s", "-C", "obj", "-f", "Vdut.mk", "model"]).args(LEVELS);
            // The program around the model is compiled as one of the model's files, together with them: most of the
            // compiler's time goes into the headers, which it then reads once.
            make.arg("VM_USER_CLASSES=").env("VM_SUPPORT_FAST", "../main");
            // Verilator's makefile refuses a folder with a space by its absolute path. Ours has relative ones alone.
            make.arg("CURDIR=.");
            run(Tool::Verilator, "compile a design with make and g++", make, self.limit()).map_err(say)
        };
        let (objects, kept) = (folder.join("obj"), self.runtime()?);
        let lent = || RUNTIME.iter().all(|part| fs::copy(kept.join(part), objects.join(part)).is_ok());
        // Parts that know delays are compiled otherwise.
        let is_lent = !is_timed && sealed::holds(&kept, &RUNTIME) && lent();
        if !is_lent || make().is_err() {
            // Kept parts may be damaged, so the next attempt is without them.
            for part in RUNTIME.iter().flat_map(|part| [objects.join(part), kept.join(part)]) {
                let _ = fs::remove_file(part);
            }
            make()?;
            if !is_timed {
                self.keep(&objects, &kept);
            }
        }
        write(folder, PORTS, lines.as_bytes())
    }

    /// Returns the folder in the cache that keeps the parts of Verilator that every model has. Compiling them takes as
    /// long as a small design does.
    fn runtime(&self) -> Result<PathBuf, Error> {
        let version = Tool::Verilator.version(self.setup.timeout)?;
        let cache = self.cache.path().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        Ok(cache.join(format!("runtime-{}", key(&[&[&version, FLAGS], LEVELS.as_slice()].concat()))))
    }

    /// Keeps the parts that every model has for the next design. Where this fails, they are compiled again then.
    fn keep(&self, objects: &Path, kept: &Path) {
        let parts = || -> io::Result<Temporary> {
            let made = Temporary::folder_in(self.cache.path()?)?;
            for part in RUNTIME {
                fs::copy(objects.join(part), made.path().join(part))?;
            }
            sealed::seal(made.path(), &RUNTIME, "parts of Verilator that every model has")?;
            Ok(made)
        };
        if let Ok(made) = parts() {
            sealed::place(made, kept, &RUNTIME);
        }
    }
}

/// Returns the files that are compiled. Headers are read where they are included.
pub(super) fn sources(dut: &Dut) -> Vec<PlainName> {
    let names = plain_names(dut).into_iter().map(|(name, _)| name);
    let is_compiled = |name: &PlainName| {
        let name = name.to_ascii_lowercase();
        name.ends_with(".v") || name.ends_with(".sv")
    };
    names.filter(is_compiled).collect()
}

/// Returns whether a design reads files while it runs, such as the data of a memory.
fn reads_files(dut: &Dut) -> bool {
    let names_one = |content: &[u8]| content.windows(b"$readmem".len()).any(|word| word == b"$readmem");
    !dut.beside.is_empty() || dut.files.iter().any(|(_, content)| names_one(content))
}

/// Reads a port or a signal inside from its line, and whether it is hidden.
pub(super) fn port(line: &str) -> Option<(Port, bool)> {
    let [name, way, format, kind, layout] = line.split(' ').collect::<Vec<_>>().try_into().ok()?;
    let kind = Kind { format: format.parse().ok()?, is_quantity: kind == "number" };
    let is_inside = ["inside", "hidden"].contains(&way);
    let layout = layout.parse().ok()?;
    let port = Port { is_input: way == "in", is_inside, layout, ..declared::inside(name.to_string(), kind) };
    Some((port, way == "hidden"))
}

/// Returns whether Verilator has put the whole design into one structure.
fn is_flat(folder: &Path) -> bool {
    let known = ["Vdut___024root.h", "Vdut___024unit.h", "Vdut__Syms.h", "Vdut__Dpi.h", "Vdut__pch.h"];
    let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let mut classes =
        names.filter(|name| name.to_str().is_some_and(|name| name.starts_with("Vdut_") && name.ends_with(".h")));
    classes.all(|name| known.iter().any(|known| name == *known))
}

impl Design for Verilated {
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
        let folder = path::absolute(&self.built.path).map_err(|error| Error::io(&self.built.path, error))?;
        let mut command = Command::new(folder.join(MODEL));
        command.args([self.registers.name(), &self.seed.to_string()]);
        if self.reads_files {
            command.current_dir(folder);
        }
        command.args(self.chosen.iter().map(usize::to_string));
        let ears = Ears::new(Form::Verilator, &self.dut, self.unchecked.clone());
        let process = Process::start(Tool::Verilator, command, (self.limit, Some(ears)), (words, drives), changes)?;
        Ok(Box::new(process))
    }
}
