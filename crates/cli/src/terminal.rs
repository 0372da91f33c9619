//! What people see: results on stdout, errors and progress on stderr, colours on a terminal only.

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use std::{env, thread};

use hpu_cosim::Control;

use crate::exit::Failure;

/// Prints a result. A reader who has seen enough (a closed pipe) is no error; a full disk is.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::file(format!("standard output: {error}"))),
        _ => Ok(()),
    }
}

/// Prints a row of a table that grows while a progress bar is shown.
pub fn print_row(text: &str) -> Result<(), Failure> {
    let is_over_bar = io::stdout().is_terminal() && io::stderr().is_terminal();
    if is_over_bar { print(&format!("\r\x1b[K{text}")) } else { print(text) }
}

/// Says on stderr what is about to be done.
pub fn note(text: &str) {
    // Who cannot hear it has the result.
    let _ = writeln!(io::stderr(), "{text}");
}

/// Prints one JSON object.
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// Tells why the program could not do what it was asked.
pub fn complain(failure: &Failure) {
    // Without a stderr there is the exit code.
    let _ = writeln!(io::stderr(), "error: {failure}");
}

/// Tells on stderr what somebody should know who reads the result, or waits for it.
pub fn tell(said: &str) {
    // Without a stderr nobody is told.
    let _ = writeln!(io::stderr(), "{said}");
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

/// Works with a progress bar when stderr is a terminal; `what` names what is counted.
pub fn with_progress<T>(total: u64, what: &str, control: &Control, work: impl FnOnce() -> T) -> T {
    control.progress.store(0, Ordering::Relaxed);
    if !io::stderr().is_terminal() {
        return work();
    }
    let (alive, ended) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            let start = Instant::now();
            while ended.recv_timeout(Duration::from_millis(200)) == Err(RecvTimeoutError::Timeout) {
                let done = control.progress.load(Ordering::Relaxed);
                let _ = write!(io::stderr(), "\r{}\x1b[K", bar(done, total, what, start.elapsed().as_secs_f64()));
            }
            let _ = write!(io::stderr(), "\r\x1b[K");
        });
        // Dropped when the work ends, even by a panic.
        let _alive = alive;
        work()
    })
}

fn bar(done: u64, total: u64, what: &str, elapsed_s: f64) -> String {
    const WIDTH: usize = 30;
    let share = done as f64 / total.max(1) as f64;
    let filled = "#".repeat((share * WIDTH as f64) as usize);
    let rate = done as f64 / elapsed_s;
    let left_s = if done > 0 { (total - done.min(total)) as f64 / rate } else { f64::INFINITY };
    format!("[{filled:<WIDTH$}] {:5.1} %  {rate:.2e} {what}/s  {left_s:.0} s left", share * 100.0)
}

#[cfg(test)]
mod tests {
    use super::bar;

    #[test]
    fn the_bar_shows_share_rate_and_time_left() {
        let line = bar(50, 200, "edges", 5.0);
        assert_eq!(line, "[#######                       ]  25.0 %  1.00e1 edges/s  15 s left");
    }
}
