//! Blocks that the catalogue lists: built from the generics of their entities, and in the configurations of their
//! tests.

use hpu_signal::{Format, Rounding};

use crate::base::block::renamed;
use crate::base::config::ConfigError;
use crate::{AnyBlock, Block, Generic};

/// A block that the catalogue lists. Every block implements it beside its code, so that a new one is a file and a line
/// of the catalogue.
pub(crate) trait Listed: Configured + Block + Default + 'static {
    /// Returns the configurations beside the default in which it is tested, each with a label that is unique among
    /// them.
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(Vec::new())
    }
}

/// A block that is built from the generics of its entity. [`configured!`] implements it where the generics are those of
/// one configuration, or a few words.
pub(crate) trait Configured: Sized {
    /// Builds the block from the generics of its entity.
    fn of_generics(given: &Given) -> Result<Self, ConfigError>;
}

/// The values of all generics of a block.
pub(crate) struct Given {
    name: &'static str,
    values: Vec<(&'static str, Generic)>,
    renames: &'static [(&'static str, &'static str)],
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
        Ok(Self { name, values, renames: &[] })
    }

    /// Returns the same for a block in the middle of a loop, whose generics have other names there.
    pub(crate) fn renamed(&self, renames: &'static [(&'static str, &'static str)]) -> Self {
        Self { values: self.values.clone(), renames, ..*self }
    }

    /// Returns the name that a generic has in the entity.
    fn named<'a>(&self, generic: &'a str) -> &'a str {
        renamed(generic, self.renames)
    }

    /// Returns the name of the entity.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// Returns whether the entity has that generic.
    fn has(&self, generic: &str) -> bool {
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

    /// Returns a format from its width and its fraction bits.
    pub(crate) fn sized(&self, signed: bool, stem: &str) -> Made<Format> {
        let (width, frac) = (self.word(&format!("{stem}_WIDTH"))?, self.word(&format!("{stem}_FRAC"))?);
        self.format(signed, width.saturating_sub(frac).saturating_sub(i32::from(signed)), frac)
    }

    /// Returns a field of these generics, or the default if the entity has none of them.
    pub(crate) fn field<T: Field>(&self, generics: &[&'static str], default: T) -> Made<T> {
        let has_none = generics.first().is_some_and(|generic| !self.has(generic));
        if has_none { Ok(default) } else { T::given(self, generics, &default) }
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
    /// Reads the field from its generics of these names. `default` says what they leave open.
    fn given(given: &Given, generics: &[&'static str], default: &Self) -> Made<Self>;
}

impl Field for u32 {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Integer(self.into()))]
    }

    fn given(given: &Given, generics: &[&'static str], _: &Self) -> Made<Self> {
        given.natural(generics[0])
    }
}

impl Field for i32 {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Integer(self.into()))]
    }

    fn given(given: &Given, generics: &[&'static str], _: &Self) -> Made<Self> {
        given.word(generics[0])
    }
}

impl Field for bool {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Boolean(self))]
    }

    fn given(given: &Given, generics: &[&'static str], _: &Self) -> Made<Self> {
        Ok(given.is(generics[0]))
    }
}

/// The way in which a block rounds, by its number.
impl Field for Rounding {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        vec![(generics[0], Generic::Integer(self.number().into()))]
    }

    fn given(given: &Given, generics: &[&'static str], _: &Self) -> Made<Self> {
        let all = || Self::ALL.map(|one| format!("{} {}", one.number(), one.name())).join(", ");
        let number: i64 = given.whole(generics[0], "a number of 64 bits")?;
        let found = Self::ALL.into_iter().find(|one| i64::from(one.number()) == number);
        found.ok_or_else(|| ConfigError::new(given.name, format!("{} is {number}", generics[0]), all()))
    }
}

/// Several numbers, each a generic.
impl<T: Field + Copy, const N: usize> Field for [T; N] {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        self.into_iter().zip(generics).flat_map(|(value, name)| value.told(&[*name])).collect()
    }

    fn given(given: &Given, generics: &[&'static str], default: &Self) -> Made<Self> {
        let mut all = *default;
        for (value, name) in all.iter_mut().zip(generics) {
            *value = T::given(given, &[*name], value)?;
        }
        Ok(all)
    }
}

/// A format with the sign of the default: its width or, in a generic named `..._INT`, its integer bits; and its
/// fraction bits.
impl Field for Format {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        let first = if generics[0].ends_with("_INT") { self.int().into() } else { self.width().into() };
        generics.iter().copied().zip([first, self.frac().into()].map(Generic::Integer)).collect()
    }

    fn given(given: &Given, generics: &[&'static str], default: &Self) -> Made<Self> {
        let (stem, signed) = (generics[0], default.is_signed());
        match stem.strip_suffix("_INT") {
            Some(stem) => given.parts(signed, stem),
            None => given.sized(signed, stem.trim_end_matches("_WIDTH")),
        }
    }
}

/// A configuration whose fields are the generics of its entity, in their order: of each field its type, its default and
/// the names of its generics. A field whose generics the entity lacks has its default.
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
            /// Returns the VHDL generics, in the order of the entity.
            pub fn generics(self) -> Vec<(&'static str, $crate::Generic)> {
                [$($crate::base::listed::Field::told(self.$field, &[$($generic),*])),*].concat()
            }

            /// Reads the configuration from the generics of an entity.
            pub(crate) fn given(given: &$crate::base::listed::Given) -> Result<Self, $crate::ConfigError> {
                Ok(Self { $($field: given.field(&[$($generic),*], $default)?),* })
            }
        }
    };
}

/// Makes a block of its generics and tells them: its `Default` (the data sheet), [`Configured`] and `told`. The
/// generics are those of the block's configuration, or those that `told` selects of them. Otherwise a row is a generic
/// (a format has two): its type, its default, and its value in the block; the constructor takes them in this order.
macro_rules! configured {
    ($Block:ident: $Config:ident) => {
        crate::base::listed::configured!($Block: $Config, |config| config.generics());
    };
    ($Block:ident: $Config:ident, |$config:ident| $told:expr) => {
        crate::base::block::data_sheet!($Block = Self::new($Config::default()));

        impl $Block {
            fn told(&self) -> Vec<(&'static str, $crate::Generic)> {
                let $config = self.config;
                $told
            }
        }

        impl $crate::base::listed::Configured for $Block {
            fn of_generics(given: &$crate::base::listed::Given) -> Result<Self, $crate::ConfigError> {
                Self::new($Config::given(given)?)
            }
        }
    };
    ($Block:ident of |$block:ident| { $($($generic:literal)+: $Field:ty = $default:expr, $told:expr;)+ }) => {
        crate::base::block::data_sheet!($Block = Self::new($($default),+));

        impl $Block {
            fn told(&self) -> Vec<(&'static str, $crate::Generic)> {
                let $block = self;
                [$(<$Field as $crate::base::listed::Field>::told($told, &[$($generic),+])),+].concat()
            }
        }

        impl $crate::base::listed::Configured for $Block {
            fn of_generics(given: &$crate::base::listed::Given) -> Result<Self, $crate::ConfigError> {
                Self::new($(given.field::<$Field>(&[$($generic),+], $default)?),+)
            }
        }
    };
}
pub(crate) use {configuration, configured};
