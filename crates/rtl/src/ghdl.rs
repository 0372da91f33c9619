//! GHDL: finding it, analysing sources into a work directory, running a testbench.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::{fs, io};

/// Why VHDL could not be run.
#[derive(Debug)]
pub enum GhdlError {
    /// There is no `ghdl` on the PATH.
    Missing,
    /// The emulator's shared library is in none of these places.
    NoLibrary(Vec<PathBuf>),
    /// A file could not be read or written.
    Io(PathBuf, io::Error),
    /// GHDL refused or stopped.
    Failed {
        /// What it was asked to do.
        step: String,
        /// What it said.
        said: String,
    },
}

impl fmt::Display for GhdlError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Missing => write!(f, "`ghdl` is not installed; on Debian: apt install ghdl-mcode"),
            Self::NoLibrary(places) => {
                let places: Vec<_> = places.iter().map(|place| place.display().to_string()).collect();
                write!(f, "no {}; `cargo build` leaves the library beside the program", places.join(", no "))
            }
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Failed { step, said } => write!(f, "ghdl could not {step}:\n{}", said.trim_end()),
        }
    }
}

impl std::error::Error for GhdlError {}

/// A work directory with analysed VHDL, removed when dropped.
#[derive(Debug)]
pub struct Library {
    dir: PathBuf,
}

/// Arguments of every GHDL command. Wirings have a net `step` beside an instance that has a port of that name, and so on.
const COMMON: [&str; 2] = ["--std=08", "-Wno-hide"];

impl Library {
    /// Analyses, in this order, packages from text (written into the work directory), the user's files where they are,
    /// and testbenches from text.
    ///
    /// # Errors
    ///
    /// [`GhdlError`], [`Missing`](GhdlError::Missing) first of all.
    pub fn analyse(
        packages: &[(String, String)],
        files: &[PathBuf],
        testbenches: &[(String, String)],
    ) -> Result<Self, GhdlError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let dir = std::env::temp_dir().join(format!("hpu-ghdl-{}-{count}", std::process::id()));
        fs::create_dir_all(&dir).map_err(|error| GhdlError::Io(dir.clone(), error))?;
        let library = Self { dir };
        let mut command = library.command("-a");
        for (name, text) in packages {
            library.write(name, text)?;
            command.arg(name);
        }
        for file in files {
            command.arg(fs::canonicalize(file).map_err(|error| GhdlError::Io(file.clone(), error))?);
        }
        for (name, text) in testbenches {
            library.write(name, text)?;
            command.arg(name);
        }
        output(command, || "analyse the VHDL".to_string())?;
        Ok(library)
    }

    /// The work directory, where the simulation runs.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Writes a file into the work directory.
    ///
    /// # Errors
    ///
    /// [`GhdlError::Io`].
    pub fn write(&self, name: &str, text: &str) -> Result<(), GhdlError> {
        let path = self.dir.join(name);
        fs::write(&path, text).map_err(|error| GhdlError::Io(path, error))
    }

    /// Removes a file from the work directory.
    ///
    /// # Errors
    ///
    /// [`GhdlError::Io`].
    pub fn remove(&self, name: &str) -> Result<(), GhdlError> {
        let path = self.dir.join(name);
        fs::remove_file(&path).map_err(|error| GhdlError::Io(path, error))
    }

    /// Elaborates and runs a unit; what it wrote to its standard output.
    ///
    /// # Errors
    ///
    /// [`GhdlError::Failed`] with everything GHDL said when the run ends with a failure.
    pub fn run(
        &self,
        unit: &str,
        generics: &[(&str, String)],
        environment: &[(&str, String)],
    ) -> Result<String, GhdlError> {
        let mut command = self.command("--elab-run");
        command.arg(unit);
        // Words are unknown before the first edge; the comparison sees that, a warning a row does not help.
        command.arg("--ieee-asserts=disable");
        command.args(generics.iter().map(|(name, value)| format!("-g{name}={value}")));
        command.envs(environment.iter().map(|(name, value)| (name, value)));
        output(command, || format!("run {unit}"))
    }

    fn command(&self, verb: &str) -> Command {
        let mut command = Command::new("ghdl");
        command.arg(verb).args(COMMON).current_dir(&self.dir);
        command
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        // Nobody waits for the answer; the directory is in the system's temporary place anyway.
        let _ = fs::remove_dir_all(&self.dir);
    }
}

fn output(mut command: Command, step: impl Fn() -> String) -> Result<String, GhdlError> {
    let output = command.output().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => GhdlError::Missing,
        _ => GhdlError::Io(PathBuf::from("ghdl"), error),
    })?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if output.status.success() {
        return Ok(said);
    }
    let said = format!("{}{said}", String::from_utf8_lossy(&output.stderr));
    Err(GhdlError::Failed { step: step(), said })
}
