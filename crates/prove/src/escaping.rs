//! A proof that a plant as a transfer function leaves for ever, whatever words drive it.
//!
//! From sample to sample the plant moves by `x+ = F x + G u`. Its input is between the ends of the DAC's words, with
//! the disturbance. Let `l F = λ l` with `|λ| > 1`: a mode that grows by itself. Then `s = l x` moves by
//! `s+ = λ s + l G u`, so `|s+| >= |λ| |s| - |l G| max|u|`. Once `|s| (|λ| - 1) > |l G| max|u|`, it grows for ever, and
//! by a greater factor at each sample: no controller behind this DAC brings the plant back. A mode that all inputs can
//! hold, or that only just stays, as that of an integrator, is not told of.
//!
//! `l` and `λ`, which are complex, are sought in floats and enclosed by Krawczyk's method. The state is the emulator's.

use hpu_cosim::scene::TransferScene;
use hpu_cosim::{Samples, TransferSimulation};

use crate::interval::{Complex, Interval};
use crate::recurring::{Map, enclosed};
use crate::sampled::{self, solution};

/// Steps of Newton's method.
const STEPS: usize = 60;
/// By how many times its first step an enclosure is wide.
const WIDE: f64 = 3.0;

/// A mode of a plant that grows by itself.
struct Escape {
    /// The row `l`, and a bound of `|l G| max|u|`.
    row: Vec<Complex>,
    pushed: f64,
    /// The growth from sample to sample, at least.
    growth: f64,
}

/// Returns an approximate row and its growth: that of the mode that grows most.
fn dominant(map: &sampled::Matrix) -> Option<(Vec<[f64; 2]>, [f64; 2])> {
    let size = map.len();
    let normed = |row: Vec<f64>| {
        let norm = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        (row.iter().map(|x| x / norm).collect::<Vec<_>>(), norm)
    };
    let moved = |row: &[f64]| -> Vec<f64> {
        (0..size).map(|of| row.iter().zip(map).map(|(x, cells)| x * cells[of]).sum()).collect()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // The rows of a great power are in the space of that mode.
    let mut power = map.clone();
    for _ in 0..STEPS {
        let most = power.iter().flatten().fold(0.0, |most: f64, cell| most.max(cell.abs()));
        let scaled = sampled::scaled(&power, 1.0 / most);
        power = sampled::product(&scaled, &scaled);
    }
    let (first, _) = normed(power.into_iter().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))?);
    let after = moved(&first);
    let along = dot(&first, &after);
    let (second, across) = normed(after.iter().zip(&first).map(|(a, f)| a - along * f).collect());
    if across < 1e-6 * along.abs() {
        return Some((first.iter().map(|x| [*x, 0.0]).collect(), [along, 0.0]));
    }
    // The map within a plane: its two growths are a pair.
    let turned = moved(&second);
    let [a, b, c, d] = [along, across, dot(&turned, &first), dot(&turned, &second)];
    let (mean, square) = (0.5 * (a + d), 0.25 * (a - d) * (a - d) + b * c);
    let growth = if square < 0.0 { [mean, (-square).sqrt()] } else { [mean + square.sqrt().copysign(mean), 0.0] };
    // (y, 1) [[a, b], [c, d]] = λ (y, 1), so y b + d = λ.
    let of_first = [(growth[0] - d) / b, growth[1] / b];
    let row = first.iter().zip(&second).map(|(f, s)| [of_first[0] * f + s, of_first[1] * f]);
    Some((row.collect(), growth))
}

impl Escape {
    /// Returns the mode of a plant that grows most by itself, if one is proved to.
    fn new(map: &Map) -> Option<Self> {
        let size = map.from_u.len();
        let (row, growth) = dominant(&middles(&map.from_x.0))?;
        // The largest number of the row is 1.
        let size_of = |x: &[f64; 2]| x[0] * x[0] + x[1] * x[1];
        let at = (0..size).max_by(|a, b| size_of(&row[*a]).total_cmp(&size_of(&row[*b])))?;
        let by = size_of(&row[at]);
        let over =
            |x: &[f64; 2]| [(x[0] * row[at][0] + x[1] * row[at][1]) / by, (x[1] * row[at][0] - x[0] * row[at][1]) / by];
        // All real parts, those of the growth last, then all imaginary parts.
        let scaled: Vec<[f64; 2]> = row.iter().map(over).chain([growth]).collect();
        let found: Vec<f64> = (0..2).flat_map(|part| scaled.iter().map(move |x| x[part])).collect();
        let wide = Equations { map, at }.enclosed(found)?;
        let complex = |at: usize| Complex { re: wide[at], im: wide[size + 1 + at] };
        let row: Vec<Complex> = (0..size).map(complex).collect();
        let growth = modulus(complex(size)).lo;
        let scene = map.scene;
        let end = |word: i64| {
            let input = Interval::exact(word as f64).times(Interval::exact(scene.dac.lsb()));
            input.plus(Interval::exact(scene.disturbance)).size()
        };
        let [least, most] = scene.dac.ends();
        let of_input = row.iter().zip(&map.from_u).fold(Complex::ZERO, |sum, (l, &g)| sum.plus(l.scaled(g)));
        let pushed = Interval::exact(modulus(of_input).hi).times(Interval::exact(end(least).max(end(most)))).hi;
        (growth > 1.0).then_some(Self { row, pushed, growth })
    }

    /// Whether a plant that is driven by words from a sample on is proved to leave.
    fn is_beyond(&self, now: &Samples) -> bool {
        let states = now.states().into_iter().map(enclosed);
        let mode = self.row.iter().zip(states).fold(Complex::ZERO, |sum, (l, x)| sum.plus(l.scaled(x)));
        let more = Interval::exact(self.growth).minus(Interval::exact(1.0));
        Interval::exact(modulus(mode).lo).times(more).lo > self.pushed
    }
}

/// The equations of a left eigenvector and its eigenvalue, l F = λ l, and that the number at a place is 1. Of both, all
/// real parts come first, then all imaginary parts.
struct Equations<'m> {
    map: &'m Map<'m>,
    at: usize,
}

impl Equations<'_> {
    /// Returns what is not fulfilled.
    fn left(&self, x: &[Interval]) -> Vec<Interval> {
        let (size, half) = (x.len() / 2 - 1, x.len() / 2);
        let (re, im) = x.split_at(half);
        let products = |all: &[Interval], of: usize| {
            all.iter().zip(&self.map.from_x.0).fold(Interval::ZERO, |sum, (x, row)| sum.plus(x.times(row[of])))
        };
        let real = |of: usize| products(re, of).minus(re[size].times(re[of]).minus(im[size].times(im[of])));
        let imaginary = |of: usize| products(im, of).minus(re[size].times(im[of]).plus(im[size].times(re[of])));
        let mut all: Vec<_> = (0..size).map(real).collect();
        all.push(re[self.at].minus(Interval::exact(1.0)));
        all.extend((0..size).map(imaginary));
        all.push(im[self.at]);
        all
    }

    /// Returns how that changes with each number.
    fn slopes(&self, x: &[Interval]) -> Vec<Vec<Interval>> {
        let (size, half) = (x.len() / 2 - 1, x.len() / 2);
        let mut all = vec![vec![Interval::ZERO; 2 * half]; 2 * half];
        let negative = |x: Interval| Interval::ZERO.minus(x);
        let (re, im) = x.split_at(half);
        for of in 0..size {
            for (by, row) in self.map.from_x.0.iter().enumerate() {
                all[of][by] = all[of][by].plus(row[of]);
                all[half + of][half + by] = all[half + of][half + by].plus(row[of]);
            }
            all[of][of] = all[of][of].minus(re[size]);
            all[half + of][half + of] = all[half + of][half + of].minus(re[size]);
            all[of][half + of] = all[of][half + of].plus(im[size]);
            all[half + of][of] = all[half + of][of].minus(im[size]);
            (all[of][size], all[of][half + size]) = (negative(re[of]), im[of]);
            (all[half + of][size], all[half + of][half + size]) = (negative(im[of]), negative(re[of]));
        }
        (all[size][self.at], all[half + size][half + self.at]) = (Interval::exact(1.0), Interval::exact(1.0));
        all
    }

    /// Returns intervals around approximate numbers in which a solution certainly lies.
    fn enclosed(&self, mut found: Vec<f64>) -> Option<Vec<Interval>> {
        let point = |x: &[f64]| x.iter().map(|&x| Interval::exact(x)).collect::<Vec<_>>();
        for _ in 0..4 {
            let (slopes, left) = (middles(&self.slopes(&point(&found))), self.left(&point(&found)));
            let rows = slopes.into_iter().zip(left).map(|(row, left)| [row, vec![left.middle()]].concat());
            let by = solution(rows.collect())?;
            found.iter_mut().zip(by).for_each(|(x, by)| *x -= by);
        }
        // Krawczyk: x - Y f(x) + (1 - Y f'(X)) (X - x) lies within X, so a solution does.
        let near = middles(&self.slopes(&point(&found)));
        let column = |of: usize| {
            let rows = near.iter().enumerate();
            solution(rows.map(|(row, cells)| [cells.as_slice(), &[f64::from(u8::from(row == of))]].concat()).collect())
        };
        let columns = (0..found.len()).map(column).collect::<Option<Vec<_>>>()?;
        let inverse = |row: usize, of: usize| Interval::exact(columns[of][row]);
        let dot = |row: usize, all: &[Interval]| {
            all.iter().enumerate().fold(Interval::ZERO, |sum, (of, x)| sum.plus(inverse(row, of).times(*x)))
        };
        let left = self.left(&point(&found));
        let steps: Vec<Interval> = (0..found.len()).map(|row| dot(row, &left)).collect();
        let width = WIDE * steps.iter().fold(0.0, |most: f64, step| most.max(step.size())) + f64::EPSILON;
        let wide: Vec<Interval> =
            found.iter().map(|&x| Interval::exact(x).plus(Interval { lo: -width, hi: width })).collect();
        let slopes = self.slopes(&wide);
        let is_within = (0..found.len()).all(|row| {
            let own = (0..found.len()).fold(Interval::ZERO, |sum, of| {
                let column: Vec<Interval> = slopes.iter().map(|cells| cells[of]).collect();
                let own = Interval::exact(f64::from(u8::from(row == of))).minus(dot(row, &column));
                sum.plus(own.times(wide[of].minus(Interval::exact(found[of]))))
            });
            let after = Interval::exact(found[row]).minus(steps[row]).plus(own);
            after.is_inside(wide[row])
        });
        is_within.then_some(wide)
    }
}

/// Returns the middles of intervals.
fn middles(all: &[Vec<Interval>]) -> sampled::Matrix {
    all.iter().map(|row| row.iter().map(|cell| cell.middle()).collect()).collect()
}

/// Returns the size of a complex number.
fn modulus(of: Complex) -> Interval {
    let square = |part: Interval| {
        let least = if part.has_zero() { 0.0 } else { part.lo.abs().min(part.hi.abs()) };
        Interval { lo: (least * least).next_down().max(0.0), hi: (part.size() * part.size()).next_up() }
    };
    let sum = square(of.re).plus(square(of.im));
    Interval { lo: sum.lo.max(0.0).sqrt().next_down().max(0.0), hi: sum.hi.sqrt().next_up() }
}

/// Returns the edge of the first sample of a scene, up to an edge, from which on its plant is proved to leave for ever,
/// and by which factor it grows by itself, at least; `None` if none is found.
///
/// # Errors
///
/// Returns why the scene cannot be run.
pub fn leaves(scene: &TransferScene, last_edge: u64) -> Result<Option<(u64, f64)>, String> {
    let simulation = TransferSimulation::new(scene).map_err(|error| error.to_string())?;
    let Some(escape) = Escape::new(&Map::new(&simulation)) else { return Ok(None) };
    let mut now = simulation.samples();
    while now.go_on() && now.edge() <= last_edge {
        if escape.is_beyond(&now) {
            return Ok(Some((now.edge(), escape.growth)));
        }
    }
    Ok(None)
}
