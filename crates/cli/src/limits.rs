//! `hpu limits`: how stiff a scene's wall may be.

use hpu_cosim::figure;
use hpu_cosim::scene::{Experiment, Scene};
use hpu_study::criteria::{Assumption, Criterion, Figure, Region, Silent};
use hpu_study::limits::{
    End, Group, Limits, Looks, MOST_EVENTS, Seen, StableSet, Stretch, WordsSet, limits, usual_range,
};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::jobs::Jobs;
use crate::parameters::{missed, missed_object};
use crate::scene::{self, Loaded};
use crate::terminal::{print, print_json};

/// Tell at which stiffnesses a scene's wall settles: by its linear loop, in words, and by published criteria
///
/// The set of the linear loop is proved: no stiffness at which a pole crosses the unit circle is missed. The scene in
/// words is run at a grid of stiffnesses, at several phases of its contact each, and at every word between neighbours
/// that differ. The damping is the scene's. Each criterion tells which of its assumptions the scene does not meet, and
/// what the scene has instead.
#[derive(clap::Args)]
pub struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: String,
    #[command(flatten)]
    set: scene::Set,
    /// Stiffnesses to look at, as in '0.1..3 N.m/rad' [default: from one word to the greatest of the format]
    #[arg(long, value_name = "A..B")]
    range: Option<String>,
    /// Phases of the contact at each stiffness
    #[arg(long, value_name = "N", default_value_t = Looks::default().phases, value_parser = clap::value_parser!(u32).range(1..=64))]
    phases: u32,
    #[command(flatten)]
    jobs: Jobs,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// `hpu limits`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let scene = axis(args, &[])?;
    let range = match &args.range {
        Some(range) => asked(args, range)?,
        None => usual_range(&scene),
    };
    let looks = Looks { phases: args.phases, ..Looks::default() };
    // Until the runs begin a signal ends the command at once.
    let found = limits(&scene, range, || WordsSet::new(&scene, range, looks, args.jobs.get(), interrupt::heed()));
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }
    if args.json {
        print_json(&object(&scene.name, &found))?
    } else {
        print(&text(&scene.name, &found))?
    }
    // That there is no limit is a result.
    Ok(Exit::Fine)
}

/// The scene under the command's overrides and some more.
fn axis(args: &Args, more: &[(String, String)]) -> Result<Scene, Failure> {
    let set: Vec<_> = args.set.set.iter().chain(more).cloned().collect();
    match Loaded::new(&args.scene, &set, None)?.scene {
        Experiment::Axis(scene) => Ok(scene),
        Experiment::Phantom(_) => {
            let said = "limits are those of an axis; a PHANToM's are found by trials: hpu reproduce phantom-table-2";
            Err(Failure::usage(said))
        }
    }
}

/// The ends of a range, as the scene reads a stiffness.
fn asked(args: &Args, range: &str) -> Result<[f64; 2], Failure> {
    const SYNTAX: &str = "write A..B with A below B, as in '0.1..3 N.m/rad'";
    let usage = |said: String| Failure::usage(format!("--range {range}: {said}"));
    let (from, to) = range.split_once("..").ok_or_else(|| usage(SYNTAX.into()))?;
    let to = to.trim();
    // The unit stands behind the second number, or behind both.
    let number = to.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c))).unwrap_or(to.len());
    let unit = to[number..].trim();
    let from = from.trim();
    let from =
        if from.parse::<f64>().is_ok() && !unit.is_empty() { format!("{from} {unit}") } else { from.to_string() };
    let end =
        |text: &str| Ok::<_, Failure>(axis(args, &[("wall.stiffness".into(), text.into())])?.wall.stiffness_nm_per_rad);
    let [low, high] = [end(&from)?, end(to)?];
    if low <= 0.0 {
        return Err(usage("a stiffness of 0 has no wall; begin above it".into()));
    }
    if low >= high {
        return Err(usage(format!("from {} to {} holds nothing; {SYNTAX}", figure(low), figure(high))));
    }
    Ok([low, high])
}

fn object(scene: &str, found: &Limits) -> Value {
    let criteria = found.criteria.iter().map(|criterion| {
        let Criterion { name, limit, unit, .. } = criterion;
        let not_met = || criterion.assumptions.iter().filter(|assumption| !assumption.met);
        let figures = criterion
            .figures
            .iter()
            .map(|Figure { name, value, unit }| json!({ "name": name, "value": value, "unit": unit }));
        json!({
            "name": name,
            "limit": limit,
            "unit": unit,
            "assumptions_met": criterion.assumptions_met(),
            "assumptions": criterion.assumptions.iter().map(|assumption| assumption.text).collect::<Vec<_>>(),
            "not_met": not_met().map(|assumption| assumption.text).collect::<Vec<_>>(),
            "not_met_here": not_met().map(|assumption| &assumption.here).collect::<Vec<_>>(),
            "figures": figures.collect::<Vec<_>>(),
            "region": criterion.region.map(Region::name),
        })
    });
    let silent = found.silent.iter().map(|Silent { name, why }| json!({ "name": name, "reason": why }));
    json!({
        "scene": scene,
        "criteria": criteria.collect::<Vec<_>>(),
        "silent": silent.collect::<Vec<_>>(),
        "range": found.range,
        "linear": found.linear.as_ref().ok().map(linear),
        "linear_reason": found.linear.as_ref().err(),
        "words": found.in_words.as_ref().ok().map(in_words),
        "words_reason": found.in_words.as_ref().err(),
        "stiffness_missed": found.stiffness_miss.as_ref().map(missed_object),
    })
}

fn linear(set: &StableSet) -> Value {
    let end = |End { at, beyond }: End| json!({ "at": at, "beyond": beyond });
    let stretch = |Stretch { from, to }: &Stretch| json!({ "from": end(*from), "to": end(*to) });
    json!({
        "unit": set.unit,
        "stable": set.stable.iter().map(stretch).collect::<Vec<_>>(),
        "open": set.open,
    })
}

fn in_words(set: &WordsSet) -> Value {
    let seen = |seen: &Seen| json!({ "word": seen.word as i64, "stiffness": seen.stiffness, "settled": seen.settled });
    let groups = set
        .groups()
        .into_iter()
        .map(|(group, from, to)| json!({ "settle": group.name(), "from": from.stiffness, "to": to.stiffness }));
    json!({
        "unit": set.unit,
        "word": set.step,
        "words": set.words as i64,
        "phases": set.phases,
        "runs": set.runs(),
        "runs_cut_short": set.cut_short,
        "runs_settled_but_wrapped": set.wrapped,
        "groups": groups.collect::<Vec<_>>(),
        "lowest_failed": set.lowest_failed().map(|seen| seen.stiffness),
        "highest_settled": set.highest_settled().map(|seen| seen.stiffness),
        "all_up_to": set.all_up_to().map(|seen| seen.stiffness),
        "words_between_neighbours_that_differ": set.finest as i64,
        "seen": set.seen.iter().map(seen).collect::<Vec<_>>(),
    })
}

fn text(scene: &str, found: &Limits) -> String {
    let unit = found.linear.as_ref().map_or("", |set| set.unit);
    let [low, high] = found.range.map(figure);
    let mut text = format!("{scene}: at which stiffnesses the wall settles, from {low} to {high} {unit}\n\n");
    let mut line = |name: &str, said: &str| text += &format!("{name:<22}{said}\n");
    match &found.linear {
        Ok(set) => {
            line("linear loop", &set.said());
            for Stretch { from, to } in &set.stable {
                for end in [from, to].into_iter().filter(|end| end.beyond.is_some()) {
                    let (middle, half) = (nine(end.middle()), end.uncertainty());
                    line("", &format!("a pole on the unit circle at {middle} {}, within {half:.0e}", set.unit));
                }
            }
        }
        Err(why) => line("linear loop", why),
    }
    match &found.in_words {
        Ok(set) => {
            for (index, (group, from, to)) in set.groups().into_iter().enumerate() {
                let name = if index == 0 { "in words" } else { "" };
                let which = match group {
                    Group::All => "all phases settle",
                    Group::Some => "some phases settle",
                    Group::None => "no phase settles",
                };
                let [low, high] = [from, to].map(|seen| set.digits(seen.stiffness));
                let between = if low == high { format!("at {low}") } else { format!("{low} to {high}") };
                line(name, &format!("{which:<19}{between} {}", set.unit));
            }
            line("", &set.turn());
            let apart = match set.finest {
                1 => "each word where neighbours differ".to_string(),
                words => format!("{words} words apart where neighbours differ"),
            };
            if set.wrapped > 0 {
                let said = "of these runs settle although the product has wrapped: the hand may be through the wall";
                line("warning", &format!("{} {said}", set.wrapped));
            }
            if set.cut_short > 0 {
                let said = format!("runs had more than {MOST_EVENTS} events and count as not settled");
                line("", &format!("{} {said}", set.cut_short));
            }
            let (seen, words, phases) = (set.seen.len(), set.words, set.phases);
            line("", &format!("seen at {seen} of {words} words, {apart}, at {phases} phases of the contact"));
        }
        Err(why) => line("in words", why),
    }
    if let Some(miss) = &found.stiffness_miss {
        line("warning", &format!("wall.{}", missed(miss, Some("method.stiffness_format"))));
    }
    let assumptions = legend(&found.criteria);
    text += &format!(
        "\n{:<22}{:>14} {:<8} {:<6} assumptions, ! those that the scene does not meet\n",
        "criterion", "limit", "unit", "met"
    );
    for criterion in &found.criteria {
        let Criterion { name, limit, unit, .. } = criterion;
        let met = format!("{} of {}", criterion.met(), criterion.assumptions.len());
        let own = criterion.assumptions.iter().map(|assumption| {
            let letter =
                assumptions.iter().zip('a'..).find(|(known, _)| known == &assumption).map_or(' ', |found| found.1);
            if assumption.met { format!("{letter}") } else { format!("!{letter}") }
        });
        text += &format!("{name:<22}{:>14} {unit:<8} {met:<6} {}\n", nine(*limit), own.collect::<Vec<_>>().join(" "));
        let figures =
            criterion.figures.iter().map(|Figure { name, value, unit }| format!("{name} {} {unit}", figure(*value)));
        let region = criterion.region.map(|region| region.name().to_string());
        let here: Vec<_> = region.into_iter().chain(figures.map(|figure| figure.trim_end().to_string())).collect();
        if !here.is_empty() {
            text += &format!("{:<22}here: {}\n", "", here.join(", "));
        }
    }
    for Silent { name, why } in &found.silent {
        text += &format!("{name:<22}{:>14} {why}\n", "-");
    }
    text += "\n";
    for (Assumption { text: words, met, here }, letter) in assumptions.iter().zip('a'..) {
        let (mark, here) = if *met { (' ', String::new()) } else { ('!', format!("; here: {here}")) };
        text += &format!("{mark}{letter}  {words}{here}\n");
    }
    text
}

/// Nine decimals of a limit; of one that they would not show, its first digits.
fn nine(limit: f64) -> String {
    if limit == 0.0 || (1e-4..1e9).contains(&limit) { format!("{limit:.9}") } else { format!("{limit:.6e}") }
}

/// Every assumption once.
fn legend(criteria: &[Criterion]) -> Vec<Assumption> {
    let mut all: Vec<Assumption> = Vec::new();
    for assumption in criteria.iter().flat_map(|criterion| &criterion.assumptions) {
        if !all.contains(assumption) {
            all.push(assumption.clone());
        }
    }
    all
}
