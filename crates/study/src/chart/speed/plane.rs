//! The plane of speed and error: both as logarithms, with bands for what has no logarithm.

use std::ops::Range;

use plotters::style::RGBColor;

use super::super::canvas::{Anchor, Canvas, GREEN, GRID, HEIGHT, INK, ORANGE, PALE, QUIET, RED, WIDTH, text_width};
use super::super::panel::Panel;
use super::labels::{self, Area, Label, Surroundings};

/// How high a spot stands.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Height {
    /// In the band at the floor.
    Floor,
    /// At an error.
    At(f64),
    /// In the band of those that tell a verdict and no more.
    Told,
    /// In the band at the top.
    Wrong,
}

/// The shape of a spot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Shape {
    Dot,
    Ring,
    Triangle,
    Square,
    Diamond,
}

/// A contestant in the plane.
pub(super) struct Spot {
    /// The ladder that it is on.
    pub family: String,
    pub speed: f64,
    pub height: Height,
    pub shape: Shape,
    pub color: RGBColor,
    /// Its name, if it is to have one.
    pub label: String,
    /// Whether the name must be there.
    pub needed: bool,
    /// Whether it is drawn behind the others.
    pub behind: bool,
    /// Whether no other beats it.
    pub front: bool,
    /// Whether it is the one to take.
    pub chosen: bool,
}

/// What is written about the plane.
pub(super) struct Words<'a> {
    pub x: &'a str,
    pub floor: &'a str,
    pub told: &'a str,
    pub wrong: &'a str,
    /// The error that is allowed, and what to call it.
    pub allowed: Option<(f64, String)>,
}

const LEFT: i32 = 190;
const RIGHT: i32 = WIDTH - 90;
const TOP: i32 = 262;
const BOTTOM: i32 = HEIGHT - 150;
/// Height of the bands at top and floor.
const BAND: i32 = 116;
/// Height of the band of verdicts.
const TOLD: i32 = 66;

struct Plane {
    panel: Panel,
    /// Tops of the bands above it, of those that are there.
    wrong: Option<i32>,
    told: Option<i32>,
    /// Middle of the band at the floor.
    floor: i32,
}

/// Whole powers of ten around some values.
fn decades(values: impl Iterator<Item = f64>, least: Range<f64>) -> Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite() && *value > 0.0)
        .fold((least.start, least.end), |(low, high), value| (low.min(value), high.max(value)));
    (libm::log10(low) + 1e-9).floor()..(libm::log10(high) - 1e-9).ceil()
}

impl Plane {
    fn new(spots: &[Spot], allowed: Option<f64>) -> Self {
        let speeds = spots.iter().map(|spot| spot.speed);
        let slowest = spots.iter().map(|spot| spot.speed).fold(f64::INFINITY, f64::min);
        let errors = spots.iter().filter_map(|spot| match spot.height {
            // What is wrong by more than all is as wrong as that.
            Height::At(error) => Some(error.clamp(1e-9, 10.0)),
            _ => None,
        });
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
        let x = decades(speeds, slowest..slowest * 10.0);
        let y = decades(errors, 0.1 * allowed..1.0);
        let panel = Panel { left: LEFT, top, right: RIGHT, bottom: BOTTOM - BAND, x, y };
        Self { panel, wrong, told, floor: BOTTOM - BAND / 2 }
    }

    /// The pixel of a spot; in a band each family has its own lane.
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

    /// Grid, axes and bands; returns where the bands' names stand.
    fn grid(&self, canvas: &mut Canvas, words: &Words) -> Vec<Area> {
        let Panel { left, right, bottom, .. } = self.panel;
        let power = |power: i32| libm::exp10(f64::from(power));
        for decade in self.panel.y.start as i32..=self.panel.y.end as i32 {
            let (_, y) = self.panel.at(self.panel.x.start, f64::from(decade));
            canvas.line(vec![(left, y), (right, y)], GRID, 2);
            let label = match decade {
                -5.. => format!("{:.*} %", (-2 - decade).max(0) as usize, 100.0 * power(decade)),
                _ => format!("1e\u{2212}{} %", -2 - decade),
            };
            canvas.text((left - 14, y), label, 26, QUIET, Anchor::Right);
        }
        for decade in self.panel.x.start as i32..=self.panel.x.end as i32 {
            let (x, _) = self.panel.at(f64::from(decade), 0.0);
            canvas.line(vec![(x, TOP), (x, BOTTOM)], GRID, 2);
            let label = if (-3..=5).contains(&decade) { power(decade).to_string() } else { format!("1e{decade}") };
            canvas.text((x, BOTTOM + 26), label, 26, QUIET, Anchor::Centre);
        }
        canvas.text(((left + right) / 2, BOTTOM + 66), words.x, 26, INK, Anchor::Centre);
        let mut names = Vec::new();
        let mut band = |canvas: &mut Canvas, from: i32, to: i32, color, alpha, text: &str| {
            names.push([left, from, left + 32 + text_width(text, 24), from + 44]);
            canvas.fill([(left, from), (right, to)], color, alpha);
            canvas.text((left + 16, from + 22), text, 24, INK, Anchor::Left);
        };
        band(canvas, bottom, BOTTOM, PALE, 0.45, words.floor);
        if let Some(from) = self.told {
            band(canvas, from, from + TOLD, GRID, 0.6, words.told);
        }
        if let Some(from) = self.wrong {
            band(canvas, from, from + BAND, RED, 0.10, words.wrong);
        }
        canvas.line(vec![(left, TOP), (left, BOTTOM)], QUIET, 2);
        names
    }

    /// Draws the error that is allowed; returns its line.
    fn allowed(&self, canvas: &mut Canvas, error: f64, text: &str) -> ((i32, i32), (i32, i32)) {
        let (_, y) = self.panel.at(self.panel.x.start, libm::log10(error));
        for x in (LEFT..RIGHT).step_by(28) {
            canvas.line(vec![(x, y), ((x + 16).min(RIGHT), y)], GREEN, 3);
        }
        canvas.text((RIGHT - 8, y - 20), text, 24, GREEN, Anchor::Right);
        ((LEFT, y), (RIGHT, y))
    }
}

/// Draws the spots with their ladders and their front.
pub(super) fn draw(canvas: &mut Canvas, spots: &[Spot], words: &Words) {
    let plane = Plane::new(spots, words.allowed.as_ref().map(|(error, _)| *error));
    let taken = plane.grid(canvas, words);
    let mut lines = Vec::new();
    if let Some((error, text)) = &words.allowed {
        lines.push(plane.allowed(canvas, *error, text));
    }
    let mut families: Vec<&str> = Vec::new();
    for spot in spots {
        if !families.contains(&spot.family.as_str()) {
            families.push(&spot.family);
        }
    }
    // Lanes for those alone that are wrong, so that they are apart.
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
    canvas.line(corners, FRONT, 10);

    families.sort_by_key(|family| !spots.iter().any(|spot| spot.family == *family && spot.behind));
    for family in families {
        let rungs: Vec<usize> = (0..spots.len()).filter(|index| spots[*index].family == family).collect();
        lines.extend(rungs.windows(2).map(|pair| (pixels[pair[0]], pixels[pair[1]])));
        if rungs.len() > 1 {
            let width = if spots[rungs[0]].behind { 2 } else { 4 };
            canvas.line(rungs.iter().map(|index| pixels[*index]).collect(), spots[rungs[0]].color, width);
        }
        for index in rungs {
            shape(canvas, pixels[index], spots[index].shape, spots[index].color);
            if spots[index].chosen {
                canvas.dot(pixels[index], 20, GREEN, 4);
            }
        }
    }
    let mut order: Vec<usize> = (0..spots.len()).filter(|index| !spots[*index].label.is_empty()).collect();
    order.sort_by_key(|index| (!spots[*index].front, !spots[*index].needed));
    let named: Vec<Label> = order
        .into_iter()
        .map(|index| {
            let Spot { label, color, needed, .. } = &spots[index];
            Label { at: pixels[index], text: label.clone(), color: *color, needed: *needed }
        })
        .collect();
    let inside = [LEFT + 4, TOP + 4, RIGHT - 4, BOTTOM - 4];
    labels::write(canvas, &named, &Surroundings { inside, taken, dots: &pixels, lines: &lines });
}

/// The front, behind all that is on it.
const FRONT: RGBColor = RGBColor(250, 222, 150);

/// One spot.
pub(super) fn shape(canvas: &mut Canvas, (x, y): (i32, i32), shape: Shape, color: RGBColor) {
    match shape {
        Shape::Dot => canvas.dot((x, y), 9, color, 0),
        Shape::Ring => canvas.dot((x, y), 8, color, 4),
        Shape::Square => canvas.fill([(x - 8, y - 8), (x + 8, y + 8)], color, 1.0),
        Shape::Triangle => {
            for row in 0i32..=18 {
                let half = row * 10 / 18;
                canvas.fill([(x - half, y - 11 + row), (x + half, y - 10 + row)], color, 1.0);
            }
        }
        Shape::Diamond => {
            for row in -10i32..=10 {
                let half = 10 - row.abs();
                canvas.fill([(x - half, y + row), (x + half, y + row + 1)], color, 1.0);
            }
        }
    }
}

/// Entries of a key in a row, each with its shape.
pub(super) fn key(canvas: &mut Canvas, (mut x, y): (i32, i32), entries: &[(String, Shape, RGBColor)]) {
    for (text, of, color) in entries {
        shape(canvas, (x + 10, y), *of, *color);
        canvas.text((x + 32, y), text.as_str(), 26, *color, Anchor::Left);
        x += 32 + text_width(text, 26) + 38;
    }
    canvas.line(vec![(x, y), (x + 44, y)], FRONT, 10);
    canvas.text((x + 58, y), "beaten by none in both", 26, ORANGE, Anchor::Left);
}
