//! Remembers runs, and answers for narrower words whose run is proved to be the same.
//!
//! A run is a function of the scene, the wall and the words. Some words only have to hold the run's values: narrower
//! ones leave the run as it is while they hold them. The device tells after a run which bits that takes, and has the
//! proof ([`Loops::needs`](super::loops::Loops::needs)). Runs of one scene say nothing about another scene.

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
#[derive(Default)]
pub(super) struct Memory {
    runs: BTreeMap<Run, Vec<(Depth, Ran)>>,
}

impl Memory {
    /// Returns the result of a run: its own, or that of wider words whose run is proved to be the same.
    pub fn recall(&self, run: &Run) -> Option<&Ran> {
        let (run, depth) = run.parted();
        let wider = |of: &Depth| of.iter().zip(depth).all(|(of, bits)| *of >= bits);
        let same = |(of, ran): &&(Depth, Ran)| *of == depth || (wider(of) && ran.covers(depth));
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
    use super::Ran;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        for needs in [[11, 6], [9, i32::MAX], [0, 0]] {
            let ran = Ran { settled: true, error: f64::INFINITY, needs };
            assert_eq!(Ran::read(&ran.line()), Some(ran));
        }
        assert_eq!(Ran::read("settled"), None);
    }
}
