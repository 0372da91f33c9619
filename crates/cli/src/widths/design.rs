//! `hpu widths` of a design of the user's own: what its ports and the signals inside it held in one run.

use std::path::PathBuf;

use hpu_cosim::dut::{DutSimulation, Inside};
use hpu_cosim::scene::DutScene;
use hpu_cosim::{NetUse, Simulation, Summary};
use hpu_page::{Cell, Column, Page, Place, Table};
use hpu_signal::{Clock, Cycle, Format, Observe, Signal, UNKNOWN};
use hpu_study::map::outcome_name;
use hpu_study::widths::idle_bits;

use super::page::{first_time, span};
use super::{Args, command};
use crate::notation::triple;
use crate::page::show;
use crate::shell::{Exit, Failure, Folder, Watch, interrupt};
use crate::units::si;

/// The most words of the text without their constants.
const MOST: usize = 36;

/// What a word does with one bit less.
#[derive(Clone, Default)]
struct Narrowed {
    /// The format without its highest bit; `None` for a single bit.
    format: Option<Format>,
    /// The word at present, and since which edge.
    word: i64,
    since: u64,
    /// Edges at which the narrower word would have wrapped, and the first of them.
    wrapped: u64,
    first: Option<u64>,
}

impl Narrowed {
    fn of(signal: &Signal) -> Self {
        let format = signal.format;
        let narrower = Format::new(format.is_signed(), format.int() - 1, format.frac()).ok();
        Self { format: narrower, word: UNKNOWN, ..Self::default() }
    }

    /// Returns whether the narrower format does not hold the present word of a net.
    fn wraps(&self, net: &Signal) -> bool {
        let value = net.format.value(self.word);
        self.word != UNKNOWN && self.format.is_some_and(|format| !format.holds(value))
    }

    /// Takes the word after an edge.
    fn take(&mut self, net: &Signal, edge: u64, word: i64) {
        if word == self.word {
            return;
        }
        self.stand(net, edge);
        self.word = word;
        if self.wraps(net) {
            self.first.get_or_insert(edge);
        }
    }

    /// Counts the present word up to an edge.
    fn stand(&mut self, net: &Signal, edge: u64) {
        self.wrapped += if self.wraps(net) { edge - self.since } else { 0 };
        self.since = edge;
    }
}

/// Observes the words of a run with one bit less.
struct Watcher {
    nets: Vec<Signal>,
    narrowed: Vec<Narrowed>,
}

impl Observe for Watcher {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        for ((narrowed, net), &word) in self.narrowed.iter_mut().zip(&self.nets).zip(words) {
            narrowed.take(net, cycle.0, word);
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// A net of the page.
struct Row {
    net: NetUse,
    is_inside: bool,
    narrowed: Narrowed,
}

impl Row {
    fn width(&self) -> u32 {
        self.net.signal.format.width()
    }

    /// Returns the least and the greatest word; `None` where none was known.
    fn words(&self) -> Option<[i64; 2]> {
        let usage = self.net.usage;
        (usage.min <= usage.max).then_some([usage.min, usage.max])
    }

    fn values(&self) -> Option<[f64; 2]> {
        self.words().map(|words| words.map(|word| self.net.signal.format.to_f64(word)))
    }

    fn is_constant(&self) -> bool {
        self.words().is_none_or(|[min, max]| min == max)
    }
}

/// Refuses the options of a loop of `hpu`'s own blocks.
fn agree(args: &Args) -> Result<(), Failure> {
    let given = [
        ("--random", args.random.is_some()),
        ("--within", args.within.is_some()),
        ("--no-trials", args.no_trials),
        ("--price", args.price),
        ("--tables", args.tables),
        ("--gappa", args.gappa),
    ];
    let refused = given.into_iter().find(|(_, given)| *given).map(|(option, _)| {
        format!("{option}: a design of yours has no widths that hpu could change; its page is of one run as it is")
    });
    let several = (args.scenes.len() > 1).then(|| "a page of a design of yours takes one scene".to_string());
    refused.or(several).map_or(Ok(()), |why| Err(Failure::usage(why)))
}

/// Shows the page of a scene with a design.
pub(super) fn run(args: &Args, scene: &DutScene) -> Result<Exit, Failure> {
    agree(args)?;
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    let Some((mut page, table)) = measured(args, scene, interrupt::watch())? else { return Ok(Exit::Interrupted) };
    if let Some(folder) = &mut folder {
        folder.write("widths.txt", page.text())?;
        folder.write("widths.csv", table.csv(&[] as &[&str]))?;
        let files: Vec<_> = folder.places().map(PathBuf::from).chain([folder.place("widths.json")]).collect();
        page.data("files", &files);
        folder.write("widths.json", format!("{:#}\n", page.json()))?;
    }
    if let Some(folder) = folder {
        folder.commit()?;
    }
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

/// Runs a scene. Returns its page and the table of its signals; `None` when interrupted.
fn measured(args: &Args, scene: &DutScene, watch: Watch) -> Result<Option<(Page, Table)>, Failure> {
    let simulation = DutSimulation::new(scene, &args.hdl.simulators(), Inside::All)?;
    let nets = simulation.nets();
    let mut watcher = Watcher { narrowed: nets.iter().map(Narrowed::of).collect(), nets };
    let (mut trace, control) = (simulation.brief_trace(), watch.control());
    let run = || simulation.run(true, &mut trace, &mut watcher, control);
    let summary = watch.counted(simulation.edges(), "edges", run)?;
    if !summary.complete {
        return Ok(None);
    }
    let inside = simulation.wires().iter().map(|wire| wire.port.is_inside).chain([false]);
    let rows = summary.nets.iter().cloned().zip(inside).zip(watcher.narrowed);
    let rows = rows.map(|((net, is_inside), mut narrowed)| {
        narrowed.stand(&net.signal, summary.edges + 1);
        Row { net, is_inside, narrowed }
    });
    let rows: Vec<_> = rows.collect();
    let words = || rows.iter().filter(|row| row.width() > 1);
    let left_out = if words().count() > MOST { words().filter(|row| row.is_constant()).count() } else { 0 };
    let table = signals(args, &rows, (summary.edges, simulation.clock()), left_out > 0);
    Ok(Some((page(args, &simulation, &summary, &table, left_out), table)))
}

fn page(args: &Args, simulation: &DutSimulation, summary: &Summary, table: &Table, left_out: usize) -> Page {
    let scene = simulation.scene();
    let outcome = summary.outcome().map(|kind| outcome_name(Some(kind)));
    let (clock, motion) = (si(scene.clock.frequency_hz() as f64, "Hz"), si(summary.motion_s, "s"));
    let found = outcome.map_or(String::new(), |outcome| format!(": {}", outcome.replace('_', " ")));
    let mut page = Page::default();
    let (name, top, engine) = (&args.scenes[0], &scene.dut.top, simulation.engine());
    page.note(format!("{name}: {top} at {clock} by {engine}, {motion} in closed loop{found}\n$ {}", command(args)));
    page.data("scenes", &args.scenes).data("command", command(args)).data("design", &**top);
    page.data("engine", engine).data("edges", summary.edges).data("motion_s", summary.motion_s);
    page.data("outcomes", outcome.into_iter().collect::<Vec<_>>());
    page.note("").table(table.clone());
    if left_out > 0 {
        page.note(format!("not shown: {left_out} words that were constant"));
    }
    page.note(
        "\nmeasured, idle and one bit less are of this run alone: another hand, wall or gain may need more bits\n\
         idle: upper bits that no word of the run needed; one bit less: without the highest bit; wraps: it would have\n\
         changed the word, for this share of the edges, first at this time; single bits are not shown",
    );
    page
}

/// Returns the signals. Text leaves out single bits, and constants if there are many words.
fn signals(args: &Args, rows: &[Row], (edges, clock): (u64, Clock), no_constants: bool) -> Table {
    let notation = args.notation.get();
    let share = move |row: &Row| row.narrowed.wrapped as f64 / edges.max(1) as f64;
    let less = move |row: &Row| {
        let said = match (row.narrowed.format, row.narrowed.first) {
            (None, _) => String::new(),
            (Some(_), None) => "holds".to_string(),
            (Some(_), Some(first)) => {
                let percent = 100.0 * share(row);
                let share = if percent < 0.1 { "<.1%".to_string() } else { format!("{percent:.1}%") };
                format!("wraps: {share} {}", first_time(clock.seconds(Cycle(first))))
            }
        };
        Cell::new(row.narrowed.format.map(|_| row.narrowed.first.is_some())).shown(said)
    };
    let fields = [
        Column::text("name", "signal").least(11).file("signal").of(|row: &Row| row.net.signal.name),
        Column::text("format", "format")
            .least(9)
            .only(&[Place::Text, Place::File])
            .of(move |row: &Row| notation.of(row.net.signal.format)),
        Column::text("format", "").in_json().of(|row: &Row| triple(row.net.signal.format)),
        Column::flag("inside", "").data().of(|row: &Row| row.is_inside),
        Column::text("unit", "").data().of(|row: &Row| row.net.signal.unit),
        Column::text("measured", "measured").least(17).only(&[Place::Text, Place::Json]).of(|row: &Row| {
            let ends = row.values();
            Cell::new(ends).shown(ends.map_or(String::new(), |[min, max]| span(min, max)))
        }),
        Column::number("measured_min", "").in_files().of(|row: &Row| row.values().map(|ends| ends[0])),
        Column::number("measured_max", "").in_files().of(|row: &Row| row.values().map(|ends| ends[1])),
        Column::text("words", "").in_json().of(|row: &Row| row.words()),
        Column::integer("idle_bits", "idle").said().of(|row: &Row| idle_bits(&row.net)),
        Column::integer("idle_bits", "").data().of(|row: &Row| idle_bits(&row.net)),
        Column::text("one_bit_less", "one bit less").only(&[Place::Text]).of(less),
        Column::flag("one_bit_less_wraps", "")
            .data()
            .of(|row: &Row| row.narrowed.format.map(|_| row.narrowed.first.is_some())),
        Column::integer("one_bit_less_edges", "").data().of(|row: &Row| row.narrowed.wrapped),
        Column::number("one_bit_less_first_s", "")
            .data()
            .of(move |row: &Row| row.narrowed.first.map(|first| clock.seconds(Cycle(first)))),
    ];
    let untold = |row: usize| rows[row].width() < 2 || no_constants && rows[row].is_constant();
    Table::of("signals", rows, fields).gap(1).without(untold)
}
