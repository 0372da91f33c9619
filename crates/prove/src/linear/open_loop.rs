//! Linear loops whose stiffness is left open: the plant's change from sample to sample, over a range of stiffnesses.

use std::array;
use std::sync::OnceLock;

use hpu_cosim::scene::{Compound, Device, Scene};
use hpu_plant::Hand;
use hpu_plant::network::Free;

use super::characteristic::{Characteristic, minors};
use super::controller::{Damping, Term, controller};
use super::jet::{ALONG, Jet};
use crate::Error;
use crate::interval::{Interval, Matrix};
use crate::ranges::System;
use crate::series::Series;

/// A linear loop whose stiffness is left open.
#[derive(Debug)]
pub(super) struct OpenLoop {
    /// The plant, or the plants of a parameter box.
    plant: Plants,
    /// Whether the loop has a live spring: a part of the plant that answers the position at once, through the effort's
    /// column.
    live: bool,
    /// Times from a sample to the start of its effort, and from there to the next sample.
    times_s: [Interval; 2],
    whole: u32,
    num: Vec<Term>,
    den: Vec<Term>,
    /// The changes of a loop without a live spring: they do not depend on the stiffness.
    changes: OnceLock<Changes>,
}

/// The plant's changes over the times of [`OpenLoop`]; `None` for a time of zero.
type Changes = [Option<Vec<Vec<Jet>>>; 2];

impl OpenLoop {
    /// Greatest delay, in whole samples, for which limits are worked out.
    pub const MOST_WAITING: u64 = 64;

    /// Returns the linear loop of a scene with this damping.
    ///
    /// # Errors
    ///
    /// Returns the reason why the scene has no linear loop.
    pub fn new(scene: &Scene, damping: Damping) -> Result<Self, Error> {
        if scene.host_clocks > 0 && scene.method.kind.is_live() {
            return Err("its spring follows every clock, and a host hands it on late".into());
        }
        Self::late(scene, damping, scene.clock.edges(scene.model.delay_s) + scene.host_clocks)
    }

    /// Returns the linear loop of a scene whose efforts begin so many clocks after their sample.
    ///
    /// # Errors
    ///
    /// Returns the reason why the scene has no linear loop.
    pub fn late(scene: &Scene, damping: Damping, delay: u64) -> Result<Self, Error> {
        let (num, den) = controller(scene, damping)?;
        if let Some(compound) = scene.network.as_deref() {
            check_network(compound)?;
        }
        let period = scene.period_clocks();
        let (whole, late) = (delay / period, delay % period);
        if whole > Self::MOST_WAITING {
            let most = Self::MOST_WAITING;
            return Err(format!("a delay of {whole} samples, of {most} at most for which this is worked out").into());
        }
        let hertz = scene.clock.frequency_hz() as f64;
        let times_s = [late, period - late].map(|clocks| Interval::exact(clocks as f64).over(hertz));

        let plant = Plants::one(plant(scene, scene));
        let live = scene.method.kind.is_live();
        Ok(Self { plant, live, times_s, whole: whole as u32, num, den, changes: OnceLock::new() })
    }

    /// Returns the same loop around other plants.
    pub fn around(&self, plant: Plants) -> Self {
        Self { plant, num: self.num.clone(), den: self.den.clone(), changes: OnceLock::new(), ..*self }
    }

    /// Returns the plant's degree. The number of poles outside the unit circle is this degree minus the number of turns
    /// of `F` around zero along the circle.
    pub fn degree(&self) -> usize {
        self.plant.over.len() - 1
    }

    /// Returns `e^(A t) - 1` with the effort's column, over the stiffnesses from `low` to `high`.
    fn change(&self, time_s: Interval, [low, high]: [f64; 2]) -> Vec<Vec<Jet>> {
        let Plants { over, middle: own, sides } = &self.plant;
        let (size, mut plant) = (over.len(), over.clone());
        let scales = balance(&mut plant, if self.live { (low * high).sqrt() } else { 0.0 });
        let balance = Balance { scales, live: self.live };
        let flow = |parts: &[&[Vec<Interval>]]| -> Vec<Matrix> {
            Series::new(parts).map(|cell| cell.times(time_s)).exponential_change().into_parts()
        };
        let middle = Interval::exact(0.5 * (low + high));
        let range = Interval { lo: low, hi: high };
        // A and its derivative, scaled to A's size: the series of the exponential has its derivative, and half of its
        // second one where a third part is asked for.
        let none = vec![vec![Interval::ZERO; size]; size];
        let along = |a: &[Vec<Interval>], slope: &[Vec<Interval>], unit: f64, parts: usize| {
            let slope: Vec<Vec<_>> =
                slope.iter().map(|row| row.iter().map(|cell| cell.scaled(unit)).collect()).collect();
            flow(&[a, &slope, &none][..parts])
        };
        let own = own.as_deref().map_or_else(|| plant.clone(), |own| balance.matrix(own));
        let mut known = vec![vec![Jet::ZERO; size]; size];
        let mut put = |Matrix(flow): &Matrix, to: &dyn Fn(&mut Jet) -> &mut Interval, unit: f64| {
            for (jets, row) in known.iter_mut().zip(flow) {
                for (jet, cell) in jets.iter_mut().zip(row) {
                    *to(jet) = cell.scaled(1.0 / unit);
                }
            }
        };
        let mut away = [Interval::ZERO; ALONG];
        if self.live {
            away[0] = range.minus(middle);
            let unit = 2f64.powi(libm::log2(high).floor() as i32);
            let mut over = along(&balance.at(&plant, range), &balance.slope(&plant), unit, 3);
            // A single plant also has its slope at the middle. Over the range the slope departs from that by no more
            // than the second derivative allows.
            if sides.is_empty() {
                let here = along(&balance.at(&own, middle), &balance.slope(&own), unit, 2);
                let bend = over[2].map(|cell| cell.scaled(2.0).times(away[0].scaled(1.0 / unit)));
                over[1] = over[1].within(&here[1].plus(&bend));
                put(&here[0], &|jet| &mut jet.middle, 1.0);
            }
            put(&over[0], &|jet| &mut jet.over, 1.0);
            put(&over[1], &|jet| &mut jet.slopes[0], unit);
        }
        if !self.live || !sides.is_empty() {
            let here = flow(&[&balance.at(&own, middle)]);
            put(&here[0], &|jet| &mut jet.middle, 1.0);
            put(&here[0], &|jet| &mut jet.over, 1.0);
        }
        for (of, Side { slope, half }) in (1..).zip(sides) {
            away[of] = *half;
            let slope = balance.at(&balance.matrix(slope), range);
            // The ratio of the plant's size to the side's.
            let unit = 2f64.powi(libm::log2(half.hi).floor() as i32);
            let over = along(&balance.at(&plant, range), &slope, unit, 2);
            put(&over[0], &|jet| &mut jet.over, 1.0);
            put(&over[1], &|jet| &mut jet.slopes[of], unit);
        }
        let jet = |row: usize, column: usize| known[row][column].tight(&away).scaled(balance.back(row, column));
        (0..size).map(|row| (0..size).map(|column| jet(row, column)).collect()).collect()
    }

    /// Returns the sum of all minors of `E`, which is `det(1 + E) - 1` with `det e^(A t) = e^(t tr A)`: it does not
    /// depend on the stiffness. Where `E` is large, its determinant is a small difference of large numbers; this
    /// identity gives it more precisely.
    fn by_trace(&self, states: usize) -> Jet {
        let whole_s = self.times_s[0].plus(self.times_s[1]);
        let trace =
            |plant: &[Vec<Interval>]| (0..states).fold(Interval::ZERO, |sum, state| sum.plus(plant[state][state]));
        let flowed = |trace: Interval| {
            Series::new(&[&[vec![trace.times(whole_s)]]]).exponential_change().into_parts()[0].0[0][0]
        };
        let Plants { over, middle: own, sides } = &self.plant;
        let of_all = flowed(trace(over));
        let mut by_trace =
            Jet { middle: own.as_ref().map_or(of_all, |own| flowed(trace(own))), over: of_all, ..Jet::ZERO };
        for (slope, side) in by_trace.slopes[1..].iter_mut().zip(sides) {
            *slope = trace(&side.slope).times(whole_s).times(of_all.plus(Interval::exact(1.0)));
        }
        by_trace
    }

    /// Returns the characteristic function over a range of stiffnesses.
    pub fn over(&self, range: [f64; 2]) -> Characteristic {
        let states = self.plant.over.len() - 1;
        let changes = || self.times_s.map(|time_s| (time_s != Interval::ZERO).then(|| self.change(time_s, range)));
        let [late, rest] = if self.live { changes() } else { self.changes.get_or_init(changes).clone() };
        let rest = rest.expect("a period ends after its effort begins");
        let column = |change: &[Vec<Jet>]| -> Vec<Jet> { (0..states).map(|row| change[row][states]).collect() };
        let now = column(&rest);
        let (change, before) = match &late {
            None => (rest, None),
            Some(late) => {
                // (1 + R)(1 + L) = 1 + L + R + R L; the column of L is the column of the effort before.
                let product = |row: usize, of: usize| {
                    (0..states).fold(Jet::ZERO, |sum, k| sum.plus(rest[row][k].times(late[k][of])))
                };
                let joined = |row: usize, of: usize| late[row][of].plus(product(row, of));
                let change = (0..states)
                    .map(|row| (0..states).map(|of| joined(row, of).plus(rest[row][of])).collect())
                    .collect();
                (change, Some((0..states).map(|row| joined(row, states)).collect::<Vec<_>>()))
            }
        };
        let stiffness = Jet {
            middle: Interval::exact(0.5 * (range[0] + range[1])),
            over: Interval { lo: range[0], hi: range[1] },
            slopes: array::from_fn(|of| if of == 0 { Interval::exact(1.0) } else { Interval::ZERO }),
        };
        let mut away = [Interval::ZERO; ALONG];
        away[0] = stiffness.over.minus(stiffness.middle);
        away[1..].iter_mut().zip(&self.plant.sides).for_each(|(away, side)| *away = side.half);
        let mut open = minors(&change, states, None);
        let by_trace = self.by_trace(states);
        let signed = |jet: Jet, negative: bool| if negative { Jet::ZERO.minus(jet) } else { jet };
        let others = (1..states).fold(by_trace, |sum, power| sum.minus(signed(open[power], (states - power) % 2 == 1)));
        open[0] = open[0].within(signed(others, states % 2 == 1));
        for jet in &mut open {
            *jet = jet.tight(&away);
        }
        let answer = |column: &[Jet]| -> Vec<Jet> {
            minors(&change, states, Some(column)).into_iter().map(|jet| jet.tight(&away)).collect()
        };
        let mut terms: Vec<(u32, Vec<Jet>)> = Vec::new();
        let mut add = |term: &Term, late: u32, polynomial: &[Jet]| {
            let by = |value: f64| Jet::constant(Interval::exact(value));
            let factor = by(term.constant).plus(by(term.by_stiffness).times(stiffness));
            let lag = term.lag + late;
            let at = terms.iter().position(|(known, _)| *known == lag).unwrap_or_else(|| {
                terms.push((lag, Vec::new()));
                terms.len() - 1
            });
            let sum = &mut terms[at].1;
            sum.resize(sum.len().max(polynomial.len() + term.power), Jet::ZERO);
            for (to, jet) in sum[term.power..].iter_mut().zip(polynomial) {
                *to = to.plus(factor.times(*jet));
            }
        };
        for term in &self.den {
            add(term, 0, &open);
        }
        let (now, before) = (answer(&now), before.map(|before| answer(&before)));
        for term in &self.num {
            add(term, self.whole, &now);
            if let Some(before) = &before {
                add(term, self.whole + 1, before);
            }
        }
        Characteristic { range, terms, away }
    }
}

/// A plant whose coordinates are scaled, so that its numbers are alike.
struct Balance {
    scales: Vec<f64>,
    live: bool,
}

impl Balance {
    /// Returns the factor of a cell that leads back.
    fn back(&self, row: usize, column: usize) -> f64 {
        self.scales[row] / self.scales[column]
    }

    /// Returns a plant in scaled coordinates.
    fn matrix(&self, matrix: &[Vec<Interval>]) -> Vec<Vec<Interval>> {
        let cell = |row: usize, column: usize| matrix[row][column].scaled(1.0 / self.back(row, column));
        let size = matrix.len();
        (0..size).map(|row| (0..size).map(|column| cell(row, column)).collect()).collect()
    }

    /// Returns the share of the position's column that one unit of stiffness takes away.
    fn springs(&self, matrix: &[Vec<Interval>]) -> Vec<Interval> {
        let (position, effort) = (matrix.len() - 2, matrix.len() - 1);
        matrix.iter().map(|row| row[effort].scaled(self.scales[position] / self.scales[effort])).collect()
    }

    /// Returns a plant with its live spring.
    fn at(&self, matrix: &[Vec<Interval>], stiffness: Interval) -> Vec<Vec<Interval>> {
        let (mut a, position) = (matrix.to_vec(), matrix.len() - 2);
        if self.live {
            for (row, by) in a.iter_mut().zip(self.springs(matrix)) {
                row[position] = row[position].minus(by.times(stiffness));
            }
        }
        a
    }

    /// Returns its derivative with respect to the spring's stiffness.
    fn slope(&self, matrix: &[Vec<Interval>]) -> Vec<Vec<Interval>> {
        let size = matrix.len();
        let mut slope = vec![vec![Interval::ZERO; size]; size];
        for (row, by) in slope.iter_mut().zip(self.springs(matrix)) {
            row[size - 2] = Interval::ZERO.minus(by);
        }
        slope
    }
}

/// Returns `A` with the effort's column, using the words of `nominal`, and a row of zeros for the effort. The position
/// is the last state.
pub(super) fn plant(scene: &Scene, nominal: &Scene) -> Vec<Vec<Interval>> {
    // An effort is a torque at stall: u R / K in volts. In another world of the box the same word makes more or less of
    // it.
    let ohm =
        |winding_ohm: f64| Interval::exact(winding_ohm).plus(Interval::exact(2.0 * scene.bridge.on_resistance_ohm));
    let (mut plant, drive, (up, down)) = match (&scene.device, scene.network.as_deref()) {
        (_, Some(compound)) => {
            let (plant, drive) = of_network(compound);
            let feed = compound.network.feed;
            let up = if compound.dac.is_some() { Interval::exact(1.0) } else { ohm(feed.resistance_ohm) };
            (plant, drive, (up, compound.drive_ratio * feed.torque_constant))
        }
        (device, None) => {
            let system = System::new(scene, scene.hand.grip(), true);
            let effort = match device {
                Device::Motor(motor) => (ohm(motor.resistance_ohm), motor.torque_constant_nm_per_a),
                Device::Mass(_) => (Interval::exact(1.0), 1.0),
            };
            (system.a, system.drive, effort)
        }
    };
    let by = scene.full_command_over(nominal);
    let spare = if by == 1.0 { 0.0 } else { 1e-15 * by };
    let by = Interval { lo: by - spare, hi: by + spare };
    for (row, drive) in plant.iter_mut().zip(&drive) {
        let effort = drive.times(up).over(down);
        row.push(if spare == 0.0 { effort } else { effort.times(by) });
    }
    plant.push(vec![Interval::ZERO; plant.len() + 1]);
    plant
}

/// Refuses networks of which no linear loop is worked out.
pub(super) fn check_network(compound: &Compound) -> Result<(), Error> {
    if compound.network.hand == Hand::Prescribed {
        return Err("no linear loop: the hand imposes the motion of a body".into());
    }
    Ok(())
}

/// Returns the linear system of a network, and the column of one ampere that is asked for or one volt of its bridge.
pub(super) fn of_network(compound: &Compound) -> (Vec<Vec<Interval>>, Vec<Interval>) {
    // Scenes refuse a network that cannot be reduced.
    let Free { a, drive } = compound.network.reduced().expect("a network of a scene").free(2);
    // Each number is rounded once; a zero is one by the network's form.
    let near = |x: f64| if x == 0.0 { Interval::ZERO } else { Interval { lo: x.next_down(), hi: x.next_up() } };
    (a.iter().map(|row| row.iter().copied().map(near).collect()).collect(), drive.into_iter().map(near).collect())
}

/// One plant, or all plants of a parameter box.
#[derive(Clone, Debug)]
pub(super) struct Plants {
    /// Enclosure of all plants of the box.
    pub over: Vec<Vec<Interval>>,
    /// The plant at the middle of the box; `None` for a single plant.
    pub middle: Option<Vec<Vec<Interval>>>,
    /// The sides of the box.
    pub sides: Vec<Side>,
}

/// A side of a box of parameters.
#[derive(Clone, Debug)]
pub(super) struct Side {
    /// Derivatives of the plants along this side, enclosed over all of the box.
    pub slope: Vec<Vec<Interval>>,
    /// Distance from the side's middle to its ends, as an interval around 0.
    pub half: Interval,
}

impl Plants {
    /// Returns a single plant.
    pub const fn one(plant: Vec<Vec<Interval>>) -> Self {
        Self { over: plant, middle: None, sides: Vec::new() }
    }
}

/// Scales the states by powers of two until the rows and columns of the matrix, with this live stiffness, are similar
/// in size; returns the scales. The last row is zero.
fn balance(a: &mut [Vec<Interval>], stiffness: f64) -> Vec<f64> {
    let size = a.len();
    let mut scales = vec![1.0; size];
    let position = size - 2;
    let springs: Vec<f64> = a.iter().map(|row| stiffness * row[size - 1].size()).collect();
    let sized = |a: &[Vec<Interval>], scales: &[f64], row: usize, of: usize| {
        let spring = if of == position { springs[row] * scales[position] / scales[row] } else { 0.0 };
        a[row][of].size() + spring
    };
    for _ in 0..8 {
        for state in 0..size {
            let others = (0..size).filter(|other| *other != state);
            let (row, column) = others.fold((0.0, 0.0), |(row, column), other| {
                (row + sized(a, &scales, state, other), column + sized(a, &scales, other, state))
            });
            // A scale f makes the row 1/f as large and the column f times as large.
            let ratio: f64 = if row == 0.0 || column == 0.0 { continue } else { row / column };
            let scale = 2f64.powi((0.5 * libm::log2(ratio)).round() as i32);
            scales[state] *= scale;
            for cell in &mut a[state] {
                *cell = cell.scaled(1.0 / scale);
            }
            for row in a.iter_mut() {
                row[state] = row[state].scaled(scale);
            }
        }
    }
    scales
}
