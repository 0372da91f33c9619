//! The picture of the stiffnesses at which a wall settles: sets and criteria side by side.

use hpu_cosim::figure;
use plotters::style::RGBColor;

use hpu_prove::criteria::Criterion;
use hpu_prove::linear::StableSet;
use hpu_study::limits::{Group, Limits, Unknown, WordsSet};
use hpu_study::map::Axis;

use crate::drawing::canvas::{Anchor, Canvas, GRID, HEIGHT, INK, QUIET, WIDTH};
use crate::drawing::map_frame::marks;
use crate::drawing::series::{BLACK, BLANK, BLUE, Look, MAROON, RUST, SAND, SKY, Style, entry, mark};
use crate::{Picture, dotted, page};

const LEFT: i32 = 470;
const RIGHT: i32 = WIDTH - 90;
const TOP: i32 = 250;
const BOTTOM: i32 = HEIGHT - 170;

/// The horizontal scale of stiffnesses on the page.
struct Scale<'a> {
    axis: &'a Axis,
}

impl Scale<'_> {
    fn x(&self, stiffness: f64) -> i32 {
        let share = self.axis.position(stiffness) / (self.axis.cells() - 1) as f64;
        LEFT + (f64::from(RIGHT - LEFT) * share.clamp(0.0, 1.0)).round() as i32
    }

    /// Whether the stiffness is on the page.
    fn holds(&self, stiffness: f64) -> bool {
        (0.0..=(self.axis.cells() - 1) as f64).contains(&self.axis.position(stiffness))
    }

    fn band(&self, canvas: &mut Canvas, y: i32, [from, to]: [f64; 2], color: RGBColor) {
        canvas.fill([(self.x(from), y - 24), (self.x(to).max(self.x(from) + 2), y + 24)], color);
    }
}

/// Returns the picture of a scene's limits over stiffness: the linear loop's set with an ideal drive and as it is
/// driven, its set over a box if one was asked for, the stiffness words that were run with the number of phases at
/// which each settles, and the criteria.
pub fn limits(scene: &str, found: &Limits, over: &[Unknown], command: &str) -> Picture {
    let unit = dotted(unit_of(found));
    let what = found.varied.as_deref().unwrap_or("stiffnesses");
    let proved = match &found.driven {
        _ if found.varied.is_some() => None,
        Ok(_) => Some("linear loop: proved where it settles".to_string()),
        Err(_) => Some("linear loop as driven: not worked out".to_string()),
    };
    let mut conditions: Vec<String> = proved.into_iter().collect();
    if let Ok(set) = &found.in_words {
        let worlds = if set.worlds > 1 { format!(" in each of {} worlds", set.worlds) } else { String::new() };
        let phases = set.phases / set.worlds;
        conditions.push(format!(
            "in words: {} of {} words, {phases} phases of the contact{worlds}",
            set.seen.len(),
            set.words
        ));
    }
    let mut canvas = page(&format!("{scene}: at which {what} the wall settles"), &conditions.join("; "), command);
    if !over.is_empty() {
        let all: Vec<String> = over.iter().map(|unknown| unknown.to_string()).collect();
        canvas.text((60, 164), format!("box: {}", all.join(", ")), 26, QUIET, Anchor::Left);
    }
    let Ok(axis) = Axis::new("wall.stiffness", (found.range[0], found.range[1]), "", 2, true) else {
        return canvas.render("limits");
    };
    let scale = Scale { axis: &axis };
    canvas.panel();
    let areas = [("settles", SKY), ("at some phases", SAND), ("does not", MAROON.color), ("not told", BLANK)];
    let mut x = LEFT;
    for (text, color) in areas {
        x = entry(&mut canvas, (x, 214), (text, Look::Area(color)), 26);
    }
    if found.varied.is_none() {
        x = entry(&mut canvas, (x, 214), ("criterion, met", Look::Points(BLUE)), 26);
        entry(&mut canvas, (x, 214), ("an assumption is not met", Look::Points(RUST)), 26);
    }
    for (value, label) in marks(&axis, 12) {
        let x = scale.x(value);
        canvas.line(vec![(x, TOP), (x, BOTTOM)], GRID, 2);
        canvas.text((x, BOTTOM + 28), label, 26, QUIET, Anchor::Centre);
    }
    let label = found.varied.clone().unwrap_or_else(|| format!("stiffness in {unit}"));
    canvas.text(((LEFT + RIGHT) / 2, BOTTOM + 66), label, 26, INK, Anchor::Centre);

    let named = |canvas: &mut Canvas, y: i32, name: &str| canvas.text((LEFT - 24, y), name, 26, INK, Anchor::Right);
    let mut y = TOP + 40;
    named(&mut canvas, y, "linear loop, ideal drive");
    linear(&mut canvas, &scale, y, &found.linear);
    if found.varied.is_none() {
        y += 70;
        named(&mut canvas, y, "linear loop, as driven");
        linear(&mut canvas, &scale, y, &found.driven.clone().map(|set| set.set).map_err(|reason| reason.why));
    }
    if let Some(set) = &found.in_box {
        y += 70;
        named(&mut canvas, y, "ideal drive, whole box");
        match set {
            Ok(set) => {
                scale.band(&mut canvas, y, found.range, MAROON.color);
                set.at_points.iter().for_each(|stretch| scale.band(&mut canvas, y, *stretch, BLANK));
                set.proved.iter().for_each(|stretch| scale.band(&mut canvas, y, *stretch, SKY));
            }
            Err(why) => canvas.text((LEFT + 10, y), why.to_string(), 24, QUIET, Anchor::Left),
        }
    }
    y += 70;
    named(&mut canvas, y, "in words");
    match &found.in_words {
        Ok(set) => y = words(&mut canvas, &scale, y, set),
        Err(why) => canvas.text((LEFT + 10, y), why.to_string(), 24, QUIET, Anchor::Left),
    }
    let rows = found.criteria.len().max(1) as i32;
    let step = ((BOTTOM - y - 60) / rows).min(52);
    for (row, criterion) in (1..).zip(&found.criteria) {
        criterion_row(&mut canvas, &scale, y + 20 + step * row, criterion);
    }
    canvas.line(vec![(LEFT, TOP), (RIGHT, TOP), (RIGHT, BOTTOM), (LEFT, BOTTOM), (LEFT, TOP)], INK, 2);
    canvas.render("limits")
}

fn unit_of(found: &Limits) -> &'static str {
    match (&found.linear, &found.in_words) {
        (Ok(set), _) => set.unit,
        (_, Ok(set)) => set.unit,
        _ => "",
    }
}

fn linear(canvas: &mut Canvas, scale: &Scale, y: i32, set: &Result<StableSet, impl std::fmt::Display>) {
    match set {
        Ok(set) => {
            scale.band(canvas, y, set.range, MAROON.color);
            set.open.iter().for_each(|stretch| scale.band(canvas, y, *stretch, BLANK));
            set.stable.iter().for_each(|stretch| scale.band(canvas, y, [stretch.from.at, stretch.to.at], SKY));
        }
        Err(why) => canvas.text((LEFT + 10, y), why.to_string(), 24, QUIET, Anchor::Left),
    }
}

/// Draws the groups as a band, and below it each word that was run, at the share of its phases that settle. Returns the
/// vertical position where the drawing ends.
fn words(canvas: &mut Canvas, scale: &Scale, y: i32, set: &WordsSet) -> i32 {
    for (group, from, to) in set.groups() {
        let color = match group {
            Group::All => SKY,
            Group::Some => SAND,
            Group::None => MAROON.color,
            Group::NotTold => BLANK,
        };
        scale.band(canvas, y, [from.stiffness, to.stiffness], color);
    }
    let (top, bottom) = (y + 60, y + 260);
    let phases = i64::from(set.phases);
    for tick in [0, phases / 2, phases] {
        let height = bottom - ((bottom - top) as i64 * tick / phases) as i32;
        canvas.line(vec![(LEFT, height), (RIGHT, height)], GRID, 2);
        canvas.text((LEFT - 14, height), tick.to_string(), 24, QUIET, Anchor::Right);
    }
    canvas.text((LEFT - 90, (top + bottom) / 2), "runs that settle", 26, INK, Anchor::Right);
    for seen in &set.seen {
        let height = bottom - ((bottom - top) as i64 * i64::from(seen.settled) / phases) as i32;
        mark(canvas, (scale.x(seen.stiffness), height), BLACK, 5);
    }
    bottom + 30
}

fn criterion_row(canvas: &mut Canvas, scale: &Scale, y: i32, criterion: &Criterion) {
    let style: Style = if criterion.assumptions_met() { BLUE } else { RUST };
    canvas.text((LEFT - 24, y), criterion.name.replace('_', " "), 26, INK, Anchor::Right);
    let x = scale.x(criterion.limit);
    let value = figure(criterion.limit);
    if scale.holds(criterion.limit) {
        canvas.line(vec![(LEFT, y), (x, y)], GRID, 3);
        mark(canvas, (x, y), style, 11);
        let (to, anchor) = if x > RIGHT - 300 { (x - 20, Anchor::Right) } else { (x + 20, Anchor::Left) };
        canvas.text((to, y), value, 24, QUIET, anchor);
    } else if criterion.limit > 0.0 && x >= RIGHT {
        canvas.text((RIGHT - 12, y), format!("{value}, beyond this page"), 24, QUIET, Anchor::Right);
    } else {
        canvas.text((LEFT + 12, y), format!("{value}, below this page"), 24, QUIET, Anchor::Left);
    }
}
