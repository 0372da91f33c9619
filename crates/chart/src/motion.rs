//! The pictures of the motion before the wall, and of the torque that pushes back.

use crate::drawing::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, Look, ORANGE, PURPLE, RUST, SHADE, SKY, mark};
use crate::drawing::words::{COMMAND, PENETRATION};
use crate::{Picture, Run, conditions, outcome, page};
use std::ops::Range;

use hpu_cosim::scene::{AxisTarget, Compound, Device, Hand, Setup, Units};
use hpu_cosim::{Mark, Pace, TORQUE_BETWEEN, Trace};
use hpu_signal::{Clock, Cycle};

/// Column of the angle in [`hpu_plant::REALS`].
pub(crate) const ANGLE: usize = 2;
/// Length of a close-up, in s.
const CLOSE_UP_S: f64 = 60e-3;
/// Greatest number of faults that are drawn as lines.
const MOST_LINES: usize = 12;

/// A motion, with everything that its pictures need, whichever logic closed the loop.
pub(crate) struct Motion<'a> {
    /// Both lines of the title, and the command that makes the pictures.
    pub title: String,
    pub conditions: String,
    pub command: &'a str,
    /// The units in which the motion is told, and how many of them one unit of the trace is.
    pub told_in: (Units, f64),
    /// The body of a network whose motion is told.
    pub body: Option<&'a str>,
    /// Turns of a motor's shaft for one of its wheel.
    pub wheel_ratio: Option<f64>,
    pub hand: &'a Hand,
    pub duration_s: f64,
    pub motion_s: f64,
    pub clock: Clock,
    /// Period of the modulator in clock cycles, if it is known.
    pub modulator: Option<u64>,
    /// Where the wall stands, in the units in which the motion is told.
    pub wall_rad: Option<f64>,
    /// The target that the method follows.
    pub target: Option<&'a AxisTarget>,
    pub trace: &'a Trace,
    /// The faults between device and logic.
    pub faults: &'a [Mark],
    /// A word for each row, which is not 0 where the wall is touched; none without a wall.
    pub contact: &'a [i64],
    /// The penetration as the datapath counts it: its words, and the value of one in mrad.
    pub counted: Option<(&'a [i64], f64)>,
    /// The torque asked of the actuator: the words, and the value of one in mN.m.
    pub asked: Option<(&'a [i64], f64)>,
}

impl<'a> Motion<'a> {
    /// Returns the motion of a run of our own loop.
    pub(crate) fn of(run: &Run<'a>) -> Self {
        Self {
            title: format!("{}: {}", run.scene.name, outcome(run)),
            conditions: conditions(run),
            command: run.command,
            told_in: (run.scene.units(), run.scene.scale()),
            body: run.scene.network.as_deref().map(Compound::wall_name),
            wheel_ratio: run.scene.network.is_none().then(|| wheel_ratio(&run.scene.device)).flatten(),
            hand: &run.scene.hand,
            duration_s: run.scene.run.duration_s,
            motion_s: run.summary.motion_s,
            clock: run.scene.clock,
            modulator: run.scene.modulator_clocks(),
            wall_rad: (run.scene.target.is_none())
                .then(|| run.words.realised.in_units(run.scene.scale()).wall_position_rad),
            target: run.scene.target.as_deref(),
            trace: run.trace,
            faults: &run.summary.faults,
            contact: if run.scene.target.is_some() { &[] } else { run.words_in(PENETRATION) },
            counted: Some((run.words_in(PENETRATION), 1e3 * run.words.realised.in_units(run.scene.scale()).count_rad)),
            // A positive command pushes against the positive direction, so its torque is negative, as in the trace.
            asked: Some((run.words_in(COMMAND), -1e3 * run.words.command_quantum_nm(run.scene) / run.scene.scale())),
        }
    }

    /// Returns the target in the rows of the trace.
    fn targets(&self) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        let (scale, rows) = (self.told_in.1, self.trace.times_s());
        self.target.into_iter().flat_map(move |target| rows.clone().map(move |t| (t, scale * target.at(t))))
    }

    /// Returns the factor from a torque of the trace to thousandths of the unit in which it is told.
    fn milli(&self) -> f64 {
        1e3 / self.told_in.1
    }

    /// Returns the labels of a torque, or a force, and of its mean.
    fn torque_labels(&self) -> (&'static str, &'static str) {
        match self.told_in.0.position {
            "rad" => ("torque in mN\u{b7}m", "the motor's, its mean"),
            _ => ("force in mN", "the amplifier's, its mean"),
        }
    }

    fn contact(&self) -> impl Iterator<Item = (f64, bool)> + Clone + 'a {
        self.trace.times_s().zip(self.contact.iter().map(|word| *word != 0))
    }

    fn angles(&self, scale: f64) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        let scale = scale * self.told_in.1;
        self.trace.times_s().zip(self.trace.real(ANGLE).iter().map(move |value| value * scale))
    }

    fn words(&self, words: Option<(&'a [i64], f64)>) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        let (words, scale) = words.unwrap_or((&[], 0.0));
        self.trace.times_s().zip(words.iter().map(move |&word| word as f64 * scale))
    }

    /// Draws the faults within a panel: a line for each, or, if there are many, a tick for each at the panel's upper
    /// end.
    fn faults(&self, panel: &Panel, scale: f64, canvas: &mut Canvas) {
        let within: Vec<_> = self.faults_within(&panel.x, scale).map(|(t, _)| t).collect();
        let top = panel.y.end;
        let low = if within.len() > MOST_LINES { top - 0.05 * (top - panel.y.start) } else { panel.y.start };
        for t in within {
            canvas.line(vec![panel.at(t, top), panel.at(t, low)], RUST.color, 2);
            if low == panel.y.start {
                mark(canvas, panel.at(t, top), RUST, 9);
            }
        }
    }

    fn faults_within<'r>(&'r self, x: &'r Range<f64>, scale: f64) -> impl Iterator<Item = (f64, &'static str)> + 'r {
        let at = move |mark: &Mark| (self.clock.seconds(Cycle(mark.edge)) * scale, mark.what);
        self.faults.iter().map(at).filter(move |(t, _)| x.contains(t))
    }

    /// Returns the names of the faults within a panel for a legend, if there are any.
    fn fault_names(&self, x: &Range<f64>, scale: f64) -> Option<String> {
        let has = |kind: &&&str| self.faults_within(x, scale).any(|(_, what)| what == **kind);
        let names: Vec<_> = Mark::KINDS.iter().filter(has).map(|kind| kind.replace('_', " ")).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }

    fn page(&self) -> Canvas {
        page(&self.title, &self.conditions, self.command)
    }

    fn hand(&self) -> Option<Vec<(f64, f64)>> {
        let (Hand::SpringDamper { path, .. } | Hand::Prescribed { path }) = self.hand else { return None };
        let scale = self.told_in.1;
        let mut points: Vec<_> = path.iter().map(|point| (point.time_s, scale * point.angle_rad)).collect();
        points.push((self.duration_s, scale * path.last()?.angle_rad));
        Some(points)
    }

    /// Returns the range of the first contact in ms, from a little before it (or from the start, if there is none), and
    /// its label.
    fn close_up(&self) -> (Range<f64>, &'static str) {
        // For a short run only a part of it, so that the two panels never show the same.
        let length_s = CLOSE_UP_S.min(0.25 * self.motion_s);
        let touch_s = self.contact().find(|(_, touching)| *touching).map(|(t, _)| t);
        let start_s = (touch_s.unwrap_or(0.0) - 0.1 * length_s).clamp(0.0, self.motion_s - length_s);
        let label = match touch_s {
            Some(_) => "time in ms: the first contact",
            None if self.target.is_some() => "time in ms: the beginning",
            None => "time in ms: the wall is not touched",
        };
        (1e3 * start_s..1e3 * (start_s + length_s), label)
    }
}

/// Returns the turns of a motor's shaft for one of its wheel.
pub(crate) fn wheel_ratio(device: &Device) -> Option<f64> {
    if let Device::Motor(motor) = device { Some(motor.wheel_ratio) } else { None }
}

/// Draws the wall as an area above its position.
pub(crate) fn wall(position_rad: f64, panel: &Panel, canvas: &mut Canvas) {
    if position_rad < panel.y.end {
        canvas.fill([panel.at(panel.x.start, position_rad), panel.at(panel.x.end, panel.y.end)], SHADE);
        canvas.line(vec![panel.at(panel.x.start, position_rad), panel.at(panel.x.end, position_rad)], QUIET, 3);
    }
}

/// Returns the label for the positions of a body; without a name, of the device.
pub(crate) fn angle_label(units: Units, body: Option<&str>) -> String {
    let (what, usual) = if units.position == "rad" { ("angle", "shaft") } else { ("position", "mass") };
    format!("{what} of the {} in {}", body.unwrap_or(usual), units.position)
}

/// Returns the picture of the angle against time, with the wall and the hand. Below it is a close-up of the first
/// contact: the true penetration, and the penetration as counted.
pub(crate) fn position(run: &Motion) -> Picture {
    let mut canvas = run.page();
    let x = 0.0..run.motion_s;
    let wall_rad = run.wall_rad;
    let hand = run.hand();
    let intended = hand.iter().flatten().map(|point| point.1);
    let angles = run.angles(1.0).map(|(_, angle)| angle);
    let targets = run.targets().map(|(_, target)| target);
    let y = around(angles.chain(intended).chain(targets).chain(wall_rad), 0.06);
    let bottom = if wall_rad.is_some() { 800 } else { HEIGHT - 150 };
    let top = Panel { left: 170, top: 210, right: WIDTH - 200, bottom, x: x.clone(), y };
    let mut legend = vec![("device", Look::Line(BLUE))];
    if let Some(wall_rad) = wall_rad {
        wall(wall_rad, &top, &mut canvas);
        legend.push(("inside the wall", Look::Area(SHADE)));
    }
    if hand.is_some() {
        legend.push(("the hand's intention", Look::Line(PURPLE)));
    }
    if run.target.is_some() {
        legend.push(("target", Look::Line(ORANGE)));
    }
    let faults = run.fault_names(&x, 1.0);
    legend.extend(faults.iter().map(|names| (names.as_str(), Look::Line(RUST))));
    top.frame(&mut canvas, &legend, Some("time in s"), &angle_label(run.told_in.0, run.body));
    run.faults(&top, 1.0, &mut canvas);
    if let Some(points) = hand {
        top.curve(&mut canvas, points.into_iter(), PURPLE, 3);
    }
    top.curve(&mut canvas, run.targets(), ORANGE, 3);
    top.curve(&mut canvas, run.angles(1.0), BLUE, 4);
    if let Some(ratio) = run.wheel_ratio {
        top.right_axis(&mut canvas, 1.0 / ratio, "angle of the wheel in rad");
    }
    let Some(wall_rad) = wall_rad else { return canvas.render("position") };

    let (x, x_label) = run.close_up();
    let shown = |point: &(f64, f64)| x.contains(&point.0);
    let depths = run.angles(1e3).map(|(t, angle_mrad)| (1e3 * t, (angle_mrad - 1e3 * wall_rad).max(0.0)));
    let counted = run.words(run.counted).map(|(t, depth)| (1e3 * t, depth));
    let y = around(depths.clone().chain(counted.clone()).filter(shown).map(|point| point.1).chain([0.0]), 0.06);
    let bottom = Panel { left: 170, top: 960, right: WIDTH - 200, bottom: HEIGHT - 150, x: x.clone(), y };
    bottom.shade(&mut canvas, run.contact().map(|(t, touching)| (1e3 * t, touching)), SHADE);
    let depth = format!("penetration in m{}", run.told_in.0.position);
    let mut legend = vec![("as it is", Look::Line(BLUE)), ("contact, as counted", Look::Area(SHADE))];
    if run.counted.is_some() {
        legend.insert(1, ("as counted by the datapath", Look::Line(ORANGE)));
    }
    let faults = run.fault_names(&x, 1e3);
    legend.extend(faults.iter().map(|names| (names.as_str(), Look::Line(RUST))));
    bottom.frame(&mut canvas, &legend, Some(x_label), &depth);
    run.faults(&bottom, 1e3, &mut canvas);
    bottom.curve(&mut canvas, depths, BLUE, 5);
    bottom.curve(&mut canvas, counted, ORANGE, 3);
    canvas.render("position")
}

/// Returns the mean of each row, and the time at which its window begins. With a modulator the window consists of whole
/// periods. A row is left out if no period has begun since the row before it; the mean before it then stays valid.
fn whole_means(run: &Motion, means: &[f64]) -> Vec<(f64, f64)> {
    let pace = Pace { stride: run.trace.edges_apart(), period: run.modulator };
    let edge_s = run.clock.period_s();
    let mut points = Vec::with_capacity(means.len());
    for (row, mean) in means.iter().enumerate().skip(1) {
        let (before, edge) = ((row as u64 - 1) * pace.stride, row as u64 * pace.stride);
        if pace.period.is_none() || pace.boundary(edge) > pace.boundary(before) {
            points.push((pace.window(edge).0 as f64 * edge_s, *mean));
        }
    }
    points
}

/// Returns a picture of motions side by side, each a column, on the same scales: the angle, and the torque's mean and
/// the range of its ripple.
pub(crate) fn beside(motions: &[Motion], command: &str) -> Picture {
    let titles: Vec<&str> = motions.iter().map(|motion| motion.title.as_str()).collect();
    let mut canvas = page("Side by side", &titles.join("; beside "), command);
    let angles = motions.iter().flat_map(|motion| motion.angles(1.0).map(|(_, angle)| angle).chain(motion.wall_rad));
    let angle_range = around(angles, 0.08);
    let torques = motions.iter().flat_map(|motion| {
        TORQUE_BETWEEN
            .into_iter()
            .flat_map(|column| motion.trace.real(column).iter().map(|torque| motion.milli() * torque))
    });
    let torque_range = around(torques, 0.08);
    let end_s = motions.iter().map(|motion| motion.motion_s).fold(0.0, f64::max);
    let width = (WIDTH - 100) / motions.len() as i32;
    for (index, motion) in motions.iter().enumerate() {
        let (left, right) = (170 + index as i32 * width, (index as i32 + 1) * width - 20);
        let name = motion.title.split(':').next().unwrap_or_default();
        canvas.text((left, 170), name, 32, INK, Anchor::Left);
        let x = 0.0..end_s;
        let top = Panel { left, top: 270, right, bottom: 720, x: x.clone(), y: angle_range.clone() };
        motion.wall_rad.into_iter().for_each(|wall_rad| wall(wall_rad, &top, &mut canvas));
        let legend = [("device", Look::Line(BLUE)), ("inside the wall", Look::Area(SHADE))];
        top.frame(&mut canvas, &legend, None, &angle_label(motion.told_in.0, motion.body));
        motion.faults(&top, 1.0, &mut canvas);
        top.curve(&mut canvas, motion.angles(1.0), BLUE, 4);

        let bottom = Panel { left, top: 850, right, bottom: HEIGHT - 150, x, y: torque_range.clone() };
        bottom.shade(&mut canvas, motion.contact(), SHADE);
        let legend = [("torque, its mean", Look::Line(BLUE)), ("least to greatest", Look::Area(SKY))];
        bottom.frame(&mut canvas, &legend, Some("time in s"), motion.torque_labels().0);
        let [means, least, greatest] = TORQUE_BETWEEN.map(|column| motion.trace.real(column));
        let since = motion.trace.times_s().zip(motion.trace.times_s().skip(1)).zip(1..);
        let came =
            since.map(|((from, to), row)| (from..to, [least, greatest].map(|values| motion.milli() * values[row])));
        bottom.band(&mut canvas, came, SKY);
        bottom.steps(
            &mut canvas,
            whole_means(motion, means).iter().map(|(t, torque)| (*t, motion.milli() * torque)),
            BLUE,
            5,
        );
    }
    canvas.render("side-by-side")
}

/// Returns the picture of the commanded and the actual torque: the whole run, and a close-up of the first contact.
pub(crate) fn torque(run: &Motion) -> Picture {
    let mut canvas = run.page();
    let asked = || run.words(run.asked);
    let [means, least, greatest] = TORQUE_BETWEEN.map(|column| run.trace.real(column));
    // A row's values are those of the time since the row before it.
    let since = || run.trace.times_s().zip(run.trace.times_s().skip(1)).zip(1..);
    let milli = run.milli();
    let came = || since().map(|((from, to), row)| (from..to, [least, greatest].map(|values| milli * values[row])));
    let mean = whole_means(run, means);
    let end_s = run.motion_s;
    let (near, near_label) = run.close_up();
    let (y_label, mean_label) = run.torque_labels();
    let panels = [(0.0..end_s, 210, 700, "time in s", 1.0), (near, 850, HEIGHT - 150, near_label, 1e3)];
    for (x, top, bottom, x_label, scale) in panels {
        let asked = asked().map(|(t, torque)| (t * scale, torque));
        let came = || came().map(|(span, values)| (span.start * scale..span.end * scale, values));
        let shown = |point: &(f64, f64)| x.contains(&point.0);
        let ends = came().flat_map(|(span, values)| values.map(|torque| (span.start, torque)));
        let y = around(asked.clone().chain(ends).filter(shown).map(|point| point.1), 0.08);
        let panel = Panel { left: 170, top, right: WIDTH - 200, bottom, x: x.clone(), y };
        panel.shade(&mut canvas, run.contact().map(|(t, touching)| (t * scale, touching)), SHADE);
        let mut legend = vec![(mean_label, Look::Line(BLUE)), ("from its least to its greatest", Look::Area(SKY))];
        if run.target.is_none() {
            legend.push(("contact, as counted", Look::Area(SHADE)));
        }
        if run.asked.is_some() {
            legend.insert(0, ("commanded; negative pushes back", Look::Line(ORANGE)));
        }
        let faults = run.fault_names(&x, scale);
        legend.extend(faults.iter().map(|names| (names.as_str(), Look::Line(RUST))));
        panel.frame(&mut canvas, &legend, Some(x_label), y_label);
        let zero = [panel.at(x.start, 0.0), panel.at(x.end, 0.0)];
        if panel.y.contains(&0.0) {
            canvas.line(zero.to_vec(), INK, 2);
        }
        panel.band(&mut canvas, came(), SKY);
        // The narrow command is drawn over the wide mean, so that both are visible where they agree.
        panel.steps(&mut canvas, mean.iter().map(|(t, torque)| (t * scale, milli * torque)), BLUE, 8);
        panel.curve(&mut canvas, asked, ORANGE, 3);
        run.faults(&panel, scale, &mut canvas);
    }
    canvas.render("torque")
}
