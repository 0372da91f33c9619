//! The list of all groups of keys.

use super::*;

/// The groups before those of the laws: the scene's own keys first, then the sections in the order in which the
/// documentation shows them.
static BEFORE_LAWS: &[&Group] = &[
    &top::GROUP,
    &top_axis::GROUP,
    &top_phantom::GROUP,
    &top_clock::GROUP,
    &top_method::GROUP,
    &top_dut::GROUP,
    &top_wall::GROUP,
    &top_room::GROUP,
    &top_run::GROUP,
    &device::GROUP,
    &motor::GROUP,
    &mass::GROUP,
    &phantom::GROUP,
    &encoder_motor::GROUP,
    &encoder_mass::GROUP,
    &bridge::GROUP,
    &amplifier::GROUP,
    &amplifier_shaper::GROUP,
    &drop::GROUP,
    &platform::GROUP,
    &clock::GROUP,
    &method::GROUP,
    &method_law::GROUP,
    &method_loop::GROUP,
];

static AFTER_LAWS: &[&Group] = &[
    &method_scale::GROUP,
    &method_phantom::GROUP,
    &method_shaper::GROUP,
    &pwm::GROUP,
    &dut::GROUP,
    &dut_clocks::GROUP,
    &dut_reset::GROUP,
    &dut_generics::GROUP,
    &dut_parameters::GROUP,
    &dut_ports::GROUP,
    &dut_port::GROUP,
    &wall::GROUP,
    &wall_axis::GROUP,
    &wall_dut::GROUP,
    &wall_ramp::GROUP,
    &hand::GROUP,
    &hand_torque::GROUP,
    &hand_grip::GROUP,
    &hand_motion::GROUP,
    &hand_capture::GROUP,
    &faults::GROUP,
    &room::GROUP,
    &model::GROUP,
    &model_motor::GROUP,
    &model_friction::GROUP,
    &model_law::GROUP,
    &model_phantom::GROUP,
    &run::GROUP,
    &record::GROUP,
    &record_phantom::GROUP,
    &record_all::GROUP,
    &expect::GROUP,
    &expect_drop::GROUP,
    &metric::GROUP,
    &accuracy::GROUP,
    &accuracy_phantom::GROUP,
    &accuracy_all::GROUP,
];

/// Returns all groups, in the order in which the documentation shows them.
pub(super) fn groups() -> impl Iterator<Item = &'static Group> {
    [BEFORE_LAWS, crate::method::KEYS, AFTER_LAWS].into_iter().flatten().copied()
}
