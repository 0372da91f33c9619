//! The Taylor series of the arm's motion from one start, term by term.

use super::Arm;
use super::friction::Hold;
use super::polynomial::{Coefficients, Lanes, ORDER};

/// The start of a series, and the command at the start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Start {
    /// Angles and speeds of the links.
    pub(super) q: Lanes,
    pub(super) v: Lanes,
    /// Angles and speeds of the motors.
    pub(super) p: Lanes,
    pub(super) w: Lanes,
    /// Commanded torques, and the actual torques minus these.
    pub(super) u: Lanes,
    pub(super) lag: Lanes,
    /// The parts of `q`, `v`, `p` and `w` lost by rounding, kept so that no anchor adds to the error.
    pub(super) low: [Lanes; 4],
}

/// Number of powers that most segments need, because a command or friction cuts them short; the others are written only
/// if the motion reaches them.
const FIRST: usize = 6;
/// If the first powers are good for less than this time, all powers are written at once.
const FIRST_LASTS_S: f64 = 2e-5;

const ZERO: Coefficients = [[0.0; 4]; ORDER + 1];

/// Series of all quantities of [`Start`], and of the torque that holds each stuck joint.
#[derive(Clone)]
pub(super) struct Series {
    pub(super) q: Coefficients,
    pub(super) v: Coefficients,
    pub(super) p: Coefficients,
    pub(super) w: Coefficients,
    pub(super) lag: Coefficients,
    pub(super) hold: Coefficients,
    /// Powers in use: 0 where all is at rest.
    pub(super) powers: usize,
    /// Time for which the series are good.
    pub(super) good_s: f64,
    work: Work,
}

/// Intermediate series.
#[derive(Clone)]
struct Work {
    /// Rates, sines and cosines of 2θ2, 2θ3, θ2+θ3, θ2-θ3.
    rate: Coefficients,
    sine: Coefficients,
    cosine: Coefficients,
    /// Rates, sines and cosines of θ1 (for gravity), θ2, θ3.
    lean: Coefficients,
    lean_sine: Coefficients,
    lean_cosine: Coefficients,
    /// Lanes e, h, h, and lanes R, sin θ2, cos θ3; their products are gravity's torques.
    pull: Coefficients,
    arm: Coefficients,
    /// Lanes M11, M23, M23, and the speeds that they multiply, ω1, ω3, ω2.
    mass: Coefficients,
    met: Coefficients,
    /// Lanes half of ∂2M11, half of ∂3M11, P/2 cos(θ2-θ3); and ω1², ω1², ω2 ω3.
    bend: Coefficients,
    square: Coefficients,
    /// The next term of the momenta, the forces of the last power, and `M22 M33 - M23²` at the start.
    momentum: [f64; 3],
    before: [f64; 3],
    determinant: f64,
}

/// Returns the term of power `k` of the products, lane by lane, with `j` in `a` starting at `from`.
#[inline(always)]
fn product(a: &Coefficients, b: &Coefficients, from: usize, k: usize) -> Lanes {
    // Two sums, because each addition waits for the one before.
    let mut sums = [[0.0; 4]; 2];
    let mut j = from;
    while j < k {
        for lane in 0..4 {
            sums[0][lane] += a[j][lane] * b[k - j][lane];
            sums[1][lane] += a[j + 1][lane] * b[k - j - 1][lane];
        }
        j += 2;
    }
    if j == k {
        for lane in 0..4 {
            sums[0][lane] += a[k][lane] * b[0][lane];
        }
    }
    std::array::from_fn(|lane| sums[0][lane] + sums[1][lane])
}

/// Writes the terms of power `k + 1` of sines and cosines whose angles have these rates.
#[inline(always)]
fn turn(rate: &Coefficients, sine: &mut Coefficients, cosine: &mut Coefficients, k: usize) {
    let share = 1.0 / (k + 1) as f64;
    let (mut up, mut down) = ([0.0; 4], [0.0; 4]);
    for j in 0..=k {
        for lane in 0..4 {
            up[lane] += rate[j][lane] * cosine[k - j][lane];
            down[lane] += rate[j][lane] * sine[k - j][lane];
        }
    }
    for lane in 0..4 {
        sine[k + 1][lane] = up[lane] * share;
        cosine[k + 1][lane] = -down[lane] * share;
    }
}

/// Returns whether a joint's link moves.
fn moves(arm: &Arm, holds: &[Hold; 3], i: usize) -> bool {
    let held = holds[i] == Hold::Stuck && arm.model.transmission[i].is_none();
    holds[i] != Hold::Locked && !held
}

impl Start {
    /// Returns the angle by which a motor is ahead of its link.
    pub(super) fn twist_rad(&self, i: usize) -> f64 {
        (self.p[i] - self.q[i]) + (self.low[2][i] - self.low[0][i])
    }
}

impl Series {
    pub(super) fn new() -> Self {
        let work = Work {
            rate: ZERO,
            sine: ZERO,
            cosine: ZERO,
            lean: ZERO,
            lean_sine: ZERO,
            lean_cosine: ZERO,
            pull: ZERO,
            arm: ZERO,
            mass: ZERO,
            met: ZERO,
            bend: ZERO,
            square: ZERO,
            momentum: [0.0; 3],
            before: [0.0; 3],
            determinant: 1.0,
        };
        Self { q: ZERO, v: ZERO, p: ZERO, w: ZERO, lag: ZERO, hold: ZERO, powers: 0, good_s: 0.0, work }
    }

    /// Writes the series from `x` on for joints in the states `holds`: the first powers if these suffice, else all.
    pub(super) fn write(&mut self, arm: &Arm, x: &Start, holds: &[Hold; 3]) {
        let rests = |i: usize| !matches!(holds[i], Hold::Slip(_));
        (self.q[0], self.v[0], self.p[0], self.w[0], self.lag[0]) = (x.q, x.v, x.p, x.w, x.lag);
        self.powers = 0;
        if !(0..3).any(|i| moves(arm, holds, i)) && x.lag == [0.0; 4] && (0..3).all(rests) {
            self.good_s = f64::INFINITY;
            return;
        }
        self.extend(arm, x, holds, FIRST);
        if self.good_s < FIRST_LASTS_S {
            self.extend(arm, x, holds, ORDER);
        }
    }

    /// Extends the series to a higher power.
    pub(super) fn extend(&mut self, arm: &Arm, x: &Start, holds: &[Hold; 3], powers: usize) {
        let model = &arm.model;
        let flexible = model.transmission;
        let rests = |i: usize| !matches!(holds[i], Hold::Slip(_));
        let moves = [0, 1, 2].map(|i| moves(arm, holds, i));
        let done = std::mem::replace(&mut self.powers, powers);
        let (g, [a, b]) = (model.gravity_m_per_s2, model.moments_kg_m);
        let heavy = (a != 0.0 || b != 0.0) && g != [0.0; 3];
        let swings = moves[1] || moves[2];
        let held = |i: usize| holds[i] == Hold::Stuck && flexible[i].is_none();
        // Whether M11 and M23 change with an effect on this motion.
        let shape = swings && (moves[0] || (moves[1] && moves[2]) || held(1) || held(2));
        let spins = moves[0] && (swings || held(1) || held(2));
        let [m1, m22, m33] = arm.diagonal_kg_m2();
        let ([a0, a2, a3], half_p) = (model.turning_kg_m2, 0.5 * model.coupling_kg_m2);

        let Work {
            rate,
            sine,
            cosine,
            lean,
            lean_sine,
            lean_cosine,
            pull,
            arm: lever,
            mass,
            met,
            bend,
            square,
            momentum,
            before,
            determinant,
        } = &mut self.work;
        if done == 0 {
            let [(s1, c1), (s2, c2), (s3, c3)] = [x.q[0], x.q[1], x.q[2]].map(libm::sincos);
            sine[0] = [2.0 * s2 * c2, 2.0 * s3 * c3, s2 * c3 + c2 * s3, s2 * c3 - c2 * s3];
            cosine[0] = [c2 * c2 - s2 * s2, c3 * c3 - s3 * s3, c2 * c3 - s2 * s3, c2 * c3 + s2 * s3];
            lean_sine[0] = [g[0] * s1 + g[2] * c1, s2, s3, 0.0];
            lean_cosine[0] = [g[0] * c1 - g[2] * s1, c2, c3, 0.0];
        }
        for k in done..powers {
            let share = 1.0 / (k + 1) as f64;
            if k == 0 || shape {
                let (s, c) = (&sine[k], &cosine[k]);
                let m11 = a2 * c[0] + a3 * c[1] + half_p * (s[2] - s[3]);
                let m23 = -half_p * s[3];
                let quarter_p = 0.5 * half_p;
                mass[k] = [m11, m23, m23, 0.0];
                bend[k] = [
                    -a2 * s[0] + quarter_p * (c[2] - c[3]),
                    -a3 * s[1] + quarter_p * (c[2] + c[3]),
                    half_p * c[3],
                    0.0,
                ];
            } else {
                mass[k] = [0.0; 4];
                bend[k] = [0.0; 4];
            }
            // Speeds, computed from momenta.
            let m23 = mass[0][1];
            if k == 0 {
                mass[0][0] += a0 + m1;
                *determinant = m22 * m33 - m23 * m23;
                *momentum = [mass[0][0] * x.v[0], m22 * x.v[1] + m23 * x.v[2], m33 * x.v[2] + m23 * x.v[1]];
            }
            let known = if shape { product(mass, met, 1, k) } else { [0.0; 4] };
            let v = if k == 0 {
                x.v
            } else {
                let rest = [momentum[0] - known[0], momentum[1] - known[1], momentum[2] - known[2]];
                let (v2, v3) = match (moves[1], moves[2]) {
                    (true, true) => {
                        ((m33 * rest[1] - m23 * rest[2]) / *determinant, (m22 * rest[2] - m23 * rest[1]) / *determinant)
                    }
                    (true, false) => (momentum[1] / m22, 0.0),
                    (false, true) => (0.0, momentum[2] / m33),
                    (false, false) => (0.0, 0.0),
                };
                let mut v = [if moves[0] { rest[0] / mass[0][0] } else { 0.0 }, v2, v3, 0.0];
                if k == 1 {
                    for i in 0..3 {
                        if flexible[i].is_none() {
                            v[i] = onward(holds[i], x.w[i], v[i]);
                        }
                    }
                }
                v
            };
            self.v[k] = v;
            met[k] = [v[0], v[2], v[1], 0.0];
            // The torques that hold the stuck joints, one power behind: their own momentum is all coupling.
            let coupled = [0.0, known[1] + m23 * v[2], known[2] + m23 * v[1]];
            if k > 0 {
                for i in 0..3 {
                    if flexible[i].is_none() {
                        self.hold[k - 1][i] = before[i] - k as f64 * coupled[i];
                    }
                }
            }
            // The forces of motion and gravity.
            let mut force = [0.0; 3];
            if spins || (moves[1] && moves[2]) {
                let mut sums = [0.0; 4];
                for j in 0..=k {
                    let (one, other) = (&self.v[j], &self.v[k - j]);
                    sums[0] += one[0] * other[0];
                    sums[2] += one[1] * other[2];
                }
                square[k] = [sums[0], sums[0], sums[2], 0.0];
                let bent = product(bend, square, 0, k);
                force = [0.0, bent[0] - bent[2], bent[1] + bent[2]];
            }
            if heavy {
                let (s, c) = (&lean_sine[k], &lean_cosine[k]);
                pull[k] = [c[0], s[0], s[0], 0.0];
                lever[k] = [a * c[1] + b * s[2], s[1], c[2], 0.0];
                let pulled = product(pull, lever, 0, k);
                force[0] += pulled[0];
                force[1] += a * (g[1] * c[1] - pulled[1]);
                force[2] += b * (g[1] * s[2] + pulled[2]);
            }
            // Motors and transmissions.
            for i in 0..3 {
                let (w, lag) = (if flexible[i].is_some() { self.w[k][i] } else { v[i] }, self.lag[k][i]);
                let mut torque_nm = lag;
                if k == 0 {
                    torque_nm += x.u[i];
                    if let Hold::Slip(sign) = holds[i] {
                        torque_nm -= sign * model.coulomb_nm[i];
                    }
                }
                if model.amplifier_s > 0.0 {
                    self.lag[k + 1][i] = -lag * share / model.amplifier_s;
                } else {
                    self.lag[k + 1][i] = 0.0;
                }
                torque_nm -= model.viscous_nm_s_per_rad[i] * w;
                if let Some(flexible) = flexible[i] {
                    let twist = if k == 0 { x.twist_rad(i) } else { self.p[k][i] - self.q[k][i] };
                    let spring_nm = flexible.stiffness_nm_per_rad * twist + flexible.damping_nm_s_per_rad * (w - v[i]);
                    self.hold[k][i] = torque_nm - spring_nm;
                    let next = if rests(i) { 0.0 } else { (torque_nm - spring_nm) * share / model.rotor_kg_m2[i] };
                    self.w[k + 1][i] = if k == 0 { onward(holds[i], x.w[i], next) } else { next };
                    self.p[k + 1][i] = w * share;
                    torque_nm = spring_nm;
                } else {
                    self.w[k][i] = w;
                    self.p[k + 1][i] = v[i] * share;
                }
                force[i] += torque_nm;
                self.q[k + 1][i] = v[i] * share;
                momentum[i] = force[i] * share;
            }
            *before = force;
            if shape {
                rate[k] = [2.0 * v[1], 2.0 * v[2], v[1] + v[2], v[1] - v[2]];
                turn(rate, sine, cosine, k);
            }
            if heavy {
                lean[k] = [v[0], v[1], v[2], 0.0];
                turn(lean, lean_sine, lean_cosine, k);
            }
        }
        // The highest power of those quantities that follow only from the next power.
        self.v[powers] = [0.0; 4];
        self.hold[powers] = [0.0; 4];
        for (i, _) in flexible.iter().enumerate().filter(|(_, flexible)| flexible.is_none()) {
            self.w[powers][i] = 0.0;
            self.hold[powers - 1][i] = 0.0;
        }
        self.good_s = self.good_for(arm.tolerance);
    }

    /// Returns the acceleration of each joint's motor per torque, at the start.
    pub(super) fn ease(&self, arm: &Arm) -> [f64; 3] {
        let [_, m22, m33] = arm.diagonal_kg_m2();
        let rigid = [1.0 / self.work.mass[0][0], m33 / self.work.determinant, m22 / self.work.determinant];
        let model = &arm.model;
        [0, 1, 2].map(|i| match (model.free[i], model.transmission[i]) {
            (false, _) => 0.0,
            (true, None) => rigid[i],
            (true, Some(_)) => 1.0 / model.rotor_kg_m2[i],
        })
    }

    /// Returns how long the terms of the last two powers of speeds and torques stay below the tolerance.
    fn good_for(&self, tolerance: f64) -> f64 {
        let size = |k: usize| {
            [&self.v, &self.w, &self.lag].iter().flat_map(|terms| terms[k]).fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let length = |k: usize| {
            let size = size(k);
            if size == 0.0 { f64::INFINITY } else { libm::pow(tolerance / size, 1.0 / k as f64) }
        };
        length(self.powers - 1).min(length(self.powers - 2))
    }
}

/// Returns the first power of the speed of a joint that starts to slip from rest; rounding must not make it negative.
#[inline]
fn onward(hold: Hold, speed: f64, first: f64) -> f64 {
    match hold {
        Hold::Slip(sign) if speed == 0.0 && sign * first < 0.0 => 0.0,
        _ => first,
    }
}
