//! Up to which stiffness a wall settles at every phase of its contact, for ever.
//!
//! The loop is that of a live spring behind a latched modulator. The search here is in floats: for each word of the
//! stiffness it finds a [`Witness`], and [`certify::check`](crate::certify::check) proves or rejects it.
//!
//! The multiplier of the staircase makes the bound: a command that never falls with the angle cannot feed a motion that
//! climbs against it. The search is over `h`, the weight of the staircase, and over the two weights of the pulse's end.
//! Each frequency gives a closed form of the level `λ` that they need. The storage is the solution of the discrete
//! Riccati equation of that level, by doubling.

use hpu_cosim::scene::{Device, Hand, Scene};

use toml_edit::Value;

use crate::Error;
use crate::certify::{Bound, CLAIM, Witness, check, of_scene};
use crate::linear::unit;
use crate::sampled::{Matrix, SampledLoop, exponential, product, scaled, solution};

/// Greatest number of words that are proved.
const MOST_WORDS: usize = 1024;
/// Frequencies at which a level is computed.
const FREQUENCIES: usize = 800;
/// Greatest rms of a wall that has settled, in counts.
pub const SETTLED_COUNTS: f64 = 1.0;

/// The words of a stiffness that are proved to settle, from the softest one on.
#[derive(Clone, PartialEq, Debug)]
pub struct SteadySet {
    /// Unit of all stiffnesses.
    pub unit: &'static str,
    /// Stiffness of the softest word of the range.
    pub from: f64,
    /// The words that are proved, one after the other.
    pub proved: Vec<Steady>,
    /// The first word that is not proved, and why; none if the range or the search ends before it.
    pub beyond: Option<(f64, String)>,
    /// Whether the search ended before the range.
    pub ended: bool,
}

/// A word that settles at every phase, for ever.
#[derive(Clone, PartialEq, Debug)]
pub struct Steady {
    /// Stiffness of the word.
    pub stiffness: f64,
    /// The bounds that are proved.
    pub bound: Bound,
    /// The numbers that prove them.
    pub witness: Witness,
}

impl SteadySet {
    /// Proves words from the softest one of a range on, until one is not proved to stay below one count rms.
    ///
    /// # Errors
    ///
    /// Returns why the proof is not worked out for the scene.
    pub fn new(scene: &Scene, range: [f64; 2]) -> Result<Self, Error> {
        let words = scene.words()?;
        let step = words.realised.torque_quantum_nm / words.realised.count_rad * scene.method.stiffness_format.lsb();
        let word = |stiffness: f64| ((stiffness / step).round() as i128).clamp(1, scene.method.stiffness_format.max());
        let (least, most) = (word(range[0]), word(range[1]));
        let mut set = Self { unit: unit(scene), from: least as f64 * step, proved: vec![], beyond: None, ended: false };
        for word in least..=most {
            if set.proved.len() == MOST_WORDS {
                set.ended = true;
                break;
            }
            let stiffness = word as f64 * step;
            match steady(scene, word as i64) {
                Ok((witness, bound)) if bound.rms_counts < SETTLED_COUNTS => {
                    set.proved.push(Steady { stiffness, bound, witness });
                }
                Ok((_, bound)) => {
                    let why = format!("the rms is bounded by {:.2} counts", bound.rms_counts);
                    set.beyond = Some((stiffness, why));
                    break;
                }
                Err(Unproved::Scene(error)) => return Err(error),
                Err(Unproved::Word(why)) => {
                    set.beyond = Some((stiffness, why));
                    break;
                }
            }
        }
        Ok(set)
    }
}

/// Returns the text of a certificate that [`certify`](crate::certify::certify) checks: the scene's text, what replaces
/// its keys, and the witnesses. A certificate of a scene that reads files is rejected.
pub fn certificate(set: &SteadySet, name: &str, text: &str, overrides: &[(String, String)]) -> String {
    let quoted = |text: &str| Value::from(text).to_string();
    let list = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(", ");
    let pairs: Vec<String> =
        overrides.iter().map(|(key, value)| format!("[{}, {}]", quoted(key), quoted(value))).collect();
    let mut certificate = format!(
        "# `hpu certify` checks this file. It holds for every start from which the wall stays in contact.\n\
         claim = {}\nname = {}\nset = [{}]\nscene = {}\n",
        quoted(CLAIM),
        quoted(name),
        pairs.join(", "),
        quoted(text)
    );
    for Steady { stiffness, bound, witness } in &set.proved {
        let Witness { word, act, decay, shape, half_range, level, weights, storage } = witness;
        let Bound { rms_counts, duty, .. } = bound;
        certificate += &format!(
            "\n[[word]]\nword = {word}\nstiffness = {stiffness:e}\nduty = {duty:e}\nrms_counts = {rms_counts:e}\n\
             act = {act:e}\ndecay = {decay:e}\nshape = [{}]\nhalf_range = {half_range:e}\nlevel = {level:e}\n\
             weights = [{}]\nstorage = [{}]\n",
            list(shape),
            list(weights),
            list(storage)
        );
    }
    certificate
}

/// Why a word is not proved: because of its scene, or of itself.
enum Unproved {
    Scene(Error),
    Word(String),
}

/// Returns a witness of a word, and what the checker says of it.
fn steady(scene: &Scene, word: i64) -> Result<(Witness, Bound), Unproved> {
    of_scene(scene).map_err(Unproved::Scene)?;
    let sampled = Sampled::new(scene, word).map_err(|why| Unproved::Word(why.into()))?;
    let mut last = String::new();
    for slack in [2e-3, 1e-2, 4e-2, 0.15] {
        let Some(witness) = sampled.witness(word, slack) else {
            last = "no bound of its motion was found".into();
            continue;
        };
        match check(scene, &witness) {
            Ok(bound) => return Ok((witness, bound)),
            Err(why) => last = why.to_string(),
        }
    }
    Err(Unproved::Word(last))
}

/// The loop of a word from period to period, in the units of [`certify`](crate::certify).
struct Sampled {
    /// The plant's flow over a period, and that of the closed loop.
    flow: Matrix,
    closed: Matrix,
    /// The state at the end of a period by a count of the encoder, and by a clock by which a pulse ends later.
    answer: [f64; 3],
    later: [f64; 3],
    /// Bounds of the second and the third derivative by that clock.
    bend: [f64; 3],
    third: [f64; 3],
    slope: f64,
    half: f64,
    act: f64,
    away: f64,
    radius: f64,
    /// Sums of responses: to a count, to a clock and its square, to each state.
    sums: [[f64; 3]; 6],
}

impl Sampled {
    fn new(scene: &Scene, word: i64) -> Result<Self, &'static str> {
        Self::of(scene, word as f64 * scene.method.stiffness_format.lsb(), None)
    }

    /// Returns the loop with a slope of the staircase, in commands a count. `act` is the pulse at rest, if it is given.
    fn of(scene: &Scene, slope: f64, act: Option<f64>) -> Result<Self, &'static str> {
        let Device::Motor(motor) = &scene.device else { unreachable!("the checker refuses others") };
        let period = 2f64.powi(scene.method.pwm.bits.cast_signed());
        let period_s = period * scene.clock.period_s();
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let square = period_s * period_s;
        let count = scene.encoder.count_rad();
        let (decay, coupling) = (ohm * period_s / l, k * k * square / (l * j));
        let drag = (motor.viscous_friction_nm_s_per_rad + grip_damping) * period_s / j;
        let grip = grip * square / j;
        let accelerates = |torque: f64| torque * square / (j * count);
        let stall = accelerates(k * scene.bridge.supply_v / ohm);
        let rates = vec![vec![-decay, -coupling, 0.0], vec![1.0, -drag, -grip], vec![0.0, 1.0, 0.0]];

        let lsb = scene.method.stiffness_format.lsb();
        let half = 0.5 + 0.5 * (1.0 - lsb).max(0.0) / slope;
        let clock = stall / period;
        let at_rest = match &scene.hand {
            Hand::SpringDamper { path, .. } => {
                let depth = path.last().map_or(0.0, |end| end.angle_rad) / count - scene.wall_count() as f64;
                slope * (depth - half) / (1.0 + slope * clock / grip)
            }
            Hand::ConstantTorque { torque_nm } => accelerates(*torque_nm) / clock,
            _ => unreachable!("the checker refuses others"),
        };
        let act = act.unwrap_or(at_rest);
        let latency = 4.0 + f64::from(scene.method.settling);
        if !(act > 0.0 && act < period - latency) {
            return Err("the pulse at rest ends outside of its period");
        }
        // The ripple moves the reading: the checker's bound of that, roughly.
        let duty = act / period;
        let high = (1.0 - libm::exp(-decay * duty)) / (1.0 - libm::exp(-decay));
        let share = (high - duty).max(duty - high * libm::exp(-decay * (1.0 - duty)));
        let off = stall * share / (1.0 - coupling / decay - drag - grip);
        let away = if grip > 0.0 { 1.01 * slope * off / (1.0 + slope * clock / grip) + 1e-6 } else { 1e-6 };

        let flow = exponential(&rates);
        let kick = [stall * decay / period, 0.0, 0.0];
        let after = |left: f64| times(&exponential(&scaled(&rates, left / period)), &kick);
        let pushed = after(period - latency - act);
        let further = |x: &[f64; 3]| times(&rates, x).map(|part| -part / period);
        let [later, turned] = [further(&pushed), further(&further(&pushed))];
        let (mut bend, mut third) = ([0.0f64; 3], [0.0f64; 3]);
        for part in 0..=64 {
            let twice = further(&further(&after(f64::from(part) / 64.0 * period)));
            let thrice = further(&twice);
            for state in 0..3 {
                bend[state] = bend[state].max(1.05 * twice[state].abs());
                third[state] = third[state].max(1.05 * thrice[state].abs());
            }
        }
        let answer = pushed.map(|part| slope * part);
        let mut closed = flow.clone();
        for (row, part) in closed.iter_mut().zip(answer) {
            row[2] -= part;
        }
        let radius = SampledLoop::of(closed.clone()).spectral_radius();
        if radius.is_nan() || radius > 1.0 - 1e-4 {
            return Err("the linear loop does not settle, or hardly");
        }
        let unit = |at: usize| std::array::from_fn(|state| f64::from(u8::from(state == at)));
        let mut sums = [[0.0; 3]; 6];
        for (sums, mut at) in sums.iter_mut().zip([answer, later, turned, unit(0), unit(1), unit(2)]) {
            let periods = (25.0 / (1.0 - radius)).ceil() as usize;
            for _ in 0..periods {
                for (sum, part) in sums.iter_mut().zip(at) {
                    *sum += part.abs();
                }
                at = times(&closed, &at);
            }
        }
        Ok(Self { flow, closed, answer, later, bend, third, slope, half, act, away, radius, sums })
    }

    /// Returns the clocks by which pulses end elsewhere at a half-range, for both parts of their effect.
    fn unsteady(&self, half_range: f64) -> [f64; 2] {
        let push = self.slope * (half_range + self.half);
        [0.5 * push + self.away, 0.5 * (push * push / 3.0 + (push + self.away) * self.away)]
    }

    /// Returns the size of the angle that follows from one.
    fn size(&self, size: f64) -> f64 {
        let [late, square] = self.unsteady(size);
        let push = self.slope * (size + self.half);
        let cube = (push.powi(3) / 4.0 + 1.5 * (push + self.away).powi(2) * self.away) / 6.0;
        let ends: f64 = (0..3).map(|axis| cube * self.third[axis] * self.sums[3 + axis][2]).sum();
        self.half * self.sums[0][2] + push * (late * self.sums[1][2] + square * self.sums[2][2] + ends)
    }

    /// Returns the half-range of the angle, in counts.
    fn half_range(&self) -> Option<f64> {
        let mut size = self.half * self.sums[0][2];
        for _ in 0..2000 {
            let next = self.size(size);
            if next > 1e6 {
                return None;
            }
            if next <= size * (1.0 + 1e-9) {
                return Some(next * (1.0 + 1e-6));
            }
            size = next;
        }
        None
    }

    /// Returns a witness whose level is greater than the least one by this share.
    fn witness(&self, word: i64, slack: f64) -> Option<Witness> {
        let half_range = self.half_range()?;
        let [late, bent] = self.unsteady(half_range);
        let spectrum = self.spectrum(late, bent);
        let (level, weights) = least_level(&spectrum)?;
        let level = level * (1.0 + slack);
        let storage = self.storage(level, weights, [late, bent], 0.2 * slack)?;
        let decay = 0.5 * (1.0 + self.radius);
        let shape = self.shape(decay)?;
        Some(Witness { word, act: self.act, decay, shape, half_range, level, weights, storage })
    }

    /// Returns the responses of the closed loop at frequencies up to half of the modulator's.
    fn spectrum(&self, late: f64, bent: f64) -> Vec<Response> {
        // The resolvent by Leverrier's formulas.
        let trace = |a: &Matrix| a[0][0] + a[1][1] + a[2][2];
        let plus = |a: &Matrix, by: f64| {
            let mut sum = a.clone();
            (0..3).for_each(|at| sum[at][at] += by);
            sum
        };
        let c1 = -trace(&self.flow);
        let first = plus(&self.flow, c1);
        let c2 = -0.5 * trace(&product(&self.flow, &first));
        let second = plus(&product(&self.flow, &first), c2);
        let c3 = -trace(&product(&self.flow, &second)) / 3.0;
        let angle = |z: Complex, x: &[f64; 3]| {
            let numerator = z.times(z).scaled(x[2]).plus(z.scaled(times(&first, x)[2])).plus_real(times(&second, x)[2]);
            let below = z.plus_real(c1).times(z).plus_real(c2).times(z).plus_real(c3);
            numerator.over(below)
        };
        let at = |index: usize| {
            let share = index as f64 / (FREQUENCIES - 1) as f64;
            let w = std::f64::consts::PI * libm::exp(-9.0 * (1.0 - share));
            let z = Complex(libm::cos(w), libm::sin(w));
            let loop_gain = angle(z, &self.answer);
            let sensitivity = Complex(1.0, 0.0).over(loop_gain.plus_real(1.0));
            let size = |x: &[f64; 3], by: f64| sensitivity.times(angle(z, x)).square() * (self.slope * by).powi(2);
            let axis = |axis: usize| {
                let mut unit = [0.0; 3];
                unit[axis] = self.bend[axis];
                size(&unit, bent)
            };
            Response {
                angle: sensitivity.times(loop_gain).scaled(-1.0),
                sensitivity,
                climb: Complex(1.0 - z.0, z.1),
                ends: [size(&self.later, late), axis(0) + axis(1) + axis(2)],
            }
        };
        (0..FREQUENCIES).map(at).collect()
    }

    /// Returns `W`'s upper triangle: the solution of the Riccati equation, by doubling.
    fn storage(&self, level: f64, [climb, first, second]: [f64; 3], ends: [f64; 2], spare: f64) -> Option<[f64; 10]> {
        let both = first + 3.0 * second;
        let mut next = vec![vec![0.0; 4]; 4];
        for (row, closed) in next.iter_mut().zip(&self.closed) {
            row[..3].copy_from_slice(closed);
        }
        next[3][2] = 1.0;
        let mut inputs = [[0.0; 5]; 4];
        for state in 0..3 {
            inputs[state][0] = -self.answer[state];
            inputs[state][1] = -self.slope * ends[0] * self.later[state];
            inputs[state][2 + state] = self.slope * ends[1] * self.bend[state];
        }
        let mut quadratic = vec![vec![0.0; 4]; 4];
        quadratic[2][2] = 1.0 + climb + both;
        (quadratic[2][3], quadratic[3][2]) = (-0.5 * climb, -0.5 * climb);
        // A small share of the level for what the checker's intervals need.
        for (state, sizes) in [0, 1, 2, 2].into_iter().enumerate() {
            let size = self.half * self.sums[0][sizes];
            quadratic[state][state] += spare * level / (size * size);
        }
        let cross = [0.0, 0.0, 0.5 * climb + both, -0.5 * climb];
        let own = [both - level * (1.0 - spare), -first * (1.0 - spare), -second * (1.0 - spare)];
        let own = [own[0], own[1], own[2], own[2], own[2]];
        if own.iter().any(|own| *own >= 0.0) {
            return None;
        }
        let mut a = next;
        let mut g = vec![vec![0.0; 4]; 4];
        let mut h = quadratic;
        for row in 0..4 {
            for of in 0..4 {
                a[row][of] -= inputs[row][0] * cross[of] / own[0];
                h[row][of] -= cross[row] * cross[of] / own[0];
                g[row][of] = (0..5).map(|input| inputs[row][input] * inputs[of][input] / own[input]).sum();
            }
        }
        for _ in 0..60 {
            let mut mixed = product(&g, &h);
            (0..4).for_each(|at| mixed[at][at] += 1.0);
            let inverse = inverse(&mixed)?;
            let turned = product(&a, &inverse);
            let more = product(&turned, &product(&g, &transposed(&a)));
            let grown = product(&transposed(&a), &product(&h, &product(&inverse, &a)));
            a = product(&turned, &a);
            let size = |a: &Matrix| a.iter().flatten().fold(0.0, |most: f64, cell| most.max(cell.abs()));
            let is_done = size(&grown) <= 1e-15 * size(&h);
            g = sum(&g, &more);
            h = sum(&h, &grown);
            if !size(&h).is_finite() {
                return None;
            }
            if is_done {
                return Some(std::array::from_fn(|index| {
                    let [row, of] = UPPER[index];
                    0.5 * (h[row][of] + h[of][row])
                }));
            }
        }
        None
    }

    /// Returns `P`'s upper triangle: the solution of Lyapunov's equation, at least the identity.
    fn shape(&self, decay: f64) -> Option<[f64; 6]> {
        let mut power = scaled(&self.closed, 1.0 / decay);
        let mut shape = vec![vec![0.0; 3]; 3];
        for (state, row) in shape.iter_mut().enumerate() {
            row[state] = 1.0 / self.sums[0][state].powi(2);
        }
        for _ in 0..60 {
            shape = sum(&shape, &product(&transposed(&power), &product(&shape, &power)));
            power = product(&power, &power);
        }
        let least: f64 = inverse(&shape)?.iter().enumerate().map(|(at, row)| row[at]).sum();
        let shape = scaled(&shape, 1.01 * least);
        let upper =
            UPPER.into_iter().filter(|[_, of]| *of < 3).map(|[row, of]| 0.5 * (shape[row][of] + shape[of][row]));
        upper.collect::<Vec<f64>>().try_into().ok()
    }
}

/// Places of an upper triangle of 4 rows.
const UPPER: [[usize; 2]; 10] = [[0, 0], [0, 1], [0, 2], [0, 3], [1, 1], [1, 2], [1, 3], [2, 2], [2, 3], [3, 3]];

/// The closed loop at a frequency.
struct Response {
    /// The angle's answer to the rounding, and that of what the command reads.
    angle: Complex,
    sensitivity: Complex,
    /// `1 - 1/z`.
    climb: Complex,
    /// Squared answers to both parts of the pulse's end.
    ends: [f64; 2],
}

impl Response {
    /// Returns the level that these weights need at the frequency.
    fn level(&self, [climb, first, second]: [f64; 3]) -> f64 {
        let both = first + 3.0 * second;
        let (turn, angle, read) = (self.climb, self.angle, self.sensitivity);
        let room = self.ends[0] / first + self.ends[1] / second;
        let curve = 1.0 + climb * turn.0 + both - 1.0 / room;
        if curve >= 0.0 {
            return f64::INFINITY;
        }
        let tilt = turn.times(angle).plus(turn.conjugate().times(read)).scaled(0.5 * climb);
        let slope = angle.plus(read.scaled(both)).plus(tilt);
        let own = angle.square() + climb * read.conjugate().times(turn.times(angle)).0 + both * read.square();
        own - slope.square() / curve
    }
}

/// Returns the least level over the weights, and the weights: along one of them after the other.
fn least_level(spectrum: &[Response]) -> Option<(f64, [f64; 3])> {
    let level = |logs: [f64; 3]| {
        let weights = logs.map(libm::exp);
        spectrum.iter().fold(0.0, |most: f64, at| most.max(at.level(weights)))
    };
    let mut best = ([0.0, -9.0, -12.0], f64::INFINITY);
    for climb in -4..14 {
        for end in [-2.0, -5.0, -8.0, -11.0] {
            let logs = [f64::from(climb), end, end - 3.0];
            let found = level(logs);
            if found < best.1 {
                best = (logs, found);
            }
        }
    }
    for step in [1.5, 0.5, 0.2, 0.1, 0.05] {
        for axis in [0, 1, 2, 0, 1, 2] {
            let along = |by: f64| {
                let mut logs = best.0;
                logs[axis] += by;
                (logs, level(logs))
            };
            // Golden section over a step to both sides.
            let (mut low, mut high) = (-step, step);
            let golden = 0.618_033_988_749_895;
            for _ in 0..8 {
                let [left, right] = [high - golden * (high - low), low + golden * (high - low)];
                if along(left).1 <= along(right).1 { high = right } else { low = left }
            }
            let found = along(0.5 * (low + high));
            if found.1 < best.1 {
                best = found;
            }
        }
    }
    best.1.is_finite().then(|| (best.1, best.0.map(libm::exp)))
}

/// A complex number.
#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
    fn plus_real(self, by: f64) -> Self {
        Self(self.0 + by, self.1)
    }
    fn times(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
    fn scaled(self, by: f64) -> Self {
        Self(self.0 * by, self.1 * by)
    }
    fn conjugate(self) -> Self {
        Self(self.0, -self.1)
    }
    fn square(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }
    fn over(self, other: Self) -> Self {
        self.times(other.conjugate()).scaled(1.0 / other.square())
    }
}

fn times(a: &Matrix, x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|row| (0..3).map(|of| a[row][of] * x[of]).sum())
}

fn transposed(a: &Matrix) -> Matrix {
    (0..a.len()).map(|row| a.iter().map(|other| other[row]).collect()).collect()
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
}

fn inverse(a: &Matrix) -> Option<Matrix> {
    let column = |of: usize| {
        let rows = a.iter().enumerate().map(|(row, cells)| {
            let right = f64::from(u8::from(row == of));
            cells.iter().copied().chain([right]).collect()
        });
        solution(rows.collect())
    };
    let columns: Option<Matrix> = (0..a.len()).map(column).collect();
    columns.map(|columns| transposed(&columns))
}

#[cfg(test)]
mod tests {
    use hpu_cosim::scene::{Scene, shipped};

    use super::*;
    use crate::certify::certify;

    fn known(name: &str, set: &[(&str, &str)]) -> Scene {
        let shipped = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
        Scene::parse(name, shipped.text, &set, &mut |_| unreachable!()).expect("a scene")
    }

    fn undamped(set: &[(&str, &str)]) -> Scene {
        known("hybrid-wall", &[&[("wall.damping", "0")], set].concat())
    }

    /// Returns a loop of a real stiffness with the pulse's end at a whole clock.
    fn at(stiffness: f64, act: f64) -> Sampled {
        let scene = undamped(&[]);
        let step = scene.words().expect("words").realised;
        let step = step.torque_quantum_nm / step.count_rad;
        Sampled::of(&scene, stiffness / step, Some(act)).unwrap_or_else(|why| panic!("{why}"))
    }

    #[test]
    fn levels_and_sums_are_those_of_other_numerics() {
        // lambda(1.5, h 120), lambda(1.0, h 64), half of the sums at 1.5, 1.0 and 0.5; the pulse ends at 1024 of 4096.
        for (stiffness, climb, level) in [(1.5, 120.0, 2.359_305_674_998_9), (1.0, 64.0, 0.591_718_395_414_17)] {
            let spectrum = at(stiffness, 1024.0).spectrum(0.0, 0.0);
            let weights = [climb, 1e-14, 1e-14];
            let found = spectrum.iter().fold(0.0, |most: f64, at| most.max(at.level(weights)));
            // The grid misses the maximum by no more than its steps allow.
            assert!(found <= level * (1.0 + 1e-9) && found > level * (1.0 - 2e-3), "{stiffness}: {found}");
        }
        for (stiffness, sum) in [(1.5, 3.924_120_675_601_8), (1.0, 2.414_751_600_245_6), (0.5, 1.268_763_989_633_7)] {
            let found = 0.5 * at(stiffness, 1024.0).sums[0][2];
            assert!((found / sum - 1.0).abs() < 1e-9, "{stiffness}: {found}");
        }
    }

    #[test]
    fn hybrid_wall_without_damping_is_proved_beyond_a_stiffness() {
        let set = SteadySet::new(&undamped(&[]), [0.04, 4.0]).expect("a loop of that kind");
        let last = set.proved.last().expect("some");
        assert!(last.stiffness >= 1.4 && set.proved.len() == 37, "{last:?}");
        assert!(set.proved.iter().all(|word| word.bound.rms_counts < SETTLED_COUNTS));
        assert!(set.beyond.is_some() && !set.ended);
    }

    #[test]
    fn a_witness_of_another_scene_word_or_pulse_is_rejected() {
        let scene = undamped(&[]);
        let (witness, bound) = steady(&scene, 36).map_err(|_| ()).expect("a witness");
        assert_eq!(check(&scene, &witness).expect("it holds"), bound);
        let others: [&[(&str, &str)]; 8] = [
            &[("device.inductance", "0.25 mH")],
            &[("device.rotor_inertia", "1.3e-6 kg.m^2")],
            &[("device.resistance", "2.5 Ohm")],
            &[("hand.stiffness", "0.4 N.m/rad")],
            &[("hand.damping", "0.01 mN.m.s/rad")],
            &[("clock.frequency", "45 MHz")],
            &[("method.pwm.bits", "11")],
            &[("wall.position", "1.45 rad")],
        ];
        for set in others {
            let other = check(&undamped(set), &witness).map(|bound| bound.rms_counts);
            assert!(other.is_err(), "{set:?}: {other:?}");
        }
        for word in [30, 34, 38, 42, 72] {
            assert!(check(&scene, &Witness { word, ..witness.clone() }).is_err(), "{word}");
        }
        for by in [-60.0, 60.0] {
            assert!(check(&scene, &Witness { act: witness.act + by, ..witness.clone() }).is_err(), "{by}");
        }
    }

    #[test]
    fn a_witness_that_claims_more_is_rejected() {
        let scene = undamped(&[]);
        let (good, _) = steady(&scene, 36).map_err(|_| ()).expect("a witness");
        let bad = |change: &dyn Fn(&mut Witness)| {
            let mut witness = good.clone();
            change(&mut witness);
            check(&scene, &witness)
        };
        let changes: [&dyn Fn(&mut Witness); 12] = [
            &|witness| witness.level *= 0.99,
            &|witness| witness.half_range *= 0.999,
            &|witness| witness.half_range = 1e6,
            &|witness| witness.decay = 0.99,
            &|witness| witness.decay = 1.0,
            &|witness| witness.shape = witness.shape.map(|cell| 1e-3 * cell),
            &|witness| witness.storage = witness.storage.map(|cell| -cell),
            &|witness| witness.storage[0] *= 1.05,
            &|witness| witness.weights[0] = 0.0,
            &|witness| witness.weights[1] = -1e-6,
            &|witness| witness.weights[2] = 0.0,
            &|witness| witness.storage[4] = f64::NAN,
        ];
        for (index, change) in changes.into_iter().enumerate() {
            assert!(bad(change).is_err(), "change {index}: {:?}", bad(change));
        }
    }

    #[test]
    fn a_certificate_of_another_scene_stiffness_or_duty_is_rejected() {
        let overrides = [("wall.damping".to_string(), "0".to_string())];
        let shipped = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("it is shipped");
        let set = SteadySet::new(&undamped(&[]), [1.4, 1.6]).expect("a loop of that kind");
        let text = certificate(&set, "hybrid-wall", shipped.text, &overrides);
        let proved = certify(&text).expect("it holds");
        assert_eq!(proved, set.proved.iter().map(|word| (word.stiffness, word.bound)).collect::<Vec<_>>());
        let first = &set.proved[0];
        let told = |key: &str, value: f64, other: f64| (format!("{key} = {value:e}"), format!("{key} = {other:e}"));
        for (old, new) in [
            ("stiffness = \"0.3 N.m/rad\"".to_string(), "stiffness = \"0.31 N.m/rad\"".to_string()),
            ("position = \"1.5 rad\"".into(), "position = \"1.49 rad\"".into()),
            ("\"0\"]".into(), "\"0.1 mN.m.s/rad\"]".into()),
            told("stiffness", first.stiffness, first.stiffness * 1.01),
            told("duty", first.bound.duty, first.bound.duty + 1e-3),
            told("rms_counts", first.bound.rms_counts, first.bound.rms_counts * 0.999),
            (format!("word = {}\n", first.witness.word), format!("word = {}\n", first.witness.word + 1)),
            ("storage".into(), "store".into()),
            ("for ever".into(), "for an hour".into()),
        ] {
            let changed = text.replace(&old, &new);
            assert!(changed != text, "{old} is not in it");
            assert!(certify(&changed).is_err(), "{old} became {new}");
        }
        assert!(certify("").is_err() && certify("claim = 3").is_err() && certify("[").is_err());
    }

    #[test]
    fn a_pulse_that_ends_after_the_next_reading_is_refused() {
        // 4 clocks before the period's end the modulator reads the next command. The stall torque is 265 mN.m.
        let mut scene = undamped(&[]);
        let (witness, _) = steady(&scene, 36).map_err(|_| ()).expect("a witness");
        for (act, is_outside) in [(4090.0, false), (4093.5, true)] {
            scene.hand = Hand::ConstantTorque { torque_nm: 0.265 * act / 4096.0 };
            let error = check(&scene, &Witness { act, ..witness.clone() }).expect_err("too long a pulse").to_string();
            assert_eq!(error.contains("ends outside of its period"), is_outside, "{act}: {error}");
        }
    }

    #[test]
    fn the_checker_is_short_and_shares_no_code_but_intervals() {
        let source = include_str!("certify/mod.rs");
        let is_code = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with("//");
        assert!(source.lines().filter(is_code).count() <= 300);
        let own = source.lines().filter(|line| line.contains("crate::"));
        let known = ["use crate::Error;", "use crate::interval::", "use crate::square::"];
        own.for_each(|line| assert!(known.iter().any(|known| line.starts_with(known)), "{line}"));
    }

    #[test]
    fn scenes_without_such_a_proof_are_refused_with_the_reason() {
        for (name, set, why) in [
            ("hybrid-wall", &[][..], "damping"),
            ("conventional-wall-10khz", &[("wall.damping", "0")], "sampled"),
            ("hybrid-wall", &[("wall.damping", "0"), ("method.pwm.duty", "immediate")], "at once"),
            ("hybrid-wall", &[("wall.damping", "0"), ("model.bridge", "averaged")], "averaged"),
            ("hybrid-wall", &[("wall.damping", "0"), ("device.coulomb_friction", "1 mN.m")], "friction"),
            ("count-cycle", &[], "motor"),
        ] {
            let error = SteadySet::new(&known(name, set), [0.1, 1.0]).expect_err(why).to_string();
            assert!(error.contains(why), "{name}: {error}");
        }
    }

    /// Simulates the exact pulses of a word in SI units, clock by clock of their ends, and returns the rms of the angle
    /// at the readings about its mean, in counts.
    fn simulated(scene: &Scene, word: i64, start_counts: f64, periods: [usize; 2]) -> f64 {
        let Device::Motor(motor) = &scene.device else { unreachable!() };
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let drag = motor.viscous_friction_nm_s_per_rad + grip_damping;
        let Hand::SpringDamper { path, .. } = &scene.hand else { unreachable!() };
        let intent = path.last().expect("a path").angle_rad;
        let clock_s = scene.clock.period_s();
        // The state's last part is the supply; a positive command pushes back.
        let rates = |supply: f64| {
            let push = -supply * scene.bridge.supply_v / l;
            vec![
                vec![-ohm / l, -k / l, 0.0, push],
                vec![k / j, -drag / j, -grip / j, grip * intent / j],
                vec![0.0, 1.0, 0.0, 0.0],
                vec![0.0; 4],
            ]
        };
        let powers = |supply: f64| -> Vec<Matrix> {
            (0..13).map(|bit| exponential(&scaled(&rates(supply), clock_s * f64::from(1 << bit)))).collect()
        };
        let (on, off) = (powers(1.0), powers(0.0));
        let flow = |state: &mut [f64; 4], powers: &[Matrix], clocks: u64| {
            for (bit, power) in powers.iter().enumerate() {
                if clocks >> bit & 1 == 1 {
                    *state = std::array::from_fn(|row| (0..4).map(|of| power[row][of] * state[of]).sum());
                }
            }
        };
        let (count, wall) = (scene.encoder.count_rad(), scene.wall_count());
        let (period, latency) = (1u64 << scene.method.pwm.bits, 4 + u64::from(scene.method.settling));
        let slope = word as f64 * scene.method.stiffness_format.lsb();
        let step = scene.words().expect("words").realised.torque_quantum_nm / count;
        let depth = (intent / count - wall as f64) * grip / (grip + slope * step);
        let mut state = [0.0, 0.0, (wall as f64 + depth + start_counts) * count, 1.0];
        let mut seen = Vec::new();
        for index in 0..periods[1] {
            let inside = (state[2] / count).floor() - wall as f64;
            let command = (slope * inside.max(0.0)).floor().min((period - latency) as f64) as u64;
            if index >= periods[0] {
                seen.push(state[2] / count);
            }
            flow(&mut state, &off, latency);
            flow(&mut state, &on, command);
            flow(&mut state, &off, period - latency - command);
        }
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        (seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
    }

    fn random_loops(count: usize) {
        let mut random = hpu_cosim::SplitMix64::new(64);
        let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let (mut bounded, mut most) = (0, 0.0f64);
        for _ in 0..count {
            let mut factor = |by: f64| libm::exp(by * (2.0 * share() - 1.0));
            let set = [
                ("device.inductance", format!("{:e}", 2.26e-4 * factor(0.7))),
                ("device.rotor_inertia", format!("{:e}", 1.37e-6 * factor(0.7))),
                ("hand.stiffness", format!("{:e}", 0.3 * factor(0.7))),
                ("hand.damping", format!("{:e}", 1e-4 * factor(1.5))),
                ("wall.position", format!("{:e}", 1.5 + 0.05 * libm::log(factor(1.0)))),
                ("method.settling", format!("{}", (20.0 * factor(1.1)) as u32)),
            ];
            let set: Vec<(&str, &str)> = set.iter().map(|(key, value)| (*key, value.as_str())).collect();
            let scene = undamped(&set);
            let word = 1 + (50.0 * share() * share()) as i64;
            let Ok((_, bound)) = steady(&scene, word) else { continue };
            bounded += 1;
            for _ in 0..3 {
                let start = 4.0 * (2.0 * share() - 1.0);
                let rms = simulated(&scene, word, start, [3000, 6000]);
                most = most.max(rms / bound.rms_counts);
                assert!(rms <= bound.rms_counts, "{set:?}, word {word}: {rms}, bound {bound:?}");
            }
        }
        assert!(bounded > count / 2 && most > 0.1, "{bounded} loops, {most} of a bound");
    }

    #[test]
    fn no_random_loop_swings_beyond_its_bound() {
        random_loops(40);
    }

    #[test]
    #[ignore = "testbench/long.sh runs it"]
    fn none_of_a_thousand_random_loops_swings_beyond_its_bound() {
        random_loops(1000);
    }
}
