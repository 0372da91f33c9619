//! The rows of a run as Parquet.

use std::io::Write;

use parquet::errors::ParquetError;

use crate::page::{Column, Parquet, Value};

/// Number of rows in a group, and so in memory at a time.
const GROUP_ROWS: usize = 1 << 16;

/// A Parquet file that rows are added to; each value is a column of doubles whose name ends in its unit. The metadata
/// hold the command, the convention of signs, and a line about each column.
pub struct TraceTable<W: Write + Send>(Parquet<W>);

impl<W: Write + Send> TraceTable<W> {
    /// Begins the file. Each column is a name that ends in its unit, and a line about it.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn new(out: W, columns: &[(String, String)], signs: &str, command: &str) -> Result<Self, ParquetError> {
        let metadata = [("command".into(), command.into()), ("signs".into(), signs.into())];
        let numbers: Vec<Column> = columns.iter().map(|(name, _)| Column::number(name, "")).collect();
        let metadata = metadata.into_iter().chain(columns.iter().cloned());
        Parquet::new(out, "trace", &numbers, metadata, GROUP_ROWS).map(Self)
    }

    /// Adds a row: a value for each column, in the columns' order.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn add(&mut self, row: impl IntoIterator<Item = f64>) -> Result<(), ParquetError> {
        self.0.add(row.into_iter().map(Value::Number))
    }

    /// Writes the remaining rows and the end of the file.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn finish(self) -> Result<(), ParquetError> {
        self.0.finish()
    }
}
