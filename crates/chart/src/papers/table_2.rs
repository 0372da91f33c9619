//! Pictures of Table 2 of Sevcik et al. 2009 in its own form, and of the rms along an axis, as in the paper's Fig. 5.

use hpu_cosim::PASSIVE_RMS_M;
use hpu_cosim::scene::{Direction, Platform};
use plotters::style::{RGBColor, WHITE};

use hpu_papers::phantom::{Agreement, Cell, Class, DEVICE, Share, Tables, Tally};

use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, WIDTH, text_width};
use crate::drawing::log_panel::{decades, legend, level, log_panel, style, through};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLANK, MAROON, ORANGE, SHADE, SKY, mark};
use crate::{Picture, page};

const LEFT: i32 = 190;
const TOP: i32 = 300;
const BOTTOM: i32 = 1240;
const GAP: i32 = 36;

/// Returns the picture of the whole table: the axes side by side, the platforms in each, a row for each stiffness.
pub fn table_2(tables: &Tables, command: &str) -> Picture {
    let table = tables.first();
    let Agreement { legible, same, mixed } = Agreement::of(tables);
    let some = if mixed > 0 { format!(", {mixed} at some seeds") } else { String::new() };
    let title =
        format!("{DEVICE} drop test, Table 2 of Sevcik et al. 2009: {legible} legible cells, {same} as printed{some}");
    let conditions = format!(
        "{}; passive: rms below 0.003 cm over the last 3 s of 10 s, {}; weight 0.15 N, walls at 2 cm",
        tables.drawn(),
        if table.trials == 1 { "in one trial".to_string() } else { format!("in all of {} trials", table.trials) }
    );
    let mut canvas = page(&title, &conditions, command);
    let (axes, platforms) = (table.axes.len() as i32, table.platforms.len() as i32);
    let width = ((WIDTH - 60 - LEFT - (axes - 1) * GAP) / (axes * platforms).max(1)).min(84);
    let height = ((BOTTOM - TOP) / (table.stiffnesses_n_per_m.len() as i32).max(1)).min(60);
    canvas.text((LEFT - 20, TOP - 30), "kHz", 26, INK, Anchor::Right);
    canvas.text((44, (TOP + BOTTOM) / 2), "stiffness of the wall in N/m", 26, INK, Anchor::Up);
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
                cell(&mut canvas, [corner, (x + width, corner.1 + height)], tables, (axis, platform, stiffness));
            }
        }
    }
    key(&mut canvas, tables);
    canvas.render("table-2")
}

fn cell(
    canvas: &mut Canvas,
    corners: [(i32, i32); 2],
    tables: &Tables,
    (axis, platform, stiffness): (Direction, Platform, f64),
) {
    let legible = Agreement::at(tables, axis, platform, stiffness);
    if let Some(tally) = tables.cell(axis, platform, stiffness) {
        shown(canvas, corners, &tally, legible);
    }
    frame(canvas, corners, GRID, 2);
}

const fn fill(class: Class) -> RGBColor {
    match class {
        Class::Passive => SKY,
        Class::NonPassive => ORANGE.color,
        Class::HighlyUnstable => MAROON.color,
        Class::Failed => BLANK,
    }
}

/// Draws a cell: its class, or the number of seeds with each class, and whether it is as printed. A cell that is lost
/// in the print is small. A cell that is printed otherwise is framed.
fn shown(canvas: &mut Canvas, corners: [(i32, i32); 2], tally: &Tally, legible: Option<Share>) {
    let [(left, top), (right, bottom)] = corners;
    let (aside, over) = if legible.is_none() { ((right - left) / 4, (bottom - top) / 6) } else { (0, 0) };
    let Some(class) = tally.class() else {
        return mixed(canvas, [(left + aside, top), (right - aside, bottom - over)], tally);
    };
    let (text, ink) = match class {
        Class::Passive => ("x", INK),
        Class::NonPassive => ("", INK),
        Class::HighlyUnstable => ("", WHITE),
        Class::Failed => ("?", INK),
    };
    canvas.fill([(left + aside, top + over), (right - aside, bottom - over)], fill(class));
    // The letter that the paper uses.
    canvas.text(((left + right) / 2, (top + bottom) / 2 + 5), text, 30, ink, Anchor::Centre);
    match legible {
        Some(same) if same.all() => {
            canvas.line(vec![(left + 6, bottom - 18), (left + 12, bottom - 9), (left + 25, top + 14)], ink, 5);
        }
        Some(_) => {
            frame(canvas, [(left + 5, top + 5), (right - 5, bottom - 5)], INK, 8);
            frame(canvas, [(left + 5, top + 5), (right - 5, bottom - 5)], WHITE, 2);
        }
        None => {}
    }
}

/// Draws a cell whose seeds differ: the number of seeds at which it is passive, above a bar with each class's share.
fn mixed(canvas: &mut Canvas, [(left, top), (right, bottom)]: [(i32, i32); 2], tally: &Tally) {
    let Share { so, of } = tally.share(Class::Passive);
    let bar = bottom - (bottom - top) / 3;
    canvas.text(((left + right) / 2, (top + bar) / 2 + 4), format!("{so}/{of}"), 24, INK, Anchor::Centre);
    let mut before = 0;
    let x = |seeds: usize| left + (right - left) * seeds as i32 / of as i32;
    for class in [Class::Passive, Class::NonPassive, Class::HighlyUnstable, Class::Failed] {
        let seeds = tally.share(class).so;
        if seeds > 0 {
            canvas.fill([(x(before), bar), (x(before + seeds), bottom)], fill(class));
        }
        before += seeds;
    }
}

fn frame(canvas: &mut Canvas, [(left, top), (right, bottom)]: [(i32, i32); 2], color: RGBColor, width: u32) {
    let corners = vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
    canvas.line(corners, color, width);
}

/// Draws the key: what the fills stand for, and how a legible cell of the paper differs from a lost one.
fn key(canvas: &mut Canvas, tables: &Tables) {
    let mut x = 60;
    let y = 1300;
    let mut say = |canvas: &mut Canvas, classes: &[Class], legible, text: &str| {
        shown(canvas, [(x, y - 26), (x + 84, y + 26)], &Tally { classes: classes.to_vec() }, legible);
        frame(canvas, [(x, y - 26), (x + 84, y + 26)], GRID, 2);
        canvas.text((x + 98, y), text, 26, INK, Anchor::Left);
        x += 98 + text_width(text, 26) + 40;
    };
    let fills = [("passive", Class::Passive), ("non-passive", Class::NonPassive), ("aborted", Class::HighlyUnstable)];
    for (text, class) in fills {
        canvas.declare(text, fill(class), None);
        say(canvas, &[class], None, text);
    }
    let printed = |so| Some(Share { so, of: 1 });
    say(canvas, &[Class::Passive], printed(1), "full cell: legible, and as here");
    say(canvas, &[Class::Passive], printed(0), "printed otherwise");
    let seeds = tables.each().len();
    if seeds > 1 {
        let passive = seeds * 7 / 12;
        let classes = [vec![Class::Passive; passive], vec![Class::NonPassive; seeds - passive]].concat();
        say(canvas, &classes, None, &format!("mixed: passive in {passive} of {seeds} seeds"));
    }
    let lost = "small: lost in the text of the paper, so nothing is compared; of legible cells the text has only the \
                \u{201c}x\u{201d}, not which others were aborted; mixed cells have no tick";
    canvas.text((60, y + 58), lost, 24, QUIET, Anchor::Left);
}

/// Height of the bands for aborted cells and for cells at rest, in pixels.
const BAND: i32 = 150;

/// Returns the picture of the rms over the stiffness at the first seed: a curve for each platform, along y or along the
/// first axis that the study has.
pub fn rms(tables: &Tables, command: &str) -> Picture {
    let table = tables.first();
    let axis = table.axes.iter().copied().find(|axis| *axis == Direction::Y).or(table.axes.first().copied());
    let axis = axis.unwrap_or(Direction::Y);
    let title = format!("{DEVICE} drop test: steady-state rms along {}, as Fig. 5 of Sevcik et al. 2009", axis.name());
    let conditions = format!(
        "one draw, seed {}: the worst of its trials, so that below the line all are passive; aborted cells have no rms",
        table.seed
    );
    let mut canvas = page(&title, &conditions, command);
    let cell = |platform, row| table.cell(axis, platform, row);
    let rms_cm = |platform, row| cell(platform, row).and_then(Cell::worst_rms_m).map(|rms_m| 100.0 * rms_m);
    let rows = &table.stiffnesses_n_per_m;
    let all = table.platforms.iter().flat_map(|&platform| rows.iter().filter_map(move |&row| rms_cm(platform, row)));
    let passive_cm = 100.0 * PASSIVE_RMS_M;
    let (low, high) = all.fold((passive_cm, passive_cm), |(low, high), rms| (low.min(rms), high.max(rms)));
    let decade = |value: f64, up: bool| {
        let power = libm::log10(value);
        libm::exp10(if up { (power + 1e-9).ceil() } else { power.floor() })
    };
    let y = decade(low.max(FOOT_CM), false)..decade(1.2 * high, true);
    let (first, last) = (rows.first().copied().unwrap_or(1.0), rows.last().copied().unwrap_or(10.0));
    let panel = log_panel([(250, 200 + BAND), (WIDTH - 420, 1270 - BAND)], 0.8 * first..1.25 * last, y);
    axes(&panel, &mut canvas, rows);
    level(&panel, &mut canvas, passive_cm, "", INK, 4);
    let (_, y) = panel.at(panel.x.start, libm::log10(passive_cm));
    canvas.text((panel.right + 20, y), "0.003 cm: passive below", 26, INK, Anchor::Left);
    let count = table.platforms.len() as i32;
    for (place, &platform) in (0..).zip(&table.platforms) {
        // In a band each platform has a line of its own, so that platforms with the same values are all visible.
        let lane = |top: i32| top + (2 * place + 1) * BAND / (2 * count);
        let pixel = |row: f64| {
            let rms = rms_cm(platform, row)?;
            let (x, y) = panel.at(libm::log10(row), libm::log10(rms.max(FOOT_CM)));
            Some((x, if rms < FOOT_CM { lane(panel.bottom) } else { y }))
        };
        through(&mut canvas, &rows.iter().map(|&row| pixel(row)).collect::<Vec<_>>(), style(platform));
        for &row in rows {
            if cell(platform, row).is_some_and(|cell| cell.class == Class::HighlyUnstable) {
                let (x, _) = panel.at(libm::log10(row), panel.y.start);
                mark(&mut canvas, (x, lane(panel.top - BAND)), style(platform), 8);
            }
        }
    }
    legend(&mut canvas, &table.platforms, (panel.right + 60, if y < 700 { y + 90 } else { 250 }));
    canvas.render("rms")
}

/// A micrometre, in cm; smaller rms values are not distinguished.
const FOOT_CM: f64 = 1e-4;

/// Draws grid, ticks and names, with the band of aborted cells above.
fn axes(panel: &Panel, canvas: &mut Canvas, rows: &[f64]) {
    let head = panel.top - BAND;
    let foot = panel.bottom + BAND;
    for (top, name) in [(head, "aborted"), (panel.bottom, "less")] {
        canvas.fill([(panel.left, top), (panel.right, top + BAND)], SHADE);
        canvas.text((panel.left - 14, top + BAND / 2), name, 26, INK, Anchor::Right);
    }
    decades(panel, canvas);
    let mut free = panel.left;
    for &row in rows {
        let (x, _) = panel.at(libm::log10(row), panel.y.start);
        canvas.line(vec![(x, head), (x, foot)], GRID, 2);
        if x >= free {
            canvas.text((x, foot + 26), row.to_string(), 26, QUIET, Anchor::Centre);
            free = x + 110;
        }
    }
    let middle = (panel.left + panel.right) / 2;
    canvas.text((middle, foot + 66), "stiffness of the wall in N/m", 26, INK, Anchor::Centre);
    panel.y_name(canvas, "rms in cm");
}
