//! The scenes of a PHANToM that come with the program.

use crate::head::shipped::{Begin, Shipped, scenes};

pub(crate) const SCENES: &[Shipped] = scenes![
    "phantom-drop",
    "phantom-drop-rtos",
    "phantom-thrown",
    "phantom-thrown-shared",
    "phantom-thrown-rtos",
    "phantom-late",
    "phantom-flexible",
];

pub(crate) const BEGIN: Begin = Begin {
    device: "The arm of a PHANToM",
    keys: &[
        ("device.kind", "phantom"),
        ("drop.axis", "y"),
        ("platform.kind", "FPGA-400"),
        ("room.distance", "2 cm"),
        ("room.stiffness", "1 kN/m"),
        ("model.amplifier_lag", "0.4 ms"),
        ("model.transmission_stiffness", "3.5 kN/m"),
        ("run.duration", "4 s"),
        ("expect.outcome", "passive"),
    ],
};
