//! Fixed steps: how ordinary programs move the same arm on.
//!
//! A [`SteppedArm`] is moved by a textbook method over steps of so many clock edges, with the commands held as they stand at
//! the step's first edge. Nothing is located inside a step:
//!
//! - Coulomb friction is that of the direction at the step's start. A joint that stands still there stays for the step while
//!   what pulls at it is no more than its friction, and else slips that way; joints are asked one by one, without what the
//!   acceleration of another adds.
//! - A joint whose direction a step would reverse stands still at its end.
//! - Between a step's ends everything goes in a straight line: the encoders' edges fall on the clock edges at which that line
//!   crosses them.
//!
//! Semi-implicit Euler takes torques from the old state, speeds from the new torques, angles from the new speeds. The implicit
//! midpoint is found by iteration, which converges for steps below the shortest time constant. Energies are
//! summed by the trapezoid rule, so that what is left of the balance measures the method.

use super::friction::Pose;
use super::series::Start;
use super::{Arm, ArmEnergy, ArmState};
use crate::{Band, Method};

/// Angles and speeds of the links, those of the motors, torques: three of each.
type State = [[f64; 3]; 5];
const Q: usize = 0;
const V: usize = 1;
const P: usize = 2;
const W: usize = 3;
const TORQUE: usize = 4;

/// Iterations of the implicit midpoint, after which it is lost.
const MOST_ITERATIONS: usize = 100;
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
}

/// An arm that moves in fixed steps; its functions are those of [`ArmMotion`](super::ArmMotion).
#[derive(Clone)]
pub struct SteppedArm<'a> {
    arm: &'a Arm,
    method: Method,
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
}

fn along(x: &State, slope: &State, by: f64) -> State {
    std::array::from_fn(|k| std::array::from_fn(|i| x[k][i] + by * slope[k][i]))
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
        };
        stepped.initial_j = stepped.stored(&from);
        stepped.rub = stepped.rubs();
        stepped
    }

    /// Comes to an edge, at or after the last one: the angles that the encoders see there.
    pub fn step(&mut self, edge: u64) -> [f64; 3] {
        while self.start + self.edges <= edge {
            self.begin();
            let Some(step) = self.step.take() else { unreachable!("it has begun") };
            self.mode_changes += step.rub.iter().zip(&self.rub).filter(|(now, before)| now != before).count() as u64;
            (self.start, self.from, self.rub) = (self.start + self.edges, step.to, step.rub);
            self.energy = self.energy.plus(&step.energy, 1.0);
            self.steps += 1;
        }
        if edge > self.start {
            self.begin();
        }
        self.now(edge)[P]
    }

    /// The first edge in (`from`, `limit`] at which an encoder's angle leaves its band, where none has at `from`, or at which
    /// a step ends.
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
                begun = self.next();
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
            let step = self.next();
            // Not a number is not near.
            self.lost |= !step.to[Q].iter().chain(&step.to[P]).all(|angle| angle.abs() < FAR_RAD);
            self.step = Some(if self.lost { Step { to: self.from, ..step } } else { step });
        }
    }

    /// What friction does from the step's start on.
    fn rubs(&self) -> [Rub; 3] {
        let (model, x) = (&self.arm.model, &self.from);
        let pose = Pose::of(self.arm, &x[Q], &x[V]);
        std::array::from_fn(|i| {
            if !model.free[i] {
                return Rub::Held;
            }
            if model.coulomb_nm[i] == 0.0 {
                return Rub::Slips(0.0);
            }
            if x[W][i] != 0.0 {
                return Rub::Slips(x[W][i].signum());
            }
            let torque_nm = if model.amplifier_s > 0.0 { x[TORQUE][i] } else { self.u[i] };
            let pull_nm = torque_nm + self.spring_nm(x, i).map_or(pose.bias_nm[i], |spring_nm| -spring_nm);
            if pull_nm.abs() <= model.coulomb_nm[i] { Rub::Held } else { Rub::Slips(pull_nm.signum()) }
        })
    }

    /// The torque of a flexible transmission on its link.
    fn spring_nm(&self, x: &State, i: usize) -> Option<f64> {
        self.arm.model.transmission[i].map(|flexible| {
            flexible.stiffness_nm_per_rad * (x[P][i] - x[Q][i]) + flexible.damping_nm_s_per_rad * (x[W][i] - x[V][i])
        })
    }

    /// The slopes of a state, of which all torques are that state's own.
    fn slope(&self, x: &State, rub: &[Rub; 3]) -> State {
        let model = &self.arm.model;
        let pose = Pose::of(self.arm, &x[Q], &x[V]);
        let [m1, m22, m33] = self.arm.diagonal_kg_m2();
        let (mut force_nm, mut moves) = (pose.bias_nm, model.free);
        let mut motor = [0.0; 3];
        for i in 0..3 {
            let friction_nm = match rub[i] {
                Rub::Held => 0.0,
                Rub::Slips(sign) => sign * model.coulomb_nm[i],
            };
            let torque_nm = x[TORQUE][i] - model.viscous_nm_s_per_rad[i] * x[W][i] - friction_nm;
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
        let lag = std::array::from_fn(|i| {
            if model.amplifier_s > 0.0 { (self.u[i] - x[TORQUE][i]) / model.amplifier_s } else { 0.0 }
        });
        [x[V], link, x[W], motor, lag]
    }

    /// The step from the start on.
    fn next(&self) -> Step {
        let (model, h, rub) = (&self.arm.model, self.edges as f64 * self.arm.edge_s, self.rubs());
        let mut from = self.from;
        if model.amplifier_s == 0.0 {
            from[TORQUE] = self.u;
        }
        let slope = |x: &State| self.slope(x, &rub);
        let mut to = match self.method {
            Method::Euler => along(&from, &slope(&from), h),
            Method::SemiImplicit => {
                let mut to = from;
                to[TORQUE] = along(&from, &slope(&from), h)[TORQUE];
                let faster = along(&to, &slope(&to), h);
                (to[V], to[W]) = (faster[V], faster[W]);
                let moved = along(&to, &slope(&to), h);
                (to[Q], to[P]) = (moved[Q], moved[P]);
                to
            }
            Method::Midpoint => {
                let mut middle = from;
                for _ in 0..MOST_ITERATIONS {
                    let next = along(&from, &slope(&middle), 0.5 * h);
                    if std::mem::replace(&mut middle, next) == next {
                        break;
                    }
                }
                along(&from, &slope(&middle), h)
            }
            Method::Rk4 => {
                let one = slope(&from);
                let two = slope(&along(&from, &one, 0.5 * h));
                let three = slope(&along(&from, &two, 0.5 * h));
                let four = slope(&along(&from, &three, h));
                let mean = |k: usize, i: usize| (one[k][i] + 2.0 * (two[k][i] + three[k][i]) + four[k][i]) / 6.0;
                along(&from, &std::array::from_fn(|k| std::array::from_fn(|i| mean(k, i))), h)
            }
        };
        for i in 0..3 {
            if let Rub::Slips(sign) = rub[i]
                && sign * to[W][i] < 0.0
            {
                to[W][i] = 0.0;
                if model.transmission[i].is_none() {
                    to[V][i] = 0.0;
                }
            }
        }
        Step { to, rub, energy: self.exchanged(&from, &to, h) }
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
        let [q, v, p, w, _] = x.map(|[a, b, c]| [a, b, c, 0.0]);
        self.arm.stored_j(&Start { q, v, p, w, ..Start::default() })
    }
}
