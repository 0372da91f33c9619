//! `hpu reproduce phantom-cost`: the cost of the PHANToM's blocks and loops in an FPGA, and the cost of a bit.

mod claims;
mod row;
mod text;

use std::path::PathBuf;

use claims::sums;
use hpu_datapath::phantom::{Config, loop_variants};
use hpu_papers::phantom::COST;
use hpu_prove::arms::bounds;
use row::{CostRow, Proof};
use serde_json::json;
use text::{table, text};

use crate::beside::claim;
use crate::cost::{Priced, measured};
use crate::page::give;
use crate::shell::cache::Remember;
use crate::shell::values::value;
use crate::shell::{Exit, Failure, Folder, Jobs, hdl, interrupt, with_progress};

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
    remember: Remember,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    /// Write phantom-cost.csv and phantom-cost.txt into this folder
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
    let is_asked = |(name, _): &(&str, &str)| args.blocks.is_empty() || args.blocks.iter().any(|of| of == name);
    let plan: Vec<_> = PLAN.into_iter().filter(is_asked).collect();
    let setup = args.hdl.setup();
    let cache = args.remember.open(setup.timeout)?;
    let mut rows = Vec::new();
    let take = |priced: Priced| {
        rows.push(CostRow { proof: Proof::of(&priced.name, &priced.label), priced });
        Ok(())
    };
    let done = with_progress(plan.len() as u64, "syntheses", interrupt::heed(), || {
        measured(&plan, &args.jobs, &cache, &setup, take)
    })?;
    if done { give_rows(args, folder, cache.tools(), &rows) } else { Ok(Exit::Interrupted) }
}

fn give_rows(args: &Args, folder: Option<Folder>, versions: &[String], rows: &[CostRow]) -> Result<Exit, Failure> {
    let text = text(versions, rows);
    let claims: Vec<_> = sums(rows).iter().map(claim).collect();
    let blocks = table(rows).json();
    let object = json!({ "study": COST, "complete": true, "tools": versions, "blocks": blocks, "claims": claims });
    give((&text, object), folder, args.json, || {
        let files = [("csv", table(rows).csv(&[versions.join(", ")])), ("txt", text.clone())];
        Ok((files.map(|(ending, content)| (format!("{COST}.{ending}"), content)).into(), Vec::new()))
    })?;
    Ok(if rows.iter().all(|row| row.priced.cost.is_ok()) { Exit::Fine } else { Exit::BadFile })
}
