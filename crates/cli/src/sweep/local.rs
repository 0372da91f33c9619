//! The engine of one machine: shards in processes of their own, which are started again when they die.

use std::collections::VecDeque;
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use clap::Command as Described;
use hpu_rtl::Group;

use super::gather::{How, gather};
use super::manifest::Planned;
use super::plan::{self, Asked};
use super::shard::{journal_of, not_started, own_shard, told};
use super::status::progress;
use crate::shell::{Exit, Failure, interrupt, with_progress};

/// How often a shard's process may end without a new row before the command gives up.
const DEATHS: u32 = 8;

/// Runs shards of a wave, `jobs` at a time.
pub fn shards(planned: &Planned, wanted: Vec<u64>, jobs: NonZeroUsize, any_version: bool) -> Result<(), Failure> {
    let control = interrupt::heed();
    let total = wanted.len() as u64;
    let queue = Mutex::new(VecDeque::from(wanted));
    let failed: Mutex<Option<Failure>> = Mutex::new(None);
    let worker = || {
        while !control.stop.load(Ordering::Relaxed) && failed.lock().unwrap_or_else(PoisonError::into_inner).is_none() {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
            let Some(index) = next else { break };
            match one(planned, index, any_version) {
                Ok(()) => drop(control.progress.fetch_add(1, Ordering::Relaxed)),
                Err(failure) => *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(failure),
            }
        }
    };
    with_progress(total, "shards", control, || {
        thread::scope(|scope| (0..jobs.get().min(total as usize)).for_each(|_| drop(scope.spawn(worker))));
    });
    if let Some(failure) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(failure);
    }
    interrupt::check()
}

/// Runs a shard in a process of its own until its file is there.
fn one(planned: &Planned, index: u64, any_version: bool) -> Result<(), Failure> {
    let rows = || fs::metadata(journal_of(planned, index)).map_or(0, |found| found.len());
    let (mut deaths, mut before) = (0, rows());
    loop {
        let mut command = own_shard(planned, index)?;
        command.args(any_version.then_some("--any-version")).stdin(Stdio::null()).stdout(Stdio::null());
        let mut child = Group::start(&mut command).map_err(not_started)?;
        let Some(status) = waited(&mut child)? else { return Ok(()) };
        if status.success() {
            return Ok(());
        }
        if let Some(code) = status.code().filter(|code| *code < 128) {
            let exit = Exit::of(code).unwrap_or(Exit::BadFile);
            return Err(Failure::new(exit, format!("shard {index} ended with exit code {code}")));
        }
        let now = rows();
        deaths = if now > before { 1 } else { deaths + 1 };
        before = now;
        if deaths >= DEATHS {
            return Err(Failure::file(format!(
                "shard {index} ended {deaths} times without a new row, {}",
                told(status)
            )));
        }
    }
}

/// Waits for a process; returns `None` when the command is interrupted.
pub fn waited(child: &mut Group) -> Result<Option<ExitStatus>, Failure> {
    let failed = |error| Failure::file(format!("this program cannot wait for another: {error}"));
    loop {
        let status = child.ended().map_err(failed)?;
        if interrupt::pressed() {
            return Ok(None);
        }
        if status.is_some() {
            return Ok(status);
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Runs `hpu sweep run`: plans, runs and gathers all waves.
pub fn run(asked: &Asked, command: &Described, jobs: NonZeroUsize, how: How, json: bool) -> Result<Exit, Failure> {
    let what = Path::new(asked.study);
    let dir = match asked.out {
        _ if what.is_dir() => {
            asked.of_folder()?;
            what
        }
        Some(out) => out,
        None => return Err(Failure::usage("write -o DIR: the folder of the sweep")),
    };
    if !what.is_dir() {
        plan::first(asked, dir, command, Some(jobs.get()))?;
    }
    let mut waves = Planned::waves(dir)?;
    let mut at = 0;
    loop {
        while at < waves.len() {
            shards(&waves[at], progress(&waves[at]).left, jobs, how.any_version)?;
            at += 1;
        }
        if let Err(failure) = gather(dir, how) {
            // Refused files were removed, and their shards run once more.
            if !how.again || failure.exit() != Exit::Differs {
                return Err(failure);
            }
            for wave in &waves {
                shards(wave, progress(wave).left, jobs, how.any_version)?;
            }
            gather(dir, How { again: false, ..how })?;
        }
        let Some((next, _)) = plan::next(dir, asked.size, Some(jobs.get()))? else { break };
        waves.push(next);
    }
    super::gather::run(dir, How { again: false, ..how }, json)
}
