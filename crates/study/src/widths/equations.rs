//! The blocks' equations in `f64`, from their data sheets: what a word is held against.

use std::f64::consts::PI;

use hpu_datapath::{AnyBlock, Generic};

/// On which side of the quantisation a block's equation is taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Side {
    /// As the law has it: nothing wraps, and only what the actuator cannot give is limited.
    Law,
    /// As the block computes it from the words it has, up to its narrowing: counts are taken modulo, nothing is
    /// limited.
    Words,
}

/// A block's equation.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Equation {
    /// Each output is the input beside it.
    Copy,
    /// `position - reference`, modulo this.
    Displacement(f64),
    /// `contact`, `penetration` of `delta`.
    Unilateral,
    /// `a b`.
    Product,
    /// The difference of positions, modulo this, times `scale`.
    Velocity { modulus: f64, rescaled: bool },
    /// `spring + damping` in contact.
    Sum,
    /// Limited to this size.
    Limit(f64),
    /// Sine and cosine of a count of so many radians.
    Sine(f64),
    /// The tip of a PHANToM with links of these lengths.
    Tip([f64; 2]),
    /// The forces of a room, limited to this size.
    Room(f64),
    /// The torques of a PHANToM.
    Torques([f64; 2]),
    /// Gain from a torque to a command, and the least and greatest command.
    Command { gain: f64, ends: [f64; 2] },
    /// All of a PHANToM's, from sines to commands: lengths, greatest force, gains, ends of a command.
    Engine { lengths: [f64; 2], limit: f64, gains: [f64; 3], ends: [f64; 2] },
}

/// A generic of a block as a number.
pub(super) fn generic(block: &dyn AnyBlock, name: &str) -> f64 {
    let found = block.generics().into_iter().find(|(generic, _)| *generic == name);
    match found {
        Some((_, Generic::Integer(value))) => value as f64,
        Some((_, Generic::Boolean(value))) => f64::from(u8::from(value)),
        None => f64::NAN,
    }
}

impl Equation {
    /// That of a block; `None` where this module has none.
    pub fn of(block: &dyn AnyBlock) -> Option<Self> {
        let number = |name: &str| generic(block, name);
        let scaled = |name: &str, frac: &str| number(name) / number(frac).exp2();
        let lengths = || [scaled("LENGTH_1", "LENGTH_FRAC"), scaled("LENGTH_2", "LENGTH_FRAC")];
        let limit = || scaled("FORCE_LIMIT", "FORCE_FRAC");
        let ends = || {
            let half = (number("COMMAND_WIDTH") - 1.0).exp2();
            [-half, half - 1.0]
        };
        Some(match block.name() {
            "zero_order_hold" | "sample_register" | "command_register" => Self::Copy,
            "displacement" => Self::Displacement(number("WIDTH").exp2()),
            "unilateral" => Self::Unilateral,
            "truncating_multiplier" => Self::Product,
            "velocity_register" => {
                Self::Velocity { modulus: number("WIDTH").exp2(), rescaled: number("RESCALED") == 1.0 }
            }
            "torque_sum" => Self::Sum,
            "saturator" | "command_limiter" => Self::Limit(number("LIMIT")),
            "trig_table" => Self::Sine(2.0 * PI * number("TURN_NUM") / number("TURN_DEN")),
            "phantom_forward" => Self::Tip(lengths()),
            "cube_room" => Self::Room(limit()),
            "phantom_torque" => Self::Torques(lengths()),
            "command_scaler" => Self::Command { gain: scaled("GAIN", "GAIN_FRAC"), ends: ends() },
            "phantom_engine" => Self::Engine {
                lengths: lengths(),
                limit: limit(),
                gains: ["GAIN_1", "GAIN_2", "GAIN_3"].map(|gain| scaled(gain, "GAIN_FRAC")),
                ends: ends(),
            },
            _ => return None,
        })
    }

    /// Whether the block adds half a unit before it truncates.
    pub fn rounds_to_nearest(&self) -> bool {
        matches!(self, Self::Tip(_) | Self::Room(_) | Self::Torques(_) | Self::Command { .. } | Self::Engine { .. })
    }

    /// The outputs for these inputs. `memory` is what a register remembers; `out` comes with the outputs as words, for
    /// what is made of them again.
    pub fn eval(&self, side: Side, input: &[f64], memory: &mut f64, out: &mut [f64]) {
        let whole = side == Side::Law;
        let shortest = |difference: f64, modulus: f64| {
            let half = modulus / 2.0;
            if whole { difference } else { (difference + half).rem_euclid(modulus) - half }
        };
        let limited = |value: f64, low: f64, high: f64| if whole { value.clamp(low, high) } else { value };
        match *self {
            Self::Copy => out.copy_from_slice(input),
            Self::Displacement(modulus) => out[0] = shortest(input[0] - input[1], modulus),
            Self::Unilateral => out.copy_from_slice(&[f64::from(u8::from(input[0] >= 0.0)), input[0].max(0.0)]),
            Self::Product => out[0] = input[0] * input[1],
            Self::Velocity { modulus, rescaled } => {
                let moved = shortest(input[0] - *memory, modulus);
                *memory = input[0];
                out[0] = if rescaled { moved * input[1] } else { moved };
            }
            Self::Sum => out[0] = if input[2] == 1.0 { input[0] + input[1] } else { 0.0 },
            Self::Limit(limit) => out[0] = limited(input[0], -limit, limit),
            Self::Sine(rad) => {
                out.copy_from_slice(&[libm::sin(input[0] * rad), libm::cos(input[0] * rad)]);
            }
            Self::Tip(lengths) => {
                let radius = (!whole).then_some(out[3]);
                out.copy_from_slice(&tip(lengths, input, radius));
            }
            Self::Room(limit) => room(input, |force| limited(force, -limit, limit), out),
            Self::Torques(lengths) => out.copy_from_slice(&torques(lengths, input)),
            Self::Command { gain, ends: [low, high] } => {
                let valid = input[1..4].iter().all(|&valid| valid == 1.0);
                out[0] = if valid { limited(input[0] * gain, low, high) } else { 0.0 };
            }
            Self::Engine { lengths, limit, gains, ends: [low, high] } => {
                let words: [f64; 14] = std::array::from_fn(|index| out[index]);
                let made = |out: &[f64], index: usize| if whole { out[index] } else { words[index] };
                let radius = (!whole).then_some(words[3]);
                out[..4].copy_from_slice(&tip(lengths, &input[..6], radius));
                let at: Vec<f64> = (0..3).map(|axis| made(out, axis)).chain(input[9..17].iter().copied()).collect();
                room(&at, |force| limited(force, -limit, limit), &mut out[4..8]);
                let pushed = [0, 2, 4, 5, 6].map(|index| made(out, index));
                let pushed: Vec<f64> = input[..6].iter().copied().chain(pushed).collect();
                out[8..11].copy_from_slice(&torques(lengths, &pushed));
                let valid = input[6..9].iter().all(|&valid| valid == 1.0);
                for joint in 0..3 {
                    let command = made(out, 8 + joint) * gains[joint];
                    out[11 + joint] = if valid { limited(command, low, high) } else { 0.0 };
                }
            }
        }
    }
}

/// `x`, `y`, `z`, `radius` of the sines and cosines; `x` and `z` are made of the radius as a word where there is one.
fn tip([upper, fore]: [f64; 2], sines: &[f64], word: Option<f64>) -> [f64; 4] {
    let exact = upper * sines[3] + fore * sines[4];
    let radius = word.unwrap_or(exact);
    [sines[0] * radius, fore + upper * sines[2] - fore * sines[5], sines[1] * radius - upper, exact]
}

/// Three forces and the contacts of `x`, `y`, `z`, the walls, `room`, `stiffness`.
fn room(input: &[f64], limited: impl Fn(f64) -> f64, out: &mut [f64]) {
    let (walls, stiffness) = (input[9] as i64, input[10]);
    let mut contact = 0.0;
    for axis in 0..3 {
        let (at, low, high) = (input[axis], input[3 + 2 * axis], input[4 + 2 * axis]);
        let beyond = if at > high { at - high } else { (at - low).min(0.0) };
        let depth = if walls >> axis & 1 == 1 { beyond } else { 0.0 };
        contact += if depth == 0.0 { 0.0 } else { f64::from(1 << axis) };
        out[axis] = limited(-stiffness * depth);
    }
    out[3] = contact;
}

/// Three torques of the sines and cosines, `x`, `z` and the forces.
fn torques([upper, fore]: [f64; 2], input: &[f64]) -> [f64; 3] {
    let [sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, fx, fy, fz] = std::array::from_fn(|index| input[index]);
    let radial = sine1 * fx + cosine1 * fz;
    [(z + upper) * fx - x * fz, upper * (cosine2 * fy - sine2 * radial), fore * (sine3 * fy + cosine3 * radial)]
}
