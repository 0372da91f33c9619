//! `hpu limits`: how stiff a scene's wall may be.

use hpu_cosim::scene::Experiment;
use hpu_study::limits::{Criterion, Emulated, Limits, limits};
use serde_json::json;

use crate::exit::{Exit, Failure};
use crate::scene::{self, Loaded};
use crate::terminal::{print, print_json};

/// Tell how stiff a scene's wall may be: by the emulator, and by published criteria
///
/// The emulated limit is found by bisection on the verdict of the scene's linear, unquantised loop, over the wall's
/// stiffness, its damping fixed.
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
    // That there is no limit is a result.
    match limits(&scene) {
        Ok(found) if args.json => print_json(&object(&scene.name, &found))?,
        Ok(found) => print(&text(&scene.name, &found))?,
        Err(none) if args.json => {
            print_json(&json!({ "scene": scene.name, "criteria": [], "emulated": null, "reason": none.to_string() }))?;
        }
        Err(none) => print(&format!("{}: {none}\n", scene.name))?,
    }
    Ok(Exit::Fine)
}

fn object(scene: &str, Limits { criteria, emulated }: &Limits) -> serde_json::Value {
    let criteria = criteria.iter().map(|Criterion { name, limit, unit, assumptions_met, assumptions }| {
        json!({
            "name": name,
            "limit": limit,
            "unit": unit,
            "assumptions_met": assumptions_met,
            "assumptions": assumptions,
        })
    });
    let Emulated { limit, uncertainty, unit } = emulated;
    json!({
        "scene": scene,
        "criteria": criteria.collect::<Vec<_>>(),
        "emulated": { "limit": limit, "uncertainty": uncertainty, "unit": unit },
    })
}

fn text(scene: &str, Limits { criteria, emulated }: &Limits) -> String {
    let Emulated { limit, uncertainty, unit } = emulated;
    let mut text = format!("{scene}: stiffness at which the linear loop ceases to settle\n");
    text += &format!("{:<28} {limit:>14.9} {unit}, within {uncertainty:.1e}\n", "emulated");
    for Criterion { name, limit, unit, assumptions_met, assumptions } in criteria {
        let met = if *assumptions_met { "met" } else { "NOT met" };
        text += &format!("{name:<28} {limit:>14.9} {unit}, assumptions {met}: {assumptions}\n");
    }
    text
}
