//! The parts of a report that take longer than the run: made here, or taken from a folder.

use std::path::Path;

use clap::ValueEnum;
use hpu_cosim::figure;
use hpu_cosim::scene::{Experiment, Setup};
use hpu_page::Page;

use super::Part;
use super::folder;
use super::scene::SceneReport;
use crate::answers;
use crate::document::Content;
use crate::page::Answer;
use crate::scene::quoted;
use crate::shell::progress::doing;
use crate::shell::{Failure, Watch};
use crate::{check, cost};

/// Returns the parts of a scene: those in the folder, and those that were asked for; `None` when interrupted.
pub fn parts(
    report: &SceneReport,
    with: &[Part],
    from: Option<&Path>,
    watch: Watch,
) -> Result<Option<Vec<(Part, Content)>>, Failure> {
    let mut all = Vec::new();
    for part in Part::value_variants() {
        let kept = from.map(|dir| taken(report, *part, dir)).transpose()?.flatten();
        let content = match kept {
            Some(content) => content,
            None if with.contains(part) => match made(report, *part, watch)? {
                Some(content) => content,
                None => return Ok(None),
            },
            None => continue,
        };
        all.push((*part, content));
    }
    Ok(Some(all))
}

/// Makes a part; `None` when interrupted.
fn made(report: &SceneReport, part: Part, watch: Watch) -> Result<Option<Content>, Failure> {
    doing(part.name());
    let named = (report.scene.clone(), report.source.clone());
    let mut words: Vec<String> =
        report.set.iter().flat_map(|(key, value)| ["--set".to_string(), format!("{key}={value}")]).collect();
    let alone = |page: Page| Answer { page, pictures: Vec::new() };
    let (answer, by) = match part {
        Part::Widths => (answers::widths(&[named], &words, watch)?, report.command("widths")),
        Part::Limits => (answers::limits(&named, &words, watch)?, report.command("limits")),
        Part::Map => {
            let axes = axes(report)?;
            let options = axes.iter().map(|(name, axis)| format!(" --{name} {}", quoted(axis))).collect::<String>();
            words.extend(axes.into_iter().flat_map(|(name, axis)| [format!("--{name}"), axis]));
            (answers::map(&named, &words, watch)?, report.command("map") + &options)
        }
        Part::Check => {
            let by = of_scene(report, "check");
            let found = check::answer(&answers::read("check", &of(report, words), &[])?)?;
            return Ok(found.map(|(page, bits)| {
                let content = Content::new(&by, &page, &[]);
                Content { html: content.html + &bits, ..content }
            }));
        }
        Part::Formal => {
            let words = [of(report, words), vec!["--formal".into()]].concat();
            let found = check::prove::answer(&answers::read("check", &words, &[])?)?;
            (found.map(alone), of_scene(report, "check --formal"))
        }
        Part::Cost => {
            (cost::answer(&answers::read("cost", &of(report, words), &[])?)?.map(alone), of_scene(report, "cost"))
        }
    };
    Ok(answer.filter(|_| !watch.is_stopped()).map(|Answer { page, pictures }| {
        let pictures: Vec<String> = pictures.into_iter().map(|picture| picture.svg).collect();
        Content::new(&by, &page, &pictures)
    }))
}

/// Returns the options of a verb that takes scenes by `--scene`.
fn of(report: &SceneReport, words: Vec<String>) -> Vec<String> {
    [vec!["--scene".to_string(), report.scene.clone()], words].concat()
}

/// Returns the command of such a verb.
fn of_scene(report: &SceneReport, verb: &str) -> String {
    report.command(&format!("{verb} --scene"))
}

/// Returns the axes of a map around a scene's wall.
fn axes(report: &SceneReport) -> Result<[(&'static str, String); 2], Failure> {
    let refused = || {
        let said = "a map around the wall is of an axis whose wall has stiffness and damping; make another by \
                    hpu map -o DIR, and take it by --from DIR";
        Failure::usage(format!("{}: {said}", report.name()))
    };
    let Experiment::Axis(scene) = report.run.scene() else { return Err(refused()) };
    let wall = scene.written_wall();
    let (stiffness, damping) = (wall.stiffness_nm_per_rad, wall.damping_nm_s_per_rad);
    if stiffness <= 0.0 || damping <= 0.0 || scene.target.is_some() {
        return Err(refused());
    }
    let units = scene.units();
    let [low, high, most] = [stiffness / 4.0, stiffness * 4.0, damping * 4.0].map(figure);
    Ok([
        ("x", format!("wall.stiffness={low}..{high} {}:11:log", units.stiffness)),
        ("y", format!("wall.damping=0..{most} {}:7:lin", units.damping)),
    ])
}

/// Returns the names of the files that hold a part, without extension: of its table, and of its pictures.
fn files(part: Part) -> &'static [&'static str] {
    match part {
        Part::Widths => &["widths", "ranges"],
        Part::Limits => &["limits"],
        Part::Map => &["map"],
        Part::Check => &["check"],
        Part::Formal => &["formal"],
        Part::Cost => &["cost"],
    }
}

/// Takes a part from a folder, or from the folder of its name in it; `None` if neither has it.
fn taken(report: &SceneReport, part: Part, dir: &Path) -> Result<Option<Content>, Failure> {
    for dir in [dir.join(part.name()), dir.to_path_buf()] {
        let is_there = |stem: &str| {
            ["svg", "txt", "csv", "json"].into_iter().any(|end| dir.join(stem).with_extension(end).is_file())
        };
        let stems: Vec<&str> = files(part).iter().copied().filter(|stem| is_there(stem)).collect();
        if stems.is_empty() {
            continue;
        }
        of_the_scene(report, &dir.join(stems[0]).with_extension("json"))?;
        let mut html = String::new();
        for stem in stems {
            html += &folder::shown(&dir, stem)?;
        }
        return Ok(Some(Content { html, by: format!("taken from {}", dir.display()), ..Content::default() }));
    }
    Ok(None)
}

/// Checks that a kept result is of this scene, if it says of which.
fn of_the_scene(report: &SceneReport, path: &Path) -> Result<(), Failure> {
    if !path.is_file() {
        return Ok(());
    }
    let found = folder::json(path)?;
    let named = found["scene"].as_str().or(found["scenes"][0].as_str()).or(found["loops"][0]["scene"].as_str());
    match named.filter(|scene| ![report.name(), &report.scene].contains(scene)) {
        Some(other) => Err(Failure::at(path, format!("it is of {other}, not of {}", report.name()))),
        None => Ok(()),
    }
}
