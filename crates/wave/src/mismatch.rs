//! A waveform of the rows around a mismatch: the emulator's words, and beside them those of the other side.
//!
//! The file is a VCD, because a VCD can hold unknown bits. The inputs of a clocked block change half a cycle before the
//! edge that samples them, and all other signals change at the edge. `differs` is 1 in a row in which a word differs.

use std::fmt::Write;

use hpu_signal::{Cycle, Format, Signal};
use vcd::IdCode;

use crate::VERSION;
use crate::gtkw::{header, line, word_flags};
use crate::timescale::Timescale;
use crate::{Around, ComparedRow};

/// The scope of the emulator's words.
const EMULATOR: &str = "emulator";
/// The index of `clk` among the variables. Combinational logic has no `clk`.
const CLK: usize = 1;

/// A variable of the file: its scope under the topmost one, if any, its name, its format.
struct Var<'a> {
    scope: Option<&'a str>,
    name: &'static str,
    format: Format,
}

impl Var<'_> {
    /// Returns the name with the range of its bits.
    fn ranged(&self) -> String {
        match self.format.width() {
            1 => self.name.to_string(),
            width => format!("{}[{}:0]", self.name, width - 1),
        }
    }
}

/// Returns the variables in the order of [`values`]: the row's number, `clk`, `differs`, inputs, then both sides.
fn vars(around: &Around) -> Vec<Var<'_>> {
    let (inputs, answers) = around.columns.split_at(around.inputs);
    let top = [(around.counted, Format::unsigned(32)), ("clk", Format::BIT), ("differs", Format::BIT)];
    let top = top.into_iter().chain(inputs.iter().map(|column| (column.name, column.format)));
    let top = top.map(|(name, format)| Var { scope: None, name, format });
    let sides = [EMULATOR, around.beside].into_iter().flat_map(|scope| {
        answers.iter().map(move |column| Var { scope: Some(scope), name: column.name, format: column.format })
    });
    top.chain(sides).collect()
}

/// Returns whether a variable changes half a cycle before an edge.
fn changes_before(around: &Around, index: usize) -> bool {
    is_clocked(around) && (3..3 + around.inputs).contains(&index)
}

fn is_clocked(around: &Around) -> bool {
    around.inputs == 0 || around.columns[0].name == "rst"
}

/// Returns the bits of all variables after the edge of a row.
fn values(around: &Around, row: &ComparedRow) -> Vec<String> {
    let differs = row.expected[around.inputs..] != row.got;
    let own = [format!("{:032b}", row.number), "1".to_string(), u8::from(differs).to_string()];
    let formats = around.columns.iter().map(|column| column.format);
    let expected = row.expected.iter().zip(formats.clone()).map(|(word, format)| bits(word, format));
    let got = row.got.iter().zip(formats.skip(around.inputs)).map(|(word, format)| bits(word, format));
    own.into_iter().chain(expected).chain(got).collect()
}

/// Returns the bits of a word in hex. A character that is not a hex digit stands for unknown bits.
fn bits(word: &str, format: Format) -> String {
    let four = |digit: char| digit.to_digit(16).map_or("xxxx".to_string(), |digit| format!("{digit:04b}"));
    let all: String = word.chars().map(four).collect();
    all[all.len().saturating_sub(format.width() as usize)..].to_string()
}

/// Returns the rows around a mismatch as a VCD.
pub fn mismatch_vcd(around: &Around) -> String {
    let timescale = Timescale::of(around.clock);
    let vars = vars(around);
    let mut text =
        format!("$version {VERSION} $end\n$timescale {timescale} $end\n$scope module {} $end\n", around.name);
    let mut scope = None;
    for (index, var) in vars.iter().enumerate() {
        if var.scope != scope {
            let up = if scope.is_some() { "$upscope $end\n" } else { "" };
            let _ = writeln!(text, "{up}$scope module {} $end", var.scope.unwrap_or_default());
            scope = var.scope;
        }
        if index == CLK && !is_clocked(around) {
            continue;
        }
        let (width, code) = (var.format.width(), IdCode::from(index as u64));
        let _ = writeln!(text, "$var wire {width} {code} {} $end", var.ranged());
    }
    text += "$upscope $end\n$upscope $end\n$enddefinitions $end\n";
    let mut known = vec![String::new(); vars.len()];
    let mut write = |time: u64, changes: &mut dyn Iterator<Item = (usize, String)>| {
        let _ = writeln!(text, "#{time}");
        for (index, bits) in changes {
            let shown = index != CLK || is_clocked(around);
            if shown && known[index] != bits {
                let code = IdCode::from(index as u64);
                let _ = if bits.len() == 1 { writeln!(text, "{bits}{code}") } else { writeln!(text, "b{bits} {code}") };
                known[index] = bits;
            }
        }
    };
    for row in &around.rows {
        let edge = timescale.at(Cycle(row.number));
        let values = || values(around, row).into_iter().enumerate();
        if is_clocked(around) {
            let half = timescale.at(Cycle(row.number.saturating_sub(1))).midpoint(edge);
            let falls = std::iter::once((CLK, "0".to_string()));
            write(half, &mut falls.chain(values().filter(|(index, _)| changes_before(around, *index))));
        }
        write(edge, &mut values().filter(|(index, _)| !changes_before(around, *index)));
    }
    write(timescale.at(Cycle(around.rows.last().map_or(0, |row| row.number + 1))), &mut std::iter::empty());
    text
}

/// Returns its GTKWave save file. It shows the emulator's word of each signal above the other word, and a marker at the
/// first difference.
pub fn mismatch_gtkw(around: &Around, number: u64, dump: &str) -> String {
    let ends = [around.rows.first(), around.rows.last()].map(|row| row.map_or(0, |row| row.number));
    let span = Cycle(ends[0].saturating_sub(1))..Cycle(ends[1] + 1);
    let mut text = header(&[around.name], dump, around.clock, span, Some(Cycle(number)), &[]);
    let vars = vars(around);
    let answers = around.columns.len() - around.inputs;
    let mut add = |var: &Var| {
        let scope = var.scope.map_or(String::new(), |scope| format!("{scope}."));
        let path = format!("{}.{scope}{}", around.name, var.ranged());
        let alias = var.scope.map(|scope| format!("{} ({scope})", var.name));
        text += &line(&path, word_flags(&Signal::new(var.name, var.format, "1", "")), var.format.frac(), alias);
    };
    let first = 3 + around.inputs;
    vars[..first].iter().filter(|var| var.name != "clk" || is_clocked(around)).for_each(&mut add);
    (first..first + answers).for_each(|index| [&vars[index], &vars[index + answers]].into_iter().for_each(&mut add));
    text
}
