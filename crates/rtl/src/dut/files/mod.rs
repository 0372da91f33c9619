//! The files of a design: their names in the folder of the tools, and their order.

pub(super) mod order;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt;
use std::ops::Deref;

use hpu_cosim::scene::{Dut, SourceFile};
use hpu_cosim::script::{Fits, Yosys};

use crate::engines::error::Error;
use crate::engines::tool::Tool;

/// Returns the name of a file without its folders.
pub(in crate::dut) fn base(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// The name of a design's file in the folder of its tools: letters, digits, `_`, `-`, `+` and dots behind a letter, a
/// digit or `_`. So no tool and no script reads the name as an option or as code.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(in crate::dut) struct PlainName(String);

impl PlainName {
    /// Returns the name of a file that hpu itself writes.
    pub(in crate::dut) fn fixed(name: &'static str) -> Self {
        Self(name.to_string())
    }

    /// Returns a name without other characters than those of plain names.
    fn of(name: &str) -> Self {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-+.".contains(c);
        let mut plain: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        if plain.starts_with(['-', '+', '.']) {
            plain.insert(0, '_');
        }
        Self(plain)
    }
}

impl Deref for PlainName {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl AsRef<OsStr> for PlainName {
    fn as_ref(&self) -> &OsStr {
        self.0.as_ref()
    }
}

impl fmt::Display for PlainName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Fits<Yosys> for PlainName {}

/// Returns the plain name of each file of a design beside its own one, in their order. Both are the same where the own
/// name is plain.
pub(in crate::dut) fn plain_names(dut: &Dut) -> Vec<(PlainName, &str)> {
    let own: BTreeSet<&str> = dut.files.iter().map(|(name, _)| base(name)).collect();
    let mut given = BTreeSet::new();
    let named = |(name, _): &SourceFile| {
        let name = base(name);
        let mut plain = PlainName::of(name);
        while *plain != *name && (own.contains(&*plain) || given.contains(&plain.0)) {
            plain.0.insert(0, '_');
        }
        given.insert(plain.0.clone());
        plain
    };
    let names: Vec<_> = dut.files.iter().map(named).collect();
    names.into_iter().zip(dut.files.iter().map(|(name, _)| base(name))).collect()
}

/// Returns the error of a tool that refuses a design.
pub(crate) fn refuses(tool: Tool, dut: &Dut, said: impl Into<String>) -> Error {
    Error::refused(format!("{} refuses `{}`", tool.name(), dut.top), said)
}
