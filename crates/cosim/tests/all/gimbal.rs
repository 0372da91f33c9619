//! The segment on a gimbal: lag, rendered stiffness, drivers, energy and refusals, against closed forms.

use hpu_cosim::scene::{Experiment, GimbalScene, shipped};
use hpu_cosim::{Control, Driver, GIMBAL_REALS, GimbalSimulation, Simulation, Summary, Trace, Verdict, Wired};

pub(super) fn scene(name: &str, set: &[(&str, &str)]) -> GimbalScene {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    match shipped.parse(&set).unwrap_or_else(|error| panic!("{error}")) {
        Experiment::Gimbal(scene) => scene,
        _ => panic!("{name} is no gimbal"),
    }
}

/// Returns the reason for which a changed scene is refused; `None` if it is accepted.
pub(super) fn refusal(name: &str, set: &[(&str, &str)]) -> Option<String> {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    shipped.parse(&set).err().map(|error| error.to_string())
}

pub(super) fn run(scene: &GimbalScene) -> (Summary, Trace) {
    let simulation = GimbalSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    (summary, trace)
}

pub(super) fn column(name: &str) -> usize {
    GIMBAL_REALS.iter().position(|real| real.name == name).expect("a column")
}

/// Returns the mean of a term over the rows of the last second.
fn late_mean(trace: &Trace, term: impl Fn(&dyn Fn(&str) -> f64) -> f64) -> f64 {
    let rows = trace.rows();
    let last = rows - 1000..rows;
    let sum: f64 = last.clone().map(|row| term(&|name| trace.real(column(name))[row])).sum();
    sum / last.len() as f64
}

#[test]
fn a_steady_tilt_comes_late_by_what_no_load_speed_and_gain_say() {
    // At a constant speed w the drive is w / w0, which the error w / (w0 K1) asks for: late by 1 / (w0 K1). A drive is
    // held for a sample and taken at the next instant of the bus: another 1.5 ms. Gravity asks for at most
    // 0.05 kg 9.81 m/s2 0.058 m sin(40 deg) = 18 mN.m of the 5.3 N.m that full drive gives, or 2.3 mrad of error.
    for (gain, speed_deg) in [("1.5", 20.0), ("3", 20.0), ("1.5", -20.0)] {
        let [from, to] = [-2.0, 2.0].map(|way| way * speed_deg);
        let path = format!("[[0, \"12.5 mm\", \"{from} deg\", 0], [4, \"12.5 mm\", \"{to} deg\", 0]]");
        let target = format!("{{ kind = \"path\", path = {path} }}");
        let scene =
            scene("gimbal-shape", &[("target", &target), ("method.proportional", gain), ("run.duration", "4 s")]);
        let (_, trace) = run(&scene);
        let behind_rad = late_mean(&trace, |at| {
            let pitch = |x: &str, y: &str, z: &str| at(z).atan2(at(x).hypot(at(y)));
            pitch("target_x_m", "target_y_m", "target_z_m") - pitch("tip_x_m", "tip_y_m", "tip_z_m")
        });
        let (speed, gain) = (f64::to_radians(speed_deg), gain.parse::<f64>().unwrap());
        let expected_s = 1.0 / (6.702 * gain) + 1.5e-3;
        let gravity_s = 0.018 / 5.3 / gain / speed.abs();
        let lag_s = behind_rad / speed;
        assert!((lag_s - expected_s).abs() < gravity_s + 2e-3, "{gain}, {speed}: {lag_s} s, not {expected_s}");
    }
}

#[test]
fn a_finger_feels_the_spring_less_the_weight_that_the_force_feedback_leaves() {
    // At rest the crank's torque balances force and weight: Fd + Kf (Fd - F) = F + m g. So F = Fd - m g / (1 + Kf).
    // The crank is read to half a position, 33 um of radius; a drive LSB is 0.118 N.m / 1024 / 12 mm = 10 mN of push,
    // of which the feedback leaves a share of 1 / (1 + Kf).
    let cases = [
        (750.0, 2.0, 9.81),
        (1000.0, 4.0, 9.81),
        (1500.0, 4.0, 9.81),
        (1000.0, 10.0, 9.81),
        (750.0, 2.0, 1.62),
        (750.0, 2.0, 20.0),
    ];
    for (stiffness, force_gain, gravity) in cases {
        let set = [
            ("surface.stiffness", &*format!("{stiffness}")),
            ("method.force_gain", &format!("{force_gain}")),
            ("device.gravity", &format!("{gravity}")),
        ];
        let (summary, trace) = run(&scene("gimbal-spring", &set));
        assert_eq!(summary.contact_share, Some(1.0), "{stiffness} N/m");
        let force_n = late_mean(&trace, |at| at("finger_force_n"));
        let depth_m = 67.5e-3 - late_mean(&trace, |at| at("tip_radius_m"));
        let expected_n = stiffness * depth_m - 0.05 * gravity / (1.0 + force_gain);
        let bound_n = stiffness * 33e-6 + 0.02;
        assert!((force_n - expected_n).abs() < bound_n, "{stiffness}, {force_gain}: {force_n} N, not {expected_n}");
    }
}

#[test]
fn events_and_clock_agree_in_contact_and_over_switches() {
    // A slow clock, so that few edges contain many samples.
    let set = [
        ("clock.frequency", "2 MHz"),
        ("finger.path", "[[0, \"20 mm\"]]"),
        ("run.duration", "0.6 s"),
        ("expect", "{}"),
    ];
    let scene = scene("gimbal-switch", &set);
    let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&["mode"]);
    simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    let switches = trace.words(0).windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(switches >= 6, "{switches}");
    let comparison = simulation.compare(1_200_000);
    assert_eq!((comparison.mismatches, comparison.edges), (0, 1_200_000), "{:?}", comparison.first);
}

#[test]
fn energy_of_servos_and_finger_is_stored_or_dissipated() {
    for name in ["gimbal-shape", "gimbal-spring", "gimbal-switch"] {
        let (summary, _) = run(&scene(name, &[]));
        let energy = summary.energy;
        assert!(energy.exchanged_j > 1e-3, "{name}");
        assert!(energy.residual_j.abs() < 1e-12 * energy.exchanged_j, "{name}: {energy:?}");
        assert_eq!(energy.hand_j != 0.0, name != "gimbal-shape", "{name}");
    }
}

#[test]
fn a_hysteresis_holds_the_touch_that_rattles_without() {
    let verdict = |name: &str, set: &[(&str, &str)]| run(&scene(name, set)).0.verdict.expect("it ends");
    assert!(matches!(verdict("gimbal-switch", &[]), Verdict::LimitCycle { frequency_hz, .. } if frequency_hz > 5.0));
    assert!(matches!(verdict("gimbal-switch-held", &[]), Verdict::Settled { .. }));
    let moved =
        verdict("gimbal-switch-held", &[("switch.latched", "true"), ("switch.bumpless", "false"), ("expect", "{}")]);
    assert!(matches!(moved, Verdict::LimitCycle { .. }), "{moved:?}");
}

#[test]
fn random_profiles_stay_in_their_ranges_rest_at_their_points_and_follow_from_seed_and_number() {
    let of = |seed: &str, profile: &str| {
        let target = format!("{{ kind = \"random\", interval = \"0.5 s\", profile = {profile} }}");
        scene("gimbal-shape", &[("target", &target), ("run.seed", seed)]).target
    };
    let target = of("1", "1");
    assert_eq!(target, of("1", "1"));
    for other in [of("1", "2"), of("2", "1")] {
        assert_ne!(target.points, other.points);
    }
    assert_eq!(target.points.len(), 41);
    let [height, pitch, roll] = target.bounds();
    assert!(height[0] >= 6.5e-3 && height[1] <= 18.5e-3 && height[1] - height[0] > 9e-3, "{height:?}");
    for tilt in [pitch, roll] {
        let most = f64::to_radians(30.0);
        assert!(tilt[0] >= -most && tilt[1] <= most && tilt[1] - tilt[0] > most, "{tilt:?}");
    }
    for (time_s, posture) in &target.points[1..40] {
        // The quintic leaves its point by 10 (t/T)^3 of the way: 1e-8 of it after a thousandth of the interval.
        for near_s in [time_s - 5e-4, time_s + 5e-4] {
            for (at, point) in target.at(near_s).into_iter().zip(posture) {
                assert!((at - point).abs() < 1.2e-8, "{at} near {point}");
            }
        }
    }
}

#[test]
fn what_no_device_can_do_is_refused_where_it_stands() {
    let path = |posture: &str| format!("[[0, {posture}]]");
    for (set, expected) in [
        (("target.path", &*path("\"26 mm\", 0, 0")), "heights from 26 mm to 26 mm; the crank reaches 0 to 25 mm"),
        (("target.path", &path("\"12 mm\", \"56 deg\", 0")), "at most 55 to either side"),
        (("target.path", &path("\"12 mm\", 0, \"-56 deg\"")), "at most 55 to either side"),
        (("target.path", "[[0, \"12 mm\", 0]]"), "target.path[0]: not a list of 4"),
        (("finger.path", "[[1, \"12 mm\"], [1, \"13 mm\"]]"), "times must increase: 1 s follows 1 s"),
        (("switch.off", "0.6 N"), "above switch.on; write at most 0.5 N"),
        // A gain of -1 would make force and torque a loop without a delay.
        (("method.force_gain", "-1"), "method.force_gain: `-1` must not be negative"),
        (("method.force_gain", "16"), "method.force_gain"),
        (("method.sample_rate", "600 kHz"), "but the datapath takes 96"),
        (("method.proportional", "25"), "does not fit (0,16,4); write at most 20.37"),
        (("surface.stiffness", "20 N/mm"), "does not fit (0,0,16)"),
        (("device.rod", "12 mm"), "write more than device.crank, 0.0125 m"),
        (("hand.kind", "none"), "hand: unknown key"),
    ] {
        let message = refusal("gimbal-spring", &[set]).expect("refused");
        assert!(message.contains(expected), "{set:?}: {message}");
    }
}
