//! A study as JSON, and the message for an interrupted study.

use std::path::PathBuf;

use hpu_papers::phantom::{Agreement, Class, Repeated, Tables};
use serde_json::{Value, json};

use super::Outcome;
use crate::beside::claim;
use crate::page::kept;
use crate::shell::{Exit, Failure, print, print_json};

/// A study that was stopped.
pub(crate) struct Interrupted {
    /// Its name.
    pub study: &'static str,
    /// Trials that are done, including those of earlier commands.
    pub done: usize,
    /// Trials that are known to be left. The cells near a boundary are known only when the cells before them are done.
    pub left: usize,
    /// The folder in which the trials are kept.
    pub out: Option<PathBuf>,
}

impl Interrupted {
    /// Reports how many trials are done.
    pub fn tell(self, as_json: bool) -> Result<Exit, Failure> {
        let Self { study, done, left, out } = self;
        if as_json {
            print_json(&json!({ "study": study, "complete": false, "done": done, "left_at_least": left }))?;
        } else {
            let kept = kept(out.as_deref());
            print(&format!("{study}: interrupted after {done} trials, at least {left} are left; {kept}\n"))?;
        }
        Ok(Exit::Interrupted)
    }
}

/// Returns a complete study as JSON.
pub fn object(outcome: &Outcome) -> Value {
    let rungs = outcome.study.rungs.iter().zip(&outcome.tables).map(|(rung, tables)| {
        let Agreement { legible, same, mixed } = Agreement::of(tables);
        json!({
            "model": rung.name,
            "printed": { "legible": legible, "same": same, "same_at_some_seeds": mixed },
            "claims": tables.claims().iter().map(repeated).collect::<Vec<_>>(),
            "limits": limits(tables),
            "cells": cells(tables),
            "failures": tables.failures(),
        })
    });
    json!({
        "study": outcome.name,
        "complete": true,
        "command": outcome.command,
        "replay": outcome.replay(),
        "seeds": outcome.study.all_seeds().collect::<Vec<_>>(),
        "trials": outcome.outcomes.len(),
        "rungs": rungs.collect::<Vec<_>>(),
    })
}

/// Returns a claim as JSON, with the finding from the table of each seed.
fn repeated(told: &Repeated) -> Value {
    let mut object = claim(&told.sum());
    object["met_at_seeds"] = told.seeds.iter().map(|(_, claim)| claim.met).collect();
    object
}

fn limits(tables: &Tables) -> Vec<Value> {
    let mut all = Vec::new();
    let table = tables.first();
    for &axis in &table.axes {
        for &platform in &table.platforms {
            if let Some(limit) = tables.limit(axis, platform) {
                all.push(json!({
                    "axis": axis.name(),
                    "platform": platform.name(),
                    "passive_n_per_m": limit.every_n_per_m,
                    "beyond_n_per_m": limit.beyond_n_per_m,
                    "passive_at_some_seed_n_per_m": limit.some_n_per_m,
                }));
            }
        }
    }
    all
}

fn cells(tables: &Tables) -> Vec<Value> {
    let mut all = Vec::new();
    let table = tables.first();
    for &axis in &table.axes {
        for &platform in &table.platforms {
            for &row in &table.stiffnesses_n_per_m {
                let Some((cell, tally)) = table.cell(axis, platform, row).zip(tables.cell(axis, platform, row)) else {
                    continue;
                };
                all.push(json!({
                    "axis": axis.name(),
                    "platform": platform.name(),
                    "stiffness_n_per_m": row,
                    "outcome": tally.class().map_or("mixed", Class::name),
                    "outcome_at_seeds": tally.classes.iter().map(|class| class.name()).collect::<Vec<_>>(),
                    "rms_at_first_seed_m": cell.rms_m(),
                    "seeds_as_printed": Agreement::at(tables, axis, platform, row).map(|same| same.so),
                }));
            }
        }
    }
    all
}
