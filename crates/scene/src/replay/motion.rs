//! A motion from a table: times and positions.

use super::columns::{Columns, POSITION_NAMES, Role, TIME_NAMES};
use super::counter::unwrapped;
use super::decode::{self, or_cut};
use super::table::{Row, Table, number_of};
use super::units::{self, Scale, Unit};
use super::{ReplayError, Taken};
use crate::text::message::{self, excerpt};

/// A motion from a table.
#[derive(Clone, PartialEq, Debug)]
pub enum Motion {
    /// Times in seconds, and angles in radians or positions in metres.
    Positions(Vec<(f64, f64)>),
    /// Times in seconds and the counts of an encoder, each from its first position on up to the next count's.
    Counts(Vec<(f64, i64)>),
}

/// The greatest size of a count.
const MOST_COUNT: f64 = 1e9;

/// The latest time that is taken as one since 1970, in s.
const MOST_EPOCH_S: f64 = 1e11;

/// Reads a motion: a table whose header has a column of times and one of positions with their units, in brackets
/// (`pos [deg]`), behind the name (`time_us`) or in the row below; other columns are not read.
///
/// Times are in min, s, ms, us, ns or ps; positions in rad, mrad, urad, deg, mdeg or turns, along a rail in m, cm, mm
/// or um, or in counts of the scene's encoder. A column may be in multiples of a unit: `tick [351 us]`. Columns are
/// separated by tabs, semicolons, commas or blanks, a decimal comma is read, empty lines and lines that start with `#`
/// are skipped. The text is UTF-8, UTF-16 or Latin-1. `most` holds the greatest accepted size of a time and of a
/// position.
///
/// Times since 1970 count from the first row, and counts of a counter that passes its end go on there; the result's
/// notes tell so.
///
/// # Errors
///
/// [`ReplayError`] for a header without such columns, or with several of them that `columns` does not tell apart,
/// another number of columns, a value that is not a finite number, a count that is not a whole number, a time that does
/// not increase, a value beyond the greatest, a table without points, and a file that is no text.
///
/// # Example
///
/// ```
/// use hpu_scene::replay::{Columns, Motion, Unit, read_motion};
/// let text = "timestep [ms];knob [deg];torque\n0;0,0;1\n500;90,0;2\n";
/// let (motion, taken) = read_motion(text.as_bytes(), &Columns::default(), Unit::Angle, (10.0, 6.3)).unwrap();
/// assert_eq!(motion, Motion::Positions(vec![(0.0, 0.0), (0.5, std::f64::consts::FRAC_PI_2)]));
/// assert_eq!(taken.columns, ["timestep [ms]", "knob [deg]"]);
/// ```
pub fn read_motion(
    bytes: &[u8],
    columns: &Columns,
    kind: Unit,
    most: (f64, f64),
) -> Result<(Motion, Taken), ReplayError> {
    let text = decode::text(bytes)?;
    or_cut(&text, read(&text, columns, kind, most))
}

/// The role of a column of times.
pub(super) const TIMES: Role =
    Role { key: "time", what: "times", known: &TIME_NAMES, units: "s, ms, us, ns, ps, min", scale: &units::time };

fn read(text: &str, columns: &Columns, kind: Unit, most: (f64, f64)) -> Result<(Motion, Taken), ReplayError> {
    let table = Table::read(text, columns.separator)?;
    let units = if kind == Unit::Angle { "rad, mrad, urad, deg, mdeg, rev, counts" } else { "m, cm, mm, um, counts" };
    let scale = |unit: &str| units::position(unit, kind);
    let positions = Role { key: "angle", what: "positions", known: &POSITION_NAMES, units, scale: &scale };
    let (time_at, time_scale) = TIMES.find(&table, columns.time.as_deref())?;
    let Scale::Times(time_scale) = time_scale else { unreachable!("no time has counts") };
    let (position_at, scale) = positions.find(&table, columns.position.as_deref())?;
    for column in [time_at, position_at] {
        table.check_commas(column)?;
    }
    let (mut notes, mut start) = (Vec::from_iter(decode::note(text)), 0.0);
    let mut motion: Vec<(f64, f64)> = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        let cells = table.cells(row)?;
        let (time_cell, cell) = (&cells[time_at], &cells[position_at]);
        let time = number_of(row, time_cell)?;
        if motion.is_empty() && (most.0..=MOST_EPOCH_S).contains(&(time * time_scale)) {
            start = time;
            notes.push(format!("times from {} s on", message::number(time * time_scale)));
        }
        let time_s = within(row, time_cell, time - start, most.0 / time_scale)? * time_scale;
        let position = number_of(row, cell)?;
        let position = match scale {
            Scale::Times(scale) => within(row, cell, position, most.1 / scale)? * scale,
            Scale::Counts if position.fract() != 0.0 => {
                let reason = format!("`{}` is not a count; write a whole number", excerpt(cell));
                return Err(ReplayError::new(row.line, reason));
            }
            Scale::Counts => position,
        };
        if let Some((before_s, _)) = motion.last().filter(|(before_s, _)| time_s <= *before_s) {
            let [now, before] = [time_s, *before_s].map(message::number);
            let reason = format!("time must increase from line to line: {now} s follows {before} s");
            return Err(ReplayError::new(row.line, reason));
        }
        motion.push((time_s, position));
    }
    let [Some(first), Some(last)] = [motion.first(), motion.last()] else {
        return Err(ReplayError::new(table.line, "no point follows the header"));
    };
    let span_s = [first.0, last.0];
    let names = [(&TIMES, &columns.time, time_at), (&positions, &columns.position, position_at)];
    let columns = names.map(|(role, asked, at)| role.told(&table, asked.as_deref(), at));
    let motion = match scale {
        Scale::Counts => {
            let (counts, bits) = counts(&table, position_at, &motion)?;
            notes
                .extend(bits.map(|bits| format!("counts of {bits} bits go on where they pass the end of their range")));
            Motion::Counts(counts)
        }
        Scale::Times(_) => Motion::Positions(motion),
    };
    Ok((motion, Taken { columns: columns.to_vec(), span_s, rows: table.rows.len(), notes }))
}

/// Returns a value, unless it is larger than the greatest.
fn within(row: &Row, cell: &str, value: f64, most: f64) -> Result<f64, ReplayError> {
    if value.abs() <= most {
        return Ok(value);
    }
    let [least, most] = [-most, most].map(message::number);
    Err(ReplayError::new(row.line, format!("{}; accepted: {least} to {most}", excerpt(cell))))
}

/// Times in s, and counts.
type Counts = Vec<(f64, i64)>;

/// Returns whole numbers as counts, and the width of their counter if it passes its end. `at` is their column.
fn counts(table: &Table, at: usize, motion: &[(f64, f64)]) -> Result<(Counts, Option<u32>), ReplayError> {
    let mut counts: Vec<_> = motion.iter().map(|(time_s, count)| (*time_s, *count as i64)).collect();
    let bits = unwrapped(&mut counts);
    for (row, (_, count)) in table.rows.iter().zip(&counts) {
        if count.unsigned_abs() as f64 > MOST_COUNT {
            within(row, &table.cells(row)?[at], *count as f64, MOST_COUNT)?;
        }
    }
    Ok((counts, bits))
}
