//! `hpu fit`: finds the least model, the cheapest one that still answers a scene's question.

use std::collections::BTreeMap;
use std::path::PathBuf;

use hpu_cosim::scene::{Experiment, Hand, Output, shipped};
use hpu_cosim::{Control, SceneFile};
use hpu_page::{Column, Field, Page, Table, Value};
use hpu_study::Kind;
use hpu_study::fit::{Fit, Tried, fit, percent};
use hpu_study::map::SceneText;
use hpu_study::timing::Spread;

use crate::page::{self as pages, show};
use crate::parameters::{missed_object, stiffness_missed};
use crate::scene::{self, set_options};
use crate::shell::{Exit, Failure, Folder, Watch, interrupt, print, print_json, progress, values, verdict};
use crate::units::si;

/// Find the least model of a scene whose outputs stay within a tolerance of the scene's own
///
/// The scene says which outputs it is about (accuracy.outputs): these are judged and named. Errors of all others are
/// told beside them and judged by nobody: the trace of a motion without end drifts in phase. The cheapest model is
/// tried first, and more is modelled until every judged output is within half of the tolerance of the scene as it is
/// written, and within the tolerance, with the same verdict, at 16 walls around: 5 % softer and stiffer, and up to 7.5
/// encoder counts nearer and farther (an arm's at 6, up to 0.15 mm nearer and 0.1 mm farther). At walls between
/// these a judged output may be off by up to twice the tolerance; farther away nothing is promised. A scene with model
/// = "auto" is run so. Runs go one by one, for their wall times count: two models run in turn, and the median of their
/// ratios is told with its quartiles.
/// It takes about as long as a hundred runs of the scene: seconds; all shipped scenes take two minutes.
/// To see speed and error of every way to run a scene: hpu chart.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene; without one, all shipped scenes in a table
    scene: Option<String>,
    /// The tolerance, as in 1% [default: the scene's accuracy.within, else 1%]
    #[arg(long, value_name = "SHARE", value_parser = values::share)]
    within: Option<f64>,
    #[command(flatten)]
    set: scene::Set,
    /// Write a picture of the models that were tried, their table, fit.txt and fit.json into this folder
    #[arg(short, long, value_name = "DIR", requires = "scene")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu fit`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(name) = &args.scene else {
        return all(args);
    };
    let source = scene::source(name)?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let Some((mut page, found)) = fitted(args, name, &source, interrupt::watch())? else {
        return Ok(Exit::Interrupted);
    };
    if let Some(mut folder) = folder {
        let command = format!("hpu fit {}{}", scene::quoted(name), set_options(&args.set.set));
        folder.draw(&hpu_chart::fit(name, &found, &command))?;
        folder.write("fit.csv", tried(name, &found, &args.set.set).csv(&[command]))?;
        folder.write("fit.txt", page.text())?;
        let json = folder.place("fit.json");
        pages::files(&mut page, &folder.places().map(Into::into).chain([json]).collect::<Vec<PathBuf>>());
        folder.write("fit.json", format!("{:#}\n", page.json()))?;
        folder.commit()?;
    }
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

/// Returns the models that were tried, one a row.
fn tried(name: &str, found: &Fit, set: &[(String, String)]) -> Table {
    let fields = [
        Column::number("speedup", "").of(|tried: &Tried| tried.speedup),
        Column::number("error", "").of(|tried: &Tried| tried.error.is_finite().then_some(tried.error)),
        Column::text("judged", "").of(|tried: &Tried| match tried {
            tried if tried.chosen => "the least model",
            tried if !tried.error.is_finite() => "another verdict",
            tried if tried.error > found.within / 2.0 => "beyond half of the tolerance",
            _ => "within half of the tolerance",
        }),
        Column::text("replay", "").of(move |tried: &Tried| {
            let set: Vec<_> = set.iter().chain(&tried.set).cloned().collect();
            format!("hpu run {}{}", scene::quoted(name), set_options(&set))
        }),
    ];
    Table::of("", &found.models, fields)
}

/// Returns the page of the least model of the scene with this name; `None` when stopped.
pub fn answer(args: &Args, name: &str, source: &SceneFile, watch: Watch) -> Result<Option<Page>, Failure> {
    Ok(fitted(args, name, source, watch)?.map(|(page, _)| page))
}

/// Returns the least model of a scene, and its page; `None` when stopped.
fn fitted(args: &Args, name: &str, source: &SceneFile, watch: Watch) -> Result<Option<(Page, Fit)>, Failure> {
    let Some(found) = least(source, &args.set.set, args.within, watch.control())? else { return Ok(None) };
    let experiment = source.parse(&args.set.set)?;
    let mut page = page(name, &found, &command(name, args, &found));
    page.data("stiffness_missed", experiment.setup().stiffness_miss().as_ref().map(missed_object));
    if let Some(said) = stiffness_missed(&experiment) {
        page.line("warning", said);
    }
    Ok(Some((page, found)))
}

/// Fits all shipped scenes with a device.
fn all(args: &Args) -> Result<Exit, Failure> {
    let control = interrupt::heed();
    let fields = fields();
    let mut table = Table::new("", fields.iter().map(|field| field.column.clone()));
    let mut page = Page::default();
    let mut fast = 0;
    if !args.json {
        print(&table.head())?;
    }
    for (index, name) in shipped().iter().map(|shipped| shipped.name).enumerate() {
        progress::doing(format!("{name}, scene {} of {}", index + 1, shipped().len()));
        let source = scene::source(name)?;
        let experiment = source.parse(&args.set.set)?;
        if matches!(&experiment, Experiment::Axis(scene) if matches!(scene.hand, Hand::Capture { .. })) {
            continue;
        }
        let Some(found) = least(&source, &args.set.set, args.within, control)? else { return Ok(Exit::Interrupted) };
        fast += usize::from(found.speedup.told().is_some_and(|told| told >= 5.0));
        page.section("scenes", self::page(name, &found, &command(name, args, &found)));
        let row = (name, found);
        table.add(fields.iter().map(|field| field.cell(&row)));
        if !args.json {
            print(&table.last(&verdict))?;
        }
    }
    if args.json {
        print_json(&page.json())?;
    } else {
        print(&format!("{fast} of {} at least 5 times as fast as written\n", table.rows().len()))?;
    }
    Ok(Exit::Fine)
}

/// Returns the columns of the table of all scenes.
fn fields() -> [Field<'static, (&'static str, Fit)>; 6] {
    type Row = (&'static str, Fit);
    let model = |(_, found): &Row| {
        let keys = found.set.iter().map(|(key, value)| format!("{}={value}", key.trim_start_matches("model.")));
        let model = keys.collect::<Vec<_>>().join(" ");
        if model.is_empty() { "as written".to_string() } else { model }
    };
    let worst = |(_, found): &Row| percent(found.errors.iter().map(|(_, error)| *error).fold(0.0, f64::max));
    let judged = |(_, found): &Row| found.errors.iter().map(|(output, _)| output.name()).collect::<Vec<_>>().join(", ");
    let trace = |(_, found): &Row| {
        let trace = found.errors.iter().chain(&found.not_judged).find(|(output, _)| *output == Output::Trace);
        trace.map_or("-".to_string(), |(_, error)| percent(*error))
    };
    [
        Column::text("", "scene").least(24).of(|(name, _): &Row| *name),
        Column::number("", "speed").least(8).of(|(_, found): &Row| match found.speedup.told() {
            Some(told) => format!("{told:.1} x"),
            None => "not told".into(),
        }),
        Column::number("", "error").least(9).of(worst),
        Column::text("", "of what is judged").least(48).of(judged),
        Column::number("", "trace").least(8).of(trace),
        Column::text("", "model").of(model),
    ]
}

fn command(name: &str, args: &Args, found: &Fit) -> String {
    let set: Vec<_> = args.set.set.iter().chain(&found.set).cloned().collect();
    format!("hpu run {}{}", scene::quoted(name), set_options(&set))
}

/// Returns the least model of a scene; `None` when interrupted.
pub fn least(
    source: &SceneFile,
    set: &[(String, String)],
    within: Option<f64>,
    control: &Control,
) -> Result<Option<Fit>, Failure> {
    let mut load = |file: &str| source.load(file);
    let (scene, experiment) = SceneText::read((&source.name, &source.text), set, &mut load).map_err(Failure::file)?;
    match fit(&scene, &set.to_vec(), within.unwrap_or(experiment.accuracy.within), control) {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() == Kind::Stopped => Ok(None),
        Err(error) => Err(Failure::file(format!("{}: {error}", source.name))),
    }
}

/// Returns the quartiles of a ratio.
fn between(ratio: Spread) -> [f64; 2] {
    [ratio.low, ratio.high]
}

/// Returns the chosen model and its reasons.
pub fn model(found: &Fit) -> Page {
    let mut page = Page::default();
    let model = match &found.set[..] {
        [] => "as written: nothing can be left out".to_string(),
        set => set.iter().map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>().join(", "),
    };
    let set: BTreeMap<_, _> = found.set.iter().cloned().collect();
    page.fact("set", "model", Value::of(set), model);
    page.data("within", found.within).data("contact_share", found.contact_share);
    if found.contact_share == Some(0.0) {
        let said = "wall not reached in the judged window: the scene as written settles nothing about the wall";
        page.line("contact", said);
    }
    let told = |errors: &[(Output, f64)]| {
        let told = errors.iter().map(|(output, error)| match output {
            Output::Verdict if *error == 0.0 => "the same verdict".to_string(),
            _ => format!("{} {}", output.name(), percent(*error)),
        });
        told.collect::<Vec<_>>().join(", ")
    };
    let errors = |errors: &[(Output, f64)]| {
        errors.iter().map(|(output, error)| (output.name(), *error)).collect::<BTreeMap<_, _>>()
    };
    let judged = found.errors.iter().map(|(output, _)| output.name());
    page.data("judged", judged.collect::<Vec<_>>()).data("errors", errors(&found.errors));
    page.data("errors_not_judged", errors(&found.not_judged)).data("around", found.around);
    page.data("speedup", found.speedup.told()).data("speedup_between", between(found.speedup));
    page.data("wall_s", found.wall_s);
    if !found.set.is_empty() {
        let around = percent(found.around);
        page.line("judged", format!("{}; in the scenes around at most {around}", told(&found.errors)));
        if !found.not_judged.is_empty() {
            let chosen = "accuracy.outputs of the scene chooses what is judged";
            page.line("not judged", format!("{}; {chosen}", told(&found.not_judged)));
        }
        let wall = si(found.wall_s, "s");
        page.line("speed", format!("{}; {wall}", found.speedup.said("times the scene as written")));
    }
    page.data("left_out", [(); 0]).data("kept", [(); 0]);
    for left in &found.left_out {
        let (what, output) = (&left.what, left.output.name());
        let effect = match left.effect {
            0.0 => "changes nothing".to_string(),
            effect => format!("{} of {output}", percent(effect)),
        };
        let mut part = Page::default();
        part.data("what", what).data("output", output).data("effect", left.effect);
        part.data("speedup", left.gain.told()).data("speedup_between", between(left.gain));
        part.line("left out", format!("{what}: {effect}; {}", left.gain.said("times faster without")));
        page.section("left_out", part);
    }
    for kept in &found.kept {
        let mut part = Page::default();
        part.data("what", &kept.what).data("why", &kept.why).line("kept", format!("{}: {}", kept.what, kept.why));
        page.section("kept", part);
    }
    page.data("models_tried", found.tried).data("runs", found.runs);
    page.line("tried", format!("{} models in {} runs", found.tried, found.runs));
    page
}

fn page(scene: &str, found: &Fit, command: &str) -> Page {
    let mut page = Page::default();
    page.note(format!("{scene}: the least model within {}", percent(found.within)));
    page.append(model(found)).data("scene", scene).fact("command", "run it by", command, command);
    page
}
