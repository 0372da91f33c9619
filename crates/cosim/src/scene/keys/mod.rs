//! Every key of a scene, as data: one row a key. Readers read by the row; accept lists, `hpu keys`, the JSON Schema and
//! the table of the documentation are functions of the rows.
//!
//! A row is one entry of a `keys!` table, and no other place names the key's default, range or options. A new key is a
//! row, a field of the scene and the line that reads the row into the field.

mod axis_rows;
mod choice;
mod dut_rows;
mod every_rows;
mod faults_rows;
mod markdown;
mod method_rows;
mod phantom_rows;
mod told;
mod value;

use super::parameter::ParameterValue;
use super::section::Section;
use super::source::SceneError;

pub use markdown::{grouped, markdown};
pub use value::{Otherwise, Shape, Sizes, Takes};

pub(in crate::scene) use choice::{Choice, Flag, GainFormat, Own, Text, named, none_of, quoted};
pub(in crate::scene) use value::{Expected, Quantity, Read, Whole};
pub(in crate::scene) use {axis_rows::*, dut_rows::*, every_rows::*, faults_rows::*, method_rows::*, phantom_rows::*};

/// A key of a scene, as the documentation, the schema and `hpu keys` show it.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// The section; empty for the scene itself. A word in capitals stands for any name, as in `dut.ports.PORT`.
    pub section: &'static str,
    /// The kinds that take the key: of `[method]` and `[hand]` values of their own `kind`, else a kind of device
    /// (`motor`, `mass`, `phantom`) or of scene: `axis` with one of hpu's methods, `dut` with a design of the user's
    /// own, `phantom`. Empty if all kinds take it.
    pub kinds: &'static [&'static str],
    /// The key. A word in capitals stands for any name.
    pub key: &'static str,
    /// The values that it accepts.
    pub takes: Takes,
    /// The value of a scene without the key.
    pub otherwise: Otherwise<ParameterValue>,
    /// The effect of the value.
    pub meaning: &'static str,
}

/// A key: its name, its meaning and its type.
pub(in crate::scene) struct Key<V> {
    pub name: &'static str,
    /// The key without which this key has no effect.
    pub beside: Option<&'static str>,
    pub meaning: &'static str,
    pub value: V,
}

/// A key of any type, so that keys of different types can stand in one list. Every `Key` implements it.
pub(in crate::scene) trait AnyKey: Sync {
    fn name(&self) -> &'static str;
    fn beside(&self) -> Option<&'static str>;
    fn is_section(&self) -> bool;
    /// Whether a scene must have the key.
    fn is_required(&self) -> bool;
    /// Reads the key only to find whether it is refused.
    fn check(&self, s: &Section) -> Result<(), SceneError>;
    fn row(&self, group: &Group) -> Row;
}

impl<V: Read> AnyKey for Key<V> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn beside(&self) -> Option<&'static str> {
        self.beside
    }

    fn is_section(&self) -> bool {
        self.value.takes() == Takes::Section
    }

    fn is_required(&self) -> bool {
        self.value.otherwise() == Otherwise::Required
    }

    fn check(&self, s: &Section) -> Result<(), SceneError> {
        s.read(self).map(drop)
    }

    fn row(&self, group: &Group) -> Row {
        let (takes, otherwise) = (self.value.takes(), self.value.otherwise());
        Row {
            section: group.section,
            kinds: group.kinds,
            key: self.name,
            takes,
            otherwise,
            meaning: self.meaning.trim(),
        }
    }
}

/// The keys of a section that the same kinds take.
pub(in crate::scene) struct Group {
    pub section: &'static str,
    pub kinds: &'static [&'static str],
    pub keys: &'static [&'static dyn AnyKey],
}

/// A group of keys, each a static in a module of the group's name:
///
/// ```text
/// keys! { bridge: "bridge" of [];
///     /// Supply voltage.
///     supply: Quantity = Quantity::new(&q::VOLTAGE, Positive, Is(24.0));
/// }
/// ```
///
/// makes `bridge::supply`, whose meaning is its comment, and `bridge::GROUP`. `beside` names a key without which this
/// key has no effect.
macro_rules! keys {
    ($group:ident: $section:literal of $kinds:expr;
     $($(#[doc = $meaning:literal])+ $key:ident $(beside $of:ident)?: $value:ty = $given:expr;)*) => {
        #[allow(non_upper_case_globals, reason = "the static is named like its key, so that the name stands once")]
        pub(in crate::scene) mod $group {
            #[allow(unused_imports, reason = "not every group has every type of key")]
            use super::*;
            $($(#[doc = $meaning])+ pub(in crate::scene) static $key: Key<$value> = Key {
                name: stringify!($key),
                beside: crate::scene::keys::beside(&[$(stringify!($of))?]),
                meaning: concat!($($meaning),+),
                value: $given,
            };)*
            pub(in crate::scene) static GROUP: Group =
                Group { section: $section, kinds: &$kinds, keys: &[$(&$key),*] };
        }
    };
}
pub(in crate::scene) use keys;

const fn beside(of: &[&'static str]) -> Option<&'static str> {
    if of.is_empty() { None } else { Some(of[0]) }
}

/// All groups: the scene's own keys first, then the sections in the order in which the documentation shows them.
static GROUPS: &[&Group] = &[
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
    &sampled_wall::GROUP,
    &virtual_coupling::GROUP,
    &passivity_controller::GROUP,
    &energy_bounding::GROUP,
    &passive_spring::GROUP,
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
    &expect_phantom::GROUP,
    &metric::GROUP,
    &accuracy::GROUP,
    &accuracy_phantom::GROUP,
    &accuracy_all::GROUP,
];

/// Returns whether the key of a row is a placeholder for any name.
#[must_use]
pub fn is_any_name(key: &str) -> bool {
    key.chars().all(char::is_uppercase)
}

/// Returns every key of every section.
pub fn rows() -> impl Iterator<Item = Row> {
    GROUPS.iter().flat_map(|group| group.keys.iter().map(|key| key.row(group)))
}

/// Returns the kinds of a section in a scene of this kind with this device, by which rows are chosen; `own` is the
/// section's `kind`.
pub fn kinds_of<'a>(section: &str, scene: &'a str, device: &'a str, own: Option<&'a str>) -> Vec<&'a str> {
    match section {
        "device" | "encoder" => vec![device],
        _ if has_own_kind(section, scene) => own.into_iter().collect(),
        "model" if scene == "axis" => vec![scene, device],
        _ => vec![scene],
    }
}

/// Returns whether the `kind` of a section decides which keys it takes.
pub fn has_own_kind(section: &str, scene: &str) -> bool {
    scene != "phantom" && matches!(section, "method" | "hand")
}

/// Returns the key `kind` of a section.
pub(in crate::scene) fn kind_of(section: &str) -> Option<&'static dyn AnyKey> {
    let mut keys = GROUPS.iter().filter(|group| group.section == section).flat_map(|group| group.keys.iter().copied());
    keys.find(|key| key.name() == "kind")
}

/// Returns the groups of keys that a section of one of these kinds takes.
fn groups<'a>(section: &'a str, kinds: &'a [&'a str]) -> impl Iterator<Item = &'static Group> + 'a {
    let takes = move |group: &&'static Group| {
        group.section == section && (group.kinds.is_empty() || group.kinds.iter().any(|kind| kinds.contains(kind)))
    };
    GROUPS.iter().copied().filter(takes)
}

/// Returns the keys that a section of one of these kinds takes.
pub(in crate::scene) fn accepted<'a>(
    section: &'a str,
    kinds: &'a [&'a str],
) -> impl Iterator<Item = &'static dyn AnyKey> + 'a {
    groups(section, kinds).flat_map(|group| group.keys.iter().copied())
}

/// Returns these keys with their rows.
pub(in crate::scene) fn taken<'a>(
    section: &'a str,
    kinds: &'a [&'a str],
) -> impl Iterator<Item = (&'static dyn AnyKey, Row)> + 'a {
    groups(section, kinds).flat_map(|group| group.keys.iter().map(|key| (*key, key.row(group))))
}
