//! Compares the predicted first wrap of a product with the emulator's.

use crate::proofs_common::{axis, of, run, used};
use hpu_cosim::scene::Scene;
use hpu_prove::ranges::axis_bounds;

/// The stiffness of one word, in N.m/rad.
fn stiffness_of_a_word(scene: &Scene) -> f64 {
    let realised = scene.words().unwrap().realised;
    realised.torque_quantum_nm / realised.count_rad
}

#[test]
fn the_word_at_which_a_product_first_wraps_is_the_predicted_one_and_none_below() {
    // A hand that imposes the motion: its path alone determines the depth.
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
        assert!((wraps_at.of_a_word / unit - 1.0).abs() < 1e-12);
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
    // The scene's own push, and three that arrive at a twentieth of a radian a second.
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
            // At smaller words, the push is held at the last penetration that does not overflow. Where friction alone
            // holds it, a push that is not infinitely slow may slide on.
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
