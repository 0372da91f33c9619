//! The criteria of a switched touch and the watch of switches, against closed forms and another way of integrating.

use hpu_cosim::scene::{Experiment, GimbalScene};
use hpu_cosim::{Control, Driver, GimbalSimulation, Simulation, SplitMix64, Summary, Wired};
use hpu_prove::criteria::touch::{Criteria, NAMES};
use hpu_study::gimbal::{Switches, TouchLimits};

pub fn scene(name: &str, set: &[(&str, &str)]) -> GimbalScene {
    let shipped = hpu_cosim::scene::shipped().iter().find(|scene| scene.name == name).expect("shipped");
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    match shipped.parse(&set).expect("valid") {
        Experiment::Gimbal(scene) => scene,
        _ => panic!("{name} is no scene of a gimbal"),
    }
}

fn criteria(set: &[(&str, &str)]) -> Criteria {
    Criteria::of(&scene("gimbal-switch", set)).expect("a touch")
}

/// Runs a scene under the watch of its switches.
fn watched(scene: &GimbalScene) -> (Summary, Switches, Vec<i64>) {
    let simulation = GimbalSimulation::new(scene).expect("possible");
    let mut trace = simulation.trace(&["mode"]);
    let mut switches = Switches::of(scene, &simulation);
    let summary = simulation.run(Driver::Events, &mut trace, &mut switches, &Control::default());
    (summary, switches, trace.words(0).to_vec())
}

const WEIGHT_N: f64 = 0.05 * 9.81;
const PAD_N_PER_M: f64 = 1500.0;

/// A pad of 1.5 N/mm goes 2 mm below the target. At rest, `k_d d - m g/(1 + K_f)` is the force of the pad.
#[test]
fn a_finger_rests_on_the_spring_that_is_asked_for() {
    for (asked, gain) in [(300.0, 4.0), (1000.0, 2.0), (2000.0, 10.0)] {
        let set = [("surface.stiffness", format!("{asked} N/m")), ("method.force_gain", gain.to_string())];
        let [rest] = [criteria(&set.each_ref().map(|(key, value)| (*key, value.as_str()))).rests[1]];
        let sag_n = WEIGHT_N / (1.0 + gain);
        let depth_m = (PAD_N_PER_M * 2e-3 + sag_n) / (asked + PAD_N_PER_M);
        assert!((rest.force_n - PAD_N_PER_M * (2e-3 - depth_m)).abs() < 1e-9, "{rest:?}");
    }
}

/// Position control is a spring of `K1 stall / lever^2` where it is asked to be. By the data sheets and item 21 of the
/// known answers' formula of the lever, at a height of 22 mm: 1.5 * 0.118 N.m.
#[test]
fn position_control_is_the_spring_of_its_lever() {
    let (l1, l2, r) = (0.0125, 0.058, 0.0455 + 0.022);
    let cosine: f64 = (r * r + l1 * l1 - l2 * l2) / (2.0 * r * l1);
    let sine = (1.0 - cosine * cosine).sqrt();
    let lever = l1 * sine * (1.0 + l1 * cosine / (l2 * l2 - l1 * l1 * sine * sine).sqrt());
    let stiffness = 1.5 * 0.118 / (lever * lever);
    let found = criteria(&[]);
    assert!((found.position_n_per_m / stiffness - 1.0).abs() < 1e-9, "{found:?} {stiffness}");
    // At rest: the drive carries weight and pad, so that its force at the radius is theirs.
    let rest = found.rests[0];
    let crank = |r: f64| f64::acos((r * r + l1 * l1 - l2 * l2) / (2.0 * r * l1));
    let now: f64 = crank(rest.radius_m);
    let lever = l1 * now.sin() * (1.0 + l1 * now.cos() / (l2 * l2 - l1 * l1 * now.sin() * now.sin()).sqrt());
    let outward_n = 1.5 * 0.118 * (now - crank(r)) / lever;
    assert!((outward_n - rest.force_n - WEIGHT_N).abs() < 1e-9, "{outward_n} {rest:?}");
}

/// The growth from pulse to pulse is that of the loop integrated in small steps: position and force of 1 ms before a
/// pulse make the drive, which is held for 4 ms.
#[test]
fn the_growth_is_that_of_small_steps() {
    for gain in [2.0, 8.0, 14.0] {
        let text = gain.to_string();
        let rest = criteria(&[("surface.stiffness", "2 N/mm"), ("method.force_gain", &text)]).rests[1];
        let (l1, l2, r) = (0.0125f64, 0.058f64, rest.radius_m);
        let crank = f64::acos((r * r + l1 * l1 - l2 * l2) / (2.0 * r * l1));
        let lever = l1 * crank.sin() * (1.0 + l1 * crank.cos() / (l2 * l2 - l1 * l1 * crank.sin().powi(2)).sqrt());
        let (inertia, friction) = (1e-4 + 0.05 * lever * lever, 0.118 / 17.49);
        let h = 1e-6;
        let (mut angle, mut speed, mut drive, mut seen) = (1e-3, 0.0, 0.0, 0.0);
        let mut sizes = Vec::new();
        for step in 0..2_000_000u32 {
            if step % 4000 == 3000 {
                let force = lever * (PAD_N_PER_M * angle + 2.0 * speed);
                seen = -lever * (2000.0 * (1.0 + gain) * lever * angle + gain * force);
            }
            if step % 4000 == 0 {
                drive = seen;
                sizes.push(f64::hypot(angle, 0.01 * speed));
            }
            let pad = lever * lever * (PAD_N_PER_M * angle + 2.0 * speed);
            speed += h * (drive - pad - friction * speed) / inertia;
            angle += h * speed;
        }
        // Over half a second near the end, or as far as the motion is not lost in rounding.
        let logs: Vec<f64> = sizes.iter().map(|size| size.ln()).collect();
        let (from, to) = (logs.len() / 2, logs.len() - 1);
        // The envelope: the mean over 50 pulses around either end.
        let mean = |at: usize| logs[at - 50..at].iter().sum::<f64>() / 50.0;
        let growth = ((mean(to) - mean(from)) / (to - from) as f64).exp();
        assert!((growth - rest.growth).abs() < 2e-3, "K_f = {gain}: {growth} by steps, {}", rest.growth);
    }
}

#[test]
fn each_criterion_says_what_it_is_named_for() {
    let fails = |set: &[(&str, &str)]| criteria(set).fails();
    assert_eq!(NAMES, ["softer", "no_rest", "sampled"]);
    // 0.3 N/mm is softer than position control: with one threshold neither control rests.
    assert_eq!(fails(&[]), [true, true, true]);
    // Hysteresis keeps the impedance control, whose finger feels 0.47 N.
    assert_eq!(fails(&[("switch.off", "0.1 N")]), [true, false, false]);
    assert_eq!(fails(&[("surface.stiffness", "2.5 N/mm")]), [false, false, false]);
    // Too much feedback of the force.
    assert_eq!(fails(&[("surface.stiffness", "2.5 N/mm"), ("method.force_gain", "15")]), [false, false, true]);
}

/// A criterion predicts a rest exactly within its stretches, and `softer` from the stiffness of position control on.
#[test]
fn the_limits_of_a_touch_are_where_its_criteria_change() {
    let (text, mut draw) = (scene("gimbal-switch", &[]), SplitMix64::new(5));
    let found = TouchLimits::of(&text).expect("a touch");
    let [least, most] = found.range_n_per_m;
    // A word of the stiffness is 2^-16 force LSBs of 10 N / 4096 a length LSB of 2^-22 m.
    assert_eq!([least, most], [0.15625, 0.15625 * 65_535.0]);
    let [softer] = found.rests_n_per_m[0][..] else { panic!("{found:?}") };
    assert!((softer[0] / found.criteria.position_n_per_m - 1.0).abs() < 1e-9 && softer[1] == most, "{found:?}");
    for _ in 0..300 {
        let stiffness = least * (most / least).powf(draw.below(1 << 40) as f64 / 2f64.powi(40));
        let fails = criteria(&[("surface.stiffness", &format!("{stiffness:?}"))]).fails();
        for (stretches, fails) in found.rests_n_per_m.iter().zip(fails) {
            let is_inside = stretches.iter().any(|[from, to]| (*from..=*to).contains(&stiffness));
            assert_eq!(is_inside, !fails, "{stiffness} {stretches:?}");
        }
    }
}

#[test]
fn the_criteria_refuse_what_they_do_not_know() {
    let refused = |name: &str, set: &[(&str, &str)], why: &str| {
        let error = Criteria::of(&scene(name, set)).expect_err(why);
        assert!(error.to_string().contains(why), "{error}");
    };
    refused("gimbal-shape", &[], "[finger]");
    refused("gimbal-texture", &[], "rests");
    refused("gimbal-switch", &[("crank_servo.rate", "300 Hz")], "every so many");
    refused("gimbal-switch", &[("method.crank_derivative", "0.1")], "crank_derivative");
}

/// The work of the crank's drive in the last three tenths is the supply's energy of the whole run less that of its
/// first seven tenths: only the crank moves.
#[test]
fn the_energy_of_the_switches_is_that_of_the_supply() {
    let (whole, switches, modes) = watched(&scene("gimbal-switch", &[]));
    let (first, ..) = watched(&scene("gimbal-switch", &[("run.duration", "2.8 s")]));
    let given_j = whole.energy.source_j - first.energy.source_j;
    let told_j = switches.energy_j().expect("it goes on switching") * switches.judged as f64;
    assert!(given_j > 1e-3 && (told_j / given_j - 1.0).abs() < 1e-3, "{told_j} J of {given_j} J");
    // At rows of 1 ms, a stay of either control is longer than a row.
    let seen = modes.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert_eq!(seen as u64, switches.count);
}

#[test]
fn a_bumpless_switch_has_no_bump_and_a_plain_one_has() {
    let bump_n = |set: &[(&str, &str)]| watched(&scene("gimbal-switch-held", set)).1.bump_n;
    assert_eq!(bump_n(&[]), 0.0);
    // Without an offset the drive leaps from the one law to the other. At 0.5 N and the weight, position control asks
    // for both; the impedance control asks for the spring's force and for the gain times what it lacks.
    let leap_n = bump_n(&[("switch.bumpless", "false")]);
    let gives_way_m = (0.5 + WEIGHT_N) / criteria(&[]).position_n_per_m;
    let spring_n = 300.0 * gives_way_m;
    let expected_n = (0.5 + WEIGHT_N) - (spring_n + 4.0 * (spring_n - 0.5));
    // The force passes its threshold between two samples: at 10 mm/s by up to 10 um of pad and surface, and a position
    // of the servo is 54 um.
    let per_step_n = 5.0 * 300.0 * 54e-6 + 5.0 * PAD_N_PER_M * 10e-6;
    assert!((leap_n - expected_n).abs() < 4.0 * per_step_n, "{leap_n} N, by hand {expected_n} N");
}
