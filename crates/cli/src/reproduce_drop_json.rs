//! A study as JSON, and what is said of one that was interrupted.

use std::path::PathBuf;

use hpu_study::reproduce::{Agreement, Table, claims};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::reproduce_beside::claim;
use crate::reproduce_drop::Outcome;
use crate::terminal::{print, print_json};

/// A study that was stopped.
pub struct Interrupted {
    /// Its name.
    pub study: &'static str,
    /// Trials done, those of earlier commands among them.
    pub done: usize,
    /// All of its trials.
    pub trials: usize,
    /// Where they are kept.
    pub out: Option<PathBuf>,
}

impl Interrupted {
    /// Tells how far it came.
    pub fn tell(self, as_json: bool) -> Result<Exit, Failure> {
        let Self { study, done, trials, out } = self;
        if as_json {
            print_json(&json!({ "study": study, "complete": false, "done": done, "trials": trials }))?;
        } else {
            let kept = out.map_or("none is kept; with -o DIR they would be".to_string(), |dir| {
                format!("kept in {}; the same command goes on from there", dir.display())
            });
            print(&format!("{study}: interrupted after {done} of {trials} trials, {kept}\n"))?;
        }
        Ok(Exit::Interrupted)
    }
}

/// A study that is through.
pub fn object(outcome: &Outcome, files: &[PathBuf]) -> Value {
    let rungs = outcome.study.rungs.iter().zip(&outcome.tables).map(|(rung, table)| {
        let Agreement { legible, same } = Agreement::of(table);
        json!({
            "model": rung.name,
            "printed": { "legible": legible, "same": same },
            "claims": claims(table).iter().map(|told| claim(&told.sum())).collect::<Vec<_>>(),
            "limits": limits(table),
            "cells": cells(table),
            "failures": table.failures(),
        })
    });
    json!({
        "study": outcome.name,
        "complete": true,
        "command": outcome.command,
        "replay": outcome.replay(),
        "trials": outcome.outcomes.len(),
        "rungs": rungs.collect::<Vec<_>>(),
        "files": files,
    })
}

fn limits(table: &Table) -> Vec<Value> {
    let mut all = Vec::new();
    for &axis in &table.axes {
        for &platform in &table.platforms {
            if let Some(limit) = table.limit(axis, platform) {
                all.push(json!({
                    "axis": axis.name(),
                    "platform": platform.name(),
                    "passive_n_per_m": limit.passive_n_per_m,
                    "beyond_n_per_m": limit.beyond_n_per_m,
                }));
            }
        }
    }
    all
}

fn cells(table: &Table) -> Vec<Value> {
    let mut all = Vec::new();
    for &axis in &table.axes {
        for &platform in &table.platforms {
            for &row in &table.stiffnesses_n_per_m {
                if let Some(cell) = table.cell(axis, platform, row) {
                    all.push(json!({
                        "axis": axis.name(),
                        "platform": platform.name(),
                        "stiffness_n_per_m": row,
                        "outcome": cell.class.name(),
                        "rms_m": cell.rms_m(),
                        "as_printed": Agreement::at(table, axis, platform, row),
                    }));
                }
            }
        }
    }
    all
}
