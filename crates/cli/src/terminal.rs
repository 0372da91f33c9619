//! What people see: results on stdout, errors and progress on stderr, colours on a terminal only.

use std::env;
use std::io::{self, ErrorKind, IsTerminal, Write};

use crate::exit::Failure;
use crate::progress;
pub use crate::progress::with_progress;

/// Prints a result. A reader who has seen enough (a closed pipe) is no error; a full disk is.
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

/// Tells why the program could not do what it was asked.
pub fn complain(failure: &Failure) {
    // Without a stderr there is the exit code.
    let _ = progress::print(|| writeln!(io::stderr(), "error: {failure}"));
}

/// Tells on stderr what somebody should know who reads the result, or waits for it.
pub fn tell(said: &str) {
    // Without a stderr nobody is told.
    let _ = progress::print(|| writeln!(io::stderr(), "{said}"));
}

fn coloured() -> bool {
    let set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !set("NO_COLOR") && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Text in green or red on a terminal that shows colours.
pub fn verdict(text: &str, good: bool) -> String {
    match (coloured(), good) {
        (false, _) => text.to_string(),
        (true, true) => format!("\x1b[32m{text}\x1b[0m"),
        (true, false) => format!("\x1b[31m{text}\x1b[0m"),
    }
}
