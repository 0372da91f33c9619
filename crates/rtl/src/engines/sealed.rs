//! Folders in a cache whose files are believed: a seal beside the files has their checksums and one of its own.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::engines::entry::hexadecimal;
use crate::engines::owned;
use crate::engines::temporary::Temporary;

/// The file with the seal.
const SEAL: &str = "whole";
/// The first line of a seal.
const FIRST: &str = "hpu sealed folder 1";

/// Returns the text of a seal over files of a folder. `about` is for human readers.
fn text(folder: &Path, files: &[&str], about: &str) -> io::Result<String> {
    let mut text = format!("{FIRST}\n");
    for file in files {
        text += &format!("sha256 {} {file}\n", hexadecimal(Sha256::digest(owned::read(&folder.join(file))?)));
    }
    Ok(format!("{text}about {}\n", about.replace('\n', " ")))
}

/// Seals these files of a folder.
///
/// # Errors
///
/// When a file cannot be read, or the seal not be written.
pub(crate) fn seal(folder: &Path, files: &[&str], about: &str) -> io::Result<()> {
    let text = text(folder, files, about)?;
    fs::write(folder.join(SEAL), format!("{text}sha256 {}\n", hexadecimal(Sha256::digest(&text))))
}

/// Returns whether a folder holds these files as they were when it was sealed, and no other user can have written them.
pub(crate) fn holds(folder: &Path, files: &[&str]) -> bool {
    let is_folder = || owned::open(folder, |found| found.is_dir() && owned::is_trusted(found)).ok();
    let sealed = || -> Option<bool> {
        is_folder()?;
        let seal = String::from_utf8(owned::read(&folder.join(SEAL)).ok()?).ok()?;
        let (said, sum) = seal.strip_suffix('\n')?.rsplit_once('\n')?;
        let said = &seal[..=said.len()];
        let about = said.lines().find_map(|line| line.strip_prefix("about "))?;
        let is_whole = sum.strip_prefix("sha256 ") == Some(hexadecimal(Sha256::digest(said)).as_str());
        Some(is_whole && text(folder, files, about).ok()? == said)
    };
    sealed().unwrap_or(false)
}

/// Puts a sealed folder into its place in a cache, unless another program has put a whole one there meanwhile. What is
/// damaged is replaced. Returns the folder back where the place cannot be had, as where another user holds it.
pub(crate) fn place(made: Temporary, place: &Path, files: &[&str]) -> Option<Temporary> {
    // Of two programs that replace a damaged folder, neither may remove the other's. A file system without locks has
    // no remedy.
    let gate = place.parent().and_then(|cache| File::open(cache).ok());
    let _ = gate.as_ref().map(File::lock);
    if holds(place, files) {
        return None;
    }
    let _ = if place.is_symlink() || place.is_file() { fs::remove_file(place) } else { fs::remove_dir_all(place) };
    if fs::rename(made.path(), place).is_ok() { None } else { Some(made) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_holds_its_files_until_any_of_them_changes() {
        // Of a temporary folder this process has the lock already.
        let outer = Temporary::folder().expect("a folder");
        let cache = outer.path().join("cache");
        fs::create_dir(&cache).expect("a folder");
        let files = ["model", "ports"];
        let made = || {
            let made = Temporary::folder_in(&cache).expect("a folder");
            for file in files {
                fs::write(made.path().join(file), file).expect("a file");
            }
            seal(made.path(), &files, "tools").expect("it is sealed");
            made
        };
        let kept = cache.join("kept");
        assert!(place(made(), &kept, &files).is_none() && holds(&kept, &files));
        let changes: [&dyn Fn(); 6] = [
            &|| fs::write(kept.join("model"), "model2").expect("written"),
            &|| fs::write(kept.join("ports"), "").expect("written"),
            &|| fs::remove_file(kept.join("model")).expect("removed"),
            &|| fs::write(kept.join(SEAL), "").expect("written"),
            &|| {
                let text = fs::read_to_string(kept.join(SEAL)).expect("a seal");
                fs::write(kept.join(SEAL), text.replace("about tools", "about others")).expect("written");
            },
            &|| {
                fs::rename(kept.join("model"), kept.join("elsewhere")).expect("renamed");
                std::os::unix::fs::symlink("elsewhere", kept.join("model")).expect("a link");
            },
        ];
        for (index, change) in changes.iter().enumerate() {
            change();
            assert!(!holds(&kept, &files), "change {index}");
            // It is made again.
            assert!(place(made(), &kept, &files).is_none() && holds(&kept, &files), "change {index}");
        }
        // The seal of other files does not do.
        assert!(!holds(&kept, &["model"]));
    }
}
