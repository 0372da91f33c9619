//! The scenes of a plant as a transfer function that come with the program.

use crate::head::shipped::{Begin, Shipped, scenes};

pub(crate) const SCENES: &[Shipped] = scenes!["brake", "delayed-integrator"];

pub(crate) const BEGIN: Begin = Begin {
    device: "A plant as a transfer function",
    keys: &[
        ("device.kind", "transfer"),
        ("device.numerator", "[1000]"),
        ("device.denominator", "[1, 100]"),
        ("adc.range", "16"),
        ("adc.rate", "1 kHz"),
        ("dac.full_scale", "16"),
        ("method.numerator", "[0.1, -0.08]"),
        ("method.denominator", "[1, -1]"),
        ("method.fraction", "8"),
        ("reference.value", "5"),
        ("run.duration", "1 s"),
        ("expect.outcome", "settled"),
    ],
};
