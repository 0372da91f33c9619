//! `hpu limits`: the stiffnesses at which a scene's wall settles.

mod page;

use std::path::PathBuf;

use hpu_chart as chart;
use hpu_cosim::scene::{DutScene, Experiment, Scene};
use hpu_cosim::{Control, SceneFile, figure};
use hpu_page::Page;
use hpu_prove::linear::{BoxSet, NotDriven, usual_range};
use hpu_prove::steady::{SteadySet, certificate};
use hpu_study::limits::{Limits, Looks, MOST_UNKNOWN, Unknown, WordsSet, World, hands_of, limits, swings};
use hpu_study::map::SceneText;
use hpu_study::{Error, Kind};
use hpu_study::{ToldLimits, device};

use crate::command::CommandLine;
use crate::page::{self as pages, Answer, show};
use crate::scene::{self, quoted, set_options};
use crate::shell::{Exit, Failure, Folder, Jobs, Watch, hdl, interrupt, values};

/// Greatest number of ranges over which a word is proved.
const MOST_PROVED: usize = 2;

/// Tell at which stiffnesses a scene's wall settles: by its linear loop, in words, and by published criteria
///
/// The linear loop is told twice. With an ideal drive it waits for nothing but its samples; no stiffness at which one
/// of its poles crosses the unit circle is missed. As driven, it is the loop that runs: with the clocks of
/// synchronizer, decoder, counter, registers and method.settling, and with the modulator's period, at the duty with
/// which the hand comes to rest. Its stretches are proved; behind a modulator they are sought at 200 stiffnesses, and
/// one between two of these may be missed. Where it is not worked out, the page tells why, and which times the ideal
/// drive leaves out. The ripple of the modulator at rest is told in encoder counts: a wall with one count rms or more
/// does not settle, whatever its loop does, unless Coulomb friction holds the device.
///
/// The scene in words is run at a grid of stiffnesses, at several phases of its contact each, and at every word between
/// neighbours that differ. The damping is the scene's. Each criterion tells which of its assumptions the scene does not
/// meet, and what the scene has instead.
///
/// With --over the world around the words is not known but for a box, as in --over 'device.inductance=0.5..0.7 mH'. The
/// linear loop with an ideal drive is then told for every world of the box: where it settles, proved, and where that is
/// not known. The scene in words is run at the box's corners and at eight points within it. The words stay those of the
/// scene: what a motor makes of them changes with the motor.
///
/// With --for-ever, the words of the stiffness are proved to settle at every phase of the contact, for ever: from the
/// softest word on, until the bound of the rms exceeds one count. This is worked out for a live spring behind a latched
/// modulator; of other scenes the page tells why not. The words after that, of which the position is proved to stay
/// within some counts of its rest, are told as bounded for ever. --certificates writes the proof as a file that `hpu
/// certify` checks. With one or two ranges of --over, each word is proved for every value within them: of a
/// resistance, an inductance, a torque constant, an inertia, a viscous friction, the supply, or the hand's stiffness
/// and damping. The ranges are halved until each part is proved; of the first word with another part, the page tells
/// which parts are proved, which are refuted by a run that swings for ever, and which are not told.
///
/// Of a finger on a segment on a gimbal, the criteria tell without a run whether it can rest, and at which stiffnesses.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: String,
    #[command(flatten)]
    set: scene::Set,
    /// Stiffnesses to look at, as in '0.1..3 N.m/rad' [default: from one word to the greatest of the format]; of a
    /// design of your own values of its wall.varies, as in 1..600
    #[arg(long, value_name = "A..B")]
    range: Option<String>,
    /// What is not known of device, hand or supply; several times for a box of several sides
    #[arg(long, value_name = "KEY=A..B")]
    over: Vec<Unknown>,
    /// Hands from none to the firmest of those published, and each of them; on a motor, at this radius of its wheel
    #[arg(long, value_name = "RADIUS", num_args = 0..=1, value_parser = values::length)]
    hands: Option<Option<f64>>,
    /// Phases of the contact at each stiffness
    #[arg(
        long, value_name = "N", default_value_t = Looks::default().phases,
        value_parser = clap::value_parser!(u32).range(1..=64)
    )]
    phases: u32,
    /// Stiffness words to look at, at most; each of a range that has no more [default: 256, with --over 96]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65_536))]
    words: Option<u32>,
    /// Prove up to which stiffness the wall settles at every phase, for ever
    #[arg(long)]
    for_ever: bool,
    /// Write the proof into this folder, as a certificate that `hpu certify` checks
    #[arg(long, value_name = "DIR", requires = "for_ever")]
    certificates: Option<PathBuf>,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    hdl: hdl::Simulated,
    /// Write a picture of the sets, limits.txt and limits.json into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu limits`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let source = scene::source(&args.scene)?;
    let open = || args.out.as_deref().map(Folder::open).transpose();
    // Until the runs begin, a signal ends the command at once.
    let Some((folder, Answer { mut page, pictures })) = find(args, &source, open, interrupt::watch)? else {
        return Ok(Exit::Interrupted);
    };
    if let Some(mut folder) = folder {
        pictures.iter().try_for_each(|picture| folder.draw(picture))?;
        folder.write("limits.txt", page.text())?;
        let json = folder.place("limits.json");
        pages::files(&mut page, &folder.places().map(Into::into).chain([json]).collect::<Vec<PathBuf>>());
        folder.write("limits.json", format!("{:#}\n", page.json()))?;
        folder.commit()?;
    } else if !pictures.is_empty() {
        pages::files(&mut page, &[]);
    }
    show(&page, args.json)?;
    // The absence of a limit is a result, not a failure.
    Ok(Exit::Fine)
}

/// Returns the page and the picture of the limits of this scene; `None` when stopped.
pub fn answer(args: &Args, source: &SceneFile, watch: Watch) -> Result<Option<Answer>, Failure> {
    Ok(find(args, source, || Ok(()), || watch)?.map(|((), answer)| answer))
}

/// Finds the limits of this scene; `None` when stopped. Calls `open` before the runs, and `watch` when they begin.
fn find<'w, F>(
    args: &Args,
    source: &SceneFile,
    open: impl FnOnce() -> Result<F, Failure>,
    watch: impl FnOnce() -> Watch<'w>,
) -> Result<Option<(F, Answer)>, Failure> {
    let mut load = |file: &str| source.load(file);
    let read = SceneText::read((&source.name, &source.text), &args.set.set, &mut load).map_err(Failure::file)?;
    args.hdl.agree(&read.1)?;
    let is_axis = matches!(&read.1, Experiment::Axis(_));
    if args.for_ever && (args.hands.is_some() || args.over.len() > MOST_PROVED || !is_axis) {
        let said = "--for-ever is of a wall on an axis, without --hands, and with two ranges of --over at most";
        return Err(Failure::usage(said));
    }
    if args.certificates.is_some() && !read.0.files.is_empty() {
        return Err(Failure::usage("--certificates: the scene reads files, which a certificate does not carry"));
    }
    if let Experiment::Dut(scene) = &read.1 {
        return of_design(args, &read.0, scene, open, watch);
    }
    let shown = format!("{}{}", quoted(&args.scene), set_options(&args.set.set));
    if let Some(told) = device(&read.1).told_limits(&shown) {
        let page = without_runs(args, &read.1.name, told)?;
        return Ok(Some((open()?, Answer { page, pictures: Vec::new() })));
    }
    let (text, nominal) = (read.0, axis(&read.1)?);
    let range = match &args.range {
        Some(range) => asked(&text, args, range)?,
        None => usual_range(&nominal),
    };
    let (mut over, mut named) = (args.over.clone(), Vec::new());
    if let Some(lever_m) = args.hands {
        let (sides, hands) = hands_of(&nominal, lever_m).map_err(|why| Failure::usage(format!("--hands: {why}")))?;
        over.extend(sides);
        named = hands;
    }
    let world = World { text: &text, set: &args.set.set, nominal: &nominal, unknown: &over, named: &named };
    let worlds = if over.is_empty() { vec![nominal.clone()] } else { points(&world)? };
    let proved_over = args.over.iter().filter(|_| args.for_ever);
    let proved_over = proved_over.map(|unknown| unknown.over(&text, &args.set.set, &nominal));
    let proved_over = proved_over.collect::<Result<Vec<_>, _>>().map_err(|why| Failure::usage(why.to_string()))?;
    let opened = open()?;
    let certificates = args.certificates.as_ref().map(|dir| Folder::open(dir)).transpose()?;

    let most = args.words.unwrap_or(if over.is_empty() { 256 } else { 96 });
    let looks = Looks::words(most as usize, args.phases);
    let in_box = (!over.is_empty()).then(|| BoxSet::new(&world, &worlds, range).map_err(Error::from));
    let mut stopped = false;
    let found = limits(&nominal, range, || {
        let watch = watch();
        let found = WordsSet::new(&worlds, range, looks, args.jobs.get(), watch.control());
        stopped = watch.is_stopped();
        found
    });
    let steady = (args.for_ever && !stopped).then(|| {
        let refute = |scene: &Scene| swings(scene, &Control::default());
        SteadySet::over(&nominal, &proved_over, range, &refute).map_err(Error::from)
    });
    let found = Limits { in_box, steady, ..found }.at_wall(&nominal);
    if let (Some(mut folder), Some(Ok(set)), false) = (certificates, &found.steady, stopped) {
        folder.write("limits.certificate", certificate(set, &nominal.name, &text.text, &args.set.set))?;
        folder.commit()?;
    }
    Ok((!stopped).then(|| (opened, drawn(args, &nominal.name, &found, &over))))
}

/// Returns the page of limits, and their picture.
fn drawn(args: &Args, name: &str, found: &Limits, over: &[Unknown]) -> Answer {
    let picture = chart::limits(name, found, over, &command(args));
    Answer { page: page::page(name, found, over), pictures: vec![picture] }
}

/// Returns the page of limits that criteria tell without a run.
fn without_runs(args: &Args, name: &str, ToldLimits { of, page }: ToldLimits) -> Result<Page, Failure> {
    let usage = |said: &str| Failure::usage(format!("{name}: {said}"));
    let is_of_runs = args.words.is_some() || args.phases != Looks::default().phases;
    if args.range.is_some() || !args.over.is_empty() || args.hands.is_some() || is_of_runs {
        let options = "--range, --over, --hands, --words and --phases";
        return Err(usage(&format!("{options} are of an axis; of {of} nothing is run")));
    }
    if args.out.is_some() {
        return Err(usage(&format!("the limits of {of} have no picture; hpu map draws its criteria beside runs")));
    }
    page.map_err(|why| usage(&why.to_string()))
}

/// Finds the limits of a design of the user's own: over the generic or constant that its scene names.
fn of_design<'w, F>(
    args: &Args,
    text: &SceneText,
    scene: &DutScene,
    open: impl FnOnce() -> Result<F, Failure>,
    watch: impl FnOnce() -> Watch<'w>,
) -> Result<Option<(F, Answer)>, Failure> {
    let usage = |said: &str| Failure::usage(format!("{}: {said}", scene.name));
    if !args.over.is_empty() || args.hands.is_some() {
        return Err(usage("--over and --hands are of scenes with a [method]"));
    }
    let key = scene.varies.as_ref().ok_or_else(|| {
        usage(
            "it does not say what makes its wall stiffer; write varies = \"dut.ports.gain\" in [wall], \
             or --set wall.varies=...",
        )
    })?;
    let range =
        args.range.as_deref().ok_or_else(|| usage("write --range A..B, whole numbers, as in --range 1..1023"))?;
    let ends = range.split_once("..").and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    let range: [i128; 2] = ends.filter(|[a, b]| 0 < *a && a < b && *b < 1 << 32).ok_or_else(|| {
        usage(&format!("--range {range}: write whole numbers from 1 on, the smaller first, as in 1..1023"))
    })?;
    hpu_cosim::dut::provide(args.hdl.simulators());
    let opened = open()?;
    let at = |value: i128| {
        let set: Vec<_> = args.set.set.iter().cloned().chain([(key.clone(), value.to_string())]).collect();
        match text.parse(&set)? {
            Experiment::Dut(scene) => Ok(scene),
            _ => Err(Error::new("it has no design of yours any more")),
        }
    };
    let looks = Looks::words(args.words.unwrap_or(64) as usize, args.phases);
    let watch = watch();
    let in_words = WordsSet::of_design(&at, range, looks, args.jobs.get(), watch.control());
    if watch.is_stopped() {
        return Ok(None);
    }
    let in_words = match in_words {
        Ok(set) => Ok(set),
        Err(error) if error.kind() == Kind::Unjudged => Err(error),
        Err(error) => return Err(error.into()),
    };
    let found = Limits {
        varied: Some(key.clone()),
        range: range.map(|end| end as f64),
        criteria: Vec::new(),
        silent: Vec::new(),
        linear: Err("none: the law of a design of yours is its own".into()),
        driven: Err(NotDriven { why: "the law of a design of yours is its own".into(), left_out: Vec::new() }),
        ripple: None,
        in_box: None,
        in_words,
        steady: None,
        stiffness_miss: None,
        damping_error: None,
        left_out: Vec::new(),
        coulomb: 0.0,
        is_ramped: false,
    };
    Ok(Some((opened, drawn(args, &scene.name, &found, &[]))))
}

/// Returns the worlds of a box that are run.
fn points(world: &World) -> Result<Vec<Scene>, Failure> {
    let usage = |said: String| Failure::usage(format!("--over: {said}"));
    let unknown = world.unknown;
    if unknown.len() > MOST_UNKNOWN {
        return Err(usage(format!("{} keys, {MOST_UNKNOWN} at most: each more doubles the corners", unknown.len())));
    }
    for (index, key) in unknown.iter().map(Unknown::key).enumerate() {
        if unknown[..index].iter().any(|other| other.key() == key) {
            return Err(usage(format!("{key} is given twice")));
        }
        if let Some((key, _)) = world.set.iter().find(|(set, _)| set == key) {
            return Err(usage(format!("{key} is set too; leave one of both")));
        }
        if key.starts_with("wall.") {
            return Err(usage(format!("{key} is the wall's; a box is of device, hand and supply")));
        }
    }
    world.points().map_err(|error| usage(error.to_string()))
}

/// Returns the command, without options that change no figure.
fn command(args: &Args) -> String {
    let radius = args.hands.flatten().map(|lever_m| format!("{}mm", figure(1e3 * lever_m)));
    let is_bare = args.hands.is_some() && radius.is_none();
    let phases = Some(args.phases).filter(|phases| *phases != Looks::default().phases);
    let command = CommandLine::new("limits").words([&args.scene]).set(&args.set.set).option("--range", &args.range);
    let command = command.option("--over", &args.over).option("--hands", radius).flag("--hands", is_bare);
    let command = command.flag("--for-ever", args.for_ever);
    command.option("--words", args.words).option("--phases", phases).text()
}

/// Returns the scene, if it is one whose limits are found here.
fn axis(experiment: &Experiment) -> Result<Scene, Failure> {
    device(experiment).limited().cloned().map_err(Failure::usage)
}

/// Reads the ends of a range, in the units that the scene accepts for a stiffness.
fn asked(text: &SceneText, args: &Args, range: &str) -> Result<[f64; 2], Failure> {
    const SYNTAX: &str = "write A..B with A below B, as in '0.1..3 N.m/rad'";
    let usage = |said: String| Failure::usage(format!("--range {range}: {said}"));
    let (from, to) = range.split_once("..").ok_or_else(|| usage(SYNTAX.into()))?;
    let to = to.trim();
    // The unit stands after the second number, or after both.
    let number = to.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c))).unwrap_or(to.len());
    let unit = to[number..].trim();
    let from = from.trim();
    let from =
        if from.parse::<f64>().is_ok() && !unit.is_empty() { format!("{from} {unit}") } else { from.to_string() };
    let end = |end: &str| {
        let set = [&args.set.set[..], &[("wall.stiffness".into(), end.into())]].concat();
        let scene = axis(&text.parse(&set).map_err(Failure::file)?)?;
        Ok::<_, Failure>(scene.wall.stiffness_nm_per_rad)
    };
    let [low, high] = [end(&from)?, end(to)?];
    if low <= 0.0 {
        return Err(usage("a stiffness of 0 has no wall; begin above it".into()));
    }
    if low >= high {
        return Err(usage(format!("from {} to {} holds nothing; {SYNTAX}", figure(low), figure(high))));
    }
    Ok([low, high])
}
