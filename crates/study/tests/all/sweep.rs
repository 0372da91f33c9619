//! The files of sweeps: rows come back as they were, no bit of a sealed file can change, and a search in waves of many
//! processes is the search.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use hpu_cosim::Control;
use hpu_study::page::{Column, Parquet, ParquetFile, Value};
use hpu_study::sweep::{Damage, FileRow, SEAL, Schema, UNSEALED, append, seal, unseal};
use hpu_study::units::UnitResult;
use hpu_study::widths::search::{Ended, search_wave};

use crate::width_search::{PLAN, Set, found, knobs, scene};

fn schema() -> Schema {
    let fields = vec![
        Column::text("outcome", ""),
        Column::number("rms", ""),
        Column::integer("edges", ""),
        Column::text("rest", ""),
    ];
    Schema::new(vec![Column::number("wall.stiffness", "")], fields)
}

fn told(count: u64) -> Vec<FileRow> {
    let row = |point: u64| match point % 5 {
        0 => Some(Err(format!("more than {point} events, \"quoted\""))),
        1 => None,
        2 => Some(Ok(format!("settled,,{point},"))),
        3 => Some(Ok(format!("settled,inf,-{point},a, b, c"))),
        _ => Some(Ok(format!("limit_cycle,{:e},,rest", f64::from(point as u32).sqrt() * 1e-300))),
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
    let (schema, rows) = (schema(), told(1000));
    let (whole, part, joined) = (place("whole"), place("part"), place("joined"));
    write(&whole, &rows, 300);
    let open = |path: &Path| ParquetFile::open(File::open(path).expect("a file"), schema.columns()).expect("Parquet");
    let file = open(&whole);
    assert_eq!((file.groups(), file.metadata("command")), (4, Some("hpu map x")));
    let read: Vec<FileRow> =
        (0..4).flat_map(|group| schema.told(&file.group(group).expect("rows")).expect("columns agree")).collect();
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
    write(&path, &told(20), 8);
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
fn a_search_whose_waves_are_shared_by_processes_finds_what_one_process_finds() {
    let scene =
        [scene("thrown-hybrid", &[("run.duration".to_string(), "40 ms".to_string())].into_iter().collect::<Set>())];
    let knobs = knobs(&["position_bits=5..7", "velocity_bits=3..5"]);
    let plan = hpu_study::widths::search::Plan { jobs: NonZeroUsize::MIN, ..PLAN };
    let control = Control::default();
    let part = |done: &BTreeMap<usize, UnitResult>, part: &[usize]| {
        let mut rows = BTreeMap::new();
        let keep = |index: usize, row: &UnitResult| {
            rows.insert(index, row.clone());
            Ok::<(), Infallible>(())
        };
        let ended = search_wave(&scene, &knobs, plan, done.clone(), part, &control, keep);
        (ended, rows)
    };
    let mut done = BTreeMap::new();
    let mut waves = 0;
    let shared = loop {
        match part(&done, &[]) {
            (Ok(found), rows) => {
                assert!(rows.is_empty());
                break found;
            }
            (Err(Ended::Wave(wave)), rows) => {
                assert!(rows.is_empty(), "no run is done unasked");
                waves += 1;
                let (first, second) = wave.split_at(wave.len() / 2);
                // Each half knows the waves before alone.
                let parts = [second, first].map(|half| part(&done, half));
                for ((ended, rows), half) in parts.into_iter().zip([second, first]) {
                    assert!(matches!(ended, Err(Ended::Wave(of)) if of == wave));
                    assert_eq!(rows.keys().copied().collect::<BTreeSet<_>>(), half.iter().copied().collect());
                    done.extend(rows);
                }
            }
            _ => panic!("nobody stops it"),
        }
    };
    assert!(waves > 2);
    assert_eq!(shared, found(&scene, &knobs, plan).expect("a search"));
}
