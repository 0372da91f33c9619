//! `hpu widths SCENE --search`: which widths buy what.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use hpu_cosim::scene::{Experiment, Loop};
use hpu_datapath::{AnyBlock, ConventionalLoop, HybridLoop};
use hpu_rtl::{Cache, Counts, Setup};
use hpu_study::chart::{error_by_width, stiffness_by_cost};
use hpu_study::map::SceneText;
use hpu_study::widths::search::{
    Design, Ended, Found, Knob, Plan, Point, Progress, Width, csv, errors_csv, phantom, search,
};

use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::journal;
use crate::scene::{self, quoted, set_options};
use crate::terminal::{print, print_json};
use crate::{interrupt, pictures, progress, widths_search_phantom, widths_search_text};

/// What a search takes beside the scene.
#[derive(clap::Args)]
pub struct Search {
    /// Search the widths of the loop for the front of stable stiffness, error of the outputs, and lookup tables
    #[arg(long)]
    pub search: bool,
    /// A width and its values, as in position_bits=8..16 or stiffness_format.frac=0..4, of a PHANToM as in
    /// depth_bits=9..13 or trig.frac=14..22 [default: all but pwm.bits, of a PHANToM tables, tip and forces, from some
    /// bits below the scene's own]
    #[arg(long, value_name = "KEY=FROM..TO", requires = "search")]
    vary: Vec<Vary>,
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
    #[arg(long, value_name = "SHARE", requires = "search", default_value = "1%", value_parser = share)]
    lose: f64,
}

/// Changes of a scene, and as they were written.
#[derive(Clone)]
struct Changes {
    set: Vec<(String, String)>,
    said: String,
}

fn changes(text: &str) -> Result<Changes, String> {
    let set: Result<Vec<_>, _> = text.split(';').map(|change| scene::pair(change.trim())).collect();
    Ok(Changes { set: set?, said: text.split(';').map(str::trim).collect::<Vec<_>>().join("; ") })
}

/// A width of either device.
#[derive(Clone)]
enum Vary {
    Axis(Knob),
    Phantom(phantom::Knob),
}

impl FromStr for Vary {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let key = text.split('=').next().unwrap_or(text).trim();
        let bare = key.strip_prefix("method.").unwrap_or(key);
        if phantom::FIELDS.into_iter().any(|field| phantom::key(field) == bare) {
            return text.parse().map(Self::Phantom);
        }
        let known = Width::ALL.into_iter().any(|width| width.key() == bare);
        let knob = text.parse::<Knob>();
        knob.map(Self::Axis).map_err(|why| match known || !text.contains('=') {
            true => why,
            false => format!("{why}; of a PHANToM one of {}", phantom::FIELDS.map(phantom::key).join(", ")),
        })
    }
}

impl Search {
    /// The widths of an axis that are named.
    fn of_an_axis(&self) -> Result<Vec<Knob>, Failure> {
        let knob = |vary: &Vary| match vary {
            Vary::Axis(knob) => Ok(*knob),
            Vary::Phantom(knob) => Err(Failure::usage(format!("--vary {knob}: an axis has no such width"))),
        };
        self.vary.iter().map(knob).collect()
    }

    /// The widths of a PHANToM that are named.
    fn of_a_phantom(&self, scenes: &[String]) -> Result<Vec<phantom::Knob>, Failure> {
        if scenes.len() > 1 || !self.also.is_empty() || self.proved {
            let why = "a search over a PHANToM's widths takes one scene, as it is; its page tells what is proved";
            return Err(Failure::usage(format!("{why}: leave out the other scenes, --also and --proved")));
        }
        if self.against.is_some() {
            return Err(Failure::usage("--against: the reference of a PHANToM is the widest design; widen a range"));
        }
        let knob = |vary: &Vary| match vary {
            Vary::Phantom(knob) => Ok(*knob),
            Vary::Axis(knob) => Err(Failure::usage(format!(
                "--vary {knob}: a PHANToM has no such width; write one of {}",
                phantom::FIELDS.map(phantom::key).join(", ")
            ))),
        };
        self.vary.iter().map(knob).collect()
    }
}

/// A scene that every design runs on, by its name.
struct Case {
    name: String,
    text: SceneText,
    experiment: Experiment,
}

impl Search {
    /// The scenes as they are, then all of them under each change.
    fn cases(&self, scenes: &[String], set: &[(String, String)]) -> Result<Vec<Case>, Failure> {
        let read = |name: &String, also: Option<&Changes>| -> Result<Case, Failure> {
            let source = scene::source(name)?;
            let mut load = |file: &str| source.load(file);
            let set: Vec<_> = set.iter().chain(also.iter().flat_map(|also| &also.set)).cloned().collect();
            let (text, experiment) =
                SceneText::read((&source.name, &source.text), &set, &mut load).map_err(|error| {
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

    /// The command of all that rows of a search depend on.
    fn command(&self, asked: &Asked, named: &[Knob]) -> String {
        let scenes: Vec<String> = asked.scenes.iter().map(|scene| quoted(scene)).collect();
        let mut command = format!("hpu widths {}{} --search", scenes.join(" "), set_options(asked.set));
        command.extend(self.also.iter().map(|also| format!(" --also {}", quoted(&also.said))));
        command += if self.proved { " --proved" } else { "" };
        command.extend(named.iter().map(|knob| format!(" --vary {knob}")));
        command += &self.against.map_or(String::new(), |bits| format!(" --against {bits}"));
        command + &asked.within.map_or(String::new(), |within| format!(" --within {within}"))
    }
}

fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = text.trim().strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let share = number.trim().parse::<f64>().ok().map(|number| number * unit);
    share.filter(|share| (0.0..1.0).contains(share)).ok_or_else(|| "write a share below 1, as in 1% or 0.01".into())
}

/// A search that is through.
pub struct Searched {
    /// What was found.
    pub found: Found,
    /// The widths that were varied.
    pub knobs: Vec<Knob>,
    /// How much the outputs of a design may be off.
    pub within: f64,
    /// How much stiffness the smallest design may lose.
    pub lose: f64,
    /// The command that made it.
    pub command: String,
    /// The first scene, as it was named, and its overrides.
    pub scene: String,
    set: Vec<(String, String)>,
    /// Whether the words hold the range proved.
    pub proved: bool,
    /// By Yosys: the reference, and the designs of the front in its order.
    pub prices: Option<Prices>,
}

impl Searched {
    /// The command that runs the scene with a design.
    pub fn replay(&self, point: &Point) -> String {
        let set: Vec<_> = self.set.iter().cloned().chain(point.design.set()).collect();
        format!("hpu run {}{}", quoted(&self.scene), set_options(&set))
    }

    /// What Yosys makes of the smallest design.
    pub fn price_of(&self, point: &Point) -> Option<Counts> {
        let place = self.found.best().position(|best| best == point)?;
        self.prices.as_ref().map(|(_, front)| front[place])
    }
}

/// What a search takes of the verb's other arguments.
pub struct Asked<'a> {
    /// The scenes, as they were named.
    pub scenes: &'a [String],
    /// Their overrides.
    pub set: &'a [(String, String)],
    /// How much the outputs of a design may be off, if it is said.
    pub within: Option<f64>,
    /// Threads.
    pub jobs: NonZeroUsize,
    /// A cache to price the front with, and the folder of the VHDL.
    pub prices: Option<(&'a Cache, &'a Setup)>,
    /// Where tables and pictures go.
    pub out: Option<&'a Path>,
    /// Whether one JSON object is wanted.
    pub json: bool,
}

/// Searches.
pub fn run(args: &Search, asked: &Asked) -> Result<Exit, Failure> {
    let Asked { scenes, set, jobs, out, .. } = *asked;
    let cases = args.cases(scenes, set)?;
    let Case { text, experiment, .. } = cases.first().ok_or_else(|| Failure::usage("--search takes a scene"))?;
    let name = &scenes[0];
    let within = asked.within.unwrap_or(experiment.accuracy().within);
    if let Experiment::Phantom(base) = experiment {
        return widths_search_phantom::run((text, base), args.of_a_phantom(scenes)?, within, args.lose, asked);
    }
    let named = args.of_an_axis()?;
    let mut knobs = named.clone();
    if let (true, Some(axis)) = (knobs.is_empty(), experiment.clone().axis()) {
        knobs = Knob::usual(&axis);
    }
    let mut command = args.command(asked, &named);
    let folder = out.map(Folder::open).transpose()?;
    let (mut journal, done) = journal::resume(out, usize::MAX, || {
        let parts = cases.iter().flat_map(|Case { text, .. }| {
            let files = text.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
            [text.text.as_bytes()].into_iter().chain(files)
        });
        journal::header("widths", parts, &command)
    })?;
    if args.lose != 0.01 {
        command += &format!(" --lose {}", args.lose);
    }
    let plan = Plan { against: args.against, within, proved: args.proved, jobs };
    let named_scenes: Vec<_> = cases.iter().map(|case| (case.name.clone(), case.experiment.clone())).collect();
    let keep = |index, row: &_| journal.as_mut().map_or(Ok(()), |journal| journal.add(index, row));
    let ended = search(&named_scenes, &knobs, plan, done, interrupt::heed(), keep, |Progress { runs, open }| {
        progress::note(format!("{runs} runs; {open} kinds of designs are open"));
    });
    progress::note("");
    let found = match ended {
        Ok(found) => found,
        Err(Ended::Refused(error)) => return Err(Failure::file(format!("{}: {error}", text.name))),
        Err(Ended::Kept(failure)) => return Err(failure),
        Err(Ended::Stopped) => {
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
        scene: name.clone(),
        proved: args.proved,
        set: set.to_vec(),
        prices: None,
    };
    if let Some((cache, setup)) = &asked.prices {
        searched.prices = price(text, &searched, cache, setup)?;
        if searched.prices.is_none() {
            return Ok(Exit::Interrupted);
        }
    }
    let files = folder.map(|folder| write(&searched, folder)).transpose()?.unwrap_or_default();
    if asked.json {
        print_json(&widths_search_text::object(&searched, &files))?
    } else {
        print(&widths_search_text::text(&searched))?
    }
    Ok(Exit::Fine)
}

/// LUT4s and all else of the reference, and of the front in its order.
type Prices = (Counts, Vec<Counts>);

/// What Yosys makes of the reference and of the front; `None` when interrupted.
fn price(text: &SceneText, searched: &Searched, cache: &Cache, setup: &Setup) -> Result<Option<Prices>, Failure> {
    let counts = |design: &Design| -> Result<Counts, Failure> {
        let set: Vec<_> = searched.set.iter().cloned().chain(design.set()).collect();
        let experiment = text.parse(&set).map_err(Failure::file)?;
        let scene = experiment.axis().ok_or_else(|| Failure::file("a PHANToM has no loop of these widths"))?;
        let config = scene.words().map_err(Failure::file)?.config;
        let block: Box<dyn AnyBlock> = match scene.method.kind {
            Loop::Conventional => Box::new(ConventionalLoop::new(config).map_err(Failure::file)?),
            _ => Box::new(HybridLoop::new(config).map_err(Failure::file)?),
        };
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

fn write(searched: &Searched, mut folder: Folder) -> Result<Vec<PathBuf>, Failure> {
    let Searched { found, command, scene, .. } = searched;
    folder.write("designs.csv", csv(found, command, |point| searched.replay(point)))?;
    folder.write("error-by-width.csv", errors_csv(found, command))?;
    folder.write("search.txt", widths_search_text::text(searched))?;
    let drawn = [error_by_width(scene, found, command), stiffness_by_cost(scene, found, searched.lose, command)];
    drawn.iter().try_for_each(|picture| pictures::put(picture, &mut folder))?;
    let files = folder.places().map(PathBuf::from).collect();
    folder.commit()?;
    Ok(files)
}
