//! The table over all seeds: at how many seeds a cell is passive, limits as intervals, and at how many seeds a claim is
//! met.

use std::fmt;

use hpu_cosim::scene::{Direction, Platform};

use super::claims::{Claim, claims};
use super::table::{Cell, Class, Table};
use super::{Outcomes, Study};
use crate::studies::summing::{Finding, Sum};

/// A number of seeds out of a total.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Share {
    /// Number of seeds at which the statement holds.
    pub so: usize,
    /// Number of seeds at which it was examined.
    pub of: usize,
}

impl Share {
    /// Whether the statement holds at every seed.
    pub const fn all(self) -> bool {
        self.so == self.of
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} of {}", self.so, self.of)
    }
}

/// A cell at each seed at which it was run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Tally {
    /// Class of the cell at each of these seeds, in their order.
    pub classes: Vec<Class>,
}

impl Tally {
    /// Returns the cell's class if all seeds agree; `None` if they differ.
    pub fn class(&self) -> Option<Class> {
        let first = *self.classes.first()?;
        self.classes.iter().all(|class| *class == first).then_some(first)
    }

    /// Returns at how many seeds the cell has this class.
    pub fn share(&self, class: Class) -> Share {
        Share { so: self.classes.iter().filter(|own| **own == class).count(), of: self.classes.len() }
    }
}

/// The limits of a column over all seeds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Span {
    /// The stiffest row, in N/m, that is passive at every seed and below which all softer rows are so too; `None` if
    /// the softest row is not.
    pub every_n_per_m: Option<f64>,
    /// The next row, in N/m, which is not passive at every seed; `None` if all rows are passive at every seed.
    pub beyond_n_per_m: Option<f64>,
    /// The stiffest row, in N/m, that is passive at some seed; `None` if no row is.
    pub some_n_per_m: Option<f64>,
    /// Whether `some_n_per_m` is the last row.
    pub ends: bool,
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let row = |row: Option<f64>| row.map_or("none".to_string(), |row| row.to_string());
        let least = if self.ends { ">=" } else { "" };
        if self.every_n_per_m != self.some_n_per_m {
            write!(f, "{}..", row(self.every_n_per_m))?;
        }
        write!(f, "{least}{}", row(self.some_n_per_m))
    }
}

/// A claim at every seed.
#[derive(Clone, PartialEq, Debug)]
pub struct Repeated {
    /// Each seed, and the claim as its table decides it, in the order of the seeds.
    pub seeds: Vec<(u64, Claim)>,
}

impl Repeated {
    /// Returns the claim at the first seed.
    pub fn first(&self) -> &Claim {
        &self.seeds[0].1
    }

    /// Returns the finding of all seeds together.
    pub fn finding(&self) -> Finding {
        Finding::of_seeds(&self.seeds.iter().map(|(_, claim)| claim.met).collect::<Vec<_>>())
    }

    /// Returns the numbers of the first seed and, where the seeds differ, the seeds at which the claim is met.
    pub fn found(&self) -> String {
        let (seed, first) = &self.seeds[0];
        let mut found = first.found.clone();
        if self.seeds.iter().any(|(_, claim)| claim.found != first.found) {
            found += &format!(", at seed {seed}");
        }
        if matches!(self.finding(), Finding::MetInSome { .. }) {
            let met = self.seeds.iter().filter(|(_, claim)| claim.met == Some(true)).map(|(seed, _)| seed.to_string());
            let met: Vec<_> = met.collect();
            let seeds = if met.len() == 1 { "seed" } else { "seeds" };
            found += &format!("; met at {seeds} {}: one draw cannot tell", met.join(", "));
        }
        found
    }

    /// Returns the claim for the summing-up.
    pub fn sum(&self) -> Sum {
        Sum { statement: self.first().statement(), finding: self.finding(), found: self.found() }
    }
}

/// The tables of one rung, one for each seed.
#[derive(Clone, PartialEq, Debug)]
pub struct Tables {
    tables: Vec<Table>,
}

impl Tables {
    /// Returns the tables of one rung, from the outcomes of a finished study.
    ///
    /// # Panics
    ///
    /// If not all cells were run at the first seed.
    pub fn new(study: &Study, rung: usize, outcomes: &Outcomes) -> Self {
        Self { tables: (0..study.seeds as usize).map(|seed| Table::new(study, rung, seed, outcomes)).collect() }
    }

    /// Returns the table at the first seed.
    pub fn first(&self) -> &Table {
        &self.tables[0]
    }

    /// Returns the table at each seed, in their order.
    pub fn each(&self) -> &[Table] {
        &self.tables
    }

    /// Returns a cell at the seeds at which it was run, if the study has it.
    pub fn cell(&self, axis: Direction, platform: Platform, stiffness_n_per_m: f64) -> Option<Tally> {
        self.first().cell(axis, platform, stiffness_n_per_m)?;
        let cells = self.tables.iter().filter_map(|table| {
            let cell = table.cell(axis, platform, stiffness_n_per_m)?;
            (cell.seed == table.seed).then_some(cell.class)
        });
        Some(Tally { classes: cells.collect() })
    }

    /// Returns how many cells were run at every seed, out of all cells.
    pub fn repeated(&self) -> Share {
        let last = &self.tables[self.tables.len() - 1];
        let so = last.cells().iter().filter(|cell| cell.seed == last.seed).count();
        Share { so, of: last.cells().len() }
    }

    /// Returns as text which cells were run at how many seeds.
    pub fn drawn(&self) -> String {
        match self.tables.len() {
            1 => format!("one draw, seed {}", self.first().seed),
            seeds => format!("{seeds} seeds near boundaries, one elsewhere"),
        }
    }

    /// Returns how stiff the walls may be, if the study tells.
    pub fn limit(&self, axis: Direction, platform: Platform) -> Option<Span> {
        let rows = &self.first().stiffnesses_n_per_m;
        let shares = rows.iter().map(|&row| Some(self.cell(axis, platform, row)?.share(Class::Passive)));
        let shares = shares.collect::<Option<Vec<_>>>()?;
        let row = |index: usize| rows.get(index).copied();
        let first = shares.iter().position(|share| !share.all()).unwrap_or(rows.len());
        let some = shares.iter().rposition(|share| share.so > 0);
        Some(Span {
            every_n_per_m: first.checked_sub(1).and_then(row),
            beyond_n_per_m: row(first),
            some_n_per_m: some.and_then(row),
            ends: some.is_some_and(|some| some + 1 == rows.len()),
        })
    }

    /// Returns the paper's claims, each compared with the table of every seed.
    pub fn claims(&self) -> Vec<Repeated> {
        let mut seeds = self.tables.iter().map(|table| (table.seed, claims(table)));
        let (seed, first) = seeds.next().expect("a table has a seed");
        let mut all: Vec<_> = first.into_iter().map(|claim| Repeated { seeds: vec![(seed, claim)] }).collect();
        for (seed, claims) in seeds {
            all.iter_mut().zip(claims).for_each(|(repeated, claim)| repeated.seeds.push((seed, claim)));
        }
        all
    }

    /// Returns why trials failed, each reason once.
    pub fn failures(&self) -> Vec<String> {
        let cells = self.tables.iter().flat_map(Table::cells);
        let trials = cells.flat_map(|cell: &Cell| &cell.trials);
        let mut reasons: Vec<String> =
            trials.filter_map(|trial| trial.as_ref().err()).map(ToString::to_string).collect();
        reasons.sort_unstable();
        reasons.dedup();
        reasons
    }
}
