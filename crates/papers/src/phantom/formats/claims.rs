//! The paper's claims about the datapath's word formats and its workspace.

use super::{Fate, Formats};
use crate::studies::summing::{Finding, Statement, Sum};
use hpu_study::phantom::workspace::Workspace;

/// Returns the findings on the paper's claims, from the word formats and the workspace.
pub fn sums(all: &[Formats], workspace: &Workspace) -> Vec<Sum> {
    vec![words(all), lookup(workspace)]
}

fn words(all: &[Formats]) -> Sum {
    let plain = all.iter().find(|formats| formats.words.name == "plain_q22");
    let wrapping = plain.map(|formats| {
        let wrapping = formats.rows.iter().filter(|row| row.fate() == Fate::Wraps);
        wrapping.map(|row| row.proved.name).collect::<Vec<_>>()
    });
    let found = match &wrapping {
        None => String::new(),
        Some(names) if names.is_empty() => "none wraps".into(),
        Some(names) => format!("wraps: {}", names.join(", ")),
    };
    Sum {
        statement: Statement {
            letter: "a",
            paper: "The FPGA platform was implemented using 32-bit integer math with a fixed point shift of 22 bits",
            place: "Sec. 2.3; stiffnesses from 5 up to 40,000 N/m",
            means: "no word of (1,9,22) everywhere wraps, up to walls of 40000 N/m",
        },
        finding: Finding::of(wrapping.map(|names| names.is_empty())),
        found,
    }
}

fn lookup(workspace: &Workspace) -> Sum {
    let reachable = workspace.cells - workspace.unreachable;
    let percent = |held: u64, of: u64| 100.0 * held as f64 / of as f64;
    let shares =
        workspace.held.iter().map(|(depth, held)| (depth, [workspace.cells, reachable].map(|of| percent(*held, of))));
    let about = |share: &f64| (85.0..=95.0).contains(share);
    let fits: Vec<_> = shares.filter(|(_, shares)| shares.iter().all(about)).collect();
    let told = fits.iter().map(|(depth, [of_box, of_reachable])| {
        format!("{depth} address bits: {of_box:.1} % of the box, {of_reachable:.1} % of what is reachable")
    });
    let told = told.collect::<Vec<_>>().join("; ");
    Sum {
        statement: Statement {
            letter: "b",
            paper: "due to lookup memory constraints of the FPGA, the functional workspace of the FPGA platform was \
                    about 90% the size of the other platforms",
            place: "Sec. 2.3",
            means: "tables of some depth hold 85 to 95 % of the box, and of what is reachable of it",
        },
        finding: Finding::of(Some(!fits.is_empty())),
        found: if told.is_empty() { "no depth does".into() } else { told },
    }
}
