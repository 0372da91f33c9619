//! The C++ that Verilator makes of a design: its ports, signals and state, as its headers declare them.

use crate::engines::error::Error;

/// The most elements of a port that is an array.
const MOST_ELEMENTS: usize = 1024;

/// A port or an inner signal, as the C++ has it.
pub(in crate::dut) struct Field {
    /// Its name in the design, and in C++.
    pub(in crate::dut) name: String,
    pub(in crate::dut) field: String,
    pub(in crate::dut) is_input: bool,
    pub(in crate::dut) is_inside: bool,
    pub(in crate::dut) width: u32,
}

/// Reads the ports from lines such as `VL_IN8(&clk,0,0);`. The elements of an array, as in `VL_IN8((&g)[2],7,0);`, are
/// counted from 0.
pub(in crate::dut) fn fields(header: &str) -> Result<Vec<Field>, Error> {
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

/// Returns whether GHDL's synthesis has made up a signal's name, as in `n12_o`.
pub(in crate::dut) fn is_made_up(name: &str) -> bool {
    let leaf = name.rsplit('.').next().unwrap_or_default();
    let number = leaf.strip_prefix('n').and_then(|rest| rest.strip_suffix("_o").or(rest.strip_suffix("_q")));
    number.is_some_and(|number| !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()))
}

/// Reads the signals inside the design from lines such as `SData/*9:0*/ KneeCtl__DOT__duty__DOT__count;`. Leaves out
/// memories, the signals that Verilator adds, and the ports.
pub(in crate::dut) fn inner(root: &str, top: &str, ports: &[Field]) -> Vec<Field> {
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
pub(in crate::dut) struct State {
    pub(in crate::dut) variables: Vec<String>,
    pub(in crate::dut) makes_up: bool,
}

/// Whether a variable's value was made up for an X that the design assigns.
pub(in crate::dut) fn is_for_x(variable: &str) -> bool {
    variable.contains("__Vxrand")
}

pub(in crate::dut) fn state(root: &str) -> State {
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
pub(in crate::dut) fn path(variable: &str, synthesised: &str) -> String {
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
