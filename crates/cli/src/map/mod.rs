//! `hpu map`: runs a scene over two of its keys.

mod cells;
mod page;

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{self, BufWriter};
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use hpu_chart::{self as chart, Picture};
use hpu_cosim::SceneFile;
use hpu_cosim::scene::{Experiment, Loop};
use hpu_farm::{UnitResult, typed};
use hpu_study::map::{self as study, Axis, CellLimits, Curves, Found, Map, Method, Plan};

use crate::command::{CommandLine, out_option};
use crate::journal;
use crate::page::{Answer, show};
use crate::scene::{self, quoted, set_options};
use crate::shell::{Exit, Failure, Folder, Jobs, Watch, hdl, interrupt, values};
use crate::work::Rows;

pub use cells::Cells;

/// Run a scene over two of its keys, and draw what becomes of the motion
///
/// Runs lie along the boundaries between outcomes; cells within are inferred, and marked so. What is narrower than 4
/// cells and touches no boundary can be missed: --full runs every cell. With a folder, each cell is kept as it is done:
/// the same command goes on after an interruption, and --full goes on from a map without it. A cell that fails, or has
/// too many events, is a result and no failure. How long it takes is the cells that are run times the scene's own run,
/// over the cores: minutes for many cells or all methods. Progress tells the time left.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    #[arg(required_unless_present = "from")]
    scene: Option<String>,
    /// Key and values of the columns, as in 'wall.stiffness=0.1..3 N.m/rad:41:log' [default: 41 cells, lin]
    #[arg(long, value_name = "KEY=FROM..TO[:CELLS][:log|lin]", required_unless_present = "from")]
    x: Option<Axis>,
    /// Key and values of the rows
    #[arg(long, value_name = "KEY=FROM..TO[:CELLS][:log|lin]", required_unless_present = "from")]
    y: Option<Axis>,
    /// Show the map that a sweep has gathered in this folder, and run nothing
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "x", "y", "method", "all_methods", "set", "full"])]
    from: Option<PathBuf>,
    /// A layer of its own, as in '1khz:method.kind=conventional,method.sample_rate=1 kHz' [default: the scene's method]
    #[arg(long, value_name = "LABEL:KEY=VALUE,...")]
    method: Vec<Method>,
    /// A layer for every method there is, with constants that the device's own damping pays for
    #[arg(long)]
    all_methods: bool,
    #[command(flatten)]
    set: scene::Set,
    /// Run every cell
    #[arg(long)]
    full: bool,
    /// Events of a cell: clock cycles at which the engine looks at the loop, or steps of the solver. One with more has
    /// failed
    #[arg(
        long, value_name = "N", default_value_t = CellLimits::default().events,
        value_parser = clap::value_parser!(u64).range(1..)
    )]
    cell_events: u64,
    /// How long a cell may take. One that takes longer is not run: the same command runs it again
    #[arg(long, value_name = "TIME", default_value = "30min", value_parser = values::time)]
    cell_timeout: Duration,
    /// Let each cell that is run look on after its end for so long [default: 10s]: is it proved that it stays settled
    /// for ever, or repeats? Such cells have a mark in a corner
    #[arg(long, value_name = "TIME", num_args = 0..=1, require_equals = true, default_missing_value = "10s",
        value_parser = values::time, conflicts_with = "from")]
    for_ever: Option<Duration>,
    #[command(flatten)]
    jobs: Jobs,
    /// Write tables and pictures into this folder, and go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    hdl: hdl::Simulated,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Returns the folder of the sweep to show, if the map is not to be run.
    pub fn from(&self) -> Option<&Path> {
        self.from.as_deref()
    }

    /// Returns the scene as the command names it.
    fn scene(&self) -> &str {
        self.scene.as_deref().unwrap_or_default()
    }

    fn axes(&self) -> [&Axis; 2] {
        [&self.x, &self.y].map(|axis| axis.as_ref().expect("only --from stands without axes"))
    }

    fn limits(&self) -> CellLimits {
        CellLimits { events: self.cell_events, guard: self.cell_timeout, for_ever: self.for_ever }
    }

    /// Lets the simulators of designs of the user's own be found.
    fn provide(&self) -> Result<(), Failure> {
        hpu_cosim::dut::provide(self.hdl.simulators());
        Ok(())
    }

    /// Returns the command, without options that change no cell.
    fn command(&self) -> String {
        let [x, y] = self.axes();
        let method = |Method { label, set }: &Method| {
            let set: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
            format!("{label}:{}", set.join(","))
        };
        let command = CommandLine::new("map").words([self.scene()]).option("--x", [x]).option("--y", [y]);
        let command = command.option("--method", self.method.iter().map(method));
        let longest = self.for_ever.map(|longest| format!("--for-ever={}s", longest.as_secs_f64()));
        let command = command.words(longest.as_deref());
        command.flag("--all-methods", self.all_methods).set(&self.set.set).text()
    }

    /// Returns the other options that are needed to make the same map.
    fn options(&self) -> String {
        let full = if self.full { " --full" } else { "" };
        let events = self.cell_events;
        let is_usual = events == CellLimits::default().events;
        let events = if is_usual { String::new() } else { format!(" --cell-events {events}") };
        format!("{full}{events}{}", out_option(self.out.as_deref()))
    }

    /// Returns the map of a scene. `load` reads the data files that the scene names.
    fn map(
        &self,
        (name, text): (&str, &str),
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Map, Failure> {
        let mut methods = self.method.clone();
        if self.all_methods {
            let experiment = Experiment::parse(name, text, &self.set.set, load)?;
            let axis = experiment.axis().ok_or_else(|| Failure::usage("--all-methods: they are those of an axis"))?;
            if let Loop::Law(law) = axis.method.kind {
                return Err(Failure::usage(format!(
                    "--all-methods: {} has keys that other methods refuse; take a scene whose method is \"hybrid\" \
                     or \"conventional\"",
                    law.name()
                )));
            }
            methods.extend(Method::all(&axis));
        } else if methods.is_empty() {
            methods.push(Method { label: "scene".into(), set: Vec::new() });
        }
        let [x, y] = self.axes();
        let map = Map::new((name, text), &self.set.set, (x.clone(), y.clone()), methods, load)?;
        let scene = (0..map.len()).find_map(|index| map.experiment(map.point(index)).ok());
        scene.map_or(Ok(()), |scene| self.hdl.agree(&scene))?;
        Ok(map)
    }

    /// Runs the cells that are not `done`; every new row goes through `keep`. Calls `stopped` and returns `None` when
    /// the watch stopped it.
    fn fill(
        &self,
        map: Map,
        done: BTreeMap<usize, UnitResult<study::Cell>>,
        watch: Watch,
        keep: impl FnMut(usize, &UnitResult<study::Cell>) -> Result<(), Failure>,
        stopped: impl FnOnce(&Map) -> Result<(), Failure>,
    ) -> Result<Option<Mapped>, Failure> {
        let plan = Plan { full: self.full, limits: self.limits(), jobs: self.jobs.get() };
        let (found, curves) = thread::scope(|scope| {
            // The curves are computed beside the cells: after them, a single thread would work alone.
            let curves = scope
                .spawn(|| (0..map.methods.len()).map(|method| Curves::new(&map, method, watch.control())).collect());
            let left = (map.len() - done.len()) as u64;
            let found = watch.counted(left, "cells", || map.run(plan, done, watch.control(), keep))?;
            if found.is_none() {
                stopped(&map)?;
            }
            Ok::<_, Failure>((found, curves.join()))
        })?;
        let Some(found) = found else { return Ok(None) };
        let curves = curves.unwrap_or_else(|panic| resume_unwind(panic));
        let command = self.command() + &self.options();
        Ok(Some(Mapped { map, found, curves, command, scene: self.scene().to_string(), files: Vec::new() }))
    }
}

/// Returns the page and the pictures of a map of this scene; `None` when stopped.
pub fn answer(args: &Args, source: &SceneFile, watch: Watch) -> Result<Option<Answer>, Failure> {
    args.provide()?;
    let map = args.map((&source.name, &source.text), &mut |file: &str| source.load(file))?;
    let mapped = args.fill(map, BTreeMap::new(), watch, |_, _| Ok(()), |_| Ok(()))?;
    Ok(mapped.map(|mapped| Answer { page: page::page(&mapped), pictures: mapped.pictures() }))
}

/// A complete map.
pub(crate) struct Mapped {
    /// The map that was run.
    pub map: Map,
    /// The result of each cell.
    pub found: Vec<Found>,
    /// The curves of the criteria for each method, or the reason why there are none.
    pub curves: Vec<Result<Curves, hpu_study::Error>>,
    /// The command that made the map.
    pub command: String,
    /// The scene, as the command names it.
    pub scene: String,
    /// The files that were written.
    pub files: Vec<PathBuf>,
}

impl Mapped {
    /// Returns the command that runs a cell again.
    pub fn replay(&self, index: usize) -> String {
        let overrides = self.map.overrides(self.map.point(index));
        format!("hpu run {}{}", quoted(&self.scene), set_options(&overrides))
    }

    fn pictures(&self) -> Vec<Picture> {
        chart::map_pictures(&self.map, &self.found, &self.curves, &self.command)
    }

    fn write(&mut self, mut folder: Folder) -> Result<(), Failure> {
        let replay = |index: usize| self.replay(index);
        let csv = BufWriter::new(folder.create("map.csv")?);
        study::csv(csv, &self.map, &self.found, &self.command, replay)
            .map_err(|error| Failure::at(&folder.place("map.csv"), error))?;
        let parquet = folder.create("map.parquet")?;
        study::parquet(parquet, &self.map, &self.found, &self.command, replay)
            .map_err(|error| Failure::at(&folder.place("map.parquet"), error))?;
        self.pictures().iter().try_for_each(|picture| folder.draw(picture))?;
        self.files = folder.commit()?;
        Ok(())
    }
}

/// Runs `hpu map`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    args.provide()?;
    let source = scene::source(args.scene())?;
    let map = args.map((&source.name, &source.text), &mut |file: &str| source.load(file))?;
    let command = args.command();
    let events = args.cell_events.to_string();
    let files = map.scene.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
    let parts = [map.scene.text.as_bytes(), events.as_bytes()].into_iter().chain(files);
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let (mut journal, done) = journal::resume(args.out.as_deref(), map.len(), ("map", &command), parts)?;

    let kept = Cell::new(done.len());
    let keep = |index: usize, row: &UnitResult<study::Cell>| {
        kept.set(kept.get() + 1);
        journal.add(index, row)
    };
    let stopped = |map: &Map| {
        // The map is not drawn, so the curves are not needed.
        show(&page::interrupted(map, kept.get(), args.out.as_deref()), args.json)?;
        interrupt::end();
    };
    let mapped = args.fill(map, done, interrupt::watch(), keep, stopped)?;
    shown(mapped.expect("an interrupted map has ended"), folder, args.json)
}

/// Shows the map that a sweep has gathered, as `args` ask for. Cells that are missing are run: those that the guard
/// stopped.
pub fn gathered(args: &Args, Cells { args: own, map }: Cells, done: Rows) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let mapped = own.fill(map, typed(done), interrupt::watch(), |_, _| Ok(()), |_| interrupt::end())?;
    shown(mapped.expect("an interrupted map has ended"), folder, args.json)
}

fn shown(mut mapped: Mapped, folder: Option<Folder>, as_json: bool) -> Result<Exit, Failure> {
    if let Some(folder) = folder {
        mapped.write(folder)?;
    }
    show(&page::page(&mapped), as_json)?;
    Ok(Exit::Fine)
}
