//! The progress of a command on stderr: a bar on a terminal, a line every 10 s elsewhere, nothing with `--quiet`.
//!
//! One thread shows the progress of the whole command. A verb that counts its work calls [`with_progress`], and a verb
//! with several parts names each part by [`doing`]. For any other verb, the thread shows its name and the time so far.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::{Control, printable};

/// Time from one line to the next where stderr is not a terminal.
const LINE: Duration = Duration::from_secs(10);

/// Time from one bar to the next on a terminal.
const BAR: Duration = Duration::from_millis(200);

/// The progress of this process's command.
static PROGRESS: Progress = Progress::new();

/// Begins to show the progress of the command of this name, as in `chart friction-wall`.
pub fn begin(command: &str) {
    PROGRESS.begin(command);
    // The thread ends with the process, so nothing waits for it.
    thread::spawn(|| {
        let (alive, ended) = mpsc::channel();
        if io::stderr().is_terminal() {
            PROGRESS.tell(BAR, &ended, State::draw);
        } else {
            PROGRESS.tell(LINE, &ended, |state| state.write_line(&mut io::stderr()));
        }
        drop(alive);
    });
}

/// Ends the progress, and erases the bar.
pub fn end() {
    aside(|state| {
        state.erase();
        state.begin = None;
    });
}

/// Names the part of the command that begins.
pub fn doing(part: impl Into<String>) {
    let part = part.into();
    aside(|state| state.part = part);
}

/// Reports the progress of a part in which nothing is counted.
pub fn note(said: impl Into<String>) {
    let said = said.into();
    aside(|state| state.said = said);
}

/// Prints while no bar is in the way.
pub fn print(printed: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    aside(|state| {
        state.erase();
        printed()
    })
}

/// Calls `work` while `control.progress` counts from 0 to `total`. `what` names the things that are counted; if it is
/// empty, nothing is counted.
pub(crate) fn with_progress<T>(
    total: u64,
    what: &'static str,
    control: &'static Control,
    work: impl FnOnce() -> T,
) -> T {
    control.progress.store(0, Ordering::Relaxed);
    aside(|state| state.count = Some(Count { done: &control.progress, total, what, begin: Instant::now() }));
    let made = work();
    aside(|state| {
        state.erase();
        state.count = None;
    });
    made
}

/// The control of a piece of work, and the one who hears of its progress.
#[derive(Clone, Copy)]
pub enum Watch<'a> {
    /// The command's own control. The work is counted on stderr.
    Shown(&'static Control),
    /// The control of another program. The number of things to count is left for it in `total`.
    Kept {
        /// The control, whose `progress` counts.
        control: &'a Control,
        /// The things to count, 0 if unknown.
        total: &'a AtomicU64,
    },
}

impl<'a> Watch<'a> {
    /// Returns the control that stops the work.
    pub fn control(self) -> &'a Control {
        match self {
            Self::Shown(control) => control,
            Self::Kept { control, .. } => control,
        }
    }

    /// Returns whether the work was asked to stop.
    pub fn is_stopped(self) -> bool {
        self.control().stop.load(Ordering::Relaxed)
    }

    /// Calls `work` while the control counts from 0 to `total`, as `with_progress` does.
    pub fn counted<T>(self, total: u64, what: &'static str, work: impl FnOnce() -> T) -> T {
        match self {
            Self::Shown(control) => with_progress(total, what, control, work),
            Self::Kept { control, total: kept } => {
                control.progress.store(0, Ordering::Relaxed);
                kept.store(total, Ordering::Relaxed);
                work()
            }
        }
    }
}

fn aside<T>(change: impl FnOnce(&mut State) -> T) -> T {
    change(&mut PROGRESS.lock())
}

/// The state of the command, shared by the threads that change it and the thread that shows it.
struct Progress(Mutex<State>);

struct State {
    command: String,
    begin: Option<Instant>,
    part: String,
    said: String,
    count: Option<Count>,
    /// Whether a bar is on the terminal.
    drawn: bool,
}

/// Work that is counted.
struct Count {
    done: &'static AtomicU64,
    total: u64,
    what: &'static str,
    begin: Instant,
}

impl Progress {
    const fn new() -> Self {
        let state = State {
            command: String::new(),
            begin: None,
            part: String::new(),
            said: String::new(),
            count: None,
            drawn: false,
        };
        Self(Mutex::new(state))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn begin(&self, command: &str) {
        let mut state = self.lock();
        state.command = command.to_string();
        state.begin = Some(Instant::now());
    }

    /// Shows the state once in every `interval`, until the sender of `ended` is gone.
    fn tell(&self, interval: Duration, ended: &Receiver<()>, mut show: impl FnMut(&mut State)) {
        while ended.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
            let mut state = self.lock();
            if state.begin.is_some() {
                show(&mut state);
            }
        }
    }
}

impl State {
    fn elapsed_s(&self) -> f64 {
        self.begin.map_or(0.0, |begin| begin.elapsed().as_secs_f64())
    }

    /// Draws the bar of the work that is counted; without a count, the line.
    fn draw(&mut self) {
        let line = match &self.count {
            Some(count) => bar(count.so_far(), count.total, count.what, count.begin.elapsed().as_secs_f64()),
            None if self.elapsed_s() < 2.0 => return,
            None => printable(&self.line()).into_owned(),
        };
        // An error is ignored, because nobody reads a missing stderr.
        let _ = write!(io::stderr(), "\r{line}\x1b[K");
        self.drawn = true;
    }

    fn erase(&mut self) {
        if std::mem::take(&mut self.drawn) {
            let _ = write!(io::stderr(), "\r\x1b[K");
        }
    }

    fn write_line(&self, out: &mut impl Write) {
        let _ = writeln!(out, "{}", printable(&self.line()));
    }

    /// Returns the progress line: the part of the command, the share done, the time so far and the time left, as far as
    /// they are known.
    fn line(&self) -> String {
        let mut line = self.command.clone();
        if !self.part.is_empty() {
            line += &format!(": {}", self.part);
        }
        let mut left = None;
        if let Some(count) = &self.count {
            let (done, total) = (count.so_far(), count.total);
            line += &format!(": {:.1} %", 100.0 * done as f64 / total.max(1) as f64);
            if !count.what.is_empty() {
                line += &format!(" of {total} {}", count.what);
            }
            left = left_s(done, total, count.begin.elapsed().as_secs_f64());
        } else if !self.said.is_empty() {
            line += &format!(": {}", self.said);
        }
        line += &format!("; {} so far", time(self.elapsed_s()));
        line + &left.map_or(String::new(), |left_s| format!(", about {} left", time(left_s)))
    }
}

impl Count {
    fn so_far(&self) -> u64 {
        self.done.load(Ordering::Relaxed).min(self.total)
    }
}

/// Returns the time that the rest takes at the same rate; `None` before anything is done.
fn left_s(done: u64, total: u64, elapsed_s: f64) -> Option<f64> {
    (done > 0).then(|| (total - done) as f64 * elapsed_s / done as f64)
}

/// Returns a time as in `47 s` or `3 min 20 s`.
fn time(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 60, seconds % 60) {
        (0, seconds) => format!("{seconds} s"),
        (minutes, seconds) => format!("{minutes} min {seconds} s"),
    }
}

fn bar(done: u64, total: u64, what: &str, elapsed_s: f64) -> String {
    const WIDTH: usize = 30;
    let share = done as f64 / total.max(1) as f64;
    let filled = "#".repeat((share * WIDTH as f64) as usize);
    let rate = if what.is_empty() { String::new() } else { format!("  {:.2e} {what}/s", done as f64 / elapsed_s) };
    let left = left_s(done, total, elapsed_s).map_or(String::new(), |left_s| format!("  {} left", time(left_s)));
    format!("[{filled:<WIDTH$}] {:5.1} %{rate}{left}", share * 100.0)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc;
    use std::time::{Duration, Instant};
    use std::{str, thread};

    use super::{Count, Progress, bar, time};

    #[test]
    fn the_bar_shows_share_rate_and_time_left() {
        let line = bar(50, 200, "edges", 5.0);
        assert_eq!(line, "[#######                       ]  25.0 %  1.00e1 edges/s  15 s left");
        assert_eq!(bar(0, 200, "edges", 5.0), "[                              ]   0.0 %  0.00e0 edges/s");
    }

    #[test]
    fn a_time_is_told_in_minutes_and_seconds() {
        assert_eq!([9.6, 59.4, 60.0, 200.2].map(time), ["10 s", "59 s", "1 min 0 s", "3 min 20 s"]);
    }

    #[test]
    fn a_line_says_what_is_done_the_share_the_time_and_what_is_left() {
        static DONE: AtomicU64 = AtomicU64::new(88);
        let ago = |seconds| Instant::now().checked_sub(Duration::from_secs(seconds));
        let progress = Progress::new();
        progress.begin("chart friction-wall");
        let mut state = progress.lock();
        state.begin = ago(50);
        assert_eq!(state.line(), "chart friction-wall; 50 s so far", "of what is not counted, the time alone");
        state.said = "120 runs".into();
        state.part = "searching".into();
        assert_eq!(state.line(), "chart friction-wall: searching: 120 runs; 50 s so far");
        state.part.clear();
        let begin = ago(40).expect("the machine has run for a minute");
        state.count = Some(Count { done: &DONE, total: 352, what: "runs", begin });
        assert_eq!(state.line(), "chart friction-wall: 25.0 % of 352 runs; 50 s so far, about 2 min 0 s left");
        DONE.store(400, std::sync::atomic::Ordering::Relaxed);
        assert!(state.line().contains("100.0 % of 352 runs"), "{}", state.line());
    }

    #[test]
    fn a_line_comes_in_every_interval_until_the_end() {
        let progress = &Progress::new();
        progress.begin("check");
        let (alive, ended) = mpsc::channel();
        let (told, lines) = mpsc::channel();
        thread::scope(|scope| {
            scope.spawn(move || {
                progress.tell(Duration::from_millis(5), &ended, |state| {
                    let mut line = Vec::new();
                    state.write_line(&mut line);
                    told.send(line).expect("is heard");
                });
                drop(told);
            });
            for _ in 0..3 {
                let line = lines.recv().expect("a line");
                assert_eq!(str::from_utf8(&line), Ok("check; 0 s so far\n"));
            }
            drop(alive);
        });
        // The thread has ended, so it shows no more lines.
        assert!(lines.iter().count() < 1000);
    }
}
