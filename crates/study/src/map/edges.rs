//! Why a method's region of rest ends where it does: how the motion behaves just beyond its edge, and which criterion
//! predicts this edge.

use hpu_cosim::scene::{Experiment, OutcomeKind};

use super::{Cell, CellIndex, Class, Curves, Found, Map, class, nearest};

/// The behaviour of a motion just beyond the edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Reason {
    /// The motion grows without end.
    Grows,
    /// The motion oscillates, and the command or a product is at its limit for a hundredth of the time or more.
    FullScale,
    /// The motion oscillates by no more than a few counts, which the encoder hides from the law.
    Counts,
    /// The motion oscillates by more than a few counts, within the range of all words.
    Swings,
    /// The position counter wraps under the device for a hundredth of the time or more.
    CounterWraps,
    /// The device is inside the wall, which gives no torque.
    NoTorque,
}

/// Amplitude, in counts, up to which the encoder is the reason.
pub(crate) const FEW_COUNTS: f64 = 2.5;
/// Share of the time with an overflowed word from which on full scale is the reason.
pub const OFTEN: f64 = 0.01;

impl Reason {
    /// Returns the reason as text.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Grows => "grows without end",
            Self::FullScale => "swings at full scale",
            Self::Counts => "rattles between counts",
            Self::Swings => "swings",
            Self::CounterWraps => "wraps the position counter",
            Self::NoTorque => "is inside without the wall's torque",
        }
    }

    /// Returns the reason of a cell that is not at rest, given the size of a count.
    fn of(cell: &Cell, count: Option<f64>) -> Self {
        let counts = cell.amplitude.zip(count).map(|(amplitude, count)| amplitude / count);
        match cell.outcome {
            OutcomeKind::NoWallTorque => Self::NoTorque,
            OutcomeKind::PositionLost => Self::CounterWraps,
            _ if cell.position_lost_share >= OFTEN => Self::CounterWraps,
            OutcomeKind::Diverged | OutcomeKind::HighlyUnstable => Self::Grows,
            _ if counts.is_some_and(|counts| counts <= FEW_COUNTS) => Self::Counts,
            _ if cell.overflow_share >= OFTEN => Self::FullScale,
            _ => Self::Swings,
        }
    }
}

/// A reason, its frequency along the edge, and the values measured there.
#[derive(Clone, PartialEq, Debug)]
pub struct Share {
    /// The reason.
    pub reason: Reason,
    /// Number of places of the edge with this reason.
    pub places: usize,
    /// Least and greatest frequency of a limit cycle, in Hz.
    pub frequency_hz: Option<(f64, f64)>,
    /// Least and greatest amplitude, in counts.
    pub amplitude_counts: Option<(f64, f64)>,
}

/// The edge of a method's region of rest.
#[derive(Clone, PartialEq, Debug)]
pub struct Edge {
    /// Number of places: pairs of neighbours of which one comes to rest and the other does not.
    pub places: usize,
    /// The reasons, the most frequent first.
    pub shares: Vec<Share>,
    /// The criterion that is nearest to the edge, by the median ratio of edge to limit, and this ratio.
    pub nearest: Option<(&'static str, f64)>,
}

impl Edge {
    /// Computes the edge of a method; `curves` are its criteria's.
    pub fn new(map: &Map, found: &[Found], curves: Option<&Curves>, method: usize) -> Self {
        let rests = |point: CellIndex| match class(found, map.index(point)) {
            Some(Class::Outcome(OutcomeKind::Settled | OutcomeKind::Passive | OutcomeKind::Tracking)) => Some(true),
            Some(Class::Outcome(outcome)) if outcome.tells() => Some(false),
            Some(Class::Outcome(_) | Class::WallNotReached) | None => None,
        };
        let mut edge = Self { places: 0, shares: Vec::new(), nearest: None };
        let mut ratios: Vec<(&'static str, Vec<f64>)> = Vec::new();
        for iy in 0..map.y.cells() {
            for ix in 0..map.x.cells() {
                let here = CellIndex { method, ix, iy };
                for (along_x, there) in
                    [(true, CellIndex { ix: ix + 1, ..here }), (false, CellIndex { iy: iy + 1, ..here })]
                {
                    if there.ix == map.x.cells() || there.iy == map.y.cells() {
                        continue;
                    }
                    let beyond = match (rests(here), rests(there)) {
                        (Some(true), Some(false)) => there,
                        (Some(false), Some(true)) => here,
                        _ => continue,
                    };
                    edge.note(map, found, beyond);
                    if let Some(curves) = curves.filter(|curves| curves.over_x == along_x) {
                        compare(&mut ratios, map, curves, here);
                    }
                }
            }
        }
        edge.shares.sort_by_key(|share| (std::cmp::Reverse(share.places), share.reason));
        let median = |ratios: &mut Vec<f64>| {
            ratios.sort_by(f64::total_cmp);
            ratios[ratios.len() / 2]
        };
        let most = ratios.iter().map(|(_, all)| all.len()).max().unwrap_or(0);
        // A criterion with a limit at half of the edge or less does not explain the edge.
        let medians = ratios.iter_mut().filter(|(_, all)| 2 * all.len() > most).map(|(name, all)| (*name, median(all)));
        let distance = |ratio: f64| libm::log(ratio).abs();
        edge.nearest = medians.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        edge
    }

    fn note(&mut self, map: &Map, found: &[Found], beyond: CellIndex) {
        let Some(cell) = nearest(found, map.index(beyond)) else { return };
        let count = match map.experiment(beyond) {
            Ok(Experiment::Axis(scene)) => Some(scene.encoder.count_rad()).filter(|count| *count > 0.0),
            _ => None,
        };
        let reason = Reason::of(cell, count);
        self.places += 1;
        let at = self.shares.iter().position(|share| share.reason == reason).unwrap_or_else(|| {
            self.shares.push(Share { reason, places: 0, frequency_hz: None, amplitude_counts: None });
            self.shares.len() - 1
        });
        let share = &mut self.shares[at];
        share.places += 1;
        let widen = |range: &mut Option<(f64, f64)>, value: Option<f64>| {
            if let Some(value) = value.filter(|value| value.is_finite()) {
                *range = Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))));
            }
        };
        widen(&mut share.frequency_hz, cell.frequency_hz.filter(|hz| *hz > 0.0));
        widen(&mut share.amplitude_counts, cell.amplitude.zip(count).map(|(amplitude, count)| amplitude / count));
    }

    /// Returns the edge as one line of text; `None` if the map has no edge.
    pub fn text(&self) -> Option<String> {
        if self.places == 0 {
            return None;
        }
        let shares: Vec<String> = self.shares.iter().map(|share| share.text(self.places)).collect();
        let nearest = self.nearest.map(|(name, ratio)| format!("; at {ratio:.2} of the nearest criterion, {name}"));
        Some(shares.join("; ") + &nearest.unwrap_or_default())
    }

    /// Returns the edge as a short text for a picture: the reasons at a tenth of the edge or more.
    pub fn short(&self) -> Option<String> {
        let often = self.shares.iter().filter(|share| share.percent(self.places) >= 10.0);
        let shares: Vec<String> =
            often.map(|share| [vec![share.reason.text().to_string()], share.measured()].concat().join(", ")).collect();
        let nearest = self.nearest.map(|(name, ratio)| format!("; at {ratio:.2} of {}", name.replace('_', " ")));
        (self.places > 0).then(|| format!("beyond its edge: {}{}", shares.join("; "), nearest.unwrap_or_default()))
    }
}

impl Share {
    fn percent(&self, places: usize) -> f64 {
        100.0 * self.places as f64 / places as f64
    }

    /// Returns the amplitude, if the reason is one of counts, and the frequency, as text.
    fn measured(&self) -> Vec<String> {
        let range = |(low, high): (f64, f64), unit: &str| {
            let decimals = usize::from(low < 10.0);
            let (low, high) = (format!("{low:.decimals$}"), format!("{high:.decimals$}"));
            if low == high { format!("{low} {unit}") } else { format!("{low} to {high} {unit}") }
        };
        let counts = self.amplitude_counts.filter(|_| self.reason == Reason::Counts);
        [counts.map(|counts| range(counts, "counts")), self.frequency_hz.map(|hz| range(hz, "Hz"))]
            .into_iter()
            .flatten()
            .collect()
    }

    fn text(&self, places: usize) -> String {
        let measured: String = self.measured().iter().map(|part| format!(", {part}")).collect();
        format!("{} {:.0} %{measured}", self.reason.text(), self.percent(places))
    }
}

/// Compares an edge between a cell and the next one along the stiffnesses with every criterion.
fn compare(ratios: &mut Vec<(&'static str, Vec<f64>)>, map: &Map, curves: &Curves, here: CellIndex) {
    let (stiffness, at, other) = if curves.over_x { (&map.x, here.ix, here.iy) } else { (&map.y, here.iy, here.ix) };
    let (low, high) = (stiffness.values()[at], stiffness.values()[at + 1]);
    let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * high };
    for curve in &curves.curves {
        if let Some(limit) = curve.limits[other].filter(|limit| *limit > 0.0) {
            match ratios.iter_mut().find(|(name, _)| *name == curve.name) {
                Some((_, all)) => all.push(middle / limit),
                None => ratios.push((curve.name, vec![middle / limit])),
            }
        }
    }
}
