//! `hpu widths SCENE --search`: finds the effect of the widths, on one machine or as a sweep.

mod axis;
mod device;
mod page;
mod phantom;
mod shown;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hpu_cosim::Control;
use hpu_cosim::scene::Experiment;
use hpu_farm::UnitResult;
use hpu_farm::{Points, Schema, typed, untyped};
use hpu_rtl::{Cache, Counts, Setup};
use hpu_study::Kind;
use hpu_study::map::SceneText;
use hpu_study::widths::search::{
    Design, Ended, Found, Knob, Plan, Progress, Ran, RatedDesign, schema, search, search_wave,
};
use page::page;

use crate::command::CommandLine;
use crate::journal;
use crate::page::show;
use crate::scene::{quoted, set_options};
use crate::shell::{Exit, Failure, Folder, interrupt, print, progress, values};
use crate::work::{Find, Rows, Take, Work, on_disk};

/// The options of a search beside the scene.
#[derive(clap::Args)]
pub struct Search {
    /// Search the widths of the loop for the front of stable stiffness, error of the outputs, and lookup tables
    #[arg(long)]
    pub search: bool,
    /// A width and its values, as in position_bits=8..16 or stiffness_format.frac=0..4, of an arm as in
    /// depth_bits=9..13 or trig.frac=14..22 [default: all but pwm.bits, of an arm tables, tip and forces, from some
    /// bits below the scene's own]
    #[arg(long, value_name = "KEY=FROM..TO", requires = "search")]
    vary: Vec<Knob>,
    /// Measure against a design of so many bits in position, gains and velocity [default: the widest of the search]
    #[arg(long, value_name = "BITS", requires = "search")]
    against: Option<i32>,
    /// Search on every SCENE under these changes too, as in wall.stiffness=2.5 or 'hand.stiffness=1; hand.damping=0';
    /// repeated, each by itself. A design's error is then the worst, its stable stiffness the least of all
    #[arg(long, value_name = "KEY=VALUE[; ...]", requires = "search", value_parser = changes)]
    also: Vec<Changes>,
    /// Take only designs whose position and velocity hold the range proved for every motion within the device's limits
    #[arg(long, requires = "search")]
    proved: bool,
    /// How much stable stiffness the smallest design may lose against the reference's
    #[arg(long, value_name = "SHARE", requires = "search", default_value = "1%", value_parser = values::share_or_none)]
    lose: f64,
}

/// Changes of a scene, with their text on the command line.
#[derive(Clone)]
struct Changes {
    set: Vec<(String, String)>,
    said: String,
}

fn changes(text: &str) -> Result<Changes, Failure> {
    let set: Result<Vec<_>, _> = text.split(';').map(|change| values::pair(change.trim())).collect();
    Ok(Changes { set: set?, said: text.split(';').map(str::trim).collect::<Vec<_>>().join("; ") })
}

/// A scene that every design runs on, with its name.
struct Case {
    name: String,
    text: SceneText,
    experiment: Experiment,
}

impl Search {
    /// Returns the scenes as they are, then all of them under each change.
    fn cases(&self, scenes: &[String], set: &[(String, String)], find: Find) -> Result<Vec<Case>, Failure> {
        let read = |name: &String, also: Option<&Changes>| -> Result<Case, Failure> {
            let source = find(name)?;
            let mut load = |file: &str| source.load(file);
            let set: Vec<_> = set.iter().chain(also.iter().flat_map(|also| &also.set)).cloned().collect();
            let (text, experiment) = SceneText::read((&source.scene.name, &source.scene.text), &set, &mut load)
                .map_err(|error| {
                    Failure::file(
                        also.map_or(String::new(), |also| format!("--also '{}': ", also.said)) + &error.to_string(),
                    )
                })?;
            let name = also.map_or(name.clone(), |also| format!("{name} with {}", also.said));
            Ok(Case { name, text, experiment })
        };
        let also = [None].into_iter().chain(self.also.iter().map(Some));
        also.flat_map(|also| scenes.iter().map(move |name| (name, also))).map(|(name, also)| read(name, also)).collect()
    }

    /// Returns the command with everything that the rows of a search depend on.
    fn command(&self, asked: &Asked) -> String {
        let command = CommandLine::new("widths").words(asked.scenes).set(asked.set).flag("--search", true);
        let command = command.option("--also", self.also.iter().map(|also| &also.said)).flag("--proved", self.proved);
        let command = command.plain("--vary", &self.vary).option("--against", self.against);
        command.option("--within", asked.within).text()
    }
}

/// A complete search.
struct Searched {
    /// The result.
    found: Found,
    /// The widths that were varied.
    knobs: Vec<Knob>,
    /// The largest error of a design's outputs.
    within: f64,
    /// The share of stiffness that the smallest design may lose.
    lose: f64,
    /// The command that made the search.
    command: String,
    /// The first scene, as the command names it, its overrides, and what they make.
    scene: String,
    set: Vec<(String, String)>,
    experiment: Experiment,
    /// Whether the words hold the proved range.
    proved: bool,
    /// Prices by Yosys: of the reference, and of the front's designs in their order.
    prices: Option<Prices>,
}

impl Searched {
    /// Returns the command that runs the scene with a design.
    fn replay(&self, point: &RatedDesign) -> String {
        let set: Vec<_> = self.set.iter().cloned().chain(point.design.set()).collect();
        format!("hpu run {}{}", quoted(&self.scene), set_options(&set))
    }

    /// Returns Yosys's primitives of the reference, or of a design that is on the front.
    fn price_of(&self, point: &RatedDesign) -> Option<Counts> {
        let (reference, front) = self.prices.as_ref()?;
        if point.design == self.found.reference.design {
            return Some(*reference);
        }
        self.found.best().position(|best| best == point).map(|place| front[place])
    }

    fn smallest(&self) -> Option<&RatedDesign> {
        self.found.smallest(self.lose)
    }
}

/// The verb's other arguments that a search takes.
pub struct Asked<'a> {
    /// The scenes, as the command names them.
    pub scenes: &'a [String],
    /// Their overrides.
    pub set: &'a [(String, String)],
    /// The largest error of a design's outputs, if the command gives it.
    pub within: Option<f64>,
    /// The number of threads.
    pub jobs: NonZeroUsize,
    /// The cache to price the front with, and the settings for the VHDL.
    pub prices: Option<(&'a Cache, &'a Setup)>,
    /// The folder for tables and pictures.
    pub out: Option<&'a Path>,
    /// Whether one JSON object is wanted.
    pub json: bool,
}

/// Runs a search.
pub fn run(args: &Search, asked: &Asked) -> Result<Exit, Failure> {
    let Asked { scenes, set, .. } = *asked;
    let cases = args.cases(scenes, set, Arc::new(on_disk))?;
    finish(args, asked, &cases, None)
}

/// Runs a search on these scenes. `gathered` are the rows that a sweep has gathered.
fn finish(args: &Search, asked: &Asked, cases: &[Case], gathered: Option<Rows>) -> Result<Exit, Failure> {
    let Asked { scenes, set, jobs, out, .. } = *asked;
    let Case { text, experiment, .. } = cases.first().ok_or_else(|| Failure::usage("--search takes a scene"))?;
    device(experiment).accepts(args, asked)?;
    if asked.prices.is_some() {
        let priced = hpu_study::device(experiment).priced();
        priced.map_err(|why| Failure::usage(format!("{}: {why}; leave out --price", scenes[0])))?;
    }
    let within = asked.within.unwrap_or(experiment.accuracy.within);
    let knobs = if args.vary.is_empty() { Knob::usual(experiment) } else { args.vary.clone() };
    let mut command = args.command(asked);
    let folder = out.map(Folder::open).transpose()?;
    let parts = cases.iter().flat_map(|Case { text, .. }| {
        let files = text.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
        [text.text.as_bytes()].into_iter().chain(files)
    });
    let (mut journal, done) = match gathered {
        // The rows of a sweep are kept in its own folder.
        Some(rows) => (journal::resume::<Ran>(None, 0, ("widths", &command), [])?.0, typed(rows)),
        None => journal::resume(out, usize::MAX, ("widths", &command), parts)?,
    };
    if args.lose != 0.01 {
        command += &format!(" --lose {}", args.lose);
    }
    let plan = Plan { against: args.against, within, proved: args.proved, jobs };
    let named_scenes = named(cases);
    let keep = |index, row: &_| journal.add(index, row);
    let ended = search(&named_scenes, &knobs, plan, done, interrupt::heed(), keep, |Progress { runs, open }| {
        progress::note(format!("{runs} runs; {open} kinds of designs are open"));
    });
    progress::note("");
    let found = match ended {
        Ok(found) => found,
        Err(Ended::Refused(error)) if error.kind() == Kind::Usage => return Err(Failure::usage(error)),
        Err(Ended::Refused(error)) => return Err(Failure::file(format!("{}: {error}", text.name))),
        Err(Ended::Kept(failure)) => return Err(failure),
        Err(Ended::Stopped | Ended::Wave(_)) => {
            let again = out.map_or("begins anew", |_| "goes on from here");
            print(&format!("interrupted; the same command {again}\n"))?;
            return Ok(Exit::Interrupted);
        }
    };
    let mut searched = Searched {
        found,
        knobs,
        within,
        lose: args.lose,
        command,
        scene: scenes[0].clone(),
        set: set.to_vec(),
        experiment: experiment.clone(),
        proved: args.proved,
        prices: None,
    };
    if let Some((cache, setup)) = &asked.prices {
        searched.prices = price(text, &searched, cache, setup)?;
        if searched.prices.is_none() {
            return Ok(Exit::Interrupted);
        }
    }
    let mut page = page(&searched);
    let files = folder.map(|folder| write(&searched, &page.text(), folder)).transpose()?.unwrap_or_default();
    page.data("files", files);
    show(&page, asked.json)?;
    Ok(Exit::Fine)
}

fn named(cases: &[Case]) -> Vec<(String, Experiment)> {
    cases.iter().map(|case| (case.name.clone(), case.experiment.clone())).collect()
}

/// Shows the search whose runs a sweep has gathered.
pub fn gathered(args: &Search, asked: &Asked, rows: Rows, find: Find) -> Result<Exit, Failure> {
    let cases = args.cases(asked.scenes, asked.set, find)?;
    finish(args, asked, &cases, Some(rows))
}

/// The runs of a search, wave by wave, as a sweep does them.
pub struct Waves {
    command: String,
    cases: Vec<Case>,
    scenes: Vec<(String, SceneText)>,
    knobs: Vec<Knob>,
    plan: Plan,
}

impl Waves {
    /// Returns the runs of a search.
    pub fn new(args: &Search, asked: &Asked, find: Find) -> Result<Self, Failure> {
        if !args.search {
            return Err(Failure::usage("a sweep can split a search over widths alone: write `search = true`"));
        }
        let cases = args.cases(asked.scenes, asked.set, find)?;
        let base = &cases.first().ok_or_else(|| Failure::usage("--search takes a scene"))?.experiment;
        device(base).accepts(args, asked)?;
        let scenes = asked.scenes.iter().zip(&cases).map(|(name, case)| (name.clone(), case.text.clone())).collect();
        let knobs = if args.vary.is_empty() { Knob::usual(base) } else { args.vary.clone() };
        let within = asked.within.unwrap_or(base.accuracy.within);
        let plan = Plan { against: args.against, within, proved: args.proved, jobs: NonZeroUsize::MIN };
        Ok(Self { command: args.command(asked), cases, scenes, knobs, plan })
    }

    fn part(
        &self,
        done: Rows,
        part: &[usize],
        control: &Control,
        mut take: impl FnMut(usize, &UnitResult<Ran>) -> Result<(), Failure>,
    ) -> Result<Vec<usize>, Failure> {
        match search_wave(&named(&self.cases), &self.knobs, self.plan, typed(done), part, control, &mut take) {
            Ok(_) | Err(Ended::Stopped) => Ok(Vec::new()),
            Err(Ended::Wave(left)) => Ok(left),
            Err(Ended::Kept(failure)) => Err(failure),
            Err(Ended::Refused(error)) => Err(Failure::file(error)),
        }
    }
}

impl Work for Waves {
    fn schema(&self) -> Schema {
        schema()
    }

    fn meanings(&self) -> Vec<(String, String)> {
        let meanings = [
            ("settled", "whether the run settled"),
            ("error", "of the outputs, relative to the reference's; inf where the outcome is another"),
            ("needed_bits_0", "bits of the first word that only holds the run's values, as position"),
            ("needed_bits_1", "bits of the second such word, as velocity"),
        ];
        meanings.map(|(key, meaning)| (key.to_string(), meaning.to_string())).into()
    }

    fn command(&self) -> String {
        self.command.clone()
    }

    fn scenes(&self) -> Vec<(String, SceneText)> {
        self.scenes.clone()
    }

    fn is_adaptive(&self) -> bool {
        true
    }

    fn next(&self, done: Rows, control: &Control) -> Result<Points, Failure> {
        Ok(Points::of(self.part(done, &[], control, |_, _| Ok(()))?.into_iter().map(|run| run as u64)))
    }

    fn run(&self, done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure> {
        self.part(done, points, control, |index, row| take(index, untyped(row))).map(drop)
    }
}

/// Primitives of the reference, and of the front in its order.
type Prices = (Counts, Vec<Counts>);

/// Returns Yosys's primitives of the reference and of the front; `None` when interrupted.
fn price(text: &SceneText, searched: &Searched, cache: &Cache, setup: &Setup) -> Result<Option<Prices>, Failure> {
    let counts = |design: &Design| -> Result<Counts, Failure> {
        let set: Vec<_> = searched.set.iter().cloned().chain(design.set()).collect();
        let experiment = text.parse(&set).map_err(Failure::file)?;
        let block = device(&experiment).block(experiment)?;
        Ok(cache.counts(&*block, setup)?)
    };
    let mut front = Vec::new();
    for point in searched.found.best() {
        front.push(counts(&point.design)?);
        if interrupt::pressed() {
            return Ok(None);
        }
    }
    Ok(Some((counts(&searched.found.reference.design)?, front)))
}

fn write(searched: &Searched, text: &str, mut folder: Folder) -> Result<Vec<PathBuf>, Failure> {
    folder.write("designs.csv", page::designs(searched))?;
    folder.write("search.txt", text)?;
    if let Some((errors, drawn)) = device(&searched.experiment).files(searched) {
        folder.write("error-by-width.csv", errors)?;
        drawn.iter().try_for_each(|picture| folder.draw(picture))?;
    }
    folder.commit()
}

/// Returns the device of a scene.
fn device(scene: &Experiment) -> &'static dyn device::Device {
    match scene {
        Experiment::Phantom(_) => &phantom::Phantom,
        _ => &axis::Axis,
    }
}
