//! Rows for the blocks of field-oriented control: whole periods of a carrier, streams of bits, whole words on a line.

use hpu_cosim::SplitMix64;
use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use super::{LONGEST, corners, edge, generic, reset};
use crate::Stimulus;

/// Returns rows for a modulator of three legs: from a reset, corners of its duties, and those around its least pulse,
/// each for more than a period, with and without `enable`.
pub(super) fn carriers(block: &dyn AnyBlock, inputs: &[Signal]) -> Vec<Stimulus> {
    let of = |name: &str| generic(block, name).expect("a generic of the modulator");
    let [steps, least] = [of("STEPS"), of("MIN_PULSE")];
    let format = inputs[0].format;
    let near = [least - 1, least, steps - least, steps - least + 1, steps / 2, steps, steps + 1];
    let duties: Vec<_> =
        corners(format).into_iter().chain(near.into_iter().filter(|duty| format.holds((*duty).into()))).collect();
    let stay = (2 * steps + steps / 3).min(LONGEST) as usize;
    // Of a long carrier fewer duties: each takes thousands of rows.
    let every = 1 + duties.len() * stay / LONGEST as usize;
    let mut rows = Vec::new();
    for turn in (0..duties.len()).step_by(every) {
        let duty = |leg: usize| duties[(turn + 3 * leg) % duties.len()];
        let row = |enable: i64| vec![duty(0), duty(1), duty(2), enable];
        rows.push(reset(row(1)));
        rows.extend(vec![edge(row(1)); stay]);
        // Off and on again within fewer clocks than a dead time, and for longer.
        for enable in [0, 1, 0, 0, 1, 1] {
            rows.push(edge(row(enable)));
        }
        rows.extend(vec![edge(row(0)); 7]);
        rows.extend(vec![edge(row(1)); stay / 2]);
    }
    rows
}

/// Returns rows for a filter of bits: bits that are all 1, all 0, take turns, and any, for four words each, with and
/// without clocks between them.
pub(super) fn streams(block: &dyn AnyBlock) -> Vec<Stimulus> {
    let random = &mut SplitMix64::new(0);
    let bits = 4 << generic(block, "RATIO_WIDTH").expect("a generic of the filter");
    let mut rows = Vec::new();
    for kind in 0..4 {
        rows.push(reset(vec![1, 1]));
        for bit in 0..bits {
            let data = [1, 0, bit % 2, i64::from(random.one_in(3))][kind];
            rows.push(edge(vec![data, 1]));
            if bit % 5 == 2 {
                rows.push(edge(vec![1 - data, 0]));
            }
        }
    }
    rows
}

/// Returns the edges from a start of a serial interface to the end of its frame, and of the gap behind it; `None` for
/// another block.
pub(super) fn frame(block: &dyn AnyBlock) -> Option<i64> {
    let of = |name: &str| generic(block, name).unwrap_or(0);
    let edges = match block.name() {
        "spi_master" => 2 * of("WIDTH") - 1,
        "ssi_master" => 2 * of("WIDTH") + 1,
        _ => return None,
    };
    Some(edges * of("DIVIDER") + of("LEAD") + of("TRAIL") + of("GAP") + of("PAUSE") + 1)
}

/// Returns rows for a serial interface: frames of all zeros, all ones and any bits, both ways, one after the other.
/// Where a frame is under way, starts are ignored.
pub(super) fn frames(block: &dyn AnyBlock, inputs: &[Signal]) -> Vec<Stimulus> {
    let random = &mut SplitMix64::new(0);
    let edges = frame(block).expect("a serial interface");
    let mut rows = vec![reset(vec![1; inputs.len()])];
    for kind in 0..6 {
        let mut row: Vec<_> = inputs.iter().map(|signal| signal.format.wrap([0, -1, 0][kind % 3])).collect();
        for passed in 0..=edges {
            row[0] = i64::from(passed == 0 || kind > 2 && random.one_in(9));
            let line = row.len() - 1;
            row[line] = [0, 1, i64::from(random.one_in(2))][kind % 3];
            if row.len() > 2 && kind % 3 == 2 {
                row[1] = inputs[1].format.from_bits(random.next_u64());
            }
            rows.push(edge(row.clone()));
        }
    }
    rows
}
