//! The bits of every shipped scene. `testbench/systems.sh` has compared the record with other systems.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

#[path = "../../examples/bits.rs"]
mod example;

/// Returns the hashes of a table, by the name of the scene.
fn rows(table: &str) -> BTreeMap<&str, &str> {
    table.lines().filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once(' ')).collect()
}

#[test]
fn every_shipped_scene_has_the_bits_on_record() {
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testbench/record/hashes.txt");
    let record = fs::read_to_string(place).expect("the record");
    let found = example::table();
    let (record, found) = (rows(&record), rows(&found));
    assert!(found.len() > 75, "{} scenes", found.len());
    let names = record.keys().chain(found.keys());
    let others: Vec<_> = names.filter(|name| record.get(*name) != found.get(*name)).collect();
    assert!(
        others.is_empty(),
        "other bits than on record: {others:?}; if they are meant to change, testbench/systems.sh --update writes the \
         record, and the commit says why"
    );
}
