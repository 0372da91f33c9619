//! Blocks that the catalogue lists: built from the generics of their entities, and in the configurations of their
//! tests.

use hpu_signal::Format;

use crate::base::config::ConfigError;
use crate::{AnyBlock, Block, Generic};

/// A block that the catalogue lists. Every block implements it beside its code, so that a new one is a file and a line
/// of the catalogue.
pub(crate) trait Listed: Block + Default + 'static {
    /// Builds the block from the generics of its entity.
    fn of_generics(given: &Given) -> Result<Self, ConfigError>;

    /// Returns the configurations beside the default in which it is tested, each with a label that is unique among
    /// them.
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(Vec::new())
    }
}

/// The values of all generics of a block.
pub(crate) struct Given {
    name: &'static str,
    values: Vec<(&'static str, Generic)>,
    in_loop: bool,
}

type Made<T> = Result<T, ConfigError>;

impl Given {
    /// Returns the generics of a block, of which `set` have other values.
    pub(crate) fn new(block: &dyn AnyBlock, set: &[(&str, Generic)]) -> Made<Self> {
        let (name, mut values) = (block.name(), block.generics());
        for &(generic, value) in set {
            let names: Vec<_> = values.iter().map(|(name, _)| *name).collect();
            let Some((_, old)) = values.iter_mut().find(|(name, _)| *name == generic) else {
                let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
                return Err(ConfigError::new(name, format!("generic {generic}"), names));
            };
            if std::mem::discriminant(old) != std::mem::discriminant(&value) {
                let accepted = if matches!(old, Generic::Boolean(_)) { "true or false" } else { "a whole number" };
                let value = match value {
                    Generic::Integer(value) => value.to_string(),
                    Generic::Boolean(value) => value.to_string(),
                };
                return Err(ConfigError::new(name, format!("{generic} is {value}"), accepted));
            }
            *old = value;
        }
        Ok(Self { name, values, in_loop: false })
    }

    /// Returns the same for the law in the middle of a loop, two of whose generics have other names there.
    pub(crate) fn of_law(&self) -> Self {
        Self { values: self.values.clone(), in_loop: true, ..*self }
    }

    /// Returns the name that a generic has in the entity.
    fn named<'a>(&self, generic: &'a str) -> &'a str {
        match generic {
            "WIDTH" if self.in_loop => "POSITION_WIDTH",
            "TORQUE_WIDTH" if self.in_loop => "PWM_WIDTH",
            generic => generic,
        }
    }

    /// Returns the name of the entity.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// Returns whether the entity has that generic.
    pub(crate) fn has(&self, generic: &str) -> bool {
        self.values.iter().any(|(name, _)| *name == self.named(generic))
    }

    fn value(&self, generic: &str) -> Generic {
        let generic = self.named(generic);
        let value = self.values.iter().find(|(name, _)| *name == generic).map(|(_, value)| *value);
        value.unwrap_or_else(|| panic!("{} has the generic {generic}", self.name))
    }

    /// Returns whether a generic is true.
    pub(crate) fn is(&self, generic: &str) -> bool {
        self.value(generic) == Generic::Boolean(true)
    }

    /// Returns a whole number.
    pub(crate) fn whole<T: TryFrom<i64>>(&self, generic: &str, accepted: &str) -> Made<T> {
        let Generic::Integer(value) = self.value(generic) else { panic!("{generic} is a number") };
        let name = self.named(generic);
        T::try_from(value).map_err(|_| ConfigError::new(self.name, format!("{name} is {value}"), accepted))
    }

    /// Returns a VHDL `natural`.
    pub(crate) fn natural(&self, generic: &str) -> Made<u32> {
        self.whole(generic, "0 to 2147483647")
    }

    /// Returns several VHDL `natural`s.
    pub(crate) fn naturals<const N: usize>(&self, generics: [&str; N]) -> Made<[u32; N]> {
        let mut all = [0; N];
        for (value, generic) in all.iter_mut().zip(generics) {
            *value = self.natural(generic)?;
        }
        Ok(all)
    }

    /// Returns a VHDL `integer`.
    pub(crate) fn word(&self, generic: &str) -> Made<i32> {
        self.whole(generic, "-2147483648 to 2147483647")
    }

    /// Returns a format.
    pub(crate) fn format(&self, signed: bool, int: i32, frac: i32) -> Made<Format> {
        let accepted = "1 to 64 bits, each part -63 to 64";
        Format::new(signed, int, frac).map_err(|_| {
            ConfigError::new(self.name, format!("a word of ({},{int},{frac})", u8::from(signed)), accepted)
        })
    }

    /// Returns an unsigned format from its width and its fraction bits.
    pub(crate) fn unsigned(&self, stem: &str) -> Made<Format> {
        let (width, frac) = (self.word(&format!("{stem}_WIDTH"))?, self.word(&format!("{stem}_FRAC"))?);
        self.format(false, width.saturating_sub(frac), frac)
    }

    /// Returns a format from its integer bits and its fraction bits.
    pub(crate) fn parts(&self, signed: bool, stem: &str) -> Made<Format> {
        self.format(signed, self.word(&format!("{stem}_INT"))?, self.word(&format!("{stem}_FRAC"))?)
    }
}

/// A field of a [`configuration!`], as the generics of an entity. Implemented by the types of such fields.
pub(crate) trait Field: Sized {
    /// Returns the field's generics of these names.
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)>;
    /// Reads the field from its generics of these names.
    fn given(given: &Given, generics: &[&'static str]) -> Made<Self>;
}

impl Field for u32 {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Integer(self.into()))]
    }

    fn given(given: &Given, generics: &[&'static str]) -> Made<Self> {
        given.natural(generics[0])
    }
}

impl Field for bool {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Boolean(self))]
    }

    fn given(given: &Given, generics: &[&'static str]) -> Made<Self> {
        Ok(given.is(generics[0]))
    }
}

/// An unsigned format: its width, named `..._WIDTH`, and its fraction bits.
impl Field for Format {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        let parts = [i64::from(self.width()), self.frac().into()];
        generics.iter().copied().zip(parts.map(Generic::Integer)).collect()
    }

    fn given(given: &Given, generics: &[&'static str]) -> Made<Self> {
        given.unsigned(generics[0].trim_end_matches("_WIDTH"))
    }
}

/// A configuration whose fields are the generics of its entity, in their order: of each field its type, its default and
/// the names of its generics.
macro_rules! configuration {
    ($(#[doc = $about:literal])+ pub struct $Config:ident {
        $($(#[doc = $doc:literal])+ $field:ident: $Field:ty = $default:expr, [$($generic:literal),*];)*
    }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub struct $Config {
            $($(#[doc = $doc])+ pub $field: $Field,)*
        }

        impl Default for $Config {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $Config {
            fn generics(self) -> Vec<(&'static str, $crate::Generic)> {
                [$($crate::base::listed::Field::told(self.$field, &[$($generic),*])),*].concat()
            }

            fn given(given: &$crate::base::listed::Given) -> Result<Self, $crate::ConfigError> {
                Ok(Self { $($field: $crate::base::listed::Field::given(given, &[$($generic),*])?),* })
            }
        }
    };
}
pub(crate) use configuration;
