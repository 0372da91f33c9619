//! Output for users: results on stdout, errors and progress on stderr, colours only on a terminal.
//!
//! Scenes, studies and designs are often by somebody else, so their texts are shown as [`printable`]: none of them can
//! steer a terminal.

use std::borrow::Cow;
use std::collections::hash_map::RandomState;
use std::env;
use std::hash::BuildHasher;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use hpu_cosim::{printable, printable_json};
use hpu_rtl::system;
use serde_json::Value;

use crate::shell::exit::Failure;
use crate::shell::progress;

/// Prints a result for people, whose verdicts are coloured on a terminal.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut shown = printable(text).into_owned();
    for (mark, colour) in marks().iter().zip(COLOURS) {
        shown = shown.replace(*mark, colour);
    }
    write(&shown)
}

/// Prints a result that is a file's content: as it is, unless a terminal shows it.
pub(crate) fn print_file(text: &str) -> Result<(), Failure> {
    if io::stdout().is_terminal() { print(text) } else { write(text) }
}

/// Prints one JSON object, or [gathers](gathered) it.
pub(crate) fn print_json(value: &Value) -> Result<(), Failure> {
    if let Some(all) = &mut *gathering() {
        all.push(value.clone());
        return Ok(());
    }
    write(&format!("{}\n", printable_json(&format!("{value:#}"))))
}

/// The JSON objects that are gathered.
static GATHERED: Mutex<Option<Vec<Value>>> = Mutex::new(None);

fn gathering() -> MutexGuard<'static, Option<Vec<Value>>> {
    GATHERED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls verbs for a study whose result is one JSON object. Returns the objects that they would have printed.
pub fn gathered<T>(verbs: impl FnOnce() -> T) -> (T, Vec<Value>) {
    *gathering() = Some(Vec::new());
    let made = verbs();
    (made, gathering().take().unwrap_or_default())
}

/// Writes to stdout. A closed pipe is no error, because its reader wants no more, and neither is a terminal that is
/// gone; a full disk is an error.
fn write(text: &str) -> Result<(), Failure> {
    let printed = progress::print(|| {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    });
    match printed {
        Err(error) if error.kind() == ErrorKind::BrokenPipe || system::is_hung_up(&error) => Ok(()),
        Err(error) => Err(Failure::file(format!("standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Prints the reason why the program could not do its job.
pub(crate) fn complain(failure: &Failure) {
    tell(&format!("error: {failure}"));
}

/// Prints a message on stderr for the user who reads the result, or waits for it.
pub fn tell(said: &str) {
    // Without a stderr, the message is lost; the exit code tells.
    let _ = progress::print(|| writeln!(io::stderr(), "{}", printable(said)));
}

/// Prints the refusal of a command line, and returns its exit code.
pub fn refuse(refusal: &clap::Error) -> u8 {
    let text = refusal.render().to_string();
    // A word that would steer the terminal costs the message its colours.
    let _ = progress::print(|| match printable(&text) {
        Cow::Borrowed(_) => refusal.print(),
        Cow::Owned(shown) => write!(io::stderr(), "{shown}"),
    });
    u8::try_from(refusal.exit_code()).unwrap_or(2)
}

/// The sequences that make text green and red, and end that.
const COLOURS: [&str; 3] = ["\x1b[32m", "\x1b[31m", "\x1b[0m"];

/// Returns the characters that stand for [`COLOURS`] until text is printed. They are drawn at random from those for
/// private use, so that no text of somebody else has them.
fn marks() -> &'static [char; 3] {
    static MARKS: OnceLock<[char; 3]> = OnceLock::new();
    MARKS.get_or_init(|| {
        let first = 0xF_0000 + (RandomState::new().hash_one(0) % 0xFFF0) as u32;
        [0, 1, 2].map(|next| char::from_u32(first + next).expect("a character for private use"))
    })
}

fn coloured() -> bool {
    let set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !set("NO_COLOR") && system::obeys_escapes()
}

/// Returns text in green or red on a terminal that shows colours.
pub fn verdict(text: &str, good: bool) -> String {
    let [green, red, end] = marks();
    match (coloured(), good) {
        (false, _) => text.to_string(),
        (true, true) => format!("{green}{text}{end}"),
        (true, false) => format!("{red}{text}{end}"),
    }
}
