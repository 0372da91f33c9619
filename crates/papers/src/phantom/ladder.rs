//! The ladder: the same table from models with more and more of the physics, and which claims each model reproduces.

use std::fmt::Write;

use hpu_cosim::scene::Platform;

use super::published::Agreement;
use super::tables::{Repeated, Tables};
use crate::studies::summing::Finding;

/// The platforms that an override applies to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum For {
    /// All platforms.
    All,
    /// The multitasking platform, PMOS-1.
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

/// A model with a part of the physics.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rung {
    /// Name of the model, without a comma.
    pub name: &'static str,
    /// The physics that the model adds.
    pub about: &'static str,
    /// Overrides of the scene: the platforms, the key and its value.
    pub overrides: &'static [(For, &'static str, &'static str)],
}

impl Rung {
    /// The scene as it is shipped.
    pub const SHIPPED: Self = Self { name: "shipped", about: "the scene as it is shipped", overrides: &[] };

    /// Returns the model's overrides of the scene on this platform.
    pub fn overrides(&self, platform: Platform) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.overrides.iter().filter(move |(who, ..)| who.covers(platform)).map(|(_, key, value)| (*key, *value))
    }
}

/// The rungs. Each sets the whole section `[model]`, so that it does not depend on the shipped scene's.
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
        about: "a host 0.8 ms late at any rate instead of one sample, an amplifier of 0.6 ms: two figures fitted, to \
                PMOS-1 and to the twofold of RTOS-20",
        overrides: &[(
            For::All,
            "model",
            r#"{ amplifier_lag = "0.6 ms", transmission_stiffness = "3.5 kN/m", delay = 0, latency = "0.8 ms" }"#,
        )],
    },
];

/// The result of a rung.
#[derive(Clone, PartialEq, Debug)]
pub struct Summary {
    /// The model.
    pub rung: Rung,
    /// The model's table at every seed.
    pub tables: Tables,
    /// The paper's claims.
    pub claims: Vec<Repeated>,
    /// How many cells are as printed.
    pub agreement: Agreement,
}

impl Summary {
    /// Returns the summary of a rung's tables.
    pub fn new(rung: Rung, tables: Tables) -> Self {
        Self { rung, claims: tables.claims(), agreement: Agreement::of(&tables), tables }
    }

    /// Returns the number of claims met at every seed, of claims met at some seeds only, and of all claims that can be
    /// told.
    pub fn met(&self) -> [usize; 3] {
        let findings: Vec<_> = self.claims.iter().map(Repeated::finding).collect();
        let count = |is: &dyn Fn(&Finding) -> bool| findings.iter().filter(|finding| is(finding)).count();
        [
            count(&|finding| *finding == Finding::Confirmed),
            count(&|finding| matches!(finding, Finding::MetInSome { .. })),
            count(&|finding| *finding != Finding::CannotBeTold),
        ]
    }
}

/// Returns the finding on a claim for a narrow field.
pub fn brief(finding: Finding) -> String {
    match finding {
        Finding::Confirmed => "met".into(),
        Finding::NotConfirmed => "not".into(),
        Finding::MetInSome { met, seeds } => format!("{met}/{seeds}"),
        Finding::CannotBeTold => "?".into(),
    }
}

/// Returns the rungs against the claims as text, then the numbers of each claim.
pub fn ladder_text(ladder: &[Summary]) -> String {
    let mut text = format!("{:<20}{:>14}{:>8}", "model", "as printed", "claims");
    for claim in ladder.first().map_or(&[][..], |rung| &rung.claims) {
        let _ = write!(text, "{:>6}", claim.first().name);
    }
    text += "\n";
    for rung in ladder {
        let Agreement { legible, same, mixed } = rung.agreement;
        let [met, some, told] = rung.met();
        let (same, met) = (plus(same, mixed), plus(met, some));
        let _ =
            write!(text, "{:<20}{:>14}{:>8}", rung.rung.name, format!("{same} of {legible}"), format!("{met}/{told}"));
        for claim in &rung.claims {
            let _ = write!(text, "{:>6}", brief(claim.finding()));
        }
        text += "\n";
    }
    if let Some(rung) = ladder.first() {
        text += &key(rung.tables.each().len(), rung.tables.first().seed);
    }
    for (index, claim) in ladder.first().map_or(&[][..], |rung| &rung.claims).iter().enumerate() {
        let _ = writeln!(text, "\n({}) {}", claim.first().name, claim.first().says);
        for rung in ladder {
            let claim = &rung.claims[index];
            if claim.finding() != Finding::CannotBeTold {
                let _ = writeln!(text, "  {:<20}{:<15}{}", rung.rung.name, claim.finding().name(), claim.found());
            }
        }
    }
    text += "\nModels, each with all that those above it have\n";
    for rung in ladder {
        let _ = writeln!(text, "  {:<20}{}", rung.rung.name, rung.rung.about);
        for reason in rung.tables.failures() {
            let _ = writeln!(text, "  {:<20}could not be run: {reason}", "");
        }
    }
    text + &by_rung(ladder)
}

/// Returns a count that holds at every seed, and what some seeds add to it.
pub fn plus(every: usize, some: usize) -> String {
    if some == 0 { every.to_string() } else { format!("{every}+{some}") }
}

/// Returns the legend of the fields.
fn key(seeds: usize, first: u64) -> String {
    let mut text = "\nmet   not   ? its table does not tell".to_string();
    if seeds == 1 {
        let _ = writeln!(text, "\nevery cell is one draw, of seed {first}");
    } else {
        let _ = writeln!(
            text,
            "   k/{seeds} met in k of {seeds} seeds: one draw cannot tell   m+s: m at every seed, s more at some\n\
             Seeds: cells near a boundary are run at {seeds} seeds, from {first}; \
             the others at seed {first} alone, and they\n\
             count at every seed with what they are there"
        );
    }
    text
}

/// Returns the summing-up: each claim in the paper's words, and the rungs with each finding.
fn by_rung(ladder: &[Summary]) -> String {
    let mut text = String::from("\nSumming up: the paper's claims, and what each model says to them\n");
    for (index, claim) in ladder.first().map_or(&[][..], |rung| &rung.claims).iter().enumerate() {
        let claim = claim.first();
        let _ = writeln!(text, "{:<6}\"{}\" ({})", format!("({})", claim.name), claim.paper, claim.place);
        let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
        for rung in ladder {
            let name = rung.claims[index].finding().name();
            match groups.iter_mut().find(|(other, _)| *other == name) {
                Some((_, rungs)) => rungs.push(rung.rung.name),
                None => groups.push((name, vec![rung.rung.name])),
            }
        }
        for (name, rungs) in groups {
            let _ = writeln!(text, "      {name:<16}{}", rungs.join(", "));
        }
    }
    text
}

/// Returns rungs and claims as CSV, one row for each pair.
pub fn ladder_csv(ladder: &[Summary]) -> String {
    let mut text =
        "rung,legible_cells,same_cells,same_at_some_seeds,claim,seeds,seeds_met,seeds_not_met,found\n".to_string();
    for Summary { rung, claims, agreement: Agreement { legible, same, mixed }, .. } in ladder {
        for claim in claims {
            let count = |wanted| claim.seeds.iter().filter(|(_, claim)| claim.met == Some(wanted)).count();
            let (met, not, seeds) = (count(true), count(false), claim.seeds.len());
            let (name, found) = (claim.first().name, claim.found());
            let _ = writeln!(text, "{},{legible},{same},{mixed},{name},{seeds},{met},{not},\"{found}\"", rung.name);
        }
    }
    text
}
