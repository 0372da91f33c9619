//! `hpu diff`: the values in which two results differ.

use std::collections::BTreeMap;
use std::path::Path;

use hpu_page::{Cell, Column, Page, Table, Value};
use hpu_study::fit::percent;
use serde_json::Value as Json;

use crate::page::show;
use crate::run;
use crate::shell::{Exit, Failure, read_text, values};

/// Compare two results, value by value
///
/// A result is a JSON file that a command with --json has printed (or the summary.json, check.json ... that --out
/// wrote), or a scene, which is run first. Rows of a list belong together by their name, key or label. Wall times,
/// speeds per second of wall time, and places of files are left out, because they say nothing of the result.
///
/// Exit code 0: nothing differs; 1: something does.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A JSON file, or a scene: a file, or the name of a shipped scene
    #[arg(value_name = "A")]
    first: String,
    /// The result to compare it with, likewise
    #[arg(value_name = "B")]
    second: String,
    /// Take numbers for equal whose difference is at most this share of the greater one, as in 1% [default: 0]
    #[arg(long, value_name = "SHARE", value_parser = values::share)]
    tolerance: Option<f64>,
    /// Print the differences as one JSON object
    #[arg(long)]
    json: bool,
}

/// Keys that say how long a command took, or where it wrote.
const LEFT_OUT: [&str; 12] = [
    "wall_s",
    "edges_per_s",
    "seconds",
    "motion_per_wall",
    "speedup",
    "speedup_between",
    "wall_between_s",
    "timed",
    "timed_s",
    "remembered",
    "command",
    "files",
];

/// Keys by which a row of a list is known.
const NAMES: [&str; 6] = ["name", "key", "label", "block", "signal", "scene"];

/// Runs `hpu diff`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(first) = result(&args.first)? else { return Ok(Exit::Interrupted) };
    let Some(second) = result(&args.second)? else { return Ok(Exit::Interrupted) };
    let page = page([&args.first, &args.second], args.tolerance.unwrap_or(0.0), [&first, &second]);
    show(&page, args.json)?;
    Ok(Exit::when(page.tables().all(|differences| differences.rows().is_empty())))
}

/// Returns the result of that name: what the file holds, or the summary of the scene's run; `None` when interrupted.
fn result(name: &str) -> Result<Option<Json>, Failure> {
    let path = Path::new(name);
    if path.extension().is_none_or(|extension| extension != "json") {
        return run::summary(name);
    }
    let found: Json = serde_json::from_str(&read_text(path)?).map_err(|error| Failure::at(path, error))?;
    if found.is_object() { Ok(Some(found)) } else { Err(Failure::at(path, "no JSON object, as --json prints")) }
}

/// A value that differs: `None` where a result has no such value.
struct Difference<'a> {
    key: &'a str,
    first: Option<&'a Json>,
    second: Option<&'a Json>,
    relative: Option<f64>,
}

/// Returns the page of the differences between two results of these names.
pub fn page(names: [&str; 2], tolerance: f64, [first, second]: [&Json; 2]) -> Page {
    let [mut a, mut b] = [BTreeMap::new(), BTreeMap::new()];
    flatten(first, "", &mut a);
    flatten(second, "", &mut b);
    let mut keys: Vec<&String> = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key))).collect();
    keys.sort();
    let differences = keys.iter().filter_map(|key| {
        let (first, second) = (a.get(*key).copied(), b.get(*key).copied());
        let relative = first.zip(second).and_then(|(first, second)| relative(first, second));
        let equal = first == second || relative.is_some_and(|relative| relative <= tolerance);
        (!equal).then_some(Difference { key, first, second, relative })
    });
    let table = Table::of(
        "differences",
        differences,
        [
            Column::text("key", "value").of(|of: &Difference| of.key),
            Column::text("a", "A").of(|of: &Difference| cell(of.first)),
            Column::text("b", "B").of(|of: &Difference| cell(of.second)),
            Column::number("relative", "relative")
                .of(|of: &Difference| Cell::new(of.relative).shown(of.relative.map_or(String::new(), percent))),
        ],
    );
    let (compared, count) = (keys.len(), table.rows().len());
    let mut page = Page::default();
    page.fact("a", "A", names[0], names[0]).fact("b", "B", names[1], names[1]);
    page.data("tolerance", tolerance).data("compared", compared).data("equal", count == 0);
    let within = if tolerance > 0.0 { format!(" by more than {}", percent(tolerance)) } else { String::new() };
    page.note(match count {
        0 => format!("none of {compared} values differs{within}"),
        1 => format!("1 of {compared} values differs{within}"),
        count => format!("{count} of {compared} values differ{within}"),
    });
    if count > 0 {
        page.note("");
    }
    page.table(if count > 0 { table } else { Table::new("differences", []) });
    page
}

/// Returns a value as it is; text calls a missing one so.
fn cell(value: Option<&Json>) -> Cell {
    match value {
        None => Cell::new(Value::Absent).shown("missing"),
        Some(Json::String(text)) => Cell::new(text),
        Some(value) => Cell::new(value.clone()),
    }
}

/// Returns the difference of two numbers as a share of the greater one.
fn relative(first: &Json, second: &Json) -> Option<f64> {
    let (first, second) = (first.as_f64()?, second.as_f64()?);
    Some(if first == second { 0.0 } else { (first - second).abs() / first.abs().max(second.abs()) })
}

/// Collects the values of a result by their paths, as in `signals[spring].max`.
fn flatten<'a>(value: &'a Json, at: &str, found: &mut BTreeMap<String, &'a Json>) {
    match value {
        Json::Object(object) => {
            for (key, value) in object.iter().filter(|(key, _)| !LEFT_OUT.contains(&key.as_str())) {
                flatten(value, &if at.is_empty() { key.clone() } else { format!("{at}.{key}") }, found);
            }
        }
        Json::Array(rows) if rows.iter().any(|row| row.is_object() || row.is_array()) => {
            let named = NAMES.into_iter().find(|name| are_told_apart(rows, name));
            for (index, row) in rows.iter().enumerate() {
                let name = named.and_then(|name| row[name].as_str()).map_or(index.to_string(), str::to_string);
                flatten(row, &format!("{at}[{name}]"), found);
            }
        }
        value => drop(found.insert(at.to_string(), value)),
    }
}

/// Returns whether each row has a text at a key, and no two have the same.
fn are_told_apart(rows: &[Json], key: &str) -> bool {
    let mut texts: Vec<Option<&str>> = rows.iter().map(|row| row[key].as_str()).collect();
    texts.sort_unstable();
    texts.iter().all(Option::is_some) && texts.windows(2).all(|pair| pair[0] != pair[1])
}
