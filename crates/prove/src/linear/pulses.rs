//! The linear loop through a modulator, from clock to clock, and its steps from one command to the next.
//!
//! A command acts once a period: another one moves the end of the pulse, which is an impulse on the winding. Both
//! phases of sign and magnitude have the same plant, because the off phase brakes; so this is the exact derivative of
//! the map from period to period. Events in the order of their clocks, those of one clock in this order:
//!
//! - *Read*: the command becomes `-K θ - (B/T) v`, with the position of the latest sample in the place of `θ` if the
//!   spring is sampled. A modulator that starts a period at clock `n` with the command it finds reads the encoder's
//!   lines of clock `n - (4 + settling)`, less the clocks of a host before it, and another one those of as many clocks
//!   before the pulse ends.
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

use hpu_cosim::scene::{Compound, Device, LawMethod, Loop, Scene, Winding};
use hpu_datapath::Estimator;

use super::lyapunov::{Motion, Square, Step, Steps};
use super::open_loop::{check_network, of_network};
use crate::Error;
use crate::interval::{Interval, Matrix};
use crate::series::Series;
use crate::waits::{Drive, Rest, has_lines};

/// Greatest number of samples in a common period.
const MOST_SAMPLES: u64 = 1 << 16;
/// Greatest number of modulator periods in a common period.
const MOST_PERIODS: u64 = 1 << 20;
/// Greatest number of commands that wait for the end of their pulse. A page works out fewer, and loads less code.
const MOST_WAITING: usize = if cfg!(target_family = "wasm") { 3 } else { 15 };
/// Most states of a network's plant.
pub(super) const MOST_PLANT: usize = 11;
/// Index of the angle at the encoder among the plant's states.
const ANGLE: usize = 2;

type Flow<const P: usize> = [[Interval; P]; P];

/// The linear loop of a scene through a modulator. The `P` states of the plant are current, speed and angle of the body
/// with the encoder, then those of other bodies.
pub(super) struct Pulses<const P: usize> {
    /// The plant in scaled states.
    rates: Flow<P>,
    hertz: f64,
    /// Clocks of the modulator's period and of the sample period, and their greatest common divisor.
    period: u64,
    sample: u64,
    grid: u64,
    /// Flows over clocks up to `1 << bits`, and over multiples of that.
    fine: Vec<Flow<P>>,
    coarse: Vec<Flow<P>>,
    bits: u32,
    /// The angle's row of the flow from a Read to each sample of a common period, without the phase between both.
    seen: Vec<[Interval; P]>,
    /// The current's change by a command of one unit.
    kick: Interval,
    /// Stiffness of the scaled states, in N·m/rad.
    scale: f64,
    /// Greatest factor by which the flow of a period enlarges the states.
    growth: f64,
    drive: Drive,
    latched: bool,
    /// Clocks from the encoder's lines to the modulator, and those of them that hold the command: `method.settling`
    /// and the host's.
    latency: u64,
    held: u64,
    /// Whether the spring is sampled.
    is_sampled: bool,
    /// Damping over the sample period.
    damper: f64,
    pub rest: Rest,
}

/// A number of clocks at both ends of a stretch, and a bound of its distance from the straight line in between.
#[derive(Clone, Copy)]
struct Span {
    ends: [f64; 2],
    bend: f64,
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

/// A plant in scaled states.
struct Plant<const P: usize> {
    rates: Flow<P>,
    /// The current's change by a command of one unit.
    kick: Interval,
    /// Stiffness of the scaled states, in N·m/rad.
    scale: f64,
    /// Greatest factor by which the flow of a period enlarges the states.
    growth: f64,
}

/// Returns the clocks of the modulator's period, or why its pulses are not worked out.
fn period_of(scene: &Scene) -> Result<u64, Error> {
    let Drive::Pulses { period, .. } = Drive::of(scene) else { unreachable!("the caller asks for pulses") };
    let pwm = scene.method.pwm;
    let refused = [
        (pwm.floating, "the off phase of its bridge leaves the winding open"),
        (pwm.dead_time_s > 0.0, "its bridge has a dead time"),
        (scene.model.winding == Winding::Resistive, "its winding has no inductance"),
    ];
    match refused.iter().find(|(is, _)| *is) {
        Some((_, why)) => Err(Error::new(why)),
        None => Ok(period),
    }
}

impl Pulses<3> {
    /// Returns the loop of a motor's scene.
    ///
    /// # Errors
    ///
    /// Returns the reason why it is not worked out.
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        let Device::Motor(motor) = &scene.device else { unreachable!("a modulator drives a motor") };
        let period = period_of(scene)?;
        let number = Interval::exact;
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = number(motor.resistance_ohm).plus(number(2.0 * scene.bridge.on_resistance_ohm));
        let period_s = period as f64 / scene.clock.frequency_hz() as f64;
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
        Self::around(scene, Plant { rates, kick, scale, growth })
    }
}

impl<const P: usize> Pulses<P> {
    /// Returns the loop of a network on a bridge, of at most `P` states. Where it has fewer, the others decay by
    /// themselves.
    ///
    /// # Errors
    ///
    /// Returns the reason why it is not worked out.
    pub fn of_network(scene: &Scene, compound: &Compound) -> Result<Self, Error> {
        check_network(compound)?;
        let period_s = period_of(scene)? as f64 / scene.clock.frequency_hz() as f64;
        let (a, drive) = of_network(compound);
        let Some((constant, resistance_ohm)) = compound.winding() else { unreachable!("a bridge drives it") };
        // The position of the body with the encoder is last there, and third here.
        let last = a.len() - 1;
        let order: Vec<usize> = [0, 1, last].into_iter().chain(2..last).collect();
        let sizes = balanced(&a, 1.0 / period_s);
        let mut rates = [[Interval::ZERO; P]; P];
        for (row, cells) in rates.iter_mut().enumerate() {
            cells[row] = Interval::exact(-1.0 / period_s);
        }
        for (row, &from) in order.iter().enumerate() {
            for (column, &of) in order.iter().enumerate() {
                // Powers of two: nothing is rounded.
                rates[row][column] = a[from][of].scaled(sizes[from] / sizes[of]);
            }
        }
        let full_ohm = Interval::exact(resistance_ohm).plus(Interval::exact(2.0 * scene.bridge.on_resistance_ohm));
        // The voltage of a unit of torque, over a period.
        let push = full_ohm.times(Interval::exact(period_s)).over(constant);
        let kick = drive[0].times(push).scaled(sizes[0] * sizes[last]);
        // Gershgorin's bound of the greatest eigenvalue of the symmetric part.
        let most = (0..P).map(|row| {
            let others = (0..P).filter(|column| *column != row);
            rates[row][row].hi + others.map(|of| 0.5 * rates[row][of].plus(rates[of][row]).size()).sum::<f64>()
        });
        let growth = libm::exp(most.fold(0.0, f64::max) * period_s) * (1.0 + 1e-9);
        Self::around(scene, Plant { rates, kick, scale: sizes[last] * sizes[last], growth })
    }

    /// Index of the position of the latest sample, of the velocity, and of the newest command that waits.
    const SAMPLED: usize = P;
    const VELOCITY: usize = P + 1;
    const NEWEST: usize = P + 2;

    /// Returns the loop of a scene around its plant.
    fn around(scene: &Scene, plant: Plant<P>) -> Result<Self, Error> {
        let Plant { rates, kick, scale, growth } = plant;
        let drive = Drive::of(scene);
        let Drive::Pulses { period, latched, .. } = drive else { unreachable!("the caller asks for pulses") };
        let damping = plain_damping(scene)?;
        let rest = Rest::of(scene).ok_or("the hand leaves it no place of rest")?;
        let held = u64::from(scene.method.settling) + scene.host_clocks;
        let sample = scene.period_clocks();
        let grid = common_divisor(period, sample);
        let (samples, periods) = (period / grid, sample / grid);
        if samples > MOST_SAMPLES || periods > MOST_PERIODS {
            return Err(format!("sample and modulator have the same phase only after {samples} samples").into());
        }
        let hertz = scene.clock.frequency_hz() as f64;
        let bits = period.ilog2().div_ceil(2);
        let flow = |clocks: u64| flow(&rates, Interval::exact(clocks as f64).over(hertz));
        let fine: Vec<Flow<P>> = (0..1 << bits).map(flow).collect();
        let coarse: Vec<Flow<P>> = (0..=period >> bits).map(|high| flow(high << bits)).collect();
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
            latency: drive.lines(scene) + held,
            held,
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
    fn angle(&self, clocks: u64) -> [Interval; P] {
        let (high, low) = (clocks >> self.bits, clocks & ((1 << self.bits) - 1));
        row(&self.coarse[high as usize][ANGLE], &self.fine[low as usize])
    }

    /// Returns the growth rate of the loop's motion at a stiffness, in 1/s.
    pub fn growth_per_s(&self, stiffness: f64) -> f64 {
        let motions = self.motions([stiffness; 2]);
        motions[0].log_growth() / self.common_s()
    }

    /// Whether every motion is proved to die out at each stiffness of a stretch, with the duty that it has at rest.
    pub fn settles(&self, stretch: [f64; 2]) -> bool {
        self.motions(stretch).iter().all(|motion| motion.settles())
    }

    /// Whether some motion is proved not to die out at a stiffness, with the duty that it has at rest.
    pub fn persists(&self, stiffness: f64) -> bool {
        self.motions([stiffness; 2]).iter().all(|motion| motion.persists())
    }

    /// Returns the motions over a stretch of stiffnesses: one of each order of events.
    fn motions(&self, stretch: [f64; 2]) -> Vec<Box<dyn Motion>> {
        let motion = |order: Order| -> Box<dyn Motion> {
            match Self::NEWEST + order.waiting {
                ..=5 => Box::new(self.steps::<5>(order, stretch)),
                6 => Box::new(self.steps::<6>(order, stretch)),
                7 => Box::new(self.steps::<7>(order, stretch)),
                _ if cfg!(target_family = "wasm") => Box::new(self.steps::<8>(order, stretch)),
                8 => Box::new(self.steps::<8>(order, stretch)),
                // States beyond those that there are stay 0.
                9..=13 => Box::new(self.steps::<13>(order, stretch)),
                14..=20 => Box::new(self.steps::<20>(order, stretch)),
                _ => Box::new(self.steps::<{ MOST_PLANT + 2 + MOST_WAITING }>(order, stretch)),
            }
        };
        let duties = stretch.map(|stiffness| self.rest.duty(stiffness));
        self.orders(duties, self.rest.bend(stretch)).into_iter().map(motion).collect()
    }

    /// Whether no more commands wait for the end of their pulse than is worked out.
    pub fn waits_short(&self) -> bool {
        self.orders([1.0; 2], 0.0).iter().all(|order| order.waiting <= MOST_WAITING)
    }

    /// Returns the orders of events that the duties along a stretch have. The duties depart from the straight line
    /// between the two ends by no more than `bend`.
    fn orders(&self, duties: [f64; 2], bend: f64) -> Vec<Order> {
        let [low, high] = duties.map(|duty| self.drive.pulse(duty));
        let (period, grid, latency) = (self.period as f64, self.grid as f64, self.latency as f64);
        // Rounding of duties and clocks.
        let spare = 1e-15 * (4.0 * period + latency);
        let line = |ends: [f64; 2]| Span { ends, bend: bend * period + spare };
        // A part of the stretch: any clock within the limits.
        let part = |ends: [f64; 2], most: f64| {
            let [from, to] = ends.map(|end| end.clamp(0.0, most));
            Span { ends: [0.5 * (from + to); 2], bend: 0.5 * (to - from).abs() + spare }
        };
        let whole = |clocks: u64| Span { ends: [clocks as f64; 2], bend: 0.0 };
        if self.latched {
            let phase = whole(self.held % self.grid);
            let ends = [latency + low, latency + high];
            let [first, last] = ends.map(|end| (end / period) as usize);
            let order = |waiting: usize| {
                let since = ends.map(|end| end - waiting as f64 * period);
                Order { waiting, act: if first == last { line(since) } else { part(since, period) }, phase }
            };
            return (first..=last).map(order).collect();
        }
        let (waiting, act) = ((self.latency / self.period) as usize, whole(self.latency % self.period));
        let ends = [self.held as f64 - low, self.held as f64 - high];
        let [last, first] = ends.map(|end| (end / grid).floor());
        let order = |turn: f64, all: bool| {
            let since = ends.map(|end| end - turn * grid);
            Order { waiting, act, phase: if all { line(since) } else { part(since, grid) } }
        };
        match (last - first) as u64 {
            0 => vec![order(first, true)],
            1 => vec![order(first, false), order(last, false)],
            _ => vec![Order { waiting, act, phase: part([0.0, grid], grid) }],
        }
    }

    /// Returns a step without a sample.
    fn plain<const N: usize>(&self, acts: &Acts<P>, waiting: usize) -> Step<N> {
        let mut plain = Step { a: [[[0.0; N]; N]; 2], g: [[0.0; N]; 2], a_error: [[0.0; N]; N], g_error: [0.0; N] };
        for (state, row) in self.flow(self.period).into_iter().enumerate() {
            plain.put(state, [row; 2], 0.0, acts.state(state), waiting);
        }
        set(&mut plain.a, Self::SAMPLED, Self::SAMPLED, [1.0; 2]);
        set(&mut plain.a, Self::VELOCITY, Self::VELOCITY, [1.0; 2]);
        if waiting > 0 {
            (plain.g[0][Self::NEWEST], plain.g[1][Self::NEWEST]) = (1.0, 1.0);
            for older in 1..waiting {
                set(&mut plain.a, Self::NEWEST + older, Self::NEWEST + older - 1, [1.0; 2]);
            }
        }
        plain
    }

    /// Returns the steps of a common period with an order of events over a stretch of stiffnesses.
    fn steps<const N: usize>(&self, order: Order, stretch: [f64; 2]) -> Steps<N> {
        let Order { waiting, act, phase } = order;
        let acts = Acts::new(self, act, phase);
        let plain: Step<N> = self.plain(&acts, waiting);

        // What a sample errs by where its clock departs from the straight line.
        let by_x = acts.by_phase;
        let sample = |index: usize| {
            let clock = index as u64 * self.sample % self.period;
            (acts.row(index, clock), acts.angle(clock))
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
            let (last, pushed) = sample(index);
            step.put(Self::SAMPLED, last, by_x, pushed, waiting);
            set(&mut step.a, Self::SAMPLED, Self::SAMPLED, [0.0; 2]);
            // The velocity is the change since the sample before, in this step or an earlier one.
            if index > first {
                let (before, earlier) = sample(index - 1);
                let change: [[Interval; P]; 2] =
                    from_fn(|end| from_fn(|state| last[end][state].minus(before[end][state])));
                step.put(Self::VELOCITY, change, 2.0 * by_x, pushed.minus(earlier), waiting);
            } else {
                step.put(Self::VELOCITY, last, by_x, pushed, waiting);
                set(&mut step.a, Self::VELOCITY, Self::SAMPLED, [-1.0; 2]);
            }
            set(&mut step.a, Self::VELOCITY, Self::VELOCITY, [0.0; 2]);
            runs.push((kinds.len(), 1));
            kinds.push(step);
            (next, index) = (at + 1, index + 1);
        }
        let periods = self.periods();
        if periods > next {
            runs.push((0, (periods - next) as u32));
        }

        let own = self.scale / (0.5 * (stretch[0] + stretch[1]) + self.scale);
        let mut weights = [1.0; N];
        (weights[0], weights[1]) = (0.1 * own, 0.1 * own);
        weights[3..P].fill(0.1 * own);
        weights[Self::NEWEST..].fill(1e-2 * own * own);
        let spring = if self.is_sampled { Self::SAMPLED } else { ANGLE };
        let answers = stretch.map(|stiffness| {
            let mut answer = [0.0; N];
            answer[Self::VELOCITY] = self.damper / self.scale;
            answer[spring] = stiffness / self.scale;
            answer
        });
        Steps { kinds, order: runs, answers, weights }
    }

    /// Returns the flow over whole clocks.
    fn flow(&self, clocks: u64) -> Flow<P> {
        let (high, low) = (&self.coarse[(clocks >> self.bits) as usize], clocks & ((1 << self.bits) - 1));
        from_fn(|state| row(&high[state], &self.fine[low as usize]))
    }
}

impl<const N: usize> Step<N> {
    /// Puts what a state becomes: of the plant's states, which err by `by_x`, and of the command that acts in this
    /// step. That is one that has waited, or the one just read.
    fn put<const P: usize>(&mut self, at: usize, row: [[Interval; P]; 2], by_x: f64, pushed: Pushed, waiting: usize) {
        let cells: [_; P] = from_fn(|column| [row[0][column], row[1][column]]);
        for (column, ends) in cells.into_iter().enumerate() {
            let (ends, error) = known(ends, by_x);
            set(&mut self.a, at, column, ends);
            self.a_error[at][column] = error;
        }
        let (ends, error) = known(pushed.ends, pushed.error);
        if waiting == 0 {
            [self.g[0][at], self.g[1][at]] = ends;
            self.g_error[at] = error;
        } else {
            set(&mut self.a, at, P + 1 + waiting, ends);
            self.a_error[at][P + 1 + waiting] = error;
        }
    }
}

/// What the plant's states and the samples see of a command of one unit, over a stretch.
struct Acts<'a, const P: usize> {
    pulses: &'a Pulses<P>,
    /// The softest stiffness and the stiffest one; one alone if both have the same clocks.
    ends: Vec<Act<P>>,
    /// By how much the current, the speed and the angle depart from the straight line between both ends.
    errors: [f64; P],
    /// By how much a sample's row departs from the straight line, for states of size 1.
    by_phase: f64,
}

/// A command's effect at one stiffness.
struct Act<const P: usize> {
    response: Response<P>,
    /// The whole clocks by which samples are late, and the flow over the part of a clock by which they are later still.
    whole: u64,
    tail: Option<Flow<P>>,
}

/// A command's effect at both ends of a stretch, and a bound of its distance from the straight line in between.
#[derive(Clone, Copy)]
struct Pushed {
    ends: [Interval; 2],
    error: f64,
}

impl Pushed {
    fn minus(self, other: Self) -> Self {
        let ends = from_fn(|end| self.ends[end].minus(other.ends[end]));
        Self { ends, error: self.error + other.error }
    }
}

impl<'a, const P: usize> Acts<'a, P> {
    fn new(pulses: &'a Pulses<P>, act: Span, phase: Span) -> Self {
        let end = |end: usize| {
            let late = phase.ends[end].fract();
            let tail = (late > 0.0).then(|| flow(&pulses.rates, Interval::exact(late).over(pulses.hertz)));
            let at = act.ends[end].clamp(0.0, pulses.period as f64);
            Act { response: Response::new(pulses, at, tail.as_ref()), whole: phase.ends[end] as u64, tail }
        };
        let is_point = act.ends[0] == act.ends[1] && phase.ends[0] == phase.ends[1];
        let ends = (0..if is_point { 1 } else { 2 }).map(end).collect();
        // A function departs from the straight line by at most an eighth of its second derivative times the squared
        // distance of the ends, and where its argument departs from a straight line by its first one times that.
        let size = |row: &[Interval; P]| row.iter().map(|rate| rate.size() * rate.size()).sum::<f64>().sqrt();
        let error = |of: usize, span: Span| {
            let [apart_s, bend_s] = [span.ends[1] - span.ends[0], span.bend].map(|clocks| clocks / pulses.hertz);
            let rates = &pulses.rates[of];
            let bent = size(&row(rates, &pulses.rates)) * apart_s * apart_s / 8.0 + size(rates) * bend_s;
            pulses.growth * bent * (1.0 + 1e-9)
        };
        let errors = from_fn(|of| pulses.kick.size() * error(of, act));
        Self { pulses, ends, errors, by_phase: error(ANGLE, phase) }
    }

    /// Returns something of both ends.
    fn both<T: Copy>(&self, of: impl Fn(&Act<P>) -> T) -> [T; 2] {
        let soft = of(&self.ends[0]);
        [soft, self.ends.get(1).map_or(soft, of)]
    }

    /// Returns a state at the end of the period.
    fn state(&self, state: usize) -> Pushed {
        Pushed { ends: self.both(|end| end.response.state(self.pulses, state)), error: self.errors[state] }
    }

    /// Returns the angle that a sample sees whose clock without the phase is this one.
    fn angle(&self, clock: u64) -> Pushed {
        let ends = self.both(|end| end.response.angle(self.pulses, clock + end.whole));
        Pushed { ends, error: self.errors[ANGLE] + self.by_phase * self.pulses.kick.size() }
    }

    /// Returns the rows of a sample whose clock without the phase is this one.
    fn row(&self, index: usize, clock: u64) -> [[Interval; P]; 2] {
        self.both(|Act { whole, tail, .. }| match tail {
            None if *whole == 0 => self.pulses.seen[index],
            None => self.pulses.angle(clock + whole),
            Some(tail) => row(&self.pulses.angle(clock + whole), tail),
        })
    }
}

/// The response of the plant to a command of one unit.
struct Response<const P: usize> {
    /// The first whole clock from the command's effect on.
    after: u64,
    /// The states at that clock.
    start: [Interval; P],
    /// The states that the samples see, whose clocks are later by a part of a clock, over the fine flows.
    seen: Vec<[Interval; P]>,
}

impl<const P: usize> Response<P> {
    /// Returns the response to a command that acts at this time in clocks. `tail` is the flow over the part of a clock
    /// by which samples are late; where there is one, commands act at whole clocks.
    fn new(pulses: &Pulses<P>, act: f64, tail: Option<&Flow<P>>) -> Self {
        let after = act.ceil();
        let short = flow(&pulses.rates, Interval::exact(after - act).over(pulses.hertz));
        let start: [Interval; P] = from_fn(|state| short[state][0].times(pulses.kick));
        let late = tail.map_or(start, |tail| from_fn(|state| dot(&tail[state], &start)));
        let seen = pulses.fine.iter().map(|fine| from_fn(|state| dot(&fine[state], &late))).collect();
        Self { after: after as u64, start, seen }
    }

    /// Returns a state at the end of the period.
    fn state(&self, pulses: &Pulses<P>, state: usize) -> Interval {
        let clocks = pulses.period - self.after;
        let (high, low) = (clocks >> pulses.bits, clocks & ((1 << pulses.bits) - 1));
        dot(&row(&pulses.coarse[high as usize][state], &pulses.fine[low as usize]), &self.start)
    }

    /// Returns the angle that a sample sees at a clock.
    fn angle(&self, pulses: &Pulses<P>, clock: u64) -> Interval {
        clock.checked_sub(self.after).map_or(Interval::ZERO, |since| {
            let (high, low) = (since >> pulses.bits, since & ((1 << pulses.bits) - 1));
            dot(&pulses.coarse[high as usize][ANGLE], &self.seen[low as usize])
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

/// Returns the sizes of scaled states, powers of two, for which the rates between two states are about equal both ways.
/// A state that moves others and that none moves gets a rate of a tenth of `hertz` at most.
fn balanced(a: &[Vec<Interval>], hertz: f64) -> Vec<f64> {
    let size = |row: usize, of: usize, sizes: &[f64]| a[row][of].size() * sizes[row] / sizes[of];
    let mut sizes = vec![1.0; a.len()];
    for _ in 0..60 {
        for state in 0..a.len() {
            let others = || (0..a.len()).filter(|of| *of != state);
            let moved: f64 = others().map(|of| size(state, of, &sizes)).sum();
            let moves: f64 = others().map(|of| size(of, state, &sizes)).sum();
            let moves = if moves == 0.0 { 0.01 * hertz * hertz / moved } else { moves };
            if moved > 0.0 {
                sizes[state] *= libm::exp2(libm::round(0.5 * libm::log2(moves / moved)));
            }
        }
    }
    sizes
}

fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Returns the flow of the plant over a time.
fn flow<const P: usize>(rates: &Flow<P>, time_s: Interval) -> Flow<P> {
    let rows: Vec<Vec<Interval>> = rates.iter().map(|row| row.map(|rate| rate.times(time_s)).to_vec()).collect();
    let Matrix(change) = Series::new(&[&rows]).exponential_change().into_parts().swap_remove(0);
    from_fn(|state| {
        from_fn(|of| {
            let cell = change[state][of];
            if state == of { cell.plus(Interval::exact(1.0)) } else { cell }
        })
    })
}

fn dot<const P: usize>(row: &[Interval; P], column: &[Interval; P]) -> Interval {
    row.iter().zip(column).fold(Interval::ZERO, |sum, (a, b)| sum.plus(a.times(*b)))
}

/// Returns a row times a flow.
fn row<const P: usize>(row: &[Interval; P], flow: &Flow<P>) -> [Interval; P] {
    from_fn(|of| (0..P).fold(Interval::ZERO, |sum, k| sum.plus(row[k].times(flow[k][of]))))
}

/// Returns a number of each of two intervals, and a bound of their errors with another error added.
fn known(cells: [Interval; 2], error: f64) -> ([f64; 2], f64) {
    let width = cells[0].width().max(cells[1].width());
    (cells.map(Interval::middle), (width + error).next_up())
}

fn set<const N: usize>(ends: &mut [Square<N>; 2], row: usize, column: usize, values: [f64; 2]) {
    for (matrix, value) in ends.iter_mut().zip(values) {
        matrix[row][column] = value;
    }
}

#[cfg(test)]
mod tests {
    use hpu_cosim::scene::{Scene, shipped};

    use super::{Pulses, Steps};

    /// Whether the steps at a stiffness of a stretch are the straight line between those of its ends, within the bounds
    /// of their errors; and the greatest share of a bound that is used.
    fn used<const N: usize>(over: &Steps<N>, at: &Steps<N>, share: f64) -> f64 {
        assert_eq!(over.order, at.order);
        let line = |[low, high]: [f64; 2]| low + share * (high - low);
        let pairs = over.kinds.iter().zip(&at.kinds);
        let cells = pairs.flat_map(|(over, at)| {
            let of_g = (0..N).map(|row| ([over.g[0][row], over.g[1][row]], at.g[0][row], over.g_error[row]));
            let of_a = (0..N * N).map(|cell| {
                let (row, column) = (cell / N, cell % N);
                let ends = [over.a[0][row][column], over.a[1][row][column]];
                (ends, at.a[0][row][column], over.a_error[row][column])
            });
            of_g.chain(of_a).collect::<Vec<_>>()
        });
        let away = cells.map(|(ends, at, error)| ((at - line(ends)).abs() - 1e-15) / error);
        away.filter(|share| !share.is_nan()).fold(0.0, f64::max)
    }

    #[test]
    fn steps_of_a_stretch_hold_those_of_each_of_its_stiffnesses() {
        for (name, keys, stretches) in [
            ("hybrid-wall", &[][..], [[0.1, 0.4], [2.0, 2.9]]),
            ("hybrid-wall", &[("method.pwm.duty", "immediate")], [[0.1, 0.11], [2.0, 2.0003]]),
            ("hybrid-wall", &[("method.pwm.mode", "locked_antiphase")], [[0.1, 0.4], [2.0, 2.9]]),
            ("conventional-wall-1khz", &[], [[0.1, 0.4], [0.6, 0.76]]),
            ("slow-pwm", &[], [[0.01, 0.05], [0.9, 1.04]]),
        ] {
            let shipped = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
            let set: Vec<_> = keys.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
            let scene = Scene::parse(name, shipped.text, &set, &mut |_| unreachable!()).expect("a scene");
            let pulses = Pulses::new(&scene).expect("a modulator");
            for [low, high] in stretches {
                let steps = |stretch: [f64; 2]| {
                    let orders =
                        pulses.orders(stretch.map(|stiffness| pulses.rest.duty(stiffness)), pulses.rest.bend(stretch));
                    assert!(orders.len() == 1 && orders[0].waiting == 0, "{name} from {low} to {high}");
                    pulses.steps::<5>(orders[0], stretch)
                };
                let over = steps([low, high]);
                let most = (0..=20)
                    .map(|twentieth| f64::from(twentieth) / 20.0)
                    .map(|share| used(&over, &steps([low + share * (high - low); 2]), share));
                let most = most.fold(0.0, f64::max);
                assert!((0.05..=1.0).contains(&most), "{name} {keys:?} from {low} to {high}: {most} of the bounds");
            }
        }
    }
}
