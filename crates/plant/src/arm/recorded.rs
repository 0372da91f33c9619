//! The equations of motion of any [`Dynamics`], recorded once and read as numbers and as Taylor series.
//!
//! An [`Arm`] writes its dynamics down in expressions: the masses, and by derivatives of masses and potential the
//! forces of Lagrange's equations,
//!
//! | equation | |
//! |---|---|
//! | `(M ω)' = T + F` | momenta, so that no acceleration enters a product |
//! | `Fi = ½ ωᵀ ∂iM ω - ∂iU` | forces of the motion and of the potential |
//! | `M ω' = T + B`, `Bi = Fi - Σ ∂kMij ωk ωj` | the same, for accelerations in a pose |
//!
//! Equal expressions are one node, and what is 0 is left out. The nodes of the masses come first: power `k` of the
//! speeds follows from those, power `k` of the forces from the speeds.

use std::cell::RefCell;
use std::ops::{Add, Mul, Neg, Range, Sub};
use std::rc::Rc;

use super::dynamics::{Dual, Dynamics, Scalar};
use super::finger::{FORCE, Finger, Touch};
use super::joints::{ArmError, Joints};
use super::kinematics::Sines;
use super::links::{Arm, Links};
use super::links::{Factors, Pose};
use super::series::{Hold, Series, Start, moves, onward};
use crate::flow::polynomial::{Coefficients, ORDER};

/// The operation of a node on nodes before it. A cosine stands behind the sine of its angle.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Op {
    Angle(usize),
    Speed(usize),
    Scale(usize, f64),
    Offset(usize, f64),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Sine(usize),
    Cosine(usize),
    Root(usize),
    Reciprocal(usize),
}

/// An expression under record: a number, or a node of the tape.
#[derive(Clone)]
enum Expr {
    Number(f64),
    Node(Rc<RefCell<Vec<Op>>>, usize),
}

impl Expr {
    /// Returns the node of an operation, which is that of an equal one before if there is one.
    fn node(tape: &Rc<RefCell<Vec<Op>>>, op: Op) -> Self {
        let found = tape.borrow().iter().position(|other| *other == op);
        let index = found.unwrap_or_else(|| {
            let mut ops = tape.borrow_mut();
            ops.push(op);
            if let Op::Sine(angle) = op {
                ops.push(Op::Cosine(angle));
            }
            ops.iter().position(|other| *other == op).expect("it was pushed")
        });
        Self::Node(tape.clone(), index)
    }

    fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Number(number) => Self::Number(factor * number),
            Self::Node(..) if factor == 0.0 => Self::Number(0.0),
            Self::Node(..) if factor == 1.0 => self.clone(),
            Self::Node(tape, index) => Self::node(tape, Op::Scale(*index, factor)),
        }
    }

    fn offset(&self, by: f64) -> Self {
        match self {
            Self::Number(number) => Self::Number(number + by),
            Self::Node(..) if by == 0.0 => self.clone(),
            Self::Node(tape, index) => Self::node(tape, Op::Offset(*index, by)),
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Number(number) => Place::Number(*number),
            Self::Node(_, index) => Place::Node(*index),
        }
    }
}

impl From<f64> for Expr {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl Add for Expr {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (&self, &other) {
            (Self::Number(number), node) | (node, Self::Number(number)) => node.offset(*number),
            (Self::Node(tape, one), Self::Node(_, two)) => Self::node(tape, Op::Add(*one.min(two), *one.max(two))),
        }
    }
}

impl Sub for Expr {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (&self, &other) {
            (_, Self::Number(number)) => self.offset(-number),
            (Self::Number(number), _) => other.scaled(-1.0).offset(*number),
            (Self::Node(_, one), Self::Node(_, two)) if one == two => Self::Number(0.0),
            (Self::Node(tape, one), Self::Node(_, two)) => Self::node(tape, Op::Subtract(*one, *two)),
        }
    }
}

impl Mul for Expr {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (&self, &other) {
            (Self::Number(number), node) | (node, Self::Number(number)) => node.scaled(*number),
            (Self::Node(tape, one), Self::Node(_, two)) => Self::node(tape, Op::Multiply(*one.min(two), *one.max(two))),
        }
    }
}

impl Neg for Expr {
    type Output = Self;
    fn neg(self) -> Self {
        self.scaled(-1.0)
    }
}

impl Scalar for Expr {
    fn sin_cos(&self) -> (Self, Self) {
        match self {
            Self::Number(number) => {
                let (sine, cosine) = libm::sincos(*number);
                (Self::Number(sine), Self::Number(cosine))
            }
            Self::Node(tape, index) => (Self::node(tape, Op::Sine(*index)), Self::node(tape, Op::Cosine(*index))),
        }
    }

    fn sqrt(&self) -> Self {
        match self {
            Self::Number(number) => Self::Number(number.sqrt()),
            Self::Node(tape, index) => Self::node(tape, Op::Root(*index)),
        }
    }

    fn recip(&self) -> Self {
        match self {
            Self::Number(number) => Self::Number(number.recip()),
            Self::Node(tape, index) => Self::node(tape, Op::Reciprocal(*index)),
        }
    }
}

/// Where a recorded quantity is found.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Place {
    Number(f64),
    Node(usize),
}

/// The terms of a node's series.
type Terms = [f64; ORDER + 1];

impl Place {
    /// Returns the value among those of all nodes.
    fn value(self, values: &[f64]) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Node(index) => values[index],
        }
    }

    /// Returns the term of a power.
    fn term(self, terms: &[Terms], power: usize) -> f64 {
        match self {
            Self::Number(number) => {
                if power == 0 {
                    number
                } else {
                    0.0
                }
            }
            Self::Node(index) => terms[index][power],
        }
    }
}

/// The equations of motion of links, recorded from their [`Dynamics`].
#[derive(Clone, PartialEq, Debug)]
pub struct Recorded {
    ops: Vec<Op>,
    /// The number of nodes up to the last one of the masses.
    of_masses: usize,
    masses: [[Place; 3]; 3],
    forces: [Place; 3],
    bias: [Place; 3],
    potential: Place,
    tip: [Place; 3],
    surface: Option<Surface>,
}

/// The surface on which a finger presses: its height, its speed, the height's slopes by the joints' angles.
#[derive(Clone, PartialEq, Debug)]
struct Surface {
    height: Place,
    rising: Place,
    slopes: [Place; 3],
}

/// The memory of the recursion: the terms of all nodes, the factored masses at the start, the next term of the momenta,
/// and the forces of the last power.
#[derive(Clone)]
pub struct Work {
    terms: Vec<Terms>,
    masses: [[f64; 3]; 3],
    factors: Factors,
    momentum: [f64; 3],
    before: [f64; 3],
}

impl Recorded {
    /// Records the equations of motion.
    pub(super) fn of(dynamics: &impl Dynamics) -> Self {
        let tape = Rc::new(RefCell::new(Vec::new()));
        let angles = [0, 1, 2].map(|joint| Expr::node(&tape, Op::Angle(joint)));
        let masses = dynamics.mass_kg_m2(&angles).map(|row| row.map(|mass| mass.place()));
        let of_masses = tape.borrow().len();
        let speeds = [0, 1, 2].map(|joint| Expr::node(&tape, Op::Speed(joint)));
        let along = Dual::of(angles.clone());
        let mass = dynamics.mass_kg_m2(&along);
        let potential = dynamics.potential_j(&along);
        let zero = || Expr::Number(0.0);
        let sum =
            |term: &dyn Fn(usize, usize) -> Expr| (0..9).fold(zero(), |sum, index| sum + term(index / 3, index % 3));
        let forces: [Expr; 3] = std::array::from_fn(|i| {
            let moving = sum(&|a, b| mass[a][b].slopes[i].clone() * speeds[a].clone() * speeds[b].clone());
            moving.scaled(0.5) - potential.slopes[i].clone()
        });
        let bias: [Expr; 3] = std::array::from_fn(|i| {
            let turned = sum(&|j, k| mass[i][j].slopes[k].clone() * speeds[k].clone() * speeds[j].clone());
            forces[i].clone() - turned
        });
        let (forces, bias) = (forces.map(|force| force.place()), bias.map(|bias| bias.place()));
        let (potential, tip) = (potential.value.place(), dynamics.tip_m(&angles).map(|tip| tip.place()));
        let surface = dynamics.surface_m(&along).map(|height| {
            let rising = (0..3).fold(zero(), |sum, i| sum + height.slopes[i].clone() * speeds[i].clone());
            let slopes = height.slopes.map(|slope| slope.place());
            Surface { height: height.value.place(), rising: rising.place(), slopes }
        });
        let ops = tape.borrow().clone();
        Self { ops, of_masses, masses, forces, bias, potential, tip, surface }
    }

    pub(super) fn has_surface(&self) -> bool {
        self.surface.is_some()
    }

    /// Returns the values of all nodes at angles and speeds.
    fn values(&self, q: [f64; 3], v: [f64; 3]) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.ops.len());
        for op in &self.ops {
            values.push(match *op {
                Op::Angle(joint) => q[joint],
                Op::Speed(joint) => v[joint],
                Op::Scale(of, factor) => factor * values[of],
                Op::Offset(of, by) => values[of] + by,
                Op::Add(one, two) => values[one] + values[two],
                Op::Subtract(one, two) => values[one] - values[two],
                Op::Multiply(one, two) => values[one] * values[two],
                Op::Sine(of) => libm::sin(values[of]),
                Op::Cosine(of) => libm::cos(values[of]),
                Op::Root(of) => libm::sqrt(values[of]),
                Op::Reciprocal(of) => 1.0 / values[of],
            });
        }
        values
    }

    /// Writes the terms of a power of some nodes, whose inputs have that term.
    fn write(&self, nodes: Range<usize>, k: usize, terms: &mut [Terms], q: &Coefficients, v: &Coefficients) {
        for node in nodes {
            let turned = |of: usize, other: usize| {
                let sum: f64 = (1..=k).map(|j| j as f64 * terms[of][j] * terms[other][k - j]).sum();
                sum / k as f64
            };
            terms[node][k] = match self.ops[node] {
                Op::Angle(joint) => q[k][joint],
                Op::Speed(joint) => v[k][joint],
                Op::Scale(of, factor) => factor * terms[of][k],
                Op::Offset(of, by) => terms[of][k] + if k == 0 { by } else { 0.0 },
                Op::Add(one, two) => terms[one][k] + terms[two][k],
                Op::Subtract(one, two) => terms[one][k] - terms[two][k],
                Op::Multiply(one, two) => (0..=k).map(|j| terms[one][j] * terms[two][k - j]).sum(),
                Op::Sine(of) if k == 0 => libm::sin(terms[of][0]),
                Op::Cosine(of) if k == 0 => libm::cos(terms[of][0]),
                Op::Sine(of) => turned(of, node + 1),
                Op::Cosine(of) => -turned(of, node - 1),
                Op::Root(of) if k == 0 => libm::sqrt(terms[of][0]),
                Op::Root(of) => {
                    let inner: f64 = (1..k).map(|j| terms[node][j] * terms[node][k - j]).sum();
                    (terms[of][k] - inner) / (2.0 * terms[node][0])
                }
                Op::Reciprocal(of) if k == 0 => 1.0 / terms[of][0],
                Op::Reciprocal(of) => {
                    let sum: f64 = (1..=k).map(|j| terms[of][j] * terms[node][k - j]).sum();
                    -sum / terms[of][0]
                }
            };
        }
    }
}

impl Surface {
    /// Writes power `k` of the touch, and adds that of the finger's torques to the forces if it presses.
    fn press(
        &self,
        finger: &Finger,
        x: &Start,
        k: usize,
        terms: &[Terms],
        touch: &mut Coefficients,
        force: &mut [f64; 3],
    ) {
        let [target, speed] = match k {
            0 => [x.press.target_m, x.press.speed_m_per_s],
            1 => [x.press.speed_m_per_s, 0.0],
            _ => [0.0; 2],
        };
        let rising = self.rising.term(terms, k);
        let depth = self.height.term(terms, k) - target;
        touch[k] = [depth, finger.force_n(depth, rising - speed), rising, 0.0];
        if x.press.touch == Touch::Pressed {
            for (i, slope) in self.slopes.iter().enumerate() {
                force[i] -= (0..=k).map(|j| touch[j][FORCE] * slope.term(terms, k - j)).sum::<f64>();
            }
        }
    }
}

impl Links for Recorded {
    type Work = Work;

    fn work(&self) -> Work {
        Work {
            terms: vec![[0.0; ORDER + 1]; self.ops.len()],
            masses: [[0.0; 3]; 3],
            factors: Factors::default(),
            momentum: [0.0; 3],
            before: [0.0; 3],
        }
    }

    fn tip_m(&self, angles_rad: [f64; 3]) -> [f64; 3] {
        let values = self.values(angles_rad, [0.0; 3]);
        self.tip.map(|tip| tip.value(&values))
    }

    fn mass_kg_m2(&self, angles_rad: [f64; 3]) -> [[f64; 3]; 3] {
        let values = self.values(angles_rad, [0.0; 3]);
        self.masses.map(|row| row.map(|mass| mass.value(&values)))
    }

    fn potential_j(&self, angles_rad: [f64; 3]) -> f64 {
        self.potential.value(&self.values(angles_rad, [0.0; 3]))
    }

    fn pose(&self, _: &Sines, q: [f64; 3], v: [f64; 3]) -> Pose {
        let values = self.values(q, v);
        let mass_kg_m2 = self.masses.map(|row| row.map(|mass| mass.value(&values)));
        Pose { mass_kg_m2, bias_nm: self.bias.map(|bias| bias.value(&values)) }
    }

    fn surface(&self, q: [f64; 3], v: [f64; 3]) -> Option<(f64, f64, [f64; 3])> {
        let surface = self.surface.as_ref()?;
        let values = self.values(q, v);
        let slopes = surface.slopes.map(|slope| slope.value(&values));
        Some((surface.height.value(&values), surface.rising.value(&values), slopes))
    }

    fn extend(arm: &Arm<Self>, series: &mut Series, work: &mut Work, x: &Start, holds: &[Hold; 3], powers: usize) {
        let (links, joints) = (&arm.links, &arm.joints);
        let moves = [0, 1, 2].map(|i| moves(joints, holds, i));
        let done = std::mem::replace(&mut series.powers, powers);
        for k in done..powers {
            let share = 1.0 / (k + 1) as f64;
            let Series { q, v, hold, .. } = &mut *series;
            links.write(0..links.of_masses, k, &mut work.terms, q, v);
            // Speeds, computed from momenta.
            let known: [f64; 3] = std::array::from_fn(|i| {
                let of = |j: usize| {
                    let mass = links.masses[i][j];
                    (1..=k).map(|m| mass.term(&work.terms, m) * v[k - m][j]).sum::<f64>()
                };
                of(0) + of(1) + of(2)
            });
            let speeds = if k == 0 {
                work.masses = links.masses.map(|row| row.map(|mass| mass.term(&work.terms, 0)));
                for (i, rotor_kg_m2) in arm.rotors_kg_m2.iter().enumerate() {
                    work.masses[i][i] += rotor_kg_m2;
                }
                work.factors = Factors::of(&work.masses, moves);
                [x.v[0], x.v[1], x.v[2]]
            } else {
                let rest = std::array::from_fn(|i| work.momentum[i] - known[i]);
                let mut speeds = work.factors.solve(rest);
                if k == 1 {
                    for i in (0..3).filter(|&i| joints.transmission[i].is_none()) {
                        speeds[i] = onward(holds[i], x.w[i], speeds[i]);
                    }
                }
                speeds
            };
            v[k] = [speeds[0], speeds[1], speeds[2], 0.0];
            let momentum = |i: usize| known[i] + (0..3).map(|j| work.masses[i][j] * speeds[j]).sum::<f64>();
            if k > 0 {
                // The torques that hold the stuck joints, one power behind.
                for i in (0..3).filter(|&i| joints.transmission[i].is_none()) {
                    hold[k - 1][i] = work.before[i] - k as f64 * momentum(i);
                }
            }
            links.write(links.of_masses..links.ops.len(), k, &mut work.terms, q, v);
            let mut force = links.forces.map(|force| force.term(&work.terms, k));
            if let (Some(finger), Some(surface)) = (&arm.finger, &links.surface) {
                surface.press(finger, x, k, &work.terms, &mut series.touch, &mut force);
            }
            let torque_nm = series.motors(joints, x, holds, k, speeds);
            for i in 0..3 {
                force[i] += torque_nm[i];
                work.momentum[i] = force[i] * share;
            }
            work.before = force;
        }
        series.close(joints, arm.tolerance);
    }

    fn ease(_: &Arm<Self>, work: &Work) -> [f64; 3] {
        let all = Factors::of(&work.masses, [true; 3]);
        std::array::from_fn(|i| all.solve(std::array::from_fn(|j| f64::from(u8::from(i == j))))[i])
    }
}

impl Arm<Recorded> {
    /// Creates an arm whose links have these dynamics, on a clock of this period. The masses must be positive definite
    /// in every pose that the motion reaches.
    ///
    /// # Errors
    /// An impossible parameter of the joints.
    pub fn of(dynamics: &impl Dynamics, joints: Joints, edge_s: f64) -> Result<Self, ArmError> {
        joints.check(edge_s)?;
        Ok(Self::with(Recorded::of(dynamics), joints, edge_s))
    }
}

impl Arm<Recorded> {
    /// Returns the arm with a finger that presses on the surface of its [`Dynamics`](super::Dynamics). Call
    /// [`ArmMotion::press`](super::ArmMotion::press) to move the finger.
    ///
    /// # Panics
    ///
    /// Unless the dynamics have a surface.
    #[must_use]
    pub fn with_finger(self, finger: Finger) -> Self {
        assert!(self.links.has_surface(), "these dynamics have no surface");
        Self { finger: Some(finger), ..self }
    }
}
