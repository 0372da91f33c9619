//! The picture of what stable stiffness costs: designs in the plane of lookup tables and stiffness, with their front.

use hpu_study::widths::search::{Found, RatedDesign};

use crate::drawing::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH, text_width};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, GREEN, Look, ORANGE, Style, TAUPE, mark};
use crate::{Picture, dotted, page};

/// Error, relative, that separates two colours.
const SMALL: f64 = 0.01;

fn style(error: f64) -> Style {
    match error {
        0.0 => GREEN,
        error if error <= SMALL => BLUE,
        _ => ORANGE,
    }
}

/// Returns the picture of a search's designs: estimated LUT4s across, stable stiffness up. `share` is the part of the
/// reference's stiffness that the smallest design may lose.
pub fn stiffness_by_cost(scene: &str, found: &Found, share: f64, command: &str) -> Picture {
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name().replace('_', " ")).collect();
    let motions = match found.on.len() {
        1 => "holds for this motion alone".into(),
        scenes => format!("holds for the motions of {scenes} scenes"),
    };
    let words = if found.proved.is_some() { "; words hold the range proved" } else { "" };
    let conditions =
        format!("error: the worst of {}, against the reference; LUT4s estimated; {motions}{words}", outputs.join(", "));
    let mut canvas = page(&format!("{scene}: stable stiffness against LUT4s"), &conditions, command);
    let front = format!(
        "{} designs; none is better than one of the {} in colour in LUT4s, error and stiffness at once; \
         stairs: the stiffest of at most so many LUT4s",
        found.designs,
        found.front.len()
    );
    canvas.text((60, 164), front, 26, QUIET, Anchor::Left);
    let level = found.reference.merit.stiffness;
    // A reference of wide words would leave no room for the other designs, so it is then left out of the scale.
    let dearest = found.points.iter().map(|point| point.merit.cost.lut4()).max().unwrap_or(0);
    let beside = 2 * found.reference.merit.cost.lut4() > 3 * dearest;
    let all = || found.points.iter().chain((!beside).then_some(&found.reference));
    let panel = Panel {
        left: 190,
        top: 270,
        right: WIDTH - 90,
        bottom: HEIGHT - 160,
        x: around(all().map(|point| f64::from(point.merit.cost.lut4())), 0.05),
        y: around(all().map(|point| point.merit.stiffness).chain([level, (1.0 - share) * level]), 0.08),
    };
    let percent = format!("error up to {} %", 100.0 * SMALL);
    let best: Vec<&RatedDesign> = found.best().collect();
    let errors = [("error 0", GREEN), (percent.as_str(), BLUE), ("more error", ORANGE)].into_iter();
    let there = errors.filter(|(_, of)| best.iter().any(|point| style(point.merit.error) == *of));
    let is_best = |point: &RatedDesign| best.iter().any(|other| other.merit == point.merit);
    let beaten = (!found.points.iter().all(&is_best)).then_some(("beaten by another design", Look::Points(TAUPE)));
    let legend: Vec<_> = there.map(|(text, of)| (text, Look::Points(of))).chain(beaten).collect();
    let y_label = format!("stable stiffness, measured, in {}", dotted(found.unit));
    panel.frame(&mut canvas, &legend, Some("LUT4s of the loop, estimated"), &y_label);

    let at = |point: &RatedDesign| panel.at(f64::from(point.merit.cost.lut4()), point.merit.stiffness);
    for point in found.points.iter().filter(|point| !is_best(point)) {
        mark(&mut canvas, at(point), TAUPE, 5);
    }
    let reference = format!("reference: {}; {} LUT4s", widths(&found.reference), found.reference.merit.cost.lut4());
    let below = format!("{} % less stiff than the reference", (1e4 * share).round() / 1e2);
    for (stiffness, text, over) in [(level, reference.as_str(), -20), ((1.0 - share) * level, below.as_str(), 20)] {
        let (_, y) = panel.at(panel.x.start, stiffness);
        for x in (panel.left..panel.right).step_by(28) {
            canvas.line(vec![(x, y), (x + 16, y)], QUIET, 2);
        }
        canvas.text((panel.left + 8, y + over), text, 24, INK, Anchor::Left);
    }
    stairs(&mut canvas, found, &panel, at);
    for point in &best {
        mark(&mut canvas, at(point), style(point.merit.error), 11);
    }
    if !beside {
        canvas.dot(at(&found.reference), 14, INK, 4);
    }
    if let Some(smallest) = found.smallest(share) {
        let levels = [level, (1.0 - share) * level].map(|stiffness| panel.at(panel.x.start, stiffness).1);
        let designs: Vec<_> = found.points.iter().map(at).collect();
        describe(&mut canvas, &panel, smallest, share, at(smallest), &designs, levels);
    }
    canvas.render("stiffness-by-cost")
}

/// Describes the smallest design beside its place, without covering the places of other designs or a level.
fn describe(
    canvas: &mut Canvas,
    panel: &Panel,
    smallest: &RatedDesign,
    share: f64,
    (x, y): (i32, i32),
    designs: &[(i32, i32)],
    levels: [i32; 2],
) {
    canvas.dot((x, y), 20, INK, 4);
    let head = format!("smallest within {} % of it: {} LUT4s", (1e4 * share).round() / 1e2, smallest.merit.cost.lut4());
    let capped = if smallest.capped { "; the format holds no stiffer wall" } else { "" };
    let words = widths(smallest) + capped;
    let width = text_width(&head, 26).max(text_width(&words, 26)) + 40;
    // The text stands to the right if it has room there, and as near as possible without covering another design or
    // a level.
    let is_right = x + 70 + width < panel.right;
    let (side, anchor) = if is_right { (1, Anchor::Left) } else { (-1, Anchor::Right) };
    let covers = |place: &i32| {
        let is_beside = |py: i32| (py - y - place - 18).abs() < 50;
        let within = |(px, py): (i32, i32)| (1..70 + width).contains(&(side * (px - x))) && is_beside(py);
        designs.iter().any(|place| within(*place)) || levels.into_iter().any(is_beside)
    };
    let last = panel.bottom - y - 60;
    let below = (66..last).step_by(8).find(|place| !covers(place)).unwrap_or(66);
    canvas.line(vec![(x + 14 * side, y + 14), (x + 60 * side, y + below)], INK, 2);
    canvas.text((x + 70 * side, y + below), head, 26, INK, anchor);
    canvas.text((x + 70 * side, y + below + 36), words, 26, INK, anchor);
}

/// Draws a line at the stiffest design with at most so many lookup tables.
fn stairs(canvas: &mut Canvas, found: &Found, panel: &Panel, at: impl Fn(&RatedDesign) -> (i32, i32)) {
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

/// Returns a design as text: the bits of its signals, the formats of its gains.
pub(crate) fn widths(point: &RatedDesign) -> String {
    let text = point.design.to_string();
    let names = ["position", "stiffness", "damping", "velocity", "PWM"];
    let parts = names.iter().zip(text.split_whitespace()).map(|(name, word)| format!("{name} {word}"));
    parts.collect::<Vec<_>>().join(", ")
}
