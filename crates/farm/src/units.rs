//! Many independent runs: units of work, spread over threads. Rows come in the order of the units, whatever the threads
//! do.
//!
//! A unit is a pure function of its number (and of what the study's header names). Its result is a row, or the reason
//! why there is none; a panic is such a reason too. Each row is handed over as soon as it is finished, to be kept. An
//! interrupted set is given the rows that it already has, and does the rest.

use std::any::Any;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;

use crate::row::{Failed, UnitResult};

/// Runs those of the units `0..count` that are not done yet, and returns the rows of all units in their order, or
/// `None` when stopped.
///
/// Works like [`run_some`]; every new row also goes through `keep`.
///
/// # Errors
///
/// Returns the error of `keep`; the other units are stopped then.
pub fn run<T: Send, E>(
    count: usize,
    jobs: NonZeroUsize,
    mut done: BTreeMap<usize, UnitResult<T>>,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<UnitResult<T>> + Sync,
    mut keep: impl FnMut(usize, &UnitResult<T>) -> Result<(), E>,
) -> Result<Option<Vec<UnitResult<T>>>, E> {
    let left: Vec<usize> = (0..count).filter(|index| !done.contains_key(index)).collect();
    run_some(&left, jobs, control, unit, |index, row| {
        keep(index, &row)?;
        done.insert(index, row);
        Ok(())
    })?;
    Ok((0..count).map(|index| done.remove(&index)).collect())
}

/// Runs these units, and hands their rows to `take` in the order in which they finish. When stopped, some rows are
/// missing. No row is kept here.
///
/// `control` stops the set, and counts the finished units as progress. Each thread gets a control of its own. A unit
/// returns `None` if it was stopped, or if it is to be run another time.
///
/// # Errors
///
/// Returns the error of `take`; the other units are stopped then.
pub fn run_some<T: Send, E>(
    wanted: &[usize],
    jobs: NonZeroUsize,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<UnitResult<T>> + Sync,
    mut take: impl FnMut(usize, UnitResult<T>) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let own: Vec<Control> = (0..jobs.get().min(wanted.len())).map(|_| Control::default()).collect();
    let stop = || own.iter().for_each(|control| control.stop.store(true, Ordering::Relaxed));
    let (send, rows) = mpsc::channel::<(usize, UnitResult<T>)>();
    let failed = thread::scope(|scope| {
        for control in &own {
            let (send, next, unit) = (send.clone(), &next, &unit);
            scope.spawn(move || {
                while !control.stop.load(Ordering::Relaxed)
                    && let Some(&index) = wanted.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let made = catch_unwind(AssertUnwindSafe(|| unit(index, control)));
                    // A unit that was stopped, or that declined to run, has no row.
                    let Some(row) = made.unwrap_or_else(|panic| Some(Err(reason(panic.as_ref())))) else { continue };
                    // The receiver is gone only after an error of `take`, which is returned there.
                    let _ = send.send((index, row));
                }
            });
        }
        drop(send);
        loop {
            match rows.recv_timeout(Duration::from_millis(50)) {
                Ok((index, row)) => {
                    if let Err(error) = take(index, row) {
                        stop();
                        return Some(error);
                    }
                    control.progress.fetch_add(1, Ordering::Relaxed);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
            if control.stop.load(Ordering::Relaxed) {
                stop();
            }
        }
    });
    failed.map_or(Ok(()), Err)
}

fn reason(panic: &(dyn Any + Send)) -> Failed {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    Failed::new(format!("panicked: {}", text.unwrap_or("without a word")))
}

/// Does jobs in their order, on so many threads. Returns `None` for the jobs that had not begun when `control` stopped
/// them.
pub fn on_threads<T: Send>(
    count: usize,
    jobs: NonZeroUsize,
    control: &Control,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<Option<T>> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::from_iter((0..count).map(|_| None))));
    let worker = || {
        while !control.stop.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            let done = work(index);
            found.lock().expect("no worker panics with it")[index] = Some(done);
        }
    };
    thread::scope(|scope| {
        for _ in 0..jobs.get().min(count) {
            scope.spawn(worker);
        }
    });
    found.into_inner().expect("no worker panics with it")
}
