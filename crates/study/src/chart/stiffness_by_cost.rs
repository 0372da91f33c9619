//! What stable stiffness costs: designs in the plane of lookup tables and stiffness, with their front.

use plotters::style::RGBColor;

use crate::widths::search::{Found, Point};

use super::canvas::{Anchor, BLUE, Canvas, GREEN, HEIGHT, INK, ORANGE, QUIET, WIDTH};
use super::map::shortened;
use super::panel::{Panel, around};
use super::{Picture, dotted, page};

/// Errors that a colour parts.
const SMALL: f64 = 0.01;

fn color(error: f64) -> RGBColor {
    match error {
        0.0 => GREEN,
        error if error <= SMALL => BLUE,
        _ => ORANGE,
    }
}

/// The picture of a search's designs: estimated LUT4s across, stable stiffness up; `share` of the reference's stiffness is what
/// the smallest design may lose.
#[must_use]
pub fn stiffness_by_cost(scene: &str, found: &Found, share: f64, command: &str) -> Picture {
    let motions = match found.on.len() {
        1 => "holds for this motion alone".into(),
        scenes => format!("holds for the motions of {scenes} scenes"),
    };
    let words = if found.proved.is_some() { "; words hold the range proved" } else { "" };
    let conditions = format!(
        "{} designs, {} on the front of LUT4s (estimated), error and stiffness (measured); {motions}{words}",
        found.designs,
        found.front.len()
    );
    let mut canvas = page(&format!("{scene}: stable stiffness against LUT4s"), &conditions, &shortened(command));
    let unit = dotted(found.unit);
    // A reference of wide words would leave no room for the others.
    let dearest = found.points.iter().map(|point| point.merit.lut4).max().unwrap_or(0);
    let beside = 2 * found.reference.merit.lut4 > 3 * dearest;
    let all = || found.points.iter().chain((!beside).then_some(&found.reference));
    let panel = Panel {
        left: 190,
        top: 260,
        right: WIDTH - 90,
        bottom: HEIGHT - 160,
        x: around(all().map(|point| f64::from(point.merit.lut4)), 0.05),
        y: around(all().chain([&found.reference]).map(|point| point.merit.stiffness), 0.08),
    };
    let percent = format!("error up to {} %", 100.0 * SMALL);
    let legend = [("error 0", GREEN), (&percent, BLUE), ("more error", ORANGE), ("beaten", QUIET)];
    panel.frame(&mut canvas, &legend, Some("LUT4s of the loop, estimated"));
    canvas.text((panel.right, panel.top - 27), format!("stable stiffness in {unit}"), 28, INK, Anchor::Right);

    let at = |point: &Point| panel.at(f64::from(point.merit.lut4), point.merit.stiffness);
    for point in &found.points {
        canvas.dot(at(point), 4, RGBColor(196, 201, 208), 0);
    }
    let level = found.reference.merit.stiffness;
    let lut4 = found.reference.merit.lut4;
    let name = format!("the reference {}, {lut4} LUT4s", widths(&found.reference));
    for (stiffness, text) in [(level, name.as_str()), ((1.0 - share) * level, "")] {
        let (_, y) = panel.at(panel.x.start, stiffness);
        for x in (panel.left..panel.right).step_by(28) {
            canvas.line(vec![(x, y), (x + 16, y)], QUIET, 2);
        }
        canvas.text((panel.right - 8, y - 20), text, 24, QUIET, Anchor::Right);
    }
    stairs(&mut canvas, found, &panel, at);
    let best: Vec<&Point> = found.best().collect();
    for point in &best {
        canvas.dot(at(point), 9, color(point.merit.error), 0);
    }
    if !beside {
        canvas.dot(at(&found.reference), 12, INK, 4);
    }
    if let Some(smallest) = found.smallest(share) {
        let (x, y) = at(smallest);
        canvas.dot((x, y), 18, INK, 4);
        let text = format!("{} LUT4s: {}", smallest.merit.lut4, widths(smallest));
        canvas.line(vec![(x + 13, y + 13), (x + 60, y + 60)], INK, 2);
        canvas.text((x + 70, y + 66), text, 26, INK, Anchor::Left);
    }
    canvas.render("stiffness-by-cost")
}

/// The stiffest of at most so many tables, as a line.
fn stairs(canvas: &mut Canvas, found: &Found, panel: &Panel, at: impl Fn(&Point) -> (i32, i32)) {
    let mut corners: Vec<(i32, i32)> = Vec::new();
    for (x, y) in found.best().map(at) {
        match corners.last() {
            Some(&(_, last)) if y < last => corners.extend([(x, last), (x, y)]),
            Some(_) => {}
            None => corners.push((x, y)),
        }
    }
    if let Some(&(_, last)) = corners.last() {
        corners.push((panel.right, last));
    }
    canvas.line(corners, INK, 3);
}

fn widths(point: &Point) -> String {
    point.design.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
