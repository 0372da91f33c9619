//! The clocked blocks except the modulator, compared with closed forms in plain integers.

use hpu_datapath::{
    Block, CommandLimiter, PositionCounter, QuadratureDecoder, Synchronizer, VelocityConfig, VelocityRegister,
    ZeroOrderHold,
};
use hpu_datapath::{
    command_limiter, position_counter, quadrature_decoder, synchronizer, velocity_register, zero_order_hold,
};
use hpu_signal::Format;
use proptest::prelude::*;

use crate::cases::cases;

/// Returns the difference of two counter words as a motion of less than half a turn.
fn motion(to: i64, from: i64, turn: i64) -> i64 {
    (to - from + turn / 2).rem_euclid(turn) - turn / 2
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_synchronizer_shows_what_the_edge_before_sampled(
        pins in prop::collection::vec((0i64..2, 0i64..2), 2..50)
    ) {
        let mut block = Synchronizer::new();
        let mut before = (0, 0);
        for (a_pin, b_pin) in pins {
            let out = block.tick(synchronizer::In { a_pin, b_pin });
            prop_assert_eq!((out.a, out.b), before);
            before = (a_pin, b_pin);
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_command_limiter_shows_the_value_that_as_many_edges_before_sampled_as_it_has_registers(
        values in prop::collection::vec(-512i64..512, 1..40), settling in 0u32..9
    ) {
        let mut block = CommandLimiter::new(10, 9, 200, settling).unwrap();
        for (edge, &value) in values.iter().enumerate() {
            // The first register shows the value sampled at this edge; without registers the value itself is shown.
            let sampled = (edge + 1).checked_sub(settling.max(1) as usize).map_or(0, |edge| values[edge]);
            prop_assert_eq!(block.tick(command_limiter::In { value }).limited, sampled.clamp(-200, 200));
        }
    }
}

#[test]
fn a_command_is_held_back_by_at_most_64_clocks() {
    assert!(CommandLimiter::new(14, 13, 4095, 64).is_ok());
    let error = CommandLimiter::new(14, 13, 4095, 65).unwrap_err().to_string();
    assert_eq!(error, "command_limiter: SETTLING is 65; accepted: 0 to 64");
}

#[test]
fn all_sixteen_transitions_decode_as_the_encoder_table_says() {
    // Each number holds these bits: previous a, previous b, a, b.
    const FORWARD: [u32; 4] = [0b0001, 0b0111, 0b1110, 0b1000];
    const BACK: [u32; 4] = [0b0010, 0b1011, 0b1101, 0b0100];
    const ILLEGAL: [u32; 4] = [0b0011, 0b0110, 0b1001, 0b1100];
    for index in 0..16u32 {
        let bit = |place: u32| i64::from(index >> place & 1);
        let mut block = QuadratureDecoder::new(1).unwrap();
        let loaded = block.tick(quadrature_decoder::In { a: bit(3), b: bit(2) });
        assert_eq!((loaded.step, loaded.error), (0, 0));
        let out = block.tick(quadrature_decoder::In { a: bit(1), b: bit(0) });
        let step = i64::from(FORWARD.contains(&index)) - i64::from(BACK.contains(&index));
        assert_eq!((out.step, out.error), (step, i64::from(ILLEGAL.contains(&index))), "{index:04b}");
    }
}

#[test]
fn the_decoder_keeps_an_error_until_reset() {
    let mut block = QuadratureDecoder::new(0).unwrap();
    assert_eq!(block.tick(quadrature_decoder::In { a: 1, b: 1 }).error, 1);
    let out = block.tick(quadrature_decoder::In { a: 1, b: 0 });
    assert_eq!((out.step, out.error), (1, 1));
    assert_eq!(block.reset().error, 0);
}

#[test]
fn the_decoder_loads_for_as_many_edges_as_it_settles() {
    for settle in 0..5 {
        let mut block = QuadratureDecoder::new(settle).unwrap();
        let lines = [(0, 1), (1, 1), (1, 0), (0, 0), (0, 1), (1, 1)];
        for (edge, (a, b)) in (0..).zip(lines) {
            let step = block.tick(quadrature_decoder::In { a, b }).step;
            assert_eq!(step, i64::from(edge >= settle), "edge {edge}, settling {settle}");
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_counter_is_the_sum_of_the_steps_modulo_its_width(
        steps in prop::collection::vec(-2i64..2, 1..300), width in 2u32..10
    ) {
        let mut block = PositionCounter::new(width).unwrap();
        let mut sum = 0;
        for step in steps {
            sum += step;
            let position = block.tick(position_counter::In { step }).position;
            prop_assert_eq!(position, sum.rem_euclid(1 << width));
        }
    }

    #[test]
    fn velocity_is_the_motion_between_the_two_latest_sample_edges(
        positions in prop::collection::vec(0i64..4096, 1..100), period in 0i64..8
    ) {
        let mut block = VelocityRegister::default();
        let every = period.max(1).unsigned_abs() as usize;
        for edge in 0..positions.len() {
            let position = positions[edge];
            let velocity = block.tick(velocity_register::In { position, period, scale: 9 }).velocity;
            let latest = edge - edge % every;
            let before = latest.checked_sub(every).map_or(0, |before| positions[before]);
            prop_assert_eq!(velocity, motion(positions[latest], before, 4096));
        }
    }

    #[test]
    fn the_hold_shows_the_word_of_the_latest_sample_edge(
        words in prop::collection::vec(0i64..4096, 1..100), period in 0i64..8
    ) {
        let mut block = ZeroOrderHold::default();
        let every = period.max(1).unsigned_abs() as usize;
        for edge in 0..words.len() {
            let q = block.tick(zero_order_hold::In { d: words[edge], period }).q;
            prop_assert_eq!(q, words[edge - edge % every]);
        }
    }
}

#[test]
fn a_new_period_takes_effect_at_the_next_sample_edge() {
    let mut block = ZeroOrderHold::default();
    // Samples are taken at edges 0, 4 (still in the old period) and 6.
    let shown: Vec<i64> = (0..8)
        .map(|edge| block.tick(zero_order_hold::In { d: edge, period: if edge < 2 { 4 } else { 2 } }).q)
        .collect();
    assert_eq!(shown, [0, 0, 0, 0, 4, 4, 6, 6]);
}

#[test]
fn every_8_bit_motion_at_every_scale_is_floored_and_clamped() {
    let scale_format = Format::new(false, 4, 4).unwrap();
    for out_width in [6, 8, 13] {
        let config = VelocityConfig { width: 8, period_width: 6, rescaled: true, scale: scale_format, out_width };
        let mut block = VelocityRegister::new(config).unwrap();
        let most = (1 << (out_width - 1)) - 1;
        let mut previous = 0;
        for scale in 0..256 {
            for difference in -128..128 {
                let position = (previous + difference) & 255;
                let input = velocity_register::In { position, period: 1, scale };
                let velocity = block.tick(input).velocity;
                let floor = (difference * scale).div_euclid(16);
                assert_eq!(velocity, floor.clamp(-most - 1, most), "{difference} * {scale}/16");
                let lost = block.latest();
                assert_eq!(lost.rounded, difference * scale % 16 != 0);
                assert_eq!(lost.overflowed, floor > most || floor < -most - 1);
                previous = position;
            }
        }
    }
}

#[test]
fn a_velocity_too_narrow_saturates_and_one_wider_is_sign_extended() {
    for (out_width, most) in [(5, 15), (8, 127), (16, 32767)] {
        let config = VelocityConfig { width: 8, out_width, ..VelocityConfig::default() };
        for difference in -128..128i64 {
            let mut block = VelocityRegister::new(config).unwrap();
            let input = velocity_register::In { position: difference & 255, period: 5, scale: 77 };
            assert_eq!(block.tick(input).velocity, difference.clamp(-most - 1, most));
        }
    }
}

#[test]
fn quiet_ends_at_the_very_sample_edge_that_changes_something() {
    for period in 0..6 {
        for (first, then, late) in [(5, 5, 0), (5, 5, 2), (0, 0, 1), (5, 10, 3), (5, 7, 4), (3, 0, 1)] {
            let mut velocity = VelocityRegister::default();
            let mut hold = ZeroOrderHold::default();
            let at = |position| velocity_register::In { position, period, scale: 0 };
            let word = |d| zero_order_hold::In { d, period };
            let mut shown = velocity.tick(at(first)).velocity;
            let mut held = hold.tick(word(first)).q;
            for _ in 0..late {
                shown = velocity.tick(at(then)).velocity;
                held = hold.tick(word(then)).q;
            }
            let (quiet, quiet_hold) = (velocity.quiet(&at(then)), hold.quiet(&word(then)));
            let change = (0..20).find(|_| velocity.tick(at(then)).velocity != shown);
            assert_eq!(quiet, change.unwrap_or(u64::MAX));
            let change = (0..20).find(|_| hold.tick(word(then)).q != held);
            assert_eq!(quiet_hold, change.unwrap_or(u64::MAX));
        }
    }
}
