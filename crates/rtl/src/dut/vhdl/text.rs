//! The text of VHDL as tokens.

/// Returns the text of a file with spaces in place of comments. Positions in it are those of the file, so a byte that
/// is no ASCII becomes a question mark.
pub(super) fn plain(content: &[u8]) -> String {
    let mut text: String = content.iter().map(|&byte| if byte.is_ascii() { char::from(byte) } else { '?' }).collect();
    let mut blank = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let rest = &text[at..];
        let length = if rest.starts_with("--") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else {
            at += length(&text, at);
            continue;
        };
        blank.push(at..at + length);
        at += length;
    }
    for comment in blank {
        let lines: String = text[comment.clone()].chars().map(|c| if c == '\n' { c } else { ' ' }).collect();
        text.replace_range(comment, &lines);
    }
    text
}

/// A token: a word or a number, a text, a character, or a sign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Token<'t> {
    /// Its position.
    pub(super) at: usize,
    pub(super) text: &'t str,
}

impl Token<'_> {
    /// Returns the position behind it.
    pub(super) fn end(&self) -> usize {
        self.at + self.text.len()
    }

    /// Returns whether it is this word or sign.
    pub(super) fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word)
    }

    /// Returns whether it is an identifier, a keyword or a number.
    pub(super) fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '\\')
    }
}

/// Returns the tokens of a text without comments.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let (mut all, mut at) = (Vec::new(), 0);
    while at < text.len() {
        let length = length(text, at);
        let token = &text[at..at + length];
        if !token.trim().is_empty() {
            all.push(Token { at, text: token });
        }
        at += length;
    }
    all
}

/// Returns the length of the token, or of the blank, at a position.
fn length(text: &str, at: usize) -> usize {
    let rest = &text[at..];
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let closed = |end: char| rest[1..].find([end, '\n']).map_or(rest.len(), |length| length + 2);
    match rest.chars().next() {
        Some(c) if is_part(c) => rest.find(|c| !is_part(c)).unwrap_or(rest.len()),
        Some('"') => closed('"'),
        Some('\\') => closed('\\'),
        // Behind a name, the quote is that of an attribute or of a qualified expression.
        Some('\'')
            if rest.as_bytes().get(2) == Some(&b'\'')
                && !text[..at].trim_end().ends_with(|c: char| is_part(c) || ")]\\".contains(c)) =>
        {
            3
        }
        Some(':') if rest.starts_with(":=") => 2,
        _ => 1,
    }
}

/// Returns the index of the token that closes the bracket at an index.
pub(super) fn closing(tokens: &[Token], open: usize) -> Option<usize> {
    let mut depth = 0_usize;
    for (index, token) in tokens.iter().enumerate().skip(open) {
        match token.text {
            "(" => depth += 1,
            ")" => {
                depth = depth.checked_sub(1)?;
                if depth == 0 {
                    return Some(index);
                }
            }
            _ if depth == 0 => return None,
            _ => {}
        }
    }
    None
}

/// Splits tokens at a sign wherever it stands outside brackets. Parts without a token are left out.
pub(super) fn split<'a, 't>(tokens: &'a [Token<'t>], at: &str) -> Vec<&'a [Token<'t>]> {
    let (mut depth, mut begin, mut parts) = (0_i32, 0, Vec::new());
    for (index, token) in tokens.iter().enumerate() {
        match token.text {
            "(" => depth += 1,
            ")" => depth -= 1,
            sign if sign == at && depth == 0 => {
                parts.push(&tokens[begin..index]);
                begin = index + 1;
            }
            _ => {}
        }
    }
    parts.push(&tokens[begin..]);
    parts.retain(|part| !part.is_empty());
    parts
}

/// Returns the text from the first to the last of some tokens, on one line.
pub(super) fn joined(text: &str, tokens: &[Token]) -> String {
    let Some((first, last)) = tokens.first().zip(tokens.last()) else { return String::new() };
    text[first.at..last.end()].replace(['\n', '\r'], " ")
}
