//! The stiffnesses at which the linear loop settles in every world of a parameter box.
//!
//! First the stable sets of the loops at the box's corners, and at points within it, are computed: a stiffness that one
//! of them lacks is not in the box's set. Their common part is then searched for crossings of any world of the box. The
//! search halves stiffnesses, parameters and arcs of the circle until no plant of a cell has a pole there. Where no
//! pole crosses, a loop that is stable at one point of the box is stable in all of it. What the search does not decide
//! is searched again, more finely. The remaining stiffnesses are not known to settle, nor not to settle.

use std::collections::HashMap;

use hpu_cosim::figure;
use hpu_cosim::scene::Scene;
use serde::Serialize;

use super::characteristic::{Characteristic, Of, OnArc};
use super::crossings::{BOXES_A_RANGE, Place, joined};
use super::jet::MOST_SIDES;
use super::open_loop::{OpenLoop, Plants, Side, plant};
use super::stable::inwards;
use super::{Damping, StableSet};
use crate::Error;
use crate::interval::Interval;

/// Number of stretches of equal ratio that a stable range is cut into; each stretch has its own budget of boxes.
const STRETCHES: usize = 48;
/// Number of boxes after which the rest of a stretch is reported as not known.
const MOST_BOXES: u32 = 60_000;
/// Number of boxes of the finer search of all that the first one did not decide.
const MOST_FINER: u32 = 20 * MOST_BOXES;
/// Widths below which a range of stiffnesses is not halved, relative to its stiffest: in the first search, and in the
/// finer one.
const NARROW: f64 = 2e-3;
const NARROWER: f64 = 1e-4;
/// Number of stretches up to which each is told.
const MOST_TOLD: usize = 4;
/// Number of halvings after which a parameter is not halved further.
const MOST_HALVINGS: i32 = 9;

/// Keys along which every number of the linear plant is monotonic, and convex or concave, whatever the other keys are.
const SMOOTH: [&str; 14] = [
    "device.resistance",
    "device.inductance",
    "device.torque_constant",
    "device.rotor_inertia",
    "device.wheel_inertia",
    "device.viscous_friction",
    "device.mass",
    "device.damping",
    "hand.stiffness",
    "hand.damping",
    "bridge.supply",
    "bridge.on_resistance",
    "amplifier.full_scale",
    "device.coulomb_friction",
];
/// Those of [`SMOOTH`]'s keys along which every number of the plant is a straight line.
const STRAIGHT: [&str; 5] =
    ["device.viscous_friction", "device.damping", "hand.stiffness", "hand.damping", "device.coulomb_friction"];

/// The stable set of a box of linear loops.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BoxSet {
    /// The range of stiffnesses that was examined, in SI units.
    #[serde(skip)]
    pub range: [f64; 2],
    /// Unit of the stiffness.
    pub unit: &'static str,
    /// Number of worlds whose own stable sets were computed.
    pub points: usize,
    /// The stiffnesses at which all of these worlds settle, the softest first.
    #[serde(rename = "stable_at_points")]
    pub at_points: Vec<[f64; 2]>,
    /// The stiffnesses at which every world of the box settles, proved.
    #[serde(rename = "stable")]
    pub proved: Vec<[f64; 2]>,
}

/// The worlds of a box of parameters that are not known. Each has the words of the nominal scene.
pub trait Worlds {
    /// Returns the scene as written.
    fn nominal(&self) -> &Scene;
    /// Returns the keys of the parameters.
    fn keys(&self) -> Vec<&str>;
    /// Returns the ends of each parameter, in the order of the keys.
    fn sides(&self) -> Vec<[f64; 2]>;
    /// Returns the scene at a point of the box.
    ///
    /// # Errors
    ///
    /// Why there is no scene at this point.
    fn at(&self, values: &[f64]) -> Result<Scene, Error>;
}

/// Returns the corners of a box; the first side changes fastest.
pub fn corners(sides: &[[f64; 2]]) -> Vec<Vec<f64>> {
    let corner = |which: usize| sides.iter().enumerate().map(|(side, ends)| ends[which >> side & 1]).collect();
    (0..1usize << sides.len()).map(corner).collect()
}

impl BoxSet {
    /// Computes the stable set of a box. `points` are the worlds whose own sets are computed first.
    ///
    /// # Errors
    ///
    /// Returns the reason why there is no such set.
    pub fn new(world: &dyn Worlds, points: &[Scene], range: [f64; 2]) -> Result<Self, Error> {
        let keys = world.keys();
        let strange = keys.iter().find(|key| !SMOOTH.contains(key));
        if let Some(key) = strange {
            return Err(format!("no linear set over {key}; there is one over {}", SMOOTH.join(", ")).into());
        }
        if keys.len() > MOST_SIDES {
            return Err(format!("no linear set over {} keys, but over {MOST_SIDES} at most", keys.len()).into());
        }
        let nominal = world.nominal();
        let damping = Damping::Fixed(nominal.wall.damping_nm_s_per_rad);
        let open = OpenLoop::new(nominal, damping)?;
        let mut at_points = vec![range];
        for point in points {
            let own = open.around(Plants::one(plant(point, nominal)));
            let stable = StableSet::of(&own, nominal, range).stable;
            let stretches: Vec<[f64; 2]> = stable.iter().map(|stretch| [stretch.from.at, stretch.to.at]).collect();
            at_points = common(&at_points, &stretches);
        }
        let mut search = Search { world, open: &open, plants: HashMap::new() };
        let mut crossed = Vec::new();
        for &[low, high] in &at_points {
            let end = |index: usize| match index {
                0 => low,
                STRETCHES => high,
                index => low * libm::pow(high / low, index as f64 / STRETCHES as f64),
            };
            for index in 0..STRETCHES {
                crossed.extend(search.crossed([end(index), end(index + 1)], NARROW, MOST_BOXES)?);
            }
        }
        let crossed = joined(crossed);
        let each = MOST_FINER / (crossed.len() as u32).max(1);
        let mut unknown = Vec::new();
        for gap in crossed {
            unknown.extend(search.crossed(gap, NARROWER, each)?);
        }
        let unknown = joined(unknown);
        let proved = at_points.iter().flat_map(|stretch| without(*stretch, &unknown)).collect();
        Ok(Self { range, unit: super::unit(nominal), points: points.len(), at_points, proved })
    }

    /// Returns the set in another unit of stiffness, of which one is `one` of the present ones.
    #[must_use]
    pub fn in_units(self, one: f64, unit: &'static str) -> Self {
        let by = |stretch: [f64; 2]| stretch.map(|stiffness| stiffness / one);
        let all = |stretches: Vec<[f64; 2]>| stretches.into_iter().map(by).collect();
        Self { range: by(self.range), unit, at_points: all(self.at_points), proved: all(self.proved), ..self }
    }

    /// Returns the stretches at which the points of the box settle and of which it is not known whether all of it does.
    pub fn unknown(&self) -> Vec<[f64; 2]> {
        self.at_points.iter().flat_map(|stretch| without(*stretch, &self.proved)).collect()
    }

    /// Returns how much of what settles at the points of the box is proved for all of it, as a share of its logarithm.
    pub fn share(&self) -> f64 {
        let length = |stretches: &[[f64; 2]]| stretches.iter().map(|[low, high]| libm::log(high / low)).sum::<f64>();
        let all = length(&self.at_points);
        if all == 0.0 { 0.0 } else { length(&self.proved) / all }
    }

    /// Returns the set as text.
    pub fn said(&self) -> String {
        let end = |at: f64, up: bool| figure(if self.range.contains(&at) { at } else { inwards(at, up) });
        let one = |[from, to]: &[f64; 2]| format!("{} to {}", end(*from, true), end(*to, false));
        let told = |stretches: &[[f64; 2]]| {
            format!("{} {}", stretches.iter().map(one).collect::<Vec<_>>().join(" and "), self.unit)
        };
        let Self { points, at_points, proved, unit, .. } = self;
        let (Some(first), Some(last)) = (proved.first(), proved.last()) else {
            return match &at_points[..] {
                [] => format!("no stiffness settles at all of {points} points of the box"),
                _ => format!("none is proved; at {points} points of the box {}", told(at_points)),
            };
        };
        let most = |stretches: &[[f64; 2]]| stretches.len() <= MOST_TOLD;
        let whole = if most(proved) {
            format!("{}, proved", told(proved))
        } else {
            let gaps = proved.len() - 1;
            let whole = one(&[first[0], last[1]]);
            format!("{whole} {unit}, proved but for {gaps} gaps, of which it is not known")
        };
        let points_too = if most(at_points) {
            told(at_points)
        } else {
            let whole = one(&[at_points[0][0], at_points[at_points.len() - 1][1]]);
            format!("{} stretches within {whole} {unit}", at_points.len())
        };
        let share = 100.0 * self.share();
        format!("{whole}; at {points} points of the box {points_too}, of which {share:.1} % are proved")
    }
}

/// Returns the common part of two ascending lists of ranges.
fn common(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
    pairs.filter(|[low, high]| low <= high).collect()
}

/// Returns a range without some others, which ascend.
fn without([low, high]: [f64; 2], others: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut from = low;
    let mut left = Vec::new();
    for [start, end] in others.iter().filter(|[start, end]| *end >= low && *start <= high) {
        if *start > from {
            left.push([from, start.next_down()]);
        }
        from = from.max(end.next_up());
    }
    if from <= high {
        left.push([from, high]);
    }
    left
}

type Cell = Vec<[f64; 2]>;

struct Search<'a> {
    world: &'a dyn Worlds,
    open: &'a OpenLoop,
    /// Plants at points of the box, by the bits of the points' coordinates.
    plants: HashMap<Vec<u64>, Vec<Vec<Interval>>>,
}

/// Returns the matrix that `make` computes cell by cell from two matrices.
fn cells(
    one: &[Vec<Interval>],
    other: &[Vec<Interval>],
    make: impl Fn(Interval, Interval) -> Interval,
) -> Vec<Vec<Interval>> {
    let row =
        |(one, other): (&Vec<Interval>, &Vec<Interval>)| one.iter().zip(other).map(|(a, b)| make(*a, *b)).collect();
    one.iter().zip(other).map(row).collect()
}

/// Returns the smallest interval that contains both.
fn hull(a: Interval, b: Interval) -> Interval {
    Interval { lo: a.lo.min(b.lo), hi: a.hi.max(b.hi) }
}

impl Search<'_> {
    fn at(&mut self, point: &[f64]) -> Result<Vec<Vec<Interval>>, Error> {
        let name: Vec<u64> = point.iter().map(|value| value.to_bits()).collect();
        if let Some(known) = self.plants.get(&name) {
            return Ok(known.clone());
        }
        let plant = plant(&self.world.at(point)?, self.world.nominal());
        self.plants.insert(name, plant.clone());
        Ok(plant)
    }

    /// Returns the plants of a cell. Each number is greatest and least at corners. Along a side it is convex or
    /// concave, so its slope lies between those of the straight lines that continue beyond either end.
    fn plants(&mut self, cell: &Cell) -> Result<Plants, Error> {
        let mut over: Option<Vec<Vec<Interval>>> = None;
        let corners = corners(cell);
        for corner in &corners {
            let plant = self.at(corner)?;
            over = Some(over.map_or_else(|| plant.clone(), |over| cells(&over, &plant, hull)));
        }
        let middle: Vec<f64> = cell.iter().map(|[low, high]| 0.5 * (low + high)).collect();
        let middle = self.at(&middle)?;
        let mut sides = Vec::new();
        for (side, &[low, high]) in cell.iter().enumerate() {
            let beyond = (high - low).min(0.5 * low);
            let straight = STRAIGHT.contains(&self.world.keys()[side]);
            let lines = if straight { vec![[low, high]] } else { vec![[low - beyond, low], [high, high + beyond]] };
            let mut slope: Option<Vec<Vec<Interval>>> = None;
            for corner in &corners {
                for [from, to] in &lines {
                    let mut at = |value: f64| {
                        let mut point = corner.clone();
                        point[side] = value;
                        self.at(&point)
                    };
                    let (from_plant, to_plant) = (at(*from)?, at(*to)?);
                    let line = cells(&to_plant, &from_plant, |end, start| end.minus(start).over(*to - *from));
                    slope = Some(slope.map_or_else(|| line.clone(), |slope| cells(&slope, &line, hull)));
                }
            }
            let half = (0.5 * (high - low)).next_up();
            let slope = slope.expect("a box has corners");
            sides.push(Side { slope, half: Interval { lo: -half, hi: half } });
        }
        Ok(Plants { over: over.expect("a box has corners"), middle: Some(middle), sides })
    }

    /// Returns ranges of stiffness outside which no world of the box has a pole on the unit circle. Ranges as narrow as
    /// `narrow` are not halved, and after `most` boxes the rest is returned.
    fn crossed(&mut self, range: [f64; 2], narrow: f64, most: u32) -> Result<Vec<[f64; 2]>, Error> {
        let sides = self.world.sides();
        let mut crossed: Vec<[f64; 2]> = Vec::new();
        let mut boxes = 0;
        let mut left = vec![(range, sides.clone(), Place::all())];
        while let Some((stiffness, cell, mut places)) = left.pop() {
            let [low, high] = stiffness;
            if crossed.iter().any(|known| known[0] <= low && high <= known[1]) {
                continue;
            }
            if boxes > most {
                crossed = joined([crossed, vec![stiffness]].concat());
                continue;
            }
            boxes += BOXES_A_RANGE;
            let plants = self.plants(&cell)?;
            let function = self.open.around(plants).over(stiffness);
            // How much the function varies along stiffness and sides, over all places where it may be zero.
            let mut varies = vec![0.0f64; 1 + cell.len()];
            let mut kept = Vec::new();
            while let Some(place) = places.pop() {
                boxes += 1;
                let Some((along, angle)) = perhaps(&function, place, cell.len()) else { continue };
                match place {
                    Place::Arc(arc) if arc.width() > 1e-9 * arc.hi && along.iter().all(|other| *other < angle) => {
                        let middle = arc.middle();
                        places.push(Place::Arc(Interval { lo: arc.lo, hi: middle }));
                        places.push(Place::Arc(Interval { lo: middle, hi: arc.hi }));
                    }
                    place => {
                        kept.push(place);
                        let size: f64 = along.iter().sum();
                        varies.iter_mut().zip(along).for_each(|(all, one)| *all += one / size);
                    }
                }
            }
            if kept.is_empty() {
                continue;
            }
            let is_wide = |of: &usize| match of {
                0 => high - low > narrow * high,
                side => {
                    let share = |[low, high]: [f64; 2]| high - low;
                    share(cell[side - 1]) > 2f64.powi(-MOST_HALVINGS) * share(sides[side - 1])
                }
            };
            match (0..varies.len()).filter(is_wide).max_by(|a, b| varies[*a].total_cmp(&varies[*b])) {
                None => crossed = joined([crossed, vec![stiffness]].concat()),
                Some(0) => {
                    let middle = if high > 4.0 * low { (low * high).sqrt() } else { 0.5 * (low + high) };
                    left.push(([low, middle], cell.clone(), kept.clone()));
                    left.push(([middle, high], cell, kept));
                }
                Some(side) => {
                    let [from, to] = cell[side - 1];
                    let middle = 0.5 * (from + to);
                    for ends in [[from, middle], [middle, to]] {
                        let mut half = cell.clone();
                        half[side - 1] = ends;
                        left.push((stiffness, half, kept.clone()));
                    }
                }
            }
        }
        Ok(crossed)
    }
}

/// Returns how much the function varies along the stiffness and each side, and along the arc; `None` if it has no zero
/// there.
fn perhaps(function: &Characteristic, place: Place, sides: usize) -> Option<(Vec<f64>, f64)> {
    let arc = match place {
        Place::Arc(arc) => arc,
        end => {
            let minus_one = end == Place::MinusOne;
            if !function.at(minus_one, Of::Range).has_zero() {
                return None;
            }
            let steps: Vec<Interval> =
                (0..=sides).map(|of| function.at(minus_one, Of::Slope(of)).times(function.away[of])).collect();
            let meant = steps.iter().fold(function.at(minus_one, Of::Middle), |sum, step| sum.plus(*step));
            return meant.has_zero().then(|| (steps.iter().map(|step| step.size()).collect(), 0.0));
        }
    };
    let over = function.on(arc, Of::Range);
    // At an end of the half circle the function is real, so the slope of its imaginary part is examined there instead.
    let ends = arc.lo == 0.0 || arc.hi >= std::f64::consts::PI;
    if !over.value.has_zero() || ends && !over.by_angle.im.has_zero() {
        return None;
    }
    let centre = Interval::exact(arc.middle());
    let aside = arc.minus(centre);
    let OnArc { value: here, .. } = function.on(centre, Of::Middle);
    let steps: Vec<_> = (0..=sides).map(|of| function.on(arc, Of::Slope(of)).value.scaled(function.away[of])).collect();
    let turn = over.by_angle.scaled(aside);
    let meant = steps.iter().fold(here.plus(turn), |sum, step| sum.plus(*step));
    let size = |complex: &crate::interval::Complex| complex.re.size().max(complex.im.size());
    meant.has_zero().then(|| (steps.iter().map(size).collect(), size(&turn)))
}
