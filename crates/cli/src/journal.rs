//! The journal of a set of runs, a file in the set's folder: of a map, a width search, a chart over a map, a study, a
//! shard of a sweep. A line is added for each unit when the unit is done, so that an interrupted set can be continued.
//! No other place writes one.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use hpu_farm::{self as farm, JournalError, UnitResult};
use hpu_rtl::temporary::{self, Temporary};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::shell::exit::refused;
use crate::shell::files::not_a_link;
use crate::shell::{Failure, program, terminal};

/// The result of a unit, as a journal keeps it.
pub trait Row: Serialize + DeserializeOwned + PartialEq {}

impl<T: Serialize + DeserializeOwned + PartialEq> Row for T {}

/// A journal that only this process writes to; without a folder, rows are not kept.
pub struct Journal(Option<Kept>);

struct Kept {
    path: PathBuf,
    header: String,
    file: File,
}

/// Returns a set's journal and the rows in it; without a folder no row. The journal is bound to its kind, the command,
/// everything else that the rows depend on (`parts`), and this program.
pub(crate) fn resume<'a, T: Row>(
    dir: Option<&Path>,
    count: usize,
    (kind, command): (&str, &str),
    parts: impl IntoIterator<Item = &'a [u8]>,
) -> Result<(Journal, BTreeMap<usize, UnitResult<T>>), Failure> {
    let Some(dir) = dir else { return Ok((Journal(None), BTreeMap::new())) };
    let program = program::fingerprint()?;
    let mut all = vec![program.as_bytes()];
    for part in parts {
        all.push(part);
    }
    let print = farm::fingerprint(all);
    at(&dir.join(NAME), &format!("{kind} {print} of {command}"), count)
}

/// Returns the journal at a path, and the rows in it. The header says everything that the rows depend on.
pub fn at<T: Row>(
    path: &Path,
    header: &str,
    count: usize,
) -> Result<(Journal, BTreeMap<usize, UnitResult<T>>), Failure> {
    let (kept, rows) = Kept::open(path.to_path_buf(), header, count)?;
    Ok((Journal(Some(kept)), rows))
}

/// The name of the file.
pub const NAME: &str = "journal.txt";

impl Journal {
    /// Adds a row.
    pub fn add<T: Row>(&mut self, index: usize, row: &UnitResult<T>) -> Result<(), Failure> {
        let Some(Kept { path, header, file }) = &mut self.0 else { return Ok(()) };
        if let Some(refusal) = refused() {
            return Err(refusal);
        }
        let line = farm::Journal::line(header, index, row);
        file.write_all(line.as_bytes()).map_err(|error| Failure::at(path, error))
    }
}

impl Kept {
    /// Opens or begins the journal of the set with this header, and returns its rows. Damaged rows are counted on
    /// stderr and removed, and their units are run again.
    fn open<T: Row>(
        path: PathBuf,
        header: &str,
        count: usize,
    ) -> Result<(Self, BTreeMap<usize, UnitResult<T>>), Failure> {
        let at = |error| Failure::at(&path, error);
        not_a_link(&path)?;
        let mut file = File::options().read(true).append(true).create(true).open(&path).map_err(at)?;
        let locked = |file: &File| match file.try_lock() {
            // A file system without locks, as NFS can be, cannot tell of other processes.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
            Err(TryLockError::WouldBlock) => {
                Err(Failure::usage(format!("{}: another process is writing to it", path.display())))
            }
        };
        locked(&file)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(at)?;
        let read = farm::Journal::<T>::read(&bytes, header, count).map_err(|error| {
            let wanted = match error {
                JournalError::Other(_) => {
                    format!("this one is: {header}\n(the number is of its settings and of the program that ran it)\n")
                }
                JournalError::Old => String::new(),
            };
            Failure::usage(format!("{} {error}\n{wanted}choose another folder, or remove that journal", path.display()))
        })?;
        if read.damaged > 0 {
            let (rows, are) = if read.damaged == 1 { ("row", "is") } else { ("rows", "are") };
            terminal::tell(&format!(
                "{}: {} {rows} {are} damaged; their cells run again",
                path.display(),
                read.damaged
            ));
        }
        let mut journal = Self { header: header.to_string(), file, path: path.clone() };
        if read.damaged > 0 {
            // The journal must be whole at every moment, so it is written to another file, which is locked before
            // another process can open it, and then renamed.
            let dir = path.parent().expect("a journal is in a folder");
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let beside = Temporary::file(dir, &name).map_err(at)?;
            let mut new = beside.open().map_err(at)?;
            let lines = read.rows.iter().map(|(index, row)| farm::Journal::line(header, *index, row));
            let text = [farm::Journal::<T>::head(header)].into_iter().chain(lines).collect::<String>();
            new.write_all(text.as_bytes()).and_then(|()| new.sync_all()).map_err(at)?;
            temporary::place(vec![(beside, path.clone())]).map_err(|(_, error)| at(error))?;
            journal.file = new;
        } else if bytes.len() < farm::Journal::<T>::head(header).len() {
            journal.file.set_len(0).map_err(at)?;
            journal.file.write_all(farm::Journal::<T>::head(header).as_bytes()).map_err(at)?;
        }
        Ok((journal, read.rows))
    }
}
