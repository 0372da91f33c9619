//! The verdict on the motion. It is a result, never an error, because stability maps are made of verdicts.
//!
//! The rule applies to the angle recorded over the judged window: the last 30 % of the run (the published drop test
//! judges the last 3 s of 10 s), or, if the hand moves in them, the part after the last move of its path. If the hand
//! stands still for less than the last 10 % of the run, the verdict is **the hand moves**, with the rms and the
//! greatest distance of device and hand in the last 30 %, and with the duration whose last 30 % would begin when the
//! hand stands still. (If the slowest pole of the device is known, the device has come to rest by then.) Else the
//! motion is
//!
//! 1. **settled** when its rms about its own mean is below one encoder count, and its oscillation does not grow. It
//!    grows if the half-range of the window's last quarter is more than 1.5 times that of the first, and each quarter
//!    has at least half of the share of that growth that steady growth would give it (a factor of 1.07). Then the
//!    motion has diverged, however small it still is. Growth below [`unseen_growth_per_s`] is not seen in the window
//!    and counts as rest;
//! 2. **diverged** when its half-range in the later half of that window exceeds 1.5 times that in the earlier half, or
//!    when it is not finite. A motion without a period in the window must also go where it has not been in the run;
//! 3. **not told** when it may still come to rest: a longer run would tell. This holds
//!    - if it has no period in the window, that is, fewer than two upward passages of the mean, or fewer than two whole
//!      swings from turn to turn;
//!    - if its half-range in the window's last quarter is below one count: it has come to rest in the window;
//!    - if its swings fall, by a factor of 1.1 or more in three quarters of the window, and steadily. With more than
//!      eight passages, a swing is the half-range of an eighth of the window; the geometric mean of the later half of
//!      them is smaller by at least three times what their scatter explains, and the last is not larger than the one
//!      before. With five to eight passages, a swing is the half-range of a quarter; with fewer, that from turn to turn
//!      (if there are three or more, the mean of two neighbours). Each step is then at least half of the share that a
//!      steady fall would give it;
//! 4. **limit cycle** otherwise, with that half-range as amplitude. Its frequency counts upward passages of the mean,
//!    each after a passage below by a quarter of the amplitude.
//!
//! The duration that would tell puts the window's begin where an exponential decay has fallen to half a count. The
//! decay is that of the falling swings. For a motion without a period, it is that of the steps between the means of the
//! window's quarters, if their two ratios show the same decay within a twentieth. If not, it is that of the slowest
//! pole of the device with its hand, in front of the wall or in it, without delays, unless the steps go on in one
//! direction and fall by less than half of what this pole asks for. Else, or if the poles are not known, there is no
//! such duration.
//!
//! A decay slower than a factor of 1.1 in three quarters of the window is not seen, and counts as a limit cycle. A beat
//! that is longer than the window may look like a decay while it falls.
//!
//! A motion inside a wall that pushes with nothing is none of these, whatever it does: **no wall torque**. The device
//! is at least [`DEEP_COUNTS`](crate::DEEP_COUNTS) counts inside the wall for at least 10 ms of the window, and the
//! actuator pushes it out, on the average over the window, with less than a tenth of what the wall is to give: its
//! stiffness times the mean penetration, as far as the actuator goes. The stiffness is that which the words realise, or
//! that to which the method limits it. Of a design of the user's own no stiffness is known; its wall is taken to be a
//! tenth as stiff as the hand's grip, or to give a tenth of a hand's constant push, or, where nothing is known of the
//! hand, a hundredth of what the actuator can.
//!
//! A device that settles while its position counter has wrapped is not settled either: **position lost**. At some edge
//! of the window the distance to the wall did not fit the counter, so the logic read another place, and the device
//! rests where the logic does not know it. Motions of other kinds keep their verdict; the wrap is told beside it.
//!
//! The verdict judges the motion. The [contact](crate::Summary::contact_share) in the same window tells whether the
//! motion involves the wall.
//!
//! If the run has more rows than its trace may hold, the same figures are computed as the rows come. The only
//! difference: the first and last passage of a frequency's count are then located among the held rows, not among all
//! rows.
//!
//! A drop test (Sevcik et al. 2009) is judged by the published rule, on the tip's coordinate as the counts tell it:
//! **passive** when its rms about the steady value, the mean over the last 30 % (7 to 10 s of 10 s), is below 0.003 cm,
//! else **non-passive**.
//! **Highly unstable** trials "were aborted to protect the hardware"; the paper does not say when. Here a trial is
//! aborted when the tip leaves the tables or reaches the opposite wall; it can reach that wall only with energy that
//! the loop has generated.
//!
//! A device that follows a target of its host is judged by the rule of an axis while the target stands still, with its
//! motion by one position of its sensor in the place of a count. Whether it comes to rest does not depend on where the
//! target is. If the target moves in the window, the verdict is **tracking**, with the rms and the greatest distance of
//! tip and target. An axis whose method follows a target is judged so too: after the last move of hand and target, or
//! by its distance from a target that moves until less than the last 10 % of the run are left.

use crate::result::trace::Trace;
use crate::result::window::{PARTS, Streamed, part, passage, range, turns};
use hpu_scene::{AxisTarget, OutcomeKind, Push, positions_along};
use serde::Serialize;

/// The verdict on a motion, with the numbers it was decided on.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Verdict {
    /// At rest within one encoder count, without growth that could be seen.
    Settled {
        /// rms about the mean.
        rms_rad: f64,
    },
    /// Oscillates without end.
    LimitCycle {
        /// rms about the mean.
        rms_rad: f64,
        /// Half of the range.
        amplitude_rad: f64,
        /// Passages of the mean per second.
        frequency_hz: f64,
    },
    /// At rest, but out of the position counter's reach for a part of the window.
    PositionLost {
        /// rms about the mean.
        rms_rad: f64,
        /// The share of the window in which the logic read another place.
        lost_share: f64,
    },
    /// Oscillates ever wider.
    Diverged {
        /// Start of the window in which it did so.
        at_s: f64,
        /// Half of the range in the later half of the window.
        amplitude_rad: f64,
    },
    /// Inside the wall, which gives no torque. Effort and depth are means over the window.
    NoWallTorque {
        /// The actuator's torque or force out of the wall.
        effort: f64,
        /// The penetration.
        depth: f64,
    },
    /// A drop test that came to rest on the wall.
    Passive {
        /// rms about the steady value.
        rms_m: f64,
    },
    /// A drop test that kept chattering on the wall.
    NonPassive {
        /// rms about the steady value.
        rms_m: f64,
    },
    /// A segment, or an axis, that follows a moving target.
    Tracking {
        /// rms of the distance from the target, in the unit of the motion.
        rms_m: f64,
        /// The greatest distance.
        greatest_m: f64,
    },
    /// A drop test that had to be aborted.
    HighlyUnstable {
        /// The time of the abort.
        at_s: f64,
    },
    /// May still come to rest.
    NotTold {
        /// rms about the mean.
        rms_rad: f64,
        /// Half of the range.
        amplitude_rad: f64,
        /// Passages of the mean per second; 0 without a period in the window.
        frequency_hz: f64,
        /// The duration of a run that would tell, if one is known.
        #[serde(rename = "telling_duration_s")]
        telling_s: Option<f64>,
    },
    /// Follows a hand that moves nearly to the end.
    HandMoves {
        /// The time from which on the hand stands still.
        until_s: f64,
        /// rms of the distance between device and hand.
        rms_rad: f64,
        /// The greatest distance.
        greatest_rad: f64,
        /// The duration of a run whose whole window comes after that time, and after the device has come to rest if its
        /// slowest pole is known.
        #[serde(rename = "telling_duration_s")]
        telling_s: f64,
    },
}

impl Verdict {
    /// Returns the kind of the verdict.
    pub fn outcome(self) -> OutcomeKind {
        match self {
            Self::Settled { .. } => OutcomeKind::Settled,
            Self::LimitCycle { .. } => OutcomeKind::LimitCycle,
            Self::Diverged { .. } => OutcomeKind::Diverged,
            Self::NoWallTorque { .. } => OutcomeKind::NoWallTorque,
            Self::PositionLost { .. } => OutcomeKind::PositionLost,
            Self::Passive { .. } => OutcomeKind::Passive,
            Self::NonPassive { .. } => OutcomeKind::NonPassive,
            Self::HighlyUnstable { .. } => OutcomeKind::HighlyUnstable,
            Self::Tracking { .. } => OutcomeKind::Tracking,
            Self::NotTold { .. } => OutcomeKind::NotTold,
            Self::HandMoves { .. } => OutcomeKind::HandMoves,
        }
    }

    /// Returns the verdict in other units, of which one unit of the motion is so many.
    #[must_use]
    pub fn in_units(mut self, scale: f64) -> Self {
        let size = scale.abs();
        match &mut self {
            Self::Settled { rms_rad } | Self::PositionLost { rms_rad, .. } => *rms_rad *= size,
            Self::LimitCycle { rms_rad, amplitude_rad, .. } | Self::NotTold { rms_rad, amplitude_rad, .. } => {
                (*rms_rad, *amplitude_rad) = (*rms_rad * size, *amplitude_rad * size);
            }
            Self::Diverged { amplitude_rad, .. } => *amplitude_rad *= size,
            Self::HandMoves { rms_rad, greatest_rad, .. } => {
                (*rms_rad, *greatest_rad) = (*rms_rad * size, *greatest_rad * size);
            }
            Self::NoWallTorque { effort, depth } => (*effort, *depth) = (*effort / scale, *depth * scale),
            Self::Tracking { rms_m, greatest_m } => (*rms_m, *greatest_m) = (*rms_m * size, *greatest_m * size),
            // These verdicts of arms have one unit.
            Self::Passive { .. } | Self::NonPassive { .. } | Self::HighlyUnstable { .. } => {}
        }
        self
    }

    /// Returns the verdict on the same motion under a position counter that had wrapped in this share of the window.
    pub(crate) fn with_lost_position(self, lost_share: f64) -> Self {
        match self {
            Self::Settled { rms_rad } if lost_share > 0.0 => Self::PositionLost { rms_rad, lost_share },
            other => other,
        }
    }

    /// Returns the duration of a run that would tell how the motion ends, if this run does not tell.
    pub fn telling_s(self) -> Option<f64> {
        match self {
            Self::NotTold { telling_s, .. } => telling_s,
            Self::HandMoves { telling_s, .. } => Some(telling_s),
            _ => None,
        }
    }
}

/// A run that the world ended early.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Abort {
    /// The time of the end.
    pub at_s: f64,
    /// The reason.
    pub why: &'static str,
}

/// Returns half of the span of several ranges together.
fn half_range(ranges: &[[f64; 2]]) -> f64 {
    let low = ranges.iter().fold(f64::INFINITY, |low, range| low.min(range[0]));
    let high = ranges.iter().fold(f64::NEG_INFINITY, |high, range| high.max(range[1]));
    0.5 * (high - low)
}

/// Returns the mean of a term over all numbers. There are eight separate sums, because a single sum would wait for each
/// addition.
#[inline(always)]
fn mean_of(values: &[f64], term: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; 8];
    let (eights, rest) = values.as_chunks::<8>();
    for eight in eights {
        for (sum, &x) in sums.iter_mut().zip(eight) {
            *sum += term(x);
        }
    }
    (sums.iter().sum::<f64>() + rest.iter().map(|&x| term(x)).sum::<f64>()) / values.len() as f64
}

/// Returns the rms about the mean, and the mean.
fn rms_about_mean(values: &[f64]) -> (f64, f64) {
    let mean = mean_of(values, |x| x);
    (mean_of(values, |x| (x - mean) * (x - mean)).sqrt(), mean)
}

/// The input of a verdict: the rows of the window, or the figures gathered from them.
enum Window<'a> {
    Held(&'a [f64]),
    /// The figures, the held rows of the run, and the number of rows from one of these to the next.
    Streamed(&'a Streamed, &'a [f64], u64),
}

impl<'a> Window<'a> {
    fn of(trace: &'a Trace, index: usize) -> Self {
        match trace.streamed(index) {
            Some(streamed) => Self::Streamed(streamed, trace.real(index), trace.every()),
            None => Self::Held(trace.judged_rows(index)),
        }
    }

    /// Returns the row of the run at which the window begins.
    fn start(&self, trace: &Trace) -> u64 {
        match self {
            Self::Held(rows) => trace.came() - rows.len() as u64,
            Self::Streamed(streamed, ..) => streamed.start(),
        }
    }

    fn is_finite(&self) -> bool {
        match self {
            // A number that is not finite makes the mean of `0.0 * x` NaN.
            Self::Held(rows) => mean_of(rows, |x| 0.0 * x) == 0.0,
            Self::Streamed(streamed, ..) => streamed.is_finite(),
        }
    }

    fn rms_about_mean(&self) -> (f64, f64) {
        match self {
            Self::Held(rows) => rms_about_mean(rows),
            Self::Streamed(streamed, ..) => streamed.rms_about_mean(),
        }
    }

    /// Returns the least and the greatest value of each part.
    fn parts(&self) -> [[f64; 2]; PARTS] {
        match self {
            Self::Held(rows) => std::array::from_fn(|of| range(&rows[part(rows.len(), of)..part(rows.len(), of + 1)])),
            Self::Streamed(streamed, ..) => streamed.parts(),
        }
    }

    /// Returns the mean of each quarter.
    fn quarter_means(&self) -> [f64; 4] {
        match self {
            Self::Held(rows) => {
                [0, 2, 4, 6].map(|of| mean_of(&rows[part(rows.len(), of)..part(rows.len(), of + 2)], |x| x))
            }
            Self::Streamed(streamed, ..) => streamed.quarter_means(),
        }
    }

    /// Returns rows and values at which the motion, in this range, turns.
    fn turns(&self, range: [f64; 2]) -> Vec<(u64, f64)> {
        match self {
            Self::Held(rows) => turns(rows, range),
            Self::Streamed(streamed, ..) => streamed.turns(),
        }
    }

    /// Returns the number of upward passages of the mean, and the rows from the first to the last.
    fn passages(&self, mean: f64, amplitude: f64) -> (u64, f64) {
        let rows = match self {
            Self::Held(rows) => rows,
            Self::Streamed(streamed, held, every) => {
                let (passages, ends) = streamed.passages(mean, amplitude);
                let [first, last] = ends.map(|[from, to]| {
                    // The first held row above the mean between two turns. Without one, the swing is short, and one of
                    // many.
                    let rows = (from.0 / every + 1..=to.0 / every).map(|row| row as usize);
                    let above = rows.filter(|row| *row < held.len()).find(|row| held[*row] >= mean);
                    above.map_or_else(|| passage(&[from, to], mean), |row| (row as u64 * every) as f64)
                });
                return (passages, last - first);
            }
        };
        let (mut armed, mut first, mut last, mut passages) = (false, 0, 0, 0);
        for (index, x) in rows.iter().enumerate() {
            if *x < mean - 0.25 * amplitude {
                armed = true;
            } else if armed && *x >= mean {
                armed = false;
                if passages == 0 {
                    first = index;
                }
                (last, passages) = (index, passages + 1);
            }
        }
        (passages, (last - first) as f64)
    }
}

/// Factor of growth from which an oscillation counts as growing.
const GROWN: f64 = 1.5;
/// Least growth in each quarter for the growth to be steady: the sixth root of `GROWN`.
const STEADY: f64 = 1.07;
/// Half-ranges below this share of a count result from rounding.
const ROUNDED: f64 = 1e-9;

/// Returns the rate, in 1/s, below which exponential growth is not seen within a judged window of this length. The
/// quarters that are compared end three quarters of the window apart.
pub fn unseen_growth_per_s(window_s: f64) -> f64 {
    libm::log(GROWN) / (0.75 * window_s)
}

/// Least factor by which swings fall, from the first quarter of a window to the last, if the motion may come to rest.
const FALLEN: f64 = 1.1;
/// Scatters of a mean by which swings that fall differ at least.
const SCATTERS: f64 = 3.0;
/// Greatest relative difference of two decays that are one exponential.
const ALIKE: f64 = 0.05;
/// Distance from rest, in counts, with which the window of a run that tells begins.
const QUIET_COUNTS: f64 = 0.5;
/// Share of a run that is judged.
const JUDGED: f64 = 0.3;

/// Returns the least factor by which swings fall over this share of a window, if the motion may come to rest.
fn least_fall(share: f64) -> f64 {
    libm::pow(FALLEN, share / 0.75)
}

/// Returns the decay of swings that fall, of which the last is this share of the window after the first; `None` if they
/// do not fall.
fn falling(swings: &[f64], share: f64, window_s: f64) -> Option<Approach> {
    let (&first, &last) = (swings.first()?, swings.last()?);
    let steps = swings.windows(2);
    let least_step = libm::pow(first / last, 0.5 / steps.len() as f64);
    let falls = first >= least_fall(share) * last && { steps }.all(|pair| pair[0] >= least_step * pair[1]);
    falls.then(|| Approach { left: last, time_constant_s: share * window_s / libm::log(first / last) })
}

/// Returns the decay of swings that fall from the earlier half of the parts of a window to the later half, by more than
/// their scatter explains, and do not rise at the end; `None` if they do not fall.
fn fading(swings: &[f64; PARTS], window_s: f64) -> Option<Approach> {
    let sizes = swings.map(|swing| libm::log(swing.max(f64::MIN_POSITIVE)));
    let (before, after) = sizes.split_at(PARTS / 2);
    let [(before_scatter, before), (after_scatter, after)] = [before, after].map(rms_about_mean);
    // The mean of four deviates by their scatter over the root of three.
    let scatter = libm::hypot(before_scatter, after_scatter) / 3f64.sqrt();
    let (decay, [.., last_but_one, last]) = (before - after, *swings);
    let falls = decay >= libm::log(least_fall(0.5)) && decay >= SCATTERS * scatter && last <= last_but_one;
    falls.then(|| Approach { left: last, time_constant_s: 0.5 * window_s / decay })
}

/// Returns the duration of a run whose judged window begins at a time, in two digits, rounded up.
fn duration_s(begin_s: f64) -> f64 {
    let whole_s = begin_s / (1.0 - JUDGED);
    let digit = libm::pow(10.0, libm::floor(libm::log10(whole_s)) - 1.0);
    // A quotient of a sum of roundings may lie above a whole number.
    let digits = libm::ceil(whole_s / digit * (1.0 - 1e-12));
    // A decimal number is the nearest to its digits only if it is read from them.
    format!("{digits}e{}", libm::round(libm::log10(digit))).parse().unwrap_or(whole_s)
}

/// An exponential decay of a motion: its distance from rest at the window's end, and its time constant.
struct Approach {
    left: f64,
    time_constant_s: f64,
}

impl Approach {
    /// Returns the approach whose steps from quarter to quarter, `quarter_s` apart, are those of these means.
    fn of_means(means: [f64; 4], quarter_s: f64) -> Option<Self> {
        let steps = [0, 1, 2].map(|of| means[of + 1] - means[of]);
        let [before, after] = [steps[1] / steps[0], steps[2] / steps[1]];
        let decays = [-libm::log(before), -libm::log(after)];
        let is_steady = decays.iter().all(|decay| *decay > 0.0) && (decays[0] - decays[1]).abs() <= ALIKE * decays[1];
        let decay = decays[0].min(decays[1]);
        let ratio = libm::exp(-decay);
        is_steady.then(|| Self { left: (steps[2] * ratio / (1.0 - ratio)).abs(), time_constant_s: quarter_s / decay })
    }

    /// Returns the approach by the slowest pole of the device; `None` if the steps from quarter to quarter show another
    /// one: they go on in one direction, and fall by less than half of what this pole asks for.
    fn of_pole(means: [f64; 4], quarter_s: f64, amplitude: f64, time_constant_s: f64) -> Option<Self> {
        let [first, last] = [means[1] - means[0], means[3] - means[2]];
        let turns = last / first < 0.0;
        let is_shown = turns || -libm::log(last / first) >= quarter_s / time_constant_s;
        // In a part of a decay, the distance left is that which its speed covers in a time constant.
        let left = 2.0 * amplitude * (time_constant_s / (4.0 * quarter_s)).max(1.0);
        is_shown.then_some(Self { left, time_constant_s })
    }

    /// Returns the duration of a run that tells, when this one ends at a time.
    fn telling_s(&self, end_s: f64, count_rad: f64) -> Option<f64> {
        let quiet_s = end_s + self.time_constant_s * libm::log((self.left / QUIET_COUNTS / count_rad).max(1.0));
        quiet_s.is_finite().then(|| duration_s(quiet_s))
    }
}

/// Judges the motion in this column of a trace; `count_rad` is the angle, or length, of one encoder count.
pub fn judge(trace: &Trace, column: usize, count_rad: f64) -> Verdict {
    judge_rest(trace, column, count_rad, |_| None)
}

/// Judges the motion in this column of a trace; `slowest_s` returns the greatest time constant of the device at a
/// position, if it is known.
pub(crate) fn judge_rest(
    trace: &Trace,
    column: usize,
    count_rad: f64,
    slowest_s: impl Fn(f64) -> Option<f64>,
) -> Verdict {
    let window = Window::of(trace, column);
    let at_s = trace.time_of_s(window.start(trace));
    if !window.is_finite() {
        return Verdict::Diverged { at_s, amplitude_rad: f64::INFINITY };
    }
    let (rms_rad, mean) = window.rms_about_mean();
    let parts = window.parts();
    let [before, after, amplitude_rad] = [&parts[..4], &parts[4..], &parts].map(half_range);
    let swings = [0, 2, 4, 6].map(|of| half_range(&parts[of..of + 2]));
    if rms_rad < count_rad {
        let ascends = swings.windows(2).all(|pair| pair[1] > STEADY * pair[0]);
        let grows = ascends && swings[3] > GROWN * swings[0] && swings[3] > ROUNDED * count_rad;
        return if grows { Verdict::Diverged { at_s, amplitude_rad: after } } else { Verdict::Settled { rms_rad } };
    }
    let (passages, rows) = window.passages(mean, amplitude_rad);
    let frequency_hz = if passages > 1 { (passages - 1) as f64 / (rows * trace.step_s()) } else { 0.0 };
    let grows = after > GROWN * before;
    if grows && (passages > 1 || is_new(trace, column, &parts[4..])) {
        return Verdict::Diverged { at_s, amplitude_rad: after };
    }
    let rows_s = (trace.came() - window.start(trace)) as f64 * trace.step_s();
    let end_s = at_s + rows_s;
    let not_told = |approach: Option<Approach>| Verdict::NotTold {
        rms_rad,
        amplitude_rad,
        frequency_hz,
        telling_s: approach.and_then(|approach| approach.telling_s(end_s, count_rad)),
    };
    let rests = || (swings[3] < count_rad).then_some(Approach { left: swings[3], time_constant_s: 0.25 * rows_s });
    // Between five passages lie four periods, one in each quarter.
    let decay = if passages > PARTS as u64 {
        fading(&parts.map(|part| half_range(&[part])), rows_s)
    } else if passages > 4 {
        falling(&swings, 0.75, rows_s)
    } else {
        let turns = window.turns([mean - amplitude_rad, mean + amplitude_rad]);
        let turns = if passages > 1 { &turns[..] } else { &[] };
        let mut swings: Vec<f64> = turns.windows(2).map(|pair| 0.5 * (pair[1].1 - pair[0].1).abs()).collect();
        if swings.len() < 2 {
            let means = window.quarter_means();
            let approach = Approach::of_means(means, 0.25 * rows_s)
                .or_else(|| Approach::of_pole(means, 0.25 * rows_s, amplitude_rad, slowest_s(mean)?));
            return not_told(approach);
        }
        if swings.len() > 2 {
            // What a motion drifts meanwhile widens one swing and narrows the next.
            swings = swings.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        }
        let swing_s = (turns[turns.len() - 1].0 - turns[0].0) as f64 * trace.step_s() / (turns.len() - 1) as f64;
        falling(&swings, (swings.len() - 1) as f64 * swing_s / rows_s, rows_s)
    };
    if let Some(decay) = decay.or_else(rests) {
        return not_told(Some(decay));
    }
    Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz }
}

/// Whether a motion in these ranges is where it has not been in the run.
fn is_new(trace: &Trace, column: usize, ranges: &[[f64; 2]]) -> bool {
    let low = ranges.iter().fold(f64::INFINITY, |low, range| low.min(range[0]));
    let high = ranges.iter().fold(f64::NEG_INFINITY, |high, range| high.max(range[1]));
    low <= trace.least(column) || high >= trace.greatest(column)
}

/// Returns the root mean square and the greatest of the distances between positions and others. A run that does not
/// hold all of its rows is compared at those that it holds.
fn apart(positions: &[f64], others: impl Iterator<Item = f64>) -> [f64; 2] {
    let away: Vec<f64> = positions.iter().zip(others).map(|(x, other)| (x - other).abs()).collect();
    [mean_of(&away, |x| x * x).sqrt(), range(&away)[1]]
}

/// Judges how a device follows a target that moves in the judged window.
pub(crate) fn judge_target(trace: &Trace, column: usize, target: &AxisTarget) -> Verdict {
    let window = Window::of(trace, column);
    if !window.is_finite() {
        return Verdict::Diverged { at_s: trace.time_of_s(window.start(trace)), amplitude_rad: f64::INFINITY };
    }
    let rows = trace.held_from(window.start(trace))..trace.rows();
    let targets = rows.clone().map(|row| target.at(trace.time_s(row)));
    let [rms_m, greatest_m] = apart(&trace.real(column)[rows], targets);
    Verdict::Tracking { rms_m, greatest_m }
}

/// Judges how a device follows a hand that moves, along this path, until too late for a judged window; `slowest_s`
/// returns the greatest time constant of the device at a position, if it is known.
pub(crate) fn judge_hand(
    trace: &Trace,
    (column, count_rad): (usize, f64),
    (path, until_s): (&[(f64, f64)], f64),
    slowest_s: impl Fn(f64) -> Option<f64>,
) -> Verdict {
    let window = Window::of(trace, column);
    let from_s = trace.time_of_s(window.start(trace));
    if !window.is_finite() {
        return Verdict::Diverged { at_s: from_s, amplitude_rad: f64::INFINITY };
    }
    let rows = trace.held_from(window.start(trace))..trace.rows();
    let positions = positions_along(path, rows.clone().map(|row| trace.time_s(row)));
    let [rms_rad, greatest_rad] = apart(&trace.real(column)[rows], positions);
    // When the hand stands still, the device is not farther from its rest than from the hand.
    let time_constant_s = trace.last(column).and_then(slowest_s).unwrap_or(0.0);
    let approach = Approach { left: greatest_rad, time_constant_s };
    let telling_s = approach.telling_s(until_s, count_rad).unwrap_or_else(|| duration_s(until_s));
    Verdict::HandMoves { until_s, rms_rad, greatest_rad, telling_s }
}

/// The least time deep inside a wall after which its torque is judged.
const DEEP_S: f64 = 10e-3;
/// The share of what the wall is to give below which it gives none.
const NO_TORQUE: f64 = 0.1;

/// Returns the verdict on a motion inside a wall that gives no torque; `None` for any other. `push` is what the wall at
/// `wall_rad` is to give, `effort` the actuator's mean torque, and `deep_s` the time deep inside the wall, in the
/// judged window.
pub(crate) fn without_torque(
    trace: &Trace,
    column: usize,
    (wall_rad, push): (f64, Push),
    effort: f64,
    deep_s: f64,
) -> Option<Verdict> {
    if deep_s < DEEP_S {
        return None;
    }
    let rows = trace.judged_rows(column);
    // Comparisons alone, of numbers, are a few instructions for several rows at once.
    let depth = |angle_rad: f64| if angle_rad > wall_rad { angle_rad - wall_rad } else { 0.0 };
    let expected = mean_of(rows, |angle_rad| {
        let asked = push.stiffness * (angle_rad - wall_rad);
        let given = if asked < push.most { asked } else { push.most };
        if angle_rad > wall_rad { given } else { 0.0 }
    });
    // The positive direction leads into the wall.
    let effort = -effort;
    (effort < NO_TORQUE * expected).then(|| Verdict::NoWallTorque { effort, depth: mean_of(rows, depth) })
}

/// The rms below which a drop test is passive: 0.003 cm.
pub const PASSIVE_RMS_M: f64 = 30e-6;

/// Judges a drop test by the output `logged` of the trace, the coordinate as the counts tell it.
pub fn judge_drop(trace: &Trace, logged: usize, aborted: Option<Abort>) -> Verdict {
    if let Some(Abort { at_s, .. }) = aborted {
        return Verdict::HighlyUnstable { at_s };
    }
    let (rms_m, _) = Window::of(trace, logged).rms_about_mean();
    if rms_m < PASSIVE_RMS_M { Verdict::Passive { rms_m } } else { Verdict::NonPassive { rms_m } }
}

/// Judges how a segment follows its target, by the column of a trace with the distance between the two.
pub(crate) fn judge_following(trace: &Trace, column: usize) -> Verdict {
    let window = Window::of(trace, column);
    if !window.is_finite() {
        return Verdict::Diverged { at_s: trace.time_of_s(window.start(trace)), amplitude_rad: f64::INFINITY };
    }
    let (spread_m, mean_m) = window.rms_about_mean();
    let greatest_m = window.parts().into_iter().fold(0.0, |most: f64, part| most.max(part[1]));
    Verdict::Tracking { rms_m: libm::hypot(spread_m, mean_m), greatest_m }
}
