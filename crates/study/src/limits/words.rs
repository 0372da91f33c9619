//! The limit of a scene as it stands: in words, with its quantisation, friction, hand and contact.
//!
//! Found by bisection over the words that the stiffness can be, on the verdict of the scene's whole run: settled, or
//! not. A run whose judged window has no contact says nothing of the wall, so the search ends there with an error.
//! Nothing makes that verdict a monotone function of the stiffness. What is told is one place where it turns, next to
//! where the search begins: the softest stiffness of two neighbours, settled, and the stiffer, not.

use hpu_cosim::Control;
use hpu_cosim::figure;
use hpu_cosim::judged_window_s;
use hpu_cosim::scene::{Datapath, Experiment, Hand, OutcomeKind, Scene};

use super::{Emulated, unit};
use crate::map::{Cell, CellLimits};

/// The limit of a scene in words.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InWords {
    /// Between the stiffest word that settled and its neighbour; the uncertainty is a whole word.
    pub emulated: Emulated,
    /// Runs that it took.
    pub runs: u32,
}

/// The limit of a scene as it stands, searched from a stiffness in SI units.
///
/// # Errors
///
/// The reason why there is none: no words, no free motion, no contact in a judged window, the same verdict at every
/// stiffness that the words hold, or that `control` stopped it.
pub fn in_words(scene: &Scene, start: f64, control: &Control) -> Result<InWords, String> {
    match scene.model.datapath {
        Datapath::Words => {}
        Datapath::Linear => return Err("the scene's law is linear: it has no words".into()),
        Datapath::Law => return Err("the scene's law is computed in floats: it has no words".into()),
    }
    match scene.hand {
        Hand::Prescribed { .. } => return Err("the hand imposes the motion".into()),
        Hand::Capture { .. } => return Err("a recording stands in the place of the device".into()),
        _ => {}
    }
    let realised = scene.words().map_err(|error| error.to_string())?.realised;
    let format = scene.method.stiffness_format;
    let word = realised.torque_quantum_nm / realised.count_rad * format.lsb();

    let mut runs = 0;
    let mut settles = |words: i128| -> Result<bool, String> {
        runs += 1;
        let mut scene = scene.clone();
        scene.wall.stiffness_nm_per_rad = words as f64 * word;
        let experiment = Experiment::Axis(scene);
        let cell = Cell::run(&experiment, CellLimits::UNGUARDED, control)?.ok_or("stopped")?;
        if cell.contact_share == Some(0.0) {
            return Err(untouched(&experiment, words as f64 * word));
        }
        Ok(cell.outcome == OutcomeKind::Settled)
    };
    let first = ((start / word) as i128).clamp(1, format.max());
    let (mut low, mut high) = (first, first);
    if settles(first)? {
        loop {
            if high == format.max() {
                return Err(format!(
                    "settles up to {} {}, the stiffest that {format} holds",
                    figure(high as f64 * word),
                    unit(scene)
                ));
            }
            high = high.saturating_mul(2).min(format.max());
            if !settles(high)? {
                break;
            }
            low = high;
        }
    } else {
        loop {
            if low == 1 {
                return Err(format!(
                    "does not settle down to {} {}, the softest that {format} holds",
                    figure(word),
                    unit(scene)
                ));
            }
            low /= 2;
            if settles(low)? {
                break;
            }
            high = low;
        }
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        *(if settles(middle)? { &mut low } else { &mut high }) = middle;
    }
    let limit = (low as f64 + 0.5) * word;
    Ok(InWords { emulated: Emulated { limit, uncertainty: word, unit: unit(scene) }, runs })
}

/// Why the verdict of a scene whose hand is not at the wall is none on the wall, and what to change.
fn untouched(experiment: &Experiment, stiffness: f64) -> String {
    let Experiment::Axis(scene) = experiment else { unreachable!("limits are those of an axis") };
    let unit = scene.device.units();
    let [from, to] = judged_window_s(experiment).map(figure);
    let hand = match scene.hand {
        Hand::SpringDamper { .. } => "let hand.path end beyond the wall",
        Hand::ConstantTorque { .. } => "let hand.torque press into the wall",
        _ => "give it a hand that presses into the wall",
    };
    format!(
        "not judged: wall not reached at {} {} in the judged window, {from} s to {to} s; {hand}, \
         move wall.position ({} {}), or change run.duration",
        figure(stiffness),
        unit.stiffness,
        figure(scene.wall.position_rad),
        unit.position
    )
}
