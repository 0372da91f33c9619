//! The price of a method: the felt stiffness, and the force in the first tenth of a second, are less than asked for.

use hpu_cosim::law::high_pass;

use super::axis::{near, range, run, scene};

/// Returns the force over the depth between a quarter and the whole of 2 mm, in N/m, on the way in; full scale is 25 N,
/// and a count 5 um.
fn felt(name: &str, overrides: &[(&str, &str)]) -> f64 {
    let (_, trace) = run(&scene(name, overrides), &["penetration", "command"]);
    let at = |depth: i64| {
        let row = trace.words(0).iter().position(|found| *found >= depth).expect("as deep");
        (trace.words(0)[row] as f64 * 5e-6, trace.words(1)[row] as f64 * 25.0 / 65_536.0)
    };
    let ((shallow_m, less_n), (deep_m, more_n)) = (at(100), at(395));
    (more_n - less_n) / (deep_m - shallow_m)
}

#[test]
fn behind_energy_bounding_a_wall_is_as_stiff_as_its_bound() {
    // A sample is one count deep, and two such errors are 1 % of the span.
    near(felt("capped-stiffness", &[]), 5e3, 0.01);
    near(felt("capped-stiffness", &[("method.form", "force_bound")]), 10e3, 0.01);
    near(felt("capped-stiffness", &[("wall.stiffness", "4 kN/m")]), 4e3, 0.01);
}

#[test]
fn behind_a_coupling_a_wall_is_as_stiff_as_both_in_series() {
    near(felt("capped-coupling", &[]), 1.0 / (1.0 / 5e3 + 1.0 / 20e3), 0.01);
    near(felt("capped-coupling", &[("method.rigid", "true")]), 5e3, 0.01);
}

#[test]
fn a_shaped_push_lacks_what_the_high_pass_takes_and_never_exceeds_the_wall() {
    let (_, trace) = run(&scene("shaped-push", &[]), &["torque", "shaped"]);
    let whole = range(trace.words(0)).1;
    assert_eq!(range(trace.words(1)).1, whole);
    assert!(trace.words(0).iter().zip(trace.words(1)).all(|(asked, given)| given <= asked));
    // The mass is in contact from 100.2 ms to 101 ms, and the step is taken at the middle of that. The rise of 0.8 ms
    // and the sample of 1 ms are 2 % of the rise of 1 - H, which takes 45 ms by its slope at the start.
    for after_ms in [10.0, 20.0, 26.3, 40.0, 60.0, 80.0, 150.0] {
        let row = ((100.6 + 0.5 + after_ms) * 1e-3 / trace.interval_s()).round() as usize;
        let z = std::f64::consts::SQRT_2 * std::f64::consts::PI * 2.5 * after_ms * 1e-3;
        let passed = (1.0 - (-z).exp() * (z.cos() - z.sin())).min(1.0);
        let found = trace.words(1)[row] as f64 / whole as f64;
        assert!((found - passed).abs() < 0.03, "{after_ms} ms: {found}, not {passed}");
    }
}

#[test]
fn the_filter_alone_overshoots_by_the_known_share_which_the_rectifier_cuts_off() {
    let [b0, b1, b2, a1, a2] = high_pass(2.5, 1e-3);
    let (mut u, mut h) = ([0.0; 2], [0.0; 2]);
    let rests: Vec<f64> = (0..1000)
        .map(|_| {
            let now = b0 + b1 * u[0] + b2 * u[1] - a1 * h[0] - a2 * h[1];
            (u, h) = ([1.0, u[0]], [now, h[0]]);
            1.0 - now
        })
        .collect();
    let most = range(&rests).1;
    near(most, 1.0 + (-0.5 * std::f64::consts::PI).exp(), 1e-3);
    let at = rests.iter().position(|rest| *rest == most).expect("there");
    assert!(at.abs_diff(141) <= 1, "{at} ms");
}
