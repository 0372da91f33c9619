//! The rows of a run as Parquet, written a group of rows at a time, so that memory does not grow with the run.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

/// Number of rows in a group, and so in memory at a time.
const GROUP_ROWS: usize = 1 << 16;

/// A Parquet file that rows are added to; each value is a column of doubles whose name ends in its unit. The metadata
/// hold the command, the convention of signs, and a line about each column.
pub struct TraceTable<W: Write + Send> {
    file: SerializedFileWriter<W>,
    columns: Vec<Vec<f64>>,
}

impl<W: Write + Send> TraceTable<W> {
    /// Begins the file. Each column is a name that ends in its unit, and a line about it.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn new(out: W, columns: &[(String, String)], signs: &str, command: &str) -> Result<Self, ParquetError> {
        let column = |(name, _): &(String, String)| {
            let column = Type::primitive_type_builder(name, Physical::DOUBLE);
            column.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
        };
        let fields = columns.iter().map(column).collect::<Result<Vec<_>, _>>()?;
        let schema = Type::group_type_builder("trace").with_fields(fields).build()?;
        let told = columns.iter().map(|(name, doc)| (&**name, &**doc));
        let metadata = [("command", command), ("signs", signs)].into_iter().chain(told);
        let metadata = metadata.map(|(key, value)| KeyValue::new(key.to_string(), value.to_string())).collect();
        let properties = WriterProperties::builder()
            .set_created_by(concat!("hpu ", env!("CARGO_PKG_VERSION")).to_string())
            .set_key_value_metadata(Some(metadata))
            .build();
        let file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
        Ok(Self { file, columns: vec![Vec::with_capacity(GROUP_ROWS); columns.len()] })
    }

    /// Adds a row: a value for each column, in the columns' order.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn add(&mut self, row: impl IntoIterator<Item = f64>) -> Result<(), ParquetError> {
        for (column, value) in self.columns.iter_mut().zip(row) {
            column.push(value);
        }
        if self.columns[0].len() == GROUP_ROWS { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        for values in &mut self.columns {
            let mut column = group.next_column()?.ok_or_else(|| ParquetError::General("no more columns".into()))?;
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
            values.clear();
        }
        group.close().map(drop)
    }

    /// Writes the remaining rows and the end of the file.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn finish(mut self) -> Result<(), ParquetError> {
        if !self.columns[0].is_empty() {
            self.flush()?;
        }
        self.file.close().map(drop)
    }
}
