//! Levels of lines as tables: what Saleae Logic, PulseView and sigrok export by their plain defaults.

use super::ReplayError;
use super::channel::{Capture, Lines, Variable, find_both, level};
use super::table::{Table, name_and_unit};
use crate::text::message::excerpt;

/// The names of a column of times, and picoseconds of their unit.
fn time_unit(cell: &str) -> Option<i128> {
    let (name, unit) = name_and_unit(cell);
    let is_time = |text: &str| ["time", "t", "timestamp"].contains(&&*text.to_lowercase());
    // sigrok names the column by the unit alone.
    let unit = if is_time(name) { unit.unwrap_or("s") } else { cell };
    Some(match unit.to_lowercase().as_str() {
        "s" | "seconds" => 1_000_000_000_000,
        "ms" | "milliseconds" => 1_000_000_000,
        "us" | "µs" | "μs" | "microseconds" => 1_000_000,
        "ns" | "nanoseconds" => 1000,
        "ps" | "picoseconds" => 1,
        _ => return None,
    })
}

/// Returns the names of the channels and the sample rate that sigrok writes above a table: `Channels (2/8): D0, D1` and
/// `Samplerate: 1 MHz`.
fn of_sigrok(comments: &[String]) -> (Vec<String>, Option<f64>) {
    let after = |key: &str| comments.iter().find_map(|comment| comment.strip_prefix(key));
    let channels = after("Channels (").and_then(|rest| rest.split_once("):")).map_or("", |(_, names)| names);
    let channels = channels.split(',').map(|name| name.trim().to_string()).filter(|name| !name.is_empty());
    let rate = after("Samplerate:").and_then(|rate| {
        let (number, unit) = rate.trim().split_once(' ')?;
        let factor = match unit.trim() {
            "Hz" => 1.0,
            "kHz" => 1e3,
            "MHz" => 1e6,
            "GHz" => 1e9,
            _ => return None,
        };
        Some(number.parse::<f64>().ok()? * factor)
    });
    (channels.collect(), rate.filter(|rate| *rate > 0.0))
}

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
    i64::try_from((sign * value * unit).div_euclid(scale)).ok()
}

/// Reads two channels.
pub(super) fn read(bytes: &[u8], names: [&str; 2]) -> Result<Capture, ReplayError> {
    let neither =
        |line: u64, reason: &str| ReplayError::new(line, format!("not VCD, FST or a table of levels: {reason}"));
    let text = std::str::from_utf8(bytes).map_err(|_| neither(1, "no text"))?;
    let table = Table::read(text, None).map_err(|error| neither(error.line, &error.reason))?;
    let (channels, rate_hz) = of_sigrok(&table.comments);
    let time = table.header.iter().position(|cell| time_unit(cell).is_some());
    let lines_of_header = table.header.iter().enumerate().filter(|(index, _)| Some(*index) != time);
    // sigrok may name all columns `logic`; their names then stand above.
    let is_unnamed = |cell: &str| cell == "logic" || level_of(cell).is_some();
    let unnamed = lines_of_header.clone().all(|(_, cell)| is_unnamed(cell));
    let variables: Vec<Variable<usize>> = lines_of_header
        .zip(channels.iter().map(Some).chain(std::iter::repeat(None)))
        .map(|((code, cell), name)| {
            let name = if unnamed { name.unwrap_or(cell) } else { cell }.clone();
            Variable { path: name.clone(), name, range: None, width: 1, code }
        })
        .collect();
    let found = find_both(&variables, names).map_err(|reason| neither(table.line, &reason))?;
    let unit = match (time, rate_hz) {
        (Some(column), _) => time_unit(&table.header[column]).unwrap_or(1),
        (None, Some(_)) => 1,
        (None, None) => {
            let reason = "no column of times (`Time [s]`), and no `; Samplerate:` above the table";
            return Err(neither(table.line, reason));
        }
    };
    // A header of levels is the first sample.
    let headless = unnamed && table.header.iter().all(|cell| level_of(cell).is_some());
    let first = headless.then(|| (table.line, table.header.clone()));
    let (mut lines, mut before) = (Lines::default(), None);
    for (index, row) in first.iter().chain(&table.rows).enumerate() {
        let now = match (time, rate_hz) {
            (Some(column), _) => {
                let cell = table.cell(row, column)?;
                let refused = || ReplayError::new(row.0, format!("`{}` is not a time", excerpt(cell)));
                picoseconds(cell, unit).ok_or_else(refused)?
            }
            (None, rate_hz) => (index as f64 / rate_hz.unwrap_or(1.0) * 1e12).round() as i64,
        };
        if before.is_some_and(|before| now < before) {
            return Err(ReplayError::new(row.0, "time runs backwards"));
        }
        before = Some(now);
        lines.to(now);
        for (line, channel) in found.iter().enumerate() {
            let cell = table.cell(row, channel.code)?;
            let wrong = |reason| ReplayError::new(row.0, format!("the level `{}` is {reason}", excerpt(cell)));
            lines.set(line, level_of(cell)).map_err(wrong)?;
        }
    }
    Ok(lines.ended())
}

fn level_of(cell: &str) -> Option<bool> {
    match cell.as_bytes() {
        [value] => level(*value),
        _ => None,
    }
}
