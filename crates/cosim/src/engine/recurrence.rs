//! Recurrence: a run that comes back to a state, to the last bit, repeats for ever.
//!
//! The engine computes the next state from the present one alone, in whole numbers and in double-double, whose rounding
//! repeats too. In such numbers a motion that attracts its neighbours comes, as a rule, to its cycle after finite time,
//! to the last bit. From then on nothing new can happen, as long as nothing is planned for a fixed time (a knot of the
//! hand, a ramp, a fault, a sample of a shaper).
//!
//! States are looked at where a count of the encoder arrives. Each leaves a [`Mark`], of which a table holds up to a
//! thousand. If a mark comes again, the engine copies the state, and compares the state in full with the copy when as
//! many edges have passed again. Registers lag behind in different ways, so both are brought up to date first. If they
//! are equal, the run repeats.
//!
//! If the observer needs neither waveforms nor means between rows, the engine then shows and counts the periods that
//! are left without computing them. Their rows and changes of nets are those of the period between the two states,
//! counts and energies grow by as much, and the world is moved on. The rest of the run, less than a period, is computed
//! as ever.

use hpu_datapath::Wiring;
use hpu_signal::{Cycle, Observe};

use super::{ClosedLoop, Control};
use crate::summary::Recurrence;
use crate::world::World;

/// A number that tells states apart, and the edge at which it was seen.
type Mark = (u64, u64);

/// The number of marks held, a power of two.
const MARKS: usize = 1 << 10;

/// The most numbers that a record of rows may have, and one of nets.
const MOST_NUMBERS: u64 = 1 << 22;

/// The search for a recurrence.
pub(super) struct Search<W, E> {
    marks: Vec<Mark>,
    /// A mark with one of these bits is not noted. A bit is added whenever the table may be full, so that it holds
    /// marks of early states and of late ones.
    passed: u64,
    /// Marks noted since the last bit was added.
    noted: usize,
    pub(super) trial: Option<Trial<W, E>>,
    pub(super) found: Option<Recurrence>,
}

impl<W, E> Default for Search<W, E> {
    fn default() -> Self {
        Self { marks: Vec::new(), passed: 0, noted: 0, trial: None, found: None }
    }
}

impl<W, E> Search<W, E> {
    /// Notes a mark, and returns how many edges ago it was seen before.
    #[inline]
    pub(super) fn seen(&mut self, mark: u64, edge: u64) -> Option<u64> {
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
pub(super) struct Trial<W, E> {
    /// Its edge, and the edge at which it is expected.
    pub(super) from: u64,
    pub(super) due: u64,
    pub(super) wiring: W,
    pub(super) world: E,
    /// Ticks and changes of the outputs up to it.
    pub(super) counted: [u64; 2],
    /// A record of so many periods that rows come back to their places, if these periods can be shown again.
    pub(super) tape: Option<Tape>,
}

/// A record of the nets in so many periods that rows come back to their places. The rows themselves hold theirs.
pub(super) struct Tape {
    /// The edges of these periods.
    pub(super) edges: u64,
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
    pub(super) fn new<E: World>(period: u64, stride: u64, left: u64, followed: u64, words: &[i64]) -> Option<Self> {
        let edges = period.checked_mul(stride / common_divisor(period, stride))?;
        let numbers = (edges / stride).checked_mul(E::REALS.len() as u64)?;
        (edges <= left / 2 && numbers <= MOST_NUMBERS).then(|| {
            let (changes, latest) = (Vec::new(), words.to_vec());
            Self { edges, changes, words: Vec::new(), followed, latest }
        })
    }

    /// Notes the words of all nets after an edge. Returns `false` if there are too many changes to be noted.
    pub(super) fn note(&mut self, edge: u64, words: &[i64]) -> bool {
        let differs = |net: usize| self.followed >> net & 1 == 1 && words[net] != self.latest[net];
        if (0..words.len()).any(differs) {
            self.latest.copy_from_slice(words);
            self.changes.push(edge);
            self.words.extend_from_slice(words);
        }
        self.words.len() as u64 <= MOST_NUMBERS
    }

    /// Shows the changes again, so many times these edges later.
    pub(super) fn show(&self, times: u64, observer: &mut impl Observe) {
        for (edge, words) in self.changes.iter().zip(self.words.chunks_exact(self.latest.len())) {
            observer.nets(Cycle(edge + times * self.edges), words);
        }
    }
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out>> ClosedLoop<W, E> {
    /// Looks for a recurrence after a tick at which a count of the encoder has arrived. Once one is found, shows and
    /// counts the periods that are left, as far as the observer can do with that.
    #[inline(always)]
    pub(super) fn look_back<O: Observe>(&mut self, end: u64, observer: &mut O, control: &Control)
    where
        W: Clone,
    {
        self.turned = false;
        // Outputs that repeat change at edges of their own. The other states are enough.
        if self.repeated.is_some() || self.search.trial.as_ref().is_some_and(|trial| self.edge < trial.due) {
            return;
        }
        if let Some(trial) = self.search.trial.take() {
            self.compare_with(trial, end, observer, control);
        } else if self.search.found.is_none()
            && let Some(mark) = self.world.mark()
            && let Some(period) = self.search.seen(mark, self.edge)
        {
            self.expect(period, end, observer);
        }
    }

    /// Copies the present state, which is expected to recur after a number of edges.
    #[inline(never)]
    fn expect<O: Observe>(&mut self, period: u64, end: u64, observer: &mut O)
    where
        W: Clone,
    {
        self.rows.log(&self.world, self.edge - 1, observer);
        let needs_all = self.watched == u64::MAX || observer.relates() || self.rows.row.is_some();
        let (left, words) = (end.saturating_sub(self.edge), self.wiring.words());
        let tape = if needs_all { None } else { Tape::new::<E>(period, self.rows.stride, left, self.watched, words) };
        if let Some(tape) = &tape {
            self.rows.record(tape.edges);
        }
        self.search.trial = Some(Trial {
            from: self.edge,
            due: self.edge + period,
            wiring: self.wiring.clone(),
            world: self.world.clone(),
            counted: [self.ticks, self.output_changes],
            tape,
        });
    }

    /// Compares the present state with that of a trial which is due.
    #[inline(never)]
    fn compare_with<O: Observe>(&mut self, mut trial: Trial<W, E>, end: u64, observer: &mut O, control: &Control) {
        if self.search.found.is_none() {
            let recurs = self.edge == trial.due && self.wiring.recurs(&trial.wiring) && self.world.recurs(&trial.world);
            let (from, period) = (trial.from, trial.due - trial.from);
            self.search.found = recurs.then_some(Recurrence { from, period });
        }
        let recorded = trial.tape.as_ref().filter(|_| self.search.found.is_some()).map(|tape| trial.from + tape.edges);
        match recorded {
            // The rows of the tape come back to their places after some more periods.
            Some(recorded) if self.edge < recorded => {
                trial.due = recorded;
                self.search.trial = Some(trial);
            }
            Some(recorded) if self.edge == recorded => self.repeat(&trial, end, observer, control),
            _ => self.rows.forget(),
        }
    }

    /// Shows and counts what a trial has recorded, as often as it happens before `end` or until the run is stopped.
    fn repeat<O: Observe>(&mut self, trial: &Trial<W, E>, end: u64, observer: &mut O, control: &Control) {
        let Some(tape) = &trial.tape else { return };
        self.rows.log(&self.world, self.edge - 1, observer);
        let mut times = 0;
        while times < (end - self.edge) / tape.edges && control.goes_on(self.edge + times * tape.edges, 0) {
            times += 1;
            tape.show(times, observer);
            self.rows.show_again(times * tape.edges, E::REALS.len(), observer);
        }
        let energies = [trial.world.energy(trial.from), self.world.energy(self.edge)];
        self.rows.repeat(tape.edges, times, &energies);
        let [ticks, output_changes] = trial.counted;
        self.ticks += times * (self.ticks - ticks);
        self.output_changes += times * (self.output_changes - output_changes);
        self.wiring.repeat(&trial.wiring, times);
        self.world.repeat(&trial.world, times);
        self.edge += times * tape.edges;
    }
}

/// Returns the greatest common divisor of two numbers, by Euclid.
fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}
