//! The summing-up at the end of a reproduction: each published claim in the paper's words, and the answer of the runs
//! to it.

use std::fmt::Write;

/// A published claim.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Statement {
    /// Letter of the claim.
    pub letter: &'static str,
    /// The claim in the paper's words.
    pub paper: &'static str,
    /// Place of the claim in the paper.
    pub place: &'static str,
    /// The condition on the runs under which the claim counts as confirmed.
    pub means: &'static str,
}

/// The answer of the runs to a claim.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Finding {
    /// The claim holds.
    Confirmed,
    /// The claim does not hold.
    NotConfirmed,
    /// The claim holds at some seeds and not at others: one draw cannot tell.
    MetInSome {
        /// Number of seeds at which it holds.
        met: usize,
        /// Number of all seeds.
        seeds: usize,
    },
    /// The runs do not decide, or the answer depends on what the paper leaves open.
    CannotBeTold,
}

impl Finding {
    /// Returns the finding from whether the claim holds; `None` if the runs do not decide.
    pub fn of(met: Option<bool>) -> Self {
        match met {
            Some(true) => Self::Confirmed,
            Some(false) => Self::NotConfirmed,
            None => Self::CannotBeTold,
        }
    }

    /// Returns the finding from cases that differ in what the paper leaves open; all of them have to agree.
    pub fn of_cases(cases: &[bool]) -> Self {
        match cases.first() {
            Some(first) if cases.iter().all(|case| case == first) => Self::of(Some(*first)),
            _ => Self::CannotBeTold,
        }
    }

    /// Returns the finding from every seed's answer; `None` where that seed's runs do not decide.
    pub fn of_seeds(seeds: &[Option<bool>]) -> Self {
        let met = seeds.iter().filter(|met| **met == Some(true)).count();
        match seeds.first() {
            Some(first) if seeds.iter().all(|met| met == first) => Self::of(*first),
            _ if met > 0 => Self::MetInSome { met, seeds: seeds.len() },
            _ => Self::CannotBeTold,
        }
    }

    /// Returns the finding as text.
    pub fn name(self) -> String {
        match self {
            Self::Confirmed => "confirmed".into(),
            Self::NotConfirmed => "not confirmed".into(),
            Self::MetInSome { met, seeds } => format!("met in {met} of {seeds}"),
            Self::CannotBeTold => "cannot be told".into(),
        }
    }
}

/// A claim with its finding and the figures that the finding rests on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sum {
    /// The claim.
    pub statement: Statement,
    /// The answer of the runs.
    pub finding: Finding,
    /// The figures.
    pub found: String,
}

/// Returns the summing-up as text; empty if the paper claims nothing.
pub fn summing_up(sums: &[Sum]) -> String {
    if sums.is_empty() {
        return String::new();
    }
    let mut text = String::from("\nSumming up: the paper's claims, and what came out here\n");
    for Sum { statement: Statement { letter, paper, place, means }, finding, found } in sums {
        let _ = writeln!(text, "{:<6}{:<16}\"{paper}\" ({place})", format!("({letter})"), finding.name());
        let colon = if found.is_empty() { "" } else { ": " };
        let _ = writeln!(text, "{:<22}{means}{colon}{found}", "");
    }
    text
}
