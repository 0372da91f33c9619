//! A design simulated by Verilator: Verilog as it is, VHDL through GHDL's synthesis.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{self, Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use hpu_cosim::dut::{Change, Design, Fault, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, Generic, Identifier, Registers};
use hpu_cosim::script::{Script, Verilog};
use hpu_signal::{Clock, Format};

use super::build::{Built, Model, PROGRAM, carries_clock, common_cycle, write, write_files};
use super::clocks::derived;
use super::declared::{self, Declared, Kind};
use super::files::{PlainName, plain_names};
use super::process::{ANSWER, Process, UNSET};
use super::said::{Ears, Form, errors, fatal, told, with_reports_asserted, without};
use super::text::delay::{first, left_out};
use super::text::verilog::{Dropped, TIMESCALE, mixed, waits};
use super::vhdl::with_operands;
use super::{Simulators, of_tool, refuses, with_reason};
use crate::cost::verilog::{UNTOLD, repaired};
use crate::engines::entry::key;
use crate::engines::error::Error;
use crate::engines::note::note;
use crate::engines::sealed;
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Said, Tool, run};

/// The file that lists the ports of a built model.
const PORTS: &str = "ports";
/// The file with the notes about how a model was built, one a line.
const NOTES: &str = "notes";
/// The C++ of the whole design's state.
const ROOT: &str = "obj/Vdut___024root.h";
/// The program into which a model is compiled.
const MODEL: &str = "obj/model";
/// The parts of Verilator that every model has, compiled.
const RUNTIME: [&str; 2] = ["verilated.o", "verilated_threads.o"];
/// How the compiler treats what is computed at clock edges, what is computed once, and the parts that every model has.
const LEVELS: [&str; 3] = ["OPT_FAST=-O3", "OPT_SLOW=-O1", "OPT_GLOBAL=-O1"];
/// An endless loop has to hang, so that it is noticed. The compiler must not remove it. What the design says goes to
/// `main.cpp`, and so does its end.
const FLAGS: &str = "-std=c++17 -O3 -fno-finite-loops -DVL_USER_FINISH -DVL_USER_WARN -DVL_USER_STOP_MAYBE \
                     -DVL_USER_FATAL -DVL_PRINTF=hpu_print -include ../hpu_print.h";
/// Verilog of the field's practice that Verilator takes for a mistake: blocking and non-blocking assignments of one
/// register, as in a reset of their own.
const TAKEN: [&str; 2] = ["-Wno-BLKANDNBLK", "-Wno-ENUMVALUE"];
/// Delays are left out, and told.
const WITHOUT_DELAYS: [&str; 5] = ["--no-timing", "-Wwarn-ASSIGNDLY", "-Wwarn-STMTDLY", "--timescale", TIMESCALE];
/// Delays are simulated, by coroutines of C++20.
const WITH_DELAYS: [&str; 5] = ["--timing", "--timescale", TIMESCALE, "-CFLAGS", "-std=c++20"];
/// Files `.v` are Verilog of 2005, in which keywords of SystemVerilog are names.
const OF_2005: &str = "+1364-2005ext+v";
/// The step from VHDL to Verilog.
pub(super) const SYNTHESIS: &str = "synthesise a design";
/// The functions of `main.cpp` that take what the design says, and its end.
const PRINT: (&str, &str) = (
    "hpu_print.h",
    "int hpu_print(const char* format, ...);\nvoid vl_stop_maybe(const char* file, int line, const char*, bool);\n",
);
/// The file with the assertions that a built model does not check.
const UNCHECKED: &str = "unchecked";
/// The Verilog of a design in VHDL.
const SYNTHESISED: &str = "synthesised.v";
/// The file in which Verilator describes a design.
pub(super) const XML: &str = "design.xml";
/// The most elements of a port that is an array.
const MOST_ELEMENTS: usize = 1024;
/// The widest port, in bits.
const MOST_BITS: u32 = 64;

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

    /// Returns the ports of a design in Verilog, of which no program is made.
    pub(super) fn ports_of_verilog(&self, model: &Model) -> Result<Vec<Port>, Error> {
        Tool::Verilator.version(self.setup.timeout)?;
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        write_files(model.dut, folder.path())?;
        let design = (folder.path(), &sources(model.dut)[..], &*model.dut.top);
        let lines = self.translated(model, design, (true, false))?.lines;
        Ok(lines.lines().filter_map(port).filter(|(_, is_hidden)| !is_hidden).map(|(port, _)| port).collect())
    }

    /// Lets Verilator read a design in a folder. Returns what it says; `timing` is what it does with delays.
    fn read_by_verilator(
        &self,
        dut: &Dut,
        (folder, sources, top): (&Path, &[PlainName], &str),
        (generics, inside): (bool, bool),
        timing: &[&str],
    ) -> Result<Said, Error> {
        let mut command = Command::new(Tool::Verilator.name());
        command.current_dir(folder);
        // Synthesised Verilog has X in choices that never occur; a designer writes X where a choice must not occur.
        let unknown = if generics { "unique" } else { "fast" };
        command.args(["--cc", "--exe", "-O3", "--flatten", "--x-assign", unknown, "--x-initial", "unique"]);
        command.args(["-Wno-lint", "-Wno-style", "-Wno-fatal", "--prefix", "Vdut", "--Mdir", "obj", "-o", "model"]);
        command.args(TAKEN).args(["--assert", "-CFLAGS", FLAGS, "-I.", "--top-module", top]).args(timing);
        if inside {
            // Signals keep their names and are not merged.
            command.arg("--public-flat-rw");
        }
        if generics {
            command.args(parameters(dut));
        }
        command.args(sources).arg("main.cpp");
        run(Tool::Verilator, "read a design", command, self.limit()).map_err(|error| of_tool(dut, error))
    }

    /// Translates Verilog to C++ in a folder.
    pub(super) fn translated(
        &self,
        model: &Model,
        design: (&Path, &[PlainName], &str),
        (generics, inside): (bool, bool),
    ) -> Result<Translated, Error> {
        let (dut, (folder, _, top)) = (model.dut, design);
        let read_with = |timing: &[&str]| self.read_by_verilator(dut, design, (generics, inside), timing);
        // A file of Verilog may have names that are keywords of SystemVerilog.
        let mut timing = WITHOUT_DELAYS.to_vec();
        let mut said = read_with(&timing);
        if generics && said.as_ref().is_err_and(|error| !waits(error.said())) {
            let older = [&timing[..], &[OF_2005]].concat();
            let again = read_with(&older);
            if again.as_ref().map_or_else(|error| waits(error.said()), |_| true) {
                (timing, said) = (older, again);
            }
        }
        let (mut is_timed, mut note) = match &said {
            Ok(said) => without_delays(&Dropped::of(dut, &said.err), model.clock),
            Err(error) if waits(error.said()) => (true, Some(timed_note(first_place(error.said(), &dut.top)))),
            Err(_) => return Err(said.expect_err("an error")),
        };
        let mut notes = said.as_ref().map(|said| twice(dut, &said.err)).unwrap_or_default();
        // Of Verilog that GHDL has synthesised, the VHDL knows more.
        let declares = |timing: &[&str]| match generics {
            true => self.declared_in_verilog(dut, design, timing),
            false => Ok(Declared::default()),
        };
        let mut declared = None;
        if generics && !is_timed && note.is_some() {
            declared = Some(declares(&timing)?);
            let delays = Dropped::of(dut, &said?.err).assigned;
            if let (Some(clock), Some(delays)) = (derived(&read(&folder.join(XML))?), first(&delays)) {
                (is_timed, note) = (true, Some(kept_note(&delays, &clock)));
            }
        }
        if is_timed {
            if let Some(said) = mixed(dut) {
                return Err(refuses(Tool::Verilator, dut, said));
            }
            let language = timing.iter().copied().filter(|option| *option == OF_2005);
            timing = WITH_DELAYS.into_iter().chain(language).collect();
            // No file of the first reading is to stay.
            let _ = fs::remove_dir_all(folder.join("obj"));
            read_with(&timing)?;
            declared = None;
        }
        let header = read(&folder.join("obj/Vdut.h"))?;
        let mut found = fields(&header)?;
        if inside {
            let inner = inner(&read(&folder.join(ROOT))?, top, &found);
            // Signals that synthesis has added are not shown.
            let is_shown = |field: &Field| (generics || !is_made_up(&field.name)) && !carries_clock(dut, &field.name);
            found.extend(inner.into_iter().filter(is_shown));
        }
        if !generics {
            found.iter_mut().for_each(|field| field.name = in_vhdl(&field.name));
        }
        // Of an entity that stands around the design, nothing but the design is shown.
        found.retain_mut(|field| {
            let inside = if field.is_inside { model.names.inside(&field.name) } else { Some(field.name.clone()) };
            inside.map(|name| field.name = name).is_some()
        });
        // An output that nobody asks for is left open.
        found.retain(|field| field.width <= MOST_BITS || field.is_input || is_connected(dut, &field.name));
        if let Some(field) = found.iter().find(|field| field.width > MOST_BITS) {
            let why = format!("port `{}` has {} bits; hpu takes ports of at most {MOST_BITS}", field.name, field.width);
            return Err(Error::port(&field.name, why));
        }
        let declared = declared.map_or_else(|| declares(&timing), Ok)?;
        if generics {
            number(&mut found, &read(&folder.join(XML))?);
        }
        let port = |field: &Field| {
            let kind = Kind { format: Format::unsigned(field.width), is_quantity: false };
            let mut port = declared::inside(field.name.clone(), kind);
            (port.is_input, port.is_inside) = (field.is_input, field.is_inside);
            declared.describe(&mut port);
            port
        };
        let ports: Vec<_> = found.iter().map(port).collect();
        let mut lines: String = ports.iter().map(|port| line(port, false)).collect();
        lines.extend(declared.hidden(&ports).iter().map(|port| line(port, true)));
        notes.extend(note);
        Ok(Translated { fields: found, lines, is_timed, notes: notes.join("\n") })
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

    /// Returns the signals of a design in Verilog with their types, from Verilator's XML of it.
    fn declared_in_verilog(
        &self,
        dut: &Dut,
        (folder, sources, top): (&Path, &[PlainName], &str),
        timing: &[&str],
    ) -> Result<Declared, Error> {
        let mut command = Command::new(Tool::Verilator.name());
        command.current_dir(folder).args(["--xml-only", "--xml-output", XML]);
        command.args(["-Wno-lint", "-Wno-style", "-Wno-fatal", "-I.", "--top-module", top]);
        command.args(TAKEN).args(timing).args(parameters(dut)).args(sources);
        run(Tool::Verilator, "tell of a design", command, self.limit()).map_err(|error| of_tool(dut, error))?;
        let xml = read(&folder.join(XML))?;
        for (name, value) in &dut.generics {
            if matches!(value, Generic::Text(_)) && declared::is_enumerated(&xml, name) {
                let why = "its type is an enumeration; write the number of the value";
                return Err(Error::generic(name, why.to_string()));
            }
        }
        Ok(declared::of_xml(&xml))
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

/// Returns whether a design in Verilog asks for the time.
fn tells_time(dut: &Dut) -> bool {
    let asks = |content: &[u8]| {
        let text = String::from_utf8_lossy(content);
        ["$time", "$realtime", "$stime"].iter().any(|call| text.contains(call))
    };
    dut.files.iter().any(|(_, content)| asks(content)) || dut.beside.iter().any(|file| asks(&file.content))
}

/// Returns Verilator's options that set the parameters of a design.
fn parameters(dut: &Dut) -> impl Iterator<Item = String> {
    let option = |(name, value): &(Identifier, Generic)| format!("-G{name}={}", Script::<Verilog>::literal(value));
    dut.generics.iter().map(option)
}

pub(super) fn read(path: &Path) -> Result<String, Error> {
    fs::read_to_string(path).map_err(|error| Error::io(path, error))
}

/// Returns a port or a signal inside as a line of the file [`PORTS`].
fn line(port: &Port, is_hidden: bool) -> String {
    let Port { name, is_input, format, is_inside, is_quantity, layout, .. } = port;
    let way = match (is_hidden, is_inside, is_input) {
        (true, ..) => "hidden",
        (_, true, _) => "inside",
        (.., true) => "in",
        _ => "out",
    };
    format!("{name} {way} {format} {} {layout}\n", if *is_quantity { "number" } else { "bits" })
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

/// Returns the first place that a message of Verilator names, as `t.v:5`; else the design's own name.
fn first_place<'s>(said: &'s str, top: &'s str) -> &'s str {
    let place =
        |line: &'s str| line.strip_prefix("%Error")?.split(": ").nth(1)?.rsplit_once(':').map(|(place, _)| place);
    said.lines().find_map(place).unwrap_or(top)
}

/// A design as C++.
pub(super) struct Translated {
    /// The fields that are shown.
    fields: Vec<Field>,
    /// A line about each, as in the file [`PORTS`].
    pub(super) lines: String,
    /// Whether the model waits for times of its own.
    pub(super) is_timed: bool,
    /// The notes about its modules and its delays, one a line.
    pub(super) notes: String,
}

/// Returns whether a model has to simulate the delays that Verilator would leave out, and what is told about them. A
/// delay of an assignment that ends before the clock's next edge is left out, because registers of the clock see the
/// same without it. A statement that waits is simulated.
fn without_delays(dropped: &Dropped, clock: Clock) -> (bool, Option<String>) {
    let Dropped { assigned, waits } = dropped;
    let long = first(waits.iter().chain(assigned.iter().filter(|delay| !delay.is_short(clock))));
    match (long, first(assigned)) {
        (Some(long), _) => (true, Some(timed_note(&long))),
        (None, Some(short)) => (false, Some(left_out(&short))),
        (None, None) => (false, None),
    }
}

/// Returns notes about modules that two files declare.
fn twice(dut: &Dut, said: &str) -> Vec<String> {
    const MARK: &str = "%Warning-MODDUP: ";
    const ORIGINAL: &str = ": ... Location of original declaration";
    let names = plain_names(dut);
    let own = |place: &str| {
        let (plain, line) = place.split_once(':').unwrap_or((place, ""));
        let named = names.iter().find(|(name, _)| **name == *plain).map_or(plain, |(_, own)| own);
        format!("{named}:{}", line.split(':').next().unwrap_or_default())
    };
    let (mut notes, mut second) = (Vec::new(), None);
    for line in said.lines() {
        if let Some((place, what)) = line.strip_prefix(MARK).and_then(|rest| rest.split_once(": ")) {
            second = Some((own(place), what.rsplit(": ").next().unwrap_or_default().to_string()));
        } else if let Some(first) = line.trim().strip_suffix(ORIGINAL)
            && let Some((second, module)) = second.take()
        {
            let first = own(first);
            notes.push(format!("{second}: module {module} is declared at {first} too; the latter is simulated"));
        }
    }
    notes
}

/// Returns the note that short delays are simulated.
fn kept_note(delays: &str, clock: &str) -> String {
    format!(
        "{delays}: Verilator simulates it as written, but more slowly, because `{clock}`, which is no input of the \
         design, clocks registers: they may see another word without it"
    )
}

/// Returns whether a scene connects a port or a part of it.
fn is_connected(dut: &Dut, name: &str) -> bool {
    dut.ports.iter().any(|connected| connected.port.split(['.', '(', '[']).next() == Some(name))
}

fn timed_note(place: &str) -> String {
    format!(
        "{place}: the design waits for a time or an event, which Verilator simulates as written, but more slowly; only \
         a pulse that is shorter than the delay of its wire is delayed too, where Verilog swallows it"
    )
}

/// A port or an inner signal, as the C++ has it.
struct Field {
    /// Its name in the design, and in C++.
    name: String,
    field: String,
    is_input: bool,
    is_inside: bool,
    width: u32,
}

/// Reads the ports from lines such as `VL_IN8(&clk,0,0);`. The elements of an array, as in `VL_IN8((&g)[2],7,0);`, are
/// counted from 0.
fn fields(header: &str) -> Result<Vec<Field>, Error> {
    let mut all = Vec::new();
    for line in header.lines().map(str::trim) {
        let Some(field) = field(line) else {
            if let Some((name, is)) = untaken(line) {
                return Err(Error::port(
                    name,
                    format!(
                        "port `{name}` is {is}; hpu takes in and out, words and arrays of words: a module around the \
                         design that parts it, or pulls it up, would go on"
                    ),
                ));
            }
            continue;
        };
        let array = field.field.strip_prefix("(&").and_then(|rest| rest.strip_suffix(']')?.split_once(")["));
        match array.map(|(name, count)| (name.to_string(), count.parse::<usize>())) {
            None => all.push(field),
            Some((name, Ok(count))) if count <= MOST_ELEMENTS => {
                let element = |index| {
                    let place = format!("{name}[{index}]");
                    Field { name: place.clone(), field: place, ..field }
                };
                all.extend((0..count).map(element));
            }
            Some((name, _)) => {
                let why = format!(
                    "port `{name}` is an array of arrays, or has more than {MOST_ELEMENTS} elements; a module around \
                     the design with a port of one dimension would go on"
                );
                return Err(Error::port(&name, why));
            }
        }
    }
    Ok(all)
}

/// Gives the elements of arrays the indices that the design gives them; `xml` tells the ranges of arrays.
fn number(fields: &mut [Field], xml: &str) {
    for field in fields.iter_mut().filter(|field| !field.is_inside) {
        let Some((name, index)) = field.name.strip_suffix(']').and_then(|rest| rest.split_once('[')) else { continue };
        let port =
            xml.lines().find(|line| line.contains("<var ") && declared::attribute(line, "origName") == Some(name));
        let id = port.and_then(|line| declared::attribute(line, "dtype_id")).unwrap_or_default();
        let range = xml.split("<unpackarraydtype ").find(|part| declared::attribute(part, "id") == Some(id));
        let bounds = range.into_iter().flat_map(|part| part.split("<const ").skip(1).take(2));
        let bounds = bounds.filter_map(|part| {
            let (_, hex) = declared::attribute(part, "name")?.rsplit_once('h')?;
            u32::from_str_radix(hex, 16).ok().map(u32::cast_signed)
        });
        let (low, index) = (bounds.min().unwrap_or(0), index.parse::<i32>().unwrap_or(0));
        field.name = format!("{name}[{}]", low + index);
    }
}

/// Returns the name of a port that is no word, from its line, and what it is.
fn untaken(line: &str) -> Option<(&str, &'static str)> {
    if let Some(name) = line.strip_prefix("double &") {
        return Some((name.trim_end_matches(';'), "real"));
    }
    let (way, rest) = line.split_once('(')?;
    let is_inout = way.trim_end_matches(|c: char| c.is_ascii_digit() || c == 'W') == "VL_INOUT";
    is_inout.then(|| (rest.trim_start_matches(['(', '&']).split([',', ')']).next().unwrap_or_default(), "inout"))
}

/// Reads a port from its line.
fn field(line: &str) -> Option<Field> {
    let (way, rest) = line.split_once('(')?;
    let is_input = match way.trim_end_matches(|c: char| c.is_ascii_digit() || c == 'W') {
        "VL_IN" => true,
        "VL_OUT" => false,
        _ => return None,
    };
    let parts: Vec<_> = rest.trim_end_matches(");").split(',').collect();
    let field = parts.first()?.trim_start_matches('&').to_string();
    let [high, low] = [parts.get(1)?, parts.get(2)?].map(|bit| bit.parse::<i64>().ok());
    // Verilator marks names that are reserved in C++, and writes two underscores as a code.
    let name = decoded(field.trim_start_matches("__SYM__"));
    Some(Field { name, field, is_input, is_inside: false, width: u32::try_from(high? - low? + 1).ok()? })
}

/// Returns a name of Verilator's C++ as the design has it: `__0` and two digits stand for a character.
fn decoded(field: &str) -> String {
    let mut parts = field.split("__0");
    let mut name = parts.next().unwrap_or_default().to_string();
    for part in parts {
        match part.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(code) => name += &format!("{}{}", char::from(code), &part[2..]),
            None => name += &format!("__0{part}"),
        }
    }
    name
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

/// Returns whether GHDL's synthesis has made up a signal's name, as in `n12_o`.
fn is_made_up(name: &str) -> bool {
    let leaf = name.rsplit('.').next().unwrap_or_default();
    let number = leaf.strip_prefix('n').and_then(|rest| rest.strip_suffix("_o").or(rest.strip_suffix("_q")));
    number.is_some_and(|number| !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()))
}

/// Reads the signals inside the design from lines such as `SData/*9:0*/ KneeCtl__DOT__duty__DOT__count;`. Leaves out
/// memories, the signals that Verilator adds, and the ports.
fn inner(root: &str, top: &str, ports: &[Field]) -> Vec<Field> {
    let signal = |line: &str| {
        let line = line.trim().strip_suffix(';')?;
        let (kind, field) = line.split_once("*/ ")?;
        let (kind, bits) = kind.split_once("/*")?;
        let path = field.strip_prefix(&format!("{top}__DOT__"))?;
        let is_word = ["CData", "SData", "IData", "QData"].contains(&kind);
        if !is_word || field.contains("__V") || !field.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return None;
        }
        let (high, low) = bits.split_once(':')?;
        let width = u32::try_from(high.parse::<i64>().ok()? - low.parse::<i64>().ok()? + 1).ok()?;
        let name = decoded(&path.replace("__DOT__", ".").replace("__BRA__", "[").replace("__KET__", "]"));
        let is_port = ports.iter().any(|port| port.name == name);
        (!is_port).then(|| Field { name, field: format!("rootp->{field}"), is_input: false, is_inside: true, width })
    };
    root.lines().filter_map(signal).collect()
}

/// The variables of the flattened design, and whether some of their values were made up for X.
struct State {
    variables: Vec<String>,
    makes_up: bool,
}

/// Whether a variable's value was made up for an X that the design assigns.
fn is_for_x(variable: &str) -> bool {
    variable.contains("__Vxrand")
}

fn state(root: &str) -> State {
    let kinds = ["CData/*", "SData/*", "IData/*", "QData/*", "VlWide<", "VlUnpacked<"];
    let variable = |line: &str| {
        let line = line.trim();
        // An output may be a register itself.
        if let Some(output) = line.strip_prefix("VL_OUT") {
            let (name, _) = output.split_once('(')?.1.split_once(',')?;
            return Some(name.trim_start_matches('&').to_string());
        }
        let is_one = kinds.iter().any(|kind| line.starts_with(kind)) && line.ends_with(';') && !line.contains('(');
        is_one.then(|| line.trim_end_matches(';').rsplit(' ').next().unwrap_or_default().to_string())
    };
    let variables: Vec<_> = root.lines().filter_map(variable).collect();
    State { makes_up: variables.iter().any(|name| is_for_x(name)), variables }
}

/// Returns the path in the design of a variable, without the topmost unit. A register that GHDL's synthesis has named
/// has the name of the signal that takes its value in the `synthesised` Verilog.
fn path(variable: &str, synthesised: &str) -> String {
    let path = variable.trim_start_matches("__SYM__").split_once("__DOT__").map_or(variable, |(_, path)| path);
    let path = path.replace("__DOT__", ".").replace("__BRA__", "[").replace("__KET__", "]").replace("___05F", "__");
    if !is_made_up(&path) {
        return path;
    }
    let (above, leaf) = path.rsplit_once('.').map_or(("", &*path), |(above, leaf)| (above, leaf));
    let assigned = |line: &str| {
        let line = line.trim();
        let is_one = line.starts_with("assign ") || !line.contains(':');
        let (signal, value) = line.trim_start_matches("assign ").split_once('=').filter(|_| is_one)?;
        let value = value.split_once(';')?.0.trim();
        (value == leaf).then(|| signal.trim().trim_end_matches('<').trim().to_string())
    };
    let named = synthesised.lines().filter_map(assigned).find(|name| !is_made_up(name));
    named.map_or(path.clone(), |name| if above.is_empty() { name } else { format!("{above}.{name}") })
}

/// Returns whether Verilator has put the whole design into one structure.
fn is_flat(folder: &Path) -> bool {
    let known = ["Vdut___024root.h", "Vdut___024unit.h", "Vdut__Syms.h", "Vdut__Dpi.h", "Vdut__pch.h"];
    let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let mut classes =
        names.filter(|name| name.to_str().is_some_and(|name| name.starts_with("Vdut_") && name.ends_with(".h")));
    classes.all(|name| known.iter().any(|known| name == *known))
}

/// Returns the C++ program around the model; [`wire`](super::wire) describes what it reads and writes.
fn main_cpp(model: &Model, fields: &[Field], state: &State, is_timed: bool, synthesised: &str) -> String {
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
