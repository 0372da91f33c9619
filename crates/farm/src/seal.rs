//! The checksum of a file, in the file's own metadata.
//!
//! The value of the key [`SEAL`] is the SHA-256 of all bytes of the file, in which the value itself is [`UNSEALED`]. So
//! a single bit that was changed anywhere is found: also in headers and statistics of pages, which a reader may pass
//! over.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};

use sha2::{Digest, Sha256};

/// The key of the checksum in the metadata.
pub const SEAL: &str = "hpu.sum";

/// The value of [`SEAL`] before the file is sealed: as long as a checksum.
pub const UNSEALED: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// The end of every Parquet file.
const MAGIC: &[u8] = b"PAR1";

/// The damage of a sealed file.
#[derive(Debug)]
pub enum Damage {
    /// It does not end as a Parquet file does.
    Truncated,
    /// It has no seal.
    Unsealed,
    /// Its bytes are not those that were sealed.
    Changed,
    /// It cannot be read.
    Io(io::Error),
}

impl From<io::Error> for Damage {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Writes the checksum into a complete file, and returns it.
///
/// # Errors
///
/// Returns a [`Damage`] if this is no file that can be sealed.
pub fn seal(file: &mut File) -> Result<String, Damage> {
    let place = place(file)?;
    let sum = sum(file, place)?;
    file.seek(SeekFrom::Start(place))?;
    file.write_all(sum.as_bytes())?;
    Ok(sum)
}

/// Returns the checksum of a sealed file after it was compared with the bytes.
///
/// # Errors
///
/// Returns a [`Damage`] if they differ.
pub fn unseal(file: &mut File) -> Result<String, Damage> {
    let place = place(file)?;
    file.seek(SeekFrom::Start(place))?;
    let mut sealed = [0; UNSEALED.len()];
    file.read_exact(&mut sealed)?;
    let sum = sum(file, place)?;
    if sum.as_bytes() == sealed { Ok(sum) } else { Err(Damage::Changed) }
}

/// Returns where the checksum stands in the file.
fn place(file: &mut File) -> Result<u64, Damage> {
    let length = file.seek(SeekFrom::End(0))?;
    let mut end = [0; 8];
    if length < 12 {
        return Err(Damage::Truncated);
    }
    file.seek(SeekFrom::Start(length - 8))?;
    file.read_exact(&mut end)?;
    let footer = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
    if &end[4..] != MAGIC || footer + 12 > length {
        return Err(Damage::Truncated);
    }
    let mut bytes = vec![0; footer as usize];
    file.seek(SeekFrom::Start(length - 8 - footer))?;
    file.read_exact(&mut bytes)?;
    // Key and value of the metadata in Thrift's compact form: the value is field 2, a text of 64 bytes.
    let pattern: Vec<u8> = SEAL.bytes().chain([0x18, UNSEALED.len() as u8]).collect();
    let found = bytes.windows(pattern.len()).rposition(|window| window == pattern).ok_or(Damage::Unsealed)?;
    if found + pattern.len() + UNSEALED.len() > bytes.len() {
        return Err(Damage::Unsealed);
    }
    Ok(length - 8 - footer + (found + pattern.len()) as u64)
}

/// Returns the SHA-256 of the file with [`UNSEALED`] at the checksum's place.
fn sum(file: &mut File, place: u64) -> Result<String, Damage> {
    file.seek(SeekFrom::Start(0))?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    let mut read = 0;
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            break;
        }
        for (at, zero) in UNSEALED.bytes().enumerate() {
            if let Some(byte) = (place + at as u64).checked_sub(read).filter(|at| *at < count as u64) {
                buffer[byte as usize] = zero;
            }
        }
        hash.update(&buffer[..count]);
        read += count as u64;
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
