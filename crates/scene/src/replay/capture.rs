//! Captures of two encoder lines, whatever the format of their file.

use super::channel::Capture;
#[cfg(not(target_family = "wasm"))]
use super::fst;
use super::{ReplayError, logic_table, vcd};

/// Reads two channels of a recording: VCD, FST, or a table of levels as Saleae Logic, PulseView and sigrok write it.
/// The format is that of the content; a page in a browser takes files as text, and so no FST.
///
/// A channel is named as in the file, or with its scopes (`libsigrok.D0`) when several have the name. A bit of a vector
/// has its index behind the name (`ab[1]`, `ab(1)`). The first element holds the levels at the beginning of the
/// recording, every other a change; changes of both lines at one time are one element. Changes at one time are taken as
/// simultaneous, so a pulse of no duration does not exist.
///
/// A level that is unknown at the beginning (`x`, `z`, `U`) is that of the first known one, so the end of a simulated
/// reset is no edge. A line without any level is 0. While a recording is switched off (`$dumpoff`), lines keep their
/// levels.
///
/// # Errors
///
/// [`ReplayError`] for a file of another format, a missing, ambiguous or wide channel (listed with the existing ones),
/// a level that is unknown after a known one, time running backwards, a time beyond 2^63 ps, and a last line of a text
/// without its line feed.
pub fn read_capture(bytes: &[u8], channel_a: &str, channel_b: &str) -> Result<Capture, ReplayError> {
    let names = [channel_a, channel_b];
    #[cfg(not(target_family = "wasm"))]
    if fst::is_one(bytes) {
        return fst::read(bytes, names);
    }
    super::whole(bytes)?;
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    match first {
        None | Some(b'$') => vcd::read(bytes, names),
        Some(_) => logic_table::read(bytes, names),
    }
}
