//! The pictures of a run.

use hpu_chart as chart;
use hpu_cosim::{AnySimulation, AxisSimulation, Summary, Trace, WiredSimulation};

use crate::run::device::shown;
use crate::run::simulate::Ran;
use crate::shell::{Failure, Folder};

/// Draws the pictures, and writes each as SVG and as PNG.
pub fn write(ran: &Ran, command: &str, folder: &mut Folder) -> Result<(), Failure> {
    let pictures = shown(ran.simulation).pictures(&ran.trace, &ran.summary, command);
    // Where VHDL differs, the bits that its words have lost are unknown, and the picture of them is left out.
    let losses_seen = ran.summary.nets.iter().all(|net| net.losses_seen);
    let known = pictures.into_iter().filter(|picture| losses_seen || picture.name != "bits");
    known.into_iter().try_for_each(|picture| folder.draw(&picture))
}

/// Draws two runs in one figure.
pub fn write_beside<'r>([one, other]: [&'r Ran; 2], command: &'r str, folder: &mut Folder) -> Result<(), Failure> {
    use AnySimulation::{Dut, Ours};
    use WiredSimulation::Axis;
    let run = |axis, ran: &'r Ran| chart_run(axis, &ran.trace, &ran.summary, command);
    match [one.simulation, other.simulation] {
        [Dut(design), Ours(Axis(ours))] => {
            folder.draw(&chart::dut_beside(design, &one.trace, &one.summary, &run(ours, other), command))
        }
        [Ours(Axis(first)), Ours(Axis(second))] => {
            let runs = [run(first, one), run(second, other)];
            folder.draw(&chart::side_by_side("Side by side", &runs, command))
        }
        _ => Err(Failure::usage("only scenes of an axis are drawn side by side")),
    }
}

/// Returns a run of an axis as pictures take it.
pub fn chart_run<'a>(
    simulation: &'a AxisSimulation,
    trace: &'a Trace,
    summary: &'a Summary,
    command: &'a str,
) -> chart::Run<'a> {
    chart::Run { scene: simulation.scene(), words: simulation.words(), trace, summary, command }
}
