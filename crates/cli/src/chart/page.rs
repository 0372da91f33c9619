//! A chart of speed against accuracy, for text, JSON and CSV.

use std::collections::BTreeMap;

use hpu_cosim::scene::Output;
use hpu_page::{Cell, Column, Field, Page, Table, Value};
use hpu_study::accuracy::{Chart, Contestant, ContestantResult, Entry, Grade, Race};
use hpu_study::map::outcome_name;

use crate::chart::Charted;
use crate::page;

/// Returns the page of a chart that was stopped.
pub fn interrupted(race: &Race) -> Page {
    let mut page = Page::default();
    page.data("scene", race.written.name.as_str()).data("complete", false);
    page.note("interrupted; wall times are worth nothing by halves, so nothing is written");
    page
}

/// Returns an error in per cent.
pub fn percent(error: f64) -> String {
    match error {
        0.0 => "0".into(),
        error if !error.is_finite() => "wrong".into(),
        error if error > 10.0 => ">1000 %".into(),
        error if error < 1e-4 => format!("{:.0e} %", 100.0 * error),
        error => format!("{:.2} %", 100.0 * error),
    }
}

/// Returns a number with three digits; below 0.01 and from 10 000 on with a power of ten.
fn rate(value: f64) -> String {
    match value {
        value if !value.is_finite() || value <= 0.0 => "-".into(),
        value if !(1e-2..1e4).contains(&value) => format!("{value:.2e}"),
        value => format!("{value:.*}", (2.0 - libm::log10(value).floor()).max(0.0) as usize),
    }
}

/// Returns the columns that name a contestant; text marks those of the front.
pub fn named<'a, T: 'a>(
    contestant: impl Fn(&T) -> &'a Contestant + Copy + 'a,
    in_front: impl Fn(&T) -> bool + 'a,
) -> [Field<'a, T>; 3] {
    let name = move |item: &T| {
        let (name, mark) = (&contestant(item).name, if in_front(item) { '*' } else { ' ' });
        Cell::new(name).shown(format!("{mark} {name}"))
    };
    [
        Column::text("name", "  contestant").file("contestant").of(name),
        Column::text("family", "").data().of(move |item| &contestant(item).family),
        Column::number("step_s", "").data().of(move |item| contestant(item).step_s),
    ]
}

/// Returns a speed with three digits in text.
pub fn speed(value: Option<f64>) -> Cell {
    Cell::new(value).shown(value.map_or("-".into(), rate))
}

/// Returns a chart as a page, whose first table is that of chart.csv.
pub fn page(charted: &Charted) -> Page {
    let Charted { race, chart, command, files, .. } = charted;
    let Chart { outcome, outputs, within, entries } = chart;
    let names: Vec<&str> = outputs.iter().map(|output| output.name()).collect();
    let fastest = chart.fastest_within();
    let name = |index: usize| entries[index].contestant.name.as_str();
    let (scene, share) = (race.written.name.as_str(), percent(*within));
    let mut page = Page::default();
    page.note(format!("$ {command}\n\n{scene}: {}", outcome_name(Some(*outcome))));
    page.note(format!(
        "an error is the worst of {}, against the scene as written from event to event; {share} is allowed\n\
         errors are of the whole motion; where `timed` names the first part of it, the wall time is scaled from there",
        names.join(", "),
    ));
    page.note("").table(table(charted));
    page.note("\n* beaten by none in both speed and error");
    if let Some(fastest) = fastest {
        page.note(format!("fastest within {share}: {}{}", name(fastest), ratio(chart, fastest).unwrap_or_default()));
    }
    let mut refused: Vec<(&str, Vec<&str>)> = Vec::new();
    for Entry { contestant, row } in entries {
        let Err(why) = row else { continue };
        match refused.iter_mut().find(|(known, _)| *known == why.why()) {
            Some((_, all)) => all.push(&contestant.name),
            None => refused.push((why.why(), vec![&contestant.name])),
        }
    }
    for (why, all) in refused {
        let rest = if all.len() > 3 { format!(" and {} more", all.len() - 3) } else { String::new() };
        page.note(format!("not of this scene: {}{rest}: {why}", all[..all.len().min(3)].join(", ")));
    }
    page.data("scene", scene).data("command", command).data("complete", true);
    page.data("outcome", outcome_name(Some(*outcome))).data("outputs", &names).data("within", *within);
    page.data("front", chart.front().into_iter().map(name).collect::<Vec<_>>());
    page.data("fastest_within", fastest.map(name));
    page::files(&mut page, files);
    page
}

/// Returns how many times faster an entry is than `events`, as text with its spread; nothing of `events` itself.
fn ratio(chart: &Chart, of: usize) -> Option<String> {
    let speed = |entry: &Entry| entry.row.as_ref().ok().map(|row| row.speed.clone());
    let events = chart.entries.iter().find(|entry| entry.contestant.name == "events")?;
    let is_other = chart.entries[of].contestant.name != "events";
    let ratio = speed(&chart.entries[of])?.over(&speed(events)?);
    is_other.then(|| format!(", {}", ratio.said("x the speed of events")))
}

/// A contestant, with its number.
type Row<'a> = (usize, &'a Entry);

/// Joins a column with a figure of contestants; one that was refused has no figures.
fn of<'a>(column: Column, cell: impl Fn(&ContestantResult) -> Cell + 'a) -> Field<'a, Row<'a>> {
    column.of(move |(_, entry): &Row| entry.row.as_ref().map_or(Cell::absent(), &cell))
}

/// Returns the contestants. Errors are relative numbers; CSV has an infinite error as `inf`. Text leaves out those that
/// cannot run the scene.
fn table(charted: &Charted) -> Table {
    let Charted { race, chart, .. } = charted;
    let front = chart.front();
    let in_front = |(index, _): &Row| front.contains(index);
    let mut fields = Vec::from(named(|(_, entry): &Row| &entry.contestant, in_front));
    fields.extend(grades());
    for &output in race.written.setup().outputs() {
        fields.push(error_of(output, chart.outputs.contains(&output)));
    }
    fields.extend(runs());
    fields.extend([
        Column::flag("front", "")
            .data()
            .of(|item: &Row| if item.1.row.is_ok() { Value::from(in_front(item)) } else { Value::Absent }),
        Column::text("refused", "")
            .data()
            .of(|(_, entry): &Row| entry.row.as_ref().err().map_or(Value::Absent, |failed| failed.why().into())),
        // A criterion is no run.
        Column::text("replay", "").data().of(|(_, entry): &Row| match entry.contestant.criterion {
            None => Value::from(charted.replay(entry)),
            Some(_) => Value::Absent,
        }),
    ]);
    let refused = |index: usize| chart.entries[index].row.is_err();
    Table::of("contestants", chart.entries.iter().enumerate(), fields).without(refused)
}

/// Returns the columns of grades and speeds.
fn grades<'a>() -> [Field<'a, Row<'a>>; 9] {
    let error = |row: &ContestantResult| match row.grade {
        Grade::Exact => "0: every register edge equal".into(),
        Grade::Off(error) => percent(error).into(),
        Grade::VerdictOnly => "right verdict, and no more".into(),
        Grade::Wrong => "wrong".into(),
    };
    let overrides =
        |(_, entry): &Row| Value::of(entry.contestant.overrides.iter().cloned().collect::<BTreeMap<_, _>>());
    let grade = |(_, entry): &Row| entry.row.as_ref().map_or("refused", |row| row.grade.name());
    let per_wall = |row: &ContestantResult| speed(Some(row.speed.motion_per_wall()));
    [
        Column::text("overrides", "").in_json().of(overrides),
        Column::text("grade", "").in_files().of(grade),
        of(Column::text("grade", "").in_json(), |row| row.grade.name().into()),
        of(Column::number("motion_per_wall", "motion/wall").said(), per_wall),
        of(Column::number("edges_per_s", "edges/s").said(), |row| speed(Some(row.speed.edges_per_s()))),
        of(Column::text("timed", "timed").said(), |row| row.speed.timed().into()),
        of(Column::number("error", "").data(), |row| row.grade.error().into()),
        of(Column::text("", "error").said(), error),
        of(Column::text("errors", "").in_json(), |_| Value::of(BTreeMap::<String, ()>::new()).into()),
    ]
}

/// Returns the column of the errors of an output, which stand in text if the output is judged.
fn error_of<'a>(output: Output, is_judged: bool) -> Field<'a, Row<'a>> {
    let column = Column::number(&format!("errors.{}", output.name()), output.name());
    let column = column.file(&format!("{}_error", output.name()));
    let column = if is_judged { column } else { column.data() };
    column.of(move |(_, entry): &Row| {
        let Ok(row) = &entry.row else { return Cell::absent() };
        let error = row.errors.iter().find(|(of, _)| *of == output).map(|(_, error)| *error);
        let cell = error.map_or(Cell::absent(), Cell::new);
        match (row.grade, error) {
            (Grade::Exact | Grade::VerdictOnly, _) => cell.shown(""),
            _ if entry.contestant.criterion.is_some() => cell.shown(""),
            (_, None) => cell.shown("-"),
            (_, Some(0.0)) if output == Output::Verdict => cell.shown("right"),
            (_, Some(error)) => cell.shown(percent(error)),
        }
    })
}

/// Returns the columns of outcomes and times.
fn runs<'a>() -> [Field<'a, Row<'a>>; 13] {
    let outcome = |row: &ContestantResult| row.outcome.map(|outcome| outcome_name(Some(outcome))).into();
    let between = |row: &ContestantResult| {
        let wall_s = row.speed.wall_s();
        [wall_s.low, wall_s.high].into()
    };
    let slow = |row: &ContestantResult| {
        let slow = |shortened_s| format!("(slow: over {shortened_s} s of motion, as its reference)");
        row.shortened_s.map_or(String::new(), slow).into()
    };
    [
        of(Column::text("outcome", "").data(), outcome),
        of(Column::number("motion_s", "").data(), |row| row.speed.motion_s.into()),
        of(Column::number("wall_s", "").data(), |row| row.speed.wall_s().median.into()),
        of(Column::text("wall_between_s", "").in_json(), between),
        of(Column::number("motion_per_wall", "").data(), |row| row.speed.motion_per_wall().into()),
        of(Column::integer("edges", "").data(), |row| row.speed.edges.into()),
        of(Column::number("edges_per_s", "").data(), |row| row.speed.edges_per_s().into()),
        of(Column::integer("runs", "").data(), |row| (row.speed.walls_s.len() as u64).into()),
        of(Column::text("timed", "").data(), |row| row.speed.timed().into()),
        of(Column::number("timed_s", "").in_json(), |row| row.speed.timed_s.into()),
        of(Column::number("shortened_s", "").in_json(), |row| row.shortened_s.into()),
        of(Column::flag("shortened", "").in_files(), |row| row.shortened_s.is_some().into()),
        of(Column::text("", "").said(), slow),
    ]
}
