//! The coverage of a check: the rows by their kind, the bits that moved in them, and the blocks that are proved beside.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use hpu_datapath::variants_of;
use hpu_page::{Cell, Column, Field, Page, Table, escaped};
use hpu_rtl::formal::Proofs;
use hpu_rtl::{CheckReport, CheckRow, Moved, Setup};

use crate::document::{Content, Document, Section};
use crate::shell::cache_folder;

/// The names of blocks and configurations that are proved for all inputs and states, with the solvers; or why that is
/// not known.
type Proved = Result<BTreeMap<(String, String), String>, String>;

/// Looks up the proofs of the configurations of a check in the user's cache. Nothing is proved here. A block made of
/// blocks has no proof of its own there.
pub fn proved(report: &CheckReport, setup: &Setup) -> Proved {
    let folder = cache_folder("proofs", "proofs");
    let folder = folder.path().map_err(|error| error.to_string())?;
    let proofs = Proofs::open(folder, setup.timeout).map_err(|error| error.to_string())?;
    let mut proved = BTreeMap::new();
    for (label, block) in variants_of(|name| report.rows.iter().any(|row| row.block == name)) {
        let name = (block.name().to_string(), label);
        if report.rows.iter().any(|row| (&row.block, &row.variant) == (&name.0, &name.1)) {
            let by = proofs.find(&*block, setup).map_err(|error| error.to_string())?;
            proved.extend(by.map(|by| (name, by.join(", "))));
        }
    }
    Ok(proved)
}

/// A signal of a row of the report.
struct Of<'r> {
    row: &'r CheckRow,
    signal: &'r Moved,
}

/// Returns the table of the signals of all rows, in which hexadecimal words have a bit for each bit of the signal.
pub fn signals(report: &CheckReport) -> Table {
    let rows = report.all().flat_map(|row| row.coverage.signals.iter().map(move |signal| Of { row, signal }));
    let hex = |bits: u64| format!("0x{bits:x}");
    Table::of(
        "signals",
        &rows.collect::<Vec<_>>(),
        [
            Column::text("block", "block").of(|of: &Of| of.row.block.clone()),
            Column::text("variant", "variant").of(|of: &Of| of.row.variant.clone()),
            Column::text("signal", "signal").of(|of: &Of| of.signal.name),
            Column::text("role", "role").of(|of: &Of| of.signal.role.name()),
            Column::integer("bits", "bits").of(|of: &Of| u64::from(of.signal.format.width())),
            Column::integer("toggled_bits", "toggled").of(|of: &Of| u64::from(of.signal.toggled())),
            Column::text("rose", "rose").of(move |of: &Of| hex(of.signal.rose)),
            Column::text("fell", "fell").of(move |of: &Of| hex(of.signal.fell)),
            Column::integer("least", "least").of(|of: &Of| of.signal.range.map(|(least, _)| least)),
            Column::integer("greatest", "greatest").of(|of: &Of| of.signal.range.map(|(_, greatest)| greatest)),
        ],
    )
}

/// Returns the columns of rows and bits that the JSON of a row has.
pub fn fields() -> [Field<'static, CheckRow>; 6] {
    [
        Column::integer("coverage.directed", "").data().of(|row: &CheckRow| row.coverage.directed),
        Column::integer("coverage.random", "").data().of(|row: &CheckRow| row.coverage.random),
        Column::integer("coverage.products", "").data().of(|row: &CheckRow| row.coverage.products),
        Column::integer("coverage.resets", "").data().of(|row: &CheckRow| row.coverage.resets),
        Column::integer("coverage.bits", "").data().of(|row: &CheckRow| u64::from(row.coverage.bits().0)),
        Column::integer("coverage.toggled_bits", "").data().of(|row: &CheckRow| u64::from(row.coverage.bits().1)),
    ]
}

/// Returns the page that shows a check: its table, and below it every signal bit by bit.
pub fn document(report: &CheckReport, result: &str, command: &str, proved: &Proved) -> Document {
    let mut sections = Vec::new();
    let mut add = |id: &str, title: &str, page: &Page, html: &str| {
        let content = Content { by: command.to_string(), html: page.html() + html, ..Content::default() };
        sections.push(Section { id: id.to_string(), title: title.to_string(), beside: vec![content] });
    };
    if !report.rows.is_empty() {
        let mut page = Page::default();
        page.line("result", result.trim_end());
        match proved {
            Ok(proved) => {
                let count = report.rows.iter().filter(|row| proved.contains_key(&named(row))).count();
                let of = report.rows.len();
                page.line("proofs", format!("{count} of {of} configurations are proved for all inputs and states"));
            }
            Err(why) => {
                page.line("proofs", format!("not looked up: {why}"));
            }
        }
        page.table(Table::of("blocks", &report.rows, blocks(proved)));
        add("blocks", "Blocks", &page, "");
    }
    if !report.loops.is_empty() {
        let mut page = Page::default();
        if report.rows.is_empty() {
            page.line("result", result.trim_end());
        }
        page.table(Table::of("loops", &report.loops, loops()));
        add("loops", "Loops", &page, "");
    }
    add("bits", "Every bit", &Page::default(), &bits(report));
    let about = "The rows on which VHDL and emulator were compared, and the bits that moved in them. Agreement on rows \
                 in which a bit never moves says nothing of that bit; a proof holds for all inputs and states.";
    Document { title: "Coverage of hpu check".to_string(), about: about.to_string(), sections }
}

const LEGEND: &str = "<p class=\"bits-legend\"><span><i class=\"both\"></i>rose and fell</span> \
                      <span><i class=\"one\"></i>one way only</span> <span><i></i>never moved</span></p>\n";

/// Returns every signal bit by bit.
pub fn bits(report: &CheckReport) -> String {
    report.all().fold(LEGEND.to_string(), |html, row| html + &details(row))
}

fn named(row: &CheckRow) -> (String, String) {
    (row.block.clone(), row.variant.clone())
}

/// Returns the columns of blocks.
fn blocks(proved: &Proved) -> Vec<Field<'_, CheckRow>> {
    let by = move |row: &CheckRow| match proved.as_ref().ok().and_then(|proved| proved.get(&named(row))) {
        Some(by) => Cell::new(format!("proved ({by})")).good(true),
        None => Cell::new("vectors"),
    };
    let mut fields = vec![
        Column::text("block", "block").of(|row: &CheckRow| row.block.clone()),
        Column::text("variant", "configuration").of(|row: &CheckRow| row.variant.clone()),
        Column::integer("directed", "directed rows").of(|row: &CheckRow| row.coverage.directed),
        Column::integer("random", "random").of(|row: &CheckRow| row.coverage.random),
        Column::integer("products", "products").of(|row: &CheckRow| row.coverage.products),
        Column::integer("resets", "in reset").of(|row: &CheckRow| row.coverage.resets),
    ];
    fields.extend(sums());
    fields.push(Column::text("by", "held by").of(by));
    fields
}

/// Returns the columns of loops.
fn loops() -> Vec<Field<'static, CheckRow>> {
    let contact = |row: &CheckRow| row.contact.as_ref().map_or(Cell::absent(), |contact| contact.edges.into());
    let mut fields = vec![
        Column::text("wiring", "wiring").of(|row: &CheckRow| row.block.clone()),
        Column::text("scene", "scene").of(|row: &CheckRow| row.variant.clone()),
        Column::integer("edges", "edges").of(|row: &CheckRow| row.edges),
        Column::integer("contact_edges", "in contact").of(contact),
        Column::integer("nets", "nets").of(|row: &CheckRow| row.coverage.signals.len() as u64),
    ];
    fields.extend(sums());
    fields
}

/// Returns the columns that tell the bits and the mismatches of a row.
fn sums() -> [Field<'static, CheckRow>; 3] {
    let mismatches = |row: &CheckRow| Cell::new(row.mismatches).good(row.ok());
    [
        Column::integer("bits", "bits").of(|row: &CheckRow| u64::from(row.coverage.bits().0)),
        Column::integer("toggled", "toggled").of(|row: &CheckRow| u64::from(row.coverage.bits().1)),
        Column::integer("mismatches", "mismatches").of(mismatches),
    ]
}

/// Returns the signals of a row, bit by bit, the highest bit first, folded under a line.
fn details(row: &CheckRow) -> String {
    let (bits, toggled) = row.coverage.bits();
    let name = escaped(format!("{} {}", row.block, row.variant).trim_end());
    let open = if toggled < bits { "" } else { " (all)" };
    let mut html =
        format!("<details class=\"bits\"><summary>{name}: {toggled} of {bits} bits{open}</summary>\n<table>\n");
    html += "<thead><tr><th scope=\"col\">signal</th><th scope=\"col\">format</th><th scope=\"col\"></th>\
             <th scope=\"col\">bits</th><th scope=\"col\">not both ways</th></tr></thead>\n<tbody>\n";
    for signal in &row.coverage.signals {
        let Moved { name, format, role, .. } = signal;
        let missing = missing(signal);
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{format}</td><td>{}</td><td class=\"strip\">{}</td><td>{missing}</td></tr>",
            escaped(name),
            role.name(),
            strip(signal)
        );
    }
    html + "</tbody>\n</table>\n</details>\n"
}

/// Returns the runs of bits that look alike, the highest bits first: the highest and the lowest bit of each, whether
/// they rose, and whether they fell.
fn runs(Moved { format, rose, fell, .. }: &Moved) -> Vec<(u32, u32, bool, bool)> {
    let mut runs: Vec<(u32, u32, bool, bool)> = Vec::new();
    for bit in (0..format.width()).rev() {
        let (rose, fell) = (rose >> bit & 1 == 1, fell >> bit & 1 == 1);
        match runs.last_mut() {
            Some((_, low, risen, fallen)) if (*risen, *fallen) == (rose, fell) => *low = bit,
            _ => runs.push((bit, bit, rose, fell)),
        }
    }
    runs
}

/// Returns the bits as squares, in which equal neighbours are one.
fn strip(signal: &Moved) -> String {
    let square = |(high, low, rose, fell): (u32, u32, bool, bool)| {
        let class = match (rose, fell) {
            (true, true) => " class=\"both\"",
            (false, false) => "",
            _ => " class=\"one\"",
        };
        format!("<i{class} style=\"--n:{}\"></i>", high - low + 1)
    };
    runs(signal).into_iter().map(square).collect()
}

/// Returns the bits that did not move both ways, as `11..9, 0 only rose`; of a signal that never moved, its word.
fn missing(signal: &Moved) -> String {
    if let Some((word, greatest)) = signal.range
        && word == greatest
    {
        return format!("constant {word}");
    }
    let open = runs(signal).into_iter().filter(|(_, _, rose, fell)| !(*rose && *fell));
    let said = open.map(|(high, low, rose, fell)| {
        let bits = if high == low { high.to_string() } else { format!("{high}..{low}") };
        let way = if rose {
            " only rose"
        } else if fell {
            " only fell"
        } else {
            ""
        };
        format!("{bits}{way}")
    });
    said.collect::<Vec<_>>().join(", ")
}
