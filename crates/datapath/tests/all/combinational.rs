//! The combinational blocks compared with closed forms in plain integers.

use hpu_datapath::{Block, Displacement, Saturator, TorqueSum, Unilateral};
use hpu_datapath::{displacement, saturator, torque_sum, unilateral};
use proptest::prelude::*;

use crate::cases::cases;

/// Returns the displacement, found by search: the only one in range that leads from the reference to the position round
/// the counter.
fn shortest_way(position: i64, reference: i64, width: u32) -> i64 {
    let turn = 1 << width;
    let ahead = (position - reference + turn) % turn;
    if ahead >= turn / 2 { ahead - turn } else { ahead }
}

#[test]
fn every_6_bit_displacement_is_the_shortest_way_round() {
    let block = Displacement::new(6).unwrap();
    for position in 0..64 {
        for reference in 0..64 {
            let delta = block.eval(displacement::In { position, reference }).delta;
            assert_eq!(delta, shortest_way(position, reference, 6));
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn any_12_bit_displacement_is_the_shortest_way_round(position in 0i64..4096, reference in 0i64..4096) {
        let delta = Displacement::default().eval(displacement::In { position, reference }).delta;
        prop_assert_eq!(delta, shortest_way(position, reference, 12));
    }
}

#[test]
fn the_wall_touches_at_its_surface_and_never_pulls() {
    let block = Unilateral::default();
    for delta in -2048..2048 {
        let out = block.eval(unilateral::In { delta });
        let expected = if delta < 0 { (0, 0) } else { (1, delta) };
        assert_eq!((out.contact, out.penetration), expected);
    }
}

#[test]
fn torque_is_the_sum_in_contact_and_nothing_outside() {
    let block = TorqueSum::new(6, 7, 8).unwrap();
    for spring in 0..64 {
        for damping in -64..64 {
            let torque = |contact| block.eval(torque_sum::In { spring, damping, contact }).torque;
            assert_eq!(torque(1), spring + damping);
            assert_eq!(torque(0), 0);
        }
    }
}

#[test]
fn a_torque_sum_too_narrow_wraps() {
    let block = TorqueSum::new(6, 7, 6).unwrap();
    for spring in 0..64 {
        for damping in -64..64 {
            let torque = block.eval(torque_sum::In { spring, damping, contact: 1 }).torque;
            assert!((-32..32).contains(&torque));
            assert_eq!((spring + damping - torque) % 64, 0);
        }
    }
}

#[test]
fn every_value_is_limited_to_full_scale_on_both_sides() {
    let block = Saturator::default();
    let limited = |value| block.eval(saturator::In { value }).limited;
    for value in -4095..=4095 {
        assert_eq!(limited(value), value);
    }
    for beyond in 4096..8192 {
        assert_eq!(limited(beyond), 4095);
        assert_eq!(limited(-beyond), -4095);
    }
    assert_eq!(limited(-8192), -4095);
}

#[test]
fn a_tick_of_a_combinational_block_answers_its_inputs_at_once() {
    let input = displacement::In { position: 100, reference: 40 };
    let mut block = Displacement::default();
    assert_eq!(block.tick(input), block.eval(input));
}

#[test]
fn a_limit_that_the_output_cannot_hold_is_refused() {
    let error = Saturator::new(14, 13, 4096).unwrap_err().to_string();
    assert_eq!(error, "saturator: LIMIT is 4096; accepted: 0 to 4095");
}
