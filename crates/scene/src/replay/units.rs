//! Units as the headers of tables write them.

use std::f64::consts::TAU;

/// The kind of positions that a device has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unit {
    /// Angles, in radians.
    Angle,
    /// Places along a rail, in metres.
    Length,
}

impl Unit {
    /// Returns the size of a unit of positions in SI units, `deg` or `mm`; `None` for other units.
    pub fn size(self, unit: &str) -> Option<f64> {
        match position(unit, self) {
            Some(Scale::Times(size)) => Some(size),
            _ => None,
        }
    }
}

/// What the numbers of a column are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Scale {
    /// A number times this is in SI units.
    Times(f64),
    Counts,
}

/// Units and their sizes in SI units.
type Units = &'static [(&'static str, f64)];

const TIMES: Units = &[
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("ps", 1e-12),
    ("min", 60.0),
    ("sec", 1.0),
    ("second", 1.0),
    ("seconds", 1.0),
    ("milliseconds", 1e-3),
    ("µs", 1e-6),
    ("μs", 1e-6),
    ("microseconds", 1e-6),
    ("nanoseconds", 1e-9),
    ("picoseconds", 1e-12),
    ("minutes", 60.0),
];

const ANGLES: Units = &[
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("urad", 1e-6),
    ("deg", TAU / 360.0),
    ("mdeg", TAU / 360e3),
    ("rev", TAU),
    ("degree", TAU / 360.0),
    ("degrees", TAU / 360.0),
    ("°", TAU / 360.0),
    ("turn", TAU),
    ("turns", TAU),
];

const LENGTHS: Units = &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("μm", 1e-6)];

/// The names of counts of an encoder.
const COUNTS: [&str; 6] = ["count", "counts", "cnt", "cnts", "ticks", "steps"];

/// Returns the size of a unit, or of a multiple of one, as `351 us`.
fn size(units: Units, unit: &str) -> Option<Scale> {
    let unit = unit.to_lowercase();
    let (multiple, unit) = match unit.split_once(' ') {
        Some((multiple, unit)) => (multiple.parse().ok().filter(|multiple: &f64| multiple.is_normal())?, unit.trim()),
        None => (1.0, &*unit),
    };
    let (_, size) = units.iter().find(|(name, _)| *name == unit)?;
    Some(Scale::Times(multiple * size)).filter(|scale| matches!(scale, Scale::Times(size) if *size > 0.0))
}

/// Returns the size of a unit of time, in s.
pub(super) fn time(unit: &str) -> Option<Scale> {
    size(TIMES, unit)
}

/// Returns the size of a unit of positions, in rad or m, or that it is counts.
pub(super) fn position(unit: &str, kind: Unit) -> Option<Scale> {
    let is_count = COUNTS.contains(&&*unit.to_lowercase());
    let units = if kind == Unit::Angle { ANGLES } else { LENGTHS };
    if is_count { Some(Scale::Counts) } else { size(units, unit) }
}

/// Returns whether this is a unit of times, angles or lengths, or a name of counts.
pub(super) fn is_known(unit: &str) -> bool {
    time(unit).or_else(|| position(unit, Unit::Angle)).or_else(|| position(unit, Unit::Length)).is_some()
}

/// A column's name without its unit, and the unit: `pos [deg]`, `pos (deg)`, `pos / deg`, `pos/deg`, `pos_deg` and
/// `pos deg`. Without brackets, only a known unit is one. `speed_rad_s` and `counts_per_s` have none: a unit behind
/// another one is a rate's.
pub(super) fn name_and_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((name, unit)) = cell.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return (name.trim_end(), Some(unit.trim()));
        }
    }
    const SIGNS: [char; 3] = ['/', '_', ' '];
    let Some((name, unit)) = cell.rsplit_once(SIGNS) else { return (cell, None) };
    let has_slash = cell[..cell.len() - unit.len()].trim_end().ends_with('/');
    let name = name.trim_end_matches([' ', '/', ',']);
    let last = name.rsplit(SIGNS).next().unwrap_or(name);
    let is_rate = is_known(last) || last.eq_ignore_ascii_case("per");
    // `angle_min` is the least one.
    let is_least = !has_slash && unit.eq_ignore_ascii_case("min");
    if is_known(unit) && !is_rate && !is_least { (name, Some(unit)) } else { (cell, None) }
}
