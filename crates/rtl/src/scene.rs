//! Vectors of a whole loop, recorded from a scene.

use hpu_cosim::{ClosedLoop, Session, TheLoop};
use hpu_datapath::{AnyBlock, Wiring};
use hpu_signal::Ports;

use crate::vector::{Stimulus, Vectors};

/// The wiring's golden vectors over a scene's first edges, after one of reset.
#[must_use]
pub fn scene_vectors(session: &Session, edges: u64) -> Vectors {
    match session.wiring() {
        TheLoop::Hybrid(wiring) => record(wiring, session, edges),
        TheLoop::Conventional(wiring) => record(wiring, session, edges),
    }
}

fn record<W: Wiring + Clone + 'static>(wiring: &W, session: &Session, edges: u64) -> Vectors {
    let mut constants = Vec::new();
    session.input().each(|&word| constants.push(word));
    let reset = Stimulus {
        rst: true,
        words: constants,
    };
    let inputs = reset.words.len();
    let mut run = ClosedLoop::new(wiring.clone(), session.plant(), session.input(), u64::MAX);
    let rows = (0..edges).map(|_| {
        run.step(&mut ());
        Stimulus {
            rst: false,
            words: run.wiring.words()[..inputs].to_vec(),
        }
    });
    let mut again: Box<dyn AnyBlock> = Box::new(wiring.clone());
    Vectors::record(&mut *again, std::iter::once(reset).chain(rows))
}
