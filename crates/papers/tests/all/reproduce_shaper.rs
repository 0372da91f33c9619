//! The analog input shaper and energy bounding compared with the published results: the filter against closed forms,
//! the felt stiffness against the bounds that the algorithm promises, and the texts of the ladder.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use hpu_cosim::Control;
use hpu_papers::measure::filter::{CUTOFF_HZ, PERIOD_S, analog, bilinear, digital, exact, overshoots};
use hpu_papers::measure::{slope, told};
use hpu_papers::studies::comparison::Comparison;

fn comparison() -> Comparison {
    hpu_papers::studies::shipped("input-shaper")
}

/// `|1 - H|` by independent complex arithmetic; all digits were derived elsewhere.
const GAINS: [(f64, f64); 5] =
    [(1.0, 1.1344829), (2.5, 1.2247449), (10.0, 0.35833597), (100.0, 0.035360856), (130.0, 0.027198927)];

#[test]
fn the_closed_form_has_the_gains_that_were_derived() {
    for (frequency_hz, gain) in GAINS {
        assert!((exact(frequency_hz) / gain - 1.0).abs() < 5e-8, "{frequency_hz} Hz: {}", exact(frequency_hz));
    }
}

#[test]
fn the_plant_shaper_leaves_what_the_closed_form_does() {
    for (frequency_hz, _) in GAINS {
        // The sine is held for 1/N of a period, N = 1000. Its own part is off by (pi/N)^2/6. Of its images at k N -+ 1
        // times the frequency, with 1/(k N) each, 1 - H leaves at most sqrt(2) f_c/(k N f). Together that is below 2
        // zeta(2) sqrt(2) (f_c/f) / N^2.
        let images = PI * PI / 3.0 * 2f64.sqrt() * (CUTOFF_HZ / frequency_hz) * 1e-6;
        let bound = exact(frequency_hz) * PI * PI / 6.0 * 1e-6 + images;
        let off = (analog(frequency_hz) - exact(frequency_hz)).abs();
        assert!(off < bound, "{frequency_hz} Hz: {off:e} of {bound:e}");
    }
}

#[test]
fn the_words_leave_what_the_bilinear_transform_does() {
    for (frequency_hz, _) in GAINS {
        // Five coefficients are off by 2^-31 over |A|, and A is at least the smaller part of the denominator. The sine
        // is rounded to a count of 65535. The poles amplify half an LSB of 2^-16 by 1/(1 + A1 + A2) = 1/(w T)^2.
        let (w, s) = (2.0 * PI * CUTOFF_HZ * PERIOD_S, 2.0 * PI * frequency_hz * PERIOD_S);
        let poles = (w * w - s * s).hypot(2f64.sqrt() * w * s).min(1.0);
        let bound = 10.0 * 2f64.powi(-31) / poles + 4.0 / PI / 65535.0 + 2f64.powi(-17) / (w * w) / 65535.0;
        let off = (digital(frequency_hz) - bilinear(frequency_hz)).abs();
        assert!(off < bound, "{frequency_hz} Hz: {off:e} of {bound:e}");
    }
    // The cutoff is prewarped, so it stays where it was.
    assert!((bilinear(CUTOFF_HZ) - 1.5f64.sqrt()).abs() < 1e-12);
}

#[test]
fn a_step_overshoots_as_derived() {
    let [closed, analog, digital] = overshoots();
    assert!((closed - 1.20787958).abs() < 5e-9, "{closed}");
    // Read every 0.1 ms, so at most 0.05 ms beside the top, where |h''| < 2 sqrt(2) (w/sqrt 2)^2 e^-1.
    let w = 2.0 * PI * CUTOFF_HZ;
    let flat = 0.5 * (2f64.sqrt() * w * w * (-1f64).exp()) * 0.05e-3f64.powi(2);
    assert!(analog <= closed && closed - analog < flat, "{analog}");
    // The transform treats a step as a ramp of one sample: off by no more than one sample of the steepest slope,
    // sqrt(2) w.
    assert!((digital - closed).abs() < 2f64.sqrt() * w * PERIOD_S, "{digital}");
}

#[test]
fn a_ladder_is_told_by_its_first_rung_that_fails_and_those_that_settle_beyond() {
    let told = |rungs: &[(f64, bool, String)]| told(rungs, "kN/m");
    let rung =
        |k: u32, settled| (f64::from(k), settled, if settled { "settles".into() } else { format!("chatters at {k}") });
    assert_eq!(told(&[rung(10, true), rung(15, true)]), "settles throughout");
    assert_eq!(told(&[rung(10, false), rung(15, false)]), "settles nowhere; at 10 chatters at 10");
    let rungs = [rung(10, true), rung(15, false), rung(20, true), rung(25, false)];
    assert_eq!(told(&rungs), "settles up to 10 kN/m; at 15 chatters at 15; settles again at 20");
    assert!((slope(&[(0.0, 1.0), (1.0, 3.0), (4.0, 9.0)]) - 2.0).abs() < 1e-12);
}

/// Returns the text that the line of this group and name finds.
fn found(group: &str, what: &str) -> String {
    let comparison = comparison();
    let line = comparison.lines.iter().find(|line| line.group.starts_with(group) && line.what == what);
    (line.expect(what).measure)(&Control::default()).expect("not stopped").expect("measured").text
}

#[test]
fn what_is_felt_by_the_greatest_passive_force_is_twice_its_constant() {
    let text = found("Energy bounding by the greatest passive force", "no shaper, c1 = 10 N.s/m");
    assert!(text.starts_with("settles"), "{text}");
    let felt: f64 = text.split("displays ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
    // 20 kN/m over some 300 um, known in counts of 22 um: half a count at either end.
    assert!((felt / 20.0 - 1.0).abs() < 22.0 / 300.0, "{text}");
}

#[test]
fn a_constant_beyond_the_damping_chatters_without_a_shaper() {
    // b/T = 12.5 kN/m.
    for group in ["Energy bounding by c1", "Energy bounding by the greatest"] {
        for c1 in [20, 50] {
            let text = found(group, &format!("no shaper, c1 = {c1} N.s/m"));
            assert!(text.starts_with("chatters"), "{text}");
        }
    }
}

#[test]
fn every_line_has_its_own_name_and_what_ifs_claim_nothing() {
    let comparison = comparison();
    let names: BTreeSet<_> = comparison.lines.iter().map(|line| (line.group, &line.what)).collect();
    assert_eq!(names.len(), comparison.lines.len());
    assert!(comparison.lines.iter().all(|line| !line.group.starts_with("What if") || line.published.is_empty()));
}
