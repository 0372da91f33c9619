//! Vectors recorded from a scene: of its whole loop, and of each block inside it.

use hpu_cosim::{TheLoop, Wired};
use hpu_datapath::{AnyBlock, Instance, configured};

use crate::vectors::vector::{Stimulus, Vectors};

/// Returns golden vectors over a scene's first edges, after one edge of reset: first those of the wiring, then those of
/// each instance in it, by label. The vectors of a combinational block have only the rows in which an input has
/// changed.
pub fn scene_vectors(simulation: &impl Wired, edges: u64) -> Vec<(&'static str, Vectors)> {
    let wiring = simulation.wiring();
    let mut run = simulation.closed_loop();
    let constants = run.constants();
    let inputs = constants.len();
    // The words that each edge samples: of the pins as they are at that edge, and of all other nets as the edge before
    // has left them.
    let mut sampled = Vec::new();
    let mut before = run.wiring().words().to_vec();
    for _ in 0..edges {
        run.step();
        let after = run.wiring().words().to_vec();
        before[..inputs].copy_from_slice(&after[..inputs]);
        sampled.push(std::mem::replace(&mut before, after));
    }
    vectors(wiring, &sampled, constants)
}

/// Returns the vectors of a wiring and of its instances from the words that each edge sampled and the wiring's inputs
/// at the start.
fn vectors(wiring: TheLoop, sampled: &[Vec<i64>], constants: Vec<i64>) -> Vec<(&'static str, Vectors)> {
    let (name, generics) = (wiring.name(), wiring.block().generics());
    let mut whole: Box<dyn AnyBlock> = match wiring {
        TheLoop::Law(law) => Box::new(law.clone()),
        _ => configured(name, &generics).expect("every wiring is listed").expect("the wiring has these generics"),
    };
    let mut instances = wiring.instances();
    let rows = |from: &[Input]| -> Vec<Vec<i64>> {
        let word = |words: &[i64], input: &Input| match input {
            Input::Net(net) => words[*net],
            Input::Tied(word) => *word,
        };
        sampled.iter().map(|words| from.iter().map(|input| word(words, input)).collect()).collect()
    };
    let own = rows(&(0..constants.len()).map(Input::Net).collect::<Vec<_>>());
    let mut all = vec![(name, clocked(&mut *whole, constants, own))];
    for instance in &mut instances {
        let mut rows = rows(&inputs_of(instance));
        let model = &mut *instance.model;
        let vectors = if model.clocked() {
            // During reset an input may reach an output without a register, but the reset of a model sees no inputs.
            clocked(model, vec![0; rows[0].len()], rows)
        } else {
            rows.dedup();
            Vectors::record(model, rows.into_iter().map(|words| Stimulus { rst: false, words }))
        };
        all.push((instance.label, vectors));
    }
    all
}

/// The source of an input's word.
enum Input {
    Net(usize),
    Tied(i64),
}

/// Returns the sources of an instance's inputs, in the order of its ports.
fn inputs_of(instance: &Instance) -> Vec<Input> {
    let of = |name: &str| {
        let tied = instance.tied.iter().find(|(tied, _)| *tied == name).map(|&(_, word)| Input::Tied(word));
        let connected = || instance.connections.iter().find(|connection| connection.port.name == name);
        tied.unwrap_or_else(|| Input::Net(connected().expect("every input is connected or tied").net))
    };
    AnyBlock::inputs(&*instance.model).iter().map(|signal| of(signal.name)).collect()
}

/// Records the rows after one edge of reset.
fn clocked(block: &mut dyn AnyBlock, first: Vec<i64>, rows: Vec<Vec<i64>>) -> Vectors {
    let reset = Stimulus { rst: true, words: first };
    let rows = rows.into_iter().map(|words| Stimulus { rst: false, words });
    Vectors::record(block, std::iter::once(reset).chain(rows))
}
