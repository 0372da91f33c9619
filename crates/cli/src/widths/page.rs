//! The page of `hpu widths`. The keys of its JSON are a contract, and more may be added.

use hpu_page::{Cell, Column, Page, Place, Table, Value};
use hpu_prove::ranges::{Bound, How};
use hpu_signal::{Clock, Notation};
use hpu_study::fit::percent;
use hpu_study::map::outcome_name;
use hpu_study::widths::{Field, Loss, Needed, Recommended, SignalRow};
use serde_json::json;

use crate::notation::triple;
use crate::price::Price;
use crate::units::si;
use crate::widths::Widths;
use crate::widths::digits::digits;
use crate::widths::proved::{Proved, how};

/// Columns of the page.
const WIDTH: usize = 120;
/// The most signals that fit on the page.
const MOST: usize = 36;

/// Returns the page, whose first table is that of widths.csv: a row for every signal, values in the signal's unit.
pub fn page(of: &Widths) -> Page {
    let measured = &of.measured;
    let mut page = Page::default();
    let outcomes = measured.outcomes.iter().map(|kind| outcome_name(Some(*kind))).collect::<Vec<_>>();
    page.note(format!("{}\n$ {}", head(of, &outcomes), of.command));
    page.data("scenes", &of.scenes).data("command", &of.command).data("wiring", measured.wiring);
    page.data("edges", measured.edges).data("motion_s", measured.motion_s);
    page.data("random", of.random.map(|(seconds, seed)| json!({ "motion_s": seconds, "seed": seed })));
    page.data("outcomes", &outcomes).data("contact_shares", &measured.contact_shares);
    page.data("stiffness_missed", &of.missed);
    for said in &of.missed {
        page.note(format!("warning: {said}"));
    }
    let left_out: Vec<&str> = left_out(&measured.rows);
    page.note("").table(signals(of, &left_out));
    if !left_out.is_empty() {
        page.note(wrapped(&format!("not shown: {}", left_out.join(", "))));
    }
    page.note("");
    match &of.recommended {
        Ok(found) => widths(&mut page, of, found),
        Err(why) => {
            page.data("widths.not_tried", why);
            page.note(format!("needs: by the range measured, of this motion alone; {why}"));
        }
    }
    notes(&mut page, of);
    page.data("tables", of.tables.as_ref().map(|tables| tables.page.json()));
    if let Some(tables) = &of.tables {
        page.note(tables.page.text());
    }
    page.data("price", of.price.as_ref().map(Price::json));
    if let Some(price) = &of.price {
        page.note(price.head_text());
        if of.recommended.is_err() {
            page.note(price.knobs_text());
        }
    }
    page.data("proved", of.proved.as_ref().ok().map(Proved::json)).data("not_proved", of.proved.as_ref().err());
    page.data("files", &of.files);
    page
}

/// Returns the first line: scenes, wiring and motion.
fn head(of: &Widths, outcomes: &[&str]) -> String {
    let measured = &of.measured;
    let (clock, motion) = (si(of.clock_hz as f64, "Hz"), si(measured.motion_s, "s"));
    let how = match of.random {
        Some((_, seed)) => format!("{motion} of random motion (seed {seed}), open loop"),
        None => {
            let outcomes = outcomes.iter().zip(&measured.contact_shares).map(|(outcome, share)| {
                let touched = if *share == Some(0.0) { " (wall not reached)" } else { "" };
                outcome.replace('_', " ") + touched
            });
            let outcomes = outcomes.collect::<Vec<_>>().join(", ");
            let colon = if outcomes.is_empty() { "" } else { ": " };
            format!("{motion} in closed loop{colon}{outcomes}")
        }
    };
    format!("{}: {} at {clock}, {how}", of.scenes.join(", "), measured.wiring)
}

/// Returns the signals that do not fit on the page: constants when there are many signals.
fn left_out(rows: &[SignalRow]) -> Vec<&'static str> {
    let wide = || rows.iter().filter(|row| row.format.width() > 2);
    let constant = |row: &SignalRow| row.measured.is_none_or(|(min, max)| min == max);
    let is_left_out = |row: &&SignalRow| constant(row) || row.name.starts_with("scaled");
    if wide().count() <= MOST { Vec::new() } else { wide().filter(is_left_out).map(|row| row.name).collect() }
}

/// Returns the signals. Text leaves out single bits, and those of `left_out`.
fn signals(of: &Widths, left_out: &[&str]) -> Table {
    let bound = |row: &SignalRow| of.proved.as_ref().ok().and_then(|proved| proved.of(row.name));
    let ends = |row: &SignalRow| row.measured.map(|(min, max)| [min, max].map(|word| row.format.to_f64(word)));
    let proved = |row: &SignalRow| {
        let Some(Bound { min, max, how, never_overflows, .. }) = bound(row) else {
            return Cell::new(None::<f64>).shown("");
        };
        let exhausted = if *how == How::Exhausted { " x" } else { "" };
        let overflows = if *never_overflows { "" } else { "!" };
        let blank = if exhausted.is_empty() && !overflows.is_empty() { " " } else { "" };
        Cell::new([*min, *max]).shown(format!("{}{exhausted}{blank}{overflows}", span(*min, *max)))
    };
    let lost = |loss: &Loss| Cell::new(loss.edges).shown(lost(of, loss));
    let worst = |loss: &Loss| (loss.edges > 0 && !loss.worst.is_nan()).then_some(loss.worst);
    let clock = Clock::new(of.clock_hz).ok();
    let first = move |loss: &Loss| loss.first.zip(clock).map(|(first, clock)| clock.seconds(first));
    let sqnr = |row: &SignalRow| {
        let said = match row.sqnr_db {
            None => String::new(),
            Some(db) if db.is_infinite() => "exact".into(),
            Some(db) => format!("{db:.1}"),
        };
        Cell::new(row.sqnr_db.filter(|db| !db.is_nan())).shown(said)
    };
    let fields = [
        Column::text("name", "signal").least(11).file("signal").of(|row: &SignalRow| row.name),
        Column::text("format", "format")
            .least(9)
            .only(&[Place::Text, Place::File])
            .of(|row: &SignalRow| row.format.to_string()),
        Column::text("format", "").in_json().of(|row: &SignalRow| triple(row.format)),
        Column::text("unit", "").data().of(|row: &SignalRow| row.unit),
        Column::text("measured", "measured").least(17).only(&[Place::Text, Place::Json]).of(move |row: &SignalRow| {
            let ends = ends(row);
            Cell::new(ends).shown(ends.map_or(String::new(), |[min, max]| span(min, max)))
        }),
        Column::number("measured_min", "").in_files().of(move |row: &SignalRow| ends(row).map(|ends| ends[0])),
        Column::number("measured_max", "").in_files().of(move |row: &SignalRow| ends(row).map(|ends| ends[1])),
        Column::text("words", "").in_json().of(|row: &SignalRow| row.measured.map(|(min, max)| [min, max])),
        Column::text("proved", "proved").least(18).only(&[Place::Text, Place::Json]).of(proved),
        Column::number("proved_min", "").in_files().of(move |row: &SignalRow| bound(row).map(|bound| bound.min)),
        Column::number("proved_max", "").in_files().of(move |row: &SignalRow| bound(row).map(|bound| bound.max)),
        Column::text("how", "").data().of(move |row: &SignalRow| bound(row).map(|bound| how(bound.how))),
        Column::flag("never_overflows", "")
            .data()
            .of(move |row: &SignalRow| bound(row).map(|bound| bound.never_overflows)),
        Column::number("error", "").in_json().of(move |row: &SignalRow| bound(row).and_then(|bound| bound.error)),
        Column::text("assumptions", "")
            .in_json()
            .of(move |row: &SignalRow| bound(row).map(|bound| Value::of(&bound.assumptions))),
        Column::integer("idle_bits", "idle").said().of(|row: &SignalRow| row.headroom_bits),
        Column::integer("idle_bits", "").data().of(|row: &SignalRow| row.headroom_bits),
        Column::text("rounded", "rounded")
            .least(18)
            .file("rounded_edges")
            .of(move |row: &SignalRow| lost(&row.rounded)),
        Column::number("rounded_worst", "").data().of(move |row: &SignalRow| worst(&row.rounded)),
        Column::number("rounded_first_s", "").data().of(move |row: &SignalRow| first(&row.rounded)),
        Column::text("overflowed", "overflowed")
            .least(18)
            .file("overflowed_edges")
            .of(move |row: &SignalRow| lost(&row.overflowed)),
        Column::number("overflowed_worst", "").data().of(move |row: &SignalRow| worst(&row.overflowed)),
        Column::number("overflowed_first_s", "").data().of(move |row: &SignalRow| first(&row.overflowed)),
        Column::number("sqnr_db", "SQNR").unit("dB").of(sqnr),
        Column::flag("exact", "").in_json().of(|row: &SignalRow| row.sqnr_db.map(f64::is_infinite)),
        Column::text("needs", "needs")
            .only(&[Place::Text, Place::File])
            .of(|row: &SignalRow| row.recommended.map_or(String::new(), |format| format.to_string())),
        Column::text("recommended", "").in_json().of(|row: &SignalRow| row.recommended.map(triple)),
    ];
    let rows = &of.measured.rows;
    let untold = |row: usize| rows[row].format.width() <= 2 || left_out.contains(&rows[row].name);
    Table::of("signals", rows, fields).gap(1).without(untold)
}

/// Returns the share of the edges with losses, the worst case, and the first time.
fn lost(of: &Widths, loss: &Loss) -> String {
    if loss.edges == 0 {
        return "-".into();
    }
    let share = 100.0 * loss.edges as f64 / of.measured.edges.max(1) as f64;
    let share = if share < 0.1 {
        "<.1%".to_string()
    } else if share < 1.0 {
        format!("{share:.1}%")
    } else {
        format!("{share:.0}%")
    };
    let worst = if loss.worst.is_nan() { "?".to_string() } else { digits(loss.worst) };
    let first = loss.first.map_or_else(
        || "?".to_string(),
        |first| first_time(Clock::new(of.clock_hz).map_or(0.0, |clock| clock.seconds(first))),
    );
    format!("{share} {worst} {first}")
}

/// Returns a time with three digits.
pub(super) fn first_time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-3 => (s * 1e6, "us"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    let decimals = if value < 10.0 {
        2
    } else if value < 100.0 {
        1
    } else {
        0
    };
    format!("{value:.decimals$}{unit}")
}

pub(super) fn span(min: f64, max: f64) -> String {
    if min == max { digits(min) } else { format!("{}..{}", digits(min), digits(max)) }
}

/// Adds the recommended widths.
fn widths(page: &mut Page, of: &Widths, found: &Recommended) {
    type Row<'a> = (&'a Needed, &'a i32);
    let fields = [
        Column::text("name", "width").least(19).of(|(needed, _): &Row| needed.field.name),
        Column::text("signal", "").data().of(|(needed, _): &Row| needed.field.shown_at),
        Column::integer("bits", "bits").of(|(needed, _): &Row| needed.bits),
        Column::integer("needs", "needs").least(5).of(|(needed, _): &Row| needed.least),
        Column::integer("together", "together").of(|(_, together): &Row| **together),
        Column::number("error", "").data().of(|(needed, _): &Row| needed.error),
        Column::text("one_bit_more", "one bit more").least(16).of(|(needed, _): &Row| one_more(of, needed.field)),
        Column::text("one_bit_less", "one bit less than needed").of(|(needed, _): &Row| {
            Cell::new(&needed.breaks).shown(needed.breaks.chars().take(WIDTH - 62).collect::<String>())
        }),
    ];
    page.table(Table::of("widths.each", found.needed.iter().zip(&found.together), fields));
    page.note(match &of.one_more {
        Ok(_) => {
            "one bit more: of the scene's own bits, in the whole loop, by Yosys for the iCE40; measured".to_string()
        }
        Err(why) => format!("one bit more: {why}"),
    });
    let outputs = found.outputs.iter().map(|output| output.name()).collect::<Vec<_>>();
    let (within, error, runs) = (percent(found.within), percent(found.error), found.runs);
    let motion = if of.scenes.len() > 1 { "the motions of these scenes" } else { "this motion of this scene" };
    page.note(format!(
        "needs: each by itself within {within} in {}; together: all at once, off by {error}; {runs} runs\n\
         needs, together: hold for {motion} alone; another hand or wall may need more bits",
        outputs.join(", ")
    ));
    page.data("widths.within", found.within).data("widths.outputs", &outputs);
    page.data("widths.error_together", found.error).data("widths.runs", runs);
}

/// Returns the cost of one more bit of a width.
fn one_more(of: &Widths, field: Field) -> Cell {
    let found = of.one_more.as_ref().ok().and_then(|all| all.iter().find(|(other, _)| *other == field));
    match found {
        None => Cell::new(Value::Null),
        Some((_, Ok([lut4, ff]))) => {
            Cell::new(json!({ "lut4": lut4, "ff": ff })).shown(format!("{lut4:+} LUT4 {ff:+} ff"))
        }
        Some((_, Err(_))) => Cell::new(Value::Null).shown("no such loop"),
    }
}

fn notes(page: &mut Page, of: &Widths) {
    page.note(
        "rounded, overflowed: share of the edges, worst case in the signal's unit, first time; measured\n\
         SQNR: measured, against the same law in f64 on the same encoder counts, gains as asked; idle: unused upper \
         bits",
    );
    match &of.proved {
        Ok(proved) => {
            page.note(
                "proved: for every motion within the device's limits; x exhausted: every input within these ranges; \
                 ! may overflow",
            );
            // An assumption about a few signals only is in the JSON.
            let mut said: Vec<(&str, usize)> = Vec::new();
            for assumption in proved.bounds.iter().flat_map(|bound| &bound.assumptions) {
                match said.iter_mut().find(|(other, _)| other == assumption) {
                    Some((_, signals)) => *signals += 1,
                    None => said.push((assumption, 1)),
                }
            }
            let said: Vec<&str> = said.iter().filter(|(_, signals)| *signals > 3).map(|(said, _)| *said).collect();
            page.note(wrapped(&format!("assuming {}", said.join("; "))));
            for said in proved.lines() {
                page.note(wrapped(&said));
            }
        }
        Err(why) => {
            page.note(format!("proved: nothing; {why}"));
        }
    }
    if let Some(notation) = of.notation {
        let rows = of.measured.rows.iter().filter(|row| row.format.width() > 2);
        let all: Vec<_> = rows.map(|row| format!("{} {}", row.name, notation.of(row.format))).collect();
        let name = match notation {
            Notation::Triple => "(S,I,F)",
            Notation::Vhdl => "VHDL",
            Notation::Cpp => "C++",
            Notation::Q => "Q",
        };
        page.note(wrapped(&format!("in {name}: {}", all.join("; "))));
    }
}

/// Breaks a text at spaces into lines of the page.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let now = lines.last_mut().expect("there is a line");
        if !now.is_empty() && now.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(format!("  {word}"));
        } else {
            *now += if now.is_empty() { "" } else { " " };
            *now += word;
        }
    }
    lines.join("\n")
}
