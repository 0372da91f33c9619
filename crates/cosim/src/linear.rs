//! The reference law in floats: linear, unquantised, unsaturated, pulling as well as pushing.
//!
//! `u = -(k (θ - θ_w) + b v)`, as a torque at stall (voltage `u R / K`) for a motor and as a force for a mass. The
//! hybrid loop's spring is continuous, part of the plant's matrix, and so is a hand that is a spring and damper.
//! Everything sampled is held for a period `T` after a delay. The velocity is the backward difference. This is exactly
//! the loop that the published limits describe.
//!
//! The motion of a linear loop has no end state, so the verdict is the sign of its growth rate. The rate is measured as
//! the ratio of the mean squares over two Hann-weighted windows, whose end effects vanish with the third power of the
//! number of oscillations.

use hpu_plant::{Linear, Mass, Matrix, Motor, State, Stride};

use hpu_scene::{Device, Scene};

/// A linear loop, ready to run.
pub struct LinearLoop {
    /// Change of the speed's or the current's derivative per unit of effort.
    input: State,
    /// The step from a sample to the edge where its effort begins (none without delay), and from there to the next
    /// sample.
    strides: [Option<Stride>; 2],
    /// Whole samples by which an effort is late.
    whole: usize,
    spring: f64,
    damper: f64,
    period_s: f64,
}

impl LinearLoop {
    /// Creates the loop of a scene with another wall: stiffness in N·m/rad (N/m), damping in N·m·s/rad (N·s/m).
    pub fn new(scene: &Scene, stiffness: f64, damping: f64) -> Self {
        let (mut a, input): (Matrix, State) = match &scene.device {
            Device::Motor(motor) => {
                let resistance_ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
                let shaft = Motor {
                    resistance_ohm,
                    inductance_h: motor.inductance_h,
                    torque_constant_nm_per_a: motor.torque_constant_nm_per_a,
                    inertia_kg_m2: motor.inertia_kg_m2(),
                    viscous_nm_s_per_rad: motor.viscous_friction_nm_s_per_rad,
                    coulomb_nm: 0.0,
                };
                let volts_per_nm = resistance_ohm / shaft.torque_constant_nm_per_a;
                (shaft.matrix(resistance_ohm), [volts_per_nm / shaft.inductance_h, 0.0, 0.0, 0.0])
            }
            Device::Mass(mass) => {
                let body = Mass { mass_kg: mass.mass_kg, damping_n_s_per_m: mass.damping_n_s_per_m };
                (body.matrix(), [0.0, 1.0 / body.mass_kg, 0.0, 0.0])
            }
        };
        let (grip, grip_damping) = scene.hand.grip();
        let inertia = match &scene.device {
            Device::Motor(motor) => motor.inertia_kg_m2(),
            Device::Mass(mass) => mass.mass_kg,
        };
        // The hand's intention is a constant: it decides where the motion ends, not whether it ends.
        a[1][1] -= grip_damping / inertia;
        a[1][2] -= grip / inertia;
        let mut spring = stiffness;
        if scene.method.kind.is_live() {
            for (row, effect) in a.iter_mut().zip(input) {
                row[2] -= effect * stiffness;
            }
            spring = 0.0;
        }
        let period = scene.period_clocks();
        let system = Linear::new(a, scene.clock.period_s(), period);
        let damper = damping / scene.sample_period_s();
        let delay = scene.clock.edges(scene.model.delay_s);
        let (whole, late) = ((delay / period) as usize, delay % period);
        let strides = [late, period - late].map(|edges| (edges > 0).then(|| system.stride(edges)));
        Self { input, strides, whole, spring, damper, period_s: period as f64 * scene.clock.period_s() }
    }

    /// Computes the positions at the sample instants from a start at position 1, at rest, scaled so that they never
    /// overflow. Calls `visit` with each position and the logarithm of its scale.
    pub fn samples(&self, count: usize, mut visit: impl FnMut(f64, f64)) {
        let mut x: State = [0.0, 0.0, 1.0, 0.0];
        let mut scale = 0.0;
        let mut previous = x[2];
        // Efforts on their way: each takes effect `delay` edges after its sample.
        let mut waiting = std::collections::VecDeque::from(vec![0.0; self.whole]);
        let [late, rest] = &self.strides;
        let after = |x: &State, effort: f64, stride: &Option<Stride>| match stride {
            Some(stride) => stride.after(x, &self.input.map(|effect| effect * effort)),
            None => *x,
        };
        let mut held = 0.0;
        let mut next_look = 0;
        for index in 0..count {
            visit(x[2], scale);
            let effort = -(self.spring * x[2] + self.damper * (x[2] - previous));
            previous = x[2];
            waiting.push_back(effort);
            x = after(&x, held, late);
            held = waiting.pop_front().expect("just pushed");
            x = after(&x, held, rest);
            let greater = |most: f64, value: &f64| most.max(value.abs());
            let size = x.iter().fold(previous.abs(), greater);
            // While efforts on their way are large, a small motion is not scaled. The queue is long, so it is checked
            // once per delay.
            if size >= 1e100 || size < 1e-100 && index >= next_look {
                next_look = index + self.whole;
                let size = waiting.iter().chain([&held]).fold(size, greater);
                if (1e-100..1e100).contains(&size) || size == 0.0 {
                    continue;
                }
                for value in x.iter_mut().chain([&mut previous, &mut held]).chain(&mut waiting) {
                    *value /= size;
                }
                scale += libm::log(size);
            }
        }
    }

    /// Returns the growth rate of the motion in 1/s, over `samples` samples: negative settles, positive diverges.
    pub fn growth_per_s(&self, samples: usize) -> f64 {
        let window = samples / 2;
        let mut logs = [f64::NEG_INFINITY; 2];
        let mut index = 0;
        let mut sum = (0.0, 0.0);
        self.samples(2 * window, |position, scale| {
            if index % window == 0 {
                sum = (0.0, scale);
            }
            // The sum stays in the greatest scale seen in its window; values far below that scale rightly vanish.
            if scale > sum.1 {
                sum = (sum.0 * libm::exp(2.0 * (sum.1 - scale)), scale);
            }
            let phase = std::f64::consts::TAU * (index % window) as f64 / window as f64;
            let share = if scale == sum.1 { 1.0 } else { libm::exp(2.0 * (scale - sum.1)) };
            sum.0 += (1.0 - libm::cos(phase)) * position * position * share;
            index += 1;
            if index % window == 0 {
                logs[index / window - 1] = libm::log(sum.0) + 2.0 * sum.1;
            }
        });
        let window_s = window as f64 * self.period_s;
        0.5 * (logs[1] - logs[0]) / window_s
    }
}
