//! A simulator that runs as a process and answers requests.

use std::io::{self, Read};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use hpu_cosim::dut::{Asked, Change, Fault, Heard, RunningDesign};
use hpu_vhpi::{DESCRIPTOR, put, take};

use super::said::{Ears, LONGEST};
use crate::engines::error::{Error, Reason};
use crate::engines::group::{Group, is_stopping};
use crate::engines::tool::{Fault as ToolFault, Tool, ToolError};
use crate::system;

/// The longest time for an answer, unless the tools have another time limit. A request has at most some ten thousand
/// edges.
pub(crate) const ANSWER: Duration = Duration::from_secs(20);
/// The exit code of a model that drives the device by a value that nothing has set.
pub(super) const UNSET: i32 = 77;
/// The step of the process, for messages.
const SIMULATE: &str = "simulate a design";
/// Bytes that are kept of the beginning of a simulator's output, and as many of its end.
const KEPT: usize = 1 << 14;
/// The longest wait for the last output of a process that has ended.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// The output of a simulator.
#[derive(Default)]
struct Said {
    /// Its beginning and its end.
    kept: Vec<u8>,
    /// What the design says in it, if that is heard.
    ears: Option<Ears>,
}

/// A running simulator.
pub(crate) struct Process {
    tool: Tool,
    group: Group,
    stream: system::Stream,
    said: Arc<Mutex<Said>>,
    readers: Vec<JoinHandle<()>>,
    limit: Duration,
    /// Edges clocked so far.
    edge: u64,
    /// Whether the design has ended the run.
    is_over: bool,
    request: Vec<u64>,
}

impl Process {
    /// Starts a simulator and lets the design come out of its reset. `ears` hear what the design says; without them, a
    /// simulation that the design ends has failed.
    pub(crate) fn start(
        tool: Tool,
        mut command: Command,
        (limit, ears): (Duration, Option<Ears>),
        (words, drives): (&[u64], &[bool]),
        changes: &mut Vec<Change>,
    ) -> Result<Self, Error> {
        let not_started = |error| ToolError::new(tool, SIMULATE, ToolFault::NotStarted(error), "");
        if system::NO_TOOLS.is_some() {
            return Err(ToolError::new(tool, SIMULATE, ToolFault::Missing, "").into());
        }
        let (ours, theirs) = system::stream_to(&mut command, DESCRIPTOR).map_err(not_started)?;
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut group = Group::start(&mut command).map_err(|fault| ToolError::new(tool, SIMULATE, fault, ""))?;
        drop(theirs);
        let said = Arc::new(Mutex::new(Said { kept: Vec::new(), ears }));
        let mut readers = Vec::new();
        if let Some(out) = group.child.stdout.take() {
            readers.push(listen(out, Arc::clone(&said)));
        }
        if let Some(err) = group.child.stderr.take() {
            readers.push(listen(err, Arc::clone(&said)));
        }
        ours.set_read_timeout(Some(limit)).map_err(not_started)?;
        let (edge, is_over, request) = (0, false, Vec::new());
        let mut process = Self { tool, group, stream: ours, said, readers, limit, edge, is_over, request };
        process.request.push(words.len() as u64);
        process.request.extend(drives.iter().map(|drives| u64::from(*drives)));
        process.request.extend_from_slice(words);
        process.ask(0, words.len(), changes)?;
        Ok(process)
    }

    /// Sends the request for `edges` edges, and takes the answer.
    fn ask(&mut self, edges: u64, ports: usize, changes: &mut Vec<Change>) -> Result<u64, Error> {
        let answer = put(&mut self.stream, &self.request).and_then(|()| {
            take_answer(&mut io::BufReader::with_capacity(1 << 14, &mut self.stream), (edges, ports), changes)
        });
        self.request.clear();
        match answer {
            Ok((done, is_over)) => {
                self.edge += done;
                self.is_over = is_over;
                Ok(done)
            }
            Err(error) => {
                let lost = self.lost(&error);
                // GHDL ends where the design ends the run, within the request.
                let done = self.ended().map(|edge| edge.saturating_sub(self.edge).clamp(edges.min(1), edges));
                done.inspect(|done| (self.edge, self.is_over) = (self.edge + done, true)).ok_or(lost)
            }
        }
    }

    /// Returns the edge at which the design has ended the run, if the run was heard to its end.
    fn ended(&self) -> Option<u64> {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        Some(said.ears.as_ref()?.heard.end.as_ref()?.edge)
    }

    /// Returns the reason why the simulator does not answer.
    fn lost(&mut self, error: &io::Error) -> Error {
        let fault = if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) {
            ToolFault::TooLong(self.limit)
        } else if error.kind() == io::ErrorKind::InvalidData {
            ToolFault::Silent("answer that fits the request")
        } else {
            let start = Instant::now();
            let status = loop {
                match self.group.ended() {
                    Ok(None) if start.elapsed() < LAST_WORDS => thread::sleep(Duration::from_millis(5)),
                    Ok(status) => break status,
                    Err(_) => break None,
                }
            };
            let ended = status.and_then(|status| {
                let code = status.code().map(ToolFault::Failed);
                code.or(system::killed_by(status).map(ToolFault::Killed))
            });
            // A process that was killed while the tools are being stopped was killed on purpose.
            if is_stopping() { ToolFault::Stopped } else { ended.unwrap_or(ToolFault::Silent("answer")) }
        };
        let said = self.last_words();
        if self.tool == Tool::Verilator && matches!(fault, ToolFault::Failed(UNSET)) {
            let why = said.lines().rfind(|line| line.starts_with("output ")).unwrap_or(&said);
            return Reason::Unset(why.trim_end().to_string()).into();
        }
        Reason::Lost(ToolError::new(self.tool, SIMULATE, fault, &said), self.edge).into()
    }

    /// Returns the simulator's output.
    fn last_words(&mut self) -> String {
        let start = Instant::now();
        while self.readers.iter().any(|reader| !reader.is_finished()) && start.elapsed() < LAST_WORDS / 4 {
            thread::sleep(Duration::from_micros(200));
        }
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&said.kept).into_owned()
    }
}

impl RunningDesign for Process {
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        self.request.extend([edges, asked as u64]);
        self.request.extend_from_slice(words);
        Ok(self.ask(edges, words.len(), changes)?)
    }

    fn is_over(&self) -> bool {
        self.is_over
    }

    fn heard(&mut self) -> Heard {
        // What was said up to the last answer is on its way to the readers, who read up to the end of the process.
        self.group.release();
        self.last_words();
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        said.ears.as_mut().map(|ears| std::mem::take(&mut ears.heard)).unwrap_or_default()
    }
}

/// Reads the answer to a request for `edges` edges, 0 of them for the reset, of a design with so many ports. Returns
/// the number of edges done, and whether the design has ended the run.
///
/// The simulator runs code of somebody else, so an answer that does not fit the request is an error: each port changes
/// once an edge at most, edges do not fall, and some edge is done.
fn take_answer(
    from: &mut impl Read,
    (edges, ports): (u64, usize),
    changes: &mut Vec<Change>,
) -> io::Result<(u64, bool)> {
    let fits = |fits: bool| if fits { Ok(()) } else { Err(io::Error::from(io::ErrorKind::InvalidData)) };
    let (done, count, is_over) = (take(from)?, take(from)?, take(from)? != 0);
    fits(done <= edges && (done > 0) == (edges > 0) && count <= (done + 1).saturating_mul(ports as u64))?;
    let mut last = 0;
    for _ in 0..count {
        let (edge, port, bits, known) = (take(from)?, take(from)?, take(from)?, take(from)?);
        fits((last..=done).contains(&edge) && port < ports as u64)?;
        last = edge;
        changes.push(Change { edge, port: port as usize, bits: (known != 0).then_some(bits) });
    }
    Ok((done, is_over))
}

/// Starts a thread that keeps the beginning and the end of the output, and hears each of its lines.
fn listen(mut from: impl Read + Send + 'static, said: Arc<Mutex<Said>>) -> JoinHandle<()> {
    thread::spawn(move || {
        let (mut buffer, mut line) = ([0; 4096], Vec::new());
        while let Ok(length) = from.read(&mut buffer)
            && length > 0
        {
            let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
            let Said { kept, ears } = &mut *said;
            kept.extend_from_slice(&buffer[..length]);
            if kept.len() > 4 * KEPT {
                let end = kept.len() - KEPT;
                kept.drain(KEPT..end);
            }
            for part in buffer[..length].split_inclusive(|byte| *byte == b'\n') {
                line.extend_from_slice(&part[..part.len().min(LONGEST.saturating_sub(line.len()))]);
                if part.ends_with(b"\n") {
                    if let Some(ears) = ears {
                        ears.line(String::from_utf8_lossy(&line).trim_end());
                    }
                    line.clear();
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use std::io::{self, ErrorKind, Read};

    use hpu_cosim::dut::Change;

    use super::take_answer;

    fn answered(words: &[u64], asked: (u64, usize)) -> (io::Result<(u64, bool)>, Vec<Change>) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut changes = Vec::new();
        (take_answer(&mut &bytes[..], asked, &mut changes), changes)
    }

    #[test]
    fn an_answer_that_fits_its_request_is_taken() {
        let (done, changes) = answered(&[3, 3, 1, 1, 0, 5, 1, 1, 1, 0, 0, 3, 0, 6, 1], (10, 2));
        assert_eq!(done.ok(), Some((3, true)));
        let all = [(1, 0, Some(5)), (1, 1, None), (3, 0, Some(6))];
        assert_eq!(changes, all.map(|(edge, port, bits)| Change { edge, port, bits }));
        assert_eq!(answered(&[0, 1, 0, 0, 1, 7, 1], (0, 2)).0.ok(), Some((0, false)), "after the reset");
    }

    #[test]
    fn an_answer_that_lies_is_refused() {
        for (what, words, asked) in [
            ("more edges than asked for", &[11, 0, 0][..], (10, 2)),
            ("no edge", &[0, 0, 0], (10, 2)),
            ("edges of the reset", &[1, 0, 0], (0, 2)),
            ("more changes than there can be", &[3, 9, 0], (10, 2)),
            ("changes without end", &[3, u64::MAX, 0], (10, 2)),
            ("a port that is not there", &[3, 1, 0, 1, 2, 0, 1], (10, 2)),
            ("an edge that is not done", &[3, 1, 0, 4, 0, 0, 1], (10, 2)),
            ("an edge before the last one", &[3, 2, 0, 2, 0, 0, 1, 1, 0, 0, 1], (10, 2)),
        ] {
            let (done, changes) = answered(words, asked);
            assert_eq!(done.map_err(|error| error.kind()), Err(ErrorKind::InvalidData), "{what}");
            assert!(changes.len() <= 1, "{what}");
        }
        assert_eq!(answered(&[3, 1, 0, 1], (10, 2)).0.map_err(|error| error.kind()), Err(ErrorKind::UnexpectedEof));
    }

    /// A simulator that never ends its answer.
    struct Endless(u64);

    impl Read for Endless {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0 += buffer.len() as u64;
            buffer.fill(1);
            Ok(buffer.len())
        }
    }

    #[test]
    fn an_endless_answer_is_read_to_its_first_lie() {
        let mut endless = Endless(0);
        assert!(take_answer(&mut endless, (u64::MAX, 2), &mut Vec::new()).is_err());
        assert!(endless.0 < 100);
    }
}
