//! The paper's claims about its table, compared with the table of one seed.
//!
//! The paper reads its limits off the rows, so a limit here is also a row: the stiffest row that is passive and below
//! which all softer rows are passive too.

use std::ops::Range;

use hpu_cosim::PASSIVE_RMS_M;
use hpu_cosim::scene::{Direction, Platform};

use super::table::{Class, Limit, Table};
use crate::studies::summing::Statement;

/// A claim of the paper, and whether the table confirms it.
#[derive(Clone, PartialEq, Debug)]
pub struct Claim {
    /// Letter of the claim.
    pub name: &'static str,
    /// A short form of the claim, for the head of a column.
    pub short: &'static str,
    /// The claim in the paper's words.
    pub paper: &'static str,
    /// Place of the claim in the paper.
    pub place: &'static str,
    /// The condition on the table under which the claim counts as met.
    pub says: &'static str,
    /// Whether the table meets the claim along every axis that it has; `None` if the table cannot tell, for example
    /// because its rows end too early.
    pub met: Option<bool>,
    /// The numbers that decide it, axis by axis.
    pub found: String,
}

impl Claim {
    pub(super) fn statement(&self) -> Statement {
        Statement { letter: self.name, paper: self.paper, place: self.place, means: self.says }
    }
}

const PMOS: Platform = Platform::Pmos1;
const RTOS: [Platform; 4] = [Platform::Rtos(1), Platform::Rtos(5), Platform::Rtos(10), Platform::Rtos(20)];
const FPGA: [Platform; 3] = [Platform::Fpga(20), Platform::Fpga(100), Platform::Fpga(400)];

/// Greatest factor between two curves that "track closely".
const CLOSELY: f64 = 2.0;

/// An axis's answer: the number, and whether the claim is met; the inner `None` if the rows end too early to tell.
type Answer = Option<(String, Option<bool>)>;

/// Returns the paper's claims, each compared with the table.
pub fn claims(table: &Table) -> Vec<Claim> {
    let (y, xz) = (&[Direction::Y], &[Direction::X, Direction::Z]);
    let all = &Direction::ALL;
    let claim = |name, short, (paper, place), says, axes: &[Direction], answer: &dyn Fn(Direction) -> Answer| {
        let answers: Vec<_> = axes.iter().filter_map(|&axis| Some((axis, answer(axis)?))).collect();
        let numbers = answers.iter().map(|(axis, (number, met))| {
            let said = met.map_or(" (untold)", |met| if met { "" } else { " (not so)" });
            format!("{} {number}{said}", axis.name())
        });
        let found = numbers.collect::<Vec<_>>().join(", ");
        let any = |wanted| answers.iter().any(|(_, (_, met))| *met == wanted);
        let met = if any(Some(false)) { Some(false) } else { (any(Some(true)) && !any(None)).then_some(true) };
        Claim { name, short, paper, place, says, met, found }
    };
    let rtos_5 = |axis| times(table, axis, &RTOS[1..2], 2.0..f64::INFINITY);
    let fpga_over = |axis| times(table, axis, &FPGA, 5f64.next_up()..f64::INFINITY);
    vec![
        claim("a", "PMOS-1 750-1000", PMOS_1, "PMOS-1 reaches 750 to 1000 N/m", all, &|axis| {
            let limit = table.limit(axis, PMOS)?;
            let inside = limit.passive_n_per_m.is_some_and(|k| (750.0..=1000.0).contains(&k));
            Some((newtons(&limit), (!inside || limit.beyond_n_per_m.is_some()).then_some(inside)))
        }),
        claim("b", "RTOS-1 = PMOS-1", SAME_RATE, "RTOS-1 reaches what PMOS-1 does: the same row", all, &|axis| {
            same_row(table, axis, PMOS, Platform::Rtos(1))
        }),
        claim("c1", "RTOS-5 >= 2x", RTOS_5, "RTOS-5 reaches at least two times PMOS-1", all, &rtos_5),
        claim("c2", "RTOS 2x", TWICE, "the best RTOS reaches 1.5 to 2.5 times PMOS-1", all, &|axis| {
            times(table, axis, &RTOS, 1.5..2.5)
        }),
        claim(
            "d1",
            "FPGA > 5x",
            FIVE,
            "the best FPGA reaches more than five times PMOS-1, along x and z",
            xz,
            &fpga_over,
        ),
        over_six(table),
        claim(
            "e",
            "FPGA-100 = FPGA-400",
            NO_MORE,
            "FPGA-400 reaches the row that FPGA-100 does, and no more",
            all,
            &|axis| same_row(table, axis, Platform::Fpga(100), Platform::Fpga(400)),
        ),
        claim("f", "RTOS-20 ~ FPGA-20", TRACK, NEAR, y, &|axis| {
            track(table, axis, Platform::Rtos(20), Platform::Fpga(20))
        }),
        claim("f2", "FPGA-100 ~ FPGA-400", TRACK_TOO, NEAR, y, &|axis| {
            track(table, axis, Platform::Fpga(100), Platform::Fpga(400))
        }),
        claim("g1", "250 x, 5000 not", TEXT, "RTOS-20 along y is passive at 250 N/m, not at 5000", y, &|axis| {
            soft_and_stiff(table, axis, 250.0, 5000.0)
        }),
        claim("g2", "500 x, 2500 not", CAPTION, "RTOS-20 along y is passive at 500 N/m, not at 2500", y, &|axis| {
            soft_and_stiff(table, axis, 500.0, 2500.0)
        }),
        claim(
            "h",
            "FPGA > RTOS",
            STIFFER,
            "the best FPGA reaches a stiffer row than the best RTOS, along y",
            y,
            &|axis| stiffer(table, axis, &FPGA, &RTOS),
        ),
    ]
}

/// The condition under which two platforms track closely.
const NEAR: &str = "within a factor of 2 along y, in every row where either is not passive";

/// A quotation: the paper's words, and their place.
type Words = (&'static str, &'static str);

const PMOS_1: Words = (
    "The observed maximum virtual environment stiffness on the PMOS-1 system [...] is significantly higher (750-1000 \
     N/m) than the theoretical maximum stiffness of 10 N/m",
    "Sec. 4",
);
const SAME_RATE: Words = (
    "when comparing the PMOS and RTOS systems at the same update rate (1 kHz), there are no changes in the achievable \
     stiffness for passive interactions",
    "Sec. 4",
);
const RTOS_5: Words = (
    "by increasing to 5 kHz update rate on the RTOS, the achievable stiffness is at least two times greater than the \
     PMOS",
    "Sec. 4",
);
const TWICE: Words = ("The RTOS system passively displayed virtual walls twice as stiff", "Sec. 5");
const FIVE: Words = (
    "for these axes, the all-FPGA configuration enables maximum virtual surface stiffnesses more than five times \
     greater than those realized with the PMOS and RTOS architectures",
    "Sec. 4, of x and z",
);
const SIX: Words = (
    "the FPGA system passively displayed virtual walls six times as stiff as the commercially available system",
    "Sec. 5",
);
const NO_MORE: Words = (
    "Increasing the sampling rate of the FPGA from 100 kHz to 400 kHz does not result in any further improvements in \
     maximum stiffness",
    "caption of Fig. 5",
);
const TRACK: Words = ("the RTOS-20 and FPGA-20 values track closely", "Sec. 3, of the rms");
const TRACK_TOO: Words = ("as do the FPGA-100 and FPGA-400 values", "Sec. 3, of the rms");
const TEXT: Words = (
    "the empirical difference between the passive response at 250 N/m and the nonpassive response at 5000 N/m",
    "Sec. 3",
);
const CAPTION: Words = (
    "The lower-stiffness virtual wall (500 N/m) [...] is passive. The higher-stiffness virtual wall (2500 N/m) \
     exhibits nonpassive behavior at steady state",
    "caption of Fig. 4",
);
const STIFFER: Words = (
    "FPGA systems are able to display higher stiffnesses before reaching the defined limit for nonpassive behavior \
     than the RTOS systems",
    "caption of Fig. 5",
);

/// Returns the stiffest passive wall on any of these platforms divided by that on PMOS-1, as the least and the greatest
/// value that it may have. The two differ if the rows end before a limit is reached. Not a number if PMOS-1 has no
/// passive wall.
fn best_ratio(table: &Table, axis: Direction, platforms: &[Platform]) -> Option<(f64, f64)> {
    let limits = platforms.iter().map(|&platform| table.limit(axis, platform)).collect::<Option<Vec<_>>>()?;
    let best = limits.iter().filter_map(|limit| limit.passive_n_per_m).fold(0.0, f64::max);
    let pmos = table.limit(axis, PMOS)?;
    let ratio = best / pmos.passive_n_per_m.unwrap_or(f64::NAN);
    let open = limits.iter().any(|limit| limit.beyond_n_per_m.is_none());
    Some((if pmos.beyond_n_per_m.is_some() { ratio } else { 0.0 }, if open { f64::INFINITY } else { ratio }))
}

fn ratio_text((least, most): (f64, f64)) -> String {
    match (least, most) {
        (0.0, f64::INFINITY) => "PMOS-1 is passive in all rows".into(),
        (_, f64::INFINITY) => format!(">={least:.1}"),
        _ if least < most => format!("<={most:.1}"),
        _ => format!("{least:.1}"),
    }
}

fn times(table: &Table, axis: Direction, platforms: &[Platform], claimed: Range<f64>) -> Answer {
    let (least, most) = best_ratio(table, axis, platforms)?;
    if most.is_nan() {
        return Some(("PMOS-1 has no passive row".into(), Some(false)));
    }
    let outside = most < claimed.start || least >= claimed.end;
    let inside = least >= claimed.start && (most < claimed.end || claimed.end == f64::INFINITY);
    Some((ratio_text((least, most)), (outside || inside).then_some(inside)))
}

/// Judges the abstract's claim. The claim names no axis, so one axis that meets it is enough.
fn over_six(table: &Table) -> Claim {
    let ratios = Direction::ALL.iter().filter_map(|&axis| Some((axis, best_ratio(table, axis, &FPGA)?)));
    let ratios: Vec<_> = ratios.filter(|(_, (_, most))| !most.is_nan()).collect();
    let best = ratios.iter().max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let over = ratios.iter().any(|(_, (least, _))| *least > 6.0);
    let told = over || ratios.iter().all(|(_, (_, most))| *most <= 6.0);
    Claim {
        name: "d2",
        short: "FPGA > 6x",
        paper: SIX.0,
        place: SIX.1,
        says: "the best FPGA reaches over six times PMOS-1, along some axis",
        met: best.and(told.then_some(over)),
        found: best.map_or(String::new(), |(axis, ratio)| format!("{}, along {}", ratio_text(*ratio), axis.name())),
    }
}

/// Whether the best of some platforms is stiffer than the best of others.
fn stiffer(table: &Table, axis: Direction, these: &[Platform], those: &[Platform]) -> Answer {
    let best = |platforms: &[Platform]| {
        let limits = platforms.iter().map(|&platform| table.limit(axis, platform)).collect::<Option<Vec<_>>>()?;
        let most = limits.iter().filter_map(|limit| limit.passive_n_per_m).fold(0.0, f64::max);
        Some((most, limits.iter().any(|limit| limit.beyond_n_per_m.is_none())))
    };
    let ((these, ends), (those, end)) = (best(these)?, best(those)?);
    let least = |open| if open { ">=" } else { "" };
    // Rows that end before a limit is reached leave open which is the stiffer.
    let told = !end && (!ends || these > those);
    Some((format!("{}{these} and {}{those}", least(ends), least(end)), told.then_some(these > those)))
}

fn same_row(table: &Table, axis: Direction, one: Platform, other: Platform) -> Answer {
    let (one, other) = (table.limit(axis, one)?, table.limit(axis, other)?);
    // If every row of both is passive, or none is, the rows cannot tell the two apart; their limits need not be the
    // same.
    let ends = |limit: &Limit| limit.passive_n_per_m.is_some() && limit.beyond_n_per_m.is_some();
    let told = ends(&one) || ends(&other);
    let same = one.passive_n_per_m == other.passive_n_per_m;
    Some((format!("{} and {}", newtons(&one), newtons(&other)), told.then_some(same)))
}

fn track(table: &Table, axis: Direction, one: Platform, other: Platform) -> Answer {
    let (mut compared, mut worst, mut parted) = (0, (1.0f64, 0.0), Vec::new());
    for &row in &table.stiffnesses_n_per_m {
        let (one, other) = (table.cell(axis, one, row)?, table.cell(axis, other, row)?);
        match (one.rms_m(), other.rms_m()) {
            (Some(one), Some(other)) if one.max(other) >= PASSIVE_RMS_M => {
                compared += 1;
                let factor = one.max(other) / one.min(other);
                if factor > worst.0 {
                    worst = (factor, row);
                }
            }
            (Some(_), None) | (None, Some(_)) => parted.push(row.to_string()),
            _ => {}
        }
    }
    if compared == 0 && parted.is_empty() {
        return Some(("both passive, or both aborted, in every row".into(), None));
    }
    let mut said = format!("at most {:.2} times", worst.0);
    if worst.1 > 0.0 {
        said += &format!(" (at {} N/m)", worst.1);
    }
    if !parted.is_empty() {
        said += &format!(", only one aborted at {} N/m", parted.join(", "));
    }
    Some((said, Some(worst.0 <= CLOSELY && parted.is_empty())))
}

fn soft_and_stiff(table: &Table, axis: Direction, soft: f64, stiff: f64) -> Answer {
    let class = |row| Some(table.cell(axis, Platform::Rtos(20), row)?.class);
    let (soft, stiff) = (class(soft)?, class(stiff)?);
    let met = soft == Class::Passive && matches!(stiff, Class::NonPassive | Class::HighlyUnstable);
    Some((format!("{} and {}", soft.name(), stiff.name()), Some(met)))
}

/// Returns a limit in N/m as text: "none" if there is none, with ">=" if the limit is no less than the last row.
pub(super) fn newtons(limit: &Limit) -> String {
    let least = if limit.beyond_n_per_m.is_none() { ">=" } else { "" };
    limit.passive_n_per_m.map_or("none".into(), |stiffness| format!("{least}{stiffness}"))
}
