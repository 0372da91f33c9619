//! The panel of a map's method: cells, axes and curves, with all positions in cells.

use plotters::style::{RGBColor, WHITE};

use hpu_study::map::{Axis, Map};

use crate::dotted;
use crate::drawing::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH, text_width};
use crate::drawing::panel::ticks;
use crate::drawing::series::{Style, mark};

const SMALL: i32 = 26;

/// A method's panel.
pub(crate) struct Frame {
    method: usize,
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

/// Returns the panels of the methods, row by row; if `noted`, with room for a note below each.
pub(crate) fn frames(map: &Map, noted: bool) -> Vec<Frame> {
    let methods = map.methods.len();
    // Up to three panels stand in one row; more stand in a grid that is nearly square.
    let columns = if methods <= 3 { methods } else { (2..).find(|side| side * side >= methods).unwrap_or(methods) };
    let rows = methods.div_ceil(columns);
    let (width, height) = ((WIDTH - 60) / columns as i32, (HEIGHT - 70 - 200) / rows as i32);
    let note = if noted { NOTE } else { 0 };
    let (margin, foot) = if methods <= FEW { (170, 100 + note) } else { (130, 78 + note) };
    let frame = |method: usize| {
        let (left, top) = (width * (method % columns) as i32, 200 + height * (method / columns) as i32);
        Frame { method, left: left + margin, top: top + 56, right: left + width - 20, bottom: top + height - foot }
    };
    (0..methods).map(frame).collect()
}

/// Returns an axis's key with its unit.
fn name(map: &Map, axis: &Axis) -> String {
    let unit = map.unit(axis);
    if unit.is_empty() { axis.key().to_string() } else { format!("{} in {}", axis.key(), dotted(unit)) }
}

/// Greatest number of panels that are large.
const FEW: usize = 3;
/// Room below a panel for a note, in pixels.
const NOTE: i32 = 84;

impl Frame {
    /// Returns the pixel of a position in cells; a cell reaches half a cell to either side of its number.
    fn x(&self, map: &Map, place: f64) -> i32 {
        self.left + (f64::from(self.right - self.left) * (place + 0.5) / map.x.cells() as f64).round() as i32
    }

    fn y(&self, map: &Map, place: f64) -> i32 {
        self.bottom - (f64::from(self.bottom - self.top) * (place + 0.5) / map.y.cells() as f64).round() as i32
    }

    /// Draws the cells in their colours; neighbours in a row with the same colour are one mark.
    pub fn cells(&self, canvas: &mut Canvas, map: &Map, color: impl Fn(usize) -> Option<RGBColor>) {
        for iy in 0..map.y.cells() {
            let (bottom, top) = (self.y(map, iy as f64 - 0.5), self.y(map, iy as f64 + 0.5));
            let first = self.method * map.layer() + iy * map.x.cells();
            let row: Vec<_> = (0..map.x.cells()).map(|ix| color(first + ix)).collect();
            let mut from = 0;
            for same in row.chunk_by(|a, b| a == b) {
                let to = from + same.len();
                if let Some(color) = same[0] {
                    let (left, right) = (self.x(map, from as f64 - 0.5), self.x(map, to as f64 - 0.5));
                    canvas.fill([(left, top), (right, bottom)], color);
                }
                from = to;
            }
        }
    }

    /// Draws a dot in each cell that has a colour for it.
    pub fn dots(&self, canvas: &mut Canvas, map: &Map, color: impl Fn(usize) -> Option<RGBColor>) {
        let side =
            ((self.right - self.left) / map.x.cells() as i32).min((self.bottom - self.top) / map.y.cells() as i32);
        let radius = (side / 8).clamp(2, 5);
        for (cell, index) in (self.method * map.layer()..(self.method + 1) * map.layer()).enumerate() {
            if let Some(color) = color(index) {
                let (ix, iy) = (cell % map.x.cells(), cell / map.x.cells());
                canvas.dot((self.x(map, ix as f64), self.y(map, iy as f64)), radius, color, 0);
            }
        }
    }

    /// Draws a small triangle into the upper right corner of each marked cell.
    pub(crate) fn corners(&self, canvas: &mut Canvas, map: &Map, is_marked: impl Fn(usize) -> bool) {
        for cell in (0..map.layer()).filter(|cell| is_marked(self.method * map.layer() + cell)) {
            let (ix, iy) = ((cell % map.x.cells()) as f64, (cell / map.x.cells()) as f64);
            let at = |x: f64, y: f64| (self.x(map, ix + x), self.y(map, iy + y));
            canvas.shape(vec![at(0.5, 0.5), at(0.1, 0.5), at(0.5, 0.1)], INK);
        }
    }

    /// Draws a diagonal through each marked cell.
    pub(crate) fn hatch(&self, canvas: &mut Canvas, map: &Map, is_marked: impl Fn(usize) -> bool) {
        for cell in (0..map.layer()).filter(|cell| is_marked(self.method * map.layer() + cell)) {
            let (ix, iy) = ((cell % map.x.cells()) as f64, (cell / map.x.cells()) as f64);
            let corner = |to: f64| (self.x(map, ix + to), self.y(map, iy + to));
            // A white seam makes the line visible on dark cells.
            for (color, width) in [(WHITE, 4), (INK, 2)] {
                canvas.line(vec![corner(-0.5), corner(0.5)], color, width);
            }
        }
    }

    /// Draws the sides of cells at which two classes meet, each stretch as one line; dashed where one of the two cells
    /// was not run.
    pub fn boundary<T: PartialEq>(
        &self,
        canvas: &mut Canvas,
        map: &Map,
        class: impl Fn(usize) -> T,
        was_run: impl Fn(usize) -> bool,
    ) {
        let (columns, rows) = (map.x.cells(), map.y.cells());
        let index = |ix: usize, iy: usize| self.method * map.layer() + iy * columns + ix;
        let corner = |ix: usize, iy: usize| (self.x(map, ix as f64 - 0.5), self.y(map, iy as f64 - 0.5));
        // Whether two cells differ, and whether both were run equals `seen`.
        let differ = |a: usize, b: usize, seen: bool| class(a) != class(b) && (was_run(a) && was_run(b)) == seen;
        let mut lines = Vec::new();
        let mut stretches = |all: usize, meets: &dyn Fn(usize) -> bool, pixel: &dyn Fn(usize) -> (i32, i32), seen| {
            let mut from = None;
            for place in 0..=all {
                match (from, place < all && meets(place)) {
                    (None, true) => from = Some(place),
                    (Some(start), false) => {
                        lines.push(([pixel(start), pixel(place)], seen));
                        from = None;
                    }
                    _ => {}
                }
            }
        };
        for seen in [true, false] {
            for ix in 1..columns {
                let meets = |iy| differ(index(ix - 1, iy), index(ix, iy), seen);
                stretches(rows, &meets, &|iy| corner(ix, iy), seen);
            }
            for iy in 1..rows {
                let meets = |ix| differ(index(ix, iy - 1), index(ix, iy), seen);
                stretches(columns, &meets, &|ix| corner(ix, iy), seen);
            }
        }
        // A white seam makes the line visible on dark cells.
        for (color, width) in [(WHITE, 7), (INK, 3)] {
            for ([from, to], seen) in &lines {
                let pieces = if *seen { vec![[*from, *to]] } else { dashes(*from, *to) };
                pieces.into_iter().for_each(|piece| canvas.line(piece.to_vec(), color, width));
            }
        }
    }

    pub fn axes(&self, canvas: &mut Canvas, map: &Map) {
        let Self { left, top, right, bottom, .. } = *self;
        canvas.line(vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], INK, 2);
        let many = map.methods.len() > FEW;
        for (value, label) in marks(&map.x, ((right - left) / 100) as usize) {
            let x = self.x(map, map.x.position(value));
            canvas.line(vec![(x, bottom), (x, bottom + 10)], INK, 2);
            canvas.text((x, bottom + 28), label, SMALL, QUIET, Anchor::Centre);
        }
        for (value, label) in marks(&map.y, ((bottom - top) / 50) as usize) {
            let y = self.y(map, map.y.position(value));
            canvas.line(vec![(left - 10, y), (left, y)], INK, 2);
            canvas.text((left - 16, y), label, SMALL, QUIET, Anchor::Right);
        }
        let size = if many { 22 } else { SMALL };
        canvas.text(((left + right) / 2, bottom + 62), name(map, &map.x), size, INK, Anchor::Centre);
        // Beside a low panel there is only room for the key's last part or for the unit.
        let last = Axis::key(&map.y).rsplit('.').next().unwrap_or_default();
        let unit = dotted(map.unit(&map.y));
        let names =
            [name(map, &map.y), format!("{last} in {unit}"), if unit.is_empty() { last.to_string() } else { unit }];
        let fits = |name: &&String| text_width(name, size) <= bottom - top + 60;
        let name = names.iter().find(fits).unwrap_or(&names[2]);
        canvas.text((left - if many { 110 } else { 136 }, (top + bottom) / 2), name.as_str(), size, INK, Anchor::Up);
        if map.methods.len() > 1 {
            canvas.text((left, top - 26), map.methods[self.method].label.as_str(), 30, INK, Anchor::Left);
        }
    }

    /// Draws a note below the panel, in as many lines as it takes.
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
        let top = self.bottom + if map.methods.len() > FEW { 88 } else { 104 };
        for (line, text) in lines.into_iter().enumerate() {
            canvas.text((self.left, top + 28 * line as i32), text, SIZE, QUIET, Anchor::Left);
        }
    }

    /// Draws a limit along one axis as a line over the cells of the other axis; the line is broken where no limit is in
    /// view.
    pub fn curve(&self, canvas: &mut Canvas, map: &Map, limits: &[Option<f64>], over_x: bool, style: Style) {
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
            let run: Vec<(i32, i32)> = run.iter().flatten().copied().collect();
            // A white seam makes the line visible on every fill.
            let (seam, line, reach) = if map.methods.len() > FEW { (6, 3, 8) } else { (9, 5, 9) };
            canvas.line(run.clone(), WHITE, seam);
            canvas.line(run.clone(), style.color, line);
            let apart = |a: (i32, i32), b: (i32, i32)| (a.0 - b.0).abs().max((a.1 - b.1).abs());
            let mut last: Option<(i32, i32)> = None;
            // Curves that coincide have their markers at different points.
            for &at in run.iter().skip(style.marker as usize % run.len().clamp(1, 4)) {
                if last.is_none_or(|last| apart(last, at) >= 70) {
                    mark(canvas, at, style, reach);
                    last = Some(at);
                }
            }
        }
    }
}

/// Returns the dashes of a line along an axis.
fn dashes(from: (i32, i32), to: (i32, i32)) -> Vec<[(i32, i32); 2]> {
    const DASH: i32 = 6;
    let length = (to.0 - from.0).abs().max((to.1 - from.1).abs());
    let (dx, dy) = ((to.0 - from.0).signum(), (to.1 - from.1).signum());
    let at = |along: i32| (from.0 + dx * along, from.1 + dy * along);
    (0..length).step_by(2 * DASH as usize).map(|start| [at(start), at((start + DASH).min(length))]).collect()
}

/// Returns round values within an axis, and their labels: at least two, if two fit.
pub(crate) fn marks(axis: &Axis, most: usize) -> Vec<(f64, String)> {
    let (first, last) = (axis.values()[0], axis.values()[axis.cells() - 1]);
    let most = most.max(2);
    if axis.is_log() {
        let decades = libm::log10(first).floor() as i32..=libm::log10(last).ceil() as i32;
        let with = |steps: &'static [f64]| {
            let all = decades.clone().flat_map(move |power| steps.iter().map(move |step| (*step, power)));
            // The value is parsed from text, so that a third decimal is not a binary rounding error.
            let all = all.filter_map(|(step, power)| format!("{step}e{power}").parse::<f64>().ok());
            all.filter(|value| (first..=last).contains(value)).collect::<Vec<f64>>()
        };
        let kinds: [&'static [f64]; 3] = [&[1.0, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0]];
        let chosen = kinds.map(with).into_iter().find(|values| (2..=most).contains(&values.len()));
        if let Some(chosen) = chosen {
            return chosen.into_iter().map(|value| (value, value.to_string())).collect();
        }
        let powers = with(&[1.0]);
        if powers.len() > most {
            // Every second power of ten, or every third.
            let every = powers.len().div_ceil(most);
            return powers.into_iter().step_by(every).map(|value| (value, value.to_string())).collect();
        }
    }
    let (values, decimals) = ticks(&(first..last), most);
    values.into_iter().map(|value| (value, format!("{value:.decimals$}").replace('-', "\u{2212}"))).collect()
}
