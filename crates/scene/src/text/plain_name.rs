//! Names of files that come from a text: of a study, of a scene, of the command line.

use std::fmt;
use std::str::FromStr;

use crate::text::message::is_unseen;

/// The most bytes of a name. File systems take 255; words and endings behind the name, and the marks of a temporary
/// file, come on top.
const MOST_BYTES: usize = 150;

/// The rule for a plain name, as messages tell it.
const ACCEPTED: &str = "a plain name: no folder, no control character, none of < > : \" | ? *, no dot, dash or space \
                        at its beginning, no dot or space at its end, none that Windows has for a device (CON, \
                        NUL, COM1 and others), at most 150 bytes";

/// A name that a file or folder can have wherever it stands: it names nothing outside the folder that it is put into,
/// hides nothing, and is no option of a command. It is one on every system, so that a folder of results can be taken
/// from one to another. Only its check makes one.
///
/// # Example
///
/// ```
/// use hpu_scene::PlainName;
/// assert_eq!("Table 2, redone".parse::<PlainName>().unwrap().as_str(), "Table 2, redone");
/// assert!("../requirements".parse::<PlainName>().is_err());
/// assert_eq!(PlainName::near(".a/b").as_str(), "_a_b");
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PlainName(String);

impl PlainName {
    /// Returns the plain name that is nearest to a text: what no plain name has becomes `_`, and the rest is cut. It is
    /// for names of files that a user has already, which may be any.
    pub fn near(text: &str) -> Self {
        let mut name: String = text.chars().map(|c| if is_taken(c) { c } else { '_' }).collect();
        while name.len() > MOST_BYTES {
            name.pop();
        }
        if name.is_empty() || name.starts_with(STARTS) || is_device(&name) {
            name.replace_range(..name.len().min(1), "_");
        }
        if name.ends_with(ENDS) {
            name.replace_range(name.len() - 1.., "_");
        }
        Self(name)
    }

    /// Returns whether a text is one part of a path that a plain name can begin: a plain name of any length.
    pub fn begins(part: &str) -> bool {
        !part.is_empty()
            && !part.starts_with(STARTS)
            && !part.ends_with(ENDS)
            && part.chars().all(is_taken)
            && !is_device(part)
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Characters that no name begins with, and that no name ends with.
const STARTS: [char; 3] = ['.', '-', ' '];
const ENDS: [char; 2] = ['.', ' '];

fn is_taken(c: char) -> bool {
    !matches!(c, '/' | '\\' | '<' | '>' | ':' | '"' | '|' | '?' | '*') && !is_unseen(c)
}

/// Returns whether Windows takes a name for a device, whatever its ending and its folder.
fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_uppercase();
    let is_port = |stem: &str| {
        let number = stem.strip_prefix("COM").or_else(|| stem.strip_prefix("LPT"));
        number.is_some_and(|number| {
            let mut digits = number.chars();
            digits.next().is_some_and(|digit| "123456789\u{b9}\u{b2}\u{b3}".contains(digit)) && digits.next().is_none()
        })
    };
    ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"].contains(&stem.as_str()) || is_port(&stem)
}

impl FromStr for PlainName {
    type Err = NotPlain;

    fn from_str(text: &str) -> Result<Self, NotPlain> {
        if text.len() <= MOST_BYTES && Self::begins(text) { Ok(Self(text.to_string())) } else { Err(NotPlain) }
    }
}

impl fmt::Display for PlainName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// The text is no plain name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotPlain;

impl fmt::Display for NotPlain {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "not {ACCEPTED}")
    }
}

impl std::error::Error for NotPlain {}

#[cfg(test)]
mod tests {
    use std::path::{Component, Path};

    use super::PlainName;

    const HOSTILE: [&str; 34] = [
        "",
        ".",
        "..",
        "../requirements",
        "/etc/passwd",
        "a/b",
        "a\\b",
        ".bashrc",
        "-rf",
        " a",
        "a ",
        "a.",
        "a\nb",
        "a\rb",
        "a\tb",
        "a\0b",
        "a\u{1b}[2Jb",
        "a\u{7f}",
        "a\u{9b}2J",
        "a\u{202e}gvs.b",
        "a\u{2028}b",
        "\u{2067}a",
        "con",
        "NUL.txt",
        "aux .tar.gz",
        "Com1",
        "lpt9.csv",
        "COM\u{b9}",
        "conout$",
        "C:a",
        "a:stream",
        "a?",
        "a\"b",
        "<a|b>*",
    ];

    #[test]
    fn a_name_that_could_leave_its_folder_is_not_plain() {
        for text in HOSTILE.into_iter().map(String::from).chain(["a".repeat(151), "é".repeat(76)]) {
            assert!(text.parse::<PlainName>().is_err(), "{text:?}");
        }
        for text in [
            "map",
            "phantom-table-2",
            "Knie é 膝",
            "a.b",
            "$(touch x)",
            "a'b",
            "%{}",
            "console",
            "COM10",
            "COM",
            "LPT0",
            "a.con",
            &"a".repeat(150),
        ] {
            assert_eq!(text.parse::<PlainName>().map(|name| name.to_string()).as_deref(), Ok(text));
        }
    }

    #[test]
    fn the_nearest_plain_name_is_one_part_of_a_path() {
        let long = ["é".repeat(300), format!("{} b", "a".repeat(149)), format!("{}.", "a".repeat(149))];
        for text in HOSTILE.into_iter().map(String::from).chain(long) {
            let near = PlainName::near(&text);
            assert_eq!(near.as_str().parse::<PlainName>().as_ref(), Ok(&near), "{text:?}");
            let parts: Vec<_> = Path::new(near.as_str()).components().collect();
            assert!(matches!(parts[..], [Component::Normal(part)] if part == near.as_str()), "{text:?}");
        }
    }
}
