//! Pictures of a segment on a gimbal: positions and forces as drawn, read from the SVG by its own ticks.

use hpu_chart::{GIMBAL_NETS, Picture, gimbal_pictures};
use hpu_cosim::scene::{Experiment, GimbalScene, shipped};
use hpu_cosim::{Control, Driver, FORCE, GimbalSimulation, RADIUS, Simulation, Summary, Trace, Verdict, Wired};
use hpu_signal::{Cycle, Observe};

use crate::looks::{assert_readable, attribute, elements, number, points, rectangle, rgb, texts};

const COMMAND: &str = "hpu run gimbal -o <here>";
/// Radius at the height 0: rod less crank.
const LEAST_MM: f64 = 58.0 - 12.5;
/// A finger that touches nothing.
const FAR: (&str, &str) = ("finger.path", "[[0, '30 mm']]");

fn parsed(name: &str, overrides: &[(&str, &str)]) -> GimbalScene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    let Experiment::Gimbal(scene) = scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}")) else {
        panic!("{name}");
    };
    scene
}

/// A finished run with its pictures.
struct Drawn {
    trace: Trace,
    summary: Summary,
    pictures: Vec<Picture>,
}

impl Drawn {
    fn of(scene: &GimbalScene) -> Self {
        let simulation = GimbalSimulation::new(scene).unwrap();
        let mut trace = simulation.trace(&GIMBAL_NETS);
        let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        let pictures = gimbal_pictures(&simulation, &trace, &summary, COMMAND);
        Self { trace, summary, pictures }
    }

    fn names(&self) -> Vec<&str> {
        self.pictures.iter().map(|picture| picture.name).collect()
    }

    fn picture(&self, name: &str) -> &Picture {
        self.pictures.iter().find(|picture| picture.name == name).unwrap()
    }
}

fn color(picture: &Picture, name: &str) -> [u8; 3] {
    picture.keys.iter().find(|key| key.name == name).unwrap_or_else(|| panic!("{name}: {:?}", picture.keys)).color
}

/// Returns the lines of a series within left, top, right and bottom. The lines of legends, above their panels, are
/// outside.
fn lines(picture: &Picture, name: &str, [left, top, right, bottom]: [f64; 4]) -> Vec<Vec<(f64, f64)>> {
    let color = color(picture, name);
    let own = elements(&picture.svg)
        .filter(|(mark, of)| *mark == "polyline" && attribute(of, "stroke").map(rgb) == Some(color))
        .map(|(_, of)| points(of));
    let is_within = |line: &[(f64, f64)]| {
        line.iter().all(|(x, y)| (left..=right).contains(x) && (top..=bottom).contains(y)) && !line.is_empty()
    };
    own.filter(|line| is_within(line)).collect()
}

/// Returns the areas of a series that are no key: those from `left` on and below the first panel.
fn areas(picture: &Picture, name: &str, left: f64, top: f64, bottom: f64) -> Vec<[f64; 4]> {
    let color = color(picture, name);
    let own = elements(&picture.svg)
        .filter(|(mark, of)| *mark == "rect" && attribute(of, "fill").map(rgb) == Some(color))
        .map(|(_, of)| rectangle(of));
    own.filter(|area| area[0] >= left && area[1] >= top && area[3] <= bottom).collect()
}

/// A scale read from the ticks: the pixel of 0, and pixels in a unit.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Scale {
    zero: f64,
    unit: f64,
}

impl Scale {
    /// Returns the scale through the outermost of ticks: their values and pixels.
    fn through(mut ticks: Vec<(f64, f64)>) -> Self {
        ticks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(from, from_pixel), .., (to, to_pixel)] = ticks[..] else { panic!("{ticks:?}") };
        let unit = (to_pixel - from_pixel) / (to - from);
        Self { zero: from_pixel - from * unit, unit }
    }

    fn pixel(self, value: f64) -> f64 {
        self.zero + self.unit * value
    }

    fn value(self, pixel: f64) -> f64 {
        (pixel - self.zero) / self.unit
    }
}

/// Returns the values of the labels within an area, with the middles of their boxes.
fn labels(picture: &Picture, [left, top, right, bottom]: [f64; 4]) -> Vec<(f64, [f64; 2])> {
    let all = texts(&picture.svg).into_iter().map(|text| {
        let [l, t, r, b] = text.area;
        (text.text.replace('\u{2212}', "-").parse().ok(), [0.5 * (l + r), 0.5 * (t + b)])
    });
    let within = all.filter(|(_, [x, y])| (left..=right).contains(x) && (top..=bottom).contains(y));
    within.filter_map(|(value, middle)| Some((value?, middle))).collect()
}

/// Returns the vertical scale of a panel whose ticks are left of `left`.
fn vertical(picture: &Picture, left: f64, top: f64, bottom: f64) -> Scale {
    let ticks = labels(picture, [left - 110.0, top - 12.0, left, bottom + 12.0]);
    Scale::through(ticks.into_iter().map(|(value, [_, y])| (value, y)).collect())
}

/// Returns the horizontal scale of a panel whose ticks are below it.
fn horizontal(picture: &Picture, left: f64, right: f64, bottom: f64) -> Scale {
    let ticks = labels(picture, [left - 20.0, bottom, right + 20.0, bottom + 45.0]);
    Scale::through(ticks.into_iter().map(|(value, [x, _])| (value, x)).collect())
}

/// Returns the height of a line at a horizontal pixel.
fn height_at(line: &[(f64, f64)], x: f64) -> f64 {
    let pair = line.windows(2).find(|pair| pair[0].0 <= x && x <= pair[1].0).unwrap_or_else(|| panic!("no {x}"));
    let share = if pair[1].0 > pair[0].0 { (x - pair[0].0) / (pair[1].0 - pair[0].0) } else { 0.0 };
    pair[0].1 + share * (pair[1].1 - pair[0].1)
}

#[test]
fn every_picture_of_every_gimbal_scene_is_readable_and_there_is_no_force_without_a_finger() {
    let mut finger = 0;
    for shipped in shipped() {
        let Experiment::Gimbal(scene) = shipped.parse(&[]).unwrap() else { continue };
        let drawn = Drawn::of(&scene);
        match scene.probe {
            Some(_) => assert_eq!(drawn.names(), ["motion", "finger", "device"]),
            None => assert_eq!(drawn.names(), ["motion", "device"]),
        }
        finger += usize::from(scene.probe.is_some());
        for picture in &drawn.pictures {
            assert_readable(picture, shipped.name);
            assert!(texts(&picture.svg)[0].text.starts_with(&format!("{}: ", shipped.name)));
            assert!(picture.svg.contains("$ hpu run gimbal -o &lt;here&gt;"));
        }
    }
    assert!(finger > 0);
}

/// The target is straight from point to point, so its curves are known in closed form.
#[test]
fn height_pitch_and_roll_of_the_target_are_drawn_where_the_scene_has_them() {
    let path = "[[0, '10 mm', 0, 0], ['1 s', '20 mm', '20 deg', '-10 deg']]";
    let scene = parsed("gimbal-switch", &[("target.path", path), ("run.duration", "1 s"), FAR]);
    let drawn = Drawn::of(&scene);
    let picture = drawn.picture("motion");
    let time = horizontal(picture, 170.0, 2280.0, 1280.0);
    let panels = [(200.0, 510.0, [10.0, 10.0]), (600.0, 820.0, [0.0, 20.0]), (910.0, 1130.0, [0.0, -10.0])];
    for (top, bottom, [start, slope]) in panels {
        let scale = vertical(picture, 170.0, top, bottom);
        let lines = lines(picture, "the target", [170.0, top, 2280.0, bottom]);
        assert_eq!(lines.len(), 1);
        for time_s in [0.1, 0.25, 0.5, 0.75, 0.9] {
            let found = height_at(&lines[0], time.pixel(time_s));
            // A pixel of rounding on both axes, and a sample of 1 ms; the curve climbs by less than a pixel in either.
            assert!((found - scale.pixel(start + slope * time_s)).abs() <= 2.0, "{slope}: {found} at {time_s} s");
        }
    }
    // Nothing presses: the crank is under position control all the time, and the pad is not in the way.
    assert!(areas(picture, "impedance control", 170.0, 1210.0, 1300.0).is_empty());
    assert_eq!(areas(picture, "position control", 170.0, 1210.0, 1300.0).len(), 1);
}

/// The spring of gimbal-spring is at rest at the desired height of 22 mm, so its force is known from the radius alone.
#[test]
fn the_asked_force_is_stiffness_times_depth_and_is_drawn_under_impedance_control_alone() {
    let scene = parsed("gimbal-spring", &[]);
    let drawn = Drawn::of(&scene);
    let picture = drawn.picture("finger");
    let (time, force) = (horizontal(picture, 170.0, 2280.0, 668.0), vertical(picture, 170.0, 200.0, 510.0));
    let stretches = lines(picture, "of the asked spring", [170.0, 200.0, 2280.0, 510.0]);
    let rows: Vec<f64> = drawn.trace.times_s().collect();
    for time_s in [2.0, 2.5, 4.0, 5.5] {
        let row = rows.iter().position(|t| *t >= time_s).unwrap();
        // 1 N/mm.
        let wanted = LEAST_MM + 22.0 - 1e3 * drawn.trace.real(RADIUS)[row];
        let found = height_at(stretches.last().unwrap(), time.pixel(time_s));
        assert!((found - force.pixel(wanted)).abs() <= 2.0, "{wanted} N at {time_s} s, {}", force.value(found));
        // The finger feels it, but for the servo's friction.
        assert!((drawn.trace.real(FORCE)[row] - wanted).abs() < 0.25 * wanted);
    }
    let lanes = areas(picture, "impedance control", 170.0, 590.0, 680.0);
    assert!(!stretches.is_empty() && !lanes.is_empty());
    for (x, _) in stretches.iter().flatten() {
        assert!(lanes.iter().any(|lane| (lane[0]..=lane[2]).contains(x)), "{x} of {lanes:?}");
    }
}

/// With its hysteresis gimbal-switch-held switches once, at the first sample after the force has passed 0.5 N.
#[test]
fn the_lanes_of_the_modes_meet_where_the_force_passes_the_threshold() {
    let scene = parsed("gimbal-switch-held", &[("run.duration", "1 s")]);
    let drawn = Drawn::of(&scene);
    let times: Vec<f64> = drawn.trace.times_s().collect();
    let passed_s = times[drawn.trace.real(FORCE).iter().position(|force| *force > 0.5).unwrap()];
    for name in ["motion", "finger"] {
        let picture = drawn.picture(name);
        let (top, bottom) = if name == "motion" { (1210.0, 1300.0) } else { (590.0, 680.0) };
        let time = horizontal(picture, 170.0, 2280.0, bottom - 12.0);
        let impedance = areas(picture, "impedance control", 170.0, top, bottom);
        let position = areas(picture, "position control", 170.0, top, bottom);
        let ([impedance], [position]) = (&impedance[..], &position[..]) else { panic!("{impedance:?} {position:?}") };
        // The converter's noise and the sample make the switch a few milliseconds early or late.
        for edge in [impedance[0], position[2]] {
            assert!((time.value(edge) - passed_s).abs() < 6e-3, "{name}: {} of {passed_s} s", time.value(edge));
        }
        assert_eq!((position[0], impedance[2]), (170.0, 2280.0));
    }
    let levels = drawn.picture("finger");
    let force = vertical(levels, 170.0, 200.0, 510.0);
    for (name, level_n) in [("impedance control begins above", 0.5), ("and ends below", 0.1)] {
        let lines = lines(levels, name, [170.0, 200.0, 2280.0, 510.0]);
        assert_eq!(lines.len(), 1, "{name}");
        assert!(lines[0].iter().all(|(_, y)| (y - force.pixel(level_n)).abs() <= 1.0), "{name}");
    }
}

/// The device at 20 degrees of roll and no pitch: in the view of the crank all lengths are true.
#[test]
fn the_side_views_have_one_scale_and_the_lengths_of_the_device() {
    let path = "[[0, '20 mm', 0, '20 deg'], ['1 s', '8 mm', '10 deg', '20 deg']]";
    let scene = parsed("gimbal-switch", &[("target.path", path), ("run.duration", "1 s"), FAR]);
    let drawn = Drawn::of(&scene);
    let picture = drawn.picture("device");
    let (left, bottom) = ([170.0, 1350.0], 1230.0);
    let up = left.map(|left| vertical(picture, left, 220.0, bottom));
    let across = left.map(|left| horizontal(picture, left, left + 1000.0, bottom));
    assert_eq!(up[0], up[1]);
    for scale in across {
        assert!((scale.unit + up[0].unit).abs() < 0.02 * scale.unit, "{scale:?} {up:?}");
    }
    let mm = |view: usize, (x, y): (f64, f64)| (across[view].value(x), up[view].value(y));
    let length = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
    let near = |found: f64, wanted: f64| (found - wanted).abs() < 0.25;

    let area = |view: usize| [left[view], 220.0, left[view] + 1000.0, bottom];
    let bars = lines(picture, "crank, rod", area(0));
    let bar: Vec<_> = bars[0].iter().map(|at| mm(0, *at)).collect();
    assert_eq!((bars.len(), bar.len()), (1, 3));
    assert!(near(length(bar[0], (0.0, 0.0)), 0.0) && near(length(bar[0], bar[1]), 12.5), "{bar:?}");
    assert!(near(length(bar[1], bar[2]), 58.0), "{bar:?}");

    // The roll turns the tip towards negative x.
    let (sine, cosine) = 20f64.to_radians().sin_cos();
    let radius_mm = LEAST_MM + 20.0;
    for (view, tip) in [(0, (-radius_mm * sine, radius_mm * cosine)), (1, (0.0, radius_mm * cosine))] {
        let body = lines(picture, "at the start", area(view));
        let [arm, segment] = &body[..] else { panic!("{body:?}") };
        assert!(near(length(mm(view, arm[1]), tip), 0.0), "{view}: {:?}", mm(view, arm[1]));
        let ends = (mm(view, segment[0]), mm(view, segment[segment.len() - 1]));
        assert!(near(length(ends.0, ends.1), 30.0) || view == 1, "{ends:?}");
        if view == 0 {
            let middle = (-(radius_mm - 30.0) * sine, (radius_mm - 30.0) * cosine);
            assert!(segment.iter().all(|at| near(length(mm(0, *at), middle), 30.0)), "{segment:?}");
        }
    }
}

#[test]
fn a_segment_that_falls_over_is_drawn_until_it_falls() {
    let path = "[[0, '20 mm', '50 deg', 0]]";
    let overrides = [("target.path", path), ("method.proportional", "0"), ("tilt_servo.coulomb", "0"), FAR];
    let drawn = Drawn::of(&parsed("gimbal-switch", &overrides));
    let Some(Verdict::Diverged { at_s, .. }) = drawn.summary.verdict else { panic!("{:?}", drawn.summary.verdict) };
    for picture in &drawn.pictures {
        assert_eq!(texts(&picture.svg)[0].text, format!("gimbal-switch: diverged, ended at {at_s:.2} s"));
        assert!(texts(&picture.svg)[1].text.contains("tilted by more than 55 degrees"));
        assert_readable(picture, "fallen");
    }
}

#[test]
fn values_that_are_no_numbers_are_left_out() {
    let scene = parsed("gimbal-switch", &[("run.duration", "20 ms")]);
    let drawn = Drawn::of(&scene);
    let simulation = GimbalSimulation::new(&scene).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for good in [0, 1, 5] {
            let mut trace = simulation.trace(&GIMBAL_NETS);
            trace.nets(Cycle(0), &vec![1; simulation.nets().len()]);
            for row in 0..10 {
                let values = if row < good { vec![0.05; 22] } else { vec![bad; 22] };
                trace.reals(Cycle(row * trace.edges_apart()), &values);
            }
            let pictures = gimbal_pictures(&simulation, &trace, &drawn.summary, COMMAND);
            assert_eq!(pictures.len(), 3);
            let is_within = |mark: &str| !attribute(mark, "points").is_some_and(|points| points.contains("NaN"));
            assert!(pictures.iter().all(|picture| elements(&picture.svg).all(|(_, mark)| is_within(mark))));
        }
    }
    let empty = simulation.trace(&GIMBAL_NETS);
    assert!(gimbal_pictures(&simulation, &empty, &drawn.summary, COMMAND).is_empty());
    // Widths of lines are told by the SVG too, so that a picture without a line is noticed.
    let widths = elements(&drawn.picture("motion").svg).filter(|(mark, _)| *mark == "polyline");
    assert!(widths.map(|(_, of)| number(of, "stroke-width")).any(|width| width == 6.0));
}
