//! The result of a search over widths as a page. Each device adds its columns and its lines.

use hpu_page::{Column, Field, Page, Table};
use hpu_study::fit::percent;
use hpu_study::widths::search::RatedDesign;
use serde_json::{Value, json};

use super::Searched;
use super::device;
use super::shown::{Shown, cut};

/// Rows of the front in the text.
const ROWS: usize = 40;

fn shown(searched: &Searched) -> Shown<'_> {
    device(&searched.experiment).shown(searched)
}

/// Returns the designs as CSV, cheapest first. Errors and stiffness are measured, logic estimated.
pub fn designs(searched: &Searched) -> String {
    let Shown { fields, designs, .. } = shown(searched);
    Table::of("", designs, fields).csv(&[&searched.command])
}

/// Returns the page.
pub fn page(searched: &Searched) -> Page {
    let Shown { mut fields, reference, lines, smallest, data, .. } = shown(searched);
    let found = &searched.found;
    let mut page = Page::default();
    page.data("scene", &searched.scene).data("command", &searched.command).data("unit", found.unit);
    page.note(format!("{}: which widths buy what", searched.scene));

    let knobs: Vec<String> = searched.knobs.iter().map(ToString::to_string).collect();
    page.data("varied", &knobs);
    labelled(&mut page, "varied", knobs.chunks(3).map(|knobs| knobs.join("  ")));
    let refused: usize = found.refused.iter().map(|(_, count)| count).sum();
    let designs = format!("{}, of which {refused} are refused; {} kinds differ in a run", found.designs, found.kinds);
    page.fact("designs", "designs", found.designs, designs);
    let reasons = found.refused.iter().map(|(why, count)| json!({ "reason": why, "designs": count }));
    page.data("refused", Value::from_iter(reasons));
    for (why, count) in found.refused.iter().take(2) {
        page.line("", format!("{count}: {}", cut(why, 98)));
    }
    let saved = 1.0 - found.runs as f64 / found.grid_runs.max(1) as f64;
    let runs = match found.runs < found.grid_runs {
        true => format!("{} of at least {} of the grid: {} saved", found.runs, found.grid_runs, percent(saved)),
        false => format!(
            "{}; the grid has at least {}, beside the reference's and those around it",
            found.runs, found.grid_runs
        ),
    };
    page.fact("runs", "runs", found.runs, runs).data("grid_runs_at_least", found.grid_runs);
    page.data("failed", &found.failed);
    for why in found.failed.iter().take(2) {
        page.line("failed", cut(why, 98));
    }
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name()).collect();
    page.data("outputs", &outputs).data("within", searched.within).data("estimate_error", found.estimate_error);
    page.line("reference", reference);
    lines.into_iter().for_each(|(label, said)| _ = page.line(label, said));
    data.into_iter().for_each(|(key, value)| _ = page.data(key, value));

    // The reference, the front and the smallest design are objects of the same columns.
    let best: Vec<&RatedDesign> = found.best().collect();
    let one = |point: &RatedDesign, fields: &[Field<RatedDesign>]| {
        let mut table = Table::new("", fields.iter().map(|field| field.column.clone()));
        table.add(fields.iter().map(|field| field.cell(point)));
        table.json()[0].clone()
    };
    page.data("reference", one(&found.reference, &fields));
    page.data("front", best.iter().map(|point| one(point, &fields)).collect::<Value>());
    page.data("smallest", searched.smallest().map(|point| one(point, &fields)));

    let first = best.first().copied();
    let name = move |point: &RatedDesign| match point {
        _ if point == &found.reference => "reference",
        _ if Some(point) == first => "front",
        _ => "",
    };
    fields.insert(0, Column::text("", "").said().least(10).of(name));
    let rows = [&found.reference].into_iter().chain(best.iter().take(ROWS).copied());
    page.note("").table(Table::of("", rows, fields).gap(1));
    if best.len() > ROWS {
        page.line("", format!("and {} more: -o DIR writes all", best.len() - ROWS));
    }
    page.note("");
    let none = || format!("no design keeps the reference's stiffness within {}", percent(searched.lose));
    page.note(smallest.unwrap_or_else(none));
    page
}

/// Adds lines below one label.
fn labelled(page: &mut Page, label: &str, lines: impl IntoIterator<Item = String>) {
    for (index, line) in lines.into_iter().enumerate() {
        page.line(if index == 0 { label } else { "" }, line);
    }
}
