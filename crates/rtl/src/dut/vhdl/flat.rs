//! Ports of composite types: a generated entity around a design has a port of its own for each word in a record or an
//! array. GHDL's simulation and its synthesis take the same entity.

use std::fmt::Write as _;

use hpu_cosim::scene::{Dut, Identifier, Layout, Part};
use hpu_signal::Format;

use super::interface::{Interface, Item, of_text};
use super::shape::{Bounds, Shape, shape};
use super::text::plain;
use super::types::Types;
use crate::engines::error::Error;

/// The generated entity.
const FLAT: &str = "hpu_flat";
/// The entity by whose synthesis GHDL tells the bounds of arrays. No function of the design runs for that.
pub(in crate::dut) const PROBE: &str = "hpu_probe";
/// The label of the design in the generated entity.
const LABEL: &str = "dut";
/// The most bits of a word, and the most words of all ports.
const MOST: usize = 64;
const MOST_WORDS: usize = 1024;

/// The names of a design's ports and signals where a generated entity stands around it; none otherwise.
#[derive(Clone, Default, Debug)]
pub(crate) struct Names {
    words: Vec<Word>,
    /// The names of the design's own ports, in lower case.
    ports: Vec<String>,
}

/// A port of the generated entity.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Word {
    /// Its name there.
    own: String,
    /// Its name as part of a port of the design, as in `enc.a` or `gains(2)`.
    pub(crate) shown: String,
    /// Its format, if it has a binary point.
    pub(crate) format: Option<Format>,
    /// The names of its bits in the design, if it is a vector.
    pub(crate) layout: Option<Layout>,
}

impl Names {
    /// The names of a design without an entity around it.
    pub(crate) const NONE: &'static Self = &Self { words: Vec::new(), ports: Vec::new() };

    /// Returns whether no entity stands around the design.
    pub(crate) fn is_empty(&self) -> bool {
        self.ports.is_empty()
    }

    /// Returns whether a port of the design has this name.
    pub(crate) fn is_port(&self, name: &str) -> bool {
        self.ports.contains(&name.to_lowercase())
    }

    /// Returns the part of a port that a port of the generated entity stands for.
    pub(crate) fn word(&self, own: &str) -> Option<&Word> {
        self.words.iter().find(|word| word.own.eq_ignore_ascii_case(own))
    }

    /// Returns the name, in what is simulated, of a port with this name.
    pub(crate) fn own<'n>(&'n self, shown: &'n str) -> &'n str {
        self.words.iter().find(|word| word.shown == shown).map_or(shown, |word| &word.own)
    }

    /// Returns the path, from the top of what is simulated, of a signal inside the design.
    pub(crate) fn path(&self, inside: &str) -> String {
        if self.ports.is_empty() { inside.to_string() } else { format!("{LABEL}.{inside}") }
    }

    /// Returns a path from the top of what is simulated as one from the top of the design; `None` for what is no signal
    /// inside it.
    pub(crate) fn inside(&self, path: &str) -> Option<String> {
        if self.ports.is_empty() {
            return Some(path.to_string());
        }
        let inside = path.strip_prefix(LABEL)?.strip_prefix('.')?;
        let lower = inside.to_lowercase();
        // Synthesis names the elements of a record `enc_a`.
        let is_port = |port: &String| {
            lower.strip_prefix(port.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(['_', '.', '(']))
        };
        (!self.ports.iter().any(is_port)).then(|| inside.to_string())
    }
}

/// A design that gets a generated entity around it.
pub(in crate::dut) struct Around {
    /// The place of the file with the design's entity.
    file: usize,
    interface: Interface,
    /// The shape of each port that is no word.
    shapes: Vec<Option<Shape<()>>>,
}

impl Around {
    /// Returns the design as one that gets an entity around it; `None` if all of its ports are words.
    ///
    /// # Errors
    ///
    /// When a port cannot be connected: it has a type or a mode that hpu does not take.
    pub(in crate::dut) fn of(dut: &Dut) -> Result<Option<Self>, Error> {
        let texts: Vec<_> = dut.files.iter().map(|(_, content)| plain(content)).collect();
        let found = texts.iter().enumerate().find_map(|(file, text)| Some((file, of_text(text, &dut.top)?)));
        let Some((file, interface)) = found else { return Ok(None) };
        let types = Types::of(texts.iter().map(String::as_str));
        let arithmetic = interface.context.to_lowercase().contains("std_logic_arith");
        let mut shapes = Vec::new();
        for port in &interface.ports {
            if !["in", "out", "buffer"].contains(&&*port.mode) {
                let why =
                    format!("port `{}` is {} {}; hpu takes in and out: {PARTED}", port.name, port.mode, port.kind);
                return Err(Error::port(&port.name, why));
            }
            let (name, declared) = types.find(&port.kind);
            let of_arithmetic = arithmetic && ["unsigned", "signed"].contains(&&*name);
            let shape = shape(&types, &port.kind).map_err(|of| untakable(port, &of))?;
            if declared.is_none() && matches!(shape, Shape::Vector { .. }) && types.range(&port.kind).is_none() {
                let why = format!("port `{}` is of the type {}, without a range: {PARTED}", port.name, port.kind);
                return Err(Error::port(&port.name, why));
            }
            let is_plain = declared.is_none()
                && !name.ends_with("fixed")
                && !of_arithmetic
                && (ends_with_0(&types, port) || !is_parted(dut, port));
            shapes.push((!is_plain).then_some(shape));
        }
        let is_needed = shapes.iter().any(Option::is_some);
        Ok(is_needed.then_some(Self { file, interface, shapes }))
    }

    /// Returns the text of an entity whose synthesis tells the bounds of the arrays in the ports; `None` without
    /// arrays.
    pub(in crate::dut) fn probe(&self) -> Option<String> {
        let (mut paths, mut signals) = (Vec::new(), String::new());
        for (index, (port, shape)) in self.interface.ports.iter().zip(&self.shapes).enumerate() {
            if let Some(shape) = shape {
                let _ = writeln!(signals, "  signal hpu_s{index} : {};", port.kind);
                shape.arrays(&format!("hpu_s{index}"), &mut paths);
            }
        }
        if paths.is_empty() {
            return None;
        }
        let mut statements = String::new();
        let ends = paths.iter().flat_map(|path| [format!("{path}'left"), format!("{path}'right")]);
        for (index, end) in ends.enumerate() {
            let (high, low) = (32 * index + 31, 32 * index);
            let word = format!("{SLV}(ieee.numeric_std.to_signed({end}, 32))");
            let _ = writeln!(statements, "  o({high} downto {low}) <= {word};");
        }
        let constant = |item: &Item| {
            let value = item.default.as_ref()?;
            Some(format!("  constant {} : {} := {value};\n", item.name, item.kind))
        };
        let constants: String = self.interface.generics.iter().filter_map(constant).collect();
        let high = 64 * paths.len() - 1;
        Some(format!(
            "library ieee;\n{}entity {PROBE} is\n  port (o : out {SLV}({high} downto 0));\nend entity;\n\narchitecture \
             probe of {PROBE} is\n{constants}{signals}begin\n{statements}end architecture;\n",
            self.interface.context
        ))
    }

    /// Puts the generated entity around the design. `told` is the Verilog of the [`probe`](Self::probe). Returns the
    /// names; `None` if the Verilog does not tell the bounds.
    ///
    /// # Errors
    ///
    /// When a port has too many words or bits.
    pub(in crate::dut) fn put(&self, dut: &mut Dut, told: &str) -> Result<Option<Names>, Error> {
        let words = literal_words(told);
        let mut bounds = words.chunks_exact(2).map(|ends| (ends[0], ends[1]));
        let mut flat = Flat::default();
        for (index, (port, shape)) in self.interface.ports.iter().zip(&self.shapes).enumerate() {
            match shape {
                None => flat.plain(port),
                Some(shape) => {
                    let Some(shape) = shape.bounded(&mut bounds) else { return Ok(None) };
                    flat.port(index, port, &shape)?;
                }
            }
        }
        let words = std::mem::take(&mut flat.words);
        let text = flat.text(&self.interface, &dut.top);
        let name = free(dut, FLAT);
        // The entity goes to the library of the design.
        let own = &dut.files[self.file].0;
        let library = dut.libraries.iter().find(|(name, _)| name == own).map(|(_, library)| library.clone());
        dut.libraries.extend(library.map(|library| (name.clone(), library)));
        dut.files.push((name, text.into_bytes().into()));
        dut.top = Identifier::fixed(FLAT);
        let ports = self.interface.ports.iter().map(|port| port.name.to_lowercase()).collect();
        Ok(Some(Names { words, ports }))
    }
}

/// Returns whether the indices of a port, if it has any, are the numbers of bits to the right, as far as its text
/// tells.
fn ends_with_0(types: &Types, port: &Item) -> bool {
    let range = types.range(&port.kind);
    range.is_none_or(|range| matches!(range.split_whitespace().collect::<Vec<_>>()[..], [.., "downto", "0"]))
}

/// Returns whether bits of a port are connected by their indices.
fn is_parted(dut: &Dut, port: &Item) -> bool {
    let is_index = |part| matches!(part, Part::Bits(..));
    dut.ports.iter().any(|of| is_index(of.part) && of.port.eq_ignore_ascii_case(&port.name))
}

/// The full name of the type of words.
const SLV: &str = "ieee.std_logic_1164.std_logic_vector";
/// The way out for a port that cannot be connected.
const PARTED: &str = "an entity around the design that parts it, or a port of another type, would go on";

fn untakable(port: &Item, of: &str) -> Error {
    let inside = if port.kind.to_lowercase().contains(of) { String::new() } else { format!(", with {of} in it") };
    let why = format!(
        "port `{}` is of the type {}{inside}; hpu takes bits, words of bits, sfixed and ufixed, whole numbers, flags, \
         enumerations, and records and arrays of them: {PARTED}",
        port.name, port.kind
    );
    Error::port(&port.name, why)
}

/// Returns the numbers of 32 bits in the literals of Verilog, from the right to the left of the last assignment.
fn literal_words(verilog: &str) -> Vec<i64> {
    let bits = |line: &str| -> String {
        line.split("'b")
            .skip(1)
            .map(|part| part.chars().take_while(|c| "01".contains(*c)).collect::<String>())
            .collect()
    };
    let Some(bits) = verilog.lines().rev().map(bits).find(|bits| !bits.is_empty()) else { return Vec::new() };
    let word = |chunk: &[u8]| {
        let text = std::str::from_utf8(chunk).unwrap_or_default();
        i64::from(u32::from_str_radix(text, 2).unwrap_or_default().cast_signed())
    };
    bits.as_bytes().rchunks_exact(32).map(word).collect()
}

/// Returns the name of a file that the design does not have.
fn free(dut: &Dut, stem: &str) -> String {
    let mut name = format!("{stem}.vhd");
    while dut.files.iter().any(|(file, _)| file.rsplit('/').next() == Some(&*name)) {
        name.insert(0, '_');
    }
    name
}

/// The parts of the generated entity.
#[derive(Default)]
struct Flat {
    words: Vec<Word>,
    ports: Vec<String>,
    signals: String,
    map: Vec<String>,
    statements: String,
}

impl Flat {
    /// Adds a port that stays as it is.
    fn plain(&mut self, port: &Item) {
        let default = port.default.as_ref().map(|default| format!(" := {default}")).unwrap_or_default();
        self.ports.push(format!("{} : {} {}{default}", port.name, port.mode, port.kind));
        self.map.push(format!("{0} => {0}", port.name));
    }

    /// Adds the words of a port.
    fn port(&mut self, index: usize, port: &Item, shape: &Shape<Bounds>) -> Result<(), Error> {
        let signal = format!("hpu_s{index}");
        let _ = writeln!(self.signals, "  signal {signal} : {};", port.kind);
        self.map.push(format!("{} => {signal}", port.name));
        self.part((port, &port.name, &signal), shape)
    }

    /// Adds the words of a part of a port, which has a name for the user and one in the generated entity.
    fn part(&mut self, (port, shown, signal): (&Item, &str, &str), shape: &Shape<Bounds>) -> Result<(), Error> {
        let is_input = port.mode == "in";
        let too = |what: String| Err(Error::port(&port.name, format!("port `{shown}` has {what}: {PARTED}")));
        if self.words.len() >= MOST_WORDS {
            return too(format!("more than {MOST_WORDS} words"));
        }
        let own = format!("hpu_p{}", self.words.len());
        let (mut format, mut layout) = (None, None);
        let (kind, statement) = match shape {
            Shape::Record(elements) => {
                return elements.iter().try_for_each(|(name, shape)| {
                    self.part((port, &format!("{shown}.{name}"), &format!("{signal}.{name}")), shape)
                });
            }
            Shape::Array((left, right), element) => {
                let mut indices: Vec<i64> = (*left.min(right)..=*left.max(right)).take(MOST_WORDS + 1).collect();
                if left > right {
                    indices.reverse();
                }
                return indices.into_iter().try_for_each(|at| {
                    self.part((port, &format!("{shown}({at})"), &format!("{signal}({at})")), element)
                });
            }
            Shape::Plain(kind) => {
                (kind.to_string(), if is_input { format!("{signal} <= {own};") } else { format!("{own} <= {signal};") })
            }
            Shape::Vector { bounds: (left, right), of_bit, is_signed, is_fixed } => {
                layout = Some(Layout::Vector(*left, *right));
                let (low, high) = (*left.min(right), *left.max(right));
                let width = high.abs_diff(low) + 1;
                if width > MOST as u64 {
                    return too(format!("{width} bits; hpu takes at most {MOST}"));
                }
                if *is_fixed {
                    format = Format::new(*is_signed, *left as i32 + i32::from(!is_signed), -*right as i32).ok();
                }
                let kind = match (of_bit, is_signed) {
                    (true, _) => "bit_vector",
                    (false, true) => "ieee.numeric_std.signed",
                    (false, false) => SLV,
                };
                let at = if left < right { format!("{high} - i") } else { format!("{low} + i") };
                let (to, from) = (format!("{signal}({at})"), format!("{own}(i)"));
                let (to, from) = if is_input { (to, from) } else { (from, to) };
                let last = width - 1;
                let all = format!("{own}_all : for i in 0 to {last} generate {to} <= {from}; end generate;");
                (format!("{kind}({last} downto 0)"), all)
            }
            Shape::Enumeration(name, count) => {
                let width = (usize::BITS - (count - 1).leading_zeros()).max(1) as usize;
                let choice = |at: usize| format!("{name}'val({at}) when {own} = \"{at:0width$b}\" else ");
                let statement = if is_input {
                    let others: String = (1..*count).map(choice).collect();
                    format!("{signal} <= {others}{name}'val(0);")
                } else {
                    format!("{own} <= {SLV}(ieee.numeric_std.to_unsigned({name}'pos({signal}), {width}));")
                };
                (format!("{SLV}({} downto 0)", width - 1), statement)
            }
        };
        self.ports.push(format!("{own} : {} {kind}", port.mode));
        let _ = writeln!(self.statements, "  {statement}");
        self.words.push(Word { own, shown: shown.to_string(), format, layout });
        Ok(())
    }

    /// Returns the text of the entity around a design.
    fn text(&self, interface: &Interface, top: &str) -> String {
        let generic = |item: &Item| {
            let default = item.default.as_ref().map_or_else(String::new, |value| format!(" := {value}"));
            format!("{} : {}{default}", item.name, item.kind)
        };
        let generics: Vec<_> = interface.generics.iter().map(generic).collect();
        let names: Vec<_> = interface.generics.iter().map(|item| format!("{0} => {0}", item.name)).collect();
        let part = |begin: &str, list: &[String], separator: &str, end: &str| match list {
            [] => String::new(),
            list => format!("{begin}{}{end}", list.join(separator)),
        };
        format!(
            "library ieee;\nuse ieee.std_logic_1164.all;\n{context}\nentity {FLAT} is\n{generics}  port (\n    \
             {ports});\nend entity;\n\narchitecture flat of {FLAT} is\n{signals}begin\n\n  {LABEL} : entity \
             work.{top}{generic_map} port map ({map});\n\n{statements}\nend architecture;\n",
            context = interface.context,
            generics = part("  generic (\n    ", &generics, ";\n    ", ");\n"),
            ports = self.ports.join(";\n    "),
            signals = self.signals,
            generic_map = part(" generic map (", &names, ", ", ")"),
            map = self.map.join(", "),
            statements = self.statements,
        )
    }
}
