//! Tries every input of a block.

use hpu_datapath::AnyBlock;
use hpu_signal::{Equations, Format};

use crate::exact::{Exact, Losses};

/// The outputs of a block over all tried inputs.
pub struct Tried {
    /// The least and the greatest word of each output.
    pub seen: Vec<Option<(i64, i64)>>,
    /// The worst losses of each output; none without equations.
    pub worst: Vec<Losses>,
}

/// Tries a block on all words of these ranges, one a port, each independently. The equations, if there are any, tell
/// the losses.
pub fn tried_all(
    block: &mut dyn AnyBlock,
    ranges: &[(Format, [i64; 2])],
    outputs: usize,
    equations: Option<&Equations>,
) -> Tried {
    let mut word: Vec<i64> = ranges.iter().map(|(_, [least, _])| *least).collect();
    let mut seen: Vec<Option<(i64, i64)>> = vec![None; outputs];
    let mut worst = vec![Exact::of(0).losses(); outputs];
    loop {
        let answer = block.tick(&word);
        for (seen, &out) in seen.iter_mut().zip(&answer) {
            *seen = Some(seen.map_or((out, out), |(least, most)| (least.min(out), most.max(out))));
        }
        if let Some(equations) = &equations {
            let given = ranges.iter().zip(&word).map(|((format, _), &word)| Exact::of(format.value(word)));
            let read = equations.read(&given.collect::<Vec<_>>());
            worst.iter_mut().zip(read).for_each(|(worst, made)| *worst = worst.worse(made.losses()));
        }
        // Moves to the next input; the last one changes fastest.
        let Some(at) = (0..word.len()).rev().find(|&at| word[at] < ranges[at].1[1]) else { break };
        word[at] += 1;
        for later in at + 1..word.len() {
            word[later] = ranges[later].1[0];
        }
    }
    Tried { seen, worst }
}
