//! Waveforms read back by another project's parser: every name, width and value change is as written.

use std::io::Cursor;

use hpu_datapath::{HybridLoop, LoopConfig, Wiring};
use hpu_signal::{Clock, Cycle, Observe, Real, Signal, UNKNOWN};
use hpu_wave::{Fst, Layout, Vcd};

use crate::read_back::{self, Changes};

const REALS: [Real; 2] = [Real { name: "angle_rad", doc: "angle" }, Real { name: "current_a", doc: "current" }];
/// Frequencies of clocks, and the unit of their files in picoseconds. The edges of the first clock do not fall on whole
/// picoseconds. The edges of the second do, but not the middles between them.
const CLOCKS: [(u64, u64); 7] = [
    (25_175_000, 1),
    (8_000_000_000, 1),
    (200_000_000, 100),
    (50_000_000, 10_000),
    (40_000_000, 100),
    (1_000_000, 100_000),
    (1, 100_000_000_000),
];
const END: u64 = 5_000;

enum Event {
    Nets(u64, Vec<i64>),
    Reals(u64, [f64; 2]),
}

fn wiring() -> HybridLoop {
    HybridLoop::new(LoopConfig::default()).expect("the default is valid")
}

/// Returns events in which each net takes all zeros, all ones, each single bit, and then pseudo-random and unknown
/// words, each for several edges.
fn events(nets: &[Signal]) -> Vec<Event> {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state ^ (state >> 29)
    };
    let mut events = Vec::new();
    for step in 0..800u64 {
        let bits = |random: &mut dyn FnMut() -> u64| match step {
            0 => 0,
            1 => u64::MAX,
            2..66 => 1 << (step - 2),
            _ => random(),
        };
        // Some nets keep their word on most steps, as in a real run.
        let hold = |index: usize| step > 66 && !(step + index as u64).is_multiple_of(1 + index as u64 % 7);
        let last = events.iter().rev().find_map(|event| match event {
            Event::Nets(_, words) => Some(words.clone()),
            Event::Reals(..) => None,
        });
        let words = nets.iter().enumerate().map(|(index, net)| match &last {
            Some(last) if hold(index) => last[index],
            Some(_) if (step + 3 * index as u64).is_multiple_of(17) => UNKNOWN,
            _ => net.format.from_bits(bits(&mut random)),
        });
        let words = words.collect();
        events.push(Event::Nets(step * 6, words));
        if step % 3 == 0 {
            let angle_rad = [0.1, -0.0, 5e-324, -1.797e308, 1.0 / 3.0][(step / 3 % 5) as usize];
            events.push(Event::Reals(step * 6 + step % 2, [angle_rad, (step / 30) as f64]));
        }
    }
    events
}

fn picoseconds(cycle: u64, frequency_hz: u64) -> u64 {
    (u128::from(cycle) * 1_000_000_000_000 / u128::from(frequency_hz)) as u64
}

fn record(events: &[Event], out: &mut impl Observe) {
    for event in events {
        match event {
            Event::Nets(cycle, words) => out.nets(Cycle(*cycle), words),
            Event::Reals(cycle, values) => out.reals(Cycle(*cycle), values),
        }
    }
}

/// Returns the word's two's complement bits, computed from its integer value alone.
fn bits(net: &Signal, word: i64) -> String {
    let width = net.format.width();
    if word == UNKNOWN {
        return "x".repeat(width as usize);
    }
    format!("{:0width$b}", i128::from(word).rem_euclid(1 << width), width = width as usize)
}

/// Returns the changes that a file must show, by the name of the source.
fn expected(nets: &[Signal], events: &[Event], frequency_hz: u64, with_clock: bool) -> Changes {
    let picoseconds = |cycle| picoseconds(cycle, frequency_hz);
    let mut changes = Changes::new();
    let mut put = |name: &str, time_ps, value: String| {
        let list = changes.entry(name.to_string()).or_default();
        if list.last().is_none_or(|(_, last)| *last != value) {
            list.push((time_ps, value));
        }
    };
    put("rst", 0, "0".to_string());
    for event in events {
        match event {
            Event::Nets(cycle, words) => {
                nets.iter().zip(words).for_each(|(net, &word)| put(net.name, picoseconds(*cycle), bits(net, word)));
            }
            Event::Reals(cycle, values) => {
                REALS.iter().zip(values).for_each(|(real, v)| put(real.name, picoseconds(*cycle), format!("{v:?}")));
            }
        }
    }
    if with_clock {
        for cycle in 0..=END {
            put("clk", picoseconds(cycle), "1".to_string());
            put("clk", u64::midpoint(picoseconds(cycle), picoseconds(cycle + 1)), "0".to_string());
        }
        changes.get_mut("clk").expect("just made").pop();
    }
    changes
}

/// Returns the same changes by the full names of the wiring's hierarchy.
fn spread(sources: &Changes, with_clock: bool) -> Changes {
    let wiring = wiring();
    let nets = wiring.nets();
    let mut full = Changes::new();
    let mut put = |path: &str, name: &str, source: &str| {
        full.insert(format!("{path}.{name}"), sources[source].clone());
    };
    let clocked = |put: &mut dyn FnMut(&str, &str, &str), path: &str| {
        put(path, "rst", "rst");
        if with_clock {
            put(path, "clk", "clk");
        }
    };
    clocked(&mut put, "hybrid_loop");
    nets.iter().for_each(|net| put("hybrid_loop", net.name, net.name));
    for instance in wiring.instances() {
        let path = format!("hybrid_loop.{}", instance.label);
        if instance.model.clocked() {
            clocked(&mut put, &path);
        }
        instance.connections.iter().for_each(|port| put(&path, port.port.name, nets[port.net].name));
    }
    REALS.iter().for_each(|real| put("plant", real.name, real.name));
    full
}

fn check(read: &Changes, expected: &Changes) {
    assert_eq!(read.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, changes) in expected {
        let first = read[name].iter().zip(changes).position(|(read, put)| read != put);
        assert_eq!(
            first,
            None,
            "{name}: read {:?}, put {:?}",
            read[name][first.unwrap_or(0)],
            changes[first.unwrap_or(0)]
        );
        assert_eq!(read[name].len(), changes.len(), "{name}");
    }
}

fn layouts() -> [(Layout, bool); 2] {
    let layout = Layout::new(&wiring(), &REALS);
    [(layout.clone(), false), (layout.with_clock(), true)]
}

/// Records with every clock, with and without the clock in the file, and compares the changes that are read with those
/// that were written.
fn every_change_is_read_back(record: impl Fn(&[Event], &Layout, Clock) -> Vec<u8>) {
    let nets = wiring().nets();
    let events = events(&nets);
    for (frequency_hz, unit_ps) in CLOCKS {
        for (layout, with_clock) in layouts() {
            let file = record(&events, &layout, Clock::new(frequency_hz).expect("valid"));
            assert_eq!(read_back::unit_ps(&read_back::waveform(file.clone())), unit_ps, "{frequency_hz} Hz");
            let put = expected(&nets, &events, frequency_hz, with_clock);
            check(&read_back::changes(file), &spread(&put, with_clock));
        }
    }
}

#[test]
fn every_change_put_into_a_vcd_is_read_back_by_another_parser() {
    every_change_is_read_back(|events, layout, clock| {
        let mut vcd = Vcd::new(Vec::new(), layout, clock).expect("memory");
        record(events, &mut vcd);
        vcd.finish(Cycle(END)).expect("memory")
    });
}

#[test]
fn every_change_put_into_an_fst_is_read_back_by_another_parser() {
    every_change_is_read_back(|events, layout, clock| {
        let mut fst = Fst::new(Cursor::new(Vec::new()), layout, clock).expect("memory");
        record(events, &mut fst);
        fst.finish(Cycle(END)).expect("memory").into_inner()
    });
}
