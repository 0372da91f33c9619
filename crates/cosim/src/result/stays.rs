//! For how long an axis stays where: beyond its wall, deep inside it, and out of its counter's reach.
//!
//! The encoder's own count decides, edge by edge, whatever the logic has made of it. A count begins at its angle, so
//! the device is beyond a wall's surface from the wall's own count on; the logic counts penetration from the next one
//! on. So the world tells how long the device was inside its wall beside the [contact](crate::result::contact) that the
//! logic counts, and for how long the position counter could not hold the place of the device.

use hpu_plant::Energy;

/// The counts from which a device is deep inside a wall, so that the rounded place of the wall and a count that toggles
/// at it decide nothing.
pub const DEEP_COUNTS: i64 = 2;

/// Clock edges that an axis has spent at places, by the count of its encoder.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Stays {
    /// Edges at which the device was beyond the wall: in the wall's count or a greater one.
    pub inside: u64,
    /// Edges at which it was at least [`DEEP_COUNTS`] counts inside the wall.
    pub deep: u64,
    /// Edges at which the distance to the wall did not fit the position counter, so that the loop read another one.
    pub unheld: u64,
}

impl Stays {
    fn since(self, before: Self) -> Self {
        Self { inside: self.inside - before.inside, deep: self.deep - before.deep, unheld: self.unheld - before.unheld }
    }
}

/// The places whose stays are counted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Places {
    /// The wall's count, from angle 0.
    pub(crate) wall: i64,
    /// The least and the greatest count from the start that the position counter tells apart from all others within
    /// reach of the wall; `None` without a counter.
    pub(crate) reach: Option<[i64; 2]>,
}

impl Places {
    /// Counts the stays at the places from edge 0 on, with the device at a count.
    pub(crate) fn tally(self, count: i64) -> Tally {
        let beyond = |counts: i64| Stay::inside([self.wall.saturating_add(counts), i64::MAX], count);
        let reach = self.reach.map_or([i64::MIN, i64::MAX], |reach| reach.map(|from_start| count + from_start));
        let mut tally =
            Tally { steady: [1, 0], inside: beyond(0), deep: beyond(DEEP_COUNTS), unheld: Stay::outside(reach, count) };
        tally.turn(0, count);
        tally
    }
}

/// The stays of an axis at all [`Places`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Tally {
    /// The least and the greatest of the counts around the present one at which no stay begins or ends: one comparison
    /// answers for all of them, at each edge of the encoder.
    steady: [i64; 2],
    inside: Stay,
    deep: Stay,
    /// Stays out of the position counter's reach.
    pub(crate) unheld: Stay,
}

impl Tally {
    /// Takes note of the count from an edge on.
    #[inline(always)]
    pub(crate) fn see(&mut self, edge: u64, count: i64) {
        let [least, most] = self.steady;
        if count < least || count > most {
            self.turn(edge, count);
        }
    }

    #[cold]
    fn turn(&mut self, edge: u64, count: i64) {
        self.see_apart(edge, count, count);
        let all = [self.inside, self.deep, self.unheld].map(|stay| stay.steady);
        let [[a, b], [c, d], [e, f]] = all;
        self.steady = [a.max(c).max(e), b.min(d).min(f)];
    }

    /// Takes note of the count from an edge on, and of the count that faulty lines show to the position counter.
    pub(crate) fn see_apart(&mut self, edge: u64, count: i64, shown: i64) {
        self.inside.see(edge, count);
        self.deep.see(edge, count);
        self.unheld.see(edge, shown);
    }

    /// Returns the stays up to an edge, since which the count has not changed.
    pub(crate) fn stays(&self, edge: u64) -> Stays {
        let [inside, deep, unheld] = [self.inside, self.deep, self.unheld].map(|stay| stay.edges(edge));
        Stays { inside, deep, unheld }
    }

    /// Moves on by this number of edges, as [`Stay::repeat`] does.
    pub(crate) fn repeat(&mut self, edges: u64, [(then, from), (now, to)]: [(&Self, u64); 2], times: u64) {
        self.inside.repeat(edges, [(&then.inside, from), (&now.inside, to)], times);
        self.deep.repeat(edges, [(&then.deep, from), (&now.deep, to)], times);
        self.unheld.repeat(edges, [(&then.unheld, from), (&now.unheld, to)], times);
    }
}

/// Sums over a run from its start up to an edge; figures of the judged window are differences of two of them.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sums {
    /// The energies, with the integrals of current and position.
    pub(crate) energy: Energy,
    /// The places of the device.
    pub(crate) stays: Stays,
    /// The actuator's torque or force of a current of 1 A.
    pub(crate) effort_per_a: f64,
}

impl Sums {
    /// Returns the means of the actuator's torque and of the position since earlier sums, and the places of the device;
    /// `None` if no time has passed. `length_s` is the time between the two.
    pub fn since(&self, before: &Self, length_s: f64) -> Option<([f64; 2], Stays)> {
        let [current, angle] = self.energy.current_and_angle_since(&before.energy);
        let averages = [self.effort_per_a * current / length_s, angle / length_s];
        (length_s > 0.0).then(|| (averages, self.stays.since(before.stays)))
    }
}

/// Counts the stays of an encoder's count inside or outside a range of counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stay {
    /// The least and the greatest count of the range.
    range: [i64; 2],
    /// Whether a stay is one inside the range.
    is_inside: bool,
    /// The least and the greatest of the counts around the present one at which no stay begins or ends.
    steady: [i64; 2],
    /// The edge at which the present stay began, if the count is there.
    from: Option<u64>,
    /// The edge at which the first stay began.
    first: Option<u64>,
    /// Edges of the stays that have ended.
    ended: u64,
}

impl Stay {
    /// Counts stays in this range of counts, from edge 0 on, at which the count is `count`.
    pub(crate) fn inside(range: [i64; 2], count: i64) -> Self {
        Self::new(range, true, count)
    }

    /// Counts stays outside this range of counts.
    pub(crate) fn outside(range: [i64; 2], count: i64) -> Self {
        Self::new(range, false, count)
    }

    fn new(range: [i64; 2], is_inside: bool, count: i64) -> Self {
        let mut stay = Self { range, is_inside, steady: [1, 0], from: None, first: None, ended: 0 };
        stay.turn(0, count);
        stay
    }

    /// Takes note of the count from an edge on.
    #[inline(always)]
    pub(crate) fn see(&mut self, edge: u64, count: i64) {
        let [least, most] = self.steady;
        if count < least || count > most {
            self.turn(edge, count);
        }
    }

    #[cold]
    fn turn(&mut self, edge: u64, count: i64) {
        let [least, most] = self.range;
        self.steady = match count {
            below if below < least => [i64::MIN, least - 1],
            above if above > most => [most + 1, i64::MAX],
            _ => self.range,
        };
        let is_there = (self.steady == self.range) == self.is_inside;
        match (self.from, is_there) {
            (None, true) => {
                self.from = Some(edge);
                self.first = self.first.or(self.from);
            }
            (Some(from), false) => {
                self.ended += edge - from;
                self.from = None;
            }
            _ => {}
        }
    }

    /// Returns the edges of all stays up to an edge, since which the count has not changed.
    pub(crate) fn edges(&self, edge: u64) -> u64 {
        self.ended + self.from.map_or(0, |from| edge.saturating_sub(from))
    }

    /// Returns whether the count is there.
    pub(crate) fn is_there(&self) -> bool {
        self.from.is_some()
    }

    /// Returns the edge at which the first stay began.
    pub(crate) fn first(&self) -> Option<u64> {
        self.first
    }

    /// Moves on by this number of edges, as if what happened between two states, at these edges, had happened so many
    /// times more.
    pub(crate) fn repeat(&mut self, edges: u64, [(then, from), (now, to)]: [(&Self, u64); 2], times: u64) {
        self.ended += times * (now.edges(to) - then.edges(from));
        self.from = self.from.map(|from| from + edges);
        self.first = self.first.or(now.first);
    }
}

#[cfg(test)]
mod tests {
    use super::{DEEP_COUNTS, Places, Stay};

    /// A walk of the count, one step an edge, that comes to every part of a range and beyond it.
    fn walk(edge: u64) -> i64 {
        (9.0 * (0.7 * edge as f64).sin() + 3.0 * (0.11 * edge as f64).cos()).round() as i64
    }

    #[test]
    fn edges_of_stays_are_those_of_a_look_at_every_edge() {
        for range in [[-3, 4], [2, i64::MAX], [i64::MIN, -1], [5, 5], [40, 50]] {
            for is_inside in [true, false] {
                let mut stay = if is_inside { Stay::inside(range, walk(0)) } else { Stay::outside(range, walk(0)) };
                let is_there = |edge: &u64| (range[0]..=range[1]).contains(&walk(*edge)) == is_inside;
                for edge in 1..400 {
                    stay.see(edge, walk(edge));
                    let expected = (0..edge).filter(is_there).count() as u64;
                    assert_eq!(stay.edges(edge), expected, "{range:?}, {is_inside}, {edge}");
                }
                assert_eq!(stay.first(), (0..400).find(is_there), "{range:?}, {is_inside}");
            }
        }
    }

    #[test]
    fn one_comparison_answers_for_all_places() {
        for (wall, reach) in [(4, Some([-8, 7])), (-3, Some([-2, 2])), (50, None), (0, Some([-20, 20]))] {
            let mut tally = Places { wall, reach }.tally(walk(0));
            let held = |count: i64| reach.is_none_or(|[a, b]| (a..=b).contains(&(count - walk(0))));
            let mut expected = [0; 3];
            for edge in 0..400 {
                tally.see(edge, walk(edge));
                let stays = tally.stays(edge);
                assert_eq!([stays.inside, stays.deep, stays.unheld], expected, "{wall}, {reach:?}, {edge}");
                let count = walk(edge);
                let places = [count >= wall, count >= wall + DEEP_COUNTS, !held(count)];
                expected.iter_mut().zip(places).for_each(|(edges, is_there)| *edges += u64::from(is_there));
            }
        }
    }

    #[test]
    fn repeated_periods_count_as_if_they_were_walked() {
        // A period of 20 edges: seven of them at 5 and the others at 0.
        let count = |edge: u64| if edge % 20 < 7 { 5 } else { 0 };
        let walked = |edges: u64| {
            let mut stay = Stay::inside([3, 9], count(0));
            (1..=edges).for_each(|edge| stay.see(edge, count(edge)));
            stay
        };
        for at in [40, 43, 47, 59] {
            let (then, now, mut moved) = (walked(40), walked(60), walked(at));
            moved.repeat(60, [(&then, 40), (&now, 60)], 3);
            assert_eq!(moved.edges(at + 60), walked(at + 60).edges(at + 60), "{at}");
            moved.see(at + 61, count(at + 61));
            assert_eq!(moved.edges(at + 70), {
                let mut all = walked(at + 61);
                all.see(at + 61, count(at + 61));
                all.edges(at + 70)
            });
        }
    }
}
