//! The journal of a set of runs in its folder: a line a unit, added as the unit is done, so that an interrupted set goes on.

use std::collections::BTreeMap;
use std::env;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use hpu_study::units::{self, JournalError, Row};

use crate::exit::Failure;

/// A journal that this process alone writes to.
pub struct Journal {
    path: PathBuf,
    file: File,
}

/// A set's journal and the rows that are in it; without a folder none. `header` is asked only where there is a journal: it
/// reads the whole program.
pub fn resume(
    dir: Option<&Path>,
    count: usize,
    header: impl FnOnce() -> Result<String, Failure>,
) -> Result<(Option<Journal>, BTreeMap<usize, Row>), Failure> {
    let Some(dir) = dir else { return Ok(Default::default()) };
    let (journal, read) = Journal::open(dir, &header()?, count)?;
    Ok((Some(journal), read.rows))
}

/// What names a set in its journal: a print of all that its rows depend on, this very program included, and the command.
pub fn header<'a>(kind: &str, parts: impl IntoIterator<Item = &'a [u8]>, command: &str) -> Result<String, Failure> {
    let program = env::current_exe().and_then(fs::read);
    let program = program.map_err(|error| Failure::file(format!("this program cannot read itself: {error}")))?;
    let mut all = vec![program.as_slice()];
    for part in parts {
        all.push(part);
    }
    Ok(format!("{kind} {} of {command}", units::fingerprint(all)))
}

/// Name of the file.
pub const NAME: &str = "journal.txt";

impl Journal {
    /// Opens or begins the journal of the set with this header, and returns the rows that are there. Half a line at the
    /// end, as a power cut leaves, is cut off.
    fn open(dir: &Path, header: &str, count: usize) -> Result<(Self, units::Journal), Failure> {
        let path = dir.join(NAME);
        let at = |error| Failure::at(&path, error);
        let mut file = File::options().read(true).append(true).create(true).open(&path).map_err(at)?;
        if file.try_lock().is_err() {
            return Err(Failure::usage(format!("{}: another process is writing to it", path.display())));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(at)?;
        let read =
            units::Journal::read(&String::from_utf8_lossy(&bytes), header, count).map_err(|error| match error {
                JournalError::Other(_) => Failure::usage(format!(
                    "{} {error}\nthis one is: {header}\n(the number is of its settings and of the program that ran it)\n\
                 choose another folder, or remove that journal",
                    path.display()
                )),
                JournalError::Line(_) => Failure::at(&path, error),
            })?;
        if read.whole < bytes.len() {
            file.set_len(read.whole as u64).map_err(at)?;
        }
        if read.whole == 0 {
            file.write_all(format!("{header}\n").as_bytes()).map_err(at)?;
        }
        Ok((Self { path, file }, read))
    }

    /// Adds a row.
    pub fn add(&mut self, index: usize, row: &Row) -> Result<(), Failure> {
        let line = units::Journal::line(index, row);
        self.file.write_all(line.as_bytes()).map_err(|error| Failure::at(&self.path, error))
    }
}
