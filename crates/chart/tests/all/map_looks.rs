//! Pictures of maps and of charts of speed: each colour, dot and line has the meaning that the key gives it.

use hpu_chart::{Picture, map_pictures, shares, speed};
use hpu_cosim::Control;
use hpu_cosim::scene::{OutcomeKind, Output, shipped, shipped_file};
use hpu_study::accuracy::{Chart, ContestantResult, Entry, Grade, Race, Share, Speed};
use hpu_study::map::{self, Cell, CellLimits, Curves, Displayed, Found, Map, Method};

use crate::colours::{SIGHTS, difference, seen};
use crate::looks::{assert_readable, attribute, elements, number, points, ramp, rectangle, rgb, texts};

const COMMAND: &str = "hpu map hybrid-wall --x 'wall.stiffness=0.1..6' -o /tmp/there/out";

/// Returns a map with made-up cells of so many methods: stiffer cells are worse, and every second inner cell was not
/// run.
fn made_up(methods: Vec<Method>, x: &str, y: &str) -> (Map, Vec<Found>) {
    let scene = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("a shipped scene");
    let axes = (x.parse().expect("an axis"), y.parse().expect("an axis"));
    let map = Map::new((scene.name, scene.text), &[], axes, methods, &mut shipped_file).expect("a map");
    let short = [("run.duration".to_string(), "20 ms".to_string())];
    let experiment = scene.parse(&short).expect("parses");
    let base = Cell::run(&experiment, CellLimits::default(), &Control::default()).expect("runs").expect("to its end");
    let cell = |index: usize| {
        let point = map.point(index);
        let place = (point.ix + point.iy + point.method) as f64 / (map.x.cells() + map.y.cells()) as f64;
        let (outcome, amplitude, frequency_hz) = match place {
            place if place < 0.4 => (OutcomeKind::Settled, None, None),
            place if place < 0.8 => (OutcomeKind::LimitCycle, Some(1e-3 * place), Some(100.0 * place)),
            _ => (OutcomeKind::Diverged, Some(1.0), None),
        };
        let contact_share = Some(if place < 0.2 { 0.0 } else { 1.0 });
        let felt = Displayed { stiffness: 1.0 - 0.5 * place, asked: 1.0 };
        let displayed = (0.2..0.4).contains(&place).then_some(felt);
        let dissipated_j = 0.1 + place;
        Cell { outcome, amplitude, frequency_hz, dissipated_j, displayed, contact_share, ..base.clone() }
    };
    let found = (0..map.len()).map(|index| match map.point(index) {
        point if point.ix % 2 == 1 && point.iy > 0 => Found::As(index - 1),
        _ => Found::Run(Ok(cell(index))),
    });
    let found = found.collect();
    (map, found)
}

fn one() -> Vec<Method> {
    vec!["scene:method.kind=conventional".parse().expect("a method")]
}

fn all() -> Vec<Method> {
    let scene = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("a shipped scene");
    Method::all(&scene.parse(&[]).expect("parses").axis().expect("an axis"))
}

fn drawn(map: &Map, found: &[Found]) -> Vec<Picture> {
    let curves: Vec<_> = (0..map.methods.len()).map(|method| Curves::new(map, method, &Control::new())).collect();
    map_pictures(map, found, &curves, COMMAND)
}

const X: &str = "wall.stiffness=0.1..6 N.m/rad:9:log";
const Y: &str = "method.sample_rate=0.2..20 kHz:7:log";

#[test]
fn maps_of_few_and_of_many_methods_are_readable_by_all() {
    for methods in [one(), all().into_iter().take(3).collect(), all().into_iter().take(5).collect(), all()] {
        let (map, found) = made_up(methods, X, Y);
        let pictures = drawn(&map, &found);
        let names: Vec<&str> = pictures.iter().map(|picture| picture.name).collect();
        assert_eq!(names, ["map", "amplitude", "frequency", "energy", "displayed-stiffness"]);
        for picture in &pictures {
            assert_readable(picture, &format!("{} methods", map.methods.len()));
            assert!(!picture.svg.contains("/tmp/"), "a folder of one's own in the foot");
        }
    }
}

#[test]
fn every_panel_has_ticks_and_the_units_of_its_axes() {
    let narrow = ("wall.stiffness=1.2..1.9 N.m/rad:9:log", "method.sample_rate=1..10000000 Hz:8:log");
    for (methods, (x, y)) in [(one(), (X, Y)), (all(), (X, Y)), (one(), narrow)] {
        let (map, found) = made_up(methods, x, y);
        for picture in drawn(&map, &found) {
            let texts = texts(&picture.svg);
            let count = |said: &str| texts.iter().filter(|text| text.text.ends_with(said)).count();
            assert_eq!(count("N\u{b7}m/rad"), map.methods.len(), "{}", picture.name);
            // The bar of frequencies also has a unit.
            assert_eq!(count("Hz") - count("cycle in Hz"), map.methods.len(), "{}", picture.name);
            for panel in panels(&picture.svg) {
                let [left, top, right, bottom] = panel;
                let ticks = |holds: &dyn Fn([f64; 4]) -> bool| {
                    texts.iter().filter(|text| text.text.parse::<f64>().is_ok() && holds(text.area)).count()
                };
                let below = ticks(&|[l, t, r, _]| t > bottom && t < bottom + 30.0 && r > left && l < right);
                let beside = ticks(&|[_, t, r, b]| r < left && r > left - 40.0 && b > top - 15.0 && t < bottom + 15.0);
                assert!(below >= 2 && beside >= 2, "{}: {below} and {beside} of {panel:?}", picture.name);
            }
        }
    }
}

/// Returns the frames of the panels: closed lines around cells.
fn panels(svg: &str) -> Vec<[f64; 4]> {
    let lines = elements(svg).filter(|(name, _)| *name == "polyline").map(|(_, mark)| points(mark));
    let frames = lines.filter(|points| points.len() == 5 && points[0] == points[4]);
    frames.map(|points| [points[0].0, points[0].1, points[2].0, points[2].1]).collect()
}

#[test]
fn cells_have_the_colours_of_the_bar_which_darkens_evenly_for_everybody() {
    let (map, found) = made_up(one(), X, Y);
    for picture in drawn(&map, &found).iter().skip(1) {
        let bar = ramp(&picture.svg);
        assert_eq!(bar.len(), 33, "{}", picture.name);
        let [left, top, right, bottom] = panels(&picture.svg)[0];
        let mut cells = 0;
        for (_, mark) in elements(&picture.svg).filter(|(name, _)| *name == "rect") {
            let [l, t, r, b] = rectangle(mark);
            if l >= left && r <= right && t >= top && b <= bottom {
                let color = rgb(attribute(mark, "fill").expect("a colour"));
                assert!(bar.contains(&color), "{}: {color:?} is not on the bar", picture.name);
                cells += 1;
            }
        }
        assert!(cells > 5, "{}", picture.name);
        for (sight, matrix) in &SIGHTS {
            let seen: Vec<_> = bar.iter().map(|color| seen(*color, matrix)).collect();
            assert!(seen.is_sorted_by(|a, b| a[0] > b[0]), "{sight}: {seen:?}");
            // The steps have similar sizes, within a factor of three of their mean.
            let steps: Vec<f64> = seen.windows(2).map(|pair| difference(pair[0], pair[1])).collect();
            let mean = steps.iter().sum::<f64>() / 32.0;
            assert!(steps.iter().all(|step| (mean / 3.0..3.0 * mean).contains(step)), "{sight}: {steps:?}");
        }
    }
}

#[test]
fn a_dot_is_a_run_and_a_line_is_where_the_outcome_changes() {
    for methods in [one(), all().into_iter().take(5).collect()] {
        let (map, found) = made_up(methods, X, Y);
        let runs = found.iter().filter(|found| matches!(found, Found::Run(_))).count();
        for picture in drawn(&map, &found).iter().filter(|picture| picture.name != "map") {
            let dots = elements(&picture.svg).filter(|(name, _)| *name == "circle").count();
            assert_eq!(dots, runs, "{}", picture.name);
            assert!(
                texts(&picture.svg).iter().any(|text| text.text.contains(&format!("the {runs} of {}", found.len())))
            );
            let lines = elements(&picture.svg).filter(|(name, _)| *name == "polyline").map(|(_, mark)| mark);
            let lines: Vec<_> = lines.filter(|mark| number(mark, "stroke-width") == 3.0).map(points).collect();
            // A whole line passes the point, or a dash that is not farther from it than dashes are from each other.
            let on = |x: f64, y: f64, whole: bool| {
                lines.iter().any(|ends| {
                    let [(x1, y1), (x2, y2)] = [ends[0], ends[1]];
                    let is_whole = (x1 - x2).abs().max((y1 - y2).abs()) > 6.0;
                    let spare = if whole { 1.0 } else { 7.0 };
                    let within = |a: f64, b: f64, of: f64| {
                        let spare = if a == b { 1.0 } else { spare };
                        (a.min(b) - spare..=a.max(b) + spare).contains(&of)
                    };
                    is_whole == whole && within(x1, x2, x) && within(y1, y2, y)
                })
            };
            let was_run = |index: usize| matches!(found[index], Found::Run(_));
            for (method, [left, top, right, bottom]) in panels(&picture.svg).into_iter().enumerate() {
                let (width, height) = ((right - left) / map.x.cells() as f64, (bottom - top) / map.y.cells() as f64);
                let index = |ix: usize, iy: usize| method * map.layer() + iy * map.x.cells() + ix;
                // A whole line lies between two runs; dashes lie where one of the two cells was not run.
                let check = |(x, y): (f64, f64), a: usize, b: usize| {
                    let (differ, seen) = (shown(&found, a) != shown(&found, b), was_run(a) && was_run(b));
                    assert_eq!(on(x, y, true), differ && seen, "{a} {b}");
                    assert_eq!(on(x, y, false), differ && !seen, "{a} {b}");
                };
                for iy in 0..map.y.cells() {
                    for ix in 1..map.x.cells() {
                        let side = (left + ix as f64 * width, bottom - (iy as f64 + 0.5) * height);
                        check(side, index(ix - 1, iy), index(ix, iy));
                    }
                }
                for iy in 1..map.y.cells() {
                    for ix in 0..map.x.cells() {
                        let side = (left + (ix as f64 + 0.5) * width, bottom - iy as f64 * height);
                        check(side, index(ix, iy - 1), index(ix, iy));
                    }
                }
            }
        }
    }
}

/// Returns the outcome of a cell that met the wall; `None` for a cell that did not.
fn shown(found: &[Found], index: usize) -> Option<OutcomeKind> {
    let cell = map::nearest(found, index).expect("every cell is known");
    (cell.contact_share != Some(0.0)).then_some(cell.outcome)
}

/// Returns the colours of the cells of a map's only panel, by their numbers.
fn colours_of_cells(map: &Map, svg: &str) -> Vec<[u8; 3]> {
    let [left, top, right, bottom] = panels(svg)[0];
    let (width, height) = ((right - left) / map.x.cells() as f64, (bottom - top) / map.y.cells() as f64);
    let fills: Vec<_> = elements(svg).filter(|(name, _)| *name == "rect").map(|(_, mark)| mark).collect();
    let of = |index: usize| {
        let (ix, iy) = (index % map.x.cells(), index / map.x.cells());
        let (x, y) = (left + (ix as f64 + 0.5) * width, bottom - (iy as f64 + 0.5) * height);
        let holds = |mark: &&&str| {
            let [l, t, r, b] = rectangle(mark);
            // A curve's marker is smaller than a cell.
            l <= x && x <= r && t <= y && y <= b && b - t > 0.5 * height
        };
        rgb(attribute(fills.iter().rfind(holds).expect("the page"), "fill").expect("a colour"))
    };
    (0..map.layer()).map(of).collect()
}

#[test]
fn cells_that_did_not_reach_the_wall_have_a_colour_of_their_own_and_none_is_settled() {
    let (map, found) = made_up(one(), X, Y);
    let pictures = drawn(&map, &found);
    let key = |name: &str| pictures[0].keys.iter().find(|key| key.name == name).expect("a key").color;
    for (index, color) in colours_of_cells(&map, &pictures[0].svg).into_iter().enumerate() {
        let name = match shown(&found, index) {
            None => "wall not reached",
            Some(OutcomeKind::Settled) => "settled",
            Some(OutcomeKind::LimitCycle) => "limit cycle",
            Some(_) => "diverged",
        };
        assert_eq!(color, key(name), "{name}: cell {index}");
    }
    let untouched = (0..found.len()).filter(|index| shown(&found, *index).is_none()).count();
    assert!(untouched > 3, "{untouched}");
    for picture in &pictures[1..] {
        assert!(texts(&picture.svg).iter().any(|text| text.text.contains("hatched: wall not reached")));
        let lines = elements(&picture.svg).filter(|(name, _)| *name == "polyline").map(|(_, mark)| points(mark));
        let slanted = lines.filter(|ends| ends.len() == 2 && ends[0].0 != ends[1].0 && ends[0].1 != ends[1].1);
        // Each line is drawn with a seam.
        assert_eq!(slanted.count(), 2 * untouched, "{}", picture.name);
    }
}

#[test]
fn a_map_of_walls_that_the_hand_falls_through_says_so() {
    let (map, mut found) = made_up(one(), X, Y);
    let head = |found: &[Found]| texts(&drawn(&map, found)[0].svg)[1].text.clone();
    assert!(!head(&found).contains("wrapped"));
    let settled = (0..found.len()).find(|index| shown(&found, *index) == Some(OutcomeKind::Settled));
    if let Found::Run(Ok(cell)) = &mut found[settled.expect("one settles")] {
        cell.product_wraps = std::num::NonZeroU32::new(2);
    }
    assert!(head(&found).ends_with("; product wrapped in 1 settled cell"), "{}", head(&found));
}

/// Returns a race of every contestant of a scene, with made-up errors and speeds.
fn race() -> Race {
    let scene = shipped().iter().find(|scene| scene.name == "friction-wall").expect("a shipped scene");
    Race::new((scene.name, scene.text), &[], &[], &mut shipped_file).expect("a race")
}

fn speed_of(motion_per_wall: f64) -> Speed {
    Speed { motion_s: motion_per_wall, walls_s: vec![1.0; 3], edges: 50_000_000, timed_s: None }
}

fn charted() -> Chart {
    let entries = race().contestants.into_iter().enumerate().map(|(index, contestant)| {
        let step_s = contestant.step_s.unwrap_or(1e-6);
        let less = contestant.family.matches('+').count() as f64;
        let (grade, motion_per_wall) = match contestant.name.as_str() {
            "events" => (Grade::Exact, 30.0),
            "clock" => (Grade::Exact, 0.8),
            _ if contestant.criterion == Some("routh") => (Grade::VerdictOnly, 4e7),
            _ if contestant.criterion.is_some() => (Grade::VerdictOnly, 2e3),
            _ if step_s > 99e-6 => (Grade::Wrong, 1e2 * 3f64.powf(less)),
            _ => (Grade::Off(1e-2 * (step_s * 1e6).powf(0.7)), 1e7 * step_s * 3f64.powf(less)),
        };
        // No two speeds are equal.
        let speed = speed_of(motion_per_wall * (1.0 + 1e-5 * index as f64));
        let row = ContestantResult {
            grade,
            errors: Vec::new(),
            outcome: Some(OutcomeKind::Settled),
            shortened_s: None,
            speed,
        };
        Entry { contestant, row: Ok(row) }
    });
    let outputs = vec![Output::Trace, Output::PeakPenetration, Output::Verdict];
    Chart { outcome: OutcomeKind::Settled, outputs, within: 0.01, entries: entries.collect() }
}

#[test]
fn charts_of_speed_are_readable_and_have_no_more_labels_than_can_be_read() {
    let chart = charted();
    let shares_of = |entry: &Entry| Share {
        contestant: entry.contestant.clone(),
        cells: 100,
        wrong: entry.contestant.family.len() % 7,
        speed: entry.row.as_ref().ok().map(|row| row.speed.clone()),
    };
    let all: Vec<Share> = chart.entries.iter().map(shares_of).collect();
    let (map, _) = made_up(one(), X, Y);
    let pictures = [speed("friction-wall", &chart, COMMAND), shares("friction-wall", &map, &all, COMMAND)];
    assert!(chart.entries.len() > 60, "{}", chart.entries.len());
    for picture in &pictures {
        assert_readable(picture, "speed");
        // Ticks, key and names; the names of the steps appear once, not once for each solver.
        let texts = texts(&picture.svg);
        assert!(texts.len() <= 70, "{}: {texts:#?}", texts.len());
        assert!(texts.iter().filter(|text| text.text == "1 \u{b5}s").count() <= 1);
    }
}

#[test]
fn a_point_far_from_all_others_stands_at_the_edge_with_its_value() {
    let picture = speed("friction-wall", &charted(), COMMAND);
    let texts = texts(&picture.svg);
    assert!(texts.iter().any(|text| text.text == "routh, at 4e7 \u{2192}"), "{texts:#?}");
    // The four decades of speed without any other contestant are not drawn.
    assert!(!texts.iter().any(|text| ["1e6", "1e7", "1e8"].contains(&text.text.as_str())), "{texts:#?}");
}

#[test]
fn an_axis_of_plain_numbers_has_the_unit_that_a_scene_takes_them_in() {
    for (x, y) in [
        ("wall.stiffness=1.2..1.9:9", "wall.position=1.2..2.2:8"),
        ("wall.stiffness=1.2..1.9 N.m/rad:9", "wall.position=1.2..2.2 rad:8"),
    ] {
        let (map, found) = made_up(one(), x, y);
        assert_eq!((map.unit(&map.x), map.unit(&map.y)), ("N.m/rad", "rad"));
        for picture in drawn(&map, &found) {
            let texts = texts(&picture.svg);
            for name in ["wall.stiffness in N\u{b7}m/rad", "wall.position in rad"] {
                assert!(texts.iter().any(|text| text.text == name), "{name} in {}", picture.name);
            }
        }
    }
}

#[test]
fn the_name_of_what_is_allowed_is_covered_by_no_other() {
    for (fast, off) in [(3e3, 0.87e-2), (4e3, 0.87e-2), (4e3, 1.3e-2), (5e3, 1.3e-2)] {
        let mut chart = charted();
        let few =
            ["events", "clock", "midpoint@1ms+law", "smoothed", "averaged", "loaded", "frictionless", "resistive"];
        chart.entries.retain(|entry| few.contains(&entry.contestant.name.as_str()));
        for entry in &mut chart.entries {
            if entry.contestant.name == "midpoint@1ms+law" {
                let row = entry.row.as_mut().expect("a row");
                (row.grade, row.speed) = (Grade::Off(off), speed_of(fast));
            }
        }
        let picture = speed("friction-wall", &chart, COMMAND);
        assert!(texts(&picture.svg).iter().any(|text| text.text == "midpoint, law, 1 ms"), "{fast}");
        assert_readable(&picture, &format!("{fast}"));
    }
}

#[test]
fn a_point_below_the_lowest_line_says_its_error() {
    let mut chart = charted();
    let entry = chart.entries.iter_mut().find(|entry| entry.contestant.name == "midpoint@20ns").expect("a rung");
    entry.row.as_mut().expect("a row").grade = Grade::Off(1e-9);
    let picture = speed("friction-wall", &chart, COMMAND);
    let texts = texts(&picture.svg);
    assert!(texts.iter().any(|text| text.text == "midpoint, 20 ns, 1e\u{2212}7 % \u{2193}"), "{texts:#?}");
    // No decade is drawn for this point alone.
    assert!(!texts.iter().any(|text| text.text == "1e\u{2212}7"), "{texts:#?}");
}
