//! The measure of drops onto walls: which values of a key put the stiffest passive wall where it was seen.

use hpu_cosim::Control;

use super::motion::make;
use super::{Asked, text};
use crate::Error;
use crate::template::Values;

/// Finds the values of a key with which the first of three walls is passive and the second is not (`narrow`), or the
/// third is not (`wide`), along every axis. A wall is passive along an axis if every trial on it and on all softer
/// walls is.
pub(super) fn fitting(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let (mut narrow, mut wide) = (Vec::new(), Vec::new());
    for value in asked.numbers("values") {
        let own = [(asked.text("key").to_string(), format!("{value} {}", asked.text("unit")))];
        let passive = asked.text("axes").chars().map(|axis| passive_walls(asked, &own, axis, control));
        let passive = passive.collect::<Result<Vec<_>, _>>()?;
        if passive.iter().all(|walls| (1..=2).contains(walls)) {
            wide.push(format!("{value:.2}"));
            narrow.extend(passive.iter().all(|walls| *walls == 1).then(|| format!("{value:.2}")));
        }
    }
    let told = |values: &[String]| if values.is_empty() { "none".to_string() } else { values.join(" ") };
    Ok([text("narrow", told(&narrow)), text("wide", told(&wide))].into())
}

/// Returns how many of the walls, from the softest on, are passive in all trials along an axis.
fn passive_walls(asked: &Asked, own: &[(String, String)], axis: char, control: &Control) -> Result<usize, Error> {
    for (row, stiffness) in asked.numbers("walls").iter().enumerate() {
        for trial in 1..=asked.number("trials").unwrap_or(1.0) as u64 {
            let drop = [("drop.axis", axis.to_string()), ("drop.trial", trial.to_string())];
            let drop = drop.into_iter().chain([("room.stiffness", stiffness.to_string())]);
            let drop = drop.map(|(key, value)| (key.to_string(), value)).collect::<Vec<_>>();
            if !make(asked, &[own, &drop].concat(), control)?.settled()? {
                return Ok(row);
            }
        }
    }
    Ok(asked.numbers("walls").len())
}
