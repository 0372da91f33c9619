//! Every solver: drivers agree on stepped worlds, and results converge to those of the exact flow as the step shrinks.

use hpu_cosim::scene::{Device, Experiment, Metric, Scene, Solver, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Trace, Verdict, Wired, metric};
use hpu_signal::{Cycle, Observe};

const METHODS: [&str; 4] = ["euler", "semi_implicit", "midpoint", "rk4"];

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).map(Experiment::axis).unwrap_or_else(|error| panic!("{error}")).unwrap()
}

fn run(scene: &Scene) -> (Summary, Trace) {
    let simulation = AxisSimulation::new(scene).unwrap();
    let mut trace = simulation.trace(&["command"]);
    let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::default());
    (summary, trace)
}

fn number(which: Metric, scene: &Scene, summary: &Summary, trace: &Trace) -> f64 {
    metric(which, &Experiment::Axis(scene.clone()), summary, trace).unwrap()
}

#[track_caller]
fn agree(name: &str, overrides: &[(&str, &str)], edges: u64) {
    let comparison = AxisSimulation::new(&parsed(name, overrides)).unwrap().compare(edges);
    assert_eq!((comparison.mismatches, comparison.edges), (0, edges), "{name} {overrides:?}: {:?}", comparison.first);
}

const MOVING: [(&str, &str); 2] = [("device.initial_angle", "1.45 rad"), ("device.initial_speed", "60 rad/s")];

#[test]
fn drivers_agree_on_stepped_motors() {
    for method in METHODS {
        for step in ["20 ns", "1 us", "30.5 us"] {
            let stepped = [("model.solver", method), ("model.step", step)];
            agree("hybrid-wall", &[&MOVING[..], &stepped].concat(), 400_000);
        }
        let stepped = [("model.solver", method), ("model.step", "0.7 us")];
        for rest in [
            &[("host.late", "1"), ("host.latency", "37.3 us")][..],
            &[("host.late", "1"), ("model.bridge", "averaged")],
            &[("method.pwm.off", "float"), ("device.coulomb_friction", "8 mN.m"), ("method.pwm.dead_time", "2 us")][..],
            &[("model.bridge", "averaged"), ("model.winding", "resistive"), ("device.coulomb_friction", "8 mN.m")],
            &[
                ("device.coulomb_friction", "8 mN.m"),
                ("model.friction", "smoothed"),
                ("model.friction_speed", "2 rad/s"),
            ],
        ] {
            agree("conventional-wall-10khz", &[&MOVING[..], &stepped, rest].concat(), 400_000);
        }
    }
}

#[test]
fn drivers_agree_on_stepped_masses_hands_and_ramps() {
    let rk4 = [("model.solver", "rk4"), ("model.step", "3.3 us")];
    for name in ["rail-drop", "shaped-push", "prescribed-sweep", "stiffening-wall", "energy-level-wall", "one-tick"] {
        agree(name, &rk4, 1_000_000);
    }
}

#[test]
fn drivers_agree_where_a_step_is_a_sample_period() {
    let sample = ("model.solver", "sample");
    for name in ["rail-drop", "stiffening-wall"] {
        agree(name, &[sample], 1_000_000);
    }
    for name in ["conventional-wall-10khz", "energy-level-wall"] {
        agree(name, &[&MOVING[..], &[sample, ("model.bridge", "averaged")]].concat(), 1_000_000);
    }
}

/// Every row and every change of the nets.
#[derive(Default, PartialEq, Debug)]
struct Dense {
    rows: Vec<(u64, Vec<u64>)>,
    changes: Vec<(u64, Vec<i64>)>,
}

impl Observe for Dense {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.changes.last().is_none_or(|(_, last)| last != words) {
            self.changes.push((cycle.0, words.to_vec()));
        }
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.rows.push((cycle.0, values.iter().map(|value| value.to_bits()).collect()));
    }
}

#[test]
fn drivers_show_the_same_rows_and_the_same_energies_of_a_stepped_world() {
    for model in [
        &[("model.solver", "midpoint"), ("model.step", "1 us")][..],
        &[
            ("model.solver", "euler"),
            ("model.step", "1 us"),
            ("model.bridge", "averaged"),
            ("model.winding", "resistive"),
        ],
        &[("model.solver", "sample"), ("model.bridge", "averaged")],
    ] {
        // Rows on the ends of steps, and between them.
        let fixed = [("run.duration", "5 ms"), ("record.plant_rate", "200 kHz")];
        let scene = parsed("conventional-wall-10khz", &[&MOVING[..], model, &fixed].concat());
        let simulation = AxisSimulation::new(&scene).unwrap();
        let shown = [Driver::Events, Driver::Clock].map(|driver| {
            let mut dense = Dense::default();
            let summary = simulation.run(driver, &mut simulation.trace(&[]), &mut dense, &Control::default());
            (dense, summary.energy, summary.steps, summary.encoder_edges)
        });
        assert!(shown[0] == shown[1], "{model:?}");
        assert_eq!(shown[0].0.rows.len(), 1_001);
    }
}

/// Returns the greatest error of an angle. One step of delay of the datapath's outputs, and one of the method's, shift
/// an impact at this speed by this distance; a spring that follows the counts may reverse it one count sooner or later.
fn within(scene: &Scene, trace: &Trace, step_s: f64) -> f64 {
    let count_rad = if scene.method.kind.is_live() { scene.encoder.count_rad() } else { 0.0 };
    count_rad + 2.0 * step_s * trace.real(1).iter().fold(0.0, |most: f64, speed| most.max(speed.abs()))
}

fn converges(name: &str, model: &[(&str, &str)], steps: [(&str, f64); 2]) {
    let exact = parsed(name, model);
    let (truth, reference) = run(&exact);
    let depth = number(Metric::PeakPenetration, &exact, &truth, &reference);
    for method in METHODS {
        for (step, step_s) in steps {
            let scene = parsed(name, &[model, &[("model.solver", method), ("model.step", step)]].concat());
            let (summary, trace) = run(&scene);
            let error = (number(Metric::PeakPenetration, &scene, &summary, &trace) - depth).abs();
            assert_eq!(summary.outcome(), truth.outcome(), "{name} {method} {step}");
            let bound = within(&exact, &reference, step_s);
            assert!(error <= bound, "{name} {method} {step}: {error:e} > {bound:e}");
        }
    }
}

#[test]
fn every_method_comes_to_the_exact_flow_of_a_motor_in_words() {
    let strike = [("model.bridge", "averaged"), ("run.duration", "0.7 s"), ("record.plant_rate", "100 kHz")];
    converges("hybrid-wall", &strike, [("10 us", 10e-6), ("2 us", 2e-6)]);
}

#[test]
fn every_method_comes_to_the_exact_flow_of_a_mass_in_words() {
    let drop = [("run.duration", "1.5 s"), ("record.plant_rate", "100 kHz")];
    converges("rail-drop", &drop, [("20 us", 20e-6), ("4 us", 4e-6)]);
}

#[test]
fn every_method_comes_to_the_exact_flow_of_a_law_without_a_clock() {
    let law = ("model.datapath", "law");
    let drop = [law, ("run.duration", "1.5 s"), ("record.plant_rate", "100 kHz")];
    converges("rail-drop", &drop, [("20 us", 20e-6), ("4 us", 4e-6)]);
    let strike = [law, ("model.bridge", "averaged"), ("run.duration", "0.7 s"), ("record.plant_rate", "100 kHz")];
    converges("hybrid-wall", &strike, [("10 us", 10e-6), ("2 us", 2e-6)]);
}

#[test]
fn an_averaged_bridge_without_a_clock_takes_its_duty_when_its_modulator_does() {
    // The modulator of 82 us takes the command of a sample late; without that delay the peak is off by 1.5 mrad. Within
    // a step the change acts by its mean: at 4e4 rad/s2 and 10 us this is 4 urad a sample. Methods of the first order
    // would read other counts at samples.
    let peak = |solver: &[(&str, &str)]| {
        let model = [("model.datapath", "law"), ("model.bridge", "averaged"), ("run.duration", "50 ms")];
        let scene = parsed("thrown-conventional", &[&model[..], solver].concat());
        let (summary, trace) = run(&scene);
        number(Metric::PeakPenetration, &scene, &summary, &trace)
    };
    let by_events = peak(&[]);
    for method in ["midpoint", "rk4"] {
        let in_steps = peak(&[("model.solver", method), ("model.step", "10 us")]);
        assert!((by_events - in_steps).abs() < 2e-5, "{method}: {by_events} {in_steps}");
    }
}

#[test]
fn the_mean_of_pulses_has_their_area_and_their_first_moment() {
    // A mean that took its duty at the middle of the pulse that ends was 0.3 % off. In antiphase the gates begin with a
    // pulse of half a period, worth V T / 4 or, without a hand, V T / (4 k) = 20 mrad; no mean reproduces the ripple of
    // 0.14 N.m.
    let motion = |name: &str, model: &[(&str, &str)], which: Metric| {
        let scene = parsed(name, model);
        let (summary, trace) = run(&scene);
        number(which, &scene, &summary, &trace)
    };
    let throw = [("device.coulomb_friction", "0"), ("method.pwm.dead_time", "0"), ("device.initial_speed", "60 rad/s")];
    let with = |more: &[(&'static str, &'static str)]| [&throw[..], more].concat();
    for (name, model, within) in [
        ("conventional-wall-100hz", vec![], 2e-6),
        ("thrown-conventional", with(&[("method.pwm.mode", "sign_magnitude")]), 3e-5),
        ("thrown-conventional", with(&[]), 1e-3),
    ] {
        let peak = |more: &[(&str, &str)]| motion(name, &[&model[..], more].concat(), Metric::PeakPenetration);
        let (switching, averaged) = (peak(&[]), peak(&[("model.bridge", "averaged")]));
        assert!((switching - averaged).abs() < within, "{name}: {switching} rad by pulses, {averaged} by their mean");
    }
}

#[test]
fn a_law_without_a_clock_starts_at_the_count_of_one_with_a_clock() {
    // 5 mm are 500 counts of 10 um, although their quotient in floats is less than 500.
    let deepest = |solver: &[(&str, &str)]| {
        let scene =
            parsed("weak-wall", &[&[("model.datapath", "law"), ("record.plant_rate", "100 kHz")], solver].concat());
        let (summary, trace) = run(&scene);
        number(Metric::PeakPenetration, &scene, &summary, &trace)
    };
    let (by_events, in_steps) = (deepest(&[]), deepest(&[("model.solver", "midpoint"), ("model.step", "1 us")]));
    assert!((by_events - in_steps).abs() < 1e-6, "{by_events} {in_steps}");
}

#[test]
fn a_sampled_law_in_steps_of_its_period_is_exact() {
    // Nothing is left out: in both runs the device flows exactly and meets the law only at samples.
    for friction in ["0 N", "38 mN"] {
        let model = [("model.datapath", "law"), ("run.duration", "3 s"), ("device.coulomb", friction)];
        let exact = parsed("rail-drop", &model);
        let stepped = parsed("rail-drop", &[&model[..], &[("model.solver", "sample")]].concat());
        let [(a, of_a), (b, of_b)] = [&exact, &stepped].map(run);
        let [last_a, last_b] =
            [number(Metric::FinalAngle, &exact, &a, &of_a), number(Metric::FinalAngle, &stepped, &b, &of_b)];
        assert!((last_a - last_b).abs() < 1e-12, "{last_a} {last_b}");
        assert!((a.energy.source_j - b.energy.source_j).abs() < 1e-12 * a.energy.exchanged_j);
        assert_eq!(b.steps, 3_000 + 1);
    }
}

#[test]
fn an_ideal_encoder_rests_where_the_springs_balance() {
    let model = [("model.bridge", "averaged"), ("model.datapath", "law"), ("model.encoder", "ideal")];
    let scene = parsed("hybrid-wall", &[&model[..], &[("model.solver", "rk4"), ("model.step", "10 us")]].concat());
    let (summary, trace) = run(&scene);
    // 0.3 (1.8 - x) = k (x - 1.5), where k is a whole number of PWM counts per count, 36 for 1.5 N.m/rad: as many
    // 4096ths of the stall torque per 4096th of a turn.
    let Device::Motor(motor) = &scene.device else { panic!("a motor") };
    let stiffness = 36.0 * (24.0 * motor.torque_constant_nm_per_a / motor.resistance_ohm) / std::f64::consts::TAU;
    let rest = (0.3 * 1.8 + stiffness * 1.5) / (0.3 + stiffness);
    assert!((number(Metric::FinalAngle, &scene, &summary, &trace) - rest).abs() < 1e-12);
    assert_eq!(summary.encoder_edges, 0);
}

#[test]
fn steps_too_long_for_the_winding_are_given_up_and_judged_diverged() {
    // L / R is 96 us.
    for datapath in ["words", "law"] {
        let scene = parsed(
            "hybrid-wall",
            &[
                ("model.bridge", "averaged"),
                ("model.datapath", datapath),
                ("model.solver", "euler"),
                ("model.step", "1 ms"),
            ],
        );
        let (summary, _) = run(&scene);
        assert!(matches!(summary.verdict, Some(Verdict::Diverged { .. })), "{datapath}: {:?}", summary.verdict);
        assert!(summary.aborted.is_some_and(|abort| abort.why.contains("diverge")), "{datapath}");
    }
}

#[test]
fn a_summary_counts_steps_and_says_what_an_event_is() {
    let counts = |datapath, solver: Solver| {
        let step = if solver.is_fixed_step() { &[("model.step", "10 us")][..] } else { &[] };
        let model = [("model.datapath", datapath), ("run.duration", "0.1 s"), ("model.solver", solver.name())];
        let (summary, _) = run(&parsed("rail-drop", &[&model[..], step].concat()));
        assert_eq!(summary.edges, 5_000_000);
        (summary.steps, summary.events() - summary.mode_changes, summary.ticks)
    };
    let (steps, events, ticks) = counts("words", Solver::Events);
    assert_eq!((steps, events), (0, ticks));
    let (steps, events, ticks) = counts("words", Solver::Rk4);
    assert_eq!((steps, events), (10_000, ticks + 10_000));
    let (steps, events, ticks) = counts("law", Solver::Rk4);
    // The first sample cuts a step short after one clock, and the last step is the remainder.
    assert_eq!((steps, events, ticks), (10_001, 10_001, 10_001));
    assert_eq!(counts("law", Solver::Sample).0, 101);
}

#[test]
fn a_live_spring_of_a_law_takes_its_stiffness_whenever_that_changes() {
    // The wall has no damping, so that the sample rate has no effect.
    let at = |rate: &str| {
        let law = [("model.datapath", "law"), ("method.sample_rate", rate), ("run.duration", "1 s")];
        run(&parsed("stiffening-wall", &law)).1
    };
    let (slow, fast) = (at("1 kHz"), at("8 kHz"));
    assert_eq!(slow.angles_rad(), fast.angles_rad());
}

#[test]
fn a_live_spring_without_a_clock_is_of_the_second_order() {
    // An undamped oscillation inside a wall that stiffens, with the true position: half the step leaves a quarter of
    // the error.
    let at = |method: &str, step: &str| {
        let law = [("model.datapath", "law"), ("model.encoder", "ideal"), ("run.duration", "1 s")];
        let steps = [("model.solver", method), ("model.step", step)];
        let (_, trace) = run(&parsed("stiffening-wall", &[&law[..], &steps].concat()));
        trace.angles_rad().to_vec()
    };
    for method in ["midpoint", "rk4"] {
        let [coarse, fine, finest] = ["40 us", "20 us", "10 us"].map(|step| at(method, step));
        let worst = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let ratio = worst(&coarse, &fine) / worst(&fine, &finest);
        assert!((ratio - 4.0).abs() < 0.6, "{method}: {ratio}");
    }
}

/// A mass whose hand imposes its motion, so that what it does to the force does not come back.
const IMPOSED: &str = r#"
about = "A mass on an amplifier."
clock.frequency = "1 MHz"
run.duration = "80 ms"
device = { kind = "mass", mass = "0.1 kg", damping = 0 }
encoder.resolution = "1 um"
amplifier.full_scale = "10 N"
method = { kind = "conventional", sample_rate = "1 kHz", position_bits = 16, stiffness_format = "(0,16,4)" }
wall = { position = "1 mm", stiffness = "250 N/m" }
hand = { kind = "prescribed", path = [["0 s", 0], ["30 ms", "5 mm"], ["60 ms", "2 mm"], ["80 ms", "8 mm"]] }
"#;

/// Returns the force on the mass a clock before each sample.
fn before_samples(more: &str) -> Vec<f64> {
    let text = format!("{IMPOSED}record.plant_rate = \"1 kHz\"\n{more}");
    let none = &mut |_: &str| Err(std::io::Error::other("no file"));
    let scene = Scene::parse("imposed.toml", &text, &[], none).unwrap_or_else(|error| panic!("{error}\n{text}"));
    run(&scene).1.real(0).to_vec()
}

/// The motion is imposed, so a host that is late by whole samples moves the forces by as many rows. Of one that is late
/// by a quarter of a sample, the mean over a step of a sample is a quarter of the force before and three of the present
/// one; but the words' command leaves two clocks after the sample.
#[test]
fn a_host_hands_on_commands_in_fixed_steps() {
    let steps = ["model.solver = \"sample\"\n", "model.solver = \"rk4\"\nmodel.step = \"170 us\"\n"];
    for how in ["model.datapath = \"law\"\n", "model.encoder = \"loaded\"\n"] {
        for solver in steps {
            let more = format!("{how}{solver}");
            let plain = before_samples(&more);
            assert!(plain.iter().filter(|force| force.abs() > 0.1).count() > 40, "{more}: {plain:?}");
            for late in [1, 3] {
                let later = before_samples(&format!("{more}host.late = {late}\n"));
                assert_eq!(plain[..plain.len() - late], later[late..], "{more}, {late}");
            }
        }
        let more = format!("{how}{}", steps[0]);
        let (plain, later) = (before_samples(&more), before_samples(&format!("{more}host.latency = \"250 us\"\n")));
        for (pair, later) in plain.windows(2).zip(&later[1..]) {
            let mean = 0.25 * pair[0] + 0.75 * pair[1];
            assert!((mean - later).abs() <= 0.003 * (pair[0] - pair[1]).abs() + 1e-12, "{more}: {mean}, {later}");
        }
    }
}

/// Behind a host that makes a wall swing, fixed steps come to the motion of the exact flow: of a bridge whose latch
/// takes a duty once a period, of one that takes it at once, and of an amplifier. What is left is less than a hundredth
/// of what the host does.
#[test]
fn steps_behind_a_host_converge() {
    let motor = "about = \"A motor.\"\nclock.frequency = \"1 MHz\"\nrun.duration = \"80 ms\"\n\
                 device = { kind = \"motor\", motor = \"vasudevan_2007\", initial_angle = 0.02 }\n\
                 method = { kind = \"conventional\", sample_rate = \"1 kHz\", pwm.bits = 9, WHEN }\n\
                 wall = { position = \"0.01 rad\", stiffness = \"1 N.m/rad\" }\nmodel.bridge = \"averaged\"\n\
                 hand = { kind = \"spring_damper\", stiffness = \"0.3 N.m/rad\", damping = \"1 mN.m.s/rad\", \
                 path = [[\"0 s\", 0.02], [\"1 ms\", 0.03]] }\n";
    let held = "hand = { kind = \"spring_damper\", stiffness = \"500 N/m\", damping = \"5 N.s/m\"";
    let mass = IMPOSED.replace("hand = { kind = \"prescribed\"", held);
    let latched = motor.replace("WHEN", "pwm.duty = \"latched\"");
    let at_once = motor.replace("WHEN", "pwm.duty = \"immediate\"");
    for text in [&mass, &latched, &at_once] {
        let end = |more: &str| {
            let none = &mut |_: &str| Err(std::io::Error::other("no file"));
            let text = format!("{text}{more}");
            let scene = Scene::parse("a.toml", &text, &[], none).unwrap_or_else(|error| panic!("{error}\n{text}"));
            run(&scene).1.angles_rad().to_vec()
        };
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let host = "host = { late = 1, latency = \"137 us\" }\n";
        let (exact, on_time) = (end(host), end(""));
        let span = apart(&exact, &on_time);
        let mut best = f64::INFINITY;
        for step in ["64 us", "16 us", "4 us"] {
            let how = format!("{host}model.encoder = \"loaded\"\nmodel.solver = \"rk4\"\nmodel.step = \"{step}\"\n");
            let off = apart(&exact, &end(&how)) / span;
            best = off.min(best);
        }
        assert!(best < 0.01, "{best}");
    }
}
