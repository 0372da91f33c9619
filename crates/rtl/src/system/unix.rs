//! Linux and macOS.

use std::ffi::CString;
use std::fs::{self, DirBuilder, File, Metadata, OpenOptions, Permissions};
use std::io::{self, ErrorKind};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, AsRawFd, RawFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::{env, thread};

use signal_hook::consts::signal::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use signal_hook::iterator::Signals;

pub(crate) use super::lifeline::Entry;

/// Why no simulator, synthesis or solver is started on this system; `None` where they are.
pub(crate) const NO_TOOLS: Option<&str> = None;
/// The PATH of the system where there is none, as under `env -i`. Tools that start others need one.
pub(crate) const PATH: &str = "/usr/local/bin:/usr/bin:/bin";
/// A PATH on which nothing is found. The C library takes an empty one for the current folder.
pub(crate) const NOWHERE: &str = "/nonexistent";
/// The folder for temporary files where the environment names none.
pub(crate) const TEMPORARIES: &str = "/tmp";

/// The parent's end, or the simulator's end, of the stream between them.
pub(crate) type Stream = UnixStream;

/// Makes a stream to a program that will be started, which finds its end under this descriptor. Returns the parent's
/// end, and the other one, which is to be kept until the program has started.
///
/// # Errors
///
/// When the system has no more descriptors.
pub(crate) fn stream_to(command: &mut Command, descriptor: RawFd) -> io::Result<(Stream, Stream)> {
    let (ours, theirs) = UnixStream::pair()?;
    let made = theirs.as_raw_fd();
    let given = move || {
        // SAFETY: this runs between fork and exec, on descriptors that belong to this process.
        let done = unsafe {
            if made == descriptor { libc::fcntl(made, libc::F_SETFD, 0) } else { libc::dup2(made, descriptor) }
        };
        if done < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    };
    // SAFETY: `given` calls nothing but `dup2` or `fcntl`, which are safe between fork and exec.
    unsafe { command.pre_exec(given) };
    Ok((ours, theirs))
}

/// Starts a program in a process group of its own, which is killed when this process is killed. No other thread may be
/// inside this function. `has_jobs` says whether the program has jobs in other groups.
///
/// # Errors
///
/// When the program cannot be started.
pub(crate) fn start(command: &mut Command, has_jobs: bool) -> io::Result<(Child, Option<Entry>)> {
    command.process_group(0);
    super::lifeline::start(command, has_jobs)
}

/// Kills a process and its group, by the number of the process.
pub(crate) fn kill(id: u32) {
    signal(id, libc::SIGKILL);
}

/// Asks a process and its group to end.
pub(crate) fn ask_to_end(id: u32) {
    signal(id, libc::SIGTERM);
}

fn signal(id: u32, signal: i32) {
    // SAFETY: `kill` takes two numbers and touches no memory of ours.
    unsafe { libc::kill(-id.cast_signed(), signal) };
}

/// Returns whether a process has ended. It is left to be reaped, so that its number is not given to another process.
///
/// # Errors
///
/// When it was reaped.
pub(crate) fn has_ended(child: &mut Child) -> io::Result<bool> {
    waits(child.id())
}

/// Returns whether a child of this process has not ended, by its number.
pub(crate) fn goes_on(id: u32) -> bool {
    matches!(waits(id), Ok(false))
}

/// Returns whether a child of this process waits to be reaped.
fn waits(id: u32) -> io::Result<bool> {
    let mut info = MaybeUninit::<libc::siginfo_t>::zeroed();
    let options = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT;
    // SAFETY: `waitid` writes into `info`, which is plain data, and zero if nothing has ended.
    let done = unsafe { libc::waitid(libc::P_PID, id, info.as_mut_ptr(), options) };
    if done != 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: `info` was written, and its process is that of a child.
    Ok(unsafe { info.assume_init().si_pid() } != 0)
}

/// Returns the signal that killed a process.
pub fn killed_by(status: ExitStatus) -> Option<i32> {
    status.signal()
}

/// Returns the name of a signal behind its number, as messages have it.
pub(crate) fn signal_name(signal: i32) -> &'static str {
    match signal {
        libc::SIGHUP => " (SIGHUP)",
        libc::SIGINT => " (SIGINT)",
        libc::SIGILL => " (SIGILL)",
        libc::SIGABRT => " (SIGABRT)",
        libc::SIGBUS => " (SIGBUS)",
        libc::SIGFPE => " (SIGFPE)",
        libc::SIGKILL => " (SIGKILL)",
        libc::SIGSEGV => " (SIGSEGV)",
        libc::SIGPIPE => " (SIGPIPE)",
        libc::SIGTERM => " (SIGTERM)",
        libc::SIGXCPU => " (SIGXCPU)",
        _ => "",
    }
}

/// Calls a function in a thread of its own, with the number of each signal that asks this process to end: Ctrl-C
/// (SIGINT), SIGTERM, SIGHUP of a terminal that closes, and SIGQUIT. SIGHUP and SIGQUIT stay ignored where they were,
/// as behind `nohup`.
///
/// # Errors
///
/// When the system has no more descriptors or threads.
pub fn listen(mut heard: impl FnMut(i32) + Send + 'static) -> io::Result<()> {
    let ending = [SIGHUP, SIGQUIT].into_iter().filter(|signal| !is_ignored(*signal));
    let mut signals = Signals::new([SIGINT, SIGTERM].into_iter().chain(ending))?;
    let listens = move || signals.forever().for_each(&mut heard);
    thread::Builder::new().name("signals".to_string()).spawn(listens).map(drop)
}

/// Returns whether a signal is ignored.
fn is_ignored(signal: i32) -> bool {
    let mut old = MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: without a new action, `sigaction` only writes the present one, which is plain data.
    let (result, old) = unsafe { (libc::sigaction(signal, std::ptr::null(), old.as_mut_ptr()), old.assume_init()) };
    result == 0 && old.sa_sigaction == libc::SIG_IGN
}

/// Returns whether a write to stdout failed because the terminal behind it is gone. The same error on a disk is one.
pub fn is_hung_up(error: &io::Error) -> bool {
    let stdout = io::stdout().as_fd().try_clone_to_owned().and_then(|stdout| File::from(stdout).metadata());
    error.raw_os_error() == Some(libc::EIO) && stdout.is_ok_and(|stdout| stdout.file_type().is_char_device())
}

/// Returns whether a terminal of this system obeys escape sequences for colours and lines.
pub fn obeys_escapes() -> bool {
    env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Returns the folder of the user's caches; `None` where the environment names none by an absolute path.
pub fn caches() -> Option<PathBuf> {
    // A relative path would be a place in the current folder.
    let set = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))
}

/// Returns the bytes that are free for this user on the disk of a folder; `None` where the system does not tell.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let disk = nix::sys::statvfs::statvfs(folder).ok()?;
    #[allow(clippy::useless_conversion, reason = "on some systems these are of 32 bits")]
    Some(u64::from(disk.blocks_available()).saturating_mul(u64::from(disk.fragment_size())))
}

/// Opens a file or a folder for reading without waiting, because a FIFO has no end, and without following a link.
///
/// # Errors
///
/// When it cannot be opened.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK).open(path)
}

/// Returns whether two entries are the same one of a disk.
pub(crate) fn is_same(one: &Metadata, other: &Metadata) -> bool {
    one.ino() == other.ino()
}

/// Returns whether an entry is this user's.
pub(crate) fn is_ours(found: &Metadata) -> bool {
    // SAFETY: `geteuid` cannot fail.
    found.uid() == unsafe { libc::geteuid() }
}

/// Returns whether an entry is this user's or the administrator's, and nobody else can write to it. The user's own
/// group may, where it has no other member by the habit of the system (a umask of 002).
pub(crate) fn is_trusted(found: &Metadata) -> bool {
    // SAFETY: `getegid` cannot fail.
    let is_own_group = found.gid() == unsafe { libc::getegid() };
    let is_closed = found.mode() & 0o002 == 0 && (found.mode() & 0o020 == 0 || is_own_group);
    (is_ours(found) || found.uid() == 0) && is_closed
}

/// Waits until the entries of a folder are on the disk.
///
/// # Errors
///
/// When the folder cannot be opened, or the disk fails.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Returns how folders are made that no other user can look into.
pub(crate) fn private_folders() -> DirBuilder {
    let mut builder = DirBuilder::new();
    builder.mode(0o700);
    builder
}

/// Tries whether the file system lets a file of this user run as a program.
///
/// # Errors
///
/// When it does not, as one that is mounted with `noexec`.
pub(crate) fn may_run(file: &Path) -> io::Result<()> {
    fs::set_permissions(file, Permissions::from_mode(0o700))?;
    let path = CString::new(file.as_os_str().as_bytes()).map_err(|_| ErrorKind::InvalidInput)?;
    // SAFETY: `path` is a text that ends with a zero.
    if unsafe { libc::access(path.as_ptr(), libc::X_OK) } == 0 {
        return Ok(());
    }
    let error = io::Error::last_os_error();
    let said = format!("its file system lets no program run ({error})");
    Err(if error.kind() == ErrorKind::PermissionDenied { io::Error::new(error.kind(), said) } else { error })
}
