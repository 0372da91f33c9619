//! The verdict on the motion. It is a result, never an error, because stability maps are made of verdicts.
//!
//! The rule applies to the angle recorded over the last 30 % of the run (the published drop test judges the last 3 s of
//! 10 s):
//!
//! 1. **settled** when its rms about its own mean is below one encoder count, and its oscillation does not grow. It
//!    grows if the half-range of the window's last quarter is more than 1.5 times that of the first, and each quarter
//!    has at least half of the share of that growth that steady growth would give it (a factor of 1.07). Then the
//!    motion has diverged, however small it still is. Growth below [`unseen_growth_per_s`] is not seen in the window
//!    and counts as rest;
//! 2. **diverged** when its half-range in the later half of that window exceeds 1.5 times that in the earlier half, or
//!    when it is not finite;
//! 3. **limit cycle** otherwise, with that half-range as amplitude. Its frequency counts upward passages of the mean,
//!    each after a passage below by a quarter of the amplitude. A motion that has not come to rest but has no period
//!    either (a hand still on its way) is also classified here, at 0 Hz.
//!
//! A motion inside a wall that pushes with nothing is none of these, whatever it does: **no wall torque**. The device
//! is at least [`DEEP_COUNTS`](crate::DEEP_COUNTS) counts inside the wall for at least 10 ms of the window, and the
//! actuator pushes it out, on the average over the window, with less than a tenth of what the wall is to give: its
//! stiffness times the mean penetration, as far as the actuator goes. The stiffness is that which the words realise, or
//! that to which the method limits it. Of a design of the user's own no stiffness is known; its wall is taken to be a
//! tenth as stiff as the hand's grip, or to give a tenth of a hand's constant push, or, where nothing is known of the
//! hand, a hundredth of what the actuator can.
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
//! tip and target.

use crate::scene::Push;
use crate::trace::Trace;
use crate::window::{Streamed, passage, quarter, range};

/// The verdict on a motion, with the numbers it was decided on.
#[derive(Clone, Copy, PartialEq, Debug)]
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
    /// A segment that follows a moving target.
    Tracking {
        /// rms of the distance between tip and target.
        rms_m: f64,
        /// The greatest distance.
        greatest_m: f64,
    },
    /// A drop test that had to be aborted.
    HighlyUnstable {
        /// The time of the abort.
        at_s: f64,
    },
}

/// A run that the world ended early.
#[derive(Clone, Copy, PartialEq, Debug)]
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

    /// Returns the least and the greatest value of each quarter.
    fn quarters(&self) -> [[f64; 2]; 4] {
        match self {
            Self::Held(rows) => {
                [0, 1, 2, 3].map(|of| range(&rows[quarter(rows.len(), of)..quarter(rows.len(), of + 1)]))
            }
            Self::Streamed(streamed, ..) => streamed.quarters(),
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

/// Judges the motion in this column of a trace; `count_rad` is the angle, or length, of one encoder count.
pub fn judge(trace: &Trace, column: usize, count_rad: f64) -> Verdict {
    let window = Window::of(trace, column);
    let at_s = trace.time_of_s(window.start(trace));
    if !window.is_finite() {
        return Verdict::Diverged { at_s, amplitude_rad: f64::INFINITY };
    }
    let (rms_rad, mean) = window.rms_about_mean();
    let quarters = window.quarters();
    let [before, after, amplitude_rad] = [&quarters[..2], &quarters[2..], &quarters].map(half_range);
    if rms_rad < count_rad {
        let swings = quarters.map(|quarter| half_range(&[quarter]));
        let ascends = swings.windows(2).all(|pair| pair[1] > STEADY * pair[0]);
        let grows = ascends && swings[3] > GROWN * swings[0] && swings[3] > ROUNDED * count_rad;
        return if grows { Verdict::Diverged { at_s, amplitude_rad: after } } else { Verdict::Settled { rms_rad } };
    }
    if after > GROWN * before {
        return Verdict::Diverged { at_s, amplitude_rad: after };
    }
    let (passages, rows) = window.passages(mean, amplitude_rad);
    let frequency_hz = if passages > 1 { (passages - 1) as f64 / (rows * trace.step_s()) } else { 0.0 };
    Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz }
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
    let depth = |angle_rad: f64| (angle_rad - wall_rad).max(0.0);
    let expected = mean_of(rows, |angle_rad| {
        let depth = depth(angle_rad);
        if depth == 0.0 { 0.0 } else { push.most.min(push.stiffness * depth) }
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
    let greatest_m = window.quarters().into_iter().fold(0.0, |most: f64, quarter| most.max(quarter[1]));
    Verdict::Tracking { rms_m: libm::hypot(spread_m, mean_m), greatest_m }
}
