//! The picture of the bits: each word compared with its format, and where bits were lost.

use hpu_cosim::NetUse;

use crate::drawing::canvas::{Anchor, Canvas, GRID, HEIGHT, INK, QUIET, WIDTH, text_width};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, Look, RUST, SAND};
use crate::drawing::words::COMMAND;
use crate::{Picture, Run, conditions, nets, page};

const RIGHT: i32 = WIDTH - 520;

/// Draws every traced word at its rows, shades the edges at which it had overflowed, and shows the share of its format
/// that it used.
pub(crate) fn bits(run: &Run) -> Picture {
    let uses: Vec<&NetUse> = nets(run.scene)
        .iter()
        .filter_map(|name| run.summary.nets.iter().find(|net| net.signal.name == *name))
        .collect();
    let title = format!("{}: {}", run.scene.name, lost(run, &uses));
    let mut canvas = page(&title, &conditions(run), run.command);
    let top = 200;
    let pitch = (HEIGHT - 95 - top) / uses.len() as i32;
    canvas.text((RIGHT + 60, top - 42), "range used of the format", 26, INK, Anchor::Left);
    for (net, used) in uses.iter().enumerate() {
        let name = used.signal.name;
        let last = name == COMMAND;
        let words = run.words_of(name).map(|(t, word)| (t, word as f64));
        let y = around(words.clone().map(|point| point.1), 0.08);
        let (top, x) = (top + net as i32 * pitch, 0.0..run.summary.motion_s);
        let panel = Panel { left: 170, top, right: RIGHT, bottom: top + pitch - 66, x, y };
        let overflows = run.overflowed(name);
        let overflowed = run.trace.times_s().zip(overflows.iter().copied());
        panel.shade(&mut canvas, overflowed.clone(), SAND);
        let above = Panel { top: panel.top - 8, bottom: panel.top, x: panel.x.clone(), y: panel.y.clone(), ..panel };
        above.shade(&mut canvas, overflowed, RUST.color);
        limits(&panel, &mut canvas, used);
        // Elsewhere a counter is read as signed; here its word fills its format, and wraps at its ends.
        let counted = if used.signal.is_counter() { ", unsigned" } else { "" };
        let name = format!("{} {}{counted}", used.signal.name, used.signal.format);
        let mut legend = vec![(name.as_str(), Look::Line(BLUE))];
        if used.usage.overflowed > 0 {
            legend.push(("overflowed", Look::Area(SAND)));
        }
        panel.frame(&mut canvas, &legend, last.then_some("time in s"), &unit(used));
        panel.curve(&mut canvas, words, BLUE, 3);
        gauge(&panel, &mut canvas, used, run.summary.edges);
    }
    canvas.render("bits")
}

fn unit(net: &NetUse) -> String {
    let lsb = net.signal.format.lsb();
    if lsb == 1.0 { net.signal.unit.to_string() } else { format!("{lsb} {}", net.signal.unit) }
}

/// Returns the overflows as text for the title.
fn lost(run: &Run, uses: &[&NetUse]) -> String {
    let lost: Vec<String> = uses
        .iter()
        .filter(|net| net.usage.overflowed > 0)
        .map(|net| format!("{} {}", net.signal.name, share(net.usage.overflowed, run.summary.edges)))
        .collect();
    if lost.is_empty() { "no word overflows".into() } else { format!("overflow of {} of the time", lost.join(", ")) }
}

fn share(edges: u64, all: u64) -> String {
    let percent = 100.0 * edges as f64 / all.max(1) as f64;
    if percent < 0.1 { "below 0.1 %".into() } else { format!("{percent:.1} %") }
}

/// Draws the ends of the format, where they are in view.
fn limits(panel: &Panel, canvas: &mut Canvas, net: &NetUse) {
    for end in [net.signal.format.min(), net.signal.format.max()] {
        if panel.y.contains(&(end as f64)) {
            canvas.line(vec![panel.at(panel.x.start, end as f64), panel.at(panel.x.end, end as f64)], QUIET, 3);
        }
    }
}

/// Draws the format as a bar, with the range used filled in.
fn gauge(panel: &Panel, canvas: &mut Canvas, net: &NetUse, edges: u64) {
    let format = net.signal.format;
    let (left, right) = (RIGHT + 60, WIDTH - 60);
    let (min, max) = (format.min() as f64, format.max() as f64);
    let at = |word: i64| left + ((word as f64 - min) / (max - min) * f64::from(right - left)).round() as i32;
    let (top, bottom) = (panel.top + 4, panel.top + 34);
    canvas.fill([(left, top), (right, bottom)], GRID);
    let used = net.usage;
    let color = if used.overflowed > 0 { RUST.color } else { BLUE.color };
    if used.overflowed > 0 {
        canvas.declare("range used, with overflow", color, None);
    }
    let mut y = bottom + 28;
    if used.min <= used.max {
        canvas.fill([(at(used.min), top), (at(used.max).max(at(used.min) + 3), bottom)], color);
        let range = |min: i128, max: i128| format!("{min} \u{2026} {max}").replace('-', "\u{2212}");
        let (seen, whole) =
            (range(used.min.into(), used.max.into()), format!("of {}", range(format.min(), format.max())));
        let line = format!("{seen} {whole}");
        let fits = |line: &String, size: i32| text_width(line, size) <= right - left;
        let lines = if fits(&line, 26) { vec![line] } else { vec![seen, whole] };
        let size = [26, 22].into_iter().find(|size| lines.iter().all(|line| fits(line, *size))).unwrap_or(18);
        for line in lines {
            canvas.text((left, y), line, size, QUIET, Anchor::Left);
            y += 36;
        }
    }
    if used.overflowed > 0 {
        let text = format!("overflowed: {} of the edges", share(used.overflowed, edges));
        canvas.text((left, y), text, 26, INK, Anchor::Left);
    } else if used.rounded > 0 {
        let text = format!("rounded: {} of the edges", share(used.rounded, edges));
        canvas.text((left, y), text, 26, QUIET, Anchor::Left);
    }
}
