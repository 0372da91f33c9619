//! The pictures of a run.

use hpu_chart::{self as chart, run_pictures};
use hpu_cosim::{AnyRig, Ready, Session};

use crate::exit::Failure;
use crate::files::Folder;
use crate::pictures::put;
use crate::run::Ran;

/// Draws the pictures, and writes each as SVG and as PNG.
pub fn write(ran: &Ran, command: &str, folder: &mut Folder) -> Result<(), Failure> {
    let pictures = match ran.session {
        AnyRig::Ours(Ready::Axis(session)) => run_pictures(&chart_run(session, ran, command)),
        AnyRig::Ours(Ready::Phantom(session)) => chart::drop_pictures(session, &ran.trace, &ran.summary, command),
        AnyRig::Dut(session) => chart::dut_pictures(session, &ran.trace, &ran.summary, command),
    };
    // Where VHDL differs, the bits that its words have lost are unknown, and the picture of them is left out.
    let losses_seen = ran.summary.nets.iter().all(|net| net.losses_seen);
    let known = pictures.into_iter().filter(|picture| losses_seen || picture.name != "bits");
    known.into_iter().try_for_each(|picture| put(&picture, folder))
}

/// Draws two runs in one figure.
pub fn write_beside(runs: [&Ran; 2], command: &str, folder: &mut Folder) -> Result<(), Failure> {
    if let [AnyRig::Dut(design), AnyRig::Ours(Ready::Axis(ours))] = runs.map(|ran| ran.session) {
        let ours = chart_run(ours, runs[1], command);
        return put(&chart::dut_beside(design, &runs[0].trace, &runs[0].summary, &ours, command), folder);
    }
    let [AnyRig::Ours(Ready::Axis(one)), AnyRig::Ours(Ready::Axis(other))] = runs.map(|ran| ran.session) else {
        return Err(Failure::usage("only scenes of an axis are drawn side by side"));
    };
    let runs = [chart_run(one, runs[0], command), chart_run(other, runs[1], command)];
    put(&chart::side_by_side("Side by side", &runs, command), folder)
}

fn chart_run<'a>(session: &'a Session, ran: &'a Ran, command: &'a str) -> chart::Run<'a> {
    chart::Run { scene: session.scene(), words: session.words(), trace: &ran.trace, summary: &ran.summary, command }
}
