//! What the paper says of its table, held against a table.
//!
//! The paper reads its limits off the rows, so a limit here is a row too: the stiffest that is passive, all softer ones being so.

use hpu_cosim::PASSIVE_RMS_M;
use hpu_cosim::scene::{Direction, Platform};

use super::table::{Class, Limit, Table};

/// A statement of the paper, and what the table says to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Claim {
    /// Its letter.
    pub name: &'static str,
    /// A few words for it, for a column's head.
    pub short: &'static str,
    /// What is claimed, and what counts as that.
    pub says: &'static str,
    /// Whether the table says so, along every axis that it has; `None` when it has nothing to say.
    pub met: Option<bool>,
    /// The numbers, axis by axis.
    pub found: String,
}

const PMOS: Platform = Platform::Pmos1;
const RTOS: [Platform; 4] = [Platform::Rtos(1), Platform::Rtos(5), Platform::Rtos(10), Platform::Rtos(20)];
const FPGA: [Platform; 3] = [Platform::Fpga(20), Platform::Fpga(100), Platform::Fpga(400)];

/// Factor within which two curves "track closely".
const CLOSELY: f64 = 2.0;

/// An axis' answer: the number, and whether it is as claimed.
type Answer = Option<(String, bool)>;

/// The paper's claims, each held against the table.
#[must_use]
pub fn claims(table: &Table) -> Vec<Claim> {
    let (y, xz) = (&[Direction::Y], &[Direction::X, Direction::Z]);
    let all = &Direction::ALL;
    let claim = |name, short, says, axes: &[Direction], answer: &dyn Fn(Direction) -> Answer| {
        let answers: Vec<_> = axes.iter().filter_map(|&axis| Some((axis, answer(axis)?))).collect();
        let numbers = answers
            .iter()
            .map(|(axis, (number, met))| format!("{} {number}{}", axis.name(), if *met { "" } else { " (not so)" }));
        let found = numbers.collect::<Vec<_>>().join(", ");
        let met = (!answers.is_empty()).then(|| answers.iter().all(|(_, (_, met))| *met));
        Claim { name, short, says, met, found }
    };
    let rtos_5 = |axis| times(table, axis, &RTOS[1..2], |ratio| ratio >= 2.0);
    let fpga_over = |axis| times(table, axis, &FPGA, |ratio| ratio > 5.0);
    vec![
        claim("a", "PMOS-1 750-1000", "PMOS-1 reaches 750 to 1000 N/m", all, &|axis| {
            let Limit { passive_n_per_m, .. } = table.limit(axis, PMOS)?;
            Some((newtons(passive_n_per_m), passive_n_per_m.is_some_and(|k| (750.0..=1000.0).contains(&k))))
        }),
        claim("b", "RTOS-1 = PMOS-1", "RTOS-1 reaches what PMOS-1 does: the same row", all, &|axis| {
            same_row(table, axis, PMOS, Platform::Rtos(1))
        }),
        claim("c1", "RTOS-5 >= 2x", "RTOS-5 reaches at least two times PMOS-1", all, &rtos_5),
        claim("c2", "RTOS 2x", "the best RTOS reaches twice PMOS-1: 1.5 to 2.5 times", all, &|axis| {
            times(table, axis, &RTOS, |ratio| (1.5..2.5).contains(&ratio))
        }),
        claim("d1", "FPGA > 5x", "the best FPGA reaches more than five times PMOS-1, along x and z", xz, &fpga_over),
        over_six(table),
        claim("e", "FPGA-100 = FPGA-400", "FPGA-400 reaches no more than FPGA-100: the same row", all, &|axis| {
            same_row(table, axis, Platform::Fpga(100), Platform::Fpga(400))
        }),
        claim(
            "f",
            "RTOS-20 ~ FPGA-20",
            "the rms of RTOS-20 and FPGA-20 along y track closely: within a factor of 2 in every row where either is not passive",
            y,
            &|axis| track(table, axis, Platform::Rtos(20), Platform::Fpga(20)),
        ),
        claim(
            "g1",
            "250 x, 5000 not",
            "RTOS-20 along y is passive at 250 N/m, not at 5000 (text to Fig. 4)",
            y,
            &|axis| soft_and_stiff(table, axis, 250.0, 5000.0),
        ),
        claim(
            "g2",
            "500 x, 2500 not",
            "RTOS-20 along y is passive at 500 N/m, not at 2500 (caption of Fig. 4)",
            y,
            &|axis| soft_and_stiff(table, axis, 500.0, 2500.0),
        ),
    ]
}

/// The stiffest passive wall on any of these platforms over that on PMOS-1.
fn best_ratio(table: &Table, axis: Direction, platforms: &[Platform]) -> Option<f64> {
    let limits = platforms.iter().map(|&platform| table.limit(axis, platform)).collect::<Option<Vec<_>>>()?;
    let best = limits.iter().filter_map(|limit| limit.passive_n_per_m).fold(0.0, f64::max);
    Some(best / table.limit(axis, PMOS)?.passive_n_per_m.unwrap_or(f64::NAN))
}

fn times(table: &Table, axis: Direction, platforms: &[Platform], met: impl Fn(f64) -> bool) -> Answer {
    let ratio = best_ratio(table, axis, platforms)?;
    let said = if ratio.is_nan() { "PMOS-1 has no passive row".to_string() } else { format!("{ratio:.1}") };
    Some((said, met(ratio)))
}

/// The abstract's claim, which names no axis: so one is enough.
fn over_six(table: &Table) -> Claim {
    let ratios = Direction::ALL.iter().filter_map(|&axis| Some((axis, best_ratio(table, axis, &FPGA)?)));
    let best = ratios.filter(|(_, ratio)| !ratio.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1));
    Claim {
        name: "d2",
        short: "FPGA > 6x",
        says: "the best FPGA reaches over six times PMOS-1, along some axis",
        met: best.map(|(_, ratio)| ratio > 6.0),
        found: best.map_or(String::new(), |(axis, ratio)| format!("at most {ratio:.1}, along {}", axis.name())),
    }
}

fn same_row(table: &Table, axis: Direction, one: Platform, other: Platform) -> Answer {
    let (one, other) = (table.limit(axis, one)?.passive_n_per_m, table.limit(axis, other)?.passive_n_per_m);
    Some((format!("{} and {}", newtons(one), newtons(other)), one == other))
}

fn track(table: &Table, axis: Direction, one: Platform, other: Platform) -> Answer {
    let (mut worst, mut parted) = ((1.0f64, 0.0), Vec::new());
    for &row in &table.stiffnesses_n_per_m {
        let (one, other) = (table.cell(axis, one, row)?, table.cell(axis, other, row)?);
        match (one.rms_m(), other.rms_m()) {
            (Some(one), Some(other)) if one.max(other) >= PASSIVE_RMS_M => {
                let factor = one.max(other) / one.min(other);
                if factor > worst.0 {
                    worst = (factor, row);
                }
            }
            (Some(_), None) | (None, Some(_)) => parted.push(row.to_string()),
            _ => {}
        }
    }
    let mut said = format!("at most {:.2} times", worst.0);
    if worst.1 > 0.0 {
        said += &format!(" (at {} N/m)", worst.1);
    }
    if !parted.is_empty() {
        said += &format!(", only one aborted at {} N/m", parted.join(", "));
    }
    Some((said, worst.0 <= CLOSELY && parted.is_empty()))
}

fn soft_and_stiff(table: &Table, axis: Direction, soft: f64, stiff: f64) -> Answer {
    let class = |row| Some(table.cell(axis, Platform::Rtos(20), row)?.class);
    let (soft, stiff) = (class(soft)?, class(stiff)?);
    let met = soft == Class::Passive && matches!(stiff, Class::NonPassive | Class::HighlyUnstable);
    Some((format!("{} and {}", soft.name(), stiff.name()), met))
}

/// A stiffness in N/m, or that there is none.
pub(super) fn newtons(stiffness_n_per_m: Option<f64>) -> String {
    stiffness_n_per_m.map_or("none".into(), |stiffness| stiffness.to_string())
}
