//! The proofs of an axis's loops, beside random motion, corners and runs.

mod proofs_common;

use hpu_cosim::scene::{Experiment, Scene, shipped};
use hpu_cosim::{Rig, Session, TheLoop};
use hpu_signal::SignalUse;
use hpu_study::widths::proof::{How, Proof, axis_bounds, exhausted, gappa};
use proofs_common::{Wander, axis, bits, contains, of, run, traced, used, wander};

/// The steps of each block.
const STEPS: u64 = 10_000_000;

/// What a scene's wiring makes of random motion within the limits that are proved of its device.
fn at_random(scene: &Scene, proof: &Proof, see: impl FnMut(&[i64])) -> Vec<SignalUse> {
    let session = Session::new(scene).unwrap();
    let (input, shaft) = (session.input(), Wander::new(scene, proof, 1));
    match session.wiring() {
        TheLoop::Hybrid(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::Conventional(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::SampledWall(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::VirtualCoupling(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::PassivityController(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::EnergyBounding(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        TheLoop::PassiveSpring(wiring) => wander(wiring.clone(), input, shaft, STEPS, see),
        _ => unreachable!("not an axis's"),
    }
}

/// Asserts that every bound holds what was seen; the nets whose bound is more than two bits wider.
fn compared(scene: &Scene, proof: &Proof, uses: &[SignalUse]) -> Vec<&'static str> {
    let nets = Session::new(scene).unwrap().wiring().nets();
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
/// A bridge that gives what the command says, whatever the length of a PWM period.
const MEAN: (&str, &str) = ("model.bridge", "\"averaged\"");

#[test]
fn every_signal_of_the_hybrid_loop_stays_inside_its_bounds_and_comes_within_two_bits_of_them() {
    let scene = axis("hybrid-wall", &[]);
    let proof = axis_bounds(&scene).unwrap();
    // The torque that real numbers give, on the counts that the datapath sees.
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
    let others = [
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
    // The hand of the scene is gentle: nobody drives the shaft as fast and as deep as the motor could.
    assert_eq!(wide, ["penetration", "velocity", "drag"]);
}

#[test]
fn every_shipped_scene_stays_inside_its_bounds() {
    for shipped in shipped() {
        let Experiment::Axis(scene) = shipped.parse(&[]).unwrap() else { continue };
        let Ok(proof) = axis_bounds(&scene) else { continue };
        // What a mass is assumed to do that nothing holds back: the theorem says nothing of one that goes farther.
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
        // The shaft itself keeps to what is proved of it.
        if let (Some(angle), true) = (proof.limits.iter().find(|limit| limit.name == "angle"), !angles_rad.is_empty()) {
            let inside = angles_rad.iter().all(|at| (angle.min - 1e-12..=angle.max + 1e-12).contains(at));
            assert!(inside, "{}: {angle:?}", scene.name);
        }
    }
}

/// The stiffness of one word, in N.m/rad.
fn stiffness_of_a_word(scene: &Scene) -> f64 {
    let realised = scene.words().unwrap().realised;
    realised.torque_quantum_nm / realised.count_rad
}

#[test]
fn the_word_at_which_a_product_first_wraps_is_the_predicted_one_and_none_below() {
    // A hand that imposes the motion: the path alone says how deep it goes.
    for (deepest, counts) in [("1.6", 65), ("1.9", 260), ("2.7", 782), ("3.1", 1042)] {
        let path = format!("[[\"0 s\", 1.4], [\"500 ms\", {deepest}], [\"1 s\", 1.4]]");
        let sweep = |stiffness: &str| {
            let set =
                [("hand.path", path.as_str()), ("method.product", "\"drop_upper\""), ("wall.stiffness", stiffness)];
            axis("prescribed-sweep", &set)
        };
        let unit = stiffness_of_a_word(&sweep("1.5"));
        let wraps_at = axis_bounds(&sweep("1.5")).unwrap().wraps_at.unwrap();
        assert_eq!((wraps_at.penetration, wraps_at.reached), (counts, true));
        let word = wraps_at.word.unwrap();
        // The least integer whose product with that penetration has a thirteenth bit.
        assert!(word * counts >= 4096 && (word - 1) * counts < 4096);
        assert!((wraps_at.stiffness.unwrap() / unit - word as f64).abs() < 1e-9);
        for tried in 1..=word + 6 {
            let scene = sweep(&format!("{}", tried as f64 * unit));
            let (proof, summary) = (axis_bounds(&scene).unwrap(), run(&scene));
            let overflowed = used(&summary, "spring").overflowed > 0;
            assert_eq!(overflowed, tried >= word, "word {tried} at {counts} counts");
            assert_eq!(of(&proof, "spring").never_overflows, tried < word);
            assert_eq!(used(&summary, "penetration").max, counts);
        }
    }
}

#[test]
fn a_closed_loop_wraps_exactly_when_it_reaches_the_penetration_of_its_word() {
    for name in ["wrap-product", "hybrid-wall"] {
        let with = |stiffness: &str| axis(name, &[("method.product", "\"drop_upper\""), ("wall.stiffness", stiffness)]);
        let unit = stiffness_of_a_word(&with("1.5"));
        let safe = axis_bounds(&with("1.5")).unwrap().wraps_at.unwrap().word.unwrap();
        let mut first = None;
        for word in [safe - 1, safe].into_iter().chain((10..=60).step_by(10)) {
            let scene = with(&format!("{}", word as f64 * unit));
            let (proof, summary) = (axis_bounds(&scene).unwrap(), run(&scene));
            let (spring, depth) = (used(&summary, "spring"), used(&summary, "penetration"));
            let wraps_at = proof.wraps_at.as_ref().unwrap();
            let at = wraps_at.at_scene.unwrap();
            assert!(word * at >= 4096 && word * (at - 1) < 4096);
            assert_eq!(spring.overflowed > 0, depth.max >= at, "{name}, word {word}");
            assert!(depth.max <= wraps_at.penetration);
            assert!(spring.overflowed == 0 || word >= safe, "proved not to overflow below {safe}");
            assert_eq!(of(&proof, "spring").never_overflows, word < safe);
            if spring.overflowed > 0 && first.is_none() {
                first = Some(word);
            }
        }
        println!("{name}: proved below word {safe}, first seen at {first:?}");
    }
}

#[test]
fn a_push_first_wraps_at_the_word_that_leaves_it_no_rest() {
    // The shipped push, and three that arrive at a twentieth of a radian a second.
    let slow = |end: f64| format!("[[\"0 s\", 1.4], [\"700 ms\", {}], [\"1700 ms\", {end}]]", end - 0.05);
    let shipped = "[[\"0 s\", 1.4], [\"500 ms\", 2.2]]".to_string();
    for (grip, end, path) in
        [(0.6, 2.2, shipped), (0.8, 2.0, slow(2.0)), (0.5, 2.4, slow(2.4)), (1.1, 1.85, slow(1.85))]
    {
        let with = |stiffness: f64| {
            let (stiffness, grip) = (stiffness.to_string(), grip.to_string());
            axis("wrap-product", &[("hand.path", &path), ("hand.stiffness", &grip), ("wall.stiffness", &stiffness)])
        };
        let unit = stiffness_of_a_word(&with(1.5));
        let realised = with(1.5).words().unwrap().realised;
        let predicted = axis_bounds(&with(1.5)).unwrap().wraps_at.unwrap().at_rest.unwrap();
        for word in predicted - 4..=predicted + 2 {
            // Below, the push is held at the last penetration that does not overflow; where friction alone holds it, a push
            // that is not infinitely slow may slide on.
            let deepest = (4095 / word) as f64;
            let push_nm = grip * (end - realised.wall_position_rad - (deepest + 1.0) * realised.count_rad);
            let hold_nm = word as f64 * deepest * realised.torque_quantum_nm;
            if word < predicted && push_nm > hold_nm {
                println!("grip {grip} N.m/rad to {end} rad: friction decides at word {word}");
                assert!(word == predicted - 1 && end != 2.2, "one word at most, and none of the shipped push");
                continue;
            }
            let overflowed = used(&run(&with(word as f64 * unit)), "spring").overflowed > 0;
            assert_eq!(overflowed, word >= predicted, "grip {grip} N.m/rad to {end} rad, word {word}");
        }
        println!("grip {grip} N.m/rad to {end} rad: first wraps at word {predicted}");
    }
}

#[test]
fn trying_every_input_agrees_with_the_proof() {
    let scene = axis("hybrid-wall", &[]);
    let proof = axis_bounds(&scene).unwrap();
    let rows = exhausted(&scene, &proof).unwrap();
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

#[test]
fn all_words_of_every_combinational_block_lead_to_what_its_data_sheet_says() {
    let scene = axis("hybrid-wall", &[]);
    let mut proof = axis_bounds(&scene).unwrap();
    for bound in &mut proof.bounds {
        // All words of all nets but the damping's, whose 24 bits of product are the spring's again.
        if bound.name != "damping" {
            let format = bound.format;
            (bound.min, bound.max) = (format.min() as f64 * format.lsb(), format.max() as f64 * format.lsb());
        }
    }
    let rows = exhausted(&scene, &proof).unwrap();
    let ranges: Vec<_> = rows.iter().map(|row| (row.name, row.min, row.max)).collect();
    let expected = [
        ("delta", -2048.0, 2047.0),
        ("contact", 0.0, 1.0),
        ("penetration", 0.0, 2047.0),
        ("spring", 0.0, 4095.0),
        // 2.375 times all of the velocity, clamped.
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
    assert_eq!(axis_bounds(&linear).unwrap_err(), "the scene's law is linear: it has no words");
    let coupled = axis("coupled-wall", &[]);
    let refused = gappa(&coupled, &axis_bounds(&coupled).unwrap()).unwrap_err();
    assert_eq!(refused, "a script is written of a hybrid or a conventional loop, not of `virtual_coupling`");
    // A recording has no device: its nets are bounded by their words, and it is said so.
    let recorded = axis_bounds(&axis("replay-capture", &[])).unwrap();
    let delta = of(&recorded, "delta");
    assert_eq!((delta.min, delta.max, delta.never_overflows), (-2048.0, 2047.0, false));
    let why = "no limit of the motion: a recording stands in the place of the device";
    assert!(delta.assumptions.iter().any(|assumption| assumption == why), "{delta:?}");
}
