#![doc = include_str!("../README.md")]

/// Paths and texts of all files, in the order of paths.
pub const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Returns the text of a file.
///
/// # Panics
///
/// When no file has this path. In a constant, that is an error of the compiler.
pub const fn text(path: &str) -> &'static str {
    let mut rest = FILES;
    while let [(name, text), others @ ..] = rest {
        if is_same(name.as_bytes(), path.as_bytes()) {
            return text;
        }
        rest = others;
    }
    panic!("no such file in crates/assets/files; testbench/assets.sh copies it there")
}

/// Compares two names: `==` of slices is no constant function yet.
const fn is_same(mut one: &[u8], mut other: &[u8]) -> bool {
    if one.len() != other.len() {
        return false;
    }
    while let ([a, one_rest @ ..], [b, other_rest @ ..]) = (one, other) {
        if *a != *b {
            return false;
        }
        (one, other) = (one_rest, other_rest);
    }
    true
}
