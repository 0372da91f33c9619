//! The keys of the methods of an axis.

use hpu_datapath::command_limiter::MOST_SETTLING;

use crate::method::{LAWS, LOOPS, METHODS, SCALED};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{NotNegative, Positive};
use crate::schema::{Choice, Flag, GainFormat, Group, Key, Own, Quantity, Whole, keys, named, scene};

keys! { method: "method" of METHODS;
    /// The control law: position read at once and damping sampled (hybrid), both sampled (conventional), or a published
    /// law.
    kind: Choice<&'static str> = Choice::new(|| named(METHODS, |it| it), Required);
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

keys! { method_scale: "method" of SCALED;
    /// Format of the scale of a rescaled velocity, or of `beta`.
    scale_format: GainFormat = GainFormat(8, 8);
}

keys! { method_shaper: "method.shaper" of [];
    /// Cutoff of the shaper's high-pass filter.
    cutoff: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
}

keys! { method_velocity_filter: "method.velocity_filter" of [];
    /// Corner frequency of the filter of the velocity.
    corner: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
    /// Order of the filter: a first-order low pass, whose weight is the nearest word of 16 bits, or a second-order
    /// Butterworth low pass with coefficients of 30 fraction bits.
    order: Whole<u32> = Whole::new(1, 2, Is(1));
}

scene! { pwm: "method.pwm" of [];
    /// The pulse-width modulator.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct Pwm {
        /// Width of the duty; the PWM's frequency is `clock.frequency` / 2^bits.
        bits: u32 = bits: Whole<u32> = Whole::bits(2, 24, 12);
        /// Drives one leg by sign and magnitude, or both in opposite phase.
        antiphase: bool = mode: Choice<bool> =
            Choice::new(|| vec![("sign_magnitude", false), ("locked_antiphase", true)], Is(false));
        /// When a new duty takes effect: at the next period, or at once.
        latched: bool = duty: Choice<bool> = Choice::new(|| vec![("latched", true), ("immediate", false)], Is(true));
        /// State of the bridge in the off phase: it shorts the motor, or opens all switches.
        floating: bool = off: Choice<bool> = Choice::new(|| vec![("brake", false), ("float", true)], Is(false));
        /// Time for which both switches of a leg stay open around a change; at most half a PWM period.
        dead_time_s: f64 = dead_time: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    }
}
