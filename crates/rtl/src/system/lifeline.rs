//! Kills the programs that hpu has started when hpu itself is killed, as by SIGKILL or for want of memory.
//!
//! A shell stands by, and knows the process groups of the programs that run. The other end of its input is in this
//! process alone: when the process ends, in whatever way, the shell reads the end of its input, kills the groups that
//! are left, and ends. A program tells its own group before it begins (between fork and exec), so that none is missed.
//! A program that has jobs in other groups, as GNU parallel, is asked to end them first. The death signal of Linux
//! (`PR_SET_PDEATHSIG`) would not do: it reaches no process that the program starts, and comes when the thread that
//! started the program ends.
//!
//! A process that is forked from this one without an exec, as by Python's `os.fork`, closes its copy of the stream: it
//! would keep the shell waiting. Its own programs get a shell of their own.

use std::cell::Cell;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::Once;
use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};

/// The script of the shell. It reads `+ NUMBER GROUP`, `+ NUMBER GROUP:jobs` and `- NUMBER`, and stays alive where a
/// terminal or a scheduler signals the whole session. The shell that is waited for leaves it behind: it is nobody's
/// child. GNU parallel ends its jobs when it is asked to end twice, as in [`stop_tools`](crate::stop_tools).
const SCRIPT: &str = r#"trap '' HUP INT QUIT TERM
exec 3<&0
{
  all=' '
  while read -r sign number group; do
    case $sign in
    +) all="$all$number:$group " ;;
    -) case $all in *" $number:"*) rest=${all#*" $number:"}; all="${all%%" $number:"*} ${rest#* }" ;; esac ;;
    esac
  done
  for entry in $all; do
    group=${entry#*:}
    case $group in *:jobs)
      group=${group%:jobs}
      for turn in 1 2; do kill -s TERM -- "-$group"; sleep 0.05; done
      while [ "$turn" -lt 40 ] && kill -s 0 -- "-$group"; do sleep 0.05; turn=$((turn + 1)); done
    esac
    kill -s KILL -- "-$group"
  done
} <&3 3<&- >/dev/null 2>&1 &"#;

/// The least descriptor of the stream. A program is given streams under small numbers ([`hpu_vhpi::DESCRIPTOR`]) before
/// it enters the list, and none of them may take the place of this one.
const LEAST_DESCRIPTOR: RawFd = 64;

/// The descriptor of the stream; [`CLOSED`] before the first program, and in a process that was forked.
static STREAM: AtomicI32 = AtomicI32::new(CLOSED);
const CLOSED: RawFd = -1;

thread_local! {
    /// Whether this thread starts a program: what is forked then is the program before its exec.
    static STARTS: Cell<bool> = const { Cell::new(false) };
}

/// The place of a program in the shell's list. The program leaves the list when this value is dropped.
pub(crate) struct Entry(u64);

/// Starts a program, which enters the shell's list before it begins; without an entry where no shell can be started.
/// No other thread may be inside this function.
///
/// # Errors
///
/// When the program cannot be started.
pub(crate) fn start(command: &mut Command, has_jobs: bool) -> io::Result<(Child, Option<Entry>)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    if STREAM.load(Ordering::Relaxed) == CLOSED
        && let Ok(stream) = begin()
    {
        STREAM.store(stream, Ordering::Relaxed);
    }
    let descriptor = STREAM.load(Ordering::Relaxed);
    let mut entry = None;
    if descriptor != CLOSED {
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let enters = move || {
            tell(number, descriptor, has_jobs);
            Ok(())
        };
        // SAFETY: the function calls only what is safe between fork and exec. The group of the program is made before.
        unsafe { command.pre_exec(enters) };
        entry = Some(Entry(number));
    }
    STARTS.set(true);
    let child = command.spawn();
    STARTS.set(false);
    Ok((child?, entry))
}

/// Starts the shell, and returns the descriptor of the stream to it.
fn begin() -> io::Result<RawFd> {
    static FORKS: Once = Once::new();
    // SAFETY: `close_stream` calls only what is safe in a process that was just forked.
    FORKS.call_once(|| _ = unsafe { libc::pthread_atfork(None, None, Some(close_stream)) });
    let (ours, theirs) = UnixStream::pair()?;
    let mut shell = Command::new("/bin/sh");
    shell.args(["-c", SCRIPT, "lifeline"]).stdin(OwnedFd::from(theirs)).stdout(Stdio::null()).stderr(Stdio::null());
    // Its surroundings are not the user's, so that it holds no folder.
    let status = shell.env_clear().current_dir("/").process_group(0).status()?;
    if !status.success() {
        return Err(io::Error::other("no shell"));
    }
    // SAFETY: the descriptor is that of `ours`, which lives.
    match unsafe { libc::fcntl(ours.as_raw_fd(), libc::F_DUPFD_CLOEXEC, LEAST_DESCRIPTOR) } {
        copy if copy >= 0 => Ok(copy),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Closes the stream in a process that was forked, unless it is a program before its exec.
extern "C" fn close_stream() {
    if !STARTS.get() {
        // SAFETY: the descriptor is this module's own. Of a stream that is closed already, the call fails.
        unsafe { libc::close(STREAM.swap(CLOSED, Ordering::Relaxed)) };
    }
}

/// Writes the line of this process. Only functions that are safe between fork and exec are called, and nothing is
/// allocated.
fn tell(number: u64, descriptor: RawFd, has_jobs: bool) {
    // SAFETY: `getpid` cannot fail.
    let group = unsafe { libc::getpid() }.unsigned_abs();
    let mut line = [0; 64];
    let mut rest = &mut line[..];
    // The line has at most 38 bytes.
    let _ = writeln!(rest, "+ {number} {group}{}", if has_jobs { ":jobs" } else { "" });
    let length = 64 - rest.len();
    // SAFETY: the bytes outlive the call. Where the shell is gone, the write fails instead of killing this process.
    // Then the default holds again.
    unsafe {
        libc::signal(libc::SIGPIPE, libc::SIG_IGN);
        libc::write(descriptor, line.as_ptr().cast(), length);
        libc::signal(libc::SIGPIPE, libc::SIG_DFL);
    }
}

impl Drop for Entry {
    fn drop(&mut self) {
        let line = format!("- {}\n", self.0);
        // Where the shell is gone, there is no list, and no signal is wanted.
        // SAFETY: the bytes outlive the call, which fails where the stream is closed.
        unsafe {
            let stream = STREAM.load(Ordering::Relaxed);
            libc::send(stream, line.as_ptr().cast(), line.len(), libc::MSG_NOSIGNAL);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_stream_that_a_program_is_given_takes_the_place_of_its_entry() {
        let mut group = crate::Group::start(&mut Command::new("true")).expect("a program");
        while group.ended().expect("a child").is_none() {}
        let stream = STREAM.load(Ordering::Relaxed);
        assert!(stream >= LEAST_DESCRIPTOR && LEAST_DESCRIPTOR > hpu_vhpi::DESCRIPTOR);
    }
}
