//! Runs side by side, each a column, all on the same scales.

use hpu_signal::Format;

use super::canvas::{Anchor, BLUE, HEIGHT, INK, ORANGE, QUIET, RED, WALL, WIDTH};
use super::motion::{ANGLE, angle_label, wall};
use super::panel::{Panel, around};
use super::words::{PENETRATION, SPRING};
use super::{Picture, Run, outcome, page};

/// Runs in one picture: angle and spring word over time, and the spring word over the penetration it is made of.
///
/// # Panics
///
/// Without a run.
#[must_use]
pub fn side_by_side(title: &str, runs: &[Run], command: &str) -> Picture {
    let names: Vec<&str> = runs.iter().map(|run| run.scene.name.as_str()).collect();
    let mut canvas = page(title, &names.join(" and "), command);
    let angles = runs.iter().flat_map(|run| run.trace.angles_rad().iter().copied());
    let walls = runs.iter().map(|run| run.words.realised.wall_position_rad);
    let angle_range = around(angles.chain(walls), 0.08);
    let words = |net: usize| runs.iter().flat_map(move |run| run.words_of(net).map(|(_, word)| word as f64));
    let spring_range = around(words(SPRING).chain([0.0]), 0.08);
    let depth_range = around(words(PENETRATION).chain([0.0]), 0.0);

    let width = (WIDTH - 100) / runs.len() as i32;
    for (index, run) in runs.iter().enumerate() {
        let (left, right) = (170 + index as i32 * width, 50 + (index as i32 + 1) * width);
        // What tells the runs apart: the product's overflow where it differs, else the scene.
        let name = match runs.iter().all(|other| other.scene.method.saturate == run.scene.method.saturate) {
            true => run.scene.name.as_str(),
            false if run.scene.method.saturate => "product saturates",
            false => "product drops its upper bits",
        };
        canvas.text((left, 190), format!("{name}: {}", outcome(run)), 32, INK, Anchor::Left);
        let x = 0.0..run.summary.motion_s;

        let top = Panel { left, top: 280, right, bottom: 560, x: x.clone(), y: angle_range.clone() };
        wall(run, &top, &mut canvas);
        top.frame(&mut canvas, &[(angle_label(run).as_str(), BLUE), ("wall", WALL)], None);
        top.curve(&mut canvas, run.reals_of(ANGLE, 1.0), BLUE, 4);

        let middle = Panel { left, top: 640, right, bottom: 900, x, y: spring_range.clone() };
        let overflowed = run.overflowed(SPRING);
        middle.shade(&mut canvas, run.trace.times_s().iter().copied().zip(overflowed), RED, 0.22);
        let legend = [("spring in PWM counts", ORANGE), ("overflowed", RED)];
        middle.frame(&mut canvas, &legend, Some("time in s"));
        middle.steps(&mut canvas, run.words_of(SPRING).map(|(t, word)| (t, word as f64)), ORANGE, 3);

        let y = spring_range.clone();
        let bottom = Panel { left, top: 1050, right, bottom: HEIGHT - 150, x: depth_range.clone(), y };
        bottom.frame(&mut canvas, &[("spring over penetration", ORANGE)], Some("penetration in encoder counts"));
        let full = Format::unsigned(run.words.config.pwm.width).max() as f64;
        canvas.line(vec![bottom.at(depth_range.start, full), bottom.at(depth_range.end, full)], QUIET, 3);
        canvas.text((right, bottom.top - 27), "line: full scale", 26, QUIET, Anchor::Right);
        let law = (0..=depth_range.end as i64).map(|depth| (depth as f64, run.spring_at(depth) as f64));
        bottom.steps(&mut canvas, law, ORANGE, 3);
        if let Some((depth, word)) = run.trace.words(PENETRATION).last().zip(run.trace.words(SPRING).last()) {
            let (x, y) = bottom.at(*depth as f64, *word as f64);
            canvas.fill([(x - 10, y - 10), (x + 10, y + 10)], INK, 1.0);
            let (to, anchor) = if 2 * x < left + right { (x + 22, Anchor::Left) } else { (x - 22, Anchor::Right) };
            let above = if y - 40 > bottom.top { y - 26 } else { y + 34 };
            canvas.text((to, above), "ends here", 26, INK, anchor);
        }
    }
    canvas.render("side-by-side")
}
