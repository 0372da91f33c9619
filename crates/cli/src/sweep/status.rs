//! How far a sweep has come.

use std::fs;
use std::path::Path;

use hpu_page::{Cell, Column, Page, Table};

use super::files::GATHERED;
use super::manifest::Planned;
use crate::page::show;
use crate::shell::{Exit, Failure};

/// A wave's shards by their states.
pub struct Progress {
    /// The numbers of the shards that have no file.
    pub left: Vec<u64>,
    /// How many shards were begun and have no file.
    pub begun: usize,
    /// Number of points in files.
    pub points: u64,
}

/// Returns how far a wave has come, by the names of its files; `gather` looks into them.
pub fn progress(planned: &Planned) -> Progress {
    let manifest = &planned.manifest;
    let mut is_done = vec![false; manifest.shards() as usize];
    let mut begun = Vec::new();
    for entry in fs::read_dir(planned.shards()).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some((index, ending)) = name.split_once('.') else { continue };
        let Some(index) = index.parse().ok().filter(|index: &usize| *index < is_done.len()) else { continue };
        match ending {
            "parquet" => is_done[index] = true,
            "journal" => begun.push(index),
            _ => {}
        }
    }
    let done = is_done.iter().filter(|done| **done).count() as u64;
    // The last shard may have fewer points.
    let missing = manifest.shards() * manifest.shard_points - manifest.points.count();
    let short = if is_done.last() == Some(&true) { missing } else { 0 };
    Progress {
        begun: begun.into_iter().filter(|index| !is_done[*index]).count(),
        left: (0..manifest.shards()).filter(|index| !is_done[*index as usize]).collect(),
        points: done * manifest.shard_points - short,
    }
}

/// Runs `hpu sweep status`.
pub fn run(dir: &Path, json: bool) -> Result<Exit, Failure> {
    let waves = Planned::waves(dir)?;
    let columns = [
        Column::integer("wave", "wave"),
        Column::integer("shards", "shards"),
        Column::integer("done", "done"),
        Column::integer("under_way", "begun"),
        Column::integer("points", "points"),
        Column::integer("points_done", "done"),
    ];
    let mut table = Table::new("waves", columns);
    let mut complete = true;
    for wave in &waves {
        let Progress { left, begun, points } = progress(wave);
        complete &= left.is_empty();
        let shards = wave.manifest.shards();
        table.add([
            Cell::new(wave.manifest.wave),
            shards.into(),
            (shards - left.len() as u64).into(),
            begun.into(),
            wave.manifest.points.count().into(),
            points.into(),
        ]);
    }
    let mut page = Page::default();
    page.note(format!("$ {}", waves[0].manifest.command));
    page.table(table);
    let gathered = dir.join(GATHERED).exists();
    page.data("complete", complete).data("gathered", gathered);
    page.note(match (complete, gathered) {
        (false, _) => "shards are left; hpu sweep submit or run goes on with those that nothing runs",
        (true, false) => {
            "all shards of the last wave are done; hpu sweep gather checks and merges them, submit goes on"
        }
        (true, true) => "all shards of the last wave are done, and a wave or more is gathered",
    });
    show(&page, json)?;
    Ok(Exit::Fine)
}
