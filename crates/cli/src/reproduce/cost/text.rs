//! The rows of the study of costs as text, CSV and JSON.

use hpu_papers::phantom::{COST, DEVICE};
use hpu_papers::studies::summing::summing_up;
use hpu_rtl::{Counts, HX8K_BRAM, HX8K_CELLS};
use serde_json::{Value, json};

use super::Config;
use super::claims::sums;
use super::row::{CostRow, Proof};
use crate::cost::{speed, target};

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
    text += &format!(
        "{:<20} {:<12} {:<11}{:>7}{:>6}{:>7}{:>5}{:>5}{:>7}{:>12} |{:>6}{:>9}{:>9}{:>10}{:>8}\n",
        "block",
        "variant",
        "target",
        "lut4",
        "ff",
        "carry",
        "bram",
        "dsp",
        "cells",
        "speed",
        "depth",
        "tip um",
        "13 bits",
        "torque %",
        "length"
    );
    for row in rows {
        text += &table_row(row);
    }
    text + &tables() + &summing_up(&sums(rows))
}

fn table_row(row: &CostRow) -> String {
    let CostRow { name, label, clocked, cost, proof } = row;
    let proof = proof.as_ref().map_or(String::new(), |proof| {
        let Proof { depth_width, position_um, position_13_um, torque_percent, length_um } = proof;
        format!(" |{depth_width:>6}{position_um:>9.3}{position_13_um:>9.3}{torque_percent:>10.5}{length_um:>8.3}")
    });
    let cost = match cost {
        Ok(cost) => cost,
        Err(failure) => return format!("{name:<20} {label:<12} {}{proof}\n", failure.trim_end()),
    };
    let (target, Counts { lut4, ff, carry, bram, dsp }) = target(cost);
    let dsp = if cost.fits() { "-".to_string() } else { dsp.to_string() };
    let unit = if *clocked { "MHz" } else { "ns" };
    let speed = speed(*clocked, cost).map_or("-".to_string(), |speed| format!("{speed:.2} {unit}"));
    let mut line = format!(
        "{name:<20} {label:<12} {target:<11}{lut4:>7}{ff:>6}{carry:>7}{bram:>5}{dsp:>5}{:>7}{speed:>12}{proof}\n",
        cost.cells
    );
    if !cost.fits() {
        line += &format!(
            "{:<33} does not fit the HX8K: {} of {HX8K_CELLS} logic cells, {} of {HX8K_BRAM} block RAMs\n",
            "", cost.cells, cost.ice40.bram
        );
    }
    line
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

const CSV_HEADER: &str = "block,variant,target,lut4,ff,carry,bram,dsp,hx8k_cells,hx8k_bram,fits_hx8k,fmax_mhz,path_ns,\
     depth_bits,position_error_um,position_error_13_bits_um,torque_error_13_bits_percent,length_error_um,failure\n";

/// Returns a CSV with a row for each block or loop, below a line with the tools.
pub fn csv(versions: &[String], rows: &[CostRow]) -> String {
    let mut text = format!("# {}\n{CSV_HEADER}", versions.join(", "));
    for CostRow { name, label, clocked, cost, proof } in rows {
        let proof = proof.as_ref().map_or(",,,,".to_string(), |proof| {
            let Proof { depth_width, position_um, position_13_um, torque_percent, length_um } = proof;
            format!("{depth_width},{position_um:.4},{position_13_um:.4},{torque_percent:.6},{length_um:.4}")
        });
        text += &match cost {
            Ok(cost) => {
                let (target, Counts { lut4, ff, carry, bram, dsp }) = target(cost);
                let speed = speed(*clocked, cost).map_or(String::new(), |speed| format!("{speed:.2}"));
                let (fmax, path) = if *clocked { (speed, String::new()) } else { (String::new(), speed) };
                format!(
                    "{name},{label},{target},{lut4},{ff},{carry},{bram},{dsp},{},{},{},{fmax},{path},{proof},\n",
                    cost.cells,
                    cost.ice40.bram,
                    cost.fits()
                )
            }
            Err(failure) => format!("{name},{label},,,,,,,,,,,,{proof},\"{}\"\n", failure.replace('"', "\"\"")),
        };
    }
    text
}

/// Returns a row as JSON.
pub fn object(row: &CostRow) -> Value {
    let mut object = crate::cost::object(row.label, row.clocked, &row.cost);
    object["block"] = json!(row.name);
    object["proved"] = json!(row.proof.as_ref().map(|proof| json!({
        "depth_bits": proof.depth_width,
        "position_error_m": 1e-6 * proof.position_um,
        "position_error_13_bits_m": 1e-6 * proof.position_13_um,
        "torque_error_13_bits_percent": proof.torque_percent,
        "length_error_m": 1e-6 * proof.length_um,
    })));
    object
}
