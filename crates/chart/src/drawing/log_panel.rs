//! A panel with logarithmic axes, and the colours of the platforms.

use std::ops::Range;

use hpu_cosim::scene::Platform;
use plotters::style::RGBColor;

use crate::drawing::canvas::{Anchor, Canvas, GRID, QUIET};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLACK, BLUE, GREEN, LILAC, Look, MAROON, ORANGE, PURPLE, RUST, Style, entry, mark};

/// Returns the look of a platform: cold colours for the real-time system, warm colours for the FPGA.
pub(crate) fn style(platform: Platform) -> Style {
    match platform {
        Platform::Pmos1 => BLACK,
        Platform::Rtos(1) => LILAC,
        Platform::Rtos(5) => GREEN,
        Platform::Rtos(10) => BLUE,
        Platform::Rtos(_) => PURPLE,
        Platform::Fpga(20) => ORANGE,
        Platform::Fpga(100) => RUST,
        Platform::Fpga(_) => MAROON,
    }
}

/// Returns the panel between these corners; the ranges are given as values and shown as their logarithms.
pub(crate) fn log_panel(corners: [(i32, i32); 2], x: Range<f64>, y: Range<f64>) -> Panel {
    let [(left, top), (right, bottom)] = corners;
    let log = |range: Range<f64>| libm::log10(range.start)..libm::log10(range.end);
    Panel { left, top, right, bottom, x: log(x), y: log(y) }
}

/// Draws a level of the vertical axis as a line, with its label.
pub(crate) fn level(panel: &Panel, canvas: &mut Canvas, value: f64, label: &str, color: RGBColor, width: u32) {
    let (_, y) = panel.at(panel.x.start, libm::log10(value));
    canvas.line(vec![(panel.left, y), (panel.right, y)], color, width);
    canvas.text((panel.left - 14, y), label, 26, QUIET, Anchor::Right);
}

/// Draws a grid line at each power of ten of the vertical axis.
pub(crate) fn decades(panel: &Panel, canvas: &mut Canvas) {
    for power in (panel.y.start - 1e-9).ceil() as i32..=(panel.y.end + 1e-9).floor() as i32 {
        let value = libm::exp10(f64::from(power));
        level(panel, canvas, value, &value.to_string(), GRID, 2);
    }
}

/// Draws a line through points with a marker at each; the line is broken where a point is missing.
pub(crate) fn dotted(panel: &Panel, canvas: &mut Canvas, points: &[Option<(f64, f64)>], style: Style) {
    let pixels: Vec<_> = points.iter().map(|point| point.map(|(x, y)| panel.at(x, y))).collect();
    through(canvas, &pixels, style);
}

/// Like [`dotted`], through pixels.
pub(crate) fn through(canvas: &mut Canvas, pixels: &[Option<(i32, i32)>], style: Style) {
    for run in pixels.split(Option::is_none) {
        let run: Vec<(i32, i32)> = run.iter().flatten().copied().collect();
        canvas.line(run.clone(), style.color, 4);
        for at in run {
            mark(canvas, at, style, 10);
        }
    }
}

/// Draws the platforms and their looks, one below the other.
pub(crate) fn legend(canvas: &mut Canvas, platforms: &[Platform], (x, top): (i32, i32)) {
    canvas.panel();
    for (index, &platform) in platforms.iter().enumerate() {
        entry(canvas, (x, top + 44 * index as i32), (platform.name(), Look::Line(style(platform))), 28);
    }
}
