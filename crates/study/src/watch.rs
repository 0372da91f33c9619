//! Runs with a limit on their time or on their number of events.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::Control;

/// Runs `work` under a control of its own, which stops it when `control` does or after `timeout`. Returns the result,
/// and whether the timeout stopped it.
pub(crate) fn watched<T>(timeout: Duration, control: &Control, work: impl FnOnce(&Control) -> T) -> (T, bool) {
    limited(None, timeout, control, work)
}

/// Like [`watched`], with a limit on the number of events as well. WebAssembly has no threads: nothing watches the time
/// there, and a program stops the work by ending the whole module.
pub(crate) fn limited<T>(
    most_events: Option<u64>,
    timeout: Duration,
    control: &Control,
    work: impl FnOnce(&Control) -> T,
) -> (T, bool) {
    let own = Control { most_events, ..Control::new() };
    if cfg!(target_family = "wasm") {
        return (work(&own), false);
    }
    let late = AtomicBool::new(false);
    let (alive, ended) = mpsc::channel::<()>();
    let done = thread::scope(|scope| {
        let (own, late) = (&own, &late);
        scope.spawn(move || {
            let start = Instant::now();
            while ended.recv_timeout(Duration::from_millis(20)) == Err(RecvTimeoutError::Timeout) {
                late.store(start.elapsed() >= timeout, Ordering::Relaxed);
                if late.load(Ordering::Relaxed) || control.stop.load(Ordering::Relaxed) {
                    own.stop.store(true, Ordering::Relaxed);
                    return;
                }
            }
        });
        // Dropped when the work ends, even by a panic.
        let _alive = alive;
        work(own)
    });
    (done, late.into_inner())
}
