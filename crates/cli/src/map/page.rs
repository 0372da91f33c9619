//! The page of a map, and of an interrupted map.

use std::path::Path;

use hpu_cosim::number;
use hpu_cosim::scene::{Miss, OutcomeKind};
use hpu_page::summary::telling;
use hpu_page::{Column, Page, Table};
use hpu_study::map::{
    Agreement, Axis, Cell, Class, Curve, Curves, Edge, Found, Map, agreements, class, class_name, classes, fields,
    is_late, settled_for_ever, told_for_ever, unheld, unseen, wrapped,
};
use serde_json::{Value, json};

use crate::map::Mapped;
use crate::page;
use crate::parameters::{missed, missed_object};

/// The most columns of a map that is drawn in letters.
const WIDEST: usize = 120;

/// Returns the page of an interrupted map: how many cells are done.
pub fn interrupted(map: &Map, done: usize, out: Option<&Path>) -> Page {
    let kept = page::kept(out);
    let mut page = Page::default();
    page.data("scene", &map.scene.name).data("complete", false).data("done", done).data("cells", map.len());
    page.note(format!("interrupted after {done} cells, of {} at most, {kept}", map.len()));
    page
}

fn letter(class: Option<Class>) -> char {
    match class {
        Some(Class::Outcome(OutcomeKind::Settled | OutcomeKind::Passive | OutcomeKind::Tracking)) => '.',
        Some(Class::Outcome(OutcomeKind::LimitCycle | OutcomeKind::NonPassive)) => 'o',
        Some(Class::Outcome(OutcomeKind::Diverged | OutcomeKind::HighlyUnstable)) => 'X',
        Some(Class::Outcome(OutcomeKind::NotTold)) => ':',
        Some(Class::Outcome(OutcomeKind::HandMoves)) => 'h',
        Some(Class::Outcome(OutcomeKind::NoWallTorque)) => '0',
        Some(Class::Outcome(OutcomeKind::PositionLost)) => 'w',
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

    /// Returns the longest duration of a run that would tell, over the cells of a class in a layer; `None` if none is
    /// known for one of them.
    fn telling_s(&self, method: usize, of: Option<Class>) -> Option<f64> {
        let cells = self.layer(method).filter(|index| class(&self.found, *index) == of);
        let durations = cells.filter_map(|index| match &self.found[index] {
            Found::Run(Ok(cell)) => Some(cell.telling_s),
            _ => None,
        });
        durations.reduce(|one, other| Some(one?.max(other?))).flatten()
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
            let experiment = self.map.experiment(self.map.point(index)).ok()?;
            Some((experiment.setup().stiffness_miss()?, experiment.setup().stiffness_format()))
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
                match reasons.iter_mut().find(|(known, _)| *known == reason.why()) {
                    Some((_, count)) => *count += 1,
                    None => reasons.push((reason.why(), 1)),
                }
            }
        }
        reasons
    }
}

/// Returns the page of a map.
pub fn page(mapped: &Mapped) -> Page {
    let Mapped { map, found, curves, command, files, .. } = mapped;
    let mut page = Page::default();
    page.note(format!("$ {command}"));
    (0..map.methods.len()).for_each(|method| {
        page.section("methods", layer(mapped, method));
    });
    let mut told: Vec<&str> = Vec::new();
    for Curve { name, assumptions, .. } in curves.iter().flatten().flat_map(|curves| &curves.curves) {
        if !told.contains(name) {
            if told.is_empty() {
                page.note("\nEach curve assumes (met at so many points of the other axis):");
            }
            told.push(name);
            page.note(format!("{name}: {assumptions}"));
        }
    }
    let axis = |axis: &Axis| {
        let scale = if axis.is_log() { "log" } else { "lin" };
        json!({ "key": axis.key(), "unit": axis.unit(), "scale": scale, "values": axis.values() })
    };
    page.data("scene", &map.scene.name).data("command", command).data("x", axis(&map.x)).data("y", axis(&map.y));
    page.data("complete", (0..found.len()).all(|index| !is_late(found, index)));
    page.data("cells", Table::of("", 0..found.len(), fields(map, found, |index| mapped.replay(index))).json());
    page::files(&mut page, files);
    page
}

/// Returns the page of a method's cells.
fn layer(mapped: &Mapped, method: usize) -> Page {
    let map = &mapped.map;
    let label = &map.methods[method].label;
    let runs = mapped.layer(method).filter(|index| mapped.was_run(*index)).count();
    let mut page = Page::default();
    page.data("label", label).data("run", runs);
    page.note(format!("\n{label}: {} by {} cells, {runs} run", map.x.cells(), map.y.cells()));
    if map.x.cells() <= WIDEST {
        page.note(letters(mapped, method));
    }
    outcomes(&mut page, mapped, method);
    warnings(&mut page, mapped, method);
    let reasons = mapped.reasons(method);
    for (reason, count) in reasons.iter().take(5) {
        page.line("failed", format!("{count} times: {reason}"));
    }
    if reasons.len() > 5 {
        page.line("failed", format!("and {} reasons more", reasons.len() - 5));
    }
    let found = mapped.edge(method);
    page.data("edge", edge(&found));
    if let Some(said) = found.text() {
        page.line("edge", said);
    }
    match agreements(map, &mapped.found, method) {
        Ok(all) => predictions(&mut page, all),
        Err(_) => criteria(&mut page, &mapped.curves[method]),
    }
    page
}

/// Adds how many cells have each outcome, with a run of each.
fn outcomes(page: &mut Page, mapped: &Mapped, method: usize) {
    let columns = [Column::text("", "").least(18), Column::integer("", "").least(5), Column::text("", "")];
    let mut outcomes = Table::new("", columns);
    for class in classes() {
        let (count, example) = mapped.count(method, class);
        page.data(&format!("outcomes.{}", class_name(class)), count);
        if count > 0 {
            let meaning = match class {
                Some(Class::WallNotReached) => "no verdict of the wall  ".to_string(),
                Some(Class::Outcome(outcome)) if !outcome.tells() => {
                    format!("{}  ", telling(mapped.telling_s(method, class)))
                }
                _ => String::new(),
            };
            let example = example.map_or(String::new(), |index| format!("$ {}", mapped.replay(index)));
            let name = format!("{} {}", letter(class), class_name(class));
            outcomes.add([name.into(), count.into(), format!("{meaning}{example}").into()]);
        }
    }
    let late = mapped.late(method);
    page.data("outcomes.not_run", late);
    if late > 0 {
        let why = "by --cell-timeout; the same command runs them again";
        outcomes.add(["? not_run".into(), late.into(), why.into()]);
    }
    page.table(outcomes);
    if told_for_ever(&mapped.found) {
        let proved = mapped.layer(method).filter(|index| settled_for_ever(&mapped.found, *index)).count();
        let settled = |index: &usize| {
            let settled = Some(Class::Outcome(OutcomeKind::Settled));
            mapped.was_run(*index) && class(&mapped.found, *index) == settled
        };
        let all = mapped.layer(method).filter(settled).count();
        page.data("settled_for_ever", proved);
        page.line(
            "for ever",
            format!("{proved} of the {all} settled cells that were run stay so: by proof, or the emulator repeats"),
        );
    }
}

/// Adds warnings about cells whose words wrapped, or miss the stiffness.
fn warnings(page: &mut Page, mapped: &Mapped, method: usize) {
    let (found, cells) = (&mapped.found, || mapped.layer(method));
    let [through, past, lost] = [wrapped(found, cells()), unseen(found, cells()), unheld(found, cells())];
    page.data("product_wrapped", through).data("position_wrapped", lost);
    let said = [
        (
            through,
            "settled cells the hand is through the wall: the spring's product has wrapped (product_wraps in the \
                   table)",
        ),
        (
            past,
            "cells of wall_not_reached the device was past its wall and the datapath saw no contact: the position \
                counter has wrapped (contact_unseen in the table)",
        ),
        (
            lost,
            "cells the position counter wrapped under the device, and the loop read another place \
                (position_lost_share in the table): write a greater method.position_bits",
        ),
    ];
    for (count, said) in said.into_iter().filter(|(count, _)| *count > 0) {
        page.line("warning", format!("in {count} {said}"));
    }
    match mapped.missed(method) {
        None => page.data("stiffness_missed", Value::Null),
        Some((count, miss, key)) => page.fact(
            "stiffness_missed",
            "warning",
            json!({ "cells": count, "worst": missed_object(&miss) }),
            format!("in {count} cells the {}", missed(&miss, key)),
        ),
    };
}

/// Adds how often each criterion predicts a cell's verdict.
fn predictions(page: &mut Page, all: Vec<Agreement>) {
    for Agreement { name, failing: [failing, failing_predicted], holding: [holding, holding_predicted] } in all {
        page.fact(
            &format!("predictions.{name}"),
            "criterion",
            json!({
                "failing": failing,
                "failing_predicted": failing_predicted,
                "holding": holding,
                "holding_predicted": holding_predicted,
            }),
            format!(
                "{name}: predicts {failing_predicted} of {failing} cells that fail or go on switching, and \
                 {holding_predicted} of {holding} that hold"
            ),
        );
    }
}

/// Adds the curves of the criteria, or why there are none.
fn criteria(page: &mut Page, curves: &Result<Curves, hpu_study::Error>) {
    let Curves { curves, over_x, .. } = match curves {
        Ok(curves) => curves,
        Err(why) => {
            page.data("curves", json!({ "reason": why.to_string(), "over": null, "criteria": [] }));
            page.note(format!("no curves: {why}"));
            return;
        }
    };
    let over = if *over_x { "y" } else { "x" };
    let met = curves.iter().map(|Curve { name, met, limits, .. }| format!("{name} ({met} of {})", limits.len()));
    let data = json!({ "reason": null, "over": over, "criteria": curves });
    page.fact("curves", "curves", data, met.collect::<Vec<_>>().join(", "));
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
