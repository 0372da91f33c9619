//! The PHANToM's wirings compared with their own instances, connected as in the VHDL.

use std::f64::consts::TAU;

use hpu_datapath::phantom::{Config, PhantomIn, PhantomIo, PhantomIoIn, PhantomLoop, PhantomSharedLoop, Turn};
use hpu_datapath::{Block, Wiring, bundle, flatten};
use hpu_signal::Ports;
use proptest::prelude::*;

use crate::cases::cases;
use crate::parts::Netlist;

/// Returns tables of 32 counts, large angles and periods of a few edges, so that a short motion goes everywhere.
fn small() -> Config {
    let joint = Turn { num: 1, den: 100 };
    Config {
        position_width: 8,
        period_width: 7,
        depth_width: 5,
        turns: [Turn { num: 3, den: 200 }, joint, joint],
        ..Config::default()
    }
}

/// Returns moves of three encoders, some of them impossible, each with the words of the scene and the number of edges
/// for which it stays.
fn motion(scene: usize) -> impl Strategy<Value = Vec<([i64; 3], Vec<u32>, u64)>> {
    let step = prop::sample::select(vec![0i64, 0, 1, 1, 1, 3, 3, 2]);
    let words = prop_oneof![
        3 => Just(Vec::new()),
        1 => prop::collection::vec(any::<u32>(), scene),
    ];
    prop::collection::vec(([step.clone(), step.clone(), step], words, prop_oneof![1u64..9, 1u64..300]), 1..50)
}

/// Calls `visit` with the inputs of each move of a motion, and with the number of edges for which they stay.
fn follow<W: Wiring>(wiring: &W, motion: &[([i64; 3], Vec<u32>, u64)], mut visit: impl FnMut(Vec<i64>, u64)) {
    let signals = flatten(&wiring.inputs());
    let mut words = vec![0; signals.len()];
    let mut places = [0i64; 3];
    for (steps, scene, stay) in motion {
        for joint in 0..3 {
            places[joint] += steps[joint];
            let lines = [[0, 0], [0, 1], [1, 1], [1, 0]][places[joint].rem_euclid(4) as usize];
            words[2 * joint..2 * joint + 2].copy_from_slice(&lines);
        }
        for (index, bits) in scene.iter().enumerate() {
            words[6 + index] = signals[6 + index].format.from_bits((*bits).into());
        }
        visit(words.clone(), *stay);
    }
}

fn equals_its_netlist<W: Wiring>(mut wiring: W, motion: &[([i64; 3], Vec<u32>, u64)]) {
    let mut netlist = Netlist::new(&wiring);
    let mut inputs = Vec::new();
    follow(&wiring, motion, |words, stay| inputs.extend((0..stay).map(|_| words.clone())));
    for (edge, words) in inputs.iter().enumerate() {
        let outputs = flatten(&wiring.tick(bundle(words)));
        assert_eq!(wiring.words(), netlist.tick(words), "edge {edge}");
        assert_eq!(outputs, wiring.words()[words.len()..wiring.ports()]);
    }
}

/// Runs the same motion leaping and ticking. Asserts that nets, uses and state agree, and that the ranges are those of
/// the nets seen.
fn leaping_equals_ticking<W: Wiring + Clone + PartialEq>(wiring: &W, motion: &[([i64; 3], Vec<u32>, u64)]) {
    let (mut leaping, mut ticking) = (wiring.clone(), wiring.clone());
    let mut ranges = vec![(i64::MAX, i64::MIN); wiring.nets().len()];
    follow(wiring, motion, |words, stay| {
        let input = || bundle::<W::In<i64>>(&words);
        let mut left = stay;
        while left > 0 {
            let quiet = leaping.quiet(&input()).min(left);
            leaping.skip(quiet, &input());
            let edges = if quiet == left { quiet } else { quiet + 1 };
            for edge in 0..edges {
                ticking.tick(input());
                if edge < quiet {
                    assert_eq!(ticking.words(), leaping.words());
                }
                for (range, &word) in ranges.iter_mut().zip(ticking.words()) {
                    *range = (range.0.min(word), range.1.max(word));
                }
            }
            if edges > quiet {
                leaping.tick(input());
            }
            left -= edges;
            assert_eq!(ticking.words(), leaping.words());
        }
    });
    assert_eq!(leaping.uses(), ticking.uses());
    assert!(leaping == ticking, "states differ");
    let measured: Vec<_> = ticking.uses().iter().map(|used| (used.min, used.max)).collect();
    assert_eq!(measured, ranges);
}

proptest! {
    #![proptest_config(cases(50))]

    #[test]
    fn the_parallel_loop_is_its_instances(motion in motion(9)) {
        equals_its_netlist(PhantomLoop::new(small()).unwrap(), &motion);
        equals_its_netlist(PhantomLoop::new(Config { delay: 0, ..small() }).unwrap(), &motion);
    }

    #[test]
    fn the_shared_loop_is_its_instances(motion in motion(9)) {
        equals_its_netlist(PhantomSharedLoop::new(small().shared()).unwrap(), &motion);
        equals_its_netlist(PhantomSharedLoop::new(Config { delay: 90, ..small() }).unwrap(), &motion);
    }

    #[test]
    fn the_bare_input_and_output_is_its_instances(motion in motion(3)) {
        equals_its_netlist(PhantomIo::new(4, 5).unwrap(), &motion);
    }

    #[test]
    fn a_leaping_wiring_equals_a_ticking_one_to_the_last_lost_bit(motion in motion(9), few in motion(3)) {
        leaping_equals_ticking(&PhantomLoop::new(small()).unwrap(), &motion);
        leaping_equals_ticking(&PhantomSharedLoop::new(small().shared()).unwrap(), &motion);
        leaping_equals_ticking(&PhantomIo::new(4, 5).unwrap(), &few);
    }
}

/// Returns a cube of 1 cm about the origin at 2000 N/m, sampled every 64 edges, as words of the default formats.
fn cube() -> PhantomIn<i64> {
    let mut words = PhantomIn::build(|| 0);
    let half = (0.005 * f64::from(1 << 24)) as i64;
    (words.x_low, words.y_low, words.z_low) = (-half, -half, -half);
    (words.x_high, words.y_high, words.z_high) = (half, half, half);
    (words.room, words.stiffness, words.period) = (7, 2000 << 2, 64);
    words
}

/// Returns the pins at these places of the three encoders.
fn at(places: [i64; 3], scene: PhantomIn<i64>) -> PhantomIn<i64> {
    let [(a_pin1, b_pin1), (a_pin2, b_pin2), (a_pin3, b_pin3)] =
        places.map(|place| [(0, 0), (0, 1), (1, 1), (1, 0)][place.rem_euclid(4) as usize]);
    PhantomIn { a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3, ..scene }
}

#[test]
fn both_loops_give_the_same_commands_8_and_34_edges_after_each_sample() {
    let mut parallel = PhantomLoop::default();
    let mut shared = PhantomSharedLoop::default();
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for edge in 0..64 * 400i64 {
        // The motion goes into three walls and, in joint 2, beyond the table, at different speeds.
        let input = at([edge / 40, edge / 5, -edge / 30], cube());
        first.push(flatten(&parallel.tick(input)));
        second.push(flatten(&shared.tick(input)));
        for (commands, after) in [(&first, 8), (&second, 34)] {
            if let [.., before, now] = &commands[..] {
                assert!(now == before || edge % 64 == after, "edge {edge}");
            }
        }
    }
    assert_eq!(first[..first.len() - 26], second[26..]);
    // The commands have pushed, and fell to 0 where the table ended.
    let greatest = first.iter().flatten().map(|command| command.abs()).max();
    assert!(greatest > Some(5000));
    assert_eq!(first.last().unwrap(), &[0; 3]);
    let valid = |wiring: &PhantomLoop, name: &str| {
        let net = wiring.nets().iter().position(|net| net.name == name).unwrap();
        wiring.words()[net]
    };
    assert_eq!(["valid1", "valid2", "valid3"].map(|name| valid(&parallel, name)), [1, 0, 1]);
}

#[test]
fn a_ceiling_pushes_the_upper_arm_down_as_hard_as_statics_says() {
    // The arm goes 200 counts up in joint 2, slowly enough to be counted, against a ceiling at 5 mm.
    let mut wiring = PhantomLoop::default();
    let mut out = flatten(&wiring.reset());
    for edge in 0..200 * 10 + 200i64 {
        out = flatten(&wiring.tick(at([0, (edge / 10).min(200), 0], cube())));
    }
    let angle = TAU * 200.0 / 28_000.0;
    let force_n = -2000.0 * (0.14 * angle.sin() - 0.005);
    // z has moved by L (cos - 1), which is less than the cube's half.
    let torque_nm = 0.14 * angle.cos() * force_n;
    let expected = torque_nm * 32_768.0 / 1.19;
    // The tolerance is 2 DAC counts: the force is off by 2000 N/m times 0.2 um, 4e-4 N, and the command is rounded.
    assert!((out[1] as f64 - expected).abs() < 2.0, "{} for {expected}", out[1]);
    assert_eq!([out[0], out[2]], [0, 0]);
}

#[test]
fn a_limited_force_counts_as_overflow_for_every_edge_it_stands() {
    // The right wall is 0.5 m to the left, so at 2000 N/m it asks for 1000 N, whatever the sines.
    let mut scene = cube();
    scene.x_high = -(1 << 23);
    scene.x_low = scene.x_high;
    let mut wiring = PhantomLoop::default();
    for _ in 0..100 {
        wiring.tick(scene);
    }
    for (net, used) in wiring.nets().iter().zip(wiring.uses()) {
        let expected = if net.name == "force_x" { 100 } else { 0 };
        assert_eq!(used.overflowed, expected, "{}", net.name);
    }
    let mut shared = PhantomSharedLoop::default();
    for _ in 0..100 {
        shared.tick(scene);
    }
    let found = shared.nets().iter().position(|net| net.name == "force_x").unwrap();
    // The outputs of the shared engine stand from edge 34 on.
    assert_eq!(shared.uses()[found].overflowed, 100 - 34);
}

#[test]
fn a_loop_at_rest_is_quiet_for_ever_and_one_with_a_count_pending_until_the_next_sample() {
    fn rests<W: Wiring<In<i64> = PhantomIn<i64>>>(mut wiring: W) {
        let scene = PhantomIn { period: 1000, ..cube() };
        (0..500).for_each(|_| _ = wiring.tick(scene));
        assert_eq!(wiring.quiet(&scene), u64::MAX);
        // A step reaches the position in four edges, and then waits for the sample of edge 1000.
        let moved = at([0, 1, 0], scene);
        (0..4).for_each(|_| _ = wiring.tick(moved));
        assert_eq!(wiring.quiet(&moved), 1000 - 504);
    }
    rests(PhantomLoop::default());
    rests(PhantomSharedLoop::default());
    let mut io = PhantomIo::default();
    let host = PhantomIoIn { host2: -77, ..PhantomIoIn::build(|| 0) };
    assert_eq!(flatten(&io.tick(host))[3..], [0, -77, 0]);
    (0..4).for_each(|_| _ = io.tick(host));
    assert_eq!(io.quiet(&host), u64::MAX);
}
