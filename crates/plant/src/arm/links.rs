//! An arm, and the interface between its motion and the equations of its links.

use super::finger::{Finger, Press, Touch};
use super::joints::Joints;
use super::kinematics::Sines;
use super::model::ArmModel;
use super::series::{FIRST, FIRST_LASTS_S, Hold, Series, Start, moves};
use crate::flow::polynomial::ORDER;

/// `Links` are the moving parts of an arm, as its motion needs them: [`ArmMotion`](super::ArmMotion) flows by their
/// series, [`SteppedArm`](super::SteppedArm) moves by their terms in a pose. Implemented by
/// [`Recorded`](super::Recorded) for any [`Dynamics`](super::Dynamics), and by [`ArmModel`](super::ArmModel), whose
/// series are written out by hand because they are most of a run's time.
pub trait Links: Clone {
    /// The memory of the recursion.
    type Work: Clone;

    /// Returns a memory to begin with.
    fn work(&self) -> Self::Work;
    /// Returns the tip's position.
    fn tip_m(&self, angles_rad: [f64; 3]) -> [f64; 3];
    /// Returns the mass matrix without rotors.
    fn mass_kg_m2(&self, angles_rad: [f64; 3]) -> [[f64; 3]; 3];
    /// Returns the potential energy.
    fn potential_j(&self, angles_rad: [f64; 3]) -> f64;
    /// Returns the terms of the equations of motion at angles `q` and speeds `v`, without rotors. `near` has the sines
    /// of angles nearby.
    fn pose(&self, near: &Sines, q: [f64; 3], v: [f64; 3]) -> Pose;
    /// Returns height and speed of the surface on which a finger presses, and the height's slopes by the joints'
    /// angles; `None` without a surface.
    fn surface(&self, _q: [f64; 3], _v: [f64; 3]) -> Option<(f64, f64, [f64; 3])> {
        None
    }
    /// Extends the series of a motion to a higher power.
    fn extend(arm: &Arm<Self>, series: &mut Series, work: &mut Self::Work, x: &Start, holds: &[Hold; 3], powers: usize);
    /// Returns the acceleration of each rigid joint per torque, at the start of the series.
    fn ease(arm: &Arm<Self>, work: &Self::Work) -> [f64; 3];
}

/// An arm that can move, on a clock.
#[derive(Clone, PartialEq, Debug)]
pub struct Arm<L = ArmModel> {
    pub(super) links: L,
    pub(super) joints: Joints,
    /// The finger that presses on the surface, if one does.
    pub(super) finger: Option<Finger>,
    /// The inertias that the rotors of rigid joints add to the diagonal of the links' mass matrix.
    pub(super) rotors_kg_m2: [f64; 3],
    pub(super) edge_s: f64,
    pub(super) tolerance: f64,
}

impl<L: Links> Arm<L> {
    pub(super) fn with(links: L, joints: Joints, edge_s: f64) -> Self {
        let rigid = |i: usize| if joints.transmission[i].is_none() { joints.rotor_kg_m2[i] } else { 0.0 };
        Self { links, joints, finger: None, rotors_kg_m2: std::array::from_fn(rigid), edge_s, tolerance: 1e-16 }
    }

    /// Returns the arm, integrated so that the last terms of a series stay below this (rad/s, N·m); the default is
    /// 1e-16.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// Returns the tip's position.
    pub fn tip_m(&self, angles_rad: [f64; 3]) -> [f64; 3] {
        self.links.tip_m(angles_rad)
    }

    /// Returns the equations' terms in a pose: those of the links, and the rotors of rigid joints.
    #[inline]
    pub(super) fn pose(&self, near: &Sines, q: [f64; 3], v: [f64; 3]) -> Pose {
        let mut pose = self.links.pose(near, q, v);
        for (i, rotor_kg_m2) in self.rotors_kg_m2.iter().enumerate() {
            pose.mass_kg_m2[i][i] += rotor_kg_m2;
        }
        pose
    }

    /// Returns the situation of the finger in a pose, its force, and the torques of that force; it is apart without a
    /// finger.
    pub(super) fn pushed(&self, q: [f64; 3], v: [f64; 3], press: &Press) -> (Touch, f64, [f64; 3]) {
        let (Some(finger), Some((height_m, rising, slopes))) = (&self.finger, self.links.surface(q, v)) else {
            return (Touch::Apart, 0.0, [0.0; 3]);
        };
        let depth_m = height_m - press.target_m;
        let force_n = finger.force_n(depth_m, rising - press.speed_m_per_s);
        match Finger::touch(depth_m, force_n) {
            Touch::Pressed => (Touch::Pressed, force_n, slopes.map(|slope| -force_n * slope)),
            touch => (touch, 0.0, [0.0; 3]),
        }
    }

    /// Returns the acceleration of each joint's motor per torque, at the start of a series.
    pub(super) fn ease(&self, work: &L::Work) -> [f64; 3] {
        let (rigid, joints) = (L::ease(self, work), &self.joints);
        [0, 1, 2].map(|i| match (joints.free[i], joints.transmission[i]) {
            (false, _) => 0.0,
            (true, None) => rigid[i],
            (true, Some(_)) => 1.0 / joints.rotor_kg_m2[i],
        })
    }

    /// Writes the series from `x` on for joints in the states `holds`: the first powers if these suffice, else all.
    pub(super) fn write(&self, series: &mut Series, work: &mut L::Work, x: &Start, holds: &[Hold; 3]) {
        let rests = |i: usize| !matches!(holds[i], Hold::Slip(_));
        (series.q[0], series.v[0], series.p[0], series.w[0], series.lag[0]) = (x.q, x.v, x.p, x.w, x.lag);
        series.powers = 0;
        let is_still = !(0..3).any(|i| moves(&self.joints, holds, i)) && x.lag == [0.0; 4] && (0..3).all(rests);
        if is_still && self.finger.is_none() {
            series.good_s = f64::INFINITY;
            return;
        }
        L::extend(self, series, work, x, holds, FIRST);
        if series.good_s < FIRST_LASTS_S {
            L::extend(self, series, work, x, holds, ORDER);
        }
    }
}

/// The terms of the equations of motion that depend on the pose and the speeds.
pub struct Pose {
    /// The mass matrix.
    pub(super) mass_kg_m2: [[f64; 3]; 3],
    /// Torques of gravity and of the motion itself, with the sign of the motors' torques.
    pub(super) bias_nm: [f64; 3],
}

impl Pose {
    /// Returns whether joint 1 has no inertia in common with the others.
    pub(super) fn is_first_alone(&self) -> bool {
        self.mass_kg_m2[0][1] == 0.0 && self.mass_kg_m2[0][2] == 0.0
    }

    /// Returns the accelerations that these torques give the joints that move.
    #[inline(always)]
    pub(super) fn accelerations(&self, torque_nm: [f64; 3], moves: [bool; 3]) -> [f64; 3] {
        if !self.is_first_alone() {
            return Factors::of(&self.mass_kg_m2, moves).solve(torque_nm);
        }
        let [[m11, ..], [_, m22, m23], [.., m33]] = self.mass_kg_m2;
        let [one, two, three] = torque_nm;
        let (two, three) = match (moves[1], moves[2]) {
            (true, true) => {
                let determinant = m22 * m33 - m23 * m23;
                ((m33 * two - m23 * three) / determinant, (m22 * three - m23 * two) / determinant)
            }
            (first, second) => (if first { two / m22 } else { 0.0 }, if second { three / m33 } else { 0.0 }),
        };
        [if moves[0] { one / m11 } else { 0.0 }, two, three]
    }
}

/// A mass matrix of the joints that move, factored as `L D Lᵀ`.
#[derive(Clone, Default)]
pub(super) struct Factors {
    /// `L10`, `L20`, `L21`.
    lower: [f64; 3],
    diagonal: [f64; 3],
    moves: [bool; 3],
}

impl Factors {
    pub(super) fn of(mass: &[[f64; 3]; 3], moves: [bool; 3]) -> Self {
        let entry = |i: usize, j: usize| match (moves[i] && moves[j], i == j) {
            (true, _) => mass[i][j],
            (false, true) => 1.0,
            (false, false) => 0.0,
        };
        let first = entry(0, 0);
        let (l10, l20) = (entry(1, 0) / first, entry(2, 0) / first);
        let second = entry(1, 1) - l10 * entry(1, 0);
        let l21 = (entry(2, 1) - l20 * entry(1, 0)) / second;
        let third = entry(2, 2) - l20 * entry(2, 0) - l21 * l21 * second;
        Self { lower: [l10, l20, l21], diagonal: [first, second, third], moves }
    }

    /// Returns the accelerations that these torques give; 0 for joints that do not move.
    pub(super) fn solve(&self, torque: [f64; 3]) -> [f64; 3] {
        let [l10, l20, l21] = self.lower;
        let [a, b, c] = std::array::from_fn(|i| if self.moves[i] { torque[i] } else { 0.0 });
        let b = b - l10 * a;
        let c = c - l20 * a - l21 * b;
        let three = c / self.diagonal[2];
        let two = b / self.diagonal[1] - l21 * three;
        [a / self.diagonal[0] - l10 * two - l20 * three, two, three]
    }
}
