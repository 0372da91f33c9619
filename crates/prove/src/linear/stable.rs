//! The stable set of a scene's linear loop: every stiffness of a range at which its motion dies out.

use hpu_cosim::figure;
use hpu_cosim::scene::Scene;
use serde::Serialize;

use super::controller::Damping;
use super::crossings::{Crossings, MOST_ARCS, crossings, first_crossings, settles};
use super::open_loop::OpenLoop;
use crate::Error;

/// The stiffnesses of a range at which all poles of the linear loop are within the unit circle.
///
/// The contact is bilateral and without Coulomb friction. Of the hand, only its spring and damper count.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct StableSet {
    /// The range of stiffnesses that was examined, in SI units.
    #[serde(skip)]
    pub range: [f64; 2],
    /// Unit of the stiffness.
    pub unit: &'static str,
    /// The stretches of stiffness that settle, the softest first.
    pub stable: Vec<Stretch>,
    /// Ranges, beside the ends of the stretches, where stability cannot be told: the loop neither grows nor decays by
    /// more than the numbers' precision shows, or the search ended before.
    pub open: Vec<[f64; 2]>,
    /// Whether the search ended before all of the range was examined.
    #[serde(skip)]
    pub ended: bool,
}

/// A closed interval of stiffnesses, each of which settles.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Stretch {
    /// The softest end.
    pub from: End,
    /// The stiffest end.
    pub to: End,
}

/// An end of a stretch.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct End {
    /// The outermost stiffness that settles.
    pub at: f64,
    /// A stiffness just beyond the stretch: a pole is on the unit circle between [`at`](Self::at) and this stiffness.
    /// `None` at an end of the range.
    pub beyond: Option<f64>,
}

impl Stretch {
    /// Computes the stretch that begins with the softest wall of a range, if that wall settles: the first one of
    /// [`StableSet::new`]. Stiffer walls than the first one beyond its end are not examined.
    ///
    /// # Errors
    ///
    /// Returns the reason why the scene has no linear loop.
    pub fn softest(scene: &Scene, damping: Damping, range: [f64; 2]) -> Result<Option<Self>, Error> {
        let open_loop = OpenLoop::new(scene, damping)?;
        let found = first_crossings(&open_loop, range);
        let ends = found.at.iter().chain(&found.unstable).map(|[_, high]| *high);
        let range = [range[0], ends.fold(range[1], f64::min)];
        let set = StableSet::between(&found, &open_loop, scene, range);
        Ok(set.stable.first().copied().filter(|stretch| stretch.from.beyond.is_none()))
    }
}

impl End {
    /// Returns the middle between [`at`](Self::at) and [`beyond`](Self::beyond).
    pub fn middle(self) -> f64 {
        self.beyond.map_or(self.at, |beyond| 0.5 * (self.at + beyond))
    }

    /// Returns half of the distance between [`at`](Self::at) and [`beyond`](Self::beyond); 0 at an end of the range.
    pub fn uncertainty(self) -> f64 {
        self.beyond.map_or(0.0, |beyond| 0.5 * (self.at - beyond).abs())
    }
}

impl StableSet {
    /// Computes the stable set of a scene's linear loop with this damping.
    ///
    /// # Errors
    ///
    /// Returns the reason why the scene has no linear loop.
    pub fn new(scene: &Scene, damping: Damping, range: [f64; 2]) -> Result<Self, Error> {
        Ok(Self::of(&OpenLoop::new(scene, damping)?, scene, range))
    }

    /// Computes the stable set of a loop whose stiffness has the scene's unit.
    pub(super) fn of(open_loop: &OpenLoop, scene: &Scene, range: [f64; 2]) -> Self {
        Self::between(&crossings(open_loop, range), open_loop, scene, range)
    }

    /// Returns the set with these crossings.
    fn between(found: &Crossings, open_loop: &OpenLoop, scene: &Scene, range: [f64; 2]) -> Self {
        let (mut stable, mut open, mut arcs) = (Vec::new(), Vec::new(), MOST_ARCS);
        // A cut narrower than this is an end of a stretch; a wider one is a range that cannot be told.
        let is_end = |[low, high]: [f64; 2]| high - low <= 1e-6 * high;
        open.extend(found.at.iter().copied().filter(|cut| !is_end(*cut)));
        let mut cuts = [&found.at[..], &found.unstable].concat();
        cuts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut from = End { at: range[0], beyond: None };
        for cut in cuts.iter().map(Some).chain([None]) {
            let to = match cut {
                Some([low, high]) => End { at: low.next_down(), beyond: Some(*high) },
                None => End { at: range[1], beyond: None },
            };
            if from.at <= to.at {
                let verdicts = [0.5, 0.3, 0.7].map(|share| from.at + share * (to.at - from.at)).into_iter();
                match verdicts.filter_map(|stiffness| settles(open_loop, stiffness, &mut arcs)).next() {
                    Some(true) => stable.push(Stretch { from, to }),
                    Some(false) => {}
                    None => open.push([from.at, to.at]),
                }
            }
            if let Some([low, high]) = cut
                && *high >= from.at
            {
                from = End { at: high.next_up(), beyond: Some(*low) };
            }
        }
        open.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { range, unit: super::unit(scene), stable, open, ended: found.ended || arcs == 0 }
    }

    /// Returns the set in another unit of stiffness, of which one is `one` of the present ones.
    #[must_use]
    pub fn in_units(self, one: f64, unit: &'static str) -> Self {
        let by = |stiffness: f64| stiffness / one;
        let end = |End { at, beyond }: End| End { at: by(at), beyond: beyond.map(by) };
        let stretch = |Stretch { from, to }: Stretch| Stretch { from: end(from), to: end(to) };
        Self {
            range: self.range.map(by),
            unit,
            stable: self.stable.into_iter().map(stretch).collect(),
            open: self.open.into_iter().map(|open| open.map(by)).collect(),
            ended: self.ended,
        }
    }

    /// Returns the set as text, as in `0.01 to 0.7589 and 1.0955 to 4.0685 N.m/rad`.
    pub fn said(&self) -> String {
        let more = "neither grows nor decays by more than is known";
        let ended = format!("unknown, the search was ended or the loop {more}");
        self.said_with(if self.ended { &ended } else { more })
    }

    /// Returns the set as text, with what is known of the stretches that are open.
    pub(super) fn said_with(&self, known: &str) -> String {
        let [low, high] = self.range.map(figure);
        let unit = self.unit;
        let between = |[low, high]: [f64; 2]| format!("{} to {}", figure(low), figure(high));
        let mut said = match &self.stable[..] {
            [] if self.open.is_empty() => format!("no stiffness from {low} to {high} {unit} settles"),
            [] => "none is known to settle".to_string(),
            [Stretch { from: End { beyond: None, .. }, to: End { beyond: None, .. } }] => {
                format!("every stiffness from {low} to {high} {unit} settles")
            }
            stretches => {
                // A proved end is rounded into its stretch; an end of the range is written as the range is.
                let told = |end: &End, up: bool| {
                    let at = if end.beyond.is_some() { inwards(end.at, up) } else { end.at };
                    figure(at)
                };
                let stretch = |Stretch { from, to }: &Stretch| format!("{} to {}", told(from, true), told(to, false));
                let all: Vec<_> = stretches.iter().map(stretch).collect();
                format!("{} {unit}", all.join(" and "))
            }
        };
        if !self.open.is_empty() {
            let all: Vec<_> = self.open.iter().map(|open| between(*open)).collect();
            said += &format!("; {known}: {} {unit}", all.join(" and "));
        }
        said
    }
}

/// Rounds a positive number up or down to seven digits.
pub(super) fn inwards(value: f64, up: bool) -> f64 {
    let unit = 10f64.powi(6 - libm::log10(value).floor() as i32);
    (if up { (value * unit).ceil() } else { (value * unit).floor() }) / unit
}

/// Whether the linear loop settles at a stiffness; `None` if there is no linear loop, or if it cannot be told.
pub fn linear_settles(scene: &Scene, stiffness: f64) -> Option<bool> {
    let open_loop = OpenLoop::new(scene, Damping::Fixed(scene.wall.damping_nm_s_per_rad)).ok()?;
    settles(&open_loop, stiffness, &mut { MOST_ARCS })
}

#[cfg(test)]
mod tests {
    use super::inwards;

    #[test]
    fn seven_digits_never_leave_the_stretch() {
        assert_eq!((inwards(3.776_960_537_4, false), inwards(3.776_960_537_4, true)), (3.776_960, 3.776_961));
        assert_eq!((inwards(0.075_340_162, true), inwards(25_850.231_9, false)), (0.075_340_17, 25_850.23));
    }
}
