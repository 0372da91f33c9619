//! Recurrence: a run that comes back to a state, to the last bit, repeats for ever.
//!
//! The engine computes the next state from the present one alone, in whole numbers and in double-double, whose rounding
//! repeats too. A limit cycle that attracts its neighbours is reached after finite time in such numbers. From then on
//! nothing new can happen, as long as nothing is planned at a time fixed beforehand (a knot of the hand, a ramp, a
//! fault, a sample of a shaper).
//!
//! States are looked at where a count of the encoder arrives: each leaves a [`Mark`], of which a table holds the latest
//! thousand. If a mark comes again, the state is copied, and compared in full when as many edges have passed again.
//! Registers lag behind in different ways; both copies are brought up to date first. If the states are equal, the run
//! repeats. If its observer needs neither waveform nor means of rows, the periods that are left are then shown and counted
//! without being computed: rows and changes of nets are those of the period between the two states, counts and energies
//! grow by as much, and the world is moved on. What remains of the run, less than a period, is computed as ever.

use hpu_signal::{Cycle, Observe};

use crate::summary::Recurrence;
use crate::world::World;

/// A number that tells states apart, and the edge at which it was seen.
type Mark = (u64, u64);

/// The number of marks held, a power of two.
const MARKS: usize = 1 << 10;

/// The most numbers that the rows of a period may have, and its changes of nets, if it is to be shown again.
const MOST_NUMBERS: u64 = 1 << 22;

/// The search for a recurrence.
pub(crate) struct Search<W, E> {
    marks: Vec<Mark>,
    /// Marks are noted that have none of these bits. As more and more come, fewer and fewer are noted, so that the
    /// table holds some of all of them.
    passed: u64,
    /// Marks noted since one more bit was demanded.
    noted: usize,
    pub(crate) trial: Option<Trial<W, E>>,
    pub(crate) found: Option<Recurrence>,
}

impl<W, E> Default for Search<W, E> {
    fn default() -> Self {
        Self { marks: Vec::new(), passed: 0, noted: 0, trial: None, found: None }
    }
}

impl<W, E> Search<W, E> {
    /// Notes a mark, and returns how many edges ago it was seen before.
    #[inline]
    pub(crate) fn seen(&mut self, mark: u64, edge: u64) -> Option<u64> {
        if mark & self.passed != 0 { None } else { self.note(mark, edge) }
    }

    fn note(&mut self, mark: u64, edge: u64) -> Option<u64> {
        if self.marks.is_empty() {
            self.marks.resize(MARKS, (0, 0));
        }
        self.noted += 1;
        if self.noted == MARKS {
            (self.noted, self.passed) = (0, self.passed << 1 | 1);
        }
        let place = &mut self.marks[(mark >> 32) as usize % MARKS];
        let (before, at) = std::mem::replace(place, (mark, edge));
        (before == mark && at != 0).then(|| edge - at)
    }
}

/// A state that is expected to recur.
pub(crate) struct Trial<W, E> {
    /// Its edge, and the edge at which it is expected.
    pub(crate) from: u64,
    pub(crate) due: u64,
    pub(crate) wiring: W,
    pub(crate) world: E,
    /// Ticks and changes of the outputs up to it.
    pub(crate) counted: [u64; 2],
    /// What happens in a number of periods, if it can be shown again.
    pub(crate) tape: Option<Tape>,
}

/// What the observer of a run is shown in a number of periods after which rows come at the same edges of a period.
pub(crate) struct Tape {
    /// The edges of these periods.
    pub(crate) edges: u64,
    /// The edges at which nets changed that are followed, and then the words of all nets, edge after edge.
    changes: Vec<u64>,
    words: Vec<i64>,
    /// The nets that are followed, a bit each, and the latest words.
    followed: u64,
    latest: Vec<i64>,
}

impl Tape {
    /// Creates a tape of as many periods as bring rows back to the same place, one every `stride` edges, and `None` if
    /// `left` edges do not contain it twice.
    pub(crate) fn new<E: World>(period: u64, stride: u64, left: u64, followed: u64, words: &[i64]) -> Option<Self> {
        let edges = period.checked_mul(stride / common_divisor(period, stride))?;
        let numbers = (edges / stride).checked_mul(E::REALS.len() as u64)?;
        (edges <= left / 2 && numbers <= MOST_NUMBERS).then(|| {
            let (changes, latest) = (Vec::new(), words.to_vec());
            Self { edges, changes, words: Vec::new(), followed, latest }
        })
    }

    /// Notes the words of all nets after an edge. Returns `false` if there are too many changes to be noted.
    pub(crate) fn note(&mut self, edge: u64, words: &[i64]) -> bool {
        let differs = |net: usize| self.followed >> net & 1 == 1 && words[net] != self.latest[net];
        if (0..words.len()).any(differs) {
            self.latest.copy_from_slice(words);
            self.changes.push(edge);
            self.words.extend_from_slice(words);
        }
        self.words.len() as u64 <= MOST_NUMBERS
    }

    /// Shows the changes again, so many times these edges later.
    pub(crate) fn show(&self, times: u64, observer: &mut impl Observe) {
        for (edge, words) in self.changes.iter().zip(self.words.chunks_exact(self.latest.len())) {
            observer.nets(Cycle(edge + times * self.edges), words);
        }
    }
}

/// Returns the greatest common divisor of two numbers, by Euclid.
fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}
