//! The part of a run that a verdict judges, in rows and clock edges.

use std::ops::Range;

use hpu_signal::Clock;

/// Returns the rows that a verdict judges: the last 30 % of `rows` rows, without those before row `still`, from which
/// on the hand stands still. If the hand leaves [too little](is_enough), the last 30 % are returned.
pub fn window(rows: u64, still: u64) -> Range<u64> {
    let usual = rows - tenths(rows, 3).max(2).min(rows);
    if is_enough(rows, still) { usual.max(still)..rows } else { usual..rows }
}

/// Whether a motion can be judged: the hand stands still for at least the last 10 % of `rows` rows.
pub fn is_enough(rows: u64, still: u64) -> bool {
    still == 0 || still <= rows.saturating_sub(tenths(rows, 1).max(2))
}

fn tenths(rows: u64, count: u64) -> u64 {
    (u128::from(rows) * u128::from(count) / 10) as u64
}

/// Returns the clock edges from one row of a trace at this rate to the next; at least 1.
pub fn stride(clock: Clock, rate_hz: f64) -> u64 {
    clock.edges(1.0 / rate_hz).max(1)
}

/// Returns the first clock edge of the judged window of a run of `edges` edges, with a row every `stride` edges, whose
/// hand stands still from edge `still` on.
pub fn window_start(edges: u64, stride: u64, still: u64) -> u64 {
    window(edges / stride + 1, still.div_ceil(stride)).start * stride
}
