//! What a design says while it is simulated: assertions that fail, messages, and its own end of the run.

use std::fmt;

use hpu_signal::{Clock, Cycle};

/// The most assertions that are listed, each with the number of times that it failed.
pub const MOST_FAILURES: usize = 100;
/// The most bytes of messages that are kept.
pub const MOST_MESSAGES: usize = 1 << 20;

/// How grave a message is. The words are VHDL's; `$info` of Verilog is a note, `$fatal` a failure.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Severity {
    /// A note, or text without a severity.
    Note,
    /// A warning.
    Warning,
    /// An error: the run goes on, and has failed.
    Error,
    /// A failure: it ends the run.
    Failure,
}

impl Severity {
    /// Returns its name in VHDL.
    pub fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
            Self::Failure => "failure",
        }
    }
}

/// A message of a design.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Said {
    /// The clock edge at which it was said; 0 up to the end of the reset.
    pub edge: u64,
    /// How grave it is.
    pub severity: Severity,
    /// The file and the line, as far as the simulator tells them.
    pub place: Option<(String, u32)>,
    /// The text.
    pub text: String,
}

/// An assertion that has failed, or an error that was reported at one place.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// The first of its messages.
    pub first: Said,
    /// The number of clock edges at which it has failed; the time until the end of the reset counts as one.
    pub times: u64,
    last: u64,
}

/// The end of a run that a design has ended by itself.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct End {
    /// The clock edge at which that happened.
    pub edge: u64,
    /// What the design did, as in `$finish`.
    pub by: &'static str,
    /// The file and the line, as far as the simulator tells them.
    pub place: Option<(String, u32)>,
}

/// Why the run of a design is no result for a study.
#[derive(Debug)]
pub struct Unfit(String);

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unfit {}

/// Everything that a design has said in a run. Its memory is bounded.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Heard {
    /// The messages of severity error and failure, by their place: the first [`MOST_FAILURES`].
    pub failures: Vec<Failure>,
    /// The number of failed assertions that are not listed.
    pub unlisted: u64,
    /// All messages in the order in which they were said, with the edge of each where it is known: the first
    /// [`MOST_MESSAGES`] bytes.
    pub messages: Vec<(Option<u64>, String)>,
    /// The number of messages that were not kept.
    pub unkept: u64,
    /// The end of the run, if the design has ended it.
    pub end: Option<End>,
    /// The assertions that the simulator does not check, with their places and the reason.
    pub unchecked: Vec<String>,
    bytes: usize,
}

impl Heard {
    /// Returns nothing heard yet of a design with these assertions that its simulator does not check.
    pub fn unchecking(unchecked: Vec<String>) -> Self {
        Self { unchecked, ..Self::default() }
    }

    /// Returns the number of failures at all places.
    pub fn failed(&self) -> u64 {
        self.unlisted + self.failures.iter().map(|failure| failure.times).sum::<u64>()
    }

    /// Returns why the run is no result for a study: an assertion has failed, or the design has ended the run.
    pub fn unfit(&self, clock: Clock) -> Option<Unfit> {
        let at = |edge: u64| match edge {
            0 => "in the reset".to_string(),
            edge => format!("at clock edge {edge} ({:e} s)", clock.seconds(Cycle(edge))),
        };
        let there = |there: &Option<_>| place(there.as_ref()).map_or(String::new(), |place| format!("{place}: "));
        if let Some(Failure { first, .. }) = self.failures.first() {
            let said =
                format!("an assertion of the design failed {}: {}{}", at(first.edge), there(&first.place), first.text);
            return Some(Unfit(said));
        }
        let End { edge, by, place } = self.end.as_ref()?;
        let said =
            format!("the design ended its run {}: {}{by}; the run is too short to be judged", at(*edge), there(place));
        Some(Unfit(said))
    }

    /// Takes a message. A failure at the same place and edge as its last one counts once: a simulator may evaluate a
    /// condition more than once an edge.
    pub fn take(&mut self, said: Said) {
        let place = said.place.as_ref().map_or(String::new(), |(file, line)| format!("{file}:{line}: "));
        let head = if said.severity == Severity::Note { String::new() } else { format!("{}: ", said.severity.name()) };
        let line = format!("{head}{place}{}", said.text);
        if said.severity < Severity::Error {
            return self.keep(Some(said.edge), line);
        }
        let same = |failure: &&mut Failure| {
            let of = |said: &Said| if said.place.is_none() { said.text.clone() } else { String::new() };
            let (first, text) = (&failure.first, of(&said));
            first.place == said.place && first.severity == said.severity && of(first) == text
        };
        let is_full = self.failures.len() >= MOST_FAILURES;
        match self.failures.iter_mut().find(same) {
            Some(failure) if failure.last == said.edge => return,
            Some(failure) => (failure.times, failure.last) = (failure.times + 1, said.edge),
            None if is_full => self.unlisted += 1,
            None => self.failures.push(Failure { last: said.edge, first: said.clone(), times: 1 }),
        }
        self.keep(Some(said.edge), line);
    }

    /// Makes the error at a place and an edge a failure: the simulator has told only later that it is one.
    pub fn worsen(&mut self, edge: u64, place: Option<&(String, u32)>) {
        let same = |failure: &&mut Failure| failure.last == edge && failure.first.place.as_ref() == place;
        if let Some(failure) = self.failures.iter_mut().rev().find(same) {
            failure.first.severity = Severity::Failure;
        }
    }

    /// Keeps a line of text, and the edge at which it was said.
    pub fn keep(&mut self, edge: Option<u64>, line: String) {
        if self.bytes + line.len() > MOST_MESSAGES {
            // From here on nothing is kept, so that the messages have no holes.
            self.bytes = MOST_MESSAGES;
            self.unkept += 1;
            return;
        }
        self.bytes += line.len() + 1;
        self.messages.push((edge, line));
    }
}

/// Returns a place as messages show it, `file:line`.
pub fn place(place: Option<&(String, u32)>) -> Option<String> {
    place.map(|(file, line)| format!("{file}:{line}"))
}
