//! The linear loop through a modulator, from clock to clock, and its steps from one command to the next.
//!
//! A command acts once a period: another one moves the end of the pulse, which is an impulse on the winding. Both
//! phases of sign and magnitude have the same plant, because the off phase brakes; so this is the exact derivative of
//! the map from period to period. Events in the order of their clocks, those of one clock in this order:
//!
//! - *Read*: the command becomes `-K θ - (B/T) v`, with the position of the latest sample in the place of `θ` if the
//!   spring is sampled. A modulator that starts a period at clock `n` with the command it finds reads the encoder's
//!   lines of clock `n - (4 + settling)`, and another one those of as many clocks before the pulse ends.
//! - *Sample*: `v` becomes the change of the position since the sample before.
//! - *Act*: the current changes by the impulse of the command, where the pulse ends.
//!
//! Both periods are whole clocks, so the loop repeats after their least common multiple. A step is from one Read to
//! just before the next one. Its states are the plant's, the position of the latest sample, `v`, and the commands that
//! are read but do not act yet.
//!
//! Current and speed are scaled so that the stored energy is the sum of the states' squares: a flow then enlarges no
//! state by more than [`Pulses::growth`].

use std::array::from_fn;

use hpu_cosim::scene::{Device, LawMethod, Loop, Scene, Winding};
use hpu_datapath::Estimator;

use super::lyapunov::{Step, Steps};
use crate::Error;
use crate::interval::{Interval, Matrix};
use crate::series::Series;
use crate::waits::{Drive, Rest, has_lines};

/// Greatest number of samples in a common period.
const MOST_SAMPLES: u64 = 1 << 16;
/// Greatest number of modulator periods in a common period.
const MOST_PERIODS: u64 = 1 << 20;
/// Greatest number of commands that wait for the end of their pulse.
const MOST_WAITING: usize = 3;
/// States of the plant: current, speed and angle.
const PLANT: usize = 3;
/// Index of the position of the latest sample, and of the velocity.
const SAMPLED: usize = 3;
const VELOCITY: usize = 4;
/// Index of the newest command that waits.
const NEWEST: usize = 5;

type Flow = [[Interval; PLANT]; PLANT];

/// The linear loop of a scene through a modulator.
pub(super) struct Pulses {
    /// The plant in scaled states.
    rates: Flow,
    hertz: f64,
    /// Clocks of the modulator's period and of the sample period, and their greatest common divisor.
    period: u64,
    sample: u64,
    grid: u64,
    /// Flows over clocks up to `1 << bits`, and over multiples of that.
    fine: Vec<Flow>,
    coarse: Vec<Flow>,
    bits: u32,
    /// The angle's row of the flow from a Read to each sample of a common period, without the phase between both.
    seen: Vec<[Interval; PLANT]>,
    /// The current's change by a command of one unit.
    kick: Interval,
    /// Stiffness of the scaled states, in N·m/rad.
    scale: f64,
    /// Greatest factor by which the flow of a period enlarges the states.
    growth: f64,
    drive: Drive,
    latched: bool,
    /// Clocks from the encoder's lines to the modulator, and those of them that hold the command.
    latency: u64,
    settling: u64,
    /// Whether the spring is sampled.
    is_sampled: bool,
    /// Damping over the sample period.
    damper: f64,
    pub rest: Rest,
}

/// A number of clocks, and a bound of its distance from the true one.
#[derive(Clone, Copy)]
struct Span {
    at: f64,
    half: f64,
}

/// A stretch of duties whose events come in one order.
#[derive(Clone, Copy)]
struct Order {
    /// Commands that wait when the next one is read.
    waiting: usize,
    /// Clocks from a Read to the next Act.
    act: Span,
    /// Clocks by which the samples come after multiples of the grid.
    phase: Span,
}

impl Pulses {
    /// Returns the loop of a scene.
    ///
    /// # Errors
    ///
    /// Returns the reason why it is not worked out.
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        let Device::Motor(motor) = &scene.device else { unreachable!("a modulator drives a motor") };
        let drive = Drive::of(scene);
        let Drive::Pulses { period, latched, .. } = drive else { unreachable!("the caller asks for pulses") };
        let pwm = scene.method.pwm;
        let refused = [
            (pwm.floating, "the off phase of its bridge leaves the winding open"),
            (pwm.dead_time_s > 0.0, "its bridge has a dead time"),
            (scene.model.winding == Winding::Resistive, "its winding has no inductance"),
        ];
        if let Some((_, why)) = refused.iter().find(|(is, _)| *is) {
            return Err(Error::new(why));
        }
        let damping = plain_damping(scene)?;
        let rest = Rest::of(scene).ok_or("the hand leaves it no place of rest")?;
        let sample = scene.period_clocks();
        let grid = common_divisor(period, sample);
        let (samples, periods) = (period / grid, sample / grid);
        if samples > MOST_SAMPLES || periods > MOST_PERIODS {
            return Err(Error::new(format_args!(
                "sample and modulator have the same phase only after {samples} samples"
            )));
        }

        let number = Interval::exact;
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = number(motor.resistance_ohm).plus(number(2.0 * scene.bridge.on_resistance_ohm));
        let hertz = scene.clock.frequency_hz() as f64;
        let period_s = period as f64 / hertz;
        // A grip that is softer than the inertia over a period would make the speed's state large.
        let scale = grip.max(1e-2 * j / (period_s * period_s));
        let negative = |x: Interval| Interval::ZERO.minus(x);
        let root = |x: Interval| Interval { lo: x.lo.sqrt().next_down(), hi: x.hi.sqrt().next_up() };
        let viscous = number(motor.viscous_friction_nm_s_per_rad).plus(number(grip_damping));
        let coupling = number(k).divided(root(number(l).times(number(j))));
        let turn = root(number(scale).over(j));
        let back = number(grip).divided(root(number(j).times(number(scale))));
        let rates = [
            [negative(ohm.over(l)), negative(coupling), Interval::ZERO],
            [coupling, negative(viscous.over(j)), negative(back)],
            [Interval::ZERO, turn, Interval::ZERO],
        ];
        // An impulse of R T_p / K a unit of torque, over L; the command is in units of `scale`.
        let area = ohm.times(number(period_s).times(number(scale))).over(k);
        let kick = area.divided(root(number(l).times(number(scale))));
        // The symmetric part of the rates has this greatest eigenvalue at most.
        let apart = turn.minus(back).size();
        let growth = libm::exp(0.5 * apart * period_s) * (1.0 + 1e-9);

        let bits = period.ilog2().div_ceil(2);
        let flow = |clocks: u64| flow(&rates, number(clocks as f64).over(hertz));
        let fine: Vec<Flow> = (0..1 << bits).map(flow).collect();
        let coarse: Vec<Flow> = (0..=period >> bits).map(|high| flow(high << bits)).collect();
        let mut pulses = Self {
            rates,
            hertz,
            period,
            sample,
            grid,
            fine,
            coarse,
            bits,
            seen: Vec::new(),
            kick,
            scale,
            growth,
            drive,
            latched,
            latency: drive.lines(scene) + u64::from(scene.method.settling),
            settling: scene.method.settling.into(),
            is_sampled: !scene.method.kind.is_live(),
            damper: damping / scene.sample_period_s(),
            rest,
        };
        pulses.seen = (0..samples).map(|index| pulses.angle(index * sample % period)).collect();
        Ok(pulses)
    }

    /// Returns the common period in s.
    pub fn common_s(&self) -> f64 {
        self.sample as f64 * (self.period / self.grid) as f64 / self.hertz
    }

    /// Returns the number of steps in a common period.
    pub fn periods(&self) -> u64 {
        self.sample / self.grid
    }

    /// Returns the angle's row of the flow over whole clocks.
    fn angle(&self, clocks: u64) -> [Interval; PLANT] {
        let (high, low) = (clocks >> self.bits, clocks & ((1 << self.bits) - 1));
        row(&self.coarse[high as usize][2], &self.fine[low as usize])
    }

    /// Returns the growth rate of the loop's motion at a stiffness, in 1/s.
    pub fn growth_per_s(&self, stiffness: f64) -> f64 {
        let duty = self.rest.duty(stiffness);
        let order = self.orders([duty; 2])[0];
        let log = match order.waiting {
            0 => self.steps::<5>(order, stiffness).log_growth(stiffness),
            1 => self.steps::<6>(order, stiffness).log_growth(stiffness),
            2 => self.steps::<7>(order, stiffness).log_growth(stiffness),
            _ => self.steps::<8>(order, stiffness).log_growth(stiffness),
        };
        log / self.common_s()
    }

    /// Whether every motion is proved to die out at each stiffness of a stretch, with the duty that it has at rest.
    pub fn settles(&self, [low, high]: [f64; 2]) -> bool {
        let orders = self.orders([low, high].map(|stiffness| self.rest.duty(stiffness)));
        let middle = 0.5 * (low + high);
        orders.into_iter().all(|order| match order.waiting {
            0 => self.steps::<5>(order, middle).settles([low, high]),
            1 => self.steps::<6>(order, middle).settles([low, high]),
            2 => self.steps::<7>(order, middle).settles([low, high]),
            _ => self.steps::<8>(order, middle).settles([low, high]),
        })
    }

    /// Whether some motion is proved not to die out at a stiffness, with the duty that it has at rest.
    pub fn persists(&self, stiffness: f64) -> bool {
        let orders = self.orders([self.rest.duty(stiffness); 2]);
        orders.into_iter().all(|order| match order.waiting {
            0 => self.steps::<5>(order, stiffness).persists(stiffness),
            1 => self.steps::<6>(order, stiffness).persists(stiffness),
            2 => self.steps::<7>(order, stiffness).persists(stiffness),
            _ => self.steps::<8>(order, stiffness).persists(stiffness),
        })
    }

    /// Whether no more commands wait for the end of their pulse than is worked out.
    pub fn waits_short(&self) -> bool {
        self.orders([1.0; 2]).iter().all(|order| order.waiting <= MOST_WAITING)
    }

    /// Returns the orders of events that the duties between two ones have.
    fn orders(&self, duties: [f64; 2]) -> Vec<Order> {
        let [low, high] = duties.map(|duty| self.drive.pulse(duty));
        let (period, grid) = (self.period as f64, self.grid as f64);
        // Rounding of duties and clocks.
        let spare = 1e-15 * (4.0 * period + self.latency as f64);
        let span = |from: f64, to: f64, most: f64| {
            let (from, to) = (from.clamp(0.0, most), to.clamp(0.0, most));
            Span { at: 0.5 * (from + to), half: 0.5 * (to - from) + spare }
        };
        let latency = self.latency as f64;
        if self.latched {
            let phase = Span { at: (self.settling % self.grid) as f64, half: 0.0 };
            let (from, to) = (latency + low, latency + high);
            let each = (from / period) as usize..=(to / period) as usize;
            let order = |waiting: usize| {
                let before = waiting as f64 * period;
                Order { waiting, act: span(from - before, to - before, period), phase }
            };
            return each.map(order).collect();
        }
        let waiting = (self.latency / self.period) as usize;
        let act = Span { at: (self.latency % self.period) as f64, half: 0.0 };
        let (from, to) = (self.settling as f64 - high, self.settling as f64 - low);
        let (first, last) = ((from / grid).floor(), (to / grid).floor());
        if last - first > 1.0 {
            return vec![Order { waiting, act, phase: span(0.0, grid, grid) }];
        }
        let order = |turn: f64| Order { waiting, act, phase: span(from - turn * grid, to - turn * grid, grid) };
        if first == last { vec![order(first)] } else { vec![order(first), order(last)] }
    }

    /// Returns the steps of a common period with an order of events, with weights for stiffnesses near one.
    fn steps<const N: usize>(&self, order: Order, stiffness: f64) -> Steps<N> {
        let Order { waiting, act, phase } = order;
        let late = phase.at.fract();
        let tail = (late > 0.0).then(|| flow(&self.rates, Interval::exact(late).over(self.hertz)));
        let whole = phase.at as u64;
        let kick = self.kick.size();
        // The answer to the command at the middle of the stretch of duties, and those at its ends. In between, an
        // answer keeps between them, but for a share of its second derivative.
        let response = |at: f64| Response::new(self, at.clamp(0.0, self.period as f64), tail.as_ref());
        let own = response(act.at);
        let ends = (act.half > 1e-6).then(|| [act.at - act.half, act.at + act.half].map(response));
        let half_s = act.half / self.hertz;
        let size = |row: &[Interval; PLANT]| row.iter().map(|rate| rate.size() * rate.size()).sum::<f64>().sqrt();
        let by_kick = self.growth * kick * (1.0 + 1e-9);
        let error = |of: usize, own: Interval, at: &dyn Fn(&Response) -> Interval| match &ends {
            None => size(&self.rates[of]) * by_kick * half_s,
            Some(ends) => {
                let apart = ends.iter().map(|end| at(end).minus(own).size()).fold(0.0, f64::max);
                apart + size(&row(&self.rates[of], &self.rates)) * by_kick * half_s * half_s / 8.0
            }
        };

        let mut plain = Step { a: [[0.0; N]; N], g: [0.0; N], a_error: [[0.0; N]; N], g_error: [0.0; N] };
        let period = self.flow(self.period);
        // The column of the command that acts in this step: one that has waited, or the one just read.
        let acting = waiting.checked_sub(1).map(|oldest| NEWEST + oldest);
        let put =
            |step: &mut Step<N>, at: usize, columns: &[Interval; PLANT], pushed: Interval, [by_x, by_c]: [f64; 2]| {
                for (column, cell) in columns.iter().enumerate() {
                    (step.a[at][column], step.a_error[at][column]) = known(*cell, by_x);
                }
                let (value, error) = known(pushed, by_c);
                match acting {
                    None => (step.g[at], step.g_error[at]) = (value, error),
                    Some(column) => (step.a[at][column], step.a_error[at][column]) = (value, error),
                }
            };
        for (state, columns) in period.iter().enumerate().take(PLANT) {
            let pushed = own.state(self, state);
            let error = error(state, pushed, &|end| end.state(self, state));
            put(&mut plain, state, columns, pushed, [0.0, error]);
        }
        plain.a[SAMPLED][SAMPLED] = 1.0;
        plain.a[VELOCITY][VELOCITY] = 1.0;
        if waiting > 0 {
            plain.g[NEWEST] = 1.0;
            for older in 1..waiting {
                plain.a[NEWEST + older][NEWEST + older - 1] = 1.0;
            }
        }

        // A sample's row, what it has seen of the command, and the error of that.
        let by_x = self.speed() * phase.half;
        let sample = |index: usize| {
            let clock = index as u64 * self.sample % self.period + whole;
            let row = match &tail {
                None if whole == 0 => self.seen[index],
                None => self.angle(clock),
                Some(tail) => row(&self.angle(clock), tail),
            };
            let pushed = own.angle(self, clock);
            (row, pushed, error(2, pushed, &|end| end.angle(self, clock)) + by_x * kick)
        };
        let step_of = |index: usize| index as u64 * self.sample / self.period;
        let (mut kinds, mut runs) = (vec![plain.clone()], Vec::new());
        let (mut next, mut index) = (0, 0);
        while index < self.seen.len() {
            let at = step_of(index);
            if at > next {
                runs.push((0, (at - next) as u32));
            }
            let first = index;
            while index + 1 < self.seen.len() && step_of(index + 1) == at {
                index += 1;
            }
            let mut step = plain.clone();
            let (last, pushed, error) = sample(index);
            put(&mut step, SAMPLED, &last, pushed, [by_x, error]);
            step.a[SAMPLED][SAMPLED] = 0.0;
            // The velocity is the change since the sample before, in this step or an earlier one.
            if index > first {
                let (before, earlier, other) = sample(index - 1);
                let change = from_fn(|state| last[state].minus(before[state]));
                put(&mut step, VELOCITY, &change, pushed.minus(earlier), [2.0 * by_x, error + other]);
            } else {
                put(&mut step, VELOCITY, &last, pushed, [by_x, error]);
                step.a[VELOCITY][SAMPLED] = -1.0;
            }
            step.a[VELOCITY][VELOCITY] = 0.0;
            runs.push((kinds.len(), 1));
            kinds.push(step);
            (next, index) = (at + 1, index + 1);
        }
        let periods = self.periods();
        if periods > next {
            runs.push((0, (periods - next) as u32));
        }

        let own = self.scale / (stiffness + self.scale);
        let mut weights = [1.0; N];
        (weights[0], weights[1]) = (0.1 * own, 0.1 * own);
        weights[NEWEST..].fill(1e-2 * own * own);
        let mut damper = [0.0; N];
        damper[VELOCITY] = self.damper / self.scale;
        let spring = (if self.is_sampled { SAMPLED } else { 2 }, 1.0 / self.scale);
        Steps { kinds, order: runs, spring, damper, weights }
    }

    /// Returns the greatest change of the angle in a clock, from states of size 1.
    fn speed(&self) -> f64 {
        let square: f64 = self.rates[2].iter().map(|rate| rate.size() * rate.size()).sum();
        square.sqrt() * self.growth / self.hertz * (1.0 + 1e-9)
    }

    /// Returns the flow over whole clocks.
    fn flow(&self, clocks: u64) -> Flow {
        let (high, low) = (&self.coarse[(clocks >> self.bits) as usize], clocks & ((1 << self.bits) - 1));
        from_fn(|state| row(&high[state], &self.fine[low as usize]))
    }
}

/// The response of the plant to a command of one unit.
struct Response {
    /// The first whole clock from the command's effect on.
    after: u64,
    /// The states at that clock.
    start: [Interval; PLANT],
    /// The states that the samples see, whose clocks are later by a part of a clock, over the fine flows.
    seen: Vec<[Interval; PLANT]>,
}

impl Response {
    /// Returns the response to a command that acts at this time in clocks. `tail` is the flow over the part of a clock
    /// by which samples are late; where there is one, commands act at whole clocks.
    fn new(pulses: &Pulses, act: f64, tail: Option<&Flow>) -> Self {
        let after = act.ceil();
        let short = flow(&pulses.rates, Interval::exact(after - act).over(pulses.hertz));
        let start: [Interval; PLANT] = from_fn(|state| short[state][0].times(pulses.kick));
        let late = tail.map_or(start, |tail| from_fn(|state| dot(&tail[state], &start)));
        let seen = pulses.fine.iter().map(|fine| from_fn(|state| dot(&fine[state], &late))).collect();
        Self { after: after as u64, start, seen }
    }

    /// Returns a state at the end of the period.
    fn state(&self, pulses: &Pulses, state: usize) -> Interval {
        let clocks = pulses.period - self.after;
        let (high, low) = (clocks >> pulses.bits, clocks & ((1 << pulses.bits) - 1));
        dot(&row(&pulses.coarse[high as usize][state], &pulses.fine[low as usize]), &self.start)
    }

    /// Returns the angle that a sample sees at a clock.
    fn angle(&self, pulses: &Pulses, clock: u64) -> Interval {
        clock.checked_sub(self.after).map_or(Interval::ZERO, |since| {
            let (high, low) = (since >> pulses.bits, since & ((1 << pulses.bits) - 1));
            dot(&pulses.coarse[high as usize][2], &self.seen[low as usize])
        })
    }
}

/// Returns the damping of a loop that has no registers but those of its samples.
pub(super) fn plain_damping(scene: &Scene) -> Result<f64, Error> {
    let damping = scene.wall.damping_nm_s_per_rad;
    if !has_lines(scene) {
        return Err("its law reads no encoder's lines clock by clock".into());
    }
    if scene.faults.is_some() {
        return Err("its faults change the loop".into());
    }
    if scene.wall.ramp.is_some() {
        return Err("wall.ramp changes its wall during the run".into());
    }
    match scene.method.kind {
        Loop::Hybrid | Loop::Conventional => Ok(damping),
        Loop::Law(LawMethod::SampledWall(wall)) if scene.method.shaper_hz.is_none() => {
            let damping = damping - wall.relief_nm_s_per_rad;
            let is_plain = damping == 0.0 || (wall.estimator == Estimator::Difference && wall.ratio == 1);
            is_plain.then_some(damping).ok_or_else(|| "its velocity has registers of its own".into())
        }
        Loop::Law(_) => Err("its law has registers of its own".into()),
    }
}

fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Returns the flow of the plant over a time.
fn flow(rates: &Flow, time_s: Interval) -> Flow {
    let rows: Vec<Vec<Interval>> = rates.iter().map(|row| row.map(|rate| rate.times(time_s)).to_vec()).collect();
    let Matrix(change) = Series::new(&[&rows]).exponential_change().into_parts().swap_remove(0);
    from_fn(|state| {
        from_fn(|of| {
            let cell = change[state][of];
            if state == of { cell.plus(Interval::exact(1.0)) } else { cell }
        })
    })
}

fn dot(row: &[Interval; PLANT], column: &[Interval; PLANT]) -> Interval {
    row.iter().zip(column).fold(Interval::ZERO, |sum, (a, b)| sum.plus(a.times(*b)))
}

/// Returns a row times a flow.
fn row(row: &[Interval; PLANT], flow: &Flow) -> [Interval; PLANT] {
    from_fn(|of| (0..PLANT).fold(Interval::ZERO, |sum, k| sum.plus(row[k].times(flow[k][of]))))
}

/// Returns a number of an interval, and a bound of its error with another error added.
fn known(cell: Interval, error: f64) -> (f64, f64) {
    (cell.middle(), (cell.width() + error).next_up())
}
