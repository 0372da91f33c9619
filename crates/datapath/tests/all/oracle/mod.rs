//! The velocity estimators as functions of all positions sampled so far, in plain integers.

use hpu_datapath::{FilteredConfig, FoawConfig};

/// The difference of two counter words as a motion of less than half a turn.
pub fn motion(to: i64, from: i64, turn: i64) -> i64 {
    (to - from + turn / 2).rem_euclid(turn) - turn / 2
}

/// The position `back` samples ago, 0 before the first.
fn ago(positions: &[i64], back: usize) -> i64 {
    (positions.len() - 1).checked_sub(back).map_or(0, |at| positions[at])
}

/// The recursion of the low pass.
pub fn filtered_model(config: FilteredConfig) -> impl Fn(&[i64]) -> i64 {
    move |positions| {
        (1..=positions.len()).fold(0i128, |velocity, sampled| {
            let past = &positions[..sampled];
            let difference = motion(ago(past, 0), ago(past, 1), 1 << config.width);
            let error = i128::from(difference) * 2i128.pow(config.out_frac) - velocity;
            velocity + error.div_euclid(2i128.pow(config.shift))
        }) as i64
    }
}

/// The difference of the window's ends.
pub fn window_model(width: u32, window: usize) -> impl Fn(&[i64]) -> i64 {
    move |positions| motion(ago(positions, 0), ago(positions, window), 1 << width)
}

/// The slope of the longest window of which a line through its ends misses no position by more than the noise: all
/// fractions over a common denominator, every window judged, the first refusal looked for afterwards.
pub fn foaw_model(config: FoawConfig) -> impl Fn(&[i64]) -> i64 {
    move |positions| {
        let ends = |back| i128::from(motion(ago(positions, 0), ago(positions, back), 1 << config.width));
        let explains = |window: i128| {
            let misses = (1..window).map(|back| (window * ends(back as usize) - back * ends(window as usize)).abs());
            misses.max().unwrap_or(0) <= window * i128::from(config.noise)
        };
        let accepted: Vec<_> = (1..=i128::from(config.window)).map(explains).collect();
        let window = accepted.iter().position(|&accepted| !accepted).unwrap_or(accepted.len());
        (ends(window) * 2i128.pow(config.out_frac)).div_euclid(window as i128) as i64
    }
}

/// What the timer shows after a history of positions, from the list of the changes alone.
pub fn timer_model(positions: &[i64], width: u32, time_width: u32) -> [i64; 3] {
    let longest = (1i64 << time_width) - 1;
    // Edge and direction of every change.
    let changes: Vec<(i64, bool)> = (1..=positions.len())
        .filter_map(|edge| {
            let difference = motion(positions[edge - 1], ago(&positions[..edge], 1), 1 << width);
            (difference != 0).then_some((edge as i64, difference > 0))
        })
        .collect();
    let Some(&(latest, forward)) = changes.last() else { return [longest, 0, 1] };
    let since = positions.len() as i64 - latest;
    let between = match changes[..] {
        // The timer runs out on an edge without a change only: the whole time, and not one edge more, still counts.
        [.., (before, way), _] if way == forward && latest - before <= longest => Some(latest - before),
        _ => None,
    };
    match between {
        Some(between) if since < longest => [between.max(since), i64::from(forward), 0],
        _ => [longest, i64::from(forward), 1],
    }
}
