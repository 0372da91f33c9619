//! Windows. The functions have the contracts of their namesakes in `unix.rs`; what differs is said here.

use std::env;
use std::fs::{DirBuilder, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind};
use std::net::TcpStream;
use std::os::windows::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

/// Why no simulator, synthesis or solver is started on this system.
pub(crate) const NO_TOOLS: Option<&str> =
    Some("hpu starts simulators, synthesis and solvers on Linux and macOS, and none on Windows");
/// The PATH of the system where there is none.
pub(crate) const PATH: &str = "C:\\Windows\\System32";
/// A PATH on which nothing is found.
pub(crate) const NOWHERE: &str = "C:\\nonexistent";
/// The folder for temporary files where the environment names none.
pub(crate) const TEMPORARIES: &str = "C:\\Windows\\Temp";

/// The flag by which a folder is opened like a file, `FILE_FLAG_BACKUP_SEMANTICS`.
const OPENS_FOLDERS: u32 = 0x0200_0000;
/// The flag by which a link is opened itself, `FILE_FLAG_OPEN_REPARSE_POINT`.
const FOLLOWS_NO_LINK: u32 = 0x0020_0000;
/// The number of the signal of Ctrl-C.
const INTERRUPT: i32 = 2;

/// The place of a program in a list of those to be killed with this process. There is no such list here: a program that
/// this process starts outlives it when it is killed.
pub(crate) enum Entry {}

/// The type of a stream to a simulator, of which there is none.
pub(crate) type Stream = TcpStream;

/// Refuses a stream to a simulator.
pub(crate) fn stream_to(_: &mut Command, _: i32) -> io::Result<(Stream, Stream)> {
    Err(io::Error::new(ErrorKind::Unsupported, NO_TOOLS.unwrap_or_default()))
}

/// Starts a program. It has no group.
pub(crate) fn start(command: &mut Command, _has_jobs: bool) -> io::Result<(Child, Option<Entry>)> {
    Ok((command.spawn()?, None))
}

/// Kills a process with those that it has started, by the system's `taskkill`. The number of a process is its own until
/// its [`Child`] is dropped.
pub(crate) fn kill(id: u32) {
    let system = env::var_os("SystemRoot").map_or_else(|| PathBuf::from("C:\\Windows"), PathBuf::from);
    let mut command = Command::new(system.join("System32").join("taskkill.exe"));
    command.args(["/F", "/T", "/PID", &id.to_string()]);
    let _ = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
}

/// Does nothing: a process can only be killed here.
pub(crate) fn ask_to_end(_: u32) {}

/// Returns whether a process has ended.
pub(crate) fn has_ended(child: &mut Child) -> io::Result<bool> {
    child.try_wait().map(|status| status.is_some())
}

/// Returns false: nobody waits for a process that was asked to end, because none can be asked.
pub(crate) fn goes_on(_: u32) -> bool {
    false
}

/// Returns the signal that killed a process: none, because Windows has exit codes alone.
pub fn killed_by(_: ExitStatus) -> Option<i32> {
    None
}

/// Returns the name of a signal.
pub(crate) fn signal_name(_: i32) -> &'static str {
    ""
}

/// Calls a function at each Ctrl-C, with the number that the signal has on the other systems.
pub fn listen(mut heard: impl FnMut(i32) + Send + 'static) -> io::Result<()> {
    ctrlc::set_handler(move || heard(INTERRUPT)).map_err(io::Error::other)
}

/// Returns false: a closed console is a broken pipe.
pub fn is_hung_up(_: &io::Error) -> bool {
    false
}

/// Returns whether the terminal says by its environment that it obeys escape sequences. A console of its own obeys them
/// only once it is told to.
pub fn obeys_escapes() -> bool {
    ["WT_SESSION", "TERM"].iter().any(|name| env::var_os(name).is_some_and(|set| set != "dumb"))
}

/// Returns the folder of the user's caches.
pub fn caches() -> Option<PathBuf> {
    ["XDG_CACHE_HOME", "LOCALAPPDATA"]
        .iter()
        .find_map(|name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute()))
}

/// Returns `None`: nothing here asks the system.
pub fn free_bytes(_: &Path) -> Option<u64> {
    None
}

/// Opens a file or a folder for reading without following a link.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).custom_flags(OPENS_FOLDERS | FOLLOWS_NO_LINK).open(path)
}

/// Returns whether two entries were made at the same time. The numbers of files are not in stable Rust.
pub(crate) fn is_same(one: &Metadata, other: &Metadata) -> bool {
    one.created().ok() == other.created().ok()
}

/// Returns true: the folders for temporary files and caches are in the user's profile, which is closed to others.
pub(crate) fn is_ours(_: &Metadata) -> bool {
    true
}

/// Returns true, as [`is_ours`].
pub(crate) fn is_trusted(_: &Metadata) -> bool {
    true
}

/// Does nothing: a folder cannot be opened to be written out, and the file system's own journal keeps its entries.
pub fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Returns how folders are made. They inherit the rights of the user's profile.
pub(crate) fn private_folders() -> DirBuilder {
    DirBuilder::new()
}

/// Returns that a file may run: by its name and not by a right.
pub(crate) fn may_run(_: &Path) -> io::Result<()> {
    Ok(())
}
