//! The rows of the study of costs as text, CSV and JSON.

use hpu_page::{Cell, Column, Place, Table};
use hpu_papers::phantom::{COST, DEVICE};
use hpu_papers::studies::summing::summing_up;
use hpu_rtl::{Cost, HX8K_BRAM, HX8K_CELLS};
use serde_json::{Value, json};

use super::Config;
use super::claims::sums;
use super::row::{CostRow, Proof};
use crate::cost::{counted, judged, timed};

/// Returns all rows as text.
pub fn text(versions: &[String], rows: &[CostRow]) -> String {
    let mut text = format!(
        "{DEVICE}: what its blocks and loops cost\n$ hpu reproduce {COST}\n{}\n\n\
         Counts are of each block alone, for the iCE40 HX8K ({HX8K_CELLS} logic cells, {HX8K_BRAM} block RAMs of 4096 \
         bits, no multiplier)\nor, where that is too small, for the ECP5. MHz is the fastest clock, ns the longest \
         path of a combinational block; neither of what does not fit.\nLoops: the tables hold counts of `depth` bits; \
         the proved error of the tip in um over these tables, and over tables of 13 bits, \
         the published ones, as is that of torques\n\
         in % of the joint's full scale, for the forces as words; `length` is how far the words of 140 mm are off, \
         which is no part of the errors.\n\n",
        versions.join(", ")
    );
    text += &table(rows).painted(&|cell, _| cell.to_string());
    text + &tables() + &summing_up(&sums(rows))
}

/// Returns the rows as a table for text, CSV and JSON.
pub fn table(rows: &[CostRow]) -> Table {
    let speed = |row: &CostRow| {
        let unit = if row.priced.clocked { "MHz" } else { "ns" };
        match (&row.priced.cost, row.priced.speed()) {
            (Err(_), _) => Cell::absent(),
            (Ok(_), speed) => speed.map_or("-".to_string(), |speed| format!("{speed:.2} {unit}")).into(),
        }
    };
    let in_file = |key: &str, clocked: bool| {
        let speed = move |row: &CostRow| row.priced.speed().filter(|_| row.priced.clocked == clocked);
        let text = move |row: &CostRow| speed(row).map(|speed| format!("{speed:.2}"));
        Column::text(key, "").only(&[Place::File]).of(text)
    };
    // A figure of the proof has fewer digits in text than in the file.
    let proved = |key: &str, head: &str, least: usize, digits: [usize; 2], figure: fn(&Proof) -> f64| {
        let [text, file] = digits.map(|digits| {
            move |row: &CostRow| match &row.proof {
                Some(proof) => Cell::from(format!("{:.digits$}", figure(proof))),
                None => Cell::absent(),
            }
        });
        let said = Column::number("", head).least(least).said().of(text);
        [said, Column::text(key, "").only(&[Place::File]).of(file)]
    };
    let depth = |row: &CostRow| row.proof.as_ref().map_or(Cell::absent(), |proof| proof.depth_width.into());
    let places = [Place::Text, Place::File];
    let remark = |row: &CostRow| match (&row.priced.cost, row.priced.too_large()) {
        (Err(failure), _) => Cell::from(format!("\n  {}", failure.trim_end().replace('\n', "\n  "))).good(false),
        (_, Some(Cost { cells, ice40, .. })) => format!(
            "\n{:<33} does not fit the HX8K: {cells} of {HX8K_CELLS} logic cells, {} of {HX8K_BRAM} block RAMs",
            "", ice40.bram
        )
        .into(),
        _ => Cell::absent(),
    };
    let mut fields = vec![
        Column::text("block", "block").least(20).of(|row: &CostRow| row.priced.name.clone()),
        Column::text("name", "variant").file("variant").least(12).of(|row: &CostRow| row.priced.label.clone()),
    ];
    fields.extend(counted([11, 6, 5, 6, 4, 4, 6]).chain(judged()));
    fields.extend([
        Column::number("", "speed").least(11).said().of(speed),
        in_file("fmax_mhz", true),
        in_file("path_ns", false),
        Column::text("", "|").said().of(|row: &CostRow| row.proof.as_ref().map_or("", |_| "|")),
        Column::integer("depth_bits", "depth").only(&places).of(depth),
    ]);
    fields.extend(proved("position_error_um", "tip um", 8, [3, 4], |proof| proof.position_um));
    fields.extend(proved("position_error_13_bits_um", "13 bits", 8, [3, 4], |proof| proof.position_13_um));
    fields.extend(proved("torque_error_13_bits_percent", "torque %", 9, [5, 6], |proof| proof.torque_percent));
    fields.extend(proved("length_error_um", "length", 7, [3, 4], |proof| proof.length_um));
    fields.push(Column::text("proved", "").only(&[Place::Json]).of(|row: &CostRow| row.proof.as_ref().map(object)));
    fields.extend(timed());
    fields.push(Column::text("", "").said().of(remark));
    Table::of("blocks", rows, fields).gap(1)
}

/// Returns the text about the tables that fit into an HX8K.
fn tables() -> String {
    let mut text = format!(
        "\nTables of sine and cosine for three joints that the {HX8K_BRAM} block RAMs of an HX8K have bits for, \
         {} of them:\n",
        HX8K_BRAM * 4096
    );
    let default = Config::default();
    for (name, config) in [
        ("(1,1,14)", default.fraction(14)),
        ("(1,1,18)", default.fraction(18)),
        ("(1,1,22)", default.narrow()),
        ("(1,9,22)", default),
    ] {
        let pair = 2 * u64::from(config.formats.trig.width());
        let bits = |depth: u32| 3 * pair * (1 << depth);
        let deepest = (2..=16).rev().find(|depth| bits(*depth) <= HX8K_BRAM * 4096).unwrap_or(0);
        text += &format!(
            "  {name}: at most {deepest} bits of depth ({} bits); the published 13 need {} block RAMs\n",
            bits(deepest),
            bits(13) / 4096
        );
    }
    text
}

/// Returns the proved errors as JSON.
fn object(proof: &Proof) -> Value {
    json!({
        "depth_bits": proof.depth_width,
        "position_error_m": 1e-6 * proof.position_um,
        "position_error_13_bits_m": 1e-6 * proof.position_13_um,
        "torque_error_13_bits_percent": proof.torque_percent,
        "length_error_m": 1e-6 * proof.length_um,
    })
}
