//! The two loops compared with a straight-line model of their data sheet, and compared with ticking while they leap.

use hpu_datapath::{Block, HapticLoop, HybridLoop, LoopConfig, LoopIn, PwmConfig, Wiring, flatten};
use hpu_signal::Format;
use proptest::prelude::*;

use crate::cases::cases;

/// A model of the default design in plain integers; every register is assigned from the nets before the edge.
#[derive(Default)]
struct Model {
    held_position: bool,
    edge: i64,
    pins: (i64, i64),
    lines: (i64, i64),
    before: (i64, i64),
    step: i64,
    error: i64,
    position: i64,
    held: i64,
    sampled: i64,
    velocity: i64,
    next_sample: i64,
    taken: i64,
}

impl Model {
    /// Returns `delta`, `contact`, `penetration`, `spring`, `drag`, `torque` and `command`.
    fn combinational(&self, input: &LoopIn<i64>) -> [i64; 7] {
        let seen = if self.held_position { self.held } else { self.position };
        let delta = (seen - input.reference + 6144) % 4096 - 2048;
        let contact = i64::from(delta >= 0);
        let penetration = contact * delta;
        let spring = (penetration * input.stiffness).min(4095);
        let drag = (self.velocity * input.damping).clamp(-4096, 4095);
        let torque = contact * (spring + drag);
        [delta, contact, penetration, spring, drag, torque, torque.clamp(-4095, 4095)]
    }

    /// Ticks one edge; returns all nets after it.
    fn tick(&mut self, input: &LoopIn<i64>) -> Vec<i64> {
        let command = self.combinational(input)[6];
        let phase = self.edge % 4096;
        if phase == 0 {
            self.taken = command;
        }
        let gates = match self.taken {
            taken if phase >= taken.abs() => [0, 1, 0, 1],
            1.. => [1, 0, 0, 1],
            _ => [0, 1, 1, 0],
        };
        if self.edge == self.next_sample {
            self.velocity = (self.position - self.sampled + 6144) % 4096 - 2048;
            self.sampled = self.position;
            self.held = self.position;
            self.next_sample += input.period.max(1);
        }
        self.position = (self.position + self.step + 4096) % 4096;
        let place = |lines| [(0, 0), (0, 1), (1, 1), (1, 0)].iter().position(|at| *at == lines).unwrap();
        self.step = 0;
        if self.edge >= 3 {
            match (4 + place(self.lines) - place(self.before)) % 4 {
                0 => {}
                1 => self.step = 1,
                3 => self.step = -1,
                _ => self.error = 1,
            }
        }
        self.before = self.lines;
        self.lines = self.pins;
        self.pins = (input.a_pin, input.b_pin);
        self.edge += 1;

        let [delta, contact, penetration, spring, drag, torque, command] = self.combinational(input);
        let mut nets = flatten(input);
        nets.extend(gates);
        nets.extend([self.lines.0, self.lines.1, self.step, self.error, self.position]);
        if self.held_position {
            nets.push(self.held);
        }
        nets.extend([delta, contact, penetration, spring, self.velocity, drag, torque, command]);
        nets
    }
}

const QUIET: LoopIn<i64> =
    LoopIn { a_pin: 0, b_pin: 0, reference: 4080, stiffness: 70, damping: 9, period: 500, scale: 256 };

/// Returns motions of the encoder: each entry goes forward, back or nowhere (or makes an impossible leap) and stays
/// for a while.
fn motion() -> impl Strategy<Value = Vec<(i64, u64)>> {
    let step = prop::sample::select(vec![1i64, 1, 1, 1, 3, 3, 0, 2]);
    let stay = prop_oneof![1u64..9, 1u64..2000];
    prop::collection::vec((step, stay), 1..40)
}

/// Returns the pins at a place of the encoder.
fn at(place: i64, constants: LoopIn<i64>) -> LoopIn<i64> {
    let (a_pin, b_pin) = [(0, 0), (0, 1), (1, 1), (1, 0)][place.rem_euclid(4) as usize];
    LoopIn { a_pin, b_pin, ..constants }
}

fn equals_the_model<const HELD: bool>(constants: LoopIn<i64>, motion: &[(i64, u64)]) {
    let mut wiring = HapticLoop::<HELD>::default();
    let mut model = Model { held_position: HELD, ..Model::default() };
    let mut place = 0;
    for (step, stay) in motion {
        place += step;
        let input = at(place, constants);
        for _ in 0..*stay {
            let gates = wiring.tick(input);
            assert_eq!(wiring.words(), model.tick(&input), "edge {}", model.edge);
            assert_eq!(flatten(&gates), wiring.words()[7..11]);
        }
    }
}

/// Returns widths so small that everything wraps, saturates and rounds within a few edges.
fn small() -> LoopConfig {
    LoopConfig {
        position_width: 6,
        stiffness: Format::new(false, 4, 2).unwrap(),
        damping: Format::new(false, 3, 2).unwrap(),
        period_width: 10,
        velocity_width: 4,
        rescaled: true,
        scale: Format::new(false, 2, 2).unwrap(),
        pwm: PwmConfig { width: 5, dead_time: 2, ..PwmConfig::default() },
        ..LoopConfig::default()
    }
}

/// Runs the same motion leaping and ticking. Asserts that nets, uses and state agree.
fn leaping_equals_ticking<const HELD: bool>(config: LoopConfig, constants: LoopIn<i64>, motion: &[(i64, u64)]) {
    let mut leaping = HapticLoop::<HELD>::new(config).unwrap();
    let mut ticking = leaping.clone();
    let mut place = 0;
    for (step, stay) in motion {
        place += step;
        let input = at(place, constants);
        let mut left = *stay;
        while left > 0 {
            let quiet = leaping.quiet(&input).min(left);
            leaping.skip(quiet, &input);
            for _ in 0..quiet {
                ticking.tick(input);
                assert_eq!(ticking.words(), leaping.words());
            }
            left -= quiet;
            if left > 0 {
                leaping.tick(input);
                ticking.tick(input);
                left -= 1;
            }
            assert_eq!(ticking.words(), leaping.words());
        }
    }
    assert_eq!(leaping.uses(), ticking.uses());
    assert!(leaping == ticking, "states differ");
}

/// Runs the same motion in stretches of ticks and edge by edge. Asserts that a stretch leaves the nets and uses that
/// its ticks leave, and that no output and no watched net changes before its last edge.
fn stretches_equal_ticks<const HELD: bool>(
    config: LoopConfig,
    constants: LoopIn<i64>,
    motion: &[(i64, u64)],
    watched: u64,
) {
    let mut going = HapticLoop::<HELD>::new(config).unwrap();
    let mut ticking = going.clone();
    let shown: Vec<_> =
        (0..going.words().len()).filter(|net| (7..11).contains(net) || watched >> net & 1 == 1).collect();
    let mut place = 0;
    for (step, stay) in motion {
        place += step;
        let input = at(place, constants);
        going.take(&input);
        going.tick_again(&input);
        ticking.tick(input);
        let mut left = *stay;
        while left > 0 {
            let quiet = going.quiet_again(&input).min(left);
            going.skip(quiet, &input);
            for _ in 0..quiet {
                ticking.tick(input);
            }
            assert_eq!(going.words(), ticking.words());
            left -= quiet;
            if left == 0 {
                break;
            }
            let (edges, out) = going.tick_on(left.min(4), watched, &input);
            for edge in 1..=edges {
                let before = ticking.words().to_vec();
                ticking.tick(input);
                let stays = |net: &usize| before[*net] == ticking.words()[*net];
                assert!(edge == edges || shown.iter().all(stays), "a net changes within a stretch");
            }
            assert_eq!(going.words(), ticking.words());
            if let Some(out) = out {
                assert_eq!(flatten(&out), ticking.words()[7..11]);
            }
            left -= edges;
        }
    }
    assert_eq!(going.uses(), ticking.uses());
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn stretches_of_ticks_equal_single_ones_whatever_is_watched(
        motion in motion(),
        reference in 0i64..64,
        stiffness in 0i64..64,
        damping in 0i64..32,
        period in 0i64..300,
        watched in prop::sample::select(vec![0, 1 << 11, 1 << 13, 1 << 15, 1 << 17, u64::MAX]),
    ) {
        let constants = LoopIn { reference, stiffness, damping, period, scale: 5, ..QUIET };
        for config in [small(), LoopConfig { settling: 3, ..small() }] {
            stretches_equal_ticks::<false>(config, constants, &motion, watched);
            stretches_equal_ticks::<true>(config, constants, &motion, watched);
        }
        stretches_equal_ticks::<false>(LoopConfig::default(), QUIET, &motion, watched);
        stretches_equal_ticks::<true>(LoopConfig::default(), QUIET, &motion, watched);
    }

    #[test]
    fn the_hybrid_loop_is_its_data_sheet(
        motion in motion(), reference in 0i64..4096, stiffness in 0i64..4096, damping in 0i64..4096, period in 0i64..900
    ) {
        equals_the_model::<false>(LoopIn { reference, stiffness, damping, period, ..QUIET }, &motion);
        equals_the_model::<false>(QUIET, &motion);
    }

    #[test]
    fn the_conventional_loop_is_its_data_sheet(
        motion in motion(), reference in 0i64..4096, stiffness in 0i64..4096, damping in 0i64..4096, period in 0i64..900
    ) {
        equals_the_model::<true>(LoopIn { reference, stiffness, damping, period, ..QUIET }, &motion);
        equals_the_model::<true>(QUIET, &motion);
    }

    #[test]
    fn a_leaping_loop_equals_a_ticking_one_to_the_last_lost_bit(
        motion in motion(),
        reference in 0i64..64,
        stiffness in 0i64..64,
        damping in 0i64..32,
        period in 0i64..300,
        scale in 0i64..16,
        saturate in any::<bool>(),
    ) {
        let constants = LoopIn { reference, stiffness, damping, period, scale, ..QUIET };
        let config = LoopConfig { saturate, ..small() };
        leaping_equals_ticking::<false>(config, constants, &motion);
        leaping_equals_ticking::<true>(config, constants, &motion);
        let late = LoopConfig { settling: 3, ..config };
        leaping_equals_ticking::<false>(late, constants, &motion);
        leaping_equals_ticking::<true>(late, constants, &motion);
        leaping_equals_ticking::<false>(LoopConfig::default(), QUIET, &motion);
        leaping_equals_ticking::<true>(LoopConfig::default(), QUIET, &motion);
    }

    #[test]
    fn settling_shows_the_same_commands_that_many_edges_later(motion in motion(), settling in 1u32..9) {
        let constants = LoopIn { reference: 60, stiffness: 33, damping: 5, period: 7, ..QUIET };
        let mut prompt = HybridLoop::new(small()).unwrap();
        let mut late = HybridLoop::new(LoopConfig { settling, ..small() }).unwrap();
        // The registers' initial zeros come first. The gates follow the command and are not compared here.
        let mut commands = vec![0; settling as usize];
        let (gates, command) = (7..11, prompt.words().len() - 1);
        let mut place = 0;
        for (step, stay) in &motion {
            place += step;
            for _ in 0..*stay {
                let input = at(place, constants);
                // The registers take in the words that stood at their inputs before the edge.
                prompt.settle(&input);
                commands.push(prompt.words()[command]);
                prompt.tick(input);
                late.tick(input);
                let expected = commands[commands.len() - settling as usize];
                prop_assert_eq!(late.words()[command], expected);
                for net in (0..command).filter(|net| !gates.contains(net)) {
                    prop_assert_eq!(late.words()[net], prompt.words()[net]);
                }
            }
        }
    }

    #[test]
    fn ranges_are_those_of_the_nets_seen(motion in motion()) {
        let mut wiring = HybridLoop::new(small()).unwrap();
        let constants = LoopIn { reference: 60, stiffness: 33, damping: 5, period: 7, ..QUIET };
        let mut seen = vec![(i64::MAX, i64::MIN); wiring.nets().len()];
        let mut place = 0;
        for (step, stay) in &motion {
            place += step;
            for _ in 0..*stay {
                wiring.tick(at(place, constants));
                for (range, &word) in seen.iter_mut().zip(wiring.words()) {
                    *range = (range.0.min(word), range.1.max(word));
                }
            }
        }
        let measured: Vec<_> = wiring.uses().iter().map(|used| (used.min, used.max)).collect();
        prop_assert_eq!(measured, seen);
    }
}

#[test]
fn the_first_edge_latches_the_command_of_its_own_inputs() {
    // The device is 16 counts behind the surface from the start, at 70 PWM counts per count.
    let mut wiring = HybridLoop::default();
    let on = (0..4096).filter(|_| wiring.tick(QUIET).a_high == 1).count();
    assert_eq!(on, 16 * 70);
}

#[test]
fn lost_bits_are_counted_for_every_edge_they_stand() {
    // At depth 16 and full stiffness the spring saturates from the first edge on. The sum is 4095 and is not limited
    // further.
    let mut wiring = HybridLoop::default();
    let input = LoopIn { stiffness: 4095, ..QUIET };
    for _ in 0..100 {
        wiring.tick(input);
    }
    let nets = wiring.nets();
    for (net, used) in nets.iter().zip(wiring.uses()) {
        let expected = if net.name == "spring" { 100 } else { 0 };
        assert_eq!((used.rounded, used.overflowed), (0, expected), "{}", net.name);
    }
}

#[test]
fn a_lost_bit_that_changes_no_word_is_counted_while_it_stands() {
    // One count at a scale of 1/4 is floored to 0, for the one sample of 50 edges in which the count comes.
    let mut wiring = HybridLoop::new(small()).unwrap();
    let constants = LoopIn { scale: 1, period: 50, reference: 0, ..QUIET };
    for edge in 0..500 {
        wiring.tick(at(i64::from(edge >= 120), constants));
    }
    let nets = wiring.nets();
    let velocity = nets.iter().position(|net| net.name == "velocity").unwrap();
    let used = wiring.uses()[velocity];
    assert_eq!((used.min, used.max, used.rounded, used.overflowed), (0, 0, 50, 0));
}

#[test]
fn pins_reach_the_position_in_four_edges_and_the_command_with_it() {
    let mut wiring = HybridLoop::default();
    for _ in 0..10 {
        wiring.tick(QUIET);
    }
    let command = |wiring: &HybridLoop| *wiring.words().last().unwrap();
    let rest = command(&wiring);
    for edge in 1..=4 {
        wiring.tick(at(1, QUIET));
        assert_eq!(command(&wiring), if edge < 4 { rest } else { rest + 70 });
    }
}
