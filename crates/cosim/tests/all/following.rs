//! A controller that follows a target: the drivers agree, rest is where closed forms say, windup is what an independent
//! calculation of the sampled loop says, and a target may be written in other units.

use hpu_cosim::law::SampledLaw;
use hpu_cosim::scene::{Experiment, Metric, Scene};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Trace, Verdict, Wired, metric};

/// A motor that follows a step; the angle of the target's word is 683 counts.
const STEP: &str = r#"about = "A target."
clock = { frequency = "5 MHz" }
run = { duration = "1 s" }
device = { kind = "motor", motor = "vasudevan_2007", wheel_inertia = "200 g.cm2" }
hand = { kind = "none" }
encoder = { lines = 1024 }
target.path = [["50 ms", 0], ["50.001 ms", "60 deg"]]
[method]
kind = "pid"
sample_rate = "2 kHz"
position_bits = 13
stiffness_format = "(0,8,4)"
damping_format = "(0,8,4)"
integral_format = "(0,4,14)"
kp = "100 mN.m/rad"
kd = "2 mN.m.s/rad"
"#;

/// The position of one count.
const COUNT: f64 = std::f64::consts::TAU / 4096.0;

fn scene(text: &str, more: &[(&str, &str)]) -> Scene {
    let more: Vec<_> = more.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    Scene::parse("x.toml", text, &more, &mut |_| unreachable!("no file")).unwrap_or_else(|error| panic!("{error}"))
}

fn run(scene: &Scene, driver: Driver) -> (Summary, Trace) {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&["reference", "memory", "torque"]);
    let summary = simulation.run(driver, &mut trace, &mut (), &Control::default());
    (summary, trace)
}

fn peak_and_end(scene: &Scene) -> [f64; 2] {
    let (summary, trace) = run(scene, Driver::Events);
    let experiment = Experiment::Axis(scene.clone());
    [Metric::PeakAngle, Metric::FinalAngle].map(|which| metric(which, &experiment, &summary, &trace).unwrap())
}

#[test]
fn leaping_and_stepping_agree_on_targets_of_every_kind() {
    let short = [("run.duration", "60 ms"), ("target.path", "[[0, 0], [\"10 ms\", 0.5], [\"20 ms\", -0.2]]")];
    let sine = [("target.amplitude", "0.3"), ("target.frequency", "40"), ("target.from", "25 ms")];
    let law = [("model.datapath", "law"), ("model.bridge", "averaged")];
    let back = [("method.anti_windup", "back_calculation"), ("method.clamp", "20 mN.m")];
    let gains = [("method.ki", "2"), ("method.feed_forward", "2 mN.m.s/rad")];
    for more in [&sine[..], &[], &law, &back, &[("model.bridge", "averaged")]] {
        let scene = scene(STEP, &[&short[..], &gains, more].concat());
        let comparison = AxisSimulation::new(&scene).unwrap().compare(scene.edges());
        assert_eq!((comparison.mismatches, comparison.edges), (0, scene.edges()), "{more:?}: {:?}", comparison.first);
    }
}

#[test]
fn the_word_of_a_sample_is_the_count_nearest_to_the_target_there() {
    let sine = [("target.amplitude", "0.3"), ("target.frequency", "3"), ("target.from", "200 ms")];
    let scene = scene(STEP, &[&[("run.duration", "500 ms"), ("record.plant_rate", "2 kHz")][..], &sine].concat());
    let (_, trace) = run(&scene, Driver::Events);
    // A row a sample; the law reads the word in the clock cycle after it.
    let expected = |sample: usize| {
        let time_s = sample as f64 * 0.5e-3;
        let step = if time_s > 0.05 { 60f64.to_radians() } else { 0.0 };
        let swing = 0.3 * (std::f64::consts::TAU * 3.0 * (time_s - 0.2).max(0.0)).sin();
        ((step + swing) / COUNT).round() as i64
    };
    let [reference, memory] = [0, 1].map(|net| trace.words(net).to_vec());
    assert_eq!(reference.len(), 1001);
    for sample in 1..1001 {
        assert_eq!(reference[sample].rem_euclid(1 << 13), expected(sample), "{sample}");
        assert_eq!(memory[sample].rem_euclid(1 << 13), expected(sample - 1), "{sample}");
    }
}

#[test]
fn a_constant_load_leaves_no_error_at_rest_with_an_integral_gain_and_its_own_without() {
    let load = [("hand", "{ kind = \"constant_torque\", torque = \"10 mN.m\" }"), ("run.duration", "2 s")];
    let target = 60f64.to_radians();
    let [_, bare] = peak_and_end(&scene(STEP, &load));
    // The load over the gain that the word of 38 sixteenths realises, and the counter's floor of half a count.
    let kp = 38.0 / 16.0 * scene(STEP, &[]).words().unwrap().realised.torque_quantum_nm / COUNT;
    assert!((bare - target - 10e-3 / kp).abs() < 1.5 * COUNT, "{}", bare - target);
    let [_, held] = peak_and_end(&scene(STEP, &[&load[..], &[("method.ki", "1")]].concat()));
    assert!((held - target).abs() < 1.5 * COUNT, "{}", held - target);
}

#[test]
fn back_calculation_overshoots_less_than_clamping_as_an_independent_loop_says() {
    let gains = [("method.ki", "2"), ("method.clamp", "20 mN.m")];
    let peak = |way| peak_and_end(&scene(STEP, &[&gains[..], &[("method.anti_windup", way)]].concat()))[0];
    let [clamped, back] = ["clamping", "back_calculation"].map(peak);
    // The peaks of the same loop in steps of 5 us of a Runge-Kutta method, its controller in floats on whole counts.
    assert!((clamped - CLAMPED).abs() < 3e-3 && (back - BACK).abs() < 3e-3, "{clamped} {back}");
}

/// Those peaks.
const CLAMPED: f64 = 1.22249;
const BACK: f64 = 1.15994;

#[test]
fn a_target_that_rests_costs_nothing_and_one_that_moves_to_the_end_is_tracked() {
    let (summary, _) = run(&scene(STEP, &[("run.duration", "1000 s")]), Driver::Events);
    assert!(matches!(summary.verdict, Some(Verdict::Settled { .. })), "{:?}", summary.verdict);
    assert!(summary.ticks < 100_000, "{}", summary.ticks);
    assert_eq!((summary.contact_share, summary.device_contact_share), (None, None));
    // Straight on at 2 rad/s: without an integral gain the derivative and the back-EMF, K^2 / R, brake.
    let path = ("target.path", "[[0, 0], [1, 2]]");
    let (summary, _) = run(&scene(STEP, &[path, ("run.duration", "1 s")]), Driver::Events);
    let Some(Verdict::Tracking { rms_m, greatest_m }) = summary.verdict else { panic!("{:?}", summary.verdict) };
    let braking = 2e-3 + 0.0259 * 0.0259 / 2.345_660_377_358_490_3 + 1.3e-6;
    let lag = 2.0 * braking / 0.1;
    assert!((rms_m - lag).abs() < 0.02 * lag && greatest_m < 1.1 * lag, "{rms_m} {greatest_m} for {lag}");
    // With as much feed-forward nothing is left but the delay of a sample and counts.
    let ahead = ("method.feed_forward", "2.287 mN.m.s/rad");
    let (summary, _) = run(&scene(STEP, &[path, ahead, ("run.duration", "1 s")]), Driver::Events);
    let Some(Verdict::Tracking { rms_m, .. }) = summary.verdict else { panic!("{:?}", summary.verdict) };
    assert!(rms_m < 3.0 * COUNT, "{rms_m}");
}

#[test]
fn a_law_in_floats_follows_as_the_words_do_with_every_solver_and_encoder() {
    let gains = [("method.ki", "2"), ("method.clamp", "20 mN.m"), ("model.bridge", "averaged")];
    let [peak, end] = peak_and_end(&scene(STEP, &gains));
    let law = ("model.datapath", "law");
    for more in [
        &[law][..],
        &[law, ("model.solver", "rk4"), ("model.step", "100 us")],
        &[law, ("model.solver", "sample"), ("model.encoder", "ideal")],
        &[("model.solver", "sample"), ("model.encoder", "loaded")],
    ] {
        let found = peak_and_end(&scene(STEP, &[&gains[..], more].concat()));
        assert!((found[0] - peak).abs() < 10e-3 && (found[1] - end).abs() < 3.0 * COUNT, "{more:?}: {found:?}");
    }
}

#[test]
fn gains_and_target_may_be_written_in_the_units_of_another_body() {
    let network = |units: &str, method: &str| {
        let text = format!(
            "about = \"A target.\"\nclock = {{ frequency = \"1 MHz\" }}\nrun = {{ duration = \"20 ms\" }}\n\
             device.kind = \"network\"\ndevice.units_at = \"{units}\"\n\
             device.bodies.rotor = {{ inertia = \"50 g.cm2\" }}\ndevice.bodies.handle = {{ mass = \"30 g\" }}\n\
             device.joints.cable = {{ from = \"rotor\", to = \"handle\", ratio = 10, radius = \"60 mm\" }}\n\
             device.drive = {{ kind = \"current\", on = \"rotor\", torque_constant = \"23 mN.m/A\", \
             bandwidth = \"2 kHz\", dac = {{ full_scale = \"10 A\" }} }}\n\
             encoder = {{ on = \"rotor\", lines = 2000 }}\nhand.kind = \"none\"\n\
             method.kind = \"pid\"\nmethod.sample_rate = \"4 kHz\"\nmethod.position_bits = 16\n{method}\n"
        );
        scene(&text, &[])
    };
    // A radian of the rotor is 6 mm of the handle.
    let handle = network(
        "handle",
        "method.kp = \"10 kN/m\"\nmethod.ki = \"50 kN/m/s\"\nmethod.kd = \"20 N.s/m\"\n\
         method.feed_forward = \"5 N.s/m\"\nmethod.clamp = \"20 N\"\n\
         target.path = [[0, 0], [0.01, \"3 mm\"]]\ntarget.amplitude = \"0.6 mm\"\n\
         target.frequency = 30",
    );
    let rotor = network(
        "rotor",
        "method.kp = \"0.36 N.m/rad\"\nmethod.ki = \"1.8 N.m/rad/s\"\nmethod.kd = \"0.72 mN.m.s/rad\"\n\
         method.feed_forward = \"0.18 mN.m.s/rad\"\nmethod.clamp = \"0.12 N.m\"\n\
         target.path = [[0, 0], [0.01, 0.5]]\ntarget.amplitude = 0.1\ntarget.frequency = 30",
    );
    let of = |scene: &Scene| {
        let simulation = AxisSimulation::new(scene).unwrap();
        let words = simulation.words();
        let target = words.schedule.target.as_ref().unwrap();
        let path: Vec<i64> = (0..scene.edges()).step_by(250).map(|edge| target.word(edge)).collect();
        (words.stiffness, words.damping, simulation.wiring().block().generics(), path)
    };
    assert_eq!(of(&handle), of(&rotor));
    let mut law = hpu_cosim::law_as_asked(&rotor).unwrap().law;
    law.aim(0.1);
    assert!(law.sample(0.0) < 0.0, "it pushes towards the target");
}
