//! What both formats share: which values changed, when the clock toggles, and the first error.

use std::io;

use hpu_signal::{Clock, Cycle, Format, Observe};

use super::timescale::Timescale;
use super::{Layout, Source};

/// A file format that takes value changes. Variables are numbered by source: nets, reals, clock, reset, constants.
pub trait Sink {
    /// What the file was written to, handed back at the end.
    type Out;

    /// Begins an instant, later than all before, in units of the file.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn time(&mut self, time: u64) -> io::Result<()>;
    /// A new word, as the characters `0` and `1`, the most significant bit first.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn word(&mut self, slot: usize, digits: &[u8]) -> io::Result<()>;
    /// A new real.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn real(&mut self, slot: usize, value: f64) -> io::Result<()>;
    /// Completes the file.
    ///
    /// # Errors
    ///
    /// When writing fails.
    fn finish(self) -> io::Result<Self::Out>;
}

/// A waveform being written. Only changes are, and no call allocates.
///
/// An [`Observe`]r cannot fail, so the first error is kept, nothing more is written, and [`finish`](Self::finish) returns
/// it.
#[must_use = "a recording is complete only after `finish`"]
pub struct Recording<S> {
    sink: S,
    timescale: Timescale,
    /// Of each net that the file shows.
    formats: Vec<Option<Format>>,
    /// Of each net the latest word, once there is one.
    words: Vec<i64>,
    has_words: bool,
    reals: Vec<Option<f64>>,
    first_real: usize,
    clk: Option<usize>,
    now: Cycle,
    time: u64,
    error: Option<io::Error>,
}

impl<S: Sink> Recording<S> {
    /// Begins the recording at time 0.
    pub(super) fn begin(mut sink: S, layout: &Layout, clock: Clock) -> io::Result<Self> {
        sink.time(0)?;
        if layout.shows(Source::Reset) {
            sink.word(layout.slot(Source::Reset), b"0")?;
        }
        let clk = layout.shows(Source::Clock).then(|| layout.slot(Source::Clock));
        if let Some(clk) = clk {
            sink.word(clk, b"1")?;
        }
        for (index, &(format, word)) in layout.tied.iter().enumerate() {
            sink.word(layout.slot(Source::Tied(index)), digits(format, word, &mut [0; 64]))?;
        }
        let nets = layout.nets.iter().enumerate();
        Ok(Self {
            sink,
            timescale: Timescale::of(clock),
            formats: nets.map(|(index, net)| layout.shows(Source::Net(index)).then_some(net.format)).collect(),
            words: vec![0; layout.nets.len()],
            has_words: false,
            reals: vec![None; layout.reals.len()],
            first_real: layout.slot(Source::Real(0)),
            clk,
            now: Cycle(0),
            time: 0,
            error: None,
        })
    }

    /// Completes the file, which then lasts until `end` (and one edge at least, as an FST of a single instant would show
    /// no values), and hands back what it was written to.
    ///
    /// # Errors
    ///
    /// The first error since the recording began: of the device (a full disk), or
    /// [`InvalidInput`](io::ErrorKind::InvalidInput) when a call went back in time.
    pub fn finish(mut self, end: Cycle) -> io::Result<S::Out> {
        self.attempt(|recording| recording.reach(end.max(Cycle(1))));
        match self.error {
            Some(error) => Err(error),
            None => self.sink.finish(),
        }
    }

    /// Goes on with the file unless it has failed already.
    fn attempt(&mut self, write: impl FnOnce(&mut Self) -> io::Result<()>) {
        if self.error.is_none() {
            self.error = write(self).err();
        }
    }

    /// Brings the file to an edge, toggling the clock on the way.
    fn reach(&mut self, cycle: Cycle) -> io::Result<()> {
        if cycle < self.now {
            let text = format!("a waveform at edge {} cannot go back to edge {}", self.now.0, cycle.0);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        if let Some(clk) = self.clk {
            for next in self.now.0..cycle.0 {
                let rise = self.timescale.at(Cycle(next + 1));
                self.time(self.time.midpoint(rise))?;
                self.sink.word(clk, b"0")?;
                self.time(rise)?;
                self.sink.word(clk, b"1")?;
            }
        }
        self.now = cycle;
        self.time(self.timescale.at(cycle))
    }

    fn time(&mut self, time: u64) -> io::Result<()> {
        if time > self.time {
            self.sink.time(time)?;
            self.time = time;
        }
        Ok(())
    }

    fn write_nets(&mut self, cycle: Cycle, words: &[i64]) -> io::Result<()> {
        if !self.has_words {
            // Whatever comes first is new.
            self.words.iter_mut().zip(words).for_each(|(known, word)| *known = !word);
            self.has_words = true;
        }
        let mut reached = false;
        for (index, &word) in words.iter().enumerate() {
            if self.words[index] == word {
                continue;
            }
            self.words[index] = word;
            let Some(format) = self.formats[index] else { continue };
            if !reached {
                self.reach(cycle)?;
                reached = true;
            }
            self.sink.word(index, digits(format, word, &mut [0; 64]))?;
        }
        Ok(())
    }

    fn write_reals(&mut self, cycle: Cycle, values: &[f64]) -> io::Result<()> {
        let same = |known: &Option<f64>, value: f64| known.is_some_and(|known| known.to_bits() == value.to_bits());
        if self.reals.iter().zip(values).all(|(known, &value)| same(known, value)) {
            return Ok(());
        }
        self.reach(cycle)?;
        for (index, (known, &value)) in self.reals.iter_mut().zip(values).enumerate() {
            if !same(known, value) {
                *known = Some(value);
                self.sink.real(self.first_real + index, value)?;
            }
        }
        Ok(())
    }
}

impl<S: Sink> Observe for Recording<S> {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.attempt(|recording| recording.write_nets(cycle, words));
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.attempt(|recording| recording.write_reals(cycle, values));
    }
}

/// The word's bits as characters, the most significant first.
fn digits(format: Format, word: i64, text: &mut [u8; 64]) -> &[u8] {
    let width = format.width();
    // The most significant bit first in the first byte.
    let bits = format.bits(word) << (64 - width);
    let chunks = text.chunks_exact_mut(8).zip(bits.to_be_bytes());
    for (chunk, byte) in chunks.take(width.div_ceil(8) as usize) {
        chunk.copy_from_slice(&EIGHT_DIGITS[usize::from(byte)]);
    }
    &text[..width as usize]
}

/// The characters of all bytes.
static EIGHT_DIGITS: [[u8; 8]; 256] = {
    let mut all = [[b'0'; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut place = 0;
        while place < 8 {
            all[byte][place] += (byte >> (7 - place)) as u8 & 1;
            place += 1;
        }
        byte += 1;
    }
    all
};
