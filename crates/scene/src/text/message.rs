//! Numbers and excerpts of input as messages write them, and the error for input that is not text.

use std::borrow::Cow;

/// Characters of input that a message repeats.
const MOST_REPEATED: usize = 60;

/// Returns a number with all of its digits: plain from 0.0001 to below 10^10, with an exponent beyond.
///
/// # Example
///
/// ```
/// use hpu_scene::number;
/// assert_eq!(number(0.25), "0.25");
/// assert_eq!(number(2e-7), "2e-7");
/// assert_eq!(number(-1e300), "-1e300");
/// ```
pub fn number(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e10).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// Returns a computed number with seven digits.
pub fn figure(value: f64) -> String {
    number(rounded(value, |_| false, 0.0))
}

/// Returns a number with seven digits, rounded down, as messages show the greatest accepted number.
pub(crate) fn number_below(value: f64) -> String {
    number(rounded(value, |near| near > value, -1e-6))
}

/// Returns a number with seven digits, rounded up, as messages show the least accepted number.
pub(crate) fn number_above(value: f64) -> String {
    number(rounded(value, |near| near < value, 1e-6))
}

/// Returns the nearest number of seven digits or, where that lies on the wrong side, the next one.
fn rounded(value: f64, is_wrong: impl Fn(f64) -> bool, next: f64) -> f64 {
    let text = format!("{value:.6e}");
    let read = |text: &str| text.parse().unwrap_or(value);
    match text.split_once('e') {
        Some((digits, exponent)) if is_wrong(read(&text)) => read(&format!("{:.6}e{exponent}", read(digits) + next)),
        _ => read(&text),
    }
}

/// Returns text as a message repeats it: only its beginning when it is long.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST_REPEATED) {
        None => text.to_string(),
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

/// Returns whether a character shows nothing of its own, but may change what is around it: a control character (of C0,
/// C1, or delete), a separator of lines, or a mark that changes the direction of text.
pub(crate) fn is_unseen(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{61c}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns text as a terminal may show it: characters that would steer the terminal, or turn the direction of text,
/// are escaped as in `\u{1b}`. Lines and tabs stay.
///
/// # Example
///
/// ```
/// use hpu_scene::printable;
/// assert_eq!(printable("a\u{1b}[2Jb\n"), "a\\u{1b}[2Jb\n");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    let is_steering = |c: char| is_unseen(c) && !matches!(c, '\n' | '\t');
    if !text.contains(is_steering) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_steering(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Returns JSON as a terminal may show it: the characters that [`printable`] escapes are escaped as JSON has it.
pub fn printable_json(json: &str) -> Cow<'_, str> {
    let is_steering = |c: char| is_unseen(c) && c != '\n';
    if !json.contains(is_steering) {
        return Cow::Borrowed(json);
    }
    let shown = |c: char| if is_steering(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(json.chars().map(shown).collect())
}

/// Returns the end of a message about an unknown name, as `; did you mean stiffness?`; empty if no accepted name is
/// near. A name is near if at most two letters are added, left out or changed, or two neighbours swapped.
pub fn did_you_mean(name: &str, names: &[&str]) -> String {
    let near = names.iter().map(|other| (letters_apart(name, other), *other));
    let near = near.filter(|(apart, other)| *apart <= 2 && 2 * apart <= name.len().max(other.len()));
    // Another number is no slip of the finger.
    let letters = |name: &str| name.replace(|letter: char| letter.is_ascii_digit(), "");
    let near = near.filter(|(_, other)| letters(name) != letters(other));
    near.min_by_key(|(apart, _)| *apart).map_or(String::new(), |(_, other)| format!("; did you mean {other}?"))
}

/// Returns the fewest letters to add, leave out or change, or neighbours to swap, that make one name of another.
fn letters_apart(one: &str, other: &str) -> usize {
    let (one, other): (Vec<char>, Vec<char>) = (one.chars().collect(), other.chars().collect());
    let mut apart = vec![vec![0; other.len() + 1]; one.len() + 1];
    for i in 0..=one.len() {
        for j in 0..=other.len() {
            apart[i][j] = match (i, j) {
                (0, _) | (_, 0) => i + j,
                _ => {
                    let changed = apart[i - 1][j - 1] + usize::from(one[i - 1] != other[j - 1]);
                    (apart[i - 1][j] + 1).min(apart[i][j - 1] + 1).min(changed)
                }
            };
            if i > 1 && j > 1 && one[i - 1] == other[j - 2] && one[i - 2] == other[j - 1] {
                apart[i][j] = apart[i][j].min(apart[i - 2][j - 2] + 1);
            }
        }
    }
    apart[one.len()][other.len()]
}

/// The lines and columns of a text. Asking for many places takes a time that is linear in the text, even where the text
/// is one line.
pub struct Lines<'t> {
    text: &'t [u8],
    /// Line and column, from 1, at every [`STRIDE`]th byte.
    marks: Vec<(usize, usize)>,
}

/// Bytes between two marks, the most that are looked at for a place.
const STRIDE: usize = 256;

impl<'t> Lines<'t> {
    /// Reads a text.
    pub fn new(text: &'t str) -> Self {
        let text = text.as_bytes();
        let (mut marks, mut at) = (Vec::new(), (1, 1));
        for chunk in text.chunks(STRIDE) {
            marks.push(at);
            at = after(at, chunk);
        }
        Self { text, marks }
    }

    /// Returns the line and the column of a byte, from 1; those of the end for a byte behind it.
    pub fn place(&self, byte: usize) -> (usize, usize) {
        let byte = byte.min(self.text.len());
        let Some(last) = self.marks.len().checked_sub(1) else { return (1, 1) };
        let mark = (byte / STRIDE).min(last);
        after(self.marks[mark], &self.text[mark * STRIDE..byte])
    }
}

/// Returns line and column after these bytes. Bytes that go on with a character have no column of their own.
fn after(at: (usize, usize), bytes: &[u8]) -> (usize, usize) {
    bytes.iter().fold(at, |(line, column), byte| match byte {
        b'\n' => (line + 1, 1),
        0x80..=0xbf => (line, column),
        _ => (line, column + 1),
    })
}

#[cfg(test)]
mod tests {
    use super::{Lines, did_you_mean, excerpt, letters_apart, number, number_above, number_below};

    #[test]
    fn a_name_is_near_to_those_that_two_letters_make_of_it() {
        for (one, other, apart) in [
            ("stiffness", "stiffness", 0),
            ("stifness", "stiffness", 1),
            ("hybird", "hybrid", 1),
            ("conventionel", "conventional", 1),
            ("kidn", "kind", 1),
            ("truncating_multipler", "truncating_multiplier", 1),
            ("hbyird", "hybrid", 2),
            ("", "to", 2),
            ("clock", "shaper", 6),
        ] {
            assert_eq!((letters_apart(one, other), letters_apart(other, one)), (apart, apart), "{one} {other}");
        }
        let names = ["position", "stiffness", "damping", "to"];
        assert_eq!(did_you_mean("stifness", &names), "; did you mean stiffness?");
        for far in ["stiff", "zzz", "", "x", "dampner_"] {
            assert_eq!(did_you_mean(far, &names), "", "{far}");
        }
        assert_eq!(did_you_mean("FPGA-800", &["FPGA-100", "FPGA-400"]), "");
    }

    #[test]
    fn numbers_are_short_and_never_zero_unless_they_are() {
        for (value, text) in [
            (0.0, "0"),
            (-0.25, "-0.25"),
            (1.0 / 3.0, "0.3333333333333333"),
            (1e-4, "0.0001"),
            (1.5e-9, "1.5e-9"),
            (25_175_001.0, "25175001"),
            (1e300, "1e300"),
            (f64::MAX, "1.7976931348623157e308"),
            (5e-324, "5e-324"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn what_is_accepted_is_rounded_to_the_side_that_is() {
        for value in [2.0 / 3.0, 1.0 / 3.0, 4_294_967_295.0, 1.234_567_89e-20, 7.0] {
            let read = |text: String| text.parse::<f64>().unwrap();
            let (below, above) = (read(number_below(value)), read(number_above(value)));
            assert!(below <= value && above >= value, "{below} {value} {above}");
            assert!(below > value * (1.0 - 3e-6) && above < value * (1.0 + 3e-6), "{below} {value} {above}");
        }
    }

    #[test]
    fn places_are_those_of_a_count_from_the_beginning() {
        let long = "é".repeat(300) + "\n" + &"x".repeat(1000);
        for text in ["", "\n", "a", "ab\ncd\n\n", "é\nüß€ x\n", &long, &"\n".repeat(600)] {
            let lines = Lines::new(text);
            for byte in (0..=text.len() + 3).filter(|byte| text.is_char_boundary((*byte).min(text.len()))) {
                let before = &text[..byte.min(text.len())];
                let line = before.matches('\n').count() + 1;
                let column = before.rsplit('\n').next().map_or(0, |line| line.chars().count()) + 1;
                assert_eq!(lines.place(byte), (line, column), "byte {byte}");
            }
        }
    }

    #[test]
    fn long_text_is_cut() {
        assert_eq!(excerpt("1.5 N"), "1.5 N");
        assert_eq!(excerpt(&"é".repeat(300)).chars().count(), 63);
    }
}
