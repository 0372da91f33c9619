//! The sampled loop as one matrix from sample to sample. It is built independently of the emulator, with its own matrix
//! exponential, its own states and its own spectral radius.

use hpu_cosim::scene::{Device, Scene};

/// A square matrix, as a list of rows.
pub type Matrix = Vec<Vec<f64>>;

fn identity(n: usize) -> Matrix {
    (0..n).map(|r| (0..n).map(|c| if r == c { 1.0 } else { 0.0 }).collect()).collect()
}

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let n = a.len();
    (0..n).map(|r| (0..n).map(|c| (0..n).map(|k| a[r][k] * b[k][c]).sum()).collect()).collect()
}

/// Returns the greatest sum of absolute values along a row.
fn norm(a: &Matrix) -> f64 {
    a.iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

/// Returns a matrix times a number.
pub fn scaled(a: &Matrix, factor: f64) -> Matrix {
    a.iter().map(|row| row.iter().map(|x| x * factor).collect()).collect()
}

/// Returns the solution of a system of equations, whose rows have their right side last, by elimination; `None` if
/// there is none.
pub(crate) fn solution(mut rows: Matrix) -> Option<Vec<f64>> {
    let size = rows.len();
    for k in 0..size {
        let pivot = (k..size).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        rows.swap(k, pivot);
        let by = 1.0 / rows[k][k];
        if !by.is_finite() {
            return None;
        }
        let own: Vec<f64> = rows[k].iter().map(|cell| cell * by).collect();
        for row in &mut rows {
            let factor = row[k];
            if factor != 0.0 {
                row.iter_mut().zip(&own).for_each(|(cell, own)| *cell -= factor * own);
            }
        }
        rows[k] = own;
    }
    Some(rows.iter().map(|row| row[size]).collect())
}

/// Returns `e^A` by Taylor's series of `A / 2^s`, squared `s` times.
pub fn exponential(a: &Matrix) -> Matrix {
    let squarings = libm::log2(norm(a)).ceil().max(0.0) as i32 + 2;
    let small = scaled(a, 0.5f64.powi(squarings));
    let mut sum = identity(a.len());
    // Horner: 1 + A (1 + A/2 (1 + A/3 (...))). The norm is at most a quarter, and a quarter to the 16th over 16! is
    // below rounding.
    for term in (1..=16).rev() {
        let mut next = scaled(&product(&small, &sum), 1.0 / f64::from(term));
        for (r, row) in next.iter_mut().enumerate() {
            row[r] += 1.0;
        }
        sum = next;
    }
    (0..squarings).fold(sum, |power, _| product(&power, &power))
}

/// Returns the plant with its hand, and with its input as one more state: x' = A x + b u, u' = 0. The position is the
/// last state before u.
fn plant(scene: &Scene) -> Matrix {
    let (grip, grip_damping) = scene.hand.grip();
    match &scene.device {
        Device::Motor(motor) => {
            let (r, l) = (motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm, motor.inductance_h);
            let (k, j) = (motor.torque_constant_nm_per_a, motor.inertia_kg_m2());
            let b = motor.viscous_friction_nm_s_per_rad + grip_damping;
            // The effort is the torque at stall: u R / K in volts.
            vec![
                vec![-r / l, -k / l, 0.0, r / (k * l)],
                vec![k / j, -b / j, -grip / j, 0.0],
                vec![0.0, 1.0, 0.0, 0.0],
                vec![0.0; 4],
            ]
        }
        Device::Mass(mass) => {
            let (m, b) = (mass.mass_kg, mass.damping_n_s_per_m + grip_damping);
            vec![vec![-b / m, -grip / m, 1.0 / m], vec![1.0, 0.0, 0.0], vec![0.0; 3]]
        }
    }
}

/// The linear, unquantised loop of a scene, from sample to sample.
pub struct SampledLoop {
    map: Matrix,
}

impl SampledLoop {
    /// Returns the loop whose states, from one sample to the next, a matrix maps.
    pub fn of(map: Matrix) -> Self {
        Self { map }
    }

    /// Returns the loop of a scene with another wall: stiffness in N·m/rad (N/m), damping in N·m·s/rad (N·s/m).
    ///
    /// If the hand is a spring and damper, it pulls back with these. The states are those of the plant, the position of
    /// the previous sample, and the efforts that have not yet taken effect.
    pub fn new(scene: &Scene, stiffness: f64, damping: f64) -> Self {
        let mut plant = plant(scene);
        let states = plant.len() - 1;
        let position = states - 1;
        let mut spring = stiffness;
        if scene.method.kind.is_live() {
            for row in &mut plant {
                row[position] -= row[states] * stiffness;
            }
            spring = 0.0;
        }
        let period = scene.period_clocks();
        let delay = scene.clock.edges(scene.model.delay_s);
        let (whole, late) = ((delay / period) as usize, delay % period);
        let flow = |clocks: u64| exponential(&scaled(&plant, clocks as f64 / scene.clock.frequency_hz() as f64));
        let (before, after) = (flow(late), flow(period - late));

        // State: x, the previous position, then the efforts of the last 1 + whole samples, the oldest last.
        let (previous, first) = (states, states + 1);
        let oldest = first + whole;
        let mut effort = vec![0.0; oldest + 1];
        let damper = damping / scene.sample_period_s();
        effort[position] = -(spring + damper);
        effort[previous] = damper;
        // The effort that takes effect within this period: this sample's, or one of an earlier sample.
        let mut taking = vec![0.0; oldest + 1];
        if whole == 0 {
            taking.clone_from(&effort);
        } else {
            taking[oldest - 1] = 1.0;
        }
        let mut map = vec![vec![0.0; oldest + 1]; oldest + 1];
        for (r, row) in map.iter_mut().take(states).enumerate() {
            for c in 0..states {
                row[c] = (0..states).map(|k| after[r][k] * before[k][c]).sum();
            }
            row[oldest] = (0..states).map(|k| after[r][k] * before[k][states]).sum();
            for (to, share) in row.iter_mut().zip(&taking) {
                *to += after[r][states] * share;
            }
        }
        map[previous][position] = 1.0;
        map[first] = effort;
        for effort in first + 1..=oldest {
            map[effort][effort - 1] = 1.0;
        }
        Self { map }
    }

    /// Returns the loop of a scene with a sampled spring whose damping is refreshed only every `every` samples, from
    /// one refresh to the next, without delay.
    pub fn dual_rate(scene: &Scene, stiffness: f64, damping: f64, every: u32) -> Self {
        let plant = plant(scene);
        let effort = plant.len() - 1;
        let flow = exponential(&scaled(&plant, scene.sample_period_s()));
        // State: the plant's states, the position at the previous refresh, and the damping's effort.
        let (position, previous, drag) = (effort - 1, effort, effort + 1);
        let mut sample = identity(drag + 1);
        for (to, row) in sample.iter_mut().zip(&flow).take(effort) {
            to[..effort].copy_from_slice(&row[..effort]);
            to[position] -= stiffness * row[effort];
            to[drag] = row[effort];
        }
        let mut refresh = identity(drag + 1);
        let damper = damping / (scene.sample_period_s() * f64::from(every));
        refresh[drag] = vec![0.0; drag + 1];
        (refresh[drag][position], refresh[drag][previous]) = (-damper, damper);
        refresh[previous] = vec![0.0; drag + 1];
        refresh[previous][position] = 1.0;
        Self { map: (0..every).fold(refresh, |map, _| product(&sample, &map)) }
    }

    /// Returns the greatest absolute value of an eigenvalue: the growth of the motion from one sample to the next.
    ///
    /// This is Gelfand's `lim ‖Mⁿ‖^(1/n)` along n = 2^k; a relative rounding error of one squaring weighs 2^-k in the
    /// result.
    pub fn spectral_radius(&self) -> f64 {
        let mut power = self.map.clone();
        let mut log = 0.0;
        let mut weight = 1.0;
        for _ in 0..60 {
            let size = norm(&power);
            if size == 0.0 {
                return 0.0;
            }
            log += weight * libm::log(size);
            power = scaled(&power, 1.0 / size);
            power = product(&power, &power);
            weight *= 0.5;
        }
        libm::exp(log)
    }
}
