//! The page of the limits of a scene's wall.

use hpu_cosim::figure;
use hpu_page::{Cell, Column, Page, Table, Value};
use hpu_prove::Wait;
use hpu_prove::criteria::{Assumption, Criterion, Figure, Region, Silent};
use hpu_prove::linear::{BoxSet, StableSet, Stretch};
use hpu_prove::steady::{Outcome, Steady, SteadySet, Told};
use hpu_study::limits::{Group, Limits, MOST_EVENTS, Seen, Unknown, WordsSet};
use serde_json::json;

use crate::parameters::{missed, missed_object};
use crate::units::error_percent;

/// The width of the labels.
const LABEL: usize = 25;

/// Returns the page of limits.
pub fn page(scene: &str, found: &Limits, over: &[Unknown]) -> Page {
    let unit = found.linear.as_ref().map_or("", |set| set.unit);
    let [low, high] = found.range.map(figure);
    let what = found.varied.as_deref().unwrap_or("stiffnesses");
    let said = format!("{scene}: at which {what} the wall settles, from {low} to {high} {unit}");
    let mut page = Page::labelled(LABEL);
    page.note(said.trim_end()).note("");
    page.data("scene", scene).data("range", found.range).data("varied", found.varied.as_ref());
    page.data("linear", found.linear.as_ref().ok())
        .data("linear_reason", found.linear.as_ref().err().map(ToString::to_string));
    match &found.linear {
        Ok(set) => {
            page.line("linear loop, ideal drive", set.said());
            crossings(&mut page, set);
        }
        Err(why) => {
            page.line("linear loop, ideal drive", why.to_string());
        }
    }
    driven(&mut page, found);
    left_out(&mut page, found);
    page.data("coulomb_friction_left_out", found.coulomb);
    page.data("over", [(); 0]);
    for (index, unknown) in over.iter().enumerate() {
        let (label, range) = (if index == 0 { "over the box" } else { "" }, unknown.to_string());
        let mut part = Page::default();
        part.data("key", unknown.key()).data("range", &range);
        page.section("over", part).line(label, range);
    }
    let in_box = found.in_box.as_ref();
    page.data("linear_in_box", in_box.and_then(|set| set.as_ref().ok()));
    page.data("linear_in_box_reason", in_box.and_then(|set| set.as_ref().err()).map(ToString::to_string));
    if let Some(set) = in_box {
        if let Ok(set) = set {
            page.data("linear_in_box.unknown", set.unknown()).data("linear_in_box.share_proved", set.share());
        }
        page.line("ideal drive, whole box", set.as_ref().map_or_else(ToString::to_string, BoxSet::said));
    }
    if let Some(set) = &found.steady {
        steady(&mut page, set);
    }
    page.data("words_reason", found.in_words.as_ref().err().map(ToString::to_string));
    match &found.in_words {
        Ok(set) => {
            words_data(&mut page, set);
            words(&mut page, set);
        }
        Err(why) => {
            page.data("words", ()).line("in words", why.to_string());
        }
    }
    warnings(&mut page, found);
    criteria_beside(&mut page, found);
    page
}

/// Adds what the words of the wall miss, and that a wall is ramped.
fn warnings(page: &mut Page, found: &Limits) {
    page.data("damping_error", found.damping_error).data("wall_is_ramped", found.is_ramped);
    if let Some(error) = found.damping_error {
        let said = "the runs in words have that, linear loops and criteria what is asked for; a finer \
                    method.damping_format mends it";
        page.line("warning", format!("wall.damping misses what is asked for by {}: {said}", error_percent(error)));
    }
    if found.is_ramped {
        let said = "wall.ramp changes the wall during the runs: a stiffness is that before the ramp";
        page.line("warning", said);
    }
    page.data("stiffness_missed", found.stiffness_miss.as_ref().map(missed_object));
    if let Some(miss) = &found.stiffness_miss {
        page.line("warning", format!("wall.{}", missed(miss, Some("method.stiffness_format"))));
    }
}

/// Adds the criteria with their assumptions, and those that have no limit.
fn criteria_beside(page: &mut Page, found: &Limits) {
    page.data("silent", &found.silent);
    let assumptions = legend(&found.criteria);
    let mut table = criteria(found, &assumptions);
    page.data("criteria", table.json());
    for Silent { name, why } in &found.silent {
        let mut row = vec![Cell::absent(); table.columns().len()];
        (row[0], row[1], row[4]) = (Cell::new(*name), Cell::new("-"), Cell::new(why.as_str()));
        table.add(row);
    }
    if found.varied.is_none() {
        page.note("").table(table).note("");
        for (Assumption { text: words, met, here }, letter) in assumptions.iter().zip('a'..) {
            let (mark, here) = if *met { (' ', String::new()) } else { ('!', format!("; here: {here}")) };
            page.note(format!("{mark}{letter}  {words}{here}"));
        }
    }
}

/// Adds a line for each end of a set at which a pole crosses.
fn crossings(page: &mut Page, set: &StableSet) {
    for end in set.stable.iter().flat_map(|Stretch { from, to }| [from, to]).filter(|end| end.beyond.is_some()) {
        let (middle, half) = (nine(end.middle()), end.uncertainty());
        page.line("", format!("a pole on the unit circle at {middle} {}, within {half:.0e}", set.unit));
    }
}

/// Adds the lines about the linear loop as it is driven, and about the ripple.
fn driven(page: &mut Page, found: &Limits) {
    let of_design = found.varied.is_some();
    let waits = |waits: &[Wait]| {
        let all: Vec<String> = waits.iter().map(|wait| format!("{} {}", wait.what, micro(wait.seconds))).collect();
        all.join(", ")
    };
    page.data("as_driven", found.driven.as_ref().ok());
    if let Ok(set) = &found.driven {
        page.data("as_driven.range", set.set.range);
    }
    let reason = found.driven.as_ref().err();
    page.data("as_driven_reason", reason.map(|reason| &reason.why));
    page.data("left_out", reason.map_or(&[][..], |reason| &reason.left_out));
    page.data("ripple", found.ripple.as_ref());
    if found.ripple.is_some() {
        page.data("ripple.unit", "count rms");
    }
    match &found.driven {
        Ok(set) => {
            page.line("linear loop, as driven", set.said());
            crossings(page, &set.set);
            if let Some(other) = &set.with_modulator {
                let own = "so the scene runs: its averaged bridge takes a command at once";
                page.line("", format!("{own}, a modulator one clock later: {}", other.said()));
                crossings(page, other);
            }
            if let Some([from, to]) = set.duty {
                let duty = match from == to {
                    true => figure(from),
                    false => format!("{} at the softest to {} at the stiffest", figure(from), figure(to)),
                };
                page.line("", format!("with the duty at rest, {duty}"));
            }
            if let Some(from) = set.full_from {
                page.line("", format!("from {} {} on the command at rest is a full one", figure(from), set.set.unit));
            }
            if let Some(looked) = set.looked {
                let of = if set.is_averaged { "the pulses that the averaged bridge stands for" } else { "the pulses" };
                let said = format!("proved of {of}; a stretch between two of {looked} stiffnesses may be missed");
                page.line("", said);
            }
            if !set.waits.is_empty() {
                page.line("", format!("waits: {}", waits(&set.waits)));
            }
        }
        Err(_) if of_design => {}
        Err(reason) => {
            page.line("linear loop, as driven", format!("not worked out: {}", reason.why));
            if !reason.left_out.is_empty() {
                page.line("", format!("the ideal drive leaves out: {}", waits(&reason.left_out)));
            }
        }
    }
    if let Some(ripple) = &found.ripple {
        let unit = found.linear.as_ref().map_or("", |set| set.unit);
        let end = found.driven.as_ref().map_or(found.range[1], |set| set.set.range[1]);
        let stretch = |[from, to]: &[f64; 2]| {
            let to = if *to >= end { "on".to_string() } else { format!("to {}", figure(*to)) };
            format!("from {} {unit} {to}", figure(*from))
        };
        let said = match &ripple.beyond[..] {
            [] => format!("at most {} count rms", figure(ripple.most_counts)),
            stretches => {
                let all: Vec<String> = stretches.iter().map(stretch).collect();
                let so = if found.coulomb > 0.0 { "" } else { ": no wall settles there" };
                format!("alone one count rms or more {}{so}", all.join(" and "))
            }
        };
        page.line("PWM's ripple", said);
    }
    if found.coulomb > 0.0 && (found.linear.is_ok() || found.driven.is_ok() || found.ripple.is_some()) {
        page.line("", "all of this without the device's Coulomb friction, which may hold it at other stiffnesses too");
    }
}

/// Adds the lines about what is proved at every phase.
fn steady(page: &mut Page, set: &Result<SteadySet, hpu_study::Error>) {
    const LABEL: &str = "proved at every phase";
    let set = match set {
        Err(why) => {
            page.data("for_ever", json!({ "reason": why.to_string() }));
            page.line(LABEL, format!("not worked out: {why}"));
            return;
        }
        Ok(set) => set,
    };
    steady_data(page, set);
    match set.proved.last() {
        None if set.over.is_empty() => page.line(LABEL, "no word of the stiffness"),
        None => page.line(LABEL, "no word of the stiffness everywhere in the box"),
        Some(last) => {
            let (from, to, unit) = (figure(set.from), figure(last.stiffness), set.unit);
            let over = if set.over.is_empty() { "" } else { " everywhere in the box" };
            page.line(LABEL, format!("every word from {from} to {to} {unit} settles{over}, for ever"));
            let [rms, range] = [last.bound.rms_counts, last.bound.half_range_counts].map(figure);
            page.line("", format!("the stiffest with at most {rms} counts rms, within {range} counts of its rest"))
        }
    };
    if let Some((stiffness, why)) = &set.beyond {
        let everywhere = if set.over.is_empty() { "" } else { " everywhere" };
        page.line("", format!("not proved{everywhere} at {} {}: {why}", figure(*stiffness), set.unit));
    }
    if let Some((first, last)) = set.bounded.first().zip(set.bounded.last()) {
        let [from, to, range] = [first.stiffness, last.stiffness, last.bound.half_range_counts].map(figure);
        let said = format!("every word from {from} to {to} {}, within {range} counts of its rest", set.unit);
        page.line("bounded for ever", said);
    }
    if !set.parts.is_empty() {
        steady_parts(page, set);
    }
    if set.ended {
        page.line("", "the search ended there: a proof takes so many words at most");
    }
    let said = "from every start that stays in contact and below a full command, under a hand at rest";
    page.line("", said);
    if !set.over.is_empty() {
        page.line("", "each device and hand of the box keeps its numbers, and has the words of the scene as written");
    }
}

/// Adds the words, and the parts of the first one that is not proved, for the JSON.
fn steady_data(page: &mut Page, set: &SteadySet) {
    let word = |Steady { stiffness, bound, parts }: &Steady| {
        json!({
            "word": parts.first().map(|part| part.witness.word),
            "parts": parts.len(),
            "stiffness": stiffness,
            "rms_counts": bound.rms_counts,
            "half_range_counts": bound.half_range_counts,
            "depth_counts": bound.depth_counts,
            "duty": bound.duty,
        })
    };
    let part = |Told { ends, is }: &Told| {
        let (is, rms_counts, reason) = match is {
            Outcome::Proved => ("proved", None, None),
            Outcome::Refuted(rms_counts) => ("refuted", Some(*rms_counts), None),
            Outcome::NotTold(why) => ("not_told", None, Some(why)),
        };
        json!({ "ends": ends, "is": is, "rms_counts": rms_counts, "reason": reason })
    };
    page.data(
        "for_ever",
        json!({
            "unit": set.unit,
            "from": set.from,
            "to": set.proved.last().map(|last| last.stiffness),
            "words": set.proved.iter().map(word).collect::<Vec<_>>(),
            "bounded": set.bounded.iter().map(word).collect::<Vec<_>>(),
            "not_proved": set.beyond.as_ref().map(|(stiffness, _)| stiffness),
            "reason": set.beyond.as_ref().map(|(_, why)| why),
            "ended": set.ended,
            "over": set.over.iter().map(|over| json!({ "key": over.key, "ends": over.ends })).collect::<Vec<_>>(),
            "parts": set.parts.iter().map(part).collect::<Vec<_>>(),
        }),
    );
}

/// Adds how many parts of the box are proved at the first word that is not, and a run that refutes one.
fn steady_parts(page: &mut Page, set: &SteadySet) {
    let count = |is: fn(&Outcome) -> bool| set.parts.iter().filter(|part| is(&part.is)).count();
    let (proved, refuted) = (count(|is| *is == Outcome::Proved), count(|is| matches!(is, Outcome::Refuted(_))));
    let left = set.parts.len() - proved - refuted;
    let all = format!("of {} parts of the box", set.parts.len());
    page.line("", format!("there, {all}, {proved} are proved, {refuted} are refuted by a run, {left} are not told"));
    let refuted = set.parts.iter().find_map(|part| match part.is {
        Outcome::Refuted(rms_counts) => Some((&part.ends, rms_counts)),
        _ => None,
    });
    if let Some((ends, rms_counts)) = refuted {
        let middle = set.over.iter().zip(ends);
        let middle: Vec<String> =
            middle.map(|(over, [low, high])| format!("{} = {}", over.key, figure(0.5 * (low + high)))).collect();
        let said = format!("{} counts rms, for ever: with {} (SI)", figure(rms_counts), middle.join(", "));
        page.line("", format!("a run swings by {said}"));
    }
}

/// Adds the line about what linear loops around a network leave out.
fn left_out(page: &mut Page, found: &Limits) {
    page.data("network_left_out", &found.left_out);
    if !found.left_out.is_empty() && (found.linear.is_ok() || found.driven.is_ok()) {
        page.line("linear loops leave out", found.left_out.join("; "));
    }
}

/// Returns a time in microseconds.
fn micro(seconds: f64) -> String {
    format!("{} us", figure(1e6 * seconds))
}

/// Adds the lines about the loop in words.
fn words(page: &mut Page, set: &WordsSet) {
    for (index, (group, from, to)) in set.groups().into_iter().enumerate() {
        let which = match group {
            Group::All => "all phases settle",
            Group::Some => "some phases settle",
            Group::None => "no phase settles",
            Group::NotTold => "not told",
        };
        let [low, high] = [from, to].map(|seen| set.digits(seen.stiffness));
        let between = if low == high { format!("at {low}") } else { format!("{low} to {high}") };
        let label = if index == 0 { "in words" } else { "" };
        let untold = match (group, set.not_told_from(&from, &to)) {
            (_, false) => String::new(),
            (Group::NotTold, true) => format!(", {}", set.said_not_told(&from, &to)),
            (_, true) => format!(", not told {}", set.said_not_told(&from, &to)),
        };
        page.line(label, format!("{which:<19}{between} {}{untold}", set.unit));
    }
    page.line("", set.turn());
    let apart = match set.finest {
        1 => "each word where neighbours differ".to_string(),
        words => format!("{words} words apart where neighbours differ"),
    };
    if set.wrapped > 0 {
        let said = "of these runs settle although the product has wrapped: the hand may be through the wall";
        page.line("warning", format!("{} {said}", set.wrapped));
    }
    if set.unheld > 0 {
        let said = "runs had a position counter that wrapped under the device, and read another place: write a greater \
                    method.position_bits";
        page.line("warning", format!("{} {said}", set.unheld));
    }
    if set.without_torque > 0 {
        let said = "runs are inside the wall without its torque, and count as not settled";
        page.line("warning", format!("{} {said}", set.without_torque));
    }
    if set.cut_short > 0 {
        let said = format!("runs had more than {MOST_EVENTS} events and count as not settled");
        page.line("", format!("{} {said}", set.cut_short));
    }
    let (seen, words, phases) = (set.seen.len(), set.words, set.phases / set.worlds);
    let worlds = if set.worlds > 1 { format!(" in each of {} worlds", set.worlds) } else { String::new() };
    let seen_at = format!("seen at {seen} of {words} words, {apart}, at {phases} phases of the contact{worlds}");
    page.line("", seen_at);
    if set.untouched > 0 {
        page.line("", format!("{} worlds are not judged: their hand is not at the wall", set.untouched));
    }
    let between = words - seen as i128;
    if between > 0 {
        page.line("", format!("the {between} words between neighbours alike were not run: --words {words} runs all"));
    }
}

/// Returns the criteria. In text a letter stands for each assumption, with `!` where the scene does not meet it.
fn criteria(found: &Limits, all: &[Assumption]) -> Table {
    let letter = |assumption: &Assumption| {
        let letter = all.iter().zip('a'..).find(|(known, _)| *known == assumption).map_or(' ', |found| found.1);
        if assumption.met { format!("{letter}") } else { format!("!{letter}") }
    };
    let texts = |criterion: &Criterion, only_missed: bool, text: fn(&Assumption) -> &str| {
        let told = criterion.assumptions.iter().filter(|assumption| !(only_missed && assumption.met));
        Value::of(told.map(text).collect::<Vec<_>>())
    };
    let here = |criterion: &Criterion| {
        let figures = criterion
            .figures
            .iter()
            .map(|Figure { name, value, unit }| format!("{name} {} {unit}", figure(*value)).trim_end().to_string());
        let region = criterion.region.map(|region| region.name().to_string());
        let here = region.into_iter().chain(figures).collect::<Vec<_>>().join(", ");
        if here.is_empty() { here } else { format!("\n  here: {here}") }
    };
    let fields = [
        Column::text("name", "criterion").least(LABEL).of(|criterion: &Criterion| criterion.name),
        Column::number("limit", "limit")
            .least(14)
            .of(|criterion: &Criterion| Cell::new(criterion.limit).shown(nine(criterion.limit))),
        Column::text("unit", "unit").of(|criterion: &Criterion| criterion.unit),
        Column::flag("assumptions_met", "met").of(|criterion: &Criterion| {
            let met = format!("{} of {}", criterion.met(), criterion.assumptions.len());
            Cell::new(criterion.assumptions_met()).shown(met)
        }),
        Column::text("", "assumptions, ! those that the scene does not meet")
            .said()
            .of(move |criterion: &Criterion| criterion.assumptions.iter().map(letter).collect::<Vec<_>>().join(" ")),
        Column::text("assumptions", "").data().of(move |criterion: &Criterion| texts(criterion, false, |it| it.text)),
        Column::text("not_met", "").data().of(move |criterion: &Criterion| texts(criterion, true, |it| it.text)),
        Column::text("not_met_here", "").data().of(move |criterion: &Criterion| texts(criterion, true, |it| &it.here)),
        Column::text("figures", "").data().of(|criterion: &Criterion| Value::of(&criterion.figures)),
        Column::text("region", "").data().of(|criterion: &Criterion| criterion.region.map(Region::name)),
        Column::text("", "").said().of(here),
    ];
    Table::of("", &found.criteria, fields)
}

/// Adds the data of the loop in words, each stiffness that was run among them.
fn words_data(page: &mut Page, set: &WordsSet) {
    let groups = set.groups().into_iter().map(|(group, from, to)| {
        let [from, to] = [from, to].map(|seen| seen.stiffness);
        json!({ "settle": group.name(), "from": from, "to": to })
    });
    let stiffness = |seen: Option<Seen>| seen.map(|seen| seen.stiffness);
    page.data("words", set)
        .data("words.phases", set.phases / set.worlds)
        .data("words.runs", set.runs())
        .data("words.runs_not_told", set.not_told())
        .data("words.telling_duration_s", set.telling_s())
        .data("words.groups", groups.collect::<Vec<_>>())
        .data("words.lowest_failed", stiffness(set.lowest_failed()))
        .data("words.highest_settled", stiffness(set.highest_settled()))
        .data("words.all_up_to", stiffness(set.all_up_to()));
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
