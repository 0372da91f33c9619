//! The 3-DOF device beside its paper: lags, sag and stiffness against closed forms.

use hpu_cosim::Control;
use hpu_papers::studies::comparison::Found;

/// Returns the text and the figures that the line of this group and name finds.
fn found(group: &str, what: &str) -> Found {
    let comparison = hpu_papers::studies::shipped("three-dof");
    let line = comparison.lines.iter().find(|line| line.group.starts_with(group) && line.what.starts_with(what));
    (line.expect(what).measure)(&Control::default()).expect("not stopped").expect("measured")
}

/// Returns the first number of a text after these words, without its unit.
fn number(text: &str, after: &str) -> f64 {
    text.split(after).nth(1).and_then(|rest| rest.split_whitespace().next()).unwrap().parse().unwrap()
}

/// A servo under a gain of K1 full drives per rad answers as `1 / (1 + s tau)`, `tau = 1 / (K1 w)` with its no-load
/// speed `w`, late by `atan(2 pi f tau) / (2 pi f)` at a frequency `f`, and half a period of bus and sample more.
fn lag_ms(full_drives_per_rad: f64, frequency_hz: f64) -> f64 {
    let (tau, speed) = (1.0 / (full_drives_per_rad * 6.702), std::f64::consts::TAU * frequency_hz);
    1e3 * (speed * tau).atan() / speed
}

#[test]
fn the_lag_is_that_of_the_servo_s_no_load_speed() {
    // The sines of the pitch have 0.07 and 0.17 Hz; the mean lag lies between theirs.
    for (what, gain) in [("K1 = 1.5 full drives/rad", 1.5), ("K1 = 3 full", 3.0), ("K1 = 1.5 N.m/rad", 0.283)] {
        let text = found("Shape", what).text;
        let pitch = number(&text, "(height), ");
        let [most, least] = [0.07, 0.17].map(|frequency_hz| lag_ms(gain, frequency_hz));
        assert!((least - 1.0..most + 3.0).contains(&pitch), "{what}: {pitch} ms; closed form {least} to {most} ms");
    }
}

/// Slow, what is left of the height's error is the weight over the stiffness of position control; at 12.5 mm the lever
/// is near its greatest, 12.4 mm. 50 g against 5 g differ by the weight of 45 g.
#[test]
fn the_weight_sags_as_position_control_gives_way() {
    let mean = |what: &str| number(&found("Shape", what).text, "mean ");
    let heavy = mean("K1 = 1.5, 0.36 times as fast, segment of 50 g");
    let light = mean("K1 = 1.5, 0.36 times as fast, segment of 5 g");
    let sag_mm = 1e3 * 0.045 * 9.81 * 12.4e-3f64.powi(2) / (1.5 * 0.118);
    // The distance from the target is that of lag and sag at right angles, at most their sum.
    assert!(heavy > 1e3 * 0.05 * 9.81 * 12e-3f64.powi(2) / (1.5 * 0.118), "{heavy} mm");
    assert!(heavy - light > 0.0 && heavy - light < sag_mm, "{heavy} mm, {light} mm, {sag_mm} mm");
}

/// `F = k d - m g / (1 + K_f)`, so that the force over the depth is short of the stiffness by the sag over the depth.
#[test]
fn the_stiffness_is_short_by_the_sag() {
    let found = found("Stiffness", "1 N/mm, K_f = 4");
    let [error, force] = found.figures[..] else { panic!("{found:?}") };
    // From 1 mm to the end, 6 mm and 6 N: the mean of 98 mN over the depth, and a count of 64 um of either size.
    let (from, to) = (1e-3, force / 1000.0);
    let mean = 0.05 * 9.81 / 5.0 * (f64::ln(to / from)) / (to - from);
    let count = 1000.0 * 64e-6 * f64::ln(to / from) / (to - from);
    assert!(error > 0.0 && error < mean + count, "{error} N/m; {mean} and {count}");
    assert!((5.0..6.5).contains(&force), "{force} N");
}
