//! Waveforms of a run, as the bytes of a file.

use std::io::{self, Cursor};

use hpu_cosim::{Control, Simulation, Wired, WiredSimulation};
use hpu_signal::Cycle;
use hpu_wave::{Fst, Layout, Recording, Sink, Vcd};
use serde_json::json;

use crate::Answer;
use crate::request::{Refusal, Request};

/// Runs the scene, and returns its waveform.
pub(crate) fn wave(request: &Request) -> Result<Answer, Refusal> {
    let experiment = request.source()?.runnable()?;
    let simulation = WiredSimulation::new(&experiment)?;
    let layout = Layout::of(&simulation);
    let layout = if simulation.record().clock { layout.with_clock() } else { layout };
    let format = request.text("format")?;
    let (clock, wrong) = (simulation.clock(), |error: io::Error| format!("{format}: {error}"));
    let file = match format {
        "fst" => {
            let fst = Fst::new(Cursor::new(Vec::new()), &layout, clock).map_err(wrong)?;
            recorded(&simulation, fst).map_err(wrong)?.into_inner()
        }
        "vcd" => recorded(&simulation, Vcd::new(Vec::new(), &layout, clock).map_err(wrong)?).map_err(wrong)?,
        _ => return Err(format!("no format `{format}`; there are fst, vcd").into()),
    };
    Ok(Answer { json: json!({ "name": format!("{}.{format}", experiment.name) }), file, ..Answer::default() })
}

fn recorded<S: Sink>(simulation: &WiredSimulation, mut file: Recording<S>) -> io::Result<S::Out> {
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(simulation.driver(), &mut trace, &mut file, &Control::new());
    file.finish(Cycle(summary.edges))
}
