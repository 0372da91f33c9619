//! The table of `hpu widths` for spreadsheets.

use std::fmt::Write as _;

use hpu_signal::Clock;
use hpu_study::widths::Loss;

use crate::widths::Page;
use crate::widths::proved::how;

/// The columns of the table.
const COLUMNS: &str = "signal,format,unit,measured_min,measured_max,proved_min,proved_max,how,never_overflows,idle_bits,\
                       rounded_edges,rounded_worst,rounded_first_s,overflowed_edges,overflowed_worst,overflowed_first_s,\
                       sqnr_db,needs";

/// Returns a line for every signal. Values are in the signal's unit; unknown ones are empty.
pub fn table(page: &Page) -> String {
    let mut text = format!("{COLUMNS}\n");
    let seconds = |loss: &Loss| {
        let clock = Clock::new(page.clock_hz).ok();
        loss.first.zip(clock).map_or_else(String::new, |(first, clock)| clock.seconds(first).to_string())
    };
    for row in &page.measured.rows {
        let bound = page.proved.as_ref().ok().and_then(|proved| proved.of(row.name));
        let ends = row.measured.map(|(min, max)| (row.format.to_f64(min), row.format.to_f64(max)));
        let number = |value: Option<f64>| value.filter(|v| !v.is_nan()).map_or_else(String::new, |v| v.to_string());
        let worst = |loss: &Loss| number((loss.edges > 0).then_some(loss.worst));
        let cells = [
            row.name.to_string(),
            format!("\"{}\"", row.format),
            row.unit.to_string(),
            number(ends.map(|ends| ends.0)),
            number(ends.map(|ends| ends.1)),
            number(bound.map(|bound| bound.min)),
            number(bound.map(|bound| bound.max)),
            bound.map_or("", |bound| how(bound.how)).to_string(),
            bound.map_or_else(String::new, |bound| bound.never_overflows.to_string()),
            row.headroom_bits.to_string(),
            row.rounded.edges.to_string(),
            worst(&row.rounded),
            seconds(&row.rounded),
            row.overflowed.edges.to_string(),
            worst(&row.overflowed),
            seconds(&row.overflowed),
            number(row.sqnr_db),
            row.recommended.map_or_else(String::new, |format| format!("\"{format}\"")),
        ];
        writeln!(text, "{}", cells.join(",")).expect("a string grows");
    }
    text
}
