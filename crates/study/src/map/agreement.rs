//! How well the criteria of a switched touch predict a map's outcomes.

use hpu_cosim::scene::{Experiment, OutcomeKind};

use super::{Class, Found, Map, class};
use crate::gimbal::{Criteria, NAMES};

/// The agreement of a criterion with the outcomes of a layer, in cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Agreement {
    /// Name of the criterion.
    pub name: &'static str,
    /// Number of cells that do not settle, and how many of them the criterion predicts.
    pub failing: [usize; 2],
    /// Number of cells that settle, and how many of them the criterion takes for failing.
    pub settling: [usize; 2],
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
    let mut all = NAMES.map(|name| Agreement { name, failing: [0; 2], settling: [0; 2] });
    let mut refused = None;
    let mut judged = false;
    for index in method * map.layer()..(method + 1) * map.layer() {
        match (predicted(map, index), class(found, index)) {
            (Ok(fails), Some(class)) => {
                judged = true;
                let settles = class == Class::Outcome(OutcomeKind::Settled);
                for (agreement, fails) in all.iter_mut().zip(fails) {
                    let cells = if settles { &mut agreement.settling } else { &mut agreement.failing };
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
