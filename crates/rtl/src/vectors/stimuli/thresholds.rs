//! Rows at the thresholds of a block, whatever its generics: the block itself is asked where an output leaves the value
//! that it has at a corner (a limit, the edge of a band, a sign), by halving between neighbouring corners.

use std::collections::BTreeSet;

use hpu_datapath::{AnyBlock, configured};
use hpu_signal::Signal;

use super::{corners, edge, generic, latency, reset};
use crate::Stimulus;

/// The most words of inputs that are written, each a few rows.
const MOST: usize = 1500;

/// The way in which a block is shown words.
enum Shown {
    /// It answers at once.
    AtOnce,
    /// It answers after this many edges from a start, which is its first input.
    Started(i64),
    /// It answers a clock edge after a reset.
    Clocked,
}

impl Shown {
    fn of(block: &dyn AnyBlock) -> Self {
        match block.inputs().first() {
            _ if !block.clocked() => Self::AtOnce,
            Some(first) if first.name == "start" => Self::Started(latency(block) + 1),
            _ => Self::Clocked,
        }
    }

    /// Returns the rows in which a block is shown words and answers.
    fn rows(&self, words: &[i64]) -> Vec<Stimulus> {
        match self {
            Self::AtOnce => vec![edge(words.to_vec())],
            Self::Started(edges) => {
                let row = |passed: i64| edge([&[i64::from(passed == 0)], &words[1..]].concat());
                (0..=*edges).map(row).collect()
            }
            Self::Clocked => vec![reset(vec![0; words.len()]), edge(words.to_vec()), edge(words.to_vec())],
        }
    }

    /// Returns the outputs with which a block answers these words.
    fn answer(&self, block: &mut dyn AnyBlock, words: &[i64]) -> Vec<Vec<i64>> {
        let rows = self.rows(words).into_iter();
        let all: Vec<_> = rows.map(|row| if row.rst { block.reset() } else { block.tick(&row.words) }).collect();
        // Of a computation the last answer counts; after a clock edge, also that of the next one.
        let from = if matches!(self, Self::Clocked) { all.len() - 2 } else { all.len() - 1 };
        all[from..].to_vec()
    }
}

/// Returns rows on both sides of every threshold that is found, each in the midst of one word less and one more. Blocks
/// made of blocks have none: those inside have their own.
pub(super) fn thresholds(block: &dyn AnyBlock) -> Vec<Stimulus> {
    let inputs = block.inputs();
    if block.parts().is_some() || block.equations().is_none() {
        return Vec::new();
    }
    let set = block.generics();
    let mut model = configured(block.name(), &set).expect("it is listed").expect("its own generics");
    let shown = Shown::of(block);
    let lists: Vec<_> = inputs.iter().map(of_input).collect();
    let most = lists.iter().map(Vec::len).max().unwrap_or(0);
    let mut found = BTreeSet::new();
    for others in 0..most {
        for (index, list) in lists.iter().enumerate().filter(|(_, list)| list.len() > 2) {
            let mut words: Vec<_> = lists.iter().map(|list| list[others % list.len()]).collect();
            let format = inputs[index].format;
            let mut answer = |value: i128| {
                words[index] = format.wrap(value);
                shown.answer(&mut *model, &words)
            };
            let mut values: Vec<_> = list.iter().map(|&word| format.value(word)).collect();
            values.sort_unstable();
            let mut sides = BTreeSet::new();
            for pair in values.windows(2) {
                between(pair[0], pair[1], &mut answer, &mut sides);
            }
            let near = sides.into_iter().flat_map(|value| [value - 1, value, value + 1]);
            for value in near.filter(|&value| format.holds(value)) {
                words[index] = format.wrap(value);
                found.insert(words.clone());
            }
        }
    }
    found.into_iter().take(MOST).flat_map(|words| shown.rows(&words)).collect()
}

/// The edges within which an output is driven to an end.
const CLIMB: usize = 24;

/// Returns rows that drive each output of a clocked block up, then down: after each edge the corner words follow that
/// take it furthest; then rows that swing it. So a section with feedback comes to its ends.
pub(super) fn climbs(block: &dyn AnyBlock) -> Vec<Stimulus> {
    if block.parts().is_some() || block.equations().is_none() || !matches!(Shown::of(block), Shown::Clocked) {
        return Vec::new();
    }
    let inputs = block.inputs();
    let lists: Vec<_> = inputs.iter().map(of_input).collect();
    let candidates: Vec<Vec<i64>> = (0..lists[0].len())
        .flat_map(|first| [first, first + 1, first + 3].map(|others| (first, others)))
        .map(|(first, others)| {
            let word = |(index, list): (usize, &Vec<i64>)| list[if index == 0 { first } else { others % list.len() }];
            lists.iter().enumerate().map(word).collect()
        })
        .collect();
    let mut model = configured(block.name(), &block.generics()).expect("it is listed").expect("its own generics");
    let mut rows = Vec::new();
    for (output, signal) in block.outputs().iter().enumerate().filter(|(_, signal)| signal.format.width() > 1) {
        let mut path: Vec<Vec<i64>> = Vec::new();
        for sign in [1, -1] {
            for _ in 0..CLIMB {
                let mut height = |words: &Vec<i64>| {
                    model.reset();
                    path.iter().for_each(|words| drop(model.tick(words)));
                    sign * signal.format.value(model.tick(words)[output])
                };
                let best = candidates.iter().max_by_key(|words| height(words)).cloned();
                path.extend(best);
            }
        }
        rows.push(reset(vec![0; inputs.len()]));
        rows.extend(path.into_iter().map(edge));
    }
    rows.extend(swings(&inputs));
    rows
}

/// The half periods of the waves that swing a section, in edges: a section that rings at one of them comes to both of
/// its ends, where a steady word would leave it at rest.
const SWINGS: [usize; 4] = [1, 2, 3, 4];

/// Returns rows that swing all inputs of a clocked block between their ends, downwards first and upwards first.
fn swings(inputs: &[Signal]) -> Vec<Stimulus> {
    let steady = |signal: &Signal| of_input(signal).len() == 1;
    let words = |up: bool| {
        let end = |signal: &Signal| if up { signal.format.max() } else { signal.format.min() };
        let word = |signal: &Signal| if steady(signal) { 1 } else { signal.format.wrap(end(signal)) };
        inputs.iter().map(word).collect()
    };
    let wave = |half: usize, up: bool| {
        let edges = (0..CLIMB).map(move |passed| edge(words((passed / half).is_multiple_of(2) == up)));
        std::iter::once(reset(vec![0; inputs.len()])).chain(edges)
    };
    SWINGS
        .into_iter()
        .flat_map(|half| [false, true].map(|up| (half, up)))
        .flat_map(|(half, up)| wave(half, up))
        .collect()
}

/// Returns motions for an estimator that looks for the longest window whose line misses no position by more than the
/// noise: in each window and at each place in it, a miss of just the noise, and one unit of the comparison more.
pub(super) fn noises(block: &dyn AnyBlock) -> Vec<Stimulus> {
    let [Some(window), Some(noise)] = ["WINDOW", "NOISE"].map(|name| generic(block, name)) else { return Vec::new() };
    if block.name() != "foaw" {
        return Vec::new();
    }
    let format = block.inputs()[0].format;
    let half = 1i64 << (format.width() - 1);
    let mut rows = vec![reset(vec![0; 2])];
    let mut now = 0i64;
    let places = (2..=window).flat_map(|all| (1..all).map(move |place| (all, place)));
    for ((all, place), miss) in places.flat_map(|at| [0, 1].map(|more| (at, at.0 * noise + more))) {
        for miss in [miss, -miss] {
            // `all * bend - place * end` is the miss, with the least end that makes the bend whole.
            let ends = (0..all).flat_map(|end| [end, -end]);
            let Some(end) = ends.into_iter().find(|end| (miss + place * end) % all == 0) else { continue };
            let bend = (miss + place * end) / all;
            if bend.abs() >= half || end.abs() >= half {
                continue;
            }
            // Far from the positions before, so that no longer window fits.
            now += half / 2 + 1;
            for ago in (0..=all).rev() {
                let back = if ago == place { bend } else { (ago * end).div_euclid(all) };
                rows.push(edge(vec![format.wrap((now - back).into()), 1]));
            }
        }
    }
    rows
}

/// Returns the words between which thresholds of an input are looked for. A period is short, or nothing would sample.
fn of_input(signal: &Signal) -> Vec<i64> {
    match signal.name {
        "period" | "start" | "sample" => vec![1],
        _ => corners(signal.format),
    }
}

/// Adds the last value at which an output is as at the lower end, and the first at which it is as at the upper end.
fn between(low: i128, high: i128, answer: &mut impl FnMut(i128) -> Vec<Vec<i64>>, sides: &mut BTreeSet<i128>) {
    let (at_low, at_high) = (answer(low), answer(high));
    let places = (0..at_low.len()).flat_map(|row| (0..at_low[row].len()).map(move |output| (row, output)));
    for (row, output) in places.filter(|&(row, output)| at_low[row][output] != at_high[row][output]) {
        let mut last = |is_there: &dyn Fn(i64) -> bool| {
            let (mut yes, mut no) = (low, high);
            while no - yes > 1 {
                let middle = yes + (no - yes) / 2;
                if is_there(answer(middle)[row][output]) {
                    yes = middle;
                } else {
                    no = middle;
                }
            }
            yes
        };
        sides.insert(last(&|word| word == at_low[row][output]));
        sides.insert(last(&|word| word != at_high[row][output]) + 1);
    }
}
