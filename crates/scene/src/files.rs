//! Reads files as text, up to a size.

use std::fs::{self, File};
use std::io::{self, Error, ErrorKind, Read};
use std::path::Path;

use crate::schema::source::SceneError;

/// The largest size of a file, in bytes.
const MOST_BYTES: u64 = 256 << 20;

/// Reads a file that a scene names, and unpacks one that gzip has packed. It must be an ordinary file, of at most
/// 256 MiB packed and unpacked, because a device or a pipe might never end.
///
/// # Errors
///
/// As [`std::fs::read`]; also when the file is no ordinary one, or larger.
pub fn read_plain(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "not an ordinary file"));
    }
    let bytes = read(File::open(path)?)?;
    #[cfg(not(target_family = "wasm"))]
    if bytes.starts_with(b"\x1f\x8b") {
        return read(flate2::read::MultiGzDecoder::new(&*bytes));
    }
    Ok(bytes)
}

/// Reads a file of at most 256 MiB as text; it may be a pipe.
///
/// # Errors
///
/// [`SceneError`] with the file's name, and with the line where the file is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    let name = path.display().to_string();
    let bytes = File::open(path).and_then(read).map_err(|error| SceneError::at(&*name, error.to_string()))?;
    text(&name, bytes)
}

/// Reads the standard input as text.
///
/// # Errors
///
/// As [`read_text`].
pub fn read_stdin() -> Result<String, SceneError> {
    let bytes = read(io::stdin()).map_err(|error| SceneError::at("standard input", error.to_string()))?;
    text("-", bytes)
}

fn text(name: &str, bytes: Vec<u8>) -> Result<String, SceneError> {
    utf8(name, &bytes)?;
    Ok(String::from_utf8(bytes).expect("it is UTF-8"))
}

fn read(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        let said = format!("larger than {} MiB", MOST_BYTES >> 20);
        return Err(Error::new(ErrorKind::InvalidInput, said));
    }
    Ok(bytes)
}

/// Returns the bytes of an input of this name as text.
///
/// # Errors
///
/// [`SceneError`] with the line where the first bytes stand that are not UTF-8.
pub fn utf8<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a str, SceneError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
        SceneError::at(format!("{name}:{line}"), "not text in UTF-8")
    })
}
