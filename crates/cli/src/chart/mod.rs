//! `hpu chart`: speed against accuracy.

mod map;
mod page;

use std::path::PathBuf;

use hpu_chart as chart;
use hpu_cosim::SceneFile;
use hpu_cosim::scene::Experiment;
use hpu_study::accuracy::{Chart, Entry, Plan, Race};
use hpu_study::map::Axis;

use crate::command::{CommandLine, out_option};
use crate::page::show;
use crate::scene::{self, quoted, set_options};
use crate::shell::{Exit, Failure, Folder, Jobs, hdl, interrupt, with_progress};

/// Chart speed against accuracy for every way to run a scene
///
/// The reference is the scene as it is written, from event to event. Errors are of the whole motion, many runs at a
/// time. Wall times are medians of runs one by one, in turn; long runs by edges or fixed steps are timed over the first
/// part of the motion and scaled to the whole, and the chart says so. A scene of 2 s at 50 MHz takes about a minute on
/// two cores. Over a map of two keys (--x, --y) the error is the share of cells with the wrong verdict.
/// Of a design of your own its simulators are charted.
/// To choose the least model within a tolerance: hpu fit.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    pub scene: String,
    /// Over a map: key and values of the columns, as in 'wall.stiffness=0.1..3 N.m/rad:21:log'
    #[arg(long, value_name = "KEY=FROM..TO[:CELLS][:log|lin]", requires = "y")]
    pub x: Option<Axis>,
    /// Over a map: key and values of the rows
    #[arg(long, value_name = "KEY=FROM..TO[:CELLS][:log|lin]", requires = "x")]
    pub y: Option<Axis>,
    /// Contestants or whole ladders of them, as in events,clock,rk4,euler@1us [default: all]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub contestants: Vec<String>,
    #[command(flatten)]
    pub set: scene::Set,
    #[command(flatten)]
    pub jobs: Jobs,
    #[command(flatten)]
    pub hdl: hdl::Simulated,
    /// Write table and picture into this folder; over a map, go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

impl Args {
    /// Returns the command, without the folder.
    pub fn command(&self) -> String {
        let command = CommandLine::new("chart").words([&self.scene]).option("--x", &self.x).option("--y", &self.y);
        let contestants = (!self.contestants.is_empty()).then(|| self.contestants.join(","));
        command.option("--contestants", contestants).set(&self.set.set).text()
    }

    /// Returns the race of the contestants that are to run the scene.
    pub fn race(&self, source: &SceneFile) -> Result<Race, Failure> {
        let mut load = |file: &str| source.load(file);
        hpu_cosim::dut::provide(self.hdl.simulators());
        let race = Race::new((&source.name, &source.text), &self.set.set, &self.contestants, &mut load)?;
        self.hdl.agree(&race.written)?;
        if let (Experiment::Dut(scene), Some(_)) = (&race.written, &self.x) {
            let why = "--x and --y: the scene has a design of yours, whose simulators have the same words in each cell";
            return Err(scene.error("dut", why).into());
        }
        Ok(race)
    }
}

/// A complete chart.
pub(crate) struct Charted {
    /// The contestants.
    pub race: Race,
    /// The result.
    pub chart: Chart,
    /// The command that made the chart.
    pub command: String,
    /// The scene, as the command names it.
    pub scene: String,
    /// The files that were written.
    pub files: Vec<PathBuf>,
}

impl Charted {
    /// Returns the command that runs a contestant again.
    pub fn replay(&self, entry: &Entry) -> String {
        format!("hpu run {}{}", quoted(&self.scene), set_options(&self.race.overrides(&entry.contestant)))
    }

    fn write(&mut self, mut folder: Folder) -> Result<(), Failure> {
        folder.write("chart.csv", page::page(self).tables().next().expect("its table").csv(&[&self.command]))?;
        folder.draw(&chart::speed(&self.race.written.name, &self.chart, &self.command))?;
        self.files = folder.commit()?;
        Ok(())
    }
}

/// Runs `hpu chart`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let source = scene::source(&args.scene)?;
    let race = args.race(&source)?;
    if let (Some(x), Some(y)) = (&args.x, &args.y) {
        return map::run(args, &source, race, (x.clone(), y.clone()));
    }
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let control = interrupt::heed();
    let plan = Plan::usual(args.jobs.get());
    let chart = with_progress(race.work(plan), "", control, || race.run(plan, control));
    let Some(chart) = chart.map_err(Failure::file)? else {
        show(&page::interrupted(&race), args.json)?;
        return Ok(Exit::Interrupted);
    };
    let command = args.command() + &out_option(args.out.as_deref());
    let mut charted = Charted { race, chart, command, scene: args.scene.clone(), files: Vec::new() };
    if let Some(folder) = folder {
        charted.write(folder)?;
    }
    show(&page::page(&charted), args.json)?;
    Ok(Exit::Fine)
}
