//! The plane of speed and error: both on logarithmic axes, with bands for errors that have no logarithm.

use std::ops::Range;

use plotters::style::WHITE;

use crate::Marker;
use crate::drawing::canvas::{Anchor, Canvas, GRID, HEIGHT, INK, QUIET, WIDTH, text_width};
use crate::drawing::labels::{self, Area, Label, Surroundings};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLACK, Look, SAND, SHADE, Style, entry, mark};

/// Vertical position of a spot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Height {
    /// In the band at the bottom: no error.
    Floor,
    /// At a relative error.
    At(f64),
    /// In the band of contestants that give only a verdict.
    Told,
    /// In the band at the top: a wrong verdict.
    Wrong,
}

/// The inside of a spot's marker.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Inside {
    Full,
    Hollow,
    /// Hollow, with a point in it.
    Target,
    /// Full, with a hole in it.
    Pierced,
}

/// A contestant in the plane.
pub(super) struct Spot {
    /// Name of the ladder that the contestant is on.
    pub family: String,
    pub speed: f64,
    pub height: Height,
    pub inside: Inside,
    pub style: Style,
    /// The contestant's whole name.
    pub name: String,
    /// The label beside the spot; empty for none.
    pub label: String,
    /// Whether the label must be written.
    pub needed: bool,
    /// Whether the spot is drawn behind the others.
    pub behind: bool,
    /// Whether no other contestant beats this one.
    pub front: bool,
    /// Whether this is the contestant to take.
    pub chosen: bool,
}

/// The texts around the plane.
pub(super) struct Words<'a> {
    pub x: &'a str,
    pub y: String,
    pub floor: &'a str,
    pub told: String,
    pub wrong: String,
    /// The error that is allowed, and its label.
    pub allowed: Option<(f64, String)>,
}

const LEFT: i32 = 190;
const RIGHT: i32 = WIDTH - 90;
const TOP: i32 = 262;
const BOTTOM: i32 = HEIGHT - 150;
/// Height of the bands at the top and the bottom, in pixels.
const BAND: i32 = 116;
/// Height of the band of verdicts, in pixels.
const TOLD: i32 = 66;

struct Plane {
    panel: Panel,
    /// Tops of the bands above the panel, if these bands exist.
    wrong: Option<i32>,
    told: Option<i32>,
    /// Middle of the band at the bottom.
    floor: i32,
}

/// Greatest gap, in powers of ten, between a point and the others. A point beyond a wider gap stands at the edge, with
/// its value.
const GAP: f64 = 1.5;

/// Returns the values without the few, at either end, that lie farther from the others than [`GAP`].
fn together(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite() && *value > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let far = |a: f64, b: f64| libm::log10(b / a) > GAP;
    // At most two, and only of at least ten values.
    let few = if sorted.len() >= 10 { 2 } else { 0 };
    let above = (1..=few).rev().find(|&n| far(sorted[sorted.len() - n - 1], sorted[sorted.len() - n]));
    sorted.truncate(sorted.len() - above.unwrap_or(0));
    let below = (1..=few.min(sorted.len().saturating_sub(1))).rev().find(|&n| far(sorted[n - 1], sorted[n]));
    sorted.split_off(below.unwrap_or(0))
}

/// Returns the range of whole powers of ten around some values.
fn decades(values: impl Iterator<Item = f64>, least: Range<f64>) -> Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite() && *value > 0.0)
        .fold((least.start, least.end), |(low, high), value| (low.min(value), high.max(value)));
    (libm::log10(low) + 1e-9).floor()..(libm::log10(high) - 1e-9).ceil()
}

/// The ends of a line.
type Line = ((i32, i32), (i32, i32));

impl Plane {
    fn new(spots: &[Spot], allowed: Option<f64>) -> Self {
        let speeds = together(spots.iter().map(|spot| spot.speed));
        let slowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
        let errors = together(spots.iter().filter_map(|spot| match spot.height {
            Height::At(error) => Some(error),
            _ => None,
        }));
        let allowed = allowed.unwrap_or(0.1);
        let there = |height| spots.iter().any(|spot| spot.height == height);
        let mut top = TOP;
        let mut band = |height, size: i32| {
            there(height).then(|| {
                top += size;
                top - size
            })
        };
        let (wrong, told) = (band(Height::Wrong, BAND), band(Height::Told, TOLD));
        let x = decades(speeds.into_iter(), slowest..slowest * 10.0);
        let y = decades(errors.into_iter(), 0.1 * allowed..1.0);
        let panel = Panel { left: LEFT, top, right: RIGHT, bottom: BOTTOM - BAND, x, y };
        Self { panel, wrong, told, floor: BOTTOM - BAND / 2 }
    }

    /// Returns the pixel of a spot; in the top band each family has its own lane.
    fn at(&self, spot: &Spot, lane: i32) -> (i32, i32) {
        let speed = libm::log10(spot.speed);
        let (x, _) = self.panel.at(speed, 0.0);
        match spot.height {
            Height::At(error) => self.panel.at(speed, libm::log10(error.max(1e-300))),
            Height::Floor => (x, self.floor),
            Height::Told => (x, self.told.unwrap_or(TOP) + TOLD / 2),
            Height::Wrong => (x, self.wrong.unwrap_or(TOP) + BAND / 2 + lane),
        }
    }

    /// Returns the addition to the label of a spot that is off the scale: its values, and the direction. Empty for any
    /// other spot.
    fn beyond(&self, spot: &Spot) -> String {
        let arrow = |range: &Range<f64>, value: f64, [less, more]: [&'static str; 2]| match libm::log10(value) {
            log if log < range.start - 1e-9 => Some(less),
            log if log > range.end + 1e-9 => Some(more),
            _ => None,
        };
        let across = arrow(&self.panel.x, spot.speed, ["\u{2190}", "\u{2192}"]);
        let up = match spot.height {
            Height::At(error) => arrow(&self.panel.y, error, ["\u{2193}", "\u{2191}"]).map(|arrow| (error, arrow)),
            _ => None,
        };
        let across = across.map_or(String::new(), |arrow| format!(", at {} {arrow}", power(spot.speed)));
        across + &up.map_or(String::new(), |(error, arrow)| format!(", {} % {arrow}", power(100.0 * error)))
    }

    /// Draws grid, axes and bands; returns the boxes of the bands' names.
    fn grid(&self, canvas: &mut Canvas, words: &Words) -> Vec<Area> {
        let Panel { left, right, bottom, .. } = self.panel;
        let mut names = Vec::new();
        let mut band = |canvas: &mut Canvas, from: i32, to: i32, text: &str| {
            names.push([left, from, left + 32 + text_width(text, 24), from + 44]);
            canvas.fill([(left, from), (right, to)], SHADE);
            canvas.line(vec![(left, to), (right, to)], WHITE, 4);
            canvas.text((left + 16, from + 22), text, 24, INK, Anchor::Left);
        };
        band(canvas, bottom, BOTTOM, words.floor);
        if let Some(from) = self.told {
            band(canvas, from, from + TOLD, &words.told);
        }
        if let Some(from) = self.wrong {
            band(canvas, from, from + BAND, &words.wrong);
        }
        let value = |decade: i32| libm::exp10(f64::from(decade));
        for decade in self.panel.y.start as i32..=self.panel.y.end as i32 {
            let (_, y) = self.panel.at(self.panel.x.start, f64::from(decade));
            canvas.line(vec![(left, y), (right, y)], GRID, 2);
            canvas.text((left - 14, y), power(value(decade + 2)), 26, QUIET, Anchor::Right);
        }
        for decade in self.panel.x.start as i32..=self.panel.x.end as i32 {
            let (x, _) = self.panel.at(f64::from(decade), 0.0);
            canvas.line(vec![(x, TOP), (x, BOTTOM)], GRID, 2);
            canvas.text((x, BOTTOM + 26), power(value(decade)), 26, QUIET, Anchor::Centre);
        }
        canvas.text(((left + right) / 2, BOTTOM + 66), words.x, 26, INK, Anchor::Centre);
        self.panel.y_name(canvas, &words.y);
        canvas.line(vec![(left, TOP), (left, BOTTOM)], QUIET, 2);
        names
    }

    /// Draws the error that is allowed; returns its line and the box of its name.
    fn allowed(&self, canvas: &mut Canvas, error: f64, text: &str) -> (Line, Area) {
        let (_, y) = self.panel.at(self.panel.x.start, libm::log10(error));
        for x in (LEFT..RIGHT).step_by(28) {
            canvas.line(vec![(x, y), ((x + 16).min(RIGHT), y)], INK, 3);
        }
        canvas.text((RIGHT - 8, y - 20), text, 24, INK, Anchor::Right);
        let name = [RIGHT - 8 - text_width(text, 24) - 16, y - 36, RIGHT, y - 4];
        (((LEFT, y), (RIGHT, y)), name)
    }
}

/// Draws the spots with their ladders and their front.
pub(super) fn draw(canvas: &mut Canvas, spots: &[Spot], words: &Words) {
    let plane = Plane::new(spots, words.allowed.as_ref().map(|(error, _)| *error));
    let mut taken = plane.grid(canvas, words);
    let mut lines = Vec::new();
    if let Some((error, text)) = &words.allowed {
        let (line, name) = plane.allowed(canvas, *error, text);
        lines.push(line);
        taken.push(name);
    }
    let mut families: Vec<&str> = Vec::new();
    for spot in spots {
        if !families.contains(&spot.family.as_str()) {
            families.push(&spot.family);
        }
    }
    // Only families with a wrong verdict have a lane, so that these are apart.
    let mut wrong = families.clone();
    wrong.retain(|family| spots.iter().any(|spot| spot.family == *family && spot.height == Height::Wrong));
    let lane = |family: &str| {
        let index = wrong.iter().position(|other| *other == family).unwrap_or(0) as i32;
        let count = wrong.len().max(2) as i32;
        (2 * index - count + 1) * (BAND / 2 - 34) / count + 16
    };
    let pixels: Vec<(i32, i32)> = spots.iter().map(|spot| plane.at(spot, lane(&spot.family))).collect();

    let mut front: Vec<usize> = (0..spots.len()).filter(|index| spots[*index].front).collect();
    front.sort_by(|a, b| spots[*a].speed.total_cmp(&spots[*b].speed));
    let corners: Vec<(i32, i32)> = front
        .iter()
        .enumerate()
        .flat_map(|(place, &index)| {
            let here = pixels[index];
            let corner = place.checked_sub(1).map(|before| (pixels[front[before]].0, here.1));
            corner.into_iter().chain([here])
        })
        .collect();
    lines.extend(corners.windows(2).map(|pair| (pair[0], pair[1])));
    canvas.line(corners, SAND, 12);

    families.sort_by_key(|family| !spots.iter().any(|spot| spot.family == *family && spot.behind));
    for family in families {
        let rungs: Vec<usize> = (0..spots.len()).filter(|index| spots[*index].family == family).collect();
        lines.extend(rungs.windows(2).map(|pair| (pixels[pair[0]], pixels[pair[1]])));
        if rungs.len() > 1 {
            let width = if spots[rungs[0]].behind { 1 } else { 4 };
            canvas.line(rungs.iter().map(|index| pixels[*index]).collect(), spots[rungs[0]].style.color, width);
        }
        for index in rungs {
            let Spot { inside, style, behind, front, .. } = &spots[index];
            shape(canvas, pixels[index], *style, *inside, if *behind && !front { 7 } else { 11 });
            if spots[index].chosen {
                canvas.dot(pixels[index], 22, INK, 4);
            }
        }
    }
    let beyond: Vec<String> = spots.iter().map(|spot| plane.beyond(spot)).collect();
    let is_named = |index: &usize| !spots[*index].label.is_empty() || !beyond[*index].is_empty();
    let mut order: Vec<usize> = (0..spots.len()).filter(is_named).collect();
    order.sort_by_key(|&index| (beyond[index].is_empty(), !spots[index].front, !spots[index].needed));
    let named: Vec<Label> = order
        .into_iter()
        .map(|index| {
            let (Spot { name, label, needed, .. }, beyond) = (&spots[index], &beyond[index]);
            // The label of a spot off the scale always shows its name and its value.
            let label = if beyond.is_empty() { label } else { name };
            Label { at: pixels[index], text: format!("{label}{beyond}"), needed: *needed || !beyond.is_empty() }
        })
        .collect();
    let inside = [LEFT + 4, TOP + 4, RIGHT - 4, BOTTOM - 4];
    labels::write(canvas, &named, &Surroundings { inside, taken, dots: &pixels, lines: &lines });
}

/// Returns a power of ten, or a value between two of them, in few letters.
fn power(value: f64) -> String {
    let decade = libm::log10(value).round();
    match decade as i32 {
        -3..=5 if (libm::log10(value) - decade).abs() < 1e-6 => {
            format!("{value:.*}", (-decade).max(0.0) as usize)
        }
        _ => format!("{value:.0e}").replace('-', "\u{2212}"),
    }
}

/// Draws one spot.
fn shape(canvas: &mut Canvas, at: (i32, i32), style: Style, inside: Inside, reach: i32) {
    mark(canvas, at, style, reach);
    let hole = |canvas: &mut Canvas, reach| mark(canvas, at, Style { color: WHITE, ..style }, reach);
    match inside {
        Inside::Full => {}
        Inside::Hollow => hole(canvas, reach - 4),
        Inside::Target => {
            hole(canvas, reach - 4);
            canvas.dot(at, 3, style.color, 0);
        }
        Inside::Pierced => canvas.dot(at, 3, WHITE, 0),
    }
}

/// Draws the key: the solvers in a row, and below it the insides of markers, the front and the ring.
pub(super) fn key(canvas: &mut Canvas, solvers: &[(String, Style)], insides: &[(&str, Inside)], allowed: Option<&str>) {
    let mut x = 60;
    for (text, style) in solvers {
        x = entry(canvas, (x, 166), (text.as_str(), Look::Line(*style)), 26);
    }
    let (mut x, y) = (60, 218);
    let mut say = |canvas: &mut Canvas, wide: i32, text: &str| {
        canvas.text((x + wide, y), text, 26, INK, Anchor::Left);
        x += wide + text_width(text, 26) + 40;
        x
    };
    let mut at = 60;
    for (text, inside) in insides {
        shape(canvas, (at + 12, y), Style { marker: Marker::Square, ..BLACK }, *inside, 11);
        at = say(canvas, 34, text);
    }
    canvas.declare("beaten by none in both", SAND, None);
    canvas.line(vec![(at, y), (at + 44, y)], SAND, 12);
    at = say(canvas, 58, "beaten by none in both");
    if let Some(allowed) = allowed {
        canvas.dot((at + 16, y), 16, INK, 4);
        say(canvas, 46, &format!("fastest of {allowed}"));
    }
}
