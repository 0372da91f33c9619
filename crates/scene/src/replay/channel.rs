//! The channels of a file, and the levels of two of them while the file is read.

use super::PinEdge;
use crate::text::message::did_you_mean;

/// Two recorded lines.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Capture {
    /// The levels at the beginning of the recording, which is its first known level, and after every change.
    pub edges: Vec<PinEdge>,
    /// The end of the recording in picoseconds, rounded down.
    pub end_picoseconds: i64,
    /// The column of the times, of a table.
    pub times: Option<String>,
    /// Notes on values that the reader took otherwise than they are written.
    pub notes: Vec<String>,
}

/// Returns the indices of `[7:0]`, or of `[3]`.
pub(super) fn range(text: &str) -> Option<(i64, i64)> {
    let inside = text.strip_prefix('[')?.strip_suffix(']')?;
    let (left, right) = inside.split_once(':').unwrap_or((inside, inside));
    Some((left.trim().parse().ok()?, right.trim().parse().ok()?))
}

/// A channel of a file: a variable, or one bit of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Channel<Code> {
    /// The code of the variable.
    pub(super) code: Code,
    /// The place of the bit from the left of a value of full width; 0 of a variable of one bit.
    pub(super) bit: usize,
    /// The number of bits of the variable.
    pub(super) width: usize,
}

/// A variable of a file.
pub(super) struct Variable<Code> {
    /// Its name with its scopes, `top.u.ab`.
    pub(super) path: String,
    /// Its name.
    pub(super) name: String,
    /// The indices of its leftmost and its rightmost bit, if the file has them.
    pub(super) range: Option<(i64, i64)>,
    /// The number of its bits.
    pub(super) width: usize,
    pub(super) code: Code,
}

/// Returns a name without the differences between programs: `/m/ab(0)`, `m.ab [0]` and `m.\\ab[0]` are one.
fn plain(name: &str) -> String {
    let name = name.trim().trim_start_matches(['/', '.']).replace('/', ".").replace(['\\', ' '], "");
    match name.strip_suffix(')').and_then(|rest| rest.rsplit_once('(')) {
        Some((name, index)) if index.bytes().all(|byte| byte.is_ascii_digit()) => format!("{name}[{index}]"),
        _ => name,
    }
}

impl<Code: Copy + PartialEq> Variable<Code> {
    fn is_named(&self, name: &str) -> bool {
        self.path == name || self.name == name
    }

    /// Returns whether a name of [`plain`] form is this variable's, or that of its only bit without the index.
    fn is_plainly(&self, name: &str) -> bool {
        let is = |own: &str| {
            let own = plain(own);
            own == name || self.width == 1 && indexed(&own).is_some_and(|(stem, _)| stem == name)
        };
        is(&self.path) || is(&self.name)
    }

    /// Returns the bit at an index.
    fn bit(&self, index: i64) -> Option<Channel<Code>> {
        let (left, right) = self.range.unwrap_or((self.width as i64 - 1, 0));
        let inside = (left.min(right)..=left.max(right)).contains(&index);
        let bit = usize::try_from((left - index).abs()).ok().filter(|bit| inside && *bit < self.width)?;
        Some(Channel { code: self.code, bit, width: self.width })
    }
}

/// Returns a name without the index at its end, and the index: `ab[1]` is `ab` and 1.
fn indexed(name: &str) -> Option<(&str, i64)> {
    let (name, index) = name.strip_suffix(']')?.rsplit_once('[')?;
    Some((name, index.parse().ok()?))
}

/// Finds the channel of a name.
pub(super) fn find<Code: Copy + PartialEq>(variables: &[Variable<Code>], name: &str) -> Result<Channel<Code>, String> {
    // The same variable may stand in several scopes under one code.
    let with = |is: &dyn Fn(&Variable<Code>) -> bool| {
        let mut named: Vec<&Variable<Code>> = Vec::new();
        for variable in variables.iter().filter(|variable| is(variable)) {
            if !named.iter().any(|other| other.code == variable.code) {
                named.push(variable);
            }
        }
        named
    };
    let (exact, simple) = (with(&|one| one.is_named(name)), plain(name));
    let named = if exact.is_empty() { with(&|one| one.is_plainly(&simple)) } else { exact };
    match named[..] {
        [one] if one.width == 1 => return Ok(Channel { code: one.code, bit: 0, width: 1 }),
        [one] => {
            let (path, width) = (&one.path, one.width);
            return Err(format!("channel `{path}` has {width} bits; an encoder line has one, as in `{path}[0]`"));
        }
        [one, other, ..] => {
            let [one, other] = [one, other].map(|variable| &variable.path);
            return Err(format!("several channels are named `{name}`; write the scopes too: {one}, {other}"));
        }
        [] => {}
    }
    if let Some((of, index)) = indexed(&simple) {
        let bit = variables.iter().filter(|variable| variable.is_plainly(of)).find_map(|variable| variable.bit(index));
        if let Some(bit) = bit {
            return Ok(bit);
        }
    }
    let there: Vec<&str> = variables.iter().filter(|one| one.width == 1).map(|one| one.path.as_str()).collect();
    let near = did_you_mean(name, &there);
    let there = if there.is_empty() { "none".to_string() } else { there.join(", ") };
    let wide: Vec<&str> = variables.iter().filter(|one| one.width > 1).map(|one| one.path.as_str()).collect();
    let wide = if wide.is_empty() { String::new() } else { format!("; with bits, as in `ab[0]`: {}", wide.join(", ")) };
    Err(format!("no channel `{name}`; one-bit channels of this file: {there}{wide}{near}"))
}

/// Finds both channels; they must differ.
pub(super) fn find_both<Code: Copy + PartialEq>(
    variables: &[Variable<Code>],
    [a, b]: [&str; 2],
) -> Result<[Channel<Code>; 2], String> {
    let found = [find(variables, a)?, find(variables, b)?];
    match found[0] == found[1] {
        true => Err(format!("`{a}` and `{b}` are one channel; name two")),
        false => Ok(found),
    }
}

/// The levels of two lines while a file is read.
#[derive(Default)]
pub(super) struct Lines {
    levels: [Option<bool>; 2],
    now: i64,
    edges: Vec<(i64, [Option<bool>; 2])>,
}

impl Lines {
    /// Goes on to a time, which is not before the present one.
    pub(super) fn to(&mut self, picoseconds: i64) {
        self.settle();
        self.now = picoseconds;
    }

    /// Sets the level of a line; `None` is unknown.
    pub(super) fn set(&mut self, line: usize, level: Option<bool>) -> Result<(), &'static str> {
        match level {
            None if self.levels[line].is_some() => Err("neither 0 nor 1, after a level that is known"),
            _ => {
                self.levels[line] = level;
                Ok(())
            }
        }
    }

    /// Notes the levels reached at the present time, unless they equal the levels before.
    fn settle(&mut self) {
        match self.edges.last_mut() {
            Some((_, levels)) if *levels == self.levels => {}
            // A time may occur twice; then only its last levels count.
            Some((time, levels)) if *time == self.now => *levels = self.levels,
            _ => self.edges.push((self.now, self.levels)),
        }
    }

    /// Returns the capture; unknown levels at its beginning are the first known ones. Refuses a line without any.
    pub(super) fn ended(mut self, names: [&str; 2]) -> Result<Capture, String> {
        self.settle();
        if let Some((_, name)) = self.levels.iter().zip(names).find(|(level, _)| level.is_none()) {
            return Err(format!("the channel `{name}` has no level 0 or 1 in the whole recording"));
        }
        // A recording begins at its first known level.
        let begin = self.edges.iter().position(|(_, levels)| *levels != [None; 2]).unwrap_or(0);
        let first = [0, 1].map(|line| self.edges.iter().find_map(|(_, levels)| levels[line]).unwrap_or(false));
        let mut edges: Vec<PinEdge> = Vec::new();
        for (picoseconds, levels) in self.edges.into_iter().skip(begin) {
            let [a, b] = [0, 1].map(|line| levels[line].unwrap_or(first[line]));
            if edges.last().is_none_or(|last| (last.a, last.b) != (a, b)) {
                edges.push(PinEdge { picoseconds, a, b });
            }
        }
        Ok(Capture { edges, end_picoseconds: self.now, times: None, notes: Vec::new() })
    }
}

/// Returns the level of a value of VHDL or Verilog; `None` for an unknown one.
pub(super) fn level(value: u8) -> Option<bool> {
    match value {
        b'0' | b'L' | b'l' => Some(false),
        b'1' | b'H' | b'h' => Some(true),
        _ => None,
    }
}

/// Returns the value of a bit, from the left, of a vector's value, which may be shorter than the vector: it is then
/// extended by 0, or by the unknown value it begins with.
pub(super) fn bit_of(value: &[u8], bit: usize, width: usize) -> u8 {
    let missing = width.saturating_sub(value.len());
    match value.first() {
        Some(b'0' | b'1') | None if bit < missing => b'0',
        Some(first) if bit < missing => *first,
        _ => value[bit - missing.min(bit)],
    }
}
