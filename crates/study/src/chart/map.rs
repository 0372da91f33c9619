//! Maps: what becomes of the motion over two keys of a scene, and how much.

use hpu_cosim::scene::OutcomeKind;
use plotters::style::RGBColor;

use crate::map::{Axis, Cell, Curves, Found, Map, nearest, outcome, outcome_name};

use super::canvas::{Anchor, BLUE, Canvas, GREEN, HEIGHT, INK, ORANGE, QUIET, RED, WALL, WIDTH, text_width};
use super::panel::ticks;
use super::{Picture, page};

/// How much a cell that was not run is washed out.
const INFERRED: f64 = 0.55;
/// Panels stand side by side up to this many.
const ABREAST: usize = 3;
const SMALL: i32 = 26;

/// A number that is drawn over a map.
struct Quantity {
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    log: bool,
    of: fn(&Cell) -> Option<f64>,
}

const QUANTITIES: [Quantity; 4] = [
    Quantity {
        name: "amplitude",
        title: "amplitude of the limit cycle",
        unit: "mrad",
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
    let conditions = format!("{runs} of {} cells were run{inferred}", found.len());
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
            if !key.contains(&entry) {
                key.push(entry);
            }
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
    for outcome in shown {
        canvas.fill([(x, y - 18), (x + 36, y + 18)], outcome_color(outcome), 1.0);
        x = entry(&mut canvas, (x + 52, y), &outcome_name(outcome).replace('_', " "), INK);
    }
    for (text, color) in key {
        canvas.line(vec![(x, y), (x + 36, y)], color, 6);
        x = entry(&mut canvas, (x + 52, y), &text, color);
    }
    canvas.render("map")
}

/// A text of the key; returns where the next entry begins.
fn entry(canvas: &mut Canvas, (x, y): (i32, i32), text: &str, color: RGBColor) -> i32 {
    canvas.text((x, y), text, 28, color, Anchor::Left);
    x + text_width(text, 28) + 56
}

fn curve_color(name: &str) -> RGBColor {
    match name {
        "spectral_radius" => INK,
        "routh" => GREEN,
        "low_frequency" => BLUE,
        "colgate_schenkel" => WALL,
        "gil_hulin" => ORANGE,
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
    let mut canvas = page(&format!("{}: {}", name(map), quantity.title), conditions, command);
    let scale = |value: f64| if quantity.log { libm::log(value) } else { value };
    let share = |value: f64| if high > low { (scale(value) - scale(low)) / (scale(high) - scale(low)) } else { 0.5 };
    for frame in frames(map) {
        frame.cells(&mut canvas, map, |index| {
            let color = shade(share(values[index]?));
            Some((color, if matches!(found[index], Found::Run(_)) { 1.0 } else { INFERRED }))
        });
        frame.axes(&mut canvas, map);
    }
    let label = |value: f64| format!("{} {}", three_digits(value), quantity.unit);
    let (mut x, y) = (60, 168);
    x = entry(&mut canvas, (x, y), &label(low), INK) - 36;
    for step in 0..=32 {
        canvas.fill([(x + 12 * step, y - 18), (x + 12 * step + 12, y + 18)], shade(f64::from(step) / 32.0), 1.0);
    }
    let scale = if quantity.log { " (by ratio)" } else { "" };
    entry(&mut canvas, (x + 12 * 33 + 20, y), &format!("{}{scale}", label(high)), INK);
    canvas.render(quantity.name)
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

/// A method's panel.
struct Frame {
    method: usize,
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

/// The panels of the methods, row by row.
fn frames(map: &Map) -> Vec<Frame> {
    let methods = map.methods.len();
    let (columns, rows) = (methods.min(ABREAST), methods.div_ceil(ABREAST));
    let (width, height) = ((WIDTH - 60) / columns as i32, (HEIGHT - 70 - 200) / rows as i32);
    let frame = |method: usize| {
        let (left, top) = (width * (method % columns) as i32, 200 + height * (method / columns) as i32);
        Frame { method, left: left + 170, top: top + 56, right: left + width, bottom: top + height - 100 }
    };
    (0..methods).map(frame).collect()
}

impl Frame {
    /// The pixel of a place in cells, of which each reaches half a cell to either side of its number.
    fn x(&self, map: &Map, place: f64) -> i32 {
        self.left + (f64::from(self.right - self.left) * (place + 0.5) / map.x.cells() as f64).round() as i32
    }

    fn y(&self, map: &Map, place: f64) -> i32 {
        self.bottom - (f64::from(self.bottom - self.top) * (place + 0.5) / map.y.cells() as f64).round() as i32
    }

    /// The cells in their colours; those of a row that are alike are one mark.
    fn cells(&self, canvas: &mut Canvas, map: &Map, color: impl Fn(usize) -> Option<(RGBColor, f64)>) {
        for iy in 0..map.y.cells() {
            let (bottom, top) = (self.y(map, iy as f64 - 0.5), self.y(map, iy as f64 + 0.5));
            let first = self.method * map.layer() + iy * map.x.cells();
            let row: Vec<_> = (0..map.x.cells()).map(|ix| color(first + ix)).collect();
            let mut from = 0;
            for same in row.chunk_by(|a, b| a == b) {
                let to = from + same.len();
                if let Some((color, alpha)) = same[0] {
                    let (left, right) = (self.x(map, from as f64 - 0.5), self.x(map, to as f64 - 0.5));
                    canvas.fill([(left, top), (right, bottom)], color, alpha);
                }
                from = to;
            }
        }
    }

    fn axes(&self, canvas: &mut Canvas, map: &Map) {
        let Self { left, top, right, bottom, .. } = *self;
        canvas.line(vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], INK, 2);
        for (value, label) in marks(&map.x, ((right - left) / 150) as usize) {
            let x = self.x(map, map.x.position(value));
            canvas.line(vec![(x, bottom), (x, bottom + 10)], INK, 2);
            canvas.text((x, bottom + 30), label, SMALL, QUIET, Anchor::Centre);
        }
        for (value, label) in marks(&map.y, ((bottom - top) / 60) as usize) {
            let y = self.y(map, map.y.position(value));
            canvas.line(vec![(left - 10, y), (left, y)], INK, 2);
            canvas.text((left - 18, y), label, SMALL, QUIET, Anchor::Right);
        }
        let name = |axis: &Axis| {
            if axis.unit().is_empty() { axis.key().to_string() } else { format!("{} in {}", axis.key(), axis.unit()) }
        };
        canvas.text(((left + right) / 2, bottom + 70), name(&map.x), SMALL, INK, Anchor::Centre);
        let above = name(&map.y);
        canvas.text((left, top - 26), above.as_str(), SMALL, INK, Anchor::Left);
        if map.methods.len() > 1 {
            canvas.text((right, top - 26), map.methods[self.method].label.as_str(), 30, INK, Anchor::Right);
        }
    }

    /// A limit along one axis, as a line over the cells of the other; it is broken where there is none to be seen.
    fn curve(&self, canvas: &mut Canvas, map: &Map, limits: &[Option<f64>], over_x: bool, color: RGBColor) {
        let along = if over_x { &map.x } else { &map.y };
        let inside = |place: &f64| (-0.5..=along.cells() as f64 - 0.5).contains(place);
        let points: Vec<Option<(i32, i32)>> = limits
            .iter()
            .enumerate()
            .map(|(cell, limit)| {
                let (place, cell) = (limit.map(|limit| along.position(limit)).filter(inside)?, cell as f64);
                Some(if over_x {
                    (self.x(map, place), self.y(map, cell))
                } else {
                    (self.x(map, cell), self.y(map, place))
                })
            })
            .collect();
        for run in points.split(Option::is_none) {
            canvas.line(run.iter().flatten().copied().collect(), color, 6);
        }
    }
}

/// Round values within an axis, and their labels.
fn marks(axis: &Axis, most: usize) -> Vec<(f64, String)> {
    let (first, last) = (axis.values()[0], axis.values()[axis.cells() - 1]);
    if !axis.is_log() {
        let (values, decimals) = ticks(&(first..last), most.max(2));
        return values
            .into_iter()
            .map(|value| (value, format!("{value:.decimals$}").replace('-', "\u{2212}")))
            .collect();
    }
    let decades = libm::log10(first).floor() as i32..=libm::log10(last).ceil() as i32;
    let with = |steps: &'static [f64]| {
        let all = decades.clone().flat_map(move |power| steps.iter().map(move |step| (*step, power)));
        // As text, so that a third decimal is not one of binary.
        let all = all.filter_map(|(step, power)| format!("{step}e{power}").parse::<f64>().ok());
        all.filter(|value| (first..=last).contains(value)).collect::<Vec<f64>>()
    };
    let kinds: [&'static [f64]; 3] = [&[1.0, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0]];
    let chosen = kinds.into_iter().map(with).find(|values| values.len() <= most.max(2)).unwrap_or_default();
    chosen.into_iter().map(|value| (value, value.to_string())).collect()
}
