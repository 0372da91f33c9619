//! The pictures of a map: the outcome of the motion over two keys of a scene, and quantities measured there.

use hpu_cosim::scene::{Experiment, OutcomeKind, Setup};
use plotters::style::{RGBColor, WHITE};

use hpu_study::map::{
    Cell, Class, Curves, Displayed, Edge, Found, Map, class, class_name, classes, is_predicted, is_unseen, nearest,
    predicted, settled_for_ever, told_for_ever, unseen, wrapped,
};

use crate::drawing::canvas::{Anchor, Canvas, INK, QUIET, WIDTH, text_width};
use crate::drawing::map_frame::frames;
use crate::drawing::series::{
    BLACK, BLANK, BLUE, GREEN, LILAC, Look, MAROON, MAUVE, MINT, ORANGE, PURPLE, ROSE, RUST, SAND, SKY, Style, TAUPE,
    entry,
};
use crate::{Picture, dotted, page};

/// A quantity that is drawn over a map.
struct Quantity {
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    log: bool,
    of: fn(&Cell) -> Option<f64>,
}

/// The unit of an amplitude: a thousandth of the device's own unit.
const LENGTH: &str = "length";

const QUANTITIES: [Quantity; 6] = [
    Quantity {
        name: "amplitude",
        title: "amplitude of the limit cycle",
        unit: LENGTH,
        log: true,
        of: |cell| if cell.outcome == OutcomeKind::LimitCycle { cell.amplitude.map(|a| 1e3 * a) } else { None },
    },
    Quantity {
        name: "frequency",
        title: "frequency of the limit cycle",
        unit: "Hz",
        log: false,
        of: |cell| cell.frequency_hz.filter(|hz| *hz > 0.0),
    },
    Quantity {
        name: "energy",
        title: "energy that became heat",
        unit: "J",
        log: true,
        of: |cell| Some(cell.dissipated_j),
    },
    Quantity {
        name: "displayed-stiffness",
        title: "displayed stiffness over the stiffness asked for",
        unit: "",
        log: false,
        of: |cell| cell.displayed.and_then(Displayed::ratio),
    },
    Quantity {
        name: "bump",
        title: "greatest leap of the crank's drive at a switch",
        unit: "N",
        log: false,
        of: |cell| cell.switching.as_ref().map(|switching| switching.bump_n),
    },
    Quantity {
        name: "switch-energy",
        title: "energy of the crank's drive per switch",
        unit: "J",
        log: true,
        of: |cell| cell.switching.as_ref().and_then(|switching| switching.switch_j),
    },
];

/// Returns the map of outcomes with the criteria's curves, then one picture for each quantity that any cell has.
///
/// `curves` holds each method's curves, or why the method has none.
pub fn map_pictures(
    map: &Map,
    found: &[Found],
    curves: &[Result<Curves, hpu_study::Error>],
    command: &str,
) -> Vec<Picture> {
    let mut pictures = vec![outcomes(map, found, curves, command)];
    for quantity in &QUANTITIES {
        let values: Vec<Option<f64>> =
            (0..found.len()).map(|index| nearest(found, index).and_then(quantity.of)).collect();
        let known =
            values.iter().flatten().copied().filter(|value| value.is_finite() && (!quantity.log || *value > 0.0));
        let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), value| (l.min(value), h.max(value)));
        if low <= high {
            pictures.push(numbers(map, found, quantity, &values, (low, high), command));
        }
    }
    pictures
}

fn class_color(class: Option<Class>) -> RGBColor {
    match class {
        Some(Class::Outcome(OutcomeKind::Settled | OutcomeKind::Passive | OutcomeKind::Tracking)) => SKY,
        Some(Class::Outcome(OutcomeKind::LimitCycle | OutcomeKind::NonPassive)) => SAND,
        Some(Class::Outcome(OutcomeKind::Diverged | OutcomeKind::HighlyUnstable)) => MAROON.color,
        Some(Class::Outcome(OutcomeKind::NotTold)) => MINT,
        Some(Class::Outcome(OutcomeKind::HandMoves)) => ROSE,
        Some(Class::Outcome(OutcomeKind::NoWallTorque)) => TAUPE.color,
        Some(Class::Outcome(OutcomeKind::PositionLost)) => RUST.color,
        Some(Class::WallNotReached) => MAUVE,
        None => BLANK,
    }
}

/// Returns as text what the dots and lines of a map mean.
fn said(found: &[Found]) -> String {
    let runs = (0..found.len()).filter(|index| was_run(found, *index)).count();
    match found.len() {
        all if runs == all => "every cell was run, once; line: where two runs differ".to_string(),
        all => format!(
            "dots: the {runs} of {all} cells that were run, once; the others are as their neighbours; \
             line: where two runs differ, dashed where one of both is inferred"
        ),
    }
}

fn was_run(found: &[Found], index: usize) -> bool {
    matches!(found[index], Found::Run(_))
}

/// Returns the colour of a dot that stands out from a cell's colour, if the cell was run and another cell was not.
fn dot(found: &[Found], index: usize, cell: RGBColor) -> Option<RGBColor> {
    let RGBColor(r, g, b) = cell;
    let is_light = 3 * i32::from(r) + 6 * i32::from(g) + i32::from(b) > 1200;
    let all = (0..found.len()).all(|index| was_run(found, index));
    (was_run(found, index) && !all).then_some(if is_light { INK } else { WHITE })
}

fn outcomes(map: &Map, found: &[Found], curves: &[Result<Curves, hpu_study::Error>], command: &str) -> Picture {
    let title = format!("{}: what becomes of the motion", name(map));
    let wraps = match wrapped(found, 0..found.len()) {
        0 => String::new(),
        1 => "; product wrapped in 1 settled cell".into(),
        count => format!("; product wrapped in {count} settled cells"),
    };
    let hatched = if unseen(found, 0..found.len()) > 0 { "; hatched: past the wall, contact not seen" } else { "" };
    let speaks: Vec<bool> = (0..map.methods.len()).map(|method| is_predicted(map, method)).collect();
    let fails = |index: usize| predicted(map, index).is_ok_and(|fails| fails.last().is_some_and(|(_, fails)| *fails));
    let fails: Vec<bool> = (0..found.len()).map(|index| speaks[index / map.layer()] && fails(index)).collect();
    let failing = if fails.contains(&true) { "; hatched: predicted to fail by the linear loop" } else { "" };
    let mut canvas = page(&title, &(said(found) + &wraps + hatched + failing), command);
    let mut key: Vec<(String, Look)> = Vec::new();
    for (method, frame) in frames(map, true).into_iter().enumerate() {
        let color = |index: usize| class_color(class(found, index));
        frame.cells(&mut canvas, map, |index| Some(color(index)));
        frame.hatch(&mut canvas, map, |index| is_unseen(found, index) || fails[index]);
        frame.dots(&mut canvas, map, |index| dot(found, index, color(index)));
        frame.corners(&mut canvas, map, |index| settled_for_ever(found, index));
        frame.boundary(&mut canvas, map, |index| class(found, index), |index| was_run(found, index));
        frame.axes(&mut canvas, map);
        for curve in curves[method].iter().flat_map(|curves| &curves.curves) {
            let style = curve_style(curve.name);
            let entry = (curve.name.replace('_', " "), Look::Line(style));
            let over_x = curves[method].as_ref().is_ok_and(|curves| curves.over_x);
            frame.curve(&mut canvas, map, &curve.limits, over_x, style);
            if !key.contains(&entry) && curve.limits.iter().any(Option::is_some) {
                key.push(entry);
            }
        }
        if let Some(reason) = Edge::new(map, found, curves[method].as_ref().ok(), method).short() {
            frame.note(&mut canvas, map, &reason);
        }
    }
    let shown = classes().filter(|of| (0..found.len()).any(|index| class(found, index) == *of));
    let classes = shown.map(|of| (class_name(of).replace('_', " "), Look::Area(class_color(of))));
    let corner = told_for_ever(found).then(|| ("settled for ever".to_string(), Look::Corner(SKY)));
    legend(&mut canvas, &classes.chain(corner).chain(key).collect::<Vec<_>>());
    canvas.render("map")
}

/// Draws the key in one line, or in two lines of smaller letters.
fn legend(canvas: &mut Canvas, entries: &[(String, Look)]) {
    let width = |size: i32| entries.iter().map(|(text, _)| text_width(text, size) + 4 * size).sum::<i32>();
    let (size, mut y) = if width(26) < WIDTH - 120 { (26, 168) } else { (22, 150) };
    let mut x = 60;
    for (text, look) in entries {
        if x > 60 && x + 2 * size + 14 + text_width(text, size) > WIDTH - 60 {
            (x, y) = (60, y + 36);
        }
        x = entry(canvas, (x, y), (text.as_str(), *look), size);
    }
}

fn curve_style(name: &str) -> Style {
    match name {
        "spectral_radius" => BLACK,
        "routh" => GREEN,
        "low_frequency" => BLUE,
        "colgate_schenkel" => TAUPE,
        "gil_hulin" => ORANGE,
        "abbott_okamura" => PURPLE,
        "diolaiti" => LILAC,
        "describing_function" => RUST,
        _ => MAROON,
    }
}

/// Number of colours of the ramp; neighbouring cells of the same colour are one mark.
const STEPS: i32 = 32;

/// Returns a colour of viridis, backwards: it goes from light to dark both by lightness alone and by hue.
fn shade(share: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 9] = [
        [253.0, 231.0, 37.0],
        [170.0, 220.0, 50.0],
        [92.0, 200.0, 99.0],
        [39.0, 173.0, 129.0],
        [33.0, 144.0, 141.0],
        [44.0, 113.0, 142.0],
        [59.0, 81.0, 139.0],
        [71.0, 44.0, 122.0],
        [68.0, 1.0, 84.0],
    ];
    let at = (share.clamp(0.0, 1.0) * f64::from(STEPS)).round() / f64::from(STEPS) * (STOPS.len() - 1) as f64;
    let first = (at as usize).min(STOPS.len() - 2);
    let part = at - first as f64;
    let [r, g, b] = [0, 1, 2].map(|c| STOPS[first][c] + part * (STOPS[first + 1][c] - STOPS[first][c]));
    RGBColor(r.round() as u8, g.round() as u8, b.round() as u8)
}

fn numbers(
    map: &Map,
    found: &[Found],
    quantity: &Quantity,
    values: &[Option<f64>],
    (low, high): (f64, f64),
    command: &str,
) -> Picture {
    let mut conditions = said(found);
    if values.iter().any(Option::is_none) {
        conditions += "; white: has none";
    }
    let is_untouched = |index: usize| class(found, index) == Some(Class::WallNotReached);
    if (0..found.len()).any(is_untouched) {
        conditions += "; hatched: wall not reached";
    }
    let mut canvas = page(&format!("{}: {}", name(map), quantity.title), &conditions, command);
    let scale = |value: f64| if quantity.log { libm::log(value) } else { value };
    let share = |value: f64| if high > low { (scale(value) - scale(low)) / (scale(high) - scale(low)) } else { 0.5 };
    let color = |index: usize| values[index].map(|value| shade(share(value)));
    for frame in frames(map, false) {
        frame.cells(&mut canvas, map, color);
        frame.hatch(&mut canvas, map, is_untouched);
        frame.dots(&mut canvas, map, |index| dot(found, index, color(index).unwrap_or(WHITE)));
        frame.boundary(&mut canvas, map, |index| class(found, index), |index| was_run(found, index));
        frame.axes(&mut canvas, map);
    }
    let between = |share: f64| {
        let value = scale(low) + share * (scale(high) - scale(low));
        if quantity.log { libm::exp(value) } else { value }
    };
    bar(&mut canvas, &bar_name(map, quantity), &[0.0, 0.25, 0.5, 0.75, 1.0].map(|share| three_digits(between(share))));
    canvas.render(quantity.name)
}

/// Returns a quantity's title with its unit and its scale.
fn bar_name(map: &Map, quantity: &Quantity) -> String {
    let unit = match quantity.unit {
        LENGTH => match map.experiment(map.point(map.layer() / 2)) {
            Ok(Experiment::Axis(scene)) => format!("m{}", scene.units().position),
            Ok(Experiment::Foc(scene)) => format!("m{}", scene.device.units().position),
            Ok(Experiment::Dut(scene)) => format!("m{}", scene.device.units().position),
            _ => "thousandths of its unit".into(),
        },
        unit => dotted(unit),
    };
    let unit = if unit.is_empty() { unit } else { format!(" in {unit}") };
    format!("{}{unit}{}", quantity.title, if quantity.log { ", logarithmic" } else { "" })
}

/// Draws the ramp with its values below, and the name of the quantity beside it.
fn bar(canvas: &mut Canvas, name: &str, labels: &[String; 5]) {
    const SIDE: i32 = 24;
    let (left, y) = (100, 160);
    for step in 0..=STEPS {
        let x = left + SIDE * step;
        canvas.fill([(x, y - 12), (x + SIDE, y + 12)], shade(f64::from(step) / f64::from(STEPS)));
    }
    for (quarter, label) in (0..).zip(labels) {
        // The mark stands at the middle of the colour for the value.
        let x = left + SIDE * STEPS * quarter / 4 + SIDE / 2;
        canvas.line(vec![(x, y + 12), (x, y + 20)], INK, 2);
        canvas.text((x, y + 36), label.as_str(), 22, QUIET, Anchor::Centre);
    }
    canvas.text((left + SIDE * (STEPS + 1) + 40, y), name, 26, INK, Anchor::Left);
}

fn three_digits(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let decimals = if value == 0.0 { 0 } else { (2 - libm::log10(value.abs()).floor() as i32).max(0) as usize };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

fn name(map: &Map) -> &str {
    let file = map.scene.name.rsplit('/').next().unwrap_or(&map.scene.name);
    file.strip_suffix(".toml").unwrap_or(file)
}
