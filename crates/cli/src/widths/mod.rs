//! `hpu widths`: the bits that every signal of a scene needs, and the effect of each bit.

mod cost;
mod design;
mod digits;
mod gappa;
mod page;
mod proved;
mod search;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use cost::{OneMore, one_more};
use hpu_chart::{Picture, ranges};
use hpu_cosim::scene::{DutScene, Experiment};
use hpu_rtl::{Cache, Setup};
use hpu_signal::Notation;
use hpu_study::widths::{Field, Measured, Recommended, by_range, measured, random, recommend, together};
use hpu_study::{ToldTables, device};
use proved::{Proved, proved};
use search::Asked;

use crate::command::CommandLine;
use crate::notation::Written;
use crate::page::{Answer, show};
use crate::parameters::stiffness_missed;
use crate::price::{self, Price};
use crate::scene::{self, Named};
use crate::shell::{Exit, Failure, Folder, Jobs, Remember, Watch, hdl, interrupt, values};
use crate::work::{Find, Rows};

/// Show what every signal of a scene needs, and what each bit buys
///
/// For every signal its format, the range measured in a run and the range proved for every motion within the device's
/// limits, idle upper bits, bits lost by rounding and by overflow, and signal over quantisation noise against the same
/// law in f64. For every width the least that keeps the scene's outputs within a tolerance, and what one bit less
/// breaks.
///
/// Measured ranges, `needs` and what --search finds hold for the motions of the scenes that are named; proved ranges
/// for every motion within the device's limits.
///
/// Of a design of your own, a scene with a [dut], the page shows its ports and the signals inside it: ranges, idle
/// upper bits, and whether one bit less would have wrapped in this run.
///
/// On two cores the page of hybrid-wall takes seconds, its --search half a minute, its --price up to 12 minutes the
/// first time.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scenes: files, or names of shipped scenes; of several, ranges together and the worst losses
    #[arg(required_unless_present = "from", value_name = "SCENE")]
    scenes: Vec<String>,
    /// Show the search whose runs a sweep has gathered in this folder
    #[arg(
        long, value_name = "DIR",
        conflicts_with_all = ["scenes", "set", "search", "random", "within", "no_trials", "tables", "gappa"]
    )]
    from: Option<PathBuf>,
    #[command(flatten)]
    set: scene::Set,
    #[command(flatten)]
    search: search::Search,
    /// Turn the encoders at random for so many seconds instead of running the scene; the loop is open
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds)]
    random: Option<f64>,
    /// Seed of the random motion
    #[arg(long, value_name = "N", default_value_t = 1, requires = "random")]
    seed: u64,
    /// The error that outputs may have with fewer bits, as in 1% [default: the scene's accuracy.within, else 1%]
    #[arg(long, value_name = "SHARE", value_parser = values::share, conflicts_with = "random")]
    within: Option<f64>,
    /// Try no fewer bits: ranges, losses and proofs alone
    #[arg(long)]
    no_trials: bool,
    /// Say what one bit more would cost, and what the loop costs as it is, by Yosys and nextpnr; what was measured is
    /// remembered
    #[arg(long)]
    price: bool,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    #[command(flatten)]
    remember: Remember,
    /// Add the tables of sines of an arm: other depths, other words and what could stand in their place; or the table
    /// of a crank: fewer rows, other words
    #[arg(long)]
    tables: bool,
    /// Print the straight-line parts of the proof as a script for Gappa, and nothing else; with --out as SCENE.g
    #[arg(long, conflicts_with_all = ["search", "random", "within", "price", "tables", "notation", "json"])]
    gappa: bool,
    #[command(flatten)]
    notation: Written,
    #[command(flatten)]
    jobs: Jobs,
    /// Write widths.txt, widths.csv, proved.csv, widths.json and the picture ranges into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// All contents of the page.
pub struct Widths {
    /// Names of the scenes.
    pub scenes: Vec<String>,
    /// Messages about scenes whose stiffness word misses the stiffness by far, with the format that would hold it.
    pub missed: Vec<String>,
    /// The frequency of the FPGA's clock.
    pub clock_hz: u64,
    /// Seconds and seed of the random motion, if there is one.
    pub random: Option<(f64, u64)>,
    /// The measured ranges and losses.
    pub measured: Measured,
    /// The proved ranges, or the reason why nothing is proved.
    pub proved: Result<Proved, String>,
    /// The recommended widths, or the reason why no widths were tried.
    pub recommended: Result<Recommended, String>,
    /// LUT4 and flip-flops that one more bit of each width costs, or the reason why this is unknown.
    pub one_more: Result<Vec<(Field, OneMore)>, String>,
    /// The tables of the device in other sizes, if they are asked for.
    pub tables: Option<ToldTables>,
    /// The cost of the loop as it is.
    pub price: Option<Price>,
    /// The notation that was asked for.
    pub notation: Option<Notation>,
    /// The command that makes the page.
    pub command: String,
    /// The files that were written.
    pub files: Vec<PathBuf>,
}

impl Args {
    /// Returns the folder of the sweep to show, if nothing is to be run.
    pub fn from(&self) -> Option<&Path> {
        self.from.as_deref()
    }

    /// Returns the arguments that a search takes beside its own.
    fn asked<'a>(&'a self, prices: Option<(&'a Cache, &'a Setup)>) -> Asked<'a> {
        let (jobs, out) = (self.jobs.get(), self.out.as_deref());
        Asked { scenes: &self.scenes, set: &self.set.set, within: self.within, jobs, prices, out, json: self.json }
    }

    /// Returns the runs of the search that these arguments ask for, as a sweep does them.
    pub fn waves(&self, find: Find) -> Result<search::Waves, Failure> {
        search::Waves::new(&self.search, &self.asked(None), find)
    }
}

/// What `hpu widths` is asked for.
enum Plan {
    /// The straight-line parts of the proof of a scene, for Gappa.
    Gappa(Box<Experiment>),
    /// The search for widths.
    Search,
    /// The page of these scenes.
    Page(Vec<Experiment>),
    /// The page of a design of the user's own.
    Design(Box<DutScene>),
}

impl Plan {
    fn new(args: &Args) -> Result<Self, Failure> {
        if args.search.search {
            return Ok(Self::Search);
        }
        if args.gappa || args.price {
            let option = if args.gappa { "--gappa" } else { "--price" };
            let [_] = &args.scenes[..] else { return Err(Failure::usage(format!("{option} takes one scene"))) };
        }
        let read = |name: &String| Ok(scene::source(name)?.parse(&args.set.set)?);
        let mut scenes = args.scenes.iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
        if let Some(at) = scenes.iter().position(|scene| matches!(scene, Experiment::Dut(_)))
            && let Experiment::Dut(scene) = scenes.swap_remove(at)
        {
            return Ok(Self::Design(Box::new(scene)));
        }
        Ok(if args.gappa { Self::Gappa(Box::new(scenes.remove(0))) } else { Self::Page(scenes) })
    }
}

/// Runs `hpu widths`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let plan = Plan::new(args)?;
    let setup = args.hdl.setup();
    let cache = if args.price { Some(args.remember.open(setup.timeout)?) } else { None };
    match plan {
        Plan::Gappa(scene) => gappa::run(&scene, args.out.as_deref()),
        Plan::Search => search::run(&args.search, &args.asked(cache.as_ref().map(|cache| (cache, &setup)))),
        Plan::Design(scene) => design::run(args, &scene),
        Plan::Page(scenes) => show_page(args, &scenes, cache.as_ref().map(|cache| (cache, &setup))),
    }
}

/// Shows the page of these scenes, with prices if there is a cache for them.
fn show_page(args: &Args, experiments: &[Experiment], prices: Option<(&Cache, &Setup)>) -> Result<Exit, Failure> {
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    let refused = |why| Failure::usage(format!("{}: {why}", experiments[0].name));
    let tables = args.tables.then(|| device(&experiments[0]).tables().map_err(refused)).transpose()?;
    let Some(mut found) = measure(args, experiments, interrupt::watch())? else { return Ok(Exit::Interrupted) };
    found.tables = tables;
    if let Some((cache, setup)) = prices
        && !price(&mut found, &experiments[0], (setup, cache), args.jobs.get())?
    {
        return Ok(Exit::Interrupted);
    }
    if let Some(folder) = &mut folder {
        folder.draw(&drawn(&found))?;
        let page = page::page(&found);
        folder.write("widths.txt", page.text())?;
        folder.write("widths.csv", page.tables().next().expect("its signals").csv(&[] as &[&str]))?;
        if let Ok(proved) = &found.proved {
            folder.write("proved.csv", proved.csv())?;
        }
        if let Some(tables) = &found.tables {
            folder.write("tables.csv", &tables.csv)?;
        }
        found.files = folder.places().map(PathBuf::from).chain([folder.place("widths.json")]).collect();
        folder.write("widths.json", format!("{:#}\n", page::page(&found).json()))?;
    }
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }
    if let Some(folder) = folder {
        folder.commit()?;
    }
    show(&page::page(&found), args.json)?;
    Ok(Exit::Fine)
}

/// Shows the search of `own`, whose runs a sweep has gathered, as `args` ask for.
pub fn gathered(args: &Args, own: Args, rows: Rows, find: Find) -> Result<Exit, Failure> {
    let setup = args.hdl.setup();
    let cache = if args.price { Some(args.remember.open(setup.timeout)?) } else { None };
    let own = Args { out: args.out.clone(), json: args.json, ..own };
    let asked = own.asked(cache.as_ref().map(|cache| (cache, &setup)));
    search::gathered(&own.search, &asked, rows, find)
}

/// Returns the page and the picture of these scenes, without prices, tables and search; `None` when stopped.
pub fn answer(args: &Args, scenes: &[Named], watch: Watch) -> Result<Option<Answer>, Failure> {
    let parsed = scenes.iter().map(|(_, source)| source.parse(&args.set.set));
    let found = measure(args, &parsed.collect::<Result<Vec<_>, _>>()?, watch)?;
    Ok(found
        .filter(|_| !watch.is_stopped())
        .map(|found| Answer { page: page::page(&found), pictures: vec![drawn(&found)] }))
}

/// Draws the ranges.
fn drawn(found: &Widths) -> Picture {
    let bounds = found.proved.as_ref().map_or(&[][..], |proved| &proved.bounds);
    let title = format!("{}: what words hold, and what was in them", found.scenes.join(", "));
    ranges(&title, &found.measured, bounds, &found.command)
}

/// Runs the scenes, and tries and proves their widths; `None` when interrupted.
fn measure(args: &Args, experiments: &[Experiment], watch: Watch) -> Result<Option<Widths>, Failure> {
    let control = watch.control();
    let mut runs = Vec::new();
    for (name, experiment) in args.scenes.iter().zip(experiments) {
        let run = || match args.random {
            Some(seconds) => random(experiment, seconds, args.seed, control),
            None => measured(experiment, control),
        };
        let found = watch.counted(experiment.edges(), "edges", run);
        match found.map_err(|why| Failure::file(format!("{name}: {why}")))? {
            Some(run) => runs.push(run),
            None => return Ok(None),
        }
    }
    let proved = match args.random {
        Some(_) => Err("a proof is of the scene's own hand, and random motion knows none".into()),
        None => proved(experiments, &runs).map_err(|why| why.to_string()),
    };
    let Some(recommended) = recommended(args, experiments, &runs, watch)? else { return Ok(None) };
    let mut measured = together(&args.scenes, runs).map_err(Failure::usage)?;
    for row in &mut measured.rows {
        row.recommended = match &recommended {
            Ok(found) => found.formats.iter().find(|(name, _)| *name == row.name).map(|(_, format)| *format),
            Err(_) => by_range(row.format, row.headroom_bits),
        };
    }
    Ok(Some(Widths {
        scenes: args.scenes.clone(),
        missed: experiments
            .iter()
            .filter_map(|experiment| Some(format!("{}: {}", experiment.name, stiffness_missed(experiment)?)))
            .collect(),
        clock_hz: experiments[0].clock.frequency_hz(),
        random: args.random.map(|seconds| (seconds, args.seed)),
        measured,
        proved,
        recommended,
        one_more: Err("not priced; --price asks Yosys".into()),
        tables: None,
        price: None,
        notation: args.notation.asked(),
        command: command(args),
        files: Vec::new(),
    }))
}

/// Puts prices on the page: of one more bit, and of the loop as it is. Returns false when interrupted.
fn price(
    page: &mut Widths,
    experiment: &Experiment,
    (setup, cache): (&Setup, &Cache),
    jobs: NonZeroUsize,
) -> Result<bool, Failure> {
    let Some(price) = price::price(experiment, setup, cache, jobs, interrupt::heed())? else { return Ok(false) };
    page.price = Some(price);
    if let Err(why) = device(experiment).priced() {
        page.one_more = Err(format!("not priced; {why}"));
        return Ok(true);
    }
    if page.recommended.is_err() {
        // The page has no place for it; the price has the scene's own keys.
        return Ok(true);
    }
    let Some(all) = one_more(experiment, setup, cache, jobs)? else { return Ok(false) };
    page.one_more = Ok(all);
    Ok(true)
}

/// Returns the recommended widths, or the reason why no widths were tried; `None` when interrupted.
fn recommended(
    args: &Args,
    experiments: &[Experiment],
    runs: &[Measured],
    watch: Watch,
) -> Result<Option<Result<Recommended, String>>, Failure> {
    if args.no_trials {
        return Ok(Some(Err("no fewer bits were tried (--no-trials)".into())));
    }
    if args.random.is_some() {
        return Ok(Some(Err("random motion has no outputs that a width could break".into())));
    }
    let jobs = args.jobs.get();
    let mut all: Option<Recommended> = None;
    for (experiment, run) in experiments.iter().zip(runs) {
        let within = args.within.unwrap_or(experiment.accuracy.within);
        let trials = || recommend(experiment, run, within, jobs, watch.control());
        match watch.counted(40, "runs", trials) {
            Err(why) => return Ok(Some(Err(why.to_string()))),
            Ok(None) => return Ok(None),
            Ok(Some(found)) => {
                all = Some(match all {
                    None => found,
                    Some(before) => before.and(found, &experiments[0]).map_err(Failure::file)?,
                });
            }
        }
    }
    Ok(all.map(Ok))
}

fn command(args: &Args) -> String {
    let command = CommandLine::new("widths").words(&args.scenes).set(&args.set.set).option("--random", args.random);
    let command = command.option("--seed", args.random.map(|_| args.seed)).option("--within", args.within);
    command.flag("--no-trials", args.no_trials).flag("--price", args.price).flag("--tables", args.tables).text()
}
