//! The picture of a plant as a transfer function: output and reading beside the reference, input, and words.

use hpu_cosim::{Summary, TRANSFER_REALS, Trace, TransferSimulation, Verdict, figure};

use crate::drawing::canvas::{Canvas, WIDTH};
use crate::drawing::panel::{Panel, around};
use crate::drawing::series::{BLUE, GREEN, Look, ORANGE};
use crate::drop::column;
use crate::{Picture, page, rate, thinned};

/// The nets that a trace must hold for [`transfer_pictures`], in this order.
pub const TRANSFER_NETS: [&str; 4] = ["reading", "command", "error", "output"];

const REFERENCE: usize = 0;
const OUTPUT: usize = 2;
const INPUT: usize = 3;
const _: () = assert!(TRANSFER_REALS.len() == INPUT + 1);

/// Returns the pictures of a run; none of a run without a row.
pub fn transfer_pictures(
    simulation: &TransferSimulation,
    trace: &Trace,
    summary: &Summary,
    command: &str,
) -> Vec<Picture> {
    if trace.rows() == 0 {
        return Vec::new();
    }
    let scene = simulation.scene();
    let lsb = scene.adc.range.lsb();
    let clock_hz = scene.clock.frequency_hz() as f64;
    let outcome = match (summary.aborted, summary.verdict) {
        (Some(abort), _) => format!("diverged, ended at {} s", figure(abort.at_s)),
        (None, Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. })) => {
            format!("limit cycle of {} steps of the ADC at {} Hz", figure(amplitude_rad / lsb), figure(frequency_hz))
        }
        (None, Some(Verdict::Settled { .. })) => "settled within a step of the ADC".to_string(),
        (None, Some(Verdict::Diverged { amplitude_rad, .. })) => format!("diverged, to {}", figure(amplitude_rad)),
        (None, Some(_)) => "too short to tell".to_string(),
        (None, None) => "interrupted".to_string(),
    };
    let conditions = format!(
        "sampled at {}; a step of the ADC is {}, of the DAC {}{}",
        rate(clock_hz / scene.adc.period as f64),
        figure(lsb),
        figure(scene.dac.lsb()),
        thinned(trace)
    );
    let mut canvas = page(&format!("{}: {outcome}", scene.name), &conditions, command);
    let whole_s = 0.0..summary.motion_s.max(1e-9);
    let panel = |canvas: &mut Canvas, [top, bottom]: [i32; 2], label, legend: &[(&str, Look)], values: Vec<f64>| {
        let y = around(values.into_iter(), 0.08);
        let panel = Panel { left: 190, top, right: WIDTH - 120, bottom, x: whole_s.clone(), y };
        panel.frame(canvas, legend, (bottom > 1100).then_some("time in s"), label);
        panel
    };
    let of = |index: usize| column(trace, index, 1.0);
    let values = |index: usize| of(index).map(|point| point.1);
    let legend = [("output", Look::Line(BLUE)), ("reference", Look::Line(ORANGE))];
    let both = values(OUTPUT).chain(values(REFERENCE)).collect();
    let top = panel(&mut canvas, [200, 620], "output", &legend, both);
    top.curve(&mut canvas, of(OUTPUT), BLUE, 6);
    top.curve(&mut canvas, of(REFERENCE), ORANGE, 3);
    let middle = panel(&mut canvas, [700, 940], "input", &[("input", Look::Line(GREEN))], values(INPUT).collect());
    middle.curve(&mut canvas, of(INPUT), GREEN, 4);
    let word = |net: usize| trace.times_s().zip(trace.words(net).iter().map(|&word| word as f64));
    let legend = [("command", Look::Line(GREEN)), ("reading", Look::Line(BLUE))];
    let both = [0, 1].into_iter().flat_map(|net| word(net).map(|point| point.1)).collect();
    let bottom = panel(&mut canvas, [1020, 1240], "words", &legend, both);
    bottom.curve(&mut canvas, word(1), GREEN, 4);
    bottom.curve(&mut canvas, word(0), BLUE, 4);
    vec![canvas.render("motion")]
}
