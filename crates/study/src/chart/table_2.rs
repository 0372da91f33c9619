//! Table 2 of Sevcik et al. 2009 in its own form, and the rms along an axis, as in its Fig. 5.

use hpu_cosim::PASSIVE_RMS_M;
use hpu_cosim::scene::{Direction, Platform};

use crate::reproduce::{Agreement, Class, Table};

use super::canvas::{Anchor, Canvas, GREEN, GRID, INK, QUIET, RED, WIDTH};
use super::log_panel::{color, decades, dotted, legend, level, log_panel};
use super::{Picture, page};

const LEFT: i32 = 190;
const TOP: i32 = 300;
const BOTTOM: i32 = 1240;
const GAP: i32 = 36;

/// The whole table: axes side by side, platforms in each, a row a stiffness.
#[must_use]
pub fn table_2(table: &Table, command: &str) -> Picture {
    let Agreement { legible, same } = Agreement::of(table);
    let title =
        format!("PHANToM drop test, Table 2 of Sevcik et al. 2009: {same} of {legible} legible cells as printed");
    let conditions = format!(
        "passive: rms below 0.003 cm over the last 3 s of 10 s, {}; weight 0.15 N, walls at 2 cm",
        if table.trials == 1 { "in one trial".to_string() } else { format!("in all of {} trials", table.trials) }
    );
    let mut canvas = page(&title, &conditions, command);
    let (axes, platforms) = (table.axes.len() as i32, table.platforms.len() as i32);
    let width = ((WIDTH - 60 - LEFT - (axes - 1) * GAP) / (axes * platforms).max(1)).min(84);
    let height = ((BOTTOM - TOP) / (table.stiffnesses_n_per_m.len() as i32).max(1)).min(60);
    canvas.text((LEFT - 20, TOP - 30), "N/m", 26, INK, Anchor::Right);
    for (row, stiffness) in (0..).zip(&table.stiffnesses_n_per_m) {
        let y = TOP + row * height + height / 2;
        canvas.text((LEFT - 20, y), stiffness.to_string(), 26, INK, Anchor::Right);
    }
    for (group, &axis) in (0..).zip(&table.axes) {
        let left = LEFT + group * (platforms * width + GAP);
        canvas.text((left + platforms * width / 2, TOP - 112), axis.name().to_uppercase(), 40, INK, Anchor::Centre);
        for (column, &platform) in (0..).zip(&table.platforms) {
            let x = left + column * width;
            let (kind, rate) = platform.name().split_once('-').unwrap_or((platform.name(), ""));
            canvas.text((x + width / 2, TOP - 62), kind, 22, QUIET, Anchor::Centre);
            canvas.text((x + width / 2, TOP - 30), rate, 26, INK, Anchor::Centre);
            for (row, &stiffness) in (0..).zip(&table.stiffnesses_n_per_m) {
                let corner = (x, TOP + row * height);
                cell(&mut canvas, [corner, (x + width, corner.1 + height)], table, (axis, platform, stiffness));
            }
        }
    }
    key(&mut canvas);
    canvas.render("table-2")
}

fn cell(
    canvas: &mut Canvas,
    [(left, top), (right, bottom)]: [(i32, i32); 2],
    table: &Table,
    (axis, platform, stiffness): (Direction, Platform, f64),
) {
    let corners = [(left, top), (right, bottom)];
    if let Some(cell) = table.cell(axis, platform, stiffness) {
        shown(canvas, corners, cell.class);
    }
    frame(canvas, corners, GRID, 2);
    match Agreement::at(table, axis, platform, stiffness) {
        Some(true) => canvas.fill([(left + 5, top + 5), (left + 17, top + 17)], GREEN, 1.0),
        Some(false) => frame(canvas, [(left + 4, top + 4), (right - 4, bottom - 4)], RED, 5),
        None => {}
    }
}

/// What the paper shows for a class.
fn shown(canvas: &mut Canvas, [(left, top), (right, bottom)]: [(i32, i32); 2], class: Class) {
    let middle = ((left + right) / 2, (top + bottom) / 2);
    match class {
        Class::Passive => canvas.text(middle, "x", 34, INK, Anchor::Centre),
        Class::NonPassive => canvas.fill([(left, top), (right, bottom)], QUIET, 0.55),
        Class::HighlyUnstable => {}
        Class::Failed => canvas.text(middle, "?", 34, RED, Anchor::Centre),
    }
}

fn frame(
    canvas: &mut Canvas,
    [(left, top), (right, bottom)]: [(i32, i32); 2],
    color: plotters::style::RGBColor,
    width: u32,
) {
    let corners = vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
    canvas.line(corners, color, width);
}

fn key(canvas: &mut Canvas) {
    let y = 1310;
    let square = |x: i32| [(x, y - 24), (x + 60, y + 24)];
    let entries = [
        (Some(Class::Passive), "passive"),
        (Some(Class::NonPassive), "non-passive"),
        (Some(Class::HighlyUnstable), "highly unstable, aborted"),
        (None, "printed, and the same"),
        (None, "printed otherwise"),
    ];
    for ((class, text), x) in entries.into_iter().zip([LEFT, 480, 820, 1330, 1790]) {
        if let Some(class) = class {
            shown(canvas, square(x), class);
        }
        frame(canvas, square(x), GRID, 2);
        match text {
            "printed, and the same" => canvas.fill([(x + 5, y - 19), (x + 17, y - 7)], GREEN, 1.0),
            "printed otherwise" => frame(canvas, [(x + 4, y - 20), (x + 56, y + 20)], RED, 5),
            _ => {}
        }
        canvas.text((x + 76, y), text, 28, INK, Anchor::Left);
    }
    let lost = "Unmarked cells are lost in the text of the paper.";
    canvas.text((LEFT, y + 52), lost, 26, QUIET, Anchor::Left);
}

/// The rms over the stiffness, a curve a platform, along y or along the first axis that the study has.
#[must_use]
pub fn rms(table: &Table, command: &str) -> Picture {
    let axis = table.axes.iter().copied().find(|axis| *axis == Direction::Y).or(table.axes.first().copied());
    let axis = axis.unwrap_or(Direction::Y);
    let title = format!("PHANToM drop test: steady-state rms along {}, as Fig. 5 of Sevcik et al. 2009", axis.name());
    let conditions = "mean over the trials; aborted cells have none; below 0.000001 cm drawn at the foot";
    let mut canvas = page(&title, conditions, command);
    let rms_cm =
        |platform, row| table.cell(axis, platform, row).and_then(|cell| cell.rms_m()).map(|rms_m| 100.0 * rms_m);
    let rows = &table.stiffnesses_n_per_m;
    let all = table.platforms.iter().flat_map(|&platform| rows.iter().filter_map(move |&row| rms_cm(platform, row)));
    let passive_cm = 100.0 * PASSIVE_RMS_M;
    // Below a hundredth of a micrometre there is nothing to be told apart.
    let (low, high) = all.fold((passive_cm, passive_cm), |(low, high), rms| (low.min(rms), high.max(rms)));
    let decade = |value: f64, up: bool| {
        let power = libm::log10(value);
        libm::exp10(if up { (power + 1e-9).ceil() } else { power.floor() })
    };
    let y = decade((0.5 * low).max(1e-6), false)..decade(1.2 * high, true);
    let (first, last) = (rows.first().copied().unwrap_or(1.0), rows.last().copied().unwrap_or(10.0));
    let panel = log_panel([(210, 230), (WIDTH - 420, 1270)], 0.8 * first..1.25 * last, y);
    decades(&panel, &mut canvas);
    let mut free = panel.left;
    for &row in rows {
        let (x, _) = panel.at(libm::log10(row), panel.y.start);
        canvas.line(vec![(x, panel.top), (x, panel.bottom)], GRID, 2);
        if x >= free {
            canvas.text((x, panel.bottom + 26), row.to_string(), 26, QUIET, Anchor::Centre);
            free = x + 110;
        }
    }
    canvas.text(
        ((panel.left + panel.right) / 2, panel.bottom + 66),
        "stiffness of the wall in N/m",
        26,
        INK,
        Anchor::Centre,
    );
    canvas.text((panel.left, panel.top - 30), "rms in cm", 28, INK, Anchor::Left);
    level(&panel, &mut canvas, passive_cm, "", RED, 3);
    let (_, y) = panel.at(panel.x.start, libm::log10(passive_cm));
    canvas.text((panel.right + 20, y), "0.003 cm: passive below", 26, RED, Anchor::Left);
    for &platform in &table.platforms {
        let points: Vec<_> = rows
            .iter()
            .map(|&row| rms_cm(platform, row).map(|rms| (libm::log10(row), libm::log10(rms.max(1e-9)))))
            .collect();
        dotted(&panel, &mut canvas, &points, color(platform));
    }
    legend(&mut canvas, &table.platforms, (panel.right + 60, if y < 700 { y + 90 } else { 250 }));
    canvas.render("rms")
}
