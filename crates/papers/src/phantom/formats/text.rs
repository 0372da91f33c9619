//! The word formats of an arm as text and CSV.

use std::fmt::Write;

use hpu_signal::Notation;

use super::super::SignalBound;
use super::super::postures::Measured;
use super::{Fate, Formats, SignalRange, full_scales_nm, greatest, stiffness, sums};
use crate::studies::summing::summing_up;
use hpu_page::quoted;
use hpu_study::phantom::workspace::Workspace;

/// First line of the CSV; units are in their own columns.
pub const FORMATS_CSV_HEADER: &str = "configuration,stiffness_max_n_per_m,signal,unit,format,format_min,format_max,\
     proved_min,proved_max,headroom_bits,overflow,proved_error,measured_min,measured_max,measured_error,\
     scaled_unit,proved_error_scaled,measured_error_scaled\n";

/// Returns every signal of every configuration as CSV, one a row; unknown values are left empty.
pub fn formats_csv(all: &[Formats]) -> String {
    let known = |value: Option<f64>| {
        value.filter(|value| value.is_finite()).map_or(String::new(), |value| format!("{value:e}"))
    };
    let mut text = FORMATS_CSV_HEADER.to_string();
    for Formats { words, rows } in all {
        for row in rows {
            let SignalRange { proved, measured, scale: (factor, scaled_unit) } = row;
            let SignalBound { name, unit, min, max, error, format, .. } = proved;
            let least = format.min() as f64 * format.lsb();
            let _ = writeln!(
                text,
                "{},{},{name},{unit},{},{least:e},{:e},{min:e},{max:e},{:.3},{},{},{},{},{},{scaled_unit},{},{}",
                words.name,
                words.stiffness_max_n_per_m,
                quoted(&format.to_string()),
                greatest(*format),
                row.headroom_bits(),
                row.fate().name(),
                known(Some(*error)),
                known(measured.map(|measured| measured.min)),
                known(measured.map(|measured| measured.max)),
                known(measured.map(|measured| measured.error)),
                known(Some(factor * error)),
                known(measured.map(|measured| factor * measured.error)),
            );
        }
    }
    text
}

/// Returns the tables of formats, written in this notation, then the workspace, and last what plain (1,9,22) cannot
/// hold.
pub fn formats_text(all: &[Formats], workspace: &Workspace, notation: Notation) -> String {
    let mut text = String::from(
        "proved: for every posture that the tables hold, every wall and every force, by interval arithmetic; \
         an upper bound\n\
         measured: from every count of the tables, every combination of their edges, and random postures, \
         through the blocks\n\
         errors: of positions in um, of torques in % of the joint's full scale, \
         0.17 N.m at the motor times the ratio; those\n\
         of forces count from the tip as the datapath sees it, \
         those of torques and commands are for the forces as words\n\n",
    );
    for formats in all {
        text += &table(formats, notation);
    }
    text += &workspace.text();
    if let Some(line) = plain(all) {
        let _ = writeln!(text, "\n{line}");
    }
    text + &summing_up(&sums(all, workspace))
}

fn table(Formats { words, rows }: &Formats, notation: Notation) -> String {
    let wide = rows.iter().map(|row| notation.of(row.proved.format).len() + 1).fold(10, usize::max);
    let [first, second, third] = full_scales_nm(&words.config);
    let mut text = format!(
        "{}: {}; walls up to {} N/m; full scale {first:.3}, {second:.3}, {third:.3} N.m\n",
        words.name,
        words.about,
        stiffness(words.stiffness_max_n_per_m)
    );
    let _ = writeln!(
        text,
        "{:<10}{:<10}{:<wide$}{:>10} |{:>12}{:>12}{:>12} {:<16}{:>9}  {:<10}|{:>12}{:>12}{:>12}",
        "", "", "", "format", "proved", "proved", "proved", "", "headroom", "", "measured", "measured", "measured"
    );
    let _ = writeln!(
        text,
        "{:<10}{:<10}{:<wide$}{:>10} |{:>12}{:>12}{:>12} {:<16}{:>9}  {:<10}|{:>12}{:>12}{:>12}",
        "signal",
        "unit",
        "format",
        "ends at",
        "min",
        "max",
        "error",
        "unit of error",
        "bits",
        "overflow",
        "min",
        "max",
        "error"
    );
    for row in rows {
        let SignalRange { proved, measured, scale: (factor, unit) } = row;
        let mut line = format!(
            "{:<10}{:<10}{:<wide$}{:>10} |{:>12}{:>12}{:>12} {unit:<16}{:>9.2}  {:<10}|",
            proved.name,
            proved.unit,
            notation.of(proved.format),
            format!("{}", libm::exp2(f64::from(proved.format.int()))),
            digits(proved.min),
            digits(proved.max),
            digits(factor * proved.error),
            row.headroom_bits(),
            row.fate().name(),
        );
        match measured {
            Some(Measured { min, max, error }) => {
                let _ = write!(line, "{:>12}{:>12}{:>12}", digits(*min), digits(*max), digits(factor * error));
            }
            None => line += "   inside a block, not seen",
        }
        let _ = writeln!(text, "{line}");
    }
    text + "\n"
}

/// Returns a value in four digits; an error without bound is "unknown".
fn digits(value: f64) -> String {
    match value.abs() {
        size if size.is_infinite() => "unknown".into(),
        0.0 => "0".into(),
        size if (1e-3..1e6).contains(&size) => {
            let decimals = (3 - libm::floor(libm::log10(size)) as i32).clamp(0, 6).unsigned_abs() as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.2e}"),
    }
}

/// Returns what plain (1,9,22) cannot hold, and why.
pub fn plain(all: &[Formats]) -> Option<String> {
    let formats = all.iter().find(|formats| formats.rows.iter().any(|row| row.fate() == Fate::Wraps))?;
    let config = formats.words.config;
    let (word, stiffest) = (config.formats.stiffness, formats.words.stiffness_max_n_per_m);
    let wrapping: Vec<_> = formats.rows.iter().filter(|row| row.fate() == Fate::Wraps).collect();
    let names: Vec<_> = wrapping.iter().map(|row| row.proved.name).collect();
    let units = |value: f64| libm::round(value / word.lsb()) as i128;
    let seen = word.to_f64(word.wrap(units(stiffest)));
    let gain = config.gains.into_iter().max().map(|gain| f64::from(gain) / f64::from(1u32 << config.gain_frac))?;
    let most = libm::exp2(f64::from(config.formats.torque.int()));
    Some(format!(
        "Plain (1,9,22) cannot hold the {}: 9 integer bits end at {} N/m, and the stiffest wall of {} N/m wraps to {} \
         N/m; nor the gain to the DAC of {gain:.1} counts per N.m, which needs {} integer bits, nor commands beyond \
         {most} counts (both have words of their own here). All else fits; forces and commands saturate by intent.",
        names.join(", "),
        stiffness(greatest(word)),
        stiffness(stiffest),
        stiffness(seen),
        libm::ceil(libm::log2(gain)),
    ))
}
