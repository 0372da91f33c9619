//! The law of `quiet` and `skip`, for every block in every configuration.

use std::cell::RefCell;

use hpu_datapath::{AnyBlock, block_by_name, block_names, registry, variants, variants_of};
use hpu_signal::Signal;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::cases::cases;

/// Returns a word for a signal, often small or extreme, so that blocks come to rest and reach their limits.
fn word(signal: &Signal, choice: u64) -> i64 {
    let (format, random) = (signal.format, choice >> 3);
    match choice % 8 {
        0 | 1 => 0,
        2 => format.wrap(format.min()),
        3 => format.wrap(format.max()),
        4 | 5 => format.from_bits(random % 8),
        6 => format.from_bits(random % 100),
        _ => format.from_bits(random),
    }
}

/// One step of a history: the input that changes, a choice of its new word, and how far to leap.
#[derive(Clone, Debug)]
struct Step {
    port: usize,
    choice: u64,
    far: u64,
}

fn steps(length: usize) -> impl Strategy<Value = Vec<Step>> {
    let step = (0usize..100, any::<u64>(), any::<u64>());
    prop::collection::vec(step.prop_map(|(port, choice, far)| Step { port, choice, far }), length)
}

/// Applies a step to the inputs.
fn change(signals: &[Signal], words: &mut [i64], step: &Step) {
    let port = step.port % signals.len();
    words[port] = word(&signals[port], step.choice);
}

/// Returns how many edges to leap: none, one, all or some of those promised, but few enough to tick.
fn leap(quiet: u64, far: u64) -> u64 {
    let most = quiet.min(3000);
    match far % 4 {
        0 => most,
        1 => most.min(1),
        2 => most.min((far >> 2) % 64),
        _ => (far >> 2) % (most + 1),
    }
}

/// Leaps as far as allowed with one block and ticks an equal one through the same history. Asserts that both behave
/// alike.
fn obeys(label: &str, leaper: &mut dyn AnyBlock, ticker: &mut dyn AnyBlock, history: &[Step]) {
    let signals = leaper.inputs();
    let mut words = vec![0; signals.len()];
    let mut outputs = leaper.reset();
    assert_eq!(ticker.reset(), outputs);
    let name = format!("{} {label}", leaper.name());
    for step in history {
        // A combinational block has its outputs only once it has seen its inputs; a clocked one promises the outputs as
        // they stand.
        if leaper.clocked() {
            let edges = leap(leaper.quiet(&words), step.far);
            leaper.skip(edges, &words);
            for edge in 0..edges {
                assert_eq!(ticker.tick(&words), outputs, "{name}: output changed at {edge} of {edges}");
            }
        } else {
            assert_eq!(leaper.tick(&words), ticker.tick(&words));
            assert_eq!(leaper.quiet(&words), u64::MAX);
            leaper.skip(u64::MAX, &words);
        }
        outputs = leaper.tick(&words);
        assert_eq!(ticker.tick(&words), outputs, "{name}: states differ after a leap");
        change(&signals, &mut words, step);
    }
    for step in history {
        change(&signals, &mut words, step);
        for _ in 0..step.far % 4 {
            assert_eq!(leaper.tick(&words), ticker.tick(&words), "{name}: states differ");
        }
    }
}

/// Leaps and ticks through so many histories with every variant of every block.
fn leaps_and_ticks(histories: u32) {
    // The blocks are made only once, because tables take long to make. A reset forgets everything, as the next test
    // shows.
    let pairs = RefCell::new(variants().into_iter().zip(variants()).collect::<Vec<_>>());
    let config = ProptestConfig { failure_persistence: None, ..cases(histories) };
    let obeyed = TestRunner::new(config).run(&steps(60), |history| {
        for ((label, leaper), (_, ticker)) in pairs.borrow_mut().iter_mut() {
            obeys(label, leaper.as_mut(), ticker.as_mut(), &history);
        }
        Ok(())
    });
    obeyed.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn skipping_what_quiet_promises_equals_ticking() {
    leaps_and_ticks(10);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn skipping_what_quiet_promises_equals_ticking_in_a_thousand_histories() {
    leaps_and_ticks(1000);
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn a_reset_forgets_everything(past in steps(30), future in steps(30)) {
        for ((label, mut used), (_, mut fresh)) in variants().into_iter().zip(variants()) {
            let signals = used.inputs();
            let mut words = vec![0; signals.len()];
            for step in &past {
                change(&signals, &mut words, step);
                used.tick(&words);
            }
            assert_eq!(used.reset(), fresh.reset(), "{} {label}", used.name());
            for step in &future {
                change(&signals, &mut words, step);
                assert_eq!(used.tick(&words), fresh.tick(&words), "{} {label}", used.name());
            }
        }
    }

    #[test]
    fn every_output_fits_its_format(history in steps(100)) {
        for (label, mut block) in variants() {
            let (inputs, outputs) = (block.inputs(), block.outputs());
            let mut words = vec![0; inputs.len()];
            for step in &history {
                change(&inputs, &mut words, step);
                for (signal, word) in outputs.iter().zip(block.tick(&words)) {
                    let holds = signal.format.holds(signal.format.value(word));
                    assert!(holds, "{} {label}: {} = {word}", block.name(), signal.name);
                }
            }
        }
    }
}

#[test]
fn every_block_is_found_by_its_name_alone() {
    for block in registry() {
        let found = block_by_name(block.name()).unwrap();
        assert_eq!(found.generics(), block.generics());
    }
    assert!(block_by_name("no_such_block").is_none());
    assert!(registry().iter().map(|block| block.name()).eq(block_names().iter().copied()));
}

#[test]
fn the_variants_of_some_blocks_are_those_of_all_without_the_others() {
    let named = |all: Vec<(String, Box<dyn AnyBlock>)>| {
        let named = all.into_iter().map(|(label, block)| (label, block.name(), block.generics()));
        named.collect::<Vec<_>>()
    };
    let all = named(variants());
    for wanted in [&["pwm"][..], &["trig_table", "synchronizer"], &["no_such_block"], block_names()] {
        let expected: Vec<_> = all.iter().filter(|(_, name, _)| wanted.contains(name)).cloned().collect();
        assert_eq!(named(variants_of(|name| wanted.contains(&name))), expected, "{wanted:?}");
    }
}

#[test]
fn labels_are_unique_and_variants_of_a_block_differ() {
    let all = variants();
    for (index, (label, block)) in all.iter().enumerate() {
        for (other_label, other) in &all[..index] {
            if other.name() == block.name() {
                assert_ne!(other_label, label, "{}", block.name());
                assert_ne!(other.generics(), block.generics(), "{label} is {other_label}");
            }
        }
    }
}
