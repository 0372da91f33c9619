//! SHA-256 in hexadecimal digits.

use std::env;
use std::fs::File;
use std::io::Read;

use sha2::{Digest, Sha256};

use crate::exit::Failure;

/// The number of bytes of this program that are read at a time.
const PART_BYTES: usize = 1 << 16;

/// Returns bytes in hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the SHA-256 of bytes.
pub fn of(bytes: impl AsRef<[u8]>) -> String {
    hex(&Sha256::digest(bytes))
}

/// Returns the SHA-256 of this program.
pub fn this_program() -> Result<String, Failure> {
    let sum = env::current_exe().and_then(File::open).and_then(|mut program| {
        let (mut hash, mut part) = (Sha256::new(), Vec::with_capacity(PART_BYTES));
        while program.by_ref().take(PART_BYTES as u64).read_to_end(&mut part)? > 0 {
            hash.update(&part);
            part.clear();
        }
        Ok(hex(&hash.finalize()))
    });
    sum.map_err(|error| Failure::file(format!("this program cannot read itself: {error}")))
}
