//! The modulator compared with counts and formulas, for every command at 5 bits and in every mode.

use hpu_datapath::pwm::{In, Out};
use hpu_datapath::{Block, Pwm, PwmConfig};
use proptest::prelude::*;

use crate::cases::cases;

const PERIOD: i64 = 32;
const SMALL: PwmConfig = PwmConfig { width: 5, antiphase: false, latched: true, floating: false, dead_time: 0 };

/// Returns every mode, without a dead time.
fn modes() -> Vec<PwmConfig> {
    let mut all = Vec::new();
    for antiphase in [false, true] {
        for latched in [false, true] {
            for floating in [false, true] {
                all.push(PwmConfig { antiphase, latched, floating, ..SMALL });
            }
        }
    }
    all
}

/// Returns the number of clocks in one period for which each gate is on, after the modulator has settled at a constant
/// command.
fn counts(config: PwmConfig, command: i64) -> [i64; 4] {
    let mut block = Pwm::new(config).unwrap();
    let mut sum = [0; 4];
    for edge in 0..5 * PERIOD {
        let gates = block.tick(In { command });
        never_both(gates);
        if edge >= 4 * PERIOD {
            let now = [gates.a_high, gates.a_low, gates.b_high, gates.b_low];
            sum.iter_mut().zip(now).for_each(|(sum, now)| *sum += now);
        }
    }
    sum
}

fn never_both(gates: Out<i64>) {
    assert!(gates.a_high + gates.a_low <= 1 && gates.b_high + gates.b_low <= 1, "{gates:?}");
}

#[test]
fn on_clocks_in_a_period_equal_the_duty_for_every_command_in_every_mode() {
    for config in modes() {
        for command in -PERIOD..PERIOD {
            let (forward, back) = (command.max(0), (-command).max(0));
            let expected = if config.antiphase {
                let duty = (command + PERIOD).div_euclid(2);
                [duty, PERIOD - duty, PERIOD - duty, duty]
            } else if config.floating {
                [forward, back, back, forward]
            } else {
                [forward, PERIOD - forward, back, PERIOD - back]
            };
            assert_eq!(counts(config, command), expected, "{config:?}, command {command}");
        }
    }
}

#[test]
fn a_dead_time_costs_each_pulse_exactly_its_clocks() {
    for dead_time in 1..6 {
        let lost = i64::from(dead_time);
        let shortened = |clocks: i64| match clocks {
            PERIOD => PERIOD,
            _ => (clocks - lost).max(0),
        };
        for antiphase in [false, true] {
            let config = PwmConfig { dead_time, antiphase, ..SMALL };
            for command in -PERIOD..PERIOD {
                let ideal = counts(PwmConfig { antiphase, ..SMALL }, command);
                let expected = ideal.map(shortened);
                assert_eq!(counts(config, command), expected, "{config:?}, command {command}");
            }
        }
    }
}

#[test]
fn both_gates_of_a_changing_leg_are_off_for_exactly_the_dead_time() {
    for dead_time in 0..6 {
        // On and off are long enough for every change to complete.
        for command in [8, 16, 24, -8, -16, -24] {
            let config = PwmConfig { dead_time, ..SMALL };
            let mut block = Pwm::new(config).unwrap();
            let (mut previous, mut off, mut changes) = ((0, 0), 0, 0);
            for _ in 0..8 * PERIOD {
                let gates = block.tick(In { command });
                let leg = if command > 0 { (gates.a_high, gates.a_low) } else { (gates.b_high, gates.b_low) };
                if leg == (0, 0) {
                    off += 1;
                } else {
                    if previous != (0, 0) && leg != previous {
                        assert_eq!(off, dead_time);
                        changes += 1;
                    }
                    previous = leg;
                    off = 0;
                }
            }
            assert!(changes >= 14, "two changes a period, {changes} seen");
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn each_edge_compares_its_phase_with_the_command_taken(
        commands in prop::collection::vec(-PERIOD..PERIOD, 1..200), mode in 0usize..8
    ) {
        let config = modes()[mode];
        let mut block = Pwm::new(config).unwrap();
        for edge in 0..commands.len() {
            let gates = block.tick(In { command: commands[edge] });
            let taken = commands[if config.latched { edge - edge % 32 } else { edge }];
            let phase = i64::try_from(edge % 32).unwrap();
            let forward = (1, 0, 0, 1);
            let back = (0, 1, 1, 0);
            let expected = if config.antiphase {
                if phase < (taken + PERIOD).div_euclid(2) { forward } else { back }
            } else if phase < taken.abs() {
                if taken > 0 { forward } else { back }
            } else if config.floating {
                (0, 0, 0, 0)
            } else {
                (0, 1, 0, 1)
            };
            prop_assert_eq!((gates.a_high, gates.a_low, gates.b_high, gates.b_low), expected);
        }
    }

    #[test]
    fn no_leg_ever_has_both_gates_on(
        commands in prop::collection::vec(-PERIOD..PERIOD, 1..200), mode in 0usize..8, dead_time in 0u32..70
    ) {
        let mut block = Pwm::new(PwmConfig { dead_time, ..modes()[mode] }).unwrap();
        for command in commands {
            never_both(block.tick(In { command }));
        }
    }
}

#[test]
fn a_leap_of_any_length_keeps_the_phase() {
    // Full duty never changes a gate; u64::MAX edges are one less than a whole number of periods.
    let mut leaping = Pwm::new(SMALL).unwrap();
    let input = In { command: -PERIOD };
    leaping.tick(input);
    let mut ticking = leaping.clone();
    assert_eq!(leaping.quiet(&input), u64::MAX);
    leaping.skip(u64::MAX, &input);
    for _ in 0..PERIOD - 1 {
        ticking.tick(input);
    }
    assert_eq!(leaping, ticking);
}

/// Asserts that `quiet` is the number of edges before the next gate change, at every edge of three periods.
fn quiet_is_exact(config: PwmConfig, command: i64) {
    let input = In { command };
    let mut block = Pwm::new(config).unwrap();
    let mut gates = block.tick(input);
    for _ in 0..3 * PERIOD {
        let mut twin = block.clone();
        let change = (0..3 * PERIOD).zip(0..).find(|_| twin.tick(input) != gates);
        let expected = change.map_or(u64::MAX, |(_, edges)| edges);
        assert_eq!(block.quiet(&input), expected, "{block:?}, command {command}");
        gates = block.tick(input);
    }
}

#[test]
fn quiet_ends_at_the_very_next_gate_change() {
    for config in modes() {
        for command in -PERIOD..PERIOD {
            quiet_is_exact(config, command);
        }
    }
}

#[test]
fn quiet_sees_the_end_of_a_dead_time_that_no_other_change_cuts_short() {
    for antiphase in [false, true] {
        for command in (-24..=24).filter(|command: &i64| antiphase || command.abs() > 3) {
            quiet_is_exact(PwmConfig { dead_time: 3, antiphase, ..SMALL }, command);
        }
    }
}
