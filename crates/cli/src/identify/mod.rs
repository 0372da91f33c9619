//! `hpu identify`: keys of a device from its logs.

mod page;
mod written;

use std::path::{Path, PathBuf};

use hpu_chart::{self as chart, Picture};
use hpu_cosim::{LogHeld, SceneFile, read_plain};
use hpu_page::Page;
use hpu_study::identify::logs::{LogRun, changed, held, identify, in_counts};
use hpu_study::identify::{Free, Identified, Met};

use crate::command::CommandLine;
use crate::document::{Content, Document, Section};
use crate::page::{self as pages, Answer, show};
use crate::scene;
use crate::shell::{Exit, Failure, Folder, Watch, hdl, interrupt};

/// Find the values of a scene's keys that its device's logs tell
///
/// Runs of the scene are held beside the logs, as `hpu run SCENE --against LOG` does, and the free keys are moved until
/// the sum of squared differences is least. Each key is told with the interval that has its true value in 95 of 100
/// cases: differences between a model and a log last for many rows, so it is several times as wide as that of
/// independent rows, which stands beside it. An interval is one-sided where the logs tell one side alone, and a key
/// that they do not tell is called not identifiable. A log is rejected that has what the scene cannot explain:
/// something touched the device, or the model lacks a part; the window that is met worst is named.
///
/// Keys start at the scene's values, which may be wrong by a factor, and keep their sign. Logs with --held take no part
/// in the search; they tell how well the found values predict.
///
/// Exit code 0: every log is explained, 1: one is rejected (its figures are told all the same).
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: String,
    /// Logs, each read as the scene's [expect.recording] says; or scenes with another law or start, each with its own
    /// log [default: the log that the scene names]
    #[arg(value_name = "LOG")]
    logs: Vec<String>,
    /// Keys to identify, as in device.coulomb_friction
    #[arg(long, value_name = "KEY,...", value_delimiter = ',', required = true)]
    free: Vec<String>,
    /// A log, or a scene with one, that is only predicted; several times for several
    #[arg(long, value_name = "LOG")]
    held: Vec<String>,
    #[command(flatten)]
    set: scene::Set,
    #[command(flatten)]
    hdl: hdl::Simulated,
    /// Write a report with pictures, the scene with the identified values, identify.txt and identify.json into this
    /// folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// The identified keys, with everything that is reported about them.
struct Identification {
    free: Vec<Free>,
    /// Units of the keys.
    units: Vec<&'static str>,
    found: Identified,
    /// The logs, the held ones last.
    runs: Vec<LogRun>,
    /// How the runs at the identified values met the logs.
    held: Vec<(LogHeld, Met)>,
}

impl Identification {
    /// Whether every log is explained.
    fn is_explained(&self) -> bool {
        self.held.iter().all(|(_, met)| !met.is_rejected())
    }

    /// Returns the pictures of the logs.
    fn pictures(&self, command: &str) -> Vec<Picture> {
        let picture = |(run, (held, met)): (&LogRun, &(LogHeld, Met))| {
            let name = Path::new(&run.file).file_name().unwrap_or_default().to_string_lossy();
            let said = if met.is_rejected() { ": rejected" } else { "" };
            let title = format!("{name}: the log and the identified scene, {:.2} counts rms apart{said}", met.rms);
            chart::log_beside(&title, held, run.unit, command)
        };
        self.runs.iter().zip(&self.held).map(picture).collect()
    }
}

/// Returns the page of the identified keys and the pictures of the logs; `None` when stopped.
pub fn answer(args: &Args, source: &SceneFile, watch: Watch) -> Result<Option<Answer>, Failure> {
    let Some(result) = find(args, source, watch)? else { return Ok(None) };
    Ok(Some(Answer { page: page::page(&args.scene, &result), pictures: result.pictures(&command(args)) }))
}

/// Runs `hpu identify`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let source = scene::source(&args.scene)?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let Some(result) = find(args, &source, interrupt::watch())? else { return Ok(Exit::Interrupted) };
    let command = command(args);
    let mut page = page::page(&args.scene, &result);
    if let Some(mut folder) = folder {
        let pictures = result.pictures(&command);
        folder.write("identify.html", document(&args.scene, &page, &pictures, &command).html())?;
        for (picture, number) in pictures.iter().zip(1..) {
            folder.write(&format!("log-{number}.svg"), &picture.svg)?;
        }
        folder.write("identified.toml", written::scene(&source, &args.set.set, &result, &command)?)?;
        folder.write("identify.txt", page.text())?;
        let json = folder.place("identify.json");
        pages::files(&mut page, &folder.places().map(Into::into).chain([json]).collect::<Vec<PathBuf>>());
        folder.write("identify.json", format!("{:#}\n", page.json()))?;
        folder.commit()?;
    }
    show(&page, args.json)?;
    Ok(Exit::when(result.is_explained()))
}

/// Identifies the keys, and runs the scenes at what was found.
fn find(args: &Args, source: &SceneFile, watch: Watch) -> Result<Option<Identification>, Failure> {
    let set = &args.set.set;
    let experiment = source.parse(set)?;
    args.hdl.agree(&experiment)?;
    hpu_cosim::dut::provide(args.hdl.simulators());
    if let Some((at, key)) = args.free.iter().enumerate().find(|(at, key)| args.free[..*at].contains(key)) {
        return Err(Failure::usage(format!("--free has {key} twice (at {})", at + 1)));
    }
    let free = args.free.iter().map(|key| Free::of(&experiment, key)).collect::<Result<Vec<_>, _>>()?;
    let unit = |key: &String| experiment.parameters.iter().find(|parameter| parameter.key == *key).map(|it| it.unit);
    let units = args.free.iter().map(|key| unit(key).unwrap_or_default()).collect();
    let open = |log: &String| open(log, source, set);
    let mut runs = args.logs.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    if runs.is_empty() {
        runs.push(LogRun::open(source.clone(), set.clone(), None)?);
    }
    let predicted = args.held.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let control = watch.control();
    let Some(found) = identify(&free, &runs, control)? else { return Ok(None) };
    let values: Vec<f64> = found.found.iter().map(|found| found.value).collect();
    let changed = changed(&free, &values);
    let shifts: Vec<i64> = found.met.iter().map(|(_, met)| met.shift).collect();
    let Some(mut beside) = held(&runs, &changed, Some(&shifts), control)? else { return Ok(None) };
    if !predicted.is_empty() {
        let Some(others) = held(&predicted, &changed, None, control)? else { return Ok(None) };
        beside.extend(others);
        runs.extend(predicted);
    }
    let met: Vec<Met> = in_counts(&runs, &beside).iter().map(Met::of).collect();
    Ok(Some(Identification { free, units, found, runs, held: beside.into_iter().zip(met).collect() }))
}

/// Opens a log for the scene, or another scene with its own log.
fn open(log: &str, source: &SceneFile, set: &[(String, String)]) -> Result<LogRun, Failure> {
    if log.ends_with(".toml") || !log.contains(['.', '/']) {
        return Ok(LogRun::open(scene::source(log)?, set.to_vec(), None)?);
    }
    let bytes = read_plain(Path::new(log)).map_err(|error| Failure::file(format!("cannot read `{log}`: {error}")))?;
    Ok(LogRun::open(source.clone(), set.to_vec(), Some((log.to_string(), bytes)))?)
}

/// Returns the command.
fn command(args: &Args) -> String {
    let line = CommandLine::new("identify").words([&args.scene]).words(&args.logs);
    line.option("--free", [args.free.join(",")]).option("--held", &args.held).set(&args.set.set).text()
}

/// Returns the report.
fn document(scene: &str, page: &Page, pictures: &[Picture], command: &str) -> Document {
    let pictures: Vec<String> = pictures.iter().map(|picture| picture.svg.clone()).collect();
    let section = |id: &str, title: &str, content: Content| Section {
        id: id.to_string(),
        title: title.to_string(),
        beside: vec![content],
    };
    Document {
        title: format!("{scene}: identified from logs"),
        about: String::new(),
        sections: vec![
            section("keys", "Keys and logs", Content::new(command, page, &[])),
            section("logs", "The logs and the identified scene", Content::new("", &Page::default(), &pictures)),
        ],
    }
}
