//! A PHANToM's delay and its transmission.

use hpu_cosim::scene::{Experiment, OutcomeKind, shipped};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

fn outcome(name: &str, overrides: &[(&str, &str)]) -> Option<OutcomeKind> {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("shipped");
    let scene: Experiment = scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"));
    let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default()).outcome()
}

#[test]
fn one_sample_of_delay_divides_the_stiffness_that_a_rigid_mass_rests_on_by_nine() {
    // The tip rests where a bounce gains as much as friction takes: ln((w + f) / (w - f)) = pi omega (T/2 + t_d), with
    // 90 g.
    let limit_n_per_m = |delay_s: f64| {
        let share: f64 = (0.15 + 0.038) / (0.15 - 0.038);
        0.09 * (share.ln() / (std::f64::consts::PI * (0.5e-3 + delay_s))).powi(2)
    };
    let (prompt, late) = (limit_n_per_m(0.0), limit_n_per_m(1e-3));
    assert!((prompt - 9785.13552).abs() < 1e-4 && (late - 1087.23728).abs() < 1e-4, "{prompt} {late}");
    // The arm's own mass depends on its pose: by a fifth either way.
    for (limit, delay) in [(late, "1"), (prompt, "0")] {
        for (share, found) in [(0.8, OutcomeKind::Passive), (1.2, OutcomeKind::NonPassive)] {
            let k = (share * limit).to_string();
            let drop = [("room.stiffness", k.as_str()), ("model.delay", delay), ("run.duration", "10 s")];
            assert_eq!(outcome("phantom-late", &drop), Some(found), "{k} N/m, {delay} samples late");
        }
    }
    assert_eq!(outcome("phantom-late", &[]), Some(OutcomeKind::NonPassive));
    assert_eq!(outcome("phantom-late", &[("room.stiffness", "2 kN/m")]), Some(OutcomeKind::HighlyUnstable));
    assert_eq!(outcome("phantom-late", &[("model.delay", "0")]), Some(OutcomeKind::Passive));
}

#[test]
fn a_soft_transmission_chatters_on_a_wall_that_a_rigid_one_rests_on() {
    assert_eq!(outcome("phantom-flexible", &[]), Some(OutcomeKind::NonPassive));
    assert_eq!(outcome("phantom-flexible", &[("model.transmission_stiffness", "0")]), Some(OutcomeKind::Passive));
}
