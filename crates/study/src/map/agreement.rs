//! How well the criteria of a switched touch predict a map's outcomes.

use hpu_cosim::scene::OutcomeKind;

use super::{Device, Found, Map, nearest};
use crate::Error;

/// The agreement of a criterion with the outcomes of a layer, in cells. A touch fails if it does not settle, or if its
/// control goes on switching in the judged window, however small the motion is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Agreement {
    /// Name of the criterion.
    pub name: &'static str,
    /// Number of cells that fail, and how many of them the criterion predicts.
    pub failing: [usize; 2],
    /// Number of cells that hold, and how many of them the criterion takes for failing.
    pub holding: [usize; 2],
}

/// Returns of a cell each criterion with whether it predicts that the cell fails.
///
/// # Errors
///
/// Returns as text why the criteria say nothing of this cell.
pub fn predicted(map: &Map, index: usize) -> Result<Vec<(&'static str, bool)>, Error> {
    map.experiment(map.point(index))?.predictions()
}

/// Returns whether criteria speak of the device of a layer. Cells of a layer have the same device, so one of them
/// answers for all.
pub fn is_predicted(map: &Map, method: usize) -> bool {
    let mut cells = (method * map.layer()..(method + 1) * map.layer()).map(|index| map.experiment(map.point(index)));
    cells.find_map(Result::ok).is_some_and(|experiment| experiment.predicts())
}

/// Returns the agreement of each criterion with a layer. Cells that failed to run, whose run does not tell, or of which
/// the criteria say nothing, are left out.
///
/// # Errors
///
/// Returns the first reason if the criteria say nothing of any cell.
pub fn agreements(map: &Map, found: &[Found], method: usize) -> Result<Vec<Agreement>, Error> {
    let mut all: Vec<Agreement> = Vec::new();
    let mut refused = None;
    let mut judged = false;
    if !is_predicted(map, method) {
        // Every cell refuses; the first one says why.
        return predicted(map, method * map.layer()).map(|_| all);
    }
    for index in method * map.layer()..(method + 1) * map.layer() {
        let predictions = match predicted(map, index) {
            Ok(predictions) => predictions,
            Err(why) => {
                refused = refused.or(Some(why));
                continue;
            }
        };
        if all.is_empty() {
            all = predictions.iter().map(|(name, _)| Agreement { name, failing: [0; 2], holding: [0; 2] }).collect();
        }
        if let Some(cell) = nearest(found, index).filter(|cell| cell.outcome.tells()) {
            judged = true;
            let holds = cell.outcome == OutcomeKind::Settled
                && cell.switching.as_ref().is_none_or(|switching| switching.switch_j.is_none());
            for (agreement, (_, fails)) in all.iter_mut().zip(predictions) {
                let cells = if holds { &mut agreement.holding } else { &mut agreement.failing };
                *cells = [cells[0] + 1, cells[1] + usize::from(fails)];
            }
        }
    }
    match refused {
        Some(why) if !judged => Err(why),
        _ => Ok(all),
    }
}
