//! The looks of series: colours that can be distinguished with every kind of colour blindness, each with its own
//! marker.
//!
//! With protanopia, deuteranopia, tritanopia and normal sight, any two of these colours that share a picture are at
//! least 15 apart by CIEDE2000. Each line has a contrast of 3 to 1 against white. Texts never have these colours.

use plotters::style::RGBColor;

use crate::Marker;
use crate::drawing::canvas::{Anchor, Canvas, INK, text_width};

/// A colour with its marker; two lines of a panel differ in both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Style {
    pub color: RGBColor,
    pub marker: Marker,
}

const fn style(r: u8, g: u8, b: u8, marker: Marker) -> Style {
    Style { color: RGBColor(r, g, b), marker }
}

pub(crate) const BLACK: Style = Style { color: INK, marker: Marker::Disc };
pub(crate) const BLUE: Style = style(40, 35, 255, Marker::Square);
pub(crate) const ORANGE: Style = style(217, 115, 5, Marker::Triangle);
pub(crate) const GREEN: Style = style(65, 165, 132, Marker::Diamond);
pub(crate) const PURPLE: Style = style(78, 0, 124, Marker::Down);
pub(crate) const LILAC: Style = style(147, 134, 247, Marker::Ring);
pub(crate) const RUST: Style = style(168, 58, 15, Marker::Cross);
pub(crate) const TAUPE: Style = style(102, 92, 89, Marker::Plus);
pub(crate) const MAROON: Style = style(84, 14, 0, Marker::Hourglass);

/// Colours of areas behind lines, light enough for dark text.
pub(crate) const SKY: RGBColor = RGBColor(185, 211, 255);
pub(crate) const SAND: RGBColor = RGBColor(247, 205, 128);
/// Colour of the wall, and of contact with it.
pub(crate) const SHADE: RGBColor = RGBColor(233, 228, 220);
/// Colour of a map's cells that did not reach the wall.
pub(crate) const MAUVE: RGBColor = RGBColor(146, 131, 160);
/// Colour of runs that are too short to tell.
pub(crate) const MINT: RGBColor = RGBColor(196, 230, 195);
/// Colour of a map's cells whose hand moves nearly to the end.
pub(crate) const ROSE: RGBColor = RGBColor(240, 190, 205);
/// Colour of cells of which nothing is known.
pub(crate) const BLANK: RGBColor = RGBColor(217, 217, 217);

/// The way in which a key shows a series.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Look {
    /// A line with markers.
    Line(Style),
    /// Markers without a line.
    Points(Style),
    /// An area, or a line as wide as an area.
    Area(RGBColor),
    /// A mark in the corner of an area.
    Corner(RGBColor),
}

impl Look {
    pub fn color(self) -> RGBColor {
        match self {
            Self::Line(style) | Self::Points(style) => style.color,
            Self::Area(color) | Self::Corner(color) => color,
        }
    }

    pub fn marker(self) -> Option<Marker> {
        match self {
            Self::Line(style) | Self::Points(style) => Some(style.marker),
            Self::Area(_) | Self::Corner(_) => None,
        }
    }
}

/// Draws a marker with its middle at a pixel; it reaches `reach` pixels to each side.
pub(crate) fn mark(canvas: &mut Canvas, (x, y): (i32, i32), Style { color, marker }: Style, reach: i32) {
    let thick = (reach / 3).max(2);
    let corners = |of: &[(i32, i32)]| of.iter().map(|(dx, dy)| (x + dx, y + dy)).collect::<Vec<_>>();
    let r = reach;
    match marker {
        Marker::Disc => canvas.dot((x, y), r, color, 0),
        Marker::Ring => {
            canvas.dot((x, y), r, color, 0);
            canvas.dot((x, y), r - thick, RGBColor(255, 255, 255), 0);
        }
        Marker::Square => canvas.fill([(x - r + 1, y - r + 1), (x + r - 1, y + r - 1)], color),
        Marker::Triangle => canvas.shape(corners(&[(-r, r - 1), (r, r - 1), (0, -r)]), color),
        Marker::Down => canvas.shape(corners(&[(-r, 1 - r), (r, 1 - r), (0, r)]), color),
        Marker::Diamond => canvas.shape(corners(&[(-r, 0), (0, -r - 1), (r, 0), (0, r + 1)]), color),
        Marker::Hourglass => {
            canvas.shape(corners(&[(-r, -r), (r, -r), (0, 1)]), color);
            canvas.shape(corners(&[(-r, r), (r, r), (0, -1)]), color);
        }
        Marker::Cross => {
            canvas.shape(corners(&[(-r, thick - r), (thick - r, -r), (r, r - thick), (r - thick, r)]), color);
            canvas.shape(corners(&[(-r, r - thick), (thick - r, r), (r, thick - r), (r - thick, -r)]), color);
        }
        Marker::Plus => {
            let half = (thick + 1) / 2;
            canvas.fill([(x - r, y - half), (x + r, y + half)], color);
            canvas.fill([(x - half, y - r), (x + half, y + r)], color);
        }
    }
}

/// Draws an entry of a key: the look and its name. Returns where the next entry begins.
pub(crate) fn entry(canvas: &mut Canvas, (x, y): (i32, i32), (text, look): (&str, Look), size: i32) -> i32 {
    // An area's mark is no colour of its own.
    if !matches!(look, Look::Corner(_)) {
        canvas.declare(text, look.color(), look.marker());
    }
    let width = 2 * size;
    match look {
        Look::Line(style) => {
            canvas.line(vec![(x, y), (x + width, y)], style.color, 5);
            mark(canvas, (x + width / 2, y), style, 10);
        }
        Look::Points(style) => mark(canvas, (x + width / 2, y), style, 10),
        Look::Area(color) | Look::Corner(color) => {
            canvas.fill([(x, y - size / 2), (x + width, y + size / 2)], color);
            if matches!(look, Look::Corner(_)) {
                let (right, top) = (x + width, y - size / 2);
                canvas.shape(vec![(right, top), (right - size, top), (right, top + size)], INK);
            }
        }
    }
    canvas.text((x + width + 14, y), text, size, INK, Anchor::Left);
    x + width + 14 + text_width(text, size) + size * 3 / 2
}
