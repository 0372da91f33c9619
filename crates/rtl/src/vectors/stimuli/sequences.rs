//! Directed stimuli that need many edges in a row: computations from a start to their end, motions of an encoder.

use hpu_signal::Signal;

use super::{corners, edge, one_by_one, product, reset};
use crate::Stimulus;

/// Returns rows for sequential computations: every corner of each operand against those of the others. Each computation
/// has time to end within that many edges.
pub(super) fn computations(inputs: &[Signal], latency: i64) -> Vec<Stimulus> {
    let lists: Vec<_> = inputs[1..].iter().map(|signal| corners(signal.format)).collect();
    let edges = latency + 2;
    let row = |start: bool, operands: &[i64]| [&[i64::from(start)], operands].concat();
    let run = |operands: Vec<i64>| (0..edges).map(move |passed| edge(row(passed == 0, &operands)));
    let runs = product(&lists).into_iter().flat_map(run);
    [reset(vec![1; inputs.len()])].into_iter().chain(runs).collect()
}

/// Returns rows for blocks whose last input tells the edges that sample: every corner of each other input is sampled
/// once, and then stays until the next sample, `edges` edges later.
pub(super) fn strobed(inputs: &[Signal], edges: i64) -> Vec<Stimulus> {
    let lists: Vec<_> = inputs[..inputs.len() - 1].iter().map(|signal| corners(signal.format)).collect();
    let run = |words: Vec<i64>| (0..edges).map(move |passed| edge([&words[..], &[i64::from(passed == 0)]].concat()));
    [reset(vec![1; inputs.len()])].into_iter().chain(one_by_one(&lists).into_iter().flat_map(run)).collect()
}

/// Returns whether the block estimates a velocity: its inputs are a position and at most the sample period.
pub(super) fn is_estimator(inputs: &[Signal]) -> bool {
    inputs[0].name == "position" && inputs[1..].iter().all(|signal| signal.name == "period")
}

/// Speeds in eighths of a count a sample, each for a while: slow and fast, bends, reversals, standstill.
const SPEEDS: [i128; 14] = [8, 1, 3, -2, 17, 0, 5, -11, -20, 24, 40, -40, 7, 0];

/// Returns motions through the position at which the counter wraps, at short sample periods.
pub(super) fn motions(inputs: &[Signal]) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for period in [1, 3] {
        rows.push(reset(vec![0; inputs.len()]));
        let mut eighths = -60;
        for speed in SPEEDS {
            for _ in 0..40 {
                eighths += speed;
                let position = inputs[0].format.wrap(i128::div_euclid(eighths, 8));
                let row: Vec<_> = [position].into_iter().chain(inputs[1..].iter().map(|_| period)).collect();
                rows.extend(vec![edge(row); period as usize]);
            }
        }
    }
    rows
}
