//! Recordings of encoder counts as motions: they lie in the counts, and no motion in the counts is smoother.
//!
//! The oracle of smoothness is a bound that holds for every convex objective `f` with the gradient `g`: for any motion
//! `y` in the counts, `f(x) - f(y) <= g . (x - y)`, and the greatest value of the right side over all such `y` is a sum
//! with one term a point. So one product tells by how much a motion can be beaten at most.

use std::f64::consts::TAU;

use hpu_cosim::scene::{Encoder, Hand, Scene, SceneError, shipped, shipped_file};
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
    points(&scene("qube-arm", &[], &format!("time_s,count\n{rows}")).unwrap_or_else(|error| panic!("{error}")))
}

/// Returns the sum of the squares of the third derivative, each times the time that it stands for, and the most by
/// which a motion in the counts can have less. Times are in mean intervals.
fn objective(times: &[f64], positions: &[f64], counts: &[i64]) -> (f64, f64) {
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let (mut sum, mut slope) = (0.0, vec![0.0; positions.len()]);
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
        for k in 0..4 {
            let unit = third(std::array::from_fn(|other| f64::from(u8::from(other == k))));
            slope[at + k] += 2.0 * weight * value * unit;
        }
    }
    let room = slope.iter().zip(positions).zip(counts).map(|((slope, x), count)| {
        let (low, high) = (*count as f64 + MARGIN, *count as f64 + 1.0 - MARGIN);
        slope.max(0.0) * (x - low) + (-slope).max(0.0) * (high - x)
    });
    (sum, room.sum())
}

/// Asserts that the motion lies in the counts, and that no motion in them is smoother by more than a millionth.
fn assert_smoothest(recording: &[(f64, i64)]) {
    let (times, positions) = smoothed(recording);
    let counts: Vec<i64> = recording.iter().map(|(_, count)| *count).collect();
    assert!(times.iter().zip(recording).all(|(time, row)| *time == row.0));
    for (x, count) in positions.iter().zip(&counts) {
        assert_eq!(x.floor() as i64, *count, "{x} of {recording:?}");
    }
    let (sum, beaten_by) = objective(&times, &positions, &counts);
    let none = 1e-9 * recording.len() as f64;
    assert!(beaten_by <= 1e-6 * sum + none, "{sum} can be beaten by {beaten_by}: {recording:?}");
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

#[test]
fn fewer_points_than_a_third_difference_joins_lie_in_their_counts() {
    for points in 1..4 {
        assert_smoothest(&[(0.0, -3), (0.5, 2), (2.0, 7)][..points]);
    }
}

#[test]
fn the_counts_of_a_parabola_give_a_motion_without_a_third_derivative() {
    // 2000 samples, up to eight counts apart, far from 0.
    let count = |at: i64| (at * at) / 500 - at * 3 + 1_000_000;
    let recording: Vec<_> = (0..2000).map(|at| (at as f64 * 2e-3, count(at))).collect();
    let (times, positions) = smoothed(&recording);
    let counts: Vec<i64> = recording.iter().map(|row| row.1).collect();
    let (sum, _) = objective(&times, &positions, &counts);
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
        (
            "time_s,counts\n0,0\n",
            "m.csv:1: the header `time_s,counts` is not known; write `time_s,angle_rad`, \
                                  `time_s,angle_deg` or `time_s,count`",
        ),
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
