//! Every key of a scene, as data: one row a key. Readers read by the row; accept lists, `hpu keys`, the JSON Schema and
//! the table of the documentation are functions of the rows.
//!
//! A row is one entry of a `keys!` table, and no other place names the key's default, range or options. A new key is a
//! row, a field of the scene and the line that reads the row into the field.

pub(crate) mod choice;
pub(crate) mod device_keys;
pub(crate) mod identifier;
mod markdown;
pub(crate) mod parameter;
pub(crate) mod quantity;
mod reading;
pub(crate) mod section;
pub(crate) mod source;
mod told;
pub(crate) mod value;

use parameter::ParameterValue;
use section::Section;
use source::SceneError;

pub use markdown::grouped;
pub(crate) use markdown::markdown;
pub use quantity::Sizes;
pub use value::{Otherwise, Shape, Takes};

pub(crate) use choice::{Choice, Flag, GainFormat, Own, Text, named, none_of, quoted};
pub(crate) use device_keys::DeviceKeys;
pub(crate) use value::{Expected, Quantity, Read, Whole};

/// A key of a scene, as the documentation, the schema and `hpu keys` show it.
#[derive(Clone, PartialEq, Debug)]
pub struct KeyRow {
    /// The section; empty for the scene itself. A word in capitals stands for any name, as in `dut.ports.PORT`.
    pub section: &'static str,
    /// The kinds that take the key: of `[method]` and `[hand]` values of their own `kind`, else a kind of device
    /// (`motor`, `mass`) or of scene: `axis` with one of hpu's methods, `dut` with a design of the user's own. A device
    /// beside an axis has one name for both kinds, as in `phantom`. Empty if all kinds take it.
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
pub(crate) struct Key<V> {
    pub name: &'static str,
    /// The key without which this key has no effect.
    pub beside: Option<&'static str>,
    pub meaning: &'static str,
    pub value: V,
}

/// A key of any type, so that keys of different types can stand in one list. Every `Key` implements it.
pub(crate) trait AnyKey: Sync {
    fn name(&self) -> &'static str;
    fn beside(&self) -> Option<&'static str>;
    fn is_section(&self) -> bool;
    /// Whether a scene must have the key.
    fn is_required(&self) -> bool;
    /// Reads the key only to find whether it is refused.
    fn check(&self, s: &Section) -> Result<(), SceneError>;
    fn row(&self, group: &Group) -> KeyRow;
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

    fn row(&self, group: &Group) -> KeyRow {
        let (takes, otherwise) = (self.value.takes(), self.value.otherwise());
        KeyRow {
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
pub(crate) struct Group {
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
        pub(crate) mod $group {
            #[allow(unused_imports, reason = "not every group has every type of key")]
            use super::*;
            $($(#[doc = $meaning])+ pub(crate) static $key: Key<$value> = Key {
                name: stringify!($key),
                beside: crate::schema::beside(&[$(stringify!($of))?]),
                meaning: concat!($($meaning),+),
                value: $given,
            };)*
            pub(crate) static GROUP: Group =
                Group { section: $section, kinds: &$kinds, keys: &[$(&$key),*] };
        }
    };
}
pub(crate) use keys;

/// A section whose fields are its keys: the struct, the rows of its keys and its reader in one place.
///
/// ```text
/// scene! { shaper: "method.shaper" of [];
///     /// An input shaper.
///     #[derive(Clone, Copy)]
///     pub struct Shaper {
///         /// Cutoff of its filter.
///         cutoff_hz: f64 = cutoff: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
///     }
/// }
/// ```
///
/// makes the keys of [`keys!`], here `shaper::cutoff`, the struct with a field of each key's value, and
/// `Shaper::read(&section)`, which refuses keys that the section does not have.
macro_rules! scene {
    ($group:ident: $section:literal of $kinds:expr;
     $(#[$about:meta])* pub struct $Struct:ident {
         $($(#[doc = $meaning:literal])+ $field:ident: $of:ty = $key:ident: $value:ty = $given:expr;)*
     }) => {
        $(#[$about])*
        pub struct $Struct {
            $($(#[doc = $meaning])+ pub $field: $of,)*
        }

        $crate::schema::keys! { $group: $section of $kinds;
            $($(#[doc = $meaning])+ $key: $value = $given;)*
        }

        impl $Struct {
            /// Reads the section.
            pub(crate) fn read(s: &$crate::schema::section::Section) -> Result<Self, $crate::SceneError> {
                s.accept(&$kinds)?;
                Ok(Self { $($field: s.read(&$group::$key)?,)* })
            }
        }
    };
}
pub(crate) use scene;

pub(crate) const fn beside(of: &[&'static str]) -> Option<&'static str> {
    if of.is_empty() { None } else { Some(of[0]) }
}

/// Returns whether the key of a row is a placeholder for any name.
pub fn is_any_name(key: &str) -> bool {
    key.chars().all(char::is_uppercase)
}

/// Every key of every section. The list stands above the readers, so a scene's source carries it.
pub(crate) struct Schema(Vec<&'static Group>);

impl Schema {
    /// Returns the schema of these groups, in the order in which the documentation shows them.
    pub(crate) fn new(groups: Vec<&'static Group>) -> Self {
        Self(groups)
    }

    /// Returns every key of every section.
    pub(crate) fn rows(&self) -> impl Iterator<Item = KeyRow> {
        self.0.iter().flat_map(|group| group.keys.iter().map(|key| key.row(group)))
    }

    /// Returns the key `kind` of a section.
    pub(crate) fn kind_of(&self, section: &str) -> Option<&'static dyn AnyKey> {
        let mut keys = self.0.iter().filter(|group| group.section == section).flat_map(|group| group.keys);
        keys.find(|key| key.name() == "kind").copied()
    }

    /// Returns the groups of keys that a section of one of these kinds takes.
    fn groups_of(&self, section: &str, kinds: &[&str]) -> impl Iterator<Item = &'static Group> {
        let takes = move |group: &&&'static Group| {
            group.section == section && (group.kinds.is_empty() || group.kinds.iter().any(|kind| kinds.contains(kind)))
        };
        self.0.iter().filter(takes).copied()
    }

    /// Returns the keys that a section of one of these kinds takes.
    pub(crate) fn accepted(&self, section: &str, kinds: &[&str]) -> impl Iterator<Item = &'static dyn AnyKey> {
        self.groups_of(section, kinds).flat_map(|group| group.keys.iter().copied())
    }

    /// Returns these keys with their rows.
    pub(crate) fn taken(&self, section: &str, kinds: &[&str]) -> impl Iterator<Item = (&'static dyn AnyKey, KeyRow)> {
        self.groups_of(section, kinds).flat_map(|group| group.keys.iter().map(|key| (*key, key.row(group))))
    }
}
