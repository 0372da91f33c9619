//! The verdict on motions whose amplitude and frequency are known.

use std::f64::consts::TAU;

use hpu_cosim::{Trace, Verdict, judge, unseen_growth_per_s};
use hpu_signal::{Clock, Cycle, Observe};

/// One encoder count.
const COUNT_RAD: f64 = 1e-3;
/// Ten seconds of rows at 10 kHz.
const ROWS: u64 = 100_000;

fn verdict(angle_rad: impl Fn(f64) -> f64) -> Verdict {
    let clock = Clock::new(1_000_000).unwrap();
    let mut trace = Trace::new(clock, 100, vec![2], Vec::new());
    for row in 0..ROWS {
        let cycle = Cycle(100 * row);
        trace.reals(cycle, &[0.0, 0.0, angle_rad(clock.seconds(cycle)), 0.0]);
    }
    judge(&trace, 2, COUNT_RAD)
}

#[track_caller]
fn near(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

#[test]
fn a_sine_is_a_limit_cycle_of_its_amplitude_and_frequency() {
    for (frequency_hz, offset_rad) in [(1.0, 0.0), (48.0, 0.3), (235.0, -2.0)] {
        let Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz: found_hz } =
            verdict(|t| offset_rad + 0.02 * (TAU * frequency_hz * t + 0.4).sin())
        else {
            panic!("a sine swings");
        };
        // Whole periods in the last 3 s: rms A/√2. A row lies within half an interval of the peak: 1 - cos(π f /
        // f_rows).
        near(rms_rad, 0.02 / 2f64.sqrt(), 1e-9);
        near(amplitude_rad, 0.02, 1.0 - (0.5 * TAU * frequency_hz / 1e4).cos() + 1e-12);
        // Both ends of the count are known to one row: two of the 30000 rows less a period.
        near(found_hz, frequency_hz, 2.0 / (3e4 - 1e4 / frequency_hz));
    }
}

#[test]
fn one_count_of_rms_divides_rest_from_a_limit_cycle() {
    let sine = |rms_rad: f64| verdict(|t| 1.0 + rms_rad * 2f64.sqrt() * (TAU * 50.0 * t).sin());
    let Verdict::Settled { rms_rad } = sine(0.999e-3) else { panic!("below a count") };
    near(rms_rad, 0.999e-3, 1e-9);
    assert!(matches!(sine(1.001e-3), Verdict::LimitCycle { .. }));
}

#[test]
fn a_decay_settles_once_the_last_three_seconds_are_quiet() {
    let swing = |rate: f64| verdict(|t| 0.5 + 0.1 * (-rate * t).exp() * (TAU * 20.0 * t).sin());
    // 0.1 e^-7 = 9e-5 from 7 s on; 0.1 e^-0.7 is fifty counts.
    assert!(matches!(swing(1.0), Verdict::Settled { .. }));
    assert!(matches!(swing(0.1), Verdict::NotTold { .. }));
}

#[test]
fn growth_by_half_from_one_half_of_the_window_to_the_other_is_divergence() {
    // The halves end 1.5 s apart: peaks grow by e^(1.5 r).
    let swing = |rate: f64| verdict(|t| 1e-2 * (rate * (t - 10.0)).exp() * (TAU * 100.0 * t).sin());
    let threshold = 1.5f64.ln() / 1.5;
    let Verdict::Diverged { at_s, amplitude_rad } = swing(1.05 * threshold) else { panic!("it grows") };
    near(at_s, 7.0, 1e-4);
    // The last peak is within a period, 10 ms, of the end.
    near(amplitude_rad, 1e-2, 0.01);
    assert!(matches!(swing(0.95 * threshold), Verdict::LimitCycle { .. }));
}

#[test]
fn a_swing_within_a_count_that_grows_has_not_settled() {
    // The quarters of the 3 s end 2.25 s apart: peaks grow by e^(2.25 r). At the end they are a hundredth of a count.
    let swing = |rate: f64| verdict(|t| 1.0 + 1e-5 * (rate * (t - 10.0)).exp() * (TAU * 100.0 * t).sin());
    let seen = unseen_growth_per_s(3.0);
    near(seen, 1.5f64.ln() / 2.25, 1e-12);
    let Verdict::Diverged { at_s, amplitude_rad } = swing(1.05 * seen) else { panic!("it grows") };
    near(at_s, 7.0, 1e-4);
    near(amplitude_rad, 1e-5, 0.01);
    assert!(matches!(swing(0.95 * seen), Verdict::Settled { .. }));
    assert!(matches!(swing(-2.0), Verdict::Settled { .. }));
}

#[test]
fn a_step_or_a_drift_within_a_count_is_no_growth() {
    // Stuck, then released by half a count at 9.9 s; and a steady drift.
    assert!(matches!(verdict(|t| if t > 9.9 { 0.5 * COUNT_RAD } else { 0.0 }), Verdict::Settled { .. }));
    assert!(matches!(verdict(|t| 0.1 * COUNT_RAD * t), Verdict::Settled { .. }));
    // A ripple that creeps up by a thousandth, with one kick at the end.
    let ripple = |t: f64| 3.5e-5 * (1.0 + 1e-4 * t) * (TAU * 500.0 * t).sin() + if t > 9.95 { 3e-5 } else { 0.0 };
    assert!(matches!(verdict(ripple), Verdict::Settled { .. }));
    // The rounding of an angle of 40 rad is 7e-15 rad.
    assert!(matches!(verdict(|t| 40.0 + 1e-14 * (t * t * 97.0).sin() * t), Verdict::Settled { .. }));
}

#[test]
fn noise_about_an_offset_is_rest_however_large_the_offset() {
    // A fixed sequence of full period 65536, uniform within two counts: rms 2 / √12 of a count.
    let noise = |t: f64| {
        let row = (t * 1e4).round() as u32;
        let bits = row.wrapping_mul(40_503) & 0xffff;
        (f64::from(bits) / 65_536.0 - 0.5) * 2.0 * COUNT_RAD
    };
    for offset_rad in [0.0, 1.5, -40.0] {
        let Verdict::Settled { rms_rad } = verdict(|t| offset_rad + noise(t)) else { panic!("noise of half a count") };
        near(rms_rad, 2.0 * COUNT_RAD / 12f64.sqrt(), 0.01);
    }
}

#[test]
fn noise_of_a_sixth_of_the_amplitude_does_not_change_the_frequency() {
    let noise = |t: f64| {
        let bits = ((t * 1e4).round() as u32).wrapping_mul(40_503) & 0xffff;
        (f64::from(bits) / 65_536.0 - 0.5) / 3.0
    };
    let Verdict::LimitCycle { frequency_hz, .. } = verdict(|t| 0.02 * ((TAU * 30.0 * t).sin() + noise(t))) else {
        panic!("it swings");
    };
    // The noise moves a passage by asin(1/6) of the 2 π of a period: 9 rows at 30 Hz; at both ends of 89 periods.
    near(frequency_hz, 30.0, 2.0 * 9.0 / 29_667.0);
}

#[test]
fn a_passage_counts_after_a_quarter_of_the_amplitude_below_the_mean() {
    // A period of 1000 rows, 10 Hz: high, a dip of 100 rows to `depth` hundredths below the mean, high, low. The number
    // of high rows exceeds that of low rows so that the mean stays 0 in spite of the dip; the amplitude is 1.
    let dips = |depth: u64| {
        let low = (900 - depth) / 2;
        assert_eq!(2 * low + depth + 100, 1000);
        let found = verdict(|t| match (t * 1e4).round() as u64 % 1000 {
            200..300 => -0.01 * depth as f64,
            row if row < 1000 - low => 1.0,
            _ => -1.0,
        });
        let Verdict::LimitCycle { amplitude_rad, frequency_hz, .. } = found else { panic!("it swings") };
        near(amplitude_rad, 1.0, 1e-12);
        frequency_hz
    };
    // One passage per period after the low rows alone, two if the dip counts too: 59 passages in 29 periods and part of
    // one.
    near(dips(24), 10.0, 1e-9);
    near(dips(26), 20.0, 0.03);
}

#[test]
fn a_motion_that_is_no_number_has_diverged() {
    let Verdict::Diverged { amplitude_rad, .. } = verdict(|t| if t > 9.0 { f64::NAN } else { 0.0 }) else {
        panic!("not a number");
    };
    assert_eq!(amplitude_rad, f64::INFINITY);
}

/// Returns the verdict on a motion that is recorded at 1 kHz for this time.
fn verdict_after(duration_s: f64, angle_rad: &dyn Fn(f64) -> f64) -> Verdict {
    let clock = Clock::new(1_000_000).unwrap();
    let mut trace = Trace::new(clock, 1000, vec![2], Vec::new());
    for row in 0..=(1e3 * duration_s).round() as u64 {
        let cycle = Cycle(1000 * row);
        trace.reals(cycle, &[0.0, 0.0, angle_rad(clock.seconds(cycle)), 0.0]);
    }
    judge(&trace, 2, COUNT_RAD)
}

/// Checks that a motion is not told after 10 s, that it tells after the duration that is said, if one is, and returns
/// this duration.
#[track_caller]
fn told_later(angle_rad: &dyn Fn(f64) -> f64, settles: bool) -> Option<f64> {
    let found = verdict_after(10.0, angle_rad);
    let Verdict::NotTold { telling_s, .. } = found else { panic!("{found:?}") };
    if let Some(telling_s) = telling_s {
        assert!(telling_s > 10.0, "{telling_s}");
        let later = verdict_after(telling_s, angle_rad);
        let is_right = match later {
            Verdict::Settled { .. } => settles,
            Verdict::LimitCycle { .. } => !settles,
            _ => false,
        };
        assert!(is_right, "after {telling_s} s: {later:?}");
    }
    telling_s
}

/// Powers of ten from one number to another, in so many steps.
fn decades(from: f64, to: f64, steps: u32) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |step| from * (to / from).powf(f64::from(step) / f64::from(steps)))
}

#[test]
fn creep_toward_rest_is_not_told_and_the_duration_that_is_said_tells() {
    let mut not_told = 0;
    for tau_s in decades(0.3, 100.0, 25) {
        for left_rad in decades(2e-4, 2.0, 8) {
            // `left_rad` from rest after 10 s, from either side.
            for sign in [1.0, -1.0] {
                let creep = |t: f64| 0.7 + sign * left_rad * (-(t - 10.0) / tau_s).exp();
                // Mean and mean square of the exponential from 7 s to 10 s, in closed form.
                let mean = |of: f64| of / 3.0 * ((3.0 / of).exp() - 1.0);
                let rms_rad = left_rad * (mean(tau_s / 2.0) - mean(tau_s).powi(2)).sqrt();
                match rms_rad / COUNT_RAD {
                    ..0.99 => assert!(matches!(verdict_after(10.0, &creep), Verdict::Settled { .. }), "{rms_rad}"),
                    1.01.. => {
                        told_later(&creep, true).expect("an exponential says when it ends");
                        not_told += 1;
                    }
                    _ => {}
                }
            }
        }
    }
    assert!(not_told > 100, "{not_told}");
}

#[test]
fn a_decaying_swing_is_not_told_and_the_duration_that_is_said_tells() {
    let (mut said, mut silent) = (0, 0);
    for tau_s in decades(1.0, 20.0, 8) {
        for frequency_hz in decades(0.02, 60.0, 14) {
            for phase in [0.0, 1.0, 2.5, 4.0] {
                let angle = |t: f64| TAU * frequency_hz * t + phase;
                let swing = |t: f64| 0.3 + 0.5 * (-(t - 10.0) / tau_s).exp() * angle(t).cos();
                match told_later(&swing, true) {
                    Some(_) => said += 1,
                    // Only of a part of a period it is not known when it ends.
                    None => {
                        assert!(frequency_hz * 3.0 < 2.0, "{frequency_hz} Hz, {tau_s} s");
                        silent += 1;
                    }
                }
            }
        }
    }
    assert!(said > 200 && silent > 50, "{said}, {silent}");
}

#[test]
fn a_swing_that_falls_on_a_creeping_place_is_not_told() {
    for frequency_hz in [0.8, 1.1, 1.9, 7.0] {
        let falls = |t: f64| 0.05 * (-t / 9.0).exp() * (TAU * frequency_hz * t).sin() + 0.004 * (-t / 9.0).exp();
        told_later(&falls, true).expect("its swings say when it ends");
    }
}

#[test]
fn a_beat_is_a_limit_cycle() {
    for phase in [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
        // A beat that comes back within the window, and a slow one by less than a tenth.
        for (beat_hz, depth) in [(0.4, 0.3), (0.7, 0.8), (1.3, 0.5), (0.1, 0.04), (0.02, 0.04)] {
            let beat = |t: f64| 0.05 * (1.0 + depth * (TAU * beat_hz * t + phase).sin()) * (TAU * 40.0 * t).sin();
            let found = verdict_after(10.0, &beat);
            assert!(matches!(found, Verdict::LimitCycle { .. }), "{beat_hz} Hz, {depth}, {phase}: {found:?}");
        }
        // A slow and deep one looks like a decay while it falls. It never counts as rest.
        let slow = |t: f64| 0.05 * (1.0 + 0.5 * (TAU * 0.05 * t + phase).sin()) * (TAU * 40.0 * t).sin();
        let found = verdict_after(10.0, &slow);
        if let Verdict::NotTold { telling_s: Some(telling_s), .. } = found {
            let later = verdict_after(telling_s, &slow);
            assert!(matches!(later, Verdict::LimitCycle { .. } | Verdict::Diverged { .. }), "{phase}: {later:?}");
        }
        assert!(!matches!(found, Verdict::Settled { .. }), "{phase}: {found:?}");
    }
}

#[test]
fn a_steady_swing_of_any_phase_and_few_periods_is_a_limit_cycle() {
    // From two periods in the window on.
    for frequency_hz in decades(0.7, 20.0, 60) {
        for phase in [0.0, 0.8, 1.6, 2.4, 3.2, 4.0, 4.8, 5.6] {
            let found = verdict_after(10.0, &|t| 0.02 * (TAU * frequency_hz * t + phase).sin());
            let Verdict::LimitCycle { frequency_hz: found_hz, .. } = found else {
                panic!("{frequency_hz} Hz, {phase}: {found:?}")
            };
            near(found_hz, frequency_hz, 0.01);
        }
    }
}

#[test]
fn less_than_a_period_is_neither_a_limit_cycle_nor_divergence() {
    for step in 0..32 {
        let phase = TAU * f64::from(step) / 32.0;
        // A sixth of a period in the window, of half a period in the run.
        let found = verdict_after(10.0, &|t| 0.1 * (TAU * t / 20.0 + phase).cos());
        let is_new = |from: f64, to: f64| {
            // Where the later half of the window is beyond all that came before, it may be divergence.
            let values = |from: f64, to: f64| {
                let rows = (0..=1000).map(move |row| from + (to - from) * f64::from(row) / 1000.0);
                let x = rows.map(move |t| (TAU * t / 20.0 + phase).cos());
                x.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)])
            };
            let (before, after) = (values(0.0, from), values(from, to));
            after[0] < before[0] || after[1] > before[1]
        };
        match found {
            Verdict::NotTold { .. } => {}
            Verdict::Diverged { .. } => assert!(is_new(8.5, 10.0), "{phase}: {found:?}"),
            _ => panic!("{phase}: {found:?}"),
        }
    }
}

#[test]
fn a_drift_is_not_told_and_a_run_away_has_diverged() {
    assert!(matches!(verdict_after(10.0, &|t| 0.1 * t), Verdict::NotTold { telling_s: None, .. }));
    assert!(matches!(verdict_after(10.0, &|t| 1e-6 * t.powi(6)), Verdict::Diverged { .. }));
    assert!(matches!(verdict_after(10.0, &|t| 1e-6 * (2.0 * t).exp()), Verdict::Diverged { .. }));
}

#[test]
fn noise_of_more_than_a_count_swings_to_the_end() {
    let noise = |t: f64| {
        let bits = ((t * 1e3).round() as u32).wrapping_mul(40_503) & 0xffff;
        (f64::from(bits) / 65_536.0 - 0.5) * 8.0 * COUNT_RAD
    };
    assert!(matches!(verdict_after(10.0, &noise), Verdict::LimitCycle { .. }));
    // It ends as noise when what it lies on has come to rest.
    told_later(&|t| 0.5 + 0.2 * (-(t - 10.0) / 4.0).exp() + noise(t), false).expect("the creep says when it ends");
}
