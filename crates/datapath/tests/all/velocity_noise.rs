//! The error that the quantisation of the position makes in each velocity estimate, measured and compared with its
//! formula.
//!
//! A position at constant speed `v` counts per sample, `phase + v k`, is floored to counts. With phase and speed
//! uniform and independent, the fractions `q_k = phase + v k mod 1` are uniform and *pairwise* independent. So the
//! errors `e_k = 1/2 - q_k` are white with variance 1/12, exactly, and any linear estimate `sum h_k e_k` has mean 0 and
//! mean square `sum h_k^2 / 12`. (At one given speed the difference has the mean square error `f (1 - f)`, where `f` is
//! the fraction of `v`; its mean over `f` is 1/6 too.) Phases and speeds are words of 32 fraction bits, so that nothing
//! but the floor rounds.
//!
//! The tolerance is that of a mean square over `M` independent trials whose error never exceeds `e`. The variance of
//! this mean square is at most `E[error^4] / M <= e^2 E[error^2] / M`. Five standard deviations are allowed, which one
//! run in a million exceeds; the seed is fixed.
//!
//! Levant's differentiator is no linear estimate. It stands beside the filters, whose formulas enclose its noise and
//! bound its lag.

use hpu_datapath::{
    Block, EdgeTimer, FilteredConfig, FilteredDifference, Foaw, FoawConfig, LevantConfig, LevantDifferentiator,
    WindowDifference, edge_timer, filtered_difference, foaw, levant_differentiator, window_difference,
};

/// One count as a word of phases and speeds.
const COUNT: i64 = 1 << 32;

/// The upper bits of a linear congruential generator (Knuth's MMIX).
struct Draw(u64);

impl Draw {
    fn below(&mut self, bound: i64) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * u128::from(bound.unsigned_abs())) >> 64) as i64
    }
}

/// Returns the mean square of the errors of `trials` trials, each with a phase and a speed below one count per sample.
fn mean_square(trials: u32, mut error: impl FnMut(i64, i64) -> f64) -> f64 {
    let mut draw = Draw(1);
    (0..trials).map(|_| error(draw.below(COUNT), draw.below(COUNT)).powi(2)).sum::<f64>() / f64::from(trials)
}

/// Asserts that a mean square of errors, none of them greater than `most`, agrees with the formula within the
/// tolerance, and that the tolerance is less than a tenth of the formula.
fn assert_rms(measured: f64, formula: f64, most: f64, trials: u32) {
    let tolerance = 5.0 * most * (formula / f64::from(trials)).sqrt();
    assert!(tolerance < 0.1 * formula, "enough trials for {tolerance} of {formula}");
    assert!((measured - formula).abs() <= tolerance, "mean square {measured}, formula {formula} +- {tolerance}");
}

/// Returns the position at a sample, in counts modulo 2^12.
fn position(phase: i64, speed: i64, sample: i64) -> i64 {
    (phase + speed * sample).div_euclid(COUNT).rem_euclid(1 << 12)
}

fn counts(words: i64) -> f64 {
    words as f64 / COUNT as f64
}

#[test]
fn the_noise_of_a_filtered_difference_is_alpha_over_the_root_of_6_times_2_minus_alpha() {
    // The impulse response of (1 - z^-1) alpha / (1 - (1 - alpha) z^-1) is h = alpha, -alpha^2, -alpha^2 (1 - alpha),
    // .. With it, sum h^2 = 2 alpha^2 / (2 - alpha) and sum |h| = 2 alpha, so no error exceeds alpha. Shift 0 is the
    // backward difference, whose noise is Delta / (T sqrt 6).
    for (shift, samples, trials) in [(0, 2, 200_000), (1, 30, 100_000), (2, 60, 100_000), (4, 250, 40_000)] {
        let alpha = f64::from(1u32 << shift).recip();
        let config = FilteredConfig { shift, out_frac: 24, ..FilteredConfig::default() };
        let mut block = FilteredDifference::new(config).unwrap();
        let measured = mean_square(trials, |phase, speed| {
            block.reset();
            let mut velocity = 0;
            for sample in 0..samples {
                let position = position(phase, speed, sample);
                velocity = block.tick(filtered_difference::In { position, period: 1 }).velocity;
            }
            velocity as f64 / f64::from(1 << 24) - counts(speed)
        });
        // The start has decayed to (1 - alpha)^samples < 1e-6 counts; the floors make 2^shift words of 2^-24 at most.
        let formula = alpha * alpha / (6.0 * (2.0 - alpha));
        assert_rms(measured, formula, alpha + 2e-6, trials);
    }
}

#[test]
fn a_window_of_n_samples_resolves_one_nth_and_errs_by_that_over_the_root_of_6() {
    for window in [1, 2, 8, 64] {
        let trials = 50_000;
        let mut block = WindowDifference::new(12, 24, window).unwrap();
        let samples = f64::from(window);
        let measured = mean_square(trials, |phase, speed| {
            block.reset();
            let mut words = 0;
            for sample in 0..=i64::from(window) {
                let position = position(phase, speed, sample);
                words = block.tick(window_difference::In { position, period: 1 }).velocity;
            }
            // The result is one of the two words next to the speed, which are 1/n of a count per sample apart.
            let error = words as f64 / samples - counts(speed);
            assert!(error.abs() < 1.0 / samples);
            error
        });
        assert_rms(measured, 1.0 / (6.0 * samples * samples), 1.0 / samples, trials);
    }
}

#[test]
fn a_window_shows_the_speed_of_half_a_window_ago() {
    // For x = 3 k^2 the speed at k - n/2 is 6 k - 3 n, and the window shows n times this speed.
    for window in [1, 5, 8] {
        let mut block = WindowDifference::new(16, 24, window).unwrap();
        for sample in 0..100i64 {
            let input = window_difference::In { position: 3 * sample * sample, period: 1 };
            let velocity = block.tick(input).velocity;
            let window = i64::from(window);
            assert!(sample < window || velocity == window * (6 * sample - 3 * window));
        }
    }
}

#[test]
fn at_constant_speed_one_count_of_noise_explains_the_whole_window_of_foaw() {
    // The line through the ends of n samples misses the position j samples ago by |(1 - j/n) q_k + (j/n) q_{k-n} -
    // q_{k-j}|. All fractions are below 1, so it misses by less than a count. The error is therefore that of a window
    // of n: Delta / (nT sqrt 6).
    let (trials, window) = (50_000, 16);
    let config = FoawConfig { window, out_frac: 20, ..FoawConfig::default() };
    let mut block = Foaw::new(config).unwrap();
    let samples = f64::from(window);
    let measured = mean_square(trials, |phase, speed| {
        block.reset();
        let mut velocity = 0;
        for sample in 0..=i64::from(window) {
            let position = position(phase, speed, sample);
            velocity = block.tick(foaw::In { position, period: 1 }).velocity;
        }
        let ends = position(phase, speed, window.into()) - position(phase, speed, 0);
        assert_eq!(velocity, ends << 16, "a window of 16, in words of 2^-20");
        velocity as f64 / f64::from(1 << 20) - counts(speed)
    });
    assert_rms(measured, 1.0 / (6.0 * samples * samples), 1.0 / samples, trials);
}

/// Returns the interval that a timer shows after three counts with this spacing in clocks (a word of 32 fraction bits);
/// the first count comes at the given phase of the clock.
fn interval(phase: i64, spacing: i64) -> i64 {
    let mut block = EdgeTimer::new(12, 20).unwrap();
    let mut out = block.reset();
    // An edge sees all counts up to its time: a count at time t is seen at edge ceil(t).
    let seen = |count: i64| (phase + spacing * count + COUNT - 1).div_euclid(COUNT);
    for count in 0..3 {
        for _ in seen(count) + 1..seen(count + 1) {
            block.tick(edge_timer::In { position: count });
        }
        out = block.tick(edge_timer::In { position: count + 1 });
    }
    assert_eq!((out.stopped, out.forward), (0, 1));
    out.interval
}

#[test]
fn the_time_between_counts_errs_by_v_tau_over_delta_at_most_and_by_that_over_the_root_of_6_in_the_mean() {
    // A spacing of L clocks (v tau / Delta = 1/L) is measured as N = floor(L) or the next whole number. The speed f/N
    // is off by the share (L - N)/N of itself, which is less than 1/N. The fractions of the two ends are distributed
    // like those of a position, so E[(L - N)^2] = 1/6 over uniform L.
    let trials = 20_000;
    for slowest in [20, 100] {
        let measured = mean_square(trials, |phase, fraction| {
            let spacing = slowest * COUNT + fraction;
            let shown = interval(phase, spacing);
            let clocks = counts(spacing) - shown as f64;
            let relative = clocks / shown as f64;
            assert!(relative.abs() < 1.0 / shown as f64);
            clocks
        });
        assert_rms(measured, 1.0 / 6.0, 1.0, trials);
    }
}

#[test]
fn timing_counts_beats_counting_them_below_delta_over_the_root_of_t_tau_and_not_above() {
    // With a period T of 10 000 clocks, the methods are equal at one count in 100 clocks. At L clocks per count the
    // relative errors are 1/L for the time between counts and L/10 000 for counting. At L = 50 and L = 200 one error is
    // four times the other.
    let (period, trials) = (10_000, 4000);
    for (slowest, better) in [(200, true), (50, false)] {
        let timing = mean_square(trials, |phase, fraction| {
            let spacing = slowest * COUNT + fraction;
            counts(spacing) / interval(phase, spacing) as f64 - 1.0
        });
        let counting = mean_square(trials, |phase, fraction| {
            let spacing = i128::from(slowest * COUNT + fraction);
            let start = i128::from(phase) * spacing / i128::from(COUNT);
            let counted = |clock: i64| (start + i128::from(clock * COUNT)).div_euclid(spacing);
            let mut block = WindowDifference::new(12, 24, 1).unwrap();
            let mut at = |clock| {
                let position = counted(clock) as i64;
                block.tick(window_difference::In { position, period: 1 }).velocity
            };
            at(0);
            at(period) as f64 * spacing as f64 / (period as f64 * COUNT as f64) - 1.0
        });
        assert_eq!(timing < counting, better, "1 in {slowest}: timing {timing}, counting {counting}");
    }
}

/// The acceleration that Levant's differentiator is given, in counts per sample squared.
const BOUND: f64 = 1.0 / 64.0;

/// Returns Levant's differentiator with the gains `1.5 sqrt(L)` and `1.1 L` for [`BOUND`].
fn levant() -> LevantDifferentiator {
    let root_gain = (1.5 * BOUND.sqrt() * 256.0).round() as u32;
    let slew = (1.1 * BOUND * 65536.0).round() as u32;
    LevantDifferentiator::new(LevantConfig { out_frac: 16, root_gain, slew, ..LevantConfig::default() }).unwrap()
}

/// Returns its velocity after a sample, in counts per sample.
fn sampled(block: &mut LevantDifferentiator, position: i64) -> f64 {
    // The period exceeds the latency of 24 edges.
    let input = levant_differentiator::In { position: position.rem_euclid(1 << 12), period: 32 };
    let velocity = (0..32).map(|_| block.tick(input).velocity).last().unwrap();
    velocity as f64 / 65536.0
}

/// Returns the mean square of the error of a filtered difference, by the formula.
fn of_filter(shift: i32) -> f64 {
    let alpha = f64::from(1u32 << shift).recip();
    alpha * alpha / (6.0 * (2.0 - alpha))
}

#[test]
fn levant_at_constant_speed_is_quieter_than_a_filter_of_8_samples_and_louder_than_one_of_16() {
    // A sliding mode has no formula for its noise, but those of the two filters enclose it. From 0, the velocity is
    // there after 1 / (1.1 L) = 58 samples at most.
    let (mut block, trials, most) = (levant(), 20_000, 0.25);
    let measured = mean_square(trials, |phase, speed| {
        block.reset();
        let velocity = (0..400).map(|sample| sampled(&mut block, position(phase, speed, sample))).last().unwrap();
        let error = velocity - counts(speed);
        assert!(error.abs() < most, "{error}");
        error
    });
    // The tolerance of `assert_rms`.
    let tolerance = 5.0 * most * (measured / f64::from(trials)).sqrt();
    assert!(measured + tolerance < of_filter(3), "{measured} +- {tolerance}");
    assert!(measured - tolerance > of_filter(4), "{measured} +- {tolerance}");
}

/// Returns the error of Levant's velocity under a constant acceleration: its mean from sample 500 on, and the last one.
fn error_under(acceleration: f64) -> (f64, f64) {
    const PHASES: u32 = 100;
    const SAMPLES: u32 = 1500;
    let mut block = levant();
    let (mut sum, mut last) = (0.0, 0.0);
    for phase in 0..PHASES {
        block.reset();
        for sample in (0..SAMPLES).map(f64::from) {
            let at = f64::from(phase) / f64::from(PHASES) + 0.5 * acceleration * sample * sample;
            last = sampled(&mut block, at.floor() as i64) - acceleration * sample;
            sum += if sample >= 500.0 { last } else { 0.0 };
        }
    }
    (sum / f64::from(PHASES * (SAMPLES - 500)), last)
}

#[test]
fn levant_is_less_late_than_a_filter_of_more_noise_up_to_its_acceleration_and_loses_the_motion_beyond() {
    // Under an acceleration `a` a filter of weight 1/8 is late by (1 - 1/8) / (1/8) samples, and its difference by half
    // of one: its mean error is -7.5 a.
    for share in [0.25, 0.5, 0.75, 1.0] {
        let acceleration = share * BOUND;
        let (mean, _) = error_under(acceleration);
        assert!((-7.5 * acceleration..0.0).contains(&mean), "{share} L: late by {} samples", -mean / acceleration);
    }
    // The velocity grows by 1.1 L a sample at most. At 1.5 L it has lost 0.4 L in each of 1500 samples, if it has not
    // even grown as fast as it can.
    let (_, last) = error_under(1.5 * BOUND);
    assert!(last <= -0.4 * BOUND * 1500.0 + 1.0, "{last}");
}
