//! Recorded input: encoder lines from a logic analyser (VCD), and motions from a table (CSV).

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt;

use vcd::{Command, IdCode, ScopeItem};

use crate::text::message::{self, excerpt};

/// The levels of the two encoder lines from a time on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PinEdge {
    /// Time in picoseconds since the capture's zero, rounded down.
    pub picoseconds: u64,
    /// Level of line A.
    pub a: bool,
    /// Level of line B.
    pub b: bool,
}

/// The reason why a recording was refused, and the line of the recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ReplayError {
    /// Line of the recording, from 1.
    pub line: u64,
    /// The fault there, and what is accepted.
    pub reason: String,
}

impl ReplayError {
    fn new(line: u64, reason: impl Into<String>) -> Self {
        Self { line, reason: reason.into() }
    }
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.line, self.reason)
    }
}

impl std::error::Error for ReplayError {}

/// Reads two channels of a VCD file, as sigrok and PulseView write it.
///
/// A channel is named as in the file, or with its scopes (`libsigrok.D0`) when several have the name. Any timescale
/// from 1 fs to 100 s is read. The first element holds the initial levels (0 for a line without one), every other a
/// change; changes of both lines at one time are one element. Changes at one time are taken as simultaneous, so a pulse
/// of no duration does not exist.
///
/// # Errors
///
/// [`ReplayError`] for a file that is not VCD, a missing, ambiguous or wide channel (listed with the existing ones), an
/// unknown level (`x`, `z`), time running backwards, a time beyond 2^64 ps, and a last line without its line feed.
pub fn read_capture(bytes: &[u8], channel_a: &str, channel_b: &str) -> Result<Vec<PinEdge>, ReplayError> {
    whole(bytes)?;
    let mut parser = vcd::Parser::new(bytes);
    let header = parser.parse_header().map_err(|error| from_parser(&error, 1))?;
    let line = parser.line();
    let (count, unit) = header.timescale.ok_or_else(|| ReplayError::new(line, "no $timescale, as in `1 us`"))?;
    if ![1, 10, 100].contains(&count) {
        return Err(ReplayError::new(line, format!("a timescale of {count}; VCD knows 1, 10 and 100")));
    }
    let femtoseconds = 1_000_000_000_000_000 / u128::from(unit.divisor()) * u128::from(count);

    let mut channels = Vec::new();
    collect(&header.items, "", &mut channels);
    let a = find(&channels, channel_a).map_err(|reason| ReplayError::new(line, reason))?;
    let b = find(&channels, channel_b).map_err(|reason| ReplayError::new(line, reason))?;
    if a == b {
        return Err(ReplayError::new(line, format!("`{channel_a}` and `{channel_b}` are one channel; name two")));
    }

    let mut edges: Vec<PinEdge> = Vec::new();
    let mut now = PinEdge { picoseconds: 0, a: false, b: false };
    let mut time = 0;
    while let Some(command) = parser.next().transpose().map_err(|error| from_parser(&error, parser.line()))? {
        match command {
            Command::Timestamp(later) if later < time => {
                let reason = format!("time runs backwards, from #{time} to #{later}");
                return Err(ReplayError::new(parser.line(), reason));
            }
            Command::Timestamp(later) => {
                settle(&mut edges, now);
                time = later;
                now.picoseconds = u64::try_from(u128::from(later) * femtoseconds / 1000)
                    .map_err(|_| ReplayError::new(parser.line(), format!("#{later} is beyond 2^64 ps")))?;
            }
            Command::ChangeScalar(code, value) if code == a || code == b => {
                let level = match value {
                    vcd::Value::V0 => false,
                    vcd::Value::V1 => true,
                    unknown => {
                        let reason = format!("the level `{unknown}` is neither 0 nor 1");
                        return Err(ReplayError::new(parser.line(), reason));
                    }
                };
                *(if code == a { &mut now.a } else { &mut now.b }) = level;
            }
            _ => {}
        }
    }
    settle(&mut edges, now);
    Ok(edges)
}

/// Refuses a recording whose last line has no line feed: it may be cut within a number, and nothing else would show
/// that.
fn whole(bytes: &[u8]) -> Result<(), ReplayError> {
    if bytes.last().is_none_or(|last| *last == b'\n') {
        return Ok(());
    }
    let line = bytes.iter().filter(|byte| **byte == b'\n').count() + 1;
    Err(ReplayError::new(line as u64, CUT))
}

/// The reason for refusing a table or a recording whose last line has no line feed.
pub const CUT: &str = "the last line has no line feed, so the file may be cut short; end a whole one with a line feed";

/// Appends the levels reached at a time, unless they equal the levels before.
fn settle(edges: &mut Vec<PinEdge>, now: PinEdge) {
    match edges.last_mut() {
        Some(last) if (last.a, last.b) == (now.a, now.b) => {}
        // A time may occur twice; then only its last levels count.
        Some(last) if last.picoseconds == now.picoseconds => *last = now,
        _ => edges.push(now),
    }
}

/// A channel's name with its scopes, without them, its width and its code.
type Channel = (String, String, u32, IdCode);

fn collect(items: &[ScopeItem], scopes: &str, channels: &mut Vec<Channel>) {
    for item in items {
        match item {
            ScopeItem::Scope(scope) => collect(&scope.items, &format!("{scopes}{}.", scope.identifier), channels),
            ScopeItem::Var(var) => {
                channels.push((format!("{scopes}{}", var.reference), var.reference.clone(), var.size, var.code));
            }
            _ => {}
        }
    }
}

fn find(channels: &[Channel], name: &str) -> Result<IdCode, String> {
    let named: BTreeMap<IdCode, &Channel> = channels
        .iter()
        .filter(|(path, short, ..)| path == name || short == name)
        .map(|channel| (channel.3, channel))
        .collect();
    let mut named = named.into_values();
    match (named.next(), named.next()) {
        (Some((_, _, 1, code)), None) => Ok(*code),
        (Some((path, _, width, _)), None) => Err(format!("channel `{path}` has {width} bits; an encoder line has one")),
        (Some((one, ..)), Some((other, ..))) => {
            Err(format!("several channels are named `{name}`; write the scopes too: {one}, {other}"))
        }
        (None, _) => {
            let there: Vec<&str> = channels.iter().filter(|c| c.2 == 1).map(|c| c.0.as_str()).collect();
            let there = if there.is_empty() { "none".to_string() } else { there.join(", ") };
            Err(format!("no channel `{name}`; one-bit channels of this file: {there}"))
        }
    }
}

fn from_parser(error: &std::io::Error, line: u64) -> ReplayError {
    match error.get_ref().and_then(|inner| inner.downcast_ref::<vcd::ParseError>()) {
        Some(error) => ReplayError::new(error.line(), format!("not VCD: {}", error.kind())),
        None => ReplayError::new(line, format!("not VCD: {error}")),
    }
}

/// A motion from a table.
#[derive(Clone, PartialEq, Debug)]
pub enum Motion {
    /// Times in seconds and angles in radians.
    Angles(Vec<(f64, f64)>),
    /// Times in seconds and the counts of an encoder, each from its first position on up to the next count's.
    Counts(Vec<(f64, i64)>),
}

/// The greatest size of a count in a table.
const MOST_COUNT: f64 = 1e9;

/// Reads a motion: a table with the header `time_s,angle_rad`, `time_s,angle_deg` or `time_s,count`, one point a line.
///
/// Empty lines and lines that start with `#` are skipped. Returns times in seconds, strictly increasing, and angles in
/// radians or counts; `most` holds the latest accepted time and the greatest accepted size of an angle.
///
/// # Errors
///
/// [`ReplayError`] for another header, another number of columns, a value that is not a finite number, a count that is
/// not a whole number, a time that does not increase, a value beyond the greatest, a table without points, and a last
/// line without its line feed.
///
/// # Example
///
/// ```
/// use hpu_cosim::replay::{Motion, read_motion_csv};
/// let motion = read_motion_csv("time_s,angle_rad\n0,0\n0.5,1.25\n", (10.0, 6.3)).unwrap();
/// assert_eq!(motion, Motion::Angles(vec![(0.0, 0.0), (0.5, 1.25)]));
/// ```
pub fn read_motion_csv(text: &str, most: (f64, f64)) -> Result<Motion, ReplayError> {
    whole(text.as_bytes())?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let accepted = "write `time_s,angle_rad`, `time_s,angle_deg` or `time_s,count`";
    let (line, header) = lines.next().ok_or_else(|| ReplayError::new(1, format!("no header; {accepted}")))?;
    let columns: Vec<&str> = header.split(',').map(str::trim).collect();
    // The column of the positions, and the greatest value in it.
    let (column, most_value) = match columns[..] {
        ["time_s", column @ "angle_rad"] => (column, most.1),
        ["time_s", column @ "angle_deg"] => (column, most.1 / (PI / 180.0)),
        ["time_s", column @ "count"] => (column, MOST_COUNT),
        _ => {
            return Err(ReplayError::new(line, format!("the header `{}` is not known; {accepted}", excerpt(header))));
        }
    };
    let mut motion: Vec<(f64, f64)> = Vec::new();
    for (line, row) in lines {
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        let [time, position] = cells[..] else {
            return Err(ReplayError::new(line, format!("{} columns; the header has 2", cells.len())));
        };
        let number = |cell: &str| {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| ReplayError::new(line, format!("`{}` is not a finite number", excerpt(cell))))
        };
        let within = |cell: &str, value: f64, least: f64, most: f64| {
            let beyond =
                || format!("{}; accepted: {} to {}", excerpt(cell), message::number(least), message::number(most));
            if (least..=most).contains(&value) { Ok(value) } else { Err(ReplayError::new(line, beyond())) }
        };
        let time_s = within(time, number(time)?, 0.0, most.0)?;
        let value = within(position, number(position)?, -most_value, most_value)?;
        if column == "count" && value.fract() != 0.0 {
            let reason = format!("`{}` is not a count; write a whole number", excerpt(position));
            return Err(ReplayError::new(line, reason));
        }
        if let Some((before_s, _)) = motion.last().filter(|(before_s, _)| time_s <= *before_s) {
            let reason = format!(
                "time must increase from line to line: {} s follows {} s",
                message::number(time_s),
                message::number(*before_s)
            );
            return Err(ReplayError::new(line, reason));
        }
        motion.push((time_s, if column == "angle_deg" { value.to_radians() } else { value }));
    }
    if motion.is_empty() {
        return Err(ReplayError::new(line, "no point follows the header"));
    }
    Ok(match column {
        "count" => Motion::Counts(motion.into_iter().map(|(time_s, count)| (time_s, count as i64)).collect()),
        _ => Motion::Angles(motion),
    })
}
