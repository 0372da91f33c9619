//! Kills the programs that hpu has started when hpu itself is killed, as by SIGKILL or for want of memory.
//!
//! A shell stands by, and knows the process groups of the programs that run. The other end of its input is in this
//! process alone: when the process ends, in whatever way, the shell reads the end of its input, kills the groups that
//! are left, and ends. A program tells its own group before it begins (between fork and exec), so that none is missed.
//! The death signal of Linux (`PR_SET_PDEATHSIG`) would not do: it reaches no process that the program starts, and
//! comes when the thread that started the program ends.

use std::io::{self, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The script of the shell. It reads `+ NUMBER GROUP` and `- NUMBER`, and stays alive where a terminal or a scheduler
/// signals the whole session. The shell that is waited for leaves it behind: it is nobody's child.
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
  for group in $all; do kill -s KILL -- "-${group#*:}"; done
} <&3 3<&- >/dev/null 2>&1 &"#;

/// The least descriptor of the stream. A program is given streams under small numbers ([`hpu_vhpi::DESCRIPTOR`]) before
/// it enters the list, and none of them may take the place of this one.
const LEAST_DESCRIPTOR: RawFd = 64;

/// The place of a program in the shell's list. The program leaves the list when this value is dropped.
pub(crate) struct Entry {
    number: u64,
    stream: &'static UnixStream,
}

/// Returns an entry for a program; `None` where no shell can be started.
pub(crate) fn entry() -> Option<Entry> {
    static STREAM: OnceLock<Option<UnixStream>> = OnceLock::new();
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let stream = STREAM.get_or_init(|| begin().ok()).as_ref()?;
    Some(Entry { number: COUNT.fetch_add(1, Ordering::Relaxed), stream })
}

fn begin() -> io::Result<UnixStream> {
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
        // SAFETY: the descriptor is new, and nobody else's.
        copy if copy >= 0 => Ok(unsafe { UnixStream::from_raw_fd(copy) }),
        _ => Err(io::Error::last_os_error()),
    }
}

impl Entry {
    /// Returns the function by which the program enters the list. It is called between fork and exec, in the group
    /// that is to be killed.
    pub(crate) fn enters(&self) -> impl Fn() -> io::Result<()> + Send + Sync + 'static {
        let (number, descriptor) = (self.number, self.stream.as_raw_fd());
        move || {
            tell(number, descriptor);
            Ok(())
        }
    }
}

/// Writes the line of this process. Only functions that are safe between fork and exec are called, and nothing is
/// allocated.
fn tell(number: u64, descriptor: RawFd) {
    // SAFETY: `getpid` cannot fail.
    let group = unsafe { libc::getpid() }.unsigned_abs();
    let mut line = [0; 64];
    let mut rest = &mut line[..];
    // The line has at most 33 bytes.
    let _ = writeln!(rest, "+ {number} {group}");
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
        let mut stream = self.stream;
        // Where the shell is gone, there is no list.
        let _ = stream.write_all(format!("- {}\n", self.number).as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_stream_that_a_program_is_given_takes_the_place_of_its_entry() {
        let entry = entry().expect("a shell");
        assert!(entry.stream.as_raw_fd() >= LEAST_DESCRIPTOR && LEAST_DESCRIPTOR > hpu_vhpi::DESCRIPTOR);
    }
}
