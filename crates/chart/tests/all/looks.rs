//! Checks on how a picture looks, read from its SVG: texts are apart and legible, and colours can be distinguished by
//! every kind of sight and each have a meaning.

use std::collections::BTreeSet;

use ab_glyph::{Font, FontRef};
use hpu_chart::Picture;

use crate::colours::{Rgb, SIGHTS, contrast, difference, seen};

/// Smallest difference between the colours of a picture, by CIEDE2000.
const APART: f64 = 15.0;
/// Smallest contrast of a text with its background.
const LEGIBLE: f64 = 4.5;
/// Colours of paper, ink and grid, and of a band with its name in it: these colours have no meaning.
const NEUTRAL: [&str; 5] = ["#FFFFFF", "#22262E", "#5A616C", "#E2E5EA", "#E9E4DC"];

/// A text: its words, its colour, and the left, top, right and bottom of its box.
#[derive(Clone, PartialEq, Debug)]
pub struct Text {
    pub text: String,
    pub color: Rgb,
    pub area: [f64; 4],
}

/// Returns the marks of an SVG in the order in which they are painted, each from its name to its end.
pub fn elements(svg: &str) -> impl Iterator<Item = (&str, &str)> {
    let names = ["rect", "polyline", "polygon", "circle", "text"];
    svg.split('<').filter_map(move |rest| {
        let name = rest.split(' ').next()?;
        names.contains(&name).then_some((name, rest))
    })
}

/// Returns an attribute of a mark.
pub fn attribute<'a>(mark: &'a str, name: &str) -> Option<&'a str> {
    mark.split_once(&format!(" {name}=\""))?.1.split_once('"').map(|(value, _)| value)
}

pub fn number(mark: &str, name: &str) -> f64 {
    attribute(mark, name).and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{name} of {mark}"))
}

/// Returns the points of a line.
pub fn points(mark: &str) -> Vec<(f64, f64)> {
    let points = attribute(mark, "points").expect("points").split_whitespace();
    let number = |text: &str| text.parse::<f64>().expect("a number");
    points.map(|point| point.split_once(',').map(|(x, y)| (number(x), number(y))).expect("a point")).collect()
}

pub fn rgb(color: &str) -> Rgb {
    let digits = color.strip_prefix('#').unwrap_or_else(|| panic!("{color}"));
    [0, 2, 4].map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap_or_else(|_| panic!("{color}")))
}

/// Returns left, top, right and bottom of a rectangle.
pub fn rectangle(mark: &str) -> [f64; 4] {
    let [x, y, width, height] = ["x", "y", "width", "height"].map(|name| number(mark, name));
    [x, y, x + width, y + height]
}

/// Returns the width of a text in DejaVu Sans, from the advances of its glyphs, divided by the font's size.
fn width(text: &str, bold: bool) -> f64 {
    let bytes = if bold { dejavu::sans::bold() } else { dejavu::sans::regular() };
    let font = FontRef::try_from_slice(bytes).expect("a font");
    let em = font.units_per_em().expect("a font has an em");
    text.chars().map(|c| f64::from(font.h_advance_unscaled(font.glyph_id(c)) / em)).sum()
}

fn text_of(mark: &str) -> Text {
    let words = mark.split_once('>').map_or("", |(_, text)| text).trim();
    let entities = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    let words = entities.iter().fold(words.to_string(), |words, (entity, of)| words.replace(entity, of));
    let (x, y, size) = (number(mark, "x"), number(mark, "y"), number(mark, "font-size"));
    let width = width(&words, attribute(mark, "font-weight") == Some("bold")) * size;
    let left = match attribute(mark, "text-anchor") {
        Some("start") => x,
        Some("middle") => x - 0.5 * width,
        _ => x - width,
    };
    let area = match attribute(mark, "transform") {
        None => [left, y - 0.35 * size, left + width, y + 0.35 * size],
        // Rotated about its point, to be read from bottom to top.
        Some(turn) if turn.starts_with("rotate(270") => {
            [x - 0.35 * size, y - 0.5 * width, x + 0.35 * size, y + 0.5 * width]
        }
        Some(other) => panic!("{other}"),
    };
    Text { text: words, color: rgb(attribute(mark, "fill").expect("a colour")), area }
}

/// Returns the texts of an SVG, in order.
pub fn texts(svg: &str) -> Vec<Text> {
    let texts = elements(svg).filter(|(name, _)| *name == "text").map(|(_, mark)| text_of(mark));
    texts.filter(|text| !text.text.is_empty()).collect()
}

/// Asserts all rules of this module for a picture.
#[track_caller]
pub fn assert_readable(picture: &Picture, said: &str) {
    let said = format!("{said} {}", picture.name);
    texts_are_on_the_page_and_apart(picture, &said);
    texts_stand_out(picture, &said);
    series_are_told_apart(picture, &said);
    every_colour_stands_for_something(picture, &said);
}

#[track_caller]
fn texts_are_on_the_page_and_apart(picture: &Picture, said: &str) {
    let texts = texts(&picture.svg);
    assert!(texts.len() > 15, "{said}: {}", texts.len());
    for (index, text) in texts.iter().enumerate() {
        let [left, top, right, bottom] = text.area;
        assert!(left >= 0.0 && top >= 0.0 && right <= 2400.0 && bottom <= 1440.0, "{said}: {text:?}");
        for other in &texts[..index] {
            let [l, t, r, b] = other.area;
            assert!(right < l || r < left || bottom < t || b < top, "{said}: {text:?} over {other:?}");
        }
    }
}

/// Checks each text against its background: the last rectangle painted before it that holds its ends or its middle.
#[track_caller]
fn texts_stand_out(picture: &Picture, said: &str) {
    let mut below: Vec<([f64; 4], Rgb)> = Vec::new();
    for (name, mark) in elements(&picture.svg) {
        match (name, attribute(mark, "fill")) {
            ("rect", Some(color)) => {
                assert_eq!(
                    attribute(mark, "opacity"),
                    Some("1"),
                    "{said}: what is seen through another is told by none"
                );
                below.push((rectangle(mark), rgb(color)));
            }
            ("text", _) => {
                let text = text_of(mark);
                let [left, top, right, bottom] = text.area;
                let middle = (0.5 * (left + right), 0.5 * (top + bottom));
                for (x, y) in [(left, top), (right, top), middle, (left, bottom), (right, bottom)] {
                    let holds = |[l, t, r, b]: [f64; 4]| l <= x && x <= r && t <= y && y <= b;
                    let (_, ground) = below.iter().rfind(|(area, _)| holds(*area)).expect("the page");
                    let found = contrast(text.color, *ground);
                    assert!(text.text.is_empty() || found >= LEGIBLE, "{said}: {found:.2} of {text:?} on {ground:?}");
                }
            }
            _ => {}
        }
    }
}

/// Checks that any two series of the picture look different with every kind of sight, or have the same look in two
/// panels. Two series of a panel also differ in their markers, except for areas, which have none.
#[track_caller]
fn series_are_told_apart(picture: &Picture, said: &str) {
    for (index, one) in picture.keys.iter().enumerate() {
        for other in &picture.keys[..index] {
            let (shares, same) = (one.panel == other.panel, one.color == other.color);
            assert!(!(shares && one.marker.is_some() && one.marker == other.marker), "{said}: {one:?} and {other:?}");
            if same {
                assert!(!shares && one.marker == other.marker, "{said}: {one:?} and {other:?}");
                continue;
            }
            for (sight, matrix) in &SIGHTS {
                let found = difference(seen(one.color, matrix), seen(other.color, matrix));
                assert!(found >= APART, "{said}, {sight}: {found:.1} of {one:?} and {other:?}");
            }
        }
    }
}

/// Returns the ramp of a picture that has one: squares of 24 pixels in one row near the top, from the lower end on.
pub fn ramp(svg: &str) -> Vec<Rgb> {
    let rects = elements(svg).filter(|(name, _)| *name == "rect").map(|(_, mark)| mark);
    let bar = rects.filter(|mark| number(mark, "width") == 24.0 && number(mark, "height") == 24.0);
    let bar = bar.filter(|mark| number(mark, "y") < 200.0);
    bar.map(|mark| rgb(attribute(mark, "fill").expect("a colour"))).collect()
}

#[track_caller]
fn every_colour_stands_for_something(picture: &Picture, said: &str) {
    let known: BTreeSet<Rgb> = picture
        .keys
        .iter()
        .map(|key| key.color)
        .chain(NEUTRAL.iter().map(|color| rgb(color)))
        .chain(ramp(&picture.svg))
        .collect();
    for (name, mark) in elements(&picture.svg) {
        for of in ["fill", "stroke"] {
            if let Some(color) = attribute(mark, of).filter(|color| *color != "none") {
                assert!(known.contains(&rgb(color)), "{said}: a {name} in {color} stands for nothing: {mark}");
            }
        }
    }
    // Every look in a key occurs in the picture.
    for key in &picture.keys {
        let [r, g, b] = key.color;
        assert!(picture.svg.contains(&format!("#{r:02X}{g:02X}{b:02X}")), "{said}: {key:?}");
    }
}
