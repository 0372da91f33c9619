//! The command file for Surfer: which variables it shows, under which headings, and how each is drawn.

use std::fmt::Write;

use hpu_signal::{Clock, Cycle, Format};

use crate::gtkw::{PLANT, find, groups, is_curve, is_plain};
use crate::timescale::Timescale;
use crate::{Layout, Source};

/// Returns a command file that opens a waveform ready to read: `surfer wave.fst -c wave.fst.sucl`. It shows what the
/// save file for GTKWave shows, in the same order, the whole run, and a marker at each `named` edge.
pub fn sucl(layout: &Layout, dump: &str, clock: Clock, named: &[(Cycle, String)]) -> String {
    let mut list = List { layout, items: 0, text: String::new() };
    let _ = writeln!(list.text, "# Commands for a waveform written by hpu: surfer {dump} -c {dump}.sucl");
    list.variable(Source::Clock, None, None);
    for (group, nets) in groups(layout).into_iter().filter(|(_, nets)| !nets.is_empty()) {
        list.heading(&group);
        for index in nets {
            let net = &layout.nets[index];
            let format = match net.format {
                Format::BIT => None,
                _ if is_plain(layout, index) => Some("Hexadecimal"),
                format if format.is_signed() || net.is_counter() => Some("Signed"),
                _ => Some("Unsigned"),
            };
            list.variable(Source::Net(index), format, is_curve(layout, index).then_some("step"));
        }
    }
    if !layout.reals.is_empty() {
        list.heading(PLANT);
    }
    for index in 0..layout.reals.len() {
        list.variable(Source::Real(index), None, Some("interpolated"));
    }
    // Markers are items too. They stand last, because the commands above know items by their places.
    list.text += "item_unfocus\nzoom_fit\n";
    let timescale = Timescale::of(clock);
    for (edge, name) in named {
        let _ = writeln!(list.text, "marker_set {} {}", word(name), timescale.at(*edge));
    }
    list.text
}

/// The commands so far, and the number of the items that they have added.
struct List<'a> {
    layout: &'a Layout,
    items: u32,
    text: String,
}

impl List<'_> {
    /// Adds the variable that shows a source, if there is one, with its format and the way in which it is drawn.
    fn variable(&mut self, source: Source, format: Option<&str>, drawn: Option<&str>) {
        let Some((path, name)) = self.layout.scopes().iter().find_map(|scope| find(scope, source)) else { return };
        // Surfer knows a variable by its name without the range of its bits.
        let name = name.split('[').next().unwrap_or(name);
        let _ = writeln!(self.text, "variable_add {path}.{name}");
        if format.is_some() || drawn.is_some() {
            let _ = writeln!(self.text, "item_focus {}", place(self.items));
        }
        for (command, value) in [("item_set_format", format), ("item_set_analog", drawn)] {
            if let Some(value) = value {
                let _ = writeln!(self.text, "{command} {value}");
            }
        }
        self.items += 1;
    }

    /// Adds a heading.
    fn heading(&mut self, name: &str) {
        let _ = writeln!(self.text, "divider_add {}", word(name));
        self.items += 1;
    }
}

/// Returns a name as the single word that a command takes.
fn word(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_")
}

/// Returns the letters by which Surfer knows the item at a place: hexadecimal digits, with `a` for 0.
fn place(index: u32) -> String {
    let letter = |digit: char| Some(char::from(b'a' + digit.to_digit(16)? as u8));
    format!("{index:x}").chars().filter_map(letter).collect()
}
