//! A motion from a table: times and positions.

use std::f64::consts::TAU;

use super::table::{Table, name_and_unit};
use super::{ReplayError, whole};
use crate::text::message::{self, excerpt};

/// A motion from a table.
#[derive(Clone, PartialEq, Debug)]
pub enum Motion {
    /// Times in seconds, and angles in radians or positions in metres.
    Positions(Vec<(f64, f64)>),
    /// Times in seconds and the counts of an encoder, each from its first position on up to the next count's.
    Counts(Vec<(f64, i64)>),
}

/// The columns of a table that a scene names; what it does not name is found by the units in the header.
#[derive(Clone, Default, PartialEq, Eq, Debug)]
pub struct Columns {
    /// The column of the times, with its unit if the header has none, as in `t [ms]`.
    pub time: Option<String>,
    /// The column of the positions, in the same way.
    pub position: Option<String>,
    /// The character between two columns.
    pub separator: Option<char>,
}

/// The kind of positions that a device has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unit {
    /// Angles, in radians.
    Angle,
    /// Places along a rail, in metres.
    Length,
}

/// The units of times.
const TIMES: [(&str, f64); 12] = [
    ("s", 1.0),
    ("sec", 1.0),
    ("second", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("milliseconds", 1e-3),
    ("us", 1e-6),
    ("µs", 1e-6),
    ("μs", 1e-6),
    ("microseconds", 1e-6),
    ("ns", 1e-9),
    ("nanoseconds", 1e-9),
];

/// The units of angles.
const ANGLES: [(&str, f64); 9] = [
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", TAU / 360.0),
    ("degree", TAU / 360.0),
    ("degrees", TAU / 360.0),
    ("°", TAU / 360.0),
    ("rev", TAU),
    ("turn", TAU),
    ("turns", TAU),
];

/// The units of places.
const LENGTHS: [(&str, f64); 5] = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("μm", 1e-6)];

/// The names of counts of an encoder.
const COUNTS: [&str; 6] = ["count", "counts", "cnt", "cnts", "ticks", "steps"];

/// Names by which a column of times is known where several have a unit of time.
const TIME_NAMES: [&str; 7] = ["time", "t", "timestamp", "timestep", "times", "zeit", "elapsed"];

/// Names by which a column of positions is known where several have a unit of positions.
const POSITION_NAMES: [&str; 7] = ["angle", "position", "pos", "theta", "count", "encoder", "x"];

/// The greatest size of a count in a table.
const MOST_COUNT: f64 = 1e9;

/// What the numbers of a column are.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Scale {
    /// A number times this is in SI units.
    Times(f64),
    Counts,
}

fn time_scale(unit: &str) -> Option<Scale> {
    let unit = unit.to_lowercase();
    TIMES.iter().find(|(name, _)| *name == unit).map(|(_, scale)| Scale::Times(*scale))
}

fn position_scale(unit: &str, kind: Unit) -> Option<Scale> {
    let unit = unit.to_lowercase();
    if COUNTS.contains(&&*unit) {
        return Some(Scale::Counts);
    }
    let units = if kind == Unit::Angle { &ANGLES[..] } else { &LENGTHS };
    units.iter().find(|(name, _)| *name == unit).map(|(_, scale)| Scale::Times(*scale))
}

/// A column: its index, its name without the unit, and its scale.
type Column<'a> = (usize, &'a str, Scale);

/// Returns the columns that have a unit of a kind.
fn with_unit<'a>(table: &'a Table, scale: &dyn Fn(&str) -> Option<Scale>) -> Vec<Column<'a>> {
    let header = table.header.iter().enumerate();
    header
        .filter_map(|(index, cell)| {
            let (name, unit) = name_and_unit(cell);
            Some((index, name, scale(unit.unwrap_or(name))?))
        })
        .collect()
}

/// Finds a column, by its name, or by the unit in the header.
fn column(
    table: &Table,
    named: Option<&str>,
    scale: &dyn Fn(&str) -> Option<Scale>,
    (key, what, known): (&str, &str, &[&str]),
) -> Result<(usize, Scale), ReplayError> {
    let refused = |reason: String| Err(ReplayError::new(table.line, reason));
    let header = || table.header.iter().map(|cell| format!("`{}`", excerpt(cell))).collect::<Vec<_>>().join(", ");
    if let Some(asked) = named {
        let (name, unit) = name_and_unit(asked);
        let is = |cell: &String| cell == asked || cell == name || name_and_unit(cell).0 == name;
        let exact = table.header.iter().position(|cell| cell == asked);
        let Some(index) = exact.or_else(|| table.header.iter().position(is)) else {
            return refused(format!("no column `{}`; the columns are {}", excerpt(asked), header()));
        };
        let cell = &table.header[index];
        let own = name_and_unit(cell);
        let unit = unit.and_then(scale).or_else(|| scale(own.1.unwrap_or(own.0)));
        return match unit {
            Some(scale) => Ok((index, scale)),
            None => refused(format!("no unit of the column `{}`; write {key} = \"{} [unit]\"", excerpt(cell), own.0)),
        };
    }
    let all = with_unit(table, scale);
    let is_known = |column: &&Column| known.iter().any(|known| column.1.eq_ignore_ascii_case(known));
    let by_name: Vec<_> = all.iter().filter(is_known).copied().collect();
    match (&all[..], &by_name[..]) {
        ([one], _) | (_, [one]) => Ok((one.0, one.2)),
        ([], _) => {
            let (unit, column) =
                if key == "time" { ("ms", table.header.first()) } else { ("deg", table.header.last()) };
            let column = column.map_or("column", |column| name_and_unit(column).0);
            refused(format!(
                "no column of {what} with a unit: the header has {}; write the unit behind a name, as in \
                 `time_s,angle_rad`, or in the scene: file = {{ path = \"...\", {key} = \"{} [{unit}]\" }}",
                header(),
                excerpt(column)
            ))
        }
        _ => {
            let found: Vec<_> = all.iter().map(|column| format!("`{}`", table.header[column.0])).collect();
            refused(format!(
                "several columns of {what}: {}; name one in the scene: file = {{ path = \"...\", {key} = \"...\" }}",
                found.join(", ")
            ))
        }
    }
}

/// Reads a motion: a table whose header has a column of times and one of positions with their units, in brackets
/// (`pos [deg]`) or behind the name (`time_us`); other columns are not read.
///
/// Times are in s, ms, us or ns; positions in rad, mrad, deg or turns, along a rail in m, mm or um, or in counts of the
/// scene's encoder. Columns are separated by tabs, semicolons or commas, a decimal comma is read, empty lines and lines
/// that start with `#` are skipped. `most` holds the greatest accepted size of a time and of a position.
///
/// # Errors
///
/// [`ReplayError`] for a header without such columns, or with several of them that `columns` does not tell apart,
/// another number of columns, a value that is not a finite number, a count that is not a whole number, a time that does
/// not increase, a value beyond the greatest, a table without points, and a last line without its line feed.
///
/// # Example
///
/// ```
/// use hpu_scene::replay::{Columns, Motion, Unit, read_motion};
/// let text = "timestep [ms];knob [deg];torque\n0;0,0;1\n500;90,0;2\n";
/// let motion = read_motion(text, &Columns::default(), Unit::Angle, (10.0, 6.3)).unwrap();
/// assert_eq!(motion, Motion::Positions(vec![(0.0, 0.0), (0.5, std::f64::consts::FRAC_PI_2)]));
/// ```
pub fn read_motion(text: &str, columns: &Columns, kind: Unit, most: (f64, f64)) -> Result<Motion, ReplayError> {
    whole(text.as_bytes())?;
    let table = Table::read(text, columns.separator)?;
    let of_time = ("time", "times", &TIME_NAMES[..]);
    let (time_at, time_scale) = column(&table, columns.time.as_deref(), &time_scale, of_time)?;
    let Scale::Times(time_scale) = time_scale else { unreachable!("no time has counts") };
    let of_position = ("angle", "positions", &POSITION_NAMES[..]);
    let scale = |unit: &str| position_scale(unit, kind);
    let (position_at, scale) = column(&table, columns.position.as_deref(), &scale, of_position)?;
    let mut motion: Vec<(f64, f64)> = Vec::new();
    for row in &table.rows {
        let (line, within) = (row.0, |column: usize, most: f64| {
            let value = table.number(row, column)?;
            let beyond = || {
                let [least, most] = [-most, most].map(message::number);
                format!("{}; accepted: {least} to {most}", excerpt(&row.1[column]))
            };
            if value.abs() <= most { Ok(value) } else { Err(ReplayError::new(row.0, beyond())) }
        });
        let time_s = within(time_at, most.0 / time_scale)? * time_scale;
        let position = match scale {
            Scale::Times(scale) => within(position_at, most.1 / scale)? * scale,
            Scale::Counts => within(position_at, MOST_COUNT)?,
        };
        if scale == Scale::Counts && position.fract() != 0.0 {
            let reason = format!("`{}` is not a count; write a whole number", excerpt(&row.1[position_at]));
            return Err(ReplayError::new(line, reason));
        }
        if let Some((before_s, _)) = motion.last().filter(|(before_s, _)| time_s <= *before_s) {
            let [now, before] = [time_s, *before_s].map(message::number);
            let reason = format!("time must increase from line to line: {now} s follows {before} s");
            return Err(ReplayError::new(line, reason));
        }
        motion.push((time_s, position));
    }
    if motion.is_empty() {
        return Err(ReplayError::new(table.line, "no point follows the header"));
    }
    Ok(match scale {
        Scale::Counts => Motion::Counts(motion.into_iter().map(|(time_s, count)| (time_s, count as i64)).collect()),
        Scale::Times(_) => Motion::Positions(motion),
    })
}
