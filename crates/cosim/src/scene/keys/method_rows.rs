//! The keys of the methods of an axis.

use hpu_datapath::Estimator;
use hpu_datapath::command_limiter::MOST_SETTLING;

use super::Otherwise::{Is, Required, Said};
use super::{Choice, Flag, GainFormat, Group, Key, Own, Quantity, Whole, keys, named};
use crate::law::Observer;
use crate::scene::quantity as q;
use crate::scene::quantity::Sense::{NotNegative, Positive, Within};

/// The methods of an axis: the two loops, and the laws.
const METHODS: [&str; 7] = [
    "hybrid",
    "conventional",
    "sampled_wall",
    "virtual_coupling",
    "passivity_controller",
    "energy_bounding",
    "passive_spring",
];
const LOOPS: &[&str] = METHODS.split_at(2).0;
const LAWS: &[&str] = METHODS.split_at(2).1;

/// The width of the energy that a law keeps.
const ENERGY: Whole<u32> = Whole::bits(8, 48, 32);

keys! { method: "method" of METHODS;
    /// The control law: position read at once and damping sampled (hybrid), both sampled (conventional), or a published
    /// law.
    kind: Choice<&'static str> = Choice::new(|| named(&METHODS, |it| it), Required);
    /// Rate at which the law samples, rounded to whole clock cycles.
    sample_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
    /// Width of the position counter.
    position_bits: Whole<u32> = Whole::bits(2, 32, 12);
    /// Format of the stiffness gain, in PWM counts per position count.
    stiffness_format: GainFormat = GainFormat(12, 0);
    /// Format of the damping gain, in PWM counts per velocity count.
    damping_format: GainFormat = GainFormat(12, 0);
    /// Width of the sample period in clock cycles.
    period_bits: Whole<u32> = Whole::bits(2, 30, 24);
    /// The pulse-width modulator.
    pwm: Own = Own::section(Said("its keys' defaults"));
}

keys! { method_law: "method" of LAWS;
    /// Digital input shaper behind the law.
    shaper: Own = Own::section(Said("none"));
}

keys! { method_loop: "method" of LOOPS;
    /// Width of the velocity; the velocity of a law is as wide as its position.
    velocity_bits: Whole<u32> = Whole::bits(2, 32, 12);
    /// Treatment of a product that does not fit: it saturates, or its upper bits are dropped.
    product: Choice<bool> = Choice::new(|| vec![("saturate", true), ("drop_upper", false)], Is(true));
    /// Clock cycles by which the command is held back, because the logic of the torque takes longer than one.
    settling: Whole<u32> = Whole::new(0, MOST_SETTLING as u64, Is(0));
    /// Scales the velocity from counts a sample to counts a reference period.
    rescaled: Flag = Flag(false);
    /// Rate whose period the velocity is scaled to; required by `rescaled`.
    reference_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("none"));
}

keys! { method_scale: "method" of ["hybrid", "conventional", "passive_spring"];
    /// Format of the scale of a rescaled velocity, or of `beta`.
    scale_format: GainFormat = GainFormat(8, 8);
}

keys! { sampled_wall: "method" of ["sampled_wall"];
    /// Whether the spring reads the sampled position or the position at once.
    spring: Choice<bool> = Choice::new(|| vec![("held", false), ("live", true)], Is(false));
    /// How the velocity is estimated: difference of two samples, low-pass filter, difference over a window, first-order
    /// adaptive window, or time between encoder edges.
    estimator: Choice<Estimator> = Choice::new(|| vec![
        ("difference", Estimator::Difference),
        ("filtered", Estimator::Filtered),
        ("window", Estimator::Window),
        ("foaw", Estimator::Foaw),
        ("edge_timer", Estimator::EdgeTimer),
    ], Is(Estimator::Difference));
    /// Samples of the spring for one sample of the velocity.
    velocity_every: Whole<u32> = Whole::new(1, 1 << 20, Is(1));
    /// Weight of a new sample in the filter of `filtered`: 2^-`filter_shift`.
    filter_shift: Whole<u32> = Whole::new(0, 16, Is(3));
    /// Samples in the window of `window`, or at most in that of `foaw`.
    window: Whole<u32> = Whole::new(1, 64, Is(8));
    /// Noise of the position that `foaw` assumes, in counts.
    noise: Whole<u32> = Whole::new(0, 15, Is(1));
    /// Fraction bits of the velocity.
    velocity_frac: Whole<u32> = Whole::new(0, 16, Is(8));
    /// Negative damping, inside the wall and outside.
    negative_damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

keys! { virtual_coupling: "method" of ["virtual_coupling"];
    /// Stiffness of the coupling between device and virtual tool.
    coupling_stiffness: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Required);
    /// Damping of the coupling.
    coupling_damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Makes the wall rigid, whatever its stiffness.
    rigid: Flag = Flag(false);
}

keys! { passivity_controller: "method" of ["passivity_controller"];
    /// Force that the passivity observer multiplies a motion by: the velocity's, or the force that was held.
    observer: Choice<Observer> = Choice::new(
        || vec![("velocity", Observer::Velocity), ("held_force", Observer::HeldForce)], Is(Observer::Velocity));
    /// Greatest energy that the observer may store.
    credit: Quantity = Quantity::new(&q::ENERGY, Positive, Said("unbounded"));
    /// Width of the observed energy.
    energy_bits: Whole<u32> = ENERGY;
}

keys! { energy_bounding: "method" of ["energy_bounding"];
    /// Published form of the bound: by the constants c1 and c2, or by the force.
    form: Choice<bool> = Choice::new(|| vec![("c1_c2", false), ("force_bound", true)], Is(false));
    /// First constant of the bound; of a force bound b/T.
    c1: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Required);
    /// Second constant of the bound, at most c1; a force bound has none.
    c2: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Said("c1"));
    /// Format of the constants, in PWM counts per count.
    bound_format: GainFormat = GainFormat(10, 4);
    /// Width of the energy.
    energy_bits: Whole<u32> = ENERGY;
}

keys! { passive_spring: "method" of ["passive_spring"];
    /// Motion of the virtual spring for one of the device.
    alpha: Quantity = Quantity::new(&q::RATIO, Within(1e-9, 1e9), Is(1.0));
    /// Force shown for one of the virtual spring, in `scale_format`.
    beta: Quantity = Quantity::new(&q::RATIO, Within(1e-9, 1e9), Is(1.0));
    /// Engages the spring again inside the wall after it has died.
    revive: Flag = Flag(true);
    /// Fraction bits of the extension.
    extension_frac: Whole<u32> = Whole::new(8, 16, Is(8));
}

keys! { method_shaper: "method.shaper" of [];
    /// Cutoff of the shaper's high-pass filter.
    cutoff: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
}

keys! { pwm: "method.pwm" of [];
    /// Width of the duty; the PWM's frequency is `clock.frequency` / 2^bits.
    bits: Whole<u32> = Whole::bits(2, 24, 12);
    /// Drives one leg by sign and magnitude, or both in opposite phase.
    mode: Choice<bool> = Choice::new(|| vec![("sign_magnitude", false), ("locked_antiphase", true)], Is(false));
    /// When a new duty takes effect: at the next period, or at once.
    duty: Choice<bool> = Choice::new(|| vec![("latched", true), ("immediate", false)], Is(true));
    /// State of the bridge in the off phase: it shorts the motor, or opens all switches.
    off: Choice<bool> = Choice::new(|| vec![("brake", false), ("float", true)], Is(false));
    /// Time for which both switches of a leg stay open around a change; at most half a PWM period.
    dead_time: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}
