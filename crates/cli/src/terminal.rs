//! Output for users: results on stdout, errors and progress on stderr, colours only on a terminal.

use std::env;
use std::io::{self, ErrorKind, IsTerminal, Write};

use crate::exit::Failure;
use crate::progress;
pub use crate::progress::with_progress;

/// Prints a result. A closed pipe is no error, because its reader wants no more; a full disk is an error.
pub fn print(text: &str) -> Result<(), Failure> {
    let printed = progress::print(|| {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    });
    match printed {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::file(format!("standard output: {error}"))),
        _ => Ok(()),
    }
}

/// Prints one JSON object.
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// Prints the reason why the program could not do its job.
pub fn complain(failure: &Failure) {
    // Without a stderr, the exit code tells.
    let _ = progress::print(|| writeln!(io::stderr(), "error: {failure}"));
}

/// Prints a message on stderr for the user who reads the result, or waits for it.
pub fn tell(said: &str) {
    // Without a stderr, the message is lost.
    let _ = progress::print(|| writeln!(io::stderr(), "{said}"));
}

fn coloured() -> bool {
    let set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !set("NO_COLOR") && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Returns text in green or red on a terminal that shows colours.
pub fn verdict(text: &str, good: bool) -> String {
    match (coloured(), good) {
        (false, _) => text.to_string(),
        (true, true) => format!("\x1b[32m{text}\x1b[0m"),
        (true, false) => format!("\x1b[31m{text}\x1b[0m"),
    }
}
