//! The columns of a sweep's files, and rows as they stand there.

use std::io::Write;

use parquet::errors::ParquetError;

use crate::page::{Column, Kind, Parquet, Place, Rows, Value};
use crate::units::UnitResult;

/// The result of a point: its row or the reason of its failure; `None` if it was not run, because it took longer than
/// the guard allows.
pub type Row = Option<UnitResult>;

/// A row of a file: the number of its point, and its result.
pub type FileRow = (u64, Row);

/// The columns of a sweep's files: the number of the point, how it ended, its place, the fields of its row, the reason
/// of a failure.
#[derive(Clone, Debug)]
pub struct Schema {
    columns: Vec<Column>,
    places: usize,
}

/// Names of the ends of a point: in `state`.
const STATES: [&str; 3] = ["made", "failed", "not_run"];

impl Schema {
    /// Returns the schema of points with these columns of their places, whose rows have these fields, separated by
    /// commas. A last field of text takes the rest of the row, with all commas.
    pub fn new(place: Vec<Column>, fields: Vec<Column>) -> Self {
        let places = place.len();
        let first = [Column::integer("point", ""), Column::text("state", "")];
        let columns = first.into_iter().chain(place).chain(fields).chain([Column::text("reason", "")]).collect();
        Self { columns, places }
    }

    /// Returns all columns in their order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn fields(&self) -> &[Column] {
        &self.columns[2 + self.places..self.columns.len() - 1]
    }

    /// Returns a point's values for the columns.
    ///
    /// # Errors
    ///
    /// Returns the row as a text if it is not one of this schema.
    pub fn values(&self, point: u64, place: Vec<Value>, row: &Row) -> Result<Vec<Value>, String> {
        let fields = self.fields();
        let (state, fields, reason) = match row {
            Some(Ok(line)) => {
                let texts: Vec<&str> = line.splitn(fields.len(), ',').collect();
                let values = fields.iter().zip(&texts).map(|(column, text)| value(column.kind(), text));
                let values: Option<Vec<Value>> = if texts.len() == fields.len() { values.collect() } else { None };
                (STATES[0], values.ok_or_else(|| format!("`{line}` is no row of this sweep"))?, Value::Absent)
            }
            Some(Err(reason)) => (STATES[1], vec![Value::Absent; fields.len()], Value::from(reason)),
            None => (STATES[2], vec![Value::Absent; fields.len()], Value::Absent),
        };
        Ok([Value::from(point), state.into()].into_iter().chain(place).chain(fields).chain([reason]).collect())
    }

    /// Returns the numbers of the points of a group of rows, and how many of them failed and were not run.
    pub fn points(&self, rows: &Rows) -> (Vec<u64>, [usize; 2]) {
        let number = |value: Value| if let Value::Integer(number) = value { number as u64 } else { u64::MAX };
        let states = rows.column(1);
        let count = |name: &str| states.iter().filter(|state| **state == Value::from(name)).count();
        (rows.column(0).into_iter().map(number).collect(), [count(STATES[1]), count(STATES[2])])
    }

    /// Returns the results of a group of rows; `None` if the columns do not agree with each other.
    pub fn told(&self, rows: &Rows) -> Option<Vec<FileRow>> {
        let first = 2 + self.places;
        let columns: Vec<Vec<Value>> = (0..self.columns.len()).map(|at| rows.column(at)).collect();
        let row = |at: usize| {
            let Value::Integer(point) = columns[0][at] else { return None };
            let Value::Text(state) = &columns[1][at] else { return None };
            let row = if *state == STATES[0] {
                Some(Ok(columns[first..columns.len() - 1]
                    .iter()
                    .map(|column| text(&column[at]))
                    .collect::<Vec<_>>()
                    .join(",")))
            } else if *state == STATES[1] {
                let Value::Text(reason) = &columns[columns.len() - 1][at] else { return None };
                Some(Err(reason.clone()))
            } else {
                None
            };
            Some((u64::try_from(point).ok()?, row))
        };
        (0..rows.count()).map(row).collect()
    }

    /// Writes a group of rows as lines of CSV.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn csv(&self, out: &mut impl Write, rows: &Rows) -> std::io::Result<()> {
        let columns: Vec<Vec<Value>> = (0..self.columns.len()).map(|at| rows.column(at)).collect();
        (0..rows.count()).try_for_each(|at| {
            let line = crate::page::csv_line(columns.iter().map(|column| column[at].csv()));
            out.write_all(line.as_bytes())
        })
    }

    /// Returns the line of CSV with the names of the columns.
    pub fn csv_head(&self) -> String {
        let named = self.columns.iter().filter(|column| column.is_in(Place::File));
        crate::page::csv_line(named.map(|column| column.file_key().to_string()))
    }
}

/// Adds rows that were computed here.
///
/// # Errors
///
/// Returns the writer's error, or the row that is not one of this schema.
pub fn append<W: Write + Send>(
    file: &mut Parquet<W>,
    schema: &Schema,
    rows: impl IntoIterator<Item = FileRow>,
    place: impl Fn(u64) -> Vec<Value>,
) -> Result<(), ParquetError> {
    rows.into_iter()
        .try_for_each(|(point, row)| file.add(schema.values(point, place(point), &row).map_err(ParquetError::General)?))
}

/// Reads a field of a row; `None` if it is not of this type.
fn value(kind: Kind, text: &str) -> Option<Value> {
    if text.is_empty() {
        return Some(Value::Absent);
    }
    Some(match kind {
        Kind::Text => Value::from(text),
        Kind::Integer => Value::from(text.parse::<i64>().ok()?),
        Kind::Number => Value::Number(text.parse().ok()?),
        Kind::Flag => Value::Flag(text.parse().ok()?),
    })
}

/// Writes a field as rows have it.
fn text(value: &Value) -> String {
    match value {
        Value::Number(number) => format!("{number:e}"),
        Value::Integer(number) => number.to_string(),
        Value::Flag(flag) => flag.to_string(),
        Value::Text(text) => text.clone(),
        Value::Absent | Value::Null | Value::Json(_) => String::new(),
    }
}
