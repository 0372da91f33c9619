//! A bound of the rms over a window that begins with a known state.
//!
//! The checker's bound is that of the long run: it holds once the start has died out, for a motion in contact. From a
//! state on, three things are added, for a wall without damping.
//!
//! 1. The deviation `x` from the periodic motion of the command at rest is computed from the state, at an edge at which
//!    the modulator reads the encoder. A period leaves that motion as it is, and its command is that of its own angle:
//!    Newton's method in intervals.
//! 2. What `x` adds to the sizes of the motion is computed period by period. With it, the sizes of the witness have to
//!    follow from themselves, so they hold from the state on. The greatest command that they allow ends no contact and
//!    is less than the full one. So the wall stays in contact for ever.
//! 3. The checker's inequality is summed over the readings of the window. The sum of `y²` is at most `λ e²` a reading,
//!    and `h U(y₋) + x' W x` at the start, less the same at the end. `U` is the potential of the staircase, whose least
//!    value is 0. As `q` is within `H` of `y`, `U(y) <= (|y| + H)²/2`, and `U(y) >= (|y| - H)²/2` beyond `H`. The angle
//!    `y₋` before the first reading enters the inequality alone, so it may be any number. At the end, `h U + x' W x` is
//!    at least `-h s H²/(2 (1 - s))` if `W` with `h s/2` more for the square of its last state is positive definite.

use std::array::from_fn;
use std::f64::consts::PI;

use hpu_cosim::Rest;
use hpu_cosim::scene::{Encoder, Scene};

use super::{Bound, Inside, Plant, Witness, inspect};
use crate::Error;
use crate::form::Form;
use crate::interval::Interval;
use crate::sampled::solution;
use crate::square::{Square, exponential, is_positive, symmetric};

/// Shares `s` of the staircase's potential at the end of a window that are tried.
const SHARES: [f64; 6] = [0.0, 0.25, 0.5, 0.75, 0.9, 0.99];
/// The refusal of a wall with damping.
const DAMPED: &str = "the drag of its damping depends on the motion before";
/// The longest window, in periods.
const LONGEST: f64 = 1e12;

/// The bounds that are proved of a wall from a state on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Window {
    /// Bound of the rms of the angle about its rest, over the window, in counts.
    pub rms_counts: f64,
    /// Bound of the angle's distance from its rest from the state on, for ever, in counts.
    pub half_range_counts: f64,
    /// The bounds of the long run.
    pub long_run: Bound,
}

/// A vector or a matrix of the loop's three states.
type State = [Interval; 3];
type Flow = [State; 3];

/// Returns the clocks until the modulator next reads the encoder, from outputs that last until a pulse begins.
///
/// # Errors
///
/// Returns why the scene has no such proof, or that the pulse before has not ended where the modulator reads.
pub fn until_read(scene: &Scene, rest: &Rest) -> Result<u64, Error> {
    let plant = Plant::<0>::of(scene, [], 1.0)?;
    let (period, latency) = (plant.period as u64, plant.latency as u64);
    let begins: u64 = rest.lead.iter().map(|(_, clocks)| clocks).sum();
    Ok(begins.checked_sub(latency).unwrap_or(begins + period - latency))
}

/// Returns the deviation of current, speed and angle from the periodic motion of the command at rest, in the units of a
/// witness of this word with this unit of the current. The state is that at an edge at which the modulator reads the
/// encoder: no pulse is on, and the next begins when the reading has passed through all registers.
///
/// # Errors
///
/// Returns why the scene has no such proof, or why none begins with this state.
pub fn start(scene: &Scene, word: i64, unit: f64, rest: &Rest) -> Result<[Interval; 3], Error> {
    let exact = Interval::exact;
    let plant = Plant::<0>::of(scene, [], unit)?;
    let Encoder::Rotary { lines } = &scene.encoder else { return Err("the encoder is not on a shaft".into()) };
    let Ok([depth, _]) = plant.hand else { return Err("no hand's spring brings the device to rest".into()) };
    if plant.damping > 0.0 {
        return Err(DAMPED.into());
    }
    let off: u64 = rest.lead.iter().map(|(_, clocks)| clocks).sum();
    let is_off = rest.lead.iter().all(|(share, _)| *share == 0.0) && off as f64 == plant.latency;
    if !(is_off && rest.cycle.first().is_some_and(|(share, _)| *share == -1.0)) {
        return Err("the modulator does not read the encoder at this edge".into());
    }
    if scene.hand.path().last().map_or(0.0, |(_, angle_rad)| *angle_rad) != rest.standing.intent_rad {
        return Err("the hand is not where its path ends".into());
    }
    let (slope, half) = stair(scene, word);
    let periodic = plant.periodic(slope, half)?;
    let count = Interval { lo: PI, hi: PI.next_up() }.over(2.0 * f64::from(*lines));
    let period_s = exact(plant.period).over(scene.clock.frequency_hz() as f64);
    let at = &rest.standing;
    let behind = exact(at.angle_rad).divided(count).minus(exact(scene.wall_count() as f64)).minus(depth.all());
    let state = [exact(at.current_a).over(unit), exact(at.speed_rad_per_s).times(period_s).divided(count), behind];
    Ok(from_fn(|at| state[at].minus(periodic[at])))
}

/// Returns a word in commands a count, and the greatest distance of a command from it, in counts.
fn stair(scene: &Scene, word: i64) -> (f64, f64) {
    let lsb = 2f64.powi(-scene.method.stiffness_format.frac());
    let slope = word as f64 * lsb;
    (slope, Interval::exact(0.5).plus(Interval::exact(0.5 * (1.0 - lsb).max(0.0)).over(slope)).hi)
}

impl Plant<0> {
    /// Returns what a motion of these sizes of current, speed, angle and step adds to the angle, to its step and to its
    /// distance from the straight line between readings.
    fn added(&self, [current, speed, angle, step]: [Interval; 4]) -> State {
        let driven = self.gain.times(current);
        let apart = Interval::exact(1.0).minus(self.coupling.plus(self.grip));
        let fastest = speed.plus(driven).plus(self.grip.times(angle)).divided(apart);
        let pulled = self.drag.times(fastest).plus(self.grip.times(angle.plus(fastest)));
        [angle, step, driven.plus(self.coupling.times(fastest)).plus(pulled).over(8.0)]
    }

    /// Returns current, speed and angle of the periodic motion of the command at rest, where the modulator reads: the
    /// angle from where the hand intends to be.
    fn periodic(&self, slope: f64, half: f64) -> Result<State, Error> {
        let (exact, none) = (Interval::exact, Interval::ZERO);
        let Ok([depth, _]) = self.hand else { return Err("no hand's spring brings the device to rest".into()) };
        let part = |clocks: Interval| Form::of(clocks.over(self.period));
        let push = self.jump.times(Form::exact(self.period)).negative();
        let kept: Flow = self.flow(Form::exact(1.0)).map(|row| row.map(Form::all));
        let left: Flow = from_fn(|row| from_fn(|of| exact(f64::from(u8::from(row == of))).minus(kept[row][of])));
        let times = |a: &Flow, x: &State| -> State {
            from_fn(|row| (0..3).fold(none, |sum, of| sum.plus(a[row][of].times(x[of]))))
        };
        // What a pulse that begins with the period's first clocks leaves at its end, and a clock of supply there.
        let after = |clocks: Interval| -> Flow {
            let rest = exact(self.period - self.latency).minus(clocks);
            self.flow(part(rest)).map(|row| row.map(Form::all))
        };
        let pulse = |clocks: Interval| -> State {
            let mut rates: Square<4, 0> = [[Form::ZERO; 4]; 4];
            for (row, own) in self.rates.iter().enumerate() {
                (0..3).for_each(|of| rates[row][of] = own[of].times(part(clocks)));
            }
            rates[0][3] = push.times(part(clocks));
            let flow = exponential(&rates);
            times(&after(clocks), &from_fn(|state| flow[state][3].all()))
        };
        let mut command = self.rest(slope, half)?.0.all();
        for _ in 0..4 {
            let middle = exact(command.middle());
            let (at, clock) = (solved(&left, pulse(middle))?, times(&after(command), &[push.all(), none, none]));
            let by = solved(&left, clock.map(|part| part.over(self.period)))?;
            let misses = middle.minus(exact(slope).times(at[2].plus(depth.all()).minus(exact(half))));
            let slopes = exact(1.0).minus(exact(slope).times(by[2]));
            // A number that is none proves nothing.
            if !(slopes.lo > 0.0 && misses.size().is_finite()) {
                return Err("the command at rest is not enclosed".into());
            }
            let newer = middle.minus(misses.divided(slopes));
            command = newer.common(command).ok_or("the command at rest is not enclosed")?;
            if command.width() < 1e-6 {
                let off = command.minus(middle);
                return Ok(from_fn(|state| at[state].plus(by[state].times(off))));
            }
        }
        Err("the command at rest is not enclosed".into())
    }
}

/// Returns the solution of a system of equations with these rows: a matrix near its inverse bounds what is left.
fn solved(rows: &Flow, right: State) -> Result<State, Error> {
    let exact = Interval::exact;
    let column = |right: [f64; 3]| -> Result<Vec<f64>, Error> {
        let with = |row: usize| rows[row].iter().map(|cell| cell.middle()).chain([right[row]]).collect();
        Ok(solution((0..3).map(with).collect()).ok_or("the motion has no periodic one")?)
    };
    let unit = |at: usize| column(from_fn(|row| f64::from(u8::from(row == at))));
    let inverse = [unit(0)?, unit(1)?, unit(2)?];
    let near = column(right.map(Interval::middle))?;
    let dot =
        |row: usize, x: &State| (0..3).fold(Interval::ZERO, |sum, of| sum.plus(exact(inverse[of][row]).times(x[of])));
    let residue: State =
        from_fn(|row| (0..3).fold(right[row], |sum, of| sum.minus(rows[row][of].times(exact(near[of])))));
    // The inverse times the rows is the identity but for this, in the norm of the greatest sum along a row.
    let off = (0..3).fold(0.0, |most: f64, row| {
        let cell =
            |of: usize| exact(f64::from(u8::from(row == of))).minus(dot(row, &from_fn(|by| rows[by][of]))).size();
        most.max((0..3).fold(0.0, |sum: f64, of| (sum + cell(of)).next_up()))
    });
    let moved = (0..3).fold(0.0, |most: f64, row| most.max(dot(row, &residue).size()));
    if !(off < 0.5 && moved.is_finite()) {
        return Err("the motion has no periodic one".into());
    }
    let far = exact(moved).divided(exact(1.0).minus(exact(off))).hi;
    Ok(from_fn(|state| exact(near[state]).plus(Interval { lo: -far, hi: far })))
}

/// Proves bounds over a time in periods of the modulator from a state on, given as its [deviation](start).
///
/// # Errors
///
/// Returns what of the witness does not hold, or does not hold from this state on.
pub fn window(scene: &Scene, witness: &Witness, start: [Interval; 3], periods: f64) -> Result<Window, Error> {
    let exact = Interval::exact;
    let Inside { bound, plant, responses, followed, push, rest, most, half, .. } = inspect::<0>(scene, [], witness)?;
    if plant.damping > 0.0 {
        return Err(DAMPED.into());
    } else if !(1.0..=LONGEST).contains(&periods) || witness.level < 0.0 {
        return Err("its numbers have no sense".into());
    }
    // 2. The sizes hold from the state on, and the wall stays in contact.
    let more = plant.added(responses.greatest(start.map(Form::of))?.map(exact));
    let mut all = followed.into_iter().zip(more).zip(witness.sizes);
    if !all.all(|((followed, more), size)| exact(followed).plus(more).hi <= size) {
        return Err("its sizes do not hold from the state on".into());
    }
    if push.hi >= rest.all().lo || push.hi >= exact(most).minus(rest.all()).lo {
        return Err("the wall may lose contact, or reach its full command".into());
    }
    // 3. What enters, and what is stored at the start and at the end.
    let (staircase, half) = (exact(witness.weights[0]), exact(half));
    let storage: Square<4, 0> = symmetric(&witness.storage.map(Form::exact));
    let end = at_end(&storage, staircase, half).ok_or("what is stored has no least value")?;
    let begin = exact(at_start(&storage, staircase, half, start));
    let entering = half.times(half).times(exact(witness.level));
    // The straight lines between readings have at most the sum of all squares, also of the reading at the end.
    let readings = exact(periods.ceil() + 1.0);
    let sum = entering.times(readings).plus(begin).minus(end);
    let mean = sum.over(periods).hi.max(0.0);
    let rms_counts = exact(mean.sqrt().next_up()).plus(exact(witness.sizes[2])).hi;
    if !rms_counts.is_finite() {
        return Err("its numbers have no sense".into());
    }
    Ok(Window { rms_counts, half_range_counts: bound.half_range_counts, long_run: bound })
}

/// Returns a bound of what is stored in a state of the loop, by the potential and by the storage, with the best angle
/// before it.
fn at_start(storage: &Square<4, 0>, staircase: Interval, half: Interval, start: State) -> f64 {
    let stored = |before: f64| -> Interval {
        let state = [start[0], start[1], start[2], Interval::exact(before)];
        let high = Interval::exact(before.abs()).plus(half);
        let potential = staircase.times(high).times(high).scaled(0.5);
        (0..16).fold(potential, |sum, at| {
            let (row, of) = (at / 4, at % 4);
            sum.plus(storage[row][of].all().times(state[row]).times(state[of]))
        })
    };
    let far = 2.0 * start[2].size() + half.hi;
    (-32..=32).map(|part| stored(far * f64::from(part) / 32.0).hi).fold(f64::INFINITY, f64::min)
}

/// Returns a bound below what is stored in any state, by the potential and by the storage; `None` if none is found.
fn at_end(storage: &Square<4, 0>, staircase: Interval, half: Interval) -> Option<Interval> {
    let (exact, one) = (Interval::exact, Interval::exact(1.0));
    let is_least = |share: &&f64| {
        let mut held = *storage;
        held[3][3] = held[3][3].plus(Form::of(staircase.scaled(0.5).times(exact(**share))));
        is_positive(&held)
    };
    let share = exact(*SHARES.iter().find(is_least)?);
    let taken = staircase.times(share).times(half.times(half)).divided(one.minus(share).scaled(2.0));
    Some(Interval::ZERO.minus(taken))
}

#[cfg(test)]
mod tests;
