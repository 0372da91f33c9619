//! The classes in which a map shows its cells.

use std::ops::Range;

use hpu_cosim::scene::OutcomeKind;

use super::{Cell, ForEver, Found, nearest, outcome_name};

/// The class of a cell that was run. Boundaries run between cells of different classes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// The outcome of the motion.
    Outcome(OutcomeKind),
    /// The wall saw no penetration in the judged window, so the outcome is no verdict on the wall. A logic that has
    /// lost the position cannot tell that.
    WallNotReached,
}

impl Class {
    /// Returns the class of a cell.
    pub fn of(cell: &Cell) -> Self {
        let knows = cell.outcome != OutcomeKind::PositionLost;
        if knows && cell.contact_share == Some(0.0) { Self::WallNotReached } else { Self::Outcome(cell.outcome) }
    }
}

/// Returns all classes; the last, `None`, is that of a failed cell.
pub fn classes() -> impl Iterator<Item = Option<Class>> {
    let outcomes = OutcomeKind::ALL.into_iter().map(|kind| Some(Class::Outcome(kind)));
    outcomes.chain([Some(Class::WallNotReached), None])
}

/// Returns how many of these cells, run or inferred, came to rest through a wall whose product has wrapped.
pub fn wrapped(found: &[Found], cells: Range<usize>) -> usize {
    let wraps = |index: &usize| nearest(found, *index).is_some_and(|cell| cell.product_wraps.is_some());
    cells.filter(wraps).count()
}

/// Returns how many of these cells, run or inferred, saw no contact although the device was past its wall.
pub fn unseen(found: &[Found], cells: Range<usize>) -> usize {
    cells.filter(|index| is_unseen(found, *index)).count()
}

/// Returns how many of these cells, run or inferred, had a position counter that wrapped under the device.
pub fn unheld(found: &[Found], cells: Range<usize>) -> usize {
    let is_lost = |index: &usize| nearest(found, *index).is_some_and(|cell| cell.position_lost_share > 0.0);
    cells.filter(is_lost).count()
}

/// Whether a cell, run or inferred, saw no contact although the device was past its wall.
pub fn is_unseen(found: &[Found], index: usize) -> bool {
    nearest(found, index).is_some_and(|cell| cell.contact_unseen)
}

/// Whether the cells were asked how they go on for ever.
pub fn told_for_ever(found: &[Found]) -> bool {
    found.iter().any(|cell| matches!(cell, Found::Run(Ok(cell)) if cell.for_ever.is_some()))
}

/// Whether a cell was run and stays settled for ever, by proof or because the emulator repeats. Of an inferred cell
/// nothing is told.
pub fn settled_for_ever(found: &[Found], index: usize) -> bool {
    matches!(&found[index], Found::Run(Ok(cell)) if cell.for_ever.is_some_and(ForEver::is_settled))
}

/// Returns the name of a class; `failed` for a cell without one.
pub fn class_name(class: Option<Class>) -> &'static str {
    match class {
        Some(Class::Outcome(kind)) => kind.name(),
        Some(Class::WallNotReached) => "wall_not_reached",
        None => outcome_name(None),
    }
}
