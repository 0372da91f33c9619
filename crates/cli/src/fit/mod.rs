//! `hpu fit`: finds the least model, the cheapest one that still answers a scene's question.

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Hand, Output, shipped};
use hpu_study::fit::{Fit, FitError, fit, percent};
use hpu_study::map::SceneText;
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::parameters::{missed_object, stiffness_miss, stiffness_missed};
use crate::scene::{self, Source, set_options};
use crate::terminal::{print, print_json};
use crate::units::si;
use crate::{interrupt, progress};

/// Find the least model of a scene whose outputs stay within a tolerance of the scene's own
///
/// The scene says which outputs it is about (accuracy.outputs): these are judged and named. Errors of all others are
/// told beside them and judged by nobody: the trace of a motion without end drifts in phase. The cheapest model is
/// tried first, and more is modelled until every judged output is within half of the tolerance of the scene as it is
/// written, and within the tolerance, with the same verdict, at 16 walls around: 5 % softer and stiffer, and up to 7.5
/// encoder counts nearer and farther (a PHANToM's at 6, up to 0.15 mm nearer and 0.1 mm farther). At walls between
/// these a judged output may be off by up to twice the tolerance; farther away nothing is promised. A scene with model
/// = "auto" is run so. Runs go one by one, for their wall times count.
/// It takes about as long as a hundred runs of the scene: seconds; all shipped scenes take two minutes.
#[derive(clap::Args)]
pub struct Args {
    /// A scene's file, or the name of a shipped scene; without one, all shipped scenes in a table
    scene: Option<String>,
    /// The tolerance, as in 1% [default: the scene's accuracy.within, else 1%]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    within: Option<f64>,
    #[command(flatten)]
    set: scene::Set,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Reads a share, as in 1% or 0.01.
pub fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let share = number.trim().parse::<f64>().ok().map(|number| number * unit);
    share
        .filter(|share| *share > 0.0 && *share < 1.0)
        .ok_or_else(|| "write a share between 0 and 1, as in 1% or 0.01".into())
}

/// Runs `hpu fit`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(name) = &args.scene else {
        return all(args);
    };
    let source = scene::source(name)?;
    let Some(found) = least(&source, &args.set.set, args.within, interrupt::heed())? else {
        return Ok(Exit::Interrupted);
    };
    let command = command(name, args, &found);
    let experiment = source.parse(&args.set.set)?;
    if args.json {
        let mut object = object(name, &found, &command);
        object["stiffness_missed"] = json!(stiffness_miss(&experiment).as_ref().map(missed_object));
        print_json(&object)?
    } else {
        let warning = stiffness_missed(&experiment).map(|said| format!("warning    {said}\n"));
        print(&(text(name, &found, &command) + &warning.unwrap_or_default()))?
    }
    Ok(Exit::Fine)
}

/// Fits all shipped scenes with a device.
fn all(args: &Args) -> Result<Exit, Failure> {
    let control = interrupt::heed();
    let mut rows = Vec::new();
    if !args.json {
        print(&header())?;
    }
    for (index, name) in shipped().iter().map(|shipped| shipped.name).enumerate() {
        progress::doing(format!("{name}, scene {} of {}", index + 1, shipped().len()));
        let source = scene::source(name)?;
        let experiment = source.parse(&args.set.set)?;
        if matches!(&experiment, Experiment::Axis(scene) if matches!(scene.hand, Hand::Capture { .. })) {
            continue;
        }
        match least(&source, &args.set.set, args.within, control)? {
            Some(found) => rows.push((name, found)),
            None => return Ok(Exit::Interrupted),
        }
        if !args.json {
            let (name, found) = &rows[rows.len() - 1];
            print(&row(name, found))?;
        }
    }
    if args.json {
        let rows: Vec<Value> =
            rows.iter().map(|(name, found)| object(name, found, &command(name, args, found))).collect();
        return print_json(&json!({ "scenes": rows })).map(|()| Exit::Fine);
    }
    let fast = rows.iter().filter(|(_, found)| found.speedup >= 5.0).count();
    print(&format!("{fast} of {} at least 5 times as fast as written\n", rows.len()))?;
    Ok(Exit::Fine)
}

/// Returns the header of the table of all scenes.
fn header() -> String {
    table_line(["scene", "speed", "error", "of what is judged", "trace"].map(String::from), "model")
}

fn row(name: &str, found: &Fit) -> String {
    let keys = found.set.iter().map(|(key, value)| format!("{}={value}", key.trim_start_matches("model.")));
    let model = keys.collect::<Vec<_>>().join(" ");
    let worst = found.errors.iter().map(|(_, error)| *error).fold(0.0, f64::max);
    let judged = found.errors.iter().map(|(output, _)| output.name()).collect::<Vec<_>>().join(", ");
    let trace = found.errors.iter().chain(&found.not_judged).find(|(output, _)| *output == Output::Trace);
    let trace = trace.map_or("-".to_string(), |(_, error)| percent(*error));
    let model = if model.is_empty() { "as written" } else { &model };
    table_line([name.to_string(), format!("{:.1} x", found.speedup), percent(worst), judged, trace], model)
}

fn table_line([scene, speed, error, judged, trace]: [String; 5], model: &str) -> String {
    format!("{scene:<24} {speed:>9} {error:>10}  {judged:<48} {trace:>9}  {model}\n")
}

fn command(name: &str, args: &Args, found: &Fit) -> String {
    let set: Vec<_> = args.set.set.iter().chain(&found.set).cloned().collect();
    format!("hpu run {}{}", scene::quoted(name), set_options(&set))
}

/// Returns the least model of a scene; `None` when interrupted.
pub fn least(
    source: &Source,
    set: &[(String, String)],
    within: Option<f64>,
    control: &Control,
) -> Result<Option<Fit>, Failure> {
    let mut load = |file: &str| source.load(file);
    let (scene, experiment) = SceneText::read((&source.name, &source.text), set, &mut load).map_err(Failure::file)?;
    match fit(&scene, &set.to_vec(), within.unwrap_or(experiment.accuracy.within), control) {
        Ok(found) => Ok(Some(found)),
        Err(FitError::Stopped) => Ok(None),
        Err(error) => Err(Failure::file(format!("{}: {error}", source.name))),
    }
}

/// Returns the chosen model and the reasons as lines, each with a name and a text.
pub fn lines(found: &Fit) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    let model = match &found.set[..] {
        [] => "as written: nothing can be left out".to_string(),
        set => set.iter().map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>().join(", "),
    };
    lines.push(("model", model));
    if found.contact_share == Some(0.0) {
        let said = "wall not reached in the judged window: the scene as written settles nothing about the wall";
        lines.push(("contact", said.to_string()));
    }
    let told = |errors: &[(Output, f64)]| {
        let told = errors.iter().map(|(output, error)| match output {
            Output::Verdict if *error == 0.0 => "the same verdict".to_string(),
            _ => format!("{} {}", output.name(), percent(*error)),
        });
        told.collect::<Vec<_>>().join(", ")
    };
    if !found.set.is_empty() {
        let errors = told(&found.errors);
        lines.push(("judged", format!("{errors}; in the scenes around at most {}", percent(found.around))));
        if !found.not_judged.is_empty() {
            let chosen = "accuracy.outputs of the scene chooses what is judged";
            lines.push(("not judged", format!("{}; {chosen}", told(&found.not_judged))));
        }
        lines.push(("speed", format!("{:.1} times the scene as written ({})", found.speedup, si(found.wall_s, "s"))));
    }
    for left in &found.left_out {
        let effect = match left.effect {
            0.0 => "changes nothing".to_string(),
            effect => format!("{} of {}", percent(effect), left.output.name()),
        };
        lines.push(("left out", format!("{}: {effect}; {:.1} times faster without", left.what, left.gain)));
    }
    lines.extend(found.kept.iter().map(|kept| ("kept", format!("{}: {}", kept.what, kept.why))));
    lines.push(("tried", format!("{} models in {} runs", found.tried, found.runs)));
    lines
}

fn text(scene: &str, found: &Fit, command: &str) -> String {
    let mut text = format!("{scene}: the least model within {}\n", percent(found.within));
    for (name, said) in lines(found).into_iter().chain([("run it by", command.to_string())]) {
        text += &format!("{name:<10} {said}\n");
    }
    text
}

fn object(scene: &str, found: &Fit, command: &str) -> Value {
    let mut object = model(found);
    object["scene"] = json!(scene);
    object["command"] = json!(command);
    object
}

/// Returns the chosen model as JSON.
pub fn model(found: &Fit) -> Value {
    let set: serde_json::Map<_, _> = found.set.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
    let errors: serde_json::Map<_, _> =
        found.errors.iter().map(|(output, error)| (output.name().to_string(), json!(error))).collect();
    let not_judged: serde_json::Map<_, _> =
        found.not_judged.iter().map(|(output, error)| (output.name().to_string(), json!(error))).collect();
    let left_out = found.left_out.iter().map(
        |left| json!({ "what": left.what, "output": left.output.name(), "effect": left.effect, "speedup": left.gain }),
    );
    let kept = found.kept.iter().map(|kept| json!({ "what": kept.what, "why": kept.why }));
    json!({
        "within": found.within,
        "set": set,
        "judged": found.errors.iter().map(|(output, _)| output.name()).collect::<Vec<_>>(),
        "errors": errors,
        "errors_not_judged": not_judged,
        "around": found.around,
        "contact_share": found.contact_share,
        "speedup": found.speedup,
        "wall_s": found.wall_s,
        "left_out": left_out.collect::<Vec<_>>(),
        "kept": kept.collect::<Vec<_>>(),
        "models_tried": found.tried,
        "runs": found.runs,
    })
}
