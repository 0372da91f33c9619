//! The picture of a velocity by several estimators: a panel for each, with the speed of the device behind the estimate.

use std::ops::Range;

use hpu_papers::measure::Velocities;

use crate::drawing::canvas::{HEIGHT, WIDTH};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLACK, Look, ORANGE};
use crate::{Picture, page};

const TOP: i32 = 250;
const BOTTOM: i32 = HEIGHT - 130;
/// Distance between the frames of two panels, across and down, in pixels.
const BETWEEN: (i32, i32) = (200, 120);
const COLUMNS: usize = 2;

/// A panel: the name of the estimator, and the velocities.
pub struct Estimate {
    /// The name above the panel.
    pub name: String,
    /// The time that is shown, in s; all if there is none.
    pub window_s: Option<[f64; 2]>,
    /// The velocities.
    pub velocities: Velocities,
}

/// Returns a picture with a panel for each estimate. All panels have the same ranges.
pub fn velocities(title: &str, estimates: &[Estimate], command: &str) -> Picture {
    let unit = estimates.first().map_or("", |estimate| estimate.velocities.unit);
    let mut canvas = page(title, "the speed of the device, and the velocity that the damper reads", command);
    let time = estimates.iter().map(span).reduce(|one, other| one.start.min(other.start)..one.end.max(other.end));
    let time = time.unwrap_or(0.0..1.0);
    let seen = |values: fn(&Velocities) -> &[f64]| {
        let time = time.clone();
        estimates.iter().flat_map(move |estimate| points(&estimate.velocities, values, &time)).map(|point| point.1)
    };
    let speeds = around(seen(|v| &v.true_speeds).chain(seen(|v| &v.estimates)), 0.05);
    let rows = estimates.len().div_ceil(COLUMNS).max(1) as i32;
    let width = (WIDTH - 190 - 60 - BETWEEN.0) / COLUMNS as i32;
    let height = (BOTTOM - TOP - (rows - 1) * BETWEEN.1) / rows;
    for (at, estimate) in estimates.iter().enumerate() {
        let (left, top) =
            (190 + (at % COLUMNS) as i32 * (width + BETWEEN.0), TOP + (at / COLUMNS) as i32 * (height + BETWEEN.1));
        let (right, bottom) = (left + width, top + height);
        let panel = Panel { left, top, right, bottom, x: time.clone(), y: speeds.clone() };
        let legend = [("speed", Look::Line(BLACK)), (estimate.name.as_str(), Look::Line(ORANGE))];
        let is_last = at + COLUMNS >= estimates.len();
        panel.frame(&mut canvas, &legend, is_last.then_some("time, s"), &format!("velocity, {unit}"));
        panel.steps(&mut canvas, points(&estimate.velocities, |v| &v.estimates, &time), ORANGE, 3);
        panel.curve(&mut canvas, points(&estimate.velocities, |v| &v.true_speeds, &time), BLACK, 4);
    }
    canvas.render("velocities")
}

/// Returns the time that an estimate's panel shows.
fn span(estimate: &Estimate) -> Range<f64> {
    let rows = estimate.velocities.estimates.len();
    let [from, to] = estimate.window_s.unwrap_or([0.0, rows as f64 * estimate.velocities.interval_s]);
    from..to
}

/// Returns times and values within a span of time.
fn points<'a>(
    velocities: &'a Velocities,
    values: fn(&Velocities) -> &[f64],
    time: &Range<f64>,
) -> impl Iterator<Item = (f64, f64)> + use<'a> {
    let time = time.clone();
    let at = move |(row, value): (usize, &f64)| (row as f64 * velocities.interval_s, *value);
    values(velocities).iter().enumerate().map(at).filter(move |(at, _)| time.contains(at))
}
