//! Reading the files of a sweep: a shard's, which is refused if it is not the finished one of this sweep, and the
//! gathered one.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::{ErrorKind, Seek, SeekFrom};

use hpu_farm::{Damage, Schema, unseal};
use hpu_farm::{SEAL, UNSEALED};
use hpu_page::{Column, ParquetFile};

use super::manifest::Planned;
use crate::shell::Failure;
use crate::work::{Rows, Work};

/// The name of the gathered file.
pub(crate) const GATHERED: &str = "gathered.parquet";

/// Returns what is wrong with a file.
pub fn said(damage: &Damage) -> String {
    match damage {
        Damage::Truncated => "truncated: it does not end as a Parquet file does".into(),
        Damage::Unsealed => "foreign: it has no checksum of a sweep".into(),
        Damage::Changed => "damaged: its bytes are not those that were written".into(),
        Damage::Io(error) => error.to_string(),
    }
}

/// Returns what a file tells of itself, as keys and values: its command, these ones, the meanings of its columns, and a
/// place for its checksum.
pub fn metadata(command: &str, own: Vec<(&str, String)>, work: &dyn Work) -> Vec<(String, String)> {
    let own = [("command", command.to_string())].into_iter().chain(own);
    let own = own.map(|(key, value)| (key.to_string(), value));
    own.chain(work.meanings()).chain([(SEAL.to_string(), UNSEALED.to_string())]).collect()
}

/// Why a shard's file is not used.
#[derive(Debug)]
pub(crate) enum Unusable {
    /// There is none.
    Missing,
    /// It is not the file of this shard, for this reason.
    Refused(String),
}

/// Opens a shard's file if it is the finished one of this manifest and program; of any program if none is given.
pub fn check(
    planned: &Planned,
    index: u64,
    columns: &[Column],
    program: Option<&str>,
) -> Result<ParquetFile, Unusable> {
    let refused = |why: &dyn Display| Unusable::Refused(why.to_string());
    let mut file = match File::open(planned.shard(index, "parquet")) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Err(Unusable::Missing),
        file => file.map_err(|error| refused(&error))?,
    };
    unseal(&mut file).map_err(|damage| refused(&said(&damage)))?;
    file.seek(SeekFrom::Start(0)).map_err(|error| refused(&error))?;
    let file = ParquetFile::open(file, columns).map_err(|error| refused(&format!("foreign: {error}")))?;
    let found = |key: &str| file.metadata(key).unwrap_or_default().to_string();
    let manifest = &planned.manifest;
    if found("hpu.settings") != manifest.settings() {
        return Err(refused(&format!("foreign: of another sweep, {}", found("command"))));
    }
    if found("hpu.wave") == manifest.wave.to_string() && found("hpu.manifest") != planned.sum {
        return Err(refused(&"stale: of an older manifest of this sweep"));
    }
    if found("hpu.wave") != manifest.wave.to_string() || found("hpu.shard") != index.to_string() {
        let (shard, wave) = (found("hpu.shard"), found("hpu.wave"));
        return Err(refused(&format!("duplicate: a copy of shard {shard} of wave {wave}")));
    }
    if program.is_some_and(|program| found("hpu.program") != program) {
        return Err(refused(&format!("stale: of another build of hpu, {}", found("hpu.version"))));
    }
    Ok(file)
}

/// Opens the gathered file of a sweep.
fn open(planned: &Planned, schema: &Schema) -> Result<ParquetFile, Failure> {
    let place = planned.dir.join(GATHERED);
    let mut file = File::open(&place).map_err(|error| {
        Failure::file(format!("{}: {error}; hpu sweep gather {} makes it", place.display(), planned.dir.display()))
    })?;
    unseal(&mut file).map_err(|damage| Failure::at(&place, said(&damage)))?;
    let file = ParquetFile::open(file, schema.columns()).map_err(|error| Failure::at(&place, error))?;
    if file.metadata("hpu.settings") != Some(&planned.manifest.settings()) {
        return Err(Failure::at(&place, "is of another sweep"));
    }
    Ok(file)
}

/// Returns the gathered rows of the waves before this one, and of this one too if `with_own`.
pub fn gathered(planned: &Planned, work: &dyn Work, with_own: bool) -> Result<Rows, Failure> {
    let wave = planned.manifest.wave;
    let waves = if with_own { wave } else { wave - 1 };
    if waves == 0 {
        return Ok(Rows::new());
    }
    let schema = work.schema();
    let place = planned.dir.join(GATHERED);
    let file = open(planned, &schema)?;
    let counts = file.metadata("hpu.rows").unwrap_or_default().split(',').map(str::parse::<u64>);
    let counts: Vec<u64> = counts.collect::<Result<_, _>>().map_err(|error| Failure::at(&place, error))?;
    if counts.len() < waves {
        return Err(Failure::usage(format!(
            "wave {waves} is not gathered; hpu sweep gather {} does that first",
            planned.dir.display()
        )));
    }
    let mut left = counts[..waves].iter().fold(0, |sum: u64, rows| sum.saturating_add(*rows)) as usize;
    let mut rows = BTreeMap::new();
    for group in 0..file.groups() {
        let told = file.group(group).map_err(|error| Failure::at(&place, error))?;
        let told = schema.results(&told).ok_or_else(|| Failure::at(&place, "its columns do not agree"))?;
        let taken = told.into_iter().take(left);
        left -= taken.len();
        if work.count().is_some_and(|count| taken.clone().any(|(point, _)| point >= count)) {
            return Err(Failure::at(&place, "its points are not those of the sweep"));
        }
        rows.extend(taken.filter_map(|(point, row)| Some((point as usize, row?))));
    }
    Ok(rows)
}

/// Returns the rows that the points of a wave depend on: those of the waves before it.
pub fn before(planned: &Planned, work: &dyn Work) -> Result<Rows, Failure> {
    gathered(planned, work, false)
}
