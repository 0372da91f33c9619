//! Speed against accuracy: where each way to run a scene stops being true.

mod labels;
mod plane;

use plotters::style::RGBColor;

use crate::accuracy::{Chart, Contestant, Entry, Grade, Share, front_of_shares, time};
use crate::map::{Map, outcome_name};

use super::canvas::{Anchor, BLUE, GREEN, INK, ORANGE, QUIET, RED, WALL};
use super::map::shortened;
use super::{Picture, page};
use plane::{Height, Shape, Spot, Words};

const X: &str = "seconds of motion per second of wall time";
const PURPLE: RGBColor = RGBColor(128, 64, 144);
const TEAL: RGBColor = RGBColor(0, 128, 128);

/// One colour a solver; models that leave something out and are flowed exactly have one together.
fn color(contestant: &Contestant) -> RGBColor {
    match solver(contestant) {
        "events" => INK,
        "clock" => QUIET,
        "sample" => PURPLE,
        "euler" => RED,
        "semi_implicit" => ORANGE,
        "midpoint" => GREEN,
        "rk4" => BLUE,
        "criterion" => WALL,
        _ => TEAL,
    }
}

fn solver(contestant: &Contestant) -> &str {
    contestant.family.split('+').next().unwrap_or_default()
}

/// The shape tells what is left out, whatever the solver.
fn shape(contestant: &Contestant) -> Shape {
    let leaves = |part: &str| contestant.family.split('+').any(|left_out| left_out == part);
    match () {
        () if contestant.criterion.is_some() => Shape::Diamond,
        () if leaves("law") => Shape::Square,
        () if leaves("loaded") => Shape::Triangle,
        () if leaves("averaged") => Shape::Ring,
        () => Shape::Dot,
    }
}

/// What a spot is called: a rung by its step alone, but for the first of its ladder; one behind others by nothing.
fn label(contestant: &Contestant, first: bool, front: bool) -> String {
    let plain = |name: &str| name.replace('_', "-").replace('+', ", ");
    match (contestant.step_s.map(time), contestant.criterion) {
        (_, Some(name)) => name.replace('_', " "),
        (None, None) => plain(&contestant.name),
        (Some(step), None) if front => format!("{}, {step}", plain(&contestant.family)),
        (Some(_), None) if is_behind(contestant) => String::new(),
        (Some(step), None) if first => format!("{}, {step}", plain(&contestant.family)),
        (Some(step), None) => step,
    }
    .replace(" us", " \u{b5}s")
}

/// Whether it is on a ladder that leaves something out beside its steps.
fn is_behind(contestant: &Contestant) -> bool {
    contestant.step_s.is_some() && contestant.family.contains('+')
}

/// A colour half way to white.
fn pale(RGBColor(r, g, b): RGBColor) -> RGBColor {
    let half = |of: u8| of / 2 + 127;
    RGBColor(half(r), half(g), half(b))
}

fn spots<'a>(contestants: &'a [(&'a Contestant, f64, Height)], front: &'a [usize], chosen: Option<usize>) -> Vec<Spot> {
    let all = contestants.iter().enumerate();
    all.map(|(index, (contestant, speed, height))| {
        let first = (0..contestants.len()).find(|other| contestants[*other].0.family == contestant.family);
        // Of the rungs that are wrong the first says where its ladder stops being true.
        let before = index.checked_sub(1).map(|before| &contestants[before]);
        let wrong_before =
            before.is_some_and(|(other, _, height)| other.family == contestant.family && *height == Height::Wrong);
        let is_named = *height != Height::Wrong || contestant.step_s.is_none() || !wrong_before;
        let on_front = front.contains(&index);
        Spot {
            // Criteria are no ladder.
            family: if contestant.criterion.is_some() { contestant.name.clone() } else { contestant.family.clone() },
            speed: *speed,
            height: *height,
            shape: shape(contestant),
            color: if is_behind(contestant) && !on_front { pale(color(contestant)) } else { color(contestant) },
            label: if is_named { label(contestant, first == Some(index), on_front) } else { String::new() },
            behind: is_behind(contestant),
            needed: on_front || contestant.step_s.is_none(),
            front: on_front,
            chosen: chosen == Some(index),
        }
    })
    .collect()
}

/// The key: one entry a solver, and what the shapes are.
fn entries(contestants: &[(&Contestant, f64, Height)]) -> Vec<(String, Shape, RGBColor)> {
    let mut entries: Vec<(String, Shape, RGBColor)> = Vec::new();
    let mut add = |text: String, shape, color| {
        if !entries.iter().any(|(known, ..)| *known == text) {
            entries.push((text, shape, color));
        }
    };
    for (contestant, ..) in contestants.iter().filter(|(contestant, ..)| contestant.step_s.is_some()) {
        add(solver(contestant).replace('_', "-"), Shape::Dot, color(contestant));
    }
    for (contestant, ..) in contestants {
        match shape(contestant) {
            Shape::Ring => add("averaged bridge".into(), Shape::Ring, QUIET),
            Shape::Triangle => add("words without a clock".into(), Shape::Triangle, QUIET),
            Shape::Square => add("law in floats".into(), Shape::Square, QUIET),
            Shape::Diamond => add("criterion".into(), Shape::Diamond, WALL),
            Shape::Dot => {}
        }
    }
    entries
}

fn percent(error: f64) -> String {
    format!("{} %", (1e6 * error).round() / 1e4)
}

/// A factor with two digits.
fn times(factor: f64) -> String {
    if factor >= 10.0 { format!("{factor:.0}") } else { format!("{factor:.1}") }
}

/// What the chart says, in one line.
fn findings(chart: &Chart) -> String {
    let speed = |entry: &Entry| entry.row.as_ref().ok().map(|row| row.speed.motion_per_wall());
    let of = |name: &str| chart.entries.iter().find(|entry| entry.contestant.name == name).and_then(speed);
    let mut findings = Vec::new();
    if let (Some(events), Some(clock)) = (of("events"), of("clock")) {
        findings.push(format!("events: {} times as fast as clock, every register edge equal", times(events / clock)));
    }
    if let Some(fastest) = chart.fastest_within() {
        let entry = &chart.entries[fastest];
        let factor = speed(entry).zip(of("events")).map(|(ours, events)| ours / events);
        let factor = factor.filter(|_| entry.contestant.name != "events");
        let factor = factor.map_or(String::new(), |factor| format!(", {} times as fast as events", times(factor)));
        findings.push(format!("fastest within {}: {}{factor}", percent(chart.within), entry.contestant.name));
    }
    findings.join("; ")
}

/// The picture of a chart: speed across, error up, what has neither in bands.
#[must_use]
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
    let mut canvas = page(&title, &findings(chart), &shortened(command));
    let outcome = outcome_name(Some(chart.outcome)).replace('_', " ");
    let y = format!("error up: the worst of {}; the scene as written: {outcome}", outputs.join(", "));
    plane::key(&mut canvas, (60, 166), &entries(&ran));
    canvas.text((60, 222), y.as_str(), 26, INK, Anchor::Left);
    let words = Words {
        x: X,
        floor: "0: every register edge equal",
        told: "the right verdict, and no more",
        wrong: "wrong verdict",
        allowed: Some((chart.within, format!("{} allowed", percent(chart.within)))),
    };
    plane::draw(&mut canvas, &spots, &words);
    canvas.render("chart")
}

/// The picture of a chart over a map: speed across, share of wrong verdicts up.
#[must_use]
pub fn shares(scene: &str, map: &Map, shares: &[Share], command: &str) -> Picture {
    let mut indices = Vec::new();
    let mut ran = Vec::new();
    for (index, one) in shares.iter().enumerate() {
        if let (Some(speed), Some(share)) = (one.speed, one.share()) {
            indices.push(index);
            let height = if one.wrong == 0 { Height::Floor } else { Height::At(share) };
            ran.push((&one.contestant, speed.motion_per_wall(), height));
        }
    }
    let place = |index: usize| indices.iter().position(|other| *other == index);
    let front: Vec<usize> = front_of_shares(shares).into_iter().filter_map(place).collect();
    let spots = spots(&ran, &front, None);
    let axes = format!("{} by {}, {} cells", map.x, map.y, map.layer());
    let mut canvas = page(&format!("{scene}: how often the verdict is wrong"), &axes, &shortened(command));
    plane::key(&mut canvas, (60, 166), &entries(&ran));
    let y = "up: share of cells with another verdict than the scene as written".to_string();
    canvas.text((60, 222), y.as_str(), 26, INK, Anchor::Left);
    let words = Words { x: X, floor: "no cell is wrong", told: "", wrong: "", allowed: None };
    plane::draw(&mut canvas, &spots, &words);
    canvas.render("chart")
}
