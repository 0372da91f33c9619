//! The pictures of a run.

use hpu_chart as chart;
use hpu_cosim::{AnySimulation, AxisSimulation, WiredSimulation};

use crate::pictures::put;
use crate::run::Ran;
use crate::run::device::shown;
use crate::shell::exit::Failure;
use crate::shell::files::Folder;

/// Draws the pictures, and writes each as SVG and as PNG.
pub fn write(ran: &Ran, command: &str, folder: &mut Folder) -> Result<(), Failure> {
    let pictures = shown(ran.simulation).pictures(ran, command);
    // Where VHDL differs, the bits that its words have lost are unknown, and the picture of them is left out.
    let losses_seen = ran.summary.nets.iter().all(|net| net.losses_seen);
    let known = pictures.into_iter().filter(|picture| losses_seen || picture.name != "bits");
    known.into_iter().try_for_each(|picture| put(&picture, folder))
}

/// Draws two runs in one figure.
pub(crate) fn write_beside(runs: [&Ran; 2], command: &str, folder: &mut Folder) -> Result<(), Failure> {
    if let [AnySimulation::Dut(design), AnySimulation::Ours(WiredSimulation::Axis(ours))] =
        runs.map(|ran| ran.simulation)
    {
        let ours = chart_run(ours, runs[1], command);
        return put(&chart::dut_beside(design, &runs[0].trace, &runs[0].summary, &ours, command), folder);
    }
    let [AnySimulation::Ours(WiredSimulation::Axis(one)), AnySimulation::Ours(WiredSimulation::Axis(other))] =
        runs.map(|ran| ran.simulation)
    else {
        return Err(Failure::usage("only scenes of an axis are drawn side by side"));
    };
    let runs = [chart_run(one, runs[0], command), chart_run(other, runs[1], command)];
    put(&chart::side_by_side("Side by side", &runs, command), folder)
}

pub(crate) fn chart_run<'a>(simulation: &'a AxisSimulation, ran: &'a Ran, command: &'a str) -> chart::Run<'a> {
    chart::Run {
        scene: simulation.scene(),
        words: simulation.words(),
        trace: &ran.trace,
        summary: &ran.summary,
        command,
    }
}
