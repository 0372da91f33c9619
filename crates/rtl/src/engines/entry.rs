//! A cache of tool results: a folder of small files. The key of an entry is the SHA-256 of everything that the result
//! depends on.
//!
//! An entry says what it is about, and ends with a checksum over all of it. A file whose checksum is wrong, that has
//! another key, or that another user can have written, is ignored and replaced. Several programs may share a folder,
//! because files appear whole.

use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::engines::error::Error;
use crate::engines::note::note;
use crate::engines::owned;
use crate::engines::temporary::{self, Temporary, sweep_files};

const FIRST: &str = "hpu entry 3";

/// A result that an entry can hold, as one line. Costs and the results of proofs implement it, and [`Entries`] stores
/// them through it.
pub trait Content: Sized {
    /// The extension of the entry's file name.
    const EXTENSION: &'static str;
    fn line(&self) -> String;
    fn from_line(line: &str) -> Option<Self>;
}

/// Returns an entry's text. `about` is for human readers.
pub fn write<C: Content>(key: &str, about: &str, content: &C) -> String {
    let said = format!("{FIRST}\nkey {key}\nabout {about}\n{}\n", content.line());
    format!("{said}sha256 {}\n", hexadecimal(Sha256::digest(&said)))
}

/// Reads the result from an entry. Returns `None` when the entry is damaged or has another key.
pub fn read<C: Content>(key: &str, text: &str) -> Option<C> {
    let (said, sum) = text.strip_suffix('\n')?.rsplit_once('\n')?;
    let said = &text[..=said.len()];
    let lines: Vec<_> = said.split('\n').collect();
    let [first, of, about, content, ""] = lines[..] else { return None };
    let whole = sum.strip_prefix("sha256 ") == Some(hexadecimal(Sha256::digest(said)).as_str());
    let ours = first == FIRST && of.strip_prefix("key ") == Some(key) && about.starts_with("about ");
    (whole && ours).then(|| C::from_line(content)).flatten()
}

/// Returns the SHA-256 of all parts, in hexadecimal digits. Each part is hashed with its length, so that two parts
/// cannot be confused with one.
pub fn key(parts: &[&str]) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hexadecimal(hash.finalize())
}

/// Returns a hash in hexadecimal digits.
pub fn hexadecimal(hash: impl AsRef<[u8]>) -> String {
    hash.as_ref().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A folder of entries.
#[derive(Debug)]
pub(crate) struct Entries(PathBuf);

impl Entries {
    /// Opens a folder, and makes it when it is missing.
    pub fn open(dir: PathBuf) -> Result<Self, Error> {
        owned::make_folders(&dir).map_err(|error| refused(&dir, error))?;
        sweep_files(&dir);
        Ok(Self(dir))
    }

    /// Returns the result under a key, if there is one that can be read.
    pub fn find<C: Content>(&self, key: &str) -> Option<C> {
        let place = self.place::<C>(key);
        match owned::read(&place) {
            Ok(bytes) => std::str::from_utf8(&bytes).ok().and_then(|text| read(key, text)),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => {
                note(format!("{}: {error}; it is made again", place.display()));
                None
            }
        }
    }

    /// Writes a result under a key. A result that cannot be kept, as where the disk is full, is a result all the same.
    pub fn keep<C: Content>(&self, key: &str, about: &str, content: &C) {
        let place = self.place::<C>(key);
        let written = Temporary::file(&self.0, key).and_then(|file| {
            file.open()?.write_all(write(key, about, content).as_bytes())?;
            temporary::place(vec![(file, place.clone())]).map_err(|(_, error)| error)
        });
        if let Err(error) = written {
            let folder = self.0.display();
            note(format!("{folder}: {error}; the result is not kept, and is made again next time"));
        }
    }

    fn place<C: Content>(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}.{}", C::EXTENSION))
    }
}

fn refused(place: &Path, error: io::Error) -> Error {
    Error::io(place, error)
}
