//! The passivity observer's blind spots: energy between samples, stored credit, standstill.

use hpu_cosim::Trace;

use super::axis::{near, range, rows, run, scene, speeds};
use super::sampling::bounce;

#[test]
fn the_published_observer_does_not_see_the_leak_and_the_exact_one_stops_it() {
    for share in [0.0, 0.25, 0.7] {
        let plain = bounce("leak-bounce", share, &[]).0;
        let (blind, least) = bounce("popc-velocity", share, &[]);
        // The forces are rounded by one count, 2 N / 65536, of about 1 N.
        near(blind, plain, 1e-3);
        assert!(least >= 0, "{least}");
        let (seen, least) = bounce("popc-held-force", share, &[]);
        assert!(least < 0 && seen < 1.0 + 0.02 * (plain - 1.0), "{seen}, with a debt of {least}");
    }
}

/// Returns the energy outside the wall of 100 g under 0.2 N toward the wall.
fn outside_j(trace: &Trace, from_s: f64, to_s: f64) -> Vec<f64> {
    let span = rows(trace, from_s, to_s);
    let places = trace.angles_rad()[span.clone()].iter().zip(&speeds(trace)[span]);
    places.filter(|(x, _)| **x < 10e-3).map(|(x, v)| 0.05 * v * v + 0.2 * (10e-3 - x)).collect()
}

#[test]
fn with_credit_a_controller_acts_only_when_all_is_given_back() {
    let thrown_j = 0.05 * 0.1f64.powi(2) + 0.2 * 0.1e-3;
    let (_, trace) = run(&scene("popc-credit", &[]), &[]);
    // The wall kept most of the energy for a while, and then gave it all back.
    assert!(range(&outside_j(&trace, 0.05, 0.25)).1 < 0.25 * thrown_j);
    let (low, high) = range(&outside_j(&trace, 1.4, 2.0));
    near(low, thrown_j, 0.03);
    near(high, thrown_j, 0.03);
}

#[test]
fn with_a_bound_on_the_credit_it_acts_in_time() {
    let (_, trace) = run(&scene("popc-credit-bounded", &[]), &[]);
    let (first, last) = (outside_j(&trace, 0.05, 0.25), outside_j(&trace, 1.4, 2.0));
    // Bounces that grow by the leak, some 60 ms each, would have grown sixteenfold.
    assert!(range(&last).1 < 1.17 * range(&first).1, "{:?} {:?}", range(&first), range(&last));
}

#[test]
fn at_standstill_a_debt_stays_and_the_force_is_the_plain_walls() {
    let scene = scene("popc-standstill", &[]);
    let stiffness = scene.words().expect("valid").stiffness;
    let (_, trace) = run(&scene, &["memory", "penetration", "command"]);
    let end = rows(&trace, 2.0, 3.0);
    let ends = [0, 1, 2].map(|net| range(&trace.words(net)[end.clone()]));
    for (low, high) in ends {
        assert_eq!(low, high);
    }
    let [(debt, _), (depth, _), (command, _)] = ends;
    assert!(debt < 0 && depth > 0, "{debt} at {depth}");
    assert_eq!(command, (depth * stiffness).div_euclid(16));
}
