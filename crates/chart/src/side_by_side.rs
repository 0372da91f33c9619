//! Runs side by side, each a column, all on the same scales.

use hpu_signal::Format;

use crate::drawing::canvas::{Anchor, HEIGHT, INK, WIDTH};
use crate::drawing::labels::{self, Label, Surroundings};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, Look, ORANGE, SAND, SHADE};
use crate::drawing::words::{PENETRATION, SPRING};
use crate::motion::{ANGLE, angle_label, wall};
use crate::{Picture, Run, outcome, page};

/// Returns how hard the wall pushes, in PWM counts, over time.
fn push<'a>(run: &Run<'a>) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    let quantum = run.quantum();
    run.words_of(run.push()).map(move |(t, word)| (t, word as f64 * quantum))
}

/// Returns one picture of several runs: angle and spring word over time, and the spring word over the penetration from
/// which it is computed.
///
/// # Panics
///
/// If there is no run.
pub fn side_by_side(title: &str, runs: &[Run], command: &str) -> Picture {
    let names: Vec<&str> = runs.iter().map(|run| run.scene.name.as_str()).collect();
    let mut canvas = page(title, &names.join(" and "), command);
    let angles = runs.iter().flat_map(|run| run.trace.angles_rad().iter().copied());
    let walls = runs.iter().map(|run| run.words.realised.wall_position_rad);
    let angle_range = around(angles.chain(walls), 0.08);
    let pushes = runs.iter().flat_map(|run| push(run).map(|(_, counts)| counts));
    let spring_range = around(pushes.chain([0.0]), 0.08);
    let depths = runs.iter().flat_map(|run| run.words_of(PENETRATION).map(|(_, word)| word as f64));
    let depth_range = around(depths.chain([0.0]), 0.0);

    let width = (WIDTH - 100) / runs.len() as i32;
    for (index, run) in runs.iter().enumerate() {
        let (left, right) = (170 + index as i32 * width, (index as i32 + 1) * width - 20);
        // The name is what distinguishes the runs: the product's overflow if it differs, else the scene.
        let name = match runs.iter().all(|other| other.scene.method.saturate == run.scene.method.saturate) {
            true => run.scene.name.as_str(),
            false if run.scene.method.saturate => "product saturates",
            false => "product drops its upper bits",
        };
        canvas.text((left, 160), name, 32, INK, Anchor::Left);
        canvas.text((left, 202), outcome(run), 28, INK, Anchor::Left);
        let x = 0.0..run.summary.motion_s;

        let top = Panel { left, top: 280, right, bottom: 560, x: x.clone(), y: angle_range.clone() };
        if run.scene.target.is_none() {
            wall(run.words.realised.wall_position_rad, &top, &mut canvas);
        }
        let legend = [("device", Look::Line(BLUE)), ("inside the wall", Look::Area(SHADE))];
        top.frame(&mut canvas, &legend, None, &angle_label(run.scene.device.units(), None));
        top.curve(&mut canvas, run.reals_of(ANGLE, 1.0), BLUE, 4);

        let middle = Panel { left, top: 640, right, bottom: 900, x, y: spring_range.clone() };
        let overflowed = run.overflowed(run.push());
        middle.shade(&mut canvas, run.trace.times_s().zip(overflowed), SAND);
        let label = format!("{} in PWM counts", run.push());
        let legend = [(run.push(), Look::Line(ORANGE)), ("overflowed", Look::Area(SAND))];
        middle.frame(&mut canvas, &legend, Some("time in s"), &label);
        middle.curve(&mut canvas, push(run), ORANGE, 3);

        let y = spring_range.clone();
        let bottom = Panel { left, top: 1050, right, bottom: HEIGHT - 150, x: depth_range.clone(), y };
        let legend = [(run.push(), Look::Line(ORANGE))];
        bottom.frame(&mut canvas, &legend, Some("penetration in encoder counts"), &label);
        let full = Format::unsigned(run.words.config.pwm.width).max() as f64;
        // A panel draws points outside it at its edge, so a full scale that no run comes near is left out.
        if spring_range.contains(&full) {
            canvas.line(vec![bottom.at(depth_range.start, full), bottom.at(depth_range.end, full)], INK, 3);
            canvas.text((right, bottom.top - 27), "black line: full scale", 26, INK, Anchor::Right);
        }
        let depths = run.words_of(PENETRATION).map(|(_, word)| word as f64);
        let drawn = if run.push() == SPRING {
            let law = (0..=depth_range.end as i64).map(|depth| (depth as f64, run.spring_at(depth) as f64));
            let law = law.take_while(|(_, counts)| spring_range.contains(counts));
            bottom.steps(&mut canvas, law, ORANGE, 3)
        } else {
            // A method's force depends on what came before, so the path of the run is drawn.
            bottom.curve(&mut canvas, depths.clone().zip(push(run).map(|(_, counts)| counts)), ORANGE, 2)
        };
        if let Some((depth, (_, word))) = depths.last().zip(push(run).last()) {
            let end = bottom.at(depth, word);
            canvas.fill([(end.0 - 10, end.1 - 10), (end.0 + 10, end.1 + 10)], INK);
            let lines: Vec<_> = drawn.windows(2).map(|pair| (pair[0], pair[1])).collect();
            let inside = [left + 4, bottom.top + 4, right - 4, bottom.bottom - 4];
            let around = Surroundings { inside, taken: Vec::new(), dots: &[end], lines: &lines };
            labels::write(&mut canvas, &[Label { at: end, text: "ends here".into(), needed: true }], &around);
        }
    }
    canvas.render("side-by-side")
}
