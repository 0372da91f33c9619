//! The sampled wall compared with its equations on whole histories, in plain integers.

use crate::cases::cases;
use crate::oracle::{Twisting, butterworth_model, filtered_model, foaw_model, timer_model, window_model};
use hpu_datapath::{
    Block, ButterworthConfig, Estimator, FilteredConfig, FoawConfig, LawIn, LawOut, LawWidths, LevantConfig,
};
use hpu_datapath::{SampledWall, SampledWallConfig};
use hpu_signal::Format;
use proptest::prelude::*;

/// Returns the edges that sample: each comes one period after the edge before, with the period as it was at that
/// earlier edge.
fn samples(history: &[LawIn<i64>], period: impl Fn(&LawIn<i64>) -> i64) -> Vec<usize> {
    let mut all = vec![];
    let mut next = 0;
    while next < history.len() {
        all.push(next);
        next += period(&history[next]).max(1) as usize;
    }
    all
}

/// Returns the velocity of the fixed-position method at the end of a history, from every capture and its result.
fn timed(
    config: &SampledWallConfig,
    history: &[LawIn<i64>],
    samples: &[usize],
    vp: &dyn Fn(&LawIn<i64>) -> i64,
) -> i64 {
    let LawWidths { width, period_width, .. } = config.widths;
    let positions: Vec<_> = history.iter().map(|edge| edge.position).collect();
    let most = (1i128 << (width - 1 + config.velocity_frac)) - 1;
    // One edge begins the division, one edge each computes a bit of the dividend and of the fraction, and one edge
    // loads.
    let latency = (period_width + 1 + config.velocity_frac + 2) as usize;
    let (mut velocity, mut free) = (0, 0);
    for &edge in samples {
        if edge < free {
            continue;
        }
        free = edge + latency + 1;
        if edge + latency < history.len() {
            let [interval, forward, stopped] = timer_model(&positions[..edge], width, period_width);
            let scaled = i128::from(vp(&history[edge])) * 2i128.pow(config.velocity_frac);
            let size = (scaled / i128::from(interval)).min(most) as i64;
            velocity = (1 - stopped) * (2 * forward - 1) * size;
        }
    }
    velocity
}

/// Returns the velocity of Levant's differentiator, which passes over the samples while it takes a root.
fn twisted(config: &SampledWallConfig, history: &[LawIn<i64>], samples: &[usize]) -> i64 {
    let (width, out_frac) = (config.widths.width, config.velocity_frac);
    let SampledWallConfig { root_gain, slew, .. } = *config;
    let mut model =
        Twisting::new(LevantConfig { width, period_width: config.widths.period_width, out_frac, root_gain, slew });
    // One edge begins the root, one edge each computes a bit, and one edge loads.
    let latency = ((width + 2 * out_frac).div_ceil(2) + 2) as usize;
    let (mut velocity, mut free) = (0, 0);
    for &edge in samples.iter().filter(|&&edge| edge + latency < history.len()) {
        if edge >= free {
            free = edge + latency + 1;
            velocity = model.sample(history[edge].position);
        }
    }
    velocity
}

/// Returns torque and memory after the last edge of a history.
fn expected(config: &SampledWallConfig, history: &[LawIn<i64>]) -> LawOut<i64> {
    let LawWidths { width, stiffness, damping, period_width, torque_width, .. } = config.widths;
    let frac = config.velocity_frac;
    let vp = |edge: &LawIn<i64>| edge.period * i64::from(config.ratio) % (1 << period_width);
    let at = samples(history, vp);
    let seen: Vec<_> = at.iter().map(|&edge| history[edge].position).collect();
    let window = config.window;
    let memory = match config.estimator {
        Estimator::Difference => window_model(width, 1)(&seen) << frac,
        Estimator::Window => window_model(width, window as usize)(&seen) << frac,
        Estimator::Filtered => {
            let SampledWallConfig { shift, weight, .. } = *config;
            let rest = FilteredConfig::default();
            filtered_model(FilteredConfig { width, period_width, shift, weight, out_frac: frac, ..rest })(&seen)
        }
        Estimator::Foaw => {
            foaw_model(FoawConfig { width, period_width, window, noise: config.noise, out_frac: frac })(&seen)
        }
        Estimator::EdgeTimer => timed(config, history, &at, &vp),
        Estimator::Levant => twisted(config, history, &at),
        Estimator::Butterworth => {
            let SampledWallConfig { b0, a1, guard, .. } = *config;
            butterworth_model(ButterworthConfig { width, period_width, b0, a1, guard, out_frac: frac })(&seen)
        }
    };
    let now = history.last().unwrap();
    let wall = if config.spring_held { &history[*samples(history, |edge| edge.period).last().unwrap()] } else { now };
    let scale = |value: i128, frac: i32| value.div_euclid(1 << frac);
    let product = |a: i64, b: i64| i128::from(a) * i128::from(b);
    let full = 1i128 << torque_width;
    let velocity_frac = damping.frac() + frac as i32;
    let [mut spring, mut drag] = [0, 0];
    if wall.contact == 1 {
        spring = scale(product(wall.penetration, now.stiffness), stiffness.frac()).min(full - 1);
        drag = scale(product(now.damping, memory), velocity_frac).max(-full).min(full - 1);
    }
    let relief = scale(product(config.relief.into(), memory), velocity_frac).max(-full).min(full - 1);
    let torque = (spring + drag - relief).max(-2 * full).min(2 * full - 1);
    LawOut { torque: torque as i64, memory }
}

fn small() -> SampledWallConfig {
    let format = |int, frac| Format::new(false, int, frac).unwrap();
    let widths = LawWidths {
        width: 4,
        stiffness: format(1, 2),
        damping: format(2, 2),
        period_width: 4,
        torque_width: 3,
        ..LawWidths::default()
    };
    SampledWallConfig { widths, velocity_frac: 1, window: 3, shift: 2, ..SampledWallConfig::default() }
}

#[test]
fn one_sample_makes_the_torque_of_the_equations_for_every_word() {
    for (spring_held, relief) in [(true, 0), (true, 3), (false, 0), (false, 15), (false, 200)] {
        let config = SampledWallConfig { spring_held, relief, ..small() };
        let mut wall = SampledWall::new(config).unwrap();
        for words in 0..1i64 << 16 {
            let [position, penetration, damping] = [words & 15, words >> 4 & 15, words >> 8 & 15];
            let [stiffness, contact] = [words >> 12 & 7, words >> 15 & 1];
            let input = LawIn { position, delta: 0, contact, penetration, stiffness, damping, period: 1, scale: 0 };
            wall.reset();
            assert_eq!(wall.tick(input), expected(&config, &[input]), "{input:?}, relief {relief}");
        }
    }
}

#[test]
fn the_torque_reaches_the_upper_end_of_its_format_and_no_further() {
    // Drag and relief have the sign of the velocity. The most is a full spring without drag and a full relief on the
    // way out.
    let config = SampledWallConfig { spring_held: false, relief: 200, ..small() };
    let mut wall = SampledWall::new(config).unwrap();
    let input =
        LawIn { position: 8, delta: 0, contact: 1, penetration: 7, stiffness: 7, damping: 0, period: 1, scale: 0 };
    assert_eq!(wall.tick(input).torque, 7 + 8);
    assert_eq!(wall.outputs().torque.format.max(), 15);
    // Downwards, the most is a full drag.
    let mut wall = SampledWall::new(SampledWallConfig { relief: 0, ..config }).unwrap();
    assert_eq!(wall.tick(LawIn { damping: 15, penetration: 0, ..input }).torque, -8);
}

/// Returns motions whose positions mostly walk at constant speed and sometimes rest or jump, with the wall as
/// `unilateral` sees it.
fn motion() -> impl Strategy<Value = Vec<LawIn<i64>>> {
    let leg = (0usize..40, -2i64..3, 0i64..6, 0u32..12, any::<[u16; 4]>());
    prop::collection::vec(leg, 1..12).prop_map(|legs| {
        let mut history = vec![];
        let mut position = 0;
        let mut input =
            LawIn { position: 0, delta: 0, contact: 1, penetration: 0, stiffness: 5, damping: 9, period: 3, scale: 0 };
        for (edges, step, pause, kind, words) in legs {
            let [stiffness, damping, period, jump] = words.map(i64::from);
            if kind == 0 {
                position += jump;
            }
            input = match kind {
                1..=3 => LawIn { stiffness: stiffness % 8, damping: damping % 16, ..input },
                4..=6 => LawIn { period: period % 16, ..input },
                _ => input,
            };
            for edge in 0..=edges as i64 {
                if edge % (pause + 1) == 0 {
                    position += step;
                }
                let delta = (position + 5).rem_euclid(16) - 8;
                let (contact, penetration) = (i64::from(delta >= 0), delta.max(0));
                history.push(LawIn { position: position.rem_euclid(16), delta, contact, penetration, ..input });
            }
        }
        history
    })
}

fn follows(config: SampledWallConfig, history: &[LawIn<i64>]) {
    let mut wall = SampledWall::new(config).unwrap();
    for edge in 0..history.len() {
        let out = wall.tick(history[edge]);
        assert_eq!(out, expected(&config, &history[..=edge]), "{config:?} at {edge}: {:?}", &history[..=edge]);
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn every_estimator_damps_as_the_equations_say(
        history in motion(),
        spring_held in any::<bool>(),
        ratio in 1u32..4,
        relief in 0u32..20,
        velocity_frac in 0u32..4,
    ) {
        for estimator in Estimator::ALL {
            let config = SampledWallConfig { spring_held, estimator, ratio, relief, velocity_frac, ..small() };
            follows(config, &history);
        }
    }

    #[test]
    fn a_short_division_ends_between_many_samples(history in motion(), ratio in 1u32..3) {
        // A division takes 4 + 1 + 0 bits, so with periods of 1 to 15 edges it lets none to seven sample edges pass.
        let config = SampledWallConfig { estimator: Estimator::EdgeTimer, velocity_frac: 0, ratio, ..small() };
        follows(config, &history);
    }
}

#[test]
fn words_that_an_estimator_cannot_take_are_refused() {
    let default = SampledWallConfig::default();
    let wide = LawWidths { width: 30, ..LawWidths::default() };
    for config in [
        SampledWallConfig { ratio: 0, ..default },
        SampledWallConfig { velocity_frac: 31, ..default },
        SampledWallConfig { estimator: Estimator::EdgeTimer, velocity_frac: 17, ..default },
        SampledWallConfig { estimator: Estimator::EdgeTimer, widths: wide, ..default },
        SampledWallConfig { estimator: Estimator::Foaw, window: 17, ..default },
        SampledWallConfig { estimator: Estimator::Filtered, shift: 17, ..default },
        SampledWallConfig { estimator: Estimator::Levant, root_gain: 1 << 20, ..default },
        SampledWallConfig { estimator: Estimator::Levant, velocity_frac: 26, ..default },
    ] {
        assert!(SampledWall::new(config).is_err(), "{config:?}");
    }
    // A parameter that the estimator does not have cannot be wrong.
    assert!(SampledWall::new(SampledWallConfig { window: 17, shift: 17, ..default }).is_ok());
}
