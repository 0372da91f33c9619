//! The page of `hpu widths`.

use std::fmt::Write as _;

use hpu_signal::{Clock, Notation};
use hpu_study::fit::percent;
use hpu_study::map::outcome_name;
use hpu_study::widths::proof::How;
use hpu_study::widths::{Field, Loss, SignalRow};

use crate::units::si;
use crate::widths::Page;

/// Columns of the page.
const WIDTH: usize = 120;
/// The most signals that fit on the page.
const MOST: usize = 36;

/// Returns the page.
pub fn page(page: &Page) -> String {
    let mut text = String::new();
    let mut line = |said: &str| writeln!(text, "{said}").expect("a string grows");
    head(page, &mut line);
    page.missed.iter().for_each(|said| line(&format!("warning: {said}")));
    let (rows, left_out) = shown(page);
    line("");
    line(&row(["signal", "format", "measured", "proved", "idle", "rounded", "overflowed", "SQNR dB", "needs"]));
    for signal in rows {
        line(&row(signal_cells(page, signal).each_ref().map(String::as_str)));
    }
    if !left_out.is_empty() {
        wrapped(&format!("not shown: {}", left_out.join(", ")), &mut line);
    }
    line("");
    widths(page, &mut line);
    notes(page, &mut line);
    if let Some(tables) = &page.tables {
        tables.text().lines().for_each(&mut line);
    }
    if let Some(price) = &page.price {
        price.head_text().lines().for_each(&mut line);
        if page.recommended.is_err() {
            price.knobs_text().lines().for_each(line);
        }
    }
    text
}

fn head(page: &Page, line: &mut impl FnMut(&str)) {
    let measured = &page.measured;
    let clock = si(page.clock_hz as f64, "Hz");
    let motion = si(measured.motion_s, "s");
    let how = match page.random {
        Some((_, seed)) => format!("{motion} of random motion (seed {seed}), open loop"),
        None => {
            let outcomes: Vec<_> = measured
                .outcomes
                .iter()
                .zip(&measured.contact_shares)
                .map(|(kind, share)| {
                    let touched = if *share == Some(0.0) { " (wall not reached)" } else { "" };
                    outcome_name(Some(*kind)).replace('_', " ") + touched
                })
                .collect();
            let outcomes = if outcomes.is_empty() { String::new() } else { format!(": {}", outcomes.join(", ")) };
            format!("{motion} in closed loop{outcomes}")
        }
    };
    line(&format!("{}: {} at {clock}, {how}", page.scenes.join(", "), measured.wiring));
    line(&format!("$ {}", page.command));
}

/// Returns the signals of the page, and those that do not fit: single bits always, constants when there are many
/// signals.
fn shown(page: &Page) -> (Vec<&SignalRow>, Vec<&str>) {
    let rows = || page.measured.rows.iter().filter(|row| row.format.width() > 2);
    let constant = |row: &SignalRow| row.measured.is_none_or(|(min, max)| min == max);
    if rows().count() <= MOST {
        return (rows().collect(), Vec::new());
    }
    let (left_out, shown): (Vec<_>, Vec<_>) = rows().partition(|row| constant(row) || row.name.starts_with("scaled"));
    (shown, left_out.into_iter().map(|row| row.name).collect())
}

/// Returns the cells as a line, within the width of the page.
fn row(cells: [&str; 9]) -> String {
    let [signal, format, measured, proved, idle, rounded, overflowed, sqnr, needs] = cells;
    let line = format!(
        "{signal:<11} {format:<9} {measured:<17} {proved:<18} {idle:>4} {rounded:<18} {overflowed:<18} {sqnr:>7} {needs:<9}"
    );
    line.trim_end().to_string()
}

fn signal_cells(page: &Page, signal: &SignalRow) -> [String; 9] {
    let format = signal.format;
    let measured = signal.measured.map_or_else(String::new, |(min, max)| span(format.to_f64(min), format.to_f64(max)));
    let bound = page.proved.as_ref().ok().and_then(|proved| proved.of(signal.name));
    let proved = bound.map_or_else(String::new, |bound| {
        let mark = match (bound.how, bound.never_overflows) {
            (How::Exhausted, false) => " x!",
            (How::Exhausted, true) => " x",
            (_, false) => " !",
            (_, true) => "",
        };
        span(bound.min, bound.max) + mark
    });
    let sqnr = match signal.sqnr_db {
        None => String::new(),
        Some(db) if db.is_infinite() => "exact".into(),
        Some(db) => format!("{db:.1}"),
    };
    let loss = |loss: &Loss| lost(page, loss);
    [
        signal.name.to_string(),
        format.to_string(),
        measured,
        proved,
        signal.headroom_bits.to_string(),
        loss(&signal.rounded),
        loss(&signal.overflowed),
        sqnr,
        signal.recommended.map_or_else(String::new, |format| format.to_string()),
    ]
}

/// Returns the share of the edges with losses, the worst case, and the first time.
fn lost(page: &Page, loss: &Loss) -> String {
    if loss.edges == 0 {
        return "-".into();
    }
    let share = 100.0 * loss.edges as f64 / page.measured.edges.max(1) as f64;
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
        |first| first_time(Clock::new(page.clock_hz).map_or(0.0, |clock| clock.seconds(first))),
    );
    format!("{share} {worst} {first}")
}

/// Returns a time with three digits.
fn first_time(seconds: f64) -> String {
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

fn span(min: f64, max: f64) -> String {
    if min == max { digits(min) } else { format!("{}..{}", digits(min), digits(max)) }
}

/// Returns a whole number as it is, any other with four digits.
pub fn digits(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => value.to_string(),
        size if size >= 1e6 => format!("{value:.2e}"),
        size if size.fract() == 0.0 => format!("{value}"),
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 100.0 => format!("{value:.1}"),
        size if size >= 10.0 => format!("{value:.2}"),
        size if size >= 1e-2 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

/// Writes the recommended widths.
fn widths(page: &Page, line: &mut impl FnMut(&str)) {
    let found = match &page.recommended {
        Ok(found) => found,
        Err(why) => {
            line(&format!("needs: by the range measured, of this motion alone; {why}"));
            return;
        }
    };
    let cut = |text: &str, width: usize| text.chars().take(width).collect::<String>();
    let titles = ["width", "bits", "needs", "together", "one bit more", "one bit less than needed"];
    let [width, bits, needs, together, more, less] = titles;
    line(&format!("{width:<20} {bits:>4} {needs:>6} {together:>9}  {more:<17} {less}"));
    for (needed, together) in found.needed.iter().zip(&found.together) {
        let name = needed.field.name();
        let more = one_more(page, needed.field);
        let said = cut(&needed.breaks, WIDTH - 62);
        line(&format!("{name:<20} {:>4} {:>6} {together:>9}  {more:<17} {said}", needed.bits, needed.least));
    }
    line(&match &page.one_more {
        Ok(_) => {
            "one bit more: of the scene's own bits, in the whole loop, by Yosys for the iCE40; measured".to_string()
        }
        Err(why) => format!("one bit more: {why}"),
    });
    let outputs = found.outputs.iter().map(|output| output.name()).collect::<Vec<_>>().join(", ");
    line(&format!(
        "needs: each by itself within {} in {outputs}; together: all at once, off by {}; {} runs",
        percent(found.within),
        percent(found.error),
        found.runs
    ));
    let motion = if page.scenes.len() > 1 { "the motions of these scenes" } else { "this motion of this scene" };
    line(&format!("needs, together: hold for {motion} alone; another hand or wall may need more bits"));
}

/// Returns the cost of one more bit of a width.
fn one_more(page: &Page, field: Field) -> String {
    let found = page.one_more.as_ref().ok().and_then(|all| all.iter().find(|(other, _)| *other == field));
    match found {
        None => "-".into(),
        Some((_, Ok([lut4, ff]))) => format!("{lut4:+} LUT4 {ff:+} ff"),
        Some((_, Err(_))) => "no such loop".into(),
    }
}

fn notes(page: &Page, line: &mut impl FnMut(&str)) {
    line("rounded, overflowed: share of the edges, worst case in the signal's unit, first time; measured");
    line(
        "SQNR: measured, against the same law in f64 on the same encoder counts, gains as asked; idle: unused upper bits",
    );
    match &page.proved {
        Ok(proved) => {
            line(
                "proved: for every motion within the device's limits; x exhausted: every input within these ranges; ! may overflow",
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
            wrapped(&format!("assuming {}", said.join("; ")), line);
            for said in proved.lines() {
                wrapped(&said, line);
            }
        }
        Err(why) => line(&format!("proved: nothing; {why}")),
    }
    if let Some(notation) = page.notation {
        let rows = page.measured.rows.iter().filter(|row| row.format.width() > 2);
        let all: Vec<_> = rows.map(|row| format!("{} {}", row.name, notation.of(row.format))).collect();
        let name = match notation {
            Notation::Triple => "(S,I,F)",
            Notation::Vhdl => "VHDL",
            Notation::Cpp => "C++",
            Notation::Q => "Q",
        };
        wrapped(&format!("in {name}: {}", all.join("; ")), line);
    }
}

/// Writes a text in lines of the page, broken at spaces.
fn wrapped(text: &str, line: &mut impl FnMut(&str)) {
    let mut now = String::new();
    for word in text.split(' ') {
        if !now.is_empty() && now.chars().count() + 1 + word.chars().count() > WIDTH {
            line(&now);
            now = "  ".into();
        } else if !now.is_empty() {
            now.push(' ');
        }
        now += word;
    }
    line(&now);
}
