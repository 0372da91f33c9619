//! The types with which a design declares its signals: from Verilator's XML of Verilog, and from GHDL's description of
//! elaborated VHDL (`--dump-rti`).

use std::collections::BTreeMap;

use hpu_cosim::dut::Port;
use hpu_cosim::scene::Layout;
use hpu_signal::Format;

use super::vhdl::Names;

/// The type of a signal: the format of its words, and whether they are a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Kind {
    pub(super) format: Format,
    pub(super) is_quantity: bool,
}

impl Kind {
    fn bits(width: u32) -> Option<Self> {
        (1..=64).contains(&width).then(|| Self { format: Format::unsigned(width), is_quantity: false })
    }

    /// Returns a number with so many bits before the point, with the sign bit, and behind it.
    fn number(signed: bool, int: i32, frac: i32) -> Option<Self> {
        if int + frac == 1 {
            return Self::bits(1);
        }
        let format = Format::new(signed, int - i32::from(signed), frac).ok()?;
        Some(Self { format, is_quantity: true })
    }

    /// Returns the type of a number of VHDL with this range.
    fn range(one: i64, other: i64) -> Option<Self> {
        let (low, high) = (one.min(other), one.max(other));
        let holds = |format: Format| format.holds(low.into()) && format.holds(high.into());
        let format = |width: u32| if low < 0 && width > 1 { Format::signed(width) } else { Format::unsigned(width) };
        let format = (1..=64).map(format).find(|format| holds(*format))?;
        Some(Self { format, is_quantity: true })
    }
}

/// Signals of a design by their paths below the top.
#[derive(Default, Debug)]
pub(super) struct Declared {
    signals: Vec<(String, Kind)>,
    /// Their types by [`folded`] paths; `None` where two signals of different types have the same one.
    by_path: BTreeMap<String, Option<Kind>>,
    /// The names of the bits of the topmost module's signals, by their own names.
    layouts: BTreeMap<String, Layout>,
}

/// The most signals that are kept.
const MOST: usize = 1 << 18;

impl Declared {
    fn add(&mut self, path: String, kind: Kind) {
        if self.signals.len() == MOST {
            return;
        }
        let known = self.by_path.entry(folded(&path)).or_insert(Some(kind));
        if *known != Some(kind) {
            *known = None;
        }
        self.signals.push((path, kind));
    }

    /// Returns the types by the names that users know, where a generated entity may stand around the design.
    pub(super) fn around(self, names: &Names) -> Self {
        if names.is_empty() {
            return self;
        }
        let mut shown = Self::default();
        for (path, kind) in self.signals {
            if let Some(word) = names.word(&path) {
                let format = word.format.unwrap_or(kind.format);
                let is_quantity = kind.is_quantity || word.format.is_some();
                shown.add(word.shown.clone(), Kind { format, is_quantity });
            } else if let Some(path) = names.inside(&path) {
                shown.add(path, kind);
            } else if names.is_port(&path) {
                shown.add(path, kind);
            }
        }
        shown
    }

    /// Returns the type of the signal at a path, as a simulator or GHDL's synthesis writes it.
    pub(super) fn of(&self, path: &str) -> Option<Kind> {
        self.by_path.get(&folded(path)).copied().flatten()
    }

    /// Gives a port or a signal its declared type, where the simulator's word has the width of it.
    pub(super) fn describe(&self, port: &mut Port) {
        // The words of an unpacked array are ports of their own.
        let word = port.name.split('[').next().unwrap_or_default();
        if let Some(layout) = self.layouts.get(word).filter(|layout| layout.width() == port.format.width()) {
            port.layout = layout.clone();
        }
        let Some(kind) = self.of(&port.name) else { return };
        let is_ranged = port.is_number && port.is_inside && kind.format.width() < port.format.width();
        if kind.format.width() == port.format.width() || is_ranged {
            (port.format, port.is_quantity) = (kind.format, kind.is_quantity);
        } else {
            port.is_quantity = port.is_number;
        }
    }

    /// Returns the signals inside that are not among these ports.
    pub(super) fn hidden(&self, ports: &[Port]) -> Vec<Port> {
        let known: std::collections::BTreeSet<_> = ports.iter().map(|port| folded(&port.name)).collect();
        let hidden = self.signals.iter().filter(|(path, _)| !known.contains(&folded(path)));
        hidden.map(|(path, kind)| inside(path.clone(), *kind)).collect()
    }
}

/// Returns a signal inside.
pub(super) fn inside(name: String, kind: Kind) -> Port {
    let Kind { format, is_quantity } = kind;
    let layout = Layout::vector(format.width());
    let default = None;
    Port { name, is_input: false, format, is_inside: true, is_number: false, is_quantity, layout, default }
}

/// Returns a path without what tools write differently: the levels of a generate statement are `g(1).u` in GHDL,
/// `g_n5_u` in its synthesis.
fn folded(path: &str) -> String {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|letter| letter.is_ascii_digit());
    let is_made_up = |part: &str| part.strip_prefix('n').is_some_and(is_number);
    let lower = path.to_ascii_lowercase();
    let mut parts = Vec::new();
    for level in lower.split('.') {
        let level = match level.split_once('(') {
            Some((label, index)) if index.ends_with(')') => label,
            _ => level,
        };
        let last = level.matches('_').count();
        let words = level.split('_').enumerate();
        parts.extend(words.filter(|(at, word)| *at == 0 || *at == last || !is_made_up(word)).map(|(_, word)| word));
    }
    parts.join("_")
}

/// Returns the value of an attribute on a line of XML.
pub(super) fn attribute<'l>(line: &'l str, name: &str) -> Option<&'l str> {
    let (_, rest) = line.split_once(&format!(" {name}=\""))?;
    rest.split_once('"').map(|(value, _)| value)
}

/// A type in Verilator's XML.
enum Type<'x> {
    /// Bits, with the indices of the left one and the right one.
    Basic(Kind, (i32, i32)),
    /// Another name of a type.
    Alias(&'x str),
    /// An enumeration of a type.
    Enumeration(&'x str),
    /// A packed structure (the flag is not set) or union, of members with their names.
    Structure(bool, Vec<(String, &'x str)>),
    /// An array, packed if the flag is set, of a type, and the ends of its indices as far as they are read.
    Array(bool, &'x str, Vec<i64>),
}

/// Signals and instances of a module, by their paths in it.
#[derive(Default)]
struct Module<'x> {
    signals: Vec<(String, &'x str)>,
    instances: Vec<(String, &'x str)>,
}

/// Reads the signals of a design in Verilog from Verilator's XML. Left out are memories, and words of no width that
/// `hpu` shows.
pub(super) fn of_xml(xml: &str) -> Declared {
    // The type whose members or ends come next.
    let (mut types, mut open) = (BTreeMap::new(), None);
    let (mut modules, mut top): (BTreeMap<&str, Module>, _) = (BTreeMap::new(), None);
    // The open scopes: the module, then blocks with a name or without one. `None` is a function or a package.
    let (mut module, mut scopes): (Option<&str>, Vec<Option<&str>>) = (None, Vec::new());
    for line in xml.lines().map(str::trim_start) {
        let tag = line.trim_start_matches('<').split([' ', '>']).next().unwrap_or_default();
        let (is_open, get) = (!line.trim_end().ends_with("/>"), |name: &str| attribute(line, name));
        let path = |name: &str| {
            let blocks = scopes.iter().copied().collect::<Option<Vec<_>>>()?;
            let parts = blocks.into_iter().filter(|block| !block.is_empty()).chain([name]);
            Some(parts.collect::<Vec<_>>().join("."))
        };
        match tag {
            "module" => {
                module = get("name");
                top = top.or(module.filter(|_| get("topModule").is_some()));
                scopes.clear();
            }
            "/module" => module = None,
            "begin" if is_open => scopes.push(Some(get("name").unwrap_or_default())),
            "func" | "task" if is_open => scopes.push(None),
            "/begin" | "/func" | "/task" => drop(scopes.pop()),
            "var" | "instance" => {
                let of = module.map(|module| modules.entry(module).or_default());
                let (Some(of), Some(path)) = (of, get("name").and_then(path)) else { continue };
                if tag == "instance" {
                    of.instances.extend(get("defName").map(|model| (path, model)));
                } else if get("param").is_none() && get("localparam").is_none() {
                    of.signals.extend(get("dtype_id").map(|id| (path, id)));
                }
            }
            "memberdtype" => {
                let member = open.as_ref().and_then(|id| types.get_mut(id)).zip(get("sub_dtype_id"));
                if let Some((Type::Structure(_, members), member)) = member {
                    members.push((get("name").unwrap_or_default().to_string(), member));
                }
            }
            "const" => {
                if let Some(Type::Array(_, _, ends)) = open.as_ref().and_then(|id| types.get_mut(id)) {
                    ends.extend(get("name").and_then(number));
                }
            }
            _ => {
                if let (Some(id), Some(found)) = (get("id"), type_of(tag, line)) {
                    open = matches!(found, Type::Structure(..) | Type::Array(..)).then_some(id);
                    types.insert(id, found);
                }
            }
        }
    }
    let mut declared = Declared::default();
    if let Some(top) = top {
        let signals = modules.get(top).map(|module| &module.signals[..]).unwrap_or_default();
        let named = |(name, id): &(String, &str)| Some((name.clone(), layout(&types, id, 0)?));
        declared.layouts = signals.iter().filter_map(named).collect();
        walk(&modules, &types, (top, ""), 0, &mut declared);
    }
    declared
}

/// Reads a type from its line.
fn type_of<'x>(tag: &str, line: &'x str) -> Option<Type<'x>> {
    let sub = || attribute(line, "sub_dtype_id");
    Some(match tag {
        "basicdtype" => {
            let is_word = |name: &str| !["string", "real", "event", "chandle"].contains(&name);
            attribute(line, "name").filter(|name| is_word(name))?;
            let end = |name: &str| attribute(line, name).map_or(Some(0), |end| end.parse::<i32>().ok());
            let ends @ (left, right) = (end("left")?, end("right")?);
            let width = left.abs_diff(right) + 1;
            let signed = attribute(line, "signed") == Some("true");
            let kind = if width > 1 { Kind::number(signed, width.cast_signed(), 0) } else { Kind::bits(1) };
            Type::Basic(kind?, ends)
        }
        "refdtype" => Type::Alias(sub()?),
        "enumdtype" => Type::Enumeration(sub()?),
        "structdtype" | "uniondtype" => Type::Structure(tag == "uniondtype", Vec::new()),
        "packarraydtype" | "unpackarraydtype" => Type::Array(tag == "packarraydtype", sub()?, Vec::new()),
        _ => return None,
    })
}

/// Resolves a type.
fn kind(types: &BTreeMap<&str, Type>, id: &str, depth: u32) -> Option<Kind> {
    if depth > 32 {
        return None;
    }
    match types.get(id)? {
        Type::Basic(kind, _) => Some(*kind),
        Type::Array(true, ..) => Kind::bits(layout(types, id, depth)?.width()),
        Type::Array(false, ..) => None,
        Type::Alias(of) => kind(types, of, depth + 1),
        Type::Enumeration(of) => kind(types, of, depth + 1).map(|kind| Kind { is_quantity: false, ..kind }),
        Type::Structure(is_union, members) => {
            let widths = members.iter().map(|(_, member)| Some(kind(types, member, depth + 1)?.format.width()));
            let widths = widths.collect::<Option<Vec<_>>>()?;
            let sum = widths.iter().try_fold(0u32, |sum, width| sum.checked_add(*width));
            Kind::bits(if *is_union { widths.into_iter().max()? } else { sum? })
        }
    }
}

/// Returns the names of the bits of a type; of an unpacked array, those of its words.
fn layout(types: &BTreeMap<&str, Type>, id: &str, depth: u32) -> Option<Layout> {
    if depth > 32 {
        return None;
    }
    let of = |id: &str| layout(types, id, depth + 1);
    Some(match types.get(id)? {
        Type::Basic(_, (left, right)) => Layout::Vector((*left).into(), (*right).into()),
        Type::Alias(id) | Type::Enumeration(id) | Type::Array(false, id, _) => of(id)?,
        Type::Array(true, id, ends) => match ends[..] {
            [left, right] => Layout::Array(left, right, Box::new(of(id)?)),
            _ => return None,
        },
        Type::Structure(is_union, members) => {
            let is_plain = |name: &str| name.bytes().all(|letter| letter.is_ascii_alphanumeric() || letter == b'_');
            let field = |(name, member): &(String, &str)| {
                Some((Some(name).filter(|name| is_plain(name))?.clone(), of(member)?))
            };
            let fields = members.iter().map(field);
            let fields = fields.collect::<Option<Vec<_>>>()?;
            if *is_union { Layout::Union(fields) } else { Layout::Structure(fields) }
        }
    })
}

/// Returns whether a parameter has the type of an enumeration, by Verilator's XML, which keeps only the type's name.
pub(super) fn is_enumerated(xml: &str, parameter: &str) -> bool {
    let lines = || xml.lines().map(str::trim_start);
    let has = |line: &str, name: &str, value: &str| attribute(line, name) == Some(value);
    let is_it = |line: &&str| line.starts_with("<var ") && has(line, "name", parameter) && has(line, "param", "true");
    let kind = lines().find(is_it).and_then(|line| attribute(line, "vartype"));
    let own =
        |line: &'_ str| attribute(line, "name").and_then(|name| name.rsplit([':', '.']).next().map(str::to_string));
    kind.is_some_and(|kind| lines().any(|line| line.starts_with("<enumdtype ") && own(line).as_deref() == Some(kind)))
}

/// Returns an end of a range from its constant in XML, as in `32'sh1f`.
fn number(text: &str) -> Option<i64> {
    let (_, digits) = text.rsplit_once('h')?;
    let bits = u32::from_str_radix(digits, 16).ok()?;
    Some(bits.cast_signed().into())
}

/// Adds the signals of a module at a path, and of all instances in it.
fn walk(
    modules: &BTreeMap<&str, Module>,
    types: &BTreeMap<&str, Type>,
    (module, path): (&str, &str),
    depth: u32,
    declared: &mut Declared,
) {
    let Some(module) = modules.get(module).filter(|_| depth < 64 && declared.signals.len() < MOST) else { return };
    for (name, id) in &module.signals {
        if let Some(kind) = kind(types, id, 0) {
            declared.add(format!("{path}{name}"), kind);
        }
    }
    for (name, model) in &module.instances {
        walk(modules, types, (model, &format!("{path}{name}.")), depth + 1, declared);
    }
}

/// A level of GHDL's description: its indentation, its label, and whether it is a body of a generate statement.
type Level = (usize, String, bool);

/// Reads the signals of an elaborated design in VHDL from GHDL's description, below the bench's instance of it. Left
/// out are records and arrays of words.
pub(super) fn of_rti(description: &str) -> Declared {
    let (mut declared, mut types) = (Declared::default(), BTreeMap::new());
    let mut levels: Vec<Level> = Vec::new();
    for line in description.lines() {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        let Some((kind, rest)) = text.strip_prefix("ghdl_rtik_").and_then(|text| text.split_once([',', ':'])) else {
            continue;
        };
        while levels.last().is_some_and(|(of, ..)| *of >= indent) {
            levels.pop();
        }
        let label = || rest.rsplit(": ").next().unwrap_or_default().trim().to_string();
        // As in `D=1, sloc=11:10; vel_r: signed (7 downto 0) := "00000000"`.
        let item = || {
            let (name, of) = rest.split_once("; ").map_or(rest, |(_, item)| item).split_once(": ")?;
            Some((name.trim(), of.split(" := ").next().unwrap_or(of).trim()))
        };
        match kind {
            "instance" | "block" | "for_generate" | "if_generate" | "case_generate" => {
                levels.push((indent, label(), false));
            }
            "generate_body" => levels.push((indent, String::new(), true)),
            "iterator" => {
                if let Some((_, body, true)) = levels.last_mut() {
                    *body = format!("({})", rest.rsplit(":= ").next().unwrap_or_default().trim());
                }
            }
            "signal" | "port" => {
                let kind = item().and_then(|(name, of)| Some((name, vhdl(&types, of, 0)?)));
                if let (Some((name, kind)), Some(path)) = (kind, path(&levels)) {
                    declared.add(format!("{path}{name}"), kind);
                }
            }
            _ if kind.starts_with("type") || kind.starts_with("subtype") => {
                let text = rest.split_once(": ").map_or(rest, |(_, text)| text);
                if let Some((name, of)) = text.trim().split_once(" is ") {
                    // Two types of one name, in two packages, tell nothing unless they are the same.
                    let known = types.entry(name.to_string()).or_insert(Some(of.to_string()));
                    if known.as_deref() != Some(of) {
                        *known = None;
                    }
                }
            }
            _ => {}
        }
    }
    declared
}

/// Returns the path of levels below the bench's instance, with a dot at its end; `None` outside of the design.
fn path(levels: &[Level]) -> Option<String> {
    let (_, inside) = levels.split_first()?;
    let mut path = String::new();
    for (_, label, is_body) in inside {
        if *is_body && path.ends_with('.') {
            path.pop();
        }
        path += label;
        path.push('.');
    }
    Some(path)
}

/// Returns the type that GHDL writes so, as in `unresolved_signed (11 downto 0)` or `integer range -5 to 100`.
fn vhdl(types: &BTreeMap<String, Option<String>>, text: &str, depth: u32) -> Option<Kind> {
    if depth > 16 || text.contains(" of ") {
        return None;
    }
    let ends = |text: &str| {
        let (one, other) = text.split_once(" downto ").or_else(|| text.split_once(" to "))?;
        Some((one.trim().parse::<i64>().ok()?, other.trim().parse::<i64>().ok()?))
    };
    if let Some(range) = text.strip_prefix("integer range ").or(text.strip_prefix("INTEGER range ")) {
        return ends(range).and_then(|(low, high)| Kind::range(low, high));
    }
    if text == "integer" {
        return Kind::range(i32::MIN.into(), i32::MAX.into());
    }
    if let Some(literals) = text.strip_prefix('(') {
        // An enumeration is as wide as the number of its last literal.
        return Kind::bits(u64::BITS - (literals.matches(", ").count() as u64).leading_zeros());
    }
    let Some((name, range)) = text.split_once(" (") else {
        return match text {
            "std_logic" | "std_ulogic" | "bit" | "boolean" => Kind::bits(1),
            _ => vhdl(types, types.get(text)?.as_deref()?, depth + 1),
        };
    };
    let (left, right) = ends(range.strip_suffix(')')?)?;
    let (high, low) = (i32::try_from(left.max(right)).ok()?, i32::try_from(left.min(right)).ok()?);
    let width = high.checked_sub(low)?.checked_add(1)?;
    match base(types, name, 0)?.trim_start_matches("unresolved_").trim_start_matches("u_") {
        "signed" => Kind::number(true, width, 0),
        "unsigned" => Kind::number(false, width, 0),
        "sfixed" => Kind::number(true, high.checked_add(1)?, -low),
        "ufixed" => Kind::number(false, high.checked_add(1)?, -low),
        _ => Kind::bits(width.cast_unsigned()),
    }
}

/// Returns the array type whose subtype has this name; `None` for an array of something else than bits.
fn base<'t>(types: &'t BTreeMap<String, Option<String>>, name: &'t str, depth: u32) -> Option<&'t str> {
    const NUMBERS: [&str; 4] = ["signed", "unsigned", "sfixed", "ufixed"];
    let plain = name.trim_start_matches("unresolved_").trim_start_matches("u_");
    if NUMBERS.contains(&plain) || depth > 16 {
        return Some(name);
    }
    let of = types.get(name)?.as_deref()?;
    match of.split_once(" of ") {
        Some((_, element)) => ["std_logic", "std_ulogic", "bit"].contains(&element.trim()).then_some(name),
        None => base(types, of.split(" (").next().unwrap_or(of), depth + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::{Declared, of_rti, of_xml};

    fn told(declared: &Declared, path: &str) -> String {
        declared.of(path).map_or("none".to_string(), |kind| {
            format!("{} {}", kind.format, if kind.is_quantity { "number" } else { "bits" })
        })
    }

    #[test]
    fn types_of_verilog_are_those_of_each_scope() {
        let declared = of_xml(
            r#"<module loc="c" name="top" origName="top" topModule="1">
              <var loc="c" name="v" dtype_id="2" vartype="logic" origName="v"/>
              <instance loc="c" name="u_vel" defName="vel" origName="u_vel">
              <begin loc="c" name="lane"/>
              <begin loc="c" name="lane[0]">
                <var loc="c" name="acc" dtype_id="5" vartype="logic" origName="acc"/>
                <instance loc="c" name="u" defName="other" origName="u">
                </instance>
              </begin>
              <func loc="c" name="f" dtype_id="2">
                <var loc="c" name="hidden" dtype_id="2" vartype="logic" origName="hidden"/>
              </func>
            </module>
            <module loc="c" name="vel" origName="vel">
              <var loc="c" name="W" dtype_id="4" vartype="logic" origName="W" param="true">
              </var>
              <var loc="c" name="vel_r" dtype_id="2" vartype="logic" origName="vel_r"/>
              <var loc="c" name="state" dtype_id="23" vartype="st_t" origName="state"/>
              <var loc="c" name="pair" dtype_id="8" vartype="pair_t" origName="pair"/>
              <var loc="c" name="mem" dtype_id="11" vartype="" origName="mem"/>
            </module>
            <module loc="c" name="other" origName="other">
              <var loc="c" name="vel_r" dtype_id="3" vartype="logic" origName="vel_r"/>
            </module>
            <typetable loc="a">
              <basicdtype loc="c" id="2" name="logic" left="15" right="0" signed="true"/>
              <basicdtype loc="c" id="3" name="logic" left="15" right="0"/>
              <basicdtype loc="c" id="4" name="logic" left="31" right="0" signed="true"/>
              <basicdtype loc="c" id="5" name="logic" left="4" right="0" signed="true"/>
              <basicdtype loc="c" id="7" name="logic" left="1" right="0"/>
              <enumdtype loc="c" id="23" name="st_t" sub_dtype_id="7">
              <structdtype loc="c" id="8" name="pair_t">
                <memberdtype loc="c" id="24" name="a" sub_dtype_id="2"/>
                <memberdtype loc="c" id="25" name="b" sub_dtype_id="5"/>
              </structdtype>
              <unpackarraydtype loc="c" id="11" sub_dtype_id="5">
            </typetable>"#,
        );
        for (path, expected) in [
            ("v", "(1,15,0) number"),
            ("u_vel.vel_r", "(1,15,0) number"),
            ("u_vel.state", "(0,2,0) bits"),
            ("u_vel.pair", "(0,21,0) bits"),
            ("lane[0].acc", "(1,4,0) number"),
            ("lane[0].u.vel_r", "(0,16,0) number"),
            ("u_vel.mem", "none"),
            ("u_vel.W", "none"),
            ("hidden", "none"),
        ] {
            assert_eq!(told(&declared, path), expected, "{path}");
        }
    }

    #[test]
    fn types_of_vhdl_are_those_of_the_elaborated_design() {
        let declared = of_rti(
            r#"ghdl_rtik_package, D=1, sloc=2:9: tp
 ghdl_rtik_subtype_scalar, D=0: natural is integer range 0 to 2147483647
 ghdl_rtik_type_array: unresolved_signed is array (natural range <>) of std_ulogic
 ghdl_rtik_type_e8: st_t is (idle, run, stop)
 ghdl_rtik_subtype_array: speed_t is unresolved_signed (11 downto 0)
 ghdl_rtik_type_array: word_t is array (natural range <>) of std_logic
 ghdl_rtik_subtype_unbounded_array: std_logic_vector is std_ulogic_vector
 ghdl_rtik_type_array: std_ulogic_vector is array (natural range <>) of std_ulogic
ghdl_rtik_architecture, D=1, sloc=1:1: test
 ghdl_rtik_signal, D=1, sloc=1:1; hpu_0: std_logic := 'U'
 ghdl_rtik_instance, sloc=24:3: dut
  ghdl_rtik_architecture, D=1, sloc=10:14: rtl
   ghdl_rtik_entity, D=1, sloc=9:8: top
    ghdl_rtik_port, D=1, sloc=9:71; v: unresolved_signed (15 downto 0) := "0000000000000000"
    ghdl_rtik_port, D=1, sloc=9:71; f: unresolved_sfixed (3 downto -12) := "0000000000000000"
   ghdl_rtik_signal, D=1, sloc=13:10; bits: std_ulogic_vector (7 downto 0) := "00000000"
   ghdl_rtik_signal, D=1, sloc=14:10; n: integer range -5 to 100 := 0
   ghdl_rtik_signal, D=1, sloc=14:51; m: integer range 0 to 1000 := 0
   ghdl_rtik_signal, D=1, sloc=14:51; k: natural := 0
   ghdl_rtik_signal, D=1, sloc=15:10; st: st_t := idle
   ghdl_rtik_signal, D=1, sloc=15:36; sp: speed_t := "000000000000"
   ghdl_rtik_signal, D=1, sloc=15:76; w1: word_t (3 downto 0) := ('0', '0', '0', '0')
  ghdl_rtik_for_generate, D=2, sloc=25:3: g
   ghdl_rtik_generate_body, D=3, sloc=25:32: 
    ghdl_rtik_iterator, D=3, sloc=25:11; i: integer range 0 to 1 := 1
    ghdl_rtik_signal, D=3, sloc=25:39; gv: unresolved_unsigned (4 downto 0) := "00000"
    ghdl_rtik_instance, sloc=25:81: u2
     ghdl_rtik_architecture, D=1, sloc=10:14: rtl
      ghdl_rtik_signal, D=1, sloc=11:10; vel_r: unresolved_signed (7 downto 0) := "00000000"
"#,
        );
        for (path, expected) in [
            ("V", "(1,15,0) number"),
            ("f", "(1,3,12) number"),
            ("bits", "(0,8,0) bits"),
            // -5 to 100 takes eight bits with a sign, 0 to 1000 ten.
            ("n", "(1,7,0) number"),
            ("m", "(0,10,0) number"),
            ("k", "(0,31,0) number"),
            ("st", "(0,2,0) bits"),
            ("sp", "(1,11,0) number"),
            ("w1", "(0,4,0) bits"),
            ("g(1).gv", "(0,5,0) number"),
            ("g(1).u2.vel_r", "(1,7,0) number"),
            // As GHDL's synthesis calls it.
            ("g_n7_u2.vel_r", "(1,7,0) number"),
            ("hpu_0", "none"),
        ] {
            assert_eq!(told(&declared, path), expected, "{path}");
        }
        assert!(declared.hidden(&[]).iter().any(|port| port.name == "g(1).u2.vel_r"));
    }
}
