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
//!
//! Numbers of the world may have ranges. All matrices are then forms of them, `P` and `W` are straight
//! lines in them, and each inequality is proved at the control points of its form. Sums of sizes are convex, so none is
//! greater than the greatest at a control point.

#[cfg(not(target_family = "wasm"))]
pub mod growth;
mod text;
mod window;

use std::array::from_fn;
use std::f64::consts::PI;

use hpu_cosim::scene::{BridgeModel, Datapath, Device, Encoder, EncoderModel, Friction, Hand, Loop, Scene, Winding};

pub use text::{Bound, CLAIM, Checked, Over, Range, Turn, Witness, certify, numbers, part_of, set};
pub use window::{Window, start, until_read, window};

use crate::Error;
use crate::form::Form;
use crate::interval::Interval;
use crate::responses::Responses;
use crate::square::{Column, Square, exponential, is_positive, symmetric, times};

type Vector<const K: usize> = Column<3, K>;

/// The refusal of sizes that do not follow from themselves.
pub const LOOSE: &str = "its half-range is no bound of the motion in contact";
/// States of the storage, and what enters.
const INPUTS: usize = 11;
/// Greatest size of a number of a witness.
const GREATEST: f64 = 1e15;

/// Motor, hand and modulator of a scene. All numbers are those of scaled states.
struct Plant<const K: usize> {
    rates: Square<3, K>,
    /// Current by a clock of supply.
    jump: Form<K>,
    /// Acceleration by a full supply at standstill, and by a current.
    stall: Interval,
    gain: Interval,
    /// Acceleration per unit of angle and of speed; of speed with the current that it drives, too.
    grip: Interval,
    drag: Interval,
    coupling: Interval,
    decay: Form<K>,
    /// Clocks of the period, and those from the encoder's lines to the modulator.
    period: f64,
    latency: f64,
    /// Where the hand intends to be behind the wall's surface, and its spring's angle by a command; or the command that
    /// balances it.
    hand: Result<[Form<K>; 2], Form<K>>,
    /// Greatest count behind the surface that the position counter holds, and greatest difference of a sample.
    most: f64,
    most_turns: f64,
    /// Periods of the modulator in a sample, commands a count of difference, and half of what rounding down takes.
    sample: Interval,
    damping: f64,
    floor: f64,
}

/// The loop of a witness that holds.
struct Inside<const K: usize> {
    bound: Bound,
    plant: Plant<K>,
    responses: Responses<K>,
    /// The sizes that follow from those of the witness, and the greatest distance of a command from that at rest.
    followed: [f64; 3],
    push: Interval,
    /// The command at rest, the greatest one, and the greatest rounding of a count.
    rest: Form<K>,
    most: f64,
    half: f64,
}

impl<const K: usize> Plant<K> {
    /// Returns those of a scene, with a unit of the current in A.
    fn of(scene: &Scene, ranges: [&Range; K], unit: f64) -> Result<Self, Error> {
        let (Device::Motor(motor), Encoder::Rotary { lines }) = (&scene.device, &scene.encoder) else {
            return Err("the device is no motor with an encoder on its shaft".into());
        };
        let (model, pwm, words) = (&scene.model, &scene.method.pwm, scene.words()?);
        let rubs = motor.coulomb_friction_nm > 0.0 && model.friction != Friction::None;
        let other_model = !model.solver.is_exact() || model.winding != Winding::Inductive;
        let is_held = scene.hand.grip().0 > 0.0 || matches!(scene.hand, Hand::ConstantTorque { .. });
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
            (!is_held, "no hand holds the device against the wall"),
        ];
        if let Some((_, why)) = refused.iter().find(|(is, _)| *is) {
            return Err(Error::new(why));
        }
        let number = Form::exact;
        let mut all: Vec<Form<K>> = numbers(&mut scene.clone()).into_iter().map(|value| number(*value)).collect();
        for (index, Range { number, ends: [low, high] }) in ranges.into_iter().enumerate() {
            let of = all.get_mut(*number).filter(|_| 0.0 <= *low && low < high && *high < GREATEST);
            *of.ok_or("no range of a number of its world")? = Form::between([*low, *high], index);
        }
        all.resize(10, Form::ZERO);
        let [winding, l, k, rotor, wheel, viscous, supply, switch, held, damped] = from_fn(|at| all[at]);
        let period = 2f64.powi(pwm.bits.cast_signed());
        let period_s = number(period).over(scene.clock.frequency_hz() as f64);
        let (square, ratio) = (period_s.times(period_s), number(motor.wheel_ratio).times(number(motor.wheel_ratio)));
        let count = Form::of(Interval { lo: PI, hi: PI.next_up() }).over(2.0 * f64::from(*lines));
        let (ohm, unit) = (winding.plus(switch.scaled(2.0)), number(unit));
        // Nothing else depends on these, so each is a straight line in the reciprocal.
        let [per_inertia, per_henry] = [rotor.plus(wheel.divided(ratio)), l].map(Form::reciprocal);
        let gain = k.times(unit).times(square).divided(count).times(per_inertia);
        let slowed = [held.times(square), viscous.plus(damped).times(period_s)];
        let [grip, drag] = slowed.map(|by| by.times(per_inertia));
        let (decay, induced) = (ohm.times(period_s).times(per_henry), k.times(count).divided(unit).times(per_henry));
        // The torque at standstill by a command.
        let clock = k.times(supply).divided(ohm).over(period);
        let hand = match &scene.hand {
            Hand::ConstantTorque { torque_nm } => Err(number(*torque_nm).divided(clock)),
            hand => {
                let end = number(hand.path().last().map_or(0.0, |(_, angle_rad)| *angle_rad)).divided(count);
                Ok([end.minus(number(scene.wall_count() as f64)), clock.divided(held.times(count))])
            }
        };
        let most = |bits: u32| 2f64.powi(bits.cast_signed() - 1) - 1.0;
        let lsb = 2f64.powi(-scene.method.damping_format.frac());
        let damping = words.damping as f64 * lsb;
        let electrical = [decay.negative(), induced.negative(), Form::ZERO];
        Ok(Self {
            rates: [electrical, [gain, drag.negative(), grip.negative()], [Form::ZERO, number(1.0), Form::ZERO]],
            jump: supply.times(period_s).divided(unit).times(per_henry).over(period),
            stall: clock.all().times(number(period).times(square).times(per_inertia).divided(count).all()),
            gain: gain.all(),
            grip: grip.all(),
            drag: drag.all(),
            coupling: gain.times(induced).all(),
            decay,
            period,
            latency: 4.0 + f64::from(scene.method.settling),
            hand,
            most: most(scene.method.position_bits),
            most_turns: most(scene.method.position_bits.min(scene.method.velocity_bits)).min((period - 2.0) / damping),
            sample: Interval::exact(words.period as f64).over(period),
            damping,
            floor: if damping > 0.0 { 0.5 * (1.0 - lsb) } else { 0.0 },
        })
    }

    /// Returns the flow over a time in periods.
    fn flow(&self, time: Form<K>) -> Square<3, K> {
        exponential(&self.rates.map(|row| row.map(|rate| rate.times(time))))
    }

    /// Returns the clocks of a pulse at rest, and a bound of the acceleration in the periodic motion.
    fn rest(&self, slope: f64, half: f64) -> Result<(Form<K>, f64), Error> {
        let (number, one) = (Form::exact, Form::exact(1.0));
        let apart = Interval::exact(1.0).minus(self.coupling.divided(self.decay.all()).plus(self.drag).plus(self.grip));
        if !(apart.lo > 0.0 && self.coupling.plus(self.grip).hi < 1.0) {
            return Err("its modulator is too slow for its motor".into());
        }
        let command = |off: f64| match self.hand {
            Err(command) => command,
            Ok([depth, bend]) => {
                let behind = depth.minus(number(half)).plus(Form::of(Interval { lo: -off, hi: off }));
                let held = behind.times(number(slope)).minus(number(self.floor));
                held.divided(one.plus(number(slope).times(bend)))
            }
        };
        // The current's distance from its mean, as a share of the greatest: all of it at first, then by the pulses.
        let mut acceleration = self.stall.divided(apart).hi;
        for _ in 0..2 {
            let duty = command(acceleration).over(self.period);
            if !(duty.all().lo > 0.0 && duty.all().hi < 1.0) {
                return Err("the wall does not hold the hand by a part of its full command".into());
            }
            let fall = |time: Form<K>| exponential(&[[self.decay.times(time).negative()]])[0][0];
            let high = one.minus(fall(duty)).divided(one.minus(fall(one)));
            let low = high.times(fall(one.minus(duty)));
            let share = high.minus(duty).all().hi.max(duty.minus(low).all().hi).min(1.0);
            acceleration = self.stall.times(Interval::exact(share)).divided(apart).hi;
        }
        Ok((command(acceleration), acceleration))
    }
}

/// Returns why a scene has no such proof, if it has none.
pub fn of_scene(scene: &Scene) -> Result<(), Error> {
    Plant::<0>::of(scene, [], 1.0).map(drop)
}

/// Checks the witness of a word, of a scene in which some numbers have ranges.
///
/// # Errors
///
/// Returns what of it does not hold, or why the scene has no such proof.
pub fn check(scene: &Scene, ranges: &[Range], witness: &Witness) -> Result<Bound, Error> {
    match ranges {
        [] => inspect(scene, [], witness).map(|found| found.bound),
        [one] => inspect(scene, [one], witness).map(|found| found.bound),
        [one, other] => inspect(scene, [one, other], witness).map(|found| found.bound),
        _ => Err("ranges of more than two numbers".into()),
    }
}

/// Returns the loop of a witness that holds.
fn inspect<const K: usize>(scene: &Scene, ranges: [&Range; K], witness: &Witness) -> Result<Inside<K>, Error> {
    let Witness { word, unit, act, decay, scales, shape, sizes, far, level, weights, storage, turns } = witness;
    let numbers = [act, decay, level].into_iter().chain(shape).chain(sizes).chain(far).chain(storage);
    let turned = turns.iter().flat_map(|turn| turn.shape.iter().chain(&turn.storage));
    let has_sense = numbers.chain(turned).all(|number| number.abs() < GREATEST) && turns.len() == K;
    let (plant, number, format) = (Plant::of(scene, ranges, *unit)?, Interval::exact, scene.method.stiffness_format);
    if !has_sense || !weights.iter().chain(scales).chain([unit]).all(|weight| (0.0..GREATEST).contains(weight)) {
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
    let act = Form::exact(*act).along(rest);
    let away = rest.minus(act).size();
    if ![act.all(), rest.all()].iter().all(|end| end.lo > 0.0 && end.hi < most) {
        return Err("the pulse at rest ends outside of its period".into());
    }

    let exact = Form::<K>::exact;
    let clocks = |clocks: Form<K>| clocks.over(plant.period);
    let whole = plant.flow(exact(1.0));
    let kick = [plant.jump, Form::ZERO, Form::ZERO];
    let pushed = times(&plant.flow(clocks(exact(plant.period - plant.latency).minus(act))), &kick);
    let further = |x: &Vector<K>| times(&plant.rates, x).map(|part| clocks(part.negative()));
    let [later, turned] = [further(&pushed), further(&further(&pushed))];
    // The greatest second and third derivatives by the clock at which a pulse ends.
    let (mut second, mut third) = ([0.0f64; 3], [0.0f64; 3]);
    for part in 0..64 {
        let [lo, hi] = [part, part + 1].map(|end| f64::from(end) / 64.0);
        let twice = further(&further(&times(&plant.flow(Form::of(Interval { lo, hi })), &kick)));
        second = from_fn(|state| twice[state].size().max(second[state]));
        third = from_fn(|state| further(&twice)[state].size().max(third[state]));
    }
    let answer = pushed.map(|part| part.times(exact(slope)));
    let closed: Square<3, K> =
        from_fn(|row| from_fn(|of| if of == 2 { whole[row][2].minus(answer[row]) } else { whole[row][of] }));

    // 1. Responses die out.
    let shape: [Form<K>; 6] = from_fn(|at| Form::line(shape[at], from_fn(|of| turns[of].shape[at])));
    let responses = Responses::new(closed, &symmetric(&shape), *scales, *decay)?;
    let [by_answer, by_later, by_turned] = [responses.from(answer)?, responses.from(later)?, responses.from(turned)?];

    // 2. Sizes that follow from sizes: the differences of a sample, the drag, and the command's distance from `c0`.
    let Plant { coupling, grip, gain, drag: friction, .. } = plant;
    let (away, damping, floor) = (number(away), number(plant.damping), number(plant.floor));
    let apart = number(1.0).minus(coupling.plus(grip));
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
            let all = (0..3)
                .fold(first, |sum, axis| sum.plus(cube.times(number(third[axis])).times(by(&responses.by_axis[axis]))));
            number(half).plus(drag.over(slope)).times(by(&by_answer)).plus(push.times(all))
        });
        let driven = gain.times(current.plus(push.times(plant.jump.all())));
        let fastest = speed.plus(driven).plus(grip.times(angle)).divided(apart);
        let pulled = friction.times(fastest).plus(grip.times(angle.plus(fastest)));
        let accelerated = driven.plus(coupling.times(fastest)).plus(pulled).plus(number(swing));
        [angle.hi, step.hi, accelerated.over(8.0).hi]
    };
    let [(differs, _, push), (_, _, farthest)] = [*sizes, *far].map(entering);
    let reach = rest.all().hi.max(number(most).minus(rest.all()).hi);
    let all = |left: &[f64; 3], is: fn(&f64, &f64) -> bool, right| left.iter().zip(right).all(|(l, r)| is(l, r));
    let followed = follow(*sizes);
    let is_bound = all(&followed, f64::le, sizes) && all(&follow(*far), f64::lt, far);
    if !(is_bound && farthest.lo >= reach && differs.hi < plant.most_turns) {
        return Err(LOOSE.into());
    }

    // 4. What enters is stored: states, with the angle before as the fourth, then the rounding, four parts of the
    // pulse's end, the drag's rounding and the stale part of its difference.
    let (between, (late, square, _)) = (sizes[2], ends(push));
    let share = damping.over(slope);
    let rounding = share.times(number(2.0 * between).plus(number(1.0))).plus(floor.over(slope));
    let [rounding, share, steps] = [rounding, share, share.times(plant.sample)].map(Form::of);
    let (one, none) = (exact(1.0), Form::ZERO);
    let read = [none, none, one.plus(steps), steps.negative(), one, none, none, none, none, rounding, share];
    let mut next = [[none; INPUTS]; 4];
    for row in 0..3 {
        next[row] = read.map(|part| answer[row].times(part).negative());
        (0..3).for_each(|of| next[row][of] = next[row][of].plus(whole[row][of]));
        next[row][5] = later[row].times(Form::of(late)).times(exact(slope)).negative();
        next[row][6 + row] = Form::of(square.times(number(second[row])).times(number(slope)));
    }
    next[3][2] = one;
    let [staircase, first, other, stale, noise] = weights.map(exact);
    let kept: [Form<K>; INPUTS] = from_fn(|at| exact(f64::from(u8::from(at == 2 || at == 4))));
    let climbs: [Form<K>; INPUTS] = from_fn(|at| exact(f64::from(i8::from(at == 2) - i8::from(at == 3))));
    let bent: [Form<K>; INPUTS] =
        from_fn(|at| next[2][at].plus(exact(f64::from(i8::from(at == 3) - 2 * i8::from(at == 2)))));
    let (missed, both) = (stale.times(Form::of(stale_gain(plant.sample))), first.plus(other.times(exact(3.0))));
    let stored: [Form<K>; 10] = from_fn(|at| Form::line(storage[at], from_fn(|of| turns[of].storage[at])));
    let stored: Square<4, K> = symmetric(&stored);
    let mut left: Square<INPUTS, K> = from_fn(|row| {
        from_fn(|of| {
            let moved = (0..4).fold(none, |sum, at| {
                (0..4).fold(sum, |sum, by| sum.plus(next[at][row].times(stored[at][by]).times(next[by][of])))
            });
            let held = if row < 4 && of < 4 { stored[row][of] } else { none };
            // q (y - y-), half of it on either side of the diagonal.
            let crossed = kept[row].times(climbs[of]).plus(kept[of].times(climbs[row])).scaled(0.5);
            let spent = staircase.times(crossed).plus(both.times(read[row]).times(read[of]));
            held.minus(moved.plus(spent).plus(missed.times(bent[row]).times(bent[of])))
        })
    });
    let own = [exact(-1.0), exact(*level), first, other, other, other, noise, stale];
    for (at, gain) in [2, 4, 5, 6, 7, 8, 9, 10].into_iter().zip(own) {
        left[at][at] = left[at][at].plus(gain);
    }
    if !is_positive(&left) {
        return Err("more may be stored than enters".into());
    }
    let square = number(half).times(number(half)).times(number(*level)).plus(noise.all());
    let bound = Bound {
        rms_counts: number(square.hi.sqrt().next_up()).plus(number(between)).hi,
        half_range_counts: number(sizes[0]).plus(number(between)).hi,
        depth_counts: rest.all().plus(floor).over(slope).plus(number(half)).middle(),
        duty: rest.all().middle() / plant.period,
    };
    Ok(Inside { bound, plant, responses, followed, push, rest, most, half })
}

/// Returns `γ²` of a sample of so many periods.
pub(crate) fn stale_gain(sample: Interval) -> Interval {
    let less = sample.plus(Interval::exact(-1.0));
    sample.times(sample).plus(sample).plus(less.times(less).over(8.0)).times(sample).times(sample)
}
