//! Recordings of encoder counts as motions: they lie in the counts, and no motion in the counts is smoother.
//!
//! The oracle of smoothness is a bound that holds for every convex objective `f` with the gradient `g`: for any motion
//! `y` in the counts, `f(x) - f(y) <= g . (x - y)`, and the greatest value of the right side over all such `y` is a sum
//! with one term a point. So one product tells by how much a motion can be beaten at most.

use std::f64::consts::TAU;

use hpu_scene::{Encoder, Hand, Scene, SceneError, shipped, shipped_file};
use proptest::prelude::*;

/// Distance from the ends of a count that every position keeps, in counts.
const MARGIN: f64 = 1e-3;

fn scene(name: &str, set: &[(&str, &str)], csv: &str) -> Result<Scene, SceneError> {
    let shipped = shipped().iter().find(|scene| scene.name == name).unwrap();
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    let mut load = |file: &str| if csv.is_empty() { shipped_file(file) } else { Ok(csv.as_bytes().to_vec()) };
    Scene::parse(name, shipped.text, &set, &mut load)
}

/// Returns the points of a scene's path: times, and positions in counts.
fn points(scene: &Scene) -> (Vec<f64>, Vec<f64>) {
    let Hand::Prescribed { path } = &scene.hand else { panic!("a prescribed hand") };
    let count_rad = scene.encoder.count_rad();
    path.iter().map(|point| (point.time_s, point.angle_rad / count_rad)).unzip()
}

/// Returns the times and the positions, in counts, that a scene makes of a recording.
fn smoothed(recording: &[(f64, i64)]) -> (Vec<f64>, Vec<f64>) {
    let rows: String = recording.iter().map(|(time_s, count)| format!("{time_s},{count}\n")).collect();
    // A recording may begin anywhere, far from the wall.
    let anywhere = [("wall.wraps", "true"), ("hand.file", "{ path = \"x.csv\", to = 1e6 }")];
    points(&scene("qube-arm", &anywhere, &format!("time_s,count\n{rows}")).unwrap_or_else(|error| panic!("{error}")))
}

/// The sum of the squares of the third derivative of a motion, each times the time that it stands for.
struct Objective {
    sum: f64,
    /// The most by which a motion in the counts can have less.
    beaten_by: f64,
    /// The part of that which can be due to the rounding of the positions to `f64`.
    rounding: f64,
}

/// Returns the objective of a motion. Times are in mean intervals.
///
/// A position is rounded as an angle, with the count of the first point, and by [`points`]: three times half an ulp. If
/// each is off by `e`, a derivative with the factors `u` is off by at most `e sum |u|`, and the gradient at one of its
/// points by at most `2 weight |u| e sum |u|`. No point is more than a count from where it could be.
fn objective(times: &[f64], positions: &[f64], counts: &[i64]) -> Objective {
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let error = 1.5 * f64::EPSILON * positions.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (mut sum, mut slope, mut rounding) = (0.0, vec![0.0; positions.len()], 0.0);
    for at in 0..positions.len().saturating_sub(3) {
        let t: Vec<f64> = times[at..at + 4].iter().map(|time| time / mean).collect();
        // Newton's scheme of divided differences, of unit vectors too: their differences are the factors.
        let third = |mut x: [f64; 4]| {
            for order in 1..4 {
                for to in (order..4).rev() {
                    x[to] = (x[to] - x[to - 1]) / (t[to] - t[to - order]);
                }
            }
            6.0 * x[3]
        };
        // Differences of positions near 0 lose no digits.
        let value = third(std::array::from_fn(|k| positions[at + k] - positions[at]));
        let weight = (t[3] - t[0]) / 3.0;
        sum += weight * value * value;
        let units = [0, 1, 2, 3].map(|k| third(std::array::from_fn(|other| f64::from(u8::from(other == k)))));
        for (slope, unit) in slope[at..].iter_mut().zip(units) {
            *slope += 2.0 * weight * value * unit;
        }
        let sum_of_units: f64 = units.iter().map(|unit| unit.abs()).sum();
        rounding += 2.0 * weight * error * sum_of_units * sum_of_units;
    }
    let room = slope.iter().zip(positions).zip(counts).map(|((slope, x), count)| {
        let (low, high) = (*count as f64 + MARGIN, *count as f64 + 1.0 - MARGIN);
        slope.max(0.0) * (x - low) + (-slope).max(0.0) * (high - x)
    });
    Objective { sum, beaten_by: room.sum(), rounding }
}

/// Asserts that the motion lies in the counts, and that no motion in them is smoother by more than a millionth and what
/// the rounding of its positions can be worth.
fn assert_smoothest(recording: &[(f64, i64)]) {
    let (times, positions) = smoothed(recording);
    let counts: Vec<i64> = recording.iter().map(|(_, count)| *count).collect();
    assert!(times.iter().zip(recording).all(|(time, row)| *time == row.0));
    for (x, count) in positions.iter().zip(&counts) {
        assert_eq!(x.floor() as i64, *count, "{x} of {recording:?}");
    }
    let Objective { sum, beaten_by, rounding } = objective(&times, &positions, &counts);
    let none = 1e-9 * recording.len() as f64 + rounding;
    assert!(beaten_by <= 1e-6 * sum + none, "{sum} can be beaten by {beaten_by}, not {none}: {recording:?}");
}

#[test]
fn no_motion_in_six_counts_is_smoother_whatever_the_counts() {
    for times in [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [0.0, 0.3, 1.0, 1.1, 2.5, 4.0]] {
        for code in 0..3_i64.pow(6) {
            let count = |at: u32| code / 3_i64.pow(at) % 3 - 1;
            let recording: Vec<_> = times.iter().zip(0..).map(|(time, at)| (*time, count(at))).collect();
            assert_smoothest(&recording);
        }
    }
}

/// Two points of this recording are two milliseconds apart, others most of a second. Far from 0 its positions are
/// rounded to 1e-10 counts, which makes a difference there.
#[test]
fn no_motion_is_smoother_where_times_nearly_meet() {
    let recording = [
        (0.4157720351050533, 1),
        (0.49323382936777854, 3),
        (1.1539327068211338, 1),
        (1.4394201476627637, 1),
        (1.8104141808482832, 3),
        (2.1147056079737894, 0),
        (2.42273915690418, 5),
        (2.7508691447733717, 2),
        (3.438071058314719, 1),
        (4.179885798478826, 6),
        (4.535075523968745, 2),
        (5.440747439315757, 2),
        (5.850763601170724, -3),
        (6.456898086194954, 2),
        (6.487236932521332, 0),
        (6.4891949018987445, 0),
        (6.735434167052454, -1),
        (7.551485673883787, 2),
    ];
    for origin in [0, 911_424, -911_424] {
        assert_smoothest(&recording.map(|(time, count)| (time, count + origin)));
    }
}

#[test]
fn steps_that_come_little_way_and_objectives_of_nearly_0_end_too() {
    // Mehrotra's steps on the first recording return to where they were, if their second order counts in full.
    let cycle = [(0.0, -1), (0.1, -6), (0.47, -5), (0.57, -4), (1.038, -8), (1.638, -4), (1.738, -3), (2.72, 0)];
    assert_smoothest(&cycle);
    // A parabola goes through these counts, and two times are near: the system is singular but for tiny multipliers.
    assert_smoothest(&[(0.0, 0), (0.01, 0), (0.35, -1), (1.104, 4)]);
    assert_smoothest(&[(0.0, 0), (0.009, 0), (0.36, 5), (1.226, 9), (1.968, 5)]);
}

#[test]
fn fewer_points_than_a_third_difference_joins_lie_in_their_counts() {
    for points in 1..4 {
        assert_smoothest(&[(0.0, -3), (0.5, 2), (2.0, 7)][..points]);
    }
    // Three even points are a straight line.
    let (_, positions) = smoothed(&[(0.0, 0), (0.05, 10), (0.1, 20)]);
    assert!((positions[2] - 2.0 * positions[1] + positions[0]).abs() < 1e-9, "{positions:?}");
}

#[test]
fn the_counts_of_a_parabola_give_a_motion_without_a_third_derivative() {
    // 2000 samples, up to eight counts apart, far from 0.
    let count = |at: i64| (at * at) / 500 - at * 3 + 1_000_000;
    let recording: Vec<_> = (0..2000).map(|at| (at as f64 * 2e-3, count(at))).collect();
    let (times, positions) = smoothed(&recording);
    let counts: Vec<i64> = recording.iter().map(|row| row.1).collect();
    let sum = objective(&times, &positions, &counts).sum;
    assert!(sum < 1e-9, "{sum}");
    // The position is then known much better than to a count.
    for (x, at) in positions.iter().zip(0..) {
        let true_x = f64::from(at * at) / 500.0 - f64::from(at * 3) + 1e6;
        assert!((x - true_x).abs() < 1.0, "at {at}: {x}, {true_x}");
    }
}

#[test]
fn a_recording_at_rest_stays_in_its_count() {
    let (_, positions) = smoothed(&[(0.0, 7), (1.0, 7), (2.0, 7), (3.0, 7), (9.0, 7)]);
    assert!(positions.iter().all(|x| (x - 7.5).abs() < 1e-6), "{positions:?}");
}

#[test]
fn the_motion_of_a_real_encoder_has_the_recorded_counts_and_is_the_smoothest() {
    for file in ["arm-start.csv", "arm-stop.csv"] {
        let file = format!("../recordings/qube/{file}");
        let text = String::from_utf8(shipped_file(&file).unwrap()).unwrap();
        let row = |line: &str| {
            let (time, count) = line.split_once(',').unwrap();
            (time.parse().unwrap(), count.parse().unwrap())
        };
        let recording: Vec<(f64, i64)> = text.lines().skip(2).map(row).collect();
        assert_eq!(recording.len(), 2001);
        assert_smoothest(&recording);
    }
}

#[test]
fn a_count_is_that_of_the_encoder_of_the_scene() {
    let csv = "time_s,count\n0,1\n1,1\n2,1\n3,1\n";
    let of = |name, set: &[_]| scene(name, set, csv).unwrap();
    let wall = of("qube-arm", &[("encoder.lines", "100")]);
    assert!(matches!(wall.encoder, Encoder::Rotary { lines: 100 }));
    let Hand::Prescribed { path } = &wall.hand else { panic!("a prescribed hand") };
    assert!((path[0].angle_rad - 1.5 * TAU / 400.0).abs() < 1e-9);
    let hand = [("hand", "{ kind = \"spring_damper\", stiffness = 100, damping = 1, file = \"x.csv\" }")];
    let rail = of("levant-wall", &hand);
    let Hand::SpringDamper { path, .. } = &rail.hand else { panic!("a hand") };
    assert!((path[0].angle_rad - 1.5 * 20e-6).abs() < 1e-12);
}

#[test]
fn counts_without_a_motion_are_refused() {
    for (csv, said) in [
        (
            "time_s,count\n0,0\n1,999999999\n",
            "m.csv: the count 999999999 at 1 s; accepted with this encoder: -325949322 to 325949322",
        ),
        ("time_s,count\n0,0\n1,0.5\n", "m.csv:3: `0.5` is not a count; write a whole number"),
        ("time_s,voltage\n0,0\n", "m.csv:1: no column of positions with a unit: the header has `time_s`, `voltage`"),
    ] {
        let error = scene("qube-arm", &[("hand.file", "m.csv")], csv).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let set =
        [("encoder", "{}"), ("model.datapath", "linear"), ("hand", "{ kind = \"prescribed\", file = \"m.csv\" }")];
    let set = [&set[..], &[("method", "{ kind = \"conventional\", sample_rate = \"1 kHz\" }")]].concat();
    let error = scene("fast-velocity", &set, "time_s,count\n0,0\n").unwrap_err().to_string();
    assert!(error.contains("encoder.resolution: missing"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_motion_is_smoother_whatever_the_recording(
        steps in prop::collection::vec((-5i64..=5, 1e-3f64..1.0), 4..200),
        start in -1_000_000i64..1_000_000,
    ) {
        let mut row = (0.0, start);
        let recording: Vec<_> = steps
            .iter()
            .map(|(counts, seconds)| {
                row = (row.0 + seconds, row.1 + counts);
                row
            })
            .collect();
        assert_smoothest(&recording);
    }
}
