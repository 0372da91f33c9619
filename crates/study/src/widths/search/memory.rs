//! Remembers runs, and answers for other words whose run is proved to be the same.
//!
//! A run is a function of the scene, the wall and the words. Some words only have to hold the run's values: narrower
//! ones leave the run as it is while they hold them. The device tells after a run which bits that takes, and has the
//! proof ([`Loops::needs`](super::loops::Loops::needs)). Where a run ends at the first value that its words do not hold
//! ([`Keys::aborts`](super::knob::Keys::aborts)), a run that stayed within its words is also that of wider ones. Runs
//! of one scene say nothing about another scene.

use std::collections::BTreeMap;

use super::knob::{Depth, Design};
#[cfg(not(target_family = "wasm"))]
use crate::{page::Column, sweep::Schema};

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

/// The result of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Ran {
    /// Whether the run settled.
    pub settled: bool,
    /// Error of its outputs against the reference's; valid only at the scene's own wall.
    pub error: f64,
    /// The fewest bits with which the run is proved to be the same.
    pub needs: Depth,
}

impl Ran {
    /// Returns whether a run with these widths, at most its own, is the same.
    fn covers(&self, depth: Depth) -> bool {
        self.needs.iter().zip(depth).all(|(needs, bits)| *needs <= bits)
    }

    /// Returns it as a line of a journal.
    pub fn line(&self) -> String {
        let Self { settled, error, needs: [one, other] } = self;
        format!("{settled},{error:e},{one},{other}")
    }

    /// Reads it from its line; `None` for any other text.
    pub fn read(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let [settled, error, one, other] = fields[..] else { return None };
        let needs = [one.parse().ok()?, other.parse().ok()?];
        Some(Self { settled: settled.parse().ok()?, error: error.parse().ok()?, needs })
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
    pub fn recall(&self, run: &Run) -> Option<&Ran> {
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

    use super::{Memory, Ran, Run};
    use crate::widths::Field;
    use crate::widths::search::Design;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        for needs in [[11, 6], [9, i32::MAX], [0, 0]] {
            let ran = Ran { settled: true, error: f64::INFINITY, needs };
            assert_eq!(Ran::read(&ran.line()), Some(ran));
        }
        assert_eq!(Ran::read("settled"), None);
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
                memory.keep(run(of), Ran { settled: true, error: 0.0, needs: [needs, 0] });
                for asked in 4..=8 {
                    let same = asked == of || (needs <= asked && (asked < of || (aborts && needs <= of)));
                    assert_eq!(memory.recall(&run(asked)).is_some(), same, "{aborts}: {asked} of {of}, {needs}");
                }
            }
        }
    }
}
