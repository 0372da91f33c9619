//! Levels of lines as tables: what Saleae Logic, PulseView and sigrok export by their plain defaults.

use super::ReplayError;
use super::channel::{Capture, Lines, Variable, find_both};
use super::columns::Columns;
use super::motion::TIMES;
use super::table::{Table, by_clock};
use super::units::{self, Scale, name_and_unit};
use crate::text::message::excerpt;

/// Whether a cell of the header names a column of times, and its unit, in picoseconds, if it has one.
fn time_unit(cell: &str) -> Option<Option<i128>> {
    let (name, unit) = name_and_unit(cell);
    // sigrok names the column by the unit alone.
    match units::time(cell) {
        Some(unit) => Some(Some(in_picoseconds(unit))),
        None if TIMES.known.iter().any(|known| name.eq_ignore_ascii_case(known)) => {
            Some(unit.and_then(units::time).map(in_picoseconds))
        }
        None => None,
    }
}

fn in_picoseconds(unit: Scale) -> i128 {
    match unit {
        Scale::Times(seconds) => (seconds * 1e12).round() as i128,
        Scale::Counts => unreachable!("no time has counts"),
    }
}

/// The levels of cells, in lower case; numbers are levels too if they are 0 or 1.
const LEVELS: [(&str, Option<bool>); 19] = [
    ("0", Some(false)),
    ("1", Some(true)),
    ("l", Some(false)),
    ("h", Some(true)),
    ("low", Some(false)),
    ("high", Some(true)),
    ("false", Some(false)),
    ("true", Some(true)),
    ("off", Some(false)),
    ("on", Some(true)),
    ("x", None),
    ("z", None),
    ("u", None),
    ("w", None),
    ("-", None),
    ("?", None),
    ("", None),
    ("unknown", None),
    ("nan", None),
];

/// Returns the level of a cell, which may be an unknown one; `None` if it is no level.
fn level_of(cell: &str) -> Option<Option<bool>> {
    let lower = cell.to_lowercase();
    let known = LEVELS.iter().find(|(name, _)| *name == lower).map(|(_, level)| *level);
    known.or_else(|| match lower.replace(',', ".").parse::<f64>() {
        Ok(0.0) => Some(Some(false)),
        Ok(1.0) => Some(Some(true)),
        _ => None,
    })
}

/// Lines of sigrok above a table: `Channels (2/8): D0, D1` and `Samplerate: 1 MHz`.
struct Sigrok {
    channels: Vec<String>,
    rate_hz: Option<i128>,
}

impl Sigrok {
    fn of(comments: &[&str]) -> Self {
        let after = |key: &str| comments.iter().find_map(|comment| comment.strip_prefix(key));
        let channels = after("Channels (").and_then(|rest| rest.split_once("):")).map_or("", |(_, names)| names);
        let channels = channels.split(',').map(|name| name.trim().to_string()).filter(|name| !name.is_empty());
        let rate_hz = after("Samplerate:").and_then(|rate| {
            let (number, unit) = rate.trim().split_once(' ')?;
            let factor = match unit.trim() {
                "Hz" => 1.0,
                "kHz" => 1e3,
                "MHz" => 1e6,
                "GHz" => 1e9,
                _ => return None,
            };
            Some((number.parse::<f64>().ok()? * factor).round() as i128)
        });
        Self { channels: channels.collect(), rate_hz: rate_hz.filter(|rate_hz| (1..=PICOSECONDS).contains(rate_hz)) }
    }

    /// Returns the unit of sigrok's times, in picoseconds: of s, ms, us and so on the longest that is no longer than a
    /// sample.
    fn unit(&self) -> Option<i128> {
        let rate_hz = self.rate_hz?;
        (0..=4).map(|power| PICOSECONDS / 1000_i128.pow(power)).find(|unit| unit * rate_hz <= PICOSECONDS)
    }

    /// Returns the exact time of a sample in place of sigrok's, which is a multiple of a sample's time in whole units,
    /// rounded down: 41 ns at 24 MHz.
    fn exact(&self, picoseconds: i64, unit: i128) -> i64 {
        let Some(rate_hz) = self.rate_hz.filter(|_| self.unit() == Some(unit)) else { return picoseconds };
        let written = PICOSECONDS / unit / rate_hz * unit;
        let now = i128::from(picoseconds);
        match now % written == 0 {
            true => i64::try_from((now / written * PICOSECONDS).div_euclid(rate_hz)).unwrap_or(picoseconds),
            false => picoseconds,
        }
    }
}

/// Picoseconds in a second.
const PICOSECONDS: i128 = 1_000_000_000_000;

/// Returns the time of a cell in picoseconds, rounded down, exactly for a decimal number; `unit` is in picoseconds.
fn picoseconds(cell: &str, unit: i128) -> Option<i64> {
    let cell = cell.replace(',', ".");
    let (sign, digits) = cell.strip_prefix('-').map_or((1, &*cell), |rest| (-1, rest));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let is_plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.len() > 18 || whole.is_empty() && fraction.is_empty() || !is_plain(whole) || !is_plain(fraction) {
        // A power of ten, as in 1.5e-3.
        let value = cell.parse::<f64>().ok()? * unit as f64;
        return (value.abs() < i64::MAX as f64).then_some(value.floor() as i64);
    }
    let fraction = &fraction[..fraction.len().min(18)];
    let scale = 10_i128.pow(u32::try_from(fraction.len()).ok()?);
    let value = whole.parse::<i128>().unwrap_or(0) * scale + fraction.parse::<i128>().unwrap_or(0);
    i64::try_from((sign * value).checked_mul(unit)?.div_euclid(scale)).ok()
}

/// Reads two channels.
pub(super) fn read(text: &str, names: [&str; 2], columns: &Columns) -> Result<Capture, ReplayError> {
    let neither =
        |line: u64, reason: &str| ReplayError::new(line, format!("not VCD, FST or a table of levels: {reason}"));
    let table = Table::read(text, columns.separator).map_err(|error| neither(error.line, &error.reason))?;
    let sigrok = Sigrok::of(&table.comments);
    let time = match columns.time.as_deref() {
        Some(asked) => {
            let (column, unit) = TIMES.find(&table, Some(asked))?;
            Some((column, Some(in_picoseconds(unit))))
        }
        None => table.header.iter().enumerate().find_map(|(index, cell)| Some((index, time_unit(cell)?))),
    };
    let found = find_both(&variables(&table, &sigrok, time.map(|(column, _)| column)), names)
        .map_err(|reason| neither(table.line, &reason))?;
    let time = match time {
        Some((column, unit)) => {
            let no_unit = || {
                let cell = excerpt(&table.header[column]);
                let reason = format!(
                    "the times of the column `{cell}` have no unit; write `{cell} [us]` in the header, or in the \
                     scene: file = {{ path = \"...\", time = \"{cell} [us]\" }}"
                );
                ReplayError::new(table.line, reason)
            };
            Some((column, unit.or_else(|| sigrok.unit()).ok_or_else(no_unit)?))
        }
        None if sigrok.rate_hz.is_some() => None,
        None => {
            let reason = "no column of times (`Time [s]`), and no `; Samplerate:` above the table";
            return Err(neither(table.line, reason));
        }
    };
    let (mut lines, mut before) = (Lines::default(), None);
    for (row, index) in table.rows.iter().zip(0_i128..) {
        let cells = table.cells(row)?;
        let now = match time {
            Some((column, unit)) => {
                let cell = &cells[column];
                let reason = || format!("`{}` is not a time{}", excerpt(cell), by_clock(cell));
                let refused = || ReplayError::new(row.line, reason());
                sigrok.exact(picoseconds(cell, unit).ok_or_else(refused)?, unit)
            }
            None => (index * PICOSECONDS / sigrok.rate_hz.unwrap_or(1)) as i64,
        };
        if before.is_some_and(|before| now < before) {
            return Err(ReplayError::new(row.line, "time runs backwards"));
        }
        before = Some(now);
        lines.to(now);
        for (line, channel) in found.iter().enumerate() {
            let cell = &cells[channel.code];
            let wrong = |reason| ReplayError::new(row.line, format!("the level `{}` is {reason}", excerpt(cell)));
            let level = level_of(cell).ok_or_else(|| wrong("none; accepted: 0, 1, low, high, false, true, off, on"))?;
            lines.set(line, level).map_err(wrong)?;
        }
    }
    let capture = lines.ended(names).map_err(|reason| ReplayError::new(table.line, reason))?;
    let times = match time {
        Some((column, _)) => TIMES.told(&table, columns.time.as_deref(), column),
        None => "samples".to_string(),
    };
    let rate = sigrok.rate_hz.map_or(String::new(), |rate_hz| format!(" at {rate_hz} Hz"));
    Ok(Capture { times: Some(times + &rate), ..capture })
}

/// Returns the channels of a table: all columns but the times.
fn variables(table: &Table, sigrok: &Sigrok, time: Option<usize>) -> Vec<Variable<usize>> {
    let cells = table.header.iter().enumerate().filter(|(index, _)| Some(*index) != time);
    // sigrok may name columns by their kinds, `logic` and units; their names then stand above.
    let unnamed = table.is_headless || table.header.iter().any(|cell| cell == "logic");
    let above = sigrok.channels.iter().filter(|_| unnamed).map(Some).chain(std::iter::repeat(None));
    let named = cells.zip(above).map(|((code, cell), above)| {
        let name = above.unwrap_or(cell).clone();
        Variable { path: name.clone(), name, range: None, width: 1, code }
    });
    named.collect()
}
