//! The rows of a run as Parquet.

use std::fs::File;

use hpu_page::trace_table::TraceTable;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

#[test]
fn rows_come_back_from_the_file_in_their_order_over_more_than_a_group() {
    let column = |name: &str, doc: &str| (name.to_string(), doc.to_string());
    let columns = [
        column("time_s", "Time"),
        column("angle_rad", "Angle"),
        column("position_count", "Position"),
        column("command_pwm_count", "Command"),
    ];
    let path = std::env::temp_dir().join(format!("hpu-trace-{}.parquet", std::process::id()));
    let mut table = TraceTable::new(File::create(&path).unwrap(), &columns, "along the angle", "hpu run x").unwrap();
    let row = |row: u32| [f64::from(row) * 1e-4, f64::from(row).sin(), f64::from(row % 7), -f64::from(row)];
    let rows = 150_000;
    for index in 0..rows {
        table.add(row(index)).unwrap();
    }
    table.finish().unwrap();
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let file = reader.metadata().file_metadata();
    assert_eq!((file.num_rows(), reader.num_row_groups()), (i64::from(rows), 3));
    let names: Vec<&str> = file.schema_descr().columns().iter().map(|column| column.name()).collect();
    assert_eq!(names, ["time_s", "angle_rad", "position_count", "command_pwm_count"]);
    let metadata = file.key_value_metadata().unwrap();
    let metadata: Vec<_> = metadata.iter().map(|pair| (pair.key.as_str(), pair.value.as_deref().unwrap())).collect();
    let told = columns.iter().map(|(name, doc)| (name.as_str(), doc.as_str()));
    let expected: Vec<_> = [("command", "hpu run x"), ("signs", "along the angle")].into_iter().chain(told).collect();
    assert_eq!(metadata, expected);
    for (index, found) in (0..).zip(reader.get_row_iter(None).unwrap()) {
        let found = found.unwrap();
        let found: Vec<f64> = found
            .get_column_iter()
            .map(|(_, field)| if let Field::Double(value) = field { *value } else { panic!("{field:?}") })
            .collect();
        assert_eq!(found, row(index), "row {index}");
    }
    std::fs::remove_file(path).unwrap();
}
