//! A proof that the output of a loop around a transfer function stays within bounds for ever.
//!
//! As long as no word saturates, the loop is linear but for what its words round away: `z+ = M z + b + E δ`, from
//! sample to sample. `z` has the plant's states and the words that the controller remembers, and each of `δ` is
//! rounding that is known to be small. So in each row `H` that is looked at, the motion is within `sum|H M^j E| |δ|` of
//! the motion without rounding, whatever the rounding is.
//!
//! 1. Coordinates are found in which `|M z| <= q |z|` with `q < 1`. This is proved: `q² - M'M` is positive definite.
//! 2. The sums are added up sample by sample. The rest after `n` samples is at most `|H| |M^n E| / (1 - q)`.
//! 3. The motion without rounding is followed as a ball, whose radius takes all that arithmetic loses. It is followed
//!    until the bound `|H| |z - z*|` of all that is to come, about the rest `z*`, adds nothing.
//! 4. Between samples a continuous plant's output is within `h²/8 max|y''|` of a chord over `h`.
//!
//! With all rounding added, readings, outputs and commands must fit their words at every sample. Then none saturates,
//! and the premise holds for ever. It is a proof of real numbers under the words' controller, from the emulator's state
//! at a sample on, and it holds for a controller without rounding, too.

use hpu_cosim::scene::{TransferScene, number};
use hpu_cosim::{Samples, TransferSimulation};
use hpu_plant::transfer::PairMatrices;

use crate::interval::{Interval, Matrix};
use crate::recurring::{Map, enclosed};
use crate::sampled::{self, SampledLoop};
use crate::series;

/// The greatest growth from sample to sample of a loop that is looked at.
const MOST_GROWTH: f64 = 1.0 - 1e-7;
/// Shares of the way from the loop's growth to 1 that are tried as its shrinking.
const SHARES: [f64; 3] = [0.5, 0.8, 0.95];
/// The most products of numbers of a sum, or of a motion that is followed.
const MOST_PRODUCTS: usize = 200_000_000;
/// The share of a sum that its rest may have.
const REST: f64 = 1e-2;
/// The least and the greatest number of parts of a sample.
const LEAST_PARTS: f64 = 4.0;
const MOST_PARTS: f64 = 64.0;
/// The most starts that are tried, each twice as late as the one before.
const MOST_STARTS: usize = 24;
/// Half of an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;
/// The greatest size of a number that turns a loop, and more than products of such numbers lose below the least `f64`.
const GREATEST: f64 = 1e100;
const LEAST: f64 = 1e-200;

/// Bounds of an output for ever.
#[derive(Clone, PartialEq, Debug)]
pub struct Confined {
    /// The clock edge of the sample from which on they hold.
    pub from_edge: u64,
    /// The least and the greatest output, also between samples.
    pub ends: [f64; 2],
    /// The same, of the samples up to the end of the run.
    pub in_run: [f64; 2],
    /// Outputs that samples of the run are proved to reach: one at most as great as the first number, and one at least
    /// as great as the second.
    pub reached: [f64; 2],
    /// The rest that the output approaches as near as rounding lets it, and a bound of its distance at late samples.
    pub rest: f64,
    /// That bound, in the plant's unit.
    pub off: f64,
    /// That bound, in steps of the ADC.
    pub off_counts: f64,
}

/// Rows that are looked at: the output that is read, the controller's own, and that of its word. Then follow the
/// outputs at the ends of the parts of a sample, and the changes of the states.
const READ: usize = 0;
const OWN: usize = 1;
const COMMAND: usize = 2;
const FIRST: usize = 3;

/// The loop from sample to sample, in the units of plant, reference and input.
struct Loop<'s> {
    map: Map<'s>,
    /// Coefficients of the errors, and those of the outputs before, by the first of these.
    numerator: Vec<Interval>,
    denominator: Vec<Interval>,
    /// `C e^(A t)` and its input's share at the ends of the parts of a sample, and bounds of `C A e^(A t)` within each.
    parts: Vec<(Vec<Interval>, Interval)>,
    bends: Vec<Vec<Interval>>,
    /// An eighth of the square of a part.
    eighth: Interval,
    given: PairMatrices,
    /// Centres and bounds of what reading, own output and command are rounded by.
    lost: [[f64; 2]; 3],
}

impl<'s> Loop<'s> {
    fn new(simulation: &TransferSimulation<'s>) -> Self {
        let map = Map::new(simulation);
        let (scene, words, given) = (map.scene, simulation.words(), simulation.plant().matrices());
        let exact = |word: &i64| Interval::exact(*word as f64);
        let first = words.denominator[0];
        // A divisor has to be above 0.
        let over = |word: &i64| exact(&(word * first.signum())).over(first.unsigned_abs() as f64);
        let step = Interval::exact(scene.output_lsb()).over(scene.adc.range.lsb());
        let (c, d) = (given.c.iter().map(|&x| enclosed(x)).collect::<Vec<_>>(), enclosed(given.d));
        let (mut parts, mut bends, mut eighth) = (vec![(c.clone(), d)], Vec::new(), Interval::ZERO);
        if !scene.discrete {
            let rows: Vec<Vec<Interval>> =
                given.a.iter().map(|row| row.iter().map(|&x| enclosed(x)).collect()).collect();
            let sample_s = Interval::exact(scene.adc.period as f64).over(scene.clock.frequency_hz() as f64);
            let count = (8.0 * Matrix(rows.clone()).norm() * sample_s.hi).ceil().clamp(LEAST_PARTS, MOST_PARTS);
            let part_s = sample_s.over(count);
            eighth = part_s.times(part_s).scaled(0.125);
            let within = Interval { lo: 0.0, hi: part_s.hi };
            let turned = Matrix(vec![c.clone()]).times(&Matrix(rows.clone()));
            let with_input = |time: Interval| {
                let order = rows.len();
                let all = rows.iter().zip(&given.b).map(|(row, &b)| [row.as_slice(), &[enclosed(b)]].concat());
                let all = all.chain([vec![Interval::ZERO; order + 1]]);
                Matrix(all.map(|row| row.iter().map(|cell| cell.times(time)).collect()).collect())
            };
            for part in 0..count as u32 {
                let begin = part_s.times(Interval::exact(f64::from(part)));
                let end = part_s.times(Interval::exact(f64::from(part + 1)));
                let flow = series::exponential(&with_input(end));
                let column = |at: usize| flow.0[..rows.len()].iter().map(move |row| row[at]);
                let across = |at: usize| column(at).zip(&c).fold(Interval::ZERO, |sum, (x, c)| sum.plus(c.times(x)));
                let at_end = (0..rows.len()).map(across).collect();
                parts.push((at_end, across(rows.len()).plus(d)));
                let span = begin.plus(within);
                let flow = series::exponential(&Matrix(rows.clone()).map(|cell| cell.times(span)));
                bends.push(turned.times(&flow).0.swap_remove(0));
            }
        }
        let half = |lsb: f64, floors: bool, sign: f64| [if floors { 0.5 * sign * lsb } else { 0.0 }, 0.5 * lsb];
        let floors = scene.method.floors;
        let lost = [
            half(scene.adc.range.lsb(), scene.adc.floors, 1.0),
            half(scene.output_lsb(), floors, -1.0),
            if scene.method.fraction > 0 { half(scene.dac.lsb(), floors, -1.0) } else { [0.0; 2] },
        ];
        Self {
            numerator: words.numerator.iter().map(|word| over(word).times(step)).collect(),
            denominator: words.denominator[1..].iter().map(over).collect(),
            parts,
            bends,
            eighth,
            given,
            lost,
            map,
        }
    }

    /// Returns the number of states: the plant's, the errors and outputs before, and the command before.
    fn states(&self) -> usize {
        self.given.a.len() + self.numerator.len() + self.denominator.len()
    }

    /// Returns the state that follows, and the rows. `given` are the reference with the ADC's offset, and the
    /// disturbance; `lost` is what rounding adds.
    fn step(&self, z: &[Interval], given: [Interval; 2], lost: [Interval; 3]) -> (Vec<Interval>, Vec<Interval>) {
        let order = self.given.a.len();
        let (x, past) = z.split_at(order);
        let (errors, past) = past.split_at(self.numerator.len() - 1);
        let (outputs, before) = past.split_at(self.denominator.len());
        let dot = |row: &[Interval], x: &[Interval]| {
            row.iter().zip(x).fold(Interval::ZERO, |sum, (cell, x)| sum.plus(cell.times(*x)))
        };
        let Map { scene, from_x, from_u, c, d, .. } = &self.map;
        let is_late = scene.late > 0;
        let read = dot(c, x).plus(d.times(before[0].plus(given[1])));
        let error = given[0].minus(read).plus(lost[0]);
        let errors = [&[error], errors].concat();
        let own = dot(&self.numerator, &errors).minus(dot(&self.denominator, outputs)).plus(lost[1]);
        let command = own.plus(lost[2]);
        let input = if is_late { before[0] } else { command }.plus(given[1]);
        let next = from_x.0.iter().zip(from_u).map(|(row, of_input)| dot(row, x).plus(of_input.times(input)));
        let mut next: Vec<Interval> = next.collect();
        next.extend(&errors[..self.numerator.len() - 1]);
        next.extend([&[own], outputs].concat()[..self.denominator.len()].iter().copied());
        next.push(command);
        let mut rows = vec![read, own, command];
        rows.extend(self.parts.iter().map(|(of_x, of_input)| dot(of_x, x).plus(of_input.times(input))));
        if !scene.discrete {
            let enclosed_row = |row: &Vec<[f64; 2]>| row.iter().map(|&cell| enclosed(cell)).collect::<Vec<_>>();
            let change =
                |(row, &b): (&Vec<[f64; 2]>, &[f64; 2])| dot(&enclosed_row(row), x).plus(enclosed(b).times(input));
            rows.extend(self.given.a.iter().zip(&self.given.b).map(change));
        }
        (next, rows)
    }

    /// Returns the outputs from one sample to the next, of these rows.
    fn passed(&self, rows: &[Interval]) -> Interval {
        let joined = |one: Interval, other: Interval| Interval { lo: one.lo.min(other.lo), hi: one.hi.max(other.hi) };
        let outputs = &rows[FIRST..FIRST + self.parts.len()];
        let mut all = joined(rows[READ], outputs[0]);
        for (pair, bend) in outputs.windows(2).zip(&self.bends) {
            let changes = &rows[FIRST + self.parts.len()..];
            let bent = bend
                .iter()
                .zip(changes)
                .fold(0.0, |sum: f64, (cell, change)| (sum + (cell.size() * change.size()).next_up()).next_up());
            let beyond = Interval::exact(bent).times(self.eighth).hi;
            all = joined(all, joined(pair[0], pair[1]).plus(Interval { lo: -beyond, hi: beyond }));
        }
        all
    }

    /// Whether no word of these rows saturates.
    fn fits(&self, rows: &[Interval]) -> bool {
        let scene = self.map.scene;
        let is_between = |row: Interval, ends: [f64; 2], lsb: f64| {
            let end = |word: f64| Interval::exact(word).times(Interval::exact(lsb));
            end(ends[0]).hi < row.lo && row.hi < end(ends[1]).lo
        };
        let [least, most] = scene.adc.range.ends().map(|word| word as f64);
        let read = rows[READ].minus(Interval::exact(scene.adc.offset));
        let ends = if scene.adc.floors { [least, most + 1.0] } else { [least - 0.5, most + 0.5] };
        let of_command = scene.dac.ends().map(|word| word as f64);
        // The controller's own format has a sign.
        let bits = scene.dac.bits + u32::from(!scene.dac.signed) + scene.method.fraction - 1;
        let half = 2f64.powi(bits.cast_signed());
        // A word may be that at its end.
        let [low, high] = of_command;
        // A number that is none, or no longer finite, proves nothing.
        rows.iter().all(|row| row.lo.is_finite() && row.hi.is_finite())
            && is_between(read, ends, scene.adc.range.lsb())
            && is_between(rows[OWN], [-half - 0.5, half - 0.5], scene.output_lsb())
            && is_between(rows[COMMAND], [low - 0.5, high + 0.5], scene.dac.lsb())
    }
}

/// A point, and the greatest distance of the true one from it, in the coordinates in which the loop shrinks.
#[derive(Clone)]
struct Ball {
    at: Vec<f64>,
    off: f64,
}

/// Returns a bound of the root of the sum of squares.
fn size(all: impl Iterator<Item = f64>) -> f64 {
    let squares = all.fold(0.0, |sum: f64, x| (sum + (x * x).next_up()).next_up());
    squares.sqrt().next_up()
}

/// Returns a bound of a sum of products of numbers that are not below 0.
fn sum(row: &[f64], sizes: &[f64]) -> f64 {
    let sum: f64 = row.iter().zip(sizes).map(|(a, x)| a * x.abs()).sum();
    sum * (1.0 + 2.0 * (row.len() + 2) as f64 * UNIT)
}

/// A row of a matrix.
struct Row {
    at: Vec<f64>,
    /// The most that a product with a point loses, by the sizes of its numbers, as the row is uncertain and rounded.
    lost: Vec<f64>,
    /// Size in the coordinates in which the loop shrinks.
    size: f64,
}

impl Row {
    fn times(&self, point: &[f64]) -> f64 {
        self.at.iter().zip(point).map(|(a, x)| a * x).sum()
    }
}

/// The loop, with coordinates in which it shrinks.
struct Turned {
    map: Vec<Row>,
    rows: Vec<Row>,
    /// The most that a step loses, in these coordinates, by the sizes of a point's numbers.
    lost: Vec<Vec<f64>>,
    /// The proved shrinking, and the turn into these coordinates.
    shrinks: f64,
    turn: Vec<Row>,
}

/// Returns how far an interval reaches from its middle.
fn radius(x: &Interval) -> f64 {
    (x.hi - x.middle()).max(x.middle() - x.lo).next_up()
}

impl Turned {
    /// Turns a loop of these matrix and rows; `inputs` are what enters by rounding.
    fn new(map: &Matrix, rows: &Matrix, inputs: &[Vec<Interval>]) -> Result<Self, String> {
        let middle: sampled::Matrix = map.0.iter().map(|row| row.iter().map(|cell| cell.middle()).collect()).collect();
        let growth = SampledLoop::of(middle.clone()).spectral_radius();
        let decays = growth <= MOST_GROWTH;
        if !decays {
            let said = if growth < 1.0 + 1e-7 { "hardly decays".into() } else { format!("grows by {growth:.4}") };
            return Err(format!("the loop without rounding {said} from sample to sample"));
        }
        let none = || "no coordinates were found in which the loop shrinks".to_string();
        let shrinking = |share: &f64| {
            let shrinks = growth + share * (1.0 - growth);
            let root = root(&middle, shrinks, inputs)?;
            let turn = Matrix(root.iter().map(|row| row.iter().map(|&cell| Interval::exact(cell)).collect()).collect());
            let back = inverse(&turn);
            is_below(&turn.times(map).times(&back), shrinks).then_some((shrinks, turn, back))
        };
        let (shrinks, turn, back) = SHARES.iter().find_map(shrinking).ok_or_else(none)?;
        // Products and sums of a row, and one sum more.
        let unit = (map.0.len() + 4) as f64 * UNIT;
        let as_rows = |of: &Matrix| -> Vec<Row> {
            let sizes = of.times(&back);
            let sizes = sizes.0.iter().map(|row| size(row.iter().map(|cell| cell.size())));
            let row = |(row, size): (&Vec<Interval>, f64)| Row {
                at: row.iter().map(|cell| cell.middle()).collect(),
                lost: row.iter().map(|cell| (radius(cell) + unit * cell.size()).next_up()).collect(),
                size,
            };
            of.0.iter().zip(sizes).map(row).collect()
        };
        let (map, rows, turn) = (as_rows(map), as_rows(rows), as_rows(&turn));
        let lost = |row: &Row| -> Vec<f64> {
            let of = |at: usize| {
                let parts = row.at.iter().zip(&map).map(|(cell, map)| (cell.abs() * map.lost[at]).next_up());
                parts.fold(0.0, |sum: f64, part| (sum + part).next_up())
            };
            (0..map.len()).map(of).collect()
        };
        Ok(Self { lost: turn.iter().map(lost).collect(), map, rows, shrinks, turn })
    }

    /// Returns a bound of a point's size in the coordinates in which the loop shrinks.
    fn size(&self, point: &[f64]) -> f64 {
        size(self.turn.iter().map(|row| (row.times(point).abs() + sum(&row.lost, point)).next_up()))
    }

    /// Returns the ball around all these points.
    fn ball(&self, z: &[Interval]) -> Ball {
        let radii: Vec<f64> = z.iter().map(radius).collect();
        let across = |row: &Row| {
            let parts = row.at.iter().zip(&radii).map(|(cell, radius)| (cell.abs() * radius).next_up());
            parts.fold(0.0, |sum: f64, part| (sum + part).next_up())
        };
        Ball { at: z.iter().map(|x| x.middle()).collect(), off: size(self.turn.iter().map(across)) + LEAST }
    }

    /// Returns the same as what moves a ball: the rounding of its sum is in its distance.
    fn moves(&self, z: &[Interval]) -> Ball {
        let spare = |x: &Interval| 8.0 * UNIT * x.size();
        let wide: Vec<_> = z.iter().map(|x| x.plus(Interval { lo: -spare(x), hi: spare(x) })).collect();
        self.ball(&wide)
    }

    /// Returns the ball that follows, with what moves it.
    fn next(&self, ball: &Ball, moved: &Ball) -> Ball {
        let lost = size(self.lost.iter().map(|row| sum(row, &ball.at)));
        let off = ((self.shrinks * ball.off).next_up() + lost).next_up();
        Ball {
            at: self.map.iter().zip(&moved.at).map(|(row, moved)| row.times(&ball.at) + moved).collect(),
            off: (off + moved.off).next_up() + LEAST,
        }
    }

    /// Returns the value of a row.
    fn read(&self, row: &Row, ball: &Ball) -> Interval {
        let (at, off) = (row.times(&ball.at), (row.size * ball.off).next_up() + sum(&row.lost, &ball.at));
        let off = off.next_up();
        Interval { lo: (at - off).next_down(), hi: (at + off).next_up() }
    }

    /// Returns the products that a step and its rows take.
    fn products(&self) -> usize {
        self.map.len() * 2 * (self.map.len() + self.rows.len())
    }

    /// Returns bounds of the sums of the sizes of all rows, over all samples from a ball on.
    fn sums(&self, mut ball: Ball) -> Vec<f64> {
        let mut sums = vec![0.0f64; self.rows.len()];
        let still = Ball { at: vec![0.0; self.map.len()], off: 0.0 };
        let rests = |ball: &Ball| -> Vec<f64> {
            let (size, spare) = ((self.size(&ball.at) + ball.off).next_up(), (1.0 - self.shrinks).next_down());
            self.rows.iter().map(|row| ((row.size * size).next_up() / spare).next_up()).collect()
        };
        for sample in 0.. {
            // Written so that a number that is none bounds nothing.
            let is_small = || rests(&ball).iter().zip(&sums).all(|(rest, sum)| *rest <= REST * sum);
            if sample == MOST_PRODUCTS / self.products() || sample % 64 == 0 && is_small() {
                break;
            }
            for (sum, row) in sums.iter_mut().zip(&self.rows) {
                *sum = (*sum + self.read(row, &ball).size()).next_up();
            }
            ball = self.next(&ball, &still);
        }
        sums.iter_mut().zip(rests(&ball)).for_each(|(sum, rest)| *sum = (*sum + rest).next_up());
        sums
    }
}

/// Returns an upper triangular `R` for which `R z` shrinks, if it is found: `R'R` sums what all samples have of `z`.
fn root(map: &sampled::Matrix, shrinks: f64, inputs: &[Vec<Interval>]) -> Option<sampled::Matrix> {
    let size = map.len();
    let across = |of: &sampled::Matrix, by: &sampled::Matrix| -> sampled::Matrix {
        let turned: sampled::Matrix = (0..size).map(|row| (0..size).map(|at| of[at][row]).collect()).collect();
        sampled::product(&turned, &sampled::product(by, of))
    };
    let summed = |mut all: sampled::Matrix, map: &sampled::Matrix| {
        let mut power = map.clone();
        for _ in 0..60 {
            let moved = across(&power, &all);
            all.iter_mut().flatten().zip(moved.iter().flatten()).for_each(|(sum, cell)| *sum += cell);
            power = sampled::product(&power, &power);
        }
        all
    };
    // How far rounding moves each state, as its unit.
    let turned: sampled::Matrix = (0..size).map(|row| (0..size).map(|at| map[at][row]).collect()).collect();
    let mut entering = vec![vec![0.0; size]; size];
    for input in inputs {
        for (row, cells) in entering.iter_mut().enumerate() {
            cells.iter_mut().enumerate().for_each(|(of, cell)| *cell += input[row].middle() * input[of].middle());
        }
    }
    let moved = summed(entering, &turned);
    let mut all = vec![vec![0.0; size]; size];
    for state in 0..size {
        all[state][state] = if moved[state][state] > 0.0 { 1.0 / moved[state][state] } else { 1.0 };
    }
    let mut left = summed(all, &sampled::scaled(map, 1.0 / shrinks));
    // The square root, by elimination.
    let mut root = vec![vec![0.0; size]; size];
    for at in 0..size {
        let pivot = left[at][at].sqrt();
        let is_fine = pivot > 0.0 && left[at].iter().all(|cell| cell.abs() < GREATEST);
        if !is_fine {
            return None;
        }
        for of in at..size {
            root[at][of] = left[at][of] / pivot;
        }
        for row in at + 1..size {
            for of in at + 1..size {
                left[row][of] -= root[at][row] * root[at][of];
            }
        }
    }
    Some(root)
}

/// Returns the inverse of an upper triangular matrix with a diagonal above 0.
fn inverse(root: &Matrix) -> Matrix {
    let size = root.0.len();
    // By columns: each from its diagonal up.
    let column = |of: usize| {
        let mut column = vec![Interval::ZERO; size];
        for row in (0..=of).rev() {
            let right = Interval::exact(f64::from(u8::from(row == of)));
            let sum = (row + 1..=of).fold(right, |sum, at| sum.minus(root.0[row][at].times(column[at])));
            column[row] = sum.divided(root.0[row][row]);
        }
        column
    };
    let columns: Vec<Vec<Interval>> = (0..size).map(column).collect();
    Matrix((0..size).map(|row| columns.iter().map(|column| column[row]).collect()).collect())
}

/// Whether no point's size grows by this factor or more: `q² - M'M` is proved to be positive definite, by elimination.
fn is_below(map: &Matrix, factor: f64) -> bool {
    let size = map.0.len();
    let square = Interval::exact(factor).times(Interval::exact(factor));
    let mut left = vec![vec![Interval::ZERO; size]; size];
    for (row, cells) in left.iter_mut().enumerate() {
        for (of, cell) in cells.iter_mut().enumerate() {
            let product = map.0.iter().fold(Interval::ZERO, |sum, all| sum.plus(all[row].times(all[of])));
            *cell = if row == of { square.minus(product) } else { Interval::ZERO.minus(product) };
        }
    }
    for at in 0..size {
        let own = left[at].clone();
        // Written so that a number that is none proves nothing.
        let is_above = own[at].lo > 0.0 && own.iter().all(|cell| cell.lo.is_finite() && cell.hi.is_finite());
        if !is_above {
            return false;
        }
        for row in at + 1..size {
            let share = own[row].divided(own[at]);
            for of in row..size {
                left[row][of] = left[row][of].minus(share.times(own[of]));
            }
        }
    }
    true
}

/// Returns the reference with the ADC's offset, and the disturbance.
fn given(scene: &TransferScene, wanted: i64) -> [Interval; 2] {
    let wanted = Interval::exact(wanted as f64).times(Interval::exact(scene.adc.range.lsb()));
    [wanted.plus(Interval::exact(scene.adc.offset)), Interval::exact(scene.disturbance)]
}

/// Proves bounds of a scene's output for ever, from its first sample on, or from a later one up to an edge.
///
/// # Errors
///
/// Returns why none are proved.
pub fn stays_within(scene: &TransferScene, last_edge: u64) -> Result<Confined, String> {
    let simulation = TransferSimulation::new(scene).map_err(|error| error.to_string())?;
    let of = Loop::new(&simulation);
    let (count, zero) = (of.states(), [Interval::ZERO; 3]);
    let unit =
        |at: usize| (0..count).map(|state| Interval::exact(f64::from(u8::from(state == at)))).collect::<Vec<_>>();
    let columns: Vec<_> = (0..count).map(|at| of.step(&unit(at), [Interval::ZERO; 2], zero)).collect();
    let rows = columns[0].1.len();
    let map = Matrix((0..count).map(|row| columns.iter().map(|(next, _)| next[row]).collect()).collect());
    let seen = Matrix((0..rows).map(|row| columns.iter().map(|(_, rows)| rows[row]).collect()).collect());
    let still = vec![Interval::ZERO; count];
    let inputs: Vec<_> = (0..3)
        .map(|at| {
            let mut lost = zero;
            lost[at] = Interval::exact(of.lost[at][1]);
            of.step(&still, [Interval::ZERO; 2], lost)
        })
        .collect();
    let entering: Vec<_> = inputs.iter().map(|(next, _)| next.clone()).collect();
    let turned = Turned::new(&map, &seen, &entering)?;
    // How far rounding moves each row, at most.
    let mut off = vec![0.0f64; rows];
    for (next, direct) in &inputs {
        for ((off, sum), direct) in off.iter_mut().zip(turned.sums(turned.ball(next))).zip(direct) {
            *off = ((*off + sum).next_up() + direct.size()).next_up();
        }
    }
    let centres = of.lost.map(|[centre, _]| Interval::exact(centre));
    let step = |z: &[Interval], wanted: i64| of.step(z, given(scene, wanted), centres);
    let wanted = simulation.words().reference;
    let rest = rest(&turned, |z| step(z, wanted).0).ok_or("the loop has no rest")?;
    let moved = [0, wanted].map(|wanted| {
        let (next, rows) = step(&rest, wanted);
        (turned.moves(&minus(&next, &rest)), rows)
    });
    let follow = Follow { of: &of, turned: &turned, off: &off, rest, moved };
    let mut now = simulation.samples();
    let (mut sample, mut why) = (0u64, String::new());
    for start in 0..MOST_STARTS {
        let next = if start == 0 { 0 } else { 1 << (start - 1) };
        while sample <= next {
            if !now.go_on() {
                return Err("a state of the plant, or its output, grew beyond 1e100".into());
            }
            sample += 1;
        }
        if now.edge() > last_edge {
            break;
        }
        match follow.from(&now, start == 0) {
            Ok(found) => return Ok(found),
            Err(said) => why = said,
        }
    }
    Err(why)
}

/// Returns about the state that stays where it is.
fn rest(turned: &Turned, step: impl Fn(&[Interval]) -> Vec<Interval>) -> Option<Vec<Interval>> {
    let mut rest = vec![Interval::ZERO; turned.map.len()];
    // Twice, for the digits that the first one loses.
    for _ in 0..2 {
        let steps = minus(&step(&rest), &rest);
        let row = |(at, (row, step)): (usize, (&Row, &Interval))| {
            let cells = row.at.iter().enumerate().map(|(of, cell)| f64::from(u8::from(of == at)) - cell);
            cells.chain([step.middle()]).collect::<Vec<_>>()
        };
        let by = sampled::solution(turned.map.iter().zip(&steps).enumerate().map(row).collect())?;
        rest.iter_mut().zip(by).for_each(|(at, by)| *at = Interval::exact(at.middle() + by));
    }
    Some(rest)
}

fn minus(all: &[Interval], other: &[Interval]) -> Vec<Interval> {
    all.iter().zip(other).map(|(one, other)| one.minus(*other)).collect()
}

/// The motion without rounding, followed from sample to sample.
struct Follow<'f, 's> {
    of: &'f Loop<'s>,
    turned: &'f Turned,
    off: &'f [f64],
    /// About the state that stays where it is. All balls are off it.
    rest: Vec<Interval>,
    /// Inputs that move the loop from there, and the rows there, before the reference has its last word and after.
    moved: [(Ball, Vec<Interval>); 2],
}

impl Follow<'_, '_> {
    /// Returns the state at the first sample, or that after a sample.
    fn start(&self, now: &Samples, is_first: bool) -> Vec<Interval> {
        let (of, scene) = (self.of, self.of.map.scene);
        let states: Vec<Interval> = now.states().into_iter().map(enclosed).collect();
        let mut all: Vec<Interval> = states.clone();
        if is_first {
            all.resize(of.states(), Interval::ZERO);
            return all;
        }
        let (errors, outputs) = now.memory();
        let [_, command, driving] = now.words();
        let times = |word: i64, lsb: f64| Interval::exact(word as f64).times(Interval::exact(lsb));
        let input = times(driving, scene.dac.lsb()).plus(Interval::exact(scene.disturbance));
        let row =
            |row: &Vec<Interval>| row.iter().zip(&states).fold(Interval::ZERO, |sum, (a, x)| sum.plus(a.times(*x)));
        let next = of.map.from_x.0.iter().zip(&of.map.from_u).map(|(cells, u)| row(cells).plus(u.times(input)));
        all = next.collect();
        all.extend(errors[..of.numerator.len() - 1].iter().map(|&word| times(word, scene.adc.range.lsb())));
        all.extend(outputs[..of.denominator.len()].iter().map(|&word| times(word, scene.output_lsb())));
        all.push(times(command, scene.dac.lsb()));
        all
    }

    /// Returns the rows with all that rounding adds.
    fn rows(&self, ball: &Ball, of: usize, spare: impl Fn(&Row) -> f64) -> Vec<Interval> {
        let all = self.turned.rows.iter().zip(&self.moved[of].1).zip(self.off);
        let row = |((row, moved), off): ((&Row, &Interval), &f64)| {
            let off = (off + spare(row)).next_up();
            self.turned.read(row, ball).plus(*moved).plus(Interval { lo: -off, hi: off })
        };
        all.map(row).collect()
    }

    fn from(&self, now: &Samples, is_first: bool) -> Result<Confined, String> {
        let (of, turned, scene) = (self.of, self.turned, self.of.map.scene);
        let (period, lsb) = (scene.adc.period, scene.adc.range.lsb());
        let from_edge = if is_first { now.edge() } else { now.edge() + period };
        let wanted_from = scene.clock.edges(scene.reference[1]);
        let saturates = |edge: u64| {
            let time_s = edge as f64 / scene.clock.frequency_hz() as f64;
            Err(format!("words may saturate at {} s", number(time_s)))
        };
        // A sample may move away from what is taken for the rest.
        let (moved, _) = &self.moved[1];
        let drift = (turned.size(&moved.at) + moved.off).next_up();
        let drifts = (drift / (1.0 - turned.shrinks).next_down()).next_up();
        let still = Ball { at: vec![0.0; moved.at.len()], off: 0.0 };
        let in_end = self.rows(&still, 1, |row| (row.size * drifts).next_up());
        if !of.fits(&in_end) {
            return Err("words may saturate at the loop's rest".into());
        }

        let start = self.start(now, is_first);
        let mut ball = turned.ball(&minus(&start, &self.rest));
        let most = MOST_PRODUCTS / turned.products();
        let end = scene.edges();
        let (mut edge, mut all, mut in_run) = (from_edge, None::<Interval>, None);
        let mut reached = [f64::INFINITY, f64::NEG_INFINITY];
        let joined = |one: Option<Interval>, other: Interval| {
            one.map_or(other, |one| Interval { lo: one.lo.min(other.lo), hi: one.hi.max(other.hi) })
        };
        for sample in 0..=most {
            let wanted = usize::from(edge >= wanted_from);
            if edge > end && in_run.is_none() {
                in_run = Some(all.unwrap_or(Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY }));
            }
            if in_run.is_some() && wanted == 1 && (sample % 64 == 0 || sample == most) {
                let from_rest = ((turned.size(&ball.at) + ball.off).next_up() + drifts).next_up();
                let to_come = self.rows(&still, 1, |row| (row.size * from_rest).next_up());
                let with = joined(all, of.passed(&to_come));
                let so_far = all.unwrap_or(with);
                let adds = (with.hi - so_far.hi).max(so_far.lo - with.lo);
                if of.fits(&to_come) && (adds <= 0.01 * self.off[READ] || sample == most) {
                    let at = in_end[READ];
                    let (middle, run) = (at.middle(), in_run.unwrap_or(with));
                    let off = (at.hi - middle).max(middle - at.lo).next_up();
                    return Ok(Confined {
                        from_edge,
                        ends: [with.lo, with.hi],
                        in_run: [run.lo, run.hi],
                        reached,
                        rest: middle,
                        off,
                        off_counts: (off / lsb).next_up(),
                    });
                }
            }
            let rows = self.rows(&ball, wanted, |_| 0.0);
            if !of.fits(&rows) {
                return saturates(edge);
            }
            all = Some(joined(all, of.passed(&rows)));
            if edge <= end {
                reached = [reached[0].min(rows[READ].hi), reached[1].max(rows[READ].lo)];
            }
            ball = turned.next(&ball, &self.moved[wanted].0);
            edge += period;
        }
        Err("the motion takes too long to come near its rest".into())
    }
}
