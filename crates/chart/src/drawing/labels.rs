//! Names beside points, placed so that they cover neither each other nor other points.

use crate::drawing::canvas::{Anchor, Canvas, INK, QUIET, text_width};

/// Height of a label's text, in pixels.
pub(crate) const SIZE: i32 = 24;

type Pixel = (i32, i32);

/// A box: left, top, right, bottom.
pub(crate) type Area = [i32; 4];

/// A point to be named.
pub(crate) struct Label {
    pub at: Pixel,
    pub text: String,
    /// Whether the label is written even where there is no room.
    pub needed: bool,
}

/// The boxes, points and lines that labels keep clear of.
pub(crate) struct Surroundings<'a> {
    /// The box in which labels may be placed.
    pub inside: Area,
    /// Boxes of texts that are already there.
    pub taken: Vec<Area>,
    pub dots: &'a [Pixel],
    pub lines: &'a [(Pixel, Pixel)],
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn around((x, y): Pixel, half: (i32, i32)) -> Area {
    [x - half.0, y - half.1, x + half.0, y + half.1]
}

/// Whether a line passes through a box, tested at points a few pixels apart.
fn crosses((from, to): &(Pixel, Pixel), area: &Area) -> bool {
    let steps = ((to.0 - from.0).abs().max((to.1 - from.1).abs()) / 6).max(1);
    (0..=steps).any(|step| {
        let at = |a: i32, b: i32| a + (b - a) * step / steps;
        overlap(&around((at(from.0, to.0), at(from.1, to.1)), (2, 2)), area)
    })
}

/// Returns places for a text of some width: the middle of its box relative to the point, the nearest first.
fn places(width: i32) -> impl Iterator<Item = Pixel> {
    const RINGS: [i32; 7] = [0, 1, 2, 3, 4, 6, 8];
    let half = width / 2 + 28;
    RINGS.into_iter().flat_map(move |ring| {
        let out = 34 * ring;
        [
            (half + out / 2, -out),
            (-half - out / 2, -out),
            (0, -34 - out),
            (0, 36 + out),
            (half + out / 2, out),
            (-half - out / 2, out),
            (half - 12, -26 - out),
            (-half + 12, -26 - out),
            (half - 12, 28 + out),
            (-half + 12, 28 + out),
        ]
    })
}

/// Writes the labels; earlier labels take precedence.
pub(crate) fn write(canvas: &mut Canvas, labels: &[Label], surroundings: &Surroundings) {
    let mut taken = surroundings.taken.clone();
    for Label { at, text, needed } in labels {
        let half = (text_width(text, SIZE) / 2, SIZE / 2 + 2);
        let [left, top, right, bottom] = surroundings.inside;
        let cost = |&(dx, dy): &Pixel| {
            let middle = (at.0 + dx, at.1 + dy);
            let area = around(middle, half);
            if area[0] < left || area[1] < top || area[2] > right || area[3] > bottom {
                return i32::MAX;
            }
            let labels = taken.iter().filter(|other| overlap(other, &area)).count() as i32;
            let dots = surroundings.dots.iter().filter(|dot| overlap(&around(**dot, (13, 13)), &area)).count() as i32;
            let lines = surroundings.lines.iter().filter(|line| crosses(line, &area)).count() as i32;
            20_000 * labels + 2_000 * dots + 90 * lines + dx.abs() / 4 + 2 * dy.abs()
        };
        let Some(place) = places(2 * half.0).min_by_key(cost) else { continue };
        let cost = cost(&place);
        // A label that covers another one is worse than no label.
        if cost >= 20_000 || (cost >= 2_000 && !needed) || cost == i32::MAX {
            continue;
        }
        let middle = (at.0 + place.0, at.1 + place.1);
        if place.1.abs() > 40 {
            let end = if place.1 > 0 { middle.1 - half.1 } else { middle.1 + half.1 };
            canvas.line(vec![*at, (at.0.clamp(middle.0 - half.0, middle.0 + half.0), end)], QUIET, 1);
        }
        canvas.text(middle, text.as_str(), SIZE, INK, Anchor::Centre);
        taken.push(around(middle, (half.0 + 6, half.1)));
    }
}
