//! Fixed steps of the same arm, as in ordinary programs.
//!
//! A textbook method moves a [`SteppedArm`] over steps of a number of clock edges. The commands are those of the step's
//! first edge, held, or they follow the motion at every state at which the method asks for slopes
//! ([`SteppedArm::plan`]). Nothing is located inside a step, except the turns of joints in a planned one:
//!
//! - Coulomb friction has the direction of the step's start. For joints at rest at the start, it is decided for all of
//!   them together which stay at rest for the step, as in the series.
//! - A joint whose direction a step would reverse stands still at the step's end, unless the step was planned.
//! - Between a step's ends all quantities move on straight lines: the encoders' edges fall on the clock edges at which
//!   that line crosses them.
//!
//! Semi-implicit Euler takes torques from the old state, speeds from the new torques, angles from the new speeds. The
//! implicit midpoint is found by iteration, which converges for steps below the shortest time constant. Energies are
//! summed by the trapezoid rule, so the residual of the balance measures the error of the method.

use super::finger::Press;
use super::kinematics::Sines;
use super::links::Links;
use super::series::{Hold, Start};
use super::{Arm, ArmEnergy, ArmModel, ArmState};
use crate::flow::gauge::{Chord, Gauge, Measured, Pace};
use crate::{Band, Method};

/// Angles and speeds of the links, angles and speeds of the motors, torques: three of each.
type State = [[f64; 3]; 5];
const Q: usize = 0;
const V: usize = 1;
const P: usize = 2;
const W: usize = 3;
const TORQUE: usize = 4;

/// A `Command` returns the torques commanded of the motors, given their angles and speeds. It names a closure type;
/// every closure of this form implements it.
trait Command: Fn(&[f64; 3], &[f64; 3]) -> [f64; 3] {}
impl<F: Fn(&[f64; 3], &[f64; 3]) -> [f64; 3]> Command for F {}

/// The most iterations of the implicit midpoint; after these the step is lost.
const MOST_ITERATIONS: usize = 100;
/// The most turns of joints that are located in one step.
const MOST_TURNS: usize = 16;
/// The most trials to locate one turn.
const MOST_TRIALS: usize = 40;
/// Share of a joint's speed below which it counts as turned.
const AT_REST: f64 = 1e-13;
/// A step that ends beyond this angle in rad is lost.
const FAR_RAD: f64 = 1e6;

/// The effect of friction on a joint over a step.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Rub {
    /// Friction holds it, or it is locked.
    Held,
    /// Friction brakes its motion in this direction; 0 without Coulomb friction.
    Slips(f64),
}

/// A step in progress.
#[derive(Clone)]
struct Step {
    to: State,
    rub: [Rub; 3],
    energy: ArmEnergy,
    /// Changes of friction's effect, including those at the start of the step.
    changes: u64,
}

/// An arm that moves in fixed steps, with the same functions as [`ArmMotion`](super::ArmMotion).
#[derive(Clone)]
pub struct SteppedArm<'a, L: Links = ArmModel> {
    arm: &'a Arm<L>,
    method: Method,
    /// Clock edges of a step.
    edges: u64,
    u: [f64; 3],
    /// The finger's target: an edge, its height there, and its speed from there on.
    target: (u64, f64, f64),
    /// The present step: its first edge, the state there, and the step itself once it has begun.
    start: u64,
    from: State,
    step: Option<Step>,
    energy: ArmEnergy,
    initial_j: f64,
    rub: [Rub; 3],
    mode_changes: u64,
    steps: u64,
    lost: bool,
    /// The motors' torques between rows, if the observer asks for them.
    gauge: Option<Box<Gauge<3>>>,
}

fn along(x: &State, slope: &State, by: f64) -> State {
    std::array::from_fn(|k| std::array::from_fn(|i| x[k][i] + by * slope[k][i]))
}

/// Returns whether a joint moves, at a step's end, against the direction of its friction.
fn turns(end: &State, rub: &[Rub; 3], joint: usize) -> bool {
    matches!(rub[joint], Rub::Slips(sign) if sign * end[W][joint] < 0.0)
}

/// Returns the joint that turns first in a step, by the mean accelerations, among those that moved and are not `known`.
fn first_to_turn(from: &State, end: &State, rub: &[Rub; 3], known: Option<usize>) -> Option<usize> {
    let share = |joint: usize| from[W][joint] / (from[W][joint] - end[W][joint]);
    let turning = (0..3).filter(|&joint| known != Some(joint) && from[W][joint] != 0.0 && turns(end, rub, joint));
    turning.min_by(|&a, &b| share(a).total_cmp(&share(b)))
}

fn differences(before: &[Rub; 3], after: &[Rub; 3]) -> u64 {
    before.iter().zip(after).filter(|(before, after)| before != after).count() as u64
}

/// Returns commands that are held whatever the arm does.
fn held(u: [f64; 3]) -> impl Command {
    move |_: &[f64; 3], _: &[f64; 3]| u
}

impl<'a, L: Links> SteppedArm<'a, L> {
    /// Creates an arm at edge 0, without torque, with steps of this number of clock edges, at least one.
    pub fn new(arm: &'a Arm<L>, method: Method, edges: u64, angles_rad: [f64; 3], speeds_rad_per_s: [f64; 3]) -> Self {
        let speeds = std::array::from_fn(|i| if arm.joints.free[i] { speeds_rad_per_s[i] } else { 0.0 });
        let from = [angles_rad, speeds, angles_rad, speeds, [0.0; 3]];
        let mut stepped = Self {
            arm,
            method,
            edges: edges.max(1),
            u: [0.0; 3],
            target: (0, f64::INFINITY, 0.0),
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

    /// Moves to an edge, at or after the last one, and returns the angles that the encoders see there.
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

    /// Gathers mean and extremes of the motors' torques between rows from edge 0 on; see [`measured`](Self::measured).
    pub fn measure(&mut self, pace: Pace) {
        self.gauge = Some(Box::new(Gauge::new(pace, [true; 3])));
    }

    /// Returns means and extremes of the motors' torques, which are linear within a step, for the row at an edge of the
    /// present step; `None` unless [`measure`](Self::measure) asked for them.
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

    /// Tells the gauge the torques over the step that ends.
    fn pass(&mut self) {
        if let (Some(gauge), Some(step)) = (&self.gauge, &self.step) {
            let Self { start, edges, .. } = *self;
            let chord = Chord { start, edges, edge_s: self.arm.edge_s, ends: [self.from[TORQUE], step.to[TORQUE]] };
            let end = start + edges;
            self.gauge = Some(Box::new(gauge.after(start, end, Some(end), &chord)));
        }
    }

    /// Returns the first edge in (`from`, `limit`] at which an encoder's angle leaves its band or a step ends; none has
    /// left its band at `from`.
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
        // On a straight line, an angle that has left its band stays outside.
        let (mut inside, mut outside) = (from, last);
        while outside - inside > 1 {
            let middle = inside + (outside - inside) / 2;
            if left(middle) { outside = middle } else { inside = middle }
        }
        Some(outside)
    }

    /// Begins a step of this number of clock edges, at least one, at the end of the last one. At its start the motors
    /// are commanded to give `torques_nm`; at every state at which the method asks for slopes, `command` returns the
    /// torques for the motors' angles and speeds. Joints turn where their speeds are 0, to the last bits.
    pub fn plan(&mut self, edges: u64, torques_nm: [f64; 3], command: impl Fn(&[f64; 3], &[f64; 3]) -> [f64; 3]) {
        let free = self.arm.joints.free;
        let command = |p: &[f64; 3], w: &[f64; 3]| {
            let torques_nm = command(p, w);
            std::array::from_fn(|i| if free[i] { torques_nm[i] } else { 0.0 })
        };
        self.edges = edges.max(1);
        self.drive(torques_nm);
        if self.arm.joints.amplifier_s == 0.0 {
            self.from[TORQUE] = self.u;
        }
        let step = self.next(&command, true);
        self.keep(step);
    }

    /// Commands torques for the next step; a step that has begun does not change.
    pub fn drive(&mut self, torques_nm: [f64; 3]) {
        self.u = std::array::from_fn(|i| if self.arm.joints.free[i] { torques_nm[i] } else { 0.0 });
    }

    /// Tells the finger from `edge` on where its target is and how fast it moves. Over a step the target's height is
    /// that of the step's start; a step that has begun does not change.
    pub fn press(&mut self, edge: u64, target_m: f64, speed_m_per_s: f64) {
        self.target = (edge, target_m, speed_m_per_s);
    }

    /// Returns the finger as it stands over the present step.
    fn held_finger(&self) -> Press {
        let (told, target_m, speed_m_per_s) = self.target;
        let since_s = (self.start as f64 - told as f64) * self.arm.edge_s;
        Press { target_m: target_m + speed_m_per_s * since_s, speed_m_per_s, ..Press::default() }
    }

    /// Returns the state at an edge of the present step.
    pub fn state(&self, edge: u64) -> ArmState {
        let [angles_rad, speeds_rad_per_s, motor_angles_rad, motor_speeds_rad_per_s, torques_nm] = self.now(edge);
        let stuck = self.rub.map(|rub| rub == Rub::Held);
        let finger_n = self.arm.pushed(angles_rad, speeds_rad_per_s, &self.held_finger()).1;
        ArmState { angles_rad, speeds_rad_per_s, motor_angles_rad, motor_speeds_rad_per_s, torques_nm, stuck, finger_n }
    }

    /// Returns the angles of the motors at the end of the last step.
    pub fn motor_angles_rad(&self) -> &[f64; 3] {
        &self.from[P]
    }

    /// Returns the speeds of the motors at the end of the last step.
    pub fn motor_speeds_rad_per_s(&self) -> &[f64; 3] {
        &self.from[W]
    }

    /// Returns the energy exchanged until an edge of the present step.
    pub fn energy(&self, edge: u64) -> ArmEnergy {
        self.step.as_ref().map_or(self.energy, |step| self.energy.plus(&step.energy, self.share(edge)))
    }

    /// Returns the energy stored at an edge of the present step minus that at the start, in J.
    pub fn stored_j(&self, edge: u64) -> f64 {
        self.stored(&self.now(edge)) - self.initial_j
    }

    /// Returns how often a joint has begun to stick, to slip, or to slip the other way.
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Returns the steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns whether a step has left the modelled range; the arm then stays where it was.
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    fn share(&self, edge: u64) -> f64 {
        (edge - self.start) as f64 / self.edges as f64
    }

    /// Returns the state on the line between the ends, at an edge; rounding neither reverses it nor takes it beyond the
    /// end.
    fn now(&self, edge: u64) -> State {
        if edge == self.start {
            return self.from;
        }
        let begun;
        let step = match &self.step {
            Some(step) => step,
            None => {
                begun = self.next(&held(self.u), false);
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
            let step = self.next(&held(self.u), false);
            self.keep(step);
        }
    }

    fn keep(&mut self, step: Step) {
        // NaN is not near.
        self.lost |= !step.to[Q].iter().chain(&step.to[P]).all(|angle| angle.abs() < FAR_RAD);
        self.step = Some(if self.lost { Step { to: self.from, ..step } } else { step });
    }

    /// Returns the effect of friction on each joint from a state on, under these commands.
    fn rubs(&self, x: &State, u: [f64; 3]) -> [Rub; 3] {
        self.arm.holds(&self.start_of(x, u), None).map(|hold| match hold {
            Hold::Locked | Hold::Stuck => Rub::Held,
            Hold::Slip(sign) => Rub::Slips(sign),
        })
    }

    /// Returns the torque of a flexible transmission on its link; `None` if it is rigid.
    #[inline(always)]
    fn spring_nm(&self, x: &State, i: usize) -> Option<f64> {
        self.arm.joints.transmission[i].map(|flexible| {
            flexible.stiffness_nm_per_rad * (x[P][i] - x[Q][i]) + flexible.damping_nm_s_per_rad * (x[W][i] - x[V][i])
        })
    }

    /// Returns the rates of the torques of amplifiers that lag behind their commands; 0 for amplifiers without lag.
    #[inline(always)]
    fn lag(&self, x: &State, u: &[f64; 3]) -> [f64; 3] {
        let lag_s = self.arm.joints.amplifier_s;
        std::array::from_fn(|i| if lag_s > 0.0 { (u[i] - x[TORQUE][i]) / lag_s } else { 0.0 })
    }

    /// Returns the slopes of a state, with all torques taken from that state.
    fn slope(&self, x: &State, near: &Sines, rub: &[Rub; 3], u: [f64; 3]) -> State {
        let joints = &self.arm.joints;
        let pose = self.arm.pose(near, x[Q], x[V]);
        let given_nm = if joints.amplifier_s > 0.0 { x[TORQUE] } else { u };
        let (mut force_nm, mut moves) = (pose.bias_nm, joints.free);
        let mut motor = [0.0; 3];
        for i in 0..3 {
            let friction_nm = match rub[i] {
                Rub::Held => 0.0,
                Rub::Slips(sign) => sign * joints.coulomb_nm[i],
            };
            let torque_nm = given_nm[i] - joints.viscous_nm_s_per_rad[i] * x[W][i] - friction_nm;
            let held = rub[i] == Rub::Held;
            if let Some(spring_nm) = self.spring_nm(x, i) {
                motor[i] = if held { 0.0 } else { (torque_nm - spring_nm) / joints.rotor_kg_m2[i] };
                force_nm[i] += spring_nm;
            } else {
                force_nm[i] += torque_nm;
                moves[i] &= !held;
            }
        }
        if self.arm.finger.is_some() {
            let pushed_nm = self.arm.pushed(x[Q], x[V], &self.held_finger()).2;
            force_nm = std::array::from_fn(|i| force_nm[i] + pushed_nm[i]);
        }
        let link = pose.accelerations(force_nm, moves);
        let motor = std::array::from_fn(|i| if joints.transmission[i].is_some() { motor[i] } else { link[i] });
        [x[V], link, x[W], motor, self.lag(x, &u)]
    }

    /// Computes the step from the start on. With `located`, joints turn where their speeds are 0, otherwise at the
    /// step's end.
    fn next(&self, command: &impl Command, located: bool) -> Step {
        let mut x = self.from;
        if self.arm.joints.amplifier_s == 0.0 {
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
        if self.arm.joints.amplifier_s == 0.0 {
            to[TORQUE] = command(&to[P], &to[W]);
        }
        energy = energy.plus(&self.exchanged(&x, &to, left_s), 1.0);
        Step { to, rub, energy, changes }
    }

    /// Returns the time at which the first joint turns, among those that turn until `end` (`joint` is one of them), and
    /// the state then, with this joint at rest. Found by false position with the Illinois rule.
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

    /// Returns a state with a joint's motor at rest.
    fn stopped(&self, mut x: State, joint: usize) -> State {
        x[W][joint] = 0.0;
        if self.arm.joints.transmission[joint].is_none() {
            x[V][joint] = 0.0;
        }
        x
    }

    /// Returns the state after `h` seconds of the method, from a state in which the motors are commanded to give `u`.
    fn moved(&self, from: &State, u: [f64; 3], rub: &[Rub; 3], h: f64, command: &impl Command) -> State {
        // If nothing moves, the commands stay, and only the amplifiers follow.
        let still = (0..3).all(|i| rub[i] == Rub::Held && self.arm.joints.transmission[i].is_none());
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

    /// Returns the energies of a step, by the trapezoid rule.
    fn exchanged(&self, from: &State, to: &State, h: f64) -> ArmEnergy {
        let joints = &self.arm.joints;
        let mut flows = [0.0; 5];
        for x in [from, to] {
            let pushed_nm = self.arm.pushed(x[Q], x[V], &self.held_finger()).2;
            for (i, &w) in x[W].iter().enumerate() {
                let half = 0.5 * h;
                flows[0] += half * x[TORQUE][i] * w;
                flows[1] += half * joints.viscous_nm_s_per_rad[i] * w * w;
                flows[2] += half * joints.coulomb_nm[i] * w.abs();
                flows[4] += half * pushed_nm[i] * x[V][i];
                if let Some(flexible) = joints.transmission[i] {
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
            finger_j: flows[4],
            exchanged_j: flows.iter().map(|flow| flow.abs()).sum(),
        }
    }

    fn stored(&self, x: &State) -> f64 {
        self.arm.stored_j(&self.start_of(x, self.u))
    }

    /// Returns a state in the form of the series, under these commands.
    fn start_of(&self, x: &State, u: [f64; 3]) -> Start {
        let lanes = |[a, b, c]: [f64; 3]| [a, b, c, 0.0];
        let [q, v, p, w, torque] = x.map(lanes);
        let u = lanes(u);
        let lag = std::array::from_fn(|i| if self.arm.joints.amplifier_s > 0.0 { torque[i] - u[i] } else { 0.0 });
        Start { q, v, p, w, u, lag, ..Start::default() }
    }
}
