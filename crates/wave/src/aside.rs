//! A sink that writes its file on another thread.

use std::io;
use std::mem;
use std::panic;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::{self, JoinHandle};

use crate::Sink;

/// Passes all changes to another thread, which writes them in the same order. Errors are returned at the end.
///
/// The run waits once the thread is a few batches behind, so that memory stays bounded.
pub struct Aside<S: Sink> {
    batch: Vec<Change>,
    full: SyncSender<Vec<Change>>,
    empty: Receiver<Vec<Change>>,
    worker: JoinHandle<io::Result<S::Out>>,
}

/// A change that a sink is given.
#[derive(Clone, Copy)]
enum Change {
    Time(u64),
    Word(u32, i64),
    Real(u32, f64),
}

/// Changes in a batch. A batch fits in a processor's cache.
const BATCH: usize = 1 << 15;
/// The number of batches in use at a time.
const BATCHES: usize = 4;

impl<S: Sink + Send + 'static> Aside<S>
where
    S::Out: Send,
{
    pub(crate) fn new(mut sink: S) -> Self {
        let (full, filled) = mpsc::sync_channel::<Vec<Change>>(BATCHES);
        let (emptied, empty) = mpsc::channel();
        let worker = thread::spawn(move || {
            // Memory that is touched here is already allocated when the run needs it.
            for _ in 0..2 {
                let mut batch = vec![Change::Time(1); BATCH];
                batch.clear();
                let _ = emptied.send(batch);
            }
            let mut written = Ok(());
            for mut batch in filled {
                for change in batch.drain(..) {
                    written = written.and_then(|()| match change {
                        Change::Time(time) => sink.time(time),
                        Change::Word(slot, word) => sink.word(slot as usize, word),
                        Change::Real(slot, value) => sink.real(slot as usize, value),
                    });
                }
                // The receiver is gone only when the run has ended.
                let _ = emptied.send(batch);
            }
            written.and_then(|()| sink.finish())
        });
        Self { batch: Vec::with_capacity(BATCH / 32), full, empty, worker }
    }
}

impl<S: Sink> Aside<S> {
    fn hand_over(&mut self) {
        let next = self.empty.try_recv().unwrap_or_else(|_| Vec::with_capacity(BATCH));
        // Sending fails only after a panic of the other thread, which `finish` passes on.
        let _ = self.full.send(mem::replace(&mut self.batch, next));
    }

    #[inline]
    fn put(&mut self, change: Change) {
        self.batch.push(change);
        if self.batch.len() == self.batch.capacity() {
            self.hand_over();
        }
    }
}

impl<S: Sink> Sink for Aside<S> {
    type Out = S::Out;

    #[inline]
    fn time(&mut self, time: u64) -> io::Result<()> {
        self.put(Change::Time(time));
        Ok(())
    }

    #[inline]
    fn word(&mut self, slot: usize, word: i64) -> io::Result<()> {
        self.put(Change::Word(slot as u32, word));
        Ok(())
    }

    #[inline]
    fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
        self.put(Change::Real(slot as u32, value));
        Ok(())
    }

    /// # Panics
    ///
    /// When the other thread has panicked.
    fn finish(mut self) -> io::Result<S::Out> {
        self.hand_over();
        drop(self.full);
        self.worker.join().unwrap_or_else(|why| panic::resume_unwind(why))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records the changes that it is given, slowly from time to time, until there is no more room.
    #[derive(Default)]
    struct Notes {
        told: Vec<(usize, u64)>,
        room: usize,
        has_refused: bool,
    }

    impl Notes {
        fn put(&mut self, what: usize, bits: u64) -> io::Result<()> {
            assert!(!self.has_refused, "told after an error");
            if self.told.len() == self.room {
                self.has_refused = true;
                return Err(io::ErrorKind::StorageFull.into());
            }
            if self.told.len().is_multiple_of(10_007) {
                thread::sleep(std::time::Duration::from_millis(2));
            }
            self.told.push((what, bits));
            Ok(())
        }
    }

    impl Sink for Notes {
        type Out = Vec<(usize, u64)>;

        fn time(&mut self, time: u64) -> io::Result<()> {
            assert_ne!(time, 666, "no more");
            self.put(0, time)
        }
        fn word(&mut self, slot: usize, word: i64) -> io::Result<()> {
            self.put(slot, word.cast_unsigned())
        }
        fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
            self.put(slot, value.to_bits())
        }
        fn finish(self) -> io::Result<Self::Out> {
            Ok(self.told)
        }
    }

    /// More changes than all batches in use can hold.
    const CHANGES: usize = 3 * BATCHES * BATCH;

    fn tell(sink: &mut impl Sink) -> io::Result<()> {
        for n in 0..CHANGES {
            match n % 3 {
                0 => sink.time(1_000 + n as u64)?,
                1 => sink.word(n, -(n as i64))?,
                _ => sink.real(n, 0.5 * n as f64)?,
            }
        }
        Ok(())
    }

    #[test]
    fn all_is_told_in_order_whoever_is_the_slower() {
        let mut here = Notes { room: usize::MAX, ..Notes::default() };
        tell(&mut here).unwrap();
        let mut aside = Aside::new(Notes { room: usize::MAX, ..Notes::default() });
        tell(&mut aside).unwrap();
        let there = aside.finish().unwrap();
        assert_eq!(there.len(), CHANGES);
        assert!(there == here.told);
    }

    #[test]
    fn an_error_comes_back_and_nothing_is_told_after_it() {
        for room in [0, 1, BATCH, CHANGES - 1] {
            let mut aside = Aside::new(Notes { room, ..Notes::default() });
            tell(&mut aside).unwrap();
            assert_eq!(aside.finish().unwrap_err().kind(), io::ErrorKind::StorageFull, "room for {room}");
        }
    }

    #[test]
    #[should_panic(expected = "no more")]
    fn a_panic_over_there_comes_back() {
        let mut aside = Aside::new(Notes { room: usize::MAX, ..Notes::default() });
        aside.time(666).unwrap();
        tell(&mut aside).unwrap();
        let _ = aside.finish();
    }
}
