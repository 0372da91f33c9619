//! `hpu sweep`: a study's points in shards, on one machine or on a farm.
//!
//! `gather` merges the rows in the order of waves and points, in groups of fixed size. No wall time, host or shard is
//! in the result, so its bytes depend on the rows alone. The next wave is planned from the gathered rows: a map's
//! refinement is replayed on them, and a search is run again until a run is missing. `--from` of a verb is the verb
//! with these rows as those already done.
//!
//! A shard under way keeps its rows in a journal, because a row must be kept as soon as it is made and a Parquet file
//! cannot grow by a row. A finished shard is Parquet alone, sealed as a whole, and readable by other programs.

mod files;
mod gather;
mod local;
mod manifest;
mod plan;
mod shard;
mod status;
mod submit;
mod work;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use crate::answers::read_words;
use crate::map::Cells;
use crate::reproduce::drop::{self, Name, Trials};
use crate::shell::{Exit, Failure, Jobs};
use crate::study::Lines;
use crate::{map, study, widths};
use clap::{Command, Subcommand};

use files::gathered;
use gather::How;
use manifest::Planned;

/// Run the points of a study in shards, on one machine or on a farm
///
/// Points are the cells of a study's `map`, the runs of its search over `widths`, the trials of its drop test
/// (`phantom-table-2`, `phantom-ladder`), or its lines. A shard is a file of some points, and a function of the
/// manifest alone. A shard that died runs again, and a finished one is left as it is. The gathered file is the same to
/// the byte, whichever machines ran the shards and in whatever order. A map without `full`, a search and a drop test go
/// in waves: each is planned from the gathered one before.
///
/// On one machine: `hpu sweep run STUDY -o DIR`. On a farm: `plan`, then `submit`. At the end `hpu map`, `hpu widths`,
/// `hpu reproduce phantom-table-2` or `hpu study` shows the result with `--from DIR`.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    verb: Verb,
}

/// The form of the result that is printed.
#[derive(Clone, Copy, clap::Args)]
struct Json {
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::Args)]
struct AnyVersion {
    /// Go on under another build of hpu than the one that planned the sweep
    #[arg(long)]
    any_version: bool,
}

#[derive(Clone, Copy, clap::Args)]
struct Kept {
    /// Remove the files that are refused, so that their shards run again
    #[arg(long)]
    again: bool,
    /// Gather points too that were not run, because they took longer than the guard allows
    #[arg(long)]
    partial: bool,
    #[command(flatten)]
    version: AnyVersion,
}

impl Kept {
    fn how(self) -> How {
        How { again: self.again, partial: self.partial, any_version: self.version.any_version }
    }
}

#[derive(Subcommand)]
enum Verb {
    /// Write the manifest of a study, or of the next wave of a sweep
    Plan {
        /// A study's file, or the folder of a sweep whose last wave is gathered
        study: String,
        /// The section of the study, as map, map-2, widths, phantom-table-2 or lines [default: the only one that can
        /// be split]
        #[arg(long, value_name = "NAME")]
        section: Option<String>,
        /// Folder of the sweep
        #[arg(short, long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        size: plan::Size,
        #[command(flatten)]
        json: Json,
    },
    /// Run one shard, unless its file is finished
    #[command(hide = true)]
    Shard {
        /// Folder of the sweep
        dir: PathBuf,
        /// Number of the shard, from 0
        #[arg(long, value_name = "N")]
        index: u64,
        /// Wave of the shard [default: the last one]
        #[arg(long, value_name = "K")]
        wave: Option<usize>,
        #[command(flatten)]
        version: AnyVersion,
        /// Run this point alone, and print its row
        #[arg(long, value_name = "POINT", hide = true)]
        point: Option<u64>,
        #[command(flatten)]
        json: Json,
    },
    /// Show how many shards are done
    Status {
        /// Folder of the sweep
        dir: PathBuf,
        #[command(flatten)]
        json: Json,
    },
    /// Check the files of all shards, and merge them into one
    Gather {
        /// Folder of the sweep
        dir: PathBuf,
        #[command(flatten)]
        kept: Kept,
        #[command(flatten)]
        json: Json,
    },
    /// Plan, run and gather all waves on this machine
    Run {
        /// A study's file, or the folder of a sweep
        study: String,
        /// The section of the study, as map, map-2, widths, phantom-table-2 or lines [default: the only one that can
        /// be split]
        #[arg(long, value_name = "NAME")]
        section: Option<String>,
        /// Folder of the sweep; the same command goes on there after an interruption
        #[arg(short, long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        size: plan::Size,
        #[command(flatten)]
        jobs: Jobs,
        #[command(flatten)]
        kept: Kept,
        #[command(flatten)]
        json: Json,
    },
    Submit(submit::Args),
    /// Run every K-th shard of a wave, each in a process of its own: a task of a scheduler
    #[command(hide = true)]
    Task {
        /// Folder of the sweep
        dir: PathBuf,
        /// Wave of the shards
        #[arg(long, value_name = "K")]
        wave: usize,
        /// Number of the task, from 0
        #[arg(long, value_name = "N")]
        index: u64,
        /// Number of tasks
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
        of: u64,
        /// Cores: shards that run at the same time [default: 1]
        #[arg(long, value_name = "N", default_value_t = NonZeroUsize::MIN, hide_default_value = true)]
        cores: NonZeroUsize,
        #[command(flatten)]
        version: AnyVersion,
    },
}

/// Runs `hpu sweep`. `command` describes the whole command, by which a study's section is read.
pub fn run(args: &Args, command: &Command) -> Result<Exit, Failure> {
    match &args.verb {
        Verb::Plan { study, section, out, size, json } => {
            let asked = plan::Asked { study, section: section.as_deref(), out: out.as_deref(), size: *size };
            plan::run(&asked, command, json.json)
        }
        Verb::Shard { dir, wave, point: Some(point), .. } => shard::point(dir, *wave, *point),
        Verb::Shard { dir, index, wave, version, point: None, json } => {
            shard::run(dir, *index, *wave, version.any_version, json.json)
        }
        Verb::Status { dir, json } => status::run(dir, json.json),
        Verb::Gather { dir, kept, json } => gather::run(dir, kept.how(), json.json),
        Verb::Run { study, section, out, size, jobs, kept, json } => {
            let asked = plan::Asked { study, section: section.as_deref(), out: out.as_deref(), size: *size };
            local::run(&asked, command, jobs.get(), kept.how(), json.json)
        }
        Verb::Submit(args) => submit::run(args),
        Verb::Task { dir, wave, index, of, cores, version } => {
            submit::task(dir, *wave, (*index, *of), *cores, version.any_version)
        }
    }
}

/// Runs `hpu map --from`: shows the map that a sweep has gathered.
pub(crate) fn show_map(args: &map::Args, dir: &Path) -> Result<Exit, Failure> {
    let planned = of_verb(dir, "map")?;
    let manifest = &planned.manifest;
    let cells = Cells::new(read_words("map", &manifest.words)?, manifest.find())?;
    let rows = gathered(&planned, &cells, true)?;
    map::gathered(args, cells, rows)
}

/// Runs `hpu widths --from`: shows the search that a sweep has gathered.
pub(crate) fn show_search(args: &widths::Args, dir: &Path) -> Result<Exit, Failure> {
    let planned = of_verb(dir, "widths")?;
    let manifest = &planned.manifest;
    let rows = gathered(&planned, &*manifest.work()?, true)?;
    let own = read_words("widths", &manifest.words)?;
    widths::gathered(args, own, rows, manifest.find())
}

/// Runs `hpu study --from`: shows the lines that a sweep has gathered.
pub(crate) fn show_lines(args: &study::Args, dir: &Path) -> Result<Exit, Failure> {
    let planned = of_verb(dir, "study")?;
    let (name, text) = &planned.manifest.study;
    let lines = Lines::new(name, text, planned.manifest.find())?;
    let rows = gathered(&planned, &lines, true)?;
    lines.show(args, rows)
}

/// Runs `hpu reproduce` for a drop test with `--from`: shows the trials that a sweep has gathered.
pub(crate) fn show_drops(name: Name, args: &drop::Args, dir: &Path) -> Result<Exit, Failure> {
    let planned = of_verb(dir, name.text())?;
    let trials = Trials::new(name, &planned.manifest.words, &planned.manifest.find())?;
    let rows = gathered(&planned, &trials, true)?;
    drop::gathered(trials, args, rows)
}

fn of_verb(dir: &Path, verb: &str) -> Result<Planned, Failure> {
    let planned = Planned::last(dir)?;
    let own = &planned.manifest.verb;
    if own == verb {
        return Ok(planned);
    }
    let own = study::verb(own).join(" ");
    Err(Failure::usage(format!("{} is a sweep of hpu {own}; hpu {own} --from shows it", dir.display())))
}
