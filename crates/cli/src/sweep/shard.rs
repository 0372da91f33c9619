//! One shard: a function of its manifest and its number.
//!
//! Rows go to a journal as they are made, so that a process that dies loses one point at most. The next process finds
//! the journal, and suspects the first point without a row. It runs this point in a process of its own. When three such
//! processes have died one after the other, the point is *poison*: its row is the reason, and the shard goes on. A
//! single kill from outside therefore makes no point poison.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use hpu_farm::UnitResult;
use hpu_farm::{Failed, FileRow, GROUP_ROWS, PointResult, Row, append, seal};
use hpu_page::{Page, Parquet};
use hpu_rtl::dut::is_forbidden;
use hpu_rtl::temporary::{Temporary, sweep_files};
use hpu_rtl::{Fault, output, system};

use super::files::{before, check, metadata, said};
use super::manifest::{Planned, put};
use crate::journal;
use crate::page::show;
use crate::shell::files::not_a_link;
use crate::shell::{Exit, Failure, interrupt, print_file, program};
use crate::work::{Rows, Work};

/// How often a point may end the process that runs it alone.
const DEATHS: u32 = 3;

/// How often a process may end with the point's own process, as where a scheduler kills both because of their memory.
const SHARED_DEATHS: u32 = 5;

/// Runs a shard, unless its file is finished.
pub fn run(dir: &Path, index: u64, wave: Option<usize>, any_version: bool, json: bool) -> Result<Exit, Failure> {
    let planned = planned(dir, wave)?;
    let program = planned.accepts(any_version)?;
    let shards = planned.manifest.shards();
    if index >= shards {
        return Err(Failure::usage(format!("the sweep has {shards} shards, from 0 to {}", shards.saturating_sub(1))));
    }
    let mut page = Page::default();
    let made = finish(&planned, index, &program)?;
    let Some(Made { points, fresh }) = made else { return Ok(Exit::Interrupted) };
    let how = if fresh { "done" } else { "was done before" };
    page.fact("shard", "shard", index, format!("{index} {how}"));
    page.fact("points", "points", points, points.to_string());
    page.data("fresh", fresh);
    show(&page, json)?;
    Ok(Exit::Fine)
}

/// Reads the manifest of a wave, or of the last one.
pub fn planned(dir: &Path, wave: Option<usize>) -> Result<Planned, Failure> {
    match wave {
        None => Planned::last(dir),
        Some(wave) => {
            Planned::read(dir, wave)?.ok_or_else(|| Failure::usage(format!("{} has no wave {wave}", dir.display())))
        }
    }
}

/// A finished shard.
struct Made {
    points: usize,
    /// Whether it was finished now.
    fresh: bool,
}

/// Makes the file of a shard; `None` when interrupted.
fn finish(planned: &Planned, index: u64, program: &str) -> Result<Option<Made>, Failure> {
    let points: Vec<usize> = planned.manifest.shard(index).into_iter().map(|point| point as usize).collect();
    let work = planned.manifest.work()?;
    let schema = work.schema();
    let done = Made { points: points.len(), fresh: false };
    if check(planned, index, schema.columns(), Some(program)).is_ok() {
        clean(planned, index);
        return Ok(Some(done));
    }
    let folder = planned.shards();
    not_a_link(&folder)?;
    for ending in ["journal", "alone"] {
        not_a_link(&planned.shard(index, ending))?;
    }
    fs::create_dir_all(&folder).map_err(|error| Failure::at(&folder, error))?;
    let kept = planned.shard(index, "journal");
    // Another process may be at the same shard, as one that a scheduler has given up. This process waits for it.
    let gate = File::options().create(true).append(true).open(&kept).map_err(|error| Failure::at(&kept, error))?;
    // A file system without locks cannot be waited for.
    let _ = gate.lock();
    drop(gate);
    if check(planned, index, schema.columns(), Some(program)).is_ok() {
        clean(planned, index);
        return Ok(Some(done));
    }
    let died = fs::metadata(&kept).is_ok_and(|found| found.len() > 0);
    if died {
        // It may have left a part of a file.
        sweep_files(&folder);
    }
    let header = format!("sweep {} wave {} by {program}", planned.manifest.settings(), planned.manifest.wave);
    let (mut journal, mut rows) = journal::at(&kept, &header, usize::MAX)?;
    let control = interrupt::heed();
    let mut left = points.iter().copied().filter(|point| !rows.contains_key(point)).collect::<Vec<_>>();
    let mut late = Vec::new();
    if died && let Some(&suspect) = left.first() {
        match alone(planned, index, suspect)? {
            Alone::Row(row) => {
                journal.add(suspect, &row)?;
                rows.insert(suspect, row);
                left.remove(0);
            }
            Alone::Late => {
                late.push(suspect);
                left.remove(0);
            }
            Alone::Stopped => return Ok(None),
        }
    }
    work.run(before(planned, &*work)?, &left, control, &mut |point, row| {
        journal.add(point, &row)?;
        rows.insert(point, row);
        Ok(())
    })?;
    if interrupt::pressed() {
        return Ok(None);
    }
    write(planned, index, program, &*work, &points, &mut rows)?;
    clean(planned, index);
    Ok(Some(Made { fresh: true, ..done }))
}

/// Removes the files of a shard under way.
fn clean(planned: &Planned, index: u64) {
    for ending in ["journal", "alone"] {
        // It may be gone already.
        let _ = fs::remove_file(planned.shard(index, ending));
    }
}

/// Writes a shard's file beside its place, waits until it is on the disk, and renames it.
fn write(
    planned: &Planned,
    index: u64,
    program: &str,
    work: &dyn Work,
    points: &[usize],
    rows: &mut Rows,
) -> Result<(), Failure> {
    let place = planned.shard(index, "parquet");
    let at = |error: &dyn std::fmt::Display| Failure::at(&place, error);
    let temporary = Temporary::file(&planned.shards(), &format!("{index:06}")).map_err(|error| at(&error))?;
    let mut file = temporary.open().map_err(|error| at(&error))?;
    let manifest = &planned.manifest;
    let own = [
        ("hpu.settings", manifest.settings()),
        ("hpu.manifest", planned.sum.clone()),
        ("hpu.program", program.to_string()),
        ("hpu.version", env!("HPU_VERSION").to_string()),
        ("hpu.wave", manifest.wave.to_string()),
        ("hpu.shard", index.to_string()),
    ];
    let schema = work.schema();
    let copy = file.try_clone().map_err(|error| at(&error))?;
    let metadata = metadata(&manifest.command, own.into(), work);
    let table = Parquet::compressed(copy, "sweep", schema.columns(), metadata, GROUP_ROWS);
    let mut table = table.map_err(|error| at(&error))?;
    let told = points.iter().map(|point| -> FileRow { (*point as u64, rows.remove(point)) });
    append(&mut table, &schema, told, |point| work.place(point as usize)).map_err(|error| at(&error))?;
    table.finish().map_err(|error| at(&error))?;
    seal(&mut file).map_err(|damage| at(&said(&damage)))?;
    file.sync_all().map_err(|error| at(&error))?;
    put(temporary, &place)
}

/// The end of a point in a process of its own.
enum Alone {
    Row(UnitResult),
    Late,
    Stopped,
}

/// Runs a suspected point in a process of its own.
fn alone(planned: &Planned, index: u64, point: usize) -> Result<Alone, Failure> {
    let note = planned.shard(index, "alone");
    // The processes that died together with one of this point, and this one, which may.
    let starts = fs::read_to_string(&note).ok().and_then(|text| {
        let (of, starts) = text.trim().split_once(' ')?;
        (of.parse() == Ok(point)).then(|| starts.parse::<u32>().ok())?
    });
    let starts = starts.unwrap_or(0);
    if starts >= SHARED_DEATHS {
        return Ok(Alone::Row(Err(Failed::new(format_args!("poison: ended the shard's process {starts} times")))));
    }
    fs::write(&note, format!("{point} {}\n", starts + 1)).map_err(|error| Failure::at(&note, error))?;
    let mut ended = None;
    for _ in 0..DEATHS {
        let (status, said) = child(planned, index, point)?;
        if interrupt::pressed() {
            return Ok(Alone::Stopped);
        }
        match serde_json::from_str::<PointResult>(&said).ok().filter(|_| status.success()) {
            Some(row) => return Ok(row.map_or(Alone::Late, Alone::Row)),
            None => ended = Some(status),
        }
    }
    let how = ended.map_or_else(String::new, told);
    Ok(Alone::Row(Err(Failed::new(format!("poison: its process ended {DEATHS} times, {how}")))))
}

/// Returns how a process ended.
pub fn told(status: ExitStatus) -> String {
    match (system::killed_by(status), status.code()) {
        (Some(signal), _) => format!("by signal {signal}"),
        (None, code) => format!("with exit code {}", code.unwrap_or_default()),
    }
}

fn child(planned: &Planned, index: u64, point: usize) -> Result<(ExitStatus, String), Failure> {
    let mut command = own_shard(planned, index)?;
    command.args(["--any-version", "--point", &point.to_string()]);
    let (said, ended) = output(&AtomicBool::new(false), command, Stdio::null(), Duration::MAX);
    match ended {
        // It refuses for a reason that is none of the point's, as where designs must not be simulated.
        Ok(status) if status.code() == Some(Exit::Usage as i32) => {
            Err(Failure::usage(said.err.trim().trim_start_matches("error: ")))
        }
        Ok(status) => Ok((status, said.out)),
        // The command is interrupted, which the caller finds.
        Err(Fault::Stopped) => Ok((ExitStatus::default(), String::new())),
        Err(fault) => Err(not_started(fault)),
    }
}

/// Returns the command by which this program runs a shard in a process of its own.
pub(crate) fn own_shard(planned: &Planned, index: u64) -> Result<Command, Failure> {
    let (index, wave) = (index.to_string(), planned.manifest.wave.to_string());
    let mut command = Command::new(program::starter()?);
    command.arg("--quiet").args(is_forbidden().then_some("--no-dut")).args(["sweep", "shard"]);
    let dir = fs::canonicalize(&planned.dir).map_err(|error| Failure::at(&planned.dir, error))?;
    command.arg(dir).args(["--index", &index, "--wave", &wave]);
    Ok(command)
}

/// Returns the failure to start this program again.
pub fn not_started(fault: Fault) -> Failure {
    match fault {
        Fault::Stopped => Failure::interrupted(),
        fault => Failure::file(format!("this program cannot start itself: {fault:?}")),
    }
}

/// Runs one point, and prints its row.
pub fn point(dir: &Path, wave: Option<usize>, point: u64) -> Result<Exit, Failure> {
    let planned = planned(dir, wave)?;
    let work = planned.manifest.work()?;
    if let Some(count) = work.count().filter(|count| point >= *count) {
        return Err(Failure::usage(format!("the sweep has {count} points, from 0 to {}", count.saturating_sub(1))));
    }
    let mut found = None;
    work.run(before(&planned, &*work)?, &[point as usize], interrupt::heed(), &mut |_, row| {
        found = Some(row);
        Ok(())
    })?;
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }
    print_file(&format!("{}\n", Row::of(&found)))?;
    Ok(Exit::Fine)
}

/// Returns the place of a shard's journal, whose growth tells that the shard goes on.
pub(crate) fn journal_of(planned: &Planned, index: u64) -> PathBuf {
    planned.shard(index, "journal")
}
