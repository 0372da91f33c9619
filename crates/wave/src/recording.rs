//! The part that both formats share: it finds changed values, toggles the clock, and keeps the first error.

use std::io;

use hpu_signal::{Clock, Cycle, Observe};

use crate::aside::Aside;
use crate::layout::Shown;
use crate::timescale::Timescale;
use crate::{Layout, Sink, Source};

/// A waveform that is being written. Only changes are written.
///
/// An [`Observe`]r cannot return an error. So the first error is kept, nothing more is written, and
/// [`finish`](Self::finish) returns the error.
#[must_use = "a recording is complete only after `finish`"]
pub struct Recording<S> {
    file: Timed<S>,
    /// Whether the file shows each net.
    shown: Vec<bool>,
    /// The latest word of each net, once there is one.
    words: Vec<i64>,
    has_words: bool,
    /// The latest value of each output, and its source in a row.
    reals: Vec<(Option<f64>, Shown)>,
    first_real: usize,
    /// The nets whose overflows are shown, the slot of the first of their bits, and the latest set once there is one.
    overflows: Vec<usize>,
    first_overflow: usize,
    overflowing: Option<u64>,
    error: Option<io::Error>,
}

/// A file, and the time that it has reached.
struct Timed<S> {
    sink: S,
    timescale: Timescale,
    clk: Option<usize>,
    now: Cycle,
    time: u64,
}

/// The number of words that are compared together, to skip unchanged ones quickly.
const TOGETHER: usize = 8;

impl<S: Sink> Recording<S> {
    /// Begins the recording at time 0.
    pub(crate) fn begin(mut sink: S, layout: &Layout, clock: Clock) -> io::Result<Self> {
        sink.time(0)?;
        if layout.shows(Source::Reset) {
            sink.word(layout.slot(Source::Reset), 0)?;
        }
        let clk = layout.shows(Source::Clock).then(|| layout.slot(Source::Clock));
        if let Some(clk) = clk {
            sink.word(clk, 1)?;
        }
        for (index, &word) in layout.tied.iter().enumerate() {
            sink.word(layout.slot(Source::Tied(index)), word)?;
        }
        Ok(Self {
            file: Timed { sink, timescale: Timescale::of(clock), clk, now: layout.begin, time: 0 },
            shown: (0..layout.nets.len()).map(|index| layout.shows(Source::Net(index))).collect(),
            words: vec![0; layout.nets.len()],
            has_words: false,
            reals: layout.columns.iter().map(|column| (None, *column)).collect(),
            first_real: layout.slot(Source::Real(0)),
            overflows: layout.overflows.clone(),
            first_overflow: layout.nets.len() - layout.overflows.len(),
            overflowing: None,
            error: None,
        })
    }

    /// Completes the file, which then lasts until `end`, and returns the writer. The file lasts one edge at least,
    /// because an FST of a single instant would show no values.
    ///
    /// # Errors
    ///
    /// The first error since the recording began: an error of the device (a full disk), or
    /// [`InvalidInput`](io::ErrorKind::InvalidInput) when a call went back in time.
    pub fn finish(mut self, end: Cycle) -> io::Result<S::Out> {
        self.attempt(|recording| recording.file.reach(end.max(Cycle(1))));
        match self.error {
            Some(error) => Err(error),
            None => self.file.sink.finish(),
        }
    }

    /// Writes to the file, unless it has failed already.
    #[inline]
    fn attempt(&mut self, write: impl FnOnce(&mut Self) -> io::Result<()>) {
        if self.error.is_none() {
            self.error = write(self).err();
        }
    }

    fn write_nets(&mut self, cycle: Cycle, words: &[i64]) -> io::Result<()> {
        if !self.has_words {
            // The first words all count as changed.
            self.words.iter_mut().zip(words).for_each(|(known, word)| *known = !word);
            self.has_words = true;
        }
        let all = self.words.chunks_mut(TOGETHER).zip(words.chunks(TOGETHER)).zip(self.shown.chunks(TOGETHER));
        let mut reached = false;
        for (group, ((known, words), shown)) in all.enumerate() {
            if known.iter().zip(words).fold(0, |differ, (known, word)| differ | (known ^ word)) == 0 {
                continue;
            }
            for (index, ((known, &word), &shown)) in known.iter_mut().zip(words).zip(shown).enumerate() {
                if *known != word {
                    *known = word;
                    if shown {
                        if !reached {
                            self.file.reach(cycle)?;
                            reached = true;
                        }
                        self.file.sink.word(TOGETHER * group + index, word)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn write_overflows(&mut self, cycle: Cycle, nets: u64) -> io::Result<()> {
        let changed = self.overflowing.map_or(u64::MAX, |known| known ^ nets);
        self.overflowing = Some(nets);
        for (index, &net) in self.overflows.iter().enumerate().filter(|(_, net)| changed >> **net & 1 == 1) {
            self.file.reach(cycle)?;
            self.file.sink.word(self.first_overflow + index, (nets >> net & 1).cast_signed())?;
        }
        Ok(())
    }

    fn write_reals(&mut self, cycle: Cycle, values: &[f64]) -> io::Result<()> {
        let same = |known: &Option<f64>, value: f64| known.is_some_and(|known| known.to_bits() == value.to_bits());
        if self.reals.iter().all(|(known, shown)| shown.of(values).is_none_or(|value| same(known, value))) {
            return Ok(());
        }
        self.file.reach(cycle)?;
        for (index, (known, shown)) in self.reals.iter_mut().enumerate() {
            let Some(value) = shown.of(values) else { continue };
            if !same(known, value) {
                *known = Some(value);
                self.file.sink.real(self.first_real + index, value)?;
            }
        }
        Ok(())
    }
}

impl<S: Sink> Timed<S> {
    /// Moves the file to an edge, and toggles the clock on the way.
    fn reach(&mut self, cycle: Cycle) -> io::Result<()> {
        if cycle < self.now {
            let text = format!("a waveform at edge {} cannot go back to edge {}", self.now.0, cycle.0);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        if let Some(clk) = self.clk {
            for next in self.now.0..cycle.0 {
                let rise = self.timescale.at(Cycle(next + 1));
                self.go_to(self.time.midpoint(rise))?;
                self.sink.word(clk, 0)?;
                self.go_to(rise)?;
                self.sink.word(clk, 1)?;
            }
        }
        self.now = cycle;
        self.go_to(self.timescale.at(cycle))
    }

    fn go_to(&mut self, time: u64) -> io::Result<()> {
        if time > self.time {
            self.sink.time(time)?;
            self.time = time;
        }
        Ok(())
    }
}

impl<S: Sink> Observe for Recording<S> {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.attempt(|recording| recording.write_nets(cycle, words));
    }

    fn watches_overflows(&self) -> bool {
        !self.overflows.is_empty()
    }

    fn overflows(&mut self, cycle: Cycle, nets: u64) {
        self.attempt(|recording| recording.write_overflows(cycle, nets));
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.attempt(|recording| recording.write_reals(cycle, values));
    }
}

impl<S: Sink + Send + 'static> Recording<S>
where
    S::Out: Send,
{
    /// Continues on a thread of its own, so that a run need not wait for the file. An error is known only at the end.
    pub fn aside(self) -> Recording<Aside<S>> {
        let Self { file, shown, words, has_words, reals, first_real, overflows, first_overflow, overflowing, error } =
            self;
        let Timed { sink, timescale, clk, now, time } = file;
        let file = Timed { sink: Aside::new(sink), timescale, clk, now, time };
        Recording { file, shown, words, has_words, reals, first_real, overflows, first_overflow, overflowing, error }
    }
}
