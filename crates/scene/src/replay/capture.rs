//! Captures of two encoder lines, whatever the format of their file.

use super::channel::Capture;
use super::columns::Columns;
use super::decode::{self, or_cut};
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
/// reset is no edge. While a recording is switched off (`$dumpoff`), lines keep their levels. `columns` names the
/// column of the times of a table, and its separator, where the header does not tell them.
///
/// # Errors
///
/// [`ReplayError`] for a file of another format, a missing, ambiguous or wide channel (listed with the existing ones),
/// a channel without any known level, a level that is unknown after a known one, a cell that is no level, time running
/// backwards or without a unit, a time beyond 2^63 ps, and a last line that is cut.
pub fn read_capture(bytes: &[u8], channel_a: &str, channel_b: &str, columns: &Columns) -> Result<Capture, ReplayError> {
    let names = [channel_a, channel_b];
    let no_columns = |format: &str| match columns == &Columns::default() {
        true => Ok(()),
        false => Err(ReplayError::new(0, format!("time and delimiter are keys of a table, and this file is {format}"))),
    };
    #[cfg(not(target_family = "wasm"))]
    if fst::is_one(bytes) {
        no_columns("FST")?;
        return fst::read(bytes, names);
    }
    let text = decode::text(bytes)?;
    let read = match text.trim_start().starts_with('$') || text.trim().is_empty() {
        true => no_columns("VCD").and_then(|()| vcd::read(text.as_bytes(), names)),
        false => logic_table::read(&text, names, columns),
    };
    or_cut(&text, read).map(|capture| Capture { notes: Vec::from_iter(decode::note(&text)), ..capture })
}
