//! Planning: which points a wave has, and how many of them a shard gets.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Command;
use hpu_cosim::number;
use hpu_farm::Points;
use hpu_page::{Kind, Page};
use hpu_papers::studies::Section;

use super::files::gathered;
use super::manifest::{MOST_POINTS, Manifest, Planned};
use super::work::{self, LINES, SECTIONS, splittable};
use crate::page::show;
use crate::shell::{Exit, Failure, interrupt, program, values};
use crate::study;
use crate::work::{Rows, Work, on_disk};

/// Most points that are run to measure what a point costs, and the share of all points that they are at most.
const SAMPLE: u64 = 16;

/// Wall time after which no further point is measured.
const SAMPLE_TIME: Duration = Duration::from_secs(10);

/// The size of shards.
#[derive(Clone, Copy, Default, clap::Args)]
pub struct Size {
    /// Work of a shard, as measured on a few points [default: 60s; of `run` less where there is little work]
    #[arg(long, value_name = "TIME", value_parser = values::time)]
    shard_time: Option<Duration>,
    /// Points of a shard, instead of a measured number
    #[arg(
        long, value_name = "N", conflicts_with = "shard_time",
        value_parser = clap::value_parser!(u64).range(1..=MOST_POINTS)
    )]
    shard_points: Option<u64>,
}

impl Size {
    fn is_given(self) -> bool {
        self.shard_time.is_some() || self.shard_points.is_some()
    }

    /// Returns the number of points of a shard, and the measured seconds of a point. `workers` get some shards each, if
    /// their number is known.
    fn points(
        self,
        work: &dyn Work,
        done: &Rows,
        points: &Points,
        workers: Option<usize>,
    ) -> Result<(u64, Option<f64>), Failure> {
        if let Some(points) = self.shard_points {
            return Ok((points, None));
        }
        let count = points.count();
        let mut taken = 0;
        let start = Instant::now();
        // Points that are scattered by the golden ratio, the same ones each time.
        for at in 0..SAMPLE.min(count.div_ceil(SAMPLE)) {
            let place = (u128::from(at.wrapping_mul(0x9E37_79B9_7F4A_7C15)) * u128::from(count)) >> 64;
            let point = points.slice(place as u64, 1);
            let point: Vec<usize> = point.into_iter().map(|point| point as usize).collect();
            work.run(done.clone(), &point, interrupt::heed(), &mut |_, _| Ok(()))?;
            taken += 1;
            interrupt::check()?;
            if start.elapsed() > SAMPLE_TIME {
                break;
            }
        }
        let point_s = start.elapsed().as_secs_f64() / f64::from(taken.max(1));
        let mut time_s = self.shard_time.map_or(60.0, |time| time.as_secs_f64());
        if let (Some(workers), None) = (workers, self.shard_time) {
            // Eight shards a worker, so that the last ones leave no worker idle for long; not shorter than 4 s.
            time_s = time_s.min((point_s * count as f64 / (8 * workers) as f64).max(4.0));
        }
        let points = (time_s / point_s.max(1e-9)).ceil();
        Ok(((points as u64).clamp(1, MOST_POINTS), Some(point_s)))
    }
}

/// Runs `hpu sweep plan`: a study's first wave, or the next wave of a folder.
pub fn run(asked: &Asked, command: &Command, json: bool) -> Result<Exit, Failure> {
    let what = Path::new(asked.study);
    let planned = if what.is_dir() {
        asked.of_folder()?;
        let Some(planned) = next(what, asked.size, None)? else {
            let mut page = Page::default();
            page.fact("complete", "complete", true, "no wave is left");
            show(&page, json)?;
            return Ok(Exit::Fine);
        };
        planned
    } else {
        let out = asked.out.ok_or_else(|| Failure::usage("write -o DIR: the folder of the sweep"))?;
        first(asked, out, command, None)?
    };
    show(&page(&planned), json)?;
    Ok(Exit::Fine)
}

/// The study of a sweep, and how to plan it.
pub struct Asked<'a> {
    /// A study's file or name; of `plan` also the folder of a sweep.
    pub study: &'a str,
    /// The section whose points are run, if the study has several.
    pub section: Option<&'a str>,
    /// The folder.
    pub out: Option<&'a Path>,
    /// The size of shards.
    pub size: Size,
}

impl Asked<'_> {
    /// Refuses options that the folder of a sweep in the place of a study does not read.
    pub fn of_folder(&self) -> Result<(), Failure> {
        let given = [("--section", self.section.is_some()), ("--out", self.out.is_some())];
        match given.into_iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((option, _)) => Err(Failure::usage(format!(
                "{option}: {} is the folder of a sweep, which goes on there; a study's file reads it",
                self.study
            ))),
        }
    }
}

/// A wave, with the seconds that a point was measured to take.
pub(crate) type Costed = (Planned, Option<f64>);

/// Plans the first wave of a study, unless the folder has it.
pub fn first(asked: &Asked, dir: &Path, command: &Command, workers: Option<usize>) -> Result<Costed, Failure> {
    let (name, text) = study::text(Path::new(asked.study))?;
    let (verb, words) = words(&name, &text, asked.section, command)?;
    let work = work::work(&verb, &words, Arc::new(on_disk))?;
    let mut manifest = Manifest {
        wave: 1,
        version: env!("HPU_VERSION").to_string(),
        program: program::fingerprint()?,
        study: (name, text),
        verb,
        words,
        command: work.command(),
        scenes: work.scenes(),
        points: Points::default(),
        shard_points: 1,
        columns: columns(&*work),
    };
    if let Some(known) = Planned::read(dir, 1)? {
        if known.manifest.settings() != manifest.settings() {
            return Err(Failure::usage(format!(
                "{} holds another sweep: {}\nchoose another folder",
                dir.display(),
                known.manifest.command
            )));
        }
        return Ok((known, None));
    }
    manifest.points = work.next(Rows::new(), interrupt::heed())?;
    let (points, cost_s) = asked.size.points(&*work, &Rows::new(), &manifest.points, workers)?;
    manifest.shard_points = points;
    interrupt::check()?;
    Ok((manifest.write(dir)?, cost_s))
}

/// Plans the wave after the last one; `None` if the sweep is complete.
pub fn next(dir: &Path, size: Size, workers: Option<usize>) -> Result<Option<Costed>, Failure> {
    let last = Planned::last(dir)?;
    let work = last.manifest.work()?;
    if !work.is_adaptive() {
        return Ok(None);
    }
    let done = gathered(&last, &*work, true)?;
    let points = work.next(done.clone(), interrupt::heed())?;
    interrupt::check()?;
    // Points that were not run are left out of a gathered wave, and would be asked for again.
    let again = points.runs() == last.manifest.points.runs();
    if points.count() == 0 || again {
        return Ok(None);
    }
    let (shard_points, cost_s) = if size.is_given() {
        size.points(&*work, &done, &points, workers)?
    } else {
        // A point of this wave costs as much as one of the wave before. Each worker gets a shard.
        let share = workers.map_or(u64::MAX, |workers| points.count().div_ceil(workers as u64));
        (last.manifest.shard_points.min(share), None)
    };
    let manifest = Manifest { wave: last.manifest.wave + 1, points, shard_points, ..last.manifest };
    Ok(Some((manifest.write(dir)?, cost_s)))
}

fn columns(work: &dyn Work) -> Vec<[String; 3]> {
    let meanings = work.meanings();
    let schema = work.schema();
    let column = |column: &hpu_page::Column| {
        let key = column.file_key().to_string();
        let kind = match column.kind() {
            Kind::Text => "text",
            Kind::Integer => "integer",
            Kind::Number => "number",
            Kind::Flag => "flag",
        };
        let meaning =
            meanings.iter().find(|(own, _)| *own == key).map_or(String::new(), |(_, meaning)| meaning.clone());
        [key, kind.to_string(), meaning]
    };
    schema.columns().iter().map(column).collect()
}

/// Returns verb and words of the section of a study that a sweep can split.
fn words(name: &str, text: &str, asked: Option<&str>, command: &Command) -> Result<(String, Vec<String>), Failure> {
    let (study, _) = study::read(name, text, Arc::new(on_disk))?;
    let named = study.sections.iter().enumerate().map(|(index, section)| {
        let before = study.sections[..index].iter().filter(|other| other.verb == section.verb).count();
        let name = if before == 0 { section.verb.clone() } else { format!("{}-{}", section.verb, before + 1) };
        (name, section)
    });
    let mut all: Vec<(String, Option<&Section>)> = Vec::new();
    for (name, section) in named.filter(|(_, section)| SECTIONS.contains(&section.verb.as_str())) {
        all.push((name, Some(section)));
    }
    all.extend((!study.comparison.lines.is_empty()).then(|| (LINES.to_string(), None)));
    let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    let (_, section) = match (asked, &all[..]) {
        (Some(asked), _) => all.iter().find(|(name, _)| name == asked).ok_or_else(|| {
            Failure::usage(format!(
                "{name} has no section {asked} that a sweep can split; it has: {}",
                names.join(", ")
            ))
        })?,
        (None, [one]) => one,
        (None, []) => {
            return Err(Failure::file(format!("{name} has nothing that a sweep can split: {}", splittable())));
        }
        (None, _) => return Err(Failure::usage(format!("write --section with one of: {}", names.join(", ")))),
    };
    let Some(section) = section else {
        return Ok(("study".to_string(), vec![name.to_string(), text.to_string()]));
    };
    let words = study::words(section, command, Vec::new()).map_err(|errors| Failure::file(errors.join("\n")))?;
    Ok((section.verb.clone(), words))
}

/// Returns the page of a planned wave.
pub fn page((planned, cost_s): &Costed) -> Page {
    let manifest = &planned.manifest;
    let mut page = Page::default();
    let (points, shards) = (manifest.points.count(), manifest.shards());
    page.note(format!("$ {}", manifest.command));
    page.data("command", manifest.command.as_str());
    page.fact("wave", "wave", manifest.wave, manifest.wave.to_string());
    page.fact("points", "points", points, points.to_string());
    page.fact("shards", "shards", shards, format!("{shards} of {} points", manifest.shard_points));
    page.data("shard_points", manifest.shard_points);
    if let Some(cost_s) = cost_s {
        let hours = cost_s * points as f64 / 3600.0;
        let said = format!("{} ms a point, {} core-hours in all", number(round(1e3 * cost_s)), number(round(hours)));
        page.fact("point_s", "cost", *cost_s, said);
    }
    page.fact("manifest_bytes", "manifest", planned.bytes, format!("{} bytes", planned.bytes));
    page.line("next", format!("hpu sweep submit {} --engine slurm, or hpu sweep run {0}", planned.dir.display()));
    page
}

/// Returns a figure with three digits.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
