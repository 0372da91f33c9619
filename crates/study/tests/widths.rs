//! What happened to every signal, against closed forms and against what other observers saw.

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Ready, Rig};
use hpu_datapath::{AnyBlock, Connection, Instance, TruncatingMultiplier};
use hpu_signal::{Cycle, Format, Observe, Signal};
use hpu_study::widths::{Beside, Measured, beside, measured, random, together};

fn scene(name: &str, set: &[(&str, &str)]) -> Experiment {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene").parse(&set).expect("parses")
}

fn run(name: &str, set: &[(&str, &str)]) -> Measured {
    measured(&scene(name, set), &Control::default()).expect("runs").expect("to its end")
}

/// A multiplier alone: nets `a`, `b`, `product`.
fn alone(multiplier: TruncatingMultiplier) -> Beside {
    let block: &dyn AnyBlock = &multiplier;
    let ports: Vec<Signal> = block.inputs().into_iter().chain(block.outputs()).collect();
    let connections = ports.iter().cloned().enumerate().map(|(net, port)| Connection { port, net }).collect();
    let instance = Instance { label: "mult", model: Box::new(multiplier), connections, tied: Vec::new() };
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
    // 36 * 114 = 4104 is the first beyond 4095, from edge 1140 on; 7200 at 200 is the farthest.
    assert_eq!((overflowed.first, overflowed.edges), (Some(Cycle(1140)), 2010 - 1140));
    assert_eq!(overflowed.worst, 7200.0 - 4095.0);
}

#[test]
fn a_truncated_ramp_has_the_noise_that_the_formula_says() {
    let word = Format::unsigned(12);
    for dropped in 1..=8u32 {
        // Of the product with 1, the lower bits dropped.
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
        // Of every step of the ramp one value is exact.
        assert_eq!(rounded.edges, 4096 - 4096 / (1u64 << dropped));
        assert_eq!(rounded.first, Some(Cycle(2)));
        // Mean squares of 0..n-1 are (n - 1)(2n - 1)/6.
        let mean_square = |n: f64| (n - 1.0) * (2.0 * n - 1.0) / 6.0;
        let formula_db = 10.0 * libm::log10(mean_square(4096.0) / mean_square(step));
        let found_db = beside.sqnr_db(2).expect("a law");
        assert!((found_db - formula_db).abs() < 1e-9, "{dropped} bits: {found_db} dB, not {formula_db} dB");
    }
}

/// Keeps, of some nets, every word with its edge.
struct Words(Vec<(u64, Vec<i64>)>);

impl Observe for Words {
    fn nets(&mut self, Cycle(edge): Cycle, words: &[i64]) {
        if self.0.last().is_none_or(|(_, last)| last != words) {
            self.0.push((edge, words.to_vec()));
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Every change of the nets of a scene.
fn recorded(experiment: &Experiment) -> (Vec<&'static str>, Vec<(u64, Vec<i64>)>) {
    let ready = Ready::new(experiment).expect("ready");
    let mut words = Words(Vec::new());
    let mut trace = ready.trace(&[]);
    ready.run(ready.driver(), &mut trace, &mut words, &Control::default());
    (ready.wiring().nets().iter().map(|net| net.name).collect(), words.0)
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
    // Nothing narrower: the words of the spring go through the whole format.
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
        ("stiff-hybrid", &[("method.stiffness_format", "(0,7,0)"), ("method.damping_format", "(0,4,2)")]),
        ("phantom-thrown", &[("run.duration", "300 ms")]),
        ("phantom-thrown-shared", &[("run.duration", "300 ms")]),
    ] {
        let experiment = scene(name, set);
        let ready = Ready::new(&experiment).expect("ready");
        let mut law = beside(&experiment, &ready);
        let mut trace = ready.trace(&[]);
        let summary = ready.run(ready.driver(), &mut trace, &mut law, &Control::default());
        law.finish(summary.edges);
        for (index, net) in summary.nets.iter().enumerate() {
            let counted = (net.usage.rounded, net.usage.overflowed);
            let told = law.losses(index).map_or((0, 0), |[rounded, overflowed]| (rounded.edges, overflowed.edges));
            assert_eq!(told, counted, "{name}: {} rounded, overflowed", net.signal.name);
        }
    }
}

#[test]
fn print_rows() {
    for name in [
        "hybrid-wall",
        "conventional-wall-1khz",
        "observed-wall",
        "shaped-wall",
        "phantom-thrown",
        "phantom-thrown-shared",
    ] {
        let start = std::time::Instant::now();
        let m = run(name, &[("run.duration", "500 ms")]);
        eprintln!("{name} {:?} {:?}", m.outcomes, start.elapsed());
        for r in &m.rows {
            eprintln!(
                "  {:12} {} {:?} h{} r{:?} o{:?} {:?}",
                r.name, r.format, r.measured, r.headroom_bits, r.rounded, r.overflowed, r.sqnr_db
            );
        }
    }
    for name in ["hybrid-wall", "phantom-thrown", "observed-wall"] {
        let start = std::time::Instant::now();
        let m = random(&scene(name, &[]), 2.0, 1, &Control::default()).unwrap().unwrap();
        eprintln!("random {name} {:?}", start.elapsed());
        for r in &m.rows {
            eprintln!(
                "  {:12} {} {:?} h{} r{:?} o{:?} {:?}",
                r.name, r.format, r.measured, r.headroom_bits, r.rounded, r.overflowed, r.sqnr_db
            );
        }
    }
    let _ = together;
}
