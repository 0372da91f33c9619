//! A proof that the words of a loop around a plant as a transfer function repeat for ever.
//!
//! Converters and controller act at the samples alone, so the plant is a map from sample to sample,
//! `x(k+1) = F x(k) + G u(k)`, also a continuous one, whose `F` and `G` are enclosed. Let the controller remember the
//! same words at two samples, and let `p(0)`, .., `p(P-1)` be the emulator's states between them, rounded to `f64`. The
//! motion of real numbers from the emulator's state on, under the words between both for ever, is off the repeated `p`
//! by `e`, with `e(k+1) = F e(k) + r(k)`, where `r(k) = F p(k) + G u(k) - p(k+1)` is enclosed, and the last one leads
//! back to `p(0)`.
//! So `e` never exceeds `sup|F^k| |e(0)| + sum|F^k| max|r|`. If every output has its word with that to spare, the
//! readings are the ones assumed, and so are the words, for ever.
//!
//! The sum is finite if the plant decays. An integrator does not; but where all numbers of a plant are whole multiples
//! of 2^-30, `r` is computed without rounding, and it is 0 if the states came back.
//!
//! The matrices are those of the emulator, in double-double. Left out: its rounding before the first of these samples.

use hpu_cosim::scene::{TransferScene, number};
use hpu_cosim::{Forever, NotTold, Recurrence, Samples, TransferSimulation};
use hpu_plant::transfer::PairMatrices;

use crate::interval::{Interval, Matrix};
use crate::series;

/// The most samples that are looked at.
const MOST_SAMPLES: u64 = 5_000_000;
/// The longest period, in samples.
const MOST_PERIOD: usize = 100_000;
/// The most doublings of a number of samples after which deviations are looked at.
const MOST_DOUBLINGS: u32 = 40;
/// The farthest that an output may be from its cycle when it is told, in steps of the ADC.
const MOST_OFF: f64 = 1e-3;
/// The fraction bits of numbers that are computed without rounding.
const FRACTION: i32 = 30;

/// Words that repeat for ever.
#[derive(Clone, PartialEq, Debug)]
pub struct WordCycle {
    /// The clock edge of the first of these samples.
    pub from_edge: u64,
    /// The clock edges of a period.
    pub edges: u64,
    /// The samples of a period.
    pub samples: usize,
    /// The least and the greatest reading.
    pub readings: [i64; 2],
    /// The least and the greatest word that drives the plant.
    pub commands: [i64; 2],
    /// The least and the greatest output at a sample, in steps of the ADC.
    pub outputs: [f64; 2],
    /// The rms of the output about its mean, at the samples, in steps of the ADC.
    pub rms: f64,
    /// A bound of the distance of the real numbers' motion from the emulator's, in steps of the ADC.
    pub within: f64,
    /// The least distance of an output from another word, in steps of the ADC, with that bound taken off.
    pub margin: f64,
}

impl WordCycle {
    /// Returns the same as a run tells it.
    pub fn forever(&self) -> Forever {
        Forever::Recurs {
            recurrence: Recurrence { from: self.from_edge, period: self.edges },
            rms_counts: self.rms,
            model_counts: Ok(self.within),
        }
    }
}

pub(crate) fn enclosed([hi, lo]: [f64; 2]) -> Interval {
    Interval::exact(hi).plus(Interval::exact(lo))
}

/// The plant from sample to sample.
pub(crate) struct Map<'s> {
    pub scene: &'s TransferScene,
    given: PairMatrices,
    pub from_x: Matrix,
    pub from_u: Vec<Interval>,
    pub c: Vec<Interval>,
    pub d: Interval,
}

impl<'s> Map<'s> {
    pub(crate) fn new(simulation: &TransferSimulation<'s>) -> Self {
        let (scene, given) = (simulation.scene(), simulation.plant().matrices());
        let row = |row: &[[f64; 2]]| row.iter().map(|&pair| enclosed(pair)).collect::<Vec<_>>();
        let (mut from_x, mut from_u) = (Matrix(given.a.iter().map(|of| row(of)).collect()), row(&given.b));
        if !scene.discrete {
            // The exponential of the matrix with its input as one more state.
            let order = from_u.len();
            let clock_hz = scene.clock.frequency_hz() as f64;
            let sample_s = Interval::exact(scene.adc.period as f64).over(clock_hz);
            let rows = from_x.0.iter().zip(&from_u).map(|(row, &u)| [row.as_slice(), &[u]].concat());
            let rows = rows.chain([vec![Interval::ZERO; order + 1]]);
            let exponent = Matrix(rows.map(|row| row.iter().map(|cell| cell.times(sample_s)).collect()).collect());
            let flow = series::exponential(&exponent);
            from_u = flow.0[..order].iter().map(|row| row[order]).collect();
            from_x = Matrix(flow.0[..order].iter().map(|row| row[..order].to_vec()).collect());
        }
        Self { scene, from_x, from_u, c: row(&given.c), d: enclosed(given.d), given }
    }

    fn input(&self, word: i64) -> Interval {
        let driven = Interval::exact(word as f64).times(Interval::exact(self.scene.dac.lsb()));
        driven.plus(Interval::exact(self.scene.disturbance))
    }

    /// Returns the size of `F x + G u - next`.
    fn residue(&self, x: &[f64], word: i64, next: &[f64]) -> f64 {
        let u = self.input(word);
        let off = |((row, from_u), next): ((&Vec<Interval>, &Interval), &f64)| {
            let sum = weighed(row, x).plus(from_u.times(u));
            sum.minus(Interval::exact(*next)).size()
        };
        self.from_x.0.iter().zip(&self.from_u).zip(next).map(off).fold(0.0, f64::max)
    }

    /// Returns whether `A x + B u` is exactly `next` of a discrete plant whose numbers are all multiples of 2^-30.
    fn is_exact(&self, x: &[f64], word: i64, next: &[f64]) -> bool {
        let whole = |value: f64| -> Option<i128> {
            let scaled = libm::scalbn(value, FRACTION);
            // A product of two is below 2^120.
            (scaled.fract() == 0.0 && scaled.abs() < 2f64.powi(58)).then_some(scaled as i128)
        };
        let of_pair = |[hi, lo]: [f64; 2]| whole(hi).filter(|_| lo == 0.0);
        let product = |pair: [f64; 2], value: Option<i128>| Some(of_pair(pair)? * value?);
        let scene = self.scene;
        let u = (|| Some(i128::from(word) * whole(scene.dac.lsb())? + whole(scene.disturbance)?))();
        let u = u.filter(|u| u.unsigned_abs() < 1 << 58);
        let rows = self.given.a.iter().zip(&self.given.b).zip(next);
        scene.discrete
            && rows.clone().count() == next.len()
            && rows.into_iter().all(|((row, &b), &next)| {
                let sum = row.iter().zip(x).try_fold(0i128, |sum, (&a, &x)| Some(sum + product(a, whole(x))?));
                let sum = (|| Some(sum? + product(b, u)?))();
                // The next state has half as many fraction bits.
                sum.is_some() && sum == whole(next).map(|next| next << FRACTION)
            })
    }

    /// Returns bounds of `sup |F^k|` and of the sum of all `|F^k|`.
    fn decay(&self) -> Option<[f64; 2]> {
        let (mut power, mut most, mut sum) = (self.from_x.clone(), 1.0f64, 1.0f64);
        for _ in 0..MOST_DOUBLINGS {
            let size = power.norm();
            if size <= 0.5 {
                // The rest is a geometric series of the numbers so far.
                return Some([most, (2.0 * sum).next_up()]);
            }
            most = (most * size.max(1.0)).next_up();
            sum = (sum * (1.0 + size).next_up()).next_up();
            power = power.times(&power);
            // Written so that a number that is none proves nothing.
            let is_finite = size < 1e30;
            if !is_finite {
                return None;
            }
        }
        None
    }
}

fn weighed(row: &[Interval], x: &[f64]) -> Interval {
    row.iter().zip(x).fold(Interval::ZERO, |sum, (cell, &x)| sum.plus(cell.times(Interval::exact(x))))
}

/// The notes of a sample.
struct Noted {
    words: [i64; 3],
    states: Vec<[f64; 2]>,
}

impl Noted {
    fn of(samples: &Samples) -> Self {
        Self { words: samples.words(), states: samples.states() }
    }

    fn point(&self) -> Vec<f64> {
        self.states.iter().map(|pair| pair[0]).collect()
    }
}

/// Proves that the words from the first of these samples to the last repeat for ever.
fn proved(map: &Map, decay: Option<[f64; 2]>, period: &[Noted]) -> Result<WordCycle, String> {
    let adc = &map.scene.adc;
    let lsb = adc.range.lsb();
    let points: Vec<Vec<f64>> = period.iter().map(Noted::point).collect();
    let follows = |at: usize| (&points[at], period[at].words[2], &points[(at + 1) % points.len()]);
    let is_exact = period[0].states.iter().all(|pair| pair[1] == 0.0)
        && (0..points.len()).all(|at| {
            let (x, word, next) = follows(at);
            map.is_exact(x, word, next)
        });
    let off = if is_exact {
        0.0
    } else {
        let [most, sum] =
            decay.ok_or("the plant has a mode that does not decay, and its states do not come back exactly")?;
        let residues = (0..points.len()).map(|at| {
            let (x, word, next) = follows(at);
            map.residue(x, word, next)
        });
        let residue = residues.fold(0.0, f64::max);
        let rest = period[0].states.iter().map(|pair| pair[1].abs()).fold(0.0, f64::max);
        // Written so that a number that is none proves nothing.
        ((most * rest).next_up() + (sum * residue).next_up()).next_up()
    };
    let reach = map.c.iter().fold(0.0, |sum: f64, cell| (sum + cell.size()).next_up());
    let off = (off * reach).next_up().max(0.0);
    let off = if is_exact { 0.0 } else { off };
    let (margin, outputs) = margin(map, &points, period);
    let spare = (margin - off) / lsb;
    let (is_apart, is_near) = (spare > 0.0, off / lsb <= MOST_OFF);
    if !is_apart {
        return Err(format!(
            "the words of {} samples come again, but an output is within {} steps of another word",
            period.len(),
            number(off / lsb)
        ));
    }
    if !is_near {
        return Err(format!(
            "the words repeat, but the output may still be {} steps from its cycle",
            number(off / lsb)
        ));
    }
    let samples = shortest(period, is_exact);
    let ends = |index: usize| {
        let all = || period.iter().map(|noted| noted.words[index]);
        [all().min().unwrap_or_default(), all().max().unwrap_or_default()]
    };
    let mean = outputs.iter().sum::<f64>() / outputs.len() as f64;
    let squares: f64 = outputs.iter().map(|y| (y - mean) * (y - mean)).sum();
    Ok(WordCycle {
        from_edge: 0,
        edges: samples as u64 * adc.period,
        samples,
        readings: ends(0),
        commands: ends(2),
        outputs: outputs.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], &y| [l.min(y), m.max(y)]),
        rms: (squares / outputs.len() as f64).sqrt(),
        within: off / lsb,
        margin: spare,
    })
}

/// Returns the least distance of an output from another word of the converter, and the outputs in steps of it.
fn margin(map: &Map, points: &[Vec<f64>], period: &[Noted]) -> (f64, Vec<f64>) {
    let adc = &map.scene.adc;
    let lsb = adc.range.lsb();
    let [least, most] = adc.range.ends();
    let (mut margin, mut outputs) = (f64::INFINITY, Vec::new());
    for (x, noted) in points.iter().zip(period) {
        let word = noted.words[0];
        let output = weighed(&map.c, x).plus(map.d.times(map.input(noted.words[2])));
        let from_zero = output.minus(Interval::exact(adc.offset));
        let end = |halves: f64| Interval::exact(word as f64 + halves).times(Interval::exact(lsb));
        let [below, above] = if adc.floors { [0.0, 1.0] } else { [-0.5, 0.5] };
        if word > least {
            margin = margin.min(from_zero.minus(end(below)).lo);
        }
        if word < most {
            margin = margin.min(end(above).minus(from_zero).lo);
        }
        outputs.push(output.middle() / lsb);
    }
    (margin, outputs)
}

/// Returns the number of samples of the shortest period. Under words of a shorter period a plant that decays has a
/// cycle of that period.
fn shortest(period: &[Noted], is_exact: bool) -> usize {
    let is_shorter = |samples: &usize| {
        let same = |at: usize| {
            let (one, other) = (&period[at], &period[at - samples]);
            one.words == other.words && (!is_exact || one.states == other.states)
        };
        period.len().is_multiple_of(*samples) && (*samples..period.len()).all(same)
    };
    (1..period.len()).find(is_shorter).unwrap_or(period.len())
}

/// Looks at the samples of a scene up to a clock edge for words that repeat for ever.
///
/// # Errors
///
/// Returns why none are proved to.
pub fn words_recur(scene: &TransferScene, last_edge: u64) -> Result<WordCycle, NotTold> {
    let simulation = TransferSimulation::new(scene).map_err(|error| error.to_string())?;
    let map = Map::new(&simulation);
    let decay = map.decay();
    let mut now = simulation.samples();
    let mut anchor: Option<(Samples, u64)> = None;
    // The samples since the anchor, which is replaced after 1, 2, 4 and so on.
    let (mut noted, mut room, mut next_try) = (Vec::new(), 1, 0);
    let mut why = "no words came again".to_string();
    for sample in 0..MOST_SAMPLES {
        if !now.go_on() {
            return Err("a state of the plant, or its output, grew beyond 1e100".into());
        }
        if now.edge() > last_edge {
            break;
        }
        if !now.is_left_alone() {
            continue;
        }
        if let Some((then, from_edge)) = &anchor
            && sample >= next_try
            && now.is_alike(then)
        {
            match proved(&map, decay, &noted) {
                Ok(cycle) => return Ok(WordCycle { from_edge: *from_edge, ..cycle }),
                Err(said) => why = said,
            }
            // Trials grow rarer, so that they cost no more than the samples.
            next_try = sample + 1 + sample / 16 + noted.len() as u64 / 4;
        }
        if noted.len() >= room || anchor.is_none() {
            room = (2 * room).min(MOST_PERIOD);
            anchor = Some((now.clone(), now.edge()));
            noted.clear();
        }
        noted.push(Noted::of(&now));
    }
    Err(why)
}
