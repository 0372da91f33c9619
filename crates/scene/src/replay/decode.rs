//! The text of a recording, whatever its coding, and what a file that is no text is.

use std::borrow::Cow;

use super::{CUT, ReplayError};

/// How files that are no text begin, what they are, and what to do.
const NO_TEXT: [(&[u8], &str); 11] = [
    (b"\x1f\x8b", "compressed (gzip); unpack it first"),
    (b"\x28\xb5\x2f\xfd", "compressed (zstd); unpack it first"),
    (b"BZh", "compressed (bzip2); unpack it first"),
    (b"\xfd7zXZ", "compressed (xz); unpack it first"),
    (b"PK\x03\x04", "a zip archive, as sigrok's .sr and Excel's .xlsx; export VCD or CSV"),
    (b"\xd0\xcf\x11\xe0", "a binary table, as Excel's .xls; export CSV"),
    (b"GHDLwave", "GHW; let GHDL write --vcd=FILE or --fst=FILE"),
    (b"\x89HDF", "HDF5; export CSV"),
    (b"MATLAB 5.0 MAT-file", "a MAT file; export CSV, as by writetable"),
    (b"TDSm", "TDMS; export CSV"),
    (b"<SALEAE>", "Saleae's binary export; export CSV"),
];

/// Returns the text of a file: UTF-8, UTF-16 with its byte order mark, or else Latin-1. Lines may end as on the old
/// Macintosh, with carriage returns alone.
///
/// # Errors
///
/// [`ReplayError`] that tells what a binary file is.
pub(super) fn text(bytes: &[u8]) -> Result<Cow<'_, str>, ReplayError> {
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => Cow::Owned(utf16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Cow::Owned(utf16(rest, u16::from_be_bytes)),
        _ => {
            let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            let known = NO_TEXT.iter().find(|(begin, _)| bytes.starts_with(begin));
            let binary = || bytes.contains(&0).then_some("a binary file; export VCD, FST or CSV");
            if let Some(what) = known.map(|(_, what)| *what).or_else(binary) {
                return Err(ReplayError::new(0, format!("not text, but {what}")));
            }
            let latin_1 = |_| Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect());
            std::str::from_utf8(bytes).map_or_else(latin_1, Cow::Borrowed)
        }
    };
    let has_returns_alone = text.contains('\r') && !text.contains('\n');
    Ok(if has_returns_alone { Cow::Owned(text.replace('\r', "\n")) } else { text })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|read| read.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Tells of a refusal in a last line without a line feed that the file may be cut short there.
pub(super) fn or_cut<T>(text: &str, read: Result<T, ReplayError>) -> Result<T, ReplayError> {
    read.map_err(|error| {
        let lines = text.bytes().filter(|byte| *byte == b'\n').count() as u64;
        match is_open(text) && error.line == lines + 1 {
            true => ReplayError::new(error.line, format!("{CUT}: {}", error.reason)),
            false => error,
        }
    })
}

/// Returns a note about a text whose last line is read without its line feed: its last number may be cut.
pub(super) fn note(text: &str) -> Option<String> {
    is_open(text).then(|| CUT.to_string())
}

fn is_open(text: &str) -> bool {
    !text.is_empty() && !text.ends_with('\n')
}
