//! Power scaling compared with the published results: runaway, growth and sameness against independent integrations and
//! closed forms.

use std::collections::BTreeSet;

use hpu_cosim::Control;
use hpu_papers::studies::comparison::Comparison;

const MASS_KG: f64 = 1.0;
const DAMPING_N_S_PER_M: f64 = 0.1;
const USER_N: f64 = 10.0;

fn comparison() -> Comparison {
    hpu_papers::studies::shipped("power-scaling")
}

/// Returns the length, in s, of a straight ramp of the scale that has the same impulse as the scale `1/beta` while
/// `beta` goes straight from 1 to `to` in `seconds`.
fn equal_impulse_s(to: f64, seconds: f64) -> f64 {
    2.0 * to.ln() / (to - 1.0) * seconds
}

/// Returns the text that the line of this group and name finds.
fn found(group: &str, what: &str) -> String {
    let comparison = comparison();
    let line = comparison.lines.iter().find(|line| line.group.starts_with(group) && line.what.starts_with(what));
    (line.expect(what).measure)(&Control::default()).expect("not stopped").expect("measured").text
}

/// Returns the first number of a text after these words, without its unit.
fn number(text: &str, after: &str) -> f64 {
    text.split(after).nth(1).and_then(|rest| rest.split_whitespace().next()).unwrap().parse().unwrap()
}

/// Returns the mass's position at 20 s, in m, with a bilateral spring of 10 N/m that is scaled from 10 s on: by Runge
/// and Kutta's fourth order.
fn runs_to_m(scale: impl Fn(f64) -> f64) -> f64 {
    let acceleration = |t: f64, x: f64, v: f64| (USER_N - 10.0 * scale(t) * x - DAMPING_N_S_PER_M * v) / MASS_KG;
    let (steps, h) = (1_000_000, 1e-5);
    let (mut x, mut v) = (1.0, 0.0);
    for step in 0..steps {
        let t = h * f64::from(step);
        let (a1, v1) = (acceleration(t, x, v), v);
        let (a2, v2) = (acceleration(t + 0.5 * h, x + 0.5 * h * v1, v + 0.5 * h * a1), v + 0.5 * h * a1);
        let (a3, v3) = (acceleration(t + 0.5 * h, x + 0.5 * h * v2, v + 0.5 * h * a2), v + 0.5 * h * a2);
        let (a4, v4) = (acceleration(t + h, x + h * v3, v + h * a3), v + h * a3);
        x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    x
}

#[test]
fn beta_as_printed_lets_the_user_run_away_as_derived() {
    let hyperbola = runs_to_m(|t| 1.0 / (1.0 + 999.0 * t.min(1.0)));
    assert!((hyperbola - 341.0).abs() < 0.5, "{hyperbola}");
    // The straight ramp of equal impulse ends there too: it gives the same push, within the first 14 ms.
    let ramp_s = equal_impulse_s(1e3, 1.0);
    let straight = runs_to_m(|t| 1.0 - 0.999 * (t / ramp_s).min(1.0));
    assert!((straight - hyperbola).abs() < 0.05, "{straight}");
    // The energy-level spring lags by T/2 times the sum of v dv over x, below T a t = 0.1 m, and so pulls by 1 mN less:
    // 5 cm in 10 s. The scale's word is a thousandth to 0.06 %: of 0.01 N/m over 120 m on average for 50 s^2, this
    // makes 4 cm. Two digits are printed.
    for spring in ["energy-level spring, 1 s", "the same in floats, 1 s"] {
        let text = found("Fig. 4 as printed", spring);
        let end_m = number(&text, "ends at ");
        assert!((end_m - straight).abs() < 0.05 + 0.04 + 0.01, "{text}");
    }
}

#[test]
fn a_hyperbola_and_its_straight_line_push_alike() {
    let (steps, to) = (1_000_000, 1e3);
    let hyperbola: f64 = (0..steps).map(|i| 1.0 / (1.0 + (to - 1.0) * (f64::from(i) + 0.5) / f64::from(steps))).sum();
    // The part above the final thousandth; for a straight line this is half of its length.
    let above = hyperbola / f64::from(steps) - 1.0 / to;
    let straight = 0.5 * equal_impulse_s(to, 1.0) * (1.0 - 1.0 / to);
    // They differ by what the line lacks: a thousandth for its length, and the rectangle rule's error of (to/steps)^2.
    assert!((above - straight).abs() < 1.001 / to, "{above} {straight}");
}

#[test]
fn a_plain_spring_grows_where_its_period_exceeds_twice_damping_over_stiffness() {
    for (what, period_s) in [("plain, T = 1 ms", 1e-3), ("plain, T = 0.25 ms", 0.25e-3)] {
        let growth: f64 = found("A swing of 5 mm", what).parse().unwrap();
        // lambda|^2 = det(Phi - Gamma K) of the held spring, exactly.
        let decay = (-DAMPING_N_S_PER_M * period_s / MASS_KG).exp();
        let speed = (1.0 - decay) / DAMPING_N_S_PER_M;
        let place = (period_s - MASS_KG * speed) / DAMPING_N_S_PER_M;
        let (k, fade) = (400.0, MASS_KG * speed);
        let determinant = (1.0 - k * place) * decay + k * speed * fade;
        let exact = 0.5 * determinant.ln() / period_s;
        // From an edge of an encoder line to the force there are two edges of the synchronizer, one of the counter and
        // one of the hold, each 1 us, and one more or less depending on where edges fall. A delay t adds k t/2m, 0.6 to
        // 1.2 per mille.
        let [least, most] = [3e-6, 6e-6].map(|delay_s| exact + 0.5 * 400.0 * delay_s / MASS_KG);
        // Ranges of 10 mm known to a count of 2 um and to 1/8000 of a sampled top; two of them, 8 s apart; four digits.
        let bound = 2.0 * (2e-6 / 5e-3 + 1.25e-4) / 8.0 + 0.5e-4;
        assert!(growth > least - bound && growth < most + bound, "{what}: {growth}, {exact}");
    }
}

#[test]
fn stiffness_and_scale_take_the_mass_the_same_way_until_it_leaves() {
    for spring in ["energy-level spring, 1 s", "the same in floats, 1 s"] {
        let text = found("k times 40", spring);
        let mut words = text.split_whitespace();
        let (apart, unit) = (words.next().unwrap().parse::<f64>().unwrap(), words.next().unwrap());
        let apart_m = apart * if unit == "um" { 1e-6 } else { 1e-3 };
        // Words of the scale to 2^-15 and of the stiffness to 2^-16, of up to 150 N: 7 mN, and 2 mN of floors; for half
        // a second.
        assert!(
            unit != "m" && apart_m < 0.5 * (150.0 * (2f64.powi(-15) + 2f64.powi(-16)) + 2e-3) * 0.5 * 0.5 + 0.2e-3,
            "{text}"
        );
    }
}

#[test]
fn every_line_has_its_own_name_and_what_ifs_claim_nothing() {
    let comparison = comparison();
    let names: BTreeSet<_> = comparison.lines.iter().map(|line| (line.group, &line.what)).collect();
    assert_eq!(names.len(), comparison.lines.len());
    assert!(comparison.lines.iter().all(|line| !line.group.starts_with("What if") || line.published.is_empty()));
}
