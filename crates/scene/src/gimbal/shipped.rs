//! The scenes of a segment on a gimbal that come with the program.

use crate::head::shipped::{Begin, Shipped, scenes};

pub(crate) const SCENES: &[Shipped] = scenes![
    "gimbal-shape",
    "gimbal-profile",
    "gimbal-shear",
    "gimbal-texture",
    "gimbal-spring",
    "gimbal-switch",
    "gimbal-switch-held",
];

pub(crate) const BEGIN: Begin = Begin {
    device: "A segment on a gimbal, raised by a crank",
    keys: &[
        ("device.kind", "gimbal"),
        ("target.kind", "path"),
        ("target.path", "[[0, \"22 mm\", 0, 0]]"),
        ("surface.stiffness", "1 N/mm"),
        ("finger.path", "[[\"0 s\", \"24 mm\"], [\"0.5 s\", \"24 mm\"], [\"1.5 s\", \"16 mm\"]]"),
        ("run.duration", "4 s"),
        ("expect.outcome", "settled"),
    ],
};
