//! One panel of a page: axes, ticks, and data mapped into it.

use std::collections::BTreeMap;
use std::ops::Range;

use plotters::style::RGBColor;

use crate::Marker;
use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, text_width};
use crate::drawing::series::{Look, Style, entry, mark};

const SMALL: i32 = 26;
/// Distance from a marker of a curve to the next, in pixels.
const PITCH: i32 = 260;

/// A rectangle of the page that shows a range of times and a range of values.
pub(crate) struct Panel {
    pub left: i32,
    pub top: i32,
    pub right: i32,
    pub bottom: i32,
    pub x: Range<f64>,
    pub y: Range<f64>,
}

/// Returns at most `most` round values within a range, and the number of decimals that they need.
pub(crate) fn ticks(range: &Range<f64>, most: usize) -> (Vec<f64>, usize) {
    let least = (range.end - range.start) / most as f64;
    let decade = libm::exp10(libm::log10(least).floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|step| *step >= least).unwrap_or(least);
    let first = (range.start / step - 1e-9).ceil() as i64;
    let last = (range.end / step + 1e-9).floor() as i64;
    let decimals = (-libm::log10(step) - 1e-9).ceil().max(0.0) as usize;
    ((first..=last).map(|n| n as f64 * step).collect(), decimals)
}

/// Returns a tick's label; zero has no sign, and a number of many digits is written with a power of ten.
fn label(value: f64, decimals: usize) -> String {
    let text = if value.abs() < 1e7 { format!("{value:.decimals$}") } else { format!("{value:e}") };
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        text.trim_start_matches('-').to_string()
    } else {
        text.replace('-', "\u{2212}")
    }
}

/// Returns a range that holds all values, with a margin that is a share of it; a single value gets a margin of 1 on
/// either side.
pub(crate) fn around(values: impl Iterator<Item = f64>, air: f64) -> Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return -1.0..1.0;
    }
    let room = if high > low { air * (high - low) } else { 1.0 };
    low - room..high + room
}

/// Returns the corners of a step curve: each value holds from its point to the next.
fn corners(points: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = (f64, f64)> {
    let mut last = None;
    points.flat_map(move |(x, y)| {
        let before = last.replace(y).unwrap_or(y);
        [(x, before), (x, y)]
    })
}

impl Panel {
    /// Returns the pixel of a point, kept within the panel.
    pub fn at(&self, x: f64, y: f64) -> (i32, i32) {
        let share = |range: &Range<f64>, v: f64| ((v - range.start) / (range.end - range.start)).clamp(0.0, 1.0);
        let across = f64::from(self.right - self.left) * share(&self.x, x);
        let up = f64::from(self.bottom - self.top) * share(&self.y, y);
        (self.left + across.round() as i32, self.bottom - up.round() as i32)
    }

    /// Draws grid, ticks and the names of the axes; `legend` lists above the panel what is drawn in it.
    pub fn frame(&self, canvas: &mut Canvas, legend: &[(&str, Look)], x_label: Option<&str>, y_label: &str) {
        let across = ((self.right - self.left) / 180).max(2) as usize;
        let up = ((self.bottom - self.top) / 60).max(4) as usize;
        self.frame_at(canvas, legend, x_label, y_label, [ticks(&self.x, across), ticks(&self.y, up)]);
    }

    /// Draws a frame as [`frame`](Self::frame) does, with these ticks of both axes, and the decimals of their labels.
    pub(crate) fn frame_at(
        &self,
        canvas: &mut Canvas,
        legend: &[(&str, Look)],
        x_label: Option<&str>,
        y_label: &str,
        [across, up]: [(Vec<f64>, usize); 2],
    ) {
        let (values, decimals) = up;
        for value in values {
            let (_, y) = self.at(self.x.start, value);
            canvas.line(vec![(self.left, y), (self.right, y)], GRID, 2);
            canvas.text((self.left - 14, y), label(value, decimals), SMALL, QUIET, Anchor::Right);
        }
        let (values, decimals) = across;
        for value in values {
            let (x, _) = self.at(value, self.y.start);
            canvas.line(vec![(x, self.top), (x, self.bottom)], GRID, 2);
            if x_label.is_some() {
                canvas.text((x, self.bottom + 26), label(value, decimals), SMALL, QUIET, Anchor::Centre);
            }
        }
        if let Some(x_label) = x_label {
            let middle = (self.left + self.right) / 2;
            canvas.text((middle, self.bottom + 64), x_label, SMALL, INK, Anchor::Centre);
        }
        self.y_name(canvas, y_label);
        canvas.panel();
        let mut x = self.left;
        for &of in legend {
            x = entry(canvas, (x, self.top - 27), of, 28);
        }
    }

    /// Draws the name of the vertical axis, beside its middle.
    pub(crate) fn y_name(&self, canvas: &mut Canvas, name: &str) {
        let room = self.bottom - self.top + 40;
        let size = [SMALL, 24, 22, 20].into_iter().find(|size| text_width(name, *size) <= room).unwrap_or(18);
        canvas.text((self.left - 136, (self.top + self.bottom) / 2), name, size, INK, Anchor::Up);
    }

    /// Draws a second vertical axis on the right for the same positions, labelled with `scale` times the value.
    pub(crate) fn right_axis(&self, canvas: &mut Canvas, scale: f64, name: &str) {
        let range = self.y.start * scale..self.y.end * scale;
        let (values, decimals) = ticks(&range, ((self.bottom - self.top) / 60).max(4) as usize);
        for value in values {
            let (_, y) = self.at(self.x.end, value / scale);
            canvas.line(vec![(self.right, y), (self.right + 10, y)], QUIET, 2);
            canvas.text((self.right + 20, y), label(value, decimals), SMALL, QUIET, Anchor::Left);
        }
        canvas.text((self.right + 130, (self.top + self.bottom) / 2), name, SMALL, INK, Anchor::Up);
    }

    /// Draws a curve through points in order of time, with its markers; returns the pixels that it joins.
    pub fn curve(
        &self,
        canvas: &mut Canvas,
        points: impl Iterator<Item = (f64, f64)>,
        style: Style,
        width: u32,
    ) -> Vec<(i32, i32)> {
        let pixels = self.thinned(points.filter(|(x, _)| self.x.start <= *x && *x <= self.x.end));
        // Each kind of marker has places of its own, so that coinciding curves show their markers in turn.
        let mut next = self.left + 40 + style.marker as i32 * PITCH / Marker::COUNT;
        let mut places = Vec::new();
        for pair in pixels.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            while next <= to.0 {
                if next >= from.0 {
                    let share = f64::from(next - from.0) / f64::from((to.0 - from.0).max(1));
                    places.push((next, from.1 + (share * f64::from(to.1 - from.1)).round() as i32));
                }
                next += PITCH;
            }
        }
        canvas.line(pixels.clone(), style.color, width);
        for place in places {
            mark(canvas, place, style, 9);
        }
        pixels
    }

    /// Draws a value that holds from each point to the next; returns the pixels of its corners.
    pub fn steps(
        &self,
        canvas: &mut Canvas,
        points: impl Iterator<Item = (f64, f64)>,
        style: Style,
        width: u32,
    ) -> Vec<(i32, i32)> {
        self.curve(canvas, corners(points), style, width)
    }

    /// Returns the first, least, greatest and last point of each column of pixels: the same picture with fewer points.
    fn thinned(&self, points: impl Iterator<Item = (f64, f64)>) -> Vec<(i32, i32)> {
        let mut kept: Vec<(i32, i32)> = Vec::new();
        let mut column: Vec<(i32, i32)> = Vec::new();
        let mut close = |column: &mut Vec<(i32, i32)>| {
            let low = column.iter().min_by_key(|(_, y)| *y).copied();
            let high = column.iter().max_by_key(|(_, y)| *y).copied();
            for point in [column.first().copied(), low, high, column.last().copied()].into_iter().flatten() {
                match kept[..] {
                    [.., last] if last == point => {}
                    // A level stretch needs only its ends.
                    [.., before, last] if before.1 == last.1 && last.1 == point.1 => {
                        kept.pop();
                        kept.push(point);
                    }
                    _ => kept.push(point),
                }
            }
            column.clear();
        };
        for (x, y) in points.filter(|(_, y)| y.is_finite()) {
            let point = self.at(x, y);
            if column.last().is_some_and(|last| last.0 != point.0) {
                close(&mut column);
            }
            column.push(point);
        }
        close(&mut column);
        kept
    }

    /// Draws the band between two curves; each span has one least and one greatest value.
    pub fn band(&self, canvas: &mut Canvas, spans: impl Iterator<Item = (Range<f64>, [f64; 2])>, color: RGBColor) {
        let mut columns: BTreeMap<i32, (i32, i32)> = BTreeMap::new();
        let is_shown = |span: &Range<f64>| span.end > self.x.start && span.start < self.x.end;
        for (span, values) in spans.filter(|(span, _)| is_shown(span)) {
            let (from, low) = self.at(span.start.max(self.x.start), values[0]);
            let (to, high) = self.at(span.end.min(self.x.end), values[1]);
            for x in from..=to {
                let column = columns.entry(x).or_insert((low, high));
                *column = (column.0.max(low), column.1.min(high));
            }
        }
        let mut open: Option<(i32, i32, (i32, i32))> = None;
        for (x, column) in columns {
            match &mut open {
                Some((_, to, same)) if *to == x && *same == column => *to = x + 1,
                _ => {
                    let done = open.replace((x, x + 1, column));
                    self.fill_columns(canvas, done, color);
                }
            }
        }
        self.fill_columns(canvas, open, color);
    }

    fn fill_columns(&self, canvas: &mut Canvas, columns: Option<(i32, i32, (i32, i32))>, color: RGBColor) {
        if let Some((from, to, (low, high))) = columns {
            canvas.fill([(from, high), (to, low.max(high + 1))], color);
        }
    }

    /// Shades the times at which a flag may be up. The flag is known at rows only: it changed at some time between two
    /// rows that differ. Spans that are only a few pixels apart are shaded as one.
    pub(crate) fn shade(&self, canvas: &mut Canvas, flags: impl Iterator<Item = (f64, bool)> + Clone, color: RGBColor) {
        let mut spans: Vec<(i32, i32)> = Vec::new();
        let is_shown = |from: f64, to: f64| to >= self.x.start && from <= self.x.end;
        for ((from, was_up), (to, is_up)) in flags.clone().zip(flags.skip(1)) {
            if (was_up || is_up) && is_shown(from, to) {
                let [from, to] = [from, to].map(|x| self.at(x, self.y.start).0);
                match spans.last_mut() {
                    Some(span) if from <= span.1 + 8 => span.1 = to,
                    _ => spans.push((from, to.max(from + 1))),
                }
            }
        }
        for (from, to) in spans {
            canvas.fill([(from, self.top), (to, self.bottom)], color);
        }
    }
}
