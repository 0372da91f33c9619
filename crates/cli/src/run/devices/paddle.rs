//! The loop of EPFL's haptic paddle.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::scene::{Setup, Units};
use hpu_cosim::{PaddleSimulation, Simulation, Summary, Trace, number};
use hpu_page::Page;
use hpu_signal::{Format, Notation, Signal};
use serde_json::{Value, json};

use crate::run::axis::motion;
use crate::run::device::{Shown, named, of_words};
use crate::run::simulate::Ran;
use crate::units::si;

impl Shown for PaddleSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        let scene = self.scene();
        if ran.summary.verdict.is_some() {
            let who = format!("{} ", scene.network.wall_name());
            page.line("motion", motion(&who, (scene.units(), 1.0), None, &ran.trace));
        }
        of_words(page, words(self, ran.notation), None);
    }

    fn realised(&self) -> Value {
        let words = self.words();
        let frequency_hz = self.scene().clock.frequency_hz() as f64;
        json!({
            "count_rad": words.count_rad,
            "current_unit_a": words.unit_a,
            "zero_a": words.zero as f64 * words.unit_a,
            "current_rate_hz": frequency_hz / words.periods[1] as f64,
            "sample_rate_hz": frequency_hz / words.periods[2] as f64,
        })
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), &chart::PADDLE_NETS)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::paddle_pictures(self, trace, summary, command)
    }

    fn told_in(&self) -> Option<(Units, f64)> {
        Some((self.scene().units(), 1.0))
    }
}

fn words(simulation: &PaddleSimulation, notation: Notation) -> Vec<String> {
    let words = simulation.words();
    let [haptic, current] = [words.config.haptic.gain, words.config.current.gain];
    let gains = |format: Format, gains: &[i64]| {
        let all: Vec<_> = gains.iter().map(|&word| number(word as f64 * format.lsb())).collect();
        format!("{} of {}", all.join(", "), notation.of(format))
    };
    let frequency_hz = simulation.scene().clock.frequency_hz() as f64;
    let [adc, inner, outer] = words.periods.map(|period| format!("{period}"));
    let [adc_hz, inner_hz, outer_hz] = words.periods.map(|period| si(frequency_hz / period as f64, "Hz"));
    let [share, current_share] = words.shares;
    vec![
        format!("kp, ki, kd {} current units a count", gains(haptic, &words.gains)),
        format!("a count is {}, a current unit {}", si(words.count_rad, "rad"), si(words.unit_a, "A")),
        format!("current's gains and feed-forward {} steps a unit", gains(current, &words.current_gains)),
        format!("zero {} is {}", words.zero, si(words.zero as f64 * words.unit_a, "A")),
        format!("filters take {share} / 2^16 of an angle, {current_share} / 2^16 of a current"),
        format!("periods {adc}, {inner}, {outer} clocks are {adc_hz}, {inner_hz}, {outer_hz}"),
    ]
}
