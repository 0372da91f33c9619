//! A linear plant with one input and one output, as data: coefficients, roots or matrices.
//!
//! It is a system without mechanics: `x' = A x + B u`, `y = C x + D u`, or `x(k+1) = A x(k) + B u(k)` of a discrete
//! plant. A network has bodies, an encoder and energies, which such a plant has not, so it is no network. It flows by
//! the same engine: [`Linear`] in double-double, from each instant at which the input changes or the output is sampled.
//!
//! Coefficients of polynomials become a companion form: `x1' = x2`, .., `xn' = -an x1 - .. - a1 xn + u`, where the
//! highest coefficient of the denominator is 1. Its numbers are computed in double-double. Before leaps are tabulated,
//! states are scaled by powers of two, which is exact, so that rows and columns are of like size.

use std::fmt;

use crate::flow::double::{Double, Doubles, Native};
use crate::flow::linear::{Linear, Trajectory};

/// The greatest number of states.
pub const MOST_STATES: usize = 12;

/// The greatest size of a state or an output; a run ends when one is greater.
pub const MOST_SIZE: f64 = 1e100;

/// The greatest exponent of growth, or of decay, in one leap: the norm of `A` times the leap's length.
const MOST_EXPONENT: f64 = 1e4;

/// The description of a plant.
#[derive(Clone, PartialEq, Debug)]
pub enum Form {
    /// Numerator over denominator: coefficients in descending powers of s, or of z of a discrete plant.
    Ratio {
        /// Those of the numerator.
        numerator: Vec<f64>,
        /// Those of the denominator.
        denominator: Vec<f64>,
    },
    /// Roots as real and imaginary part, and the factor before their products. A root with an imaginary part above 0
    /// stands for itself and its conjugate.
    Roots {
        /// Roots of the numerator.
        zeros: Vec<[f64; 2]>,
        /// Roots of the denominator.
        poles: Vec<[f64; 2]>,
        /// Factor before both.
        gain: f64,
    },
    /// The matrices themselves.
    Matrices {
        /// `A`, by rows.
        a: Vec<Vec<f64>>,
        /// `B`.
        b: Vec<f64>,
        /// `C`.
        c: Vec<f64>,
        /// `D`.
        d: f64,
    },
}

/// A reason why a form is no plant, with the part of the form that it is about.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TransferError {
    /// The part: `numerator`, `denominator`, `zeros`, `poles`, `a`, `b` or `c`.
    pub part: &'static str,
    /// The reason, with what is accepted instead.
    pub reason: String,
}

impl fmt::Display for TransferError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.part, self.reason)
    }
}

impl std::error::Error for TransferError {}

fn refused<T>(part: &'static str, reason: impl Into<String>) -> Result<T, TransferError> {
    Err(TransferError { part, reason: reason.into() })
}

/// Returns the coefficients of the polynomial with these roots, the highest first.
fn expanded(roots: &[[f64; 2]]) -> Vec<Double> {
    let mut all = vec![Double::from(1.0)];
    for &[re, im] in roots {
        let square = Double::product(re, re) + Double::product(im, im);
        let factor: &[Double] =
            if im > 0.0 { &[1.0.into(), (-2.0 * re).into(), square] } else { &[1.0.into(), (-re).into()] };
        let mut product = vec![Double::ZERO; all.len() + factor.len() - 1];
        for (i, x) in all.iter().enumerate() {
            for (j, y) in factor.iter().enumerate() {
                product[i + j] = product[i + j] + *x * *y;
            }
        }
        all = product;
    }
    all
}

/// The matrices of a plant in double-double, as its form gives them.
#[derive(Clone, PartialEq, Debug)]
struct Matrices {
    a: Vec<Vec<Double>>,
    b: Vec<Double>,
    c: Vec<Double>,
    d: Double,
}

impl Matrices {
    /// Returns the companion form of a proper function. The numerator has no zeros in front.
    fn companion(numerator: &[Double], denominator: &[Double]) -> Self {
        let order = denominator.len() - 1;
        let over = |x: &Double| x.over(denominator[0]);
        // From the lowest power on.
        let lower: Vec<Double> = denominator.iter().rev().take(order).map(over).collect();
        let mut upper: Vec<Double> = numerator.iter().rev().map(over).collect();
        upper.resize(order + 1, Double::ZERO);
        let d = upper[order];
        let mut a = vec![vec![Double::ZERO; order]; order];
        for row in 1..order {
            a[row - 1][row] = 1.0.into();
        }
        a[order - 1] = lower.iter().map(|x| -*x).collect();
        let mut b = vec![Double::ZERO; order];
        b[order - 1] = 1.0.into();
        let c = upper.iter().zip(&lower).map(|(n, l)| *n - d * *l).collect();
        Self { a, b, c, d }
    }

    /// Reads a form.
    fn of(form: &Form) -> Result<Self, TransferError> {
        let too_many = |states: usize| format!("{states} states; write at most {MOST_STATES}");
        let improper = |above: usize, below: usize| {
            format!(
                "degree {above} over degree {below} is improper: its output would be a derivative of its input; \
                     write a numerator of at most the denominator's degree"
            )
        };
        match form {
            Form::Ratio { numerator, denominator } => {
                let doubles = |all: &[f64]| -> Vec<Double> { all.iter().map(|&x| x.into()).collect() };
                let numerator: Vec<f64> = numerator.iter().copied().skip_while(|&x| x == 0.0).collect();
                if numerator.is_empty() {
                    return refused("numerator", "all 0, so that the input reaches nothing; write another number");
                }
                if denominator.first().is_none_or(|&first| first == 0.0) {
                    return refused("denominator", "its first coefficient is 0; leave zeros in front out");
                }
                let (above, below) = (numerator.len() - 1, denominator.len() - 1);
                if below == 0 {
                    return refused("denominator", "a constant has no states; write a gain into the controller");
                }
                if above > below {
                    return refused("numerator", improper(above, below));
                }
                if below > MOST_STATES {
                    return refused("denominator", too_many(below));
                }
                Ok(Self::companion(&doubles(&numerator), &doubles(denominator)))
            }
            Form::Roots { zeros, poles, gain } => {
                let degree = |roots: &[[f64; 2]]| roots.iter().map(|root| if root[1] > 0.0 { 2 } else { 1 }).sum();
                let (above, below): (usize, usize) = (degree(zeros), degree(poles));
                for (part, roots) in [("zeros", zeros), ("poles", poles)] {
                    if roots.iter().any(|root| root[1] < 0.0) {
                        let reason = "an imaginary part below 0; a pair is written once, with the one above 0";
                        return refused(part, reason);
                    }
                }
                if below == 0 {
                    return refused("poles", "none, so that the plant has no states; write at least one");
                }
                if above > below {
                    return refused("zeros", improper(above, below));
                }
                if below > MOST_STATES {
                    return refused("poles", too_many(below));
                }
                if *gain == 0.0 {
                    return refused("gain", "0, so that the input reaches nothing; write another number");
                }
                let numerator: Vec<Double> = expanded(zeros).into_iter().map(|x| x * Double::from(*gain)).collect();
                Ok(Self::companion(&numerator, &expanded(poles)))
            }
            Form::Matrices { a, b, c, d } => {
                let order = a.len();
                if order == 0 || order > MOST_STATES {
                    return refused("a", format!("{order} rows; write 1 to {MOST_STATES}"));
                }
                if let Some(row) = a.iter().find(|row| row.len() != order) {
                    let reason = format!("a row of {} numbers in a matrix of {order} rows; write {order}", row.len());
                    return refused("a", reason);
                }
                for (part, vector) in [("b", b), ("c", c)] {
                    if vector.len() != order {
                        let reason = format!("{} numbers beside {order} states; write {order}", vector.len());
                        return refused(part, reason);
                    }
                    if vector.iter().all(|&x| x == 0.0) && (part == "c" || *d == 0.0) {
                        return refused(part, "all 0, so that the input does not reach the output");
                    }
                }
                let doubles = |all: &Vec<f64>| -> Vec<Double> { all.iter().map(|&x| x.into()).collect() };
                Ok(Self { a: a.iter().map(doubles).collect(), b: doubles(b), c: doubles(c), d: (*d).into() })
            }
        }
    }

    /// Returns powers of two, one a state, in whose units rows and columns of `A` are of like size, and the matrices
    /// in these units.
    fn balanced(mut self) -> (Vec<f64>, Self) {
        let order = self.a.len();
        let mut units = vec![1.0; order];
        for _ in 0..64 {
            let mut is_done = true;
            for (state, own) in units.iter_mut().enumerate() {
                let others = || (0..order).filter(|&other| other != state);
                let row: f64 = others().map(|other| self.a[state][other].hi.abs()).sum();
                let column: f64 = others().map(|other| self.a[other][state].hi.abs()).sum();
                if row == 0.0 || column == 0.0 {
                    continue;
                }
                // The row shrinks and the column grows by the unit.
                let power = (0.5 * libm::log2(row / column)).round().clamp(-100.0, 100.0) as i32;
                if power == 0 {
                    continue;
                }
                is_done = false;
                let unit = 2f64.powi(power);
                *own *= unit;
                for other in others() {
                    self.a[state][other] = scaled(self.a[state][other], 1.0 / unit);
                    self.a[other][state] = scaled(self.a[other][state], unit);
                }
                self.b[state] = scaled(self.b[state], 1.0 / unit);
                self.c[state] = scaled(self.c[state], unit);
            }
            if is_done {
                break;
            }
        }
        (units, self)
    }
}

/// Returns the product with a power of two.
fn scaled(x: Double, power: f64) -> Double {
    Double { hi: x.hi * power, lo: x.lo * power }
}

fn padded(all: &[Double]) -> Doubles<MOST_STATES> {
    let mut doubles = Doubles::ZERO;
    for (state, &value) in all.iter().enumerate() {
        doubles.set(state, value);
    }
    doubles
}

/// A plant, with its leaps tabulated for one clock period.
pub struct Transfer {
    matrices: Matrices,
    units: Vec<f64>,
    /// The flow of a continuous plant; a discrete one steps.
    flow: Option<Box<Linear<MOST_STATES>>>,
    drive: Doubles<MOST_STATES>,
}

impl Transfer {
    /// Creates a continuous plant on a clock of period `edge_s`, for leaps of up to `longest` edges.
    ///
    /// # Errors
    ///
    /// [`TransferError`] if the form is no proper plant of 1 to 12 states, or moves too fast for a leap.
    pub fn continuous(form: &Form, edge_s: f64, longest: u64) -> Result<Self, TransferError> {
        let (units, matrices) = Matrices::of(form)?.balanced();
        let part = part_of(form);
        let sizes = matrices.a.iter().map(|row| row.iter().map(|x| x.hi.abs()).sum::<f64>());
        let rate = sizes.fold(0.0, f64::max);
        let exponent = rate * edge_s * longest as f64;
        if !exponent.is_finite() || exponent > MOST_EXPONENT {
            let reason = format!(
                "its fastest mode may change by e^{exponent:.1e} from one sample to the next; write modes slower than \
                 {:.1e} 1/s, or sample faster",
                MOST_EXPONENT / (edge_s * longest as f64)
            );
            return refused(part, reason);
        }
        let rows = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                matrices.a.get(row).and_then(|row| row.get(column)).copied().unwrap_or_default()
            })
        });
        let flow = Linear::exact(&rows, Vec::new(), edge_s, longest);
        let drive = padded(&matrices.b);
        Ok(Self { matrices, units, flow: Some(Box::new(flow)), drive })
    }

    /// Creates a discrete plant, which steps once a sample.
    ///
    /// # Errors
    ///
    /// [`TransferError`] if the form is no proper plant of 1 to 12 states.
    pub fn discrete(form: &Form) -> Result<Self, TransferError> {
        let matrices = Matrices::of(form)?;
        let drive = padded(&matrices.b);
        Ok(Self { units: vec![1.0; matrices.a.len()], matrices, flow: None, drive })
    }

    /// Returns the number of states.
    pub fn order(&self) -> usize {
        self.units.len()
    }

    /// Returns whether the plant steps once a sample.
    pub fn is_discrete(&self) -> bool {
        self.flow.is_none()
    }

    /// Returns whether the input reaches the output at once.
    pub fn is_immediate(&self) -> bool {
        self.matrices.d.hi != 0.0
    }
}

/// Numbers in double-double, each as the nearest `f64` and the rest.
pub type Pairs = Vec<[f64; 2]>;

/// The matrices of a plant, in the units of its own states.
#[derive(Clone, PartialEq, Debug)]
pub struct PairMatrices {
    /// `A`, by rows.
    pub a: Vec<Pairs>,
    /// `B`.
    pub b: Pairs,
    /// `C`.
    pub c: Pairs,
    /// `D`.
    pub d: [f64; 2],
}

fn pair(x: &Double) -> [f64; 2] {
    [x.hi, x.lo]
}

impl Transfer {
    /// Returns the matrices that the plant moves by.
    pub fn matrices(&self) -> PairMatrices {
        let Matrices { a, b, c, d } = &self.matrices;
        let pairs = |all: &Vec<Double>| all.iter().map(pair).collect();
        PairMatrices { a: a.iter().map(pairs).collect(), b: pairs(b), c: pairs(c), d: pair(d) }
    }
}

/// Returns the part of a form that has its modes.
fn part_of(form: &Form) -> &'static str {
    match form {
        Form::Ratio { .. } => "denominator",
        Form::Roots { .. } => "poles",
        Form::Matrices { .. } => "a",
    }
}

/// A plant in motion. Its state is exact but for double-double's rounding at the instants at which it was moved to.
#[derive(Clone, Copy)]
pub struct TransferMotion<'p> {
    plant: &'p Transfer,
    x: Doubles<MOST_STATES>,
    u: Double,
}

impl<'p> TransferMotion<'p> {
    /// Creates the motion from these states under the input 0. States that are not given are 0.
    pub fn new(plant: &'p Transfer, start: &[f64]) -> Self {
        let states = start.iter().zip(&plant.units).map(|(&x, unit)| Double::from(x / unit));
        Self { plant, x: padded(&states.collect::<Vec<_>>()), u: Double::ZERO }
    }

    /// Sets the input from here on: a word's value, `word * lsb`, and a constant beside it.
    pub fn drive(&mut self, word: i64, lsb: f64, beside: f64) {
        self.u = Double::product(word as f64, lsb) + beside.into();
    }

    fn moved(&self, edges: u64) -> Doubles<MOST_STATES> {
        let Some(flow) = self.plant.flow.as_deref().filter(|_| edges > 0) else { return self.x };
        let force = self.plant.drive.scaled::<Native>(self.u);
        Trajectory::exact(flow, self.x, force).flow::<Native>(edges)
    }

    /// Moves a continuous plant on by a number of edges; a discrete one stays where it is.
    pub fn leap(&mut self, edges: u64) {
        self.x = self.moved(edges);
    }

    /// Moves a discrete plant on by one sample; a continuous one stays where it is.
    pub fn step(&mut self) {
        if self.plant.flow.is_some() {
            return;
        }
        let Matrices { a, b, .. } = &self.plant.matrices;
        let next: Vec<Double> = a.iter().zip(b).map(|(row, b)| self.weighed(row, &self.x) + *b * self.u).collect();
        self.x = padded(&next);
    }

    fn weighed(&self, row: &[Double], x: &Doubles<MOST_STATES>) -> Double {
        row.iter().enumerate().fold(Double::ZERO, |sum, (state, factor)| sum + *factor * x.lane(state))
    }

    fn output(&self, x: &Doubles<MOST_STATES>) -> Double {
        self.weighed(&self.plant.matrices.c, x) + self.plant.matrices.d * self.u
    }

    /// Returns the output and the input a number of edges later, each rounded once.
    pub fn at(&self, edges: u64) -> [f64; 2] {
        [self.output(&self.moved(edges)).hi, self.u.hi]
    }

    /// Returns the states in the units of [`Transfer::matrices`].
    pub fn pairs(&self) -> Pairs {
        (0..self.plant.order()).map(|state| pair(&self.x.lane(state))).collect()
    }

    /// Returns whether this motion goes on as another does, if both are driven alike.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.x == other.x && self.u == other.u
    }

    /// Returns a number that is the same of motions that are [alike](Self::is_alike), and of few others.
    pub fn mark(&self) -> u64 {
        // Zeros of either sign are alike.
        let bits = self.x.hi.iter().chain(&self.x.lo).map(|x| (x + 0.0).to_bits());
        bits.fold(0, |sum, bits| (sum ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29))
    }

    /// Returns whether a state or the output has left the sizes that are modelled.
    pub fn is_beyond(&self) -> bool {
        let states = self.x.hi.iter().zip(&self.plant.units).map(|(x, unit)| x * unit);
        let is_within = |size: f64| size.abs() <= MOST_SIZE;
        !states.chain([self.output(&self.x).hi]).all(is_within)
    }

    /// Returns the word of a converter: the output less an offset, in steps of `lsb`, rounded to the nearest with ties
    /// up, or down. Which of two words it is, is decided in double-double.
    pub fn converted(&self, lsb: f64, offset: f64, floors: bool) -> i64 {
        let off = self.output(&self.x) - offset.into();
        // Twice the lower end of a word's range, in steps: an odd number of halves if words are rounded to the nearest.
        let halves = |word: i64| Double::product(2.0 * word as f64 - f64::from(u8::from(!floors)), lsb);
        let is_reached = |word: i64| (off + off - halves(word)).hi >= 0.0;
        let near = off.hi / lsb;
        let guess = if floors { near.floor() } else { (near + 0.5).floor() };
        // A greater one is beyond every converter.
        let guess = guess.clamp(-1e15, 1e15) as i64;
        let above = (guess - 1..=guess + 1).rev().find(|&word| is_reached(word));
        above.unwrap_or(guess - 1)
    }
}
