//! The search for a witness of a word, in floats.

use hpu_cosim::Rest;
use hpu_cosim::scene::{Device, Hand, LoopWords, Scene};

use super::SETTLED_COUNTS;
use super::levels::{
    ANGLE, CLIMBS, Dissipation, KEPT, Matrix, Response, Row, inverse, product, sum, times, transposed,
};
use crate::Error;
use crate::certify::{Bound, LOOSE, Range, Turn, Window, Witness, check, numbers, of_scene, start, window};
use crate::interval::Interval;
use crate::sampled::{SampledLoop, exponential, scaled};

/// Why a loop has no search.
type Refusal = &'static str;

/// Greatest number of steps in which a storage is found.
const MOST_STEPS: usize = 60;
/// Shares by which sums of responses may exceed those of the search. Those over ranges do, by what is lost on the way.
const SPARES: [f64; 4] = [0.0, 3e-3, 3e-2, 0.15];
/// Shares by which a level may exceed the least one.
const SLACKS: [f64; 4] = [2e-3, 1e-2, 4e-2, 0.15];

/// Returns a witness of a word within ranges, and what the checker says of it; or why there is none. `start` has the
/// multipliers of a word nearby.
pub(super) fn steady(
    scene: &Scene,
    ranges: &[Range],
    word: i64,
    start: Option<[f64; 5]>,
) -> Result<(Witness, Bound), String> {
    let spares = if ranges.is_empty() { &SPARES[..1] } else { &SPARES[1..] };
    let mut slacks = &SLACKS[..];
    let mut why = "no bound of its motion was found".to_string();
    for spare in spares {
        let family = Family::new(scene, ranges, word, *spare)?;
        let Some(found) = family.found(start) else { break };
        let least = family.middle.half * family.middle.half * found.level + found.weights[4];
        if !ranges.is_empty() && least >= SETTLED_COUNTS {
            return Err(format!("the rms is bounded by {:.2} counts", least.sqrt()));
        }
        while let [slack, greater @ ..] = slacks {
            if let Some(witness) = family.witness(word, &found, *slack) {
                match check(scene, ranges, &witness) {
                    Ok(bound) => return Ok((witness, bound)),
                    Err(error) => why = error.to_string(),
                }
                // Greater sums help, and a greater level does not.
                if why == LOOSE && !ranges.is_empty() {
                    break;
                }
            }
            slacks = greater;
        }
    }
    Err(why)
}

/// Searches a bound of a scene's wall over a time in periods of the modulator, from a state at a reading on.
///
/// # Errors
///
/// Returns why none is proved.
pub fn from_state(scene: &Scene, rest: &Rest, periods: f64) -> Result<Window, Error> {
    of_scene(scene)?;
    let word = scene.words()?.stiffness;
    let start = start(scene, word, unit_of(scene), rest)?;
    from_deviation(scene, word, start, periods).map_err(Error::new)
}

/// Searches the same for a word, from a deviation on.
pub(super) fn from_deviation(scene: &Scene, word: i64, start: [Interval; 3], periods: f64) -> Result<Window, String> {
    let family = Family::new(scene, &[], word, 0.0)?;
    let more = family.middle.greatest(start.map(Interval::middle));
    let found = family.found_from(more, None).ok_or("no bound of its motion from the state on was found")?;
    let mut why = "no bound of its motion was found".to_string();
    for slack in SLACKS {
        let Some(witness) = family.witness(word, &found, slack) else { continue };
        match window(scene, &witness, start, periods) {
            Ok(window) => return Ok(window),
            Err(error) => why = error.to_string(),
        }
    }
    Err(why)
}

/// The loops of a word: that at the middle of all ranges, and those at the corners. All have the bounds that hold for
/// each of them.
pub(super) struct Family {
    pub(super) unit: f64,
    pub(super) middle: Sampled,
    pub(super) corners: Vec<Sampled>,
}

impl Family {
    /// Returns the loops of a word, with sums of responses that are greater by this share.
    pub(super) fn new(scene: &Scene, ranges: &[Range], word: i64, spare: f64) -> Result<Self, &'static str> {
        let words = scene.words().map_err(|_| "the checker refuses its words")?;
        let slope = word as f64 * scene.method.stiffness_format.lsb();
        let unit = unit_of(scene);
        let world = |value: &dyn Fn(usize, &Range) -> f64| {
            let mut world = scene.clone();
            let mut all = numbers(&mut world);
            ranges.iter().enumerate().for_each(|(at, range)| *all[range.number] = value(at, range));
            Sampled::of(&world, &words, unit, slope, None)
        };
        let middle = world(&|_, range| 0.5 * (range.ends[0] + range.ends[1]))?;
        let corner = |corner: usize| world(&|at, range| range.ends[corner >> at & 1]);
        let corners = (0..1 << ranges.len()).filter(|_| !ranges.is_empty()).map(corner);
        let mut family = Self { unit, middle, corners: corners.collect::<Result<_, _>>()? };
        family.share(spare);
        Ok(family)
    }

    /// Gives each loop the bounds that hold for all of them.
    pub(super) fn share(&mut self, spare: f64) {
        let mut worst = self.middle.clone();
        let count = self.corners.len().max(1) as f64;
        let mean = self.corners.iter().map(|corner| corner.act).sum::<f64>() / count;
        if !self.corners.is_empty() {
            // The clocks of a pulse at rest are no straight line.
            worst.away += 4.0 * (mean - worst.act).abs();
            self.middle.act = mean;
        }
        for corner in &self.corners {
            let greatest = |into: &mut f64, of: f64| *into = into.max(of);
            worst.sums.iter_mut().flatten().zip(corner.sums.iter().flatten()).for_each(|(a, b)| greatest(a, *b));
            worst.bend.iter_mut().zip(corner.bend).for_each(|(a, b)| greatest(a, b));
            worst.third.iter_mut().zip(corner.third).for_each(|(a, b)| greatest(a, b));
            greatest(&mut worst.jump, corner.jump);
            greatest(&mut worst.reach, corner.reach);
            greatest(&mut worst.coupling, corner.coupling);
            greatest(&mut worst.grip, corner.grip);
            greatest(&mut worst.drag, corner.drag);
            greatest(&mut worst.gain, corner.gain);
            greatest(&mut worst.swing, corner.swing);
            greatest(&mut worst.radius, corner.radius);
        }
        worst.sums.iter_mut().flatten().for_each(|sum| *sum *= 1.0 + spare);
        for one in std::iter::once(&mut self.middle).chain(&mut self.corners) {
            let Sampled { flow, closed, answer, later, act, .. } = one.clone();
            *one = Sampled { flow, closed, answer, later, act, ..worst.clone() };
        }
    }

    /// Returns sizes, level and multipliers, from those of a loop nearby or from a grid on.
    pub(super) fn found(&self, start: Option<[f64; 5]>) -> Option<Found> {
        self.found_from([0.0; 4], start)
    }

    /// Returns the same with sizes that hold from a state on: it adds so much to current, speed, angle and step.
    pub(super) fn found_from(&self, more: [f64; 4], start: Option<[f64; 5]>) -> Option<Found> {
        let middle = &self.middle;
        let sizes = middle.sizes(more)?;
        let far = middle.far(sizes)?;
        let ends = middle.unsteady(middle.entering(sizes).1);
        let all = std::iter::once(middle).chain(&self.corners);
        let dissipations: Vec<Dissipation> = all.map(|one| one.dissipation(sizes, ends)).collect();
        let responses: Vec<Response> = dissipations.iter().flat_map(Dissipation::responses).collect();
        let (level, weights) = middle.least_level(&responses, start)?;
        Some(Found { sizes, far, dissipations, level, weights })
    }

    /// Returns a witness whose level is greater than the least one by this share.
    pub(super) fn witness(&self, word: i64, found: &Found, slack: f64) -> Option<Witness> {
        let level = found.level * (1.0 + slack);
        let mut weights = found.weights;
        weights[4] *= 1.0 + slack;
        let decay = 0.5 * (1.0 + self.middle.radius);
        let share = if self.corners.is_empty() { 0.05 } else { 0.2 };
        let all = std::iter::once(&self.middle).chain(&self.corners).zip(&found.dissipations);
        let matrices = all.map(|(one, dissipation)| {
            Some((one.shape(decay)?, one.storage(dissipation, level, weights, share * slack)?))
        });
        let matrices = matrices.collect::<Option<Vec<_>>>()?;
        let corners = if self.corners.is_empty() { &matrices[..] } else { &matrices[1..] };
        let mean = |sum: f64| sum / corners.len() as f64;
        // By how much the corners at the upper end of a range exceed those at the lower end, over two.
        let turn = |at: usize| {
            let sign = |corner: usize| if corner >> at & 1 == 1 { 1.0 } else { -1.0 };
            let sum = |of: &dyn Fn(usize) -> f64| (0..corners.len()).map(|corner| sign(corner) * of(corner)).sum();
            Turn {
                shape: std::array::from_fn(|cell| mean(sum(&|corner| corners[corner].0[cell]))),
                storage: std::array::from_fn(|cell| mean(sum(&|corner| corners[corner].1[cell]))),
            }
        };
        let [current, speed, angle, _] = self.middle.sums[0];
        Some(Witness {
            word,
            unit: self.unit,
            act: self.middle.act,
            decay,
            scales: [current, speed, angle],
            shape: std::array::from_fn(|cell| mean(corners.iter().map(|corner| corner.0[cell]).sum())),
            sizes: found.sizes,
            far: found.far,
            level,
            weights,
            storage: std::array::from_fn(|cell| mean(corners.iter().map(|corner| corner.1[cell]).sum())),
            turns: (0..corners.len().trailing_zeros() as usize).map(turn).collect(),
        })
    }
}

/// Returns the sum of what states pay that follow one another by a matrix, as a matrix of these states; `None` if they
/// do not die out.
pub(super) fn stored(mut moved: Matrix, paid: Matrix) -> Option<Matrix> {
    let mut stored = paid;
    for _ in 0..60 {
        let size = moved.iter().flatten().fold(0.0, |most: f64, cell| most.max(cell.abs()));
        if size < 1e-12 {
            return Some(stored);
        } else if !size.is_finite() {
            return None;
        }
        stored = sum(&stored, &product(&transposed(&moved), &product(&stored, &moved)));
        moved = product(&moved, &moved);
    }
    None
}

/// Returns a unit of the current that accelerates by about a count in the square of a period.
pub(super) fn unit_of(scene: &Scene) -> f64 {
    let Device::Motor(motor) = &scene.device else { unreachable!("the checker refuses others") };
    let period_s = 2f64.powi(scene.method.pwm.bits.cast_signed()) * scene.clock.period_s();
    motor.inertia_kg_m2() * scene.encoder.count_rad() / (motor.torque_constant_nm_per_a * period_s * period_s)
}

/// The loop of a word from period to period, in the units of [`certify`](crate::certify).
#[derive(Clone)]
pub(super) struct Sampled {
    /// The plant's flow over a period, and that of the loop that its spring closes.
    pub(super) flow: Matrix,
    pub(super) closed: Matrix,
    /// The state at the end of a period by a count of the encoder, and by a clock by which a pulse ends later.
    pub(super) answer: [f64; 3],
    pub(super) later: [f64; 3],
    /// Bounds of the second and the third derivative by that clock.
    pub(super) bend: [f64; 3],
    pub(super) third: [f64; 3],
    pub(super) slope: f64,
    pub(super) half: f64,
    pub(super) act: f64,
    pub(super) away: f64,
    pub(super) radius: f64,
    /// Sums of responses of the states and of the angle's steps: to a count, to a clock and its square, to each state.
    pub(super) sums: [[f64; 4]; 6],
    /// Periods in a sample, commands a count of its difference, and half of what rounding down takes.
    pub(super) sample: f64,
    pub(super) damping: f64,
    pub(super) floor: f64,
    /// Acceleration by a clock of supply, by speed with the current that it drives, by angle, by speed; the ripple's.
    pub(super) jump: f64,
    /// The greatest distance of a command from that at rest while the wall is in contact.
    pub(super) reach: f64,
    pub(super) coupling: f64,
    pub(super) grip: f64,
    pub(super) drag: f64,
    pub(super) gain: f64,
    pub(super) swing: f64,
}

/// The finding of a search: sizes, the level and its multipliers.
pub(super) struct Found {
    pub(super) sizes: [f64; 3],
    pub(super) far: [f64; 3],
    /// That of the middle, then those of the corners.
    pub(super) dissipations: Vec<Dissipation>,
    pub(super) level: f64,
    pub(super) weights: [f64; 5],
}

impl Sampled {
    /// Returns the loop of a scene with the words of another one, with a slope of the staircase in commands a count.
    /// `act` is the pulse at rest, if it is given.
    pub fn of(scene: &Scene, words: &LoopWords, unit: f64, slope: f64, act: Option<f64>) -> Result<Self, Refusal> {
        let Device::Motor(motor) = &scene.device else { unreachable!("the checker refuses others") };
        let period = 2f64.powi(scene.method.pwm.bits.cast_signed());
        let period_s = period * scene.clock.period_s();
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let square = period_s * period_s;
        let count = scene.encoder.count_rad();
        let (decay, induced) = (ohm * period_s / l, k * count / (l * unit));
        let gain = k * unit * square / (j * count);
        let coupling = gain * induced;
        let drag = (motor.viscous_friction_nm_s_per_rad + grip_damping) * period_s / j;
        let grip = grip * square / j;
        let accelerates = |torque: f64| torque * square / (j * count);
        let stall = accelerates(k * scene.bridge.supply_v / ohm);
        let rates = vec![vec![-decay, -induced, 0.0], vec![gain, -drag, -grip], vec![0.0, 1.0, 0.0]];

        let [lsb, rounds] = [scene.method.stiffness_format, scene.method.damping_format].map(|format| format.lsb());
        let damping = words.damping as f64 * rounds;
        let floor = if damping > 0.0 { 0.5 * (1.0 - rounds) } else { 0.0 };
        let half = 0.5 + 0.5 * (1.0 - lsb).max(0.0) / slope;
        let clock = stall / period;
        let at_rest = || match &scene.hand {
            Hand::ConstantTorque { torque_nm } => accelerates(*torque_nm) / clock,
            _ => (slope * (hand_depth(scene) - half) - floor) / (1.0 + slope * clock / grip),
        };
        let act = act.unwrap_or_else(at_rest);
        let latency = 4.0 + f64::from(scene.method.settling);
        if !(act > 0.0 && act < period - latency) {
            return Err("the pulse at rest ends outside of its period");
        }
        // The ripple moves the reading: the checker's bound of that, roughly.
        let swing = 1.01 * stall * ripple(decay, act / period) / (1.0 - coupling / decay - drag - grip);
        let away = if grip > 0.0 { slope * swing / (1.0 + slope * clock / grip) + 1e-6 } else { 1e-6 };

        let flow = exponential(&rates);
        let jump = scene.bridge.supply_v * period_s / (l * unit * period);
        let after = |left: f64| times(&exponential(&scaled(&rates, left / period)), &[jump, 0.0, 0.0]);
        let pushed = after(period - latency - act);
        let further = |x: &[f64; 3]| times(&rates, x).map(|part| -part / period);
        let [later, turned] = [further(&pushed), further(&further(&pushed))];
        let [bend, third] = bends(|share| after(share * period), further);
        let answer = pushed.map(|part| slope * part);
        let mut closed = flow.clone();
        closed.iter_mut().zip(answer).for_each(|(row, part)| row[2] -= part);
        let radius = SampledLoop::of(closed.clone()).spectral_radius();
        if radius.is_nan() || radius > 1.0 - 1e-4 {
            return Err("the linear loop does not settle, or hardly");
        }
        let sums = sums(&closed, [answer, later, turned], radius);
        let counts = 2f64.powi(scene.method.position_bits.cast_signed() - 1) - 1.0;
        let most = (period - latency).min(slope * counts);
        let reach = act.max(most - act) + 2.0 * away;
        let sample = words.period as f64 / period;
        Ok(Self {
            flow,
            closed,
            answer,
            later,
            bend,
            third,
            slope,
            half,
            act,
            away,
            radius,
            sums,
            sample,
            damping,
            floor,
            jump,
            reach,
            coupling,
            grip,
            drag,
            gain,
            swing,
        })
    }

    /// Returns the greatest sizes of current, speed, angle and step on a motion from a state on.
    pub(super) fn greatest(&self, start: [f64; 3]) -> [f64; 4] {
        let (mut most, mut at, mut before) = ([0.0f64; 4], start, start[2]);
        for _ in 0..(25.0 / (1.0 - self.radius)).ceil() as usize {
            let step = at[2] - before;
            most.iter_mut().zip(at.into_iter().chain([step])).for_each(|(most, part)| *most = most.max(part.abs()));
            (before, at) = (at[2], times(&self.closed, &at));
        }
        most.map(|most| most * (1.0 + 1e-6))
    }

    /// Returns the drag and the command's distance from rest at sizes of angle, step and distance between readings.
    pub(super) fn entering(&self, [angle, step, between]: [f64; 3]) -> (f64, f64) {
        let drag = self.damping * (self.sample * step + 2.0 * between + 1.0) + self.floor;
        (drag, self.slope * (angle + self.half) + drag)
    }

    /// Returns the clocks by which pulses end elsewhere by a command, for both parts of their effect.
    pub(super) fn unsteady(&self, push: f64) -> [f64; 2] {
        [0.5 * push + self.away, 0.5 * (push * push / 3.0 + (push + self.away) * self.away)]
    }

    /// Returns the sizes that follow from sizes, where so much is added to current, speed, angle and step.
    pub(super) fn follow(&self, sizes: [f64; 3], more: [f64; 4]) -> [f64; 3] {
        let (drag, push) = self.entering(sizes);
        let [late, square] = self.unsteady(push);
        let cube = (push.powi(3) / 4.0 + 1.5 * (push + self.away).powi(2) * self.away) / 6.0;
        let [current, speed, angle, step] = std::array::from_fn(|state| {
            let ends: f64 = (0..3).map(|axis| cube * self.third[axis] * self.sums[3 + axis][state]).sum();
            let entering = self.half + drag / self.slope;
            let late = late * self.sums[1][state] + square * self.sums[2][state];
            entering * self.sums[0][state] + push * (late + ends) + more[state]
        });
        let driven = self.gain * (current + push * self.jump);
        let fastest = (speed + driven + self.grip * angle) / (1.0 - self.coupling - self.grip);
        let pulled = self.drag * fastest + self.grip * (angle + fastest);
        [angle, step, (driven + self.coupling * fastest + pulled + self.swing) / 8.0]
    }

    /// Returns the sizes of the motion, if they are found. So much is added to current, speed, angle and step.
    pub(super) fn sizes(&self, more: [f64; 4]) -> Option<[f64; 3]> {
        let mut sizes = [0.0; 3];
        for _ in 0..4000 {
            let next = self.follow(sizes, more);
            if next.iter().any(|size| *size > 1e6) {
                return None;
            }
            if next.iter().zip(sizes).all(|(next, size)| *next <= size * (1.0 + 1e-9)) {
                return Some(next.map(|size| size * (1.0 + 1e-4)));
            }
            sizes = next;
        }
        None
    }

    /// Returns sizes above these at which contact ends and from which the motion still shrinks, if there are any.
    pub(super) fn far(&self, sizes: [f64; 3]) -> Option<[f64; 3]> {
        let mut far = sizes;
        for _ in 0..1000 {
            let [_, step, between] = self.follow(far, [0.0; 4]).map(|size| size * 1.001);
            let (drag, _) = self.entering([0.0, step, between]);
            let angle = (self.reach - drag) / self.slope - self.half;
            let next = [angle, step, between];
            let is_done = next.iter().zip(far).all(|(next, far)| (next - far).abs() <= 1e-6 * far);
            far = next;
            if is_done {
                let angle = angle * (1.0 + 1e-6);
                return Some([angle, 1.001 * step, 1.001 * between])
                    .filter(|far| far.iter().zip(sizes).all(|(f, s)| *f >= s));
            }
        }
        None
    }

    /// Returns the dissipation at these sizes, with these two bounds of the pulse's end.
    pub(super) fn dissipation(&self, [_, step, between]: [f64; 3], [late, square]: [f64; 2]) -> Dissipation {
        let share = self.damping / self.slope;
        let rounding = share * (1.0 + 2.0 * between) + self.floor / self.slope;
        let steps = share * self.sample;
        let read = [0.0, 0.0, 1.0 + steps, -steps, 1.0, 0.0, 0.0, 0.0, 0.0, rounding, share];
        let mut next = [[0.0; 11]; 4];
        for row in 0..3 {
            next[row] = read.map(|part| -self.answer[row] * part);
            (0..3).for_each(|of| next[row][of] += self.flow[row][of]);
            next[row][5] = -self.later[row] * late * self.slope;
            next[row][6 + row] = square * self.bend[row] * self.slope;
        }
        next[3][2] = 1.0;
        let mut bent = next[2];
        bent[2] -= 2.0;
        bent[3] += 1.0;
        let less = self.sample - 1.0;
        let gain = self.sample * self.sample * (self.sample * self.sample + self.sample + less * less / 8.0);
        let entering = self.half + self.entering([0.0, step, between]).0 / self.slope;
        Dissipation { next, read, bent, gain, entering }
    }

    /// Returns `W`'s upper triangle: the solution of the Riccati equation, by Newton's method.
    pub(super) fn storage(&self, of: &Dissipation, level: f64, weights: [f64; 5], spare: f64) -> Option<[f64; 10]> {
        let [climb, first, other, stale, noise] = weights;
        let both = first + 3.0 * other;
        let mut all = vec![vec![0.0; 11]; 11];
        let mut add = |by: f64, one: &Row, two: &Row| {
            for (cells, left) in all.iter_mut().zip(one) {
                cells.iter_mut().zip(two).for_each(|(cell, right)| *cell += by * left * right);
            }
        };
        add(1.0, &ANGLE, &ANGLE);
        add(0.5 * climb, &KEPT, &CLIMBS);
        add(0.5 * climb, &CLIMBS, &KEPT);
        add(both, &of.read, &of.read);
        add(stale * of.gain, &of.bent, &of.bent);
        // A small share of the level for what the checker's intervals need.
        for (state, sizes) in [0, 1, 2, 2].into_iter().enumerate() {
            let size = of.entering * self.sums[0][sizes];
            all[state][state] += spare * level / (size * size);
        }
        for (at, own) in [level, first, other, other, other, noise, stale].into_iter().enumerate() {
            all[4 + at][4 + at] -= own * (1.0 - spare);
        }
        // The worst inputs of the storage so far, as rows by states; a storage under them; and again.
        let next: Matrix = of.next.iter().map(|row| row.to_vec()).collect();
        let mut inputs = vec![vec![0.0; 4]; 7];
        let (mut storage, mut last) = (vec![vec![0.0; 4]; 4], f64::INFINITY);
        for _ in 0..MOST_STEPS {
            let unit = |row: usize| (0..4).map(|of| f64::from(u8::from(row == of))).collect::<Vec<f64>>();
            let under: Matrix = (0..4).map(unit).chain(inputs.iter().cloned()).collect();
            let moved = product(&next, &under);
            let paid = product(&transposed(&under), &product(&all, &under));
            let before = std::mem::replace(&mut storage, stored(moved, paid)?);
            let size = |a: &Matrix| a.iter().flatten().fold(0.0, |most: f64, cell| most.max(cell.abs()));
            let change = size(&sum(&storage, &scaled(&before, -1.0))) / size(&storage);
            // Rounding ends the steps before they end themselves.
            if change <= 1e-12 || (change < 1e-6 && change > 0.5 * last) {
                return Some(std::array::from_fn(|index| {
                    let [row, of] = UPPER[index];
                    0.5 * (storage[row][of] + storage[of][row])
                }));
            }
            last = change;
            let kept = sum(&all, &product(&transposed(&next), &product(&storage, &next)));
            let scales: Vec<f64> = (4..11).map(|at| kept[at][at].abs().sqrt().recip()).collect();
            let own = (0..7).map(|row| (0..7).map(|of| kept[4 + row][4 + of] * scales[row] * scales[of]).collect());
            let own = inverse(&own.collect())?;
            let crossed: Matrix =
                (0..7).map(|row| kept[4 + row][..4].iter().map(|x| -x * scales[row]).collect()).collect();
            inputs = product(&own, &crossed);
            inputs.iter_mut().zip(&scales).for_each(|(row, scale)| row.iter_mut().for_each(|cell| *cell *= scale));
        }
        None
    }

    /// Returns `P`'s upper triangle: the solution of Lyapunov's equation, at least the identity.
    pub(super) fn shape(&self, decay: f64) -> Option<[f64; 6]> {
        let mut power = scaled(&self.closed, 1.0 / decay);
        let mut shape = vec![vec![0.0; 3]; 3];
        for (state, row) in shape.iter_mut().enumerate() {
            row[state] = 1.0 / self.sums[0][state].powi(2);
        }
        for _ in 0..60 {
            shape = sum(&shape, &product(&transposed(&power), &product(&shape, &power)));
            power = product(&power, &power);
        }
        let shape = scaled(&shape, 1.01);
        let upper =
            UPPER.into_iter().filter(|[_, of]| *of < 3).map(|[row, of]| 0.5 * (shape[row][of] + shape[of][row]));
        upper.collect::<Vec<f64>>().try_into().ok()
    }

    /// Returns the least bound's level over the multipliers, and the multipliers: along one of them after the other.
    pub(super) fn least_level(&self, responses: &[Response], start: Option<[f64; 5]>) -> Option<(f64, [f64; 5])> {
        const SPARSE: usize = 4;
        const DRAGS: [[f64; 2]; 5] = [[-0.5, -1.0], [-0.5, 0.0], [1.0, -1.0], [1.0, 0.0], [2.5, 1.0]];
        let level = |logs: [f64; 5], every: usize| {
            let weights = logs.map(libm::exp);
            responses.iter().step_by(every).fold(0.0, |most: f64, at| most.max(at.level(weights)))
        };
        let square = |logs: [f64; 5]| self.half * self.half * level(logs, SPARSE) + libm::exp(logs[4]);
        let axes = if self.damping > 0.0 { 5 } else { 3 };
        let mut best = start.map_or(([0.0; 5], f64::INFINITY), |start| {
            let logs = start.map(libm::log);
            (logs, square(logs))
        });
        if best.1.is_infinite() {
            // Multipliers of a drag that is none are next to none.
            let drags: &[[f64; 2]] = if self.damping > 0.0 { &DRAGS } else { &[[-25.0; 2]] };
            for climb in -4..14 {
                for end in [-2.0, -5.0, -8.0, -11.0] {
                    for [stale, noise] in drags {
                        let logs = [f64::from(climb), end, end - 3.0, *stale, *noise];
                        let found = square(logs);
                        if found < best.1 {
                            best = (logs, found);
                        }
                    }
                }
            }
        }
        let steps: &[f64] = if start.is_some() { &[0.3, 0.1, 0.05] } else { &[1.5, 0.5, 0.2, 0.1, 0.05] };
        for step in steps {
            for axis in (0..axes).chain(0..axes) {
                let along = |by: f64| {
                    let mut logs = best.0;
                    logs[axis] += by;
                    (logs, square(logs))
                };
                // Golden section over a step to both sides.
                let (mut low, mut high) = (-step, *step);
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
        let least = level(best.0, 1);
        least.is_finite().then(|| (least, best.0.map(libm::exp)))
    }
}

/// Returns the depth behind the wall's surface, in counts, at which a hand with a spring comes to rest by itself.
pub(super) fn hand_depth(scene: &Scene) -> f64 {
    let Hand::SpringDamper { path, .. } = &scene.hand else { unreachable!("the checker refuses others") };
    path.last().map_or(0.0, |end| end.angle_rad) / scene.encoder.count_rad() - scene.wall_count() as f64
}

/// Returns the greatest distance of a winding's current from its mean, as a share of the stalled one, over a period
/// with this duty.
pub(super) fn ripple(decay: f64, duty: f64) -> f64 {
    let high = (1.0 - libm::exp(-decay * duty)) / (1.0 - libm::exp(-decay));
    (high - duty).max(duty - high * libm::exp(-decay * (1.0 - duty)))
}

/// Returns bounds of the second and third derivatives of a pulse's answer by its end, roughly: `after` is the answer to
/// a pulse that ended a share of the period ago, and `further` its derivative.
pub(super) fn bends(after: impl Fn(f64) -> [f64; 3], further: impl Fn(&[f64; 3]) -> [f64; 3]) -> [[f64; 3]; 2] {
    let (mut bend, mut third) = ([0.0f64; 3], [0.0f64; 3]);
    for part in 0..=64 {
        let twice = further(&further(&after(f64::from(part) / 64.0)));
        let thrice = further(&twice);
        for state in 0..3 {
            bend[state] = bend[state].max(1.05 * twice[state].abs());
            third[state] = third[state].max(1.05 * thrice[state].abs());
        }
    }
    [bend, third]
}

/// Returns the sums of sizes of the responses of a closed loop to these starts, and to each state: of each state, and
/// of the steps of the last one.
pub(super) fn sums(closed: &Matrix, starts: [[f64; 3]; 3], radius: f64) -> [[f64; 4]; 6] {
    let unit = |at: usize| std::array::from_fn(|state| f64::from(u8::from(state == at)));
    let mut sums = [[0.0; 4]; 6];
    for (sums, mut at) in sums.iter_mut().zip(starts.into_iter().chain([0, 1, 2].map(unit))) {
        let periods = (25.0 / (1.0 - radius)).ceil() as usize;
        let mut before = 0.0;
        for _ in 0..periods {
            let step = at[2] - before;
            for (sum, part) in sums.iter_mut().zip(at.into_iter().chain([step])) {
                *sum += part.abs();
            }
            before = at[2];
            at = times(closed, &at);
        }
    }
    sums
}

/// Places of an upper triangle of 4 rows.
pub(super) const UPPER: [[usize; 2]; 10] =
    [[0, 0], [0, 1], [0, 2], [0, 3], [1, 1], [1, 2], [1, 3], [2, 2], [2, 3], [3, 3]];
