//! Process groups: a program that hpu starts, with all processes that the program starts.

use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{env, fmt, thread};

use crate::engines::fault::Fault;
use crate::system;

/// The time in which a program must end its jobs.
const PATIENCE: Duration = Duration::from_secs(1);

/// The process groups of the programs that are running and not reaped, so that their numbers are theirs.
struct Running {
    stopped: bool,
    groups: Vec<Number>,
}

/// The number of a group.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Number {
    id: u32,
    /// Whether the program has jobs in other groups, which it ends itself when it is asked to end.
    has_jobs: bool,
}

static RUNNING: Mutex<Running> = Mutex::new(Running { stopped: false, groups: Vec::new() });

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns whether the running programs are being stopped because this program is ending.
pub(crate) fn is_stopping() -> bool {
    running().stopped
}

/// Ends all running tools with all processes that they started. Afterwards no tool can be started, so the program must
/// be about to end.
pub fn stop_tools() {
    let mut running = running();
    running.stopped = true;
    let (with_jobs, others): (Vec<Number>, Vec<Number>) = running.groups.iter().partition(|group| group.has_jobs);
    others.iter().for_each(|group| system::kill(group.id));
    // GNU parallel starts no job any more when it is asked to end once, and ends its jobs when it is asked twice.
    for _ in 0..if with_jobs.is_empty() { 0 } else { 2 } {
        with_jobs.iter().for_each(|group| system::ask_to_end(group.id));
        thread::sleep(PATIENCE / 20);
    }
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE && with_jobs.iter().any(|group| system::goes_on(group.id)) {
        thread::sleep(PATIENCE / 100);
    }
    with_jobs.iter().for_each(|group| system::kill(group.id));
}

/// Returns the folders in which programs are looked for: those of the PATH that have an absolute path. Empty and
/// relative ones would name the current folder, whose files may be anybody's.
pub(crate) fn folders() -> Vec<PathBuf> {
    let path = env::var_os("PATH").unwrap_or_else(|| system::PATH.into());
    env::split_paths(&path).filter(|folder| folder.is_absolute()).collect()
}

/// Returns the PATH of a program that is started.
fn path() -> OsString {
    // A folder of a PATH has no separator.
    let path = env::join_paths(folders()).unwrap_or_default();
    if path.is_empty() { system::NOWHERE.into() } else { path }
}

/// A program with all processes that it starts. They are killed when this value is dropped, and when hpu is killed.
pub struct Group {
    pub(crate) child: Child,
    number: Number,
    entry: Option<system::Entry>,
}

impl fmt::Debug for Group {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "group {}", self.number.id)
    }
}

impl Group {
    /// Starts a program, which is looked for in the absolute folders of the PATH alone.
    ///
    /// # Errors
    ///
    /// The fault, when there is no such program, it cannot be started, or this program is ending.
    pub fn start(command: &mut Command) -> Result<Self, Fault> {
        Self::begin(command, false)
    }

    /// Starts a program as [`start`](Self::start) does, which has jobs in groups of their own: it is asked to end them
    /// when this program ends.
    ///
    /// # Errors
    ///
    /// As [`start`](Self::start).
    pub fn with_jobs(command: &mut Command) -> Result<Self, Fault> {
        Self::begin(command, true)
    }

    fn begin(command: &mut Command, has_jobs: bool) -> Result<Self, Fault> {
        command.env("PATH", path());
        let mut running = running();
        if running.stopped {
            return Err(Fault::Stopped);
        }
        let (child, entry) = system::start(command, has_jobs).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Fault::Missing,
            _ => Fault::NotStarted(error),
        })?;
        let number = Number { id: child.id(), has_jobs };
        running.groups.push(number);
        Ok(Self { child, number, entry })
    }

    /// Returns the status of the program once it has ended. The processes that it has left behind are killed then.
    ///
    /// # Errors
    ///
    /// When the system cannot tell.
    pub fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        // Of a process that is reaped, the system tells nothing any more; `wait` remembers its status.
        if matches!(system::has_ended(&mut self.child), Ok(false)) {
            return Ok(None);
        }
        self.release();
        self.child.wait().map(Some)
    }

    /// Kills the group, unless its first process may be reaped.
    pub(crate) fn release(&mut self) {
        let mut running = running();
        if let Some(at) = running.groups.iter().position(|group| *group == self.number) {
            system::kill(self.number.id);
            running.groups.swap_remove(at);
        }
        drop(running);
        self.entry = None;
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        self.release();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_a_group_is_forgotten_before_its_process_is_reaped() {
        let mut group = Group::start(Command::new("sh").args(["-c", "exit 3"])).expect("a shell");
        let number = group.number;
        while !system::has_ended(&mut group.child).expect("a child") {
            thread::sleep(Duration::from_millis(1));
        }
        // It has ended, and its number is still its own.
        let state = std::fs::read_to_string(format!("/proc/{}/stat", number.id)).expect("a process");
        assert!(state.contains(") Z ") && running().groups.contains(&number), "{state}");
        assert_eq!(group.ended().expect("a child").and_then(|status| status.code()), Some(3));
        assert!(!running().groups.contains(&number) && system::has_ended(&mut group.child).is_err());
        // Asked again, it tells the same, and nothing is signalled.
        assert_eq!(group.ended().expect("a child").and_then(|status| status.code()), Some(3));
    }
}
