//! Files that appear whole or not at all: they are written beside their place under a temporary name, then renamed
//! together. A name that a file gets is checked here, whoever gives it: it stays within the folder.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use hpu_chart::Picture;
use hpu_cosim::{NotPlain, PlainName, excerpt};
use hpu_rtl::temporary::{self, Temporary, sweep_files};

use crate::shell::exit::Failure;

/// A folder for files. They are removed unless they are committed.
pub struct Folder {
    dir: PathBuf,
    created: bool,
    /// Temporary files and their places.
    staged: Vec<(Temporary, PathBuf)>,
}

impl Folder {
    /// Opens or creates a folder, and removes the half-written files that killed processes have left in it. A folder
    /// that cannot be written to is refused here, before anything is computed.
    pub fn open(dir: &Path) -> Result<Self, Failure> {
        let created = !dir.exists();
        let unusable = |error| Failure::usage(format!("cannot write to {}: {error}", dir.display()));
        fs::create_dir_all(dir).map_err(unusable)?;
        sweep_files(dir);
        let folder = Self { dir: dir.to_path_buf(), created, staged: Vec::new() };
        Temporary::file(&folder.dir, "probe").map_err(unusable)?;
        Ok(folder)
    }

    /// Creates a file. `name` may have folders in front, which are created. Each part of it must be a plain name.
    pub fn create(&mut self, name: &str) -> Result<File, Failure> {
        for part in name.split('/') {
            if !PlainName::begins(part) {
                return Err(Failure::usage(format!("`{}` is {NotPlain}", excerpt(name))));
            }
        }
        self.stage(self.dir.join(name))
    }

    /// Creates a file at a place in the folder.
    fn stage(&mut self, place: PathBuf) -> Result<File, Failure> {
        let parent = place.parent().unwrap_or(&self.dir).to_path_buf();
        let parent = parent.as_path();
        fs::create_dir_all(parent).map_err(|error| Failure::at(parent, error))?;
        if parent != self.dir && self.staged.iter().all(|(_, staged)| staged.parent() != Some(parent)) {
            sweep_files(parent);
        }
        let file_name = place.file_name().unwrap_or_default().to_string_lossy();
        let temporary = Temporary::file(parent, &file_name).map_err(|error| Failure::at(&place, error))?;
        let file = temporary.open().map_err(|error| Failure::at(&place, error))?;
        self.staged.push((temporary, place));
        Ok(file)
    }

    /// Writes a whole file.
    pub fn write(&mut self, name: &str, content: impl AsRef<[u8]>) -> Result<(), Failure> {
        let mut file = self.create(name)?;
        file.write_all(content.as_ref()).map_err(|error| Failure::at(&self.dir.join(name), error))
    }

    /// Writes a picture as SVG and as PNG.
    pub fn draw(&mut self, Picture { name, svg, png, .. }: &Picture) -> Result<(), Failure> {
        self.write(&format!("{name}.svg"), svg)?;
        self.write(&format!("{name}.png"), png)
    }

    /// Returns the path that a file will have.
    pub fn place(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Returns the paths that all files will have.
    pub fn places(&self) -> impl Iterator<Item = &Path> {
        self.staged.iter().map(|(_, place)| place.as_path())
    }

    /// Puts all files in their places, which are returned.
    pub fn commit(mut self) -> Result<Vec<PathBuf>, Failure> {
        self.created = false;
        let places = self.places().map(PathBuf::from).collect();
        temporary::place(std::mem::take(&mut self.staged)).map_err(|(place, error)| Failure::at(&place, error))?;
        Ok(places)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let mut inner: Vec<_> = self.staged.iter().filter_map(|(_, place)| place.parent().map(PathBuf::from)).collect();
        self.staged.clear();
        if self.created {
            // Only empty folders are removed.
            inner.push(self.dir.clone());
            inner.iter().for_each(|dir| drop(fs::remove_dir(dir)));
        }
    }
}

/// Returns the lines that tell files, one a line.
pub fn file_lines(files: &[PathBuf]) -> String {
    files.iter().map(|place| format!("file       {}\n", place.display())).collect()
}

/// Refuses a link in the place of a file or folder that is written to where it stands: in a folder of somebody else it
/// may lead anywhere.
pub(crate) fn not_a_link(place: &Path) -> Result<(), Failure> {
    match fs::symlink_metadata(place) {
        Ok(found) if found.is_symlink() => Err(Failure::at(place, "is a link; remove it, or choose another folder")),
        _ => Ok(()),
    }
}

/// A single file, which the command line names. It is refused before anything is computed when its folder cannot be
/// written to.
pub(crate) struct Single {
    folder: Folder,
    place: PathBuf,
}

impl Single {
    /// Opens or creates the file's folder.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let name = path.file_name().ok_or_else(|| Failure::usage(format!("{} is no file", path.display())))?;
        let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(Self { folder: Folder::open(dir)?, place: dir.join(name) })
    }

    /// Writes the file and puts it in its place.
    pub fn write(mut self, content: impl AsRef<[u8]>) -> Result<(), Failure> {
        let mut file = self.folder.stage(self.place.clone())?;
        file.write_all(content.as_ref()).map_err(|error| Failure::at(&self.place, error))?;
        self.folder.commit().map(drop)
    }
}
