//! `hpu widths SCENE --gappa`: the straight-line parts of the proof as a script, for an independent proof by Gappa.

use std::path::Path;

use hpu_cosim::PlainName;
use hpu_cosim::scene::Experiment;
use hpu_study::device;

use crate::shell::{Exit, Failure, Folder, print, print_file};

/// Prints a scene's script, or writes it into a folder.
pub fn run(experiment: &Experiment, out: Option<&Path>) -> Result<Exit, Failure> {
    let name = &experiment.name;
    let script = device(experiment).gappa().map_err(|why| Failure::file(format!("{name}: {why}")))?;
    match out {
        None => print_file(&script)?,
        Some(out) => {
            let mut folder = Folder::open(out)?;
            let file = format!("{}.g", PlainName::near(name));
            folder.write(&file, script)?;
            print(&format!("{}\n", folder.place(&file).display()))?;
            folder.commit()?;
        }
    }
    Ok(Exit::Fine)
}
