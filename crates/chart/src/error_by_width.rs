//! The picture of what each bit of a loop is worth: the error of the outputs against the width, with a line for each
//! width.

use hpu_study::widths::Field;
use hpu_study::widths::search::{Found, Line};

use crate::drawing::canvas::{Anchor, Canvas, GRID, HEIGHT, INK, QUIET, WIDTH};
use crate::drawing::log_panel::through;
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLACK, BLUE, GREEN, LILAC, Look, ORANGE, PURPLE, RUST, SHADE, Style, entry};
use crate::stiffness_by_cost::widths;
use crate::{Picture, page};

const LEFT: i32 = 190;
const RIGHT: i32 = WIDTH - 90;
const TOP: i32 = 300;
const BOTTOM: i32 = HEIGHT - 160;
/// Height of the bands for errors that have no logarithm, in pixels.
const BAND: i32 = 120;

fn style(width: Field) -> Style {
    let styles = [
        (Field::POSITION, BLUE),
        (Field::STIFFNESS_INT, RUST),
        (Field::STIFFNESS_FRAC, ORANGE),
        (Field::DAMPING_INT, LILAC),
        (Field::DAMPING_FRAC, PURPLE),
        (Field::VELOCITY, GREEN),
    ];
    styles.into_iter().find(|(field, _)| *field == width).map_or(BLACK, |(_, style)| style)
}

/// Returns the picture of a search's errors: bits across, error up. All other widths are those of the reference.
pub fn error_by_width(scene: &str, found: &Found, command: &str) -> Picture {
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name().replace('_', " ")).collect();
    let conditions = format!(
        "the worst of {}, against {}; one width varied at a time",
        outputs.join(", "),
        widths(&found.reference)
    );
    let mut canvas = page(&format!("{scene}: error against width"), &conditions, command);
    let all = || found.lines.iter().flat_map(|line| &line.errors);
    let (least, most) =
        all().fold((i32::MAX, i32::MIN), |(least, most), (bits, _)| (least.min(*bits), most.max(*bits)));
    let finite = all().filter_map(|(_, error)| error.filter(|error| *error > 0.0 && error.is_finite()));
    let (low, high) = finite.fold((0.01f64, 0.01f64), |(low, high), error| (low.min(error), high.max(error)));
    let panel = Panel {
        left: LEFT,
        top: TOP + BAND,
        right: RIGHT,
        bottom: BOTTOM - BAND,
        x: f64::from(least) - 0.5..f64::from(most) + 0.5,
        y: libm::log10(low).floor()..libm::log10(high).ceil().max(0.0),
    };
    frame(&mut canvas, &panel, least..=most);
    // Lines that coincide are drawn a few pixels apart.
    let count = found.lines.len() as i32;
    let mut legend = LEFT;
    for (index, line) in found.lines.iter().enumerate() {
        let aside = 6 * (2 * index as i32 - count + 1);
        draw(&mut canvas, &panel, line, (aside, 4 * (2 * index as i32 - count + 1)));
        legend = entry(&mut canvas, (legend, 210), (line.key.name, Look::Line(style(line.key.field))), 24);
    }
    canvas.render("error-by-width")
}

fn frame(canvas: &mut Canvas, panel: &Panel, bits: std::ops::RangeInclusive<i32>) {
    canvas.fill([(LEFT, panel.bottom), (RIGHT, BOTTOM)], SHADE);
    canvas.fill([(LEFT, TOP), (RIGHT, panel.top)], SHADE);
    for decade in panel.y.start as i32..=panel.y.end as i32 {
        let (_, y) = panel.at(panel.x.start, f64::from(decade));
        canvas.line(vec![(LEFT, y), (RIGHT, y)], GRID, 2);
        let percent = libm::exp10(f64::from(decade + 2));
        canvas.text((LEFT - 14, y), percent.to_string(), 26, QUIET, Anchor::Right);
    }
    for bits in bits {
        let (x, _) = panel.at(f64::from(bits), panel.y.start);
        canvas.line(vec![(x, TOP), (x, BOTTOM)], GRID, 2);
        canvas.text((x, BOTTOM + 28), bits.to_string(), 26, QUIET, Anchor::Centre);
    }
    canvas.text((LEFT + 16, BOTTOM - 16), "0: the same outputs to the last digit", 24, INK, Anchor::Left);
    canvas.text((LEFT + 16, TOP + 16), "another verdict", 24, INK, Anchor::Left);
    panel.y_name(canvas, "error in % of the reference's output");
    canvas.text(((LEFT + RIGHT) / 2, BOTTOM + 70), "bits of the width that is varied", 26, INK, Anchor::Centre);
}

fn draw(canvas: &mut Canvas, panel: &Panel, Line { key, errors }: &Line, (aside, lane): (i32, i32)) {
    let style = style(key.field);
    let place = |(bits, error): &(i32, Option<f64>)| {
        let error = (*error)?;
        let (x, y) = panel.at(f64::from(*bits), if error > 0.0 { libm::log10(error) } else { 0.0 });
        let y = match error {
            0.0 => BOTTOM - BAND / 2 + lane,
            error if error.is_finite() => y,
            _ => TOP + BAND / 2 + lane,
        };
        Some((x + aside, y))
    };
    let pixels: Vec<_> = errors.iter().map(place).collect();
    through(canvas, &pixels, style);
}
