//! Recurrence: a run that comes back to a state, to the last bit, repeats for ever.
//!
//! The engine computes the next state from the present one alone, in whole numbers and in double-double, whose rounding
//! repeats too. In such numbers a motion that attracts its neighbours comes, as a rule, to its cycle after finite time,
//! to the last bit. From then on nothing new can happen, as long as nothing is planned for a fixed time (a knot of the
//! hand, a ramp, a fault, a sample of a shaper).
//!
//! States are looked at where a count of the encoder arrives. A table holds copies of the latest [`COPIES`] of some of
//! them, the fewer the longer the run, each with a number that tells states apart. Where such a number comes again, the
//! state is compared in full with the copy. Registers lag behind in different ways, so both are brought up to date
//! first. If they are equal, the run repeats.
//!
//! If the observer needs neither waveforms nor means between rows, the engine then shows and counts the periods that
//! are left without computing them. Their rows and changes of nets are those of one period, which a [`Tape`] holds.
//! Where periods are costly, a tape is begun before a recurrence is known; else the period that follows is recorded.
//! Counts and energies grow by as much for each period, and the loop goes on from the copy that brings it nearest to
//! the end of the run, or to the row from which means are taken. The rest is computed as ever.

use hpu_datapath::Wiring;
use hpu_signal::{Cycle, Observe};

#[cfg(not(target_family = "wasm"))]
use super::forever::MOST_BEATS;
use super::rows::Recorded;
use super::{ClosedLoop, Control};
use crate::result::forever::Recurrence;
use crate::world::World;

/// The number of copies held, and the number where the outputs changed [`OFTEN`] times or more for each count: periods
/// are then costly, and the loop is to go on from a copy nearer to its goal. These changes are the same for any
/// observer, and so is what is found.
const COPIES: [usize; 2] = [64, 128];
const OFTEN: u64 = 4;

/// The bits of a mark that are 0 in the states copied at first: one in eight.
const FEW: u64 = 7;

/// The most numbers that the rows of a tape may have, and its words.
const MOST_NUMBERS: u64 = 1 << 22;

/// A tape begins at a count if the outputs drove the world this often since the count before. A period then costs far
/// more to compute than to record.
const BUSY: u32 = 16;
/// The ticks that such a tape may have: one in as many edges, and [`AT_FIRST`] more.
const SPARSE: u64 = 1 << 12;
const AT_FIRST: u64 = 64;

/// The loop as it was when a count arrived.
struct Past<W, E: World> {
    edge: u64,
    wiring: W,
    world: E,
    input: E::In,
    out: E::Out,
    /// Ticks and changes of the outputs so far.
    counted: [u64; 2],
}

/// The search for a recurrence.
pub(super) struct Search<W, E: World> {
    /// Numbers that tell states apart, and copies of the states.
    marks: Vec<u64>,
    pasts: Vec<Box<Past<W, E>>>,
    /// A state whose mark has one of these bits is not copied. A bit is added whenever all places have been filled
    /// anew, so that the copies reach far back.
    passed: u64,
    /// The place of the next copy.
    place: usize,
    /// Counts of the encoder so far.
    counts: u64,
    /// Changes of outputs that repeat, and of the world under them, since the latest count.
    pub(super) driven: u32,
    pub(super) tape: Option<Box<Tape>>,
    round: Option<Round<W, E>>,
    found: Option<Recurrence>,
    /// The search beyond the end of a run.
    #[cfg(not(target_family = "wasm"))]
    beyond: Option<Far<W, E>>,
}

/// The search beyond the end of a run: beside the copies, each state is compared with one of them, which is replaced
/// after 1, 2, 4 and so on more (Brent 1980, "An improved Monte Carlo factorization algorithm"). Any period is found so
/// once the motion has come to its cycle, however few marks it has.
#[cfg(not(target_family = "wasm"))]
struct Far<W, E: World> {
    /// The nets that matter, if not all do.
    live: u64,
    /// The bits of [`Search::passed`] at the end of the run: all states are looked at now.
    passed: u64,
    latest: Option<Box<Past<W, E>>>,
    mark: u64,
    /// The states until it is replaced, and how many that were at its beginning.
    left: u64,
    of: u64,
}

impl<W, E: World> Default for Search<W, E> {
    fn default() -> Self {
        let (marks, pasts) = (Vec::new(), Vec::new());
        Self {
            marks,
            pasts,
            passed: FEW,
            place: 0,
            counts: 0,
            driven: 0,
            tape: None,
            round: None,
            found: None,
            #[cfg(not(target_family = "wasm"))]
            beyond: None,
        }
    }
}

/// So many periods that rows come back to their places.
struct Round<W, E: World> {
    /// The state at its beginning.
    then: Box<Past<W, E>>,
    edges: u64,
    /// The next edge at which to go on by whole rounds, at first the end of this one.
    due: u64,
    whole: Option<Whole<W, E>>,
}

/// The state at the end of a round, with its nets and rows.
type Whole<W, E> = (Box<Past<W, E>>, Box<Tape>, Recorded);

/// A record of the nets that are followed.
pub(super) struct Tape {
    /// The edge after which it begins, and the one at which it must end.
    first: u64,
    last: u64,
    /// The ticks seen, if it ends where they come too often.
    ticks: Option<u64>,
    /// The edges at which a net changed, and then the words of the nets, edge after edge.
    changes: Vec<u64>,
    words: Vec<i64>,
    /// The nets, each with its latest word.
    nets: Vec<(usize, i64)>,
}

impl Tape {
    /// Notes the words of all nets after an edge that was ticked. Returns `false` if the tape ends with it.
    fn note(&mut self, edge: u64, words: &[i64]) -> bool {
        if self.nets.iter().any(|&(net, latest)| words[net] != latest) {
            self.changes.push(edge);
            for (net, latest) in &mut self.nets {
                *latest = words[*net];
                self.words.push(*latest);
            }
        }
        let is_sparse = self.ticks.as_mut().is_none_or(|ticks| {
            *ticks += 1;
            *ticks <= AT_FIRST + (edge - self.first) / SPARSE
        });
        is_sparse && edge < self.last && self.words.len() as u64 <= MOST_NUMBERS
    }

    /// Shows the changes after one edge, up to another, this number of edges later. `words` are those of all nets.
    fn show(&self, (after, last): (u64, u64), later: u64, words: &mut [i64], observer: &mut impl Observe) {
        let at = |edge: u64| self.changes.partition_point(|&change| change <= edge);
        for index in at(after)..at(last) {
            let shown = &self.words[index * self.nets.len()..][..self.nets.len()];
            self.nets.iter().zip(shown).for_each(|(&(net, _), &word)| words[net] = word);
            observer.nets(Cycle(self.changes[index] + later), words);
        }
    }
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out>> ClosedLoop<W, E> {
    /// Returns the recurrence that a run by events has found, if any.
    pub fn recurrence(&self) -> Option<Recurrence> {
        self.search.found
    }

    /// Notes the nets on the tape after an edge that was ticked. Most edges have no tape.
    #[cold]
    pub(super) fn note_nets(&mut self) {
        if let Some(tape) = &mut self.search.tape
            && !tape.note(self.edge, self.wiring.words())
        {
            self.let_go();
        }
    }

    /// Lets go of a tape that is of no use.
    fn let_go(&mut self) {
        (self.search.tape, self.search.round) = (None, None);
        self.rows.forget();
    }
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone> ClosedLoop<W, E> {
    /// Begins a run: all of it is searched anew.
    pub(super) fn look_from_here(&mut self) {
        self.search = Search { found: self.search.found, ..Search::default() };
        self.rows.forget();
    }

    /// Looks for a recurrence after a tick at which a count of the encoder has arrived. Once one is found, shows and
    /// counts the periods that are left, as far as the observer can do with that.
    #[inline(always)]
    pub(super) fn look_back<O: Observe>(&mut self, end: u64, observer: &mut O, control: &Control) {
        self.turned = false;
        let search = &mut self.search;
        search.counts += 1;
        let driven = std::mem::take(&mut search.driven);
        // Outputs that repeat change at edges of their own. The other states are enough.
        if self.repeated.is_some() {
            return;
        }
        if search.found.is_some() {
            if search.round.as_ref().is_some_and(|round| round.due <= self.edge) {
                self.go_round(end, observer, control);
            }
            return;
        }
        if driven >= BUSY && search.tape.is_none() {
            self.record(Some(0), observer);
        }
        if let Some(mark) = self.world.mark()
            && mark & self.search.passed == 0
        {
            self.note(mark, end, observer, control);
        }
    }

    /// Compares the present state with the copy of the same mark, and copies it.
    #[inline(never)]
    fn note<O: Observe>(&mut self, mark: u64, end: u64, observer: &mut O, control: &Control) {
        #[cfg(not(target_family = "wasm"))]
        if self.compare_far(mark) {
            return;
        }
        let known = self.search.marks.iter().position(|&known| known == mark);
        if let Some(place) = known {
            let past = &self.search.pasts[place];
            if self.is_as_in(past) && self.world.recurs(&past.world) {
                let past = self.search.pasts.swap_remove(place);
                self.search.found = Some(Recurrence { from: past.edge, period: self.edge - past.edge });
                self.come_round(past, end, observer, control);
                return;
            }
        }
        let past = self.copy();
        let search = &mut self.search;
        let place = known.unwrap_or(search.place);
        if place == search.marks.len() {
            search.marks.push(mark);
            search.pasts.push(past);
        } else {
            (search.marks[place], search.pasts[place]) = (mark, past);
        }
        if known.is_none() {
            search.place += 1;
        }
        let is_busy = self.output_changes >= search.counts * OFTEN;
        if search.place >= COPIES[usize::from(is_busy)] {
            (search.place, search.passed) = (0, search.passed << 1 | 1);
            #[cfg(not(target_family = "wasm"))]
            if let Some(far) = &mut search.beyond {
                (search.passed, far.passed) = (0, far.passed << 1 | 1);
            }
        }
    }

    /// Looks at every state from here on, of which only these nets matter.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn look_far(&mut self, live: u64) {
        let passed = std::mem::take(&mut self.search.passed);
        self.search.beyond = Some(Far { live, passed, latest: None, mark: 0, left: 0, of: 1 });
    }

    /// Compares the present state with the latest one that was kept beyond the end of a run. Returns whether no copy is
    /// to be looked for any more: a recurrence is found, or copies of such marks are passed over.
    #[cfg(not(target_family = "wasm"))]
    fn compare_far(&mut self, mark: u64) -> bool {
        let Some(far) = &self.search.beyond else { return false };
        if let Some(past) = far.latest.as_ref().filter(|_| far.mark == mark)
            && self.is_as_in(past)
            && self.world.recurs(&past.world)
        {
            self.search.found = Some(Recurrence { from: past.edge, period: self.edge - past.edge });
            return true;
        }
        let copy = (far.left == 0).then(|| self.copy());
        let Some(far) = &mut self.search.beyond else { return false };
        match copy {
            None => far.left -= 1,
            Some(_) => (far.latest, far.mark, far.left, far.of) = (copy, mark, far.of, 2 * far.of),
        }
        mark & far.passed != 0
    }

    /// Runs on by so many edges, from whose end on the outputs repeat as long as no count arrives; then period by
    /// period, until a count arrives or [`MOST_BEATS`] have passed. Compares each state of the world with one before,
    /// as for counts.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn beat<O: Observe>(&mut self, lead: u64, edges: u64, observer: &mut O, control: &Control) {
        let counts = self.search.counts;
        if lead > 0 && !self.go_far(self.edge + lead, observer, control) || self.search.counts != counts {
            return;
        }
        let (mut latest, mut left, mut of) = (self.copy(), 1, 1);
        for _ in 0..MOST_BEATS {
            if !self.go_far(self.edge + edges, observer, control) || self.search.counts != counts {
                return;
            }
            if self.world.recurs(&latest.world) {
                self.search.found = Some(Recurrence { from: latest.edge, period: self.edge - latest.edge });
                return;
            }
            left -= 1;
            if left == 0 {
                (latest, left, of) = (self.copy(), 2 * of, 2 * of);
            }
        }
    }

    /// Whether the registers are those of a copy; beyond the end of a run, those that matter then.
    fn is_as_in(&self, past: &Past<W, E>) -> bool {
        #[cfg(not(target_family = "wasm"))]
        if let Some(far) = &self.search.beyond {
            return self.wiring.recurs_in(far.live, &past.wiring);
        }
        self.wiring.recurs(&past.wiring)
    }

    fn copy(&self) -> Box<Past<W, E>> {
        let (wiring, world, counted) = (self.wiring.clone(), self.world.clone(), [self.ticks, self.output_changes]);
        Box::new(Past { edge: self.edge, wiring, world, input: self.input, out: self.out, counted })
    }

    /// Begins a tape, unless the observer needs every period computed. If ticks are counted, it ends where they come
    /// too often.
    #[inline(never)]
    fn record<O: Observe>(&mut self, ticks: Option<u64>, observer: &mut O) {
        if self.watched == u64::MAX || observer.relates() || self.rows.row.is_some() {
            return;
        }
        self.rows.log(&self.world, self.edge - 1, observer);
        self.rows.record();
        let words = self.wiring.words();
        let followed = |net: &usize| self.watched >> net & 1 == 1;
        let nets = (0..words.len()).filter(followed).map(|net| (net, words[net])).collect();
        let rows = MOST_NUMBERS / (E::REALS.len() as u64).max(1);
        let last = self.edge.saturating_add(rows.saturating_mul(self.rows.stride));
        let (changes, words) = (Vec::new(), Vec::new());
        self.search.tape = Some(Box::new(Tape { first: self.edge, last, ticks, changes, words, nets }));
    }

    /// Plans the rounds of a run that is in the state of a copy again.
    fn come_round<O: Observe>(&mut self, past: Box<Past<W, E>>, end: u64, observer: &mut O, control: &Control) {
        let (period, stride) = (self.edge - past.edge, self.rows.stride);
        let edges = period.saturating_mul(stride / common_divisor(period, stride));
        let mut then = past;
        if self.search.tape.as_ref().is_none_or(|tape| tape.first > then.edge) {
            self.record(None, observer);
            then = self.copy();
        }
        let due = then.edge.saturating_add(edges);
        match &mut self.search.tape {
            Some(tape) if due < end.min(tape.last) => tape.ticks = None,
            _ => return self.let_go(),
        }
        self.search.round = Some(Round { then, edges, due, whole: None });
        if due == self.edge {
            self.go_round(end, observer, control);
        }
    }

    /// Goes on by rounds, and within one to a copy, as near as that comes to the end, or to the row from which means
    /// are taken, or until the run is stopped.
    #[inline(never)]
    fn go_round<O: Observe>(&mut self, end: u64, observer: &mut O, control: &Control) {
        self.rows.log(&self.world, self.edge - 1, observer);
        let Some(Round { then, edges, due, whole }) = self.search.round.take() else { return };
        let whole = whole.or_else(|| {
            let tape = self.search.tape.take().filter(|_| self.edge == due)?;
            Some((self.copy(), tape, self.rows.recorded()?))
        });
        let Some((now, tape, rows)) = whole else { return self.let_go() };
        let is_ahead = (self.rows.next..end).contains(&self.rows.window);
        let goal = if is_ahead { self.rows.window } else { end };
        let pasts = std::mem::take(&mut self.search.pasts);
        let inside = |past: &&Past<W, E>| (then.edge + 1..now.edge).contains(&past.edge);
        let reached = |past: &Past<W, E>| past.edge + (goal.max(past.edge) - past.edge) / edges * edges;
        let all = pasts.iter().map(|past| &**past).filter(inside).chain([&*then]);
        let mut past = all.max_by_key(|past| reached(past)).unwrap_or(&then);
        let edge = reached(past);
        let mut words = self.wiring.words().to_vec();
        let mut shown = self.edge;
        while shown < edge {
            let later = (shown - then.edge) / edges * edges;
            let next = edge.min(then.edge + later + edges);
            tape.show((shown - later, next - later), later, &mut words, observer);
            self.rows.show_again(&rows, next, later, E::REALS.len(), observer);
            shown = next;
            if shown < edge && !control.goes_on(shown, 0) {
                past = &then;
                break;
            }
        }
        if shown > self.edge {
            let times = (shown - past.edge) / edges;
            (self.wiring, self.world) = (past.wiring.clone(), past.world.clone());
            self.wiring.repeat([&then.wiring, &now.wiring], times);
            self.world.repeat([&then.world, &now.world], times);
            (self.edge, self.input, self.out) = (shown, past.input, past.out);
            [self.ticks, self.output_changes] =
                [0, 1].map(|index| past.counted[index] + times * (now.counted[index] - then.counted[index]));
        }
        if is_ahead {
            let due = goal + 1;
            self.search.pasts = pasts;
            self.search.round = Some(Round { then, edges, due, whole: Some((now, tape, rows)) });
        }
    }
}

/// Returns the greatest common divisor of two numbers, by Euclid.
fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}
