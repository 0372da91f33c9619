//! The picture of what a fit tried: the error of each model against its speed.

use hpu_study::fit::{Fit, percent};

use crate::drawing::canvas::{Anchor, HEIGHT, INK, WIDTH};
use crate::drawing::log_panel::{decades, log_panel};
use crate::drawing::series::{BLUE, LILAC, Look, ORANGE, SHADE, entry, mark};
use crate::{Picture, page};

/// The least error that has a place of its own, in percent; smaller ones stand at the foot.
const LEAST: f64 = 1e-4;
/// The greatest error that has a place of its own, in percent; greater ones and other verdicts stand at the top.
const MOST: f64 = 1e3;

/// Returns the picture of the models that a fit ran: speed across, the worst error of a judged output up.
pub fn fit(scene: &str, found: &Fit, command: &str) -> Picture {
    let model = match &found.set[..] {
        [] => "as written".to_string(),
        set => set
            .iter()
            .map(|(key, value)| format!("{}={value}", key.trim_start_matches("model.")))
            .collect::<Vec<_>>()
            .join(" "),
    };
    let half = percent(found.within / 2.0);
    let conditions = format!("the least model within {}: {model}", percent(found.within));
    let mut canvas = page(&format!("{scene}: models that were tried"), &conditions, command);
    let speeds = || found.models.iter().map(|tried| tried.speedup);
    let (slow, fast) = speeds().fold((0.5f64, 2.0f64), |(slow, fast), speed| (slow.min(speed), fast.max(speed)));
    let decade = |speed: f64| libm::exp10(speed);
    let across = decade(libm::log10(slow).floor())..decade(libm::log10(fast).ceil());
    let panel = log_panel([(230, 260), (WIDTH - 110, HEIGHT - 190)], across, LEAST..MOST);
    let tolerance = panel.at(panel.x.start, libm::log10(50.0 * found.within));
    canvas.fill([(panel.left, panel.top), (panel.right, tolerance.1)], SHADE);
    decades(&panel, &mut canvas);
    for power in panel.x.start.round() as i32..=panel.x.end.round() as i32 {
        let (x, _) = panel.at(f64::from(power), panel.y.start);
        canvas.text((x, panel.bottom + 28), libm::exp10(f64::from(power)).to_string(), 26, INK, Anchor::Centre);
    }
    canvas.text(
        (panel.left + 14, panel.top + 22),
        format!("beyond half of the tolerance, {half}"),
        24,
        INK,
        Anchor::Left,
    );
    let middle = (panel.left + panel.right) / 2;
    canvas.text((middle, panel.bottom + 70), "times as fast as the scene as written", 26, INK, Anchor::Centre);
    panel.y_name(&mut canvas, "worst error of a judged output in %");
    canvas.panel();
    let mut x = panel.left;
    for (name, style) in [("tried", BLUE), ("another verdict", LILAC), ("the least model", ORANGE)] {
        x = entry(&mut canvas, (x, panel.top - 34), (name, Look::Points(style)), 28);
    }
    // The least model is drawn above the others.
    let mut models: Vec<_> = found.models.iter().collect();
    models.sort_by_key(|tried| tried.chosen);
    for tried in models {
        let error = (100.0 * tried.error).clamp(LEAST, MOST);
        let style = match tried {
            tried if tried.chosen => ORANGE,
            tried if tried.error.is_finite() => BLUE,
            _ => LILAC,
        };
        let reach = if tried.chosen { 14 } else { 8 };
        mark(&mut canvas, panel.at(libm::log10(tried.speedup), libm::log10(error)), style, reach);
    }
    canvas.render("fit")
}
