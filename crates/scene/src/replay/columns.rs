//! The columns of a table: named by the scene, or found by their units and names.

use super::ReplayError;
use super::table::Table;
use super::units::{Scale, is_known, name_and_unit};
use crate::text::message::excerpt;

/// The columns of a table that a scene names; what it does not name is found by the units in the header.
#[derive(Clone, Default, PartialEq, Eq, Debug)]
pub struct Columns {
    /// The column of the times, with its unit if the header has none, as in `t [ms]`. Columns of a table without a
    /// header are named by their numbers, from 1.
    pub time: Option<String>,
    /// The column of the positions, in the same way.
    pub position: Option<String>,
    /// The character between two columns.
    pub separator: Option<char>,
}

/// Names by which a column of times is known.
pub(super) const TIME_NAMES: [&str; 7] = ["time", "t", "timestamp", "timestep", "times", "zeit", "elapsed"];

/// Names by which a column of positions is known.
pub(super) const POSITION_NAMES: [&str; 7] = ["angle", "position", "pos", "theta", "count", "encoder", "x"];

/// Words in the name of a column that is neither times nor positions, whatever its unit.
const OTHERS: [&str; 8] = ["velocity", "vel", "speed", "omega", "rate", "temperature", "temp", "error"];

/// The use of a column.
pub(super) struct Role<'a> {
    /// The key of a scene that names it.
    pub(super) key: &'a str,
    /// The values that it holds.
    pub(super) what: &'a str,
    pub(super) known: &'a [&'a str],
    /// The units that messages name; the first stands in examples.
    pub(super) units: &'a str,
    pub(super) scale: &'a dyn Fn(&str) -> Option<Scale>,
}

impl Role<'_> {
    fn knows(&self, name: &str) -> bool {
        self.known.iter().any(|known| name.eq_ignore_ascii_case(known))
    }

    /// Returns the scale of a column by its own cell of the header: `count` is name and unit.
    fn of_cell(&self, cell: &str) -> Option<Scale> {
        let (name, unit) = name_and_unit(cell);
        (self.scale)(unit.unwrap_or(name))
    }

    /// Finds the column, by the name that the scene gives, or by the header.
    pub(super) fn find(&self, table: &Table, named: Option<&str>) -> Result<(usize, Scale), ReplayError> {
        let found = named.map_or_else(|| self.by_header(table), |asked| self.by_name(table, asked));
        found.map_err(|reason| ReplayError::new(table.line, reason))
    }

    /// Returns a column with its unit, as a result tells it: as in the header, or as the scene names it with a unit.
    pub(super) fn told(&self, table: &Table, asked: Option<&str>, index: usize) -> String {
        let cell = &table.header[index];
        match asked {
            Some(asked) if self.of_cell(cell).is_none() => asked.trim().to_string(),
            _ => cell.clone(),
        }
    }

    fn by_name(&self, table: &Table, asked: &str) -> Result<(usize, Scale), String> {
        let asked = asked.trim();
        let (name, unit) = name_and_unit(asked);
        let with = |is: &dyn Fn(&str) -> bool| -> Vec<usize> {
            table.header.iter().enumerate().filter(|(_, cell)| is(cell)).map(|(index, _)| index).collect()
        };
        let mut found = with(&|cell| cell == asked);
        if found.is_empty() {
            found = with(&|cell| cell == name || name_and_unit(cell).0 == name);
        }
        let scale = unit.and_then(self.scale);
        if found.len() > 1 {
            let fits = |index: &usize| scale.is_some() && self.of_cell(&table.header[*index]) == scale;
            let fitting: Vec<usize> = found.iter().copied().filter(fits).collect();
            found = if fitting.len() == 1 { fitting } else { found };
        }
        let cell = match found[..] {
            [one] => &table.header[one],
            [] => return Err(format!("no column `{}`; the columns are {}", excerpt(asked), listed(&table.header))),
            _ => {
                let named = found.iter().map(|index| &table.header[*index]);
                return Err(format!("several columns are named `{}`: {}", excerpt(name), listed(named)));
            }
        };
        let (stem, own) = name_and_unit(cell);
        let (key, units) = (self.key, self.units);
        let no_unit = |column: &str, stem: &str| {
            format!("no unit of the column `{}`; write {key} = \"{stem} [unit]\", a unit of {units}", excerpt(column))
        };
        match (scale, own.filter(|own| is_known(own))) {
            (Some(scale), Some(own)) if (self.scale)(own) != Some(scale) => Err(format!(
                "the header says `{}`, and the scene `{}`; write the header's unit, or no unit",
                excerpt(cell),
                excerpt(asked)
            )),
            (Some(scale), _) => Ok((found[0], scale)),
            (None, _) if unit.is_some() && cell != asked => Err(no_unit(asked, stem)),
            (None, _) => Ok((found[0], self.of_cell(cell).ok_or_else(|| no_unit(cell, stem))?)),
        }
    }

    fn by_header(&self, table: &Table) -> Result<(usize, Scale), String> {
        let with_unit: Vec<_> = table.header.iter().enumerate().collect();
        let with_unit: Vec<_> =
            with_unit.into_iter().filter_map(|(index, cell)| Some((index, cell, self.of_cell(cell)?))).collect();
        let by_name: Vec<_> = with_unit.iter().filter(|column| self.knows(name_and_unit(column.1).0)).collect();
        let (key, what) = (self.key, self.what);
        let file = |name: &str| format!("file = {{ path = \"...\", {key} = \"{}\" }}", excerpt(name));
        let [one, ..] = with_unit[..] else { return Err(self.none(table)) };
        match (&by_name[..], &with_unit[..]) {
            ([named], _) => Ok((named.0, named.2)),
            ([], [_]) => {
                let (unit, name) = (self.units.split(',').next().unwrap_or_default(), name_and_unit(one.1).0);
                let mut words = name.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase);
                // The column that has the name, but no unit, may be meant.
                match table.header.iter().find(|cell| self.knows(cell)) {
                    Some(cell) => Err(format!(
                        "the column `{}` has no unit, and `{}` no name of {what}; name one in the scene: {} or {}",
                        excerpt(cell),
                        excerpt(one.1),
                        file(&format!("{cell} [{unit}]")),
                        file(one.1)
                    )),
                    None if words.any(|word| OTHERS.contains(&&*word)) => Err(format!(
                        "no column of {what}: `{}` is something else by its name; if it has them, write {}",
                        excerpt(one.1),
                        file(one.1)
                    )),
                    None => Ok((one.0, one.2)),
                }
            }
            _ => {
                let found = listed(with_unit.iter().map(|column| column.1));
                Err(format!("several columns of {what}: {found}; name one in the scene: {}", file("...")))
            }
        }
    }

    /// Tells that no column has a unit.
    fn none(&self, table: &Table) -> String {
        if table.is_headless {
            return "no header; write the names of the columns with their units above, as in `time_s,angle_rad`, or \
                    name columns by their numbers in the scene: file = { path = \"...\", time = \"1 [s]\", angle = \
                    \"2 [rad]\" }"
                .into();
        }
        let (unit, column) =
            if self.key == "time" { ("ms", table.header.first()) } else { ("deg", table.header.last()) };
        format!(
            "no column of {} with a unit: the header has {}; write the unit behind a name, as in `time_s,angle_rad`, \
             or in the scene: file = {{ path = \"...\", {} = \"{} [{unit}]\" }}",
            self.what,
            listed(&table.header),
            self.key,
            excerpt(column.map_or("column", |column| name_and_unit(column).0))
        )
    }
}

fn listed<'a>(cells: impl IntoIterator<Item = &'a String>) -> String {
    cells.into_iter().map(|cell| format!("`{}`", excerpt(cell))).collect::<Vec<_>>().join(", ")
}
