//! The world of an axis in high precision: an independent implementation of the equations of `hpu_plant` and of the
//! wiring around them.
//!
//! Every `f64` of the plant (parameters, the clock's period, the hand's knots, a force, the limits of a count) is taken
//! as that exact number. The state is stepped from event to event; at this precision the length of a step has no
//! effect.

use hpu_cosim::{Schedule, Summary, World};
use hpu_datapath::{LoopIn, LoopOut};
use hpu_signal::Real;

use crate::fixed::Fixed;
use crate::flow::{ANGLE, CURRENT, Flow, SPEED, Vector};
use crate::laws::{Drive, Laws};
use crate::mean::{Change, Mean};
use crate::shaft::Shaft;
use crate::winding::{Bridge, Path};

/// The state of the axis and its encoder, at a clock edge.
#[derive(Clone)]
pub struct PreciseWorld<'p, const N: usize> {
    laws: &'p Laws<N>,
    flow: &'p Flow<N>,
    bridge: Bridge<N>,
    path: Path,
    shaft: Shaft,
    /// Index of the net that is the command.
    command: usize,
    schedule: Schedule,
    edge: u64,
    /// Current, speed, angle relative to `intent`.
    x: Vector<N>,
    g: Vector<N>,
    /// The voltage that drives the current, over the inductance: V/L.
    volts_per_henry: Fixed<N>,
    intent: Fixed<N>,
    intent_speed: Fixed<N>,
    knot: usize,
    duty: f64,
    mean: Mean<N>,
    /// A duty, with the edge from which it is given.
    waiting: Option<(u64, f64)>,
    count: i64,
    crossings: u64,
    mode_changes: u64,
    /// The least distance between the angle and a limit at the edges on both sides of a crossing.
    pub nearest: f64,
}

impl<'p, const N: usize> PreciseWorld<'p, N> {
    /// Creates the world at edge 0, all gates off.
    pub fn new(laws: &'p Laws<N>, command: usize, schedule: Schedule) -> Self {
        let zero = Fixed::ZERO;
        let mut world = Self {
            laws,
            flow: &laws.still[0],
            bridge: laws.bridge,
            path: Path::Driven,
            shaft: Shaft::Free,
            command,
            schedule,
            edge: 0,
            x: laws.start,
            g: [zero; 3],
            volts_per_henry: zero,
            intent: zero,
            intent_speed: zero,
            knot: 0,
            duty: 0.0,
            mean: Mean::default(),
            waiting: None,
            count: 0,
            crossings: 0,
            mode_changes: 0,
            nearest: f64::INFINITY,
        };
        world.driven();
        world.due();
        // Settles only after the hand is at its start.
        world.settle();
        if let Drive::Switching = laws.drive {
            world.path = world.bridge.path(&world.x);
        }
        world.driven();
        world.count();
        world.crossings = 0;
        world
    }

    /// Returns current, speed and angle at an edge before the next event.
    pub fn outputs(&self, edge: u64) -> [Fixed<N>; 3] {
        let (x, intent) = self.ahead(edge - self.edge);
        [x[CURRENT], x[SPEED], x[ANGLE] + intent]
    }

    pub fn angle(&self) -> Fixed<N> {
        self.x[ANGLE] + self.intent
    }

    /// Returns the distance from the angle to the nearer limit of its count, negative outside of the count.
    pub fn gap(&self) -> Fixed<N> {
        let angle = self.angle();
        (angle - self.limit(self.count)).min(self.limit(self.count + 1) - angle)
    }

    fn limit(&self, count: i64) -> Fixed<N> {
        Fixed::of(count as f64 * self.laws.count_rad)
    }

    /// Moves the count to the angle.
    fn count(&mut self) {
        let angle = self.angle();
        while angle < self.limit(self.count) {
            self.count -= 1;
            self.crossings += 1;
        }
        while angle >= self.limit(self.count + 1) {
            self.count += 1;
            self.crossings += 1;
        }
    }

    /// Returns the part of the shaft's acceleration that comes neither from the state nor from friction.
    fn pull(&self) -> Fixed<N> {
        let laws = self.laws;
        if laws.prescribed {
            return Fixed::ZERO;
        }
        laws.torque_per_inertia + laws.hand_damping_per_inertia * self.intent_speed
    }

    /// Sets the shaft's mode by its state.
    fn settle(&mut self) {
        self.shaft = self.laws.friction.shaft(&self.x, self.pull());
    }

    /// Sets the constants of the motion from here on: `x' = A x + g`.
    fn driven(&mut self) {
        if self.shaft == Shaft::Stuck {
            // The new drive may tear the shaft off.
            self.settle();
            self.mode_changes += u64::from(self.shaft != Shaft::Stuck);
        }
        let flows = match (&self.laws.drive, self.path) {
            (Drive::Force { .. } | Drive::None, _) | (_, Path::Open) => &self.laws.still,
            (Drive::Averaged { .. }, _) => &self.laws.closed[2],
            (Drive::Switching, path) => &self.laws.closed[self.bridge.drive(path).1],
        };
        if let Drive::Switching = self.laws.drive {
            self.volts_per_henry = self.bridge.drive(self.path).0 * self.laws.per_inductance;
        }
        self.flow = &flows[usize::from(self.shaft == Shaft::Stuck)];
        self.g = [self.volts_per_henry, self.laws.friction.push(self.shaft, self.pull()), -self.intent_speed];
    }

    /// Carries out the duty and the hand's knots that are due at this edge.
    fn due(&mut self) {
        if let Some((_, duty)) = self.waiting.filter(|waiting| waiting.0 <= self.edge) {
            self.waiting = None;
            self.average(Fixed::of(duty));
            self.driven();
        }
        while let Some(knot) = self.laws.knots.get(self.knot).filter(|knot| knot.edge <= self.edge) {
            self.knot += 1;
            let angle = if self.laws.prescribed { Fixed::of(knot.angle_rad) } else { self.angle() };
            self.intent = Fixed::of(knot.angle_rad);
            self.intent_speed = Fixed::of(knot.speed_rad_per_s);
            self.x[ANGLE] = angle - self.intent;
            if self.laws.prescribed {
                self.x[SPEED] = self.intent_speed;
            }
            self.driven();
            self.count();
        }
    }

    /// Returns the next edge at which something outside the motion is due.
    fn next_due(&self) -> u64 {
        let knot = self.laws.knots.get(self.knot).map(|knot| knot.edge);
        let duty = self.waiting.map(|waiting| waiting.0);
        knot.into_iter().chain(duty).chain(self.schedule.next(self.edge)).min().unwrap_or(u64::MAX)
    }

    fn average(&mut self, duty: Fixed<N>) {
        let Drive::Averaged { supply_v, .. } = self.laws.drive else { return };
        self.mean.given.push((self.edge, duty));
        self.volts_per_henry = -(Fixed::of(supply_v) * duty * self.laws.per_inductance);
    }

    /// Returns state and intent so many edges later.
    fn ahead(&self, edges: u64) -> (Vector<N>, Fixed<N>) {
        let x = self.flow.after(edges, self.x, &self.g);
        (x, self.intent + self.intent_speed * (Fixed::whole(edges) * self.laws.edge_s))
    }

    fn go(&mut self, edges: u64) {
        (self.x, self.intent) = self.ahead(edges);
        self.edge += edges;
    }

    /// Flows over the edge in which a mode of the shaft or of the winding ends, and possibly the modes after it.
    fn turn(&mut self) {
        let mut left = self.laws.edge_s;
        for _ in 0..8 {
            let (pull, friction, bridge) = (self.pull(), self.laws.friction, self.bridge);
            let (shaft, path) = (self.shaft, self.path);
            let end = self.flow.part(left, &self.x, &self.g);
            let rubs = |x: &Vector<N>| friction.margin(shaft, x, pull);
            let leads = |x: &Vector<N>| bridge.margin(path, x);
            let shaft_ends = rubs(&end).is_negative().then(|| self.flow.end(&self.x, &self.g, left, rubs));
            let path_ends = leads(&end).is_negative().then(|| self.flow.end(&self.x, &self.g, left, leads));
            let Some(time) = shaft_ends.into_iter().chain(path_ends).min() else {
                self.x = end;
                self.intent = self.intent + self.intent_speed * left;
                self.edge += 1;
                return;
            };
            self.x = self.flow.part(time, &self.x, &self.g);
            self.intent = self.intent + self.intent_speed * time;
            left = left - time;
            self.mode_changes += 1;
            if shaft_ends == Some(time) {
                self.x[SPEED] = Fixed::ZERO;
                if shaft == Shaft::Stuck {
                    self.shaft = friction.torn_off(&self.x, pull);
                } else {
                    self.settle();
                }
            } else {
                if path != Path::Open {
                    self.x[CURRENT] = Fixed::ZERO;
                }
                self.path = bridge.next(path, &self.x);
            }
            self.driven();
        }
        panic!("modes change without end at edge {}", self.edge);
    }

    fn outside(&self, (x, intent): &(Vector<N>, Fixed<N>)) -> bool {
        let angle = x[ANGLE] + *intent;
        angle < self.limit(self.count) || angle >= self.limit(self.count + 1)
    }

    /// Flows by so many edges, or to the first of them at which the angle is outside of its count. Returns whether it
    /// is.
    ///
    /// The angle's path lies between the parabolas of the greatest acceleration. If neither leaves the count, there is
    /// no crossing. If the speed keeps its sign, the angle is monotone: its end decides, and halving finds the edge.
    /// Otherwise the time is halved, down to one edge.
    fn cross(&mut self, edges: u64) -> bool {
        let x = self.x.map(Fixed::float);
        // The angle's own speed, not relative to the intent.
        let speed = x[SPEED];
        let time_s = self.flow.at_most_s(edges);
        let [surge, bend] = self.flow.fastest(edges, &x, &self.g.map(Fixed::float)).map(|most| most * time_s);
        let angle = self.angle();
        let below = (angle - self.limit(self.count)).float();
        let above = (self.limit(self.count + 1) - angle).float();
        let (slowest, fastest) = (speed - bend, speed + bend);
        let reach = |most: f64| (most.max(0.0) * time_s) * (1.0 + 1e-9);
        let own = if let Shaft::Slips { forward: false } = self.shaft { -fastest } else { slowest };
        let rate = self.flow.rate(&self.x, &self.g);
        let lasts = self.laws.friction.lasts(self.shaft, &self.x, &rate, self.pull(), time_s, own)
            && self.bridge.lasts(self.path, &self.x, surge, bend);
        if lasts && reach(fastest) < above && reach(-slowest) <= below {
            self.go(edges);
            return false;
        }
        if edges == 1 || lasts && (slowest > speed.abs() * 1e-9 || fastest < -speed.abs() * 1e-9) {
            let end = self.ahead(edges);
            let margins =
                [self.laws.friction.margin(self.shaft, &end.0, self.pull()), self.bridge.margin(self.path, &end.0)];
            if margins.iter().any(|margin| margin.is_negative()) {
                let gap = self.gap();
                self.turn();
                let crossed = self.gap().is_negative() || self.angle() == self.limit(self.count + 1);
                if crossed {
                    self.nearest = self.nearest.min(gap.float()).min(self.gap().abs().float());
                }
                return crossed;
            }
            if !self.outside(&end) {
                (self.x, self.intent) = end;
                self.edge += edges;
                return false;
            }
            // The angle is inside at this edge, and outside `left` edges later.
            let mut left = edges;
            while left > 1 {
                let half = left / 2;
                let middle = self.ahead(half);
                if self.outside(&middle) {
                    left = half;
                } else {
                    (self.x, self.intent) = middle;
                    self.edge += half;
                    left -= half;
                }
            }
            let gap = self.gap();
            self.go(1);
            self.nearest = self.nearest.min(gap.float()).min(self.gap().abs().float());
            return true;
        }
        self.cross(edges / 2) || self.cross(edges - edges / 2)
    }
}

impl<const N: usize> World for PreciseWorld<'_, N> {
    type In = LoopIn<i64>;
    type Out = LoopOut<i64>;
    type Row = [f64; 3];
    const REALS: &'static [Real] = &[
        Real { name: "current_a", doc: "Motor current" },
        Real { name: "speed_rad_per_s", doc: "Speed of the shaft" },
        Real { name: "angle_rad", doc: "Angle of the shaft" },
    ];

    fn edge(&self) -> u64 {
        self.edge
    }

    fn place(&self, input: &mut LoopIn<i64>) {
        // Forward, line B leads.
        [input.a_pin, input.b_pin] = [[0, 0], [0, 1], [1, 1], [1, 0]][self.count.rem_euclid(4) as usize];
        if let Some(ramp) = self.schedule.stiffness {
            input.stiffness = ramp.word(self.edge);
        }
        if let Some(ramp) = self.schedule.scale {
            input.scale = ramp.word(self.edge);
        }
        if let Some(target) = &self.schedule.target {
            input.reference = target.word(self.edge);
        }
    }

    fn sense(&mut self) {
        self.advance(self.edge + 1, |_, _| {});
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let last = self.next_due().min(limit);
        let mut next = self.clone();
        let mut crossed = false;
        while !crossed && next.edge < last {
            crossed = next.cross(self.flow.window().min(last - next.edge));
        }
        before(self, next.edge);
        *self = next;
        if crossed {
            self.count();
        }
        self.due();
    }

    fn drive(&mut self, out: LoopOut<i64>, words: &[i64]) {
        let laws = self.laws;
        match laws.drive {
            Drive::None => return,
            Drive::Force { quantum_n } => self.x[CURRENT] = -Fixed::of(words[self.command] as f64 * quantum_n),
            Drive::Averaged { full_scale, period, .. } => {
                let duty = words[self.command] as f64 / full_scale;
                if duty == self.duty {
                    return;
                }
                self.duty = duty;
                let Some(period) = period else {
                    self.average(Fixed::of(duty));
                    self.driven();
                    return;
                };
                self.waiting = None;
                match self.mean.change(self.edge, period, duty) {
                    Change::At(edge) => self.waiting = Some((edge, duty)),
                    Change::Now(given, end) => {
                        self.waiting = Some((end, duty));
                        self.average(given);
                    }
                }
            }
            Drive::Switching => {
                // Leg B feeds the motor's plus terminal.
                let leg = |high, low| match (high, low) {
                    (1, 0) => Some(true),
                    (0, 1) => Some(false),
                    (0, 0) => None,
                    both => panic!("gates {both:?} of a leg"),
                };
                (self.bridge.plus, self.bridge.minus) = (leg(out.b_high, out.b_low), leg(out.a_high, out.a_low));
                self.path = self.bridge.path(&self.x);
            }
        }
        self.driven();
    }

    fn reals(&self, edge: u64) -> [f64; 3] {
        self.outputs(edge).map(Fixed::float)
    }

    fn summary(&self) -> Summary {
        Summary { encoder_edges: self.crossings, mode_changes: self.mode_changes, ..Summary::default() }
    }
}
