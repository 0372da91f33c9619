//! The velocity estimators compared with models that remember all positions and compute in plain integers, and FOAW
//! compared with the published algorithm in SI units.

use crate::cases::cases;
use crate::oracle::{Twisting, butterworth_model, filtered_model, foaw_model, timer_model, window_model};
use hpu_datapath::{
    AnyBlock, Block, ButterworthConfig, ButterworthDifference, EdgeTimer, FilteredConfig, FilteredDifference, Foaw,
    FoawConfig, LevantConfig, LevantDifferentiator, WindowDifference, edge_timer, foaw, levant_differentiator,
};
use hpu_signal::Rounding;
use proptest::prelude::*;

/// The velocity after all positions sampled so far, the latest last.
type Model<'a> = &'a dyn Fn(&[i64]) -> i64;

/// Runs every position as a sample, followed by `period - 1` edges of another position that the block must ignore.
fn samples_like(block: &mut dyn AnyBlock, model: Model, positions: &[i64], period: i64) {
    assert_eq!(block.reset(), [0]);
    for sampled in 1..=positions.len() {
        let latest = positions[sampled - 1];
        let expected = model(&positions[..sampled]);
        assert_eq!(block.tick(&[latest, period]), [expected], "after {:?}, period {period}", &positions[..sampled]);
        for _ in 1..period {
            assert_eq!(block.tick(&[latest ^ 1, period]), [expected]);
        }
    }
}

/// Runs every history of `samples` positions of `width` bits.
fn every_history(block: &mut dyn AnyBlock, model: Model, samples: u32, width: u32) {
    for history in 0..1i64 << (samples * width) {
        let positions: Vec<_> = (0..samples).map(|sample| history >> (sample * width) & ((1 << width) - 1)).collect();
        samples_like(block, model, &positions, 1);
    }
}

#[test]
fn the_filter_answers_every_short_history_as_the_recursion_says() {
    for (shift, out_frac) in [(0, 0), (0, 2), (1, 0), (2, 3), (5, 1)] {
        let config = FilteredConfig { width: 4, period_width: 4, shift, out_frac, ..FilteredConfig::default() };
        every_history(&mut FilteredDifference::new(config).unwrap(), &filtered_model(config), 4, 4);
    }
}

#[test]
fn the_filter_rounds_its_steps_in_every_way_as_the_recursion_says() {
    for rounding in Rounding::ALL {
        for (shift, out_frac) in [(1, 0), (2, 3)] {
            for weight in 1..=1 << shift {
                let config = FilteredConfig { width: 4, period_width: 4, shift, weight, out_frac, rounding };
                every_history(&mut FilteredDifference::new(config).unwrap(), &filtered_model(config), 3, 4);
            }
        }
    }
}

/// The words of a fifth, a quarter and 47 % of the sample rate.
const SECTIONS: [(u32, i32); 3] = [(221_805_086, -396_777_000), (1 << 28, 0), (939_720_690, 1_862_647_611)];

#[test]
fn the_second_order_answers_every_short_history_as_the_recursion_says() {
    for (b0, a1) in SECTIONS {
        for (guard, out_frac) in [(0, 0), (3, 2), (1, 4)] {
            let config = ButterworthConfig { width: 3, period_width: 4, b0, a1, guard, out_frac };
            every_history(&mut ButterworthDifference::new(config).unwrap(), &butterworth_model(config), 4, 3);
        }
    }
}

#[test]
fn the_window_answers_every_short_history_as_the_two_ends_say() {
    for window in 1..7 {
        every_history(&mut WindowDifference::new(3, 4, window).unwrap(), &window_model(3, window as usize), 5, 3);
    }
}

#[test]
fn foaw_answers_every_short_history_as_its_windows_say() {
    for (window, noise, out_frac) in [(2, 0, 0), (3, 1, 1), (4, 1, 4), (5, 2, 3)] {
        let config = FoawConfig { width: 3, period_width: 4, window, noise, out_frac };
        every_history(&mut Foaw::new(config).unwrap(), &foaw_model(config), 5, 3);
    }
}

/// Returns positions that mostly walk and now and then jump, so that lines, bends and wraps occur.
fn walk(width: u32, length: usize) -> impl Strategy<Value = Vec<i64>> {
    let step = (any::<i64>(), -3i64..4, 0u32..12);
    prop::collection::vec(step, 1..length).prop_map(move |steps| {
        let (mut position, mut speed) = (0i64, 0);
        let walked = steps.into_iter().map(|(jump, change, kind)| {
            speed = if kind < 3 { speed + change } else { speed };
            position = if kind == 11 { jump } else { position.wrapping_add(speed) };
            position & ((1 << width) - 1)
        });
        walked.collect()
    })
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_filter_follows_the_recursion(
        positions in walk(40, 60), shift in 0u32..17, part in 0.0f64..1.0, out_frac in 0u32..23, period in 0i64..4
    ) {
        let weight = 1 + (part * f64::from(1u32 << shift)) as u32;
        let rest = FilteredConfig::default();
        let config = FilteredConfig { width: 40, period_width: 4, shift, weight, out_frac, ..rest };
        samples_like(&mut FilteredDifference::new(config).unwrap(), &filtered_model(config), &positions, period);
    }

    #[test]
    fn the_window_is_the_difference_of_its_ends(positions in walk(12, 150), window in 1u32..65, period in 0i64..4) {
        let mut block = WindowDifference::new(12, 4, window).unwrap();
        samples_like(&mut block, &window_model(12, window as usize), &positions, period);
    }

    #[test]
    fn foaw_is_the_slope_of_the_longest_straight_window(
        positions in walk(12, 80), window in 2u32..17, noise in 0u32..16, out_frac in 0u32..20, period in 0i64..4
    ) {
        let config = FoawConfig { width: 12, period_width: 4, window, noise, out_frac };
        samples_like(&mut Foaw::new(config).unwrap(), &foaw_model(config), &positions, period);
    }

    #[test]
    fn foaw_is_the_published_algorithm_on_smooth_motions(
        waves in prop::collection::vec((1.0f64..300.0, 0.5f64..40.0, 0.0f64..6.3), 1..5), noise in 1u32..3
    ) {
        // The device has counts of 30 um and samples of 1 ms; the motion is a few sines of up to 9 mm and 6 Hz.
        let (count_m, period_s, window) = (30e-6, 1e-3, 16);
        let config = FoawConfig { width: 12, period_width: 4, window, noise, out_frac: 12 };
        let mut block = Foaw::new(config).unwrap();
        let mut seen_m: Vec<f64> = vec![];
        for k in 0..600u32 {
            let time_s = f64::from(k) * period_s;
            let angle = |&(size, rate, phase): &(f64, f64, f64)| size * (rate * time_s + phase).sin();
            let counts = waves.iter().map(angle).sum::<f64>().floor();
            let input = foaw::In { position: (counts as i64).rem_euclid(4096), period: 1 };
            let velocity = Block::tick(&mut block, input).velocity;
            seen_m.insert(0, counts * count_m);
            if seen_m.len() <= window as usize {
                continue;
            }
            // b_n = (x_k - x_{k-n}) / (nT) is accepted while |x_k - jT b_n - x_{k-j}| <= d for all j = 1 .. n-1. On
            // words of counts, a position that is not within d misses it by 1/n of a count at least, so a tolerance of
            // a millionth of a count only covers float errors.
            let slope = |n: usize| (seen_m[0] - seen_m[n]) / (n as f64 * period_s);
            let noise_m = (f64::from(noise) + 1e-6) * count_m;
            let line = |n: usize, j: usize| seen_m[0] - j as f64 * period_s * slope(n);
            let accepted = |n: &usize| (1..*n).all(|j| (line(*n, j) - seen_m[j]).abs() <= noise_m);
            let n = (1..=window as usize).take_while(accepted).last().unwrap();
            // The word is the floor of that slope, in 2^-12 counts per sample.
            let lost = slope(n) * period_s / count_m * 4096.0 - velocity as f64;
            prop_assert!((-1e-6..1.0 + 1e-6).contains(&lost), "window {}, lost {}", n, lost);
        }
    }
}

/// Runs every position as a sample. The velocity of the sample before stands until the edge of the load; the position
/// between samples does not matter.
fn twists_like(config: LevantConfig, positions: &[i64]) {
    let mut block = LevantDifferentiator::new(config).unwrap();
    let latency = (config.width + 2 * config.out_frac).div_ceil(2) + 2;
    let mut model = Twisting::new(config);
    let (period, mut shown) = (i64::from(latency) + 1, Block::reset(&mut block).velocity);
    for &position in positions {
        let mut at = |position| Block::tick(&mut block, levant_differentiator::In { position, period }).velocity;
        assert_eq!(at(position), shown);
        for _ in 1..latency {
            assert_eq!(at(position ^ 1), shown, "{positions:?}");
        }
        shown = model.sample(position);
        assert_eq!(at(position ^ 1), shown, "{positions:?}");
    }
}

#[test]
fn levant_answers_every_short_history_as_the_recursion_says() {
    for (out_frac, root_gain, slew) in [(0, 0, 1), (0, 300, 1), (1, 90, 1), (2, 256, 9), (3, 1000, 40)] {
        let config = LevantConfig { width: 4, period_width: 6, out_frac, root_gain, slew };
        for history in 0..1i64 << 16 {
            let positions = [0, 4, 8, 12].map(|low| history >> low & 15);
            twists_like(config, &positions);
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn levant_follows_the_recursion(
        positions in walk(20, 60), out_frac in 0u32..21, root_gain in 0u32..1 << 20, slew in 0u32..1 << 20
    ) {
        twists_like(LevantConfig { width: 20, period_width: 8, out_frac, root_gain, slew }, &positions);
    }
}

fn times_like(width: u32, time_width: u32, positions: &[i64]) {
    let mut block = EdgeTimer::new(width, time_width).unwrap();
    for edge in 1..=positions.len() {
        let out = Block::tick(&mut block, edge_timer::In { position: positions[edge - 1] });
        let expected = timer_model(&positions[..edge], width, time_width);
        assert_eq!([out.interval, out.forward, out.stopped], expected, "after {:?}", &positions[..edge]);
    }
}

#[test]
fn the_timer_answers_every_short_history_as_the_list_of_changes_says() {
    for history in 0..1i64 << 16 {
        let positions: Vec<_> = (0..8).map(|edge| history >> (2 * edge) & 3).collect();
        times_like(2, 2, &positions);
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_timer_times_the_list_of_changes(
        changes in prop::collection::vec((0usize..40, -2i64..3), 1..20), width in 3u32..6, time_width in 2u32..7
    ) {
        let mut position = 0i64;
        let mut positions = vec![];
        for (still, step) in changes {
            positions.extend(vec![position; still]);
            position = (position + step).rem_euclid(1 << width);
            positions.push(position);
        }
        times_like(width, time_width, &positions);
    }
}

#[test]
fn the_timer_lets_the_speed_fall_while_the_next_count_is_overdue() {
    let mut block = EdgeTimer::new(8, 4).unwrap();
    let mut at = |position| {
        let out = Block::tick(&mut block, edge_timer::In { position });
        (out.interval, out.stopped)
    };
    // Changes at edges 1 and 4 make an interval of 3. From 4 edges after the second change on, the next interval can
    // only be longer.
    let shown: Vec<_> = [1, 1, 1, 2, 2, 2, 2, 2, 2].map(&mut at).to_vec();
    assert_eq!(shown[..3], [(15, 1); 3]);
    assert_eq!(shown[3..], [(3, 0), (3, 0), (3, 0), (3, 0), (4, 0), (5, 0)]);
    let last: Vec<_> = (0..12).map(|_| at(2)).collect();
    assert_eq!((last[8], last[9], last[11]), ((14, 0), (15, 1), (15, 1)));
    // After standstill, a single change gives no time; nor does a reversal.
    assert_eq!([3, 3, 4, 3, 2].map(at), [(15, 1), (15, 1), (2, 0), (15, 1), (1, 0)]);
}

/// Returns the amplitude of a sinusoid of one period in `samples / periods` samples.
fn amplitude(samples: &[f64], periods: f64) -> f64 {
    let turn = std::f64::consts::TAU * periods / samples.len() as f64;
    let along = |wave: fn(f64) -> f64| samples.iter().zip(0..).map(|(x, k)| x * wave(turn * f64::from(k))).sum::<f64>();
    2.0 * along(f64::sin).hypot(along(f64::cos)) / samples.len() as f64
}

#[test]
fn at_its_corner_the_filter_leaves_the_root_of_a_half_of_the_difference() {
    // 30 Hz at 4 kHz is three periods in 400 samples. The position swings by 2^24 counts, the difference by 790000.
    let config = FilteredConfig { width: 40, period_width: 4, shift: 16, weight: 3017, ..FilteredConfig::default() };
    let block: &mut dyn AnyBlock = &mut FilteredDifference::new(config).unwrap();
    let (samples, periods, turn) = (400, 3.0, std::f64::consts::TAU * 3.0 / 400.0);
    let position = |k: i32| (f64::from(1 << 24) * (1.0 + (turn * f64::from(k)).sin())).round() as i64;
    let (mut filtered, mut difference) = (Vec::new(), Vec::new());
    // The start decays by exp(-2 pi 3) in 400 samples, and is less than 1e-16 after 800.
    for k in 0..3 * samples {
        filtered.push(block.tick(&[position(k), 1])[0] as f64 / 256.0);
        difference.push((position(k) - position(k - 1)) as f64);
    }
    let last = |all: &[f64]| amplitude(&all[all.len() - samples as usize..], periods);
    let ratio = last(&filtered) / last(&difference);
    // The low pass alpha / (1 - (1 - alpha) / z), on the unit circle. A count of quantisation in each of the two is
    // 1.3e-6 of the difference.
    let alpha = 3017.0 / 65536.0;
    let exact = alpha / f64::hypot(1.0 - (1.0 - alpha) * turn.cos(), (1.0 - alpha) * turn.sin());
    assert!((ratio / exact - 1.0).abs() < 5e-6, "{ratio}, by the formula {exact}");
    // Of a filter in continuous time it is the root of a half; sampling adds (2 pi f T)^2 / 24.
    assert!((ratio * 2f64.sqrt() - 1.0).abs() < turn * turn / 12.0, "{ratio}");
}

#[test]
fn at_its_corner_the_second_order_leaves_the_root_of_a_half_and_at_rest_nothing() {
    // 30 Hz at 4 kHz, the default; prewarped, the bilinear transform keeps the root of a half exactly.
    let config = ButterworthConfig { width: 22, period_width: 4, ..ButterworthConfig::default() };
    let block: &mut dyn AnyBlock = &mut ButterworthDifference::new(config).unwrap();
    let (samples, turn) = (400, std::f64::consts::TAU * 3.0 / 400.0);
    let position = |k: i32| (f64::from(1 << 20) * (1.0 + (turn * f64::from(k)).sin())).round() as i64;
    let filtered: Vec<_> = (0..4 * samples).map(|k| block.tick(&[position(k), 1])[0] as f64 / 256.0).collect();
    let difference: Vec<_> = (0..samples).map(|k| (position(k) - position(k - 1)) as f64).collect();
    let ratio = amplitude(&filtered[3 * samples as usize..], 3.0) / amplitude(&difference, 3.0);
    // A count of quantisation is 2e-5 of the difference, and the mean of 400 of them less. The words of the
    // coefficients move the corner by 3e-7.
    assert!((ratio * 2f64.sqrt() - 1.0).abs() < 5e-6, "{ratio}");
    // A motion of one count at a time, forth and back, then rest: no rounding is left.
    for k in 0..2000 {
        block.tick(&[if k < 50 { k } else { 100 - k.min(100) }, 1]);
    }
    assert_eq!(block.tick(&[0, 1]), [0]);
}

#[test]
fn widths_beyond_the_data_sheet_are_refused() {
    let section = ButterworthConfig::default();
    let no = |config| ButterworthDifference::new(config).is_err();
    assert!(no(ButterworthConfig { b0: 0, ..section }) && no(ButterworthConfig { guard: 23, ..section }));
    assert!(no(ButterworthConfig { width: 23, ..section }));
    // The poles are inside the unit circle between 4 B0 - 2^31 + 1 and 2 B0 - 1.
    for (b0, _) in SECTIONS {
        let at = |a1: i64| ButterworthConfig { b0, a1: a1 as i32, ..section };
        let [least, most] = [4 * i64::from(b0) - (1 << 31) + 1, 2 * i64::from(b0) - 1];
        assert!(no(at(least - 1)) && !no(at(least)) && !no(at(most)) && no(at(most + 1)), "{b0}");
    }

    assert!([0, 65].into_iter().all(|window| WindowDifference::new(12, 24, window).is_err()));
    let filtered = FilteredConfig::default();
    assert!(FilteredDifference::new(FilteredConfig { shift: 17, ..filtered }).is_err());
    assert!(FilteredDifference::new(FilteredConfig { weight: 0, ..filtered }).is_err());
    assert!(FilteredDifference::new(FilteredConfig { weight: 9, ..filtered }).is_err());
    assert!(FilteredDifference::new(FilteredConfig { width: 55, ..filtered }).is_err());
    let foaw = FoawConfig::default();
    for config in
        [FoawConfig { window: 1, ..foaw }, FoawConfig { window: 17, ..foaw }, FoawConfig { noise: 16, ..foaw }]
    {
        assert!(Foaw::new(config).is_err(), "{config:?}");
    }
    assert!(EdgeTimer::new(12, 31).is_err());
}
