//! The table and its trials as text.

use std::fmt::Write;

use hpu_cosim::scene::Direction;

use super::claims::{Claim, claims, newtons};
use super::published::Agreement;
use super::summing::summing_up;
use super::table::{Class, Limit, Table};
use super::trial::{Trial, Verdict};
use super::{Point, Study};

/// First line of a study's CSV; the unit is in the name.
pub const CSV_HEADER: &str = "rung,axis,platform,stiffness_n_per_m,trial,outcome,rms_m,aborted_at_s,edges,reason\n";

/// Every trial of a study, one a row.
#[must_use]
pub fn csv(study: &Study, outcomes: &[(Point, Result<Trial, String>)]) -> String {
    let mut text = CSV_HEADER.to_string();
    for (point, outcome) in outcomes {
        let Point { rung, axis, platform, stiffness_n_per_m, trial } = point;
        let (outcome, rms_m, at_s, edges, reason) = match outcome {
            Err(reason) => ("failed", None, None, String::new(), reason),
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
            "{},{},{},{stiffness_n_per_m},{trial},{outcome},{},{},{edges},{}",
            study.rungs[*rung].name,
            axis.name(),
            platform.name(),
            rms_m.map_or(String::new(), |rms_m| format!("{rms_m:e}")),
            at_s.map_or(String::new(), |at_s| at_s.to_string()),
            quoted(reason)
        );
    }
    text
}

/// A field of a CSV.
pub(super) fn quoted(field: &str) -> String {
    if field.contains([',', '"']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.to_string() }
}

/// The table as the paper prints it, what of it is legible there beside, and what follows from it.
#[must_use]
pub fn table_text(table: &Table) -> String {
    let mut text = grid(table);
    let Agreement { legible, same } = Agreement::of(table);
    text += "\nx passive in all trials   # non-passive   - highly unstable, aborted   ? could not be run\n";
    text += "= printed and the same   ! printed otherwise   (neither: this cell is lost in the text of the paper)\n";
    let _ = writeln!(text, "{same} of {legible} legible cells are as printed, {} are not\n", legible - same);
    text += &limits(table);
    for reason in table.failures() {
        let _ = writeln!(text, "could not be run: {reason}");
    }
    text + &summing_up(&claims(table).iter().map(Claim::sum).collect::<Vec<_>>())
}

const WIDTH: usize = 5;

fn grid(table: &Table) -> String {
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
                let mark = match table.cell(axis, platform, row).map(|cell| cell.class) {
                    Some(Class::Passive) => "x",
                    Some(Class::NonPassive) => "#",
                    Some(Class::HighlyUnstable) => "-",
                    Some(Class::Failed) => "?",
                    None => " ",
                };
                let printed =
                    Agreement::at(table, axis, platform, row).map_or(" ", |same| if same { "=" } else { "!" });
                format!("{mark:>w$}{printed}", w = WIDTH - 1)
            });
            marks.collect()
        });
        let _ = writeln!(text, "{row:>9}{}", line.trim_end());
    }
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// How stiff the walls may be, and that over PMOS-1.
fn limits(table: &Table) -> String {
    let mut text = String::from(
        "Stiffest wall in N/m up to which every row is passive (times that of PMOS-1; + some stiffer row is passive again; >= the rows end there)\n",
    );
    for &platform in &table.platforms {
        let mut line = format!("{:<9}", platform.name());
        for &axis in &table.axes {
            let Some(limit) = table.limit(axis, platform) else { continue };
            let Limit { passive_n_per_m, again, .. } = limit;
            let pmos = table.limit(axis, hpu_cosim::scene::Platform::Pmos1).and_then(|limit| limit.passive_n_per_m);
            let ratio = passive_n_per_m.zip(pmos).map_or(String::new(), |(this, pmos)| format!("({:.1})", this / pmos));
            let again = if again { "+" } else { "" };
            line += &format!("   {} {:>8} {:<8}", axis.name(), format!("{}{again}", newtons(&limit)), ratio);
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}
