//! The page of identified keys.

use hpu_page::{Column, Field, Page, Table, Value};
use hpu_study::identify::{Bound, Found};

use super::Identification;

/// Returns the page.
pub fn page(scene: &str, result: &Identification) -> Page {
    let Identification { found, runs, .. } = result;
    let mut page = Page::default();
    let fitted = found.met.len();
    let rows: usize = found.met.iter().map(|(_, met)| met.rows).sum();
    let [keys, logs] = [(found.found.len(), "key"), (fitted, "log")].map(|(count, what)| counted(count, what));
    page.note(format!("{scene}: {keys} from {rows} rows of {logs}, in {} runs", found.sets * fitted));
    page.data("scene", scene).data("sets_of_runs", found.sets);
    page.table(Table::of("keys", &keys_of(result), keys_fields()));
    if found.found.len() > 1 {
        page.note("\nCorrelations");
        let names = found.found.iter().map(|found| Column::number("", &found.key).least(8));
        let mut table = Table::new("", [Column::text("", "").least(24)].into_iter().chain(names));
        for (found, row) in found.found.iter().zip(&result.found.correlations) {
            let cells = row.iter().map(|share| format!("{share:.2}").into());
            table.add([found.key.clone().into()].into_iter().chain(cells));
        }
        page.table(table);
    }
    page.data("correlations", &found.correlations);
    page.note("\nLogs, in counts");
    page.table(Table::of("logs", &logs_of(result), logs_fields()));
    for (run, (held, met)) in runs.iter().zip(&result.held) {
        let file = &run.file;
        for note in run.taken.notes.iter().cloned().chain(run.gaps()) {
            page.line("note", format!("{file}: {note}"));
        }
        let [first, second] = held.halves;
        if first != second {
            let halves = format!("shift {first} for its first half alone, {second} for its second");
            page.line("note", format!("{file}: {halves}: a clock drifts, or the motions differ"));
        }
        if met.is_rejected() {
            let [from, to] = met.worst_s.map(|time_s| format!("{time_s:.4} s"));
            let why = format!("{:.1} counts rms from {from} to {to}", met.worst_rms);
            let said = format!("{file}: REJECTED: the scene does not explain {why}");
            page.line("rejected", said);
        }
    }
    page.data("explained", result.is_explained());
    page
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

type Key<'r> = (&'r Found, &'static str);

fn keys_of(result: &Identification) -> Vec<Key<'_>> {
    result.found.found.iter().zip(result.units.iter().copied()).collect()
}

/// Returns the interval of a key as text.
pub fn interval(found: &Found) -> String {
    let told = |value: f64| rounded(value, found);
    let interval = match found.bound {
        Bound::Both(low, high) => format!("{} to {}", told(low), told(high)),
        Bound::Lower(low) => format!("at least {}", told(low)),
        Bound::Upper(high) => format!("at most {}", told(high)),
        Bound::None => "not identifiable".to_string(),
    };
    if found.is_at_bound { format!("{interval}; at its bound") } else { interval }
}

/// Returns a value with the digits that its scatter leaves.
pub fn rounded(value: f64, found: &Found) -> String {
    let share = found.sd / value.abs();
    let digits =
        if share.is_finite() && share > 0.0 { (1.0 - libm::log10(share).floor()).clamp(2.0, 9.0) } else { 3.0 };
    let text = format!("{value:.*e}", digits as usize - 1);
    text.parse().map_or(text, hpu_cosim::number)
}

fn keys_fields<'r>() -> [Field<'r, Key<'r>>; 12] {
    let end = |found: &Found, is_low: bool| match (found.bound, is_low) {
        (Bound::Both(low, _) | Bound::Lower(low), true) => Some(low),
        (Bound::Both(_, high) | Bound::Upper(high), false) => Some(high),
        _ => None,
    };
    let finite = |number: f64| number.is_finite().then_some(number);
    [
        Column::text("key", "key").least(24).of(|(found, _): &Key| found.key.clone()),
        Column::number("", "value").least(12).of(|(found, _): &Key| rounded(found.value, found)),
        Column::text("unit", "unit").least(12).of(|(_, unit): &Key| *unit),
        Column::text("interval", "95 % interval").least(28).of(|(found, _): &Key| interval(found)),
        Column::number("value", "").data().of(|(found, _): &Key| found.value),
        Column::number("low", "").data().of(move |(found, _): &Key| end(found, true)),
        Column::number("high", "").data().of(move |(found, _): &Key| end(found, false)),
        Column::number("start", "start").least(10).of(|(found, _): &Key| found.start),
        Column::number("sd", "").data().of(move |(found, _): &Key| finite(found.sd)),
        Column::number("naive_sd", "").data().of(move |(found, _): &Key| finite(found.naive_sd)),
        Column::number("", "if rows were independent").least(10).of(|(found, _): &Key| {
            format!("+- {}", hpu_cosim::number(format!("{:.1e}", 1.96 * found.naive_sd).parse().unwrap_or(f64::NAN)))
        }),
        Column::text("profile", "").data().of(|(found, _): &Key| Value::of(&found.profile)),
    ]
}

/// A log: its file, how it was met at the start if it took part in the search, and how it is met now.
struct Log<'r> {
    file: &'r str,
    start_rms: Option<f64>,
    met: hpu_study::identify::Met,
}

fn logs_of(result: &Identification) -> Vec<Log<'_>> {
    let log = |(at, (_, met)): (usize, &(hpu_cosim::LogHeld, hpu_study::identify::Met))| Log {
        file: &result.runs[at].file,
        start_rms: result.found.met.get(at).map(|(start, _)| start.rms),
        met: *met,
    };
    result.held.iter().enumerate().map(log).collect()
}

fn logs_fields<'r>() -> [Field<'r, Log<'r>>; 10] {
    let two = |number: f64| format!("{number:.2}");
    [
        Column::text("file", "log").least(32).of(|log: &Log| log.file),
        Column::text("use", "use").least(9).of(|log: &Log| if log.start_rms.is_some() { "searched" } else { "held" }),
        Column::integer("rows", "rows").least(6).of(|log: &Log| log.met.rows),
        Column::integer("shift", "shift").least(5).of(|log: &Log| log.met.shift),
        Column::number("", "rms at the start").least(8).of(move |log: &Log| log.start_rms.map_or("-".into(), two)),
        Column::number("", "rms").least(8).of(move |log: &Log| two(log.met.rms)),
        Column::number("rms_counts", "").data().of(|log: &Log| log.met.rms),
        Column::number("correlation", "next row").least(8).of(move |log: &Log| two(log.met.correlation)),
        Column::number("worst_s", "").data().of(|log: &Log| log.met.worst_s),
        Column::flag("rejected", "rejected").of(|log: &Log| log.met.is_rejected()),
    ]
}
