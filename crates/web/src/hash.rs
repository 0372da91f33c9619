//! A hash by which two builds of the engine are compared.

use std::fmt::Write as _;

use hpu_cosim::{Control, Simulation, Wired, WiredSimulation};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::request::{Refusal, Request};

/// Runs the scene, and returns the SHA-256 of its verdict, encoder edges, energies and net statistics. The hash is over
/// their `Debug` texts, in which two numbers are alike only if their bits are.
pub(crate) fn hash(request: &Request) -> Result<Value, Refusal> {
    let experiment = request.source()?.runnable()?;
    let simulation = WiredSimulation::new(&experiment)?;
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::new());
    let all = (&summary.verdict, summary.encoder_edges, &summary.energy, &summary.averages, &summary.nets);
    let digest = Sha256::digest(format!("{all:?}"));
    let hash = digest.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a text can be written to");
        text
    });
    Ok(json!({ "name": experiment.name, "hash": hash }))
}
