//! Reads waveforms with another project's parser.

use std::collections::BTreeMap;
use std::io::Cursor;

use wellen::simple::Waveform;

/// Value changes by full name: time in picoseconds, and the value as text.
pub type Changes = BTreeMap<String, Vec<(u64, String)>>;

/// Returns the changes that `wellen` reads.
pub fn changes(file: Vec<u8>) -> Changes {
    let mut waveform = waveform(file);
    let (unit_ps, hierarchy) = (unit_ps(&waveform), waveform.hierarchy());
    let vars: Vec<_> =
        hierarchy.all_vars().map(|var| (hierarchy[var].full_name(hierarchy), hierarchy[var].signal_ref())).collect();
    waveform.load_signals(&vars.iter().map(|(_, signal)| *signal).collect::<Vec<_>>());
    let changes = vars.into_iter().map(|(name, signal)| {
        let signal = waveform.get_signal(signal).expect("just loaded");
        let changes = signal.iter_changes().map(|(index, value)| {
            let text = match value {
                wellen::SignalValueRef::Real(value) => format!("{value:?}"),
                other => other.to_bit_string().expect("bits"),
            };
            (waveform.time_table()[index as usize] * unit_ps, text)
        });
        (name, changes.collect())
    });
    changes.collect()
}

/// Returns the waveform in a file.
pub fn waveform(file: Vec<u8>) -> Waveform {
    wellen::simple::read_from_reader(Cursor::new(file)).expect("a readable waveform")
}

/// Returns a file's unit of time in picoseconds.
pub fn unit_ps(waveform: &Waveform) -> u64 {
    let timescale = waveform.hierarchy().timescale().expect("a timescale");
    let power = timescale.unit.to_exponent().expect("a unit") + 12;
    u64::from(timescale.factor) * 10u64.pow(power.try_into().expect("a picosecond or more"))
}
