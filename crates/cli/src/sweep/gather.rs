//! Gathering: the files of all shards as one, in the order of waves and points.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use hpu_farm::{GROUP_ROWS, Schema, seal};
use hpu_page::{Page, Parquet};
use hpu_rtl::temporary::{Temporary, sweep_files};

use super::files::{GATHERED, Unusable, check, metadata, said};
use super::manifest::{Planned, put};
use crate::page::show;
use crate::shell::{Exit, Failure, interrupt};
use crate::work::Work;

/// The name of the gathered rows as CSV, where they are few.
const CSV: &str = "gathered.csv";

/// The most rows that are also written as CSV.
const CSV_ROWS: u64 = 100_000;

/// The most files that a message names.
const NAMED: usize = 20;

/// The settings of a gathering.
#[derive(Clone, Copy)]
pub struct How {
    /// Whether refused files are removed, so that their shards run again.
    pub again: bool,
    /// Whether points that were not run stay so in the result.
    pub partial: bool,
    /// Whether files of any build of the program are taken.
    pub any_version: bool,
}

/// A gathered sweep.
pub(crate) struct Gathered {
    /// Rows, and how many of them failed and were not run.
    pub rows: u64,
    failed: usize,
    not_run: usize,
    sum: String,
    files: Vec<PathBuf>,
}

/// Runs `hpu sweep gather`.
pub fn run(dir: &Path, how: How, json: bool) -> Result<Exit, Failure> {
    let found = gather(dir, how)?;
    let mut page = Page::default();
    page.fact("rows", "rows", found.rows, found.rows.to_string());
    page.fact("failed", "failed", found.failed, format!("{}, each a row with its reason", found.failed));
    if found.not_run > 0 {
        page.fact("not_run", "not run", found.not_run, format!("{}, by the guard of wall time", found.not_run));
    }
    page.fact("sha256", "SHA-256", found.sum.as_str(), &found.sum);
    crate::page::files(&mut page, &found.files);
    show(&page, json)?;
    Ok(Exit::Fine)
}

/// Gathers all waves. Refuses, by their names, files that are not those of their shards.
pub fn gather(dir: &Path, how: How) -> Result<Gathered, Failure> {
    let waves = Planned::waves(dir)?;
    sweep_files(dir);
    let work = waves[0].manifest.work()?;
    let mut wrong = Wrong::default();
    waves.iter().for_each(|wave| wrong.strangers(wave));
    let temporary = Temporary::file(dir, "gathered").map_err(|error| Failure::at(dir, error))?;
    let at = |error: &dyn std::fmt::Display| Failure::at(temporary.path(), error);
    let mut file = temporary.open().map_err(|error| at(&error))?;
    let copy = BufWriter::new(file.try_clone().map_err(|error| at(&error))?);
    let total: u64 = waves.iter().map(|wave| wave.manifest.points.count()).sum();
    let schema = work.schema();
    let own = metadata(&waves[0].manifest.command, of_waves(&waves), &*work);
    let table = Parquet::compressed(copy, "sweep", schema.columns(), own, GROUP_ROWS);
    let mut merging = Merging {
        table: table.map_err(|error| at(&error))?,
        csv: if total <= CSV_ROWS { Some(begin_csv(dir, &schema, &*work)?) } else { None },
        schema,
        how,
        ends: [0, 0],
    };
    for wave in &waves {
        for index in 0..wave.manifest.shards() {
            interrupt::check()?;
            if let Err(unusable) = merging.shard(wave, index) {
                wrong.add(wave, index, unusable);
            }
        }
    }
    wrong.told(dir, how.again)?;
    let Merging { table, csv, ends: [failed, not_run], .. } = merging;
    table.finish().map_err(|error| at(&error))?;
    let sum = seal(&mut file).map_err(|damage| at(&said(&damage)))?;
    file.sync_all().map_err(|error| at(&error))?;
    let mut files = vec![dir.join(GATHERED)];
    if let Some((temporary, mut out)) = csv {
        let place = dir.join(CSV);
        let file = out.flush().and_then(|()| out.get_ref().sync_all());
        file.map_err(|error| Failure::at(&place, error))?;
        put(temporary, &place)?;
        files.push(place);
    }
    // The file that completes the result comes last.
    put(temporary, &files[0])?;
    Ok(Gathered { rows: total, failed, not_run, sum, files })
}

/// Returns what the gathered file tells of its sweep.
fn of_waves(waves: &[Planned]) -> Vec<(&'static str, String)> {
    let first = &waves[0].manifest;
    // The number of rows of each wave is that of its points, so it can stand before the rows.
    let counts: Vec<String> = waves.iter().map(|wave| wave.manifest.points.count().to_string()).collect();
    vec![
        ("hpu.settings", first.settings()),
        ("hpu.program", first.program.clone()),
        ("hpu.version", first.version.clone()),
        ("hpu.rows", counts.join(",")),
        ("hpu.study", first.study.1.clone()),
    ]
}

/// The files to which the rows of all shards go.
struct Merging {
    table: Parquet<BufWriter<File>>,
    csv: Option<(Temporary, BufWriter<File>)>,
    schema: Schema,
    how: How,
    /// How many rows failed, and how many were not run.
    ends: [usize; 2],
}

impl Merging {
    /// Adds the rows of a shard, unless its file cannot be used.
    fn shard(&mut self, wave: &Planned, index: u64) -> Result<(), Unusable> {
        let refused = |error: &dyn std::fmt::Display| Unusable::Refused(format!("damaged: {error}"));
        let program = (!self.how.any_version).then_some(wave.manifest.program.as_str());
        let file = check(wave, index, self.schema.columns(), program)?;
        let points = wave.manifest.shard(index);
        let (mut from, mut counted) = (0, [0, 0]);
        for group in 0..file.groups() {
            let rows = file.group(group).map_err(|error| refused(&error))?;
            let (own, ends) = self.schema.points(&rows);
            if points.get(from..from + own.len()) != Some(&own[..]) {
                return Err(refused(&"its points are not those of its shard"));
            }
            from += own.len();
            counted = [counted[0] + ends[0], counted[1] + ends[1]];
            if let Some((_, out)) = &mut self.csv {
                self.schema.csv(out, &rows).map_err(|error| refused(&error))?;
            }
            self.table.extend(rows).map_err(|error| refused(&error))?;
        }
        if from != points.len() {
            return Err(refused(&"it has not all points of its shard"));
        }
        if counted[1] > 0 && !self.how.partial {
            let late = counted[1];
            return Err(Unusable::Refused(format!("not run: {late} points took longer than the guard allows")));
        }
        self.ends = [self.ends[0] + counted[0], self.ends[1] + counted[1]];
        Ok(())
    }
}

fn begin_csv(dir: &Path, schema: &Schema, work: &dyn Work) -> Result<(Temporary, BufWriter<File>), Failure> {
    let at = |error| Failure::at(dir, error);
    let temporary = Temporary::file(dir, "csv").map_err(at)?;
    let mut out = BufWriter::new(temporary.open().map_err(at)?);
    let meanings = work.meanings().into_iter().map(|(key, value)| format!("{key}: {value}"));
    let comments: String =
        [work.command()].into_iter().chain(meanings).map(|comment| format!("# {comment}\n")).collect();
    out.write_all((comments + &schema.csv_head()).as_bytes()).map_err(at)?;
    Ok((temporary, out))
}

/// The files that are missing, and those that are refused with their reasons.
#[derive(Default)]
struct Wrong {
    missing: Vec<PathBuf>,
    refused: Vec<(PathBuf, String)>,
}

impl Wrong {
    /// Adds the files in a wave's folder that no shard has.
    fn strangers(&mut self, wave: &Planned) {
        let mut names: Vec<PathBuf> =
            fs::read_dir(wave.shards()).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        names.sort();
        for path in names {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let (stem, ending) = name.split_once('.').unwrap_or((&name, ""));
            let shard = stem
                .parse()
                .ok()
                .filter(|index: &u64| *index < wave.manifest.shards() && format!("{index:06}") == stem);
            // Names that begin with a dot are those of files that are being written.
            if !name.starts_with('.') && (shard.is_none() || !["parquet", "journal", "alone"].contains(&ending)) {
                self.refused.push((path, "foreign: no shard of this sweep has this name".into()));
            }
        }
    }

    fn add(&mut self, wave: &Planned, index: u64, unusable: Unusable) {
        let path = wave.shard(index, "parquet");
        match unusable {
            Unusable::Missing => self.missing.push(path),
            Unusable::Refused(why) => self.refused.push((path, why)),
        }
    }

    /// Ends the command if something is wrong; before, removes the refused files if asked to.
    fn told(&self, dir: &Path, again: bool) -> Result<(), Failure> {
        if self.missing.is_empty() && self.refused.is_empty() {
            return Ok(());
        }
        let named = |path: &Path| path.strip_prefix(dir).unwrap_or(path).display().to_string();
        let mut lines: Vec<String> =
            self.refused.iter().take(NAMED).map(|(path, why)| format!("{}: {why}", named(path))).collect();
        if self.refused.len() > NAMED {
            lines.push(format!("and {} files more that are refused", self.refused.len() - NAMED));
        }
        if !self.missing.is_empty() {
            let names: Vec<String> = self.missing.iter().take(NAMED).map(|path| named(path)).collect();
            let more = if self.missing.len() > NAMED { ", and so on" } else { "" };
            lines.push(format!("{} shards are not done: {}{more}", self.missing.len(), names.join(", ")));
        }
        if !self.refused.is_empty() && again {
            for (path, _) in &self.refused {
                fs::remove_file(path).map_err(|error| Failure::at(path, error))?;
            }
            lines
                .push(format!("removed {} files; hpu sweep run or submit runs their shards again", self.refused.len()));
        } else if !self.refused.is_empty() {
            lines.push("--again removes refused files, so that their shards run again".into());
        }
        let exit = if self.refused.is_empty() || again { Exit::Differs } else { Exit::BadFile };
        Err(Failure::new(exit, format!("{}: the sweep is not complete\n{}", dir.display(), lines.join("\n"))))
    }
}
