//! `hpu check`: compares the VHDL with the emulator in GHDL.

pub mod coverage;
pub mod entity;
pub mod prove;

use std::path::PathBuf;

use entity::Theirs;
use hpu_cosim::scene::{Experiment, Shipped, shipped};
use hpu_datapath::block_names;
use hpu_page::{Cell, Column, Field, Page, Table};
use hpu_rtl::{Check, CheckOptions, CheckReport, CheckRow, Contact, Coverage, Error, Late, comparison_edges, junit};
use serde_json::{Value, json};

use crate::block::{configured, find, known, known_to_proofs};
use crate::command::CommandLine;
use crate::scene::{self, Loaded};
use crate::shell::{
    Exit, Failure, Folder, Jobs, Single, hdl, interrupt, print, print_json, tell, verdict, with_progress,
};
use crate::waves::waveform;

/// Hold the VHDL against the emulator in GHDL: blocks on vectors, loops closed around the same plant
///
/// Without blocks and scenes, all of both: a minute or two on two cores, and it says which. The first mismatch of each
/// is shown with the rows that lead to it, and with --out as a waveform of the rows around it.
///
/// A scene is compared where it touches its wall: it begins shortly before, with the device, its encoders and the hand
/// as the emulator has them at that edge, and the FPGA out of reset there. Its counters count from there, and the
/// wall's position moves with them; an arm's encoders are first turned to the arm's counts. `in contact` is the
/// number of edges at which the datapath saw the wall. A scene that never reaches it is compared from its start, and
/// says so. To compare a scene from its start in any case: hpu run SCENE --driver rtl --edges N.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Blocks to check on directed and random vectors; with --entity, files
    pub blocks: Vec<String>,
    /// Configuration of the blocks to check, of those that `hpu block NAME` lists; without blocks, of all that have it;
    /// may be repeated
    #[arg(long = "variant", value_name = "LABEL")]
    pub variants: Vec<String>,
    /// Scene to run in VHDL, every net compared at every edge; may be repeated
    #[arg(long = "scene", value_name = "SCENE")]
    pub scenes: Vec<String>,
    #[command(flatten)]
    pub set: scene::Set,
    /// Clock edges of each scene [default: 150000, or one and a half samples where a held position shows the wall only
    /// then]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    edges: Option<u64>,
    /// Random rows of each configuration of a block
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub rows: usize,
    /// Seed of the random rows
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Prove the VHDL of the blocks, of all without names, equal to the emulator for all inputs and states
    ///
    /// GHDL synthesises the VHDL, Yosys writes it as a transition, and solvers (z3, yices and bitwuzla, raced) look for
    /// a state and inputs of which an output or a register after the edge differs. A difference is shown as a row; a
    /// block that they do not decide in 60 s a question (--tool-timeout) stays under vectors. A proof is remembered in
    /// hpu/proofs of the user's cache, by the SHA-256 of the VHDL, the equations, the widths and the tools. The netlist
    /// of a loop, or of another block made of blocks alone, is compared with the emulator's wiring, connection by
    /// connection: such a block is proved when the wiring equals and every block inside is proved in its generics, and
    /// wired when it equals and some of them are not. With --scene, wiring and blocks of a scene are proved in its
    /// widths. With --entity, a block of your own is proved: against one without registers as it is, against one with
    /// registers by what --state and --invariant say. Exit code 1, then, too, where it is not proved.
    #[arg(long, conflicts_with_all = ["exhaustive", "junit", "edges"])]
    formal: bool,
    /// All 2^24 products of the 12 x 12 multiplier instead of 2^16 in strata
    #[arg(long)]
    exhaustive: bool,
    #[command(flatten)]
    pub jobs: Jobs,
    #[command(flatten)]
    pub hdl: hdl::Vhdl,
    #[command(flatten)]
    pub theirs: Theirs,
    /// Write a JUnit report
    #[arg(short = 'x', long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write check.json and check.txt into this folder, coverage.html and coverage.csv (the bits that moved), and of
    /// each first mismatch BLOCK-VARIANT.vcd with its GTKWave save file
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

/// A validated command.
enum Plan {
    /// Blocks and scenes compared in GHDL.
    Compare(CheckOptions),
    /// Blocks and scenes proved.
    Prove,
    /// A block of the user's own compared.
    CompareTheirs,
    /// A block of the user's own proved.
    ProveTheirs,
}

impl Plan {
    fn new(args: &Args) -> Result<Self, Failure> {
        if args.theirs.is_asked() {
            return Ok(if args.formal { Self::ProveTheirs } else { Self::CompareTheirs });
        }
        args.blocks.iter().try_for_each(|name| known(name))?;
        if !args.theirs.generic.is_empty() && (args.exhaustive || !args.variants.is_empty()) {
            return Err(Failure::usage(
                "--generic is a configuration of its own, beside no --variant and --exhaustive",
            ));
        }
        if args.blocks.is_empty() && !args.variants.is_empty() {
            if !args.scenes.is_empty() {
                return Err(Failure::usage(
                    "--variant is a configuration of blocks; name blocks, or leave out --scene",
                ));
            }
            let (blocks, _) = everything();
            if let Some(label) = args.variants.iter().find(|label| blocks.iter().all(|name| find(name, label).is_err()))
            {
                return Err(Failure::usage(format!(
                    "--variant: no block has a configuration `{label}`; see hpu block"
                )));
            }
        }
        for name in &args.blocks {
            configured(name, &args.theirs.generic)?;
            let known = |label: &String| match args.formal {
                true => known_to_proofs(name, label),
                false => find(name, label).map(drop),
            };
            args.variants.iter().try_for_each(known)?;
        }
        Ok(if args.formal { Self::Prove } else { Self::Compare(options(args)?) })
    }
}

/// Runs `hpu check`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match Plan::new(args)? {
        Plan::Compare(options) => {
            compare(args, |shown| Ok((checked(&options, shown)?, format!("{VHDL}{}", options.setup.hdl))))
        }
        Plan::Prove => prove::run(args),
        Plan::CompareTheirs => compare(args, |shown| entity::checked(args, shown)),
        Plan::ProveTheirs => prove::theirs(args),
    }
}

/// Words before the source of VHDL of ours, where a line tells what was compared.
const VHDL: &str = "VHDL ";

/// Compares by `checked`, which returns the report and what was compared, and shows and writes the result.
fn compare(
    args: &Args,
    checked: impl FnOnce(&mut Shown) -> Result<(CheckReport, String), Failure>,
) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let junit_file = args.junit.as_deref().map(Single::open).transpose()?;
    let mut shown = Shown { quiet: args.json, text: String::new(), fields: Vec::new(), folder };
    let Some((report, of)) = uninterrupted(checked(&mut shown))? else { return Ok(Exit::Interrupted) };
    shown.end(&report, &of, junit_file, args)
}

/// Returns the page of a comparison, without its rows one by one, and the bits of its signals as HTML; `None` when
/// interrupted.
pub fn answer(args: &Args) -> Result<Option<(Page, String)>, Failure> {
    let options = options(args)?;
    let mut shown = Shown { quiet: true, text: String::new(), fields: Vec::new(), folder: None };
    let report = uninterrupted(checked(&options, &mut shown))?;
    Ok(report.map(|report| (page(&report, &options.setup.hdl), coverage::bits(&report))))
}

/// Returns the report; `None` when interrupted.
fn uninterrupted<T>(report: Result<T, Failure>) -> Result<Option<T>, Failure> {
    match report {
        Err(failure) if interrupt::pressed() || failure.exit() == Exit::Interrupted => Ok(None),
        report => report.map(|report| (!interrupt::pressed()).then_some(report)),
    }
}

/// Returns what is to be checked. Files that are not scenes are refused before anything runs.
fn options(args: &Args) -> Result<CheckOptions, Failure> {
    let all = args.blocks.is_empty() && args.scenes.is_empty();
    let (blocks, scenes) = if all { everything() } else { (args.blocks.clone(), args.scenes.clone()) };
    let scenes: Vec<_> = scenes.iter().map(|name| Loaded::new(name, &args.set.set, None)).collect::<Result<_, _>>()?;
    let setup = args.hdl.setup();
    Ok(CheckOptions {
        blocks,
        variants: args.variants.clone(),
        generics: args.theirs.generic.clone(),
        scenes: scenes.iter().map(|loaded| loaded.in_vhdl(edges(args, &loaded.scene))).collect(),
        rows: args.rows,
        seed: args.seed,
        exhaustive: args.exhaustive,
        jobs: args.jobs.get().get(),
        ..CheckOptions::new(&setup)
    })
}

/// Returns the command, without options that change no figure.
fn command(args: &Args) -> String {
    let command = CommandLine::new("check").words(&args.blocks).option("--variant", &args.variants);
    let generics = args.theirs.generic.iter().filter(|_| !args.theirs.is_asked());
    let command = command.option("--generic", generics.map(|(name, value)| format!("{name}={value}")));
    let theirs = args.theirs.options().into_iter();
    let command = theirs.fold(command.option("--scene", &args.scenes), |command, (option, value)| {
        command.option(&format!("--{option}"), [value])
    });
    let command = command.set(&args.set.set).option("--edges", args.edges).flag("--exhaustive", args.exhaustive);
    if args.blocks.is_empty() && !args.scenes.is_empty() {
        return command.text();
    }
    command.option("--rows", [args.rows]).option("--seed", [args.seed]).text()
}

/// Returns the number of edges of a scene to compare.
fn edges(args: &Args, scene: &Experiment) -> u64 {
    args.edges.map_or_else(|| comparison_edges(scene), |edges| edges.min(scene.edges()))
}

/// Checks blocks and scenes, and shows the table as it grows.
fn checked(options: &CheckOptions, shown: &mut Shown) -> Result<CheckReport, Failure> {
    let control = interrupt::heed();
    let check = match Check::new(options) {
        Err(error) if error.is_refusal() => {
            // All VHDL is analysed together, so an error of the analysis is shown once.
            let row = unfinished(options, &error);
            shown.begin(fields("block", "variant"))?;
            shown.row(&row)?;
            return Ok(CheckReport { rows: vec![row], loops: Vec::new() });
        }
        check => check?,
    };
    let (blocks, scenes) = check.count();
    tell(&format!(
        "VHDL {}: {}, {}; about {} by their rows and edges (an estimate), {} at a time",
        options.setup.hdl,
        counted(blocks, "configuration"),
        counted(scenes, "scene"),
        duration(check.about_ms()),
        check.at_a_time(),
    ));
    let mut told = 0;
    with_progress(check.work_ms(), "ms of GHDL", control, || {
        check.run(control, |row| {
            if told == 0 && blocks > 0 {
                shown.begin(fields("block", "variant"))?;
            }
            if told == blocks {
                shown.begin(loops())?;
            }
            told += 1;
            shown.row(row)
        })
    })
}

/// Returns a number of things, with the plural where it is needed.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Returns a time in seconds or minutes as text.
fn duration(ms: u64) -> String {
    match ms.div_ceil(1000) {
        seconds @ 0..=99 => format!("{seconds} s"),
        seconds => format!("{} min", seconds.div_ceil(60)),
    }
}

/// Returns the names of all blocks and of all shipped scenes that have VHDL.
fn everything() -> (Vec<String>, Vec<String>) {
    (
        block_names().iter().map(|name| (*name).to_string()).collect(),
        shipped().iter().filter(|scene| has_vhdl(scene)).map(|scene| scene.name.to_string()).collect(),
    )
}

/// Whether a shipped scene is closed by blocks with VHDL: all are but those around a transfer function.
fn has_vhdl(scene: &Shipped) -> bool {
    !matches!(scene.parse(&[]), Ok(Experiment::Transfer(_)))
}

/// Returns the row for VHDL that does not analyse: of the first block, or of the first scene.
fn unfinished(options: &CheckOptions, error: &Error) -> CheckRow {
    let block = options.blocks.first().map_or("loop", String::as_str);
    CheckRow {
        block: block.to_string(),
        variant: String::new(),
        vectors: 0,
        edges: 0,
        mismatches: 0,
        first: None,
        contact: None,
        coverage: Coverage::default(),
        failure: Some(error.to_string()),
        seconds: 0.0,
    }
}

/// The table, which is shown as it grows.
pub struct Shown {
    quiet: bool,
    text: String,
    fields: Vec<Field<'static, CheckRow>>,
    /// The folder for the waveforms of mismatches.
    folder: Option<Folder>,
}

impl Shown {
    /// Shows the total, and writes the files that were asked for.
    fn end(mut self, report: &CheckReport, of: &str, junit_file: Option<Single>, args: &Args) -> Result<Exit, Failure> {
        let (total, json) = (total(report, of), object(report, of.strip_prefix(VHDL).unwrap_or(of)));
        self.line(&total)?;
        if let Some(file) = junit_file {
            file.write(junit(report))?;
        }
        if let Some(mut folder) = self.folder {
            folder.write("check.json", format!("{json:#}\n"))?;
            folder.write("check.txt", &self.text)?;
            let command = command(args);
            let proved = match args.theirs.is_asked() {
                true => Err("a block of your own is proved by hpu check --formal --entity".to_string()),
                false => coverage::proved(report, &args.hdl.setup()),
            };
            let document = coverage::document(report, &total, &command, &proved);
            folder.write("coverage.html", document.html())?;
            folder.write("coverage.csv", coverage::signals(report).csv(&[&command]))?;
            folder.commit()?;
        }
        if args.json {
            print_json(&json)?;
        }
        Ok(Exit::when(report.ok()))
    }

    fn line(&mut self, line: &str) -> Result<(), Failure> {
        self.text += line;
        if self.quiet { Ok(()) } else { print(line) }
    }

    /// Begins a table with these columns.
    pub fn begin(&mut self, fields: Vec<Field<'static, CheckRow>>) -> Result<(), Failure> {
        self.fields = fields;
        let head = self.table().head();
        self.line(&head)
    }

    fn table(&self) -> Table {
        Table::new("", self.fields.iter().map(|field| field.column.clone())).gap(1)
    }

    pub fn row(&mut self, row: &CheckRow) -> Result<(), Failure> {
        let mut table = self.table();
        table.add(self.fields.iter().map(|field| field.cell(row)));
        let mut detail = String::new();
        if let Some(first) = &row.first {
            let name = format!("{}-{}", row.block, row.variant);
            detail += &first.to_string();
            detail += &waveform(&first.around, first.row, &name, self.folder.as_mut())?;
        }
        if let Some(failure) = &row.failure {
            detail += &format!("  {}\n", failure.trim_end().replace('\n', "\n  "));
        }
        let plain = table.last(&|text, _| text.to_string());
        self.text += &(plain + &detail);
        if self.quiet { Ok(()) } else { print(&(table.last(&verdict) + &detail)) }
    }
}

/// Returns the columns of the rows of blocks.
pub fn fields(what: &str, which: &str) -> Vec<Field<'static, CheckRow>> {
    let mut fields = vec![
        Column::text("", what).least(22).said().of(|row: &CheckRow| row.block.clone()),
        Column::text("name", which).least(30).of(|row: &CheckRow| row.variant.clone()),
        Column::integer("vectors", "vectors").least(10).of(|row: &CheckRow| row.vectors),
    ];
    fields.extend(figures());
    fields
}

/// Returns the columns of the rows of loops. The vectors of a loop are its edges; text has the number of edges in
/// contact in their place.
fn loops() -> Vec<Field<'static, CheckRow>> {
    let contact = |row: &CheckRow| row.contact.as_ref().map_or(Cell::absent(), |contact| contact.edges.into());
    let from = |row: &CheckRow| row.contact.as_ref().map_or(Cell::absent(), |contact| contact.late.from_edge.into());
    let reached = |row: &CheckRow| row.contact.as_ref().map_or(Cell::absent(), |contact| contact.late.reached.into());
    let remark = |row: &CheckRow| match &row.contact {
        Some(Contact { late: Late { reached: None, .. }, .. }) => " wall not reached".to_string(),
        Some(Contact { late: Late { from_edge: from @ 1.., .. }, .. }) => format!(" from edge {from}"),
        _ => String::new(),
    };
    let mut fields = vec![
        Column::text("wiring", "loop").least(22).of(|row: &CheckRow| row.block.clone()),
        Column::text("scene", "scene").least(30).of(|row: &CheckRow| row.variant.clone()),
        Column::integer("vectors", "").data().of(|row: &CheckRow| row.vectors),
        Column::integer("contact_edges", "in contact").least(10).of(contact),
        Column::integer("from_edge", "").data().of(from),
        Column::integer("wall_reached_at_edge", "").data().of(reached),
    ];
    fields.extend(figures());
    fields.push(Column::text("", "").said().of(remark));
    fields
}

/// Returns the columns that blocks and loops have alike.
fn figures() -> impl Iterator<Item = Field<'static, CheckRow>> {
    let first = |row: &CheckRow| {
        row.first.as_ref().map(|first| {
            let (columns, history) = first.around.table(first.row);
            json!({
                "row": first.row,
                "signal": first.signal,
                "expected": first.expected,
                "got": first.got,
                "columns": columns,
                "history": history,
            })
        })
    };
    let figures = [
        Column::flag("ok", "").data().of(CheckRow::ok),
        Column::integer("edges", "edges").least(10).of(|row: &CheckRow| row.edges),
        Column::integer("mismatches", "mismatches").least(10).of(|row: &CheckRow| {
            let cell = Cell::new(row.mismatches);
            if row.ok() { cell } else { cell.good(false) }
        }),
        Column::number("seconds", "s")
            .least(8)
            .of(|row: &CheckRow| Cell::new(row.seconds).shown(format!("{:.2}", row.seconds))),
        Column::text("first", "").data().of(first),
        Column::text("failure", "").data().of(|row: &CheckRow| row.failure.clone()),
    ];
    figures.into_iter().chain(coverage::fields())
}

fn total(report: &CheckReport, of: &str) -> String {
    let sum = |value: fn(&CheckRow) -> u64| report.all().map(value).sum::<u64>();
    let failed = report.all().filter(|row| !row.ok()).count();
    let said =
        if failed == 0 { "all agree".to_string() } else { format!("{failed} of {} differ", report.all().count()) };
    format!(
        "{said}: {} vectors, {} edges, {} mismatches; {of}\n",
        // Every edge of a loop is compared, so loops have no vectors.
        report.rows.iter().map(|row| row.vectors).sum::<u64>(),
        sum(|row| row.edges),
        sum(|row| row.mismatches)
    )
}

/// Returns the page of a comparison: the sums, then the rows of blocks and of loops.
fn page(report: &CheckReport, hdl: &impl ToString) -> Page {
    let mut page = Page::default();
    page.data("ok", report.ok()).fact("hdl", "VHDL", hdl.to_string(), hdl.to_string());
    page.line("result", total(report, "").trim_end().trim_end_matches(';'));
    if !report.rows.is_empty() {
        page.table(Table::of("", &report.rows, fields("block", "variant")));
    }
    page.table(Table::of("loops", &report.loops, loops()));
    page
}

fn object(report: &CheckReport, hdl: &str) -> Value {
    let names = report.rows.iter().map(|row| &row.block).fold(Vec::new(), |mut names: Vec<&String>, name| {
        if !names.contains(&name) {
            names.push(name);
        }
        names
    });
    let blocks = names.into_iter().map(|name| {
        let rows: Vec<_> = report.rows.iter().filter(|row| row.block == *name).collect();
        let sum = |value: fn(&CheckRow) -> u64| rows.iter().map(|row| value(row)).sum::<u64>();
        json!({
            "name": name,
            "ok": rows.iter().all(|row| row.ok()),
            "vectors": sum(|row| row.vectors),
            "edges": sum(|row| row.edges),
            "mismatches": sum(|row| row.mismatches),
            "variants": Table::of("", rows, fields("", "")).json(),
        })
    });
    json!({
        "ok": report.ok(),
        "hdl": hdl,
        "blocks": blocks.collect::<Vec<_>>(),
        "loops": Table::of("", &report.loops, loops()).json(),
    })
}
