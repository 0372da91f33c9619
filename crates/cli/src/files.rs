//! Files that appear whole or not at all: written beside their place under a temporary name, then renamed together.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::Mutex;

use crate::exit::Failure;

/// Temporary files of this process.
static TEMPORARIES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what is half written; the process must end thereafter.
pub fn remove_temporaries() {
    if let Ok(paths) = TEMPORARIES.lock() {
        // Nobody is left to hear of a file that is gone already.
        paths.iter().for_each(|path| drop(fs::remove_file(path)));
    }
}

fn forget(temporary: &Path) {
    if let Ok(mut paths) = TEMPORARIES.lock() {
        paths.retain(|path| path != temporary);
    }
}

/// A folder that files are written to. Unless committed, none of them stays.
pub struct Folder {
    dir: PathBuf,
    created: bool,
    /// Temporary names and places.
    staged: Vec<(PathBuf, PathBuf)>,
}

impl Folder {
    /// Opens or creates a folder. One that cannot be written to is refused here, before anything is computed.
    pub fn open(dir: &Path) -> Result<Self, Failure> {
        let created = !dir.exists();
        let unusable = |error| Failure::usage(format!("cannot write to {}: {error}", dir.display()));
        fs::create_dir_all(dir).map_err(unusable)?;
        let folder = Self { dir: dir.to_path_buf(), created, staged: Vec::new() };
        let probe = folder.dir.join(temporary_name("probe"));
        File::create(&probe).and_then(|_| fs::remove_file(&probe)).map_err(unusable)?;
        Ok(folder)
    }

    /// Creates a file; `name` may have folders in front, which are created.
    pub fn create(&mut self, name: &str) -> Result<File, Failure> {
        let place = self.dir.join(name);
        let parent = place.parent().unwrap_or(&self.dir);
        fs::create_dir_all(parent).map_err(|error| Failure::at(parent, error))?;
        let file_name = place.file_name().unwrap_or_default().to_string_lossy();
        let temporary = parent.join(temporary_name(&file_name));
        if let Ok(mut paths) = TEMPORARIES.lock() {
            paths.push(temporary.clone());
        }
        let file = File::create(&temporary).map_err(|error| Failure::at(&place, error));
        self.staged.push((temporary, place));
        file
    }

    /// Writes a whole file.
    pub fn write(&mut self, name: &str, content: impl AsRef<[u8]>) -> Result<(), Failure> {
        let mut file = self.create(name)?;
        file.write_all(content.as_ref()).map_err(|error| Failure::at(&self.dir.join(name), error))
    }

    /// The path that a file will have.
    pub fn place(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// The paths that all files will have.
    pub fn places(&self) -> impl Iterator<Item = &Path> {
        self.staged.iter().map(|(_, place)| place.as_path())
    }

    /// Puts all files in their places.
    pub fn commit(mut self) -> Result<(), Failure> {
        self.created = false;
        for (temporary, place) in std::mem::take(&mut self.staged) {
            fs::rename(&temporary, &place).map_err(|error| {
                drop(fs::remove_file(&temporary));
                Failure::at(&place, error)
            })?;
            forget(&temporary);
        }
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        for (temporary, _) in &self.staged {
            drop(fs::remove_file(temporary));
            forget(temporary);
        }
        if self.created {
            // Folders go only when they are empty.
            self.staged.iter().filter_map(|(_, place)| place.parent()).for_each(|inner| drop(fs::remove_dir(inner)));
            drop(fs::remove_dir(&self.dir));
        }
    }
}

fn temporary_name(name: &str) -> String {
    format!(".{name}.{}.tmp", process::id())
}

/// A file of its own, refused before anything is computed when its folder cannot be written to.
pub struct Single {
    folder: Folder,
    name: String,
}

impl Single {
    /// Opens or creates the file's folder.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let name = path.file_name().ok_or_else(|| Failure::usage(format!("{} is no file", path.display())))?;
        let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(Self { folder: Folder::open(dir)?, name: name.to_string_lossy().into_owned() })
    }

    /// Writes the file and puts it in its place.
    pub fn write(mut self, content: &str) -> Result<(), Failure> {
        self.folder.write(&self.name, content)?;
        self.folder.commit()
    }
}
