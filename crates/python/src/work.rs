//! Work on a thread of its own, while the calling thread listens for signals and tells the progress.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use hpu_cli::answers::{Failure, Watch};
use hpu_cosim::{Control, SceneFile};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::errors::{Error, of_panic, of_scene};
use crate::scene::Overrides;

/// Time from one look at signals and progress to the next.
const LOOK: Duration = Duration::from_millis(50);

/// Calls `work` without the GIL. Every 50 ms and at the end calls `progress` with the number of things done and their
/// number, which is 0 while it is unknown. A signal, or an exception of `progress`, stops the work and is raised.
pub fn work<T: Send>(py: Python, progress: Option<&Bound<PyAny>>, work: impl FnOnce(Watch) -> T + Send) -> PyResult<T> {
    let (control, total) = (Control::new(), AtomicU64::new(0));
    let progress = progress.map(|progress| progress.clone().unbind());
    let tell = |py: Python| match &progress {
        Some(progress) => {
            let (done, total) = (control.progress.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
            progress.call1(py, (if total > 0 { done.min(total) } else { done }, total)).map(drop)
        }
        None => Ok(()),
    };
    let done = py.detach(|| {
        thread::scope(|scope| {
            let (ended, wait) = mpsc::channel::<()>();
            let watch = Watch::Kept { control: &control, total: &total };
            let worker = thread::Builder::new().name("hpu".into()).spawn_scoped(scope, move || {
                // Dropped when the work ends, even by a panic.
                let _ended = ended;
                work(watch)
            });
            let worker = worker.map_err(|error| Error::new_err(format!("no thread: {error}")))?;
            let mut raised = None;
            while wait.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals().and_then(|()| tell(py))).err();
                    control.stop.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            let done = worker.join().map_err(|panic| of_panic(&*panic));
            raised.map_or(done, Err)
        })
    })?;
    tell(py)?;
    Ok(done)
}

/// Listens for signals in a call that works without the GIL on its own thread.
pub struct Signals {
    turns: u32,
    last: Instant,
}

/// Turns of the work between two looks at the time. A turn takes some microseconds.
const TURNS: u32 = 256;

impl Signals {
    /// Begins to listen.
    pub fn new() -> Self {
        Self { turns: 0, last: Instant::now() }
    }

    /// Counts a turn of the work. Raises the exception of a signal, such as that of Ctrl-C, once in 50 ms.
    pub fn turn(&mut self) -> PyResult<()> {
        self.turns = (self.turns + 1) % TURNS;
        if self.turns > 0 || self.last.elapsed() < LOOK {
            return Ok(());
        }
        self.last = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}

/// Returns what a run gave, or its exception.
pub fn ended<T>(run: Result<Option<T>, Failure>, source: &SceneFile, set: &Overrides) -> PyResult<T> {
    match run {
        Ok(Some(run)) => Ok(run),
        Ok(None) => Err(PyKeyboardInterrupt::new_err("stopped")),
        Err(failure) => Err(of_scene(source, source.parse(set).err(), failure.to_string())),
    }
}
