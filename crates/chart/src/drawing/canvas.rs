//! A page of marks, which is painted both as SVG and as PNG.

use std::borrow::Cow;
use std::sync::Once;

use hpu_cosim::printable;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::{Key, Marker, Picture};

/// Width of a page in pixels of the marks; a browser shows the page at half of this.
pub(crate) const WIDTH: i32 = 2400;
/// Height of a page in pixels of the marks.
pub(crate) const HEIGHT: i32 = 1440;

/// Font family, and the family that a viewer without it uses.
const FAMILY: &str = "DejaVu Sans, sans-serif";

pub(crate) const INK: RGBColor = RGBColor(34, 38, 46);
/// Colour of secondary texts: ticks, conditions, the command.
pub(crate) const QUIET: RGBColor = RGBColor(90, 97, 108);
pub(crate) const GRID: RGBColor = RGBColor(226, 229, 234);

/// Position of a text relative to its given point, which is at the middle of the text's height; `Up` is centred and
/// reads from bottom to top.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Anchor {
    Left,
    Centre,
    Right,
    Up,
}

enum Mark {
    Line { points: Vec<(i32, i32)>, color: RGBColor, width: u32 },
    Fill { corners: [(i32, i32); 2], color: RGBColor },
    Shape { corners: Vec<(i32, i32)>, color: RGBColor },
    Dot { at: (i32, i32), radius: i32, color: RGBColor, width: u32 },
    Text { at: (i32, i32), text: String, size: i32, bold: bool, color: RGBColor, anchor: Anchor },
}

/// A page that is being drawn.
#[derive(Default)]
pub(crate) struct Canvas {
    marks: Vec<Mark>,
    keys: Vec<Key>,
    panels: usize,
}

fn font(size: i32, bold: bool) -> FontDesc<'static> {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        for (style, bytes) in [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())] {
            assert!(plotters::style::register_font(FAMILY, style, bytes).is_ok(), "an embedded font is sound");
        }
    });
    FontDesc::new(FontFamily::Name(FAMILY), f64::from(size), if bold { FontStyle::Bold } else { FontStyle::Normal })
}

/// Returns the width of a text in pixels.
pub(crate) fn text_width(text: &str, size: i32) -> i32 {
    font(size, false).box_size(text).map_or(0, |(width, _)| width as i32)
}

/// Returns a text as a picture shows it: a control character, which an SVG cannot hold, is escaped.
fn shown(text: String) -> String {
    match printable(&text) {
        Cow::Borrowed(_) => text,
        Cow::Owned(shown) => shown,
    }
}

impl Canvas {
    pub fn line(&mut self, points: Vec<(i32, i32)>, color: RGBColor, width: u32) {
        self.marks.push(Mark::Line { points, color, width });
    }

    pub fn fill(&mut self, corners: [(i32, i32); 2], color: RGBColor) {
        self.marks.push(Mark::Fill { corners, color });
    }

    /// Adds a filled polygon.
    pub fn shape(&mut self, corners: Vec<(i32, i32)>, color: RGBColor) {
        self.marks.push(Mark::Shape { corners, color });
    }

    /// Begins another panel; looks that are declared from here on belong to it.
    pub fn panel(&mut self) {
        self.panels += 1;
    }

    /// Declares what a colour, with its marker if it is that of a line, stands for in this panel.
    pub fn declare(&mut self, name: &str, RGBColor(r, g, b): RGBColor, marker: Option<Marker>) {
        self.keys.push(Key { name: name.to_string(), color: [r, g, b], marker, panel: self.panels });
    }

    /// Adds a disc (`width` 0), or a ring whose line has this width.
    pub fn dot(&mut self, at: (i32, i32), radius: i32, color: RGBColor, width: u32) {
        self.marks.push(Mark::Dot { at, radius, color, width });
    }

    /// Adds a text whose point is at the middle of its height.
    pub fn text(&mut self, at: (i32, i32), text: impl Into<String>, size: i32, color: RGBColor, anchor: Anchor) {
        let text = shown(text.into());
        self.marks.push(Mark::Text { at, text, size, bold: false, color, anchor });
    }

    pub fn title(&mut self, at: (i32, i32), text: impl Into<String>, size: i32) {
        let text = shown(text.into());
        self.marks.push(Mark::Text { at, text, size, bold: true, color: INK, anchor: Anchor::Left });
    }

    /// Returns the page as SVG and PNG.
    pub fn render(&self, name: &'static str) -> Picture {
        let size = (WIDTH as u32, HEIGHT as u32);
        let mut svg = String::new();
        self.paint(&SVGBackend::with_string(&mut svg, size).into_drawing_area(), true);
        // The SVG is shown at half of its pixels, so whole pixels are fine enough.
        let svg = svg.replacen(
            &format!("width=\"{WIDTH}\" height=\"{HEIGHT}\""),
            &format!("width=\"{}\" height=\"{}\"", WIDTH / 2, HEIGHT / 2),
            1,
        );
        let mut rgb = vec![255; 3 * WIDTH as usize * HEIGHT as usize];
        // The bitmap's line joints stick out where a line turns back, so lines are drawn piece by piece there.
        self.paint(&BitMapBackend::with_buffer(&mut rgb, size).into_drawing_area(), false);
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, size.0, size.1);
        encoder.set_color(png::ColorType::Rgb);
        // Most rows of a page are those above them. At the default level, packing takes a quarter of the time of a run
        // with its pictures, and the file is two thirds as large.
        encoder.set_filter(png::Filter::Up);
        encoder.set_deflate_compression(png::DeflateCompression::Level(1));
        let mut writer = encoder.write_header().expect("memory takes all");
        writer.write_image_data(&rgb).expect("memory takes all");
        writer.finish().expect("memory takes all");
        Picture { name, svg, png, keys: self.keys.clone() }
    }

    fn paint<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>, joined: bool) {
        let drawn = area
            .fill(&WHITE)
            .and_then(|()| self.marks.iter().try_for_each(|mark| draw(area, mark, joined)))
            .and_then(|()| area.present());
        drawn.expect("memory takes all");
    }
}

fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    mark: &Mark,
    joined: bool,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    match mark {
        Mark::Line { points, color, width } => {
            let pieces = points.windows(if joined { points.len().max(1) } else { 2 });
            pieces.into_iter().try_for_each(|piece| area.draw(&PathElement::new(piece, color.stroke_width(*width))))
        }
        Mark::Fill { corners, color } => area.draw(&Rectangle::new(*corners, color.filled())),
        Mark::Shape { corners, color } => area.draw(&Polygon::new(corners.as_slice(), color.filled())),
        Mark::Dot { at, radius, color, width: 0 } => area.draw(&Circle::new(*at, *radius, color.filled())),
        Mark::Dot { at, radius, color, width } => area.draw(&Circle::new(*at, *radius, color.stroke_width(*width))),
        Mark::Text { at, text, size, bold, color, anchor } => {
            let across = match anchor {
                Anchor::Left => HPos::Left,
                Anchor::Centre | Anchor::Up => HPos::Center,
                Anchor::Right => HPos::Right,
            };
            let font = font(*size, *bold);
            let font = if *anchor == Anchor::Up { font.transform(FontTransform::Rotate270) } else { font };
            let style = font.color(color).pos(Pos::new(across, VPos::Center));
            area.draw(&Text::new(text.as_str(), *at, style))
        }
    }
}
