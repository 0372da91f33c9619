//! The names of a design's units, ports and generics: identifiers of its language.

use std::fmt;
use std::ops::Deref;

/// A language of designs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Language {
    /// VHDL.
    Vhdl,
    /// Verilog and SystemVerilog.
    Verilog,
}

impl Language {
    /// Returns the language of a design's files, which have names and contents.
    pub fn of<C>(files: &[(String, C)]) -> Self {
        let is_vhdl = |name: &str| {
            let name = name.to_ascii_lowercase();
            name.ends_with(".vhd") || name.ends_with(".vhdl")
        };
        if files.iter().any(|(name, _)| is_vhdl(name)) { Self::Vhdl } else { Self::Verilog }
    }

    /// Returns the accepted identifiers, as a message lists them.
    pub fn identifiers(self) -> &'static str {
        match self {
            Self::Vhdl => {
                "an identifier of VHDL is a letter, then letters, digits and single underscores; that of a port or \
                 generic also an extended one without spaces, as in \\a-b\\"
            }
            Self::Verilog => {
                "an identifier of Verilog is a letter or an underscore, then letters, digits, underscores and $"
            }
        }
    }
}

/// An identifier of VHDL or Verilog. Its text is safe in every script and every source that hpu writes.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Identifier(String);

impl Identifier {
    /// Returns a text as an identifier; `None` if it is none of the language.
    pub fn new(language: Language, text: &str) -> Option<Self> {
        let is_one = match language {
            Language::Vhdl => is_basic(text) || is_extended(text),
            Language::Verilog => is_simple(text),
        };
        is_one.then(|| Self(text.to_string()))
    }

    /// Returns a text as the name of a unit or a library: an identifier, but no extended one.
    pub fn unit(language: Language, text: &str) -> Option<Self> {
        Self::new(language, text).filter(|name| !name.starts_with('\\'))
    }

    /// Returns a name that is part of this program.
    ///
    /// # Panics
    ///
    /// When the text is no identifier of either language.
    pub fn fixed(text: &'static str) -> Self {
        Self::new(Language::Verilog, text).expect("a name that this program has chosen")
    }

    /// Returns the identifier in lower case.
    pub fn to_lowercase(&self) -> Self {
        Self(self.0.to_lowercase())
    }
}

impl Deref for Identifier {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Returns whether a text is a basic identifier of VHDL.
fn is_basic(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(is_part)
        && !text.contains("__")
        && !text.ends_with('_')
}

/// Returns whether a text is an extended identifier of VHDL that also the reader of interfaces takes.
fn is_extended(text: &str) -> bool {
    let inside = text.strip_prefix('\\').and_then(|rest| rest.strip_suffix('\\'));
    inside.is_some_and(|inside| {
        let is_part = |c: char| c.is_ascii_graphic() && !"\"();:,\\".contains(c);
        !inside.is_empty() && inside.chars().all(is_part) && !inside.contains("--") && !inside.contains("/*")
    })
}

/// Returns whether a text is a simple identifier of Verilog.
fn is_simple(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && text.chars().all(is_part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_each_language_are_identifiers_and_nothing_else_is() {
        let is = |language, text| Identifier::new(language, text).is_some();
        for text in ["clk", "Gain_2", "a", "\\a-b\\", "\\1+[x]\\"] {
            assert!(is(Language::Vhdl, text), "{text}");
        }
        for text in ["clk", "_x", "a__b$", "A9_"] {
            assert!(is(Language::Verilog, text), "{text}");
        }
        let neither =
            ["", " ", "a b", "9a", "a\n", "-x", "a;b", "a\"b", "$(id)", "\\a b\\", "\\\\", "a\\", "é", "{}", "a%b"];
        for text in neither {
            assert!(!is(Language::Vhdl, text) && !is(Language::Verilog, text), "{text:?}");
        }
        for text in ["_x", "a__b", "a_", "a$", "\\a;b\\", "\\a--b\\"] {
            assert!(!is(Language::Vhdl, text), "{text}");
        }
        assert!(!is(Language::Verilog, "\\a-b\\") && Identifier::unit(Language::Vhdl, "\\a\\").is_none());
    }
}
