//! The delays of Verilog, as Verilator reports the ones that it would leave out.

use hpu_cosim::scene::Dut;

use super::delay::{Delay, time_s};
use super::{bare, words};
use crate::dut::files::plain_names;

/// The unit of a delay where no `timescale` is in force, in seconds: what nearly every design means. Simulators differ
/// in it, from 1 ps to 1 s.
const UNIT_S: f64 = 1e-9;
/// The same for Verilator.
pub(in crate::dut) const TIMESCALE: &str = "1ns/1ps";
/// Marks of delays between a value and its assignment, as in `n <= #1 n + 1` and `assign #2 q = n`.
const ASSIGNED: &str = "%Warning-ASSIGNDLY: ";
/// Marks of statements that wait.
const WAITS: &str = "%Warning-STMTDLY: ";

/// The delays that Verilator leaves out of a design.
#[derive(Debug, Default)]
pub(in crate::dut) struct Dropped {
    /// Delays between a value and its assignment.
    pub(in crate::dut) assigned: Vec<Delay>,
    /// Statements that wait.
    pub(in crate::dut) waits: Vec<Delay>,
}

impl Dropped {
    /// Reads Verilator's warnings about a design.
    pub(in crate::dut) fn of(dut: &Dut, said: &str) -> Self {
        let mut dropped = Self::default();
        if !said.contains(ASSIGNED) && !said.contains(WAITS) {
            return dropped;
        }
        let sources = Sources::of(dut);
        for (mark, delays) in [(ASSIGNED, &mut dropped.assigned), (WAITS, &mut dropped.waits)] {
            let told = said.lines().filter_map(|line| line.strip_prefix(mark)?.split_once(": "));
            delays.extend(told.filter_map(|(place, _)| sources.delay(dut, place)));
        }
        dropped
    }
}

/// Returns whether Verilator refuses a design because it waits: for a time, an event or a level.
pub(in crate::dut) fn waits(said: &str) -> bool {
    ["NOTIMING", "NEEDTIMINGOPT", "--timing"].iter().any(|word| said.contains(word))
}

/// Returns Verilator's message with the places in which hpu has looked for a missing file, instead of those in the
/// folder of the tools.
pub(in crate::dut) fn with_places(said: &str) -> String {
    let mut text = String::with_capacity(said.len());
    let mut is_place = false;
    for line in said.lines() {
        let is_list = line.trim() == "... Looked in:";
        is_place = is_list || is_place && line.starts_with("             ");
        if is_list {
            text += "        ... Looked in the folder of this file, of the design's other files, and of the scene; \
                     put it there, or name it in dut.files\n";
        } else if !is_place {
            text += line;
            text += "\n";
        }
    }
    text
}

/// Returns the place of a unit of time that another one follows or precedes, as an error: Verilator 5.006 counts the
/// delays of all modules in one unit, and in 32 bits of the least time.
pub(in crate::dut) fn mixed(dut: &Dut) -> Option<String> {
    let (mut unit_s, mut of) = (None::<f64>, String::new());
    for (_, own, text) in &Sources::of(dut).0 {
        let mut parts = text.split("`timescale");
        let begin = parts.next().unwrap_or_default();
        if unit_s.is_none() && words(begin).any(|(_, word)| word == "module") {
            (unit_s, of) = (Some(UNIT_S), format!("{own}, which has none and counts in 1 ns"));
        }
        for part in parts {
            let said = part.lines().next().unwrap_or_default().trim();
            let Some((unit, precision)) = said.split_once('/') else { continue };
            let (Some(found), Some(least)) = (time_s(unit), time_s(precision)) else { continue };
            let other = unit_s.is_some_and(|unit_s| unit_s != found);
            if other || least < 1e-12 {
                let against = if other { format!("beside {of}") } else { "below 1 ps".to_string() };
                return Some(format!(
                    "{own}: `timescale {said} {against}: its delays would be simulated wrongly; give all files one \
                     unit, and no less than 1 ps"
                ));
            }
            (unit_s, of) = (Some(found), format!("that of {own}"));
        }
    }
    None
}

/// A source: its name for the tools, its own name, and its text without comments and strings.
struct Sources(Vec<(String, String, String)>);

impl Sources {
    fn of(dut: &Dut) -> Self {
        let text = |content: &[u8]| bare(&String::from_utf8_lossy(content));
        let files = plain_names(dut).into_iter().zip(&dut.files);
        let files = files.map(|((plain, _), (path, content))| (plain.to_string(), path.clone(), text(content)));
        let beside = dut.beside.iter().map(|file| (file.place.clone(), file.path.clone(), text(&file.content)));
        Self(files.chain(beside).collect())
    }

    /// Returns the delay at a place such as `t.v:5:37`.
    fn delay(&self, dut: &Dut, place: &str) -> Option<Delay> {
        let mut parts = place.rsplitn(3, ':');
        let (column, line): (usize, usize) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        let plain = parts.next()?;
        let index = self.0.iter().position(|(name, ..)| name == plain);
        let Some((_, own, text)) = index.map(|index| &self.0[index]) else {
            return Some(Delay { place: format!("{plain}:{line}"), text: "#".to_string(), length_s: None });
        };
        let begin = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum::<usize>();
        let found = written(text[begin..].lines().next().unwrap_or_default(), column);
        let length_s = found.and_then(|(_, value)| self.length(dut, value.trim_start_matches('#').trim()));
        let unit_s = index.map_or(UNIT_S, |index| self.unit_s(index, begin));
        let length_s = length_s.map(|length| match length {
            Length::Units(units) => units * unit_s,
            Length::Seconds(seconds) => seconds,
        });
        let text = found.map_or("#", |(text, _)| text).to_string();
        Some(Delay { place: format!("{own}:{line}"), text, length_s })
    }

    /// Returns the length that a delay's value says: a number, a time, or a name that stands for one everywhere.
    fn length(&self, dut: &Dut, value: &str) -> Option<Length> {
        let value = in_brackets(value);
        // For rising, falling and off, or least, typical and most.
        if value.contains([',', ':']) {
            let mut all = value.split([',', ':']).map(|value| self.length(dut, value));
            return all.try_fold(Length::Units(0.0), |longest, length| Some(longest.longer(length?)));
        }
        if let Some(number) = number(value) {
            return Some(number);
        }
        let (name, is_macro) = value.strip_prefix('`').map_or((value, false), |name| (name, true));
        if !is_macro && let Some((_, value)) = dut.generics.iter().find(|(generic, _)| **generic == *name) {
            return number(&value.to_string());
        }
        let mut longest: Option<Length> = None;
        for (_, _, text) in &self.0 {
            for (at, _) in words(text).filter(|(_, word)| *word == name) {
                let (before, after) = (text[..at].trim_end(), text[at + name.len()..].trim_start_matches([' ', '\t']));
                let value = if is_macro {
                    before.ends_with("`define").then(|| after.lines().next().unwrap_or_default())
                } else if before.ends_with('.') {
                    after.strip_prefix('(').map(|rest| rest.split(')').next().unwrap_or_default())
                } else {
                    let rest = after.strip_prefix('=').filter(|rest| !rest.starts_with('='));
                    rest.map(|rest| rest.split([';', ',', ')', '\n']).next().unwrap_or_default())
                };
                if let Some(value) = value {
                    let length = number(value.trim().trim_start_matches('#'))?;
                    longest = Some(longest.map_or(length, |longest| longest.longer(length)));
                }
            }
        }
        longest
    }

    /// Returns the unit of time in force at a position of a file: that of the last `timescale` before it, also of the
    /// files before.
    fn unit_s(&self, index: usize, at: usize) -> f64 {
        let own = (index, &self.0[index].2[..at]);
        let before = (0..index).rev().map(|index| (index, &*self.0[index].2));
        let last = [own].into_iter().chain(before).find_map(|(_, text)| text.rsplit_once("`timescale"));
        last.and_then(|(_, rest)| time_s(rest.split('/').next()?)).unwrap_or(UNIT_S)
    }
}

/// The length of a delay.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Length {
    Units(f64),
    Seconds(f64),
}

impl Length {
    fn longer(self, other: Self) -> Self {
        let size = |length: Self| match length {
            Self::Units(units) => units * UNIT_S,
            Self::Seconds(seconds) => seconds,
        };
        if size(other) > size(self) { other } else { self }
    }
}

fn in_brackets(value: &str) -> &str {
    let value = value.trim();
    value.strip_prefix('(').and_then(|value| value.strip_suffix(')')).unwrap_or(value).trim()
}

fn number(value: &str) -> Option<Length> {
    let value = in_brackets(value);
    let units = || value.replace('_', "").parse().ok().filter(|units: &f64| units.is_finite() && *units >= 0.0);
    time_s(value).map(Length::Seconds).or_else(|| units().map(Length::Units))
}

/// Returns the delay at a column of a line, from 1 on, as it is written, and its value: `#1`, `#(TCQ)`, or a macro that
/// holds one. Verilator counts a tab up to the next multiple of eight.
fn written(line: &str, column: usize) -> Option<(&str, &str)> {
    let mut counted = 1;
    let at = |(index, c): (usize, char)| {
        let here = counted;
        counted = if c == '\t' { (counted - 1) / 8 * 8 + 9 } else { counted + 1 };
        ("#`".contains(c) && (here == column || index + 1 == column)).then_some(index)
    };
    let rest = &line[line.char_indices().find_map(at)?..];
    let value = rest[1..].trim_start();
    let from = rest.len() - value.len();
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_$.".contains(c);
    let end = match value.chars().next()? {
        '(' => value.find(')')? + 1,
        '`' => 1 + value[1..].find(|c| !is_part(c)).unwrap_or(value.len() - 1),
        _ => value.find(|c| !is_part(c)).unwrap_or(value.len()),
    };
    let value = if rest.starts_with('`') { &rest[..from + end] } else { &value[..end] };
    Some((&rest[..from + end], value))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hpu_cosim::scene::{Generic, Identifier};

    use super::*;

    fn design(files: &[(&str, &str)]) -> Dut {
        let files = files.iter().map(|(name, text)| (name.to_string(), Arc::from(text.as_bytes()))).collect();
        Dut { files, ..Dut::pins() }
    }

    #[test]
    fn delays_are_those_that_verilator_tells_with_their_lengths() {
        let text = "`timescale 10ns/1ns // #9\n\tn <= #1 n; m <= #(TCQ) m;\nassign #`D q = n; assign #2.5ns r = n;\n\
                    `define D 7\nparameter TCQ = 3;\ninitial #(1:2:3) x = 1; initial `W y = 1;\n`define W #4\n";
        let mut dut = design(&[("rtl/t.v", text)]);
        let said = "%Warning-ASSIGNDLY: t.v:2:14: Ignoring\n  2 | x\n%Warning-ASSIGNDLY: t.v:2:25: Ignoring\n\
                    %Warning-ASSIGNDLY: t.v:3:8: Ignoring\n%Warning-ASSIGNDLY: t.v:3:26: Ignoring\n\
                    %Warning-STMTDLY: t.v:6:9: Ignoring\n%Warning-STMTDLY: t.v:6:33: Ignoring\n";
        let Dropped { assigned, waits } = Dropped::of(&dut, said);
        let told: Vec<_> = assigned.iter().chain(&waits).map(|delay| (delay.to_string(), delay.length_s)).collect();
        let ns = |ns: f64| Some(ns * 1e-9);
        let all = [
            ("rtl/t.v:2: `#1`", ns(10.0)),
            ("rtl/t.v:2: `#(TCQ)`", ns(30.0)),
            ("rtl/t.v:3: `#`D`", ns(70.0)),
            ("rtl/t.v:3: `#2.5ns`", ns(2.5)),
            ("rtl/t.v:6: `#(1:2:3)`", ns(30.0)),
            ("rtl/t.v:6: ``W`", ns(40.0)),
        ];
        assert_eq!(told.len(), all.len(), "{told:?}");
        for ((said, length_s), (expected, expected_s)) in told.iter().zip(all) {
            assert_eq!(said, expected);
            let is_near = |(a, b): (f64, f64)| (a - b).abs() < 1e-12 * b;
            assert!(length_s.zip(expected_s).map_or(*length_s == expected_s, is_near), "{said}: {length_s:?}");
        }
        dut.generics = vec![(Identifier::fixed("TCQ"), Generic::Integer(100))];
        assert!(Dropped::of(&dut, said).assigned[1].length_s.is_some_and(|length_s| length_s > 9e-7));
    }

    #[test]
    fn a_missing_file_has_been_looked_for_beside_the_design() {
        let said = "%Error: t.v:1:10: Cannot find include file: defs.vh\n        ... Looked in:\n             defs.vh\n\
                    \x20            obj/defs.vh\n%Error: Exiting\n";
        let told = with_places(said);
        assert!(told.contains("the design's other files") && !told.contains("obj/"), "{told}");
        assert_eq!(told.lines().count(), 3);
    }

    #[test]
    fn a_timescale_holds_in_the_files_after_it_and_a_parameter_counts_by_its_longest_value() {
        let two = "u #(.TCQ(40)) v();\nmodule w; parameter TCQ = 1; assign #TCQ q = n;";
        let dut = design(&[("a.v", "`timescale 1us/1ns\n"), ("b.v", two)]);
        let dropped = Dropped::of(&dut, "%Warning-ASSIGNDLY: b.v:2:37: Ignoring\n");
        assert_eq!(dropped.assigned[0].to_string(), "b.v:2: `#TCQ`");
        assert!(dropped.assigned[0].length_s.is_some_and(|length_s| (length_s - 40e-6).abs() < 1e-9));
    }
}
