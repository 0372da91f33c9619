//! The characteristic function of a scene's linear loop, enclosed over a range of stiffnesses.
//!
//! From sample to sample the plant's states change by `x⁺ = x + E x + Γ u + Γ' u'`. `u` is the effort that begins
//! within the period, `u'` the effort before it. The controller answers the position by `-num(z)/den(z)`, `w` whole
//! samples late. With `δ = z - 1` the loop's poles are the roots of
//!
//! `F(z) = den(z) det(δ - E) + num(z) z^-w c adj(δ - E) (Γ + Γ'/z)`.
//!
//! At the sample rate of a controller `F` is well conditioned in powers of `δ`, but not in powers of `z`. A sampled
//! spring enters `num` and `den` affinely. A live spring is part of the plant, so `E` and `Γ` are matrix exponentials
//! over an interval of stiffnesses, with their derivatives.
//!
//! Every enclosure holds for the scene's parameters as `f64` numbers, whatever is rounded during the computation.

use std::array;

use hpu_cosim::method::CouplingMethod;
use hpu_cosim::scene::{Device, LawMethod, Loop, Scene};
use hpu_datapath::Estimator;

use crate::interval::{Complex, Interval, Matrix};
use crate::widths::System;

/// Greatest number of sides of a parameter box over which the function is enclosed.
pub(super) const MOST_SIDES: usize = 3;
/// Number of variables of a [`Jet`]: the stiffness, then the sides of a box.
const ALONG: usize = 1 + MOST_SIDES;

/// A number that depends on the stiffness and on parameters: its enclosure at the middle of their ranges, its enclosure
/// over all of the ranges, and its derivatives over all of the ranges.
#[derive(Clone, Copy, Debug)]
struct Jet {
    middle: Interval,
    over: Interval,
    slopes: [Interval; ALONG],
}

impl Jet {
    const ZERO: Self = Self::constant(Interval::ZERO);

    const fn constant(value: Interval) -> Self {
        Self { middle: value, over: value, slopes: [Interval::ZERO; ALONG] }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            middle: self.middle.plus(other.middle),
            over: self.over.plus(other.over),
            slopes: array::from_fn(|of| self.slopes[of].plus(other.slopes[of])),
        }
    }

    fn minus(self, other: Self) -> Self {
        Self {
            middle: self.middle.minus(other.middle),
            over: self.over.minus(other.over),
            slopes: array::from_fn(|of| self.slopes[of].minus(other.slopes[of])),
        }
    }

    /// Returns the intersection of two enclosures of the same number.
    fn within(self, other: Self) -> Self {
        Self {
            middle: within(self.middle, other.middle),
            over: within(self.over, other.over),
            slopes: array::from_fn(|of| within(self.slopes[of], other.slopes[of])),
        }
    }

    /// Returns the same number with `over` intersected with its mean-value form: `middle` plus each slope times the
    /// distance `away` from the middle to the ends.
    fn tight(self, away: &[Interval; ALONG]) -> Self {
        let meant = self.slopes.iter().zip(away).fold(self.middle, |sum, (slope, away)| sum.plus(slope.times(*away)));
        Self { over: within(self.over, meant), ..self }
    }

    fn times(self, other: Self) -> Self {
        Self {
            middle: self.middle.times(other.middle),
            over: self.over.times(other.over),
            slopes: array::from_fn(|of| self.slopes[of].times(other.over).plus(self.over.times(other.slopes[of]))),
        }
    }

    /// Returns the product with a power of two.
    fn scaled(self, by: f64) -> Self {
        Self {
            middle: self.middle.scaled(by),
            over: self.over.scaled(by),
            slopes: self.slopes.map(|slope| slope.scaled(by)),
        }
    }
}

/// A term of a controller's polynomial: `(constant + by_stiffness K) δ^power z^-lag`.
#[derive(Clone, Copy, Debug)]
struct Term {
    lag: u32,
    power: usize,
    constant: f64,
    by_stiffness: f64,
}

impl Term {
    const fn new(lag: u32, power: usize, constant: f64, by_stiffness: f64) -> Self {
        Self { lag, power, constant, by_stiffness }
    }
}

/// The wall's damping, as a function of the wall's stiffness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Damping {
    /// The same damping at every stiffness, in SI units.
    Fixed(f64),
    /// A damping proportional to the stiffness; the factor is in seconds.
    PerStiffness(f64),
}

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
}

impl OpenLoop {
    /// Greatest delay, in whole samples, for which limits are worked out.
    pub const MOST_WAITING: u64 = 64;

    /// Returns the linear loop of a scene with this damping.
    ///
    /// # Errors
    ///
    /// Returns the reason why the scene has no linear loop.
    pub fn new(scene: &Scene, damping: Damping) -> Result<Self, String> {
        let (num, den) = controller(scene, damping)?;
        let period = scene.period_clocks();
        let delay = scene.clock.edges(scene.model.delay_s);
        let (whole, late) = (delay / period, delay % period);
        if whole > Self::MOST_WAITING {
            let most = Self::MOST_WAITING;
            return Err(format!("a delay of {whole} samples, of {most} at most for which this is worked out"));
        }
        let hertz = scene.clock.frequency_hz() as f64;
        let times_s = [late, period - late].map(|clocks| Interval::exact(clocks as f64).over(hertz));

        let plant = Plants::one(plant(scene, scene));
        let live = scene.method.kind.is_live();
        Ok(Self { plant, live, times_s, whole: whole as u32, num, den })
    }

    /// Returns the same loop around other plants.
    pub fn around(&self, plant: Plants) -> Self {
        Self { plant, num: self.num.clone(), den: self.den.clone(), ..*self }
    }

    /// Returns the plant's degree. The number of poles outside the unit circle is this degree minus the number of turns
    /// of `F` around zero along the circle.
    pub fn degree(&self) -> usize {
        self.plant.over.len() - 1
    }

    /// Returns `e^(A t) - 1` with the effort's column, over the stiffnesses from `low` to `high`.
    fn change(&self, time_s: Interval, [low, high]: [f64; 2]) -> Vec<Vec<Jet>> {
        let Plants { over, middle: own, sides } = &self.plant;
        let (size, position) = (over.len(), over.len() - 2);
        let mut plant = over.clone();
        let scales = balance(&mut plant, if self.live { (low * high).sqrt() } else { 0.0 });
        let back = |row: usize, column: usize| scales[row] / scales[column];
        let balanced = |matrix: &[Vec<Interval>]| -> Vec<Vec<Interval>> {
            let cell = |row: usize, column: usize| matrix[row][column].scaled(1.0 / back(row, column));
            (0..size).map(|row| (0..size).map(|column| cell(row, column)).collect()).collect()
        };
        // The share of the position's column that one unit of stiffness takes away.
        let springs = |matrix: &[Vec<Interval>]| -> Vec<Interval> {
            matrix.iter().map(|row| row[size - 1].scaled(scales[position] / scales[size - 1])).collect()
        };
        let at = |matrix: &[Vec<Interval>], stiffness: Interval| {
            let mut a = matrix.to_vec();
            if self.live {
                for (row, by) in a.iter_mut().zip(springs(matrix)) {
                    row[position] = row[position].minus(by.times(stiffness));
                }
            }
            a
        };
        let flow = |a: Vec<Vec<Interval>>| Matrix(a).map(|cell| cell.times(time_s)).exponential_change().0;
        let middle = Interval::exact(0.5 * (low + high));
        let range = Interval { lo: low, hi: high };
        // With A's derivative beside A on the diagonal, the second block of the exponential's first row is the
        // exponential's derivative. With both blocks once more, the third block is half of the second derivative. Each
        // derivative is scaled to A's size.
        let beside = |a: Vec<Vec<Interval>>, slope: &[Vec<Interval>], unit: f64, blocks: usize| {
            let mut all = vec![vec![Interval::ZERO; blocks * size]; blocks * size];
            for at in 0..blocks {
                for row in 0..size {
                    all[at * size + row][at * size..(at + 1) * size].copy_from_slice(&a[row]);
                    if at + 1 < blocks {
                        let next = (at + 1) * size;
                        let scaled = slope[row].iter().map(|cell| cell.scaled(unit));
                        all[at * size + row][next..next + size]
                            .iter_mut()
                            .zip(scaled)
                            .for_each(|(to, cell)| *to = cell);
                    }
                }
            }
            flow(all)
        };
        let own = own.as_deref().map_or_else(|| plant.clone(), balanced);
        let mut known = vec![vec![Jet::ZERO; size]; size];
        let mut put = |flow: &[Vec<Interval>], to: &dyn Fn(&mut Jet) -> &mut Interval, block: usize, unit: f64| {
            for (row, jets) in known.iter_mut().enumerate() {
                for (column, jet) in jets.iter_mut().enumerate() {
                    *to(jet) = flow[row][block * size + column].scaled(1.0 / unit);
                }
            }
        };
        let mut away = [Interval::ZERO; ALONG];
        if self.live {
            away[0] = range.minus(middle);
            let unit = 2f64.powi(high.log2().floor() as i32);
            let by = |matrix: &[Vec<Interval>]| -> Vec<Vec<Interval>> {
                let mut slope = vec![vec![Interval::ZERO; size]; size];
                for (row, by) in slope.iter_mut().zip(springs(matrix)) {
                    row[position] = Interval::ZERO.minus(by);
                }
                slope
            };
            let mut over = beside(at(&plant, range), &by(&plant), unit, 3);
            // A single plant also has its slope at the middle. Over the range the slope departs from that by no more
            // than the second derivative allows.
            if sides.is_empty() {
                let here = beside(at(&own, middle), &by(&own), unit, 2);
                for (row, here) in over.iter_mut().zip(&here) {
                    for column in 0..size {
                        let bend = row[2 * size + column].scaled(2.0).times(away[0].scaled(1.0 / unit));
                        row[size + column] = within(row[size + column], here[size + column].plus(bend));
                    }
                }
                put(&here, &|jet| &mut jet.middle, 0, 1.0);
            }
            put(&over, &|jet| &mut jet.over, 0, 1.0);
            put(&over, &|jet| &mut jet.slopes[0], 1, unit);
        }
        if !self.live || !sides.is_empty() {
            let here = flow(at(&own, middle));
            put(&here, &|jet| &mut jet.middle, 0, 1.0);
            put(&here, &|jet| &mut jet.over, 0, 1.0);
        }
        for (of, Side { slope, half }) in (1..).zip(sides) {
            away[of] = *half;
            let slope = at(&balanced(slope), range);
            // The ratio of the plant's size to the side's.
            let unit = 2f64.powi(half.hi.log2().floor() as i32);
            let over = beside(at(&plant, range), &slope, unit, 2);
            put(&over, &|jet| &mut jet.over, 0, 1.0);
            put(&over, &|jet| &mut jet.slopes[of], 1, unit);
        }
        let jet = |row: usize, column: usize| known[row][column].tight(&away).scaled(back(row, column));
        (0..size).map(|row| (0..size).map(|column| jet(row, column)).collect()).collect()
    }

    /// Returns the characteristic function over a range of stiffnesses.
    pub fn over(&self, range: [f64; 2]) -> Characteristic {
        let states = self.plant.over.len() - 1;
        let [late, rest] = self.times_s.map(|time_s| (time_s != Interval::ZERO).then(|| self.change(time_s, range)));
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
        // det e^(A t) = e^(t tr A) does not depend on the stiffness, and det(1 + E) is the sum of all minors of E.
        // Where E is large, its determinant is a small difference of large numbers; this identity gives it more
        // precisely.
        let (late_s, rest_s) = (self.times_s[0], self.times_s[1]);
        let trace =
            |plant: &[Vec<Interval>]| (0..states).fold(Interval::ZERO, |sum, state| sum.plus(plant[state][state]));
        let flowed =
            |trace: Interval| Matrix(vec![vec![trace.times(late_s.plus(rest_s))]]).exponential_change().0[0][0];
        let Plants { over, middle: own, sides } = &self.plant;
        let of_all = flowed(trace(over));
        let whole_s = late_s.plus(rest_s);
        let mut by_trace =
            Jet { middle: own.as_ref().map_or(of_all, |own| flowed(trace(own))), over: of_all, ..Jet::ZERO };
        for (slope, side) in by_trace.slopes[1..].iter_mut().zip(sides) {
            *slope = trace(&side.slope).times(whole_s).times(of_all.plus(Interval::exact(1.0)));
        }
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

/// Returns `A` with the effort's column, using the words of `nominal`, and a row of zeros for the effort. The position
/// is the last state.
pub(super) fn plant(scene: &Scene, nominal: &Scene) -> Vec<Vec<Interval>> {
    let system = System::new(scene, scene.hand.grip(), true);
    // An effort is a torque at stall: u R / K in volts. In another world of the box the same word makes more or less of
    // it.
    let (up, down) = match &scene.device {
        Device::Motor(motor) => {
            let ohm = Interval::exact(motor.resistance_ohm).plus(Interval::exact(2.0 * scene.bridge.on_resistance_ohm));
            (ohm, motor.torque_constant_nm_per_a)
        }
        Device::Mass(_) => (Interval::exact(1.0), 1.0),
    };
    let by = scene.full_command_over(nominal);
    let spare = if by == 1.0 { 0.0 } else { 1e-15 * by };
    let by = Interval { lo: by - spare, hi: by + spare };
    let mut plant = system.a;
    for (row, drive) in plant.iter_mut().zip(&system.drive) {
        let effort = drive.times(up).over(down);
        row.push(if spare == 0.0 { effort } else { effort.times(by) });
    }
    plant.push(vec![Interval::ZERO; plant.len() + 1]);
    plant
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

/// Returns the numbers that two enclosures of the same number have in common.
fn within(a: Interval, b: Interval) -> Interval {
    a.common(b).expect("two enclosures of the same number")
}

/// Returns the controller of a scene's method, from position to effort, as numerator and denominator.
fn controller(scene: &Scene, damping: Damping) -> Result<(Vec<Term>, Vec<Term>), String> {
    let period_s = scene.sample_period_s();
    let one = || vec![Term::new(0, 0, 1.0, 0.0)];
    let sampled = f64::from(u8::from(!scene.method.kind.is_live()));
    let (fixed, per_stiffness) = match damping {
        Damping::Fixed(damping) => (damping, 0.0),
        Damping::PerStiffness(seconds) => (0.0, seconds),
    };
    // The damping term of a velocity estimate that takes `share` of each sample's difference.
    let damped = |fixed: f64, share: f64, lag: u32, power: usize| {
        Term::new(lag, power, share * fixed / period_s, share * per_stiffness / period_s)
    };
    let plain = |fixed: f64| vec![Term::new(0, 0, 0.0, sampled), damped(fixed, 1.0, 1, 1)];
    let nonlinear = |what: &str| Err(format!("no linear loop: {what} is nonlinear"));
    let law = match scene.method.kind {
        Loop::Hybrid | Loop::Conventional => return Ok((plain(fixed), one())),
        Loop::Law(law) => law,
    };
    if scene.method.shaper_hz.is_some() {
        return nonlinear("the input shaper");
    }
    match law {
        LawMethod::SampledWall(wall) => {
            let fixed = fixed - wall.relief_nm_s_per_rad;
            if fixed == 0.0 && per_stiffness == 0.0 {
                return Ok((plain(fixed), one()));
            }
            if wall.ratio != 1 {
                return Err(format!(
                    "no linear loop of one rate: the velocity is renewed every {} samples",
                    wall.ratio
                ));
            }
            match wall.estimator {
                Estimator::Difference => Ok((plain(fixed), one())),
                // Each sample renews a share of 2^-shift.
                Estimator::Filtered => {
                    let share = 0.5f64.powi(wall.shift as i32);
                    let den = vec![Term::new(0, 0, share, 0.0), Term::new(1, 1, 1.0 - share, 0.0)];
                    let mut num: Vec<Term> = den
                        .iter()
                        .map(|term| Term { constant: 0.0, by_stiffness: sampled * term.constant, ..*term })
                        .collect();
                    num.push(damped(fixed, share, 1, 1));
                    Ok((num, den))
                }
                Estimator::Window => {
                    let share = 1.0 / f64::from(wall.window);
                    let spring = Term::new(0, 0, 0.0, sampled);
                    let ends = [damped(fixed, share, 0, 0), damped(fixed, -share, wall.window, 0)];
                    Ok(([spring].into_iter().chain(ends).collect(), one()))
                }
                Estimator::Foaw => nonlinear("an adaptive window"),
                Estimator::EdgeTimer => nonlinear("a velocity from the time between two counts"),
            }
        }
        // The loop obeys e (K + K_c + B_c (1 - 1/z)/T) = K x, and the force is e (K_c + B_c (1 - 1/z)/T).
        LawMethod::VirtualCoupling(CouplingMethod { coupling_nm_per_rad, coupling_nm_s_per_rad, rigid }) => {
            let damper = coupling_nm_s_per_rad / period_s;
            if rigid {
                return Err("the coupling's wall is rigid, whatever its stiffness".into());
            }
            Ok((
                vec![Term::new(0, 0, 0.0, coupling_nm_per_rad), Term::new(1, 1, 0.0, damper)],
                vec![Term::new(0, 0, coupling_nm_per_rad, 1.0), Term::new(1, 1, damper, 0.0)],
            ))
        }
        LawMethod::PassivityController(_) => nonlinear("a passivity controller"),
        LawMethod::EnergyBounding(_) => nonlinear("energy bounding"),
        LawMethod::PassiveSpring(_) => nonlinear("an energy-level spring"),
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
            let scale = 2f64.powi((0.5 * ratio.log2()).round() as i32);
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

/// Returns the coefficients of the powers of `δ`, the lowest first: of `det(δ - E)`, or, with a column, of
/// `c adj(δ - E) column`, where `c` picks the last state. By Cramer's rule the second is the determinant with its last
/// column replaced.
fn minors(change: &[Vec<Jet>], states: usize, column: Option<&[Jet]>) -> Vec<Jet> {
    let last = states - 1;
    let entry = |row: usize, of: usize| match column {
        Some(column) if of == last => column[row],
        _ => change[row][of],
    };
    let own = if column.is_some() { last } else { states };
    let mut coefficients = vec![Jet::ZERO; own + 1];
    for set in 0u32..1 << own {
        let mut kept: Vec<usize> = (0..own).filter(|state| set >> state & 1 == 1).collect();
        let negative = kept.len() % 2 == 1;
        let power = own - kept.len();
        if column.is_some() {
            kept.push(last);
        }
        let minor = determinant(&kept, &entry);
        let sum = coefficients[power];
        coefficients[power] = if negative { sum.minus(minor) } else { sum.plus(minor) };
    }
    coefficients
}

/// Returns the determinant of the kept rows and columns, expanded along the first kept row.
fn determinant(kept: &[usize], entry: &impl Fn(usize, usize) -> Jet) -> Jet {
    fn along(rows: &[usize], columns: &[usize], entry: &impl Fn(usize, usize) -> Jet) -> Jet {
        let Some((&row, rows)) = rows.split_first() else { return Jet::constant(Interval::exact(1.0)) };
        let mut sum = Jet::ZERO;
        for (index, &column) in columns.iter().enumerate() {
            let others: Vec<usize> = columns.iter().copied().filter(|other| *other != column).collect();
            let product = entry(row, column).times(along(rows, &others, entry));
            sum = if index % 2 == 0 { sum.plus(product) } else { sum.minus(product) };
        }
        sum
    }
    along(kept, kept, entry)
}

/// The characteristic function `F`, over all stiffnesses of a range.
pub(super) struct Characteristic {
    pub range: [f64; 2],
    /// Pairs of a lag, in samples, and the coefficients of the powers of `δ` at this lag.
    terms: Vec<(u32, Vec<Jet>)>,
    /// Distances from the middle to the ends: of the stiffnesses, then of each side of the box.
    pub away: [Interval; ALONG],
}

/// A function over an arc of the unit circle, and its derivative by the angle.
#[derive(Clone, Copy)]
pub(super) struct OnArc {
    pub value: Complex,
    pub by_angle: Complex,
}

/// Selects which number of each coefficient a value is computed from.
#[derive(Clone, Copy)]
pub(super) enum Of {
    /// `F` at the middle of the range of stiffnesses and of the parameter box.
    Middle,
    /// `F` over all of the range and the box.
    Range,
    /// The derivative of `F` over all of the range and the box: by the stiffness (0), or by a side of the box (from 1
    /// on).
    Slope(usize),
}

impl Of {
    fn pick(self, jet: &Jet) -> Interval {
        match self {
            Self::Middle => jet.middle,
            Self::Range => jet.over,
            Self::Slope(of) => jet.slopes[of],
        }
    }
}

/// Returns `δ` on the unit circle, computed from half of the angle so that it is precise near `z = 1`.
fn delta(half: Interval) -> Complex {
    let (sine, cosine) = (half.sin(), half.cos());
    let product = sine.times(cosine).scaled(2.0);
    Complex { re: Interval::ZERO.minus(sine.times(sine).scaled(2.0)), im: product }
}

fn turn(lag: u32, angle: Interval) -> Complex {
    let turned = angle.times(Interval::exact(f64::from(lag)));
    Complex { re: turned.cos(), im: Interval::ZERO.minus(turned.sin()) }
}

impl Characteristic {
    /// Returns the polynomial of one lag's coefficients, and its derivative by `δ`.
    fn polynomial(coefficients: &[Jet], delta: Complex, of: Of) -> [Complex; 2] {
        let (mut value, mut slope) = (Complex::ZERO, Complex::ZERO);
        for jet in coefficients.iter().rev() {
            slope = slope.times(delta).plus(value);
            value = value.times(delta).plus(Complex { re: of.pick(jet), im: Interval::ZERO });
        }
        [value, slope]
    }

    /// Returns `F` or its slope over an arc.
    pub fn on(&self, angle: Interval, of: Of) -> OnArc {
        let delta = delta(angle.scaled(0.5));
        let z = Complex { re: delta.re.plus(Interval::exact(1.0)), im: delta.im };
        let (mut all, mut by_angle) = (Complex::ZERO, Complex::ZERO);
        for (lag, coefficients) in &self.terms {
            let [value, slope] = Self::polynomial(coefficients, delta, of);
            let turned = turn(*lag, angle);
            all = all.plus(value.times(turned));
            let late = value.scaled(Interval::exact(-f64::from(*lag)));
            by_angle = by_angle.plus(slope.times(z).plus(late).times(turned).turned());
        }
        OnArc { value: all, by_angle }
    }

    /// Whether the coefficients prove that some pole is outside the unit circle at every stiffness of the range: by
    /// Vieta, if all poles are inside, no coefficient exceeds its binomial. `false` proves nothing.
    pub fn is_surely_unstable(&self) -> bool {
        let lags = self.terms.iter().map(|(lag, _)| *lag as usize).max().unwrap_or(0);
        let top = self.terms.iter().map(|(lag, terms)| (terms.len() + lags).saturating_sub(1 + *lag as usize)).max();
        let mut powers = vec![Interval::ZERO; top.unwrap_or(0) + 1];
        for (lag, coefficients) in &self.terms {
            // Expands the powers (z - 1)^k by Horner's scheme, the highest power last.
            let mut polynomial: Vec<Interval> = Vec::new();
            for jet in coefficients.iter().rev() {
                polynomial.insert(0, Interval::ZERO);
                for power in 1..polynomial.len() {
                    polynomial[power - 1] = polynomial[power - 1].minus(polynomial[power]);
                }
                match polynomial.first_mut() {
                    Some(first) => *first = first.plus(jet.over),
                    None => unreachable!("just made longer"),
                }
            }
            for (power, coefficient) in polynomial.into_iter().enumerate() {
                let at = power + lags - *lag as usize;
                powers[at] = powers[at].plus(coefficient);
            }
        }
        let mut most = powers.last().map_or(0.0, |lead| lead.size());
        let degree = powers.len() - 1;
        powers.iter().rev().enumerate().any(|(index, coefficient)| {
            let exceeds = coefficient.lo.max(-coefficient.hi) > most;
            // A billionth is allowed for the rounding of the binomials.
            most *= (1.0 + 1e-9) * (degree - index) as f64 / (index + 1) as f64;
            exceeds
        })
    }

    /// Returns `F` or its slope at `z = 1` or `z = -1`, where it is real.
    pub fn at(&self, minus_one: bool, of: Of) -> Interval {
        let delta = Interval::exact(if minus_one { -2.0 } else { 0.0 });
        self.terms.iter().fold(Interval::ZERO, |sum, (lag, coefficients)| {
            let add = |value: Interval, jet: &Jet| value.times(delta).plus(of.pick(jet));
            let value = coefficients.iter().rev().fold(Interval::ZERO, add);
            if minus_one && lag % 2 == 1 { sum.minus(value) } else { sum.plus(value) }
        })
    }
}
