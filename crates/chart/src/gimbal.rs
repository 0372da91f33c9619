//! The pictures of a segment on a gimbal: its tip beside the target, the finger's force beside the asked spring, and
//! the device in two side views.

use std::ops::Range;

use hpu_cosim::scene::{GimbalScene, Setup};
use hpu_cosim::{FORCE, GimbalSimulation, RADIUS, Summary, Trace};
use hpu_plant::arm::Gimbal;

use crate::drawing::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH};
use crate::drawing::panel::{Panel, around, ticks};
use crate::drawing::series::{BLACK, BLUE, GREEN, LILAC, Look, ORANGE, PURPLE, SAND, SKY, Style, TAUPE, mark};
use crate::drop::column;
use crate::{Picture, page, rate, thinned, verdict};

/// The nets of a gimbal's loop that a trace must hold for its pictures, in this order; a run also writes them to its
/// table.
pub const GIMBAL_NETS: [&str; 8] =
    ["drive1", "drive2", "drive3", "mode", "finger_force", "radius", "equilibrium", "out_of_reach"];

const MODE: usize = 3;
const EQUILIBRIUM: usize = 6;
/// Columns of tip and target in [`hpu_cosim::GIMBAL_REALS`], and of the finger's pad.
const TIP: usize = 0;
const TARGET: usize = 3;
const PAD: usize = 12;

/// Length of the close-up of the first switch to impedance control, in s.
const CLOSE_UP_S: f64 = 0.2;
/// Height in pixels of the lane of one mode of control.
const LANE: i32 = 34;

/// Half the width of the drawn segment, the radius of its curvature, and half the width of the drawn pad, in mm. The
/// paper gives none of them.
const SEGMENT_MM: f64 = 15.0;
const CURVATURE_MM: f64 = 30.0;
const PAD_MM: f64 = 8.0;

/// Returns the pictures of a gimbal's run, from its trace of [`GIMBAL_NETS`]: no picture of the force without a finger,
/// and none at all of a run without a row.
///
/// # Panics
///
/// If the trace does not hold these nets.
pub fn gimbal_pictures(simulation: &GimbalSimulation, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
    if trace.rows() == 0 {
        return Vec::new();
    }
    let run = GimbalRun { scene: simulation.scene(), trace, summary, command };
    let finger = run.scene.probe.is_some().then(|| finger(&run));
    [motion(&run)].into_iter().chain(finger).chain([device(&run)]).collect()
}

/// A finished run of a gimbal.
struct GimbalRun<'a> {
    scene: &'a GimbalScene,
    trace: &'a Trace,
    summary: &'a Summary,
    command: &'a str,
}

impl<'a> GimbalRun<'a> {
    fn page(&self) -> Canvas {
        let scene = self.scene;
        let outcome = match &self.summary.aborted {
            Some(abort) => format!("diverged, ended at {:.2} s", abort.at_s),
            None => verdict(self.summary, (self.scene.units(), 1.0)),
        };
        let sampled = rate(scene.method.sample_rate_hz);
        let spring_n_per_mm = 1e-3 * scene.stiffness_n_per_m;
        let also = match (&self.summary.aborted, &scene.probe) {
            (Some(abort), _) => format!("; {}", abort.why),
            (None, Some(_)) => format!("; spring of {spring_n_per_mm:.3} N/mm under impedance control"),
            (None, None) => String::new(),
        };
        let conditions = format!(
            "segment on a gimbal at {}, sampled at {sampled}{also}{}",
            rate(scene.clock.frequency_hz() as f64),
            thinned(self.trace)
        );
        page(&format!("{}: {outcome}", scene.name), &conditions, self.command)
    }

    /// Returns the whole run as a range of times in s.
    fn whole_s(&self) -> Range<f64> {
        0.0..self.summary.motion_s.max(1e-6)
    }

    /// Returns x, y and z in m of each row, of the three columns from `first` on.
    fn positions_m(&self, first: usize) -> impl Iterator<Item = [f64; 3]> + Clone + 'a {
        let [x, y, z] = [first, first + 1, first + 2].map(|column| self.trace.real(column));
        x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z])
    }

    /// Returns height above the least radius in mm, pitch and roll in degrees, of each row.
    fn postures(&self, first: usize) -> Vec<[f64; 3]> {
        let least_m = self.scene.gimbal.radii_m()[0];
        let posture = |tip_m| {
            let [pitch_rad, roll_rad, radius_m] = Gimbal::polar(tip_m);
            [1e3 * (radius_m - least_m), pitch_rad.to_degrees(), roll_rad.to_degrees()]
        };
        self.positions_m(first).map(posture).collect()
    }

    /// Returns the times and heights in mm of the pad at rest; nothing without a finger.
    fn pad(&self) -> Option<impl Iterator<Item = (f64, f64)> + Clone + 'a> {
        let least_mm = 1e3 * self.scene.gimbal.radii_m()[0];
        self.scene.probe.as_ref()?;
        Some(column(self.trace, PAD, 1e3).map(move |(t, mm)| (t, mm - least_mm)))
    }

    /// Returns the times of the rows and whether the crank is under impedance control.
    fn impedance(&self) -> impl Iterator<Item = (f64, bool)> + Clone + 'a {
        self.trace.times_s().zip(self.trace.words(MODE).iter().map(|mode| *mode != 0))
    }

    /// Returns the force in N that the asked spring would give at each row, in one list for each stretch of rows under
    /// impedance control: stiffness times depth below the radius at which this control began, or below the desired
    /// radius if the switch does not latch it.
    fn asked(&self) -> Vec<Vec<(f64, f64)>> {
        let lsb_m = self.scene.method.config.gimbal.length.lsb();
        let depths_m = self.trace.words(EQUILIBRIUM).iter().zip(self.trace.real(RADIUS));
        let forces = depths_m.map(|(rest, radius_m)| (*rest as f64 * lsb_m - radius_m) * self.scene.stiffness_n_per_m);
        let rows: Vec<_> = self.impedance().zip(forces).collect();
        let stretches = rows.chunk_by(|before, after| before.0.1 == after.0.1);
        let probed = stretches.filter(|rows| rows[0].0.1);
        probed.map(|rows| rows.iter().map(|((t, _), force)| (*t, *force)).collect()).collect()
    }

    /// Returns the range of the first switch to impedance control in ms, from a little before it, and its label.
    /// Without a switch it is that of the first touch, or of the start.
    fn close_up(&self) -> (Range<f64>, &'static str) {
        let end_s = self.whole_s().end;
        // For a short run only a part of it, so that the two panels never show the same.
        let length_s = CLOSE_UP_S.min(0.25 * end_s);
        let switch_s = self.impedance().find(|row| row.1).map(|row| row.0);
        let touch_s = || column(self.trace, FORCE, 1.0).find(|(_, force)| *force > 0.0).map(|point| point.0);
        let (at_s, label) = match (switch_s, touch_s()) {
            (Some(at_s), _) => (at_s, "time in ms: the first switch to impedance control"),
            (None, Some(at_s)) => (at_s, "time in ms: the first touch"),
            (None, None) => (0.0, "time in ms: the finger does not touch the segment"),
        };
        let start_s = (at_s - 0.1 * length_s).clamp(0.0, end_s - length_s);
        (1e3 * start_s..1e3 * (start_s + length_s), label)
    }

    /// Draws the lanes of the two modes of control; each is filled where the crank may be in that mode. `scale` is the
    /// number of the axis's units of time in a second.
    fn lanes(&self, x: Range<f64>, top: i32, (x_label, scale): (&str, f64), canvas: &mut Canvas) {
        let bottom = top + 2 * LANE;
        let both = Panel { left: 170, top, right: WIDTH - 120, bottom, x, y: 0.0..1.0 };
        let times = ticks(&both.x, ((both.right - both.left) / 180) as usize);
        let legend = [("impedance control", Look::Area(SAND)), ("position control", Look::Area(SKY))];
        both.frame_at(canvas, &legend, Some(x_label), "", [times, (Vec::new(), 0)]);
        for (index, (name, is_up, color)) in
            [("impedance", true, SAND), ("position", false, SKY)].into_iter().enumerate()
        {
            let top = top + index as i32 * LANE;
            let lane = Panel { top, bottom: top + LANE, x: both.x.clone(), y: both.y.clone(), ..both };
            lane.shade(canvas, self.impedance().map(|(t, up)| (scale * t, up == is_up)), color);
            canvas.text((lane.left - 14, top + LANE / 2), name, 24, QUIET, Anchor::Right);
        }
        for y in [top, top + LANE, bottom] {
            canvas.line(vec![(both.left, y), (both.right, y)], QUIET, 2);
        }
    }
}

/// Returns a range widened to a least span about its middle: a device at rest is shown as at rest, not magnified.
fn at_least(range: Range<f64>, span: f64) -> Range<f64> {
    let (middle, half) = (0.5 * (range.start + range.end), 0.5 * (range.end - range.start).max(span));
    middle - half..middle + half
}

/// Returns the picture of height, pitch and roll against time, beside the target's, and of the mode of control.
fn motion(run: &GimbalRun) -> Picture {
    let mut canvas = run.page();
    let [tip, target] = [TIP, TARGET].map(|first| run.postures(first));
    let pad = run.pad();
    let panels =
        [(200, 510, 1.0, "height in mm"), (600, 820, 2.0, "pitch in degrees"), (910, 1130, 2.0, "roll in degrees")];
    for (index, (top, bottom, span, y_label)) in panels.into_iter().enumerate() {
        let of = |rows: &[[f64; 3]]| rows.iter().map(|row| row[index]).collect::<Vec<_>>();
        let [tip, target] = [of(&tip), of(&target)];
        let pad = pad.clone().filter(|_| index == 0);
        let pads = pad.iter().flat_map(|points| points.clone().map(|point| point.1));
        let y = at_least(around(tip.iter().chain(&target).copied().chain(pads), 0.08), span);
        let panel = Panel { left: 170, top, right: WIDTH - 120, bottom, x: run.whole_s(), y };
        let mut legend = vec![("the tip", Look::Line(BLUE)), ("the target", Look::Line(ORANGE))];
        if pad.is_some() {
            legend.push(("the finger's pad, as if nothing pressed it", Look::Line(PURPLE)));
        }
        panel.frame(&mut canvas, &legend, None, y_label);
        if let Some(pad) = pad {
            panel.curve(&mut canvas, pad, PURPLE, 3);
        }
        // The narrow target is drawn over the wide tip, so that both are visible where they agree.
        panel.curve(&mut canvas, run.trace.times_s().zip(tip), BLUE, 6);
        panel.curve(&mut canvas, run.trace.times_s().zip(target), ORANGE, 3);
    }
    run.lanes(run.whole_s(), 1220, ("time in s", 1.0), &mut canvas);
    canvas.render("motion")
}

/// Returns the picture of the finger's force beside that of the asked spring: the whole run, and a close-up of the
/// first switch.
fn finger(run: &GimbalRun) -> Picture {
    let mut canvas = run.page();
    let thresholds = run.scene.thresholds;
    let asked = run.asked();
    let (near, near_label) = run.close_up();
    for (x, top, label, scale) in [(run.whole_s(), 200, "time in s", 1.0), (near, 830, near_label, 1e3)] {
        let force = column(run.trace, FORCE, 1.0).map(|(t, force)| (scale * t, force));
        let asked = || asked.iter().map(|stretch| stretch.iter().map(|(t, force)| (scale * t, *force)));
        let shown = force.clone().chain(asked().flatten()).filter(|(t, _)| x.contains(t)).map(|point| point.1);
        let y = around(shown.chain([0.0, thresholds.on_n]), 0.08);
        let panel = Panel { left: 170, top, right: WIDTH - 120, bottom: top + 310, x: x.clone(), y };
        let level = |force_n: f64| [(x.start, force_n), (x.end, force_n)].into_iter();
        let mut legend = vec![("of the finger", Look::Line(BLUE)), ("of the asked spring", Look::Line(ORANGE))];
        if thresholds.on_n == thresholds.off_n {
            legend.push(("threshold of the switch", Look::Line(TAUPE)));
        } else {
            legend.push(("impedance control begins above", Look::Line(TAUPE)));
            legend.push(("and ends below", Look::Line(GREEN)));
        }
        panel.frame(&mut canvas, &legend, None, "force in N");
        panel.curve(&mut canvas, level(thresholds.on_n), TAUPE, 3);
        if thresholds.on_n != thresholds.off_n {
            panel.curve(&mut canvas, level(thresholds.off_n), GREEN, 3);
        }
        // The narrow asked force is drawn over the wide one, so that both are visible where they agree.
        panel.curve(&mut canvas, force, BLUE, 6);
        for stretch in asked() {
            panel.curve(&mut canvas, stretch, ORANGE, 3);
        }
        run.lanes(x, top + 400, (label, scale), &mut canvas);
    }
    canvas.render("finger")
}

/// The two side views: the name of the horizontal axis, its index, and whether the crank is drawn. The view of the
/// crank looks against z, the other along x.
const VIEWS: [(&str, usize, bool); 2] = [("x in mm", 0, true), ("z in mm", 2, false)];

/// Returns the legend of a side view.
fn legend(is_of_crank: bool, has_pad: bool) -> Vec<(&'static str, Look)> {
    if is_of_crank {
        return vec![
            ("at the start", Look::Line(BLUE)),
            ("at the extremes of its motion", Look::Line(LILAC)),
            ("crank, rod", Look::Line(GREEN)),
        ];
    }
    let pad = ("pad of the finger, unpressed: start, lowest", Look::Line(PURPLE));
    [("path of the tip", Look::Line(ORANGE))].into_iter().chain(has_pad.then_some(pad)).collect()
}

/// The device in one posture: positions in mm, x, y and z.
struct Posture {
    tip: [f64; 3],
    /// The pin between crank and rod, and the rod's other end; nothing where rounding puts the radius beyond the crank.
    four_bar: Option<[[f64; 3]; 2]>,
    /// Directions: along the arm, and across it in the view of the crank and in the other.
    along: [f64; 3],
    across: [[f64; 3]; 2],
}

/// Returns `start + a * u + b * v`.
fn moved(start: [f64; 3], (a, u): (f64, [f64; 3]), (b, v): (f64, [f64; 3])) -> [f64; 3] {
    [0, 1, 2].map(|i| start[i] + a * u[i] + b * v[i])
}

impl Posture {
    /// Returns the posture with the tip at a position in m; `None` if it is no number.
    fn of(gimbal: &Gimbal, tip_m: [f64; 3]) -> Option<Self> {
        if !tip_m.iter().all(|value| value.is_finite()) {
            return None;
        }
        let [pitch, roll, radius_m] = Gimbal::polar(tip_m);
        let ((st, ct), (sf, cf)) = (libm::sincos(pitch), libm::sincos(roll));
        let along = Gimbal::tip_at_m(&pitch, &roll, &1.0);
        let across = [[cf, sf, 0.0], [st * sf, -st * cf, ct]];
        let four_bar = gimbal.crank_rad(radius_m).map(|crank_rad| {
            let (sine, cosine) = libm::sincos(crank_rad);
            let crank_mm = 1e3 * gimbal.crank_m;
            let pin = moved([0.0; 3], (crank_mm * cosine, along), (crank_mm * sine, across[0]));
            [pin, along.map(|part| 1e3 * (radius_m - gimbal.offset_m) * part)]
        });
        Some(Self { tip: tip_m.map(|value| 1e3 * value), four_bar, along, across })
    }

    /// Returns the section of the segment in a view: an arc through the tip, whose middle of curvature is on the arm.
    fn segment(&self, view: usize) -> Vec<[f64; 3]> {
        let half_rad = libm::asin(SEGMENT_MM / CURVATURE_MM);
        let point = |step: i32| {
            let (sine, cosine) = libm::sincos(f64::from(step) / 12.0 * half_rad);
            moved(self.tip, (CURVATURE_MM * (cosine - 1.0), self.along), (CURVATURE_MM * sine, self.across[view]))
        };
        (-12..=12).map(point).collect()
    }

    /// Returns the ends of a pad at a distance in mm from the centre of the gimbal.
    fn pad(&self, distance_mm: f64, view: usize) -> [[f64; 3]; 2] {
        [-PAD_MM, PAD_MM].map(|side| moved([0.0; 3], (distance_mm, self.along), (side, self.across[view])))
    }

    /// Returns all points of the posture in a view.
    fn points(&self, view: usize) -> Vec<[f64; 3]> {
        self.segment(view).into_iter().chain(self.four_bar.into_iter().flatten()).chain([[0.0; 3]]).collect()
    }
}

/// Returns the rows of the least and the greatest of some of height, pitch and roll, in order, without the start.
fn extremes(postures: &[[f64; 3]], of: Range<usize>) -> Vec<usize> {
    let ends = |index: usize| {
        let values = postures.iter().map(|posture| posture[index]).enumerate().filter(|(_, value)| value.is_finite());
        let least = values.clone().min_by(|a, b| a.1.total_cmp(&b.1));
        [least, values.max_by(|a, b| a.1.total_cmp(&b.1))]
    };
    let mut rows: Vec<usize> = of.flat_map(ends).flatten().map(|(row, _)| row).filter(|row| *row > 0).collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

/// Returns ticks of every 10 mm, or of more where a range is wide.
fn tens(range: &Range<f64>) -> (Vec<f64>, usize) {
    ticks(range, ((range.end - range.start) / 10.0).ceil().clamp(1.0, 20.0) as usize)
}

/// Returns the picture of the device in two side views, at the start and at the extremes of its motion.
fn device(run: &GimbalRun) -> Picture {
    let mut canvas = run.page();
    let gimbal = &run.scene.gimbal;
    let tips: Vec<_> = run.positions_m(TIP).collect();
    let posture = |row: usize| Posture::of(gimbal, tips[row]);
    let start = posture(0);
    let postures = run.postures(TIP);
    let [mut later, tilted] =
        [0..1, 1..3].map(|of| extremes(&postures, of).into_iter().filter_map(posture).collect::<Vec<_>>());
    // The crank moves with the height alone.
    later.extend(tilted.into_iter().map(|posture| Posture { four_bar: None, ..posture }));
    // The pad at the start, and at its lowest.
    let pads = run.trace.real(PAD).iter().copied().enumerate().filter(|(_, m)| m.is_finite());
    let lowest = pads.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |pad| pad.0);
    let mut pad_rows = vec![0, lowest];
    pad_rows.dedup();
    pad_rows.retain(|_| run.scene.probe.is_some());
    let pad = |row: usize, view: usize| posture(row).map(|of| of.pad(1e3 * run.trace.real(PAD)[row], view));

    let (width, height) = (1000, 1010);
    let points: Vec<[f64; 3]> = start
        .iter()
        .chain(&later)
        .flat_map(|posture| [0, 1].map(|view| posture.points(view)))
        .flatten()
        .chain(pad_rows.iter().filter_map(|row| pad(*row, 0)).flatten())
        .chain(tips.iter().map(|tip| tip.map(|value| 1e3 * value)))
        .collect();
    // Both views have the same scale in both axes, and the centre of the gimbal in the middle.
    let most = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    let half_mm = most(&mut points.iter().flat_map(|[x, _, z]| [*x, *z])) + 5.0;
    let up = around(points.iter().map(|point| point[1]), 0.06);
    let mm_per_pixel = (2.0 * half_mm / f64::from(width)).max((up.end - up.start) / f64::from(height));
    let x = at_least(0.0..0.0, mm_per_pixel * f64::from(width));
    let y = at_least(up, mm_per_pixel * f64::from(height));

    for (view, (x_label, horizontal, is_of_crank)) in VIEWS.into_iter().enumerate() {
        let left = 170 + view as i32 * (width + 180);
        let panel = Panel { left, top: 220, right: left + width, bottom: 220 + height, x: x.clone(), y: y.clone() };
        let legend = legend(is_of_crank, !pad_rows.is_empty());
        panel.frame_at(&mut canvas, &legend, Some(x_label), "y in mm", [tens(&panel.x), tens(&panel.y)]);
        let at = |point: [f64; 3]| panel.at(point[horizontal], point[1]);
        let draw = |canvas: &mut Canvas, posture: &Posture, (body, bar): (Style, Style), width: u32| {
            canvas.line(vec![panel.at(0.0, 0.0), at(posture.tip)], body.color, width);
            canvas.line(posture.segment(view).into_iter().map(at).collect(), body.color, width + 4);
            mark(canvas, at(posture.tip), body, 10);
            if let Some([pin, end]) = posture.four_bar.filter(|_| is_of_crank) {
                canvas.line(vec![panel.at(0.0, 0.0), at(pin), at(end)], bar.color, width);
                mark(canvas, at(pin), bar, 9);
            }
        };
        for posture in &later {
            draw(&mut canvas, posture, (LILAC, LILAC), 3);
        }
        for row in &pad_rows {
            if let Some(ends) = pad(*row, view) {
                canvas.line(ends.map(at).to_vec(), PURPLE.color, if *row == 0 { 8 } else { 4 });
            }
        }
        if let Some(posture) = &start {
            draw(&mut canvas, posture, (BLUE, GREEN), 5);
        }
        panel.curve(&mut canvas, tips.iter().map(|tip| (1e3 * tip[horizontal], 1e3 * tip[1])), ORANGE, 3);
        mark(&mut canvas, panel.at(0.0, 0.0), BLACK, 12);
    }
    let note = format!(
        "black: the centre of the gimbal. The paper gives no shape of the segment: its width of {:.0} mm and its \
         radius of curvature of {CURVATURE_MM:.0} mm are assumed.",
        2.0 * SEGMENT_MM
    );
    canvas.text((60, HEIGHT - 84), note, 26, INK, Anchor::Left);
    canvas.render("device")
}
