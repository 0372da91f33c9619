//! `hpu widths SCENE --search` for a PHANToM: text, JSON and CSV.

use std::path::PathBuf;

use hpu_cosim::scene::PhantomScene;
use hpu_study::fit::percent;
use hpu_study::map::SceneText;
use hpu_study::widths::search::Ended;
use hpu_study::widths::search::phantom::{
    Design, ESTIMATE_ERROR, FIELDS, Found, Knob, Plan, Point, csv, key, proved, search,
};
use serde_json::{Map, Value, json};

use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::scene::{quoted, set_options};
use crate::terminal::{print, print_json};
use crate::widths_search::Asked;
use crate::{interrupt, progress};

/// Rows of the front in the text.
const ROWS: usize = 40;

/// A complete search.
struct Searched<'a> {
    found: &'a Found,
    base: &'a PhantomScene,
    knobs: &'a [Knob],
    within: f64,
    lose: f64,
    command: String,
    scene: &'a str,
}

/// Runs a search; `knobs` are the widths that the command names.
pub fn run(
    (text, base): (&SceneText, &PhantomScene),
    knobs: Vec<Knob>,
    within: f64,
    lose: f64,
    asked: &Asked,
) -> Result<Exit, Failure> {
    if asked.prices.is_some() {
        return Err(Failure::usage(format!(
            "{}: Yosys takes minutes for each loop of a PHANToM; leave out --price",
            asked.scenes[0]
        )));
    }
    let mut command = format!("hpu widths {}{} --search", quoted(&asked.scenes[0]), set_options(asked.set));
    command.extend(knobs.iter().map(|knob| format!(" --vary {knob}")));
    command += &asked.within.map_or(String::new(), |within| format!(" --within {within}"));
    if lose != 0.01 {
        command += &format!(" --lose {lose}");
    }
    let knobs = if knobs.is_empty() { Knob::usual(base) } else { knobs };
    let folder = asked.out.map(Folder::open).transpose()?;
    let plan = Plan { within, jobs: asked.jobs };
    let ended =
        search((text, asked.set), &knobs, plan, interrupt::heed(), |runs| progress::note(format!("{runs} runs")));
    progress::note("");
    let found = match ended {
        Ok(found) => found,
        Err(Ended::Refused(error)) => return Err(Failure::file(format!("{}: {error}", text.name))),
        Err(Ended::Stopped) => {
            print("interrupted; the same command begins anew\n")?;
            return Ok(Exit::Interrupted);
        }
        Err(Ended::Kept(never)) => match never {},
    };
    let searched = Searched { found: &found, base, knobs: &knobs, within, lose, command, scene: &asked.scenes[0] };
    let files = folder.map(|folder| searched.write(folder)).transpose()?.unwrap_or_default();
    if asked.json {
        print_json(&searched.object(&files))?
    } else {
        print(&searched.text())?
    }
    Ok(Exit::Fine)
}

impl Searched<'_> {
    fn write(&self, mut folder: Folder) -> Result<Vec<PathBuf>, Failure> {
        folder.write("designs.csv", csv(self.found, self.base, &self.command))?;
        folder.write("search.txt", self.text())?;
        let files = folder.places().map(PathBuf::from).collect();
        folder.commit()?;
        Ok(files)
    }

    /// Returns the result as text of 120 columns.
    fn text(&self) -> String {
        let found = self.found;
        let mut text = format!("{}: which widths buy what\n", self.scene);
        let mut line = |name: &str, said: String| text += &format!("{name:<11}{said}\n");
        line("varied", self.knobs.iter().map(ToString::to_string).collect::<Vec<_>>().join("  "));
        let refused: usize = found.refused.iter().map(|(_, count)| count).sum();
        line(
            "designs",
            format!(
                "{}, of which {refused} are no scene's, and {} are off by more than {}",
                found.designs,
                found.off,
                percent(self.within)
            ),
        );
        for (why, count) in found.refused.iter().take(2) {
            let short: String = why.chars().take(98).collect();
            line("", format!("{count}: {short}"));
        }
        let saved = 1.0 - found.runs as f64 / found.grid_runs.max(1) as f64;
        let saved = if saved > 0.0 { format!("{} saved", percent(saved)) } else { "none saved".into() };
        line("runs", format!("{}, where the grid takes {} or more: {saved}", found.runs, found.grid_runs));
        for why in found.failed.iter().take(2) {
            line("failed", why.chars().take(98).collect());
        }
        line("reference", found.reference.design.to_string());
        let outputs: Vec<_> = found.outputs.iter().map(|output| output.name()).collect();
        line("error", format!("worst of {} against the reference's, measured", outputs.join(", ")));
        line(
            "stiffness",
            format!(
                "the stiffest wall up to which all are passive, in steps of 2^(1/16) from {} N/m; measured; `+`: none is stiffer",
                found.own_n_per_m
            ),
        );
        line("block RAM", "of the tables of three joints, on the iCE40; computed from the words".into());
        line(
            "cells",
            format!(
                "of an iCE40 HX8K, estimated from the words: within {} on the blocks and loops that were counted",
                percent(ESTIMATE_ERROR)
            ),
        );
        line(
            "tip",
            "and torque: proved, for every posture in the tables; torque of its joint's full scale, forces as words"
                .into(),
        );
        text += &format!(
            "\n{:<10} {:>5} {:>4} {:>6} {:>8} {:>9} {:>5} {:>6} {:>5} {:>6} {:>9} {:>10} {:>9} {:>8}\n",
            "",
            "depth",
            "trig",
            "length",
            "position",
            "stiffness",
            "force",
            "torque",
            "RAM",
            "cells",
            "error",
            "N/m",
            "tip um",
            "torque %"
        );
        text += &self.row("reference", &found.reference);
        for (index, point) in found.front.iter().enumerate().take(ROWS) {
            text += &self.row(if index == 0 { "front" } else { "" }, point);
        }
        if found.front.len() > ROWS {
            text += &format!("{:<11}and {} more: -o DIR writes all\n", "", found.front.len() - ROWS);
        }
        text += "\n";
        match found.smallest(self.lose) {
            None => text += &format!("no design keeps the reference's stiffness within {}\n", percent(self.lose)),
            Some(point) => {
                text += &format!(
                    "the least block RAM that keeps the reference's stable stiffness within {}\n  {}\n  {} block RAMs instead of {}",
                    percent(self.lose),
                    point.design,
                    point.rams,
                    found.reference.rams
                );
                if let (Some(ours), Some(theirs)) = (point.cells, found.reference.cells) {
                    text += &format!(", {ours} cells instead of {theirs}, estimated");
                }
                text += "\n";
            }
        }
        text
    }

    fn row(&self, name: &str, point: &Point) -> String {
        let [depth, trig, length, tip, stiffness, force, torque] = FIELDS.map(|field| point.design.get(field));
        let cells = point.cells.map_or("-".into(), |cells| cells.to_string());
        let bounds = proved(self.base, &point.design);
        let (tip_um, torque_percent) = bounds.map_or_else(
            |_| ("-".into(), "-".into()),
            |(tip_m, share)| (format!("{:.3}", 1e6 * tip_m), format!("{:.5}", 100.0 * share)),
        );
        let found = format!("{:.1}{}", self.found.stiffness_n_per_m(point), if point.capped { "+" } else { "" });
        format!(
            "{name:<10} {depth:>5} {trig:>4} {length:>6} {tip:>8} {stiffness:>9} {force:>5} {torque:>6} {:>5} {cells:>6} {:>9} \
             {found:>10} {tip_um:>9} {torque_percent:>8}\n",
            point.rams,
            percent(point.error)
        )
    }

    /// Returns the result as JSON.
    fn object(&self, files: &[PathBuf]) -> Value {
        let found = self.found;
        let widths = |design: &Design| -> Map<String, Value> {
            FIELDS.map(|field| (key(field).to_string(), json!(design.get(field)))).into_iter().collect()
        };
        let point = |point: &Point| {
            let bounds = proved(self.base, &point.design).ok();
            json!({
                "widths": widths(&point.design),
                "block_rams": point.rams,
                "cells_estimated": point.cells,
                "error": point.error,
                "stable_stiffness": found.stiffness_n_per_m(point),
                "capped": point.capped,
                "tip_error_m_proved": bounds.map(|(tip_m, _)| tip_m).filter(|bound| bound.is_finite()),
                "torque_error_proved": bounds.map(|(_, torque)| torque).filter(|bound| bound.is_finite()),
            })
        };
        json!({
            "scene": self.scene,
            "command": self.command,
            "unit": "N/m",
            "outputs": found.outputs.iter().map(|output| output.name()).collect::<Vec<_>>(),
            "varied": self.knobs.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "designs": found.designs,
            "refused": found.refused.iter().map(|(why, count)| json!({ "reason": why, "designs": count })).collect::<Vec<_>>(),
            "off": found.off,
            "runs": found.runs,
            "grid_runs_at_least": found.grid_runs,
            "failed": found.failed,
            "within": self.within,
            "estimate_error": ESTIMATE_ERROR,
            "reference": point(&found.reference),
            "front": found.front.iter().map(point).collect::<Vec<_>>(),
            "smallest": found.smallest(self.lose).map(point),
            "files": files,
        })
    }
}
