//! The keys of a scene of a plant as a transfer function.

use crate::head::accuracy::OfOutputs;
use crate::head::model::Solver;
use crate::head::outcome::OutcomeKind;
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive};
use crate::schema::{Choice, DeviceKeys, Expected, Flag, Group, Key, Own, Quantity, Shape, Takes, Whole, keys, named};
use crate::transfer::OUTPUTS;

/// The form of a list of numbers.
pub(crate) const NUMBERS: &str = "a list of numbers, as in [1, -0.5]";
/// The form of a list of roots.
pub(crate) const ROOTS: &str = "a list of roots: numbers, or [re, im] with im above 0 for a pair, as in [-1, [-2, 3]]";
/// The form of a matrix.
pub(crate) const ROWS: &str = "a list of rows, as in [[0, 1], [-2, -3]]";

keys! { top_transfer: "" of ["transfer"];
    /// The converter from the plant's output to words.
    adc: Own = Own::section(Required);
    /// The converter from words to the plant's input.
    dac: Own = Own::section(Required);
    /// The controller: a difference equation in words.
    method: Own = Own::section(Required);
    /// The wanted output.
    reference: Own = Own::section(Said("0"));
}

keys! { transfer: "device" of ["transfer"];
    /// Numerator of the transfer function: coefficients in descending powers of s, or of z with `sample_time`.
    numerator: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("by roots or matrices"));
    /// Denominator, in the same way; its degree is the number of states, at most 12.
    denominator: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("by roots or matrices"));
    /// Zeros, in the place of coefficients; those of s are in 1/s.
    zeros: Own = Own::new(|| Takes::Own(Shape::List, ROOTS), Said("none"));
    /// Poles, in the place of coefficients.
    poles: Own = Own::new(|| Takes::Own(Shape::List, ROOTS), Said("by coefficients or matrices"));
    /// Factor before the products of zeros and poles.
    gain: Quantity = Quantity::new(&q::RATIO, Any, Is(1.0));
    /// Matrix A of `x' = A x + B u` (or of the next sample's x), in the place of coefficients.
    a: Own = Own::new(|| Takes::Own(Shape::List, ROWS), Said("by coefficients or roots"));
    /// Vector B.
    b: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("by coefficients or roots"));
    /// Vector C of `y = C x + D u`.
    c: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("by coefficients or roots"));
    /// Number D.
    d: Quantity = Quantity::new(&q::RATIO, Any, Is(0.0));
    /// Sample time of a discrete plant, which changes at its samples alone; it is that of the ADC.
    sample_time: Quantity = Quantity::new(&q::TIME, Positive, Said("a continuous plant"));
    /// States at the start: of matrices, or of the companion form, in which each state is the change of the one before.
    initial: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("0"));
    /// Constant that is added to the plant's input.
    disturbance: Quantity = Quantity::new(&q::RATIO, Any, Is(0.0));
}

keys! { adc: "adc" of [];
    /// Bits of a word.
    bits: Whole<u32> = Whole::bits(2, 32, 12);
    /// Output of a full word: words reach from minus this to this, or from 0 if they have no sign.
    range: Quantity = Quantity::new(&q::RATIO, Positive, Required);
    /// Words have a sign.
    signed: Flag = Flag(true);
    /// Output that gives the word 0.
    offset: Quantity = Quantity::new(&q::RATIO, Any, Is(0.0));
    /// Rounding: to the nearest word with ties up, or down. Words saturate.
    rounding: Choice<bool> = Choice::new(|| vec![("nearest", false), ("floor", true)], Is(false));
    /// Rate of the samples, a whole number of clock cycles apart. The first comes one cycle after the start.
    rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
}

keys! { dac: "dac" of [];
    /// Bits of a word.
    bits: Whole<u32> = Whole::bits(2, 32, 12);
    /// Input of a full word: words reach from minus this to this, or from 0 if they have no sign.
    full_scale: Quantity = Quantity::new(&q::RATIO, Positive, Required);
    /// Words have a sign.
    signed: Flag = Flag(true);
    /// Samples by which a word reaches the plant late.
    late: Whole<u32> = Whole::new(0, 1, Is(0));
}

keys! { method_transfer: "method" of ["transfer"];
    /// Numerator of the controller from the error (reference less output) to the plant's input: coefficients of the
    /// newest error, the one before, and so on.
    numerator: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Required);
    /// Denominator: coefficients of the newest output, the one before, and so on. The sum of the products is divided by
    /// the first of them.
    denominator: Own = Own::new(|| Takes::Own(Shape::List, NUMBERS), Said("[1]"));
    /// Bits of the coefficients' words, with the sign.
    coefficient_bits: Whole<u32> = Whole::bits(2, 48, 32);
    /// Fraction bits of the coefficients' words.
    coefficient_fraction: Whole<u32> = Whole::bits(0, 40, 16);
    /// Bits that the controller's own output has below those of the DAC.
    fraction: Whole<u32> = Whole::bits(0, 30, 0);
    /// Rounding of that output: to the nearest word with ties up, or down. Words saturate.
    rounding: Choice<bool> = Choice::new(|| vec![("nearest", false), ("floor", true)], Is(false));
}

keys! { reference: "reference" of [];
    /// Wanted output; its word is that of the ADC without its offset.
    value: Quantity = Quantity::new(&q::RATIO, Any, Is(0.0));
    /// Time from which on it is wanted; 0 is wanted before.
    from: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}

keys! { model_transfer: "model" of ["transfer"];
    /// How the plant is advanced: exactly from sample to sample, or exactly at every clock cycle.
    solver: Choice<Solver> =
        Choice::new(|| named(&[Solver::Events, Solver::Clock], Solver::name), Is(Solver::Events));
}

keys! { record_transfer: "record" of ["transfer"];
    /// Rate at which the plant's output and input are recorded.
    plant_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(10e3));
}

keys! { expect_transfer: "expect" of ["transfer"];
    /// Verdict that the run must reach: the output settles within a step of the ADC, keeps a limit cycle, or diverges;
    /// or the run is too short to tell (`not_told`).
    outcome: Choice<OutcomeKind> = Choice::new(|| {
        use OutcomeKind::{Diverged, LimitCycle, NotTold, Settled};
        named(&[Settled, LimitCycle, Diverged, NotTold], OutcomeKind::name)
    }, Said("not judged"));
    /// Output at the end.
    final_angle: Expected = Expected::new(&q::RATIO, Any);
    /// Greatest recorded output.
    peak_angle: Expected = Expected::new(&q::RATIO, Any);
    /// Amplitude of the limit cycle.
    amplitude: Expected = Expected::new(&q::RATIO, NotNegative);
    /// Frequency of the limit cycle.
    frequency: Expected = Expected::new(&q::FREQUENCY, Any);
}

keys! { accuracy_transfer: "accuracy" of ["transfer"];
    /// Outputs that must agree.
    outputs: OfOutputs = OfOutputs(&OUTPUTS);
}

/// All of them.
pub(crate) const KEYS: DeviceKeys = DeviceKeys {
    first: &[],
    top: &[&top_transfer::GROUP],
    device: &[&transfer::GROUP],
    parts: &[&adc::GROUP, &dac::GROUP],
    method: &[&method_transfer::GROUP],
    motion: &[&reference::GROUP],
    walls: &[],
    model: &[&model_transfer::GROUP],
    record: &[&record_transfer::GROUP],
    expect: &[&expect_transfer::GROUP],
    accuracy: &[&accuracy_transfer::GROUP],
    own_kinds: &[],
};
