//! The checker of certificates: a wall settles at every phase of its contact, for ever.
//!
//! It makes its own matrices from the scene and shares no code with the search but intervals and the scene's reader.
//!
//! Time is in periods of the modulator, angles in counts, and a current in the acceleration of its torque. A period
//! begins where the modulator reads the encoder. The deviation `x` from the periodic motion of a constant command `c0`
//! then obeys `x+ = Φ x + ∫F(t) dt`, from `c0` to the command `c`. `F(t)` is what a clock of supply leaves at the end
//! of the period if the pulse ends at clock `t`. With `u = c - c0` the integral is `u` times the mean of
//! `F(a) + (t - a) F'(a) + (t - a)²/2 F''(s)`, or with `F''(a)` and a third derivative. With the angle `y`, the command
//! is `u = -k q - d`. There `q = y + e` with `|e| <= H` is a function of `y` that never falls. The drag `d` is a gain
//! times a difference of two counts, rounded down: they lie a sample of `T` periods apart, the later one at most a
//! sample ago.
//!
//! 1. `x' P x` falls by `decay²` from period to period without drag, so the sums of the responses' sizes are bounded.
//! 2. By these sums, sizes `Y` of the angle, of its step in a period and of its distance from the straight line between
//!    readings give sizes `f(Y)`. As `f` is convex, `f(Y) <= Y`, and `f(L) < L` for an `L` at which contact ends, no
//!    motion in contact stays beyond `Y`. The straight line errs by an eighth of the acceleration.
//! 3. Of straight lines, the difference is `T` times the latest step, and `s`. A change of speed by `z` is missing in
//!    it until a sample is read, and then in a part. So the sum of `s²` is at most that of `γ² z²`, with
//!    `γ² = T² (T² + T + (T - 1)²/8)` at every phase of the samples. The rest of `d` is rounding.
//! 4. `x' W x` and the convex potential of the staircase store what enters: the sum of `y² + h q (y - y-)` is at most
//!    that of `λ e²` and of a constant for the drag's rounding. The sum of `q (y - y-)` is at least a constant.

mod text;

use std::array::from_fn;
use std::f64::consts::PI;

use hpu_cosim::scene::{BridgeModel, Datapath, Device, Encoder, EncoderModel, Friction, Hand, Loop, Scene, Winding};

pub use text::{Bound, CLAIM, Checked, Witness, certify, set};

use crate::Error;
use crate::interval::Interval;
use crate::square::{Square, exponential, is_positive, negative, product, symmetric, times, transposed};

type Vector = [Interval; 3];

/// Greatest number of periods over which responses are summed one by one.
const MOST_PERIODS: usize = 200_000;
/// States of the storage, and what enters.
const INPUTS: usize = 11;
/// Greatest size of a number of a witness.
const GREATEST: f64 = 1e15;

/// Motor, hand and modulator of a scene. All numbers are those of scaled states.
struct Plant {
    rates: Square<3>,
    /// Acceleration by a full supply at standstill, and by a clock of it.
    stall: Interval,
    jump: Interval,
    /// Acceleration per unit of angle and of speed; of speed with the current that it drives, too.
    grip: Interval,
    drag: Interval,
    coupling: Interval,
    decay: Interval,
    /// Clocks of the period, and those from the encoder's lines to the modulator.
    period: f64,
    latency: f64,
    /// Where the hand intends to be behind the wall's surface, or the acceleration by its torque.
    depth: Option<Interval>,
    push: Interval,
    /// Greatest count behind the surface that the position counter holds, and greatest difference of a sample.
    most: f64,
    most_turns: f64,
    /// Periods of the modulator in a sample, commands a count of difference, and half of what rounding down takes.
    sample: Interval,
    damping: f64,
    floor: f64,
}

impl Plant {
    fn of(scene: &Scene) -> Result<Self, Error> {
        let (Device::Motor(motor), Encoder::Rotary { lines }) = (&scene.device, &scene.encoder) else {
            return Err("the device is no motor with an encoder on its shaft".into());
        };
        let (model, pwm, words) = (&scene.model, &scene.method.pwm, scene.words()?);
        let rubs = motor.coulomb_friction_nm > 0.0 && model.friction != Friction::None;
        let other_model = !model.solver.is_exact() || model.winding != Winding::Inductive;
        let refused = [
            (scene.network.is_some(), "the device is a network, or has a second encoder"),
            (scene.method.kind != Loop::Hybrid, "its spring is sampled, or its law is no plain spring"),
            (model.datapath != Datapath::Words, "its law is not computed in words"),
            (model.encoder != EncoderModel::Quantised, "its law reads no encoder's lines clock by clock"),
            (model.bridge != BridgeModel::Switching, "its bridge is averaged"),
            (other_model, "its solver takes steps, or its winding has no inductance"),
            (!pwm.latched, "its modulator takes a command at once, where the pulse ends"),
            (pwm.antiphase, "its modulator drives both legs in opposite phase"),
            (pwm.floating || pwm.dead_time_s > 0.0, "its bridge opens the winding for a part of the period"),
            (rubs, "the device has Coulomb friction"),
            (scene.faults.is_some(), "its faults change the loop"),
            (scene.wall.ramp.is_some() || scene.target.is_some(), "its wall changes during the run"),
            (scene.method.shaper_hz.is_some() || scene.host_clocks > 0, "a filter or a host is in its loop"),
            (words.damping != 0 && scene.method.reference_rate_hz.is_some(), "its velocity is scaled"),
            (words.damping != 0 && !scene.method.saturate, "a product of its damping wraps"),
        ];
        if let Some((_, why)) = refused.iter().find(|(is, _)| *is) {
            return Err(Error::new(why));
        }
        let number = Interval::exact;
        let period = 2f64.powi(pwm.bits.cast_signed());
        let period_s = number(period).over(scene.clock.frequency_hz() as f64);
        let square = period_s.times(period_s);
        let ratio = number(motor.wheel_ratio).times(number(motor.wheel_ratio));
        let inertia = number(motor.rotor_inertia_kg_m2).plus(number(motor.wheel_inertia_kg_m2).divided(ratio));
        let ohm = number(motor.resistance_ohm).plus(number(2.0 * scene.bridge.on_resistance_ohm));
        let (l, k) = (number(motor.inductance_h), number(motor.torque_constant_nm_per_a));
        let count = Interval { lo: PI, hi: PI.next_up() }.over(2.0 * f64::from(*lines));
        let accelerates = |torque: Interval| torque.times(square).divided(inertia.times(count));
        let (grip_nm_per_rad, grip_damping) = scene.hand.grip();
        let drag = number(motor.viscous_friction_nm_s_per_rad).plus(number(grip_damping));
        let (grip, drag) =
            (number(grip_nm_per_rad).times(square).divided(inertia), drag.times(period_s).divided(inertia));
        let (decay, coupling) = (ohm.times(period_s).divided(l), k.times(k).times(square).divided(l.times(inertia)));
        let stall = accelerates(k.times(number(scene.bridge.supply_v)).divided(ohm));
        let surface = number(scene.wall_count() as f64);
        let (depth, push) = match &scene.hand {
            Hand::SpringDamper { path, .. } if grip.lo > 0.0 => {
                let end = number(path.last().map_or(0.0, |point| point.angle_rad)).divided(count);
                (Some(end.plus(negative(surface))), Interval::ZERO)
            }
            Hand::ConstantTorque { torque_nm } => (None, accelerates(number(*torque_nm))),
            _ => return Err("no hand holds the device against the wall".into()),
        };
        let (one, none) = (number(1.0), Interval::ZERO);
        let most = |bits: u32| 2f64.powi(bits.cast_signed() - 1) - 1.0;
        let lsb = 2f64.powi(-scene.method.damping_format.frac());
        let damping = words.damping as f64 * lsb;
        let electrical = [negative(decay), negative(coupling), none];
        Ok(Self {
            rates: [electrical, [one, negative(drag), negative(grip)], [none, one, none]],
            stall,
            jump: stall.times(decay).over(period),
            grip,
            drag,
            coupling,
            decay,
            period,
            latency: 4.0 + f64::from(scene.method.settling),
            depth,
            push,
            most: most(scene.method.position_bits),
            most_turns: most(scene.method.position_bits.min(scene.method.velocity_bits)).min((period - 2.0) / damping),
            sample: number(words.period as f64).over(period),
            damping,
            floor: if damping > 0.0 { 0.5 * (1.0 - lsb) } else { 0.0 },
        })
    }

    /// Returns the flow over a time in periods.
    fn flow(&self, time: Interval) -> Square<3> {
        exponential(&self.rates.map(|row| row.map(|rate| rate.times(time))))
    }

    /// Returns the clocks of a pulse at rest, and a bound of the acceleration in the periodic motion.
    fn rest(&self, slope: f64, half: f64) -> Result<(Interval, f64), Error> {
        let (number, one, stall) = (Interval::exact, Interval::exact(1.0), self.stall.over(self.period));
        let apart = one.plus(negative(self.coupling.divided(self.decay).plus(self.drag).plus(self.grip)));
        if apart.lo <= 0.0 || self.coupling.plus(self.grip).hi >= 1.0 {
            return Err("its modulator is too slow for its motor".into());
        }
        let command = |off: f64| match self.depth {
            None => self.push.divided(stall),
            Some(depth) => {
                let behind = depth.plus(number(-half)).plus(Interval { lo: -off, hi: off });
                let held = behind.times(number(slope)).plus(number(-self.floor));
                held.divided(one.plus(number(slope).times(stall).divided(self.grip)))
            }
        };
        // The current's distance from its mean, as a share of the greatest: all of it at first, then by the pulses.
        let mut acceleration = self.stall.divided(apart).hi;
        for _ in 0..2 {
            let duty = command(acceleration).over(self.period);
            if duty.lo <= 0.0 || duty.hi >= 1.0 {
                return Err("the wall does not hold the hand by a part of its full command".into());
            }
            let fall = |time: Interval| exponential(&[[negative(self.decay.times(time))]])[0][0];
            let high = one.plus(negative(fall(duty))).divided(one.plus(negative(fall(one))));
            let low = high.times(fall(one.plus(negative(duty))));
            let share = high.plus(negative(duty)).hi.max(duty.plus(negative(low)).hi).min(1.0);
            acceleration = self.stall.times(number(share)).divided(apart).hi;
        }
        Ok((command(acceleration), acceleration))
    }
}

/// Returns why a scene has no such proof, if it has none.
pub fn of_scene(scene: &Scene) -> Result<(), Error> {
    Plant::of(scene).map(drop)
}

/// Checks the witness of a word.
///
/// # Errors
///
/// Returns what of it does not hold, or why the scene has no such proof.
pub fn check(scene: &Scene, witness: &Witness) -> Result<Bound, Error> {
    let Witness { word, act, decay, shape, sizes, far, level, weights, storage } = witness;
    let numbers = [act, decay, level].into_iter().chain(shape).chain(sizes).chain(far).chain(storage);
    let has_sense = numbers.into_iter().all(|number| number.abs() < GREATEST);
    let (plant, number, format) = (Plant::of(scene)?, Interval::exact, scene.method.stiffness_format);
    if !has_sense || !weights.iter().all(|weight| (0.0..GREATEST).contains(weight)) {
        return Err("its numbers have no sense".into());
    } else if *word < 1 || i128::from(*word) > format.max() {
        return Err("the stiffness format has no such word".into());
    }
    // The word in commands a count, and half of the staircase's greatest step with what its product's floor takes.
    let lsb = 2f64.powi(-format.frac());
    let slope = *word as f64 * lsb;
    let half = number(0.5).plus(number(0.5 * (1.0 - lsb).max(0.0)).over(slope)).hi;
    let (rest, swing) = plant.rest(slope, half)?;
    let most = (plant.period - plant.latency).min(slope * plant.most);
    let away = rest.plus(negative(number(*act))).size();
    if *act <= 0.0 || *act >= most || rest.lo <= 0.0 || rest.hi >= most {
        return Err("the pulse at rest ends outside of its period".into());
    }

    let clocks = |clocks: Interval| clocks.over(plant.period);
    let whole = plant.flow(number(1.0));
    let kick = [plant.jump, Interval::ZERO, Interval::ZERO];
    let left = number(plant.period - plant.latency).plus(negative(number(*act)));
    let pushed = times(&plant.flow(clocks(left)), &kick);
    let further = |x: &Vector| times(&plant.rates, x).map(|part| clocks(negative(part)));
    let [later, turned] = [further(&pushed), further(&further(&pushed))];
    // The greatest second and third derivatives by the clock at which a pulse ends.
    let (mut second, mut third) = ([0.0f64; 3], [0.0f64; 3]);
    for part in 0..64 {
        let [lo, hi] = [part, part + 1].map(|end| f64::from(end) / 64.0);
        let twice = further(&further(&times(&plant.flow(Interval { lo, hi }), &kick)));
        second = from_fn(|state| twice[state].size().max(second[state]));
        third = from_fn(|state| further(&twice)[state].size().max(third[state]));
    }
    let answer = pushed.map(|part| part.times(number(slope)));
    let closed: Square<3> =
        from_fn(|row| from_fn(|of| if of == 2 { whole[row][2].plus(negative(answer[row])) } else { whole[row][of] }));

    // 1. Responses die out.
    let shape: Square<3> = symmetric(shape);
    let unit: Square<3> = from_fn(|row| from_fn(|of| shape[row][of].plus(number(-f64::from(u8::from(row == of))))));
    let moved = product(&transposed(&closed), &product(&shape, &closed));
    let square = number(*decay).times(number(*decay));
    let falls: Square<3> = from_fn(|row| from_fn(|of| square.times(shape[row][of]).plus(negative(moved[row][of]))));
    if !(0.0..1.0).contains(decay) || !is_positive(unit) || !is_positive(falls) {
        return Err("its motions are not proved to die out".into());
    }
    let trace = (0..3).fold(Interval::ZERO, |sum, at| sum.plus(shape[at][at]));
    let sums = |start: Vector| sums(&closed, start, *decay, trace.hi.sqrt().next_up());
    let axis = |at: usize| sums(from_fn(|state| number(f64::from(u8::from(state == at)))));
    let [by_answer, by_later, by_turned] = [sums(answer)?, sums(later)?, sums(turned)?];
    let by_axis = [axis(0)?, axis(1)?, axis(2)?];

    // 2. Sizes that follow from sizes: the differences of a sample, the drag, and the command's distance from `c0`.
    let (away, damping, floor) = (number(away), number(plant.damping), number(plant.floor));
    let apart = number(1.0).plus(negative(plant.coupling.plus(plant.grip)));
    let entering = |[angle, step, between]: [f64; 3]| {
        let turns = plant.sample.times(number(step)).plus(number(2.0 * between)).plus(number(1.0));
        let drag = damping.times(turns).plus(floor);
        (turns, drag, number(slope).times(number(angle).plus(number(half))).plus(drag))
    };
    // Bounds of the means of `t - a`, of half its square and a sixth of its cube.
    let ends = |push: Interval| {
        let far = push.plus(away);
        let square = push.times(push).over(3.0).plus(far.times(away));
        let cube = push.times(push).times(push).over(4.0).plus(far.times(far).times(away).times(number(1.5)));
        (push.scaled(0.5).plus(away), square.scaled(0.5), cube.over(6.0))
    };
    let follow = |of: [f64; 3]| -> [f64; 3] {
        let (_, drag, push) = entering(of);
        let (late, square, cube) = ends(push);
        let [current, speed, angle, step] = from_fn(|state| {
            let by = |sums: &[f64; 4]| number(sums[state]);
            let first = late.times(by(&by_later)).plus(square.times(by(&by_turned)));
            let all =
                (0..3).fold(first, |sum, axis| sum.plus(cube.times(number(third[axis])).times(by(&by_axis[axis]))));
            number(half).plus(drag.over(slope)).times(by(&by_answer)).plus(push.times(all))
        });
        let driven = current.plus(push.times(plant.jump));
        let fastest = speed.plus(driven).plus(plant.grip.times(angle)).divided(apart);
        let pulled = plant.drag.times(fastest).plus(plant.grip.times(angle.plus(fastest)));
        let accelerated = driven.plus(plant.coupling.times(fastest)).plus(pulled).plus(number(swing));
        [angle.hi, step.hi, accelerated.over(8.0).hi]
    };
    let [(turns, _, push), (_, _, farthest)] = [*sizes, *far].map(entering);
    let reach = rest.hi.max((number(most).plus(negative(rest))).hi);
    let all = |left: &[f64; 3], is: fn(&f64, &f64) -> bool, right| left.iter().zip(right).all(|(l, r)| is(l, r));
    let is_bound = all(&follow(*sizes), f64::le, sizes) && all(&follow(*far), f64::lt, far);
    if !(is_bound && farthest.lo >= reach && turns.hi < plant.most_turns) {
        return Err("its half-range is no bound of the motion in contact".into());
    }

    // 4. What enters is stored: states, with the angle before as the fourth, then the rounding, four parts of the
    // pulse's end, the drag's rounding and the stale part of its difference.
    let [_, _, between] = *sizes;
    let (late, square, _) = ends(push);
    let stored: Square<4> = symmetric(storage);
    let share = damping.over(slope);
    let rounding = share.times(number(2.0 * between).plus(number(1.0))).plus(floor.over(slope));
    let (one, none, steps) = (number(1.0), Interval::ZERO, share.times(plant.sample));
    let read = [none, none, one.plus(steps), negative(steps), one, none, none, none, none, rounding, share];
    let mut next = [[none; INPUTS]; 4];
    for row in 0..3 {
        next[row] = read.map(|part| negative(answer[row].times(part)));
        (0..3).for_each(|of| next[row][of] = next[row][of].plus(whole[row][of]));
        next[row][5] = negative(later[row].times(late).times(number(slope)));
        next[row][6 + row] = square.times(number(second[row])).times(number(slope));
    }
    next[3][2] = one;
    let [staircase, first, other, stale, noise] = weights.map(number);
    let kept: [Interval; INPUTS] = from_fn(|at| number(f64::from(u8::from(at == 2 || at == 4))));
    let climbs: [Interval; INPUTS] = from_fn(|at| number(f64::from(i8::from(at == 2) - i8::from(at == 3))));
    let bent: [Interval; INPUTS] =
        from_fn(|at| next[2][at].plus(number(f64::from(i8::from(at == 3) - 2 * i8::from(at == 2)))));
    let (missed, both) = (stale.times(stale_gain(plant.sample)), first.plus(other.times(number(3.0))));
    let mut left: Square<INPUTS> = from_fn(|row| {
        from_fn(|of| {
            let moved = (0..4).fold(none, |sum, at| {
                (0..4).fold(sum, |sum, by| sum.plus(next[at][row].times(stored[at][by]).times(next[by][of])))
            });
            let held = if row < 4 && of < 4 { stored[row][of] } else { none };
            // q (y - y-), half of it on either side of the diagonal.
            let crossed = kept[row].times(climbs[of]).plus(kept[of].times(climbs[row])).scaled(0.5);
            let spent = staircase.times(crossed).plus(both.times(read[row]).times(read[of]));
            held.plus(negative(moved.plus(spent).plus(missed.times(bent[row]).times(bent[of]))))
        })
    });
    let own = [number(-1.0), number(*level), first, other, other, other, noise, stale];
    for (at, gain) in [2, 4, 5, 6, 7, 8, 9, 10].into_iter().zip(own) {
        left[at][at] = left[at][at].plus(gain);
    }
    if !is_positive(left) {
        return Err("more may be stored than enters".into());
    }
    let square = number(half).times(number(half)).times(number(*level)).plus(noise);
    Ok(Bound {
        rms_counts: number(square.hi.sqrt().next_up()).plus(number(between)).hi,
        half_range_counts: number(sizes[0]).plus(number(between)).hi,
        depth_counts: rest.plus(floor).over(slope).plus(number(half)).middle(),
        duty: rest.middle() / plant.period,
    })
}

/// Returns `γ²` of a sample of so many periods.
pub(crate) fn stale_gain(sample: Interval) -> Interval {
    let less = sample.plus(Interval::exact(-1.0));
    sample.times(sample).plus(sample).plus(less.times(less).over(8.0)).times(sample).times(sample)
}

/// Returns bounds of the sums of the sizes of each state, and of the angle's steps, over all periods from a start on.
fn sums(closed: &Square<3>, start: Vector, decay: f64, root: f64) -> Result<[f64; 4], Error> {
    let norm = |state: &Vector| state.iter().fold(0.0, |sum: f64, part| (sum + part.size()).next_up());
    let norm = |state: &Vector| (norm(state) * root).next_up();
    let away = |wide: &Vector, at: &Vector| norm(&from_fn(|state| wide[state].plus(negative(at[state])))).next_up();
    let (mut at, mut before) = (start.map(|part| Interval::exact(part.middle())), Interval::ZERO);
    let mut lost = away(&start, &at);
    let (mut sums, least) = ([0.0f64; 4], 1e-9 * (1.0 - decay) * norm(&at));
    for _ in 0..MOST_PERIODS {
        if norm(&at) <= least {
            let rest = Interval::exact((lost + norm(&at)).next_up())
                .divided(Interval::exact(1.0).minus(Interval::exact(decay)));
            return Ok(sums.map(|sum| (sum + 2.0 * rest.hi).next_up()));
        }
        let step = at[2].plus(negative(before));
        sums = from_fn(|state| (sums[state] + at.get(state).unwrap_or(&step).size()).next_up());
        before = at[2];
        let wide = times(closed, &at);
        at = wide.map(|part| Interval::exact(part.middle()));
        lost = (lost + away(&wide, &at)).next_up();
    }
    Err("its motions die out too slowly".into())
}
