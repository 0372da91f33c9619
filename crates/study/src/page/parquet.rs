//! Tables as Parquet, written a group of rows at a time, so that memory does not grow with the number of rows.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use super::cell::Value;
use super::table::{Column, Field, Kind, Place};

/// Number of rows in a group of a file that [`write_parquet`] writes.
const GROUP_ROWS: usize = 4096;

/// The values of a column in a group of rows, and for each row whether it has one.
struct Buffer {
    values: Values,
    present: Vec<i16>,
}

enum Values {
    Texts(Vec<ByteArray>),
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
    Flags(Vec<bool>),
}

impl Buffer {
    fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Text => Values::Texts(Vec::new()),
            Kind::Integer => Values::Integers(Vec::new()),
            Kind::Number => Values::Numbers(Vec::new()),
            Kind::Flag => Values::Flags(Vec::new()),
        };
        Self { values, present: Vec::new() }
    }

    /// Adds a value; one that is not of the column's type is missing.
    fn push(&mut self, value: Value) {
        self.present.push(1);
        match (&mut self.values, value) {
            (Values::Texts(all), Value::Text(text)) => all.push(ByteArray::from(text.into_bytes())),
            (Values::Integers(all), Value::Integer(value)) if i64::try_from(value).is_ok() => all.push(value as i64),
            (Values::Numbers(all), Value::Number(value)) => all.push(value),
            (Values::Flags(all), Value::Flag(flag)) => all.push(flag),
            _ => self.present.iter_mut().last().into_iter().for_each(|present| *present = 0),
        }
    }

    fn write<W: Write + Send>(&mut self, group: &mut SerializedRowGroupWriter<W>) -> Result<(), ParquetError> {
        fn column<T: DataType, W: Write + Send>(
            group: &mut SerializedRowGroupWriter<W>,
            values: &mut Vec<T::T>,
            present: &[i16],
        ) -> Result<(), ParquetError> {
            let mut column = group.next_column()?.ok_or_else(|| ParquetError::General("no more columns".into()))?;
            column.typed::<T>().write_batch(values, Some(present), None)?;
            values.clear();
            column.close()
        }
        let Self { values, present } = self;
        match values {
            Values::Texts(all) => column::<ByteArrayType, W>(group, all, present)?,
            Values::Integers(all) => column::<Int64Type, W>(group, all, present)?,
            Values::Numbers(all) => column::<DoubleType, W>(group, all, present)?,
            Values::Flags(all) => column::<BoolType, W>(group, all, present)?,
        }
        present.clear();
        Ok(())
    }
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.kind() {
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Kind::Integer => (Physical::INT64, None),
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Flag => (Physical::BOOLEAN, None),
    };
    let field = Type::primitive_type_builder(column.file_key(), physical).with_repetition(Repetition::OPTIONAL);
    field.with_logical_type(logical).build().map(Arc::new)
}

/// A Parquet file that rows are added to. Its columns are those that have a place in files.
pub struct Parquet<W: Write + Send> {
    file: SerializedFileWriter<W>,
    columns: Vec<Buffer>,
    group: usize,
}

impl<W: Write + Send> Parquet<W> {
    /// Begins a file of `group` rows a group, and so in memory at a time.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn new<'a>(
        out: W,
        name: &str,
        columns: impl IntoIterator<Item = &'a Column>,
        metadata: impl IntoIterator<Item = (String, String)>,
        group: usize,
    ) -> Result<Self, ParquetError> {
        let columns: Vec<&Column> = columns.into_iter().filter(|column| column.is_in(Place::File)).collect();
        let fields = columns.iter().map(|column| field(column)).collect::<Result<Vec<_>, _>>()?;
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let metadata = metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let properties = WriterProperties::builder()
            .set_created_by(concat!("hpu ", env!("CARGO_PKG_VERSION")).to_string())
            .set_key_value_metadata(Some(metadata))
            .build();
        let file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
        Ok(Self { file, columns: columns.iter().map(|column| Buffer::new(column.kind())).collect(), group })
    }

    /// Adds a row: a value for each column that has a place in files.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn add(&mut self, row: impl IntoIterator<Item = Value>) -> Result<(), ParquetError> {
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        if self.columns.first().is_some_and(|column| column.present.len() >= self.group) {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        self.columns.iter_mut().try_for_each(|column| column.write(&mut group))?;
        group.close().map(drop)
    }

    /// Writes the remaining rows and the end of the file.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn finish(mut self) -> Result<(), ParquetError> {
        if self.columns.first().is_some_and(|column| !column.present.is_empty()) {
            self.flush()?;
        }
        self.file.close().map(drop)
    }
}

/// Writes items as the rows of a Parquet file.
///
/// # Errors
///
/// Returns the writer's error.
pub fn write_parquet<T>(
    out: impl Write + Send,
    name: &str,
    metadata: impl IntoIterator<Item = (String, String)>,
    fields: &[Field<T>],
    items: impl IntoIterator<Item = T>,
) -> Result<(), ParquetError> {
    let mut file = Parquet::new(out, name, fields.iter().map(|field| &field.column), metadata, GROUP_ROWS)?;
    for item in items {
        let in_file = fields.iter().filter(|field| field.column.is_in(Place::File));
        file.add(in_file.map(|field| field.cell(&item).value))?;
    }
    file.finish()
}
