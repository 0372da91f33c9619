//! Maps: what becomes of the motion over two keys of a scene, and how much.

use hpu_cosim::scene::{Experiment, OutcomeKind};
use plotters::style::RGBColor;

use crate::map::{Cell, Curves, Edge, Found, Map, nearest, outcome, outcome_name};

use super::canvas::{Anchor, BLUE, Canvas, GREEN, INK, ORANGE, QUIET, RED, WALL, WIDTH, text_width};
use super::map_frame::{frames, heading};
use super::{Picture, page};

/// How much a cell that was not run is washed out.
const INFERRED: f64 = 0.55;

/// A number that is drawn over a map.
struct Quantity {
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    log: bool,
    of: fn(&Cell) -> Option<f64>,
}

/// The unit of an amplitude, by a thousandth of the device's own.
const LENGTH: &str = "length";

const QUANTITIES: [Quantity; 4] = [
    Quantity {
        name: "amplitude",
        title: "amplitude of the limit cycle",
        unit: LENGTH,
        log: true,
        of: |cell| if cell.outcome == OutcomeKind::LimitCycle { cell.amplitude.map(|a| 1e3 * a) } else { None },
    },
    Quantity {
        name: "frequency",
        title: "frequency of the limit cycle",
        unit: "Hz",
        log: false,
        of: |cell| cell.frequency_hz.filter(|hz| *hz > 0.0),
    },
    Quantity {
        name: "energy",
        title: "energy that became heat",
        unit: "J",
        log: true,
        of: |cell| Some(cell.dissipated_j),
    },
    Quantity {
        name: "displayed-stiffness",
        title: "displayed stiffness over the stiffness asked for",
        unit: "",
        log: false,
        of: |cell| cell.displayed_ratio,
    },
];

/// The map of outcomes with the criteria's curves, then one picture for each number that any cell has.
///
/// `curves` are those of each method, or why it has none.
#[must_use]
pub fn map_pictures(map: &Map, found: &[Found], curves: &[Result<Curves, String>], command: &str) -> Vec<Picture> {
    let command = &shortened(command);
    let mut pictures = vec![outcomes(map, found, curves, command)];
    for quantity in &QUANTITIES {
        let values: Vec<Option<f64>> =
            (0..found.len()).map(|index| nearest(found, index).and_then(quantity.of)).collect();
        let known =
            values.iter().flatten().copied().filter(|value| value.is_finite() && (!quantity.log || *value > 0.0));
        let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), value| (l.min(value), h.max(value)));
        if low <= high {
            pictures.push(numbers(map, found, quantity, &values, (low, high), command));
        }
    }
    pictures
}

/// A command as the foot of a page has room for it; whole, it is in the tables.
pub(super) fn shortened(command: &str) -> String {
    const ROOM: i32 = WIDTH - 260;
    if text_width(command, 24) <= ROOM {
        return command.to_string();
    }
    let mut ends = command.char_indices().map(|(end, _)| end).rev();
    let end = ends.find(|end| text_width(&command[..*end], 24) <= ROOM - 30).unwrap_or(0);
    format!("{} \u{2026}", &command[..end])
}

fn outcome_color(outcome: Option<OutcomeKind>) -> RGBColor {
    match outcome {
        Some(OutcomeKind::Settled | OutcomeKind::Passive) => RGBColor(150, 196, 232),
        Some(OutcomeKind::LimitCycle | OutcomeKind::NonPassive) => RGBColor(244, 178, 92),
        Some(OutcomeKind::Diverged | OutcomeKind::HighlyUnstable) => RGBColor(200, 64, 56),
        None => QUIET,
    }
}

fn outcomes(map: &Map, found: &[Found], curves: &[Result<Curves, String>], command: &str) -> Picture {
    let runs = found.iter().filter(|found| matches!(found, Found::Run(_))).count();
    let inferred = if runs < found.len() { "; paler cells are inferred from those around them" } else { "" };
    let conditions = format!("{}{runs} of {} cells were run{inferred}", head(map), found.len());
    let title = format!("{}: what becomes of the motion", name(map));
    let mut canvas = page(&title, &conditions, command);
    let mut key: Vec<(String, RGBColor)> = Vec::new();
    for (method, frame) in frames(map).into_iter().enumerate() {
        frame.cells(&mut canvas, map, |index| {
            let color = outcome_color(outcome(found, index));
            Some((color, if matches!(found[index], Found::Run(_)) { 1.0 } else { INFERRED }))
        });
        frame.axes(&mut canvas, map);
        for curve in curves[method].iter().flat_map(|curves| &curves.curves) {
            let entry = (curve.name.replace('_', " "), curve_color(curve.name));
            let over_x = curves[method].as_ref().is_ok_and(|curves| curves.over_x);
            frame.curve(&mut canvas, map, &curve.limits, over_x, entry.1);
            if !key.contains(&entry) && curve.limits.iter().any(Option::is_some) {
                key.push(entry);
            }
        }
        if let Some(reason) = Edge::new(map, found, curves[method].as_ref().ok(), method).short() {
            frame.note(&mut canvas, map, &reason);
        }
    }
    let mut x = 60;
    let y = 168;
    let mut shown: Vec<Option<OutcomeKind>> = Vec::new();
    for index in 0..found.len() {
        let outcome = outcome(found, index);
        if !shown.contains(&outcome) {
            shown.push(outcome);
        }
    }
    shown.sort_by_key(|outcome| outcome.map_or(usize::MAX, |outcome| outcome as usize));
    // Many criteria make a small key.
    let names = shown.iter().map(|outcome| outcome_name(*outcome)).chain(key.iter().map(|(text, _)| text.as_str()));
    let width: i32 = names.map(|name| text_width(name, 28) + 108).sum();
    let size = if width < WIDTH - 2 * x { 28 } else { 22 };
    for outcome in shown {
        canvas.fill([(x, y - 18), (x + 36, y + 18)], outcome_color(outcome), 1.0);
        x = entry(&mut canvas, (x + 52, y), &outcome_name(outcome).replace('_', " "), INK, size);
    }
    for (text, color) in key {
        canvas.line(vec![(x, y), (x + 36, y)], color, 6);
        x = entry(&mut canvas, (x + 52, y), &text, color, size);
    }
    canvas.render("map")
}

/// A text of the key; returns where the next entry begins.
fn entry(canvas: &mut Canvas, (x, y): (i32, i32), text: &str, color: RGBColor, size: i32) -> i32 {
    canvas.text((x, y), text, size, color, Anchor::Left);
    x + text_width(text, size) + 2 * size
}

fn curve_color(name: &str) -> RGBColor {
    match name {
        "spectral_radius" => INK,
        "routh" => GREEN,
        "low_frequency" => BLUE,
        "colgate_schenkel" => WALL,
        "gil_hulin" => ORANGE,
        "abbott_okamura" => RGBColor(128, 64, 144),
        "diolaiti" => RGBColor(0, 128, 128),
        "describing_function" => RGBColor(208, 80, 150),
        _ => RED,
    }
}

/// From pale to dark by lightness, so that it reads in grey as well.
fn shade(share: f64) -> RGBColor {
    const STOPS: [(f64, f64, f64); 4] =
        [(253.0, 231.0, 150.0), (94.0, 190.0, 110.0), (38.0, 116.0, 142.0), (68.0, 1.0, 84.0)];
    // 32 steps: cells alike are one mark.
    let at = (share.clamp(0.0, 1.0) * 32.0).round() / 32.0 * 3.0;
    let first = (at as usize).min(2);
    let (a, b, part) = (STOPS[first], STOPS[first + 1], at - first as f64);
    let mix = |a: f64, b: f64| (a + part * (b - a)).round() as u8;
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

fn numbers(
    map: &Map,
    found: &[Found],
    quantity: &Quantity,
    values: &[Option<f64>],
    (low, high): (f64, f64),
    command: &str,
) -> Picture {
    let inferred = found.iter().any(|found| matches!(found, Found::As(_)));
    let conditions =
        if inferred { "paler cells were not run: they show the nearest that was" } else { "every cell was run" };
    let conditions = head(map) + conditions;
    let mut canvas = page(&format!("{}: {}", name(map), quantity.title), &conditions, command);
    let scale = |value: f64| if quantity.log { libm::log(value) } else { value };
    let share = |value: f64| if high > low { (scale(value) - scale(low)) / (scale(high) - scale(low)) } else { 0.5 };
    for frame in frames(map) {
        frame.cells(&mut canvas, map, |index| {
            let color = shade(share(values[index]?));
            Some((color, if matches!(found[index], Found::Run(_)) { 1.0 } else { INFERRED }))
        });
        frame.axes(&mut canvas, map);
    }
    let unit = match quantity.unit {
        "" => String::new(),
        LENGTH => match map.experiment(map.point(map.layer() / 2)) {
            Ok(Experiment::Axis(scene)) => format!(" m{}", scene.device.units().position),
            Ok(Experiment::Phantom(_)) | Err(_) => " by a thousand".into(),
        },
        unit => format!(" {unit}"),
    };
    let label = |value: f64| three_digits(value) + &unit;
    let (mut x, y) = (60, 168);
    x = entry(&mut canvas, (x, y), &label(low), INK, 28) - 36;
    for step in 0..=32 {
        canvas.fill([(x + 12 * step, y - 18), (x + 12 * step + 12, y + 18)], shade(f64::from(step) / 32.0), 1.0);
    }
    let scale = if quantity.log { ", by ratio" } else { "" };
    entry(&mut canvas, (x + 12 * 33 + 20, y), &format!("{}{scale}", label(high)), INK, 28);
    canvas.render(quantity.name)
}

/// The axes, where the panels do not name them.
fn head(map: &Map) -> String {
    heading(map).map_or(String::new(), |axes| axes + "; ")
}

fn three_digits(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let decimals = if value == 0.0 { 0 } else { (2 - libm::log10(value.abs()).floor() as i32).max(0) as usize };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

fn name(map: &Map) -> &str {
    let file = map.scene.name.rsplit('/').next().unwrap_or(&map.scene.name);
    file.strip_suffix(".toml").unwrap_or(file)
}
