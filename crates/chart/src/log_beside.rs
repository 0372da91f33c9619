//! The picture of a run beside a log.

use hpu_cosim::LogHeld;

use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, Look, ORANGE, RUST};
use crate::{Picture, page};

/// Returns one picture of a run beside a log of positions in `unit`, rad or m: both over time, and the run less the
/// log.
pub fn log_beside(title: &str, held: &LogHeld, unit: &str, command: &str) -> Picture {
    let (scale, shown, fine) =
        if unit == "m" { (1e3, "mm", "um") } else { (180.0 / std::f64::consts::PI, "deg", "mdeg") };
    let conditions = format!(
        "{} beside {} rows, shifted by {} steps of {:.6} ms",
        held.column,
        held.rows.len(),
        held.shift,
        1e3 * held.step_s
    );
    let mut canvas = page(title, &conditions, command);
    let (left, right) = (230, crate::drawing::canvas::WIDTH - 80);
    let start = held.rows.first().map_or(0.0, |[time_s, ..]| *time_s);
    let end = held.rows.last().map_or(1.0, |[time_s, ..]| *time_s);
    let x = start..end.max(start + 1e-9);
    let [log, run] = [1, 2].map(|at| held.rows.iter().map(move |row| (row[0], scale * row[at])));
    let y = around(log.clone().chain(run.clone()).map(|(_, value)| value), 0.06);
    let top = Panel { left, top: 210, right, bottom: 780, x: x.clone(), y };
    top.frame(
        &mut canvas,
        &[("log", Look::Line(ORANGE)), ("run", Look::Line(BLUE))],
        None,
        &format!("position in {shown}"),
    );
    top.curve(&mut canvas, log, ORANGE, 7);
    top.curve(&mut canvas, run, BLUE, 3);
    let off = held.rows.iter().map(|[time_s, log, run]| (*time_s, 1e3 * scale * (run - log)));
    let y = around(off.clone().map(|(_, value)| value).chain([0.0]), 0.08);
    let bottom = Panel { left, top: 880, right, bottom: 1270, x, y };
    bottom.frame(
        &mut canvas,
        &[("run less log", Look::Line(RUST))],
        Some("time in s"),
        &format!("difference in {fine}"),
    );
    bottom.curve(&mut canvas, off, RUST, 3);
    canvas.render("against")
}
