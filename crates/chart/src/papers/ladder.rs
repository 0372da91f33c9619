//! The picture of the ladder of models: which claims each rung reproduces, and how stiff its walls may be.

use hpu_cosim::scene::Direction;
use plotters::style::RGBColor;

use hpu_papers::phantom::ladder::Summary;
use hpu_papers::phantom::{Agreement, DEVICE, brief, plus};
use hpu_papers::studies::summing::Finding;

use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, WIDTH};
use crate::drawing::log_panel::{decades, dotted, legend, log_panel, style};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLANK, SAND, SKY};
use crate::{Picture, page};

const LEFT: i32 = 400;
const TOP: i32 = 290;
const ROW: i32 = 50;

/// Returns the picture of rungs against claims and, below, the stiffest passive wall of each platform along y (or the
/// first axis that there is).
///
/// # Panics
///
/// If there is no rung.
pub fn ladder(rungs: &[Summary], command: &str) -> Picture {
    let title = format!("{DEVICE} drop test: which claims of Sevcik et al. 2009 each model reproduces");
    let drawn = rungs[0].tables.drawn();
    let conditions = if rungs[0].tables.each().len() > 1 {
        format!(
            "{drawn}; k/n: met in k of n seeds; m+s: m at all, s at some; each model has all above it; \
             ?: its table does not tell"
        )
    } else {
        format!("{drawn}; each model has all that those above it have; ?: its table does not tell")
    };
    let mut canvas = page(&title, &conditions, command);
    let claims = &rungs[0].claims;
    let width = (WIDTH - 60 - LEFT) / (claims.len() as i32 + 1);
    let column = |index: i32| LEFT + index * width;
    head(&mut canvas, column(0) + width / 2, "printed", "cells as printed");
    for (index, claim) in (1..).zip(claims) {
        head(&mut canvas, column(index) + width / 2, claim.first().name, claim.first().short);
    }
    for (row, rung) in (0..).zip(rungs) {
        let (top, y) = (TOP + row * ROW, TOP + row * ROW + ROW / 2);
        canvas.text((LEFT - 24, y), rung.rung.name, 28, INK, Anchor::Right);
        let Agreement { legible, same, mixed } = rung.agreement;
        let same = plus(same, mixed);
        canvas.text((column(0) + width / 2, y), format!("{same}/{legible}"), 26, INK, Anchor::Centre);
        for (index, claim) in (1..).zip(&rung.claims) {
            let finding = claim.finding();
            let (left, right) = (column(index) + 3, column(index + 1) - 3);
            let (from, to) = (top + 3, top + ROW - 3);
            canvas.fill([(left, from), (right, to)], fill(finding));
            if let Finding::MetInSome { met, seeds } = finding {
                // The share of seeds at which the claim is met, from the left.
                canvas.fill([(left, from), (left + (right - left) * met as i32 / seeds as i32, to)], SKY);
            }
            canvas.text((column(index) + width / 2, y), brief(finding), 26, INK, Anchor::Centre);
        }
    }
    let findings = || rungs.iter().flat_map(|rung| &rung.claims).map(|claim| claim.finding());
    let some = findings().any(|finding| matches!(finding, Finding::MetInSome { .. }));
    for (finding, name) in [(Finding::Confirmed, "met"), (Finding::NotConfirmed, "not"), (Finding::CannotBeTold, "?")] {
        if findings().any(|other| other == finding) || some && finding != Finding::CannotBeTold {
            canvas.declare(name, fill(finding), None);
        }
    }
    stiffest(&mut canvas, rungs);
    canvas.render("ladder")
}

/// Returns the colour of a claim's field; where seeds differ, the colour of the share at which the claim is not met.
const fn fill(finding: Finding) -> RGBColor {
    match finding {
        Finding::Confirmed => SKY,
        Finding::NotConfirmed | Finding::MetInSome { .. } => SAND,
        Finding::CannotBeTold => BLANK,
    }
}

/// Draws a column's head: its name, and a few words in lines that fit.
fn head(canvas: &mut Canvas, x: i32, name: &str, words: &str) {
    canvas.text((x, TOP - 126), name, 28, INK, Anchor::Centre);
    let mut lines: Vec<String> = Vec::new();
    for word in words.split(' ') {
        match lines.last_mut() {
            Some(line) if line.len() + word.len() < 12 => *line += &format!(" {word}"),
            _ => lines.push(word.to_string()),
        }
    }
    for (index, line) in (0..).zip(lines) {
        canvas.text((x, TOP - 88 + 30 * index), line, 22, QUIET, Anchor::Centre);
    }
}

fn stiffest(canvas: &mut Canvas, rungs: &[Summary]) {
    let table = rungs[0].tables.first();
    let axis = table.axes.iter().copied().find(|axis| *axis == Direction::Y).or(table.axes.first().copied());
    let axis = axis.unwrap_or(Direction::Y);
    let rows = &table.stiffnesses_n_per_m;
    let (first, last) = (rows.first().copied().unwrap_or(1.0), rows.last().copied().unwrap_or(10.0));
    let top = TOP + rungs.len() as i32 * ROW + 120;
    let vertical = log_panel([(LEFT, top), (WIDTH - 320, 1310)], 1.0..10.0, 0.5 * first..1.5 * last);
    let panel = Panel { x: -0.5..rungs.len() as f64 - 0.5, ..vertical };
    decades(&panel, canvas);
    let name = format!(
        "stiffest wall up to which all is passive at every seed along {}, \
         and a line up to the stiffest that is at some",
        axis.name()
    );
    canvas.text((LEFT, top - 34), name, 28, INK, Anchor::Left);
    panel.y_name(canvas, "stiffness in N/m");
    let (_, foot) = panel.at(panel.x.start, libm::log10(0.5 * first));
    canvas.text((panel.left - 14, foot), "none", 26, QUIET, Anchor::Right);
    for (index, rung) in rungs.iter().enumerate() {
        let (x, _) = panel.at(index as f64, panel.y.start);
        canvas.line(vec![(x, panel.top), (x, panel.bottom)], GRID, 2);
        canvas.text((x, panel.bottom + 30), rung.rung.name, 26, INK, Anchor::Centre);
    }
    canvas.text(((panel.left + panel.right) / 2, panel.bottom + 66), "model", 26, INK, Anchor::Centre);
    // The platforms are drawn side by side, so that equal limits do not hide each other.
    let count = table.platforms.len() as f64;
    for (place, &platform) in table.platforms.iter().enumerate() {
        let shift = 0.5 * ((place as f64 + 0.5) / count - 0.5);
        let height = |row: Option<f64>| libm::log10(row.unwrap_or(0.5 * first));
        let limits = rungs.iter().enumerate().map(|(index, rung)| {
            let limit = rung.tables.limit(axis, platform)?;
            Some((index as f64 + shift, height(limit.every_n_per_m), height(limit.some_n_per_m)))
        });
        let limits: Vec<_> = limits.collect();
        for &(x, every, some) in limits.iter().flatten() {
            canvas.line(vec![panel.at(x, every), panel.at(x, some)], style(platform).color, 4);
        }
        let points: Vec<_> = limits.iter().map(|limit| limit.map(|(x, every, _)| (x, every))).collect();
        dotted(&panel, canvas, &points, style(platform));
    }
    legend(canvas, &table.platforms, (WIDTH - 280, top + 20));
}
