//! The list of all groups of keys.

use std::sync::LazyLock;

use super::devices::{KEYS, device};
use crate::dut::rows::*;
use crate::faults::rows::faults;
use crate::foc::rows::{method_foc, model_foc, top_wall_foc, wall_foc};
use crate::method::{FOLLOWS, WALLED};
use crate::paddle::rows::{method_paddle, model_paddle};
use crate::pmsm::rows::pmsm;
use crate::schema::{DeviceKeys, Group, KeyRow, Schema};

/// A part of the list.
enum Part {
    /// The same groups for all devices.
    Fixed(&'static [&'static Group]),
    /// Groups of each device beside an axis.
    Each(fn(&'static DeviceKeys) -> &'static [&'static Group]),
}
use Part::{Each, Fixed};

/// The groups: the scene's own keys first, then the sections in the order in which the documentation shows them.
static PARTS: &[Part] = &[
    Fixed(&[&top::GROUP, &top_axis::GROUP, &top_host::GROUP]),
    Each(|keys| keys.first),
    Fixed(&[
        &top_clock::GROUP,
        &top_method::GROUP,
        &top_dut::GROUP,
        &top_wall::GROUP,
        &top_target::GROUP,
        &top_wall_dut::GROUP,
        &top_wall_foc::GROUP,
        &top_hand::GROUP,
    ]),
    Each(|keys| keys.top),
    Fixed(&[
        &top_run::GROUP,
        &device::GROUP,
        &motor::GROUP,
        &mass::GROUP,
        &network::GROUP,
        &pmsm::GROUP,
        &bodies::GROUP,
        &body::GROUP,
        &gravity::GROUP,
        &stops::GROUP,
        &joints::GROUP,
        &joint::GROUP,
        &drive::GROUP,
        &dac::GROUP,
        &sensors::GROUP,
        &sensor::GROUP,
    ]),
    Each(|keys| keys.device),
    Fixed(&[
        &encoder_part::GROUP,
        &encoder_motor::GROUP,
        &encoder_mass::GROUP,
        &encoder_network::GROUP,
        &host::GROUP,
        &bridge::GROUP,
        &amplifier::GROUP,
        &amplifier_shaper::GROUP,
    ]),
    Each(|keys| keys.parts),
    Fixed(&[&clock::GROUP, &method::GROUP, &method_network::GROUP, &method_law::GROUP, &method_loop::GROUP]),
    Fixed(crate::method::KEYS),
    Fixed(&[&method_paddle::GROUP, &method_foc::GROUP]),
    Fixed(&[&method_scale::GROUP]),
    Each(|keys| keys.method),
    Fixed(&[
        &method_shaper::GROUP,
        &method_velocity_filter::GROUP,
        &pwm::GROUP,
        &dut::GROUP,
        &dut_clocks::GROUP,
        &dut_reset::GROUP,
        &dut_generics::GROUP,
        &dut_parameters::GROUP,
        &dut_formats::GROUP,
        &dut_pins::GROUP,
        &dut_ports::GROUP,
        &dut_port::GROUP,
        &wall::GROUP,
        &wall_axis::GROUP,
        &wall_foc::GROUP,
        &wall_dut::GROUP,
        &wall_ramp::GROUP,
        &target::GROUP,
        &hand::GROUP,
        &hand_torque::GROUP,
        &hand_grip::GROUP,
        &hand_motion::GROUP,
        &hand_capture::GROUP,
        &hand_network::GROUP,
        &hand_file::GROUP,
        &hand_file_motion::GROUP,
        &faults::GROUP,
    ]),
    Each(|keys| keys.motion),
    Each(|keys| keys.walls),
    Fixed(&[
        &model::GROUP,
        &model_bridge::GROUP,
        &model_motor::GROUP,
        &model_joints::GROUP,
        &model_network::GROUP,
        &model_friction::GROUP,
        &model_law::GROUP,
    ]),
    Fixed(&[&model_paddle::GROUP, &model_foc::GROUP]),
    Each(|keys| keys.model),
    Fixed(&[&run::GROUP, &record::GROUP]),
    Each(|keys| keys.record),
    Fixed(&[&record_all::GROUP, &expect::GROUP]),
    Each(|keys| keys.expect),
    Fixed(&[&metric::GROUP, &expect_recording::GROUP, &accuracy::GROUP]),
    Each(|keys| keys.accuracy),
    Fixed(&[&accuracy_all::GROUP]),
];

/// Returns every key of every section.
pub(crate) fn schema() -> &'static Schema {
    static SCHEMA: LazyLock<Schema> = LazyLock::new(|| {
        let of = |part: &'static Part| -> Vec<&'static Group> {
            match part {
                Fixed(groups) => groups.to_vec(),
                Each(of) => KEYS.iter().flat_map(|(_, keys)| of(keys)).copied().collect(),
            }
        };
        Schema::new(PARTS.iter().flat_map(of).collect())
    });
    &SCHEMA
}

/// Returns every key of every section.
pub fn rows() -> impl Iterator<Item = KeyRow> {
    schema().rows()
}

/// Returns every key in Markdown, with a table for the keys of a section that the same kinds take.
pub fn markdown() -> String {
    crate::schema::markdown(rows())
}

/// Returns whether the `kind` of a section decides which keys it takes.
pub fn has_own_kind(section: &str, scene: &str) -> bool {
    match KEYS.iter().find(|(kind, _)| *kind == scene) {
        Some((_, keys)) => keys.own_kinds.contains(&section),
        None => matches!(section, "method" | "hand"),
    }
}

/// Returns the kinds of a section in a scene of this kind with this device, by which rows are chosen; `own` is the
/// section's `kind`, of the scene itself that of its method.
pub fn kinds_of<'a>(section: &str, scene: &'a str, device: &'a str, own: Option<&'a str>) -> Vec<&'a str> {
    match section {
        "device" | "encoder" | "host" => vec![device],
        "hand" | "method" if has_own_kind(section, scene) => own.into_iter().chain([device]).collect(),
        _ if has_own_kind(section, scene) => own.into_iter().collect(),
        "" if scene == "axis" => {
            let method = own.filter(|own| FOLLOWS.contains(own)).unwrap_or(WALLED[0]);
            vec![scene, device, method]
        }
        "model" if scene == "axis" => vec![scene, device],
        "" if scene == "dut" => vec![scene, device],
        _ => vec![scene],
    }
}
