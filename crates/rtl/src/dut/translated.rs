//! Verilog to C++: what Verilator reads, with the delays that a model has, and the ports and signals that it finds.

use std::fs;
use std::path::Path;
use std::process::Command;

use hpu_cosim::dut::Port;
use hpu_cosim::scene::{Dut, Generic, Identifier};
use hpu_cosim::script::{Script, Verilog};
use hpu_signal::{Clock, Format};

use super::build::{Model, carries_clock};
use super::clocks::derived;
use super::declared::{self, Declared, Kind};
use super::files::{PlainName, plain_names};
use super::synthesised::in_vhdl;
use super::text::cpp::{Field, fields, inner, is_made_up};
use super::text::delay::{first, left_out};
use super::text::verilog::{Dropped, TIMESCALE, mixed, waits};
use super::{Simulators, of_tool, refuses};
use crate::engines::error::Error;
use crate::engines::tool::{Said, Tool, run};

/// The C++ of the whole design's state.
pub(super) const ROOT: &str = "obj/Vdut___024root.h";
/// An endless loop has to hang, so that it is noticed. The compiler must not remove it. What the design says goes to
/// `main.cpp`, and so does its end.
pub(super) const FLAGS: &str = "-std=c++17 -O3 -fno-finite-loops -DVL_USER_FINISH -DVL_USER_WARN \
                                -DVL_USER_STOP_MAYBE -DVL_USER_FATAL -DVL_PRINTF=hpu_print -include ../hpu_print.h";
/// Verilog of the field's practice that Verilator takes for a mistake: blocking and non-blocking assignments of one
/// register, as in a reset of their own.
pub(super) const TAKEN: [&str; 2] = ["-Wno-BLKANDNBLK", "-Wno-ENUMVALUE"];
/// Delays are left out, and told.
const WITHOUT_DELAYS: [&str; 5] = ["--no-timing", "-Wwarn-ASSIGNDLY", "-Wwarn-STMTDLY", "--timescale", TIMESCALE];
/// Delays are simulated, by coroutines of C++20.
const WITH_DELAYS: [&str; 5] = ["--timing", "--timescale", TIMESCALE, "-CFLAGS", "-std=c++20"];
/// Files `.v` are Verilog of 2005, in which keywords of SystemVerilog are names.
const OF_2005: &str = "+1364-2005ext+v";
/// The file in which Verilator describes a design.
pub(super) const XML: &str = "design.xml";
/// The widest port, in bits.
const MOST_BITS: u32 = 64;

impl Simulators {
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
        let (dut, folder) = (model.dut, design.0);
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
        let mut found = shown(model, design, (generics, inside))?;
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

/// Returns the ports of a model that Verilator has made, and the signals inside that are shown.
fn shown(
    model: &Model,
    (folder, _, top): (&Path, &[PlainName], &str),
    (generics, inside): (bool, bool),
) -> Result<Vec<Field>, Error> {
    let dut = model.dut;
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
    Ok(found)
}

/// A design as C++.
pub(super) struct Translated {
    /// The fields that are shown.
    pub(super) fields: Vec<Field>,
    /// A line about each, as in the file [`PORTS`].
    pub(super) lines: String,
    /// Whether the model waits for times of its own.
    pub(super) is_timed: bool,
    /// The notes about its modules and its delays, one a line.
    pub(super) notes: String,
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

/// Returns Verilator's options that set the parameters of a design.
pub(super) fn parameters(dut: &Dut) -> impl Iterator<Item = String> {
    let option = |(name, value): &(Identifier, Generic)| format!("-G{name}={}", Script::<Verilog>::literal(value));
    dut.generics.iter().map(option)
}

/// Returns the first place that a message of Verilator names, as `t.v:5`; else the design's own name.
fn first_place<'s>(said: &'s str, top: &'s str) -> &'s str {
    let place =
        |line: &'s str| line.strip_prefix("%Error")?.split(": ").nth(1)?.rsplit_once(':').map(|(place, _)| place);
    said.lines().find_map(place).unwrap_or(top)
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
