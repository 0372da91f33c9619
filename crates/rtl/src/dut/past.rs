//! The past of a run, which another simulator simulates again before it goes on in the place of the first one.

use hpu_cosim::dut::{Asked, Change, Fault, RunningDesign};

/// Words that are kept of a run's past.
const MOST_WORDS: usize = 1 << 20;
/// The changes that a request asks for, by their numbers.
const ASKED: [Asked; 3] = [Asked::Driving, Asked::Outputs, Asked::Inside];

/// The inputs that a run has had so far, and the changes that it has told.
pub(super) struct Past {
    /// The words with which it began, and the outputs that drive the device.
    pub(super) first: Vec<u64>,
    pub(super) drives: Vec<bool>,
    /// Its requests, each a number of edges, what is asked for, and the words. Requests that differ only in their edges
    /// are one.
    requests: Vec<u64>,
    /// The changes of outputs that drive the device, by edges from the reset on. Before the first one an output may be
    /// unknown in one simulator and not in another.
    driven: Vec<Change>,
    /// The last words of all outputs.
    told: Vec<Option<u64>>,
    /// The edges so far.
    pub(super) edge: u64,
}

impl Past {
    /// Begins with the words of a run's start and the changes that it has told.
    pub(super) fn new(words: &[u64], drives: &[bool], changes: &[Change]) -> Self {
        let mut told = vec![None; words.len()];
        note_words(&mut told, changes);
        let (first, drives) = (words.to_vec(), drives.to_vec());
        Self { first, drives, requests: Vec::new(), driven: Vec::new(), told, edge: 0 }
    }

    /// Returns whether there is no room for more.
    pub(super) fn is_full(&self) -> bool {
        self.requests.len() + self.driven.len() > MOST_WORDS
    }

    /// Keeps a request that is done, and the changes of its answer.
    pub(super) fn keep(&mut self, words: &[u64], (done, asked): (u64, Asked), changes: &[Change]) {
        let size = 2 + self.first.len();
        let from = self.requests.len().saturating_sub(size);
        match self.requests.get_mut(from..) {
            Some([edges, kind, last @ ..]) if *kind == asked as u64 && last == words => *edges += done,
            _ => {
                self.requests.extend([done, asked as u64]);
                self.requests.extend_from_slice(words);
            }
        }
        let driven = changes.iter().filter(|change| self.drives[change.port]);
        self.driven.extend(driven.map(|change| Change { edge: self.edge + change.edge, ..*change }));
        note_words(&mut self.told, changes);
        self.edge += done;
    }

    /// Simulates this past again by `start`, which starts another simulator.
    ///
    /// # Errors
    ///
    /// When the other simulator fails.
    pub(super) fn again(
        &self,
        start: impl FnOnce(&mut Vec<Change>) -> Result<Box<dyn RunningDesign>, Fault>,
    ) -> Result<Again, Fault> {
        let mut changes = Vec::new();
        let mut running = start(&mut changes)?;
        let mut told = vec![None; self.first.len()];
        note_words(&mut told, &changes);
        let (mut driven, mut edge) = (Vec::new(), 0);
        for request in self.requests.chunks_exact(2 + self.first.len()) {
            let mut left = request[0];
            while left > 0 && !running.is_over() {
                changes.clear();
                let done = running.clock(&request[2..], left, ASKED[request[1] as usize], &mut changes)?;
                note_words(&mut told, &changes);
                let of = changes.iter().filter(|change| self.drives[change.port]);
                driven.extend(of.map(|&change| Change { edge: edge + change.edge, ..change }));
                edge += done;
                left -= done;
            }
        }
        let later = |all: &[Change]| all.iter().filter(|change| change.edge > 1).copied().collect::<Vec<_>>();
        let difference = first_difference(later(&self.driven), later(&driven));
        Ok(Again { running, stale: stale(&self.told, &told), difference })
    }
}

/// A past that another simulator has simulated.
pub(super) struct Again {
    pub(super) running: Box<dyn RunningDesign>,
    /// The changes that bring what the first simulator has told to what the other one knows.
    pub(super) stale: Vec<Change>,
    /// The first change of an output that drives the device, from the second edge on, that only one of both has.
    pub(super) difference: Option<Change>,
}

impl Again {
    /// Goes on with a request. Outputs that the first simulator has told otherwise are told at its first edge, where it
    /// asks for them.
    pub(super) fn clock(
        &mut self,
        words: &[u64],
        (edges, asked): (u64, Asked),
        changes: &mut Vec<Change>,
        drives: &[bool],
    ) -> Result<u64, Fault> {
        let from = changes.len();
        let done = self.running.clock(words, edges, asked, changes)?;
        let is_new = |port: usize| !changes[from..].iter().any(|change| change.edge == 1 && change.port == port);
        let is_told = |port: usize| asked != Asked::Driving || drives[port];
        let fresh: Vec<_> =
            self.stale.iter().filter(|change| is_told(change.port) && is_new(change.port)).copied().collect();
        self.stale.retain(|change| !is_told(change.port));
        changes.splice(from..from, fresh);
        Ok(done)
    }
}

fn note_words(told: &mut [Option<u64>], changes: &[Change]) {
    for change in changes {
        told[change.port] = change.bits;
    }
}

/// Returns the changes from the words of one simulator to those of another.
fn stale(first: &[Option<u64>], other: &[Option<u64>]) -> Vec<Change> {
    let ports = (0..first.len()).filter(|&port| first[port] != other[port]);
    ports.map(|port| Change { edge: 1, port, bits: other[port] }).collect()
}

/// Returns the first change that only one of two simulations has. Within an edge their order does not matter.
fn first_difference(mut one: Vec<Change>, mut two: Vec<Change>) -> Option<Change> {
    for all in [&mut one, &mut two] {
        all.sort_by_key(|change| (change.edge, change.port));
    }
    let place = one.iter().zip(&two).position(|(one, two)| one != two);
    let place = place.or((one.len() != two.len()).then_some(one.len().min(two.len())))?;
    one.get(place).or(two.get(place)).copied()
}
