//! A map as rows of CSV and of Parquet.

use std::io::{self, Write};
use std::ops::Range;
use std::sync::Arc;

use hpu_cosim::scene::Experiment;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use super::{Found, Map, is_late, outcome, outcome_name};

/// Names of the columns. Numbers are empty (null) where they have no meaning, and in cells that were not run.
pub const COLUMNS: [&str; 22] = [
    "method",
    "ix",
    "iy",
    "x",
    "y",
    "outcome",
    "run",
    "rms",
    "amplitude",
    "frequency_hz",
    "hand_j",
    "source_j",
    "dissipated_j",
    "displayed_stiffness",
    "displayed_ratio",
    "contact_share",
    "product_wraps",
    "contact_unseen",
    "stiffness_error",
    "overflow_share",
    "edges",
    "reason",
];

/// Names of the columns with measurements.
const MEASURED: [&str; 13] = [
    "rms",
    "amplitude",
    "frequency_hz",
    "hand_j",
    "source_j",
    "dissipated_j",
    "displayed_stiffness",
    "displayed_ratio",
    "contact_share",
    "product_wraps",
    "contact_unseen",
    "stiffness_error",
    "overflow_share",
];

/// Returns units and meanings as keys and values, for the heads of the files.
#[must_use]
pub fn units_of(map: &Map) -> Vec<(String, String)> {
    let middle = map.point(map.layer() / 2);
    let (position, stiffness) = match map.experiment(middle) {
        Ok(Experiment::Axis(scene)) => (scene.device.units().position, scene.device.units().stiffness),
        Ok(Experiment::Dut(scene)) => (scene.device.units().position, scene.device.units().stiffness),
        Ok(Experiment::Phantom(_)) => ("m", "N/m"),
        Err(_) => ("as the device's positions", "as the device's stiffnesses"),
    };
    let axis = |axis: &super::Axis| {
        let unit = map.unit(axis);
        if unit.is_empty() { axis.key().to_string() } else { format!("{} in {unit}", axis.key()) }
    };
    let pairs = [
        ("x", axis(&map.x)),
        ("y", axis(&map.y)),
        ("run", "1 for a cell that was run, 0 for one whose outcome is inferred from the cells around it".into()),
        ("rms", format!("{position}, about the mean of the last three tenths")),
        ("amplitude", format!("{position}, half of the range")),
        ("frequency_hz", "Hz".into()),
        ("hand_j", "J that the hand gave".into()),
        ("source_j", "J that the supply gave".into()),
        ("dissipated_j", "J that became heat".into()),
        (
            "displayed_stiffness",
            format!("{stiffness}, mean of what pushes back over mean penetration in a settled contact"),
        ),
        ("displayed_ratio", "displayed_stiffness over the stiffness asked for".into()),
        (
            "contact_share",
            "of the judged window, the last three tenths, in which the wall sees penetration; 0: not reached".into(),
        ),
        (
            "product_wraps",
            "how often the spring's product has wrapped at rest in the wall: the hand is through it".into(),
        ),
        (
            "contact_unseen",
            "1 where the device was past its wall while the datapath saw no contact: its position counter wrapped"
                .into(),
        ),
        ("stiffness_error", "stiffness that the words realise over what is asked for, less 1".into()),
        ("overflow_share", "of the edges, at which the net that overflowed most had overflowed".into()),
        ("edges", "clock edges".into()),
        ("replay", "the command that runs the cell again".into()),
    ];
    pairs.map(|(key, value)| (key.to_string(), value)).into()
}

/// A row of the table, without the command.
struct Fields<'a> {
    method: &'a str,
    place: [usize; 2],
    at: [f64; 2],
    outcome: &'static str,
    run: bool,
    measured: [Option<f64>; MEASURED.len()],
    edges: Option<u64>,
    reason: &'a str,
}

fn fields<'a>(map: &'a Map, found: &'a [Found], index: usize) -> Fields<'a> {
    let point = map.point(index);
    let cell = match &found[index] {
        Found::Run(Ok(cell)) => Some(cell),
        _ => None,
    };
    Fields {
        method: &map.methods[point.method].label,
        place: [point.ix, point.iy],
        at: [map.x.values()[point.ix], map.y.values()[point.iy]],
        outcome: if is_late(found, index) { "not_run" } else { outcome_name(outcome(found, index)) },
        run: matches!(found[index], Found::Run(_)),
        measured: cell.map_or([None; MEASURED.len()], |cell| {
            [
                cell.rms,
                cell.amplitude,
                cell.frequency_hz,
                Some(cell.hand_j),
                Some(cell.source_j),
                Some(cell.dissipated_j),
                cell.displayed_stiffness,
                cell.displayed_ratio,
                cell.contact_share,
                cell.product_wraps.map(|wraps| f64::from(wraps.get())),
                Some(f64::from(u8::from(cell.contact_unseen))),
                cell.stiffness_error,
                Some(cell.overflow_share),
            ]
        }),
        edges: cell.map(|cell| cell.edges),
        reason: match &found[index] {
            Found::Run(Err(reason)) => reason,
            _ => "",
        },
    }
}

/// Returns a field as CSV writes it, quoted if needed.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

/// Writes the map as CSV. Lines that begin with `#` hold the command that made it, and the units. `replay` returns the
/// command of each cell.
///
/// # Errors
///
/// Returns the writer's error.
pub fn csv(
    mut out: impl Write,
    map: &Map,
    found: &[Found],
    command: &str,
    replay: impl Fn(usize) -> String,
) -> io::Result<()> {
    writeln!(out, "# {command}")?;
    for (key, value) in units_of(map) {
        writeln!(out, "# {key}: {value}")?;
    }
    writeln!(out, "{},replay", COLUMNS.join(","))?;
    for index in 0..found.len() {
        let Fields { method, place: [ix, iy], at: [x, y], outcome, run, measured, edges, reason } =
            fields(map, found, index);
        write!(out, "{},{ix},{iy},{x},{y},{outcome},{},", quoted(method), u8::from(run))?;
        for value in measured {
            value.map_or(Ok(()), |value| write!(out, "{value:e}"))?;
            out.write_all(b",")?;
        }
        edges.map_or(Ok(()), |edges| write!(out, "{edges}"))?;
        writeln!(out, ",{},{}", quoted(reason), quoted(&replay(index)))?;
    }
    out.flush()
}

/// Number of rows in a group of the Parquet file, and so in memory at a time.
const GROUP_ROWS: usize = 4096;

/// Writes the map as Parquet, with the same columns; units and command are in the file's metadata.
///
/// # Errors
///
/// Returns the writer's error.
pub fn parquet(
    out: impl Write + Send,
    map: &Map,
    found: &[Found],
    command: &str,
    replay: impl Fn(usize) -> String,
) -> Result<(), ParquetError> {
    let measured: String = MEASURED.map(|name| format!("optional double {name};")).concat();
    let schema = format!(
        "message map {{ required binary method (utf8); required int32 ix; required int32 iy; required double x; \
         required double y; required binary outcome (utf8); required int32 run; {measured} optional int64 edges; \
         required binary reason (utf8); required binary replay (utf8); }}"
    );
    let metadata = [("command".to_string(), command.to_string())].into_iter().chain(units_of(map));
    let metadata = metadata.map(|(key, value)| KeyValue::new(key, value)).collect();
    let properties = WriterProperties::builder()
        .set_created_by(concat!("hpu ", env!("CARGO_PKG_VERSION")).to_string())
        .set_key_value_metadata(Some(metadata))
        .build();
    let schema = Arc::new(parse_message_type(&schema)?);
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    for first in (0..found.len()).step_by(GROUP_ROWS) {
        let mut group = file.next_row_group()?;
        rows(&mut group, map, found, first..found.len().min(first + GROUP_ROWS), &replay)?;
        group.close()?;
    }
    file.close().map(drop)
}

/// Writes a group of rows, column by column.
fn rows<W: Write + Send>(
    group: &mut Group<W>,
    map: &Map,
    found: &[Found],
    cells: Range<usize>,
    replay: impl Fn(usize) -> String,
) -> Result<(), ParquetError> {
    let rows: Vec<Fields> = cells.clone().map(|index| fields(map, found, index)).collect();
    texts(group, rows.iter().map(|row| row.method))?;
    for axis in 0..2 {
        let places: Vec<i32> = rows.iter().map(|row| row.place[axis] as i32).collect();
        column::<Int32Type, W>(group, &places, None)?;
    }
    for axis in 0..2 {
        let values: Vec<f64> = rows.iter().map(|row| row.at[axis]).collect();
        column::<DoubleType, W>(group, &values, None)?;
    }
    texts(group, rows.iter().map(|row| row.outcome))?;
    let run: Vec<i32> = rows.iter().map(|row| i32::from(row.run)).collect();
    column::<Int32Type, W>(group, &run, None)?;
    for index in 0..MEASURED.len() {
        let (values, levels) = known(rows.iter().map(|row| row.measured[index]));
        column::<DoubleType, W>(group, &values, Some(&levels))?;
    }
    let (edges, levels) = known(rows.iter().map(|row| row.edges.map(|edges| edges as i64)));
    column::<Int64Type, W>(group, &edges, Some(&levels))?;
    texts(group, rows.iter().map(|row| row.reason))?;
    let commands: Vec<String> = cells.map(replay).collect();
    texts(group, commands.iter().map(String::as_str))
}

type Group<'a, W> = SerializedRowGroupWriter<'a, W>;

/// Returns the present values, and for each row whether it has one.
fn known<T>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let values: Vec<Option<T>> = values.collect();
    let levels = values.iter().map(|value| i16::from(value.is_some())).collect();
    (values.into_iter().flatten().collect(), levels)
}

fn column<T: parquet::data_type::DataType, W: Write + Send>(
    group: &mut Group<W>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let mut column = group.next_column()?.ok_or_else(|| ParquetError::General("no more columns".into()))?;
    column.typed::<T>().write_batch(values, levels, None)?;
    column.close()
}

fn texts<'a, W: Write + Send>(group: &mut Group<W>, values: impl Iterator<Item = &'a str>) -> Result<(), ParquetError> {
    let values: Vec<ByteArray> = values.map(ByteArray::from).collect();
    column::<ByteArrayType, W>(group, &values, None)
}
