//! A panel whose axes are logarithmic, and the colours of the platforms.

use std::ops::Range;

use hpu_cosim::scene::Platform;
use plotters::style::RGBColor;

use super::canvas::{Anchor, Canvas, GRID, INK, QUIET};
use super::panel::Panel;

/// One colour a platform: the families of the paper in shades.
pub(super) fn color(platform: Platform) -> RGBColor {
    match platform {
        Platform::Pmos1 => INK,
        Platform::Rtos(1) => RGBColor(146, 193, 235),
        Platform::Rtos(5) => RGBColor(86, 152, 214),
        Platform::Rtos(10) => RGBColor(28, 98, 184),
        Platform::Rtos(_) => RGBColor(14, 52, 110),
        Platform::Fpga(20) => RGBColor(240, 178, 84),
        Platform::Fpga(100) => RGBColor(217, 119, 6),
        Platform::Fpga(_) => RGBColor(170, 50, 10),
    }
}

/// The panel between these corners, over ranges given as they are and shown as their logarithms.
pub(super) fn log_panel(corners: [(i32, i32); 2], x: Range<f64>, y: Range<f64>) -> Panel {
    let [(left, top), (right, bottom)] = corners;
    let log = |range: Range<f64>| libm::log10(range.start)..libm::log10(range.end);
    Panel { left, top, right, bottom, x: log(x), y: log(y) }
}

/// A level of the vertical axis as a line, with its label.
pub(super) fn level(panel: &Panel, canvas: &mut Canvas, value: f64, label: &str, color: RGBColor, width: u32) {
    let (_, y) = panel.at(panel.x.start, libm::log10(value));
    canvas.line(vec![(panel.left, y), (panel.right, y)], color, width);
    canvas.text((panel.left - 14, y), label, 26, QUIET, Anchor::Right);
}

/// A grid line at each power of ten of the vertical axis.
pub(super) fn decades(panel: &Panel, canvas: &mut Canvas) {
    for power in (panel.y.start - 1e-9).ceil() as i32..=(panel.y.end + 1e-9).floor() as i32 {
        let value = libm::exp10(f64::from(power));
        level(panel, canvas, value, &value.to_string(), GRID, 2);
    }
}

/// A line through points with a dot at each; it is broken where there is none.
pub(super) fn dotted(panel: &Panel, canvas: &mut Canvas, points: &[Option<(f64, f64)>], color: RGBColor) {
    for run in points.split(Option::is_none) {
        let pixels: Vec<(i32, i32)> = run.iter().flatten().map(|(x, y)| panel.at(*x, *y)).collect();
        for &(x, y) in &pixels {
            canvas.fill([(x - 7, y - 7), (x + 7, y + 7)], color, 1.0);
        }
        canvas.line(pixels, color, 4);
    }
}

/// The platforms and their colours, one below the other.
pub(super) fn legend(canvas: &mut Canvas, platforms: &[Platform], (x, top): (i32, i32)) {
    for (index, &platform) in platforms.iter().enumerate() {
        let y = top + 44 * index as i32;
        canvas.fill([(x, y - 4), (x + 36, y + 4)], color(platform), 1.0);
        canvas.text((x + 52, y), platform.name(), 28, INK, Anchor::Left);
    }
}
