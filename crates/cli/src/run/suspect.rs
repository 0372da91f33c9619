//! Why a design's wall gives no torque: the design is run again with one connection changed.

use hpu_cosim::dut::{Designs, DutSimulation, Inside};
use hpu_cosim::scene::{Connection, Dut, DutScene, Experiment, Line, OutcomeKind};
use hpu_cosim::{Control, Simulation, Summary};

/// A mistake that holds a design back from its wall.
#[derive(Clone, Copy)]
pub(crate) struct Suspect {
    /// Its name in JSON.
    pub name: &'static str,
    /// The mistake, and the change with which the wall has its torque.
    pub said: &'static str,
    /// Corrects the connections; `false` where they have no such mistake.
    correct: fn(&mut Dut) -> bool,
}

/// The mistakes that are looked for.
const SUSPECTS: [Suspect; 2] = [
    Suspect {
        name: "counts_reversed",
        said: "its counts run against the device: with encoder.a and encoder.b exchanged its wall has a torque",
        correct: exchange,
    },
    Suspect {
        name: "held_in_reset",
        said: "it is held in reset: with the other level in dut.reset.active its wall has a torque",
        correct: invert,
    },
];

/// Exchanges the encoder's lines.
fn exchange(dut: &mut Dut) -> bool {
    let has = |line: Line| dut.lines().any(|connected| connected == line);
    if !has(Line::A) || !has(Line::B) {
        return false;
    }
    for connected in &mut dut.ports {
        connected.connection = match connected.connection {
            Connection::Line(Line::A, inverted) => Connection::Line(Line::B, inverted),
            Connection::Line(Line::B, inverted) => Connection::Line(Line::A, inverted),
            other => other,
        };
    }
    true
}

/// Inverts the level at which the design is reset.
fn invert(dut: &mut Dut) -> bool {
    dut.reset.as_mut().is_some_and(|reset| {
        reset.active_low = !reset.active_low;
        true
    })
}

/// Returns the mistake of a design whose wall gave no torque: the first without which it gives one. A design that
/// cannot be run without a mistake does not have it.
pub fn found(scene: &Experiment, summary: &Summary, designs: &dyn Designs, control: &Control) -> Option<Suspect> {
    let Experiment::Dut(design) = scene else { return None };
    if summary.outcome() != Some(OutcomeKind::NoWallTorque) {
        return None;
    }
    SUSPECTS.into_iter().find(|suspect| {
        let mut corrected = design.clone();
        (suspect.correct)(&mut corrected.dut) && gives_torque(&corrected, designs, control).unwrap_or(false)
    })
}

/// Returns whether the wall of a design is touched and gives a torque; `None` if the design cannot be run.
fn gives_torque(scene: &DutScene, designs: &dyn Designs, control: &Control) -> Option<bool> {
    let simulation = DutSimulation::new(scene, designs, Inside::Nothing).ok()?;
    let summary = simulation.run(false, &mut simulation.verdict_trace(), &mut (), control).ok()?;
    let is_touched = summary.contact_share.is_some_and(|share| share > 0.0);
    Some(is_touched && summary.outcome() != Some(OutcomeKind::NoWallTorque))
}
