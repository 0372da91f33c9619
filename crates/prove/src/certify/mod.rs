//! The checker of certificates: a wall settles at every phase of its contact, for ever.
//!
//! It makes its own matrices from the scene and shares no code with the search but intervals and the scene's reader.
//!
//! Time is in periods of the modulator, angles in counts, and a current in the acceleration of its torque. A period
//! begins where the modulator reads the encoder. The deviation `x` from the periodic motion of a constant command `c0`
//! then obeys `x+ = Φ x + ∫F(t) dt`, from `c0` to the command `c`. `F(t)` is what a clock of supply leaves at the end
//! of the period if the pulse ends at clock `t`. With `u = c - c0` the integral is `u` times the mean of
//! `F(a) + (t - a) F'(a) + (t - a)²/2 F''(s)`, or with `F''(a)` and a third derivative. With the angle `y`, the command
//! is `u = -k q`. There `q = y + e` with `|e| <= H` is a function of `y` that never falls.
//!
//! 1. `x' P x` falls by `decay²` from period to period, so the sums of the responses' sizes are bounded.
//! 2. By these sums, `|y| <= Y` gives `|y| <= f(Y)`. As `f` is convex, `f(Y) <= Y`, and `f(L) < L` for the greatest `L`
//!    that contact allows, no motion in contact stays beyond `Y`.
//! 3. `x' W x` and the convex potential of the staircase store what enters: the sum of `y² + h q (y - y-)` is at most
//!    that of `λ e²`. The sum of `q (y - y-)` is at least a constant. So the rms of `y` is at most `H √λ`.
//! 4. Between two readings the angle is within an eighth of the greatest acceleration from the straight line.

mod text;

use std::array::from_fn;
use std::f64::consts::PI;

use hpu_cosim::scene::{BridgeModel, Datapath, Device, Encoder, EncoderModel, Friction, Hand, Loop, Scene, Winding};

pub use text::{CLAIM, certify};

use crate::Error;
use crate::interval::Interval;
use crate::square::{Square, exponential, is_positive, negative, product, symmetric, times, transposed};

type Vector = [Interval; 3];

/// Greatest number of periods over which responses are summed one by one.
const MOST_PERIODS: usize = 200_000;
/// Greatest size of a number of a witness.
const GREATEST: f64 = 1e15;

/// The numbers that a search has found for one word of the stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Witness {
    /// The word of the stiffness.
    pub word: i64,
    /// The clock `a` near which pulses end.
    pub act: f64,
    /// The factor by which the root of `x' P x` falls in a period.
    pub decay: f64,
    /// The upper triangle of `P`, row by row; states are current, speed, angle.
    pub shape: [f64; 6],
    /// `Y`, in counts.
    pub half_range: f64,
    /// `λ`.
    pub level: f64,
    /// The multipliers of the staircase and of both parts of the pulse's end.
    pub weights: [f64; 3],
    /// The upper triangle of `W`, row by row; its last state is the angle of the period before.
    pub storage: [f64; 10],
}

/// The bounds that are proved of a word.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bound {
    /// Bound of the rms of the angle about its rest in the long run, in counts.
    pub rms_counts: f64,
    /// Bound of the angle's distance from its rest, once the start has died out, in counts.
    pub half_range_counts: f64,
    /// Depth of the rest behind the wall's surface, in counts.
    pub depth_counts: f64,
    /// Duty at rest.
    pub duty: f64,
}

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
    /// Greatest count behind the surface that the position counter holds.
    most: f64,
}

impl Plant {
    fn of(scene: &Scene) -> Result<Self, Error> {
        let (Device::Motor(motor), Encoder::Rotary { lines }) = (&scene.device, &scene.encoder) else {
            return Err("the device is no motor with an encoder on its shaft".into());
        };
        let (model, pwm) = (&scene.model, &scene.method.pwm);
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
            (scene.words()?.damping != 0, "its wall has damping"),
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
        Ok(Self {
            rates: [
                [negative(decay), negative(coupling), none],
                [one, negative(drag), negative(grip)],
                [none, one, none],
            ],
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
            most: 2f64.powi(scene.method.position_bits.cast_signed() - 1) - 1.0,
        })
    }

    /// Returns the flow over a time in periods.
    fn flow(&self, time: Interval) -> Square<3> {
        exponential(&self.rates.map(|row| row.map(|rate| rate.times(time))))
    }

    /// Returns the clocks of a pulse at rest, and a bound of the acceleration in the periodic motion.
    fn rest(&self, slope: f64, half: f64) -> Result<(Interval, f64), Error> {
        let one = Interval::exact(1.0);
        let apart = one.plus(negative(self.coupling.divided(self.decay).plus(self.drag).plus(self.grip)));
        let stall = self.stall.over(self.period);
        let command = |off: f64| match self.depth {
            None => self.push.divided(stall),
            Some(depth) => {
                let behind = depth.plus(negative(Interval::exact(half))).plus(Interval { lo: -off, hi: off });
                let slope = Interval::exact(slope);
                behind.times(slope).divided(one.plus(slope.times(stall).divided(self.grip)))
            }
        };
        // The current's distance from its mean, as a share of the greatest: all of it at first, then by the pulses.
        let mut share = 1.0;
        let mut acceleration = f64::INFINITY;
        for _ in 0..2 {
            if apart.lo <= 0.0 {
                return Err("its modulator is too slow for its motor".into());
            }
            acceleration = self.stall.times(Interval::exact(share)).divided(apart).hi;
            let duty = command(acceleration).over(self.period);
            if duty.lo <= 0.0 || duty.hi >= 1.0 {
                return Err("the wall does not hold the hand by a part of its full command".into());
            }
            let fall = |time: Interval| exponential(&[[negative(self.decay.times(time))]])[0][0];
            let off = one.plus(negative(duty));
            let high = one.plus(negative(fall(duty))).divided(one.plus(negative(fall(one))));
            let low = high.times(fall(off));
            share = high.plus(negative(duty)).hi.max(duty.plus(negative(low)).hi).min(1.0);
        }
        acceleration = acceleration.min(self.stall.times(Interval::exact(share)).divided(apart).hi);
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
    let Witness { word, act, decay, shape, half_range, level, weights, storage } = witness;
    let single = [*act, *decay, *half_range, *level];
    if !single.iter().chain(shape).chain(weights).chain(storage).all(|number| number.abs() < GREATEST) || *word < 1 {
        return Err("its numbers have no sense".into());
    }
    let plant = Plant::of(scene)?;
    let format = scene.method.stiffness_format;
    if i128::from(*word) > format.max() {
        return Err("the stiffness format has no such word".into());
    }
    let number = Interval::exact;
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
    let falls: Square<3> = from_fn(|row| {
        from_fn(|of| number(*decay).times(number(*decay)).times(shape[row][of]).plus(negative(moved[row][of])))
    });
    if !(0.0..1.0).contains(decay) || !is_positive(unit) || !is_positive(falls) {
        return Err("its motions are not proved to die out".into());
    }
    let trace = (0..3).fold(Interval::ZERO, |sum, at| sum.plus(shape[at][at]));
    let sums = |start: Vector| sums(&closed, start, *decay, trace.hi.sqrt().next_up());
    let axis = |at: usize| sums(from_fn(|state| number(f64::from(u8::from(state == at)))));
    let [by_answer, by_later, by_turned] = [sums(answer)?, sums(later)?, sums(turned)?];
    let by_axis = [axis(0)?, axis(1)?, axis(2)?];

    // 2. The sizes of the states, from that of the angle.
    // The command's distance from `c0`, and bounds of the means of `t - a`, of half its square and a sixth of its cube.
    let away = number(away);
    let ends = |size: f64| {
        let push = number(slope).times(number(size).plus(number(half)));
        let far = push.plus(away);
        let square = push.times(push).over(3.0).plus(far.times(away));
        let cube = push.times(push).times(push).over(4.0).plus(far.times(far).times(away).times(number(1.5)));
        (push, push.scaled(0.5).plus(away), square.scaled(0.5), cube.over(6.0))
    };
    let sizes = |size: f64| -> [f64; 3] {
        let (push, late, square, cube) = ends(size);
        from_fn(|state| {
            let by = |sums: &[f64; 3]| number(sums[state]);
            let first = late.times(by(&by_later)).plus(square.times(by(&by_turned)));
            let all =
                (0..3).fold(first, |sum, axis| sum.plus(cube.times(number(third[axis])).times(by(&by_axis[axis]))));
            number(half).times(by(&by_answer)).plus(push.times(all)).hi
        })
    };
    let reach = rest.hi.max((number(most).plus(negative(rest))).hi);
    let widest = number(reach).over(slope).plus(number(-half)).hi.next_up();
    let [current, speed, angle] = sizes(*half_range);
    if !(angle <= *half_range && *half_range < widest && sizes(widest)[2] < widest) {
        return Err("its half-range is no bound of the motion in contact".into());
    }

    // 3. What enters is stored.
    let (push, late, square, _) = ends(*half_range);
    let stored: Square<4> = symmetric(storage);
    // States, with the angle before as the fourth, then the rounding and four parts of the pulse's end.
    let mut next = [[Interval::ZERO; 9]; 4];
    for row in 0..3 {
        next[row][..3].copy_from_slice(&closed[row]);
        next[row][4] = negative(answer[row]);
        next[row][5] = negative(later[row].times(late).times(number(slope)));
        next[row][6 + row] = square.times(number(second[row])).times(number(slope));
    }
    next[3][2] = number(1.0);
    let [staircase, first, other] = weights.map(number);
    if weights.iter().any(|weight| *weight < 0.0) {
        return Err("its multipliers are below zero".into());
    }
    let kept: [Interval; 9] = from_fn(|at| number(f64::from(u8::from(at == 2 || at == 4))));
    let both = first.plus(other.times(number(3.0)));
    let mut left: Square<9> = from_fn(|row| {
        from_fn(|of| {
            let moved = (0..4).fold(Interval::ZERO, |sum, at| {
                (0..4).fold(sum, |sum, by| sum.plus(next[at][row].times(stored[at][by]).times(next[by][of])))
            });
            let held = if row < 4 && of < 4 { stored[row][of] } else { Interval::ZERO };
            // q (y - y-), half of it on either side of the diagonal.
            let climbs = |at: usize| number(f64::from(i8::from(at == 2) - i8::from(at == 3)));
            let crossed = kept[row].times(climbs(of)).plus(kept[of].times(climbs(row))).scaled(0.5);
            let spent = staircase.times(crossed).plus(both.times(kept[row]).times(kept[of]));
            held.plus(negative(moved)).plus(negative(spent))
        })
    });
    let own = [number(-1.0), number(*level), first, other, other, other];
    for (at, gain) in [2, 4, 5, 6, 7, 8].into_iter().zip(own) {
        left[at][at] = left[at][at].plus(gain);
    }
    if !is_positive(left) {
        return Err("more may be stored than enters".into());
    }

    // 4. Between two readings.
    let [current, speed, angle] = [current, speed, angle].map(number);
    let driven = current.plus(push.times(plant.jump));
    let apart = number(1.0).plus(negative(plant.coupling.plus(plant.grip)));
    if apart.lo <= 0.0 {
        return Err("its modulator is too slow for its motor".into());
    }
    let fastest = speed.plus(driven).plus(plant.grip.times(angle)).divided(apart);
    let pulled = plant.drag.times(fastest).plus(plant.grip.times(angle.plus(fastest)));
    let accelerated = driven.plus(plant.coupling.times(fastest)).plus(pulled).plus(number(swing));
    let between = accelerated.over(8.0);
    let rms = number(half).times(number(level.sqrt().next_up())).plus(between).hi;
    let half_range_counts = angle.plus(between).hi;
    let depth_counts = rest.over(slope).plus(number(half)).middle();
    Ok(Bound { rms_counts: rms, half_range_counts, depth_counts, duty: rest.middle() / plant.period })
}

/// Returns bounds of the sums of the sizes of each state, over all periods from a start on.
fn sums(closed: &Square<3>, start: Vector, decay: f64, root: f64) -> Result<[f64; 3], Error> {
    let norm = |state: &Vector| state.iter().fold(0.0, |sum: f64, part| (sum + part.size()).next_up());
    let norm = |state: &Vector| (norm(state) * root).next_up();
    let (mut at, mut lost) = (start.map(|part| Interval::exact(part.middle())), 0.0f64);
    let away = |wide: &Vector, at: &Vector| norm(&from_fn(|state| wide[state].plus(negative(at[state])))).next_up();
    lost += away(&start, &at);
    let (mut sums, least) = ([0.0f64; 3], 1e-9 * (1.0 - decay) * norm(&at));
    for _ in 0..MOST_PERIODS {
        if norm(&at) <= least {
            let rest = Interval::exact((lost + norm(&at)).next_up())
                .divided(Interval::exact(1.0).minus(Interval::exact(decay)));
            return Ok(sums.map(|sum| (sum + rest.hi).next_up()));
        }
        sums = from_fn(|state| (sums[state] + at[state].size()).next_up());
        let wide = times(closed, &at);
        at = wide.map(|part| Interval::exact(part.middle()));
        lost = (lost + away(&wide, &at)).next_up();
    }
    Err("its motions die out too slowly".into())
}
