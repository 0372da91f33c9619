//! Text of tools and languages that is read as text: delays of Verilog, headers that Verilator writes.

pub(super) mod cpp;
pub(super) mod delay;
pub(super) mod verilog;

/// Returns Verilog with spaces in the place of its comments and strings; every line keeps its number and every
/// character its place.
pub(super) fn bare(text: &str) -> String {
    let mut bare = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let hidden = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else if c == '"' {
            let mut is_escaped = false;
            let ends = |c: char| {
                let ends = c == '\n' || c == '"' && !is_escaped;
                is_escaped = c == '\\' && !is_escaped;
                ends
            };
            let end = rest[1..].find(ends).map_or(rest.len(), |end| end + 1);
            if rest[end..].starts_with('"') { end + 1 } else { end }
        } else {
            bare.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        bare.extend(rest[..hidden].chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        rest = &rest[hidden..];
    }
    bare
}

/// Iterates over the words of letters, digits, `_` and `$` of a text, with their positions.
pub(super) fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '$';
    let mut at = 0;
    std::iter::from_fn(move || {
        let begin = at + text[at..].find(is_part)?;
        let end = text[begin..].find(|c| !is_part(c)).map_or(text.len(), |length| begin + length);
        at = end;
        Some((begin, &text[begin..end]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_strings_are_blank_and_nothing_moves() {
        let source = "a // b\n\"//\" c /* d\n */ e";
        assert_eq!(bare(source), "a     \n     c     \n    e");
        assert_eq!(bare("a -- // b\n\"c\\\"\" d"), "a --     \n      d");
        assert_eq!(words("n <= #1 n_1+2;").map(|(_, word)| word).collect::<Vec<_>>(), ["n", "1", "n_1", "2"]);
    }
}
