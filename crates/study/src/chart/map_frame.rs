//! The panel of a map's method: cells, axes and curves, all placed in cells.

use plotters::style::RGBColor;

use crate::map::{Axis, Map};

use super::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH, text_width};
use super::panel::ticks;

const SMALL: i32 = 26;

/// A method's panel.
pub(super) struct Frame {
    method: usize,
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

/// The panels of the methods, row by row.
pub(super) fn frames(map: &Map) -> Vec<Frame> {
    let methods = map.methods.len();
    // Up to three abreast in one row, then as square as may be.
    let columns = if methods <= 3 { methods } else { (2..).find(|side| side * side >= methods).unwrap_or(methods) };
    let rows = methods.div_ceil(columns);
    let (width, height) = ((WIDTH - 60) / columns as i32, (HEIGHT - 70 - 200) / rows as i32);
    // Few panels name their axes each; of many, the page's head does.
    let (margin, foot) = if methods <= FEW { (170, 100 + NOTE) } else { (100, 50 + NOTE) };
    let frame = |method: usize| {
        let (left, top) = (width * (method % columns) as i32, 200 + height * (method / columns) as i32);
        Frame { method, left: left + margin, top: top + 56, right: left + width, bottom: top + height - foot }
    };
    (0..methods).map(frame).collect()
}

/// The names of the axes for the page's head, where the panels are too many to have them.
pub(super) fn heading(map: &Map) -> Option<String> {
    (map.methods.len() > FEW).then(|| format!("up: {}; across: {}", name(&map.y), name(&map.x)))
}

fn name(axis: &Axis) -> String {
    if axis.unit().is_empty() { axis.key().to_string() } else { format!("{} in {}", axis.key(), axis.unit()) }
}

/// Panels up to which each names its axes.
const FEW: usize = 3;
/// Room below a panel for a note.
const NOTE: i32 = 84;

impl Frame {
    /// The pixel of a place in cells, of which each reaches half a cell to either side of its number.
    fn x(&self, map: &Map, place: f64) -> i32 {
        self.left + (f64::from(self.right - self.left) * (place + 0.5) / map.x.cells() as f64).round() as i32
    }

    fn y(&self, map: &Map, place: f64) -> i32 {
        self.bottom - (f64::from(self.bottom - self.top) * (place + 0.5) / map.y.cells() as f64).round() as i32
    }

    /// The cells in their colours; those of a row that are alike are one mark.
    pub fn cells(&self, canvas: &mut Canvas, map: &Map, color: impl Fn(usize) -> Option<(RGBColor, f64)>) {
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

    pub fn axes(&self, canvas: &mut Canvas, map: &Map) {
        let Self { left, top, right, bottom, .. } = *self;
        canvas.line(vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], INK, 2);
        for (value, label) in marks(&map.x, ((right - left) / 100) as usize) {
            let x = self.x(map, map.x.position(value));
            canvas.line(vec![(x, bottom), (x, bottom + 10)], INK, 2);
            canvas.text((x, bottom + 30), label, SMALL, QUIET, Anchor::Centre);
        }
        for (value, label) in marks(&map.y, ((bottom - top) / 60) as usize) {
            let y = self.y(map, map.y.position(value));
            canvas.line(vec![(left - 10, y), (left, y)], INK, 2);
            canvas.text((left - 18, y), label, SMALL, QUIET, Anchor::Right);
        }
        if map.methods.len() > FEW {
            canvas.text((left, top - 26), map.methods[self.method].label.as_str(), 30, INK, Anchor::Left);
            return;
        }
        canvas.text(((left + right) / 2, bottom + 70), name(&map.x), SMALL, INK, Anchor::Centre);
        let above = name(&map.y);
        canvas.text((left, top - 26), above.as_str(), SMALL, INK, Anchor::Left);
        if map.methods.len() > 1 {
            canvas.text((right, top - 26), map.methods[self.method].label.as_str(), 30, INK, Anchor::Right);
        }
    }

    /// A note below the panel, in as many lines as it takes.
    pub fn note(&self, canvas: &mut Canvas, map: &Map, text: &str) {
        const SIZE: i32 = 22;
        let mut lines: Vec<String> = Vec::new();
        for word in text.split(' ') {
            match lines.last_mut() {
                Some(line) if text_width(&format!("{line} {word}"), SIZE) < self.right - self.left => {
                    *line += " ";
                    *line += word;
                }
                _ => lines.push(word.to_string()),
            }
        }
        let top = self.bottom + if map.methods.len() > FEW { 64 } else { 108 };
        for (line, text) in lines.into_iter().enumerate() {
            canvas.text((self.left, top + 28 * line as i32), text, SIZE, QUIET, Anchor::Left);
        }
    }

    /// A limit along one axis, as a line over the cells of the other; it is broken where there is none to be seen.
    pub fn curve(&self, canvas: &mut Canvas, map: &Map, limits: &[Option<f64>], over_x: bool, color: RGBColor) {
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
