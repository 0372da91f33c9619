//! The pictures of a drop test: the tip above its wall, and how it rests there.

use std::ops::Range;

use hpu_cosim::scene::PhantomScene;
use hpu_cosim::{PhantomSimulation, Simulation, Summary, Trace, Verdict};

use crate::drawing::canvas::{Canvas, HEIGHT, QUIET, WIDTH};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, Look, ORANGE, SHADE};
use crate::{Picture, page, rate, thinned};

/// Length of the close-up of the end, in s.
const END_S: f64 = 0.5;

fn outcome(summary: &Summary) -> String {
    match summary.verdict {
        Some(Verdict::Passive { rms_m }) => format!("passive, {:.2} \u{b5}m rms", 1e6 * rms_m),
        Some(Verdict::NonPassive { rms_m }) => format!("non-passive, {:.1} \u{b5}m rms", 1e6 * rms_m),
        Some(Verdict::HighlyUnstable { at_s }) => format!("highly unstable, aborted at {at_s:.2} s"),
        _ => "interrupted".into(),
    }
}

fn conditions(scene: &PhantomScene, trace: &Trace) -> String {
    let (platform, axis) = (scene.platform.name(), scene.drop.axis.name());
    let stiffness = scene.room.stiffness_n_per_m;
    let sampled = rate(f64::from(scene.platform.rate_hz()));
    format!(
        "{platform}, sampled at {sampled}; {axis} axis, wall of {stiffness} N/m, trial {}{}",
        scene.drop.trial,
        thinned(trace)
    )
}

/// Returns the pictures of a drop test, from its trace of [`DROP_NETS`](crate::DROP_NETS).
pub fn drop_pictures(simulation: &PhantomSimulation, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
    if trace.rows() == 0 {
        return Vec::new();
    }
    vec![drop(simulation.scene(), trace, summary, command), force(simulation, trace, summary, command)]
}

/// Returns the times and values of a column of the trace, multiplied by `scale`.
pub(crate) fn column(trace: &Trace, real: usize, scale: f64) -> impl Iterator<Item = (f64, f64)> + Clone {
    trace.times_s().zip(trace.real(real).iter().map(move |value| value * scale))
}

/// Returns the last stretch of a run.
fn ending(summary: &Summary) -> Range<f64> {
    let end_s = summary.motion_s.max(1e-6);
    // For a short trial only a part of it, so that the two panels never show the same.
    end_s - END_S.min(0.25 * end_s)..end_s
}

/// Draws a wall below its height.
fn wall(panel: &Panel, height: f64, canvas: &mut Canvas) {
    if height > panel.y.start {
        canvas.fill([panel.at(panel.x.start, height), panel.at(panel.x.end, panel.y.start)], SHADE);
        // A wall that begins above the panel has no face to show in it.
        if panel.y.contains(&height) {
            canvas.line(vec![panel.at(panel.x.start, height), panel.at(panel.x.end, height)], QUIET, 3);
        }
    }
}

fn drop(scene: &PhantomScene, trace: &Trace, summary: &Summary, command: &str) -> Picture {
    let axis = scene.drop.axis.index();
    let title = format!("{}: {}", scene.name, outcome(summary));
    let mut canvas = page(&title, &conditions(scene, trace), command);
    let floor_mm = -1e3 * scene.room.distance_m;
    let tip_mm = column(trace, axis, 1e3);
    let y = around(tip_mm.clone().map(|point| point.1).chain([floor_mm]), 0.06);
    let top = Panel { left: 170, top: 210, right: WIDTH - 120, bottom: 740, x: 0.0..summary.motion_s.max(1e-6), y };
    wall(&top, floor_mm, &mut canvas);
    let legend = [("the tip", Look::Line(BLUE)), ("inside the wall", Look::Area(SHADE))];
    let y_label = format!("{} of the tip in mm", scene.drop.axis.name());
    top.frame(&mut canvas, &legend, Some("time in s"), &y_label);
    top.curve(&mut canvas, tip_mm, BLUE, 3);

    let x = ending(summary);
    let above = |real: usize| column(trace, real, 1e6).map(move |(t, v)| (t, v - 1e3 * floor_mm));
    let shown = above(axis).chain(above(3 + axis)).filter(|(t, _)| x.contains(t)).map(|point| point.1);
    let y = around(shown, 0.1);
    // A tip at rest within a count is shown as at rest, not magnified.
    let middle = 0.5 * (y.start + y.end);
    let y = if y.end - y.start < 100.0 { middle - 50.0..middle + 50.0 } else { y };
    let bottom = Panel { left: 170, top: 920, right: WIDTH - 120, bottom: HEIGHT - 150, x: x.clone(), y };
    wall(&bottom, 0.0, &mut canvas);
    let legend = [
        ("the tip", Look::Line(BLUE)),
        ("as the encoders' counts tell it", Look::Line(ORANGE)),
        ("inside the wall", Look::Area(SHADE)),
    ];
    bottom.frame(&mut canvas, &legend, Some("time in s: the end of the trial"), "height above the wall in \u{b5}m");
    bottom.curve(&mut canvas, above(axis), BLUE, 5);
    bottom.curve(&mut canvas, above(3 + axis), ORANGE, 3);
    canvas.render("drop")
}

fn force(simulation: &PhantomSimulation, trace: &Trace, summary: &Summary, command: &str) -> Picture {
    let scene = simulation.scene();
    let axis = scene.drop.axis.index();
    let title = format!("{}: {}", scene.name, outcome(summary));
    let mut canvas = page(&title, &conditions(scene, trace), command);
    let came = column(trace, 6 + axis, 1e3);
    // The commands are the first nets of the trace.
    let quantum_mnm = 1e3 * simulation.commands()[axis].2;
    let asked = trace.times_s().zip(trace.words(axis).iter().map(|word| *word as f64 * quantum_mnm));
    let panels = [
        (0.0..summary.motion_s.max(1e-6), 210, 740, "time in s"),
        (ending(summary), 920, HEIGHT - 150, "time in s: the end of the trial"),
    ];
    for (x, top, bottom, x_label) in panels {
        let shown = came.clone().chain(asked.clone()).filter(|(t, _)| x.contains(t));
        let y = around(shown.map(|point| point.1).chain([0.0]), 0.08);
        let panel = Panel { left: 170, top, right: WIDTH - 120, bottom, x, y };
        let legend = [("commanded", Look::Line(ORANGE)), ("of the motor under test, at its joint", Look::Line(BLUE))];
        panel.frame(&mut canvas, &legend, Some(x_label), "torque in mN\u{b7}m");
        // The narrow command is drawn over the wide torque, so that both are visible where they agree.
        panel.curve(&mut canvas, came.clone(), BLUE, 8);
        panel.curve(&mut canvas, asked.clone(), ORANGE, 3);
    }
    canvas.render("force")
}
