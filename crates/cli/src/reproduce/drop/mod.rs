//! `hpu reproduce`, two of its studies: run the published drop test again.

mod json;
mod trials;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use hpu_chart::{self as chart, Picture};
use hpu_cosim::Control;
use hpu_cosim::scene::{Direction, Platform};
use hpu_farm::{UnitResult, typed, units};
use hpu_papers::Error;
use hpu_papers::phantom::{self as study, Class, Outcomes, RUNGS, Rung, Study, Tables, Trial, TrialSetup, ladder};
use json::Interrupted;

use crate::command::{CommandLine, out_option};
use crate::journal;
use crate::page::give;
use crate::scene::{self, set_options};
use crate::shell::values::value;
use crate::shell::{Exit, Failure, Folder, Jobs, interrupt, with_progress};
use crate::work::Rows;

pub use trials::Trials;

/// Which trials of the drop test.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    set: scene::Set,
    /// Along these axes
    #[arg(long, value_name = "XYZ", default_value = "xyz", value_parser = axes)]
    axes: Axes,
    /// On these platforms, as in PMOS-1,RTOS-20,FPGA-400 [default: all eight]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = platform)]
    platforms: Vec<Platform>,
    /// Against walls of these stiffnesses in N/m, as in 250,500 [default: 20 from 5 to 40000]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = stiffness)]
    stiffness: Vec<f64>,
    /// Seeds at which a cell near a boundary is run, from run.seed on; the other cells are run at the first alone
    #[arg(
        long, value_name = "N", default_value_t = study::SEEDS,
        value_parser = clap::value_parser!(u64).range(1..=1000)
    )]
    seeds: u64,
    /// Trials of each cell at a seed
    #[arg(
        long, value_name = "N", default_value_t = study::TRIALS,
        value_parser = clap::value_parser!(u64).range(1..=1000)
    )]
    trials: u64,
    /// Show the trials that a sweep has gathered in this folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["set", "axes", "platforms", "stiffness", "seeds", "trials"])]
    from: Option<PathBuf>,
    #[command(flatten)]
    jobs: Jobs,
    /// Write table, trials and pictures into this folder, and go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// The key of the scene that holds the first seed.
const SEED: &str = "run.seed";

/// The studies of the drop test.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// Table 2 of Sevcik et al. (2009).
    Table2,
    /// The same table with models of ever more physics.
    Ladder,
}

impl Name {
    fn rungs(self) -> &'static [Rung] {
        match self {
            Self::Table2 => &[Rung::SHIPPED],
            Self::Ladder => &RUNGS,
        }
    }

    /// Returns the name on the command line.
    pub fn text(self) -> &'static str {
        match self {
            Self::Table2 => study::TABLE_2,
            Self::Ladder => study::LADDER,
        }
    }
}

#[derive(Clone)]
struct Axes(Vec<Direction>);

fn axes(text: &str) -> Result<Axes, Failure> {
    let axes: Vec<_> = Direction::ALL.into_iter().filter(|axis| text.contains(axis.name())).collect();
    let is_read = !axes.is_empty() && text.chars().all(|letter| "xyz".contains(letter));
    value(is_read.then_some(Axes(axes)), "write some of x, y, z, as in xz")
}

fn platform(text: &str) -> Result<Platform, Failure> {
    let named = Platform::ALL.into_iter().find(|platform| platform.name().eq_ignore_ascii_case(text));
    value(named, &format!("it is none of {}", Platform::ALL.map(Platform::name).join(", ")))
}

fn stiffness(text: &str) -> Result<f64, Failure> {
    let number = text.parse::<f64>().ok().filter(|stiffness| stiffness.is_finite() && *stiffness > 0.0);
    value(number, "write numbers of N/m above 0")
}

impl Args {
    /// Returns the folder of the sweep to show, if nothing is to be run.
    pub fn from(&self) -> Option<&Path> {
        self.from.as_deref()
    }

    fn study(&self, name: Name) -> Result<Study, Failure> {
        let mut study =
            Study { axes: self.axes.0.clone(), seeds: self.seeds, trials: self.trials, ..Study::whole(name.rungs()) };
        if !self.platforms.is_empty() {
            // In the paper's order, each once.
            study.platforms.retain(|platform| self.platforms.contains(platform));
        }
        if !self.stiffness.is_empty() {
            study.stiffnesses_n_per_m.clone_from(&self.stiffness);
            study.stiffnesses_n_per_m.sort_by(f64::total_cmp);
            study.stiffnesses_n_per_m.dedup();
        }
        study.set.clone_from(&self.set.set);
        study.first_seed = study::scene().parse(&study.set).map_err(Failure::file)?.run.seed;
        study.set.retain(|(key, _)| key != SEED);
        if let Some((key, _)) = study.set.iter().find(|(key, _)| Study::OWN_KEYS.contains(&key.as_str())) {
            let said =
                format!("--set {key}: the study sets that itself; see --axes, --platforms, --stiffness and --trials");
            return Err(Failure::usage(said));
        }
        // An error in any cell must be reported before the first cell is run.
        for point in study.points().iter().filter(|point| (point.seed, point.trial) == (study.first_seed, 1)) {
            study::scene().parse(&study.overrides(point)).map_err(Failure::file)?;
        }
        Ok(study)
    }

    /// Returns the command, without options that change no row.
    fn command(&self, name: Name, study: &Study) -> String {
        let whole = Study::whole(name.rungs());
        let axes: String = study.axes.iter().map(|axis| axis.name()).collect();
        let names: Vec<_> = study.platforms.iter().map(|platform| platform.name()).collect();
        let rows: Vec<_> = study.stiffnesses_n_per_m.iter().map(f64::to_string).collect();
        let seed = format!("{SEED}={}", study.first_seed);
        let options = [
            ("--axes", study.axes != whole.axes, axes),
            ("--platforms", study.platforms != whole.platforms, names.join(",")),
            ("--stiffness", study.stiffnesses_n_per_m != whole.stiffnesses_n_per_m, rows.join(",")),
            ("--seeds", study.seeds != whole.seeds, study.seeds.to_string()),
            ("--trials", study.trials != whole.trials, study.trials.to_string()),
            ("--set", study.first_seed != whole.first_seed, seed),
        ];
        let differing = options.into_iter().filter(|(_, differs, _)| *differs);
        let command = CommandLine::new(&format!("reproduce {}", name.text()));
        differing.fold(command, |command, (option, _, value)| command.plain(option, [value])).set(&study.set).text()
    }
}

/// Runs `hpu reproduce` for the drop test.
pub fn run(name: Name, args: &Args) -> Result<Exit, Failure> {
    let trials = Trials::of(name, args)?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let overrides = trials.overrides_at_first_seed();
    let parts = overrides.iter().map(String::as_bytes);
    let (count, header) = (trials.points.len(), ("study", &*trials.command));
    let (mut journal, done) = journal::resume(args.out.as_deref(), count, header, parts)?;
    finish(trials, args, folder, done, |place, row| journal.add(place, row))
}

/// Shows the trials that a sweep has gathered, as `args` ask for.
pub fn gathered(trials: Trials, args: &Args, rows: Rows) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    finish(trials, args, folder, typed(rows), |_, _| Ok(()))
}

/// Runs the trials that are not done, and shows the tables; every new row goes through `keep`.
fn finish(
    trials: Trials,
    args: &Args,
    folder: Option<Folder>,
    done: BTreeMap<usize, UnitResult<Trial>>,
    keep: impl FnMut(usize, &UnitResult<Trial>) -> Result<(), Failure>,
) -> Result<Exit, Failure> {
    let mut outcomes = outcomes(done);
    fill(&trials, args, &mut outcomes, interrupt::heed(), keep)?;
    let Trials { name, study, points, mut command } = trials;
    let left = study.wanted(&outcomes).len();
    if left > 0 {
        let stopped = Interrupted { study: name.text(), done: outcomes.len(), left, out: args.out.clone() };
        return stopped.tell(args.json);
    }
    let tables: Vec<Tables> = (0..study.rungs.len()).map(|rung| Tables::new(&study, rung, &outcomes)).collect();
    command += &out_option(args.out.as_deref());
    let result = Outcome { name: name.text(), study, points, outcomes, tables, command };
    let (text, files) = result.files(name);
    give((&text, json::object(&result)), folder, args.json, || Ok((files, result.pictures(name))))?;
    Ok(Exit::when(result.tables.iter().all(|table| table.failures().is_empty())))
}

/// Runs trials until none is wanted or the study is stopped: first every cell at the first seed, then the cells that
/// turn out to be near a boundary at the other seeds.
fn fill(
    trials: &Trials,
    args: &Args,
    outcomes: &mut Outcomes,
    control: &'static Control,
    mut keep: impl FnMut(usize, &UnitResult<Trial>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    while !control.stop.load(Ordering::Relaxed) {
        let wanted = trials.study.wanted(outcomes);
        if wanted.is_empty() {
            break;
        }
        with_progress(wanted.len() as u64, "trials", control, || {
            units::run_some(
                &wanted,
                args.jobs.get(),
                control,
                |place, control| trials.trial(place, control),
                |place, row| {
                    keep(place, &row)?;
                    outcomes.insert(place, row.map_err(Error::from));
                    Ok::<(), Failure>(())
                },
            )
        })?;
    }
    Ok(())
}

/// Reads the trials of these rows.
fn outcomes(rows: BTreeMap<usize, UnitResult<Trial>>) -> Outcomes {
    rows.into_iter().map(|(place, row)| (place, row.map_err(Error::from))).collect()
}

/// A complete study.
pub struct Outcome {
    /// Its name.
    pub name: &'static str,
    /// The study that was run.
    pub study: Study,
    /// All trials that might have been run.
    points: Vec<TrialSetup>,
    /// The result of each trial that was run.
    pub outcomes: Outcomes,
    /// The tables of each rung.
    pub tables: Vec<Tables>,
    /// The command that ran the study.
    pub command: String,
}

impl Outcome {
    fn summaries(&self) -> Vec<ladder::Summary> {
        let rungs = self.study.rungs.iter().zip(&self.tables);
        rungs.map(|(rung, tables)| ladder::Summary::new(*rung, tables.clone())).collect()
    }

    /// Returns the text to print, and the files.
    fn files(&self, name: Name) -> (String, Vec<(String, String)>) {
        let head = format!("{} drop test of Sevcik et al. 2009\n$ {}\n\n", study::DEVICE, self.command);
        let tail = format!("\nOne of these trials again:\n$ {}\n", self.replay());
        let cells = ("cells.csv".to_string(), study::csv(&self.study, &self.outcomes));
        match name {
            Name::Table2 => {
                let text = format!("{head}{}{tail}", study::table_text(&self.tables[0]));
                (text.clone(), vec![("table.txt".into(), text), cells])
            }
            Name::Ladder => {
                let summaries = self.summaries();
                let text = format!("{head}{}{tail}", ladder::ladder_text(&summaries));
                let tables = self.study.rungs.iter().zip(&self.tables);
                let tables = tables
                    .map(|(rung, tables)| format!("{}: {}\n\n{}\n", rung.name, rung.about, study::table_text(tables)));
                let tables = format!("{head}{}", tables.collect::<String>());
                let rungs = ("ladder.csv".to_string(), ladder::ladder_csv(&summaries));
                (text.clone(), vec![("ladder.txt".into(), text), rungs, ("table.txt".into(), tables), cells])
            }
        }
    }

    fn pictures(&self, name: Name) -> Vec<Picture> {
        match name {
            Name::Table2 => {
                vec![chart::table_2(&self.tables[0], &self.command), chart::rms(&self.tables[0], &self.command)]
            }
            Name::Ladder => vec![chart::ladder(&self.summaries(), &self.command)],
        }
    }

    /// Returns the command of one trial. Prefers a cell that differs from the printed table at every seed, then a cell
    /// that is not passive at some seed, then the first trial.
    pub fn replay(&self) -> String {
        let differs = |point: &&TrialSetup| {
            let tables = &self.tables[point.rung];
            let same = study::Agreement::at(tables, point.axis, point.platform, point.stiffness_n_per_m);
            same.is_some_and(|same| same.so == 0)
        };
        let moves = |point: &&TrialSetup| {
            let tally = self.tables[point.rung].cell(point.axis, point.platform, point.stiffness_n_per_m);
            tally.is_some_and(|tally| tally.class() != Some(Class::Passive))
        };
        let points = || self.outcomes.keys().map(|place| &self.points[*place]);
        let point = points().find(differs).or(points().find(moves)).or(points().next());
        point.map_or(String::new(), |point| {
            format!("hpu run {}{}", study::SCENE, set_options(&self.study.overrides(point)))
        })
    }
}
