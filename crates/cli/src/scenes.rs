//! `hpu scenes`: the shipped scenes, and every key of a scene with its value and the source of the value.

use hpu_cosim::SceneFile;
use hpu_cosim::scene::{
    ChangedDefault, Experiment, Resolved, SceneError, ValueSource, as_scene, changed_defaults, resolved, shipped,
};
use hpu_page::{Column, Page, Table, as_json};
use serde_json::{Value, json};

use crate::page::show;
use crate::scene::{Set, first_sentence, quoted, set_options, source};
use crate::shell::{Exit, Failure, print_file, print_json, tell};

/// List the shipped scenes, or print every key of a scene
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    verb: Option<Verb>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum Verb {
    Show(ShowArgs),
}

/// Print every key of a scene: value, unit, source and meaning
///
/// The text is a scene in TOML that runs like the one shown, with every default written out: save it to keep a run as
/// it is when a default changes. Behind each value stands its source: the line of the file, `--set`, or `default`.
/// Lines that begin with `#` are keys that a named motor or arm brings, and keys that the scene does without.
#[derive(clap::Args)]
struct ShowArgs {
    /// File, or name of a shipped scene
    scene: String,
    #[command(flatten)]
    set: Set,
    /// Print the keys as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu scenes`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match &args.verb {
        None => list(args.json),
        Some(Verb::Show(args)) => show_keys(args),
    }
}

/// Lists the shipped scenes, one line each.
fn list(as_json: bool) -> Result<Exit, Failure> {
    let scenes: Result<Vec<_>, SceneError> = shipped().iter().map(|shipped| shipped.parse(&[])).collect();
    let fields = [
        Column::text("name", "").least(24).of(|scene: &Experiment| scene.name.to_string()),
        Column::text("about", "").data().of(|scene: &Experiment| scene.about.clone()),
        Column::text("", "").said().of(|scene: &Experiment| first_sentence(&scene.about)),
    ];
    let mut page = Page::default();
    page.table(Table::of("scenes", &scenes.map_err(Failure::file)?, fields).gap(1));
    show(&page, as_json)?;
    Ok(Exit::Fine)
}

/// Runs `hpu scenes show`.
fn show_keys(args: &ShowArgs) -> Result<Exit, Failure> {
    let file = source(&args.scene)?;
    let scene = file.parse(&args.set.set)?;
    let all = resolved(&scene, &file.name, &file.text, &args.set.set).map_err(Failure::file)?;
    tell_changed_defaults(&scene, &file, &args.set.set)?;
    if args.json {
        let keys: Vec<_> = all.iter().map(object).collect();
        print_json(&json!({ "scene": scene.name, "keys": keys }))?;
    } else {
        let command = format!("hpu scenes show {}{}", quoted(&args.scene), set_options(&args.set.set));
        print_file(&format!("# {}: `{command}`\n{}", scene.name, as_scene(&all, line)))?;
    }
    Ok(Exit::Fine)
}

/// Tells the comments of a scene that `hpu new` wrote whose values are not the defaults.
pub(crate) fn tell_changed_defaults(
    scene: &Experiment,
    file: &SceneFile,
    set: &[(String, String)],
) -> Result<(), Failure> {
    for changed in changed_defaults(scene, &file.name, &file.text, set).map_err(Failure::file)? {
        let ChangedDefault { line, key, commented, default } = changed;
        let place = format!("{}:{line}: {key}", file.name);
        tell(&format!(
            "note: {place}: the comment says {commented}; without the key, hpu takes its default, {default}"
        ));
    }
    Ok(())
}

/// Returns the line of a key; a key that a scene need not give is a comment.
fn line(key: &Resolved, pair: Option<&str>) -> Option<String> {
    Some(match (&key.source, pair) {
        (ValueSource::Given(_) | ValueSource::Default, Some(pair)) => format!("{pair}  # {}", key.source),
        (_, Some(pair)) => format!("# {pair}  # {}", key.source),
        (_, None) => format!("# {}: {}", key.key, key.value),
    })
}

fn object(key: &Resolved) -> Value {
    json!({
        "section": key.section,
        "key": key.key,
        "value": key.toml.as_ref().map(|_| as_json(&key.value)),
        "unit": key.unit,
        "toml": key.toml,
        "source": key.source.to_string(),
        "meaning": key.meaning,
    })
}
