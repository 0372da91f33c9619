//! EPFL's haptic paddle: what the study calls measured, against the logs; a run beside a log.

use hpu_cosim::{Control, read_plain};

/// The log of the oscillation: times of its own clock from the first row on, of 350 us a tick, and degrees.
fn oscillation() -> Vec<(f64, f64)> {
    let log =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../testbench/recordings/epfl-paddle/limit-cycle-hall-p05.csv.gz");
    let bytes = read_plain(log.as_ref()).expect("the log");
    let text = String::from_utf8(bytes).expect("text");
    let rows = text.lines().filter_map(|line| line.split_once(','));
    rows.filter_map(|(tick, angle)| Some((350e-6 * tick.parse::<f64>().ok()?, 1e-4 * angle.parse::<f64>().ok()?)))
        .collect()
}

#[test]
fn the_figures_of_the_oscillation_are_those_of_its_log() {
    let rows = oscillation();
    let begin = rows[0].0;
    let late: Vec<(f64, f64)> = rows.into_iter().filter(|(t, _)| (2.0..10.0).contains(&(t - begin))).collect();
    let middle = late.iter().map(|(_, angle)| angle).sum::<f64>() / late.len() as f64;
    let rises: Vec<f64> = late
        .windows(2)
        .filter(|pair| pair[0].1 < middle && pair[1].1 >= middle)
        .map(|pair| pair[0].0 + (middle - pair[0].1) / (pair[1].1 - pair[0].1) * (pair[1].0 - pair[0].0))
        .collect();
    let period_ms = 1e3 * (rises[rises.len() - 1] - rises[0]) / (rises.len() - 1) as f64;
    assert!((period_ms - 1e3 / 11.284).abs() < 0.1, "{period_ms} ms");
    // Half of the range of each period, and their mean.
    let swings = rises.windows(2).map(|ends| {
        let angles = late.iter().filter(|(t, _)| (ends[0]..ends[1]).contains(t)).map(|(_, angle)| *angle);
        let [low, high] = angles.fold([f64::MAX, f64::MIN], |[low, high], angle| [low.min(angle), high.max(angle)]);
        0.5 * (high - low)
    });
    let swing = swings.sum::<f64>() / (rises.len() - 1) as f64;
    assert!((swing - 13.807).abs() < 0.05, "{swing} degrees");
}

#[test]
fn steps_that_nothing_was_fitted_on_are_within_four_counts_of_their_logs() {
    let study = hpu_papers::studies::shipped("epfl-paddle");
    // The third by the filtered angle, as logged.
    for what in ["Kp 0.05, Kd 0.0008", "Kp 0.05, Ki 0.2857 a second, Kd 0.0008"] {
        let line = study.lines.iter().find(|line| line.what == what).expect("a line");
        let found = (line.measure)(&Control::default()).expect("not stopped").expect("measured");
        let [rms, peak] = [0, 1].map(|index| found.figures[index]);
        assert!(rms < 0.048 && peak.abs() < 0.008, "{what}: {rms} degrees, {peak}");
    }
}
