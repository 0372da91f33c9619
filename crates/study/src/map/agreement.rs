//! How well the criteria of a switched touch predict a map's outcomes.

use hpu_cosim::scene::{Experiment, OutcomeKind};

use super::{Found, Map, nearest};
use crate::gimbal::{Criteria, NAMES};

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

/// Returns for a cell whether each criterion predicts that it fails, in the order of [`NAMES`].
///
/// # Errors
///
/// Returns as text why the criteria say nothing of this cell.
pub fn predicted(map: &Map, index: usize) -> Result<[bool; NAMES.len()], String> {
    match map.experiment(map.point(index)) {
        Ok(Experiment::Gimbal(scene)) => Criteria::of(&scene).map(|criteria| criteria.fails()),
        Ok(_) => Err("the criteria speak of a gimbal, which this is not".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// Returns the agreement of each criterion with a layer. Cells that failed to run, or of which the criteria say
/// nothing, are left out.
///
/// # Errors
///
/// Returns the first reason if the criteria say nothing of any cell.
pub fn agreements(map: &Map, found: &[Found], method: usize) -> Result<Vec<Agreement>, String> {
    let mut all = NAMES.map(|name| Agreement { name, failing: [0; 2], holding: [0; 2] });
    let mut refused = None;
    let mut judged = false;
    for index in method * map.layer()..(method + 1) * map.layer() {
        match (predicted(map, index), nearest(found, index)) {
            (Ok(fails), Some(cell)) => {
                judged = true;
                let holds = cell.outcome == OutcomeKind::Settled
                    && cell.switching.as_ref().is_none_or(|switching| switching.switch_j.is_none());
                for (agreement, fails) in all.iter_mut().zip(fails) {
                    let cells = if holds { &mut agreement.holding } else { &mut agreement.failing };
                    *cells = [cells[0] + 1, cells[1] + usize::from(fails)];
                }
            }
            (Ok(_), None) => {}
            (Err(why), _) => refused = refused.or(Some(why)),
        }
    }
    match refused {
        Some(why) if !judged => Err(why),
        _ => Ok(all.into()),
    }
}
