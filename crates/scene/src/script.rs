//! Scripts for programs that read words: shells, Slurm, GNU parallel, Yosys.
//!
//! [`script!`](crate::script!) makes a [`Script`] from fixed text and words. A word is a script too, and only the
//! quoting functions of its language make one from other text. So a name from a scene or a folder never becomes code:
//! a `String` in a script does not compile.
//!
//! ```compile_fail
//! use hpu_scene::script::Yosys;
//! let top = String::from("top; exec -- id");
//! hpu_scene::script!(Yosys: "prep -top {}", top);
//! ```

use std::fmt;
use std::marker::PhantomData;
use std::num::NonZeroUsize;
use std::path::Path;

use crate::dut::Generic;
use crate::schema::identifier::Identifier;
use crate::text::message::excerpt;

/// The language of POSIX shells.
pub enum Shell {}
/// The options of a job in lines that begin with `#SBATCH`.
pub enum Slurm {}
/// The command lines of GNU parallel, which replaces `{}` and other words in braces before a shell reads the line.
pub enum Parallel {}
/// The commands of Yosys.
pub enum Yosys {}
/// The literals of Verilog, as Verilator's `-G` takes them.
pub enum Verilog {}
/// The expressions of VHDL.
pub enum Vhdl {}

/// Text in a language.
pub struct Script<L> {
    text: String,
    language: PhantomData<fn() -> L>,
}

impl<L> Script<L> {
    /// Makes a script; only [`script!`](crate::script) may call this, with words that fit.
    #[doc(hidden)]
    pub fn of(text: fmt::Arguments<'_>) -> Self {
        Self::made(text.to_string())
    }

    /// Returns an empty script.
    pub fn empty() -> Self {
        Self::made(String::new())
    }

    fn made(text: String) -> Self {
        Self { text, language: PhantomData }
    }

    /// Returns the text.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

impl<L> fmt::Display for Script<L> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl<L> FromIterator<Self> for Script<L> {
    /// Joins scripts.
    fn from_iter<I: IntoIterator<Item = Self>>(parts: I) -> Self {
        Self::made(parts.into_iter().map(|part| part.text).collect())
    }
}

/// A value whose text is harmless in a language.
pub trait Fits<L>: fmt::Display {}

impl<L, W: Fits<L> + ?Sized> Fits<L> for &W {}
impl<L> Fits<L> for Script<L> {}
impl<L> Fits<L> for u32 {}
impl<L> Fits<L> for u64 {}
impl<L> Fits<L> for usize {}
impl<L> Fits<L> for NonZeroUsize {}
impl<L> Fits<L> for Fixed {}
impl Fits<Yosys> for Identifier {}
/// A shell reads the options of Slurm as a comment.
impl Fits<Shell> for Script<Slurm> {}

/// Text that is part of this program.
pub struct Fixed(pub &'static str);

impl fmt::Display for Fixed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.0)
    }
}

/// Returns a value that fits into a language; [`script!`](crate::script) calls it for each word.
#[doc(hidden)]
pub fn fits<L, W: Fits<L> + ?Sized>(word: &W) -> &W {
    word
}

/// Makes a [`Script`](crate::script::Script) of a language as `format!` makes a text. Each word must [fit](Fits).
#[macro_export]
macro_rules! script {
    ($language:ty: $format:literal $(, $word:expr)* $(,)?) => {
        // Behind `concat!` the format cannot name a variable, whose type would not be checked.
        $crate::script::Script::<$language>::of(
            format_args!(concat!($format) $(, $crate::script::fits::<$language, _>(&$word))*)
        )
    };
}

/// The reason why a text cannot be a word of a language.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Unwritable(String);

impl fmt::Display for Unwritable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unwritable {}

impl Script<Shell> {
    /// Returns a word of a shell.
    pub fn word(text: &str) -> Self {
        let plain = |c: char| c.is_ascii_alphanumeric() || "._-+/:,".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            return Self::made(text.to_string());
        }
        Self::made(format!("'{}'", text.replace('\'', r"'\''")))
    }

    /// Returns a path as a word on a line of a script.
    ///
    /// # Errors
    ///
    /// When the path is not UTF-8, or has a control character such as a line's end.
    pub fn path(path: &Path) -> Result<Self, Unwritable> {
        Ok(Self::word(&on_a_line(path)?))
    }

    /// Returns the line that a template of GNU parallel makes, as a word.
    pub fn template(line: &Script<Parallel>) -> Self {
        Self::word(&line.text)
    }
}

impl Script<Slurm> {
    /// Returns the path of a file in a folder; Slurm replaces the patterns of `name`, such as `%A`, and none of the
    /// folder's.
    ///
    /// # Errors
    ///
    /// When the path is not UTF-8, or has a control character or a backslash, which Slurm removes.
    pub fn file(folder: &Path, name: &'static str) -> Result<Self, Unwritable> {
        let text = on_a_line(folder)?;
        if text.contains('\\') {
            return Err(Unwritable(format!("`{}` has a backslash, which Slurm removes from a path", excerpt(&text))));
        }
        Ok(Self::made(format!("{}/{name}", Script::<Shell>::word(&text.replace('%', "%%")))))
    }

    /// Returns an option of the user's own, as it is.
    ///
    /// # Errors
    ///
    /// When the option has a control character such as a line's end.
    pub fn option(text: &str) -> Result<Self, Unwritable> {
        without_control(text).map(|text| Self::made(text.to_string()))
    }

    /// Returns a word of letters, digits and dashes.
    ///
    /// # Errors
    ///
    /// For any other text.
    pub fn name(text: &str) -> Result<Self, Unwritable> {
        let is_plain = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
        if is_plain {
            Ok(Self::made(text.to_string()))
        } else {
            Err(Unwritable(format!("`{}` is no name", excerpt(text))))
        }
    }
}

impl Script<Parallel> {
    /// Returns a shell's word in which GNU parallel finds no word in braces: every brace is followed by an empty
    /// quotation, which the shell removes.
    pub fn word(word: &Script<Shell>) -> Self {
        // A brace makes the shell's word a quoted one.
        Self::made(word.text.replace('{', "{''"))
    }
}

impl Script<Yosys> {
    /// Returns the value of a parameter.
    ///
    /// # Errors
    ///
    /// For a real number, and for a negative one, whose sign Yosys loses.
    pub fn value(value: &Generic) -> Result<Self, Unwritable> {
        match value {
            Generic::Integer(number) if *number < 0 => Err(Unwritable(format!(
                "{number} is negative, and Yosys would lose its sign; make it the parameter's default in the design"
            ))),
            // A literal has no quote inside its quotes, so that Yosys finds its end.
            Generic::Real(number) => Err(Unwritable(format!(
                "{number} is real, which Yosys does not set; make it the parameter's default in the design"
            ))),
            value => Ok(Self::made(Script::<Verilog>::literal(value).text)),
        }
    }

    /// Returns a net in a selection. `None` if Yosys would read its name as more than that name.
    pub fn net(name: &str) -> Option<Self> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_.$[]:\\".contains(c);
        (!name.is_empty() && name.chars().all(is_plain)).then(|| Self::made(name.to_string()))
    }
}

impl Script<Verilog> {
    /// Returns the value of a parameter. A text such as `8'h1F` is a number. A text with a quote or a control
    /// character, which no tool takes in quotes, is written by its bits.
    pub fn literal(value: &Generic) -> Self {
        Self::made(match value {
            Generic::Flag(flag) => i32::from(*flag).to_string(),
            Generic::Integer(number) => number.to_string(),
            Generic::Real(number) => number.clone(),
            Generic::Text(text) if is_sized(text) => text.clone(),
            Generic::Text(text) if text.chars().any(|c| c == '"' || c.is_control()) => {
                let bits: String = text.bytes().map(|byte| format!("{byte:08b}")).collect();
                format!("{}'b{bits}", bits.len())
            }
            Generic::Text(text) => format!("\"{text}\""),
        })
    }
}

impl Script<Vhdl> {
    /// Returns a text as an expression of the type `string`.
    pub fn text(text: &str) -> Self {
        let is_plain = |c: char| c.is_ascii_graphic() || c == ' ';
        let part = |chars: &str| format!("\"{}\"", chars.replace('"', "\"\""));
        if text.chars().all(is_plain) {
            return Self::made(part(text));
        }
        // VHDL is read byte by byte.
        let bytes = text.bytes().map(|byte| match char::from(byte) {
            c if is_plain(c) => part(&c.to_string()),
            _ => format!("character'val({byte})"),
        });
        Self::made(format!("\"\" & {}", bytes.collect::<Vec<_>>().join(" & ")))
    }

    /// Returns an expression as it is.
    ///
    /// # Errors
    ///
    /// When the text has an end of its own: a semicolon, a comment, a bracket or a quote too many, or a control
    /// character.
    pub fn expression(text: &str) -> Result<Self, Unwritable> {
        let mut depth = 0_u32;
        let mut rest = text.chars().peekable();
        let mut is_inside = false;
        let mut is_one = !text.trim().is_empty();
        while let Some(c) = rest.next() {
            match c {
                '"' => is_inside = !is_inside,
                c if c.is_control() => is_one = false,
                _ if is_inside => {}
                // A character such as ';' in its quotes; the quote of an attribute stands alone.
                '\'' if rest.clone().nth(1) == Some('\'') => drop((rest.next(), rest.next())),
                '(' => depth += 1,
                ')' => match depth.checked_sub(1) {
                    Some(less) => depth = less,
                    None => is_one = false,
                },
                ';' => is_one = false,
                '-' | '/' if rest.peek() == Some(&if c == '-' { '-' } else { '*' }) => is_one = false,
                _ => {}
            }
        }
        if is_one && depth == 0 && !is_inside {
            return Ok(Self::made(text.to_string()));
        }
        Err(Unwritable(format!("`{}` is no expression of VHDL, as in \"0101\", '1' or 2 * 3", excerpt(text))))
    }
}

/// Returns whether a text is a number of Verilog with its width, such as `8'h1F`.
fn is_sized(text: &str) -> bool {
    let Some((width, rest)) = text.split_once('\'') else { return false };
    let rest = rest.strip_prefix(['s', 'S']).unwrap_or(rest);
    let Some(digits) = rest.strip_prefix(['b', 'B', 'o', 'O', 'd', 'D', 'h', 'H']) else { return false };
    let is_digit = |c: char| c.is_ascii_hexdigit() || "xXzZ_".contains(c);
    !width.is_empty() && width.chars().all(|c| c.is_ascii_digit()) && !digits.is_empty() && digits.chars().all(is_digit)
}

/// Returns a path as text that can stand on a line.
fn on_a_line(path: &Path) -> Result<String, Unwritable> {
    let text = path.to_str().ok_or_else(|| Unwritable(format!("`{}` is not text in UTF-8", path.display())))?;
    without_control(text).map(str::to_string)
}

fn without_control(text: &str) -> Result<&str, Unwritable> {
    if text.chars().any(char::is_control) {
        let shown = excerpt(text);
        return Err(Unwritable(format!(
            "`{}` has a control character, such as a line's end; a job script cannot name it",
            shown.escape_debug()
        )));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    /// Texts with every character that a language may read as more than itself.
    const TEXTS: [&str; 16] = [
        "plain",
        "a b",
        "it's",
        "\"q\"",
        "$(id) $HOME `id`",
        "-x",
        "#x;y&z|w",
        "a\nb",
        "%A %% %j",
        "{} {.} {#} {= 1 =}",
        "é",
        "a\\b",
        "*?[x]",
        "~",
        "!x",
        "",
    ];

    #[test]
    fn a_shell_reads_a_word_as_its_text() {
        for text in TEXTS {
            let script = script!(Shell: "printf %s {}", Script::<Shell>::word(text));
            let said = Command::new("/bin/sh").args(["-c", script.as_str()]).output().expect("a shell");
            assert_eq!(String::from_utf8_lossy(&said.stdout), text);
        }
    }

    #[test]
    fn a_template_of_parallel_has_no_braces_but_its_own_and_the_shell_reads_the_text() {
        for text in TEXTS {
            let word = Script::<Parallel>::word(&Script::<Shell>::word(text));
            let line = script!(Parallel: "printf '%s %s' {} {{}}", word);
            assert_eq!(line.as_str().matches("{}").count(), 1, "{line}");
            for own in ["{.", "{#", "{%", "{=", "{/"] {
                assert!(!line.as_str().contains(own), "{line}");
            }
            let filled = line.as_str().replace("{}", "7");
            let said = Command::new("/bin/sh").args(["-c", &filled]).output().expect("a shell");
            assert_eq!(String::from_utf8_lossy(&said.stdout), format!("{text} 7"));
        }
    }

    #[test]
    fn the_folder_of_a_log_has_no_pattern_and_no_end_of_a_line() {
        let file = |folder: &str| Script::<Slurm>::file(Path::new(folder), "slurm-%A.log");
        let text = |folder: &str| file(folder).map(|file| file.text);
        assert_eq!(text("/a/b"), Ok("/a/b/slurm-%A.log".into()));
        assert_eq!(text("/a 50%A"), Ok("'/a 50%%A'/slurm-%A.log".into()));
        for refused in ["/a\nb", "/a\rb", "/a\\b", "/a\u{1b}b"] {
            assert!(file(refused).is_err(), "{refused:?}");
        }
        assert!(Script::<Slurm>::option("--x\n#SBATCH --y").is_err() && Script::<Slurm>::name("a b").is_err());
    }

    #[test]
    fn a_literal_has_no_quote_inside_and_no_control_character() {
        let literal = |text: &str| Script::<Verilog>::literal(&Generic::Text(text.to_string())).text;
        for text in TEXTS {
            let written = literal(text);
            let inside = written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(&written);
            assert!(!inside.contains(['"', '\n']), "{written}");
        }
        // By hand: `a"` is 61 22 in hexadecimal digits.
        assert_eq!((literal("a b"), literal("a\"")), ("\"a b\"".into(), "16'b0110000100100010".into()));
        assert_eq!((literal("8'h1F"), literal("8'h1;")), ("8'h1F".into(), "\"8'h1;\"".into()));
        let real = |value| Script::<Verilog>::literal(&Generic::real(value)).text;
        assert_eq!((real(0.5), real(-2.5e-9), real(3.0)), ("5.0e-1".into(), "-2.5e-9".into(), "3.0e0".into()));
        let number = |number| Script::<Yosys>::value(&Generic::Integer(number)).map(|value| value.text);
        assert_eq!(number(5), Ok("5".into()));
        assert!(number(-3).is_err());
    }

    #[test]
    fn a_text_of_vhdl_has_its_quotes_twice_and_an_expression_has_no_end() {
        let text = |text| Script::<Vhdl>::text(text).text;
        assert_eq!((text("a\"b"), text("")), ("\"a\"\"b\"".into(), "\"\"".into()));
        assert_eq!(
            text("a\n\"é"),
            "\"\" & \"a\" & character'val(10) & \"\"\"\" & character'val(195) & character'val(169)"
        );
        let is_one = |text| Script::<Vhdl>::expression(text).is_ok();
        for good in ["3", "'1'", "\"01;(\"", "f(2, ';') + integer'(3)", "5 ns", "-3", "a'length - 1"] {
            assert!(is_one(good), "{good}");
        }
        for bad in ["", "3; end", "3)", "(3", "3 -- x", "3 /* x", "\"3", "3\n", "';';", "x'(';'); a(';' "] {
            assert!(!is_one(bad), "{bad}");
        }
    }

    #[test]
    fn a_net_is_one_word() {
        assert!(Script::<Yosys>::net("u_loop.\\a[3]").is_some());
        for refused in ["", "a b", "a;exec", "a\"", "@x", "a\n"] {
            assert!(Script::<Yosys>::net(refused).is_none(), "{refused:?}");
        }
    }
}
