//! The GTKWave save file: which traces it shows, in which groups, and how each is drawn.

use std::fmt::Write;
use std::ops::Range;

use hpu_signal::{Clock, Cycle, Format, Signal};

use crate::layout::{DIFFERS, OwnNet};
use crate::timescale::Timescale;
use crate::{Layout, Scope, Source, Var};

/// The groups and their nets. Nets of several joints are listed without the joint's number. Nets that are not listed go
/// into a last group.
const GROUPS: &[(&str, &[&str])] = &[
    ("Encoder", &["a_pin", "b_pin", "a", "b", "step", "error"]),
    ("Position", &["position", "count", "held", "reference", "delta", "contact", "penetration", "period", "velocity"]),
    ("Sines", &["sine", "cosine", "valid"]),
    ("Tip", &["x", "y", "z", "radius"]),
    ("Room", &["x_low", "x_high", "y_low", "y_high", "z_low", "z_high", "room", "force_x", "force_y", "force_z"]),
    (
        "Torque path",
        &["stiffness", "spring", "scale", "damping", "drag", "torque", "memory", "scaled", "shaped", "host", "command"],
    ),
    ("PWM & bridge", &["a_high", "a_low", "b_high", "b_low"]),
];
/// Nets that are drawn as curves.
const CURVES: [&str; 20] = [
    "position",
    "count",
    "held",
    "delta",
    "penetration",
    "velocity",
    "x",
    "y",
    "z",
    "force_x",
    "force_y",
    "force_z",
    "spring",
    "drag",
    "torque",
    "memory",
    "shaped",
    "host",
    "command",
    "radius",
];

// Trace flags of GTKWave (TR_*_B in its analyzer.h). The save file has them in hexadecimal.
const HEXADECIMAL: u32 = 1 << 1;
const DECIMAL: u32 = 1 << 2;
const BINARY: u32 = 1 << 3;
const RIGHT: u32 = 1 << 5;
const BLANK: u32 = 1 << 9;
const SIGNED: u32 = 1 << 10;
const STEP: u32 = 1 << 15;
const INTERPOLATED: u32 = 1 << 16;
const STRETCH: u32 = 1 << 17;
const FULL_SCALE: u32 = 1 << 19;
const GROUP_BEGIN: u32 = 1 << 23;
const GROUP_END: u32 = 1 << 24;
const FIXED_POINT: u32 = 1 << 30;

/// Empty rows below a curve. The curve is drawn over them too.
const STRETCH_ROWS: usize = 2;
// The sizes in pixels of the window and its panes, and the width of the waves.
const SIZE: (u32, u32) = (1500, 1000);
const TREE_WIDTH: u32 = 280;
const NAMES_WIDTH: u32 = 340;
const WAVES_WIDTH: u32 = SIZE.0 - TREE_WIDTH - NAMES_WIDTH - 40;

/// Returns a save file that opens a waveform ready to read. It shows the clock, if there is one, and groups from the
/// encoder to the plant. Bits are shown as bits, and words as decimal numbers with their fraction bits. The loop's
/// words and the plant's outputs are curves, scaled to the whole run. `span` fills the window. The primary marker is at
/// an edge, if one is to be marked; markers A to Z are at the first 26 `named` edges, whose names a comment tells.
///
/// `dump` is the name of the waveform's file; GTKWave looks for it beside the save file.
pub fn gtkw(
    layout: &Layout,
    dump: &str,
    clock: Clock,
    span: Range<Cycle>,
    marker: Option<Cycle>,
    named: &[(Cycle, String)],
) -> String {
    let tree: Vec<_> = layout.scopes().iter().map(|scope| scope.name.as_str()).collect();
    let mut file = header(&tree, dump, clock, span, marker, named);
    file.extend(trace(layout, Source::Clock, BINARY | RIGHT, 0, None));
    for (group, nets) in groups(layout) {
        write_group(&mut file, &group, nets.into_iter().filter_map(|net| net_trace(layout, net)));
    }
    let curve = RIGHT | SIGNED | INTERPOLATED | FULL_SCALE;
    let reals = (0..layout.reals.len()).filter_map(|real| trace(layout, Source::Real(real), curve, 0, None));
    write_group(&mut file, PLANT, reals);
    file
}

/// The name of the group of the net that a comparison has.
const VHDL_AND_EMULATOR: &str = "VHDL and emulator";

/// The name of the group of the plant's outputs.
pub(crate) const PLANT: &str = "Plant: torques and forces positive along the positive position";

/// Returns the groups of a layout's nets, with the indices of their nets.
pub(crate) fn groups(layout: &Layout) -> Vec<(String, Vec<usize>)> {
    if let Some(own) = &layout.own {
        return instances(layout, own);
    }
    let own = if layout.waves.groups.is_empty() { GROUPS } else { layout.waves.groups };
    let groups = [&[(VHDL_AND_EMULATOR, &[DIFFERS][..])], own].concat();
    let all = || layout.nets.iter().enumerate();
    let of = |name: &'static str| all().filter(move |(_, net)| base(net.name) == name).map(|(index, _)| index);
    let mut found: Vec<(String, Vec<usize>)> = groups
        .iter()
        .map(|(group, names)| ((*group).to_string(), names.iter().flat_map(|&name| of(name)).collect()))
        .collect();
    let named = |net: &Signal| groups.iter().any(|(_, names)| names.contains(&base(net.name)));
    found.push(("Other".to_string(), all().filter(|(_, net)| !named(net)).map(|(index, _)| index).collect()));
    found
}

/// Returns the groups of a design of the user's own: its ports, then a group for each instance with signals inside.
fn instances(layout: &Layout, own: &[OwnNet]) -> Vec<(String, Vec<usize>)> {
    const PORTS: &str = "Ports";
    let top = layout.scopes.first().map_or("", |scope| &scope.name);
    let mut found = vec![(VHDL_AND_EMULATOR.to_string(), Vec::new()), (PORTS.to_string(), Vec::new())];
    for (index, net) in layout.nets.iter().enumerate() {
        let group = match own.get(index) {
            None => VHDL_AND_EMULATOR,
            Some(OwnNet { is_port: true, .. }) => PORTS,
            Some(_) => net.name.rsplit_once('.').map_or(top, |(instance, _)| instance),
        };
        match found.iter_mut().find(|(name, _)| name == group) {
            Some((_, nets)) => nets.push(index),
            None => found.push((group.to_string(), vec![index])),
        }
    }
    found
}

/// Returns whether a net is drawn as a curve.
pub(crate) fn is_curve(layout: &Layout, index: usize) -> bool {
    let net = &layout.nets[index];
    if let Some(own) = &layout.own {
        return net.format != Format::BIT && own.get(index).is_some_and(|own| own.is_quantity);
    }
    net.format != Format::BIT && [&CURVES[..], layout.waves.curves].iter().any(|names| names.contains(&base(net.name)))
}

/// Returns a net's name without the number of its joint.
fn base(name: &str) -> &str {
    name.trim_end_matches(['1', '2', '3'])
}

/// Returns the beginning of a save file: the window, open scopes of the hierarchy, and markers, if any.
pub(crate) fn header(
    tree: &[&str],
    dump: &str,
    clock: Clock,
    span: Range<Cycle>,
    marker: Option<Cycle>,
    named: &[(Cycle, String)],
) -> String {
    // GTKWave counts in units of a thousand: times in 10 ns are written in nanoseconds.
    let timescale = Timescale::of(clock);
    let (start, end) = (timescale.in_thousands(span.start), timescale.in_thousands(span.end));
    // GTKWave shows 2^-zoom units of time in 200 pixels.
    let zoom = -libm::log2(end.saturating_sub(start).max(1) as f64 * 200.0 / f64::from(WAVES_WIDTH));
    let mut marker = marker.map_or("-1".to_string(), |marker| timescale.in_thousands(marker).to_string());
    for (edge, _) in named.iter().take(26) {
        let _ = write!(marker, " {}", timescale.in_thousands(*edge));
    }
    let mut text = String::from("[*] Save file of a waveform written by hpu\n");
    for (letter, (_, name)) in ('A'..='Z').zip(named) {
        let _ = writeln!(text, "[*] marker {letter}: {name}");
    }
    // GTKWave finds the dump by its path relative to the save file, even when both have been moved to another
    // directory.
    let _ = writeln!(text, "[dumpfile] \"/{dump}\"\n[savefile] \"/{dump}.gtkw\"");
    let _ = writeln!(text, "[timestart] {start}\n[size] {} {}\n[pos] -1 -1\n*{zoom:.6} {marker}", SIZE.0, SIZE.1);
    for scope in tree {
        let _ = writeln!(text, "[treeopen] {scope}.");
    }
    let _ = writeln!(text, "[sst_width] {TREE_WIDTH}\n[signals_width] {NAMES_WIDTH}\n[sst_expanded] 1");
    text
}

fn write_group(file: &mut String, name: &str, traces: impl Iterator<Item = String>) {
    let traces: String = traces.collect();
    if !traces.is_empty() {
        let (begin, end) = (GROUP_BEGIN | BLANK, GROUP_END | BLANK);
        let _ = write!(file, "@{begin:x}\n-{name}\n{traces}@{end:x}\n-{name}\n");
    }
}

fn net_trace(layout: &Layout, index: usize) -> Option<String> {
    let net @ Signal { name, format, unit, .. } = &layout.nets[index];
    let flags = if is_plain(layout, index) { HEXADECIMAL | RIGHT } else { word_flags(net) };
    let flags = if is_curve(layout, index) { flags | STEP | FULL_SCALE } else { flags };
    let read = if net.is_counter() { ", read as signed" } else { "" };
    let alias = (*unit != "1").then(|| format!("{name} ({unit}{read})"));
    trace(layout, Source::Net(index), flags, format.frac(), alias)
}

/// Returns whether a net is a word of a design of the user's own that is no number: bits, an enumeration or a
/// structure.
pub(crate) fn is_plain(layout: &Layout, index: usize) -> bool {
    let own = layout.own.as_ref().and_then(|own| own.get(index));
    layout.nets[index].format != Format::BIT && own.is_some_and(|own| !own.is_quantity)
}

/// Returns the flags of a word: a bit is shown as a bit, a number in decimal.
pub(crate) fn word_flags(net: &Signal) -> u32 {
    match net.format {
        Format::BIT => BINARY | RIGHT,
        format if format.is_signed() || net.is_counter() => SIGNED | RIGHT,
        _ => DECIMAL | RIGHT,
    }
}

/// Returns the trace of a source; `None` when the layout does not show the source.
fn trace(layout: &Layout, source: Source, flags: u32, frac: i32, alias: Option<String>) -> Option<String> {
    let (path, name) = layout.scopes().iter().find_map(|scope| find(scope, source))?;
    let mut text = line(&format!("{path}.{name}"), flags, frac, alias);
    if flags & (STEP | INTERPOLATED) != 0 {
        let _ = writeln!(text, "@{STRETCH:x}");
        text.push_str(&"-\n".repeat(STRETCH_ROWS));
    }
    Some(text)
}

/// Returns the trace of the variable at a path.
pub(crate) fn line(path: &str, flags: u32, frac: i32, alias: Option<String>) -> String {
    let mut text = if frac > 0 {
        format!("@{:x}\n[fpshift_count] {frac}\n", flags | FIXED_POINT)
    } else {
        format!("@{flags:x}\n")
    };
    if let Some(alias) = alias {
        let _ = write!(text, "+{{{alias}}} ");
    }
    let _ = writeln!(text, "{path}");
    text
}

/// Returns the first variable that shows a source, with the path of its scope.
pub(crate) fn find(scope: &Scope, source: Source) -> Option<(String, &str)> {
    if let Some(Var { name, .. }) = scope.vars.iter().find(|var| var.source == source) {
        return Some((scope.name.clone(), name));
    }
    let (path, name) = scope.scopes.iter().find_map(|inner| find(inner, source))?;
    Some((format!("{}.{path}", scope.name), name))
}
