//! The limits of a scene's wall as text and as JSON.

use std::path::PathBuf;

use hpu_cosim::figure;
use hpu_study::criteria::{Assumption, Criterion, Figure, Region, Silent};
use hpu_study::limits::{BoxSet, End, Group, Limits, MOST_EVENTS, Seen, StableSet, Stretch, Unknown, WordsSet};
use serde_json::{Value, json};

use crate::parameters::{missed, missed_object};

/// Returns limits as JSON.
pub fn object(scene: &str, found: &Limits, over: &[Unknown], files: &[PathBuf]) -> Value {
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
        "varied": found.varied,
        "linear": found.linear.as_ref().ok().map(linear),
        "linear_reason": found.linear.as_ref().err(),
        "over": over.iter().map(|unknown| json!({ "key": unknown.key(), "range": unknown.to_string() })).collect::<Vec<_>>(),
        "linear_in_box": found.in_box.as_ref().and_then(|set| set.as_ref().ok()).map(in_box),
        "linear_in_box_reason": found.in_box.as_ref().and_then(|set| set.as_ref().err()),
        "words": found.in_words.as_ref().ok().map(in_words),
        "words_reason": found.in_words.as_ref().err(),
        "stiffness_missed": found.stiffness_miss.as_ref().map(missed_object),
        "files": files,
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

fn in_box(set: &BoxSet) -> Value {
    json!({ "unit": set.unit, "stable": set.proved, "points": set.points, "stable_at_points": set.at_points })
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
        "phases": set.phases / set.worlds,
        "worlds": set.worlds,
        "worlds_without_contact": set.untouched,
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

/// Returns limits as text.
pub fn text(scene: &str, found: &Limits, over: &[Unknown], files: &[PathBuf]) -> String {
    let unit = found.linear.as_ref().map_or("", |set| set.unit);
    let [low, high] = found.range.map(figure);
    let what = found.varied.as_deref().unwrap_or("stiffnesses");
    let mut text =
        format!("{scene}: at which {what} the wall settles, from {low} to {high} {unit}").trim_end().to_string();
    text += "\n\n";
    let mut line = |name: &str, said: &str| text += &format!("{name:<22}{}\n", said.trim_end());
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
    for (index, unknown) in over.iter().enumerate() {
        line(if index == 0 { "over the box" } else { "" }, &unknown.to_string());
    }
    match &found.in_box {
        Some(Ok(set)) => line("linear loop in it", &set.said()),
        Some(Err(why)) => line("linear loop in it", why),
        None => {}
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
            let (seen, words, phases) = (set.seen.len(), set.words, set.phases / set.worlds);
            let seen_at = format!("seen at {seen} of {words} words, {apart}, at {phases} phases of the contact");
            let worlds = if set.worlds > 1 { format!(" in each of {} worlds", set.worlds) } else { String::new() };
            line("", &(seen_at + &worlds));
            if set.untouched > 0 {
                line("", &format!("{} worlds are not judged: their hand is not at the wall", set.untouched));
            }
            let between = words - seen as i128;
            if between > 0 {
                line(
                    "",
                    &format!("the {between} words between neighbours alike were not run: --words {words} runs all"),
                );
            }
        }
        Err(why) => line("in words", why),
    }
    if let Some(miss) = &found.stiffness_miss {
        line("warning", &format!("wall.{}", missed(miss, Some("method.stiffness_format"))));
    }
    let assumptions = legend(&found.criteria);
    if found.varied.is_some() {
        files.iter().for_each(|file| text += &format!("{:<22}{}\n", "file", file.display()));
        return text;
    }
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
    text.extend(files.iter().map(|file| format!("file       {}\n", file.display())));
    for (Assumption { text: words, met, here }, letter) in assumptions.iter().zip('a'..) {
        let (mark, here) = if *met { (' ', String::new()) } else { ('!', format!("; here: {here}")) };
        text += &format!("{mark}{letter}  {words}{here}\n");
    }
    text
}

/// Returns a limit with nine decimals. If they would not show it, returns its first digits with a power of ten.
fn nine(limit: f64) -> String {
    if limit == 0.0 || (1e-4..1e9).contains(&limit) { format!("{limit:.9}") } else { format!("{limit:.6e}") }
}

/// Returns every assumption once.
fn legend(criteria: &[Criterion]) -> Vec<Assumption> {
    let mut all: Vec<Assumption> = Vec::new();
    for assumption in criteria.iter().flat_map(|criterion| &criterion.assumptions) {
        if !all.contains(assumption) {
            all.push(assumption.clone());
        }
    }
    all
}
