//! Tries every input of the combinational blocks whose proved inputs are few.

use hpu_cosim::scene::Scene;
use hpu_cosim::{AxisSimulation, Wired};
use hpu_datapath::Instance;

use super::{Bound, How, Proof};
use crate::Error;
use crate::exact::Exact;
use hpu_signal::Span;

/// The most inputs of one block that are ever tried.
pub const MOST_INPUTS: u128 = 1 << 26;

/// Tries the combinational blocks with at most `most` inputs, and at most [`MOST_INPUTS`]. Returns the nets that they
/// drive, with the range found and, for blocks that narrow exact inputs, the error. Inputs take all values that `proof`
/// allows, each independently.
///
/// # Errors
///
/// When the scene makes no datapath.
pub fn exhausted(scene: &Scene, proof: &Proof, most: u128) -> Result<Vec<Bound>, Error> {
    let simulation = AxisSimulation::new(scene)?;
    let instances = simulation.wiring().instances().into_iter().filter(answers_at_once);
    Ok(instances.flat_map(|instance| tried(instance, &proof.bounds, most.min(MOST_INPUTS))).collect())
}

/// Returns whether a block has no registers, either by its kind or, for a limiter, in this configuration.
fn answers_at_once(instance: &Instance) -> bool {
    instance.model.equations().is_some_and(|edge| edge.registers.is_empty())
}

/// Returns the words that a bound allows.
fn words(bound: &Bound) -> Span {
    let word = |value: f64| (value / bound.format.lsb()) as i128;
    Span::new(word(bound.min), word(bound.max))
}

/// Returns the outputs of one block over all its inputs; empty when there are too many.
fn tried(mut instance: Instance, bounds: &[Bound], most: u128) -> Vec<Bound> {
    let count = instance.model.inputs().len();
    let (inputs, outputs) = instance.connections.split_at(count);
    let ranges: Vec<Span> = inputs.iter().map(|input| words(&bounds[input.net])).collect();
    let size = |range: &Span| (range.max - range.min + 1).unsigned_abs();
    if ranges.iter().map(size).try_fold(1u128, u128::checked_mul).is_none_or(|all| all > most) {
        return Vec::new();
    }
    // A block's own losses are known only if all of its inputs are exact.
    let are_exact = inputs.iter().all(|input| bounds[input.net].error == Some(0.0));
    let equations = instance.model.equations().filter(|_| are_exact).map(|edge| edge.recorded());
    let mut word: Vec<i64> = ranges.iter().map(|range| range.min as i64).collect();
    let mut seen: Vec<Option<(i64, i64)>> = vec![None; outputs.len()];
    let mut worst = vec![Exact::of(0).losses(); outputs.len()];
    loop {
        let answer = instance.model.tick(&word);
        for (seen, &out) in seen.iter_mut().zip(&answer) {
            *seen = Some(seen.map_or((out, out), |(least, most)| (least.min(out), most.max(out))));
        }
        if let Some(equations) = &equations {
            let given = inputs.iter().zip(&word).map(|(input, &word)| Exact::of(input.port.format.value(word)));
            let read = equations.read(&given.collect::<Vec<_>>());
            worst.iter_mut().zip(read).for_each(|(worst, made)| *worst = worst.worse(made.losses()));
        }
        // Moves to the next input; the last one changes fastest.
        let Some(at) = (0..count).rev().find(|&at| i128::from(word[at]) < ranges[at].max) else { break };
        word[at] += 1;
        for later in at + 1..count {
            word[later] = ranges[later].min as i64;
        }
    }
    let row = |index: usize| {
        let (output, worst) = (&outputs[index], worst[index]);
        let (proved, format) = (&bounds[output.net], output.port.format);
        let (least, most) = seen[index]?;
        // The inputs depend on each other in ways that the block alone does not show.
        let (min, max) = (format.to_f64(least).max(proved.min), format.to_f64(most).min(proved.max));
        let mut bound = Bound { how: How::Exhausted, min, max, ..proved.clone() };
        if worst.narrows {
            bound.error = (!worst.wraps).then_some(worst.rounded * format.lsb());
            bound.never_overflows = worst.beyond == 0.0;
        }
        Some(bound)
    };
    (0..outputs.len()).filter_map(row).collect()
}
