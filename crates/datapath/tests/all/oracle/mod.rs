//! The velocity estimators as functions of all positions sampled so far, in plain integers; and the ways to round.

use std::cmp::Ordering;

use hpu_datapath::{ButterworthConfig, FilteredConfig, FoawConfig, LevantConfig};
use hpu_signal::Rounding;

/// Returns the difference of two counter words as a motion of less than half a turn.
pub fn motion(to: i64, from: i64, turn: i64) -> i64 {
    (to - from + turn / 2).rem_euclid(turn) - turn / 2
}

/// Returns the position `back` samples ago; before the first sample it is 0.
fn ago(positions: &[i64], back: usize) -> i64 {
    (positions.len() - 1).checked_sub(back).map_or(0, |at| positions[at])
}

/// Returns `value / unit`, rounded by the definition of each way.
pub fn rounded(value: i128, unit: i128, rounding: Rounding) -> i128 {
    let (below, rest) = (value.div_euclid(unit), value.rem_euclid(unit));
    let above = below + i128::from(rest > 0);
    let (inward, outward) = if value < 0 { (above, below) } else { (below, above) };
    let (even, odd) = if below % 2 == 0 { (below, above) } else { (above, below) };
    let tie = match rounding {
        Rounding::Truncate => return below,
        Rounding::TowardZero => return inward,
        Rounding::NearestUp => above,
        Rounding::NearestDown => below,
        Rounding::NearestAway => outward,
        Rounding::NearestInward => inward,
        Rounding::NearestEven => even,
        Rounding::NearestOdd => odd,
    };
    match (2 * rest).cmp(&unit) {
        Ordering::Less => below,
        Ordering::Equal => tie,
        Ordering::Greater => above,
    }
}

/// Returns the recursion of the low pass as a model.
pub fn filtered_model(config: FilteredConfig) -> impl Fn(&[i64]) -> i64 {
    move |positions| {
        (1..=positions.len()).fold(0i128, |velocity, sampled| {
            let past = &positions[..sampled];
            let difference = motion(ago(past, 0), ago(past, 1), 1 << config.width);
            let error = i128::from(difference) * 2i128.pow(config.out_frac) - velocity;
            velocity + rounded(error * i128::from(config.weight), 2i128.pow(config.shift), config.rounding)
        }) as i64
    }
}

/// Returns the recursion of the second-order low pass as a model, all sums over a common denominator.
pub fn butterworth_model(config: ButterworthConfig) -> impl Fn(&[i64]) -> i64 {
    let ButterworthConfig { width, b0, a1, guard, out_frac, .. } = config;
    let (one, fine, top) = (1i128 << 30, 1i128 << (guard + out_frac), 1i128 << (width - 1));
    move |positions| {
        let [b0, a1] = [i128::from(b0), i128::from(a1)];
        let a2 = 4 * b0 - one - a1;
        let mut ys = vec![0i128, 0];
        for sampled in 1..=positions.len() {
            let difference = |back: usize| match sampled.checked_sub(back) {
                None | Some(0) => 0,
                Some(now) => i128::from(motion(ago(&positions[..now], 0), ago(&positions[..now], 1), 1 << width)),
            };
            let forward = b0 * (difference(0) + 2 * difference(1) + difference(2)) * fine;
            let sum = forward - a1 * ys[sampled] - a2 * ys[sampled - 1];
            ys.push(rounded(sum, one, Rounding::NearestUp).clamp(-top * fine, top * fine - 1));
        }
        let shown = rounded(ys[positions.len() + 1], 1 << guard, Rounding::NearestUp);
        shown.min((top << out_frac) - 1) as i64
    }
}

/// Returns the difference of the window's ends as a model.
pub fn window_model(width: u32, window: usize) -> impl Fn(&[i64]) -> i64 {
    move |positions| motion(ago(positions, 0), ago(positions, window), 1 << width)
}

/// Returns a model of FOAW: the slope of the longest window in which the line through the ends misses no position by
/// more than the noise. The model keeps all fractions over a common denominator, judges every window, and looks for the
/// first refused one afterwards.
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

/// Returns the outputs of the timer after a history of positions, computed from the list of all changes.
pub fn timer_model(positions: &[i64], width: u32, time_width: u32) -> [i64; 3] {
    let longest = (1i64 << time_width) - 1;
    // The edge and the direction of every change.
    let changes: Vec<(i64, bool)> = (1..=positions.len())
        .filter_map(|edge| {
            let difference = motion(positions[edge - 1], ago(&positions[..edge], 1), 1 << width);
            (difference != 0).then_some((edge as i64, difference > 0))
        })
        .collect();
    let Some(&(latest, forward)) = changes.last() else { return [longest, 0, 1] };
    let since = positions.len() as i64 - latest;
    let between = match changes[..] {
        // The timer runs out only on an edge without a change, so an interval of exactly `longest` still counts.
        [.., (before, way), _] if way == forward && latest - before <= longest => Some(latest - before),
        _ => None,
    };
    match between {
        Some(between) if since < longest => [between.max(since), i64::from(forward), 0],
        _ => [longest, i64::from(forward), 1],
    }
}

/// The super-twisting recursion in whole numbers: a count is `2^out_frac` of them, and the root is searched bit by bit.
pub struct Twisting {
    config: LevantConfig,
    estimate: i128,
    velocity: i128,
}

impl Twisting {
    pub fn new(config: LevantConfig) -> Self {
        Self { config, estimate: 0, velocity: 0 }
    }

    /// Returns the velocity after a sample of that position.
    pub fn sample(&mut self, position: i64) -> i64 {
        let LevantConfig { width, out_frac, root_gain, slew, .. } = self.config;
        let (turn, half) = (1i128 << (width + out_frac), 1i128 << (width + out_frac - 1));
        let error = (self.estimate - (i128::from(position) << out_frac) + half).rem_euclid(turn) - half;
        let under = error.abs() << out_frac;
        let bits = (0..40).rev();
        let root =
            bits.fold(0i128, |root, bit| if (root + (1 << bit)).pow(2) <= under { root + (1 << bit) } else { root });
        let step = i128::from(root_gain) * root / 256;
        self.estimate = (self.estimate + self.velocity - error.signum() * step).rem_euclid(turn);
        self.velocity = (self.velocity - error.signum() * i128::from(slew)).clamp(-half, half - 1);
        i64::try_from(self.velocity).unwrap()
    }
}
