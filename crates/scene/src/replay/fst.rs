//! FST, the format of GTKWave, by the library `fst-reader`.

use std::io::Cursor;

use fst_reader::{FstFilter, FstHierarchyEntry, FstReader, FstSignalHandle, FstSignalValue, is_fst_file};

use super::ReplayError;
use super::channel::{Capture, Lines, Variable, bit_of, find_both, level, range};

/// Returns whether a file is FST.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    is_fst_file(&mut Cursor::new(bytes))
}

/// Reads two channels.
pub(super) fn read(bytes: &[u8], names: [&str; 2]) -> Result<Capture, ReplayError> {
    // The library takes a damaged file's numbers for true, and panics at some of them.
    let read = std::panic::catch_unwind(|| read_whole(bytes, names));
    read.unwrap_or_else(|_| Err(ReplayError::new(0, "not FST: the file is damaged")))
}

fn read_whole(bytes: &[u8], names: [&str; 2]) -> Result<Capture, ReplayError> {
    let refused = |reason: String| ReplayError::new(0, reason);
    let broken = |error: fst_reader::ReaderError| refused(format!("not FST: {error}"));
    let mut reader = FstReader::open(Cursor::new(bytes)).map_err(broken)?;
    let (mut scopes, mut variables) = (Vec::new(), Vec::<Variable<usize>>::new());
    reader
        .read_hierarchy(|entry| match entry {
            FstHierarchyEntry::Scope { name, .. } => scopes.push(name),
            FstHierarchyEntry::UpScope => drop(scopes.pop()),
            FstHierarchyEntry::Var { name, length, handle, .. } => {
                let at = name.find('[').filter(|at| *at > 0);
                let range = at.and_then(|at| range(&name[at..]));
                // A bit that the file has as a variable of its own is named with its index.
                let name = match at.filter(|_| range.is_some()) {
                    Some(at) if length > 1 => name[..at].trim_end().to_string(),
                    Some(_) => name.replace(" [", "["),
                    None => name,
                };
                let path = scopes.iter().map(|scope| format!("{scope}.")).collect::<String>() + &name;
                variables.push(Variable { path, name, range, width: length as usize, code: handle.get_index() });
            }
            _ => {}
        })
        .map_err(broken)?;
    let channels = find_both(&variables, names).map_err(refused)?;
    let header = reader.get_header();
    let femtoseconds = 10_i128.checked_pow(u32::try_from(i32::from(header.timescale_exponent) + 15).unwrap_or(99));
    let femtoseconds = femtoseconds.ok_or_else(|| refused("not FST: no unit of time from 1 fs to 1 s".into()))?;
    let picoseconds = |time: u64| {
        i64::try_from(i128::from(time) * femtoseconds / 1000).map_err(|_| refused(format!("#{time} is beyond 2^63 ps")))
    };
    let filter =
        FstFilter::filter_signals(channels.iter().map(|channel| FstSignalHandle::from_index(channel.code)).collect());
    let (mut changes, mut last) = (Vec::new(), header.start_time);
    let read = reader.read_signals(&filter, |time, handle, value| -> Result<(), ReplayError> {
        let FstSignalValue::String(value) = value else { return Ok(()) };
        for (line, channel) in channels.iter().enumerate().filter(|(_, channel)| channel.code == handle.get_index()) {
            changes.push((time, line, bit_of(value, channel.bit, channel.width)));
        }
        Ok(())
    });
    read.map_err(|error| refused(format!("not FST: {error}")))?;
    // Signals come in blocks of time, one signal after the other in each.
    changes.sort_by_key(|(time, ..)| *time);
    let mut lines = Lines::default();
    lines.to(picoseconds(last)?);
    for (time, line, value) in changes {
        if time > last {
            lines.to(picoseconds(time)?);
            last = time;
        }
        let said = |reason| refused(format!("the level `{}` at #{time} is {reason}", char::from(value)));
        lines.set(line, level(value)).map_err(said)?;
    }
    lines.to(picoseconds(header.end_time.max(last))?);
    lines.ended(names).map_err(refused)
}
