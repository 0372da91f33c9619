//! A map as text and as JSON, and the message for an interrupted map.

use std::path::Path;

use hpu_cosim::number;
use hpu_cosim::scene::{Experiment, Miss, OutcomeKind};
use hpu_study::map::{
    Axis, Cell, Class, Curve, Edge, Found, Map, class, class_name, classes, is_late, outcome, outcome_name, unseen,
    wrapped,
};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::map::Mapped;
use crate::parameters::{missed, missed_object};
use crate::terminal::{print, print_json};

/// The most columns of a map that is drawn in letters.
const WIDEST: usize = 120;

/// Reports how many cells of an interrupted map are done.
pub fn interrupted(map: &Map, done: usize, out: Option<&Path>, as_json: bool) -> Result<Exit, Failure> {
    if as_json {
        print_json(&json!({ "scene": map.scene.name, "complete": false, "done": done, "cells": map.len() }))?;
    } else {
        let kept = out.map_or("none is kept; with -o DIR they would be".to_string(), |dir| {
            format!("kept in {}; the same command goes on from there", dir.display())
        });
        print(&format!("interrupted after {done} cells, of {} at most, {kept}\n", map.len()))?;
    }
    Ok(Exit::Interrupted)
}

fn letter(class: Option<Class>) -> char {
    match class {
        Some(Class::Outcome(OutcomeKind::Settled | OutcomeKind::Passive)) => '.',
        Some(Class::Outcome(OutcomeKind::LimitCycle | OutcomeKind::NonPassive)) => 'o',
        Some(Class::Outcome(OutcomeKind::Diverged | OutcomeKind::HighlyUnstable)) => 'X',
        Some(Class::WallNotReached) => '-',
        None => '?',
    }
}

impl Mapped {
    /// Returns the numbers of a method's cells.
    fn layer(&self, method: usize) -> std::ops::Range<usize> {
        method * self.map.layer()..(method + 1) * self.map.layer()
    }

    fn was_run(&self, index: usize) -> bool {
        matches!(self.found[index], Found::Run(_))
    }

    /// Returns the number of cells of a class in a layer, and the first of them that was run; if there are some at a
    /// boundary, the first of those.
    fn count(&self, method: usize, of: Option<Class>) -> (usize, Option<usize>) {
        let known = |index: &usize| !is_late(&self.found, *index);
        let of_class = || self.layer(method).filter(known).filter(|index| class(&self.found, *index) == of);
        // A cell at the boundary shows more than a cell in a corner, so it is preferred.
        let columns = self.map.x.cells();
        let borders = |index: &usize| {
            let point = self.map.point(*index);
            (point.ix > 0 && class(&self.found, index - 1) != of)
                || (point.ix + 1 < columns && class(&self.found, index + 1) != of)
        };
        let run = || of_class().filter(|index| self.was_run(*index));
        (of_class().count(), run().find(borders).or(run().next()))
    }

    /// Returns how many cells of a layer exceeded their time limit.
    fn late(&self, method: usize) -> usize {
        self.layer(method).filter(|index| is_late(&self.found, *index)).count()
    }

    /// Returns where a method's region of rest ends, and why.
    fn edge(&self, method: usize) -> Edge {
        Edge::new(&self.map, &self.found, self.curves[method].as_ref().ok(), method)
    }

    /// Returns how many cells of a layer that were run have a stiffness far from the one that they ask for. Returns
    /// also the miss whose format holds all of them, and the key of that format, if there is one.
    fn missed(&self, method: usize) -> Option<(usize, Miss, Option<&'static str>)> {
        let far = |cell: &Cell| cell.stiffness_error.is_some_and(|error| error.abs() > Miss::FLAGGED);
        let far = |index: &usize| matches!(&self.found[*index], Found::Run(Ok(cell)) if far(cell));
        let missing = self.layer(method).filter(far).filter_map(|index| {
            Some(match self.map.experiment(self.map.point(index)).ok()? {
                Experiment::Axis(scene) => {
                    (scene.words().ok()?.realised.stiffness_miss?, Some("method.stiffness_format"))
                }
                Experiment::Phantom(scene) => (scene.words().ok()?.stiffness_miss?, None),
                Experiment::Dut(_) => return None,
            })
        });
        let missing: Vec<(Miss, Option<&str>)> = missing.collect();
        let error = missing.iter().map(|(miss, _)| miss.error).max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        let all_held = missing.iter().all(|(miss, _)| miss.format.is_some());
        let format = missing.iter().filter_map(|(miss, _)| miss.format).max_by_key(|format| format.frac());
        Some((missing.len(), Miss { error, format: format.filter(|_| all_held) }, missing[0].1))
    }

    /// Returns the errors in the cells of a layer, each reason once with its number of cells.
    fn reasons(&self, method: usize) -> Vec<(&str, usize)> {
        let mut reasons: Vec<(&str, usize)> = Vec::new();
        for index in self.layer(method) {
            if let Found::Run(Err(reason)) = &self.found[index] {
                match reasons.iter_mut().find(|(known, _)| known == reason) {
                    Some((_, count)) => *count += 1,
                    None => reasons.push((reason, 1)),
                }
            }
        }
        reasons
    }
}

/// Returns a map as text.
pub fn text(mapped: &Mapped) -> String {
    let Mapped { map, curves, command, .. } = mapped;
    let mut text = format!("$ {command}\n");
    for (method, layer) in map.methods.iter().enumerate() {
        let runs = mapped.layer(method).filter(|index| mapped.was_run(*index)).count();
        text += &format!("\n{}: {} by {} cells, {runs} run\n", layer.label, map.x.cells(), map.y.cells());
        if map.x.cells() <= WIDEST {
            text += &letters(mapped, method);
        }
        for class in classes() {
            let (count, example) = mapped.count(method, class);
            if count > 0 {
                let meaning = if class == Some(Class::WallNotReached) { "  no verdict of the wall" } else { "" };
                let example = example.map_or(String::new(), |index| format!("  $ {}", mapped.replay(index)));
                text += &format!("{} {:<16} {count:>6}{meaning}{example}\n", letter(class), class_name(class));
            }
        }
        let late = mapped.late(method);
        if late > 0 {
            text += &format!("? {:<16} {late:>6}  by --cell-timeout; the same command runs them again\n", "not_run");
        }
        let wrapped = wrapped(&mapped.found, mapped.layer(method));
        if wrapped > 0 {
            text += &format!(
                "warning    in {wrapped} settled cells the hand is through the wall: the spring's product has wrapped \
                 (product_wraps in the table)\n"
            );
        }
        let past = unseen(&mapped.found, mapped.layer(method));
        if past > 0 {
            text += &format!(
                "warning    in {past} cells of wall_not_reached the device was past its wall and the datapath saw no contact: \
                 the position counter has wrapped (contact_unseen in the table)\n"
            );
        }
        if let Some((count, miss, key)) = mapped.missed(method) {
            text += &format!("warning    in {count} cells the {}\n", missed(&miss, key));
        }
        let reasons = mapped.reasons(method);
        text.extend(reasons.iter().take(5).map(|(reason, count)| format!("failed     {count} times: {reason}\n")));
        if reasons.len() > 5 {
            text += &format!("failed     and {} reasons more\n", reasons.len() - 5);
        }
        if let Some(edge) = mapped.edge(method).text() {
            text += &format!("edge       {edge}\n");
        }
        match &curves[method] {
            Err(why) => text += &format!("no curves: {why}\n"),
            Ok(curves) => {
                let met: Vec<String> = curves
                    .curves
                    .iter()
                    .map(|Curve { name, met, limits, .. }| format!("{name} ({met} of {})", limits.len()))
                    .collect();
                text += &format!("curves     {}\n", met.join(", "));
            }
        }
    }
    let mut told: Vec<&str> = Vec::new();
    for Curve { name, assumptions, .. } in curves.iter().flatten().flat_map(|curves| &curves.curves) {
        if !told.contains(name) {
            if told.is_empty() {
                text += "\nEach curve assumes (met at so many points of the other axis):\n";
            }
            told.push(name);
            text += &format!("{name}: {assumptions}\n");
        }
    }
    text + &mapped.files.iter().map(|file| format!("file       {}\n", file.display())).collect::<String>()
}

/// Returns a layer in letters, with the last row on top.
fn letters(mapped: &Mapped, method: usize) -> String {
    let map = &mapped.map;
    let name = |axis: &Axis| {
        let (first, last) = (axis.values()[0], axis.values()[axis.cells() - 1]);
        let scale = if axis.is_log() { "log" } else { "lin" };
        let unit = map.unit(axis);
        format!("{} {first} to {}{}{unit}, {scale}", axis.key(), number(last), if unit.is_empty() { "" } else { " " })
    };
    let rows = (0..map.y.cells()).rev().map(|iy| {
        let first = mapped.layer(method).start + iy * map.x.cells();
        let row: String = (first..first + map.x.cells()).map(|index| letter(class(&mapped.found, index))).collect();
        format!("  |{row}|\n")
    });
    format!("  up: {}\n{}  across: {}\n", name(&map.y), rows.collect::<String>(), name(&map.x))
}

/// Returns a map as JSON.
pub fn object(mapped: &Mapped) -> Value {
    let Mapped { map, found, curves, command, files, .. } = mapped;
    let axis = |axis: &Axis| {
        let scale = if axis.is_log() { "log" } else { "lin" };
        json!({ "key": axis.key(), "unit": axis.unit(), "scale": scale, "values": axis.values() })
    };
    let methods = map.methods.iter().enumerate().map(|(method, layer)| {
        let counts = classes().map(|class| (class_name(class).to_string(), json!(mapped.count(method, class).0)));
        let counts = counts.chain([("not_run".to_string(), json!(mapped.late(method)))]);
        let runs = mapped.layer(method).filter(|index| mapped.was_run(*index)).count();
        let curves = match &curves[method] {
            Err(why) => json!({ "reason": why, "over": null, "criteria": [] }),
            Ok(curves) => {
                let criteria = curves.curves.iter().map(|Curve { name, assumptions, met, limits }| {
                    json!({ "name": name, "limits": limits, "assumptions": assumptions, "assumptions_met_at": met })
                });
                let over = if curves.over_x { "y" } else { "x" };
                json!({ "reason": null, "over": over, "criteria": criteria.collect::<Vec<_>>() })
            }
        };
        json!({
            "label": layer.label,
            "run": runs,
            "outcomes": counts.collect::<serde_json::Map<_, _>>(),
            "product_wrapped": wrapped(found, mapped.layer(method)),
            "stiffness_missed": mapped.missed(method).map(|(count, miss, _)| {
                json!({ "cells": count, "worst": missed_object(&miss) })
            }),
            "edge": edge(&mapped.edge(method)),
            "curves": curves,
        })
    });
    let cells = (0..found.len()).map(|index| {
        let point = map.point(index);
        let mut cell = json!({
            "method": map.methods[point.method].label,
            "ix": point.ix,
            "iy": point.iy,
            "outcome": if is_late(found, index) { "not_run" } else { outcome_name(outcome(found, index)) },
            "run": mapped.was_run(index),
        });
        match &found[index] {
            Found::Run(Ok(ran)) => numbers(&mut cell, ran),
            Found::Run(Err(reason)) => cell["reason"] = json!(reason),
            Found::As(_) | Found::Late => {}
        }
        cell
    });
    json!({
        "scene": map.scene.name,
        "complete": (0..found.len()).all(|index| !is_late(found, index)),
        "command": command,
        "x": axis(&map.x),
        "y": axis(&map.y),
        "methods": methods.collect::<Vec<_>>(),
        "cells": cells.collect::<Vec<_>>(),
        "files": files,
    })
}

fn edge(edge: &Edge) -> Value {
    let shares = edge.shares.iter().map(|share| {
        json!({
            "reason": share.reason.text(),
            "places": share.places,
            "frequency_hz": share.frequency_hz,
            "amplitude_counts": share.amplitude_counts,
        })
    });
    json!({
        "places": edge.places,
        "reasons": shares.collect::<Vec<_>>(),
        "nearest": edge.nearest.map(|(name, ratio)| json!({ "criterion": name, "edge_over_limit": ratio })),
    })
}

fn numbers(value: &mut Value, cell: &Cell) {
    value["rms"] = json!(cell.rms);
    value["amplitude"] = json!(cell.amplitude);
    value["frequency_hz"] = json!(cell.frequency_hz);
    value["hand_j"] = json!(cell.hand_j);
    value["source_j"] = json!(cell.source_j);
    value["dissipated_j"] = json!(cell.dissipated_j);
    value["displayed_stiffness"] = json!(cell.displayed_stiffness);
    value["displayed_ratio"] = json!(cell.displayed_ratio);
    value["contact_share"] = json!(cell.contact_share);
    value["product_wraps"] = json!(cell.product_wraps);
    value["contact_unseen"] = json!(cell.contact_unseen);
    value["stiffness_error"] = json!(cell.stiffness_error);
    value["overflow_share"] = json!(cell.overflow_share);
    value["edges"] = json!(cell.edges);
}
