//! An observer on a thread of its own.

use std::mem;
use std::panic;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::{self, JoinHandle};

use hpu_signal::{Cycle, Observe};

/// Shows another thread's observer what it sees itself, in the same order, so that a run need not wait for files.
///
/// The run is held up once the other is a few batches behind: memory stays bounded.
#[must_use = "an observer has seen all only after `finish`"]
pub struct Aside<O> {
    batch: Batch,
    full: SyncSender<Batch>,
    empty: Receiver<Batch>,
    worker: JoinHandle<O>,
}

/// A stretch of what was seen: of each sight its edge and how much of the words, or of the values, it is.
#[derive(Default)]
struct Batch {
    sights: Vec<(Cycle, Sight)>,
    words: Vec<i64>,
    values: Vec<f64>,
}

enum Sight {
    Nets(usize),
    Reals(usize),
}

/// Words and values of a batch, about: it fits in a processor's cache.
const BATCH: usize = 1 << 14;
/// Batches on their way.
const BATCHES: usize = 4;

impl<O: Observe + Send + 'static> Aside<O> {
    /// Lets an observer look on from a thread of its own.
    pub fn new(mut observer: O) -> Self {
        let (full, filled) = mpsc::sync_channel::<Batch>(BATCHES);
        let (emptied, empty) = mpsc::channel();
        let worker = thread::spawn(move || {
            for mut batch in filled {
                batch.show(&mut observer);
                // Whoever no longer listens is done.
                let _ = emptied.send(batch);
            }
            observer
        });
        Self { batch: Batch::default(), full, empty, worker }
    }

    /// The observer, when it has seen all.
    ///
    /// # Panics
    ///
    /// When it has panicked.
    pub fn finish(mut self) -> O {
        self.hand_over();
        drop(self.full);
        self.worker.join().unwrap_or_else(|why| panic::resume_unwind(why))
    }

    fn hand_over(&mut self) {
        let next = self.empty.try_recv().unwrap_or_default();
        // It fails only after a panic over there, which `finish` passes on.
        let _ = self.full.send(mem::replace(&mut self.batch, next));
    }

    #[inline]
    fn saw(&mut self, cycle: Cycle, sight: Sight) {
        self.batch.sights.push((cycle, sight));
        if self.batch.words.len() + self.batch.values.len() >= BATCH {
            self.hand_over();
        }
    }
}

impl Batch {
    /// Shows it, which empties it.
    fn show(&mut self, observer: &mut impl Observe) {
        let (mut words, mut values) = (&self.words[..], &self.values[..]);
        for &(cycle, ref sight) in &self.sights {
            match *sight {
                Sight::Nets(count) => {
                    let (now, later) = words.split_at(count);
                    observer.nets(cycle, now);
                    words = later;
                }
                Sight::Reals(count) => {
                    let (now, later) = values.split_at(count);
                    observer.reals(cycle, now);
                    values = later;
                }
            }
        }
        self.sights.clear();
        self.words.clear();
        self.values.clear();
    }
}

impl<O: Observe + Send + 'static> Observe for Aside<O> {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.batch.words.extend_from_slice(words);
        self.saw(cycle, Sight::Nets(words.len()));
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.batch.values.extend_from_slice(values);
        self.saw(cycle, Sight::Reals(values.len()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Notes all that it sees, slowly now and then.
    #[derive(Default)]
    struct Notes(Vec<(Cycle, Vec<i64>, Vec<f64>)>);

    impl Observe for Notes {
        fn nets(&mut self, cycle: Cycle, words: &[i64]) {
            if cycle.0.is_multiple_of(1009) {
                thread::sleep(std::time::Duration::from_micros(200));
            }
            self.0.push((cycle, words.to_vec(), Vec::new()));
        }

        fn reals(&mut self, cycle: Cycle, values: &[f64]) {
            self.0.push((cycle, Vec::new(), values.to_vec()));
        }
    }

    #[test]
    fn all_is_seen_in_order_whoever_is_the_slower() {
        let sights = 40_000;
        let mut aside = Aside::new(Notes::default());
        for n in 0..sights {
            let cycle = Cycle(n);
            match n % 3 {
                0 => aside.reals(cycle, &[0.5 * n as f64, -1.0]),
                size => aside.nets(cycle, &vec![n.cast_signed(); 3 * size as usize]),
            }
        }
        let seen = aside.finish().0;
        assert_eq!(seen.len() as u64, sights);
        for (n, (cycle, words, values)) in (0..).zip(seen) {
            assert_eq!(cycle, Cycle(n));
            match n % 3 {
                0 => assert_eq!((words, values), (vec![], vec![0.5 * n as f64, -1.0])),
                size => assert_eq!((words, values), (vec![n.cast_signed(); 3 * size as usize], vec![])),
            }
        }
    }

    #[test]
    #[should_panic(expected = "no more")]
    fn a_panic_over_there_comes_back() {
        struct Weary;
        impl Observe for Weary {
            fn nets(&mut self, _: Cycle, _: &[i64]) {
                panic!("no more");
            }
            fn reals(&mut self, _: Cycle, _: &[f64]) {}
        }
        let mut aside = Aside::new(Weary);
        for n in 0..100_000 {
            aside.nets(Cycle(n), &[0; 8]);
        }
        aside.finish();
    }
}
