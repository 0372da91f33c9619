//! The verdict on drop tests whose rms is known.

use hpu_cosim::{Abort, PASSIVE_RMS_M, Trace, Verdict};
use hpu_signal::{Clock, Cycle, Observe};

fn judge_drop(heights_m: &[f64], aborted: Option<Abort>) -> Verdict {
    let mut trace = Trace::new(Clock::new(1_000_000).unwrap(), 1, vec![0], Vec::new());
    heights_m.iter().zip(0..).for_each(|(height_m, row)| trace.reals(Cycle(row), &[*height_m]));
    hpu_cosim::judge_drop(&trace, 0, aborted)
}

/// Returns ten seconds of a height at 1 kHz.
fn heights(height_m: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..10_000).map(height_m).collect()
}

#[test]
fn the_published_threshold_is_three_thousandths_of_a_centimetre() {
    assert_eq!(PASSIVE_RMS_M, 0.003e-2);
}

#[test]
fn a_tip_at_rest_is_passive_wherever_it_rests() {
    for height_m in [0.0, -0.02, 0.5] {
        let Verdict::Passive { rms_m } = judge_drop(&heights(|_| height_m), None) else { panic!("at rest") };
        // The mean of 3000 equal numbers is off by at most as many roundings.
        assert!(rms_m <= 3000.0 * f64::EPSILON * height_m.abs(), "{rms_m}");
    }
}

#[test]
fn thirty_micrometres_of_rms_divide_rest_from_chatter() {
    // Half of the rows are up and half down by a: the rms about the mean is a.
    let chatter = |amplitude_m: f64| {
        judge_drop(&heights(|row| -0.02 + if row % 2 == 0 { amplitude_m } else { -amplitude_m }), None)
    };
    let Verdict::Passive { rms_m } = chatter(29.999e-6) else { panic!("below") };
    assert!((rms_m - 29.999e-6).abs() < 1e-15);
    let Verdict::NonPassive { rms_m } = chatter(30.001e-6) else { panic!("above") };
    assert!((rms_m - 30.001e-6).abs() < 1e-15);
    // The mean of an uneven chatter is not its middle: with 1 row of 4 up by a, the rms is a sqrt(3) / 4.
    let uneven = judge_drop(&heights(|row| if row % 4 == 0 { 80e-6 } else { 0.0 }), None);
    let Verdict::NonPassive { rms_m } = uneven else { panic!("34.6 um") };
    assert!((rms_m - 80e-6 * 3f64.sqrt() / 4.0).abs() < 1e-15);
}

#[test]
fn the_last_three_seconds_of_ten_are_judged_and_no_row_before() {
    let fell = heights(|row| if row < 7000 { 1.0 } else { -0.25 });
    assert_eq!(judge_drop(&fell, None), Verdict::Passive { rms_m: 0.0 });
    let late = heights(|row| if row < 7001 { 1.0 } else { 0.0 });
    // One row of 3000 at 1 m: sqrt(2999) / 3000.
    let Verdict::NonPassive { rms_m } = judge_drop(&late, None) else { panic!("18 mm") };
    assert!((rms_m - 2999f64.sqrt() / 3000.0).abs() < 1e-12);
    // The last three of ten rows.
    let rows: Vec<f64> = [9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 1.0, 2.0, 3.0].to_vec();
    let Verdict::NonPassive { rms_m } = judge_drop(&rows, None) else { panic!("they differ") };
    assert!((rms_m - (2.0f64 / 3.0).sqrt()).abs() < 1e-15);
}

#[test]
fn a_trial_that_was_aborted_is_highly_unstable_whatever_its_rows_say() {
    let abort = Abort { at_s: 0.75, why: "the tip reached the opposite wall" };
    for rows in [heights(|_| 0.0), heights(|row| row as f64), vec![0.0], Vec::new()] {
        assert_eq!(judge_drop(&rows, Some(abort)), Verdict::HighlyUnstable { at_s: 0.75 });
    }
}

#[test]
fn a_motion_that_is_no_number_is_not_passive() {
    let lost = heights(|row| if row > 9000 { f64::NAN } else { 0.0 });
    assert!(matches!(judge_drop(&lost, None), Verdict::NonPassive { rms_m } if rms_m.is_nan()));
}
