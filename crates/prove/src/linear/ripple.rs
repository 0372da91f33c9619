//! The motion that a modulator's pulses force at rest, in encoder counts.
//!
//! At a constant duty the pulses repeat, and so does the motion of motor and hand. It is the fixed point of the
//! period's map. The wall takes no part in it: its command is the duty. A verdict asks for less than one count rms
//! about the mean, so a wall whose ripple alone has more does not settle, however stable its loop is.

use std::array::from_fn;

use hpu_cosim::scene::{BridgeModel, Device, LawMethod, Loop, Scene, Winding};
use serde::Serialize;

use crate::sampled::{Matrix, exponential, product, scaled, solution};
use crate::waits::{Drive, Rest};

/// Number of stiffnesses at which the ripple is computed before any is narrowed.
const LOOKS: usize = 200;

/// The ripple of a scene's modulator over a range of stiffnesses, at the duty at rest of each. Coulomb friction, which
/// lets a device move less or not at all, is left out.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Ripple {
    /// Greatest rms about the mean, in encoder counts.
    #[serde(rename = "most")]
    pub most_counts: f64,
    /// The stretches of stiffness at which the ripple alone has one count rms or more.
    #[serde(rename = "one_count_or_more")]
    pub beyond: Vec<[f64; 2]>,
}

impl Ripple {
    /// Computes the ripple of a scene; `None` if no pulses drive its device, or if their ripple is not worked out: for
    /// a network, a bridge with a dead time or an open off phase, a winding without inductance, a hand without a place
    /// of rest, or a law whose command at rest is not that of the wall's spring.
    pub fn new(scene: &Scene, range: [f64; 2]) -> Option<Self> {
        if !has_spring_at_rest(scene) || scene.network.is_some() {
            return None;
        }
        let pulses = Pulsed::of(scene)?;
        let rest = Rest::of(scene)?;
        let [low, high] = [range[0], rest.full_from().map_or(range[1], |full| full.min(range[1]))];
        if low >= high {
            return None;
        }
        let counts = |stiffness: f64| pulses.rms_rad(rest.duty(stiffness)) / scene.encoder.count_rad();
        let at = |index: usize| low * libm::pow(high / low, index as f64 / (LOOKS - 1) as f64);
        let looks: Vec<[f64; 2]> = (0..LOOKS).map(at).map(|stiffness| [stiffness, counts(stiffness)]).collect();
        let narrowed = |mut inside: f64, mut outside: f64| {
            while (outside - inside).abs() > 1e-12 * outside {
                let middle = 0.5 * (inside + outside);
                *(if counts(middle) >= 1.0 { &mut inside } else { &mut outside }) = middle;
            }
            inside
        };
        let (mut beyond, mut from) = (Vec::new(), None);
        for (index, [stiffness, counts]) in looks.iter().copied().enumerate() {
            let before = index.checked_sub(1).map_or(stiffness, |before| looks[before][0]);
            match from {
                None if counts >= 1.0 => from = Some(narrowed(stiffness, before)),
                Some(start) if counts < 1.0 => {
                    beyond.push([start, narrowed(before, stiffness)]);
                    from = None;
                }
                _ => {}
            }
        }
        beyond.extend(from.map(|start| [start, high]));
        let most_counts = looks.iter().fold(0.0, |most: f64, [_, counts]| most.max(*counts));
        Some(Self { most_counts, beyond })
    }
}

/// Whether the command of a device at rest in the wall is that of the wall's spring at all times. Laws that put another
/// spring before it, bound it, or let it die have other commands, as has an input shaper.
fn has_spring_at_rest(scene: &Scene) -> bool {
    let is_spring = match scene.method.kind {
        Loop::Hybrid | Loop::Conventional => true,
        Loop::Law(law) => matches!(law, LawMethod::SampledWall(_)),
    };
    is_spring && scene.method.shaper_hz.is_none() && scene.wall.ramp.is_none()
}

/// A motor and its hand under a bridge's pulses.
struct Pulsed {
    /// The plant: current, speed, angle.
    rates: [[f64; 3]; 3],
    /// The current's slope by full voltage.
    push: f64,
    period_s: f64,
    antiphase: bool,
    /// Whether a spring holds the angle.
    is_held: bool,
}

impl Pulsed {
    fn of(scene: &Scene) -> Option<Self> {
        let Device::Motor(motor) = &scene.device else { return None };
        let Drive::Pulses { period, antiphase, .. } = Drive::of(scene) else { return None };
        let pwm = scene.method.pwm;
        let is_other = pwm.floating || pwm.dead_time_s > 0.0 || scene.model.winding == Winding::Resistive;
        if is_other || scene.model.bridge != BridgeModel::Switching {
            return None;
        }
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let drag = motor.viscous_friction_nm_s_per_rad + grip_damping;
        Some(Self {
            rates: [[-ohm / l, -k / l, 0.0], [k / j, -drag / j, -grip / j], [0.0, 1.0, 0.0]],
            push: scene.bridge.supply_v / l,
            period_s: period as f64 * scene.clock.period_s(),
            antiphase,
            is_held: grip > 0.0,
        })
    }

    /// Returns the rms of the angle about its mean at a duty.
    fn rms_rad(&self, duty: f64) -> f64 {
        // Length of each phase, and its voltage less the mean: shares of the period and of the supply.
        let phases = if self.antiphase {
            let on = 0.5 * (1.0 + duty);
            [(on, 1.0 - duty), (1.0 - on, -1.0 - duty)]
        } else {
            [(duty, 1.0 - duty), (1.0 - duty, -duty)]
        };
        let phases = phases.map(|(share, level)| (share * self.period_s, self.rates(level)));
        let whole = phases.iter().fold(None, |whole: Option<Matrix>, (time_s, rates)| {
            let flow = exponential(&scaled(rates, *time_s));
            Some(whole.map_or(flow.clone(), |first| product(&flow, &first)))
        });
        let whole = whole.expect("a period has phases");
        // The state that the period leaves as it is; without a spring the angle is from where the period begins.
        let states = if self.is_held { 3 } else { 2 };
        let Some(start) = fixed(&whole, states) else { return f64::NAN };
        let mut state = [start[0], start[1], start[2], 1.0];
        let (mut mean, mut square) = (0.0, 0.0);
        for (time_s, rates) in &phases {
            let all = integral(rates, *time_s, &state);
            (mean, square) = (mean + all[2][3] / self.period_s, square + all[2][2] / self.period_s);
            let flow = exponential(&scaled(rates, *time_s));
            state = from_fn(|row| (0..4).map(|k| flow[row][k] * state[k]).sum());
        }
        (square - mean * mean).max(0.0).sqrt()
    }

    /// Returns the rates under a share of the supply, with a constant 1 as the last state.
    fn rates(&self, level: f64) -> Matrix {
        let push = [level * self.push, 0.0, 0.0];
        let rows = self.rates.iter().zip(push).map(|(row, push)| vec![row[0], row[1], row[2], push]);
        rows.chain([vec![0.0; 4]]).collect()
    }
}

/// Returns the state whose first states a map leaves as they are, with the others at 0. The map's last state is 1.
fn fixed(map: &Matrix, states: usize) -> Option<[f64; 3]> {
    let row = |row: usize| {
        let own = (0..states).map(|of| f64::from(u8::from(of == row)) - map[row][of]);
        own.chain([map[row][3]]).collect()
    };
    let found = solution((0..states).map(row).collect())?;
    Some(from_fn(|state| found.get(state).copied().unwrap_or(0.0)))
}

/// Returns the integral of `x x'` over a time from a state on: a Taylor series over a short time, doubled.
fn integral(rates: &Matrix, time_s: f64, state: &[f64; 4]) -> Matrix {
    let norm = rates.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max) * time_s;
    let halvings = (libm::log2(norm.max(1e-9)).ceil() as i32 + 4).max(0);
    let short_s = time_s * 0.5f64.powi(halvings);
    let mut term: Matrix = state.iter().map(|x| state.iter().map(|y| x * y * short_s).collect()).collect();
    let mut sum = term.clone();
    for power in 2..=16 {
        let moved = product(rates, &term);
        let by = short_s / f64::from(power);
        term = (0..4).map(|r| (0..4).map(|c| (moved[r][c] + moved[c][r]) * by).collect()).collect();
        for (sum, term) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
            *sum += term;
        }
    }
    let mut flow = exponential(&scaled(rates, short_s));
    for _ in 0..halvings {
        let moved = product(&product(&flow, &sum), &transposed(&flow));
        for (sum, moved) in sum.iter_mut().flatten().zip(moved.iter().flatten()) {
            *sum += moved;
        }
        flow = product(&flow, &flow);
    }
    sum
}

fn transposed(a: &Matrix) -> Matrix {
    (0..a.len()).map(|row| a.iter().map(|other| other[row]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use hpu_cosim::scene::{Scene, shipped};

    use super::{Pulsed, Ripple};

    fn scene(name: &str) -> Scene {
        changed(name, |text| text)
    }

    fn changed(name: &str, change: impl Fn(String) -> String) -> Scene {
        let shipped = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
        let text = change(shipped.text.to_string());
        Scene::parse(name, &text, &[], &mut |_| unreachable!("no file is named")).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn the_ripple_has_the_rms_of_its_closed_form() {
        // Computed from x0 = (1 - e^(A T))^-1 e^(A (T - D T)) G(D T) b V in arithmetic of 50 digits.
        for (name, duty, counts) in [
            ("slow-pwm", 0.25, 1.642_595_679_634_3),
            ("slow-pwm", 0.125, 0.896_463_626_650_99),
            ("hybrid-wall", 0.25, 9.190_119_348_572_9e-4),
        ] {
            let scene = scene(name);
            let found = Pulsed::of(&scene).expect("pulses").rms_rad(duty) / scene.encoder.count_rad();
            assert!((found / counts - 1.0).abs() < 1e-9, "{name} at {duty}: {found}, not {counts}");
        }
    }

    #[test]
    fn slow_pulses_alone_have_one_count_at_the_known_duty_and_from_a_stiffness_on() {
        // 0.21199450 N.m/rad with the wall at 1.5002 rad; the scene's own wall is at a whole count beside it.
        let (slow, known) = (scene("slow-pwm"), 0.211_994_50);
        let full = 0.265;
        let duty = known * 0.3 * (1.8 - 1.5002) / (known + 0.3) / full;
        let counts = Pulsed::of(&slow).expect("pulses").rms_rad(duty) / slow.encoder.count_rad();
        assert!((counts - 1.0).abs() < 1e-7, "{counts}");
        let found = Ripple::new(&slow, [0.05, 3.0]).expect("pulses");
        let [from, to] = found.beyond[0];
        assert!(found.beyond.len() == 1 && (from / known - 1.0).abs() < 5e-4 && to == 3.0, "{found:?}");
        let quick = Ripple::new(&scene("hybrid-wall"), [0.05, 3.0]).expect("pulses");
        assert!(quick.beyond.is_empty() && quick.most_counts < 2e-3, "{quick:?}");
    }

    #[test]
    fn a_law_whose_command_at_rest_is_not_the_wall_s_spring_has_no_ripple() {
        // Behind a coupling of 0.1 N.m/rad the duty at rest stays below that at which slow pulses have one count.
        let coupled = |text: String| {
            let kind = "kind = \"virtual_coupling\"\ncoupling_stiffness = \"0.1 N.m/rad\"";
            text.replace("kind = \"hybrid\"", kind)
        };
        let ramped = |text: String| text + "[wall.ramp]\nstiffness = 1\nfrom = \"100 ms\"\nto = \"300 ms\"\n";
        let (coupled, ramped) = (changed("slow-pwm", coupled), changed("slow-pwm", ramped));
        assert!(coupled.method.kind != scene("slow-pwm").method.kind && ramped.wall.ramp.is_some());
        assert_eq!([coupled, ramped].map(|scene| Ripple::new(&scene, [0.05, 3.0])), [None, None]);
    }
}
