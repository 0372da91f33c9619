//! The ladder: the same table from ever more of the physics, and which claims each rung reproduces.

use std::fmt::Write;

use hpu_cosim::scene::Platform;

use super::claims::{Claim, claims};
use super::published::Agreement;
use super::summing::Finding;
use super::table::Table;

/// For which platforms an override is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum For {
    /// All of them.
    All,
    /// The multitasking one.
    Pmos,
}

impl For {
    fn covers(self, platform: Platform) -> bool {
        match self {
            Self::All => true,
            Self::Pmos => platform == Platform::Pmos1,
        }
    }
}

/// A model: what of the physics it has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rung {
    /// Its name, without a comma.
    pub name: &'static str,
    /// What it has.
    pub about: &'static str,
    /// What it changes of the scene: key and value, and for which platforms.
    pub overrides: &'static [(For, &'static str, &'static str)],
}

impl Rung {
    /// The scene as it is shipped.
    pub const SHIPPED: Self = Self { name: "shipped", about: "the scene as it is shipped", overrides: &[] };

    /// What it changes of the scene on this platform.
    pub fn overrides(&self, platform: Platform) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.overrides.iter().filter(move |(who, ..)| who.covers(platform)).map(|(_, key, value)| (*key, *value))
    }
}

/// The rungs. Each gives the whole section `[model]`, so that it does not depend on the shipped one.
pub const RUNGS: [Rung; 8] = [
    Rung {
        name: "ideal",
        about: "a rigid mass on one joint, forces from its exact position, sampled and held; no friction, no delay",
        overrides: &[
            (For::Pmos, "platform.jitter", "0"),
            (For::Pmos, "platform.missed", "0"),
            (For::All, "model", r#"{ law = "ideal", joints = "tested", friction = false, delay = 0 }"#),
        ],
    },
    Rung {
        name: "+ quantisation",
        about: "forces from encoder counts, in the platform's words",
        overrides: &[
            (For::Pmos, "platform.jitter", "0"),
            (For::Pmos, "platform.missed", "0"),
            (For::All, "model", r#"{ joints = "tested", friction = false, delay = 0 }"#),
        ],
    },
    Rung {
        name: "+ Coulomb friction",
        about: "the device's Coulomb friction",
        overrides: &[
            (For::Pmos, "platform.jitter", "0"),
            (For::Pmos, "platform.missed", "0"),
            (For::All, "model", r#"{ joints = "tested", delay = 0 }"#),
        ],
    },
    Rung {
        name: "+ delay",
        about: "a host's delay of one sample, and the irregularity of PMOS-1",
        overrides: &[(For::All, "model", r#"{ joints = "tested" }"#)],
    },
    Rung {
        name: "+ amplifier",
        about: "an amplifier that lags by 0.4 ms: identified on PMOS-1 (passive at 750 N/m, not at 1000) together with \
                the transmission of the next rung, with which 0.30 to 0.40 ms fit; see phantom-lag",
        overrides: &[(For::All, "model", r#"{ joints = "tested", amplifier_lag = "0.4 ms" }"#)],
    },
    Rung {
        name: "+ transmission",
        about: "a flexible transmission of 3.5 kN/m between motor and arm: assumed; another would ask for another lag",
        overrides: &[(
            For::All,
            "model",
            r#"{ joints = "tested", amplifier_lag = "0.4 ms", transmission_stiffness = "3.5 kN/m" }"#,
        )],
    },
    Rung {
        name: "full arm",
        about: "all three joints",
        overrides: &[(For::All, "model", r#"{ amplifier_lag = "0.4 ms", transmission_stiffness = "3.5 kN/m" }"#)],
    },
    Rung {
        name: "late host (fitted)",
        about: "a host 0.8 ms late at any rate instead of one sample, an amplifier of 0.6 ms: two figures fitted, to PMOS-1 and \
                to the twofold of RTOS-20",
        overrides: &[(
            For::All,
            "model",
            r#"{ amplifier_lag = "0.6 ms", transmission_stiffness = "3.5 kN/m", delay = 0, latency = "0.8 ms" }"#,
        )],
    },
];

/// What became of a rung.
#[derive(Clone, PartialEq, Debug)]
pub struct Summary {
    /// The model.
    pub rung: Rung,
    /// Its table.
    pub table: Table,
    /// The paper's claims.
    pub claims: Vec<Claim>,
    /// Cells that are as printed.
    pub agreement: Agreement,
}

impl Summary {
    /// Sums up the table of a rung.
    #[must_use]
    pub fn new(rung: Rung, table: Table) -> Self {
        Self { rung, claims: claims(&table), agreement: Agreement::of(&table), table }
    }

    /// Claims that are met, of those that can be told.
    #[must_use]
    pub fn met(&self) -> (usize, usize) {
        let told = self.claims.iter().filter_map(|claim| claim.met);
        (told.clone().filter(|met| *met).count(), told.count())
    }
}

/// The rungs against the claims, and then the numbers of each.
#[must_use]
pub fn ladder_text(ladder: &[Summary]) -> String {
    let mut text = format!("{:<20}{:>14}{:>8}", "model", "as printed", "claims");
    for claim in ladder.first().map_or(&[][..], |rung| &rung.claims) {
        let _ = write!(text, "{:>5}", claim.name);
    }
    text += "\n";
    for rung in ladder {
        let Agreement { legible, same } = rung.agreement;
        let (met, told) = rung.met();
        let _ =
            write!(text, "{:<20}{:>14}{:>8}", rung.rung.name, format!("{same} of {legible}"), format!("{met}/{told}"));
        for claim in &rung.claims {
            let _ = write!(text, "{:>5}", claim.met.map_or("?", |met| if met { "met" } else { "-" }));
        }
        text += "\n";
    }
    for claim in ladder.first().map_or(&[][..], |rung| &rung.claims) {
        let _ = writeln!(text, "\n({}) {}", claim.name, claim.says);
        for rung in ladder {
            let found = rung.claims.iter().find(|other| other.name == claim.name);
            if let Some(Claim { met: met @ Some(_), found, .. }) = found {
                let _ = writeln!(text, "  {:<20}{:<15}{found}", rung.rung.name, Finding::of(*met).name());
            }
        }
    }
    text += "\nModels, each with all that those above it have\n";
    for rung in ladder {
        let _ = writeln!(text, "  {:<20}{}", rung.rung.name, rung.rung.about);
        for reason in rung.table.failures() {
            let _ = writeln!(text, "  {:<20}could not be run: {reason}", "");
        }
    }
    text + &by_rung(ladder)
}

/// The summing-up: each claim in the paper's words, and which rungs find what.
fn by_rung(ladder: &[Summary]) -> String {
    let mut text = String::from("\nSumming up: the paper's claims, and what each model says to them\n");
    for claim in ladder.first().map_or(&[][..], |rung| &rung.claims) {
        let _ = writeln!(text, "{:<6}\"{}\" ({})", format!("({})", claim.name), claim.paper, claim.place);
        for finding in [Finding::Confirmed, Finding::NotConfirmed, Finding::CannotBeTold] {
            let of = |rung: &&Summary| {
                rung.claims.iter().any(|other| other.name == claim.name && Finding::of(other.met) == finding)
            };
            let rungs: Vec<_> = ladder.iter().filter(of).map(|rung| rung.rung.name).collect();
            if !rungs.is_empty() {
                let _ = writeln!(text, "      {:<16}{}", finding.name(), rungs.join(", "));
            }
        }
    }
    text
}

/// Rungs and claims, one of each a row.
#[must_use]
pub fn ladder_csv(ladder: &[Summary]) -> String {
    let mut text = "rung,legible_cells,same_cells,claim,met,found\n".to_string();
    for Summary { rung, claims, agreement, .. } in ladder {
        for claim in claims {
            let met = claim.met.map_or(String::new(), |met| met.to_string());
            let (legible, same) = (agreement.legible, agreement.same);
            let _ = writeln!(text, "{},{legible},{same},{},{met},\"{}\"", rung.name, claim.name, claim.found);
        }
    }
    text
}
