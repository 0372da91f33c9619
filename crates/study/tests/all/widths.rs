//! Compares the ranges and losses of every signal with closed forms and with the records of other observers.

use hpu_chart::ranges;
use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Simulation, SplitMix64, Wired, WiredSimulation};
use hpu_datapath::{AnyBlock, Connection, Instance, TruncatingMultiplier};
use hpu_prove::ranges::{Bound, How};
use hpu_signal::{Cycle, Format, Observe, Signal};
use hpu_study::widths::{Beside, Measured, Walk, beside, measured, random, together};

use crate::looks::assert_readable;

fn scene(name: &str, set: &[(&str, &str)]) -> Experiment {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene").parse(&set).expect("parses")
}

fn run(name: &str, set: &[(&str, &str)]) -> Measured {
    measured(&scene(name, set), &Control::default()).expect("runs").expect("to its end")
}

/// Makes a wiring of a multiplier alone: nets `a`, `b`, `product`.
fn alone(multiplier: TruncatingMultiplier) -> Beside {
    let block: &dyn AnyBlock = &multiplier;
    let ports: Vec<Signal> = block.inputs().into_iter().chain(block.outputs()).collect();
    let connections = ports.iter().cloned().enumerate().map(|(net, port)| Connection { port, net }).collect();
    let instance =
        Instance { label: "mult", model: Box::new(multiplier), connections, tied: Vec::new(), generics: Vec::new() };
    Beside::new(&ports, 2, &[instance], &[], None)
}

#[test]
fn a_wrapping_product_tells_when_it_first_overflowed_and_by_how_much_at_most() {
    let word = Format::unsigned(12);
    let multiplier = TruncatingMultiplier::drop_upper(word, word, 12).expect("12 bits");
    let mut beside = alone(multiplier);
    for k in 0..=200i64 {
        beside.nets(Cycle(10 * k.unsigned_abs()), &[k, 36, 36 * k % 4096]);
    }
    beside.finish(2009);
    let [rounded, overflowed] = beside.losses(2).expect("a product");
    assert_eq!(rounded.edges, 0);
    // 36 * 114 = 4104 is the first product beyond 4095, from edge 1140 on; 7200 at 200 is the farthest beyond.
    assert_eq!((overflowed.first, overflowed.edges), (Some(Cycle(1140)), 2010 - 1140));
    assert_eq!(overflowed.worst, 7200.0 - 4095.0);
}

#[test]
fn a_truncated_ramp_has_the_noise_that_the_formula_says() {
    let word = Format::unsigned(12);
    for dropped in 1..=8u32 {
        // The product with 1, without its lower bits.
        let multiplier = TruncatingMultiplier::drop_lower(word, word, 24 - dropped).expect("fewer bits");
        let mut beside = alone(multiplier);
        for a in 0..4096i64 {
            beside.nets(Cycle(a.unsigned_abs() + 1), &[a, 1, a >> dropped]);
        }
        beside.finish(4096);
        let [rounded, overflowed] = beside.losses(2).expect("a product");
        assert_eq!(overflowed.edges, 0);
        let step = f64::from(1u32 << dropped);
        assert_eq!(rounded.worst, step - 1.0, "the most is one less than a step");
        // One value of every step of the ramp is exact.
        assert_eq!(rounded.edges, 4096 - 4096 / (1u64 << dropped));
        assert_eq!(rounded.first, Some(Cycle(2)));
        // The mean of the squares of 0..n-1 is (n - 1)(2n - 1)/6.
        let mean_square = |n: f64| (n - 1.0) * (2.0 * n - 1.0) / 6.0;
        let formula_db = 10.0 * libm::log10(mean_square(4096.0) / mean_square(step));
        let found_db = beside.sqnr_db(2).expect("a law");
        assert!((found_db - formula_db).abs() < 1e-9, "{dropped} bits: {found_db} dB, not {formula_db} dB");
    }
}

/// Keeps every word of some nets with its edge.
struct Words(Vec<(u64, Vec<i64>)>);

impl Observe for Words {
    fn nets(&mut self, Cycle(edge): Cycle, words: &[i64]) {
        if self.0.last().is_none_or(|(_, last)| last != words) {
            self.0.push((edge, words.to_vec()));
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Returns every change of the nets of a scene.
fn recorded(experiment: &Experiment) -> (Vec<&'static str>, Vec<(u64, Vec<i64>)>) {
    let simulation = WiredSimulation::new(experiment).expect("ready");
    let mut words = Words(Vec::new());
    let mut trace = simulation.trace(&[]);
    simulation.run(simulation.driver(), &mut trace, &mut words, &Control::default());
    (simulation.nets().iter().map(|net| net.name).collect(), words.0)
}

#[test]
fn the_wrapping_product_first_overflows_where_the_recorded_penetration_says() {
    let (names, words) = recorded(&scene("wrap-product", &[]));
    let net = |name: &str| names.iter().position(|net| *net == name).expect("a net");
    let (penetration, stiffness) = (net("penetration"), net("stiffness"));
    let first = words.iter().find(|(_, words)| words[penetration] * words[stiffness] >= 4096).expect("it wraps");
    let deepest = words.iter().map(|(_, words)| words[penetration] * words[stiffness]).max().expect("words");

    let row = run("wrap-product", &[]).row("spring").expect("a row").clone();
    assert_eq!(row.overflowed.first, Some(Cycle(first.0)));
    assert_eq!(row.overflowed.worst, (deepest - 4095) as f64);
    assert_eq!(row.rounded.edges, 0);
    // No narrower format is possible: the words of the spring cover the whole format.
    assert_eq!(row.headroom_bits, 0);
}

#[test]
fn what_the_law_beside_says_was_lost_is_what_the_wiring_counted() {
    for (name, set) in [
        ("hybrid-wall", &[][..]),
        ("wrap-product", &[]),
        ("wrap-saturated", &[]),
        ("conventional-wall-1khz", &[]),
        ("hybrid-wall", &[("method.rescaled", "true"), ("method.reference_rate", "700 Hz")]),
        ("hybrid-wall", &[("method.velocity_bits", "3")]),
        ("wrap-saturated", &[("method.settling", "7")]),
        ("stiff-hybrid", &[("method.stiffness_format", "(0,7,0)"), ("method.damping_format", "(0,4,2)")]),
        ("phantom-thrown", &[("run.duration", "300 ms")]),
        ("phantom-thrown-shared", &[("run.duration", "300 ms")]),
    ] {
        let experiment = scene(name, set);
        let simulation = WiredSimulation::new(&experiment).expect("ready");
        let mut law = beside(&experiment, &simulation);
        let mut trace = simulation.trace(&[]);
        let summary = simulation.run(simulation.driver(), &mut trace, &mut law, &Control::default());
        law.finish(summary.edges);
        for (index, net) in summary.nets.iter().enumerate() {
            let counted = (net.usage.rounded, net.usage.overflowed);
            let told = law.losses(index).map_or((0, 0), |[rounded, overflowed]| (rounded.edges, overflowed.edges));
            assert_eq!(told, counted, "{name}: {} rounded, overflowed", net.signal.name);
        }
    }
}

/// Returns a value over its rounding error in decibels.
fn over_rounding_db(exact: f64, word: f64) -> f64 {
    20.0 * libm::log10(exact / (exact - word).abs())
}

#[test]
fn a_product_has_the_noise_of_its_rounded_gain_and_no_other() {
    // 1.5 N.m/rad in PWM counts a count: full scale is 265 mN.m at stall over 2^12, and a turn has 4096 counts.
    let quantum_nm = 0.265 / 4096.0;
    let exact = 1.5 * 2.0 * std::f64::consts::PI / 4096.0 / quantum_nm;
    let formula_db = over_rounding_db(exact, 36.0);
    let hybrid = run("hybrid-wall", &[]);
    for signal in ["stiffness", "spring"] {
        let row = hybrid.row(signal).expect("a row");
        assert_eq!(row.rounded.edges + row.overflowed.edges, 0, "{signal}");
        assert!(
            (row.sqnr_db.expect("a law") - formula_db).abs() < 1e-6,
            "{signal}: {:?} dB, not {formula_db}",
            row.sqnr_db
        );
    }
    for signal in ["delta", "penetration", "velocity"] {
        assert_eq!(hybrid.row(signal).and_then(|row| row.sqnr_db), Some(f64::INFINITY), "{signal} only counts");
    }
    // The law in floats beside a method's loop: without damping, its torque differs from the words' by the same share.
    let wall = run("dual-rate-wall", &[("wall.damping", "0"), ("run.duration", "300 ms")]);
    let [torque, gain] = ["torque", "stiffness"].map(|signal| wall.row(signal).expect("a row"));
    assert_eq!(torque.overflowed.edges, 0);
    let (found_db, formula_db) = (torque.sqnr_db.expect("a law"), gain.sqnr_db.expect("a law"));
    assert!((found_db - formula_db).abs() < 1e-6, "{found_db} dB, not {formula_db} dB");
}

#[test]
fn a_walk_stays_in_its_range_below_its_speed_and_comes_to_both_ends() {
    for seed in 0..20 {
        let walk = Walk::new(&mut SplitMix64::new(seed), [-700.0, 300.0], 40_000.0);
        assert!(walk.at(0.0).abs() < 1e-9, "from 0");
        let places: Vec<f64> = (0..200_000).map(|ms| walk.at(f64::from(ms) * 1e-4)).collect();
        assert!(places.iter().all(|at| (-700.0..=300.0).contains(at)));
        assert!(places.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 4.0 + 1e-9));
        let most = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = places.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(most > 299.0 && least < -699.0, "seed {seed}: {least} to {most}");
    }
}

#[test]
fn random_motion_loses_what_the_words_of_its_range_lose() {
    let found = random(&scene("hybrid-wall", &[]), 1.0, 5, &Control::default()).expect("runs").expect("to its end");
    let row = |name: &str| found.row(name).expect("a row");
    let (_, deepest) = row("penetration").measured.expect("a range");
    assert!(deepest > 114, "it came deep");
    assert_eq!(row("spring").overflowed.worst, (36 * deepest - 4095) as f64);
    assert_eq!(row("error").measured, Some((0, 0)), "no line was missed");
}

#[test]
fn the_tables_and_the_tip_of_a_phantom_are_as_near_as_rounding_lets_them() {
    let found = run("phantom-thrown", &[]);
    for (signal, ulps) in [("radius", 0.5), ("y", 0.5), ("force_y", 0.5)] {
        let row = found.row(signal).expect("a row");
        assert!(row.rounded.edges > 0 && row.rounded.worst <= ulps * row.format.lsb(), "{signal}: {:?}", row.rounded);
    }
}

#[test]
fn bars_of_ranges_are_readable_by_all() {
    let measured = run("wrap-product", &[]);
    let bounds: Vec<Bound> = measured
        .rows
        .iter()
        .map(|row| Bound {
            name: row.name,
            format: row.format,
            unit: "count",
            min: row.format.min() as f64 * row.format.lsb(),
            max: row.format.max() as f64 * row.format.lsb(),
            error: None,
            how: How::Proved,
            never_overflows: true,
            assumptions: Vec::new(),
        })
        .collect();
    assert_readable(&ranges("wrap-product: widths", &measured, &bounds, "hpu widths"), "ranges");
}

#[test]
fn runs_of_other_wirings_or_widths_are_not_taken_together() {
    let names = ["one".to_string(), "two".to_string()];
    let short = [("run.duration", "1 ms")];
    let narrow = [("run.duration", "1 ms"), ("method.position_bits", "11")];
    let runs = |other: Measured| together(&names, vec![run("hybrid-wall", &short), other]);
    let refused = runs(run("conventional-wall-1khz", &short)).expect_err("two wirings");
    assert!(refused.to_string().contains("one is a hybrid_loop, two a conventional_loop"), "{refused}");
    let refused = runs(run("hybrid-wall", &narrow)).expect_err("two widths");
    assert!(refused.to_string().contains("reference is (0,12,0) in one and (0,11,0) in two"), "{refused}");
}
