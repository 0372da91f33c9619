//! A chart of speed against accuracy as text and as JSON.

use hpu_cosim::scene::Output;
use hpu_study::accuracy::{Chart, Contestant, Entry, Grade, Race, Row, grade_name};
use hpu_study::map::outcome_name;
use serde_json::{Map, Value, json};

use crate::chart::Charted;
use crate::exit::{Exit, Failure};
use crate::terminal::{print, print_json};

/// Reports that a chart was stopped.
pub fn interrupted(race: &Race, as_json: bool) -> Result<Exit, Failure> {
    if as_json {
        print_json(&json!({ "scene": race.written.name, "complete": false }))?;
    } else {
        print("interrupted; wall times are worth nothing by halves, so nothing is written\n")?;
    }
    Ok(Exit::Interrupted)
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
pub fn rate(value: f64) -> String {
    match value {
        value if !value.is_finite() || value <= 0.0 => "-".into(),
        value if !(1e-2..1e4).contains(&value) => format!("{value:.2e}"),
        value => format!("{value:.*}", (2.0 - value.log10().floor()).max(0.0) as usize),
    }
}

fn error_of(row: &Row, output: Output) -> Option<f64> {
    row.errors.iter().find(|(of, _)| *of == output).map(|(_, error)| *error)
}

/// The width of the names at the left of a table of contestants. A longer name runs over it.
const NAME: usize = 30;

/// Returns a chart as text.
pub fn text(charted: &Charted) -> String {
    let Charted { race, chart, command, files, .. } = charted;
    let Chart { outcome, outputs, within, entries } = chart;
    let names: Vec<&str> = outputs.iter().map(|output| output.name()).collect();
    let mut text = format!("$ {command}\n\n{}: {}\n", race.written.name, outcome_name(Some(*outcome)));
    text += &format!(
        "an error is the worst of {}, against the scene as written from event to event; {} is allowed\n\
         errors are of the whole motion; where `timed` names the first part of it, the wall time is scaled from there\n\n",
        names.join(", "),
        percent(*within)
    );
    text +=
        &format!("  {:<NAME$} {:>11} {:>10} {:>12}  {:<10}", "contestant", "motion/wall", "edges/s", "timed", "error");
    text.extend(names.iter().map(|name| format!(" {name:>16}")));
    text += "\n";
    let front = chart.front();
    for (index, entry) in entries.iter().enumerate() {
        let Ok(row) = &entry.row else { continue };
        let mark = if front.contains(&index) { '*' } else { ' ' };
        text += &format!("{mark} {}\n", line(entry, row, outputs).trim_end());
    }
    text += "\n* beaten by none in both speed and error\n";
    if let Some(fastest) = chart.fastest_within() {
        text += &format!("fastest within {}: {}", percent(*within), entries[fastest].contestant.name);
        text += &format!("{}\n", ratio(chart, fastest).unwrap_or_default());
    }
    let mut refused: Vec<(&str, Vec<&str>)> = Vec::new();
    for entry in entries {
        if let Err(why) = &entry.row {
            match refused.iter_mut().find(|(known, _)| known == why) {
                Some((_, all)) => all.push(&entry.contestant.name),
                None => refused.push((why, vec![&entry.contestant.name])),
            }
        }
    }
    for (why, all) in refused {
        let rest = if all.len() > 3 { format!(" and {} more", all.len() - 3) } else { String::new() };
        text += &format!("not of this scene: {}{rest}: {why}\n", all[..all.len().min(3)].join(", "));
    }
    text + &files.iter().map(|file| format!("file       {}\n", file.display())).collect::<String>()
}

/// Returns how many times faster an entry is than `events`.
fn ratio(chart: &Chart, of: usize) -> Option<String> {
    if chart.entries[of].contestant.name == "events" {
        return None;
    }
    let speed = |entry: &Entry| entry.row.as_ref().ok().map(|row| row.speed.motion_per_wall());
    let events = chart.entries.iter().find(|entry| entry.contestant.name == "events").and_then(speed)?;
    Some(format!(", {:.1} x the speed of events", speed(&chart.entries[of])? / events))
}

fn line(entry: &Entry, row: &Row, outputs: &[Output]) -> String {
    let Contestant { name, .. } = &entry.contestant;
    let speed = row.speed;
    let error = match row.grade {
        Grade::Exact => "0: every register edge equal".into(),
        Grade::Off(error) => percent(error),
        Grade::VerdictOnly => "right verdict, and no more".into(),
        Grade::Wrong => "wrong".to_string(),
    };
    let mut line = format!(
        "{name:<NAME$} {:>11} {:>10} {:>12}  {error:<10}",
        rate(speed.motion_per_wall()),
        rate(speed.edges_per_s()),
        speed.timed()
    );
    if matches!(row.grade, Grade::Off(_) | Grade::Wrong) && entry.contestant.criterion.is_none() {
        for output in outputs {
            let error = match error_of(row, *output) {
                Some(0.0) if *output == Output::Verdict => "right".into(),
                error => error.map_or("-".into(), percent),
            };
            line += &format!(" {error:>16}");
        }
    }
    if let Some(shortened_s) = row.shortened_s {
        line += &format!("  (slow: over {shortened_s} s of motion, as its reference)");
    }
    line
}

/// Returns a chart as JSON.
pub fn object(charted: &Charted) -> Value {
    let Charted { race, chart, command, files, .. } = charted;
    let front = chart.front();
    let name = |index: usize| chart.entries[index].contestant.name.as_str();
    let entries: Vec<Value> = (0..chart.entries.len())
        .map(|index| {
            let entry = &chart.entries[index];
            let Contestant { name, family, step_s, overrides, criterion } = &entry.contestant;
            let overrides: Map<String, Value> =
                overrides.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
            let mut object = json!({ "name": name, "family": family, "step_s": step_s, "overrides": overrides });
            if criterion.is_none() {
                object["replay"] = json!(charted.replay(entry));
            }
            match &entry.row {
                Err(why) => object["refused"] = json!(why),
                Ok(row) => {
                    let errors: Map<String, Value> =
                        row.errors.iter().map(|(output, error)| (output.name().into(), json!(error))).collect();
                    object["grade"] = json!(grade_name(row.grade));
                    object["error"] = json!(row.grade.error());
                    object["errors"] = json!(errors);
                    object["outcome"] = json!(row.outcome.map(|outcome| outcome_name(Some(outcome))));
                    object["shortened_s"] = json!(row.shortened_s);
                    object["motion_s"] = json!(row.speed.motion_s);
                    object["wall_s"] = json!(row.speed.wall_s);
                    object["motion_per_wall"] = json!(row.speed.motion_per_wall());
                    object["edges"] = json!(row.speed.edges);
                    object["edges_per_s"] = json!(row.speed.edges_per_s());
                    object["runs"] = json!(row.speed.runs);
                    object["timed"] = json!(row.speed.timed());
                    object["timed_s"] = json!(row.speed.timed_s);
                    object["front"] = json!(front.contains(&index));
                }
            }
            object
        })
        .collect();
    json!({
        "scene": race.written.name,
        "command": command,
        "complete": true,
        "outcome": outcome_name(Some(chart.outcome)),
        "outputs": chart.outputs.iter().map(|output| output.name()).collect::<Vec<_>>(),
        "within": chart.within,
        "contestants": entries,
        "front": front.into_iter().map(name).collect::<Vec<_>>(),
        "fastest_within": chart.fastest_within().map(name),
        "files": files,
    })
}
