//! Files and folders that exist only while a process works on them.
//!
//! The process that makes one holds a lock on it. The lock ends with the process, however the process ends. A file or
//! folder without a lock was therefore left by a process that was killed, and the next process [sweeps](sweep_files) it
//! away.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use std::{mem, path, process};

use crate::engines::owned;
use crate::system;

/// Prefix of the folders' names.
const FOLDERS: &str = "hpu-ghdl-work-";
/// The text between the file's name and the numbers, and the suffix of the files' names.
const FILES: (&str, &str) = (".hpu-", ".tmp");

/// The temporary files and folders of this process.
static OWN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn own() -> MutexGuard<'static, Vec<PathBuf>> {
    OWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the absolute path of the system's folder for temporary files. Tools run in folders of their own, in which a
/// relative one would be another place.
pub fn parent() -> PathBuf {
    let dir = std::env::temp_dir();
    if dir.as_os_str().is_empty() { PathBuf::from(system::TEMPORARIES) } else { path::absolute(&dir).unwrap_or(dir) }
}

/// A locked temporary file or folder, which is removed when this value is dropped.
#[derive(Debug)]
pub struct Temporary {
    path: PathBuf,
    file: File,
    is_placed: bool,
}

impl Temporary {
    /// Makes an empty file in a folder, in which it can be renamed to `name`.
    ///
    /// # Errors
    ///
    /// An error when the file cannot be made.
    pub fn file(dir: &Path, name: &str) -> io::Result<Self> {
        let open = |path: &Path| File::options().write(true).read(true).create_new(true).open(path);
        Self::new(|numbers| dir.join(format!(".{name}{}{numbers}{}", FILES.0, FILES.1)), open)
    }

    /// Makes an empty folder among the system's temporary ones. Removes folders that killed processes have left there.
    ///
    /// # Errors
    ///
    /// An error when the folder cannot be made.
    pub fn folder() -> io::Result<Self> {
        Self::folder_in(&parent())
    }

    /// Makes an empty folder in `parent`. Removes folders that killed processes have left there.
    ///
    /// # Errors
    ///
    /// An error when the folder cannot be made.
    pub(crate) fn folder_in(parent: &Path) -> io::Result<Self> {
        sweep(parent, |name| name.starts_with(FOLDERS));
        let open = |path: &Path| owned::make_folder(path).and_then(|()| owned::open(path, |_| true));
        Self::new(|numbers| parent.join(format!("{FOLDERS}{numbers}")), open)
    }

    /// Makes and locks a file or folder that no other process has. Its name may be that of a leftover, when two
    /// processes have had the same number. A sweeping process may remove it before it is locked; then another one is
    /// made.
    fn new(name: impl Fn(&str) -> PathBuf, open: impl Fn(&Path) -> io::Result<File>) -> io::Result<Self> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        loop {
            let path = name(&format!("{}-{}", process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
            let mut own = own();
            let file = match open(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                // A sweeping process removed the folder between its creation and its opening.
                Err(error) if error.kind() == io::ErrorKind::NotFound && path.parent().is_some_and(Path::is_dir) => {
                    continue;
                }
                file => file?,
            };
            let is_ours = match file.try_lock() {
                Ok(()) => {
                    fs::metadata(&path).is_ok_and(|found| file.metadata().is_ok_and(|it| system::is_same(&it, &found)))
                }
                Err(TryLockError::WouldBlock) => false,
                // The file system has no locks, so no process can take the file for a leftover either.
                Err(TryLockError::Error(_)) => true,
            };
            if is_ours {
                own.push(path.clone());
                return Ok(Self { path, file, is_placed: false });
            }
        }
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the open file for writing.
    ///
    /// # Errors
    ///
    /// An error when the process has too many open files.
    pub fn open(&self) -> io::Result<File> {
        self.file.try_clone()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut own = own();
        own.retain(|path| *path != self.path);
        if !self.is_placed {
            remove(&self.path);
        }
    }
}

/// Renames files to their places, in this order. A signal that ends the program waits for the last of them. The files
/// after one that cannot be renamed are removed.
///
/// # Errors
///
/// The first place that a file could not be renamed to, and the reason.
pub fn place(mut files: Vec<(Temporary, PathBuf)>) -> Result<(), (PathBuf, io::Error)> {
    let own = own();
    let failed = files.iter_mut().find_map(|(file, place)| {
        let renamed = fs::rename(&file.path, &*place);
        file.is_placed = renamed.is_ok();
        renamed.err().map(|error| (mem::take(place), error))
    });
    drop(own);
    failed.map_or(Ok(()), Err)
}

/// Removes all temporary files and folders of this process. Afterwards the process cannot make any, so it must be about
/// to end.
pub fn remove_temporaries() {
    let own = own();
    own.iter().for_each(|path| remove(path));
    mem::forget(own);
}

/// Removes a file or folder. Errors are ignored: nobody needs to know of a file that is gone already. A tool that was
/// just killed may still have been writing into a folder, so a folder is tried more than once.
fn remove(path: &Path) {
    if !path.is_dir() {
        let _ = fs::remove_file(path);
        return;
    }
    for _ in 0..20 {
        match fs::remove_dir_all(path) {
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => thread::sleep(Duration::from_millis(10)),
            _ => return,
        }
    }
}

/// Removes the files that killed processes have left in a folder.
pub fn sweep_files(dir: &Path) {
    sweep(dir, |name| {
        let middle = name.strip_prefix('.').and_then(|name| name.strip_suffix(FILES.1));
        let numbers = middle.and_then(|name| name.rsplit_once(FILES.0)).map_or("", |(_, numbers)| numbers);
        !numbers.is_empty() && numbers.chars().all(|c| c.is_ascii_digit() || c == '-')
    });
}

/// Removes the files and folders of this user in a folder that have such a name and that no process has locked. Others
/// are left alone: those of another user, links, FIFOs, and what cannot be opened.
fn sweep(dir: &Path, is_ours: impl Fn(&str) -> bool) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if entry.file_name().to_str().is_some_and(&is_ours)
            && let Ok(file) = owned::open(&path, owned::is_ours)
            && file.try_lock().is_ok()
        {
            remove(&path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(test: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("hpu-temporary-{test}-{}", process::id()));
        fs::create_dir_all(&dir).expect("a folder for the test");
        dir
    }

    fn names(dir: &Path) -> Vec<String> {
        let names = fs::read_dir(dir).expect("a folder").flatten().map(|entry| entry.file_name());
        let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn who_sweeps_while_another_makes_a_folder_does_not_take_it() {
        let parent = Temporary::folder().expect("a folder");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..400 {
                        let folder = Temporary::folder_in(parent.path()).expect("a folder of its own");
                        assert!(folder.path().is_dir());
                    }
                });
            }
        });
    }

    #[test]
    fn what_nobody_holds_is_swept_and_nothing_else() {
        let dir = scratch("sweep");
        let held = Temporary::file(&dir, "wave.vcd").expect("a file");
        let name = held.path().file_name().expect("a name").to_string_lossy().into_owned();
        // The number of a process proves nothing: this process's own number is among the leftovers.
        let left = [".wave.vcd.hpu-1-0.tmp".to_string(), format!(".trace.csv.hpu-{}-77.tmp", process::id())];
        let others = [".wave.vcd.tmp", "wave.vcd.hpu-1-0.tmp", ".mine.hpu-.tmp", ".notes.hpu-a1.tmp", "trace.csv"];
        for name in left.iter().map(String::as_str).chain(others) {
            fs::write(dir.join(name), "left").expect("a file");
        }
        sweep_files(&dir);
        let mut expected: Vec<_> = others.iter().map(|name| (*name).to_string()).chain([name]).collect();
        expected.sort();
        assert_eq!(names(&dir), expected);
        drop(held);
        assert_eq!(names(&dir).len(), others.len());
        fs::remove_dir_all(dir).expect("the folder goes");
    }

    #[test]
    fn a_file_that_is_written_to_elsewhere_is_held() {
        let dir = scratch("held");
        let temporary = Temporary::file(&dir, "a").expect("a file");
        let writer = temporary.open().expect("the same file");
        drop(writer);
        sweep_files(&dir);
        assert!(temporary.path().exists(), "the lock is that of the temporary");
        place(vec![(temporary, dir.join("a"))]).expect("renamed");
        assert_eq!(names(&dir), ["a"]);
        fs::remove_dir_all(dir).expect("the folder goes");
    }

    #[test]
    fn a_place_that_cannot_be_is_told_and_nothing_temporary_stays() {
        let dir = scratch("place");
        let files = ["a", "no/b", "c"].map(|name| (Temporary::file(&dir, "x").expect("a file"), dir.join(name)));
        let (at, _) = place(files.into()).expect_err("there is no such folder");
        assert_eq!((at, names(&dir)), (dir.join("no/b"), vec!["a".to_string()]));
        fs::remove_dir_all(dir).expect("the folder goes");
    }

    #[test]
    fn a_folder_is_swept_only_when_nobody_holds_it() {
        let held = Temporary::folder().expect("a folder");
        fs::write(held.path().join("file"), "").expect("a file");
        let left = std::env::temp_dir().join(format!("{FOLDERS}{}-left", process::id()));
        fs::create_dir_all(left.join("within")).expect("a folder");
        let other = Temporary::folder().expect("a folder");
        assert!(held.path().exists() && other.path().exists() && !left.exists());
        let path = held.path().to_path_buf();
        drop(held);
        assert!(!path.exists());
    }
}
