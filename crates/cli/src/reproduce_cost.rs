//! `hpu reproduce phantom-cost`: what the PHANToM's blocks and loops cost in an FPGA, and what a bit costs.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use hpu_datapath::phantom::{PhantomConfig, bounds, loop_variants};
use hpu_rtl::{Cost, Counts, HX8K_BRAM, HX8K_CELLS, cost, tool_versions, vhdl};
use hpu_study::reproduce::formats::{STIFFNESS_MAX_N_PER_M, full_scales_nm};
use hpu_study::units;
use serde_json::{Value, json};

use crate::block::find;
use crate::cost::{refused, speed, target};
use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::interrupt;
use crate::journal::Journal;
use crate::terminal::{print, print_json, with_progress};

/// Blocks and loops, each with the label of its configuration: cheap ones first, full tables last.
const PLAN: [(&str, &str); 20] = [
    ("trig_quarter", "default"),
    ("trig_interpolated", "default"),
    ("trig_cordic", "default"),
    ("sample_register", "default"),
    ("phantom_forward", "default"),
    ("cube_room", "default"),
    ("phantom_torque", "default"),
    ("command_scaler", "default"),
    ("command_register", "default"),
    ("phantom_engine", "default"),
    ("phantom_io", "default"),
    ("phantom_shared_loop", "fraction_14"),
    ("phantom_shared_loop", "fraction_18"),
    ("phantom_shared_loop", "fraction_22"),
    ("phantom_shared_loop", "narrow_trig"),
    ("phantom_loop", "fraction_14"),
    ("phantom_loop", "fraction_22"),
    ("trig_table", "default"),
    ("phantom_shared_loop", "default"),
    ("phantom_loop", "default"),
];

/// What to synthesise.
#[derive(clap::Args)]
pub struct Args {
    /// These blocks alone, as in phantom_forward,phantom_loop
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = planned)]
    blocks: Vec<String>,
    /// Folder of the VHDL
    #[arg(long, value_name = "DIR", default_value = "hdl")]
    hdl: PathBuf,
    /// Write phantom-cost.csv and phantom-cost.txt into this folder, and go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

fn planned(name: &str) -> Result<String, String> {
    let mut names: Vec<_> = PLAN.iter().map(|(name, _)| *name).collect();
    names.dedup();
    if names.contains(&name) { Ok(name.to_string()) } else { Err(format!("it is none of {}", names.join(", "))) }
}

/// A block or loop, and what became of it.
struct Row {
    name: &'static str,
    label: &'static str,
    clocked: bool,
    cost: Result<Cost, String>,
    proof: Option<Proof>,
}

/// What is proved of a loop's words.
struct Proof {
    /// Width of the counts that its tables hold.
    depth_width: u32,
    /// Greatest error of the tip, over its own tables.
    position_um: f64,
    /// The same over tables of 13 bits, the published ones.
    position_13_um: f64,
    /// Greatest error of a torque, of the joint's full scale.
    torque_percent: f64,
    /// How far the words of the lengths are off.
    length_um: f64,
}

impl Proof {
    fn of(name: &str, label: &str) -> Option<Self> {
        let named = name.ends_with("_loop").then(loop_variants)?;
        let config = named.into_iter().find(|(of, _)| *of == label)?.1;
        let full = PhantomConfig { depth_width: 13, ..config };
        let worst = |config: &PhantomConfig, unit: &str, scale: &dyn Fn(&str) -> f64| {
            let rows = bounds(config, STIFFNESS_MAX_N_PER_M).ok()?;
            let own = rows.iter().filter(|row| row.unit == unit && row.name != "radius");
            Some(own.map(|row| scale(row.name) * row.error).fold(0.0, f64::max))
        };
        let scales_nm = full_scales_nm(&config);
        let share = |name: &str| {
            let joint = name.trim_start_matches("torque").parse::<usize>().map_or(0, |joint| joint - 1);
            100.0 / scales_nm[joint]
        };
        let nominal_m = [0.14, 0.14];
        let one = f64::from(1u32 << config.formats.length_frac);
        let off =
            config.lengths.iter().zip(nominal_m).map(|(word, length_m)| (f64::from(*word) / one - length_m).abs());
        Some(Self {
            depth_width: config.depth_width,
            position_um: worst(&config, "m", &|_| 1e6)?,
            position_13_um: worst(&full, "m", &|_| 1e6)?,
            torque_percent: worst(&full, "N.m", &share)?,
            length_um: 1e6 * off.fold(0.0, f64::max),
        })
    }
}

/// `hpu reproduce phantom-cost`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let plan: Vec<_> = PLAN
        .into_iter()
        .filter(|(name, _)| args.blocks.is_empty() || args.blocks.iter().any(|of| of == name))
        .collect();
    let blocks = plan.iter().map(|(name, label)| find(name, label)).collect::<Result<Vec<_>, _>>()?;
    let versions = tool_versions().map_err(refused)?;
    let sources = plan.iter().map(|(name, _)| vhdl(name, &args.hdl).map_err(refused)).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<String> = plan.iter().map(|(name, label)| format!("{name} {label}")).collect();
    let parts = versions.iter().chain(&sources).chain(&rows).map(String::as_bytes);
    let header = format!("study {} of hpu reproduce phantom-cost", units::fingerprint(parts));
    let journal = args.out.as_deref().map(|dir| Journal::open(dir, &header, plan.len())).transpose()?;
    let (mut journal, done) = journal.map_or_else(Default::default, |(journal, read)| (Some(journal), read.rows));

    let control = interrupt::heed();
    let left = (plan.len() - done.len()) as u64;
    // One at a time: a synthesis takes a core and up to a gigabyte.
    let rows = with_progress(left, "syntheses", control, || {
        let unit = |index: usize, _: &_| {
            let (name, label) = plan[index];
            // Blocks are of the thread that made them.
            let block = find(name, label).ok()?;
            let made = cost(&*block, &args.hdl);
            (!interrupt::pressed()).then(|| made.map(|cost| line(&cost)).map_err(|error| error.to_string()))
        };
        units::run(plan.len(), NonZeroUsize::MIN, done, control, unit, |index, row| {
            journal.as_mut().map_or(Ok(()), |journal| journal.add(index, row))
        })
    })?;
    let Some(rows) = rows else {
        return Ok(Exit::Interrupted);
    };
    let read = |row: Result<String, String>| {
        row.and_then(|text| read(&text).ok_or_else(|| format!("`{text}` in the journal is no cost")))
    };
    let rows: Vec<Row> = plan
        .iter()
        .zip(&blocks)
        .zip(rows)
        .map(|(((name, label), block), cost)| Row {
            name,
            label,
            clocked: block.clocked(),
            cost: read(cost),
            proof: Proof::of(name, label),
        })
        .collect();
    give(args, folder, &versions, &rows)
}

fn give(args: &Args, folder: Option<Folder>, versions: &[String], rows: &[Row]) -> Result<Exit, Failure> {
    let (text, mut places) = (text(versions, rows), Vec::new());
    if let Some(mut folder) = folder {
        folder.write("phantom-cost.csv", csv(versions, rows))?;
        folder.write("phantom-cost.txt", &text)?;
        places = folder.places().map(PathBuf::from).collect();
        folder.commit()?;
    }
    if args.json {
        let rows: Vec<_> = rows.iter().map(object).collect();
        let object = json!({
            "study": "phantom-cost", "complete": true, "tools": versions, "blocks": rows, "files": places,
        });
        print_json(&object)?;
    } else {
        let files: String = places.iter().map(|place| format!("file       {}\n", place.display())).collect();
        print(&format!("{text}{files}"))?;
    }
    Ok(Exit::when(rows.iter().all(|row| row.cost.is_ok())))
}

/// A cost as a line of the journal.
fn line(cost: &Cost) -> String {
    let counts = |Counts { lut4, ff, carry, bram, dsp }: Counts| format!("{lut4} {ff} {carry} {bram} {dsp}");
    let ecp5 = cost.ecp5.map_or(String::new(), counts);
    let fmax = cost.fmax_mhz.map_or(String::new(), |fmax_mhz| fmax_mhz.to_string());
    format!("{},{},{ecp5},{fmax}", counts(cost.ice40), cost.cells)
}

/// From its line.
fn read(line: &str) -> Option<Cost> {
    let [ice40, cells, ecp5, fmax] = line.split(',').collect::<Vec<_>>().try_into().ok()?;
    let counts = |text: &str| -> Option<Counts> {
        let numbers = text.split(' ').map(str::parse).collect::<Result<Vec<u64>, _>>().ok()?;
        let [lut4, ff, carry, bram, dsp] = numbers.try_into().ok()?;
        Some(Counts { lut4, ff, carry, bram, dsp })
    };
    let absent = |text: &str| text.is_empty();
    Some(Cost {
        ice40: counts(ice40)?,
        cells: cells.parse().ok()?,
        ecp5: if absent(ecp5) { None } else { Some(counts(ecp5)?) },
        fmax_mhz: if absent(fmax) { None } else { Some(fmax.parse().ok()?) },
    })
}

fn text(versions: &[String], rows: &[Row]) -> String {
    let mut text = format!(
        "PHANToM: what its blocks and loops cost\n$ hpu reproduce phantom-cost\n{}\n\n\
         Counts are of each block alone, for the iCE40 HX8K ({HX8K_CELLS} logic cells, {HX8K_BRAM} block RAMs of 4096 \
         bits, no multiplier)\nor, where that is too small, for the ECP5. MHz is the fastest clock, ns the longest path of \
         a combinational block; neither of what does not fit.\nLoops: the tables hold counts of `depth` bits; the proved \
         error of the tip in um over these tables, and over tables of 13 bits, the published ones, as is that of torques\n\
         in % of the joint's full scale, for the forces as words; `length` is how far the words of 140 mm are off, which \
         is no part of the errors.\n\n",
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
    text + &tables()
}

fn table_row(row: &Row) -> String {
    let Row { name, label, clocked, cost, proof } = row;
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

/// Which tables an HX8K holds.
fn tables() -> String {
    let mut text = format!(
        "\nTables of sine and cosine for three joints that the {HX8K_BRAM} block RAMs of an HX8K have bits for, {} of them:\n",
        HX8K_BRAM * 4096
    );
    let default = PhantomConfig::default();
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

fn csv(versions: &[String], rows: &[Row]) -> String {
    let mut text = format!("# {}\n{CSV_HEADER}", versions.join(", "));
    for Row { name, label, clocked, cost, proof } in rows {
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

fn object(row: &Row) -> Value {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_comes_back_from_its_line_whatever_is_absent() {
        let counts = |lut4| Counts { lut4, ff: 2, carry: 3, bram: 4, dsp: 5 };
        let small = Cost { ice40: counts(1), cells: 9, ecp5: None, fmax_mhz: Some(43.21) };
        for cost in [small, Cost { fmax_mhz: None, ..small }, Cost { ecp5: Some(counts(7)), fmax_mhz: None, ..small }] {
            assert_eq!(read(&line(&cost)), Some(cost));
        }
        for text in ["", "1 2 3 4 5,9,", "1 2 3 4,9,,", "1 2 3 4 5,9,6,", "1 2 3 4 5,9,,fast"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
