//! The columns of a sweep's files, and rows as they stand there.

use std::io::Write;

use parquet::errors::ParquetError;

use hpu_page::{Column, Kind, Parquet, Place, Rows, Value, csv_line};
use serde_json::{Map, Number, Value as Json};

use crate::row::{Failed, Row, UnitResult};

/// The result of a point: its row or the reason of its failure; `None` if it was not run, because it took longer than
/// the guard allows.
pub type PointResult = Option<UnitResult>;

/// A row of a file: the number of its point, and its result.
pub type FileRow = (u64, PointResult);

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
    /// Returns the schema of points with these columns of their places, whose rows are objects with these fields.
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
    /// Fails if the row is not one of this schema.
    pub fn values(&self, point: u64, place: Vec<Value>, row: &PointResult) -> Result<Vec<Value>, Failed> {
        let fields = self.fields();
        let absent = || vec![Value::Absent; fields.len()];
        let (state, fields, reason) = match row {
            Some(Ok(row)) => {
                let refused = || Failed::new(format!("`{row}` is no row of this sweep"));
                let mut object: Map<String, Json> = row.read().map_err(|_| refused())?;
                let taken = |column: &Column| value(column.kind(), object.remove(column.file_key()));
                let values: Option<Vec<Value>> = fields.iter().map(taken).collect();
                (STATES[0], values.filter(|_| object.is_empty()).ok_or_else(refused)?, Value::Absent)
            }
            Some(Err(reason)) => (STATES[1], absent(), Value::from(reason.to_string())),
            None => (STATES[2], absent(), Value::Absent),
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
    pub fn results(&self, rows: &Rows) -> Option<Vec<FileRow>> {
        let first = 2 + self.places;
        let columns: Vec<Vec<Value>> = (0..self.columns.len()).map(|at| rows.column(at)).collect();
        let row = |at: usize| {
            let Value::Integer(point) = columns[0][at] else { return None };
            let Value::Text(state) = &columns[1][at] else { return None };
            let result = if *state == STATES[0] {
                let fields = self.fields().iter().zip(&columns[first..]);
                let fields = fields.filter_map(|(column, values)| Some((column.file_key().into(), json(&values[at])?)));
                Some(Ok(Row::of(&fields.collect::<Map<String, Json>>())))
            } else if *state == STATES[1] {
                let Value::Text(reason) = &columns[columns.len() - 1][at] else { return None };
                Some(Err(Failed::new(reason)))
            } else {
                None
            };
            Some((u64::try_from(point).ok()?, result))
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
            let line = csv_line(columns.iter().map(|column| column[at].csv()));
            out.write_all(line.as_bytes())
        })
    }

    /// Returns the line of CSV with the names of the columns.
    pub fn csv_head(&self) -> String {
        let named = self.columns.iter().filter(|column| column.is_in(Place::File));
        csv_line(named.map(|column| column.file_key().to_string()))
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
    rows.into_iter().try_for_each(|(point, row)| {
        let values = schema.values(point, place(point), &row);
        file.add(values.map_err(|failed| ParquetError::General(failed.to_string()))?)
    })
}

/// Returns a field of a row as a value; `None` if it is not of this type.
fn value(kind: Kind, field: Option<Json>) -> Option<Value> {
    Some(match (kind, field) {
        (_, None | Some(Json::Null)) => Value::Absent,
        (Kind::Text, Some(Json::String(text))) if text.is_empty() => Value::Absent,
        (Kind::Text, Some(Json::String(text))) => Value::Text(text),
        (Kind::Integer, Some(Json::Number(number))) => Value::from(number.as_i64()?),
        (Kind::Number, Some(Json::Number(number))) => Value::Number(number.as_f64()?),
        // Numbers that JSON does not know are texts there.
        (Kind::Number, Some(Json::String(text))) => Value::Number(text.parse().ok()?),
        (Kind::Flag, Some(Json::Bool(flag))) => Value::Flag(flag),
        _ => return None,
    })
}

/// Returns a value as a row's field; `None` for one that is missing.
fn json(value: &Value) -> Option<Json> {
    Some(match value {
        Value::Number(value) => Number::from_f64(*value).map_or_else(|| value.to_string().into(), Json::Number),
        value => return value.json().filter(|json| !json.is_null()),
    })
}
