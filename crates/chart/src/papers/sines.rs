//! The picture of the sources of sine: their errors against the bits of their ROM.

use hpu_papers::phantom::DEVICE;
use hpu_study::phantom::sines::{Sine, Source};

use crate::drawing::canvas::{Anchor, Canvas, GRID, INK, QUIET, WIDTH};
use crate::drawing::log_panel::{dotted, level, log_panel};
use crate::drawing::panel::Panel;
use crate::drawing::series::{BLUE, GREEN, Look, ORANGE, PURPLE, Style, entry};
use crate::{Picture, page};

/// Horizontal position, in bits, of a source without a ROM.
const NO_ROM_BITS: f64 = 100.0;

fn style(source: Source) -> Style {
    match source {
        Source::Table => BLUE,
        Source::Quarter => ORANGE,
        Source::Interpolated => GREEN,
        Source::Cordic => PURPLE,
    }
}

/// Returns a picture with a curve for each source and a dot for each size; the default sizes are framed.
pub fn sines(all: &[Sine], command: &str) -> Picture {
    let angles = all.first().map_or(0, |sine| sine.angles);
    let title = format!("{DEVICE}: four sources of sine, error against ROM");
    let conditions =
        format!("worst of sine and cosine over all {angles} angles that the joints' tables hold; framed: default");
    let mut canvas = page(&title, &conditions, command);
    let worst = all.iter().map(|sine| sine.worst);
    let (low, high) = worst.fold((f64::INFINITY, 0f64), |(low, high), worst| (low.min(worst), high.max(worst)));
    let decade = |value: f64, up: bool| libm::exp10(if up { libm::ceil(value) } else { libm::floor(value) });
    let y = decade(libm::log10(low), false)..decade(libm::log10(high), true);
    let panel = log_panel([(210, 240), (WIDTH - 620, 1260)], 60.0..1e6, y);
    for power in panel.y.start as i32..=panel.y.end as i32 {
        level(&panel, &mut canvas, libm::exp10(f64::from(power)), &format!("1e{power}"), GRID, 2);
    }
    across(&panel, &mut canvas);
    let lsb = libm::exp2(-22.0);
    level(&panel, &mut canvas, lsb, "", QUIET, 3);
    let (_, place) = panel.at(panel.x.start, libm::log10(lsb));
    canvas.text((panel.right + 20, place), "one LSB of (1,9,22)", 26, QUIET, Anchor::Left);
    for (index, source) in (0..).zip(Source::ALL) {
        let own = || all.iter().filter(move |sine| sine.source == source);
        let point = |sine: &Sine| {
            let bits = if sine.rom.words == 0 { NO_ROM_BITS } else { sine.rom.bits() as f64 };
            (libm::log10(bits), libm::log10(sine.worst))
        };
        let points: Vec<_> = own().map(|sine| Some(point(sine))).collect();
        dotted(&panel, &mut canvas, &points, style(source));
        for sine in own().filter(|sine| sine.default) {
            let (x, y) = point(sine);
            let (x, y) = panel.at(x, y);
            canvas.line(
                vec![(x - 16, y - 16), (x + 16, y - 16), (x + 16, y + 16), (x - 16, y + 16), (x - 16, y - 16)],
                INK,
                3,
            );
        }
        let (x, y) = (panel.right + 40, panel.top + 30 + 92 * index);
        entry(&mut canvas, (x, y), (source.name(), Look::Line(style(source))), 28);
        let default = own().find(|sine| sine.default).map_or(String::new(), |sine| sine.size.clone());
        canvas.text((x + 70, y + 36), format!("default: {default}"), 22, QUIET, Anchor::Left);
    }
    canvas.render("sines")
}

fn across(panel: &Panel, canvas: &mut Canvas) {
    let (foot, head) = (panel.bottom, panel.top);
    for (bits, label) in
        [(NO_ROM_BITS, "no ROM"), (1e3, "1 000"), (1e4, "10 000"), (1e5, "100 000"), (1e6, "1 000 000")]
    {
        let (x, _) = panel.at(libm::log10(bits), panel.y.start);
        canvas.line(vec![(x, head), (x, foot)], GRID, 2);
        canvas.text((x, foot + 28), label, 26, QUIET, Anchor::Centre);
    }
    canvas.text(((panel.left + panel.right) / 2, foot + 72), "bits of ROM", 26, INK, Anchor::Centre);
    panel.y_name(canvas, "worst error of sine and cosine, of 1");
}
