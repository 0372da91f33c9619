//! Remembers runs, and answers for other words whose run is proved to be the same.
//!
//! A run is a function of the scene, the wall and the words. Some words only have to hold the run's values: narrower
//! ones leave the run as it is while they hold them. The device tells after a run which bits that takes, and has the
//! proof ([`Loops::needs`](super::loops::Loops::needs)). Where a run ends at the first value that its words do not hold
//! ([`Keys::aborts`](super::knob::Keys::aborts)), a run that stayed within its words is also that of wider ones. Runs
//! of one scene say nothing about another scene.

use std::collections::BTreeMap;

#[cfg(not(target_family = "wasm"))]
use hpu_farm::Schema;
use hpu_farm::form;
#[cfg(not(target_family = "wasm"))]
use hpu_page::Column;
use serde::{Deserialize, Serialize};

use super::knob::{Depth, Design};

/// A run of a search.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Run {
    /// The index of the scene.
    pub case: usize,
    /// The design that stands for all designs with this run.
    pub design: Design,
    /// The wall, as the device counts walls.
    pub wall: i128,
}

impl Run {
    /// Returns the run without the widths that only hold its values, and these widths.
    pub fn parted(mut self) -> (Self, Depth) {
        let (design, depth) = self.design.parted();
        self.design = design;
        (self, depth)
    }

    /// Returns the run of which [`parted`](Self::parted) made this one.
    pub fn joined(self, depth: Depth) -> Self {
        Self { design: self.design.joined(depth), ..self }
    }
}

/// The result of a run: a row of a search. Its keys are the columns of a sweep.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Ran {
    /// Whether the run settled.
    #[serde(with = "form::text")]
    pub(super) settled: bool,
    /// Error of its outputs against the reference's; valid only at the scene's own wall.
    #[serde(with = "form::number")]
    pub(super) error: f64,
    needed_bits_0: i32,
    needed_bits_1: i32,
}

impl Ran {
    /// Returns the result of a run that is proved to be the same with at least `needs` bits.
    pub(super) fn new(settled: bool, error: f64, [needed_bits_0, needed_bits_1]: Depth) -> Self {
        Self { settled, error, needed_bits_0, needed_bits_1 }
    }

    /// Returns whether a run with these widths, at most its own, is the same.
    fn covers(&self, depth: Depth) -> bool {
        [self.needed_bits_0, self.needed_bits_1].iter().zip(depth).all(|(needs, bits)| *needs <= bits)
    }
}

/// Returns the columns of a sweep over the runs of a search.
#[cfg(not(target_family = "wasm"))]
pub fn schema() -> Schema {
    let fields = vec![
        Column::text("settled", ""),
        Column::number("error", ""),
        Column::integer("needed_bits_0", ""),
        Column::integer("needed_bits_1", ""),
    ];
    Schema::new(Vec::new(), fields)
}

/// All runs so far.
pub(super) struct Memory {
    /// Whether a run ends at the first value that its words do not hold ([`Keys::aborts`](super::knob::Keys::aborts)).
    aborts: bool,
    runs: BTreeMap<Run, Vec<(Depth, Ran)>>,
}

impl Memory {
    /// Starts without a run.
    pub fn new(aborts: bool) -> Self {
        Self { aborts, runs: BTreeMap::new() }
    }

    /// Returns the result of a run: its own, or that of other words whose run is proved to be the same.
    pub(crate) fn recall(&self, run: &Run) -> Option<&Ran> {
        let (run, depth) = run.parted();
        let wider = |of: &Depth| of.iter().zip(depth).all(|(of, bits)| *of >= bits);
        let stayed = |of: &Depth, ran: &Ran| self.aborts && ran.covers(*of);
        let same = |(of, ran): &&(Depth, Ran)| *of == depth || (ran.covers(depth) && (wider(of) || stayed(of, ran)));
        self.runs.get(&run)?.iter().find(same).map(|(_, ran)| ran)
    }

    /// Stores the result of a run.
    pub fn keep(&mut self, run: Run, ran: Ran) {
        let (run, depth) = run.parted();
        self.runs.entry(run).or_default().push((depth, ran));
    }
}

#[cfg(test)]
mod tests {
    use hpu_cosim::scene::shipped;
    use hpu_farm::Row;

    use super::{Memory, Ran, Run};
    use crate::widths::Field;
    use crate::widths::search::Design;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        for needs in [[11, 6], [9, i32::MAX], [0, 0]] {
            let ran = Ran::new(true, f64::INFINITY, needs);
            assert_eq!(Row::of(&ran).read(), Ok(ran));
        }
        assert!(Row::of(&"settled").read::<Ran>().is_err());
    }

    #[test]
    fn a_run_answers_for_words_that_hold_its_values_and_for_wider_ones_only_if_it_would_have_aborted() {
        let scene = shipped().iter().find(|scene| scene.name == "phantom-drop").expect("a shipped scene");
        let scene = scene.parse(&[]).expect("it parses");
        let design = Design::of(&scene).expect("widths");
        let run = |bits| Run { case: 0, design: design.with(Field::DEPTH, bits), wall: 0 };
        for aborts in [false, true] {
            for (of, needs) in (4..=8).flat_map(|of| (3..=9).map(move |needs| (of, needs))) {
                let mut memory = Memory::new(aborts);
                memory.keep(run(of), Ran::new(true, 0.0, [needs, 0]));
                for asked in 4..=8 {
                    let same = asked == of || (needs <= asked && (asked < of || (aborts && needs <= of)));
                    assert_eq!(memory.recall(&run(asked)).is_some(), same, "{aborts}: {asked} of {of}, {needs}");
                }
            }
        }
    }
}
