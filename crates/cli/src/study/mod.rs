//! `hpu study`: runs a study of the user's own.

mod lines;

use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};

use clap::{Arg, Command};
use hpu_cosim::{PlainName, did_you_mean, excerpt};
use hpu_papers::phantom::{LADDER, TABLE_2};
use hpu_papers::studies::{Section, Study, shipped_texts};
use hpu_study::map::SceneText;
use serde_json::json;

use crate::beside;
use crate::scene::quoted;
use crate::shell::terminal::gathered;
use crate::shell::{Exit, Failure, print_json, read_text};
use crate::work::on_disk;

pub use lines::study as read;
pub use lines::{Lines, Used};

/// Run a study: a TOML file that says what is varied, what is measured, and what a paper claims
///
/// A `group` has lines, and each `group.line` measures scenes under overrides; `vary` repeats it for every member of
/// a list, a range, or every method. A `claim` is a condition on their figures: confirmed, not confirmed, or cannot be
/// told. Sections such as `map`, `limits` or `widths` run that verb with their keys as its options, and
/// `phantom-table-2` runs that study of `hpu reproduce`; their files come into a folder of their own. All measures and
/// their values stand in testbench/studies/README.md. With a folder, the same command goes on after an interruption.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The study's file, or the name of a study in testbench/studies
    #[arg(required_unless_present = "from")]
    file: Option<PathBuf>,
    /// Show the lines that a sweep has gathered in this folder
    #[arg(long, value_name = "DIR", conflicts_with = "file")]
    from: Option<PathBuf>,
    #[command(flatten)]
    to: beside::Args,
}

impl Args {
    /// Returns the folder of the sweep to show, if nothing is to be run.
    pub fn from(&self) -> Option<&Path> {
        self.from.as_deref()
    }

    fn file(&self) -> &Path {
        self.file.as_deref().unwrap_or(Path::new(""))
    }
}

fn command_of(file: &Path) -> String {
    format!("hpu study {}", quoted(&file.display().to_string()))
}

/// A command that was read and can be called.
pub type Call = Box<dyn FnOnce() -> Result<Exit, Failure>>;

/// Reads the words of a command.
type Again = fn(&[String]) -> Result<Call, clap::Error>;

/// The verbs that a study may call: those of `hpu`, and two of `hpu reproduce`.
pub const VERBS: [&str; 10] = ["run", "check", "limits", "map", "chart", "fit", "widths", "cost", TABLE_2, LADDER];

/// Returns a verb of a study as the words of a command.
pub fn verb(name: &str) -> Vec<&str> {
    if [TABLE_2, LADDER].contains(&name) { vec!["reproduce", name] } else { vec![name] }
}

/// Runs `hpu study`. `command` describes the whole command, `again` reads one.
pub fn run(args: &Args, command: &Command, again: Again) -> Result<Exit, Failure> {
    let (file, text) = text(args.file())?;
    let (study, used) = lines::study(&file, &text, Arc::new(on_disk))?;
    // Every section is read before the first is run.
    let mut wrong = Vec::new();
    let mut calls = Vec::new();
    for (index, section) in study.sections.iter().enumerate() {
        let before = study.sections[..index].iter().filter(|other| other.verb == section.verb).count();
        let folder = if before == 0 { section.verb.clone() } else { format!("{}-{}", section.verb, before + 1) };
        let files = written_within(section, args.to.out.as_ref().map(|out| out.join(&folder)).as_deref());
        let more = given(section, command, args, &folder);
        match files.and_then(|section| words(&section, command, more)) {
            Ok(words) => match again(&[own_words(section), words].concat()) {
                Ok(call) => calls.push((section.verb.as_str(), call)),
                Err(error) => wrong.push(format!("{}: {}", section.place, first_part(&error.to_string()))),
            },
            Err(errors) => wrong.extend(errors),
        }
    }
    if !wrong.is_empty() {
        return Err(Failure::file(wrong.join("\n")));
    }
    let lines = || of_lines(&study, &used, args, &text);
    if args.to.json && !calls.is_empty() {
        return as_one_object(&study, &command_of(args.file()), lines, calls);
    }
    let exit = lines()?;
    calls.into_iter().try_fold(exit, |exit, (_, call)| after(exit, call))
}

/// Measures the lines of a study, if it has any.
fn of_lines(study: &Study, used: &Used, args: &Args, text: &str) -> Result<Exit, Failure> {
    if study.comparison.lines.is_empty() {
        return Ok(Exit::Fine);
    }
    let used = used.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let scenes = used.into_values().flat_map(|scene| {
        let SceneText { text, files, .. } = scene;
        [text.into_bytes()].into_iter().chain(files.into_values())
    });
    let files: Vec<_> = [text.as_bytes().to_vec()].into_iter().chain(scenes).collect();
    beside::run(&study.comparison, &command_of(args.file()), &files, &args.to, None)
}

/// Calls a section's verb, unless the study was interrupted. Returns the exit of both.
fn after(exit: Exit, call: impl FnOnce() -> Result<Exit, Failure>) -> Result<Exit, Failure> {
    if exit == Exit::Interrupted {
        return Ok(exit);
    }
    let done = call()?;
    Ok(if done == Exit::Fine { exit } else { done })
}

/// Runs a study, and prints the results of its lines and of its sections as one JSON object. If a section fails, the
/// object has the sections before it.
fn as_one_object(
    study: &Study,
    command: &str,
    lines: impl FnOnce() -> Result<Exit, Failure>,
    calls: Vec<(&str, Call)>,
) -> Result<Exit, Failure> {
    let (ended, of_lines) = gathered(lines);
    let mut ended = ended?;
    if ended == Exit::Interrupted {
        return Ok(ended);
    }
    let mut sections = Vec::new();
    let mut failed = None;
    for (verb, call) in calls {
        let (done, results) = gathered(|| after(ended, call));
        sections.extend(results.into_iter().map(|result| json!({ "verb": verb, "result": result })));
        match done {
            Ok(exit) => ended = exit,
            Err(failure) => {
                failed = Some(failure);
                break;
            }
        }
    }
    let only_sections = || beside::object(&study.comparison, command, &[]);
    let mut object = of_lines.into_iter().next().unwrap_or_else(only_sections);
    object["complete"] = (failed.is_none() && ended != Exit::Interrupted).into();
    object["sections"] = sections.into();
    print_json(&object)?;
    failed.map_or(Ok(ended), Err)
}

/// The option of verbs that names a file to be written.
const WRITTEN: &str = "junit";

/// Returns a section whose written files are within its folder, wherever its verb is called. A study is often by
/// somebody else, who must not choose a place.
fn written_within(section: &Section, folder: Option<&Path>) -> Result<Section, Vec<String>> {
    let mut section = section.clone();
    for (key, place, values) in section.options.iter_mut().filter(|(key, ..)| key == WRITTEN) {
        let refused = |why: String| vec![format!("{place}: {}.{key}: {why}", section.verb)];
        let folder = folder.ok_or_else(|| refused("it writes a file; write hpu study -o DIR".into()))?;
        for value in values {
            let name: PlainName = value
                .parse()
                .map_err(|why| refused(format!("`{}` is {why}; its folder is that of -o", excerpt(value))))?;
            *value = folder.join(name.as_str()).display().to_string();
        }
    }
    Ok(section)
}

/// Returns name and text of a study's file: of the shipped study, if the name has no folder and no ending.
pub fn text(file: &Path) -> Result<(String, String), Failure> {
    let name = file.display().to_string();
    let is_name = !name.contains(['/', '.']);
    match shipped_texts().iter().find(|(own, _)| is_name && *own == name) {
        Some((_, text)) => Ok((format!("testbench/studies/{name}.toml"), (*text).to_string())),
        None => Ok((name, read_text(file)?)),
    }
}

fn key(arg: &Arg) -> String {
    arg.get_id().as_str().to_string()
}

fn arguments<'c>(section: &Section, command: &'c Command) -> Vec<&'c Arg> {
    let find = |command: &'c Command, word| command.find_subcommand(word).expect("a study's verbs are the command's");
    verb(&section.verb).into_iter().fold(command, find).get_arguments().collect()
}

/// Returns the options of a study that its section's command takes too.
fn given(section: &Section, command: &Command, args: &Args, folder: &str) -> Vec<String> {
    let takes = |name: &str| arguments(section, command).into_iter().any(|arg| key(arg) == name);
    let mut options = Vec::new();
    if let (Some(out), true) = (&args.to.out, takes("out")) {
        options.push(format!("--out={}", out.join(folder).display()));
    }
    if let (Some(jobs), true) = (args.to.jobs.given(), takes("jobs")) {
        options.push(format!("--jobs={jobs}"));
    }
    options.extend((args.to.json && takes("json")).then(|| "--json".to_string()));
    options
}

/// Returns the first words of a section's command: the program and the verb.
fn own_words(section: &Section) -> Vec<String> {
    ["hpu"].into_iter().chain(verb(&section.verb)).map(String::from).collect()
}

/// Returns the options of a section's command with these ones after its own, or what is wrong with its keys.
pub fn words(section: &Section, command: &Command, more: Vec<String>) -> Result<Vec<String>, Vec<String>> {
    let own = arguments(section, command);
    // These are the matter of the study's own command, and of the machine that it runs on.
    let given = ["out", "json", "jobs", "from", "cache"];
    let keys: Vec<String> = own.iter().map(|arg| key(arg)).filter(|key| !given.contains(&key.as_str())).collect();
    let (mut placed, mut options, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for (name, place, values) in &section.options {
        match own.iter().find(|arg| key(arg) == *name && keys.contains(name)) {
            Some(arg) if arg.is_positional() => placed.extend(values.iter().cloned()),
            Some(arg) => {
                let long = arg.get_long().unwrap_or(name);
                options.extend(values.iter().map(|value| format!("--{long}={value}")));
                options.extend(values.is_empty().then(|| format!("--{long}")));
            }
            None => {
                let names: Vec<&str> = keys.iter().map(String::as_str).collect();
                let accepted = names.join(", ");
                let near = did_you_mean(name, &names);
                errors.push(format!("{place}: {}.{name}: unknown key; accepted here: {accepted}{near}", section.verb));
            }
        }
    }
    options.extend(more);
    let words = options.into_iter().chain(["--".to_string()]).chain(placed).collect();
    if errors.is_empty() { Ok(words) } else { Err(errors) }
}

/// Returns the reason of an error of the command line, without the usage below it.
pub(crate) fn first_part(error: &str) -> String {
    let reason = error.split("\n\n").next().unwrap_or(error);
    reason.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ")
}
