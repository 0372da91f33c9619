//! `hpu limits`: how stiff a scene's wall may be.

use hpu_cosim::figure;
use hpu_cosim::scene::Experiment;
use hpu_study::criteria::{Assumption, Criterion, Figure, Region, Silent};
use hpu_study::limits::{Emulated, InWords, Limits, limits};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::parameters::{missed, missed_object};
use crate::scene::{self, Loaded};
use crate::terminal::{print, print_json};

/// Tell how stiff a scene's wall may be: by the emulator, and by published criteria
///
/// Two limits are found by bisection over the wall's stiffness, its damping fixed: on the verdict of the scene's
/// linear, unquantised loop, and on that of the scene as it stands, in words. Each criterion tells which of its
/// assumptions the scene does not meet, and what the scene has instead.
#[derive(clap::Args)]
pub struct Args {
    /// A scene's file, or the name of a shipped scene
    scene: String,
    #[command(flatten)]
    set: scene::Set,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// `hpu limits`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Experiment::Axis(scene) = Loaded::new(&args.scene, &args.set.set, None)?.scene else {
        let said = "limits are those of an axis; a PHANToM's are found by trials: hpu reproduce phantom-table-2";
        return Err(Failure::usage(said));
    };
    let found = limits(&scene);
    if args.json {
        print_json(&object(&scene.name, &found))?
    } else {
        print(&text(&scene.name, &found))?
    }
    // That there is no limit is a result.
    Ok(Exit::Fine)
}

fn object(scene: &str, found: &Limits) -> Value {
    let criteria = found.criteria.iter().map(|criterion| {
        let Criterion { name, limit, unit, .. } = criterion;
        let not_met = || criterion.assumptions.iter().filter(|assumption| !assumption.met);
        let figures = criterion
            .figures
            .iter()
            .map(|Figure { name, value, unit }| json!({ "name": name, "value": value, "unit": unit }));
        json!({
            "name": name,
            "limit": limit,
            "unit": unit,
            "assumptions_met": criterion.assumptions_met(),
            "assumptions": criterion.assumptions.iter().map(|assumption| assumption.text).collect::<Vec<_>>(),
            "not_met": not_met().map(|assumption| assumption.text).collect::<Vec<_>>(),
            "not_met_here": not_met().map(|assumption| &assumption.here).collect::<Vec<_>>(),
            "figures": figures.collect::<Vec<_>>(),
            "region": criterion.region.map(Region::name),
        })
    });
    let silent = found.silent.iter().map(|Silent { name, why }| json!({ "name": name, "reason": why }));
    let linear =
        |Emulated { limit, uncertainty, unit }| json!({ "limit": limit, "uncertainty": uncertainty, "unit": unit });
    let in_words = |InWords { emulated, runs }: InWords| {
        let mut object = linear(emulated);
        object["runs"] = json!(runs);
        object
    };
    json!({
        "scene": scene,
        "criteria": criteria.collect::<Vec<_>>(),
        "silent": silent.collect::<Vec<_>>(),
        "emulated": found.emulated.ok().map(linear),
        "reason": found.emulated.err().map(|none| none.to_string()),
        "emulated_words": found.in_words.as_ref().ok().copied().map(in_words),
        "emulated_words_reason": found.in_words.as_ref().err(),
        "stiffness_missed": found.stiffness_miss.as_ref().map(missed_object),
    })
}

fn text(scene: &str, found: &Limits) -> String {
    let mut text = format!("{scene}: the stiffest wall, by run and by criterion\n\n");
    let line = |name: &str, Emulated { limit, uncertainty, unit }: Emulated| {
        format!("{name:<22}{:>14} {unit:<8} within {uncertainty:.1e}", nine(limit))
    };
    text += &match found.emulated {
        Ok(emulated) => line("emulated, linear", emulated) + "\n",
        Err(none) => format!("{:<22}{none}\n", "emulated, linear"),
    };
    text += &match &found.in_words {
        Ok(InWords { emulated, runs }) => format!("{}, a word; {runs} runs\n", line("emulated, in words", *emulated)),
        Err(why) => format!("{:<22}{why}\n", "emulated, in words"),
    };
    if let Some(miss) = &found.stiffness_miss {
        text += &format!("{:<22}wall.{}\n", "warning", missed(miss, Some("method.stiffness_format")));
    }
    let assumptions = legend(&found.criteria);
    text += &format!(
        "\n{:<22}{:>14} {:<8} {:<6} assumptions, ! those that the scene does not meet\n",
        "criterion", "limit", "unit", "met"
    );
    for criterion in &found.criteria {
        let Criterion { name, limit, unit, .. } = criterion;
        let met = format!("{} of {}", criterion.met(), criterion.assumptions.len());
        let own = criterion.assumptions.iter().map(|assumption| {
            let letter =
                assumptions.iter().zip('a'..).find(|(known, _)| known == &assumption).map_or(' ', |found| found.1);
            if assumption.met { format!("{letter}") } else { format!("!{letter}") }
        });
        text += &format!("{name:<22}{:>14} {unit:<8} {met:<6} {}\n", nine(*limit), own.collect::<Vec<_>>().join(" "));
        let figures =
            criterion.figures.iter().map(|Figure { name, value, unit }| format!("{name} {} {unit}", figure(*value)));
        let region = criterion.region.map(|region| region.name().to_string());
        let here: Vec<_> = region.into_iter().chain(figures.map(|figure| figure.trim_end().to_string())).collect();
        if !here.is_empty() {
            text += &format!("{:<22}here: {}\n", "", here.join(", "));
        }
    }
    for Silent { name, why } in &found.silent {
        text += &format!("{name:<22}{:>14} {why}\n", "-");
    }
    text += "\n";
    for (Assumption { text: words, met, here }, letter) in assumptions.iter().zip('a'..) {
        let (mark, here) = if *met { (' ', String::new()) } else { ('!', format!("; here: {here}")) };
        text += &format!("{mark}{letter}  {words}{here}\n");
    }
    text
}

/// Nine decimals of a limit; of one that they would not show, its first digits.
fn nine(limit: f64) -> String {
    if limit == 0.0 || (1e-4..1e9).contains(&limit) { format!("{limit:.9}") } else { format!("{limit:.6e}") }
}

/// Every assumption once.
fn legend(criteria: &[Criterion]) -> Vec<Assumption> {
    let mut all: Vec<Assumption> = Vec::new();
    for assumption in criteria.iter().flat_map(|criterion| &criterion.assumptions) {
        if !all.contains(assumption) {
            all.push(assumption.clone());
        }
    }
    all
}
