//! Vectors recorded from a scene: of its whole loop, and of each block inside it.

use hpu_cosim::{ClosedLoop, LoopVisitor, Wired, World};
use hpu_datapath::{AnyBlock, Instance, Wiring, flatten};

use crate::vector::{Stimulus, Vectors};

/// Returns golden vectors over a scene's first edges, after one edge of reset: first those of the wiring, then those of
/// each instance in it, by label. The vectors of a combinational block have only the rows in which an input has
/// changed.
pub fn scene_vectors(simulation: &impl Wired, edges: u64) -> Vec<(&'static str, Vectors)> {
    simulation.visit(Recorded(edges))
}

/// Visits a loop and records this number of edges.
struct Recorded(u64);

impl<'s> LoopVisitor<'s> for Recorded {
    type Out = Vec<(&'static str, Vectors)>;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        record(wiring, world, input, self.0)
    }
}

fn record<E, W>(wiring: &W, world: E, input: E::In, edges: u64) -> Vec<(&'static str, Vectors)>
where
    E: World,
    W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone,
{
    let constants = flatten(&input);
    let inputs = constants.len();
    let mut run = ClosedLoop::new(wiring.clone(), world, input, u64::MAX);
    let mut instances = wiring.instances();
    // The words that each edge samples: the pins as they are at that edge, all other nets as the edge before has left
    // them.
    let mut sampled = Vec::new();
    let mut before = run.wiring.words().to_vec();
    for _ in 0..edges {
        run.step(&mut ());
        let after = run.wiring.words().to_vec();
        before[..inputs].copy_from_slice(&after[..inputs]);
        sampled.push(std::mem::replace(&mut before, after));
    }
    let rows = |from: &[Input]| -> Vec<Vec<i64>> {
        let word = |words: &[i64], input: &Input| match input {
            Input::Net(net) => words[*net],
            Input::Tied(word) => *word,
        };
        sampled.iter().map(|words| from.iter().map(|input| word(words, input)).collect()).collect()
    };
    let own = rows(&(0..inputs).map(Input::Net).collect::<Vec<_>>());
    let mut all = vec![(W::NAME, clocked(&mut wiring.clone(), constants, own))];
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
