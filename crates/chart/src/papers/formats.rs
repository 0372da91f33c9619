//! The picture of word formats as bars: how far each format reaches, and which part of it a signal uses.

use hpu_papers::phantom::DEVICE;
use hpu_papers::phantom::formats::{Fate, Formats};

use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, WIDTH};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLUE, Look, RUST, SKY, entry};
use crate::{Picture, page};

const LEFT: i32 = 190;
const TOP: i32 = 300;
const BOTTOM: i32 = 1270;
/// The powers of two that are shown.
const POWERS: std::ops::Range<f64> = -26.0..20.0;

/// Returns a picture with a panel for each configuration and a row for each signal, on a logarithmic axis: the format
/// from its last place to its end, and the signal from its error to its greatest value.
pub fn formats(all: &[Formats], command: &str) -> Picture {
    let conditions =
        "a word reaches from its last place to its end, a signal from its proved error to its greatest value";
    let mut canvas = page(&format!("{DEVICE}: words, and what is proved of the signals in them"), conditions, command);
    let mut x = 60;
    for of in [
        ("word", Look::Area(SKY)),
        ("signal in it", Look::Area(BLUE.color)),
        ("signal that does not fit, or of which nothing is known", Look::Area(RUST.color)),
    ] {
        x = entry(&mut canvas, (x, 164), of, 26);
    }
    let signals: Vec<_> =
        all.first().map_or(&[][..], |formats| &formats.rows).iter().map(|row| row.proved.name).collect();
    let height = (BOTTOM - TOP) / (signals.len() as i32).max(1);
    for (index, name) in (0..).zip(&signals) {
        canvas.text((LEFT - 16, TOP + index * height + height / 2), *name, 26, INK, Anchor::Right);
    }
    let width = (WIDTH - 40 - LEFT) / (all.len() as i32).max(1);
    for (index, formats) in (0..).zip(all) {
        let (left, right) = (LEFT + index * width + 16, LEFT + (index + 1) * width - 16);
        let panel = Panel { left, top: TOP, right, bottom: BOTTOM, x: POWERS, y: 0.0..1.0 };
        canvas.text((left, TOP - 78), formats.words.name, 32, INK, Anchor::Left);
        let stiffest = hpu_papers::phantom::formats::stiffness(formats.words.stiffness_max_n_per_m);
        canvas.text((left, TOP - 36), format!("up to {stiffest} N/m"), 26, QUIET, Anchor::Left);
        axis(&panel, &mut canvas);
        bars(&panel, &mut canvas, formats, height);
    }
    let middle = (LEFT + WIDTH - 40) / 2;
    let label = "power of two of the value, in the unit of the signal (1, m, N/m, N, N\u{b7}m, DAC count)";
    canvas.text((middle, BOTTOM + 76), label, 26, INK, Anchor::Centre);
    canvas.render("formats")
}

fn axis(panel: &Panel, canvas: &mut Canvas) {
    for power in [-24, -16, -8, 0, 8, 16] {
        let (x, _) = panel.at(f64::from(power), 0.0);
        canvas.line(vec![(x, panel.top), (x, panel.bottom)], GRID, 2);
        canvas.text((x, panel.bottom + 28), power.to_string().replace('-', "\u{2212}"), 24, QUIET, Anchor::Centre);
    }
}

fn bars(panel: &Panel, canvas: &mut Canvas, formats: &Formats, height: i32) {
    for (index, row) in (0..).zip(&formats.rows) {
        let (top, bottom) = (panel.top + index * height + 6, panel.top + (index + 1) * height - 6);
        let across = |power: f64| panel.at(power, 0.0).0;
        let format = row.proved.format;
        let (last, end) = (f64::from(-format.frac()), f64::from(format.int()));
        canvas.fill([(across(last), top), (across(end), bottom)], SKY);
        let error = row.proved.error;
        // An exact word begins at its last place.
        let (from, known) = if error > 0.0 { (libm::log2(error), error.is_finite()) } else { (last, true) };
        let color = if known && row.fate() != Fate::Wraps { BLUE.color } else { RUST.color };
        let from = if known { from } else { last };
        let inner = [(across(from), top + 9), (across(libm::log2(row.size())), bottom - 9)];
        canvas.fill(inner, color);
    }
}
