//! What a design of the user's own has said in a run, in words and as JSON.

use std::fmt::Write as _;

use hpu_cosim::dut::{End, Failure, Heard, Severity, place};
use hpu_signal::{Clock, Cycle};
use serde_json::{Value, json};

use crate::Page;
use crate::quantities::si;

/// The most failed assertions that a page shows as lines.
const SHOWN: usize = 8;

/// Returns the part of a page that tells the failed assertions of a run, the end that the design has set, and the
/// number of messages. Text shows what there is; the JSON always has the keys `assertions` and `ended_by_design`.
pub fn heard(heard: &Heard, clock: Clock) -> Page {
    let mut page = Page::default();
    let at = |edge: u64| if edge == 0 { "in the reset".to_string() } else { format!("at {}", time(edge, clock)) };
    for failure in heard.failures.iter().take(SHOWN) {
        let Failure { first, times, .. } = failure;
        let place = place(first.place.as_ref()).map_or(String::new(), |place| format!("{place}, "));
        let often = if *times > 1 { format!(", {times} times, first") } else { String::new() };
        let severity = first.severity.name();
        let said = format!("FAILED{often} {}: {} ({place}severity {severity})", at(first.edge), first.text);
        page.line("assertion", said);
    }
    let more = heard.failures.len().saturating_sub(SHOWN);
    if more > 0 || heard.unlisted > 0 {
        page.line("", format!("more have failed, at {more} other places; the messages list them"));
    }
    if let Some(End { edge, by, place: there }) = &heard.end {
        let there = place(there.as_ref()).map_or(String::new(), |place| format!(", {place}"));
        page.line("ended", format!("by the design itself {}: {by}{there}", at(*edge)));
    }
    for what in &heard.unchecked {
        page.line("", format!("assertions are not checked: {what}"));
    }
    let listed = heard.failures.iter().map(|failure| {
        let Failure { first, times, .. } = failure;
        json!({
            "edge": first.edge, "at_s": clock.seconds(Cycle(first.edge)), "severity": first.severity.name(),
            "file": file(first.place.as_ref()), "line": line(first.place.as_ref()), "text": first.text, "times": times,
        })
    });
    let listed: Vec<_> = listed.collect();
    page.data("assertions", json!({ "failed": heard.failed(), "first": listed, "not_checked": heard.unchecked }));
    let ended = heard.end.as_ref().map(|End { edge, by, place }| {
        json!({
            "edge": edge, "at_s": clock.seconds(Cycle(*edge)), "by": by, "file": file(place.as_ref()),
            "line": line(place.as_ref()),
        })
    });
    page.data("ended_by_design", ended);
    page
}

fn time(edge: u64, clock: Clock) -> String {
    si(clock.seconds(Cycle(edge)), "s")
}

fn file(place: Option<&(String, u32)>) -> Value {
    place.map(|(file, _)| file.as_str()).into()
}

fn line(place: Option<&(String, u32)>) -> Value {
    place.map(|(_, line)| *line).into()
}

/// Returns everything that a design has said, a line each, behind the time in seconds where it is known. Before the end
/// of the reset, the time is 0.
pub fn messages(heard: &Heard, clock: Clock) -> String {
    let mut text = String::new();
    for (edge, line) in &heard.messages {
        let at = edge.map_or(String::new(), |edge| format!("{:.9}", clock.seconds(Cycle(edge))));
        let _ = writeln!(text, "{at:>14}  {line}");
    }
    if heard.unkept > 0 {
        let _ = writeln!(text, "… and {} more lines, which are not kept", heard.unkept);
    }
    text
}

/// Returns the edges of a run that viewers mark: the first failure of each assertion, and the end that the design has
/// set.
pub fn marks(heard: &Heard) -> Vec<(Cycle, String)> {
    let of = |failure: &Failure| (Cycle(failure.first.edge), format!("assertion failed: {}", failure.first.text));
    let end = heard.end.as_ref().filter(|_| heard.failures.iter().all(|one| one.first.severity != Severity::Failure));
    let end = end.map(|end| (Cycle(end.edge), format!("ended by {}", end.by)));
    heard.failures.iter().map(of).chain(end).collect()
}
