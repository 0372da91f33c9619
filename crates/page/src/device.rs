//! The device of a network as a drawing: its bodies and joints, and where drive, sensors, wall and hand are.

use std::fmt::Write as _;

use hpu_cosim::scene::{Compound, Experiment, Pmsm, Reading, Sampled, Sensor, SensorKind, figure};
use hpu_plant::network::{FeedKind, Joint};

use crate::escaped;
use crate::quantities::si;

/// Width of a letter at 11 pixels, with room for wider fonts.
const LETTER: i32 = 7;
const LINE: i32 = 14;
/// Space between bodies beside each other, which holds the text of their joint.
const GAP: i32 = 150;
/// Space above and below the bodies.
const ROOM: i32 = 84;
const MARGIN: i32 = 12;

/// A device to be drawn.
struct Drawn<'s> {
    compound: &'s Compound,
    /// The motor with three phases that its first body is the rotor of, if it has one.
    pmsm: Option<&'s Pmsm>,
    sensors: &'s [Sensor],
    has_wall: bool,
}

/// Returns the drawing of a scene's device as SVG; `None` if the device is no network. Its colours are those of the
/// page's style sheet, by the classes of a loop's drawing.
pub fn drawing(experiment: &Experiment) -> Option<String> {
    let (compound, pmsm, has_wall) = match experiment {
        Experiment::Axis(scene) => (scene.network.as_deref()?, None, scene.target.is_none()),
        Experiment::Paddle(scene) => (&*scene.network, None, false),
        Experiment::Foc(scene) => (&*scene.pmsm.around, Some(&*scene.pmsm), scene.wall.is_some()),
        Experiment::Dut(scene) => {
            let pmsm = scene.pmsm.as_deref();
            let compound = scene.network.as_deref().or(pmsm.map(|pmsm| &*pmsm.around))?;
            (compound, pmsm, scene.wall_rad.is_some())
        }
        _ => return None,
    };
    let sensors = pmsm.map_or(&compound.sensors[..], |pmsm| &pmsm.sensors);
    Some(Drawn { compound, pmsm, sensors, has_wall }.svg())
}

impl Drawn<'_> {
    fn svg(&self) -> String {
        let compound = self.compound;
        let order = order(compound);
        let texts: Vec<Vec<String>> = order.iter().map(|&body| body_lines(compound, body)).collect();
        let width = |(lines, &body): (&Vec<String>, &usize)| {
            let [above, below] = self.attached(body);
            let all = lines.iter().chain(&above).chain(&below);
            all.map(|line| LETTER * line.chars().count() as i32).max().unwrap_or(0) + 2 * MARGIN
        };
        let widths: Vec<i32> = texts.iter().zip(&order).map(width).collect();
        let mut lefts = Vec::new();
        let mut right = MARGIN;
        for width in &widths {
            lefts.push(right);
            right += width + GAP;
        }
        let tall = LINE * texts.iter().map(Vec::len).max().unwrap_or(1) as i32 + MARGIN;
        let (wide, high) = (right - GAP + MARGIN, tall + 2 * ROOM);
        let mut svg = String::new();
        for joint in &compound.network.joints {
            let at = |body: usize| order.iter().position(|other| *other == body).unwrap_or(0);
            let mut ends = [at(joint.from), at(joint.to)];
            ends.sort_unstable();
            let [x0, x1] = [lefts[ends[0]] + widths[ends[0]], lefts[ends[1]]];
            draw_joint(
                &mut svg,
                compound,
                joint,
                ([x0, x1], ROOM + tall / 2),
                (ends[1] == ends[0] + 1).then_some(tall),
            );
        }
        for (place, &body) in order.iter().enumerate() {
            let (x, middle) = (lefts[place], lefts[place] + widths[place] / 2);
            let _ = writeln!(
                svg,
                "<g class=\"block\"><rect x=\"{x}\" y=\"{ROOM}\" width=\"{}\" height=\"{tall}\" rx=\"4\"/>",
                widths[place]
            );
            for (line, text) in texts[place].iter().enumerate() {
                let class = if line == 0 { "head" } else { "entity" };
                write(&mut svg, class, (middle, ROOM + LINE * (line as i32 + 1)), text);
            }
            svg.push_str("</g>\n");
            let [above, below] = self.attached(body);
            for (texts, [from, to], first) in [
                (above, [ROOM - 24, ROOM - 2], ROOM - 30),
                (below, [ROOM + tall, ROOM + tall + 22], ROOM + tall + 24 + LINE),
            ] {
                if texts.is_empty() {
                    continue;
                }
                let _ = writeln!(svg, "<g class=\"net\"><path d=\"M{middle},{from}V{to}m-3,-7l3,7l3,-7\"/></g>");
                for (line, text) in texts.iter().enumerate() {
                    let step = LINE * line as i32;
                    let y = if first < ROOM { first - step } else { first + step };
                    write(&mut svg, "entity", (middle, y), text);
                }
            }
        }
        format!(
            "<svg class=\"diagram\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {wide} {high}\" \
             width=\"{wide}\" role=\"img\" aria-label=\"{0}\">\n<title>{0}</title>\n{svg}</svg>\n",
            "The device: bodies, joints, drive, sensors and hand"
        )
    }

    /// Returns what acts on a body, and what reads it.
    fn attached(&self, body: usize) -> [Vec<String>; 2] {
        let &Self { compound, pmsm, sensors, has_wall } = self;
        let network = &compound.network;
        let (mut above, mut below) = (Vec::new(), Vec::new());
        if let Some(pmsm) = pmsm.filter(|_| network.driven == body) {
            above.push(format!("drive: three phases, {} pole pairs", pmsm.pole_pairs));
        } else if network.driven == body {
            let kind = match network.feed.kind {
                FeedKind::Bridge(_) => "bridge",
                FeedKind::Current { .. } => "current",
                FeedKind::Pi { .. } => "PI current loop",
            };
            let [_, effort, _] = units(compound, body);
            above.push(format!("drive: {kind}, {}", si(network.feed.torque_constant, &format!("{effort}/A"))));
        }
        if network.grip == body {
            above.push("hand".into());
        }
        if network.seen == body && compound.followed.is_none() {
            below.push("encoder".into());
        }
        for sensor in sensors {
            let on = |index: usize| network.sensed[index].body;
            let (place, what) = match &sensor.kind {
                SensorKind::Encoder(index, _) => (on(*index), "lines".into()),
                SensorKind::Hall(hall) => (on(hall.reading), "Hall switches".into()),
                SensorKind::Modulator(_) => (network.driven, "bits of the current".into()),
                SensorKind::Sampled(Sampled { reading: Reading::Position(index), bits, .. }) => {
                    (on(*index), format!("{bits} bits"))
                }
                SensorKind::Sampled(Sampled { bits, .. }) => (network.driven, format!("current, {bits} bits")),
            };
            if place == body {
                let side = if what.contains("current") { &mut above } else { &mut below };
                side.push(format!("{}: {what}", sensor.name));
            }
        }
        if has_wall && compound.wall_body == body {
            below.push("wall".into());
        }
        [above, below]
    }
}

fn write(svg: &mut String, class: &str, (x, y): (i32, i32), text: &str) {
    let _ = writeln!(svg, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{}</text>", escaped(text));
}

/// Returns the bodies from the driven one on, each after one that it is joined to.
fn order(compound: &Compound) -> Vec<usize> {
    let mut all = vec![compound.network.driven];
    for next in 0..compound.names.len() {
        let Some(&body) = all.get(next) else { break };
        for Joint { from, to, .. } in &compound.network.joints {
            let other = if *from == body { to } else { from };
            if [*from, *to].contains(&body) && !all.contains(other) {
                all.push(*other);
            }
        }
    }
    all
}

/// Returns the units of a body's position, of its efforts and of its inertia.
fn units(compound: &Compound, body: usize) -> [&'static str; 3] {
    if compound.slides[body] { ["m", "N", "kg"] } else { ["rad", "N.m", "kg.m2"] }
}

/// Returns the name of a body, and what it has, a line each.
fn body_lines(compound: &Compound, index: usize) -> Vec<String> {
    let body = compound.network.bodies[index];
    let [position, effort, inertia] = units(compound, index);
    let mut lines = vec![compound.names[index].clone(), format!("{} {inertia}", figure(body.inertia))];
    if body.viscous > 0.0 {
        lines.push(format!("damping {} {effort}.s/{position}", figure(body.viscous)));
    }
    if body.coulomb > 0.0 || body.stiction > 0.0 {
        let sticks =
            if body.stiction > body.coulomb { format!(", sticks to {}", figure(body.stiction)) } else { "".into() };
        lines.push(format!("friction {} {effort}{sticks}", figure(body.coulomb)));
    }
    if body.spring != 0.0 {
        lines.push(format!("spring {} {effort}/{position}", figure(body.spring)));
    }
    for stop in compound.network.stops.iter().filter(|stop| stop.body == index) {
        lines.push(format!("stops {} and {}", si(stop.low, position), si(stop.high, position)));
    }
    lines
}

/// Draws a joint between two places, as a spring or as a rigid bar; between bodies that are not neighbours below them.
fn draw_joint(
    svg: &mut String,
    compound: &Compound,
    joint: &Joint,
    ([x0, x1], y): ([i32; 2], i32),
    beside: Option<i32>,
) {
    let [position, effort, _] = units(compound, joint.to);
    let ratio = match compound.slides[joint.from] == compound.slides[joint.to] {
        false => format!("{} m/rad", figure(joint.ratio)),
        true => format!("{} : 1", figure(1.0 / joint.ratio)),
    };
    let said = match joint.compliance {
        Some((stiffness, _)) => format!("{} {effort}/{position}", figure(stiffness)),
        None => "rigid".to_string(),
    };
    let (y, path) = match (beside, joint.compliance) {
        (Some(_), Some(_)) => {
            let step = (x1 - x0) / 10;
            let teeth = (0..3).map(|_| format!("l{step},-8l{step},16l{step},-8")).collect::<String>();
            let lead = (x1 - x0 - 9 * step) / 2;
            (y, format!("M{x0},{y}h{lead}{teeth}H{x1}"))
        }
        (Some(_), None) => (y, format!("M{x0},{0}H{x1}M{x0},{1}H{x1}", y - 2, y + 2)),
        (None, _) => (y, format!("M{x0},{y}C{},{} {},{} {x1},{y}", x0 + 40, y + 90, x1 - 40, y + 90)),
    };
    let _ = writeln!(svg, "<g class=\"net\"><path d=\"{path}\"/></g>");
    write(svg, "entity", ((x0 + x1) / 2, y - 14), &said);
    write(svg, "entity", ((x0 + x1) / 2, y + 24), &ratio);
}
