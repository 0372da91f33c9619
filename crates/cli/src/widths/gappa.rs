//! `hpu widths SCENE --gappa`: the straight-line parts of the proof as a script, for an independent proof by Gappa.

use std::path::Path;

use hpu_cosim::scene::Experiment;
use hpu_study::widths::proof::{axis_bounds, gappa, gappa_phantom};

use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::terminal::print;
use crate::widths::OF_YOURS;

/// Prints a scene's script, or writes it into a folder.
pub fn run(experiment: &Experiment, out: Option<&Path>) -> Result<Exit, Failure> {
    let (name, script) = match experiment {
        Experiment::Axis(scene) => (&scene.name, axis_bounds(scene).and_then(|proof| gappa(scene, &proof))),
        Experiment::Phantom(scene) => (&scene.name, gappa_phantom(scene)),
        Experiment::Dut(scene) => (&scene.name, Err(OF_YOURS.to_string())),
    };
    let script = script.map_err(|why| Failure::file(format!("{name}: {why}")))?;
    match out {
        None => print(&script)?,
        Some(out) => {
            let mut folder = Folder::open(out)?;
            folder.write(&format!("{name}.g"), script)?;
            print(&format!("{}\n", folder.place(&format!("{name}.g")).display()))?;
            folder.commit()?;
        }
    }
    Ok(Exit::Fine)
}
