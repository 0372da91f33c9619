//! The picture of speed against accuracy: how large the error of each way to run a scene is.

mod plane;

use hpu_study::accuracy::{Chart, Contestant, Entry, Grade, Share, Speed, front_of_shares, time};
use hpu_study::map::{Map, outcome_name};

use crate::drawing::series::{BLACK, BLUE, GREEN, LILAC, MAROON, ORANGE, PURPLE, Style, TAUPE};
use crate::{Picture, page};
use plane::{Height, Inside, Spot, Words};

const X: &str = "seconds of motion per second of wall time";

/// Returns the look of a solver. All reduced models that are computed by exact flow share one look.
fn look(contestant: &Contestant) -> (&'static str, Style) {
    match solver(contestant) {
        "events" => ("events", BLACK),
        "clock" => ("every edge", LILAC),
        "sample" => ("steps of a sample", MAROON),
        "euler" => ("euler", ORANGE),
        "semi_implicit" => ("semi-implicit", GREEN),
        "midpoint" => ("midpoint", BLUE),
        "rk4" => ("rk4", PURPLE),
        "criterion" => ("criterion", TAUPE),
        _ => ("events, reduced model", BLACK),
    }
}

fn solver(contestant: &Contestant) -> &str {
    contestant.family.split('+').next().unwrap_or_default()
}

/// Returns the inside of a marker, which shows what is left out, whatever the solver.
fn inside(contestant: &Contestant) -> Inside {
    let leaves = |part: &str| contestant.family.split('+').any(|left_out| left_out == part);
    match () {
        () if contestant.criterion.is_some() => Inside::Full,
        () if leaves("law") => Inside::Pierced,
        () if leaves("loaded") => Inside::Target,
        () if leaves("averaged") => Inside::Hollow,
        () => Inside::Full,
    }
}

/// Returns the label of a spot. Only one ladder's rungs show their steps, because the steps are the same in all
/// ladders.
fn label(contestant: &Contestant, says_steps: bool, front: bool) -> String {
    let plain = |name: &str| name.replace('_', "-").replace('+', ", ");
    match (contestant.step_s.map(time), contestant.criterion) {
        (_, Some(name)) => name.replace('_', " "),
        (None, None) => plain(&contestant.name),
        (Some(step), None) if front => format!("{}, {step}", plain(&contestant.family)),
        (Some(step), None) if says_steps => step,
        (Some(_), None) => String::new(),
    }
    .replace(" us", " \u{b5}s")
}

/// Whether the contestant is on a ladder that leaves out something besides its steps.
fn is_behind(contestant: &Contestant) -> bool {
    contestant.step_s.is_some() && contestant.family.contains('+')
}

fn spots<'a>(contestants: &'a [(&'a Contestant, f64, Height)], front: &'a [usize], chosen: Option<usize>) -> Vec<Spot> {
    let ladders = || contestants.iter().filter(|(of, ..)| of.step_s.is_some() && !is_behind(of));
    let longest = ladders().max_by_key(|(of, ..)| ladders().filter(|(other, ..)| other.family == of.family).count());
    let all = contestants.iter().enumerate();
    all.map(|(index, (contestant, speed, height))| {
        // Of a ladder's wrong rungs only the first is named: there the ladder stops being right.
        let before = index.checked_sub(1).map(|before| &contestants[before]);
        let wrong_before =
            before.is_some_and(|(other, _, height)| other.family == contestant.family && *height == Height::Wrong);
        let is_named = *height != Height::Wrong || contestant.step_s.is_none() || !wrong_before;
        let on_front = front.contains(&index);
        let says_steps = longest.is_some_and(|(of, ..)| of.family == contestant.family);
        Spot {
            // Criteria are no ladder.
            family: if contestant.criterion.is_some() { contestant.name.clone() } else { contestant.family.clone() },
            speed: *speed,
            height: *height,
            inside: inside(contestant),
            style: look(contestant).1,
            name: label(contestant, true, true),
            label: if is_named { label(contestant, says_steps, on_front) } else { String::new() },
            behind: is_behind(contestant),
            needed: on_front || contestant.step_s.is_none(),
            front: on_front,
            chosen: chosen == Some(index),
        }
    })
    .collect()
}

/// Returns the key of the solvers: one entry for each look, with the names that have it.
fn solvers(contestants: &[(&Contestant, f64, Height)]) -> Vec<(String, Style)> {
    let mut entries: Vec<(String, Style)> = Vec::new();
    for (contestant, ..) in contestants {
        let (name, style) = look(contestant);
        match entries.iter_mut().find(|(_, known)| *known == style) {
            // Exact flow, with or without something left out.
            Some((known, _)) if known != name => *known = "from event to event".to_string(),
            Some(_) => {}
            None => entries.push((name.to_string(), style)),
        }
    }
    entries
}

/// Returns the key of the insides that occur.
fn insides(contestants: &[(&Contestant, f64, Height)]) -> Vec<(&'static str, Inside)> {
    let all = [
        ("nothing else left out", Inside::Full),
        ("averaged bridge", Inside::Hollow),
        ("words without a clock", Inside::Target),
        ("law in floats", Inside::Pierced),
    ];
    let is_there = |of: Inside| contestants.iter().any(|(contestant, ..)| inside(contestant) == of);
    all.into_iter().filter(|(_, of)| is_there(*of)).collect()
}

fn percent(error: f64) -> String {
    format!("{} %", (1e6 * error).round() / 1e4)
}

/// Returns a factor with two digits.
fn times(factor: f64) -> String {
    if factor >= 10.0 { format!("{factor:.0}") } else { format!("{factor:.1}") }
}

/// Returns the findings of the chart in one line of text.
fn findings(chart: &Chart) -> String {
    fn speed(entry: &Entry) -> Option<&Speed> {
        entry.row.as_ref().ok().map(|row| &row.speed)
    }
    let of = |name: &str| chart.entries.iter().find(|entry| entry.contestant.name == name).and_then(speed);
    let factor = |ours: &Speed, other: &Speed, name: &str| match ours.over(other).told() {
        Some(factor) => format!("{} times as fast as {name}", times(factor)),
        None => format!("its speed beside {name} is not told, for it varied"),
    };
    let mut findings = Vec::new();
    if let (Some(events), Some(clock)) = (of("events"), of("clock")) {
        findings.push(format!("events: {}, every register edge equal", factor(events, clock, "clock")));
    }
    if let Some(fastest) = chart.fastest_within() {
        let entry = &chart.entries[fastest];
        let both = speed(entry).zip(of("events")).filter(|_| entry.contestant.name != "events");
        let said = both.map_or(String::new(), |(ours, events)| format!(", {}", factor(ours, events, "events")));
        findings.push(format!("fastest within {}: {}{said}", percent(chart.within), entry.contestant.name));
    }
    findings.join("; ")
}

/// Returns the picture of a chart: speed across, error up, with bands for errors that have no logarithm.
pub fn speed(scene: &str, chart: &Chart, command: &str) -> Picture {
    let mut indices = Vec::new();
    let mut ran = Vec::new();
    for (index, Entry { contestant, row }) in chart.entries.iter().enumerate() {
        if let Ok(row) = row {
            let height = match row.grade {
                Grade::Exact | Grade::Off(0.0) => Height::Floor,
                Grade::Off(error) => Height::At(error),
                Grade::VerdictOnly => Height::Told,
                Grade::Wrong => Height::Wrong,
            };
            indices.push(index);
            ran.push((contestant, row.speed.motion_per_wall(), height));
        }
    }
    let place = |index: usize| indices.iter().position(|other| *other == index);
    let front: Vec<usize> = chart.front().into_iter().filter_map(place).collect();
    let spots = spots(&ran, &front, chart.fastest_within().and_then(place));

    let outputs: Vec<String> = chart.outputs.iter().map(|output| output.name().replace('_', " ")).collect();
    let title = format!("{scene}: speed against accuracy");
    let mut canvas = page(&title, &findings(chart), command);
    let outcome = outcome_name(Some(chart.outcome)).replace('_', " ");
    let words = Words {
        x: X,
        y: format!("error in %: the worst of {}", outputs.join(", ")),
        floor: "0: every register edge equal",
        told: format!("the right verdict, {outcome}, and no more"),
        wrong: format!("another verdict than {outcome}"),
        allowed: Some((chart.within, format!("{} allowed", percent(chart.within)))),
    };
    plane::key(&mut canvas, &solvers(&ran), &insides(&ran), words.allowed.as_ref().map(|(_, text)| text.as_str()));
    plane::draw(&mut canvas, &spots, &words);
    canvas.render("chart")
}

/// Returns the picture of a race over a map: speed across, share of wrong verdicts up.
pub fn shares(scene: &str, map: &Map, shares: &[Share], command: &str) -> Picture {
    let mut indices = Vec::new();
    let mut ran = Vec::new();
    for (index, one) in shares.iter().enumerate() {
        if let (Some(speed), Some(share)) = (&one.speed, one.share()) {
            indices.push(index);
            let height = if one.wrong == 0 { Height::Floor } else { Height::At(share) };
            ran.push((&one.contestant, speed.motion_per_wall(), height));
        }
    }
    let place = |index: usize| indices.iter().position(|other| *other == index);
    let front: Vec<usize> = front_of_shares(shares).into_iter().filter_map(place).collect();
    let spots = spots(&ran, &front, None);
    let axes = format!("{} by {}, {} cells", map.x, map.y, map.layer());
    let mut canvas = page(&format!("{scene}: how often the verdict is wrong"), &axes, command);
    plane::key(&mut canvas, &solvers(&ran), &insides(&ran), None);
    let words = Words {
        x: X,
        y: "cells with another verdict in %".into(),
        floor: "no cell is wrong",
        told: String::new(),
        wrong: String::new(),
        allowed: None,
    };
    plane::draw(&mut canvas, &spots, &words);
    canvas.render("chart")
}
