//! Fixed steps: how ordinary programs move the same arm on.
//!
//! A [`SteppedArm`] is moved by a textbook method over steps of so many clock edges, with the commands held as they
//! stand at the step's first edge, or following the motion at every state that the method looks at
//! ([`SteppedArm::plan`]). Nothing is located inside a step, but where joints turn in a planned one:
//!
//! - Coulomb friction is that of the direction at the step's start. Which of the joints that stand still there stay for
//!   the step is decided for all of them together, as the series do it.
//! - A joint whose direction a step would reverse stands still at its end, unless the step was planned.
//! - Between a step's ends everything goes in a straight line: the encoders' edges fall on the clock edges at which
//!   that line crosses them.
//!
//! Semi-implicit Euler takes torques from the old state, speeds from the new torques, angles from the new speeds. The
//! implicit midpoint is found by iteration, which converges for steps below the shortest time constant. Energies are
//! summed by the trapezoid rule, so that what is left of the balance measures the method.

use super::friction::{Hold, Pose};
use super::kinematics::Sines;
use super::series::Start;
use super::{Arm, ArmEnergy, ArmState};
use crate::gauge::{Chord, Gauge, Measured, Pace};
use crate::{Band, Method};

/// Angles and speeds of the links, those of the motors, torques: three of each.
type State = [[f64; 3]; 5];
const Q: usize = 0;
const V: usize = 1;
const P: usize = 2;
const W: usize = 3;
const TORQUE: usize = 4;

/// Torques commanded of the motors, of their angles and speeds.
trait Command: Fn(&[f64; 3], &[f64; 3]) -> [f64; 3] {}
impl<F: Fn(&[f64; 3], &[f64; 3]) -> [f64; 3]> Command for F {}

/// Iterations of the implicit midpoint, after which it is lost.
const MOST_ITERATIONS: usize = 100;
/// Turns of joints that are located in one step.
const MOST_TURNS: usize = 16;
/// Trials by which one is.
const MOST_TRIALS: usize = 40;
/// Share of a joint's speed at which it is said to have turned.
const AT_REST: f64 = 1e-13;
/// Beyond this angle in rad a step is lost.
const FAR_RAD: f64 = 1e6;

/// What friction does to a joint over a step.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Rub {
    /// Holds it, or it is locked.
    Held,
    /// Brakes it, in this direction; 0 without Coulomb friction.
    Slips(f64),
}

/// A step under way.
#[derive(Clone)]
struct Step {
    to: State,
    rub: [Rub; 3],
    energy: ArmEnergy,
    /// Changes of what friction does, its start's among them.
    changes: u64,
}

/// An arm that moves in fixed steps; its functions are those of [`ArmMotion`](super::ArmMotion).
#[derive(Clone)]
pub struct SteppedArm<'a> {
    arm: &'a Arm,
    method: Method,
    diagonal_kg_m2: [f64; 3],
    /// Clock edges of a step.
    edges: u64,
    u: [f64; 3],
    /// The present step: its first edge, the state there, and how it goes on, once it has begun.
    start: u64,
    from: State,
    step: Option<Step>,
    energy: ArmEnergy,
    initial_j: f64,
    rub: [Rub; 3],
    mode_changes: u64,
    steps: u64,
    lost: bool,
    /// The motors' torques between rows, if anybody asked.
    gauge: Option<Box<Gauge<3>>>,
}

fn along(x: &State, slope: &State, by: f64) -> State {
    std::array::from_fn(|k| std::array::from_fn(|i| x[k][i] + by * slope[k][i]))
}

/// Whether a joint moves at a step's end against the friction that it had in it.
fn turns(end: &State, rub: &[Rub; 3], joint: usize) -> bool {
    matches!(rub[joint], Rub::Slips(sign) if sign * end[W][joint] < 0.0)
}

/// The joint that turns first in a step, by the mean accelerations, of those that did move and are not `known`.
fn first_to_turn(from: &State, end: &State, rub: &[Rub; 3], known: Option<usize>) -> Option<usize> {
    let share = |joint: usize| from[W][joint] / (from[W][joint] - end[W][joint]);
    let turning = (0..3).filter(|&joint| known != Some(joint) && from[W][joint] != 0.0 && turns(end, rub, joint));
    turning.min_by(|&a, &b| share(a).total_cmp(&share(b)))
}

fn differences(before: &[Rub; 3], after: &[Rub; 3]) -> u64 {
    before.iter().zip(after).filter(|(before, after)| before != after).count() as u64
}

impl<'a> SteppedArm<'a> {
    /// An arm at edge 0, without torque, that steps by so many clock edges, at least one.
    #[must_use]
    pub fn new(arm: &'a Arm, method: Method, edges: u64, angles_rad: [f64; 3], speeds_rad_per_s: [f64; 3]) -> Self {
        let speeds = std::array::from_fn(|i| if arm.model.free[i] { speeds_rad_per_s[i] } else { 0.0 });
        let from = [angles_rad, speeds, angles_rad, speeds, [0.0; 3]];
        let mut stepped = Self {
            arm,
            method,
            diagonal_kg_m2: arm.diagonal_kg_m2(),
            edges: edges.max(1),
            u: [0.0; 3],
            start: 0,
            from,
            step: None,
            energy: ArmEnergy::default(),
            initial_j: 0.0,
            rub: [Rub::Held; 3],
            mode_changes: 0,
            steps: 0,
            lost: false,
            gauge: None,
        };
        stepped.initial_j = stepped.stored(&from);
        stepped.rub = stepped.rubs(&from, [0.0; 3]);
        stepped
    }

    /// Comes to an edge, at or after the last one: the angles that the encoders see there.
    pub fn step(&mut self, edge: u64) -> [f64; 3] {
        while self.start + self.edges <= edge {
            self.begin();
            self.pass();
            let Some(step) = self.step.take() else { unreachable!("it has begun") };
            self.mode_changes += step.changes;
            (self.start, self.from, self.rub) = (self.start + self.edges, step.to, step.rub);
            self.energy = self.energy.plus(&step.energy, 1.0);
            self.steps += 1;
        }
        if edge > self.start {
            self.begin();
        }
        self.now(edge)[P]
    }

    /// From edge 0 on, mean and extremes of the motors' torques are kept between rows: see
    /// [`measured`](Self::measured).
    pub fn measure(&mut self, pace: Pace) {
        self.gauge = Some(Box::new(Gauge::new(pace)));
    }

    /// What the row at an edge of the present step tells of the motors' torques, which go in straight lines over a
    /// step; nothing unless [`measure`](Self::measure) asked for it.
    #[must_use]
    pub fn measured(&self, edge: u64) -> Option<[Measured; 3]> {
        let gauge = self.gauge.as_deref()?;
        let torques_nm = self.now(edge)[TORQUE];
        let edges = edge - self.start;
        let now = if edges == 0 {
            gauge.clone()
        } else {
            let ends = [self.from[TORQUE], torques_nm];
            gauge.after(
                self.start,
                edge,
                Some(edge),
                &Chord { start: self.start, edges, edge_s: self.arm.edge_s, ends },
            )
        };
        Some(now.row(edge, self.arm.edge_s, &torques_nm))
    }

    /// Takes note of the torques over the step that ends.
    fn pass(&mut self) {
        if let (Some(gauge), Some(step)) = (&self.gauge, &self.step) {
            let Self { start, edges, .. } = *self;
            let chord = Chord { start, edges, edge_s: self.arm.edge_s, ends: [self.from[TORQUE], step.to[TORQUE]] };
            let end = start + edges;
            self.gauge = Some(Box::new(gauge.after(start, end, Some(end), &chord)));
        }
    }

    /// The first edge in (`from`, `limit`] at which an encoder's angle leaves its band, where none has at `from`, or at
    /// which a step ends.
    #[must_use]
    pub fn next_event(&mut self, from: u64, limit: u64, bands: &[Band; 3]) -> Option<u64> {
        self.begin();
        let end = self.start + self.edges;
        let last = end.min(limit);
        let left = |edge: u64| {
            let angles = self.now(edge)[P];
            (0..3).any(|i| bands[i].left_by(angles[i]))
        };
        if !left(last) {
            return (end <= limit).then_some(end);
        }
        // On a straight line what has left stays outside.
        let (mut inside, mut outside) = (from, last);
        while outside - inside > 1 {
            let middle = inside + (outside - inside) / 2;
            if left(middle) { outside = middle } else { inside = middle }
        }
        Some(outside)
    }

    /// Begins a step of so many clock edges, at least one, where the last one ended: the motors are commanded to give
    /// these torques there, and what `command` makes of their angles and speeds at every state at which the method asks
    /// for slopes. Joints turn where their speeds are 0, to the last bits.
    pub fn plan(&mut self, edges: u64, torques_nm: [f64; 3], command: impl Fn(&[f64; 3], &[f64; 3]) -> [f64; 3]) {
        let free = self.arm.model.free;
        let command = |p: &[f64; 3], w: &[f64; 3]| {
            let torques_nm = command(p, w);
            std::array::from_fn(|i| if free[i] { torques_nm[i] } else { 0.0 })
        };
        self.edges = edges.max(1);
        self.drive(torques_nm);
        if self.arm.model.amplifier_s == 0.0 {
            self.from[TORQUE] = self.u;
        }
        let step = self.next(&command, true);
        self.keep(step);
    }

    /// Commands torques; the present step, if it has begun, is not changed by them.
    pub fn drive(&mut self, torques_nm: [f64; 3]) {
        self.u = std::array::from_fn(|i| if self.arm.model.free[i] { torques_nm[i] } else { 0.0 });
    }

    /// The state at an edge of the present step.
    #[must_use]
    pub fn state(&self, edge: u64) -> ArmState {
        let [angles_rad, speeds_rad_per_s, motor_angles_rad, motor_speeds_rad_per_s, torques_nm] = self.now(edge);
        let stuck = self.rub.map(|rub| rub == Rub::Held);
        ArmState { angles_rad, speeds_rad_per_s, motor_angles_rad, motor_speeds_rad_per_s, torques_nm, stuck }
    }

    /// Angles of the motors where the last step ended.
    #[must_use]
    pub fn motor_angles_rad(&self) -> &[f64; 3] {
        &self.from[P]
    }

    /// Speeds of the motors there.
    #[must_use]
    pub fn motor_speeds_rad_per_s(&self) -> &[f64; 3] {
        &self.from[W]
    }

    /// The energy exchanged until an edge of the present step.
    #[must_use]
    pub fn energy(&self, edge: u64) -> ArmEnergy {
        self.step.as_ref().map_or(self.energy, |step| self.energy.plus(&step.energy, self.share(edge)))
    }

    /// Energy stored at an edge of the present step over that at the start, in J.
    #[must_use]
    pub fn stored_j(&self, edge: u64) -> f64 {
        self.stored(&self.now(edge)) - self.initial_j
    }

    /// How often a joint has come to stick, to slip, or to slip the other way.
    #[must_use]
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Steps done.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Whether a step has left all that is modelled; the arm stays where it was.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    fn share(&self, edge: u64) -> f64 {
        (edge - self.start) as f64 / self.edges as f64
    }

    /// The state on the line between the ends, at an edge; rounding does not make it turn back or pass the end.
    fn now(&self, edge: u64) -> State {
        if edge == self.start {
            return self.from;
        }
        let begun;
        let step = match &self.step {
            Some(step) => step,
            None => {
                begun = self.next(&self.held(), false);
                &begun
            }
        };
        let share = self.share(edge);
        std::array::from_fn(|k| {
            std::array::from_fn(|i| {
                let (a, b) = (self.from[k][i], step.to[k][i]);
                (a + (b - a) * share).clamp(a.min(b), a.max(b))
            })
        })
    }

    fn begin(&mut self) {
        if self.step.is_none() {
            let step = self.next(&self.held(), false);
            self.keep(step);
        }
    }

    fn keep(&mut self, step: Step) {
        // Not a number is not near.
        self.lost |= !step.to[Q].iter().chain(&step.to[P]).all(|angle| angle.abs() < FAR_RAD);
        self.step = Some(if self.lost { Step { to: self.from, ..step } } else { step });
    }

    /// The commands as they stand, whatever the arm does.
    fn held(&self) -> impl Command + use<> {
        let u = self.u;
        move |_: &[f64; 3], _: &[f64; 3]| u
    }

    /// What friction does from a state on, so commanded.
    fn rubs(&self, x: &State, u: [f64; 3]) -> [Rub; 3] {
        self.arm.holds(&self.start_of(x, u), None).map(|hold| match hold {
            Hold::Locked | Hold::Stuck => Rub::Held,
            Hold::Slip(sign) => Rub::Slips(sign),
        })
    }

    /// The torque of a flexible transmission on its link.
    #[inline(always)]
    fn spring_nm(&self, x: &State, i: usize) -> Option<f64> {
        self.arm.model.transmission[i].map(|flexible| {
            flexible.stiffness_nm_per_rad * (x[P][i] - x[Q][i]) + flexible.damping_nm_s_per_rad * (x[W][i] - x[V][i])
        })
    }

    /// How the torques of amplifiers that lag follow what they are commanded; 0 of those that do not.
    #[inline(always)]
    fn lag(&self, x: &State, u: &[f64; 3]) -> [f64; 3] {
        let lag_s = self.arm.model.amplifier_s;
        std::array::from_fn(|i| if lag_s > 0.0 { (u[i] - x[TORQUE][i]) / lag_s } else { 0.0 })
    }

    /// The slopes of a state, of which all torques are that state's own.
    fn slope(&self, x: &State, near: &Sines, rub: &[Rub; 3], u: [f64; 3]) -> State {
        let model = &self.arm.model;
        let pose = Pose::of(self.arm, near.near(x[Q]), x[V]);
        let [m1, m22, m33] = self.diagonal_kg_m2;
        let given_nm = if model.amplifier_s > 0.0 { x[TORQUE] } else { u };
        let (mut force_nm, mut moves) = (pose.bias_nm, model.free);
        let mut motor = [0.0; 3];
        for i in 0..3 {
            let friction_nm = match rub[i] {
                Rub::Held => 0.0,
                Rub::Slips(sign) => sign * model.coulomb_nm[i],
            };
            let torque_nm = given_nm[i] - model.viscous_nm_s_per_rad[i] * x[W][i] - friction_nm;
            let held = rub[i] == Rub::Held;
            if let Some(spring_nm) = self.spring_nm(x, i) {
                motor[i] = if held { 0.0 } else { (torque_nm - spring_nm) / model.rotor_kg_m2[i] };
                force_nm[i] += spring_nm;
            } else {
                force_nm[i] += torque_nm;
                moves[i] &= !held;
            }
        }
        let m23 = pose.m23;
        let (two, three) = match (moves[1], moves[2]) {
            (true, true) => {
                let determinant = m22 * m33 - m23 * m23;
                let [_, f2, f3] = force_nm;
                ((m33 * f2 - m23 * f3) / determinant, (m22 * f3 - m23 * f2) / determinant)
            }
            (two, three) => (if two { force_nm[1] / m22 } else { 0.0 }, if three { force_nm[2] / m33 } else { 0.0 }),
        };
        let link = [if moves[0] { force_nm[0] / (pose.m11 + m1) } else { 0.0 }, two, three];
        let motor = std::array::from_fn(|i| if model.transmission[i].is_some() { motor[i] } else { link[i] });
        [x[V], link, x[W], motor, self.lag(x, &u)]
    }

    /// The step from the start on; `located`, the joints turn where their speeds are 0, and not at its end.
    fn next(&self, command: &impl Command, located: bool) -> Step {
        let mut x = self.from;
        if self.arm.model.amplifier_s == 0.0 {
            x[TORQUE] = self.u;
        }
        let (mut left_s, mut rub) = (self.edges as f64 * self.arm.edge_s, self.rubs(&x, self.u));
        let (mut energy, mut changes) = (ArmEnergy::default(), differences(&self.rub, &rub));
        let mut u = self.u;
        let mut to = self.moved(&x, u, &rub, left_s, command);
        for _ in 0..if located { MOST_TURNS } else { 0 } {
            let Some(joint) = first_to_turn(&x, &to, &rub, None) else { break };
            let (passed_s, there) = self.turn(&x, u, &rub, joint, (left_s, to), command);
            energy = energy.plus(&self.exchanged(&x, &there, passed_s), 1.0);
            (x, left_s, u) = (there, left_s - passed_s, command(&there[P], &there[W]));
            let next = self.rubs(&x, u);
            changes += differences(&rub, &next);
            rub = next;
            to = self.moved(&x, u, &rub, left_s, command);
        }
        for joint in 0..3 {
            if turns(&to, &rub, joint) {
                to = self.stopped(to, joint);
            }
        }
        if self.arm.model.amplifier_s == 0.0 {
            to[TORQUE] = command(&to[P], &to[W]);
        }
        energy = energy.plus(&self.exchanged(&x, &to, left_s), 1.0);
        Step { to, rub, energy, changes }
    }

    /// When the first joint turns of those that do until `end`, one of which is `joint`, and the state then: this joint
    /// at rest. Found by false position with the Illinois rule.
    fn turn(
        &self,
        x: &State,
        u: [f64; 3],
        rub: &[Rub; 3],
        mut joint: usize,
        mut end: (f64, State),
        command: &impl Command,
    ) -> (f64, State) {
        loop {
            let (mut low_s, mut low) = (0.0, x[W][joint]);
            let (mut high_s, mut high) = (end.0, end.1[W][joint]);
            for _ in 0..MOST_TRIALS {
                let time_s = low_s + (high_s - low_s) * (low / (low - high));
                if high == 0.0 || time_s <= low_s || time_s >= high_s {
                    break;
                }
                let there = self.moved(x, u, rub, time_s, command);
                let speed = there[W][joint];
                if speed.abs() <= AT_REST * x[W][joint].abs() {
                    end = (time_s, there);
                    break;
                }
                if (speed < 0.0) == (low < 0.0) {
                    (low_s, low) = (time_s, speed);
                    high *= 0.5;
                } else {
                    end = (time_s, there);
                    (high_s, high) = (time_s, speed);
                    low *= 0.5;
                }
            }
            match first_to_turn(x, &end.1, rub, Some(joint)) {
                None => return (end.0, self.stopped(end.1, joint)),
                Some(sooner) => joint = sooner,
            }
        }
    }

    /// A state, a joint's motor at rest in it.
    fn stopped(&self, mut x: State, joint: usize) -> State {
        x[W][joint] = 0.0;
        if self.arm.model.transmission[joint].is_none() {
            x[V][joint] = 0.0;
        }
        x
    }

    /// The state after so many seconds by the method, from one where the motors are commanded to give `u`.
    fn moved(&self, from: &State, u: [f64; 3], rub: &[Rub; 3], h: f64, command: &impl Command) -> State {
        // Where nothing moves commands stay, and amplifiers alone follow.
        let still = (0..3).all(|i| rub[i] == Rub::Held && self.arm.model.transmission[i].is_none());
        let at_rest = |x: &State| [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], self.lag(x, &u)];
        let near = Sines::of(from[Q]);
        let slope = |x: &State| {
            if still { at_rest(x) } else { self.slope(x, &near, rub, command(&x[P], &x[W])) }
        };
        let first = || if still { at_rest(from) } else { self.slope(from, &near, rub, u) };
        match self.method {
            Method::Euler => along(from, &first(), h),
            Method::SemiImplicit => {
                let mut to = *from;
                let lag = self.lag(from, &u);
                to[TORQUE] = std::array::from_fn(|i| from[TORQUE][i] + h * lag[i]);
                let faster = along(&to, &slope(&to), h);
                (to[V], to[W]) = (faster[V], faster[W]);
                let moved = |k: usize, speed: usize| std::array::from_fn(|i| from[k][i] + h * to[speed][i]);
                (to[Q], to[P]) = (moved(Q, V), moved(P, W));
                to
            }
            Method::Midpoint => {
                let mut middle = *from;
                for _ in 0..MOST_ITERATIONS {
                    let next = along(from, &slope(&middle), 0.5 * h);
                    if std::mem::replace(&mut middle, next) == next {
                        break;
                    }
                }
                along(from, &slope(&middle), h)
            }
            Method::Rk4 => {
                let one = first();
                let two = slope(&along(from, &one, 0.5 * h));
                let three = slope(&along(from, &two, 0.5 * h));
                let four = slope(&along(from, &three, h));
                let mean = |k: usize, i: usize| (one[k][i] + 2.0 * (two[k][i] + three[k][i]) + four[k][i]) / 6.0;
                along(from, &std::array::from_fn(|k| std::array::from_fn(|i| mean(k, i))), h)
            }
        }
    }

    /// The energies of a step, by the trapezoid rule.
    fn exchanged(&self, from: &State, to: &State, h: f64) -> ArmEnergy {
        let model = &self.arm.model;
        let mut flows = [0.0; 4];
        for x in [from, to] {
            for (i, &w) in x[W].iter().enumerate() {
                let half = 0.5 * h;
                flows[0] += half * x[TORQUE][i] * w;
                flows[1] += half * model.viscous_nm_s_per_rad[i] * w * w;
                flows[2] += half * model.coulomb_nm[i] * w.abs();
                if let Some(flexible) = model.transmission[i] {
                    let slip = w - x[V][i];
                    flows[3] += half * flexible.damping_nm_s_per_rad * slip * slip;
                }
            }
        }
        ArmEnergy {
            source_j: flows[0],
            viscous_j: flows[1],
            coulomb_j: flows[2],
            transmission_j: flows[3],
            exchanged_j: flows.iter().map(|flow| flow.abs()).sum(),
        }
    }

    fn stored(&self, x: &State) -> f64 {
        self.arm.stored_j(&self.start_of(x, self.u))
    }

    /// A state as the series have it, so commanded.
    fn start_of(&self, x: &State, u: [f64; 3]) -> Start {
        let lanes = |[a, b, c]: [f64; 3]| [a, b, c, 0.0];
        let [q, v, p, w, torque] = x.map(lanes);
        let u = lanes(u);
        let lag = std::array::from_fn(|i| if self.arm.model.amplifier_s > 0.0 { torque[i] - u[i] } else { 0.0 });
        Start { q, v, p, w, u, lag, ..Start::default() }
    }
}
