//! Values of options, as the command line has them.

use std::num::NonZeroUsize;
use std::time::Duration;

use crate::shell::Failure;

/// Returns a value, or the failure that says what to write.
pub fn value<T>(read: Option<T>, remedy: &str) -> Result<T, Failure> {
    read.ok_or_else(|| Failure::usage(remedy))
}

/// Reads a number with one of these units, each with its factor.
fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let read =
        |(unit, factor): &(&str, f64)| Some(text.trim().strip_suffix(unit)?.trim().parse::<f64>().ok()? * factor);
    units.iter().find_map(read)
}

/// Reads `KEY=VALUE`.
pub fn pair(text: &str) -> Result<(String, String), Failure> {
    let pair = text.split_once('=').map(|(key, value)| (key.to_string(), value.to_string()));
    value(pair, "write KEY=VALUE, as in wall.stiffness=2")
}

/// Reads the `NAME=VALUE` of a generic.
pub fn generic(text: &str) -> Result<(String, String), Failure> {
    value(pair(text).ok(), "write NAME=VALUE, as in WIDTH=14")
}

/// Reads `PORT=NET`.
pub fn port_and_net(text: &str) -> Result<(String, String), Failure> {
    value(pair(text).ok(), "write PORT=NET, as in pwm_o=a_high; the scene's name stands before --compare")
}

/// Reads a share above 0 and below 1.
pub fn share(text: &str) -> Result<f64, Failure> {
    let share = share_or_none(text).ok().filter(|share| *share > 0.0);
    value(share, "write a share between 0 and 1, as in 1% or 0.01")
}

/// Reads a share below 1.
pub fn share_or_none(text: &str) -> Result<f64, Failure> {
    let share = with_unit(text, &[("%", 0.01), ("", 1.0)]).filter(|share| (0.0..1.0).contains(share));
    value(share, "write a share below 1, as in 1% or 0.01")
}

/// Reads a time above zero.
pub fn time(text: &str) -> Result<Duration, Failure> {
    let seconds = with_unit(text, &[("ms", 1e-3), ("min", 60.0), ("s", 1.0), ("", 1.0)]);
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).filter(|time| !time.is_zero());
    value(time, "write a time above zero, as in 60s, 500ms or 5min")
}

/// Reads an instant of a run, in seconds from its start.
pub fn instant(text: &str) -> Result<f64, Failure> {
    let units = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("s", 1.0), ("", 1.0)];
    let seconds = with_unit(text, &units).filter(|seconds| (0.0..=1e6).contains(seconds));
    value(seconds, "write a time of the run, as in 1ms, 250us or 0.5s")
}

/// Reads a time limit in seconds.
pub fn limit(text: &str) -> Result<Duration, Failure> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=1e9).contains(seconds));
    value(seconds.map(Duration::from_secs_f64), "write a number of seconds from 0.001 to 1e9")
}

/// Reads seconds of motion.
pub fn seconds(text: &str) -> Result<f64, Failure> {
    let seconds = with_unit(text, &[("s", 1.0), ("", 1.0)]).filter(|seconds| *seconds > 0.0 && *seconds <= 3600.0);
    value(seconds, "write seconds above 0 and up to 3600, as in 2")
}

/// Reads a radius in metres.
pub fn length(text: &str) -> Result<f64, Failure> {
    let length = with_unit(text, &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)]);
    value(length.filter(|length| *length > 0.0 && *length <= 10.0), "write a radius up to 10 m, as in 50mm")
}

/// Reads a number of jobs.
pub fn jobs(text: &str) -> Result<NonZeroUsize, Failure> {
    value(text.trim().parse().ok(), "write a whole number from 1, as in 2")
}
