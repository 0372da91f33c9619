//! The law of `recurs` and `repeat`: a wiring recurs where all of its registers are as they were, and its nets are then
//! used as in the edges between.

use hpu_datapath::{
    ConventionalLoop, CouplingConfig, HybridLoop, LawWidths, LoopConfig, LoopIn, LoopOut, MethodLoop, MethodLoopConfig,
    PwmConfig, VirtualCoupling, Wiring,
};
use hpu_signal::Format;

/// Edges of a sample, and of a period of a modulator of five bits.
const SAMPLE: u64 = 12;
const PULSES: u64 = 32;
/// The first edge after which both are as they were: the least common multiple.
const ALL: u64 = 96;

fn at(place: i64) -> LoopIn<i64> {
    let (a_pin, b_pin) = [(0, 0), (0, 1), (1, 1), (1, 0)][place.rem_euclid(4) as usize];
    LoopIn { a_pin, b_pin, reference: 3, stiffness: 5, damping: 3, period: SAMPLE as i64, scale: 256 }
}

fn run<W: Wiring<In<i64> = LoopIn<i64>>>(wiring: &mut W, place: i64, edges: u64) {
    for _ in 0..edges {
        wiring.tick(at(place));
    }
}

/// Runs as far with as few ticks as the wiring allows.
fn leap<W: Wiring<In<i64> = LoopIn<i64>>>(wiring: &mut W, place: i64, edges: u64) {
    let mut left = edges;
    while left > 0 {
        let quiet = wiring.quiet(&at(place)).min(left - 1);
        wiring.skip(quiet, &at(place));
        wiring.tick(at(place));
        left -= quiet + 1;
    }
}

/// Asserts the law on a loop whose registers have come to rest, but for timer and modulator, five counts beyond the
/// wall. Returns whether a net had lost bits meanwhile.
fn obeys<W>(mut wiring: W) -> bool
where
    W: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> + Clone,
{
    for place in 0..=8 {
        run(&mut wiring, place, 40);
    }
    run(&mut wiring, 8, 40 * ALL);
    let then = wiring.clone();
    let mut now = then.clone();
    for edges in 1..=3 * ALL {
        run(&mut now, 8, 1);
        assert_eq!(now.recurs(&then), edges % ALL == 0, "{}: {edges} edges later", W::NAME);
        let mut leapt = then.clone();
        leap(&mut leapt, 8, edges);
        assert!(leapt.recurs(&now) && now.recurs(&leapt), "{}: leapt over {edges} edges", W::NAME);
    }
    // Used as often as in a hundred times the edges.
    let (mut counted, mut told) = (now.clone(), now.clone());
    run(&mut counted, 8, 300 * ALL);
    told.repeat([&then, &now], 100);
    assert_eq!(told.uses(), counted.uses());
    // One count away nothing is as it was. Back again all is, once the samples have passed through.
    for edges in 1..=2 * ALL {
        run(&mut now, 9, 1);
        assert!(!now.recurs(&then), "{}: {edges} edges after a count", W::NAME);
    }
    run(&mut now, 8, 2 * ALL);
    assert!(now.recurs(&then), "{}: a count back", W::NAME);
    // A step of the encoder that is under way is a difference.
    run(&mut now, 8, ALL - 2);
    run(&mut now, 9, 1);
    run(&mut now, 8, 1);
    assert!(!now.recurs(&then), "{}: a step under way", W::NAME);
    counted.uses().iter().any(|net| net.rounded > 300 * ALL)
}

#[test]
fn a_wiring_recurs_where_all_registers_are_as_they_were() {
    assert_eq!((ALL % SAMPLE, ALL % PULSES), (0, 0));
    let pwm = PwmConfig { width: 5, ..PwmConfig::default() };
    let eighths = Format::new(false, 9, 3).expect("a format");
    let config = LoopConfig { pwm, stiffness: eighths, damping: eighths, ..LoopConfig::default() };
    assert!(obeys(HybridLoop::new(config).unwrap()));
    assert!(obeys(ConventionalLoop::new(config).unwrap()));
    let widths = LawWidths { torque_width: 5, ..LawWidths::default() };
    let law = VirtualCoupling::new(CouplingConfig { widths, ..CouplingConfig::default() }).unwrap();
    obeys(MethodLoop::new(law, MethodLoopConfig { pwm, ..MethodLoopConfig::default() }).unwrap());
}
