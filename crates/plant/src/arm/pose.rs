//! The equations of motion in one pose.

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
