//! The text of a scene, found by the path of its file or by its shipped name.

use std::io::{self, ErrorKind};
use std::path::{self, Component, Path, PathBuf, Prefix, is_separator};

use crate::experiment::Experiment;
use crate::experiment::devices::shipped;
use crate::experiment::shipped::shipped_file;
use crate::files::{read_plain, read_text};
use crate::head::shipped::Shipped;
use crate::schema::source::SceneError;
use crate::text::message::did_you_mean;

/// The text of a scene, and the place of the data files that it names.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SceneFile {
    /// The name of the file in errors.
    pub name: String,
    /// Its text.
    pub text: String,
    /// The directory of its data files.
    pub data: PathBuf,
    /// Whether the scene is a shipped one, whose data files are shipped too.
    pub is_shipped: bool,
}

impl SceneFile {
    /// Finds a scene by the path of its file, which has a folder or ends in `.toml`, or by its shipped name.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with the file's name when it cannot be read, or with the shipped names when there is no such
    /// scene.
    pub fn find(scene: &str) -> Result<Self, SceneError> {
        let is_path = scene.contains(is_separator) || scene.ends_with(".toml");
        if let (false, Some(Shipped { name, text })) = (is_path, shipped().iter().find(|shipped| shipped.name == scene))
        {
            let name = format!("testbench/scenes/{name}.toml");
            return Ok(Self { name, text: (*text).to_string(), data: PathBuf::from("."), is_shipped: true });
        }
        let path = Path::new(scene);
        if !is_path && !path.exists() {
            let names: Vec<_> = shipped().iter().map(|shipped| shipped.name).collect();
            let reason =
                format!("neither a file nor one of the shipped {}{}", names.join(", "), did_you_mean(scene, &names));
            return Err(SceneError::at(format!("no scene `{scene}`"), reason));
        }
        let text = read_text(path)?;
        let data = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Self { name: scene.to_string(), text, data, is_shipped: false })
    }

    /// Parses the scene with these overrides, as [`Experiment::parse`] does.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Experiment, SceneError> {
        Experiment::parse(&self.name, &self.text, overrides, &mut |file: &str| self.load(file))
    }

    /// Parses the scene with these overrides for its plant, as [`Experiment::plant`] does.
    ///
    /// # Errors
    ///
    /// As [`parse`](Self::parse).
    pub fn plant(&self, overrides: &[(String, String)]) -> Result<Experiment, SceneError> {
        Experiment::plant(&self.name, &self.text, overrides, &mut |file: &str| self.load(file))
    }

    /// Reads a data file that the scene names: of a shipped scene the shipped one, else one where the command runs.
    ///
    /// # Errors
    ///
    /// As [`std::fs::read`]; also when it is no ordinary file, or larger than 256 MiB, and on Windows when its name is
    /// that of a device or of a place on another machine.
    pub fn load(&self, file: &str) -> io::Result<Vec<u8>> {
        let read = || read_plain(&on_a_disk(&self.data, file)?);
        // A file of the same name where the command runs is another file.
        if self.is_shipped { shipped_file(file).or_else(|_| read()) } else { read() }
    }
}

/// Returns the path of a file that a scene in this folder names.
///
/// On Windows a name may be that of a device, as `NUL`, or lead to another machine, which would be told who the user
/// is. Such a file is refused, unless the scene itself is on that machine.
fn on_a_disk(folder: &Path, file: &str) -> io::Result<PathBuf> {
    let path = folder.join(file);
    let elsewhere = |path: &Path| match path::absolute(path).ok()?.components().next()? {
        Component::Prefix(prefix) if !matches!(prefix.kind(), Prefix::Disk(_) | Prefix::VerbatimDisk(_)) => {
            Some(prefix.as_os_str().to_owned())
        }
        _ => None,
    };
    match elsewhere(&path) {
        place if place.is_some() && place != elsewhere(&folder.join("scene.toml")) => {
            Err(io::Error::new(ErrorKind::InvalidInput, "not on a disk of this machine; copy it beside the scene"))
        }
        _ => Ok(path),
    }
}
