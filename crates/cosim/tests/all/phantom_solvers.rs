//! The solvers of a PHANToM's scene: the drivers agree with every solver, and fine steps give the results of the
//! series.

use crate::common::phantom;
use hpu_cosim::scene::{PhantomScene, Solver, shipped};
use hpu_cosim::{Control, PhantomSimulation, Simulation, Summary, Trace, Verdict, Wired};

const STEPPED: [Solver; 4] = [Solver::Euler, Solver::SemiImplicit, Solver::Midpoint, Solver::Rk4];

fn run(scene: &PhantomScene) -> (Summary, Trace) {
    let simulation = PhantomSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&[]);
    (simulation.run(simulation.driver(), &mut trace, &mut (), &Control::default()), trace)
}

fn with(name: &str, solver: Solver, step: &str, more: &[(&str, &str)]) -> PhantomScene {
    let step = [("model.solver", solver.name()), ("model.step", step)];
    let length = if solver.is_fixed_step() { 2 } else { 1 };
    phantom(name, &[more, &step[..length]].concat())
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn leaping_and_stepping_agree_on_every_solver() {
    for solver in STEPPED {
        for (platform, step) in [("FPGA-400", "1 us"), ("FPGA-100", "13 us"), ("RTOS-20", "7 us")] {
            for lag in ["0", "0.4 ms"] {
                let thrown = [
                    ("drop.speed", "1 m/s"),
                    ("platform.kind", platform),
                    ("room.distance", "0.5 mm"),
                    ("run.duration", "6 ms"),
                    ("model.amplifier_lag", lag),
                ];
                let scene = with("phantom-thrown", solver, step, &thrown);
                let (summary, _) = run(&scene);
                let said = format!("{solver:?} {platform} {step}");
                assert_eq!((summary.edges, summary.steps), (300_000, 300_000 / scene.step_clocks()), "{said}");
                assert!(summary.encoder_edges > 60 && summary.output_changes > 0, "{said}");
                let comparison = PhantomSimulation::new(&scene).unwrap().compare(300_000);
                assert_eq!((comparison.edges, comparison.mismatches), (300_000, 0), "{said}: {:?}", comparison.first);
            }
        }
    }
}

/// Returns the rms of a thrown tip's verdict.
fn thrown_rms_m(solver: Solver, step: &str) -> f64 {
    let (summary, _) = run(&with("phantom-thrown", solver, step, &[("run.duration", "100 ms")]));
    match summary.verdict {
        Some(Verdict::NonPassive { rms_m }) => rms_m,
        other => panic!("{solver:?} {step}: {other:?}"),
    }
}

#[test]
fn a_thrown_tip_wanders_as_far_but_for_commands_that_wait_for_the_next_step() {
    let exact_m = thrown_rms_m(Solver::Events, "");
    let mut last_m = f64::INFINITY;
    for (step, step_s) in [("40 us", 40e-6), ("20 us", 20e-6), ("10 us", 10e-6), ("5 us", 5e-6)] {
        let error_m = (thrown_rms_m(Solver::Rk4, step) - exact_m).abs();
        // A tip at 1 m/s at most meets the wall one step late, and is released one step late.
        assert!(error_m <= 2.0 * step_s && error_m < last_m, "{step}: {error_m} m of {exact_m} m");
        last_m = error_m;
    }
}

#[test]
fn a_drop_in_fine_steps_has_the_verdict_and_the_rms_of_the_exact_run() {
    let (exact, reference) = run(&with("phantom-drop", Solver::Events, "", &[]));
    let Some(Verdict::Passive { rms_m: exact_m }) = exact.verdict else { panic!("{:?}", exact.verdict) };
    let step_s = 40e-6;
    let (summary, trace) = run(&with("phantom-drop", Solver::Rk4, "40 us", &[]));
    let Some(Verdict::Passive { rms_m }) = summary.verdict else { panic!("{:?}", summary.verdict) };
    // Friction holds both tips at the end, each on one count.
    assert!((rms_m - exact_m).abs() < 1e-12, "{rms_m} m, not {exact_m} m");
    // Before the wall, friction lets go one step late at most; the acceleration by gravity, with the mass of tip and
    // weight, is below 2 m/s^2.
    for row in 0..150 {
        let (time_s, error_m) = (1e-3 * row as f64, (trace.real(1)[row] - reference.real(1)[row]).abs());
        assert!(error_m <= 2.0 * step_s * time_s + 1e-12, "{error_m} m at {time_s} s");
    }
    assert!((trace.real(1)[150] + 0.0141).abs() < 1e-3, "still falling: {} m", trace.real(1)[150]);
}

#[test]
fn solvers_that_a_phantom_has_not_and_steps_without_one_are_refused() {
    let drop = shipped().iter().find(|scene| scene.name == "phantom-drop").expect("a shipped scene");
    for (overrides, said) in [
        (vec![("model.solver", "sample")], "`sample` is none of \"events\", \"clock\", \"euler\""),
        (vec![("model.solver", "rk4")], "model.step: missing"),
        (vec![("model.step", "1 us")], "model.step: \"events\" has no step of its own"),
        (vec![("model.solver", "rk4"), ("model.step", "0")], "model.step"),
    ] {
        let overrides: Vec<_> = overrides.into_iter().map(|(key, value)| (key.into(), value.into())).collect();
        let error = drop.parse(&overrides).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
