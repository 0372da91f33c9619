//! The picture of ranges: what every signal's word holds, its measured range, and its proved range.

use hpu_prove::ranges::Bound;
use hpu_study::widths::{Measured, SignalRow};

use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, WIDTH};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLUE, Look, ORANGE, RUST, SKY, entry};
use crate::{Picture, page};

const LEFT: i32 = 210;
const RIGHT: i32 = WIDTH - 560;
const TOP: i32 = 240;
const BOTTOM: i32 = 1290;

/// Returns a picture with a row for each signal of more than one bit: the format from its last place to its end, over
/// it the greatest absolute value measured and the greatest proved, on an axis of powers of two.
pub fn ranges(title: &str, measured: &Measured, proved: &[Bound], command: &str) -> Picture {
    let conditions =
        "a word reaches from its last place to its end; proved: for every motion within the device's limits";
    let mut canvas = page(title, conditions, command);
    let mut x = 60;
    for of in [
        ("word", Look::Area(SKY)),
        ("measured", Look::Area(BLUE.color)),
        ("measured, with bits lost above", Look::Area(RUST.color)),
        ("proved", Look::Area(ORANGE.color)),
    ] {
        x = entry(&mut canvas, (x, 168), of, 26);
    }
    let rows: Vec<&SignalRow> = measured.rows.iter().filter(|row| row.format.width() > 2).collect();
    let bound = |row: &SignalRow| proved.iter().find(|bound| bound.name == row.name);
    let ends = rows.iter().map(|row| (-row.format.frac(), row.format.int()));
    let (low, high) = ends.fold((0, 1), |(low, high), (last, end)| (low.min(last), high.max(end)));
    let x = f64::from(low) - 0.5..f64::from(high) + 2.5;
    let panel = Panel { left: LEFT, top: TOP, right: RIGHT, bottom: BOTTOM, x, y: 0.0..1.0 };
    axis(&panel, &mut canvas);
    let height = ((BOTTOM - TOP) / (rows.len() as i32).max(1)).min(86);
    canvas.text((RIGHT + 30, TOP - 24), "bits there", 24, QUIET, Anchor::Left);
    canvas.text((RIGHT + 190, TOP - 24), "measured", 24, QUIET, Anchor::Left);
    canvas.text((RIGHT + 340, TOP - 24), "proved", 24, QUIET, Anchor::Left);
    for (index, row) in (0..).zip(rows) {
        bar(&panel, &mut canvas, TOP + index * height, height, row, bound(row));
    }
    canvas.render("ranges")
}

fn axis(panel: &Panel, canvas: &mut Canvas) {
    let step = if panel.x.end - panel.x.start > 24.0 { 4 } else { 2 };
    let first = (panel.x.start / f64::from(step)).ceil() as i32;
    let last = (panel.x.end / f64::from(step)).floor() as i32;
    for power in (first..=last).map(|n| n * step) {
        let (x, _) = panel.at(f64::from(power), 0.0);
        canvas.line(vec![(x, panel.top), (x, panel.bottom)], GRID, 2);
        canvas.text((x, panel.bottom + 22), power.to_string().replace('-', "\u{2212}"), 24, QUIET, Anchor::Centre);
    }
    let middle = (panel.left + panel.right) / 2;
    let label = "power of two of the size, in the unit of the signal";
    canvas.text((middle, panel.bottom + 58), label, 26, INK, Anchor::Centre);
}

fn bar(panel: &Panel, canvas: &mut Canvas, top: i32, height: i32, row: &SignalRow, bound: Option<&Bound>) {
    let (format, size) = (row.format, (height * 4 / 5).clamp(16, 26));
    let middle = top + height / 2;
    let across = |power: f64| panel.at(power, 0.0).0;
    let (last, end) = (f64::from(-format.frac()), f64::from(format.int()));
    canvas.text((LEFT - 16, middle), row.name, size, INK, Anchor::Right);
    let half = height * 2 / 5;
    canvas.fill([(across(last), middle - half), (across(end), middle + half)], SKY);
    let bits_at = |x: i32, power: Option<f64>, canvas: &mut Canvas| {
        let text = power.map_or_else(|| "\u{2013}".to_string(), |power| bits(power - last));
        canvas.text((x, middle), text, size, INK, Anchor::Left);
    };
    let seen = row.measured.map(|(min, max)| power_of(format.to_f64(min), format.to_f64(max)));
    let color = if row.overflowed.edges > 0 { RUST.color } else { BLUE.color };
    if let Some(power) = seen {
        canvas.fill([(across(last), middle - half), (across(power.max(last)), middle)], color);
    }
    let known = bound.map(|bound| power_of(bound.min, bound.max));
    if let Some(power) = known {
        canvas.fill([(across(last), middle), (across(power.max(last)), middle + half)], ORANGE.color);
    }
    let there = format.width() as i32 - i32::from(format.is_signed());
    let text = if format.is_signed() { format!("{there} and sign") } else { there.to_string() };
    canvas.text((RIGHT + 30, middle), text, size, QUIET, Anchor::Left);
    bits_at(RIGHT + 190, seen, canvas);
    bits_at(RIGHT + 340, known, canvas);
}

/// Returns the logarithm to base 2 of the greater absolute value.
fn power_of(min: f64, max: f64) -> f64 {
    libm::log2(max.abs().max(min.abs()))
}

fn bits(bits: f64) -> String {
    if bits.is_finite() { format!("{:.1}", bits.max(0.0)) } else { "0".into() }
}
