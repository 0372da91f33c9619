//! `hpu reproduce phantom-cost`: the cost of the PHANToM's blocks and loops in an FPGA, and the cost of a bit.

mod claims;
mod row;
mod text;

use std::path::PathBuf;

use hpu_datapath::phantom::{Config, loop_variants};
use hpu_farm::{Failed, UnitResult, units};
use hpu_papers::phantom::COST;
use hpu_prove::arms::bounds;
use hpu_rtl::{Cost, cost, tool_versions, vhdl};
use serde_json::json;

use crate::beside::claim;
use crate::block::find;
use crate::journal;
use crate::page::give;
use crate::shell::values::value;
use crate::shell::{Exit, Failure, Folder, Jobs, hdl, interrupt, with_progress};
use claims::sums;
use row::{CostRow, Proof};
use text::{csv, object, text};

/// Blocks and loops, each with the label of its configuration: the cheap ones first, full tables last.
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

/// The syntheses to run.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// These blocks alone, as in phantom_forward,phantom_loop
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = planned)]
    blocks: Vec<String>,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    /// Write phantom-cost.csv and phantom-cost.txt into this folder, and go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

fn planned(name: &str) -> Result<String, Failure> {
    let mut names: Vec<_> = PLAN.iter().map(|(name, _)| *name).collect();
    names.dedup();
    value(names.contains(&name).then(|| name.to_string()), &format!("it is none of {}", names.join(", ")))
}

/// Runs `hpu reproduce phantom-cost`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let plan: Vec<_> = PLAN
        .into_iter()
        .filter(|(name, _)| args.blocks.is_empty() || args.blocks.iter().any(|of| of == name))
        .collect();
    let blocks = plan.iter().map(|(name, label)| find(name, label)).collect::<Result<Vec<_>, _>>()?;
    let setup = args.hdl.setup();
    let versions = tool_versions(setup.timeout)?;
    let sources = plan.iter().map(|(name, _)| vhdl(name, &setup.hdl)).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<String> = plan.iter().map(|(name, label)| format!("{name} {label}")).collect();
    let parts = versions.iter().chain(&sources).chain(&rows).map(String::as_bytes);
    let (mut journal, done) =
        journal::resume(args.out.as_deref(), plan.len(), ("study", &format!("hpu reproduce {COST}")), parts)?;

    let control = interrupt::heed();
    let left = (plan.len() - done.len()) as u64;
    let rows = with_progress(left, "syntheses", control, || {
        let unit = |index: usize, _: &_| {
            let (name, label) = plan[index];
            // A block belongs to the thread that made it.
            let block = find(name, label).ok()?;
            let made = cost(&*block, &setup);
            (!interrupt::pressed()).then(|| made.map(|cost| cost.line()).map_err(Failed::new))
        };
        units::run(plan.len(), args.jobs.get(), done, control, unit, |index, row| journal.add(index, row))
    })?;
    let Some(rows) = rows else {
        return Ok(Exit::Interrupted);
    };
    let read = |row: UnitResult<String>| {
        let text = row.map_err(|failed| failed.to_string())?;
        Cost::from_line(&text).ok_or_else(|| format!("`{text}` in the journal is no cost"))
    };
    let rows: Vec<CostRow> = plan
        .iter()
        .zip(&blocks)
        .zip(rows)
        .map(|(((name, label), block), cost)| CostRow {
            name,
            label,
            clocked: block.clocked(),
            cost: read(cost),
            proof: Proof::of(name, label),
        })
        .collect();
    give_rows(args, folder, &versions, &rows)
}

fn give_rows(args: &Args, folder: Option<Folder>, versions: &[String], rows: &[CostRow]) -> Result<Exit, Failure> {
    let text = text(versions, rows);
    let claims: Vec<_> = sums(rows).iter().map(claim).collect();
    let blocks: Vec<_> = rows.iter().map(object).collect();
    let object = json!({ "study": COST, "complete": true, "tools": versions, "blocks": blocks, "claims": claims });
    give((&text, object), folder, args.json, || {
        let files = [("csv", csv(versions, rows)), ("txt", text.clone())];
        Ok((files.map(|(ending, content)| (format!("{COST}.{ending}"), content)).into(), Vec::new()))
    })?;
    Ok(if rows.iter().all(|row| row.cost.is_ok()) { Exit::Fine } else { Exit::BadFile })
}
