//! The table over all seeds: in how many of them a cell is passive, a limit as an interval, a claim met in so many.

use std::fmt;

use hpu_cosim::scene::{Direction, Platform};

use super::claims::{Claim, claims};
use super::summing::{Finding, Sum};
use super::table::{Cell, Class, Table};
use super::{Outcomes, Study};

/// So many of so many seeds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Share {
    /// Seeds at which it is so.
    pub so: usize,
    /// Seeds at which it was looked at.
    pub of: usize,
}

impl Share {
    /// Whether it is so at every seed.
    #[must_use]
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
    /// Its class at each of these seeds, in their order.
    pub classes: Vec<Class>,
}

impl Tally {
    /// Its class, if all seeds agree; `None` when it is mixed.
    #[must_use]
    pub fn class(&self) -> Option<Class> {
        let first = *self.classes.first()?;
        self.classes.iter().all(|class| *class == first).then_some(first)
    }

    /// In how many seeds it is of this class.
    #[must_use]
    pub fn share(&self, class: Class) -> Share {
        Share { so: self.classes.iter().filter(|own| **own == class).count(), of: self.classes.len() }
    }
}

/// The limits of a column over all seeds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Span {
    /// The stiffest row that is passive at every seed, all softer rows being so too; `None` when the softest is not.
    pub every_n_per_m: Option<f64>,
    /// The row after it, which is not; `None` when all rows are passive at every seed.
    pub beyond_n_per_m: Option<f64>,
    /// The stiffest row that is passive at some seed; `None` when no row is.
    pub some_n_per_m: Option<f64>,
    /// Whether that is the last row.
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
    /// What each seed's table says to it, with the seed, in their order.
    pub seeds: Vec<(u64, Claim)>,
}

impl Repeated {
    /// The claim at the first seed.
    #[must_use]
    pub fn first(&self) -> &Claim {
        &self.seeds[0].1
    }

    /// What all seeds together say to it.
    #[must_use]
    pub fn finding(&self) -> Finding {
        Finding::of_seeds(&self.seeds.iter().map(|(_, claim)| claim.met).collect::<Vec<_>>())
    }

    /// The numbers of the first seed; at which seeds it is met where they differ in that.
    #[must_use]
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

    /// For the summing-up.
    #[must_use]
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
    /// The tables of one rung, from the outcomes of a study that is through.
    ///
    /// # Panics
    ///
    /// When not all cells were run at the first seed.
    #[must_use]
    pub fn new(study: &Study, rung: usize, outcomes: &Outcomes) -> Self {
        Self { tables: (0..study.seeds as usize).map(|seed| Table::new(study, rung, seed, outcomes)).collect() }
    }

    /// The table at the first seed.
    #[must_use]
    pub fn first(&self) -> &Table {
        &self.tables[0]
    }

    /// The table at each seed, in their order.
    #[must_use]
    pub fn each(&self) -> &[Table] {
        &self.tables
    }

    /// A cell at the seeds at which it was run, if the study has it.
    #[must_use]
    pub fn cell(&self, axis: Direction, platform: Platform, stiffness_n_per_m: f64) -> Option<Tally> {
        self.first().cell(axis, platform, stiffness_n_per_m)?;
        let cells = self.tables.iter().filter_map(|table| {
            let cell = table.cell(axis, platform, stiffness_n_per_m)?;
            (cell.seed == table.seed).then_some(cell.class)
        });
        Some(Tally { classes: cells.collect() })
    }

    /// How many cells were run at every seed, and how many there are.
    #[must_use]
    pub fn repeated(&self) -> Share {
        let last = &self.tables[self.tables.len() - 1];
        let so = last.cells().iter().filter(|cell| cell.seed == last.seed).count();
        Share { so, of: last.cells().len() }
    }

    /// Which cells were run at how many seeds, in words.
    #[must_use]
    pub fn drawn(&self) -> String {
        match self.tables.len() {
            1 => format!("one draw, seed {}", self.first().seed),
            seeds => format!("{seeds} seeds near boundaries, one elsewhere"),
        }
    }

    /// How stiff the walls may be, if the study tells.
    #[must_use]
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

    /// The paper's claims, each held against the table of every seed.
    #[must_use]
    pub fn claims(&self) -> Vec<Repeated> {
        let mut seeds = self.tables.iter().map(|table| (table.seed, claims(table)));
        let (seed, first) = seeds.next().expect("a table has a seed");
        let mut all: Vec<_> = first.into_iter().map(|claim| Repeated { seeds: vec![(seed, claim)] }).collect();
        for (seed, claims) in seeds {
            all.iter_mut().zip(claims).for_each(|(repeated, claim)| repeated.seeds.push((seed, claim)));
        }
        all
    }

    /// Why trials failed, each reason once.
    #[must_use]
    pub fn failures(&self) -> Vec<&str> {
        let cells = self.tables.iter().flat_map(Table::cells);
        let trials = cells.flat_map(|cell: &Cell| &cell.trials);
        let mut reasons: Vec<&str> = trials.filter_map(|trial| trial.as_ref().err()).map(String::as_str).collect();
        reasons.sort_unstable();
        reasons.dedup();
        reasons
    }
}
