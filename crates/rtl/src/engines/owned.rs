//! Files and folders that no other user can have made.
//!
//! The folder for temporary files is everybody's, and a cache may be in a place that others can write to. An entry that
//! is found there is looked at before it is opened. It is opened without waiting, because a FIFO has no end, and
//! without following a link.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use crate::system;
pub(crate) use crate::system::{is_ours, is_trusted};

/// Opens an ordinary file or a folder for reading, if `is_wanted` says so of it.
///
/// # Errors
///
/// [`ErrorKind::NotFound`] where there is nothing, a link, an entry of another kind, or one that is not wanted.
pub(crate) fn open(path: &Path, is_wanted: impl Fn(&Metadata) -> bool) -> io::Result<File> {
    let is_one = |found: &Metadata| (found.is_file() || found.is_dir()) && is_wanted(found);
    let other = || io::Error::from(ErrorKind::NotFound);
    if !is_one(&fs::symlink_metadata(path)?) {
        return Err(other());
    }
    let file = system::open(path)?;
    // It may have become another one meanwhile.
    if is_one(&file.metadata()?) { Ok(file) } else { Err(other()) }
}

/// Reads a file that [can be trusted](is_trusted).
///
/// # Errors
///
/// As [`open`], and when the file cannot be read.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path, |found| found.is_file() && is_trusted(found))?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Makes a folder, and those above it that are missing, which no other user can look into.
///
/// # Errors
///
/// When a folder cannot be made.
pub(crate) fn make_folders(path: &Path) -> io::Result<()> {
    system::private_folders().recursive(true).create(path)
}

/// Makes a folder that is not there yet, which no other user can look into.
///
/// # Errors
///
/// When the folder cannot be made.
pub(crate) fn make_folder(path: &Path) -> io::Result<()> {
    system::private_folders().create(path)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    use std::process::Command;

    use super::*;
    use crate::engines::temporary::Temporary;

    #[test]
    fn a_file_is_read_and_a_fifo_a_link_and_what_others_can_write_are_not() {
        let dir = Temporary::folder().expect("a folder");
        let [file, fifo, link, open] = ["file", "fifo", "link", "open"].map(|name| dir.path().join(name));
        fs::write(&file, "text").expect("a file");
        symlink(&file, &link).expect("a link");
        fs::write(&open, "text").expect("a file");
        fs::set_permissions(&open, fs::Permissions::from_mode(0o666)).expect("rights");
        assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo").success());
        assert_eq!(read(&file).expect("a file of our own"), b"text");
        for other in [&fifo, &link, &open, &dir.path().join("nothing"), &dir.path().to_path_buf()] {
            assert_eq!(read(other).expect_err("no file of ours").kind(), ErrorKind::NotFound, "{}", other.display());
        }
        let mode = |path: &Path| fs::metadata(path).expect("it is there").mode() & 0o777;
        make_folders(&dir.path().join("a/b")).expect("folders");
        assert_eq!(
            (mode(dir.path()), mode(&dir.path().join("a")), mode(&dir.path().join("a/b"))),
            (0o700, 0o700, 0o700)
        );
    }
}
