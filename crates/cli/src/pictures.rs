//! The pictures of a run.

use hpu_study::chart::{self, Picture, run_pictures};

use crate::exit::Failure;
use crate::files::Folder;
use crate::run::Ran;

/// Draws and writes them, each as SVG and as PNG.
pub fn write(ran: &Ran, command: &str, folder: &mut Folder) -> Result<(), Failure> {
    run_pictures(&chart_run(ran, command)).into_iter().try_for_each(|picture| put(&picture, folder))
}

/// Draws two runs in one figure.
pub fn write_beside(runs: [&Ran; 2], command: &str, folder: &mut Folder) -> Result<(), Failure> {
    put(&chart::side_by_side("Side by side", &runs.map(|ran| chart_run(ran, command)), command), folder)
}

fn chart_run<'a>(ran: &'a Ran, command: &'a str) -> chart::Run<'a> {
    chart::Run {
        scene: ran.session.scene(),
        words: ran.session.words(),
        trace: &ran.trace,
        summary: &ran.summary,
        command,
    }
}

fn put(Picture { name, svg, png }: &Picture, folder: &mut Folder) -> Result<(), Failure> {
    folder.write(&format!("{name}.svg"), svg)?;
    folder.write(&format!("{name}.png"), png)
}
