//! The scene to begin with of a motor with three phases.

use crate::head::shipped::Begin;

/// A phase's current that the loop starts.
macro_rules! current {
    ($winding:literal) => {
        concat!(
            "{ kind = \"current\", winding = \"",
            $winding,
            "\", trigger = true, latency = \"1 us\", bits = 12, gain = \"100 mV/A\", range = \"3.3 V\" }"
        )
    };
}

pub(crate) const BEGIN: Begin = Begin {
    device: "A motor with three phases, behind field-oriented control",
    keys: &[
        ("device.kind", "pmsm"),
        ("device.pole_pairs", "7"),
        ("device.resistance", "0.5 Ohm"),
        ("device.inductance", "0.3 mH"),
        ("device.torque_constant", "50 mN.m/A"),
        ("device.rotor_inertia", "300 g.cm2"),
        ("device.viscous_friction", "20 uN.m.s/rad"),
        ("device.coulomb_friction", "2 mN.m"),
        ("device.sensors.ia", current!("a")),
        ("device.sensors.ib", current!("b")),
        ("encoder.lines", "4096"),
        ("bridge.supply", "12 V"),
        ("method.kind", "foc"),
        ("method.sample_rate", "10 kHz"),
        ("wall.position", "0.3 rad"),
        ("wall.stiffness", "0.5 N.m/rad"),
        ("wall.damping", "2 mN.m.s/rad"),
        ("hand.kind", "spring_damper"),
        ("hand.stiffness", "0.3 N.m/rad"),
        ("hand.damping", "2 mN.m.s/rad"),
        ("hand.path", "[[\"0 s\", 0], [\"150 ms\", 0.25], [\"250 ms\", 0.6]]"),
        ("run.duration", "600 ms"),
        ("expect.outcome", "settled"),
    ],
};
