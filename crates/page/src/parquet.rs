//! Tables as Parquet, written and read a group of rows at a time, so that memory does not grow with the number of rows.

use std::fs::File;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use crate::cell::Value;
use crate::table::{Column, Field, Kind, Place};

/// Number of rows in a group of a file that [`write_parquet`] writes.
const GROUP_ROWS: usize = 4096;

/// The values of a column in a group of rows, and for each row whether it has one.
#[derive(Debug)]
struct Buffer {
    values: Values,
    present: Vec<i16>,
}

#[derive(Debug)]
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

    /// Returns the values with a place for each row, in the order of the rows.
    fn values(&self) -> Vec<Value> {
        let mut next = 0;
        let value = |present: &i16| {
            if *present == 0 {
                return Value::Absent;
            }
            let at = next;
            next += 1;
            match &self.values {
                Values::Texts(all) => Value::Text(String::from_utf8_lossy(all[at].data()).into_owned()),
                Values::Integers(all) => Value::from(all[at]),
                Values::Numbers(all) => Value::Number(all[at]),
                Values::Flags(all) => Value::Flag(all[at]),
            }
        };
        self.present.iter().map(value).collect()
    }

    /// Moves `rows` rows from the front of another column of the same type to the end of this one.
    fn take(&mut self, other: &mut Self, rows: usize) {
        let values = other.present[..rows].iter().filter(|present| **present != 0).count();
        self.present.extend(other.present.drain(..rows));
        match (&mut self.values, &mut other.values) {
            (Values::Texts(all), Values::Texts(more)) => all.extend(more.drain(..values)),
            (Values::Integers(all), Values::Integers(more)) => all.extend(more.drain(..values)),
            (Values::Numbers(all), Values::Numbers(more)) => all.extend(more.drain(..values)),
            (Values::Flags(all), Values::Flags(more)) => all.extend(more.drain(..values)),
            _ => unreachable!("both columns have the type of the schema"),
        }
    }

    /// Reads a column of a group of `rows` rows.
    fn read(kind: Kind, column: ColumnReader, rows: usize) -> Result<Self, ParquetError> {
        let mut present = Vec::with_capacity(rows);
        macro_rules! values {
            ($reader:ident, $as:ident) => {{
                let mut values = Vec::with_capacity(rows);
                let mut read = 0;
                while read < rows {
                    let (more, ..) = $reader.read_records(rows - read, Some(&mut present), None, &mut values)?;
                    if more == 0 {
                        return Err(ParquetError::EOF(format!("{read} rows of a column, not {rows}")));
                    }
                    read += more;
                }
                Values::$as(values)
            }};
        }
        let values = match (kind, column) {
            (Kind::Text, ColumnReader::ByteArrayColumnReader(mut reader)) => values!(reader, Texts),
            (Kind::Integer, ColumnReader::Int64ColumnReader(mut reader)) => values!(reader, Integers),
            (Kind::Number, ColumnReader::DoubleColumnReader(mut reader)) => values!(reader, Numbers),
            (Kind::Flag, ColumnReader::BoolColumnReader(mut reader)) => values!(reader, Flags),
            _ => return Err(ParquetError::General("a column has another type".into())),
        };
        Ok(Self { values, present })
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
        Self::begin(out, name, columns, metadata, group, Compression::UNCOMPRESSED)
    }

    /// Begins a file as [`new`](Self::new) does, whose pages are compressed by Snappy.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn compressed<'a>(
        out: W,
        name: &str,
        columns: impl IntoIterator<Item = &'a Column>,
        metadata: impl IntoIterator<Item = (String, String)>,
        group: usize,
    ) -> Result<Self, ParquetError> {
        Self::begin(out, name, columns, metadata, group, Compression::SNAPPY)
    }

    fn begin<'a>(
        out: W,
        name: &str,
        columns: impl IntoIterator<Item = &'a Column>,
        metadata: impl IntoIterator<Item = (String, String)>,
        group: usize,
        compression: Compression,
    ) -> Result<Self, ParquetError> {
        let columns: Vec<&Column> = columns.into_iter().filter(|column| column.is_in(Place::File)).collect();
        let fields = columns.iter().map(|column| field(column)).collect::<Result<Vec<_>, _>>()?;
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let metadata = metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let properties = WriterProperties::builder()
            .set_created_by(concat!("hpu ", env!("CARGO_PKG_VERSION")).to_string())
            .set_key_value_metadata(Some(metadata))
            .set_compression(compression)
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

    /// Adds rows that were read from a file with the same columns.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn extend(&mut self, mut rows: Rows) -> Result<(), ParquetError> {
        while rows.count() > 0 {
            let held = self.columns.first().map_or(0, |column| column.present.len());
            let more = rows.count().min(self.group - held);
            self.columns.iter_mut().zip(&mut rows.columns).for_each(|(column, own)| column.take(own, more));
            if held + more >= self.group {
                self.flush()?;
            }
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

/// A group of rows, as a Parquet file has it: the columns that have a place in files.
#[derive(Debug)]
pub struct Rows {
    columns: Vec<Buffer>,
}

impl Rows {
    /// Returns the number of rows.
    pub fn count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.present.len())
    }

    /// Returns the values of a column in the order of the rows.
    pub fn column(&self, index: usize) -> Vec<Value> {
        self.columns[index].values()
    }
}

/// A Parquet file of known columns that is read a group of rows at a time.
pub struct ParquetFile {
    file: SerializedFileReader<File>,
    kinds: Vec<Kind>,
}

impl ParquetFile {
    /// Opens a file that must have these columns, in their order.
    ///
    /// # Errors
    ///
    /// Returns the reader's error, or that the columns are others.
    pub fn open<'a>(file: File, columns: impl IntoIterator<Item = &'a Column>) -> Result<Self, ParquetError> {
        let columns: Vec<&Column> = columns.into_iter().filter(|column| column.is_in(Place::File)).collect();
        let file = SerializedFileReader::new(file)?;
        let schema = file.metadata().file_metadata().schema_descr();
        let found = schema.columns().iter().map(|column| column.name());
        if !found.eq(columns.iter().map(|column| column.file_key())) {
            return Err(ParquetError::General("the file has other columns".into()));
        }
        Ok(Self { file, kinds: columns.iter().map(|column| column.kind()).collect() })
    }

    /// Returns a value of the file's metadata.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        let all = self.file.metadata().file_metadata().key_value_metadata()?;
        all.iter().find(|pair| pair.key == key)?.value.as_deref()
    }

    /// Returns the number of groups.
    pub fn groups(&self) -> usize {
        self.file.num_row_groups()
    }

    /// Reads a group.
    ///
    /// # Errors
    ///
    /// Returns the reader's error.
    pub fn group(&self, index: usize) -> Result<Rows, ParquetError> {
        let group = self.file.get_row_group(index)?;
        let rows = group.metadata().num_rows() as usize;
        let column = |(at, kind): (usize, &Kind)| Buffer::read(*kind, group.get_column_reader(at)?, rows);
        Ok(Rows { columns: self.kinds.iter().enumerate().map(column).collect::<Result<_, _>>()? })
    }
}
