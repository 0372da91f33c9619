//! Compares the proofs of an axis's loops with random motion, corners and runs.

use crate::proofs_common::{Wander, axis, bits, contains, of, run, traced, wander};
use hpu_cosim::scene::{Experiment, Scene, shipped};
use hpu_cosim::{AxisSimulation, Wired, with_axis_loop};
use hpu_prove::ranges::{How, MOST_INPUTS, Proof, axis_bounds, exhausted, gappa};
use hpu_signal::SignalUse;

/// The number of steps of each block.
const STEPS: u64 = 10_000_000;

/// Returns the ranges that a scene's wiring shows under random motion within the proved limits of its device.
fn at_random(scene: &Scene, proof: &Proof, see: impl FnMut(&[i64])) -> Vec<SignalUse> {
    let simulation = AxisSimulation::new(scene).unwrap();
    let (input, shaft) = (simulation.input(), Wander::new(scene, proof, 1));
    with_axis_loop!(simulation.axis_loop().expect("words"), wiring => wander(wiring.clone(), input, shaft, STEPS, see))
}

/// Asserts that every bound holds the values seen. Returns the nets whose bound is more than two bits wider.
fn compared(scene: &Scene, proof: &Proof, uses: &[SignalUse]) -> Vec<&'static str> {
    let nets = AxisSimulation::new(scene).unwrap().wiring().nets();
    let mut wide = Vec::new();
    println!("{}: measured in {STEPS} steps of random motion, proved", scene.name);
    for ((net, usage), bound) in nets.iter().zip(uses).zip(&proof.bounds) {
        contains(bound, net, usage);
        let (least, most) = (net.format.to_f64(usage.min), net.format.to_f64(usage.max));
        let [seen, proved] = [(least, most), (bound.min, bound.max)].map(|(a, b)| bits(net.format.lsb(), a, b));
        println!(
            "  {:12} {:10} {least:>12} .. {most:<12} {seen:>2} bits   {:>12} .. {:<12} {proved:>2} bits",
            net.name,
            net.format.to_string(),
            bound.min,
            bound.max
        );
        if proved > seen + 2 {
            wide.push(net.name);
        }
    }
    wide
}

/// A clock of 1 MHz, at which ten million edges are ten thousand samples.
const SLOW: (&str, &str) = ("clock.frequency", "1 MHz");
/// A bridge that gives the commanded voltage, whatever the length of a PWM period.
const MEAN: (&str, &str) = ("model.bridge", "\"averaged\"");

#[test]
fn every_signal_of_the_hybrid_loop_stays_inside_its_bounds_and_comes_within_two_bits_of_them() {
    let scene = axis("hybrid-wall", &[]);
    let proof = axis_bounds(&scene).unwrap();
    // The torque in real numbers, on the counts that the datapath sees.
    let names: Vec<_> = proof.bounds.iter().map(|bound| bound.name).collect();
    let net = |name: &str| names.iter().position(|net| *net == name).unwrap();
    let [contact, depth, velocity, spring, drag, torque, command] =
        ["contact", "penetration", "velocity", "spring", "drag", "torque", "command"].map(net);
    let (stiffness, damping) = (of(&proof, "stiffness").max, of(&proof, "damping").max);
    let mut worst = [0f64; 4];
    let uses = at_random(&scene, &proof, |words| {
        let real_spring = (words[depth] as f64 * stiffness).min(4095.0);
        let real_drag = (words[velocity] as f64 * damping).clamp(-4096.0, 4095.0);
        let real_torque = words[contact] as f64 * (real_spring + real_drag);
        let real = [real_spring, real_drag, real_torque, real_torque.clamp(-4095.0, 4095.0)];
        for ((worst, real), net) in worst.iter_mut().zip(real).zip([spring, drag, torque, command]) {
            *worst = worst.max((words[net] as f64 - real).abs());
        }
    });
    assert_eq!(compared(&scene, &proof, &uses), [""; 0]);
    for (worst, name) in worst.into_iter().zip(["spring", "drag", "torque", "command"]) {
        let proved = of(&proof, name).error.unwrap();
        println!("  {name}: worst error {worst}, proved {proved}");
        assert!(worst <= proved && proved <= worst + 1e-9, "{name}: the worst error is met to the last bit");
    }
    for bound in &proof.bounds {
        assert_eq!(bound.how, How::Proved);
    }
    assert!(of(&proof, "delta").never_overflows && of(&proof, "velocity").never_overflows);
    assert!(!of(&proof, "spring").never_overflows, "36 counts a count, 114 counts deep");
}

#[test]
fn every_signal_of_the_conventional_loop_stays_inside_its_bounds() {
    let scene = axis("conventional-wall-1khz", &[SLOW, MEAN]);
    let proof = axis_bounds(&scene).unwrap();
    let uses = at_random(&scene, &proof, |_| ());
    assert_eq!(compared(&scene, &proof, &uses), [""; 0]);
}

#[test]
fn a_rescaled_velocity_that_truncates_stays_inside_its_bounds() {
    let rescaled = [SLOW, MEAN, ("method.rescaled", "true"), ("method.reference_rate", "1300 Hz")];
    let scene = axis("hybrid-wall", &rescaled);
    let proof = axis_bounds(&scene).unwrap();
    let uses = at_random(&scene, &proof, |_| ());
    assert_eq!(compared(&scene, &proof, &uses), [""; 0]);
    assert!(of(&proof, "velocity").error.unwrap() > 0.9);
}

#[test]
fn every_method_stays_inside_its_bounds_and_comes_within_two_bits_but_for_sums_of_energy() {
    let with = |name: &str, more: &[(&str, &str)]| axis(name, &[&[SLOW, MEAN], more].concat());
    let relief = ("method.negative_damping", "0.05 mN.m.s/rad");
    let estimators = ["difference", "filtered", "window", "foaw", "edge_timer"];
    let walls = estimators.map(|name| with("dual-rate-wall", &[("method.estimator", &format!("\"{name}\"")), relief]));
    // A weight of 5891 / 2^16 at 2 kHz.
    let weighted = [("method.estimator", "\"filtered\""), ("method.velocity_filter.corner", "\"30 Hz\""), relief];
    let second = [weighted[0], weighted[1], ("method.velocity_filter.order", "2"), relief];
    let others = [
        with("dual-rate-wall", &weighted),
        with("dual-rate-wall", &second),
        with("coupled-wall", &[]),
        with("coupled-wall", &[("method.coupling_damping", "0.2 mN.m.s/rad"), ("method.rigid", "true")]),
        with("observed-wall", &[]),
        with("bounded-wall", &[]),
        with("bounded-wall", &[("method.form", "\"force_bound\"")]),
        with("energy-level-wall", &[]),
        with("energy-level-wall", &[("method.alpha", "2")]),
    ];
    for scene in walls.into_iter().chain(others) {
        let proof = axis_bounds(&scene).unwrap();
        let uses = at_random(&scene, &proof, |_| ());
        let wide = compared(&scene, &proof, &uses);
        let sums = ["bounded-wall", "observed-wall"].contains(&scene.name.as_str());
        assert!(wide.iter().all(|name| sums && *name == "memory"), "{:?}: {wide:?}", scene.method.kind);
        assert!(of(&proof, "delta").never_overflows);
    }
}

#[test]
fn a_table_of_torques_stays_inside_its_bounds_and_comes_within_two_bits() {
    // A hand, without which the angle has no limits.
    let hand = "{ kind = 'spring_damper', stiffness = '50 mN.m/rad', damping = '1 mN.m.s/rad', path = [['0 s', 0]] }";
    let scene = axis("detent-knob", &[SLOW, MEAN, ("hand", hand)]);
    let proof = axis_bounds(&scene).unwrap();
    assert_eq!(compared(&scene, &proof, &at_random(&scene, &proof, |_| ())), [""; 0]);
    assert!(of(&proof, "memory").never_overflows);
}

#[test]
fn a_controller_of_a_target_stays_inside_its_clamp() {
    // A hand, without which the angle has no limits.
    let hand = "{ kind = 'spring_damper', stiffness = '50 mN.m/rad', damping = '1 mN.m.s/rad', path = [['0 s', 0]] }";
    let scene = axis("following-motor", &[SLOW, MEAN, ("hand", hand)]);
    let proof = axis_bounds(&scene).unwrap();
    compared(&scene, &proof, &at_random(&scene, &proof, |_| ()));
    let torque = of(&proof, "torque");
    // 40 mN.m of the 265 that 4096 counts give.
    assert_eq!((torque.min, torque.max), (-618.0, 618.0));
    assert!(of(&proof, "memory").never_overflows);
}

#[test]
fn the_hybrid_walls_own_run_is_within_two_bits_but_where_no_command_pumps_the_shaft() {
    let scene = axis("hybrid-wall", &[]);
    let proof = axis_bounds(&scene).unwrap();
    let mut wide = Vec::new();
    for (net, bound) in run(&scene).nets.iter().zip(&proof.bounds) {
        let (least, most) = (net.signal.format.to_f64(net.usage.min), net.signal.format.to_f64(net.usage.max));
        let [seen, proved] = [(least, most), (bound.min, bound.max)].map(|(a, b)| bits(bound.format.lsb(), a, b));
        println!(
            "  {:12} {least} .. {most} {seen} bits, proved {} .. {} {proved} bits",
            bound.name, bound.min, bound.max
        );
        if proved > seen + 2 {
            wide.push(bound.name);
        }
    }
    // The scene's hand is gentle: it never drives the shaft as fast and as deep as the motor could.
    assert_eq!(wide, ["penetration", "velocity", "drag"]);
}

#[test]
fn every_shipped_scene_stays_inside_its_bounds() {
    for shipped in shipped() {
        let Experiment::Axis(scene) = shipped.parse(&[]).unwrap() else { continue };
        let Ok(proof) = axis_bounds(&scene) else { continue };
        // The theorem assumes that a mass that nothing holds back stays within a range. It says nothing of a mass that
        // goes farther.
        let (summary, angles_rad) = traced(&scene);
        let wall_rad = scene.wall.position_rad;
        let half_rad = scene.encoder.count_rad() * 2f64.powi(scene.method.position_bits.cast_signed() - 1);
        let inside = angles_rad.iter().all(|angle_rad| (angle_rad - wall_rad).abs() < half_rad);
        let assumed = proof.limits.iter().any(|limit| limit.why.contains("half the counter's range"));
        if assumed && !inside {
            println!("{} leaves the counter's range", scene.name);
            continue;
        }
        for (net, bound) in summary.nets.iter().zip(&proof.bounds) {
            contains(bound, &net.signal, &net.usage);
        }
        // The shaft itself stays within its proved limits.
        if let (Some(angle), true) = (proof.limits.iter().find(|limit| limit.name == "angle"), !angles_rad.is_empty()) {
            let inside = angles_rad.iter().all(|at| (angle.min - 1e-12..=angle.max + 1e-12).contains(at));
            assert!(inside, "{}: {angle:?}", scene.name);
        }
    }
}

#[test]
fn trying_every_input_agrees_with_the_proof() {
    let scene = axis("hybrid-wall", &[]);
    let proof = axis_bounds(&scene).unwrap();
    let rows = exhausted(&scene, &proof, MOST_INPUTS).unwrap();
    let names: Vec<_> = rows.iter().map(|row| row.name).collect();
    assert_eq!(names, ["delta", "contact", "penetration", "spring", "drag", "torque", "command"]);
    for row in &rows {
        let proved = of(&proof, row.name);
        assert_eq!(row.how, How::Exhausted);
        assert!(proved.min <= row.min && row.max <= proved.max, "{row:?} beyond {proved:?}");
        assert!(
            row.error <= proved.error && row.error.unwrap() + 1e-9 > proved.error.unwrap(),
            "{row:?} beside {proved:?}"
        );
        assert_eq!(row.never_overflows, proved.never_overflows, "{}", row.name);
    }
    for name in ["spring", "drag", "torque", "command"] {
        let (row, proved) = (rows.iter().find(|row| row.name == name).unwrap(), of(&proof, name));
        assert_eq!((row.min, row.max), (proved.min, proved.max), "{name}");
    }
}

/// All 2^24 products, twice; the test before it takes the words that the proof leaves.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn all_words_of_every_combinational_block_lead_to_what_its_data_sheet_says() {
    let scene = axis("hybrid-wall", &[]);
    let mut proof = axis_bounds(&scene).unwrap();
    for bound in &mut proof.bounds {
        // The nets take all words of their format, except for the damping and its product of 24 bits, which is the
        // spring's again.
        if bound.name != "damping" {
            let format = bound.format;
            (bound.min, bound.max) = (format.min() as f64 * format.lsb(), format.max() as f64 * format.lsb());
        }
    }
    let rows = exhausted(&scene, &proof, MOST_INPUTS).unwrap();
    let ranges: Vec<_> = rows.iter().map(|row| (row.name, row.min, row.max)).collect();
    let expected = [
        ("delta", -2048.0, 2047.0),
        ("contact", 0.0, 1.0),
        ("penetration", 0.0, 2047.0),
        ("spring", 0.0, 4095.0),
        // 2.375 times the whole range of the velocity, clamped.
        ("drag", -4096.0, 4095.0),
        ("torque", -4096.0, 8190.0),
        ("command", -4095.0, 4095.0),
    ];
    assert_eq!(ranges, expected);
    let spring = rows.iter().find(|row| row.name == "spring").unwrap();
    assert_eq!((spring.error, spring.never_overflows), (Some(0.0), false), "exact or clamped, all 2^24 products");
}

#[test]
fn what_has_no_words_has_no_proof_and_says_why() {
    let linear = axis("hybrid-wall", &[("model.datapath", "\"linear\"")]);
    assert_eq!(axis_bounds(&linear).unwrap_err().to_string(), "the scene's law is linear: it has no words");
    let coupled = axis("coupled-wall", &[]);
    let refused = gappa(&coupled, &axis_bounds(&coupled).unwrap()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "a script is written of a hybrid or a conventional loop, not of `virtual_coupling`"
    );
    // A recording has no device: its nets are bounded by their formats, and the assumptions say so.
    let recorded = axis_bounds(&axis("replay-capture", &[])).unwrap();
    let delta = of(&recorded, "delta");
    assert_eq!((delta.min, delta.max, delta.never_overflows), (-2048.0, 2047.0, false));
    let why = "no limit of the motion: a recording stands in the place of the device";
    assert!(delta.assumptions.iter().any(|assumption| assumption == why), "{delta:?}");
}
