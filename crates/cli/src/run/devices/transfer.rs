//! A plant as a transfer function.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::scene::{Setup, Units};
use hpu_cosim::{Simulation, Summary, TRANSFER_REALS, Trace, TransferSimulation, Verdict, figure};
use hpu_page::Page;
use hpu_signal::Signal;
use serde_json::{Value, json};

use crate::run::device::{Shown, named, of_words};
use crate::run::simulate::Ran;
use crate::units::si;

impl Shown for TransferSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        let scene = self.scene();
        let kind = if scene.discrete { "discrete, a step a sample" } else { "continuous, exact flow" };
        page.line("device", format!("a plant of {} states, {kind}", self.order()));
        let output = ran.trace.real(output());
        let ends = output.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], &y| [l.min(y), m.max(y)]);
        if let (Some(first), Some(last)) = (output.first(), output.last()) {
            let [first, last, least, most] = [*first, *last, ends[0], ends[1]].map(figure);
            page.line("motion", format!("the output goes from {first} to {last}, between {least} and {most}"));
        }
        if let Some(said) = cycle(self, &ran.summary) {
            page.line("cycle", said);
        }
        page.line("energy", "not defined: input and output of a plant as data have no units");
        of_words(page, words(self), None);
    }

    fn realised(&self) -> Value {
        let (scene, words) = (self.scene(), self.words());
        json!({
            "adc_lsb": scene.adc.range.lsb(),
            "dac_lsb": scene.dac.lsb(),
            "sample_rate_hz": scene.clock.frequency_hz() as f64 / scene.adc.period as f64,
            "numerator": words.numerator,
            "denominator": words.denominator,
            "reference": words.reference,
        })
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), &chart::TRANSFER_NETS)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::transfer_pictures(self, trace, summary, command)
    }

    fn told_in(&self) -> Option<(Units, f64)> {
        Some((self.scene().units(), 1.0))
    }
}

fn output() -> usize {
    TRANSFER_REALS.iter().position(|real| real.name == "output").expect("a column")
}

/// Returns amplitude and period of a limit cycle in steps of the ADC and in samples.
fn cycle(simulation: &TransferSimulation, summary: &Summary) -> Option<String> {
    let Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. }) = summary.verdict else { return None };
    let scene = simulation.scene();
    let steps = figure(amplitude_rad / scene.adc.range.lsb());
    let samples = scene.clock.frequency_hz() as f64 / frequency_hz / scene.adc.period as f64;
    Some(format!("amplitude {steps} steps of the ADC, period {samples:.1} samples ({})", si(1.0 / frequency_hz, "s")))
}

fn words(simulation: &TransferSimulation) -> Vec<String> {
    let (scene, words) = (simulation.scene(), simulation.words());
    let [_, fraction] = scene.method.coefficient;
    let list = |all: &[i64]| all.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
    let rate = si(scene.clock.frequency_hz() as f64 / scene.adc.period as f64, "Hz");
    vec![
        format!(
            "errors times {}; outputs times {}; of 2^-{fraction}",
            list(&words.numerator),
            list(&words.denominator)
        ),
        format!("a step of the ADC is {}, of the DAC {}", figure(scene.adc.range.lsb()), figure(scene.dac.lsb())),
        format!("the reference is word {}; period {} clocks is {rate}", words.reference, scene.adc.period),
    ]
}
