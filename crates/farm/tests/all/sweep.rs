//! The files of sweeps: rows come back as they were, and no bit of a sealed file can change.

use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use hpu_farm::{Damage, Failed, FileRow, Row, SEAL, Schema, UNSEALED, append, form, seal, unseal};
use hpu_page::{Column, Parquet, ParquetFile, Value};
use serde::Serialize;

fn schema() -> Schema {
    let fields = vec![
        Column::text("outcome", ""),
        Column::number("rms", ""),
        Column::integer("edges", ""),
        Column::text("rest", ""),
    ];
    Schema::new(vec![Column::number("wall.stiffness", "")], fields)
}

/// A row of these columns.
#[derive(Serialize)]
struct Ran {
    outcome: &'static str,
    #[serde(with = "form::figure", skip_serializing_if = "Option::is_none")]
    rms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    edges: Option<i64>,
    #[serde(skip_serializing_if = "str::is_empty")]
    rest: &'static str,
}

fn results(count: u64) -> Vec<FileRow> {
    let ran = |outcome, rms, edges, rest| Some(Ok(Row::of(&Ran { outcome, rms, edges, rest })));
    let row = |point: u64| match point % 5 {
        0 => Some(Err(Failed::new(format!("more than {point} events, \"quoted\"")))),
        1 => None,
        2 => ran("settled", None, Some(point as i64), ""),
        3 => ran("settled", Some(f64::INFINITY), Some(-(point as i64)), "a, b, c"),
        _ => ran("limit_cycle", Some(f64::from(point as u32).sqrt() * 1e-300), None, "rest"),
    };
    (0..count).map(|point| (point * 3, row(point))).collect()
}

fn write(path: &Path, rows: &[FileRow], group: usize) {
    let mut file = File::options().read(true).write(true).create(true).truncate(true).open(path).expect("a file");
    let metadata =
        [("command", "hpu map x"), (SEAL, UNSEALED)].map(|(key, value)| (key.to_string(), value.to_string()));
    let copy = file.try_clone().expect("the same file");
    let mut table = Parquet::compressed(copy, "sweep", schema().columns(), metadata, group).expect("begins");
    append(&mut table, &schema(), rows.iter().cloned(), |point| vec![Value::Number(point as f64 / 7.0)]).expect("rows");
    table.finish().expect("ends");
    seal(&mut file).expect("a whole file");
}

fn place(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("hpu-sweep-{name}-{}.parquet", std::process::id()))
}

#[test]
fn rows_come_back_as_they_were_and_files_put_together_are_the_file_of_all_rows() {
    let (schema, rows) = (schema(), results(1000));
    let (whole, part, joined) = (place("whole"), place("part"), place("joined"));
    write(&whole, &rows, 300);
    let open = |path: &Path| ParquetFile::open(File::open(path).expect("a file"), schema.columns()).expect("Parquet");
    let file = open(&whole);
    assert_eq!((file.groups(), file.metadata("command")), (4, Some("hpu map x")));
    let read: Vec<FileRow> =
        (0..4).flat_map(|group| schema.results(&file.group(group).expect("rows")).expect("columns agree")).collect();
    assert_eq!(read, rows);
    let (points, ends) = schema.points(&file.group(3).expect("rows"));
    assert_eq!((points, ends), ((900..1000).map(|point| 3 * point).collect(), [20, 20]));
    // In pieces that fit to no group.
    let metadata =
        [("command", "hpu map x"), (SEAL, UNSEALED)].map(|(key, value)| (key.to_string(), value.to_string()));
    let out = File::options().read(true).write(true).create(true).truncate(true).open(&joined).expect("a file");
    let copy = out.try_clone().expect("the same file");
    let mut table = Parquet::compressed(copy, "sweep", schema.columns(), metadata, 300).expect("begins");
    for piece in rows.chunks(71) {
        write(&part, piece, 50);
        let file = open(&part);
        (0..file.groups()).for_each(|group| table.extend(file.group(group).expect("rows")).expect("rows"));
    }
    table.finish().expect("ends");
    seal(&mut { out }).expect("a whole file");
    assert_eq!(fs::read(&joined).expect("a file"), fs::read(&whole).expect("a file"));
    [whole, part, joined].iter().for_each(|path| fs::remove_file(path).expect("it goes"));
}

#[test]
fn no_bit_of_a_sealed_file_changes_and_no_byte_is_lost_without_notice() {
    let path = place("sealed");
    write(&path, &results(20), 8);
    let whole = fs::read(&path).expect("a file");
    let mut file = File::options().read(true).write(true).open(&path).expect("a file");
    assert!(unseal(&mut file).is_ok());
    let mut put = |at: usize, byte: u8| {
        file.seek(SeekFrom::Start(at as u64)).and_then(|_| file.write_all(&[byte])).expect("it is written");
        unseal(&mut file)
    };
    for (at, &byte) in whole.iter().enumerate() {
        assert!(put(at, byte ^ (1 << (at % 8))).is_err(), "byte {at}");
        let restored = put(at, byte);
        assert!(restored.is_ok(), "byte {at}");
    }
    for length in (0..whole.len()).step_by(17).collect::<Vec<_>>().into_iter().rev() {
        file.set_len(length as u64).expect("it is cut");
        assert!(matches!(unseal(&mut file), Err(Damage::Truncated)), "{length} bytes");
    }
    fs::remove_file(path).expect("it goes");
}

#[test]
fn a_row_of_another_sweep_is_refused() {
    let values = |row: serde_json::Value| schema().values(1, vec![Value::Number(0.5)], &Some(Ok(Row::of(&row))));
    let row = serde_json::json!({ "outcome": "settled", "rms": 1.5, "edges": 7, "rest": "x" });
    let expected =
        vec![1.into(), "made".into(), Value::Number(0.5), "settled".into(), 1.5.into(), 7.into(), "x".into()];
    assert_eq!(values(row.clone()), Ok([expected, vec![Value::Absent]].concat()));
    for (key, value) in [("rms", "one".into()), ("edges", 1.5.into()), ("outcome", 1.into()), ("gain", 1.into())] {
        let mut other = row.clone();
        other[key] = value;
        assert!(values(other).is_err(), "{key}");
    }
    assert!(values("settled".into()).is_err());
}
