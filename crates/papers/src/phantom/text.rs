//! The table and its trials as text.

use std::fmt::Write;

use hpu_cosim::scene::{Direction, Platform};

use super::published::Agreement;
use super::table::{Class, Table};
use super::tables::{Repeated, Tables, Tally};
use super::trial::{Trial, Verdict};
use super::{Outcomes, Study, TrialSetup};
use crate::studies::summing::summing_up;
use hpu_page::quoted;

/// First line of a study's CSV; the unit is in the name.
pub const CSV_HEADER: &str =
    "rung,axis,platform,stiffness_n_per_m,seed,trial,outcome,rms_m,aborted_at_s,edges,reason\n";

/// Returns every trial that was run as CSV, one a row.
pub fn csv(study: &Study, outcomes: &Outcomes) -> String {
    let mut text = CSV_HEADER.to_string();
    let points = study.points();
    for (place, outcome) in outcomes {
        let TrialSetup { rung, axis, platform, stiffness_n_per_m, seed, trial } = points[*place];
        let (outcome, rms_m, at_s, edges, reason) = match outcome {
            Err(reason) => ("failed", None, None, String::new(), &reason.to_string()),
            Ok(Trial { verdict, edges, why }) => {
                let (name, at_s) = match verdict {
                    Verdict::Passive { .. } => ("passive", None),
                    Verdict::NonPassive { .. } => ("non_passive", None),
                    Verdict::HighlyUnstable { at_s } => ("highly_unstable", Some(*at_s)),
                };
                (name, verdict.rms_m(), at_s, edges.to_string(), why)
            }
        };
        let _ = writeln!(
            text,
            "{},{},{},{stiffness_n_per_m},{seed},{trial},{outcome},{},{},{edges},{}",
            study.rungs[rung].name,
            axis.name(),
            platform.name(),
            rms_m.map_or(String::new(), |rms_m| format!("{rms_m:e}")),
            at_s.map_or(String::new(), |at_s| at_s.to_string()),
            quoted(reason)
        );
    }
    text
}

/// Returns the table as the paper prints it, with a mark at each legible cell, and the limits and claims that follow.
pub fn table_text(tables: &Tables) -> String {
    let mut text = grid(tables);
    let agreement = Agreement::of(tables);
    let Agreement { legible, same, mixed } = agreement;
    text += "\nx passive in all trials   # non-passive   - highly unstable, aborted   ? could not be run\n";
    text += "= printed and the same   ! printed otherwise   (neither: this cell is lost in the text of the paper)\n";
    text += &seeds(tables);
    let at_some = if mixed > 0 { format!(", {mixed} at some seeds") } else { String::new() };
    let _ = writeln!(
        text,
        "{same} of {legible} legible cells are as printed{at_some}, {} are not\n",
        agreement.otherwise()
    );
    text += &limits(tables);
    for reason in tables.failures() {
        let _ = writeln!(text, "could not be run: {reason}");
    }
    text + &summing_up(&tables.claims().iter().map(Repeated::sum).collect::<Vec<_>>())
}

/// Returns as text which cells were run at which seeds, and each cell whose seeds differ.
fn seeds(tables: &Tables) -> String {
    let table = tables.first();
    let seeds = tables.each().len();
    if seeds == 1 {
        return format!(
            "Every cell is one draw, of seed {}: near the edge of stability another seed may differ\n",
            table.seed
        );
    }
    let repeated = tables.repeated();
    let mut text = format!(
        "a number: seeds of {seeds} in which the cell is passive, where seeds differ   \
         ~ printed, and the same in some\n\
         Seeds: {} of {} cells are near a boundary and run at {seeds} seeds, from {}; \
         the others at seed {} alone, and\n\
         they count at every seed with what they are there\n",
        repeated.so, repeated.of, table.seed, table.seed
    );
    for &axis in &table.axes {
        for &platform in &table.platforms {
            for &row in &table.stiffnesses_n_per_m {
                if let Some(tally) = tables.cell(axis, platform, row).filter(|tally| tally.class().is_none()) {
                    let _ = writeln!(text, "  {} {:<9}{row:>6} N/m  {}", axis.name(), platform.name(), told(&tally));
                }
            }
        }
    }
    text
}

/// Returns as text in how many seeds a mixed cell has each class.
fn told(tally: &Tally) -> String {
    let classes = [Class::NonPassive, Class::HighlyUnstable, Class::Failed];
    let others = classes.map(|class| (class, tally.share(class).so)).into_iter().filter(|(_, so)| *so > 0);
    let others: Vec<_> = others.map(|(class, so)| format!("{} in {so}", class.name())).collect();
    format!("passive in {} seeds, {}", tally.share(Class::Passive), others.join(", "))
}

const WIDTH: usize = 5;

fn grid(tables: &Tables) -> String {
    let table = tables.first();
    let groups = |name: &dyn Fn(Direction) -> String| -> String {
        table.axes.iter().map(|&axis| format!("  |{}", name(axis))).collect()
    };
    let all = table.platforms.len() * WIDTH;
    let part = |part: usize| -> String {
        let names = table.platforms.iter().map(|platform| platform.name().split('-').nth(part).unwrap_or(""));
        names.map(|name| format!("{name:>WIDTH$}")).collect()
    };
    let mut text =
        format!("{:>9}{}\n", "Stiffness", groups(&|axis| format!("  {:<w$}", axis.name().to_uppercase(), w = all - 2)));
    let _ = writeln!(text, "{:>9}{}", "(N/m)", groups(&|_| part(0)));
    let _ = writeln!(text, "{:>9}{}", "", groups(&|_| part(1)));
    for &row in &table.stiffnesses_n_per_m {
        let line = groups(&|axis| {
            let marks = table.platforms.iter().map(|&platform| {
                let Some(tally) = tables.cell(axis, platform, row) else { return " ".repeat(WIDTH) };
                let mark = match tally.class() {
                    Some(Class::Passive) => "x".to_string(),
                    Some(Class::NonPassive) => "#".to_string(),
                    Some(Class::HighlyUnstable) => "-".to_string(),
                    Some(Class::Failed) => "?".to_string(),
                    None => tally.share(Class::Passive).so.to_string(),
                };
                let printed = Agreement::at(tables, axis, platform, row).map_or(" ", |same| match same.so {
                    0 => "!",
                    _ if same.all() => "=",
                    _ => "~",
                });
                format!("{mark:>w$}{printed}", w = WIDTH - 1)
            });
            marks.collect()
        });
        let _ = writeln!(text, "{row:>9}{}", line.trim_end());
    }
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// Returns as text how stiff the walls may be, and the ratio to PMOS-1.
fn limits(tables: &Tables) -> String {
    let mut text = String::from("Stiffest wall in N/m up to which every row is passive");
    text += if tables.each().len() > 1 {
        " at every seed .. stiffest that is passive at some seed"
    } else {
        " .. stiffest that is passive"
    };
    text += " (times that of PMOS-1 at the same seed; >= the rows end there)\n";
    let table = tables.first();
    for &platform in &table.platforms {
        let mut line = format!("{:<9}", platform.name());
        for &axis in &table.axes {
            let Some(limit) = tables.limit(axis, platform) else { continue };
            let ratio = ratio(tables, axis, platform).map_or(String::new(), |ratio| format!("({ratio})"));
            line += &format!("   {} {:>14} {:<12}", axis.name(), limit.to_string(), ratio);
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

/// Returns the ratio of a limit to that of PMOS-1 at the same seed: the least and the greatest over all seeds.
fn ratio(tables: &Tables, axis: Direction, platform: Platform) -> Option<String> {
    let row = |table: &Table, platform| table.limit(axis, platform)?.passive_n_per_m;
    let ratios = tables.each().iter().map(|table| Some(row(table, platform)? / row(table, Platform::Pmos1)?));
    let ratios = ratios.collect::<Option<Vec<f64>>>()?;
    let least = ratios.iter().copied().min_by(f64::total_cmp)?;
    let most = ratios.iter().copied().max_by(f64::total_cmp)?;
    Some(if least == most { format!("{least:.1}") } else { format!("{least:.1}..{most:.1}") })
}
