//! An axis of a map: a key of the scene, and the values it takes.

use std::fmt;
use std::str::FromStr;

use crate::Error;
use hpu_cosim::{excerpt, number};

/// Smallest number of cells along an axis.
pub(crate) const FEWEST: usize = 2;
/// Greatest number of cells along an axis.
pub const MOST: usize = 1000;
/// Number of cells along an axis whose text gives none.
pub const USUAL: usize = 41;

/// A key of the scene, and the values it takes.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    key: String,
    unit: String,
    log: bool,
    values: Vec<f64>,
}

impl FromStr for Axis {
    type Err = Error;

    /// Reads `KEY=FROM..TO[:CELLS][:log|lin]`, with units as in a scene: `wall.stiffness=0.1..3 N.m/rad:41:log`.
    fn from_str(text: &str) -> Result<Self, Error> {
        const SYNTAX: &str = "write KEY=FROM..TO[:CELLS][:log|lin], as in 'wall.stiffness=0.1..3 N.m/rad:41:log'";
        let (key, rest) = text.split_once('=').ok_or(SYNTAX)?;
        let mut parts = rest.split(':');
        let (from, to) = parts.next().and_then(|range| range.split_once("..")).ok_or(SYNTAX)?;
        let (mut cells, mut log) = (None, false);
        for part in parts.map(str::trim) {
            match part {
                "log" => log = true,
                "lin" => log = false,
                _ => {
                    let wrong = |_| format!("`{}` is neither a number of cells, log nor lin", excerpt(part));
                    cells = Some(part.parse().map_err(wrong)?);
                }
            }
        }
        let ((from, unit), (to, other)) = (quantity(from)?, quantity(to)?);
        if !unit.is_empty() && !other.is_empty() && unit != other {
            return Err(format!("{unit} and {other}: write both ends in the same unit").into());
        }
        // For a design of the user's own: every whole number, if no number of cells is given.
        let whole = key.trim().starts_with(OF_A_DESIGN) && [from, to].iter().all(|end| end.fract() == 0.0);
        let every = (whole && (1.0..MOST as f64).contains(&(to - from))).then(|| (to - from) as usize + 1);
        let cells = cells.or(every).unwrap_or(USUAL);
        Self::new(key.trim(), (from, to), if unit.is_empty() { other } else { unit }, cells, log)
    }
}

/// Prefix of the keys of a design of the user's own, whose generics and constants are whole numbers.
const OF_A_DESIGN: &str = "dut.";

/// Splits a text into a number and its unit.
fn quantity(text: &str) -> Result<(f64, &str), Error> {
    let text = text.trim();
    let ends = (0..=text.len()).rev().filter(|&end| text.is_char_boundary(end));
    let number =
        ends.map(|end| text.split_at(end)).find_map(|(number, unit)| Some((number.parse().ok()?, unit.trim())));
    number
        .filter(|(value, _): &(f64, &str)| value.is_finite())
        .ok_or_else(|| Error::new(format_args!("`{}` is not a number with a unit", excerpt(text))))
}

impl Axis {
    /// Returns an axis of so many cells from one value to another; both ends are cells.
    ///
    /// Values between the ends have six digits, so that a command that contains one stays readable.
    ///
    /// # Errors
    ///
    /// Returns as text why there is no such axis.
    pub fn new(key: &str, (from, to): (f64, f64), unit: &str, cells: usize, log: bool) -> Result<Self, Error> {
        let wrong = |why: String| Err(Error::new(format_args!("{key}: {why}")));
        if key.is_empty() {
            return Err("no key before the `=`".into());
        }
        if from == to {
            return wrong(format!("{} to {} is empty", number(from), number(to)));
        }
        if from > to {
            return wrong(format!("{} to {} is reversed; write the smaller value first", number(from), number(to)));
        }
        if !(FEWEST..=MOST).contains(&cells) {
            return wrong(format!("{cells} cells; an axis has {FEWEST} to {MOST}"));
        }
        if log && from <= 0.0 {
            return wrong(format!("a logarithmic axis begins above zero, not at {}", number(from)));
        }
        let value = |cell: usize| {
            let share = cell as f64 / (cells - 1) as f64;
            let exact = if log {
                libm::exp(libm::log(from) + share * (libm::log(to) - libm::log(from)))
            } else {
                from + share * (to - from)
            };
            // A rounding remainder near zero becomes zero.
            let exact = if exact.abs() < 1e-12 * (to - from) { 0.0 } else { exact };
            let exact = if key.starts_with(OF_A_DESIGN) { exact.round() } else { exact };
            format!("{exact:.5e}").parse().unwrap_or(exact)
        };
        let mut values: Vec<f64> = (0..cells).map(value).collect();
        (values[0], values[cells - 1]) = (from, to);
        if values.windows(2).any(|pair| pair[0] >= pair[1]) {
            return wrong(format!(
                "{cells} cells from {} to {} are too narrow to be told apart by six digits",
                number(from),
                number(to)
            ));
        }
        Ok(Self { key: key.to_string(), unit: unit.to_string(), log, values })
    }

    /// Returns the key.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the unit of the values; empty for plain numbers, which a scene takes in SI units.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Whether the cells lie at equal ratios instead of equal distances.
    pub fn is_log(&self) -> bool {
        self.log
    }

    /// Returns the value at each cell.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the number of cells.
    pub fn cells(&self) -> usize {
        self.values.len()
    }

    /// Returns a cell's value as a scene writes it.
    pub fn text(&self, cell: usize) -> String {
        self.with_unit(self.values[cell])
    }

    /// Returns a value with the unit.
    pub(crate) fn with_unit(&self, value: f64) -> String {
        if self.unit.is_empty() { number(value) } else { format!("{} {}", number(value), self.unit) }
    }

    /// Returns the position of a value in cells: a cell's own value lies at the cell's number. Values beyond the ends
    /// are extrapolated.
    pub fn position(&self, value: f64) -> f64 {
        let scale = |value: f64| if self.log { libm::log(value) } else { value };
        let (first, last) = (scale(self.values[0]), scale(self.values[self.cells() - 1]));
        (scale(value) - first) / (last - first) * (self.cells() - 1) as f64
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { key, unit, log, values } = self;
        let (space, scale) = (if unit.is_empty() { "" } else { " " }, if *log { "log" } else { "lin" });
        let [from, to] = [values[0], values[self.cells() - 1]].map(number);
        write!(f, "{key}={from}..{to}{space}{unit}:{}:{scale}", self.cells())
    }
}
