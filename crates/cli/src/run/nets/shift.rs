//! The number of edges by which one signal has the words of another, later or earlier.

use std::collections::VecDeque;

/// The most changes of one side that wait for the other one's. Beyond them, nothing is said.
const WAITING: usize = 1 << 16;

/// Pairs the changes of two signals in their order. They are the same signal, shifted in time, if all pairs have the
/// same words and are equally far apart.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Shift {
    /// The changes that wait for the other side's; one of the lists is empty once both have begun.
    theirs: Side,
    ours: Side,
    /// Edges by which theirs come later than ours, once a pair is there.
    by: Option<i64>,
    has_failed: bool,
}

/// One signal: its first word, its last one, and the changes that wait.
#[derive(Clone, PartialEq, Debug, Default)]
struct Side {
    first: Option<u64>,
    last: Option<u64>,
    waiting: VecDeque<(u64, u64)>,
}

impl Side {
    /// Takes the bits after an edge.
    fn take(&mut self, edge: u64, bits: u64) {
        if self.first.is_none() {
            self.first = Some(bits);
        } else if self.last != Some(bits) {
            self.waiting.push_back((edge, bits));
        }
        self.last = Some(bits);
    }
}

impl Shift {
    /// Takes the bits of theirs after an edge; `None` if some are unknown.
    pub(super) fn theirs(&mut self, edge: u64, bits: Option<u64>) {
        self.take(edge, bits, |shift| &mut shift.theirs);
    }

    /// Takes the bits of ours after an edge.
    pub(super) fn ours(&mut self, edge: u64, bits: u64) {
        self.take(edge, Some(bits), |shift| &mut shift.ours);
    }

    fn take(&mut self, edge: u64, bits: Option<u64>, side: fn(&mut Self) -> &mut Side) {
        match bits {
            _ if self.has_failed => {}
            Some(bits) => {
                side(self).take(edge, bits);
                self.pair();
                let waits = [&self.theirs, &self.ours].map(|side| side.waiting.len());
                self.has_failed |= waits.into_iter().any(|waits| waits > WAITING);
            }
            // Before the first word, nothing is known of either side.
            None => self.has_failed |= side(self).first.is_some(),
        }
    }

    /// Pairs the changes that both sides have.
    fn pair(&mut self) {
        while let (Some(&(their_edge, their_bits)), Some(&(our_edge, our_bits))) =
            (self.theirs.waiting.front(), self.ours.waiting.front())
        {
            if self.by.is_none() && self.theirs.first != self.ours.first {
                // The later side still shows what it had before its first word of the other side.
                if Some(their_bits) == self.ours.first {
                    self.theirs.waiting.pop_front();
                    self.theirs.first = self.ours.first;
                    continue;
                } else if Some(our_bits) == self.theirs.first {
                    self.ours.waiting.pop_front();
                    self.ours.first = self.theirs.first;
                    continue;
                }
                self.has_failed = true;
            }
            let by = their_edge.cast_signed() - our_edge.cast_signed();
            self.has_failed |= their_bits != our_bits || *self.by.get_or_insert(by) != by;
            self.theirs.waiting.pop_front();
            self.ours.waiting.pop_front();
        }
    }

    /// Returns the number of edges by which theirs were ours, later or (below 0) earlier, up to an edge; `None` if they
    /// were not, or if nothing ever changed.
    pub(super) fn found(&self, end: u64) -> Option<i64> {
        let by = self.by.filter(|_| !self.has_failed)?;
        let late = if by > 0 { &self.ours } else { &self.theirs };
        let early = if by > 0 { &self.theirs } else { &self.ours };
        // What the later side has not shown yet happened less than the shift before the end.
        let is_young = |(edge, _): &(u64, u64)| edge + by.unsigned_abs() > end;
        (early.waiting.is_empty() && late.waiting.iter().all(is_young)).then_some(by)
    }
}

#[cfg(test)]
mod tests {
    use super::Shift;

    /// Returns what is found of words at these edges.
    fn found(theirs: &[(u64, u64)], ours: &[(u64, u64)], end: u64) -> Option<i64> {
        let mut shift = Shift::default();
        let mut all: Vec<_> = theirs.iter().map(|change| (*change, true)).collect();
        all.extend(ours.iter().map(|change| (*change, false)));
        all.sort_unstable();
        for ((edge, bits), is_theirs) in all {
            if is_theirs { shift.theirs(edge, Some(bits)) } else { shift.ours(edge, bits) }
        }
        shift.found(end)
    }

    #[test]
    fn a_signal_that_comes_later_or_earlier_is_the_same_signal() {
        let ours = [(0, 7), (10, 8), (20, 9), (40, 7)];
        let later = |by: u64| ours.map(|(edge, bits)| (if edge == 0 { 0 } else { edge + by }, bits));
        for by in [0, 1, 3, 100] {
            assert_eq!(found(&later(by), &ours, 200), Some(by.cast_signed()), "{by}");
            assert_eq!(found(&ours, &later(by), 200), Some(-by.cast_signed()), "{by}");
        }
        // A pipeline is empty at first.
        assert_eq!(found(&[(0, 0), (3, 7), (13, 8), (23, 9), (43, 7)], &ours, 200), Some(3));
        assert_eq!(found(&ours, &[(0, 0), (3, 7), (13, 8), (23, 9), (43, 7)], 200), Some(-3));
        // The last change is still to come.
        assert_eq!(found(&later(3)[..3], &ours, 42), Some(3));
        assert_eq!(found(&later(3)[..3], &ours, 43), None);
    }

    #[test]
    fn other_words_or_other_distances_are_no_shift() {
        let ours = [(0, 7), (10, 8), (20, 9), (40, 7)];
        assert_eq!(found(&[(0, 7), (13, 8), (24, 9), (43, 7)], &ours, 200), None);
        assert_eq!(found(&[(0, 7), (13, 8), (23, 5), (43, 7)], &ours, 200), None);
        assert_eq!(found(&[(0, 7), (13, 8)], &ours, 200), None);
        assert_eq!(found(&[(0, 7)], &[(0, 7)], 200), None, "nothing changes");
    }
}
