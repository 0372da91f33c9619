//! GHDL: analyses sources into a work directory, and runs testbenches.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

use crate::engines::error::Error;
use crate::engines::hdl::{Hdl, Setup};
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Fault, TIMEOUT, Tool, ToolError, run};

/// A work directory with analysed VHDL, removed when dropped.
#[derive(Debug)]
pub struct Library {
    dir: Temporary,
    timeout: Option<Duration>,
    /// The units that are elaborated.
    elaborated: Mutex<Vec<String>>,
}

/// Returns whether elaboration writes a program, which runs start. GHDL's mcode back end writes none: each run
/// elaborates for itself, and elaboration alone would be done for nothing. GHDL is asked for at most the time `limit`.
pub(crate) fn writes_programs(limit: Duration) -> bool {
    static KNOWN: OnceLock<bool> = OnceLock::new();
    *KNOWN.get_or_init(|| {
        let mut command = Tool::Ghdl.command();
        command.arg("--version");
        let said = run(Tool::Ghdl, "tell its back end", command, limit);
        said.map_or(true, |said| !said.out.contains("mcode code generator"))
    })
}

/// Arguments of every GHDL command. `-Wno-hide`: wirings have, for example, a net `step` beside an instance with a port
/// of that name.
const COMMON: [&str; 2] = ["--std=08", "-Wno-hide"];

impl Library {
    /// Analyses these units in this order: packages from text (written into the work directory), blocks by name (read
    /// in place, if they are in a folder), and testbenches from text.
    ///
    /// # Errors
    ///
    /// [`Error`]; a missing GHDL is reported first.
    pub fn analyse<'n>(
        packages: &[(String, String)],
        setup: &Setup,
        blocks: impl IntoIterator<Item = &'n str>,
        testbenches: &[(String, String)],
    ) -> Result<Self, Error> {
        let dir = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        let library = Self { dir, timeout: setup.timeout, elaborated: Mutex::default() };
        let mut command = library.command("-a");
        // Without optimisation LLVM's back end takes half the time, and simulations take as long.
        command.arg("-O0");
        for (name, text) in packages {
            library.write(name, text)?;
            command.arg(name);
        }
        for block in blocks {
            let file = setup.hdl.file(block);
            match &setup.hdl {
                Hdl::Folder(_) => {
                    command.arg(fs::canonicalize(&file).map_err(|error| Error::io(file, error))?);
                }
                Hdl::Carried => {
                    library.write(&file, setup.hdl.text(block)?.as_bytes())?;
                    command.arg(file);
                }
            }
        }
        for (name, text) in testbenches {
            library.write(name, text)?;
            command.arg(name);
        }
        run(Tool::Ghdl, "analyse the VHDL", command, library.limit(Duration::ZERO)).map_err(Error::of_ghdl)?;
        Ok(library)
    }

    /// Returns the work directory, in which the simulation runs.
    pub fn dir(&self) -> &Path {
        self.dir.path()
    }

    /// Returns the time limit of a tool that has work for the time `work`.
    pub(crate) fn limit(&self, work: Duration) -> Duration {
        self.timeout.unwrap_or(TIMEOUT.max(work))
    }

    /// Writes a file into the work directory.
    ///
    /// # Errors
    ///
    /// [`Error`] of the file.
    pub fn write(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) -> Result<(), Error> {
        let path = self.dir().join(name);
        fs::write(&path, content).map_err(|error| Error::io(path, error))
    }

    /// Removes a file from the work directory.
    ///
    /// # Errors
    ///
    /// [`Error`] of the file.
    pub fn remove(&self, name: &str) -> Result<(), Error> {
        let path = self.dir().join(name);
        fs::remove_file(&path).map_err(|error| Error::io(path, error))
    }

    /// Elaborates a unit, unless that is done. Where a back end [writes a program](writes_programs), it then runs as
    /// often, and as often at a time, as it is wanted.
    ///
    /// # Errors
    ///
    /// [`Error`] with GHDL's message.
    pub(crate) fn elaborate(&self, unit: &str) -> Result<(), Error> {
        let mut elaborated = self.elaborated.lock().unwrap_or_else(PoisonError::into_inner);
        if !elaborated.iter().any(|other| other == unit) {
            let mut command = self.command("-e");
            command.arg(unit);
            let said = run(Tool::Ghdl, &format!("elaborate {unit}"), command, self.limit(Duration::ZERO));
            said.map_err(Error::of_ghdl)?;
            elaborated.push(unit.to_string());
        }
        Ok(())
    }

    /// Elaborates and runs a unit whose run takes `work` at the most. Returns its standard output.
    ///
    /// # Errors
    ///
    /// [`Error`] with GHDL's message when the run ends with a failure.
    pub fn run(
        &self,
        unit: &str,
        generics: &[(&str, String)],
        environment: &[(&str, String)],
        work: Duration,
    ) -> Result<String, Error> {
        if writes_programs(self.limit(Duration::ZERO)) {
            self.elaborate(unit)?;
        }
        let mut command = self.command("-r");
        command.arg(unit);
        // Words are unknown before the first edge. The comparison sees that; a warning for each row would not help.
        command.arg("--ieee-asserts=disable");
        command.args(generics.iter().map(|(name, value)| format!("-g{name}={value}")));
        command.envs(environment.iter().map(|(name, value)| (name, value)));
        let said = run(Tool::Ghdl, &format!("run {unit}"), command, self.limit(work)).map_err(Error::of_ghdl)?;
        // A failure ends the run, and the bench prints its result otherwise. A simulator that prints nothing at all has
        // not run.
        if said.out.trim().is_empty() {
            let fault = Fault::Silent("result");
            return Err(ToolError::new(Tool::Ghdl, &format!("run {unit}"), fault, &said.err).into());
        }
        Ok(said.out)
    }

    fn command(&self, verb: &str) -> Command {
        let mut command = Command::new(Tool::Ghdl.name());
        command.arg(verb).args(COMMON).current_dir(self.dir());
        command
    }
}
